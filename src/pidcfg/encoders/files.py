"""The file kinds of an image: how each is written, and how it is read back."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.memory_files import read_csv, read_json, read_text, write_csv, write_json, write_text
from pidcfg.encoders.modbus import Numbering, modbus_csv, read_modbus, write_modbus
from pidcfg.encoders.tables import columns, first_line
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from pidcfg.encoders.image import Cell
    from pidcfg.encoders.modbus import Place
    from pidcfg.encoders.parameters import Program
    from pidcfg.encoders.spaces import Space

CONFLICT = "conflict"
"""How a line of a merge's report begins that says what was left out because something else stands in its place."""
Write = Callable[[Any, tuple[str, ...]], str | Mapping[str, str]]
"""Image (or `Program`) and checklist to a text, or to several, each by what is added to the file's name."""
Read = Callable[[str], Listing]
Merge = Callable[[Any, str], tuple[str, tuple[str, ...]]]
"""Image and the text of a file that is the user's to the text of the file with both, and a report of what was done."""


class UnwritableError(ValueError):
    """What a format cannot hold, although the PLC can: named with its loop or address."""


@frozen
class FileKind:
    """One output format: its name, what it is for, writer, reader, and how a file of it begins."""

    name: str
    title: str
    write: Write
    read: Read
    looks_like: Callable[[str], bool]
    encoding: str = "utf-8"
    merge: Merge | None = None
    """How the image goes into a file that is the user's (``--into``)."""
    needs_into: bool = False
    """The format makes no sense but inside a file that is the user's."""
    carries_comments: bool = True
    """Whether the checklist stands in the file itself."""
    whole: bool = True
    """Whether every register has its value in it."""
    partial: bool = False
    """Whether it may hold some registers only, to be written over what the PLC has."""


TABLES = ({"address"}, {"element"})
"""Columns of which the table of a memory listing has one and no other."""


def kind_of(text: str, kinds: dict[str, FileKind]) -> FileKind | None:
    """The format that a text is in, by its first characters; None when it looks like none."""
    return next((kind for kind in kinds.values() if kind.looks_like(text)), None)


def listings(space: Space, title: str, numbering: Numbering | None = None) -> dict[str, FileKind]:
    """The formats that every vendor with addresses has: text, csv, json, and modbus where its numbering is known."""
    word = re.compile(rf"({'|'.join(bank.prefix for bank in space.banks)})[0-9]\w*(\s|$)", re.IGNORECASE)
    kinds = [
        FileKind(
            "text",
            title,
            write_text,
            partial(read_text, space=space),
            lambda text: word.match(first_line(text)) is not None,
            partial=True,
        ),
        FileKind(
            "csv",
            f"{title} for spreadsheets",
            write_csv,
            partial(read_csv, space=space),
            lambda text: {"address", "element", "table", "tag", "nickname"} & set(columns(text)) in TABLES,
            partial=True,
        ),
        FileKind(
            "json",
            f"{title} for programs",
            write_json,
            partial(read_json, space=space),
            lambda text: text.lstrip().startswith("{"),
            partial=True,
        ),
    ]
    if numbering is not None:
        kinds.append(modbus_kind(space, numbering))
    return {kind.name: kind for kind in kinds}


def modbus_kind(space: Space, numbering: Numbering) -> FileKind:
    """The format ``modbus`` by a vendor's numbering, or one that is stated."""
    return FileKind(
        "modbus",
        "Modbus map (CSV)",
        partial(write_modbus, numbering=numbering),
        partial(read_modbus, space=space, numbering=numbering),
        lambda text: "table" in columns(text),
        partial=True,
    )


def named_modbus_kind(cells: Callable[[Program], Iterable[tuple[Cell, Place]]]) -> FileKind:
    """The same of named parameters; ``cells``: those that have registers, with their places."""

    def read(_text: str) -> Listing:
        raise ListingError("registers of named parameters do not say what they are of: read them from the PLC (pull)")

    return FileKind(
        "modbus",
        "Modbus map (CSV)",
        lambda image, checklist: modbus_csv(image, checklist, cells(image)),
        read,
        lambda _text: False,
        partial=True,
    )
