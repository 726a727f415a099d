"""DPIDE instructions as neutral loops, what they do when they are switched, and neutral loops as instructions."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.conversion.builder import (
    ALARMS,
    ZERO,
    NeutralBuilder,
    SameField,
    TargetBuilder,
    apply_table,
    same_fields,
    target_file,
    to_dependent,
    unmatched_fields,
)
from pidcfg.conversion.operation import Deadband, Manual, Operation, VendorSettings, Windup
from pidcfg.encoders.codecs import round_to_integer
from pidcfg.encoders.image import without_none
from pidcfg.schemas.dpide import LAST_REGISTER, MAX_CYCLE, MIN_CYCLE
from pidcfg.schemas.dpide import Loop as SourceLoop
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.conversion import NeutralLoop, TargetFile
    from pidcfg.conversion.builder import Table
    from pidcfg.encoders.image import Settings
    from pidcfg.schemas.dpide import DpideFile
    from pidcfg.schemas.generic import GenericFile, Loop

# --- DPIDE instructions as neutral loops: operands are engineering units already --------------------------------------

D297 = Decision(
    297,
    "a DPIDE that is off goes over in manual, with an output of 0",
    "PID_RUN FALSE becomes the manual mode; the manual output is then 0, or the limit next to it, whatever MOUT says.",
    "The instruction sets MV to 0 when it is switched off; MOUT might open the valve.",
)
D1090 = Decision(
    1090,
    "a set point in the device of another loop's MV is a cascade",
    "The other loop becomes the source of the set point, its output range that of the PV, and the mode cascade; a "
    "source becomes one device for MV and SV, where the loop is in cascade or in manual and both scales are the same. "
    "A BIAS or MOUT in the device of an MV is dropped, with what to program instead. Loops that have one device for "
    "their SV, and no MV in it, get a set point each, and all but the first lose the device that they share.",
    "Both are one register, in the units of the PV (D258, D266), and there is no switch between two set points.",
)
BACK_CALCULATED_MODE = 2
"""PID_MODE that works the integral out of the limited MV."""
MS_PER_SECOND = 1000
DEAD_BAND_NOTE = "inside the band DPIDE counts the error as 0 only after PV has crossed SV"
ANTI_WINDUP_NOTE = "DPIDE always holds its integral at the limits of MV"
BELOW_ZERO_NOTE = "what is below 0 counts as 0"
CALL_KEYS = {
    "call.EN": "the program decides when this instruction is executed: do so there, too",
    "call.function_block": "how this PLC's program is divided; the calculation is the same",
    "call.timer": "CYCLE says how often it is called; call it as often there",
    "call.GPWM.cycle": "MV is the time on in ms of each such cycle: let the output be pulsed there",
    "call.GPWM.output": "the bit of the pulses; let the output be pulsed there",
}
"""What stands around the instruction, and what to do about it elsewhere."""
AUTOTUNE_ADVICE = "start the auto-tuning as the target does it"
DRIVEN_ADVICE = {
    "BIAS": "a feed-forward, to be added to the output in the program",
    "MOUT": "write it to the output in manual in the program",
}
"""What to do in place of an operand that is the MV of another loop."""
HARMLESS_FIELDS = {
    "PV": "the process's",
    "device": "a place, which means nothing elsewhere",
    "devices": "places in this PLC, which mean nothing elsewhere",
    "MOUT_AUTO": "it decides what the output does when manual begins: operation.to_manual says where that differs",
    "PID_DE": "of no effect without a derivative",
    "Tf": "0: no filter",
    "BIAS": "0: nothing is added",
    "ERR_DBW": "0: no dead band",
    "plc.interrupt_task": "CYCLE says what it comes to",
    "plc.map": "where this PLC's registers are",
}
"""Fields that may come without a line in the report, and why."""


def to_neutral(config: DpideFile) -> list[NeutralLoop]:
    """The neutral loops of a configuration."""
    loops = []
    drivers = {loop.devices.MV: loop for loop in config.loops if loop.devices.MV is not None}
    set_points: dict[str, SourceLoop] = {}
    for i, loop in enumerate(config.loops):
        b = NeutralBuilder(i)
        if loop.pv.range is None:
            b.require("", f"the PV of {loop.name} has no range: add pv.range with its values at 0 % and 100 %")
        if loop.MV_MAX == loop.MV_MIN:
            ends = plain_number(loop.MV_MAX)
            b.require("MV_MAX", f"MV_MAX and MV_MIN of {loop.name} are both {ends}: write the limits of MV")
        if not b.loop.missing:
            driven = {key: drivers[place] for key, place in loop.devices.by_operand().items() if place in drivers}
            others = {key: other for key, other in driven.items() if key != "MV" and other is not loop}
            owner = set_points.setdefault(loop.devices.SV, loop) if loop.devices.SV is not None else loop
            apply_table(b, loop, Instruction(loop, config.plc.interrupt_task, others, owner), NEUTRAL_FIELDS)
        loops.append(b.loop)
    return rescale_masters(loops)


def rescale_masters(loops: list[NeutralLoop]) -> list[NeutralLoop]:
    """The loops, each source of a set point with the PV's range that it commands for its output's (D1090)."""
    by_name = {loop.data.get("name"): loop for loop in loops}
    for inner in loops:
        outer = by_name.get(value_at(inner.data, ("setpoint", "source")))
        if outer is not None and "output" in outer.data and outer.data["output"]["range"] != inner.data["pv"]["range"]:
            outer.data["output"]["range"] = inner.data["pv"]["range"]
            note = f"0 % and 100 % of the PV of {inner.data['name']}, whose set point it is"
            outer.fields[:] = [
                replace(field, note=note, assumed=True) if field.path == "output.range" else field
                for field in outer.fields
            ]
    return loops


class Instruction(NamedTuple):
    """A DPIDE instruction in its task."""

    loop: SourceLoop
    interval: int | None
    """Of the interrupt task, in ms; None: it is called in every scan."""
    drivers: Mapping[str, SourceLoop]
    """Operands in the device of another loop's MV, with that loop."""
    setpoint_owner: SourceLoop
    """The first loop whose SV is in the same device, or this one."""


def _neutral_setpoint(b: NeutralBuilder, d: Instruction) -> None:
    b.put("SV", d.loop.SV, "setpoint.value", d.loop.SV)
    outer = d.drivers.get("SV")
    if outer is not None:
        note = f"MV of {outer.name} stands there: a cascade"
        b.put("devices.SV", d.loop.devices.SV, "setpoint.source", outer.name, note)
    elif d.setpoint_owner is not d.loop:
        note = f"SV of {d.setpoint_owner.name} is there, too: whoever writes one of the two set points must write both"
        b.drop("devices.SV", d.loop.devices.SV, note)


def _mode(b: NeutralBuilder, d: Instruction) -> None:
    loop = d.loop
    control = "cascade" if "SV" in d.drivers else "auto"
    b.put("PID_MAN", loop.PID_MAN, "mode", "manual" if loop.PID_MAN or not loop.PID_RUN else control)
    b.mark("PID_RUN", loop.PID_RUN, "mode", note="" if loop.PID_RUN else "off: it goes over in manual, with output 0")


def _anti_windup(b: NeutralBuilder, d: Instruction) -> None:
    mode = d.loop.PID_MODE
    b.set("anti_windup", value=True)
    if mode == 1:
        b.drop("PID_MODE", 1, AUTOTUNE_ADVICE)
    else:
        b.mark("PID_MODE", mode, "anti_windup", note=ANTI_WINDUP_NOTE, assumed=mode != BACK_CALCULATED_MODE)


def _neutral_deadband(b: NeutralBuilder, d: Instruction) -> None:
    band = d.loop.ERR_DBW
    b.set("deadband", abs(band))
    if band:
        b.mark("ERR_DBW", band, "deadband", note=DEAD_BAND_NOTE)


def _neutral_cycle(b: NeutralBuilder, d: Instruction) -> None:
    cycle, note = min(max(d.loop.CYCLE, MIN_CYCLE), MAX_CYCLE), ""
    if d.interval is not None:
        cycle, note = d.interval, f"the interrupt task's interval of {d.interval} ms counts"
    b.put("CYCLE", d.loop.CYCLE, "sample_time", Decimal(cycle) / MS_PER_SECOND, note)


def _neutral_equation(b: NeutralBuilder, d: Instruction) -> None:
    loop = d.loop
    gain, integral, derivative = (max(value, ZERO) for value in (loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd))
    proportional = True
    if not loop.PID_EQ:
        gain, integral, derivative, proportional = to_dependent(gain, integral, derivative)
    b.set("tuning.gain", gain)
    b.set("tuning.proportional", proportional)
    b.mark("Kc_Kp", loop.Kc_Kp, "tuning.gain", "tuning.proportional", note=_below_zero_note(loop.Kc_Kp))
    b.put("Ti_Ki", loop.Ti_Ki, "tuning.integral_time", integral, _below_zero_note(loop.Ti_Ki))
    b.put("Td_Kd", loop.Td_Kd, "tuning.derivative_time", derivative, _below_zero_note(loop.Td_Kd))
    b.mark("PID_EQ", loop.PID_EQ, "tuning.gain")
    b.set("tuning.derivative_on", "pv" if loop.PID_DE else "error")
    if loop.Td_Kd > 0:
        b.mark("PID_DE", loop.PID_DE, "tuning.derivative_on")
    b.set("tuning.derivative_filter", max(loop.Tf, ZERO))
    if loop.Tf:
        b.mark("Tf", loop.Tf, "tuning.derivative_filter", note=_below_zero_note(loop.Tf))


def _below_zero_note(value: Decimal) -> str:
    return BELOW_ZERO_NOTE if value < 0 else ""


def _output(b: NeutralBuilder, d: Instruction) -> None:
    """Limits, and the scale that they stand for where no range is given."""
    loop = d.loop
    low, high = sorted((loop.MV_MIN, loop.MV_MAX))
    ends, note = ("output.limits.0", "output.limits.1"), ""
    if loop.MV_MIN > loop.MV_MAX:
        ends, note = ends[::-1], "MV_MIN is above MV_MAX: the PLC swaps them"
    b.set("output.limits", [low, high])
    b.mark("MV_MIN", loop.MV_MIN, ends[0], note=note)
    b.mark("MV_MAX", loop.MV_MAX, ends[1], note=note)
    b.set("output.manual", min(max(loop.MOUT if loop.PID_RUN else ZERO, low), high))
    if loop.PID_RUN:
        b.mark("MOUT", loop.MOUT, "output.manual")
    elif loop.MOUT:
        b.drop("MOUT", loop.MOUT, "the loop is off, and its output is 0: write it when you switch it on")
    if loop.output.range is None:
        note = "no output.range is given: MV_MIN and MV_MAX are taken for 0 % and 100 %"
        b.put("output.range", None, "output.range", [low, high], note, assumed=True)
    for operand, instead in DRIVEN_ADVICE.items():
        if operand in d.drivers:
            outer = d.drivers[operand].name
            b.drop(f"devices.{operand}", getattr(loop.devices, operand), f"MV of {outer} stands there: {instead}")
    b.set("output.bias", ZERO if "BIAS" in d.drivers else loop.BIAS)
    if loop.BIAS and "BIAS" not in d.drivers:
        b.mark("BIAS", loop.BIAS, "output.bias")


def _call(b: NeutralBuilder, d: Instruction) -> None:
    for path, note in CALL_KEYS.items():
        value = value_at(d.loop, parse_path(path))
        if value is not None:
            b.drop(path, value, note)


NEUTRAL_FIELDS: Table[NeutralBuilder, Instruction] = (
    *same_fields("name", "description"),
    SameField("PID_DIR", "output_raises_pv"),
    _neutral_setpoint,
    _mode,
    _anti_windup,
    _neutral_deadband,
    *same_fields("pv.range", "pv.unit", "output.range", "output.unit"),
    _neutral_cycle,
    _neutral_equation,
    _output,
    _call,
)
"""Every field in the order of the report."""

# --- DPIDE instructions: MOUT_AUTO decides about manual, PID_MODE about the way back -------------

OWN_SETTINGS = VendorSettings(("device", "devices"), dict.fromkeys(CALL_KEYS, ""))
"""Its devices, and how the program calls it."""


def operations(config: DpideFile) -> list[Operation]:
    """Of each instruction (D268 to D274)."""
    return [
        Operation(
            manual=Manual.STAYS if loop.MOUT_AUTO or _is_one_device(loop) else Manual.JUMPS,
            windup=Windup.WORKED_OUT if loop.PID_MODE == BACK_CALCULATED_MODE else Windup.HELD_BEYOND,
            deadband=Deadband.CROSSED,
        )
        for loop in config.loops
    ]


def _is_one_device(loop: SourceLoop) -> bool:
    """Whether MOUT stands in the device of MV."""
    return loop.devices.MV is not None and loop.devices.MOUT == loop.devices.MV


# --- Neutral loops as DPIDE instructions: only the form and the direction are the instruction's own -------------------

D296 = Decision(
    296,
    "a DPIDE is written in the dependent form, in mode 2",
    "PID_EQ TRUE with Kc, Ti and Td; without a proportional action PID_EQ FALSE with Kp 0. PID_MODE 2, "
    "but 0 where the derivative of the error kicks at a step of the set point and there is a proportional action.",
    "The dependent form is the one that all others have a twin of; mode 2 works the integral out of the limited MV, "
    "and a kick that the limit cuts off would go into it: the PV dips by several % after each step. Mode 0 holds the "
    "integral at a limit whichever way the error points: without a proportional action it would stick there.",
)
D298 = Decision(
    298,
    "without a set point a DPIDE gets the one at which its output is least",
    "SV is the lower end of the PV's range where the PV rises with the output, else the upper one; reported as "
    "assumed.",
    "SV must be given. A loop that nobody has given a set point must not open its valve.",
)
BLOCK_SIZE = 30
"""Registers of an I_MV block."""
COMPARE_IN_PROGRAM, USE_GPWM = "compare PV in the program", "use GPWM behind the instruction"
PROGRAM_ADVICE = {
    "setpoint.limits.0": "limit SV in the program",
    "setpoint.limits.1": "limit SV in the program",
    "setpoint.follows_pv": "copy PV into SV in the program while PID_MAN is on",
    "pv.filter": "filter PV before the instruction",
    "pv.square_root": "take the root of PV before the instruction",
    "output.max_rate": "limit the change of MV behind the instruction",
    **dict.fromkeys(("output.pulse.period", "output.pulse.min_on", "output.pulse.min_off"), USE_GPWM),
    **dict.fromkeys(ALARMS, COMPARE_IN_PROGRAM),
}
"""Neutral fields that a DPIDE does not have, with what to program instead."""


def from_neutral(file: GenericFile, options: Settings, operations: Sequence[Operation] = ()) -> TargetFile:
    """DPIDE instructions of neutral loops, their I_MV blocks one after the other from D0."""
    devices = options.get("device") or []
    builders = []
    for i, loop in enumerate(file.loops):
        b = TargetBuilder(i, {"name": loop.name} | without_none({"description": loop.description}))
        apply_table(b, loop, loop, DPIDE_FIELDS)
        _manual_transfer(b, operations[i].manual if operations else Manual.STAYS)
        if operations and operations[i].windup is Windup.HELD_BEYOND:  # a DPIDE in mode 0, or one that tunes
            b.data["PID_MODE"] = 0
        note = "" if i < len(devices) else "chosen; --device names another"
        b.put("device", devices[i] if i < len(devices) else f"D{i * BLOCK_SIZE}", None, note)
        builders.append(b)
    _link_cascades(builders, file.loops)
    for b in builders:
        b.data = {key: b.data[key] for key in SourceLoop.model_fields if key in b.data}
    return target_file("dpide", file, builders)


def _link_cascades(builders: Sequence[TargetBuilder], loops: Sequence[Loop]) -> None:
    """Set points that are another loop's output: one device for its MV and their SV (D1090)."""
    numbers = {loop.name: i for i, loop in enumerate(loops)}
    free_registers = _free_registers([int(b.data["device"][1:]) for b in builders])
    for i, (b, loop) in enumerate(zip(builders, loops, strict=True)):
        source, in_cascade = loop.setpoint.source, loop.mode == "cascade"
        outer = numbers.get(source) if source is not None else None
        linked = outer not in {None, i} and loop.mode != "auto" and loops[outer or 0].output.range == loop.pv.range
        if in_cascade:
            b.mark("PID_MAN", "mode", "" if linked else "link the loops in the program", clamped=not linked)
        if source is None:
            continue
        if not linked or outer is None:
            b.drop("setpoint.source", f"move MV of {source} to SV in the program")
            continue
        master = builders[outer]
        if "devices" not in master.data or "MV" not in master.data["devices"]:
            master.put("devices.MV", next(free_registers), None, f"chosen: SV of {loop.name} stands there, too")
        b.put("devices.SV", master.data["devices"]["MV"], "setpoint.source", f"MV of {source} stands there: a cascade")


def _free_registers(blocks: Sequence[int]) -> Iterator[str]:
    """Pairs of D registers behind the last block of I_MV, then in front of and between them."""
    used_registers = {register for block in blocks for register in range(block, block + BLOCK_SIZE)}
    end = max(used_registers) + 1
    for first in (*range(end, LAST_REGISTER, 2), *range(0, end - 1, 2)):
        if first not in used_registers and first + 1 not in used_registers:
            yield f"D{first}"


def _equation(b: TargetBuilder, loop: Loop) -> None:
    tuning, proportional = loop.tuning, loop.tuning.proportional
    gain, integral, derivative = tuning.gain, tuning.integral_time, tuning.derivative_time
    form_note = ""
    if not proportional:
        form_note = "in the independent form (PID_EQ FALSE): no proportional action"
        integral, derivative = gain / integral if integral else ZERO, gain * derivative
    b.put("Kc_Kp", gain if proportional else 0, "tuning.gain")
    b.put("PID_EQ", proportional, "tuning.proportional", form_note)
    b.put("Ti_Ki", integral, "tuning.integral_time")
    b.put("Td_Kd", derivative, "tuning.derivative_time")
    b.put("PID_DE", tuning.derivative_on == "pv", "tuning.derivative_on")


def _cycle(b: TargetBuilder, loop: Loop) -> None:
    """CYCLE in whole ms."""
    cycle_wanted = loop.sample_time * MS_PER_SECOND
    cycle = min(max(round_to_integer(cycle_wanted), MIN_CYCLE), MAX_CYCLE)
    clamped = not MIN_CYCLE <= cycle_wanted <= MAX_CYCLE
    note = "" if cycle_wanted == cycle else "CYCLE is whole milliseconds"
    note = f"CYCLE is {MIN_CYCLE} to {MAX_CYCLE} ms" if clamped else note
    b.put("CYCLE", cycle, "sample_time", note, exact=cycle_wanted, clamped=clamped)


def _limits(b: TargetBuilder, loop: Loop) -> None:
    low, high = loop.output.limits or loop.output.range
    b.put("MV_MIN", low, "output.limits.0")
    b.put("MV_MAX", high, "output.limits.1")


def _ranges(b: TargetBuilder, loop: Loop) -> None:
    b.put("output.range", [*map(plain_number, loop.output.range)], "output.range")
    b.put("pv.range", [*map(plain_number, loop.pv.range)], "pv.range")


def _modes(b: TargetBuilder, loop: Loop) -> None:
    """Mode 2, unless the derivative kicks (D296); manual or not."""
    kicks = loop.tuning.derivative_on == "error" and loop.tuning.derivative_time and loop.tuning.proportional
    windup = "" if loop.anti_windup else ANTI_WINDUP_NOTE
    b.put("PID_MODE", 0 if kicks else BACK_CALCULATED_MODE, "anti_windup", windup, assumed=not loop.anti_windup)
    b.data["PID_MAN"] = loop.mode == "manual"
    if loop.mode != "cascade":
        b.mark("PID_MAN", "mode")


def _manual(b: TargetBuilder, loop: Loop) -> None:
    b.put("MOUT", loop.output.manual or ZERO, "output.manual")


def _manual_transfer(b: TargetBuilder, source: Manual) -> None:
    """MOUT follows MV in automatic, unless the source has a manual value of its own."""
    stays = source is Manual.STAYS
    b.put("MOUT_AUTO", stays, None, "the output stays when manual begins" if stays else "MOUT is the output in manual")


def _setpoint(b: TargetBuilder, loop: Loop) -> None:
    """The set point; the one at which the output is least where there is none (D298)."""
    if loop.setpoint.value is None:
        note = "nothing says the set point: at this one the output is least"
        b.put("SV", plain_number(loop.pv.range[not loop.output_raises_pv]), None, note)
    else:
        b.put("SV", plain_number(loop.setpoint.value), "setpoint.value")


def _deadband(b: TargetBuilder, loop: Loop) -> None:
    if loop.deadband:
        b.put("ERR_DBW", loop.deadband, "deadband", DEAD_BAND_NOTE)
    else:
        b.data["ERR_DBW"] = 0


def _drop_unmatched(b: TargetBuilder, loop: Loop) -> None:
    b.drop_all(unmatched_fields(loop, PROGRAM_ADVICE))


DPIDE_FIELDS: Table[TargetBuilder, Loop] = (
    SameField("output_raises_pv", "PID_DIR"),
    _cycle,
    _equation,
    SameField("tuning.derivative_filter", "Tf"),
    _limits,
    _ranges,
    SameField("output.bias", "BIAS"),
    _modes,
    _manual,
    *same_fields("pv.unit", "output.unit"),
    _setpoint,
    _deadband,
    _drop_unmatched,
)
"""Every field in the order of the report."""
