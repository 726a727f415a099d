"""How an auto-tuning ends: flags, results, and the reset of both. D numbers: see `decisions`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.controllers.nextopid.slots import FLAGS, INDEP, TUNE_DONE, TUNE_ERROR, TUNE_FLAGS, TUNE_RESULT
from pidcfg.sim.terms import single
from pidcfg.tuning.rules import NEXTOPID_P, NEXTOPID_PART, NEXTOPID_TD, NEXTOPID_TI

if TYPE_CHECKING:
    from collections.abc import MutableSequence

    from pidcfg.sim.controllers.nextopid.state import Config, State

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
