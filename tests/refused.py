"""The whole text and the place of what readers refuse, by the tables of their tests; ``generated`` writes it anew."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import test_click_files as click
import test_dpide_files as operands
import test_dpide_st as dpide
import test_ezlogix_tags as tags
import test_listings as listings
import test_live_maps as maps
import test_nextopid_moves as moves
import test_nextopid_plcopen as plcopen
import test_nextopid_st as nextopid
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.listing import ListingError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

FOLDER = Path(__file__).parent / "data" / "refused"
SHOWN = 60
"""Characters of a case that stand beside what is said of it."""


def rows(test: Any) -> Iterable[Any]:
    """The cases of a test."""
    return test.pytestmark[0].args[1]


def told(read: Callable[[str], object], text: str, case: str = "") -> str:
    """What is said of a text, in a line behind the case."""
    shown = json.dumps(case or text)[: SHOWN + 1]
    try:
        read(text)
    except (ListingError, DecodeError) as error:
        place = f"{error.line}:{error.column}" if isinstance(error, ListingError) else "-"
        return f"{shown} {place} {json.dumps(str(error), ensure_ascii=False)}\n"
    return f"{shown} is read\n"


def _nextopid() -> Iterator[str]:
    for statements, *_ in rows(nextopid.test_refused):
        yield told(nextopid.read_st, nextopid.body(statements, nextopid.OTHER_VARIABLES), statements)
    for variables, _ in rows(nextopid.test_declarations_that_are_refused):
        yield told(nextopid.read_st, nextopid.body("A();", variables), variables)
    for statements, _ in rows(nextopid.test_what_is_written_over_is_refused_where_a_block_reads_it):
        yield told(nextopid.read_st, nextopid.changed_body(statements, nextopid.WRITTEN_OVER), statements)
    for statements, *_ in rows(moves.test_what_a_configuration_cannot_have_is_refused_at_its_line):
        yield told(moves.hand, statements)
    for text, *_ in rows(plcopen.test_refused):
        yield told(plcopen.read_plcopen, text, text[-SHOWN:])


def _dpide() -> Iterator[str]:
    for text, *_ in rows(dpide.test_what_cannot_be_read_is_refused_with_its_place):
        yield told(dpide.again, text)
    block = (dpide.DATA / "manual-4.hand.st").read_text("utf-8")
    for old, new, _ in rows(dpide.test_a_spoiled_function_block_is_refused):
        yield told(dpide.again, block.replace(old, new or ""), new)
    for name in ("PID_RUN", "CYCLE", "I_MV", "MV"):
        for how, text in dpide.spoils(dpide.by_name(), name):
            yield told(dpide.again, text, f"{name} {how}")
    table = operands.BY_HAND + operands.BLOCK_ROW
    for old, new, _ in rows(operands.test_a_table_that_is_wrong_is_refused_with_its_line):
        yield told(operands.FORMATS["operands"].read, table.replace(old, new), new)
    for document, _ in operands.HOSTILE:
        yield told(partial(operands.read_back, "json"), json.dumps(document))


def _click() -> Iterator[str]:
    for row in click.HOSTILE_ROWS:
        yield told(click.NICKNAMES.read, f'{click.HEAD}\nC7,BIT,"ok",1,No,"two\nlines"\n{row}\n', row)
    for row in click.HOSTILE_VIEWS:
        yield told(click.DATAVIEW.read, f"-1,0,0\r\nDF9,257,0\r\n{row}\r\n,0\r\n", row)


def _others() -> Iterator[str]:
    for row in tags.HOSTILE:
        yield told(tags.TAGS.read, f"{tags.HEAD}\nOK,R9,word,1,,,\n{row}\n", row)
    for text, *_ in rows(maps.test_maps_that_are_none):
        yield told(partial(maps.read_map, space=maps.MAP_SPACE), text)
    for text, _ in rows(listings.test_what_stays_refused):
        yield told(partial(listings.read_spelling, "dl06"), text)
    for text, *_ in rows(listings.test_what_is_no_record_is_refused_at_its_line):
        yield told(listings.read_bytes, text)


BOOKS: dict[str, Callable[[], Iterable[str]]] = {
    "nextopid": _nextopid,
    "dpide": _dpide,
    "click": _click,
    "others": _others,
}


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """All books, or those that are wanted."""
    return {FOLDER / f"{name}.txt": "".join(make()).encode() for name, make in BOOKS.items() if wanted(name)}
