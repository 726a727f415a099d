"""The neutral loop: a PID controller in engineering units and in the form of the ISA, where all vendors' terms meet.

It is the meeting place of conversions, and a vendor of its own: `vendor: generic` is a file that serves several PLCs.
All quantities are engineering units of ``pv.range`` or ``output.range``, all times seconds.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Literal

from pidcfg.schemas.base import (
    ConfigurationFile,
    Flag,
    Limits,
    LoopNameSettings,
    Model,
    Name,
    Number,
    OffSeconds,
    Range,
    Seconds,
    SectionSettings,
    Text,
)
from pidcfg.text.references import Decision

D280 = Decision(
    280,
    "the neutral form is gain, integral and derivative time",
    "output = gain (e + 1/Ti integral(e) + Td d/dt) + bias, e = set point - PV, turned round where the PV falls when "
    "the output rises. Independent gains are Ti = Kp/Ki, Td = Kd/Kp; without a proportional action the gain still "
    "stands before the other two.",
    "It is the standard form of the ISA; every vendor's form leads to it and back without loss.",
)
NON_NEGATIVE = Limits("0", None, "", D280)
NON_NEGATIVE_TIME = Limits("0", None, "s", D280)


class Tuning(Model):
    """The three actions."""

    gain: Annotated[Number, NON_NEGATIVE]
    """Output units per PV unit."""
    integral_time: Annotated[OffSeconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Integral (reset) time in s; 0 or `off`: no integral."""
    derivative_time: Annotated[OffSeconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Derivative (rate) time in s; 0 or `off`: no derivative."""
    proportional: Flag = True
    """Whether there is a proportional action; without it the gain stands before the other two only."""
    derivative_on: Literal["pv", "error"] = "pv"
    """What the derivative acts on."""
    derivative_filter: Annotated[Seconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Time constant of the derivative's filter in s; 0: none."""


class Pv(Model):
    """The process variable."""

    range: Range
    """Engineering values at 0 % and 100 %."""
    unit: Text | None = None
    """Engineering unit."""
    filter: Annotated[Seconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Time constant of the PV's filter in s; 0: none."""
    square_root: Flag = False
    """The PV is the root of a differential pressure."""


class Setpoint(Model):
    """The set point."""

    value: Number | None = None
    """Set point."""
    limits: Range | None = None
    """Lowest and highest set point."""
    source: Name | None = None
    """Name of the loop whose output is the set point (cascade)."""
    follows_pv: Flag | None = None
    """true: in manual the set point follows the PV, or is set to it on the way to auto; false: it stays."""


class Pulse(Model):
    """A time-proportioned discrete output."""

    period: Annotated[Seconds, NON_NEGATIVE_TIME]
    """Period in s."""
    min_on: Annotated[Seconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Shortest pulse in s."""
    min_off: Annotated[Seconds, NON_NEGATIVE_TIME] = Decimal(0)
    """Shortest gap in s."""


class Output(Model):
    """The output."""

    range: Range
    """Engineering values at 0 % and 100 %."""
    unit: Text | None = None
    """Engineering unit."""
    limits: Range | None = None
    """Lowest and highest output; the ends of the range when not given."""
    bias: Number = Decimal(0)
    """What is added to the three actions."""
    manual: Number | None = None
    """Output in manual mode at the start."""
    max_rate: Annotated[Number, NON_NEGATIVE] | None = None
    """Fastest change of the output, per s; not given: not limited."""
    pulse: Pulse | None = None
    """Time-proportioned discrete output."""


class Points(Model):
    """Alarm points of the PV."""

    low_low: Number | None = None
    """Lowest point."""
    low: Number | None = None
    """Low point."""
    high: Number | None = None
    """High point."""
    high_high: Number | None = None
    """Highest point."""


class Deviation(Model):
    """Alarm points of the deviation of the PV from the set point."""

    high: Annotated[Number, NON_NEGATIVE] | None = None
    """First point."""
    high_high: Annotated[Number, NON_NEGATIVE] | None = None
    """Second point."""


class Alarms(Model):
    """Alarms; a point that is not given does not exist."""

    pv: Points = Points()
    """Points of the PV."""
    deviation: Deviation = Deviation()
    """Points of the deviation."""
    rate_of_change: Annotated[Number, NON_NEGATIVE] | None = None
    """Fastest change of the PV, per s."""
    hysteresis: Annotated[Number, NON_NEGATIVE] = Decimal(0)
    """How far the PV must come back."""


class Loop(Model):
    """One PID loop."""

    name: Name
    """Name of the loop, unique in the file."""
    description: Text | None = None
    """What the loop does."""
    mode: Literal["manual", "auto", "cascade"] = "auto"
    """The mode that the loop is meant to run in."""
    output_raises_pv: Flag
    """true: the PV rises when the output rises (heating); false: it falls (cooling)."""
    sample_time: Annotated[Seconds, NON_NEGATIVE_TIME]
    """Time between two calculations in s."""
    tuning: Tuning
    """Gain, integral and derivative time."""
    pv: Pv
    """Process variable."""
    setpoint: Setpoint = Setpoint()
    """Set point."""
    output: Output
    """Output."""
    deadband: Annotated[Number, NON_NEGATIVE] = Decimal(0)
    """An error smaller than this counts as zero."""
    anti_windup: Flag = True
    """No integration further into a limit of the output."""
    alarms: Alarms = Alarms()
    """Alarms."""


class GenericFile(ConfigurationFile):
    """Loops that are not of any vendor."""

    vendor: Literal["generic"]
    """The neutral form."""
    loops: tuple[Loop, ...]
    """The loops."""


class Unit(Model):
    """A unit that stands beside the parameters."""

    unit: Text | None = None
    """Engineering unit."""


class Link(Model):
    """Where the set point comes from, which stands beside the parameters."""

    source: Name | None = None
    """Name of the loop whose output is the set point."""
    follows_pv: Flag | None = None
    """Whether the set point follows the PV in manual."""


class LoopSettings(LoopNameSettings):
    """What no parameter of a loop holds."""

    pv: Unit = Unit()
    """Of the PV."""
    output: Unit = Unit()
    """Of the output."""
    setpoint: Link = Link()
    """Where the set point comes from."""


class PlcSettings(SectionSettings):
    """What no parameter of the file holds."""
