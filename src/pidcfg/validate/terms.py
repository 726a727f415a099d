"""What people write that a family does not know: keys of others, words of the field, numbers with units."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.contract import tables_of, units_by_path
from pidcfg.schemas.base import SIDES, is_scaled, unit_text, units_of
from pidcfg.schemas.document import models_in
from pidcfg.schemas.numbers import NUMBER, NUMBER_WITH_UNIT, range_cure
from pidcfg.schemas.terms import BAND_WORDS, DIRECTION_KEYS, PAIR_ENDS, TERM_KEYS, leaf_keys
from pidcfg.text.document import Plain
from pidcfg.text.paths import value_at
from pidcfg.text.signs import fold_word
from pidcfg.validate.shared_checks import action_key, action_word
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.regmap import GainUnit
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.vendors import Vendor

# --- What the families have different keys for, beside the table of words that sheets use as well ---------------------

ANTI_WINDUP_KEYS = ("bias_freeze", "freeze_bias", "anti_windup")
VENDOR_WORDS: dict[str, tuple[str, ...]] = {
    "bias offset": ("output.offset", "output.bias", "BIAS"),
    "windup integral_stop": ANTI_WINDUP_KEYS,
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
GAIN_KEYS = TERM_KEYS["gain kp p kr proportional_gain verstärkung"]
RESET_KEYS = TERM_KEYS["reset ti tn integral integral_time nachstellzeit"]
SAMPLE_KEYS = TERM_KEYS["sample sample_time sample_rate abtastzeit"]
KEYS_BY_WORD = {
    word: keys for table in (TERM_KEYS, VENDOR_WORDS) for words, keys in table.items() for word in words.split()
}
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
REPEAT_WORDS = {"repeats_per_minute", "repeats_per_min", "repeats", "reset_rate"}
LIMIT_KEY_TEXTS = {
    ("limits", "lower_limit"): "lower_limit and upper_limit",
    ("lower_limit", "limits"): "limits: [low, high]",
    ("upper_limit", "limits"): "limits: [low, high]",
}
"""What a key of limits is where the place knows another one."""


class KeyTranslation(NamedTuple):
    """The key that another one stands for, from the loop, and what to know of the number."""

    key: str
    note: str


def translate_key(key: str, root: type[BaseModel], parents: Path) -> KeyTranslation | None:
    """What a key of another family, or a word of the field, is in a file of this family; None where nothing tells."""
    family = next((vendor.key for vendor in VENDORS.values() if vendor.model is root), None)
    if (
        family is None
        or parents[:1] != ("loops",)
        or fold_word(key) in {fold_word(_last_step(k)) for k in _loop_keys(family)}
    ):
        return None
    word = key.casefold().replace("-", "_").replace(" ", "_")
    if word in BAND_WORDS:
        return KeyTranslation(_first_known_key(GAIN_KEYS, family), _band_note(family))
    if word in REPEAT_WORDS:
        return KeyTranslation(_first_known_key(RESET_KEYS, family), "60 / repeats per minute is the time in s")
    keys = _keys_for_word(key, word)
    target = _first_known_key(keys, family)
    if not target:
        return None
    owners = [vendor.key for vendor in VENDORS.values() if vendor.key != family and _has_key(vendor.key, key, keys)]
    return KeyTranslation(target, _number_note(keys, owners, family))


def limit_key_text(key: str, known: Sequence[str]) -> str | None:
    """What a key of limits is where the place knows another one."""
    return next((text for (written, other), text in LIMIT_KEY_TEXTS.items() if written == key and other in known), None)


def key_text(target: str, parents: Path) -> str:
    """A key of a loop as it is written at a place of it."""
    section, _, last = target.removesuffix(PAIR_ENDS[0]).removesuffix(PAIR_ENDS[1]).rpartition(".")
    pair = ": [low, high]" * target.endswith(PAIR_ENDS)
    here = ".".join(step for step in parents[1:] if isinstance(step, str))
    return f"{section}: {{{last}{pair or ': …'}}}" if section not in {here, ""} else f"{last}{pair}"


def _keys_for_word(key: str, word: str) -> tuple[str, ...]:
    """All keys for what a word stands for."""
    if word in KEYS_BY_WORD:
        return KEYS_BY_WORD[word]
    rows = (keys for keys in (DIRECTION_KEYS, ANTI_WINDUP_KEYS, *TERM_KEYS.values()) if key in map(_last_step, keys))
    return next(rows, ()) if key not in AMBIGUOUS_STEPS else ()


AMBIGUOUS_STEPS = {"value", "low", "high", "limits", "range", "unit", "low_low", "high_high", "source", "name", "use"}
"""Last words of keys that stand below several others."""


def _last_step(key: str) -> str:
    return key.removesuffix(PAIR_ENDS[0]).removesuffix(PAIR_ENDS[1]).rpartition(".")[2]


@cache
def _loop_keys(vendor: str) -> Mapping[str, None]:
    """The keys of a family's loops, from the loop, sections with them."""
    keys: dict[str, None] = {}
    for model in models_in(VENDORS[vendor].model.model_fields["loops"].annotation):
        for key, is_pair in leaf_keys(model):
            keys |= dict.fromkeys((key.partition(".")[0], key, *(f"{key}{end}" for end in PAIR_ENDS if is_pair)))
    return keys


def _first_known_key(keys: Sequence[str], vendor: str) -> str:
    return next((key for key in keys if key in _loop_keys(vendor)), "")


def _has_key(vendor: str, key: str, keys: Sequence[str]) -> bool:
    """Whether a family has a key of this name for the same thing."""
    return any(fold_word(_last_step(name)) == fold_word(key) for name in keys if name in _loop_keys(vendor))


def _band_note(family: str) -> str:
    """The gain of a proportional band in %."""
    spans = {"span": "", "percent": " * 100 / PV span", "engineering": " * output span / PV span"}[_gain_unit(family)]
    return f"100 / proportional band{spans} is the gain, in {GAIN_UNITS[family]}"


def _number_note(keys: Sequence[str], owners: Sequence[str], family: str) -> str:
    """What to know of the number of a key of other families."""
    if keys == DIRECTION_KEYS:
        others: dict[str, list[str]] = {}
        for owner in owners:
            others.setdefault(_heating_text(owner), []).append(owner)
        notes = "".join(f"{text} in {' and '.join(names)}, " for text, names in others.items())
        return f"Heating is {notes}{_heating_text(family)} here"
    if keys == GAIN_KEYS:
        notes = "".join(f"; {owner}: {GAIN_UNITS[owner]}, {_gain_factor(owner, family)}" for owner in owners)
        return f"Here it is in {GAIN_UNITS[family]}{notes}"
    if keys == SAMPLE_KEYS:
        unit = SAMPLE_UNITS.get(family)
        return f"A bare number is in {unit} here" if unit else "Write it with its unit here, as in 500 ms"
    return ""


def _gain_factor(owner: str, family: str) -> str:
    """What the gain of another family is times, to be one here."""
    owner_unit, own_unit = _gain_unit(owner), _gain_unit(family)
    if (owner_unit == "span") != (own_unit == "span"):
        return "times PV span / output span" if own_unit == "span" else "times output span / PV span"
    return "the same number if the output is in %" if "percent" in {owner_unit, own_unit} else "the same number"


def _gain_unit(family: str) -> GainUnit:
    """What the gain of a family is counted in."""
    return tables_of(VENDORS[family]).TUNING_NUMBERS.gain_unit


def _heating_text(family: str) -> str:
    """How a family writes that the PV rises with the output."""
    vendor = VENDORS[family]
    return f"{action_key(vendor)}: {action_word(vendor, raises_pv=True)}"


# --- Numbers that carry their key's own unit: ``85 degC`` where the PV is in degC is 85 -------------------------------
#
# Looked at only where a value was refused, so that a file of bare numbers costs nothing. Another unit stays an error,
# which names the key's: nothing is ever converted. So does any unit of a key that the PLC holds in counts, where the
# loop gives no range that makes counts of it.

WRONG_TYPE_CODE = "PID022"
NO_RANGE_CODE = "PID039"
RANGE_KEYS = ("range", "input_range")
UNIT_SPELLINGS = {"°C": "degC", "℃": "degC", "°F": "degF", "℉": "degF", "degK": "K", "°": "deg"}
"""Spellings of one unit."""
VARIABLE_UNIT = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""


def strip_key_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> Document:
    """The document with the number alone wherever a refused value carries the unit of its key."""
    data: Any = doc.data
    for path, stated in _stated_numbers(vendor, doc, errors):
        if stated.is_in_key_unit:
            data = _with_value(data, path, type(value_at(doc.data, path))(stated.number))
    return doc if data is doc.data else replace(doc, data=data)


def explain_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The errors, with what is wrong with the unit that a value carries."""
    return [_explain_unit(vendor, doc, error) for error in errors]


def _explain_unit(vendor: Vendor, doc: Document, error: Diagnostic) -> Diagnostic:
    stated = (number for path, number in _stated_numbers(vendor, doc, [error]) if path[: len(error.path)] == error.path)
    misfit = next((number for number in stated if not number.is_in_key_unit), None)
    if misfit is None:
        return error
    if misfit.side_without_range is None:
        return replace(error, help=misfit.cure)
    key = next(step for step in reversed(error.path) if isinstance(step, str))
    return replace(error, help=misfit.cure, code=NO_RANGE_CODE, message=f"{key} is {misfit.text}, {misfit.fault}")


def with_numbers(doc: Document, numbers: Mapping[Path, str]) -> Document:
    """The document with numbers in the place of texts."""
    data: Any = doc.data
    for path, number in numbers.items():
        data = _with_value(data, path, Plain(number))
    return replace(doc, data=data)


class StatedNumber(NamedTuple):
    """A number as written, the unit that it carries, and the unit of its key where the loop says it."""

    number: str
    unit: str
    key_unit: str | None
    side_without_range: str | None = None
    """The side of the loop whose counts the key is in, where it has no range; None: there is nothing to convert."""

    @property
    def is_in_key_unit(self) -> bool:
        """Whether the number alone says the same."""
        return self.unit == self.key_unit and self.side_without_range is None

    @property
    def text(self) -> str:
        """The value in its unit."""
        return f"{self.number} {self.unit}"

    @property
    def fault(self) -> str:
        """Why no unit can be read here."""
        return f"and {self.side_without_range} has no range that makes counts of it"

    @property
    def cure(self) -> str:
        """What to do about the unit."""
        side = self.side_without_range
        if side is not None:
            ends = "0, 100" if self.unit == "%" else "LOW, HIGH"
            return (
                f"give {side}.range, what 0 % and 100 % of the signal stand for, as in {side}: "
                f"{{range: [{ends}]}}; or write counts, as in '2048 counts'"
            )
        return f"the key is in {self.key_unit}, not in {self.unit}: write the number of {self.key_unit} alone"


def stated_number(vendor: Vendor, loop: object, path: Path, text: str) -> StatedNumber | None:
    """A number with a unit, for a key of a loop that has one, too, or is held in counts; None for any other text."""
    match = NUMBER_WITH_UNIT.fullmatch(text)
    if not match or not NUMBER.fullmatch(match["number"]):
        return None
    key_unit, side = _unit_of(vendor, loop, path), side_without_range(vendor, loop, path)
    if not key_unit and side is None:
        return None
    return StatedNumber(
        match["number"], _normal_unit(match["unit"]), _normal_unit(key_unit) if key_unit else None, side
    )


def side_without_range(vendor: Vendor, loop: object, path: Path) -> str | None:
    """The side whose counts a key of a loop is in, for want of a range; None: its numbers are in their unit."""
    side = next(iter(_unit_sides(_table_unit(vendor, path) or "")), None)
    if side is None or value_at(loop, (side, "range")) is not None:
        return None
    keys = [step for step in path if isinstance(step, str)]
    return side if is_scaled(vendor.model, ("loops", *keys)) else None


def _stated_numbers(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> Iterator[tuple[Path, StatedNumber]]:
    """The refused numbers with a unit whose key has one, too; with one end of a pair the other one."""
    for d in errors:
        if d.code != WRONG_TYPE_CODE or len(d.path) < 3 or d.path[0] != "loops":
            continue
        value_path = d.path[:-1] if isinstance(d.path[-1], int) else d.path
        value = value_at(doc.data, value_path)
        items = enumerate(value) if isinstance(value, list) else [(None, value)]
        for i, item in items:
            if not isinstance(item, str) or range_cure(item) is not None:
                continue
            path = value_path if i is None else (*value_path, i)
            stated = stated_number(vendor, value_at(doc.data, path[:2]), path[2:], item)
            if stated is not None:
                yield path, stated


def _table_unit(vendor: Vendor, path: Path) -> str | None:
    """The unit of a key as the tables have it."""
    table = units_by_path(vendor)
    dotted = ".".join(map(str, path))
    return next((table[place] for place in (dotted, f"{dotted}.0", str(path[-1])) if place in table), None)


def _unit_sides(unit: str) -> list[str]:
    """The sides of a loop that a unit of a table is made of."""
    return [part for part in re.split("/| per ", unit) if part in SIDES]


def _unit_of(vendor: Vendor, loop: object, path: Path) -> str | None:
    """The unit of a key in the loop's own words; None where it has none, or the loop does not say it."""
    units = units_of(loop)
    if len(path) > 1 and path[1] in RANGE_KEYS:
        return units.get(str(path[0]))
    unit = _table_unit(vendor, path)
    if unit is None or VARIABLE_UNIT.search(unit):
        return None
    return unit_text(unit, units) if set(_unit_sides(unit)) <= set(units) else None


def _normal_unit(unit: str) -> str:
    """A unit in one spelling, without blanks around its signs."""
    unit = re.sub(r"\s*/\s*", "/", unit.strip())
    return "/".join(UNIT_SPELLINGS.get(part, part) for part in unit.split("/"))


def _with_value(data: Any, path: Path, value: object) -> Any:
    """A copy of plain data with another value at a place; what does not hold the place is shared."""
    step, *rest = path
    copy = data.copy()
    copy[step] = _with_value(data[step], tuple(rest), value) if rest else value
    return copy
