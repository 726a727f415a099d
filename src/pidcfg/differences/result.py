"""What a comparison of two configurations gives: their loops, and what differs in each, by what can go wrong."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable

Risk = Literal["critical", "high", "medium", "low", "cosmetic"]
Status = Literal["same", "changed", "renamed", "moved", "added", "removed"]
RISKS: tuple[Risk, ...] = ("critical", "high", "medium", "low", "cosmetic")
"""From harmful to harmless."""


@dataclass(frozen=True, slots=True)
class Difference:
    """One key that differs; ``note`` says what it means.

    Within a vendor ``key`` is the file's, and the numbers are the file's in ``unit``; ``field`` is the neutral field
    that it becomes, else the key itself. Between vendors there is the neutral field alone.
    """

    field: str
    risk: Risk
    before: Any
    after: Any
    note: str = ""
    key: str = ""
    unit: str = ""
    address: str = ""
    """The register, as the vendor writes it; empty: no register holds it."""
    word_before: str | None = None
    word_after: str | None = None
    """The content of the register as the PLC shows it."""

    @property
    def other_word_only(self) -> bool:
        """Whether the value is the same on a scale that is another one, so that its word differs."""
        return self.before is not None and self.before == self.after and self.word_before != self.word_after


@dataclass(frozen=True, slots=True)
class Compared:
    """A loop on both sides, or on one side only."""

    loop: str
    """Its name on the second side, or on the only one; empty: what belongs to no loop."""
    status: Status
    differences: tuple[Difference, ...] = ()
    was: str = ""
    """Its name on the first side, where that is another one."""
    moved: tuple[str, str] | None = None
    """Where its registers begin on both sides, where that differs; without addresses, its number in the file."""
    operated: tuple[Difference, ...] = ()
    """What the operator sets: shown apart, and no difference."""
    left_out: tuple[str, ...] = ()
    """Keys of words that differ and that the PLC or the process writes."""
    missing: tuple[str, ...] = ()
    """Keys that a listing does not hold."""

    @property
    def same(self) -> bool:
        """Whether nothing differs that counts."""
        return self.status == "same"


def ranked(loop: str, differences: Iterable[Difference]) -> Compared:
    """A loop on both sides, what can go most wrong first."""
    rows = by_risk(differences)
    return Compared(loop, "changed" if rows else "same", rows)


def by_risk(differences: Iterable[Difference]) -> tuple[Difference, ...]:
    """What can go most wrong first."""
    return tuple(sorted(differences, key=lambda difference: RISKS.index(difference.risk)))
