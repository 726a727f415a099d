"""What a DL06 configuration file may say: every word and bit of the loop table in engineering units.

Quantities are in the units of ``pv.range`` or ``output.range``, raw where there is no range; ``"2048 counts"`` is
always raw. A value beside ``…enabled: false`` is stored in its word while the bit that switches it on stays off.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Literal, NamedTuple

from pydantic import BeforeValidator, Field, WithJsonSchema, model_validator

from pidcfg.schemas.base import (
    DURATION_TEXT,
    RESET_UNIT,
    AnyQuantity,
    AnyRate,
    ConfigurationFile,
    Duration,
    Flag,
    Integer,
    Limits,
    LoopNameSettings,
    Minutes,
    Model,
    Name,
    Number,
    Parser,
    QuantityPair,
    Range,
    Seconds,
    SectionSettings,
    Text,
    VAddress,
    parse_duration,
)
from pidcfg.schemas.numbers import number_schema, parse_integer, refuse
from pidcfg.text.references import DL06

FEATURES = DL06.cite("PID Loop Feature Specifications")
SETUP = DL06.cite("Loop Table and Number of Loops")
FILTER = DL06.cite("The DL06 Built-in Analog Filter")
RAMP_SOAK = DL06.cite("Ramp/Soak Table")
TRANSFER = DL06.cite("PV Auto Transfer (Addr + 36)")
DERIVATIVE_LIMIT = DL06.cite("Derivative Gain Limiting")

DataFormat = Literal["12-bit unipolar", "12-bit bipolar", "15-bit unipolar", "15-bit bipolar", "16-bit unipolar"]
Mode = Literal["manual", "auto", "cascade"]


class Reset(NamedTuple):
    """A reset time; ``duration`` None switches the integral term off, by 0000 or, with ``is_9999``, by 9999."""

    duration: Duration | None
    is_9999: bool = False

    def __str__(self) -> str:
        return str(self.duration) if self.duration is not None else OFF_9999 if self.is_9999 else "off"


OFF_9999 = "off 9999"
"""The other word that switches the integral term off; the manual's tuning checklist writes it."""


def parse_reset(value: object) -> Reset:
    """A duration (bare: in ``reset_unit``), ``off`` or ``off 9999``."""
    if isinstance(value, Reset):
        return value
    return Reset(None, is_9999=value == OFF_9999) if value in ("off", OFF_9999) else Reset(parse_duration(value))


AnyReset = Annotated[
    Reset, Parser(parse_reset), WithJsonSchema(number_schema(DURATION_TEXT, {"enum": ["off", OFF_9999]}))
]


class Plc(Model):
    """The set-up words of the CPU, and what the loop table cannot say about it."""

    loop_table: VAddress
    """Start of the loop table, the pointer in V7640; 32 words a loop follow from here."""
    number_of_loops: Annotated[Integer, Limits("0", "8", "", SETUP)] | None = None
    """V7641. Follows from the list of loops; another value is only useful to see a wrong set-up fail."""
    reset_decimals: Annotated[Literal[1, 2], BeforeValidator(parse_integer)] = 1
    """Implied decimals of the reset word: the manual's feature table says 1 (0.1 to 999.8), its text says 2."""
    derivative: Literal["error", "pv"] = "error"
    """What the rate term acts on: the error as printed for the DL06, the PV on other CPUs of the family."""


class Tuning(Model):
    """The P, I and D terms."""

    gain: Annotated[Number, Limits("0", "99.99", "%/%", FEATURES)]
    """Gain Kc, fraction of output span per fraction of PV span. 0 switches the proportional term off."""
    reset: Annotated[AnyReset, Limits("0", "999.8", RESET_UNIT, FEATURES)] = Reset(None)
    """Reset (integral) time Ti, a bare number in `reset_unit`; `off` (0000) and `off 9999` switch the integral off."""
    reset_unit: Literal["seconds", "minutes"] = "seconds"
    """Unit of the reset word."""
    rate: Annotated[Seconds, Limits("0", "99.99", "s", FEATURES)] = Decimal(0)
    """Rate (derivative) time Td; 0 switches the derivative term off."""


class Transfer(Model):
    """Where the CPU itself fetches the PV or writes the output: a channel of an analog module, or a V-memory word."""

    base: Annotated[Integer, Limits("0", "0", "", TRANSFER)] = 0
    """Base number; the DL06 has only its own base, 0."""
    slot: Annotated[Integer, Limits("1", "4", "", TRANSFER)] | None = None
    """Slot of the option card."""
    channel: Annotated[Integer, Limits("1", "16", "", TRANSFER)] | None = None
    """Channel of the card."""
    address: VAddress | None = None
    """V-memory word to read the PV from, in place of slot and channel."""

    @model_validator(mode="after")
    def _check_form(self) -> Transfer:
        if (self.address is None) == (self.slot is None and self.channel is None):
            refuse("transfer_form", "a transfer has either slot and channel, or address")
        if self.address is None and (self.slot is None or self.channel is None):
            refuse("transfer_form", "a transfer needs both slot and channel")
        return self


class Pv(Model):
    """The process variable: its scale, format and conditioning."""

    range: Range | None = None
    """Engineering values at 0 % and 100 % of the data format. Without it every quantity on this scale is raw counts."""
    unit: Text | None = None
    """Engineering unit, for reports only."""
    format: DataFormat = "12-bit unipolar"
    """Data format of SP and PV, and of the output unless `output.format` is given."""
    square_root: Flag = False
    """Square-root extract for a differential-pressure flow signal; rescales the set point."""
    filter: Annotated[Number, Limits("0", "999.9", "", FILTER)] | None = None
    """Low-pass filter constant k of y += k (x - y), 0.1 (strong) to 1.0 (none)."""
    filter_enabled: Flag | None = None
    """The filter's bit; on when `filter` is given."""
    transfer: Transfer | None = None
    """Auto transfer of the PV; without it the ladder program writes the PV word."""


class Setpoint(Model):
    """The set point and its limits."""

    value: AnyQuantity | None = None
    """Set point."""
    limits: QuantityPair | None = None
    """Lowest and highest set point that the calculation uses."""
    limits_enabled: Flag | None = None
    """The bit of the limits; on when `limits` is given."""


class Output(Model):
    """The control output: its scale and limits."""

    range: Range | None = None
    """Engineering values at 0 % and 100 % of the data format."""
    unit: Text | None = None
    """Engineering unit, for reports only."""
    format: DataFormat | None = None
    """A data format of its own; without it the output has the PV's."""
    limits: QuantityPair | None = None
    """Lowest and highest output; the ends of the data range when not given."""
    transfer: Transfer | None = None
    """Auto transfer of the output; without it the ladder program reads the output word."""


class Error(Model):
    """What happens to the error term before the calculation."""

    curve: Literal["linear", "squared"] = "linear"
    """Linear, or squared with the sign kept."""
    deadband: AnyQuantity | None = None
    """An error up to this size counts as zero."""
    deadband_enabled: Flag | None = None
    """The deadband's bit; on when `deadband` is given."""


class PvAlarms(Model):
    """Alarms on the PV itself. One bit enables all four, and the PLC wants low_low < low < high < high_high."""

    low_low: AnyQuantity | None = None
    """Low-low alarm: on while the PV is below."""
    low: AnyQuantity | None = None
    """Low alarm."""
    high: AnyQuantity | None = None
    """High alarm: on while the PV is above."""
    high_high: AnyQuantity | None = None
    """High-high alarm."""
    enabled: Flag | None = None
    """The bit of the four alarms; on when any is given."""


class DeviationAlarms(Model):
    """Alarms on the distance between PV and set point; the PLC wants yellow < red."""

    yellow: AnyQuantity | None = None
    """Yellow deviation, cautionary."""
    red: AnyQuantity | None = None
    """Red deviation, strong error."""
    enabled: Flag | None = None
    """The bit of the two alarms; on when any is given."""


class Alarms(Model):
    """The loop's alarms."""

    pv: PvAlarms | None = None
    """Absolute alarms of the PV."""
    deviation: DeviationAlarms | None = None
    """Deviation alarms."""
    rate_of_change: AnyRate | None = None
    """Largest change of the PV per sample; `15 /min` and `0.25 /s` are converted with the sample rate."""
    rate_of_change_enabled: Flag | None = None
    """The bit of the rate-of-change alarm; on when `rate_of_change` is given."""
    hysteresis: AnyQuantity | None = None
    """How far the PV must return through a threshold before its alarm goes off; 1 count when not given."""


class RampSoakStep(Model):
    """A ramp and the soak that follows it; all zeros is an unused pair."""

    ramp_to: AnyQuantity
    """Set point at the end of the ramp."""
    slope: AnyQuantity
    """Slope of the ramp per second, always positive; 0 ends the profile."""
    soak: Annotated[Minutes, Limits("0", "999.9", "min", RAMP_SOAK)] = Decimal(0)
    """Time to stay at the set point."""
    deviation: AnyQuantity | None = None
    """Allowed deviation of the PV while soaking; none when not given."""


class RampSoak(Model):
    """The ramp/soak generator of a loop."""

    table: VAddress
    """Start of its table of 32 words."""
    enabled: Flag = True
    """The generator's bit; without it the controls in +33 do nothing."""
    steps: Annotated[tuple[RampSoakStep, ...], Field(max_length=8)] | None = None
    """Up to eight pairs of ramp and soak; when not given, the table itself is left alone."""
    request: Literal["none", "start", "hold", "resume", "jog"] = "none"
    """Control bit that is already set in the image."""


class Autotune(Model):
    """What the auto-tune procedure would do."""

    method: Literal["open", "closed"] = "closed"
    """Open loop (step response, in Manual) or closed loop (relay, in Auto)."""
    type: Literal["PID", "PI"] = "PID"
    """Gains to compute; PI leaves the rate at 0."""
    start: Flag = False
    """The start bit; set in an image it starts tuning as soon as the PLC runs."""


class State(Model):
    """Words that the controller itself writes, as they stand in a memory listing; 0 when not given."""

    pv: AnyQuantity | None = None
    """PV word."""
    bias: AnyQuantity | None = None
    """Bias word."""
    output: AnyQuantity | None = None
    """Control output word."""


class Loop(Model):
    """One PID loop: 32 words of the loop table."""

    name: Name
    """Tag of the loop, unique in the file."""
    description: Text | None = None
    """What the loop does, for reports."""
    mode: Mode = "manual"
    """The mode the loop is meant to run in; the request bits themselves are encoded as 0."""
    cascade_from: Name | None = None
    """Name of the major loop whose output is this loop's remote set point."""
    remote_setpoint: VAddress | None = None
    """The remote set point pointer as an address, where it is not another loop's output."""
    sample_rate: Annotated[Seconds, Limits("0.05", "99.99", "s", FEATURES)]
    """Time between two calculations, in seconds or with a unit (`200 ms`)."""
    algorithm: Literal["position", "velocity"] = "position"
    """Form of the PID equation."""
    action: Literal["direct", "reverse"]
    """The process's action: direct when the PV rises with the output (heating), reverse when it falls (cooling)."""
    bumpless: Literal["I", "II"] = "I"
    """Transfer to Auto: I sets bias and set point, II the bias only."""
    bias_freeze: Flag = False
    """Stops the integrator while the output is at an end of the data range (anti-windup)."""
    independent_of_cpu_mode: Flag = False
    """The loop keeps running while the CPU is in Program mode; needs auto transfer of PV and output."""
    tuning: Tuning
    """Gain, reset and rate."""
    derivative_gain_limit: Annotated[Number, Limits("0", "20", "", DERIVATIVE_LIMIT)] | None = None
    """Derivative gain limit, 1 to 20; off when not given."""
    derivative_gain_limit_enabled: Flag | None = None
    """The limit's bit; on when `derivative_gain_limit` is given."""
    pv: Pv = Pv()
    """Process variable."""
    setpoint: Setpoint = Setpoint()
    """Set point."""
    output: Output = Output()
    """Control output."""
    error: Error = Error()
    """Error term."""
    alarms: Alarms = Alarms()
    """Alarms."""
    ramp_soak: RampSoak | None = None
    """Ramp/soak generator."""
    autotune: Autotune = Autotune()
    """Auto-tune selections."""
    state: State = State()
    """Words that the controller writes."""


class Dl06File(ConfigurationFile):
    """A DL06 configuration: the CPU's set-up words and up to eight loops, in the order of the loop table."""

    vendor: Literal["dl06"]
    plc: Plc
    """Set-up of the CPU."""
    loops: tuple[Loop, ...]
    """The loops; the first is loop 1 of the table."""


class Scaling(Model):
    """The scale of a variable, which no register holds."""

    range: Range | None = None
    """Engineering values at 0 % and 100 % of the data format."""
    unit: Text | None = None
    """Engineering unit."""


class LoopSettings(LoopNameSettings):
    """What stands beside the words of one loop in a memory listing."""

    mode: Mode = "manual"
    """The mode the loop is meant to run in."""
    pv: Scaling = Scaling()
    """Scale of PV and set point."""
    output: Scaling = Scaling()
    """Scale of the output."""
    setpoint: Flag = True
    """Whether the set point word is meant; false: the configuration leaves the set point to the operator."""


class PlcSettings(SectionSettings):
    """What stands beside the words for the whole file."""

    reset_decimals: Literal[1, 2] = 1
    """Implied decimals of the reset words."""
    derivative: Literal["error", "pv"] = "error"
    """What the rate term acts on."""
