"""The tables as CSV files; no cell can become a formula in a spreadsheet."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from pidcfg.control_characters import FORMULA, printable
from pidcfg.report.texts import text

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.report.content import Value
    from pidcfg.report.tables import Table

MARK = "\ufeff"


def csv_files(tables: Iterable[Table]) -> dict[str, str]:
    """The text of each table by the name of its file."""
    return {f"{table.key}.csv": csv_text(table) for table in tables}


def csv_text(table: Table) -> str:
    """One table: UTF-8 with the mark by which spreadsheets know it, commas, lines that end in LF."""
    stream = io.StringIO()
    stream.write(MARK)
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([safe(value) for value in row] for row in table.rows)
    return printable(stream.getvalue())


def safe(value: Value) -> str:
    """A cell as text; a text that a spreadsheet would calculate gets an apostrophe, a number never."""
    shown = text(value)
    return f"'{shown}" if isinstance(value, str) and shown.startswith(FORMULA) else shown
