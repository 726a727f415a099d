"""Keys of other families, and words of the field, in a file: the key here, and how the number changes."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.contract import tables_of
from pidcfg.schemas.document import models_in
from pidcfg.schemas.terms import BANDS, DIRECTION, ENDS, WORDS, leaves
from pidcfg.text.signs import fold_word
from pidcfg.validate.purpose import action_key, action_word
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.regmap import GainUnit
    from pidcfg.text.paths import Path

# --- What the families have different keys for, beside the table of words that sheets use as well ---------------------

ANTI_WINDUP = ("bias_freeze", "freeze_bias", "anti_windup")
MORE_WORDS: dict[str, tuple[str, ...]] = {
    "bias offset": ("output.offset", "output.bias", "BIAS"),
    "windup integral_stop": ANTI_WINDUP,
    "rate_limit output_rate max_output_rate slew_rate ramp_rate rampe": ("output.max_rate",),
    "derivative_lag rate_filter d_filter td_filter vorhaltfilter": ("tuning.derivative_filter", "Tf"),
    "istwert messwert regelgrösse regelgröße process_value process_variable": ("pv", "PV"),
    "stellgrösse stellgröße stellwert ausgang": ("output", "MV"),
    "grenzwerte alarme": ("alarms",),
    "regelparameter parameter": ("tuning",),
    "ki": ("Ti_Ki",),
    "kd": ("Td_Kd",),
}
"""Words that stand for no column of a sheet."""
GAIN = WORDS["gain kp p kr proportional_gain verstärkung"]
RESET = WORDS["reset ti tn integral integral_time nachstellzeit"]
SAMPLE = WORDS["sample sample_time sample_rate abtastzeit"]
ROWS = {word: keys for table in (WORDS, MORE_WORDS) for words, keys in table.items() for word in words.split()}
GAIN_UNITS = {
    "dl06": "% of output per % of PV",
    "click": "% of output per unit of the PV",
    "ezlogix": "output counts per PV count",
    "nextopid": "MV units per PV unit",
    "dpide": "output units per PV unit",
    "generic": "output units per PV unit",
}
"""What a gain is in a file of each family."""
SAMPLE_UNITS = {"dl06": "s", "ezlogix": "s", "nextopid": "s", "dpide": "ms"}
"""What a bare sample time is in; the others want a unit."""
REPEATS = {"repeats_per_minute", "repeats_per_min", "repeats", "reset_rate"}
PAIRS = {
    ("limits", "lower_limit"): "lower_limit and upper_limit",
    ("lower_limit", "limits"): "limits: [low, high]",
    ("upper_limit", "limits"): "limits: [low, high]",
}
"""What a key of limits is where the place knows another one."""


class Foreign(NamedTuple):
    """The key that another one stands for, from the loop, and what to know of the number."""

    key: str
    note: str


def foreign_key(key: str, root: type[BaseModel], place: Path) -> Foreign | None:
    """What a key of another family, or a word of the field, is in a file of this family; None where nothing tells."""
    own = next((vendor.key for vendor in VENDORS.values() if vendor.model is root), None)
    if own is None or place[:1] != ("loops",) or fold_word(key) in {fold_word(_last(k)) for k in _keys(own)}:
        return None
    word = key.casefold().replace("-", "_").replace(" ", "_")
    if word in BANDS:
        return Foreign(_known(GAIN, own), _of_band(own))
    if word in REPEATS:
        return Foreign(_known(RESET, own), "60 / repeats per minute is the time in s")
    keys = _row_of(key, word)
    target = _known(keys, own)
    if not target:
        return None
    owners = [vendor.key for vendor in VENDORS.values() if vendor.key != own and _has(vendor.key, key, keys)]
    return Foreign(target, _note(keys, owners, own))


def pair_for(key: str, known: Sequence[str]) -> str | None:
    """What a key of limits is where the place knows another one."""
    return next((text for (written, other), text in PAIRS.items() if written == key and other in known), None)


def shown(target: str, place: Path) -> str:
    """A key of a loop as it is written at a place of it."""
    section, _, last = target.removesuffix(ENDS[0]).removesuffix(ENDS[1]).rpartition(".")
    pair = ": [low, high]" * target.endswith(ENDS)
    here = ".".join(step for step in place[1:] if isinstance(step, str))
    return f"{section}: {{{last}{pair or ': …'}}}" if section not in {here, ""} else f"{last}{pair}"


def _row_of(key: str, word: str) -> tuple[str, ...]:
    """All keys for what a word stands for."""
    if word in ROWS:
        return ROWS[word]
    named = (keys for keys in (DIRECTION, ANTI_WINDUP, *WORDS.values()) if key in map(_last, keys))
    return next(named, ()) if key not in AMBIGUOUS else ()


AMBIGUOUS = {"value", "low", "high", "limits", "range", "unit", "low_low", "high_high", "source", "name", "use"}
"""Last words of keys that stand below several others."""


def _last(key: str) -> str:
    return key.removesuffix(ENDS[0]).removesuffix(ENDS[1]).rpartition(".")[2]


@cache
def _keys(vendor: str) -> Mapping[str, None]:
    """The keys of a family's loops, from the loop, sections with them."""
    keys: dict[str, None] = {}
    for model in models_in(VENDORS[vendor].model.model_fields["loops"].annotation):
        for key, is_pair in leaves(model):
            keys |= dict.fromkeys((key.partition(".")[0], key, *(f"{key}{end}" for end in ENDS if is_pair)))
    return keys


def _known(keys: Sequence[str], vendor: str) -> str:
    return next((key for key in keys if key in _keys(vendor)), "")


def _has(vendor: str, key: str, keys: Sequence[str]) -> bool:
    """Whether a family has a key of this name for the same thing."""
    return any(fold_word(_last(one)) == fold_word(key) for one in keys if one in _keys(vendor))


def _of_band(own: str) -> str:
    """The gain of a proportional band in %."""
    spans = {"span": "", "percent": " * 100 / PV span", "engineering": " * output span / PV span"}[_counted_in(own)]
    return f"100 / proportional band{spans} is the gain, in {GAIN_UNITS[own]}"


def _note(keys: Sequence[str], owners: Sequence[str], own: str) -> str:
    """What to know of the number of a key of other families."""
    if keys == DIRECTION:
        others: dict[str, list[str]] = {}
        for owner in owners:
            others.setdefault(_heating(owner), []).append(owner)
        there = "".join(f"{text} in {' and '.join(names)}, " for text, names in others.items())
        return f"Heating is {there}{_heating(own)} here"
    if keys == GAIN:
        there = "".join(f"; {owner}: {GAIN_UNITS[owner]}, {_factor(owner, own)}" for owner in owners)
        return f"Here it is in {GAIN_UNITS[own]}{there}"
    if keys == SAMPLE:
        unit = SAMPLE_UNITS.get(own)
        return f"A bare number is in {unit} here" if unit else "Write it with its unit here, as in 500 ms"
    return ""


def _factor(owner: str, own: str) -> str:
    """What the gain of another family is times, to be one here."""
    there, here = _counted_in(owner), _counted_in(own)
    if (there == "span") != (here == "span"):
        return "times PV span / output span" if here == "span" else "times output span / PV span"
    return "the same number if the output is in %" if "percent" in {there, here} else "the same number"


def _counted_in(family: str) -> GainUnit:
    """What the gain of a family is counted in."""
    return tables_of(VENDORS[family]).TUNED.gain_unit


def _heating(family: str) -> str:
    """How a family writes that the PV rises with the output."""
    vendor = VENDORS[family]
    return f"{action_key(vendor)}: {action_word(vendor, raises_pv=True)}"
