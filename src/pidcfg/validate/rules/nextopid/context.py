"""What the NextoPID rules look at: the program, what is known of it, and how its controllers hang together."""

from __future__ import annotations

from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from typing import Any, NamedTuple, TypeGuard, TypeVar

from pidcfg.encoders.maps.nextopid import LOOP_TYPES
from pidcfg.encoders.nextopid.image import NextopidEncoding, PlacedBlock
from pidcfg.encoders.parameters import Parameter
from pidcfg.schemas import expressions as grammar
from pidcfg.schemas.expressions import Expression
from pidcfg.schemas.iec import TimeNumber, Wire
from pidcfg.schemas.nextopid import MIN_INTEGRAL_TIME, NextopidFile
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, parse_path, value_at
from pidcfg.text.references import Decision
from pidcfg.validate.rule import Finding
from pidcfg.validate.rules.nextopid.first_scan import CHECKED_KEYS, TRANSIENT, FirstScan, KnownValue
from pidcfg.validate.shared_checks import Context, number_text

# --- What is known of a parameter of a NextoPID block, and how people write that --------------------------------------


def all_known(values: tuple[Decimal | None, ...]) -> TypeGuard[tuple[Decimal, ...]]:
    """Whether all values are known."""
    return None not in values


def value_text(value: object) -> str:
    """A number or a switch as people write it."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return number_text(Decimal(str(value)))


# ----------------------------------------------------------------------------------------------------------------------
# The blocks and loops of a NextoPID program as the rules see them: what is known of their parameters, and their
# wires.
# A literal is known, and of a wire the value that it has in the first scan, as far as the file says it (`first_scan`).

PV_KEYS = frozenset(("SP", "SP_CASC", "PV", "MaxPV", "MinPV", "DeadBand"))
MV_KEYS = frozenset(("MV", "MaxMV", "MinMV", "ManualMV", "BIAS", "TRK_VAL", "MaxVarMV"))
TIME_KEYS = frozenset(("Tfd", "Tc", "Tlead", "Tlag", "DelayTime"))
ON_OFF = "ControlON_OFF"
TIME_CONSTANTS = {"ControlLowFilter": "Tc", "ControlLag": "Tc", "ControlDelayLag": "Tc", "ControlLeadLag": "Tlag"}
"""The parameter of filters and lags that is their time constant."""


@frozen
class BlockView:
    """A block or loop, its place in the file, and what is known of its parameters."""

    context: ProgramContext
    number: int
    placed: PlacedBlock

    @property
    def name(self) -> str:
        """The instance's name."""
        return self.placed.item.name

    @property
    def type(self) -> str:
        """The block's type."""
        return self.placed.kind.name

    @property
    def item(self) -> Any:
        """The block as the schema has it."""
        return self.placed.item

    @property
    def is_pid(self) -> bool:
        """Whether it is a PID controller."""
        return self.type in LOOP_TYPES and self.type != ON_OFF

    def is_given(self, key: str) -> bool:
        """Whether the file gives a parameter."""
        return key in self.item.model_fields_set

    def known_value(self, key: str) -> KnownValue | None:
        """The value of a parameter in the first scan; None where it is unknown, or wrong by another rule."""
        known = self.context.first_scan.find_value(self.context.number(self, key))
        return None if known is not None and known.life == TRANSIENT and key not in CHECKED_KEYS else known

    def number_of(self, key: str) -> Decimal | None:
        """The value of a numeric parameter."""
        known = self.known_value(key)
        return None if known is None else Decimal(known.value)

    def is_on(self, key: str) -> bool | None:
        """The value of a switch; None where it is wired to an unknown value."""
        known = self.known_value(key)
        return None if known is None else bool(known.value)

    def may_be_on(self, key: str) -> bool:
        """Whether a switch is on, or can be switched on by a wire that has a meaning."""
        return self.wire(key) is not None or bool(self.is_on(key))

    def wire(self, key: str) -> Expression | None:
        """What a parameter is wired to."""
        return self.context.encoding.wires.get((self.number, key))

    def is_wired(self, key: str) -> bool:
        """Whether a parameter has a wire, even one without meaning."""
        return isinstance(value_at(self.item, parse_path(key)), Wire)

    def source(self, key: str) -> str | None:
        """The name of what a parameter is wired to, where the wire is nothing but a name."""
        expression = self.wire(key)
        return None if expression is None or expression.signal is None else self.context.names[expression.signal]

    @cached_property
    def sample_time(self) -> Decimal:
        """The interval of its calls in s."""
        time: Decimal | None = getattr(self.item, "sample_time", None)
        return self.context.config.plc.sample_time if time is None else time

    @cached_property
    def mv_limits(self) -> tuple[Decimal, Decimal] | None:
        """The limits of MV; None where one is not known, or where they leave no room."""
        return self._ascending_limits("MinMV", "MaxMV")

    @cached_property
    def pv_limits(self) -> tuple[Decimal, Decimal] | None:
        """The limits of PV; None where one is not known, or where they leave no room."""
        return self._ascending_limits("MinPV", "MaxPV")

    def _ascending_limits(self, low: str, high: str) -> tuple[Decimal, Decimal] | None:
        ends = self.number_of(low), self.number_of(high)
        return (ends[0], ends[1]) if all_known(ends) and ends[0] < ends[1] else None

    # --- gains ---------------------------------------------------------------------------------------------------

    @cached_property
    def proportional(self) -> Decimal | None:
        """The gain of the proportional term as it acts."""
        indep = self.is_on("Indep")
        if indep is None or (not indep and self.is_on("DisableP") is None):
            return None
        return Decimal(0) if not indep and self.is_on("DisableP") else self.number_of("Kp")

    @cached_property
    def integral(self) -> Decimal | None:
        """The integral gain Ki as it acts, in MV per PV and second."""
        gain, time, indep = self.number_of("Kp"), self.number_of("Ti_Ki"), self.is_on("Indep")
        if time is None or indep is None:
            return None
        if indep:
            return time
        if time < MIN_INTEGRAL_TIME:
            return Decimal(0)
        return None if gain is None else gain / time

    @cached_property
    def derivative(self) -> Decimal | None:
        """The derivative gain Kd as it acts, in MV per PV times seconds."""
        gain, time, indep = self.number_of("Kp"), self.number_of("Td_Kd"), self.is_on("Indep")
        if time is None or indep is None:
            return None
        return time if indep else None if gain is None else gain * time

    # --- words -----------------------------------------------------------------------------------------------------

    def unit(self, key: str) -> str:
        """The unit of a parameter with a blank before it; empty where it has none."""
        if key in TIME_KEYS or (key in {"Ti_Ki", "Td_Kd"} and self.is_on("Indep") is False):
            return " s"
        part = "pv" if key in PV_KEYS else "output" if key in MV_KEYS else ""
        unit = getattr(getattr(self.item, part, None), "unit", None) if part else None
        return f" {unit}" if unit else ""

    def quote(self, key: str) -> str:
        """The value of a parameter with unit and origin; only where it is known."""
        known = self.known_value(key)
        return "unknown" if known is None else f"{value_text(known.value)}{self.unit(key)}{known.source}"

    def report(
        self, key: str, /, plc_effect: str | None = None, severity: Severity | None = None, **values: Any
    ) -> Finding:
        """A finding at one of its keys."""
        return Finding((*self.placed.place, *parse_path(key)), values, plc_effect=plc_effect, severity=severity)


@frozen
class ProgramContext(Context[NextopidFile, NextopidEncoding]):
    """A configuration with its encoding, and its blocks one by one."""

    @cached_property
    def views(self) -> tuple[BlockView, ...]:
        """All blocks, then all loops, in the order of the file."""
        return tuple(BlockView(self, i, placed) for i, placed in enumerate(self.encoding.items))

    @cached_property
    def pids(self) -> tuple[BlockView, ...]:
        """The PID controllers."""
        return tuple(view for view in self.views if view.is_pid)

    @cached_property
    def controllers(self) -> tuple[BlockView, ...]:
        """All controllers, with those that switch."""
        return tuple(view for view in self.views if view.type in LOOP_TYPES)

    def blocks_of_type(self, *types: str) -> list[BlockView]:
        """The blocks of some types."""
        return [view for view in self.views if view.type in types]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of everything that has a number; of two blocks with one name both."""
        layout = self.encoding.layout
        inner = (f"{instance.name}.{row.name}" for instance in layout.instances for row in instance.kind.table.rows)
        return (*layout.signals, *inner)

    @cached_property
    def _first_numbers(self) -> list[int]:
        """The number of each block's first parameter."""
        return [instance.base for instance in self.encoding.layout.instances]

    @cached_property
    def _row_numbers(self) -> dict[str, dict[str, int]]:
        """Where the parameters of each type stand among its rows."""
        kinds = {placed.kind.name: placed.kind for placed in self.encoding.items}
        return {name: {row.name: i for i, row in enumerate(kind.table.rows)} for name, kind in kinds.items()}

    def number(self, view: BlockView, key: str) -> int:
        """The number of a parameter."""
        return self._first_numbers[view.number] + self._row_numbers[view.type][key]

    def owner(self, number: int) -> tuple[BlockView, Parameter] | None:
        """The block and the parameter that a number stands for; None: a signal."""
        i = bisect_right(self._first_numbers, number) - 1
        if i < 0:
            return None
        return self.views[i], self.views[i].placed.kind.table.rows[number - self._first_numbers[i]]

    def pid_output(self, number: int) -> BlockView | None:
        """The PID controller whose MV a number is."""
        owner = self.owner(number)
        return owner[0] if owner is not None and owner[0].is_pid and owner[1].name == "MV" else None

    @cached_property
    def first_scan(self) -> FirstScan:
        """What its parameters hold when the program starts."""
        return FirstScan(self.config, self.encoding)


# --- Which way a change of a loop's MV goes: through the wires and blocks of the file back to its PV ------------------
#
# Only signs are followed: that of a value (1 not negative, -1 not positive, 0 nothing, None nobody knows) and that of
# its answer to a rise of MV. A process is a ControlLag or ControlDelayLag on the way, whose sign is that of Gs.
# Another PID controller on the way turns a rise of its set point into one of its MV, or with Direct into a fall.

Sign = int | None


class Signs(NamedTuple):
    """The sign of a value, and that of its answer to a rise of MV."""

    value: Sign
    response: Sign


MAX_DEPTH = 40
"""Blocks behind each other that are followed; beyond that the sign is unknown."""
PROCESS_BLOCKS = frozenset(("ControlLag", "ControlDelayLag"))
UNITY_GAIN_BLOCKS = frozenset(("ControlLowFilter", "ControlDelay"))
SELECTORS = frozenset(("ControlSelectMax", "ControlSelectMin"))
FALLING_OUTPUTS = {("MV1", 4), ("MV2", 1), ("MV2", 3)}
"""Outputs of ControlSplitRange, with the modes in which they fall when MV rises."""


def product_sign(a: Sign, b: Sign) -> Sign:
    """The sign of a product."""
    return 0 if 0 in (a, b) else None if a is None or b is None else a * b


def sum_sign(a: Sign, b: Sign) -> Sign:
    """The sign of a sum."""
    return b if a == 0 else a if b in {0, a} else None


def opposite_sign(a: Sign) -> Sign:
    """The other sign."""
    return None if a is None else -a


def sign_of(value: Decimal | float | None) -> Sign:
    """The sign of a number."""
    return None if value is None else (value > 0) - (value < 0)


def response_of_expression(expression: Expression, signs_of: Callable[[int], Signs]) -> Sign:
    """The sign with which an expression answers, from those of what it reads."""
    stack: list[Signs] = []
    for op, operand in zip(expression.code[::2], expression.code[1::2], strict=True):
        if op == grammar.CONSTANT:
            stack.append(Signs(sign_of(expression.constants[operand]), 0))
        elif op == grammar.SIGNAL:
            stack.append(signs_of(operand))
        elif op in {grammar.NEGATE, grammar.ABSOLUTE, grammar.ROOT}:
            stack.append(_unary_signs(op, stack.pop()))
        else:
            second = stack.pop()
            stack.append(_binary_signs(op, stack.pop(), second))
    return stack[-1].response


def _unary_signs(op: int, a: Signs) -> Signs:
    if op == grammar.NEGATE:
        return Signs(opposite_sign(a.value), opposite_sign(a.response))
    return Signs(1, product_sign(a.value, a.response) if op == grammar.ABSOLUTE else a.response)


def _binary_signs(op: int, a: Signs, b: Signs) -> Signs:
    if op == grammar.ADD:
        return Signs(sum_sign(a.value, b.value), sum_sign(a.response, b.response))
    if op == grammar.SUBTRACT:
        return Signs(sum_sign(a.value, opposite_sign(b.value)), sum_sign(a.response, opposite_sign(b.response)))
    if op in {grammar.MINIMUM, grammar.MAXIMUM}:
        strong = -1 if op == grammar.MINIMUM else 1
        value = strong if {strong, 0} & {a.value, b.value} else a.value if a.value == b.value else None
        return Signs(value, sum_sign(a.response, b.response))
    left, right = product_sign(a.response, b.value), product_sign(a.value, b.response)
    right = right if op == grammar.MULTIPLY else opposite_sign(right)
    return Signs(product_sign(a.value, b.value), sum_sign(left, right))


@dataclass
class FeedbackPath:
    """The way from a loop's MV to its PV."""

    context: ProgramContext
    loop: BlockView
    processes: list[BlockView] = field(default_factory=list)
    other_controllers: set[int] = field(default_factory=set)
    """The numbers of other controllers on the way."""
    _responses: dict[int, Sign] = field(default_factory=dict)
    _in_progress: set[int] = field(default_factory=set)

    def sign(self) -> Sign:
        """The sign with which PV answers to MV; 0 where they are not wired together, None where it is unknown."""
        return self._input_response(self.loop, "PV")

    def _input_response(self, view: BlockView, key: str) -> Sign:
        expression = view.wire(key)
        return 0 if expression is None else response_of_expression(expression, self._signs)

    def _signs(self, number: int) -> Signs:
        return Signs(self._value_sign(number), self._response(number))

    def _value_sign(self, number: int) -> Sign:
        """The sign of what a name holds: of a value, or of the limits of an output. The 0 of a signal tells nothing."""
        owner = self.context.owner(number)
        known = self.context.first_scan.find_value(number)
        is_output = owner is not None and owner[1].access == "output"
        if known is not None and not is_output and known.life != TRANSIENT and not isinstance(known.value, bool):
            return sign_of(known.value) or None
        if owner is None:
            return None
        view, key = owner[0], owner[1].name
        low, high = ("Min_OutVar", "Max_OutVar") if key == "OutVar" else ("MinMV", "MaxMV")
        if (
            key in view.placed.kind.model.model_fields
            or key not in {"OutVar", "MV"}
            or low not in view.placed.kind.model.model_fields
        ):
            return None
        ends = view.number_of(low), view.number_of(high)
        return 1 if ends[0] is not None and ends[0] >= 0 else -1 if ends[1] is not None and ends[1] <= 0 else None

    def _response(self, number: int) -> Sign:
        if number in self._responses:
            return self._responses[number]
        owner = self.context.owner(number)
        if owner is None:
            return 0
        view, row = owner
        if view is self.loop and row.name == "MV":
            return 1
        if number in self._in_progress or len(self._in_progress) > MAX_DEPTH:
            return None
        self._in_progress.add(number)
        result = self._parameter_response(view, row.name)
        self._in_progress.remove(number)
        self._responses[number] = result
        return result

    def _parameter_response(self, view: BlockView, key: str) -> Sign:
        """The answer of a parameter: of an input that of its wire, of an output that of the block."""
        if key in view.placed.kind.model.model_fields:
            return self._input_response(view, key)
        if view.is_pid:
            return self._controller_response(view, key)
        if view.type in SELECTORS and key == "MV":
            return sum_sign(self._input_response(view, "MV1"), self._input_response(view, "MV2"))
        if view.type == "ControlSplitRange" and key != "Error":
            direction = -1 if (key, view.item.Mode) in FALLING_OUTPUTS else 1
            return product_sign(direction, self._input_response(view, "MV"))
        return self._filter_response(view) if key == "OutVar" else None

    def _filter_response(self, view: BlockView) -> Sign:
        response = self._input_response(view, "InVar")
        if view.type in UNITY_GAIN_BLOCKS:
            return response
        if view.type in PROCESS_BLOCKS:
            if response != 0 and view not in self.processes:
                self.processes.append(view)
            return product_sign(response, sign_of(view.number_of("Gs")))
        return product_sign(response, sign_of(view.number_of("G"))) if view.type == "ControlLeadLag" else None

    def _controller_response(self, view: BlockView, key: str) -> Sign:
        """Another controller moves its MV so that its PV follows its set point."""
        if key != "MV":
            return None
        setpoint_response = self._input_response(view, "SP_CASC") if view.may_be_on("CASC") else 0
        if view.is_wired("CASC") or not view.is_on("CASC"):
            setpoint_response = sum_sign(setpoint_response, self._input_response(view, "SP"))
        if setpoint_response != 0:
            self.other_controllers.add(view.number)
        direct = view.is_on("Direct")
        action = None if direct is None else -1 if direct else 1
        return sum_sign(product_sign(action, setpoint_response), self._input_response(view, "BIAS"))


# --- How controllers hang together: masters and slaves of cascades, and the selectors of overrides --------------------

D218 = Decision(
    218,
    "what a cascade and an override are",
    "A loop whose SP_CASC reads the MV of another is the slave of that one; a loop whose MV is read by a selector is "
    "overridden by it. A special connection that is missing, crossed or of another loop is an error, one that comes "
    "from a signal a warning. SP_CASC wired to anything else is ratio control, of which nothing is demanded.",
    "The manual says which connections must be made; a signal may be logic of the program around, as the OR of two.",
)


Row = TypeVar("Row")


class Link(NamedTuple):
    """A cascade: the slave, its master, and whether the set point is the master's MV as it is, not a term of it."""

    slave: BlockView
    master: BlockView
    is_exact: bool


class SelectorInput(NamedTuple):
    """A loop at a selector: which of its inputs, and whether MV goes there as it is."""

    selector: BlockView
    number: int
    loop: BlockView
    is_exact: bool


class ConnectionFault(NamedTuple):
    """A special connection that is not as it must be: what it is instead, and how bad that is."""

    text: str
    severity: Severity


class LoopConnections:
    """All cascades and overrides of a configuration."""

    def __init__(self, context: ProgramContext) -> None:
        self.context = context
        self.links = list(self._find_links())
        self.selector_inputs = list(self._find_selector_inputs())
        self.links_by_master = _group_by_key(self.links, lambda link: link.master.number)
        self.links_by_slave = _group_by_key(self.links, lambda link: link.slave.number)
        self.inputs_by_loop = _group_by_key(self.selector_inputs, lambda entry: entry.loop.number)
        self.inputs_by_selector = _group_by_key(self.selector_inputs, lambda entry: entry.selector.number)

    def _find_links(self) -> Iterator[Link]:
        for slave in self.context.pids:
            expression = slave.wire("SP_CASC")
            for number in sorted(expression.signals) if expression is not None else ():
                master = self.context.pid_output(number)
                if expression is not None and master is not None:
                    yield Link(slave, master, expression.signal is not None)

    def _find_selector_inputs(self) -> Iterator[SelectorInput]:
        for selector in self.context.blocks_of_type(*SELECTORS):
            for n in (1, 2):
                expression = selector.wire(f"MV{n}")
                for number in sorted(expression.signals) if expression is not None else ():
                    loop = self.context.pid_output(number)
                    if expression is not None and loop is not None:
                        yield SelectorInput(selector, n, loop, expression.signal is not None)

    def masters(self) -> Iterator[tuple[BlockView, list[Link]]]:
        """The masters, each with its slaves; what is its own master is none."""
        for number, links in self.links_by_master.items():
            slaves = [link for link in links if link.slave.number != number]
            if slaves:
                yield slaves[0].master, slaves

    def role(self, view: BlockView) -> str:
        """A loop's part in cascades: ``only master``, ``slave and master``, ``only slave``; or empty."""
        is_slave = view.number in self.links_by_slave
        if view.number in self.links_by_master:
            return "slave and master" if is_slave else "only master"
        return "only slave" if is_slave else ""

    def overrides(self) -> Iterator[tuple[BlockView, SelectorInput, SelectorInput]]:
        """The selectors that have one loop at each input."""
        for inputs in self.inputs_by_selector.values():
            if [entry.number for entry in inputs] == [1, 2]:
                yield inputs[0].selector, inputs[0], inputs[1]

    @cached_property
    def _selector_outputs(self) -> dict[str, list[str]]:
        """The MV of the selectors that read a name."""
        readers: dict[str, list[str]] = defaultdict(list)
        for selector in self.context.blocks_of_type(*SELECTORS):
            for source in (selector.source("MV1"), selector.source("MV2")):
                if source is not None:
                    readers[source].append(f"{selector.name}.MV")
        return readers

    def downstream_outputs(self, selector: BlockView) -> set[str]:
        """The names of the MV that a selector, or one behind it, selects."""
        names: set[str] = set()
        pending = [f"{selector.name}.MV"]
        while pending:
            name = pending.pop()
            if name not in names:
                names.add(name)
                pending += self._selector_outputs.get(name, [])
        return names


def _group_by_key(rows: list[Row], key: Callable[[Row], int]) -> dict[int, list[Row]]:
    groups: dict[int, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def connection_fault(view: BlockView, key: str, output: set[str]) -> ConnectionFault | None:
    """What is wrong with a connection that must come from one of some names; not of a meaningless wire."""
    if not view.is_wired(key):
        value = view.known_value(key)
        text = f"{view.quote(key)}, not wired" if view.is_given(key) and value is not None else "not wired"
        return ConnectionFault(text, Severity.ERROR)
    expression = view.wire(key)
    if expression is None or view.source(key) in output:
        return None
    is_signal = expression.signal is not None and view.context.owner(expression.signal) is None
    return ConnectionFault(f"wired to {expression.text}", Severity.WARNING if is_signal else Severity.ERROR)


# --- What the NextoPID rules look at: the program, and how its controllers hang together ------------------------------


@frozen
class NextopidContext(ProgramContext):
    """A program with its cascades and overrides."""

    @cached_property
    def connections(self) -> LoopConnections:
        """Its cascades and overrides."""
        return LoopConnections(self)

    @cached_property
    def explained_paths(self) -> frozenset[Path]:
        """Places whose limits a rule of NextoPID's own explains better than the rules for every vendor."""
        gains = (
            (*view.placed.place, key)
            for view in self.pids
            for key in ("Ti_Ki", "Td_Kd")
            if self.has_time_as_gain(view, key)
        )
        names = (("loops", i, "name") for i, _ in enumerate(self.config.loops))  # capitals and small letters: NX604
        return frozenset((*gains, *names))

    def has_time_as_gain(self, view: BlockView, key: str) -> bool:
        """Whether a gain of the independent form is written with a unit of time."""
        return view.is_on("Indep") is True and isinstance(getattr(view.item, key), TimeNumber)
