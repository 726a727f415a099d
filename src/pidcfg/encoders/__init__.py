"""Configurations to register words and back: codecs, register maps and one writer per file kind.

Here the options of commands that say what a listing, or a configuration of another vendor, does not. A vendor's own
ones stand in its package, which a command's help reads: they import a schema when a value is read.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pidcfg.text.frozen import frozen


@frozen
class Option:
    """One option; ``read`` gives None for a text that makes no sense."""

    key: str
    metavar: str
    title: str
    example: str
    read: Callable[[str], Any]
    needed: bool = False
    """No register holds it: a listing with nothing beside it cannot be read without this option."""


def read_per_loop(read: Callable[[str], object]) -> Callable[[str], list[object] | None]:
    """A reader of options that say one thing a loop, with commas between; None when ``read`` refuses one."""

    def values(text: str) -> list[object] | None:
        try:
            return [read(part.strip()) for part in text.split(",")]
        except ValueError:
            return None

    return values


def read_choice(*words: str) -> Callable[[str], str]:
    """A reader of options that are one of some words."""

    def word(text: str) -> str:
        if text not in words:
            raise ValueError(text)
        return text

    return word
