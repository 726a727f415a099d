"""What a rule is: a label, a documented function, and the findings it yields.

The docstring has fixed parts: a first line that says what is wrong, ``Why:`` and ``Fix:``. `pidcfg rule` prints it and
docs/rules.md is made of it. The decorator builds a `Rule` and registers nothing; the list of rules is in `rules`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path, Severity
    from pidcfg.refs import Basis

PLACEHOLDER = re.compile(r"\{(\w+)")


@dataclass(frozen=True, slots=True)
class Finding:
    """One fault: where it stands, the values of the rule's message, and what differs from the label."""

    path: Path
    values: dict[str, Any] = field(default_factory=dict)
    key: bool = False
    plc_effect: str | None = None
    severity: Severity | None = None
    fix: str | None = None
    basis: Basis | None = None
    offset: int | None = None
    """The character (0-based) that is meant within a value; None: all of it."""
    also: tuple[str, ...] = ()
    """Further loops that it concerns, where it is reported once."""


Check = Callable[[Any], Iterator[Finding]]


NAMED = 8
"""Loops that a message names before it only counts."""


def once(found: Finding, others: Sequence[str]) -> Finding:
    """A finding that is reported once for several loops; its message names the ``others``."""
    more = f" and {len(others) - NAMED} more" if len(others) > NAMED else ""
    text = f", as in {', '.join(others[:NAMED])}{more}" if others else ""
    return replace(found, also=tuple(others), values={**found.values, "others": text})


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule: its label, and a check that takes the vendor's `Context`."""

    code: str
    name: str
    severity: Severity
    message: str
    basis: Basis
    since: str
    doc: str
    check: Check | None = None

    @property
    def title(self) -> str:
        """The first line of the documentation: what is wrong."""
        return self.doc.partition("\n")[0]

    def part(self, heading: str) -> str:
        """One part of the documentation (``Why`` or ``Fix``) as a single paragraph; empty when there is none."""
        found = re.search(rf"^{heading}:\s*(.*?)(?=^\w+:|\Z)", self.doc, re.DOTALL | re.MULTILINE)
        return " ".join(found.group(1).split()) if found else ""

    @property
    def fields(self) -> set[str]:
        """The names that the message needs."""
        return set(PLACEHOLDER.findall(self.message))


def rule(
    *, code: str, name: str, severity: Severity, message: str, basis: Basis, since: str = "0.1"
) -> Callable[[Check], Rule]:
    """Labels a check."""

    def label(check: Check) -> Rule:
        return Rule(code, name, severity, message, basis, since, inspect.getdoc(check) or "", check)

    return label


def finding(*path: str | int, **values: Any) -> Finding:
    """A finding at a path, with the values of the message."""
    return Finding(path, values)


def at_key(*path: str | int, **values: Any) -> Finding:
    """A finding that points at the key rather than at its value."""
    return Finding(path, values, key=True)
