"""The stages of the battery: the plant that a loop is tested on, and what is done to it."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, expm1
from typing import TYPE_CHECKING, Literal

from pidcfg.sim.controllers.kernels import clamp
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import Loop

# --- The plant that a loop is tested on, scaled so that the loop is well damped on it and its PV stays in range -------

D304 = Decision(
    304,
    "both sides are tested on a plant that the loop's own gains fit",
    "First order with a dead time of one sample, and a gain and a time constant with which the loop crosses over at "
    "the lowest of 4/Ti, 0.4/Td and 0.25/(sample + dead time + filters); its gain is at most "
    "3 spans of the PV for the whole output. At rest the output is in the middle of its limits.",
    "A loop that is tuned at all is stable on it, and it shows gain, times, action and scales of both sides; with a "
    "larger gain one count of the output would move the PV by many.",
)
MAX_GAIN, WANTED_GAIN = 3.0, 2.0
"""Gain of the plant, as a share of the PV's span for the whole output: at most, and where the loop's gain allows it."""
INTEGRAL_CROSSOVER, DERIVATIVE_CROSSOVER, DELAY_CROSSOVER = 4.0, 0.4, 0.25
"""Crossover times integral time, derivative time and the sum of what delays the loop."""
SMALL_STEP, LARGE_STEP = 0.05, 0.5
"""Steps, as shares of the set point's limits."""
RANGE_MARGIN = 0.02
"""Share of the PV's range at its ends that the tests leave alone, where alarms that are not wanted are parked."""
SETTLED_LAGS = 12
"""Time constants after which a filter has forgotten."""
CASCADE_SAMPLES = 8
"""Samples of the slowest loop of a cascade after which the inner ones are in Cascade."""
MAX_SAMPLES = 800
"""Samples of a stage."""


@frozen
class Bench:
    """A plant, and how far and how long it is moved; PV units and s."""

    low: float
    high: float
    """Of the PV's range."""
    sample: float
    """Sample time of the slower side."""
    gain: float
    """PV units for the whole output, with the sign of the action."""
    time_constant: float
    dead_time: float
    rest_out: float
    """The output at rest, as a share of its range."""
    rest_pv: float
    """PV and set point at rest."""
    alarm_free_range: tuple[float, float]
    """PVs within the limits of the set point and without an alarm."""
    sp_width: float
    """Width of the limits of the set point."""
    watch_time: float
    """How long a change is watched."""
    settling_time: float
    """How long the loop is left alone in Auto before something happens."""
    manual_time: float
    """How long a stage begins in Manual: until filters have forgotten what was before."""
    slowest_sample: float
    """The longest sample time in its cascade."""
    limits: tuple[float, float]
    """Of the output, as shares of its range."""
    band_crossing: float = 0.0
    """Within the dead band of both sides: by how much the set point passes the PV before it comes to it."""
    min_move: float = 0.0
    """The smallest move of the PV that shows an answer."""

    @property
    def span(self) -> float:
        """Width of the PV's range."""
        return self.high - self.low

    @property
    def sign(self) -> float:
        """1 where the PV rises with the output, else -1."""
        return 1.0 if self.gain > 0 else -1.0

    def load_for(self, pv: float, output: float) -> float:
        """The load with which the plant rests at a PV with an output (a share)."""
        return pv - self.gain * output


def bench_of(loop: Loop, other: Loop, slowest: float = 0.0) -> Bench:
    """The test bench of a loop; ``other`` is the same loop on the other side, which may sample more slowly.

    ``slowest``: the longest sample time in its cascade.
    """
    low, high = (float(end) for end in loop.pv.range)
    sample = float(max(loop.sample_time, other.sample_time))
    crossover, gain, time = _slower_dynamics(loop, other, sample)
    limits = output_limits(loop)
    bounds = loop.setpoint.limits or loop.pv.range
    sp_width = float(bounds[1] - bounds[0])
    quiet = quiet_range(loop)
    samples = min(ceil(10 / crossover / sample), MAX_SAMPLES)
    return Bench(
        low,
        high,
        sample,
        (high - low) * gain * (1.0 if loop.output_raises_pv else -1.0),
        time,
        sample,
        middle_output(loop, limits),
        (quiet[0] + quiet[1]) / 2,
        quiet,
        sp_width,
        samples * sample,
        min(ceil(5 / crossover / sample), MAX_SAMPLES // 2) * sample,
        max(ceil(SETTLED_LAGS * _lag_of(loop, other) / sample), 6, ceil(CASCADE_SAMPLES * slowest / sample)) * sample,
        max(slowest, sample),
        limits,
        min(float(loop.deadband), float(other.deadband)) / 2,
    )


def _lag_of(loop: Loop, other: Loop) -> float:
    """The longest time constant of a filter of either side."""
    return max(float(max(side.pv.filter, side.tuning.derivative_filter)) for side in (loop, other))


def _slower_dynamics(loop: Loop, other: Loop, sample: float) -> tuple[float, float, float]:
    """What `dynamics` says, with the slower filter of both sides."""
    filters = max(float(side.pv.filter) for side in (loop, other))
    return dynamics(loop, sample, 2 * sample + filters, WANTED_GAIN)


def dynamics(loop: Loop, sample: float, delay: float, wanted_gain: float) -> tuple[float, float, float]:
    """Crossover in rad/s, gain of the plant as a share of the span for the whole output, and its time constant.

    ``delay``: what the loop is late by, in s; ``wanted_gain``: the gain of the plant where the loop's gain allows it.
    """
    tuning = loop.tuning
    span, width = (float(pair[1] - pair[0]) for pair in (loop.pv.range, loop.output.range))
    ratio = abs(float(tuning.gain)) * span / width or 1.0
    integral, derivative = float(tuning.integral_time), float(tuning.derivative_time)
    crossover = DELAY_CROSSOVER / delay
    if derivative:
        crossover = min(crossover, DERIVATIVE_CROSSOVER / derivative)
    if not tuning.proportional and integral:
        crossover = min(crossover, 1 / integral)
        return crossover, min(crossover * integral / ratio, MAX_GAIN), sample
    if integral:
        crossover = min(crossover, INTEGRAL_CROSSOVER / integral)
    time = max(integral, 10 * sample, wanted_gain * ratio / crossover)
    gain = min(crossover * time / ratio, MAX_GAIN)
    return gain * ratio / time, gain, time


def output_limits(loop: Loop) -> tuple[float, float]:
    """Of the output, as shares of its range."""
    low, high = (float(end) for end in loop.output.range)
    ends = loop.output.limits or loop.output.range
    first, second = ((float(end) - low) / (high - low) for end in ends)
    return max(first, 0.0), min(second, 1.0)


def middle_output(loop: Loop, limits: tuple[float, float]) -> float:
    """The output at rest: without an integral it is the bias, which is all that some PLCs can hold it with."""
    if loop.tuning.integral_time:
        return (limits[0] + limits[1]) / 2
    low, high = (float(end) for end in loop.output.range)
    return min(max((float(loop.output.bias) - low) / (high - low), limits[0]), limits[1])


def quiet_range(loop: Loop) -> tuple[float, float]:
    """The PVs within the limits of the set point and between the inner alarms, where there is room between them."""
    low, high = (float(end) for end in loop.pv.range)
    margin = RANGE_MARGIN * (high - low)
    bottom, top = low + margin, high - margin
    if loop.setpoint.limits is not None:
        bottom, top = (max(bottom, float(loop.setpoint.limits[0])), min(top, float(loop.setpoint.limits[1])))
    points = loop.alarms.pv
    inner = [float(p) for p in (points.low_low, points.low) if p is not None]
    outer = [float(p) for p in (points.high, points.high_high) if p is not None]
    between = max([bottom, *inner]), min([top, *outer])
    return between if between[0] < between[1] else (bottom, top)


# --- What a stage is made of: acts at times, and how both sides are compared ------------------------------------------

Signal = Literal["pv", "output", "setpoint", "mode", "alarms"]
ALL_SIGNALS: frozenset[Signal] = frozenset(("pv", "output", "setpoint", "mode", "alarms"))
CLOSED_LOOP: frozenset[Signal] = ALL_SIGNALS - {"alarms"}
"""Where the PV follows the output; alarms are compared where it goes its own way."""


@frozen
class Act:
    """Something that happens ``at`` s; numbers of a plant, a key of the loop, a mode, or a broken sensor."""

    at: float
    mode: str | None = None
    setpoint: float | None = None
    output: float | None = None
    """A share of the range."""
    load: float | None = None
    master_output: float | None = None
    """The output of the loop that gives the set point, as a share of its range."""
    pv_offset: float | None = None
    """By how much the PV lies beside the plant's value from then on."""
    sensor_lost: bool | None = None
    """The sensor shows the lower end of its range, or the PV again."""


@frozen
class Stage:
    """One stage; times in s."""

    name: str
    title: str
    acts: tuple[Act, ...]
    end: float
    begin: float = 0.0
    """From when on both sides are compared."""
    signals: frozenset[Signal] = CLOSED_LOOP
    pv: float = 0.0
    """Of the plant at the beginning."""
    load: float = 0.0
    loses_sensor: bool = False
    is_swept: bool = False
    """The plant is an integrator that only its load moves."""
    output: float | None = None
    """With which a stage begins; None: as configured."""
    slack: int = 0
    """Samples by which signals may come apart in addition: a loop above samples more slowly."""
    with_master: bool = False
    """The loop that gives the set point runs, too."""


def begin_at_rest(b: Bench) -> tuple[Act, ...]:
    """In Manual, with the plant at rest at the set point.

    The output is held until the inner loops are in Cascade: some masters take over what these have for a set point.
    """
    held_samples = min(round(CASCADE_SAMPLES * b.slowest_sample / b.sample), round(b.manual_time / b.sample) - 1)
    return (
        Act(0.0, mode="auto"),  # a block may keep its set point from a master in Manual, too
        Act(0.0, mode="manual"),
        Act(0.0, output=b.rest_out),
        Act(b.sample, setpoint=b.rest_pv),
        *(Act(k * b.sample, setpoint=b.rest_pv + by) for k, by in _cross_pv(b)),
        *(Act(k * b.sample, output=b.rest_out) for k in range(1, held_samples)),
        Act(b.manual_time - b.sample, output=b.rest_out),
    )


def _cross_pv(b: Bench) -> Iterator[tuple[int, float]]:
    """The set point to both sides of the PV: where a dead band begins there, no last digit decides about it."""
    if b.band_crossing:
        yield from ((2, b.band_crossing), (3, -b.band_crossing), (4, 0.0))


def go_to_auto(b: Bench) -> tuple[Act, ...]:
    """The same, and then Auto with the same set point."""
    return (*begin_at_rest(b), Act(b.manual_time, mode="auto"), Act(b.manual_time + b.sample, setpoint=b.rest_pv))


def settled_stage(
    b: Bench, name: str, title: str, acts: tuple[Act, ...], time: float, signals: frozenset[Signal] = CLOSED_LOOP
) -> Stage:
    """A stage in Auto whose acts are counted from the time at which the loop has settled."""
    begin = b.manual_time + 2 * b.sample + b.settling_time
    tail = tuple(delayed_act(act, begin) for act in acts)
    load = b.load_for(b.rest_pv, b.rest_out)
    return Stage(name, title, (*go_to_auto(b), *tail), begin + time, begin, signals, b.rest_pv, load, output=b.rest_out)


def delayed_act(act: Act, delay: float) -> Act:
    """The same act by so much later."""
    return replace(act, at=act.at + delay)


# --- The stages in which the PV goes its own way, whatever the output does: the loop's answer, and its alarms ---------

FASTEST_SWEEP, SLOWEST_SWEEP = 0.0025, 0.001
"""Sweep of the PV through its alarms: share of the range a sample."""
SHARE_OF_BAND = 0.1
"""Of the narrowest alarm, what the sweep covers in a sample."""
END_MARGIN = 0.0025
"""Alarms nearer to the ends of the range are not reached."""
SHARE_OF_HYSTERESIS = 0.06
"""What the sweep around an alarm covers in a sample: a quarter of the hysteresis is more than two samples."""
MIN_HYSTERESIS_COUNTS, COUNTS_A_SAMPLE = 20, 1.5
"""Counts of a hysteresis from which on a quarter of it can be told, and what its sweep covers at least."""
OUTPUT_SHARE = 0.8
"""Of the way to a limit of the output, what the answer to a step of the PV may take."""
MIN_WAY_SHARE = 0.1
"""Way to the nearer limit, as a share of the output's range, below which the other one is taken."""
MAX_PV_STEP = 0.2
"""Step of the PV, as a share of its range."""
STEP_BANDS, MIN_STEP_BANDS = 6.0, 2.0
"""Widths of a dead band that the PV is moved by, where the output has room for it, and at least."""
MIN_STEP_SAMPLES, MAX_STEP_SAMPLES = 20, 600
"""Samples of which each step lasts."""
SLOW_CHANGE_TIMES = 4.0
"""Derivative times that a slow change of the PV takes."""
HALF_SAMPLE = 0.5
"""Samples by which a slow change goes beyond the set point, so that a dead band's crossing falls between two."""
STEP_SHARE, STEP_SAMPLES = 0.47, 20
"""Of the way to a limit of the output, what a step takes that is to be answered at once, and how long it lasts."""
FAR_PV_SHARE, WINDUP_SHARE = 0.9, 1.2
"""Of the way to an end of the PV's range, and of the output's range, what an integral is wound up by there."""
LIMIT_ZONE = 0.015
"""Of the way between both limits, from where an output that moves slowly comes to a limit."""
RETURN_SHARE, RETURN_SAMPLES = 0.1, 60
"""Of the output's range, what the error makes that brings it back from a limit, and for how many samples."""
MIN_BAND_MOVES = 5
"""Smallest moves of the PV in a dead band from which on its width can be told."""
BAND_SHARES = (0.9, 0.0, -0.9, -1.12, 1.12, 0.9, 0.0)
"""Where the PV is brought, in widths of a dead band."""
DRIFT_SHARE = 0.02
"""Of the output's range, what an integral would make of an error that the dead band does not let through."""
TRANSFER_BANDS = 1.5
"""Widths of a dead band beside the set point where a loop goes back to Auto."""
FORGOTTEN_LAGS = 6
"""Time constants after which a filter has forgotten, for what is to be seen."""


def open_loop_stages(b: Bench, loop: Loop, other: Loop, count: float) -> Iterator[Stage]:
    """The stages of one loop; ``other`` is the same loop on the other side, ``count`` what the PV is counted in."""
    yield _pv_step_stage(b, loop, other)
    if loop.tuning.derivative_time:
        yield _pv_ramp_stage(b, loop, other)
    yield _setpoint_step_stage(b, loop)
    yield from _limit_stages(b, loop)
    yield _transfer_stage(b, loop, other)
    yield from _deadband_stages(b, loop, other)
    yield from _alarm_stages(b, loop, other)
    yield from _hysteresis_stages(b, loop, count)


def _pv_step_stage(b: Bench, loop: Loop, other: Loop) -> Stage:
    """Steps of the PV that keep the output within its limits: gain, integral, derivative and filters, one by one."""
    tuning, gain = loop.tuning, _gain_share(b, loop)
    constants = [float(x) for x in (tuning.derivative_filter, loop.pv.filter, other.pv.filter)]
    integral = float(tuning.integral_time)
    hold_time = max(FORGOTTEN_LAGS * max(constants), integral / 2)
    samples = min(max(round(hold_time / b.sample), MIN_STEP_SAMPLES), MAX_STEP_SAMPLES)
    filter_share = -expm1(-b.sample / constants[1]) if constants[1] else 1.0
    kick = filter_share * float(tuning.derivative_time) / (constants[0] + b.sample)
    windup = samples * b.sample / integral if integral else 0.0
    low, high = b.rest_out - b.limits[0], b.limits[1] - b.rest_out
    limit_distance = _nearer_limit(b)
    band = float(max(loop.deadband, other.deadband)) / b.span
    size = min(OUTPUT_SHARE * limit_distance / (gain * (1 + max(kick, windup))), max(MAX_PV_STEP, STEP_BANDS * band))
    is_down = low > high + MIN_WAY_SHARE or low < MIN_WAY_SHARE
    if gain * MIN_STEP_BANDS * band > limit_distance:  # from the other limit there is more room
        b = replace(b, rest_out=b.limits[1 if is_down else 0] + (-LIMIT_ZONE if is_down else LIMIT_ZONE))
        size = max(size, TRANSFER_BANDS * band)
        is_down = not is_down
    else:
        size = max(size, MIN_STEP_BANDS * band)
    move = b.sign * _visible_move(b, size * b.span) * (-1.0 if is_down else 1.0)
    hold = samples * b.sample
    acts = (Act(0.0, pv_offset=move), Act(hold, pv_offset=0.0))
    return _make_sweep(b, "answer", "a step of the PV and back", acts, 2 * hold, ALL_SIGNALS)


def _pv_ramp_stage(b: Bench, loop: Loop, other: Loop) -> Stage:
    """The PV slowly to another value and back: gain and integral, where the derivative's kick leaves them no room."""
    tuning, gain = loop.tuning, _gain_share(b, loop)
    integral, filters = float(tuning.integral_time), max(float(side.pv.filter) for side in (loop, other))
    ramp = ceil(max(FORGOTTEN_LAGS * filters, SLOW_CHANGE_TIMES * float(tuning.derivative_time)) / b.sample)
    hold = min(max(round(integral / 2 / b.sample), MIN_STEP_SAMPLES), MAX_STEP_SAMPLES)
    windup = (ramp / 2 + hold) * b.sample / integral if integral else 0.0
    low, high = b.rest_out - b.limits[0], b.limits[1] - b.rest_out
    size = min(OUTPUT_SHARE * max(low, high) / (gain * (1 + 1 / SLOW_CHANGE_TIMES + windup)), MAX_PV_STEP) * b.span
    size = _visible_move(b, size)
    rate = b.sign * size * (1.0 if high >= low else -1.0) / (ramp * b.sample)
    overrun = HALF_SAMPLE if loop.deadband or other.deadband else 0.0  # at the set point itself the last digit decides
    times = [k * b.sample for k in (0, ramp, ramp + hold, 2 * ramp + hold)]
    loads = (-rate, 0.0, rate * (1 + overrun / ramp), 0.0)
    acts = tuple(Act(at, load=load) for at, load in zip(times, loads, strict=True))
    return _make_sweep(
        b, "slow answer", "the PV slowly to another value and back", acts, times[-1] + 10 * b.sample, CLOSED_LOOP
    )


def _gain_share(b: Bench, loop: Loop) -> float:
    """The share of the output's range that an error of the whole PV range makes, without integral and derivative."""
    return abs(float(loop.tuning.gain)) * b.span / float(loop.output.range[1] - loop.output.range[0]) or 1.0


def _move_within_range(b: Bench, by: float) -> float:
    """A move of the PV that does not take it beyond its range."""
    margin = RANGE_MARGIN * b.span
    return min(max(by, b.low + margin - b.rest_pv), b.high - margin - b.rest_pv)


def _visible_move(b: Bench, size: float) -> float:
    """A move of the PV that no rounding hides, where a loop with a large gain would answer a smaller one."""
    return max(size, b.min_move)


def _nearer_limit(b: Bench) -> float:
    """The way to the nearer limit of the output, as a share of its range; the other one where there is hardly any."""
    low, high = b.rest_out - b.limits[0], b.limits[1] - b.rest_out
    return min(low, high) if min(low, high) >= MIN_WAY_SHARE else max(low, high)


def _setpoint_step_stage(b: Bench, loop: Loop) -> Stage:
    """Steps of the set point while the PV stands still: which of both the derivative acts on."""
    size = _visible_move(b, min(STEP_SHARE * _nearer_limit(b) / _gain_share(b, loop), MAX_PV_STEP) * b.span)
    up = b.rest_pv + size <= min(b.high, b.rest_pv + b.sp_width / 2)
    move = size if up else -size
    hold = STEP_SAMPLES * b.sample
    low, high = (float(end) for end in loop.setpoint.limits or loop.pv.range)
    acts = (
        Act(0.0, setpoint=b.rest_pv + move),
        Act(hold, setpoint=b.rest_pv),
        Act(2 * hold, setpoint=b.high, pv_offset=_move_within_range(b, high - size - b.rest_pv)),
        Act(3 * hold, setpoint=b.low, pv_offset=_move_within_range(b, low + size - b.rest_pv)),
    )
    title = "steps of the set point while the PV stands, and both at their ends"
    return _make_sweep(b, "set point", title, acts, 4 * hold, CLOSED_LOOP)


def _limit_stages(b: Bench, loop: Loop) -> Iterator[Stage]:
    """The PV far away until the integral is beyond the range of the output, and a little to the other side."""
    gain, integral = _gain_share(b, loop), float(loop.tuning.integral_time)
    for name, sign in (("high", 1.0), ("low", -1.0)):
        move = -b.sign * sign * FAR_PV_SHARE * (b.rest_pv - b.low if b.sign * sign > 0 else b.high - b.rest_pv)
        each = gain * abs(move) / b.span * b.sample / integral if integral else 1.0
        end = min(max(ceil(WINDUP_SHARE / each), MIN_STEP_SAMPLES), MAX_STEP_SAMPLES) * b.sample
        back = b.sign * sign * _visible_move(b, min(RETURN_SHARE / gain, SMALL_STEP) * b.span)
        acts = (Act(0.0, pv_offset=move), Act(end, pv_offset=back), Act(end + RETURN_SAMPLES * b.sample, pv_offset=0.0))
        title = f"into the {name} limit of the output and back"
        low, high = b.limits
        near = replace(b, rest_out=high - LIMIT_ZONE * (high - low) if sign > 0 else low + LIMIT_ZONE * (high - low))
        yield _make_sweep(near, f"{name} limit", title, acts, end + 2 * RETURN_SAMPLES * b.sample, CLOSED_LOOP)


def _deadband_stages(b: Bench, loop: Loop, other: Loop) -> Iterator[Stage]:
    """The PV just inside of the dead band and just outside; one of few counts is too coarse for it."""
    gain, integral = _gain_share(b, loop), float(loop.tuning.integral_time)
    bands = dict.fromkeys(float(x) for x in (loop.deadband, other.deadband) if x > MIN_BAND_MOVES * b.min_move)
    for i, band in enumerate(bands):
        each = gain * band / b.span * b.sample / integral if integral else 1.0
        hold = min(max(ceil(DRIFT_SHARE / each), MIN_STEP_SAMPLES), MAX_STEP_SAMPLES // 4) * b.sample
        acts = tuple(Act(k * hold, pv_offset=by * band) for k, by in enumerate(BAND_SHARES))
        name = f"dead band {i + 1}" if i else "dead band"
        yield _make_sweep(b, name, "the PV within the dead band and beyond", acts, hold * len(BAND_SHARES), CLOSED_LOOP)


def _transfer_stage(b: Bench, loop: Loop, other: Loop) -> Stage:
    """Auto to Manual while the output is elsewhere, an output by hand, and back to Auto beside the set point."""
    gain, band = _gain_share(b, loop), float(max(loop.deadband, other.deadband))
    room = max(b.limits[1] - b.rest_out, b.rest_out - b.limits[0])
    up = 1.0 if b.limits[1] - b.rest_out >= room else -1.0
    size = _visible_move(b, min(max(STEP_SHARE * room / gain * b.span, TRANSFER_BANDS * band), MAX_PV_STEP * b.span))
    move = _move_within_range(b, -b.sign * up * size)
    second_move = -b.sign * up * _visible_move(b, STEP_SHARE / 2 * room / gain * b.span)
    hold = STEP_SAMPLES * b.sample
    acts = (
        Act(0.0, pv_offset=move),
        Act(hold, mode="manual"),
        Act(hold + MANUAL_SAMPLES * b.sample, output=clamp(b.rest_out - up * MANUAL_SHARE * room, *b.limits)),
        Act(2 * hold, mode="auto"),
        Act(2 * hold + b.sample, setpoint=b.rest_pv),
        Act(3 * hold, pv_offset=_move_within_range(b, move + second_move)),
        Act(4 * hold, pv_offset=0.0),
    )
    return _make_sweep(b, "transfers", "Auto to Manual and back to Auto", acts, 5 * hold, CLOSED_LOOP)


def _alarm_stages(b: Bench, loop: Loop, other: Loop) -> Iterator[Stage]:
    """The PV from the middle to the top, to the bottom and back, whatever the output does."""
    sides = (loop.alarms, other.alarms)
    widths = [w for a in sides for w in (a.deviation.high, a.deviation.high_high) if w]
    bands = [float(width) / b.span for width in widths]
    speed = min(max(SHARE_OF_BAND * min(bands, default=1.0), SLOWEST_SWEEP), FASTEST_SWEEP)
    up, down = ((end / b.span) / speed for end in (b.high - b.rest_pv, b.rest_pv - b.low))
    edge = END_MARGIN / speed
    rates = [float(a.rate_of_change) for a in sides if a.rate_of_change]
    rate = speed * b.span / b.sample
    rise, fall = (round(x - edge) * b.sample for x in (up, down))
    acts = (
        Act(0.0, load=rate),
        Act(rise, load=-rate),
        Act(2 * rise + fall, load=rate),
        Act(2 * (rise + fall), load=0.0),
    )
    signals: frozenset[Signal] = ALL_SIGNALS - {"output"}
    end = 2 * (rise + fall) + 5 * b.sample
    yield _make_sweep(b, "alarms", "the PV through its whole range and back", acts, end, signals)
    for i, limit in enumerate(dict.fromkeys(rates)):
        yield _rate_stage(b, f"rate of change {i + 1}" if i else "rate of change", limit, signals)


def _hysteresis_stages(b: Bench, loop: Loop, count: float) -> Iterator[Stage]:
    """The PV slowly through one alarm and back, where counts can tell how far."""
    width = float(loop.alarms.hysteresis)
    if width < MIN_HYSTERESIS_COUNTS * count:
        return
    points = [float(p) for p in (loop.alarms.pv.high, loop.alarms.pv.low) if p is not None]
    points += [b.rest_pv + float(d) for d in (loop.alarms.deviation.high,) if d is not None]
    reach = 2 * width
    point = next((p for p in points if b.low + reach < p < b.high - reach), None)
    if point is None:
        return
    rate = max(SHARE_OF_HYSTERESIS * width, COUNTS_A_SAMPLE * count) / b.sample
    way, slow = point - reach - b.rest_pv, round(2 * reach / (rate * b.sample)) * b.sample
    turn, back = 2 * b.sample + slow, 2 * b.sample + 2 * slow
    acts = (Act(0.0, pv_offset=way), Act(2 * b.sample, load=rate), Act(turn, load=-rate), Act(back, load=0.0))
    signals: frozenset[Signal] = ALL_SIGNALS - {"output"}
    yield _make_sweep(b, "hysteresis", "the PV through an alarm and back", acts, back + 5 * b.sample, signals)


def _rate_stage(b: Bench, name: str, limit: float, signals: frozenset[Signal]) -> Stage:
    """The PV a tenth more slowly than its alarm allows, then a tenth faster, up and down."""
    hold = min(8 * b.sample, 0.3 * b.span / limit)
    times = [i * hold for i in range(5)]
    loads = (0.9 * limit, -0.9 * limit, 1.1 * limit, -1.1 * limit, 0.0)
    acts = tuple(Act(at, load=load) for at, load in zip(times, loads, strict=True))
    return _make_sweep(
        b, name, "the PV as fast as its alarm allows, and faster", acts, 5 * hold + 5 * b.sample, signals
    )


def _make_sweep(
    b: Bench, name: str, title: str, acts: tuple[Act, ...], length: float, signals: frozenset[Signal]
) -> Stage:
    begin = b.manual_time + 5 * b.sample
    later = tuple(delayed_act(act, begin) for act in acts)
    return Stage(
        name,
        title,
        (*go_to_auto(b), *later),
        begin + length,
        begin,
        signals,
        b.rest_pv,
        0.0,
        is_swept=True,
        output=b.rest_out,
    )


# --- The stages of the battery: what is done to a loop, in the terms of its bench -------------------------------------
#
# A stage begins in Manual with the plant at rest, goes to Auto without a disturbance, and then does what it is named
# for; `start` alone begins as the configuration says.

DISTURBANCE_SHARE = 0.3
"""Of the way between the limits of the output: what a disturbance takes."""
MANUAL_SHARE = 0.2
"""Of the way from the output that holds the PV to the middle, where it is put by hand."""
MANUAL_ENDS = ((20, 0.0), (25, 1.0))
"""Samples after which the output is set to both ends of its range; an inner loop may hold that of an outer one."""
MANUAL_SAMPLES = 4
"""Samples in Manual after which the output is set by hand: before, it shows what becomes of it by itself."""


def stages_of(bench: Bench, loop: Loop, other: Loop, count: float, *, in_cascade: bool) -> Iterator[Stage]:
    """The battery of one loop; ``other`` is the same loop on the other side.

    ``count``: what the PV is counted in; ``in_cascade``: others run with it.
    """
    yield _start_stage(bench, loop, in_cascade=in_cascade)
    if loop.setpoint.source is not None:
        yield _cascade_stage(bench)
    yield _manual_stage(bench, in_cascade=in_cascade)
    yield _automatic_stage(bench)
    yield _small_step_stage(bench)
    yield _large_step_stage(bench)
    yield _disturbance_stage(bench)
    yield _setpoint_limit_stage(bench)
    yield from open_loop_stages(bench, loop, other, count)
    yield _sensor_stage(bench)


def _start_stage(b: Bench, loop: Loop, *, in_cascade: bool) -> Stage:
    """As configured: the plant rests a little beside the set point, where the first output of the loop holds it."""
    setpoint = b.rest_pv if loop.setpoint.value is None else float(loop.setpoint.value)
    pv = min(max(setpoint - b.sign * SMALL_STEP * b.span, b.alarm_free_range[0]), b.alarm_free_range[1])
    low, high = (float(end) for end in loop.output.range)
    first = 0.0 if loop.output.manual is None else (float(loop.output.manual) - low) / (high - low)
    first = min(max(first, b.limits[0]), b.limits[1])
    title, load = "from Program to Run", b.load_for(pv, first)
    if loop.mode == "cascade":
        return Stage("start", title, (), b.watch_time, signals=frozenset(("mode",)), pv=pv, load=load, with_master=True)
    begin = 3 * b.slowest_sample if b.slowest_sample > b.sample or in_cascade else 0.0
    return Stage("start", title, (), b.watch_time, begin, pv=pv, load=load)


def _cascade_stage(b: Bench) -> Stage:
    """Auto to Cascade, and a step of the other loop's output."""
    begin, hold = b.manual_time + 2 * b.sample, max(b.settling_time, 6 * b.slowest_sample)
    master_output = (b.rest_pv - b.low) / b.span
    acts = (
        Act(0.0, mode="cascade"),
        Act(b.slowest_sample, master_output=master_output),
        Act(hold, master_output=master_output + SMALL_STEP * b.sp_width / b.span),
    )
    later = (*go_to_auto(b), Act(0.0, master_output=master_output), *(delayed_act(act, begin) for act in acts))
    load = b.load_for(b.rest_pv, b.rest_out)
    return Stage(
        "cascade",
        "Cascade",
        later,
        begin + 2 * hold,
        begin + 4 * b.slowest_sample,
        pv=b.rest_pv,
        load=load,
        output=b.rest_out,
        slack=ceil(b.slowest_sample / b.sample),
        with_master=True,
    )


def _manual_stage(b: Bench, *, in_cascade: bool) -> Stage:
    """The output as the operator sets it."""
    low, high = b.limits
    acts = (
        *begin_at_rest(b),
        Act(b.manual_time, output=low + 0.4 * (high - low)),
        Act(b.manual_time + 10 * b.sample, output=low + 0.6 * (high - low)),
        *((Act(b.manual_time + k * b.sample, output=end) for k, end in MANUAL_ENDS) if not in_cascade else ()),
    )
    load = b.load_for(b.rest_pv, b.rest_out)
    return Stage(
        "manual",
        "Manual",
        acts,
        b.manual_time + 30 * b.sample,
        b.manual_time - b.sample,
        CLOSED_LOOP,
        b.rest_pv,
        load,
        output=b.rest_out,
    )


def _automatic_stage(b: Bench) -> Stage:
    """From Manual to Auto while the PV is beside the set point."""
    pv = b.rest_pv - b.sign * 0.02 * b.span
    acts = (*begin_at_rest(b), Act(b.manual_time, mode="auto"))
    return Stage(
        "auto",
        "Auto",
        acts,
        b.manual_time + b.watch_time / 2,
        b.manual_time - b.sample,
        CLOSED_LOOP,
        pv,
        b.load_for(pv, b.rest_out),
        output=b.rest_out,
    )


def _small_step_stage(b: Bench) -> Stage:
    act = Act(0.0, setpoint=b.rest_pv + SMALL_STEP * b.sp_width)
    return settled_stage(b, "step 5 %", "a step of the set point of 5 % of its limits", (act,), b.watch_time)


def _large_step_stage(b: Bench) -> Stage:
    acts = (
        Act(0.0, setpoint=b.rest_pv + LARGE_STEP / 2 * b.sp_width),
        Act(b.watch_time / 2, setpoint=b.rest_pv - LARGE_STEP / 2 * b.sp_width),
    )
    return settled_stage(b, "step 50 %", "a step of the set point of 50 % of its limits", acts, b.watch_time * 1.5)


def _disturbance_stage(b: Bench) -> Stage:
    act = Act(0.0, load=_disturbance_load(b))
    return settled_stage(b, "disturbance", "a load that takes 30 % of what the output can do", (act,), b.watch_time)


def _disturbance_load(b: Bench) -> float:
    """The load that takes a part of what the output can do."""
    low, high = b.limits
    size = min(DISTURBANCE_SHARE * (high - low) * abs(b.gain), LARGE_STEP * b.span)
    down = b.rest_out + DISTURBANCE_SHARE * (high - low) > high  # without an integral the output may rest at a limit
    return b.load_for(b.rest_pv, b.rest_out) - (-b.sign if down else b.sign) * size


def _setpoint_limit_stage(b: Bench) -> Stage:
    acts = (Act(0.0, setpoint=b.high), Act(5 * b.sample, setpoint=b.low))
    signals: frozenset[Signal] = frozenset(("setpoint", "mode"))
    return settled_stage(
        b, "set point limits", "the set point at both ends of the PV's range", acts, 10 * b.sample, signals
    )


def _sensor_stage(b: Bench) -> Stage:
    acts = (Act(0.0, sensor_lost=True), Act(5 * b.sample, sensor_lost=False))
    return replace(settled_stage(b, "sensor", "the sensor lost and back", acts, b.watch_time), loses_sensor=True)
