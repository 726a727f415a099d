"""DPIDE and the neutral loop: operands are engineering units already, only the form and the direction are its own."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.convert.ledger import Missing, Neutral, Put, Said, Target
from pidcfg.convert.terms import ZERO, dependent, number
from pidcfg.convert.twins import ALARMS, dropped
from pidcfg.encoders.dpide.files import DECODE_OPTIONS
from pidcfg.encoders.plain import present
from pidcfg.refs import Decision
from pidcfg.schemas.base import plain_number
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.dpide import DpideFile
    from pidcfg.schemas.dpide import Loop as DpideLoop
    from pidcfg.schemas.generic import GenericFile, Loop

D296 = Decision(
    296, "a DPIDE is written in the dependent form, in mode 2 where windup is to be prevented",
    "PID_EQ TRUE with Kc, Ti and Td; without a proportional action PID_EQ FALSE with Kp 0. PID_MODE 2 where the source "
    "has an anti-windup, else 0.",
    "The dependent form is the one that all others have a twin of; mode 2 works the integral out of the limited MV.",
)  # fmt: skip
BLOCK = 30
"""Registers of an I_MV block."""
MS = 1000
DEAD_BAND = "inside the band DPIDE counts the error as 0 only after PV has crossed SV"
HELD = "DPIDE always holds its integral at the limits of MV"
CONVERT_OPTIONS = tuple(row for row in DECODE_OPTIONS if row.key == "device")
NOTHING_LOST = ("name", "description", "pv.range", "output.range", "PV", "device", "devices", "MOUT_AUTO")
"""Names go with the loop, ranges with every quantity, the PV is the process's, and places mean nothing elsewhere. That
MOUT follows MV makes the change to manual bumpless, as it is in every PLC that keeps its output then."""
COMPARE, PULSES = "compare PV in the program", "use GPWM behind the instruction"
NO_TWIN = {
    "setpoint.limits.0": "limit SV in the program",
    "setpoint.limits.1": "limit SV in the program",
    "setpoint.source": "move MV of that loop to SV in the program",
    "pv.filter": "filter PV before the instruction",
    "pv.square_root": "take the root of PV before the instruction",
    "output.max_rate": "limit the change of MV behind the instruction",
    **dict.fromkeys(("output.pulse.period", "output.pulse.min_on", "output.pulse.min_off"), PULSES),
    **dict.fromkeys(ALARMS, COMPARE),
}
"""Neutral fields that a DPIDE does not have, with what to program instead."""


def to_neutral(config: DpideFile) -> list[Neutral]:
    """The neutral loops of a configuration."""
    return [_neutral(loop, i, config.plc.interrupt_task) for i, loop in enumerate(config.loops)]


def _neutral(loop: DpideLoop, i: int, interval: int | None) -> Neutral:
    out = Neutral({})
    if loop.pv.range is None:
        message = f"the PV of {loop.name} has no range: add pv.range with its values at 0 % and 100 %"
        out.missing.append(Missing(("loops", i), "pv.range", message))
        return out
    cycle = interval if interval is not None else min(max(loop.CYCLE, SHORTEST_CYCLE), LONGEST_CYCLE)
    low, high = sorted((loop.MV_MIN, loop.MV_MAX))
    scale = loop.output.range or (low, high)
    out.loop = {
        "name": loop.name,
        **present({"description": loop.description}),
        "mode": "manual" if loop.PID_MAN or not loop.PID_RUN else "auto",
        "output_raises_pv": loop.PID_DIR,
        "sample_time": plain_number(Decimal(cycle) / MS),
        "tuning": _tuning(loop),
        "pv": {"range": [*map(plain_number, loop.pv.range)], **present({"unit": loop.pv.unit})},
        "setpoint": {"value": plain_number(loop.SV)},
        "output": {
            "range": [*map(plain_number, scale)],
            **present({"unit": loop.output.unit}),
            "limits": [plain_number(low), plain_number(high)],
            "bias": plain_number(loop.BIAS),
            "manual": plain_number(loop.MOUT),
        },
        "deadband": plain_number(abs(loop.ERR_DBW)),
        "anti_windup": True,
    }
    out.said = [*_said(loop), *_said_terms(loop, interval), *_said_output(loop)]
    return out


def _tuning(loop: DpideLoop) -> dict[str, Any]:
    gain, integral, derivative = (max(value, ZERO) for value in (loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd))
    acts = True
    if not loop.PID_EQ:
        gain, integral, derivative, acts = dependent(gain, integral, derivative)
    return {
        "gain": plain_number(gain),
        "integral_time": plain_number(integral),
        "derivative_time": plain_number(derivative),
        "proportional": acts,
        "derivative_on": "pv" if loop.PID_DE else "error",
        "derivative_filter": plain_number(max(loop.Tf, ZERO)),
    }


def _said(loop: DpideLoop) -> list[Said]:
    said = [
        Said("PID_DIR", loop.PID_DIR, ("output_raises_pv",)),
        Said("SV", loop.SV, ("setpoint.value",)),
        Said("PID_MAN", loop.PID_MAN, ("mode",)),
        Said("PID_RUN", loop.PID_RUN, ("mode",), "" if loop.PID_RUN else "a loop that is off goes over in manual"),
        Said("PID_MODE", loop.PID_MODE, ("anti_windup",), HELD),
    ]
    if loop.ERR_DBW:
        said.append(Said("ERR_DBW", loop.ERR_DBW, ("deadband",), DEAD_BAND))
    for key in ("pv", "output"):
        unit = getattr(loop, key).unit
        if unit is not None:
            said.append(Said(f"{key}.unit", unit, (f"{key}.unit",)))
    return said


def _said_terms(loop: DpideLoop, interval: int | None) -> list[Said]:
    """The operands of the equation."""
    cycle = "" if interval is None else f"the interrupt task's interval of {interval} ms counts"
    said = [
        Said("CYCLE", loop.CYCLE, ("sample_time",), cycle),
        Said("Kc_Kp", loop.Kc_Kp, ("tuning.gain", "tuning.proportional")),
        Said("Ti_Ki", loop.Ti_Ki, ("tuning.integral_time",)),
        Said("Td_Kd", loop.Td_Kd, ("tuning.derivative_time",)),
        Said("PID_EQ", loop.PID_EQ, ("tuning.gain",)),
    ]
    if loop.Td_Kd > 0:
        said.append(Said("PID_DE", loop.PID_DE, ("tuning.derivative_on",)))
    if loop.Tf > 0:
        said.append(Said("Tf", loop.Tf, ("tuning.derivative_filter",)))
    return said


def _said_output(loop: DpideLoop) -> list[Said]:
    """Limits, and the scale that they stand for where no range is given."""
    said = [
        Said("MV_MIN", loop.MV_MIN, ("output.limits.0",)),
        Said("MV_MAX", loop.MV_MAX, ("output.limits.1",)),
        Said("MOUT", loop.MOUT, ("output.manual",)),
    ]
    if loop.output.range is None:
        note = "no output.range is given: MV_MIN and MV_MAX are taken for 0 % and 100 %"
        said.append(Said("output.range", None, ("output.range",), note, assumed=True))
    if loop.BIAS:
        said.append(Said("BIAS", loop.BIAS, ("output.bias",)))
    return said


# --- to DPIDE --------------------------------------------------------------------------------------------------------


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
        "PID_MODE": 2 if loop.anti_windup else 0,
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
    return loop.pv.range[0] if loop.setpoint.value is None else loop.setpoint.value


def _cycle(loop: Loop) -> int:
    """CYCLE in whole ms."""
    return max(1, round(loop.sample_time * MS))


def _puts(loop: Loop) -> list[Put]:
    """Where the neutral fields of a loop went."""
    windup = "" if loop.anti_windup else HELD
    form = "" if loop.tuning.proportional else "in the independent form (PID_EQ FALSE): no proportional action"
    set_by_hand = "write SV in the program" if loop.setpoint.value is None else ""
    cycle = "CYCLE is whole milliseconds" if loop.sample_time * MS != _cycle(loop) else ""
    rows = [
        Put("PID_DIR", "output_raises_pv"), Put("CYCLE", "sample_time", cycle), Put("Kc_Kp", "tuning.gain"),
        Put("PID_EQ", "tuning.proportional", form), Put("Ti_Ki", "tuning.integral_time"),
        Put("Td_Kd", "tuning.derivative_time"), Put("PID_DE", "tuning.derivative_on"),
        Put("Tf", "tuning.derivative_filter"), Put("MV_MIN", "output.limits.0"), Put("MV_MAX", "output.limits.1"),
        Put("output.range", "output.range"), Put("pv.range", "pv.range"), Put("BIAS", "output.bias"),
        Put("PID_MODE", "anti_windup", windup),
        Put("PID_MAN", "mode", "link the loops in the program" if loop.mode == "cascade" else ""),
        Put("MOUT", "output.manual"), Put("pv.unit", "pv.unit"), Put("output.unit", "output.unit"),
    ]  # fmt: skip
    rows.append(Put("SV", None if loop.setpoint.value is None else "setpoint.value", set_by_hand))
    if loop.deadband:
        rows.append(Put("ERR_DBW", "deadband", DEAD_BAND))
    return [*rows, *dropped(loop, NO_TWIN)]
