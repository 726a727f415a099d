"""The PID blocks of the virtual NextoPID: the manual's figures, single steps by hand, and NumPy's single precision."""

from __future__ import annotations

import itertools
import math
import random
from pathlib import Path

import pytest

pytest.importorskip("numpy")
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from nextopid_pid_rig import Block, Process, run
from nextopid_rig import GAINS, plc_of
from pidcfg.schemas import expressions as grammar
from pidcfg.schemas.iec import BOOL, INT, REAL, TIME
from pidcfg.sim.controllers import nextopid as decisions
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid import PID_DECISIONS
from pidcfg.sim.controllers.nextopid.memory import value_of
from pidcfg.sim.controllers.nextopid.scan import content_of_number
from pidcfg.sim.controllers.nextopid.terms import (
    AUTO_MODE,
    CASCADE_MODE,
    ERROR_BASE,
    MANUAL_MODE,
    MODES,
    OVERRIDDEN,
    TRACKING_MODE,
)

F = np.float32
WIDE = {"MaxMV": 1000, "MinMV": -1000, "MaxPV": 1000, "MinPV": -1000}


# --- the manual's figures --------------------------------------------------------------------------------------------


def ramp(tfd):
    """The derivative action while the PV falls by 1 a second for 20 s, and 10 s after that."""
    block = Block(Kp=0, Td_Kd=10, Tfd=tfd, **WIDE)
    block.call(PV=50)
    return [(block.call(PV=50 - min(n, 200) * 0.1), block["DerivativeAction"])[1] for n in range(1, 301)]


def test_figure_2_2_the_derivative_kicks_by_10_when_the_ramp_starts_and_stops():
    d = ramp(0)

    assert d[:200] == pytest.approx([10.0] * 200, abs=1e-3)
    assert d[200:] == [0.0] * 100


def test_figure_2_3_the_filtered_derivative_reaches_63_percent_after_2_seconds():
    d = ramp(2)

    assert d[:200] == pytest.approx([10.0 * -math.expm1(-n / 20) for n in range(1, 201)], abs=2e-3)
    assert d[19] == pytest.approx(6.32, abs=0.01)
    assert d[219] / d[199] == pytest.approx(math.exp(-1), abs=1e-4)


@pytest.mark.parametrize(("tfd", "peak"), [(0, 10.0), (2, 0.25)])
def test_figures_2_4_and_2_5_noise_of_a_half_unit_and_what_the_filter_leaves(tfd, peak):
    block = Block(Kp=0, Td_Kd=1, Tfd=tfd, **WIDE)
    d = [(block.call(PV=50 + (0.5 if n % 2 else -0.5)), block["DerivativeAction"])[1] for n in range(2000)]

    assert max(d[-100:]) == pytest.approx(peak, abs=2e-3)
    assert min(d[-100:]) == pytest.approx(-peak, abs=2e-3)


def closed_loop(n=600, **parameters):
    block = Block(Kp=3.85, Ti_Ki=13.77, Td_Kd=0.44, SP=50, Indep=0, **parameters)
    g = -2 if parameters.get("Direct") else 2
    process = Process(g, 10, 1, 0.1, 50, 50)
    block.call(Manual=1, ManualMV=50, PV=50)
    return block, process, run(block, process, n, Manual=0, SP=60)


def largest_variation(trend):
    return max(abs(b[0] - a[0]) for a, b in itertools.pairwise([(50.0, 50.0), *trend]))


def test_figures_2_6_and_2_7_the_variation_is_never_above_maxvarmv_and_control_is_slower():
    fast, slow = closed_loop()[2], closed_loop(MaxVarMV=0.5)[2]

    def arrival(trend):
        return next(n for n, (_, pv) in enumerate(trend) if pv >= 58)

    assert largest_variation(fast) > 30
    assert largest_variation(slow) <= 0.5 + 1e-5
    assert arrival(slow) > arrival(fast) + 10
    assert slow[-1][1] == pytest.approx(60, abs=0.05)


def test_figures_2_8_and_2_9_the_direction_that_fits_the_process_controls_and_the_other_one_runs_away():
    assert closed_loop()[2][-1][1] == pytest.approx(60, abs=0.05)
    assert closed_loop(Direct=1)[2][-1][1] == pytest.approx(60, abs=0.05)

    block, process, _ = closed_loop(n=0)
    assert {mv for mv, _ in run(block, process, 300, Direct=1)[-100:]} == {0.0}


# --- single steps by hand --------------------------------------------------------------------------------------------

STEPS = [
    # parameters beside SP 50 and the PVs 40 and 42: P, I, D and MV of the second call
    ({}, 8, 0, 0, 8),
    ({"Kp": 2.5}, 20, 0, 0, 20),
    ({"Ti_Ki": 0.5}, 8, 0.9, 0, 8.9),  # 0.5 x (10 + 8) x 0.1
    ({"Td_Kd": 0.25}, 8, 0, -5, 3),  # -0.25 x 2 / 0.1
    ({"Td_Kd": 0.25, "DerivEr": 1}, 8, 0, -5, 3),
    ({"Td_Kd": 0.25, "Tfd": 0.1}, 8, 0, -3.1606028, 4.8393972),
    ({"BIAS": 30}, 8, 0, 0, 38),
    ({"Direct": 1, "BIAS": 30}, -8, 0, 0, 22),
    ({"Direct": 1, "BIAS": 30, "Ti_Ki": 0.5, "Td_Kd": 0.25}, -8, -0.9, 5, 26.1),
    ({"DisableP": 1}, 8, 0, 0, 8),  # independent form: ignored
    ({"Indep": 0, "Kp": 2, "Ti_Ki": 4, "Td_Kd": 0.25}, 16, 0.9, -10, 6.9),  # Ki 0.5/s, Kd 0.5 s
    ({"Indep": 0, "Kp": 2, "Ti_Ki": 4, "DisableP": 1}, 0, 0.9, 0, 0.9),
    ({"Indep": 0, "Kp": 2, "Ti_Ki": 4, "Td_Kd": 0.25, "DisableP": 1, "BIAS": 30}, 0, 0.9, -10, 20.9),
    ({"Indep": 0, "Kp": 0.01, "Ti_Ki": 0.001}, 0.08, 18, 0, 18.08),  # Ki 10/s
    ({"Indep": 0, "Kp": 0.01, "Ti_Ki": 0.0009}, 0.08, 0, 0, 0.08),
    ({"Indep": 1, "Kp": 1, "Ti_Ki": 0.0009}, 8, 0.00162, 0, 8.00162),
    ({"Kp": 0, "Ti_Ki": 0.5}, 0, 0.9, 0, 0.9),
    ({"CASC": 1, "SP_CASC": 70}, 28, 0, 0, 28),
    ({"SP_CASC": 70}, 8, 0, 0, 8),
    ({"MaxPV": 45}, 3, 0, 0, 3),  # the set point in force is 45
    ({"MinPV": 41, "Td_Kd": 0.25}, 8, 0, -2.5, 5.5),  # the PV goes from 41 to 42
    ({"MaxPV": 41, "Td_Kd": 0.25, "BIAS": 10}, 0, 0, -2.5, 7.5),
    ({"MaxMV": 5}, 8, 0, 0, 5),
    ({"MinMV": 20}, 8, 0, 0, 20),
    ({"MaxVarMV": 3}, 8, 0, 0, 6),  # up from 0
    ({"DeadBand": 8}, 8, 0, 0, 8),
    ({"DeadBand": 9}, 8, 0, 0, 10),  # held at the MV of the first call
    ({"DeadBand": 9, "Ti_Ki": 0.5}, 8, 2.5, 0, 10.5),
    ({"Windup_H_IN": 1, "Ti_Ki": 0.5}, 8, 0, 0, 8),
    ({"Windup_L_IN": 1, "Ti_Ki": 0.5}, 8, 0.9, 0, 8.9),
    ({"Windup_H_IN": 1, "Ti_Ki": 0.5, "Direct": 1, "BIAS": 30}, -8, -0.9, 0, 21.1),
    ({"Windup_L_IN": 1, "Ti_Ki": 0.5, "Direct": 1, "BIAS": 30}, -8, 0, 0, 22),
    ({"Manual": 1, "ManualMV": 33, "Ti_Ki": 0.5, "BIAS": 4}, 8, 21, 0, 33),
    ({"TRK_IN": 1, "TRK_VAL": 33, "Ti_Ki": 0.5, "BIAS": 4, "Td_Kd": 0.25}, 8, 26, -5, 33),
    ({"OVERR": 1, "TRK_VAL": 33, "Ti_Ki": 0.5, "BIAS": 4, "Td_Kd": 0.25}, 8, 34, -5, 41),
    ({"OVERR": 1, "TRK_VAL": 33, "BIAS": 4}, 8, 0, 0, 12),  # no integral gain: nothing follows
    ({"Manual": 1, "ManualMV": 33}, 8, 0, 0, 33),
]


@pytest.mark.parametrize(("given_", "p", "i", "d", "mv"), STEPS)
def test_a_step_by_hand(given_, p, i, d, mv):
    block = Block(SP=50, **given_)
    block.call(PV=40)
    block.call(PV=42)

    assert (*block.actions, block["MV"]) == pytest.approx((p, i, d, mv), rel=2e-6, abs=1e-6)
    assert (block.s.out, block.s.integral) == (block["MV"], block["IntegralAction"])
    assert block.signal_values[0] == block.signal_values[-1] == -1.0, "it wrote outside its parameters"


def test_the_filter_follows_a_time_that_changes():
    block = Block(SP=50, PV=40, Td_Kd=0.25, Tfd=2, **WIDE)
    block.call()
    block.call(PV=42)
    first = block["DerivativeAction"]
    block.call(PV=44, Tfd=0.5)

    assert first == pytest.approx(-5 * -math.expm1(-0.05), rel=1e-6)
    assert block["DerivativeAction"] == pytest.approx(first + (-5 - first) * -math.expm1(-0.2), rel=1e-6)
    block.call(PV=46, Tfd=0)
    assert block["DerivativeAction"] == pytest.approx(-5)


def test_the_sample_time_is_that_of_the_calls():
    block = Block(ts=0.5, Ti_Ki=1, SP=50, PV=40)
    block.call(2)

    assert block["SampleTime"] == 0.5
    assert block["IntegralAction"] == 10


# --- priorities, and the way back ------------------------------------------------------------------------------------

PRIORITIES = [
    # Manual, TRK_IN, OVERR, CASC: mode and MV
    ((0, 0, 0, 0), AUTO_MODE, 5),
    ((0, 0, 0, 1), CASCADE_MODE, 6),
    ((0, 0, 1, 0), AUTO_MODE | OVERRIDDEN, 75),
    ((0, 0, 1, 1), CASCADE_MODE | OVERRIDDEN, 76),
    ((0, 1, 0, 0), TRACKING_MODE, 70),
    ((0, 1, 0, 1), TRACKING_MODE, 70),
    ((0, 1, 1, 1), TRACKING_MODE, 70),
    ((1, 0, 0, 0), MANUAL_MODE, 30),
    ((1, 0, 1, 1), MANUAL_MODE, 30),
    ((1, 1, 1, 1), MANUAL_MODE, 30),
]


@pytest.mark.parametrize(("inputs", "mode", "mv"), PRIORITIES)
def test_manual_comes_before_tracking_before_override(inputs, mode, mv):
    block = Block(SP=45, SP_CASC=46, PV=40, Ti_Ki=1e-9, ManualMV=30, TRK_VAL=70)
    block.call(**dict(zip(("Manual", "TRK_IN", "OVERR", "CASC"), inputs, strict=True)))

    assert block["MV"] == pytest.approx(mv)
    assert block.s.status & MODES == mode
    assert block["TRK_OUT"] == float(mode & CASCADE_MODE == 0)
    assert (block.s.pv, block.s.sp) == (40, 46 if inputs[3] else 45)


RETURNS = [
    {"Manual": 1, "ManualMV": 62.5},
    {"TRK_IN": 1, "TRK_VAL": 62.5},
]


@pytest.mark.parametrize("held", RETURNS)
@pytest.mark.parametrize("extra", [{}, {"Direct": 1}, {"Indep": 0, "Ti_Ki": 4}, {"BIAS": -20, "Td_Kd": 1, "Tfd": 3}])
def test_control_goes_on_from_the_mv_of_manual_and_tracking(held, extra):
    block = Block(**{"SP": 45, "PV": 40, "Kp": 3, "Ti_Ki": 0.001, **extra})
    block.call(20, **held)
    assert block["MV"] == 62.5

    block.call(**{next(iter(held)): 0})
    assert block["MV"] == pytest.approx(62.5, abs=0.4)
    assert block["MV"] != 62.5, "it controls"


# --- limits and anti-windup ------------------------------------------------------------------------------------------


WINDUP = [
    # what limits MV, Direct: Windup_H_OUT and Windup_L_OUT
    ({"SP": 90, "MaxMV": 30}, 0, (1, 0)),
    ({"SP": 10, "MinMV": 1}, 0, (0, 1)),
    ({"SP": 90, "MaxVarMV": 5}, 0, (1, 0)),
    ({"SP": 10, "BIAS": 80, "MaxVarMV": 5, "ManualMV": 90}, 0, (0, 1)),
    ({"SP": 10, "MaxMV": 30}, 1, (0, 1)),
    ({"SP": 90, "MinMV": 1}, 1, (1, 0)),
    ({"SP": 10, "MaxVarMV": 5}, 1, (0, 1)),
    ({"SP": 90, "BIAS": 80, "MaxVarMV": 5, "ManualMV": 90}, 1, (1, 0)),
    ({"SP": 50, "BIAS": 50}, 0, (0, 0)),
]


@pytest.mark.parametrize(("given_", "direct", "outputs"), WINDUP)
def test_the_master_is_told_which_set_points_are_useless(given_, direct, outputs):
    block = Block(PV=50, Direct=direct, **given_)
    block.call(Manual=1)
    block.call(Manual=0)

    assert block.windup == outputs


# --- error and warning bits ------------------------------------------------------------------------------------------

ERRORS = [
    # bit, what is just wrong, what is just right
    ("MaxMinMV", {"MaxMV": 0}, {"MaxMV": 1e-6}),
    ("MaxMinMV", {"MinMV": 101}, {"MinMV": 99.99}),
    ("MaxMinPV", {"MaxPV": 0}, {"MaxPV": 1e-6}),
    ("MaxMinPV", {"MinPV": 100.01}, {"MinPV": 99.99}),
    ("Kp", {"Kp": 0, "Indep": 0}, {"Kp": 1e-6, "Indep": 0}),
    ("Kp", {"Kp": -1e-6}, {"Kp": 0}),
    ("Td_Kd", {"Td_Kd": -1e-6}, {"Td_Kd": 0}),
    ("Ti_Ki", {"Ti_Ki": -1e-6}, {"Ti_Ki": 0}),
    ("Tfd", {"Tfd": -1e-6}, {"Tfd": 0}),
    ("MaxVarMV", {"MaxVarMV": -1e-6}, {"MaxVarMV": 0}),
    ("DeadBand", {"DeadBand": -1e-6}, {"DeadBand": 0}),
]
ERROR_NAMES = ["MaxMinMV", "MaxMinPV", "Kp", "Td_Kd", "Ti_Ki", "Tfd", "MaxVarMV", "DeadBand", "SampleTime"]


@pytest.mark.parametrize(("bit", "wrong", "right"), ERRORS)
def test_an_error_bit_stops_the_block_and_its_outputs_stay(bit, wrong, right):
    block = Block(SP=50, PV=45, Ti_Ki=1, Td_Kd=1, MaxVarMV=3, MaxMV=20)
    block.call(Manual=1, ManualMV=30)
    block.call(3, Manual=0, BIAS=30)
    first = block.places["MV"] + block.c.base
    before, mode, pv = block.signal_values[first:], block.s.status, block.s.pv
    assert block.true("WarnBits.") == {"MV_P_MaxVarMV", "MV_MaxMV"}

    block.set(MaxMV=100)
    block.call(2, PV=70, SP=10, **wrong)
    assert block.true("ErrBits.") == {bit}
    assert block.s.status == mode | ERROR_BASE << ERROR_NAMES.index(bit)
    changed = {n for n, i in block.places.items() if i >= first - block.c.base and block[n] != before[i - first + 3]}
    assert changed - set(wrong) == {f"ErrBits.{bit}"}
    assert block.s.pv == pv

    block.set(MaxMV=100, MinMV=0, MaxPV=100, MinPV=0, Indep=1)
    block.call(**right)
    assert block.true("ErrBits.") == set()
    assert block.s.status == mode
    assert block.s.pv != pv


def test_all_error_bits_at_once_and_the_longest_sample_time():
    wrong = {"Kp": -1, "Td_Kd": -1, "Ti_Ki": -1, "Tfd": -1, "MaxVarMV": -1, "DeadBand": -1}
    block = Block(ts=60.1, MaxMV=0, MaxPV=0, **wrong)
    block.call()

    assert block.true("ErrBits.") == set(ERROR_NAMES)
    assert block["SampleTime"] == single(60.1)
    assert block.s.status // ERROR_BASE == 511

    slow = Block(ts=60.1, PV=101)
    slow.call()
    assert slow.true("ErrBits.") == {"SampleTime"}
    longest = Block(ts=60)
    longest.call()
    assert longest.true("ErrBits.") == set()


def test_warning_bits_and_inputs_stay_when_other_bits_are_written():
    block = Block(PV=101, AutoTune=1)
    block.call()
    block.call(Tfd=-1)
    assert block.true("WarnBits.") == {"PV_MaxPV"}
    block.call(Tfd=0, PV=50)
    assert (block.true("WarnBits."), block["AutoTune"]) == (set(), 1)


WARNINGS = [
    ({"PV": 100.01}, {"PV_MaxPV"}),
    ({"PV": 100}, set()),
    ({"PV": -0.01}, {"PV_MinPV"}),
    ({"PV": 0}, set()),
    ({"SP": 100.01}, {"SP_MaxPV"}),
    ({"SP": 100}, set()),
    ({"SP": -0.01}, {"SP_MinPV"}),
    ({"SP": 0}, set()),
    ({"SP_CASC": 100.01}, set()),
    ({"SP_CASC": 100.01, "CASC": 1}, {"SP_CASC_MaxPV"}),
    ({"SP_CASC": -0.01, "CASC": 1}, {"SP_CASC_MinPV"}),
    ({"SP_CASC": 100, "CASC": 1}, set()),
    ({"SP": 101, "SP_CASC": 50, "CASC": 1}, set()),
    ({"BIAS": 50.01}, {"MV_MaxMV"}),
    ({"BIAS": 50}, set()),
    ({"BIAS": -50.01}, {"MV_MinMV"}),
    ({"BIAS": -50}, set()),
    ({"BIAS": 3, "MaxVarMV": 2}, {"MV_P_MaxVarMV"}),
    ({"BIAS": 2, "MaxVarMV": 2}, set()),
    ({"BIAS": -3, "MaxVarMV": 2}, {"MV_N_MaxVarMV"}),
    ({"BIAS": -2, "MaxVarMV": 2}, set()),
    ({"Manual": 1, "ManualMV": 100.01}, {"MV_MaxMV"}),
    ({"Manual": 1, "ManualMV": -0.01}, {"MV_MinMV"}),
    ({"TRK_IN": 1, "TRK_VAL": 100.01}, {"MV_MaxMV"}),
    ({"Manual": 1, "ManualMV": 50, "SP": 101, "PV": -1}, {"SP_MaxPV", "PV_MinPV"}),
    ({"Manual": 1, "ManualMV": 90, "MaxVarMV": 2}, set()),
]


@pytest.mark.parametrize(("given_", "bits"), WARNINGS)
def test_a_warning_bit_tells_what_is_limited(given_, bits):
    """From an MV of 50 at rest."""
    block = Block(SP=50, PV=50, Ti_Ki=1e-9)
    block.call(Manual=1, ManualMV=50)
    block.call(**{"Manual": 0, **given_})

    assert block.true("WarnBits.") == bits
    names = [n.removeprefix("WarnBits.") for n in block.places if n.startswith("WarnBits.")]
    assert block.s.aux_status == sum(1 << names.index(bit) for bit in bits)
    assert block.true("ErrBits.") == set()
    assert 0 <= block["MV"] <= 100

    block.call(Manual=1, ManualMV=50, TRK_IN=0, BIAS=0, SP=50, PV=50, CASC=0)
    assert block.true("WarnBits.") == set()


# --- INT -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("bias", "error", "mv"), [(0, 1, 0), (1, 1, 2), (2, 1, 2), (3, 1, 4), (0, 3, 2), (10, -1, 10)])
def test_an_int_block_rounds_its_mv_half_to_even(bias, error, mv):
    block = Block("PIDA_INT", Kp=0.5, SP=50, PV=50 - error, BIAS=bias)

    assert block.call() == mv
    assert block["ProportionalAction"] == 0.5 * error


# --- native single precision -----------------------------------------------------------------------------------------


class Reference:
    """The blocks in NumPy's own single precision, written down once more."""

    def __init__(self, whole, ts):
        self.whole, self.ts = whole, F(ts)
        self.i = self.y = self.mv = F(0)
        self.pv = self.e = None

    def call(self, x):
        """Both actions that do not add up, and whether MV is limited upward and downward; ``x``: inputs by name."""
        pv = min(max(x["PV"], x["MinPV"]), x["MaxPV"])
        sp = min(max(x["SP_CASC"] if x["CASC"] else x["SP"], x["MinPV"]), x["MaxPV"])
        e = sp - pv
        p, d, ki = self.actions(x, pv, e)
        copied = self.copied(x, e)
        if copied is None:
            return p, d, *self.calculated(x, e, p, d, ki)
        self.mv = np.clip(copied, x["MinMV"], x["MaxMV"])
        self.round()
        self.i = ((self.mv - p) - d) - x["BIAS"] if ki else F(0)
        return p, d, copied > x["MaxMV"], copied < x["MinMV"]

    def actions(self, x, pv, e):
        sign = F(-1) if x["Direct"] else F(1)
        pv1, e1 = (pv, e) if self.pv is None else (self.pv, self.e)
        self.pv, self.e = pv, e
        kp, ki, kd = x["Kp"], x["Ti_Ki"], x["Td_Kd"]
        if not x["Indep"]:
            ki, kd = (F(0) if ki < F(0.001) else kp / ki), kp * kd
        p = F(0) if x["DisableP"] and not x["Indep"] else sign * (kp * e)
        raw = sign * (kd * ((e - e1) if x["DerivEr"] else (pv1 - pv))) / self.ts
        self.y = self.y + (raw - self.y) * F(-math.expm1(-float(self.ts / x["Tfd"]))) if x["Tfd"] > 0 else raw
        return p, self.y, sign * ki

    def copied(self, x, e):
        if x["Manual"]:
            return x["ManualMV"]
        if x["TRK_IN"]:
            return x["TRK_VAL"]
        return self.mv if not x["OVERR"] and abs(e) < x["DeadBand"] else None

    def round(self):
        if self.whole:
            self.mv = F(np.rint(self.mv))

    def limit(self, x, mv):
        up = down = False
        if x["MaxVarMV"] > 0:
            top, bottom = self.mv + x["MaxVarMV"], self.mv - x["MaxVarMV"]
            up, down = mv > top, mv < bottom
            mv = np.clip(mv, bottom, top)
        self.mv = np.clip(mv, x["MinMV"], x["MaxMV"])
        self.round()
        return up or mv > x["MaxMV"], down or mv < x["MinMV"]

    def calculated(self, x, e, p, d, ki):
        bias, step = x["BIAS"], (ki * e) * self.ts
        if not ki:
            self.i = F(0)
        elif x["OVERR"]:
            self.i = (x["TRK_VAL"] - d) - bias
        if x["OVERR"] or (step > 0 and x["Windup_H_IN"]) or (step < 0 and x["Windup_L_IN"]):
            step = F(0)
        up, down = self.limit(x, ((p + (self.i + step)) + d) + bias)
        room = self.mv - (((p + self.i) + d) + bias)
        if up and step > 0:
            step = np.clip(room, F(0), step)
        if down and step < 0:
            step = np.clip(room, step, F(0))
        self.i += step
        return up, down


def chance(rng, share, yes, no=0.0):
    return yes if rng.random() < share else no


def random_inputs(rng, whole):
    """All inputs of a call, in ranges that make every branch come up."""
    x = {
        "SP": rng.uniform(-5, 105),
        "SP_CASC": rng.uniform(-5, 105),
        "PV": rng.uniform(-5, 105),
        "Kp": 10 ** rng.uniform(-2, 1),
        "Ti_Ki": rng.choice([0, 5e-4, 0.01, 0.3, 4, 60]),
        "Td_Kd": rng.choice([0, 0, 0.02, 0.3]),
        "Tfd": rng.choice([0, 0, 0.05, 0.7, 20]),
        "BIAS": chance(rng, 0.5, rng.uniform(-20, 60)),
        "ManualMV": rng.uniform(-10, 110),
        "TRK_VAL": rng.uniform(-10, 110),
        "MaxVarMV": chance(rng, 0.4, rng.uniform(1, 20)),
        "MaxMV": rng.choice([100, 100, 77]),
        "MinMV": rng.choice([0, 0, 12]),
        "MaxPV": rng.choice([100, 90]),
        "MinPV": rng.choice([0, 10]),
        "DeadBand": chance(rng, 0.3, rng.uniform(1, 10)),
        "Indep": chance(rng, 0.5, 1),
        "DisableP": chance(rng, 0.3, 1),
        "DerivEr": chance(rng, 0.4, 1),
        "CASC": chance(rng, 0.3, 1),
        "TRK_IN": chance(rng, 0.1, 1),
        "Windup_H_IN": chance(rng, 0.15, 1),
        "Windup_L_IN": chance(rng, 0.15, 1),
        "OVERR": chance(rng, 0.15, 1),
        "Manual": chance(rng, 0.1, 1),
        "Direct": chance(rng, 0.5, 1),
    }
    reals = {"Kp", "Ti_Ki", "Td_Kd", "Tfd"}
    return {name: single(float(round(v)) if whole and name not in reals else float(v)) for name, v in x.items()}


def changed(rng, x, whole):
    """The inputs with a PV that moves on, and now and then something else."""
    new = random_inputs(rng, whole)
    pv = x["PV"] + rng.gauss(0, 2)
    found = {**x, "PV": single(float(round(pv)) if whole else pv)}
    for name in rng.sample(sorted(new), rng.choice([0, 0, 0, 1, 3])):
        found[name] = new[name]
    return found


def compared(rng):
    """A random block side by side with NumPy; the bits that came up, and how often MV was inside its limits."""
    kind = rng.choice(["PIDA_REAL", "PIDA_INT", "PIDA_TUNE_REAL", "PIDA_TUNE_INT"])
    whole, ts = "INT" in kind, rng.choice([0.02, 0.1, 0.3, 1.0])
    block, reference = Block(kind, ts), Reference(whole, single(ts))
    x, warnings, free = random_inputs(rng, whole), 0, 0
    for _ in range(150):
        block.call(**x)
        p, d, up, down = reference.call({name: F(value) for name, value in x.items()})
        expected = (float(p), float(reference.i), float(d), float(reference.mv))
        assert (*block.actions, block["MV"]) == expected, x
        assert block.windup == ((down, up) if x["Direct"] else (up, down)), x
        assert x["MinMV"] <= block["MV"] <= x["MaxMV"]
        warnings |= block.s.aux_status
        free += not (up or down or x["Manual"] or x["TRK_IN"])
        x = changed(rng, x, whole)
    return warnings, free


def test_every_operation_is_native_single_precision():
    found = [compared(random.Random(seed)) for seed in range(60)]

    assert {bit for bits, _ in found for bit in range(10) if bits >> bit & 1} == set(range(10))
    assert sum(free for _, free in found) > 60 * 40


# --- whatever comes --------------------------------------------------------------------------------------------------

NUMBER = st.floats(-(2.0**126), 2.0**126, width=32)
ANYTHING = dict.fromkeys(("SP", "SP_CASC", "PV", "BIAS", "ManualMV", "TRK_VAL", "MinPV", "MaxPV"), NUMBER)
POSITIVE = {name: st.floats(0, 2.0**126, width=32) for name in ("Kp", "Ti_Ki", "Td_Kd", "Tfd", "MaxVarMV", "DeadBand")}
FLAGS = ("Indep", "DisableP", "DerivEr", "CASC", "TRK_IN", "Windup_H_IN", "Windup_L_IN", "OVERR", "Manual", "Direct")
CALLS = st.lists(
    st.fixed_dictionaries({}, optional={**ANYTHING, **POSITIVE, **{name: st.integers(0, 1) for name in FLAGS}}),
    min_size=1,
    max_size=8,
)


@settings(max_examples=150, deadline=None)
@given(
    calls=CALLS, kind=st.sampled_from(["PIDA_REAL", "PIDA_TUNE_INT"]), limits=st.tuples(*[st.integers(-999, 999)] * 2)
)
def test_mv_is_within_its_limits_and_everything_is_a_number(calls, kind, limits):
    low, high = min(limits), max(limits) + 1
    block = Block(kind, MinMV=low, MaxMV=high)
    block.s.out = float(low)
    block.set(MV=low)
    for parameters in calls:
        block.call(**parameters)
        assert low <= block["MV"] <= high
        assert all(
            math.isfinite(x)
            for x in (block.s.integral, block.s.previous_derivative, block.s.pv, block.s.previous_error)
        )
        assert 0 in block.windup


def test_a_pv_that_is_no_number_is_not_calculated_with():
    block = Block(SP=50, PV=45, Ti_Ki=1, Td_Kd=1)
    block.call(3)
    before, state = list(block.signal_values), block.s.integral
    block.signal_values[block.place("PV")] = math.nan
    block.call()
    block.signal_values[block.place("PV")] = before[block.place("PV")]

    assert block.signal_values == before
    assert block.s.integral == state
    assert block.call() < 100


# --- decisions -------------------------------------------------------------------------------------------------------


def test_decisions_are_numbered_without_a_gap():
    assert [decision.number for decision in PID_DECISIONS] == [*range(220, 235), *range(690, 695)]


@pytest.mark.parametrize("decision", PID_DECISIONS, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    folder = Path(decisions.__file__).parent
    modules = sorted(m for m in folder.glob("*.py") if m.name != "decisions.py")

    assert f"D{decision.number}" in "".join(m.read_text("utf-8") for m in modules)


@pytest.mark.parametrize(
    ("indep", "time", "integrates"),
    [(True, 0, False), (True, 0.0005, True), (False, 0, False), (False, 0.0005, False), (False, 0.001, True)],
)
def test_a_gain_of_0_and_a_time_that_is_too_short_are_no_integral(indep, time, integrates):
    gains = GAINS.replace("Ti_Ki: 10.0", f"Ti_Ki: {time}, Indep: {str(indep).lower()}")
    text = f"""
loops:
  - {{name: A, type: PIDA_REAL, SP: 1, {gains}}}
blocks:
  - {{name: F, type: ControlLowFilter, InVar: A.MV, Tc: 5}}
"""
    plc = plc_of(text)

    assert plc.integrates(0, plc.signal_values) == integrates
    assert plc.check_input("F.Tc", 7) == 7


@pytest.mark.parametrize(
    ("kind", "value", "content"),
    [
        (BOOL, 0.0, False),
        (BOOL, 1.0, True),
        (REAL, math.nan, 0.0),
        (REAL, 1.5, 1.5),
        (INT, 3.0, 3),
        (TIME, 1.5, "T#1500ms"),
    ],
)
def test_a_register_holds_what_the_block_has(kind, value, content):
    assert content_of_number(kind, value) == content


def test_a_wire_reads_its_signals_and_constants():
    code = [grammar.SIGNAL, 1, grammar.CONSTANT, 2.5, grammar.MULTIPLY, 0, grammar.SIGNAL, 0, grammar.SUBTRACT, 0]
    aux = [float(len(code) + 1), *map(float, code), *[0.0] * 4]

    assert value_of(aux, 1, len(code) + 1, [3.0, 8.0]) == 17.0
