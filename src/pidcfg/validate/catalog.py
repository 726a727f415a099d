"""All rules by code, their documentation, and the lines that remain to be looked at on the plant."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from functools import cache, lru_cache

from pidcfg.about import SITE
from pidcfg.text.diagnostics import Diagnostic, Severity, number_of
from pidcfg.text.references import Decision
from pidcfg.validate import PID_PREFIX, RuleText, has_prefix, list_texts, rule_texts
from pidcfg.validate.rule import (
    IGNORE_RULES,
    LISTING_RULES,
    LIVE_RULES,
    READING_RULES,
    SCENARIO_RULES,
    SCHEMA_RULES,
    Rule,
)
from pidcfg.vendors import VENDORS

# --- All rules by code: the only module that knows what a code looks like, and whose rules it belongs to --------------
#
# Only the modules are imported that have the rules in question: one finding needs the rules of one vendor.

CODE_PATTERN = re.compile(rf"(?:{'|'.join([PID_PREFIX, *(vendor.prefix for vendor in VENDORS.values())])})[0-9]{{3}}")
"""A code as it is written in full."""
CODE_SEPARATORS = re.compile("[^A-Z0-9]")
"""What people write within a code: blanks, hyphens, dots."""
RULES_HINT = "'pidcfg rule' lists all"
FILE_GROUP, COMMON_GROUP = "reading", "common"
GROUPS = {
    FILE_GROUP: f"{PID_PREFIX}0",
    COMMON_GROUP: f"{PID_PREFIX}1",
    **{vendor.key: vendor.prefix for vendor in VENDORS.values()},
}
"""The prefixes of codes about any file, of the common rules, and of each vendor; no code changes its group."""
FILE_RULES = {
    rule.code: rule
    for rule in (*READING_RULES, *LISTING_RULES, *LIVE_RULES, *SCHEMA_RULES, *IGNORE_RULES, *SCENARIO_RULES)
}
"""What can be wrong with any file, before rules over a configuration run."""


def group_of(code: str) -> str | None:
    """The group of a code; None for text that is not a code."""
    return next((group for group, begin in GROUPS.items() if code.startswith(begin)), None)


def is_chosen(finding: Diagnostic, select: Iterable[str], ignore: Iterable[str]) -> bool:
    """Whether beginnings of codes leave a finding; what keeps a file from being used cannot be ignored."""
    prefixes = [*select]
    is_selected = not prefixes or any(has_prefix(finding.code, begin) for begin in prefixes)
    return (is_selected and not any(has_prefix(finding.code, begin) for begin in ignore)) or not is_ignorable(finding)


def find_rules(prefix: str = "") -> dict[str, Rule]:
    """The rules whose codes have a prefix, in order."""
    groups = [group for group, start in GROUPS.items() if prefix.startswith(start) or has_prefix(start, prefix)]
    matching = {code: rule for group in groups for code, rule in _rules_of(group).items() if has_prefix(code, prefix)}
    return dict(sorted(matching.items(), key=lambda row: number_of(row[0])))


@lru_cache(maxsize=256)
def suggest_code(text: str) -> str:
    """What to do about a code that no rule has: write the one that was probably meant."""
    near = _nearest_code(CODE_SEPARATORS.sub("", text.upper()), text.lower())
    return f"did you mean {near}?" if near else RULES_HINT


def _nearest_code(code: str, name: str) -> str | None:
    """The code with the same number, which no two have, or of that name; the beginning of some; the most alike."""
    from pidcfg.text.signs import closest_name

    code = re.sub("(?<=[0-9])O|O(?=[0-9])", "0", code)
    number, begin = re.search("[0-9]{3}", code), re.match("[A-Z]+[0-9]{2}", code)
    for rule_code, rule in rule_texts().items():
        if name == rule.name or (number and number_of(rule_code) == number[0]):
            return rule_code
    if begin and not number:
        digits = begin[0].removeprefix(PID_PREFIX)
        for rule_code in list_texts(begin[0]) or (code for code in rule_texts() if number_of(code).startswith(digits)):
            return rule_code.removesuffix(number_of(rule_code)) + number_of(rule_code)[:2]
    return closest_name(code, rule_texts()) if len(re.findall("[0-9]", code)) > 1 else None


def rule_of(code: str) -> Rule:
    """The rule that has a code; raises `KeyError` where no rule has it."""
    return _rules_of(group_of(code))[code]


@cache
def _rules_of(group: str | None) -> Mapping[str, Rule]:
    """The rules of one group by code; a vendor's group includes the common rules."""
    if group in VENDORS:
        rules: Mapping[str, Rule] = VENDORS[group].load("rules")
        return rules
    if group == COMMON_GROUP:
        from pidcfg.validate.rules import collect_rules

        return collect_rules()
    return FILE_RULES if group == FILE_GROUP else {}


def is_ignorable(finding: Diagnostic) -> bool:
    """Whether a user may ignore a finding: not where the file cannot be read or encoded."""
    return finding.severity is not Severity.ERROR or rule_of(finding.code).is_ignorable


def is_unusable(finding: Diagnostic) -> bool:
    """Whether a finding says that a text could not be read as a document (exit code 2); only file rules do."""
    rule = FILE_RULES.get(finding.code)
    return rule is not None and rule.is_unusable


# ----------------------------------------------------------------------------------------------------------------------
# What is right as a file says it, and has to be looked at on the plant: lines of the checklist instead of findings.


def is_to_check(d: Diagnostic) -> bool:
    """Whether a rule's result belongs on the checklist; one that is worse than an info is a finding."""
    return d.severity is Severity.INFO and rule_of(d.code).is_checklist


def checklist_lines(checklist: Iterable[Diagnostic]) -> tuple[str, ...]:
    """One line a rule: what it says of the first loop, the others that it says it of, and what to look at."""
    groups: dict[str, list[Diagnostic]] = {}
    for d in checklist:
        groups.setdefault(d.code, []).append(d)
    return tuple(_checklist_line(group) for group in groups.values())


def _checklist_line(group: list[Diagnostic]) -> str:
    first = group[0]
    others = [name for name in dict.fromkeys(d.loop for d in group) if name and name != first.loop]
    also = f" (also {', '.join(others)})" if others else ""
    loop = f"{first.loop}: " if first.loop else ""
    return f"{loop}{first.message}{also}: {(first.help or '').rstrip('.')} ({first.code})"


# --- The documentation of rules, for the command and for docs/rules.md: one source ------------------------------------


def text_of(rule: Rule) -> RuleText:
    """What a rule says of itself."""
    return RuleText(
        rule.code,
        rule.name,
        rule.severity.label,
        rule.kind,
        rule.title,
        rule.message,
        rule.doc_part("Why"),
        rule.doc_part("Fix"),
        rule.doc_part("Example"),
        str(rule.basis),
        rule.since,
    )


D970 = Decision(
    970,
    "the page of a rule is told from the root of the documentation site until that has an address",
    "`url` of a finding in JSON is `rules-dl06.html#dl242-…`; with an address in `about.py` it is absolute. "
    "Formats that want an absolute address, rdjson and the language server, leave it out until then.",
    "No address has been given to the project, and one that is made up leads somebody else's readers astray. The root "
    "of a site that `python tasks.py docs` has built is known to whoever serves it.",
)


def rule_anchor(rule: Rule) -> str:
    """Where a rule's heading is, as code-hosting sites and the documentation site both make it."""
    return f"{rule.code.lower()}-{rule.name}-{rule.kind}"


def url_of(code: str, *, absolute: bool = False) -> str:
    """The page of a rule on the documentation site; ``absolute``: empty where it has no address."""
    if absolute and not SITE:
        return ""
    group = group_of(code)
    return f"{SITE}rules-{group}.html#{rule_anchor(rule_of(code))}"
