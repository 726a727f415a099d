"""EZLogix registers and discretes: tables only, offsets from the base in decimal as the manual prints them."""

from __future__ import annotations

from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING

from pidcfg.encoders.regmap import RegisterMap, Word
from pidcfg.encoders.scales import Distance, Format, Position, Scale
from pidcfg.encoders.spaces import BIT, WORD, Bank, Space
from pidcfg.encoders.tuned import TunedWords
from pidcfg.encoders.words import FLAG, WORD_MAX, Choice, EncodeError, Implied
from pidcfg.encoders.written import Written
from pidcfg.frozen import frozen
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.ezlogix import (
    AUTOTUNE,
    CONTROL_OUTPUT,
    CV_FULL,
    DISCRETES,
    LIMITS,
    PARAMETERS,
    REGISTERS,
    SAMPLE_RATE,
)

if TYPE_CHECKING:
    from pidcfg.schemas.limits import Limits

MODE = EZLOGIX.at("PID Loop Mode")
OPTIONS = EZLOGIX.at("Options")
BASE = EZLOGIX.at("Base Register Tag, Base Discrete Tag")

D153 = Decision(
    153,
    "registers are unsigned 16 bit",
    "6000.0 s is 60000; no register is negative.",
    "The manual's range of the integral time needs more than a signed word holds.",
)
D154 = Decision(
    154,
    "the set point of a square-root loop is on the root's scale",
    "With `square_root`, setpoint, its limits and the deadband are encoded on a scale whose 100 % is the root of the "
    "PV's span: 64 of 4095.",
    "The manual uses the square root of the PV in place of the PV, and says nothing of the set point: both must be on "
    "one scale for their difference to mean anything.",
)

SPACE = Space((Bank(*REGISTERS[:3], kind=WORD), Bank(*DISCRETES[:3], kind=BIT)))
MAP_SPACE = Space((*SPACE.banks, Bank("IR", 1, WORD_MAX, kind=WORD), Bank("OR", 1, WORD_MAX, kind=WORD)))
"""What a Modbus map may speak of: the same numbers, and behind them the tags of PV and CV."""
HUNDREDTHS, TENTHS, WHOLE = Implied(2), Implied(1), Implied()
LEAST_SAMPLE_RATE = HUNDREDTHS.encode(Decimal(str(SAMPLE_RATE.low)))
"""The sample rate below which a register is out of range."""
PID_PI = Choice({0: "PID", 1: "PI"})
SAMPLE_INTERVAL = Implied(2, off=(0,), special="not allowed")
MANUAL_AUTO = Choice({0: "manual", 1: "auto"})

# fmt: off
R_BLOCK = RegisterMap(
    title="Registers (32 consecutive R)",
    size=32,
    label="Base+{:d}",
    words=(
        #    offset name                   path                         codec                     unit    title                           read basis access
        Word(0,  "sample_rate",            "sample_rate",               SAMPLE_INTERVAL,          "s",    "Sample Rate",                  "-", PARAMETERS),
        Word(1,  "setpoint",               "setpoint.value",            Position("sp"),           "pv",   "Setpoint",                     "-", PARAMETERS),
        Word(2,  "proportional_gain",      "tuning.proportional_gain",  Implied(2, off=(0,)),     "",     "Proportional Gain",            "-", PARAMETERS),
        Word(3,  "integral_time",          "tuning.integral_time",      Implied(1, off=(0,)),     "s",    "Integral (Reset) Time",        "-", PARAMETERS),
        Word(4,  "derivative_time",        "tuning.derivative_time",    Implied(1, off=(0,)),     "s",    "Derivative (Rate) Time",       "-", PARAMETERS),
        Word(5,  "deadband",               "deadband",                  Distance("sp"),           "pv",   "Deadband",                     "-", LIMITS),
        Word(6,  "setpoint_low",           "setpoint.limits.0",         Position("sp"),           "pv",   "Setpoint Low Limit",           "-", LIMITS),
        Word(7,  "setpoint_high",          "setpoint.limits.1",         Position("sp"),           "pv",   "Setpoint High Limit",          "-", LIMITS),
        Word(8,  "cv_low",                 "output.limits.0",           Position("output"),       "output", "CV Low Limit",               "-", LIMITS),
        Word(9,  "cv_high",                "output.limits.1",           Position("output"),       "output", "CV High Limit",              "-", LIMITS),
        Word(10, "cv_offset",              "output.offset",             Position("output"),       "output", "CV Offset",                  "-", LIMITS),
        Word(11, "error",                  None,                        WHOLE,                    "pv",   "Error",                        "-", LIMITS, "status"),
        Word(12, "autotune_status",        None,                        WHOLE,                    "",     "Autotune Status",              "-", AUTOTUNE, "status"),
        Word(13, "autotune_timeout",       "autotune.timeout",          WHOLE,                    "s",    "Autotune Timeout Time",        "-", AUTOTUNE),
        Word(14, "cycle_time",             "output.pulse.cycle_time",   Implied(1, off=(0,)),     "s",    "Control Output Cycle Time",    "-", CONTROL_OUTPUT),
        Word(15, "min_on",                 "output.pulse.min_on",       Implied(1, off=(0,)),     "s",    "Control Output Min On Time",   "-", CONTROL_OUTPUT),
        Word(16, "min_off",                "output.pulse.min_off",      Implied(1, off=(0,)),     "s",    "Control Output Min Off Time",  "-", CONTROL_OUTPUT),
    ),
).filled(BASE)

S_BLOCK = RegisterMap(
    title="Discretes (8 consecutive S)",
    size=8,
    label="Base+{:d}",
    words=(
        Word(0,  "mode",                   "mode",                      MANUAL_AUTO,              "",     "PID Loop Mode",                "-", MODE),
        Word(1,  "anti_windup",            "anti_windup",               FLAG,                     "",     "Anti-Windup",                  "-", OPTIONS),
        Word(2,  "square_root",            "pv.square_root",            FLAG,                     "",     "Use PV Square Root",           "-", OPTIONS),
        Word(3,  "saturation",             None,                        FLAG,                     "",     "Saturation",                   "-", OPTIONS, "status"),
        Word(4,  "start_autotune",         None,                        FLAG,                     "",     "Start Autotune",               "-", AUTOTUNE, "request"),
        Word(5,  "tuning_type",            "autotune.type",             PID_PI,                   "",     "Tuning Type",                  "-", AUTOTUNE),
    ),
).filled(BASE)

VARIABLES = {
    "sample_rate": "SampleRate", "setpoint": "Setpoint", "proportional_gain": "PGain", "integral_time": "ITime",
    "derivative_time": "DTime", "deadband": "Deadband", "setpoint_low": "SPLowLimit", "setpoint_high": "SPHighLimit",
    "cv_low": "CVLowLimit", "cv_high": "CVHighLimit", "cv_offset": "CVOffset", "error": "Error",
    "autotune_status": "ATStatus", "autotune_timeout": "ATTimeout", "cycle_time": "CycleTime", "min_on": "MinOnTime",
    "min_off": "MinOffTime",
    "mode": "Mode", "anti_windup": "AntiWindup", "square_root": "PVSqrt", "saturation": "Saturation",
    "start_autotune": "ATStart", "tuning_type": "TuningType",
}
"""Names of the variables in tag names (D151)."""
PULSE_REGISTERS = frozenset({"cycle_time", "min_on", "min_off"})
"""Variables that get a tag only where the control output is enabled."""
# fmt: on

TUNED = TunedWords(
    R_BLOCK, "proportional_gain", "integral_time", "derivative_time", "span", Decimal(0), "reverse", "direct"
)
TABLES = (R_BLOCK, S_BLOCK)
"""The two blocks of a loop, in the order of their banks."""
BLOCKS = {"registers": ("R", R_BLOCK), "discretes": ("S", S_BLOCK)}
"""Bank and map of each block, by the key that gives its address."""
BANKS = {key: prefix for key, (prefix, _) in BLOCKS.items()}
LOOPS = 8
DUTY_FULL = 4096
"""Counts that are a duty cycle of 100 %."""


def highest(limits: Limits, codec: Implied) -> float:
    """The largest number that a register may hold by the manual."""
    return float(codec.encode(Decimal(str(limits.high))))


@frozen
class Window:
    """Counts of a scale whose ends lie anywhere within a word; one outside the ends is told, and stored all the same."""

    low: int
    high: int
    room: int = WORD_MAX

    def encode(self, value: int) -> int:
        """Counts to the word."""
        if not self.low <= value <= self.high:
            error = EncodeError("range", "outside the range")
            error.stored = value if 0 <= value <= WORD_MAX else None
            raise error
        return value

    @staticmethod
    def decode(word: int) -> int:
        """The word to counts."""
        return word


@cache
def counts_format(low: int, high: int) -> Format:
    """The format of a PV that is ``low`` to ``high`` counts."""
    return Format(f"{low} to {high} counts", Window(low, high))


CV = counts_format(0, CV_FULL)
RAW_SCALES = {"pv": Scale(counts_format(0, WORD_MAX)), "sp": Scale(counts_format(0, WORD_MAX)), "output": Scale(CV)}

WRITTEN = (
    Written("setpoint", "operated", "the operator or the program", EZLOGIX.at("PID Monitor")),
    Written("mode", "live", "the operator or the program", MODE),
    Written("autotune_timeout", "compared", "an autotune, which counts it down", AUTOTUNE),
    *(
        Written(name, "compared", "an autotune", AUTOTUNE)
        for name in ("proportional_gain", "integral_time", "derivative_time")
    ),
)
"""Who else writes a register of a loop; whatever no row names is yours, or the PLC's by its access."""
