"""Lines that are no YAML, in words of somebody who writes the file: where it is, what it is, and the cure."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from pidcfg.text.diagnostics import Span
from pidcfg.text.signs import BLANK, BLANKS, ascii_equivalent, code_point, to_ascii

# --- Lines that are no YAML, in words of somebody who writes the file: where it is, what it is, and the cure ----------
#
# The parser says what it had hoped for at the place where it gave up; the mistake mostly stands above. Nothing is
# read in spite of its faults.

KEY_LINE = re.compile(r"(?P<dashes>[ ]*(?:- +)*)(?P<key>[\w.-]+)(?P<colon> *:(?: |$))")
ALMOST_KEY = re.compile(
    r" *(?:- +)*(?:(?P<dash>-)(?=[^\W\d]))?(?P<key>\w[\w.-]*) *(?P<sign>[:=\N{FULLWIDTH COLON}]?) *(?P<value>.*)"
)
"""A line that seems to begin with a key."""
MERGE_MARK = re.compile(r"(?:<{7}|>{7})(?: |$)")
CLOSING_BRACKETS = {"{": "}", "[": "]"}
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
QUOTE = '"'
QUOTED_VALUE = re.compile(r" *(?:- +)*[\w.-]+: +(?P<quote>[\"'])(?P<text>.*)")
"""A value that begins with a quote."""
CLOSED_QUOTE = {"'": re.compile(r"(?:[^']|'')*'"), '"': re.compile(r'(?:[^"\\]|\\.)*"')}
"""What such a value is up to its end."""
FOREIGN_COMMENT = re.compile(r" *(?P<sign>//|\(\*|/\*|--(?= )|;)(?P<text>.*)")
"""A line that is a comment in other languages."""
TWO_DASHES = re.compile(r" *(?P<dashes>--+) *(?P<rest>[\w.-]+:(?: .*)?)$")
MAX_COLUMN_DISTANCE = 3
"""Columns that a key may stand beside the one that it was to line up with."""


class Fault(NamedTuple):
    """What is wrong, where, and the cure."""

    message: str
    span: Span
    cure: str | None


def span_of_mark(line: int, column: int, lines: Sequence[str]) -> Span:
    """The place of a mark of the parser, which counts from 0, and a line more where the last one has no end."""
    if line >= len(lines):
        return Span(len(lines), len(lines[-1]) + 1, len(lines), len(lines[-1]) + 2)
    return Span(line + 1, column + 1, line + 1, column + 2)


def syntax_fault(lines: Sequence[str], problem: str, span: Span, begin: Span | None = None) -> Fault:
    """What the parser complained of, in words of somebody who writes the file.

    ``begin``: where what it was reading begins, such as a bracket, a quote or the text that was to be a key.
    """
    fault = (
        _merge_marks(lines)
        or _odd_blank(lines, span.line)
        or _open_quote(lines, span.line)
        or _two_dashes(lines, span.line)
        or _foreign_comment(lines, span.line)
        or _text_behind_bracket(lines, span)
        or _yaml_sign_fault(lines, problem, span)
        or _bracket_fault(lines, problem, span, begin)
        or _missing_colon(lines, problem, begin)
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


def _nearby_lines(lines: Sequence[str], line: int) -> tuple[int, int]:
    """The written line above a line, and itself: the parser often complains of the next one."""
    return next((k for k in range(line - 1, 0, -1) if lines[k - 1].strip()), line), line


def _odd_blank(lines: Sequence[str], line: int) -> Fault | None:
    """The first blank in this line, or in the written one above it, that only looks like a space."""
    for number in _nearby_lines(lines, line):
        match = BLANK.search(_without_comment(lines[number - 1]))
        if match:
            message = f"{code_point(match.group())}, {BLANKS[match.group()]}, stands where a space belongs"
            return Fault(message, _sign_span(number, match.start()), "replace it with a space")
    return None


def _open_quote(lines: Sequence[str], line: int) -> Fault | None:
    """A value in this line or above it that begins with a quote which does not end in its line."""
    for number in range(1, line + 1):
        match, next_line = QUOTED_VALUE.match(lines[number - 1]), "".join(lines[number : number + 1])
        if (
            match
            and not CLOSED_QUOTE[match["quote"]].match(match["text"])
            and (KEY_LINE.match(next_line) or not next_line.strip())
        ):
            quote, at = match["quote"], match.start("quote")
            cure = f"write {quote} at the end of the text"
            if quote == "'" and '"' not in match["text"]:
                cure += f', or put it into double quotes where the apostrophe is a part of it: "{quote}{match["text"]}"'
            return Fault(f"the quote {quote} that opens here is not closed", _sign_span(number, at), cure)
    return None


def _foreign_comment(lines: Sequence[str], line: int) -> Fault | None:
    """The comment of another language in this line, or in the written one above it."""
    for number in _nearby_lines(lines, line):
        match = FOREIGN_COMMENT.match(lines[number - 1])
        if match:
            sign, at = match["sign"], match.start("sign")
            text = match["text"].removesuffix({"(*": "*)", "/*": "*/"}.get(sign, "")).strip()
            return Fault(f"{sign} begins no comment", Span(number, at + 1, number, at + 3), f"write '# {text}'")
    return None


def _two_dashes(lines: Sequence[str], line: int) -> Fault | None:
    """Two dashes where an item begins with one, in this line or the written one above it."""
    for number in _nearby_lines(lines, line):
        match = TWO_DASHES.match(lines[number - 1])
        if match:
            at = match.start("dashes")
            cure = f"write '- {match['rest']}'"
            return Fault("an item begins with one dash", Span(number, at + 1, number, match.end("dashes") + 1), cure)
    return None


def _text_behind_bracket(lines: Sequence[str], span: Span) -> Fault | None:
    """Text behind what a bracket has closed: a unit, a comma, the rest of a sentence."""
    line = _without_comment(lines[span.line - 1]).rstrip()
    head, tail = line[: span.column - 1].rstrip(), line[span.column - 1 :]
    if not tail or head[-1:] not in CLOSING_BRACKETS.values() or tail[0] in "}],#":
        is_comma = tail == "," and head[-1:] in CLOSING_BRACKETS.values()
        return Fault("a comma stands behind the end of a value", span, "take it away") if is_comma else None
    behind = re.match(r"[^,}\]]*", tail)
    text = behind[0].strip() if behind else ""
    if not text or ":" in text:
        return None
    key_line = KEY_LINE.match(line)
    value = line[key_line.end() :] if key_line else ""
    cure = "take it away; a unit stands in 'unit', or behind one number"
    if key_line and key_line["key"] in {"name", "description", "unit"}:
        cure = f'write {key_line["key"]}: "{value}"'
    place = Span(span.line, span.column, span.line, span.column + len(text))
    return Fault(f"{text!r} stands behind the closing {head[-1]}", place, cure)


def _yaml_sign_fault(lines: Sequence[str], problem: str, span: Span) -> Fault | None:
    """A text that begins with, or has in it, what is a sign of YAML."""
    line = _without_comment(lines[span.line - 1]).rstrip()
    key_line = KEY_LINE.match(line)
    if key_line is None:
        return None
    value = line[key_line.end() :].strip()
    if "unknown escape character" in problem:
        cure = f"write {key_line['key']}: '{value.strip(QUOTE)}' in single quotes, or \\\\ for \\"
        return Fault("a backslash in double quotes begins a special character", span, cure)
    if value[:1] in {"|", ">", "?"} and ("comment or line break" in problem or "mapping keys" in problem):
        cure = f'write {key_line["key"]}: "{value}"'
        if value == "?":
            cure = f"write the value of {key_line['key']}, or leave the key out"
        place = _sign_span(span.line, line.index(value, key_line.end()))
        return Fault(f"a text without quotes cannot begin with {value[0]}", place, cure)
    return None


def _bracket_fault(lines: Sequence[str], problem: str, span: Span, begin: Span | None) -> Fault | None:
    """What is wrong between brackets and quotes: one that is not closed, another sign for a comma, one too many."""
    char = lines[span.line - 1][span.column - 1 : span.column]
    if problem == "found unexpected ':'":
        return _missing_space(lines[span.line - 1], span.line, span.column - 1)
    if char and char in CLOSING_BRACKETS.values() and "',' or" not in problem:
        return Fault(f"nothing is open that this {char} could close", span, "take it away, or open it above")
    opening = lines[begin.line - 1][begin.column - 1 : begin.column] if begin else ""
    if begin and opening in CLOSING_BRACKETS and "',' or" in problem:
        if (at := _other_comma(lines[span.line - 1][: span.column])) is not None:
            sign = lines[span.line - 1][at]
            return Fault(
                f"{sign!r} stands where a comma belongs", _sign_span(span.line, at), "write a comma and a space"
            )
        place = f"the {opening} of line {begin.line}, column {begin.column} is still open"
        cure = f"write a comma before this, or {CLOSING_BRACKETS[opening]} where what the {opening} opens ends"
        return Fault(f"a comma or the closing {CLOSING_BRACKETS[opening]} is missing: {place}", span, cure)
    if begin and opening in QUOTES and "end of stream" in problem:
        cure = f"write {opening} at the end of the text"
        return Fault(f"the quote {opening} that opens here is not closed", begin, cure)
    return None


def _other_comma(line: str) -> int | None:
    """Where the last sign of a line stands that is taken for a comma."""
    return next((at for at in range(len(line) - 1, -1, -1) if line[at] == ";" or _is_wide(line[at], ",")), None)


def _is_wide(sign: str, ascii_sign: str) -> bool:
    return sign != ascii_sign and ascii_equivalent(sign) == ascii_sign


def _missing_colon(lines: Sequence[str], problem: str, begin: Span | None) -> Fault | None:
    """A line that was to be ``key: value`` without a colon, with another sign for it, or with no space behind it."""
    if begin is None or "could not find expected ':'" not in problem:
        return None
    line = _without_comment(lines[begin.line - 1]).rstrip()
    match = ALMOST_KEY.match(line)
    if match is None:
        return None
    offset, sign = match.start("sign"), match["sign"]
    if sign == ":":
        return _missing_space(line, begin.line, offset)
    cure = f"write '{match['key']}: {match['value'].removeprefix('-> ') or '…'}'"
    if sign:
        return Fault(f"{sign!r} stands where a colon belongs", _sign_span(begin.line, offset), cure)
    if match["dash"]:
        dash = match.start("dash")
        return Fault("no space stands behind the dash", _sign_span(begin.line, dash), f"write '- {line[dash + 1 :]}'")
    return Fault("no colon stands behind the key", Span(begin.line, begin.column, begin.line, len(line) + 1), cure)


def _colon_in_text(lines: Sequence[str], problem: str, span: Span) -> Fault | None:
    """A value without quotes that has a colon and a space in it."""
    line = _without_comment(lines[span.line - 1]).rstrip()
    key_line = KEY_LINE.match(line)
    value = line[key_line.end() :].strip() if key_line else ""
    if key_line is None or "mapping values are not allowed" not in problem or ": " not in value or value[0] in "{[\"'":
        return None
    cure = f'write {key_line["key"]}: "{to_ascii(value)}"'
    if value[0] == "(" and value[-1] == ")":
        cure = f"write {key_line['key']}: {{{value[1:-1]}}}"
    return Fault("a colon and a space stand in a text without quotes", span, cure)


def _missing_space(line: str, number: int, offset: int) -> Fault:
    """A colon with its value directly behind it."""
    before, after = re.search(r"[\w.-]* *$", line[:offset]), re.match(r"[^,\]}\s]*", line[offset + 1 :])
    key, value = before[0].strip() if before else "", after[0] if after else ""
    if value == "=":
        place, cure = Span(number, offset + 1, number, offset + 3), f"write '{key}: {line[offset + 2 :].strip()}'"
        return Fault("':=' stands where a colon belongs", place, cure)
    if value.startswith(":"):
        cure = f"write one colon and a space: '{key}: …'"
        return Fault("two colons stand behind the key", _sign_span(number, offset + 1), cure)
    if key.isdecimal() and value:
        cure = f'a duration carries a unit, as in 90 min; a text with a colon stands in quotes: "{key}:{value}"'
        return Fault(f"a colon stands inside the value '{key}:{value}'", _sign_span(number, offset), cure)
    if key and not value:
        cure = f"write '{key}: …' with its value, or leave the key out"
        return Fault(f"no value stands behind '{key}:'", _sign_span(number, offset), cure)
    shown = "…" if value.startswith(("[", "{", '"', "'")) else value  # it may end anywhere
    return Fault("no space stands behind the colon", _sign_span(number, offset), f"write '{key}: {shown}'")


def _sign_span(number: int, offset: int) -> Span:
    """The place of one sign, whose offset is counted from 0."""
    return Span(number, offset + 1, number, offset + 2)


def _without_comment(line: str) -> str:
    """A line without its comment."""
    return re.sub(r"(?:^|(?<=\s))#.*", "", line)


def _misplaced_key(lines: Sequence[str], line: int) -> Fault | None:
    """A key in this line that stands beside the column of the keys that it seems to belong to."""
    key_line = KEY_LINE.match(lines[line - 1])
    if key_line is None:
        return None
    column = len(key_line["dashes"]) + 1
    open_keys = _open_keys(lines, line)
    if any(column == other for other, _, _ in open_keys):
        return None
    place = Span(line, column, line, column + len(key_line["key"]))
    left = next((row for row in open_keys if row[0] < column), None)
    right = next((row for row in reversed(open_keys) if row[0] > column), None)
    if left and right:
        between = " and ".join(f"{key!r} (line {number}, column {other})" for other, key, number in (left, right))
        return Fault(
            f"{key_line['key']!r} begins in column {column}, between {between}", place, "line it up with one of them"
        )
    nearest = left or right
    if nearest is None or abs(nearest[0] - column) > MAX_COLUMN_DISTANCE:
        return None
    other, key, number = nearest
    if key.startswith("-"):
        text = lines[number - 1].strip().removeprefix("-")
        return Fault("no space stands behind the dash", _sign_span(number, other - 1), f"write '- {text}'")
    step = f"{abs(other - column)} space{'s' * (abs(other - column) > 1)}"
    cure = f"line them up: {f'add {step}' if other > column else f'take {step} away'} here, or move the other"
    message = f"{key_line['key']!r} begins in column {column}, {key!r} of line {number} in column {other}"
    return Fault(message, place, cure)


def _open_keys(lines: Sequence[str], line: int) -> list[tuple[int, str, int]]:
    """Keys above a line that it may stand beside or below: column, name and line, the innermost first."""
    keys: list[tuple[int, str, int]] = []
    min_column = None
    for number in range(line - 1, 0, -1):
        match = KEY_LINE.match(lines[number - 1])
        if match is None:
            continue
        column = len(match["dashes"]) + 1
        if min_column is None or column < min_column:
            keys.append((column, match["key"], number))
            min_column = column if "-" not in match["dashes"] else len(match["dashes"].partition("-")[0]) + 1
        if min_column == 1:
            break
    return keys
