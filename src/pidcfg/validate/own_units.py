"""Numbers that carry their key's own unit: ``85 degC`` where the PV is in degC is 85; another unit is an error."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.contract import units_by_path
from pidcfg.schemas.limits import unit_text, units_of
from pidcfg.schemas.numbers import NUMBER, WITH_UNIT, range_of
from pidcfg.text.document import Plain
from pidcfg.text.paths import value_at

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.vendors import Vendor


# --- Numbers that carry their key's own unit: ``85 degC`` where the PV is in degC is 85 -------------------------------
#
# Looked at only where a value was refused, so that a file of bare numbers costs nothing. Another unit stays an error,
# which names the key's: nothing is ever converted.

WRONG_TYPE = "PID022"
RANGES = ("range", "input_range")
SAME_UNITS = {"°C": "degC", "℃": "degC", "°F": "degF", "℉": "degF", "degK": "K", "°": "deg"}
"""Spellings of one unit."""
OPEN = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""


def without_own_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> Document:
    """The document with the number alone wherever a refused value carries the unit of its key."""
    data: Any = doc.data
    for path, said in _stated(vendor, doc, errors):
        if said.unit == said.own:
            data = _with(data, path, type(value_at(doc.data, path))(said.number))
    return doc if data is doc.data else replace(doc, data=data)


def in_key_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The errors, with the key's unit where a value carries another one."""
    named = []
    for d in errors:
        other = next((s for _, s in _stated(vendor, doc, [d]) if s.unit != s.own), None)
        named.append(replace(d, help=other.cure) if other else d)
    return named


def with_numbers(doc: Document, numbers: Mapping[Path, str]) -> Document:
    """The document with numbers in the place of texts."""
    data: Any = doc.data
    for path, number in numbers.items():
        data = _with(data, path, Plain(number))
    return replace(doc, data=data)


class Stated(NamedTuple):
    """A number as written, the unit that it carries, and the unit of its key, both in one spelling."""

    number: str
    unit: str
    own: str

    @property
    def cure(self) -> str:
        """What to do about another unit."""
        return f"the key is in {self.own}, not in {self.unit}: write the number of {self.own} alone"


def stated_number(vendor: Vendor, loop: Any, path: Path, text: str) -> Stated | None:
    """A number with a unit, for a key of a loop that has one, too; None for any other text."""
    match = WITH_UNIT.fullmatch(text)
    own = match and _unit_of(vendor, loop, path)
    if not match or not own or not NUMBER.fullmatch(match["number"]):
        return None
    return Stated(match["number"], _spelling(match["unit"]), _spelling(own))


def _stated(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> Iterator[tuple[Path, Stated]]:
    """The refused numbers with a unit whose key has one, too; of a list each item."""
    for d in errors:
        if d.code != WRONG_TYPE or len(d.path) < 3 or d.path[0] != "loops":
            continue
        value = value_at(doc.data, d.path)
        items = enumerate(value) if isinstance(value, list) else [(None, value)]
        for i, item in items:
            if not isinstance(item, str) or range_of(item) is not None:
                continue
            path = d.path if i is None else (*d.path, i)
            said = stated_number(vendor, value_at(doc.data, path[:2]), path[2:], item)
            if said is not None:
                yield path, said


def _unit_of(vendor: Vendor, loop: Any, path: Path) -> str | None:
    """The unit of a key in the loop's own words; None where it has none, or the loop does not say it."""
    units = units_of(loop)
    if len(path) > 1 and path[1] in RANGES:
        return units.get(str(path[0]))
    dotted = ".".join(map(str, path))
    table = units_by_path(vendor)
    unit = next((table[place] for place in (dotted, f"{dotted}.0", str(path[-1])) if place in table), None)
    if unit is None or OPEN.search(unit):
        return None
    sides = {part for part in re.split("/| per ", unit) if part in {"pv", "output"}}
    return unit_text(unit, units) if sides <= set(units) else None


def _spelling(unit: str) -> str:
    """A unit in one spelling, without blanks around its signs."""
    unit = re.sub(r"\s*/\s*", "/", unit.strip())
    return "/".join(SAME_UNITS.get(part, part) for part in unit.split("/"))


def _with(data: Any, path: Path, value: object) -> Any:
    """A copy of plain data with another value at a place; what does not hold the place is shared."""
    step, *rest = path
    copy = data.copy()
    copy[step] = _with(data[step], tuple(rest), value) if rest else value
    return copy
