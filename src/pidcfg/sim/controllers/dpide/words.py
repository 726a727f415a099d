"""From the operands of a DPIDE instruction to the numbers that it calculates with, and back."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.parameters import shown
from pidcfg.schemas.dpide import LONGEST_CYCLE, SHORTEST_CYCLE
from pidcfg.sim.controllers.dpide.equation import coefficients
from pidcfg.sim.controllers.dpide.setting import PID_MODES
from pidcfg.sim.controllers.dpide.state import OFF, TUNING
from pidcfg.sim.plc import COUNTS, TICKS
from pidcfg.sim.records import read_registers, register_values
from pidcfg.sim.terms import single

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.dpide import Scale
    from pidcfg.sim.controllers.dpide.state import Config, State

MILLISECOND = TICKS // 1000
NOT_NEGATIVE = ("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
"""Operands of which a negative value counts as 0."""
Operands = dict[str, float]
"""BOOL as 0 or 1, DINT and REAL."""


def operands_of(words: Mapping[str, Any], loop: str) -> tuple[Operands, list[str]]:
    """The operands of a loop, and which are no value; what a listing lacks is FALSE or 0, but for PID_RUN."""
    operands: Operands = {}
    problems: list[str] = []
    for name, row in ROWS.items():
        default = float(name == "PID_RUN")
        content = words.get(f"{loop}.{name}", default)
        wrong = not isinstance(content, bool | int | float)
        if wrong or (name == "PID_MODE" and content not in PID_MODES):
            problems.append(f"{name}: {content} means nothing there, {shown(row.type, default)} is taken")
            content = default
        operands[name] = content
    return operands, problems


def configure(c: Config, s: State, operands: Operands, interval: int) -> None:
    """From the operands to the records of an instruction; ``interval`` of an interrupt task in ticks, 0: none."""
    read_registers(c, operands)
    read_registers(s, operands, single)
    c.band = abs(single(operands["ERR_DBW"]))
    c.low, c.high = sorted(single(operands[name]) for name in ("MV_MIN", "MV_MAX"))
    s.period = interval or sampling_time(int(operands["CYCLE"]))
    coefficients(c, s)


def absorb(operands: Operands, s: State) -> None:
    """Write the instruction's values to its operands."""
    operands |= register_values(s)


def sampling_time(cycle: int) -> int:
    """CYCLE in ticks."""
    return min(max(cycle, SHORTEST_CYCLE), LONGEST_CYCLE) * MILLISECOND


def scale_of(scale: Scale, setpoint: float) -> tuple[float, float, int]:
    """The ends of PV's range; without one 0 to 1, widened to SV (D279)."""
    if scale.range is not None:
        return float(scale.range[0]), float(scale.range[1]), COUNTS
    return min(0.0, setpoint), max(1.0, setpoint), COUNTS


def effect(name: str, c: Config, s: State, operands: Operands, interval: int) -> str | None:
    """Why an operand that has just been written does not act as it stands, if so."""
    value = operands[name]
    if name in NOT_NEGATIVE and value < 0:
        return "what is below 0 counts as 0"
    if name == "MOUT":
        return _of_mout(c, s)
    if name == "CYCLE" and interval:
        return "has no effect: the interval of the interrupt task is the sampling time"
    if name == "CYCLE" and s.period != value * MILLISECOND:
        return f"counts as {s.period // MILLISECOND} ms"
    if name in {"MV_MAX", "MV_MIN"} and operands["MV_MAX"] < operands["MV_MIN"]:
        return "MV_MAX is below MV_MIN: each is taken for the other"
    if name == "I_MV" and s.ki <= 0.0:
        return "the next calculation makes it 0: there is no integral"
    if name == "PID_MAN" and s.wanted == TUNING:
        return "has no effect while PID_MODE is 1"
    return None


def _of_mout(c: Config, s: State) -> str | None:
    if s.wanted == OFF:
        return "MV stays 0 while PID_RUN is FALSE"
    if c.manual and s.wanted != TUNING:
        return None
    follows = "; MOUT_AUTO is TRUE, so MOUT follows MV again" if c.follow else ""
    if c.joined:
        follows = "; it stands in the device of MV, which overwrites it"
    return f"MOUT acts in manual only{follows}"
