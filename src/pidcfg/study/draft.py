"""A scenario drafted for a configuration, tried before it is handed out."""

from __future__ import annotations

import json
import re
from collections.abc import Collection, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.engine.run import Settings
from pidcfg.sim.judgement.report import Report, Standing, Verdict
from pidcfg.study.draft_plan import (
    DraftParts,
    Line,
    PlanUnits,
    find_connections,
    make_draft,
    make_plans,
    round_to_digits,
    time_text,
)
from pidcfg.study.outcome import Outcome, simulate_loaded
from pidcfg.study.scenario import LoadedScenario, read_scenario
from pidcfg.study.verification.trial import loops_of
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.document import Document
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import value_at
from pidcfg.text.signs import to_one_line
from pidcfg.text.source import read_document
from pidcfg.validate.engine import Checked, check_document
from pidcfg.validate.shared_checks import ACTION_KEY, action_of, purpose_of

# --- What a drafted run should show: set points reached, little overshoot, no outermost alarm -------------------------

END_TOLERANCE = 0.02
"""Of the range of the PV: how near to its set point a loop shall end."""
MAX_OVERSHOOT = 30
"""In %: what a step may overshoot on a plant that suits the loop."""


def expected_behaviour(units: PlanUnits, draft: DraftParts) -> list[Line]:
    """What such a run should show."""
    lines: list[Line] = []
    new_setpoints = {line.data["loop"]: line.data["set"]["setpoint"] for line in draft.events if _is_setpoint(line)}
    for plan in units.plans.values():
        if plan.name in new_setpoints and plan.integrates:
            band = END_TOLERANCE * units.pv_span(plan) + 1.5 * units.plc.dead_band(plan.i, units.plc.signal_values)
            signal = units.plant_name(plan) if units.plant_name(plan) != plan.name else f"{plan.name}.PV"
            row = {"signal": signal, "final": new_setpoints[plan.name], "tolerance": round_to_digits(band, 2)}
            lines.append(Line(row))
            if any(line.data.get("loop") == plan.name and line.data["at"] for line in draft.events):
                lines.append(Line({"loop": plan.name, "metric": "overshoot", "max": f"{MAX_OVERSHOOT} %"}))
        alarms = [a for a in units.plc.outer_alarms if a.startswith("pv_") and units.plc.alarm_is_on(plan.i, a)]
        lines += [Line({"loop": plan.name, "alarm": alarm, "never": True}) for alarm in alarms]
    lines += [Line({"loop": line.data["loop"], "mode": "auto"}) for line in draft.events if "mode" in line.data]
    return lines


def _is_setpoint(line: Line) -> bool:
    return "loop" in line.data and "setpoint" in line.data.get("set", {})


# ----------------------------------------------------------------------------------------------------------------------
# A drafted scenario as a file: what belongs on one line stands on one line, and comments stand below each other.

PLAIN_SCALAR = re.compile(r"[A-Za-z_][\w./-]*( [\w./*+-][\w./*+()-]*)*( %)?")
"""Texts that need no quotes, in braces either."""
PERCENT_PATTERN = re.compile(r"\d+ %")
FILE_PATTERN = re.compile(r"[\w./][\w./-]*")
RESERVED_WORDS = frozenset(("true", "false", "null", "yes", "no", "on", "off", "y", "n", "none"))
MAX_COMMENTED_LINE = 100
"""Where a comment still stands behind its line, rather than above it."""
SCENARIO_HEADER = """\
# A first scenario for {config}, drafted from its ranges and gains.
# The plants are no model of your process: each is one that the loop's own gains suit. Put in what you know of it,
# or let 'pidcfg tune --from-csv' find gain, time constant and dead time in a recorded step.
"""


def scenario_text(draft: DraftParts, title: str, config: str, action_key: str) -> str:
    """The scenario as YAML; ``action_key``: what the vendor calls the action."""
    rows = [
        "pidcfg: 1",
        f"scenario: {_title_text(title)}",
        f"config: {scalar_text(config)}",
        _duration_line(draft.duration),
    ]
    if draft.initial == "steady":
        rows.append("initial: steady                  # settled at the set points when time starts")
    elif isinstance(draft.initial, dict) and draft.initial:
        rows.append(f"initial: {flow_text(draft.initial)}   # the output that each loop starts with")
    if draft.plants:
        rows.append("plants:                          # each moves its loop's PV, in engineering units")
        rows += _plant_lines(draft)
    if draft.connect:
        rows += ["connect:                         # what the PVs show"]
        rows += _align_comments(
            [(f"  {scalar_text(line.key)}: {scalar_text(line.data['to'])}", line.comment) for line in draft.connect]
        )
    if draft.tolerance:
        rows.append("tolerance:                       # how far from its set point a PV may come to rest")
        rows += _align_comments(
            [(f"  {scalar_text(line.key)}: {number_text(line.data['of'])}", line.comment) for line in draft.tolerance]
        )
    if draft.assumed_signs:
        rows.append(f"# sign of the plant assumed from `{action_key}`: check, and take the loop off the list")
        rows.append(f"assumed_signs: [{', '.join(map(scalar_text, draft.assumed_signs))}]")
    for part, lines in (("events", draft.events), ("expect", draft.expect), ("allow", draft.allow)):
        if lines:
            rows.append(f"{part}:")
            rows += _align_comments([(f"  - {flow_text(line.data)}", line.comment) for line in lines])
    remarks = [f"# - {remark}" for remark in draft.remarks]
    head = SCENARIO_HEADER.format(config=config) + ("# What to know:\n" + "\n".join(remarks) + "\n" if remarks else "")
    return head + "\n".join(rows) + "\n"


def _title_text(text: str) -> str:
    """On a line of its own commas need no quotes."""
    return text if all(PLAIN_SCALAR.fullmatch(part) for part in text.split(", ")) else scalar_text(text)


def _duration_line(seconds: float) -> str:
    row = f"duration: {number_text(seconds)}"
    return f"{row:33}# s, {time_text(seconds)}" if seconds >= 120 else f"{row:33}# s"


def _plant_lines(draft: DraftParts) -> list[str]:
    if draft.connect:
        return _align_comments(
            [(f"  - {flow_text({'name': line.key, **line.data})}", line.comment) for line in draft.plants]
        )
    width = max(len(scalar_text(line.key)) for line in draft.plants) + 1
    return _align_comments(
        [(f"  {scalar_text(line.key) + ':':{width}} {flow_text(line.data)}", line.comment) for line in draft.plants]
    )


def _align_comments(rows: Sequence[tuple[str, str]]) -> list[str]:
    """Lines with their comments in one column; above the line where it is long."""
    column = max((len(row) for row, comment in rows if comment and len(row) <= MAX_COMMENTED_LINE), default=0) + 3
    out = []
    for row, comment in rows:
        if comment and len(row) > MAX_COMMENTED_LINE:
            out.append(f"  # {comment}")
            out.append(row)
        else:
            out.append(f"{row:{column}}# {comment}" if comment else row)
    return out


def flow_text(data: dict[str, Any]) -> str:
    """A mapping in braces."""
    return "{" + ", ".join(f"{scalar_text(key)}: {scalar_text(value)}" for key, value in data.items()) + "}"


def scalar_text(value: Any) -> str:
    """A value as YAML writes it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return number_text(value)
    if isinstance(value, dict):
        return flow_text(value)
    text = str(value)
    file = text.endswith((".yaml", ".yml")) and FILE_PATTERN.fullmatch(text)
    if file or PERCENT_PATTERN.fullmatch(text) or (PLAIN_SCALAR.fullmatch(text) and text.lower() not in RESERVED_WORDS):
        return text
    return json.dumps(text, ensure_ascii=False)


def number_text(value: float) -> str:
    """A number as people write it."""
    return f"{value:.10g}"


# --- A scenario drafted for a configuration, tried before it is handed out: it runs, and no verdict fails -------------

ATTEMPTS = ((1.0, True), (1.0, False), (0.4, True), (0.4, False), (0.0, True))
"""Share of the planned steps and disturbances, and whether the run begins settled; the first that passes is taken."""
LENGTH_FACTORS = (1, 3)
"""Times as long as planned: a longer run is tried where all that fails is not proven."""
MAX_TITLE_LOOPS = 3
"""Loops that a title names."""
PROFILE_REMARK = "the profile of {name} does not run; an event {{at: …, loop: {name}, ramp_soak: start}} starts it"
CONTRADICTION_REMARK = "fails: the {place} says {word!r} ({purpose}), and {here} is for the opposite"
COUNTS_REMARK = "{name}: gain and load are in counts of the output, {low} to {high}; with an output.range in its unit"
NOT_EXPECTED_REMARK = "{text} is not expected: on this plant it is {value}"


class NoDraftError(ValueError):
    """A configuration for which no scenario can be drafted, and why."""


@frozen
class Draft:
    """A scenario as text, and what to know about it."""

    text: str
    remarks: tuple[str, ...] = ()
    """Loops that have no plant, or whose verdict is allowed to fail, each with the reason."""


def _count_remarks(units: PlanUnits, loops: Sequence[Any]) -> list[str]:
    """Remarks on outputs in counts: those of a PLC that scales them, without a range."""
    if not units.plc.out_ranges:
        return []
    plans = (p for p in units.plans.values() if not p.is_on_off and value_at(loops[p.i], ("output", "range")) is None)
    return [
        COUNTS_REMARK.format(name=p.name, low=f"{units.output_scale(p)[0]:g}", high=f"{units.output_scale(p)[1]:g}")
        for p in plans
    ]


def draft_scenario(checked: Checked, config: str, title: str = "", max_loop_steps: int | None = None) -> Draft:
    """The scenario of a checked configuration, which it names ``config``; raises `NoDraftError` where there is none.

    It is run before: loops that no plan suits are named in the text and allowed to fail, with the verdict as reason.
    ``max_loop_steps``: loop-steps that a run may have.
    """
    vendor, encoding = checked.vendor, checked.encoding
    if vendor is None or encoding is None or not encoding.is_complete or checked.failed:
        raise NoDraftError(f"{checked.document.file} has errors; run 'pidcfg validate {checked.document.file}' first")
    if to_one_line(config) != config:
        raise NoDraftError(f"no scenario can name {config!r}: rename the file, without control characters")
    plc = vendor.module("controller").load(encoding.image)
    connections = find_connections(checked.config, plc)
    signs = _find_signs(checked, plc.output_raises_pv)
    plans = make_plans(plc, loops_of(checked.config, vendor), connections, [sign.output_raises_pv for sign in signs])
    if not plans:
        raise NoDraftError(f"{checked.document.file} has no loop that is calculated")
    units = PlanUnits(plc, {plan.i: plan for plan in plans}, connections)
    names = ", ".join(plan.name for plan in plans) if len(plans) <= MAX_TITLE_LOOPS else f"{len(plans)} loops"
    title = title or f"Steps and disturbances of {names}"
    wrong_loops = {plan.name for plan in plans if signs[plan.i].contradiction}
    assumed_loops = tuple(plan.name for plan in plans if signs[plan.i].is_assumed)
    trials: list[_DraftRun] = []
    reason = ""
    for (size, steady), length in product(ATTEMPTS, LENGTH_FACTORS):
        if length > 1 and not (trials and trials[-1].is_short):
            continue
        if not size and any(trial.is_short for trial in trials):
            break  # without a step or a disturbance nothing would be proven at all
        draft = make_draft(units, size, steady=steady, length=length)
        draft.expect, draft.assumed_signs = expected_behaviour(units, draft), assumed_loops
        outcome = _run_draft(checked, draft, title, config, max_loop_steps)
        if outcome.report is None:
            reason = reason or _reason_text(outcome)
            continue
        trials.append(_judge_draft(draft, outcome.report, wrong_loops))
        if not trials[-1].failing:
            break
    if not trials:
        raise NoDraftError(f"{checked.document.file}: no scenario runs with it{reason}; write one by hand")
    draft = _finish_draft(min(trials, key=lambda trial: (not trial.is_short, len(trial.failing))), wrong_loops)
    draft.remarks = [f"{plan.name} {text}" for plan in plans if (text := signs[plan.i].contradiction)] + draft.remarks
    loops = checked.config.loops
    draft.remarks += _count_remarks(units, loops)
    draft.remarks += [PROFILE_REMARK.format(name=plan.name) for plan in plans if has_profile(loops[plan.i])]
    key = next((sign.key for sign in signs if sign.is_assumed), "")
    return Draft(scenario_text(draft, title, config, key), tuple(draft.remarks))


def _finish_draft(run: _DraftRun, wrong_loops: Collection[str]) -> DraftParts:
    """The course of a run with what it may fail by, and without what it does not show; ``wrong_loops`` shall fail."""
    draft = run.draft
    draft.allow += [_allowance_line(v) for v in run.failing]
    draft.expect = [line for line, verdict in run.verdicts if verdict.passed or verdict.loop in wrong_loops]
    draft.remarks += [
        NOT_EXPECTED_REMARK.format(text=verdict.text, value=_value_text(verdict.value))
        for _, verdict in run.verdicts
        if not verdict.passed and verdict.loop not in wrong_loops
    ]
    return draft


@frozen
class _PlantSign:
    """Whether the PV of a loop's plant rises with the output, and how that is known."""

    output_raises_pv: bool
    is_assumed: bool
    """By the loop's own action alone."""
    key: str = ACTION_KEY
    """What says the action."""
    contradiction: str = ""
    """Why the loop fails: its action is the other one than its words want."""


def _find_signs(checked: Checked, output_raises_pv: Sequence[bool]) -> list[_PlantSign]:
    """By the words of each loop; where they tell nothing, by its action."""
    signs = []
    for loop, by_action in zip(checked.config.loops, output_raises_pv, strict=True):
        purpose, action = purpose_of(loop), None if checked.vendor is None else action_of(checked.vendor, loop)
        key = ACTION_KEY if action is None else action.key
        if purpose is None:
            signs.append(_PlantSign(by_action, is_assumed=True, key=key))
            continue
        action_key = key if action is None else action.own_text
        text = CONTRADICTION_REMARK.format(here=action_key, place=purpose.key, word=purpose.word, purpose=purpose.text)
        is_right = purpose.heats is by_action
        signs.append(_PlantSign(purpose.heats, is_assumed=False, key=key, contradiction="" if is_right else text))
    return signs


def has_profile(loop: Any) -> bool:
    """Whether a loop has a set-point profile to run."""
    return bool(getattr(getattr(loop, "ramp_soak", None), "steps", ()))


@frozen
class _DraftRun:
    """A course that has run."""

    draft: DraftParts
    failing: list[Standing]
    verdicts: list[tuple[Line, Verdict]]

    @property
    def is_short(self) -> bool:
        """Whether a longer run may prove what this one does not."""
        return all(v.verdict == "not-proven" for v in self.failing)


def _judge_draft(draft: DraftParts, report: Report, wrong_loops: Collection[str]) -> _DraftRun:
    """A run; loops that ``wrong_loops`` names fail, as they should."""
    failing = [v for v in report.standing if v.fails and v.loop not in wrong_loops]
    return _DraftRun(draft, failing, list(zip(draft.expect, report.expectations, strict=True)))


def _reason_text(outcome: Outcome) -> str:
    """Why a course did not run."""
    return next((f" ({d.message})" for d in outcome.findings if d.severity is Severity.ERROR), "")


def _allowance_line(verdict: Standing) -> Line:
    row = {"kind": verdict.kind, "loop": verdict.loop, "reason": f"on the drafted plant: {verdict.text}"}
    return Line(row)


def _value_text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def _run_draft(checked: Checked, draft: DraftParts, title: str, config: str, max_loop_steps: int | None) -> Outcome:
    """The course as a scenario, run."""
    data: dict[str, Any] = draft.scenario_data(title, config)
    loaded = LoadedScenario(checked.document, scenario=Scenario.model_validate(data), config=config)
    encoding = checked.encoding
    loaded.vendor, loaded.image = checked.vendor, None if encoding is None else encoding.image
    return simulate_loaded(loaded, Settings("auto", max_loop_steps=max_loop_steps))


def simulate_draft(
    doc: Document,
    settings: Settings,
    *,
    record: bool = False,
    reference_file: tuple[bytes, str] | None = None,
    accept_as: str | None = None,
) -> Outcome:
    """Runs a configuration with its drafted scenario; one with errors has its findings and no report."""
    checked = check_document(doc)
    documents = {doc.file: doc}
    try:
        text = draft_scenario(checked, doc.file, max_loop_steps=settings.max_loop_steps).text
    except NoDraftError as error:
        findings = checked.findings
        if not checked.failed:
            findings = (*findings, Diagnostic("PID058", Severity.ERROR, str(error), doc.file))
        return Outcome(doc.file, doc.file, findings=findings, documents=documents)
    scenario = read_document(text.encode(), f"{doc.file} (drafted scenario)", doc.limits)
    loaded = LoadedScenario(scenario, [], *read_scenario(scenario)[:1], config=doc.file, documents=documents)
    loaded.documents[scenario.file] = scenario
    loaded.vendor, loaded.image = checked.vendor, checked.encoding.image if checked.encoding else None
    outcome = simulate_loaded(loaded, settings, record=record, reference_file=reference_file, accept_as=accept_as)
    return replace(outcome, file=doc.file)
