"""Findings of a run as text and JSON, what several formats need, and how often each rule has something to say."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Hashable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from pidcfg.output.findings import count_severities, findings_data
from pidcfg.text.diagnostics import Severity, words_of
from pidcfg.text.document import Document
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import to_one_line, to_printable, width_of
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.text.diagnostics import Diagnostic, Span
    from pidcfg.text.paths import Data

# --- The findings of a run, and what several formats need: names relative to the checkout, and fingerprints -----------

STDIN = "<stdin>"
"""The name of standard input in reports."""
CHECKOUT_VARIABLES = ("GITHUB_WORKSPACE", "CI_PROJECT_DIR")
"""Variables in which a CI system names the folder of its checkout, which the names in its formats are relative to."""
VOLATILE_TEXT = re.compile(r"\bline \d+|\b[A-Z]{1,3}\d+\b|; measured: .*", re.DOTALL)
"""What differs in a message between runs of the same fault: line numbers, registers that move when a loop is inserted
above, what was measured."""
FINGERPRINT_DIGITS = 32
"""Of a fingerprint, in hexadecimal: 128 bits."""
MARKDOWN_SIGNS = re.compile(r"[\\|]|(?<=\])\(")
"""What would end a cell of Markdown, and the sign that makes a link of a text in brackets."""


def markdown_cell(text: str) -> str:
    """Text that stays in its cell of a Markdown table, and is no picture or link there."""
    return MARKDOWN_SIGNS.sub(r"\\\g<0>", to_one_line(text)).replace("&", "&amp;").replace("<", "&lt;")


@frozen
class Findings:
    """The findings of some files; ``documents`` has every file that was looked at, also those without findings."""

    reported: Sequence[Diagnostic]
    documents: Documents
    failing_severity: Severity = Severity.ERROR
    """From which severity on a finding fails the run."""
    suppressed: Sequence[tuple[Diagnostic, str | None]] = ()
    """Findings that are not reported: a comment ignores them for a reason, or (None) a baseline knows them."""
    command: str = "validate"
    """Which command has found them."""
    brief: bool = False
    """Whether the text says what several loops share once, and is short where it would fill more than a screen."""

    @property
    def files(self) -> list[str]:
        """Every file, in the order in which it was looked at."""
        return list(dict.fromkeys([*self.documents, *(d.file for d in self.reported)]))


def checkout_folder() -> Path:
    """The folder that names are relative to: the CI system's checkout when we run inside it, else where we run."""
    working_folder = Path.cwd()
    for name in CHECKOUT_VARIABLES:
        folder = os.environ.get(name, "")
        if Path(folder).is_absolute() and working_folder.is_relative_to(Path(folder).resolve()):
            return Path(folder).resolve()
    return working_folder


def path_in_checkout(file: str) -> str | None:
    """A file's name relative to the checkout, with forward slashes; None for one outside of it."""
    root = checkout_folder()
    path = Path(os.path.abspath(file))
    if not path.is_relative_to(root):
        try:
            path = path.resolve()
        except (OSError, RuntimeError, ValueError):
            return None
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else None


def display_name(file: str) -> str:
    """A file's name relative to the checkout, or as it was given when it lies outside."""
    return file if file == STDIN else path_in_checkout(file) or file


def file_uri(file: str) -> tuple[str, bool]:
    """A file as a URI reference, and whether it is relative to the checkout."""
    if file == STDIN:
        return "stdin", False
    name = path_in_checkout(file)
    if name is None and Path(file).is_absolute():
        return Path(file).as_uri(), False
    from urllib.parse import quote

    return quote(os.fsencode(name or os.path.normpath(file)).replace(os.sep.encode(), b"/")), name is not None


def fingerprints(findings: Findings) -> list[str]:
    """One a finding, unique, and the same when lines or loops are inserted above it.

    The value and the message are part of it, so that a value that was accepted once does not hide another wrong value
    later; findings that are equal in everything are numbered. What several loops share has no message in it, since that
    names the others.
    """
    import hashlib

    counts: Counter[str] = Counter()
    files_named = {d.file for d in findings.reported}
    rows = {file: doc.lines for file, doc in findings.documents.items() if file in files_named}
    digests = []
    for d in findings.reported:
        steps = [step for step in d.path if isinstance(step, str)]
        value = _source_text(d.span, rows.get(d.file, []))
        message = VOLATILE_TEXT.sub("", "" if d.with_loops else d.message)
        key = "\0".join((d.code, display_name(d.file), d.loop, ".".join(steps), value, message))
        counts[key] += 1
        digest = hashlib.sha256(f"{key}\0{counts[key]}".encode("utf-8", "backslashreplace"))
        digests.append(digest.hexdigest()[:FINGERPRINT_DIGITS])
    return digests


def _source_text(span: Span, rows: Sequence[str]) -> str:
    """The text at a place, within one line."""
    if span.line != span.end_line or not 0 < span.line <= len(rows):
        return ""
    return rows[span.line - 1][span.column - 1 : span.end_column - 1]


def finding_sentence(d: Diagnostic) -> str:
    """The message with the loop that it concerns, unless it names that itself."""
    return f"{d.message} [{d.loop}]" if d.loop and d.loop not in d.message else d.message


def finding_lines(d: Diagnostic) -> list[str]:
    """Everything that a finding says, line by line."""
    rows = (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
    return [finding_sentence(d), *(f"{label}: {text}" for label, text in rows if text)]


# --- Findings as text and as JSON, as many commands print them --------------------------------------------------------

Documents = Mapping[str, Document]
MAX_LINE_LENGTH = 160
MAX_PLACES = 24
"""Further places that a line names before it only counts."""
MAX_NAMES = 8
"""Loops that a line names before it only counts."""
VERBOSE_HINT = "-v has the lines and cures of what several loops share\n"
VERBOSE_HINT_OF_INFOS = "-v has the lines and cures of these\n"
VERBOSE_HINT_OF_LONG = "-v has every line of the file, what the PLC does and the manual's places\n"
SCREEN_ROWS = 36
"""Rows of a text that is printed whole: a screen with the lines that stand around it."""
SCREEN_COLUMNS = 80
"""Of that screen."""


def findings_text(findings: Sequence[Diagnostic], documents: Documents, *, brief: bool = False) -> str:
    """One block a rule and cure: place, message, the line with a caret, the PLC, the manual, the cure, further places.

    In each file errors come first, infos last.

    Grouping is for the eye alone: findings are collected, counted, ignored and known one by one before. ``brief``: an
    info that several loops share is one line, behind all blocks; where that would fill more than a screen, so is every
    info, and of warnings the message, the cure and the places are left.
    """
    groups: dict[Hashable, list[Diagnostic]] = {}
    for d in findings:
        file = d.file if d.severity is Severity.ERROR else ""
        groups.setdefault((file, d.code, d.severity, d.reference, d.help, d.plc_effect is None), []).append(d)
    files = list(dict.fromkeys(d.file for d in findings))
    sorted_groups = sorted(groups.values(), key=lambda group: (files.index(group[0].file), -group[0].severity))
    if not brief:
        return _blocks_text(sorted_groups, documents)
    blocks_text = _blocks_text(sorted_groups, documents, shared=True)
    for short in (False, True):
        if _fits_screen(blocks_text) or all(d.severity is Severity.ERROR for d in findings):
            break
        blocks_text = _blocks_text(sorted_groups, documents, shared=True, infos=True, short=short)
    return blocks_text


def _fits_screen(text: str) -> bool:
    """Whether a text and what stands around it fill no more than a screen."""
    return sum(-(-max(width_of(line), 1) // SCREEN_COLUMNS) for line in text.splitlines()) <= SCREEN_ROWS


def _blocks_text(
    groups: Sequence[list[Diagnostic]],
    documents: Documents,
    *,
    shared: bool = False,
    infos: bool = False,
    short: bool = False,
) -> str:
    """Groups in blocks, behind them in a line ``shared`` or all ``infos``; ``short`` leaves out much of warnings."""
    blocks, rows = [], []
    for group in groups:
        severity = group[0].severity
        if severity is Severity.INFO and (infos or (shared and len(group) > 1)):
            rows.append(f"{to_one_line(_group_line(group))}\n")
        elif short and severity is Severity.WARNING:
            blocks.append(f"{_short_block(group)}\n")
        else:
            blocks.append(f"{_block_text(group, documents.get(group[0].file))}\n")
    hint = VERBOSE_HINT_OF_LONG if short else VERBOSE_HINT_OF_INFOS if infos else VERBOSE_HINT if rows else ""
    return "".join([*blocks, *rows, hint])


def _finding_head(d: Diagnostic) -> str:
    return f"{d.file}:{d.span.line}:{d.span.column}: {d.severity.label} {d.code}: {d.message}"


def _group_line(group: Sequence[Diagnostic]) -> str:
    """A group in one line: the first finding, and its loops by name."""
    names = names_of([d.loop for d in group if d.loop])
    return f"{_finding_head(group[0])} [{names}]" if names else _finding_head(group[0])


def names_of(loops: Sequence[str]) -> str:
    """The names of loops, each once; of very many some."""
    names = list(dict.fromkeys(loops))
    more = [f"{len(names) - MAX_NAMES} more"] if len(names) > MAX_NAMES + 1 else []
    return ", ".join(names[: MAX_NAMES if more else None] + more)


def distinct_lines(findings: Sequence[Diagnostic]) -> list[str]:
    """A line for what several findings say in the same words, with their loops and without their places."""
    groups: dict[Hashable, list[Diagnostic]] = {}
    for d in findings:
        groups.setdefault((d.code, d.severity, words_of(d)), []).append(d)
    return [
        f"{group[0].severity.label} {group[0].code}: {group[0].message}"
        + (f" [{names}]" if (names := names_of([d.loop for d in group if d.loop])) else "")
        for group in groups.values()
    ]


def _block_text(group: Sequence[Diagnostic], doc: Document | None) -> str:
    d = group[0]
    loop = f" [{d.loop}]" if d.loop else ""
    lines = [f"{_finding_head(d)}{loop}"]
    lines += _source_excerpt(d, doc)
    lines += [
        f"      = {label}: {value}"
        for label, value in (("PLC", d.plc_effect), ("see", d.reference), ("cure", d.help))
        if value
    ]
    lines += [f"      = also: {row}" for row in _other_lines(group)]
    return "\n".join(map(to_one_line, lines)) + "\n"


def _short_block(group: Sequence[Diagnostic]) -> str:
    """A group without what -v adds: the first finding, the cure, and the places of the others."""
    d, *others = group
    lines = [f"{_finding_head(d)} [{d.loop}]" if d.loop else _finding_head(d)]
    lines += [f"      = cure: {d.help}"] if d.help else []
    lines += [f"      = also: {_places_text(others, d.file)}"] if others else []
    return "\n".join(map(to_one_line, lines)) + "\n"


def _other_lines(group: Sequence[Diagnostic]) -> list[str]:
    """The other findings of a group: those that say the same, and infos, by name; of the rest what each says."""
    kinds: dict[str, list[Diagnostic]] = {}
    for d in group:
        kinds.setdefault("" if d.severity is Severity.INFO else words_of(d), []).append(d)
    (_, *same), *other_kinds = kinds.values()
    rows = [_places_text(same, group[0].file)] if same else []
    file = group[0].file
    for first, *others in other_kinds:
        loop = f" [{first.loop}]" if first.loop else ""
        others_text = f", and {_places_text(others, file)}" if others else ""
        file_prefix = "" if first.file == file else f"{first.file}:"
        rows.append(f"{file_prefix}{first.span.line}:{first.span.column}: {first.message}{loop}{others_text}")
    return rows


def _places_text(findings: Sequence[Diagnostic], file: str) -> str:
    """Loops and lines of findings, with the name of another file than this one."""
    lines = [f"line {d.span.line}" if d.file == file else f"{d.file}:{d.span.line}" for d in findings]
    places = [f"{d.loop} ({where})" if d.loop else where for d, where in zip(findings, lines, strict=True)]
    if len(places) > MAX_PLACES:
        places[MAX_PLACES:] = [f"{len(places) - MAX_PLACES} more (--format concise has a line for each)"]
    return ", ".join(places)


def _source_excerpt(d: Diagnostic, doc: Document | None) -> list[str]:
    """The source line with a caret under the value, wherever a tab or a very long line leaves it."""
    rows = doc.lines if doc else []
    if not 0 < d.span.line <= len(rows) or not rows[d.span.line - 1].strip():
        return []
    row, start = to_printable(rows[d.span.line - 1]), d.span.column - 1
    end = d.span.end_column - 1 if d.span.end_line == d.span.line else len(row.rstrip())
    begin = max(0, start - MAX_LINE_LENGTH // 2) if len(row) > MAX_LINE_LENGTH else 0
    row = row[begin : begin + MAX_LINE_LENGTH]
    start, end = start - begin, min(end - begin, len(row))
    indent = "".join("\t" if c == "\t" else " " * width_of(c) for c in row[:start])
    return [f" {d.span.line:>4} | {row.rstrip()}", f"      | {indent}{'^' * max(1, width_of(row[start:end]))}"]


def summary_line(findings: Sequence[Diagnostic], files: int, skipped: int = 0, left_out: str = "") -> str:
    """One line that says how it went; ``skipped``: YAML files in folders that are not for pidcfg."""
    count_by_severity = count_severities(findings)
    parts = [f"{count_by_severity[s]} {s.label}{'s' if count_by_severity[s] != 1 else ''}" for s in count_by_severity]
    others = f"; {skipped} without a pidcfg key skipped" if skipped else ""
    others += f"; {to_one_line(left_out)}" if left_out else ""
    return f"{files} file{'s' if files != 1 else ''} checked: {', '.join(parts)}{others}"


def json_v1(findings: Sequence[Diagnostic], documents: Documents) -> str:
    """The layout of the public interface, version 1."""
    return json_text(findings_data(findings, len(documents)))


# --- ``validate --statistics``: how often each rule has something to say, in place of what it says --------------------

STATISTICS_OPTION = click.option(
    "--statistics",
    "count_only",
    is_flag=True,
    help="Print how many findings each rule has (text or json), not the findings.",
)


def statistics_format(ctx: click.Context, fmt: str) -> str:
    """The format of the counts: ``text`` or ``json``; another one that was asked for is refused."""
    if fmt in {"text", "json"}:
        return fmt
    if ctx.get_parameter_source("fmt") is ParameterSource.DEFAULT:  # that of GitHub's jobs
        return "text"
    raise click.UsageError(f"--statistics is printed as text or json, not as {fmt}", ctx)


def render_statistics(fmt: str, findings: Findings) -> str:
    """The counts as text or as JSON."""
    rows = list(_statistics_rows(findings))
    if fmt == "json":
        summary = findings_data(findings.reported, len(findings.documents))["summary"]
        return json_text({"version": 1, "statistics": rows, "summary": summary})
    width = max((len(str(row["count"])) for row in rows), default=0)
    return "".join(
        f"{row['count']:>{width}}  {row['code']:<6}  {row['severity']:<7}  {row['title']}"
        + (f" ({row['fixable']} correctable with --fix)" if row["fixable"] else "")
        + "\n"
        for row in rows
    )


def _statistics_rows(findings: Findings) -> Iterator[Data]:
    """A row a rule and severity, the most frequent first."""
    from pidcfg.validate.catalog import rule_of

    counts = Counter((d.code, d.severity) for d in findings.reported)
    fixable = Counter((d.code, d.severity) for d in findings.reported if d.edits)
    for (code, severity), number in sorted(counts.items(), key=lambda row: (-row[1], -row[0][1], row[0][0])):
        yield {
            "code": code,
            "severity": severity.label,
            "title": rule_of(code).title,
            "count": number,
            "fixable": fixable[code, severity],
        }
