"""A Modbus map that is ready to be filled in: a row for everything that it must cover, without the registers."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.files import FileKind
from pidcfg.encoders.listing import Listing, ListingError
from pidcfg.encoders.map_rows import HEADER, TABLES
from pidcfg.encoders.modbus import reference
from pidcfg.encoders.modbus_map import types_of as types_of_kind
from pidcfg.encoders.spaces import BIT
from pidcfg.encoders.symbol_map import row_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from pidcfg.encoders.spaces import Space
    from pidcfg.encoders.symbol_map import Point, Symbols

FORMAT = "modbus-map"
COLUMNS = ",".join(HEADER[:5])
Rows = list[str]
"""Rows of a map; those that begin with ``#`` are offered and not needed."""
SHOWN = 3
"""Rows of an example in a message."""


def map_kind(rows: Callable[[Any], Rows]) -> FileKind:
    """The format ``modbus-map`` of a vendor."""
    return FileKind(
        FORMAT, "Modbus map to be filled in (CSV)", lambda image, _: _text(rows(image)), _read, _never, whole=False
    )


def _never(_text: str) -> bool:
    return False


def _read(_text: str) -> Listing:
    raise ListingError("a map says where registers are, not what they hold; name it with --map")


def _text(rows: Iterable[str]) -> str:
    firsts = ", ".join(f"{table} 0 is {reference(table, 0)}" for table in reversed(TABLES))
    lines = [
        "# Write the register of each row behind its table, counted from 0:",
        f"# {firsts}. A switch in a register has its bit behind a point: holding,40.3.",
        COLUMNS,
        *rows,
    ]
    return "".join(f"{line}\n" for line in lines)


def space_rows(space: Space, offered: Space) -> Rows:
    """A row a bank, which counts for all registers behind its own; ``offered``: with tags that a trend wants."""
    rows = [
        f"{bank.name(bank.first)},{'coil' if bank.kind is BIT else 'holding'},,{types_of_kind(bank.kind)[0]}"
        for bank in offered.banks
    ]
    needed = len(space.banks)
    return [*rows[:needed], *(f"# {row}" for row in rows[needed:])]


def symbol_rows(symbols: Symbols, offered: Iterable[str] = (), prefix: str = "") -> Rows:
    """A row a parameter, of devices one a bank and type.

    ``offered``: names of parameters that no map has to cover, but that a trend or an operator wants.
    """
    rows: dict[str, None] = {}
    points = symbols.points.values()
    for point in points:
        if point.needed:
            rows[_row(symbols, point, prefix)] = None
    wanted = set(offered)
    more = (p for p in points if not p.needed and p.name.removeprefix(f"{p.loop}.") in wanted and p.loop)
    others = dict.fromkeys(_row(symbols, point, prefix) for point in more)
    return [*rows, *(f"# {row}" for row in others if row not in rows)]


def _row(symbols: Symbols, point: Point, prefix: str) -> str:
    device = symbols.device(point.device)
    if device is None:
        return row_text(point, symbol=f"{prefix}{point.name}")
    bank, _ = device
    return row_text(point, symbol=f"{bank}0" if not bank.endswith(".") else f"{bank[:-1]}0.0")


def filled(rows: Iterable[str]) -> Iterator[str]:
    """Rows as an example, with registers one after the other; a device is in one place by all its rows."""
    numbers: Mapping[str, Iterator[int]] = {table: count(0, 2 if table == "holding" else 1) for table in TABLES}
    places: dict[tuple[str, str], int] = {}
    for row in rows:
        if not row.startswith("#"):
            symbol, table, _, *rest = row.split(",")
            if (symbol, table) not in places:
                places[symbol, table] = next(numbers[table])
            yield ",".join((symbol, table, str(places[symbol, table]), *rest))


def example(rows: Rows) -> str:
    """What a message shows of a map: some rows, and how many more there are."""
    lines = list(filled(rows))
    more = f" and {len(lines) - SHOWN} more" if len(lines) > SHOWN else ""
    return " ".join(f"'{line}'" for line in lines[:SHOWN]) + more
