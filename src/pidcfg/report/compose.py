"""From the sheets of configurations and runs to the content of a report."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.control_characters import one_line
from pidcfg.report.content import Content
from pidcfg.report.sheets import gravest_first

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.report.content import LoopSheet, PlcSheet, SourceFile, Title
    from pidcfg.report.run_content import RunSheet


def compose(
    title: Title,
    files: Sequence[SourceFile],
    configurations: Sequence[PlcSheet],
    runs: Sequence[RunSheet],
    findings: Sequence[Diagnostic],
) -> Content:
    """The whole report; ``findings`` are those of all files, whose names are shown in one line."""
    content = Content(
        title=title,
        files=tuple(files),
        plcs=tuple(numbered(sheet, f"plc-{i}") for i, sheet in enumerate(configurations, start=1)),
        runs=tuple(replace(run, anchor=f"run-{i}") for i, run in enumerate(runs, start=1)),
        findings=tuple(gravest_first(findings)),
    )
    return renamed(content, one_line)


def numbered(sheet: PlcSheet, anchor: str) -> PlcSheet:
    """A configuration whose anchors, its loops' too, are those of its place in the report."""
    loops = (replace(loop, anchor=f"{anchor}-loop-{i}") for i, loop in enumerate(sheet.loops, start=1))
    return replace(sheet, anchor=anchor, loops=tuple(loops))


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
