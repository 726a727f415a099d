"""What is planned for each loop: where it rests, how far it is moved, and the plant that suits its gains.

PV and output are shares of their ranges here, so that every PLC's loops are planned alike; `pidcfg.draft.course` turns
them into the units of the signals.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pidcfg.refs import Decision
from pidcfg.sim.plc import TICKS
from pidcfg.verification.bench import dynamics, middle_output, output_limits, quiet_range

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.draft.surroundings import Selector, Surroundings
    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.plc import Plc

D740 = Decision(
    740,
    "a drafted plant is one that the loop's own gains suit",
    "First order with a dead time of a sample, a gain of about 1.2 spans of the PV for the whole output, and a time "
    "constant with which the loop crosses over as in D304. It rests at the configured set point with the output in the "
    "middle of its limits; where the set point is none that the loop can rest at, it is set at the start.",
    "A file says nothing of its process. A loop that is tuned at all is well damped on such a plant, so that a failed "
    "verdict is the configuration's doing; what the real process does only its own numbers tell.",
)
WANTED = 1.2
"""Gain of a plant where the loop's gain allows it: the output covers the range of the PV, and a little more."""
STEP, SMALL_STEP = 0.1, 0.03
"""Step of a set point, as a share of the range; of a loop without an integral, which an offset belongs to."""
LEAST_STEP = 0.004
"""A smaller one shows nothing."""
ROOM = 0.5
"""Of the way to a limit of the set point or an alarm, what a step may take: the PV may overshoot it."""
REACH = 0.6
"""Of the way from rest to a limit, what the output may take for a step in the end."""
ANSWER = 9.0
"""Times 1/crossover for which a change is watched, at least."""
PUSH = 0.1
"""Of the output's range, what a disturbance asks of it."""
ASIDE = 0.12
"""How far a PV lies from the set point of a loop that a selector leaves out, as a share of the range."""
BEHIND = 3.0
"""Times 1/crossover by which an inner loop delays its master."""
SWITCHED, SAMPLES_OF_SWITCHED = 0.6, 400
"""Gain of the plant of an on-off loop, and its time constant in samples."""
UNKNOWN, SAMPLES_OF_UNKNOWN = 1.0, 50
"""The same for a loop whose gains no neutral form has."""


@dataclass(frozen=True, slots=True)
class LoopPlan:
    """One loop; shares of the ranges, s."""

    i: int
    name: str
    sample: float
    gain: float
    """PV for the whole output, with the sign of the action."""
    time: float
    length: float
    """How long a change is watched."""
    rest: float
    output: float
    limits: tuple[float, float]
    """Of the output."""
    step: float = 0.0
    """0: its set point is not moved."""
    push: float = 0.0
    """Of the output; 0: nothing disturbs it."""
    crossover: float = 0.0
    integrates: bool = True
    switches: bool = False
    is_set: bool = False
    """Whether its set point is given to it at the start."""
    selector: Selector | None = None
    neutral: Loop | None = None

    @property
    def sign(self) -> float:
        """1 where the PV rises with the output, else -1."""
        return 1.0 if self.gain > 0 else -1.0


def plans_of(plc: Plc, neutral: Sequence[Loop | None], around: Surroundings) -> list[LoopPlan]:
    """The plan of each loop that is calculated; slaves first, since their masters wait for them."""
    plans: dict[int, LoopPlan] = {}

    def plan(i: int) -> None:
        if i in plans:
            return
        slaves = [j for j in around.slaves(i) if j != i and not plc.cfg[j].halt]
        for j in slaves:
            if j not in waiting:
                waiting.add(j)
                plan(j)
        inner = sum(BEHIND / plans[j].crossover for j in slaves[:1] if j in plans)
        plans[i] = _plan(plc, i, neutral[i], around, inner)

    waiting: set[int] = set()
    for i in range(len(plc.loops)):
        if not plc.cfg[i].halt:
            plan(i)
    for i in sorted(plans, key=lambda i: len(_above(i, around))):
        _settle(plans, around, plc, i)
    return [plans[i] for i in sorted(plans)]


def _above(i: int, around: Surroundings) -> list[int]:
    """The masters of a loop, up to the first."""
    above: list[int] = []
    while i in around.masters and around.masters[i] not in above:
        i = around.masters[i]
        above.append(i)
    return above


def _plan(plc: Plc, i: int, loop: Loop | None, around: Surroundings, inner: float) -> LoopPlan:
    """A loop by itself, ``inner`` s behind its slave."""
    sample = plc.cfg[i].period / TICKS
    sign = 1.0 if plc.rises[i] else -1.0
    name, selector = plc.loops[i], around.selectors.get(i)
    if plc.only_switches(i):
        time = SAMPLES_OF_SWITCHED * sample
        rest, is_set = _rest(plc, i, (0.1, 0.9))
        return LoopPlan(
            i, name, sample, sign * SWITCHED, time, 4 * time, rest, 0.0, (0.0, 1.0), crossover=1 / time,
            integrates=False, switches=True, is_set=is_set,
        )  # fmt: skip
    integrates = plc.integrates(i, plc.sig)
    if loop is None:
        time = SAMPLES_OF_UNKNOWN * sample + inner
        crossover, gain, limits, output, quiet = 1 / time, UNKNOWN, (0.0, 1.0), 0.5, (0.05, 0.95)
        length = 10 * time
    else:
        delay = 2 * sample + float(loop.pv.filter) + inner
        crossover, gain, time = dynamics(loop, sample, delay, WANTED)
        limits = output_limits(loop)
        output = middle_output(loop, limits)
        low, high = (float(end) for end in loop.pv.range)
        bottom, top = quiet_range(loop)
        quiet = (bottom - low) / (high - low), (top - low) / (high - low)
        length = max(ANSWER / crossover, 2 * float(loop.tuning.integral_time), 10 * sample)
    rest, is_set = _rest(plc, i, quiet, loop)
    plan = LoopPlan(
        i, name, sample, sign * gain, time, length, rest, output, limits, crossover=crossover, integrates=integrates,
        is_set=is_set, selector=selector, neutral=loop, push=PUSH if integrates else 0.0,
    )  # fmt: skip
    return replace(plan, step=_step(plan, quiet))


def _rest(plc: Plc, i: int, quiet: tuple[float, float], loop: Loop | None = None) -> tuple[float, bool]:
    """Where a loop rests, and whether it must be brought there: its set point is none it can rest at."""
    low, high, _ = plc.scales[i]
    if loop is not None and loop.setpoint.value is not None:
        bottom, top = loop.pv.range
        share = float((loop.setpoint.value - bottom) / (top - bottom))
    else:
        share = (plc.given_set_point(i, plc.sig) - low) / (high - low)
        share = max(share, 0.0) ** 0.5 if plc.roots and plc.roots[i] is not None else share
    return (share, False) if quiet[0] <= share <= quiet[1] else ((quiet[0] + quiet[1]) / 2, True)


def _step(plan: LoopPlan, quiet: tuple[float, float]) -> float:
    """How far the set point goes: to the side that has more room, and no further than the output can follow."""
    more, less = plan.limits[1] - plan.output, plan.output - plan.limits[0]
    reach = REACH * abs(plan.gain)
    up = min(ROOM * (quiet[1] - plan.rest), reach * (more if plan.sign > 0 else less))
    down = min(ROOM * (plan.rest - quiet[0]), reach * (less if plan.sign > 0 else more))
    most = STEP if plan.integrates else SMALL_STEP
    size = min(most, max(up, down))
    return 0.0 if size < LEAST_STEP else size if up >= size else -size


def _settle(plans: dict[int, LoopPlan], around: Surroundings, plc: Plc, i: int) -> None:
    """Brings a loop in line with those it hangs on: its master, the loop that shares its PV, or that has its valve."""
    plan = plans[i]
    master = plans.get(around.masters.get(i, -1))
    slave = next((plans[j] for j in around.slaves(i) if j in plans), None)
    if slave is not None and plan.neutral is not None and slave.neutral is not None:
        low, high = (float(end) for end in slave.neutral.pv.range)
        ends = [(end - low) / (high - low) for end in map(float, quiet_range(slave.neutral))]
        inner = max(plan.limits[0], ends[0]), min(plan.limits[1], ends[1])
        if inner[0] < inner[1] and plan.integrates:
            plan = replace(plan, output=(inner[0] + inner[1]) / 2)
        plan = replace(plan, step=_within(plan.step, REACH * abs(plan.gain) * (inner[1] - inner[0]) / 2))
    if master is not None:
        plan = replace(plan, rest=master.output, step=0.0, push=0.0, is_set=False)
    elif i in around.given:
        low, high, _ = plc.scales[i]
        plan = replace(plan, step=0.0, is_set=False)
    leader = plans.get(around.leaders.get(i, -1))
    if leader is not None:
        plan = replace(plan, rest=leader.rest, step=0.0, push=0.0, is_set=False, output=_held(plan, leader.rest))
    if plan.selector is not None and plan.selector.first != i:
        first = plans[plan.selector.first]
        asks_more = -1.0 if plan.selector.takes_larger else 1.0
        moved = abs(first.step / first.gain) + PUSH
        plan = replace(plan, gain=plan.sign * min(abs(plan.gain), ASIDE / 2 / moved))
        plan = replace(
            plan, rest=plan.rest - asks_more * plan.sign * ASIDE, step=0.0, push=0.0, output=first.output, is_set=False
        )
    plans[i] = plan


def _held(plan: LoopPlan, pv: float) -> float:
    """The output of a loop whose PV another one holds at a value: at the limit to which its error drives it."""
    error = (plan.rest - pv) * plan.sign
    return plan.output if not error else plan.limits[1] if error > 0 else plan.limits[0]


def _within(step: float, most: float) -> float:
    return max(min(step, most), -most)
