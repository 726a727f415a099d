"""The files that a NextoPID program is written to and read from, PLCopen XML among them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import compress
from xml.parsers import expat

from pidcfg.encoders.image import Settings
from pidcfg.encoders.listing import FileKind, Listing, ListingError, shorten_names
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, SIGNAL, WRITERS
from pidcfg.encoders.modbus_map import Point, Symbols, map_kind, symbol_template_rows
from pidcfg.encoders.nextopid.st_read import add_zeros, read_source, read_st
from pidcfg.encoders.nextopid.st_scope import (
    LIBRARY,
    Source,
    drop_list_names,
    parse_body,
)
from pidcfg.encoders.nextopid.st_write import write_plcopen, write_st
from pidcfg.encoders.parameter_files import parameter_listings
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.regmap import writer_of
from pidcfg.encoders.structured_text import (
    END,
    NAME,
    Comment,
    Declaration,
    Initial,
    Member,
    Token,
    drop_externals,
    first_word_offset,
    tokens_of,
)
from pidcfg.schemas.iec import Wire, time_seconds
from pidcfg.schemas.nextopid import NextopidFile, Plc
from pidcfg.schemas.numbers import decimal_text

# --- PLCopen XML to a listing: the declarations and the calls of the one program that has blocks of the library -------
#
# A whole project of CODESYS has its programs beside the task, in additional data of the resource, and its global
# variables in lists of the resource; both are read, and the interval of the task. The document is read by the
# standard library's parser. Document types and entities are refused, depth and size are bounded, and every fault has
# its line.

NAMESPACES = ("http://www.plcopen.org/xml/tc6_0201", "http://www.plcopen.org/xml/tc6_0200")
CONFIGURATION_PATH = ("instances", "configurations", "configuration")
WORD_PATTERN = re.compile(r"[^\W\d]\w*")
ISO_TIME = re.compile(r"PT(\d+(?:\.\d+)?)S", re.IGNORECASE)
"""As CODESYS writes the interval of a task."""
MAX_DEPTH = 64
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

    def find_all(self, *path: str) -> Iterator[Node]:
        """All elements along a path; ``*`` is any."""
        if not path:
            yield self
            return
        for node in self.children:
            if path[0] in {"*", node.name}:
                yield from node.find_all(*path[1:])

    @property
    def all_text(self) -> str:
        """The text of this element and all inside."""
        return "".join(self.text) + "".join(child.all_text for child in self.children)


class _Tree:
    """Builds nodes from what the parser reports."""

    def __init__(self) -> None:
        self.parser = expat.ParserCreate("utf-8", SEPARATOR)
        self.stack: list[Node] = []
        self.root: Node | None = None
        self.parser.StartElementHandler = self.start_element
        self.parser.EndElementHandler = self.end_element
        self.parser.CharacterDataHandler = self.add_text
        self.parser.StartDoctypeDeclHandler = self.refuse_doctype
        self.parser.EntityDeclHandler = self.refuse_doctype

    def refuse_doctype(self, *_: object) -> None:
        """Document types, which is where entities are made."""
        place = self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1
        raise ListingError("a document type stands here; a PLCopen file has none", *place)

    def start_element(self, name: str, attributes: dict[str, str]) -> None:
        """An element begins."""
        node = Node(
            name.rpartition(SEPARATOR)[2],
            attributes,
            self.parser.CurrentLineNumber,
            self.parser.CurrentColumnNumber + 1,
        )
        if len(self.stack) >= MAX_DEPTH:
            raise node.error(f"more than {MAX_DEPTH} elements in each other")
        if not self.stack:
            self.root = node
            if node.name != "project" or name.rpartition(SEPARATOR)[0] not in NAMESPACES:
                raise node.error(f"<{node.name}> is no project of PLCopen XML 2.0")
        else:
            self.stack[-1].children.append(node)
        self.stack.append(node)

    def end_element(self, _: str) -> None:
        """An element ends."""
        self.stack.pop()

    def add_text(self, text: str) -> None:
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


SECTIONS = {"globalVars": "VAR_GLOBAL", "externalVars": "VAR_EXTERNAL"}
"""Lists of variables whose variables are, or may be, those of another list; by the words of a text."""


def read_plcopen(text: str, name: str = "") -> Listing:
    """The parameters and wires of the program in a document; ``name``: which one, where several are there."""
    root = parse_xml(text)
    resources = [*root.find_all(*CONFIGURATION_PATH, "resource"), *root.find_all("addData", "data", "resource")]
    lists = [
        *root.find_all(*CONFIGURATION_PATH, "globalVars"),
        *(variable_list for resource in resources for variable_list in resource.find_all("globalVars")),
    ]
    pou = _find_pou(root, resources, lists, name)
    source = Source()
    source.program = _attribute_token(pou, "name")
    for variables in pou.find_all("interface", "*"):
        section = SECTIONS.get(variables.name, "VAR")
        source.declarations += (_read_declaration(node, section) for node in variables.find_all("variable"))
    owners = _declare_globals(source, lists)
    for node in pou.find_all("documentation", "*"):
        source.comments += _documentation_lines(node)
    skipped_bodies = []
    for body in pou.find_all("body", "*"):
        if body.name == "ST":
            inner = body.children[0] if body.children else body
            parse_body(inner.all_text, inner.text_line or inner.line, source)
        elif body.name not in {"addData", "documentation"}:
            skipped_bodies.append(body)
    source.statements = [drop_list_names(statement, owners) for statement in source.statements]
    listing = read_source(source, _task_interval(resources, source.program))
    notes = (
        f"the {node.name} of line {node.line} is left out: only Structured Text is read" for node in skipped_bodies
    )
    listing.notes = (*listing.notes, *notes)
    return listing


def _find_pou(root: Node, resources: list[Node], lists: list[Node], name: str) -> Node:
    """The program with blocks of the library: that declares them, or whose text has those of a global list."""
    pous = [
        *root.find_all("types", "pous", "pou"),
        *(pou for resource in resources for pou in resource.find_all("addData", "data", "pou")),
    ]
    instances = {
        node.attributes.get("name", "").upper()
        for node in _list_variables(lists)
        if any(_are_library_types(node, "type", "derived"))
    }
    declares = [any(_are_library_types(pou, "interface", "*", "variable", "type", "derived")) for pou in pous]
    candidates = [*compress(pous, declares)]
    candidates += [
        pou
        for pou, declares_blocks in zip(pous, declares, strict=True)
        if not declares_blocks and instances & _program_words(pou)
    ]
    with_blocks = _pou_names(candidates)
    candidates = candidates or [pou for pou in pous if pou.attributes.get("pouType") == "program"]
    if not candidates:
        raise root.error("the project has no program")
    if name:
        candidates = _pous_named(name, root, pous, with_blocks)
    elif len(candidates) > 1 and with_blocks:
        raise candidates[1].error(
            f"several POUs have blocks of the library ({with_blocks}); give one of them with --pou"
        )
    elif len(candidates) > 1:
        raise root.error(f"no program of the project has a block of the NextoPID library ({_pou_names(candidates)})")
    if candidates[0].attributes.get("pouType") != "program":
        raise candidates[0].error("blocks of the library stand in a POU that is no program")
    return candidates[0]


def _pou_names(pous: list[Node]) -> str:
    return shorten_names([pou.attributes.get("name", "?") for pou in pous])


def _pous_named(name: str, root: Node, pous: list[Node], with_blocks: str) -> list[Node]:
    """The POU of that name, whatever its letters, as IEC 61131-3 has it."""
    matches = [pou for pou in pous if pou.attributes.get("name", "").casefold() == name.casefold()]
    if len(matches) == 1:
        return matches
    if matches:
        raise matches[1].error(f"the project has the POU {name[:40]!r} more than once")
    advice = f"those with blocks of the library are {with_blocks}" if with_blocks else f"it has {_pou_names(pous)}"
    raise root.error(f"the project has no POU {name[:40]!r}; {advice}")


def _list_variables(lists: list[Node]) -> Iterator[Node]:
    return (node for variables in lists for node in variables.find_all("variable"))


def _are_library_types(node: Node, *path: str) -> Iterator[bool]:
    return (inner.attributes.get("name", "").upper() in LIBRARY for inner in node.find_all(*path))


def _program_words(pou: Node) -> set[str]:
    """The words of a program's text, in capitals."""
    return {word.upper() for body in pou.find_all("body", "ST") for word in WORD_PATTERN.findall(body.all_text)}


def _declare_globals(source: Source, lists: list[Node]) -> dict[str, set[str]]:
    """Declares the variables of global lists that stand for one thing; returns the names of each list."""
    local = {one.name.upper for one in source.declarations if one.section == "VAR"}
    declared = [
        (variable_list.attributes.get("name", "").upper(), _read_declaration(node, SECTIONS["globalVars"]))
        for variable_list in lists
        for node in _list_variables([variable_list])
    ]
    counts = Counter(declaration.name.upper for _, declaration in declared)
    owners: dict[str, set[str]] = {}
    unique_globals: list[Declaration] = []
    for name, declaration in declared:
        if counts[declaration.name.upper] == 1 and declaration.name.upper not in local:
            unique_globals.append(declaration)
            owners.setdefault(name, set()).add(declaration.name.upper)
    source.declarations = drop_externals([*unique_globals, *source.declarations])
    return owners


def _task_interval(resources: list[Node], program: Token) -> tuple[Decimal, Token] | None:
    """The interval of the one task that calls the program, in s, and where it stands."""
    intervals = []
    for task in (task for resource in resources for task in resource.find_all("task")):
        pou_names = (
            node.attributes.get("typeName") or node.attributes.get("name", "") for node in task.find_all("pouInstance")
        )
        if program.upper in {name.upper() for name in pou_names} and "interval" in task.attributes:
            intervals.append(_attribute_token(task, "interval"))
    if len(intervals) != 1:
        return None
    text = intervals[0].text
    match = ISO_TIME.fullmatch(text)
    seconds = time_seconds(text) if "#" in text else Decimal(match.group(1)) if match else None
    return None if not seconds else (seconds, intervals[0])


def _documentation_lines(node: Node) -> Iterator[Comment]:
    """The lines of a documentation, as comments."""
    for number, line in enumerate(node.all_text.split("\n"), start=node.text_line or node.line):
        yield Comment(line.strip(), number, 1)


def _attribute_token(node: Node, attribute: str) -> Token:
    """A name that an attribute gives."""
    text = node.attributes.get(attribute, "")
    if not text:
        raise node.error(f"<{node.name}> has no {attribute}")
    return Token(NAME, text, node.line, node.column)


def _read_declaration(node: Node, section: str) -> Declaration:
    """A variable of a block that begins with the word ``section`` as text."""
    kind, initial = node.child("type"), node.child("initialValue")
    if kind is None or not kind.children:
        raise node.error("the variable has no type")
    words = [
        Token(NAME, node_of_type.attributes.get("name", node_of_type.name), node_of_type.line, node_of_type.column)
        for node_of_type in _inner_types(kind)
    ]
    documentation = node.child("documentation")
    note = documentation.all_text.strip() if documentation else ""
    value = _initial_value(initial) if initial else None
    return Declaration(_attribute_token(node, "name"), tuple(words), value, note, section)


def _inner_types(kind: Node) -> Iterator[Node]:
    """A type, and what it is made of: one for an elementary or derived type."""
    for node in kind.children:
        yield node
        yield from _inner_types(node)


def _initial_value(node: Node) -> Initial:
    """An initial value."""
    inner = node.children[0] if node.children else None
    if inner is not None and inner.name == "structValue":
        members: dict[str, Member] = {}
        for value in inner.find_all("value"):
            member = _attribute_token(value, "member")
            if member.upper in members:
                raise value.error(f"{member.text} stands here again")
            members[member.upper] = Member(member, _initial_value(value))
        return members
    if inner is not None and inner.name == "simpleValue":
        tokens, _ = tokens_of(inner.attributes.get("value", ""), inner.line)
        return tuple(token._replace(column=inner.column) for token in tokens if token.kind != END)
    return (Token("other", "?", node.line, node.column),)


# --- The files, and what a person does around the program -------------------------------------------------------------

PROGRAM_START = re.compile(r"(?:PROGRAM|FUNCTION(?:_BLOCK)?|TYPE|VAR(?:_[A-Z_]+)?)\s", re.IGNORECASE)


TREND_KEYS = ("PV", "MV", "Manual", "CASC", "SP_CASC")
"""Parameters that run, and that a trend or an operator wants."""


def _program_name(image: Program) -> str:
    """The name of the program."""
    return str(image.plc.get("program", Plc.model_fields["program"].default))


def looks_like_st(text: str) -> bool:
    """Whether a text begins like a program, behind its comments and pragmas."""
    return bool(PROGRAM_START.match(text, first_word_offset(text)))


def looks_like_xml(text: str) -> bool:
    """Whether a text is a document of XML."""
    return text.lstrip("\ufeff \t\r\n").startswith("<")


LISTINGS = parameter_listings("parameter listing")
FORMATS = {
    **LISTINGS,
    "json": replace(
        LISTINGS["json"], looks_like=lambda text: text.lstrip().startswith("{") and not looks_like_st(text)
    ),
    "st": FileKind(
        "st",
        "program in Structured Text",
        write_st,
        lambda text: add_zeros(read_st(text)),
        looks_like_st,
        carries_checklist=True,
    ),
    "plcopen": FileKind(
        "plcopen",
        "program in PLCopen XML",
        write_plcopen,
        lambda text: add_zeros(read_plcopen(text)),
        looks_like_xml,
        carries_checklist=True,
        read_program=lambda text, name: add_zeros(read_plcopen(text, name)),
    ),
    "modbus-map": map_kind(lambda image: symbol_template_rows(points(image), TREND_KEYS, f"{_program_name(image)}.")),
}
"""A pragma, with which a program may begin, begins like JSON."""


def checklist(config: NextopidFile) -> tuple[str, ...]:
    """What the program around has to do."""
    items = [f"call the program in a cyclic task of {decimal_text(config.plc.sample_time)} s"]
    outer_inputs = [
        f"{item.name}.{key}"
        for item in (*config.blocks, *config.loops)
        for key in ("PV", "InVar", "MV")
        if key in type(item).model_fields and getattr(item, key) is None
    ]
    if outer_inputs:
        items.append(f"assign before the calls, since nothing is wired to them: {', '.join(outer_inputs)}")
    written = {move.to for move in config.moves if move.when is True}
    outer_inputs = [name for name in config.signals if name not in written]
    if outer_inputs:
        items.append(f"assign the signals from outside: {', '.join(outer_inputs)}")
    return tuple(items)


# --- What the memory of a NextoPID program may hold: signals, and the parameters of every instance --------------------

PARAMETERS = frozenset(row.name for kind in BLOCK_TYPES.values() for row in kind.table.rows)

SIGNALS = {"PV": "PV", "SP": "SP", "MV": "OUT"}
"""Parameters that are columns of a trend."""
MODE_KEYS = ("Manual", "CASC")
LITERALS = False


def mode_of(values: Mapping[str, object]) -> str:
    """The mode that these parameters ask for."""
    if values["Manual"]:
        return "manual"
    return "cascade" if values.get("CASC") else "auto"


def points(program: Program) -> Symbols:
    """All signals, and the parameters of all blocks and loops; a function keeps nothing, and has none (D893)."""
    found = {cell.address: Point(cell.address, cell.type) for cell in program.cells if "." not in cell.address}
    for entry in program.settings:
        found |= {point.name: point for point in _block_points(program, entry)}
    return Symbols("a parameter or a signal of the program", found, PARAMETERS)


def _block_points(program: Program, entry: Settings) -> Iterator[Point]:
    kind = BLOCK_TYPES[entry["type"]]
    name, loop = str(entry.get("loop") or entry.get("block")), entry.get("loop")
    if kind.function:
        return
    words = program.words
    for row in kind.table.rows:
        name_of_point = f"{name}.{row.name}"
        writer = writer_of(WRITERS, row.name, {SIGNAL: None})
        is_live = writer is not None and writer.kind == "live"
        needed = name_of_point in words and not isinstance(words[name_of_point], Wire) and not is_live
        yield Point(name_of_point, row.type, loop, needed)
