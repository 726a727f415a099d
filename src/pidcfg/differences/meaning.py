"""Two configurations compared by meaning: through the neutral loop, in engineering units, ranked by what can go wrong.

Each side is first taken as its PLC holds it (encoded and decoded), so that a value below the resolution of a register
is no difference. What no neutral field says is compared in the vendor's own fields, within one vendor.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.common_scale import flat, normal, on_the_same_scale
from pidcfg.conversion.values import number_of
from pidcfg.differences.parameters import ParameterComparison
from pidcfg.differences.result import Compared, Difference, ranked
from pidcfg.differences.risk import judged
from pidcfg.differences.vendor_fields import differences_of_fields

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.differences.side import Side

EQUAL = Decimal("1e-6")
"""Relative difference of numbers that count as equal."""


def compare(before: Side, after: Side) -> list[Compared]:
    """Loop by loop: matched by name, then by their order."""
    pairs = matched(before.names, after.names)
    neutral = {(i, j): _neutral(before, i, after, j) for i, j in pairs if i is not None and j is not None}
    parameters = _parameters(before, after, neutral)
    rows = []
    for i, j in pairs:
        if j is None and i is not None:
            rows.append(Compared(before.names[i], "removed"))
        elif i is None and j is not None:
            rows.append(Compared(after.names[j], "added"))
        elif i is not None and j is not None:
            rows.append(ranked(after.names[j], [*neutral[i, j], *_of_vendor(before, i, after, j, parameters)]))
    return rows + (parameters.of_others((*before.names, *after.names)) if parameters else [])


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
        if before.vendor is after.vendor and first is second:
            return []
        kinds = ["no PID" if loop is None else "PID" for loop in (first, second)]
        return [Difference("type", "high", kinds[0], kinds[1], "the neutral form does not have both")]
    one, two = normal(flat(first)), normal(flat(second))
    if before.vendor is not after.vendor:
        two = on_the_same_scale(one, two)
    return [judged(key, one.get(key), two.get(key)) for key in {**one, **two} if not _equal(one.get(key), two.get(key))]


def _equal(before: Any, after: Any) -> bool:
    one, two = number_of(before), number_of(after)
    if one is None or two is None:
        return bool(before == after)
    return abs(one - two) <= EQUAL * max(abs(one), abs(two))


# --- what no neutral field says --------------------------------------------------------------------------------------


def _of_vendor(
    before: Side, i: int, after: Side, j: int, parameters: ParameterComparison | None
) -> Iterator[Difference]:
    """Of two loops of one vendor."""
    if before.vendor is not after.vendor:
        return
    one, two = before.names[i], after.names[j]
    if parameters:
        yield from parameters.of_owner(one, two, in_both=(before.loops[i] is None) != (after.loops[j] is None))
    for difference in differences_of_fields(before.fields[i], after.fields[j]):
        if not parameters or not parameters.has(one, two, difference.field):
            yield difference


def _parameters(
    before: Side, after: Side, neutral: Mapping[tuple[int, int], Sequence[Difference]]
) -> ParameterComparison | None:
    """The named parameters of both sides, where there are any that can be compared."""
    if not before.parameters or not after.parameters or before.vendor is not after.vendor:
        return None
    fields = {pair: frozenset(difference.field for difference in rows) for pair, rows in neutral.items()}
    nothing: frozenset[str] = frozenset()
    of_before = [next((of for (i, _), of in fields.items() if i == n), nothing) for n in range(len(before.names))]
    of_after = [next((of for (_, j), of in fields.items() if j == n), nothing) for n in range(len(after.names))]
    return ParameterComparison(before.parameters, after.parameters, (of_before, of_after))
