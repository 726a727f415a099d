"""What is downloaded to a PLC: its words in address order, and beside them what no register holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from pidcfg.encoders.regmap import Misfit, Rounded

Route = tuple[str | int, ...]
"""Keys and indices from the root of a configuration."""


@dataclass(frozen=True, slots=True)
class Cell:
    """One register: its address as the vendor writes it and as a number, its raw value, and what it is."""

    address: str
    number: int
    value: int
    field: str
    loop: str | None = None

    @property
    def hex(self) -> str:
        """The word as four hexadecimal digits; BCD words read as their decimal digits."""
        return f"{self.value:04X}"


@dataclass(frozen=True, slots=True)
class Image:
    """A vendor's memory. ``settings``: one mapping a loop (names, ranges, units, mode); ``plc``: the same for the file."""

    vendor: str
    cells: tuple[Cell, ...]
    settings: tuple[Mapping[str, Any], ...] = ()
    plc: Mapping[str, Any] = field(default_factory=dict)

    @property
    def words(self) -> dict[int, int]:
        """Raw values by address."""
        return {cell.number: cell.value for cell in self.cells}


@dataclass(frozen=True, slots=True)
class Encoding:
    """An image, and what did not go in as written, each with its place in the configuration."""

    image: Image
    misfits: tuple[tuple[Route, Misfit], ...] = ()
    rounded: tuple[tuple[Route, Rounded], ...] = ()


@dataclass(frozen=True, slots=True)
class Decoded:
    """A configuration as plain data in the order of its file, and notes on what it could not carry."""

    data: dict[str, Any]
    notes: tuple[str, ...] = ()


def route(prefix: Route, path: str) -> Route:
    """A register's path below ``prefix``: ``setpoint.limits.0`` to ``(…, "setpoint", "limits", 0)``."""
    return (*prefix, *(int(p) if p.isdigit() else p for p in path.split(".")))
