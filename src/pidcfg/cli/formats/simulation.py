"""Runs in the formats of CI systems: their findings, and every expectation that failed as a finding at its line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.cli.formats import render, simulation_text
from pidcfg.cli.formats.findings import Findings
from pidcfg.diagnostics import START, Diagnostic, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.cli.formats.junit import Case
    from pidcfg.scenario.outcome import Outcome
    from pidcfg.sim.report import Report, Verdict

FORMATS = ("text", "json", "sarif", "github", "gitlab", "junit")
RUN = "the run is sound"
"""The test case of what is no expectation: findings, and errors on the way."""


def render_runs(name: str, outcomes: Sequence[Outcome], fails: Severity = Severity.ERROR) -> str:
    """The runs in one of the formats; findings from ``fails`` on fail a run."""
    if name in simulation_text.REPORTERS:
        return simulation_text.REPORTERS[name](outcomes)
    if name == "junit":
        return _junit(outcomes, fails)
    found = [d for outcome in outcomes for d in (*outcome.findings, *_failed(outcome))]
    documents = {file: doc for outcome in outcomes for file, doc in outcome.documents.items()}
    return render(name, Findings(list(dict.fromkeys(found)), documents, fails))


def _failed(outcome: Outcome) -> Iterator[Diagnostic]:
    """Expectations that do not hold, and errors of the run, as findings."""
    if outcome.report is None:
        return
    for i, verdict in enumerate(outcome.report.expectations):
        if not verdict.passed:
            yield _expectation(outcome, i, verdict)
    yield from _notes(outcome, outcome.report)


def _expectation(outcome: Outcome, i: int, verdict: Verdict) -> Diagnostic:
    """A failed expectation where the scenario states it; verdicts stand in the order of the scenario."""
    doc, path = outcome.documents[outcome.file], ("expect", i)
    stated = doc.data["expect"][i] if doc.data else {}
    names = (stated.get("loop"), str(stated.get("signal", "")).rpartition(".")[0])
    loops = () if outcome.report is None else outcome.report.loops
    loop = next((str(name) for name in names if name in loops), None)
    message = f"expected: {verdict.text}; measured: {simulation_text.value_text(verdict.value)}"
    return Diagnostic("PID061", Severity.ERROR, message, outcome.file, doc.locate(path), path, loop)


def _notes(outcome: Outcome, report: Report) -> Iterator[Diagnostic]:
    """Errors that a run met on its way; they have a time, but no place in the file."""
    for note in report.notes:
        if note.error:
            text = f"at {note.at:g} s: {note.text}"
            yield Diagnostic("PID062", Severity.ERROR, text, outcome.file, START, (), note.loop)


def _junit(outcomes: Sequence[Outcome], fails: Severity) -> str:
    """A suite a scenario: whether the run is sound, then each expectation."""
    from pidcfg.cli.formats.findings import shown
    from pidcfg.cli.formats.junit import document

    suites: Mapping[str, list[Case]] = {shown(o.file): [_sound(o, fails), *_verdicts(o)] for o in outcomes}
    return document("pidcfg simulate", suites)


def _sound(outcome: Outcome, fails: Severity) -> Case:
    """Fails as the run does: on errors of the scenario, and on those of its configuration when nothing is expected."""
    from pidcfg.cli.formats.junit import Case, block, entry

    notes = [] if outcome.report is None else list(_notes(outcome, outcome.report))
    every = [*outcome.findings, *notes]
    failed = [d for d in every if d.severity >= fails and (_counts(d, outcome) or fails < Severity.ERROR)]
    output = "\n\n".join(block(d) for d in every if d not in failed)
    entries = tuple(entry(d) for d in failed)
    if outcome.report is None:
        return Case(RUN, errors=entries, output=output)
    return Case(RUN, entries, output=output)


def _counts(d: Diagnostic, outcome: Outcome) -> bool:
    """Whether an error is the scenario's own; those of a configuration are judged by the expectations, if any."""
    return d.file == outcome.file or outcome.unjudged


def _verdicts(outcome: Outcome) -> Iterator[Case]:
    from pidcfg.cli.formats.junit import Case, entry

    seen: dict[str, int] = {}
    for i, verdict in enumerate(() if outcome.report is None else outcome.report.expectations):
        seen[verdict.text] = seen.get(verdict.text, 0) + 1
        name = verdict.text if seen[verdict.text] == 1 else f"{verdict.text} ({seen[verdict.text]})"
        if verdict.passed:
            yield Case(name, output=f"measured: {simulation_text.value_text(verdict.value)}")
        else:
            yield Case(name, (entry(_expectation(outcome, i, verdict)),))
