"""Findings that are known: a list that only shrinks, and comments in the file that ignore a code with a reason."""

from __future__ import annotations

import json
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import field
from typing import NamedTuple

from pidcfg.text.diagnostics import Diagnostic, Edit, Severity, Span, number_of
from pidcfg.text.document import Document
from pidcfg.text.frozen import frozen
from pidcfg.text.source import Comment, FindingLines, comments_in, read_document
from pidcfg.text.writer import json_line
from pidcfg.validate.catalog import RULES_HINT, find_rules, is_ignorable, is_unusable, suggest_code
from pidcfg.validate.fixes import apply_edits, find_line_break
from pidcfg.validate.rule import D315, D317, IGNORE_RULES

# --- Known findings: a list that is written once and from then on only shrinks ----------------------------------------
#
# An entry has neither a line nor a message: it is file, code, severity, loop, key, the value that is written there
# (`pidcfg.validate.fixes`) and what else the message quotes of the loop (`pidcfg.validate.engine`), with how many
# such findings there are. So it survives every edit that does not touch its loop, and a value that changes is a new
# finding, at whichever key it stands.

FORMAT_VERSION = 3
"""Of the format; those before it were never released."""
NEVER_IN_BASELINE = frozenset(rule.code for rule in IGNORE_RULES)
"""What is wrong with ignores and with the baseline itself is to be corrected, and never enters a baseline."""
COUNT_KEY = "count"


class Entry(NamedTuple):
    """A finding without its place; the file is seen from the folder of the baseline."""

    file: str
    code: str
    severity: str
    loop: str
    key: str
    value: str | None
    quotes: str | None = None


class BaselineError(Exception):
    """A baseline that cannot be read."""


@frozen
class BaselineComparison:
    """The findings that are new, those that are known, and the entries that no longer occur, in order."""

    new: list[Diagnostic]
    known: list[Diagnostic]
    stale: list[Entry]


def entry_of(finding: Diagnostic, file_of: Callable[[str], str]) -> Entry:
    """A finding as a baseline keeps it."""
    d = finding
    return Entry(file_of(d.file), d.code, d.severity.label, d.loop, d.key, d.value, d.quotes)


def may_be_in_baseline(finding: Diagnostic) -> bool:
    """Whether a finding may be in a baseline."""
    return is_ignorable(finding) and finding.code not in NEVER_IN_BASELINE


def compare(
    findings: Sequence[Diagnostic],
    is_selected: Callable[[Diagnostic], bool],
    entries: Sequence[Entry],
    checked_files: set[str],
    file_of: Callable[[str], str],
) -> BaselineComparison:
    """Compares findings in ``checked_files`` with a baseline; those that ``is_selected`` refuses are not reported.

    An entry is stale when its file was checked by every rule, and the finding was not there.
    """
    counts = Counter(entries)
    new_findings: list[Diagnostic] = []
    known_findings: list[Diagnostic] = []
    for d in findings:
        key = entry_of(d, file_of)
        if may_be_in_baseline(d) and counts[key] > 0:
            counts[key] -= 1
            if is_selected(d):
                known_findings.append(d)
        elif is_selected(d):
            new_findings.append(d)
    files = usable_files(findings, checked_files, file_of)
    stale = [e for e in entries if e.file in files and _take_one(counts, e)]
    return BaselineComparison(new_findings, known_findings, stale)


def usable_files(findings: Sequence[Diagnostic], checked_files: set[str], file_of: Callable[[str], str]) -> set[str]:
    """The files that every rule has seen: of the others nobody can say what no longer occurs."""
    return checked_files - {file_of(d.file) for d in findings if not is_ignorable(d)}


def _take_one(remaining: Counter[Entry], key: Entry) -> bool:
    """Counts one down, if there is one."""
    is_left = remaining[key] > 0
    remaining[key] -= is_left
    return is_left


def remove_entries(entries: Sequence[Entry], stale: Sequence[Entry]) -> list[Entry]:
    """What is left of a baseline: never more than there was."""
    remaining = Counter(stale)
    return [e for e in entries if not _take_one(remaining, e)]


def baseline_text(entries: Iterable[Entry]) -> str:
    """A baseline as a file: one entry a line, in order, so that a diff shows what was removed."""
    rows = [_entry_row(e, count) for e, count in sorted(Counter(entries).items(), key=lambda row: _entry_order(row[0]))]
    body = "[\n" + ",\n".join(f"    {row}" for row in rows) + "\n  ]" if rows else "[]"
    return f'{{\n  "version": {FORMAT_VERSION},\n  "findings": {body}\n}}\n'


def _entry_order(e: Entry) -> tuple[str, ...]:
    """By number of the code, as findings are."""
    return (number_of(e.code), *e[:-2], *("" if text is None else f"={text}" for text in e[-2:]))


def _entry_row(e: Entry, count: int) -> str:
    """An entry as the file has it, without the comma behind it."""
    return json_line({**e._asdict(), COUNT_KEY: count})


def parse_baseline(text: str) -> list[Entry]:
    """What a file says; raises `BaselineError`."""
    try:
        data = json.loads(text)
    except json.JSONDecodeError as error:
        raise BaselineError(f"{error.lineno}:{error.colno}: not JSON: {error.msg}") from None
    except (RecursionError, ValueError) as error:
        raise BaselineError(f"1:1: not JSON: {type(error).__name__}") from None
    if not isinstance(data, dict) or not isinstance(data.get("findings"), list):
        raise BaselineError(f"1:1: not a baseline of version {FORMAT_VERSION}")
    version = data.get("version")
    if isinstance(version, bool) or not isinstance(version, int) or not 0 < version <= FORMAT_VERSION:
        raise BaselineError(f"1:1: not a baseline of version {FORMAT_VERSION}")
    if version < FORMAT_VERSION:
        raise BaselineError(f"1:1: a baseline of version {version}; this pidcfg reads version {FORMAT_VERSION}")
    entries = list[Entry]()
    for number, row in enumerate(data["findings"]):
        entries += _read_entry(number, row)
        if len(entries) > MAX_FINDINGS:
            raise BaselineError(f"1:1: findings[{number}]: the counts up to here are more than {MAX_FINDINGS} findings")
    return entries


def _read_entry(number: int, row: object) -> list[Entry]:
    """One row of a file, as often as it counts."""
    if not isinstance(row, dict) or row.keys() != {*Entry._fields, COUNT_KEY} or not _is_valid_row(row):
        null = " and ".join(NULLABLE_KEYS)
        more = f" ({null}: text or null) and a {COUNT_KEY} above 0"
        raise BaselineError(f"1:1: findings[{number}] must have the texts {', '.join(Entry._fields)}{more}")
    count = row.pop(COUNT_KEY)
    return [Entry(**row)] * count


MAX_FINDINGS = 1_000_000
"""Findings that a baseline may stand for."""
NULLABLE_KEYS = ("value", "quotes")
"""Keys of an entry that may have nothing to say."""


def _is_valid_row(row: dict[str, object]) -> bool:
    """Whether a row has the right types."""
    count = row[COUNT_KEY]
    is_count = isinstance(count, int) and not isinstance(count, bool) and 0 < count <= MAX_FINDINGS
    return is_count and all(
        isinstance(text, str) or (text is None and key in NULLABLE_KEYS)
        for key, text in row.items()
        if key != COUNT_KEY
    )


def stale_findings(
    stale: Sequence[Entry], ignored: Collection[Entry], entries: Sequence[Entry], text: str, file: str
) -> list[Diagnostic]:
    """Entries that no longer occur, or are ``ignored`` by a comment now, as findings at their lines of the file."""
    counts = Counter(entries)
    findings = []
    for e, number in Counter(stale).items():
        count_text = f" ({number} of {counts[e]})" if number < counts[e] else ""
        status = "is ignored by a comment now" if e in ignored else "no longer occurs"
        place = " ".join(part for part in (e.loop, e.key) if part)
        message = f"{e.code} {status}{count_text} in {e.file}" + (f" at {place}" if place else "")
        message += "" if e.value is None else f": {e.value}"
        findings.append(stale_finding(message, _entry_row(e, counts[e]), text, file))
    return findings


def stale_finding(message: str, row: str, text: str, file: str) -> Diagnostic:
    """A finding at the line of a row of the file; at the first line where somebody wrote the row in another way."""
    lines = text.split("\n")
    line = next((n for n, content in enumerate(lines, start=1) if content.strip().rstrip(",") == row), 1)
    content = lines[line - 1]
    column = len(content) - len(content.lstrip()) + 1
    span = Span(line, column, line, max(column, len(content)) + 1)
    cure = "--shrink-baseline removes it"
    return Diagnostic("PID048", Severity.WARNING, message, file, span, reference=str(D317), help=cure)


# --- Findings that a comment in the file ignores: ``# pidcfg: ignore[DL211] reason`` ----------------------------------
#
# At the end of a line the comment applies to findings that begin there; on its own line, to those of the next line
# that holds more than a comment. Every code is written in full, with a reason; what ignores nothing is reported. It
# stands at the very beginning of its comment: a line that was commented out, or prose, ignores nothing. What an alias
# (``*name``) brings to another place is ignored at the alias.

COMMENT_HINT = re.compile(r"#[ \t]*pidcfg:[ \t]*(?:ignore|[\w-]+[ \t]*\[)", re.IGNORECASE)
"""What a text must hold before its comments are looked for: most files have none."""
DIRECTIVE = re.compile(
    r"#[ \t]*pidcfg:[ \t]*(?P<word>[\w-]+)[ \t]*(?:\[(?P<codes>[^\]#]*)\])?(?P<reason>.*?)(?=\s#|$)", re.IGNORECASE
)
IGNORE_WORD = "ignore"
FIRST_CURE = "put it first, with all its codes in one bracket"
IGNORE_CURE = "write # pidcfg: ignore[DL211] reason"
MAX_SUGGESTIONS = 100
"""Comments of a file whose unknown codes are compared with all there are."""


@frozen
class IgnoredFinding:
    """A finding that a comment ignores, and why."""

    finding: Diagnostic
    reason: str


@frozen
class SuppressionResult:
    """What is left of a file's findings, with what is wrong with its comments, and what was ignored."""

    findings: list[Diagnostic]
    ignored: list[IgnoredFinding] = field(default_factory=list)


@frozen
class _IgnoreComment:
    """One comment: the line that it applies to (0: none), its codes and its reason."""

    comment: Comment
    span: Span
    target: int
    codes: tuple[str, ...]
    reason: str
    is_whole_comment: bool
    """Whether the comment contains nothing else."""


def suppress(findings: Sequence[Diagnostic], doc: Document) -> SuppressionResult:
    """Removes the findings that comments of the file ignore, and adds the mistakes in these comments."""
    if not COMMENT_HINT.search(doc.text) or any(map(is_unusable, findings)):
        return SuppressionResult(list(findings))
    ignores, problems = _read_comments(doc)
    remaining: list[Diagnostic] = []
    ignored: list[IgnoredFinding] = []
    used_codes: dict[int, set[str]] = defaultdict(set)
    lines = FindingLines(doc)
    ignores_by_line = {(ignore.target, code): (i, ignore) for i, ignore in enumerate(ignores) for code in ignore.codes}
    for d in findings:
        match = ignores_by_line.get((lines.line_of(d), d.code)) if is_ignorable(d) else None
        if match is None:
            remaining.append(d)
        else:
            used_codes[match[0]].add(d.code)
            ignored.append(IgnoredFinding(d, match[1].reason))
    is_all_checked = all(map(is_ignorable, findings))
    for i, ignore in enumerate(ignores):
        problems += _comment_remarks(
            ignore, used_codes[i], doc, is_checked=is_all_checked, may_suggest=i < MAX_SUGGESTIONS
        )
    return SuppressionResult(remaining + problems, ignored)


def _read_comments(doc: Document) -> tuple[list[_IgnoreComment], list[Diagnostic]]:
    """The comments that ignore something, and what is wrong with those that only begin so."""
    ignores: list[_IgnoreComment] = []
    problems: list[Diagnostic] = []
    comments = list(comments_in(doc.text))
    next_lines = _next_content_lines({comment.line for comment in comments if comment.is_alone}, doc.lines)
    for comment in comments:
        first = DIRECTIVE.match(comment.text)
        for match in DIRECTIVE.finditer(comment.text):
            span = _comment_part(comment, match.start(), match.end())
            if match.start() and match["word"].lower() == IGNORE_WORD:
                if first or not comment.is_alone:
                    problems.append(_comment_problem("PID045", "an ignore begins its comment", doc, span, FIRST_CURE))
                continue
            codes = _codes_of(match)
            if match["word"].lower() != IGNORE_WORD:
                if match["codes"] is not None:
                    problems.append(
                        _comment_problem("PID045", f"{match['word']!r} is no word of pidcfg's", doc, span, IGNORE_CURE)
                    )
            elif not codes:
                problems.append(
                    _comment_problem("PID045", "the comment names no code to ignore", doc, span, IGNORE_CURE)
                )
            else:
                target = next_lines[comment.line] if comment.is_alone else comment.line
                is_whole = match.start() == 0 and match.end() == len(comment.text)
                codes_once = tuple(dict.fromkeys(codes))
                ignores.append(_IgnoreComment(comment, span, target, codes_once, match["reason"].strip(), is_whole))
    return ignores, problems


def _codes_of(match: re.Match[str]) -> list[str]:
    """The codes in the bracket of a comment, as they are written but for capitals."""
    return [code.strip().upper() for code in (match["codes"] or "").split(",") if code.strip()]


def _next_content_lines(comment_lines: set[int], lines: list[str]) -> dict[int, int]:
    """The next line that holds more than a comment, below each line of ``comment_lines``; 0 at the end of the file."""
    next_lines, following = {}, 0
    for line in range(len(lines), 0, -1):
        if line in comment_lines:
            next_lines[line] = following
        elif lines[line - 1].strip():
            following = line
    return next_lines


def _comment_part(comment: Comment, start: int, end: int) -> Span:
    """A part of a comment as a place in the file."""
    return Span(comment.line, comment.column + start, comment.line, comment.column + end)


def _comment_remarks(
    ignore: _IgnoreComment, used_codes: set[str], doc: Document, *, is_checked: bool, may_suggest: bool
) -> Iterator[Diagnostic]:
    """What is wrong with one comment; ``is_checked``: every rule has seen the file, so that unused is unused.

    ``may_suggest``: the code that was probably meant is looked for.
    """
    unused_codes = []
    for code in (c for c in ignore.codes if c not in used_codes):
        rule = find_rules(code).get(code)
        if rule is None:
            yield _unknown_code_remark(code, doc, ignore, may_suggest=may_suggest)
        elif not rule.is_ignorable:
            yield _comment_problem(
                "PID047", f"{code} ({rule.name}) cannot be ignored", doc, ignore.span, "correct the error"
            )
        elif is_checked:
            unused_codes.append(code)
    if unused_codes:
        where = "the next line" if ignore.comment.is_alone else "this line"
        message = f"{', '.join(unused_codes)}: no such finding on {where}"
        yield _comment_problem(
            "PID043", message, doc, ignore.span, "delete it", _removal_edit(ignore, set(unused_codes), doc)
        )
    if not ignore.reason:
        yield _comment_problem(
            "PID046",
            f"no reason is given for ignoring {', '.join(ignore.codes)}",
            doc,
            ignore.span,
            "write the reason behind the bracket",
        )


def _unknown_code_remark(code: str, doc: Document, ignore: _IgnoreComment, *, may_suggest: bool) -> Diagnostic:
    """A code that no rule has: misspelt, or only the beginning of one."""
    if find_rules(code):
        return _comment_problem(
            "PID044", f"{code} is only the beginning of a code", doc, ignore.span, "write it in full"
        )
    return _comment_problem(
        "PID044", f"no rule is called {code!r}", doc, ignore.span, suggest_code(code) if may_suggest else RULES_HINT
    )


def _removal_edit(ignore: _IgnoreComment, unused: set[str], doc: Document) -> tuple[Edit, ...]:
    """The edit that takes the codes away: out of the bracket, or all but the reason, which may be worth keeping."""
    line, column = ignore.span.line, ignore.span.column
    row = doc.lines[line - 1]
    codes_left = [code for code in ignore.codes if code not in unused]
    if codes_left:
        start, end = row.index("[", column - 1) + 1, row.index("]", column - 1)
        return (Edit(Span(line, start + 1, line, end + 1), ", ".join(codes_left)),)
    if not ignore.is_whole_comment:
        return ()
    if ignore.reason:
        remark = f"# {ignore.reason}"
        return () if DIRECTIVE.search(remark) else (Edit(ignore.span, remark),)
    if ignore.comment.is_alone and line < len(doc.lines):
        return (Edit(Span(line, 1, line + 1, 1), ""),)
    return (Edit(Span(line, len(row[: column - 1].rstrip()) + 1, line, len(row) + 1), ""),)


def ignore_edit(doc: Document, finding: Diagnostic, reason: str) -> Edit | None:
    """The edit that writes a comment which ignores a finding, or adds its code to the comment that is there.

    The comment stands at the end of the line, or above it where there is another comment. None where the finding cannot
    be ignored, or where no comment can be put without changing what the file says.
    """
    line = FindingLines(doc).line_of(finding) if is_ignorable(finding) and doc.data is not None else 0
    if not 0 < line <= len(doc.lines):
        return None
    ignores = _read_comments(doc)[0] if COMMENT_HINT.search(doc.text) else []
    existing = next((ignore for ignore in ignores if ignore.target == line), None)
    for edit, lines_added in _comments_for(doc, line, f"{finding.code}", reason, existing):
        new_doc = read_document(apply_edits(doc.text, [edit]).encode(), doc.file, doc.limits)
        ignores_after = _read_comments(new_doc)[0] if new_doc.data == doc.data else ()
        if any(ignore.target == line + lines_added and finding.code in ignore.codes for ignore in ignores_after):
            return edit
    return None


def _comments_for(
    doc: Document, line: int, code: str, reason: str, existing: _IgnoreComment | None
) -> Iterator[tuple[Edit, int]]:
    """Ways to ignore a code at a line, and how far each moves the line down."""
    row = doc.lines[line - 1]
    if existing is not None:
        position = existing.span.line, doc.lines[existing.span.line - 1].index("]", existing.span.column - 1) + 1
        yield Edit(Span(*position, *position), f", {code}"), 0
        return
    text = f"# pidcfg: {IGNORE_WORD}[{code}] {reason}".rstrip()
    end = len(row.rstrip()) + 1
    yield Edit(Span(line, end, line, len(row) + 1), f"  {text}"), 0
    indent = row[: len(row) - len(row.lstrip())]
    yield Edit(Span(line, 1, line, 1), f"{indent}{text}{find_line_break(doc.text)}"), 1


def _comment_problem(
    code: str, message: str, doc: Document, span: Span, cure: str, edits: tuple[Edit, ...] = ()
) -> Diagnostic:
    return Diagnostic(code, Severity.WARNING, message, doc.file, span, reference=str(D315), help=cure, edits=edits)
