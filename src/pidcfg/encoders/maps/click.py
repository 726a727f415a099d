"""CLICK registers and error numbers: tables only, offsets in decimal as the help prints them."""

from __future__ import annotations

import re
from decimal import Decimal
from typing import Literal, NamedTuple

from pidcfg.encoders.codecs import FLAG, Choice, Implied, Single
from pidcfg.encoders.regmap import (
    BIT,
    INT16,
    SINGLE,
    Bank,
    Code,
    Meaning,
    RegisterMap,
    Space,
    TuningWords,
    Word,
    Writer,
)
from pidcfg.schemas import click as limits
from pidcfg.schemas.base import Limits
from pidcfg.schemas.click import BITS, D100, D101, FLOATS, INTEGERS, OUTPUT_RANGES
from pidcfg.schemas.click import PID_ERRORS as ERROR_LIST
from pidcfg.text.frozen import frozen
from pidcfg.text.references import CLICK, CLICK_ADDRESSES, Decision

# --- CLICK registers: tables only, offsets in decimal as the help prints them -----------------------------------------
#
# A loop has three blocks, each at an address of its own: C bits, DS integers and DF floats. ``suffix`` is what the
# PLC's own nicknames add to the loop's name.

ADDRESSES = CLICK_ADDRESSES.cite("PID Address Descriptions")
MODES = CLICK.cite("Manual Mode, Auto Mode, Autotune Mode")
ALARMS = CLICK.cite("PV Alarm")

D102 = Decision(
    102,
    "registers without a known meaning are reserved",
    "Cn+10, +18 to +24, +27 to +30, +38 and +39, DSn+01 to +04 and +09 to +14, and DFn+24 are encoded as 0 and never "
    "written by a DataView or an initial value; nor are Cn+25 and +26 (D952).",
    "The help that is at hand prints how long the blocks are, and the meaning of the other registers only.",
)
D952 = Decision(
    952,
    "Cn+25 and Cn+26 may tell Manual and Auto",
    "Where one of the two bits is on, `explain`, `decode`, `pull` and `trend` show the mode as unconfirmed, and `serve` "
    "sets them. They are never written, no mode of a file is taken from them, and `compare` does not look at them.",
    "CL246 has a Mode Indication bit that goes on when the loop has switched, without an address; CL254 has IND "
    "(indicator) among the abbreviations of its nicknames, of which no other known bit makes use. One public page, "
    "industrialmonitordirect.com, click-plc-pid-auto-mode-force-bit-not-working-fix, names C317 Auto Mode Request, C326 "
    "Manual Mode Indication and C327 Auto Mode Indication of a loop whose bits then begin at C301: C317 agrees with the "
    "help. No second source was found, and pages of that site contradict each other elsewhere.",
)
D103 = Decision(
    103,
    "nicknames are the loop's name and a suffix",
    "The suffixes of Cn+00 to +09, Cn+11 and DSn+00 are the help's; the others are made of the same abbreviations.",
    "Only those twelve are public.",
)

SPACE = Space(
    (
        Bank(*BITS[:3], kind=BIT),
        Bank(*INTEGERS[:3], kind=INT16),
        Bank(*FLOATS[:3], kind=SINGLE),
    )
)

# fmt: off
ALL_BANKS = {
    # bank    numbers                data type
    "X":   (OUTPUT_RANGES,                 "BIT"),
    "Y":   (OUTPUT_RANGES,                 "BIT"),
    "C":   ((BITS[1:3],),            "BIT"),
    "T":   (((1, 500),),             "BIT"),
    "CT":  (((1, 250),),             "BIT"),
    "SC":  (((1, 1000),),            "BIT"),
    "DS":  ((INTEGERS[1:3],),        "INT"),
    "DD":  (((1, 1000),),            "INT2"),
    "DH":  (((1, 500),),             "HEX"),
    "DF":  ((FLOATS[1:3],),          "FLOAT"),
    "XD":  (((0, 8),),               "HEX"),
    "YD":  (((0, 8),),               "HEX"),
    "TD":  (((1, 500),),             "INT"),
    "CTD": (((1, 250),),             "INT2"),
    "SD":  (((1, 1000),),            "INT"),
    "TXT": (((1, 1000),),            "TEXT"),
}
"""Every address of a CLICK and what it holds, in the order of CLICK's own lists (D1031)."""
# fmt: on
D1031 = Decision(
    1031,
    "CLICK's files are read and written here",
    "Nickname CSV, DataView and data dump are written byte for byte as the package pyclickplc writes them. What it "
    "would pass over, cut or round is refused. Banks, types and Modbus addresses are those of CLICK's export of all "
    "addresses. The tests hold each of them to pyclickplc.",
    "pyclickplc passes over, cuts or rounds in silence what it does not take, and works on files alone: around it every "
    "cell would be checked a second time. Who installs pidcfg gets no pymodbus of an older version with it.",
)
ADDRESS = re.compile(r"([A-Za-z]{1,3})([0-9]{1,7})([Uu]?)")
UPPER_HALVES = frozenset({"XD0U", "YD0U"})
"""The upper eight switches of a slot."""


class Address(NamedTuple):
    """An address of any bank, spelled as CLICK spells it."""

    bank: str
    name: str

    @property
    def type(self) -> str:
        """What it holds."""
        return ALL_BANKS[self.bank][1]


def address_of(text: str) -> Address | None:
    """The address that a text is, whatever its letters and leading zeros; None where CLICK has none."""
    match = ADDRESS.fullmatch(text)
    bank, digits, half = (part.upper() for part in match.groups()) if match else ("", "0", "")
    n = int(digits)
    if bank not in ALL_BANKS or not any(first <= n <= last for first, last in ALL_BANKS[bank][0]):
        return None
    if half and f"{bank}{n}{half}" not in UPPER_HALVES:
        return None
    return Address(bank, f"{bank}{n:03d}" if bank in {"X", "Y"} else f"{bank}{n}{half.lower()}")


MODBUS: dict[str, tuple[Literal["coil", "holding"], int]] = {
    "C": ("coil", 0x4000),
    "DS": ("holding", 0),
    "DF": ("holding", 0x7000),
}
"""Modbus table and first register of the banks of a loop, as CLICK's exports have them (D1031)."""


def modbus_place(number: int) -> tuple[Literal["coil", "holding"], int, int]:
    """Modbus table and first register of an address of a loop's bank, and how many registers it has."""
    bank, n = SPACE.bank_and_number(number)
    table, first = MODBUS[bank.prefix]
    width = 2 if bank.kind is SINGLE else 1
    return table, first + width * (n - bank.first), width


WHOLE = Implied(low_count=-0x8000, high_count=0x7FFF)
MILLISECONDS = Implied(3, low_count=-0x8000, high_count=0x7FFF)
FLOAT = Single()
OPEN_CLOSED = Choice({0: "open", 1: "closed"})
PID_PI = Choice({0: "PID", 1: "PI"})
BUMPLESS = Choice({0: 1, 1: 2})
ACTION = Choice({0: "direct", 1: "reverse"})
CURVE = Choice({0: "linear", 1: "squared"})

# fmt: off
C_BLOCK = RegisterMap(
    title="Bits (40 consecutive C)",
    size=40,
    label="Cn+{:02d}",
    words=(
        #    offset name                            path                                    codec        unit title
        #                            read basis access
        Word(0,  "setpoint_lower_enable",           "setpoint.lower_limit_enabled",         FLAG,        "", "SP lower limit enable",            "-", ADDRESSES, suffix="_EN_SP_LimitLower"),
        Word(1,  "setpoint_upper_enable",           "setpoint.upper_limit_enabled",         FLAG,        "", "SP upper limit enable",            "-", ADDRESSES, suffix="_EN_SP_LimitUpper"),
        Word(2,  "error_squared",                   "error.curve",                          CURVE,       "", "Error squared",                    "-", ADDRESSES, suffix="_SEL_ErrorSquared"),
        Word(3,  "deadband_enable",                 "error.deadband_enabled",               FLAG,        "", "Error deadband enable",            "-", ADDRESSES, suffix="_EN_ErrorDeadband"),
        Word(4,  "derivative_limit_enable",         "derivative_gain_limit_enabled",        FLAG,        "", "Derivative gain limit enable",     "-", ADDRESSES, suffix="_EN_DerivativeLmt"),
        Word(5,  "freeze_bias",                     "freeze_bias",                          FLAG,        "", "Freeze bias (anti-windup)",        "-", ADDRESSES, suffix="_EN_AntiWindup"),
        Word(6,  "autotune_method",                 "autotune.method",                      OPEN_CLOSED, "", "Autotune open or closed loop",     "-", D100, suffix="_SEL_AutotuneMthd"),
        Word(7,  "autotune_type",                   "autotune.type",                        PID_PI,      "", "Autotune PID or PI",               "-", D100, suffix="_SEL_AutotunePIDPI"),
        Word(8,  "bumpless_mode",                   "bumpless",                             BUMPLESS,    "", "Bumpless transfer mode 1 or 2",    "-", CLICK.cite("Bumpless Transfer (Cn+08)"), suffix="_SEL_BumplessMode"),
        Word(9,  "action",                          "action",                               ACTION,      "", "Forward (direct) or reverse action", "-", D100, suffix="_SEL_DirectReverse"),
        Word(11, "filter_enable",                   "pv.filter_enabled",                    FLAG,        "", "PV input filter enable",           "-", ADDRESSES, suffix="_EN_PV_InputFiltr"),
        Word(12, "pv_alarm_enable",                 "alarms.pv.enabled",                    FLAG,        "", "PV alarm enable",                  "-", ALARMS, suffix="_EN_PV_Alarm"),
        Word(13, "deviation_alarm_enable",          "alarms.deviation.enabled",             FLAG,        "", "PV deviation alarm enable",        "-", ALARMS, suffix="_EN_DeviationAlm"),
        Word(14, "rate_alarm_enable",               "alarms.rate_of_change_enabled",        FLAG,        "", "PV rate-of-change alarm enable",   "-", ALARMS, suffix="_EN_RateChangeAlm"),
        Word(15, "manual_request",                  None,                                   FLAG,        "", "Manual mode start request",        "-", MODES, "request", suffix="_REQ_Manual"),
        Word(16, "auto_request",                    None,                                   FLAG,        "", "Auto mode start request",          "-", MODES, "request", suffix="_REQ_Auto"),
        Word(17, "autotune_request",                None,                                   FLAG,        "", "Autotune mode start request",      "-", MODES, "request", suffix="_REQ_Autotune"),
        Word(25, "manual_indication",               None,                                   FLAG,        "", "Manual mode indication (unconfirmed)", "-", D952, "status"),
        Word(26, "auto_indication",                 None,                                   FLAG,        "", "Auto mode indication (unconfirmed)", "-", D952, "status"),
        Word(31, "alarm_low_low",                   None,                                   FLAG,        "", "PV low-low alarm",                 "-", ALARMS, "status", suffix="_ALM_LowLow"),
        Word(32, "alarm_low",                       None,                                   FLAG,        "", "PV low alarm",                     "-", ALARMS, "status", suffix="_ALM_Low"),
        Word(33, "alarm_high",                      None,                                   FLAG,        "", "PV high alarm",                    "-", ALARMS, "status", suffix="_ALM_High"),
        Word(34, "alarm_high_high",                 None,                                   FLAG,        "", "PV high-high alarm",               "-", ALARMS, "status", suffix="_ALM_HighHigh"),
        Word(35, "alarm_deviation_high",            None,                                   FLAG,        "", "Deviation high alarm",             "-", ALARMS, "status", suffix="_ALM_DevHigh"),
        Word(36, "alarm_deviation_high_high",       None,                                   FLAG,        "", "Deviation high-high alarm",        "-", ALARMS, "status", suffix="_ALM_DevHighHigh"),
        Word(37, "alarm_rate_of_change",            None,                                   FLAG,        "", "PV rate-of-change alarm",          "-", ALARMS, "status", suffix="_ALM_RateChange"),
    ),
).fill_reserved(D102)

DS_BLOCK = RegisterMap(
    title="Integers (15 consecutive DS)",
    size=15,
    label="DSn+{:02d}",
    words=(
        Word(0,  "error_code",                      None,                                   WHOLE,        "",   "PID error number, the lowest active", "-", ERROR_LIST, "status", suffix="_PID_ErrorCode"),
        Word(5,  "sample_rate",                     "sample_rate",                          MILLISECONDS, "s",  "Sample rate in ms",                  "-", CLICK.cite("Sample Rate(TS)"), suffix="_SampleRate"),
        Word(6,  "derivative_gain_limit",           "derivative_gain_limit",                WHOLE,        "",   "Derivative gain limit factor",       "-", CLICK.cite("Derivative Gain Limit"), suffix="_DerivativeLmt"),
        Word(7,  "pwm_period",                      "output.pwm.period",                    WHOLE,        "s",  "PWM time period",                    "-", CLICK.cite("PWM Control"), suffix="_PWM_Period"),
        Word(8,  "filter",                          "pv.filter",                            WHOLE,        "%",  "PV filter constant",                 "-", CLICK.cite("PV Filter"), suffix="_PV_InputFiltr"),
    ),
).fill_reserved(D102)

DF_BLOCK = RegisterMap(
    title="Floats (25 consecutive DF)",
    size=25,
    label="DFn+{:02d}",
    words=(
        Word(0,  "setpoint",                        "setpoint.value",                       FLOAT,       "pv",   "Setpoint (SP)",                   "-", CLICK.cite("Setpoint (DFn+00)"), suffix="_SP"),
        Word(1,  "setpoint_lower",                  "setpoint.lower_limit",                 FLOAT,       "pv",   "SP lower limit",                  "-", CLICK.cite("Setpoint Upper and Lower Limits"), suffix="_SP_LimitLower"),
        Word(2,  "setpoint_upper",                  "setpoint.upper_limit",                 FLOAT,       "pv",   "SP upper limit",                  "-", CLICK.cite("Setpoint Upper and Lower Limits"), suffix="_SP_LimitUpper"),
        Word(3,  "deadband",                        "error.deadband",                       FLOAT,       "pv",   "Error deadband",                  "-", CLICK.cite("Error Deadband Option"), suffix="_ErrorDeadband"),
        Word(4,  "bias",                            "state.bias",                           FLOAT,       "%",    "Bias",                            "-", ADDRESSES, "status", suffix="_Bias"),
        Word(5,  "proportional_gain",               "tuning.proportional_gain",             FLOAT,       "",     "Proportional gain (P)",           "-", CLICK.cite("Proportional Gain (DFn+05)"), suffix="_P"),
        Word(6,  "reset_time",                      "tuning.reset_time",                    FLOAT,       "s",    "Integral or reset time (I)",      "-", CLICK.cite("Integral or Reset Time (DFn+06)"), suffix="_I"),
        Word(7,  "derivative_gain",                 "tuning.derivative_gain",               FLOAT,       "s",    "Derivative gain (D)",             "-", CLICK.cite("Derivative Gain (DFn+07)"), suffix="_D"),
        Word(8,  "output",                          "state.output",                         FLOAT,       "%",    "Control output (CO)",             "-", CLICK.cite("Control Output (DFn+08)"), "status", suffix="_CO"),
        Word(9,  "output_lower",                    "output.limits.0",                      FLOAT,       "%",    "CO lower limit",                  "-", CLICK.cite("Control Output (DFn+08)"), suffix="_CO_LimitLower"),
        Word(10, "output_upper",                    "output.limits.1",                      FLOAT,       "%",    "CO upper limit",                  "-", CLICK.cite("Control Output (DFn+08)"), suffix="_CO_LimitUpper"),
        Word(11, "raw_pv",                          "state.raw_pv",                         FLOAT,       "pv",   "Raw process variable",            "-", CLICK.cite("Raw Process Variable (DFn+11)"), "status", suffix="_PV_Raw"),
        Word(12, "pv",                              "state.pv",                             FLOAT,       "pv",   "Process variable, filtered",      "-", CLICK.cite("Raw Process Variable (DFn+11)"), "status", suffix="_PV"),
        Word(13, "pv_low_low",                      "alarms.pv.low_low",                    FLOAT,       "pv",   "PV low-low alarm limit",          "-", ALARMS, suffix="_LMT_LowLow"),
        Word(14, "pv_low",                          "alarms.pv.low",                        FLOAT,       "pv",   "PV low alarm limit",              "-", ALARMS, suffix="_LMT_Low"),
        Word(15, "pv_high",                         "alarms.pv.high",                       FLOAT,       "pv",   "PV high alarm limit",             "-", ALARMS, suffix="_LMT_High"),
        Word(16, "pv_high_high",                    "alarms.pv.high_high",                  FLOAT,       "pv",   "PV high-high alarm limit",        "-", ALARMS, suffix="_LMT_HighHigh"),
        Word(17, "deviation_high",                  "alarms.deviation.high",                FLOAT,       "pv",   "Deviation high alarm limit",      "-", ALARMS, suffix="_LMT_DevHigh"),
        Word(18, "deviation_high_high",             "alarms.deviation.high_high",           FLOAT,       "pv",   "Deviation high-high alarm limit", "-", ALARMS, suffix="_LMT_DevHighHigh"),
        Word(19, "rate_of_change",                  "alarms.rate_of_change",                FLOAT,       "pv/sample", "Rate-of-change alarm limit", "-", CLICK.cite("Use PV Rate of Change (Cn+14)"), suffix="_LMT_RateChange"),
        Word(20, "hysteresis",                      "alarms.hysteresis",                    FLOAT,       "pv",   "PV alarm hysteresis",             "-", CLICK.cite("PV Alarm Hysteresis (DFn+20)"), suffix="_ALM_Hysteresis"),
        Word(21, "autotune_hysteresis",             "autotune.hysteresis",                  FLOAT,       "%",    "Autotune output hysteresis",      "-", D101, suffix="_AutotuneHyst"),
        Word(22, "pv_lower",                        "pv.range.0",                           FLOAT,       "pv",   "PV lower limit (process range)",  "-", CLICK.cite("PV Upper and Lower Limits"), suffix="_PV_LimitLower"),
        Word(23, "pv_upper",                        "pv.range.1",                           FLOAT,       "pv",   "PV upper limit (process range)",  "-", CLICK.cite("PV Upper and Lower Limits"), suffix="_PV_LimitUpper"),
    ),
).fill_reserved(D102)

# fmt: on

TUNING_NUMBERS = TuningWords(
    DF_BLOCK, "proportional_gain", "reset_time", "derivative_gain", "percent", Decimal(6000), "direct", "reverse"
)
"""A reset time cannot be switched off; the longest one is as good."""
TABLES = (C_BLOCK, DS_BLOCK, DF_BLOCK)
"""The three blocks of a loop, in the order of their banks."""
SUFFIXES = {"reserved_10": "_C_Reserved_01"}
SUFFIXES |= {word.name: word.suffix for table in TABLES for word in table.words if word.suffix}
"""How the nickname of each register ends; the help has one for a reserved bit, too (D103)."""
MODE_BITS = ("manual_indication", "auto_indication")
"""Bits that tell a loop's mode, as one public page says (D952)."""
BLOCKS = {"bits": ("C", C_BLOCK), "integers": ("DS", DS_BLOCK), "floats": ("DF", DF_BLOCK)}
"""Bank and map of each block, by the key that gives its address."""
BANKS = {key: prefix for key, (prefix, _) in BLOCKS.items()}
MAX_LOOPS = 8
UNUSED_CONTENTS = {"pv.filter": Decimal(100)}
"""What a register holds whose function is not used and has no default, so that no error number comes from it."""


@frozen
class PidError:
    """One of the PLC's PID errors: its number, the register, and its limits, both ends inclusive (None: no limit).

    ``upper_register`` names the register that this one may not exceed.
    """

    number: int
    register: str
    title: str
    low: Decimal | None = None
    high: Decimal | None = None
    upper_register: str | None = None


def _range_error(register: str, title: str, bound: Limits) -> PidError:
    low, high = (None if end is None else Decimal(end) for end in (bound.low, bound.high))
    number = int(str(bound.effect).removeprefix(limits.ERROR_PREFIX))
    return PidError(number, register, title, low, high)


ERRORS = (
    _range_error("sample_rate", "sample rate", limits.SAMPLE_RATE),
    _range_error("derivative_gain_limit", "derivative gain limit", limits.GAIN_LIMIT),
    _range_error("pwm_period", "PWM period", limits.PWM_PERIOD),
    _range_error("filter", "PV filter constant", limits.FILTER),
    PidError(20, "setpoint", "set point is not a number"),
    PidError(21, "setpoint_lower", "SP lower limit is not a number"),
    PidError(22, "setpoint_upper", "SP upper limit is not a number"),
    PidError(23, "setpoint_lower", "SP lower limit above the upper limit", upper_register="setpoint_upper"),
    _range_error("deadband", "error deadband", limits.DEADBAND),
    PidError(25, "bias", "bias is not a number"),
    _range_error("proportional_gain", "proportional gain", limits.GAIN),
    _range_error("reset_time", "reset time", limits.RESET),
    _range_error("derivative_gain", "derivative gain", limits.DERIVATIVE),
    PidError(30, "output_lower", "CO lower limit", low=Decimal(0)),
    _range_error("autotune_hysteresis", "autotune output hysteresis", limits.HYSTERESIS),
)
"""The errors in the order of their numbers; DSn+00 holds the lowest one that is active."""
SETPOINT_CROSSED = next(error.number for error in ERRORS if error.upper_register is not None)
OUTPUT_BELOW_ZERO = next(error.number for error in ERRORS if error.register == "output_lower")

WRITERS = (
    Writer("raw_pv", "live", "the program", CLICK.cite("Raw Process Variable (DFn+11)")),
    Writer(
        "output",
        "live",
        "the PLC in Auto; in Manual the operator or the program",
        CLICK.cite("Control Output (DFn+08)"),
    ),
    Writer(
        "bias", "live", "the PLC: a CLICK loop always has an integral", CLICK.cite("Freeze Bias (Anti-Windup) (Cn+05)")
    ),
    Writer(
        "setpoint",
        "operated",
        "the operator or the program; the PLC, beyond a limit that is enabled",
        CLICK.cite("Setpoint Upper and Lower Limits"),
    ),
    Writer("mode", "live", "the operator or the program, by requests", MODES),
    *(
        Writer(name, "compared", "an autotune", MODES)
        for name in ("sample_rate", "proportional_gain", "reset_time", "derivative_gain")
    ),
)
"""Who else writes a register of a loop; whatever no row names is yours, or the PLC's by its access."""

# --- The PID errors of the CLICK in words: the register, and what it may hold -----------------------------------------

WORDS_BY_NAME = {word.name: word for table in TABLES for word in table.words}
OFFSET_TEXTS = {word.name: table.offset_text(word.offset) for table in TABLES for word in table.words}


def error_text(error: PidError) -> str:
    """An error with its register and what that may hold."""
    return f"PID error {error.number}: {condition_text(error)}"


def condition_text(error: PidError) -> str:
    """What is wrong: the register, and what it may hold."""
    where = f"{error.title} ({OFFSET_TEXTS[error.register]})"
    unit = f" {WORDS_BY_NAME[error.register].unit}".rstrip().replace(" pv", "")
    codec = WORDS_BY_NAME[error.register].codec
    if isinstance(codec, Implied) and codec.decimals and error.low is not None and error.high is not None:
        held = f"{error.low / codec.step:f} to {error.high / codec.step:f} ms"
        return f"{where} is not within {held} ({error.low} to {error.high}{unit})"
    if error.low is None:
        return where
    if error.high is None:
        return f"{where} is below {error.low}{unit} or not a number"
    return f"{where} is not within {error.low} to {error.high}{unit}"


# --- What the CLICK's error numbers, requests and status bits mean for the plant: tables only -------------------------

FORCED_TEXT = "The loop stays in Manual, or falls back into it, until the error is gone."
UNWRITTEN_TEXT = "A value that was never written after the download (0) is the usual reason."
INFERRED_TEXT = "Which state is which is inferred, not printed in the help. Compare it with {shown} in the PID window before {before}."
ALARM_TEXT = (
    "Off again when the PV is back by the hysteresis (DFn+20). The loop goes on as it is; only the bit tells it."
)
UNCONFIRMED_TEXT = (
    "One public page says so; the help names a Mode Indication bit and no address, so nothing is built on it."
)
COMPARE_MODE_ADVICE = "Compare it with the mode in the PID Monitor window, and never write it."
REQUEST_ADVICE = "Set it for a moment; the PLC reads the change from 0 to 1."

# fmt: off
WORD_MEANINGS = {
    "action": Meaning(INFERRED_TEXT.format(shown="Forward/Reverse", before="the first Auto"), "The wrong direction is a runaway: the "
                      "output goes to a limit and stays there. When it is compared, write action_verified: true.",
                      ("CK308",), D100),
    "autotune_method": Meaning(INFERRED_TEXT.format(shown="open or closed loop", before="the autotune"), "", (), D100),
    "autotune_type": Meaning(INFERRED_TEXT.format(shown="PID or PI", before="the autotune"), "", (), D100),
    "error_code": Meaning("The lowest PID error that is active. 0: none. When it is cured, the next one shows up, so "
                          "look again after each cure.", "", ("CK309",), ERROR_LIST),
    "manual_request": Meaning("Asks for Manual: the output then stays where it is put.", REQUEST_ADVICE, (), MODES),
    "auto_request": Meaning("Asks for Auto; works only from Manual, and not while a PID error is active.", REQUEST_ADVICE, (), MODES),
    "autotune_request": Meaning("Asks for the autotune; works only in Auto. Switched off again, it ends the autotune "
                                "and the loop is back in Auto.", "Stay at the plant while it runs.", (), MODES),
    "manual_indication": Meaning(f"On: the loop is in Manual, as it seems. {UNCONFIRMED_TEXT}", COMPARE_MODE_ADVICE, (), D952),
    "auto_indication": Meaning(f"On: the loop is in Auto, as it seems. {UNCONFIRMED_TEXT}", COMPARE_MODE_ADVICE, (), D952),
    "alarm_low_low": Meaning(f"The PV is below the low-low limit in DFn+13. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_low": Meaning(f"The PV is below the low limit in DFn+14. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_high": Meaning(f"The PV is above the high limit in DFn+15. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_high_high": Meaning(f"The PV is above the high-high limit in DFn+16. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_deviation_high": Meaning(f"The PV is further from the set point than DFn+17 allows, above or below. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_deviation_high_high": Meaning(f"The PV is further from the set point than DFn+18 allows, above or below. {ALARM_TEXT}", "", (), ALARMS),
    "alarm_rate_of_change": Meaning("The PV changed by more within one sample than DFn+19 allows.",
                                    "A broken sensor or wire jumps like this; if the signal is only noisy, filter it.",
                                    (), CLICK.cite("Use PV Rate of Change (Cn+14)")),
    "bias": Meaning("The integral: the part of the output that holds the set point at rest."),
    "output": Meaning("What the loop gives to the actuator. Read only in Auto; in Manual the operator writes it.",
                      "", (), CLICK.cite("Control Output (DFn+08)")),
    "raw_pv": Meaning("The measurement as the program writes it here; the loop controls this value."),
    "pv": Meaning("The measurement behind the PV filter; without the filter the same as DFn+11."),
}
# fmt: on
"""By the name of a register that the configuration does not set."""

WRITER_TEXTS = {row.name: row.writer for row in WRITERS if row.name in {"raw_pv", "output"}}
"""Who writes a register that is not the PLC's alone."""
INFERRED_REMARKS = dict.fromkeys(
    ("action", "autotune_method", "autotune_type"), f"inferred, not printed: compare the PID window, D{D100.number}"
) | dict.fromkeys(MODE_BITS, f"unconfirmed: compare the PID Monitor window, D{D952.number}")
"""Remarks on registers whose states are a reading of ours."""
CROSSED_RULES = ("CK311", "CK312")
"""Rules that find crossed limits before the download."""
OUTPUT_RULES = ("CK363",)


def _code(error: PidError) -> Code:
    fault_kind = "crossed" if error.upper_register is not None else "number" if error.low is None else "limits"
    cure = {
        "crossed": "Put the lower limit below the upper one, or switch one of them off (Cn+00, Cn+01).",
        "number": "Write a number into the register; a calculation of the program has left something else there.",
        "limits": "Write a value that is allowed."
        + (f" {UNWRITTEN_TEXT}" if error.low is not None and error.low > 0 else "")
        + (" There is an upper bound too, which is not known." if error.number == OUTPUT_BELOW_ZERO else ""),
    }[fault_kind]
    rules = {"crossed": CROSSED_RULES, "number": (), "limits": ("PID101",)}[fault_kind]
    if error.number == OUTPUT_BELOW_ZERO:
        rules = OUTPUT_RULES
    basis = D101 if error.register == "autotune_hysteresis" else ERROR_LIST
    return Code("error_code", error.number, condition_text(error), Meaning(FORCED_TEXT, cure, rules, basis))


CODES = (
    Code("error_code", 0, "no PID error", Meaning("Nothing is wrong with the loop's values.", "", (), ERROR_LIST)),
    *(_code(error) for error in ERRORS),
)

NO_REGISTER = ("output.pwm.bit",)
"""Settings that act on a loop and that no register has, by key."""
