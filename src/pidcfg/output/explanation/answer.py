"""An explanation: what was asked for, what it means, and where that stands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.regmap import Meaning

SYMPTOM = "symptom"
"""The kind of a page about what people see."""


class Value(NamedTuple):
    """A content: the raw number, as the vendor shows it, and what it says; ``problem``: why it says nothing."""

    raw: bool | int | float | str
    shown: str
    text: str = ""
    problem: str = ""


class Point(NamedTuple):
    """One bit, or a group of bits or numbers, of what is explained."""

    label: str
    title: str
    state: str = ""
    """What the value chooses: on, off, reverse; empty without a value."""
    active: bool = False
    """Whether the value has it on."""
    meaning: Meaning | None = None
    key: str | None = None


class Origin(NamedTuple):
    """The line of a configuration that sets a register."""

    file: str
    line: int
    column: int
    loop: str | None
    key: str
    text: str


@frozen
class Page:
    """One explanation; `pidcfg.output.explanation.shown` prints it."""

    kind: str
    name: str
    title: str
    vendor: str | None = None
    vendor_title: str = ""
    value: Value | None = None
    meaning: Meaning | None = None
    points: tuple[Point, ...] = ()
    holds: str = ""
    unit: str = ""
    notation: str = ""
    access: str = ""
    by: str = ""
    key: str | None = None
    reference: str = ""
    loop: str | None = None
    place: str = ""
    """Where in the loop's block it stands."""
    origins: tuple[Origin, ...] = ()
    notes: tuple[str, ...] = ()
    markdown: str = ""
    """A page that stands as it is (rules, decisions); ``extra`` are its parts for programs."""
    extra: Mapping[str, Any] | None = None


class QuestionError(ValueError):
    """Something that cannot be explained: what is wrong with it, and what to write instead."""


class UnknownError(QuestionError):
    """A name that nobody knows."""
