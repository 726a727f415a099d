"""The auto-tuning of PIDA_TUNE_REAL and PIDA_TUNE_INT: the worked example, measurements by hand, and every flag."""

from __future__ import annotations

import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nextopid_pid_rig import Block, Process, run
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid.equation import AVERAGING, DONE, FAILED, IDLE, RELAY
from pidcfg.sim.controllers.nextopid.terms import AUTO_MODE, MANUAL_MODE, MODES, TUNING_MODE
from pidcfg.tuning.rules import METHODS, Cycle

PARAM = {"PercAmpMV": 5, "PercHystPV": 0.1, "PercMaxPeakPV": 10, "NumCycles": 3, "Mode": 2}
P, PI, PID = 0, 1, 2


def param(**changes):
    """Members of AutoTuneParam."""
    return {f"AutoTuneParam__{name}": value for name, value in {**PARAM, **changes}.items()}


def manual(kind="PIDA_TUNE_REAL", mv=20, ts=0.1, **parameters):
    """A block in manual that has been called once."""
    given_ = {"Ti_Ki": 10, "Indep": 0, "Manual": 1, "ManualMV": mv, "SP": 40, "PV": 40}
    block = Block(kind, ts, **{**given_, **param(), **parameters})
    block.call()
    return block


def tuned(block, process, most=20000):
    """MV and PV of every cycle, until the auto-tuning has ended."""
    trend = run(block, process, 1, AutoTune=1)
    while not block["AutoTuneDone"]:
        trend += run(block, process, 1)
        assert len(trend) < most, "the auto-tuning did not come to an end"
    return trend


def found(block):
    return tuple(block[f"AutoTuneResult.{name}"] for name in ("Kp", "Ti_Ki", "Td_Kd"))


def flags(block):
    return block.true("AutoTuneResult.")


def rule(a, period, m=5.0):
    """Gain and times by the relay's amplitude and period."""
    return 4 * m / (math.pi * a) / 3.2, 2.2 * period, period / 6.3


def relay_solution(gain, time_constant, dead_time, m, h):
    """Amplitude and period of the continuous relay oscillation of a first-order process with dead time."""
    top = gain * m
    a = top - (top - h) * math.exp(-dead_time / time_constant)
    return a, 2 * (dead_time + time_constant * math.log((top + a) / (top - h)))


# --- the worked example ----------------------------------------------------------------------------------------------


def test_the_worked_example():
    """22 samples a half cycle; the continuous relay would do 20.9, a threshold is only seen at the next sample."""
    block = manual()
    trend = tuned(block, Process(2, 10, 1, 0.1, 20, 40))

    assert flags(block) == set()
    assert (block["AutoTuneDone"], block["AutoTuneError"], block.s.tune_phase) == (1, 0, DONE)
    assert found(block) == pytest.approx(rule(10 * math.tanh(2.2 / 20), 4.4), rel=3e-3)
    assert found(block) == pytest.approx((1.819, 9.68, 0.698), rel=1e-3)

    a, period = relay_solution(2, 10, 1, 5, 0.1)
    assert (a, period) == pytest.approx((1.0421, 4.1836), abs=1e-4)
    assert found(block) == pytest.approx(rule(a, period), rel=0.055)

    assert [mv for mv, _ in trend[:30]] == [20] * 30, "three seconds at rest"
    assert trend[30][0] == 25
    assert {mv for mv, _ in trend[30:-1]} == {15, 25}
    assert trend[-1][0] == 20
    assert max(abs(pv - 40) for _, pv in trend) < 1.2


def test_the_worked_example_found_with_finer_samples_is_that_of_the_continuous_relay():
    block = manual(ts=0.002)
    tuned(block, Process(2, 10, 1, 0.002, 20, 40))

    assert found(block) == pytest.approx(rule(*relay_solution(2, 10, 1, 5, 0.1)), rel=2e-3)


PROCESSES = [
    # gain, time constant, dead time, sample time
    (2, 10, 1, 0.05),
    (1, 60, 10, 0.5),
    (0.5, 60, 10, 0.5),
    (3, 30, 8, 0.2),
    (1.5, 200, 5, 0.25),
]


@pytest.mark.parametrize("direct", [0, 1])
@pytest.mark.parametrize(("gain", "time_constant", "dead_time", "ts"), PROCESSES)
def test_amplitude_and_period_are_those_of_the_relay_oscillation(gain, time_constant, dead_time, ts, direct):
    """A half cycle is a whole number of samples, at most one more than the continuous one for each threshold."""
    block = manual(mv=50, ts=ts, Direct=direct, PV=50)
    trend = tuned(block, Process(-gain if direct else gain, time_constant, dead_time, ts, 50, 50))
    kp, ti, td = found(block)
    period = td * 6.3
    a, continuous = relay_solution(gain, time_constant, dead_time, 5, 0.1)

    assert flags(block) == set()
    assert continuous - 0.1 * ts <= period <= continuous + 6 * ts
    assert ti / 2.2 == pytest.approx(period, rel=1e-6)
    assert kp == pytest.approx(20 / (math.pi * 5 * gain * math.tanh(period / 4 / time_constant)) / 3.2, rel=0.01)
    assert 4 * 5 / math.pi / 3.2 / kp >= a * 0.999
    step = round(3 / ts)
    assert [mv for mv, _ in trend[: step + 1]] == [50] * step + [45 if direct else 55]


def test_direct_control_finds_the_same_on_the_mirrored_process():
    one, other = manual(mv=50, PV=50), manual(mv=50, Direct=1, PV=50)
    tuned(one, Process(2, 10, 1, 0.1, 50, 50))
    tuned(other, Process(-2, 10, 1, 0.1, 50, 50))

    assert found(one) == found(other)


@pytest.mark.parametrize("cycles", [1, 2, 10])
def test_every_cycle_takes_one_period(cycles):
    block = manual(**param(NumCycles=cycles))
    trend = tuned(block, Process(2, 10, 1, 0.1, 20, 40))
    switches = [n for n in range(1, len(trend)) if trend[n][0] != trend[n - 1][0]]

    assert len(switches) == 3 + 2 * cycles, "t1, the way to t2, and two a cycle"
    assert switches[-1] - switches[2] == pytest.approx(44 * cycles, abs=1)
    assert found(block) == pytest.approx((1.819, 9.68, 0.698), rel=0.03)


def test_noise_within_the_hysteresis_is_averaged():
    rng = random.Random(4)
    process = Process(2, 10, 1, 0.1, 20, 40)
    block = manual(**param(PercHystPV=0.3, NumCycles=10))
    block.set(AutoTune=1)
    while not block["AutoTuneDone"]:
        block.call(PV=process.step(block["MV"]) + rng.uniform(-0.15, 0.15))

    a, period = relay_solution(2, 10, 1, 5, 0.3)
    assert flags(block) == set()
    assert found(block) == pytest.approx(rule(a + 0.15, period), rel=0.15)


# --- measurements by hand --------------------------------------------------------------------------------------------

H = 1.0
"""PercHystPV 1 of a PV range of 100; one sample a second."""


def half(side, length, peak_at, extreme):
    """PVs from a switch to the next one, counted from RefPV: the extreme against the drive, then the threshold."""
    return [side * (-extreme if n == peak_at else H if n == length else -0.5) for n in range(1, length + 1)]


def scripted(*halves, mv=50, **parameters):
    """A block that sees half cycles (length, place of the extreme, extreme) after the first one; its MVs."""
    block = manual(mv=mv, ts=1, PV=50, **{**param(PercHystPV=1, NumCycles=len(halves) // 2), **parameters})
    block.call(4, AutoTune=1)
    assert block.s.tune_phase == RELAY
    pvs = [0.5, H, *half(-1, 3, 1, 2)]
    for n, (length, peak_at, extreme) in enumerate(halves):
        pvs += half(-1 if n % 2 else 1, length, peak_at, extreme)
    return block, [block.call(PV=50 + pv) for pv in pvs]


def test_a_measurement_by_hand():
    block, mvs = scripted((4, 1, 4), (8, 2, 6), **param(PercHystPV=1, NumCycles=1, PercMaxPeakPV=7))

    assert mvs == [55, 45, 45, 45, 55, *[55] * 3, 45, *[45] * 7, 50]
    assert flags(block) == set()
    assert found(block) == pytest.approx(rule(5, 12), rel=1e-6)
    assert (block.s.tune_dead_samples, block.s.tune_count - block.s.tune_start) == (3, 12)


def test_a_dead_time_lasts_until_the_pv_leaves_its_extreme():
    block = manual(ts=1, PV=50, mv=50, **param(PercHystPV=1, NumCycles=1))
    block.call(4, AutoTune=1)
    for away in (1, -1, -5, -5, -5, 1, 5, 4, 5, -1):
        block.call(PV=50 + away)

    assert block.s.tune_dead_samples == 3 + 3
    assert flags(block) == {"CYCLE_TOO_FAST", "HIGH_DEAD_TIME"}


def test_a_pv_that_turns_at_once_has_no_dead_time():
    block = manual(ts=1, PV=50, mv=50, **param(PercHystPV=1, NumCycles=3))
    block.call(4, AutoTune=1)
    for away in (1, -1, 1, -1, 1, -1, 1, -1):
        block.call(PV=50 + away)

    assert block.s.tune_dead_samples == 0
    assert flags(block) == {"PEAK_TOO_LOW", "CYCLE_TOO_FAST"}
    assert found(block) == pytest.approx(rule(1, 2), rel=1e-6)


def test_the_mean_of_all_cycles_counts_and_what_lies_before_them_does_not():
    block, _ = scripted((7, 2, 3), (8, 2, 5), (9, 3, 4), (10, 1, 6))

    assert found(block) == pytest.approx(rule(4.5, 17), rel=1e-6)


RULES = [
    # Mode, Indep: of Ku and Pu
    (P, 0, lambda ku, _: (0.5 * ku, 0, 0)),
    (PI, 0, lambda ku, pu: (ku / 3.2, 2.2 * pu, 0)),
    (PID, 0, lambda ku, pu: (ku / 3.2, 2.2 * pu, pu / 6.3)),
    (P, 1, lambda ku, _: (0.5 * ku, 0, 0)),
    (PI, 1, lambda ku, pu: (ku / 3.2, ku / 3.2 / (2.2 * pu), 0)),
    (PID, 1, lambda ku, pu: (ku / 3.2, ku / 3.2 / (2.2 * pu), ku / 3.2 * pu / 6.3)),
]


@pytest.mark.parametrize(("mode", "indep", "expected"), RULES)
@pytest.mark.parametrize("direct", [0, 1])
def test_the_rule_of_each_mode(mode, indep, expected, direct):
    changes = param(PercHystPV=1, NumCycles=1, Mode=mode)
    block, mvs = scripted((6, 1, 4), (8, 2, 6), Indep=indep, Direct=direct, **changes)

    assert found(block) == pytest.approx(expected(20 / (math.pi * 5), 14), rel=1e-6)
    assert mvs[0] == (45 if direct else 55)
    assert (block["AutoTuneDone"], block["AutoTuneError"]) == (1, 0)


REST = [(0.1, 30), (0.01, 300), (0.3, 10), (0.7, 5), (1.4, 3), (3, 1), (7, 1)]


@pytest.mark.parametrize(("ts", "calls"), REST)
def test_the_pv_is_averaged_over_three_seconds(ts, calls):
    """The mean of the samples before t1; what comes with t1 does not count."""
    block = manual(ts=ts, **param(PercHystPV=1))
    block.set(AutoTune=1)
    pvs = [40 + 0.8 * math.sin(1.7 * n + 0.3) for n in range(calls)]
    for pv in pvs:
        assert block.call(PV=pv) == 20
        assert block.s.tune_phase == AVERAGING
    assert block.call(PV=40.9) == 25
    assert block.s.tune_phase == RELAY
    assert block.s.tune_base == pytest.approx(sum(pvs) / calls, abs=2e-5)


def test_the_thresholds_lie_around_the_mean_and_belong_to_it():
    for pv, mv in ((40.999, 25), (41, 15)):
        block = manual(ts=1, **param(PercHystPV=1))
        block.call(4, AutoTune=1)
        assert block.call(PV=pv) == mv
    assert block.call(PV=39.001) == 15
    assert block.call(PV=39) == 25


# --- flags -----------------------------------------------------------------------------------------------------------

RANGES = [
    ("PercAmpMV", 0.0999, 0.1, 50.1, 50),
    ("PercHystPV", 0.00999, 0.01, 1.001, 1),
    ("PercMaxPeakPV", 0.0999, 0.1, 50.1, 50),
    ("NumCycles", 0, 1, 11, 10),
    ("Mode", -1, 0, 3, 2),
]


@pytest.mark.parametrize(("name", "below", "least", "above", "most"), RANGES)
def test_a_parameter_out_of_range_ends_it_at_once(name, below, least, above, most):
    for value, bad in ((below, True), (least, False), (above, True), (most, False)):
        block = manual(mv=50, **param(**{name: value}))
        block.call(AutoTune=1)
        assert flags(block) == ({f"Bad_{name}"} if bad else set())
        assert block["AutoTuneDone"] == block["AutoTuneError"] == float(bad)
        assert block.s.tune_phase == (FAILED if bad else AVERAGING)
        assert (block["MV"], found(block)) == (50, (0, 0, 0))


def test_all_bad_parameters_are_told_at_once():
    block = manual(**param(PercAmpMV=0, PercHystPV=0, PercMaxPeakPV=0, NumCycles=0, Mode=7))
    block.call(AutoTune=1)

    assert flags(block) == {f"Bad_{name}" for name in PARAM}


STEPS = [(95, set()), (95.01, {"MV_TOO_HIGH"}), (5, set()), (4.99, {"MV_TOO_LOW"})]


@pytest.mark.parametrize("direct", [0, 1])
@pytest.mark.parametrize(("mv", "expected"), STEPS)
def test_the_step_has_to_fit_between_the_limits_of_mv(mv, expected, direct):
    block = manual(mv=mv, Direct=direct)
    block.call(AutoTune=1)
    assert flags(block) == expected


def test_every_flag_that_applies_is_told_and_a_bad_amplitude_makes_no_step():
    block = manual(mv=97, **param(NumCycles=0))
    block.call(AutoTune=1)
    assert flags(block) == {"Bad_NumCycles", "MV_TOO_HIGH"}

    block = manual(mv=97, **param(PercAmpMV=60))
    block.call(AutoTune=1)
    assert flags(block) == {"Bad_PercAmpMV"}


PLACES = [(89, set()), (89.001, {"PV_TOO_HIGH"}), (11, set()), (10.999, {"PV_TOO_LOW"})]


@pytest.mark.parametrize(("pv", "expected"), PLACES)
def test_the_hysteresis_has_to_fit_between_the_limits_of_the_pv(pv, expected):
    """H is 1: the PV may be as close as that to 10 and 90."""
    block = manual(PV=pv, MinPV=-10, MaxPV=90, **param(PercHystPV=1))
    block.call(30, AutoTune=1)
    block.set(MinPV=10)
    assert flags(block) == set()
    block.call()

    assert flags(block) == expected
    assert block["AutoTuneDone"] == float(bool(expected))


def test_the_percentages_are_of_the_ranges():
    """M is 5 % of 200, H 1 % of 140 and S 10 % of it."""
    block = manual(MinMV=-100, MinPV=-40, **param(PercHystPV=1))
    assert block.call(31, AutoTune=1) == 30
    assert (block.call(PV=41.39), block.call(PV=41.41)) == (30, 10)
    assert (block.call(PV=26.01), block.call(PV=25.99)) == (30, 20)
    assert flags(block) == {"PEAK_TOO_HIGH"}


def test_what_just_touches_a_window_is_inside():
    """H is 1 and S is 10 exactly, and so is the mean."""
    block = manual(PV=41, **param(PercHystPV=1))
    block.set(AutoTune=1)
    for n in range(30):
        block.call(PV=39 if n % 2 else 41)
    assert block.call(PV=50) == 25
    assert block.s.tune_base == 40
    assert block.call(PV=50) == 15
    assert block.call(PV=30) == 25
    assert flags(block) == set()


@pytest.mark.parametrize("pv", [40.11, 39.89])
def test_a_pv_that_moves_during_the_three_seconds_is_not_steady(pv):
    for back, expected in ((pv, {"PV_NOT_STEADY"}), (40 + (pv - 40) * 0.8, set())):
        block = manual()
        block.call(20, AutoTune=1, PV=40)
        block.call(PV=back)
        block.call(10, PV=40)
        assert flags(block) == expected
        assert block["AutoTuneError"] == float(bool(expected))


def test_the_steadiness_is_that_around_the_mean():
    """A drift of 0.15 within a window of 0.2 about its mean, though it is more than H away from its beginning."""
    block = manual()
    block.set(AutoTune=1)
    for n in range(31):
        block.call(PV=40 + 0.005 * n)

    assert (flags(block), block.s.tune_phase) == (set(), RELAY)


@pytest.mark.parametrize("side", [1, -1])
def test_a_pv_that_leaves_the_safe_range_aborts(side):
    block = manual()
    block.call(35, AutoTune=1)
    assert block.call(PV=40 + 9.99 * side) in {15, 25}
    assert flags(block) == set()

    assert block.call(PV=40 + 10.01 * side) == 20
    assert flags(block) == {"PEAK_TOO_HIGH"}
    assert (block["AutoTuneDone"], block["AutoTuneError"], block.s.tune_phase) == (1, 1, FAILED)
    assert found(block) == (0, 0, 0)
    assert block.call(10) == 20


def test_a_pv_that_jumps_at_the_end_of_the_three_seconds_aborts_before_the_first_step():
    block = manual()
    block.call(30, AutoTune=1)

    assert block.call(PV=51) == 20
    assert flags(block) == {"PEAK_TOO_HIGH"}


DOUBTS = [
    # half cycles: flags
    (((6, 1, 2), (6, 2, 2)), set()),
    (((6, 1, 1.99), (6, 2, 2)), {"PEAK_TOO_LOW"}),
    (((5, 1, 4), (5, 1, 4)), set()),
    (((5, 1, 4), (4, 1, 4)), {"CYCLE_TOO_FAST"}),
    (((6, 4, 4), (6, 4, 4)), set()),
    (((6, 5, 4), (6, 4, 4)), {"HIGH_DEAD_TIME"}),
    (((4, 3, 1.5), (4, 3, 1.5)), {"PEAK_TOO_LOW", "CYCLE_TOO_FAST", "HIGH_DEAD_TIME"}),
    (((5, 1, 4), (4, 1, 4), (5, 1, 4), (6, 1, 4)), set()),
]


@pytest.mark.parametrize(("halves", "expected"), DOUBTS)
def test_doubtful_results_are_shown_with_an_error(halves, expected):
    block, _ = scripted(*halves)
    a = sum(extreme for *_, extreme in halves) / len(halves)
    period = 2 * sum(length for length, *_ in halves) / len(halves)

    assert flags(block) == expected
    assert (block["AutoTuneDone"], block["AutoTuneError"]) == (1, float(bool(expected)))
    assert found(block) == pytest.approx(rule(a, period), rel=1e-5)
    assert block.s.tune_phase == (FAILED if expected else DONE)


def test_a_process_with_hardly_any_dead_time_cycles_too_fast_with_low_peaks():
    block = manual(**param(PercHystPV=0.3))
    tuned(block, Process(2, 10, 0, 0.1, 20, 40))
    assert flags(block) == {"PEAK_TOO_LOW"}

    block = manual(**param(PercHystPV=0.01))
    tuned(block, Process(2, 10, 0, 0.1, 20, 40))
    assert flags(block) == {"CYCLE_TOO_FAST"}


def test_a_pv_range_that_leaves_no_hysteresis_ends_without_results():
    block = manual(MaxPV=1e-44, PV=0, SP=0)
    block.call(50, AutoTune=1)

    assert (flags(block), found(block)) == ({"PEAK_TOO_LOW"}, (0, 0, 0))


def test_a_process_of_dead_time_alone_has_a_high_dead_time():
    block = manual()
    tuned(block, Process(1, 0, 2, 0.1, 20, 40))

    assert flags(block) == {"HIGH_DEAD_TIME"}


# --- its beginning, its end, and what comes after --------------------------------------------------------------------


@pytest.mark.parametrize(
    "mode", [{"Manual": 1}, {"TRK_IN": 1, "TRK_VAL": 20}, {"OVERR": 1, "TRK_VAL": 20}, {"CASC": 1}]
)
def test_it_has_mv_in_every_mode_and_a_master_is_told(mode):
    block = manual(**{"Manual": 0, **mode, "SP_CASC": 40, "BIAS": 0})
    block.s.out = 20.0
    block.call(31, AutoTune=1, ManualMV=70)

    assert block["MV"] == 25
    assert (block.s.status & MODES, block["TRK_OUT"]) == (TUNING_MODE, 1)
    block.call(PV=41)
    assert block["MV"] == 15


def test_refmv_is_the_mv_of_the_last_call():
    block = manual(mv=33)
    block.call(40, AutoTune=1, ManualMV=50)
    assert block["MV"] == 38


def test_it_starts_with_the_first_call_when_autotune_is_true_from_the_beginning():
    block = Block(MinMV=-50, Manual=1, ManualMV=30, PV=40, AutoTune=1, **param())
    block.call()
    assert (block["MV"], block.s.tune_phase) == (0, AVERAGING)


def ended(in_manual=1):
    """A block whose auto-tuning has just ended well, and its process at about 40."""
    block, process = manual().set(Manual=in_manual), Process(2, 10, 1, 0.1, 20, 40)
    tuned(block, process)
    return block, process


def test_mv_stays_at_refmv_until_autotune_is_reset_then_manual_has_it():
    block, process = ended()
    results = found(block)
    assert {mv for mv, _ in run(block, process, 50, ManualMV=35)} == {20}
    assert (found(block), block.s.tune_phase, block["TRK_OUT"]) == (results, DONE, 1)

    assert block.call(AutoTune=0) == 35
    assert (found(block), flags(block)) == ((0, 0, 0), set())
    assert (block["AutoTuneDone"], block["AutoTuneError"], block.s.tune_phase) == (0, 0, IDLE)
    assert block.s.status & MODES == MANUAL_MODE


def test_control_with_the_new_gains_begins_without_a_bump():
    """The gains are copied in the cycle in which AutoTune is reset, as the manual's code does."""
    block, process = ended(in_manual=0)
    kp, ti, td = found(block)
    pv = process.step(block["MV"])
    assert abs(pv - 40) > 0.1
    ref = block.s.tune_out

    assert block.call(AutoTune=0, Kp=kp, Ti_Ki=ti, Td_Kd=td, PV=pv) == pytest.approx(ref, abs=1e-5)
    assert block.s.status & MODES == AUTO_MODE
    trend = run(block, process, 1500)
    assert abs(trend[0][0] - ref) < 2
    assert trend[-1][1] == pytest.approx(40, abs=0.01)


def test_a_failed_auto_tuning_hands_back_like_one_that_ended():
    block = manual(**param(Mode=9))
    block.call(5, AutoTune=1, ManualMV=44)
    assert block["MV"] == 20
    assert (block["AutoTuneDone"], block["AutoTuneError"]) == (1, 1)
    assert block.call(AutoTune=0) == 44
    assert (flags(block), block["AutoTuneDone"], block["AutoTuneError"]) == (set(), 0, 0)


@pytest.mark.parametrize("calls", [1, 10, 31, 40])
@pytest.mark.parametrize("in_manual", [0, 1])
def test_a_reset_before_the_end_aborts_with_refmv(calls, in_manual):
    block = manual()
    block.call(calls, AutoTune=1, Manual=in_manual, ManualMV=60)
    assert block.call(AutoTune=0, PV=40.05) == 20
    assert (block.s.tune_phase, block["AutoTuneDone"], block["AutoTuneError"]) == (IDLE, 0, 0)
    assert block.s.status & MODES == (MANUAL_MODE if in_manual else AUTO_MODE)

    assert block.call() == (60 if in_manual else pytest.approx(20, abs=0.01))


def test_it_starts_again_only_with_another_edge():
    block, process = ended()
    first = found(block)
    run(block, process, 2000)
    assert block["AutoTuneDone"] == 1

    run(block, process, 1, AutoTune=0)
    tuned(block, process)
    assert found(block) == pytest.approx(first, rel=0.05)


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("calls", [5, 20, 32, 60, 120, 180])
def test_nothing_of_an_aborted_one_is_left(calls, side):
    """Aborted here with a noisy PV, it finds the same in a second run as in a first one."""
    block = manual(**param(PercHystPV=1, NumCycles=9))
    for n in range(calls):
        away = (0.6 if n % 3 else -0.5) + 3 * (n > 35) * (-1) ** (n // 20)
        block.call(AutoTune=1, PV=40 + side * away)
    assert flags(block) == set()
    block.call(AutoTune=0, PV=40)
    block.call(3, **param())
    fresh = manual()

    assert tuned(block, Process(2, 10, 1, 0.1, 20, 40)) == tuned(fresh, Process(2, 10, 1, 0.1, 20, 40))
    assert found(block) == found(fresh)
    assert (flags(block), block.s.tune_dead_samples) == (set(), fresh.s.tune_dead_samples)


def test_error_bits_halt_it():
    block = manual()
    block.call(40, AutoTune=1)
    block.call(25, Tfd=-1)
    assert (block["MV"], block.s.tune_count, block.s.tune_phase) == (25, 9, RELAY)
    block.call(AutoTune=0)
    assert block["MV"] == 25
    assert block.call(Tfd=0) == 20


def test_its_parameters_are_taken_at_the_start():
    block = manual()
    block.call(10, AutoTune=1)
    block.call(21, **param(PercAmpMV=50, PercHystPV=1, PercMaxPeakPV=0.1, NumCycles=99, Mode=9))
    assert block["MV"] == 25
    assert block.call(PV=40.2) == 15
    assert flags(block) == set()


def test_limits_of_mv_that_move_meanwhile_hold():
    block = manual()
    block.call(31, AutoTune=1)
    assert block["MV"] == 25
    assert block.call(MaxMV=22) == 22
    assert block.true("WarnBits.") == {"MV_MaxMV"}
    assert block.call(AutoTune=0, MaxMV=12) == 12


def test_the_other_blocks_have_none():
    block = Block("PIDA_REAL", Manual=1, ManualMV=20, PV=40)
    assert block.signal_values[block.c.base + len(block.places)] != 0.0, "it would be taken for AutoTune"
    block.call(50)

    assert (block["MV"], block.s.tune_phase, block.s.status) == (20, IDLE, MANUAL_MODE)


def test_an_int_block_tunes_in_field_units():
    """The worked example on 0 to 30000 counts."""
    counts = 300
    ranges = {"MaxMV": 30000, "MaxPV": 30000, "SP": 40 * counts, "PV": 40 * counts}
    block = manual("PIDA_TUNE_INT", mv=20 * counts, **ranges)
    process = Process(2, 10, 1, 0.1, 20 * counts, 40 * counts)
    block.set(AutoTune=1)
    mvs = set()
    while not block["AutoTuneDone"]:
        mvs.add(block.call(PV=round(process.step(block["MV"]))))

    assert mvs == {6000, 7500, 4500}
    assert flags(block) == set()
    assert found(block) == pytest.approx(rule(*relay_solution(2, 10, 1, 5, 0.1)), rel=0.055)


@pytest.mark.parametrize(("percentage", "step"), [(0.6, 1), (1.4, 1), (1.6, 2), (2.5, 2), (3.5, 4), (50, 50)])
def test_an_int_block_calculates_with_the_step_that_it_makes(percentage, step):
    """On 0 to 100 a step is its percentage, rounded half to even; Ku is that of the MV that the process has seen."""
    changes = param(PercHystPV=1, NumCycles=1, Mode=P, PercAmpMV=percentage)
    block = manual("PIDA_TUNE_INT", mv=50, ts=1, PV=50, **changes)
    block.call(4, AutoTune=1)
    mvs = [block.call(PV=50 + pv) for pv in (1, *half(-1, 3, 1, 2), *half(1, 6, 1, 4), *half(-1, 8, 2, 6))]

    assert set(mvs[:-1]) == {50 - step, 50 + step}
    assert flags(block) == set()
    assert found(block) == pytest.approx((0.5 * 4 * step / (math.pi * 5), 0, 0), rel=1e-6)


@pytest.mark.parametrize(("mode", "form"), [(P, "P"), (PI, "PI"), (PID, "PID")])
def test_the_rule_is_that_of_the_tuning_method(mode, form):
    block, _ = scripted((6, 1, 4), (8, 2, 6), **param(PercHystPV=1, NumCycles=1, Mode=mode))
    gains = METHODS["nextopid-autotune"].of_ultimate(form, Cycle(20 / (math.pi * 5), 14))
    ti = 0 if math.isinf(gains.integral_time) else gains.integral_time

    assert found(block) == pytest.approx((gains.gain, ti, gains.derivative_time), rel=1e-6)


def test_an_int_block_checks_the_step_that_it_makes():
    for kind, mv, percentage, expected in (
        ("PIDA_TUNE_INT", 95, 5.4, set()),
        ("PIDA_TUNE_REAL", 95, 5.4, {"MV_TOO_HIGH"}),
        ("PIDA_TUNE_INT", 95, 5.6, {"MV_TOO_HIGH"}),
        ("PIDA_TUNE_INT", 50, 0.5, {"Bad_PercAmpMV"}),
        ("PIDA_TUNE_REAL", 50, 0.5, set()),
    ):
        block = manual(kind, mv=mv, **param(PercAmpMV=percentage))
        block.call(AutoTune=1)
        assert flags(block) == expected
        assert block["AutoTuneError"] == float(bool(expected))


# --- whatever comes --------------------------------------------------------------------------------------------------


PERCENTAGES = {"PercAmpMV": 60, "PercHystPV": 1.5, "PercMaxPeakPV": 60}
TUNINGS = st.fixed_dictionaries(
    {
        **{name: st.floats(0, most, width=32) for name, most in PERCENTAGES.items()},
        "NumCycles": st.integers(0, 3),
        "Mode": st.integers(0, 3),
    }
)
PVS = st.lists(st.floats(-20, 120, width=32), min_size=1, max_size=60)


@settings(max_examples=150, deadline=None)
@given(pvs=PVS, tuning=TUNINGS, direct=st.integers(0, 1), stop=st.integers(0, 80), whole=st.booleans())
def test_mv_has_three_values_and_errors_have_flags(pvs, tuning, direct, stop, whole):
    block = manual(f"PIDA_TUNE_{'INT' if whole else 'REAL'}", mv=50, ts=1, Direct=direct, **param(**tuning))
    m = single(tuning["PercAmpMV"])
    block.set(AutoTune=1)
    for n, pv in enumerate(pvs):
        block.call(PV=pv, AutoTune=n < stop)
        assert any(abs(block["MV"] - mv) <= 0.5 * whole for mv in (50, single(50 + m), single(50 - m)))
        assert 0 <= block["MV"] <= 100
        assert (block.s.tune_phase >= DONE) == (block["AutoTuneDone"] == 1)
        assert (block["AutoTuneError"] == 1) == bool(flags(block)) == (block.s.tune_phase == FAILED)
        assert all(math.isfinite(x) and x >= 0 for x in found(block))
