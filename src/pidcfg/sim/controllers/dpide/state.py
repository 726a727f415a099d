"""Records of a DPIDE instruction: `Config` (operands that it reads) and `State` (operands and memory that it writes).

REAL operands are what single precision holds; the clock is in ticks of a microsecond. Everything is an int or a float:
the same fields become a NumPy record for numba.
"""

from __future__ import annotations

from dataclasses import dataclass

from pidcfg.sim.records import LoopConfig, RelayState, register

# `State.status`
MANUAL, AUTO, TUNING, OFF = 1, 2, 4, 8
MODES = MANUAL | AUTO | TUNING | OFF
LIMITED = 16
"""What the algorithm, or MOUT, makes of MV is beyond MV_MIN or MV_MAX."""
IN_DEAD_BAND = 32
"""PV has crossed SV inside the dead band: the error counts as 0."""
TUNE_ERROR = 64
"""The last autotune ended without results."""

# What is pending besides the equation (`State.busy`)
FRESH = 1
"""The next calculation of the algorithm has no past."""
REQUEST = 2
"""`State.wanted` is another mode."""
HALTING = 4
"""PID_RUN has become FALSE, which acts at once."""
FROM_MANUAL = 8
"""The next calculation of the algorithm is the first one after manual."""
STOPPED = 16
"""The PLC is stopped."""


@dataclass(slots=True)
class Config(LoopConfig):
    """The operands that an instruction only reads."""

    sig_mout: int = 4
    sig_bias: int = 5
    """I_MV."""
    sig_error: int = 6
    manual: int = register("PID_MAN", 0)
    follow: int = register("MOUT_AUTO", 0)
    joined: int = 0
    """MOUT stands in the device of this loop's MV: both are one value (D266)."""
    dependent: int = register("PID_EQ", 0)
    of_pv: int = register("PID_DE", 0)
    """The derivative is that of PV."""
    forward: int = register("PID_DIR", 0)
    """E = SV - PV."""
    sv_from: int = -1
    """The loop whose MV shares the device of SV, so that it writes SV (D266); -1: none; likewise the next two."""
    bias_from: int = -1
    mout_from: int = -1
    band: float = 0.0
    """The absolute value of ERR_DBW."""
    low: float = 0.0
    """The lower one of MV_MIN and MV_MAX."""
    high: float = 0.0


@dataclass(slots=True)
class State(RelayState):
    """What an instruction writes."""

    mode: int = register("PID_MODE", 0)
    mode_before: int = 0
    """PID_MODE before it became 1."""
    wanted: int = AUTO
    """The mode that PID_RUN, PID_MODE and PID_MAN make."""
    sp: float = register("SV", 0.0)
    gain: float = register("Kc_Kp", 1.0)
    reset: float = register("Ti_Ki", 0.0)
    rate: float = register("Td_Kd", 0.0)
    tf: float = register("Tf", 0.0)
    mout: float = register("MOUT", 0.0)
    bias: float = register("BIAS", 0.0)
    integral: float = register("I_MV", 0.0)
    out: float = register("MV", 0.0)
    # factors
    seconds: float = 1.0
    """Sampling time."""
    lag: float = 1.0
    """Of the derivative's smoothing, Ts / (Tf + Ts)."""
    # past
    error: float = 0.0
    """The error as it counts."""
    e1: float = 0.0
    """I_MV+1: the error of the calculation before, as it counted."""
    pv1: float = 0.0
    """I_MV+6."""
    y: float = 0.0
    """The smoothed derivative."""
    side: float = 0.0
    """Sign of the last error that was not 0; 0: there was none."""
    crossed: int = 0
    """PV has crossed SV since it came into the dead band."""
    # autotune
    tune_reason: int = 0
    """Why it ended without results."""
    tune_band: float = 0.0
    """The relay's hysteresis."""
    tune_bottom: float = 0.0
    """MV while the error is below 0; the next one while it is above."""
    tune_top: float = 0.0
    tune_rounds: int = 0
    """Times that the halves of the cycle were uneven."""
    tune_moved: float = 0.0
    """How far PV has come since the relay switched."""
    tune_gain: float = 0.0
    """Result of the last successful autotune, as in the operand; likewise the next three."""
    tune_reset: float = 0.0
    tune_rate: float = 0.0
    tune_tf: float = 0.0
