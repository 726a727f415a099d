"""The whole text and the place of what readers refuse, by the tables of their tests; ``generated`` writes it anew."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pidcfg
import test_click_files as click
import test_dpide_files as operands
import test_dpide_st as dpide
import test_dpide_symbols as symbols
import test_ezlogix_tags as tags
import test_listings as listings
import test_live_maps as maps
import test_nextopid_moves as moves
import test_nextopid_plcopen as plcopen
import test_nextopid_st as nextopid
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.decoding import read_listing
from pidcfg.encoders.dpide.st_scope import read_symbols
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.modbus_map import UnusableMapError
from pidcfg.text.reader import DEFAULT
from pidcfg.validate.map_files import MapFile, numbering_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

FOLDER = Path(__file__).parent / "data" / "refused"
SHOWN = 60
"""Characters of a case that stand beside what is said of it."""


WORDS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "click": (
        ("C1", "2", ""), ("C1", "", "2"), ("C2001", "1", ""), ("X1", "1", ""), ("DS1", "FFFFF", ""), ("DS1", "G", ""),
        ("DS1", "000A", "11"), ("DS1", "000A", "10"), ("DS1", "", "40000"), ("DS1", "", "-32768"), ("DF501", "0", ""),
        ("DF1", "3FC00000", "2.5"), ("DF1", "3FC00000", "1.5"), ("DF1", "7F800000", ""), ("DF1", "", "1e39"),
        ("", "1", ""), ("DS1", "", ""),
    ),
    "ezlogix": (
        ("R1", "10000", ""), ("R1", "000A", "11"), ("S1", "2", ""), ("S1", "1", "0"), ("R0", "0", ""), ("IR1", "0", ""),
        ("R1", "", "65536"), ("R1", "", "-1"), ("R1", "", "1.5"), ("R65536", "0", ""),
    ),
    "dl06": (
        ("V2000", "10000", ""), ("V2000", "0408", "1031"), ("V2000", "0408", "1032"), ("V2008", "0", ""),
        ("V200000", "0", ""), ("V2000", "", "65536"), ("V2000", "", "0408"), ("C0", "1", ""), ("V2000", "0x10", ""),
    ),
}  # fmt: skip
"""Words of listings: an address, its content in hexadecimal digits, and as a number."""
PARAMETERS = (
    ("A.SV", "REAL", "x"), ("A.SV", "REAL", "1e39"), ("A.SV", "REAL", "1,5"), ("A.SV", "FLOAT", "1"), ("A.SV", "", "1"),
    ("A.CYCLE", "DINT", "1.5"), ("A.CYCLE", "DINT", "2147483648"), ("A.CYCLE", "INT", "32768"), ("A.N", "UINT", "-1"),
    ("A.RUN", "BOOL", "2"), ("A.RUN", "BOOL", "TRUE"), ("A.RUN", "BOOL", "1"), ("A.T", "TIME", "1500"),
    ("A.T", "TIME", "1 s"), ("A.M", "AUTOTUNE_MODE", "AUTOTUNE_X"), ("A.M", "AUTOTUNE_MODE", "AUTOTUNE_PI"),
    ("", "REAL", "1.0"), ("A.SV", "REAL", ""), ("A.SV", "REAL", "= B + 1"), ("A.SV", "LREAL", "1e39"),
)  # fmt: skip
"""Parameters of listings: a name, a type and a value."""


def rows(test: Any) -> Iterable[Any]:
    """The cases of a test."""
    return test.pytestmark[0].args[1]


def told(read: Callable[[str], object], text: str, case: str = "") -> str:
    """What is said of a text, in a line behind the case."""
    shown = json.dumps(case or text)[: SHOWN + 1]
    try:
        read(text)
    except (ListingError, UnusableMapError) as error:
        return f"{shown} {error.line}:{error.column} {json.dumps(str(error), ensure_ascii=False)}\n"
    except DecodeError as error:
        return f"{shown} - {json.dumps(str(error), ensure_ascii=False)}\n"
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


def _maps() -> Iterator[str]:
    fitting = {
        vendor: (maps.filled(maps.example(vendor)), pidcfg.encode(maps.example(vendor)).image)
        for vendor in maps.EXAMPLES
    }

    def numbered(text: str, vendor: str) -> object:
        return numbering_of(VENDORS[vendor], MapFile(text, "map"), fitting[vendor][1])

    for vendor, change, _ in rows(maps.test_maps_that_do_not_fit_a_configuration):
        text = re.sub(*change, fitting[vendor][0], count=1)
        yield told(partial(numbered, vendor=vendor), text, f"{vendor} {change[1]}")


def _words() -> Iterator[str]:
    for vendor, words in WORDS.items():
        for address, digits, number in words:
            entry = {"address": address} | ({"hex": digits} if digits else {}) | ({"value": number} if number else {})
            table = f"{','.join(entry)}\n{','.join(entry.values())}\n"
            document = json.dumps({"words": [entry | ({"value": _json_value(number)} if number else {})]})
            for kind, text in (("text", f"{address} {digits} {number}"), ("csv", table), ("json", document)):
                yield told(partial(_listed, vendor, kind), text, f"{vendor} {kind} {address} {digits} {number}")
    for name, kind, value in PARAMETERS:
        table = f'name,type,value\n{name},{kind},"{value}"\n'
        for form, text in (("text", f"{name} {kind} {value}"), ("csv", table)):
            yield told(partial(_listed, "nextopid", form), text, f"{form} {name} {kind} {value}")


def _json_value(text: str) -> object:
    try:
        return json.loads(text)
    except ValueError:
        return text


def _listed(vendor: str, kind: str, text: str) -> object:
    return read_listing(text.encode(), VENDORS[vendor], DEFAULT, kind)


def _long() -> Iterator[str]:
    """Texts that are quoted up to a length, by what they are."""
    name, digits, table = "x" * 90, "9" * 90, symbols.table(symbols.configuration())
    cases: dict[str, tuple[Callable[[str], object], str]] = {
        "a column twice": (partial(_listed, "dl06", "csv"), f"address,hex,{name},{name}\n"),
        "an address": (partial(listings.read_spelling, "dl06"), f"address,hex\n{name},0\n"),
        "another value": (partial(listings.read_spelling, "dl06"), f"V2000 7E08 {digits}\n"),
        "a word": (partial(listings.read_spelling, "dl06"), f"address,value\nV2000,{digits}\n"),
        "a type of an operand": (operands.FORMATS["operands"].read, f"operand,value,type\nA.SV,80,{name}\n"),
        "an operand": (operands.FORMATS["operands"].read, f"operand,value\n{name},80\n"),
        "an operand without a name": (dpide.again, f"DPIDE(PV := D0, {name});"),
        "an operand with another sign": (dpide.again, dpide.by_name(SV=name).replace("SV :=", "SV =>")),
        "a device": (dpide.again, f"VAR a AT %{name} : REAL; END_VAR {dpide.by_name()}"),
        "a declared type": (dpide.again, f"VAR a : {name}; END_VAR {dpide.by_name(SV='a')}"),
        "an expression": (dpide.again, dpide.by_name(SV=f"{name} + 1.0")),
        "several signs": (dpide.again, dpide.by_name(SV=f"--{digits}.0")),
        "a whole number for a REAL": (dpide.again, dpide.by_name(SV=f"K{digits}")),
        "a number with a point behind K": (dpide.again, dpide.by_name(CYCLE=f"K{digits}.5")),
        "an address of a nickname": (click.NICKNAMES.read, f'{click.HEAD}\n{name},BIT,"a",0,No,""\n'),
        "a type of a nickname": (click.NICKNAMES.read, f'{click.HEAD}\nC1,{name},"a",0,No,""\n'),
        "an initial value": (click.NICKNAMES.read, f'{click.HEAD}\nDS1,INT,"a",{digits},No,""\n'),
        "whether it is kept": (click.NICKNAMES.read, f'{click.HEAD}\nDS1,INT,"a",0,{name},""\n'),
        "a row of a DataView": (click.DATAVIEW.read, f"-1,0,0\r\n{name}\r\n"),
        "a row of a dump": (click.DUMP.read, f"<DS=START>\nAddress,1\n{name},0\n</DS=END>\n"),
        "a value of a dump": (click.DUMP.read, f"<DS=START>\nAddress,1\nDS1,{digits}\n</DS=END>\n"),
        "a value of a tag": (tags.TAGS.read, f"{tags.HEAD}\nA,R1,word,{digits},,,\n"),
        "a tag twice": (tags.TAGS.read, f"{tags.HEAD}\n{name},R1,word,1,,,\n{name},R2,word,1,,,\n"),
        "an initial value of a symbol": (read_symbols, table.replace(",REAL,80.0,", f",REAL,{name},", 1)),
        "a symbol twice": (read_symbols, table + f"VAR,{name},D0,REAL,,\r\nVAR,{name},D2,REAL,,\r\n"),
    }
    for case, (read, text) in cases.items():
        yield told(read, text, case)


OPTION_TEXTS = (
    "",
    "x",
    "0",
    "8",
    "9",
    "10000",
    "-1",
    "1.5",
    "1 s",
    "0 s",
    "R1,S65000",
    "IR1,R5",
    "O1,none",
    "V2000",
    "V8",
)
"""What is given for each option, beside its example."""


def _options() -> Iterator[str]:
    """What an option reads; None: nothing that makes sense."""
    for key, vendor in VENDORS.items():
        options = {option.key: option for option in (*vendor.load("decode_options"), *vendor.load("convert_options"))}
        for option in options.values():
            for text in dict.fromkeys((option.example, *OPTION_TEXTS)):
                read = option.read(text)
                if text == option.example or read not in (None, text, [text]):
                    yield f"{key} {option.key} {text!r} {read!r}\n"


BOOKS: dict[str, Callable[[], Iterable[str]]] = {
    "nextopid": _nextopid,
    "dpide": _dpide,
    "click": _click,
    "others": _others,
    "maps": _maps,
    "words": _words,
    "long": _long,
    "options": _options,
}


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """All books, or those that are wanted."""
    return {FOLDER / f"{name}.txt": "".join(make()).encode() for name, make in BOOKS.items() if wanted(name)}
