"""The records of a vendor whose parameters have names and types, and what the content of a parameter says."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from pidcfg.encoders.parameters import read, shown
from pidcfg.encoders.regmap import Bits
from pidcfg.explanation.annotate import Line
from pidcfg.explanation.book import WRITERS, Book, Part, Record
from pidcfg.explanation.page import Value
from pidcfg.explanation.texts import first_sentence, key_text, limits_text
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.limits import limits_at
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.units import SIDES, unit_text, units_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.meanings import Meaning
    from pidcfg.encoders.parameters import Content, Parameter, ParameterTable

ACCESS = {"input": "setting", "output": "status"}


class Group(NamedTuple):
    """A structure of bits: its name, and those of its members that a number counts, in their order."""

    name: str
    meaning: Meaning
    members: Callable[[Parameter], bool]


class Words(NamedTuple):
    """A parameter that takes several words: its name, what each of them holds, and the manual's place."""

    name: str
    rows: Sequence[tuple[int, int, str, str]]
    basis: str

    @property
    def last(self) -> int:
        """The number of the last word."""
        return self.rows[-1][1]

    def record(self, number: int) -> Record:
        """One of the words, from 0 to the last."""
        title, text = next((title, text) for first, last, title, text in self.rows if first <= number <= last)
        return Record(
            kind="register",
            name=f"{self.name}+{number}",
            title=title,
            detail=text,
            notation="a double word (two registers)",
            basis=self.basis,
        )


@dataclass(frozen=True, kw_only=True)
class ParameterRecord(Record):
    """A parameter of blocks in which it is the same."""

    row: Parameter
    table: str
    """One of those in which it is the same."""


@dataclass(frozen=True, kw_only=True)
class Parameters(Book):
    """The tables of a vendor whose parameters have names and types."""

    heads: ClassVar = ("name", "", "value", "", "type")
    tables: Mapping[str, ParameterTable]
    """By the name that stands before a parameter's."""
    schemas: Mapping[str, type[BaseModel]] = field(default_factory=dict)
    """The schema of a table whose rows have no titles, by the same name."""
    split: Callable[[str, Sequence[Mapping[str, Any]]], tuple[str, str | None, str]]
    """A listing's name to loop, table and parameter."""
    groups: tuple[Group, ...] = ()
    counted: str = ""
    """What the numbers of a structure's bits rest on."""
    bits: Mapping[str, Meaning] = field(default_factory=dict)
    block_bits: Mapping[tuple[str, str], Meaning] = field(default_factory=dict)
    """Meanings of bits that differ in one table, by the table and the bit."""
    states: Mapping[tuple[str, bool], str] = field(default_factory=dict)
    """What TRUE and FALSE choose, by the parameter."""
    words: Words | None = None
    remark: Callable[[Parameter, Content], str] | None = None
    """What is special about a content."""

    @property
    def spellings(self) -> dict[str, str]:
        """All names that can be asked for, in small letters, with their spelling."""
        rows = (row.name for table in self.tables.values() for row in table.rows)
        return {name.lower(): name for name in (*rows, *(group.name for group in self.groups), *self.tables)}

    def text(self, table: str, row: Parameter) -> str:
        """What a parameter is, by its table or else its schema."""
        return row.title or (key_text(self.schemas[table], row.name) if table in self.schemas else "")

    def bit_meaning(self, tables: Sequence[str], row: Parameter) -> Meaning | None:
        """What a bit means, in tables that do not differ."""
        block = self.block_bits.get((tables[0], row.name)) if len(tables) == 1 else None
        return block or self.bits.get(row.name)

    def record(self, tables: Sequence[str], row: Parameter) -> ParameterRecord:
        """A parameter of tables in which it is the same."""
        text = self.text(tables[0], row)
        title = title_of(row, text)
        return ParameterRecord(
            kind="parameter",
            name=row.name,
            title=title,
            detail=text if title != text else "",
            key=row.name if row.access == "input" else None,
            unit=row.unit,
            notation=row.type.name + (f": {', '.join(row.type.words)}" if row.type.words else ""),
            access=ACCESS[row.access],
            by=self.writers.get(row.name, WRITERS[row.access]),
            basis=row.basis,
            meaning=self.bit_meaning(tables, row),
            parts=tuple(self._choices(row)),
            row=row,
            table=tables[0],
        )

    def _choices(self, row: Parameter) -> Iterator[Part]:
        """What the states of a switch, or the numbers of a mode, mean."""
        for (name, state), text in self.states.items():
            if name == row.name:
                yield Part(shown(row.type, state), text)
        yield from (Part(str(code.number), code.title, code.meaning) for code in self.codes(row.name))

    def block(self, key: str) -> Record:
        """A block with the names of its parameters."""
        rows = self.tables[key].rows
        title, names = f"a block of {len(rows)} parameters", ", ".join(row.name for row in rows)
        return Record(kind="structure", name=key, title=title, detail=names, basis=rows[0].basis)

    def group(self, group: Group, rows: Sequence[Parameter], tables: Sequence[str]) -> Record:
        """A structure of bits, in tables whose bits are the same."""
        titles = [f"{row.name.partition('.')[2]}: {row.title}" for row in rows]
        bits = [Bits(0, (i,), None, {0: False, 1: True}, title) for i, title in enumerate(titles)]
        meanings = [self.bit_meaning(tables, row) for row in rows]
        return Record(
            kind="structure",
            name=group.name,
            title=f"{len(rows)} bits of {', '.join(tables)}",
            notation="a structure of bits, counted in the order of its members",
            access="status",
            by="the block: outputs, only to be read",
            meaning=group.meaning,
            parts=tuple(Part.of(row, meaning) for row, meaning in zip(bits, meanings, strict=True)),
        )

    def value(self, row: Parameter, raw: Content | Wire, units: Mapping[str, str], table: str) -> Value:
        """A content as the programming language writes it, and what it says."""
        if isinstance(raw, Wire):
            return Value(raw.text, f":= {raw.text}", "wired: it follows this expression")
        return Value(raw, shown(row.type, raw), self.saying(row, raw, units, table))

    def saying(self, row: Parameter, raw: Content, units: Mapping[str, str], table: str) -> str:
        """What a content says in a table: a state, a mode, or a number with its unit."""
        choice = self.choice(row, raw)
        if choice:
            return choice
        if isinstance(raw, bool):
            return "true" if raw else "false"
        if isinstance(raw, str):
            return raw
        remark = (self.remark(row, raw) if self.remark else "") or self._beyond(row, raw, table)
        text = f"{decimal_text(Decimal(repr(raw)))} {known_unit(row.unit, units)}".rstrip()
        return f"{text} ({remark})" if remark else text

    def _beyond(self, row: Parameter, raw: float, table: str) -> str:
        """The limits that a number passes, and what the block reports then; empty: none."""
        limits = limits_at(self.schemas[table], row.name) if table in self.schemas and row.access == "input" else None
        if limits is None or limits.holds(Decimal(repr(raw))):
            return ""
        return limits_text(limits) + (f": {limits.effect}" if limits.effect else "")

    def choice(self, row: Parameter, raw: Content) -> str:
        """What a state or number chooses that has a meaning of its own."""
        if isinstance(raw, bool):
            return self.states.get((row.name, raw), "")
        code = self.code(row.name, raw)
        return code.title if code else ""

    def row_of(self, name: str, settings: Sequence[Mapping[str, Any]]) -> tuple[str, str, Parameter] | None:
        """The loop, the table and the row of a listing's name."""
        loop, kind, parameter = self.split(name, settings)
        table = self.tables.get(kind) if kind is not None else None
        row = next((row for row in table.rows if row.name == parameter), None) if table else None
        return None if row is None or kind is None else (loop, kind, row)

    def lines(self, listing: Listing, options: Mapping[str, object]) -> Iterator[Line]:
        """Every parameter of a listing with its meaning."""
        del options
        units = {str(settings.get("loop")): units_of(settings) for settings in listing.settings}
        for name, raw in listing.words.items():
            content = f":= {raw.text}" if isinstance(raw, Wire) else str(raw)
            entry = self.row_of(name, listing.settings)
            if entry is None:
                text = "a signal of the program" if "." not in name else "belongs to no loop"
                yield Line(name, "", content, "", "", text)
                continue
            loop, kind, row = entry
            title = title_of(row, self.text(kind, row))
            if isinstance(raw, Wire):
                text = f"{title}; wired"
            elif read(row.type, raw) is None:
                text = f"{title}: no value of {row.type.name}"
            else:
                content = shown(row.type, raw)
                text = self.choice(row, raw) or f"{title}: {self.saying(row, raw, units.get(loop, {}), kind)}"
            yield Line(name, "", content, "", row.type.name, text)


def members(group: Group, table: ParameterTable) -> tuple[Parameter, ...]:
    """The bits of a structure in a table."""
    return tuple(row for row in table.rows if row.name.startswith(f"{group.name}.") and group.members(row))


def title_of(row: Parameter, text: str) -> str:
    """What a parameter is, in short; of one that tells first what TRUE is, only that it is a switch."""
    return "a switch" if row.type.kind == "bool" and text.startswith(("TRUE", "FALSE")) else first_sentence(text)


def known_unit(unit: str, units: Mapping[str, str]) -> str:
    """A unit in the loop's own units; none where it depends on something else."""
    text = unit_text(unit, units, "/")
    return "" if "," in unit or text in SIDES else text
