"""A nickname CSV read back: its initial values, and the loops and blocks that the nicknames tell."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.click.nickname_csv import initial, parse
from pidcfg.encoders.click.nicknames import ACTION, NAMED
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.maps.click import BLOCKS, SPACE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pidcfg.encoders.click.nickname_csv import Row

KEYS = {prefix: key for key, (prefix, _) in BLOCKS.items()}


ALIKE = 3
"""So many nicknames that agree on where a block begins are no chance."""


class Claim(NamedTuple):
    """What one nickname says: where a block of a loop begins."""

    loop: str
    bank: str
    start: int
    row: Row


def read_nicknames(text: str) -> Listing:
    """The initial values of all C, DS and DF rows, and beside them the loops with their blocks (D107)."""
    listing = Listing(mixed=True)
    rows = parse(text).rows
    for row in rows:
        number, raw = SPACE.parse(row.address), initial(row)
        if number is not None and raw is not None:
            listing.add(number, raw, row.address, row.line)
    claims = list(_claims(rows))
    listing.settings = tuple(_loops(claims))
    listing.notes = tuple(_almost_loops(claims))
    return listing


def _claims(rows: Iterable[Row]) -> Iterator[Claim]:
    """Nicknames with a known suffix; none of a bank's suffixes is the end of another."""
    for row in rows:
        number = SPACE.parse(row.address)
        if number is None:
            continue
        bank, n = SPACE.place(number)
        for named in NAMED:
            name = row.nickname.removesuffix(named.suffix)
            if named.bank == bank.prefix and name and name != row.nickname:
                yield Claim(name, named.bank, n - named.offset, row)


def _almost_loops(claims: list[Claim]) -> Iterator[str]:
    """Names that look like loops and are none, as the nickname of the action's bit is missing (D107)."""
    names = {claim.loop for claim in claims if claim.row.nickname == claim.loop + ACTION.suffix}
    for name in dict.fromkeys(claim.loop for claim in claims if claim.loop not in names):
        agreeing = Counter((claim.bank, claim.start) for claim in claims if claim.loop == name)
        count = sum(number for number in agreeing.values() if number >= ALIKE)
        if not count:
            continue
        place = next((f" at C{start + ACTION.offset}" for bank, start in agreeing if bank == ACTION.bank), "")
        yield (
            f"{name}: {count} nicknames are those of a loop, but {name}{ACTION.suffix} is missing{place}, so it is not "
            "read as one (D107)"
        )


def _loops(claims: list[Claim]) -> Iterator[Mapping[str, Any]]:
    names = [claim.loop for claim in claims if claim.row.nickname == claim.loop + ACTION.suffix]
    for name in dict.fromkeys(names):
        entry: dict[str, Any] = {"loop": name}
        for bank, key in KEYS.items():
            block_claims = [claim for claim in claims if claim.loop == name and claim.bank == bank]
            if block_claims:
                entry[key] = _start(block_claims)
        yield entry


def _start(claims: list[Claim]) -> str:
    """Where a block begins when all nicknames agree."""
    first = claims[0]
    other = next((claim for claim in claims if claim.start != first.start), None)
    if other is not None:
        raise ListingError(
            f"the nicknames of {first.loop} do not agree: {first.row.nickname} at {first.row.address} belongs to a "
            f"block from {first.bank}{first.start}, {other.row.nickname} at {other.row.address} to one from "
            f"{other.bank}{other.start}",
            other.row.line,
        )
    if SPACE.parse(f"{first.bank}{first.start}") is None:
        raise ListingError(f"{first.row.nickname} at {first.row.address} leaves no room for its block", first.row.line)
    return f"{first.bank}{first.start}"
