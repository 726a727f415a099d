"""The tables as an Excel workbook: a sheet each, numbers as numbers, texts as nothing but texts."""

from __future__ import annotations

import datetime as dt
import io
from decimal import Decimal
from math import ceil
from typing import TYPE_CHECKING, Any

from pidcfg.control_characters import printable
from pidcfg.report.texts import text

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.report.content import Title, Value
    from pidcfg.report.tables import Table

CREATED = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)
"""Written into every workbook, so that the same input gives the same bytes."""
NARROWEST, WIDEST = 6, 60
LINE = 15
"""Height of a line in points."""
MOST_CHARACTERS = 32_767
"""A cell holds no more."""
WRAPPED = {"text_wrap": True, "valign": "top"}


def workbook(tables: Sequence[Table], title: Title) -> bytes:
    """The bytes of the workbook."""
    import xlsxwriter

    stream = io.BytesIO()
    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    with xlsxwriter.Workbook(stream, options) as book:
        book.set_properties(
            {
                "title": _encodable(title.title),
                "author": _encodable(title.author or ""),
                "created": CREATED,
                "company": _encodable(title.customer or ""),
                "comments": f"pidcfg {title.version}",
            }
        )
        formats = {
            "head": book.add_format({"bold": True, "bg_color": "#E4E9EE", "bottom": 1, **WRAPPED}),
            "text": book.add_format(WRAPPED),
            "number": book.add_format({"valign": "top"}),
        }
        for table in tables:
            _sheet(book.add_worksheet(table.title), table, formats, title)
    return stream.getvalue()


def _sheet(sheet: Any, table: Table, formats: dict[str, Any], title: Title) -> None:
    for column, name in enumerate(table.columns):
        sheet.write_string(0, column, name, formats["head"])
    for number, row in enumerate(table.rows, start=1):
        for column, value in enumerate(row):
            _write(sheet, (number, column), value, formats)
    columns = widths(table)
    for column, width in enumerate(columns):
        sheet.set_column(column, column, width)
    for number, row in enumerate(table.rows, start=1):
        sheet.set_row(number, LINE * lines(row, columns))
    sheet.freeze_panes(1, 0)
    sheet.repeat_rows(0)
    if table.rows:
        sheet.autofilter(0, 0, len(table.rows), len(table.columns) - 1)
    sheet.set_landscape()
    sheet.set_paper(9)
    sheet.fit_to_pages(1, 0)
    name = " ".join(part for part in (title.project, title.document, title.revision) if part) or title.title
    sheet.set_header(f"&L{_plain(name)}&R&A")
    sheet.set_footer("&RPage &P of &N")


def _plain(name: str) -> str:
    """A text in a header, where & begins a command; a header holds 255 characters."""
    return _encodable(name)[:80].replace("&", "&&")


def _encodable(words: str) -> str:
    """A printable text, with a question mark for a byte of a name that is none of UTF-8, as the workbook is."""
    return printable(words).encode("utf-8", "replace").decode()


def _write(sheet: Any, place: tuple[int, int], value: Value, formats: dict[str, Any]) -> None:
    if value is None or value == "":
        return
    if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
        sheet.write_number(*place, float(value) if isinstance(value, Decimal) else value, formats["number"])
    else:
        sheet.write_string(*place, _encodable(text(value))[:MOST_CHARACTERS], formats["text"])


def lines(row: Sequence[Value], columns: Sequence[int]) -> int:
    """How many lines the longest cell of a row takes: not every spreadsheet works it out by itself."""
    return max(1, *(ceil(len(text(cell)) / (width - 2)) for cell, width in zip(row, columns, strict=True)))


def widths(table: Table) -> list[int]:
    """A width for each column that holds its longest cell, within reason."""
    columns = [[*map(text, column)] for column in zip(table.columns, *table.rows, strict=True)]
    return [min(WIDEST, max(NARROWEST, *(len(cell) for cell in column)) + 2) for column in columns]
