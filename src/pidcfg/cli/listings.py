"""A memory listing of any format to a configuration, for every command that takes one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.files import kind_of
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.words import DecodeError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.cli.inputs import Input
    from pidcfg.encoders.image import Image
    from pidcfg.limits import Limits
    from pidcfg.vendors import Vendor

FEW = 12
"""Addresses that a note lists before it only counts."""


def read_listing(entry: Input, vendor: Vendor, limits: Limits, kind: str | None = None) -> Listing:
    """The words of a listing; raises `ListingError` with the place of what cannot be read."""
    if len(entry.data) > limits.file_bytes:
        raise ListingError(f"the file is larger than {limits.file_bytes} bytes")
    try:
        text = entry.data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ListingError(f"byte 0x{entry.data[error.start]:02X} is not UTF-8") from None
    kinds = vendor.load("formats")
    chosen = kinds[kind] if kind else kind_of(text, kinds)
    if chosen is None:
        raise ListingError(f"this is no memory listing that pidcfg writes ({', '.join(kinds)})")
    listing: Listing = chosen.read(text)
    if listing.vendor not in {None, vendor.key}:
        raise ListingError(f"the listing is of vendor {listing.vendor!r}, not {vendor.key}")
    return listing


def decode_listing(
    entry: Input, vendor: Vendor, options: Mapping[str, Any], limits: Limits, kind: str | None = None
) -> Decoded:
    """The configuration that a listing holds; the notes name words that do not come back when it is encoded again."""
    listing = read_listing(entry, vendor, limits, kind)
    try:
        decoded: Decoded = vendor.load("decode")(listing.words, listing.settings, listing.plc, options)
    except DecodeError as error:
        raise ListingError(str(error), listing.lines.get(error.place or -1, 1)) from None
    again = vendor.encoder(vendor.model.model_validate(decoded.data)).image
    return Decoded(decoded.data, (*decoded.notes, *_differences(listing, again)))


def _differences(listing: Listing, again: Image) -> Iterator[str]:
    """Words that do not come back: encoded otherwise, or not at all."""
    differ = [c.address for c in again.cells if listing.words.get(c.number, c.value) != c.value]
    if differ:
        yield f"encoded again, these words differ from the listing: {_few(differ)}"
    name_of = {c.number: c.address for c in again.cells}
    beside = sorted(number for number in listing.words if number not in name_of)
    if beside:
        lines = [listing.shown.get(number, str(number)) for number in beside]
        yield f"these words of the listing belong to no loop and are left out: {_few(lines)}"


def _few(names: list[str]) -> str:
    return ", ".join(names[:FEW]) + (f" and {len(names) - FEW} more" if len(names) > FEW else "")
