"""The planned loops as a scenario: plants in the units of their signals, what happens and when, what is expected."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.draft.numbers import digits, neat, round_up, time_text
from pidcfg.draft.surroundings import step_of
from pidcfg.sim.loop_facts import IN_CONTROL
from pidcfg.sim.plc import TICKS
from pidcfg.verification.names import is_whole, output_scale

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.draft.loops import LoopPlan
    from pidcfg.draft.surroundings import Surroundings
    from pidcfg.sim.plc import Plc

MOST_STEPS = 200_000
"""Base steps times loops of a drafted run: some seconds."""
LEAD = 0.1
"""Of each half of a run, what passes before the disturbances of the first; the steps begin the second."""
NO_WORD = re.compile(r"[^\w.-]")

Row = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Line:
    """An entry of a list or a mapping of the scenario, with what stands behind it as a comment."""

    data: Row
    comment: str = ""
    key: str = ""


@dataclass(slots=True)
class Course:
    """A scenario in its parts."""

    duration: float
    step: float | None = None
    initial: str | dict[str, float] = "steady"
    plants: list[Line] = field(default_factory=list)
    connect: list[Line] = field(default_factory=list)
    events: list[Line] = field(default_factory=list)
    expect: list[Line] = field(default_factory=list)
    allow: list[Line] = field(default_factory=list)
    remarks: list[str] = field(default_factory=list)
    """What there is to know about single loops."""

    def data(self, title: str, config: str) -> Row:
        """The scenario as plain data."""
        data: Row = {"pidcfg": 1, "scenario": title, "config": config, "duration": self.duration}
        data |= {"initial": self.initial} if self.initial else {}
        if self.connect:
            data["plants"] = [{"name": line.key, **line.data} for line in self.plants]
            data["connect"] = {line.key: line.data["to"] for line in self.connect}
        else:
            data["plants"] = {line.key: line.data for line in self.plants}
        for part in ("events", "expect", "allow"):
            lines: list[Line] = getattr(self, part)
            if lines:
                data[part] = [line.data for line in lines]
        return data


@dataclass(frozen=True, slots=True)
class Units:
    """The plans in the units of the signals."""

    plc: Plc
    plans: Mapping[int, LoopPlan]
    around: Surroundings

    def pv(self, plan: LoopPlan, share: float) -> float:
        """A PV in the unit of its signal."""
        low, high, _ = self.plc.scales[plan.i]
        return low + share * (high - low)

    def setpoint(self, plan: LoopPlan, share: float) -> float:
        """A set point as the loop takes it."""
        value = neat(self.pv(plan, share), self.span(plan))
        return round(value) if is_whole(self.plc, plan.i, "setpoint", self.plc.scales[plan.i][0]) else value

    def span(self, plan: LoopPlan) -> float:
        """Width of the PV's range."""
        low, high, _ = self.plc.scales[plan.i]
        return high - low

    def output(self, plan: LoopPlan, share: float) -> float:
        """An output in the unit of its signal."""
        low, high = self.scale(plan)
        value = neat(low + share * (high - low), high - low)
        return round(value) if is_whole(self.plc, plan.i, "output", low) else value

    def scale(self, plan: LoopPlan) -> tuple[float, float]:
        """What the output's signal shows at 0 % and 100 %."""
        return (0.0, 1.0) if plan.switches else output_scale(self.plc, plan.i, plan.neutral)

    def is_rooted(self, plan: LoopPlan) -> bool:
        """Whether the loop takes the root of its PV."""
        return bool(self.plc.roots) and self.plc.roots[plan.i] is not None

    def process(self, plan: LoopPlan) -> str:
        """The name of a loop's plant: the loop's own, unless its signal has to be wired to the PV."""
        apart = self.is_rooted(plan) or plan.name in self.plc.wired or self.followers(plan)
        return plan.name if not apart else f"{NO_WORD.sub('_', plan.name)}_process"

    def followers(self, plan: LoopPlan) -> list[LoopPlan]:
        """The loops that share the PV of one."""
        return [self.plans[i] for i, leader in self.around.leaders.items() if leader == plan.i and i in self.plans]

    def measured(self, plan: LoopPlan) -> str:
        """The signal of a loop's plant, in an expression."""
        name = self.process(plan)
        return f"{name}.PV" if name == plan.name else name


def course_of(units: Units, size: float = 1.0, *, steady: bool = True) -> Course:
    """The course with steps and disturbances of so much of their planned size."""
    plans = list(units.plans.values())
    base = units.plc.base / TICKS
    half = round_up(max((plan.length for plan in plans), default=10 * base))
    most = MOST_STEPS * base / max(len(plans), 1) / 2
    course = Course(0.0)
    if half > most:
        shorter = round_up(most) / 2
        course.remarks.append(f"{time_text(2 * shorter)} is short for the slowest loop: {time_text(2 * half)} would do")
        half = shorter
    course.duration = digits(2 * half)
    in_control = all(units.plc.goals[plan.i] in IN_CONTROL and not plan.switches for plan in plans)
    course.initial = "steady" if steady and in_control else _initial(units)
    for plan in plans:
        _plant(units, plan, course)
    course.events = [*_start(units, course), *_pushes(units, digits(LEAD * half), size), *_steps(units, half, size)]
    return course


def _initial(units: Units) -> dict[str, float]:
    """The output that each loop rests at, or the one it has in Manual."""
    return {plan.name: units.output(plan, plan.output) for plan in units.plans.values() if not plan.switches}


def _plant(units: Units, plan: LoopPlan, course: Course) -> None:
    """The plant of a loop, and what is wired to its PV; a loop that shares another one's PV has none of its own."""
    name, plc = units.process(plan), units.plc
    leader = units.plans.get(units.around.leaders.get(plan.i, -1))
    inlet = plc.inlets.get(plan.name, f"{plan.name}.PV")
    if leader is not None:
        if plan.name not in plc.wired:
            course.connect.append(Line({"to": units.measured(leader)}, f"the same PV as {leader.name}", inlet))
        return
    if plan.name in plc.wired and plan.name not in plc.inlets:
        course.remarks.append(f"{plan.name} has no plant: the program works its PV out of several signals")
        return
    at_rest = units.pv(plan, plan.rest)
    text, gain, u = _input(units, plan)
    pull = 0.0
    for other in units.followers(plan):
        more, factor, out = _input(units, other)
        share = digits(factor / gain)
        times = "" if abs(share) == 1 else f"{digits(abs(share))} * "
        text = f"{text or _out(units, plan)} {'+' if share > 0 else '-'} {times}{more or _out(units, other)}"
        pull += share * out
    gain = digits(gain)
    row: Row = {"model": "first_order"} | ({"input": text} if text or name != plan.name else {})
    if "input" in row and not row["input"]:
        row["input"] = _out(units, plan)
    load = at_rest - gain * (u + pull)
    row |= {"gain": gain, "time_constant": digits(plan.time, 3), "dead_time": digits(plan.sample, 6)}
    row |= {"load": digits(load, 6)} if abs(load) > 1e-9 * units.span(plan) else {}
    row["initial"] = neat(at_rest, units.span(plan))
    course.plants.append(Line(row, _about(units, plan), name))
    if name == plan.name:
        return
    low, high, _ = plc.scales[plan.i]
    to = name
    if units.is_rooted(plan):
        zero = f" - {digits(low, 6)}" if low > 0 else f" + {digits(-low, 6)}" if low else ""
        shown = f"({name}{zero})" if zero else name
        to = f"{shown} * {shown} / {digits(high - low, 6)}" + (f" + {digits(low, 6)}" if low else "")
    comment = "the transmitter shows the square, of which the PLC takes the root" if units.is_rooted(plan) else ""
    course.connect.append(Line({"to": to}, comment, inlet))


def _input(units: Units, plan: LoopPlan) -> tuple[str, float, float]:
    """What a plant reads (empty: its loop's output), its gain, and the value at rest."""
    slave = next((units.plans[j] for j in units.around.slaves(plan.i) if j in units.plans), None)
    if slave is not None:
        return units.measured(slave), plan.gain * units.span(plan) / units.span(slave), units.pv(slave, slave.rest)
    low, high = units.scale(plan)
    output = 0.5 if plan.switches else plan.output
    u = low + output * (high - low) if plan.switches else units.output(plan, output)
    text = "" if plan.selector is None else plan.selector.signal
    return text, plan.gain * units.span(plan) / (high - low), u


def _out(units: Units, plan: LoopPlan) -> str:
    return f"{plan.name}.{units.plc.out_name}"


def _about(units: Units, plan: LoopPlan) -> str:
    slave = next((units.plans[j] for j in units.around.slaves(plan.i) if j in units.plans), None)
    if slave is not None:
        return f"behind {slave.name}"
    if plan.selector is not None and plan.selector.first != plan.i:
        return f"{plan.selector.signal} leaves it out"
    if plan.switches:
        return "on and off move the PV by as much to either side"
    if units.plc.pulse_cycle(plan.i):
        return "moved by the mean of the pulses"
    return ""


def _start(units: Units, course: Course) -> Iterator[Line]:
    """What brings loops to where they rest: a set point, and Auto for those that begin in Manual."""
    for plan in units.plans.values():
        if plan.is_set:
            value = units.setpoint(plan, plan.rest)
            yield Line({"at": 0, "loop": plan.name, "set": {"setpoint": value}}, "it has none that it can rest at")
    for plan in units.plans.values():
        goal = units.plc.goals[plan.i]
        if goal in IN_CONTROL:
            continue
        if units.plc.mode_inputs(plan.i):
            course.remarks.append(f"{plan.name} stays in {goal}: the program chooses its mode")
        else:
            yield Line({"at": 0, "loop": plan.name, "mode": "auto"}, f"configured: {goal}")


def _steps(units: Units, at: float, size: float) -> Iterator[Line]:
    """Steps of the set points, and of the signals that the program makes set points of."""
    for plan in units.plans.values():
        if plan.step and size:
            value = units.setpoint(plan, plan.rest + plan.step * size)
            before = units.setpoint(plan, plan.rest)
            if value != before:
                yield Line({"at": at, "loop": plan.name, "set": {"setpoint": value}}, f"from {before:g}")
    readers: dict[str, list[str]] = {}
    for i, given in units.around.given.items():
        if i in units.plans:
            readers.setdefault(given, []).append(units.plans[i].name)
    for name, loops in readers.items() if size else ():
        step = step_of(units.plc, name)
        if step is not None:
            yield Line(
                {"at": at, "set": {name: step[1]}}, f"from {step[0]:g}; it moves the set point of {', '.join(loops)}"
            )


def _pushes(units: Units, at: float, size: float) -> Iterator[Line]:
    """Disturbances: the load of each plant as if its output had moved."""
    for plan in units.plans.values():
        if not plan.push or not size or (plan.name in units.plc.wired and plan.name not in units.plc.inlets):
            continue
        moved = plan.push * size * plan.gain * units.span(plan)
        gain, u = _input(units, plan)[1:]
        load = digits(units.pv(plan, plan.rest) - digits(gain) * u - moved, 6)
        name = units.process(plan)
        whose = {"loop": name} if name == plan.name else {"plant": name}
        share = f"asks for {abs(plan.push * size):.0%} more output".replace("%", " %")
        yield Line({"at": at, **whose, "disturb": {"load": load}}, share)
