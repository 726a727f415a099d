"""Numbers that carry a unit: ``85 degC`` is 85 where the PV is in degC and has a range; all others are errors."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.contract import units_by_path
from pidcfg.schemas.limits import SIDES, is_scaled, unit_text, units_of
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
# which names the key's: nothing is ever converted. So does any unit of a key that the PLC holds in counts, where the
# loop gives no range that makes counts of it.

WRONG_TYPE = "PID022"
NO_SCALE = "PID039"
RANGES = ("range", "input_range")
SAME_UNITS = {"°C": "degC", "℃": "degC", "°F": "degF", "℉": "degF", "degK": "K", "°": "deg"}
"""Spellings of one unit."""
OPEN = re.compile(" or |, ")
"""Stands in a unit that depends on another setting."""


def without_own_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> Document:
    """The document with the number alone wherever a refused value carries the unit of its key."""
    data: Any = doc.data
    for path, said in _stated(vendor, doc, errors):
        if said.fits:
            data = _with(data, path, type(value_at(doc.data, path))(said.number))
    return doc if data is doc.data else replace(doc, data=data)


def in_key_units(vendor: Vendor, doc: Document, errors: Iterable[Diagnostic]) -> list[Diagnostic]:
    """The errors, with what is wrong with the unit that a value carries."""
    named = []
    for d in errors:
        other = next((s for _, s in _stated(vendor, doc, [d]) if not s.fits), None)
        if other is not None:
            d = replace(d, help=other.cure)  # noqa: PLW2901 - the same finding in better words
            if other.bare is not None:
                d = replace(d, code=NO_SCALE, message=f"{d.path[-1]} is {other.text}, {other.fault}")  # noqa: PLW2901
        named.append(d)
    return named


def with_numbers(doc: Document, numbers: Mapping[Path, str]) -> Document:
    """The document with numbers in the place of texts."""
    data: Any = doc.data
    for path, number in numbers.items():
        data = _with(data, path, Plain(number))
    return replace(doc, data=data)


class Stated(NamedTuple):
    """A number as written, the unit that it carries, and the unit of its key where the loop says it."""

    number: str
    unit: str
    own: str | None
    bare: str | None = None
    """The side of the loop whose counts the key is in, where it has no range; None: there is nothing to convert."""

    @property
    def fits(self) -> bool:
        """Whether the number alone says the same."""
        return self.unit == self.own and self.bare is None

    @property
    def text(self) -> str:
        """The value in its unit."""
        return f"{self.number} {self.unit}"

    @property
    def fault(self) -> str:
        """Why no unit can be read here."""
        return f"and {self.bare} has no range that makes counts of it"

    @property
    def cure(self) -> str:
        """What to do about the unit."""
        if self.bare is not None:
            ends = "0, 100" if self.unit == "%" else "LOW, HIGH"
            return (
                f"give {self.bare}.range, what 0 % and 100 % of the signal stand for, as in {self.bare}: "
                f"{{range: [{ends}]}}; or write counts, as in '2048 counts'"
            )
        return f"the key is in {self.own}, not in {self.unit}: write the number of {self.own} alone"


def stated_number(vendor: Vendor, loop: Any, path: Path, text: str) -> Stated | None:
    """A number with a unit, for a key of a loop that has one, too, or is held in counts; None for any other text."""
    match = WITH_UNIT.fullmatch(text)
    if not match or not NUMBER.fullmatch(match["number"]):
        return None
    own, bare = _unit_of(vendor, loop, path), side_without_range(vendor, loop, path)
    if not own and bare is None:
        return None
    return Stated(match["number"], _spelling(match["unit"]), _spelling(own) if own else None, bare)


def side_without_range(vendor: Vendor, loop: Any, path: Path) -> str | None:
    """The side whose counts a key of a loop is in, for want of a range; None: its numbers are in their unit."""
    side = next(iter(_sides(_table_unit(vendor, path) or "")), None)
    if side is None or value_at(loop, (side, "range")) is not None:
        return None
    keys = [step for step in path if isinstance(step, str)]
    return side if is_scaled(vendor.model, ("loops", *keys)) else None


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


def _table_unit(vendor: Vendor, path: Path) -> str | None:
    """The unit of a key as the tables have it."""
    table = units_by_path(vendor)
    dotted = ".".join(map(str, path))
    return next((table[place] for place in (dotted, f"{dotted}.0", str(path[-1])) if place in table), None)


def _sides(unit: str) -> list[str]:
    """The sides of a loop that a unit of a table is made of."""
    return [part for part in re.split("/| per ", unit) if part in SIDES]


def _unit_of(vendor: Vendor, loop: Any, path: Path) -> str | None:
    """The unit of a key in the loop's own words; None where it has none, or the loop does not say it."""
    units = units_of(loop)
    if len(path) > 1 and path[1] in RANGES:
        return units.get(str(path[0]))
    unit = _table_unit(vendor, path)
    if unit is None or OPEN.search(unit):
        return None
    return unit_text(unit, units) if set(_sides(unit)) <= set(units) else None


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
