"""EZLogix configurations: one field for each register and discrete of a loop, and for what its dialog alone holds.

A quantity on the PV's or output's scale is in engineering units where that scale has a ``range``, else in counts.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from typing import Annotated, Literal

from pydantic import WithJsonSchema

from pidcfg.schemas.base import (
    AnyQuantity,
    BankRange,
    ConfigurationFile,
    Flag,
    Limits,
    LoopNameSettings,
    MapFile,
    Model,
    Name,
    Number,
    OffSeconds,
    Parser,
    Quantity,
    QuantityPair,
    Range,
    Seconds,
    SectionSettings,
    Text,
    WholeSeconds,
    pair_schema,
    parse_pair,
    parse_text,
)
from pidcfg.schemas.numbers import JsonSchema, parse_integer, refuse, text_schema
from pidcfg.text.references import EZLOGIX, Decision

D150 = Decision(
    150,
    "the PV is 0 to 4095 counts unless the file says otherwise",
    "`pv.range` belongs to `pv.counts`, by default [0, 4095]; the control value is always 0 to 4095.",
    "The manual prints 4095 as the control value's upper end and saturation point, and no range for the PV's tag.",
)
D951 = Decision(
    951,
    "a listing with more than 4095 counts gets the counts of a whole register",
    "Where a set point, its limits or the deadband of a listing are beyond the PV's scale and neither counts nor a "
    "range are known, `decode` writes `pv.counts: [0, 65535]` and says so.",
    "The manual limits the control value to 4095 and no R register of the PV: a ladder program may scale it to any "
    "number. The ends of its scale stand nowhere in the PLC.",
)
D151 = Decision(
    151,
    "tag names are PID<n>_<Variable>",
    "`plc.tag_names` is a template with {loop} for the loop's number, {name} for its name and {variable}.",
    "The manual's figure with the naming convention is lost; its text says that names carry loop number and variable.",
)
D152 = Decision(
    152,
    "registers are R1 and up, discretes S1 and up",
    "The base of the register block is an R address, that of the discrete block an S address, up to 65535.",
    "The manual shows question marks in place of addresses and prints no upper end.",
)

PARAMETERS = EZLOGIX.cite("PID Parameters")
LIMITS = EZLOGIX.cite("PID Limits")
CONTROL_OUTPUT = EZLOGIX.cite("Control Output")
AUTOTUNE = EZLOGIX.cite("Autotune Setup")

SAMPLE_RATE = Limits("0.05", "99.99", "s", PARAMETERS)
GAIN = Limits("0", "99.99", "", PARAMETERS)
INTEGRAL = Limits("0", "6000", "s", PARAMETERS)
DERIVATIVE = Limits("0", "600", "s", PARAMETERS)

CV_FULL = 4095
"""Counts of the control value at 100 %: saturation is 0 or this."""
WORD_MAX = 0xFFFF
"""The most that a register holds."""
REGISTERS = BankRange("R", 1, 0xFFFF, "the address of an R register")
DISCRETES = BankRange("S", 1, 0xFFFF, "the address of an S discrete")
TAG = re.compile(r"(IR|OR|R|O)([1-9][0-9]{0,4})")


def parse_tag(*prefixes: str) -> Callable[[object], str]:
    """A parser of tag addresses with one of these prefixes."""

    def parse_address(value: object) -> str:
        match = TAG.fullmatch(value) if isinstance(value, str) else None
        if match is None or match.group(1) not in prefixes:
            kinds = " or ".join(prefixes)
            refuse(
                "address_form", f"{value!r} is not the address of an {kinds} tag", help=f"write it like {prefixes[0]}1"
            )
        if match.group(1) == REGISTERS.prefix:
            REGISTERS.parse(value)
        return str(value)

    return parse_address


def parse_counts(value: object) -> tuple[int, int]:
    """Counts at both ends of a range, ascending within a 16-bit register."""
    low, high = parse_pair(parse_integer, "counts at both ends of the range")(value)
    if low >= high:
        swapped = (
            "write the lower end first; a signal that falls as the PV rises is for the ladder program to turn round"
        )
        refuse("range_order", f"the counts [{low}, {high}] do not ascend", help=swapped if low > high else None)
    if low < 0 or high > WORD_MAX:
        moved = f"add {-low} to the measurement, and write [0, {high - low}]"
        ladder = moved if low < 0 and high - low <= WORD_MAX else "scale the measurement"
        outside = f"the counts [{low}, {high}] do not lie within 0 to {WORD_MAX}, which a register holds"
        refuse("range_order", outside, help=f"let the ladder program {ladder}")
    return low, high


def tag_name(template: str, loop: int, name: str, variable: str) -> str:
    """A tag's name by a template; braces that hold anything else stay as they are."""
    values = {"{loop}": str(loop), "{name}": name, "{variable}": variable}
    return re.sub(r"\{(?:loop|name|variable)\}", lambda placeholder: values[placeholder.group()], template)


def parse_template(value: object) -> str:
    """A template of tag names; the loop and the variable must both be in it."""
    text = parse_text(value)
    complete = "{variable}" in text and ("{loop}" in text or "{name}" in text)
    if not complete or not re.fullmatch(r"[A-Za-z]\w*", tag_name(text, 1, "L", "V"), re.ASCII):
        refuse("name_form", f"{text!r} is not a template of tag names", help='write "PID{loop}_{variable}"')
    return text


def _tag_schema(*prefixes: str) -> JsonSchema:
    return text_schema(f"(?:{'|'.join(prefixes)})[1-9][0-9]{{0,4}}", f"{prefixes[0]}1")


RAddress = Annotated[int, Parser(REGISTERS.parse, REGISTERS.name), WithJsonSchema(REGISTERS.schema)]
SAddress = Annotated[int, Parser(DISCRETES.parse, DISCRETES.name), WithJsonSchema(DISCRETES.schema)]
PvTag = Annotated[str, Parser(parse_tag("IR", "R")), WithJsonSchema(_tag_schema("IR", "R"))]
CvTag = Annotated[str, Parser(parse_tag("OR", "R")), WithJsonSchema(_tag_schema("OR", "R"))]
OutputTag = Annotated[str, Parser(parse_tag("O")), WithJsonSchema(_tag_schema("O"))]
Counts = Annotated[
    tuple[int, int],
    Parser(parse_counts),
    WithJsonSchema(pair_schema({"type": "integer"})),
]
Template = Annotated[str, Parser(parse_template), WithJsonSchema({"type": "string"})]


class Plc(Model):
    """What holds for all loops of the PLC."""

    process_when_stopped: Flag = True
    """Whether loops go on while the PLC is stopped; they then need physical tags (IR; OR or O)."""
    tag_names: Template = "PID{loop}_{variable}"
    """Names of the tag list: `{loop}` is the loop's number, `{name}` its name, `{variable}` the variable."""
    map: MapFile | None = None
    """Modbus map (CSV), relative to this file: where registers and discretes are, for `pull`, `compare`, `serve`."""


class Tuning(Model):
    """The P, I and D terms."""

    proportional_gain: Annotated[Number, GAIN]
    """Proportional gain Kp; 0 removes the proportional term."""
    integral_time: Annotated[OffSeconds, INTEGRAL] = Decimal(0)
    """Integral (reset) time Ti in s; 0 or `off` removes the integral term."""
    derivative_time: Annotated[OffSeconds, DERIVATIVE] = Decimal(0)
    """Derivative (rate) time Td in s; 0 or `off` removes the derivative term."""


class Pv(Model):
    """The process variable and its scale."""

    tag: PvTag
    """Where the PV stands: an input register IR, or an R register that ladder logic writes."""
    range: Range | None = None
    """Engineering values at both ends of `counts`. Without it every quantity on this scale is raw counts."""
    unit: Text | None = None
    """Engineering unit, for reports only."""
    counts: Counts | None = None
    """Counts at both ends of the range; [0, 4095] when not given."""
    square_root: Flag = False
    """The square root of the PV is used in the error, for a differential-pressure flow signal."""


class Setpoint(Model):
    """The setpoint and its limits."""

    value: AnyQuantity | None = None
    """Setpoint."""
    limits: QuantityPair | None = None
    """Setpoint low and high limit; the ends of the PV's scale when not given."""


class Pulse(Model):
    """The digital control output: pulses whose width is proportional to the control value."""

    tag: OutputTag
    """The discrete output, O."""
    cycle_time: Annotated[Seconds, Limits("0.1", "6553.5", "s", CONTROL_OUTPUT)]
    """Cycle time in s."""
    min_on: Annotated[Seconds, Limits("0", "6553.5", "s", CONTROL_OUTPUT)] = Decimal(0)
    """Minimum on time in s: shorter pulses are left out."""
    min_off: Annotated[Seconds, Limits("0", "6553.5", "s", CONTROL_OUTPUT)] = Decimal(0)
    """Minimum off time in s: shorter gaps are left out."""


class Output(Model):
    """The control value (CV), 0 to 4095 counts."""

    tag: CvTag
    """Where the CV goes: an output register OR, or an R register that ladder logic reads."""
    range: Range | None = None
    """Engineering values at 0 and 4095 counts."""
    unit: Text | None = None
    """Engineering unit, for reports only."""
    limits: QuantityPair = (Quantity(Decimal(0), counts=True), Quantity(Decimal(CV_FULL), counts=True))
    """CV low and high limit; 0 and 4095 counts when not given."""
    offset: AnyQuantity = Quantity(Decimal(0), counts=True)
    """CV offset: the CV when the error is zero; what the equation gives is added to it."""
    pulse: Pulse | None = None
    """Digital control output."""


class Autotune(Model):
    """What the autotune would do."""

    type: Literal["PID", "PI"] = "PID"
    """Gains to compute."""
    timeout: Annotated[WholeSeconds, Limits("0", "65535", "s", AUTOTUNE)] = 600
    """Time in s after which an autotune that has not finished is aborted."""


class Loop(Model):
    """One PID loop: 32 registers, 8 discretes and its dialog."""

    name: Name
    """Name of the loop, unique in the file."""
    description: Text | None = None
    """What the loop does, for reports."""
    registers: RAddress
    """Base of its 32 registers."""
    discretes: SAddress
    """Base of its 8 discretes."""
    mode: Literal["manual", "auto"] = "manual"
    """The mode that the PLC starts the loop in."""
    algorithm: Literal["position", "velocity"]
    """Position, or the form that the manual calls velocity: the position form with the derivative of the PV."""
    action: Literal["direct", "reverse"]
    """The controller's action, the opposite of the process's: `reverse` is heating, `direct` cooling."""
    sample_rate: Annotated[Seconds, SAMPLE_RATE]
    """Time between two calculations, in s or with a unit."""
    tuning: Tuning
    """Proportional gain, integral and derivative time."""
    pv: Pv
    """Process variable."""
    setpoint: Setpoint = Setpoint()
    """Setpoint."""
    output: Output
    """Control value."""
    deadband: AnyQuantity = Quantity(Decimal(0), counts=True)
    """An error smaller than this counts as zero."""
    anti_windup: Flag = True
    """No integration while the CV is saturated and the error would drive it further."""
    autotune: Autotune = Autotune()
    """Autotune selections."""


class EzlogixFile(ConfigurationFile):
    """An EZLogix configuration: up to eight loops, each with blocks of its own."""

    vendor: Literal["ezlogix"]
    plc: Plc = Plc()
    """What holds for all loops."""
    loops: tuple[Loop, ...]
    """The loops; the first is loop 1 of the dialog."""


class PulseSettings(Model):
    """What the dialog alone knows about the control output."""

    tag: OutputTag
    """The discrete output."""


class PvSettings(Model):
    """What no register holds of the PV."""

    tag: PvTag
    """Where the PV stands."""
    range: Range | None = None
    """Engineering values at both ends of the counts."""
    unit: Text | None = None
    """Engineering unit."""
    counts: Counts | None = None
    """Counts at both ends of the range."""


class OutputSettings(Model):
    """What no register holds of the CV."""

    tag: CvTag
    """Where the CV goes."""
    range: Range | None = None
    """Engineering values at 0 and 4095 counts."""
    unit: Text | None = None
    """Engineering unit."""
    pulse: PulseSettings | None = None
    """Digital control output; None: not enabled."""


class LoopSettings(LoopNameSettings):
    """What stands beside the registers of one loop in a listing."""

    registers: RAddress
    """Base of its registers."""
    discretes: SAddress
    """Base of its discretes."""
    algorithm: Literal["position", "velocity"]
    """The dialog's algorithm."""
    action: Literal["direct", "reverse"]
    """The dialog's controller action."""
    pv: PvSettings
    """Tag and scale of the PV."""
    output: OutputSettings
    """Tag and scale of the CV."""
    setpoint: Flag = True
    """Whether the setpoint register is meant; false: the configuration leaves the setpoint to the operator."""


class PlcSettings(SectionSettings):
    """What stands beside the registers for the whole file."""

    process_when_stopped: Flag = True
    """Whether loops go on while the PLC is stopped."""
    tag_names: Template = "PID{loop}_{variable}"
    """Names of the tag list."""
    map: MapFile | None = None
    """Modbus map."""
