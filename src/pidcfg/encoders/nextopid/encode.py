"""A NextoPID configuration to its program: every parameter with its type, and its content or its wire."""

from __future__ import annotations

from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.mapping import file_data
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.moves import Copy, MoveError, entry_of, read_move
from pidcfg.encoders.nextopid.wiring import PASSES, Layout, Wires
from pidcfg.encoders.parameters import Entry, Parameter, Program, stored
from pidcfg.encoders.regmap import Misfit
from pidcfg.encoders.values import plain, present
from pidcfg.encoders.words import EncodeError
from pidcfg.frozen import frozen
from pidcfg.paths import steps, value_at
from pidcfg.schemas.expressions import ExpressionError
from pidcfg.schemas.iec import BOOL, REAL, Wire, signal_type
from pidcfg.schemas.nextopid import Controller, Plc
from pidcfg.schemas.numbers import plain_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.maps.nextopid import BlockType
    from pidcfg.encoders.parameters import Content
    from pidcfg.encoders.regmap import Rounded
    from pidcfg.paths import Path
    from pidcfg.schemas.nextopid import Item, NextopidFile


class WireError(EncodeError):
    """A wire that means nothing: what is wrong at which character, and the cure."""

    def __init__(self, error: ExpressionError) -> None:
        super().__init__("form", error.message)
        self.fault = "wire"
        self.offset, self.cure = error.offset, error.cure


@frozen
class Placed:
    """A block of the configuration, with its place in the file."""

    place: Path
    item: Item
    kind: BlockType

    @property
    def is_loop(self) -> bool:
        """Whether it stands among the loops."""
        return self.place[0] == "loops"

    def is_no_delay(self, sample_time: Decimal) -> bool:
        """Whether it is a delay of no whole sample."""
        time = getattr(self.item, "DelayTime", None)
        return self.kind.name == "ControlDelay" and isinstance(time, Decimal) and 2 * time <= sample_time

    def given(self) -> Iterator[tuple[Parameter, Any]]:
        """Its inputs with what the file says or the default is; those that are left to the program around have none."""
        for row in self.kind.inputs:
            value = value_at(self.item, steps(row.name))
            if value is not None:
                yield row, f"AUTOTUNE_{value}" if row.type.kind == "word" else value


def placed(config: NextopidFile) -> list[Placed]:
    """All blocks in the order of the file, blocks before loops."""
    blocks = [(("blocks", i), item) for i, item in enumerate(config.blocks)]
    both = [*blocks, *((("loops", i), item) for i, item in enumerate(config.loops))]
    return [Placed(place, cast("Item", item), BLOCK_TYPES[item.type]) for place, item in both]


@frozen
class NextopidEncoding:
    """The program of a configuration, how it is wired, and what did not go in as written."""

    image: Program
    items: tuple[Placed, ...]
    layout: Layout
    wires: Wires
    sample_time: Decimal
    """Interval of the task in s."""
    misfits: tuple[tuple[Path, Misfit], ...]
    rounded: tuple[tuple[Path, Rounded], ...] = ()
    copies: tuple[Copy | None, ...] = ()
    """The moves in the order of the file; None: one that means nothing."""

    @property
    def whole(self) -> bool:
        """Whether every value has a parameter that can hold it."""
        return not self.misfits

    @property
    def rings(self) -> list[list[int]]:
        """Numbers of items that form a ring without a delay."""
        passing = {
            i for i, block in enumerate(self.items) if block.kind.name in PASSES or block.is_no_delay(self.sample_time)
        }
        return list(self.layout.rings(self.wires, passing))

    @cached_property
    def order(self) -> list[int]:
        """Numbers of the items in the order of execution."""
        return self.layout.order(self.wires)


def encode(config: NextopidFile) -> NextopidEncoding:
    """Every signal and parameter; what cannot be stored or wired is a misfit at its place."""
    items = placed(config)
    types = {name: signal_type(value) for name, value in config.signals.items()}
    layout = Layout.of(types, [(block.item.name, block.kind) for block in items])
    misfits: list[tuple[Path, Misfit]] = []
    wires: Wires = {}
    entries = []
    for name, value in config.signals.items():
        content, misfit = stored(Parameter(name, types[name]), value)
        misfits += [] if misfit is None else [(("signals", name), misfit)]
        entries.append(Entry(name, types[name], content, name))
    for i, block in enumerate(items):
        for row, value in block.given():
            place = (*block.place, *steps(row.name))
            raw: Content | Wire = value
            if isinstance(value, Wire):
                misfit = _wire(layout, wires, (i, row), value)
            else:
                raw, misfit = stored(row, value)
            misfits += [] if misfit is None else [(place, misfit)]
            entries.append(
                Entry(
                    f"{block.item.name}.{row.name}", row.type, raw, row.name, block.item.name if block.is_loop else None
                )
            )
    misfits += _wires_to_itself(layout, wires, items)
    copies, wrong = _copies(config, layout, entries)
    misfits += wrong
    settings = tuple(_settings(block) for block in items)
    image = Program("nextopid", tuple(entries), settings, _plc_settings(config))
    return NextopidEncoding(image, tuple(items), layout, wires, config.plc.sample_time, tuple(misfits), copies=copies)


def _wire(layout: Layout, wires: Wires, key: tuple[int, Parameter], wire: Wire) -> Misfit | None:
    i, row = key
    try:
        wires[i, row.name] = layout.read(row.type, wire.text)
    except ExpressionError as error:
        return Misfit(row.name, row, wire.text, WireError(error))
    return None


def _wires_to_itself(layout: Layout, wires: Wires, items: list[Placed]) -> Iterator[tuple[Path, Misfit]]:
    """Wires that read an input of their own block which is wired itself (D205)."""
    for (i, name), expression in wires.items():
        instance = layout.instances[i]
        for number in sorted(expression.signals):
            row = instance.kind.table.rows[number - instance.base] if layout.owner(number) == i else None
            if row is not None and (i, row.name) in wires:
                text, full = expression.text, f"{instance.name}.{row.name}"
                cure = f"write what {full} is wired to in its place"
                error = ExpressionError(f"{full} is wired itself and of the same call", max(text.find(full), 0), cure)
                yield (*items[i].place, name), Misfit(name, instance.kind.table.row(name), text, WireError(error))


def _copies(
    config: NextopidFile, layout: Layout, entries: list[Entry]
) -> tuple[tuple[Copy | None, ...], list[tuple[Path, Misfit]]]:
    """The moves, and those that mean nothing."""
    wired = {entry.address for entry in entries if isinstance(entry.raw, Wire)}
    given = {entry.address for entry in entries}
    copies: list[Copy | None] = []
    misfits: list[tuple[Path, Misfit]] = []
    for i, move in enumerate(config.moves):
        try:
            copies.append(read_move(layout, move, wired, given))
        except MoveError as error:
            copies.append(None)
            written = getattr(move, error.key)
            row = Parameter(error.key, BOOL if error.key == "when" else REAL)
            text = written.text if isinstance(written, Wire) else str(written)
            misfits.append((("moves", i, error.key), Misfit(error.key, row, text, WireError(error.error))))
    return tuple(copies), misfits


def _settings(block: Placed) -> dict[str, Any]:
    """What no parameter says of a block: its type, and what is for people and reports."""
    entry: dict[str, Any] = {"loop" if block.is_loop else "block": block.item.name, "type": block.kind.name}
    entry |= present({"description": block.item.description})
    if not isinstance(block.item, Controller):
        return entry
    pv, output = block.item.pv, block.item.output
    return entry | present(
        {
            "sample_time": plain(block.item.sample_time),
            "pv": file_data(type(pv), dict(pv)) or None,
            "output": file_data(type(output), dict(output)) or None,
        }
    )


def _plc_settings(config: NextopidFile) -> dict[str, Any]:
    program = config.plc.program
    return present(
        {
            "name": config.name,
            "description": config.description,
            "sample_time": plain_number(config.plc.sample_time),
            "moves": [entry_of(move) for move in config.moves] or None,
            "program": None if program == Plc.model_fields["program"].default else program,
            "map": config.plc.map,
        }
    )
