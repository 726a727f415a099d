"""All rules by code: the only module that knows what a code looks like, and whose rules it belongs to.

Only the modules are imported that have the rules in question: one finding needs the rules of one vendor.
"""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.validate.codes import LISTING, READING, SCENARIO, SCHEMA, SUPPRESSION
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.validate.rule import Rule

CODE = re.compile(r"PID[0-9]{3}")
"""A code as it is written in full."""
FILES, COMMON = "reading", "common"
GROUPS = {
    FILES: ("PID0",),
    COMMON: ("PID1",),
    "dl06": ("PID2", "PID5"),
    "click": ("PID3",),
    "ezlogix": ("PID4",),
    "nextopid": ("PID6",),
    "dpide": ("PID7",),
    "generic": ("PID8",),
}
"""What codes begin with: those about any file, those of every vendor, and those of one; none moves to another group."""
FILE_RULES = {rule.code: rule for rule in (*READING, *LISTING, *SCHEMA, *SUPPRESSION, *SCENARIO)}
"""What can be wrong with any file, before rules over a configuration run."""


def group_of(code: str) -> str | None:
    """The group of a code; None for what is no code."""
    return next((group for group, begins in GROUPS.items() if code.startswith(begins)), None)


def rules(begin: str = "") -> dict[str, Rule]:
    """The rules whose codes begin so, in order."""
    groups = [
        group
        for group, begins in GROUPS.items()
        if begin.startswith(begins) or any(other.startswith(begin) for other in begins)
    ]
    found = {code: rule for group in groups for code, rule in _rules_of(group).items() if code.startswith(begin)}
    return dict(sorted(found.items()))


def rule_of(code: str) -> Rule:
    """The rule that has a code; raises `KeyError` for what is no rule's."""
    return _rules_of(group_of(code))[code]


@cache
def _rules_of(group: str | None) -> Mapping[str, Rule]:
    """The rules of one group by code; a vendor has those for every vendor as well."""
    if group in VENDORS:
        rules: Mapping[str, Rule] = VENDORS[group].load("rules")
        return rules
    if group == COMMON:
        from pidcfg.validate.rules import collect, common

        return collect(common)
    return FILE_RULES if group == FILES else {}


def ignorable(finding: Diagnostic) -> bool:
    """Whether a user may do without a finding: not where a file cannot be read, or its words cannot be made."""
    return rule_of(finding.code).ignorable or finding.severity is not Severity.ERROR


def unusable(finding: Diagnostic) -> bool:
    """Whether a finding says that a text could not be read as a document (exit code 2)."""
    return rule_of(finding.code).unusable
