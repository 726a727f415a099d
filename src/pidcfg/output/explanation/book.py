"""A vendor's tables as records of one form, and listings with a meaning beside every word."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from textwrap import wrap
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple

from pidcfg.encoders.codecs import DecodeError
from pidcfg.output.explanation import Page, Point
from pidcfg.output.explanation.page import Placement, bits_label, choice_text, choices_text, key_text
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import pad_left, pad_right, to_printable, width_of
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.regmap import Bits, Code, Meaning, RegisterMap, Space
    from pidcfg.output.explanation import Value
    from pidcfg.output.explanation.page import Question, Scaling
    from pidcfg.text.references import Basis

# --- A memory listing with a meaning beside every word: where its loops lie, and the lines in columns -----------------

LINE_WIDTH = 120
MIN_MEANING_WIDTH = 40
"""Columns that a meaning has at least."""
RIGHT_ALIGNED = frozenset({"hex", "value"})
"""Columns of numbers."""


class Start(NamedTuple):
    """An option that says where the loops of a listing begin: the bank of their registers, and an example."""

    option: str
    prefix: str
    example: str
    address: int | None = None
    """The address that says it too."""


class Line(NamedTuple):
    """A word of a listing with its meaning."""

    address: str
    hex: str
    value: str
    loop: str
    register: str
    meaning: str


def block_claims(
    blocks: Mapping[str, tuple[str, RegisterMap]],
    space: Space,
    name_format: str,
    scaling_of: Callable[[Mapping[str, object], Mapping[str, int], Mapping[int, int]], Scaling],
    listing: Listing,
    options: Mapping[str, Any],
) -> Iterator[tuple[int, Placement]]:
    """The registers of each loop's blocks that begin where an option says, or what stands beside the listing.

    ``scaling_of``: of what the listing says of a loop, of the starts of the loop's blocks, and of all words.
    """
    count = len(listing.settings) or max((len(options.get(key) or ()) for key in blocks), default=0)
    for i in range(count):
        settings = listing.settings[i] if listing.settings else {}
        loop = str(settings.get("loop", name_format.format(i + 1)))
        starts = {}
        for key in blocks:
            addresses = list(options.get(key) or ())
            text = (
                addresses[0]
                if len(addresses) == 1 and count > 1
                else addresses[i]
                if i < len(addresses)
                else settings.get(key)
            )
            start = space.parse(text) if isinstance(text, str) else None
            if start is not None:
                starts[key] = start
            elif text is not None:
                raise DecodeError(f"settings[{i}]: {key}: {text!r} is not the address of a block")
        scaling = scaling_of(settings, starts, listing.words)
        for key, start in starts.items():
            table = blocks[key][1]
            yield from ((start + word.offset, Placement(table, word, loop, scaling)) for word in table.words)


def unclaimed_text(prefix: str, missing_starts: Sequence[Start]) -> str:
    """A word that no loop has, or of which that cannot be known."""
    if all(start.prefix != prefix for start in missing_starts):
        return "belongs to no loop"
    options = " ".join(f"--{start.option.replace('_', '-')} {start.example}" for start in missing_starts)
    return f"where the loops begin is not said: give {options}"


def listing_text(lines: Sequence[Line], heads: Sequence[str]) -> str:
    """The lines in columns, the meaning wrapped within its own."""
    rows = [(line.address, line.hex, line.value, line.loop, line.register) for line in lines]
    widths = [max(map(width_of, column)) for column in zip(heads, *rows, strict=True)]
    columns = [i for i in range(len(heads)) if any(row[i] for row in rows)]
    indent = sum(widths[i] + 2 for i in columns)
    rows_text = ["  ".join([*(f"{heads[i]:<{widths[i]}}" for i in columns), "meaning"])]
    for row, line in zip(rows, lines, strict=True):
        cells = [(pad_left if heads[i] in RIGHT_ALIGNED else pad_right)(row[i], widths[i]) for i in columns]
        first, *rest = wrap(line.meaning, max(LINE_WIDTH - indent, MIN_MEANING_WIDTH), break_on_hyphens=False) or [""]
        rows_text.append("  ".join([*cells, first]).rstrip())
        rows_text += [" " * indent + text for text in rest]
    return to_printable("\n".join(rows_text) + "\n")


# --- A vendor's tables as records of one form: what is known of a register, a bit, a number, a parameter or a key -----
#
# A record knows no content and no loop; `Book.page` puts it before the reader, and the finders add what they know.

WRITERS = {
    "setting": "you: it is a setting, which the PLC reads",
    "request": "you or the program, for a moment: it is a request to the PLC",
    "status": "the PLC: it is a status, only to be read",
    "reserved": "nobody: it is reserved, leave it 0",
    "input": "you or the program: it is an input",
    "output": "the PLC: it is an output, only to be read",
}
"""Who writes a register, by its access, or a parameter, by its direction."""


@frozen
class Direction:
    """A vendor's key for the direction of control, whose action its words name, and how each word is set."""

    key: str
    action_of: str
    words: Mapping[str, str]
    """Each word as `pidcfg.encoders.regmap.TuningWords` has it, which says whether that is heating."""


class Series(NamedTuple):
    """Numbers of one kind: how they are called, what other numbers mean, and how they are asked for (``CK27``)."""

    name: str
    codes: Sequence[Code]
    other_text: str = ""
    prefixes: tuple[str, ...] = ()


class Part(NamedTuple):
    """A choice of bits of a record, or a state or number that it can have."""

    label: str
    title: str
    meaning: Meaning | None = None
    bits: Bits | None = None

    @classmethod
    def from_bits(cls, bits: Bits, meaning: Meaning | None) -> Part:
        """A row of bits with its meaning."""
        return cls(bits_label(bits), bits.title, meaning, bits)

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
            no_choice = f"0x{raw & row.mask:04X} means nothing here"
            return Point(self.label, self.title, no_choice, active=True, meaning=None, key=key)
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
    writer: str = ""
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
    examples: tuple[tuple[str, str], ...]
    """What can be asked for, and an example of each."""
    direction: Direction
    series: tuple[Series, ...] = ()
    writers: Mapping[str, str] = field(default_factory=dict)
    """Who writes a register or parameter that is not just a setting or a status, by its name."""
    column_heads: ClassVar[Sequence[str]]
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
        return listing_text([*self.lines(listing, options)], self.column_heads)

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
        source = points[0].meaning if record.kind == "bit" and points else meaning
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
            writer=record.writer,
            key=record.key,
            reference=str((source.basis if source else None) or record.basis or ""),
        )


def book_of(vendor: str) -> Book:
    """What is known of a vendor's registers or parameters."""
    book: Book = VENDORS[vendor].load("explainer")
    return book
