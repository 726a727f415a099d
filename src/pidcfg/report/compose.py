"""From checked configurations and runs to the content of a report."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.diagnostics import ordered
from pidcfg.report.content import Content
from pidcfg.report.runs import run_sheet
from pidcfg.report.sheets import plc_sheet

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.report.content import LoopSheet, SourceFile, Title
    from pidcfg.report.runs import Run
    from pidcfg.validate.engine import Checked


def compose(
    title: Title,
    files: Sequence[SourceFile],
    configurations: Sequence[Checked],
    runs: Sequence[Run],
    findings: Sequence[Diagnostic],
) -> Content:
    """The whole report; ``findings`` are those of all files."""
    all_findings = tuple(sorted(ordered(list(findings)), key=lambda d: -d.severity))
    return Content(
        title=title,
        files=tuple(files),
        plcs=tuple(plc_sheet(checked, i, all_findings) for i, checked in enumerate(configurations, start=1)),
        runs=tuple(run_sheet(run, i) for i, run in enumerate(runs, start=1)),
        findings=all_findings,
    )


def renamed(content: Content, name: Callable[[str], str]) -> Content:
    """The same report with other names of its files."""

    def finding(d: Diagnostic) -> Diagnostic:
        return replace(d, file=name(d.file))

    def loop(sheet: LoopSheet) -> LoopSheet:
        return replace(sheet, findings=tuple(map(finding, sheet.findings)))

    return replace(
        content,
        files=tuple(replace(file, name=name(file.name)) for file in content.files),
        plcs=tuple(replace(plc, file=name(plc.file), loops=tuple(map(loop, plc.loops))) for plc in content.plcs),
        runs=tuple(replace(run, file=name(run.file), config=name(run.config)) for run in content.runs),
        findings=tuple(map(finding, content.findings)),
    )
