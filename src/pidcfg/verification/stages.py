"""The stages of the battery: what is done to a loop, in the terms of its bench.

A stage begins in Manual with the plant at rest, goes to Auto without a disturbance, and then does what it is named for;
`start` alone begins as the configuration says.
"""

from __future__ import annotations

from dataclasses import replace
from math import ceil
from typing import TYPE_CHECKING

from pidcfg.verification.acts import ALL, Act, Stage, at_rest, in_auto, later, settled
from pidcfg.verification.bench import LARGE, SMALL
from pidcfg.verification.open_loop import open_loop

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.acts import Signal
    from pidcfg.verification.bench import Bench

BEYOND = 0.15
"""How far a PV is driven beyond what the output can hold, as a share of its range."""
FINE = 20
"""Counts of a dead band from which on its width can be told."""
LOADED = 0.3
"""Of the way between the limits of the output: what a disturbance takes."""
NEARER = 0.2
"""Of the way from the output that holds the PV to the middle, where it is put by hand."""
AFTER = 4
"""Samples in Manual after which the output is set by hand: before, it shows what becomes of it by itself."""


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
    yield from open_loop(bench, loop, other, count)
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
    moved = (*in_auto(b), Act(0.0, master=there), *(later(act, begin) for act in acts))
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


def _manual(b: Bench) -> Stage:
    """The output as the operator sets it."""
    low, high = b.limits
    acts = (
        *at_rest(b),
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
    acts = (*at_rest(b), Act(b.rest, mode="auto"))
    return Stage(
        "auto", "Auto", acts, b.rest + b.length / 2, b.rest - b.sample, ALL, pv, b.load(pv, b.middle), output=b.middle
    )


def _small_step(b: Bench) -> Stage:
    act = Act(0.0, setpoint=b.start + SMALL * b.room)
    return settled(b, "step 5 %", "a step of the set point of 5 % of its limits", (act,), b.length)


def _large_step(b: Bench) -> Stage:
    acts = (Act(0.0, setpoint=b.start + LARGE / 2 * b.room), Act(b.length / 2, setpoint=b.start - LARGE / 2 * b.room))
    return settled(b, "step 50 %", "a step of the set point of 50 % of its limits", acts, b.length * 1.5)


def _windup(b: Bench) -> Iterator[Stage]:
    """A load that the output cannot hold, and its end."""
    rest = b.load(b.start, b.middle)
    for name, end, sign in (("high", b.limits[1], 1.0), ("low", b.limits[0], -1.0)):
        held = abs(b.gain) * abs(end - b.middle)
        by = -b.sign * sign * (held + BEYOND * b.span)
        acts = (Act(0.0, load=rest + by), Act(b.length / 2, load=rest))
        yield settled(b, f"{name} limit", f"into the {name} limit of the output and back", acts, b.length * 1.5)


def _disturbance(b: Bench) -> Stage:
    act = Act(0.0, load=_disturbed(b))
    return settled(b, "disturbance", "a load that takes 30 % of what the output can do", (act,), b.length)


def _disturbed(b: Bench) -> float:
    """The load that takes a part of what the output can do."""
    low, high = b.limits
    size = min(LOADED * (high - low) * abs(b.gain), LARGE * b.span)
    down = b.middle + LOADED * (high - low) > high  # without an integral the output may rest at a limit
    return b.load(b.start, b.middle) - (-b.sign if down else b.sign) * size


def _setpoint_limits(b: Bench) -> Stage:
    acts = (Act(0.0, setpoint=b.high), Act(5 * b.sample, setpoint=b.low))
    signals: frozenset[Signal] = frozenset(("setpoint", "mode"))
    return settled(b, "set point limits", "the set point at both ends of the PV's range", acts, 10 * b.sample, signals)


def _deadband(b: Bench, loop: Loop, other: Loop, count: float) -> Iterator[Stage]:
    """The set point just inside of the dead band and just outside; one of few counts is too coarse for it."""
    bands = dict.fromkeys(float(x) for x in (loop.deadband, other.deadband) if x > FINE * count)
    for i, band in enumerate(bands):
        shares = (0.9, 0.0, 1.12, 0.0, -0.9, 0.0, -1.12)
        hold = max(10 * b.sample, b.length / 10)
        acts = tuple(Act(k * hold, setpoint=b.start + share * band) for k, share in enumerate(shares))
        name = f"dead band {i + 1}" if i else "dead band"
        yield settled(b, name, "the set point within the dead band and beyond", acts, hold * len(shares))


def _transfers(b: Bench) -> Stage:
    """Auto to Manual while the loop is at work, an output by hand, and back to Auto."""
    hold = max(20 * b.sample, b.length / 10)
    manual, load = b.length / 2, _disturbed(b)
    held = (b.start - load) / b.gain
    nearer = held + NEARER * (b.middle - held)
    acts = (
        Act(0.0, load=load),
        Act(manual, mode="manual"),
        Act(manual + AFTER * b.sample, output=nearer),
        Act(manual + hold, mode="auto"),
        Act(manual + hold + b.sample, setpoint=b.start),
    )
    return settled(b, "transfers", "Auto to Manual and back to Auto", acts, b.length + hold)


def _sensor(b: Bench) -> Stage:
    acts = (Act(0.0, lost=True), Act(5 * b.sample, lost=False))
    return replace(settled(b, "sensor", "the sensor lost and back", acts, b.length), loses_sensor=True)
