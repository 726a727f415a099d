"""YAML text to data plus positions; with ``writer`` the only module that knows ruamel.

The events of the C parser are walked with an explicit stack, never recursively, so that the depth of a hostile file
costs nothing, and every limit is checked per event. Scalars stay text: an unquoted one is a `Plain`, and what it means
is decided by the field it stands in, never by YAML's guess. The result is plain data beside a tree of `Node` objects of
the same shape that knows where everything is written; an alias shares the node of its anchor, so a finding points at
the text that has to be edited.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, NoReturn

from pidcfg.diagnostics import START, Diagnostic, Path, Severity, Span
from pidcfg.limits import DEFAULT, Limits

NULLS = frozenset({"", "~", "null", "Null", "NULL"})
LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
UNPRINTABLE = re.compile("[^\t\n\r\x20-\x7e\x85\xa0-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
UTF16_MARKS = (b"\xff\xfe", b"\xfe\xff")
SAVE_AS_UTF8 = "save the file as UTF-8"

HINTS = (
    ("mapping values are not allowed", "check the indentation; text that holds ': ' needs quotes"),
    ("could not find expected ':'", "every line of a mapping is 'key: value'; check the line above as well"),
    ("did not find expected key", "check the indentation of this line against the one above"),
    ("did not find expected ',' or", "a bracket that was opened above is not closed, or a comma is missing"),
    ("cannot start any token", "text that begins with this character needs quotes"),
    ("unexpected end of stream", "a quote that was opened above is not closed"),
)


class Plain(str):
    """An unquoted scalar as it is written: ``010`` stays ``010`` until a field reads it."""

    __slots__ = ()


class Node:
    """Where a value is written; children by key (with the key's place) or by index."""

    __slots__ = ("items", "keys", "size", "span")

    def __init__(self, span: Span) -> None:
        self.span = span
        self.size = 1
        self.keys: dict[str, tuple[Span, Node]] = {}
        self.items: list[Node] = []

    def child(self, step: str | int) -> tuple[Span, Node] | None:
        """The place of a key (an item: of its value) and the node below it; None when there is none."""
        if isinstance(step, str):
            return self.keys.get(step)
        if 0 <= step < len(self.items):
            return self.items[step].span, self.items[step]
        return None


@dataclass(frozen=True, slots=True)
class Document:
    """A file as read: data, positions and what was wrong with its text."""

    file: str
    text: str
    data: dict[str, Any] | None
    root: Node
    problems: tuple[Diagnostic, ...] = ()

    @property
    def lines(self) -> list[str]:
        """The text by lines, counted as the parser counts them."""
        return LINE_BREAK.split(self.text)

    def locate(self, path: Path, *, key: bool = False) -> Span:
        """Where the value at ``path`` is written (``key``: its key), or the closest ancestor that is in the file.

        An ancestor is pointed at by its key, since what is missing there has no place of its own.
        """
        node, key_span = self.root, START
        for step in path:
            found = node.child(step)
            if found is None:
                return key_span
            key_span, node = found
        return key_span if key or not path else node.span


class _Refused(Exception):
    """The text cannot be read any further."""

    def __init__(self, code: str, message: str, span: Span, cure: str | None = None) -> None:
        super().__init__(message)
        self.code, self.message, self.span, self.cure = code, message, span, cure


@dataclass(slots=True)
class _Open:
    """A mapping or sequence whose end has not come yet."""

    data: dict[str, Any] | list[Any]
    node: Node
    anchor: str | None
    key: str | None = None
    key_span: Span = START


@dataclass(slots=True)
class _Builder:
    """Events to data and nodes, with an explicit stack."""

    file: str
    limits: Limits
    stack: list[_Open] = field(default_factory=list)
    anchors: dict[str, tuple[Any, Node] | None] = field(default_factory=dict)
    duplicates: list[Diagnostic] = field(default_factory=list)
    result: tuple[Any, Node] | None = None
    nodes: int = 0
    aliases: int = 0
    documents: int = 0

    def take(self, event: Any) -> None:
        """One event of the parser."""
        getattr(self, f"on_{type(event).__name__}", self.ignore)(event)

    def ignore(self, event: Any) -> None:
        """Ends of the stream and of the document carry nothing."""

    def on_DocumentStartEvent(self, event: Any) -> None:  # noqa: N802 - named after ruamel's event
        """A second document, or a directive, is refused."""
        self.documents += 1
        if self.documents > 1:
            cure = "put each configuration into a file of its own"
            raise _Refused("PID007", "the file holds several YAML documents", _span(event), cure)
        if (event.version and tuple(event.version) != (1, 2)) or event.tags:
            raise _Refused("PID011", "YAML directives are not accepted", _span(event), "delete the line that begins with %")

    def on_AliasEvent(self, event: Any) -> None:  # noqa: N802
        """An alias shares what its anchor named; the expansion counts against the limits."""
        span = _span(event)
        self.aliases += 1
        self.check(self.aliases, self.limits.aliases, "aliases", span)
        if self.wants_key():
            raise _Refused("PID008", "an alias cannot be a key", span, "write the key itself")
        if event.anchor not in self.anchors:
            raise _Refused("PID012", f"the anchor &{event.anchor} is not defined above", span)
        found = self.anchors[event.anchor]
        if found is None:
            raise _Refused("PID012", f"the anchor &{event.anchor} contains itself", span, "write the values out")
        self.count(found[1].size, span)
        self.add(*found)

    def on_ScalarEvent(self, event: Any) -> None:  # noqa: N802
        """A key, or a value that stays text."""
        span, text = _span(event), event.value
        self.refuse_tag(event, span)
        if self.wants_key():
            self.take_key(text, span, plain=not event.style)
            return
        self.check(len(text.encode()), self.limits.scalar_bytes, "bytes in a value", span)
        self.count(1, span)
        value = (None if text in NULLS else Plain(text)) if not event.style else text
        node = Node(span)
        if event.anchor is not None:
            self.anchors[event.anchor] = (value, node)
        self.add(value, node)

    def on_MappingStartEvent(self, event: Any) -> None:  # noqa: N802
        """Opens a mapping."""
        self.open({}, event)

    def on_SequenceStartEvent(self, event: Any) -> None:  # noqa: N802
        """Opens a sequence."""
        self.open([], event)

    def on_MappingEndEvent(self, event: Any) -> None:  # noqa: N802
        """Closes a mapping or sequence and hands it to what holds it."""
        done = self.stack.pop()
        if done.anchor is not None:
            self.anchors[done.anchor] = (done.data, done.node)
        self.add(done.data, done.node)

    on_SequenceEndEvent = on_MappingEndEvent  # noqa: N815

    def open(self, data: dict[str, Any] | list[Any], event: Any) -> None:
        """Pushes a container that has begun."""
        span = _span(event)
        self.refuse_tag(event, span)
        if self.wants_key():
            raise _Refused("PID008", "a key must be plain text", span, "write 'key: value'")
        self.count(1, span)
        self.check(len(self.stack) + 1, self.limits.depth, "levels of nesting", span)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        self.stack.append(_Open(data, Node(span), event.anchor))

    def wants_key(self) -> bool:
        """Whether the next event is a key of the innermost mapping."""
        return bool(self.stack) and isinstance(self.stack[-1].data, dict) and self.stack[-1].key is None

    def take_key(self, text: str, span: Span, *, plain: bool) -> None:
        """Remembers a key for the value that follows."""
        top = self.stack[-1]
        if plain and text == "<<":
            raise _Refused("PID009", "merge keys (<<) are not accepted", span, "write the keys out, or alias a whole value")
        if plain and text in NULLS:
            raise _Refused("PID008", "a key is missing before the colon", span, "write 'key: value'")
        self.check(len(text.encode()), self.limits.key_bytes, "bytes in a key", span)
        first = top.node.keys.get(text)
        if first is not None:
            message = f"the key {text!r} stands here again; it was first given in line {first[0].line}"
            found = Diagnostic("PID004", Severity.ERROR, message, self.file, span, help="keep one of the two")
            self.duplicates.append(found)
        top.key, top.key_span = text, span

    def add(self, value: Any, node: Node) -> None:
        """Puts a finished value where it belongs."""
        if not self.stack:
            self.result = (value, node)
            return
        top = self.stack[-1]
        top.node.size += node.size
        if isinstance(top.data, list):
            top.data.append(value)
            top.node.items.append(node)
            return
        key = top.key or ""
        if key not in top.data:
            top.data[key] = value
            top.node.keys[key] = (top.key_span, node)
        top.key = None

    def refuse_tag(self, event: Any, span: Span) -> None:
        """Tags would let the file say what a value is; the field does that."""
        if event.tag is not None and event.tag != "!":
            raise _Refused("PID010", f"the tag {event.tag} is not accepted", span, "delete the tag; the key decides the type")

    def count(self, nodes: int, span: Span) -> None:
        """Counts values, aliases as what they expand to."""
        self.nodes += nodes
        self.check(self.nodes, self.limits.nodes, "values", span)

    def check(self, value: int, limit: int, what: str, span: Span) -> None:
        """Refuses the file when a limit is passed."""
        if value > limit:
            raise _Refused("PID013", f"more than {limit} {what}", span, "split the file, or raise the limit by option")


def _span(event: Any) -> Span:
    start, end = event.start_mark, event.end_mark
    return Span(start.line + 1, start.column + 1, end.line + 1, end.column + 1)


def read_document(data: bytes, file: str, limits: Limits = DEFAULT) -> Document:
    """The text of one file as a document; everything wrong with it is in ``problems``, nothing is raised."""
    text = ""
    try:
        text = _decode(data, limits)
        root, node, duplicates = _build(text, file, limits)
    except _Refused as e:
        problem = Diagnostic(e.code, Severity.ERROR, e.message, file, e.span, help=e.cure)
        return Document(file, text, None, Node(START), (problem,))
    return Document(file, text, root, node, tuple(duplicates))


def _decode(data: bytes, limits: Limits) -> str:
    """Bytes to text without a byte order mark."""
    if len(data) > limits.file_bytes:
        raise _Refused("PID013", f"the file is larger than {limits.file_bytes} bytes", START, "raise the limit by option")
    if data.startswith(UTF16_MARKS):
        raise _Refused("PID002", "the file is UTF-16, not UTF-8", START, SAVE_AS_UTF8)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        before = data[: e.start].decode("utf-8-sig", "replace")
        message = f"byte 0x{data[e.start]:02X} is not UTF-8"
        raise _Refused("PID002", message, _place(before), SAVE_AS_UTF8) from None
    found = UNPRINTABLE.search(text)
    if found:
        message = f"control character U+{ord(found.group()):04X}"
        raise _Refused("PID003", message, _place(text[: found.start()]), "delete the character")
    return text


def _place(before: str) -> Span:
    """The position that follows this text."""
    lines = LINE_BREAK.split(before)
    line, column = len(lines), len(lines[-1]) + 1
    return Span(line, column, line, column + 1)


def _build(text: str, file: str, limits: Limits) -> tuple[dict[str, Any], Node, list[Diagnostic]]:
    """Walks the events of the parser."""
    builder = _Builder(file, limits)
    for event in _events(text):
        builder.take(event)
    if builder.result is None or builder.result[0] is None:
        raise _Refused("PID005", "the file is empty", START, "'pidcfg init' writes a starter file")
    data, node = builder.result
    if not isinstance(data, dict):
        cure = "begin with the line 'pidcfg: 1'"
        raise _Refused("PID006", "the file must be a mapping of keys to values", node.span, cure)
    return data, node, builder.duplicates


def _events(text: str) -> Iterator[Any]:
    """The events of ruamel's parser; the pure one gives the same where the C extension is missing."""
    from ruamel.yaml import YAML
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    try:
        yield from YAML(typ="safe").parse(text)
    except MarkedYAMLError as e:
        _refuse_syntax(text, e)
    except YAMLError as e:
        raise _Refused("PID001", f"not YAML: {str(e).splitlines()[0]}", START) from None


def _refuse_syntax(text: str, error: Any) -> NoReturn:
    """The parser's complaint with a position and, where we know one, a cure."""
    mark = error.problem_mark or error.context_mark
    span = START if mark is None else Span(mark.line + 1, mark.column + 1, mark.line + 1, mark.column + 2)
    problem = str(error.problem or error.context or "not YAML").strip()
    lines = LINE_BREAK.split(text)
    line = lines[span.line - 1] if span.line <= len(lines) else ""
    if "\t" in line[: len(line) - len(line.lstrip())] or line[span.column - 1 : span.column] == "\t":
        raise _Refused("PID014", "a tab is used for indentation", span, "indent with spaces") from None
    cure = next((hint for words, hint in HINTS if words in problem), None)
    raise _Refused("PID001", f"not YAML: {problem}", span, cure) from None
