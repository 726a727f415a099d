"""Findings in a file: results of `pidcfg.load` and `pidcfg.check`, and the JSON of findings."""

from __future__ import annotations

import os
from copy import deepcopy
from pathlib import PurePath
from typing import TYPE_CHECKING, Literal

from pidcfg.text.diagnostics import Diagnostic, Severity, sort_findings
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DISK, Reader

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pydantic import BaseModel

    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Reader
    from pidcfg.validate.baseline import IgnoredFinding
    from pidcfg.validate.engine import Checked
    from pidcfg.validate.fixes import FixedFile

Kind = Literal["configuration", "scenario"]


def finding_data(d: Diagnostic) -> Data:
    """One finding, spelled out key by key, so that nothing leaks into the public layout."""
    from pidcfg.validate.catalog import url_of

    return {
        "code": d.code,
        "severity": d.severity.label,
        "message": d.message,
        "file": d.file,
        "line": d.span.line,
        "column": d.span.column,
        "end_line": d.span.end_line,
        "end_column": d.span.end_column,
        "path": d.where,
        "loop": d.loop,
        "with": list(d.with_loops),
        "plc_effect": d.plc_effect,
        "reference": d.reference,
        "help": d.help,
        "url": url_of(d.code),
    }


def scenarios_data(name: str, rows: Sequence[Data]) -> Data:
    """The public layout, version 1, of scenarios: the object of one alone, a list of several under ``name``."""
    if len(rows) == 1:
        return {"version": 1, **rows[0]}
    return {"version": 1, name: list(rows), "passed": all(row["passed"] for row in rows)}


def findings_data(findings: Sequence[Diagnostic], files: int = 1) -> Data:
    """Findings in so many files: the public layout, version 1."""
    totals = count_severities(findings)
    return {
        "version": 1,
        "findings": [finding_data(d) for d in findings],
        "summary": {
            "files": files,
            "errors": totals[Severity.ERROR],
            "warnings": totals[Severity.WARNING],
            "infos": totals[Severity.INFO],
        },
    }


def count_severities(findings: Sequence[Diagnostic]) -> dict[Severity, int]:
    """How many findings there are of each severity."""
    return {s: sum(d.severity is s for d in findings) for s in (Severity.ERROR, Severity.WARNING, Severity.INFO)}


def errors_in(findings: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """The findings of severity error."""
    return tuple(d for d in findings if d.severity is Severity.ERROR)


def short_repr(result: object) -> str:
    """What a notebook or a debugger shows of a result: how it went, of what, and how many findings there are."""
    parts = ["ok" if getattr(result, "ok", True) else "not ok"]
    document = getattr(result, "document", None)
    if document is not None:
        parts.append(document.file)
    if findings := getattr(result, "findings", ()):
        parts.append(f"{len(findings)} finding{'s' * (len(findings) > 1)}")
    return f"<{type(result).__name__}: {', '.join(parts)}>"


@frozen
class LoadResult:
    """A file as data: what it is, what it says, and what is wrong with its text and its keys."""

    __repr__ = short_repr

    document: Document
    """The text, the data as written (scalars are text: the field decides what one means), and where each stands."""
    findings: tuple[Diagnostic, ...]
    """Of the text and the schema; no rule has looked at it."""
    kind: Kind | None = None
    """None: the text could not be read, or says neither."""
    vendor: str | None = None
    """The key of a configuration's PLC family, such as ``click``."""
    model: BaseModel | None = None
    """The typed content (`pidcfg.schemas`); None where an error is in the way."""

    @property
    def ok(self) -> bool:
        """Whether there is no error."""
        return not errors_in(self.findings)

    def to_json(self) -> Data:
        """Kind, vendor and data of the file (every scalar as text), and its findings."""
        findings = findings_data(self.findings)["findings"]
        content = {
            "file": self.document.file,
            "kind": self.kind,
            "vendor": self.vendor,
            "data": deepcopy(self.document.data),
        }
        return {"version": 1, **content, "findings": findings}


@frozen
class CheckResult:
    """All findings of a configuration, or of a scenario."""

    __repr__ = short_repr

    document: Document
    findings: tuple[Diagnostic, ...]
    """In the order of the file, without those that comments in it ignore."""
    ignored: tuple[IgnoredFinding, ...] = ()
    """What ``# pidcfg: ignore[CODE] reason`` leaves out, each with its reason."""
    known: tuple[Diagnostic, ...] = ()
    """What the baseline knows."""

    @property
    def ok(self) -> bool:
        """Whether there is no error; warnings are allowed."""
        return not errors_in(self.findings)

    def _repr_html_(self) -> str:
        """What notebooks show."""
        from pidcfg.output.notebook import findings_html

        return findings_html(self.findings, self.document.file)

    def to_json(self) -> Data:
        """What ``pidcfg validate --format json`` prints."""
        return findings_data(self.findings)


def load_document(document: Document) -> LoadResult:
    """A document as typed content."""
    from pidcfg.validate.engine import is_scenario, vendor_of

    if document.data is None:
        return LoadResult(document, document.problems)
    if is_scenario(document):
        from pidcfg.study.scenario import read_scenario

        scenario, findings = read_scenario(document)
        return LoadResult(document, tuple(findings), "scenario", None, scenario)
    vendor, problem = vendor_of(document)
    if vendor is None:
        return LoadResult(document, tuple(sort_findings([*document.problems, *problem])))
    from pidcfg.validate.schema import read_model

    model, errors = read_model(vendor.model, document)
    findings = sort_findings([*document.problems, *errors])
    return LoadResult(document, tuple(findings), "configuration", vendor.key, model)


def check_loaded(document: Document, reader: Reader, settings: CheckSettings) -> CheckResult:
    """All findings of a document, but for those that comments in it, settings or a baseline leave out."""
    from pidcfg.validate.catalog import is_chosen

    findings = check_any(document, reader)
    ignored: list[IgnoredFinding] = []
    known_findings: list[Diagnostic] = []

    def is_wanted(d: Diagnostic) -> bool:
        return is_chosen(d, settings.select, settings.ignore)

    if settings.comments and "ignore" in document.text:
        from pidcfg.validate.baseline import suppress

        suppression = suppress(findings, document)
        findings, ignored = (
            sort_findings(suppression.findings),
            [one for one in suppression.ignored if is_wanted(one.finding)],
        )
    if settings.baseline is not None:
        from pidcfg.validate.baseline import compare, parse_baseline

        files = {settings.file_of(document.file)}
        comparison = compare(findings, is_wanted, parse_baseline(settings.baseline), files, settings.file_of)
        findings, known_findings = comparison.new, comparison.known
    return CheckResult(document, tuple(filter(is_wanted, findings)), tuple(ignored), tuple(known_findings))


@frozen
class CheckSettings:
    """What settings say of findings: whether comments count, beginnings of codes, and a baseline's text."""

    comments: bool = True
    select: Sequence[str] = ()
    ignore: Sequence[str] = ()
    baseline: str | None = None
    folder: str | None = None
    """That the names of a baseline begin at; None: they are those of the findings."""

    def file_of(self, name: str) -> str:
        """What the baseline calls a file."""
        return name if self.folder is None else PurePath(os.path.relpath(name, self.folder)).as_posix()


# --- The findings of a file, whether it is a configuration or a scenario ----------------------------------------------


def check_any(doc: Document, reader: Reader = DISK) -> list[Diagnostic]:
    """The findings of a configuration, or of a scenario and what it names."""
    return check_with_words(doc, reader)[0]


def check_with_words(doc: Document, reader: Reader = DISK) -> tuple[list[Diagnostic], Checked | None]:
    """The findings of a file, and of a configuration its model and words, as far as they exist."""
    from pidcfg.validate.engine import check_document, is_scenario

    if is_scenario(doc):
        from pidcfg.study.scenario import check_scenario
        from pidcfg.validate.engine import find_misread_texts

        return [*check_scenario(doc, reader), *find_misread_texts(doc)], None
    checked = check_document(doc)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.is_complete or not has_map(doc):
        return list(checked.findings), checked
    from pidcfg.validate.map_files import check_map

    map_findings = check_map(doc, checked.vendor, checked.encoding.image, reader)
    return sort_findings([*checked.findings, *map_findings]), checked


def has_map(doc: Document) -> bool:
    """Whether a configuration names a Modbus map."""
    plc = (doc.data or {}).get("plc")
    return isinstance(plc, dict) and "map" in plc


# --- What can be read in one way only, put right ----------------------------------------------------------------------


@frozen
class FixResult:
    """A file with its corrections, each of them proven: the new text says the same, and what was wrong has gone."""

    __repr__ = short_repr

    document: Document
    """As it was."""
    data: bytes
    """The file as it is now."""
    fixed: tuple[Diagnostic, ...]
    """What was corrected, in rounds."""
    findings: tuple[Diagnostic, ...]
    """What is left."""

    @property
    def text(self) -> str:
        """The file as it is now, without a byte order mark."""
        return self.data.decode("utf-8-sig", "replace")

    @property
    def ok(self) -> bool:
        """Whether no error is left."""
        return not errors_in(self.findings)

    def to_json(self) -> Data:
        """The text, what was corrected, and what is left."""
        remaining = findings_data(self.findings)["findings"]
        return {"version": 1, "text": self.text, "fixed": [finding_data(d) for d in self.fixed], "findings": remaining}


def correct_file(
    data: bytes, doc: Document, reader: Reader, is_wanted: Callable[[Diagnostic], bool] = lambda _: True
) -> FixedFile:
    """The bytes of a file with the corrections of wanted findings; ``doc``: the file as it is read, for its name."""
    from pidcfg.text.source import read_document
    from pidcfg.validate.baseline import suppress
    from pidcfg.validate.fixes import Fixer

    def check(doc: Document) -> list[Diagnostic]:
        return sort_findings(suppress(check_any(doc, reader), doc).findings)

    return Fixer(lambda text: read_document(text, doc.file, doc.limits), check, is_wanted).fix(data)
