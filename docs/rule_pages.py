"""The pages of rules and of decisions: what they are made of stands beside the code that they explain."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.output.explanation.lookup import decisions_with_modules
from pidcfg.validate import rule_page
from pidcfg.validate.catalog import GROUPS, find_rules, rule_anchor, text_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.validate.rule import Rule

TITLES = {
    "reading": "Rules of reading: text, keys, scenarios",
    "common": "Rules of all vendors",
    "dl06": "Rules of the DL06",
    "click": "Rules of the CLICK",
    "ezlogix": "Rules of the EZLogix",
    "nextopid": "Rules of the NextoPID",
    "dpide": "Rules of the DPIDE",
    "generic": "Rules of the neutral form",
}
"""Of the pages, one a group of codes: where a vendor's own title would be too long."""

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
A line of the checklist is right as it stands and wants a look at the plant: `pidcfg encode` and the report print it,
`validate` does not.

A code begins with the prefix of its vendor ({prefixes}), or with `PID` where it is about any file or every
vendor. `--select DL` chooses one vendor's rules, `--select PID` all there are. A code that no rule has
is refused, with the one that is probably meant: `PID242` with `DL242`.
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
    pages = {"rules.md": index()}
    for group in GROUPS:
        sections = "\n".join(f"#{rule_page(text_of(rule))}" for rule in rules_of(group))
        pages[f"rules-{group}.md"] = (
            f"# {title(group)}\n\n{ABOUT.get(group, '')} [All rules](rules.md) stand in one list.\n\n{sections}"
        )
    return pages


def title(group: str) -> str:
    """The title of a group's page; a vendor without one of its own has that of its row."""
    return TITLES.get(group) or f"Rules of the {VENDORS[group].title}"


def rules_of(group: str) -> list[Rule]:
    """The rules of one group, in order."""
    return list(find_rules(GROUPS[group]).values())


def index() -> str:
    """Every rule in a line, under the group that explains it."""
    text = RULES.format(
        count=len(find_rules()), prefixes=", ".join(f"`{v.prefix}` {v.title}" for v in VENDORS.values())
    )
    for group in GROUPS:
        text += f"\n## {title(group)}\n\n| code | severity | what is wrong |\n|---|---|---|\n"
        for rule in rules_of(group):
            link = f'<a id="{rule.code.lower()}"></a>[{rule.code}](rules-{group}.md#{rule_anchor(rule)})'
            text += f"| {link} | {rule.kind} | {rule.title} |\n"
    return text


# --- decisions --------------------------------------------------------------------------------------------------------


def subject(module: str) -> str:
    """What a decision of this module is about: one vendor, conversion, or all."""
    if module.startswith("pidcfg.conversion"):
        return CONVERSION
    named = re.search(rf"\.({CHOICES})(?:$|[._])", module.replace("rules.generic", ""))
    return VENDORS[named[1]].title if named else EVERY


def decisions() -> str:
    """What pidcfg does where a manual is silent or contradicts itself, and on what grounds."""
    found, text = [(subject(module), decision) for module, decision in decisions_with_modules()], DECISIONS
    for group in (EVERY, *(vendor.title for vendor in VENDORS.values()), CONVERSION):
        own = [decision for about, decision in found if about == group]
        text += f"\n## {group}\n" if own else ""
        text += "".join(f"\n### D{d.number:02d} {d.title}\n\n{d.text}\n\n**Grounds.** {d.why}\n" for d in own)
    return text
