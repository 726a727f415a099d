"""Parameters of the neutral loop: the leaf fields of its schema, by their paths, with a type each."""

from __future__ import annotations

from pidcfg.encoders.parameters import NamedLoops, Parameter, ParameterTable, TuningParameters
from pidcfg.encoders.regmap import Writer
from pidcfg.schemas.generic import D280, Loop, LoopSettings, PlcSettings
from pidcfg.schemas.iec import BOOL, DERIVATIVE_OF, LOOP_MODE, LREAL, IecType


def _row(name: str, kind: IecType, unit: str, title: str) -> Parameter:
    return Parameter(name, kind, unit, title, D280)


# fmt: off
LOOP_TABLE = ParameterTable("Neutral loop", (
    _row("mode",                       LOOP_MODE,     "",           "Mode that the loop is meant to run in"),
    _row("output_raises_pv",           BOOL,          "",           "TRUE heating, FALSE cooling"),
    _row("sample_time",                LREAL,         "s",          "Time between two calculations"),
    _row("tuning.gain",                LREAL,         "output/pv",  "Gain"),
    _row("tuning.integral_time",       LREAL,         "s",          "Integral time; 0: none"),
    _row("tuning.derivative_time",     LREAL,         "s",          "Derivative time; 0: none"),
    _row("tuning.proportional",        BOOL,          "",           "Whether there is a proportional action"),
    _row("tuning.derivative_on",       DERIVATIVE_OF, "",           "What the derivative acts on"),
    _row("tuning.derivative_filter",   LREAL,         "s",          "Time constant of the derivative's filter"),
    _row("pv.range.0",                 LREAL,         "pv",         "PV at 0 %"),
    _row("pv.range.1",                 LREAL,         "pv",         "PV at 100 %"),
    _row("pv.filter",                  LREAL,         "s",          "Time constant of the PV's filter"),
    _row("pv.square_root",             BOOL,          "",           "The PV is the root of the measurement"),
    _row("setpoint.value",             LREAL,         "pv",         "Set point"),
    _row("setpoint.limits.0",          LREAL,         "pv",         "Lowest set point"),
    _row("setpoint.limits.1",          LREAL,         "pv",         "Highest set point"),
    _row("output.range.0",             LREAL,         "output",     "Output at 0 %"),
    _row("output.range.1",             LREAL,         "output",     "Output at 100 %"),
    _row("output.limits.0",            LREAL,         "output",     "Lowest output"),
    _row("output.limits.1",            LREAL,         "output",     "Highest output"),
    _row("output.bias",                LREAL,         "output",     "What is added to the three actions"),
    _row("output.manual",              LREAL,         "output",     "Output in manual mode at the start"),
    _row("output.max_rate",            LREAL,         "output/s",   "Fastest change of the output"),
    _row("output.pulse.period",        LREAL,         "s",          "Period of the pulses"),
    _row("output.pulse.min_on",        LREAL,         "s",          "Shortest pulse"),
    _row("output.pulse.min_off",       LREAL,         "s",          "Shortest gap"),
    _row("deadband",                   LREAL,         "pv",         "A smaller error counts as zero"),
    _row("anti_windup",                BOOL,          "",           "No integration further into a limit"),
    _row("alarms.pv.low_low",          LREAL,         "pv",         "Lowest alarm point"),
    _row("alarms.pv.low",              LREAL,         "pv",         "Low alarm point"),
    _row("alarms.pv.high",             LREAL,         "pv",         "High alarm point"),
    _row("alarms.pv.high_high",        LREAL,         "pv",         "Highest alarm point"),
    _row("alarms.deviation.high",      LREAL,         "pv",         "First point of the deviation"),
    _row("alarms.deviation.high_high", LREAL,         "pv",         "Second point of the deviation"),
    _row("alarms.rate_of_change",      LREAL,         "pv/s",       "Fastest change of the PV"),
    _row("alarms.hysteresis",          LREAL,         "pv",         "How far the PV must come back"),
))
# fmt: on
TABLES = (LOOP_TABLE,)
ROWS = {row.name: row for row in LOOP_TABLE.rows}
REQUIRED_FIELDS = (
    "output_raises_pv",
    "sample_time",
    "tuning.gain",
    "pv.range.0",
    "pv.range.1",
    "output.range.0",
    "output.range.1",
)
"""Fields without a default."""
LOOPS = NamedLoops(
    vendor="generic",
    table=LOOP_TABLE,
    loop=Loop,
    settings=LoopSettings,
    file=PlcSettings,
    title="a field of a neutral loop",
    kind="a field of a loop",
    entry="parameter of a loop, such as TIC-101.tuning.gain",
    needed_names=REQUIRED_FIELDS,
    last_settings=("setpoint.source", "setpoint.follows_pv", "pv.unit", "output.unit"),
)
TUNING_NUMBERS = TuningParameters(
    LOOP_TABLE,
    ("tuning.gain", "tuning.integral_time", "tuning.derivative_time"),
    "output_raises_pv: true",
    "output_raises_pv: false",
)

WRITERS = (
    Writer("mode", "live", "the operator or the program", D280),
    Writer("setpoint.value", "operated", "the operator or the program", D280),
    Writer("output.manual", "operated", "the operator", D280),
)
"""Who else writes a field of a running loop."""

NO_REGISTER: tuple[str, ...] = ()
"""Settings that act on a loop and that no register has, by key."""
