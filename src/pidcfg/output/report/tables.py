"""The tables of a report, flat, as CSV files and as an Excel workbook."""

from __future__ import annotations

import csv
import datetime as dt
import io
from decimal import Decimal
from math import ceil
from typing import TYPE_CHECKING, Any

from pidcfg.output.report.content import text
from pidcfg.output.report.runs import METRIC_TITLES
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import FORMULA, printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.output.report.content import Content, Sheet, Title, Value

# --- The tables of a report, flat: one list of rows each, for the CSV files and the workbook --------------------------

Row = tuple["Value", ...]


@frozen
class Table:
    """A table; ``key`` is the name of its file, ``title`` that of its sheet."""

    key: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]


def tables_of(content: Content) -> tuple[Table, ...]:
    """All tables, those without rows included: a file of an earlier report must not stay beside a newer one."""
    return tuple(Table(key, title, columns, tuple(make(content))) for key, title, columns, make in TABLES)


def _title(content: Content) -> Iterator[Row]:
    title = content.title
    rows: Sequence[tuple[str, str | None]] = (
        ("Title", title.title),
        ("Project", title.project),
        ("Customer", title.customer),
        ("Plant", title.plant),
        ("Document", title.document),
        ("Revision", title.revision),
        ("Author", title.author),
        ("Date", title.date),
        ("PLC family", ", ".join(content.vendors)),
        ("pidcfg", title.version),
    )
    yield from ((name, value) for name, value in rows if value)


def _files(content: Content) -> Iterator[Row]:
    yield from ((f.name, f.kind, f.size, f.sha256) for f in content.files)


def _findings(content: Content) -> Iterator[Row]:
    for d in content.findings:
        place = (d.file, d.span.line, d.span.column, d.loop, d.where)
        yield d.severity.label, d.code, *place, d.message, d.plc_effect, d.reference, d.help


def _sheets(content: Content) -> Iterator[tuple[str, str, Sheet]]:
    """Every configuration and each of its loops, with the file and the loop's name."""
    for plc in content.plcs:
        yield plc.file, "", plc
        yield from ((plc.file, loop.name, loop) for loop in plc.loops)


def _settings(content: Content) -> Iterator[Row]:
    for *place, sheet in _sheets(content):
        for s in (setting for group in sheet.groups for setting in group.settings):
            yield *place, s.path, s.value, s.unit, "file" if s.given else "default", s.meaning, None


def _words(content: Content) -> Iterator[Row]:
    for *place, sheet in _sheets(content):
        for title, r in ((block.title, register) for block in sheet.blocks for register in block.registers):
            register = (*place, title, r.address, r.name)
            raw = f"0x{r.hex}" if r.hex else ""
            yield *register, None, raw, r.decimal, r.value, r.unit, r.meaning, r.owner
            for bit in r.bits:
                yield *register, bit.bits, None, bit.state, bit.value, None, bit.meaning, bit.owner


def _parameters(content: Content) -> Iterator[Row]:
    for *place, sheet in _sheets(content):
        yield from ((*place, p.name, p.type, p.content, p.unit, p.device, p.meaning) for p in sheet.parameters)


def _outside(content: Content) -> Iterator[Row]:
    yield from ((*place, *row) for *place, sheet in _sheets(content) for row in sheet.outside)


def _checks(content: Content) -> Iterator[Row]:
    yield from ((plc.file, item, None) for plc in content.plcs for item in plc.checklist)


def _expectations(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from (
            (run.file, run.title, e.text, "passed" if e.passed else "FAILED", e.value) for e in run.expectations
        )


def _standing(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from ((run.file, run.title, s.loop, s.kind, s.verdict, s.at, s.text) for s in run.standing)


def _metrics(content: Content) -> Iterator[Row]:
    for run in content.runs:
        for loop, metrics in run.metrics.items():
            yield run.file, loop, run.in_control[loop], *(metrics.get(metric) for metric in METRIC_TITLES)


def _signals(content: Content) -> Iterator[Row]:
    for run in content.runs:
        roots = dict(run.before_root)
        for name, *numbers in run.signals:
            loop, _, what = name.rpartition(".")
            yield run.file, name, *numbers, roots.get(loop) if what in {"PV", "SP"} else None


def _happenings(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from ((run.file, h.at, h.until, h.loop, h.kind, h.text) for h in run.happenings)


def _autotunes(content: Content) -> Iterator[Row]:
    for run in content.runs:
        for loop, status, results in run.autotunes:
            yield from ((run.file, loop, status, name, value) for name, value in results or (("", None),))


# fmt: off
TABLES = (
    ("title",        "Title",            ("Field", "Value"), _title),
    ("findings",     "Findings",         ("Severity", "Rule", "File", "Line", "Column", "Loop", "Place", "Message",
                                          "What the PLC does", "Reference", "Cure"), _findings),
    ("settings",     "Settings",         ("File", "Loop", "Setting", "Value", "Unit", "From", "Meaning", "As left"),
                                         _settings),
    ("words",        "Words",            ("File", "Loop", "Block", "Address", "Register", "Bits", "Hex", "Decimal",
                                          "Value", "Unit", "Meaning", "Kind"), _words),
    ("parameters",   "Parameters",       ("File", "Loop", "Parameter", "Type", "Content", "Unit", "Device", "Meaning"),
                                         _parameters),
    ("outside",      "In no register",   ("File", "Loop", "Setting", "Value"), _outside),
    ("checks",       "Checks",           ("File", "After the download", "Done"), _checks),
    ("expectations", "Expectations",     ("Scenario", "Title", "Expectation", "Verdict", "Found"), _expectations),
    ("standing",     "Standing",         ("Scenario", "Title", "Loop", "Expectation", "Verdict", "Since, s", "Found"),
                                         _standing),
    ("metrics",      "Metrics",          ("Scenario", "Loop", "In control, s", *METRIC_TITLES.values()), _metrics),
    ("signals",      "Signals",          ("Scenario", "Signal", "Lowest", "Highest", "Final", "Remark"), _signals),
    ("happenings",   "What happened",    ("Scenario", "From, s", "Until, s", "Loop", "Kind", "What"), _happenings),
    ("autotune",     "Auto-tune",        ("Scenario", "Loop", "Status", "Parameter", "Value"), _autotunes),
    ("files",        "Input files",      ("File", "Kind", "Bytes", "SHA-256"), _files),
)
"""Each table: its file's name, its sheet's name, its columns, and what makes its rows."""
# fmt: on

# --- The tables as CSV files; no cell can become a formula in a spreadsheet -------------------------------------------

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


# --- The tables as an Excel workbook: a sheet each, numbers as numbers, texts as nothing but texts --------------------

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
