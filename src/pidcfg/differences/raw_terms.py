"""Terms of what no configuration places: words by their addresses, settings by the names that they have."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.differences.terms import NAMES, Item, Owner, Terms, flat, number
from pidcfg.listings import name_in
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from pidcfg.encoders.listing import Listing
    from pidcfg.vendors import Vendor


def raw_terms(listing: Listing, vendor: Vendor) -> Terms:
    """Every word of a listing, and every setting beside them."""
    items = dict(unplaced(listing, vendor, (), ()))
    items |= {key: Item(key, number(value), "", number(value)) for key, value in flat({"plc": dict(listing.plc)})}
    owner = Owner("", "file", "", items, is_described=listing.described)
    return Terms((owner,), is_listing=True, holds=items.__contains__)


def unplaced(
    listing: Listing, vendor: Vendor, words: Collection[Any], names: Collection[str]
) -> Iterator[tuple[str, Item]]:
    """What a listing holds besides certain ``words`` and the settings of loops of certain ``names``."""
    space = getattr(vendor.module("registers"), "SPACE", None)
    for address, raw in listing.words.items():
        if address not in words:
            shown = listing.shown[address] if space is None else space.name(address)
            value = raw if space is None else space.kind(address).show(raw)
            text = raw.text if isinstance(raw, Wire) else str(raw) if space is None else space.shown(address, raw)
            yield shown, Item(shown, number(value), "", raw, shown, text, optional=True)
    for entry in listing.settings:
        name = name_in(entry)
        if name not in names:
            for key, value in flat({name: {key: part for key, part in entry.items() if key not in NAMES}}):
                yield key, Item(key, number(value), "", number(value))
