"""A NextoPID configuration to its program and back: parameters, moves beside the calls, memory, gains."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from decimal import Decimal
from functools import cached_property
from itertools import product
from math import expm1
from typing import Any, NamedTuple

from pydantic import ConfigDict

from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.encoders.image import Decoded, RefusedError, Settings, file_data, file_value, read_settings, without_none
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES, TUNING_NUMBERS, BlockType
from pidcfg.encoders.nextopid.wiring import PASSING_BLOCKS, Layout, Wires
from pidcfg.encoders.parameters import (
    Content,
    Entry,
    NamedEncoding,
    Parameter,
    Program,
    read_content,
    store_content,
    store_value,
)
from pidcfg.encoders.regmap import LoopTuning, Misfit, Rounded
from pidcfg.schemas.base import Integer, MapFile, Model, Seconds, SectionSettings, Text
from pidcfg.schemas.expressions import NOT, Expression, ExpressionError
from pidcfg.schemas.expressions import SIGNAL as SIGNAL_CODE
from pidcfg.schemas.iec import BOOL, REAL, Identifier, IecType, Wire, real_text, signal_type
from pidcfg.schemas.nextopid import Block, Controller, Item, Loop, Move, NextopidFile, OutputText, Pida, Plc, PvText
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Data, Path, parse_path, set_value, value_at
from pidcfg.text.references import Decision
from pidcfg.text.signs import closest_name

# --- What a program copies beside the calls of its blocks: the MOVE instructions of figures 4-6 and 16-1 --------------
#
# Design. A move writes a signal, or an input of a block that nothing is wired to, where its condition holds: before
# the first call of a cycle or behind the last one, one after the other in the order of the file. It is read against
# the `Layout` as wires are. In a listing the moves stand beside the parameters, with the settings of the PLC; in a
# program they are assignments, most of them inside IF.

D551 = Decision(
    551,
    "moves are executed before all blocks, or behind all of them",
    "`at: start` is before the first call of a cycle, `at: end`, which is the default, behind the last; moves of one "
    "place are executed in the order of the file, and each sees what the one before has written. A move whose "
    "condition or value cannot be worked out writes nothing.",
    "Figure 16-1 has its MOVE instructions below the blocks. Between two blocks there is no place of its own: the "
    "order of the blocks follows from their wires.",
)


class Copy(NamedTuple):
    """A move as it is executed: into which number of which type, when, and what."""

    target: int
    type: IecType
    value: Expression
    when: Expression | None
    """None: in every cycle."""
    at_start: bool
    literal_content: Content | None
    """The value, where it is no expression."""


class MoveError(Exception):
    """A move that means nothing: the key at fault, and what is wrong there."""

    def __init__(self, key: str, error: ExpressionError) -> None:
        super().__init__(f"{key}: {error.message}")
        self.key, self.error = key, error


def read_move(layout: Layout, move: Move, wired_names: Collection[str], given_names: Collection[str]) -> Copy:
    """What a move means; ``wired_names``: parameters that have a wire, ``given_names``: those in the file."""
    target = _target_number(layout, move.to, wired_names, given_names)
    kind, literal = layout.types[move.to], None
    try:
        if not isinstance(move.move, Wire):
            literal = _stored_content(move, kind)
        text = move.move.text if isinstance(move.move, Wire) else _content_text(literal)
        value = layout.read_wire(kind, text)
    except (ExpressionError, EncodeError) as error:
        raise MoveError("move", _expression_error(error)) from None
    try:
        when = None if move.when is True else layout.read_wire(BOOL, _when_text(move))
    except ExpressionError as error:
        raise MoveError("when", error) from None
    if when is None and move.at == "start" and layout.owner_of(target) is not None:
        message = f"{move.to} is written before every call, which is what a wire does"
        raise MoveError("to", ExpressionError(message, 0, f"wire it: {move.to.partition('.')[2]}: {text}"))
    return Copy(target, kind, value, when, move.at == "start", literal)


def _stored_content(move: Move, kind: IecType) -> Content:
    """What a target of this type holds of a value."""
    value = str(move.move).upper()
    if isinstance(move.move, Wire) or isinstance(move.move, bool) != (kind.kind == "bool"):
        raise ExpressionError(f"{move.to} is {kind.name}, and {value} is none", 0, "write a value of its type")
    return store_content(kind, move.move)


def _content_text(content: Content | None) -> str:
    """A content as an expression."""
    return str(content).upper() if isinstance(content, bool) else real_text(float(content or 0))


def _when_text(move: Move) -> str:
    return move.when.text if isinstance(move.when, Wire) else "FALSE"


def _expression_error(error: Exception) -> ExpressionError:
    return error if isinstance(error, ExpressionError) else ExpressionError(str(error), 0, "write a value of its type")


def _target_number(layout: Layout, name: str, wired_names: Collection[str], given_names: Collection[str]) -> int:
    """The number of what is written; refuses what another one writes."""
    problem = cure = ""
    number = layout.numbers.get(name)
    owner = None if number is None else layout.owner_of(number)
    if number is None:
        near = closest_name(name, [*layout.numbers])
        problem = f"{name!r} is no declared signal, and no parameter of a block"
        cure = f"did you mean {near!r}?" if near else "declare it among the signals"
    elif layout.types[name].kind not in {"bool", "real", "whole"}:
        problem, cure = f"{name} is {layout.types[name].name}", "numbers and BOOLs can be moved"
    elif owner is not None and not layout.is_input(number):
        problem, cure = f"{name} is an output of its block", "move it to a signal, or to an input"
    elif owner is not None and layout.instances[owner].kind.function:
        kind = layout.instances[owner].kind.name
        problem, cure = f"{name}: {kind} is a function, which keeps nothing", "wire it to a signal, and move there"
    elif name in wired_names:
        problem, cure = f"{name} is wired, and its wire writes it at every call", "move to what it is wired to"
    elif owner is not None and name not in given_names and _is_open(layout.instances[owner].kind.name, name):
        problem, cure = f"{name} is left to the program around", "wire it to a signal, and move there"
    if problem or number is None:
        raise MoveError("to", ExpressionError(problem, 0, cure))
    return number


def _is_open(kind: str, name: str) -> bool:
    """Whether an input that is not given is one that the program around assigns."""
    field = BLOCK_TYPES[kind].model.model_fields.get(name.partition(".")[2])
    return field is not None and field.default is None and not field.is_required()


def read_moves(
    layout: Layout, moves: Iterable[Move], wired_names: Collection[str], given_names: Collection[str]
) -> list[Copy]:
    """All moves of a listing, in the order of execution; raises `MoveError` for one that means nothing."""
    copies = [read_move(layout, move, wired_names, given_names) for move in moves]
    return sorted(copies, key=lambda copy: not copy.at_start)


def entry_of(move: Move) -> dict[str, object]:
    """A move as it stands beside the parameters of a listing."""
    value = move.move.text if isinstance(move.move, Wire) else file_value(move.move)
    entry: Data = {"move": value, "to": move.to}
    if move.when is not True:
        entry["when"] = move.when.text if isinstance(move.when, Wire) else move.when
    return entry | ({"at": move.at} if move.at == "start" else {})


# --- A NextoPID configuration to its program: every parameter with its type, and its content or its wire --------------


class WireError(EncodeError):
    """A wire that means nothing: what is wrong at which character, and the cure."""

    def __init__(self, error: ExpressionError) -> None:
        super().__init__("form", error.message)
        self.fault = "wire"
        self.offset, self.cure = error.offset, error.cure


@frozen
class PlacedBlock:
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

    def given_inputs(self) -> Iterator[tuple[Parameter, Any]]:
        """Its inputs with what the file says or the default is; those that are left to the program around have none."""
        for row in self.kind.inputs:
            value = value_at(self.item, parse_path(row.name))
            if value is not None:
                yield row, f"AUTOTUNE_{value}" if row.type.kind == "word" else value


def place_blocks(config: NextopidFile) -> list[PlacedBlock]:
    """All blocks in the order of the file, blocks before loops."""
    items: list[tuple[Path, Block | Loop]] = [(("blocks", i), item) for i, item in enumerate(config.blocks)]
    items += [(("loops", i), item) for i, item in enumerate(config.loops)]
    return [PlacedBlock(place, item, BLOCK_TYPES[item.type]) for place, item in items]


@frozen
class NextopidEncoding(NamedEncoding):
    """The program of a configuration, how it is wired, and what did not go in as written."""

    image: Program
    items: tuple[PlacedBlock, ...]
    layout: Layout
    wires: Wires
    sample_time: Decimal
    """Interval of the task in s."""
    misfits: tuple[tuple[Path, Misfit], ...]
    rounded: tuple[tuple[Path, Rounded], ...] = ()
    copies: tuple[Copy | None, ...] = ()
    """The moves in the order of the file; None: one that means nothing."""

    @property
    def rings(self) -> list[list[int]]:
        """Numbers of items that form a ring without a delay."""
        passing = {
            i
            for i, block in enumerate(self.items)
            if block.kind.name in PASSING_BLOCKS or block.is_no_delay(self.sample_time)
        }
        return list(self.layout.find_rings(self.wires, passing))

    @cached_property
    def order(self) -> list[int]:
        """Numbers of the items in the order of execution."""
        return self.layout.execution_order(self.wires)

    @cached_property
    def moves_behind(self) -> dict[tuple[Code, Code, int], int]:
        """The moves that are executed behind the blocks by condition, value and target; the first of equal ones."""
        moves: dict[tuple[Code, Code, int], int] = {}
        for number, copy in enumerate(self.copies):
            if copy is not None and copy.when is not None and not copy.at_start:
                moves.setdefault((_code_of(copy.when), _code_of(copy.value), copy.target), number)
        return moves


def encode(config: NextopidFile) -> NextopidEncoding:
    """Every signal and parameter; what cannot be stored or wired is a misfit at its place."""
    items = place_blocks(config)
    types = {name: signal_type(value) for name, value in config.signals.items()}
    layout = Layout.of(types, [(block.item.name, block.kind) for block in items])
    misfits: list[tuple[Path, Misfit]] = []
    wires: Wires = {}
    entries = []
    for name, value in config.signals.items():
        content, misfit = store_value(Parameter(name, types[name]), value)
        misfits += [] if misfit is None else [(("signals", name), misfit)]
        entries.append(Entry(name, types[name], content, name))
    for i, block in enumerate(items):
        for row, value in block.given_inputs():
            place = (*block.place, *parse_path(row.name))
            raw: Content | Wire = value
            if isinstance(value, Wire):
                misfit = _read_wire(layout, wires, (i, row), value)
            else:
                raw, misfit = store_value(row, value)
            misfits += [] if misfit is None else [(place, misfit)]
            entries.append(
                Entry(
                    f"{block.item.name}.{row.name}", row.type, raw, row.name, block.item.name if block.is_loop else None
                )
            )
    misfits += _wires_to_itself(layout, wires, items)
    copies, move_misfits = _read_copies(config, layout, entries)
    misfits += move_misfits
    settings = tuple(_block_settings(block) for block in items)
    image = Program("nextopid", tuple(entries), settings, _plc_settings(config))
    return NextopidEncoding(image, tuple(items), layout, wires, config.plc.sample_time, tuple(misfits), copies=copies)


def _read_wire(layout: Layout, wires: Wires, key: tuple[int, Parameter], wire: Wire) -> Misfit | None:
    i, row = key
    try:
        wires[i, row.name] = layout.read_wire(row.type, wire.text)
    except ExpressionError as error:
        return Misfit(row.name, row, wire.text, WireError(error))
    return None


def _wires_to_itself(layout: Layout, wires: Wires, items: list[PlacedBlock]) -> Iterator[tuple[Path, Misfit]]:
    """Wires that read an input of their own block which is wired itself (D205)."""
    for (i, name), expression in wires.items():
        instance = layout.instances[i]
        for number in sorted(expression.signals):
            row = instance.kind.table.rows[number - instance.base] if layout.owner_of(number) == i else None
            if row is not None and (i, row.name) in wires:
                text, full = expression.text, f"{instance.name}.{row.name}"
                cure = f"write what {full} is wired to in its place"
                error = ExpressionError(f"{full} is wired itself and of the same call", text.find(full), cure)
                yield (
                    (*items[i].place, name),
                    Misfit(name, instance.kind.table.find_parameter(name), text, WireError(error)),
                )


def _read_copies(
    config: NextopidFile, layout: Layout, entries: list[Entry]
) -> tuple[tuple[Copy | None, ...], list[tuple[Path, Misfit]]]:
    """The moves, and those that mean nothing."""
    wired_names = {entry.address for entry in entries if isinstance(entry.raw, Wire)}
    given_names = {entry.address for entry in entries}
    copies: list[Copy | None] = []
    misfits: list[tuple[Path, Misfit]] = []
    for i, move in enumerate(config.moves):
        try:
            copies.append(read_move(layout, move, wired_names, given_names))
        except MoveError as error:
            copies.append(None)
            move_value = getattr(move, error.key)
            text = move_value.text if isinstance(move_value, Wire) else str(move_value)
            place = Parameter(error.key, REAL)
            misfits.append((("moves", i, error.key), Misfit(error.key, place, text, WireError(error.error))))
    return tuple(copies), misfits


def _block_settings(block: PlacedBlock) -> dict[str, object]:
    """What no parameter says of a block: its type, and what is for people and reports."""
    entry: Data = {"loop" if block.is_loop else "block": block.item.name, "type": block.kind.name}
    entry |= without_none({"description": block.item.description})
    if not isinstance(block.item, Controller):
        return entry
    pv, output = block.item.pv, block.item.output
    return entry | without_none(
        {
            "sample_time": file_value(block.item.sample_time),
            "pv": file_data(type(pv), dict(pv)) or None,
            "output": file_data(type(output), dict(output)) or None,
        }
    )


def _plc_settings(config: NextopidFile) -> dict[str, object]:
    program = config.plc.program
    return without_none(
        {
            "name": config.name,
            "description": config.description,
            "sample_time": plain_number(config.plc.sample_time),
            "moves": [entry_of(move) for move in config.moves] or None,
            "program": None if program == Plc.model_fields["program"].default else program,
            "map": config.plc.map,
        }
    )


# --- A NextoPID program back to a configuration -----------------------------------------------------------------------
#
# Which block a name is of stands beside the parameters, in the settings or in the declarations of a program.
# Everything that is a default is left out, so that encoding the result again gives the same program.

REQUIRED_REASON = "required"


class ItemSettings(Model):
    """What stands beside the parameters of one block."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    loop: Identifier | None = None
    """Name of a controller."""
    block: Identifier | None = None
    """Name of another block or function."""
    type: str
    """Its type."""
    description: Text | None = None
    """What it does."""
    sample_time: Seconds | None = None
    """Interval of a loop's calls in s."""
    cycles: Integer | None = None
    """The same in cycles of the task, where a program does not say how long they are."""
    pv: PvText = PvText()
    """Unit of the PV."""
    output: OutputText = OutputText()
    """Scale and unit of the output."""

    @property
    def name(self) -> str:
        """Its name."""
        return self.loop or self.block or ""


class PlcSettings(SectionSettings):
    """What stands beside the parameters for the whole file."""

    sample_time: Seconds | None = None
    """Interval of the task in s."""
    program: Identifier = "PidLoops"
    """Name of the program."""
    moves: tuple[Move, ...] = ()
    """What the program copies."""
    map: MapFile | None = None
    """Modbus map."""


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Settings] = (),
    plc: Mapping[str, object] | None = None,
    options: Settings | None = None,
) -> Decoded:
    """The configuration of these parameters; raises `DecodeError` with the name of what is no value.

    ``options``: ``sample_time``, the interval of the task in s, where the listing does not say it.
    """
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    task_time = (options or {}).get("sample_time") or plc_settings.sample_time
    if not settings:
        raise DecodeError(f"the program declares no block of the library ({', '.join(sorted(LOOP_TYPES))}, …)")
    if task_time is None:
        raise DecodeError("the listing does not say the interval of the task; give --sample-time")
    data: Data = {"pidcfg": 1, "vendor": "nextopid", **without_none({"name": plc_settings.name})}
    data |= without_none({"description": plc_settings.description})
    data["plc"] = {"sample_time": plain_number(Decimal(task_time))}
    if plc_settings.program != Plc.model_fields["program"].default:
        data["plc"]["program"] = plc_settings.program
    data["plc"] |= without_none({"map": plc_settings.map})
    signals = {name: _signal_value(content) for name, content in words.items() if "." not in name}
    data |= {"signals": signals} if signals else {}
    items = [read_item(entry, i) for i, entry in enumerate(settings)]
    for key in ("blocks", "loops"):
        entries = [
            _item_data(item, words, Decimal(task_time)) for item in items if (item.loop is None) == (key == "blocks")
        ]
        data |= {key: entries} if entries or key == "loops" else {}
    if plc_settings.moves:
        data["moves"] = [entry_of(move) for move in plc_settings.moves]
    return Decoded(data)


def read_item(entry: Mapping[str, object], number: int) -> ItemSettings:
    """The settings of a block, whose type the library must have."""
    item = read_settings(ItemSettings, entry, f"settings[{number}]")
    if (item.loop is None) == (item.block is None):
        raise DecodeError(f"settings[{number}]: either 'loop' or 'block' names it")
    kind = BLOCK_TYPES.get(item.type)
    if kind is None or (item.loop is not None and kind.name not in LOOP_TYPES):
        message = f"{item.name}: {item.type!r} is no {'controller' if item.loop else 'block'} of the library"
        raise RefusedError(message, f"settings[{number}]", ("type",))
    return item


def _item_data(item: ItemSettings, words: Mapping[str, Content | Wire], task: Decimal) -> Data:
    kind = BLOCK_TYPES[item.type]
    data: Data = {"name": item.name, "type": item.type, **without_none({"description": item.description})}
    interval = item.sample_time if item.cycles is None else item.cycles * task
    if interval is not None:
        data["sample_time"] = plain_number(interval)
    for row in kind.inputs:
        content = words.get(f"{item.name}.{row.name}")
        if content is None and _written_reason(kind, row.name) == REQUIRED_REASON:
            raise DecodeError(f"the listing does not hold {item.name}.{row.name}")
        if content is not None and not isinstance(content, Wire) and read_content(row.type, content) is None:
            raise DecodeError(f"{item.name}.{row.name}: {content!r} is not a value of {row.type.name}")
        if content is not None and (_written_reason(kind, row.name) or content != row.type.default):
            text = str(content).removeprefix("AUTOTUNE_") if row.type.kind == "word" else _content_value(content)
            set_value(data, parse_path(row.name), text)
    sections = {"pv": file_data(PvText, dict(item.pv)), "output": file_data(OutputText, dict(item.output))}
    return data | {key: section for key, section in sections.items() if section}


def _written_reason(kind: BlockType, name: str) -> str:
    """Why a parameter is written although it is 0: it is required, or without it something else is meant."""
    field = kind.model.model_fields.get(name)
    if field is None or field.default is None:
        return "given"
    return REQUIRED_REASON if field.is_required() else ""


def _signal_value(content: Content | Wire) -> bool | int | float | str:
    """The first value of a signal as the file writes it, with its type where a number would be a REAL."""
    if isinstance(content, int) and not isinstance(content, bool):
        return f"INT#{content}"
    return content if isinstance(content, str) else _content_value(content)


def _content_value(content: Content | Wire) -> bool | int | float | str:
    """A content as the file writes it."""
    if isinstance(content, Wire):
        return content.text
    return content if isinstance(content, bool) else plain_number(Decimal(repr(content)))


# --- How a NextoPID block holds its gains: engineering units, as times or as independent gains ------------------------


def tuning_of(config: NextopidFile, loop: Controller) -> LoopTuning:
    """The three parameters of a block."""
    if not isinstance(loop, Pida):
        return LoopTuning(TUNING_NUMBERS, obstacle="it switches on and off, and has no gains")
    obstacle = "its form is not known: Indep is wired" if isinstance(loop.Indep, Wire) else ""
    if loop.DisableP is not False and loop.Indep is False:
        obstacle = "it may act without its proportional term (DisableP)"
    seconds, filter_time = float(loop.sample_time or config.plc.sample_time), float(_number_of(loop.Tfd) or 0)
    return LoopTuning(
        TUNING_NUMBERS,
        raises_pv=None if isinstance(loop.Direct, Wire) else not loop.Direct,
        independent=loop.Indep is True,
        current_values=(_number_of(loop.Kp), _number_of(loop.Ti_Ki), _number_of(loop.Td_Kd)),
        obstacle=obstacle,
        sample_time=seconds,
        derivative_share=-expm1(-seconds / filter_time) if filter_time > 0 else 1.0,
    )


def _number_of(value: Decimal | Wire) -> Decimal | None:
    return None if isinstance(value, Wire) else value


# --- The two moves of figure 16-1 in a configuration: MV into ManualMV in automatic, PV into SP in manual -------------


class BumplessMoves(NamedTuple):
    """The numbers of the moves of a loop; None: it has none of this kind."""

    holds_mv: int | None
    """MV is copied into ManualMV while the loop is not in manual."""
    follows_pv: int | None
    """PV is copied into SP while it is."""


def bumpless_moves(encoding: NextopidEncoding, i: int) -> BumplessMoves:
    """The moves of figure 16-1 around an item: by what they read and write, whatever their signals are called."""
    return BumplessMoves(
        _find_move(encoding, i, "MV", "ManualMV", in_manual=False), _find_move(encoding, i, "PV", "SP", in_manual=True)
    )


def _find_move(encoding: NextopidEncoding, i: int, source: str, target: str, *, in_manual: bool) -> int | None:
    """The move from one parameter to another that is executed behind the blocks, in manual or else."""
    manual = _parameter_codes(encoding, i, "Manual")
    conditions = manual if in_manual else {((*code, NOT, 0), constants) for code, constants in manual}
    targets = [
        code[1]
        for code, _ in _parameter_codes(encoding, i, target)
        if len(code) == PAIR_LENGTH and code[0] == SIGNAL_CODE
    ]
    places = product(conditions, _parameter_codes(encoding, i, source), targets)
    return min((encoding.moves_behind[place] for place in places if place in encoding.moves_behind), default=None)


Code = tuple[tuple[int, ...], tuple[float, ...]]
PAIR_LENGTH = 2
"""Numbers of an operation in a code."""


def _code_of(expression: Expression) -> Code:
    return expression.code, expression.constants


def _parameter_codes(encoding: NextopidEncoding, i: int, key: str) -> set[Code]:
    """A parameter, and what it is wired to: both have its value behind its call."""
    numbers = encoding.layout.numbers
    number = numbers.get(f"{encoding.layout.instances[i].name}.{key}")
    wire = encoding.wires.get((i, key))
    codes: set[Code] = set() if number is None else {((SIGNAL_CODE, number), ())}
    return codes if wire is None else codes | {_code_of(wire)}
