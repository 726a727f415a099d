"""Neutral loops as a NextoPID program: PIDA_REAL blocks, with filters and pulses beside them."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, independent, number, product, quotient
from pidcfg.conversion.builder import Builder
from pidcfg.conversion.from_neutral.nextopid_cascade import link
from pidcfg.conversion.from_neutral.nextopid_names import Names
from pidcfg.conversion.from_neutral.nextopid_task import Task, task_of
from pidcfg.conversion.ledger import Put, Target
from pidcfg.conversion.to_neutral.nextopid import HELD
from pidcfg.conversion.unmatched import ALARMS, dropped
from pidcfg.encoders.values import present
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL, Controller, PidaReal

if TYPE_CHECKING:
    from collections.abc import Mapping

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
NO_TWIN = {
    "setpoint.follows_pv": "copy PV into SP in the program while Manual is TRUE",
    "pv.square_root": "wire PV to an expression with sqrt",
    "output.pulse.min_on": "drop shorter pulses in the program, behind ControlPWM",
    "output.pulse.min_off": "fill shorter gaps in the program, behind ControlPWM",
    **dict.fromkeys(ALARMS, COMPARE),
}
"""Neutral fields that the blocks do not have, with what to program instead."""
WINDUP = "the blocks never integrate further into MinMV, MaxMV or MaxVarMV"


@dataclass(slots=True)
class Program:
    """What stands beside the loops."""

    task: Task
    names: Names = field(default_factory=Names)
    signals: dict[str, Any] = field(default_factory=dict)
    blocks: list[dict[str, Any]] = field(default_factory=list)


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:
    """A NextoPID file with these loops."""
    program = Program(task_of([loop.sample_time for loop in file.loops], options.get("sample_time")))
    builders = []
    for loop in file.loops:
        b = Builder()
        name = program.names.new(loop.name)
        b.data = {"name": name, "type": "PIDA_REAL"}
        if name != loop.name:
            b.put("name", name, "name", "an identifier of IEC 61131-3, unique without regard to capitals", assumed=True)
        builders.append(b)
    for b, loop in zip(builders, file.loops, strict=True):
        _loop(b, loop, program)
    link(file, builders)
    data = {"pidcfg": 1, "vendor": "nextopid"} | present({"name": file.name, "description": file.description})
    data["plc"] = {"sample_time": number(program.task.interval)}
    data |= {"signals": program.signals} if program.signals else {}
    data |= {"blocks": program.blocks} if program.blocks else {}
    loops = [{key: b.data[key] for key in KEYS if key in b.data} for b in builders]
    return Target({**data, "loops": loops}, [b.puts for b in builders])


def _loop(b: Builder, loop: Loop, program: Program) -> None:
    if loop.description is not None:
        b.put("description", loop.description, "description")
    _time(b, loop, program.task)
    b.put("Direct", not loop.output_raises_pv, "output_raises_pv")
    if loop.mode != "cascade":
        b.put("Manual", loop.mode == "manual", "mode")
    _setpoint(b, loop)
    _equation(b, loop)
    _pv(b, loop, program)
    _output(b, loop, program.task)
    if loop.output.pulse is not None:
        _pulses(b, loop, program)
    if loop.deadband:
        b.put("DeadBand", number(loop.deadband), "deadband", HELD)
    if not loop.anti_windup:
        b.mark("anti_windup", "anti_windup", WINDUP, assumed=True)
    b.puts += dropped(loop, NO_TWIN)


def _time(b: Builder, loop: Loop, task: Task) -> None:
    """The loop's interval: a multiple of the task's, as near as can be."""
    time = product(task.interval, Decimal(task.cycles(loop.sample_time)))
    note = f"every {task.cycles(loop.sample_time)} cycles of the task" if time != task.interval else ""
    where = "/plc.sample_time"
    clamped = not task.holds(loop.sample_time)
    if time != task.interval:
        where = "sample_time"
        b.data["sample_time"] = number(time)
    b.puts.append(Put(where, "sample_time", note, exact=loop.sample_time, clamped=clamped))


def _setpoint(b: Builder, loop: Loop) -> None:
    low, high = loop.pv.range
    if loop.setpoint.value is None:
        least = low if loop.output_raises_pv else high
        b.put("SP", number(least), None, "nothing says the set point: at this one the output is least")
    else:
        b.put("SP", number(loop.setpoint.value), "setpoint.value")
    if loop.setpoint.limits is None:
        return
    for i, (end, key, inside) in enumerate(zip(loop.setpoint.limits, ("MinPV", "MaxPV"), (1, -1), strict=True)):
        if (end - loop.pv.range[i]) * inside > 0:
            b.drop(f"setpoint.limits.{i}", f"{key} limits the PV too: limit SP in the program")
        else:
            b.mark(key, f"setpoint.limits.{i}", "" if end == loop.pv.range[i] else f"{key} limits the set point")


def _equation(b: Builder, loop: Loop) -> None:
    """The dependent form; the independent one where an integral time would count as none."""
    tuning = loop.tuning
    gain, integral, derivative, acts = tuning.gain, tuning.integral_time, tuning.derivative_time, tuning.proportional
    form = ""
    if ZERO < integral < SHORTEST_INTEGRAL:
        form = f"a gain (Indep TRUE): below {SHORTEST_INTEGRAL} s an integral time counts as none"
        b.data["Indep"] = True
        integral, derivative = independent(gain, integral, derivative)
        b.put("Kp", number(gain) if acts else 0, "tuning.gain")
        b.mark("Kp", "tuning.proportional")
    else:
        b.put("Kp", number(gain), "tuning.gain")
        b.put("DisableP", not acts, "tuning.proportional")
    b.put("Ti_Ki", number(integral), "tuning.integral_time", form)
    b.put("Td_Kd", number(derivative), "tuning.derivative_time")
    b.put("DerivEr", tuning.derivative_on == "error", "tuning.derivative_on")
    if tuning.derivative_filter:
        b.put("Tfd", number(tuning.derivative_filter), "tuning.derivative_filter")


def _pv(b: Builder, loop: Loop, program: Program) -> None:
    for i, key in enumerate(("MinPV", "MaxPV")):
        b.put(key, number(loop.pv.range[i]), f"pv.range.{i}")
    if loop.pv.unit is not None:
        b.put("pv.unit", loop.pv.unit, "pv.unit")
    if loop.pv.filter:
        signal, block = program.names.new(b.data["name"], "_IN"), program.names.new(b.data["name"], "_FILTER")
        place = len(program.blocks)
        program.signals[signal] = b.data["SP"]
        program.blocks.append(
            {"name": block, "type": "ControlLowFilter", "InVar": signal, "Tc": number(loop.pv.filter)}
        )
        b.mark(f"/blocks.{place}.Tc", "pv.filter", f"{block}, a block before PV")
        b.put("PV", f"{block}.OutVar", None, f"{signal} is the PV before its filter: assign it to the analog input")


def _output(b: Builder, loop: Loop, task: Task) -> None:
    output = loop.output
    limits = output.limits or output.range
    for i, key in enumerate(("MinMV", "MaxMV")):
        b.put(key, number(limits[i]), f"output.limits.{i}")
    b.put("output.range", [number(end) for end in output.range], "output.range")
    if output.unit is not None:
        b.put("output.unit", output.unit, "output.unit")
    if output.bias:
        b.put("BIAS", number(output.bias), "output.bias")
    if output.manual is not None:
        b.put("ManualMV", number(output.manual), "output.manual")
    elif loop.mode == "manual":
        b.put("ManualMV", number(min(max(ZERO, limits[0]), limits[1])), None, "nothing says the output in manual")
    if output.max_rate is not None:
        time = product(task.interval, Decimal(task.cycles(loop.sample_time)))
        step = product(output.max_rate, time)
        if step:
            b.put("MaxVarMV", number(step), "output.max_rate", f"per cycle of {decimal_text(time)} s", exact=step)
        else:
            b.drop("output.max_rate", "MaxVarMV 0 is no limit: put the loop into manual to hold its output")


def _pulses(b: Builder, loop: Loop, program: Program) -> None:
    """A ControlPWM behind the loop."""
    wanted = quotient(loop.output.pulse.period if loop.output.pulse else ZERO, program.task.interval)
    period = min(max(nearest(wanted), PERIODS[0]), PERIODS[1])
    name, place = program.names.new(b.data["name"], "_PWM"), len(program.blocks)
    low, high = (number(end) for end in loop.output.range)
    program.blocks.append(
        {
            "name": name,
            "type": "ControlPWM",
            "MV": f"{b.data['name']}.MV",
            "MaxMV": high,
            "MinMV": low,
            "Period": period,
        }
    )
    note = f"{name}, in cycles of the task of {decimal_text(program.task.interval)} s"
    if period < ROUGH:
        note += f": the output has {period} steps; a shorter interval (--sample-time) gives more"
    clamped = not PERIODS[0] <= nearest(wanted) <= PERIODS[1]
    b.puts.append(Put(f"/blocks.{place}.Period", "output.pulse.period", note, exact=wanted, clamped=clamped))
