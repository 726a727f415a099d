"""The pages of rules and of decisions: what they are made of stands beside the code that they explain."""

from __future__ import annotations

import re
import sys
from typing import TYPE_CHECKING

from pidcfg.explanation.decisions import placed_decisions
from pidcfg.validate.pages import all_rules, page
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.validate.rule import Rule

GROUPS = {
    # page      its title, and the beginnings of its codes
    "reading": ("Rules of reading: text, keys, scenarios", ("PID0",)),
    "common": ("Rules of all vendors", ("PID1",)),
    "dl06": ("Rules of the DL06", ("PID2", "PID5")),
    "click": ("Rules of the CLICK", ("PID3",)),
    "ezlogix": ("Rules of the EZLogix", ("PID4",)),
    "nextopid": ("Rules of the NextoPID", ("PID6",)),
    "dpide": ("Rules of the DPIDE", ("PID7",)),
    "generic": ("Rules of the neutral form", ("PID8",)),
}
"""Codes are grouped by their first digit, and never move to another group."""

ABOUT = {
    "reading": """\
What makes a text unreadable, keys and values that the file format does not have, and scenarios that cannot run.""",
    "common": "Mistakes that no PLC is safe from, such as two loops of one name.",
    "dl06": """\
Where the PLC itself would notice the mistake, the finding names the bit of V7642, or the alarm programming error.""",
    "click": "Where the PLC itself would notice the mistake, the finding names the number of its PID error.",
    "ezlogix": "The PLC notices hardly any of this by itself.",
    "nextopid": "Where the block itself would notice the mistake, the finding names the bit of ErrBits or WarnBits.",
    "dpide": "Some of this the instruction corrects without a word; it reports next to nothing.",
    "generic": "What no PLC could do, whichever the loop is converted to.",
}
RULES = """\
# Rules

The {count} mistakes that `pidcfg validate` knows. Each has a code that never means anything else, and a section with
the reason, the cure and the manual's place; `pidcfg rule CODE` prints the same text. An error is what the PLC refuses,
or what makes a loop run away or stand still; a warning is what is seldom meant; an info is worth knowing.
"""
DECISIONS = """\
# Decisions

What pidcfg does where a manual is silent, misprinted or contradicts itself, and why. A decision keeps its number for
ever; rules, registers and reports quote it. The grounds say what the decision rests on, and so what a PLC on a bench
would have to show to overturn it.
"""

EVERY, CONVERSION = "All vendors", "Conversion"
CHOICES = "|".join(VENDORS)


def rule_pages() -> dict[str, str]:
    """The index of all rules, and a page a group."""
    table = all_rules()
    found = {"rules.md": index(table)}
    for name, (title, starts) in GROUPS.items():
        own = "\n".join("#" + page(rule) for rule in table.values() if rule.code.startswith(starts))
        found[f"rules-{name}.md"] = f"# {title}\n\n{ABOUT[name]} [All rules](rules.md) stand in one list.\n\n{own}"
    return found


def index(table: dict[str, Rule]) -> str:
    """Every rule in a line, under the group that explains it."""
    text, left = RULES.format(count=len(table)), dict(table)
    for name, (title, starts) in GROUPS.items():
        own = [left.pop(code) for code in table if code.startswith(starts)]
        text += f"\n## {title}\n\n| code | severity | what is wrong |\n|---|---|---|\n"
        for rule in own:
            link = f'<a id="{rule.code.lower()}"></a>[{rule.code}](rules-{name}.md#{anchor(rule)})'
            text += f"| {link} | {rule.severity.label} | {rule.title} |\n"
    if left:
        sys.exit(f"rules that no page takes: {', '.join(left)}")
    return text


def anchor(rule: Rule) -> str:
    """Where a rule's heading is, as code-hosting sites and the documentation site both make it."""
    return f"{rule.code.lower()}-{rule.name}-{rule.severity.label}"


# --- decisions --------------------------------------------------------------------------------------------------------


def subject(module: str) -> str:
    """What a decision of this module is about: one vendor, conversion, or all."""
    if module.startswith("pidcfg.conversion"):
        return CONVERSION
    named = re.search(rf"\.({CHOICES})(?:$|[._])", module.replace("rules.generic", ""))
    return VENDORS[named[1]].title if named else EVERY


def decisions() -> str:
    """What pidcfg does where a manual is silent or contradicts itself, and on what grounds."""
    found, text = [(subject(module), decision) for module, decision in placed_decisions()], DECISIONS
    for group in (EVERY, *(vendor.title for vendor in VENDORS.values()), CONVERSION):
        own = [decision for about, decision in found if about == group]
        text += f"\n## {group}\n" if own else ""
        text += "".join(f"\n### D{d.number:02d} {d.title}\n\n{d.text}\n\n**Grounds.** {d.why}\n" for d in own)
    return text
