"""Where a block's parameters stand among the signals, counted from the block's first: the order of its table.

Kernels read and write ``sig[c.base + SP]``; a BOOL is 0 or 1 there, AUTOTUNE_MODE the number of its word.
"""

from __future__ import annotations

from pidcfg.encoders.maps.nextopid import BLOCK_TYPES

PLACES = {name: {row.name: i for i, row in enumerate(kind.table.rows)} for name, kind in BLOCK_TYPES.items()}
"""Offsets by block type and parameter."""

KINDS = {name: i for i, name in enumerate(BLOCK_TYPES)}
"""Number of each block type: `Config.kind`."""
(
    PIDA_REAL,
    PIDA_INT,
    PIDA_TUNE_REAL,
    PIDA_TUNE_INT,
    ON_OFF,
    PWM,
    LOW_FILTER,
    DELAY,
    LAG,
    DELAY_LAG,
    LEAD_LAG,
    SELECT_MAX,
    SELECT_MIN,
    SPLIT_RANGE,
) = range(len(KINDS))

_PIDA = PLACES["PIDA_TUNE_REAL"]
"""The other PIDA blocks have the same places, as far as they go."""
SP, SP_CASC, PV = _PIDA["SP"], _PIDA["SP_CASC"], _PIDA["PV"]
KP, TD_KD, TI_KI, TFD = _PIDA["Kp"], _PIDA["Td_Kd"], _PIDA["Ti_Ki"], _PIDA["Tfd"]
BIAS, MANUAL_MV, TRK_VAL = _PIDA["BIAS"], _PIDA["ManualMV"], _PIDA["TRK_VAL"]
MAX_VAR_MV, MAX_MV, MIN_MV = _PIDA["MaxVarMV"], _PIDA["MaxMV"], _PIDA["MinMV"]
DEAD_BAND, MAX_PV, MIN_PV = _PIDA["DeadBand"], _PIDA["MaxPV"], _PIDA["MinPV"]
INDEP, DISABLE_P, DERIV_ER, CASC = _PIDA["Indep"], _PIDA["DisableP"], _PIDA["DerivEr"], _PIDA["CASC"]
TRK_IN, WINDUP_H_IN, WINDUP_L_IN = _PIDA["TRK_IN"], _PIDA["Windup_H_IN"], _PIDA["Windup_L_IN"]
OVERR, MANUAL, DIRECT = _PIDA["OVERR"], _PIDA["Manual"], _PIDA["Direct"]
MV, TRK_OUT = _PIDA["MV"], _PIDA["TRK_OUT"]
WINDUP_H_OUT, WINDUP_L_OUT = _PIDA["Windup_H_OUT"], _PIDA["Windup_L_OUT"]
P_ACTION, D_ACTION, I_ACTION = _PIDA["ProportionalAction"], _PIDA["DerivativeAction"], _PIDA["IntegralAction"]
SAMPLE_TIME = _PIDA["SampleTime"]
ERR_BITS, WARN_BITS = _PIDA["ErrBits.MaxMinMV"], _PIDA["WarnBits.PV_MaxPV"]
"""The first of nine, and of ten, in the order of the table."""
AUTO_TUNE, TUNE_PARAM = _PIDA["AutoTune"], _PIDA["AutoTuneParam.PercAmpMV"]
"""The second one is the first of five."""
TUNE_DONE, TUNE_ERROR = _PIDA["AutoTuneDone"], _PIDA["AutoTuneError"]
TUNE_RESULT, TUNE_FLAGS = _PIDA["AutoTuneResult.Kp"], _PIDA["AutoTuneResult.Bad_PercAmpMV"]
FLAGS = len(_PIDA) - TUNE_FLAGS
"""Three numbers, and so many flags, which are the last."""
