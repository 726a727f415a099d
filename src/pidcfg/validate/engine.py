"""From a document to its findings: the text's problems, then the schema's, then the rules over model and image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Protocol

from pidcfg.diagnostics import Diagnostic, Path, Severity, Span, ordered
from pidcfg.limits import DEFAULT, Limits
from pidcfg.validate.edits import of_quotes, of_value
from pidcfg.validate.schema import loop_name, not_a_choice, read_model, same_word
from pidcfg.vendors import VENDORS, Vendor

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from pidcfg.encoders.image import Encoding
    from pidcfg.source import Document
    from pidcfg.validate.rule import Finding, Rule


class Context(Protocol):
    """What every vendor's rules are given at least."""

    config: Any
    encoding: Encoding

    @property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of the vendor's own explains better than the rules for every vendor."""


@dataclass(frozen=True, slots=True)
class Checked:
    """The outcome for one file: findings in order, and as far as they could be made, its vendor, model and image."""

    document: Document
    findings: tuple[Diagnostic, ...]
    vendor: Vendor | None = None
    config: Any = None
    encoding: Encoding | None = None

    @property
    def failed(self) -> bool:
        """Whether there is a finding of severity error."""
        return any(d.severity is Severity.ERROR for d in self.findings)


def check_document(doc: Document, limits: Limits = DEFAULT) -> Checked:
    """All findings of one configuration (a scenario is checked by the simulator)."""
    found = list(doc.problems)
    if doc.data is None:
        return Checked(doc, tuple(replace(d, edits=of_quotes(doc, d.span)) if d.code == "PID001" else d for d in found))
    vendor, problem = vendor_of(doc)
    if vendor is None:
        return Checked(doc, tuple(ordered([*found, *problem])))
    loops = doc.data.get("loops")
    if isinstance(loops, list) and len(loops) > limits.loops:
        message = f"more than {limits.loops} loops"
        found.append(Diagnostic("PID013", Severity.ERROR, message, doc.file, doc.locate(("loops",), key=True)))
        return Checked(doc, tuple(ordered(found)), vendor)
    config, errors = read_model(vendor.model, doc)
    found += errors
    if config is None:
        return Checked(doc, tuple(ordered(found)), vendor)
    encoding = vendor.encoder(config)
    context = vendor.load("context")(config, encoding)
    found += run_rules(vendor.load("rules").values(), context, doc)
    return Checked(doc, tuple(ordered(found)), vendor, config, encoding)


def vendor_of(doc: Document) -> tuple[Vendor | None, list[Diagnostic]]:
    """The vendor that a file names, or the finding that says why there is none."""
    data = doc.data or {}
    if "vendor" not in data:
        span = doc.locate(())
        cure = f"add 'vendor: …', one of {', '.join(VENDORS)}"
        return None, [Diagnostic("PID032", Severity.ERROR, "the file names no vendor", doc.file, span, help=cure)]
    name = data["vendor"]
    vendor = VENDORS.get(name) if isinstance(name, str) else None
    if vendor is not None:
        return vendor, []
    message, cure_or_none = not_a_choice("vendor", name, list(VENDORS))
    path = ("vendor",)
    same = same_word(name, VENDORS)
    edits = of_value(doc, path, same) if same else ()
    found = Diagnostic("PID031", Severity.ERROR, message, doc.file, doc.locate(path), path, help=cure_or_none)
    return None, [replace(found, edits=edits)]


def run_rules(rules: Iterable[Rule], context: Context, doc: Document) -> Iterator[Diagnostic]:
    """The findings of rules, with positions."""
    for rule in rules:
        if rule.check is not None:
            for found in rule.check(context):
                yield place(rule, found, doc)


def place(rule: Rule, found: Finding, doc: Document) -> Diagnostic:
    """A finding with its message and the place where it is written."""
    return Diagnostic(
        code=rule.code,
        severity=found.severity or rule.severity,
        message=rule.message.format(**found.values),
        file=doc.file,
        span=span_in(doc, found),
        path=found.path,
        loop=loop_name(doc, found.path),
        also=found.also,
        plc_effect=found.plc_effect,
        reference=str(found.basis or rule.basis),
        help=found.fix or rule.part("Fix"),
    )


def span_in(doc: Document, found: Finding) -> Span:
    """Where a finding is written; within a value, the character that it means (runs of space count as one)."""
    span = doc.locate(found.path, key=found.key)
    if found.offset is None or span.line != span.end_line:
        return span
    row = doc.lines[span.line - 1]
    at = span.column - 1 + (row[span.column - 1 : span.column] in {'"', "'"})
    while row[at : at + 1] == " ":
        at += 1
    for _ in range(found.offset):
        at += 1
        while row[at - 1 : at + 1] == "  ":
            at += 1
    return Span(span.line, at + 1, span.line, at + 2)


def is_scenario(doc: Document) -> bool:
    """Whether a file is a scenario rather than a configuration."""
    return doc.data is not None and "scenario" in doc.data and "vendor" not in doc.data
