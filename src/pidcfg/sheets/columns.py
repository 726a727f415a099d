"""What a column of a sheet is: a key of the vendor's loops as the file format writes it, or a common word for one."""

from __future__ import annotations

import re
from difflib import get_close_matches
from functools import cache
from typing import TYPE_CHECKING

from pidcfg.schemas.base import SECONDS, UNIT_WORDS
from pidcfg.schemas.document import models_in

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic import BaseModel

    from pidcfg.vendors import Vendor

ENDS = (" low", " high")
"""Behind the key of a pair: its two ends, each a column."""
BRACKETS = re.compile(r"\s*[\[(].*?[\])]\s*$")
TIME = re.compile("(" + "|".join((*SECONDS, *UNIT_WORDS)) + r")\.?", re.IGNORECASE)
UNIT = re.compile(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
BETWEEN_WORDS = re.compile(r"[\s_\-/]+")
WORDS: dict[str, tuple[str, ...]] = {
    "name tag loop regler kreis messstelle": ("name",),
    "description text service beschreibung bezeichnung": ("description",),
    "mode betriebsart": ("mode",),
    "range_low range_min low pv_low pv_min lrv min von messbereich_von messbereich_anfang anfang": (
        "pv.range low",
        "MinPV",
    ),
    "range_high range_max high pv_high pv_max urv max bis messbereich_bis messbereich_ende ende": (
        "pv.range high",
        "MaxPV",
    ),
    "unit pv_unit einheit": ("pv.unit",),
    "gain kp p kr proportional_gain verstärkung": ("tuning.gain", "tuning.proportional_gain", "Kp", "Kc_Kp"),
    "reset ti integral integral_time nachstellzeit": (
        "tuning.reset",
        "tuning.reset_time",
        "tuning.integral_time",
        "Ti_Ki",
    ),
    "rate td derivative derivative_time vorhaltezeit": (
        "tuning.rate",
        "tuning.derivative_time",
        "tuning.derivative_gain",
        "Td_Kd",
    ),
    "action direction wirkrichtung wirksinn regelsinn": ("action",),
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
TOPICS = (
    (
        re.compile(r"cascade|master|slave|primary|secondary|kaskade|führung|folgeregler", re.IGNORECASE),
        ("cascade_from", "setpoint.source", "SP_CASC"),
        "a cascade",
        "is {}",
    ),
    (
        re.compile(r"ramp|soak|profil|slope|rampe", re.IGNORECASE),
        ("ramp_soak.steps",),
        "a profile",
        "stands in the file, under {}",
    ),
)
"""What headers speak of that may have no column of that name: the keys for it, its name, and where it is told."""
NEAR = 0.72
"""How alike a header and a word must be for the word to be suggested."""


class UnknownColumnError(ValueError):
    """A header that is no key, with the nearest."""


def key_of(header: str, vendor: Vendor) -> str:
    """The key of a column, with ``low`` or ``high`` behind that of a pair; raises `UnknownColumnError`."""
    key = _known(header, vendor)
    if key is not None:
        return key
    raise UnknownColumnError(f"{header!r} is no key of a loop of {vendor.title}; {_cure(header, vendor)}")


def _cure(header: str, vendor: Vendor) -> str:
    """What to do about a header that is no key."""
    keys, folded = _keys(vendor), _folded(vendor)
    text = _text(header)
    for pattern, known, topic, place in TOPICS:
        if pattern.search(text):
            key = next((one for one in known if one in keys), None)
            return f"{topic} {place.format(key)}" if key else f"loops of {vendor.key} have no key for {topic}"
    near = get_close_matches(text.lower(), [*folded, *_words(vendor)], 1, NEAR)
    if near:
        return f"did you mean {folded.get(near[0], near[0])}?"
    return f"columns are keys of {vendor.key}'s loops, such as {', '.join(keys[:6])}; # before a header leaves it out"


def _text(header: str) -> str:
    """A header without brackets."""
    return BRACKETS.sub("", header.strip()).strip()


def _known(header: str, vendor: Vendor) -> str | None:
    """The key that a header is, or that a common word stands for."""
    text = _text(header).lower()
    spelled = BETWEEN_WORDS.sub("_", text)
    return _folded(vendor).get(text) or _folded(vendor).get(spelled) or _words(vendor).get(spelled)


@cache
def _folded(vendor: Vendor) -> dict[str, str]:
    """The keys by their small letters."""
    return {key.lower(): key for key in _keys(vendor)}


def unit_of(header: str) -> str | None:
    """The unit that stands in brackets behind a header: ``Reset [min]``, ``Setpoint (°F)``."""
    match = UNIT.search(header)
    if match is None:
        return None
    time = TIME.fullmatch(match[1])
    return time[1].lower() if time else match[1]


def is_known(header: str, vendor: Vendor) -> bool:
    """Whether a header is a column."""
    return _known(header, vendor) is not None


@cache
def _keys(vendor: Vendor) -> tuple[str, ...]:
    """All keys of a vendor's loops, and the two ends of each pair."""
    pairs: dict[str, bool] = {"name": False}
    for model in models_in(vendor.model.model_fields["loops"].annotation):
        pairs |= _leaves(model)
    return (*pairs, "use", *(f"{key}{end}" for key, pair in pairs.items() if pair for end in ENDS))


def order_of(vendor: Vendor) -> dict[str, int]:
    """The place of every key in the schema."""
    return {key: i for i, key in enumerate(_keys(vendor))}


@cache
def _words(vendor: Vendor) -> dict[str, str]:
    keys = _keys(vendor)
    words: dict[str, str] = {}
    for row, candidates in WORDS.items():
        key = next((candidate for candidate in candidates if candidate in keys), None)
        words |= dict.fromkeys(row.split(), key) if key else {}
    return words


def _leaves(model: type[BaseModel], above: str = "") -> Iterator[tuple[str, bool]]:
    """The keys that have a value, and whether it is a pair."""
    for name, field in model.model_fields.items():
        inner, kind = models_in(field.annotation), str(field.annotation).lower()
        key = f"{above}{field.alias or name}"
        if len(inner) == 1 and "tuple" not in kind:
            yield from _leaves(inner[0], f"{key}.")
        else:
            yield key, "tuple" in kind and "..." not in kind
