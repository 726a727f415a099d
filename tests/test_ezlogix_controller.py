"""The equation of the virtual EZLogix against the manual's formulas, worked out in exact fractions.

Each case keeps the result away from the middle between two counts, so that rounding cannot hide a wrong term.
"""

from __future__ import annotations

import math
import random
from fractions import Fraction
from itertools import accumulate, pairwise

import pytest

from ezlogix_rig import BIAS, CV, ERROR, PV, SP, Rig
from pidcfg.sim.controllers.ezlogix import equation as bits
from rig_plants import FirstOrder, Fixed


def formula(pvs, sp, out, offset=0, *, direct, velocity=False, gain, ts, ti=0, td=0):
    """CV(n) by the printed formula; the sum begins with what makes the term CV - CV0 (exact, without limits)."""
    gain, ts, ti, td = (Fraction(str(x)) for x in (gain, ts, ti, td))
    sign = 1 if direct else -1
    factor = gain or 1
    errors = [sign * (Fraction(pv) - sp) for pv in pvs]
    ramp = [sign * Fraction(pv) for pv in pvs] if velocity else errors
    slopes = [Fraction(0), *(b - a for a, b in pairwise(ramp))]
    sums = list(accumulate(errors))
    start = out - offset if ti else 0
    return [
        gain * e + start + (factor * ts / ti * total if ti else 0) + factor * td / ts * slope + offset
        for e, total, slope in zip(errors, sums, slopes, strict=True)
    ]


def controlled(pvs, **given):
    """The CV of each sample of a loop in Auto with these measurements."""
    rig = Rig(base=given.pop("period", 0.1))
    rig.add(Fixed(), "auto", **given)
    return [out for (out,) in rig.follow(pvs, "out")]


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("velocity", [False, True])
@pytest.mark.parametrize(
    ("gain", "ti", "td"),
    [
        (2, 0, 0),
        (0.75, 3, 0),
        (1.25, 0, 0.4),
        (1.5, 20, 0.3),
        (0, 5, 0),
        (0, 7, 0.2),
        (0, 0, 0.5),
    ],
)
def test_the_result_is_that_of_the_printed_formula(direct, velocity, gain, ti, td):
    rng = random.Random(repr((direct, velocity, gain, ti, td)))
    for offset in (0, 1900):
        pvs = [2000 + rng.randint(-30, 30) for _ in range(25)]
        start = 0 if ti else offset
        if not ti and not offset:
            pvs = [pv + (40 if direct else -40) for pv in pvs]
        want = formula(
            pvs, 2000, 2000 if ti else start, offset, direct=direct, velocity=velocity, gain=gain, ts=0.1, ti=ti, td=td
        )
        got = controlled(
            pvs,
            sp=2000.0,
            out=2000.0,
            offset=float(offset),
            direct=int(direct),
            velocity=int(velocity),
            gain=float(gain),
            reset=float(ti),
            rate=float(td),
        )
        for value, exact in zip(got, want, strict=True):
            assert abs(value - min(max(exact, 0), 4095)) <= Fraction(1, 2) + Fraction(1, 10**9)


def test_reverse_action_heats_and_direct_action_cools():
    below, above = [1900.0] * 3, [2100.0] * 3
    common = {"sp": 2000.0, "gain": 2.0}

    assert controlled(below, direct=0, **common) == [200.0] * 3
    assert controlled(above, direct=0, **common) == [0.0] * 3
    assert controlled(below, direct=1, **common) == [0.0] * 3
    assert controlled(above, direct=1, **common) == [200.0] * 3


@pytest.mark.parametrize("direct", [0, 1])
def test_the_derivative_of_the_pv_brakes_whatever_the_action(direct):
    """A PV on its way to the set point: the braking term is on the other side of the error."""
    toward = -10.0 if direct else 10.0
    pvs = [2000.0 - 20 * toward + n * toward for n in range(3)]
    common = {"sp": 2000.0, "gain": 1.0, "offset": 2000.0, "velocity": 1, "direct": direct}
    with_rate, without = controlled(pvs, rate=0.5, **common), controlled(pvs, **common)

    assert with_rate[0] == without[0]
    assert [a - b for a, b in zip(with_rate[1:], without[1:], strict=True)] == [-50.0, -50.0]


def test_a_step_of_the_set_point_kicks_only_through_the_derivative_of_the_error():
    outs = {}
    for velocity in (0, 1):
        rig = Rig()
        _, s = rig.add(Fixed(1000.0), "auto", sp=1000.0, gain=1.0, rate=0.3, offset=1000.0, velocity=velocity)
        rig.step(2)
        s.sp = 1100.0
        outs[velocity] = [out for (out,) in rig.trace(2, "out")]

    assert outs == {0: [1000.0 + 100.0 + 300.0, 1100.0], 1: [1100.0, 1100.0]}


def test_errors_inside_the_deadband_count_as_zero_and_one_that_equals_it_does_not():
    pvs = [1995.0, 1996.0, 2000.0, 2004.0, 2005.0]

    assert controlled(pvs, sp=2000.0, gain=10.0, deadband=5.0, offset=1000.0) == [1050, 1000, 1000, 1000, 950]


def test_the_deadband_counts_for_integral_and_derivative_too():
    rig = Rig()
    rig.add(Fixed(), "auto", sp=2000.0, out=1000.0, gain=1.0, reset=0.1, rate=0.1, deadband=5.0)

    assert rig.follow([1997.0] * 3, "out", "error") == [(1000.0, 3.0)] * 3
    assert rig.follow([1990.0], "out") == [(1000.0 + 10 + 10 + 10,)]


def test_the_square_root_of_the_pv_is_compared_with_the_set_point():
    """PV 1024 of 4095 has the root 32; the error counts as if full scale of the root were that of the PV."""
    pvs = [1024.0, 900.0]
    outs = controlled(pvs, sp=30.0, gain=1.0, square_root=1, scale=math.sqrt(4095.0), direct=1, offset=1000.0)

    assert outs == [round(1000 + 2 * math.sqrt(4095.0)), 1000.0]
    backwards = controlled(pvs, sp=34.0, gain=1.0, square_root=1, scale=math.sqrt(4095.0), direct=0, offset=1000.0)
    assert backwards == [round(1000 + 2 * math.sqrt(4095.0)), round(1000 + 4 * math.sqrt(4095.0))]


def test_a_square_root_begins_at_0_and_one_count_has_the_root_of_one_count():
    outs = controlled([1.0, 0.0, -4.0, 4.0], sp=0.0, gain=1.0, square_root=1, scale=64.0, direct=1, offset=1000.0)
    assert outs == [1064.0, 1000.0, 1000.0, 1128.0]


def test_the_deadband_of_a_square_root_loop_is_on_the_roots_scale():
    outs = controlled(
        [1024.0, 961.0], sp=30.0, gain=1.0, square_root=1, scale=64.0, direct=1, deadband=1.5, offset=1000.0
    )

    assert outs == [1000.0 + 128.0, 1000.0]


def test_the_derivative_of_the_pv_is_that_of_its_root():
    common = {"sp": 32.0, "square_root": 1, "scale": 64.0, "direct": 1, "velocity": 1, "offset": 1000.0, "rate": 0.1}

    assert controlled([1024.0, 1089.0], gain=1.0, **common) == [1000.0, 1000.0 + 64.0 + 64.0]


def test_a_root_loop_shows_the_pv_that_satisfies_its_set_point():
    rig = Rig()
    rig.add(Fixed(1024.0), sp=32.0, square_root=1, scale=64.0)
    rig.step()

    assert (rig.sig[PV], rig.sig[SP]) == (1024.0, 1024.0)


# --- set point limits ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("sp", "low", "high", "expected"),
    [
        (500.0, 100.0, 900.0, 500.0),
        (50.0, 100.0, 900.0, 100.0),
        (950.0, 100.0, 900.0, 900.0),
        (500.0, 0.0, 0.0, 0.0),
        (500.0, 900.0, 100.0, 900.0),
    ],
)
@pytest.mark.parametrize("mode", ["manual", "auto"])
def test_set_point_limits_write_the_register(sp, low, high, expected, mode):
    rig = Rig()
    _, s = rig.add(Fixed(0.0), mode, sp=sp, sp_low=low, sp_high=high)
    rig.step()

    assert (s.sp, s.error, rig.sig[SP]) == (expected, expected, expected)


# --- the CV ----------------------------------------------------------------------------------------------------------


def test_cv_limits_hold_the_result_and_not_the_operators_value():
    common = {"sp": 2000.0, "gain": 10.0, "cv_low_limit": 100.0, "cv_high_limit": 300.0}

    assert controlled([1000.0, 1980.0, 2100.0], **common) == [300.0, 200.0, 100.0]
    rig = Rig()
    _, s = rig.add(Fixed(0.0), out=3000.0, **common)
    rig.step(2)
    assert s.out == 3000.0


def test_of_crossed_cv_limits_the_lower_one_wins():
    assert controlled([1000.0, 2100.0], sp=2000.0, gain=10.0, cv_low_limit=300.0, cv_high_limit=100.0) == [300.0, 300.0]


@pytest.mark.parametrize(("pv", "expected"), [(0.0, 4095.0), (4095.0, 0.0), (2040.0, 8.0), (2041.0, 7.0)])
def test_the_cv_is_a_whole_number_of_counts_from_0_to_4095(pv, expected):
    assert controlled([pv], sp=2048.0, gain=1.0 if pv in {2040.0, 2041.0} else 99.0) == [expected]


def test_the_cv_is_rounded_half_to_even():
    assert controlled([2045.0, 2043.0, 2041.0], sp=2048.0, gain=0.5) == [2.0, 2.0, 4.0]


@pytest.mark.parametrize(
    ("pv", "limits", "saturated", "out"),
    [
        (1990.0, (100.0, 300.0), False, 200.0),
        (1000.0, (100.0, 300.0), False, 300.0),
        (2100.0, (100.0, 300.0), False, 100.0),
        (1000.0, (100.0, 4095.0), True, 4095.0),
        (1000.0, (0.0, 4094.0), False, 4094.0),
        (2100.0, (0.0, 300.0), True, 0.0),
        (2100.0, (1.0, 300.0), False, 1.0),
    ],
)
def test_saturation_is_the_cv_itself_at_0_or_4095(pv, limits, saturated, out):
    """As the manual says of the bit: "if the Control Variable is either 0 or 4095"."""
    rig = Rig()
    _, s = rig.add(Fixed(pv), "auto", sp=2000.0, gain=20.0, cv_low_limit=limits[0], cv_high_limit=limits[1])
    rig.step()

    assert (bool(s.status & bits.SATURATED), s.out) == (bool(saturated), out)


def test_the_bit_of_saturation_goes_off_again():
    rig = Rig()
    _, s = rig.add(Fixed(1000.0), "auto", sp=2000.0, gain=20.0)
    rig.step()
    assert s.status & bits.SATURATED
    rig.follow([1990.0], "out")

    assert s.status == bits.AUTO


@pytest.mark.parametrize(("out", "saturated"), [(0.0, True), (1.0, False), (4094.0, False), (4095.0, True)])
def test_in_manual_the_cv_itself_decides_saturation(out, saturated):
    rig = Rig()
    _, s = rig.add(Fixed(0.0), out=out)
    rig.step()

    assert bool(s.status & bits.SATURATED) is saturated


# --- anti-windup -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direct", [0, 1])
@pytest.mark.parametrize(("toward", "end"), [(1.0, 4095.0), (-1.0, 0.0)])
def test_with_anti_windup_the_integral_stands_while_the_cv_is_saturated(direct, toward, end):
    """An error that drives the CV to one end for long: with anti-windup it leaves that end at once."""
    seen = {}
    for anti_windup in (0, 1):
        rig = Rig()
        off = toward * (100.0 if direct else -100.0)
        _, s = rig.add(
            Fixed(2000.0 + off),
            "auto",
            sp=2000.0,
            out=2000.0,
            gain=10.0,
            reset=1.0,
            direct=direct,
            anti_windup=anti_windup,
        )
        rig.step(200)
        assert s.out == end
        stood = s.integral
        rig.follow([2000.0 - off / 10.0], "out")
        seen[anti_windup] = (stood, s.out)

    assert seen[0][0] == pytest.approx(2000.0 + toward * 200 * 100.0)
    assert 0.0 < seen[1][0] < 4095.0
    assert seen[0][1] == end
    assert 0.0 < seen[1][1] < 4095.0


def test_anti_windup_looks_at_the_cv_before_its_limits():
    """Limits inside 0 to 4095 do not stop the integral before the CV without them is saturated."""
    rig = Rig()
    _, s = rig.add(
        Fixed(1990.0), "auto", sp=2000.0, out=500.0, gain=1.0, reset=0.1, anti_windup=1, cv_high_limit=1000.0
    )
    rig.step(100)
    assert (s.out, s.integral) == (1000.0, 500.0 + 100 * 10.0)
    rig.step(900)

    assert (s.out, s.integral) == (1000.0, 4090.0)


def test_the_integral_comes_back_from_saturation():
    rig = Rig()
    _, s = rig.add(Fixed(2010.0), "auto", sp=2000.0, out=4095.0, gain=1.0, reset=1.0, anti_windup=1)
    rig.step()

    assert s.integral == 4095.0 - 1.0


def test_the_integral_stays_within_a_32_bit_number():
    rig = Rig(base=90.0)
    _, s = rig.add(Fixed(0.0), "auto", sp=4000.0, gain=99.0, reset=0.1)
    rig.step(200)
    assert s.integral == 2147483647.0
    rig.plants[0].value, s.sp = 4000.0, 0.0
    rig.step(400)

    assert s.integral == -2147483647.0


def test_without_integral_time_there_is_no_integral_term():
    rig = Rig()
    _, s = rig.add(Fixed(1990.0), "auto", sp=2000.0, out=3000.0, gain=2.0, offset=100.0)
    rig.step()

    assert (s.out, s.integral) == (120.0, 0.0)


# --- PV and signals --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "pv"),
    [
        (-90.0, 819.0),
        (-50.0, 819.0),
        (0.0, 2457.0),
        (50.0, 4095.0),
        (70.0, 4095.0),
        (-39.99, 1147.0),
        (-49.99, 819.0),
    ],
)
def test_the_converter_gives_whole_counts_and_saturates(value, pv):
    rig = Rig()
    _, s = rig.add(Fixed(value), pv_low=-50.0, pv_width=100.0, pv_min=819.0, pv_max=4095.0, pv_span=3276.0, sp=1000.0)
    rig.step()

    assert s.pv == pv
    assert rig.sig[PV] == pytest.approx((pv - 819.0) / 32.76 - 50.0)
    assert rig.sig[SP] == pytest.approx((1000.0 - 819.0) / 32.76 - 50.0)


def test_signals_are_in_engineering_units_of_the_registers():
    rig = Rig()
    _, s = rig.add(
        Fixed(1990.0), "auto", sp=2000.0, out=819.0, gain=1.0, reset=1.0, offset=100.0, out_low=-10.0, out_width=40.95
    )
    rig.step()

    assert (s.out, s.integral) == (830.0, 720.0)
    assert rig.sig[CV] == pytest.approx(-10.0 + 8.30)
    assert rig.sig[BIAS] == pytest.approx(-10.0 + 8.20)
    assert rig.sig[ERROR] == 10.0


@pytest.mark.parametrize(
    ("sp", "pv", "direct", "error"),
    [
        (100.0, 300.0, 0, -200.0),
        (100.0, 300.0, 1, 200.0),
        (65535.0, 0.0, 0, 32767.0),
        (65535.0, 0.0, 1, -32767.0),
    ],
)
def test_the_error_register_has_a_sign_and_16_bits(sp, pv, direct, error):
    rig = Rig()
    _, s = rig.add(Fixed(pv), sp=sp, sp_high=65535.0, direct=direct, deadband=500.0)
    rig.step()

    assert (s.error, rig.sig[ERROR]) == (error, error)


# --- time ------------------------------------------------------------------------------------------------------------


def test_a_loop_is_calculated_when_it_is_due():
    rig = Rig(base=0.1)
    rig.add(Fixed(), period=0.3, sp=0.0)
    seen = [pv for (pv,) in rig.follow([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0], "pv")]

    assert seen == [1, 1, 1, 4, 4, 4, 7]


def test_a_rate_that_the_base_step_misses_takes_the_next_one():
    rig = Rig(base=0.1)
    rig.add(Fixed(), period=0.25, sp=0.0)

    assert [pv for (pv,) in rig.follow([float(n) for n in range(10)], "pv")] == [0, 0, 0, 3, 3, 5, 5, 5, 8, 8]


@pytest.mark.parametrize("velocity", [0, 1])
@pytest.mark.parametrize("direct", [0, 1])
def test_the_right_action_settles_and_the_wrong_one_runs_away(direct, velocity):
    """A heater (gain above 0) wants reverse action, a cooler direct."""
    ends = {}
    for gain in (1.0, -1.0):
        rig = Rig(base=0.5)
        plant = FirstOrder(gain, 20.0, 1.0, initial=2000.0, offset=2000.0 - gain * 1500.0)
        _, s = rig.add(
            plant,
            "auto",
            sp=2300.0,
            out=1500.0,
            gain=2.0,
            reset=20.0,
            rate=1.0,
            direct=direct,
            velocity=velocity,
            anti_windup=1,
        )
        rig.run(600)
        ends[gain] = (s.pv, s.out)
    right, wrong = (-1.0, 1.0) if direct else (1.0, -1.0)

    assert ends[right][0] == pytest.approx(2300.0, abs=3.0)
    assert ends[right][1] == pytest.approx(1500.0 + right * 300.0, abs=6.0)
    assert ends[wrong][1] in {0.0, 4095.0}
    assert abs(ends[wrong][0] - 2300.0) > 1000.0
