"""DL06 registers, bits, error codes and the codecs that only this PLC has: tables only, offsets in octal."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from decimal import Decimal
from typing import Any

from pidcfg.encoders.codecs import (
    SIGN_BIT,
    Bcd,
    Binary,
    Distance,
    EncodeError,
    Format,
    Pointer,
    Position,
    Scale,
    SignMagnitude,
    is_raw,
)
from pidcfg.encoders.regmap import D345, WORD, Bank, Bits, Meaning, RegisterMap, Space, TuningWords, Word, Writer
from pidcfg.schemas.base import LAST_V_ADDRESS, RESET_UNIT, v_name
from pidcfg.text.frozen import frozen
from pidcfg.text.references import DL06, Decision

# --- Codecs of words that only the DL06 has ---------------------------------------------------------------------------


@frozen
class SpanBcd:
    """A BCD word that holds a difference on a named scale per second."""

    scale: str
    bcd: Bcd

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "BCD counts a second"

    def encode(self, value: Any, scale: Scale) -> int:
        """A quantity to counts in BCD; the limits of an error are in the quantity's own unit."""
        try:
            return self._word(value, scale)
        except EncodeError as error:
            if error.fault != "range" or is_raw(value, scale):
                raise
            most = self.decode(self.bcd.encode(self.bcd.high), scale).value
            raise EncodeError(error.fault, str(error), error.low, most) from None

    def _word(self, value: Any, scale: Scale) -> int:
        return self.bcd.encode(scale.distance(value))

    def decode(self, word: int, scale: Scale) -> Any:
        """The word to a quantity."""
        counts = self.bcd.decode(word)
        return scale.matching_span(counts, lambda q: self._same(q, scale, word))

    def _same(self, value: object, scale: Scale, word: int) -> bool:
        try:
            return self._word(value, scale) == word
        except EncodeError:
            return False


@frozen
class Source:
    """Where an auto transfer goes: base, slot and channel, or with bit 15 a V-memory address."""

    @property
    def notation(self) -> str:
        """How the word is written, for reference pages."""
        return "slot and channel, or address"

    def encode(self, value: tuple[int, int, int] | int) -> int:
        """``(base, slot, channel)`` or an address to its word: slot 1, channel 2 is 0102."""
        if isinstance(value, int):
            if not 0 <= value < SIGN_BIT:
                raise EncodeError("range", "an address beyond V77777 does not fit the lower 15 bits")
            return SIGN_BIT | value
        base, slot, channel = value
        if not (0 <= base <= 7 and 0 <= slot <= 15 and 0 <= channel <= 255):
            raise EncodeError("range", "base, slot or channel does not fit its digits")
        return base << 12 | slot << 8 | channel

    def spell(self, word: int, name: Callable[[int], str]) -> str:
        """The place in words."""
        source = self.decode(word)
        if isinstance(source, int):
            return name(source)
        return "none" if source is None else "base {}, slot {}, channel {}".format(*source)

    def decode(self, word: int) -> tuple[int, int, int] | int | None:
        """A word to ``(base, slot, channel)``, an address, or None for no transfer."""
        if word & SIGN_BIT:
            return word & ~SIGN_BIT
        return (word >> 12, word >> 8 & 0xF, word & 0xFF) if word else None


# --- DL06 registers: tables only, offsets in octal as the manual prints them ------------------------------------------
#
# ``path`` is where a register's value stands in a loop of the configuration; a register without a path is written by
# the controller. ``read`` is the manual's column "Read on the Fly": ``*`` alarm words are read when their enable bit
# goes from 0 to 1, ``**`` words at a change of the PLC's mode.

TABLE = DL06.cite("Loop Table Word Definitions")
SETUP = DL06.cite("Establishing the Loop Table Size and Location")
RAMP_TABLE = DL06.cite("Ramp/Soak Table")
TRANSFER = DL06.cite("PV Auto Transfer (Addr + 36) from I/O Module Base/Slot/Channel Option")
OUTPUT_TRANSFER = DL06.cite("Auto Transfer to Analog I/O")
FLAGS = DL06.cite("Ramp / Soak Table Flags (Addr + 33)")

D01 = Decision(
    1,
    "reset has one decimal",
    "The reset word has one implied decimal (0.1 to 999.8); `reset_decimals: 2` selects two.",
    "The feature table says 0.1 to 999.8, the text says all three gains are xx.xx; a wrong reading is a factor of ten.",
)
D02 = Decision(
    2,
    "bipolar words are sign and magnitude",
    "Bit 15 is the sign; −0 and stray bits above the magnitude are not values.",
    "The manual says the MSB is the sign bit; the sister manuals of DL05 and DL405 print FFF-8FFF-8001 for −4095…−1.",
)
D03 = Decision(
    3,
    "auto transfer digits",
    "Slot stands in the third digit, the channel in the lower byte as hexadecimal (1 to 10 hex).",
    "The manual's example 0102 means slot 1, channel 2; its table allows 16 channels. It numbers slots from 0 in the text "
    "and from 1 in the table; the table is followed.",
)
D04 = Decision(
    4,
    "mode requests are encoded as 000",
    "Bits 0 to 2 of +00 are momentary requests; the mode of a configuration is kept "
    "beside the words and requested after the start.",
    "Their normal state is 000; the controller clears them when it has read them.",
)
D16 = Decision(
    16,
    "the scale of a square-root loop",
    "The set point runs from 0 to the root of the span (0 to 64 counts for 12 bit); error = SP − √PV is normalised "
    "by that root; alarms compare the raw PV, deviation alarms with SP².",
    'The manual divides "the desired SP value by the square root of the analog span". A full-scale error keeps its '
    "full-scale effect; the alarm words have no root in the manual's figures. Of a bipolar format the span is twice the "
    "largest PV, so that 70.7 % of the set point's scale is the root of it, and no PV reaches more.",
)

SPACE = Space((Bank("V", 0, LAST_V_ADDRESS, WORD, octal=True),))

UNSIGNED_12, UNSIGNED_15, UNSIGNED_16 = Binary(0x0FFF), Binary(0x7FFF), Binary(0xFFFF)
SIGNED_12, SIGNED_15 = SignMagnitude(0x0FFF), SignMagnitude(0x7FFF)

FORMATS = {
    f.name: f
    for f in (
        Format("12-bit unipolar", UNSIGNED_12),
        Format("12-bit bipolar", SIGNED_12),
        Format("15-bit unipolar", UNSIGNED_15),
        Format("15-bit bipolar", SIGNED_15),
        Format("16-bit unipolar", UNSIGNED_16),
    )
}

# Bits 0, 1, 9 of +01 (PV) and 11, 12, 13 (output): with the 16-bit bit on, the other two are not read (notes 1 and 3).
_FORMAT_CODES = {0b000: "12-bit unipolar", 0b001: "12-bit bipolar", 0b010: "15-bit unipolar", 0b011: "15-bit bipolar"}
PV_FORMAT = {**_FORMAT_CODES, **dict.fromkeys(range(4, 8), "16-bit unipolar")}
# Bit 10 first: 0 means that the output has the PV's format (note 2).
OUTPUT_FORMAT = {
    0b0000: None,
    **{code << 1 | 1: name for code, name in PV_FORMAT.items()},
    **{code << 1: None for code in PV_FORMAT},
}

OCTAL = "+{:02o}"
OFF_ON = {0: False, 1: True}
ADDRESS = Pointer()
BITS = Binary()
GAIN = Bcd(2, off=(0,))
RESET = {1: Bcd(1, off=(0, 9999)), 2: Bcd(2, off=(0, 9999))}
RESET_OFF = frozenset(digits * codec.step for codec in RESET.values() for digits in codec.off)
"""Reset times that mean no integral."""
FILTER = Bcd(1, off=(0,))
SAMPLE_RATE = Bcd(2, off=(0,), off_effect="not allowed")
SLOPE = Bcd(2, off=(0,), off_effect="ends the profile")
GAIN_LIMIT = Bcd(0, off=(0,), off_effect="removes the derivative while bit 9 of +00 is on")

# fmt: off
LOOP_TABLE = RegisterMap(
    title="Loop table (32 words a loop)",
    label=OCTAL,
    size=0o40,
    words=(
        #    offset name                     path                     codec                unit      title
        #                       read   basis  access
        Word(0o00, "mode_setting_1",         None,                    BITS,                "",       "PID loop mode setting 1",              "yes", TABLE),
        Word(0o01, "mode_setting_2",         None,                    BITS,                "",       "PID loop mode setting 2",              "yes", TABLE),
        Word(0o02, "setpoint",               "setpoint.value",        Position("sp"),      "pv",     "Set point (SP)",                       "yes", TABLE),
        Word(0o03, "pv",                     "state.pv",              Position("pv"),      "pv",     "Process variable (PV)",                "yes", TABLE, "status"),
        Word(0o04, "bias",                   "state.bias",            Position("output"),  "output", "Bias (integrator)",                    "yes", TABLE, "status"),
        Word(0o05, "output",                 "state.output",          Position("output"),  "output", "Control output",                       "yes", TABLE, "status"),
        Word(0o06, "mode_and_alarm_status",  None,                    BITS,                "",       "Loop mode and alarm status",           "-",   TABLE, "status"),
        Word(0o07, "sample_rate",            "sample_rate",           SAMPLE_RATE,         "s",      "Sample rate",                          "yes", TABLE),
        Word(0o10, "gain",                   "tuning.gain",           GAIN,                "%/%",    "Gain (proportional)",                  "yes", TABLE),
        Word(0o11, "reset",                  "tuning.reset",          RESET[1],            RESET_UNIT, "Reset (integral) time",              "yes", D01),
        Word(0o12, "rate",                   "tuning.rate",           Bcd(2, off=(0,)),    "s",      "Rate (derivative) time",               "yes", TABLE),
        Word(0o13, "pv_low_low",             "alarms.pv.low_low",     Position("pv"),      "pv",     "PV low-low alarm",                     "no*", TABLE),
        Word(0o14, "pv_low",                 "alarms.pv.low",         Position("pv"),      "pv",     "PV low alarm",                         "no*", TABLE),
        Word(0o15, "pv_high",                "alarms.pv.high",        Position("pv"),      "pv",     "PV high alarm",                        "no*", TABLE),
        Word(0o16, "pv_high_high",           "alarms.pv.high_high",   Position("pv"),      "pv",     "PV high-high alarm",                   "no*", TABLE),
        Word(0o17, "deviation_yellow",       "alarms.deviation.yellow", Distance("pv"),    "pv",     "PV deviation alarm, yellow",           "no*", TABLE),
        Word(0o20, "deviation_red",          "alarms.deviation.red",  Distance("pv"),      "pv",     "PV deviation alarm, red",              "no*", TABLE),
        Word(0o21, "rate_of_change",         "alarms.rate_of_change", Distance("pv"),      "pv/sample", "PV rate-of-change alarm",           "no*", TABLE),
        Word(0o22, "hysteresis",             "alarms.hysteresis",     Distance("pv"),      "pv",     "PV alarm hysteresis",                  "no*", TABLE),
        Word(0o23, "deadband",               "error.deadband",        Distance("sp"),      "pv",     "Error deadband",                       "yes", TABLE),
        Word(0o24, "filter",                 "pv.filter",             FILTER,              "",       "PV low-pass filter constant",          "-",   TABLE),
        Word(0o25, "derivative_gain_limit",  "derivative_gain_limit", GAIN_LIMIT,          "",       "Derivative gain limit",                "no**", TABLE),
        Word(0o26, "setpoint_low",           "setpoint.limits.0",     Position("sp"),      "pv",     "SP lower limit",                       "yes", TABLE),
        Word(0o27, "setpoint_high",          "setpoint.limits.1",     Position("sp"),      "pv",     "SP upper limit",                       "yes", TABLE),
        Word(0o30, "output_low",             "output.limits.0",       Position("output"),  "output", "Control output lower limit",           "no**", TABLE),
        Word(0o31, "output_high",            "output.limits.1",       Position("output"),  "output", "Control output upper limit",           "no**", TABLE),
        Word(0o32, "remote_setpoint",        "remote_setpoint",       ADDRESS,             "",       "Remote SP V-memory address pointer",   "yes", TABLE, other_key="cascade_from"),
        Word(0o33, "ramp_soak_flags",        None,                    BITS,                "",       "Ramp/soak setting flags",              "yes", TABLE),
        Word(0o34, "ramp_soak_table",        "ramp_soak.table",       ADDRESS,             "",       "Ramp/soak table starting address",     "no**", TABLE),
        Word(0o35, "ramp_soak_errors",       None,                    BITS,                "",       "Ramp/soak table programming errors",   "no**", TABLE, "status"),
        Word(0o36, "pv_transfer",            "pv.transfer",           Source(),            "",       "PV auto transfer",                     "-",   TRANSFER),
        Word(0o37, "output_transfer",        "output.transfer",       Source(),            "",       "Control output auto transfer",         "-",   OUTPUT_TRANSFER),
    ),
    bits=(
        #    offset bits            path                              choices                             title
        Bits(0o00, (0,),            None,                             OFF_ON,                             "Manual mode request", "request"),
        Bits(0o00, (1,),            None,                             OFF_ON,                             "Automatic mode request", "request"),
        Bits(0o00, (2,),            None,                             OFF_ON,                             "Cascade mode request", "request"),
        Bits(0o00, (3,),            "bumpless",                       {0: "I", 1: "II"},                  "Bumpless transfer"),
        Bits(0o00, (4,),            "action",                         {0: "direct", 1: "reverse"},        "Direct- or reverse-acting loop"),
        Bits(0o00, (5,),            "algorithm",                      {0: "position", 1: "velocity"},     "Position or velocity algorithm"),
        Bits(0o00, (6,),            "pv.square_root",                 OFF_ON,                             "PV square-root extract"),
        Bits(0o00, (7,),            "error.curve",                    {0: "linear", 1: "squared"},        "Error term linear or squared"),
        Bits(0o00, (8,),            "error.deadband_enabled",         OFF_ON,                             "Error deadband enable"),
        Bits(0o00, (9,),            "derivative_gain_limit_enabled",  OFF_ON,                             "Derivative gain limit"),
        Bits(0o00, (10,),           "bias_freeze",                    OFF_ON,                             "Bias (integrator) freeze"),
        Bits(0o00, (11,),           "ramp_soak.enabled",              OFF_ON,                             "Ramp/soak operation"),
        Bits(0o00, (12,),           "alarms.pv.enabled",              OFF_ON,                             "PV alarm monitor"),
        Bits(0o00, (13,),           "alarms.deviation.enabled",       OFF_ON,                             "PV deviation alarm"),
        Bits(0o00, (14,),           "alarms.rate_of_change_enabled",  OFF_ON,                             "PV rate-of-change alarm"),
        Bits(0o00, (15,),           "independent_of_cpu_mode",        OFF_ON,                             "Loop mode independent of CPU mode"),
        Bits(0o01, (0, 1, 9),       "pv.format",                      PV_FORMAT,                          "PV (and output) data format: bipolar, 15 bit, 16 bit"),
        Bits(0o01, (2,),            "pv.filter_enabled",              OFF_ON,                             "PV filter (called analog input filter/auto transfer)"),
        Bits(0o01, (3,),            "setpoint.limits_enabled",        OFF_ON,                             "SP limit enable"),
        Bits(0o01, (4,),            "tuning.reset_unit",              {0: "seconds", 1: "minutes"},       "Reset units"),
        Bits(0o01, (5,),            "autotune.method",                {0: "closed", 1: "open"},           "Auto-tune algorithm"),
        Bits(0o01, (6,),            "autotune.type",                  {0: "PID", 1: "PI"},                "Auto-tune PID or PI only"),
        Bits(0o01, (7,),            "autotune.start",                 OFF_ON,                             "Auto-tune start", "request"),
        Bits(0o01, (8,),            None,                             OFF_ON,                             "PID scan clock (internal use)", "status"),
        Bits(0o01, (10, 11, 12, 13), "output.format",                 OUTPUT_FORMAT,                      "Output data format of its own: separate, bipolar, 15 bit, 16 bit"),
        Bits(0o01, (14, 15),        None,                             {0: None},                          "Reserved", "reserved"),
        Bits(0o06, (0,),            None,                             OFF_ON,                             "Manual mode", "status"),
        Bits(0o06, (1,),            None,                             OFF_ON,                             "Automatic mode", "status"),
        Bits(0o06, (2,),            None,                             OFF_ON,                             "Cascade mode", "status"),
        Bits(0o06, (3,),            None,                             OFF_ON,                             "PV low-low alarm", "status"),
        Bits(0o06, (4,),            None,                             OFF_ON,                             "PV low alarm", "status"),
        Bits(0o06, (5,),            None,                             OFF_ON,                             "PV high alarm", "status"),
        Bits(0o06, (6,),            None,                             OFF_ON,                             "PV high-high alarm", "status"),
        Bits(0o06, (7,),            None,                             OFF_ON,                             "PV yellow deviation alarm", "status"),
        Bits(0o06, (8,),            None,                             OFF_ON,                             "PV red deviation alarm", "status"),
        Bits(0o06, (9,),            None,                             OFF_ON,                             "PV rate-of-change alarm", "status"),
        Bits(0o06, (10,),           None,                             OFF_ON,                             "Alarm value programming error", "status"),
        Bits(0o06, (11,),           None,                             OFF_ON,                             "Loop calculation overflow/underflow", "status"),
        Bits(0o06, (12,),           None,                             OFF_ON,                             "Loop in auto-tune", "status"),
        Bits(0o06, (13,),           None,                             OFF_ON,                             "Auto-tune error", "status"),
        Bits(0o06, (14, 15),        None,                             {0: None},                          "Reserved", "reserved"),
        Bits(0o33, (0, 1, 2, 3),    "ramp_soak.request",              {0: "none", 1: "start", 2: "hold", 4: "resume", 8: "jog"}, "Ramp/soak start, hold, resume, jog", "request"),
        Bits(0o33, (4,),            None,                             OFF_ON,                             "Ramp/soak profile complete", "status"),
        Bits(0o33, (5,),            None,                             OFF_ON,                             "Ramp/soak deviation", "status"),
        Bits(0o33, (6,),            None,                             OFF_ON,                             "Ramp/soak profile in hold", "status"),
        Bits(0o33, (7,),            None,                             {0: None},                          "Reserved", "reserved"),
        Bits(0o33, tuple(range(8, 16)), None,                         {n: n for n in range(17)},          "Current step in the profile, 1 to 16", "status"),
        Bits(0o35, (0,),            None,                             OFF_ON,                             "Starting address out of lower V-memory range", "status"),
        Bits(0o35, (1,),            None,                             OFF_ON,                             "Starting address out of upper V-memory range", "status"),
        Bits(0o35, (2, 3),          None,                             {0: None},                          "Reserved", "reserved"),
        Bits(0o35, (4,),            None,                             OFF_ON,                             "Starting address in system V-memory", "status"),
        Bits(0o35, tuple(range(5, 16)), None,                         {0: None},                          "Reserved", "reserved"),
    ),
)

READ_DELAYS = {
    "no*": "is not read until the alarm's enable bit goes from 0 to 1",
    "no**": "is not read until the PLC changes between Program and Run",
}
"""What the manual's column "Read on the Fly" means for a word that has just been written."""

RAMP_SOAK_PAIRS = 8
RAMP_SOAK_PAIR = RegisterMap(
    title="Ramp/soak pair (8 of them in a table of 32 words)",
    label=OCTAL,
    size=4,
    words=(
        Word(0o0, "ramp_to",   "ramp_to",   Position("sp"),                      "pv",   "Ramp end SP value", "yes", RAMP_TABLE),
        Word(0o1, "slope",     "slope",     SpanBcd("sp", SLOPE),                "pv/s", "Ramp slope",        "yes", RAMP_TABLE),
        Word(0o2, "soak",      "soak",      Bcd(1, off=(0,)),                    "min",  "Soak duration",     "yes", RAMP_TABLE),
        Word(0o3, "deviation", "deviation", Distance("sp"),                      "pv",   "Soak PV deviation", "yes", RAMP_TABLE),
    ),
)
RAMP_SOAK_SIZE = RAMP_SOAK_PAIRS * RAMP_SOAK_PAIR.size

TABLE_POINTER, LOOP_COUNT, ERROR_FLAGS = 0o7640, 0o7641, 0o7642
SETUP_WORDS = RegisterMap(
    title="Set-up words (V7640 and up)",
    label=OCTAL,
    size=3,
    words=(
        Word(TABLE_POINTER - 0o7640, "loop_table",      "plc.loop_table",      ADDRESS, "", "Loop parameter table pointer", "program-to-run", SETUP),
        Word(LOOP_COUNT - 0o7640,    "number_of_loops", "plc.number_of_loops", Bcd(0),  "", "Number of loops",              "program-to-run", SETUP),
        Word(ERROR_FLAGS - 0o7640,   "error_flags",     None,                  BITS,    "", "Loop error flags",             "-",              SETUP, "status"),
    ),
    bits=(
        Bits(2, (0,), None, OFF_ON, "The loop table starts outside the lower V-memory range", "status"),
        Bits(2, (1,), None, OFF_ON, "The loop table starts outside the upper V-memory range", "status"),
        Bits(2, (2,), None, OFF_ON, "The number of loops is greater than 8", "status"),
        Bits(2, (3,), None, OFF_ON, "The loop table extends past V7577", "status"),
        Bits(2, tuple(range(4, 16)), None, {0: None}, "Reserved", "reserved"),
    ),
)
# fmt: on

TABLES = (SETUP_WORDS, LOOP_TABLE, RAMP_SOAK_PAIR)
"""All register blocks, for the documentation."""

LOOP_TABLES = {
    decimals: replace(
        LOOP_TABLE, words=tuple(replace(w, codec=codec) if w.name == "reset" else w for w in LOOP_TABLE.words)
    )
    for decimals, codec in RESET.items()
}
"""The loop table by the number of decimals that the reset word is read with (decision D01)."""


TUNING_NUMBERS = TuningWords(LOOP_TABLE, "gain", "reset", "rate", "span", Decimal(0), "direct", "reverse")


@frozen
class Cpu:
    """What differs between the CPUs of the family, as octal addresses, both ends inclusive."""

    title: str
    loops: int
    lower: tuple[int, int]
    upper: tuple[int, int]
    lower_end: int
    upper_end: int
    transfer_sources: tuple[tuple[int, int], ...]
    system: tuple[int, int]
    non_volatile: tuple[int, int]
    user: tuple[tuple[int, int], ...]
    fast_loops: int
    fast_rate: str
    slow_rate: str


CPU = Cpu(
    title="DL06",
    loops=8,
    lower=(0o1200, 0o7340),
    upper=(0o10000, 0o17740),
    lower_end=0o7577,
    upper_end=0o17777,
    transfer_sources=((0o400, 0o677), (0o1200, 0o7377), (0o10000, 0o17777)),
    system=(0o7600, 0o7777),
    non_volatile=(0o7400, 0o7577),
    user=((0o400, 0o677), (0o1200, 0o7577), (0o10000, 0o17777)),
    fast_loops=4,
    fast_rate="0.05",
    slow_rate="0.1",
)


SOURCES = DL06.cite("Data Sources")
TUNE = DL06.cite("Open-Loop Auto Tuning, Closed-Loop Auto Tuning")
LOOP_MODES = DL06.cite("Loop Modes")
WRITERS = (
    Writer("pv", "live", "the ladder program, or the PLC by auto transfer (+36)", SOURCES),
    Writer("output", "live", "the PLC in Automatic and Cascade; in Manual the operator or the program", LOOP_MODES),
    Writer(
        "bias",
        "live",
        "the PLC; the program too, for feedforward",
        DL06.cite("Bias Term"),
        lambda values: values["tuning.reset"] not in RESET_OFF,
    ),
    Writer("bias", "compared", "the program", D345),
    Writer("setpoint", "live", "the ramp/soak generator", SOURCES, lambda values: values["ramp_soak.enabled"]),
    Writer(
        "setpoint", "live", "the loop or the word that +32 points at", SOURCES, lambda values: values["remote_setpoint"]
    ),
    Writer("setpoint", "operated", "the operator or the program", SOURCES),
    Writer("mode", "live", "the operator or the program, by requests", D04),
    *(Writer(name, "compared", "an auto-tune", TUNE) for name in ("sample_rate", "gain", "reset", "rate")),
)
"""Who else writes a word of a loop; whatever no row names is yours, or the PLC's by its access."""

# --- What the DL06's flags, requests and status bits mean for the plant: tables only ----------------------------------
#
# Keys are the register's name and the lowest bit of the row in the register map; names and bits stand there.

ERROR_FLAGS_BASIS = DL06.cite("PID Error Flags, V7642")
MODES = DL06.cite("Mode / Alarm Monitoring Word (Addr + 06)")
TROUBLE_TIPS = DL06.cite("Troubleshooting Tips")
ALARM_ERROR = DL06.cite("Alarm Programming Error")
TUNING = DL06.cite("Auto Tuning error")
RAMP_ERRORS = DL06.cite("Ramp/Soak Table Programming Error Flags (Addr + 35)")

NO_LOOP_TEXT = "The loop task does not run: no loop is calculated, in any mode."
STOP_TEXT = (
    "This stops the machine: in Program mode the outputs are off and the loops that follow the CPU are in Manual."
)
RECHECK_ADVICE = (
    f"Then change the CPU from Program to Run: it looks at V7640 and V7641 only at that moment. {STOP_TEXT}"
)
TABLE_ADVICE = (
    "Put an address of 32 free words of user memory into +34, then change the CPU from Program to Run. " + STOP_TEXT
)
LOWER, UPPER = (f"{v_name(first)} to {v_name(last)}" for first, last in (CPU.lower, CPU.upper))
SEGMENT_ADVICE = "Look at +35 when the profile does not start."
PV_ALARM_TEXT = "A loop in Manual does not go to Automatic while it is on."
PV_ALARM_ADVICE = (
    "Look at the plant and the sensor first. It goes off when the PV is back across the limit by the hysteresis (+22)."
)
REQUEST_ADVICE = (
    "Set it for one moment and let go; the CPU clears it when it has read it. +06 shows the mode that was reached."
)

# fmt: off
BIT_MEANINGS = {
    ("error_flags", 0): Meaning(
        f"{NO_LOOP_TEXT} V7640 holds an address below {v_name(CPU.upper[0])} that is not within {LOWER}.",
        f"Put the start of the loop table into V7640: {LOWER}, or {UPPER}. {RECHECK_ADVICE}", ("DL201",), ERROR_FLAGS_BASIS),
    ("error_flags", 1): Meaning(
        f"{NO_LOOP_TEXT} V7640 holds an address above {v_name(CPU.upper[1])}.",
        f"Put the start of the loop table into V7640: {UPPER}, or {LOWER}. {RECHECK_ADVICE}", ("DL202",), ERROR_FLAGS_BASIS),
    ("error_flags", 2): Meaning(
        f"{NO_LOOP_TEXT} V7641 asks for more than {CPU.loops} loops, or is no BCD number.",
        f"Put the number of loops into V7641, 0 to {CPU.loops} in BCD. {RECHECK_ADVICE}", ("DL203",), ERROR_FLAGS_BASIS),
    ("error_flags", 3): Meaning(
        f"{NO_LOOP_TEXT} The table begins below {v_name(CPU.lower_end)} and would run past it into the system's words.",
        f"Start the table closer to {v_name(CPU.lower[0])} (V7640; each loop takes 40 octal words), or calculate fewer "
        f"loops (V7641). {RECHECK_ADVICE}", ("DL204",), ERROR_FLAGS_BASIS),

    ("mode_setting_1", 0): Meaning("Asks for Manual: the output then stays where it is put.", REQUEST_ADVICE, (), D04),
    ("mode_setting_1", 1): Meaning("Asks for Automatic. Refused while a PV alarm or the alarm programming error is on, "
                                   "or while the minor loop of a cascade is not in Cascade.", REQUEST_ADVICE, (), TROUBLE_TIPS),
    ("mode_setting_1", 2): Meaning("Asks for Cascade: the set point then comes from the word that +32 points at.",
                                   REQUEST_ADVICE, (), D04),
    ("mode_setting_2", 7): Meaning("Starts the auto-tune: it takes the output over and moves the plant. Off again when "
                                   "it is done.", "Stay at the plant while it runs; bits 12 and 13 of +06 tell how it "
                                   "goes.", (), DL06.cite("PID Mode Setting 2 Bit Descriptions (Addr + 01)")),
    ("mode_setting_2", 8): Meaning("The CPU's own clock; nothing to do with the plant."),

    ("mode_and_alarm_status", 0): Meaning(
        "The loop is in Manual: it does not control, the output (+05) stands where the operator or the program puts it.",
        "To control, set bit 1 of +00 for a moment. If the loop stays in Manual, look at bits 3 to 6 and 10, "
        "and, of a major loop, whether its minor loop is in Cascade.", (), TROUBLE_TIPS),
    ("mode_and_alarm_status", 1): Meaning(
        "The loop is in Automatic: it works the output (+05) out from its own set point (+02) and the PV (+03).", "", (), MODES),
    ("mode_and_alarm_status", 2): Meaning(
        "The loop is in Cascade: its set point is the word that +32 points at, the output of another loop.", "", (), MODES),
    ("mode_and_alarm_status", 3): Meaning(f"The PV is below the low-low limit in +13. {PV_ALARM_TEXT}", PV_ALARM_ADVICE, ("DL248",), TROUBLE_TIPS),
    ("mode_and_alarm_status", 4): Meaning(f"The PV is below the low limit in +14. {PV_ALARM_TEXT}", PV_ALARM_ADVICE, ("DL248",), TROUBLE_TIPS),
    ("mode_and_alarm_status", 5): Meaning(f"The PV is above the high limit in +15. {PV_ALARM_TEXT}", PV_ALARM_ADVICE, ("DL248",), TROUBLE_TIPS),
    ("mode_and_alarm_status", 6): Meaning(f"The PV is above the high-high limit in +16. {PV_ALARM_TEXT}", PV_ALARM_ADVICE, ("DL248",), TROUBLE_TIPS),
    ("mode_and_alarm_status", 7): Meaning(
        "The PV is further from the set point than the yellow limit in +17.",
        "Normal for a while after a change of the set point; else look at the output, the actuator and the load.", (), MODES),
    ("mode_and_alarm_status", 8): Meaning(
        "The PV is further from the set point than the red limit in +20.",
        "The loop does not hold its set point: look whether the output is at a limit, and at actuator and sensor.", (), MODES),
    ("mode_and_alarm_status", 9): Meaning(
        "The PV changed by more counts within one sample than +21 allows. The hysteresis does not apply to it.",
        "A broken sensor or wire jumps like this; if the signal is only noisy, filter it (+24) or raise +21.", ("DL247",), MODES),
    ("mode_and_alarm_status", 10): Meaning(
        "The alarm limits are not in their order. The loop does not go to Automatic, and one that was there is put "
        "into Manual.",
        "Put +13 < +14 < +15 < +16 (low-low, low, high, high-high) and +17 < +20 (yellow, red), each at least one count "
        "apart. The CPU reads them when the alarm's enable bit goes from 0 to 1: switch bit 12 or 13 of +00 off and on.",
        ("DL242", "DL244"), ALARM_ERROR),
    ("mode_and_alarm_status", 11): Meaning(
        "The calculation gave a number that does not fit its word. The output is not to be trusted, and the loop goes "
        "to Manual.",
        "Look at the gains (+10 to +12 are BCD, not binary), at the data format (+01) and at the PV, then ask for "
        "Automatic again.", (), MODES),
    ("mode_and_alarm_status", 12): Meaning("The auto-tune has the output and moves the plant.",
                                           "Wait, and stay at the plant.", (), TUNING),
    ("mode_and_alarm_status", 13): Meaning(
        "The auto-tune has not started, or was given up, and the gains are the old ones; or the relay of the closed loop "
        "went to the ends of the output's range, and the gains are new all the same (D29): compare +10 to +12.",
        "Open loop (bit 5 of +01 on): the PV must be at least 205 counts of a 12-bit format, 5 % of full scale, below "
        "the SP of a direct-acting loop, above that of a reverse-acting one (D28). Closed loop: bring PV and SP within 5 % "
        "of full scale, and narrow the output limits (+30 and +31), between which the relay switches. Then start again "
        "(bit 7 of +01); the manual contradicts itself, so try the other reading if the bit comes back.",
        ("DL299", "DL501"), TUNING),

    ("ramp_soak_flags", 0): Meaning(f"Asks for start (1), hold (2), resume (4) or jog to the next segment (8) of the "
                                    f"profile. {SEGMENT_ADVICE}", "Set one of bits 0 to 3 for a moment. The generator "
                                    "must be on (bit 11 of +00), and the loop not in Cascade.", ("DL281",), TROUBLE_TIPS),
    ("ramp_soak_flags", 4): Meaning("The profile has run to its end; the set point stays at its last value.", "", (), FLAGS),
    ("ramp_soak_flags", 5): Meaning("The PV is further from the set point of the profile than the deviation of its soak "
                                    "segment allows.", "Look whether the plant can follow: output at a limit, slope too steep.", (), FLAGS),
    ("ramp_soak_flags", 6): Meaning("The profile stands still.", "Set the resume bit (bit 2) to go on.", (), FLAGS),
    ("ramp_soak_flags", 8): Meaning("Two hexadecimal digits: 01 to 10 are segments 1 to 16; odd ones are ramps, even ones soaks. 00: the profile is not running.", "", (), FLAGS),

    ("ramp_soak_errors", 0): Meaning(
        f"The ramp/soak table does not lie in the user's V-memory below {v_name(CPU.upper[0])}; the profile does not start.",
        TABLE_ADVICE, ("DL274",), RAMP_ERRORS),
    ("ramp_soak_errors", 1): Meaning(
        f"The ramp/soak table does not lie in the user's V-memory above {v_name(CPU.upper[0])}; the profile does not start.",
        TABLE_ADVICE, ("DL274",), RAMP_ERRORS),
    ("ramp_soak_errors", 4): Meaning(
        f"The ramp/soak table starts among the system's words {v_name(CPU.system[0])} to {v_name(CPU.system[1])}; the "
        "profile does not start, and a download of the table would overwrite the set-up of all loops.",
        TABLE_ADVICE, ("DL275",), RAMP_ERRORS),
}
# fmt: on
"""By the name of the register and the lowest bit of the row."""
WORD_MEANINGS = {
    "error_flags": Meaning(
        "Tells what is wrong with V7640 and V7641. All bits 0 in Run mode: nothing is wrong with them.",
        "",
        (),
        ERROR_FLAGS_BASIS,
    ),
    "pv": Meaning(
        "The measurement, from the ladder program or by auto transfer (+36). A value that stands still "
        "although the plant moves: the program does not write it here.",
        "",
        (),
        TROUBLE_TIPS,
    ),
    "bias": Meaning(
        "The integral: the part of the output that holds the set point at rest. Somebody else may write it "
        "too (feedforward)."
    ),
    "output": Meaning(
        "What the loop gives to the actuator. 0 in Automatic is right while the PV of a heating loop is "
        "above its SP (cooling: below).",
        "If it stays 0 on the other side too, look whether the upper limit in +31 is 0, then whether the "
        "direction (bit 4 of +00) fits the process. Never change bit 4 before a small step of the output in "
        "Manual has shown which way the PV goes: the wrong direction is a runaway.",
        ("DL226",),
        TROUBLE_TIPS,
    ),
    "mode_and_alarm_status": Meaning(
        "Tells the mode and the alarms of one loop; the CPU writes it at each calculation, nobody else should.",
        "",
        (),
        MODES,
    ),
    "mode_setting_1": Meaning("Sixteen switches of the loop: mode requests, direction of control, equation, alarms."),
    "mode_setting_2": Meaning("More switches of the loop: data formats, filter, limits, auto-tune."),
    "ramp_soak_flags": Meaning("Starts and stops the ramp/soak profile, and tells where it is."),
    "ramp_soak_errors": Meaning(
        "Tells what is wrong with the address of the ramp/soak table in +34. 0: nothing.", "", (), RAMP_ERRORS
    ),
}
"""By the name of a register that the configuration does not set."""
WRITER_TEXTS = {row.name: row.writer for row in reversed(WRITERS) if row.name in {"pv", "bias", "output"}}
"""Who writes a word that is not the PLC's alone."""

NO_REGISTER: tuple[str, ...] = ()
"""Settings that act on a loop and that no register has, by key."""
