"""Terms of a vendor with registers: every row of its map that a loop has, with the register's content."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.differences.leaves import Leaf
from pidcfg.differences.risk import CALCULATED
from pidcfg.differences.terms import (
    SETPOINT,
    Item,
    Kind,
    Owner,
    Subject,
    Terms,
    beside,
    kind_by,
    number,
    others,
    said,
    trimmed,
    unit_names,
    whole_file,
)
from pidcfg.encoders.regmap import decode_one
from pidcfg.encoders.spaces import NoRegisterError
from pidcfg.encoders.words import Choice, DecodeError
from pidcfg.encoders.written import writer_of
from pidcfg.paths import dotted, steps, value_at
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.units import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.image import Block
    from pidcfg.encoders.regmap import Bits, Word
    from pidcfg.encoders.written import Written

SETPOINT_VALUE = f"{SETPOINT}.value"
COUNT, TABLE = "plc.number_of_loops", "plc.loop_table"
"""Registers of a set-up that says which loops the PLC calculates, and where they begin."""
PLACE_OF_LOOP = 2
"""Steps of the place of a loop: ``("loops", 0)``."""


def memory_terms(subject: Subject) -> Terms:
    """The loops and the set-up of a file or listing."""
    setup = [_Block(subject, block, subject.config) for block in subject.encoding.blocks if not block.place]
    registers = {key: item for block in setup for key, item in block.items((), {})}
    held = {path: value for block in setup for path, value in block.values()}
    loops, settings, shift = [], subject.settings, _shift(subject, held)
    outputs = {tag: loop.name for loop in subject.config.loops if (tag := getattr(loop.output, "tag", None))}
    for i, loop in enumerate(subject.config.loops):
        own = [block for block in subject.encoding.blocks if block.place[:2] == ("loops", i)]
        blocks = [_Block(subject, block, loop, outputs) for block in own]
        values = {path: value for block in blocks if not block.prefix for path, value in block.values()}
        table: tuple[Written, ...] = subject.vendor.load("written")
        items = {key: item for block in blocks for key, item in block.items(table, values)}
        names, entry = {row.name: row for row in table if row.when(values)}, settings[i]
        items |= beside(entry, loop, names, subject.faults(loop.name))
        items |= dict(_tables(blocks)) if subject.reading is None else {}
        if entry.get(SETPOINT) is False:
            items[SETPOINT_VALUE] = replace(items[SETPOINT_VALUE], kind="live")
        items |= dict(others(loop, subject, [*items, *(key for block in blocks for key in block.instead())]))
        items |= _calculated(registers, held, i)
        place = " ".join(_named(subject, b.block.start + shift) for b in blocks if not b.prefix)
        loops.append(Owner(loop.name, "loop", place, items, subject.is_described))
    owners = (whole_file(subject, registers), *loops)
    reading = subject.reading
    if reading is None:
        return Terms(owners)
    words, space = reading.listing.words, subject.encoding.space
    return Terms(owners, is_listing=True, holds=lambda address: space.parse(address.partition(".")[0]) in words)


def _calculated(registers: Mapping[str, Item], held: Mapping[str, Any], i: int) -> dict[str, Item]:
    """Whether the PLC calculates loop ``i``, where a register says how many loops it does."""
    item, count = registers.get(COUNT), held.get(COUNT)
    if item is None or count is None:
        return {}
    value = CALCULATED if i < count else "not calculated"
    return {COUNT: replace(item, value=value, content=value, unit="", file_only=True)}


def _shift(subject: Subject, held: Mapping[str, Any]) -> int:
    """How far the loops of a listing stand behind those whose places it is compared at."""
    start = held.get(TABLE)
    if subject.reading is None or not subject.reading.fault or start is None:
        return 0
    return int(start - value_at(subject.config, steps(TABLE)))


def _named(subject: Subject, number: int) -> str:
    """An address; a set-up that is no value may place a loop where nothing is."""
    try:
        return str(subject.encoding.space.name(number))
    except NoRegisterError:
        return "no register"


def _tables(blocks: list[_Block]) -> Iterator[tuple[str, Item]]:
    """The tables of a loop that a file may leave alone, ``ramp_soak.steps``: that it writes them, if only zeros."""
    for key in dict.fromkeys(block.prefix.rstrip(".0123456789") for block in blocks if block.prefix):
        yield key, Item(key, "the table is written", content=True, file_only=True)


class _Block:
    """A block of registers of one side."""

    def __init__(self, subject: Subject, block: Block, model: Any, outputs: Mapping[str, str] | None = None) -> None:
        self.subject, self.block, self.model = subject, block, model
        self.outputs = outputs or {}
        """Loops by the register that their output is written to, where they choose it: in a cascade another's."""
        inner = dotted(block.place[PLACE_OF_LOOP:])
        self.prefix = f"{inner}." if inner else ""
        self.units = unit_names(model)
        self.is_own = subject.reading is None or not subject.reading.fault

    def raw(self, offset: int) -> int | None:
        """The content of a register; None: the listing does not hold it."""
        if self.subject.reading is None:
            return self.block.encoded.words[offset]
        word: int | None = self.subject.reading.listing.words.get(self.block.start + offset)
        return word

    def fault(self, offset: int) -> str:
        """Why the listing's word is no value."""
        reading = self.subject.reading
        return "" if reading is None else reading.unreadable.get(self.block.start + offset, "")

    def values(self) -> Iterator[tuple[str, Any]]:
        """What the registers and choices mean, by their paths; None: nothing."""
        rows: tuple[Word | Bits, ...] = (*self.block.table.words, *self.block.table.bits)
        for row in rows:
            if row.path is not None:
                yield row.path, self.value(row)

    def value(self, row: Word | Bits) -> Any:
        """What a row means."""
        raw = self.raw(row.offset)
        try:
            if raw is None or self.fault(row.offset):
                return None
            return row.decode(raw) if not hasattr(row, "codec") else decode_one(row.codec, raw, self.block.scales)
        except (DecodeError, ArithmeticError):
            return None

    def instead(self) -> list[str]:
        """Keys that say in other words what a register holds."""
        return [row.instead for row in self.block.table.words if row.instead is not None]

    def items(self, table: tuple[Written, ...], values: Mapping[str, Any]) -> Iterator[tuple[str, Item]]:
        """Every row; the bits of a word that no key sets are one item, and those that are reserved another."""
        by_offset: dict[int, list[Bits]] = {}
        for row in self.block.table.bits:
            by_offset.setdefault(row.offset, []).append(row)
        for word in self.block.table.words:
            if not self.block.loop and word.access == "status":
                continue
            rows = by_offset.get(word.offset, [])
            writer = writer_of(table, word.name, values)
            yield from ((f"{self.prefix}{row.path}", self.choice(word, row)) for row in rows if row.path is not None)
            if not rows:
                item = self.register(word, writer)
                yield self.prefix + (word.path or word.name), replace(item, optional=bool(self.prefix))
                continue
            if left := sum(row.mask for row in rows if row.path is None and row.access != "reserved"):
                yield self.prefix + word.name, self.bits(word, word.name, left, "live")
            if reserved := sum(row.mask for row in rows if row.access == "reserved"):
                name = f"{word.name}.reserved"
                yield self.prefix + name, self.bits(word, name, reserved, "reserved")

    def choice(self, word: Word, row: Bits) -> Item:
        """A choice inside a word."""
        raw, key = self.raw(row.offset), f"{self.prefix}{row.path}"
        address, text = self.place(row.offset)
        if raw is None:
            return Item(key, address=address, known=False)
        if len(row.bits) == 1:
            address, text = f"{address}.{row.bits[0]}", str(raw >> row.bits[0] & 1)
        access = row.access if row.access != "setting" else word.access
        kind, value = kind_by(access, None), self.value(row)
        return Item(key, number(value), "", raw & row.mask, address, text, kind, fault=self.fault(row.offset))

    def bits(self, word: Word, name: str, mask: int, kind: Kind) -> Item:
        """The bits of a word that the PLC sets, or that ask it for something; or those that are nobody's."""
        raw, (address, text) = self.raw(word.offset), self.place(word.offset)
        content = None if raw is None else raw & mask
        return Item(self.prefix + name, None, "", content, address, text, kind, known=raw is not None)

    def register(self, word: Word, writer: Written | None) -> Item:
        """A register of its own."""
        raw, (address, text) = self.raw(word.offset), self.place(word.offset)
        key = self.prefix + (word.path or word.name)
        if raw is None:
            return Item(key, address=address, known=False)
        key, value, unit = self.shown(word, raw, key)
        kind, by = kind_by(word.access, writer), "" if writer is None else writer.by
        if outer := self.outputs.get(address):
            kind, by = "live", f"{outer}, whose output it is"
        return Item(key, value, unit, raw, address, text, kind, by, self.fault(word.offset))

    def shown(self, word: Word, raw: int, key: str) -> tuple[str, Any, str]:
        """The key of a register, what the file says of it, and its unit; else what its content means."""
        other = None if word.instead is None or not self.is_own else value_at(self.model, steps(word.instead))
        if other is not None and word.instead is not None:
            return word.instead, number(other), ""
        if self.fault(word.offset) or word.path is None:
            return key, None, ""
        spelled = getattr(word.codec, "spelled", None)
        if spelled is not None:
            return key, spelled(raw, self.subject.encoding.space.name) if raw else None, ""
        leaf = None if isinstance(word.codec, Choice) or not self.is_own else self.leaf(key)
        if leaf is not None:
            return key, *said(leaf, self.model, self.subject.vendor)
        value = self.value(word)
        is_given = bool(raw) or isinstance(word.codec, Choice)
        is_raw = isinstance(value, Quantity) and (value.counts or not self.block.scales[_scale(word)].range)
        unit = "counts" if is_raw else unit_text(word.unit, self.units)
        return key, number(value) if is_given else None, trimmed(unit)

    def leaf(self, key: str) -> Leaf | None:
        """The value that the configuration gives for a key; None: it gives none."""
        path = steps(key)
        value = value_at(self.model, path)
        named = path[:-1] if isinstance(path[-1], int) else path
        model = value_at(self.model, named[:-1]) if named[:-1] else self.model
        return None if value is None or model is None else Leaf(named, value, model, str(named[-1]), given=True)

    def place(self, offset: int) -> tuple[str, str]:
        """The address of a register, and its content as the PLC shows it."""
        space, number_ = self.subject.encoding.space, self.block.start + offset
        raw = self.raw(offset)
        return space.name(number_), "" if raw is None else space.shown(number_, raw)


def _scale(word: Word) -> str:
    return str(getattr(word.codec, "scale", ""))
