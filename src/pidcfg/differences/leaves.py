"""The values of a configuration one by one, each with the unit that a reader needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from pidcfg.diagnostics import path_text
from pidcfg.encoders.units import units_by_path
from pidcfg.schemas.base import UNIT_WORDS, Duration, Minutes, Quantity, Seconds
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.limits import Limits
from pidcfg.schemas.rates import Rate
from pidcfg.schemas.units import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.paths import Path
    from pidcfg.vendors import Vendor

RANGES = ("range", "input_range")
GAINS = {"percent": "%/pv", "engineering": "output/pv"}
"""Units of a gain by what the vendor counts it in; a gain of counts per count has none."""
OF_GAINS = ("output/pv", "output/pv/s", "output per pv/s")
"""Units of the three gains of an independent form: MV for the error, for its integral, for its derivative."""
TIMES = {get_args(Seconds)[1]: "s", get_args(Minutes)[1]: "min"}


@dataclass(frozen=True, slots=True)
class Leaf:
    """A value of a model: its path, the model that has it, and whether the file says it."""

    path: Path
    value: Any
    model: BaseModel
    key: str
    given: bool

    @property
    def text(self) -> str:
        """Its path as text: ``steps[0].slope``."""
        return path_text(self.path)


def leaves(model: BaseModel, above: Path = (), *, given: bool = True) -> Iterator[Leaf]:
    """Every value of a model that is one, in the order of its fields."""
    for key in type(model).model_fields:
        value, written = getattr(model, key), given and key in model.model_fields_set
        path = (*above, key)
        if isinstance(value, BaseModel):
            yield from leaves(value, path, given=written)
        elif isinstance(value, tuple) and value and all(isinstance(part, BaseModel) for part in value):
            for i, part in enumerate(value):
                yield from leaves(part, (*path, i), given=written)
        elif hasattr(value, "items"):
            yield from (Leaf((*path, name), part, model, key, written) for name, part in value.items())
        elif value not in (None, ()):
            yield Leaf(path, value, model, key, written)


def _is_raw(leaf: Leaf, unit: str, loop: Any) -> bool:
    """Whether a quantity is raw counts: written so, or on a scale without a range."""
    quantities = leaf.value if isinstance(leaf.value, tuple) and type(leaf.value) is tuple else (leaf.value,)
    if not all(isinstance(part, Quantity) for part in quantities):
        return False
    section = getattr(loop, unit.partition("/")[0], None)
    return all(part.counts for part in quantities) or getattr(section, "range", None) is None


def unit_of(leaf: Leaf, loop: Any, vendor: Vendor, units: Mapping[str, str]) -> str:
    """The unit of a setting as a reader needs it, with nothing left to be chosen.

    ``units``: those of PV and output, or what stands for them.
    """
    value = leaf.value
    chosen = getattr(leaf.model, f"{leaf.key}_unit", None)
    duration = value if isinstance(value, Duration) else getattr(value, "duration", None)
    if isinstance(duration, Duration):
        return duration.unit or UNIT_WORDS.get(str(chosen), "") or _table_unit(leaf, vendor)
    if isinstance(value, Rate):
        return unit_text(f"pv/{value.per}", {**units, "pv": "counts"} if value.counts else units)
    if isinstance(value, bool | str | Wire) and not leaf.text.endswith(RANGES):
        return ""
    unit = _table_unit(leaf, vendor)
    if _is_raw(leaf, unit, loop):
        return "/".join(["counts", *unit.split("/")[1:]])
    return unit_text(unit, units)


def _term_unit(leaf: Leaf, vendor: Vendor) -> str:
    """The unit of one of the three terms, where the vendor's tables leave it open."""
    tuned = vendor.load("tuned")
    keys = [tuned.key(name) for name in tuned.names]
    if leaf.text == keys[0]:
        return GAINS.get(tuned.gain_unit, "")
    form = getattr(tuned, "dependent", None)
    chosen = getattr(leaf.model, form[0], None) if form else None
    if leaf.text not in keys or not isinstance(chosen, bool):
        return ""
    return "s" if form is None or chosen is form[1] else OF_GAINS[keys.index(leaf.text)]


def _table_unit(leaf: Leaf, vendor: Vendor) -> str:
    """The unit by the vendor's tables, then by the limits of the field, then by its type."""
    table, text = units_by_path(vendor), leaf.text
    places = (text, f"{text}.0", text.rpartition("].")[2])
    unit = _term_unit(leaf, vendor) or next((table[place] for place in places if place in table), "")
    if unit:
        return unit
    field = type(leaf.model).model_fields[leaf.key]
    limits = next((m for m in field.metadata if isinstance(m, Limits) and m.unit), None)
    if limits is not None:
        return limits.unit
    if leaf.key in RANGES:
        return str(leaf.path[-2])
    return next((TIMES[m] for m in field.metadata if _is_time(m)), "")


def _is_time(mark: Any) -> bool:
    return any(mark is time or mark == time for time in TIMES)
