"""A symbol table of ISPSoft to a listing: the loops whose symbols have the names that pidcfg gives them (D610)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.dpide.st_scope import constant, device_of, is_constant
from pidcfg.encoders.dpide.symbol_table import Row, Table, parse
from pidcfg.encoders.dpide.symbols import SUFFIXES
from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, ROWS
from pidcfg.encoders.parameter_files import ParameterListing
from pidcfg.encoders.parameters import Elsewhere
from pidcfg.encoders.st.lex import tokens_of
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.listing import Listing
    from pidcfg.encoders.parameters import Content, Parameter

D610 = Decision(
    610,
    "a symbol table holds the loops whose symbols are all there",
    "A loop is read where a symbol ends in _IMV and those of all other operands stand beside it, with the suffixes of "
    "D256. Its name is what they begin with; units, ranges and the interval of an interrupt task are not in the table. "
    "With a program beside it, the program says which symbols are operands, whatever their names.",
    "Nothing else in a table says what a symbol is for; one that is missing would leave a default in its place.",
)
BLOCK_SUFFIX = f"_{SUFFIXES['I_MV']}"


@dataclass(slots=True)
class SymbolListing(ParameterListing):
    """The listing of a symbol table, with all of its rows."""

    table: Table = field(default_factory=Table)


def read_symbols(text: str) -> Listing:
    """The loops of a symbol table; raises `ListingError` at a row that is none."""
    listing = SymbolListing(table=parse(text.lstrip("\ufeff")))
    listing.settings = tuple(_loops(listing))
    listing.mixed = True
    return listing


def _loops(listing: SymbolListing) -> Iterator[dict[str, Any]]:
    rows = listing.table.by_name
    for block in [row for row in listing.table.rows if any(row.cells) and _is_block(row)]:
        loop = block.name[: -len(BLOCK_SUFFIX)]
        names = {row.name: f"{loop}_{SUFFIXES.get(row.name, row.name)}".casefold() for row in DPIDE_TABLE.rows}
        missing = [operand for operand, name in names.items() if name not in rows]
        if len(missing) == len(names) - 1:
            continue
        if missing:
            shown = ", ".join(f"{loop}_{SUFFIXES.get(name, name)}" for name in missing)
            raise ListingError(f"{loop} has no symbol {shown}; a loop has one for each operand", block.line)
        devices = {}
        for operand, name in names.items():
            row = rows[name]
            if device := device_in(ROWS[operand], row):
                devices[operand] = device
            content = value_in(ROWS[operand], row)
            if operand in {"I_MV", "MV"} or (operand == "PV" and content is None):
                continue
            full = f"{loop}.{operand}"
            listing.add(full, Elsewhere(row.name) if content is None else content, full, row.line)
        entry: dict[str, Any] = {"loop": loop}
        entry |= {"device": devices.pop("I_MV")} if "I_MV" in devices else {}
        yield entry | ({"devices": devices} if devices else {})


def _is_block(row: Row) -> bool:
    return row.name.casefold().endswith(BLOCK_SUFFIX.casefold()) and len(row.name) > len(BLOCK_SUFFIX)


def device_in(row: Parameter, symbol: Row) -> str:
    """The device of an operand's symbol; raises `ListingError` for one that it cannot have."""
    if not symbol.address:
        return ""
    return device_of(row, symbol.address, tokens_of(symbol.address, symbol.line)[0][0])


def value_in(row: Parameter, symbol: Row) -> Content | None:
    """The initial value of an operand's symbol; raises `ListingError` for one that is none of its type."""
    if not symbol.value or row.name in {"I_MV", "MV"}:
        return None
    tokens = tokens_of(symbol.value, symbol.line)[0][:-1]
    if not is_constant(tokens):
        raise ListingError(f"{symbol.name} begins with {symbol.value[:40]}, which is no number", symbol.line)
    return constant(row, tokens, initial=True)
