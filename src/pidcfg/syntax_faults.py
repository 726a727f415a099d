"""Lines that are no YAML, in words of somebody who writes the file: where it is, what it is, and the cure.

The parser says what it had hoped for at the place where it gave up; the mistake mostly stands above. Nothing is read in
spite of its faults.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.diagnostics import Span
from pidcfg.odd_signs import BLANK, BLANKS, code, meant, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

KEY_LINE = re.compile(r"(?P<dashes>[ ]*(?:- +)*)(?P<key>[\w.-]+)(?P<colon> *:(?: |$))")
ALMOST_KEY = re.compile(
    r" *(?:- +)*(?:(?P<dash>-)(?=[^\W\d]))?(?P<key>\w[\w.-]*) *(?P<sign>[:=\N{FULLWIDTH COLON}]?) *(?P<value>.*)"
)
"""A line that seems to begin with a key."""
MERGE_MARK = re.compile(r"(?:<{7}|>{7})(?: |$)")
CLOSING = {"{": "}", "[": "]"}
QUOTES = {"'", '"'}
HINTS = (
    ("mapping values are not allowed", "check the indentation; text that holds ': ' needs quotes"),
    ("could not find expected ':'", "every line of a mapping is 'key: value'; check the line above as well"),
    ("did not find expected key", "check the indentation of this line against the one above"),
    ("cannot start any token", "text that begins with this character needs quotes"),
    ("unexpected end of stream", "a quote that was opened above is not closed"),
    ("expected node content", "a value or a closing bracket is missing here"),
    ("expected <document start>", "every line is 'key: value'; begin with 'pidcfg: 1'"),
)
"""What the parser says, and what helps."""
FAR = 3
"""Columns that a key may stand beside the one that it was to line up with."""


class Fault(NamedTuple):
    """What is wrong, where, and the cure."""

    message: str
    span: Span
    cure: str | None


def place_of(mark: Any, lines: Sequence[str]) -> Span:
    """The place of a mark of the parser, which counts a line more where the last one has no end."""
    if mark.line >= len(lines):
        return Span(len(lines), len(lines[-1]) + 1, len(lines), len(lines[-1]) + 2)
    return Span(mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)


def syntax_fault(lines: Sequence[str], problem: str, span: Span, begin: Span | None = None) -> Fault:
    """What the parser complained of, in words of somebody who writes the file.

    ``begin``: where what it was reading begins, such as a bracket, a quote or the text that was to be a key.
    """
    fault = (
        _merge_marks(lines)
        or _odd_blank(lines, span.line)
        or _bracket(lines, problem, span, begin)
        or _no_colon(lines, problem, begin)
        or _misplaced_key(lines, span.line)
        or _colon_in_text(lines, problem, span)
    )
    return fault or Fault(problem, span, next((hint for words, hint in HINTS if words in problem), None))


def _merge_marks(lines: Sequence[str]) -> Fault | None:
    """The marks of a version control system around two versions of some lines."""
    number = next((n for n, line in enumerate(lines, 1) if MERGE_MARK.match(line)), None)
    if number is None:
        return None
    cure = "keep one of the two versions, and delete the lines of <<<<<<<, ======= and >>>>>>>"
    return Fault("two versions that were not merged stand here", Span(number, 1, number, 8), cure)


def _odd_blank(lines: Sequence[str], line: int) -> Fault | None:
    """The first blank in this line, or in the written one above it, that only looks like a space."""
    above = next((k for k in range(line - 1, 0, -1) if lines[k - 1].strip()), line)
    for number in (above, line):
        found = BLANK.search(_code(lines[number - 1]))
        if found:
            message = f"{code(found.group())}, {BLANKS[found.group()]}, stands where a space belongs"
            return Fault(message, _sign(number, found.start()), "replace it with a space")
    return None


def _bracket(lines: Sequence[str], problem: str, span: Span, begin: Span | None) -> Fault | None:
    """What is wrong between brackets and quotes: one that is not closed, another sign for a comma, one too many."""
    here = lines[span.line - 1][span.column - 1 : span.column]
    if problem == "found unexpected ':'":
        return _no_space(lines[span.line - 1], span.line, span.column - 1)
    if here and here in CLOSING.values() and "',' or" not in problem:
        return Fault(f"nothing is open that this {here} could close", span, "take it away, or open it above")
    opening = lines[begin.line - 1][begin.column - 1 : begin.column] if begin else ""
    if begin and opening in CLOSING and "',' or" in problem:
        if (at := _other_comma(lines[span.line - 1][: span.column])) is not None:
            sign = lines[span.line - 1][at]
            return Fault(f"{sign!r} stands where a comma belongs", _sign(span.line, at), "write a comma and a space")
        place = f"the {opening} of line {begin.line}, column {begin.column} is still open"
        cure = f"write a comma before this, or {CLOSING[opening]} where what the {opening} opens ends"
        return Fault(f"a comma or the closing {CLOSING[opening]} is missing: {place}", span, cure)
    if begin and opening in QUOTES and "end of stream" in problem:
        cure = f"write {opening} at the end of the text"
        return Fault(f"the quote {opening} that opens here is not closed", begin, cure)
    return None


def _other_comma(line: str) -> int | None:
    """Where the last sign of a line stands that is taken for a comma."""
    return next((at for at in range(len(line) - 1, -1, -1) if line[at] == ";" or _is_wide(line[at], ",")), None)


def _is_wide(sign: str, ascii_sign: str) -> bool:
    return sign != ascii_sign and meant(sign) == ascii_sign


def _no_colon(lines: Sequence[str], problem: str, begin: Span | None) -> Fault | None:
    """A line that was to be ``key: value`` without a colon, with another sign for it, or with no space behind it."""
    if begin is None or "could not find expected ':'" not in problem:
        return None
    line = _code(lines[begin.line - 1]).rstrip()
    match = ALMOST_KEY.match(line)
    if match is None:
        return None
    at, sign = match.start("sign"), match["sign"]
    if sign == ":":
        return _no_space(line, begin.line, at)
    cure = f"write '{match['key']}: {match['value'] or '…'}'"
    if sign:
        return Fault(f"{sign!r} stands where a colon belongs", _sign(begin.line, at), cure)
    if match["dash"]:
        dash = match.start("dash")
        return Fault("no space stands behind the dash", _sign(begin.line, dash), f"write '- {line[dash + 1 :]}'")
    return Fault("no colon stands behind the key", Span(begin.line, begin.column, begin.line, len(line) + 1), cure)


def _colon_in_text(lines: Sequence[str], problem: str, span: Span) -> Fault | None:
    """A value without quotes that has a colon and a space in it."""
    line = _code(lines[span.line - 1]).rstrip()
    here = KEY_LINE.match(line)
    value = line[here.end() :].strip() if here else ""
    if here is None or "mapping values are not allowed" not in problem or ": " not in value or value[0] in "{[\"'":
        return None
    cure = f'write {here["key"]}: "{plain(value)}"'
    return Fault("a colon and a space stand in a text without quotes", span, cure)


def _no_space(line: str, number: int, at: int) -> Fault:
    """A colon with its value directly behind it."""
    before, after = re.search(r"[\w.-]*$", line[:at]), re.match(r"[^,\]}\s]*", line[at + 1 :])
    cure = f"write '{before[0]}: {after[0]}'" if before and after else None
    return Fault("no space stands behind the colon", _sign(number, at), cure)


def _sign(number: int, at: int) -> Span:
    """The place of one sign, whose offset is counted from 0."""
    return Span(number, at + 1, number, at + 2)


def _code(line: str) -> str:
    """A line without its comment."""
    return re.sub(r"(?:^|(?<=\s))#.*", "", line)


def _misplaced_key(lines: Sequence[str], line: int) -> Fault | None:
    """A key in this line that stands beside the column of the keys that it seems to belong to."""
    here = KEY_LINE.match(lines[line - 1])
    if here is None:
        return None
    column = len(here["dashes"]) + 1
    open_keys = _open_keys(lines, line)
    if any(column == other for other, _, _ in open_keys):
        return None
    place = Span(line, column, line, column + len(here["key"]))
    left = next((row for row in open_keys if row[0] < column), None)
    right = next((row for row in reversed(open_keys) if row[0] > column), None)
    if left and right:
        between = " and ".join(f"{key!r} (line {number}, column {other})" for other, key, number in (left, right))
        return Fault(
            f"{here['key']!r} begins in column {column}, between {between}", place, "line it up with one of them"
        )
    nearest = left or right
    if nearest is None or abs(nearest[0] - column) > FAR:
        return None
    other, key, number = nearest
    if key.startswith("-"):
        text = lines[number - 1].strip().removeprefix("-")
        return Fault("no space stands behind the dash", _sign(number, other - 1), f"write '- {text}'")
    step = f"{abs(other - column)} space{'s' * (abs(other - column) > 1)}"
    cure = f"line them up: {f'add {step}' if other > column else f'take {step} away'} here, or move the other"
    message = f"{here['key']!r} begins in column {column}, {key!r} of line {number} in column {other}"
    return Fault(message, place, cure)


def _open_keys(lines: Sequence[str], line: int) -> list[tuple[int, str, int]]:
    """Keys above a line that it may stand beside or below: column, name and line, the innermost first."""
    found: list[tuple[int, str, int]] = []
    narrowest = None
    for number in range(line - 1, 0, -1):
        match = KEY_LINE.match(lines[number - 1])
        if match is None:
            continue
        column = len(match["dashes"]) + 1
        if narrowest is None or column < narrowest:
            found.append((column, match["key"], number))
            narrowest = column if "-" not in match["dashes"] else len(match["dashes"].partition("-")[0]) + 1
        if narrowest == 1:
            break
    return found
