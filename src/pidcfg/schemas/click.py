"""CLICK configurations: one field for each parameter of a loop's C, DS and DF blocks.

Quantities on the PV's scale are engineering units, which is what the PLC's floats hold; the output is in % by default.
"""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Annotated, Literal

from pydantic import BeforeValidator, WithJsonSchema

from pidcfg.schemas.base import (
    DURATION_TEXT,
    UNIT_RATE_SCHEMA,
    BankRange,
    ConfigurationFile,
    Flag,
    Integer,
    Limits,
    LoopNameSettings,
    Model,
    Name,
    Number,
    Parser,
    Range,
    Rate,
    Seconds,
    SectionSettings,
    Text,
    pair_schema,
    parse_duration,
    parse_pair,
    parse_rate,
)
from pidcfg.schemas.numbers import NUMBER, parse_integer, parse_number, refuse, text_schema
from pidcfg.text.references import CLICK, CLICK_ERRORS, Decision

D100 = Decision(
    100,
    "the first word of a nickname's comment is the bit at 0",
    "Cn+06 off is open loop, Cn+07 off is PID, Cn+09 off is forward (direct); Cn+08 off is bumpless mode 1 as printed.",
    "The help prints the meaning of the states for Cn+08 only. A wrong reading of Cn+09 is a runaway, so a warning and "
    "a line of the checklist stay until the file says `action_verified: true`.",
)
D101 = Decision(
    101,
    "autotune output hysteresis is 1 to 10",
    "Every image holds a value from 1 to 10 in DFn+21, also where no autotune is meant; another one is error 200.",
    "Neither topic prints the limits; users report error 200 on a fresh PLC, whose register holds 0.",
)
D620 = Decision(
    620,
    "a process range that does not ascend is a finding, and no reason not to read a PLC",
    "`pv.range` may be [0, 0] or descend: it is encoded, decoded and simulated as it stands, and an error of "
    "`pidcfg validate`. Rules that measure by its width say nothing then, and a run shows 0 to 100.",
    "DFn+22 and DFn+23 hold 0 in a PLC into which nothing was written, which the help calls the first cause of errors; "
    "neither topic lists an error for them. The equation does not use them, only the autotune does.",
)

PID_ERRORS = CLICK_ERRORS.cite("CLICK PID Errors")

ERROR_PREFIX = "CLICK error "
"""What the PLC reports, before its number."""
SAMPLE_RATE = Limits("0.1", "30", "s", CLICK.cite("Sample Rate(TS)"), f"{ERROR_PREFIX}10")
GAIN_LIMIT = Limits("0", "100", "", CLICK.cite("Derivative Gain Limit"), f"{ERROR_PREFIX}11")
PWM_PERIOD = Limits("1", "600", "s", CLICK.cite("PWM Control"), f"{ERROR_PREFIX}12")
FILTER = Limits("1", "100", "%", CLICK.cite("PV Filter"), f"{ERROR_PREFIX}13")
DEADBAND = Limits("0", None, "", PID_ERRORS, f"{ERROR_PREFIX}24")
GAIN = Limits("0.01", "10000", "", CLICK.cite("Proportional Gain (DFn+05)"), f"{ERROR_PREFIX}26")
RESET = Limits("0.01", "6000", "s", CLICK.cite("Integral or Reset Time (DFn+06)"), f"{ERROR_PREFIX}27")
DERIVATIVE = Limits("0", "6000", "s", PID_ERRORS, f"{ERROR_PREFIX}28")
HYSTERESIS = Limits("1", "10", "%", D101, f"{ERROR_PREFIX}200")

BITS = BankRange("C", 1, 2000, "the address of a C bit")
INTEGERS = BankRange("DS", 1, 4500, "the address of a DS register")
FLOATS = BankRange("DF", 1, 500, "the address of a DF register")
OUTPUT_RANGES = tuple((n, n + 15) for n in (1, 21, *range(101, 900, 100)))
"""Y bits that exist: of the CPU's two slots and of eight modules, 16 each."""
Y_BIT = re.compile(r"Y([0-9]{3})")


def parse_output_bit(value: object) -> str:
    """``Y001``: a discrete output."""
    match = Y_BIT.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        refuse("address_form", f"{value!r} is not the address of a Y bit", help="write it like Y001")
    if not any(low <= int(match.group(1)) <= high for low, high in OUTPUT_RANGES):
        refuse(
            "address_form",
            f"{value} does not exist",
            help="outputs are Y001 to Y016, Y021 to Y036, Y101 to Y116 and so on to Y816",
        )
    return str(value)


def parse_sample_rate(value: object) -> Decimal:
    """A time with its unit; a bare number could be ms, as in the PLC, or s."""
    if (isinstance(value, str) and NUMBER.fullmatch(value)) or isinstance(value, int | float | Decimal):
        refuse("duration_form", f"{value} can be ms, as in the PLC, or s", help=f"write {value} ms or {value} s")
    return parse_duration(value).seconds()


def parse_unit_rate(value: object) -> Rate:
    """A rate in the PV's unit; the PLC has no counts."""
    rate = parse_rate(value)
    if rate.counts:
        refuse(
            "number_form",
            f"{value!r} is in counts, but the PV is in its own unit",
            help="write 0.5 (per sample), 15 /min or 0.25 /s",
        )
    return rate


CAddress = Annotated[int, Parser(BITS.parse, BITS.name), WithJsonSchema(BITS.schema)]
DsAddress = Annotated[int, Parser(INTEGERS.parse, INTEGERS.name), WithJsonSchema(INTEGERS.schema)]
DfAddress = Annotated[int, Parser(FLOATS.parse, FLOATS.name), WithJsonSchema(FLOATS.schema)]
YBit = Annotated[str, Parser(parse_output_bit), WithJsonSchema(text_schema(Y_BIT.pattern, "Y001"))]
SampleRate = Annotated[Decimal, Parser(parse_sample_rate), WithJsonSchema(DURATION_TEXT)]
UnitRate = Annotated[Rate, Parser(parse_unit_rate), WithJsonSchema(UNIT_RATE_SCHEMA)]
NumberPair = Annotated[
    tuple[Decimal, Decimal],
    Parser(parse_pair(parse_number, "a pair of limits")),
    WithJsonSchema(pair_schema({"type": "number"})),
]
ProcessRange = Annotated[
    tuple[Decimal, Decimal],
    Parser(parse_pair(parse_number, "a range")),
    WithJsonSchema(pair_schema({"type": "number"})),
]
"""Unlike a `Range` one that need not ascend: registers that were never written hold [0, 0] (D620)."""


class Tuning(Model):
    """The P, I and D terms; the proportional gain multiplies all three."""

    proportional_gain: Annotated[Number, GAIN]
    """Proportional gain Kp (DFn+05), % of output per unit of the PV. It cannot be switched off."""
    reset_time: Annotated[Seconds, RESET]
    """Integral (reset) time Ti (DFn+06) in s. To do without, write 1000 or more."""
    derivative_gain: Annotated[Seconds, DERIVATIVE] = Decimal(0)
    """Derivative gain Td (DFn+07) in s; 0 switches the derivative term off."""


class Pv(Model):
    """The process variable."""

    range: ProcessRange
    """PV lower and upper limit (DFn+22, DFn+23): what the process reaches at 0 % and 100 % of the output."""
    input_range: Range | None = None
    """What the instrument measures at both ends of its signal, for conversions to controllers that scale by it."""
    unit: Text | None = None
    """Engineering unit, for reports only."""
    filter: Annotated[Integer, FILTER] | None = None
    """Filter constant (DSn+08): the percentage of the raw PV that is passed each sample, 100 is no filter."""
    filter_enabled: Flag | None = None
    """The filter's bit (Cn+11); on when `filter` is given."""


class Setpoint(Model):
    """The set point and its limits, which the PLC writes into the set point when they are enabled."""

    value: Number | None = None
    """Set point (DFn+00)."""
    lower_limit: Number | None = None
    """Lower limit (DFn+01)."""
    lower_limit_enabled: Flag | None = None
    """The lower limit's bit (Cn+00); on when `lower_limit` is given."""
    upper_limit: Number | None = None
    """Upper limit (DFn+02)."""
    upper_limit_enabled: Flag | None = None
    """The upper limit's bit (Cn+01); on when `upper_limit` is given."""


class Pwm(Model):
    """Pulses in place of an analog output. That they are on, and their bit, stand in the dialog only."""

    bit: YBit
    """The discrete output."""
    period: Annotated[Seconds, PWM_PERIOD] = Decimal(10)
    """Time of one on and one off together (DSn+07), 1 to 600 s."""


class Output(Model):
    """The control output, in %."""

    limits: NumberPair = (Decimal(0), Decimal(100))
    """Lower and upper limit (DFn+09, DFn+10); without effect in Manual."""
    unit: Text | None = None
    """Unit, for reports only; % when not given."""
    pwm: Pwm | None = None
    """Pulse width modulation of a discrete output."""


class Error(Model):
    """What happens to the error before the calculation: the square first, then the deadband."""

    curve: Literal["linear", "squared"] = "linear"
    """Linear, or squared with the sign kept (Cn+02)."""
    deadband: Annotated[Number, DEADBAND] | None = None
    """Deadband (DFn+03): an error up to this size causes no control action. With `squared` it is in squared units."""
    deadband_enabled: Flag | None = None
    """The deadband's bit (Cn+03); on when `deadband` is given."""


class PvAlarms(Model):
    """Alarms on the PV itself; one bit enables all four."""

    low_low: Number | None = None
    """Low-low alarm (DFn+13, status Cn+31)."""
    low: Number | None = None
    """Low alarm (DFn+14, status Cn+32)."""
    high: Number | None = None
    """High alarm (DFn+15, status Cn+33)."""
    high_high: Number | None = None
    """High-high alarm (DFn+16, status Cn+34)."""
    enabled: Flag | None = None
    """The bit of the four alarms (Cn+12); on when any is given."""


class DeviationAlarms(Model):
    """Alarms on the distance between PV and set point; one bit enables both."""

    high: Number | None = None
    """High deviation (DFn+17, status Cn+35)."""
    high_high: Number | None = None
    """High-high deviation (DFn+18, status Cn+36)."""
    enabled: Flag | None = None
    """The bit of the two alarms (Cn+13); on when any is given."""


class Alarms(Model):
    """The loop's alarms."""

    pv: PvAlarms | None = None
    """Absolute alarms of the PV."""
    deviation: DeviationAlarms | None = None
    """Deviation alarms."""
    rate_of_change: UnitRate | None = None
    """Largest change of the PV per sample (DFn+19); `15 /min` and `0.25 /s` are converted with the sample rate."""
    rate_of_change_enabled: Flag | None = None
    """The bit of the rate-of-change alarm (Cn+14); on when `rate_of_change` is given."""
    hysteresis: Annotated[Number, Limits("0", None, "", CLICK.cite("PV Alarm Hysteresis (DFn+20)"))] | None = None
    """How far the PV must return through a limit before its alarm goes off (DFn+20)."""


class Autotune(Model):
    """What the autotune would do."""

    method: Literal["open", "closed"] = "open"
    """Open or closed loop (Cn+06)."""
    type: Literal["PID", "PI"] = "PID"
    """Gains to compute (Cn+07)."""
    hysteresis: Annotated[Number, HYSTERESIS] = Decimal(1)
    """Output hysteresis (DFn+21), 1 to 10; 0 is error 200."""


class State(Model):
    """Registers that the controller itself writes, as they stand in a listing; 0 when not given."""

    bias: Number | None = None
    """Bias (DFn+04)."""
    output: Number | None = None
    """Control output (DFn+08)."""
    raw_pv: Number | None = None
    """Raw process variable (DFn+11)."""
    pv: Number | None = None
    """Filtered process variable (DFn+12)."""


class Loop(Model):
    """One PID loop: 40 bits, 15 integers and 25 floats."""

    name: Name
    """Name of the loop, unique in the file; nicknames begin with it."""
    description: Text | None = None
    """What the loop does, for reports."""
    bits: CAddress
    """First of its 40 consecutive C bits."""
    integers: DsAddress
    """First of its 15 consecutive DS registers."""
    floats: DfAddress
    """First of its 25 consecutive DF registers."""
    mode: Literal["manual", "auto"] = "manual"
    """The mode the loop is meant to run in; the PLC always starts in Manual, and requests are encoded as 0."""
    action: Literal["direct", "reverse"]
    """The process's action (Cn+09): direct when the PV rises with the output (heating), reverse when it falls."""
    action_verified: Flag = False
    """Whether somebody has compared Forward/Reverse in the PID window with `action`."""
    sample_rate: Annotated[SampleRate, SAMPLE_RATE]
    """Time between two calculations (DSn+05), with its unit: `500 ms`."""
    bumpless: Annotated[Literal[1, 2], BeforeValidator(parse_integer)] = 1
    """Transfer to Auto (Cn+08): 1 sets the set point to the PV, 2 keeps it."""
    freeze_bias: Flag = False
    """Stops the integrator while the output is at one of its limits (Cn+05, anti-windup)."""
    tuning: Tuning
    """Proportional gain, reset time and derivative gain."""
    derivative_gain_limit: Annotated[Integer, GAIN_LIMIT] | None = None
    """Derivative gain limit (DSn+06): 8 to 20 is typical, 100 filters nothing, 0 is no derivative."""
    derivative_gain_limit_enabled: Flag | None = None
    """The limit's bit (Cn+04); on when `derivative_gain_limit` is given."""
    pv: Pv
    """Process variable."""
    setpoint: Setpoint = Setpoint()
    """Set point."""
    output: Output = Output()
    """Control output."""
    error: Error = Error()
    """Error term."""
    alarms: Alarms = Alarms()
    """Alarms."""
    autotune: Autotune = Autotune()
    """Autotune selections."""
    state: State = State()
    """Registers that the controller writes."""


class ClickFile(ConfigurationFile):
    """A CLICK configuration: up to eight loops, each with blocks of its own."""

    vendor: Literal["click"]
    loops: tuple[Loop, ...]
    """The loops."""


class PwmSettings(Model):
    """What the dialog alone knows about the pulses."""

    bit: YBit
    """The discrete output."""


class OutputSettings(Model):
    """What no register holds of the output."""

    unit: Text | None = None
    """Unit."""
    pwm: PwmSettings | None = None
    """Pulses; None: an analog output."""


class PvSettings(Model):
    """What no register holds of the PV."""

    unit: Text | None = None
    """Engineering unit."""
    input_range: Range | None = None
    """The range of the instrument."""


class LoopSettings(LoopNameSettings):
    """What stands beside the registers of one loop in a listing."""

    bits: CAddress
    """First of its C bits."""
    integers: DsAddress
    """First of its DS registers."""
    floats: DfAddress
    """First of its DF registers."""
    mode: Literal["manual", "auto"] = "manual"
    """The mode the loop is meant to run in."""
    action_verified: Flag = False
    """Whether the action was compared in the PID window."""
    pv: PvSettings = PvSettings()
    """The PV's unit."""
    output: OutputSettings = OutputSettings()
    """The output's unit and pulses."""
    setpoint: Flag = True
    """Whether the set point is meant; false: the configuration leaves it to the operator."""


class PlcSettings(SectionSettings):
    """What stands beside the registers for the whole file."""
