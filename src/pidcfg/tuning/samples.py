"""The samples of a test, what a user says of them, and the error for those that tell no process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence


class RecordError(ValueError):
    """A record that tells no process: what is wrong, and what to record instead."""

    def __init__(self, message: str, cure: str, row: int | None = None) -> None:
        super().__init__(message)
        self.cure = cure
        self.row = row
        """Index of the sample that shows it."""


@dataclass(frozen=True, slots=True)
class Record:
    """Samples of one test: times in s, and what output and PV were."""

    time: Sequence[float]
    output: Sequence[float]
    pv: Sequence[float]


@dataclass(frozen=True, slots=True)
class Request:
    """What the user says of a record: its columns, the output before it, and the part that counts."""

    columns: str | None = None
    rest: float | None = None
    start: str | None = None
    """A time of the record: a number with or without unit, or as the record writes it."""
    until: str | None = None
