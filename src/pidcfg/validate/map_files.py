"""Modbus maps as files: the one that a configuration names, or that is stated beside it, to places of registers."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.decoding import listing_text, refuse_large
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.modbus_map import (
    FORMAT_NAME,
    MapError,
    NamedNumbering,
    UnusableMapError,
    example_text,
    read_map,
    read_symbol_map,
)
from pidcfg.text.diagnostics import Diagnostic, Severity
from pidcfg.text.reader import DEFAULT_TEXT_NAME, may_be_quoted, read_failure, read_named_file, reader_of, source_data
from pidcfg.vendors import format_of

if TYPE_CHECKING:
    from pathlib import Path

    from pidcfg.encoders.listing import Numbering
    from pidcfg.encoders.parameters import AnyImage
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Files, Limits, Reader
    from pidcfg.vendors import Vendor

MAP_CODE = "PID067"
"""A map that cannot be used."""
MAP_PATH = ("plc", "map")


class MapFile(NamedTuple):
    """The text of a map, and its name in messages."""

    text: str
    name: str
    may_be_quoted: bool = True
    """Whether messages may say what stands in it."""


ROW_FAULT = "this row cannot be used; --map FILE says why (a file outside of the configuration's folder is not quoted)"


def map_of_data(data: bytes, name: str, limits: Limits) -> MapFile:
    """A map as its file holds it; raises `UnusableMapError`."""
    try:
        refuse_large(data, limits)
        return MapFile(listing_text(data), name)
    except ListingError as error:
        raise UnusableMapError(str(error), name, error.line, error.column) from None


def named_map(document: Document | None, reader: Reader) -> MapFile | None:
    """The map that a configuration names by ``plc.map``, relative to it; raises `UnusableMapError`."""
    plc = (document.data or {}).get("plc") if document is not None else None
    map_name = plc.get("map") if isinstance(plc, dict) else None
    if document is None or not isinstance(map_name, str):
        return None
    name = reader.resolve(document.file, map_name)
    try:
        data = read_named_file(reader, name, document.limits.listing_bytes + 1)
    except (OSError, ValueError) as error:
        span = document.locate(MAP_PATH)
        cure = f"the name of a map is relative to the file that names it; `--format {FORMAT_NAME}` of encode writes one"
        raise UnusableMapError(f"{read_failure(name, error)}: {cure}", document.file, span.line, span.column) from None
    return map_of_data(data, name, document.limits)._replace(may_be_quoted=may_be_quoted(reader, document.file, name))


def map_of_source(
    source: Path | str | bytes | None, document: Document | None, files: Files, limits: Limits
) -> MapFile | None:
    """A Modbus map, else the one of the configuration's ``plc.map``; raises `UnusableMapError`, `OSError`."""
    if source is None:
        return named_map(document, reader_of(files))
    data, label = source_data(source, None, files, limits.listing_bytes + 1)
    return map_of_data(data, "map" if label == DEFAULT_TEXT_NAME else label, limits)


def numbering_of(
    vendor: Vendor, map_file: MapFile | None, image: AnyImage | None, file: str = "FILE"
) -> Numbering | NamedNumbering:
    """Where registers are: by a stated map, else as the vendor's manual says; raises `UnusableMapError`.

    ``image``: the memory of the configuration ``file``, every setting of which a stated map must cover.
    """
    if map_file is None:
        try:
            numbering: Numbering = vendor.load("numbering")
        except LookupError:
            raise UnusableMapError(_no_map_text(vendor, image, file)) from None
        return numbering
    try:
        return _read_numbering(vendor, map_file, image)
    except MapError as error:
        message = str(error) if map_file.may_be_quoted else ROW_FAULT
        raise UnusableMapError(message, map_file.name, error.line, error.column) from None


def _read_numbering(vendor: Vendor, map_file: MapFile, image: Any) -> Numbering | NamedNumbering:
    space = space_of(vendor)
    if space is not None:
        numbering = read_map(map_file.text, space)
        if image is not None:
            numbering.check_places(image)
        return numbering
    if image is None:
        raise UnusableMapError(f"the registers of {vendor.title} do not say what loops there are: name a configuration")
    return read_symbol_map(map_file.text, _vendor_points(vendor)(image))


def space_of(vendor: Vendor) -> Any:
    """The banks that a map of a vendor may speak of; None: its parameters have names."""
    registers = vendor.module("registers")
    return getattr(registers, "MAP_SPACE", getattr(registers, "SPACE", None))


def _vendor_points(vendor: Vendor) -> Any:
    try:
        return vendor.load("points")
    except LookupError:
        raise UnusableMapError(f"{vendor.title} is no PLC: it has no registers that a map could number") from None


def _no_map_text(vendor: Vendor, image: AnyImage | None, file: str) -> str:
    """That there is no map, with one that could be."""
    if space_of(vendor) is None:
        _vendor_points(vendor)
    problem = f"the manual of {vendor.title} prints no Modbus map, and none is made up"
    cure = "state one by --map FILE, or by `plc: {map: FILE}` in the configuration"
    if image is None:
        return f"{problem}; {cure}"
    rows = [row for row in format_of(vendor, FORMAT_NAME).write(image, ()).splitlines() if not row.startswith("#")][1:]
    command = f"`pidcfg encode {file} --format {FORMAT_NAME}` writes its rows for you to fill in"
    row = example_text(rows)
    return f"{problem}; {cure}, with rows of symbol, table, register (from 0) and type such as {row}; {command}"


def check_map(document: Document, vendor: Vendor, image: AnyImage, reader: Reader) -> list[Diagnostic]:
    """What is wrong with the map that a configuration names: it must be there and cover the loops."""
    try:
        map_file = named_map(document, reader)
        if map_file is not None:
            numbering_of(vendor, map_file, image, document.file)
    except UnusableMapError as error:
        message = error.message if error.name == document.file else str(error)
        return [Diagnostic(MAP_CODE, Severity.ERROR, message, document.file, document.locate(MAP_PATH), MAP_PATH)]
    return []
