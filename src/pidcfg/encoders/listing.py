"""What a listing holds, and what its files have in common: comment lines with settings, CSV rows, JSON documents.

A listing carries what no register or parameter holds: in JSON under ``settings`` and ``plc``, in text and CSV as
comment lines. Listings of memory are in `pidcfg.encoders.memory_files`, those of named parameters in
`pidcfg.encoders.parameter_files`.
"""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import dataclass, field
from math import isinf
from sys import float_info
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Cell, Image
from pidcfg.writer import json_line, json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.spaces import Kind

PLC, LOOP = "# plc: ", "# loop: "
"""How the comment lines begin that carry what no register holds: one for the file, one a loop."""
DECIMAL = re.compile(r"-?[0-9]+(\.[0-9]+)?([eE][-+]?[0-9]+)?")
WHOLE = re.compile(r"-?[0-9]{1,10}")
VERSION = 1
"""Of JSON listings."""
FEW = 12
"""Names that a note lists before it only counts."""


class ListingError(ValueError):
    """A listing that cannot be read, with the place of the fault."""

    def __init__(self, message: str, line: int = 1, column: int = 1) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


@dataclass(slots=True)
class Listing:
    """What a memory listing holds: raw content by address, or by name where a vendor's parameters have names."""

    words: dict[Any, Any] = field(default_factory=dict)
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)
    vendor: str | None = None
    mixed: bool = False
    """The file is about more than loops, so that words outside them are nothing to tell."""
    lines: dict[Any, int] = field(default_factory=dict)
    """Where each word stands, and how its address is written."""
    shown: dict[Any, str] = field(default_factory=dict)
    described: bool = False
    """Whether it says what no register holds as pidcfg writes it, so that what it does not say is not there."""
    notes: tuple[str, ...] = ()
    """What the reader passed over or takes otherwise than it is written."""
    leads: bool = False
    """Whether it says what the words of other files of the same image are for."""

    def image(self, vendor: str) -> Any:
        """The memory that the listing is of."""
        cells = tuple(Cell("", number, raw, "") for number, raw in sorted(self.words.items()))
        return Image(vendor, cells, self.settings, self.plc)

    def add(self, address: int | str, value: Any, shown: str, line: int = 1, column: int = 1) -> None:
        """Takes a word; the same address twice is refused."""
        if address in self.words:
            first = f"; first in line {self.lines[address]}" if address in self.lines else ""
            raise ListingError(f"{shown} stands here again{first}", line, column)
        self.words[address] = value
        self.lines[address] = line
        self.shown[address] = shown

    def join(self, other: Listing) -> None:
        """Takes another file of the same image; an address in both is refused."""
        for address, raw in other.words.items():
            self.add(address, raw, other.shown[address], other.lines[address])
        self.mixed |= other.mixed
        self.notes = (*self.notes, *other.notes)
        self.settings, self.plc = (*self.settings, *other.settings), {**self.plc, **other.plc}


def comments(image: Image | Program, checklist: tuple[str, ...]) -> list[str]:
    """The comment lines above the words: the checklist for people, the settings for the way back."""
    lines = [f"# check after the download: {item}" for item in checklist]
    lines.append(PLC + json_line(dict(image.plc)))
    return lines + [LOOP + json_line(dict(entry)) for entry in image.settings]


def csv_text(header: Iterable[str], rows: Iterable[Iterable[object]], above: Iterable[str]) -> str:
    """A CSV file: the comment lines above, the header and the rows."""
    return "".join(f"{line}\n" for line in above) + csv_lines([header, *rows])


def csv_lines(rows: Iterable[Iterable[object]], end: str = "\n", delimiter: str = ",") -> str:
    """Rows as CSV, each with this line end."""
    out = io.StringIO()
    csv.writer(out, delimiter=delimiter, lineterminator=end).writerows(rows)
    return out.getvalue()


def json_listing(image: Image | Program, checklist: tuple[str, ...], words: list[dict[str, Any]]) -> str:
    """A JSON listing of words that are ready to be written."""
    document = {
        "version": VERSION,
        "vendor": image.vendor,
        "words": words,
        "settings": [dict(s) for s in image.settings],
        "plc": dict(image.plc),
        "checklist": list(checklist),
    }
    return json_text(document)


def fill_from_json(listing: Listing, text: str, word: Callable[[Mapping[str, Any], str], tuple[Any, Any]]) -> Listing:
    """Puts a JSON document into a listing; ``word`` makes key and content of an entry and its place for messages."""
    document = load_json(text)
    version = document.get("version", VERSION) if isinstance(document, dict) else VERSION
    if version != VERSION or not isinstance(version, int) or isinstance(version, bool):
        raise ListingError(f"the JSON document has version {version}; this pidcfg reads version {VERSION}")
    words = document.get("words") if isinstance(document, dict) else None
    if not isinstance(words, list):
        raise ListingError("the JSON document has no list 'words'")
    for i, entry in enumerate(words):
        if not isinstance(entry, dict) or not isinstance(entry.get("address"), str):
            raise ListingError(f"words[{i}] has no text 'address'")
        listing.add(*word(entry, f"words[{i}] ({entry['address']})"), entry["address"])
    take_settings(document, listing)
    listing.vendor = document.get("vendor")
    return listing


def load_json(text: str) -> Any:
    """A JSON document without NaN and infinities, also such as only a computer makes of a number."""
    try:
        return json.loads(text, parse_constant=_no_constant, parse_float=_finite)
    except json.JSONDecodeError as error:
        raise ListingError(f"not JSON: {error.msg}", error.lineno, error.colno) from None
    except ListingError:
        raise
    except ValueError:
        raise ListingError("a number of the JSON document has too many digits") from None
    except RecursionError:
        raise ListingError("the JSON document is nested too deeply") from None


def _no_constant(name: str) -> None:
    raise ListingError(f"{name} is not a number of JSON")


def _finite(text: str) -> float:
    value = float(text)
    if isinf(value):
        raise ListingError(f"{text} is too large for a number; the limit is {float_info.max:.1e}")
    return value


def settings_line(line: str, number: int, listing: Listing) -> bool:
    """Whether a line is blank or a comment; the settings are taken from theirs."""
    for start in (PLC, LOOP):
        if line.startswith(start):
            try:
                entry = load_json(line.removeprefix(start))
            except ListingError as error:
                raise ListingError(str(error), number, len(start) + error.column) from None
            if not isinstance(entry, dict):
                raise ListingError("the settings are not a mapping", number, len(start) + 1)
            if start == PLC:
                listing.plc, listing.described = entry, True
            else:
                listing.settings = (*listing.settings, entry)
            return True
    return not line.strip() or line.lstrip().startswith("#")


def take_settings(document: Any, listing: Listing) -> None:
    """Settings by loop; what is not of their shape is refused rather than dropped."""
    settings, plc = document.get("settings", []), document.get("plc", {})
    if not isinstance(settings, list) or not all(isinstance(s, dict) for s in settings) or not isinstance(plc, dict):
        raise ListingError("the settings are not a list of mappings, one a loop")
    listing.settings, listing.plc = tuple(settings), plc
    listing.described = {"settings", "plc"} <= document.keys()


def few(names: list[str]) -> str:
    """Names for a note; of many the first, and how many more there are."""
    return ", ".join(names[:FEW]) + (f" and {len(names) - FEW} more" if len(names) > FEW else "")


def decimal_content(text: str, kind: Kind) -> int | None:
    """The raw content of a value as a listing writes it; None when the address cannot hold it."""
    if not DECIMAL.fullmatch(text):
        return None
    return kind.read(int(text) if WHOLE.fullmatch(text) else float(text))
