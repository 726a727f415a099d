"""What a rule is: a label, a documented function, and the findings it yields.

The docstring has fixed parts: a first line that says what is wrong, ``Why:`` and ``Fix:``. `pidcfg rule` prints it and
docs/rules.md is made of it. A label builds a `Rule` and registers nothing; the list of rules is in `rules`.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import Severity
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from pidcfg.paths import Path
    from pidcfg.refs import Basis

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

    def quoting(self, **values: object) -> Finding:
        """The same, with these values of the message as well."""
        return replace(self, values={**self.values, **values})

    def shared_with(self, *loops: str) -> Finding:
        """The same, of a fault that concerns these loops as well."""
        return replace(self, with_loops=loops)


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
    ignorable: bool = True
    """Whether a comment, a baseline or an option may take away what it finds."""
    unusable: bool = False
    """Whether a file that has the fault cannot be read at all."""
    checklist: bool = False
    """Whether it is nothing that a file could say better, but something to look at: a line of the checklist."""

    @property
    def kind(self) -> str:
        """What it yields, in a word: ``error``, ``warning``, ``info`` or ``checklist``."""
        return "checklist" if self.checklist else self.severity.label

    @property
    def title(self) -> str:
        """The first line of the documentation: what is wrong."""
        return self.doc.partition("\n")[0]

    def part(self, heading: str) -> str:
        """One part of the documentation (``Why`` or ``Fix``) as a single paragraph; empty when there is none."""
        match = re.search(rf"^{heading}:\s*(.*?)(?=^\w+:|\Z)", self.doc, re.DOTALL | re.MULTILINE)
        return " ".join(match.group(1).split()) if match else ""

    @property
    def fields(self) -> set[str]:
        """The names that the message needs."""
        return set(PLACEHOLDER.findall(self.message))


Label = Callable[[Check], Rule]


def _label(severity: Severity, code: str, basis: Basis, message: str) -> Label:
    """What stands above a check; the rule's name is that of the function."""

    def label(check: Check) -> Rule:
        name = check.__name__.replace("_", "-")
        return Rule(code, name, severity, message, basis, FIRST_VERSION, inspect.getdoc(check) or "", check)

    return label


def error(code: str, basis: Basis, message: str) -> Label:
    """A rule about what the PLC refuses, or what makes a loop run away or stand still."""
    return _label(Severity.ERROR, code, basis, message)


def warning(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is seldom intended."""
    return _label(Severity.WARNING, code, basis, message)


def info(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is worth knowing."""
    return _label(Severity.INFO, code, basis, message)


def checklist(code: str, basis: Basis, message: str) -> Label:
    """A rule about what is right as it stands and has to be looked at on the plant: a line of the checklist."""
    label = _label(Severity.INFO, code, basis, message)
    return lambda check: replace(label(check), checklist=True)


def _each(attribute: str) -> Callable[[Rule], Rule]:
    """A rule whose check looks at one item of its context, such as a loop, turned into one that looks at them all."""

    def of_all(rule: Rule) -> Rule:
        check = rule.check
        if check is None:
            raise TypeError(f"{rule.code} has no check")

        def every(context: Any) -> Findings:
            for view in getattr(context, attribute):
                yield from check(view)

        return replace(rule, check=every)

    return of_all


def always(rule: Rule) -> Rule:
    """Above the label of a rule that no comment, setting or baseline covers."""
    return replace(rule, ignorable=False)


per_loop = _each("loops")
"""Above the label of a check that takes a loop's view: the rule looks at every loop."""
per_pid = _each("pids")
"""As `per_loop`, for checks of a PID block."""


def finding(*path: str | int, plc_effect: str | None = None, key: bool = False, **values: object) -> Finding:
    """A finding at a path, with the values of the message; ``key``: it points at the key rather than at the value."""
    return Finding(path, values, key=key, plc_effect=plc_effect)
