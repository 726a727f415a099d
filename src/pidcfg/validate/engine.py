"""From a document to its findings: the text's problems, then the schema's, then the rules over model and image."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import Diagnostic, Severity, Span, ordered
from pidcfg.limits import DEFAULT, Limits
from pidcfg.validate.edits import of_quotes, of_value
from pidcfg.validate.schema import loop_name, not_a_choice, read_model, same_word
from pidcfg.vendors import VENDORS, Vendor

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from pidcfg.encoders.image import Encoding
    from pidcfg.source import Document
    from pidcfg.validate.rule import Finding, Rule
    from pidcfg.validate.views import Context


@dataclass(frozen=True, slots=True)
class Checked:
    """The outcome for one file: findings in order, and its vendor, model and image as far as they exist."""

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
    findings = list(doc.problems)
    if doc.data is None:
        quoted = (replace(d, edits=of_quotes(doc, d.span)) if d.code == "PID001" else d for d in findings)
        return Checked(doc, tuple(quoted))
    vendor, problems = vendor_of(doc)
    if vendor is None:
        return Checked(doc, tuple(ordered([*findings, *problems])))
    loops = doc.data.get("loops")
    if isinstance(loops, list) and len(loops) > limits.loops:
        message = f"more than {limits.loops} loops"
        findings.append(Diagnostic("PID013", Severity.ERROR, message, doc.file, doc.locate(("loops",), key=True)))
        return Checked(doc, tuple(ordered(findings)), vendor)
    config, errors = read_model(vendor.model, doc)
    findings += errors
    if config is None:
        return Checked(doc, tuple(ordered(findings)), vendor)
    encoding = vendor.encoder(config)
    context = vendor.load("context")(config, encoding)
    findings += run_rules(vendor.load("rules").values(), context, doc)
    return Checked(doc, tuple(ordered(findings)), vendor, config, encoding)


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
    message, suggestion = not_a_choice("vendor", name, list(VENDORS))
    path = ("vendor",)
    same = same_word(name, VENDORS)
    edits = of_value(doc, path, same) if same else ()
    span = doc.locate(path)
    return None, [Diagnostic("PID031", Severity.ERROR, message, doc.file, span, path, help=suggestion, edits=edits)]


def run_rules(rules: Iterable[Rule], context: Context[Any, Any], doc: Document) -> Iterator[Diagnostic]:
    """The findings of rules, with positions."""
    for rule in rules:
        if rule.check is not None:
            for finding in rule.check(context):
                yield place(rule, finding, doc)


def place(rule: Rule, finding: Finding, doc: Document) -> Diagnostic:
    """A finding with its message and the place where it is written."""
    return Diagnostic(
        code=rule.code,
        severity=finding.severity or rule.severity,
        message=rule.message.format(**finding.values),
        file=doc.file,
        span=span_in(doc, finding),
        path=finding.path,
        loop=loop_name(doc, finding.path),
        also=finding.other_loops,
        plc_effect=finding.plc_effect,
        reference=str(finding.basis or rule.basis),
        help=finding.fix or rule.part("Fix"),
    )


def span_in(doc: Document, finding: Finding) -> Span:
    """Where a finding is written; within a value, the character that it means (runs of space count as one)."""
    span = doc.locate(finding.path, key=finding.key)
    if finding.offset is None or span.line != span.end_line:
        return span
    row = doc.lines[span.line - 1]
    at = span.column - 1 + (row[span.column - 1 : span.column] in {'"', "'"})
    while row[at : at + 1] == " ":
        at += 1
    for _ in range(finding.offset):
        at += 1
        while row[at - 1 : at + 1] == "  ":
            at += 1
    return Span(span.line, at + 1, span.line, at + 2)


def is_scenario(doc: Document) -> bool:
    """Whether a file is a scenario rather than a configuration."""
    return doc.data is not None and "scenario" in doc.data and "vendor" not in doc.data
