"""DPIDE instructions as neutral loops: operands are engineering units already."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import ZERO, dependent
from pidcfg.conversion.ledger import Missing, Neutral, Said
from pidcfg.encoders.values import present
from pidcfg.refs import Decision
from pidcfg.schemas.base import plain_number
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE

if TYPE_CHECKING:
    from pidcfg.schemas.dpide import DpideFile
    from pidcfg.schemas.dpide import Loop as DpideLoop

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
HELD = "DPIDE always holds its integral at the limits of MV"
BELOW_ZERO = "what is below 0 counts as 0"
TUNES = "start the auto-tuning as the target does it"
NOTHING_LOST = {
    "PV": "the process's",
    "device": "a place, which means nothing elsewhere",
    "devices": "places, likewise",
    "MOUT_AUTO": "the change to manual is bumpless, as in every PLC that keeps its output then",
    "PID_DE": "of no effect without a derivative",
}
"""Fields that may come without a line in the report, and why."""


def to_neutral(config: DpideFile) -> list[Neutral]:
    """The neutral loops of a configuration."""
    return [_neutral(loop, i, config.plc.interrupt_task) for i, loop in enumerate(config.loops)]


def _neutral(loop: DpideLoop, i: int, interval: int | None) -> Neutral:
    out = Neutral({})
    if loop.pv.range is None:
        message = f"the PV of {loop.name} has no range: add pv.range with its values at 0 % and 100 %"
        out.missing.append(Missing(("loops", i), "pv.range", message))
    if loop.MV_MAX == loop.MV_MIN:
        message = f"MV_MAX and MV_MIN of {loop.name} are both {plain_number(loop.MV_MAX)}: write the limits of MV"
        out.missing.append(Missing(("loops", i, "MV_MAX"), "MV_MAX", message))
    if out.missing or loop.pv.range is None:
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
            "manual": plain_number(min(max(loop.MOUT if loop.PID_RUN else ZERO, low), high)),
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
        Said("name", loop.name, ("name",)),
        *([] if loop.description is None else [Said("description", loop.description, ("description",))]),
        Said("PID_DIR", loop.PID_DIR, ("output_raises_pv",)),
        Said("SV", loop.SV, ("setpoint.value",)),
        Said("PID_MAN", loop.PID_MAN, ("mode",)),
        Said("PID_RUN", loop.PID_RUN, ("mode",), "" if loop.PID_RUN else "off: it goes over in manual, with output 0"),
    ]
    if loop.PID_MODE == 1:
        said.append(Said("PID_MODE", 1, note=TUNES))
    else:
        said.append(Said("PID_MODE", loop.PID_MODE, ("anti_windup",), HELD, assumed=loop.PID_MODE != BACK_CALCULATED))
    if loop.ERR_DBW:
        said.append(Said("ERR_DBW", loop.ERR_DBW, ("deadband",), DEAD_BAND))
    for key in ("pv", "output"):
        scale = getattr(loop, key)
        if scale.range is not None:
            said.append(Said(f"{key}.range", list(scale.range), (f"{key}.range",)))
        if scale.unit is not None:
            said.append(Said(f"{key}.unit", scale.unit, (f"{key}.unit",)))
    return said


def _said_terms(loop: DpideLoop, interval: int | None) -> list[Said]:
    """The operands of the equation."""
    cycle = "" if interval is None else f"the interrupt task's interval of {interval} ms counts"
    said = [
        Said("CYCLE", loop.CYCLE, ("sample_time",), cycle),
        Said("Kc_Kp", loop.Kc_Kp, ("tuning.gain", "tuning.proportional"), _below_zero(loop.Kc_Kp)),
        Said("Ti_Ki", loop.Ti_Ki, ("tuning.integral_time",), _below_zero(loop.Ti_Ki)),
        Said("Td_Kd", loop.Td_Kd, ("tuning.derivative_time",), _below_zero(loop.Td_Kd)),
        Said("PID_EQ", loop.PID_EQ, ("tuning.gain",)),
    ]
    if loop.Td_Kd > 0:
        said.append(Said("PID_DE", loop.PID_DE, ("tuning.derivative_on",)))
    if loop.Tf:
        said.append(Said("Tf", loop.Tf, ("tuning.derivative_filter",), _below_zero(loop.Tf)))
    return said


def _below_zero(value: Decimal) -> str:
    return BELOW_ZERO if value < 0 else ""


def _said_output(loop: DpideLoop) -> list[Said]:
    """Limits, and the scale that they stand for where no range is given."""
    ends, note = ("output.limits.0", "output.limits.1"), ""
    if loop.MV_MIN > loop.MV_MAX:
        ends, note = ends[::-1], "MV_MIN is above MV_MAX: the PLC swaps them"
    said = [Said("MV_MIN", loop.MV_MIN, ends[:1], note), Said("MV_MAX", loop.MV_MAX, ends[1:], note)]
    if loop.PID_RUN:
        said.append(Said("MOUT", loop.MOUT, ("output.manual",)))
    elif loop.MOUT:
        said.append(
            Said("MOUT", loop.MOUT, note="the loop is off, and its output is 0: write it when you switch it on")
        )
    if loop.output.range is None:
        note = "no output.range is given: MV_MIN and MV_MAX are taken for 0 % and 100 %"
        said.append(Said("output.range", None, ("output.range",), note, assumed=True))
    if loop.BIAS:
        said.append(Said("BIAS", loop.BIAS, ("output.bias",)))
    return said
