"""The records of a vendor whose memory has addresses, and what a question about one is about."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.regmap import SINGLE, NoRegisterError, RegisterMap, Word
from pidcfg.output.explanation import Page, Point, QuestionError, Value
from pidcfg.output.explanation.book import WRITERS, Book, Line, Part, Record, unclaimed_text
from pidcfg.output.explanation.page import (
    ADDRESS_PATTERN,
    OFFSET_PATTERN,
    UNKNOWN_SCALING,
    Placement,
    Question,
    Scaling,
    bits_text,
    is_number,
    is_on_raw_signal,
    key_limits,
    key_text,
    limits_text,
    raw_of,
    special_code,
    text_of,
    unit_of,
)
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import parse_path
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pydantic import BaseModel

    from pidcfg.encoders import regmap
    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.regmap import Bank, Kind, Meaning, Space
    from pidcfg.output.explanation.book import Series, Start
    from pidcfg.output.explanation.page import ConfigIndex
    from pidcfg.text.references import Basis

# --- The records of a vendor whose memory has addresses, and what the content of a register says ----------------------

NO_REGISTER = "stands in no register: "
IN_DIALOG_TEXT = f"{NO_REGISTER}set it in the PID dialog"
IN_FILE_TEXT = f"{NO_REGISTER}only the configuration file holds it"
NO_MEANING_TEXT = "Bit without a meaning"


@frozen
class Block:
    """A block of registers: its bank, its rows, and where it begins in the manual's or the starter file's example.

    ``heads``: what the manual writes before an offset; ``repetitions``: how often the block follows itself.
    """

    prefix: str
    table: RegisterMap
    start: str
    offset_prefixes: tuple[str, ...]
    repetitions: int = 1
    is_fixed: bool = False
    """It always begins there."""
    is_in_loop: bool = True
    """``--loop`` looks in it."""

    @property
    def length(self) -> int:
        """Registers from its start to the end of its last repetition."""
        return self.table.size * self.repetitions


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

    column_heads: ClassVar = ("address", "hex", "value", "loop", "register")
    space: Space
    blocks: tuple[Block, ...]
    words: Mapping[str, Meaning]
    """Meanings of registers that the configuration does not set."""
    bits: Mapping[tuple[str, int], Meaning] = field(default_factory=dict)
    """Meanings of bits, by the register and the lowest bit of the row."""
    scaling: Callable[[Any, Any], Scaling]
    """Scales and units of a loop of a configuration."""
    placements: Callable[[Listing, Mapping[str, object]], Iterator[tuple[int, Placement]]]
    """What each address of a listing is."""
    word_text: Callable[[Word, int, Scaling], str] | None = None
    """A content in words, for registers of no common kind; empty for the others."""
    remark: Callable[[Word, int, Scaling], str] | None = None
    """What is doubtful about a content."""
    unscaled_text: Callable[[Word, int], str] | None = None
    """What a content is whose scale is not known; counts where there is no more to say."""
    unstored_keys: Mapping[str, str] = field(default_factory=dict)
    """Keys that no register holds, and where they are set."""
    starts: tuple[Start, ...] = ()
    """Options that say where the loops of a listing begin."""
    root_basis: Basis | None = None
    """Why a loop that takes the root of its PV has words that are about the PV before."""
    read_when_texts: Mapping[str, str] = field(default_factory=dict)
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
        owner: regmap.Point = row or word
        title = NO_MEANING_TEXT if bit is not None and row is None else owner.title
        return RegisterRecord(
            kind="register" if bit is None else "bit",
            name=word.name if bit is None else f"{word.name}.{bit}",
            title=title,
            schema=self.schema,
            key=owner.path or word.path,
            unit=word.unit,
            notation=self._notation(word, bits=bool(rows)),
            access=owner.access,
            writer=self._writer(word, owner.access),
            basis=word.basis,
            meaning=None if row else self.words.get(word.name),
            parts=tuple(Part.from_bits(row, self.bits.get((word.name, row.bits[0]))) for row in rows),
            table=table,
            word=word,
            bit=bit,
        )

    def number_record(self, series: Series, number: int) -> Record:
        """A number that the PLC shows."""
        code = next((c for c in series.codes if c.number == number), None)
        register = series.codes[0].register
        word, table = next((w, b.table) for b in self.blocks for w in b.table.words if w.name == register)
        name = f"{series.name} {number}"
        if code is None:
            return Record(kind="number", name=name, title=series.other_text, basis=word.basis)
        return Record(
            kind="number",
            name=name,
            title=code.title,
            access="status",
            writer=f"the PLC, into {table.offset_text(word.offset)} ({word.title})",
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
            writer=self.unstored_keys[path],
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
        read_when = self.read_when_texts.get(word.read_when, "")
        return WRITERS[access] + (f"; a new value {read_when}" if read_when and access == "setting" else "")

    def is_binary(self, word: Word) -> bool:
        """Whether a register that is shown in hexadecimal holds counts in binary, not in BCD."""
        return self.hexadecimal and word.scale is not None and "BCD" not in word.codec.notation

    def kind_of(self, table: RegisterMap) -> Kind:
        """What the registers of a block hold."""
        prefix = next((b.prefix for b in self.blocks if b.table.title == table.title), self.space.banks[0].prefix)
        return next(bank.kind for bank in self.space.banks if bank.prefix == prefix)

    def raw_text(self, kind: Kind, raw: int) -> str:
        """A content as the vendor shows it."""
        return kind.hex(raw) if self.hexadecimal else kind.text(raw)

    def value(self, record: RegisterRecord, raw: int, scaling: Scaling, *, bits: bool) -> Value:
        """A content as it is shown, and what it says; ``bits``: they say it."""
        word, kind = record.word, self.kind_of(record.table)
        raw_text = self.raw_text(kind, raw)
        content = raw if self.hexadecimal else kind.show(raw)
        if bits:
            return Value(content, raw_text)
        code = self.code(word.name, raw)
        if code is not None:
            return Value(content, raw_text, code.title)
        other_text = next((series.other_text for series in self.series if series.codes[0].register == word.name), "")
        if other_text:
            return Value(content, raw_text, "", other_text)
        try:
            text = self.content_text(word, raw, scaling)
        except DecodeError as error:
            return Value(content, raw_text, "", f"{error}: this is no value of the register")
        return Value(content, raw_text, f"{text} (decimal {raw})" if self.is_binary(word) else text)

    def content_text(self, word: Word, raw: int, scaling: Scaling) -> str:
        """A content in words, with what is doubtful about it; raises `DecodeError` where it is no value."""
        special = self.word_text(word, raw, scaling) if self.word_text else ""
        text = special or text_of(word, raw, scaling)
        text = text or (self.unscaled_text(word, raw) if self.unscaled_text else f"{raw} counts")
        remark = self.remark(word, raw, scaling) if self.remark else ""
        remark = remark or ("" if special else self._limits_remark(word, raw))
        return f"{text} ({remark})" if remark else text

    def _limits_remark(self, word: Word, raw: int) -> str:
        """What the manual allows, where a number is none of it, nor a code."""
        is_number = word.path and word.scale is None and not special_code(word.codec, raw)
        limits = key_limits(self.schema, word.path) if is_number and word.path else None
        value = word.decode(raw) if limits is not None else None
        return limits_text(limits) if limits and isinstance(value, Decimal) and not limits.holds(value) else ""

    def lines(self, listing: Listing, options: Mapping[str, object]) -> Iterator[Line]:
        """Every word of a listing with its meaning, in the order of the addresses."""
        words: dict[int, int] = listing.words
        placements: dict[int, Placement] = {}
        for number, placement in self.placements(listing, options):
            if self.space.has_bank(number):
                placements.setdefault(number, placement)
        prefixes = {
            self.space.bank_and_number(number)[0].prefix for number, placement in placements.items() if placement.loop
        }
        missing = [
            s for s in self.starts if s.prefix not in prefixes and not options.get(s.option) and s.address not in words
        ]
        for number in sorted(words):
            if not self.space.has_bank(number):
                yield Line(
                    listing.shown_addresses.get(number, str(number)),
                    "-",
                    "-",
                    "-",
                    "-",
                    "lies behind the last register",
                )
                continue
            raw, kind = words[number], self.space.kind_of(number)
            content = (self.space.name(number), kind.hex(raw), kind.text(raw))
            if number in placements:
                placement = placements[number]
                text = self._line_text(
                    self.record(placement.table, placement.word), raw, placement.scaling or UNKNOWN_SCALING
                )
                yield Line(*content, placement.loop or "-", placement.prefix + placement.word.name, text)
            else:
                yield Line(*content, "-", "-", unclaimed_text(self.space.bank_and_number(number)[0].prefix, missing))

    def _line_text(self, record: RegisterRecord, raw: int, scaling: Scaling) -> str:
        """What a word says; a word that is no value says why."""
        if record.access == "reserved":
            return record.title if raw == 0 else f"{record.title}, but not 0"
        rows = [part.bits for part in record.parts if part.bits]
        if rows:
            return f"{record.title}: {bits_text(rows, raw)}"
        code = self.code(record.word.name, raw)
        try:
            return f"{record.title}: {code.title if code else self.content_text(record.word, raw, scaling)}"
        except DecodeError as error:
            return f"{record.title}: no value, {error}"


def word_at(table: RegisterMap, offset: int) -> Word:
    """The row of the register at an offset."""
    return next(word for word in table.words if word.offset == offset)


# ----------------------------------------------------------------------------------------------------------------------
# Finds what a question is about with a vendor whose memory has addresses: by address, offset, number, name or key.

HIGHEST_BIT = 15
RAW_SIGNAL_UNIT = "the signal before the root"
"""The unit of what is compared with the PV of which the loop takes the root."""
SEPARATORS = str.maketrans("", "", " -_")
MIN_HEXADECIMAL = 10
"""Smaller numbers are the same in both notations."""
MAX_LOOPS = 8
"""Of every PLC here with registers."""
PLC_PREFIX = "plc."
"""What keys begin with that are about the file and no loop."""


@dataclass(frozen=True, kw_only=True)
class RegisterBook(Registers):
    """The tables of a vendor whose memory has addresses, and how its registers are asked for."""

    def find(self, question: Question) -> list[Page]:
        """What the question is about with this vendor; empty when it is nothing."""
        pages = (
            self._address_pages(question)
            or self._offset_pages(question)
            or self._number_pages(question)
            or self._name_pages(question)
        )
        return [self._note_number_base(page, question) for page in pages] or self._unstored_key_pages(question)

    @cached_property
    def index(self) -> dict[str, list[RegisterRecord]]:
        """Registers and choices by all their names, in small letters."""
        index: dict[str, list[RegisterRecord]] = {}
        for record in self.registers:
            for name in record.names:
                index.setdefault(name, []).append(record)
        for alias, name in self.aliases.items():
            index.setdefault(alias.lower(), [record for record in index[name] if record.kind == "register"])
        return index

    @property
    def spellings(self) -> dict[str, str]:
        """All names that can be asked for, in small letters, with their spelling."""
        return {name: name for name in (*self.index, *(path.rpartition(".")[2] for path in self.unstored_keys))}

    def _placement_page(self, placement: Placement, name: str, raw: int | None, bit: int | None = None) -> Page:
        """A register, or one bit of it, in its place, with its content where there is one."""
        record = self.record(placement.table, placement.word, bit)
        choice = record.parts[0].bits if bit is not None and record.parts else None
        content = placement.raw if raw is None else raw
        points = tuple(
            part.point(content)
            for part in record.parts
            if part.bits and (part.bits.access != "reserved" or bit is not None or (content or 0) & part.bits.mask)
        )
        scaling = placement.scaling or UNKNOWN_SCALING
        code = None if content is None else self.code(record.word.name, content)
        value = None if content is None else self.value(record, content, scaling, bits=bool(points))
        return replace(
            self.page(record, value, points, code),
            name=name if bit is None else f"{name}.{bit}",
            unit=RAW_SIGNAL_UNIT
            if is_on_raw_signal(record.word, scaling.scales)
            else unit_of(record.word, scaling.units),
            loop=placement.loop if placement.raw is not None else None,
            place=f"{record.table.offset_text(record.word.offset)} of {placement.loop}" if placement.loop else "",
            origins=tuple(o for o in placement.origins if choice is None or o.key.endswith(choice.path or "-")),
            notes=tuple(self._placement_notes(placement, name, content)),
        )

    def _placement_notes(self, placement: Placement, name: str, content: int | None) -> Iterator[str]:
        """What would make the answer better, and what the file and the given content have to do with each other."""
        if placement.scaling is None and content is not None and placement.word.scale:
            yield "with --in FILE the value is shown in engineering units"
        if self.root_basis is not None and is_on_raw_signal(
            placement.word, (placement.scaling or UNKNOWN_SCALING).scales
        ):
            root_text = "this word and its number in the file are about the PV before"
            yield f"the loop takes the PV's root; {root_text}: {self.root_basis}"
        if placement.raw is not None and content not in {None, placement.raw}:
            stored = f"{placement.raw:04X}" if self.hexadecimal else placement.raw
            yield f"the file sets {name} to {stored}"

    def _raw_content(self, question: Question, kind: Kind, name: str) -> int | None:
        """The content that a question gives."""
        return None if question.value is None else raw_of(question.value, kind, name, hexadecimal=self.hexadecimal)

    def _note_number_base(self, page: Page, question: Question) -> Page:
        """A note on a content whose decimal digits are another number where a listing shows them."""
        text = question.value
        if (
            text is None
            or self.hexadecimal
            or page.value is None
            or not text.isdecimal()
            or int(text) < MIN_HEXADECIMAL
        ):
            return page
        kind = next((b.kind for b in self.space.banks if type(b.kind.show(0)) is type(page.value.raw)), None)
        if kind is None or len(text) > kind.digits or (kind is SINGLE and len(text) < kind.digits):
            return page
        other = kind.text(int(text, 16))
        note = f"read as decimal; the listing's hex {text} is {other}: write 0x{text}"
        return replace(page, notes=(*page.notes, note))

    def _bank_of(self, prefix: str) -> Bank | None:
        return next((bank for bank in self.space.banks if bank.prefix == prefix), None)

    def _address_pages(self, question: Question) -> list[Page]:
        """``V7642``, ``DF106``, ``V7642.3``."""
        match = ADDRESS_PATTERN.fullmatch(question.name)
        bank = self._bank_of(match.group(1).upper()) if match else None
        if match is None or bank is None:
            return []
        name = f"{bank.prefix}{match.group(2)}"
        number = self.space.parse(name)
        if number is None:
            first = self.space.name(self.space.number_of(bank.prefix, bank.first)) if bank.first else f"{bank.prefix}0"
            last = self.space.name(self.space.number_of(bank.prefix, bank.last))
            digits = "octal digits, " if bank.octal else ""
            raise QuestionError(f"{question.name} is no address of the {self.title}: {digits}{first} to {last}")
        placement, bit = (
            self._placement_at(number, question),
            self._bit_number(match.group(3), self.space.kind_of(number)),
        )
        raw = self._raw_content(question, self.space.kind_of(number), name)
        if placement is None:
            return [self._unplaced_page(name, number, raw, question, bit)]
        return [self._placement_page(placement, self.space.name(number), raw, bit)]

    def _placement_at(self, number: int, question: Question) -> Placement | None:
        """The register at an address: as the configuration says, of a block that always is there, or of one named."""
        placement = question.config.placement_at(number) if question.config is not None else None
        if placement is not None:
            return placement
        for block, start in self._block_starts(question):
            if start <= number < start + block.length:
                index, offset = divmod(number - start, block.table.size)
                loop = f"loop {index + 1} of a table at {self.space.name(start)}" if block.repetitions > 1 else None
                return Placement(block.table, word_at(block.table, offset), loop)
        return None

    def _block_starts(self, question: Question) -> Iterator[tuple[Block, int]]:
        """Blocks with the addresses at which they begin."""
        addresses = [number for text in question.starts if (number := self.space.parse(text.upper())) is not None]
        for block in self.blocks:
            example = self.space.parse(block.start)
            if block.is_fixed and example is not None:
                yield block, example
            if not block.is_in_loop or block.is_fixed or example is None:
                continue
            starts = [n for n in addresses if self.space.bank_and_number(n)[0].prefix == block.prefix]
            yield from ((block, number) for number in starts or [example] * question.at_example)

    def _unplaced_page(self, name: str, number: int, raw: int | None, question: Question, bit: int | None) -> Page:
        """An address that no known block has: the part of the memory, and what it is in loops that begin as usual."""
        bank, n = self.space.bank_and_number(number)
        blocks = [(b, start) for b, start in self._block_starts(question) if not b.is_fixed and b.prefix == bank.prefix]
        if blocks:
            spans = ", ".join(f"{self.space.name(s)} to {self.space.name(s + b.length - 1)}" for b, s in blocks)
            raise QuestionError(
                f"{name} lies outside the registers of the loops ({spans}); "
                "name the start of the block with --block ADDRESS"
            )
        region = next((text for first, last, text in self.regions if first <= n <= last), "")
        examples = ", ".join(
            b.start for b in self.blocks if b.prefix == bank.prefix and not b.is_fixed and b.is_in_loop
        )
        note = (
            f"what it holds depends on where the loops begin: --loop takes {examples}, --block ADDRESS another start, "
            "--in FILE a configuration"
        )
        title = region or f"a register of bank {bank.prefix}"
        page = self.page(Record(kind="register", name=name, title=title, notation=bank.kind.holds))
        if raw is not None:
            shown = self.raw_text(bank.kind, raw)
            value = Value(bank.kind.show(raw), shown, f"decimal {raw}" if self.hexadecimal else shown)
            page = replace(page, value=value)
        if "system" in region:
            return page
        page = replace(page, notes=(*(() if question.config else self._meaning_by_default(number, bit)), note))
        if bit is None:
            return page
        points = tuple(self._bits_of_blocks(bank.prefix, bit))
        return replace(page, name=f"{name}.{bit}", title=f"bit {bit} of {page.title}", points=points)

    def _bits_of_blocks(self, prefix: str, bit: int) -> Iterator[Point]:
        """What a bit is in each register of bits in a loop's blocks."""
        for block in self.blocks:
            if block.prefix == prefix and block.is_in_loop and not block.is_fixed:
                for row in block.table.bits:
                    if bit in row.bits and row.access != "reserved":
                        yield Point(f"{block.table.offset_text(row.offset)}.{bit}", row.title)

    def _meaning_by_default(self, number: int, bit: int | None) -> Iterator[str]:
        """What an address is where the loops begin as in the manual or the starter file, one behind the other."""
        for block in self.blocks:
            start = self.space.parse(block.start)
            if start is None or block.is_fixed or not block.is_in_loop or not self.space.has_bank(number):
                continue
            loop, offset = divmod(number - start, block.table.size)
            if self.space.bank_and_number(number)[0].prefix == block.prefix and 0 <= loop < MAX_LOOPS:
                record = self.record(block.table, word_at(block.table, offset), bit)
                bit_text = "" if bit is None else f".{bit}"
                place = f"{block.table.offset_text(offset)}{bit_text} of loop {loop + 1}, {record.title}"
                yield f"if the loops begin at {block.start}, one behind the other, it is {place}"

    def _offset_pages(self, question: Question) -> list[Page]:
        """``addr+06.10``, ``Cn+12``, ``Base+5``: in the notation of the vendor's manual."""
        match = OFFSET_PATTERN.fullmatch(question.name)
        if match is None:
            return []
        prefix = "".join(c for c in match.group(1).lower() if c.isalnum())
        named_blocks = [block for block in self.blocks if prefix in block.offset_prefixes]
        is_named = bool(named_blocks or prefix)
        pages, problems = [], []
        for block in (
            named_blocks if is_named else (block for block in self.blocks if block.is_in_loop and not block.is_fixed)
        ):
            bank = self._bank_of(block.prefix)
            if bank is None:
                continue
            digits = match.group(2)
            if bank.octal and not set(digits) <= set("01234567"):
                raise QuestionError(
                    f"{question.name}: offsets of the {self.title} are octal; {digits} has a digit above 7"
                )
            offset = int(digits, 8 if bank.octal else 10)
            length = block.length if block.repetitions > 1 and not block.is_in_loop else block.table.size
            if offset >= length:
                problems.append(f"{question.name}: the block ends at {block.table.offset_text(length - 1)}")
                continue
            placement = Placement(block.table, word_at(block.table, offset % block.table.size))
            name = block.table.offset_text(offset)
            try:
                raw, bit = self._raw_content(question, bank.kind, name), self._bit_number(match.group(3), bank.kind)
                page = self._placement_page(placement, name, raw, bit)
            except QuestionError as error:
                problems.append(str(error))
                continue
            if is_named or page.title != NO_MEANING_TEXT:
                pages.append(page)
        if problems and not pages:
            raise QuestionError("; ".join(dict.fromkeys(problems)))
        return pages

    @staticmethod
    def _bit_number(text: str | None, kind: Kind) -> int | None:
        """The number of a bit, decimal as all the manuals write it."""
        if text is None:
            return None
        highest = min(HIGHEST_BIT, 4 * kind.digits - 1)
        if kind.digits == 1 or int(text) > highest:
            limit = "a word has the bits 0 to 15" if highest == HIGHEST_BIT else f"a {kind.name} has no bits"
            raise QuestionError(f"bit {text}: {limit}")
        return int(text)

    def _number_pages(self, question: Question) -> list[Page]:
        """``CK27``, or ``27`` alone: a number that the PLC shows."""
        text = question.name.lower().translate(SEPARATORS)
        for series in self.series:
            for prefix in series.prefixes:
                digits = text.removeprefix(prefix)
                if text.startswith(prefix) and is_number(digits):
                    return [self._number_page(series, int(digits))]
        for series in self.series:
            if is_number(text) and (question.one_vendor or int(text) in {code.number for code in series.codes}):
                return [self._number_page(series, int(text))]
        return []

    def _number_page(self, series: Series, number: int) -> Page:
        page = self.page(self.number_record(series, number))
        numbers = [code.number for code in series.codes]
        note = f"numbers that are known: {', '.join(map(str, numbers))}"
        return page if number in numbers else replace(page, notes=(note,))

    def _name_pages(self, question: Question) -> list[Page]:
        """A register's or choice's own name, with each loop of the configuration that has it."""
        name, loop = question.name_and_loop
        pages = []
        for record in self.index.get(name.lower()) or self._nickname_records(name.lower()):
            placements = [(Placement(record.table, record.word), record.word.name)]
            if question.config is not None:
                placements = self._configured_placements(record, question.config, loop) or placements
            for placement, address in placements:
                raw = self._raw_content(question, self.kind_of(record.table), address)
                pages.append(self._placement_page(placement, address, raw, record.bit))
        return pages

    def _configured_placements(
        self, record: RegisterRecord, config: ConfigIndex, loop: str | None
    ) -> list[tuple[Placement, str]]:
        """A register in the loops of a configuration, with its addresses."""
        try:
            return [(p, self.space.name(number)) for p, number in config.placements_of(record.table, record.word, loop)]
        except NoRegisterError as error:
            file = config.document.file
            raise QuestionError(f"{error}; 'pidcfg validate {file}' says where it may begin") from None

    def _nickname_records(self, name: str) -> list[RegisterRecord]:
        """A nickname: the loop's name and a suffix, or the suffix without its first underscore; no sentence is one."""
        if "_" not in name or not name.replace("_", "").replace("-", "").isalnum():
            return []
        suffixes = [alias for alias in self.aliases if alias.startswith("_") and f"_{name}".endswith(alias.lower())]
        return self.index[max(suffixes, key=len).lower()] if suffixes else []

    def _unstored_key_pages(self, question: Question) -> list[Page]:
        """A key that no register holds by its path, its last part or its section, once for each loop that gives it."""
        name, loop = question.name_and_loop
        key = name.lower()
        paths = [path for path in self.unstored_keys if key == path]
        paths = paths or [path for path in self.unstored_keys if path.endswith(f".{key}")]
        paths = paths or [path for path in self.unstored_keys if key in parse_path(path)[:-1]]
        if paths and question.value is not None:
            raise QuestionError(
                f"{question.text}: {paths[0]} {self.unstored_keys[paths[0]]}; it has no content to explain"
            )
        return [page for path in paths for page in self._unstored_pages(path, question, loop)]

    def _unstored_pages(self, path: str, question: Question, loop: str | None) -> Iterator[Page]:
        page = self.page(self.unstored_record(path))
        origins = question.config.origins(path, in_loops=not path.startswith(PLC_PREFIX)) if question.config else []
        for origin in [origin for origin in origins if loop in {None, origin.loop}]:
            name = f"{origin.loop}.{path}" if origin.loop else path
            yield replace(page, name=name, value=Value(origin.text, origin.text), loop=origin.loop, origins=(origin,))
        if not any(loop in {None, origin.loop} for origin in origins):
            yield page
