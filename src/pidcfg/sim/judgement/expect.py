"""Expectations: what is measured for them on the way, and their verdicts at the end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from pidcfg.schemas.scenario import ForbiddenMode
from pidcfg.sim.controllers.plc import TICKS, steps_until
from pidcfg.sim.judgement.meters import NEVER, STEP_METRICS, SWING_METRICS, Band, Gauge, Meter, Onset, settling_time
from pidcfg.sim.judgement.report import Range, Verdict, ten_digits
from pidcfg.text.paths import leaves

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from pidcfg.schemas.scenario import Bound, Expectation, Scenario
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.engine.network import Network

UNITS = {"overshoot": " %", "settling_time": " s", "rise_time": " s", "oscillation_period": " s"}
"""Metrics that have a unit of their own."""
NO_STEP_TEXT = "no event changes the set point while the loop is in Auto or Cascade and moves its PV"
NO_CONTROL_TEXT = "the loop was not in Auto or Cascade"
NO_SWINGS_TEXT = "the PV does not oscillate"


@dataclass(slots=True)
class MeasuredRun:
    """What the verdicts are drawn from, once a run is over."""

    plc: Plc
    metrics: Sequence[Mapping[str, float | None]]
    """Of each loop."""
    meters: Sequence[Meter]
    signal_range: Callable[[str], Range]
    """How far a signal went."""
    dt: float
    last: int
    alarms_off: Collection[tuple[str, str]]
    """Loops and alarms that could not come from start to end."""
    modes: Mapping[int, str]
    """Modes that were looked at on the way, by the number of the expectation."""


Watch = Band | Gauge | Onset


def watches_of(scenario: Scenario, plc: Plc, net: Network, step: int) -> dict[int, Watch]:
    """What one expectation alone needs to be measured."""
    watches: dict[int, Watch] = {}
    for i, expectation in enumerate(scenario.expect):
        if expectation.band is not None:
            watches[i] = Band(plc.loops.index(expectation.loop or ""), float(expectation.band) / 100)
        elif expectation.signal is not None and (expectation.start is not None or expectation.until is not None):
            first = 0 if expectation.start is None else steps_until(expectation.start, step)
            last = NEVER if expectation.until is None else int(expectation.until * TICKS) // step
            watches[i] = Gauge(net.slots[expectation.signal], first=first, last=last)
        elif expectation.alarm is not None:
            watches[i] = Onset(plc.loops.index(expectation.loop or ""), plc.alarm_bits[expectation.alarm])
    return watches


def alarms_off(scenario: Scenario, plc: Plc) -> set[tuple[str, str]]:
    """Loops and alarms of the expectations that are off, and that no event switches."""
    switched_loops = {
        event.loop
        for event in scenario.events
        if any(str(keys[0]).startswith("alarms") for keys, _, _ in leaves(event.set or {}))
    }
    expected_alarms = {
        (expectation.loop, expectation.alarm)
        for expectation in scenario.expect
        if expectation.loop and expectation.alarm
    }
    return {
        (loop, alarm)
        for loop, alarm in expected_alarms
        if loop not in switched_loops and not plc.alarm_is_on(plc.loops.index(loop), alarm)
    }


def verdict(i: int, expectation: Expectation, watch: Watch | None, run: MeasuredRun) -> Verdict:
    """The verdict on expectation ``i``; ``watch`` is what was measured for it alone."""
    if expectation.metric is not None:
        return _metric_verdict(expectation, cast("Band | None", watch), run)
    if expectation.signal is not None:
        return _signal_verdict(expectation, cast("Gauge | None", watch), run)
    if expectation.alarm is not None:
        return _alarm_verdict(expectation, cast("Onset | None", watch), run)
    if expectation.flag is not None:
        return _flag_verdict(expectation, run)
    if expectation.autotune is not None:
        return _autotune_verdict(expectation, run)
    loop = run.plc.loops.index(expectation.loop or "")
    if isinstance(expectation.mode, ForbiddenMode):
        name = expectation.mode.mode
        came = bool(run.meters[loop].all_status & run.plc.modes[name])
        return Verdict(f"{expectation.loop} mode is never {name}", not came, name if came else None)
    mode = run.modes.get(i, run.plc.mode(run.meters[loop].status))
    when = "at the end" if expectation.at is None else f"at {expectation.at:f} s"
    return Verdict(f"{expectation.loop} mode is {expectation.mode} {when}", mode == expectation.mode, mode)


def _bounds_text(minimum: Bound | None, maximum: Bound | None, unit: str = "") -> str:
    low = "" if minimum is None else f"at least {minimum.value:f}{unit}"
    high = "" if maximum is None else f"at most {maximum.value:f}{unit}"
    return " and ".join(part for part in (low, high) if part)


def _is_inside(value: float | None, minimum: Bound | None, maximum: Bound | None) -> bool:
    """Whether a number keeps its bounds; none at all (never settled, nothing measured) does not."""
    return (
        value is not None
        and (minimum is None or value >= float(minimum.value))
        and (maximum is None or value <= float(maximum.value))
    )


def _metric_verdict(expectation: Expectation, watch: Band | None, run: MeasuredRun) -> Verdict:
    loop = run.plc.loops.index(expectation.loop or "")
    name = str(expectation.metric)
    value = run.metrics[loop][name]
    band = ""
    if watch is not None:
        time = settling_time(run.meters[loop], watch, run.last, run.dt)
        value, band = None if time is None else ten_digits(time), f" (band {expectation.band:f} %)"
    text = f"{expectation.loop} {name}{band} {_bounds_text(expectation.min, expectation.max, UNITS.get(name, ''))}"
    nothing = _missing_text(name, value, run.meters[loop], run.dt)
    text += f" ({nothing})" if nothing else ""
    return Verdict(text, _is_inside(value, expectation.min, expectation.max), value)


def _missing_text(name: str, value: float | None, meter: Meter, dt: float) -> str:
    """Why a metric has no value; empty: it has one, or is of a step that had not settled at the end."""
    if value is not None:
        return ""
    if name in STEP_METRICS and meter.event_at >= 0 and meter.has_step:
        return (
            "" if meter.step_until == NEVER else f"not settled at {meter.step_until * dt:g} s, when an event moved it"
        )
    reason = NO_STEP_TEXT if name in STEP_METRICS else NO_SWINGS_TEXT if name in SWING_METRICS else NO_CONTROL_TEXT
    return f"nothing was measured: {reason}"


def _signal_verdict(expectation: Expectation, watch: Gauge | None, run: MeasuredRun) -> Verdict:
    name = str(expectation.signal)
    signal_range = run.signal_range(name)
    if watch is not None and watch.low > watch.high:
        return Verdict(f"{name}: no base step lies in its time", passed=False, value=None)
    if watch is not None:
        signal_range = Range(ten_digits(watch.low), ten_digits(watch.high), signal_range.final)
    low = expectation.min is None or signal_range.low >= float(expectation.min.value)
    high = expectation.max is None or signal_range.high <= float(expectation.max.value)
    parts = [_bounds_text(expectation.min, expectation.max)]
    value: Any = (
        [signal_range.low, signal_range.high]
        if expectation.min and expectation.max
        else signal_range.low
        if expectation.min
        else signal_range.high
    )
    final = True
    if expectation.final is not None and expectation.tolerance is not None:
        final = abs(signal_range.final - float(expectation.final)) <= float(expectation.tolerance.value)
        parts.append(f"{expectation.final:f} ± {expectation.tolerance.value:f} at the end")
        value = signal_range.final if low and high else value
    since = "" if expectation.start is None else f" from {expectation.start:f} s"
    until = "" if expectation.until is None else f" until {expectation.until:f} s"
    return Verdict(f"{name} {', '.join(p for p in parts if p)}{since}{until}", low and high and final, value)


def _alarm_verdict(expectation: Expectation, watch: Onset | None, run: MeasuredRun) -> Verdict:
    verdict = _alarm_time_verdict(expectation, watch, run)
    if verdict.passed and verdict.value is None and (expectation.loop, expectation.alarm) in run.alarms_off:
        return replace(verdict, text=f"{verdict.text} (nothing was measured: the alarm is off)", passed=False)
    return verdict


def _alarm_time_verdict(expectation: Expectation, watch: Onset | None, run: MeasuredRun) -> Verdict:
    first = ten_digits(watch.first * run.dt) if watch is not None and watch.first >= 0 else None
    subject = f"{expectation.loop} alarm {expectation.alarm}"
    if expectation.never and expectation.before is not None:
        text = f"{subject} never before {expectation.before:f} s"
        return Verdict(text, first is None or first >= float(expectation.before), first)
    if expectation.never is not None:
        return Verdict(
            f"{subject} {'never' if expectation.never else 'at some time'}", (first is None) == expectation.never, first
        )
    parts, passed = [], first is not None
    time = 0.0 if first is None else first
    if expectation.at is not None:
        slack = 0.0 if expectation.tolerance is None else float(expectation.tolerance.value)
        parts.append(f"at {expectation.at:f} s" + (f" ± {slack:g} s" if slack else ""))
        passed = passed and abs(time - float(expectation.at)) <= slack + run.dt / 2
    if expectation.before is not None:
        parts.append(f"before {expectation.before:f} s")
        passed = passed and time <= float(expectation.before)
    if expectation.after is not None:
        parts.append(f"after {expectation.after:f} s")
        passed = passed and time >= float(expectation.after)
    return Verdict(f"{subject} {' and '.join(parts)}", passed, first)


def _flag_verdict(expectation: Expectation, run: MeasuredRun) -> Verdict:
    name = str(expectation.flag)
    expected = True if expectation.value is None else expectation.value
    if expectation.loop is None:
        word, form = run.plc.error_words[name], run.plc.error_format
        passed = word == expected if type(expected) is int else bool(word) == expected
        shown = form.format(expected) if type(expected) is int else "set" if expected else "clear"
        return Verdict(f"{name} is {shown}", passed, form.format(word))
    meter = run.meters[run.plc.loops.index(expectation.loop)]
    was_on = bool(meter.all_status & run.plc.flag_bits.get(name, 0) or meter.all_aux & run.plc.aux_bits.get(name, 0))
    return Verdict(f"{expectation.loop} flag {name} {'on' if expected else 'off'}", was_on == bool(expected), was_on)


def _autotune_verdict(expectation: Expectation, run: MeasuredRun) -> Verdict:
    name = str(expectation.autotune)
    result = run.plc.tuning_result(run.plc.loops.index(expectation.loop or ""))
    subject = f"{expectation.loop} autotune {name}"
    if name in {"done", "error"}:
        expected = True if expectation.value is None else bool(expectation.value)
        ended = None if result is None else result["done"] if name == "done" else result["error"]
        return Verdict(f"{subject} is {'true' if expected else 'false'}", ended is expected, ended)
    value = None if result is None else result["results"].get(name)
    if expectation.min is None and expectation.max is None:
        return Verdict(f"{subject} is found", value is not None, value)
    return Verdict(
        f"{subject} {_bounds_text(expectation.min, expectation.max)}",
        _is_inside(value, expectation.min, expectation.max),
        value,
    )


def place_verdict(result: Verdict, expectation: Expectation) -> Verdict:
    """A verdict with the loop that it is about, and the time of which something is expected."""
    loop = expectation.loop or (expectation.signal or "").partition(".")[0] or None
    return replace(result, loop=loop, at=None if expectation.at is None else float(expectation.at))
