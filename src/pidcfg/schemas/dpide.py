"""Delta AS configurations: a field for each operand of a DPIDE instruction, its devices, and its call."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Annotated, Literal, NamedTuple

from pydantic import WithJsonSchema

from pidcfg.schemas.base import (
    DURATION_SCHEMA,
    DURATION_TEXT,
    ConfigurationFile,
    Limits,
    LoopNameSettings,
    MapFile,
    Model,
    Name,
    Parser,
    Range,
    SectionSettings,
    Text,
    parse_duration,
)
from pidcfg.schemas.iec import DINT, INT, REAL, Bool, DInt, Identifier, Real, TimeNumber
from pidcfg.schemas.numbers import refuse, text_schema
from pidcfg.text.references import DPIDE, Decision

# --- Devices of a Delta AS: where the operands of a DPIDE instruction can stand in the PLC's memory -------------------

D250 = Decision(
    250,
    "words stand in D0 to D29999, flags in X, Y, M, S, SM or a bit of D",
    "Real and double-word operands take two D registers; flags take X0.0 to X63.15, Y0.0 to Y63.15, M0 to M8191, S0 to "
    "S2047, SM0 to SM4095, or a bit of a D register such as D100.5. Other devices are refused.",
    "The marks of the operand table are lost, and it prints no upper ends; these are the ranges of the AS300.",
)

LAST_REGISTER = 29999
BLOCK_REGISTERS = 30
"""Registers of I_MV: 15 double words."""
WORD_REGISTERS = 2
"""Registers of a real number or a double word."""
FLAG_BANKS = {"M": 8191, "S": 2047, "SM": 4095}
"""Last numbers of the banks of single bits."""
BIT_BANKS = {"X": 63, "Y": 63, "D": LAST_REGISTER}
"""Last numbers of the words whose bits are written like ``X0.15``."""
BITS = 16
DIGITS = "(0|[1-9][0-9]{0,4})"
REGISTER = re.compile(f"D{DIGITS}")
FLAG = re.compile(f"(M|SM|S){DIGITS}")
BIT = re.compile(rf"(X|Y|D){DIGITS}\.(0|[1-9][0-9]?)")
LIKE_REGISTER = re.compile(r"[dD] ?0*([0-9]{1,5})")


class DeviceRange(NamedTuple):
    """Devices that an operand takes: their bank, first and last number; of a single bit of a word its number."""

    bank: str
    first: int
    last: int
    bit: int | None = None

    def __str__(self) -> str:
        end = f" to {self.bank}{self.last}" if self.last > self.first else ""
        return f"{self.bank}{self.first}{'' if self.bit is None else f'.{self.bit}'}{end}"

    def overlaps(self, other: DeviceRange) -> bool:
        """Whether both take the same device; two bits of one word are two devices."""
        is_other_bit = self.bit is not None and other.bit is not None and self.bit != other.bit
        return self.bank == other.bank and self.first <= other.last and other.first <= self.last and not is_other_bit


def device_range(operand: str, device: str) -> DeviceRange:
    """The devices of an operand that begins at a device which its field has let through."""
    if REGISTER.fullmatch(device):
        first = int(device.removeprefix("D"))
        return DeviceRange("D", first, first + (BLOCK_REGISTERS if operand == "I_MV" else WORD_REGISTERS) - 1)
    if match := FLAG.fullmatch(device):
        return DeviceRange(match.group(1), int(match.group(2)), int(match.group(2)))
    bank, number, bit = device[0], *device[1:].split(".")
    return DeviceRange(bank, int(number), int(number), int(bit))


def parse_register(value: object) -> str:
    """``D500``: the first register of an operand."""
    if not isinstance(value, str):
        refuse("address_form", "the address of a D register is wanted", help="write it like D500")
    match = LIKE_REGISTER.fullmatch(value)
    if match is None:
        refuse("address_form", f"{value!r} is not the address of a D register", help="write it like D500")
    spelling = f"D{int(match.group(1))}"
    if int(match.group(1)) > LAST_REGISTER:
        refuse("address_form", f"{spelling} does not exist", help=f"addresses go from D0 to D{LAST_REGISTER}")
    if value != spelling:
        refuse("address_form", f"{value!r} is not spelled as an address", help=f"write {spelling}", only=spelling)
    return spelling


def parse_flag_device(value: object) -> str:
    """``M10``, ``Y0.1``, ``D100.5``: a single bit."""
    if not isinstance(value, str):
        refuse("address_form", "the address of a bit is wanted", help="write it like M10, Y0.1 or D100.5")
    single, bit = FLAG.fullmatch(value), BIT.fullmatch(value)
    if single is None and bit is None:
        refuse("address_form", f"{value!r} is not the address of a bit", help="write it like M10, Y0.1 or D100.5")
    fits = (single is not None and int(single.group(2)) <= FLAG_BANKS[single.group(1)]) or (
        bit is not None and int(bit.group(2)) <= BIT_BANKS[bit.group(1)] and int(bit.group(3)) < BITS
    )
    if not fits:
        banks = [f"{bank}0.0 to {bank}{last}.15" for bank, last in BIT_BANKS.items()]
        banks += [f"{bank}0 to {bank}{last}" for bank, last in FLAG_BANKS.items()]
        refuse("address_form", f"{value} does not exist", help=f"there are {', '.join(banks)}")
    return str(value)


Register = Annotated[str, Parser(parse_register), WithJsonSchema(text_schema(REGISTER.pattern, "D500"))]
Flag = Annotated[
    str,
    Parser(parse_flag_device),
    WithJsonSchema(text_schema(f"{FLAG.pattern}|{BIT.pattern}", "M10", "Y0.1", "D100.5")),
]


class Devices(Model):
    """Devices of operands other than I_MV; words take two D registers, flags one bit."""

    PID_RUN: Flag | None = None
    """Bit of PID_RUN."""
    SV: Register | None = None
    """First register of SV."""
    PV: Register | None = None
    """First register of PV."""
    PID_MODE: Register | None = None
    """First register of PID_MODE; the autotune needs one."""
    PID_MAN: Flag | None = None
    """Bit of PID_MAN."""
    MOUT_AUTO: Flag | None = None
    """Bit of MOUT_AUTO."""
    CYCLE: Register | None = None
    """First register of CYCLE."""
    Kc_Kp: Register | None = None
    """First register of Kc_Kp; the autotune writes it."""
    Ti_Ki: Register | None = None
    """First register of Ti_Ki; the autotune writes it."""
    Td_Kd: Register | None = None
    """First register of Td_Kd; the autotune writes it."""
    Tf: Register | None = None
    """First register of Tf; the autotune writes it."""
    PID_EQ: Flag | None = None
    """Bit of PID_EQ."""
    PID_DE: Flag | None = None
    """Bit of PID_DE."""
    PID_DIR: Flag | None = None
    """Bit of PID_DIR."""
    ERR_DBW: Register | None = None
    """First register of ERR_DBW."""
    MV_MAX: Register | None = None
    """First register of MV_MAX."""
    MV_MIN: Register | None = None
    """First register of MV_MIN."""
    MOUT: Register | None = None
    """First register of MOUT."""
    BIAS: Register | None = None
    """First register of BIAS."""
    MV: Register | None = None
    """First register of MV."""

    def by_operand(self) -> dict[str, str]:
        """Device by operand."""
        return {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}


# --- How a program calls a DPIDE instruction: what stands around it in the manual's examples --------------------------

D600 = Decision(
    600,
    "how the program calls an instruction is a section of the loop",
    "`call` has the bit at EN, the function block that the instruction stands in, the timer that calls it, and GPWM "
    "behind it. Without it the instruction is executed in every scan. Program text alone has it; the calculation is "
    "the same.",
    "The manual's examples 1, 3 and 4 have these around the instruction, and none is an operand.",
)
D601 = Decision(
    601,
    "timers are T0 to T511",
    "Other numbers of `call.timer` are refused.",
    "The manual names T0 alone; this is the range of the AS300, as with other devices (D250).",
)

LAST_TIMER = 511
TIMER = re.compile(f"T{DIGITS}")


def parse_timer(value: object) -> str:
    """``T0``: a timer."""
    match = TIMER.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        refuse("address_form", f"{value!r} is not a timer", help="write it like T0")
    if int(match.group(1)) > LAST_TIMER:
        refuse("address_form", f"{value} does not exist", help=f"timers go from T0 to T{LAST_TIMER}")
    return match.group()


def parse_milliseconds(value: object) -> int:
    """A whole number of ms; a text may carry another unit."""
    duration = parse_duration(value)
    number = duration.seconds("ms") * 1000
    if number != number.to_integral_value():
        cure = f"write {value} s if seconds are meant, else whole ms"
        refuse("number_type", f"{value} is not a whole number of ms", help=cure)
    return int(number)


MILLISECONDS_SCHEMA = {"anyOf": [DURATION_TEXT, {"type": "integer"}]}
Timer = Annotated[str, Parser(parse_timer), WithJsonSchema(text_schema(TIMER.pattern, "T0"))]
PulseCycle = Annotated[
    int,
    Parser(parse_milliseconds),
    WithJsonSchema(MILLISECONDS_SCHEMA),
    INT,
    Limits("1", str(INT.high), "ms", DPIDE.cite("Example 3")),
]


class Gpwm(Model):
    """GPWM behind the instruction: in each cycle the output is on for as long as MV says."""

    cycle: PulseCycle
    """Cycle of the pulses in ms; MV is the time on in it, so that MV_MAX is the cycle."""
    output: Flag
    """Bit of the pulses."""


class Call(Model):
    """How the program calls the instruction, as program text has it."""

    EN: Flag | None = None
    """Bit that enables the instruction; while it is FALSE nothing is executed and all data stay. Without: always."""
    function_block: Identifier | None = None
    """Name of the function block that the instruction stands in, such as `AS_DPIDE`."""
    timer: Timer | None = None
    """Timer (TMRH) that calls it every CYCLE. Without: it is called in every scan."""
    GPWM: Gpwm | None = None
    """Pulses of the width that MV says."""


# --- Delta AS configurations: one field for each operand of a DPIDE instruction, by the names of its manual -----------
#
# Operands hold numbers without a scale of their own: SV, PV and ERR_DBW are in the PV's unit; MV, MV_MAX, MV_MIN,
# MOUT and BIAS in the output's.

D251 = Decision(
    251,
    "CYCLE is whole milliseconds",
    "A bare number is ms, as in the PLC; a text may carry another unit. A time that is no whole number of ms is "
    "refused.",
    "The operand is a double word in ms; a rounded sampling time would change integral and derivative.",
)
D252 = Decision(
    252,
    "the interval of an interrupt task is a key of the file",
    "`plc.interrupt_task` says that all instructions stand in a timed interrupt task; its interval is then the "
    "sampling time, and CYCLE has no effect.",
    "The manual ignores CYCLE there. Nothing in the instruction tells where it stands.",
)

MIN_CYCLE, MAX_CYCLE = 1, 40_000
"""In ms; the PLC counts what lies beyond as these."""


def parse_time(value: object) -> Decimal:
    """A number, or a text with a unit of time, which then can be nothing but a time (`TimeNumber`)."""
    if isinstance(value, TimeNumber):
        return value
    duration = parse_duration(value)
    return duration.value if duration.unit is None else TimeNumber(duration.seconds())


Milliseconds = Annotated[int, Parser(parse_milliseconds), WithJsonSchema(MILLISECONDS_SCHEMA), DINT]
Time = Annotated[Decimal, Parser(parse_time), WithJsonSchema(DURATION_SCHEMA), REAL]
Interval = Annotated[Milliseconds, Limits("1", None, "ms", DPIDE.cite("Example 5"))]


class Scale(Model):
    """A range in engineering units, for conversion and reports; the PLC knows nothing of it."""

    range: Range | None = None
    """Values at 0 % and 100 %."""
    unit: Text | None = None
    """Engineering unit."""


class Plc(Model):
    """What holds for all loops of the PLC."""

    interrupt_task: Interval | None = None
    """Interval in ms of the timed interrupt task that the instructions stand in; it replaces CYCLE."""
    map: MapFile | None = None
    """Modbus map (CSV), relative to this file: where devices are, for `pull`, `compare`, `serve`."""


class Loop(Model):
    """One DPIDE instruction."""

    name: Name
    """Name of the loop, unique in the file."""
    description: Text | None = None
    """What the loop does, for reports."""
    device: Register
    """First of the 30 consecutive D registers of I_MV, such as `D500`."""
    devices: Devices = Devices()
    """Devices of other operands: `SV: D100`, `PID_RUN: M10`. One that is not given is a number, or has a symbol."""
    PID_RUN: Bool = True
    """Whether the algorithm runs; FALSE sets MV to 0."""
    SV: Real
    """Target value."""
    PV: Real | None = None
    """Process value as it stands in a listing; it normally comes from outside."""
    PID_MODE: DInt = 0
    """0 automatic, 1 autotune (needs a device, since the PLC writes 0 there), 2 automatic with I_MV worked out."""
    PID_MAN: Bool = False
    """TRUE manual: MV is MOUT within the limits. FALSE automatic."""
    MOUT_AUTO: Bool = False
    """TRUE: MOUT follows MV, so that a change to manual does not bump."""
    CYCLE: Milliseconds
    """Sampling time in ms, 1 to 40000, or a text with a unit such as `1 s`."""
    Kc_Kp: Real
    """Proportional gain: Kc, which multiplies all three terms (PID_EQ TRUE), or Kp."""
    Ti_Ki: Time
    """Integral time Ti in s (PID_EQ TRUE), or integral gain Ki in 1/s (FALSE); 0 is no integral."""
    Td_Kd: Time
    """Derivative time Td in s (PID_EQ TRUE), or derivative gain Kd (FALSE); 0 is no derivative."""
    Tf: Time = Decimal(0)
    """Time constant in s that smooths the derivative; 0 is none."""
    PID_EQ: Bool = False
    """TRUE dependent form: Kc and two times. FALSE independent form: three gains."""
    PID_DE: Bool = False
    """TRUE derivative of the PV. FALSE derivative of the error, which kicks when SV is changed."""
    PID_DIR: Bool = False
    """TRUE forward, E = SV - PV: heating. FALSE reverse, E = PV - SV: cooling."""
    ERR_DBW: Real = Decimal(0)
    """Dead band around SV in the PV's unit: the error counts as 0 there after PV has crossed SV; 0 is none."""
    MV_MAX: Real
    """Highest MV."""
    MV_MIN: Real
    """Lowest MV."""
    MOUT: Real = Decimal(0)
    """MV in manual."""
    BIAS: Real = Decimal(0)
    """Feed forward, added to MV."""
    call: Call = Call()
    """How the program calls the instruction; only program text has it."""
    pv: Scale = Scale()
    """Range and unit of the PV, for conversion and reports only."""
    output: Scale = Scale()
    """Range and unit of the output, for conversion and reports only."""


class DpideFile(ConfigurationFile):
    """A Delta AS configuration: any number of DPIDE instructions."""

    vendor: Literal["dpide"]
    plc: Plc = Plc()
    """What holds for all loops."""
    loops: tuple[Loop, ...]
    """The loops."""


class LoopSettings(LoopNameSettings):
    """What stands beside the operands of one loop in a listing."""

    device: Register
    """First register of I_MV."""
    devices: Devices = Devices()
    """Devices of other operands."""
    call: Call = Call()
    """How the program calls the instruction."""
    pv: Scale = Scale()
    """Range and unit of the PV."""
    output: Scale = Scale()
    """Range and unit of the output."""


class PlcSettings(Plc, SectionSettings):
    """What stands beside the operands for the whole file."""
