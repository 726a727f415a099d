"""DPIDE instructions as neutral loops, and what they do when they are switched."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.conversion.builder import ZERO, NeutralBuilder, Same, apply_table, dependent, same_fields
from pidcfg.conversion.operation import Deadband, Manual, Operation, VendorSettings, Windup
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.paths import steps, value_at
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from pidcfg.conversion.builder import Table
    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.schemas.dpide import DpideFile, Loop

# --- DPIDE instructions as neutral loops: operands are engineering units already --------------------------------------

D297 = Decision(
    297,
    "a DPIDE that is off goes over in manual, with an output of 0",
    "PID_RUN FALSE becomes the manual mode; the manual output is then 0, or the limit next to it, whatever MOUT says.",
    "The instruction sets MV to 0 when it is switched off; MOUT might open the valve.",
)
BACK_CALCULATED = 2
"""PID_MODE that works the integral out of the limited MV."""
MS = 1000
DEAD_BAND = "inside the band DPIDE counts the error as 0 only after PV has crossed SV"
ALWAYS_ANTI_WINDUP = "DPIDE always holds its integral at the limits of MV"
BELOW_ZERO = "what is below 0 counts as 0"
CALL_KEYS = {
    "call.EN": "the program decides when this instruction is executed: do so there, too",
    "call.function_block": "how this PLC's program is divided; the calculation is the same",
    "call.timer": "CYCLE says how often it is called; call it as often there",
    "call.GPWM.cycle": "MV is the time on in ms of each such cycle: let the output be pulsed there",
    "call.GPWM.output": "the bit of the pulses; let the output be pulsed there",
}
"""What stands around the instruction, and what to do about it elsewhere."""
START_AUTOTUNE = "start the auto-tuning as the target does it"
NOTHING_LOST = {
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
    for i, loop in enumerate(config.loops):
        b = NeutralBuilder(i)
        if loop.pv.range is None:
            b.require("", f"the PV of {loop.name} has no range: add pv.range with its values at 0 % and 100 %")
        if loop.MV_MAX == loop.MV_MIN:
            ends = plain_number(loop.MV_MAX)
            b.require("MV_MAX", f"MV_MAX and MV_MIN of {loop.name} are both {ends}: write the limits of MV")
        if not b.loop.missing:
            apply_table(b, loop, Instruction(loop, config.plc.interrupt_task), FIELDS)
        loops.append(b.loop)
    return loops


class Instruction(NamedTuple):
    """A DPIDE instruction in its task."""

    loop: Loop
    interval: int | None
    """Of the interrupt task, in ms; None: it is called in every scan."""


def _mode(b: NeutralBuilder, d: Instruction) -> None:
    loop = d.loop
    b.put("PID_MAN", loop.PID_MAN, "mode", "manual" if loop.PID_MAN or not loop.PID_RUN else "auto")
    b.mark("PID_RUN", loop.PID_RUN, "mode", note="" if loop.PID_RUN else "off: it goes over in manual, with output 0")


def _anti_windup(b: NeutralBuilder, d: Instruction) -> None:
    mode = d.loop.PID_MODE
    b.set("anti_windup", value=True)
    if mode == 1:
        b.drop("PID_MODE", 1, START_AUTOTUNE)
    else:
        b.mark("PID_MODE", mode, "anti_windup", note=ALWAYS_ANTI_WINDUP, assumed=mode != BACK_CALCULATED)


def _deadband(b: NeutralBuilder, d: Instruction) -> None:
    band = d.loop.ERR_DBW
    b.set("deadband", abs(band))
    if band:
        b.mark("ERR_DBW", band, "deadband", note=DEAD_BAND)


def _cycle(b: NeutralBuilder, d: Instruction) -> None:
    cycle, note = min(max(d.loop.CYCLE, SHORTEST_CYCLE), LONGEST_CYCLE), ""
    if d.interval is not None:
        cycle, note = d.interval, f"the interrupt task's interval of {d.interval} ms counts"
    b.put("CYCLE", d.loop.CYCLE, "sample_time", Decimal(cycle) / MS, note)


def _equation(b: NeutralBuilder, d: Instruction) -> None:
    loop = d.loop
    gain, integral, derivative = (max(value, ZERO) for value in (loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd))
    acts = True
    if not loop.PID_EQ:
        gain, integral, derivative, acts = dependent(gain, integral, derivative)
    b.set("tuning.gain", gain)
    b.set("tuning.proportional", acts)
    b.mark("Kc_Kp", loop.Kc_Kp, "tuning.gain", "tuning.proportional", note=_below_zero(loop.Kc_Kp))
    b.put("Ti_Ki", loop.Ti_Ki, "tuning.integral_time", integral, _below_zero(loop.Ti_Ki))
    b.put("Td_Kd", loop.Td_Kd, "tuning.derivative_time", derivative, _below_zero(loop.Td_Kd))
    b.mark("PID_EQ", loop.PID_EQ, "tuning.gain")
    b.set("tuning.derivative_on", "pv" if loop.PID_DE else "error")
    if loop.Td_Kd > 0:
        b.mark("PID_DE", loop.PID_DE, "tuning.derivative_on")
    b.set("tuning.derivative_filter", max(loop.Tf, ZERO))
    if loop.Tf:
        b.mark("Tf", loop.Tf, "tuning.derivative_filter", note=_below_zero(loop.Tf))


def _below_zero(value: Decimal) -> str:
    return BELOW_ZERO if value < 0 else ""


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
    b.set("output.bias", loop.BIAS)
    if loop.BIAS:
        b.mark("BIAS", loop.BIAS, "output.bias")


def _call(b: NeutralBuilder, d: Instruction) -> None:
    for path, note in CALL_KEYS.items():
        value = value_at(d.loop, steps(path))
        if value is not None:
            b.drop(path, value, note)


FIELDS: Table[NeutralBuilder, Instruction] = (
    *same_fields("name", "description"),
    Same("PID_DIR", "output_raises_pv"),
    Same("SV", "setpoint.value"),
    _mode,
    _anti_windup,
    _deadband,
    *same_fields("pv.range", "pv.unit", "output.range", "output.unit"),
    _cycle,
    _equation,
    _output,
    _call,
)
"""Every field in the order of the report."""

# ----------------------------------------------------------------------------------------------------------------------
# DPIDE instructions: MOUT_AUTO decides about manual, PID_MODE about the way back (manual, PID_MODE and MOUT_AUTO).

OWN_SETTINGS = VendorSettings(("device", "devices"), dict.fromkeys(CALL_KEYS, ""))
"""Its devices, and how the program calls it."""


def operations(config: DpideFile) -> list[Operation]:
    """Of each instruction (D268 to D274)."""
    return [
        Operation(
            manual=Manual.STAYS if loop.MOUT_AUTO or _is_one_device(loop) else Manual.JUMPS,
            windup=Windup.WORKED_OUT if loop.PID_MODE == BACK_CALCULATED else Windup.HELD_BEYOND,
            deadband=Deadband.CROSSED,
        )
        for loop in config.loops
    ]


def _is_one_device(loop: Loop) -> bool:
    """Whether MOUT stands in the device of MV."""
    return loop.devices.MV is not None and loop.devices.MOUT == loop.devices.MV
