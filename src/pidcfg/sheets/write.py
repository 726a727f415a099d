"""A configuration as a sheet: one loop a row, a column for each key that any loop has."""

from __future__ import annotations

import csv
import datetime as dt
import io
import re
from typing import TYPE_CHECKING, Any

from pidcfg.control_characters import FORMULA, UNPRINTABLE
from pidcfg.document import Plain
from pidcfg.sheets.columns import ENDS, order_of
from pidcfg.sheets.values import TEXTS, number_or_text
from pidcfg.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.document import Document
    from pidcfg.vendors import Vendor

CREATED = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)
"""Written into every workbook, so that the same input gives the same bytes."""
MARK = "\ufeff"
IN_BRACKETS = re.compile(r"[,\[\]{}]|: |:$| #")
"""What ends a plain text within brackets."""
BRACKETS = ("[", "{", '"')
"""What a cell begins with that is read as YAML."""
PAIR = 2

Value = str | int | float | bool


def table_of(doc: Document, vendor: Vendor) -> tuple[list[tuple[str, Value]], list[str], list[list[Value]]]:
    """What concerns the whole file, the header, and a row for each loop."""
    data = doc.data or {}
    head: list[tuple[str, Value]] = [("vendor", vendor.key)]
    for key, value in data.items():
        if key not in {"pidcfg", "vendor", "loops"}:
            head += _cells(value, key)
    rows = [dict(_cells(loop)) for loop in data["loops"]]
    order = order_of(vendor)
    names = {name: None for row in rows for name in row}
    columns = sorted(names, key=lambda name: (_base(name, order), name.endswith(ENDS[1])))
    return head, columns, [[row.get(name, "") for name in columns] for row in rows]


def _base(name: str, order: dict[str, int]) -> int:
    for end in ENDS:
        name = name.removesuffix(end)
    return order.get(name, len(order))


def _cells(value: Any, above: str = "") -> Iterator[tuple[str, Value]]:
    """The values of a loop by key; a pair is two, any other list one in brackets."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _cells(inner, f"{above}.{key}" if above else key)
    elif isinstance(value, list) and len(value) == PAIR and not any(isinstance(x, dict | list) for x in value):
        yield from ((f"{above}{end}", _value(inner)) for end, inner in zip(ENDS, value, strict=True))
    else:
        text = above.rpartition(".")[2] in TEXTS and isinstance(value, Plain)
        yield above, flow(value) if isinstance(value, list) else _text(value) if text else _value(value)


def _value(value: Any) -> Value:
    if isinstance(value, Plain):
        number: Value = number_or_text(value)
        return number
    return _text(value)


def _text(value: str) -> str:
    """A text as it is, unless it would be read as YAML, or hides what is written: then in quotes, with escapes."""
    text = str(value)
    return json_line(text) if text.startswith(BRACKETS) or UNPRINTABLE.search(text) else text


def flow(value: Any) -> str:
    """Lists and mappings as YAML in brackets."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flow(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    if isinstance(value, Plain) and not IN_BRACKETS.search(value) and not UNPRINTABLE.search(value):
        return str(value)
    return json_line(str(value))


def as_csv(doc: Document, vendor: Vendor, *, comma: bool = False) -> str:
    """The sheet as CSV, with semicolons and decimal commas where ``comma`` says so."""
    head, columns, rows = table_of(doc, vendor)
    stream = io.StringIO()
    stream.write(MARK)
    writer = csv.writer(stream, delimiter=";" if comma else ",", lineterminator="\n")
    writer.writerows([key, _safe(value, comma=comma)] for key, value in head)
    writer.writerow(columns)
    writer.writerows([_safe(value, comma=comma) for value in row] for row in rows)
    return stream.getvalue()


def _safe(value: Value, *, comma: bool) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return str(value).replace(".", ",") if comma else str(value)
    return f"'{value}" if value.startswith(FORMULA) else value


def as_workbook(doc: Document, vendor: Vendor) -> bytes:
    """The sheet as a workbook: numbers as numbers, texts as nothing but texts."""
    import xlsxwriter

    head, columns, rows = table_of(doc, vendor)
    stream = io.BytesIO()
    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    with xlsxwriter.Workbook(stream, options) as book:
        book.set_properties({"created": CREATED})
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
