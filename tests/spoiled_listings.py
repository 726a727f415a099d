"""What pidcfg says of listings with one small fault each, in full; ``generated`` writes the answers anew.

A listing of a small configuration, or a program by hand, is spoiled token by token and line by line: a part is gone,
stands twice, changes places with the next one or is something else. What is said of each, or what is read otherwise
than without the fault, stands in a file below ``tests/data/listings`` behind the place and the change.
"""

from __future__ import annotations

import difflib
import re
import zlib
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import map_rig
import pidcfg
from pidcfg.encoders.contract import encoder_of, formats_of
from pidcfg.encoders.decoding import annotate_listing, decode_listing, read_listing, reading_of
from pidcfg.encoders.listing import ListingError
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.map_files import MapFile, UnusableMapError, numbering_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

TESTS = Path(__file__).parent
FOLDER = TESTS / "data" / "listings"
EXAMPLES = TESTS.parent / "examples"
TOKEN = re.compile(r"\w+(?:\.\w+)*|[^\w\s]")
EDITS = ("", "{0} {0}", "{1} {0}", "x", "-1", "0", "70000", "1.5", "'", "(", ";", ",", "{0}_1")
"""What stands in place of a token, by it and the next one; each place has two of them in turn."""
CHECKS = re.compile(r"^(?:#|\(\*) check .*\n", re.MULTILINE)
"""What a person is to check after the download: nothing reads it back."""
LINES = 8
"""Lines that are gone, and as many that stand twice."""
SHOWN = 8
"""Lines of an answer; behind them stand a number of the rest and its checksum."""


class Spoiled(NamedTuple):
    """A listing with a fault."""

    change: str
    """Its place, and what is changed there."""
    text: str


def spoiled(text: str, places: int, part: float) -> Iterator[Spoiled]:
    """The listing with one fault each, spread over the whole of it."""
    found = list(TOKEN.finditer(text))
    for turn, i in enumerate(spread(len(found), places, part)):
        match, following = found[i], found[min(i + 1, len(found) - 1)]
        for edit in {EDITS[2 * turn % len(EDITS)]: 0, EDITS[(3 * turn + 1) % len(EDITS)]: 0}:
            begin, end = match.start(), (following if "{1}" in edit else match).end()
            new, line = edit.format(match[0], following[0]), text.count("\n", 0, begin) + 1
            shown = text[begin:end].replace("\n", " ")
            column = begin - text.rfind("\n", 0, begin)
            yield Spoiled(f"{line}:{column} {shown} -> {new}", text[:begin] + new + text[end:])
    lines = text.splitlines(keepends=True)
    for i in spread(len(lines), LINES):
        yield Spoiled(f"{i + 1} is gone", "".join(lines[:i] + lines[i + 1 :]))
        yield Spoiled(f"{i + 1} stands twice", "".join(lines[: i + 1] + lines[i:]))


def spread(length: int, most: int, part: float = 0.0) -> list[int]:
    """So many of a list's places, from its first on; ``part``: of the distance between two of them behind it."""
    return sorted({int((i + part) * length / most) for i in range(most)})


# --- what is read ----------------------------------------------------------------------------------------------------


def decoded(vendor: str, kind: str, like: Any, text: str) -> str:
    """The configuration of a listing, with the notes."""
    listing = read_listing(text.encode(), VENDORS[vendor], DEFAULT, kind)
    found = decode_listing(listing, VENDORS[vendor], {}, like)
    return yaml_text(found.data) + "\n".join(found.notes)


def annotated(vendor: str, kind: str, text: str) -> str:
    """A meaning beside every word of a listing."""
    found, notes = annotate_listing(read_listing(text.encode(), VENDORS[vendor], DEFAULT, kind), VENDORS[vendor], {})
    return found + "\n".join(notes)


def compared(vendor: str, kind: str, like: Any, text: str) -> str:
    """A listing beside its configuration: what is refused of it, and what then is said of the rest."""
    found = reading_of(read_listing(text.encode(), VENDORS[vendor], DEFAULT, kind), VENDORS[vendor], like)
    unreadable = [f"{place}: {said}" for place, said in found.unreadable.items()]
    refused = [f"{' '.join(place)}: {said}" for place, said in found.refused.items()]
    other = {cell.address: cell.raw for cell in like[1].image.cells}
    words = [f"{c.address}: {c.raw}" for c in found.encoding.image.cells if other.get(c.address) != c.raw]
    return "\n".join([*found.notes, f"partial: {found.partial}", *unreadable, *refused, *words])


def merged(vendor: str, kind: str, image: Any, text: str) -> str:
    """A file of the user's with the words of a configuration in it."""
    merge = formats_of(VENDORS[vendor]).FORMATS[kind].merge
    assert merge is not None
    found, notes = merge(image, text)
    return "\n".join([*notes, *(line for line in found.splitlines() if line not in text)])


def numbered(vendor: str, image: Any, text: str) -> str:
    """The registers of a configuration by a Modbus map."""
    numbering: Any = numbering_of(VENDORS[vendor], MapFile(text, "map.csv"), image)
    if hasattr(numbering, "cells"):
        return "\n".join(f"{cell.address} {place}" for cell, place in numbering.cells(image))
    return "\n".join(f"{cell.address} {numbering.place(cell.number)}" for cell in image.cells)


class Source(NamedTuple):
    """A sound listing and what reads it."""

    text: str
    places: int
    read: Callable[[str], str]
    part: float = 0.0
    """Where between the places of a whole one its own lie."""


def _encoded(vendor: str, name: str, kind: str) -> tuple[str, Any]:
    result = pidcfg.encode(EXAMPLES / vendor / f"{name}.yaml", kind)
    return CHECKS.sub("", next(str(text) for text in result.files.values())), result.image


def _listing(vendor: str, name: str, kind: str, places: int, *, like: bool = False) -> Source:
    text, image = _encoded(vendor, name, kind)
    return Source(text, places, partial(decoded, vendor, kind, image if like else None))


def _annotated(vendor: str, name: str, kind: str, places: int) -> Source:
    return Source(_encoded(vendor, name, kind)[0], places, partial(annotated, vendor, kind))


def _compared(vendor: str, name: str, kind: str, places: int) -> Source:
    document = read_document((EXAMPLES / vendor / f"{name}.yaml").read_bytes(), name)
    config = VENDORS[vendor].model.model_validate(document.data)
    return Source(
        _encoded(vendor, name, kind)[0],
        places,
        partial(compared, vendor, kind, (config, encoder_of(VENDORS[vendor]).encode(config))),
    )


def _program(path: str, vendor: str, places: int, part: float = 0.0) -> Source:
    return Source((TESTS / "data" / path).read_text("utf-8"), places, partial(decoded, vendor, "st", None), part)


def _merge(vendor: str, name: str, kind: str, places: int) -> Source:
    text, image = _encoded(vendor, name, kind)
    return Source(text, places, partial(merged, vendor, kind, image))


def _map(vendor: str, places: int) -> Source:
    path = map_rig.example(vendor)
    return Source(map_rig.filled(path), places, partial(numbered, vendor, pidcfg.encode(path).image))


SOURCES: dict[str, Callable[[], Source]] = {
    "click-annotated": partial(_annotated, "click", "tank", "text", 16),
    "click-cdv": partial(_listing, "click", "tank", "cdv", 16, like=True),
    "click-compared": partial(_compared, "click", "booster", "json", 60),
    "click-csv": partial(_listing, "click", "tank", "csv", 16),
    "click-nicknames": partial(_listing, "click", "tank", "nickname-csv", 40, like=True),
    "click-nicknames-merged": partial(_merge, "click", "tank", "nickname-csv", 40),
    "dl06-annotated": partial(_annotated, "dl06", "reactor", "text", 16),
    "dl06-compared": partial(_compared, "dl06", "oven", "json", 60),
    "dl06-csv": partial(_listing, "dl06", "flow", "csv", 16),
    "dl06-ihex": partial(_listing, "dl06", "oven", "ihex", 24),
    "dl06-json": partial(_listing, "dl06", "flow", "json", 24),
    "dl06-modbus": partial(_listing, "dl06", "flow", "modbus", 16),
    "dl06-text": partial(_listing, "dl06", "oven", "text", 40),
    "dpide-annotated": partial(_annotated, "dpide", "dryer", "text", 16),
    "dpide-compared": partial(_compared, "dpide", "dryer", "json", 60),
    "dpide-csv": partial(_listing, "dpide", "oven", "csv", 16),
    "dpide-function-block": partial(_program, "dpide/manual-4.hand.st", "dpide", 60),
    "dpide-json": partial(_listing, "dpide", "oven", "json", 24),
    "dpide-map": partial(_map, "dpide", 40),
    "dpide-operands": partial(_listing, "dpide", "oven", "operands", 24),
    "dpide-st": partial(_listing, "dpide", "dryer", "st", 60),
    "dpide-symbols": partial(_merge, "dpide", "oven", "symbols", 40),
    "ezlogix-annotated": partial(_annotated, "ezlogix", "dosing", "text", 16),
    "ezlogix-compared": partial(_compared, "ezlogix", "dosing", "json", 60),
    "ezlogix-map": partial(_map, "ezlogix", 24),
    "ezlogix-tags": partial(_listing, "ezlogix", "oven", "tags", 40),
    "ezlogix-tags-merged": partial(_merge, "ezlogix", "oven", "tags", 24),
    "ezlogix-text": partial(_listing, "ezlogix", "oven", "text", 16),
    "generic-compared": partial(_compared, "generic", "boiler", "json", 40),
    "generic-text": partial(_listing, "generic", "boiler", "text", 16),
    "nextopid-annotated": partial(_annotated, "nextopid", "cascade", "text", 16),
    "nextopid-by-hand-1": partial(_program, "nextopid/by_hand.st", "nextopid", 60),
    "nextopid-by-hand-2": partial(_program, "nextopid/by_hand.st", "nextopid", 60, 1 / 3),
    "nextopid-by-hand-3": partial(_program, "nextopid/by_hand.st", "nextopid", 60, 2 / 3),
    "nextopid-compared": partial(_compared, "nextopid", "cascade", "json", 60),
    "nextopid-csv": partial(_listing, "nextopid", "pump", "csv", 16),
    "nextopid-map": partial(_map, "nextopid", 40),
    "nextopid-plcopen": partial(_listing, "nextopid", "splitrange", "plcopen", 60),
    "nextopid-st": partial(_listing, "nextopid", "cascade", "st", 40),
    "nextopid-text": partial(_listing, "nextopid", "autotune", "text", 24),
}


# --- answers ---------------------------------------------------------------------------------------------------------


def answer(read: Callable[[str], str], text: str, sound: str) -> list[str]:
    """What is said of a listing, or what of it is read otherwise than of the sound one."""
    try:
        found = read(text)
    except (ListingError, UnusableMapError) as error:
        return [f"{error.line}:{error.column}: {error}"]
    lines = difflib.unified_diff(sound.splitlines(), found.splitlines(), n=0, lineterm="")
    differing = [line for line in lines if not line.startswith(("---", "+++", "@@"))]
    left = "\n".join(differing[SHOWN:])
    rest = [f"… {len(differing) - SHOWN} more ({zlib.crc32(left.encode()):08x})"] if left else []
    return [*differing[:SHOWN], *rest] or ["the same"]


def answers_of(source: Source, faults: Callable[[str, int, float], Iterator[Spoiled]] = spoiled) -> str:
    """What is read of a sound text; then each change, and below it the answer."""
    sound = source.read(source.text)
    rows = [f"{sound.rstrip()}\n"]
    for change, text in faults(source.text, source.places, source.part):
        rows += [f"=== {change}", *answer(source.read, text, sound)]
    return "\n".join(rows) + "\n"


@cache
def answers(name: str) -> str:
    """The file of a source."""
    return answers_of(SOURCES[name]())


def golden_files(wanted: Callable[[str], bool] = bool) -> dict[Path, bytes]:
    """All of them, or those whose names are wanted."""
    return {FOLDER / f"{name}.txt": answers(name).encode() for name in SOURCES if wanted(name)}
