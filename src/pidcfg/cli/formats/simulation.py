"""Runs as findings, for formats of CI systems: every expectation that failed is a finding at its line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import load, render
from pidcfg.cli.formats.findings import Findings
from pidcfg.cli.formats.simulation_text import value_text
from pidcfg.diagnostics import START, Diagnostic, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.paths import Path
    from pidcfg.scenario.outcome import Outcome
    from pidcfg.sim.report import Standing, Verdict
    from pidcfg.source import Document


def render_runs(name: str, outcomes: Sequence[Outcome], fails: Severity = Severity.ERROR) -> str:
    """The runs in one of the formats; findings from ``fails`` on fail a run."""
    write = load(name).runs
    if write is not None:
        return write(outcomes, fails)
    reported = [d for outcome in outcomes for d in (*outcome.findings, *_failures(outcome))]
    documents = {file: doc for outcome in outcomes for file, doc in outcome.documents.items()}
    return render(name, Findings(list(dict.fromkeys(reported)), documents, fails))


def _failures(outcome: Outcome) -> Iterator[Diagnostic]:
    """Expectations that do not hold, and errors of the run."""
    for i, verdict in enumerate(() if outcome.report is None else outcome.report.expectations):
        if not verdict.passed:
            yield failed_expectation(outcome, i, verdict)
    for standing in () if outcome.report is None else outcome.report.standing:
        if standing.fails:
            yield failed_standing(outcome, standing)
    yield from run_errors(outcome)


def failed_expectation(outcome: Outcome, i: int, verdict: Verdict) -> Diagnostic:
    """A failed expectation where the scenario states it; verdicts stand in the order of the scenario."""
    doc, path = outcome.documents[outcome.file], ("expect", i)
    stated = doc.data["expect"][i] if doc.data else {}
    names = (stated.get("loop"), str(stated.get("signal", "")).rpartition(".")[0])
    loops = () if outcome.report is None else outcome.report.loops
    loop = next((str(name) for name in names if name in loops), None)
    message = f"expected: {verdict.text}; measured: {value_text(verdict.value)}"
    return Diagnostic("PID061", Severity.ERROR, message, outcome.file, doc.locate(path), path, loop)


def failed_standing(outcome: Outcome, verdict: Standing) -> Diagnostic:
    """A failed standing expectation at the loop in the configuration; of the PLC, where the scenario names it."""
    file, path = outcome.config, loop_path(outcome.documents.get(outcome.config), verdict.loop)
    if path is None:
        file, path = outcome.file, ("config",)
    subject = f"{verdict.loop}: " if verdict.loop else ""
    message = f"{verdict.kind}: {subject}{verdict.text}"
    span = outcome.documents[file].locate(path)
    return Diagnostic("PID063", Severity.ERROR, message, file, span, path, verdict.loop or None)


def loop_path(doc: Document | None, loop: str) -> Path | None:
    """Where a configuration names a loop; None: nowhere, as in a listing."""
    entries = doc.data.get("loops") if doc is not None and doc.data else None
    for i, entry in enumerate(entries if isinstance(entries, list) else ()):
        if isinstance(entry, dict) and str(entry.get("name")) == loop:
            return ("loops", i, "name")
    return None


def run_errors(outcome: Outcome) -> Iterator[Diagnostic]:
    """Errors that a run met on its way; they have a time, but no place in the file."""
    for note in () if outcome.report is None else outcome.report.notes:
        if note.error:
            text = f"at {note.at:g} s: {note.text}"
            yield Diagnostic("PID062", Severity.ERROR, text, outcome.file, START, (), note.loop)
