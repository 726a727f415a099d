"""What a loop's settings are called, in English and German, and the keys that families have for them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from pidcfg.schemas.document import models_in

if TYPE_CHECKING:
    from pydantic import BaseModel

PAIR_ENDS = (" low", " high")
"""Behind the key of a pair: its two ends, each a column of a sheet."""
DIRECTION_KEYS = ("action", "Direct", "PID_DIR", "output_raises_pv")
BAND_WORDS = {
    "proportional_band",
    "prop_band",
    "p_band",
    "pb",
    "xp",
    "proportionalbereich",
    "proportionalband",
    "p_bereich",
}
TERM_KEYS: dict[str, tuple[str, ...]] = {
    "name tag loop regler kreis messstelle": ("name",),
    "description text service beschreibung bezeichnung": ("description",),
    "mode betriebsart": ("mode",),
    "range_low range_min low pv_low pv_min lrv min von messbereich_von messbereich_anfang messanfang anfang": (
        "pv.range low",
        "MinPV",
    ),
    "range_high range_max high pv_high pv_max urv max bis messbereich_bis messbereich_ende messende ende": (
        "pv.range high",
        "MaxPV",
    ),
    "unit pv_unit einheit": ("pv.unit",),
    "gain kp p kr proportional_gain verstärkung": ("tuning.gain", "tuning.proportional_gain", "Kp", "Kc_Kp"),
    "reset ti tn integral integral_time nachstellzeit": (
        "tuning.reset",
        "tuning.reset_time",
        "tuning.integral_time",
        "Ti_Ki",
    ),
    "rate td tv derivative derivative_time vorhaltezeit vorhaltzeit vorhalt": (
        "tuning.rate",
        "tuning.derivative_time",
        "tuning.derivative_gain",
        "Td_Kd",
    ),
    "action direction richtung wirkrichtung wirksinn wirkungssinn regelsinn": DIRECTION_KEYS,
    "setpoint set_point sp sollwert": ("setpoint.value", "SP", "SV"),
    "sp_low setpoint_low sollwert_min": ("setpoint.limits low", "setpoint.lower_limit"),
    "sp_high setpoint_high sollwert_max": ("setpoint.limits high", "setpoint.upper_limit"),
    "sample sample_time sample_rate abtastzeit": ("sample_rate", "sample_time", "CYCLE"),
    "filter pv_filter filterzeit": ("pv.filter",),
    "out_low output_low stellgrösse_min stellgröße_min": ("output.limits low", "MinMV", "MV_MIN"),
    "out_high output_high stellgrösse_max stellgröße_max": ("output.limits high", "MaxMV", "MV_MAX"),
    "out_unit output_unit": ("output.unit",),
    "deadband totzone": ("error.deadband", "deadband", "DeadBand", "ERR_DBW"),
    "lolo low_low alarm_ll": ("alarms.pv.low_low",),
    "lo alarm_low alarm_l": ("alarms.pv.low",),
    "hi alarm_high alarm_h": ("alarms.pv.high",),
    "hihi high_high alarm_hh": ("alarms.pv.high_high",),
    "master master_loop primary primary_loop major major_loop slave_of cascade_master führungsregler hauptregler": (
        "cascade_from",
        "setpoint.source",
    ),
    "template vorlage": ("use",),
}
"""Common words, in English and German, and the keys that vendors have for them: the first that a vendor has."""


def types_of(model: type[BaseModel], prefix: str = "") -> Iterator[tuple[str, str]]:
    """The keys that have a value, each with its type as text."""
    for name, field in model.model_fields.items():
        inner, kind = models_in(field.annotation), str(field.annotation).lower()
        key = f"{prefix}{field.alias or name}"
        if len(inner) == 1 and "tuple" not in kind:
            yield from types_of(inner[0], f"{key}.")
        else:
            yield key, kind


def leaf_keys(model: type[BaseModel]) -> Iterator[tuple[str, bool]]:
    """The keys that have a value, and whether it is a pair."""
    return ((key, "tuple" in kind and "..." not in kind) for key, kind in types_of(model))
