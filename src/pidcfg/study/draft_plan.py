"""What a drafted scenario does: plants that suit the loops, where they rest, and how far they are moved."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.plc import CONTROL_MODES, TICKS
from pidcfg.sim.engine.influence import Influence
from pidcfg.sim.engine.run import prepare_network
from pidcfg.study.verification.stages import dynamics, middle_output, output_limits, quiet_range
from pidcfg.study.verification.trial import is_whole, output_scale
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.sim.controllers.plc import Plc

# --- Numbers and times as people write them ---------------------------------------------------------------------------

ROUND_TIMES = (1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10)
"""What half a run may last, times a power of ten."""
HOUR_SECONDS, MIN_MINUTES_TIME = 3600, 120
"""Seconds from which on a time is told in hours, and in minutes."""
MAX_WHOLE_FLOAT = 1e15


def round_to_digits(value: float, digits: int = 4) -> float:
    """A number of so many significant digits; a whole one as such."""
    rounded = float(f"{value:.{digits}g}")
    return int(rounded) if rounded == int(rounded) and abs(rounded) < MAX_WHOLE_FLOAT else rounded


def rounded_value(value: float, span: float) -> float:
    """A value to a ten-thousandth of its range."""
    decimals = 4 - len(f"{abs(span):.0f}") if abs(span) >= 1 else 4 + max(0, -int(f"{span:e}".split("e")[1]))
    rounded = round(value, max(decimals, 0))
    return int(rounded) if rounded == int(rounded) else rounded


def round_up_time(seconds: float) -> float:
    """A neat time that is not shorter."""
    power = 10.0 ** int(f"{seconds:e}".split("e")[1])
    return round_to_digits(next(step * power for step in ROUND_TIMES if step * power >= seconds * (1 - 1e-9)))


def time_text(seconds: float) -> str:
    """A time for a comment."""
    if seconds >= HOUR_SECONDS:
        return f"{seconds / HOUR_SECONDS:.3g} h"
    return f"{seconds / 60:.3g} min" if seconds >= MIN_MINUTES_TIME else f"{seconds:.3g} s"


# ----------------------------------------------------------------------------------------------------------------------
# What stands around the loops of a configuration: whose output is whose set point, shared PVs, selectors, wires.

PV_SOURCES = (("pv", "tag"), ("devices", "PV"), ("pv", "transfer"))
"""Where a loop's configuration says from which device its PV comes; two loops that name the same share it."""
LARGER_MARK = "Max"
"""In the type of a selector that takes the larger of its inputs."""


@frozen
class Selector:
    """A signal of the program that is one of several outputs."""

    signal: str
    takes_larger: bool
    first: int
    """The loop that shall have it."""


@frozen
class Connections:
    """By the number of a loop."""

    masters: Mapping[int, int]
    """Its master, where its set point is another loop's output."""
    leaders: Mapping[int, int] = field(default_factory=dict)
    """The first loop with the same PV, of every further one."""
    selectors: Mapping[int, Selector] = field(default_factory=dict)
    """The selector that reads its output."""
    given_signals: Mapping[int, str] = field(default_factory=dict)
    """A signal from outside that the program makes its set point of."""

    def slaves(self, i: int) -> Iterator[int]:
        """The loops whose set point is the output of one."""
        return (j for j, master in self.masters.items() if master == i)


def find_connections(config: Any, plc: Plc) -> Connections:
    """Of a configuration and its PLC as it starts."""
    masters = {i: m for i, m in enumerate(plc.masters) if m >= 0 and plc.initial_modes[i] == "cascade"}
    empty = Scenario.model_validate({"pidcfg": 1, "scenario": "-", "config": "-", "duration": 1})
    net = prepare_network(empty, plc)
    influence = Influence.build(empty, net, plc)
    name_of = {slot: name for name, slot in plc.inputs.items()}
    measured, given_signals = set(plc.pv_inputs.values()), {}
    for i in range(len(plc.loops)):
        names = [name_of[slot] for slot in sorted(influence.set_point_sources[i]) if slot in name_of]
        names = [name for name in names if "." not in name and name not in measured and input_step(plc, name)]
        if names and i not in masters:
            given_signals[i] = names[0]
    return Connections(masters, _find_leaders(config, plc), _find_selectors(config, plc, influence), given_signals)


def input_step(plc: Plc, name: str) -> tuple[float, float] | None:
    """The first value of a signal from outside and one a tenth above it; None for a switch."""
    value = plc.signal_values[plc.inputs[name]]
    for new in (round(value * 1.1, 6), round(value * 1.1), value + 1):
        try:
            if plc.check_input(name, new) != value:
                return value, new
        except PydanticCustomError:
            continue
    return None


def _find_leaders(config: Any, plc: Plc) -> dict[int, int]:
    loops_by_source: dict[object, list[int]] = defaultdict(list)
    for i, loop in enumerate(config.loops):
        inlet = plc.pv_inputs.get(plc.loops[i])
        source = inlet or next(
            (repr(value) for path in PV_SOURCES if (value := _value_at(loop, path)) is not None), None
        )
        if source is not None:
            loops_by_source[source].append(i)
    return {i: loops[0] for loops in loops_by_source.values() for i in loops[1:]}


def _value_at(model: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        model = model.get(key) if isinstance(model, dict) else getattr(model, key, None)
        if model is None:
            return None
    return model


def _find_selectors(config: Any, plc: Plc, influence: Influence) -> dict[int, Selector]:
    configs = plc.configs[: len(plc.loops)]
    barrier = {slot for c in configs for slot in (c.pv_slot, c.sp_slot)}
    outs = {c.out_slot for c in configs}
    readers: dict[int, list[int]] = defaultdict(list)
    for i, c in enumerate(configs):
        for slot in influence.reached_signals([c.out_slot], excluded=barrier | (outs - {c.out_slot})) - {c.out_slot}:
            readers[slot].append(i)
    kinds = {block.name: block.type for block in getattr(config, "blocks", ())}
    selectors: dict[int, Selector] = {}
    for slot, loops in readers.items():
        block = plc.signals[slot].partition(".")[0] if slot < len(plc.signals) else ""
        if len(loops) > 1 and "Select" in kinds.get(block, "") and plc.signals[slot].endswith(".MV"):
            selector = Selector(plc.signals[slot], LARGER_MARK in kinds[block], loops[0])
            selectors |= dict.fromkeys(loops, selector)
    return selectors


# --- What is planned for each loop: where it rests, how far it is moved, and the plant that suits its gains -----------
#
# PV and output are shares of their ranges here, so that every PLC's loops are planned alike; `pidcfg.study.draft_plan`
# turns them into the units of the signals.

D740 = Decision(
    740,
    "a drafted plant is one that the loop's own gains suit",
    "First order with a dead time of a sample, a gain of about 1.2 spans of the PV for the whole output, and a time "
    "constant with which the loop crosses over as in D304. It rests at the configured set point with the output in the "
    "middle of its limits; where the set point is none that the loop can rest at, it is set at the start. A dead band, "
    "and what a loop without an integral leaves of its step, 1 / (1 + gain of loop and plant), are its `tolerance`, "
    "with 2 % of the range beside them.",
    "A file says nothing of its process. A loop that is tuned at all is well damped on such a plant, so that a failed "
    "verdict is the configuration's doing; what the real process does only its own numbers tell.",
)
WANTED_GAIN = 1.2
"""Gain of a plant where the loop's gain allows it: the output covers the range of the PV, and a little more."""
SETPOINT_STEP, SMALL_STEP = 0.1, 0.03
"""Step of a set point, as a share of the range; of a loop whose gains are not known and that may leave an offset."""
SETTLED_SHARE = 0.02
"""Of the range, how near to its set point a PV comes to rest, its own offset aside."""
STEP_PER_BAND = 3.0
"""Times its own offset and that, the least step of a loop with a dead band: a smaller one does not move it."""
MIN_STEP = 0.004
"""A smaller one shows nothing."""
STEP_SHARE = 0.5
"""Of the way to a limit of the set point or an alarm, what a step may take: the PV may overshoot it."""
OUTPUT_SHARE = 0.6
"""Of the way from rest to a limit, what the output may take for a step in the end."""
WATCHED_TIME = 9.0
"""Times 1/crossover for which a change is watched, at least."""
DISTURBANCE_SHARE = 0.1
"""Of the output's range, what a disturbance asks of it."""
DESELECTED_SHARE = 0.12
"""How far a PV lies from the set point of a loop that a selector leaves out, as a share of the range."""
INNER_LOOP_DELAY = 3.0
"""Times 1/crossover by which an inner loop delays its master."""
ON_OFF_GAIN, ON_OFF_SAMPLES = 0.6, 400
"""Gain of the plant of an on-off loop, and its time constant in samples."""
UNKNOWN_GAIN, UNKNOWN_SAMPLES = 1.0, 50
"""The same for a loop whose gains no neutral form has."""


@frozen
class LoopPlan:
    """One loop; shares of the ranges, s."""

    i: int
    name: str
    sample_time: float
    gain: float
    """PV for the whole output, with its sign."""
    time_constant: float
    watched_time: float
    """How long a change is watched."""
    rest_pv: float
    output: float
    limits: tuple[float, float]
    """Of the output."""
    step: float = 0.0
    """0: its set point is not moved."""
    disturbance: float = 0.0
    """Of the output; 0: nothing disturbs it."""
    crossover: float = 0.0
    integrates: bool = True
    is_on_off: bool = False
    needs_setpoint: bool = False
    """Whether its set point is given to it at the start."""
    selector: Selector | None = None
    neutral_loop: Loop | None = None
    dead_band: float = 0.0
    """Its dead band."""
    loop_gain: float = 0.0
    """Of a loop without an integral: by how much it opposes an error, the gain of loop and plant together."""

    @property
    def sign(self) -> float:
        """1 where the PV rises with the output, else -1."""
        return 1.0 if self.gain > 0 else -1.0


def make_plans(
    plc: Plc, neutral: Sequence[Loop | None], connections: Connections, output_raises_pv: Sequence[bool]
) -> list[LoopPlan]:
    """The plan of each loop that is calculated; slaves first, since their masters wait for them.

    ``output_raises_pv``: by loop, whether its plant's PV rises with the output.
    """
    plans: dict[int, LoopPlan] = {}

    def plan_loop(i: int) -> None:
        if i in plans:
            return
        slaves = [j for j in connections.slaves(i) if j != i and not plc.configs[j].halt]
        for j in slaves:
            if j not in visited:
                visited.add(j)
                plan_loop(j)
        inner = sum(INNER_LOOP_DELAY / plans[j].crossover for j in slaves[:1] if j in plans)
        plans[i] = _plan_loop(plc, i, neutral[i], connections, inner, 1.0 if output_raises_pv[i] else -1.0)

    visited: set[int] = set()
    for i in range(len(plc.loops)):
        if not plc.configs[i].halt:
            plan_loop(i)
    for i in sorted(plans, key=lambda i: len(_masters_of(i, connections))):
        _adapt_plan(plans, connections, plc, i)
    return [plans[i] for i in sorted(plans)]


def _masters_of(i: int, connections: Connections) -> list[int]:
    """The masters of a loop, up to the first."""
    masters: list[int] = []
    while i in connections.masters and connections.masters[i] not in masters:
        i = connections.masters[i]
        masters.append(i)
    return masters


def _plan_loop(plc: Plc, i: int, loop: Loop | None, connections: Connections, lag: float, sign: float) -> LoopPlan:
    """A loop by itself, ``lag`` s behind its slave; ``sign`` of its plant."""
    sample = plc.configs[i].period / TICKS
    name, selector = plc.loops[i], connections.selectors.get(i)
    if plc.is_on_off(i):
        time = ON_OFF_SAMPLES * sample
        rest_pv, is_set = _find_rest(plc, i, (0.1, 0.9))
        return LoopPlan(
            i, name, sample, sign * ON_OFF_GAIN, time, 4 * time, rest_pv, 0.0, (0.0, 1.0), crossover=1 / time,
            integrates=False, is_on_off=True, needs_setpoint=is_set,
        )  # fmt: skip
    integrates = plc.integrates(i, plc.signal_values)
    if loop is None:
        time = UNKNOWN_SAMPLES * sample + lag
        crossover, gain, limits, output, bounds = 1 / time, UNKNOWN_GAIN, (0.0, 1.0), 0.5, (0.05, 0.95)
        length = 10 * time
    else:
        delay = 2 * sample + float(loop.pv.filter) + lag
        crossover, gain, time = dynamics(loop, sample, delay, WANTED_GAIN)
        limits = output_limits(loop)
        output = middle_output(loop, limits)
        low, high = (float(end) for end in loop.pv.range)
        bottom, top = quiet_range(loop)
        bounds = (bottom - low) / (high - low), (top - low) / (high - low)
        length = max(WATCHED_TIME / crossover, 2 * float(loop.tuning.integral_time), 10 * sample)
    rest_pv, is_set = _find_rest(plc, i, bounds, loop)
    low, high, _ = plc.scales[i]
    root_zero = plc.root_zeros[i] if plc.root_zeros else None
    dead_band = plc.dead_band(i, plc.signal_values) / abs(high - low) if root_zero is None else 0.0
    plan = LoopPlan(
        i, name, sample, sign * gain, time, length, rest_pv, output, limits, crossover=crossover, integrates=integrates,
        needs_setpoint=is_set, selector=selector, neutral_loop=loop, dead_band=dead_band,
        disturbance=DISTURBANCE_SHARE if integrates else 0.0,
        loop_gain=0.0 if integrates or loop is None else crossover * time,
    )  # fmt: skip
    return replace(plan, step=_step_size(plan, bounds))


def _find_rest(plc: Plc, i: int, bounds: tuple[float, float], loop: Loop | None = None) -> tuple[float, bool]:
    """Where a loop rests, and whether it must be brought there: its set point is none it can rest at."""
    low, high, _ = plc.scales[i]
    if loop is not None and loop.setpoint.value is not None:
        bottom, top = loop.pv.range
        share = float((loop.setpoint.value - bottom) / (top - bottom))
    else:
        share = (plc.given_set_point(i, plc.signal_values) - low) / (high - low)
        share = max(share, 0.0) ** 0.5 if plc.root_zeros and plc.root_zeros[i] is not None else share
    return (share, False) if bounds[0] <= share <= bounds[1] else ((bounds[0] + bounds[1]) / 2, True)


def _step_size(plan: LoopPlan, bounds: tuple[float, float]) -> float:
    """How far the set point goes: to the side that has more room, and no further than the output can follow."""
    more, less = plan.limits[1] - plan.output, plan.output - plan.limits[0]
    reach = OUTPUT_SHARE * abs(plan.gain)
    up = min(STEP_SHARE * (bounds[1] - plan.rest_pv), reach * (more if plan.sign > 0 else less))
    down = min(STEP_SHARE * (plan.rest_pv - bounds[0]), reach * (less if plan.sign > 0 else more))
    max_step = max(SETPOINT_STEP, STEP_PER_BAND * (plan.dead_band + SETTLED_SHARE)) if plan.dead_band else SETPOINT_STEP
    max_step = max_step if plan.integrates or plan.loop_gain else SMALL_STEP
    size = min(max_step, max(up, down))
    return 0.0 if size < MIN_STEP else size if up >= size else -size


def _adapt_plan(plans: dict[int, LoopPlan], connections: Connections, plc: Plc, i: int) -> None:
    """Brings a loop in line with those it hangs on: its master, the loop that shares its PV, or that has its valve."""
    plan = plans[i]
    master = plans.get(connections.masters.get(i, -1))
    slave = next((plans[j] for j in connections.slaves(i) if j in plans), None)
    if slave is not None and plan.neutral_loop is not None and slave.neutral_loop is not None:
        low, high = (float(end) for end in slave.neutral_loop.pv.range)
        ends = [(end - low) / (high - low) for end in map(float, quiet_range(slave.neutral_loop))]
        inner = max(plan.limits[0], ends[0]), min(plan.limits[1], ends[1])
        if inner[0] < inner[1] and plan.integrates:
            plan = replace(plan, output=(inner[0] + inner[1]) / 2)
        plan = replace(plan, step=_limit_size(plan.step, OUTPUT_SHARE * abs(plan.gain) * (inner[1] - inner[0]) / 2))
    if master is not None:
        plan = replace(plan, rest_pv=master.output, step=0.0, disturbance=0.0, needs_setpoint=False)
    elif i in connections.given_signals:
        low, high, _ = plc.scales[i]
        plan = replace(plan, step=0.0, needs_setpoint=False)
    leader = plans.get(connections.leaders.get(i, -1))
    if leader is not None:
        plan = replace(
            plan,
            rest_pv=leader.rest_pv,
            step=0.0,
            disturbance=0.0,
            needs_setpoint=False,
            output=_driven_output(plan, leader.rest_pv),
        )
    if plan.selector is not None and plan.selector.first != i:
        first = plans[plan.selector.first]
        asks_more = -1.0 if plan.selector.takes_larger else 1.0
        moved = abs(first.step / first.gain) + DISTURBANCE_SHARE
        plan = replace(plan, gain=plan.sign * min(abs(plan.gain), DESELECTED_SHARE / 2 / moved))
        plan = replace(
            plan,
            rest_pv=plan.rest_pv - asks_more * plan.sign * DESELECTED_SHARE,
            step=0.0,
            disturbance=0.0,
            output=first.output,
            needs_setpoint=False,
        )
    plans[i] = plan


def _driven_output(plan: LoopPlan, pv: float) -> float:
    """The output of a loop whose PV another one holds at a value: at the limit to which its error drives it."""
    error = (plan.rest_pv - pv) * plan.sign
    return plan.output if not error else plan.limits[1] if error > 0 else plan.limits[0]


def _limit_size(step: float, max_size: float) -> float:
    return max(min(step, max_size), -max_size)


# ----------------------------------------------------------------------------------------------------------------------
# The planned loops as a scenario: plants in the units of their signals, what happens and when, what is expected.

MAX_LOOP_STEPS = 200_000
"""Base steps times loops of a drafted run: some seconds."""
LEAD_SHARE = 0.1
"""Of each half of a run, what passes before the disturbances of the first; the steps begin the second."""
NON_NAME_SIGNS = re.compile(r"[^\w.-]")

Row = dict[str, Any]


@frozen
class Line:
    """An entry of a list or a mapping of the scenario, with what stands behind it as a comment."""

    data: Row
    comment: str = ""
    key: str = ""


@dataclass(slots=True)
class DraftParts:
    """A scenario in its parts."""

    duration: float
    step: float | None = None
    initial: str | dict[str, float] = "steady"
    plants: list[Line] = field(default_factory=list)
    connect: list[Line] = field(default_factory=list)
    events: list[Line] = field(default_factory=list)
    expect: list[Line] = field(default_factory=list)
    allow: list[Line] = field(default_factory=list)
    tolerance: list[Line] = field(default_factory=list)
    """How far from its set point a loop may come to rest by its own configuration."""
    assumed_signs: tuple[str, ...] = ()
    """Loops whose plant has the sign of their own action."""
    remarks: list[str] = field(default_factory=list)
    """What there is to know about single loops."""

    def scenario_data(self, title: str, config: str) -> Row:
        """The scenario as plain data."""
        data: Row = {"pidcfg": 1, "scenario": title, "config": config, "duration": self.duration}
        data |= {"initial": self.initial} if self.initial else {}
        if self.connect:
            data["plants"] = [{"name": line.key, **line.data} for line in self.plants]
            data["connect"] = {line.key: line.data["to"] for line in self.connect}
        else:
            data["plants"] = {line.key: line.data for line in self.plants}
        if self.tolerance:
            data["tolerance"] = {line.key: line.data["of"] for line in self.tolerance}
        if self.assumed_signs:
            data["assumed_signs"] = list(self.assumed_signs)
        for part in ("events", "expect", "allow"):
            lines: list[Line] = getattr(self, part)
            if lines:
                data[part] = [line.data for line in lines]
        return data


@frozen
class PlanUnits:
    """The plans in the units of the signals."""

    plc: Plc
    plans: Mapping[int, LoopPlan]
    connections: Connections

    def pv_value(self, plan: LoopPlan, share: float) -> float:
        """A PV in the unit of its signal."""
        low, high, _ = self.plc.scales[plan.i]
        return low + share * (high - low)

    def setpoint_value(self, plan: LoopPlan, share: float) -> float:
        """A set point as the loop takes it."""
        value = rounded_value(self.pv_value(plan, share), self.pv_span(plan))
        return round(value) if is_whole(self.plc, plan.i, "setpoint", self.plc.scales[plan.i][0]) else value

    def pv_span(self, plan: LoopPlan) -> float:
        """Width of the PV's range."""
        low, high, _ = self.plc.scales[plan.i]
        return high - low

    def output_value(self, plan: LoopPlan, share: float) -> float:
        """An output in the unit of its signal."""
        low, high = self.output_scale(plan)
        value = rounded_value(low + share * (high - low), high - low)
        return round(value) if is_whole(self.plc, plan.i, "output", low) else value

    def output_scale(self, plan: LoopPlan) -> tuple[float, float]:
        """What the output's signal shows at 0 % and 100 %."""
        return (0.0, 1.0) if plan.is_on_off else output_scale(self.plc, plan.i, plan.neutral_loop)

    def is_rooted(self, plan: LoopPlan) -> bool:
        """Whether the loop takes the root of its PV."""
        return bool(self.plc.root_zeros) and self.plc.root_zeros[plan.i] is not None

    def plant_name(self, plan: LoopPlan) -> str:
        """The name of a loop's plant: the loop's own, unless its signal has to be wired to the PV."""
        apart = self.is_rooted(plan) or plan.name in self.plc.wired_loops or self.followers(plan)
        return plan.name if not apart else f"{NON_NAME_SIGNS.sub('_', plan.name)}_process"

    def followers(self, plan: LoopPlan) -> list[LoopPlan]:
        """The loops that share the PV of one."""
        return [self.plans[i] for i, leader in self.connections.leaders.items() if leader == plan.i and i in self.plans]

    def plant_signal(self, plan: LoopPlan) -> str:
        """The signal of a loop's plant, in an expression."""
        name = self.plant_name(plan)
        return f"{name}.PV" if name == plan.name else name


def make_draft(units: PlanUnits, size: float = 1.0, *, steady: bool = True, length: int = 1) -> DraftParts:
    """The course with steps and disturbances of so much of their planned size, ``length`` times as long as planned."""
    plans = list(units.plans.values())
    base = units.plc.base_ticks / TICKS
    half = round_up_time(length * max((plan.watched_time for plan in plans), default=10 * base))
    max_half = MAX_LOOP_STEPS * base / max(len(plans), 1) / 2
    draft = DraftParts(0.0)
    if half > max_half:
        shorter = round_up_time(max_half) / 2
        draft.remarks.append(f"{time_text(2 * shorter)} is short for the slowest loop: {time_text(2 * half)} would do")
        half = shorter
    draft.duration = round_to_digits(2 * half)
    in_control = all(units.plc.initial_modes[plan.i] in CONTROL_MODES and not plan.is_on_off for plan in plans)
    draft.initial = "steady" if steady and in_control else _initial_outputs(units)
    for plan in plans:
        _add_plant(units, plan, draft)
    draft.tolerance = list(_tolerance_lines(units, size))
    draft.events = [
        *_start_events(units, draft),
        *_disturbance_events(units, round_to_digits(LEAD_SHARE * half), size),
        *_setpoint_events(units, half, size),
    ]
    return draft


def _tolerance_lines(units: PlanUnits, size: float) -> Iterator[Line]:
    """What each loop leaves of an error by its dead band, or without an integral, and what is left beside it."""
    for plan in units.plans.values():
        span, step = units.pv_span(plan), abs(plan.step * size)
        offset = step / (1 + plan.loop_gain) if plan.loop_gain else 0.0
        reasons = [f"its dead band is {round_to_digits(plan.dead_band * span, 3):g}"] * bool(plan.dead_band)
        if offset:
            share_text = f"{round_to_digits(offset * span, 3):g} of a step of {round_to_digits(step * span, 3):g}"
            reasons.append(f"without an integral it leaves {share_text}")
        if reasons:
            of = round_to_digits((SETTLED_SHARE + plan.dead_band + offset) * span, 3)
            yield Line({"of": of}, f"{' and '.join(reasons)}; and 2 % of the range", plan.name)


def _initial_outputs(units: PlanUnits) -> dict[str, float]:
    """The output that each loop rests at, or the one it has in Manual."""
    return {plan.name: units.output_value(plan, plan.output) for plan in units.plans.values() if not plan.is_on_off}


def _add_plant(units: PlanUnits, plan: LoopPlan, draft: DraftParts) -> None:
    """The plant of a loop, and what is wired to its PV; a loop that shares another one's PV has none of its own."""
    name, plc = units.plant_name(plan), units.plc
    leader = units.plans.get(units.connections.leaders.get(plan.i, -1))
    inlet = plc.pv_inputs.get(plan.name, f"{plan.name}.PV")
    if leader is not None:
        if plan.name not in plc.wired_loops:
            draft.connect.append(Line({"to": units.plant_signal(leader)}, f"the same PV as {leader.name}", inlet))
        return
    if plan.name in plc.wired_loops and plan.name not in plc.pv_inputs:
        draft.remarks.append(f"{plan.name} has no plant: the program works its PV out of several signals")
        return
    pv_at_rest = units.pv_value(plan, plan.rest_pv)
    text, gain, u = _plant_input(units, plan)
    others_input = 0.0
    for other in units.followers(plan):
        more, factor, out = _plant_input(units, other)
        share = round_to_digits(factor / gain)
        times = "" if abs(share) == 1 else f"{round_to_digits(abs(share))} * "
        text = (
            f"{text or _output_of(units, plan)} {'+' if share > 0 else '-'} {times}{more or _output_of(units, other)}"
        )
        others_input += share * out
    gain = round_to_digits(gain)
    row: Row = {"model": "first_order"} | ({"input": text} if text or name != plan.name else {})
    if "input" in row and not row["input"]:
        row["input"] = _output_of(units, plan)
    load = pv_at_rest - gain * (u + others_input)
    row |= {
        "gain": gain,
        "time_constant": round_to_digits(plan.time_constant, 3),
        "dead_time": round_to_digits(plan.sample_time, 6),
    }
    row |= {"load": round_to_digits(load, 6)} if abs(load) > 1e-9 * units.pv_span(plan) else {}
    row["initial"] = rounded_value(pv_at_rest, units.pv_span(plan))
    draft.plants.append(Line(row, _plant_comment(units, plan), name))
    if name == plan.name:
        return
    low, high, _ = plc.scales[plan.i]
    to = name
    if units.is_rooted(plan):
        zero = f" - {round_to_digits(low, 6)}" if low > 0 else f" + {round_to_digits(-low, 6)}" if low else ""
        shown = f"({name}{zero})" if zero else name
        to = f"{shown} * {shown} / {round_to_digits(high - low, 6)}" + (f" + {round_to_digits(low, 6)}" if low else "")
    comment = "the transmitter shows the square, of which the PLC takes the root" if units.is_rooted(plan) else ""
    draft.connect.append(Line({"to": to}, comment, inlet))


def _plant_input(units: PlanUnits, plan: LoopPlan) -> tuple[str, float, float]:
    """What a plant reads (empty: its loop's output), its gain, and the value at rest."""
    slave = next((units.plans[j] for j in units.connections.slaves(plan.i) if j in units.plans), None)
    if slave is not None:
        return (
            units.plant_signal(slave),
            plan.gain * units.pv_span(plan) / units.pv_span(slave),
            units.pv_value(slave, slave.rest_pv),
        )
    low, high = units.output_scale(plan)
    output = 0.5 if plan.is_on_off else plan.output
    u = low + output * (high - low) if plan.is_on_off else units.output_value(plan, output)
    text = "" if plan.selector is None else plan.selector.signal
    return text, plan.gain * units.pv_span(plan) / (high - low), u


def _output_of(units: PlanUnits, plan: LoopPlan) -> str:
    return f"{plan.name}.{units.plc.out_name}"


def _plant_comment(units: PlanUnits, plan: LoopPlan) -> str:
    slave = next((units.plans[j] for j in units.connections.slaves(plan.i) if j in units.plans), None)
    if slave is not None:
        return f"behind {slave.name}"
    if plan.selector is not None and plan.selector.first != plan.i:
        return f"{plan.selector.signal} leaves it out"
    if plan.is_on_off:
        return "on and off move the PV by as much to either side"
    if units.plc.pulse_cycle(plan.i):
        return "moved by the mean of the pulses"
    return ""


def _start_events(units: PlanUnits, draft: DraftParts) -> Iterator[Line]:
    """What brings loops to where they rest: a set point, and Auto for those that begin in Manual."""
    for plan in units.plans.values():
        if plan.needs_setpoint:
            value = units.setpoint_value(plan, plan.rest_pv)
            yield Line({"at": 0, "loop": plan.name, "set": {"setpoint": value}}, "it has none that it can rest at")
    for plan in units.plans.values():
        goal = units.plc.initial_modes[plan.i]
        if goal in CONTROL_MODES:
            continue
        if units.plc.mode_inputs(plan.i):
            draft.remarks.append(f"{plan.name} stays in {goal}: the program chooses its mode")
        else:
            yield Line({"at": 0, "loop": plan.name, "mode": "auto"}, f"configured: {goal}")


def _setpoint_events(units: PlanUnits, time: float, size: float) -> Iterator[Line]:
    """Steps of the set points, and of the signals that the program makes set points of."""
    for plan in units.plans.values():
        if plan.step and size:
            value = units.setpoint_value(plan, plan.rest_pv + plan.step * size)
            before = units.setpoint_value(plan, plan.rest_pv)
            if value != before:
                yield Line({"at": time, "loop": plan.name, "set": {"setpoint": value}}, f"from {before:g}")
    readers: dict[str, list[str]] = {}
    for i, signal in units.connections.given_signals.items():
        if i in units.plans:
            readers.setdefault(signal, []).append(units.plans[i].name)
    for name, loops in readers.items() if size else ():
        step = input_step(units.plc, name)
        if step is not None:
            yield Line(
                {"at": time, "set": {name: step[1]}}, f"from {step[0]:g}; it moves the set point of {', '.join(loops)}"
            )


def _disturbance_events(units: PlanUnits, time: float, size: float) -> Iterator[Line]:
    """Disturbances: the load of each plant as if its output had moved."""
    for plan in units.plans.values():
        if (
            not plan.disturbance
            or not size
            or (plan.name in units.plc.wired_loops and plan.name not in units.plc.pv_inputs)
        ):
            continue
        moved = plan.disturbance * size * plan.gain * units.pv_span(plan)
        gain, u = _plant_input(units, plan)[1:]
        load = round_to_digits(units.pv_value(plan, plan.rest_pv) - round_to_digits(gain) * u - moved, 6)
        name = units.plant_name(plan)
        target = {"loop": name} if name == plan.name else {"plant": name}
        share = f"asks for {abs(plan.disturbance * size):.0%} more output".replace("%", " %")
        yield Line({"at": time, **target, "disturb": {"load": load}}, share)
