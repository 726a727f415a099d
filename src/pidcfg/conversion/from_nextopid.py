"""NextoPID loops as neutral loops: what stands behind their wires, and what goes with them beside the loops."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from typing import Any

from pidcfg.conversion import NeutralLoop
from pidcfg.conversion.builder import (
    ZERO,
    NeutralBuilder,
    SameField,
    Span,
    Table,
    apply_table,
    product,
    quotient,
    round_computed,
    same_fields,
    to_dependent,
)
from pidcfg.encoders.nextopid.image import PlacedBlock, bumpless_moves, encode
from pidcfg.schemas import expressions as ops
from pidcfg.schemas.expressions import CONDITION_OPERATORS, Expression
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import MIN_INTEGRAL_TIME, LowFilter, Move, NextopidFile, Pida, Pwm
from pidcfg.schemas.numbers import EXACT_CONTEXT
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

# --- What stands behind the wires of a configuration: first values, cascades, filters and pulses of its loops ---------

D292 = Decision(
    292,
    "what reads MV says what 0 % and 100 % of it are",
    "A loop whose MV is another's SP_CASC has that one's MinPV and MaxPV as output range; one with a ControlPWM has "
    "its MinMV and MaxMV. An output.range that differs is replaced, and the report says so. SP_CASC wired to anything "
    "but an MV as it is, is no link, and is dropped.",
    "MinMV and MaxMV of a loop are limits; the range of what reads MV is the only scale that the program shows, and "
    "the neutral link hands the output on in units of the slave's PV.",
)
BINARY_OPERATORS: dict[int, Callable[[Any, Any], Any]] = {
    **{op: ops.TWO_OPERANDS[op] for op in CONDITION_OPERATORS - {ops.NOT}},
    ops.ADD: EXACT_CONTEXT.add,
    ops.SUBTRACT: EXACT_CONTEXT.subtract,
    ops.MULTIPLY: EXACT_CONTEXT.multiply,
    ops.DIVIDE: EXACT_CONTEXT.divide,
    ops.MINIMUM: min,
    ops.MAXIMUM: max,
}
"""Operators of two operands."""
UNARY_OPERATORS: dict[int, Callable[[Decimal], Decimal | bool]] = {
    ops.NEGATE: EXACT_CONTEXT.minus,
    ops.ABSOLUTE: abs,
    ops.ROOT: EXACT_CONTEXT.sqrt,
    ops.NOT: operator.not_,
}
"""Operators of one operand."""


def calculate_expression(expression: Expression, read: Callable[[int], Decimal | bool | None]) -> Decimal | bool | None:
    """The value of an expression; None where a name has none, or the calculation none."""
    stack: list[Any] = []
    for i in range(0, len(expression.code), 2):
        op, operand = expression.code[i : i + 2]
        if op == ops.CONSTANT:
            stack.append(Decimal(repr(expression.constants[operand])))
        elif op == ops.TRUTH:
            stack.append(bool(operand))
        elif op == ops.SIGNAL:
            value = read(operand)
            if value is None:
                return None
            stack.append(value)
        elif op in UNARY_OPERATORS:
            value = stack.pop()
            if op == ops.ROOT and value < 0:
                return None
            stack.append(UNARY_OPERATORS[op](value))
        else:
            right, left = stack.pop(), stack.pop()
            if op == ops.DIVIDE and not right:
                return None
            stack.append(BINARY_OPERATORS[op](left, right))
    result: Decimal | bool = stack.pop()
    return result


@frozen
class Value:
    """What a parameter is at the start: None where it is worked out by a block, or by the program around."""

    value: Any
    wire: str = ""
    """The expression that it is wired to; empty: it is not."""

    @property
    def file_value(self) -> Any:
        """What the file says: the expression or the value."""
        return self.wire or self.value

    def note(self, note: str = "") -> str:
        """A note, with what a wire is followed to before it."""
        if not self.wire:
            return note
        value = str(self.value).upper() if isinstance(self.value, bool) else self.value
        text = f"wired to {self.wire}, which is {'not known' if value is None else value} at the start"
        return f"{text}; {note}" if note else text


@dataclass(slots=True)
class LinkedBlocks:
    """What of the network around a loop the neutral form has, too: numbers of its blocks."""

    low_filter: int | None = None
    pwm: int | None = None
    master: int | None = None
    output_range: Span | None = None
    """0 % and 100 % of its output, by what reads its MV."""
    reader: str = ""
    """What that is."""
    slaves: list[int] = field(default_factory=list)

    def accepts_range(self, scale: Span, reader: str) -> bool:
        """Whether the loop's output can have this range; the first that reads MV decides."""
        if self.output_range is not None and self.output_range != scale:
            return False
        self.output_range, self.reader = scale, self.reader or reader
        return True


class Network:
    """The wires of a configuration."""

    def __init__(self, config: NextopidFile) -> None:
        self.config = config
        self.encoding = encode(config)
        self.items: tuple[PlacedBlock, ...] = self.encoding.items
        self.layout, self.wires = self.encoding.layout, self.encoding.wires
        self.first_loop = len(config.blocks)
        self.names = {number: name for name, number in self.layout.numbers.items()}

    @property
    def loops(self) -> range:
        """The numbers of the loops."""
        return range(self.first_loop, len(self.items))

    # --- values ------------------------------------------------------------------------------------------------------

    def value(self, i: int, key: str) -> Value:
        """A parameter's first value."""
        content = getattr(self.items[i].item, key, None)
        if not isinstance(content, Wire):
            return Value(content)
        return Value(self._follow_wire(i, key, frozenset()), content.text)

    def _follow_wire(self, i: int, key: str, visited: frozenset[tuple[int, str]]) -> Any:
        expression = self.wires.get((i, key))
        if expression is None or (i, key) in visited:
            return None
        now_visited = visited | {(i, key)}
        if expression.signal is not None:
            return self._first_value(expression.signal, now_visited)
        value = calculate_expression(expression, lambda number: self._first_value(number, now_visited))
        return value if value is None or isinstance(value, bool) else round_computed(value)

    def _first_value(self, number: int, visited: frozenset[tuple[int, str]]) -> Any:
        owner = self.layout.owner_of(number)
        name = self.names.get(number, "")
        if owner is None:
            return self.config.signals[name]
        if not self.layout.is_input(number):
            return None
        key = name.partition(".")[2]
        content = getattr(self.items[owner].item, key, None)
        return self._follow_wire(owner, key, visited) if isinstance(content, Wire) else content

    def source(self, i: int, key: str) -> str:
        """The name that a parameter is wired to, where the wire is nothing else; or empty."""
        expression = self.wires.get((i, key))
        return "" if expression is None or expression.signal is None else self.names.get(expression.signal, "")

    # --- blocks around a loop ----------------------------------------------------------------------------------------

    @cached_property
    def linked_blocks(self) -> dict[int, LinkedBlocks]:
        """What the neutral form has of each PID loop's surroundings."""
        linked_blocks = {i: LinkedBlocks() for i in self.loops if isinstance(self.items[i].item, Pida)}
        for i, blocks in linked_blocks.items():
            blocks.low_filter = self._filter_of(i)
            self._link_master(linked_blocks, i)
        for i, blocks in linked_blocks.items():
            self._link_pulses(i, blocks)
        return linked_blocks

    def _filter_of(self, i: int) -> int | None:
        name, _, output = self.source(i, "PV").partition(".")
        return next(
            (
                j
                for j in self._numbers_by_name.get(name, ())
                if output == "OutVar"
                and isinstance(self.items[j].item, LowFilter)
                and self.value(j, "Tc").value is not None
            ),
            None,
        )

    def _link_master(self, linked_blocks: dict[int, LinkedBlocks], i: int) -> None:
        """The master whose MV is a loop's set point as it is."""
        source, span = self.source(i, "SP_CASC"), self.span(i, "MinPV", "MaxPV")
        name, _, output = source.rpartition(".")
        j = next((j for j in self._numbers_by_name.get(name, ()) if j in linked_blocks and output == "MV"), None)
        if j is None or j == i or span is None:
            return
        if linked_blocks[j].accepts_range(span, f"the set point of {self.items[i].item.name}"):
            linked_blocks[i].master = j
            linked_blocks[j].slaves.append(i)

    def _link_pulses(self, i: int, linked_blocks: LinkedBlocks) -> None:
        for j in self._pwms.get(f"{self.items[i].item.name}.MV", ()):
            name, scale, period = self.items[j].item.name, self.span(j, "MinMV", "MaxMV"), self.value(j, "Period").value
            if period and scale is not None and linked_blocks.accepts_range(scale, f"the pulses of {name}"):
                linked_blocks.pwm = j
                return

    @cached_property
    def _numbers_by_name(self) -> dict[str, list[int]]:
        """The numbers of blocks and loops by their names."""
        numbers: dict[str, list[int]] = {}
        for j, block in enumerate(self.items):
            numbers.setdefault(block.item.name, []).append(j)
        return numbers

    @cached_property
    def _pwms(self) -> dict[str, list[int]]:
        """The numbers of blocks that make pulses by what their MV reads."""
        numbers: dict[str, list[int]] = {}
        for j, block in enumerate(self.items):
            if isinstance(block.item, Pwm):
                numbers.setdefault(self.source(j, "MV"), []).append(j)
        return numbers

    def span(self, i: int, low: str, high: str) -> Span | None:
        """Two parameters that are the ends of a scale; None where they are not known, or none."""
        ends = self.value(i, low).value, self.value(i, high).value
        return ends if None not in ends and ends[0] < ends[1] else None

    # --- what else there is ------------------------------------------------------------------------------------------

    def shared_blocks(self) -> set[int]:
        """Blocks that the neutral form has, too."""
        return {j for blocks in self.linked_blocks.values() for j in (blocks.low_filter, blocks.pwm) if j is not None}

    def owner_of(self, j: int) -> int:
        """The loop that a block works for: that reads it, however indirectly, or whose MV it reads; else the first."""
        reader = next((i for i in self.loops if j in self._sources[i]), None)
        return min(self._sources[j].intersection(self.loops), default=self.first_loop) if reader is None else reader

    @cached_property
    def _sources(self) -> list[set[int]]:
        """What each block and loop reads, however indirectly, up to the loops."""
        reads, loops = self.layout.read_blocks(self.wires), set(self.loops)
        return [blocks_read_by(i, reads, loops) for i in range(len(self.items))]

    def expressions(self, j: int) -> Iterator[tuple[str, str]]:
        """What is wired to a block: parameter and text."""
        for (i, key), expression in self.wires.items():
            if i == j:
                yield key, expression.text

    def readers(self, name: str) -> Iterator[tuple[int, str]]:
        """The parameters that read a signal."""
        number = self.layout.numbers[name]
        return (key for key, expression in self.wires.items() if number in expression.signals)


def blocks_read_by(start: int, reads: list[set[int]], loops: set[int]) -> set[int]:
    """Everything that a block reads, on ways that end at loops."""
    reached: set[int] = set()
    unread = list(reads[start])
    while unread:
        i = unread.pop()
        if i not in reached:
            reached.add(i)
            unread += () if i in loops else reads[i]
    return reached


# --- Parameters of a NextoPID loop, with what their wires stand for, on the way to the neutral loop -------------------

D293 = Decision(
    293,
    "a wired setting becomes its first value",
    "What a parameter is wired to is followed to signals and literals; the number that it begins with is converted, "
    "and reported as assumed with its expression. A wire to something that a block calculates has none: it is "
    "dropped, or asked for where nothing can be converted without it. A wired BIAS is a feed-forward and always "
    "dropped.",
    "A signal stands for an operator's entry or a recipe, which has a place in every PLC, but none in its parameters.",
)


@dataclass(slots=True, kw_only=True)
class ParameterBuilder(NeutralBuilder):
    """Fills a neutral loop from the parameters of a block; a wire is reported with its expression."""

    network: Network
    number: int
    """Of the block."""

    @property
    def item(self) -> Any:
        """The block."""
        return self.network.items[self.number].item

    @property
    def linked_blocks(self) -> LinkedBlocks:
        """Blocks around a PID that the neutral loop has, too."""
        return self.network.linked_blocks[self.number]

    @property
    def sample_time(self) -> Decimal:
        """In s: the block's, or the task's."""
        time: Decimal | None = self.item.sample_time
        return self.network.config.plc.sample_time if time is None else time

    def value(self, key: str) -> Value:
        """A parameter's first value."""
        return self.network.value(self.number, key)

    def is_on(self, key: str) -> bool:
        """Whether a switch is TRUE at the start."""
        return bool(self.value(key).value)

    def is_set(self, key: str) -> bool:
        """Whether a parameter is wired or not what it is without an entry."""
        return bool(getattr(self.item, key))

    def put_parameter(self, key: str, neutral: str, neutral_value: Any, note: str = "") -> None:
        """A parameter, and the neutral field with what it became."""
        self.set(neutral, neutral_value)
        self.mark_parameter(key, neutral, note=note)

    def mark_parameter(self, key: str, *neutral: str, note: str = "") -> None:
        """A parameter that is part of neutral fields which are set elsewhere; a wire with what it is followed to."""
        value = self.value(key)
        self.mark(key, value.file_value, *neutral, note=value.note(note), assumed=bool(value.wire))

    def drop_parameter(self, key: str, note: str) -> None:
        """A parameter that the neutral form does not have, with its expression."""
        value = self.value(key)
        self.drop(key, value.file_value, f"{value.wire}: {note}" if value.wire else note)

    def put_number(self, key: str, neutral: str, advice: str, factor: Decimal = Decimal(1), note: str = "") -> None:
        """An optional number; one that nobody knows is dropped, with what to program ``advice``."""
        value = self.value(key)
        if value.value is None:
            self.drop_parameter(key, advice)
        elif value.value or value.wire:
            self.put_parameter(key, neutral, round_computed(product(value.value, factor)), note)

    def mark_switch(self, key: str, neutral: str, note: str = "") -> None:
        """A BOOL; one that nobody knows is dropped."""
        if self.value(key).value is None:
            self.drop_parameter(key, "switch in the program; it counts as FALSE")
        elif self.is_set(key):
            self.mark_parameter(key, neutral, note=note)


# --- Blocks and signals of a NextoPID configuration that no loop of another PLC has: what they do, for the report -----

TERM_KEYS = ("SP", "PV", "Kp", "Ti_Ki", "Td_Kd", "Tfd", "ManualMV", "DeadBand")
LIMIT_KEYS = ("MaxVarMV", "MaxMV", "MinMV", "MaxPV", "MinPV")
SWITCH_KEYS = ("Indep", "DisableP", "DerivEr", "CASC", "Manual", "Direct")
LOOP_SETTINGS = frozenset((*TERM_KEYS, *LIMIT_KEYS, *SWITCH_KEYS))
"""Parameters of a loop whose signals are taken at their first value, or belong to the process."""
BLOCK_SETTINGS = frozenset(("InVar", "Tc", "Period"))
"""Parameters of a block that the neutral loop has, likewise."""


def drop_blocks_and_signals(network: Network, builders: Sequence[NeutralBuilder]) -> None:
    """Drops every block and signal that no loop has, in the report of the loop that it works for."""
    shared = network.shared_blocks()
    for j in range(network.first_loop):
        if j in shared:
            continue
        item = network.items[j].item
        wires = ", ".join(f"{key} {text}" for key, text in network.expressions(j))
        note = f"of {wires}: program it beside the controller" if wires else "program it beside the controller"
        builder = builders[network.owner_of(j) - network.first_loop]
        builder.drop(f"blocks.{item.name}", network.items[j].kind.name, note)
    for name, value in network.config.signals.items():
        reader = next(((i, key) for i, key in network.readers(name) if not _is_kept(network, shared, i, key)), None)
        if reader is not None:
            i, key = reader
            owner = i if i >= network.first_loop else network.owner_of(i)
            note = f"read by {network.items[i].item.name}.{key}, which has no twin"
            builders[owner - network.first_loop].drop(f"signals.{name}", value, note)


COPY_ADVICE = "copy it in the program: "
OUTPUT_STAYS_NOTE = "the output stays on the way to Manual; see operation.manual where the target's does not"


def report_moves(network: Network, builders: Sequence[NeutralBuilder]) -> None:
    """The moves of figure 16-1 go with their loops; every other one is dropped with the loop that it writes."""
    reported: set[int] = set()
    for i, builder in zip(network.loops, builders, strict=True):
        moves_of_loop = bumpless_moves(network.encoding, i)
        if moves_of_loop.holds_mv is not None:
            builder.loop.harmless_items[f"moves.{moves_of_loop.holds_mv}"] = OUTPUT_STAYS_NOTE
        if moves_of_loop.follows_pv is not None:
            path = f"moves.{moves_of_loop.follows_pv}"
            builder.put(path, _move_text(network, moves_of_loop.follows_pv), "setpoint.follows_pv", neutral_value=True)
        reported |= {number for number in moves_of_loop if number is not None}
    for number, move in enumerate(network.config.moves):
        if number not in reported:
            builders[_move_owner(network, move.to)].drop(
                f"moves.{number}", _move_text(network, number), COPY_ADVICE + _move_condition(move)
            )


def _move_owner(network: Network, name: str) -> int:
    """The loop that a target is of, or that reads it; else the first."""
    block = name.partition(".")[0]
    owners = [i for i in network.loops if network.items[i].item.name == block]
    if not owners and name in network.config.signals:
        owners = [i for i, _ in network.readers(name) if i in network.loops]
    return (owners or [network.first_loop])[0] - network.first_loop


def _move_text(network: Network, number: int) -> str:
    move = network.config.moves[number]
    value = move.move.text if isinstance(move.move, Wire) else str(move.move).upper()
    return f"{value} to {move.to}"


def _move_condition(move: Move) -> str:
    when = move.when.text if isinstance(move.when, Wire) else "never"
    return "in every cycle" if move.when is True else f"when {when}"


def _is_kept(network: Network, shared: set[int], i: int, key: str) -> bool:
    """Whether a parameter that reads a signal goes over, with the signal's value or as the process's."""
    if i < network.first_loop:
        return i in shared and key in BLOCK_SETTINGS
    return key in LOOP_SETTINGS


# ----------------------------------------------------------------------------------------------------------------------
# NextoPID configurations as neutral loops: what the blocks are set to, and what of the network the loops have, too.

MV_HELD_NOTE = "while the error is smaller, MV is held here"
REQUIRED_PARAMETERS = {
    "Direct": "the direction",
    "Indep": "the form",
    "DisableP": "the proportional term",
    "Kp": "the gain",
    "Ti_Ki": "the integral term",
    "Td_Kd": "the derivative term",
    "MinMV": "the limits of the output",
    "MaxMV": "the limits of the output",
    "MinPV": "the scale of the PV",
    "MaxPV": "the scale of the PV",
}
"""What a loop cannot be converted without."""
CONNECTION_ADVICE = {
    "TRK_IN": "put the loop into manual in the program, with TRK_VAL as its output",
    "Windup_H_IN": "hold the integral in the program",
    "Windup_L_IN": "hold the integral in the program",
    "OVERR": "select between the controllers in the program, and let the other one's integral follow",
}
"""What to program in place of a connection."""


def to_neutral(config: NextopidFile) -> list[NeutralLoop]:
    """The neutral loops of a configuration."""
    network = Network(config)
    builders = [ParameterBuilder(i - network.first_loop, network=network, number=i) for i in network.loops]
    for b in builders:
        if not isinstance(b.item, Pida) or not _is_complete(b):
            _require_known(b)
        else:
            apply_table(b, b.item, b.item, FIELDS)
    if builders and not any(b.loop.missing for b in builders):
        drop_blocks_and_signals(network, builders)
        report_moves(network, builders)
    return [b.loop for b in builders]


def _is_complete(b: ParameterBuilder) -> bool:
    known = all(b.value(key).value is not None for key in REQUIRED_PARAMETERS)
    return known and all(
        b.value(low).value < b.value(high).value for low, high in (("MinPV", "MaxPV"), ("MinMV", "MaxMV"))
    )


def _require_known(b: ParameterBuilder) -> None:
    name = b.item.name
    if not isinstance(b.item, Pida):
        b.require(
            "type", f"{name} switches on and off, which is no PID: move it from loops to blocks, and it is left out"
        )
        return
    for key, what in REQUIRED_PARAMETERS.items():
        value = b.value(key)
        if value.value is None:
            b.require(key, f"{key} of {name} is wired to {value.wire}, and nobody knows its value: write {what} itself")
    if not b.loop.missing:
        b.require("MaxPV", f"{name}: write MinPV below MaxPV, and MinMV below MaxMV")


def _sample_time(b: ParameterBuilder, item: Pida) -> None:
    where = "plc.sample_time" if item.sample_time is None else "sample_time"
    b.put(where, b.sample_time, "sample_time", b.sample_time)


def _direction(b: ParameterBuilder, _: Pida) -> None:
    b.put_parameter("Direct", "output_raises_pv", not b.is_on("Direct"))


def _equation(b: ParameterBuilder, _: Pida) -> None:
    indep, proportional = b.is_on("Indep"), not b.is_on("DisableP")
    gain, integral, derivative = (max(b.value(key).value, ZERO) for key in ("Kp", "Ti_Ki", "Td_Kd"))
    note = ""
    if indep:
        gain, integral, derivative, proportional = to_dependent(gain, integral, derivative)
    elif integral < MIN_INTEGRAL_TIME:
        note = "below 0.001 s: no integral" if integral else ""
        integral = ZERO
    b.set("tuning.proportional", proportional)
    b.set("tuning.derivative_on", "error" if b.is_on("DerivEr") else "pv")
    b.set("tuning.gain", gain)
    b.mark_parameter("Kp", "tuning.gain", *(("tuning.proportional",) if indep else ()))
    b.put_parameter("Ti_Ki", "tuning.integral_time", integral, note)
    b.put_parameter("Td_Kd", "tuning.derivative_time", derivative)
    if b.is_set("Indep"):
        b.mark_parameter("Indep", "tuning.gain")
    if b.is_set("DisableP"):
        b.mark_parameter("DisableP", "tuning.proportional", note="of no effect with Indep TRUE" if indep else "")
    if derivative:
        b.mark_parameter("DerivEr", "tuning.derivative_on")
    if b.is_set("Tfd"):
        b.put_number("Tfd", "tuning.derivative_filter", "filter the derivative in the program")


def _pv_range(b: ParameterBuilder, _: Pida) -> None:
    b.set("pv.range", [b.value("MinPV").value, b.value("MaxPV").value])
    b.mark_parameter("MinPV", "pv.range.0")
    b.mark_parameter("MaxPV", "pv.range.1")


def _pv_filter(b: ParameterBuilder, _: Pida) -> None:
    network, number = b.network, b.linked_blocks.low_filter
    if number is not None:
        time, block = network.value(number, "Tc"), f"blocks.{network.items[number].item.name}"
        b.put(f"{block}.Tc", time.file_value, "pv.filter", time.value, assumed=bool(time.wire))
        expression = network.value(number, "InVar").wire
        if expression and not _is_plain_source(network, network.source(number, "InVar")):
            b.drop(f"{block}.InVar", expression, f"work the PV out in the program: {expression}")
    elif b.value("PV").wire and not _is_plain_source(network, network.source(b.number, "PV")):
        b.drop_parameter("PV", "work it out in the program and give it to the controller")


def _is_plain_source(network: Network, source: str) -> bool:
    """Whether a name is a signal, or what another loop reads as its PV."""
    return source in network.config.signals or source.endswith(".PV")


def _mode(b: ParameterBuilder, _: Pida) -> None:
    linked, manual = b.linked_blocks.master is not None, b.is_on("Manual") or b.is_on("TRK_IN")
    b.set("mode", "manual" if manual else "cascade" if b.is_on("CASC") and linked else "auto")
    b.set("setpoint", {})  # a neutral file shows the section even if nothing is known of it
    b.mark_switch("Manual", "mode")
    b.mark_switch("CASC", "mode" if linked else "setpoint.value", "manual comes first" if manual else "")


def _setpoint(b: ParameterBuilder, _: Pida) -> None:
    casc = b.is_on("CASC")
    if b.linked_blocks.master is not None:
        master = b.network.items[b.linked_blocks.master].item.name
        b.put("SP_CASC", b.value("SP_CASC").wire, "setpoint.source", master)
    elif casc and _is_number(b, "SP_CASC"):
        b.put_parameter("SP_CASC", "setpoint.value", b.value("SP_CASC").value)
        b.drop_parameter("SP", "cascade mode is on, so SP_CASC is the set point: switch between the two in the program")
        return
    elif casc:
        b.drop_parameter("SP_CASC", "the set point while CASC is TRUE: work it out in the program")
    elif b.is_set("SP_CASC"):
        b.drop_parameter("SP_CASC", "a second set point, in force while CASC is TRUE: switch it in the program")
    if b.value("SP").value is None:
        b.drop_parameter("SP", "work out the set point in the program")
    else:
        b.put_parameter("SP", "setpoint.value", b.value("SP").value)


def _is_number(b: ParameterBuilder, key: str) -> bool:
    """Whether a parameter is a number, or a signal that stands for one."""
    return not b.value(key).wire or b.network.source(b.number, key) in b.network.config.signals


def _output(b: ParameterBuilder, item: Pida) -> None:
    low, high = b.value("MinMV").value, b.value("MaxMV").value
    b.set("output.limits", [low, high])
    b.mark_parameter("MinMV", "output.limits.0")
    b.mark_parameter("MaxMV", "output.limits.1")
    span, scale = item.output.range, b.linked_blocks.output_range or item.output.range or (low, high)
    if span is not None and scale == span:
        b.put("output.range", span, "output.range", span)
    else:
        note = "no output.range is given: MinMV and MaxMV are taken for 0 % and 100 %"
        if b.linked_blocks.output_range is not None:
            note = f"0 % and 100 % of {b.linked_blocks.reader}"
        b.put("output.range", span, "output.range", scale, note, assumed=True)


def _pulses(b: ParameterBuilder, _: Pida) -> None:
    network, number = b.network, b.linked_blocks.pwm
    if number is not None:
        period = network.value(number, "Period")
        time = product(Decimal(period.value), network.config.plc.sample_time)
        path = f"blocks.{network.items[number].item.name}.Period"
        b.put(path, period.file_value, "output.pulse.period", time, assumed=bool(period.wire))


def _output_terms(b: ParameterBuilder, _: Pida) -> None:
    """What else makes the output."""
    expression = b.network.wires.get((b.number, "BIAS"))
    if b.value("BIAS").value is None or (expression is not None and expression.signals):
        b.drop_parameter("BIAS", "a feed-forward: add it to the output in the program")
    elif b.is_set("BIAS"):
        b.put_parameter("BIAS", "output.bias", b.value("BIAS").value)
    if b.is_on("TRK_IN") and b.value("TRK_VAL").value is not None:
        b.set("output.manual", b.value("TRK_VAL").value)
        if b.is_set("ManualMV"):
            b.drop_parameter("ManualMV", "TRK_IN is on, so TRK_VAL is the output: write it in the program")
    elif b.value("ManualMV").value is None:
        b.drop_parameter("ManualMV", "work out the output in manual in the program")
    elif b.is_set("ManualMV") or b.is_on("Manual"):
        b.put_parameter("ManualMV", "output.manual", b.value("ManualMV").value)
    if b.is_set("MaxVarMV"):
        per_second = quotient(Decimal(1), b.sample_time)
        instead = "limit the change of MV in the program"
        b.put_number("MaxVarMV", "output.max_rate", instead, per_second, "per cycle here")


def _deadband(b: ParameterBuilder, _: Pida) -> None:
    if b.is_set("DeadBand"):
        b.put_number("DeadBand", "deadband", "hold MV in the program while the error is small", note=MV_HELD_NOTE)


def _connections(b: ParameterBuilder, item: Pida) -> None:
    """Connections of cascades and overrides, and the auto-tuning."""
    slaves = {b.network.items[j].item.name for j in b.linked_blocks.slaves}
    cascade_sources = {f"{name}.{key}" for name in slaves for key in ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")}
    tracks = b.network.source(b.number, "TRK_IN") in cascade_sources
    for key in ("TRK_IN", "Windup_H_IN", "Windup_L_IN", "OVERR"):
        if b.is_set(key) and b.network.source(b.number, key) not in cascade_sources:
            b.drop_parameter(key, CONNECTION_ADVICE[key])
    if b.is_set("TRK_VAL") and not tracks and (b.is_set("TRK_IN") or b.is_set("OVERR")):
        b.drop_parameter("TRK_VAL", "where the output comes from meanwhile")
    if getattr(item, "AutoTune", False):
        b.drop_parameter("AutoTune", "start the auto-tuning as the target does it")
    for key, value in dict(getattr(item, "AutoTuneParam", None) or {}).items():
        b.drop(
            f"AutoTuneParam.{key}",
            value.text if isinstance(value, Wire) else value,
            "set up the auto-tuning of the target",
        )


FIELDS: Table[ParameterBuilder, Pida] = (
    *same_fields("name", "description"),
    _sample_time,
    _direction,
    _equation,
    _pv_range,
    SameField("pv.unit"),
    _pv_filter,
    _mode,
    _setpoint,
    _output,
    SameField("output.unit"),
    _pulses,
    _output_terms,
    _deadband,
    _connections,
)
"""Every field in the order of the report."""
