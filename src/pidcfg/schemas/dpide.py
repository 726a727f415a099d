"""Delta AS configurations: one field for each operand of a DPIDE instruction, by the names of its manual.

Operands hold numbers without a scale of their own: SV, PV and ERR_DBW are in the PV's unit; MV, MV_MAX, MV_MIN, MOUT
and BIAS in the output's.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Literal

from pydantic import WithJsonSchema

from pidcfg.refs import DPIDE, Decision
from pidcfg.schemas.base import DURATION_SCHEMA, Model, Name, Parser, Range, Text, parse_duration
from pidcfg.schemas.common import ConfigurationFile, LoopNameSettings, SectionSettings
from pidcfg.schemas.dpide_call import MILLISECONDS_SCHEMA, Call, parse_milliseconds
from pidcfg.schemas.dpide_devices import Devices, Register
from pidcfg.schemas.iec import DINT, REAL, Bool, DInt, Real, Timed
from pidcfg.schemas.limits import Limits
from pidcfg.schemas.map_file import MapFile

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

SHORTEST_CYCLE, LONGEST_CYCLE = 1, 40_000
"""In ms; the PLC counts what lies beyond as these."""


def parse_time(value: object) -> Decimal:
    """A number, or a text with a unit of time, which then can be nothing but a time (`Timed`)."""
    if isinstance(value, Timed):
        return value
    duration = parse_duration(value)
    return duration.value if duration.unit is None else Timed(duration.seconds())


Milliseconds = Annotated[int, Parser(parse_milliseconds), WithJsonSchema(MILLISECONDS_SCHEMA), DINT]
Time = Annotated[Decimal, Parser(parse_time), WithJsonSchema(DURATION_SCHEMA), REAL]
Interval = Annotated[Milliseconds, Limits("1", None, "ms", DPIDE.at("Example 5"))]


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
