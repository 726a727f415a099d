"""The names of a program that is read: instances of the library, functions, and variables."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, get_args

from pydantic_core import PydanticCustomError

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES
from pidcfg.encoders.st.text import settings_of
from pidcfg.encoders.st.values import INTEGERS, REALS
from pidcfg.schemas.iec import BOOL, INT, REAL, TIME, Wire, parse_identifier
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.maps.nextopid import BlockType
    from pidcfg.encoders.nextopid.st_source import Source
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.encoders.st.lex import Comment, Token
    from pidcfg.encoders.st.parse import Declaration
    from pidcfg.schemas.iec import IecType

LIBRARY = {name.upper(): kind for name, kind in BLOCK_TYPES.items()}
SIGNAL_TYPES = {kind.name: kind for kind in (BOOL, REAL, INT, TIME)}
"""Types that a signal of a configuration has; other numbers become REAL."""
STANDS_FOR = re.compile(r"(\w+)\.(\w+)")


@dataclass(slots=True)
class Item:
    """A block or function of the library that the program uses."""

    name: str
    kind: BlockType
    entry: dict[str, Any]
    place: Token | None = None
    """Its call, once the reader is past it."""
    turn: int = -1
    """The number of that call among all calls of the program, from 0; -1: not called."""
    cycles: int = 1

    @property
    def called(self) -> bool:
        """Whether the program calls it."""
        return self.place is not None


def can_wire(model: Any, name: str) -> bool:
    """Whether a parameter takes an expression; ``name`` may be that of a structure's member."""
    key, _, rest = name.partition(".")
    field = getattr(model, "model_fields", {}).get(key)
    inside = () if field is None else (field.annotation, *get_args(field.annotation))
    return any(can_wire(inner, rest) if rest else _takes_wire(inner) for inner in inside)


def _takes_wire(annotation: Any) -> bool:
    return annotation is Wire or any(_takes_wire(inner) for inner in get_args(annotation))


def check_name(name: str, line: int, column: int) -> None:
    """Refuses a name that a configuration cannot have."""
    try:
        parse_identifier(name)
    except PydanticCustomError as error:
        raise ListingError(error.message(), line, column) from None


@dataclass(slots=True)
class Scope:
    """The names of the program, in capitals, since the language ignores case."""

    variables: dict[str, Declaration] = field(default_factory=dict)
    items: dict[str, Item] = field(default_factory=dict)
    aliases: dict[str, tuple[Item, Parameter]] = field(default_factory=dict)
    """Variables that stand for an output, or for an input of a function."""
    structures: dict[str, tuple[Item, Token]] = field(default_factory=dict)
    """Variables that stand for an output which is a structure: the block, and the name of the output."""
    assigned: dict[str, Token] = field(default_factory=dict)
    """Variables that skipped statements assign."""
    used: set[str] = field(default_factory=set)
    """Variables that wires read."""
    numbers: dict[str, int] = field(default_factory=dict)
    """The last number that a function was named with, by its kind: all up to it are taken."""

    @classmethod
    def of(cls, source: Source, listing: Listing) -> Scope:
        """Everything that is declared, and the functions that the settings name."""
        self, places = cls(), settings_of(source.comments, listing)
        for declaration in source.declarations:
            if declaration.name.upper in self.variables:
                raise declaration.name.error(f"{declaration.name.text} is declared again")
            self.variables[declaration.name.upper] = declaration
        for entry, place in zip(listing.settings, places, strict=True):
            self._add_described(dict(entry), place)
        for declaration in source.declarations:
            self._add_declared(declaration)
        for declaration in source.declarations:
            match = STANDS_FOR.fullmatch(declaration.note)
            item = self.items.get(match.group(1).upper()) if match else None
            if match and item and item.kind.function and declaration.name.upper not in self.items:
                row = next((row for row in item.kind.table.rows if row.name == match.group(2)), None)
                if row is not None:
                    self.aliases[declaration.name.upper] = (item, row)
        return self

    def _add_described(self, entry: dict[str, Any], place: Comment) -> None:
        """An item of the settings; instances must be declared, and as what they say."""
        name, kind = entry.get("loop") or entry.get("block"), LIBRARY.get(str(entry.get("type")).upper())
        if not isinstance(name, str) or kind is None:
            message = f"the comment names no block of the library: {json.dumps(entry, ensure_ascii=False)[:80]}"
            raise ListingError(message, place.line, place.column)
        declaration = self.variables.get(name.upper())
        if declaration is not None and declaration.type_name != kind.name.upper():
            raise declaration.name.error(f"{name} is declared otherwise than the comment in line {place.line} says")
        if declaration is None and not kind.function:
            raise ListingError(f"{name} is not declared", place.line, place.column)
        self._add(Item(declaration.name.text if declaration else name, kind, entry), place.line, place.column)

    def _add_declared(self, declaration: Declaration) -> None:
        """An instance that no comment speaks of."""
        inside = next((LIBRARY[token.upper] for token in declaration.type if token.upper in LIBRARY), None)
        if inside is None or declaration.name.upper in self.items:
            return
        if len(declaration.type) > 1:
            raise declaration.type[0].error(
                f"{declaration.name.text}: instances of {inside.name} are declared one by one"
            )
        if inside.function:
            raise declaration.type[0].error(f"{inside.name} is a function, which has no instance")
        key = "loop" if inside.name in LOOP_TYPES else "block"
        entry = {key: declaration.name.text, "type": inside.name}
        self._add(Item(declaration.name.text, inside, entry), declaration.name.line, declaration.name.column)

    def _add(self, item: Item, line: int, column: int) -> None:
        if item.name.upper() in self.items:
            raise ListingError(f"{item.name} stands here again", line, column)
        check_name(item.name, line, column)
        self.items[item.name.upper()] = item

    def new_function(self, kind: BlockType, wanted: str | None, at: Token) -> Item:
        """A function that no comment speaks of; its name is that of its outputs' variables, or one that is free."""
        stem = kind.name.removeprefix("Control")
        name = wanted or f"{stem}_1"
        while name.upper() in self.items or name.upper() in self.variables:
            self.numbers[stem] = self.numbers.get(stem, 1) + 1
            name = f"{stem}_{self.numbers[stem]}"
        item = Item(name, kind, {"block": name, "type": kind.name})
        self._add(item, at.line, at.column)
        return item

    # --- names -------------------------------------------------------------------------------------------------------

    def instance(self, name: str) -> Item | None:
        """An instance by its name, in capitals; functions have none."""
        item = self.items.get(name)
        return None if item is None or item.kind.function else item

    def row(self, item: Item, parts: tuple[Token, ...], access: str = "") -> Parameter:
        """A parameter of a block, ``ErrBits.Kp``."""
        text = ".".join(part.text for part in parts)
        rows = {row.name.upper(): row for row in item.kind.table.rows if access in {"", row.access}}
        row = rows.get(text.upper())
        if row is None:
            near = nearest(text.upper(), rows)
            hint = f"; did you mean {rows[near].name}?" if near else ""
            what = f"{access} " if access else ""
            raise parts[0].error(f"{item.kind.name} has no {what}parameter {text}{hint}")
        return row

    def resolve(self, parts: tuple[Token, ...]) -> tuple[str, IecType]:
        """What a name in an expression stands for, and its type."""
        first, text = parts[0], ".".join(part.text for part in parts)
        item = self.instance(first.upper)
        if item is not None and len(parts) > 1:
            row = self.row(item, parts[1:])
            return f"{item.name}.{row.name}", row.type
        if first.upper in self.aliases and len(parts) == 1:
            item, row = self.aliases[first.upper]
            self._refuse_assigned(first)
            return f"{item.name}.{row.name}", row.type
        if first.upper in self.structures and len(parts) > 1:
            item, prefix = self.structures[first.upper]
            self._refuse_assigned(first)
            row = self.row(item, (prefix, *parts[1:]))
            return f"{item.name}.{row.name}", row.type
        declared = self.variables.get(first.upper)
        if item is not None or declared is None or len(parts) > 1:
            near = nearest(first.upper, [*self.variables])
            hint = f"; did you mean {self.variables[near].name.text}?" if near and near != first.upper else ""
            raise first.error(f"{text} is no variable that the program declares, and no parameter{hint}")
        self._refuse_assigned(first)
        return self._signal(declared)

    def _refuse_assigned(self, name: Token) -> None:
        """Refuses a variable that the program assigns: its value is known only where it is assigned."""
        if name.upper in self.assigned:
            line = self.assigned[name.upper].line
            message = f"{name.text} is assigned in line {line}: wire what it is assigned there"
            raise name.error(message)

    def _signal(self, declared: Declaration) -> tuple[str, IecType]:
        name, kind = declared.name, declared.type_name
        if kind not in {*SIGNAL_TYPES, *REALS, *INTEGERS}:
            raise name.error(f"{name.text} is read by a block, and is neither a number nor a TIME nor a BOOL")
        check_name(name.text, name.line, name.column)
        self.used.add(name.upper)
        return name.text, SIGNAL_TYPES.get(kind, REAL if kind in REALS else INT)

    def signals(self, *, everything: bool) -> Iterator[Declaration]:
        """Variables that come from outside: those that wires read, or all of a fitting type."""
        for upper, declaration in self.variables.items():
            fits = declaration.type_name in SIGNAL_TYPES and upper not in self.aliases and upper not in self.assigned
            if upper in self.used or (everything and fits):
                yield declaration
