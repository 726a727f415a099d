"""NextoPID's function blocks and functions, and what their bits mean: tables only."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, get_args

from pidcfg.encoders.parameters import Parameter, ParameterTable, TuningParameters
from pidcfg.encoders.regmap import Meaning, Writer
from pidcfg.schemas import nextopid as schema
from pidcfg.schemas.base import Limits, limits_at
from pidcfg.schemas.iec import BOOL, INT, REAL, IecType
from pidcfg.text.frozen import frozen
from pidcfg.text.references import NEXTOPID, Basis, Decision

if TYPE_CHECKING:
    from pydantic import BaseModel

# --- NextoPID's function blocks and functions: tables only ------------------------------------------------------------
#
# Inputs are the fields of the schema's models, with their types; outputs are listed here. The rows of a block are in
# the order in which the virtual PLC keeps them: what the tuning blocks have more than the others comes last.

D203 = Decision(
    203,
    "parameters that the program around may assign are left out where they are not given",
    "PV, InVar and the like have no default: a listing and the emitted program are silent about them.",
    "An initial value of 0 would be written over by the analog input anyway, and hide that nothing is wired.",
)

# fmt: off
PIDA_OUTPUTS = (
    ("MV",                    REAL, "Manipulated variable"),
    ("TRK_OUT",               BOOL, "Not in automatic and cascade mode; for the master's TRK_IN"),
    ("Windup_H_OUT",          BOOL, "A higher set point is useless; for the master's Windup_H_IN"),
    ("Windup_L_OUT",          BOOL, "A lower set point is useless; for the master's Windup_L_IN"),
    ("ProportionalAction",    REAL, "Proportional action, for information"),
    ("DerivativeAction",      REAL, "Derivative action, for information"),
    ("IntegralAction",        REAL, "Integral action, for information"),
    ("SampleTime",            REAL, "Measured sample time in s"),
    ("ErrBits.MaxMinMV",      BOOL, "MaxMV is not above MinMV"),
    ("ErrBits.MaxMinPV",      BOOL, "MaxPV is not above MinPV"),
    ("ErrBits.Kp",            BOOL, "Kp is not above 0 (dependent form), or negative (independent form)"),
    ("ErrBits.Td_Kd",         BOOL, "Td_Kd is negative"),
    ("ErrBits.Ti_Ki",         BOOL, "Ti_Ki is negative"),
    ("ErrBits.Tfd",           BOOL, "Tfd is negative"),
    ("ErrBits.MaxVarMV",      BOOL, "MaxVarMV is negative"),
    ("ErrBits.DeadBand",      BOOL, "DeadBand is negative"),
    ("ErrBits.SampleTime",    BOOL, "The measured sample time is above 60 s"),
    ("WarnBits.PV_MaxPV",     BOOL, "PV is limited by MaxPV"),
    ("WarnBits.PV_MinPV",     BOOL, "PV is limited by MinPV"),
    ("WarnBits.SP_MaxPV",     BOOL, "SP is limited by MaxPV"),
    ("WarnBits.SP_MinPV",     BOOL, "SP is limited by MinPV"),
    ("WarnBits.SP_CASC_MaxPV", BOOL, "SP_CASC is limited by MaxPV"),
    ("WarnBits.SP_CASC_MinPV", BOOL, "SP_CASC is limited by MinPV"),
    ("WarnBits.MV_MaxMV",     BOOL, "MV is limited by MaxMV"),
    ("WarnBits.MV_MinMV",     BOOL, "MV is limited by MinMV"),
    ("WarnBits.MV_P_MaxVarMV", BOOL, "A rise of MV is limited by MaxVarMV"),
    ("WarnBits.MV_N_MaxVarMV", BOOL, "A fall of MV is limited by MaxVarMV"),
)
TUNE_OUTPUTS = (
    ("AutoTuneDone",                     BOOL, "The auto-tuning has ended"),
    ("AutoTuneError",                    BOOL, "It ended with an error"),
    ("AutoTuneResult.Kp",                REAL, "Proportional gain found"),
    ("AutoTuneResult.Ti_Ki",             REAL, "Integral time or gain found"),
    ("AutoTuneResult.Td_Kd",             REAL, "Derivative time or gain found"),
    ("AutoTuneResult.Bad_PercAmpMV",     BOOL, "PercAmpMV is out of range"),
    ("AutoTuneResult.Bad_PercHystPV",    BOOL, "PercHystPV is out of range"),
    ("AutoTuneResult.Bad_PercMaxPeakPV", BOOL, "PercMaxPeakPV is out of range"),
    ("AutoTuneResult.Bad_NumCycles",     BOOL, "NumCycles is out of range"),
    ("AutoTuneResult.Bad_Mode",          BOOL, "Mode is out of range"),
    ("AutoTuneResult.MV_TOO_HIGH",       BOOL, "The step would raise MV above MaxMV"),
    ("AutoTuneResult.MV_TOO_LOW",        BOOL, "The step would lower MV below MinMV"),
    ("AutoTuneResult.PV_TOO_HIGH",       BOOL, "The hysteresis reaches above MaxPV"),
    ("AutoTuneResult.PV_TOO_LOW",        BOOL, "The hysteresis reaches below MinPV"),
    ("AutoTuneResult.PEAK_TOO_HIGH",     BOOL, "PV left the safe range"),
    ("AutoTuneResult.PEAK_TOO_LOW",      BOOL, "The peaks of PV are too low against the hysteresis"),
    ("AutoTuneResult.PV_NOT_STEADY",     BOOL, "PV was not steady during the first 3 s"),
    ("AutoTuneResult.CYCLE_TOO_FAST",    BOOL, "A cycle is too short against the sample time"),
    ("AutoTuneResult.HIGH_DEAD_TIME",    BOOL, "A cycle is too short against the dead time"),
)
ON_OFF_OUTPUTS = (
    ("MV",                    BOOL, "Manipulated variable"),
    ("ErrBits.MaxMinPV",      BOOL, "MaxPV is not above MinPV"),
    ("ErrBits.DeadBand",      BOOL, "DeadBand is negative"),
    ("WarnBits.PV_MaxPV",     BOOL, "PV is limited by MaxPV"),
    ("WarnBits.PV_MinPV",     BOOL, "PV is limited by MinPV"),
    ("WarnBits.SP_MaxPV",     BOOL, "SP is limited by MaxPV"),
    ("WarnBits.SP_MinPV",     BOOL, "SP is limited by MinPV"),
)
PWM_OUTPUTS = (("PWM", BOOL, "Pulses"), ("Error", BOOL, "MaxMV is not above MinMV, or Period is 0"),
               ("Warning", BOOL, "MV is limited"))
FILTER_OUTPUTS = (("OutVar", REAL, "Output"), ("Error", BOOL, "A parameter is out of its range"),
                  ("SampleTime", REAL, "Measured sample time in s"))
SELECT_OUTPUTS = (("MV", REAL, "Selected MV"), ("OVERR1", BOOL, "MV1 is not selected; for OVERR of the first controller"),
                  ("OVERR2", BOOL, "MV2 is not selected; for OVERR of the second controller"))
SPLIT_OUTPUTS = (("MV1", REAL, "Output to valve 1, %"), ("MV2", REAL, "Output to valve 2, %"),
                 ("Error", BOOL, "A parameter is out of its range"))
UNITS = {
    **dict.fromkeys(("SP", "SP_CASC", "PV", "MaxPV", "MinPV", "DeadBand"), "pv"),
    **dict.fromkeys(("BIAS", "ManualMV", "TRK_VAL", "MaxMV", "MinMV"), "output"),
    **dict.fromkeys(("MV", "ProportionalAction", "DerivativeAction", "IntegralAction"), "output"),
    "MaxVarMV": "output/cycle", "Kp": "output/pv", "AutoTuneResult.Kp": "output/pv",
}
"""Of a controller's parameters: in what the PV or the output is in."""
OWN_UNITS = {"Tc": "s", "Tlag": "s", "SampleTime": "s", "SPLIT": "%"}
"""Of parameters of all blocks."""
# fmt: on
Outputs = tuple[tuple[str, IecType, str], ...]


@frozen
class BlockType:
    """A function block or function of the library."""

    name: str
    model: type[BaseModel]
    table: ParameterTable
    function: bool
    """Functions have no instance: nothing is kept from one call to the next."""

    @property
    def inputs(self) -> tuple[Parameter, ...]:
        """What can be given."""
        return tuple(row for row in self.table.rows if row.access == "input")

    @property
    def outputs(self) -> tuple[Parameter, ...]:
        """What it calculates."""
        return tuple(row for row in self.table.rows if row.access == "output")


def _type_in(annotation: object) -> IecType | None:
    for inner in (*getattr(annotation, "__metadata__", ()), *get_args(annotation)):
        kind = inner if isinstance(inner, IecType) else _type_in(inner)
        if kind is not None:
            return kind
    return None


def unit_of(model: type[BaseModel], name: str, kind: IecType) -> str:
    """The unit of a block's parameter; none of a BOOL, and of what takes that of whatever is wired to it."""
    if kind is BOOL:
        return ""
    return OWN_UNITS.get(name, "") or (UNITS.get(name, "") if issubclass(model, schema.Controller) else "")


def inputs_of(model: type[BaseModel], basis: Basis, prefix: str = "") -> Iterator[Parameter]:
    """The inputs of a block: the fields of its model that have a type; a structure's members with a dot."""
    for name, field in model.model_fields.items():
        kind = next((m for m in field.metadata if isinstance(m, IecType)), None) or _type_in(field.annotation)
        if kind is not None:
            limits = next((m for m in field.metadata if isinstance(m, Limits)), None) or limits_at(model, name)
            unit = (limits.unit if limits else "") or unit_of(model, name, kind)
            yield Parameter(prefix + name, kind, unit, "", basis)
        elif name == "AutoTuneParam":
            yield from inputs_of(schema.TuneParam, basis, f"{name}.")


def block_type(
    model: type[BaseModel], basis: Basis, *outputs: Outputs, base: type[BaseModel] | None = None, function: bool = False
) -> BlockType:
    """A row of `BLOCK_TYPES`; ``base``: a block with fewer parameters, whose rows come first."""
    name = model.model_fields["type"].annotation
    title = get_args(name)[0]
    whole = "INT" in title
    inputs = list(inputs_of(model, basis))
    first = [row for row in inputs if base is None or row.name in base.model_fields]
    rest = [row for row in inputs if row not in first]
    results = [
        [
            Parameter(key, INT if whole and key == "MV" else kind, unit_of(model, key, kind), text, basis, "output")
            for key, kind, text in part
        ]
        for part in outputs
    ]
    rows = [*first, *results[0], *rest, *(row for part in results[1:] for row in part)]
    return BlockType(title, model, ParameterTable(title, tuple(rows)), function)


BLOCK_TYPES = {
    kind.name: kind
    for kind in (
        block_type(schema.PidaReal, schema.PIDA, PIDA_OUTPUTS),
        block_type(schema.PidaInt, schema.PIDA, PIDA_OUTPUTS),
        block_type(schema.PidaTuneReal, schema.TUNE, PIDA_OUTPUTS, TUNE_OUTPUTS, base=schema.PidaReal),
        block_type(schema.PidaTuneInt, schema.TUNE, PIDA_OUTPUTS, TUNE_OUTPUTS, base=schema.PidaInt),
        block_type(schema.OnOff, schema.ON_OFF, ON_OFF_OUTPUTS),
        block_type(schema.Pwm, schema.PWM, PWM_OUTPUTS),
        block_type(schema.LowFilter, schema.LOW_FILTER, FILTER_OUTPUTS),
        block_type(schema.Delay, schema.DELAY, FILTER_OUTPUTS),
        block_type(schema.Lag, schema.LAG, FILTER_OUTPUTS),
        block_type(schema.DelayLag, schema.DELAY_LAG, FILTER_OUTPUTS),
        block_type(schema.LeadLag, schema.LEAD_LAG, FILTER_OUTPUTS),
        block_type(schema.SelectMax, schema.SELECT_MAX, SELECT_OUTPUTS, function=True),
        block_type(schema.SelectMin, schema.SELECT_MIN, SELECT_OUTPUTS, function=True),
        block_type(schema.SplitRange, schema.SPLIT_RANGE, SPLIT_OUTPUTS, function=True),
    )
}
"""Everything the library has, by its name."""
TABLES = tuple(kind.table for kind in BLOCK_TYPES.values())
LOOP_TYPES = frozenset(("PIDA_REAL", "PIDA_INT", "PIDA_TUNE_REAL", "PIDA_TUNE_INT", "ControlON_OFF"))
"""Controllers."""
MAX_DELAY_SAMPLES = 100
"""Samples that a delay holds."""
TUNING_NUMBERS = TuningParameters(
    BLOCK_TYPES["PIDA_REAL"].table, ("Kp", "Ti_Ki", "Td_Kd"), "Direct FALSE", "Direct TRUE", dependent=("Indep", False)
)
INPUTS = NEXTOPID.cite("Input Parameters")
SIGNAL = "signals"
"""What stands for the name of a signal."""
WRITERS = (
    Writer("PV", "live", "the program: it is an input, the measurement", INPUTS),
    Writer("InVar", "live", "the program: it is an input", INPUTS),
    Writer("SP", "operated", "the operator or the program", INPUTS),
    Writer("SP_CASC", "live", "the program: the set point of a cascade", INPUTS),
    Writer("ManualMV", "operated", "the operator: the output in manual", INPUTS),
    Writer("Manual", "live", "the operator or the program", INPUTS),
    Writer("CASC", "live", "the operator or the program", INPUTS),
    Writer(SIGNAL, "live", "the program around: a signal has only its first value in a file", D203),
)
"""Who else writes a parameter that is not wired; whatever no row names is yours."""

# ----------------------------------------------------------------------------------------------------------------------
# What the bits of the NextoPID blocks mean for the plant: tables only. The bits themselves stand in the blocks'
# tables.

ERRORS = NEXTOPID.cite("ErrBits - Fatal Error Indication Bits")
WARNINGS = NEXTOPID.cite("WarnBits - Warning Indication Bits")
RESULTS = NEXTOPID.cite("AutoTuneResult")

D325 = Decision(
    325,
    "a structure of bits as a number",
    "`ErrBits=0x0005` counts the structure's bits from 0 in the order of its members; `AutoTuneResult` without its three "
    "numbers, so that Bad_PercAmpMV is bit 0.",
    "The manual names the bits and shows the structures as figures; members of the type BIT are packed in their order. "
    "A panel that shows the number of the whole structure has no other one to show.",
)

STOPPED_TEXT = "The block is not executed: MV and all other outputs stay as they are until it is cured."
UNCONTROLLED_TEXT = "MV stands at RefMV, where the auto-tuning found it, and nothing controls until AutoTune is FALSE."
UNTRUSTED_TEXT = f"The gains that it shows are not to be trusted. {UNCONTROLLED_TEXT}"
ENDED_TEXT = f"The auto-tuning has ended. {UNCONTROLLED_TEXT}"
RETRY_ADVICE = "Switch AutoTune off, so that the block controls again, before the next try."
STEP_TEST_ADVICE = "Never change Direct before a small step of MV in manual has shown which way PV goes."
BLOCK_GOES_ON_TEXT = "The block goes on."

# fmt: off
GROUPS = {
    "ErrBits": Meaning("Fatal errors: while one is on, the block is not executed and MV does not move.", "", (), ERRORS),
    "WarnBits": Meaning("What the block limits in this call; it goes on working.", "", (), WARNINGS),
    "AutoTuneResult": Meaning(f"What the auto-tuning found, and what went wrong; reset when AutoTune is FALSE. When it has ended: {UNCONTROLLED_TEXT}", "", (), RESULTS),
}
"""Outputs that are structures."""

BITS = {
    "ErrBits.MaxMinMV":   Meaning(STOPPED_TEXT, "Set MaxMV above MinMV.", ("NX610",), ERRORS),
    "ErrBits.MaxMinPV":   Meaning(STOPPED_TEXT, "Set MaxPV above MinPV.", ("NX611",), ERRORS),
    "ErrBits.Kp":         Meaning(STOPPED_TEXT, "Set Kp above 0; the independent form (Indep TRUE) takes 0 too. The direction of control is Direct's business, not the sign of Kp's.", ("NX612",), ERRORS),
    "ErrBits.Td_Kd":      Meaning(STOPPED_TEXT, "Set Td_Kd to 0 (no derivative) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.Ti_Ki":      Meaning(STOPPED_TEXT, "Set Ti_Ki to 0 (no integral) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.Tfd":        Meaning(STOPPED_TEXT, "Set Tfd to 0 (no filter) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.MaxVarMV":   Meaning(STOPPED_TEXT, "Set MaxVarMV to 0 (no limit) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.DeadBand":   Meaning(STOPPED_TEXT, "Set DeadBand to 0 (none) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.SampleTime": Meaning(STOPPED_TEXT, "Call the block at least once in 60 s: look at the task's interval, and whether the call is skipped by a condition.", ("NX624",), ERRORS),

    "WarnBits.PV_MaxPV":      Meaning(f"The measurement is above MaxPV; the block calculates with MaxPV. {BLOCK_GOES_ON_TEXT}", "Look at the sensor, and whether MaxPV is the top of its range.", (), WARNINGS),
    "WarnBits.PV_MinPV":      Meaning(f"The measurement is below MinPV; the block calculates with MinPV. {BLOCK_GOES_ON_TEXT}", "Look at the sensor (a broken wire reads low), and whether MinPV is the bottom of its range.", (), WARNINGS),
    "WarnBits.SP_MaxPV":      Meaning(f"The set point is above MaxPV; the block works towards MaxPV. {BLOCK_GOES_ON_TEXT}", "Lower SP, or set MaxPV to the top of the sensor's range.", ("NX615",), WARNINGS),
    "WarnBits.SP_MinPV":      Meaning(f"The set point is below MinPV; the block works towards MinPV. {BLOCK_GOES_ON_TEXT}", "Raise SP, or set MinPV to the bottom of the sensor's range.", ("NX615",), WARNINGS),
    "WarnBits.SP_CASC_MaxPV": Meaning(f"The master asks for more than MaxPV; the block works towards MaxPV. {BLOCK_GOES_ON_TEXT}", "Set the master's MaxMV to this block's MaxPV.", ("NX616", "NX673"), WARNINGS),
    "WarnBits.SP_CASC_MinPV": Meaning(f"The master asks for less than MinPV; the block works towards MinPV. {BLOCK_GOES_ON_TEXT}", "Set the master's MinMV to this block's MinPV.", ("NX616", "NX673"), WARNINGS),
    "WarnBits.MV_MaxMV":      Meaning(f"MV is at its upper limit: the actuator can do no more. {BLOCK_GOES_ON_TEXT}", f"Normal for a while after a change; if it stays, the actuator is too small or shut off. {STEP_TEST_ADVICE}", (), WARNINGS),
    "WarnBits.MV_MinMV":      Meaning(f"MV is at its lower limit: the actuator can do no less. {BLOCK_GOES_ON_TEXT}", f"Right while a heating block's PV is above SP (cooling: below); if it stays on the other side too, something else moves the PV. {STEP_TEST_ADVICE}", (), WARNINGS),
    "WarnBits.MV_P_MaxVarMV": Meaning(f"MV rises as fast as MaxVarMV lets it. {BLOCK_GOES_ON_TEXT}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("NX633",), WARNINGS),
    "WarnBits.MV_N_MaxVarMV": Meaning(f"MV falls as fast as MaxVarMV lets it. {BLOCK_GOES_ON_TEXT}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("NX633",), WARNINGS),

    "AutoTuneResult.Bad_PercAmpMV":     Meaning(ENDED_TEXT, f"Set AutoTuneParam.PercAmpMV to 0.1 to 50 %. {RETRY_ADVICE}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercHystPV":    Meaning(ENDED_TEXT, f"Set AutoTuneParam.PercHystPV to 0.01 to 1 %. {RETRY_ADVICE}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercMaxPeakPV": Meaning(ENDED_TEXT, f"Set AutoTuneParam.PercMaxPeakPV to 0.1 to 50 %. {RETRY_ADVICE}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_NumCycles":     Meaning(ENDED_TEXT, f"Set AutoTuneParam.NumCycles to 1 to 10. {RETRY_ADVICE}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_Mode":          Meaning(ENDED_TEXT, f"Set AutoTuneParam.Mode to P, PI or PID. {RETRY_ADVICE}", ("PID101",), RESULTS),
    "AutoTuneResult.MV_TOO_HIGH":       Meaning(ENDED_TEXT, f"Start from a lower MV, or make PercAmpMV smaller. {RETRY_ADVICE}", ("NX658",), RESULTS),
    "AutoTuneResult.MV_TOO_LOW":        Meaning(ENDED_TEXT, f"Start from a higher MV, or make PercAmpMV smaller. {RETRY_ADVICE}", ("NX658",), RESULTS),
    "AutoTuneResult.PV_TOO_HIGH":       Meaning(ENDED_TEXT, f"Start from a lower PV, or make PercHystPV smaller. {RETRY_ADVICE}", (), RESULTS),
    "AutoTuneResult.PV_TOO_LOW":        Meaning(ENDED_TEXT, f"Start from a higher PV, or make PercHystPV smaller. {RETRY_ADVICE}", (), RESULTS),
    "AutoTuneResult.PEAK_TOO_HIGH":     Meaning(f"Aborted for safety. {UNCONTROLLED_TEXT}", f"Make PercAmpMV smaller, or allow a higher peak (PercMaxPeakPV) if the plant does. {RETRY_ADVICE}", ("NX659",), RESULTS),
    "AutoTuneResult.PEAK_TOO_LOW":      Meaning(UNTRUSTED_TEXT, f"Make PercAmpMV larger or PercHystPV smaller; a process with almost no dead time does this too. {RETRY_ADVICE}", ("NX659",), RESULTS),
    "AutoTuneResult.PV_NOT_STEADY":     Meaning(f"Ended in the first 3 s. {UNCONTROLLED_TEXT}", f"Let PV come to rest, or make PercHystPV larger than its noise. {RETRY_ADVICE}", (), RESULTS),
    "AutoTuneResult.CYCLE_TOO_FAST":    Meaning(UNTRUSTED_TEXT, f"Call the block more often; a process with almost no dead time does this too. {RETRY_ADVICE}", (), RESULTS),
    "AutoTuneResult.HIGH_DEAD_TIME":    Meaning(UNTRUSTED_TEXT, "Switch AutoTune off, then tune by hand: the dead time is long against the time constant.", (), RESULTS),
}
# fmt: on
"""By the name of the output."""

BLOCK_BITS = {
    ("ControlON_OFF", "ErrBits.DeadBand"): Meaning(
        STOPPED_TEXT, "Set DeadBand above 0: this block has no 0 that means none.", ("PID101",), ERRORS
    ),
}
"""By the type of block and the name of the output, where a block differs from the others."""

# fmt: off
STATES = {
    ("Direct", True): "direct: MV rises when PV rises (cooling)", ("Direct", False): "reverse: MV falls when PV rises (heating)",
    ("Indep", True): "independent form: gains Kp, Ki, Kd", ("Indep", False): "dependent form: gain Kp, times Ti, Td",
    ("DerivEr", True): "derivative of the error", ("DerivEr", False): "derivative of PV",
    ("Disable", True): "the output is 0", ("Disable", False): "the block works",
}
# fmt: on
"""What an input chooses of which TRUE and FALSE have meanings of their own."""

NO_REGISTER = ("type", "plc.sample_time", "sample_time")
"""Settings that act on a loop and that no register has, by key."""
