"""YAML text to data plus positions: the reader, its faults in plain words, comments and aliases."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import defaultdict
from dataclasses import dataclass, field, fields
from threading import local
from typing import TYPE_CHECKING, Any, NamedTuple, NoReturn

from pidcfg.text.diagnostics import START, Diagnostic, Severity, Span
from pidcfg.text.document import LINE_BREAK, Document, Node, Plain, resolve_templates, span_of, start_of
from pidcfg.text.reader import DEFAULT, Limits
from pidcfg.text.signs import SAVE_AS_UTF8, describe_non_utf8

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from ruamel.yaml.error import MarkedYAMLError
    from ruamel.yaml.events import AliasEvent, CollectionStartEvent, ScalarEvent

    from pidcfg.text.document import Event
    from pidcfg.text.paths import Data, Path

# --- YAML text to data plus positions; with ``writer`` the only module that knows ruamel ------------------------------
#
# The events of the C parser are walked with an explicit stack, never recursively, so that the depth of a hostile file
# costs nothing, and every limit is checked per event. Scalars stay text: an unquoted one is a `Plain`, and what it
# means is decided by the field it stands in, never by YAML's guess. The result is plain data beside a tree of `Node`
# objects of the same shape that knows where everything is written; an alias shares the node of its anchor, so a
# finding points at the text that has to be edited.

__all__ = ["Document", "Node", "Plain", "read_document"]

NULL_TEXTS = frozenset({"", "~", "null", "Null", "NULL"})
NON_KEY_TEXTS = NULL_TEXTS | {"<<"}
UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x84\x86-\x9f\ud800-\udfff\ufffe\uffff]")
"""What YAML 1.2 calls not printable, listed rather than negated: that compiles seven times as fast."""
THREAD_DATA = local()


class _RefusedError(Exception):
    """The text cannot be read any further."""

    def __init__(self, code: str, message: str, span: Span, cure: str | None = None) -> None:
        super().__init__(message)
        self.code, self.message, self.span, self.cure = code, message, span, cure


class _Container:
    """A mapping or sequence whose end has not come yet; ``key`` is the event of the key that waits for its value."""

    __slots__ = ("anchor", "data", "key", "node")

    def __init__(self, data: Data | list[object], node: Node, anchor: str | None) -> None:
        self.data = data
        self.node = node
        self.anchor = anchor
        self.key: Any = None


class _Builder:
    """Events to data and nodes, with an explicit stack."""

    def __init__(self, file: str, limits: Limits) -> None:
        self.file = file
        self.limits = limits
        # A character has at most four bytes, so shorter text need not be measured.
        self.unchecked_length = min(limits.scalar_bytes, limits.key_bytes) // 4
        self.stack: list[_Container] = []
        self.anchors: dict[str, tuple[object, Node] | None] = {}
        self.duplicates: list[Diagnostic] = []
        self.result: tuple[object, Node] | None = None
        self.nodes = 0
        self.aliases = 0
        self.documents = 0

    def begin_document(self, event: Any) -> None:
        """A second document, or a directive, is refused."""
        self.documents += 1
        if self.documents > 1:
            cure = "put each configuration into a file of its own"
            raise _RefusedError("PID007", "the file holds several YAML documents", span_of(event), cure)
        if (event.version and tuple(event.version) != (1, 2)) or event.tags:
            cure = "delete the line that begins with %"
            raise _RefusedError("PID011", "YAML directives are not accepted", span_of(event), cure)

    def add_alias(self, event: AliasEvent) -> None:
        """An alias shares what its anchor named; the expansion counts against the limits."""
        self.aliases += 1
        self.check_limit(self.aliases, self.limits.aliases, "aliases", event)
        if self.wants_key():
            raise _RefusedError("PID008", "an alias cannot be a key", span_of(event), "write the key itself")
        if event.anchor not in self.anchors:
            cure = f"write the value out, or &{event.anchor} before the one above that is meant, or quote a text"
            raise _RefusedError("PID012", f"the anchor &{event.anchor} is not defined above", span_of(event), cure)
        target = self.anchors[event.anchor]
        if target is None:
            message = f"the anchor &{event.anchor} contains itself"
            raise _RefusedError("PID012", message, span_of(event), "write the values out")
        self.nodes += target[1].size
        self.check_limit(self.nodes, self.limits.nodes, "values", event)
        self.check_limit(len(self.stack) + target[1].levels, self.limits.depth, "levels of nesting", event)
        self.add(*target)

    def add_scalar(self, event: ScalarEvent) -> None:
        """A key, or a value that stays text."""
        if event.tag is not None:
            self.refuse_tag(event)
        if self.wants_key():
            self.take_key(event)
            return
        text: str = event.value
        value = text if event.style else None if text in NULL_TEXTS else Plain(text)
        if len(text) > self.unchecked_length:
            self.check_limit(len(text.encode()), self.limits.scalar_bytes, "bytes in a value", event)
        self.nodes += 1
        if self.nodes > self.limits.nodes:
            self.check_limit(self.nodes, self.limits.nodes, "values", event)
        node = Node(event)
        if event.anchor is not None:
            self.anchors[event.anchor] = (value, node)
        self.add(value, node)

    def open_container(self, event: CollectionStartEvent, data: Data | list[object], node: Node) -> None:
        """Pushes a container that has begun."""
        self.refuse_tag(event)
        if self.wants_key():
            raise _RefusedError("PID008", "a key must be plain text", span_of(event), "write 'key: value'")
        self.nodes += 1
        self.check_limit(self.nodes, self.limits.nodes, "values", event)
        self.check_limit(len(self.stack) + 1, self.limits.depth, "levels of nesting", event)
        if event.anchor is not None:
            self.anchors[event.anchor] = None
        self.stack.append(_Container(data, node, event.anchor))

    def close(self) -> None:
        """Closes a mapping or sequence and hands it to what holds it."""
        container = self.stack.pop()
        if container.anchor is not None:
            self.anchors[container.anchor] = (container.data, container.node)
        self.add(container.data, container.node)

    def wants_key(self) -> bool:
        """Whether the next event is a key of the innermost mapping."""
        if not self.stack:
            return False
        top = self.stack[-1]
        return top.key is None and top.data.__class__ is dict

    def take_key(self, event: ScalarEvent) -> None:
        """Remembers a key for the value that follows."""
        text: str = event.value
        top = self.stack[-1]
        if text in NON_KEY_TEXTS and not event.style:
            if text == "<<":
                cure = "write the keys out, or alias a whole value"
                raise _RefusedError("PID009", "merge keys (<<) are not accepted", span_of(event), cure)
            raise _RefusedError("PID008", "a key is missing before the colon", span_of(event), "write 'key: value'")
        if len(text) > self.unchecked_length:
            self.check_limit(len(text.encode()), self.limits.key_bytes, "bytes in a key", event)
        if text in top.data:
            first = top.node.child(text)
            line = span_of(first[0]).line if first else 0
            message = f"the key {text!r} stands here again; it was first given in line {line}"
            place, cure = span_of(event), "keep one of the two"
            self.duplicates.append(Diagnostic("PID004", Severity.ERROR, message, self.file, place, help=cure))
        top.key = event

    def add(self, value: object, node: Node) -> None:
        """Puts a finished value where it belongs."""
        if not self.stack:
            self.result = (value, node)
            return
        top = self.stack[-1]
        data: Any = top.data
        children: Any = top.node.children
        top.node.size += node.size
        if data.__class__ is list:
            data.append(value)
            children.append(node)
            return
        key: str = top.key.value
        if key not in data:
            data[key] = value
            children[key] = (top.key, node)
        top.key = None

    def refuse_tag(self, event: CollectionStartEvent | ScalarEvent) -> None:
        """Tags would let the file say what a value is; the field does that."""
        if event.tag is not None and event.tag != "!":
            cure = "delete the tag, the key decides the type; put a text that begins with ! in quotes"
            raise _RefusedError("PID010", f"the tag {event.tag} is not accepted", span_of(event), cure)

    def check_limit(self, value: int, limit: int, unit: str, event: Event) -> None:
        """Refuses the file when a limit is passed."""
        if value > limit:
            cure = "split the file, or raise the limit by option"
            raise _RefusedError("PID013", f"more than {limit} {unit}", span_of(event), cure)


def read_document(data: bytes, file: str, limits: Limits = DEFAULT) -> Document:
    """The text of one file as a document; everything wrong with it is in ``problems``, nothing is raised."""
    if other := describe_non_utf8(data):  # a file that has no lines to show
        problem = Diagnostic("PID002", Severity.ERROR, other[0], file, START, help=other[1])
        return Document(file, "", None, Node(None), (problem,), limits)
    text = data[: limits.file_bytes].decode("utf-8-sig", "replace")
    try:
        _refuse_bytes(data, text, limits)
        root, node, duplicates = _build_data(text, file, limits)
    except _RefusedError as e:
        problem = Diagnostic(e.code, Severity.ERROR, e.message, file, e.span, help=e.cure)
        return Document(file, text, None, Node(None), (problem,), limits)
    return resolve_templates(Document(file, text, root, node, tuple(duplicates), limits))


def _refuse_bytes(data: bytes, text: str, limits: Limits) -> None:
    """What makes the bytes of a file no text: too many, another encoding, control characters."""
    if len(data) > limits.file_bytes:
        message = f"the file is larger than {limits.file_bytes} bytes"
        raise _RefusedError("PID013", message, START, "raise the limit by option")
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as e:
        before = data[: e.start].decode("utf-8-sig", "replace")
        message = f"byte 0x{data[e.start]:02X} is not UTF-8"
        raise _RefusedError("PID002", message, _span_behind(before), SAVE_AS_UTF8) from None
    control = UNPRINTABLE.search(text)
    if control:
        message = f"control character U+{ord(control.group()):04X}"
        raise _RefusedError("PID003", message, _span_behind(text[: control.start()]), "delete the character")


def _span_behind(text: str) -> Span:
    """The position that follows this text."""
    lines = LINE_BREAK.split(text)
    line, column = len(lines), len(lines[-1]) + 1
    return Span(line, column, line, column + 1)


def _build_data(text: str, file: str, limits: Limits) -> tuple[Data, Node, list[Diagnostic]]:
    """Walks the events of the parser."""
    builder = _Builder(file, limits)
    _walk_events(text, builder)
    if builder.result is None or builder.result[0] is None:
        message = "the file holds comments alone" if text.strip() else "the file is empty"
        raise _RefusedError("PID005", message, START, "'pidcfg init' writes a starter file")
    data, node = builder.result
    if not isinstance(data, dict):
        other = "a memory listing" if re.match(r"# \w+ (?:memory listing|parameters):|V[0-7]+\s", text) else ""
        other = "XML of PLCopen" if text.lstrip().startswith("<") else other
        cure = f"{other} is read by 'pidcfg decode'" if other else "begin with the line 'pidcfg: 1'"
        raise _RefusedError("PID006", "the file must be a mapping of keys to values", node.span, cure)
    return data, node, builder.duplicates


def _walk_events(text: str, builder: _Builder) -> None:
    """The events of ruamel's parser one by one; the pure one gives the same where the C extension is missing."""
    from ruamel.yaml import events
    from ruamel.yaml.error import MarkedYAMLError, YAMLError

    handlers: dict[type, Callable[[Any], None]] = {
        events.ScalarEvent: builder.add_scalar,
        events.AliasEvent: builder.add_alias,
        events.MappingStartEvent: lambda event: builder.open_container(event, {}, Node(event, {})),
        events.SequenceStartEvent: lambda event: builder.open_container(event, [], Node(event, [])),
        events.DocumentStartEvent: builder.begin_document,
    }
    ends = {events.MappingEndEvent, events.SequenceEndEvent}
    try:
        for event in events_in(text):
            kind = event.__class__
            if kind in handlers:
                handlers[kind](event)
            elif kind in ends:
                builder.close()
    except MarkedYAMLError as e:
        _refuse_syntax(text, e)
    except YAMLError as e:
        raise _RefusedError("PID001", f"not YAML: {str(e).splitlines()[0]}", START) from None


def events_in(text: str) -> Iterator[Any]:
    """The events of a text. ruamel itself would make a class for each text that its parser in C reads, and keep it."""
    from ruamel.yaml.parser import Parser

    reader = thread_parser()
    if issubclass(reader.Parser, Parser):
        yield from reader.parse(text)
        return
    parser = reader.Parser(text)
    try:
        while parser.check_event():
            yield parser.get_event()
    finally:
        parser.dispose()


def thread_parser() -> Any:
    """One reader for all files of a thread: the one without C keeps the text in itself while it reads it."""
    if not hasattr(THREAD_DATA, "parser"):
        from ruamel.yaml import YAML

        THREAD_DATA.parser = YAML(typ="safe")
    return THREAD_DATA.parser


def _refuse_syntax(text: str, error: MarkedYAMLError) -> NoReturn:
    """The parser's complaint with a position and, where we know one, a cure."""
    from pidcfg.text.syntax import span_of_mark, syntax_fault

    lines = LINE_BREAK.split(text)
    mark = error.problem_mark or error.context_mark
    span = START if mark is None else span_of_mark(mark.line, mark.column, lines)
    problem = str(error.problem or error.context or "not YAML").strip()
    line = lines[span.line - 1]
    if "\t" in line[: len(line) - len(line.lstrip())] or line[span.column - 1 : span.column] == "\t":
        raise _RefusedError("PID014", "a tab is used for indentation", span, "indent with spaces") from None
    begin = error.context_mark
    fault = syntax_fault(lines, problem, span, begin and span_of_mark(begin.line, begin.column, lines))
    raise _RefusedError("PID001", f"not YAML: {fault.message}", fault.span, fault.cure) from None


# --- Where a YAML text has comments: a ``#`` inside a scalar is none, and only the parser knows where scalars end -----

COMMENT_START = re.compile(r"(?:^|(?<=[ \t]))#")
"""What begins a comment outside of a scalar."""
LINE_END_COLUMN = 1 << 30
"""A column behind every line."""
BLOCK_STYLES = frozenset("|>")


class Comment(NamedTuple):
    """A comment with its ``#``: where it stands, and whether its line holds nothing else."""

    line: int
    column: int
    text: str
    is_alone: bool


def comments_in(text: str) -> Iterator[Comment]:
    """The comments of a text that the parser accepts, in order."""
    scalar_columns: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for event in events_in(text):
        if hasattr(event, "value"):
            _mark_columns(span_of(event), scalar_columns, block=event.style in BLOCK_STYLES)
    for number, line in enumerate(LINE_BREAK.split(text), start=1):
        if "#" not in line:
            continue
        scalars = scalar_columns[number]
        for mark in COMMENT_START.finditer(line):
            column = mark.start()
            i = bisect_right(scalars, (column, LINE_END_COLUMN)) - 1  # of scalars, which stand one behind the other
            if i < 0 or column >= scalars[i][1]:
                yield Comment(number, column + 1, line[column:], not line[:column].strip())
                break


def _mark_columns(span: Span, scalar_columns: dict[int, list[tuple[int, int]]], *, block: bool) -> None:
    """Marks the columns (0-based) of every line that a scalar takes; the head of a block scalar may have a comment."""
    if block:
        scalar_columns[span.line].append((span.column - 1, span.column))
        span = Span(span.line + 1, 1, span.end_line, span.end_column)
    for line in range(span.line, span.end_line + 1):
        first = span.column - 1 if line == span.line else 0
        scalar_columns[line].append((first, span.end_column - 1 if line == span.end_line else LINE_END_COLUMN))


# --- Where a value is used: an alias (``*name``) shares the text of its anchor, but stands at a place of its own ------

NO_LIMITS = Limits(*[1 << 40] * len(fields(Limits)))
"""The text has been read within its limits before."""


@dataclass(slots=True)
class FindingLines:
    """The lines that findings of one file belong to."""

    doc: Document
    root: Node | None = field(default=None, init=False)

    def line_of(self, finding: Diagnostic) -> int:
        """Where a finding is written; of one that was reached through an alias the line of the alias's key."""
        if "*" not in self.doc.text:
            return finding.span.line
        if self.root is None:
            has_tree = self.doc.root.children is not None
            self.root = self.doc.root if has_tree else read_document(self.doc.text.encode(), "", NO_LIMITS).root
        alias = _alias_line(self.root, finding.path)
        return finding.span.line if alias is None else alias


def _alias_line(node: Node, path: Path) -> int | None:
    """The line of the first key on a path whose value stands above it, which only an alias does; 0 in a list."""
    for step in path:
        entry = node.child(step)
        if entry is None:
            return None
        key, value = entry
        if isinstance(node.children, list):
            before = [start_of(node.span), *(start_of(item.span) for item in node.children[: int(step)])]
            if start_of(value.span) <= max(before):
                return 0
        elif span_of(key) > value.span:
            return span_of(key).line
        node = value
    return None
