"""What stands behind the wires of a NextoPID configuration: first values, cascades, filters and pulses of its loops."""

from __future__ import annotations

import operator
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.builder import Span, round_computed
from pidcfg.encoders.nextopid.image import encode
from pidcfg.schemas import expressions as ops
from pidcfg.schemas.expressions import CONDITIONAL
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import LowFilter, PidaReal, Pwm
from pidcfg.schemas.numbers import EXACT_CONTEXT
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.encoders.nextopid.image import Placed
    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.nextopid import NextopidFile

D292 = Decision(
    292,
    "what reads MV says what 0 % and 100 % of it are",
    "A loop whose MV is another's SP_CASC has that one's MinPV and MaxPV as output range; one with a ControlPWM has "
    "its MinMV and MaxMV. An output.range that differs is replaced, and the report says so. SP_CASC wired to anything "
    "but an MV as it is, is no link, and is dropped.",
    "MinMV and MaxMV of a loop are limits; the range of what reads MV is the only scale that the program shows, and "
    "the neutral link hands the output on in units of the slave's PV.",
)
OPERATIONS: dict[int, Callable[[Any, Any], Any]] = {
    **{op: ops.TWO_OPERANDS[op] for op in CONDITIONAL - {ops.NOT}},
    ops.ADD: EXACT_CONTEXT.add,
    ops.SUBTRACT: EXACT_CONTEXT.subtract,
    ops.MULTIPLY: EXACT_CONTEXT.multiply,
    ops.DIVIDE: EXACT_CONTEXT.divide,
    ops.MINIMUM: min,
    ops.MAXIMUM: max,
}
"""Operators of two operands."""
SIGNS: dict[int, Callable[[Decimal], Decimal | bool]] = {
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
        elif op in SIGNS:
            value = stack.pop()
            if op == ops.ROOT and value < 0:
                return None
            stack.append(SIGNS[op](value))
        else:
            right, left = stack.pop(), stack.pop()
            if op == ops.DIVIDE and not right:
                return None
            stack.append(OPERATIONS[op](left, right))
    result: Decimal | bool = stack.pop()
    return result


@frozen
class Value:
    """What a parameter is at the start: None where it is worked out by a block, or by the program around."""

    value: Any
    wire: str = ""
    """The expression that it is wired to; empty: it is not."""

    @property
    def written(self) -> Any:
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
class Surroundings:
    """What of the network around a loop the neutral form has, too: numbers of its blocks."""

    low_filter: int | None = None
    pwm: int | None = None
    master: int | None = None
    scale: Span | None = None
    """0 % and 100 % of its output, by what reads its MV."""
    reader: str = ""
    """What that is."""
    slaves: list[int] = field(default_factory=list)

    def accepts_range(self, scale: Span, reader: str) -> bool:
        """Whether the loop's output can have this range; the first that reads MV decides."""
        if self.scale is not None and self.scale != scale:
            return False
        self.scale, self.reader = scale, self.reader or reader
        return True


class Network:
    """The wires of a configuration."""

    def __init__(self, config: NextopidFile) -> None:
        self.config = config
        self.encoding = encode(config)
        self.items: tuple[Placed, ...] = self.encoding.items
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

    def _follow_wire(self, i: int, key: str, seen: frozenset[tuple[int, str]]) -> Any:
        expression = self.wires.get((i, key))
        if expression is None or (i, key) in seen:
            return None
        below = seen | {(i, key)}
        if expression.signal is not None:
            return self._first_value(expression.signal, below)
        value = calculate_expression(expression, lambda number: self._first_value(number, below))
        return value if value is None or isinstance(value, bool) else round_computed(value)

    def _first_value(self, number: int, seen: frozenset[tuple[int, str]]) -> Any:
        owner = self.layout.owner(number)
        name = self.names.get(number, "")
        if owner is None:
            return self.config.signals[name]
        if not self.layout.is_input(number):
            return None
        key = name.partition(".")[2]
        content = getattr(self.items[owner].item, key, None)
        return self._follow_wire(owner, key, seen) if isinstance(content, Wire) else content

    def source(self, i: int, key: str) -> str:
        """The name that a parameter is wired to, where the wire is nothing else; or empty."""
        expression = self.wires.get((i, key))
        return "" if expression is None or expression.signal is None else self.names.get(expression.signal, "")

    # --- blocks around a loop ----------------------------------------------------------------------------------------

    @cached_property
    def around(self) -> dict[int, Surroundings]:
        """What the neutral form has of each PID loop's surroundings."""
        around = {i: Surroundings() for i in self.loops if isinstance(self.items[i].item, PidaReal)}
        for i, blocks in around.items():
            blocks.low_filter = self._filter_of(i)
            self._link(around, i)
        for i, blocks in around.items():
            self._pulses(i, blocks)
        return around

    def _filter_of(self, i: int) -> int | None:
        name, _, output = self.source(i, "PV").partition(".")
        return next(
            (
                j
                for j in self._named.get(name, ())
                if output == "OutVar"
                and isinstance(self.items[j].item, LowFilter)
                and self.value(j, "Tc").value is not None
            ),
            None,
        )

    def _link(self, around: dict[int, Surroundings], i: int) -> None:
        """The master whose MV is a loop's set point as it is."""
        source, span = self.source(i, "SP_CASC"), self.span(i, "MinPV", "MaxPV")
        name, _, output = source.rpartition(".")
        j = next((j for j in self._named.get(name, ()) if j in around and output == "MV"), None)
        if j is None or j == i or span is None:
            return
        if around[j].accepts_range(span, f"the set point of {self.items[i].item.name}"):
            around[i].master = j
            around[j].slaves.append(i)

    def _pulses(self, i: int, around: Surroundings) -> None:
        for j in self._pwms.get(f"{self.items[i].item.name}.MV", ()):
            name, scale, period = self.items[j].item.name, self.span(j, "MinMV", "MaxMV"), self.value(j, "Period").value
            if period and scale is not None and around.accepts_range(scale, f"the pulses of {name}"):
                around.pwm = j
                return

    @cached_property
    def _named(self) -> dict[str, list[int]]:
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
        return {j for blocks in self.around.values() for j in (blocks.low_filter, blocks.pwm) if j is not None}

    def owner_of(self, j: int) -> int:
        """The loop that a block works for: that reads it, however indirectly, or whose MV it reads; else the first."""
        works_for = next((i for i in self.loops if j in self._read_by[i]), None)
        return (
            min(self._read_by[j].intersection(self.loops), default=self.first_loop) if works_for is None else works_for
        )

    @cached_property
    def _read_by(self) -> list[set[int]]:
        """What each block and loop reads, however indirectly, up to the loops."""
        waits, loops = self.layout.waits(self.wires), set(self.loops)
        return [blocks_read_by(i, waits, loops) for i in range(len(self.items))]

    def expressions(self, j: int) -> Iterator[tuple[str, str]]:
        """What is wired to a block: parameter and text."""
        for (i, key), expression in self.wires.items():
            if i == j:
                yield key, expression.text

    def readers(self, name: str) -> Iterator[tuple[int, str]]:
        """The parameters that read a signal."""
        number = self.layout.numbers[name]
        return (key for key, expression in self.wires.items() if number in expression.signals)


def blocks_read_by(start: int, waits: list[set[int]], loops: set[int]) -> set[int]:
    """Everything that a block reads, on ways that end at loops."""
    seen: set[int] = set()
    waiting = list(waits[start])
    while waiting:
        i = waiting.pop()
        if i not in seen:
            seen.add(i)
            waiting += () if i in loops else waits[i]
    return seen
