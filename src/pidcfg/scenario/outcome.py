"""One scenario run: what was read, what became of it, and whether that is what was expected."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Diagnostic, Severity, ordered
from pidcfg.reader import DISK, Reader

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.scenario.axes import Axes
    from pidcfg.scenario.load import Loaded
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.report import Report
    from pidcfg.sim.run import Settings

LOOP_STEP = 10.0
"""About what a loop-step takes in CPython with everything around it, in µs."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """One scenario file: its findings, and its report when it could run."""

    file: str
    config: str = ""
    report: Report | None = None
    findings: Sequence[Diagnostic] = ()
    documents: Mapping[str, Document] = field(default_factory=dict)
    config_errors: bool = False
    """Whether the configuration has errors; they are among the findings."""
    recording: Recording | None = None
    """The trend for a picture, where one is wanted."""
    axes: Mapping[str, Axes] = field(default_factory=dict)
    """Names and units of each loop's signals."""

    @property
    def unjudged(self) -> bool:
        """Whether a configuration with errors ran and nothing was expected of it."""
        return self.config_errors and self.report is not None and not self.report.expectations

    @property
    def effort(self) -> float:
        """What the run has taken, in µs by a count of its loop-steps; compiled ones are next to nothing."""
        report = self.report
        return 0.0 if report is None or report.engine != "python" else report.steps * len(report.loops) * LOOP_STEP

    @property
    def passed(self) -> bool:
        """Whether it ran and everything expected of it holds."""
        return self.report is not None and self.report.passed and not self.unjudged


def simulate_document(
    doc: Document, settings: Settings, limits: Limits, reader: Reader = DISK, *, record: bool = False
) -> Outcome:
    """Runs one scenario file; ``record``: with the trend of its loops, for `pidcfg.scenario.charts.charts_of`."""
    from pidcfg.scenario.load import load
    from pidcfg.validate.engine import is_scenario

    if doc.data is not None and not is_scenario(doc):
        cure = "a scenario begins with 'scenario: …' and names its configuration"
        finding = Diagnostic("PID032", Severity.ERROR, "the file is no scenario", doc.file, help=cure)
        return Outcome(doc.file, findings=[finding], documents={doc.file: doc})
    return simulate_loaded(load(doc, limits, reader), settings, record=record)


def simulate_loaded(loaded: Loaded, settings: Settings, *, record: bool = False) -> Outcome:
    """Runs a scenario with everything that it needs, as far as that could be loaded."""
    from pidcfg.scenario.axes import axes_of, signals_of
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.run import UnusableError, simulate

    outcome = Outcome(loaded.document.file, loaded.config, documents=loaded.documents)
    if loaded.scenario is None or loaded.image is None:
        return replace(outcome, findings=loaded.findings)
    plc = loaded.plc()
    _, problems = loaded.uncertainties(plc)
    loaded.add(problems)
    if any(problem.severity == "error" for problem in problems):
        return replace(outcome, findings=loaded.findings)
    axes = axes_of(plc, loaded.image.settings)
    recording = Recording(signals_of(axes)) if record else None
    try:
        report = simulate(loaded.scenario, loaded.plc, loaded.controller, replace(settings, recording=recording))
    except UnusableError as error:
        loaded.add(error.problems)
        return replace(outcome, findings=loaded.findings)
    loaded.add(report.problems)
    return replace(
        outcome,
        report=report,
        findings=[*loaded.findings, *loaded.config_errors],
        config_errors=bool(loaded.config_errors),
        recording=recording,
        axes=axes,
    )


def check_any(doc: Document, limits: Limits, reader: Reader = DISK) -> list[Diagnostic]:
    """The findings of a configuration, or of a scenario and what it names."""
    from pidcfg.validate.engine import check_document, is_scenario

    if is_scenario(doc):
        from pidcfg.scenario.load import check_scenario
        from pidcfg.validate.curly import curly_quotes

        return [*check_scenario(doc, limits, reader), *curly_quotes(doc)]
    checked = check_document(doc, limits)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole or not has_map(doc):
        return list(checked.findings)
    from pidcfg.map_files import check_map

    wrong = check_map(doc, checked.vendor, checked.encoding.image, reader, limits)
    return ordered([*checked.findings, *wrong])


def has_map(doc: Document) -> bool:
    """Whether a configuration names a Modbus map."""
    plc = (doc.data or {}).get("plc")
    return isinstance(plc, dict) and "map" in plc
