"""The equation of DPIDE against textbook formulas, a continuous simulation, NumPy's single precision and the manual."""

from __future__ import annotations

import itertools
import math
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dpide_rig import Rig, program_of
from pidcfg.sim.controllers.dpide.plc import load
from pidcfg.sim.controllers.kernels import single
from rig_plants import FirstOrder

WIDE = {"MV_MAX": 1e6, "MV_MIN": -1e6}
KINDS = list(itertools.product((False, True), repeat=3))
"""PID_EQ, PID_DE, PID_DIR."""
NAMES = ("PID_EQ", "PID_DE", "PID_DIR")


# --- the formulas ----------------------------------------------------------------------------------------------------


def textbook(kind, pvs, sv, kc, ti, td, tf, bias, ts):  # noqa: PLR0917 - the letters of the formula
    """MV after each sample, in double precision and in the words of the manual."""
    dependent, of_pv, forward = kind
    kp, ki, kd = (kc, kc / ti, kc * td) if dependent else (kc, ti, td)
    integral = y = 0.0
    past = None
    found = []
    for pv in pvs:
        e = sv - pv if forward else pv - sv
        e1, pv1 = past or (e, pv)
        past = e, pv
        integral += e * ts
        rate = (e - e1) / ts
        if of_pv:
            rate = -(pv - pv1) / ts if forward else (pv - pv1) / ts
        y += (rate - y) * ts / (tf + ts)
        found.append(kp * e + ki * integral + kd * y + bias)
    return found


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("tf", [0.0, 0.7])
def test_every_form_is_the_textbooks(kind, tf):
    rng = random.Random(f"{kind}")
    pvs = [rng.uniform(10, 30) for _ in range(60)]
    numbers = {"Kc_Kp": 2.5, "Ti_Ki": 4.0, "Td_Kd": 0.3, "Tf": tf, "BIAS": 7.25, "SV": 21.5}
    rig = Rig({**WIDE, **numbers, **dict(zip(NAMES, kind, strict=True))})
    found = rig.play(pvs, "MV")

    assert found == pytest.approx(textbook(kind, pvs, 21.5, 2.5, 4.0, 0.3, tf, 7.25, 0.1), rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("kind", KINDS)
def test_a_step_of_sv_kicks_only_the_derivative_of_the_error(kind):
    """P alone moves by 2.5 x 4; the derivative of E adds 0.5 x 4 / 0.1, times Kc in the dependent form."""
    dependent, of_pv, forward = kind
    rig = Rig({**WIDE, "Kc_Kp": 2.5, "Td_Kd": 0.5, **dict(zip(NAMES, kind, strict=True))})
    before = rig.play([10.0, 10.0], "MV")[-1]
    rig.set("SV", 4)
    after, later = rig.play([10.0, 10.0], "MV")
    sign = 1.0 if forward else -1.0

    kick = 0.0 if of_pv else 0.5 * 4 / 0.1 * (2.5 if dependent else 1.0)
    assert after - before == pytest.approx(sign * (10.0 + kick), rel=1e-5)
    assert later - before == pytest.approx(sign * 10.0, rel=1e-5)


def test_the_printed_signs_of_the_derivative_of_pv():
    """A rising PV is braked: MV falls in forward action, and rises in reverse action."""
    for forward, sign in ((True, -1.0), (False, 1.0)):
        rig = Rig({**WIDE, "Kc_Kp": 0, "Td_Kd": 2, "PID_DE": True, "PID_DIR": forward})
        assert rig.play([5.0, 6.0, 6.0], "MV") == pytest.approx([0.0, sign * 20.0, 0.0], rel=1e-5)


def test_the_first_calculation_has_no_derivative():
    rig = Rig({**WIDE, "Kc_Kp": 0, "Td_Kd": 3, "SV": 50})

    assert rig.play([20.0, 20.5], "MV") == pytest.approx([0.0, -15.0], rel=1e-5)


def test_an_independent_gain_of_0_takes_p_out_alone():
    rig = Rig({**WIDE, "Kc_Kp": 0, "Ti_Ki": 0.5, "SV": 10})

    assert rig.play([0.0] * 3, "MV") == pytest.approx([0.5, 1.0, 1.5], rel=1e-6)


def test_a_dependent_gain_of_0_leaves_the_bias():
    rig = Rig({**WIDE, "Kc_Kp": 0, "Ti_Ki": 0.5, "Td_Kd": 4, "SV": 10, "BIAS": 3, "PID_EQ": True})

    assert rig.play([0.0, 5.0, 9.0], "MV") == [3.0] * 3


@pytest.mark.parametrize("name", ["Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"])
@pytest.mark.parametrize("dependent", [False, True])
def test_a_coefficient_below_0_counts_as_0(name, dependent):
    numbers = {"Kc_Kp": 2, "Ti_Ki": 3, "Td_Kd": 1, "Tf": 0.5, "SV": 10, "PID_EQ": dependent}
    pvs = [1.0, 2.0, 4.0, 3.0]
    rigs = [Rig({**WIDE, **numbers, name: value}) for value in (-5, 0)]
    below, none, plain = (rig.play(pvs, "MV") for rig in (*rigs, Rig({**WIDE, **numbers})))

    assert below == none != plain


def test_without_ti_ki_i_mv_becomes_0():
    rig = Rig({**WIDE, "Ti_Ki": 2, "SV": 10})
    rig.play([0.0] * 3, "MV")
    assert rig.signal("I_MV") == pytest.approx(6.0)
    rig.set("Ti_Ki", 0)
    assert rig.play([0.0], "MV", "I_MV") == [(10.0, 0.0)]
    rig.set("Ti_Ki", 2)
    assert rig.play([0.0], "I_MV") == pytest.approx([2.0])


@pytest.mark.parametrize("mode", [0, 2])
def test_without_ti_ki_i_mv_becomes_0_beyond_the_limits_too(mode):
    rig = Rig({"SV": 10, "MV_MAX": 5, "I_MV": 7, "PID_MODE": mode})

    assert rig.play([0.0], "MV", "I_MV") == [(5.0, 0.0)]


def test_i_mv_is_in_units_of_mv_and_a_new_gain_does_not_rescale_it():
    rig = Rig({**WIDE, "Kc_Kp": 3, "Ti_Ki": 6, "SV": 10, "PID_EQ": True})
    assert rig.play([0.0] * 4, "I_MV") == pytest.approx([0.5, 1.0, 1.5, 2.0])
    rig.set("Kc_Kp", 12)
    assert rig.play([0.0], "I_MV") == pytest.approx([4.0])


def test_what_is_below_the_last_digit_of_i_mv_is_lost():
    """At 2^24 the last digit is 2: steps of 1 are rounded to even, that is away."""
    rig = Rig({"MV_MAX": 1e9, "MV_MIN": 0, "Kc_Kp": 0, "Ti_Ki": 10, "SV": 1, "I_MV": 16777216})

    assert rig.play([0.0] * 5, "I_MV") == [16777216.0] * 5


# --- limits and sampling time ----------------------------------------------------------------------------------------


def test_swapped_limits_are_swapped_back():
    rig = Rig({"MV_MAX": -20, "MV_MIN": 60, "SV": 0})

    assert rig.play([-500.0, 500.0, -30.0], "MV") == [60.0, -20.0, 30.0]


@pytest.mark.parametrize(
    ("cycle", "ticks"), [(-3, 1000), (0, 1000), (1, 1000), (40000, 40_000_000), (40001, 40_000_000), (250, 250_000)]
)
def test_cycle_counts_as_1_to_40000_ms(cycle, ticks):
    assert load(program_of({"CYCLE": cycle})).periods == [ticks]


def test_an_interrupt_task_has_its_own_sampling_time():
    plc = load(program_of({"CYCLE": 100}, {"CYCLE": 3000}, plc={"interrupt_task": 20}))

    assert (plc.periods, plc.base) == ([20_000, 20_000], 20_000)
    assert plc.st[0].sampling_time == single(0.02)
    assert plc.period_set(0, ("CYCLE",), 500) == 0
    effect = plc.set(0, ("CYCLE",), 500, plc.sig)
    assert effect == "has no effect: the interval of the interrupt task is the sampling time"
    assert plc.periods == [20_000, 20_000]


def test_mv_is_refreshed_once_in_a_sampling_time():
    rig = Rig({**WIDE, "CYCLE": 300, "SV": 100})

    assert rig.play([float(k) for k in range(7)], "MV") == [100.0] * 3 + [97.0] * 3 + [94.0]


def test_calculations_come_with_the_next_base_step_and_keep_their_times():
    """Due at 0, 0.2, 0.4, 0.6 and 0.8 s; steps are 0.15 s."""
    rig = Rig({**WIDE, "CYCLE": 200}, base=0.15)

    assert rig.play([-float(k) for k in range(8)], "MV") == [0.0, 0.0, 2.0, 3.0, 4.0, 4.0, 6.0, 7.0]


def test_steps_that_are_too_long_are_not_made_up_for():
    rig = Rig({**WIDE, "CYCLE": 100}, base=0.2)

    assert rig.play([-1.0, -2.0, -3.0], "MV") == [1.0, 2.0, 3.0]
    assert rig.st[0].due == 500_000


# --- the dead band ---------------------------------------------------------------------------------------------------


def test_the_manuals_trend_of_a_and_b():
    """Normal until PV crosses SV inside the band (A), then 0 until PV leaves it (B), and so on; 5 is outside."""
    pvs = [40, 46, 49, 51, 54, 49, 46, 54, 55, 54, 52, 49, 47, 51, 44, 46, 53]
    error = [10, 4, 1, 0, 0, 0, 0, 0, -5, -4, -2, 0, 0, 0, 6, 4, 0]
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": 5})

    assert rig.play([float(pv) for pv in pvs], "E") == [float(e) for e in error]
    assert rig.signal("MV") == 0.0


def test_in_b_nothing_is_added_to_i_mv():
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": 5, "Ti_Ki": 1})

    found = rig.play([46.0, 49.0, 52.0, 54.0, 58.0], "I_MV")
    assert found == pytest.approx([0.4, 0.5, 0.5, 0.5, -0.3])


def test_the_derivative_of_the_error_kicks_into_b_and_out_of_it():
    rig = Rig({**WIDE, "Kc_Kp": 0, "Td_Kd": 1, "SV": 50, "ERR_DBW": 5})

    found = rig.play([48.0, 49.0, 51.0, 53.0, 56.0, 56.0], "MV")
    assert found == pytest.approx([0, -10, -10, 0, -60, 0], rel=1e-5)


def test_the_derivative_of_pv_counts_no_change_in_b_and_the_real_one_on_leaving():
    rig = Rig({**WIDE, "Kc_Kp": 0, "Td_Kd": 1, "SV": 50, "ERR_DBW": 5, "PID_DE": True})

    found = rig.play([48.0, 49.0, 51.0, 53.0, 56.0, 56.0], "MV")
    assert found == pytest.approx([0, -10, 0, 0, -30, 0], rel=1e-5)


@pytest.mark.parametrize("width", [-5, 5])
@pytest.mark.parametrize("forward", [False, True])
def test_the_absolute_value_counts_in_both_directions(width, forward):
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": width, "PID_DIR": forward})
    sign = 1.0 if forward else -1.0

    assert rig.play([46.0, 54.0, 46.0, 45.0], "E") == [sign * 4.0, 0.0, 0.0, sign * 5.0]


def test_a_pv_that_jumps_over_the_band_has_not_crossed_inside():
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": 5})

    assert rig.play([40.0, 60.0, 54.0, 52.0], "E") == [10.0, -10.0, -4.0, -2.0]


def test_a_pv_that_only_touches_sv_has_not_crossed():
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": 5})

    assert rig.play([48.0, 50.0, 49.0, 50.0, 51.0], "E") == [2.0, 0.0, 1.0, 0.0, 0.0]
    assert rig.play([52.0], "E") == [0.0]
    above = Rig({**WIDE, "SV": 50, "ERR_DBW": 5})
    assert above.play([52.0, 50.0, 51.0, 50.0, 49.0], "E") == [-2.0, 0.0, -1.0, 0.0, 0.0]


def test_a_width_of_0_is_none():
    rig = Rig({**WIDE, "SV": 50, "ERR_DBW": 0})

    assert rig.play([49.0, 51.0, 49.0], "E") == [1.0, -1.0, 1.0]


def test_the_report_tells_of_the_dead_band_and_of_the_limits():
    rig = Rig({"SV": 50, "ERR_DBW": 5})
    seen = []
    for pv in (49.0, 51.0, 56.0, -90.0, 20.0):
        rig.play([pv], "E")
        seen.append([name for name, bit in rig.plc.flag_bits.items() if rig.st[0].status & bit])

    assert seen == [[], ["in_dead_band"], ["mv_limited"], ["mv_limited"], []]


# --- single precision ------------------------------------------------------------------------------------------------


class Native:
    """The same equation in NumPy's single precision, written anew."""

    def __init__(self, operands, ts):
        self.f = f = pytest.importorskip("numpy").float32
        self.n = {k: f(v) if isinstance(v, float) else v for k, v in operands.items()}
        self.ts = f(ts)
        self.integral, self.y, self.past = f(0), f(0), None

    def step(self, pv):
        n, f = self.n, self.f
        pv = f(pv)
        e = n["SV"] - pv if n["PID_DIR"] else pv - n["SV"]
        e1, pv1 = self.past or (e, pv)
        self.past = e, pv
        kp, kd = n["Kc_Kp"], n["Td_Kd"]
        ki = n["Ti_Ki"] * self.ts
        if n["PID_EQ"]:
            ki, kd = kp * self.ts / n["Ti_Ki"], kp * n["Td_Kd"]
        change = e - e1
        if n["PID_DE"]:
            change = pv1 - pv if n["PID_DIR"] else pv - pv1
        x = change / self.ts
        lag = self.ts / (n["Tf"] + self.ts)
        self.y = self.y + lag * (x - self.y) if n["Tf"] else x
        p, d = kp * e, kd * self.y
        total = self.integral + ki * e
        mv = p + total + d + n["BIAS"]
        out = min(max(mv, n["MV_MIN"]), n["MV_MAX"])
        assert type(out) is f
        if out == mv:
            self.integral = total
        elif n["PID_MODE"] == 2:
            self.integral = out - p - d - n["BIAS"]
        return float(out), float(self.integral)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [0, 2])
def test_every_operation_is_that_of_single_precision(kind, mode):
    rng = random.Random(f"{kind}{mode}")
    limited = 0
    for _ in range(20):
        operands = {
            "SV": rng.uniform(-9, 90),
            "Kc_Kp": rng.uniform(0.01, 9),
            "Ti_Ki": rng.uniform(0.01, 30),
            "Td_Kd": rng.choice([0.0, rng.uniform(0, 3)]),
            "Tf": rng.choice([0.0, rng.uniform(0, 2)]),
            "BIAS": rng.uniform(-5, 5),
            "MV_MIN": rng.uniform(-30, 0),
            "MV_MAX": rng.uniform(50, 200),
            "PID_MODE": mode,
            **dict(zip(NAMES, kind, strict=True)),
        }
        rig, native = Rig({**operands, "CYCLE": 330}, base=0.33), Native(operands, 0.33)
        pv = operands["SV"]
        for _ in range(100):
            pv += rng.uniform(-4, 4)
            expected = native.step(pv)
            assert rig.play([pv], "MV", "I_MV") == [expected]
            limited += expected[0] in {rig.cfg[0].lowest_mv, rig.cfg[0].highest_mv}

    assert limited > 50


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [0, 2])
def test_values_beyond_single_precision_do_no_harm(kind, mode):
    wild = [1e39, -1e39, math.inf, -math.inf, math.nan, 3e38, -3e38, 0.0]
    rng = random.Random(5)
    rig = Rig(
        {
            "Kc_Kp": 3e38,
            "Ti_Ki": 1e-30,
            "Td_Kd": 3e38,
            "PID_MODE": mode,
            "SV": 1e38,
            "BIAS": -3e38,
            "Tf": 1,
            **dict(zip(NAMES, kind, strict=True)),
        }
    )
    for _ in range(200):
        rig.play([rng.choice(wild)], "MV")
        assert all(map(math.isfinite, rig.sig[1:]))
        assert 0.0 <= rig.signal("MV") <= 100.0


def test_a_calculation_without_a_result_leaves_mv_as_it_is():
    """P and D are infinite with opposite signs; limits still hold."""
    rig = Rig({"Kc_Kp": 1e38, "SV": 5, "Td_Kd": 1e38, "PID_DE": True})
    assert rig.play([-2e6], "MV") == [100.0]
    rig.set("MV_MAX", 200)
    assert rig.play([-1e6], "MV") == [100.0]
    assert rig.play([-1e6], "MV") == [200.0], "it has no past then"
    rig.set("MV_MAX", 90)
    assert rig.play([-5e5, -4e5], "MV") == [90.0, 90.0]


def test_what_is_no_measurement_leaves_mv_and_i_mv_as_they_are():
    rig = Rig({"Ti_Ki": 1, "Td_Kd": 3, "SV": 5, "PID_MODE": 2})
    before = rig.play([1.0], "MV", "I_MV")

    assert rig.play([math.nan] * 2, "MV", "I_MV") == before * 2
    assert rig.play([math.nan], "PV", "E") == [(0.0, 0.0)]
    assert rig.play([1.0], "I_MV") == pytest.approx([0.8])


# --- closed loops ----------------------------------------------------------------------------------------------------


def continuous(kind, gain, kc, ti, td, tf):
    """PV each ms of dPV/dt = gain MV - PV under the continuous law; SV 1, from 1.5 s on 2 (Runge-Kutta)."""
    dependent, of_pv, forward = kind
    kp, ki, kd = (kc, kc / ti, kc * td) if dependent else (kc, ti, td)
    sign = 1.0 if forward else -1.0

    def slope(x, sv):
        pv, integral, z = x
        e = sign * (sv - pv)
        mv = kp * e + ki * integral + kd * z
        rise = gain * mv - pv
        return rise, e, (-sign * rise - z) / tf

    x, h, found = (0.0, 0.0, 0.0), 0.001, []
    for k in range(4000):
        sv = 1.0 if k < 1500 else 2.0
        if k == 1500 and not of_pv:
            x = (x[0], x[1], x[2] + sign * 1.0 / tf)
        found.append(x[0])
        a = slope(x, sv)
        b = slope(tuple(v + h / 2 * d for v, d in zip(x, a, strict=True)), sv)
        c = slope(tuple(v + h / 2 * d for v, d in zip(x, b, strict=True)), sv)
        e = slope(tuple(v + h * d for v, d in zip(x, c, strict=True)), sv)
        x = tuple(v + h / 6 * (p + 2 * q + 2 * r + w) for v, p, q, r, w in zip(x, a, b, c, e, strict=True))
    return found


@pytest.mark.parametrize("kind", KINDS)
def test_a_fast_loop_is_the_continuous_one(kind):
    """Within 0.5 % of the step, with the form, derivative and direction of each kind."""
    numbers = (
        {"Kc_Kp": 3.0, "Ti_Ki": 0.8, "Td_Kd": 0.05, "Tf": 0.1}
        if kind[0]
        else {"Kc_Kp": 3.0, "Ti_Ki": 4.0, "Td_Kd": 0.15, "Tf": 0.1}
    )
    gain = 1.0 if kind[2] else -1.0
    operands = {**WIDE, **numbers, **dict(zip(NAMES, kind, strict=True)), "CYCLE": 1, "SV": 1}
    rig = Rig(operands, plants=[FirstOrder(gain, 1.0)], base=0.001)
    found = rig.trace(1500, "PV")
    rig.set("SV", 2)
    found += rig.trace(2500, "PV")
    exact = continuous(kind, gain, *numbers.values())

    worst = max(abs(a - b) for a, b in zip(found, exact, strict=True))
    assert worst <= 0.005
    assert max(exact) > 1.9


@pytest.mark.parametrize(("kp", "overshoots"), [(5, False), (10, False), (20, False), (40, True)])
def test_the_manuals_example_of_tuning_kp(kp, overshoots):
    """1/(s + 1), every 10 ms, PV converted one sample late: only 40 overshoots, and 5 is the slowest."""
    rig = Rig(
        {"MV_MAX": 1000, "MV_MIN": -1000, "Kc_Kp": kp, "SV": 1, "CYCLE": 10},
        plants=[FirstOrder(1.0, 1.0, 0.01)],
        base=0.01,
    )
    rows = rig.trace(101, "PV", "MV")
    pvs = [pv for pv, _ in rows]

    assert rows[0] == (0.0, float(kp)), "the transient MV is big where Kp is"
    assert (max(pvs) > pvs[-1] * 1.01) == overshoots
    assert pvs[-1] == pytest.approx(kp / (kp + 1.0), rel=0.01)
    assert (pvs[20] < 0.75) == (kp == 5)


def test_the_manuals_final_tuning_brings_pv_to_sv():
    rig = Rig(
        {"MV_MAX": 1000, "MV_MIN": -1000, "Kc_Kp": 10, "Ti_Ki": 8, "Td_Kd": 0.2, "SV": 1, "CYCLE": 10},
        plants=[FirstOrder(1.0, 1.0, 0.01)],
        base=0.01,
    )
    pvs = rig.trace(1001, "PV")

    assert max(pvs) < 1.05
    assert 0.93 < pvs[100] < 1.0
    assert pvs[-1] == pytest.approx(1.0, abs=0.001)


def test_a_wrong_direction_runs_away():
    for forward, end in ((True, 50.0), (False, 0.0)):
        operands = {"SV": 50, "Kc_Kp": 2, "Ti_Ki": 1, "PID_DIR": forward}
        rig = Rig(operands, plants=[FirstOrder(1.0, 5.0, initial=40.0)])
        rig.run(100)
        assert rig.signal("PV") == pytest.approx(end, abs=0.1)


@settings(max_examples=60, deadline=None)
@given(
    low=st.floats(-1e3, 1e3, width=32),
    high=st.floats(-1e3, 1e3, width=32),
    gains=st.tuples(*[st.floats(0, 1e3, width=32)] * 4),
    kind=st.sampled_from(KINDS),
    mode=st.sampled_from([0, 2]),
    band=st.floats(-9, 9, width=32),
    pvs=st.lists(st.floats(-1e4, 1e4), min_size=8, max_size=20),
    bias=st.floats(-500, 500, width=32),
    events=st.lists(
        st.sampled_from(
            [("PID_MAN", True), ("PID_MAN", False), ("MOUT", 5e4), ("MOUT", -7), ("SV", 3), ("MOUT_AUTO", True)]
        )
    ),
)
def test_mv_stays_within_its_limits(low, high, gains, kind, mode, band, pvs, bias, events):  # noqa: PLR0917 - drawn by name
    operands = dict(zip(("Kc_Kp", "Ti_Ki", "Td_Kd", "Tf"), gains, strict=True)) | dict(zip(NAMES, kind, strict=True))
    rig = Rig({**operands, "MV_MIN": low, "MV_MAX": high, "PID_MODE": mode, "ERR_DBW": band, "BIAS": bias})
    for i, pv in enumerate(pvs):
        if i < len(events):
            rig.set(*events[i])
        (mv,) = rig.play([pv], "MV")
        assert min(low, high) <= mv <= max(low, high)
