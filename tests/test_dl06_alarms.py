"""Process alarms of the virtual DL06: thresholds, hysteresis, deviation, rate of change, in every mode."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dl06_rig import Rig
from pidcfg.sim.controllers.dl06.equation import ALARMS, PV_ALARMS
from pidcfg.sim.controllers.dl06.operate import ALARM_BITS
from rig_plants import Fixed


def names(status):
    return [name for name, bit in ALARM_BITS.items() if status & bit]


def trail(pvs, **fields):
    """The alarms that are on after each PV."""
    rig = Rig()
    pv = Fixed()
    _, s = rig.add(pv, **fields)
    seen = []
    for pv.value in pvs:
        rig.step()
        seen.append(names(s.status))
    return seen


def test_an_alarm_comes_on_immediately_above_its_threshold():
    assert trail([3000, 3001], high=3000.0, high_high=3500.0) == [[], ["pv_high"]]


def test_a_low_alarm_comes_on_immediately_below_its_threshold():
    assert trail([200, 199], low=200.0, low_low=100.0) == [[], ["pv_low"]]


def test_an_alarm_goes_off_when_the_pv_is_back_by_the_hysteresis():
    assert trail([3001, 3000, 2991, 2990, 2995], high=3000.0, hysteresis=10.0) == [["pv_high"]] * 3 + [[], []]
    assert trail([199, 200, 209, 210, 205], low=200.0, hysteresis=10.0) == [["pv_low"]] * 3 + [[], []]


def test_outer_alarms_join_the_inner_ones():
    limits = {"low_low": 100.0, "low": 200.0, "high": 3000.0, "high_high": 3500.0}

    assert trail([99, 150, 2000, 3200, 3600], **limits) == [
        ["pv_low_low", "pv_low"],
        ["pv_low"],
        [],
        ["pv_high"],
        ["pv_high", "pv_high_high"],
    ]


def test_thresholds_in_the_wrong_order_are_looked_at_one_by_one():
    assert trail([500, 200], low=100.0, low_low=300.0) == [[], ["pv_low_low"]]
    assert trail([500, 900], high=1000.0, high_high=800.0) == [[], ["pv_high_high"]]
    assert trail([500, 560], sp=500.0, yellow=100.0, red=50.0) == [[], ["deviation_red"]]


def test_groups_that_are_off_have_no_alarms():
    assert trail([0, 4095, 0], sp=2000.0) == [[]] * 3


def test_deviation_alarms_apply_above_and_below_the_set_point():
    limits = {"yellow": 50.0, "red": 100.0, "sp": 2000.0, "hysteresis": 5.0}

    assert trail([2050, 2051, 2101, 2096, 2095, 2045, 1949, 1899], **limits) == [
        [],
        ["deviation_yellow"],
        ["deviation_yellow", "deviation_red"],
        ["deviation_yellow", "deviation_red"],
        ["deviation_yellow"],
        [],
        ["deviation_yellow"],
        ["deviation_yellow", "deviation_red"],
    ]


def test_deviation_follows_a_set_point_that_moves():
    rig = Rig()
    _, s = rig.add(Fixed(2000.0), sp=2000.0, yellow=50.0, red=100.0)
    rig.step(3)
    s.sp = 2060.0
    rig.step()

    assert names(s.status) == ["deviation_yellow"]


def test_deviation_uses_the_limited_set_point():
    rig = Rig()
    _, s = rig.add(Fixed(2000.0), sp=4000.0, sp_max=2010.0, yellow=50.0, red=100.0)
    rig.step()

    assert names(s.status) == []


def test_with_root_extract_the_pv_is_compared_with_the_square_of_the_set_point():
    """SP 40 on the root's scale is a PV of 1600; the absolute alarms stay on the raw PV."""
    assert trail([1600, 1651, 1701], sp=40.0, square_root=1, span=64.0, yellow=50.0, red=100.0, high=1700.0) == [
        [],
        ["deviation_yellow"],
        ["pv_high", "deviation_yellow", "deviation_red"],
    ]


def test_rate_of_change_is_counts_a_sample_in_both_directions():
    """The manual's example: 15 degrees a minute at 10 counts a degree and 2 s are 5 counts a sample."""
    counts = 15 * 10 * 2 / 60

    assert counts == 5
    assert trail([1000, 1005, 1011, 1011, 1006, 1000], rate_of_change=counts) == [
        [],
        [],
        ["rate_of_change"],
        [],
        [],
        ["rate_of_change"],
    ]


def test_the_first_sample_has_no_rate_of_change():
    assert trail([4000], rate_of_change=5.0) == [[]]


def test_rate_of_change_has_no_hysteresis():
    assert trail([0, 100, 105, 110], rate_of_change=5.0, hysteresis=200.0)[1:] == [["rate_of_change"], [], []]


@pytest.mark.parametrize("mode", ["manual", "auto"])
def test_alarms_work_in_every_mode(mode):
    rig = Rig()
    pv = Fixed(1000.0)
    _, s = rig.add(pv, mode, sp=1000.0, high=1500.0)
    rig.step(2)
    pv.value = 1501.0
    rig.step()

    assert names(s.status) == ["pv_high"]


def expected(status, pvs, limits, hysteresis):
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
        assert s.status & ALARMS == expected(0, pvs[:n], limits, hysteresis)


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
    assert (s.quiet_low, s.quiet_high) == band


def test_absolute_alarms_are_bits_three_to_six():
    assert PV_ALARMS == 0b1111000
    assert ALARMS == 0b1111111000
