"""A memory listing with a meaning beside every word."""

from __future__ import annotations

from textwrap import wrap
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.values import bits_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.regmap import RegisterMap, Word
    from pidcfg.encoders.spaces import Space
    from pidcfg.explanation.find_register import RegisterBook
    from pidcfg.explanation.values import Setting

WIDTH = 120
NARROWEST = 40
"""Columns that a meaning has at least."""


class Claim(NamedTuple):
    """What an address of a listing is: its row, the loop, and the scales and units of that loop."""

    table: RegisterMap
    word: Word
    loop: str
    known: Setting
    prefix: str = ""


class Start(NamedTuple):
    """An option that says where the loops of a listing begin: the bank of their registers, and an example."""

    option: str
    prefix: str
    example: str
    held: int | None = None
    """The address that says it too."""


class Line(NamedTuple):
    """A word of a listing with its meaning."""

    address: str
    hex: str
    value: str
    loop: str
    register: str
    meaning: str


def block_claims(
    settings: Sequence[Mapping[str, Any]],
    options: Mapping[str, Any],
    blocks: Mapping[str, tuple[str, RegisterMap]],
    space: Space,
    unnamed: str,
) -> Iterator[tuple[Mapping[str, Any], list[tuple[str, int, RegisterMap]]]]:
    """The settings of each loop, with its name, start and rows for each block whose start is known."""
    count = len(settings) or max((len(options.get(key) or ()) for key in blocks), default=0)
    for i in range(count):
        own = settings[i] if settings else {}
        name = str(own.get("loop", unnamed.format(i + 1)))
        found = []
        for key, (_, table) in blocks.items():
            said = list(options.get(key) or [])
            text = said[0] if len(said) == 1 and count > 1 else said[i] if i < len(said) else own.get(key)
            start = space.parse(text) if isinstance(text, str) else None
            if start is None and text is not None:
                raise DecodeError(f"settings[{i}]: {key}: {text!r} is not the address of a block")
            found += [] if start is None else [(name, start, table)]
        yield own, found


def register_lines(
    book: RegisterBook, words: Mapping[int, int], settings: Any, plc: Mapping[str, Any], options: Mapping[str, Any]
) -> Iterator[Line]:
    """Every word of a listing in the order of its addresses."""
    claimed: dict[int, Claim] = {}
    for number, claim in book.claims(words, settings, plc, options):
        claimed.setdefault(number, claim)
    placed = {book.space.place(number)[0].prefix for number, claim in claimed.items() if claim.loop}
    missing = [s for s in book.starts if s.prefix not in placed and not options.get(s.option) and s.held not in words]
    for number in sorted(words):
        raw, kind, own = words[number], book.space.kind(number), claimed.get(number)
        shown = (book.space.name(number), kind.hex(raw), kind.text(raw))
        if own is None:
            yield Line(*shown, "-", "-", _nowhere(book.space.place(number)[0].prefix, missing))
        else:
            yield Line(*shown, own.loop or "-", own.prefix + own.word.name, _meaning(book, own, raw))


def _nowhere(prefix: str, missing: Sequence[Start]) -> str:
    """A word that no loop has, or of which that cannot be known."""
    if all(start.prefix != prefix for start in missing):
        return "belongs to no loop"
    given = " ".join(f"--{start.option.replace('_', '-')} {start.example}" for start in missing)
    return f"where the loops begin is not said: give {given}"


def _meaning(book: RegisterBook, claim: Claim, raw: int) -> str:
    """What a word says; a word that is no value says why."""
    word = claim.word
    if word.access == "reserved":
        return word.title if raw == 0 else f"{word.title}, but not 0"
    if any(row.offset == word.offset for row in claim.table.bits):
        return f"{word.title}: {bits_text(claim.table, word, raw)}"
    code = next((c for s in book.series for c in s.codes if (c.register, c.number) == (word.name, raw)), None)
    if code is not None:
        return f"{word.title}: {code.title}"
    try:
        text = book.says(word, raw, claim.known)
    except DecodeError as error:
        return f"{word.title}: no value, {error}"
    return f"{word.title}: {text}"


def as_text(lines: Sequence[Line], heads: Sequence[str]) -> str:
    """The lines in columns, the meaning wrapped within its own."""
    rows = [(line.address, line.hex, line.value, line.loop, line.register) for line in lines]
    widths = [max(len(cell) for cell in column) for column in zip(heads, *rows, strict=True)]
    shown = [i for i in range(len(heads)) if any(row[i] for row in rows)]
    at = sum(widths[i] + 2 for i in shown)
    out = ["  ".join([*(f"{heads[i]:<{widths[i]}}" for i in shown), "meaning"])]
    for row, line in zip(rows, lines, strict=True):
        cells = [f"{row[i]:>{widths[i]}}" if heads[i] in RIGHT else f"{row[i]:<{widths[i]}}" for i in shown]
        first, *rest = wrap(line.meaning, max(WIDTH - at, NARROWEST), break_on_hyphens=False) or [""]
        out.append("  ".join([*cells, first]).rstrip())
        out += [" " * at + text for text in rest]
    return "\n".join(out) + "\n"


HEADS = ("address", "hex", "value", "loop", "register")
RIGHT = frozenset({"hex", "value"})
NAMED_HEADS = ("name", "", "value", "", "type")
