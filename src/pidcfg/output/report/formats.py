"""The report as one HTML page that needs nothing else, as a PDF, and its tables as CSV files and an Excel workbook."""

from __future__ import annotations

import datetime as dt
import io
import os
import re
import shutil
import subprocess
import sys
from decimal import Decimal
from functools import cache
from itertools import groupby
from math import ceil
from operator import itemgetter
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.listing import csv_lines
from pidcfg.output.report import METRIC_TITLES, cell_text, contents_of, measurement_text, metric_unit
from pidcfg.output.report.sheets import FIRST_FACTS
from pidcfg.text.diagnostics import Severity, words_of
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import FORMULA_STARTS, to_printable

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from jinja2 import Environment
    from markupsafe import Markup

    from pidcfg.output.report import Content, Fact, LoopSheet, RegisterBlock, Setting, Sheet, Title, Value
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data


# --- The report as one HTML page that needs nothing else: its script stands in it, nothing comes from elsewhere -------

TEMPLATES = Path(__file__).parent / "templates"
CODE_TEXT = re.compile("`([^`]+)`")
NAME_PARTS = re.compile("[^._]*[._]|[^._]+")
CLAUSE_END = re.compile(r"[.;:,](?= |$)| or `")
"""Where the first clause of a meaning ends."""
OFFSET_TEXT = re.compile(r" \([^)]*n\+\d[^)]*\)")
"""A register by its offset, whose address stands beside the meaning."""
SIGN_OFF = ("Prepared", "Checked", "Commissioned", "Accepted")
GENERAL_FACTS = {*(title for title, *_ in FIRST_FACTS), "Direction", "Form", "Pulses", "Duty cycle"}
"""Facts that are not the terms of the equation."""
MIN_ZEROS = 4
"""Words of zeros that stand as one."""


def report_page(content: Content, *, full: bool = False) -> str:
    """The page, with the charts of its runs; ``full``: with what is at its default, and all words and signals."""
    from pidcfg.pictures.page import CONTENT_POLICY, SCRIPT, STYLE

    return _render_template(
        "page.html",
        content,
        full=full,
        policy=CONTENT_POLICY,
        figure_style=STYLE,
        script=SCRIPT,
        groups=group_findings(content.findings),
        marks={d: f"finding-{i}" for i, d in enumerate(content.findings, start=1)},
        rows=title_rows(content.title, content),
        sign_off=SIGN_OFF,
    )


def door_sheet(content: Content) -> str:
    """All loops with their main values and words on one sheet, for the door of the cabinet."""
    policy = "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"
    return _render_template(
        "sheet.html",
        content,
        policy=policy,
        places=facts_by_title,
        tuning=tuning_facts,
        alarms=alarm_settings,
        alarm_names=alarm_names(content),
        files=content.files,
    )


def _render_template(template: str, content: Content, **values: object) -> str:
    title = content.title
    return to_printable(
        _environment()
        .get_template(template)
        .render(
            content=content,
            title=title,
            counts=severity_counts(content),
            running=css_string(" · ".join(part for part in (title.project, title.title) if part)),
            marking=css_string(" · ".join(part for part in (title.document, _revision(title)) if part)),
            tool=css_string(f"pidcfg {title.version}"),
            **values,
        )
    )


def _revision(title: Title) -> str:
    return f"rev. {title.revision}" if title.revision else ""


@cache
def _environment() -> Environment:
    """Everything is escaped, and a name that is misspelled in a template is an error; a template is compiled once."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    env = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    env.filters |= {
        "prose": sentence_html,
        "soft": breakable_name,
        "cell": cell_text,
        "number": measured_number,
        "clause": first_clause,
        "fact_pair": fact_pair,
        "rising": first_words,
    }
    env.globals |= {"metric_unit": metric_unit, "main_settings": main_settings, "compared": compared_words}
    return env


# --- what is shown ---------------------------------------------------------------------------------------------------


@frozen
class FindingGroup:
    """Findings that are explained alike: everything but message and place is said once."""

    first: Diagnostic
    findings: tuple[Diagnostic, ...]

    @property
    def rows(self) -> list[list[Diagnostic]]:
        """Those together that say the same of several loops."""
        rows: dict[str, list[Diagnostic]] = {}
        for d in self.findings:
            rows.setdefault(words_of(d), []).append(d)
        return list(rows.values())


def group_findings(findings: Iterable[Diagnostic]) -> list[FindingGroup]:
    """The findings of one rule with the same words of explanation together, in the order of the first."""
    groups: dict[tuple[object, ...], list[Diagnostic]] = {}
    for d in findings:
        groups.setdefault((d.severity, d.code, d.plc_effect, d.reference, d.help), []).append(d)
    return [FindingGroup(group[0], tuple(group)) for group in groups.values()]


def main_settings(sheet: Sheet) -> list[Setting]:
    """What the file says of a loop, without the units, which stand beside the values."""
    rows = (setting for group in sheet.groups for setting in group.settings if setting.is_given)
    return [row for row in rows if row.path.rpartition(".")[2] != "unit"]


def compared_words(blocks: Iterable[RegisterBlock]) -> list[tuple[str, str]]:
    """What is compared with the PLC, by address; many zeros in a row stand as one."""
    rows: list[tuple[str, str]] = []
    for content, run in groupby(contents_of(tuple(blocks)).items(), key=itemgetter(1)):
        addresses = [address for address, _ in run]
        is_run_of_zeros = not content.strip("0") and len(addresses) >= MIN_ZEROS
        rows += (
            [(f"{addresses[0]} to {addresses[-1]}", content)]
            if is_run_of_zeros
            else [(address, content) for address in addresses]
        )
    return rows


def facts_by_title(sheet: LoopSheet) -> dict[str, tuple[str, str]]:
    """The facts of a loop with their places, by title."""
    return {fact.title: (fact.text, fact.place) for fact in sheet.facts}


def tuning_facts(sheet: LoopSheet) -> list[Fact]:
    """The three terms of a loop."""
    return [fact for fact in sheet.facts if fact.title not in GENERAL_FACTS]


def alarm_settings(sheet: LoopSheet) -> dict[str, Setting]:
    """The limits of a loop's alarms, as far as the file says them, by what they are called."""
    rows = [row for row in main_settings(sheet) if row.path.startswith("alarms.") and not isinstance(row.value, bool)]
    return {
        row.path.removeprefix("alarms.").removeprefix("pv.").replace("_", "-").replace(".", " "): row for row in rows
    }


def alarm_names(content: Content) -> list[str]:
    """The alarms that any loop has."""
    return list(dict.fromkeys(name for _, sheet in content.loops for name in alarm_settings(sheet)))


def first_words(direction: str) -> str:
    """The first words of a direction."""
    return direction.partition(" when ")[0]


def fact_pair(fact: Fact) -> tuple[str, str]:
    """A fact without its place."""
    return fact.title, fact.text


# --- how it is shown -------------------------------------------------------------------------------------------------


def sentence_html(sentence: str) -> Markup:
    """A text of ours as HTML: what stands between backticks is code."""
    from markupsafe import Markup, escape

    parts = CODE_TEXT.split(sentence)
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if i % 2 else escape(part) for i, part in enumerate(parts)
    )


def first_clause(sentence: str) -> str:
    """The first clause of a meaning, for a line of its own."""
    return CLAUSE_END.split(OFFSET_TEXT.sub("", sentence), maxsplit=1)[0]


def breakable_name(name: str) -> Markup:
    """A name that may be broken after a dot or an underscore."""
    from markupsafe import Markup, escape

    return Markup("").join(
        escape(part) + Markup("<wbr>") * part.endswith((".", "_")) for part in NAME_PARTS.findall(name)
    )


def measured_number(value: float | None) -> str:
    """A measured number; a dash where there is none."""
    return "–" if value is None else measurement_text(value)


def severity_counts(content: Content) -> dict[str, int]:
    """How many findings there are of each severity, the gravest first."""
    return {s.label: sum(d.severity is s for d in content.findings) for s in sorted(Severity, reverse=True)}


def title_rows(title: Title, content: Content) -> list[tuple[str, str]]:
    """The title block: what was given, then what the files say."""
    plants = ", ".join(dict.fromkeys(plc.name for plc in content.plcs if plc.name))
    rows = [
        ("Project", title.project),
        ("Customer", title.customer),
        ("Plant", title.plant or plants),
        ("PLC", ", ".join(content.vendors)),
        ("Document", title.document),
        ("Revision", title.revision),
        ("Author", title.author),
        ("Date", title.date),
        ("Made by", f"pidcfg {title.version}"),
    ]
    return [(name, value) for name, value in rows if value]


def css_string(words: str) -> str:
    """A text as a string of a style sheet: whatever is no letter, digit or blank is written as its number."""
    return '"' + "".join(c if c.isascii() and (c.isalnum() or c == " ") else f"\\{ord(c):x} " for c in words) + '"'


# ----------------------------------------------------------------------------------------------------------------------
# A page as a PDF: printed by the Chromium, Chrome or Edge that is on the computer, without a window or a network.

BROWSERS = (
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "msedge",
    "microsoft-edge",
    "microsoft-edge-stable",
)
"""Names on the path."""
BROWSER_PATHS = (
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
    "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    r"C:\Program Files\Google\Chrome\Application\chrome.exe",
    r"C:\Program Files (x86)\Microsoft\Edge\Application\msedge.exe",
    r"C:\Program Files\Microsoft\Edge\Application\msedge.exe",
)
"""Where they are installed on systems that do not put them there."""
BROWSER_VARIABLE = "PIDCFG_BROWSER"
"""Of the environment: the browser to take."""
BROWSER_FLAGS = (
    "--headless",
    "--disable-gpu",
    "--disable-extensions",
    "--disable-background-networking",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
)
PDF_TIMEOUT = 300
"""Seconds that a page may take."""
PDF_TIMES = re.compile(rb"(/(?:CreationDate|ModDate) \(D:)\d{14}")
PDF_EPOCH = b"20000101000000"
"""What stands for the times in every file, so that the same report gives the same bytes."""


class PdfError(Exception):
    """Why there is no PDF, and what to do."""


def find_browser() -> str:
    """The path of the browser that prints; raises `PdfError` where there is none."""
    preferred = os.environ.get(BROWSER_VARIABLE)
    names = (preferred,) if preferred else (*BROWSERS, *BROWSER_PATHS)
    path = next((path for path in map(shutil.which, names) if path), None)
    if path is not None:
        return path
    if preferred:
        raise PdfError(f"{BROWSER_VARIABLE} names {preferred!r}, which is no program here")
    raise PdfError(
        "a PDF is printed by Chromium, Chrome or Edge, and none of them is here; install one, name it in the variable "
        f"{BROWSER_VARIABLE}, or write report.html and print that from a browser"
    )


def print_pdf(html: str, path: str) -> bytes:
    """The page, printed by the browser at a path; raises `PdfError` with what the browser says where it fails."""
    with TemporaryDirectory(prefix="pidcfg-", ignore_cleanup_errors=True) as folder:
        page, target = Path(folder) / "report.html", Path(folder) / "report.pdf"
        page.write_text(html, "utf-8")
        root_options = ["--no-sandbox"] if sys.platform == "linux" and os.geteuid() == 0 else []
        options = [f"--user-data-dir={folder}/profile", f"--print-to-pdf={target}"]
        try:
            result = subprocess.run(  # noqa: S603 - a browser that the user has installed or named, and no shell
                [path, *BROWSER_FLAGS, *root_options, *options, page.as_uri()],
                capture_output=True,
                timeout=PDF_TIMEOUT,
                check=False,
            )
        except OSError as error:
            raise PdfError(f"{path} cannot be started: {error.strerror}") from None
        except subprocess.TimeoutExpired:
            raise PdfError(f"{path} has not printed the page within {PDF_TIMEOUT} s") from None
        if not target.is_file():
            words = result.stderr.decode("utf-8", "replace").strip().splitlines()
            raise PdfError(f"{path} has printed nothing: {words[-1] if words else f'exit code {result.returncode}'}")
        return PDF_TIMES.sub(rb"\g<1>" + PDF_EPOCH, target.read_bytes())


# --- The tables, flat, as CSV files and as an Excel workbook ----------------------------------------------------------

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


def _title_rows(content: Content) -> Iterator[Row]:
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


def _file_rows(content: Content) -> Iterator[Row]:
    yield from ((f.name, f.kind, f.size, f.sha256) for f in content.files)


def _finding_rows(content: Content) -> Iterator[Row]:
    for d in content.findings:
        place = (d.file, d.span.line, d.span.column, d.loop, d.where)
        yield d.severity.label, d.code, *place, d.message, d.plc_effect, d.reference, d.help


def _sheets(content: Content) -> Iterator[tuple[str, str, Sheet]]:
    """Every configuration and each of its loops, with the file and the loop's name."""
    for plc in content.plcs:
        yield plc.file, "", plc
        yield from ((plc.file, loop.name, loop) for loop in plc.loops)


def _setting_rows(content: Content) -> Iterator[Row]:
    for *owner, sheet in _sheets(content):
        for s in (setting for group in sheet.groups for setting in group.settings):
            yield *owner, s.path, s.value, s.unit, "file" if s.is_given else "default", s.meaning, None


def _word_rows(content: Content) -> Iterator[Row]:
    for *owner, sheet in _sheets(content):
        for title, r in ((block.title, register) for block in sheet.blocks for register in block.registers):
            register = (*owner, title, r.address, r.name)
            raw = f"0x{r.hex}" if r.hex else ""
            yield *register, None, raw, r.decimal, r.value, r.unit, r.meaning, r.owner
            for bit in r.bits:
                yield *register, bit.bits, None, bit.state, bit.value, None, bit.meaning, bit.owner


def _parameter_rows(content: Content) -> Iterator[Row]:
    for *owner, sheet in _sheets(content):
        yield from ((*owner, p.name, p.type, p.content, p.unit, p.device, p.meaning) for p in sheet.parameters)


def _unstored_rows(content: Content) -> Iterator[Row]:
    yield from ((*owner, *row) for *owner, sheet in _sheets(content) for row in sheet.unstored)


def _check_rows(content: Content) -> Iterator[Row]:
    yield from ((plc.file, item, None) for plc in content.plcs for item in plc.checklist)


def _expectation_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from (
            (run.file, run.title, e.text, "passed" if e.passed else "FAILED", e.value) for e in run.expectations
        )


def _standing_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from ((run.file, run.title, s.loop, s.kind, s.verdict, s.at, s.text) for s in run.standing)


def _metric_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        for loop, metrics in run.metrics.items():
            yield run.file, loop, run.time_in_control[loop], *(metrics.get(metric) for metric in METRIC_TITLES)


def _signal_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        roots = dict(run.root_loops)
        for name, *numbers in run.signals:
            loop, _, kind = name.rpartition(".")
            yield run.file, name, *numbers, roots.get(loop) if kind in {"PV", "SP"} else None


def _event_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        yield from ((run.file, h.at, h.until, h.loop, h.kind, h.text) for h in run.events)


def _autotune_rows(content: Content) -> Iterator[Row]:
    for run in content.runs:
        for loop, status, results in run.autotunes:
            yield from ((run.file, loop, status, name, value) for name, value in results or (("", None),))


# fmt: off
TABLES = (
    ("title",        "Title",            ("Field", "Value"), _title_rows),
    ("findings",     "Findings",         ("Severity", "Rule", "File", "Line", "Column", "Loop", "Place", "Message",
                                          "What the PLC does", "Reference", "Cure"), _finding_rows),
    ("settings",     "Settings",         ("File", "Loop", "Setting", "Value", "Unit", "From", "Meaning", "As left"),
                                         _setting_rows),
    ("words",        "Words",            ("File", "Loop", "Block", "Address", "Register", "Bits", "Hex", "Decimal",
                                          "Value", "Unit", "Meaning", "Kind"), _word_rows),
    ("parameters",   "Parameters",       ("File", "Loop", "Parameter", "Type", "Content", "Unit", "Device", "Meaning"),
                                         _parameter_rows),
    ("outside",      "In no register",   ("File", "Loop", "Setting", "Value"), _unstored_rows),
    ("checks",       "Checks",           ("File", "After the download", "Done"), _check_rows),
    ("expectations", "Expectations",     ("Scenario", "Title", "Expectation", "Verdict", "Found"), _expectation_rows),
    ("standing",     "Standing",         ("Scenario", "Title", "Loop", "Expectation", "Verdict", "Since, s", "Found"),
                                         _standing_rows),
    ("metrics",      "Metrics",          ("Scenario", "Loop", "In control, s", *METRIC_TITLES.values()), _metric_rows),
    ("signals",      "Signals",          ("Scenario", "Signal", "Lowest", "Highest", "Final", "Remark"), _signal_rows),
    ("happenings",   "What happened",    ("Scenario", "From, s", "Until, s", "Loop", "Kind", "What"), _event_rows),
    ("autotune",     "Auto-tune",        ("Scenario", "Loop", "Status", "Parameter", "Value"), _autotune_rows),
    ("files",        "Input files",      ("File", "Kind", "Bytes", "SHA-256"), _file_rows),
)
"""Each table: its file's name, its sheet's name, its columns, and what makes its rows."""
# fmt: on

# --- The tables as CSV files; no cell can become a formula in a spreadsheet -------------------------------------------

BYTE_ORDER_MARK = "\ufeff"


def csv_files(tables: Iterable[Table]) -> dict[str, str]:
    """The text of each table by the name of its file."""
    return {f"{table.key}.csv": csv_text(table) for table in tables}


def csv_text(table: Table) -> str:
    """One table: UTF-8 with the mark by which spreadsheets know it, commas, lines that end in LF."""
    return to_printable(BYTE_ORDER_MARK + csv_lines([table.columns, *(map(safe_text, row) for row in table.rows)]))


def safe_text(value: Value) -> str:
    """A cell as text; a text that a spreadsheet would calculate gets an apostrophe, a number never."""
    shown_text = cell_text(value)
    return f"'{shown_text}" if isinstance(value, str) and shown_text.startswith(FORMULA_STARTS) else shown_text


# --- The tables as an Excel workbook: a sheet each, numbers as numbers, texts as nothing but texts --------------------

CREATION_TIME = dt.datetime(2000, 1, 1, tzinfo=dt.UTC).replace(tzinfo=None)
"""Written into every workbook, so that the same input gives the same bytes."""
MIN_WIDTH, MAX_WIDTH = 6, 60
LINE_HEIGHT = 15
"""Height of a line in points."""
MAX_CHARACTERS = 32_767
"""A cell holds no more."""
WRAPPED_FORMAT = {"text_wrap": True, "valign": "top"}


def write_workbook(tables: Sequence[Table], title: Title) -> bytes:
    """The bytes of the workbook."""
    import xlsxwriter

    stream = io.BytesIO()
    options = {"in_memory": True, "strings_to_formulas": False, "strings_to_urls": False, "strings_to_numbers": False}
    with xlsxwriter.Workbook(stream, options) as book:
        book.set_properties(
            {
                "title": _encodable(title.title),
                "author": _encodable(title.author or ""),
                "created": CREATION_TIME,
                "company": _encodable(title.customer or ""),
                "comments": f"pidcfg {title.version}",
            }
        )
        formats = {
            "head": book.add_format({"bold": True, "bg_color": "#E4E9EE", "bottom": 1, **WRAPPED_FORMAT}),
            "text": book.add_format(WRAPPED_FORMAT),
            "number": book.add_format({"valign": "top"}),
        }
        for table in tables:
            _write_table(book.add_worksheet(table.title), table, formats, title)
    return stream.getvalue()


def _write_table(sheet: Any, table: Table, formats: Data, title: Title) -> None:
    for column, name in enumerate(table.columns):
        sheet.write_string(0, column, name, formats["head"])
    for number, row in enumerate(table.rows, start=1):
        for column, value in enumerate(row):
            _write_cell(sheet, (number, column), value, formats)
    columns = column_widths(table)
    for column, width in enumerate(columns):
        sheet.set_column(column, column, width)
    for number, row in enumerate(table.rows, start=1):
        sheet.set_row(number, LINE_HEIGHT * line_count(row, columns))
    sheet.freeze_panes(1, 0)
    sheet.repeat_rows(0)
    if table.rows:
        sheet.autofilter(0, 0, len(table.rows), len(table.columns) - 1)
    sheet.set_landscape()
    sheet.set_paper(9)
    sheet.fit_to_pages(1, 0)
    name = " ".join(part for part in (title.project, title.document, title.revision) if part) or title.title
    sheet.set_header(f"&L{_header_text(name)}&R&A")
    sheet.set_footer("&RPage &P of &N")


def _header_text(name: str) -> str:
    """A text in a header, where & begins a command; a header holds 255 characters."""
    return _encodable(name)[:80].replace("&", "&&")


def _encodable(words: str) -> str:
    """A printable text, with a question mark for a byte of a name that is none of UTF-8, as the workbook is."""
    return to_printable(words).encode("utf-8", "replace").decode()


def _write_cell(sheet: Any, position: tuple[int, int], value: Value, formats: Data) -> None:
    if value is None or value == "":
        return
    if isinstance(value, int | float | Decimal) and not isinstance(value, bool):
        sheet.write_number(*position, float(value) if isinstance(value, Decimal) else value, formats["number"])
    else:
        sheet.write_string(*position, _encodable(cell_text(value))[:MAX_CHARACTERS], formats["text"])


def line_count(row: Sequence[Value], columns: Sequence[int]) -> int:
    """How many lines the longest cell of a row takes: not every spreadsheet works it out by itself."""
    return max(1, *(ceil(len(cell_text(cell)) / (width - 2)) for cell, width in zip(row, columns, strict=True)))


def column_widths(table: Table) -> list[int]:
    """A width for each column that holds its longest cell, within reason."""
    columns = [[*map(cell_text, column)] for column in zip(table.columns, *table.rows, strict=True)]
    return [min(MAX_WIDTH, max(MIN_WIDTH, *(len(cell) for cell in column)) + 2) for column in columns]
