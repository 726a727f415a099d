"""NextoPID configurations: the library's eleven function blocks and three functions, and how they are wired.

Keys of a block are the manual's parameter names. A parameter that is not given holds 0 or FALSE, as IEC 61131-3 has it;
what is normally wired from outside (PV, InVar …) may be left to the program around it. Where a field takes a `Wire`, an
expression of signals and parameters may stand in place of the value.
"""

from __future__ import annotations

from collections.abc import Mapping
from decimal import Decimal
from typing import Annotated, Literal

from pydantic import Field

from pidcfg.schemas.base import ConfigurationFile, Limits, MapFile, Model, Range, Seconds, Text
from pidcfg.schemas.iec import BoolIn, Identifier, IntIn, MoveIn, RealIn, Signal, TimeIn, TuneMode, UInt, UIntIn, USInt
from pidcfg.text.references import NEXTOPID, Decision

D200 = Decision(
    200,
    "a NextoPID parameter that is not given is 0 or FALSE",
    "SP, Kp, Ti_Ki, Td_Kd, MinMV, MaxMV, MinPV and MaxPV must be given; every other parameter may be left out.",
    "It is what IEC 61131-3 gives a variable without an initial value; the manual prints no initial values.",
)
D201 = Decision(
    201,
    "MinMV and MaxMV are limits, not the output's scale",
    "`output.range` says what 0 % and 100 % of the output are, for reports and conversion; without it they count.",
    "The manual calls them limits, and gives the output no scale.",
)
D202 = Decision(
    202,
    "independent Ki is in 1/s times the unit of Kp, Kd in s times the unit of Kp",
    "A time with a unit is refused for Ti_Ki and Td_Kd of the independent form.",
    "The manual calls them dimensionless; by its own formulas they are not.",
)

PIDA = NEXTOPID.cite("chapter 2: PIDA_REAL")
TUNE = NEXTOPID.cite("chapter 4: PIDA_TUNE_REAL")
ON_OFF = NEXTOPID.cite("chapter 6: ControlON_OFF")
PWM = NEXTOPID.cite("chapter 7: ControlPWM")
LOW_FILTER = NEXTOPID.cite("chapter 8: ControlLowFilter")
DELAY = NEXTOPID.cite("chapter 9: ControlDelay")
LAG = NEXTOPID.cite("chapter 10: ControlLag")
DELAY_LAG = NEXTOPID.cite("chapter 11: ControlDelayLag")
LEAD_LAG = NEXTOPID.cite("chapter 12: ControlLeadLag")
SELECT_MAX = NEXTOPID.cite("chapter 13: ControlSelectMax")
SELECT_MIN = NEXTOPID.cite("chapter 14: ControlSelectMin")
SPLIT_RANGE = NEXTOPID.cite("chapter 15: ControlSplitRange")


def non_negative_limits(bit: str, unit: str = "") -> Limits:
    """A parameter of the PIDA blocks that sets an error bit below 0."""
    return Limits("0", None, unit, PIDA, effect=f"ErrBits.{bit}")


TUNE_LIMITS = {
    "PercAmpMV": ("0.1", "50"),
    "PercHystPV": ("0.01", "1"),
    "PercMaxPeakPV": ("0.1", "50"),
    "NumCycles": ("1", "10"),
}
"""The ranges of the auto-tuning's parameters."""
MAX_SAMPLE_TIME = Decimal(60)
"""Seconds between two calls, beyond which a PID block sets an error bit."""
MIN_INTEGRAL_TIME = Decimal("0.001")
"""Seconds: a shorter integral time of the dependent form means no integral."""


def autotune_limits(name: str) -> Limits:
    """A parameter of the auto-tuning, with the result bit that tells when it is out of range."""
    low, high = TUNE_LIMITS[name]
    return Limits(low, high, "%" if name.startswith("Perc") else "", TUNE, effect=f"AutoTuneResult.Bad_{name}")


class PvText(Model):
    """What reports say about the process variable."""

    unit: Text | None = None
    """Engineering unit of SP, PV and their limits."""


class OutputText(Model):
    """What reports and conversion need to know about the output."""

    range: Range | None = None
    """The output at 0 % and 100 %; MinMV and MaxMV when not given."""
    unit: Text | None = None
    """Engineering unit of MV."""


class Item(Model):
    """A function block or function of the program."""

    name: Identifier
    """Name of the instance, as the program declares it."""
    description: Text | None = None
    """What it does, for reports."""


class Controller(Item):
    """A loop: a block that compares SP with PV."""

    sample_time: Seconds | None = None
    """Interval of its calls, a whole multiple of the task's; the task's when not given."""
    pv: PvText = PvText()
    """Unit of the process variable."""
    output: OutputText = OutputText()
    """Scale and unit of the output."""


class Pida(Controller):
    """What the PID controllers have in common."""

    type: str
    """The function block."""
    SP: RealIn
    """Set point."""
    SP_CASC: RealIn = Decimal(0)
    """Set point in cascade mode (CASC)."""
    PV: RealIn | None = None
    """Process variable; not given: the program around assigns it."""
    Kp: RealIn
    """Proportional gain, in MV units per PV unit; above 0 in the dependent form, 0 allowed in the independent one."""
    Td_Kd: Annotated[TimeIn, non_negative_limits("Td_Kd")]
    """Derivative time in s (dependent form), or derivative gain (independent form)."""
    Ti_Ki: Annotated[TimeIn, non_negative_limits("Ti_Ki")]
    """Integral time in s (dependent form; below 0.001 s: no integral), or integral gain (independent form)."""
    Tfd: Annotated[TimeIn, non_negative_limits("Tfd", "s")] = Decimal(0)
    """Filter time of the derivative in s; 0: no filter."""
    BIAS: RealIn = Decimal(0)
    """Offset added to MV, typically a feed-forward."""
    ManualMV: RealIn = Decimal(0)
    """MV in manual mode."""
    TRK_VAL: RealIn = Decimal(0)
    """MV in tracking mode (TRK_IN); in override (OVERR) the MV that controls in its stead."""
    MaxVarMV: Annotated[RealIn, non_negative_limits("MaxVarMV")] = Decimal(0)
    """Largest change of MV in one cycle; 0: not limited."""
    MaxMV: RealIn
    """Upper limit of MV."""
    MinMV: RealIn
    """Lower limit of MV."""
    DeadBand: Annotated[RealIn, non_negative_limits("DeadBand")] = Decimal(0)
    """While the error is smaller than this, MV stays."""
    MaxPV: RealIn
    """Upper limit of PV, SP and SP_CASC inside the block."""
    MinPV: RealIn
    """Lower limit of PV, SP and SP_CASC inside the block."""
    Indep: BoolIn = False
    """TRUE: independent gains; FALSE: the dependent form with times."""
    DisableP: BoolIn = False
    """No proportional action; of effect in the dependent form only."""
    DerivEr: BoolIn = False
    """TRUE: derivative of the error; FALSE: of the PV."""
    CASC: BoolIn = False
    """Cascade mode: the set point is SP_CASC."""
    TRK_IN: BoolIn = False
    """Tracking mode: MV follows TRK_VAL; of a cascade master, from its slave's TRK_OUT."""
    Windup_H_IN: BoolIn = False
    """The integral may not rise; of a cascade master, from its slave's Windup_H_OUT."""
    Windup_L_IN: BoolIn = False
    """The integral may not fall; of a cascade master, from its slave's Windup_L_OUT."""
    OVERR: BoolIn = False
    """Overridden: another controller has the valve, and TRK_VAL is its MV."""
    Manual: BoolIn = False
    """Manual mode: MV is ManualMV."""
    Direct: BoolIn = False
    """TRUE: MV rises with PV (cooling); FALSE: MV falls when PV rises (heating)."""


class PidaReal(Pida):
    """PID controller with REAL parameters."""

    type: Literal["PIDA_REAL"]
    """The function block."""


class IntPida(Pida):
    """The same with INT parameters, in field units."""

    SP: IntIn
    """Set point."""
    SP_CASC: IntIn = Decimal(0)
    """Set point in cascade mode (CASC)."""
    PV: IntIn | None = None
    """Process variable; not given: the program around assigns it."""
    BIAS: IntIn = Decimal(0)
    """Offset added to MV, typically a feed-forward."""
    ManualMV: IntIn = Decimal(0)
    """MV in manual mode."""
    TRK_VAL: IntIn = Decimal(0)
    """MV in tracking mode (TRK_IN); in override (OVERR) the MV that controls in its stead."""
    MaxVarMV: Annotated[IntIn, non_negative_limits("MaxVarMV")] = Decimal(0)
    """Largest change of MV in one cycle; 0: not limited."""
    MaxMV: IntIn
    """Upper limit of MV."""
    MinMV: IntIn
    """Lower limit of MV."""
    DeadBand: Annotated[IntIn, non_negative_limits("DeadBand")] = Decimal(0)
    """While the error is smaller than this, MV stays."""
    MaxPV: IntIn
    """Upper limit of PV, SP and SP_CASC inside the block."""
    MinPV: IntIn
    """Lower limit of PV, SP and SP_CASC inside the block."""


class PidaInt(IntPida):
    """PID controller with INT parameters, in field units."""

    type: Literal["PIDA_INT"]
    """The function block."""


class TuneParam(Model):
    """What the auto-tuning does."""

    PercAmpMV: Annotated[RealIn, autotune_limits("PercAmpMV")] = Decimal(0)
    """Step of MV to either side, in % of MaxMV - MinMV."""
    PercHystPV: Annotated[RealIn, autotune_limits("PercHystPV")] = Decimal(0)
    """Hysteresis of PV to either side, in % of MaxPV - MinPV; more than its noise."""
    PercMaxPeakPV: Annotated[RealIn, autotune_limits("PercMaxPeakPV")] = Decimal(0)
    """How far PV may go to either side before the auto-tuning is aborted, in % of MaxPV - MinPV."""
    NumCycles: Annotated[UIntIn, autotune_limits("NumCycles")] = 0
    """Cycles that are measured."""
    Mode: TuneMode = "P"
    """The controller that is tuned."""


class PidaTuneReal(Pida):
    """PID controller with REAL parameters and auto-tuning."""

    type: Literal["PIDA_TUNE_REAL"]
    """The function block."""
    AutoTune: BoolIn = False
    """Its rising edge starts the auto-tuning, which holds MV while it is TRUE."""
    AutoTuneParam: TuneParam | None = None
    """Parameters of the auto-tuning."""


class PidaTuneInt(IntPida):
    """PID controller with INT parameters and auto-tuning."""

    type: Literal["PIDA_TUNE_INT"]
    """The function block."""
    AutoTune: BoolIn = False
    """Its rising edge starts the auto-tuning, which holds MV while it is TRUE."""
    AutoTuneParam: TuneParam | None = None
    """Parameters of the auto-tuning."""


class OnOff(Controller):
    """On-off controller."""

    type: Literal["ControlON_OFF"]
    """The function block."""
    SP: RealIn
    """Set point."""
    PV: RealIn | None = None
    """Process variable; not given: the program around assigns it."""
    DeadBand: RealIn
    """MV stays while the error is not larger than this; above 0."""
    MaxPV: RealIn
    """Upper limit of PV and SP inside the block."""
    MinPV: RealIn
    """Lower limit of PV and SP inside the block."""
    Direct: BoolIn = False
    """TRUE: MV is switched on when PV is too high (cooling); FALSE: when it is too low (heating)."""
    Manual: BoolIn = False
    """Manual mode: MV is ManualMV."""
    ManualMV: BoolIn = False
    """MV in manual mode."""


class Pwm(Item):
    """Pulse width modulation of a BOOL output."""

    type: Literal["ControlPWM"]
    """The function block."""
    MV: RealIn | None = None
    """What becomes pulses."""
    MaxMV: RealIn
    """MV at which the output is always on."""
    MinMV: RealIn = Decimal(0)
    """MV at which the output is always off."""
    Period: Annotated[UInt, Limits("1", "65535", "cycles", PWM, effect="Error")]
    """Period in cycles of the task."""


class LowFilter(Item):
    """First-order low-pass filter."""

    type: Literal["ControlLowFilter"]
    """The function block."""
    InVar: RealIn | None = None
    """Input."""
    Tc: TimeIn
    """Time constant in s; above 0."""


class Delay(Item):
    """Dead time of up to 100 samples."""

    type: Literal["ControlDelay"]
    """The function block."""
    InVar: RealIn | None = None
    """Input."""
    DelayTime: Annotated[TimeIn, Limits("0", None, "s", DELAY, effect="Error")]
    """Delay in s, at most 100 sample times."""
    InitDelayedVar: RealIn = Decimal(0)
    """Output until the first sample has come through."""


class Lag(Item):
    """First-order lag with gain, offset and limits."""

    type: Literal["ControlLag"]
    """The function block."""
    InVar: RealIn | None = None
    """Input."""
    Gs: RealIn = Decimal(0)
    """Static gain."""
    Offset: RealIn = Decimal(0)
    """Added to the output."""
    Tc: TimeIn
    """Time constant in s; above 0."""
    Init_OutVar: RealIn = Decimal(0)
    """Output at the start."""
    Min_OutVar: RealIn = Decimal(0)
    """Lower limit of the output."""
    Max_OutVar: RealIn = Decimal(0)
    """Upper limit of the output."""


class DelayLag(Item):
    """Dead time and a first-order lag behind it."""

    type: Literal["ControlDelayLag"]
    """The function block."""
    InVar: RealIn | None = None
    """Input."""
    DelayTime: Annotated[TimeIn, Limits("0", None, "s", DELAY_LAG, effect="Error")]
    """Delay in s, at most 100 sample times."""
    InitDelayedVar: RealIn = Decimal(0)
    """Delayed input until the first sample has come through."""
    Gs: RealIn = Decimal(0)
    """Static gain."""
    Offset: RealIn = Decimal(0)
    """Added to the output."""
    Tc: TimeIn
    """Time constant in s; above 0."""
    Init_OutVar: RealIn = Decimal(0)
    """Output at the start."""
    Min_OutVar: RealIn = Decimal(0)
    """Lower limit of the output."""
    Max_OutVar: RealIn = Decimal(0)
    """Upper limit of the output."""


class LeadLag(Item):
    """Lead and lag with gain and limits."""

    type: Literal["ControlLeadLag"]
    """The function block."""
    InVar: RealIn | None = None
    """Input."""
    G: RealIn = Decimal(0)
    """Gain."""
    Tlead: Annotated[TimeIn, Limits("0", None, "s", LEAD_LAG, effect="Error")] = Decimal(0)
    """Lead time in s."""
    Tlag: TimeIn
    """Lag time in s; above 0."""
    Min_OutVar: RealIn = Decimal(0)
    """Lower limit of the output."""
    Max_OutVar: RealIn = Decimal(0)
    """Upper limit of the output."""
    Disable: BoolIn = False
    """TRUE: the output is 0."""


class SelectMax(Item):
    """The larger of two MVs, for override."""

    type: Literal["ControlSelectMax"]
    """The function."""
    MV1: RealIn
    """MV of the first controller."""
    MV2: RealIn
    """MV of the second controller."""


class SelectMin(Item):
    """The smaller of two MVs, for override."""

    type: Literal["ControlSelectMin"]
    """The function."""
    MV1: RealIn
    """MV of the first controller."""
    MV2: RealIn
    """MV of the second controller."""


class SplitRange(Item):
    """One MV for two valves; all in %."""

    type: Literal["ControlSplitRange"]
    """The function."""
    MV: RealIn
    """MV of the controller, 0 to 100 %."""
    SPLIT: RealIn
    """Split point, between 0 and 100 %."""
    Mode: Annotated[USInt, Limits("1", "4", "", SPLIT_RANGE, effect="Error")]
    """Which valve opens where: 1 to 4."""


Loop = PidaReal | PidaInt | PidaTuneReal | PidaTuneInt | OnOff
Block = OnOff | Pwm | LowFilter | Delay | Lag | DelayLag | LeadLag | SelectMax | SelectMin | SplitRange


class Move(Model):
    """A value that the program copies beside the calls of its blocks: a MOVE instruction."""

    move: MoveIn
    """What is copied: a number, true or false, or an expression."""
    to: Text
    """The signal, or the input of a block that nothing is wired to (``TIC_1.ManualMV``)."""
    when: BoolIn = True
    """The condition; in every cycle when not given."""
    at: Literal["start", "end"] = "end"
    """Before the first call of a cycle, or behind the last one."""


class Plc(Model):
    """The task that the program runs in."""

    sample_time: Seconds
    """Interval of the cyclic task in s."""
    program: Identifier = "PidLoops"
    """Name of the program that is written."""
    map: MapFile | None = None
    """Modbus map (CSV), relative to this file: where parameters are, for `pull`, `compare`, `serve`."""


class NextopidFile(ConfigurationFile):
    """A NextoPID configuration: signals from outside, function blocks and loops."""

    vendor: Literal["nextopid"]
    plc: Plc
    """The task."""
    signals: Mapping[Identifier, Signal] = Field(
        default_factory=dict, json_schema_extra={"additionalProperties": False}
    )
    """Values from outside by name, each with its first value, which says its type: 5.0 (REAL), true (BOOL), INT#5,
    500 ms or T#500ms (TIME, in s where it is read)."""
    blocks: tuple[Annotated[Block, Field(discriminator="type")], ...] = ()
    """Blocks and functions beside the loops."""
    loops: tuple[Annotated[Loop, Field(discriminator="type")], ...]
    """The controllers."""
    moves: tuple[Move, ...] = ()
    """What the program copies, in this order."""
