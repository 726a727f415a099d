"""What several loops have in common, reported at each of them: what no two may share, and what concerns a pair."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterable, Iterator, Sequence

    from pidcfg.validate.rule import Finding, Findings


class HasName(Protocol):
    """A loop, or a block of a program."""

    @property
    def name(self) -> str:
        """Its name."""


MOST_NAMES = 8
"""Loops that a message names before it only counts."""
Key = TypeVar("Key", bound="Hashable")
ViewT = TypeVar("ViewT", bound=HasName)


def sharing(rows: Iterable[tuple[Key, ViewT]]) -> Iterator[tuple[Key, ViewT, tuple[str, ...]]]:
    """Every loop whose key another one has too: the key, the loop, and the names of the others."""
    groups: dict[Key, list[ViewT]] = {}
    for key, view in rows:
        groups.setdefault(key, []).append(view)
    for key, views in groups.items():
        for view in views:
            others = tuple(dict.fromkeys(other.name for other in views if other is not view))
            if others:
                yield key, view, others


def at_both(one: HasName, at_one: Finding, other: HasName, at_other: Finding, /, **values: object) -> Findings:
    """A finding at each of two loops, which names the other one; with the values of the message that both have."""
    yield at_one.quoting(**values).shared_with(other.name)
    yield at_other.quoting(**values).shared_with(one.name)


def in_words(names: Sequence[str]) -> str:
    """Names as a message lists them: ``A, B and C``; after eight of them only how many more there are."""
    if len(names) > MOST_NAMES:
        return f"{', '.join(names[:MOST_NAMES])} and {len(names) - MOST_NAMES} more"
    return " and ".join(part for part in (", ".join(names[:-1]), *names[-1:]) if part)
