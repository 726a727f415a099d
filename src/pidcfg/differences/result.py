"""What a comparison of two configurations gives: their loops, and what differs in each, by what can go wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

Risk = Literal["critical", "high", "medium", "low", "cosmetic"]
Status = Literal["same", "changed", "added", "removed"]
RISKS: tuple[Risk, ...] = ("critical", "high", "medium", "low", "cosmetic")
"""From harmful to harmless."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One field that differs; ``note`` says what it means."""

    field: str
    risk: Risk
    before: Any
    after: Any
    note: str = ""


@dataclass(frozen=True, slots=True)
class Compared:
    """A loop on both sides, changed or the same; or on one side only."""

    loop: str
    status: Status
    differences: tuple[Difference, ...] = ()


def ranked(loop: str, differences: Iterable[Difference]) -> Compared:
    """A loop on both sides, what can go most wrong first."""
    rows = tuple(sorted(differences, key=lambda difference: RISKS.index(difference.risk)))
    return Compared(loop, "changed" if rows else "same", rows)
