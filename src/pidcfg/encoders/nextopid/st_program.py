"""A NextoPID program as a programming system holds it: variables, and calls in the order of execution.

Design. `Unit` rebuilds wiring and execution order from the listing. Functions have no instance, so their outputs, and
those of their inputs that something reads, become variables with new names. The comment of each such variable says
which parameter it is, ``SEL.MV``; the readers of Structured Text and PLCopen XML rely on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.files import UnwritableError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.moves import MoveError, read_moves
from pidcfg.encoders.nextopid.wiring import Layout, Wires
from pidcfg.schemas.expressions import ExpressionError
from pidcfg.schemas.iec import AUTOTUNE_MODE, Wire
from pidcfg.schemas.nextopid import Move, Plc

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.maps.nextopid import BlockType
    from pidcfg.encoders.nextopid.moves import Copy
    from pidcfg.encoders.nextopid.wiring import Instance
    from pidcfg.encoders.parameters import Content, Entry, Parameter, Program
    from pidcfg.schemas.iec import IecType

CONVERSIONS = (
    "INT_TO_REAL",
    "UINT_TO_REAL",
    "USINT_TO_REAL",
    "DINT_TO_REAL",
    "TIME_TO_REAL",
    "REAL_TO_INT",
    "REAL_TO_UINT",
)
RESERVED = frozenset(name.upper() for name in (*BLOCK_TYPES, *CONVERSIONS, AUTOTUNE_MODE.name, *AUTOTUNE_MODE.words))
"""Names that a variable cannot have, in capitals: IEC 61131-3 ignores case."""
UINT_CYCLES = 0xFFFF


class Variable(NamedTuple):
    """A variable of the program: initial values of an instance by parameter, members of a structure with a dot."""

    name: str
    type: str
    initial: Mapping[str, tuple[IecType, Content]] | tuple[IecType, Content] | None = None
    note: str = ""


def is_kept(kind: BlockType, row: Parameter) -> bool:
    """Whether a parameter is declared even when it has its default value."""
    field = kind.model.model_fields.get(row.name)
    return field is None or field.is_required() or field.default is None


@dataclass(frozen=True)
class Unit:
    """The variables and calls of a program; raises `UnwritableError` for what Structured Text cannot hold."""

    image: Program

    @cached_property
    def signals(self) -> dict[str, Entry]:
        """Values from outside."""
        return {cell.address: cell for cell in self.image.cells if "." not in cell.address}

    @cached_property
    def layout(self) -> Layout:
        """Names, numbers and types."""
        types = {name: cell.type for name, cell in self.signals.items()}
        blocks = [(entry.get("loop") or entry["block"], BLOCK_TYPES[entry["type"]]) for entry in self.image.settings]
        seen: dict[str, str] = {}
        names = [*types, *(name for name, _ in blocks)]
        for name in names:
            other = seen.setdefault(name.upper(), name)
            if other != name or name.upper() in RESERVED or names.count(name) > 1:
                also = "of a type or function of the library" if name.upper() in RESERVED else f"of another ({other})"
                raise UnwritableError(f"{name}: Structured Text takes the name for that {also}; rename it")
        return Layout.of(types, blocks)

    @cached_property
    def wires(self) -> Wires:
        """What every wire means."""
        numbers = {block.name: i for i, block in enumerate(self.layout.instances)}
        wires: Wires = {}
        for cell in self.image.cells:
            owner, _, row = cell.address.partition(".")
            if isinstance(cell.raw, Wire):
                try:
                    wires[numbers[owner], row] = self.layout.read(cell.type, cell.raw.text)
                except ExpressionError as error:
                    raise UnwritableError(f"{cell.address}: {error.message}") from None
        return wires

    @cached_property
    def copies(self) -> list[Copy]:
        """What the program copies, in order."""
        wired = {cell.address for cell in self.image.cells if isinstance(cell.raw, Wire)}
        moves = [Move.model_validate(entry) for entry in self.image.plc.get("moves", ())]
        try:
            return read_moves(self.layout, moves, wired, self.cells)
        except MoveError as error:
            raise UnwritableError(f"moves: {error}") from None

    @cached_property
    def order(self) -> list[int]:
        """Instances in the order of execution."""
        return self.layout.order(self.wires)

    @property
    def program(self) -> str:
        """Name of the program."""
        return str(self.image.plc.get("program") or Plc.model_fields["program"].default)

    # --- names -------------------------------------------------------------------------------------------------------

    @property
    def names(self) -> dict[int, str]:
        """The name of every value in the program, by its number."""
        return self._names_and_counters[0]

    @property
    def counters(self) -> dict[int, tuple[str, int]]:
        """Cycle counters of loops that are not called in every cycle: the variable, and the number of cycles."""
        return self._names_and_counters[1]

    @cached_property
    def _names_and_counters(self) -> tuple[dict[int, str], dict[int, tuple[str, int]]]:
        used = {
            name.upper() for name in (*self.signals, *(block.name for block in self.layout.instances), self.program)
        }
        used |= RESERVED
        names = {number: name for name, number in self.layout.numbers.items()}
        for block in self.layout.instances:
            for offset, row in enumerate(block.kind.table.rows if block.kind.function else ()):
                if row.access == "output" or block.base + offset in self.read:
                    names[block.base + offset] = unused_name(f"{block.name}_{row.name}", used)
        counters = {}
        for i, entry in enumerate(self.image.settings):
            cycles = cycles_of(entry, self.image.plc)
            if cycles != 1:
                counters[i] = (unused_name(f"{self.layout.instances[i].name}_Cycle", used), cycles)
        return names, counters

    @cached_property
    def read(self) -> frozenset[int]:
        """Numbers of all that some wire or move reads."""
        moved = (part.signals for copy in self.copies for part in (copy.value, copy.when) if part is not None)
        return frozenset(chain.from_iterable((*(wire.signals for wire in self.wires.values()), *moved)))

    def type_of(self, number: int) -> IecType:
        """The type of a value."""
        owner = self.layout.owner(number)
        if owner is None:
            return list(self.layout.signals.values())[number]
        block = self.layout.instances[owner]
        return block.kind.table.rows[number - block.base].type

    def full_name(self, number: int) -> str:
        """The name of a value in a configuration: ``SEL.MV``."""
        owner = self.layout.owner(number)
        if owner is None:
            return list(self.layout.signals)[number]
        block = self.layout.instances[owner]
        return f"{block.name}.{block.kind.table.rows[number - block.base].name}"

    # --- cycles ------------------------------------------------------------------------------------------------------

    def previous(self, i: int) -> list[str]:
        """Values of the previous cycle that the call of a block reads."""
        late = []
        for number in sorted(self._reads.get(i, ())):
            owner = self.layout.owner(number)
            if owner is not None and self._place[owner] >= self._place[i] and self._is_changed(owner, number):
                late.append(self.full_name(number))
        return late

    def _is_changed(self, owner: int, number: int) -> bool:
        """Whether the call of a block changes one of its values: an output, or a wired input."""
        block = self.layout.instances[owner]
        name = block.kind.table.rows[number - block.base].name
        return not self.layout.is_input(number) or (owner, name) in self.wires

    @cached_property
    def _place(self) -> dict[int, int]:
        return {number: at for at, number in enumerate(self.order)}

    @cached_property
    def _reads(self) -> dict[int, set[int]]:
        """Numbers that each block reads."""
        reads: dict[int, set[int]] = {}
        for (i, _), wire in self.wires.items():
            reads.setdefault(i, set()).update(wire.signals)
        return reads

    # --- variables ---------------------------------------------------------------------------------------------------

    def variables(self) -> Iterator[Variable]:
        """All declarations: signals, instances and variables of functions in the order of the file, counters."""
        for name, cell in self.signals.items():
            yield Variable(name, cell.type.name, (cell.type, content(cell)))
        for block in self.layout.instances:
            if block.kind.function:
                yield from self._function_variables(block)
            else:
                yield Variable(block.name, block.kind.name, self.initial(block) or None)
        for name, cycles in self.counters.values():
            yield Variable(name, "UINT" if cycles <= UINT_CYCLES else "UDINT")

    def _function_variables(self, block: Instance) -> Iterator[Variable]:
        for offset, row in enumerate(block.kind.table.rows):
            full = f"{block.name}.{row.name}"
            if row.access == "output":
                yield Variable(self.names[block.base + offset], row.type.name, None, full)
            elif block.base + offset in self.read:
                cell = self.cells.get(full)
                fixed = cell is not None and not isinstance(cell.raw, Wire)
                initial = (row.type, content(cell)) if cell is not None and fixed else None
                yield Variable(self.names[block.base + offset], row.type.name, initial, full)

    @cached_property
    def cells(self) -> dict[str, Entry]:
        """All parameters by their full names."""
        return {cell.address: cell for cell in self.image.cells}

    def initial(self, block: Instance) -> dict[str, tuple[IecType, Content]]:
        """Initial values of an instance: required parameters, and those that differ from the default of their type."""
        values = {}
        for row in block.kind.inputs:
            cell = self.cells.get(f"{block.name}.{row.name}")
            if cell is None or isinstance(cell.raw, Wire):
                continue
            if is_kept(block.kind, row) or cell.raw != row.type.default:
                values[row.name] = (row.type, content(cell))
        return values


def unused_name(wanted: str, used: set[str]) -> str:
    """The wanted name or one with a number after it; it is then in use."""
    name, number = wanted, 1
    while name.upper() in used:
        name, number = f"{wanted}_{number}", number + 1
    used.add(name.upper())
    return name


def content(cell: Entry) -> Content:
    """The text of a wire, or the content of a parameter that is not wired."""
    return cell.raw.text if isinstance(cell.raw, Wire) else cell.raw


def cycles_of(entry: Mapping[str, Any], plc: Mapping[str, Any]) -> int:
    """The interval of a loop in cycles of the task; raises `UnwritableError` where it is no multiple."""
    interval, task = entry.get("sample_time"), plc.get("sample_time")
    if interval is None:
        return 1
    times = [Decimal(str(time)) for time in (interval, task or 0)]
    if times[1] <= 0 or times[0] <= 0 or times[0] % times[1]:
        name = entry.get("loop") or entry.get("block")
        raise UnwritableError(f"{name}: {interval} s is no whole number of cycles of the task, {task} s")
    return int(times[0] / times[1])
