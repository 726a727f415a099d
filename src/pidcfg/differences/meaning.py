"""Configurations of two vendors compared by meaning: through the neutral loop, in engineering units.

Each side is first taken as its PLC holds it (encoded and decoded), so that a value below the resolution of a register
is no difference. Differences are ranked by what can go wrong. Two sides of one vendor are compared in their own words
(`pidcfg.differences.within`).
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.common_scale import flat, normal, on_the_same_scale
from pidcfg.conversion.values import number_of
from pidcfg.differences.result import Compared, Difference, ranked
from pidcfg.differences.risk import judged

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.differences.side import Side

EQUAL = Decimal("1e-6")
"""Relative difference of numbers that count as equal."""


def compare(before: Side, after: Side) -> list[Compared]:
    """Loop by loop: matched by name, then by their order."""
    rows = []
    for i, j in matched(before.names, after.names):
        if j is None and i is not None:
            rows.append(Compared(before.names[i], "removed"))
        elif i is None and j is not None:
            rows.append(Compared(after.names[j], "added"))
        elif i is not None and j is not None:
            rows.append(ranked(after.names[j], _neutral(before, i, after, j)))
    return rows


def matched(before: Sequence[str], after: Sequence[str]) -> list[tuple[int | None, int | None]]:
    """Numbers of loops that belong together, by their names."""
    numbers = {_plain(name): j for j, name in enumerate(after)}
    partners: dict[int, int] = {}
    for i, name in enumerate(before):
        j = numbers.get(_plain(name))
        if j is not None and j not in partners.values():
            partners[i] = j
    left = [j for j in range(len(after)) if j not in partners.values()]
    pairs: list[tuple[int | None, int | None]] = []
    for i in range(len(before)):
        j = partners.get(i)
        if j is None and left and len(before) == len(after):
            j = left.pop(0)
        pairs.append((i, j))
    return pairs + [(None, j) for j in left]


def _plain(name: str) -> str:
    """A name as vendors with narrower rules for names would write it."""
    return name.casefold().replace("-", "_")


# --- the neutral form ------------------------------------------------------------------------------------------------


def _neutral(before: Side, i: int, after: Side, j: int) -> list[Difference]:
    first, second = before.loops[i], after.loops[j]
    if first is None or second is None:
        if first is second:
            return []
        kinds = ["no PID" if loop is None else "PID" for loop in (first, second)]
        return [Difference("type", "high", kinds[0], kinds[1], "the neutral form does not have both")]
    one = normal(flat(first))
    two = on_the_same_scale(one, normal(flat(second)))
    return [judged(key, one.get(key), two.get(key)) for key in {**one, **two} if not _equal(one.get(key), two.get(key))]


def _equal(before: Any, after: Any) -> bool:
    one, two = number_of(before), number_of(after)
    if one is None or two is None:
        return bool(before == after)
    return abs(one - two) <= EQUAL * max(abs(one), abs(two))
