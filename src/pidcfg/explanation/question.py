"""What was asked: a name, perhaps with a content, and what is known of the loops around it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from pidcfg.explanation.configuration import Configured

ADDRESS = re.compile(r"([A-Za-z]{1,2})([0-9]{1,9})(?:\.([0-9]{1,3}))?")
OFFSET = re.compile(r"([A-Za-z/ ()]*)\+ ?([0-9]{1,3})\)?(?:\.([0-9]{1,3}))?")
HEX = re.compile(r"(?:0[xX]|16#)?([0-9A-Fa-f]{1,8})[hH]?")
MARKED_HEX = re.compile(r"(?:0[xX]|16#)([0-9A-Fa-f]{1,8})")
LONGEST = 80


class ThingError(ValueError):
    """Something that cannot be explained: what is wrong with it, and what to write instead."""


class Thing(NamedTuple):
    """One thing to explain: its name and the content given to it."""

    text: str
    name: str
    value: str | None


@dataclass(frozen=True, slots=True)
class Asked:
    """What the command line says beside the things: where loops begin, and a configuration."""

    loop: bool = False
    starts: tuple[str, ...] = ()
    config: Configured | None = None


def thing_of(text: str) -> Thing:
    """``V7642=0008`` in its two parts."""
    name, equals, value = text.partition("=")
    if not name.strip() or len(text) > LONGEST or not text.isprintable():
        raise ThingError(f"{text[:LONGEST]!r} is not a name, NAME.BIT or NAME=VALUE")
    if equals and not value.strip():
        raise ThingError(f"{text!r} has no value behind its '='")
    return Thing(text.strip(), name.strip(), value.strip() if equals else None)


def whole(text: str, highest: int) -> int | None:
    """A whole number in decimal, or in hexadecimal when it is marked (0x0005, 16#0005)."""
    marked = MARKED_HEX.fullmatch(text)
    number = int(marked.group(1), 16) if marked else int(text) if text.isdecimal() and len(text) < 12 else None
    return number if number is not None and number <= highest else None
