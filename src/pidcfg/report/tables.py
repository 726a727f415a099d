"""The tables of a report, flat: one list of rows each, for the CSV files and the workbook."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.report.runs import METRIC_TITLES

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.report.content import Content, Sheet, Value

Row = tuple["Value", ...]


@dataclass(frozen=True, slots=True)
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
