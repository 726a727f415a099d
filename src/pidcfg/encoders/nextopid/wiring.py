"""How the blocks of a program hang together: names and types, what a wire means, and the order of execution.

Design. A `Layout` numbers every signal and every parameter of every block, signals first; the virtual PLC keeps its
values in the same places. A wire is read against it: a BOOL takes the name of a BOOL, a number an expression of
numbers. Blocks are executed in data-flow order; in a ring one link is read from the previous cycle (D204).
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

from pidcfg.encoders.maps.nextopid import LOOP_TYPES, BlockType
from pidcfg.schemas.expressions import (
    BOOL_VALUES,
    CONSTANT,
    DIVIDE,
    KINDS_BY_TYPE,
    ONE_OPERAND,
    ROOT,
    SIGNAL,
    TRUTH,
    TWO_OPERANDS,
    Expression,
    ExpressionError,
    TypedParser,
    lengths_of,
)
from pidcfg.schemas.iec import IecType
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.text.signs import closest_name

D204 = Decision(
    204,
    "a ring of blocks begins with a loop",
    "Blocks are executed after those that they read, else in the order of the file, blocks before loops. In a ring the "
    "first loop of the file comes first and reads the previous cycle's values; without a loop the first block does.",
    "The manual's special connections are rings: a cascade's TRK_OUT, an override's OVERR. Begun with the controllers, "
    "the selected MV is that of the same cycle.",
)
D205 = Decision(
    205,
    "a block's own parameters may be read in its wires",
    "Outputs have the values of the previous cycle, inputs that are not wired theirs; an input that is wired itself "
    "may not be read there.",
    "Which of two arguments of one call is assigned first is nothing to rely on.",
)

DIRECTIONS = {
    **dict.fromkeys(("reverse", "heating"), "write false: MV falls when the PV rises, which is heating"),
    **dict.fromkeys(("wahr", "ja"), "write true"),
    **dict.fromkeys(("falsch", "nein"), "write false"),
    **dict.fromkeys(("direct", "cooling"), "write true: MV rises with the PV, which is cooling; false is heating"),
}
"""What to write for the words that other families have for a direction, and for German ones."""
NAME_FORM = re.compile(r"[A-Za-z_][\w.]*")
PASSING_BLOCKS = frozenset(("ControlSelectMax", "ControlSelectMin", "ControlSplitRange", "ControlLeadLag"))
"""Blocks whose output answers to their input within the same call."""


class Instance(NamedTuple):
    """A block of the program: its name, its type, and the number of its first parameter."""

    name: str
    kind: BlockType
    base: int


Wires = dict[tuple[int, str], Expression]
"""What is wired: by the number of the instance and the parameter."""


@frozen
class Layout:
    """Everything that has a value: the signals, then the parameters of each block in the order of its table."""

    signals: Mapping[str, IecType]
    instances: tuple[Instance, ...]

    @classmethod
    def of(cls, signals: Mapping[str, IecType], blocks: Iterable[tuple[str, BlockType]]) -> Layout:
        """With the blocks one after the other."""
        base, instances = len(signals), []
        for name, kind in blocks:
            instances.append(Instance(name, kind, base))
            base += len(kind.table.rows)
        return cls(signals, tuple(instances))

    @cached_property
    def types(self) -> dict[str, IecType]:
        """The type of every name."""
        return {
            **self.signals,
            **{f"{block.name}.{row.name}": row.type for block in self.instances for row in block.kind.table.rows},
        }

    @cached_property
    def numbers(self) -> dict[str, int]:
        """The number of every name. Of two blocks with one name the first counts; a rule reports it."""
        numbers = {name: i for i, name in enumerate(self.signals)}
        for block in self.instances:
            for i, row in enumerate(block.kind.table.rows):
                numbers.setdefault(f"{block.name}.{row.name}", block.base + i)
        return numbers

    @property
    def size(self) -> int:
        """How many values there are."""
        return len(self.signals) + sum(len(block.kind.table.rows) for block in self.instances)

    def owner_of(self, number: int) -> int | None:
        """The block that a number belongs to; None: it is a signal."""
        if number < len(self.signals):
            return None
        return bisect_right(self._bases, number) - 1

    @cached_property
    def _bases(self) -> tuple[int, ...]:
        return tuple(block.base for block in self.instances)

    @cached_property
    def _names(self) -> dict[int, str]:
        return {number: name for name, number in self.numbers.items()}

    @cached_property
    def kinds(self) -> dict[int, IecType]:
        """The type of every number."""
        return {number: self.types[name] for name, number in self.numbers.items()}

    @cached_property
    def _lengths(self) -> list[int]:
        return lengths_of(self.numbers)

    def is_input(self, number: int) -> bool:
        """Whether a number is that of an input of a block."""
        owner = self.owner_of(number)
        if owner is None:
            return False
        block = self.instances[owner]
        return block.kind.table.rows[number - block.base].access == "input"

    def read_wire(self, kind: IecType, text: str) -> Expression:
        """What a wire to a parameter of this type means; raises `ExpressionError` at its character."""
        if text in self.types:
            return self._read_name(kind, text)
        kind_wanted = KINDS_BY_TYPE[kind.kind]
        if NAME_FORM.fullmatch(text) and kind_wanted == "bool" and text.upper() not in BOOL_VALUES:
            near = closest_name(text, [name for name, iec_type in self.types.items() if iec_type.kind == "bool"])
            cure = f"did you mean {near!r}?" if near else "wire the name of a BOOL, or a condition such as PV < 4.0"
            raise ExpressionError(f"{text!r} is no declared BOOL", 0, DIRECTIONS.get(text.casefold(), cure))
        if kind_wanted == "bool" and text in {"0", "1"}:
            raise ExpressionError(
                "this is a number; a BOOL is wanted", 0, f"write {'true' if text == '1' else 'false'}"
            )
        parser = TypedParser(text, self.numbers, self._lengths, types=self.kinds.__getitem__)
        expression = parser.read()
        parser.expect_kind(parser.operands[-1], kind_wanted)
        fault = no_value_reason(expression)
        if fault is not None:
            raise ExpressionError(f"{fault}: {text!r} has no value", 0, "correct the numbers")
        return expression

    def _read_name(self, kind: IecType, name: str) -> Expression:
        """A wire that is nothing but a name."""
        iec_type = self.types[name]
        if KINDS_BY_TYPE.get(iec_type.kind) != KINDS_BY_TYPE[kind.kind]:
            expected, cure = ("a BOOL is wanted", "compare it, as in PV < 4.0")
            if kind.kind != "bool":
                expected, cure = "numbers are wanted", "wire a REAL or an INT"
            raise ExpressionError(f"{name} is {iec_type.name}; {expected}", 0, cure)
        number = self.numbers[name]
        return Expression(name, (SIGNAL, number), (), frozenset((number,)), 1)

    # --- order -------------------------------------------------------------------------------------------------------

    def read_blocks(self, wires: Wires) -> list[set[int]]:
        """For each block those whose values it reads: outputs, and inputs that are wired."""
        wired = {self.instances[i].base + self._parameter_offset(i, row) for i, row in wires}
        owners: list[set[int]] = [set() for _ in self.instances]
        for (i, _), expression in wires.items():
            for number in expression.signals:
                owner = self.owner_of(number)
                if owner is not None and (number in wired or not self.is_input(number)):
                    owners[i].add(owner)
        return owners

    def _parameter_offset(self, instance: int, row: str) -> int:
        rows = self.instances[instance].kind.table.rows
        return next(i for i, other in enumerate(rows) if other.name == row)

    def execution_order(self, wires: Wires) -> list[int]:
        """The numbers of the blocks in the order in which they are executed."""
        reads = [owners - {i} for i, owners in enumerate(self.read_blocks(wires))]
        ordered: dict[int, None] = {}
        remaining = list(range(len(self.instances)))
        while remaining:
            ready = next((i for i in remaining if reads[i] <= ordered.keys()), None)
            next_block = self._begin_ring(remaining, reads) if ready is None else ready
            ordered[next_block] = None
            remaining.remove(next_block)
        return list(ordered)

    def _begin_ring(self, remaining: Sequence[int], reads: Sequence[set[int]]) -> int:
        """Of rings that wait for nothing but themselves, the first loop, or else the first block."""
        reachable = {i: reachable_blocks(i, reads, set(remaining)) for i in remaining}
        leading = [i for i in remaining if all(i in reachable[j] for j in reachable[i])]
        return next((i for i in leading if self.instances[i].kind.name in LOOP_TYPES), leading[0])

    def find_rings(self, wires: Wires, passing: set[int]) -> Iterator[list[int]]:
        """Rings of blocks that are all ``passing``: their inputs go on within the same call."""
        waits = self.read_blocks(wires)
        found: set[int] = set()
        for i in sorted(passing):
            ring = sorted(j for j in reachable_blocks(i, waits, passing) if i in reachable_blocks(j, waits, passing))
            if ring and i in ring and not found & set(ring):
                found |= set(ring)
                yield ring


def reachable_blocks(start: int, reads: Sequence[set[int]], blocks: set[int]) -> set[int]:
    """Everything that a block waits for, however indirectly, among some blocks."""
    found: set[int] = set()
    open_blocks = list(reads[start] & blocks)
    while open_blocks:
        i = open_blocks.pop()
        if i not in found:
            found.add(i)
            open_blocks += reads[i] & blocks
    return found


# --- The value of an expression, as far as it is known ----------------------------------------------------------------


def no_value_reason(expression: Expression) -> str | None:
    """Why an expression can have no value whatever its signals are: a division by 0, the root of a negative number."""
    try:
        value_of(expression, lambda _: None)
    except NoValueError as error:
        return str(error)
    return None


class NoValueError(ArithmeticError):
    """An expression without a value: why."""


def value_of(
    expression: Expression, values: Callable[[int], float | None], rounded: Callable[[float], float] = float
) -> float | None:
    """The value of an expression, of which every result is ``rounded``; None where it depends on an unknown signal.

    Raises `NoValueError` where it has none, whatever the unknown signals are.
    """
    stack: list[float | None] = []
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        if op in (CONSTANT, SIGNAL, TRUTH):
            value = expression.constants[operand] if op == CONSTANT else operand if op == TRUTH else values(operand)
            stack.append(None if value is None else rounded(value))
            continue
        right = stack.pop()
        if op == DIVIDE and right == 0:
            raise NoValueError("division by zero")
        if op == ROOT and right is not None and right < 0:
            raise NoValueError("the square root of a negative number")
        if op in ONE_OPERAND:
            stack.append(None if right is None else rounded(ONE_OPERAND[op](right)))
        else:
            left = stack.pop()
            stack.append(None if left is None or right is None else rounded(TWO_OPERANDS[op](left, right)))
    return stack[0]
