"""Fields that go over as they are: rows of a vendor's table, which stand between the steps that calculate.

A conversion is one table in the order of its report: a row `Same` for a field that keeps its value, a function for what
has to be worked out.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeVar

from pidcfg.paths import steps, value_at

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


@dataclass(frozen=True, slots=True)
class Same:
    """A field and the one that it becomes with the same value; one that is not given says nothing."""

    path: str
    to: str = ""
    """Its path on the other side; empty: the same."""
    words: Mapping[Any, Any] | None = None
    """What the other side calls each choice."""
    if_on: bool = False
    """0 and false say nothing either."""
    note: str = ""
    """For the report."""
    two: bool = False
    """Two limits, each of which the target may round or clamp."""

    def value_of(self, model: object) -> Any:
        """The field's value in a loop; None: it says nothing."""
        value = value_at(model, steps(self.path))
        return None if self.if_on and not value else value

    def becomes(self, value: Any) -> Any:
        """What a value is on the other side."""
        return value if self.words is None else self.words[value]


class Builder(Protocol):
    """What takes the fields of a loop."""

    def same(self, row: Same, value: Any) -> None:
        """Takes a field with its value."""


B = TypeVar("B", bound=Builder)
C = TypeVar("C")


Table: TypeAlias = "tuple[Same | Callable[[B, C], None], ...]"
"""Rows, and steps that get the builder and what they work with."""


def same(*paths: str, if_on: bool = False) -> tuple[Same, ...]:
    """Rows of fields that have one path on both sides."""
    return tuple(Same(path, if_on=if_on) for path in paths)


def take(builder: B, loop: object, context: C, table: Table[B, C]) -> None:
    """Goes through a table: rows take the fields of a loop, steps work out the others of ``context``."""
    for row in table:
        if not isinstance(row, Same):
            row(builder, context)
        elif (value := row.value_of(loop)) is not None:
            builder.same(row, value)
