"""Expectations: what is measured for them on the way, and their verdicts at the end."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, cast

from pidcfg.schemas.scenario import Never
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
NO_STEP = "no event changes the set point while the loop is in Auto or Cascade and moves its PV"
NO_CONTROL = "the loop was not in Auto or Cascade"
NO_SWINGS = "the PV does not oscillate"


@dataclass(slots=True)
class MeasuredRun:
    """What the verdicts are drawn from, once a run is over."""

    plc: Plc
    metrics: Sequence[Mapping[str, float | None]]
    """Of each loop."""
    meters: Sequence[Meter]
    range_of: Callable[[str], Range]
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
    for i, wanted in enumerate(scenario.expect):
        if wanted.band is not None:
            watches[i] = Band(plc.loops.index(wanted.loop or ""), float(wanted.band) / 100)
        elif wanted.signal is not None and (wanted.start is not None or wanted.until is not None):
            first = 0 if wanted.start is None else steps_until(wanted.start, step)
            last = NEVER if wanted.until is None else int(wanted.until * TICKS) // step
            watches[i] = Gauge(net.names[wanted.signal], first=first, last=last)
        elif wanted.alarm is not None:
            watches[i] = Onset(plc.loops.index(wanted.loop or ""), plc.alarm_bits[wanted.alarm])
    return watches


def alarms_off(scenario: Scenario, plc: Plc) -> set[tuple[str, str]]:
    """Loops and alarms of the expectations that are off, and that no event switches."""
    switched = {
        event.loop
        for event in scenario.events
        if any(str(keys[0]).startswith("alarms") for keys, _, _ in leaves(event.set or {}))
    }
    named = {(wanted.loop, wanted.alarm) for wanted in scenario.expect if wanted.loop and wanted.alarm}
    return {
        (loop, alarm)
        for loop, alarm in named
        if loop not in switched and not plc.alarm_is_on(plc.loops.index(loop), alarm)
    }


def verdict(i: int, wanted: Expectation, watch: Watch | None, out: MeasuredRun) -> Verdict:
    """The verdict on expectation ``i``; ``watch`` is what was measured for it alone."""
    if wanted.metric is not None:
        return _metric(wanted, cast("Band | None", watch), out)
    if wanted.signal is not None:
        return _signal(wanted, cast("Gauge | None", watch), out)
    if wanted.alarm is not None:
        return _alarm(wanted, cast("Onset | None", watch), out)
    if wanted.flag is not None:
        return _flag(wanted, out)
    if wanted.autotune is not None:
        return _autotune(wanted, out)
    loop = out.plc.loops.index(wanted.loop or "")
    if isinstance(wanted.mode, Never):
        name = wanted.mode.mode
        came = bool(out.meters[loop].ever & out.plc.modes[name])
        return Verdict(f"{wanted.loop} mode is never {name}", not came, name if came else None)
    mode = out.modes.get(i, out.plc.mode(out.meters[loop].status))
    when = "at the end" if wanted.at is None else f"at {wanted.at:f} s"
    return Verdict(f"{wanted.loop} mode is {wanted.mode} {when}", mode == wanted.mode, mode)


def _bounds(minimum: Bound | None, maximum: Bound | None, unit: str = "") -> str:
    low = "" if minimum is None else f"at least {minimum.value:f}{unit}"
    high = "" if maximum is None else f"at most {maximum.value:f}{unit}"
    return " and ".join(part for part in (low, high) if part)


def _inside(value: float | None, minimum: Bound | None, maximum: Bound | None) -> bool:
    """Whether a number keeps its bounds; none at all (never settled, nothing measured) does not."""
    return (
        value is not None
        and (minimum is None or value >= float(minimum.value))
        and (maximum is None or value <= float(maximum.value))
    )


def _metric(wanted: Expectation, watch: Band | None, out: MeasuredRun) -> Verdict:
    loop = out.plc.loops.index(wanted.loop or "")
    name = str(wanted.metric)
    value = out.metrics[loop][name]
    band = ""
    if watch is not None:
        time = settling_time(out.meters[loop], watch, out.last, out.dt)
        value, band = None if time is None else ten_digits(time), f" (band {wanted.band:f} %)"
    text = f"{wanted.loop} {name}{band} {_bounds(wanted.min, wanted.max, UNITS.get(name, ''))}"
    nothing = _nothing_measured(name, value, out.meters[loop], out.dt)
    text += f" ({nothing})" if nothing else ""
    return Verdict(text, _inside(value, wanted.min, wanted.max), value)


def _nothing_measured(name: str, value: float | None, meter: Meter, dt: float) -> str:
    """Why a metric has no value; empty: it has one, or is of a step that had not settled at the end."""
    if value is not None:
        return ""
    if name in STEP_METRICS and meter.event >= 0 and meter.stepped:
        return "" if meter.until == NEVER else f"not settled at {meter.until * dt:g} s, when an event moved it"
    reason = NO_STEP if name in STEP_METRICS else NO_SWINGS if name in SWING_METRICS else NO_CONTROL
    return f"nothing was measured: {reason}"


def _signal(wanted: Expectation, watch: Gauge | None, out: MeasuredRun) -> Verdict:
    name = str(wanted.signal)
    seen = out.range_of(name)
    if watch is not None and watch.low > watch.high:
        return Verdict(f"{name}: no base step lies in its time", passed=False, value=None)
    if watch is not None:
        seen = Range(ten_digits(watch.low), ten_digits(watch.high), seen.final)
    low = wanted.min is None or seen.low >= float(wanted.min.value)
    high = wanted.max is None or seen.high <= float(wanted.max.value)
    parts = [_bounds(wanted.min, wanted.max)]
    value: Any = [seen.low, seen.high] if wanted.min and wanted.max else seen.low if wanted.min else seen.high
    final = True
    if wanted.final is not None and wanted.tolerance is not None:
        final = abs(seen.final - float(wanted.final)) <= float(wanted.tolerance.value)
        parts.append(f"{wanted.final:f} ± {wanted.tolerance.value:f} at the end")
        value = seen.final if low and high else value
    since = "" if wanted.start is None else f" from {wanted.start:f} s"
    until = "" if wanted.until is None else f" until {wanted.until:f} s"
    return Verdict(f"{name} {', '.join(p for p in parts if p)}{since}{until}", low and high and final, value)


def _alarm(wanted: Expectation, watch: Onset | None, out: MeasuredRun) -> Verdict:
    verdict = _time_of_alarm(wanted, watch, out)
    if verdict.passed and verdict.value is None and (wanted.loop, wanted.alarm) in out.alarms_off:
        return replace(verdict, text=f"{verdict.text} (nothing was measured: the alarm is off)", passed=False)
    return verdict


def _time_of_alarm(wanted: Expectation, watch: Onset | None, out: MeasuredRun) -> Verdict:
    first = ten_digits(watch.first * out.dt) if watch is not None and watch.first >= 0 else None
    subject = f"{wanted.loop} alarm {wanted.alarm}"
    if wanted.never and wanted.before is not None:
        text = f"{subject} never before {wanted.before:f} s"
        return Verdict(text, first is None or first >= float(wanted.before), first)
    if wanted.never is not None:
        return Verdict(
            f"{subject} {'never' if wanted.never else 'at some time'}", (first is None) == wanted.never, first
        )
    parts, passed = [], first is not None
    time = 0.0 if first is None else first
    if wanted.at is not None:
        slack = 0.0 if wanted.tolerance is None else float(wanted.tolerance.value)
        parts.append(f"at {wanted.at:f} s" + (f" ± {slack:g} s" if slack else ""))
        passed = passed and abs(time - float(wanted.at)) <= slack + out.dt / 2
    if wanted.before is not None:
        parts.append(f"before {wanted.before:f} s")
        passed = passed and time <= float(wanted.before)
    if wanted.after is not None:
        parts.append(f"after {wanted.after:f} s")
        passed = passed and time >= float(wanted.after)
    return Verdict(f"{subject} {' and '.join(parts)}", passed, first)


def _flag(wanted: Expectation, out: MeasuredRun) -> Verdict:
    name = str(wanted.flag)
    expected = True if wanted.value is None else wanted.value
    if wanted.loop is None:
        word, form = out.plc.flags[name], out.plc.word_of_flags
        passed = word == expected if type(expected) is int else bool(word) == expected
        shown = form.format(expected) if type(expected) is int else "set" if expected else "clear"
        return Verdict(f"{name} is {shown}", passed, form.format(word))
    meter = out.meters[out.plc.loops.index(wanted.loop)]
    seen = bool(meter.ever & out.plc.flag_bits.get(name, 0) or meter.ever_aux & out.plc.aux_bits.get(name, 0))
    return Verdict(f"{wanted.loop} flag {name} {'on' if expected else 'off'}", seen == bool(expected), seen)


def _autotune(wanted: Expectation, out: MeasuredRun) -> Verdict:
    name = str(wanted.autotune)
    tuned = out.plc.tuned(out.plc.loops.index(wanted.loop or ""))
    subject = f"{wanted.loop} autotune {name}"
    if name in {"done", "error"}:
        expected = True if wanted.value is None else bool(wanted.value)
        ended = None if tuned is None else tuned["done"] if name == "done" else tuned["error"]
        return Verdict(f"{subject} is {'true' if expected else 'false'}", ended is expected, ended)
    value = None if tuned is None else tuned["results"].get(name)
    if wanted.min is None and wanted.max is None:
        return Verdict(f"{subject} is found", value is not None, value)
    return Verdict(f"{subject} {_bounds(wanted.min, wanted.max)}", _inside(value, wanted.min, wanted.max), value)


def place_verdict(result: Verdict, wanted: Expectation) -> Verdict:
    """A verdict with the loop that it is about, and the time of which something is expected."""
    loop = wanted.loop or (wanted.signal or "").partition(".")[0] or None
    return replace(result, loop=loop, at=None if wanted.at is None else float(wanted.at))
