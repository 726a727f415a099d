"""The words of a configuration with their addresses: content, engineering value, and the bits of bit words."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import path_text
from pidcfg.encoders.parameters import shown
from pidcfg.encoders.regmap import Bits
from pidcfg.encoders.words import DecodeError
from pidcfg.report import content
from pidcfg.report.roots import word_before_root
from pidcfg.report.settings import CHOICE, NOWHERE
from pidcfg.report.texts import cell as cell_of
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.units import unit_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pidcfg.encoders.image import Block, Cell, Encoding
    from pidcfg.encoders.parameters import Entry, Program
    from pidcfg.encoders.regmap import Word
    from pidcfg.explanation.find_parameter import ParameterBook

THE_PLC = "the PLC"
BCD = "BCD"
"""How the notation of a codec of decimal digits begins."""
AS_PV = "as the PV"
"""A choice that stands for none of its own: the output takes the PV's format."""


def places_of(encoding: Encoding, loop: int) -> dict[str, str]:
    """Where the registers of a loop, by its number, hold each setting, by its path; a pair of limits has two.

    A key that stands for another, such as ``cascade_from`` for the address of an output, has the register of that.
    """
    places: dict[str, list[str]] = {}
    for block in encoding.blocks:
        rows: tuple[Word | Bits, ...] = (*block.table.words, *block.table.bits)
        for row in rows if _belongs(block, loop) else ():
            if row.path is not None:
                path = path_text((*block.place[2:], row.path)).removesuffix(".0").removesuffix(".1")
                name = encoding.space.name(block.start + row.offset)
                plural = "s" if isinstance(row, Bits) and len(row.bits) > 1 else ""
                numbers = f" bit{plural} {bit_numbers(row)}" if isinstance(row, Bits) else ""
                for key in filter(None, (path, None if isinstance(row, Bits) else row.instead)):
                    places.setdefault(key, []).append(name + numbers)
    return {path: ", ".join(names) for path, names in places.items()}


def _belongs(block: Block, loop: int | None) -> bool:
    """Whether a block is of a loop by its number (two may have one name), or of none."""
    return block.loop is None if loop is None else block.place[:2] == ("loops", loop)


@dataclass(frozen=True, slots=True)
class Words:
    """The registers of a configuration, as one loop or the PLC sees them."""

    encoding: Encoding
    units: Mapping[str, str] = field(default_factory=dict)
    setting_units: Mapping[str, str] = field(default_factory=dict)
    """Units by path, which leave no choice."""
    writers: Mapping[str, str] = field(default_factory=dict)
    """Who writes a status register that is not the PLC's alone, by its name."""

    def blocks(self, loop: int | None) -> tuple[content.Block, ...]:
        """The blocks of one loop, by its number (None: of the PLC)."""
        blocks: dict[str, list[content.Register]] = {}
        for block in self.encoding.blocks:
            if _belongs(block, loop):
                blocks.setdefault(block.table.title, []).extend(self._registers(block))
        return tuple(content.Block(title, tuple(rows)) for title, rows in blocks.items() if rows)

    def _registers(self, block: Block) -> Iterator[content.Register]:
        """The registers of a block; reserved ones that hold nothing stand together."""
        cells = {cell.number - block.start: cell for cell in block.cells(self.encoding.space)}
        memory = self.encoding.image.words
        rows = [(word, memory[block.start + word.offset]) for word in block.table.words if word.offset in cells]
        for reserved, run in groupby(rows, key=lambda row: row[0].access == "reserved" and not row[1]):
            if reserved:
                words = [word for word, _ in run]
                first, last = (cells[words[i].offset] for i in (0, -1))
                address = first.address if first is last else f"{first.address} to {last.address}"
                title = words[0].title
                yield content.Register(address, "", first.kind.hex(0), 0, None, "", title, "reserved")
            else:
                yield from (self._register(word, block, cells[word.offset], raw) for word, raw in run)

    def _register(self, word: Word, block: Block, cell: Cell, raw: int) -> content.Register:
        every = tuple(_bits(row, raw) for row in block.table.bits if row.offset == word.offset)
        value, unit = (None, "") if every or word.access == "status" else self._value(word, block, raw)
        if value is not None and not unit and not isinstance(value, str):
            open_ = not word.unit or CHOICE.search(word.unit)
            unit = self.setting_units.get(str(word.path), "") if open_ else unit_text(word.unit, self.units)
        meaning, before = word.title, word_before_root(word, block, raw)
        if before is not None and word.access == "setting":
            value, unit, reached = before.percent, before.unit, before.reached(self.units["pv"])
            meaning += f", {reached}" if reached else ""
        return content.Register(
            address=cell.address,
            name=cell.field,
            hex=cell.kind.hex(raw),
            decimal=cell.kind.show(raw) + 0,
            value=value,
            unit=unit,
            meaning=meaning,
            owner=word.access,
            bits=tuple(bit for bit in every if bit.owner == "setting" or set(bit.state) != {"0"}),
            by=self.writers.get(word.name, THE_PLC) if word.access == "status" else "",
            counted=not every and is_counted(word),
        )

    def _value(self, word: Word, block: Block, raw: int) -> tuple[content.Value, str]:
        """What the PLC reads in a register, in engineering units; counts where there is no range."""
        spelled = getattr(word.codec, "spelled", None)
        if spelled is not None:
            return spelled(raw, self.encoding.space.name), ""
        try:
            value: Any = block.table.decode_word(word, raw, block.scales)
        except DecodeError:
            return "no value", ""
        step, off = getattr(word.codec, "step", None), getattr(word.codec, "off", ())
        if off and step and value / step in off:
            return getattr(word.codec, "special", "off"), ""
        scale = block.scales.get(getattr(word.codec, "scale", ""))
        if isinstance(value, Quantity) and (value.counts or scale is None or scale.range is None):
            return value.value, "counts"
        if isinstance(value, bool):
            return "on" if value else "off", ""
        return (None if word.access == "reserved" else cell_of(value)), ""


def is_counted(word: Word) -> bool:
    """Whether the decimal number of a register says something."""
    notation = str(getattr(word.codec, "notation", ""))
    return not notation.startswith(BCD) and not hasattr(word.codec, "spelled")


def with_words(facts: Iterable[content.Fact], blocks: Sequence[content.Block]) -> Iterator[content.Fact]:
    """The facts with what stands in their registers, beside the addresses."""
    shown = content.contents_of(blocks)
    for fact in facts:
        places = [f"{place} {shown[place]}" if place in shown else place for place in fact.place.split(", ")]
        yield replace(fact, place="" if fact.place == NOWHERE else ", ".join(places))


def _bits(row: Bits, raw: int) -> content.Bit:
    """A choice with its state, most significant bit first."""
    state = "".join(str(raw >> bit & 1) for bit in reversed(row.bits))
    try:
        value = row.decode(raw)
    except DecodeError:
        value = "no value"
    spelled = (
        {None: AS_PV if row.access == "setting" else "", False: "off", True: "on"}.get(value)
        if isinstance(value, bool | None)
        else str(value)
    )
    return content.Bit(bit_numbers(row), state, spelled or "", row.title, row.access)


def bit_numbers(row: Bits) -> str:
    """The bits of a choice, the most significant first, as its state is written."""
    return ", ".join(map(str, reversed(row.bits))) if len(row.bits) < 5 else f"{row.bits[-1]} to {row.bits[0]}"


def parameters_of(
    program: Program, loop: str | None, book: ParameterBook, units: Mapping[str, str] | None = None
) -> tuple[content.Parameter, ...]:
    """The named parameters of one loop (None: of what is no loop); ``units``: the loop's, else those of the table."""
    return tuple(_parameter(entry, program, book, units) for entry in program.cells if entry.loop == loop)


def _parameter(
    entry: Entry, program: Program, book: ParameterBook, units: Mapping[str, str] | None
) -> content.Parameter:
    place = book.row_of(entry.address, program.settings)
    meaning, unit = (book.text(place[1], place[2]), place[2].unit) if place else ("", "")
    if isinstance(entry.raw, Wire):
        text, unit = f":= {entry.raw.text}", ""
    else:
        text = shown(entry.type, entry.raw)
        unit = "" if isinstance(entry.raw, bool) else unit if units is None else units.get(entry.field, "")
    return content.Parameter(entry.address, entry.type.name, text, unit, meaning, entry.device or "")
