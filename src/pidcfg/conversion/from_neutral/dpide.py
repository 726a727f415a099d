"""Neutral loops as DPIDE instructions: only the form and the direction are the instruction's own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, number
from pidcfg.conversion.ledger import Put, Target
from pidcfg.conversion.to_neutral.dpide import BACK_CALCULATED, DEAD_BAND, HELD, MS
from pidcfg.conversion.unmatched import ALARMS, dropped
from pidcfg.encoders.values import present
from pidcfg.encoders.words import nearest
from pidcfg.refs import Decision
from pidcfg.schemas.base import plain_number
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal

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
BLOCK = 30
"""Registers of an I_MV block."""
COMPARE, PULSES = "compare PV in the program", "use GPWM behind the instruction"
NO_TWIN = {
    "setpoint.limits.0": "limit SV in the program",
    "setpoint.limits.1": "limit SV in the program",
    "setpoint.source": "move MV of that loop to SV in the program",
    "setpoint.follows_pv": "copy PV into SV in the program while PID_MAN is on",
    "pv.filter": "filter PV before the instruction",
    "pv.square_root": "take the root of PV before the instruction",
    "output.max_rate": "limit the change of MV behind the instruction",
    **dict.fromkeys(("output.pulse.period", "output.pulse.min_on", "output.pulse.min_off"), PULSES),
    **dict.fromkeys(ALARMS, COMPARE),
}
"""Neutral fields that a DPIDE does not have, with what to program instead."""


def from_neutral(file: GenericFile, options: Mapping[str, Any]) -> Target:
    """DPIDE instructions of neutral loops, their I_MV blocks one after the other from D0."""
    data: dict[str, Any] = {"pidcfg": 1, "vendor": "dpide", **present({"name": file.name})}
    data |= present({"description": file.description})
    given = options.get("device") or []
    loops, puts = [], []
    for i, loop in enumerate(file.loops):
        device = given[i] if i < len(given) else f"D{i * BLOCK}"
        loops.append(_instruction(loop, device))
        puts.append([*_puts(loop), Put("device", None, "" if i < len(given) else "chosen; --device names another")])
    return Target(data | {"loops": loops}, puts)


def _instruction(loop: Loop, device: str) -> dict[str, Any]:
    """The operands of a loop."""
    limits, tuning = loop.output.limits or loop.output.range, loop.tuning
    acts = tuning.proportional
    integral = tuning.integral_time if acts else (tuning.gain / tuning.integral_time if tuning.integral_time else ZERO)
    return {
        "name": loop.name,
        **present({"description": loop.description}),
        "device": device,
        "SV": plain_number(_setpoint(loop)),
        "PID_MODE": _mode(loop),
        "PID_MAN": loop.mode == "manual",
        "CYCLE": _cycle(loop),
        "Kc_Kp": number(tuning.gain) if acts else 0,
        "Ti_Ki": number(integral),
        "Td_Kd": number(tuning.derivative_time if acts else tuning.gain * tuning.derivative_time),
        "Tf": number(tuning.derivative_filter),
        "PID_EQ": acts,
        "PID_DE": tuning.derivative_on == "pv",
        "PID_DIR": loop.output_raises_pv,
        "ERR_DBW": number(loop.deadband),
        "MV_MAX": number(limits[1]),
        "MV_MIN": number(limits[0]),
        "MOUT": number(loop.output.manual or ZERO),
        "BIAS": number(loop.output.bias),
        "pv": {"range": [*map(plain_number, loop.pv.range)], **present({"unit": loop.pv.unit})},
        "output": {"range": [*map(plain_number, loop.output.range)], **present({"unit": loop.output.unit})},
    }


def _setpoint(loop: Loop) -> Decimal:
    """The set point; the one at which the output is least where there is none (D298)."""
    return loop.pv.range[not loop.output_raises_pv] if loop.setpoint.value is None else loop.setpoint.value


def _mode(loop: Loop) -> int:
    """Mode 2, unless the derivative kicks (D296)."""
    kicks = loop.tuning.derivative_on == "error" and loop.tuning.derivative_time and loop.tuning.proportional
    return 0 if kicks else BACK_CALCULATED


def _cycle(loop: Loop) -> int:
    """CYCLE in whole ms."""
    return min(max(nearest(loop.sample_time * MS), SHORTEST_CYCLE), LONGEST_CYCLE)


def _puts(loop: Loop) -> list[Put]:
    """Where the neutral fields of a loop went."""
    cascade, windup = loop.mode == "cascade", "" if loop.anti_windup else HELD
    form = "" if loop.tuning.proportional else "in the independent form (PID_EQ FALSE): no proportional action"
    none = "nothing says the set point: at this one the output is least" if loop.setpoint.value is None else ""
    cycle = loop.sample_time * MS
    whole = "CYCLE is whole milliseconds" if cycle != _cycle(loop) else ""
    held = SHORTEST_CYCLE <= cycle <= LONGEST_CYCLE
    rows = [
        Put("PID_DIR", "output_raises_pv"),
        Put("CYCLE", "sample_time", whole, exact=cycle, clamped=not held),
        Put("Kc_Kp", "tuning.gain"),
        Put("PID_EQ", "tuning.proportional", form),
        Put("Ti_Ki", "tuning.integral_time"),
        Put("Td_Kd", "tuning.derivative_time"),
        Put("PID_DE", "tuning.derivative_on"),
        Put("Tf", "tuning.derivative_filter"),
        Put("MV_MIN", "output.limits.0"),
        Put("MV_MAX", "output.limits.1"),
        Put("output.range", "output.range"),
        Put("pv.range", "pv.range"),
        Put("BIAS", "output.bias"),
        Put("PID_MODE", "anti_windup", windup, assumed=not loop.anti_windup),
        Put("PID_MAN", "mode", "link the loops in the program" if cascade else "", assumed=cascade),
        Put("MOUT", "output.manual"),
        Put("pv.unit", "pv.unit"),
        Put("output.unit", "output.unit"),
    ]
    rows.append(Put("SV", None if loop.setpoint.value is None else "setpoint.value", none))
    if loop.deadband:
        rows.append(Put("ERR_DBW", "deadband", DEAD_BAND))
    return [*rows, *dropped(loop, NO_TWIN)]
