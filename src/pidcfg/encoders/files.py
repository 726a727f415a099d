"""The file kinds of an image: how each is written, and how it is read back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pidcfg.encoders.image import Image
from pidcfg.encoders.listing import Listing

Write = Callable[[Image, tuple[str, ...]], str]
Read = Callable[[str], Listing]


@dataclass(frozen=True, slots=True)
class FileKind:
    """One output format: its name, what it is for, writer, reader, and how a file of it begins."""

    name: str
    title: str
    write: Write
    read: Read
    looks_like: Callable[[str], bool]


@dataclass(frozen=True, slots=True)
class DecodeOption:
    """What a listing may lack and the command line then says: ``read`` gives None for a text that makes no sense."""

    key: str
    metavar: str
    title: str
    example: str
    read: Callable[[str], Any]


def kind_of(text: str, kinds: dict[str, FileKind]) -> FileKind | None:
    """The format that a text is in, by its first characters; None when it looks like none."""
    return next((kind for kind in kinds.values() if kind.looks_like(text)), None)


def first_line(text: str) -> str:
    """The first line that is neither blank nor a comment."""
    return next((s for line in text.splitlines() if (s := line.strip()) and not s.startswith("#")), "")
