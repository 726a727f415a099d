"""Auto-tuning of PIDA_TUNE_REAL and PIDA_TUNE_INT, call by call, and how it ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.schemas.nextopid import TUNE_LIMITS
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_TUNE,
    DIRECT,
    FLAGS,
    INDEP,
    MAX_MV,
    MAX_PV,
    MIN_MV,
    MIN_PV,
    TUNE_DONE,
    TUNE_ERROR,
    TUNE_FLAGS,
    TUNE_PARAM,
    TUNE_RESULT,
    whole,
)
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.tuning.rules import NEXTOPID_P, NEXTOPID_PART, NEXTOPID_TD, NEXTOPID_TI

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

    from pidcfg.sim.controllers.nextopid.terms import Config, State

# --- How an auto-tuning ends: flags, results, and the reset of both. D numbers: see `decisions` -----------------------

IDLE, AVERAGING, RELAY, DONE, FAILED = 0, 1, 2, 3, 4
"""`State.tune_phase`; FAILED is an end with AutoTuneError."""

# Flags of AutoTuneResult, in the order of the table
BAD_AMP, BAD_HYST, BAD_PEAK, BAD_CYCLES, BAD_MODE = 1, 2, 4, 8, 16
MV_TOO_HIGH, MV_TOO_LOW, PV_TOO_HIGH, PV_TOO_LOW = 32, 64, 128, 256
PEAK_TOO_HIGH, PEAK_TOO_LOW, PV_NOT_STEADY, CYCLE_TOO_FAST, HIGH_DEAD_TIME = 512, 1024, 2048, 4096, 8192

P_ONLY, PI_ONLY, FULL_PID = 0, 1, 2
"""AUTOTUNE_MODE."""

PI = single(3.141592653589793)
FAST = 10
"""Samples that a cycle has at least (D233)."""
FEW_DEAD_TIMES = 1.5
"""Dead times that a half cycle has at least (D233)."""
GAIN_P = single(NEXTOPID_P)
GAIN_PI, TIMES_TI, PART_TD = single(NEXTOPID_PART), single(NEXTOPID_TI), single(NEXTOPID_TD)
"""Kp = Ku / 3.2, Ti = 2.2 Pu, Td = Pu / 6.3 (D234)."""


def clear_results(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """AutoTuneDone, AutoTuneError and AutoTuneResult as they are without auto-tuning (kernel)."""
    b = c.base
    s.tune_phase = IDLE
    s.tune_side = 0
    sig[b + TUNE_DONE] = 0.0
    sig[b + TUNE_ERROR] = 0.0
    for i in range(3):
        sig[b + TUNE_RESULT + i] = 0.0
    for i in range(FLAGS):
        sig[b + TUNE_FLAGS + i] = 0.0


def end_tune(c: Config, s: State, sig: MutableSequence[float], flags: int) -> None:
    """The auto-tuning has ended, with an error if there are flags; MV is what it was (kernel)."""
    b = c.base
    s.tune_side = 0
    s.tune_phase = FAILED if flags else DONE
    sig[b + TUNE_DONE] = 1.0
    sig[b + TUNE_ERROR] = 1.0 if flags else 0.0
    for i in range(FLAGS):
        sig[b + TUNE_FLAGS + i] = float((flags >> i) & 1)


def doubtful(s: State, samples: int, a: float) -> int:
    """Flags of a measurement whose results cannot be trusted (kernel, D233)."""
    flags = 0
    if a < single(2.0 * s.tune_band):
        flags |= PEAK_TOO_LOW
    if samples < FAST * s.tune_cycles:
        flags |= CYCLE_TOO_FAST
    if samples < FEW_DEAD_TIMES * s.tune_dead:
        flags |= HIGH_DEAD_TIME
    return flags


def results(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """Gain and times from amplitude and period of the measured cycles (kernel, D234)."""
    b = c.base
    samples = s.tune_count - s.tune_start
    a = single(s.tune_swing / (2 * s.tune_cycles))
    period = single(single(samples * c.ts) / s.tune_cycles)
    if a <= 0.0:
        end_tune(c, s, sig, PEAK_TOO_LOW)
        return
    ultimate = single(single(4.0 * abs(s.tune_step)) / single(PI * a))
    kp = single(GAIN_P * ultimate) if s.tune_mode == P_ONLY else single(ultimate / GAIN_PI)
    ti = 0.0
    td = 0.0
    if s.tune_mode != P_ONLY:
        ti = single(TIMES_TI * period)
    if s.tune_mode == FULL_PID:
        td = single(period / PART_TD)
    if sig[b + INDEP] != 0.0:
        ti = single(kp / ti) if ti > 0.0 else 0.0
        td = single(kp * td)
    sig[b + TUNE_RESULT] = kp
    sig[b + TUNE_RESULT + 1] = ti
    sig[b + TUNE_RESULT + 2] = td
    end_tune(c, s, sig, doubtful(s, samples, a))


# ----------------------------------------------------------------------------------------------------------------------
# Auto-tuning of PIDA_TUNE_REAL and PIDA_TUNE_INT, call by call: three seconds at rest, then a relay (D230 to D234).
# Everything of the PV is counted from its rest, RefPV. `State.tune_side` is 1 while the relay drives the PV up, -1
# while it drives it down, else 0; `State.tune_step` is M, negative for direct control. D numbers: see `decisions`.

FREE, HOLDS, ABORTED, ENDED = 0, 1, 2, 3
"""What the auto-tuning is to MV: nothing, it holds it, or AutoTune has just been reset before or after the end."""

AMP, HYST, PEAK, CYCLES, MODE = 0, 1, 2, 3, 4
"""Members of AutoTuneParam."""
(LEAST_AMP, MOST_AMP), (LEAST_HYST, MOST_HYST), (LEAST_PEAK, MOST_PEAK), (LEAST_CYCLES, MOST_CYCLES) = (
    (single(float(low)), single(float(high))) for low, high in TUNE_LIMITS.values()
)
"""The manual's ranges, in the order of the members."""
REST = 3 * TICKS
"""How long RefPV is averaged."""
FIRST_RETURN = 2
"""The switch with which the first measured cycle begins."""


def bad_parameters(sig: Sequence[float], at: int) -> int:
    """Flags of parameters that are out of range (kernel)."""
    flags = 0
    if not LEAST_AMP <= sig[at + AMP] <= MOST_AMP:
        flags |= BAD_AMP
    if not LEAST_HYST <= sig[at + HYST] <= MOST_HYST:
        flags |= BAD_HYST
    if not LEAST_PEAK <= sig[at + PEAK] <= MOST_PEAK:
        flags |= BAD_PEAK
    if not LEAST_CYCLES <= sig[at + CYCLES] <= MOST_CYCLES:
        flags |= BAD_CYCLES
    if not P_ONLY <= sig[at + MODE] <= FULL_PID:
        flags |= BAD_MODE
    return flags


def percent(percentage: float, low: float, high: float) -> float:
    """So many percent of a range (kernel)."""
    return single(single(percentage * single(high - low)) / 100.0)


def begin(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """The rising edge: RefMV is the present MV, and the parameters are taken as they are (kernel, D230)."""
    b = c.base
    at = b + TUNE_PARAM
    flags = bad_parameters(sig, at)
    step = whole(c, percent(sig[at + AMP], sig[b + MIN_MV], sig[b + MAX_MV]))
    if c.whole and step == 0.0:
        flags |= BAD_AMP
    s.tune_out = s.out
    s.tune_step = -step if sig[b + DIRECT] != 0.0 else step
    if flags & BAD_AMP == 0:
        if single(s.out + step) > sig[b + MAX_MV]:
            flags |= MV_TOO_HIGH
        if single(s.out - step) < sig[b + MIN_MV]:
            flags |= MV_TOO_LOW
    if flags:
        end_tune(c, s, sig, flags)
        return
    s.tune_phase = AVERAGING
    s.tune_band = percent(sig[at + HYST], sig[b + MIN_PV], sig[b + MAX_PV])
    s.tune_safe = percent(sig[at + PEAK], sig[b + MIN_PV], sig[b + MAX_PV])
    s.tune_cycles = int(sig[at + CYCLES])
    s.tune_mode = int(sig[at + MODE])
    s.tune_count = 0
    s.tune_sum = 0.0
    s.tune_base = s.pv
    s.tune_low = 0.0
    s.tune_high = 0.0


def average(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One sample at rest; after three seconds the relay takes its first step (kernel, D230, D692)."""
    s.tune_count += 1
    away = single(s.pv - s.tune_base)
    if s.tune_count * c.period < REST:
        s.tune_sum = single(s.tune_sum + away)
        s.tune_low = min(s.tune_low, away)
        s.tune_high = max(s.tune_high, away)
        return
    mean = single(s.tune_sum / s.tune_count)
    flags = 0
    if single(s.tune_high - mean) > s.tune_band or single(mean - s.tune_low) > s.tune_band:
        flags |= PV_NOT_STEADY
    s.tune_base = single(s.tune_base + mean)
    if single(s.tune_base + s.tune_band) > sig[c.base + MAX_PV]:
        flags |= PV_TOO_HIGH
    if single(s.tune_base - s.tune_band) < sig[c.base + MIN_PV]:
        flags |= PV_TOO_LOW
    if abs(single(s.pv - s.tune_base)) > s.tune_safe:
        flags |= PEAK_TOO_HIGH
    if flags:
        end_tune(c, s, sig, flags)
        return
    s.tune_phase = RELAY
    s.tune_side = 1
    s.tune_count = 0
    s.tune_turns = 0
    s.tune_dead = 0
    s.tune_swing = 0.0


def switch(c: Config, s: State, sig: MutableSequence[float], away: float) -> None:
    """The relay switches: a half cycle ends, and another one begins (kernel, D232)."""
    if s.tune_turns >= FIRST_RETURN:
        s.tune_swing = single(s.tune_swing + abs(s.tune_a))
        s.tune_dead += s.tune_peak - s.tune_points
    s.tune_turns += 1
    s.tune_side = -s.tune_side
    s.tune_points = s.tune_count
    s.tune_peak = s.tune_count
    s.tune_a = away
    if s.tune_turns == FIRST_RETURN:
        s.tune_start = s.tune_count
    elif s.tune_turns == FIRST_RETURN + 2 * s.tune_cycles:
        results(c, s, sig)


def relay(c: Config, s: State, sig: MutableSequence[float]) -> None:
    """One sample under the relay (kernel, D232)."""
    s.tune_count += 1
    away = single(s.pv - s.tune_base)
    if abs(away) > s.tune_safe:
        end_tune(c, s, sig, PEAK_TOO_HIGH)
    elif s.tune_side * away >= s.tune_band:
        switch(c, s, sig, away)
    elif s.tune_side * away <= s.tune_side * s.tune_a:
        s.tune_a = away
        s.tune_peak = s.tune_count


def tune(c: Config, s: State, sig: MutableSequence[float]) -> int:
    """One call of the auto-tuning: what it is to MV (kernel)."""
    phase = s.tune_phase
    if sig[c.base + AUTO_TUNE] == 0.0:
        if phase == IDLE:
            return FREE
        clear_results(c, s, sig)
        return ABORTED if AVERAGING <= phase <= RELAY else ENDED
    if phase == IDLE:
        begin(c, s, sig)
    elif phase == AVERAGING:
        average(c, s, sig)
    elif phase == RELAY:
        relay(c, s, sig)
    return HOLDS
