"""Lines of a report held against what the target's file says in neutral terms, so that no line claims too much.

Design. The target's file, as its registers round it, is brought to neutral terms like any source. Each line knows its
neutral fields; their values before and after decide: an ``exact`` line whose numbers differ is rounded, and one whose
choice differs is dropped. Gains, times and filters get the error of what acts (a time constant, not the share in a
register), and every number that differs is told in one unit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import quotient
from pidcfg.conversion.common_scale import comparable
from pidcfg.conversion.ledger import Terms
from pidcfg.conversion.losses import KINDS
from pidcfg.conversion.unmatched import harmless
from pidcfg.paths import is_given

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.conversion.common_scale import Flat
    from pidcfg.conversion.ledger import Change
    from pidcfg.schemas.generic import Loop

EXACT, SCALE = Decimal("1e-6"), Decimal("1e-9")
"""Relative difference of numbers, and difference as a share of their scale, that single precision makes."""


def held_lines(rows: Sequence[Change], before: Loop, after: Loop) -> Iterator[Change]:
    """The lines of a loop, each as true as the neutral loops of both sides make it."""
    untold = frozenset(key for key in RUNNING if not is_given(after, key.split(".")))
    sides = Sides(*comparable(before, after), before, untold)
    return (sides.line(row) for row in rows)


LEFT_OUT = ("output.manual",)
"""Numbers that are not told on the way back where they are what the PLC has without them."""
RUNNING = ("output.bias",)
"""Numbers that are not told on the way back where the loop writes them itself."""


@dataclass(frozen=True, slots=True)
class Sides:
    """A loop's neutral values on both sides, in the terms of the source."""

    before: Flat
    after: Flat
    loop: Loop
    untold: frozenset[str]
    """Numbers of which the target says nothing."""

    def line(self, row: Change) -> Change:
        """A line, with what the target holds."""
        if row.kind == "dropped" or not row.neutral:
            return row
        keys = [key for key in self.before if any(_within(key, name) for name in row.neutral)]
        terms = [terms for key in keys if (terms := self._terms(key)) is not None]
        if terms:
            return _rounded(row, max(terms, key=error_of))
        other = next((key for key in keys if self._is_other(key, row)), None)
        if row.kind != "exact" or other is None:
            return row
        note = f"the result has {self.after.get(other)} there"
        return replace(row, kind="dropped", note=f"{row.note}; {note}" if row.note else note, loss=True)

    def _terms(self, key: str) -> Terms | None:
        """A number that differs."""
        wanted, held = _number(self.before[key]), _number(self.after.get(key))
        if wanted is None or held is None or key in self.untold:
            return None
        size, scale = max(abs(wanted), abs(held)), self._width(key)
        if abs(held - wanted) <= max(EXACT * size, SCALE * scale):
            return None
        return Terms(key, wanted, held, self._unit(key))

    def _is_other(self, key: str, row: Change) -> bool:
        """Whether a choice, or a number that is gone, differs; without a place only what acts otherwise does."""
        wanted, held = self.before[key], self.after.get(key)
        if _number(wanted) is not None and (_number(held) is not None or key in LEFT_OUT):
            return False
        return wanted != held and not (row.target is None and harmless(key, wanted))

    def _width(self, key: str) -> Decimal:
        section = "output" if key.startswith("output.") else "pv"
        return abs(Decimal(self.before[f"{section}.range.1"]) - Decimal(self.before[f"{section}.range.0"]))

    def _unit(self, key: str) -> str:
        out, pv = self.loop.output.unit or "output", self.loop.pv.unit or "PV"
        if key == "tuning.gain":
            return f"{out}/{pv}"
        if key in {"output.max_rate", "alarms.rate_of_change"}:
            return f"{out if key.startswith('output') else pv}/s"
        if KINDS.get(key) in {"time", "filter"}:
            return "s"
        return (self.loop.output.unit if key.startswith("output.") else self.loop.pv.unit) or ""


def error_of(terms: Terms) -> Decimal:
    """How far a number is off, in %; infinite beside 0."""
    if not terms.wanted:
        return Decimal("Infinity")
    return abs(quotient(terms.held - terms.wanted, terms.wanted)) * 100


def _rounded(row: Change, terms: Terms) -> Change:
    """A line with a number that differs; gains, times and filters have the error of what acts."""
    if row.error_percent and KINDS.get(terms.field, "band") == "band":
        return row
    error = error_of(terms)
    percent = float(error) if error.is_finite() else row.error_percent
    return replace(row, kind="rounded" if row.kind == "exact" else row.kind, error_percent=percent, terms=terms)


def _within(key: str, name: str) -> bool:
    return key == name or key.startswith(f"{name}.")


def _number(value: Any) -> Decimal | None:
    return Decimal(value) if isinstance(value, Decimal | int) and not isinstance(value, bool) else None
