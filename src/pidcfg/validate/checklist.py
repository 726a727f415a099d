"""What is right as a file says it, and has to be looked at on the plant: lines of the checklist instead of findings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.validate.catalog import rule_of

if TYPE_CHECKING:
    from collections.abc import Iterable


def is_to_check(d: Diagnostic) -> bool:
    """Whether a rule's result belongs on the checklist; one that is worse than an info is a finding."""
    return d.severity is Severity.INFO and rule_of(d.code).checklist


def lines(checklist: Iterable[Diagnostic]) -> tuple[str, ...]:
    """One line a rule: what it says of the first loop, the others that it says it of, and what to look at."""
    groups: dict[str, list[Diagnostic]] = {}
    for d in checklist:
        groups.setdefault(d.code, []).append(d)
    return tuple(_line(group) for group in groups.values())


def _line(group: list[Diagnostic]) -> str:
    first = group[0]
    others = [name for name in dict.fromkeys(d.loop for d in group) if name and name != first.loop]
    also = f" (also {', '.join(others)})" if others else ""
    loop = f"{first.loop}: " if first.loop else ""
    return f"{loop}{first.message}{also}: {(first.help or '').rstrip('.')} ({first.code})"
