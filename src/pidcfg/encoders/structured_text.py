"""Structured Text (IEC 61131-3) as far as every vendor has it: words, statements, literals and comments."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import NamedTuple

from pidcfg.encoders.listing import Listing, ListingError, load_json
from pidcfg.encoders.parameters import Content, read_content, store_content
from pidcfg.schemas.iec import LITERAL_WITH_TYPE, IecType, TimeNumber, real_text, time_seconds
from pidcfg.schemas.numbers import MAX_DIGITS
from pidcfg.text.signs import CONTROL_SIGNS
from pidcfg.text.writer import json_line

# --- Structured Text as words and signs with their places, and its comments -------------------------------------------

NAME, NUMBER, TYPED_LITERAL, OTHER_TOKEN, SIGN, END = "name", "number", "typed", "other", "sign", "end"
"""What a token is: ``typed`` is a literal with a prefix (``16#FF``), ``other`` a text or a location."""


class Token(NamedTuple):
    """A word or sign of the program."""

    kind: str
    text: str
    line: int
    column: int
    note: str = ""
    """The comment that stands behind it on the same line."""

    @property
    def upper(self) -> str:
        """In capitals, since the language does not tell them from small letters."""
        return self.text.upper()

    def error(self, message: str) -> ListingError:
        """A fault at this place."""
        return ListingError(message, self.line, self.column)


class Comment(NamedTuple):
    """What people read, and where it stands."""

    text: str
    line: int
    column: int


TOKEN_FORMS = (
    ("skip", r"[ \t\r\n\f\ufeff]+"),
    ("line", r"//[^\n]*"),
    ("block", r"\(\*|/\*"),
    ("pragma", r"\{[^}]*\}"),
    (OTHER_TOKEN, r"""'(?:\$.|[^'$\n])*'|"(?:\$.|[^"$\n])*"|%[\w.*]+"""),
    (TYPED_LITERAL, r"(?:[DLT]*(?:TIME|DATE|T|D|DT|TOD|TIME_OF_DAY|DATE_AND_TIME)#[-+\w.:]+|\w+(?:#\w+)?#[-+]?[\w.]+)"),
    (NUMBER, r"\d[\d_]*(?:\.\d[\d_]*)?(?:[eE][-+]?\d+)?(?![^\W\d])"),
    (NAME, r"[^\W\d]\w*"),
    (SIGN, r":=|=>|<=|>=|<>|\*\*|\.\.|[-+*/=<>()\[\],;:.&^#@]"),
)
TOKEN_PATTERN = re.compile("|".join(f"(?P<{kind}>{form})" for kind, form in TOKEN_FORMS), re.DOTALL)
COMMENT_ENDS = {"(*": re.compile(r"\(\*|\*\)"), "/*": re.compile(r"\*/")}
"""Comments in parentheses may stand in each other."""

CONDITIONAL_PRAGMA = re.compile(r"\{\s*(IF|ELSIF|ELSE|END_IF)\b", re.IGNORECASE)
SKIPPED_OPENING = re.compile(
    r"[\s\ufeff]+|(?P<line>//[^\n]*)|(?P<block>\(\*|/\*)|\{[^}]*\}(?=\s*[A-Z(/{])", re.IGNORECASE
)
"""What may stand before a program; a pragma has a word behind it, which JSON has not."""


def first_word_offset(text: str) -> int:
    """Where the first word of a text begins, behind comments and pragmas; the end, where a comment has none."""
    position = 0
    while match := SKIPPED_OPENING.match(text, position):
        position = match.end()
        if match.lastgroup == "block":
            try:
                position = _comment_end(text, match.group(), position, 1, 1)
            except ListingError:
                return len(text)
    return position


def tokens_of(text: str, line: int = 1) -> tuple[list[Token], list[Comment]]:
    """All tokens, the last of which is the end, and all comments; raises `ListingError`."""
    tokens: list[Token] = []
    comments: list[Comment] = []
    pos, start = 0, 0
    while pos < len(text):
        match = TOKEN_PATTERN.match(text, pos)
        if match is None:
            raise ListingError(f"{text[pos]!r} is nothing that Structured Text has here", line, pos - start + 1)
        kind, column, end = match.lastgroup or "", pos - start + 1, match.end()
        if kind in {"line", "block"}:
            end = _comment_end(text, match.group(), end, line, column)
            inner = text[pos + 2 : end if kind == "line" else end - 2].strip()
            comments.append(Comment(inner, line, column))
            if tokens and tokens[-1].line == line and not tokens[-1].note:
                tokens[-1] = tokens[-1]._replace(note=inner)
        elif kind == "pragma" and (condition := CONDITIONAL_PRAGMA.match(match.group())):
            word = condition.group(1)
            message = f"{{{word} …}}: what stands behind is compiled on a condition only; write down what is compiled"
            raise ListingError(message, line, column)
        elif kind not in {"skip", "pragma"}:
            tokens.append(Token(kind, match.group(), line, column))
        breaks = text.count("\n", pos, end)
        if breaks:
            line, start = line + breaks, text.rindex("\n", pos, end) + 1
        pos = end
    tokens.append(Token(END, "the end of the file", line, pos - start + 1))
    return tokens, comments


def _comment_end(text: str, sign: str, position: int, line: int, column: int) -> int:
    """Where a comment ends."""
    if sign not in COMMENT_ENDS:
        return position
    open_comments = 1
    for match in COMMENT_ENDS[sign].finditer(text, position):
        open_comments += 1 if match.group() == sign else -1
        if not open_comments:
            return match.end()
    raise ListingError(f"the comment that begins here with {sign} has no end", line, column)


# --- Structured Text to declarations and statements; what they mean is found by the reader of each vendor -------------

VARIABLE_KEYWORDS = frozenset(
    ("VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_GLOBAL", "VAR_TEMP", "VAR_EXTERNAL", "VAR_STAT", "VAR_CONFIG")
)
QUALIFIERS = frozenset(("CONSTANT", "RETAIN", "NON_RETAIN", "PERSISTENT"))
STATEMENT_ENDS = {"IF": "END_IF", "CASE": "END_CASE", "FOR": "END_FOR", "WHILE": "END_WHILE", "REPEAT": "END_REPEAT"}
"""Statements that have others inside."""
MAX_STRUCTURE_DEPTH = 8
"""Structures in each other."""
MAX_STATEMENT_DEPTH = 32
"""Statements in each other."""

Initial = tuple[Token, ...] | dict[str, "Member"]
"""The tokens of a literal, or the members of a structure by name."""


class Member(NamedTuple):
    """A member of an initial value."""

    name: Token
    value: Initial


class Declaration(NamedTuple):
    """A variable: its name, its type, its initial value, and the comment behind it."""

    name: Token
    type: tuple[Token, ...]
    initial: Initial | None = None
    note: str = ""
    section: str = "VAR"
    """The word that its block begins with, in capitals."""
    address: tuple[Token, ...] = ()
    """What stands behind AT."""

    @property
    def type_name(self) -> str:
        """The type in capitals, if it is one word."""
        return self.type[0].upper if len(self.type) == 1 else ""


class Statement(NamedTuple):
    """A statement without its semicolon, and the end as its last token."""

    tokens: tuple[Token, ...]


@dataclass(slots=True)
class Cursor:
    """Tokens, and where reading has come to."""

    tokens: Sequence[Token]
    position: int = 0

    @property
    def next_token(self) -> Token:
        """The token that comes next."""
        return self.tokens[min(self.position, len(self.tokens) - 1)]

    def take_token(self) -> Token:
        """The token that comes next, which is then behind."""
        token = self.next_token
        self.position += 1
        return token

    def expect_token(self, sign: str, after: str) -> Token:
        """A sign or word that must come next."""
        token = self.take_token()
        if token.upper != sign or token.kind == END:
            raise token.error(f"{sign!r} is missing after {after}, before {token.text!r}")
        return token

    def take_until(self, end_signs: frozenset[str]) -> tuple[Token, ...]:
        """The tokens up to one of these outside of all parentheses."""
        start, depth = self.position, 0
        while self.next_token.kind != END and not (depth == 0 and self.next_token.upper in end_signs):
            depth += (
                (self.next_token.text in "([") - (self.next_token.text in ")]") if len(self.next_token.text) == 1 else 0
            )
            if depth < 0 or self.next_token.text == ";":
                raise self.next_token.error(f"unexpected {self.next_token.text!r}")
            self.position += 1
        return tuple(self.tokens[start : self.position])


SEMICOLON = frozenset(";")


def name_of(cursor: Cursor, after: str) -> Token:
    """A name that must come next."""
    token = cursor.take_token()
    if token.kind != NAME:
        raise token.error(f"a name is missing after {after}, before {token.text!r}")
    return token


# --- declarations ----------------------------------------------------------------------------------------------------


def read_declarations(cursor: Cursor) -> Iterator[Declaration]:
    """A block of variables, from VAR to END_VAR."""
    keyword = cursor.take_token()
    while cursor.next_token.upper in QUALIFIERS:
        cursor.take_token()
    while cursor.next_token.upper != "END_VAR":
        if cursor.next_token.kind == END:
            raise keyword.error(f"{keyword.text} has no END_VAR")
        names = [name_of(cursor, "the declarations before")]
        while cursor.next_token.text == ",":
            cursor.take_token()
            names.append(name_of(cursor, "the comma"))
        address = cursor.take_until(frozenset((":", ";")))[1:] if cursor.next_token.upper == "AT" else ()
        cursor.expect_token(":", names[-1].text)
        kind = cursor.take_until(frozenset((":=", ";", "END_VAR")))
        initial = None
        if cursor.next_token.text == ":=":
            cursor.take_token()
            initial = initial_value(cursor.take_until(frozenset((";", "END_VAR"))))
        end = cursor.expect_token(";", "the declaration")
        for name in names:
            yield Declaration(name, kind, initial, end.note, keyword.upper, address)
    cursor.take_token()


def drop_externals(declarations: Iterable[Declaration]) -> list[Declaration]:
    """Declarations without the external ones, where the variable is declared elsewhere in the same file.

    Raises `ListingError` where the types differ. One with a value or an address of its own stays.
    """
    declarations = list(declarations)
    shared = {other.name.upper: other for other in reversed(declarations) if other.section == "VAR_EXTERNAL"}
    shared |= {other.name.upper: other for other in declarations if other.section == "VAR_GLOBAL"}
    declarations_left = []
    for one in declarations:
        other = shared.get(one.name.upper, one)
        if one is other or one.section != "VAR_EXTERNAL" or one.initial is not None or one.address:
            declarations_left.append(one)
        elif [token.upper for token in one.type] != [token.upper for token in other.type]:
            message = f"{one.name.text} is declared with another type than in line {other.name.line}"
            raise one.name.error(message)
    return declarations_left


def initial_value(tokens: tuple[Token, ...], depth: int = 0) -> Initial:
    """An initial value: a structure, ``(SP := 50.0)``, or anything else as it stands."""
    if len(tokens) < 4 or tokens[0].text != "(" or tokens[2].text != ":=":
        return tokens
    if depth > MAX_STRUCTURE_DEPTH:
        raise tokens[0].error("structures are nested too deeply")
    if tokens[-1].text != ")":
        raise tokens[-1].error(f"{tokens[-1].text!r} stands behind the structure")
    cursor = Cursor((*tokens[1:-1], tokens[-1]._replace(kind=END)))
    members: dict[str, Member] = {}
    while True:
        name = name_of(cursor, "the parenthesis or comma")
        cursor.expect_token(":=", name.text)
        value = cursor.take_until(frozenset(","))
        if name.upper in members:
            raise name.error(f"{name.text} stands here again")
        members[name.upper] = Member(name, initial_value(value, depth + 1))
        if cursor.next_token.kind == END:
            return members
        cursor.expect_token(",", "the member")


# --- statements ------------------------------------------------------------------------------------------------------


def read_statement(cursor: Cursor) -> Iterator[Statement]:
    """The next statement; one that is empty is none."""
    start = cursor.position
    if cursor.next_token.upper in STATEMENT_ENDS and cursor.next_token.kind == NAME:
        _skip_nested(cursor)
        end = cursor.position
        if cursor.next_token.text == ";":
            cursor.take_token()
    else:
        cursor.take_until(SEMICOLON)
        end = cursor.position
        if cursor.next_token.kind == END:
            raise cursor.tokens[start].error("the statement that begins here has no end: ';' or ')' is missing")
        cursor.take_token()
    if end > start:
        last = cursor.tokens[end - 1]
        yield Statement((*cursor.tokens[start:end], Token(END, "the end of the statement", last.line, last.column)))


def _skip_nested(cursor: Cursor) -> None:
    """Moves behind a statement with others inside."""
    opened: list[Token] = []
    while True:
        token = cursor.take_token()
        if token.kind == END:
            raise opened[-1].error(f"{opened[-1].text} has no {STATEMENT_ENDS[opened[-1].upper]}")
        if token.kind == NAME and token.upper in STATEMENT_ENDS:
            opened.append(token)
            if len(opened) > MAX_STATEMENT_DEPTH:
                raise token.error(f"more than {MAX_STATEMENT_DEPTH} statements stand in each other")
        elif token.kind == NAME and token.upper == STATEMENT_ENDS[opened[-1].upper]:
            opened.pop()
            if not opened:
                return


class Argument(NamedTuple):
    """An argument of a call: the parameter, ``:=`` or ``=>``, and what stands behind it."""

    name: Token
    sign: str
    value: tuple[Token, ...]


def name_chain(tokens: Sequence[Token], index: int = 0) -> tuple[Token, ...]:
    """A name with the dots and names behind it, ``TIC_1.ErrBits.Kp``, without the dots."""
    parts: list[Token] = []
    while tokens[index].kind == NAME:
        parts.append(tokens[index])
        if tokens[index + 1].text != "." or tokens[index + 2].kind != NAME:
            break
        index += 2
    return tuple(parts)


def call_arguments(tokens: Sequence[Token], callee: str) -> list[Argument]:
    """The arguments of a call from its opening parenthesis to the end of the statement; each has a name."""
    cursor = Cursor((*tokens, Token(END, "the end of the statement", tokens[-1].line, tokens[-1].column)))
    cursor.expect_token("(", callee)
    by_name: dict[str, Argument] = {}
    while cursor.next_token.text != ")":
        name = cursor.take_token()
        sign = cursor.take_token()
        if name.kind != NAME or sign.text not in {":=", "=>"}:
            raise name.error(f"an argument of {callee} has no name; write it as in PV := FT_101")
        value = cursor.take_until(frozenset((",", ")")))
        if not value:
            raise sign.error(f"nothing stands behind {name.text} {sign.text}")
        if name.upper in by_name:
            raise name.error(f"{name.text} stands here again")
        by_name[name.upper] = Argument(name, sign.text, value)
        if cursor.next_token.text != ")":
            cursor.expect_token(",", f"the argument {name.text}")
    cursor.take_token()
    if cursor.next_token.kind != END:
        raise cursor.next_token.error(f"{cursor.next_token.text!r} stands behind the call of {callee}")
    return [*by_name.values()]


def is_literal(token: Token) -> bool:
    """Whether a token is a number, or a literal with a prefix."""
    return token.kind in {NUMBER, TYPED_LITERAL}


# --- Comments and literals of Structured Text as programs of every vendor have them, and the settings in comments -----
#
# What no variable of a program holds stands in comments above it as JSON, ``plc: {…}`` and ``loop: {…}``, for the way
# back.

MAX_LINE_WIDTH = 110
"""Beyond this a declaration or a call gets a line for each parameter."""
BLANKS_PATTERN = re.compile(f"[\\x00-\\x20{CONTROL_SIGNS}]+")
COMMENT_MARKS = re.compile(r"\((?=\*)|\*(?=\))")
"""What would begin or end a comment."""
UNSAFE_IN_COMMENTS = re.compile(f"{COMMENT_MARKS.pattern}|[\\ud800-\\udfff\\ufffe\\uffff]")
"""These, and what no file may hold."""
SETTINGS_START = re.compile(r"(plc|loop):\s*(?=\{)")
"""Beginning of a comment with settings that no parameter holds."""


def comment_text(text: str) -> str:
    """A text of people's on one line, in which no comment ends or begins."""
    return COMMENT_MARKS.sub(lambda sign: f"{sign.group()} ", BLANKS_PATTERN.sub(" ", text))


def settings_text(entry: Mapping[str, object]) -> str:
    """JSON in which no comment ends or begins; such signs can stand in texts only, where there is another way."""
    return UNSAFE_IN_COMMENTS.sub(lambda sign: f"\\u{ord(sign.group()):04x}", json_line(dict(entry)))


def settings_of(comments: Iterable[Comment], listing: Listing) -> list[Comment]:
    """Reads the settings of the comments into the listing; returns the comments of blocks, in the order of entries."""
    block_comments: list[Comment] = []
    for comment in comments:
        head = SETTINGS_START.match(comment.text)
        if head is None:
            continue
        try:
            entry = load_json(comment.text[head.end() :])
        except ListingError as error:
            raise ListingError(f"the settings are {error}", comment.line, comment.column) from None
        if head.group(1) == "plc":
            listing.plc = entry
        else:
            listing.settings = (*listing.settings, entry)
            block_comments.append(comment)
    return block_comments


def literal_text(kind: IecType, content: Content) -> str:
    """A content as the language writes it."""
    if kind.kind == "bool":
        return "TRUE" if content else "FALSE"
    if kind.kind == "word":
        return f"{kind.name}.{content}"
    if kind.kind == "time":
        return str(content)
    return real_text(float(content)) if kind.kind == "real" else str(int(content))


def wrap_call(start: str, parts: list[str]) -> list[str]:
    """On one line, or a line for each part."""
    line = f"{start}{', '.join(parts)});"
    if len(line) <= MAX_LINE_WIDTH:
        return [line]
    return [start, *(f"    {part}," for part in parts[:-1]), f"    {parts[-1]}", ");"]


# --- Literals of Structured Text --------------------------------------------------------------------------------------

BOOLEAN_WORDS = {"TRUE": True, "FALSE": False}
NUMBER_BASES = {"2": 2, "8": 8, "16": 16}
INTEGER_TYPES = frozenset(
    ("SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD")
)
REAL_TYPES = frozenset(("REAL", "LREAL"))


def number_of(token: Token) -> int | Decimal | bool:
    """What a literal means: a whole number, a real one, a truth, or a time in s."""
    if LITERAL_WITH_TYPE.fullmatch(token.text) and token.upper.startswith(("T#", "TIME#")):
        seconds = time_seconds(token.text)
        if seconds is None:
            raise token.error(f"{token.text} is not a TIME; write it as in T#1m30s or T#500ms")
        return TimeNumber(seconds)
    text = token.text.replace("_", "")
    if len(text) > MAX_DIGITS + 8:
        raise token.error(f"a number of more than {MAX_DIGITS} digits")
    prefix, _, rest = text.rpartition("#")
    kind, _, base = prefix.upper().rpartition("#")
    base, kind = (base, kind) if base in NUMBER_BASES else ("", prefix.upper())
    try:
        if kind == "BOOL":
            return {"1": True, "0": False, **BOOLEAN_WORDS}[rest.upper()]
        if base and kind in {"", *INTEGER_TYPES}:
            return int(rest, NUMBER_BASES[base])
        if kind in REAL_TYPES or not kind:
            number = Decimal(rest)
            return int(rest) if not kind and rest.isdigit() else _check_finite(number, token)
        if kind in INTEGER_TYPES:
            return int(rest)
    except (ValueError, ArithmeticError, KeyError):
        raise token.error(f"{token.text} is not a literal") from None
    raise token.error(f"{token.text} is no number")


def _check_finite(number: Decimal, token: Token) -> Decimal:
    if not number.is_finite() or abs(number.adjusted()) > MAX_DIGITS * 4:
        raise token.error(f"{token.text} is too large or too small")
    return number


def content_of(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """The content that a literal means for a variable of this type; None: it is no literal."""
    signs = [token.text for token in tokens if token.text in {"+", "-"}]
    unsigned = tokens[len(signs) :]
    if kind.kind == "word":
        return _enumeration_word(tokens, kind, name)
    if len(unsigned) != 1 or [token.text for token in tokens[: len(signs)]] != signs:
        return None
    token = unsigned[0]
    truth = BOOLEAN_WORDS.get(token.upper) if token.kind == NAME and not signs else None
    if truth is None and not is_literal(token):
        return None
    value = number_of(token) if truth is None else truth
    if isinstance(value, TimeNumber) or kind.kind == "time":
        if isinstance(value, TimeNumber) and kind.kind == "time" and not signs:
            return store_content(kind, value)
        raise token.error(f"{name}: {token.text} is not a value of {kind.name}; numbers are in s")
    if isinstance(value, bool) or kind.kind == "bool":
        truth_value = (
            value if isinstance(value, bool) else {0: False, 1: True}.get(value if isinstance(value, int) else 2)
        )
        content = read_content(kind, truth_value) if not signs else None
    else:
        content = read_content(kind, float(-value if signs.count("-") % 2 else value))
    if content is None:
        raise tokens[0].error(f"{name}: {''.join(part.text for part in tokens)} is not a value of {kind.name}")
    return content


def _enumeration_word(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """A word of an enumeration, with or without its name before it."""
    text = "".join(token.upper for token in tokens)
    for sign in "#.":
        text = text.removeprefix(f"{kind.name}{sign}")
    if text not in kind.words:
        raise tokens[0].error(f"{name}: {text} is none of {', '.join(kind.words)}")
    return text
