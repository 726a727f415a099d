"""Where a vendor keeps the three numbers of a PID controller, and in which terms."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Literal, Protocol, cast, get_args

from pidcfg.frozen import frozen
from pidcfg.schemas.limits import limits_at

if TYPE_CHECKING:
    from pydantic import BaseModel

    from pidcfg.encoders.regmap import Codec, RegisterMap
    from pidcfg.schemas.limits import Limits

GainUnit = Literal["span", "percent", "engineering"]
"""``span``: share of the output's span per share of the PV's span; ``percent``: % of the output per PV unit;
``engineering``: output units per PV unit."""
FULL_OUTPUT = Decimal(100)
"""The output's span where nothing is said: 0 to 100 %."""


class Tuned(Protocol):
    """The three numbers of a vendor by name (times in s), and its words for the action."""

    @property
    def names(self) -> tuple[str, str, str]:
        """Gain, integral and derivative time."""

    @property
    def gain_unit(self) -> GainUnit:
        """What the gain is counted in."""

    @property
    def no_integral(self) -> Decimal:
        """What the integral time is written as where there is no integral term."""

    @property
    def heating(self) -> str:
        """The action of a loop whose PV rises with its output."""

    @property
    def cooling(self) -> str:
        """The action of the others."""

    def key(self, name: str) -> str:
        """Where a number stands in the configuration."""

    def unit(self, name: str) -> str:
        """The unit of a number."""

    def stored(self, name: str, value: Decimal) -> Decimal:
        """What the vendor holds of a number; raises `EncodeError`."""

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows."""

    def step(self, name: str) -> Decimal | None:
        """What two neighbours differ by; None: a number in floating point."""


@frozen
class TunedWords:
    """Registers of gain, integral and derivative time."""

    table: RegisterMap
    gain: str
    integral: str
    derivative: str
    gain_unit: GainUnit
    no_integral: Decimal
    heating: str
    cooling: str

    @property
    def names(self) -> tuple[str, str, str]:
        """The registers."""
        return self.gain, self.integral, self.derivative

    def key(self, name: str) -> str:
        """Where a register's value stands in the configuration."""
        return str(self.table.word(name).path)

    def unit(self, name: str) -> str:
        """The unit of a register."""
        return self.table.word(name).unit

    def stored(self, name: str, value: Decimal) -> Decimal:
        """What the register holds; raises `EncodeError`."""
        codec = cast("Codec", self.table.word(name).codec)
        held: Decimal = codec.decode(codec.encode(value))
        return held

    def limits(self, model: type[BaseModel], name: str) -> Limits | None:
        """What the manual allows for a register."""
        return limits_at(get_args(model.model_fields["loops"].annotation)[0], self.key(name))

    def step(self, name: str) -> Decimal | None:
        """What two neighbours differ by; None: a register in floating point."""
        return getattr(self.table.word(name).codec, "step", None)


@frozen
class LoopTuning:
    """How one loop of a file holds the three numbers, and what of it the gains of a rule depend on."""

    words: Tuned
    raises_pv: bool | None = None
    """Whether the loop acts for a PV that rises with the output; None: a program decides."""
    pv_span: Decimal | None = None
    """PV units that the gain is a share of, where it is one; None: the file does not say."""
    output_span: Decimal | None = None
    """Output units from 0 to 100 %; None: the file does not say, so they are 0 to 100."""
    independent: bool = False
    """Integral and derivative gains (Ki in 1/s, Kd in s) stand in the place of the times."""
    minutes: bool = False
    """The integral time is held in minutes."""
    now: tuple[Decimal | None, Decimal | None, Decimal | None] = (None, None, None)
    """What the loop holds at present, each in the unit of its word; None: an expression."""
    wrong: str = ""
    """Why the gains of a rule would not act as they should."""
    no_derivative: str = ""
    """Why a derivative time would have no effect."""
    off: tuple[str, str] = ("0", "0")
    """How the file says that there is no integral term, and no derivative."""
    sample_time: float | None = None
    """Time between two calculations, in s; None: no file says it."""
    pv_share: float = 1.0
    """What the filter of the PV takes of a difference in each sample."""
    derivative_share: float = 1.0
    """What the filter of the derivative takes."""
    derivative_limit: float | None = None
    """The derivative time over the time constant of its filter; None: ``derivative_share`` says it."""

    def units(self) -> tuple[str, str, str]:
        """Of the gain, the integral and the derivative number."""
        gain, _, derivative = (self.words.unit(name) for name in self.words.names)
        return gain, "1/s" if self.independent else "min" if self.minutes else "s", derivative
