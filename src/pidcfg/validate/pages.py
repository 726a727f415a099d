"""The documentation of rules, for the command and for docs/rules.md: one source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pidcfg.validate.rule import Rule


def as_data(rule: Rule) -> dict[str, Any]:
    """A rule as the JSON output spells it."""
    return {
        "code": rule.code,
        "name": rule.name,
        "severity": rule.severity.label,
        "title": rule.title,
        "message": rule.message,
        "why": rule.part("Why"),
        "fix": rule.part("Fix"),
        "reference": str(rule.basis),
        "since": rule.since,
    }


def page(rule: Rule) -> str:
    """A rule as Markdown."""
    example = rule.part("Example")
    parts = [
        f"# {rule.code} {rule.name} ({rule.kind})",
        rule.title,
        *([f"Message: `{rule.message}`"] if rule.message != "{text}" else []),
        f"**Why.** {rule.part('Why')}",
        f"**Cure.** {rule.part('Fix')}",
        *([f"**Example.** {example}"] if example else []),
        f"Basis: {rule.basis}.",
    ]
    return "\n\n".join(parts) + "\n"
