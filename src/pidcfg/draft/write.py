"""A scenario drafted for a configuration, tried before it is handed out: it runs, and no verdict fails."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from pidcfg.control_characters import one_line
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.draft.course import Line, Units, course_of
from pidcfg.draft.expectations import expectations
from pidcfg.draft.loops import plans_of
from pidcfg.draft.surroundings import surroundings_of
from pidcfg.draft.text import text_of
from pidcfg.scenario.load import Loaded, read_scenario
from pidcfg.scenario.outcome import Outcome, simulate_loaded
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.run import Settings
from pidcfg.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.verification.neutral import loops_of

if TYPE_CHECKING:
    from pidcfg.document import Document
    from pidcfg.draft.course import Course
    from pidcfg.limits import Limits
    from pidcfg.sim.report import Report, Standing, Verdict
    from pidcfg.validate.engine import Checked

TRIES = ((1.0, True), (1.0, False), (0.4, True), (0.4, False), (0.0, True))
"""Share of the planned steps and disturbances, and whether the run begins settled; the first that passes is taken."""
MOST_NAMES = 3
"""Loops that a title names."""
PROFILE = "the profile of {name} does not run; an event {{at: …, loop: {name}, ramp_soak: start}} starts it"
NOT_HELD = "{text} is not expected: on this plant it is {value}"


class NoDraftError(ValueError):
    """A configuration for which no scenario can be drafted, and why."""


@dataclass(frozen=True, slots=True)
class Draft:
    """A scenario as text, and what to know about it."""

    text: str
    left_out: tuple[str, ...] = ()
    """Loops that have no plant, or whose verdict is allowed to fail, each with the reason."""


def draft_of(checked: Checked, config: str, title: str = "", most: int | None = None) -> Draft:
    """The scenario of a checked configuration, which it names ``config``; raises `NoDraftError` where there is none.

    It is run before: loops that no plan suits are named in the text and allowed to fail, with the verdict as reason.
    ``most``: loop-steps that a run may have.
    """
    vendor, encoding = checked.vendor, checked.encoding
    if vendor is None or encoding is None or not encoding.whole or checked.failed:
        raise NoDraftError(f"{checked.document.file} has errors; run 'pidcfg validate {checked.document.file}' first")
    if one_line(config) != config:
        raise NoDraftError(f"no scenario can name {config!r}: rename the file, without control characters")
    plc = vendor.module("controller").load(encoding.image)
    around = surroundings_of(checked.config, plc)
    plans = plans_of(plc, loops_of(checked.config, vendor), around)
    if not plans:
        raise NoDraftError(f"{checked.document.file} has no loop that is calculated")
    units = Units(plc, {plan.i: plan for plan in plans}, around)
    names = ", ".join(plan.name for plan in plans) if len(plans) <= MOST_NAMES else f"{len(plans)} loops"
    title = title or f"Steps and disturbances of {names}"
    trials, refused = [], ""
    for size, steady in TRIES:
        course = course_of(units, size, steady=steady)
        course.expect = expectations(units, course)
        outcome = _run(checked, course, title, config, most)
        if outcome.report is None:
            refused = refused or _reason(outcome)
            continue
        trials.append(_trial(course, outcome.report))
        if not trials[-1].failing:
            break
    if not trials:
        raise NoDraftError(f"{checked.document.file}: no scenario runs with it{refused}; write one by hand")
    best = min(trials, key=lambda trial: len(trial.failing))
    course = best.course
    course.allow += [_allowance(v) for v in best.failing]
    course.expect = [line for line, verdict in best.verdicts if verdict.passed]
    course.remarks += [
        NOT_HELD.format(text=verdict.text, value=_shown(verdict.value))
        for _, verdict in best.verdicts
        if not verdict.passed
    ]
    course.remarks += [PROFILE.format(name=plan.name) for plan in plans if _has_profile(checked.config.loops[plan.i])]
    return Draft(text_of(course, title, config), tuple(course.remarks))


def _has_profile(loop: Any) -> bool:
    """Whether a loop has a set-point profile to run."""
    return bool(getattr(getattr(loop, "ramp_soak", None), "steps", ()))


@dataclass(frozen=True, slots=True)
class _Trial:
    """A course that has run."""

    course: Course
    failing: list[Standing]
    verdicts: list[tuple[Line, Verdict]]


def _trial(course: Course, report: Report) -> _Trial:
    failing = [v for v in report.standing if v.fails]
    return _Trial(course, failing, list(zip(course.expect, report.expectations, strict=True)))


def _reason(outcome: Outcome) -> str:
    """Why a course did not run."""
    return next((f" ({d.message})" for d in outcome.findings if d.severity is Severity.ERROR), "")


def _allowance(verdict: Standing) -> Line:
    row = {"kind": verdict.kind, "loop": verdict.loop, "reason": f"on the drafted plant: {verdict.text}"}
    return Line(row)


def _shown(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _run(checked: Checked, course: Course, title: str, config: str, most: int | None) -> Outcome:
    """The course as a scenario, run."""
    data: dict[str, Any] = course.data(title, config)
    loaded = Loaded(checked.document, scenario=Scenario.model_validate(data), config=config)
    encoding = checked.encoding
    loaded.vendor, loaded.image = checked.vendor, None if encoding is None else encoding.image
    return simulate_loaded(loaded, Settings("auto", max_loop_steps=most))


def simulate_draft(doc: Document, settings: Settings, limits: Limits, *, record: bool = False) -> Outcome:
    """Runs a configuration with its drafted scenario; one with errors has its findings and no report."""
    checked = check_document(doc, limits)
    documents = {doc.file: doc}
    try:
        text = draft_of(checked, doc.file, most=settings.max_loop_steps).text
    except NoDraftError as error:
        findings = checked.findings
        if not checked.failed:
            findings = (*findings, Diagnostic("PID058", Severity.ERROR, str(error), doc.file))
        return Outcome(doc.file, doc.file, findings=findings, documents=documents)
    scenario = read_document(text.encode(), f"{doc.file} (drafted scenario)", limits)
    loaded = Loaded(scenario, [], *read_scenario(scenario)[:1], config=doc.file, documents=documents)
    loaded.documents[scenario.file] = scenario
    loaded.vendor, loaded.image = checked.vendor, checked.encoding.image if checked.encoding else None
    return replace(simulate_loaded(loaded, settings, record=record), file=doc.file)
