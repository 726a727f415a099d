"""What several loops have in common: what no two may, and what is reported once for all of them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

from pidcfg.validate.views import Placed

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence

    from pidcfg.validate.rule import Finding, Findings

MOST_NAMES = 8
"""Loops that a message names before it only counts."""
Row = TypeVar("Row")
Key = TypeVar("Key", bound="Hashable")
ViewT = TypeVar("ViewT", bound=Placed)


def repeats(rows: Iterable[tuple[Key, Row]]) -> Iterator[tuple[Key, Row, Row]]:
    """Every row whose key an earlier one has: the key, the row, and the first row that has it."""
    first: dict[Key, Row] = {}
    for key, row in rows:
        if key in first:
            yield key, row, first[key]
        first.setdefault(key, row)


def reported_once(views: Sequence[ViewT], finding_of: Callable[[ViewT], Finding]) -> Findings:
    """The finding of the first of some loops; its message names the ``others``."""
    if views:
        others = tuple(view.name for view in views[1:])
        more = f" and {len(others) - MOST_NAMES} more" if len(others) > MOST_NAMES else ""
        text = f", as in {', '.join(others[:MOST_NAMES])}{more}" if others else ""
        first = finding_of(views[0])
        yield replace(first, other_loops=others, values={**first.values, "others": text})
