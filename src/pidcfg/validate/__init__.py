"""What the rules say of themselves, from a table: whoever prints it loads no rule, no model and no vendor.

``python tasks.py generate`` makes the table of the rules, whose labels and docstrings are the only source.
"""

from __future__ import annotations

import json
from dataclasses import asdict
from functools import cache
from pathlib import Path

from pidcfg.text.frozen import frozen

TABLE_FILE = Path(__file__).with_name("rules.json")
PID_PREFIX = "PID"
"""The prefix of codes that belong to no vendor."""


@frozen
class RuleText:
    """The texts of a rule."""

    code: str
    name: str
    severity: str
    kind: str
    """The severity, or ``checklist``."""
    title: str
    message: str
    why: str
    fix: str
    example: str
    reference: str
    since: str


@cache
def text_by_code(code: str) -> RuleText | None:
    """The texts of one rule, without reading those of the others; None: no rule has the code."""
    begin = f"{{{json.dumps('code')}: {json.dumps(code)}, "
    line = next((line for line in TABLE_FILE.read_text("utf-8").splitlines() if line.startswith(begin)), None)
    return None if line is None else RuleText(**json.loads(line.removesuffix(",")))


@cache
def rule_texts() -> dict[str, RuleText]:
    """The texts of all rules by code, in order."""
    return {row["code"]: RuleText(**row) for row in json.loads(TABLE_FILE.read_text("utf-8"))}


def table_of(rows: list[RuleText]) -> str:
    """The table as it is kept: a line a rule."""
    lines = ",\n".join(json.dumps(asdict(row), ensure_ascii=False) for row in rows)
    return f"[\n{lines}\n]\n"


def has_prefix(code: str, prefix: str) -> bool:
    """Whether a code has a prefix; the prefix that all codes once had, and any part of it, matches every code."""
    return code.startswith(prefix) or PID_PREFIX.startswith(prefix)


def list_texts(prefix: str) -> dict[str, RuleText]:
    """The texts of the rules whose codes have a prefix, in order."""
    return {code: rule for code, rule in rule_texts().items() if has_prefix(code, prefix)}


def rule_data(rule: RuleText) -> dict[str, object]:
    """A rule as the JSON output spells it."""
    return {
        "code": rule.code,
        "name": rule.name,
        "severity": rule.severity,
        "title": rule.title,
        "message": rule.message,
        "why": rule.why,
        "fix": rule.fix,
        "reference": rule.reference,
        "since": rule.since,
    }


def rule_page(rule: RuleText) -> str:
    """A rule as Markdown."""
    parts = [
        f"# {rule.code} {rule.name} ({rule.kind})",
        rule.title,
        *([f"Message: `{rule.message}`"] if rule.message != "{text}" else []),
        f"**Why.** {rule.why}",
        f"**Cure.** {rule.fix}",
        *([f"**Example.** {rule.example}"] if rule.example else []),
        f"Basis: {rule.reference}.",
    ]
    return "\n\n".join(parts) + "\n"
