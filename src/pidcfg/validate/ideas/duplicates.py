"""What two loops have in common and may not."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator

Row = TypeVar("Row")
Key = TypeVar("Key", bound="Hashable")


def repeats(rows: Iterable[tuple[Key, Row]]) -> Iterator[tuple[Key, Row, Row]]:
    """Every row whose key an earlier one has: the key, the row, and the first row that has it."""
    first: dict[Key, Row] = {}
    for key, row in rows:
        if key in first:
            yield key, row, first[key]
        first.setdefault(key, row)
