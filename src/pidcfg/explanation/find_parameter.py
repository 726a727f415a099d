"""Explanations of vendors whose parameters have names and types: parameters, structures of bits, numbers, states."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.parameters import read, shown
from pidcfg.explanation.contents import NUMBER
from pidcfg.explanation.devices import device_pages
from pidcfg.explanation.page import Page, Point, Value
from pidcfg.explanation.parameter_texts import (
    TRUTHS,
    WRITERS,
    Placed,
    contents_of,
    no_remark,
    no_units,
    title_of,
    unit_in,
)
from pidcfg.explanation.question import Asked, Thing, ThingError, whole
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.encoders.meanings import Code, Meaning
    from pidcfg.encoders.parameters import Content, Entry, Parameter, ParameterTable
    from pidcfg.explanation.direction import Direction

DEVICE = re.compile(r"([A-Z]+)([0-9]{1,6})")


class Group(NamedTuple):
    """A structure of bits: its name, and those of its members that a number counts, in their order."""

    name: str
    meaning: Meaning
    members: Callable[[Parameter], bool]


@dataclass(frozen=True)
class NamedBook:
    """Everything that can be said about a vendor's parameters; the tables say it."""

    key: str
    title: str
    tables: Mapping[str, ParameterTable]
    """By the name that stands before a parameter's."""
    text: Callable[[str, str], str]
    """What a parameter of a table is, from the schema."""
    forms: tuple[tuple[str, str], ...]
    split: Callable[[str, Sequence[Mapping[str, Any]]], tuple[str, str | None, str]]
    """A listing's name to loop, table and parameter."""
    direction: Direction
    """The words for the direction of control."""
    groups: tuple[Group, ...] = ()
    counted: str = ""
    """What the numbers of a structure's bits rest on."""
    bits: Mapping[str, Meaning] | None = None
    codes: Sequence[Code] = ()
    states: Mapping[tuple[str, bool], str] | None = None
    parts: tuple[str, Sequence[tuple[int, int, str, str]], str] | None = None
    """A parameter that takes several words: its name, and what each of them holds; the manual's place."""
    own_bits: Mapping[tuple[str, str], Meaning] | None = None
    """Meanings of bits that differ in one table."""
    remark: Callable[[Parameter, Content], str] = no_remark
    """What is special about a content."""
    writers: Mapping[str, str] | None = None
    """Who writes a parameter, where it is not just an input or an output."""
    settings: Callable[[Any], Mapping[str, str]] = no_units

    def find(self, thing: Thing, asked: Asked) -> list[Page]:
        """What a thing is with this vendor; empty when it is nothing."""
        placed = self._placed(thing, asked)
        if placed:
            return placed
        tables, name = self._tables(thing.name)
        found = self._part(name) or self._group(tables, name, thing) or self._rows(tables, name, thing)
        return found or self._block(thing)

    def _block(self, thing: Thing) -> list[Page]:
        """``PIDA_REAL``: the parameters of a block."""
        key = next((key for key in self.tables if key.lower() == thing.name.lower()), None)
        if key is None or thing.value is not None:
            return []
        rows = self.tables[key].rows
        return [
            Page(
                "structure",
                key,
                f"a block of {len(rows)} parameters",
                self.key,
                self.title,
                holds=", ".join(row.name for row in rows),
                reference=str(rows[0].basis or ""),
            )
        ]

    def annotate(self, listing: Any, options: Mapping[str, Any]) -> str:
        """A listing with a meaning beside every parameter."""
        from pidcfg.explanation.annotate import NAMED_HEADS, as_text
        from pidcfg.explanation.parameter_listing import named_lines

        del options
        return as_text([*named_lines(self, listing.words, listing.settings)], NAMED_HEADS)

    @cached_property
    def names(self) -> dict[str, list[str]]:
        """Everything that has a name, in small letters, for did-you-mean."""
        found = [row.name for table in self.tables.values() for row in table.rows]
        return {name.lower(): [name] for name in (*found, *(g.name for g in self.groups), *self.tables)}

    def _tables(self, name: str) -> tuple[dict[str, ParameterTable], str]:
        """The tables that are meant, and the name without its block's."""
        for key, table in self.tables.items():
            if name.lower().startswith(f"{key.lower()}."):
                return {key: table}, name[len(key) + 1 :]
        return dict(self.tables), name

    def _placed(self, thing: Thing, asked: Asked) -> list[Page]:
        """A parameter by its full name, its device, or its own name in each loop of the configuration."""
        if asked.config is None:
            return []
        pages = []
        for entry in asked.config.entries:
            pages += self._device(thing, entry)
            names = {entry.address.lower(), (entry.device or "").lower(), entry.field.lower()}
            if thing.name.lower() not in names:
                continue
            table = self._table_of(entry, asked)
            row = next((r for r in table.rows if r.name == entry.field), None) if table else None
            if table is None or row is None:
                continue
            units = asked.config.units(entry.loop)
            page = self.page(row, (table.title,), thing.value, Placed(table, row, entry, units))
            pages.append(asked.config.with_origin(page, entry))
        return pages or [*device_pages(self, thing, asked)]

    def _device(self, thing: Thing, entry: Entry) -> list[Page]:
        """A later register of a parameter that takes several words."""
        if self.parts is None or entry.field != self.parts[0] or entry.device is None:
            return []
        first, asked = (DEVICE.fullmatch(text.upper()) for text in (entry.device, thing.name))
        if first is None or asked is None or first.group(1) != asked.group(1):
            return []
        word = (int(asked.group(2)) - int(first.group(2))) // 2
        if not 0 < word <= self.parts[1][-1][1]:
            return []
        return [
            replace(page, name=thing.name.upper(), loop=entry.loop, place=f"{page.name} of {entry.loop}")
            for page in self._part(f"{self.parts[0]}+{word}")
        ]

    def _table_of(self, entry: Entry, asked: Asked) -> ParameterTable | None:
        settings = asked.config.settings if asked.config is not None else ()
        kind = self.split(entry.address, settings)[1]
        return self.tables.get(kind) if kind is not None else None

    def _part(self, name: str) -> list[Page]:
        """``I_MV+6``."""
        head, plus, digits = name.replace(" ", "").partition("+")
        if self.parts is None or not plus or head.upper() != self.parts[0] or not digits.isdecimal():
            return []
        found = next((p for p in self.parts[1] if p[0] <= int(digits[:6]) <= p[1]), None)
        if found is None:
            last = self.parts[1][-1][1]
            raise ThingError(f"{name}: {self.parts[0]} takes {last + 1} double words, +0 to +{last}")
        return [
            Page(
                "register",
                f"{self.parts[0]}+{int(digits)}",
                found[2],
                self.key,
                self.title,
                holds=found[3],
                notation="a double word (two registers)",
                reference=self.parts[2],
            )
        ]

    def _group(self, tables: Mapping[str, ParameterTable], name: str, thing: Thing) -> list[Page]:
        """``ErrBits`` and ``ErrBits=0x0005``, for each kind of block whose bits differ."""
        group = next((g for g in self.groups if g.name.lower() == name.lower()), None)
        if group is None:
            return []
        by_members: dict[tuple[str, ...], tuple[tuple[Parameter, ...], list[str]]] = {}
        for key, table in tables.items():
            rows = tuple(r for r in table.rows if r.name.startswith(f"{group.name}.") and group.members(r))
            if rows:
                by_members.setdefault(tuple(r.name for r in rows), (rows, []))[1].append(key)
        most = max(len(rows) for rows, _ in by_members.values())
        raw = None if thing.value is None else whole(thing.value, (1 << most) - 1)
        if thing.value is not None and raw is None:
            raise ThingError(f"{thing.text}: the value is a whole number of {most} bits, like 5 or 0x0005")
        return [
            self._group_page(group, rows, blocks, raw)
            for rows, blocks in by_members.values()
            if raw is None or raw < 1 << len(rows)
        ]

    def _group_page(self, group: Group, rows: tuple[Parameter, ...], blocks: list[str], raw: int | None) -> Page:
        points = tuple(
            Point(
                f"bit {i}",
                f"{row.name.partition('.')[2]}: {row.title}",
                "" if raw is None else "on" if raw >> i & 1 else "off",
                bool(raw and raw >> i & 1),
                self._bit(blocks, row) if raw is None or raw >> i & 1 else None,
            )
            for i, row in enumerate(rows)
        )
        value = None if raw is None else Value(raw, f"0x{raw:04X}", "no bit is on" if raw == 0 else "")
        basis = f"{group.meaning.basis}; {self.counted}" if raw is not None else str(group.meaning.basis)
        return Page(
            "structure",
            group.name,
            f"{len(rows)} bits of {', '.join(blocks)}",
            self.key,
            self.title,
            value,
            group.meaning,
            points,
            notation="a structure of bits, counted in the order of its members",
            access="status",
            by="the block: outputs, only to be read",
            reference=basis,
        )

    def _rows(self, tables: Mapping[str, ParameterTable], name: str, thing: Thing) -> list[Page]:
        """A parameter, once for each meaning that it has in different blocks."""
        wanted = name.lower()
        exact = {key: [r for r in table.rows if r.name.lower() == wanted] for key, table in tables.items()}
        if not any(exact.values()):
            exact = {
                key: [r for r in t.rows if r.name.lower().rpartition(".")[2] == wanted] for key, t in tables.items()
            }
        found: dict[tuple[Parameter, str, Meaning | None], list[str]] = {}
        for key, rows in exact.items():
            for row in rows:
                same = row._replace(basis=None), self.meaning(key, row), self._bit([key], row)
                found.setdefault(same, []).append(key)
        originals = {(r.name, key): r for key, rows in exact.items() for r in rows}
        return [
            self.page(originals[row.name, keys[0]], tuple(keys), thing.value, None) for (row, *_), keys in found.items()
        ]

    def _bit(self, blocks: Sequence[str], row: Parameter) -> Meaning | None:
        """What a bit means, in blocks that do not differ."""
        own = next(
            (m for (key, name), m in (self.own_bits or {}).items() if [key] == [*blocks] and name == row.name), None
        )
        return own or (self.bits or {}).get(row.name)

    def meaning(self, key: str, row: Parameter) -> str:
        """What a parameter is."""
        return row.title or self.text(key, row.name)

    def page(self, row: Parameter, blocks: tuple[str, ...], value: str | None, placed: Placed | None) -> Page:
        """One parameter, with its content where there is one."""
        key = next((k for k in self.tables if k in blocks or self.tables[k].title in blocks), blocks[0])
        raw: Content | Wire | None = self._content(row, value) if value is not None else None
        if raw is None and placed is not None and placed.entry is not None:
            raw = placed.entry.raw
        meaning = self._bit([key] if placed is not None else blocks, row)
        code = next(
            (c for c in self.codes if c.register == row.name and c.number == raw and not isinstance(raw, bool)), None
        )
        text = self.meaning(key, row)
        named = placed.entry.address if placed is not None and placed.entry is not None else row.name
        where = "" if placed is not None else f"{', '.join(blocks)}"
        return Page(
            kind="parameter",
            name=named,
            title=title_of(row, text) + (f" [{where}]" if where and len(self.tables) > 1 else ""),
            vendor=self.key,
            vendor_title=self.title,
            value=None if raw is None else self._value(row, raw, placed.units if placed else {}),
            meaning=code.meaning if code else meaning,
            points=() if code else tuple(self._choices(row)),
            holds=text if title_of(row, text) != text else "",
            unit=row.unit,
            notation=row.type.name + (f": {', '.join(row.type.words)}" if row.type.words else ""),
            access="setting" if row.access == "input" else "status",
            by=(self.writers or {}).get(row.name) or WRITERS[row.access],
            key=row.name if row.access == "input" else None,
            reference=str((code.meaning.basis if code else meaning.basis if meaning else None) or row.basis or ""),
        )

    def _choices(self, row: Parameter) -> Iterator[Point]:
        """What the states of a switch, or the numbers of a mode, mean."""
        for (name, state), text in (self.states or {}).items():
            if name == row.name:
                yield Point(shown(row.type, state), text, "", active=False)
        for code in self.codes:
            if code.register == row.name:
                yield Point(str(code.number), code.title, "", active=False, meaning=code.meaning)

    def _content(self, row: Parameter, text: str) -> Content:
        content: object = None
        if row.type.kind == "bool":
            content = TRUTHS.get(text.lower())
        elif row.type.kind == "word":
            content = next(
                (w for w in row.type.words if text.upper() in {w.upper(), w.upper().rpartition("_")[2]}), None
            )
        elif row.type.kind == "whole":
            content = int(text) if text.lstrip("+-").isdecimal() and len(text) < 12 else whole(text, row.type.high)
        elif NUMBER.fullmatch(text):
            content = float(text)
        found = read(row.type, content)
        if found is None:
            raise ThingError(f"{row.name}={text}: the value is not one of {contents_of(row.type)}")
        return found

    def _value(self, row: Parameter, raw: Content | Wire, units: Mapping[str, str]) -> Value:
        if isinstance(raw, Wire):
            return Value(raw.text, f":= {raw.text}", "wired: it follows this expression")
        return Value(raw, shown(row.type, raw), self.saying(row, raw, units))

    def saying(self, row: Parameter, raw: Content, units: Mapping[str, str]) -> str:
        """What a content says: a state, a mode, or a number with its unit."""
        if isinstance(raw, bool):
            return (self.states or {}).get((row.name, raw), "true" if raw else "false")
        code = next((c for c in self.codes if c.register == row.name and c.number == raw), None)
        if code is not None:
            return code.title
        if isinstance(raw, str):
            return raw
        remark = self.remark(row, raw)
        text = f"{decimal_text(Decimal(repr(raw)))} {unit_in(row.unit, units)}".rstrip()
        return f"{text} ({remark})" if remark else text
