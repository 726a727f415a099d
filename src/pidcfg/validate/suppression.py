"""Findings that a comment in the file ignores: ``# pidcfg: ignore[DL211] reason``.

At the end of a line the comment applies to findings that begin there; on its own line, to those of the next line that
holds more than a comment. Every code is written in full, with a reason; what ignores nothing is reported. It stands at
the very beginning of its comment: a line that was commented out, or prose, ignores nothing. What an alias (``*name``)
brings to another place is ignored at the alias.
"""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.aliases import Places
from pidcfg.comments import comments_in
from pidcfg.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.validate.catalog import LISTED, current, ignorable, rules, suggestion, unusable
from pidcfg.validate.codes import D315

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.comments import Comment
    from pidcfg.document import Document

HINT = re.compile(r"#[ \t]*pidcfg:[ \t]*(?:ignore|[\w-]+[ \t]*\[)", re.IGNORECASE)
"""What a text must hold before its comments are looked for: most files have none."""
DIRECTIVE = re.compile(
    r"#[ \t]*pidcfg:[ \t]*(?P<word>[\w-]+)[ \t]*(?:\[(?P<codes>[^\]#]*)\])?(?P<reason>.*?)(?=\s#|$)", re.IGNORECASE
)
WORD = "ignore"
ONE = "put it first, with all its codes in one bracket"
FORM = "write # pidcfg: ignore[DL211] reason"
MOST_NEAR = 100
"""Comments of a file whose unknown codes are compared with all there are."""


@dataclass(frozen=True, slots=True)
class Ignored:
    """A finding that a comment ignores, and why."""

    finding: Diagnostic
    reason: str


@dataclass(frozen=True, slots=True)
class Suppressed:
    """What is left of a file's findings, with what is wrong with its comments, and what was ignored."""

    kept: list[Diagnostic]
    ignored: list[Ignored] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class _Ignore:
    """One comment: the line that it applies to (0: none), its codes and its reason."""

    comment: Comment
    span: Span
    target: int
    codes: tuple[str, ...]
    reason: str
    whole: bool
    """Whether the comment contains nothing else."""


def suppress(findings: Sequence[Diagnostic], doc: Document) -> Suppressed:
    """Removes the findings that comments of the file ignore, and adds the mistakes in these comments."""
    if not HINT.search(doc.text) or any(map(unusable, findings)):
        return Suppressed(list(findings))
    ignores, problems = _read(doc)
    kept: list[Diagnostic] = []
    ignored: list[Ignored] = []
    used: dict[int, set[str]] = defaultdict(set)
    places = Places(doc)
    by_place = {(ignore.target, code): (i, ignore) for i, ignore in enumerate(ignores) for code in ignore.codes}
    for d in findings:
        match = by_place.get((places.line(d), d.code)) if ignorable(d) else None
        if match is None:
            kept.append(d)
        else:
            used[match[0]].add(d.code)
            ignored.append(Ignored(d, match[1].reason))
    whole = all(map(ignorable, findings))
    for i, ignore in enumerate(ignores):
        problems += _remarks(ignore, used[i], doc, checked=whole, near=i < MOST_NEAR)
    return Suppressed(kept + problems, ignored)


def _read(doc: Document) -> tuple[list[_Ignore], list[Diagnostic]]:
    """The comments that ignore something, and what is wrong with those that only begin so."""
    ignores: list[_Ignore] = []
    problems: list[Diagnostic] = []
    comments = list(comments_in(doc.text))
    below = _lines_below({comment.line for comment in comments if comment.alone}, doc.lines)
    for comment in comments:
        first = DIRECTIVE.match(comment.text)
        for match in DIRECTIVE.finditer(comment.text):
            span = _part(comment, match.start(), match.end())
            if match.start() and match["word"].lower() == WORD:
                if first or not comment.alone:
                    problems.append(_problem("PID045", "an ignore begins its comment", doc, span, ONE))
                continue
            codes = [current(code) for code in _codes_of(match)]
            if match["word"].lower() != WORD:
                if match["codes"] is not None:
                    problems.append(_problem("PID045", f"{match['word']!r} is no word of pidcfg's", doc, span, FORM))
            elif not codes:
                problems.append(_problem("PID045", "the comment names no code to ignore", doc, span, FORM))
            else:
                target = below[comment.line] if comment.alone else comment.line
                whole = match.start() == 0 and match.end() == len(comment.text)
                codes_once = tuple(dict.fromkeys(codes))
                ignores.append(_Ignore(comment, span, target, codes_once, match["reason"].strip(), whole))
    return ignores, problems


def _codes_of(match: re.Match[str]) -> list[str]:
    """The codes in the bracket of a comment, as they are written but for capitals."""
    return [code.strip().upper() for code in (match["codes"] or "").split(",") if code.strip()]


def former_codes(doc: Document) -> Iterator[tuple[str, Edit]]:
    """The codes in comments that have another name now, each with the edit that writes it; of a text that is YAML."""
    if not HINT.search(doc.text):
        return
    for comment in comments_in(doc.text):
        for match in DIRECTIVE.finditer(comment.text):
            if match["word"].lower() != WORD or match["codes"] is None or match.start():
                continue
            for code in re.finditer(r"[^,\s](?:[^,]*[^,\s])?", match["codes"]):
                name = current(code[0].upper())
                if name != code[0].upper() and name in rules(name):
                    start = match.start("codes") + code.start()
                    yield code[0], Edit(_part(comment, start, start + len(code[0])), name)


def _lines_below(alone: set[int], lines: list[str]) -> dict[int, int]:
    """The next line that holds more than a comment, below each line of ``alone``; 0 at the end of the file."""
    below, following = {}, 0
    for line in range(len(lines), 0, -1):
        if line in alone:
            below[line] = following
        elif lines[line - 1].strip():
            following = line
    return below


def _part(comment: Comment, start: int, end: int) -> Span:
    """A part of a comment as a place in the file."""
    return Span(comment.line, comment.column + start, comment.line, comment.column + end)


def _remarks(ignore: _Ignore, used: set[str], doc: Document, *, checked: bool, near: bool) -> Iterator[Diagnostic]:
    """What is wrong with one comment; ``checked``: every rule has seen the file, so that unused is unused.

    ``near``: the code that was probably meant is looked for.
    """
    unused = []
    for code in (c for c in ignore.codes if c not in used):
        rule = rules(code).get(code)
        if rule is None:
            yield _unknown(code, doc, ignore, near=near)
        elif not rule.ignorable:
            yield _problem("PID047", f"{code} ({rule.name}) cannot be ignored", doc, ignore.span, "correct the error")
        elif checked:
            unused.append(code)
    if unused:
        where = "the next line" if ignore.comment.alone else "this line"
        message = f"{', '.join(unused)}: no such finding on {where}"
        yield _problem("PID043", message, doc, ignore.span, "delete it", _without(ignore, set(unused), doc))
    if not ignore.reason:
        yield _problem(
            "PID046",
            f"no reason is given for ignoring {', '.join(ignore.codes)}",
            doc,
            ignore.span,
            "write the reason behind the bracket",
        )


def _unknown(code: str, doc: Document, ignore: _Ignore, *, near: bool) -> Diagnostic:
    """A code that no rule has: misspelt, or only the beginning of one."""
    if rules(code):
        return _problem("PID044", f"{code} is only the beginning of a code", doc, ignore.span, "write it in full")
    return _problem("PID044", f"no rule is called {code!r}", doc, ignore.span, suggestion(code) if near else LISTED)


def _without(ignore: _Ignore, unused: set[str], doc: Document) -> tuple[Edit, ...]:
    """The edit that takes the codes away: out of the bracket, or all but the reason, which may be worth keeping."""
    line, column = ignore.span.line, ignore.span.column
    row = doc.lines[line - 1]
    left = [code for code in ignore.codes if code not in unused]
    if left:
        start, end = row.index("[", column - 1) + 1, row.index("]", column - 1)
        return (Edit(Span(line, start + 1, line, end + 1), ", ".join(left)),)
    if not ignore.whole:
        return ()
    if ignore.reason:
        remark = f"# {ignore.reason}"
        return () if DIRECTIVE.search(remark) else (Edit(ignore.span, remark),)
    if ignore.comment.alone and line < len(doc.lines):
        return (Edit(Span(line, 1, line + 1, 1), ""),)
    return (Edit(Span(line, len(row[: column - 1].rstrip()) + 1, line, len(row) + 1), ""),)


def _problem(code: str, message: str, doc: Document, span: Span, cure: str, edits: tuple[Edit, ...] = ()) -> Diagnostic:
    return Diagnostic(code, Severity.WARNING, message, doc.file, span, reference=str(D315), help=cure, edits=edits)
