"""Error term and alarms of a DL06 loop, to the neutral form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import ZERO, product, quotient, rounded
from pidcfg.conversion.to_neutral.dl06_scales import distance, flow, position
from pidcfg.conversion.to_neutral.dl06_source import NOTHING, OFF, active, shown
from pidcfg.encoders.dl06.encode import deviation_alarms_on, pv_alarms_on
from pidcfg.schemas.numbers import EXACT

if TYPE_CHECKING:
    from pidcfg.conversion.builder import NeutralBuilder
    from pidcfg.conversion.to_neutral.dl06_source import Dl06Loop
    from pidcfg.schemas.base import Quantity

PV_POINTS = ("low_low", "low", "high", "high_high")
DEVIATIONS = {"yellow": "high", "red": "high_high"}
ZERO_WORD = "not given: the PLC compares with 0 counts"
ROOT = "it compares the differential pressure, not its root: choose it anew for the flow"


def error_fields(b: NeutralBuilder, s: Dl06Loop) -> None:
    """Curve and deadband of the error."""
    error, scale = s.loop.error, s.scales["sp"]
    is_squared = error.curve == "squared"
    if is_squared:
        b.drop("error.curve", error.curve, "square the error, keeping its sign, before the loop, or retune it")
    if not active(b, "error.deadband", error.deadband, error.deadband_enabled):
        return
    if error.deadband is None:
        b.drop("error.deadband_enabled", error.deadband_enabled, "on without a value: it ignores nothing")
        return
    size = distance(scale, error.deadband)
    note = ""
    if is_squared:  # D31: the deadband is applied to the square
        size = rounded(EXACT.sqrt(max(product(size, scale.width), ZERO)))
        note = "compared with the squared error here: its root"
    b.put("error.deadband", shown(error.deadband), "deadband", size, note=note)


def alarm_fields(b: NeutralBuilder, s: Dl06Loop) -> None:
    """All alarms of a loop."""
    alarms = s.loop.alarms
    points = {key: getattr(alarms.pv, key) for key in PV_POINTS} if alarms.pv else {}
    for key, value in points.items():
        _point(b, s, f"alarms.pv.{key}", value, f"alarms.pv.{key}", on=pv_alarms_on(s.loop))
    points = {key: getattr(alarms.deviation, key) for key in DEVIATIONS} if alarms.deviation else {}
    for key, value in points.items():
        to = f"alarms.deviation.{DEVIATIONS[key]}"
        _point(b, s, f"alarms.deviation.{key}", value, to, on=deviation_alarms_on(s.loop))
    _rate_of_change(b, s)
    if alarms.hysteresis is not None:
        _span(b, s, "alarms.hysteresis", alarms.hysteresis, "alarms.hysteresis")


def _point(b: NeutralBuilder, s: Dl06Loop, field: str, value: Quantity | None, to: str, *, on: bool) -> None:
    """A point of a group that one bit enables: one that is not given is compared all the same (D20)."""
    if not on:
        if value is not None:
            b.drop(field, shown(value), OFF)
        return
    held, note = (NOTHING, ZERO_WORD) if value is None else (value, "")
    if to.startswith("alarms.deviation"):
        _span(b, s, field, held, to, note=note)
    else:
        change = flow if s.loop.pv.square_root else position
        point = change(s.scales["pv"], held)
        b.put(field, shown(value), to, point, note=note, assumed=value is None)


def _span(b: NeutralBuilder, s: Dl06Loop, field: str, value: Quantity, to: str, note: str = "") -> None:
    """A difference of PVs."""
    if s.loop.pv.square_root:
        b.drop(field, shown(value), ROOT)
    else:
        b.put(field, shown(value), to, distance(s.scales["pv"], value), note=note, assumed=bool(note))


def _rate_of_change(b: NeutralBuilder, s: Dl06Loop) -> None:
    alarms, field = s.loop.alarms, "alarms.rate_of_change"
    rate = alarms.rate_of_change
    if not active(b, field, rate, alarms.rate_of_change_enabled):
        return
    change = NOTHING if rate is None else rate.per_sample(s.loop.sample_rate)
    if s.loop.pv.square_root:
        b.drop(field, shown(rate), ROOT)
        return
    value = rounded(quotient(distance(s.scales["pv"], change), s.loop.sample_rate))
    if rate is None:
        b.put("alarms.rate_of_change_enabled", alarms.rate_of_change_enabled, field, value, note=ZERO_WORD)
    else:
        b.put(field, str(rate), field, value)
