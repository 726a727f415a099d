"""The blocks and loops of a NextoPID program as the rules see them: what is known of their parameters, and their wires.

A literal is known. Of a wire the value is known where it is nothing but a name: of a signal, whose first value counts
and is quoted as such, or of another block's parameter that has a value (D208). No rule judges other wires.
"""

from __future__ import annotations

from bisect import bisect_right
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.maps.nextopid import LOOP_TYPES
from pidcfg.encoders.nextopid.encode import NextopidEncoding, Placed
from pidcfg.frozen import frozen
from pidcfg.paths import steps, value_at
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL, NextopidFile
from pidcfg.validate.rule import Finding
from pidcfg.validate.rules.nextopid.known import Known, all_known, held, value_text
from pidcfg.validate.views import Context

if TYPE_CHECKING:
    from pidcfg.diagnostics import Severity
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.schemas.expressions import Expression

PV_KEYS = frozenset(("SP", "SP_CASC", "PV", "MaxPV", "MinPV", "DeadBand"))
MV_KEYS = frozenset(("MV", "MaxMV", "MinMV", "ManualMV", "BIAS", "TRK_VAL", "MaxVarMV"))
TIMES = frozenset(("Tfd", "Tc", "Tlead", "Tlag", "DelayTime"))
ON_OFF = "ControlON_OFF"
TIME_CONSTANTS = {"ControlLowFilter": "Tc", "ControlLag": "Tc", "ControlDelayLag": "Tc", "ControlLeadLag": "Tlag"}
"""The parameter of filters and lags that is their time constant."""


@frozen
class BlockView:
    """A block or loop, its place in the file, and what is known of its parameters."""

    context: Program
    number: int
    placed: Placed

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

    def known(self, key: str) -> Known | None:
        """The value of a parameter as the PLC holds it; None where it is unknown, or wrong by another rule."""
        return self.context.known(self.context.number(self, key))

    def number_of(self, key: str) -> Decimal | None:
        """The value of a numeric parameter."""
        known = self.known(key)
        return None if known is None else Decimal(known.value)

    def is_on(self, key: str) -> bool | None:
        """The value of a switch; None where it is wired to an unknown value."""
        known = self.known(key)
        return None if known is None else bool(known.value)

    def may_be_on(self, key: str) -> bool:
        """Whether a switch is on, or can be switched on by a wire that has a meaning."""
        return self.wire(key) is not None or bool(self.is_on(key))

    def wire(self, key: str) -> Expression | None:
        """What a parameter is wired to."""
        return self.context.encoding.wires.get((self.number, key))

    def is_wired(self, key: str) -> bool:
        """Whether a parameter has a wire, even one without meaning."""
        return isinstance(value_at(self.item, steps(key)), Wire)

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
        known = self.known(key)
        return "unknown" if known is None else f"{value_text(known.value)}{self.unit(key)}{known.source}"

    def at(
        self, key: str, /, plc_effect: str | None = None, severity: Severity | None = None, **values: Any
    ) -> Finding:
        """A finding at one of its keys."""
        return Finding((*self.placed.place, *steps(key)), values, plc_effect=plc_effect, severity=severity)


@frozen
class Program(Context[NextopidFile, NextopidEncoding]):
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

    def of(self, *types: str) -> list[BlockView]:
        """The blocks of some types."""
        return [view for view in self.views if view.type in types]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The name of everything that has a number; of two blocks with one name both."""
        layout = self.encoding.layout
        inner = (f"{instance.name}.{row.name}" for instance in layout.instances for row in instance.kind.table.rows)
        return (*layout.signals, *inner)

    @cached_property
    def _bases(self) -> list[int]:
        """The number of each block's first parameter."""
        return [instance.base for instance in self.encoding.layout.instances]

    @cached_property
    def _rows(self) -> dict[str, dict[str, int]]:
        """Where the parameters of each type stand among its rows."""
        kinds = {placed.kind.name: placed.kind for placed in self.encoding.items}
        return {name: {row.name: i for i, row in enumerate(kind.table.rows)} for name, kind in kinds.items()}

    def number(self, view: BlockView, key: str) -> int:
        """The number of a parameter."""
        return self._bases[view.number] + self._rows[view.type][key]

    def owner(self, number: int) -> tuple[BlockView, Parameter] | None:
        """The block and the parameter that a number stands for; None: a signal."""
        i = bisect_right(self._bases, number) - 1
        if i < 0:
            return None
        return self.views[i], self.views[i].placed.kind.table.rows[number - self._bases[i]]

    def pid_output(self, number: int) -> BlockView | None:
        """The PID controller whose MV a number is."""
        owner = self.owner(number)
        return owner[0] if owner is not None and owner[0].is_pid and owner[1].name == "MV" else None

    @cached_property
    def _values(self) -> dict[int, Known | None]:
        """Values that have been looked up, by number."""
        return {}

    def known(self, number: int) -> Known | None:
        """The value of a signal or parameter, as far as it is in the file."""
        if number not in self._values:
            self._values[number] = self._look_up(number)
        return self._values[number]

    def _look_up(self, number: int) -> Known | None:
        source = ""
        seen: set[int] = set()
        while number not in seen:
            seen.add(number)
            owner = self.owner(number)
            if owner is None:
                return self._first_value(self.names[number])
            view, row = owner
            value = value_at(view.item, steps(row.name)) if row.access == "input" else None
            if not isinstance(value, Wire):
                content = held(row.type, value)
                return None if content is None else Known(content, source)
            expression = view.wire(row.name)
            if expression is None or expression.signal is None:
                return None
            number = expression.signal
            source = f" (of {self.names[number]})"
        return None

    def _first_value(self, name: str) -> Known | None:
        content = held(self.encoding.layout.signals[name], self.config.signals[name])
        return None if content is None else Known(content, f" (first value of {name})")
