"""NextoPID's function blocks and functions: tables only.

Inputs are the fields of the schema's models, with their types; outputs are listed here. The rows of a block are in the
order in which the virtual PLC keeps them: what the tuning blocks have more than the others comes last.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, get_args

from pidcfg.encoders.parameters import Parameter, ParameterTable
from pidcfg.encoders.tuned_parameters import TunedParameters
from pidcfg.encoders.written import Written
from pidcfg.frozen import frozen
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.schemas import nextopid as schema
from pidcfg.schemas.iec import BOOL, INT, REAL, IecType
from pidcfg.schemas.limits import Limits, limits_at

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic import BaseModel

    from pidcfg.refs import Basis

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
    "MaxVarMV": "output/cycle", "Kp": "output/pv",
}
"""Of a controller's parameters: in what the PV or the output is in."""
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


def _type_in(annotation: Any) -> IecType | None:
    for inner in (*getattr(annotation, "__metadata__", ()), *get_args(annotation)):
        kind = inner if isinstance(inner, IecType) else _type_in(inner)
        if kind is not None:
            return kind
    return None


def inputs_of(model: type[BaseModel], basis: Basis, prefix: str = "") -> Iterator[Parameter]:
    """The inputs of a block: the fields of its model that have a type; a structure's members with a dot."""
    for name, field in model.model_fields.items():
        kind = next((m for m in field.metadata if isinstance(m, IecType)), None) or _type_in(field.annotation)
        if kind is not None:
            limits = next((m for m in field.metadata if isinstance(m, Limits)), None) or limits_at(model, name)
            unit = UNITS.get(name, "") if issubclass(model, schema.Controller) and kind is not BOOL else ""
            yield Parameter(prefix + name, kind, (limits.unit if limits else "") or unit, "", basis)
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
        [Parameter(key, INT if whole and key == "MV" else kind, "", text, basis, "output") for key, kind, text in part]
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
MOST_SAMPLES = 100
"""Samples that a delay holds."""
TUNED = TunedParameters(
    BLOCK_TYPES["PIDA_REAL"].table, ("Kp", "Ti_Ki", "Td_Kd"), "Direct FALSE", "Direct TRUE", dependent=("Indep", False)
)
INPUTS = NEXTOPID.at("Input Parameters")
SIGNAL = "signals"
"""What stands for the name of a signal."""
WRITTEN = (
    Written("PV", "live", "the program: it is an input, the measurement", INPUTS),
    Written("InVar", "live", "the program: it is an input", INPUTS),
    Written("SP", "operated", "the operator or the program", INPUTS),
    Written("SP_CASC", "live", "the program: the set point of a cascade", INPUTS),
    Written("ManualMV", "operated", "the operator: the output in manual", INPUTS),
    Written("Manual", "live", "the operator or the program", INPUTS),
    Written("CASC", "live", "the operator or the program", INPUTS),
    Written(SIGNAL, "live", "the program around: a signal has only its first value in a file", D203),
)
"""Who else writes a parameter that is not wired; whatever no row names is yours."""
