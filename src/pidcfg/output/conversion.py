"""A configuration of another vendor, and the verdicts of the battery as plain data."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from importlib.resources import files
from pathlib import PurePath
from typing import TYPE_CHECKING

from pidcfg.conversion import DEFAULT_MAX_LOSS, ConvertError, MaxLossError, json_value, parse_max_loss
from pidcfg.conversion.pipeline import convert
from pidcfg.output.arguments import ArgumentError, vendor_options
from pidcfg.output.findings import errors_in, finding_data, findings_data, short_repr
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import Checked, check_document
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from pidcfg.conversion import Change, MaxLoss, MissingField, Terms
    from pidcfg.conversion.pipeline import ConvertedFile, LoopReport
    from pidcfg.study.verification.comparison import SignalDifference
    from pidcfg.study.verification.verify import VerifiedLoop
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data
    from pidcfg.vendors import Vendor

# --- The verdicts of the battery as plain data: for `convert --verify` and `diff --verify` ----------------------------

SignalState = float | str | bool
"""What a signal shows."""
SEVERAL_LINES_NOTE = "of the values that the report says were written"
"""Why two sides differ where no line alone does it."""


def verified_data(loop: VerifiedLoop) -> Data:
    """One loop's verdict."""
    return {
        "loop": loop.loop,
        "passed": loop.passed,
        "pv_percent": round(loop.pv_percent, 6),
        "output_percent": round(loop.output_percent, 6),
        "iae_ratio": None if loop.iae_ratio is None else round(loop.iae_ratio, 6),
        "stages": list(loop.stages),
        "not_tried": [{"stage": entry.stage, "mode": entry.mode} for entry in loop.untried],
        "differences": [{**_difference_data(entry.difference), "key": entry.key or None} for entry in loop.failures],
        "named": [{**_difference_data(entry.difference), **_line_data(entry.line)} for entry in loop.named],
        "run_with": [{"line": row.field, "to": json_value(row.target)} for row in loop.switched],
        "not_shown": list(loop.hidden),
    }


def _line_data(line: Change | None) -> Data:
    return {"line": None, "note": SEVERAL_LINES_NOTE} if line is None else {"line": line.field, "note": line.note}


def _difference_data(difference: SignalDifference) -> Data:
    percent = None if difference.worst is None else round(100 * difference.worst, 6)
    return {
        "stage": difference.stage,
        "signal": difference.signal,
        "at": round(difference.at, 6),
        "from": _round_value(difference.before),
        "to": _round_value(difference.after),
        "percent": percent,
    }


def _round_value(value: SignalState) -> SignalState:
    return value if isinstance(value, bool | str) else float(f"{value:.10g}")


# --- Comments of a configuration that survive its conversion: those at its head, and those of each loop ---------------

QUOTED_TEXT = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^']|'')*'")
LOOP_ITEM = "  - "
"""How a loop begins in a file that pidcfg writes."""


def comment_of(line: str, ignored: Collection[str] = ()) -> str | None:
    """The comment of a line; None: there is none, or it is a known one.

    One behind a value speaks of that key and value, which another vendor writes otherwise: they come along.
    """
    unquoted = QUOTED_TEXT.sub(lambda text: "x" * len(text.group()), line)
    start = next((i for i, c in enumerate(unquoted) if c == "#" and (i == 0 or unquoted[i - 1].isspace())), None)
    if start is None:
        return None
    text, value = line[start + 1 :].strip(), " ".join(line[:start].split()).removeprefix("- ")
    if text in ignored:
        return None
    return f"{value}  # {text}" if value and text else text


def split_comments(doc: Document, loops: int, ignored: Collection[str] = ()) -> tuple[list[str], list[list[str]]]:
    """The comments above the loops, and those of each loop: before it, and behind its values; not the ``ignored``."""
    lines = doc.lines
    starts = [_first_line(doc, lines, i) for i in range(loops)]
    texts: list[list[str]] = []
    for i, start in enumerate(starts):
        end = starts[i + 1] if i + 1 < loops else len(lines)
        texts.append(_comments_of(lines[start:end], ignored))
    return _comments_of(lines[: starts[0]] if starts else lines, ignored), texts


def _first_line(doc: Document, lines: list[str], loop: int) -> int:
    """Where a loop begins, with the comment lines directly above it."""
    line = doc.locate(("loops", loop)).line - 1
    while line > 0 and lines[line - 1].lstrip().startswith("#") and lines[line - 1][:1].isspace():
        line -= 1
    return line


def _comments_of(lines: list[str], ignored: Collection[str]) -> list[str]:
    return [text for line in lines if (text := comment_of(line, ignored))]


def insert_comments(text: str, head: list[str], loops: list[list[str]]) -> str:
    """A file with comments at its head and above its loops."""
    rows = [f"# {comment}" for comment in head]
    number, in_loops = 0, False
    for line in text.splitlines():
        if in_loops and line.startswith(LOOP_ITEM) and number < len(loops):
            rows += [f"  # {comment}" for comment in loops[number]]
            number += 1
        in_loops = line.startswith("loops:") or (in_loops and (line.startswith(" ") or not line))
        rows.append(line)
    return "\n".join(rows) + "\n"


# --- A configuration of another vendor: the result of `pidcfg.convert`, and its JSON ----------------------------------


@frozen
class ConvertResult:
    """A configuration for another vendor, what became of every field, and how both sides compare."""

    __repr__ = short_repr

    document: Document
    """The source."""
    findings: tuple[Diagnostic, ...]
    """Of the source; PID042: what it has to say before it, or a loop of it, can be converted."""
    target: str
    source: str | None = None
    """Keys of both vendors."""
    data: Data | None = None
    """The target's configuration as plain data, with the values that its registers hold; None: there is none."""
    text: str = ""
    """The same as YAML, with the comments of the source."""
    loops: tuple[LoopReport, ...] = ()
    """Of every loop of the source, what became of each of its fields, or why it was dropped."""
    losses: bool = False
    """Whether anything was lost: a loop, or a field that was dropped, clamped or rounded too far."""
    target_document: Document | None = None
    target_findings: tuple[Diagnostic, ...] = ()
    """What the target's own rules say about the result; with an error, its PLC would not take it."""
    verified: tuple[VerifiedLoop, ...] | None = None
    """Loop by loop the verdict of the battery on both sides; None: that was not asked for, or not possible."""
    unverified: str = ""
    """Why that was not possible."""

    @property
    def ok(self) -> bool:
        """Whether there is a configuration that the target's PLC takes; it may have lost something."""
        return self.data is not None and not errors_in(self.target_findings)

    @property
    def faults(self) -> tuple[Diagnostic, ...]:
        """What the target's own rules find at fault in the result: errors and warnings."""
        return tuple(d for d in self.target_findings if d.severity is not Severity.INFO)

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The places of each loop that went over, in the source and in the result."""
        converted = [i for i, loop in enumerate(self.loops) if loop.status == "converted"]
        return tuple((i, j) for j, i in enumerate(converted))

    @property
    def alike(self) -> bool:
        """Whether both sides behave alike, but for what the report names; also where that was not asked for."""
        return all(loop.passed for loop in self.verified or ())

    @property
    def pv_percent(self) -> float:
        """How far a PV lies apart at most, in % of its range."""
        return max((loop.pv_percent for loop in self.verified or ()), default=0.0)

    def to_json(self) -> Data:
        """What ``pidcfg convert --report json`` prints: the changes; where there is no result, the errors."""
        if self.data is None:
            return findings_data(errors_in(self.findings))
        loops = [_loop_data(loop) for loop in self.loops]
        document = {"version": 1, "from": self.source, "to": self.target, "loops": loops}
        document["findings"] = [finding_data(d) for d in self.faults]
        if self.verified is not None:
            document["verify"] = [verified_data(loop) for loop in self.verified]
        return document


def _loop_data(loop: LoopReport) -> Data:
    changes = [_change_data(change) for change in loop.changes]
    return {"loop": loop.loop, "status": loop.status, "reason": loop.reason or None, "changes": changes}


def _change_data(change: Change) -> Data:
    return {
        "field": change.field,
        "target_field": change.target_field or None,
        "kind": change.kind,
        "from": json_value(change.source),
        "to": json_value(change.target),
        "error_percent": round(change.error_percent, 6),
        "counts_apart": change.counts_apart,
        "loss": change.loss,
        "neutral": None if change.terms is None else _terms_data(change.terms),
        "note": change.note,
    }


def _terms_data(terms: Terms) -> Data:
    return {"field": terms.field, "from": json_value(terms.wanted), "to": json_value(terms.held), "unit": terms.unit}


def convert_checked(
    checked: Checked,
    target: Vendor,
    options: Mapping[str, object],
    verify: Callable[[Checked, Checked, ConvertResult], tuple[VerifiedLoop, ...]] | None,
    max_loss: MaxLoss = DEFAULT_MAX_LOSS,
) -> ConvertResult:
    """The conversion of a checked configuration; ``verify`` compares both sides where the target takes the result.

    ``options`` are the target's own: where things go that the source does not say. ``max_loss``: how far values may be
    rounded without being lost. Loops that the target's own rules refuse are dropped, unless it is all of them.
    """
    base = ConvertResult(checked.document, checked.findings, target.key)
    if checked.vendor is None or errors_in(checked.findings):
        return base
    placements = vendor_options(target, "convert_options", options)
    excluded: dict[int, str] = {}
    while True:
        try:
            outcome = convert(checked.config, checked.vendor, target, placements, max_loss=max_loss, excluded=excluded)
        except ConvertError as error:
            return replace(base, findings=(*checked.findings, *missing_findings(error.missing, checked.document)))
        text = text_of(outcome, checked.document)
        result = check_document(read_document(text.encode(), f"<{target.key}>", checked.document.limits))
        refused = refused_loops(outcome, result)
        if not refused or len(refused) == len(outcome.source_loops):
            break
        excluded |= refused
    conversion = replace(
        base,
        findings=(*checked.findings, *missing_findings(outcome.missing, checked.document)),
        source=checked.vendor.key,
        data=outcome.data,
        text=text,
        loops=outcome.loops,
        losses=outcome.has_losses,
        target_document=result.document,
        target_findings=result.findings,
    )
    if verify is None or not conversion.ok:
        return conversion
    return _with_verdicts(conversion, checked, result, verify)


def _with_verdicts(
    conversion: ConvertResult,
    source: Checked,
    result: Checked,
    verify: Callable[[Checked, Checked, ConvertResult], tuple[VerifiedLoop, ...]],
) -> ConvertResult:
    """The conversion with both sides on the same plants, or with the reason why that cannot be."""
    from pidcfg.sim.engine.run import UnusableError

    try:
        return replace(conversion, verified=verify(source, result, conversion))
    except UnusableError as error:
        return replace(conversion, unverified=str(error))


def missing_findings(entries: Sequence[MissingField], doc: Document) -> list[Diagnostic]:
    """What a source has to say before it can be converted, at the keys where it should."""
    return [
        Diagnostic("PID042", Severity.ERROR, entry.message, doc.file, doc.locate(entry.path, key=True), entry.path)
        for entry in entries
    ]


def text_of(outcome: ConvertedFile, document: Document) -> str:
    """The result as YAML, with the comments of the source: those of its loops where they went."""
    head, loops = split_comments(document, len(outcome.loops), _starter_comments())
    return insert_comments(yaml_text(outcome.data), head, [loops[i] for i in outcome.source_loops])


@cache
def _starter_comments() -> frozenset[str]:
    """Those of the starter files: they explain keys that another vendor does not have, or has for something else."""
    texts = (files("pidcfg").joinpath(vendor.starter).read_text("utf-8") for vendor in VENDORS.values())
    return frozenset(line.partition("#")[2].strip() for text in texts for line in text.splitlines())


def max_loss_of(text: str | None) -> MaxLoss:
    """The limits of a text; raises `ArgumentError`."""
    try:
        return DEFAULT_MAX_LOSS if text is None else parse_max_loss(text)
    except MaxLossError as error:
        raise ArgumentError(f"`max_loss`: {error}", "max_loss") from None


def refused_loops(outcome: ConvertedFile, result: Checked) -> dict[int, str]:
    """The loops that the target's own rules refuse, by their places in the source; empty: it is no loop's fault."""
    refused: dict[int, str] = {}
    for finding in errors_in(result.findings):
        top, *rest = finding.path or ("",)
        if top != "loops" or not rest or not isinstance(rest[0], int):
            return {}
        refused.setdefault(outcome.source_loops[rest[0]], f"{finding.code}: {finding.message}")
    return refused


def verify_sides(
    source: Checked,
    result: Checked,
    conversion: ConvertResult,
    progress: Callable[[float], None] | None = None,
    jobs: int = 1,
) -> tuple[VerifiedLoop, ...]:
    """Source and result in the battery, by so many processes; charts call them by their files' names and vendors."""
    from pidcfg.study.verification.verify import verify

    if source.vendor is None or result.vendor is None:
        return ()
    names = f"{PurePath(source.document.file).name} ({source.vendor.key})", f"result ({result.vendor.key})"
    source_side, result_side = (source.vendor, source.config), (result.vendor, result.config)
    return tuple(verify(source_side, result_side, conversion.pairs, conversion.loops, names, progress, jobs=jobs))
