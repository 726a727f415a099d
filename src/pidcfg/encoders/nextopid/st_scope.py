"""A text as one program: its declarations and statements, its names, and its expressions as code."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import get_args

from pydantic_core import PydanticCustomError

from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES, BlockType
from pidcfg.encoders.nextopid.st_write import EQUALITY, MAX_PARENTHESES, OPERATORS, PRODUCT, SUM
from pidcfg.encoders.parameters import Parameter
from pidcfg.encoders.structured_text import (
    BOOLEAN_WORDS,
    END,
    INTEGER_TYPES,
    NAME,
    REAL_TYPES,
    VARIABLE_KEYWORDS,
    Comment,
    Cursor,
    Declaration,
    Statement,
    Token,
    drop_externals,
    is_literal,
    name_chain,
    name_of,
    number_of,
    read_declarations,
    read_statement,
    settings_of,
    tokens_of,
)
from pidcfg.schemas.expressions import (
    ABSOLUTE,
    CONSTANT,
    KINDS_BY_TYPE,
    LARGEST_VALUE,
    MAX_LENGTH,
    MAXIMUM,
    MINIMUM,
    NEGATE,
    NOT,
    ROOT,
    SIGNAL,
    TRUTH,
)
from pidcfg.schemas.iec import BOOL, INT, REAL, TIME, IecType, TimeNumber, Wire, parse_identifier
from pidcfg.text.paths import Data
from pidcfg.text.signs import closest_name

# --- A text as one program: its declarations, statements and comments, and what stands beside it ----------------------

BLOCK_NAMES = frozenset(name.upper() for name in BLOCK_TYPES)
"""Types of the library, in capitals."""
SKIPPED_UNITS = frozenset(("FUNCTION", "FUNCTION_BLOCK", "TYPE"))
"""What may stand beside the program, and is left out up to its end."""
REFUSED_UNITS = frozenset(
    (
        "CONFIGURATION",
        "RESOURCE",
        "CLASS",
        "INTERFACE",
        "METHOD",
        "PROPERTY",
        "ACTION",
        "NAMESPACE",
    )
)


@dataclass(slots=True)
class Source:
    """A program as written."""

    program: Token | None = None
    declarations: list[Declaration] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    comments: list[Comment] = field(default_factory=list)
    skipped: list[int] = field(default_factory=list)
    """Where parts begin that are left out."""


def parse_st(text: str) -> Source:
    """A program; raises `ListingError` at what cannot be read."""
    tokens, comments = tokens_of(text)
    source, cursor, has_ended = Source(comments=comments), Cursor(tokens), False
    while cursor.next_token.kind != END:
        word = cursor.next_token.upper
        if word in VARIABLE_KEYWORDS:
            source.declarations += read_declarations(cursor)
        elif word in SKIPPED_UNITS:
            source.skipped.append(cursor.next_token.line)
            _skip_unit(cursor)
        elif word == "PROGRAM" or word in REFUSED_UNITS:
            token = cursor.take_token()
            if word != "PROGRAM" or source.program is not None:
                raise token.error(f"{word}: a file holds one PROGRAM, with its variables and statements")
            source.program = name_of(cursor, "PROGRAM")
        elif word == "END_PROGRAM" and not has_ended:
            has_ended = bool(cursor.take_token())
        elif has_ended:
            raise cursor.next_token.error(f"{cursor.next_token.text!r} stands behind END_PROGRAM")
        else:
            source.statements += read_statement(cursor)
    source.declarations = drop_externals(source.declarations)
    owners = _list_owners(source)
    source.statements = [drop_list_names(whole, owners) for whole in source.statements]
    return source


def _skip_unit(cursor: Cursor) -> None:
    """Moves behind a part that is no program, which has no blocks of the library."""
    head = cursor.take_token()
    while cursor.next_token.upper != f"END_{head.upper}":
        token = cursor.take_token()
        if token.kind == END:
            raise head.error(f"{head.text} has no END_{head.upper}")
        if token.kind == NAME and token.upper in BLOCK_NAMES:
            raise token.error(f"{token.text} stands in a {head.text}; blocks of the library are read in a program only")
    cursor.take_token()


def _list_owners(source: Source) -> dict[str, set[str]]:
    """The lists of global variables by the names that the program writes before them, each with its variables."""
    declared = {declaration.name.upper for declaration in source.declarations}
    lists: dict[str, Token] = {}
    shared = {one.name.upper for one in source.declarations if one.section == "VAR_GLOBAL"}
    for statement_read in source.statements:
        for previous, first, dot, second in _token_fours(statement_read.tokens):
            is_list = first.kind == NAME and dot.text == "." and first.upper not in declared and previous.text != "."
            if not is_list or second.upper not in shared:
                continue
            other = lists.setdefault(second.upper, first)
            if other.upper != first.upper:
                raise first.error(f"{second.text} stands in {other.text} in line {other.line} and in {first.text} here")
    owners: dict[str, set[str]] = {}
    for variable, first in lists.items():
        owners.setdefault(first.upper, set()).add(variable)
    return owners


def _token_fours(tokens: Sequence[Token]) -> Iterator[tuple[Token, ...]]:
    """Each token but the last two, between the one before and the two behind."""
    before = (tokens[0]._replace(kind=END, text=""), *tokens)
    return zip(before, tokens, tokens[1:], tokens[2:], strict=False)


def parse_body(text: str, line: int, source: Source) -> None:
    """Statements alone, which begin in this line of a file."""
    tokens, comments = tokens_of(text, line)
    source.comments += comments
    cursor = Cursor(tokens)
    while cursor.next_token.kind != END:
        source.statements += read_statement(cursor)


def drop_list_names(statement_read: Statement, owners: Mapping[str, set[str]]) -> Statement:
    """A statement without the names of lists before their variables, ``GVL.TIC_1``."""
    tokens, tokens_kept, index = statement_read.tokens, [], 0
    while index < len(tokens):
        member = tokens[index + 2].upper if index + 2 < len(tokens) and tokens[index + 1].text == "." else ""
        is_member = index > 0 and tokens[index - 1].text == "."
        if not is_member and tokens[index].kind == NAME and member in owners.get(tokens[index].upper, ()):
            index += 2
        tokens_kept.append(tokens[index])
        index += 1
    return Statement(tuple(tokens_kept))


# --- The names of a program that is read: instances of the library, functions, and variables --------------------------

LIBRARY = {name.upper(): kind for name, kind in BLOCK_TYPES.items()}
SIGNAL_TYPES = {kind.name: kind for kind in (BOOL, REAL, INT, TIME)}
"""Types that a signal of a configuration has; other numbers become REAL."""
PARAMETER_NOTE = re.compile(r"(\w+)\.(\w+)")


@dataclass(slots=True)
class Item:
    """A block or function of the library that the program uses."""

    name: str
    kind: BlockType
    entry: Data
    place: Token | None = None
    """Its call, once the reader is past it."""
    calls_before: int = -1
    """The number of that call among all calls of the program, from 0; -1: not called."""
    cycles: int = 1

    @property
    def is_called(self) -> bool:
        """Whether the program calls it."""
        return self.place is not None


def can_wire(model: object, name: str) -> bool:
    """Whether a parameter takes an expression; ``name`` may be that of a structure's member."""
    key, _, member = name.partition(".")
    field = getattr(model, "model_fields", {}).get(key)
    annotations = () if field is None else (field.annotation, *get_args(field.annotation))
    return any(can_wire(inner, member) if member else _takes_wire(inner) for inner in annotations)


def _takes_wire(annotation: object) -> bool:
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
    assigned_variables: dict[str, Token] = field(default_factory=dict)
    """Variables that skipped statements assign."""
    used_variables: set[str] = field(default_factory=set)
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
            self._add_from_settings(dict(entry), place)
        for declaration in source.declarations:
            self._add_instance(declaration)
        for declaration in source.declarations:
            match = PARAMETER_NOTE.fullmatch(declaration.note)
            item = self.items.get(match.group(1).upper()) if match else None
            if match and item and item.kind.function and declaration.name.upper not in self.items:
                row = next((row for row in item.kind.table.rows if row.name == match.group(2)), None)
                if row is not None:
                    self.aliases[declaration.name.upper] = (item, row)
        return self

    def _add_from_settings(self, entry: dict[str, object], place: Comment) -> None:
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
        self._add_item(Item(declaration.name.text if declaration else name, kind, entry), place.line, place.column)

    def _add_instance(self, declaration: Declaration) -> None:
        """An instance that no comment speaks of."""
        block_type = next((LIBRARY[token.upper] for token in declaration.type if token.upper in LIBRARY), None)
        if block_type is None or declaration.name.upper in self.items:
            return
        if len(declaration.type) > 1:
            raise declaration.type[0].error(
                f"{declaration.name.text}: instances of {block_type.name} are declared one by one"
            )
        if block_type.function:
            raise declaration.type[0].error(f"{block_type.name} is a function, which has no instance")
        key = "loop" if block_type.name in LOOP_TYPES else "block"
        entry = {key: declaration.name.text, "type": block_type.name}
        self._add_item(Item(declaration.name.text, block_type, entry), declaration.name.line, declaration.name.column)

    def _add_item(self, item: Item, line: int, column: int) -> None:
        if item.name.upper() in self.items:
            raise ListingError(f"{item.name} stands here again", line, column)
        check_name(item.name, line, column)
        self.items[item.name.upper()] = item

    def new_function(self, kind: BlockType, name_wanted: str | None, token: Token) -> Item:
        """A function that no comment speaks of; its name is that of its outputs' variables, or one that is free."""
        stem = kind.name.removeprefix("Control")
        name = name_wanted or f"{stem}_1"
        while name.upper() in self.items or name.upper() in self.variables:
            self.numbers[stem] = self.numbers.get(stem, 1) + 1
            name = f"{stem}_{self.numbers[stem]}"
        item = Item(name, kind, {"block": name, "type": kind.name})
        self._add_item(item, token.line, token.column)
        return item

    # --- names -------------------------------------------------------------------------------------------------------

    def find_instance(self, name: str) -> Item | None:
        """An instance by its name, in capitals; functions have none."""
        item = self.items.get(name)
        return None if item is None or item.kind.function else item

    def find_parameter(self, item: Item, parts: tuple[Token, ...], access: str = "") -> Parameter:
        """A parameter of a block, ``ErrBits.Kp``."""
        text = ".".join(part.text for part in parts)
        rows = {row.name.upper(): row for row in item.kind.table.rows if access in {"", row.access}}
        row = rows.get(text.upper())
        if row is None:
            near = closest_name(text.upper(), rows)
            hint = f"; did you mean {rows[near].name}?" if near else ""
            what = f"{access} " if access else ""
            raise parts[0].error(f"{item.kind.name} has no {what}parameter {text}{hint}")
        return row

    def resolve(self, parts: tuple[Token, ...]) -> tuple[str, IecType]:
        """What a name in an expression stands for, and its type."""
        first, text = parts[0], ".".join(part.text for part in parts)
        item = self.find_instance(first.upper)
        if item is not None and len(parts) > 1:
            row = self.find_parameter(item, parts[1:])
            return f"{item.name}.{row.name}", row.type
        if first.upper in self.aliases and len(parts) == 1:
            item, row = self.aliases[first.upper]
            self._refuse_assigned(first)
            return f"{item.name}.{row.name}", row.type
        if first.upper in self.structures and len(parts) > 1:
            item, prefix = self.structures[first.upper]
            self._refuse_assigned(first)
            row = self.find_parameter(item, (prefix, *parts[1:]))
            return f"{item.name}.{row.name}", row.type
        declaration = self.variables.get(first.upper)
        if item is not None or declaration is None or len(parts) > 1:
            near = closest_name(first.upper, [*self.variables])
            hint = f"; did you mean {self.variables[near].name.text}?" if near and near != first.upper else ""
            raise first.error(f"{text} is no variable that the program declares, and no parameter{hint}")
        self._refuse_assigned(first)
        return self._use_signal(declaration)

    def _refuse_assigned(self, name: Token) -> None:
        """Refuses a variable that the program assigns: its value is known only where it is assigned."""
        if name.upper in self.assigned_variables:
            line = self.assigned_variables[name.upper].line
            message = f"{name.text} is assigned in line {line}: wire what it is assigned there"
            raise name.error(message)

    def _use_signal(self, declaration: Declaration) -> tuple[str, IecType]:
        name, kind = declaration.name, declaration.type_name
        if kind not in {*SIGNAL_TYPES, *REAL_TYPES, *INTEGER_TYPES}:
            raise name.error(f"{name.text} is read by a block, and is neither a number nor a TIME nor a BOOL")
        check_name(name.text, name.line, name.column)
        self.used_variables.add(name.upper)
        return name.text, SIGNAL_TYPES.get(kind, REAL if kind in REAL_TYPES else INT)

    def find_signals(self, *, takes_all: bool) -> Iterator[Declaration]:
        """Variables that come from outside: those that wires read, or all of a fitting type."""
        for upper, declaration in self.variables.items():
            can_be_signal = (
                declaration.type_name in SIGNAL_TYPES
                and upper not in self.aliases
                and upper not in self.assigned_variables
            )
            if upper in self.used_variables or (takes_all and can_be_signal):
                yield declaration


# --- Expressions of Structured Text as the code of `pidcfg.schemas.expressions`, with the type of everything ----------
#
# A program tells whole numbers from real ones, and divides them otherwise; it joins BOOLs, and has times. What means
# the same in a configuration is read; a type that an operator does not take is refused where it stands.

REAL_CONVERSIONS = frozenset((*(f"{kind}_TO_REAL" for kind in INTEGER_TYPES | {"LREAL"}), "TO_REAL"))
"""Conversions that change no number of ours."""
WHOLE_CONVERSIONS = {"INT": frozenset(("REAL_TO_INT", "TO_INT")), "UINT": frozenset(("REAL_TO_UINT", "TO_UINT"))}
"""Conversions of a whole expression, by the type of the parameter that it is for."""
TIME_TO_REAL = "TIME_TO_REAL"
MS_PER_SECOND = 1000
FUNCTIONS = {"MIN": (MINIMUM, 2), "MAX": (MAXIMUM, 2), "ABS": (ABSOLUTE, 1), "SQRT": (ROOT, 1)}
SUM_SIGNS = ("+", "-")
OPERATORS_BY_SIGN = {sign: (op, rank) for op, (sign, rank) in OPERATORS.items()}
"""Operators between two operands, and how tightly they bind."""
OPERATOR_ALIASES = {"&": "AND"}
ALLOWED_TEXT = "numbers, names, conditions, + - * / ( ) and MIN, MAX, ABS, SQRT can be wired"
TOO_LONG_TEXT = f"the expression is longer than {MAX_LENGTH} characters: assign a part of it to a variable before"
BOOL_KIND, REAL_KIND, WHOLE_KIND, TIME_KIND = "bool", "real", "whole", "time"
KIND_TEXTS = {BOOL_KIND: "a BOOL", REAL_KIND: "a REAL", WHOLE_KIND: "a whole number", TIME_KIND: "a TIME"}
NUMBERS = frozenset((REAL_KIND, WHOLE_KIND))


@dataclass(slots=True)
class Wiring:
    """Reads an expression into code and names; ``resolve`` gives the full name and the type of a name as written.

    Every part returns the kind of what it has read: ``bool``, ``real``, ``whole`` or ``time``.
    """

    cursor: Cursor
    resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]]
    code: list[int] = field(default_factory=list)
    constants: list[float] = field(default_factory=list)
    names: list[str] = field(default_factory=list)

    @classmethod
    def parse(
        cls, tokens: Sequence[Token], kind: IecType, resolve: Callable[[tuple[Token, ...]], tuple[str, IecType]]
    ) -> Wiring:
        """The expression that is wired to a parameter of this type."""
        end = Token(END, "the end of the expression", tokens[-1].line, tokens[-1].column)
        self = cls(Cursor((*tokens, end, end, end, end, end)), resolve)
        if self.cursor.next_token.upper in WHOLE_CONVERSIONS.get(kind.name, ()):
            word = self.cursor.take_token()
            self.cursor.expect_token("(", word.text)
            kind_found = self.parse_expression(1)
            self.cursor.expect_token(")", "the expression")
        else:
            kind_found = self.parse_expression(0)
        if len(self.code) > 2 * MAX_LENGTH:  # each pair of it is a character at least
            raise tokens[0].error(TOO_LONG_TEXT)
        if self.cursor.next_token.kind != END:
            raise self.cursor.next_token.error(f"unexpected {self.cursor.next_token.text!r}; {ALLOWED_TEXT}")
        expected = "a BOOL is wanted" if kind.kind == "bool" else "numbers are wanted"
        subject = f"{self.names[0]} is" if self.code[::2] == [SIGNAL] else "this is"
        require(
            (kind_found in NUMBERS) == (KINDS_BY_TYPE[kind.kind] == "number"),
            tokens[0],
            f"{subject} {KIND_TEXTS[kind_found]}; {expected}",
        )
        return self

    def emit_code(self, op: int, operand: int = 0) -> None:
        """One pair of code."""
        self.code += (op, operand)

    def parse_expression(self, depth: int, min_rank: int = 0) -> str:
        """Operands and the operators between them that bind as tightly as ``min_rank``, from left to right."""
        if depth > MAX_PARENTHESES:
            raise self.cursor.next_token.error(f"more than {MAX_PARENTHESES} levels of nesting")
        kind = REAL_KIND if min_rank <= PRODUCT and self.parse_seconds() else self.parse_factor(depth)
        while True:
            sign = self.cursor.next_token
            op, rank = OPERATORS_BY_SIGN.get(OPERATOR_ALIASES.get(sign.text, sign.upper), (0, -1))
            if rank < min_rank:
                return kind
            self.cursor.take_token()
            kind = self.joined_kind(sign, rank, kind, self.parse_expression(depth, rank + 1))
            self.emit_code(op)

    def joined_kind(self, sign: Token, rank: int, left: str, right: str) -> str:
        """The kind that an operator gives; refuses operands that it does not take."""
        kinds = {left, right}
        if rank < EQUALITY:
            require(kinds == {BOOL_KIND}, sign, f"{sign.text} takes BOOLs")
        elif rank < SUM:
            is_comparable = kinds <= NUMBERS or kinds == {TIME_KIND} or (kinds == {BOOL_KIND} and rank == EQUALITY)
            require(is_comparable, sign, f"{KIND_TEXTS[left]} and {KIND_TEXTS[right]} are compared here")
        else:
            are_times = kinds == {TIME_KIND} and rank == SUM
            require(kinds <= NUMBERS or are_times, sign, f"{sign.text} takes two numbers")
            if kinds == {WHOLE_KIND} and sign.text == "/":
                raise sign.error("whole numbers are divided without a remainder; write them as REAL, as in 1.0 / 2.0")
            return left if left == right else REAL_KIND
        return BOOL_KIND

    def parse_seconds(self) -> bool:
        """``TIME_TO_REAL(x) / 1000.0``: a time in s, as it counts in a configuration; False where that is not here."""
        cursor, at = self.cursor, self.cursor.position
        if cursor.next_token.upper != TIME_TO_REAL or cursor.tokens[at + 1].text != "(":
            return False
        parts = name_chain(cursor.tokens, at + 2)
        end = at + 2 + max(2 * len(parts) - 1, 0)
        parenthesis, slash, number = (cursor.tokens[min(end + i, len(cursor.tokens) - 1)] for i in range(3))
        if (
            not parts
            or (parenthesis.text, slash.text) != (")", "/")
            or not is_literal(number)
            or number_of(number) != MS_PER_SECOND
        ):
            return False
        name, kind = self.resolve(parts)
        require(kind.kind == TIME_KIND, parts[0], f"{name} is {kind.name}; a TIME is wanted")
        self.emit_signal(name)
        cursor.position = end + 3
        return True

    def parse_factor(self, depth: int) -> str:
        """A number, a name, a function, parentheses, or one of them with a sign or NOT."""
        cursor = self.cursor
        if cursor.next_token.upper == "NOT" and cursor.next_token.kind == NAME:
            return self.parse_not(depth)
        negative, signs = False, cursor.position
        while cursor.next_token.text in SUM_SIGNS:
            negative ^= cursor.take_token().text == "-"
        token, signed = cursor.next_token, cursor.position > signs
        if is_literal(token):
            kind = self.parse_constant(cursor.take_token())
        elif token.text == "(":
            cursor.take_token()
            kind = self.parse_expression(depth + 1)
            cursor.expect_token(")", "the expression")
        elif token.kind == NAME:
            kind = self.parse_name_or_call(depth)
        else:
            raise token.error(f"a number or a name is missing before {token.text!r}; {ALLOWED_TEXT}")
        require(not signed or kind in NUMBERS, token, "a sign wants a number")
        if negative:
            self.emit_code(NEGATE)
        return kind

    def parse_not(self, depth: int) -> str:
        """NOT, any number of times, and its BOOL."""
        count = 0
        while self.cursor.next_token.upper == "NOT":
            self.cursor.take_token()
            count += 1
        start = self.cursor.next_token
        require(
            self.parse_factor(depth) == BOOL_KIND,
            start,
            "NOT takes a BOOL; put a comparison into parentheses: NOT (PV < 4.0)",
        )
        if count % 2:
            self.emit_code(NOT)
        return BOOL_KIND

    def parse_constant(self, token: Token) -> str:
        """A number, a time in s, or a truth with its type before it."""
        value = number_of(token)
        if isinstance(value, bool):
            self.emit_code(TRUTH, int(value))
            return BOOL_KIND
        if not 0 <= value <= LARGEST_VALUE:
            raise token.error(f"{token.text} cannot stand in an expression")
        self.emit_code(CONSTANT, len(self.constants))
        self.constants.append(float(value))
        return TIME_KIND if isinstance(value, TimeNumber) else WHOLE_KIND if isinstance(value, int) else REAL_KIND

    def emit_signal(self, name: str) -> None:
        """The value of a name."""
        self.emit_code(SIGNAL, len(self.names))
        self.names.append(name)

    def parse_name_or_call(self, depth: int) -> str:
        """A name, TRUE or FALSE, or a function with its arguments."""
        cursor = self.cursor
        parts = name_chain(cursor.tokens, cursor.position)
        if cursor.tokens[cursor.position + 1].text == "(":
            return self.parse_call(depth)
        if len(parts) == 1 and parts[0].upper in BOOLEAN_WORDS:
            self.emit_code(TRUTH, int(BOOLEAN_WORDS[parts[0].upper]))
            cursor.take_token()
            return BOOL_KIND
        name, kind = self.resolve(parts)
        require(kind.kind in KIND_TEXTS, parts[0], f"{name} is {kind.name}; numbers and BOOLs can be wired")
        cursor.position += 2 * len(parts) - 1
        self.emit_signal(name)
        return kind.kind

    def parse_call(self, depth: int) -> str:
        """A function."""
        word = self.cursor.take_token()
        if any(word.upper in words for words in WHOLE_CONVERSIONS.values()):
            raise word.error(f"{word.text} can only be around the whole expression of an INT parameter")
        if word.upper not in {*FUNCTIONS, *REAL_CONVERSIONS, TIME_TO_REAL}:
            raise word.error(f"{word.text} is a function that cannot be wired; {ALLOWED_TEXT}")
        op, min_count = FUNCTIONS.get(word.upper, (0, 1))
        self.cursor.expect_token("(", word.text)
        kinds = [self.parse_expression(depth + 1)]
        while self.cursor.next_token.text == ",":
            self.cursor.take_token()
            kinds.append(self.parse_expression(depth + 1))
            self.emit_code(op)
        self.cursor.expect_token(")", "the arguments")
        if len(kinds) < min_count or (min_count == 1 and len(kinds) > 1):
            raise word.error(f"{word.text} does not take {len(kinds)} argument{'s' * (len(kinds) > 1)}")
        if word.upper == TIME_TO_REAL:
            require(kinds == [TIME_KIND], word, f"{word.text} takes a TIME")
            raise word.error(f"{word.text} gives ms; write {word.text}(…) / 1000.0, since a configuration has s")
        require({*kinds} <= NUMBERS, word, f"{word.text} takes numbers")
        if op in (ABSOLUTE, ROOT):
            self.emit_code(op)
        return REAL_KIND if word.upper in {"SQRT", *REAL_CONVERSIONS} or REAL_KIND in kinds else WHOLE_KIND


def require(is_met: bool, token: Token, message: str) -> None:  # noqa: FBT001 - what is wanted
    """Refuses what is not so, where it stands."""
    if not is_met:
        raise token.error(message)
