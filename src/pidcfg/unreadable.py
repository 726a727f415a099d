"""What bytes or lines that are no YAML seem to be, and how to cure them.

Bytes: other kinds of file by their first bytes, and UTF-16 with or without a mark. Lines: a blank that is not a space,
and a key that lines up with none of the keys above it, which the parser reports by what it had hoped for instead.
Nothing is read in spite of its faults.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.diagnostics import Span

if TYPE_CHECKING:
    from collections.abc import Sequence

SAVE_AS_UTF8 = "save the file as UTF-8"
EXPORT = "export it as text, or write the configuration as YAML"
MAGIC = (
    (b"PK\x03\x04", "an Excel or ZIP file", "save the sheet as CSV, or unpack the archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Excel or Word file", "save the sheet as CSV"),
    (b"%PDF-", "a PDF file", EXPORT),
    (b"\x1f\x8b", "a gzip file", "unpack it first"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip file", "unpack it first"),
    (b"\x89PNG", "a picture", EXPORT),
    (b"\xff\xd8\xff", "a picture", EXPORT),
    (b"SQLite format 3\x00", "a database", EXPORT),
)
"""Files that are not text: how they begin, what they are, and what to do."""
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
LOOKED_AT = 400
"""Bytes that tell UTF-16 without a mark: every other one of a text in letters, spaces and digits is 0."""

BLANKS = {
    "\N{NO-BREAK SPACE}": "a no-break space",
    "\N{NARROW NO-BREAK SPACE}": "a narrow no-break space",
    "\N{FIGURE SPACE}": "a figure space",
    "\N{THIN SPACE}": "a thin space",
    "\N{EN SPACE}": "an en space",
    "\N{EM SPACE}": "an em space",
    "\N{IDEOGRAPHIC SPACE}": "an ideographic space",
    "\N{ZERO WIDTH SPACE}": "a zero width space",
    "\N{ZERO WIDTH NO-BREAK SPACE}": "a byte order mark",
}
BLANK = re.compile("[" + "".join(BLANKS) + "]")
KEY_LINE = re.compile(r"(?P<dashes>[ ]*(?:- +)*)(?P<key>[\w.-]+)(?P<colon> *:(?: |$))")
HINTS = (
    ("mapping values are not allowed", "check the indentation; text that holds ': ' needs quotes"),
    ("could not find expected ':'", "every line of a mapping is 'key: value'; check the line above as well"),
    ("did not find expected key", "check the indentation of this line against the one above"),
    ("did not find expected ',' or", "a bracket that was opened above is not closed, or a comma is missing"),
    ("cannot start any token", "text that begins with this character needs quotes"),
    ("unexpected end of stream", "a quote that was opened above is not closed"),
)
"""What the parser says, and what helps."""
FAR = 3
"""Columns that a key may stand beside the one that it was to line up with."""


class Fault(NamedTuple):
    """What is wrong, where, and the cure."""

    message: str
    span: Span
    cure: str | None


def binary_file(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no text, with its cure; None where its first bytes say nothing."""
    return next((("the file is " + kind, cure) for begins, kind, cure in MAGIC if data.startswith(begins)), None)


def other_file(data: bytes) -> tuple[str, str] | None:
    """What a file is that is no UTF-8 text, with its cure; None where its first bytes say nothing."""
    if binary := binary_file(data):
        return f"{binary[0]}, not text", binary[1]
    if data[:2] in UTF16_MARKS or _is_unmarked_utf16(data[:LOOKED_AT]):
        return "the file is UTF-16, not UTF-8", SAVE_AS_UTF8
    return None


def _is_unmarked_utf16(head: bytes) -> bool:
    """Whether (nearly) every other byte is 0, and hardly one of the rest."""
    even, odd = head[::2], head[1::2]
    if len(odd) < 2:
        return False
    few, most = sorted((even.count(0) / len(even), odd.count(0) / len(odd)))
    return few < 0.1 and most > 0.6


def syntax_fault(lines: Sequence[str], problem: str, span: Span) -> Fault:
    """What the parser complained of, in words of somebody who writes the file."""
    fault = _odd_blank(lines, span.line) or _misplaced_key(lines, span.line)
    return fault or Fault(problem, span, next((hint for words, hint in HINTS if words in problem), None))


def _odd_blank(lines: Sequence[str], line: int) -> Fault | None:
    """The first blank in this line, or in the written one above it, that only looks like a space."""
    above = next((k for k in range(line - 1, 0, -1) if lines[k - 1].strip()), line)
    for number in (above, line):
        found = BLANK.search(_code(lines[number - 1]))
        if found:
            column = found.start() + 1
            message = f"U+{ord(found.group()):04X}, {BLANKS[found.group()]}, stands where a space belongs"
            return Fault(message, Span(number, column, number, column + 1), "replace it with a space")
    return None


def blank_in(text: str) -> str:
    """What to say of a blank in a text that only looks like a space; empty: there is none."""
    found = BLANK.search(text)
    return f": U+{ord(found.group()):04X} in it is {BLANKS[found.group()]}, not a space" if found else ""


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
