"""Structured Text and PLCopen XML to a listing: what a program declares and calls, and what its comments say."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from decimal import Decimal
from itertools import compress
from xml.parsers import expat

from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.st_calls import Assignment, Calls
from pidcfg.encoders.nextopid.st_moves import Moves
from pidcfg.encoders.nextopid.st_scope import (
    LIBRARY,
    SIGNAL_TYPES,
    Item,
    Scope,
    Source,
    Wiring,
    can_wire,
    check_name,
    drop_list_names,
    parse_body,
    parse_st,
)
from pidcfg.encoders.nextopid.st_write import wire_text
from pidcfg.encoders.nextopid.wiring import Layout, Wires
from pidcfg.encoders.parameters import Content, Parameter
from pidcfg.encoders.structured_text import (
    END,
    NAME,
    Comment,
    Declaration,
    Initial,
    Member,
    Token,
    content_of,
    tokens_of,
)
from pidcfg.schemas.base import parse_seconds
from pidcfg.schemas.expressions import ExpressionError
from pidcfg.schemas.iec import REAL, Wire, time_seconds
from pidcfg.schemas.nextopid import Plc
from pidcfg.schemas.numbers import decimal_text, plain_number

# --- Structured Text to a listing: what the program declares and calls, and what its comments say beside --------------


def read_st(text: str) -> Listing:
    """The parameters and wires of a program; raises `ListingError` at what cannot be read or would change meaning."""
    return read_source(parse_st(text))


def read_source(source: Source, task: tuple[Decimal, Token] | None = None) -> Listing:
    """As `read_st`, of what has been taken apart; ``task``: the interval of the task in s, and where it stands."""
    listing = Listing(vendor="nextopid")
    scope = Scope.of(source, listing)
    listing.described = described = bool(listing.plc)
    if task is not None:
        listing.plc = _with_task(listing.plc, *task)
    calls = Calls(scope)
    calls.left.lines += source.skipped
    for one in source.statements:
        calls.take(one)
    calls.settle_inputs()
    reader = _Reader(scope, calls, listing)
    reader.initial_values()
    reader.call_values()
    calls.sample_times(listing.plc)
    moves = Moves(scope, calls, everything=described).read()
    signals = list(scope.signals(everything=described))
    words, lines = listing.words, listing.lines
    listing.words, listing.lines, listing.shown = {}, {}, {}
    for signal in signals:
        listing.add(signal.name.text, _first_value(signal), signal.name.text, signal.name.line, signal.name.column)
    for name, value in words.items():
        listing.add(name, value, name, lines[name])
    if moves:
        listing.plc = {**listing.plc, "moves": moves}
    if source.program is not None:
        listing.plc = _with_program(listing.plc, source.program)
    listing.settings = tuple(item.entry for item in scope.items.values())
    listing.notes = tuple(reader.notes(signals))
    return listing


def with_zeros(listing: Listing) -> Listing:
    """What a program does not mention of its instances is 0, as IEC 61131-3 has it; a note says which."""
    for entry in listing.settings:
        kind, name = BLOCK_TYPES[entry["type"]], entry.get("loop") or entry.get("block")
        left = []
        for row in () if kind.function else kind.inputs:
            field, full = kind.model.model_fields.get(row.name), f"{name}.{row.name}"
            if field is not None and field.is_required() and full not in listing.words:
                listing.add(full, row.type.default, full)
                left.append(row.name)
        if left:
            listing.notes = (*listing.notes, f"{name}: {', '.join(left)} are not given in the program, and so are 0")
    return listing


def _with_task(plc: Mapping[str, object], interval: Decimal, at: Token) -> dict[str, object]:
    """What is beside the parameters, with the interval of the task; raises `ListingError` where the comments differ."""
    said = plc.get("sample_time")
    if said is not None and not _is_time(said, interval):
        raise at.error(f"the task calls the program every {decimal_text(interval)} s, and the comments say {said}")
    return {**plc, "sample_time": plain_number(interval)}


def _is_time(said: object, interval: Decimal) -> bool:
    """Whether a comment says that time; what is none is another one."""
    try:
        return parse_seconds(said) == interval
    except (ValueError, TypeError):
        return False


def _with_program(plc: Mapping[str, object], program: Token) -> dict[str, object]:
    """What is beside the parameters, with the name that the program has."""
    check_name(program.text, program.line, program.column)
    entry = {key: value for key, value in plc.items() if key != "program"}
    return entry if program.text == Plc.model_fields["program"].default else entry | {"program": program.text}


def _first_value(signal: Declaration) -> Content:
    """What a signal begins with."""
    kind = SIGNAL_TYPES.get(signal.type_name, REAL)
    if signal.initial is None:
        return kind.default
    value = (
        None
        if isinstance(signal.initial, dict) or not signal.initial
        else content_of(signal.initial, kind, signal.name.text)
    )
    if value is None:
        raise signal.name.error(f"{signal.name.text} is read by a block, and begins with something that is no literal")
    return value


class _Reader:
    """Turns initial values and arguments into words."""

    def __init__(self, scope: Scope, calls: Calls, listing: Listing) -> None:
        self.scope, self.calls, self.listing = scope, calls, listing
        self.places: dict[tuple[str, str], Assignment] = {}

    # --- values ------------------------------------------------------------------------------------------------------

    def initial_values(self) -> None:
        """Those of instances, and of variables that stand for inputs of functions."""
        wired = {*self.calls.assignments}
        for item in self.scope.items.values():
            declared = self.scope.variables.get(item.name.upper())
            if declared is None or item.kind.function or declared.initial is None:
                continue
            if not isinstance(declared.initial, dict):
                raise declared.name.error(
                    f"{item.name}: initial values of an instance stand in parentheses, (SP := 50.0)"
                )
            self._members(item, (), declared.initial, wired)
        for upper, (item, row) in self.scope.aliases.items():
            initial = self.scope.variables[upper].initial
            if row.access == "input" and initial is not None and (item.name, row.name) not in wired:
                self._literal(item, row, initial, self.scope.variables[upper].name)

    def _members(self, item: Item, above: tuple[Token, ...], initial: Initial, wired: set[tuple[str, str]]) -> None:
        for name, value in initial.values() if isinstance(initial, dict) else ():
            if isinstance(value, dict):
                self._members(item, (*above, name), value, wired)
                continue
            row = self.scope.row(item, (*above, name), "input")
            if (item.name, row.name) not in wired:
                self._literal(item, row, value, name)

    def _literal(self, item: Item, row: Parameter, value: Initial, at: Token) -> None:
        full = f"{item.name}.{row.name}"
        content = content_of(value, row.type, full) if value and not isinstance(value, dict) else None
        if content is None:
            raise at.error(f"{full} begins with something that is no literal")
        self.listing.add(full, content, full, at.line, at.column)

    def call_values(self) -> None:
        """Arguments and assignments."""
        for assignment in self.calls.assignments.values():
            item, row, tokens = assignment[:3]
            full = f"{item.name}.{row.name}"
            content = content_of(tokens, row.type, full)
            if content is None:
                if not can_wire(item.kind.model, row.name):
                    raise tokens[0].error(f"{full} takes a literal, and cannot be wired")
                self.places[item.name, row.name] = assignment
            value = self._wire(item, row, tokens) if content is None else content
            self.listing.add(full, value, full, tokens[0].line, tokens[0].column)

    def _wire(self, item: Item, row: Parameter, tokens: tuple[Token, ...]) -> Wire:
        wiring = Wiring.read(tokens, row.type, self.scope.resolve)
        self.calls.reads.setdefault(item.name, set()).update(wiring.names)
        return Wire(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__))

    # --- order -------------------------------------------------------------------------------------------------------

    def notes(self, signals: list[Declaration]) -> Iterator[str]:
        """What was passed over, and what will be executed in another order; checks every wire."""
        layout = Layout.of(
            {signal.name.text: SIGNAL_TYPES.get(signal.type_name, REAL) for signal in signals},
            [(item.name, item.kind) for item in self._in_order()],
        )
        wires: Wires = {}
        numbers = {block.name: i for i, block in enumerate(layout.instances)}
        for (name, row), assignment in self.places.items():
            wire = self.listing.words[f"{name}.{row}"]
            try:
                wires[numbers[name], row] = layout.read(assignment.row.type, wire.text)
            except ExpressionError as error:
                raise assignment.tokens[0].error(f"{name}.{row}: {error.message}") from None
        yield from self._missing_calls()
        yield from self._other_order(layout, wires)
        if self.calls.left.lines:
            lines = few([str(line) for line in sorted({*self.calls.left.lines})])
            yield f"statements that are not about blocks of the library are left out: lines {lines}"
        used = {*self.scope.items, *self.scope.aliases, *self.scope.structures}
        used |= {signal.name.upper for signal in signals} | {*self.calls.counters}
        left = [d.name.text for upper, d in self.scope.variables.items() if upper not in used]
        if left:
            yield f"variables that no block reads are left out: {few(left)}"
        whole = [d.name.text for d in signals if d.type_name not in SIGNAL_TYPES]
        if whole:
            yield f"these variables are not REAL in the program, and are REAL signals here: {few(whole)}"

    def _in_order(self) -> list[Item]:
        """As a configuration has them: blocks before loops."""
        return sorted(self.scope.items.values(), key=lambda item: "loop" in item.entry)

    def _missing_calls(self) -> Iterator[str]:
        missing = [item for item in self.scope.items.values() if not item.called]
        functions = [item.name for item in missing if item.kind.function]
        if functions:
            raise ListingError(f"{functions[0]} is a function of the comments, and nothing calls it")
        if missing and self.calls.turns:
            yield f"these blocks are declared and never called: {few([item.name for item in missing])}"

    def _other_order(self, layout: Layout, wires: Wires) -> Iterator[str]:
        """Where a value of the previous cycle becomes one of the same, or the other way round."""
        turn = {i: at for at, i in enumerate(layout.order(wires))}
        items = {block.name: self.scope.items[block.name.upper()] for block in layout.instances}
        for (i, row), wire in wires.items():
            assignment = self.places[layout.instances[i].name, row]
            for number in sorted(wire.signals):
                owner = layout.owner(number)
                if owner is None or (layout.is_input(number) and not self._wired(layout, wires, number)):
                    continue
                other = items[layout.instances[owner].name]
                was_before = 0 <= other.turn < assignment.turn
                if other.called and was_before != (turn[owner] < turn[i]):
                    which = "same" if was_before else "previous"
                    name = layout.instances[i].name
                    yield (
                        f"{name}.{row} reads {other.name} of the {which} cycle in the program, and of the "
                        f"{'previous' if was_before else 'same'} one in the order of the configuration"
                    )

    def _wired(self, layout: Layout, wires: Wires, number: int) -> bool:
        block = layout.instances[layout.owner(number) or 0]
        return (layout.owner(number), block.kind.table.rows[number - block.base].name) in wires


# --- PLCopen XML to a listing: the declarations and the calls of the one program that has blocks of the library -------
#
# A whole project of CODESYS has its programs beside the task, in additional data of the resource, and its global
# variables in lists of the resource; both are read, and the interval of the task. The document is read by the
# standard library's parser. Document types and entities are refused, depth and size are bounded, and every fault has
# its line.

NAMESPACES = ("http://www.plcopen.org/xml/tc6_0201", "http://www.plcopen.org/xml/tc6_0200")
CONFIGURATION = ("instances", "configurations", "configuration")
WORD = re.compile(r"[^\W\d]\w*")
ISO_TIME = re.compile(r"PT(\d+(?:\.\d+)?)S", re.IGNORECASE)
"""As CODESYS writes the interval of a task."""
DEEPEST = 64
SEPARATOR = " "
"""Between the namespace and the name of an element."""


@dataclass(slots=True)
class Node:
    """An element: its name without its namespace, its attributes, what is inside, and where it stands."""

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    children: list[Node] = field(default_factory=list)
    text: list[str] = field(default_factory=list)
    text_line: int = 0

    def error(self, message: str) -> ListingError:
        """A fault at this place."""
        return ListingError(message, self.line, self.column)

    def child(self, name: str) -> Node | None:
        """The first element of this name inside."""
        return next((node for node in self.children if node.name == name), None)

    def all(self, *path: str) -> Iterator[Node]:
        """All elements along a path; ``*`` is any."""
        if not path:
            yield self
            return
        for node in self.children:
            if path[0] in {"*", node.name}:
                yield from node.all(*path[1:])

    @property
    def words(self) -> str:
        """The text of this element and all inside."""
        return "".join(self.text) + "".join(child.words for child in self.children)


class _Tree:
    """Builds nodes from what the parser reports."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate("utf-8", SEPARATOR)
        self.stack: list[Node] = []
        self.root: Node | None = None
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.data
        self.parser.StartDoctypeDeclHandler = self.refuse
        self.parser.EntityDeclHandler = self.refuse

    def refuse(self, *_: object) -> None:
        """Document types, which is where entities are made."""
        place = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        raise ListingError("a document type stands here; a PLCopen file has none", *place)

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        node = Node(
            name.rpartition(SEPARATOR)[2],
            attributes,
            self.parser.CurrentLineNumber,
            self.parser.CurrentColumnNumber + 1,
        )
        if len(self.stack) >= DEEPEST:
            raise node.error(f"more than {DEEPEST} elements in each other")
        if not self.stack:
            self.root = node
            if node.name != "project" or name.rpartition(SEPARATOR)[0] not in NAMESPACES:
                raise node.error(f"<{node.name}> is no project of PLCopen XML 2.0")
        else:
            self.stack[-1].children.append(node)
        self.stack.append(node)

    def end(self, _: str) -> None:
        """An element ends."""
        self.stack.pop()

    def data(self, text: str) -> None:
        """Text inside an element."""
        node = self.stack[-1]
        node.text_line = node.text_line or self.parser.CurrentLineNumber
        node.text.append(text)


def parse_xml(text: str) -> Node:
    """The document; raises `ListingError`."""
    tree = _Tree()
    try:
        tree.parser.Parse(text.lstrip("\ufeff").encode("utf-8", "surrogatepass"), True)  # noqa: FBT003
    except expat.ExpatError as error:
        raise ListingError(f"not XML: {expat.ErrorString(error.code)}", error.lineno, error.offset + 1) from None
    if tree.root is None:
        raise ListingError("the document is empty")
    return tree.root


def read_plcopen(text: str, name: str = "") -> Listing:
    """The parameters and wires of the program in a document; ``name``: which one, where several are there."""
    root = parse_xml(text)
    resources = [*root.all(*CONFIGURATION, "resource"), *root.all("addData", "data", "resource")]
    lists = [*root.all(*CONFIGURATION, "globalVars"), *(one for at in resources for one in at.all("globalVars"))]
    pou = _pou(root, resources, lists, name)
    source = Source()
    source.program = _token(pou, "name")
    for variables in pou.all("interface", "*"):
        source.declarations += (_declaration(node) for node in variables.all("variable"))
    owners = _globals(source, lists)
    for node in pou.all("documentation", "*"):
        source.comments += _lines(node)
    left = []
    for body in pou.all("body", "*"):
        if body.name == "ST":
            inner = body.children[0] if body.children else body
            parse_body(inner.words, inner.text_line or inner.line, source)
        elif body.name not in {"addData", "documentation"}:
            left.append(body)
    source.statements = [drop_list_names(statement, owners) for statement in source.statements]
    listing = read_source(source, _interval(resources, source.program))
    notes = (f"the {node.name} of line {node.line} is left out: only Structured Text is read" for node in left)
    listing.notes = (*listing.notes, *notes)
    return listing


def _pou(root: Node, resources: list[Node], lists: list[Node], name: str) -> Node:
    """The program with blocks of the library: that declares them, or whose text has those of a global list."""
    pous = [*root.all("types", "pous", "pou"), *(pou for at in resources for pou in at.all("addData", "data", "pou"))]
    instances = {
        node.attributes.get("name", "").upper()
        for node in _variables(lists)
        if any(_of_library(node, "type", "derived"))
    }
    declares = [any(_of_library(pou, "interface", "*", "variable", "type", "derived")) for pou in pous]
    fitting = [*compress(pous, declares)]
    fitting += [pou for pou, own in zip(pous, declares, strict=True) if not own and instances & _words(pou)]
    with_blocks = _names(fitting)
    fitting = fitting or [pou for pou in pous if pou.attributes.get("pouType") == "program"]
    if not fitting:
        raise root.error("the project has no program")
    if name:
        fitting = _called(name, root, pous, with_blocks)
    elif len(fitting) > 1 and with_blocks:
        raise fitting[1].error(f"several POUs have blocks of the library ({with_blocks}); give one of them with --pou")
    elif len(fitting) > 1:
        raise root.error(f"no program of the project has a block of the NextoPID library ({_names(fitting)})")
    if fitting[0].attributes.get("pouType") != "program":
        raise fitting[0].error("blocks of the library stand in a POU that is no program")
    return fitting[0]


def _names(pous: list[Node]) -> str:
    return few([pou.attributes.get("name", "?") for pou in pous])


def _called(name: str, root: Node, pous: list[Node], with_blocks: str) -> list[Node]:
    """The POU of that name, whatever its letters, as IEC 61131-3 has it."""
    found = [pou for pou in pous if pou.attributes.get("name", "").casefold() == name.casefold()]
    if len(found) == 1:
        return found
    if found:
        raise found[1].error(f"the project has the POU {name[:40]!r} more than once")
    have = f"those with blocks of the library are {with_blocks}" if with_blocks else f"it has {_names(pous)}"
    raise root.error(f"the project has no POU {name[:40]!r}; {have}")


def _variables(lists: list[Node]) -> Iterator[Node]:
    return (node for variables in lists for node in variables.all("variable"))


def _of_library(node: Node, *path: str) -> Iterator[bool]:
    return (inner.attributes.get("name", "").upper() in LIBRARY for inner in node.all(*path))


def _words(pou: Node) -> set[str]:
    """The words of a program's text, in capitals."""
    return {word.upper() for body in pou.all("body", "ST") for word in WORD.findall(body.words)}


def _globals(source: Source, lists: list[Node]) -> dict[str, set[str]]:
    """Declares the variables of global lists that stand for one thing; returns the names of each list."""
    local = {declaration.name.upper for declaration in source.declarations}
    found = [
        (one.attributes.get("name", "").upper(), _declaration(node)) for one in lists for node in _variables([one])
    ]
    times = Counter(declaration.name.upper for _, declaration in found)
    owners: dict[str, set[str]] = {}
    kept: list[Declaration] = []
    for name, declaration in found:
        if times[declaration.name.upper] == 1 and declaration.name.upper not in local:
            kept.append(declaration)
            owners.setdefault(name, set()).add(declaration.name.upper)
    source.declarations = [*kept, *source.declarations]
    return owners


def _interval(resources: list[Node], program: Token) -> tuple[Decimal, Token] | None:
    """The interval of the one task that calls the program, in s, and where it stands."""
    found = []
    for task in (task for resource in resources for task in resource.all("task")):
        called = (
            node.attributes.get("typeName") or node.attributes.get("name", "") for node in task.all("pouInstance")
        )
        if program.upper in {name.upper() for name in called} and "interval" in task.attributes:
            found.append(_token(task, "interval"))
    if len(found) != 1:
        return None
    text = found[0].text
    match = ISO_TIME.fullmatch(text)
    seconds = time_seconds(text) if "#" in text else Decimal(match.group(1)) if match else None
    return None if not seconds else (seconds, found[0])


def _lines(node: Node) -> Iterator[Comment]:
    """The lines of a documentation, as comments."""
    for number, line in enumerate(node.words.split("\n"), start=node.text_line or node.line):
        yield Comment(line.strip(), number, 1)


def _token(node: Node, attribute: str) -> Token:
    """A name that an attribute gives."""
    text = node.attributes.get(attribute, "")
    if not text:
        raise node.error(f"<{node.name}> has no {attribute}")
    return Token(NAME, text, node.line, node.column)


def _declaration(node: Node) -> Declaration:
    """A variable."""
    kind, initial = node.child("type"), node.child("initialValue")
    if kind is None or not kind.children:
        raise node.error("the variable has no type")
    words = [Token(NAME, one.attributes.get("name", one.name), one.line, one.column) for one in _all_types(kind)]
    documentation = node.child("documentation")
    note = documentation.words.strip() if documentation else ""
    return Declaration(_token(node, "name"), tuple(words), _initial(initial) if initial else None, note)


def _all_types(kind: Node) -> Iterator[Node]:
    """A type, and what it is made of: one for an elementary or derived type."""
    for node in kind.children:
        yield node
        yield from _all_types(node)


def _initial(node: Node) -> Initial:
    """An initial value."""
    inner = node.children[0] if node.children else None
    if inner is not None and inner.name == "structValue":
        members: dict[str, Member] = {}
        for value in inner.all("value"):
            member = _token(value, "member")
            if member.upper in members:
                raise value.error(f"{member.text} stands here again")
            members[member.upper] = Member(member, _initial(value))
        return members
    if inner is not None and inner.name == "simpleValue":
        tokens, _ = tokens_of(inner.attributes.get("value", ""), inner.line)
        return tuple(token._replace(column=inner.column) for token in tokens if token.kind != END)
    return (Token("other", "?", node.line, node.column),)
