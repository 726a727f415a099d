"""The records of a vendor whose parameters have names and types, and what a question about one is about."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from pidcfg.encoders.parameters import content_text, read_content
from pidcfg.encoders.regmap import Bits
from pidcfg.output.explanation import Page, QuestionError, Value
from pidcfg.output.explanation.book import WRITERS, Book, Line, Part, Record
from pidcfg.output.explanation.page import Question, content_of, first_sentence, key_text, limits_text, parse_integer
from pidcfg.schemas.base import SIDES, limits_at, unit_text, units_of
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.parameters import Content, Entry, Parameter, ParameterTable
    from pidcfg.encoders.regmap import Meaning
    from pidcfg.output.explanation.page import ConfigIndex

# --- The records of a vendor whose parameters have names and types, and what the content of a parameter says ----------

ACCESS_BY_DIRECTION = {"input": "setting", "output": "status"}


class BitGroup(NamedTuple):
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
    def last_number(self) -> int:
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

    column_heads: ClassVar = ("name", "", "value", "", "type")
    tables: Mapping[str, ParameterTable]
    """By the name that stands before a parameter's."""
    schemas: Mapping[str, type[BaseModel]] = field(default_factory=dict)
    """The schema of a table whose rows have no titles, by the same name."""
    split_name: Callable[[str, Mapping[str, str]], tuple[str, str | None, str]]
    """A listing's name to loop, table and parameter, with the types of the listing's blocks."""
    groups: tuple[BitGroup, ...] = ()
    bit_count_basis: str = ""
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

    def parameter_text(self, table: str, row: Parameter) -> str:
        """What a parameter is, by its table or else its schema."""
        return row.title or (key_text(self.schemas[table], row.name) if table in self.schemas else "")

    def bit_meaning(self, tables: Sequence[str], row: Parameter) -> Meaning | None:
        """What a bit means, in tables that do not differ."""
        block = self.block_bits.get((tables[0], row.name)) if len(tables) == 1 else None
        return block or self.bits.get(row.name)

    def record(self, tables: Sequence[str], row: Parameter) -> ParameterRecord:
        """A parameter of tables in which it is the same."""
        text = self.parameter_text(tables[0], row)
        title = title_of(row, text)
        return ParameterRecord(
            kind="parameter",
            name=row.name,
            title=title,
            detail=text if title != text else "",
            key=row.name if row.access == "input" else None,
            unit=row.unit,
            notation=row.type.name + (f": {', '.join(row.type.words)}" if row.type.words else ""),
            access=ACCESS_BY_DIRECTION[row.access],
            writer=self.writers.get(row.name, WRITERS[row.access]),
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
                yield Part(content_text(row.type, state), text)
        yield from (Part(str(code.number), code.title, code.meaning) for code in self.codes(row.name))

    def block_record(self, key: str) -> Record:
        """A block with the names of its parameters."""
        rows = self.tables[key].rows
        title, names = f"a block of {len(rows)} parameters", ", ".join(row.name for row in rows)
        return Record(kind="structure", name=key, title=title, detail=names, basis=rows[0].basis)

    def group_record(self, group: BitGroup, rows: Sequence[Parameter], tables: Sequence[str]) -> Record:
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
            writer="the block: outputs, only to be read",
            meaning=group.meaning,
            parts=tuple(Part.from_bits(row, meaning) for row, meaning in zip(bits, meanings, strict=True)),
        )

    def value(self, row: Parameter, raw: Content | Wire, units: Mapping[str, str], table: str) -> Value:
        """A content as the programming language writes it, and what it says."""
        if isinstance(raw, Wire):
            return Value(raw.text, f":= {raw.text}", "wired: it follows this expression")
        return Value(raw, content_text(row.type, raw), self.content_meaning(row, raw, units, table))

    def content_meaning(self, row: Parameter, raw: Content, units: Mapping[str, str], table: str) -> str:
        """What a content says in a table: a state, a mode, or a number with its unit."""
        choice = self.choice(row, raw)
        if choice:
            return choice
        if isinstance(raw, bool):
            return "true" if raw else "false"
        if isinstance(raw, str):
            return raw
        remark = (self.remark(row, raw) if self.remark else "") or self._limits_remark(row, raw, table)
        text = f"{decimal_text(Decimal(repr(raw)))} {loop_unit(row.unit, units)}".rstrip()
        return f"{text} ({remark})" if remark else text

    def _limits_remark(self, row: Parameter, raw: float, table: str) -> str:
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

    @staticmethod
    def block_types(settings: Sequence[Mapping[str, object]]) -> dict[str, str]:
        """The types of a listing's blocks and loops by their names; of two with one name, the first one's."""
        types = ((s.get("loop", s.get("block")), s.get("type")) for s in reversed(settings))
        return {str(name): kind for name, kind in types if isinstance(kind, str)}

    def row_of(self, name: str, types: Mapping[str, str]) -> tuple[str, str, Parameter] | None:
        """The loop, the table and the row of a listing's name; ``types``: what `block_types` says of the listing."""
        loop, kind, parameter = self.split_name(name, types)
        table = self.tables.get(kind) if kind is not None else None
        row = next((row for row in table.rows if row.name == parameter), None) if table else None
        return None if row is None or kind is None else (loop, kind, row)

    def lines(self, listing: Listing, options: Mapping[str, object]) -> Iterator[Line]:
        """Every parameter of a listing with its meaning."""
        del options
        units = {str(settings.get("loop")): units_of(settings) for settings in listing.settings}
        types = self.block_types(listing.settings)
        for name, raw in listing.words.items():
            content = f":= {raw.text}" if isinstance(raw, Wire) else str(raw)
            entry = self.row_of(name, types)
            if entry is None:
                text = "a signal of the program" if "." not in name else "belongs to no loop"
                yield Line(name, "", content, "", "", text)
                continue
            loop, kind, row = entry
            title = title_of(row, self.parameter_text(kind, row))
            if isinstance(raw, Wire):
                text = f"{title}; wired"
            elif read_content(row.type, raw) is None:
                text = f"{title}: no value of {row.type.name}"
            else:
                content = content_text(row.type, raw)
                text = self.choice(row, raw) or f"{title}: {self.content_meaning(row, raw, units.get(loop, {}), kind)}"
            yield Line(name, "", content, "", row.type.name, text)


def group_members(group: BitGroup, table: ParameterTable) -> tuple[Parameter, ...]:
    """The bits of a structure in a table."""
    return tuple(row for row in table.rows if row.name.startswith(f"{group.name}.") and group.members(row))


def title_of(row: Parameter, text: str) -> str:
    """What a parameter is, in short; of one that tells first what TRUE is, only that it is a switch."""
    return "a switch" if row.type.kind == "bool" and text.startswith(("TRUE", "FALSE")) else first_sentence(text)


def loop_unit(unit: str, units: Mapping[str, str]) -> str:
    """A unit in the loop's own units; none where it depends on something else."""
    text = unit_text(unit, units, "/")
    return "" if "," in unit or text in SIDES else text


# ----------------------------------------------------------------------------------------------------------------------
# Finds what a question is about with a vendor whose parameters have names: by name, device, structure or block.

DEVICE_PATTERN = re.compile(r"([A-Z]+)([0-9]{1,6})")
DOUBLE_WORD = re.compile(r"D([0-9]{1,6})")
"""The device of a parameter that takes two registers: it and the one behind it."""


@dataclass(frozen=True, kw_only=True)
class ParameterBook(Parameters):
    """The tables of a vendor whose parameters have names, and how these are asked for."""

    def find(self, question: Question) -> list[Page]:
        """What the question is about with this vendor; empty when it is nothing."""
        file_pages = [*self._configured_pages(question, question.config)] if question.config else []
        if file_pages:
            return file_pages
        tables, name = self._split_block(question.name)
        pages = (
            self._word_pages(name)
            or self._group_pages(tables, name, question)
            or self._named_pages(tables, name, question)
        )
        return pages or self._block_pages(question)

    def _block_pages(self, question: Question) -> list[Page]:
        """``PIDA_REAL``: the parameters of a block."""
        key = next((key for key in self.tables if key.lower() == question.name.lower()), None)
        return [] if key is None or question.value is not None else [self.page(self.block_record(key))]

    def _split_block(self, name: str) -> tuple[Mapping[str, ParameterTable], str]:
        """The tables that are meant, and the name without its block's."""
        for key, table in self.tables.items():
            if name.lower().startswith(f"{key.lower()}."):
                return {key: table}, name[len(key) + 1 :]
        return self.tables, name

    def _record_page(
        self,
        record: ParameterRecord,
        question: Question,
        raw: Content | Wire | None = None,
        units: Mapping[str, str] | None = None,
    ) -> Page:
        """A parameter with the content that the question gives, or else with that of the file."""
        row = record.row
        content = raw if question.value is None else content_of(row, question.value)
        code = self.code(row.name, content)
        points = () if code else tuple(part.point(None) for part in record.parts)
        value = None if content is None else self.value(row, content, units or {}, record.table)
        return self.page(record, value, points, code)

    def _configured_pages(self, question: Question, config: ConfigIndex) -> Iterator[Page]:
        """A parameter by its full name, its device, or its own name in each loop of the configuration."""
        types = self.block_types(config.settings)
        pages = [page for entry in config.entries for page in self._entry_pages(entry, question, config, types)]
        return iter(pages) if pages else self._device_pages(question, config)

    def _entry_pages(
        self, entry: Entry, question: Question, config: ConfigIndex, types: Mapping[str, str]
    ) -> Iterator[Page]:
        """One parameter of the configuration, if the question is about it or a later register of its device."""
        yield from self._later_word_pages(question, entry)
        names = {entry.address.lower(), (entry.device or "").lower(), entry.field.lower()}
        row = self.row_of(entry.address, types) if question.name.lower() in names else None
        if row is not None:
            page = self._record_page(self.record([row[1]], row[2]), question, entry.raw, config.units(entry.loop))
            yield config.with_origin(replace(page, name=entry.address), entry)

    def _device_pages(self, question: Question, config: ConfigIndex) -> Iterator[Page]:
        """An operand that the configuration gives no content, by a register of its device or by its name."""
        for i, settings in enumerate(config.settings):
            loop = str(settings.get("loop"))
            for operand, device in (settings.get("devices") or {}).items():
                register = _register_index(device, question.name.upper())
                if f"{loop}.{operand}".lower() == question.name.lower():
                    register = 0
                if register is None:
                    continue
                key, row = next((key, row) for key, t in self.tables.items() for row in t.rows if row.name == operand)
                content = replace(question, value=None) if register else question
                origin = config.origin(("loops", i, "devices", operand), loop)
                second_text = f"; {question.name.upper()} is its second register" if register else ""
                yield replace(
                    self._record_page(self.record([key], row), content, None, config.units(loop)),
                    name=f"{loop}.{operand}",
                    loop=loop,
                    place=f"{device} of {loop}{second_text}",
                    origins=(origin,) if origin else (),
                )

    def _later_word_pages(self, question: Question, entry: Entry) -> Iterator[Page]:
        """A later register of a parameter that takes several words."""
        if self.words is None or entry.field != self.words.name or entry.device is None:
            return
        first, register = (DEVICE_PATTERN.fullmatch(text.upper()) for text in (entry.device, question.name))
        if first is None or register is None or first.group(1) != register.group(1):
            return
        number = (int(register.group(2)) - int(first.group(2))) // 2
        if 0 < number <= self.words.last_number:
            page = self.page(self.words.record(number))
            yield replace(page, name=question.name.upper(), loop=entry.loop, place=f"{page.name} of {entry.loop}")

    def _word_pages(self, name: str) -> list[Page]:
        """``I_MV+6``."""
        head, plus, digits = name.replace(" ", "").partition("+")
        if self.words is None or not plus or head.upper() != self.words.name or not digits.isdecimal():
            return []
        if int(digits[:6]) > self.words.last_number:
            last_number = self.words.last_number
            raise QuestionError(f"{name}: {self.words.name} takes {last_number + 1} double words, +0 to +{last_number}")
        return [self.page(self.words.record(int(digits)))]

    def _group_pages(self, tables: Mapping[str, ParameterTable], name: str, question: Question) -> list[Page]:
        """``ErrBits`` and ``ErrBits=0x0005``, for each kind of block whose bits differ."""
        group = next((group for group in self.groups if group.name.lower() == name.lower()), None)
        if group is None:
            return []
        blocks: dict[tuple[str, ...], list[str]] = {}
        for key, table in tables.items():
            rows = group_members(group, table)
            if rows:
                blocks.setdefault(tuple(row.name for row in rows), []).append(key)
        bit_count = max(map(len, blocks), default=0)
        raw = None if question.value is None else parse_integer(question.value, (1 << bit_count) - 1)
        if blocks and question.value is not None and raw is None:
            raise QuestionError(f"{question.text}: the value is a whole number of {bit_count} bits, like 5 or 0x0005")
        return [
            self._group_page(group, keys, raw) for names, keys in blocks.items() if raw is None or raw < 1 << len(names)
        ]

    def _group_page(self, group: BitGroup, keys: list[str], raw: int | None) -> Page:
        record = self.group_record(group, group_members(group, self.tables[keys[0]]), keys)
        value = None if raw is None else Value(raw, f"0x{raw:04X}", "no bit is on" if raw == 0 else "")
        page = self.page(record, value, tuple(part.point(raw) for part in record.parts))
        return page if raw is None else replace(page, reference=f"{page.reference}; {self.bit_count_basis}")

    def _named_pages(self, tables: Mapping[str, ParameterTable], name: str, question: Question) -> list[Page]:
        """A parameter, once for each meaning that it has in different blocks."""
        name_lower = name.lower()
        rows = [(key, row) for key, table in tables.items() for row in table.rows]
        matches = [(key, row) for key, row in rows if row.name.lower() == name_lower]
        matches = matches or [(key, row) for key, row in rows if row.name.lower().rpartition(".")[2] == name_lower]
        groups: dict[tuple[Parameter, str, Meaning | None], list[tuple[str, Parameter]]] = {}
        for key, row in matches:
            meaning = row._replace(basis=None), self.parameter_text(key, row), self.bit_meaning([key], row)
            groups.setdefault(meaning, []).append((key, row))
        pages = []
        for group in groups.values():
            keys, row = [key for key, _ in group], group[0][1]
            page = self._record_page(self.record(keys, row), question)
            blocks = f" [{', '.join(keys)}]" if len(self.tables) > 1 else ""
            pages.append(replace(page, title=f"{page.title}{blocks}"))
        return pages


def _register_index(device: str, name: str) -> int | None:
    """Which register of a device a name is: 0, or 1 for the second of a word; None for neither."""
    first, match = DOUBLE_WORD.fullmatch(device), DOUBLE_WORD.fullmatch(name)
    if first is None or match is None:
        return 0 if device == name else None
    register = int(match.group(1)) - int(first.group(1))
    return register if register in {0, 1} else None
