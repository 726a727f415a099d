"""Error term and alarms of a DL06 loop, to the neutral form."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.arithmetic import ZERO, product, quotient, rounded
from pidcfg.conversion.to_neutral.dl06_loop import NOTHING, OFF, shown
from pidcfg.conversion.to_neutral.dl06_scales import distance, flow, position
from pidcfg.encoders.dl06.encode import deviation_alarms_on, pv_alarms_on
from pidcfg.schemas.base import EXACT, Quantity

if TYPE_CHECKING:
    from pidcfg.conversion.to_neutral.dl06_loop import Reader

PV_POINTS = ("low_low", "low", "high", "high_high")
DEVIATIONS = {"yellow": "high", "red": "high_high"}
ZERO_WORD = "not given: the PLC compares with 0 counts"
ROOT = "it compares the differential pressure, not its root: choose it anew for the flow"


def read_error(r: Reader) -> None:
    """Curve and deadband of the error."""
    error, scale = r.loop.error, r.scales["sp"]
    is_squared = error.curve == "squared"
    if is_squared:
        r.drop("error.curve", error.curve, "square the error, keeping its sign, before the loop, or retune it")
    if not r.active("error.deadband", error.deadband, error.deadband_enabled):
        return
    if error.deadband is None:
        r.drop("error.deadband_enabled", error.deadband_enabled, "on without a value: it ignores nothing")
        return
    size = distance(scale, error.deadband)
    note = ""
    if is_squared:  # D31: the deadband is applied to the square
        size = rounded(EXACT.sqrt(max(product(size, scale.width), ZERO)))
        note = "compared with the squared error here: its root"
    r.carry("error.deadband", shown(error.deadband), size, "deadband", note=note)


def read_alarms(r: Reader) -> None:
    """All alarms of a loop."""
    alarms = r.loop.alarms
    points = {key: getattr(alarms.pv, key) for key in PV_POINTS} if alarms.pv else {}
    for key, value in points.items():
        _point(r, f"alarms.pv.{key}", value, f"alarms.pv.{key}", on=pv_alarms_on(r.loop))
    points = {key: getattr(alarms.deviation, key) for key in DEVIATIONS} if alarms.deviation else {}
    for key, value in points.items():
        to = f"alarms.deviation.{DEVIATIONS[key]}"
        _point(r, f"alarms.deviation.{key}", value, to, on=deviation_alarms_on(r.loop))
    _rate_of_change(r)
    if alarms.hysteresis is not None:
        _span(r, "alarms.hysteresis", alarms.hysteresis, "alarms.hysteresis")


def _point(r: Reader, field: str, value: Quantity | None, to: str, *, on: bool) -> None:
    """A point of a group that one bit enables: one that is not given is compared all the same (D20)."""
    if not on:
        if value is not None:
            r.drop(field, shown(value), OFF)
        return
    held, note = (NOTHING, ZERO_WORD) if value is None else (value, "")
    if to.startswith("alarms.deviation"):
        _span(r, field, held, to, note=note)
    else:
        change = flow if r.loop.pv.square_root else position
        point = change(r.scales["pv"], held)
        r.carry(field, shown(value), point, to, note=note, assumed=value is None)


def _span(r: Reader, field: str, value: Quantity, to: str, note: str = "") -> None:
    """A difference of PVs."""
    if r.loop.pv.square_root:
        r.drop(field, shown(value), ROOT)
    else:
        r.carry(field, shown(value), distance(r.scales["pv"], value), to, note=note, assumed=bool(note))


def _rate_of_change(r: Reader) -> None:
    alarms, field = r.loop.alarms, "alarms.rate_of_change"
    rate = alarms.rate_of_change
    if not r.active(field, rate, alarms.rate_of_change_enabled):
        return
    change = NOTHING if rate is None else rate.per_sample(r.loop.sample_rate)
    if r.loop.pv.square_root:
        r.drop(field, shown(rate), ROOT)
        return
    value = rounded(quotient(distance(r.scales["pv"], change), r.loop.sample_rate))
    if rate is None:
        r.carry("alarms.rate_of_change_enabled", alarms.rate_of_change_enabled, value, field, note=ZERO_WORD)
    else:
        r.carry(field, str(rate), value, field)
