"""EZLogix registers and discretes: tables only, offsets from the base in decimal as the manual prints them."""

from __future__ import annotations

import re
from decimal import Decimal
from functools import cache

from pidcfg.encoders.codecs import FLAG, WORD_MAX, Choice, Distance, EncodeError, Format, Implied, Position
from pidcfg.encoders.regmap import BIT, WORD, Bank, Code, Meaning, RegisterMap, Space, TuningWords, Word, Writer
from pidcfg.schemas.base import Limits
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
from pidcfg.text.frozen import frozen
from pidcfg.text.references import EZLOGIX, Decision

# --- EZLogix registers and discretes: tables only, offsets from the base in decimal as the manual prints them ---------

MODE = EZLOGIX.cite("PID Loop Mode")
OPTIONS = EZLOGIX.cite("Options")
BASE = EZLOGIX.cite("Base Register Tag, Base Discrete Tag")

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
MIN_SAMPLE_COUNTS = HUNDREDTHS.encode(Decimal(str(SAMPLE_RATE.low)))
"""The sample rate below which a register is out of range."""
PID_PI = Choice({0: "PID", 1: "PI"})
SAMPLE_INTERVAL = Implied(2, off=(0,), off_effect="not allowed")
MANUAL_AUTO = Choice({0: "manual", 1: "auto"})

# fmt: off
R_BLOCK = RegisterMap(
    title="Registers (32 consecutive R)",
    size=32,
    label="Base+{:d}",
    words=(
        #    offset name                   path                         codec                     unit    title
        #                    read basis access
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
).fill_reserved(BASE)

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
).fill_reserved(BASE)

TAG_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
"""What a tag may be called."""
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

TUNING_NUMBERS = TuningWords(
    R_BLOCK, "proportional_gain", "integral_time", "derivative_time", "span", Decimal(0), "reverse", "direct"
)
TABLES = (R_BLOCK, S_BLOCK)
"""The two blocks of a loop, in the order of their banks."""
BLOCKS = {"registers": ("R", R_BLOCK), "discretes": ("S", S_BLOCK)}
"""Bank and map of each block, by the key that gives its address."""
BANKS = {key: prefix for key, (prefix, _) in BLOCKS.items()}
MAX_LOOPS = 8
DUTY_COUNTS = 4096
"""Counts that are a duty cycle of 100 %."""


def maximum(limits: Limits, codec: Implied) -> float:
    """The largest number that a register may hold by the manual."""
    return float(codec.encode(Decimal(str(limits.high))))


@frozen
class Window:
    """Counts of a scale whose ends lie anywhere within a word; one outside the ends is told, and stored as it is."""

    low: int
    high: int
    max_difference: int = WORD_MAX

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

WRITERS = (
    Writer("setpoint", "operated", "the operator or the program", EZLOGIX.cite("PID Monitor")),
    Writer("mode", "live", "the operator or the program", MODE),
    Writer("autotune_timeout", "compared", "an autotune, which counts it down", AUTOTUNE),
    *(
        Writer(name, "compared", "an autotune", AUTOTUNE)
        for name in ("proportional_gain", "integral_time", "derivative_time")
    ),
)
"""Who else writes a register of a loop; whatever no row names is yours, or the PLC's by its access."""

# --- What the EZLogix's autotune status, requests and status registers mean for the plant: tables only ----------------

OLD_GAINS_TEXT = "The loop goes on with the gains that it had."
RETRY_NOTE = "Switch discrete Base+4 off and on: the status goes back to 0, then off and on again starts the next try."
STEADY_ADVICE = "Let the process come to rest near its working point first, within 10 % of the set point."

# fmt: off
WORD_MEANINGS = {
    "error": Meaning("The difference of PV and set point as the loop calculates with it: PV - SP with direct controller "
                     "action, SP - PV with reverse.", "", (), LIMITS),
    "autotune_status": Meaning("Tells where the autotune is, or how the last one ended.", "", (), AUTOTUNE),
    "saturation": Meaning("The CV is at an end of its range, 0 or 4095: the actuator can do no more. With anti-windup "
                          "(Base+1) the integral does not go on in that direction. A CV that stands at a limit in "
                          "between (Base+8, Base+9) does not set this bit (D167).",
                          "Normal for a while after a change, and at 0 while a heating loop's PV is above its set point "
                          "(cooling: below). If it stays on the other side too, look whether the actuator is too small "
                          "or shut off. Never change the controller action before a small step of the CV in Manual has "
                          "shown which way the PV goes.", (), OPTIONS),
    "start_autotune": Meaning("From 0 to 1 starts the autotune, in Manual as well as in Auto: the CV steps up by 10 %. "
                              "Back to 0 cancels it.", f"{STEADY_ADVICE} Watch the PV while it runs.", (), AUTOTUNE),
}

CODES = (
    Code("autotune_status", 0, "idle", Meaning("No autotune runs.", "", (), AUTOTUNE)),
    Code("autotune_status", 1, "collecting data", Meaning(
        "The autotune has the CV and records how the PV answers. Base+13 counts the time down that is left.",
        "Watch the PV; discrete Base+4 to 0 cancels.", (), AUTOTUNE)),
    Code("autotune_status", 2, "calculating", Meaning("The answer is recorded; the gains are being worked out.", "Wait.", (), AUTOTUNE)),
    Code("autotune_status", 3, "done", Meaning(
        "The autotune has ended well; gain, integral and derivative time (Base+2 to +4) are new.",
        "Try the loop out with a small step of the set point before you leave it alone.", (), AUTOTUNE)),
    Code("autotune_status", 4, "cancelled", Meaning(f"Somebody set discrete Base+4 to 0. {OLD_GAINS_TEXT}", RETRY_NOTE, (), AUTOTUNE)),
    Code("autotune_status", 5, "the CV could not be incremented", Meaning(
        f"There is no room for a step of 10 % above the present CV. {OLD_GAINS_TEXT}",
        f"Bring the CV 10 % below the CV high limit (Base+9) and below 90 % of its range first. Raise that limit only if the "
        f"plant bears it: it may protect the plant; put it back after the autotune. {RETRY_NOTE}", ("EZ484",), AUTOTUNE)),
    Code("autotune_status", 6, "the curve could not be fitted", Meaning(
        f"The PV moved, but not like the answer of a process to a step. {OLD_GAINS_TEXT}",
        f"Look for disturbances and noise; give it more time (Base+13). {STEADY_ADVICE} {RETRY_NOTE}",
        ("EZ481",), AUTOTUNE)),
    Code("autotune_status", 7, "division by zero", Meaning(
        f"The recorded answer has no slope to work with. {OLD_GAINS_TEXT}",
        f"See that the PV moves when the CV does. {RETRY_NOTE}", (), AUTOTUNE)),
    Code("autotune_status", 8, "no dead time was found", Meaning(
        f"The PV did not move, or not in the time of Base+13. {OLD_GAINS_TEXT}",
        f"See that actuator and sensor work; give it more time (Base+13). {RETRY_NOTE}", ("EZ480", "EZ481"), AUTOTUNE)),
    Code("autotune_status", 9, "a gain or time is out of range", Meaning(
        f"The gains that fit the answer do not fit their registers. {OLD_GAINS_TEXT}",
        f"Tune by hand, or change the sample rate (Base+0) and try again. {RETRY_NOTE}", (), AUTOTUNE)),
    Code("autotune_status", 10, "low memory", Meaning(
        f"The PLC had no memory left for the recording. {OLD_GAINS_TEXT}",
        f"End other autotunes (Base+4 off and on frees their memory). {RETRY_NOTE}", (), AUTOTUNE)),
)
# fmt: on
"""The manual's table of Base+12."""

NO_REGISTER = ("action", "algorithm", "pv.tag", "output.tag", "output.pulse.tag", "plc.process_when_stopped")
"""Settings that act on a loop and that no register has, by key."""
