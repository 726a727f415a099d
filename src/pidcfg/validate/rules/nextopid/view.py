"""A block or loop as the NextoPID rules see it: what is known of its parameters, and how people write that."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard

from pidcfg.encoders.maps.nextopid import LOOP_TYPES
from pidcfg.paths import steps
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL
from pidcfg.validate.rule import Finding
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.diagnostics import Path, Severity
    from pidcfg.encoders.nextopid.encode import Placed
    from pidcfg.schemas.expressions import Expression
    from pidcfg.validate.rules.nextopid.context import NextopidContext

PV_KEYS = frozenset(("SP", "SP_CASC", "PV", "MaxPV", "MinPV", "DeadBand"))
MV_KEYS = frozenset(("MV", "MaxMV", "MinMV", "ManualMV", "BIAS", "TRK_VAL", "MaxVarMV"))
TIMES = frozenset(("Tfd", "Tc", "Tlead", "Tlag", "DelayTime"))
ON_OFF = "ControlON_OFF"


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
        return self.context.known(self.context.number(self, key))

    def number_of(self, key: str) -> Decimal | None:
        """The value of a numeric parameter."""
        found = self.known(key)
        return None if found is None else Decimal(found.value)

    def is_on(self, key: str) -> bool | None:
        """The value of a switch; None: it is wired to what nobody knows."""
        found = self.known(key)
        return None if found is None else bool(found.value)

    def may_be_on(self, key: str) -> bool:
        """Whether a switch is on, or can be switched on by a wire that has a meaning."""
        return self.wire(key) is not None or bool(self.is_on(key))

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
        return "unknown" if found is None else f"{value_text(found.value)}{self.unit(key)}{found.source}"

    def at(
        self, key: str, /, plc_effect: str | None = None, severity: Severity | None = None, **values: Any
    ) -> Finding:
        """A finding at one of its keys."""
        return Finding((*self.own.place, *steps(key)), values, plc_effect=plc_effect, severity=severity)


def all_known(values: tuple[Decimal | None, ...]) -> TypeGuard[tuple[Decimal, ...]]:
    """Whether none of some values is unknown."""
    return None not in values


def value_text(value: object) -> str:
    """A number or a switch as people write it."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return number_text(Decimal(str(value)))
