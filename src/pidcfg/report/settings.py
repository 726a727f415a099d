"""The settings of a configuration in engineering units, from the vendor's model: key, value, unit and meaning."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from pidcfg.encoders.parameters import ParameterTable
from pidcfg.report.content import Group, Setting
from pidcfg.report.texts import SIDES, cell, unit_text
from pidcfg.schemas.base import UNIT_WORDS, Duration, Minutes, Quantity, Seconds
from pidcfg.schemas.document import field_texts
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.limits import Limits
from pidcfg.schemas.rates import Rate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.vendors import Vendor

HEADING = ("pidcfg", "vendor", "name", "description", "loops")
"""Keys that have a place of their own in a report."""
RANGES = ("range", "input_range")
GAINS = {"percent": "%/pv", "engineering": "output/pv"}
"""Units of a gain by what the vendor counts it in; a gain of counts per count has none."""
OF_GAINS = ("output/pv", "output/pv/s", "output per pv/s")
"""Units of the three gains of an independent form: MV for the error, for its integral, for its derivative."""
NOWHERE = "no register"
GENERAL = "General"
CHOICE = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""
TIMES = {get_args(Seconds)[1]: "s", get_args(Minutes)[1]: "min"}


@dataclass(frozen=True, slots=True)
class Leaf:
    """A value of a model: its path, the model that has it, and whether the file says it."""

    path: str
    value: Any
    model: BaseModel
    key: str
    given: bool


@cache
def texts_of(model: type[BaseModel]) -> Mapping[str, str]:
    """The documentation of each field."""
    return field_texts(model)


def leaves(model: BaseModel, prefix: str = "", *, given: bool = True) -> Iterator[Leaf]:
    """Every value of a model that is one, in the order of its fields."""
    for key in type(model).model_fields:
        value, said = getattr(model, key), given and key in model.model_fields_set
        path = f"{prefix}{key}"
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{path}.", given=said)
        elif isinstance(value, tuple) and value and all(isinstance(part, BaseModel) for part in value):
            for i, part in enumerate(value):
                yield from leaves(part, f"{path}[{i}].", given=said)
        elif hasattr(value, "items"):
            yield from (Leaf(f"{path}.{name}", part, model, key, said) for name, part in value.items())
        elif value not in (None, ()):
            yield Leaf(path, value, model, key, said)


def table_units(vendor: Vendor, units: Mapping[str, str]) -> dict[str, str]:
    """The units of the vendor's registers and parameters in the words of a loop, as far as they leave no choice."""
    return {path: unit_text(unit, units) for path, unit in tabled(vendor).items() if not CHOICE.search(unit)}


@cache
def tabled(vendor: Vendor) -> Mapping[str, str]:
    """The units of the vendor's registers and parameters by the path of their value."""
    found: dict[str, str] = {}
    for table in vendor.load("registers"):
        if isinstance(table, ParameterTable):
            rows = [(row.name, row.unit) for row in table.rows]
        else:
            rows = [(word.path, word.unit) for word in table.words if word.path is not None]
        for path, unit in rows:
            if unit:
                found.setdefault(path, unit)
    return found


def sides(loop: Any) -> dict[str, str]:
    """The units of PV and output, as far as the loop has those sections and says them."""
    return {side: getattr(getattr(loop, side, None), "unit", None) or word for side, word in SIDES.items()}


def _raw(leaf: Leaf, unit: str, loop: Any) -> bool:
    """Whether a quantity is raw counts: written so, or on a scale without a range."""
    quantities = leaf.value if isinstance(leaf.value, tuple) and type(leaf.value) is tuple else (leaf.value,)
    if not all(isinstance(part, Quantity) for part in quantities):
        return False
    section = getattr(loop, unit.partition("/")[0], None)
    return all(part.counts for part in quantities) or getattr(section, "range", None) is None


def unit_of(leaf: Leaf, loop: Any, vendor: Vendor) -> str:
    """The unit of a setting as a reader needs it, with nothing left to be chosen."""
    value, units = leaf.value, sides(loop)
    beside = getattr(leaf.model, f"{leaf.key}_unit", None)
    duration = value if isinstance(value, Duration) else getattr(value, "duration", None)
    if isinstance(duration, Duration):
        return duration.unit or UNIT_WORDS.get(str(beside), "") or _tabled(leaf, vendor)
    if isinstance(value, Rate):
        return unit_text(f"pv/{value.per}", {**units, "pv": "counts"} if value.counts else units)
    if isinstance(value, bool | str | Wire) and not leaf.path.endswith(RANGES):
        return ""
    unit = _tabled(leaf, vendor)
    if _raw(leaf, unit, loop):
        return "/".join(["counts", *unit.split("/")[1:]])
    return unit_text(unit, units)


def _tuned(leaf: Leaf, vendor: Vendor) -> str:
    """The unit of one of the three terms, where the vendor's tables leave it open."""
    tuned = vendor.load("tuned")
    keys = [tuned.key(name) for name in tuned.names]
    if leaf.path == keys[0]:
        return GAINS.get(tuned.gain_unit, "")
    form = getattr(tuned, "dependent", None)
    chosen = getattr(leaf.model, form[0], None) if form else None
    if leaf.path not in keys or not isinstance(chosen, bool):
        return ""
    return "s" if form is None or chosen is form[1] else OF_GAINS[keys.index(leaf.path)]


def _tabled(leaf: Leaf, vendor: Vendor) -> str:
    """The unit by the vendor's tables, then by the limits of the field, then by its type."""
    table, short = tabled(vendor), leaf.path.rpartition("].")[2]
    found = next((table[path] for path in (leaf.path, f"{leaf.path}.0", short) if path in table), "")
    found = _tuned(leaf, vendor) or found
    if found:
        return found
    field = type(leaf.model).model_fields[leaf.key]
    limits = next((m for m in field.metadata if isinstance(m, Limits) and m.unit), None)
    if limits is not None:
        return limits.unit
    if leaf.key in RANGES:
        return leaf.path.split(".")[-2]
    return next((TIMES[m] for m in field.metadata if _is_time(m)), "")


def _is_time(mark: Any) -> bool:
    return any(mark is time or mark == time for time in TIMES)


def setting(leaf: Leaf, loop: Any, vendor: Vendor, written: Any, place: str) -> Setting:
    """A value with everything that a reader wants to know; an address stands as the file writes it."""
    spelled = isinstance(leaf.value, int) and not isinstance(leaf.value, bool) and isinstance(written, str)
    address = spelled and not _counted(written.strip("-"))
    value = str(written) if address else shown(leaf)
    unit = "" if address else unit_of(leaf, loop, vendor)
    return Setting(leaf.path, value, unit, texts_of(type(leaf.model)).get(leaf.key, ""), leaf.given, place)


def _counted(text: str) -> bool:
    return text[:1].isdigit()


def shown(leaf: Leaf) -> Any:
    """The value as a cell."""
    duration = getattr(leaf.value, "duration", leaf.value)
    if duration is None:
        return str(leaf.value)
    if isinstance(leaf.value, Rate):
        return leaf.value.value
    return cell(duration)


def groups_of(model: BaseModel, vendor: Vendor, data: Any, places: Mapping[str, str]) -> tuple[Group, ...]:
    """The settings of a model by its sections; ``data``: the same as it stands in the file."""
    found: dict[str, list[Setting]] = {}
    for leaf in leaves(model):
        section, dot, _ = leaf.path.partition(".")
        if section.partition("[")[0] not in HEADING:
            written = _written(data, leaf.path)
            key = section if dot else ""
            found.setdefault(key, []).append(setting(leaf, model, vendor, written, places.get(leaf.path, "")))
    texts = texts_of(type(model))
    return tuple(
        Group(key, texts.get(key.partition("[")[0], key).rstrip(".") if key else GENERAL, tuple(settings))
        for key, settings in sorted(found.items(), key=lambda item: bool(item[0]))
    )


def _written(data: Any, path: str) -> Any:
    """What the file has at a path."""
    for step in path.replace("[", ".").replace("]", "").split("."):
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, list) and step.isdigit() and int(step) < len(data):
            data = data[int(step)]
        else:
            return None
    return data
