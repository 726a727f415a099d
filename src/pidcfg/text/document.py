"""A text file as read: plain data beside a tree that knows where each value stands; templates written out."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from pidcfg.text.diagnostics import START, Diagnostic, Severity, Span
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator

    from pidcfg.text.paths import Data, Path
    from pidcfg.text.reader import Limits

# --- A text file as read: plain data beside a tree of the same shape that knows where everything is written -----------

LINE_BREAK = re.compile("\r\n|[\n\r\x85\u2028\u2029]")


class Plain(str):
    """An unquoted scalar as it is written: ``010`` stays ``010`` until a field reads it."""

    __slots__ = ()


class Event(Protocol):
    """A value that the parser has come to: its marks with lines and columns from 0, and its anchor for aliases."""

    start_mark: Any
    end_mark: Any
    anchor: str | None


class Node:
    """Where a value is written; children by key (with the event of the key) or by index.

    The parser's event is kept and turned into a `Span` only on demand: most values are never reported.
    """

    __slots__ = ("children", "event", "size")

    def __init__(self, event: Event | None, children: dict[str, tuple[Event, Node]] | list[Node] | None = None) -> None:
        self.event = event
        self.size = 1
        self.children = children

    @property
    def span(self) -> Span:
        """The place of the value."""
        return span_of(self.event)

    @property
    def levels(self) -> int:
        """The levels of nesting inside it and with it; a scalar has none."""
        levels, nodes = 0, [self]
        while nodes := [node for node in nodes if node.children is not None]:
            levels += 1
            nodes = [below for node in nodes for below in node.items]
        return levels

    @property
    def items(self) -> Iterable[Node]:
        """The nodes one level below."""
        if isinstance(self.children, dict):
            return (node for _, node in self.children.values())
        return self.children or ()

    def child(self, step: str | int) -> tuple[Event | None, Node] | None:
        """The event of a key (an item: of its value) and the node below it; None when there is none."""
        if isinstance(self.children, dict):
            return self.children.get(step) if isinstance(step, str) else None
        if isinstance(self.children, list) and isinstance(step, int) and 0 <= step < len(self.children):
            return self.children[step].event, self.children[step]
        return None


class Location(NamedTuple):
    """What stands at a place of a file: its path, whether the place is in the key rather than the value, and where."""

    path: Path
    key: bool
    span: Span


@frozen
class Document:
    """A file as read: data, positions and what was wrong with its text."""

    file: str
    text: str
    data: Data | None
    root: Node
    problems: tuple[Diagnostic, ...] = ()
    limits: Limits = field(default=DEFAULT, repr=False, compare=False)
    """Within which it was read, and so what it names."""

    @cached_property
    def lines(self) -> list[str]:
        """The text by lines, counted as the parser counts them; divided once, however many findings ask."""
        return LINE_BREAK.split(self.text)

    def without_data(self) -> Document:
        """The text alone: what a report still needs when the data have been checked."""
        return replace(self, data=None, root=Node(None))

    def locate(self, path: Path, *, key: bool = False) -> Span:
        """Where the value at ``path`` is written (``key``: its key), or the closest ancestor that is in the file.

        An ancestor is pointed at by its key, since what is missing there has no place of its own.
        """
        node, key_event = self.root, None
        for step in path:
            entry = node.child(step)
            if entry is None:
                key = True
                break
            key_event, node = entry
        if key or not path:
            return START if key_event is None else span_of(key_event)
        return node.span

    def at(self, line: int, column: int) -> Location | None:
        """The key or the value that stands at a place (from 1, the end inclusive); None between them, or in comments.

        Of a value that is used in several places, by an alias or a template, the place is where it is written.
        """
        node, position = self.root, (line, column)
        path: Path = ()
        while node.children is not None:
            entry = max(
                (child for child in _entries(node) if child[0] <= position), key=lambda one: one[0], default=None
            )  # a mapping has no end, so the last one that begins before the place
            if entry is None:
                return None
            _, step, key, node = entry
            path = (*path, step)
            if key is not None and _is_within(span_of(key), position):
                return Location(path, key=True, span=span_of(key))
        return Location(path, key=False, span=node.span) if path and _is_within(node.span, position) else None


def _entries(node: Node) -> Iterator[tuple[tuple[int, int], str | int, Event | None, Node]]:
    """The children of a node: where each begins, step, the event of the key (None in a list), and the node."""
    if isinstance(node.children, dict):
        for step, (key, child) in node.children.items():
            yield start_of(span_of(key)), step, key, child
    else:
        yield from ((start_of(child.span), i, None, child) for i, child in enumerate(node.children or ()))


def start_of(span: Span) -> tuple[int, int]:
    """Line and column in which a place begins."""
    return span.line, span.column


def _is_within(span: Span, position: tuple[int, int]) -> bool:
    """Whether a place is within a span, its end included."""
    return start_of(span) <= position <= (span.end_line, span.end_column)


def span_of(event: Event | None) -> Span:
    """The place of a parser's event; the start of the file where there is none."""
    if event is None:
        return START
    start, end = event.start_mark, event.end_mark
    return Span(start.line + 1, start.column + 1, end.line + 1, end.column + 1)


# ----------------------------------------------------------------------------------------------------------------------
# Equal loops: ``templates`` at the top of a file, and ``use: NAME`` in loops that add to one or differ from it.
# A document is resolved once it is read: each loop gets the values of its template, key by key, and what the loop
# writes itself wins. Every value keeps the node of the place where it is written, so that findings, edits and
# comments are about that place, be it in the template or in the loop. Nothing behind the reader knows of templates.

TEMPLATES, USE = "templates", "use"
NAME_KEY = "name"
"""What each loop has for itself."""
NO_TEMPLATES = "there is none: add 'templates:' above the loops"
MAX_TEMPLATES_NAMED = 50
"""Templates that a message names."""
MAX_RING_NAMED = 8
"""Templates that a message names of those that use one another."""
MAX_NAME_COMPARISONS = 500
"""Pairs of an unknown name and a template that are likened to each other."""


def resolve_templates(doc: Document) -> Document:
    """The document with every loop written out; one whose templates cannot be used has problems and no data."""
    data = doc.data
    if data is None or "vendor" not in data or not (TEMPLATES in data or any(_loop_uses(data))):
        return doc
    resolver = _Resolver(doc)
    loops = resolver.resolve_loops()
    if any(d.severity is Severity.ERROR for d in resolver.problems):
        return replace(doc, data=None, problems=(*doc.problems, *resolver.problems))
    data = {key: value for key, value in data.items() if key != TEMPLATES} | {"loops": [value for value, _ in loops]}
    children = doc.root.children
    if not isinstance(children, dict):
        return doc
    key, node = children["loops"]
    root = Node(doc.root.event, {**children, "loops": (key, Node(node.event, [below for _, below in loops]))})
    return replace(doc, data=data, root=root, problems=(*doc.problems, *resolver.problems))


def paths_sharing_text(doc: Document, path: Path) -> Iterator[Path]:
    """The paths of all loops that have a value from the same place of the text."""
    yield path
    loops = (doc.data or {}).get("loops")
    if len(path) < 3 or path[0] != "loops" or not isinstance(loops, list):
        return
    span = doc.locate(path, key=True)
    for i in range(len(loops)):
        other = ("loops", i, *path[2:])
        if other != path and doc.locate(other, key=True) == span:
            yield other


def _loop_uses(data: Data) -> Iterator[bool]:
    loops = data.get("loops")
    for loop in loops if isinstance(loops, list) else ():
        yield isinstance(loop, dict) and USE in loop


@dataclass(slots=True)
class _Resolver:
    """Writes out the loops of a document that use templates."""

    doc: Document
    problems: dict[Diagnostic, None] = field(default_factory=dict)
    """Each once, in their order."""
    resolved_templates: dict[str, tuple[Data, Node] | None] = field(default_factory=dict)
    """Templates that are used, with what they use themselves; None: one that cannot be."""
    cures: dict[str, str] = field(default_factory=dict)
    """Of names that no template has."""
    nodes: int = 0

    @property
    def templates(self) -> Data:
        """As the file has them."""
        templates = (self.doc.data or {}).get(TEMPLATES)
        return templates if isinstance(templates, dict) else {}

    def resolve_loops(self) -> list[tuple[object, Node]]:
        """All loops written out."""
        data = self.doc.data or {}
        if TEMPLATES in data:
            self._check_templates(data[TEMPLATES])
        loops, entry = data.get("loops"), self.doc.root.child("loops")
        if not isinstance(loops, list) or entry is None:
            self._add_error(
                "PID016", (TEMPLATES,), "templates are for loops, and there are none", "add loops that use them"
            )
            return []
        resolved_loops = []
        for i, loop in enumerate(loops):
            node = entry[1].child(i)
            resolved_loops.append(self._resolve_loop(("loops", i), loop, node[1] if node else Node(None)))
        failed = bool(self.problems)
        for name in self.templates:
            if name not in self.resolved_templates and not failed:
                self._add_problem(
                    "PID017",
                    (TEMPLATES, name),
                    f"no loop uses the template {name}",
                    "delete it, or use it",
                    Severity.WARNING,
                )
        return resolved_loops

    def _check_templates(self, templates: object) -> None:
        """Templates are loops by name, and none of them has a loop's own name."""
        if not isinstance(templates, dict) or not templates:
            self._add_error(
                "PID016",
                (TEMPLATES,),
                "templates are loops by their names",
                "write 'templates:', below it 'ovens:', below that the keys of a loop",
            )
            return
        for name, loop in templates.items():
            if not isinstance(loop, dict):
                self._add_error(
                    "PID016", (TEMPLATES, name), f"the template {name} is no loop", "write the keys of a loop below it"
                )
            elif NAME_KEY in loop:
                self._add_error(
                    "PID016",
                    (TEMPLATES, name, NAME_KEY),
                    f"the template {name} has a {NAME_KEY}, which no two loops share",
                    f"give each loop its {NAME_KEY}",
                )

    def _resolve_loop(self, path: Path, loop: object, node: Node) -> tuple[object, Node]:
        """A loop with the values of its template."""
        if not isinstance(loop, dict) or USE not in loop:
            return loop, node
        base, own = self._resolve_template(loop[USE], (*path, USE)), _without_use(loop, node)
        return own if base is None else self._join_within_limit(base, own, path)

    def _resolve_template(self, name: Any, path: Path) -> tuple[Data, Node] | None:
        """A template with what it uses itself; None for one that cannot be used."""
        users: dict[str, None] = {}  # from the one that is asked for to the one that uses no other
        while self._is_usable(name, path, users) and name not in self.resolved_templates:
            users[name] = None
            if USE not in self.templates[name]:
                break
            name, path = self.templates[name][USE], (TEMPLATES, name, USE)
        resolved = self.resolved_templates.get(name) if isinstance(name, str) else None
        entry = self.doc.root.child(TEMPLATES)
        for user in reversed(users):
            child = entry[1].child(user) if entry else None
            data = self.templates[user]
            loop = _without_use(data, child[1] if child else Node(None))
            if USE not in data:
                resolved = loop
            elif resolved is not None:
                resolved = self._join_within_limit(resolved, loop, (TEMPLATES, user))
            self.resolved_templates[user] = resolved
        return resolved

    def _is_usable(self, name: object, path: Path, users: Collection[str]) -> bool:
        """Whether there is a template of that name, which none of its users is; an error says why not."""
        if not isinstance(name, str):
            self._add_error("PID015", path, "use names one template", "write 'use: ovens'")
        elif name not in self.templates:
            self._add_error("PID015", path, f"there is no template {name}", self._name_cure(name))
        elif name in users:
            ring = [*users, name][[*users].index(name) :]
            if len(ring) > MAX_RING_NAMED:
                ring[MAX_RING_NAMED // 2 : 1 - MAX_RING_NAMED // 2] = ["…"]
            cure = "write the values out in one of them"
            self._add_error("PID015", path, f"a template uses itself: {' uses '.join(ring)}", cure)
        else:
            return isinstance(self.templates[name], dict)
        return False

    def _name_cure(self, name: str) -> str:
        """The cure of a name that no template has."""
        if name not in self.cures:
            names = [*self.templates]
            few = (len(self.cures) + 1) * len(names) <= MAX_NAME_COMPARISONS
            near = get_close_matches(name, names, 1, 0.5) if few else ()
            more = f", and {len(names) - MAX_TEMPLATES_NAMED} more" if len(names) > MAX_TEMPLATES_NAMED else ""
            known = f"there are {', '.join(names[:MAX_TEMPLATES_NAMED])}{more}" if names else NO_TEMPLATES
            self.cures[name] = f"did you mean {near[0]}?" if near else known
        return self.cures[name]

    def _join_within_limit(self, base: tuple[object, Node], loop: tuple[object, Node], path: Path) -> tuple[Any, Node]:
        """What uses a template with the values of it, as long as all copies are within the limit."""
        fitted = self.nodes <= self.doc.limits.nodes
        self.nodes += base[1].size
        if self.nodes <= self.doc.limits.nodes:
            return self._merge(base, loop, path)
        if fitted:
            message = f"more than {self.doc.limits.nodes} values with those of templates"
            self._add_error("PID013", (*path, USE), message, "split the file, or raise the limit by option")
        return loop

    def _merge(self, base: tuple[Any, Node], loop: tuple[Any, Node], path: Path) -> tuple[object, Node]:
        """Two mappings as one; of a key that both have, mappings are joined and anything else is the own one."""
        (data, node), (own_data, own_node) = base, loop
        keys: Data = dict(data)
        children = dict(node.children) if isinstance(node.children, dict) else {}
        own_children = own_node.children if isinstance(own_node.children, dict) else {}
        for key, value in own_data.items():
            if isinstance(value, dict) and isinstance(data.get(key), dict):
                pair = (data[key], children[key][1]), (value, own_children[key][1])
                keys[key], inner = self._merge(*pair, (*path, key))
                children[key] = (own_children[key][0], inner)
            else:
                if isinstance(data.get(key), list) and not isinstance(value, list):
                    message = f"the template has a list at {key}, which is replaced as a whole"
                    self._add_error("PID016", (*path, key), message, "write the whole list")
                children[key] = own_children[key]
                keys[key] = value
        merged = Node(own_node.event, children)
        merged.size = 1 + sum(child.size for _, child in children.values())
        return keys, merged

    def _add_error(self, code: str, path: Path, message: str, cure: str) -> None:
        self._add_problem(code, path, message, cure, Severity.ERROR)

    def _add_problem(self, code: str, path: Path, message: str, cure: str, severity: Severity) -> None:
        span = self.doc.locate(path, key=path[-1] != USE)
        problem = Diagnostic(code, severity, message, self.doc.file, span, path, help=cure)
        self.problems[problem] = None


def _without_use(data: Data, node: Node) -> tuple[Data, Node]:
    children = dict(node.children) if isinstance(node.children, dict) else {}
    used = children.pop(USE, None)
    own = Node(node.event, children)
    own.size = node.size - (used[1].size if used else 0)
    return {key: value for key, value in data.items() if key != USE}, own
