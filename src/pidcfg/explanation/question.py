"""A question: a name, perhaps with a content, and what is known of the loops around it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.explanation.configuration import Configured

ADDRESS = re.compile(r"([A-Za-z]{1,2})([0-9]{1,9})(?:\.([0-9]{1,3}))?")
OFFSET = re.compile(r"([A-Za-z/ ()]*)\+ ?([0-9]{1,3})\)?(?:\.([0-9]{1,3}))?")
LONGEST = 80
MOST_DIGITS = 5
"""Of a number that a PLC shows."""


def is_number(text: str) -> bool:
    """Whether a text is a number such as a PLC shows."""
    return text.isdecimal() and len(text) <= MOST_DIGITS


class QuestionError(ValueError):
    """Something that cannot be explained: what is wrong with it, and what to write instead."""


@dataclass(frozen=True, slots=True)
class Question:
    """One thing to explain: its name, the content given to it, and what the options say of the loops."""

    text: str
    name: str
    value: str | None = None
    loop: bool = False
    """Whether loops begin where the example does."""
    starts: tuple[str, ...] = ()
    """Addresses at which blocks of registers begin."""
    config: Configured | None = None
    one_vendor: bool = False
    """Whether a single vendor is asked, so that a number alone (``26``) can only be one that its PLC shows."""
    every_block: bool = False
    """Whether an offset that names no block, ``+09``, is one in each block of a loop."""

    @classmethod
    def of(
        cls, text: str, *, loop: bool = False, starts: tuple[str, ...] = (), config: Configured | None = None
    ) -> Question:
        """``V7642=0008`` in its two parts; raises `QuestionError` where it has no name, or an empty content."""
        name, equals, value = text.partition("=")
        if not name.strip() or len(text) > LONGEST or not text.isprintable():
            raise QuestionError(f"{text[:LONGEST]!r} is not a name, NAME.BIT or NAME=VALUE")
        if equals and not value.strip():
            raise QuestionError(f"{text!r} has no value behind its '='")
        return cls(text.strip(), name.strip(), value.strip() if equals else None, loop, starts, config)

    @property
    def name_and_loop(self) -> tuple[str, str | None]:
        """``TIC-101.gain`` as name and loop, where the configuration has that loop."""
        loop, _, rest = self.name.partition(".")
        return (rest, loop) if rest and self.config is not None and loop in self.config.loops else (self.name, None)
