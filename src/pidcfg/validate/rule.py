"""What a rule is and what the rules look at; and the rules about any file: its text, its keys, its comments."""

from __future__ import annotations

import hashlib
import inspect
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from decimal import Decimal, InvalidOperation
from functools import cache
from typing import TYPE_CHECKING, Any

from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.text.references import Basis

# --- What a rule is: a label, a documented function, and the findings it yields ---------------------------------------
#
# The docstring has fixed parts: a first line that says what is wrong, ``Why:`` and ``Fix:``. `pidcfg rule` prints it
# and docs/rules.md is made of it. A label builds a `Rule` and registers nothing; the list of rules is in `rules`.

PLACEHOLDER = re.compile(r"\{(\w+)")


@frozen
class Finding:
    """One fault: where it stands, the values of the rule's message, and what differs from the label."""

    path: Path
    values: Mapping[str, object] = field(default_factory=dict)
    key: bool = False
    plc_effect: str | None = None
    severity: Severity | None = None
    fix: str | None = None
    basis: Basis | None = None
    offset: int | None = None
    """The character (0-based) within a value that the finding points at; None: the whole value."""
    with_loops: tuple[str, ...] = ()
    """The other loops of the same fault, each of which gets a finding of its own."""
    correction: str | None = None
    """The only text that the value can mean; None: a person has to decide."""

    def with_values(self, **values: object) -> Finding:
        """The same, with these values of the message as well."""
        return replace(self, values={**self.values, **values})

    def with_other_loops(self, *loops: str) -> Finding:
        """The same, of a fault that concerns these loops as well."""
        return replace(self, with_loops=loops)

    def correct_to(self, text: str | None) -> Finding:
        """The same, with the only text that the value can mean, which `--fix` writes; for errors alone."""
        return replace(self, correction=text)


Findings = Iterator[Finding]
"""What a check yields."""
Check = Callable[[Any], Findings]
FIRST_VERSION = "0.1"
"""The version that has all the rules there are."""


@frozen
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
    is_ignorable: bool = True
    """Whether a comment, a baseline or an option may take away what it finds."""
    is_unusable: bool = False
    """Whether a file that has the fault cannot be read at all."""
    is_checklist: bool = False
    """Whether it is nothing that a file could say better, but something to look at: a line of the checklist."""

    @property
    def kind(self) -> str:
        """What it yields, in a word: ``error``, ``warning``, ``info`` or ``checklist``."""
        return "checklist" if self.is_checklist else self.severity.label

    @property
    def title(self) -> str:
        """The first line of the documentation: what is wrong."""
        return self.doc.partition("\n")[0]

    def doc_part(self, heading: str) -> str:
        """One part of the documentation (``Why`` or ``Fix``) as a single paragraph; empty when there is none."""
        return _doc_part(self.doc, heading)

    @property
    def fields(self) -> set[str]:
        """The names that the message needs."""
        return set(PLACEHOLDER.findall(self.message))


@cache
def _doc_part(doc: str, heading: str) -> str:
    match = re.search(rf"^{heading}:\s*(.*?)(?=^\w+:|\Z)", doc, re.DOTALL | re.MULTILINE)
    return " ".join(match.group(1).split()) if match else ""


Label = Callable[[Check], Rule]


def _make_label(severity: Severity, code: str, basis: Basis, message: str) -> Label:
    """What stands above a check; the rule's name is that of the function."""

    def label(check: Check) -> Rule:
        name = check.__name__.replace("_", "-")
        return Rule(code, name, severity, message, basis, FIRST_VERSION, inspect.getdoc(check) or "", check)

    return label


def error(code: str, basis: Basis, message: str) -> Label:
    """A rule about what the PLC refuses, or what makes a loop run away or stand still."""
    return _make_label(Severity.ERROR, code, basis, message)


def warning(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is seldom intended."""
    return _make_label(Severity.WARNING, code, basis, message)


def info(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is worth knowing."""
    return _make_label(Severity.INFO, code, basis, message)


def checklist(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is right as it stands and has to be looked at on the plant: a line of the checklist."""
    label = _make_label(Severity.INFO, code, basis, message)
    return lambda check: replace(label(check), is_checklist=True)


def _per_item(attribute: str) -> Callable[[Rule], Rule]:
    """A rule whose check looks at one item of its context, such as a loop, turned into one that looks at them all."""

    def apply_to_all(rule: Rule) -> Rule:
        check = rule.check
        if check is None:
            raise TypeError(f"{rule.code} has no check")

        def check_all(context: Any) -> Findings:
            for view in getattr(context, attribute):
                yield from check(view)

        return replace(rule, check=check_all)

    return apply_to_all


def never_ignorable(rule: Rule) -> Rule:
    """Above the label of a rule that no comment, setting or baseline covers."""
    return replace(rule, is_ignorable=False)


per_loop = _per_item("loops")
"""Above the label of a check that takes a loop's view: the rule looks at every loop."""
per_pid = _per_item("pids")
"""As `per_loop`, for checks of a PID block."""


def make_finding(*path: str | int, plc_effect: str | None = None, key: bool = False, **values: object) -> Finding:
    """A finding at a path, with the values of the message; ``key``: it points at the key rather than at the value."""
    return Finding(path, values, key=key, plc_effect=plc_effect)


# --- Rules about any file: what can be wrong with its text, its keys, its comments or its scenario --------------------
#
# Rows only: what a reader or a schema type reports by kind is given its code and its explanation here.

D05 = Decision(
    5,
    "the field decides what a text means",
    "Scalars are read as text; numbers, switches and addresses are what their "
    "field says, and a spelling that two people read differently is refused with both readings.",
    "YAML 1.1 and 1.2 disagree on 010, yes and 1_000, and PLC engineers read a leading zero as octal.",
)

D720 = Decision(
    720,
    "curly quotes are letters",
    "A text that begins and ends with quotes of a word processor (“…”, „…“, «…» and single ones) is kept as it is written, with a "
    "warning (PID018); around a number or a word of a choice they are an error, as any other letter is there. `--fix` "
    "leaves them alone. Inside of YAML's own quotes they are meant.",
    "YAML 1.2 knows two quotes, ' and \". Which of the two readings is meant in a text only its writer can say.",
)

D930 = Decision(
    930,
    "a unit wants a range",
    "A number with a unit at a key that the PLC holds in counts (DL06, EZLogix) is an error where the loop gives no range "
    "of that side (PID039), in files, sheets and scenarios. A bare number there is counts; where the loop names a unit, a "
    "warning says so (PID109), and `2048 counts` says it without one.",
    "Without a range 85 °C can only become 85 counts, 4.2 °C of a range of 200. Who writes a unit means the unit; who "
    "writes none may mean either.",
)
D931 = Decision(
    931,
    "what follows # in a name or a description",
    "YAML ends a text at a blank and `#`. In a name, a description or a unit of one line one blank before `#` is taken for a "
    "part of the text and warned of (PID019); two blanks and more are a comment, and so is what begins with `pidcfg:`.",
    "`Ofen # 3` is stored as `Ofen`, and nothing else shows it. Style guides and formatters of YAML put two blanks before "
    "a comment, so that few are warned of.",
)
D315 = Decision(
    315,
    "what may be ignored, and where that counts",
    "A comment, a baseline or --ignore quietens `pidcfg validate` and "
    "nothing else: `encode`, `convert` and `simulate` go on refusing what has errors. Errors of text, schema and scenario "
    "(PID0xx) cannot be ignored at all, nor two loops of one name (PID106); warnings and every other rule from PID101 on "
    "can. A comment names whole codes and a reason, and is reported when it ignores nothing.",
    "The words of a wrong configuration stay wrong when somebody stops reading about it, and a file that could not be "
    "read in one way only has not been checked.",
)
D317 = Decision(
    317,
    "what makes a finding a known one",
    "A baseline knows findings by file, code, severity, loop, key, the value that is written there, the other values of "
    "the loop that the message quotes, and how many there are; never by line or wording. Other loops of the fault, "
    "addresses and numbers of items are no part of it. It is made once, by --create-baseline, and after that only loses "
    "entries.",
    "Lines and addresses move with every loop that is inserted, and messages quote both; none of that is a new fault. A "
    "value that changes is, whichever of the keys that do not fit together it stands at: somebody has to look at it.",
)


def _unignorable_rule(
    code: str, name: str, title: str, why: str, fix: str, severity: Severity = Severity.ERROR
) -> Rule:
    """A fault that cannot be ignored where it is an error: without curing it there is no configuration."""
    doc = f"{title}\n\nWhy: {why}\n\nFix: {fix}"
    return Rule(code, name, severity, "{text}", D05, FIRST_VERSION, doc, is_ignorable=severity is not Severity.ERROR)


def _unreadable_rule(code: str, name: str, title: str, why: str, fix: str) -> Rule:
    """A fault that keeps a text from being read as a document: exit code 2."""
    return replace(_unignorable_rule(code, name, title, why, fix), is_unusable=True)


def _remark_rule(code: str, name: str, title: str, why: str, fix: str, basis: Decision = D315) -> Rule:
    """A warning about a comment or a baseline."""
    return replace(_unignorable_rule(code, name, title, why, fix, Severity.WARNING), basis=basis)


# fmt: off
READING_RULES = (
    _unreadable_rule("PID001", "not-yaml", "The text is not YAML.", "A file that cannot be read cannot be checked.", "Correct the place that the message points at; indentation and missing quotes are the usual causes."),
    _unreadable_rule("PID002", "not-utf8", "The file is not UTF-8.", "Another encoding would change names and units silently.", "Save the file as UTF-8."),
    _unreadable_rule("PID003", "control-character", "The file holds a control character.", "NUL and its like have no place in text and break the tools that follow.", "Delete the character."),
    _unreadable_rule("PID004", "duplicate-key", "A key stands twice in one mapping.", "YAML readers take the first or the last of them, so two people see two different set-ups.", "Keep one."),
    _unreadable_rule("PID005", "empty-file", "The file is empty.", "There is nothing to check, which is never what was meant.", "Start from `pidcfg init`."),
    _unreadable_rule("PID006", "not-a-mapping", "The file is a list or a single value.", "A configuration is a mapping of keys to values.", "Begin with the line `pidcfg: 1`."),
    _unreadable_rule("PID007", "several-documents", "The file holds several YAML documents.", "It would not be clear which of them is downloaded.", "Put each into a file of its own."),
    _unreadable_rule("PID008", "complex-key", "A key is a list, a mapping, an alias or missing.", "Keys of this format are plain words.", "Write `key: value`."),
    _unreadable_rule("PID009", "merge-key", "The file uses a merge key (`<<`).", "Merging hides where a value comes from, and YAML 1.2 has dropped it.", "Write the keys out, or alias a whole value."),
    _unreadable_rule("PID010", "tag", "The file uses a tag (`!…`).", "The key decides what a value is; a tag could only contradict it.", "Delete the tag."),
    _unreadable_rule("PID011", "directive", "The file has a YAML directive (`%…`).", "YAML 1.1 reads numbers and booleans differently.", "Delete the line; files are YAML 1.2."),
    _unreadable_rule("PID012", "bad-alias", "An alias names no anchor above it, or itself.", "It has no value.", "Define the anchor above its use, or write the value out."),
    _unreadable_rule("PID013", "limit", "The file is larger, deeper or longer than the limits.", "Limits keep a hostile or broken file from taking the machine.", "Split the file, or raise the limit by an option of the command."),
    _unreadable_rule("PID014", "tab", "A tab is used for indentation.", "YAML forbids it, since editors show tabs at different widths.", "Indent with spaces."),
    _unreadable_rule("PID015", "unknown-template", "A loop uses a template that is not there, or templates use each other in a ring.", "The loop would lack what the template gives it.", "Write the name of a template that stands under `templates`."),
    _unreadable_rule("PID016", "bad-template", "A template is no loop, has a name, or has a list where the loop that uses it has something else.", "A template holds what equal loops have in common; lists are replaced as a whole, never in part.", "Write the keys of a loop below the template's name, and what is a loop's own into the loop."),
    _unreadable_rule("PID040", "unreadable", "A file cannot be opened.", "It is missing, a folder without configurations, or not permitted.", "Check the path."),
)
LISTING_RULES = (
    _unreadable_rule("PID041", "bad-listing", "A memory listing cannot be read, or its words are no configuration.", "A missing or impossible word would have to be guessed.", "Export the listing again, or name its format with --from and what it lacks with the options of `pidcfg decode`."),
    _unignorable_rule("PID042", "not-convertible", "A configuration does not say what its conversion needs.", "A range, a sample time or a form that is guessed is a wrong gain.", "Add the key that the message names."),
)
LIVE_RULES = (
    _unignorable_rule("PID065", "plc-differs", "A PLC holds another setting than its file.", "What runs is not what was agreed: somebody has changed the PLC or the file, or a download was never made.", "Find out who changed it; correct the file, or write its value into the PLC."),
    _unreadable_rule("PID066", "plc-not-reached", "A PLC is not reached, or does not give what is asked for.", "Nothing has been compared: that is neither a pass nor a difference.", "Look at the cable, the address, the unit number and what the PLC allows over Modbus; the message names the function and the register."),
    _unignorable_rule("PID069", "setting-not-read", "A setting of a file is in no register of the PLC, so that it was not compared.", "The PLC may run with another one, and nothing here would show it: a gain that was doubled, an action that was turned round.", "Look at it in the vendor's software, or give it a register and a row of the map; `--strict` ends with 1 for it.", Severity.WARNING),
    _unignorable_rule("PID067", "unusable-map", "The Modbus map that a configuration names cannot be used.", "A register that is missing from it, or that it has twice, would be read as another one's, or not at all.", "Correct the line of the map that the message names; `pidcfg encode FILE --format modbus-map` writes one to be filled in."),
)
"""What `pidcfg compare` finds, and what is wrong with the map that it reads by."""
SCHEMA_RULES = (
    _unignorable_rule("PID020", "unknown-key", "A key is not known here.", "It would be ignored, and the setting it was meant for would keep its default.", "Correct the spelling; the message suggests the nearest key."),
    _unignorable_rule("PID021", "missing-key", "A required key is missing.", "It has no safe default.", "Add the key."),
    _unignorable_rule("PID022", "wrong-type", "A value is of the wrong kind.", "A list, a text or a number stands where another kind is wanted.", "Write the kind that the message asks for."),
    _unignorable_rule("PID023", "not-finite", "A number is infinite, not a number, or too large to compute with.", "No register holds it.", "Write a finite number."),
    _unignorable_rule("PID024", "leading-zero", "A number has a leading zero.", "YAML 1.1 and PLC engineers read it as octal, YAML 1.2 as decimal.", "Write the reading that is meant."),
    _unignorable_rule("PID025", "number-notation", "A number is written in a notation other than decimal.", "Readers disagree about 1_000, 0b11, 0x1F and 60:30.", "Write it in decimal."),
    _unignorable_rule("PID026", "boolean-spelling", "A switch is neither `true` nor `false`.", "`yes` and `on` are text in YAML 1.2.", "Write `true` or `false`."),
    _unignorable_rule("PID027", "not-a-choice", "A value is not one of the words allowed here.", "It would select nothing.", "Write one of the words in the message."),
    _unignorable_rule("PID028", "bad-unit", "A time or rate has a unit that is not known.", "A wrong unit is a wrong value.", "Use ms, s, min or h."),
    _unignorable_rule("PID029", "bad-address", "An address is not written the vendor's way.", "02000 can be octal or decimal, V2008 is neither, and DF501 does not exist.", "Write addresses as the vendor does: V2000 (octal), C101, DF106, R100."),
    _unignorable_rule("PID030", "format-version", "The format version is missing or not supported.", "A newer file may mean something else by the same keys.", "Begin with the line `pidcfg: 1`, or update pidcfg."),
    _unignorable_rule("PID031", "unknown-vendor", "The vendor is not known.", "Without it no schema can be chosen.", "Write one of the vendors in the message."),
    _unignorable_rule("PID032", "neither-vendor-nor-scenario", "The file says neither which vendor it is for nor that it is a scenario.", "It could be anything.", "Add `vendor: …` for a configuration, or `scenario: …` for a simulation."),
    _unignorable_rule("PID033", "bad-name", "A name holds characters that outputs cannot carry.", "Names reach tags, file names and spreadsheets.", "Begin with a letter or digit; letters, digits, blanks and _ - . / # may follow."),
    _unignorable_rule("PID034", "range-order", "A range does not ascend.", "0 % must lie below 100 %.", "Write the lower end first; the direction of control is the loop's `action`. Where the signal falls as the value rises, turn it round in the input module or the program: written in ascending order alone the scale is the wrong way round."),
    _unignorable_rule("PID035", "incomplete-transfer", "An auto transfer names neither a channel nor an address, or both.", "The CPU would read the wrong input.", "Give slot and channel, or address."),
    _unignorable_rule("PID036", "too-many-items", "A list has more items than there is room for.", "The table in the PLC has a fixed size.", "Remove items."),
    _unignorable_rule("PID037", "no-value", "A key has no value.", "An empty value is neither a number nor a default.", "Give a value, or remove the key."),
    _unignorable_rule("PID017", "unused-template", "No loop uses a template.", "Nothing in it is checked, and somebody may believe that it is in force.", "Use it, or delete it.", Severity.WARNING),
    replace(_unignorable_rule("PID018", "curly-quotes", "A text stands in quotes of a word processor.", "They are letters to YAML, so that the unit or the name has them in it, also in the PLC's tables and in reports.", "Write straight quotes, or none.", Severity.WARNING), basis=D720),
    replace(_unignorable_rule("PID019", "text-cut-off", "A text is cut off by a comment.", "YAML ends a text at a blank and #, so that the rest stands in no register, no table and no report.", "Put the text into quotes; put two blanks before a # that begins a comment.", Severity.WARNING), basis=D931),
    _unignorable_rule("PID038", "loops-not-checked", "Some loops cannot be read, so what concerns several loops was not checked.", "Rules that compare loops would find faults of a loop that is not there; the other loops were checked each by itself.", "Correct the errors of the loops that cannot be read, and check again.", Severity.INFO),
    replace(_unignorable_rule("PID039", "unit-without-range", "A number has a unit, and no range makes counts of it.", "The PLC would get the bare number as counts: 85 °C of a range of 200 would be 4.2 °C.", "Give the range of that side, or write counts."), basis=D930),
)
IGNORE_RULES = (
    _remark_rule("PID043", "unused-ignore", "A comment ignores findings that are not there.", "It would hide the next one of its kind that comes to this line.", "Delete the comment, or the code; `--fix` does it."),
    _remark_rule("PID044", "ignore-of-unknown-code", "A comment ignores a code that no rule has.", "It ignores nothing, and somebody believes it does.", "Correct the code; `pidcfg rule` lists all. Codes are written in full."),
    _remark_rule("PID045", "malformed-ignore", "A comment begins like an ignore but cannot be read as one.", "It ignores nothing. An ignore without codes would hide everything that comes to its line.", "Write `# pidcfg: ignore[DL211] reason`."),
    _remark_rule("PID046", "ignore-without-reason", "A comment ignores a finding and does not say why.", "Whoever reads the file next cannot tell a decision from an oversight.", "Write the reason behind the bracket."),
    _remark_rule("PID047", "not-ignorable", "A comment ignores an error that cannot be ignored.", "Without it there is no configuration: nothing else in the file has been checked.", "Correct the error, and delete the comment."),
    _remark_rule("PID048", "stale-baseline-entry", "A baseline knows a finding that no longer occurs.", "It would hide the same finding when it comes back.", "Run `pidcfg validate` on the same paths with `--shrink-baseline`.", D317),
)
"""Mistakes in comments and baselines that are to suppress findings."""
SCENARIO_RULES = (
    _unignorable_rule("PID050", "unknown-name", "A scenario names a loop, signal, alarm, mode or key that its configuration does not have.", "The event or expectation would concern nothing.", "Correct the spelling; the message suggests the nearest name."),
    _unignorable_rule("PID051", "bad-expression", "An expression of signals cannot be read.", "Only numbers, declared names, + - * /, parentheses and min, max, abs, sqrt have a meaning.", "Correct the character that the message points at."),
    _unignorable_rule("PID052", "keys-do-not-combine", "Keys of a plant, an event or an expectation do not go together.", "It would not be clear what is meant.", "Keep the keys that the message names."),
    _unignorable_rule("PID053", "scenario-value", "A value of a scenario is outside what can be simulated.", "A plant without a time constant above 0, or a bound in the wrong unit, has no meaning.", "Write a value as the message asks for."),
    _unignorable_rule("PID054", "event-after-end", "An event comes after the end of the scenario.", "It never happens.", "Lengthen the duration, or move the event.", Severity.WARNING),
    _unignorable_rule("PID055", "loop-without-plant", "Nothing is wired to the PV of a loop.", "Its PV stays at the low end of its range.", "Add the loop to plants, or its PV to connect.", Severity.WARNING),
    _unignorable_rule("PID056", "rounded-to-steps", "A time does not fit the base step.", "The simulation advances in steps: a sample comes with the next one, and a plant takes at most 100 parts of a step.", "Choose a time or a step that fits, if the difference matters.", Severity.WARNING),
    _unignorable_rule("PID057", "no-steady-state", "The loops do not come to rest before time 0.", "With `initial: steady` the run starts where everything is settled; nothing settles.", "Check mode, action and tuning, and the signs of gain and load of the plant."),
    _unignorable_rule("PID059", "set-up-fails", "The scenario gives the PLC a set-up that its own check refuses.", "The PLC then calculates no loop; the run shows that.", "Correct `plc.number_of_loops`, unless the failure is what is to be shown.", Severity.WARNING),
    _unignorable_rule("PID060", "wrong-action", "The action of a loop does not fit its plant.", "The output would drive the PV away from the set point: a heater runs to full power and stays there.", "Compare the action with the plant: DL06 and CLICK name the process (direct: the PV rises with the output), EZLogix the controller (reverse: the output rises when the PV falls). Then the sign of the plant's gain."),
    _unignorable_rule("PID058", "unusable-configuration", "The configuration or listing of a scenario cannot be used.", "There is nothing to simulate.", "Correct the path, or validate the configuration."),
    _unignorable_rule("PID061", "expectation-failed", "An expectation of a scenario does not hold.", "The loops do not do what they were set up for, or more was expected than they can do.", "Look at the trend (`pidcfg simulate … --trend`), then correct the configuration, the plant or the expectation."),
    _unignorable_rule("PID063", "standing-expectation-failed", "A loop of a scenario does not control.", "Every run is expected to be a sound one: loops come into their modes, their outputs move their PVs, nothing stays saturated, swings or stands in alarm.", "Look at what the message names; where the scenario is meant to show it, write an entry of `allow` with its reason."),
    _unignorable_rule("PID068", "unusable-reference", "The accepted run of a scenario cannot be used.", "There is nothing to hold the run against: it is missing, or of another scenario.", "Write it with `pidcfg simulate … --accept FILE`, and review it, or correct the path."),
    _unignorable_rule("PID064", "idle-allowance", "An entry of `allow` allows nothing.", "It would hide the next failure of its kind.", "Remove the entry.", Severity.WARNING),
    _unignorable_rule("PID062", "run-error", "Something in a run has no value.", "What is calculated from there on, and what is expected of it, means nothing.", "Correct the expression or the event that the message names."),
)
# fmt: on

SCENARIO_CODES = {
    "unknown_name": "PID050",
    "expression": "PID051",
    "combination": "PID052",
    "value": "PID053",
    "too_late": "PID054",
    "missing_plant": "PID055",
    "rounded": "PID056",
    "no_steady_state": "PID057",
    "limit": "PID013",
    "set_up": "PID059",
    "wrong_action": "PID060",
    "idle_allowance": "PID064",
}
"""Codes of `pidcfg.sim.engine.expressions.Problem` by kind."""

CODES_BY_KIND = {
    "extra_forbidden": "PID020",
    "missing": "PID021",
    "not_finite": "PID023",
    "leading_zero": "PID024",
    "number_form": "PID025",
    "boolean_form": "PID026",
    "literal_error": "PID027",
    "duration_form": "PID028",
    "address_form": "PID029",
    "name_form": "PID033",
    "range_order": "PID034",
    "transfer_form": "PID035",
    "too_long": "PID036",
    "too_short": "PID036",
    "too_many_digits": "PID013",
}
WRONG_TYPE_CODE = "PID022"


# --- What a finding is known by, besides its code: the loop, the key, and the value that is written there -------------
#
# Nothing of it follows from the place of the loop in the file, or from what stands at other loops: loops and blocks
# are called by their names, items without a name are not counted, and a value is brought into one spelling. What
# stands above all loops (the list of loops, the file) has no value, since every edit would change it.

LOOPS_KEY = "loops"
MAX_VALUE_LENGTH = 80
"""Characters of a value before its hash stands for it."""
MAX_DIGITS = 400
"""Digits of a number that is written out; a longer one stays as it is written."""
HASH_DIGITS = 16
"""Hexadecimal digits of a hash."""


def loop_name(doc: Document, path: Path) -> str:
    """The name of the loop that a path is in; empty where it is in none, or the name cannot be read."""
    loops = (doc.data or {}).get(LOOPS_KEY)
    if len(path) > 1 and path[0] == LOOPS_KEY and isinstance(path[1], int) and isinstance(loops, list):
        return (_item_name(loops[path[1]]) if path[1] < len(loops) else None) or ""
    return ""


def key_of(doc: Document, path: Path) -> str:
    """The path below the loop, with names in the place of numbers: ``tuning.reset``, ``blocks[SEL].MV1``."""
    data: Any = doc.data
    text, has_name = "", False
    for depth, step in enumerate(path):
        data = _child_data(data, step)
        if isinstance(step, str):
            text += f".{step}"
            continue
        name = _item_name(data)
        if depth == 1 and path[0] == LOOPS_KEY and name:
            text, has_name = "", True
        elif name:
            text, has_name = f"{text}[{name}]", True
        else:
            text += f"[{step}]" if has_name else "[]"
    return text.removeprefix(".")


def value_of(doc: Document, path: Path) -> str | None:
    """What is written at a path, in one spelling; a hash of a mapping and of a long text; None where nothing is."""
    if not path or path == (LOOPS_KEY,):
        return None
    data = _data_at(doc, path)
    if data is None:
        return None
    plain = _normalize(data)
    text = _data_text(plain)
    return _hash_text(text) if isinstance(plain, dict) else shorten_value(text)


def _data_at(doc: Document, path: Path) -> Any:
    """What is written at a path; None where nothing is."""
    data: Any = doc.data
    for step in path:
        data = _child_data(data, step)
    return data


def shorten_value(text: str) -> str:
    """A text, or its hash where it is a long one."""
    return _hash_text(text) if len(text) > MAX_VALUE_LENGTH else text


def _hash_text(text: str) -> str:
    return f"sha256:{hashlib.sha256(text.encode('utf-8', 'backslashreplace')).hexdigest()[:HASH_DIGITS]}"


def _data_text(plain: object) -> str:
    """Plain data as text: a list of scalars as the file has it, anything else as JSON."""
    if isinstance(plain, str):
        return plain
    if isinstance(plain, list) and all(isinstance(item, str) for item in plain):
        return f"[{', '.join(plain)}]"
    return json.dumps(plain, ensure_ascii=False, sort_keys=True)


def _child_data(data: object, step: str | int) -> Any:
    """What is one step below; None where nothing is."""
    if isinstance(data, dict):
        return data.get(step)
    return data[step] if isinstance(data, list) and isinstance(step, int) and 0 <= step < len(data) else None


def _item_name(item: object) -> str | None:
    """The name of an item of a list."""
    name = item.get("name") if isinstance(item, dict) else None
    return str(name) if isinstance(name, str) else None


def _normalize(data: object) -> Any:
    """Data with every scalar in one spelling."""
    if isinstance(data, dict):
        return {str(key): _normalize(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_normalize(item) for item in data]
    return _normal_scalar(str(data))


def _normal_scalar(text: str) -> str:
    """A scalar: numbers without zeros that say nothing, runs of blanks as one."""
    words = " ".join(text.split())
    number, blank, unit = words.partition(" ")
    try:
        value = Decimal(number)
    except InvalidOperation:
        return words
    if not value.is_finite() or abs(value.adjusted()) > MAX_DIGITS or len(number) > MAX_DIGITS:
        return words
    short = f"{value:f}"
    short = short.rstrip("0").rstrip(".") if "." in short else short
    return f"{'0' if not value else short}{blank}{unit}"
