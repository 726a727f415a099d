"""The stages in which the PV goes its own way, whatever the output does: the loop's answer, and its alarms."""

from __future__ import annotations

from math import ceil, expm1
from typing import TYPE_CHECKING

from pidcfg.verification.acts import ALL, Act, Stage, in_auto, later

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.acts import Signal
    from pidcfg.verification.bench import Bench

FASTEST, SLOWEST = 0.0025, 0.001
"""Sweep of the PV through its alarms: share of the range a sample."""
SHARE_OF_BAND = 0.1
"""Of the narrowest alarm, what the sweep covers in a sample."""
BLIND = 0.0025
"""Alarms nearer to the ends of the range are not reached."""
SHARE_OF_HYSTERESIS = 0.06
"""What the sweep around an alarm covers in a sample: a quarter of the hysteresis is more than two samples."""
FEWEST_COUNTS, COUNTS_A_SAMPLE = 20, 1.5
"""Counts of a hysteresis from which on a quarter of it can be told, and what its sweep covers at least."""
ROOM = 0.8
"""Of the way to a limit of the output, what the answer to a step of the PV may take."""
SMALLEST_ROOM = 0.1
"""Way to the nearer limit, as a share of the output's range, below which the other one is taken."""
LARGEST_STEP = 0.2
"""Step of the PV, as a share of its range."""
BANDS, FEWEST_BANDS = 6.0, 2.0
"""Widths of a dead band that the PV is moved by, where the output has room for it, and at least."""
SHORTEST, LONGEST = 20, 200
"""Samples of which each step lasts."""
SLOWER = 4.0
"""Derivative times that a slow change of the PV takes."""
FORGOTTEN = 6
"""Time constants after which a filter has forgotten, for what is to be seen."""


def open_loop(b: Bench, loop: Loop, other: Loop, count: float) -> Iterator[Stage]:
    """The stages of one loop; ``other`` is the same loop on the other side, ``count`` what the PV is counted in."""
    yield _answer(b, loop, other)
    if loop.tuning.derivative_time:
        yield _slow_answer(b, loop, other)
    yield from _alarms(b, loop, other)
    yield from _hysteresis(b, loop, count)


def _answer(b: Bench, loop: Loop, other: Loop) -> Stage:
    """Steps of the PV that keep the output within its limits: gain, integral, derivative and filters, one by one."""
    tuning, width = loop.tuning, float(loop.output.range[1] - loop.output.range[0])
    share = abs(float(tuning.gain)) * b.span / width or 1.0
    constants = [float(x) for x in (tuning.derivative_filter, loop.pv.filter, other.pv.filter)]
    integral = float(tuning.integral_time)
    wanted = max(FORGOTTEN * max(constants), integral / 2)
    samples = min(max(round(wanted / b.sample), SHORTEST), LONGEST)
    passed = -expm1(-b.sample / constants[1]) if constants[1] else 1.0
    kick = passed * float(tuning.derivative_time) / (constants[0] + b.sample)
    summed = samples * b.sample / integral if integral else 0.0
    low, high = b.middle - b.limits[0], b.limits[1] - b.middle
    room = min(low, high) if min(low, high) >= SMALLEST_ROOM else max(low, high)
    band = float(max(loop.deadband, other.deadband)) / b.span
    size = min(ROOM * room / (share * (1 + max(kick, summed))), max(LARGEST_STEP, BANDS * band))
    size = max(size, FEWEST_BANDS * band) * b.span
    down = low > high + SMALLEST_ROOM or low < SMALLEST_ROOM
    by = b.sign * size * (-1.0 if down else 1.0)
    hold = samples * b.sample
    acts = (Act(0.0, moved=by), Act(hold, moved=0.0))
    return _sweep(b, "answer", "a step of the PV and back", acts, 2 * hold, ALL)


def _slow_answer(b: Bench, loop: Loop, other: Loop) -> Stage:
    """The PV slowly to another value and back: gain and integral, where the derivative's kick leaves them no room."""
    tuning, width = loop.tuning, float(loop.output.range[1] - loop.output.range[0])
    share = abs(float(tuning.gain)) * b.span / width or 1.0
    integral, filters = float(tuning.integral_time), max(float(one.pv.filter) for one in (loop, other))
    ramp = ceil(max(FORGOTTEN * filters, SLOWER * float(tuning.derivative_time)) / b.sample)
    hold = min(max(round(integral / 2 / b.sample), SHORTEST), LONGEST)
    summed = (ramp / 2 + hold) * b.sample / integral if integral else 0.0
    low, high = b.middle - b.limits[0], b.limits[1] - b.middle
    size = min(ROOM * max(low, high) / (share * (1 + 1 / SLOWER + summed)), LARGEST_STEP) * b.span
    rate = b.sign * size * (1.0 if high >= low else -1.0) / (ramp * b.sample)
    times = [k * b.sample for k in (0, ramp, ramp + hold, 2 * ramp + hold)]
    acts = tuple(Act(at, load=load) for at, load in zip(times, (-rate, 0.0, rate, 0.0), strict=True))
    return _sweep(b, "slow answer", "the PV slowly to another value and back", acts, times[-1] + 10 * b.sample, ALL)


def _alarms(b: Bench, loop: Loop, other: Loop) -> Iterator[Stage]:
    """The PV from the middle to the top, to the bottom and back, whatever the output does."""
    sides = (loop.alarms, other.alarms)
    widths = [w for a in sides for w in (a.deviation.high, a.deviation.high_high) if w]
    bands = [float(width) / b.span for width in widths]
    speed = min(max(SHARE_OF_BAND * min(bands, default=1.0), SLOWEST), FASTEST)
    up, down = ((end / b.span) / speed for end in (b.high - b.start, b.start - b.low))
    edge = BLIND / speed
    rates = [float(a.rate_of_change) for a in sides if a.rate_of_change]
    rate = speed * b.span / b.sample
    rise, fall = (round(x - edge) * b.sample for x in (up, down))
    acts = (
        Act(0.0, load=rate),
        Act(rise, load=-rate),
        Act(2 * rise + fall, load=rate),
        Act(2 * (rise + fall), load=0.0),
    )
    signals: frozenset[Signal] = ALL - {"output"}
    end = 2 * (rise + fall) + 5 * b.sample
    yield _sweep(b, "alarms", "the PV through its whole range and back", acts, end, signals)
    for i, limit in enumerate(dict.fromkeys(rates)):
        yield _rate(b, f"rate of change {i + 1}" if i else "rate of change", limit, signals)


def _hysteresis(b: Bench, loop: Loop, count: float) -> Iterator[Stage]:
    """The PV slowly through one alarm and back, where counts can tell how far."""
    width = float(loop.alarms.hysteresis)
    if width < FEWEST_COUNTS * count:
        return
    points = [float(p) for p in (loop.alarms.pv.high, loop.alarms.pv.low) if p is not None]
    points += [b.start + float(d) for d in (loop.alarms.deviation.high,) if d is not None]
    reach = 2 * width
    point = next((p for p in points if b.low + reach < p < b.high - reach), None)
    if point is None:
        return
    rate = max(SHARE_OF_HYSTERESIS * width, COUNTS_A_SAMPLE * count) / b.sample
    way, slow = point - reach - b.start, round(2 * reach / (rate * b.sample)) * b.sample
    turn, back = 2 * b.sample + slow, 2 * b.sample + 2 * slow
    acts = (Act(0.0, moved=way), Act(2 * b.sample, load=rate), Act(turn, load=-rate), Act(back, load=0.0))
    signals: frozenset[Signal] = ALL - {"output"}
    yield _sweep(b, "hysteresis", "the PV through an alarm and back", acts, back + 5 * b.sample, signals)


def _rate(b: Bench, name: str, limit: float, signals: frozenset[Signal]) -> Stage:
    """The PV a tenth more slowly than its alarm allows, then a tenth faster, up and down."""
    hold = min(8 * b.sample, 0.3 * b.span / limit)
    times = [i * hold for i in range(5)]
    loads = (0.9 * limit, -0.9 * limit, 1.1 * limit, -1.1 * limit, 0.0)
    acts = tuple(Act(at, load=load) for at, load in zip(times, loads, strict=True))
    return _sweep(b, name, "the PV as fast as its alarm allows, and faster", acts, 5 * hold + 5 * b.sample, signals)


def _sweep(b: Bench, name: str, title: str, acts: tuple[Act, ...], length: float, signals: frozenset[Signal]) -> Stage:
    begin = b.rest + 5 * b.sample
    moved = tuple(later(act, begin) for act in acts)
    return Stage(
        name, title, (*in_auto(b), *moved), begin + length, begin, signals, b.start, 0.0, swept=True, output=b.middle
    )
