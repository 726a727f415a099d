"""Neutral loops as a NextoPID program: PIDA_REAL blocks, with filters and pulses beside them."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, independent, number, product, quotient
from pidcfg.conversion.builder import TargetBuilder, target_file
from pidcfg.conversion.from_neutral.nextopid_cascade import link
from pidcfg.conversion.from_neutral.nextopid_names import Names
from pidcfg.conversion.from_neutral.nextopid_task import Task, task_of
from pidcfg.conversion.operation.rules import Manual
from pidcfg.conversion.same import Same, same, take
from pidcfg.conversion.to_neutral.nextopid import HELD
from pidcfg.conversion.unmatched import ALARMS, unmatched
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL, Controller, PidaReal
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.conversion.ledger import TargetFile
    from pidcfg.conversion.operation.rules import Operation
    from pidcfg.conversion.same import Table
    from pidcfg.schemas.generic import GenericFile, Loop

D294 = Decision(
    294,
    "without a set point a NextoPID loop gets the one at which its output is least",
    "SP is MinPV where the PV rises with the output, else MaxPV; reported as assumed.",
    "SP must be given. A loop that nobody has given a set point must not open its valve.",
)
KEYS = (
    "name",
    "type",
    "description",
    "sample_time",
    *(key for key in PidaReal.model_fields if key not in Controller.model_fields and key != "type"),
    "pv",
    "output",
)
"""In the order of the file."""
PERIODS = (1, 0xFFFF)
"""Cycles of a ControlPWM's period."""
ROUGH = 100
"""Steps of a pulse output below which the report says how to get more."""
COMPARE = "compare PV in the program"
BY_PROGRAM = {
    "pv.square_root": "wire PV to an expression with sqrt",
    "output.pulse.min_on": "drop shorter pulses in the program, behind ControlPWM",
    "output.pulse.min_off": "fill shorter gaps in the program, behind ControlPWM",
    **dict.fromkeys(ALARMS, COMPARE),
}
"""Neutral fields that the blocks do not have, with what to program instead."""
HOLDS = "the output stays on the way to manual, as figure 16-1 has it"
FOLLOWS = "a move, as figure 16-1 has it: the set point follows the PV all the time in manual"
WINDUP = "the blocks never integrate further into MinMV, MaxMV or MaxVarMV"


@dataclass(slots=True)
class Program:
    """What stands beside the loops."""

    task: Task
    names: Names = field(default_factory=Names)
    signals: dict[str, Any] = field(default_factory=dict)
    blocks: list[dict[str, Any]] = field(default_factory=list)
    moves: list[dict[str, Any]] = field(default_factory=list)

    def add(self, block: dict[str, Any]) -> str:
        """Adds a block; returns its path in the file."""
        self.blocks.append(block)
        return f"/blocks.{len(self.blocks) - 1}"


@dataclass(frozen=True, slots=True)
class NextopidLoop:
    """A neutral loop, and the program that it goes into."""

    neutral: Loop
    name: str
    """The instance of its block."""
    program: Program

    @property
    def cycles(self) -> int:
        """The loop runs in every n-th cycle of the task."""
        return self.program.task.cycles(self.neutral.sample_time)

    @property
    def time(self) -> Decimal:
        """The loop's interval in s: a multiple of the task's, as near as can be."""
        return product(self.program.task.interval, Decimal(self.cycles))


def from_neutral(
    file: GenericFile,
    options: Mapping[str, Any],
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """A NextoPID file with these loops."""
    program = Program(task_of([loop.sample_time for loop in file.loops], options.get("sample_time")))
    builders = []
    for i, loop in enumerate(file.loops):
        name = program.names.new(loop.name)
        b = TargetBuilder(i, {"name": name, "type": "PIDA_REAL"})
        if name != loop.name:
            b.mark("name", "name", "an identifier of IEC 61131-3, unique without regard to capitals", assumed=True)
        builders.append(b)
    for b, loop in zip(builders, file.loops, strict=True):
        take(b, loop, NextopidLoop(loop, b.data["name"], program), FIELDS)
    link(file, builders)
    for i, (b, loop) in enumerate(zip(builders, file.loops, strict=True)):
        stays = bool(operations) and operations[i].manual is Manual.STAYS
        program.moves += bumpless(b, loop, len(program.moves), stays=stays)
    for b in builders:
        b.data = {key: b.data[key] for key in KEYS if key in b.data}
    plc = {"sample_time": number(program.task.interval)}
    target = target_file("nextopid", file, builders, plc=plc, signals=program.signals, blocks=program.blocks)
    target.data |= {"moves": program.moves} if program.moves else {}
    return target


def bumpless(b: TargetBuilder, loop: Loop, first: int, *, stays: bool) -> list[dict[str, Any]]:
    """The moves of figure 16-1: MV into ManualMV in automatic, PV into SP in manual."""
    name, moves = b.data["name"], []
    if stays:
        moves.append({"move": f"{name}.MV", "to": f"{name}.ManualMV", "when": f"NOT {name}.Manual"})
        b.mark(f"/moves.{first}.move", None, HOLDS)
    if loop.setpoint.follows_pv:
        b.mark(f"/moves.{first + len(moves)}.move", "setpoint.follows_pv", FOLLOWS)
        moves.append({"move": f"{name}.PV", "to": f"{name}.SP", "when": f"{name}.Manual"})
    return moves


def _time(b: TargetBuilder, n: NextopidLoop) -> None:
    wanted, task = n.neutral.sample_time, n.program.task
    where, note = "/plc.sample_time", ""
    if n.time != task.interval:
        where, note = "sample_time", f"every {n.cycles} cycles of the task"
        b.data["sample_time"] = number(n.time)
    b.mark(where, "sample_time", note, exact=wanted, clamped=not task.holds(wanted))


def _direction(b: TargetBuilder, n: NextopidLoop) -> None:
    b.put("Direct", not n.neutral.output_raises_pv, "output_raises_pv")
    if n.neutral.mode != "cascade":
        b.put("Manual", n.neutral.mode == "manual", "mode")


def _setpoint(b: TargetBuilder, n: NextopidLoop) -> None:
    setpoint, span = n.neutral.setpoint, n.neutral.pv.range
    if setpoint.value is None:
        note = "nothing says the set point: at this one the output is least"
        b.put("SP", span[not n.neutral.output_raises_pv], None, note)
    else:
        b.put("SP", setpoint.value, "setpoint.value")
    if setpoint.limits is None:
        return
    for i, (end, key, inside) in enumerate(zip(setpoint.limits, ("MinPV", "MaxPV"), (1, -1), strict=True)):
        if (end - span[i]) * inside > 0:
            b.drop(f"setpoint.limits.{i}", f"{key} limits the PV too: limit SP in the program")
        else:
            b.mark(key, f"setpoint.limits.{i}", "" if end == span[i] else f"{key} limits the set point")


def _equation(b: TargetBuilder, n: NextopidLoop) -> None:
    """The dependent form; the independent one where an integral time would count as none."""
    tuning = n.neutral.tuning
    gain, integral, derivative, acts = tuning.gain, tuning.integral_time, tuning.derivative_time, tuning.proportional
    form = ""
    if ZERO < integral < SHORTEST_INTEGRAL:
        form = f"a gain (Indep TRUE): below {SHORTEST_INTEGRAL} s an integral time counts as none"
        b.data["Indep"] = True
        integral, derivative = independent(gain, integral, derivative)
        b.put("Kp", gain if acts else 0, "tuning.gain")
        b.mark("Kp", "tuning.proportional")
    else:
        b.put("Kp", gain, "tuning.gain")
        b.put("DisableP", not acts, "tuning.proportional")
    b.put("Ti_Ki", integral, "tuning.integral_time", form)
    b.put("Td_Kd", derivative, "tuning.derivative_time")
    b.put("DerivEr", tuning.derivative_on == "error", "tuning.derivative_on")


def _pv_filter(b: TargetBuilder, n: NextopidLoop) -> None:
    """A low-pass filter before the loop."""
    time, program = n.neutral.pv.filter, n.program
    if time:
        signal, block = program.names.new(n.name, "_IN"), program.names.new(n.name, "_FILTER")
        program.signals[signal] = b.data["SP"]
        path = program.add({"name": block, "type": "ControlLowFilter", "InVar": signal, "Tc": number(time)})
        b.mark(f"{path}.Tc", "pv.filter", f"{block}, a block before PV")
        b.put("PV", f"{block}.OutVar", None, f"{signal} is the PV before its filter: assign it to the analog input")


def _limits(b: TargetBuilder, n: NextopidLoop) -> None:
    low, high = n.neutral.output.limits or n.neutral.output.range
    b.put("MinMV", low, "output.limits.0")
    b.put("MaxMV", high, "output.limits.1")


def _manual(b: TargetBuilder, n: NextopidLoop) -> None:
    output = n.neutral.output
    low, high = output.limits or output.range
    if output.manual is not None:
        b.put("ManualMV", output.manual, "output.manual")
    elif n.neutral.mode == "manual":
        b.put("ManualMV", min(max(ZERO, low), high), None, "nothing says the output in manual")


def _max_rate(b: TargetBuilder, n: NextopidLoop) -> None:
    rate = n.neutral.output.max_rate
    if rate is None:
        return
    step = product(rate, n.time)
    if step:
        b.put("MaxVarMV", step, "output.max_rate", f"per cycle of {decimal_text(n.time)} s", exact=step)
    else:
        b.drop("output.max_rate", "MaxVarMV 0 is no limit: put the loop into manual to hold its output")


def _pulses(b: TargetBuilder, n: NextopidLoop) -> None:
    """A ControlPWM behind the loop."""
    pulse, interval = n.neutral.output.pulse, n.program.task.interval
    if pulse is None:
        return
    wanted = quotient(pulse.period, interval)
    period = min(max(nearest(wanted), PERIODS[0]), PERIODS[1])
    name = n.program.names.new(n.name, "_PWM")
    low, high = (number(end) for end in n.neutral.output.range)
    block = {"name": name, "type": "ControlPWM", "MV": f"{n.name}.MV", "MaxMV": high, "MinMV": low, "Period": period}
    path = n.program.add(block)
    note = f"{name}, in cycles of the task of {decimal_text(interval)} s"
    if period < ROUGH:
        note += f": the output has {period} steps; a shorter interval (--sample-time) gives more"
    clamped = not PERIODS[0] <= nearest(wanted) <= PERIODS[1]
    b.mark(f"{path}.Period", "output.pulse.period", note, exact=wanted, clamped=clamped)


def _without_place(b: TargetBuilder, n: NextopidLoop) -> None:
    if not n.neutral.anti_windup:
        b.mark("anti_windup", "anti_windup", WINDUP, assumed=True)
    b.drop_all(unmatched(n.neutral, BY_PROGRAM))


FIELDS: Table[TargetBuilder, NextopidLoop] = (
    Same("description"),
    _time,
    _direction,
    _setpoint,
    _equation,
    Same("tuning.derivative_filter", "Tfd", if_on=True),
    Same("pv.range.0", "MinPV"),
    Same("pv.range.1", "MaxPV"),
    Same("pv.unit"),
    _pv_filter,
    _limits,
    *same("output.range", "output.unit"),
    Same("output.bias", "BIAS", if_on=True),
    _manual,
    _max_rate,
    _pulses,
    Same("deadband", "DeadBand", if_on=True, note=HELD),
    _without_place,
)
"""Every field in the order of the report."""
