"""Corrections with a proof: texts are spliced, every other byte stays, and what was made is read again."""

from __future__ import annotations

import json
import re
from bisect import bisect_left, insort
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from typing import Any

from pidcfg.text.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.text.document import LINE_BREAK, Document, Plain, paths_sharing_text, span_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, has_key, set_value, value_at
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.validate.catalog import is_ignorable, is_unusable
from pidcfg.validate.rule import READING_RULES, SCHEMA_RULES
from pidcfg.validate.schema import QUOTES

# ----------------------------------------------------------------------------------------------------------------------
# Corrections with a proof: texts are spliced, every other byte stays, and what was made is read again and compared.
# A correction counts when the new text can be read, its data differ from the old in the corrected places alone, its
# finding has gone and none has come; otherwise it is not made.

MAX_ROUNDS = 10
"""A correction may uncover others; after so many rounds it is not going to end."""
MAX_ONE_BY_ONE = 50
"""Corrections that are tried alone when all together cannot be proven."""
D316 = Decision(
    316,
    "what --fix corrects",
    "Texts that pidcfg refuses although they can be read in one way only: a misspelt key (other capitals, hyphens "
    "or underscores, or one slip inside a word of at least five letters; never a key of another place or vendor) "
    "with one key clearly meant, not there yet, whose value is right for it; numbers and switches in quotes; yes, "
    "on, no and off as switches where no name can stand; 0x1F, 0b11, 1_000 and leading zeros that octal and decimal"
    " read alike (007) or that are no octal (08); words such as % that need quotes; addresses and words that differ"
    " in capitals, blanks or leading zeros (v2000, DS 0101); and what the error of a rule leaves one reading of (the "
    "name of another loop in other capitals). Comments that ignore nothing are deleted but for their"
    " reasons. What has two readings (010, 02000, 0x0180, C10 1) is never corrected, and no value of a "
    "configuration that pidcfg accepts is ever changed.",
    "A configuration that is refused drives no plant, so giving it its only reading changes none; anything else is a "
    "decision of the person who knows the plant.",
)

NO_VENDOR_CODES = {"PID031", "PID032"}
SCHEMA_CODES = {rule.code for rule in (*READING_RULES, *SCHEMA_RULES)} - NO_VENDOR_CODES
LAST_STAGE = 2
PLACEHOLDER = "x"
BOM = b"\xef\xbb\xbf"
_Position = tuple[int, int]
"""Line and column, from 1."""


@frozen
class FixedFile:
    """The bytes of a file after its corrections, the findings that were corrected, and those that are left."""

    data: bytes
    fixed: tuple[Diagnostic, ...]
    remaining: tuple[Diagnostic, ...]


def apply_edits(text: str, edits: Iterable[Edit]) -> str:
    """The text with every edit applied; of two that overlap, the first."""
    starts = [0, *(match.end() for match in LINE_BREAK.finditer(text))]
    parts, offset = [], 0
    for begin, end, new in sorted({(*_offsets(starts, edit.span), edit.text) for edit in edits}):
        if begin >= offset:
            parts += [text[offset:begin], new]
            offset = end
    return "".join([*parts, text[offset:]])


def _offsets(starts: Sequence[int], span: Span) -> tuple[int, int]:
    """A place as offsets into the text."""
    return starts[span.line - 1] + span.column - 1, starts[span.end_line - 1] + span.end_column - 1


# --- What an editor offers besides: a person looks at it and takes it -------------------------------------------------

D1032 = Decision(
    1032,
    "an editor offers the word that a cure asks for",
    "Where a cure is one word (`did you mean gain?`), one number (`write 1.5: …`) or two (`write 500 ms or 500 s`), a "
    "quick fix writes it in place of the one that the message names, if the finding then has gone. `--fix` leaves such "
    "findings alone (D316). A cure that says more, as of another unit, is not offered.",
    "A person who reads the message and picks its cure has decided; typing the word again decides nothing.",
)
NUMBER_FORM = r"(-?[0-9][^\s:,]*(?: [^\s:,]+)?)"
"""A number, or one with its unit."""
SUGGESTION = re.compile(rf"did you mean '?([^'?]+)'?\?|write {NUMBER_FORM}(?: or {NUMBER_FORM})?(?:: .*)?", re.DOTALL)
"""A cure that is one word, or one or two numbers."""
QUOTED_WORD = re.compile(r"'([^']+)'")


def suggest_edits(d: Diagnostic, doc: Document) -> list[Edit]:
    """The words that a finding asks for in place of the one that its message names (D1032)."""
    match = SUGGESTION.fullmatch(d.help or "")
    if match is None or d.span.line != d.span.end_line or d.file != doc.file:
        return []
    text_written = doc.lines[d.span.line - 1][d.span.column - 1 : d.span.end_column - 1]
    match_quoted = QUOTED_WORD.search(d.message)
    wrong_word = match_quoted[1] if match_quoted else text_written
    if not wrong_word or text_written.count(wrong_word) != 1 or wrong_word not in d.message:
        return []
    column = d.span.column + text_written.index(wrong_word)
    span = Span(d.span.line, column, d.span.line, column + len(wrong_word))
    return [Edit(span, word) for word in match.groups() if word]


# --- Round by round ---------------------------------------------------------------------------------------------------


@frozen
class _State:
    """A file at some point: its bytes, the document in them, and its findings."""

    data: bytes
    doc: Document
    findings: list[Diagnostic]


@frozen
class Fixer:
    """How files are read and checked, and which findings are to be corrected."""

    read: Callable[[bytes], Document]
    check: Callable[[Document], list[Diagnostic]]
    is_selected: Callable[[Diagnostic], bool]

    def fix(self, data: bytes) -> FixedFile:
        """Corrects a file, round by round until nothing is left to correct."""
        fixed_findings: list[Diagnostic] = []
        state = self._read_state(data)
        for _ in range(MAX_ROUNDS):
            new_state, fixed = self._run_round(state)
            if not fixed:
                break
            state = new_state
            fixed_findings += fixed
        return FixedFile(state.data, tuple(fixed_findings), tuple(state.findings))

    def _read_state(self, data: bytes) -> _State:
        doc = self.read(data)
        return _State(data, doc, self.check(doc))

    def _run_round(self, state: _State) -> tuple[_State, list[Diagnostic]]:
        """All corrections together, or those that can be proven one by one."""
        if state.doc.data is None:
            return self._fix_quotes(state)
        if any(map(is_unusable, state.findings)):
            return state, []
        candidates = list(separate_findings(d for d in state.findings if d.edits and self.is_selected(d)))
        new_state = self._try_corrections(state, candidates) if candidates else None
        if new_state is not None:
            return new_state, candidates
        best = state
        accepted: list[Diagnostic] = []
        for d in candidates[:MAX_ONE_BY_ONE] if len(candidates) > 1 else ():
            new_state = self._try_corrections(state, [*accepted, d])
            if new_state is not None:
                best, accepted = new_state, [*accepted, d]
        return best, accepted

    def _fix_quotes(self, state: _State) -> tuple[_State, list[Diagnostic]]:
        """A text that can be read once some words are quoted, and would say the same with any other word there."""
        fixed: list[Diagnostic] = []
        current, masked_text = state, state.doc.text
        while current.doc.data is None and len(fixed) < MAX_ONE_BY_ONE:
            edits = [edit for d in current.findings if self.is_selected(d) for edit in d.edits]
            if len(current.findings) != 1 or len(edits) != 1:
                return state, []
            fixed += current.findings
            masked_text = apply_edits(masked_text, [Edit(edits[0].span, PLACEHOLDER * len(edits[0].text))])
            current = self._read_state(self._encode_text(state, apply_edits(current.doc.text, edits)))
        replaced = self.read(masked_text.encode())
        if current.doc.data is None or not same_but_quotes(current.doc.data, replaced.data):
            return state, []
        return current, fixed

    @staticmethod
    def _encode_text(state: _State, text: str) -> bytes:
        """A text as bytes, with the byte order mark that the file had."""
        return (BOM if state.data.startswith(BOM) else b"") + text.encode()

    def _try_corrections(self, state: _State, fixed: list[Diagnostic]) -> _State | None:
        """The file with some corrections, if they can be proven."""
        if self._encode_text(state, state.doc.text) != state.data:
            return None
        text = apply_edits(state.doc.text, (edit for d in fixed for edit in d.edits))
        new_state = self._read_state(self._encode_text(state, text))
        return new_state if is_proven(state.doc, state.findings, fixed, new_state.doc, new_state.findings) else None


def separate_findings(findings: Iterable[Diagnostic]) -> Iterator[Diagnostic]:
    """The findings whose edits do not touch those of one before."""
    ranges = list[tuple[_Position, _Position]]()
    points = set[_Position]()
    for d in findings:
        ends = [((s.line, s.column), (s.end_line, s.end_column)) for s in (edit.span for edit in d.edits)]
        if not any(begin in points if begin == end else _has_overlap(ranges, begin, end) for begin, end in ends):
            for begin, end in ends:
                if begin == end:
                    points.add(begin)
                else:
                    insort(ranges, (begin, end))
            yield d


def _has_overlap(ranges: Sequence[tuple[_Position, _Position]], begin: _Position, end: _Position) -> bool:
    """Whether one of the stretches of a text, sorted and apart from each other, has a character of another one."""
    i = bisect_left(ranges, (begin, begin))
    return (i < len(ranges) and ranges[i][0] < end) or (i > 0 and begin < ranges[i - 1][1])


def is_proven(
    doc: Document,
    old_findings: Sequence[Diagnostic],
    fixed: Sequence[Diagnostic],
    new_doc: Document,
    new_findings: Sequence[Diagnostic],
) -> bool:
    """Whether a new text says what the old one said but for the corrections, and has no finding that is new.

    Where the error of a rule has gone, rules may warn of what the value now means, as of a cascade that is one again.
    """
    if new_doc.data is None or not same_data(new_doc.data, expected_data(doc, fixed)):
        return False
    keys_before, keys_after = (
        Counter(_finding_key(d) for d in old_findings),
        Counter(_finding_key(d) for d in new_findings),
    )
    keys_fixed = Counter(_finding_key(d) for d in fixed)
    if any(keys_after[key] > keys_before[key] - keys_fixed[key] for key in keys_fixed):
        return False
    stage_reached = min((_code_stage(d.code) for d in old_findings if not is_ignorable(d)), default=LAST_STAGE)
    may_warn = any(_code_stage(d.code) == LAST_STAGE and d.severity is Severity.ERROR for d in fixed)
    return all(
        number <= keys_before[key]
        or _code_stage(key[0]) > stage_reached
        or (may_warn and key[1] != Severity.ERROR.label)
        for key, number in keys_after.items()
    )


def _finding_key(d: Diagnostic) -> tuple[str, ...]:
    return (d.code, d.severity.label, d.where, d.message)


def _code_stage(code: str) -> int:
    """How far a file has come that has an error of this code: findings of later stages were not looked for."""
    return 0 if code in NO_VENDOR_CODES else 1 if code in SCHEMA_CODES else LAST_STAGE


def expected_data(doc: Document, fixed: Iterable[Diagnostic]) -> Any:
    """The data of a file after its corrections, worked out without reading the new text."""
    data = deepcopy(doc.data)
    for d in fixed:
        for path in paths_sharing_text(doc, d.path):
            parent = value_at(data, path[:-1])
            for edit in d.edits if path else ():
                if edit.span == doc.locate(path):
                    parent[path[-1]] = json.loads(edit.text) if edit.text.startswith('"') else Plain(edit.text)
                elif edit.span == doc.locate(path, key=True) and path[-1] in parent:
                    parent[edit.text.strip("'\"")] = parent.pop(path[-1])
    return data


def same_but_quotes(quoted: object, masked: object) -> bool:
    """Whether data are equal but for quoted words that have a placeholder as long as them and their quotes."""
    if type(masked) is Plain and set(masked) == {PLACEHOLDER} and type(quoted) is str:
        return len(masked) == len(quoted) + 2
    if isinstance(quoted, dict) and isinstance(masked, dict):
        return quoted.keys() == masked.keys() and all(
            same_but_quotes(value, masked[key]) for key, value in quoted.items()
        )
    if isinstance(quoted, list) and isinstance(masked, list):
        return len(quoted) == len(masked) and all(map(same_but_quotes, quoted, masked))
    return same_data(quoted, masked)


def same_data(one: Any, other: Any) -> bool:
    """Whether data are equal, where quoted and unquoted texts differ."""
    if type(one) is not type(other):
        return False
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same_data(value, other[key]) for key, value in one.items())
    if isinstance(one, list):
        return len(one) == len(other) and all(map(same_data, one, other))
    return bool(one == other)


# ----------------------------------------------------------------------------------------------------------------------
# Values put into a file at their places: texts are spliced, every other byte stays, and what was made is read again.
# A key that is missing goes behind the one that it follows, as that one is written: on a line of its own with the
# same indentation, or behind a comma within braces. Where the new text would say anything else besides (an alias
# stands for the whole section, an anchor is used elsewhere), nothing is made.

ALIAS_PATTERN = re.compile(r"[\"']?\s*:\s+(?P<name>\*[^\s,\[\]{}]+)")
"""What follows a key whose value is an alias."""
ANCHOR_PATTERN = re.compile(r"&[^\s,\[\]{}]+[ \t]+")


class PlacingError(ValueError):
    """A value that cannot be put at its place without changing something else: why, and the line."""

    def __init__(self, message: str, line: int) -> None:
        super().__init__(message)
        self.line = line


def replace_values(data: bytes, doc: Document, values: Mapping[Path, str], predecessors: Mapping[Path, Path]) -> bytes:
    """The bytes of a file with other texts at some paths; ``doc`` is that file as read.

    A text with a blank inside keeps the quotes that it had. ``predecessors``: the key that a missing one goes behind.
    Raises `PlacingError`.
    """
    expected = _copy_unshared(doc.data)
    edits: list[Edit] = []
    added_texts: dict[Path, str] = {}
    for path, text in values.items():
        if has_key(doc.data, path):
            place = _KeyPlace.find(doc, path)
            quote = place.quote if " " in text else ""
            edits.append(Edit(place.value, f"{quote}{text}{quote}"))
            set_value(expected, path, text if quote else Plain(text))
        else:
            neighbour = predecessors[path]
            sibling = _KeyPlace.find(doc, neighbour).sibling_text(doc, str(path[-1]), text)
            added_texts[neighbour] = added_texts.get(neighbour, "") + sibling
            set_value(expected, path, Plain(text))
    edits += [Edit(_KeyPlace.find(doc, key).end_span(doc), text) for key, text in added_texts.items()]
    byte_order_mark = BOM if data.startswith(BOM) else b""
    new_data = byte_order_mark + apply_edits(doc.text, edits).encode()
    new = read_document(new_data, doc.file)
    if (
        byte_order_mark + doc.text.encode() != data
        or new.data is None
        or not same_data(_copy_unshared(new.data), expected)
    ):
        line = doc.locate(next(iter(values))).line
        raise PlacingError("the file shares what stands there with other places, by a template or an anchor (&)", line)
    return new_data


def _copy_unshared(data: object) -> Any:
    """Data in which aliases share nothing."""
    if isinstance(data, dict):
        return {key: _copy_unshared(value) for key, value in data.items()}
    return [_copy_unshared(item) for item in data] if isinstance(data, list) else data


@frozen
class _KeyPlace:
    """Where a key and its value are written."""

    key: Span
    value: Span
    """Without an anchor; of an alias its name."""
    quote: str
    in_braces: bool

    @classmethod
    def find(cls, doc: Document, path: Path) -> _KeyPlace:
        """The place of a key that is in the file."""
        node, in_braces, key = doc.root, False, None
        for step in path:
            in_braces = bool(getattr(node.event, "flow_style", False))
            entry = node.child(step)
            if entry is None:
                raise KeyError(path)
            key, node = entry
        key_span, value = span_of(key), node.span
        row = doc.lines[key_span.end_line - 1]
        alias = ALIAS_PATTERN.match(row, key_span.end_column - 1)
        if alias is not None:
            value = Span(key_span.line, alias.start("name") + 1, key_span.line, alias.end("name") + 1)
        anchor = ANCHOR_PATTERN.match(doc.lines[value.line - 1], value.column - 1)
        if anchor is not None:
            value = Span(value.line, anchor.end() + 1, value.end_line, value.end_column)
        quote = doc.lines[value.line - 1][value.column - 1 : value.column]
        return cls(key_span, value, quote if quote in {*QUOTES} else "", in_braces)

    def sibling_text(self, doc: Document, key: str, text: str) -> str:
        """Another key with its value, to be put behind this one."""
        row = doc.lines[self.key.line - 1]
        key_quote = row[self.key.column - 1 : self.key.column]
        key = f"{key_quote}{key}{key_quote}" if key_quote in {*QUOTES} else key
        if self.in_braces:
            return f", {key}: {text}"
        return f"{find_line_break(doc.text)}{' ' * (self.key.column - 1)}{key}: {text}"

    def end_span(self, doc: Document) -> Span:
        """Where another key goes: behind the value within braces, else behind the line."""
        line = self.value.end_line
        column = self.value.end_column if self.in_braces else len(doc.lines[line - 1]) + 1
        return Span(line, column, line, column)


def find_line_break(text: str) -> str:
    """How lines of a file end: as its first one."""
    match = LINE_BREAK.search(text)
    return match.group() if match else "\n"
