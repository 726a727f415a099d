"""The settings of a configuration in engineering units, from the vendor's model: key, value, unit and meaning."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from pidcfg.differences.leaves import Leaf, leaves, unit_of
from pidcfg.encoders.units import units_by_path
from pidcfg.explanation.texts import texts_of
from pidcfg.paths import value_at
from pidcfg.report.content import Group, Setting
from pidcfg.report.texts import SIDES, cell
from pidcfg.schemas.rates import Rate
from pidcfg.schemas.units import unit_text, units_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pydantic import BaseModel

    from pidcfg.vendors import Vendor

HEADING = ("pidcfg", "vendor", "name", "description", "loops")
"""Keys that have a place of their own in a report."""
NOWHERE = "no register"
GENERAL = "General"
CHOICE = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""


def table_units(vendor: Vendor, units: Mapping[str, str]) -> dict[str, str]:
    """The units of the vendor's registers and parameters in the words of a loop, as far as they leave no choice."""
    return {path: unit_text(unit, units) for path, unit in units_by_path(vendor).items() if not CHOICE.search(unit)}


def sides(loop: object) -> dict[str, str]:
    """The units of PV and output; words for those that the loop does not say."""
    return {**SIDES, **units_of(loop)}


def setting(leaf: Leaf, loop: Any, vendor: Vendor, written: Any, place: str) -> Setting:
    """A value with everything that a reader wants to know; an address stands as the file writes it."""
    spelled = isinstance(leaf.value, int) and not isinstance(leaf.value, bool) and isinstance(written, str)
    address = spelled and not _is_number(written.strip("-"))
    value = str(written) if address else shown(leaf)
    unit = "" if address else unit_of(leaf, loop, vendor, sides(loop))
    return Setting(leaf.text, value, unit, texts_of(type(leaf.model)).get(leaf.key, ""), leaf.given, place)


def _is_number(text: str) -> bool:
    return text[:1].isdigit()


def shown(leaf: Leaf) -> Any:
    """The value as a cell."""
    duration = getattr(leaf.value, "duration", leaf.value)
    if duration is None:
        return str(leaf.value)
    if isinstance(leaf.value, Rate):
        return leaf.value.value
    return cell(duration)


def place_of(path: str, places: Mapping[str, str]) -> str:
    """Where a setting is kept: in its own register, or with the section that one register holds."""
    while path and path not in places:
        path = path.rpartition(".")[0]
    return places.get(path, "")


def groups_of(model: BaseModel, vendor: Vendor, data: Any, places: Mapping[str, str]) -> tuple[Group, ...]:
    """The settings of a model by its sections; ``data``: the same as it stands in the file."""
    sections: dict[str, list[Setting]] = {}
    for leaf in leaves(model):
        if leaf.path[0] not in HEADING:
            section, dot, _ = leaf.text.partition(".")
            written = value_at(data, leaf.path)
            row = setting(leaf, model, vendor, written, place_of(leaf.text, places))
            sections.setdefault(section if dot else "", []).append(row)
    texts = texts_of(type(model))
    return tuple(
        Group(key, texts.get(key.partition("[")[0], key).rstrip(".") if key else GENERAL, tuple(settings))
        for key, settings in sorted(sections.items(), key=lambda item: bool(item[0]))
    )
