"""The records of a vendor whose memory has addresses, and what the content of a register says."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any, ClassVar

from pidcfg.encoders.regmap import Bits, RegisterMap, Word, decode_one, scale_of
from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.annotate import Line, unclaimed
from pidcfg.explanation.book import WRITERS, Book, Part, Record
from pidcfg.explanation.page import Value
from pidcfg.explanation.texts import key_limits, key_text, limits_text
from pidcfg.explanation.values import (
    UNKNOWN,
    Placement,
    Scaling,
    bits_text,
    special_code,
    text_of,
)
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pydantic import BaseModel

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.meanings import Meaning
    from pidcfg.encoders.spaces import Kind, Space
    from pidcfg.explanation.annotate import Start
    from pidcfg.explanation.book import Series
    from pidcfg.refs import Basis

NO_REGISTER = "stands in no register: "
DIALOG = f"{NO_REGISTER}set it in the PID dialog"
FILE = f"{NO_REGISTER}only the configuration file holds it"


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


@dataclass(frozen=True, kw_only=True)
class RegisterRecord(Record):
    """A register, or one bit of it."""

    table: RegisterMap
    word: Word
    bit: int | None = None

    @property
    def names(self) -> set[str]:
        """Its names, in small letters; a bit's do not say the register."""
        names = {self.title, self.key or self.title, *([self.name] if self.bit is None else [])}
        return {name.lower() for name in names}


@dataclass(frozen=True, kw_only=True)
class Registers(Book):
    """The tables of a vendor whose memory has addresses."""

    heads: ClassVar = ("address", "hex", "value", "loop", "register")
    space: Space
    blocks: tuple[Block, ...]
    words: Mapping[str, Meaning]
    """Meanings of registers that the configuration does not set."""
    bits: Mapping[tuple[str, int], Meaning] = field(default_factory=dict)
    """Meanings of bits, by the register and the lowest bit of the row."""
    scaling: Callable[[Any, Any], Scaling]
    """Scales and units of a loop of a configuration."""
    claims: Callable[[Listing, Mapping[str, Any]], Iterator[tuple[int, Placement]]]
    """What each address of a listing is."""
    special: Callable[[Word, int, Scaling], str] | None = None
    """A content in words, for registers of no common kind; empty for the others."""
    remark: Callable[[Word, int, Scaling], str] | None = None
    """What is doubtful about a content."""
    unscaled: Callable[[Word, int], str] | None = None
    """What a content is whose scale is not known; counts where there is no more to say."""
    unstored: Mapping[str, str] = field(default_factory=dict)
    """Keys that no register holds, and where they are set."""
    starts: tuple[Start, ...] = ()
    """Options that say where the loops of a listing begin."""
    root: Basis | None = None
    """Why a loop that takes the root of its PV has words that are about the PV before."""
    late: Mapping[str, str] = field(default_factory=dict)
    """What the manual's column "Read on the Fly" means."""
    hexadecimal: bool = False
    """Contents are shown in hexadecimal."""
    aliases: Mapping[str, str] = field(default_factory=dict)
    """Other names of registers."""
    regions: tuple[tuple[int, int, str], ...] = ()
    """Parts of the memory, for addresses that no block has."""

    @property
    def schema(self) -> type[BaseModel]:
        """The schema of the vendor's configurations."""
        return VENDORS[self.key].model

    @property
    def registers(self) -> Iterator[RegisterRecord]:
        """Registers and their choices of bits, block by block."""
        for block in self.blocks:
            yield from (self.record(block.table, word) for word in block.table.words)
            for row in block.table.bits:
                if row.access != "reserved":
                    yield self.record(block.table, word_at(block.table, row.offset), row.bits[0])

    def record(self, table: RegisterMap, word: Word, bit: int | None = None) -> RegisterRecord:
        """A register, or one of its bits."""
        rows = [row for row in table.bits if row.offset == word.offset and (bit is None or bit in row.bits)]
        row = rows[0] if bit is not None and rows else None
        owner: Word | Bits = row or word
        title = "Bit without a meaning" if bit is not None and row is None else owner.title
        return RegisterRecord(
            kind="register" if bit is None else "bit",
            name=word.name if bit is None else f"{word.name}.{bit}",
            title=title,
            schema=self.schema,
            key=owner.path or word.path,
            unit=word.unit,
            notation=self._notation(word, bits=bool(rows)),
            access=owner.access,
            by=self._writer(word, owner.access),
            basis=word.basis,
            meaning=None if row else self.words.get(word.name),
            parts=tuple(Part.of(row, self.bits.get((word.name, row.bits[0]))) for row in rows),
            table=table,
            word=word,
            bit=bit,
        )

    def number(self, series: Series, number: int) -> Record:
        """A number that the PLC shows."""
        code = next((c for c in series.codes if c.number == number), None)
        register = series.codes[0].register
        word, table = next((w, b.table) for b in self.blocks for w in b.table.words if w.name == register)
        name = f"{series.name} {number}"
        if code is None:
            return Record(kind="number", name=name, title=series.other, basis=word.basis)
        return Record(
            kind="number",
            name=name,
            title=code.title,
            access="status",
            by=f"the PLC, into {table.at(word.offset)} ({word.title})",
            basis=word.basis,
            meaning=code.meaning,
        )

    def unstored_record(self, path: str) -> Record:
        """A key that no register holds."""
        text = key_text(self.schema, path)
        return Record(
            kind="parameter",
            name=path,
            title=text.partition(": ")[0].partition("; ")[0].rstrip("."),
            detail=text,
            key=path,
            access="setting",
            by=self.unstored[path],
        )

    def _notation(self, word: Word, *, bits: bool) -> str:
        """How a register is written."""
        if bits:
            return "16 bits" + (", shown in hexadecimal" if self.hexadecimal else "")
        notation = word.codec.notation
        if self.is_binary(word):
            return f"{notation} in binary"
        return f"{notation} {word.unit}" if notation.endswith("of 0.001") and word.unit else notation

    def _writer(self, word: Word, access: str) -> str:
        if word.name in self.writers:
            return self.writers[word.name]
        late = self.late.get(word.read, "")
        return WRITERS[access] + (f"; a new value {late}" if late and access == "setting" else "")

    def is_binary(self, word: Word) -> bool:
        """Whether a register that is shown in hexadecimal holds counts in binary, not in BCD."""
        return self.hexadecimal and scale_of(word.codec) is not None and "BCD" not in word.codec.notation

    def kind(self, table: RegisterMap) -> Kind:
        """What the registers of a block hold."""
        prefix = next((b.prefix for b in self.blocks if b.table.title == table.title), self.space.banks[0].prefix)
        return next(bank.kind for bank in self.space.banks if bank.prefix == prefix)

    def shown(self, kind: Kind, raw: int) -> str:
        """A content as the vendor shows it."""
        return kind.hex(raw) if self.hexadecimal else kind.text(raw)

    def value(self, record: RegisterRecord, raw: int, scaling: Scaling, *, bits: bool) -> Value:
        """A content as it is shown, and what it says; ``bits``: they say it."""
        word, kind = record.word, self.kind(record.table)
        shown = self.shown(kind, raw)
        content = raw if self.hexadecimal else kind.show(raw)
        if bits:
            return Value(content, shown)
        code = self.code(word.name, raw)
        if code is not None:
            return Value(content, shown, code.title)
        other = next((series.other for series in self.series if series.codes[0].register == word.name), "")
        if other:
            return Value(content, shown, "", other)
        try:
            text = self.saying(word, raw, scaling)
        except DecodeError as error:
            return Value(content, shown, "", f"{error}: this is no value of the register")
        return Value(content, shown, f"{text} (decimal {raw})" if self.is_binary(word) else text)

    def saying(self, word: Word, raw: int, scaling: Scaling) -> str:
        """A content in words, with what is doubtful about it; raises `DecodeError` where it is no value."""
        text = (self.special(word, raw, scaling) if self.special else "") or text_of(word, raw, scaling)
        text = text or (self.unscaled(word, raw) if self.unscaled else f"{raw} counts")
        remark = (self.remark(word, raw, scaling) if self.remark else "") or self._outside(word, raw)
        return f"{text} ({remark})" if remark else text

    def _outside(self, word: Word, raw: int) -> str:
        """What the manual allows, where a number is none of it, nor a code."""
        number = word.path and scale_of(word.codec) is None and not special_code(word.codec, raw)
        limits = key_limits(self.schema, word.path) if number and word.path else None
        value = decode_one(word.codec, raw, {}) if limits is not None else None
        return limits_text(limits) if limits and isinstance(value, Decimal) and not limits.holds(value) else ""

    def lines(self, listing: Listing, options: Mapping[str, Any]) -> Iterator[Line]:
        """Every word of a listing with its meaning, in the order of the addresses."""
        words: dict[int, int] = listing.words
        claims: dict[int, Placement] = {}
        for number, claim in self.claims(listing, options):
            if self.space.holds(number):
                claims.setdefault(number, claim)
        placed = {self.space.place(number)[0].prefix for number, claim in claims.items() if claim.loop}
        missing = [
            s for s in self.starts if s.prefix not in placed and not options.get(s.option) and s.held not in words
        ]
        for number in sorted(words):
            if not self.space.holds(number):
                yield Line(listing.shown.get(number, str(number)), "-", "-", "-", "-", "lies behind the last register")
                continue
            raw, kind = words[number], self.space.kind(number)
            content = (self.space.name(number), kind.hex(raw), kind.text(raw))
            if number in claims:
                claim = claims[number]
                text = self._line_text(self.record(claim.table, claim.word), raw, claim.scaling or UNKNOWN)
                yield Line(*content, claim.loop or "-", claim.prefix + claim.word.name, text)
            else:
                yield Line(*content, "-", "-", unclaimed(self.space.place(number)[0].prefix, missing))

    def _line_text(self, record: RegisterRecord, raw: int, scaling: Scaling) -> str:
        """What a word says; a word that is no value says why."""
        if record.access == "reserved":
            return record.title if raw == 0 else f"{record.title}, but not 0"
        rows = [part.bits for part in record.parts if part.bits]
        if rows:
            return f"{record.title}: {bits_text(rows, raw)}"
        code = self.code(record.word.name, raw)
        try:
            return f"{record.title}: {code.title if code else self.saying(record.word, raw, scaling)}"
        except DecodeError as error:
            return f"{record.title}: no value, {error}"


def word_at(table: RegisterMap, offset: int) -> Word:
    """The row of the register at an offset."""
    return next(word for word in table.words if word.offset == offset)
