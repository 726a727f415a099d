"""Sources of the public calls: files, texts, and documents that have been read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.output.arguments import ArgumentError
from pidcfg.text.document import Document
from pidcfg.text.reader import UNNAMED, Files, reader_of, source_data
from pidcfg.text.source import read_document
from pidcfg.validate.engine import Checked, check_document

if TYPE_CHECKING:
    from pidcfg.text.reader import Limits
    from pidcfg.validate.map_files import MapFile

Source = Path | str | bytes | Document
"""A file by its path, a text, or the ``document`` of another result, which is not read again."""


def document_of(source: Source, name: str | None, files: Files, limits: Limits) -> Document:
    """A source as a document; raises `OSError` for a file that is not there."""
    if isinstance(source, Document):
        return source if source.limits == limits else replace(source, limits=limits)
    return read_document(*source_data(source, name, files, limits.listing_bytes + 1), limits)


def checked_of(source: Source, name: str | None, files: Files, limits: Limits) -> Checked:
    """A source as a checked configuration."""
    return check_document(document_of(source, name, files, limits))


def stated_map(
    source: Path | str | bytes | None, document: Document | None, files: Files, limits: Limits
) -> MapFile | None:
    """A Modbus map, else the one of the configuration's ``plc.map``; raises `UnusableMapError`, `OSError`."""
    from pidcfg.validate.map_files import map_of_data, named_map

    if source is None:
        return named_map(document, reader_of(files))
    data, label = source_data(source, None, files, limits.listing_bytes + 1)
    return map_of_data(data, "map" if label == UNNAMED else label, limits)


def files_of(
    source: Path | str | bytes | Sequence[Path | str | bytes],
    name: str | Sequence[str] | None,
    files: Files,
    limits: Limits,
) -> list[tuple[bytes, str]]:
    """One or several files, each its bytes and its name; raises `ArgumentError` where names and files do not agree."""
    source = bytes(source) if isinstance(source, bytearray | memoryview) else source
    sources = source if isinstance(source, Sequence) and not isinstance(source, str | bytes) else [source]
    names = [name] * len(sources) if name is None or isinstance(name, str) else list(name)
    if not sources or len(names) != len(sources):
        raise ArgumentError("`source` and `name` are lists of the same length, and not empty", "source", "name")
    most = limits.listing_bytes + 1
    return [source_data(one, label, files, most) for one, label in zip(sources, names, strict=True)]


def side_of(source: Source, name: str | None, files: Files, limits: Limits) -> tuple[Checked | tuple[bytes, str], str]:
    """A side of a comparison, a checked configuration or the bytes and name of a listing; and what it is called."""
    from pidcfg.output.differences import is_listing

    if isinstance(source, Document):
        return checked_of(source, name, files, limits), name or source.file
    data, label = source_data(source, name, files, limits.listing_bytes + 1)
    if is_listing(label):
        return (data, label), label
    return check_document(read_document(data, label, limits)), label
