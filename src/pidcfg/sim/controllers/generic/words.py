"""From the parameters of a neutral loop to the numbers that it calculates with."""

from __future__ import annotations

from math import expm1
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.mapping import default_of
from pidcfg.encoders.maps.generic import NEEDED, ROWS
from pidcfg.encoders.parameters import read, store
from pidcfg.schemas.generic import Loop
from pidcfg.sim.controllers.generic.state import UNREACHED
from pidcfg.sim.plc import TICKS
from pidcfg.sim.records import read_registers

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.parameters import Content, Parameter
    from pidcfg.sim.controllers.generic.state import Config, State

Fields = dict[str, Any]
"""Content by path; a field that the configuration leaves out is missing."""
UNKNOWN: Fields = {"sample_time": 1.0, "pv.range.1": 100.0, "output.range.1": 100.0}
"""What is taken for a field that every loop has and a listing lacks, where that is not the nothing of its type."""


def _default(row: Parameter) -> Content | None:
    value = default_of(Loop, row.name)
    if value is not None:
        return store(row.type, value)
    return UNKNOWN.get(row.name, row.type.default) if row.name in NEEDED else None


DEFAULTS: Fields = {name: value for name, row in ROWS.items() if (value := _default(row)) is not None}
"""What fields hold that the file does not give; the others are missing then."""


def fields_of(words: Mapping[str, Any], loop: str) -> tuple[Fields, list[str]]:
    """The parameters of a loop; what a listing lacks and every loop has, and what is no value, is a problem."""
    fields = dict(DEFAULTS)
    problems: list[str] = []
    for path, row in ROWS.items():
        raw = words.get(f"{loop}.{path}")
        content = None if raw is None else read(row.type, raw)
        if content is not None:
            fields[path] = content
        elif raw is not None or path in NEEDED:
            what = "is missing" if raw is None else f"is no {row.type.name}"
            problems.append(f"{path} {what}, {DEFAULTS.get(path, 'nothing')} is taken")
    return fields, problems


def ticks(seconds: float) -> int:
    """A sample time in ticks, one at least."""
    return max(1, round(seconds * TICKS))


def share(time: float, seconds: float) -> float:
    """What a filter with this time constant takes of a difference in each sample."""
    return -expm1(-seconds / time) if time > 0.0 else 1.0


def first_of(f: Fields, *paths: str) -> float:
    """The first of some fields that the loop has."""
    return next(float(f[path]) for path in paths if path in f)


def configure(c: Config, s: State, f: Fields) -> None:
    """From the parameters to the records of a loop."""
    read_registers(c, f)
    s.period = ticks(f["sample_time"])
    seconds = s.period / TICKS
    c.span = (f["pv.range.1"] - f["pv.range.0"]) or 1.0
    c.out_span = (f["output.range.1"] - f["output.range.0"]) or 1.0
    c.low = first_of(f, "output.limits.0", "output.range.0")
    c.high = first_of(f, "output.limits.1", "output.range.1")
    c.rate_limit = f.get("output.max_rate", UNREACHED) * seconds
    c.rate_at = f.get("alarms.rate_of_change", UNREACHED) * seconds
    c.pulses = int(f.get("output.pulse.period", 0.0) > 0.0)
    c.cycle = float(ticks(f.get("output.pulse.period", 1.0)))
    c.min_on, c.min_off = f["output.pulse.min_on"] * TICKS, f["output.pulse.min_off"] * TICKS
    factors(s, f, seconds)


def factors(s: State, f: Fields, seconds: float) -> None:
    """Of the equation and its filters."""
    read_registers(s, f)
    s.kp = s.gain
    s.ki = s.gain * seconds / s.reset if s.reset > 0.0 else 0.0
    s.kd = s.gain * s.rate / seconds
    s.pv_share = share(f["pv.filter"], seconds)
    s.d_share = share(f["tuning.derivative_filter"], seconds)


def effect(path: str, f: Fields, *, by_hand: bool) -> str | None:
    """Why a field that has just been written does not act as it stands, if so."""
    if path == "output.manual" and not by_hand:
        return "output.manual acts in manual only, which keeps the output when it begins"
    if path.startswith("output.pulse.") and "output.pulse.period" not in f:
        return "there is no pulse output: output.pulse.period is not given"
    return None
