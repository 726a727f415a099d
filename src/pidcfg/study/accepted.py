"""A run that a person has accepted: what its file holds, and where another run differs from it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.schemas.scenario import (
    AcceptedError,
    AcceptedLoop,
    AcceptedRun,
    AlarmTimes,
    Extent,
    ModeBegin,
    run_of_data,
)
from pidcfg.sim.judgement.report import ACCEPTED_KIND, Standing
from pidcfg.sim.judgement.standing import loop_verdict
from pidcfg.text.diagnostics import START, Diagnostic, Severity
from pidcfg.text.reader import may_be_quoted, read_failure, read_named_file
from pidcfg.text.references import Decision
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Metric, Role, Scenario
    from pidcfg.sim.controllers.plc import Axes
    from pidcfg.sim.judgement.report import LoopReport, Range, Report
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.text.reader import Reader

# --- What an accepted run is worth ------------------------------------------------------------------------------------

D924 = Decision(
    924,
    "how far a run may be from the one that was accepted",
    "Times (settling_time, rise_time, oscillation_period, when a mode begins, when an alarm comes first and how long "
    "it is on): 2 samples of the loop or 5 %. PV and set point, lowest, highest and at the end, final_error and "
    "oscillation_amplitude: 1 % of the PV's span. Output, lowest, highest and at the end: 2 % of its range. "
    "total_variation: 10 % or 2 % of that range. overshoot: 2 points or 10 %. iae and itae: 10 %, or what an error of "
    "0.02 % of the span gives over the run; ise: 20 %, or what 0.1 % gives. Other signals: 2 % of the largest value "
    "that they had. The larger of two counts; spans, ranges and samples are those of the accepted run. Modes and their "
    "order, which alarms come, and the PV's range are the same or not. What was measured in one run alone differs; "
    "swings that were not there count as those of amplitude 0.",
    "Noise is the same in every run, so that a run against itself differs by nothing; a gain that changes by a tenth "
    "moves an integral by about as much. Below a count or a sample nothing is meant.",
)
D925 = Decision(
    925,
    "what an accepted run stands in for",
    "A loop in which nothing differs, and no signal outside of the loops either, is proven where it would not be: its "
    "line says as what it is accepted. What has failed stays failed, and a difference fails the loop whether it is "
    "judged otherwise or not. An allowance does not reach it.",
    "A person has seen how the run is meant to be, which is more than any rule knows; an error that the run itself "
    "shows is one in an accepted run, too. Whoever means the difference accepts the new run.",
)
D926 = Decision(
    926,
    "what may be held against an accepted run",
    "A run of the same title and duration, with the same loops, of those that the scenario judges. `--accept` judges "
    "the run as the one that it writes, and writes none that has failed. certify does not look at it.",
    "Over another time every integral is another; drawn plants are meant to give other runs.",
)

MAX_TEXTS = 6
"""Differences of a loop that are told; the others are counted."""
RANGE_SHARE = 0.001
"""Of its span, by which a range may differ that is the same."""


# --- The file ---------------------------------------------------------------------------------------------------------


def accepted_text(run: AcceptedRun) -> str:
    """The file."""
    return json_text(run.model_dump(), allow_nan=False)


def run_of_report(report: Report, axes: Mapping[str, Axes], scenario: Scenario) -> AcceptedRun:
    """What a run shows of the loops that its scenario judges."""
    names = _judged_loops(scenario, list(report.loops))
    own = {signal for axis in axes.values() for signal in (axis.pv, axis.setpoint, axis.output)}
    others = {
        name: _signal_extent(reach)
        for name, reach in report.signals.items()
        if name not in own and name.rpartition(".")[0] not in report.loops
    }
    return AcceptedRun(
        pidcfg=1,
        accepted=report.scenario,
        duration=float(scenario.duration),
        loops={name: _accepted_loop(report, report.loops[name], axes[name]) for name in names},
        signals=others,
    )


def _judged_loops(scenario: Scenario, loops: Sequence[str]) -> list[str]:
    """Those of some loops that a scenario judges."""
    return [name for name in loops if scenario.loops is None or name in scenario.loops]


def _accepted_loop(report: Report, loop: LoopReport, axes: Axes) -> AcceptedLoop:
    signals: dict[Role, str] = {"pv": axes.pv, "setpoint": axes.setpoint, "output": axes.output}
    return AcceptedLoop(
        pv_unit=axes.pv_unit,
        output_unit=axes.output_unit,
        pv_range=axes.pv_range,
        output_range=axes.output_range,
        sample_time=axes.sample_time or report.step,
        metrics={name: None if (v := loop.metrics.get(name)) is None else _six_digits(v) for name in METRIC_TOLERANCES},
        signals={
            role: _signal_extent(report.signals[name]) for role, name in signals.items() if name in report.signals
        },
        modes=_lasting_modes(loop),
        alarms=_alarm_times(loop, report.duration),
    )


def _signal_extent(reach: Range) -> Extent:
    return Extent(min=_six_digits(reach.low), max=_six_digits(reach.high), final=_six_digits(reach.final))


def _lasting_modes(loop: LoopReport) -> list[ModeBegin]:
    """Each mode that lasted, in order; a refusal changes none."""
    modes = [ModeBegin(at=0.0, mode=loop.first_mode)]
    for change in loop.modes:
        if change.mode != modes[-1].mode:
            modes = [begin for begin in modes if begin.at < change.at]
            modes += [ModeBegin(at=change.at, mode=change.mode)] if not modes or modes[-1].mode != change.mode else []
    return modes


def _alarm_times(loop: LoopReport, end: float) -> dict[str, AlarmTimes]:
    """Each alarm that came, by name."""
    alarms: dict[str, AlarmTimes] = {}
    for alarm in loop.alarms:
        before = alarms.get(alarm.alarm, AlarmTimes(first=alarm.at, total=0.0))
        total = before.total + (end if alarm.cleared is None else alarm.cleared) - alarm.at
        alarms[alarm.alarm] = AlarmTimes(first=before.first, total=_six_digits(total))
    return dict(sorted(alarms.items()))


def _six_digits(value: float) -> float:
    """Six significant digits, which a reader of the file can take in."""
    return float(f"{value:.6g}")


# --- Where a run differs ----------------------------------------------------------------------------------------------


class Tolerance(NamedTuple):
    """The larger of a share of the accepted value, and of so many of a loop's ``scale`` (D924)."""

    share: float
    minimum: float
    scale: str
    unit: str
    """How it is told; ``PV`` and ``OUT`` stand for the loop's units."""


TIME_TOLERANCE = Tolerance(0.05, 2, "sample", "s")
PV_TOLERANCE = Tolerance(0, 0.01, "span", "PV")
OUTPUT_TOLERANCE = Tolerance(0, 0.02, "range", "OUT")
METRIC_TOLERANCES: Mapping[Metric, Tolerance] = {
    "overshoot": Tolerance(0.1, 2, "point", "%"),
    "settling_time": TIME_TOLERANCE,
    "rise_time": TIME_TOLERANCE,
    "iae": Tolerance(0.1, 2e-4, "span for the run", "PV s"),
    "ise": Tolerance(0.2, 1e-6, "square of it", "PV² s"),
    "itae": Tolerance(0.1, 2e-4, "growing with time", "PV s²"),
    "total_variation": Tolerance(0.1, 0.02, "range", "OUT"),
    "final_error": PV_TOLERANCE,
    "oscillation_period": TIME_TOLERANCE,
    "oscillation_amplitude": PV_TOLERANCE,
}
SIGNAL_TOLERANCES: Mapping[Role, tuple[str, Tolerance]] = {
    "pv": ("PV", PV_TOLERANCE),
    "setpoint": ("set point", PV_TOLERANCE),
    "output": ("output", OUTPUT_TOLERANCE),
}
OTHER_SIGNAL_SHARE = 0.02
"""Of the largest value of a signal that is no loop's."""


class Difference(NamedTuple):
    """What is different, in words; ``weight``: how many times the tolerance."""

    weight: float
    text: str


EXACT_WEIGHT = float("inf")
"""The weight of what is the same or not."""


def differences_by_loop(old: AcceptedRun, new: AcceptedRun) -> dict[str, list[str]]:
    """Where a run differs from the accepted one, in words, by loop, what weighs most first; empty: other signals."""
    rows_by_loop = {"": list(_compare_other_signals(old.signals, new.signals))}
    for name, loop in old.loops.items():
        rows_by_loop[name] = list(_LoopComparison(loop, new.loops[name], old.duration).find_differences())
    ordered = {name: sorted(rows, key=lambda row: -row.weight) for name, rows in rows_by_loop.items()}
    return {name: [row.text for row in rows] for name, rows in ordered.items() if rows}


def _compare_other_signals(old: Mapping[str, Extent], new: Mapping[str, Extent]) -> Iterator[Difference]:
    for name, before in old.items():
        limit = OTHER_SIGNAL_SHARE * max(abs(before.min), abs(before.max))
        if name in new:
            yield from _compare_extents(name, before, new[name], limit, "")
        else:
            yield Difference(EXACT_WEIGHT, f"there is no signal {name}")


def _compare_extents(name: str, old: Extent, new: Extent, limit: float, unit: str) -> Iterator[Difference]:
    yield from _compare_values(f"{name} at the end", old.final, new.final, limit, unit)
    yield from _compare_values(f"lowest {name}", old.min, new.min, limit, unit)
    yield from _compare_values(f"highest {name}", old.max, new.max, limit, unit)


def _compare_values(name: str, old: float | None, new: float | None, limit: float, unit: str) -> Iterator[Difference]:
    if old is None and new is None:
        return
    if old is None or new is None:
        yield Difference(EXACT_WEIGHT, f"{name} {_value_text(new, unit)} instead of {_value_text(old, unit)}")
    elif abs(new - old) > limit:
        weight = abs(new - old) / limit if limit else EXACT_WEIGHT
        yield Difference(
            weight, f"{name} {_value_text(new, unit)} instead of {_value_text(old, unit)} ± {_value_text(limit, unit)}"
        )


def _value_text(value: float | None, unit: str) -> str:
    return "none" if value is None else f"{value:.4g} {unit}".rstrip()


class _LoopComparison(NamedTuple):
    """A loop of two runs over the same time in s."""

    old: AcceptedLoop
    new: AcceptedLoop
    duration: float

    def find_differences(self) -> Iterator[Difference]:
        """What differs."""
        old, new = self.old, self.new
        low, high = old.pv_range
        if max(abs(a - b) for a, b in zip(old.pv_range, new.pv_range, strict=True)) > RANGE_SHARE * abs(high - low):
            unit = f" {new.pv_unit}".rstrip()
            ends = f"{new.pv_range[0]:g} to {new.pv_range[1]:g}{unit} instead of {low:g} to {high:g}"
            yield Difference(EXACT_WEIGHT, f"its PV's range is {ends}")
        yield from self._compare_modes()
        yield from self._compare_alarms()
        for name, before in old.metrics.items():
            yield from self._compare_metric(name, before, new.metrics.get(name))
        for role, extent in old.signals.items():
            what, tolerance = SIGNAL_TOLERANCES[role]
            if role in new.signals:
                allowed, unit = self._allowed_difference(tolerance, 0.0), self._unit_of(tolerance)
                yield from _compare_extents(what, extent, new.signals[role], allowed, unit)

    def _compare_metric(self, name: Metric, old: float | None, new: float | None) -> Iterator[Difference]:
        tolerance = METRIC_TOLERANCES[name]
        if name == "oscillation_amplitude":
            old, new = old or 0.0, new or 0.0
        if name == "oscillation_period" and (old is None or new is None):
            return  # the amplitude tells it
        yield from _compare_values(
            name, old, new, self._allowed_difference(tolerance, old or 0.0), self._unit_of(tolerance)
        )

    def _allowed_difference(self, tolerance: Tolerance, value: float) -> float:
        """By how much a value may differ."""
        ends = self.old.output_range or (0.0, 100.0)
        span, time = abs(self.old.pv_range[1] - self.old.pv_range[0]), self.duration
        scales = {
            "sample": self.old.sample_time,
            "span": span,
            "range": abs(ends[1] - ends[0]),
            "point": 1.0,
            "span for the run": span * time,
            "square of it": span**2 * time,
            "growing with time": span * time**2 / 2,
        }
        return max(tolerance.share * value, tolerance.minimum * scales[tolerance.scale])

    def _unit_of(self, tolerance: Tolerance) -> str:
        """The unit of a value; none where its loop has none."""
        word, _, rest = tolerance.unit.partition(" ")
        base = {"PV": self.old.pv_unit, "PV²": self.old.pv_unit, "OUT": self.old.output_unit}.get(word, word)
        squared = "²" if base and word.endswith("²") else ""
        return f"{base}{squared} {rest}".strip() if base else ""

    def _compare_modes(self) -> Iterator[Difference]:
        old, now = self.old.modes, self.new.modes
        if [begin.mode for begin in old] != [begin.mode for begin in now]:
            yield Difference(EXACT_WEIGHT, f"mode {_modes_text(now)} instead of {_modes_text(old)}")
            return
        for before, after in zip(old, now, strict=True):
            allowed = self._allowed_difference(TIME_TOLERANCE, before.at)
            yield from _compare_values(f"mode {before.mode} begins at", before.at, after.at, allowed, "s")

    def _compare_alarms(self) -> Iterator[Difference]:
        old, new = self.old.alarms, self.new.alarms
        for name in [*old, *(name for name in new if name not in old)]:
            if name not in new:
                yield Difference(EXACT_WEIGHT, f"{name} does not come, and came at {old[name].first:g} s")
            elif name not in old:
                yield Difference(EXACT_WEIGHT, f"{name} comes at {new[name].first:g} s, and did not come")
            else:
                for name_of_time, before, after in (
                    (f"{name} comes at", old[name].first, new[name].first),
                    (f"{name} is on for", old[name].total, new[name].total),
                ):
                    yield from _compare_values(
                        name_of_time, before, after, self._allowed_difference(TIME_TOLERANCE, before), "s"
                    )


def _modes_text(modes: Sequence[ModeBegin]) -> str:
    return ", ".join(f"{begin.mode} at {begin.at:g} s" for begin in modes)


# --- A run held against the accepted one ------------------------------------------------------------------------------


class Reference(NamedTuple):
    """The accepted run that a run is held against."""

    name: str
    """Of its file."""
    run: AcceptedRun | None
    findings: list[Diagnostic]
    """What is wrong with the file, if it is."""


def reference_of(
    doc: Document,
    scenario: Scenario,
    loops: Sequence[str],
    reader: Reader,
    reference_file: tuple[bytes, str] | None = None,
) -> Reference:
    """The accepted run of a scenario that names one, or the one in its place.

    ``loops``: of the configuration; ``reference_file``: the content and the name of the file in its place.
    """
    max_bytes = doc.limits.listing_bytes
    path: Path = ("reference",) if reference_file is None else ()
    name = reader.resolve(doc.file, scenario.reference or "") if reference_file is None else reference_file[1]
    try:
        data = read_named_file(reader, name, max_bytes + 1) if reference_file is None else reference_file[0]
        run = run_of_data(
            data, max_bytes, may_quote=reference_file is not None or may_be_quoted(reader, doc.file, name)
        )
        _refuse_other_scenario(run, scenario, loops)
    except AcceptedError as error:
        message = f"{name} {error}"
    except (OSError, ValueError) as error:
        message = read_failure(name, error)
    else:
        return Reference(name, run, [])
    file, span = (doc.file, doc.locate(path)) if path else (name, START)
    cure = "'pidcfg simulate … --accept FILE' writes it"
    return Reference(name, None, [Diagnostic("PID068", Severity.ERROR, message, file, span, path, help=cure)])


def _refuse_other_scenario(run: AcceptedRun, scenario: Scenario, loops: Sequence[str]) -> None:
    """Raises `AcceptedError` for the run of another scenario."""
    judged_loops = _judged_loops(scenario, loops)
    missing = [name for name in judged_loops if name not in run.loops]
    unknown = [name for name in run.loops if name not in judged_loops]
    if run.accepted != scenario.scenario:
        raise AcceptedError(f"is of another scenario: {run.accepted!r}, not {scenario.scenario!r}")
    if missing or unknown:
        reasons = [f"it has no {', '.join(missing)}"] * bool(missing) + [f"it has {', '.join(unknown)}"] * bool(unknown)
        raise AcceptedError(f"is of other loops: {' and '.join(reasons)}")
    if run.duration != float(scenario.duration):
        raise AcceptedError(f"is of another duration: {run.duration:g} s, not {scenario.duration:f} s")


def compare_with_accepted(report: Report, old: AcceptedRun, new: AcceptedRun, name: str) -> None:
    """Adds to a report what differs from the accepted run of a file, and takes what agrees for proven (D925)."""
    rows_by_loop = differences_by_loop(old, new)
    standing = [v for v in report.standing if not v.loop]
    standing += [_make_standing("", rows_by_loop[""], name)] if "" in rows_by_loop else []
    for loop, loop_report in report.loops.items():
        verdicts = [v for v in report.standing if v.loop == loop]
        if loop in old.loops:
            agrees = loop not in rows_by_loop and "" not in rows_by_loop
            verdicts = [_accept_verdict(v, name) if agrees and v.verdict == "not-proven" else v for v in verdicts]
            verdicts.append(_make_standing(loop, rows_by_loop.get(loop, []), name))
        loop_report.verdict, loop_report.missing = loop_verdict(verdicts)
        standing += verdicts
    report.standing = standing


def _accept_verdict(verdict: Standing, name: str) -> Standing:
    text = f"as accepted in {name}: {verdict.text}"
    return replace(verdict, verdict="proven", text=text, allowed=None, accepted=True)


def _make_standing(loop: str, texts: Sequence[str], name: str) -> Standing:
    """What a comparison says of a loop."""
    if not texts:
        return Standing(ACCEPTED_KIND, loop, "proven", f"as accepted in {name}")
    more = f"; and {len(texts) - MAX_TEXTS} more" if len(texts) > MAX_TEXTS else ""
    return Standing(ACCEPTED_KIND, loop, "failed", f"{'; '.join(texts[:MAX_TEXTS])}{more} ({name})")


def differences_text(old: AcceptedRun, new: AcceptedRun) -> str:
    """Where two runs differ, in one line; empty: nowhere beyond the tolerances."""
    if old.accepted != new.accepted:
        return f"the scenario is {new.accepted!r} instead of {old.accepted!r}"
    if set(old.loops) != set(new.loops):
        return f"loops {', '.join(new.loops)} instead of {', '.join(old.loops)}"
    rows = [
        f"{loop}: {text}" if loop else text for loop, texts in differences_by_loop(old, new).items() for text in texts
    ]
    return "; ".join(rows[:MAX_TEXTS]) + (f"; and {len(rows) - MAX_TEXTS} more" if len(rows) > MAX_TEXTS else "")
