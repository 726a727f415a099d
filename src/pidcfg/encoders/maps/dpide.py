"""Operands of DPIDE and the registers of I_MV: tables only."""

from __future__ import annotations

from pidcfg.encoders.image import LoopOption
from pidcfg.encoders.parameters import NamedLoops, Parameter, ParameterTable, TuningParameters
from pidcfg.encoders.regmap import Code, Meaning, Writer
from pidcfg.schemas.dpide import D251, Loop, LoopSettings, PlcSettings
from pidcfg.schemas.iec import BOOL, DINT, REAL, IecType
from pidcfg.text.references import DPIDE, Decision

# --- DPIDE operands: a table only, in the order of the instruction ----------------------------------------------------

TABLE = DPIDE.cite("parameter settings")
REMARKS = DPIDE.cite("Additional remarks")

D253 = Decision(
    253,
    "the remark on no derivative in the row of Td_Kd is about Td_Kd",
    "A Td_Kd of 0 or below is no derivative; Ti_Ki has nothing to do with it.",
    "The row prints Ti_Ki where it switches the derivative off. The block diagrams test each coefficient by itself.",
)
D254 = Decision(
    254,
    "I_MV takes 30 D registers",
    "I_MV takes 15 double words, which are 30 D registers; with D500 these are D500 to D529, and I_MV+1 is D502.",
    "The operand table counts 15 double words, the remarks 30 registers, which is the same.",
)
D255 = Decision(
    255,
    "an operand that is not given is FALSE or 0",
    "So are PID_MAN, MOUT_AUTO, PID_EQ, PID_DE, PID_DIR, PID_MODE, Tf, ERR_DBW, MOUT and BIAS; PID_RUN is TRUE. The "
    "others must be given. A file that does not give PID_DIR or PID_EQ is warned of.",
    "The manual prints no defaults. FALSE and 0 are what an operand holds that nothing was written to; a loop that is "
    "configured is meant to run.",
)


def _row(name: str, kind: IecType, unit: str, title: str, basis: Decision | None = None) -> Parameter:
    return Parameter(name, kind, unit, title, basis or TABLE, "output" if name == "MV" else "input")


# fmt: off
DPIDE_TABLE = ParameterTable("DPIDE (API 0708)", (
    _row("PID_RUN",   BOOL, "",       "Algorithm runs; FALSE: MV is 0", D255),
    _row("SV",        REAL, "pv",     "Target value"),
    _row("PV",        REAL, "pv",     "Process value"),
    _row("PID_MODE",  DINT, "",       "0 automatic, 1 autotune, 2 automatic with I_MV"),
    _row("PID_MAN",   BOOL, "",       "TRUE: manual"),
    _row("MOUT_AUTO", BOOL, "",       "TRUE: MOUT follows MV"),
    _row("CYCLE",     DINT, "ms",     "Sampling time", D251),
    _row("Kc_Kp",     REAL, "",       "Proportional gain"),
    _row("Ti_Ki",     REAL, "s, 1/s", "Integral time Ti or gain Ki"),
    _row("Td_Kd",     REAL, "s",      "Derivative time Td or gain Kd", D253),
    _row("Tf",        REAL, "s",      "Smoothing of the derivative"),
    _row("PID_EQ",    BOOL, "",       "TRUE dependent form, FALSE independent form", D255),
    _row("PID_DE",    BOOL, "",       "TRUE derivative of PV, FALSE of the error"),
    _row("PID_DIR",   BOOL, "",       "TRUE forward (E = SV - PV), FALSE reverse (E = PV - SV)", D255),
    _row("ERR_DBW",   REAL, "pv",     "Dead band of the error"),
    _row("MV_MAX",    REAL, "output", "Highest MV"),
    _row("MV_MIN",    REAL, "output", "Lowest MV"),
    _row("MOUT",      REAL, "output", "MV in manual"),
    _row("BIAS",      REAL, "output", "Feed forward"),
    _row("I_MV",      REAL, "output", "Accumulated integral, then values of the PLC's own", D254),
    _row("MV",        REAL, "output", "Output"),
))
# fmt: on
TABLES = (DPIDE_TABLE,)
ROWS = {row.name: row for row in DPIDE_TABLE.rows}
TUNING_NUMBERS = TuningParameters(
    DPIDE_TABLE, ("Kc_Kp", "Ti_Ki", "Td_Kd"), "PID_DIR TRUE", "PID_DIR FALSE", dependent=("PID_EQ", True)
)
PROCESS_OPERANDS = ("PV", "I_MV", "MV")
"""Operands that the process or the instruction writes."""
AUTOTUNE_OPERANDS = ("PID_MODE", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf")
"""Operands that the autotune writes, so that they cannot be numbers in the program."""
REQUIRED_OPERANDS = ("SV", "CYCLE", "Kc_Kp", "Ti_Ki", "Td_Kd", "MV_MAX", "MV_MIN")
"""Operands without a default."""
LOOPS = NamedLoops(
    vendor="dpide",
    table=DPIDE_TABLE,
    loop=Loop,
    settings=LoopSettings,
    file=PlcSettings,
    title="an operand of DPIDE",
    kind="an operand of DPIDE",
    entry="operand of a DPIDE instruction, such as OVEN.SV",
    needed_names=REQUIRED_OPERANDS,
    # they decide what the gains mean and on which side the loop acts
    always_given=frozenset({"PID_EQ", "PID_DIR"}),
    first_values={"I_MV": 0},
    options=(LoopOption(("device",), "device", "the device of I_MV (30 registers)"),),
    devices=lambda loop: loop.devices.by_operand() | {"I_MV": loop.device},
)

MODES = DPIDE.cite("The diagram of switching to PID_MAN / MOUT_AUTO")
WRITERS = (
    Writer("PV", "live", "the program: it is an input, the measurement", TABLE),
    Writer("MV", "live", "the PLC", TABLE),
    Writer("I_MV", "live", "the PLC; the program may read, clear or change it", REMARKS),
    Writer("SV", "operated", "the operator or the program", TABLE),
    Writer("PID_MAN", "live", "the operator or the program", MODES),
    Writer("PID_RUN", "operated", "the operator or the program", TABLE),
    Writer("MOUT", "live", "the PLC: with MOUT_AUTO it follows MV", MODES, lambda values: values["MOUT_AUTO"]),
    Writer("MOUT", "operated", "the operator: the output in manual", MODES),
    Writer(
        "PID_MODE",
        "live",
        "the operator, who tunes with 1, and the PLC, which then writes 0",
        REMARKS,
        lambda values: values["PID_MODE"] == 1,
    ),
    *(Writer(name, "compared", "an autotune", TABLE) for name in AUTOTUNE_OPERANDS),
)
"""Who else writes an operand; whatever no row names is yours."""

# --- What DPIDE's modes and the registers of I_MV mean for the plant: tables only -------------------------------------

# fmt: off
CODES = (
    Code("PID_MODE", 0, "automatic", Meaning(
        "The algorithm sets MV. While MV is beyond MV_MAX or MV_MIN the integral I_MV stands still.", "", (), TABLE)),
    Code("PID_MODE", 1, "autotune", Meaning(
        "The instruction tunes itself for temperature control and moves MV to do so; PID_MAN has no effect. When it is "
        "done, Kc_Kp, Ti_Ki, Td_Kd and Tf are new and PID_MODE is 0.",
        "Stay at the plant. PID_MODE and the four coefficients must be registers, not numbers in the program.",
        ("DP705", "DP706", "DP707"), TABLE)),
    Code("PID_MODE", 2, "automatic, with I_MV worked out of MV", Meaning(
        "As 0, but I_MV follows MV at its limits and at the end of manual, so that the loop comes back sooner and "
        "without a bump.", "", (), TABLE)),
)
"""Numbers that PID_MODE holds."""

STATES = {
    ("PID_RUN", True): "the algorithm runs", ("PID_RUN", False): "the algorithm does not run, and MV is 0",
    ("PID_MAN", True): "manual: MV is MOUT, within MV_MIN and MV_MAX", ("PID_MAN", False): "automatic: the algorithm sets MV",
    ("MOUT_AUTO", True): "MOUT follows MV", ("MOUT_AUTO", False): "MOUT stays as it is written",
    ("PID_EQ", True): "dependent form: Kc, Ti, Td", ("PID_EQ", False): "independent form: Kp, Ki, Kd",
    ("PID_DE", True): "derivative of PV", ("PID_DE", False): "derivative of the error",
    ("PID_DIR", True): "forward, E = SV - PV: MV rises while PV is below SV (heating)",
    ("PID_DIR", False): "reverse, E = PV - SV: MV rises while PV is above SV (cooling)",
}
"""What a BOOL operand chooses."""

WRITER_TEXTS = {row.name: row.writer for row in WRITERS if row.name in {"PV", "I_MV"}}
"""Who writes an operand that is not yours alone."""

INTEGRAL_WORDS = (
    (0, 0, "I_MV", "The accumulated integral. It may be read, cleared or changed."),
    (1, 1, "previous error", "The error of the calculation before; the PLC writes it."),
    (2, 5, "system use", "The PLC's own; leave it alone."),
    (6, 6, "previous PV", "The PV of the calculation before; the PLC writes it."),
    (7, 14, "system use", "The PLC's own; leave it alone."),
)
"""The 15 double words of I_MV: first and last, what they hold, and what that means."""
# fmt: on

NO_REGISTER = ("call.EN", "call.timer", "call.GPWM", "plc.interrupt_task")
"""Settings that act on a loop and that no register has, by key."""
