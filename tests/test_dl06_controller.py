"""The PID equation of the virtual DL06: closed forms, symmetry, what the words make of it, and the band of alarms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dl06_rig import Rig
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.equation import (
    ALARMS,
    PV_ALARMS,
    Config,
    State,
    calculate_error,
    calculate_gains,
    calculate_output,
    calculate_position,
    calculate_velocity,
)
from pidcfg.sim.controllers.dl06.operate import ALARM_BITS
from pidcfg.sim.controllers.dl06.scan import scan
from rig_plants import FirstOrder, Fixed

TS = 0.05


def one(**fields):
    """The equation alone: a configuration, a state and its factors."""
    c = Config(**{k: v for k, v in fields.items() if k in Config.__dataclass_fields__})
    s = State(**{k: v for k, v in fields.items() if k in State.__dataclass_fields__})
    calculate_gains(c, s)
    return c, s


def test_p_only_on_a_first_order_plant_follows_the_closed_form():
    """y(n+1) = a y(n) + (1 - a) K Kc (r - y(n)) is geometric: y(n) = y∞ + (y0 - y∞) q^n, with nothing rounded."""
    c, s = one(gain=2.0)
    a, gain, target, y0 = math.exp(-0.05), 0.8, 0.5, 0.1
    q = a - (1 - a) * gain * 2.0
    final = gain * 2.0 * target / (1 + gain * 2.0)
    y = y0
    for n in range(1, 200):
        m = calculate_position(c, s, target - y, 0.0) / c.out_span
        y = a * y + (1 - a) * gain * m
        assert y == pytest.approx(final + (y0 - final) * q**n, abs=1e-12)


def test_p_only_words_stay_within_a_count_of_the_closed_form():
    rig = Rig(base=TS)
    plant = FirstOrder(gain=0.8, time_constant=1.0, initial=400.0)
    _, s = rig.add(plant, sp=2000.0, gain=2.0, bumpless=2, mode="auto")
    a = math.exp(-TS)
    q = a - (1 - a) * 1.6
    final = 1.6 * 2000.0 / 2.6
    rig.step()
    for n in range(1, 200):
        rig.step()
        # the PV is rounded by half a count, the output by half a count: at most Kc/2 + 1/2 of output each sample
        assert abs(plant.value - (final + (400.0 - final) * q**n)) <= 0.8 * 1.5 * (1 - a) / (1 - abs(q)) + 1e-9
    assert s.out == round(2.0 * (2000.0 - s.pv))


@pytest.mark.parametrize("change", [-2.0, -0.5, -1e-9, 0.0, 1e-9, 0.5, 2.0])
@pytest.mark.parametrize("out", [100.0, 100.5, 500.0, 899.5, 900.0])
def test_a_frozen_bias_goes_only_away_from_the_limit_where_the_output_stands(out, change):
    c, s = one(bias_freeze=1, out_min=100.0, out_max=900.0)
    s.bias, s.out, s.ki = 400.0, out, 1.0
    calculate_position(c, s, change, 0.0)
    is_frozen = (out == 900.0 and change > 0.0) or (out == 100.0 and change < 0.0)
    assert s.bias == (400.0 if is_frozen else 400.0 + change)


def test_a_derivative_gain_limit_of_zero_takes_the_derivative_out():
    _, s = one(gain=1.0, rate=2.0, gain_limit_on=1, gain_limit=0.0)

    assert s.kd == 0.0


@pytest.mark.parametrize("action", [0, 1])
def test_velocity_form_is_the_difference_of_the_position_form(action):
    fields = {"gain": 1.7, "reset": 12.0, "rate": 0.8, "reverse": action, "out_min": -1e9, "out_max": 1e9}
    c, s = one(**fields, gain_limit_on=1, gain_limit=8.0)
    c2, v = one(**fields, gain_limit_on=1, gain_limit=8.0, velocity=1)
    errors = [0.01 * math.sin(0.3 * n) + 0.002 * n for n in range(60)]
    for state in (s, v):
        state.previous_error = state.derivative_input_1 = state.derivative_input_2 = errors[0]
    before = calculate_position(c, s, errors[0], errors[0])
    v.unrounded_output = before
    for e in errors[1:]:
        m, v.unrounded_output = calculate_position(c, s, e, e), calculate_velocity(v, e, e)
        assert v.unrounded_output == pytest.approx(m, abs=1e-8)
    assert c2.velocity == 1


def test_terms_are_added_up_in_the_order_in_which_they_are_printed():
    """0.2 + 0.3 + 0.1 is 0.6 (D678); 0.1 + 0.2 + 0.3 would be 0.6000000000000001."""
    c, s = one()
    s.kp, s.kd, s.bias = 2.0, 3.0, 0.1
    assert calculate_position(c, s, 0.1, 0.1) == 0.6
    _, v = one()
    v.kp, v.ki, v.unrounded_output = 2.0, 3.0, 0.1
    assert calculate_velocity(v, 0.1, 0.1) == 0.6


def test_without_a_limit_the_derivative_remembers_its_signal_as_it_is():
    """-0.9 + (-0.3 + 0.9) would not be -0.3 (D678)."""
    c, s = one()
    s.kd, s.derivative_input_1 = 1.0, -0.9
    calculate_position(c, s, -0.3, -0.3)
    assert s.derivative_input_1 == -0.3


def test_reverse_action_mirrors_direct_action_on_a_mirrored_plant():
    """Outputs M and M' = 2 M0 - M on plants of opposite gain give the same PV and the same error."""
    rows = {}
    for reverse in (0, 1):
        rig = Rig(base=0.1)
        sign = -1.0 if reverse else 1.0
        rig.add(
            FirstOrder(gain=sign, time_constant=5.0, initial=1500.0, offset=1500.0 - sign * 2000.0),
            sp=1600.0,
            gain=2.5,
            reset=8.0,
            rate=0.5,
            reverse=reverse,
            out=2000.0,
            bumpless=2,
            mode="auto",
        )
        rows[reverse] = rig.trace(300, "pv", "out", "bias")

    assert [pv for pv, _, _ in rows[0]] == [pv for pv, _, _ in rows[1]]
    assert [out - 2000.0 for _, out, _ in rows[0]] == [2000.0 - out for _, out, _ in rows[1]]
    assert {out for _, out, _ in rows[0]} != {2000.0}


def test_error_squared_keeps_the_sign():
    c = Config(squared=1)

    assert calculate_error(c, 3000.0, 2000.0) == pytest.approx((1000 / 4095) ** 2)
    assert calculate_error(c, 2000.0, 3000.0) == pytest.approx(-((1000 / 4095) ** 2))


@pytest.mark.parametrize(("distance", "inside"), [(20.0, True), (-20.0, True), (21.0, False), (-21.0, False)])
def test_inside_the_deadband_there_is_no_error_and_outside_it_is_whole(distance, inside):
    c = Config(deadband=20.0 / 4095.0)

    assert calculate_error(c, 2000.0 + distance, 2000.0) == (0.0 if inside else pytest.approx(distance / 4095.0))


def test_the_square_comes_before_the_deadband():
    """0.1 squared is 0.01: inside a deadband of 0.02 although the error itself is outside."""
    c = Config(squared=1, deadband=0.02)

    assert calculate_error(c, 2409.5, 2000.0) == 0.0
    assert calculate_error(c, 3000.0, 2000.0) == pytest.approx((1000 / 4095) ** 2)


def test_square_root_extract_compares_the_set_point_with_the_root_of_the_pv():
    """The manual: the loop drives the output so that the square root of the PV equals SP; full scale is sqrt(4095)."""
    c = Config(square_root=1, span=math.sqrt(4095.0))

    assert calculate_error(c, 32.0, 1024.0) == 0.0
    assert calculate_error(c, math.sqrt(4095.0), 0.0) == pytest.approx(1.0)
    assert calculate_error(c, 1.0, -5.0) == calculate_error(c, 1.0, 0.0)


def test_a_root_loop_settles_where_the_root_of_the_pv_is_the_set_point_word():
    rig = Rig(base=0.1)
    _, s = rig.add(
        FirstOrder(1.0, 2.0, initial=400.0),
        sp=40.0,
        out=400.0,
        square_root=1,
        span=math.sqrt(4095.0),
        gain=0.5,
        reset=2.0,
        bumpless=2,
        mode="auto",
    )
    rig.run(120)

    assert math.isqrt(round(s.pv)) in (39, 40)
    assert s.pv == pytest.approx(1600.0, abs=3.0)
    assert rig.signal_values[2] == 1600.0, "the SP signal is the PV that satisfies the set point"


def test_the_pv_word_is_rounded_half_to_even_and_saturates():
    rig = Rig()
    pv = Fixed()
    _, s = rig.add(pv)
    seen = []
    for pv.value in (2047.5, 2048.5, -3.0, 5000.0, math.inf, math.nan):
        rig.step()
        seen.append(s.pv)

    assert seen == [2048.0, 2048.0, 0.0, 4095.0, 4095.0, 0.0]


TUNINGS = st.fixed_dictionaries(
    {
        "gain": st.floats(0.0, 99.99),
        "reset": st.sampled_from([0.0, 0.1, 5.0, 600.0]),
        "rate": st.sampled_from([0.0, 0.01, 20.0]),
        "reverse": st.integers(0, 1),
        "velocity": st.integers(0, 1),
        "bias_freeze": st.integers(0, 1),
    }
)


@given(TUNINGS, st.integers(0, 2000), st.integers(1, 2000), st.lists(st.floats(-1e4, 1e4), min_size=5, max_size=40))
@settings(max_examples=60, deadline=None)
def test_the_output_never_leaves_its_limits_nor_the_bias_the_data_range(tuning, low, width, pvs):
    rig = Rig(base=0.1)
    pv = Fixed(pvs[0])
    _, s = rig.add(pv, "auto", output_low_limit=float(low), output_high_limit=float(low + width), sp=2000.0, **tuning)
    for pv.value in pvs:
        rig.step()
        assert s.status & bits.AUTO
        assert low <= s.out <= low + width
        assert 0.0 <= s.bias <= 4095.0
        assert s.out == int(s.out)


def test_a_gain_of_zero_leaves_integral_and_derivative():
    """Ki = Ts/Ti and Kr = Td/Ts with a gain of 0, without a proportional term."""
    _, s = one(gain=0.0, reset=10.0, rate=2.0, period=500_000)

    assert (s.kp, s.ki, s.kd) == (0.0, 4095.0 * 0.5 / 10.0, 4095.0 * 2.0 / 0.5)


def test_slow_loops_take_turns_one_a_scan_when_scans_have_a_length():
    rig = Rig(base=0.1)
    for _ in range(4):
        rig.add(Fixed(1.0), period=3.0, slow=1)
    rig.add(Fixed(1.0), period=0.1)
    order = []
    for k in range(31):
        due = [s.due for s in rig.states]
        rig.step()
        order += [(k, i) for i, s in enumerate(rig.states) if s.due != due[i]]
    slow = [(k, i) for k, i in order if i < 4]

    assert sorted(i for _, i in slow[:4]) == [0, 1, 2, 3]
    assert [k for k, _ in slow] == [0, 1, 2, 3, 30]
    assert [k for k, i in order if i == 4] == list(range(31))


def test_more_slow_loops_than_scans_share_them_evenly():
    """Four loops of 3 s and scans of 1 s: three of four are served in each period, none twice before another."""
    rig = Rig(base=1.0)
    for _ in range(4):
        rig.add(Fixed(1.0), period=3.0, slow=1)
    served = []
    for _ in range(24):
        due = [s.due for s in rig.states]
        rig.step()
        served += [i for i, s in enumerate(rig.states) if s.due != due[i]]

    assert served == [0, 1, 2, 3] * 6


def test_without_a_scan_time_every_loop_that_is_due_is_calculated():
    rig = Rig(base=3.0)
    for _ in range(4):
        rig.add(Fixed(1.0), period=3.0)
    rig.step()

    assert {s.due for s in rig.states} == {3_000_000}


def test_the_equation_of_the_manual_by_hand():
    """Kc 2, Ti 10 s, Td 1 s, Ts 0.5 s: Ki = 0.1, Kr = 4; e = 0.10, 0.12, 0.11 of span from a bias of 0.2."""
    c, s = one(gain=2.0, reset=10.0, rate=1.0, period=500_000, bias=0.2 * 4095.0, pending=bits.NO_PAST)
    results = [calculate_output(c, s, 4095.0 * e, 0.0) / 4095.0 for e in (0.10, 0.12, 0.11)]

    assert results == pytest.approx([0.2 + 0.01 + 0.2, 0.21 + 0.012 + 0.24 + 0.08, 0.222 + 0.011 + 0.22 - 0.04])


def test_scan_of_no_loops_does_nothing():
    scan(0, [], [], [], [])


def test_a_slow_loop_that_program_mode_has_stopped_takes_no_turn():
    rig = Rig(base=0.1)
    _, s = rig.add(Fixed(1.0), period=3.0, slow=1)
    s.pending |= bits.STOPPED
    rig.step()
    assert s.due == 0

    s.pending &= ~bits.STOPPED
    rig.step()
    assert s.due > 0


# --- alarms -----------------------------------------------------------------------------------------------------------


def alarms_by_the_letter(status, pvs, limits, hysteresis):
    """The rule by the letter: no shortcut, every threshold looked at on every sample."""
    for pv in pvs:
        for bit, excess in (
            ("pv_low_low", limits[0] - pv),
            ("pv_low", limits[1] - pv),
            ("pv_high", pv - limits[2]),
            ("pv_high_high", pv - limits[3]),
            ("deviation_yellow", abs(pv - 2000) - limits[4]),
            ("deviation_red", abs(pv - 2000) - limits[5]),
        ):
            if excess > 0:
                status |= ALARM_BITS[bit]
            elif excess <= -hysteresis:
                status &= ~ALARM_BITS[bit]
    return status


@given(
    pvs=st.lists(st.integers(0, 4095) | st.integers(1900, 2100), min_size=2, max_size=30),
    limits=st.tuples(*[st.integers(0, 1900)] * 2, *[st.integers(2100, 4095)] * 2, *[st.integers(0, 2500)] * 2),
    hysteresis=st.integers(0, 200),
)
@settings(max_examples=300, deadline=None)
def test_the_quiet_band_never_hides_an_alarm(pvs, limits, hysteresis):
    """The step only looks at thresholds when the PV leaves a band; the outcome is that of always looking."""
    keys = ("low_low", "low", "high", "high_high", "yellow", "red")
    rig = Rig()
    pv = Fixed()
    _, s = rig.add(pv, sp=2000.0, hysteresis=float(hysteresis), **dict(zip(keys, map(float, limits), strict=True)))
    for n, pv.value in enumerate(pvs, 1):
        rig.step()
        assert s.status & ALARMS == alarms_by_the_letter(0, pvs[:n], limits, hysteresis)


@pytest.mark.parametrize(
    ("fields", "band"),
    [
        ({"low_low": 1.0, "low": 90.0, "high": 3000.0, "high_high": 4000.0}, (90.0, 3000.0)),
        ({"low": 0.0, "high": 4000.0, "yellow": 100.0, "red": 300.0}, (1900.0, 2100.0)),
        ({"low": 1950.0, "high": 2050.0, "yellow": 300.0, "red": 200.0}, (1950.0, 2050.0)),
        ({"low_low": 1990.0, "high_high": 2010.0, "red": 200.0}, (1990.0, 2010.0)),
    ],
)
def test_the_quiet_band_is_as_wide_as_the_thresholds_allow(fields, band):
    rig = Rig()
    _, s = rig.add(Fixed(2000.0), sp=2000.0, **fields)
    rig.step()
    assert (s.alarm_band_low, s.alarm_band_high) == band


def test_absolute_alarms_are_bits_three_to_six():
    assert PV_ALARMS == 0b1111000
    assert ALARMS == 0b1111111000
