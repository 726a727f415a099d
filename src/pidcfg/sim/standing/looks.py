"""When a loop's error is looked at: at the end of the run, and before what moves the loop or ends its control.

Design. The events of a scenario are known beforehand, and so are the looks: each ends right before an event, or with
the run, and has a window before it in which the loop is left alone. The meter of a loop sums up the error of one window
at a time; between two of them it is set to the next (`pidcfg.sim.standing.watch.aim`), so that the kernel knows of one
only. How long a window has to be for an answer depends on the plant: `plant_time`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

from pidcfg.sim.feedback import answer
from pidcfg.sim.plc import TICKS, steps_until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.schemas.scenario import Plant as PlantText
    from pidcfg.sim.influence import Influence
    from pidcfg.sim.plc import Plc

TENTH, DEAD_TIMES, SAMPLES = 10, 3, 10
"""The end of a run is its last tenth, but so many dead times and samples at least."""
QUARTER = 4
"""Before an event it is the last quarter of the time since the one before, with the same least lengths."""
PATIENCE = 4
"""Plant times that a loop may take to get to its set point (D331)."""
SMOOTHING = 3
"""Samples of a loop that count as a part of its plant: it answers that much later."""


@dataclass(frozen=True, slots=True)
class Look:
    """A window in which a loop's error is looked at; all in base steps."""

    start: int
    """Where it begins to be summed up, for whether it gets smaller."""
    middle: int
    """Where the second half of that begins."""
    end: int
    """The last one."""
    stage: int
    """Where the last event before it moved the loop; 0: none did."""
    final: bool
    """It is the end of the run, and no event comes later."""
    following: float
    """When the event comes that ends it, in s."""

    @property
    def half(self) -> float:
        """Base steps between the two halves."""
        return (self.end + 1 - self.start) / 2


def looks_at(scenario: Scenario, plc: Plc, influence: Influence, i: int, step: int, last: int) -> list[Look]:
    """The looks at one loop in a run of ``last`` base steps of ``step`` ticks; the final one is always there."""
    net = influence.net
    dead = max((float(net.texts[name][1].dead_time) for name in influence.plants_between(i)), default=0.0)
    least = max(DEAD_TIMES * dead * TICKS / step, SAMPLES * plc.cfg[i].period / step)
    moved = {k for k, event in happenings(scenario, step, last) if influence.concerns(event, i)}
    bounds = [0, *sorted(moved - {0})]
    looks = []
    for stage, following in pairwise(bounds):
        length = round(max((following - stage) / QUARTER, least))
        if stage + length < following:
            looks.append(_look(following - 1, length, stage, final=False, following=following * step / TICKS))
    length = min(last, round(max(last / TENTH, least)))
    return [*looks, _look(last, length, bounds[-1], final=True, following=last * step / TICKS)]


def _look(end: int, length: int, stage: int, *, final: bool, following: float) -> Look:
    start = max(0, end - length)
    return Look(start, (start + end + 1) // 2, end, stage, final, following)


def happenings(scenario: Scenario, step: int, last: int) -> Iterator[tuple[int, Event]]:
    """The events of a run, and ends of sensor faults, with their base steps."""
    for event in scenario.events:
        ends = () if event.duration is None else (event.at + event.duration,)
        for time in (event.at, *ends):
            k = steps_until(time, step)
            if k <= last:
                yield k, event


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a loop's PV can answer its output."""

    seconds: float
    """Dead times and time constants of the plants between, and some samples of the loop."""
    turn: float
    """The same without the time in which an integrator crosses the span: a limit has turned its PV round by then."""
    lags: float
    """The time constants alone."""
    integrates: bool
    """One of the plants integrates: it comes to rest nowhere by itself."""


def plant_time(plc: Plc, influence: Influence, i: int) -> Pace:
    """The pace of one loop's plants."""
    net = influence.net
    total, integrates = SMOOTHING * plc.cfg[i].period / TICKS, False
    low, high, _ = plc.scales[i]
    least, most = (0.0, 1.0) if plc.pulse_cycle(i) else plc.output_limits(i, net.sig)
    for name in influence.plants_between(i):
        text = net.texts[name][1]
        total += float(text.dead_time) + sum(lags(text))
        integrates = integrates or text.model == "integrator"
    speed, turn = abs(answer(net, plc, i)) * (most - least), total
    if integrates and speed:
        total += abs(high - low) / speed
    return Pace(total, turn, sum(sum(lags(net.texts[name][1])) for name in influence.plants_between(i)), integrates)


def lags(text: PlantText) -> Iterator[float]:
    """The time constants of a plant, in s."""
    yield from (float(time) for time in text.time_constants or ())
    if text.time_constant is not None:
        yield float(text.time_constant) * max(1.0, 2 * float(text.damping or 0))
    if text.lag is not None:
        yield float(text.lag)
