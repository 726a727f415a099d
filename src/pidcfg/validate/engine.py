"""From a document to its findings: the text's problems, then the schema's, then the rules over model and image."""

from __future__ import annotations

from dataclasses import replace
from difflib import get_close_matches
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import Diagnostic, Severity, Span, ordered
from pidcfg.frozen import frozen
from pidcfg.limits import DEFAULT, Limits
from pidcfg.odd_signs import plain
from pidcfg.validate.checklist import is_to_check, lines
from pidcfg.validate.curly import curly_quotes
from pidcfg.validate.edits import of_quotes, of_value
from pidcfg.validate.identity import key_of, loop_name, value_of
from pidcfg.validate.lookalike import of_another_vendor, vendor_meant
from pidcfg.validate.partial import readable
from pidcfg.validate.quotes import Quotes
from pidcfg.validate.schema import DID_YOU_MEAN, not_a_choice, read_model, same_word
from pidcfg.vendors import VENDORS, Vendor

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.encoders.image import Encoding
    from pidcfg.paths import Path
    from pidcfg.source import Document
    from pidcfg.validate.rule import Finding, Rule
    from pidcfg.validate.views import Context


MOST_TEXTS = 8
"""Faults of one rule at one key that a message describes before it only counts."""


@frozen
class Checked:
    """The outcome for one file: findings in order, and its vendor, model and image as far as they exist."""

    document: Document
    findings: tuple[Diagnostic, ...]
    vendor: Vendor | None = None
    config: Any = None
    encoding: Encoding | None = None
    to_check: tuple[Diagnostic, ...] = ()
    """What is right and has to be looked at on the plant: no findings, but lines of the checklist."""

    @property
    def checklist(self) -> tuple[str, ...]:
        """What no file can set or prove, where it could be read: the vendor's own lines, and those of its rules."""
        if self.vendor is None or self.config is None:
            return ()
        of_vendor: tuple[str, ...] = self.vendor.load("checklist")(self.config)
        return (*of_vendor, *lines(self.to_check))

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
    if errors:
        doc, config, errors = _in_own_units(vendor, doc, errors)
    if other := of_another_vendor(vendor, doc, errors):
        return Checked(doc, tuple(ordered([*findings, *other])), vendor)
    findings += errors
    if config is None:
        findings += _of_readable_loops(vendor, doc, errors)
        return Checked(doc, tuple(ordered(findings)), vendor)
    encoding = vendor.encoder(config)
    of_rules = _of_rules(vendor, config, encoding, doc)
    findings += (d for d in of_rules if not is_to_check(d))
    findings += curly_quotes(doc)
    to_check = tuple(ordered([d for d in of_rules if is_to_check(d)]))
    return Checked(doc, tuple(ordered(findings)), vendor, config, encoding, to_check)


def _in_own_units(vendor: Vendor, doc: Document, errors: list[Diagnostic]) -> tuple[Document, Any, list[Diagnostic]]:
    """The document read again where values carry the units of their keys."""
    from pidcfg.validate.own_units import in_key_units, without_own_units

    bare, config = without_own_units(vendor, doc, errors), None
    if bare is not doc:
        config, errors = read_model(vendor.model, bare)
    return bare, config, in_key_units(vendor, bare, errors)


def _of_rules(vendor: Vendor, config: Any, encoding: Encoding, doc: Document) -> list[Diagnostic]:
    """What the vendor's rules find."""
    context = vendor.load("context")(config, encoding)
    return list(run_rules(vendor.load("rules").values(), context, doc))


def _of_readable_loops(vendor: Vendor, doc: Document, errors: Sequence[Diagnostic]) -> list[Diagnostic]:
    """What the rules find at loops that can be read, beside some that cannot."""

    def judge(data: dict[str, Any]) -> list[Diagnostic] | None:
        config, _ = read_model(vendor.model, replace(doc, data=data))
        return None if config is None else _of_rules(vendor, config, vendor.encoder(config), doc)

    loops = readable(doc, errors)
    return [d for d in loops.findings(judge) if not is_to_check(d)] if loops else []


def vendor_of(doc: Document) -> tuple[Vendor | None, list[Diagnostic]]:
    """The vendor that a file names, or the finding that says why there is none."""
    data = doc.data or {}
    if "vendor" not in data:
        near = next((key for key in data if get_close_matches("vendor", plain(key).split(), cutoff=0.7)), None)
        span = doc.locate((near,) if near else (), key=True)
        cure = f"write 'vendor: …' for '{near}: …'" if near else f"add 'vendor: …', one of {', '.join(VENDORS)}"
        return None, [Diagnostic("PID032", Severity.ERROR, "the file names no vendor", doc.file, span, help=cure)]
    name = data["vendor"]
    vendor = VENDORS.get(name) if isinstance(name, str) else None
    if vendor is not None:
        return vendor, []
    message, suggestion = not_a_choice("vendor", name, list(VENDORS))
    meant = vendor_meant(name) if isinstance(name, str) else None
    suggestion = f"{DID_YOU_MEAN}{meant}?" if meant else "any other controller is written as generic"
    path = ("vendor",)
    same = same_word(name, VENDORS)
    edits = of_value(doc, path, same) if same else ()
    span = doc.locate(path)
    return None, [Diagnostic("PID031", Severity.ERROR, message, doc.file, span, path, help=suggestion, edits=edits)]


def run_rules(rules: Iterable[Rule], context: Context[Any, Any], doc: Document) -> Iterator[Diagnostic]:
    """The findings of rules, with positions."""
    quotes = Quotes(doc)
    for rule in rules:
        if rule.check is not None:
            places: dict[Path, list[Finding]] = {}
            for finding in rule.check(context):
                places.setdefault(finding.path, []).append(finding)
            for findings in places.values():
                yield place(rule, findings, doc, quotes)


def place(rule: Rule, findings: Sequence[Finding], doc: Document, quotes: Quotes) -> Diagnostic:
    """What a rule finds at one key, with its message and the place where it is written: one finding, the worst."""
    finding = max(findings, key=lambda one: one.severity or rule.severity)
    texts = dict.fromkeys(rule.message.format(**one.values) for one in findings[:MOST_TEXTS])
    more = f"; and {len(findings) - MOST_TEXTS} more" if len(findings) > MOST_TEXTS else ""
    return Diagnostic(
        code=rule.code,
        severity=finding.severity or rule.severity,
        message="; ".join(texts) + more,
        file=doc.file,
        span=span_in(doc, finding),
        path=finding.path,
        loop=loop_name(doc, finding.path),
        with_loops=tuple(dict.fromkeys(name for one in findings for name in one.with_loops)),
        plc_effect=finding.plc_effect,
        reference=str(finding.basis or rule.basis),
        help=finding.fix or rule.part("Fix"),
        key=key_of(doc, finding.path),
        value=value_of(doc, finding.path),
        quotes=quotes.of(rule, findings),
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


def is_configuration(doc: Document) -> bool:
    """Whether a file names the vendor that it is for."""
    return doc.data is not None and "vendor" in doc.data
