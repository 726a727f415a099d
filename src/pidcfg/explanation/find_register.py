"""Explanations of vendors whose memory has addresses: words, bits, offsets, numbers and names, from their tables."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.regmap import decode_one, scale_of
from pidcfg.explanation.annotate import HEADS, as_text, register_lines
from pidcfg.explanation.contents import raw_of, read_in_base
from pidcfg.explanation.question import ADDRESS, OFFSET, Asked, Thing, ThingError
from pidcfg.explanation.register_page import Found, code_page, page_of
from pidcfg.explanation.texts import key_limits, limits_text
from pidcfg.explanation.unstored_keys import beside_pages
from pidcfg.explanation.values import Setting, no_remark, nothing_special, text_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.encoders.meanings import Code, Meaning
    from pidcfg.encoders.regmap import Bits, RegisterMap, Word
    from pidcfg.encoders.spaces import Space
    from pidcfg.explanation.annotate import Claim, Start
    from pidcfg.explanation.direction import Direction
    from pidcfg.explanation.page import Page
    from pidcfg.refs import Basis

HIGHEST_BIT = 15


@dataclass(frozen=True, slots=True)
class Block:
    """A block of registers: its bank, its rows, and where it begins in the manual's or the starter file's example.

    ``heads``: what the manual writes before an offset; ``repeat``: how often the block follows itself.
    """

    prefix: str
    table: RegisterMap
    start: str
    heads: tuple[str, ...]
    repeat: int = 1
    fixed: bool = False
    """It always begins there."""
    mentioned: bool = True
    """``--loop`` looks in it."""

    @property
    def length(self) -> int:
        """Registers from its start to the end of its last repetition."""
        return self.table.size * self.repeat


def in_counts(word: Word, raw: int) -> str:  # noqa: ARG001 - the signature of a vendor's own
    """Counts of which no more is known."""
    return f"{raw} counts"


class Series(NamedTuple):
    """Numbers of one kind: how they are written (``CK27``), and how they are called."""

    heads: tuple[str, ...]
    name: str
    codes: Sequence[Code]
    other: str
    """What a number means that is not among them."""


@dataclass(frozen=True)
class RegisterBook:
    """Everything that can be said about a vendor's registers; the tables say it."""

    key: str
    title: str
    space: Space
    blocks: tuple[Block, ...]
    words: Mapping[str, Meaning]
    bits: Mapping[tuple[str, int], Meaning]
    series: tuple[Series, ...]
    forms: tuple[tuple[str, str], ...]
    """What can be asked for, and an example of each."""
    settings: Callable[[Any, Any], Setting]
    """Scales and units of a loop of a configuration."""
    direction: Direction
    """The words for the direction of control."""
    claims: Callable[..., Iterator[tuple[int, Claim]]]
    """What each address of a listing is."""
    special: Callable[[Word, int, Setting], str | None] = nothing_special
    remark: Callable[[Word, int, Setting], str] = no_remark
    """What is doubtful about a content."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """Keys that no register holds, and where they are set."""
    starts: tuple[Start, ...] = ()
    """Options that say where the loops of a listing begin."""
    root: Basis | None = None
    """Why a loop that takes the root of its PV has words that are about the PV before."""
    writers: Mapping[str, str] | None = None
    """Who writes a word, where it is not only the PLC."""
    unscaled: Callable[[Word, int], str] = in_counts
    late: Mapping[str, str] | None = None
    """What the manual's column "Read on the Fly" means."""
    hexadecimal: bool = False
    """Contents are shown in hexadecimal."""
    aliases: Mapping[str, str] | None = None
    """Other names of registers, in small letters."""
    regions: tuple[tuple[int, int, str], ...] = ()
    """Parts of the memory, for addresses that no block has."""

    def says(self, word: Word, raw: int, known: Setting) -> str:
        """A content in words, with what is doubtful about it; raises `DecodeError` where it is no value."""
        text = text_of(word, raw, known, self.special) or self.unscaled(word, raw)
        remark = self.remark(word, raw, known) or self._outside(word, raw)
        return f"{text} ({remark})" if remark else text

    def _outside(self, word: Word, raw: int) -> str:
        """What the manual allows, where a number is none of it."""
        limits = key_limits(self.key, word.path) if word.path and scale_of(word.codec) is None else None
        value = decode_one(word.codec, raw, {}) if limits is not None else None
        return limits_text(limits) if limits and isinstance(value, Decimal) and not limits.holds(value) else ""

    def find(self, thing: Thing, asked: Asked) -> list[Page]:
        """What a thing is with this vendor; empty when it is nothing."""
        found = self._address(thing, asked) or self._offset(thing) or self._code(thing) or self._name(thing, asked)
        return [read_in_base(page, thing, self) for page in found] or beside_pages(self, thing, asked)

    @cached_property
    def names(self) -> dict[str, list[tuple[Block, Word, Bits | None]]]:
        """Registers and choices by all their names, in small letters."""
        found: dict[str, list[tuple[Block, Word, Bits | None]]] = {}
        for block in self.blocks:
            for word in block.table.words:
                for name in {text.lower() for text in (word.name, word.path or word.name, word.title)}:
                    found.setdefault(name, []).append((block, word, None))
            for row in block.table.bits:
                word = next(w for w in block.table.words if w.offset == row.offset)
                for name in {text.lower() for text in (row.path or row.title, row.title)}:
                    if row.access != "reserved":
                        found.setdefault(name, []).append((block, word, row))
        for alias, name in (self.aliases or {}).items():
            others = [entry for entry in found[name] if entry[2] is None]
            found.setdefault(alias.lower(), others)
        return found

    def _address(self, thing: Thing, asked: Asked) -> list[Page]:
        """``V7642``, ``DF106``, ``V7642.3``."""
        written = ADDRESS.fullmatch(thing.name)
        bank = next((b for b in self.space.banks if written and b.prefix == written.group(1).upper()), None)
        if written is None or bank is None:
            return []
        name = f"{bank.prefix}{written.group(2)}"
        number = self.space.parse(name)
        if number is None:
            ends = f"{self.space.name(self.space.number(bank.prefix, n))}" if (n := bank.first) else f"{bank.prefix}0"
            last = self.space.name(self.space.number(bank.prefix, bank.last))
            kind = "octal digits, " if bank.octal else ""
            raise ThingError(f"{thing.name} is no address of the {self.title}: {kind}{ends} to {last}")
        found, bit = self._at(number, asked), self._bit(written.group(3), number)
        raw = (
            None
            if thing.value is None
            else raw_of(thing.value, self.space.kind(number), name, hexadecimal=self.hexadecimal)
        )
        if found is None:
            return [self._elsewhere(name, number, raw, asked)]
        return [page_of(self, found, self.space.name(number), raw, bit)]

    def _at(self, number: int, asked: Asked) -> Found | None:
        """The register at an address: as the configuration says, of a block that always is there, or of one named."""
        if asked.config is not None and (found := asked.config.at(number)) is not None:
            return found
        for block, start in self._starts(asked):
            if start <= number < start + block.length:
                index, offset = divmod(number - start, block.table.size)
                loop = f"loop {index + 1} of a table at {self.space.name(start)}" if block.repeat > 1 else None
                word = next(w for w in block.table.words if w.offset == offset)
                return Found(block.table, word, loop)
        return None

    def _starts(self, asked: Asked) -> Iterator[tuple[Block, int]]:
        """Blocks with the addresses at which they begin."""
        named = [number for text in asked.starts if (number := self.space.parse(text.upper())) is not None]
        for block in self.blocks:
            example = self.space.parse(block.start)
            if block.fixed and example is not None:
                yield block, example
            if not block.mentioned or block.fixed or example is None:
                continue
            given = [n for n in named if self.space.place(n)[0].prefix == block.prefix]
            yield from ((block, number) for number in given)
            if asked.loop and not given:
                yield block, example

    def _elsewhere(self, name: str, number: int, raw: int | None, asked: Asked) -> Page:
        """An address that no known block has."""
        from pidcfg.explanation.register_page import unknown_page

        starts = [
            (block, start)
            for block, start in self._starts(asked)
            if not block.fixed and block.prefix == self.space.place(number)[0].prefix
        ]
        if starts:
            spans = ", ".join(f"{self.space.name(s)} to {self.space.name(s + b.length - 1)}" for b, s in starts)
            raise ThingError(
                f"{name} lies outside the registers of the loops ({spans}); "
                "name the start of the block with --block ADDRESS"
            )
        return unknown_page(self, name, number, raw)

    def _offset(self, thing: Thing) -> list[Page]:
        """``addr+06.10``, ``Cn+12``, ``Base+5``: in the notation of the vendor's manual."""
        written = OFFSET.fullmatch(thing.name)
        if written is None:
            return []
        head = "".join(c for c in written.group(1).lower() if c.isalnum())
        pages, problems = [], []
        for block in self.blocks:
            if head not in block.heads:
                continue
            bank = next(b for b in self.space.banks if b.prefix == block.prefix)
            digits = written.group(2)
            if bank.octal and not set(digits) <= set("01234567"):
                raise ThingError(f"{thing.name}: offsets of the {self.title} are octal; {digits} has a digit above 7")
            offset = int(digits, 8 if bank.octal else 10)
            length = block.length if block.repeat > 1 and not block.mentioned else block.table.size
            if offset >= length:
                problems.append(f"{thing.name}: the block ends at {block.table.at(length - 1)}")
                continue
            row = next(w for w in block.table.words if w.offset == offset % block.table.size)
            name, number = block.table.at(offset), self.space.number(block.prefix, bank.first)
            try:
                raw = (
                    None if thing.value is None else raw_of(thing.value, bank.kind, name, hexadecimal=self.hexadecimal)
                )
                pages.append(page_of(self, Found(block.table, row), name, raw, self._bit(written.group(3), number)))
            except ThingError as error:
                problems.append(str(error))
        if problems and not pages:
            raise ThingError("; ".join(dict.fromkeys(problems)))
        return pages

    def _bit(self, text: str | None, number: int) -> int | None:
        """The number of a bit, decimal as all the manuals write it."""
        if text is None:
            return None
        highest = min(HIGHEST_BIT, 4 * self.space.kind(number).digits - 1)
        if self.space.kind(number).digits == 1 or int(text) > highest:
            wide = self.space.kind(number).name
            raise ThingError(
                f"bit {text}: {'a word has the bits 0 to 15' if highest == HIGHEST_BIT else f'a {wide} has no bits'}"
            )
        return int(text)

    def _code(self, thing: Thing) -> list[Page]:
        """``CK27``: a number that the PLC shows."""
        text = thing.name.lower().replace(" ", "").replace("-", "").replace("_", "")
        for series in self.series:
            for head in series.heads:
                digits = text.removeprefix(head)
                if text.startswith(head) and digits.isdecimal() and len(digits) < 6:
                    return [code_page(self, series, int(digits))]
        return []

    def _name(self, thing: Thing, asked: Asked) -> list[Page]:
        """A register's or choice's own name, with each loop of the configuration that has it."""
        loop, _, rest = thing.name.partition(".")
        loops = asked.config.loops if asked.config is not None else ()
        wanted, only = (rest, loop) if rest and loop in loops else (thing.name, None)
        found = self.names.get(wanted.lower()) or self._suffixed(wanted.lower())
        pages = []
        for block, word, row in found:
            places: list[tuple[Found, int | None]] = [(Found(block.table, word), None)]
            if asked.config is not None:
                places = [*asked.config.named(block.table, word, only)] or places
            for known, number in places:
                name = word.name if number is None else self.space.name(number)
                kind = next(b.kind for b in self.space.banks if b.prefix == block.prefix)
                raw = None if thing.value is None else raw_of(thing.value, kind, name, hexadecimal=self.hexadecimal)
                pages.append(page_of(self, known, name, raw, None if row is None else row.bits[0]))
        return pages

    def _suffixed(self, name: str) -> list[tuple[Block, Word, Bits | None]]:
        """A nickname: the loop's name and a suffix."""
        fits = [alias for alias in self.aliases or {} if alias.startswith("_") and name.endswith(alias.lower())]
        return self.names[max(fits, key=len).lower()] if fits else []

    def annotate(self, listing: Any, options: Mapping[str, Any]) -> str:
        """A listing with a meaning beside every word."""
        return as_text([*register_lines(self, listing.words, listing.settings, listing.plc, options)], HEADS)
