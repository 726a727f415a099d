"""A configuration as a sheet: one loop a row, a column for each key that any loop has."""

from __future__ import annotations

import csv
import datetime as dt
import io
import re
from difflib import get_close_matches
from functools import cache
from math import isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.schemas.base import SECONDS, UNIT_WORDS, scaled_sides
from pidcfg.schemas.document import models_in
from pidcfg.schemas.numbers import NUMBER
from pidcfg.schemas.terms import BAND_WORDS, PAIR_ENDS, TERM_KEYS, leaf_keys, types_of
from pidcfg.text.document import Plain
from pidcfg.text.paths import value_at
from pidcfg.text.signs import FORMULA_STARTS, UNPRINTABLE
from pidcfg.text.writer import Number, json_line, yaml_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.text.document import Document
    from pidcfg.vendors import Vendor

# ----------------------------------------------------------------------------------------------------------------------
# What a column of a sheet is: a key of the vendor's loops as the file format writes it, or a common word for one.

TRAILING_BRACKETS = re.compile(r"\s*[\[(].*?[\])]\s*$")
TIME_UNIT = re.compile("(" + "|".join((*SECONDS, *UNIT_WORDS)) + r")\.?", re.IGNORECASE)
UNIT_IN_BRACKETS = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
WORD_SEPARATORS = re.compile(r"[\s_\-/]+")
TOPICS = (
    (
        re.compile(r"cascade|master|slave|primary|secondary|kaskade|führung|folgeregler", re.IGNORECASE),
        ("cascade_from", "setpoint.source", "SP_CASC"),
        "a cascade",
        "is {}",
    ),
    (
        re.compile(r"ramp|soak|profil|slope|rampe", re.IGNORECASE),
        ("ramp_soak.steps",),
        "a profile",
        "stands in the file, under {}",
    ),
)
"""What headers speak of that may have no column of that name: the keys for it, its name, and where it is told."""
MIN_LIKENESS = 0.72
"""How alike a header and a word must be for the word to be suggested."""


class UnknownColumnError(ValueError):
    """A header that is no key, with the nearest."""


def key_of(header: str, vendor: Vendor) -> str:
    """The key of a column, with ``low`` or ``high`` behind that of a pair; raises `UnknownColumnError`."""
    key = _key_of_header(header, vendor)
    if key is not None:
        return key
    raise UnknownColumnError(f"{header!r} is no key of a loop of {vendor.title}; {_header_cure(header, vendor)}")


def _header_cure(header: str, vendor: Vendor) -> str:
    """What to do about a header that is no key."""
    keys, keys_by_text = _loop_keys(vendor), _keys_by_lower_case(vendor)
    text = _header_text(header)
    for pattern, candidates, topic, remark in TOPICS:
        if pattern.search(text):
            key = next((candidate for candidate in candidates if candidate in keys), None)
            return f"{topic} {remark.format(key)}" if key else f"loops of {vendor.key} have no key for {topic}"
    if WORD_SEPARATORS.sub("_", text.lower()) in BAND_WORDS:
        return "a proportional band is no gain: 100 / band is the gain in % of the output per % of the PV"
    matches = get_close_matches(text.lower(), [*keys_by_text, *_common_words(vendor)], 1, MIN_LIKENESS)
    if matches:
        return f"did you mean {keys_by_text.get(matches[0], matches[0])}?"
    return f"columns are keys of {vendor.key}'s loops, such as {', '.join(keys[:6])}; # before a header leaves it out"


def _header_text(header: str) -> str:
    """A header without brackets."""
    return TRAILING_BRACKETS.sub("", header.strip()).strip()


def _key_of_header(header: str, vendor: Vendor) -> str | None:
    """The key that a header is, or that a common word stands for."""
    text = _header_text(header).lower()
    spelling = WORD_SEPARATORS.sub("_", text)
    return (
        _keys_by_lower_case(vendor).get(text)
        or _keys_by_lower_case(vendor).get(spelling)
        or _common_words(vendor).get(spelling)
    )


@cache
def _keys_by_lower_case(vendor: Vendor) -> dict[str, str]:
    """The keys by their small letters."""
    return {key.lower(): key for key in _loop_keys(vendor)}


def unit_of(header: str) -> str | None:
    """The unit that stands in brackets behind a header: ``Reset [min]``, ``Setpoint (°F)``."""
    match = UNIT_IN_BRACKETS.search(header)
    if match is None:
        return None
    time = TIME_UNIT.fullmatch(match[1])
    return time[1].lower() if time else match[1]


def is_column_header(header: str, vendor: Vendor) -> bool:
    """Whether a header is a column."""
    return _key_of_header(header, vendor) is not None


@cache
def _loop_keys(vendor: Vendor) -> tuple[str, ...]:
    """All keys of a vendor's loops, and the two ends of each pair."""
    pairs: dict[str, bool] = {"name": False}
    for model in models_in(vendor.model.model_fields["loops"].annotation):
        pairs |= leaf_keys(model)
    return (*pairs, "use", *(f"{key}{end}" for key, pair in pairs.items() if pair for end in PAIR_ENDS))


def key_order(vendor: Vendor) -> dict[str, int]:
    """The place of every key in the schema."""
    return {key: i for i, key in enumerate(_loop_keys(vendor))}


@cache
def _common_words(vendor: Vendor) -> dict[str, str]:
    keys = _loop_keys(vendor)
    words: dict[str, str] = {}
    for row, candidates in TERM_KEYS.items():
        key = next((candidate for candidate in candidates if candidate in keys), None)
        words |= dict.fromkeys(row.split(), key) if key else {}
    return words


@cache
def switch_keys(vendor: Vendor) -> frozenset[str]:
    """The keys whose values are true or false."""
    return frozenset(
        key
        for model in models_in(vendor.model.model_fields["loops"].annotation)
        for key, annotation in types_of(model)
        if "bool" in annotation
    )


# --- Plain texts of a file as the numbers, switches and words that YAML writes without quotes -------------------------

TEXT_KEYS = frozenset(("name", "description", "use"))
"""Keys whose values are texts, also where they look like numbers: 1.10 is no 1.1."""


def expanded_text(doc: Document) -> str:
    """The file as YAML in which each loop has all of its values; comments stay behind."""
    return yaml_text(to_yaml_value(doc.data or {}))


def to_yaml_value(value: object) -> Any:
    """Data with its plain texts as what YAML writes without quotes: numbers, switches, words."""
    if isinstance(value, dict):
        return {
            key: str(x) if key in TEXT_KEYS and isinstance(x, Plain) else to_yaml_value(x) for key, x in value.items()
        }
    if isinstance(value, list):
        return [to_yaml_value(inner) for inner in value]
    return number_or_text(value) if isinstance(value, Plain) else value


def number_or_text(text: str) -> Any:
    """A plain text as a number or a switch where it is written back the same way; another number as it is."""
    if text.lower() in {"true", "false"}:
        return text.lower() == "true"
    for kind in (int, float):
        try:
            number = kind(text)
        except ValueError:
            continue
        if not isfinite(float(text)):
            continue
        if str(number) == text or (kind is float and text.rstrip("0").rstrip(".") == f"{number:.15g}"):
            return number
    return Number(text) if NUMBER.fullmatch(text) else str(text)


# --- A configuration as a sheet: one loop a row, a column for each key that any loop has ------------------------------

CREATION_TIME = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)
"""Written into every workbook, so that the same input gives the same bytes."""
BYTE_ORDER_MARK = "\ufeff"
BRACKET_SIGNS = re.compile(r"[,\[\]{}]|: |:$| #")
"""What ends a plain text within brackets."""
YAML_BRACKETS = ("[", "{", '"')
"""What a cell begins with that is read as YAML."""
PAIR_LENGTH = 2

Value = str | int | float | bool


def table_of(doc: Document, vendor: Vendor) -> tuple[list[tuple[str, Value]], list[str], list[list[Value]]]:
    """What concerns the whole file, the header, and a row for each loop."""
    data = doc.data or {}
    head: list[tuple[str, Value]] = [("vendor", vendor.key)]
    for key, value in data.items():
        if key not in {"pidcfg", "vendor", "loops"}:
            head += _cells_of(value, key)
    rows = [dict(_cells_of(loop)) for loop in data["loops"]]
    key_indices = key_order(vendor)
    names = {name: None for row in rows for name in row} | dict.fromkeys(_output_range_columns(data["loops"], vendor))
    columns = sorted(names, key=lambda name: (_column_order(name, key_indices), name.endswith(PAIR_ENDS[1])))
    return head, columns, [[row.get(name, "") for name in columns] for row in rows]


def _output_range_columns(loops: Sequence[object], vendor: Vendor) -> list[str]:
    """The columns of the output's range, be they empty, so that a sheet says that a loop has none."""
    lacks_range = "output" in scaled_sides(vendor.model) and any(
        value_at(loop, ("output", "range")) is None for loop in loops
    )
    return [f"output.range{end}" for end in PAIR_ENDS] if lacks_range else []


def _column_order(name: str, key_indices: dict[str, int]) -> int:
    for end in PAIR_ENDS:
        name = name.removesuffix(end)
    return key_indices.get(name, len(key_indices))


def _cells_of(value: Any, path: str = "") -> Iterator[tuple[str, Value]]:
    """The values of a loop by key; a pair is two, any other list one in brackets."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _cells_of(inner, f"{path}.{key}" if path else key)
    elif isinstance(value, list) and len(value) == PAIR_LENGTH and not any(isinstance(x, dict | list) for x in value):
        yield from ((f"{path}{end}", _cell_value(inner)) for end, inner in zip(PAIR_ENDS, value, strict=True))
    else:
        is_text = path.rpartition(".")[2] in TEXT_KEYS and isinstance(value, Plain)
        yield (
            path,
            to_flow_yaml(value) if isinstance(value, list) else _cell_text(value) if is_text else _cell_value(value),
        )


def _cell_value(value: Any) -> Value:
    if isinstance(value, Plain):
        number: Value = number_or_text(value)
        return number
    return _cell_text(value)


def _cell_text(value: str) -> str:
    """A text as it is, unless it would be read as YAML, or hides what is written: then in quotes, with escapes."""
    text = str(value)
    return json_line(text) if text.startswith(YAML_BRACKETS) or UNPRINTABLE.search(text) else text


def to_flow_yaml(value: object) -> str:
    """Lists and mappings as YAML in brackets."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {to_flow_yaml(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(to_flow_yaml, value)) + "]"
    if isinstance(value, Plain) and not BRACKET_SIGNS.search(value) and not UNPRINTABLE.search(value):
        return str(value)
    return json_line(str(value))


def as_csv(doc: Document, vendor: Vendor, *, comma: bool = False) -> str:
    """The sheet as CSV, with semicolons and decimal commas where ``comma`` says so."""
    head, columns, rows = table_of(doc, vendor)
    stream = io.StringIO()
    stream.write(BYTE_ORDER_MARK)
    writer = csv.writer(stream, delimiter=";" if comma else ",", lineterminator="\n")
    writer.writerows([key, _csv_cell(value, comma=comma)] for key, value in head)
    writer.writerow(columns)
    writer.writerows([_csv_cell(value, comma=comma) for value in row] for row in rows)
    return stream.getvalue()


def _csv_cell(value: Value, *, comma: bool) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return str(value).replace(".", ",") if comma else str(value)
    return f"'{value}" if value.startswith(FORMULA_STARTS) else value


def as_workbook(doc: Document, vendor: Vendor) -> bytes:
    """The sheet as a workbook: numbers as numbers, texts as nothing but texts."""
    import xlsxwriter

    head, columns, rows = table_of(doc, vendor)
    stream = io.BytesIO()
    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    with xlsxwriter.Workbook(stream, options) as book:
        book.set_properties({"created": CREATION_TIME})
        sheet = book.add_worksheet("loops")
        bold = book.add_format({"bold": True, "bg_color": "#E4E9EE", "bottom": 1})
        lines: list[list[Value]] = [*([key, value] for key, value in head), list(columns), *rows]
        for number, row in enumerate(lines):
            for column, value in enumerate(row):
                if isinstance(value, int | float) and not isinstance(value, bool):
                    sheet.write_number(number, column, value)
                elif value != "":
                    text = str(value).lower() if isinstance(value, bool) else value
                    sheet.write_string(number, column, text, bold if number == len(head) else None)
        sheet.freeze_panes(len(head) + 1, 1)
    return stream.getvalue()
