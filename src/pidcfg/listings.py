"""A memory listing of any vendor and format to a configuration."""

from __future__ import annotations

import re
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.blocks import NoValueError
from pidcfg.encoders.files import kind_of
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.listing import Listing, ListingError, few
from pidcfg.encoders.parameters import Elsewhere
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.spaces import NoRegisterError
from pidcfg.encoders.tables import columns, first_line
from pidcfg.encoders.words import DecodeError
from pidcfg.limits import DEFAULT
from pidcfg.unreadable import binary_file
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping

    from pidcfg.encoders.files import FileKind
    from pidcfg.encoders.image import Image
    from pidcfg.limits import Limits
    from pidcfg.vendors import Vendor

NOTHING = {bool: False, int: 0, float: 0.0}
"""What stands for a content that is no value, by its type."""
CONFIGURATION = re.compile(r"^pidcfg:", re.MULTILINE)
SEPARATED = re.compile(r'"?(?P<name>[A-Za-z][\w.]*)"?\s*(?P<sign>[,;:=])')
"""An address or name, and behind it another sign than the blank of a text listing."""
MOST_DIGITS = DEFAULT.scalar_bytes
"""Digits of a number: as many as a value of a configuration may have signs, and fewer than Python reads."""
ENDLESS = re.compile(rf"(?<![0-9])[0-9]{{{MOST_DIGITS + 1},}}")
HEADERS = "the header 'address,hex', or 'address,value' where the numbers are decimal"
INSTEAD = "decode what 'pidcfg encode' writes as text, csv or json, or read the PLC itself with 'pidcfg pull --map'"
HEAD = 1000
"""Characters in which a listing names its vendor."""


def read_listing(data: bytes, vendor: Vendor, limits: Limits, kind: str | None = None) -> Listing:
    """The words of a listing; raises `ListingError` with the place of what cannot be read."""
    refuse_large(data, limits)
    kinds = vendor.load("formats")
    text = _text_of(data, [kinds[kind]] if kind else [*kinds.values()])
    chosen = kinds[kind] if kind else kind_of(text, kinds)
    if chosen is None:
        if other := binary_file(data):
            raise ListingError(f"{other[0]}, no memory listing; {other[1]}")
        named = next((key for key in VENDORS if f"{key} memory listing" in text[:HEAD]), None)
        if named not in {None, vendor.key}:
            raise ListingError(f"this is a listing of vendor {named}, not {vendor.key}")
        raise ListingError(_no_listing(text, kinds))
    listing: Listing = chosen.read(text)
    if listing.vendor not in {None, vendor.key}:
        raise ListingError(f"the listing is of vendor {listing.vendor!r}, not {vendor.key}")
    return listing


def _no_listing(text: str, kinds: Mapping[str, FileKind]) -> str:
    """What a text is that is no listing, with the cure where there is one."""
    if not text.strip():
        return "the file is empty: export the listing again"
    if CONFIGURATION.search(text):
        return "this is a file of pidcfg and no listing; 'pidcfg encode' writes the words of a configuration"
    if {"table", "register"} <= set(columns(text)):
        return f"this is a Modbus listing, whose registers only a map of the project explains: {INSTEAD}"
    problem = f"this is no memory listing that pidcfg reads ({', '.join(kinds)})"
    row = SEPARATED.match(first_line(text))
    if row is None or not kinds["text"].looks_like(f"{row['name']} "):
        return problem
    return f"{problem}; write blanks in place of {row['sign']!r} behind {row['name']}, or begin a table with {HEADERS}"


def _text_of(data: bytes, kinds: Iterable[FileKind]) -> str:
    """The text of a listing; one that is not UTF-8 is in the encoding of the format that it looks like."""
    try:
        return listing_text(data)
    except ListingError:
        for kind in kinds:
            if kind.encoding != "utf-8":
                with suppress(ListingError):
                    text = _decoded(data, kind.encoding)
                    if kind.looks_like(text):
                        return text
        raise


def refuse_large(data: bytes, limits: Limits) -> None:
    """Raises `ListingError` for a file that is larger than the limit."""
    if len(data) > limits.file_bytes:
        raise ListingError(f"the file is larger than {limits.file_bytes} bytes")


def listing_text(data: bytes) -> str:
    """The text of a file in UTF-8, or in UTF-16 when it begins so."""
    return _decoded(data, "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")


def exact_text(data: bytes, encoding: str) -> str:
    """The text of a file that goes back byte for byte: a byte order mark stays its first character."""
    return _decoded(data, encoding)


def _decoded(data: bytes, encoding: str) -> str:
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        place = f"byte 0x{data[error.start]:02X} at {error.start}" if error.start < len(data) else "the end of the file"
        name = encoding.upper().removesuffix("-SIG").removesuffix("-LE")
        raise ListingError(f"{place} is not {name}; save the file as {name}") from None
    if endless := ENDLESS.search(text):
        begin = text.rfind("\n", 0, endless.start()) + 1
        line, column = text.count("\n", 0, begin) + 1, endless.start() - begin + 1
        raise ListingError(f"a number of {len(endless[0])} digits; the limit is {MOST_DIGITS}", line, column)
    return text


def together(listings: list[Listing]) -> Listing:
    """Several files of one image as one; an address in two of them is refused."""
    first, *others = sorted(listings, key=lambda listing: not listing.leads)
    for other in others:
        first.join(other)
    return first


def with_names(listing: Listing, image: Image) -> Listing:
    """A listing with the names, ranges, units and dialog settings of another image, as far as it does not say them.

    A loop belongs to the one of the same name; where the listing names none, to the one at the same place.
    """
    settings = listing.settings
    if settings:
        by_name = {name_in(entry): entry for entry in image.settings}
        settings = tuple(_merged(by_name.get(name_in(entry), {}), entry) for entry in settings)
    else:
        settings = tuple(entry for entry in image.settings if _is_held(name_in(entry), listing))
    return replace(listing, settings=settings, plc={**image.plc, **listing.plc})


def name_in(entry: Mapping[str, Any]) -> str:
    """The loop or block that settings beside the words are of."""
    return str(entry.get("loop") or entry.get("block") or "")


def _is_held(name: Any, listing: Listing) -> bool:
    """Whether a listing may hold a loop: where its words have names, one of them begins with the loop's."""
    return any(not isinstance(word, str) or word.startswith(f"{name}.") for word in listing.words)


def like_options(listing: Listing, options: Mapping[str, Any]) -> Mapping[str, Any]:
    """The options of a decoder for a listing that takes its names from another image."""
    return options if listing.settings else {**options, "names_only": True}


def _merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    merged = {**under, **over}
    for key in under.keys() & over.keys():
        if isinstance(under[key], dict) and isinstance(over[key], dict):
            merged[key] = _merged(under[key], over[key])
    return merged


def decode_listing(listing: Listing, vendor: Vendor, options: Mapping[str, Any], like: Image | None = None) -> Decoded:
    """The configuration that a listing holds; the notes name words that do not come back when it is encoded again.

    ``like``: an image that gives names, ranges and units where the listing does not.
    """
    if like is not None:
        options, listing = like_options(listing, options), with_names(listing, like)
    try:
        decoded, wrong = decode_words(listing, vendor, options)
        config = read_settings(vendor.model, decoded.data, "the listing gives no configuration")
        again = vendor.encoder(config).image
    except NoRegisterError as error:
        raise ListingError(str(error)) from None
    except DecodeError as error:
        text = "; ".join((str(error), *listing.notes))
        raise ListingError(text, listing.lines.get(error.place or -1, 1)) from None
    zeros = (f"{text}; it counts as 0 (D50)" for text in wrong)
    return Decoded(
        decoded.data, (*listing.notes, *zeros, *decoded.notes, *_differences(listing, again, decoded.status))
    )


def decode_words(listing: Listing, vendor: Vendor, options: Mapping[str, Any]) -> tuple[Decoded, list[str]]:
    """What the words of a listing say, and which of them are no values of their format: those count as 0 (D50).

    Raises `DecodeError` where something else is wrong with them.
    """
    words, wrong = dict(listing.words), list[str]()
    while True:
        try:
            return vendor.load("decode")(words, listing.settings, listing.plc, options), wrong
        except NoValueError as error:
            words[error.place] = nothing(words[error.place])
            wrong.append(str(error))


def annotate_listing(listing: Listing, vendor: Vendor, options: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """A listing with a meaning beside every word, also of words that are no values; with the reader's notes."""
    try:
        text: str = vendor.load("explainer").annotate(listing, options)
    except (DecodeError, NoRegisterError) as error:
        raise ListingError(str(error)) from None
    return text, listing.notes


def _differences(listing: Listing, again: Image, status: Collection[int]) -> Iterator[str]:
    """Words that do not come back: encoded otherwise, or not at all."""
    said = {number: raw for number, raw in listing.words.items() if not isinstance(raw, Elsewhere)}
    differ = [c.address for c in again.cells if said.get(c.number, c.raw) != c.raw]
    if differ:
        yield f"encoded again, these words differ from the listing: {few(differ)}"
    name_of = {c.number: c.address for c in again.cells}
    unassigned = sorted(number for number in listing.words if number not in name_of and number not in status)
    if unassigned and not listing.mixed:
        lines = [listing.shown.get(number, str(number)) for number in unassigned]
        yield f"these words of the listing belong to no loop and are left out: {few(lines)}"


def check_settings(listing: Listing, vendor: Vendor) -> None:
    """Raises `DecodeError` unless what stands beside the words is sound; words that are no values do not matter."""
    words, unreadable = dict(listing.words), set[Any]()
    while True:
        try:
            vendor.load("decode")(words, listing.settings, listing.plc)
        except DecodeError as error:
            if error.place not in words or error.place in unreadable:
                raise
            unreadable.add(error.place)
            words[error.place] = nothing(words[error.place])
        else:
            return


def nothing(content: Any) -> Any:
    """What stands for a content that is no value."""
    return NOTHING.get(type(content), 0.0)
