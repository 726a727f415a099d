"""Neutral loops as DPIDE instructions: only the form and the direction are the instruction's own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.builder import (
    ALARMS,
    ZERO,
    Same,
    TargetBuilder,
    apply_table,
    drop_unmatched,
    same_fields,
    target_file,
)
from pidcfg.conversion.from_dpide import ALWAYS_ANTI_WINDUP, BACK_CALCULATED, DEAD_BAND, MS
from pidcfg.conversion.operation import Manual, Windup
from pidcfg.encoders.codecs import nearest
from pidcfg.encoders.image import present
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE
from pidcfg.schemas.dpide import Loop as Instruction
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.conversion.builder import Table
    from pidcfg.conversion.ledger import TargetFile
    from pidcfg.conversion.operation import Operation
    from pidcfg.schemas.generic import GenericFile, Loop

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
BY_PROGRAM = {
    "setpoint.limits.0": "limit SV in the program",
    "setpoint.limits.1": "limit SV in the program",
    "setpoint.source": "move MV of that loop to SV in the program",
    "setpoint.follows_pv": "copy PV into SV in the program while PID_MAN is on",
    "pv.filter": "filter PV before the instruction",
    "pv.square_root": "take the root of PV before the instruction",
    "output.max_rate": "limit the change of MV behind the instruction",
    **dict.fromkeys(("output.pulse.period", "output.pulse.min_on", "output.pulse.min_off"), USE_GPWM),
    **dict.fromkeys(ALARMS, COMPARE_IN_PROGRAM),
}
"""Neutral fields that a DPIDE does not have, with what to program instead."""


def from_neutral(file: GenericFile, options: Mapping[str, Any], operations: Sequence[Operation] = ()) -> TargetFile:
    """DPIDE instructions of neutral loops, their I_MV blocks one after the other from D0."""
    devices = options.get("device") or []
    builders = []
    for i, loop in enumerate(file.loops):
        b = TargetBuilder(i, {"name": loop.name} | present({"description": loop.description}))
        apply_table(b, loop, loop, FIELDS)
        _to_manual(b, operations[i].manual if operations else Manual.STAYS)
        if operations and operations[i].windup is Windup.HELD_BEYOND:  # a DPIDE in mode 0, or one that tunes
            b.data["PID_MODE"] = 0
        note = "" if i < len(devices) else "chosen; --device names another"
        b.put("device", devices[i] if i < len(devices) else f"D{i * BLOCK_SIZE}", None, note)
        b.data = {key: b.data[key] for key in Instruction.model_fields if key in b.data}
        builders.append(b)
    return target_file("dpide", file, builders)


def _equation(b: TargetBuilder, loop: Loop) -> None:
    tuning, acts = loop.tuning, loop.tuning.proportional
    gain, integral, derivative = tuning.gain, tuning.integral_time, tuning.derivative_time
    form = ""
    if not acts:
        form = "in the independent form (PID_EQ FALSE): no proportional action"
        integral, derivative = gain / integral if integral else ZERO, gain * derivative
    b.put("Kc_Kp", gain if acts else 0, "tuning.gain")
    b.put("PID_EQ", acts, "tuning.proportional", form)
    b.put("Ti_Ki", integral, "tuning.integral_time")
    b.put("Td_Kd", derivative, "tuning.derivative_time")
    b.put("PID_DE", tuning.derivative_on == "pv", "tuning.derivative_on")


def _cycle(b: TargetBuilder, loop: Loop) -> None:
    """CYCLE in whole ms."""
    wanted = loop.sample_time * MS
    cycle = min(max(nearest(wanted), SHORTEST_CYCLE), LONGEST_CYCLE)
    note = "CYCLE is whole milliseconds" if wanted != cycle else ""
    clamped = not SHORTEST_CYCLE <= wanted <= LONGEST_CYCLE
    b.put("CYCLE", cycle, "sample_time", note, exact=wanted, clamped=clamped)


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
    windup = "" if loop.anti_windup else ALWAYS_ANTI_WINDUP
    b.put("PID_MODE", 0 if kicks else BACK_CALCULATED, "anti_windup", windup, assumed=not loop.anti_windup)
    cascade = loop.mode == "cascade"
    b.put("PID_MAN", loop.mode == "manual", "mode", "link the loops in the program" if cascade else "", clamped=cascade)


def _manual(b: TargetBuilder, loop: Loop) -> None:
    b.put("MOUT", loop.output.manual or ZERO, "output.manual")


def _to_manual(b: TargetBuilder, source: Manual) -> None:
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
        b.put("ERR_DBW", loop.deadband, "deadband", DEAD_BAND)
    else:
        b.data["ERR_DBW"] = 0


def _without_place(b: TargetBuilder, loop: Loop) -> None:
    b.drop_all(drop_unmatched(loop, BY_PROGRAM))


FIELDS: Table[TargetBuilder, Loop] = (
    Same("output_raises_pv", "PID_DIR"),
    _cycle,
    _equation,
    Same("tuning.derivative_filter", "Tf"),
    _limits,
    _ranges,
    Same("output.bias", "BIAS"),
    _modes,
    _manual,
    *same_fields("pv.unit", "output.unit"),
    _setpoint,
    _deadband,
    _without_place,
)
"""Every field in the order of the report."""
