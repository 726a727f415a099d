"""The stages of the battery: what is done to a loop, in the terms of its bench.

A stage begins in Manual with the plant at rest, goes to Auto without a disturbance, and then does what it is named for;
`start` alone begins as the configuration says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.bench import Bench

from pidcfg.verification.bench import LARGE, SMALL

Signal = Literal["pv", "output", "setpoint", "mode", "alarms"]
ALL: frozenset[Signal] = frozenset(("pv", "output", "setpoint", "mode", "alarms"))
BEYOND = 0.15
"""How far a PV is driven beyond what the output can hold, as a share of its range."""
FASTEST, SLOWEST = 0.0025, 0.001
"""Sweep of the PV through its alarms: share of the range a sample."""
SHARE_OF_BAND = 0.1
"""Of the narrowest alarm or hysteresis, what the sweep covers in a sample."""
FINE = 20
"""Counts of a dead band from which on its width can be told."""
LOADED = 0.3
"""Of the way between the limits of the output: what a disturbance takes."""
BLIND = 0.01
"""Alarms nearer to the ends of the range are not reached."""


@dataclass(frozen=True, slots=True)
class Act:
    """Something that happens ``at`` s; numbers of a plant, a key of the loop, a mode, or a broken sensor."""

    at: float
    mode: str | None = None
    setpoint: float | None = None
    output: float | None = None
    """A share of the range."""
    load: float | None = None
    master: float | None = None
    """The output of the loop that gives the set point, as a share of its range."""
    lost: bool | None = None
    """The sensor shows the lower end of its range, or the PV again."""


@dataclass(frozen=True, slots=True)
class Stage:
    """One stage; times in s."""

    name: str
    title: str
    acts: tuple[Act, ...]
    end: float
    begin: float = 0.0
    """From when on both sides are compared."""
    signals: frozenset[Signal] = ALL
    pv: float = 0.0
    """Of the plant at the beginning."""
    load: float = 0.0
    loses_sensor: bool = False
    swept: bool = False
    """The plant is an integrator that only its load moves."""
    output: float | None = None
    """With which a stage begins; None: as configured."""
    slack: int = 0
    """Samples by which signals may come apart in addition: a loop above samples more slowly."""
    with_master: bool = False
    """The loop that gives the set point runs, too."""


def stages_of(bench: Bench, loop: Loop, other: Loop, count: float, *, in_cascade: bool) -> Iterator[Stage]:
    """The battery of one loop; ``other`` is the same loop on the other side.

    ``count``: what the PV is counted in; ``in_cascade``: others run with it.
    """
    yield _start(bench, loop, in_cascade=in_cascade)
    if loop.setpoint.source is not None:
        yield _cascade(bench)
    yield _manual(bench)
    yield _automatic(bench)
    yield _small_step(bench)
    yield _large_step(bench)
    yield from _windup(bench)
    yield _disturbance(bench)
    yield _setpoint_limits(bench)
    yield from _alarms(bench, loop, other)
    yield from _deadband(bench, loop, other, count)
    yield _transfers(bench)
    yield _sensor(bench)


def _start(b: Bench, loop: Loop, *, in_cascade: bool) -> Stage:
    """As configured: the plant rests a little beside the set point, where the first output of the loop holds it."""
    wanted = b.start if loop.setpoint.value is None else float(loop.setpoint.value)
    pv = min(max(wanted - b.sign * SMALL * b.span, b.quiet[0]), b.quiet[1])
    low, high = (float(end) for end in loop.output.range)
    first = 0.0 if loop.output.manual is None else (float(loop.output.manual) - low) / (high - low)
    first = min(max(first, b.limits[0]), b.limits[1])
    title, load = "from Program to Run", b.load(pv, first)
    if loop.mode == "cascade":
        return Stage("start", title, (), b.length, signals=frozenset(("mode",)), pv=pv, load=load, with_master=True)
    if loop.mode == "manual" and loop.output.manual is None:  # nothing says the output that it begins with
        return Stage("start", title, (), b.length, signals=frozenset(("mode",)), pv=pv, load=load)
    begin = 3 * b.slowest if b.slowest > b.sample or in_cascade else 0.0
    return Stage("start", title, (), b.length, begin, pv=pv, load=load)


def _cascade(b: Bench) -> Stage:
    """Auto to Cascade, and a step of the other loop's output."""
    begin, hold = b.rest + 2 * b.sample, max(b.settling, 6 * b.slowest)
    there = (b.start - b.low) / b.span
    acts = (
        Act(0.0, mode="cascade"),
        Act(b.slowest, master=there),
        Act(hold, master=there + SMALL * b.room / b.span),
    )
    moved = (*_in_auto(b), Act(0.0, master=there), *(_later(act, begin) for act in acts))
    load = b.load(b.start, b.middle)
    return Stage(
        "cascade",
        "Cascade",
        moved,
        begin + 2 * hold,
        begin + 4 * b.slowest,
        pv=b.start,
        load=load,
        output=b.middle,
        slack=ceil(b.slowest / b.sample),
        with_master=True,
    )


def _resting(b: Bench) -> tuple[Act, ...]:
    """In Manual, with the plant at rest at the set point."""
    return (
        Act(0.0, mode="auto"),  # a block may keep its set point from a master in Manual, too
        Act(0.0, mode="manual"),
        Act(0.0, output=b.middle),
        Act(b.sample, setpoint=b.start),
        Act(b.rest - b.sample, output=b.middle),
    )


def _in_auto(b: Bench) -> tuple[Act, ...]:
    """The same, and then Auto with the same set point."""
    return (
        *_resting(b),
        Act(b.rest, mode="auto"),
        Act(b.rest + b.sample, setpoint=b.start),
    )


def _stage(
    b: Bench, name: str, title: str, acts: tuple[Act, ...], length: float, signals: frozenset[Signal] = ALL
) -> Stage:
    """A stage in Auto whose acts are counted from the time at which the loop has settled."""
    begin = b.rest + 2 * b.sample + b.settling
    moved = tuple(_later(act, begin) for act in acts)
    load = b.load(b.start, b.middle)
    return Stage(name, title, (*_in_auto(b), *moved), begin + length, begin, signals, b.start, load, output=b.middle)


def _later(act: Act, by: float) -> Act:
    return replace(act, at=act.at + by)


def _manual(b: Bench) -> Stage:
    """The output as the operator sets it."""
    low, high = b.limits
    acts = (
        *_resting(b),
        Act(b.rest, output=low + 0.4 * (high - low)),
        Act(b.rest + 10 * b.sample, output=low + 0.6 * (high - low)),
    )
    load = b.load(b.start, b.middle)
    return Stage(
        "manual", "Manual", acts, b.rest + 20 * b.sample, b.rest - b.sample, ALL, b.start, load, output=b.middle
    )


def _automatic(b: Bench) -> Stage:
    """From Manual to Auto while the PV is beside the set point."""
    pv = b.start - b.sign * 0.02 * b.span
    acts = (*_resting(b), Act(b.rest, mode="auto"))
    return Stage(
        "auto", "Auto", acts, b.rest + b.length / 2, b.rest - b.sample, ALL, pv, b.load(pv, b.middle), output=b.middle
    )


def _small_step(b: Bench) -> Stage:
    act = Act(0.0, setpoint=b.start + SMALL * b.room)
    return _stage(b, "step 5 %", "a step of the set point of 5 % of its limits", (act,), b.length)


def _large_step(b: Bench) -> Stage:
    acts = (Act(0.0, setpoint=b.start + LARGE / 2 * b.room), Act(b.length / 2, setpoint=b.start - LARGE / 2 * b.room))
    return _stage(b, "step 50 %", "a step of the set point of 50 % of its limits", acts, b.length * 1.5)


def _windup(b: Bench) -> Iterator[Stage]:
    """A load that the output cannot hold, and its end."""
    rest = b.load(b.start, b.middle)
    for name, end, sign in (("high", b.limits[1], 1.0), ("low", b.limits[0], -1.0)):
        held = abs(b.gain) * abs(end - b.middle)
        by = -b.sign * sign * (held + BEYOND * b.span)
        acts = (Act(0.0, load=rest + by), Act(b.length / 2, load=rest))
        yield _stage(b, f"{name} limit", f"into the {name} limit of the output and back", acts, b.length * 1.5)


def _disturbance(b: Bench) -> Stage:
    low, high = b.limits
    size = min(LOADED * (high - low) * abs(b.gain), LARGE * b.span)
    down = b.middle + LOADED * (high - low) > high  # without an integral the output may rest at a limit
    act = Act(0.0, load=b.load(b.start, b.middle) - (-b.sign if down else b.sign) * size)
    return _stage(b, "disturbance", "a load that takes 30 % of what the output can do", (act,), b.length)


def _setpoint_limits(b: Bench) -> Stage:
    acts = (Act(0.0, setpoint=b.high), Act(5 * b.sample, setpoint=b.low))
    signals: frozenset[Signal] = frozenset(("setpoint", "mode"))
    return _stage(b, "set point limits", "the set point at both ends of the PV's range", acts, 10 * b.sample, signals)


def _alarms(b: Bench, loop: Loop, other: Loop) -> Iterator[Stage]:
    """The PV from the middle to the top, to the bottom and back, whatever the output does."""
    sides = (loop.alarms, other.alarms)
    widths = [w for a in sides for w in (a.deviation.high, a.deviation.high_high, a.hysteresis or None) if w]
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
    signals: frozenset[Signal] = frozenset(("pv", "setpoint", "mode", "alarms"))
    end = 2 * (rise + fall) + 5 * b.sample
    yield _sweep(b, "alarms", "the PV through its whole range and back", acts, end, signals)
    for i, limit in enumerate(dict.fromkeys(rates)):
        yield _rate(b, f"rate of change {i + 1}" if i else "rate of change", limit, signals)


def _rate(b: Bench, name: str, limit: float, signals: frozenset[Signal]) -> Stage:
    """The PV a tenth more slowly than its alarm allows, then a tenth faster, up and down."""
    hold = min(8 * b.sample, 0.3 * b.span / limit)
    times = [i * hold for i in range(5)]
    loads = (0.9 * limit, -0.9 * limit, 1.1 * limit, -1.1 * limit, 0.0)
    acts = tuple(Act(at, load=load) for at, load in zip(times, loads, strict=True))
    return _sweep(b, name, "the PV as fast as its alarm allows, and faster", acts, 5 * hold + 5 * b.sample, signals)


def _sweep(b: Bench, name: str, title: str, acts: tuple[Act, ...], length: float, signals: frozenset[Signal]) -> Stage:
    begin = b.rest + 5 * b.sample
    moved = tuple(_later(act, begin) for act in acts)
    return Stage(
        name, title, (*_in_auto(b), *moved), begin + length, begin, signals, b.start, 0.0, swept=True, output=b.middle
    )


def _deadband(b: Bench, loop: Loop, other: Loop, count: float) -> Iterator[Stage]:
    """The set point just inside of the dead band and just outside; one of few counts is too coarse for it."""
    bands = dict.fromkeys(float(x) for x in (loop.deadband, other.deadband) if x > FINE * count)
    for i, band in enumerate(bands):
        shares = (0.9, 0.0, 1.12, 0.0, -0.9, 0.0, -1.12)
        hold = max(10 * b.sample, b.length / 10)
        acts = tuple(Act(k * hold, setpoint=b.start + share * band) for k, share in enumerate(shares))
        name = f"dead band {i + 1}" if i else "dead band"
        yield _stage(b, name, "the set point within the dead band and beyond", acts, hold * len(shares))


def _transfers(b: Bench) -> Stage:
    """Auto to Manual while the loop is at work, and back to Auto."""
    rest, hold = b.load(b.start, b.middle), max(20 * b.sample, b.length / 10)
    acts = (
        Act(0.0, load=rest - SMALL * b.span),
        Act(b.length / 2, mode="manual"),
        Act(b.length / 2 + hold, mode="auto"),
        Act(b.length / 2 + hold + b.sample, setpoint=b.start),
    )
    return _stage(b, "transfers", "Auto to Manual and back to Auto", acts, b.length + hold)


def _sensor(b: Bench) -> Stage:
    acts = (Act(0.0, lost=True), Act(5 * b.sample, lost=False))
    return replace(_stage(b, "sensor", "the sensor lost and back", acts, b.length), loses_sensor=True)
