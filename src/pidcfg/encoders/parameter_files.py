"""Listings of named parameters as text, CSV and JSON, and the way back.

They carry what no parameter holds as the listings of memory do (`pidcfg.encoders.listing`), and take as little on
trust: a name twice, a type that is none, or content that its type cannot hold is refused with its line.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

from pidcfg.encoders.listing import (
    FileKind,
    Listing,
    ListingError,
    column_names,
    csv_text,
    fill_from_json,
    first_line,
    json_listing,
    read_settings_line,
    settings_comments,
    table_rows,
)
from pidcfg.encoders.parameters import TYPES, Content, Entry, Program, content_text, read_content
from pidcfg.schemas.iec import BOOL, DINT, REAL, IecType, Wire
from pidcfg.schemas.numbers import NUMBER
from pidcfg.text.signs import pad_right, width_of

NAME_PATTERN = re.compile(r"\w[\w.\-/# ]*")
COLUMNS = ("name", "type", "value", "expression", "device", "loop", "parameter")
WIRE_MARK = ":="
"""What stands before an expression in a text listing."""
FORMULA_STARTS = ("=", "+", "-", "@")
"""How a cell begins that a spreadsheet would calculate; an expression in parentheses means the same."""


class ParameterListing(Listing):
    """A listing of named parameters."""

    __slots__ = ()

    def make_image(self, vendor: str) -> Program:
        """The program that the listing is of."""
        cells = tuple(Entry(name, _type_of_content(raw), raw, name) for name, raw in self.words.items())
        return Program(vendor, cells, self.settings, self.plc)


def _type_of_content(raw: Content | Wire) -> IecType:
    return BOOL if isinstance(raw, bool) else DINT if isinstance(raw, int) else REAL


def write_text(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """One parameter a line: name, type, content."""
    del checklist
    lines = [f"# {image.vendor} parameters: name, type, value", *settings_comments(image)]
    name_width = max((width_of(unspaced_name(c.address)) for c in image.cells), default=1)
    for cell in image.cells:
        content = f"{WIRE_MARK} {cell.raw.text}" if isinstance(cell.raw, Wire) else content_text(cell.type, cell.raw)
        lines.append(f"{pad_right(unspaced_name(cell.address), name_width)}  {cell.type.name:<5} {content}")
    return "\n".join(lines) + "\n"


def unspaced_name(name: str) -> str:
    """A name without blanks, so that columns stay columns."""
    return name.replace(" ", "~")


def read_text(text: str) -> Listing:
    """Three columns; the rest of a line is the content."""
    listing = ParameterListing()
    for number, line in enumerate(text.splitlines(), start=1):
        if read_settings_line(line, number, listing):
            continue
        parts = line.split(None, 2)
        if len(parts) < 3:
            raise ListingError("a line has a name, a type and a value", number)
        name, kind = parts[0].replace("~", " "), type_of(parts[1], number)
        if parts[2].startswith(WIRE_MARK):
            listing.add(name, Wire(parts[2].removeprefix(WIRE_MARK).strip()), name, number)
        else:
            listing.add(name, content_of(parts[2].strip(), kind, name, number), name, number)
    return listing


def type_of(text: str, line: int) -> IecType:
    """The elementary type of a name; others are refused."""
    if text not in TYPES:
        raise ListingError(f"{text!r} is not one of the types {', '.join(TYPES)}", line)
    return TYPES[text]


def content_of(text: str, kind: IecType, name: str, line: int) -> Content:
    """The content that a text spells."""
    value: object = {"TRUE": True, "FALSE": False}.get(
        text.upper(), text if kind.words or kind.kind == "time" else None
    )
    if value is None and NUMBER.fullmatch(text):
        value = float(text)
        value = int(text) if kind.kind == "whole" and text.lstrip("+-").isdigit() else value
    content = read_content(kind, value)
    if content is None:
        comma = "; the decimal sign is a point" if "," in text and text.replace(",", "", 1).isdecimal() else ""
        raise ListingError(f"{name}: {text!r} is not a value of {kind.name}{comma}", line)
    return content


def write_csv(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """A row a parameter."""
    del checklist
    return csv_text(COLUMNS, map(csv_row, image.cells), settings_comments(image))


def csv_row(cell: Entry) -> tuple[object, ...]:
    """A parameter as a row of the CSV listing."""
    return cell.address, cell.type.name, *_content_cells(cell), cell.device or "", cell.loop or "", cell.field


def _content_cells(cell: Entry) -> tuple[str, str]:
    """The value of a parameter and its expression, of which it has one."""
    return ("", safe_cell(cell.raw.text)) if isinstance(cell.raw, Wire) else (content_text(cell.type, cell.raw), "")


def safe_cell(text: str) -> str:
    """A text that no spreadsheet calculates: in brackets where it begins like a formula."""
    return f"({text})" if text.startswith(FORMULA_STARTS) else text


def read_csv(text: str) -> Listing:
    """Rows by their header."""
    listing = ParameterListing()
    for number, row in table_rows(text, listing, required=("name", "type", "value|expression")):
        kind, name = type_of(row["type"], number), row["name"]
        if row.get("expression"):
            if row.get("value"):
                raise ListingError(f"{name} has a value and an expression", number)
            listing.add(name, Wire(row["expression"]), name, number)
        else:
            listing.add(name, content_of(row.get("value", ""), kind, name, number), name, number)
    return listing


def write_json(image: Program, checklist: tuple[str, ...] = ()) -> str:
    """The layout of the public interface; a wired parameter has its expression in place of a value."""
    return json_listing(image, checklist, [cell.data() for cell in image.cells])


def read_json(text: str) -> Listing:
    """``words`` with address, type and value or expression, and the settings."""
    return fill_from_json(
        ParameterListing(), text, lambda entry, place: (entry["address"], _json_content(entry, place))
    )


def _json_content(entry: Mapping[str, object], place: str) -> Content | Wire:
    kind = TYPES.get(str(entry.get("type")))
    if kind is None:
        raise ListingError(f"{place}: {json.dumps(entry.get('type'))} is not one of the types {', '.join(TYPES)}")
    if "expression" in entry:
        if not isinstance(entry["expression"], str) or "value" in entry:
            raise ListingError(f"{place}: an expression is a text, and stands in place of a value")
        return Wire(entry["expression"])
    content = read_content(kind, entry.get("value"))
    if content is None:
        raise ListingError(f"{place}: the value {json.dumps(entry.get('value'))} is not one of {kind.name}")
    return content


def parameter_listings(title: str) -> dict[str, FileKind]:
    """The formats that every vendor with named parameters has: text, csv and json."""
    kinds = (
        FileKind(
            "text", title, write_text, read_text, lambda text: _is_typed_line(first_line(text)), may_be_partial=True
        ),
        FileKind(
            "csv",
            f"{title} for spreadsheets",
            write_csv,
            read_csv,
            lambda text: {"name", "type"} <= {*column_names(text)},
            may_be_partial=True,
        ),
        FileKind(
            "json",
            f"{title} for programs",
            write_json,
            read_json,
            lambda text: text.lstrip().startswith("{"),
            carries_checklist=True,
            may_be_partial=True,
        ),
    )
    return {kind.name: kind for kind in kinds}


def _is_typed_line(line: str) -> bool:
    parts = line.split(None, 2)
    return len(parts) == 3 and parts[1] in TYPES and bool(NAME_PATTERN.fullmatch(parts[0].replace("~", " ")))
