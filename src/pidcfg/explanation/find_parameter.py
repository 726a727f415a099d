"""Finds what a question is about with a vendor whose parameters have names: by name, device, structure or block."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pidcfg.explanation.contents import content_of, whole
from pidcfg.explanation.page import Page, Value
from pidcfg.explanation.parameters import ParameterRecord, Parameters, members
from pidcfg.explanation.question import Question, QuestionError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.meanings import Meaning
    from pidcfg.encoders.parameters import Content, Entry, Parameter, ParameterTable
    from pidcfg.explanation.configuration import Configured
    from pidcfg.explanation.parameters import Group
    from pidcfg.schemas.iec import Wire

DEVICE = re.compile(r"([A-Z]+)([0-9]{1,6})")
DOUBLE_WORD = re.compile(r"D([0-9]{1,6})")
"""The device of a parameter that takes two registers: it and the one behind it."""


@dataclass(frozen=True, kw_only=True)
class ParameterBook(Parameters):
    """The tables of a vendor whose parameters have names, and how these are asked for."""

    def find(self, question: Question) -> list[Page]:
        """What the question is about with this vendor; empty when it is nothing."""
        in_file = [*self._in_file(question, question.config)] if question.config else []
        if in_file:
            return in_file
        tables, name = self._tables(question.name)
        pages = self._word(name) or self._group(tables, name, question) or self._named(tables, name, question)
        return pages or self._block(question)

    def _block(self, question: Question) -> list[Page]:
        """``PIDA_REAL``: the parameters of a block."""
        key = next((key for key in self.tables if key.lower() == question.name.lower()), None)
        return [] if key is None or question.value is not None else [self.page(self.block(key))]

    def _tables(self, name: str) -> tuple[Mapping[str, ParameterTable], str]:
        """The tables that are meant, and the name without its block's."""
        for key, table in self.tables.items():
            if name.lower().startswith(f"{key.lower()}."):
                return {key: table}, name[len(key) + 1 :]
        return self.tables, name

    def _page(
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

    def _in_file(self, question: Question, config: Configured) -> Iterator[Page]:
        """A parameter by its full name, its device, or its own name in each loop of the configuration."""
        pages = [page for entry in config.entries for page in self._entry(entry, question, config)]
        return iter(pages) if pages else self._devices(question, config)

    def _entry(self, entry: Entry, question: Question, config: Configured) -> Iterator[Page]:
        """One parameter of the configuration, if the question is about it or a later register of its device."""
        yield from self._word_at(question, entry)
        row = self.row_of(entry.address, config.settings)
        names = {entry.address.lower(), (entry.device or "").lower(), entry.field.lower()}
        if question.name.lower() in names and row is not None:
            page = self._page(self.record([row[1]], row[2]), question, entry.raw, config.units(entry.loop))
            yield config.with_origin(replace(page, name=entry.address), entry)

    def _devices(self, question: Question, config: Configured) -> Iterator[Page]:
        """An operand that the configuration gives no content, by a register of its device or by its name."""
        for i, settings in enumerate(config.settings):
            loop = str(settings.get("loop"))
            for operand, device in (settings.get("devices") or {}).items():
                register = _register(device, question.name.upper())
                if f"{loop}.{operand}".lower() == question.name.lower():
                    register = 0
                if register is None:
                    continue
                key, row = next((key, row) for key, t in self.tables.items() for row in t.rows if row.name == operand)
                content = replace(question, value=None) if register else question
                origin = config.origin(("loops", i, "devices", operand), loop)
                second = f"; {question.name.upper()} is its second register" if register else ""
                yield replace(
                    self._page(self.record([key], row), content, None, config.units(loop)),
                    name=f"{loop}.{operand}",
                    loop=loop,
                    place=f"{device} of {loop}{second}",
                    origins=(origin,) if origin else (),
                )

    def _word_at(self, question: Question, entry: Entry) -> Iterator[Page]:
        """A later register of a parameter that takes several words."""
        if self.words is None or entry.field != self.words.name or entry.device is None:
            return
        first, register = (DEVICE.fullmatch(text.upper()) for text in (entry.device, question.name))
        if first is None or register is None or first.group(1) != register.group(1):
            return
        number = (int(register.group(2)) - int(first.group(2))) // 2
        if 0 < number <= self.words.last:
            page = self.page(self.words.record(number))
            yield replace(page, name=question.name.upper(), loop=entry.loop, place=f"{page.name} of {entry.loop}")

    def _word(self, name: str) -> list[Page]:
        """``I_MV+6``."""
        head, plus, digits = name.replace(" ", "").partition("+")
        if self.words is None or not plus or head.upper() != self.words.name or not digits.isdecimal():
            return []
        if int(digits[:6]) > self.words.last:
            last = self.words.last
            raise QuestionError(f"{name}: {self.words.name} takes {last + 1} double words, +0 to +{last}")
        return [self.page(self.words.record(int(digits)))]

    def _group(self, tables: Mapping[str, ParameterTable], name: str, question: Question) -> list[Page]:
        """``ErrBits`` and ``ErrBits=0x0005``, for each kind of block whose bits differ."""
        group = next((group for group in self.groups if group.name.lower() == name.lower()), None)
        if group is None:
            return []
        blocks: dict[tuple[str, ...], list[str]] = {}
        for key, table in tables.items():
            rows = members(group, table)
            if rows:
                blocks.setdefault(tuple(row.name for row in rows), []).append(key)
        most = max(map(len, blocks))
        raw = None if question.value is None else whole(question.value, (1 << most) - 1)
        if question.value is not None and raw is None:
            raise QuestionError(f"{question.text}: the value is a whole number of {most} bits, like 5 or 0x0005")
        return [
            self._group_page(group, keys, raw) for names, keys in blocks.items() if raw is None or raw < 1 << len(names)
        ]

    def _group_page(self, group: Group, keys: list[str], raw: int | None) -> Page:
        record = self.group(group, members(group, self.tables[keys[0]]), keys)
        value = None if raw is None else Value(raw, f"0x{raw:04X}", "no bit is on" if raw == 0 else "")
        page = self.page(record, value, tuple(part.point(raw) for part in record.parts))
        return page if raw is None else replace(page, reference=f"{page.reference}; {self.counted}")

    def _named(self, tables: Mapping[str, ParameterTable], name: str, question: Question) -> list[Page]:
        """A parameter, once for each meaning that it has in different blocks."""
        wanted = name.lower()
        rows = [(key, row) for key, table in tables.items() for row in table.rows]
        matches = [(key, row) for key, row in rows if row.name.lower() == wanted]
        matches = matches or [(key, row) for key, row in rows if row.name.lower().rpartition(".")[2] == wanted]
        same: dict[tuple[Parameter, str, Meaning | None], list[tuple[str, Parameter]]] = {}
        for key, row in matches:
            what = row._replace(basis=None), self.text(key, row), self.bit_meaning([key], row)
            same.setdefault(what, []).append((key, row))
        pages = []
        for group in same.values():
            keys, row = [key for key, _ in group], group[0][1]
            page = self._page(self.record(keys, row), question)
            blocks = f" [{', '.join(keys)}]" if len(self.tables) > 1 else ""
            pages.append(replace(page, title=f"{page.title}{blocks}"))
        return pages


def _register(device: str, name: str) -> int | None:
    """Which register of a device a name is: 0, or 1 for the second of a word; None for neither."""
    first, match = DOUBLE_WORD.fullmatch(device), DOUBLE_WORD.fullmatch(name)
    if first is None or match is None:
        return 0 if device == name else None
    register = int(match.group(1)) - int(first.group(1))
    return register if register in {0, 1} else None
