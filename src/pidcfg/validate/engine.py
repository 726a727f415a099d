"""From a document to its findings: those of the text, of the schema and of the rules; also of half a file."""

from __future__ import annotations

import re
from dataclasses import replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path as FilePath
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from pidcfg.encoders.contract import encoder_of, formats_of
from pidcfg.text.diagnostics import Diagnostic, Severity, Span, sort_findings
from pidcfg.text.document import Document, Plain
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import Files, Limits, source_data
from pidcfg.text.signs import QUOTES, code_point, is_curly_quoted, match_ignoring_case, to_ascii
from pidcfg.text.source import read_document
from pidcfg.text.writer import json_line
from pidcfg.validate.catalog import checklist_lines, is_to_check
from pidcfg.validate.rule import D720, D931, LOOPS_KEY, PLACEHOLDER, key_of, loop_name, shorten_value, value_of
from pidcfg.validate.schema import DID_YOU_MEAN, describe_wrong_choice, quote_edit, read_model, value_edit
from pidcfg.vendors import VENDORS, Vendor

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.text.paths import Path
    from pidcfg.text.references import Decision
    from pidcfg.validate.rule import Finding, Rule
    from pidcfg.validate.shared_checks import Context

    Judge = Callable[[dict[str, Any]], Iterable[Diagnostic] | None]
    """The findings of the rules over data; None where they cannot be read."""

# --- A file whose keys are those of another vendor than the one that it names -----------------------------------------

KEY_CODES = frozenset(("PID020", "PID021"))
"""Findings of keys that are unknown or missing."""
MIN_KEY_ERRORS = 3
"""So many of them before the vendor itself is doubted."""


NAME_BEGINNINGS = (
    ("directlogic", "dl06"),
    ("koyo", "dl06"),
    ("d0-06", "dl06"),
    ("dl0", "dl06"),
    ("click", "click"),
    ("c0-", "click"),
    ("c2-", "click"),
    ("ez", "ezlogix"),
    ("altus", "nextopid"),
    ("nexto", "nextopid"),
    ("codesys", "nextopid"),
    ("delta", "dpide"),
    ("isp", "dpide"),
    ("as2", "dpide"),
    ("as3", "dpide"),
    ("neutral", "generic"),
)
"""How names begin that people give to a family: its maker, its program, its parts."""


def guess_vendor(name: str) -> str | None:
    """The family that a name seems to mean; None where nothing tells."""
    word = to_ascii(name).casefold().replace(" ", "").replace("_", "-")
    near = next(iter(get_close_matches(word.replace("-", ""), VENDORS, 1, 0.7)), None)
    return near or next((vendor for begins, vendor in NAME_BEGINNINGS if word.startswith(begins)), None)


def find_other_vendor(vendor: Vendor, doc: Document, errors: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The finding that names the vendor whose keys these are; none where the keys fit no other one better."""
    if sum(d.code in KEY_CODES for d in errors) < MIN_KEY_ERRORS:
        return []
    others = [other.key for other in VENDORS.values() if other.key != vendor.key and _has_keys_of(other, doc)]
    if len(others) != 1:
        return []
    message = f"this looks like {others[0]}: its keys are those of the file, and those of {vendor.key} are not"
    cure = f"write vendor: {others[0]}, or convert the file with 'pidcfg convert'"
    path = ("vendor",)
    return [Diagnostic("PID031", Severity.ERROR, message, doc.file, doc.locate(path), path, help=cure)]


def _has_keys_of(vendor: Vendor, doc: Document) -> bool:
    """Whether a vendor knows every key of a file, and misses none."""
    try:
        vendor.model.model_validate({**(doc.data or {}), "vendor": vendor.key})
    except ValidationError as error:
        return not {e["type"] for e in error.errors(include_url=False)} & {"extra_forbidden", "missing"}
    return True


# --- Texts that are stored otherwise than they look: in the quotes of a word processor, or cut off by a comment -------

FREE_TEXTS = frozenset(("name", "description", "unit", "scenario"))
"""Keys whose values are texts for people, in which a # may stand."""
TRAILING_COMMENT = re.compile(r" #(?! *pidcfg:).*")
"""What follows a text that is cut off: two blanks and more are those of a comment (D931)."""
TRUNCATED_TEXT = re.compile(rf"[^ ]{TRAILING_COMMENT.pattern}")
"""The same in any line."""


def find_misread_texts(doc: Document) -> list[Diagnostic]:
    """A warning for each plain text of a file that is not what it looks like."""
    if not (TRUNCATED_TEXT.search(doc.text) or any(sign in doc.text for sign in QUOTES)):
        return []
    texts = [*_plain_texts(doc.data, ())]
    quote_warnings = [_quotes_warning(doc, path, text) for path, text in texts if is_curly_quoted(text)]
    cut_warnings = [_cut_warning(doc, path, text, rest) for path, text in texts if (rest := _text_comment(doc, path))]
    return quote_warnings + cut_warnings


def _plain_texts(data: object, path: Path) -> Iterator[tuple[Path, str]]:
    """Every text that stands without quotes of YAML, and its place."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, Plain):
            yield (*path, step), value
        else:
            yield from _plain_texts(value, (*path, step))


def _quotes_warning(doc: Document, path: Path, text: str) -> Diagnostic:
    message = f"{path[-1]}: the quotes of {text[:60]} are a part of the text: {code_point(text[0])} is a letter to YAML"
    cure = f'write "{text[1:-1]}" with straight quotes'
    return _text_warning(doc, "PID018", D720, path, message, cure)


def _text_comment(doc: Document, path: Path) -> str:
    """What stands behind a text for people as a comment, and seems to belong to it."""
    if path[-1] not in FREE_TEXTS:
        return ""
    span = doc.locate(path)
    match = TRAILING_COMMENT.fullmatch(doc.lines[span.end_line - 1], span.end_column - 1)
    return match.group().rstrip() if match else ""


def _cut_warning(doc: Document, path: Path, text: str, comment: str) -> Diagnostic:
    shown = comment[1:60]
    message = f"{path[-1]} is {text[:60]!r} alone: what follows, {shown!r}, is a comment to YAML"
    cure = f"write {path[-1]}: {json_line(text[:60] + ' ' + shown)}, or two blanks before the # of a comment"
    return _text_warning(doc, "PID019", D931, path, message, cure)


def _text_warning(doc: Document, code: str, basis: Decision, path: Path, message: str, cure: str) -> Diagnostic:
    return Diagnostic(
        code=code,
        severity=Severity.WARNING,
        message=message,
        file=doc.file,
        span=doc.locate(path),
        path=path,
        loop=loop_name(doc, path),
        help=cure,
        reference=str(basis),
    )


# --- The numbers that the message of a finding quotes of its own loop: they make it this fault and no other one -------
#
# A fault may lie between two keys of a loop, of which only one is the key of the finding: ``low`` is not above
# ``low_low``. So the numbers of a message are a part of what a finding is known by, whatever key they come from and
# however they were worked out. What follows from other loops or from the place in the file is left out: names,
# addresses, and every number of a fault that several loops share. Words are no part of it, so that a better wording
# makes no new finding.

QUOTED_NUMBER = re.compile(r"(?<![\w.\-/#])-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?(?![\w\-/#]|\.\d)")
"""A number that stands for itself: no part of a name (``TIC-101``), an address (``V2005.3``) or a version."""


class QuotedNumbers:
    """What the findings of one file quote."""

    def __init__(self, doc: Document) -> None:
        self._doc = doc

    def numbers_of(self, rule: Rule, findings: Sequence[Finding]) -> str | None:
        """The numbers of a rule's findings at one key; None where there are none, or no loop that they are of."""
        path = findings[0].path
        if not loop_name(self._doc, path):
            return None
        fields = PLACEHOLDER.findall(rule.message)
        own = (" | ".join(str(one.values[name]) for name in fields) for one in findings if not one.with_loops)
        texts = dict.fromkeys(" ".join(self._find_numbers(text)) for text in own)
        return shorten_value("; ".join(filter(None, texts))) or None

    def _find_numbers(self, text: str) -> list[str]:
        return QUOTED_NUMBER.findall(self._names_with_numbers.sub("", text) if self._names_with_numbers else text)

    @cached_property
    def _names_with_numbers(self) -> re.Pattern[str] | None:
        """The names of loops, blocks and signals that hold a number of their own, ``Oven 2``; 2.5 holds no name."""
        lists = [items for items in (self._doc.data or {}).values() if isinstance(items, list)]
        names = {str(item["name"]) for items in lists for item in items if _is_named(item)}
        several = sorted(filter(QUOTED_NUMBER.search, names), key=len, reverse=True)
        return re.compile(rf"(?<![\w.\-])(?:{'|'.join(map(re.escape, several))})(?!\w|\.\d)") if several else None


def _is_named(item: object) -> bool:
    return isinstance(item, dict) and isinstance(item.get("name"), str)


# --- The rules over a file of which some loops cannot be read: each of the others is judged by itself -----------------
#
# Design. The file is read twice more: with a copy of a readable loop in the place of each that cannot be read, which
# keeps positions and addresses, and without these loops. What both readings find at a loop does not come from the
# loops that are missing, and is told; what follows from several loops may do so, and waits until all can be read.

MAX_LOOPS_NAMED = 3
"""Loops that the remark names."""


@frozen
class ReadableLoops:
    """The loops of a file that can be read, by their places, and those that cannot."""

    doc: Document
    readable: Sequence[int]
    unreadable: Sequence[int]

    def find(self, find_faults: Judge) -> list[Diagnostic]:
        """What both readings find at the sound loops, and the remark that something waits."""
        filled_faults, reduced_faults = find_faults(self._fill_with_copies()), find_faults(self._drop_unreadable())
        if filled_faults is None or reduced_faults is None:
            return []
        fault_keys = {
            (d.code, self.readable[i], d.path[2:]) for d in reduced_faults if (i := loop_index(d.path)) is not None
        }
        confirmed = [d for d in filled_faults if (d.code, loop_index(d.path), d.path[2:]) in fault_keys]
        return [*(d for d in confirmed if not self._unreadable_names.intersection(d.with_loops)), self._make_remark()]

    @property
    def _unreadable_names(self) -> set[str]:
        """The names of the loops that cannot be read, as far as they can."""
        return {loop_name(self.doc, (LOOPS_KEY, i)) for i in self.unreadable}

    def _fill_with_copies(self) -> dict[str, Any]:
        loops = list(self._all_loops)
        for i in self.unreadable:
            name = loop_name(self.doc, (LOOPS_KEY, i))
            loops[i] = {**loops[self.readable[0]], **({"name": name} if name else {})}
        return {**(self.doc.data or {}), LOOPS_KEY: loops}

    def _drop_unreadable(self) -> dict[str, object]:
        return {**(self.doc.data or {}), LOOPS_KEY: [self._all_loops[i] for i in self.readable]}

    @property
    def _all_loops(self) -> list[Any]:
        loops: list[Any] = (self.doc.data or {})[LOOPS_KEY]
        return loops

    def _make_remark(self) -> Diagnostic:
        names = [loop_name(self.doc, (LOOPS_KEY, i)) or f"loop {i + 1}" for i in self.unreadable]
        more = f" and {len(names) - MAX_LOOPS_NAMED} more" if len(names) > MAX_LOOPS_NAMED else ""
        message = (
            f"{', '.join(names[:MAX_LOOPS_NAMED])}{more} cannot be read: each other loop was checked by itself, "
            "what concerns several loops was not"
        )
        cure = "correct the errors, and check again"
        place = self.doc.locate((LOOPS_KEY,), key=True)
        return Diagnostic("PID038", Severity.INFO, message, self.doc.file, place, (LOOPS_KEY,), help=cure)


def readable_loops(doc: Document, errors: Iterable[Diagnostic]) -> ReadableLoops | None:
    """The loops without errors, where every error is in a loop, and some loop has none."""
    loops = (doc.data or {}).get(LOOPS_KEY)
    unreadable = {loop_index(d.path) for d in errors if d.severity is Severity.ERROR}
    if not isinstance(loops, list) or None in unreadable:
        return None
    readable = [i for i in range(len(loops)) if i not in unreadable]
    return (
        ReadableLoops(doc, readable, [i for i in range(len(loops)) if i in unreadable])
        if readable and unreadable
        else None
    )


def loop_index(path: Path) -> int | None:
    """The number of the loop that a path is in; None: it is in none."""
    return path[1] if len(path) > 1 and path[0] == LOOPS_KEY and isinstance(path[1], int) else None


# --- From a document to its findings: the text's problems, then the schema's, then the rules over model and image -----

MAX_TEXTS = 8
"""Faults of one rule at one key that a message describes before it only counts."""


@frozen
class Checked:
    """The outcome for one file: findings in order, and its vendor, model and image as far as they exist."""

    document: Document
    findings: tuple[Diagnostic, ...]
    vendor: Vendor | None = None
    config: Any = None
    encoding: AnyEncoding | None = None
    to_check: tuple[Diagnostic, ...] = ()
    """What is right and has to be looked at on the plant: no findings, but lines of the checklist."""

    @property
    def checklist(self) -> tuple[str, ...]:
        """What no file can set or prove, where it could be read: the vendor's own lines, and those of its rules."""
        if self.vendor is None or self.config is None:
            return ()
        vendor_lines: tuple[str, ...] = formats_of(self.vendor).checklist(self.config)
        return (*vendor_lines, *checklist_lines(self.to_check))

    @property
    def failed(self) -> bool:
        """Whether there is a finding of severity error."""
        return any(d.severity is Severity.ERROR for d in self.findings)


def check_document(doc: Document) -> Checked:
    """All findings of one configuration (a scenario is checked by the simulator)."""
    findings = list(doc.problems)
    if doc.data is None:
        quoted = (replace(d, edits=quote_edit(doc, d.span)) if d.code == "PID001" else d for d in findings)
        return Checked(doc, tuple(quoted))
    vendor, problems = vendor_of(doc)
    if vendor is None:
        return Checked(doc, tuple(sort_findings([*findings, *problems])))
    loops = doc.data.get("loops")
    if isinstance(loops, list) and len(loops) > doc.limits.loops:
        message = f"more than {doc.limits.loops} loops"
        findings.append(Diagnostic("PID013", Severity.ERROR, message, doc.file, doc.locate(("loops",), key=True)))
        return Checked(doc, tuple(sort_findings(findings)), vendor)
    config, errors = read_model(vendor.model, doc)
    if errors:
        doc, config, errors = _read_without_units(vendor, doc, errors)
    if other := find_other_vendor(vendor, doc, errors):
        return Checked(doc, tuple(sort_findings([*findings, *other])), vendor)
    findings += errors
    if config is None:
        findings += _findings_of_readable_loops(vendor, doc, errors)
        return Checked(doc, tuple(sort_findings(findings)), vendor)
    encoding = encoder_of(vendor).encode(config)
    rule_findings = _findings_of_rules(vendor, config, encoding, doc)
    findings += (d for d in rule_findings if not is_to_check(d))
    findings += find_misread_texts(doc)
    to_check = tuple(sort_findings([d for d in rule_findings if is_to_check(d)]))
    return Checked(doc, tuple(sort_findings(findings)), vendor, config, encoding, to_check)


Source = FilePath | str | bytes | Document
"""A file by its path, a text, or the ``document`` of another result, which is not read again."""


def document_of(source: Source, name: str | None, files: Files, limits: Limits) -> Document:
    """A source as a document; raises `OSError` for a file that is not there."""
    if isinstance(source, Document):
        return source if source.limits == limits else replace(source, limits=limits)
    return read_document(*source_data(source, name, files, limits.listing_bytes + 1), limits)


def check_source(source: Source, name: str | None, files: Files, limits: Limits) -> Checked:
    """A source as a checked configuration."""
    return check_document(document_of(source, name, files, limits))


def _read_without_units(
    vendor: Vendor, doc: Document, errors: list[Diagnostic]
) -> tuple[Document, Any, list[Diagnostic]]:
    """The document read again where values carry the units of their keys."""
    from pidcfg.validate.terms import explain_units, strip_key_units

    doc_without_units, config = strip_key_units(vendor, doc, errors), None
    if doc_without_units is not doc:
        config, errors = read_model(vendor.model, doc_without_units)
    return doc_without_units, config, explain_units(vendor, doc_without_units, errors)


def _findings_of_rules(vendor: Vendor, config: BaseModel, encoding: AnyEncoding, doc: Document) -> list[Diagnostic]:
    """What the vendor's rules find."""
    context = vendor.load("context")(config, encoding)
    return list(run_rules(vendor.load("rules").values(), context, doc))


def _findings_of_readable_loops(vendor: Vendor, doc: Document, errors: Sequence[Diagnostic]) -> list[Diagnostic]:
    """What the rules find at loops that can be read, beside some that cannot."""

    def find_faults(data: dict[str, object]) -> list[Diagnostic] | None:
        config, _ = read_model(vendor.model, replace(doc, data=data))
        return None if config is None else _findings_of_rules(vendor, config, encoder_of(vendor).encode(config), doc)

    loops = readable_loops(doc, errors)
    return [d for d in loops.find(find_faults) if not is_to_check(d)] if loops else []


def vendor_of(doc: Document) -> tuple[Vendor | None, list[Diagnostic]]:
    """The vendor that a file names, or the finding that says why there is none."""
    data = doc.data or {}
    if "vendor" not in data:
        near = next((key for key in data if get_close_matches("vendor", to_ascii(key).split(), cutoff=0.7)), None)
        span = doc.locate((near,) if near else (), key=True)
        cure = f"write 'vendor: …' for '{near}: …'" if near else f"add 'vendor: …', one of {', '.join(VENDORS)}"
        return None, [Diagnostic("PID032", Severity.ERROR, "the file names no vendor", doc.file, span, help=cure)]
    name = data["vendor"]
    vendor = VENDORS.get(name) if isinstance(name, str) else None
    if vendor is not None:
        return vendor, []
    message, _ = describe_wrong_choice("vendor", name, list(VENDORS))
    meant = guess_vendor(name) if isinstance(name, str) else None
    suggestion = f"{DID_YOU_MEAN}{meant}?" if meant else "any other controller is written as generic"
    path = ("vendor",)
    same = match_ignoring_case(name, VENDORS)
    edits = value_edit(doc, path, same) if same else ()
    span = doc.locate(path)
    return None, [Diagnostic("PID031", Severity.ERROR, message, doc.file, span, path, help=suggestion, edits=edits)]


def run_rules(rules: Iterable[Rule], context: Context[object, object], doc: Document) -> Iterator[Diagnostic]:
    """The findings of rules, with positions."""
    numbers = QuotedNumbers(doc)
    for rule in rules:
        if rule.check is not None:
            findings_by_path: dict[Path, list[Finding]] = {}
            for finding in rule.check(context):
                findings_by_path.setdefault(finding.path, []).append(finding)
            for findings in findings_by_path.values():
                yield make_diagnostic(rule, findings, doc, numbers)


PLAIN_TEXT = re.compile(r"\w(?:[\w./%°²³+-]|(?<! )#| (?! *(?:#|$)))*")
"""A text that YAML reads as it stands wherever a value may stand."""


def scalar_text(text: str) -> str:
    """A text as a value is written: in quotes where YAML would read something else."""
    return text if PLAIN_TEXT.fullmatch(text) else json_line(text)


def make_diagnostic(rule: Rule, findings: Sequence[Finding], doc: Document, numbers: QuotedNumbers) -> Diagnostic:
    """What a rule finds at one key, with its message and the place where it is written: one finding, the worst."""
    finding = max(findings, key=lambda one: one.severity or rule.severity)
    severity = finding.severity or rule.severity
    is_certain = len(findings) == 1 and severity is Severity.ERROR and finding.correction is not None
    texts = dict.fromkeys(rule.message.format(**one.values) for one in findings[:MAX_TEXTS])
    more = f"; and {len(findings) - MAX_TEXTS} more" if len(findings) > MAX_TEXTS else ""
    return Diagnostic(
        code=rule.code,
        severity=severity,
        message="; ".join(texts) + more,
        file=doc.file,
        span=finding_span(doc, finding),
        path=finding.path,
        loop=loop_name(doc, finding.path),
        with_loops=tuple(dict.fromkeys(name for one in findings for name in one.with_loops)),
        plc_effect=finding.plc_effect,
        reference=str(finding.basis or rule.basis),
        help=finding.fix or rule.doc_part("Fix"),
        edits=value_edit(doc, finding.path, scalar_text(finding.correction or "")) if is_certain else (),
        key=key_of(doc, finding.path),
        value=value_of(doc, finding.path),
        quotes=numbers.numbers_of(rule, findings),
    )


def finding_span(doc: Document, finding: Finding) -> Span:
    """Where a finding is written; within a value, the character that it means (runs of space count as one)."""
    span = doc.locate(finding.path, key=finding.key)
    if finding.offset is None or span.line != span.end_line:
        return span
    row = doc.lines[span.line - 1]
    index = span.column - 1 + (row[span.column - 1 : span.column] in {'"', "'"})
    while row[index : index + 1] == " ":
        index += 1
    for _ in range(finding.offset):
        index += 1
        while row[index - 1 : index + 1] == "  ":
            index += 1
    return Span(span.line, index + 1, span.line, index + 2)


def is_scenario(doc: Document) -> bool:
    """Whether a file is a scenario rather than a configuration."""
    return doc.data is not None and "scenario" in doc.data and "vendor" not in doc.data


def is_configuration(doc: Document) -> bool:
    """Whether a file names the vendor that it is for."""
    return doc.data is not None and "vendor" in doc.data
