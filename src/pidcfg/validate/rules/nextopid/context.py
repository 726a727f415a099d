"""What the NextoPID rules look at: each block with the values that are known of it, and what its wires lead to.

A literal is known. Of a wire the value is known where it is nothing but a name: of a signal, whose first value counts
and is quoted as such, or of another block's parameter that has a value (D208). All other wires are judged by nobody.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard

from pidcfg.encoders.maps.nextopid import LOOP_TYPES
from pidcfg.encoders.named import store
from pidcfg.encoders.words import EncodeError
from pidcfg.refs import Decision
from pidcfg.schemas.base import decimal_text
from pidcfg.schemas.iec import Timed, Wire
from pidcfg.validate.rule import Finding

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path, Severity
    from pidcfg.encoders.nextopid.encode import NextopidEncoding, Placed
    from pidcfg.schemas.expressions import Expression
    from pidcfg.schemas.iec import IecType
    from pidcfg.schemas.nextopid import NextopidFile

D208 = Decision(
    208, "rules judge a signal by its first value",
    "A parameter that is wired to nothing but a signal is judged by the signal's first value, which the message names; "
    "one that is wired to a parameter with a value, by that. Expressions and outputs are not judged.",
    "The first value is what the program starts with; what comes later is not in the file.",
)  # fmt: skip

PV_KEYS = frozenset(("SP", "SP_CASC", "PV", "MaxPV", "MinPV", "DeadBand"))
MV_KEYS = frozenset(("MV", "MaxMV", "MinMV", "ManualMV", "BIAS", "TRK_VAL", "MaxVarMV"))
TIMES = frozenset(("Tfd", "Tc", "Tlead", "Tlag", "DelayTime"))
ON_OFF = "ControlON_OFF"
SHORTEST_INTEGRAL = Decimal("0.001")
"""Seconds: a shorter integral time of the dependent form means no integral."""


class Known(NamedTuple):
    """The value of a parameter, and in words where it is from, if not from the parameter itself."""

    value: Any
    source: str = ""


@dataclass(frozen=True)
class BlockView:
    """A block or loop, its place in the file, and what is known of its parameters."""

    context: NextopidContext
    number: int
    own: Placed

    @property
    def name(self) -> str:
        """The instance's name."""
        return self.own.item.name

    @property
    def type(self) -> str:
        """The block's type."""
        return self.own.kind.name

    @property
    def item(self) -> Any:
        """The block as the schema has it."""
        return self.own.item

    @property
    def is_pid(self) -> bool:
        """Whether it is a PID controller."""
        return self.type in LOOP_TYPES and self.type != ON_OFF

    def given(self, key: str) -> bool:
        """Whether the file says anything about a parameter."""
        return key in self.item.model_fields_set

    def known(self, key: str) -> Known | None:
        """The value of a parameter as the PLC holds it; None: nobody knows it, or another rule says it is wrong."""
        return self.context.known(self.context.number(self, key), frozenset())

    def number_of(self, key: str) -> Decimal | None:
        """The value of a numeric parameter."""
        found = self.known(key)
        return None if found is None else Decimal(found.value)

    def is_on(self, key: str) -> bool | None:
        """The value of a switch; None: it is wired to what nobody knows."""
        found = self.known(key)
        return None if found is None else bool(found.value)

    def may_be_on(self, key: str) -> bool:
        """Whether a switch is on, or can be switched on by a wire."""
        return self.is_wired(key) or bool(self.is_on(key))

    def wire(self, key: str) -> Expression | None:
        """What a parameter is wired to."""
        return self.context.encoding.wires.get((self.number, key))

    def is_wired(self, key: str) -> bool:
        """Whether a parameter has a wire, even one without meaning."""
        return isinstance(getattr(self.item, key), Wire)

    def source(self, key: str) -> str | None:
        """The name of what a parameter is wired to, where the wire is nothing but a name."""
        expression = self.wire(key)
        return None if expression is None or expression.signal is None else self.context.names[expression.signal]

    @cached_property
    def sample_time(self) -> Decimal:
        """The interval of its calls in s."""
        own: Decimal | None = getattr(self.item, "sample_time", None)
        return self.context.config.plc.sample_time if own is None else own

    @property
    def time_place(self) -> Path:
        """Where the interval of its calls is written."""
        own = getattr(self.item, "sample_time", None) is not None
        return (*self.own.place, "sample_time") if own else ("plc", "sample_time")

    @cached_property
    def mv_limits(self) -> tuple[Decimal, Decimal] | None:
        """The limits of MV; None where one is not known, or where they leave no room."""
        return self._pair("MinMV", "MaxMV")

    @cached_property
    def pv_limits(self) -> tuple[Decimal, Decimal] | None:
        """The limits of PV; None where one is not known, or where they leave no room."""
        return self._pair("MinPV", "MaxPV")

    def _pair(self, low: str, high: str) -> tuple[Decimal, Decimal] | None:
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
        if time < SHORTEST_INTEGRAL:
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
        if key in TIMES or (key in {"Ti_Ki", "Td_Kd"} and self.is_on("Indep") is False):
            return " s"
        part = "pv" if key in PV_KEYS else "output" if key in MV_KEYS else ""
        unit = getattr(getattr(self.item, part, None), "unit", None) if part else None
        return f" {unit}" if unit else ""

    def shown(self, key: str) -> str:
        """The value of a parameter with unit and origin; only where it is known."""
        found = self.known(key)
        return "unknown" if found is None else f"{number_text(found.value)}{self.unit(key)}{found.source}"

    def find(
        self, key: str, /, plc_effect: str | None = None, severity: Severity | None = None, **values: Any
    ) -> Finding:
        """A finding at one of its keys."""
        return Finding((*self.own.place, *key.split(".")), values, plc_effect=plc_effect, severity=severity)


@dataclass(frozen=True)
class NextopidContext:
    """A configuration with its encoding, and its blocks one by one."""

    config: NextopidFile
    encoding: NextopidEncoding

    @cached_property
    def views(self) -> tuple[BlockView, ...]:
        """All blocks, then all loops, in the order of the file."""
        return tuple(BlockView(self, i, own) for i, own in enumerate(self.encoding.items))

    @cached_property
    def pids(self) -> tuple[BlockView, ...]:
        """The PID controllers."""
        return tuple(view for view in self.views if view.is_pid)

    @cached_property
    def controllers(self) -> tuple[BlockView, ...]:
        """All controllers, with those that switch."""
        return tuple(view for view in self.views if view.type in LOOP_TYPES)

    def of(self, *types: str) -> list[BlockView]:
        """The blocks of some types."""
        return [view for view in self.views if view.type in types]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of everything that has a number; of two blocks with one name both."""
        layout = self.encoding.layout
        inner = (f"{own.name}.{row.name}" for own in layout.instances for row in own.kind.table.rows)
        return (*layout.signals, *inner)

    def number(self, view: BlockView, key: str) -> int:
        """The number of a parameter."""
        own = self.encoding.layout.instances[view.number]
        return own.base + next(i for i, row in enumerate(own.kind.table.rows) if row.name == key)

    def owner(self, number: int) -> tuple[BlockView, str] | None:
        """The block and parameter that a number stands for; None: a signal."""
        i = self.encoding.layout.owner(number)
        if i is None:
            return None
        own = self.encoding.layout.instances[i]
        return self.views[i], own.kind.table.rows[number - own.base].name

    def pid_output(self, number: int) -> BlockView | None:
        """The PID controller whose MV a number is."""
        found = self.owner(number)
        return found[0] if found is not None and found[0].is_pid and found[1] == "MV" else None

    def known(self, number: int, seen: frozenset[int]) -> Known | None:
        """The value of a signal or parameter, as far as it is in the file."""
        layout = self.encoding.layout
        found = self.owner(number)
        if found is None:
            name = self.names[number]
            content = held(layout.signals[name], self.config.signals[name])
            return None if content is None else Known(content, f" (first value of {name})")
        view, key = found
        value = getattr(view.item, key, None) if layout.is_input(number) else None
        if not isinstance(value, Wire):
            content = held(layout.types[self.names[number]], value)
            return None if content is None else Known(content)
        expression = view.wire(key)
        if expression is None or expression.signal is None or expression.signal in seen:
            return None
        inner = self.known(expression.signal, seen | {number})
        is_signal = self.owner(expression.signal) is None
        return inner if inner is None or is_signal else Known(inner.value, f" (of {self.names[expression.signal]})")

    @cached_property
    def explained(self) -> frozenset[Path]:
        """Places whose limits a rule of NextoPID's own explains better than the rules for every vendor."""
        return frozenset(
            (*view.own.place, key)
            for view in self.pids for key in ("Ti_Ki", "Td_Kd")
            if self.has_time_as_gain(view, key)
        )  # fmt: skip

    def has_time_as_gain(self, view: BlockView, key: str) -> bool:
        """Whether a gain of the independent form is written with a unit of time."""
        return view.is_on("Indep") is True and isinstance(getattr(view.item, key), Timed)


def held(kind: IecType, value: Any) -> Any:
    """A value as the PLC holds it: a Decimal or a switch; None for one that it cannot hold, or for none at all."""
    if value is None:
        return None
    try:
        content = store(kind, value)
    except EncodeError:
        return None
    return content if isinstance(content, bool) else Decimal(repr(content))


def all_known(values: tuple[Decimal | None, ...]) -> TypeGuard[tuple[Decimal, ...]]:
    """Whether none of some values is unknown."""
    return None not in values


def number_text(value: Any) -> str:
    """A value as people write it; more than 12 digits are shortened."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    text = decimal_text(Decimal(value))
    return text if len(text) <= 12 else f"{float(value):.6g}"
