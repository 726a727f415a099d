"""A stated Modbus map of a vendor whose parameters have names (`pidcfg.encoders.map_rows` reads its rows).

A row is for one parameter by its name, with whatever stands before it in the program (``PRG.TIC_1.Kp``), or, where
the vendor has devices, for a device and those of its type behind it (``D0``, ``M0``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.encoders.iec_registers import raw_of, types_of
from pidcfg.encoders.image import Cell
from pidcfg.encoders.map_rows import NONE, MapError, read_rows, shown
from pidcfg.encoders.modbus_map import places_of
from pidcfg.encoders.spaces import BIT, SINGLE, WORD
from pidcfg.refs import Decision
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pidcfg.encoders.map_rows import Row
    from pidcfg.encoders.modbus import Place
    from pidcfg.encoders.parameters import Content, Program
    from pidcfg.schemas.iec import IecType

D893 = Decision(
    893,
    "a map covers every setting of its loops, or says that no register has it",
    "A parameter with a value in the file that stands in the PLC's memory needs a row; `NAME,none` says that no "
    "register has it, and a note repeats that it was not compared. What is wired, a literal of the program without a "
    "device, an input of a function, and what runs need none.",
    "A comparison that leaves out a setting in silence calls two different PLCs alike.",
)
FEW = 5


class Point(NamedTuple):
    """A parameter that the memory of a PLC may hold."""

    name: str
    type: IecType
    loop: str | None = None
    needed: bool = False
    """A map must say where it is, or that it is nowhere."""
    literal: bool = False
    """A setting that stands in the program, unless a row says where else."""
    device: str = ""
    """Where it stands in the PLC, for vendors with devices."""


Device = tuple[str, int]
"""A bank, and the number in it."""


@dataclass(frozen=True, slots=True)
class Symbols:
    """What the rows of a vendor's map may name."""

    title: str
    """A parameter, ``an operand of DPIDE``."""
    points: Mapping[str, Point]
    """The parameters of a program, by name."""
    parameters: frozenset[str]
    """The names of all parameters that the vendor has: those of loops in other files are passed over."""
    device: Callable[[str], Device | None] = lambda _text: None
    """A device's bank, and its number there; None: it is none."""

    def point(self, symbol: str) -> Point | None:
        """The parameter that a symbol ends with."""
        parts = symbol.split(".")
        ends = (".".join(parts[i:]) for i in range(len(parts)))
        return next((self.points[end] for end in ends if end in self.points), None)

    def is_foreign(self, symbol: str) -> bool:
        """Whether a symbol is a parameter of another loop."""
        parts = symbol.split(".")
        return any(".".join(parts[i:]) in self.parameters for i in range(1, len(parts)))


@dataclass(frozen=True, slots=True)
class NamedNumbering:
    """Where a client finds the parameters of one program, by their names."""

    points: Mapping[str, Point]
    places: Mapping[str, Place]
    without: tuple[str, ...] = ()
    """Parameters that no register has, by the map."""
    literals: tuple[str, ...] = ()
    """Settings that stand in the program, and in no register."""

    def place(self, name: str) -> Place:
        """Where a parameter is; raises `LookupError` where no row says it."""
        if name not in self.places:
            raise LookupError(f"no row of the map says where {name} is")
        return self.places[name]

    def cells(self, program: Program) -> Iterator[tuple[Cell, Place]]:
        """The contents of a program as registers hold them."""
        for number, entry in enumerate(program.cells):
            place = self.places.get(entry.address)
            if place is None or isinstance(entry.raw, Wire):
                continue
            kind = BIT if entry.type.kind == "bool" else WORD if place.width == 1 else SINGLE
            yield Cell(entry.address, number, raw_of(entry.type, entry.raw), entry.field, entry.loop, kind), place


def read_symbol_map(text: str, symbols: Symbols) -> NamedNumbering:
    """A map as text for one program; raises `MapError` with the place of what cannot be read, or is missing."""
    rows = read_rows(text)
    single: dict[str, Row] = {}
    banks: list[tuple[Device, Row]] = []
    for row in rows:
        device = symbols.device(row.symbol)
        point = symbols.point(row.symbol)
        if device is not None and point is None:
            same = [other for start, other in banks if start == device]
            _refuse_again(row, [other for other in same if other.type == row.type])
            _refuse_apart(row, same)
            banks.append((device, _of_device(row, symbols)))
        elif point is not None:
            _refuse_again(row, [single[point.name]] if point.name in single else [])
            single[point.name] = _of_point(row, point)
        elif not symbols.is_foreign(row.symbol):
            near = nearest(row.symbol, symbols.points)
            cure = f"did you mean {near}?" if near else "write the name of a parameter"
            raise row.wrong("symbol", f"{row.symbol!r} is not {symbols.title}; {cure}")
    return _numbering(symbols, single, banks, rows[-1].line)


def _refuse_again(row: Row, others: list[Row]) -> None:
    if others:
        raise row.wrong("symbol", f"{row.symbol} stands here again; first in line {others[0].line}")


def _refuse_apart(row: Row, others: list[Row]) -> None:
    """A device is in one place, whatever the type of what stands there."""
    here = (row.table, row.register, row.bit)
    for other in others:
        if (other.table, other.register, other.bit) != here:
            place = f"{other.table} {other.register}"
            raise row.wrong("register", f"{row.symbol} is at {place} by line {other.line}, and cannot be elsewhere")


def _of_point(row: Row, point: Point) -> Row:
    known = types_of(point.type)
    if row.table != NONE and row.type not in known:
        fits = f"{' or '.join(known)}, not {row.type}" if known else "no type of a map fits it"
        raise row.wrong("type", f"{point.name} is {point.type.name}: {fits}")
    return row


def _of_device(row: Row, symbols: Symbols) -> Row:
    here = [point for point in symbols.points.values() if point.device == row.symbol]
    if row.table == NONE:
        cure = f"; write {here[0].name},{NONE}" if here else ""
        raise row.wrong("table", f"{row.symbol} begins a bank{cure}")
    for point in here:
        if row.type not in types_of(point.type):
            fits = " or ".join(types_of(point.type))
            message = f"{row.symbol} is {point.name} of type {point.type.name}: {fits}, not {row.type}"
            raise row.wrong("type", message)
    return row


def _numbering(
    symbols: Symbols, single: Mapping[str, Row], banks: list[tuple[Device, Row]], last: int
) -> NamedNumbering:
    """The places of all parameters that rows cover; what is missing, or stands twice, is refused."""
    places: dict[str, Place] = {}
    lines: dict[str, Row] = {}
    for point in symbols.points.values():
        row, steps = single.get(point.name), 0
        device = symbols.device(point.device)
        if row is None and device is not None:
            start, row = _bank_row(point, device, banks)
            steps = device[1] - start
        if row is None or row.table == NONE:
            continue
        try:
            places[point.name] = row.place(steps)
        except LookupError as error:
            raise row.wrong("register", f"{_named(point)} would be at {error}") from None
        lines[point.name] = row
    without = tuple(name for name, row in single.items() if row.table == NONE)
    missing = [p for p in symbols.points.values() if p.needed and p.name not in places and p.name not in without]
    if missing:
        raise MapError(_gap(missing), last)
    _refuse_overlaps(symbols, places, lines)
    literals = (point.name for point in symbols.points.values() if point.literal and point.name not in places)
    return NamedNumbering(symbols.points, places, without, tuple(name for name in literals if name not in without))


def _bank_row(point: Point, device: Device, banks: list[tuple[Device, Row]]) -> tuple[int, Row | None]:
    """The row that a device is behind, of its bank and its type: the nearest one."""
    bank, number = device
    behind = [
        (start, row)
        for (of, start), row in banks
        if of == bank and start <= number and row.type in types_of(point.type)
    ]
    return max(behind, key=lambda entry: entry[0], default=(0, None))


def _named(point: Point) -> str:
    return f"{point.device} ({point.name})" if point.device else point.name


def _gap(missing: list[Point]) -> str:
    names = ", ".join(_named(point) for point in missing[:FEW])
    more = f" and {len(missing) - FEW} more" if len(missing) > FEW else ""
    line = row_text(missing[0], register="REGISTER")
    return f"no row says where {names}{more} is; add {line}, or {missing[0].name},{NONE} where no register has it"


def _refuse_overlaps(symbols: Symbols, places: Mapping[str, Place], lines: Mapping[str, Row]) -> None:
    seen: dict[tuple[str, int, int], str] = {}
    for name, place in places.items():
        for taken in places_of(place):
            other = seen.setdefault(taken, name)
            one, two = symbols.points[other], symbols.points[name]
            if other != name and not (one.device and one.device == two.device):
                rows = sorted((lines[other], lines[name]), key=lambda row: row.line)
                message = f"{_named(one)} and {_named(two)} are both at {shown(place)}"
                by = f"by lines {rows[0].line} and {rows[1].line}"
                raise rows[1].wrong("register", f"{message} {by}; each needs a place of its own")


def row_text(point: Point, register: str = "", symbol: str = "") -> str:
    """A row of a map for a parameter; without ``register`` it is left to the user."""
    kind = types_of(point.type)[0]
    table = "coil" if kind == "bool" else "holding"
    order = ",low-first" if kind in {"float32", "int32", "uint32"} else ""
    return f"{symbol or point.device or point.name},{table},{register},{kind}{order}"


def with_contents(program: Program, contents: Mapping[str, Content]) -> Program:
    """A program with other contents of some of its parameters."""
    cells = (cell._replace(raw=contents.get(cell.address, cell.raw)) for cell in program.cells)
    return replace(program, cells=tuple(cells))
