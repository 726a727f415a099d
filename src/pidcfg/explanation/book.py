"""A vendor's tables as records of one form: what is known of a register, a bit, a number, a parameter or a key.

A record knows no content and no loop; `Book.page` puts it before the reader, and the finders add what they know.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple

from pidcfg.encoders.words import DecodeError
from pidcfg.explanation.annotate import as_text
from pidcfg.explanation.page import Page, Point
from pidcfg.explanation.texts import key_text
from pidcfg.explanation.values import choice_text, choices_text, label
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.meanings import Code, Meaning
    from pidcfg.encoders.regmap import Bits
    from pidcfg.explanation.annotate import Line
    from pidcfg.explanation.page import Value
    from pidcfg.explanation.question import Question
    from pidcfg.refs import Basis

WRITERS = {
    "setting": "you: it is a setting, which the PLC reads",
    "request": "you or the program, for a moment: it is a request to the PLC",
    "status": "the PLC: it is a status, only to be read",
    "reserved": "nobody: it is reserved, leave it 0",
    "input": "you or the program: it is an input",
    "output": "the PLC: it is an output, only to be read",
}
"""Who writes a register, by its access, or a parameter, by its direction."""


@dataclass(frozen=True, slots=True)
class Direction:
    """A vendor's key for the direction of control, whose action its words name, and how each word is set."""

    key: str
    whose: str
    words: Mapping[str, str]
    """Each word as `pidcfg.encoders.tuned.Tuned` has it, which says whether that is heating."""


class Series(NamedTuple):
    """Numbers of one kind: how they are called, what other numbers mean, and how they are asked for (``CK27``)."""

    name: str
    codes: Sequence[Code]
    other: str = ""
    heads: tuple[str, ...] = ()


class Part(NamedTuple):
    """A choice of bits of a record, or a state or number that it can have."""

    label: str
    title: str
    meaning: Meaning | None = None
    bits: Bits | None = None

    @classmethod
    def of(cls, bits: Bits, meaning: Meaning | None) -> Part:
        """A row of bits with its meaning."""
        return cls(label(bits), bits.title, meaning, bits)

    def point(self, raw: int | None) -> Point:
        """The part as a content has it on or off; what it can be where there is no content."""
        row = self.bits
        key = row.path if row else None
        if row is None or raw is None:
            choices = choices_text(row) if row else ""
            return Point(self.label, f"{self.title}{choices}", "", active=False, meaning=self.meaning, key=key)
        try:
            state, active = choice_text(row, raw)
        except DecodeError:
            nothing = f"0x{raw & row.mask:04X} means nothing here"
            return Point(self.label, self.title, nothing, active=True, meaning=None, key=key)
        return Point(self.label, self.title, state, active, self.meaning if active else None, key)


@dataclass(frozen=True, kw_only=True)
class Record:
    """What the tables say of one thing before it has a content."""

    kind: Literal["register", "bit", "number", "structure", "parameter"]
    name: str
    title: str
    detail: str = ""
    """More than the title says."""
    schema: type[BaseModel] | None = None
    """The model that has the key, whose text is the detail where there is no other."""
    key: str | None = None
    """Where its value stands in a configuration."""
    unit: str = ""
    notation: str = ""
    access: str = ""
    by: str = ""
    """Who writes it."""
    basis: Basis | str | None = None
    meaning: Meaning | None = None
    parts: tuple[Part, ...] = ()

    @property
    def holds(self) -> str:
        """What it holds; the text of the schema is read only now."""
        return self.detail or (key_text(self.schema, self.key) if self.schema and self.key else "")


@dataclass(frozen=True, kw_only=True)
class Book(ABC):
    """Everything that can be said about a vendor's registers or parameters; the tables say it."""

    key: str
    forms: tuple[tuple[str, str], ...]
    """What can be asked for, and an example of each."""
    direction: Direction
    series: tuple[Series, ...] = ()
    writers: Mapping[str, str] = field(default_factory=dict)
    """Who writes a register or parameter that is not just a setting or a status, by its name."""
    heads: ClassVar[Sequence[str]]
    """Heads of the columns of a listing."""

    @property
    def title(self) -> str:
        """The vendor's title."""
        return VENDORS[self.key].title

    @property
    @abstractmethod
    def spellings(self) -> Mapping[str, str]:
        """All names that can be asked for, in small letters, with their spelling."""

    @abstractmethod
    def find(self, question: Question) -> list[Page]:
        """What the question is about with this vendor; empty when it is nothing."""

    @abstractmethod
    def lines(self, listing: Listing, options: Mapping[str, object]) -> Iterable[Line]:
        """Every word or parameter of a listing with its meaning."""

    def annotate(self, listing: Listing, options: Mapping[str, object]) -> str:
        """A listing with a meaning beside everything in it."""
        return as_text([*self.lines(listing, options)], self.heads)

    def codes(self, name: str) -> Iterator[Code]:
        """The numbers that a register or parameter shows."""
        return (code for series in self.series for code in series.codes if code.register == name)

    def code(self, name: str, content: object) -> Code | None:
        """What a number means that a register or parameter shows."""
        return next((code for code in self.codes(name) if code.number == content), None)

    def page(
        self, record: Record, value: Value | None = None, points: tuple[Point, ...] = (), code: Code | None = None
    ) -> Page:
        """A record before the reader: its content, its bits with that content, and the number that the content is."""
        meaning = code.meaning if code else record.meaning
        stated = points[0].meaning if record.kind == "bit" and points else meaning
        return Page(
            kind=record.kind,
            name=record.name,
            title=record.title,
            vendor=self.key,
            vendor_title=self.title,
            value=value,
            meaning=meaning,
            points=points,
            holds=record.holds,
            unit=record.unit,
            notation=record.notation,
            access=record.access,
            by=record.by,
            key=record.key,
            reference=str((stated.basis if stated else None) or record.basis or ""),
        )
