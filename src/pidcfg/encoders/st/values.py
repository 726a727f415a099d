"""Literals of Structured Text."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.parameters import read, store
from pidcfg.encoders.st.lex import NAME
from pidcfg.encoders.st.parse import is_literal
from pidcfg.schemas.iec import TYPED, Timed, time_seconds
from pidcfg.schemas.numbers import MAX_DIGITS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.encoders.st.lex import Token
    from pidcfg.schemas.iec import IecType

TRUTHS = {"TRUE": True, "FALSE": False}
BASES = {"2": 2, "8": 8, "16": 16}
INTEGERS = frozenset(
    ("SINT", "INT", "DINT", "LINT", "USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD")
)
REALS = frozenset(("REAL", "LREAL"))


def number_of(token: Token) -> int | Decimal | bool:
    """What a literal means: a whole number, a real one, a truth, or a time in s."""
    if TYPED.fullmatch(token.text) and token.upper.startswith(("T#", "TIME#")):
        seconds = time_seconds(token.text)
        if seconds is None:
            raise token.error(f"{token.text} is not a TIME; write it as in T#1m30s or T#500ms")
        return Timed(seconds)
    text = token.text.replace("_", "")
    if len(text) > MAX_DIGITS + 8:
        raise token.error(f"a number of more than {MAX_DIGITS} digits")
    prefix, _, rest = text.rpartition("#")
    kind, _, base = prefix.upper().rpartition("#")
    base, kind = (base, kind) if base in BASES else ("", prefix.upper())
    try:
        if kind == "BOOL":
            return {"1": True, "0": False, **TRUTHS}[rest.upper()]
        if base and kind in {"", *INTEGERS}:
            return int(rest, BASES[base])
        if kind in REALS or not kind:
            number = Decimal(rest)
            return int(rest) if not kind and rest.isdigit() else _finite(number, token)
        if kind in INTEGERS:
            return int(rest)
    except (ValueError, ArithmeticError, KeyError):
        raise token.error(f"{token.text} is not a literal") from None
    raise token.error(f"{token.text} is no number")


def _finite(number: Decimal, token: Token) -> Decimal:
    if not number.is_finite() or abs(number.adjusted()) > MAX_DIGITS * 4:
        raise token.error(f"{token.text} is too large or too small")
    return number


def content_of(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """The content that a literal means for a variable of this type; None: it is no literal."""
    signs = [token.text for token in tokens if token.text in {"+", "-"}]
    rest = tokens[len(signs) :]
    if kind.kind == "word":
        return _word(tokens, kind, name)
    if len(rest) != 1 or [token.text for token in tokens[: len(signs)]] != signs:
        return None
    token = rest[0]
    truth = TRUTHS.get(token.upper) if token.kind == NAME and not signs else None
    if truth is None and not is_literal(token):
        return None
    value = number_of(token) if truth is None else truth
    if isinstance(value, Timed) or kind.kind == "time":
        if isinstance(value, Timed) and kind.kind == "time" and not signs:
            return store(kind, value)
        raise token.error(f"{name}: {token.text} is not a value of {kind.name}; numbers are in s")
    if isinstance(value, bool) or kind.kind == "bool":
        plain = value if isinstance(value, bool) else {0: False, 1: True}.get(value if isinstance(value, int) else 2)
        content = read(kind, plain) if not signs else None
    else:
        content = read(kind, float(-value if signs.count("-") % 2 else value))
    if content is None:
        raise tokens[0].error(f"{name}: {''.join(part.text for part in tokens)} is not a value of {kind.name}")
    return content


def _word(tokens: Sequence[Token], kind: IecType, name: str) -> Content | None:
    """A word of an enumeration, with or without its name before it."""
    text = "".join(token.upper for token in tokens)
    for sign in "#.":
        text = text.removeprefix(f"{kind.name}{sign}")
    if text not in kind.words:
        raise tokens[0].error(f"{name}: {text} is none of {', '.join(kind.words)}")
    return text
