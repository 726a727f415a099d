"""Terms of a listing of which nothing tells where its loops are: its words by their addresses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.differences.terms import Item, Owner, Terms, number
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from pidcfg.encoders.listing import Listing
    from pidcfg.vendors import Vendor


def raw_terms(listing: Listing, vendor: Vendor) -> Terms:
    """Every word of a listing."""
    space = getattr(vendor.module("registers"), "SPACE", None)
    items = {}
    for address, raw in listing.words.items():
        shown = listing.shown[address] if space is None else space.name(address)
        value = raw if space is None else space.kind(address).show(raw)
        text = raw.text if isinstance(raw, Wire) else str(raw) if space is None else space.shown(address, raw)
        items[shown] = Item(shown, number(value), "", raw, shown, text, optional=True)
    return Terms((Owner("", "file", "", items),), is_listing=True, holds=items.__contains__)
