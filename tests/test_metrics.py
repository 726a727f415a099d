"""The metrics of a loop, worked out sample by sample by hand: each at its limits."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.sim.engine.influence import Influence
from pidcfg.sim.judgement.meters import (
    NEVER,
    Band,
    Gauge,
    Meter,
    begin,
    begin_step,
    loop_metrics,
    measure_loop,
    overshoot,
    read_gauges,
    rise_time,
    settling_time,
    watch_bands,
)


def measured(pvs, *, before=0.0, after=10.0, event=2, period=0, share=0.1, control=1, set_points=None):
    """A meter and a band after such PVs, 0 up to the event and from there on one a base step; the set point steps."""
    m, band = Meter(0, 1, 2, control=control), Band(0, share)
    begin(m, [before, before, 0.0])
    for k, pv in enumerate([before] * event + pvs):
        sp = before if k < event else set_points[k - event] if set_points else after
        if k == event:
            begin_step(m, k, before, period, [before, before, 0.0])
        sig = [pv, sp, 0.0]
        measure_loop(k, m, sig)
        watch_bands(k, [band], [m], sig)
    return m, band


@pytest.mark.parametrize(
    ("pvs", "time"),
    [
        ([0, 0.99, 1.0, 5, 8.99, 9.0], 3.0),
        ([0, 1.0, 1.0, 9.0, 9.5], 2.0),
        ([9.0], 0.0),
        ([0, 1.0, 8.99], None),
        ([0, 5, 0, 5, 9.5], 3.0),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pv_rises_from_a_tenth_to_nine_tenths_of_the_step_up_or_down(pvs, time, sign):
    m, _ = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10)
    assert rise_time(m, 0.5) == (None if time is None else time / 2)


@pytest.mark.parametrize(
    ("pvs", "time"),
    [
        ([0, 5, 9.0, 9.5], 1.0),
        ([0, 5, 8.99, 9.5], 1.5),
        ([0, 11.0, 10.0], 0.5),
        ([0, 11.01, 10.0], 1.0),
        ([0, 11.01, 11.01], None),
        ([10.0, 9.5, 10.0], 0.0),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_pv_has_settled_when_it_stays_within_the_band(pvs, time, sign):
    m, band = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10)
    assert settling_time(m, band, 2 + len(pvs) - 1, 0.5) == time


def test_a_step_at_the_very_beginning_has_a_rise_time_of_its_own():
    m, _ = measured([9.0, 0.0, 9.0], event=0)
    assert (rise_time(m, 0.5), m.rise_from, m.rise_to) == (0.0, 0, 0)
    m, _ = measured([1.0, 9.0, 9.5], event=0)
    assert rise_time(m, 0.5) == 0.5


def test_an_earlier_step_and_a_loop_that_left_auto_settle_nothing():
    m, band = measured([10.0, 10.0])
    band.outside = 1
    assert settling_time(m, band, 3, 1.0) == 0.0
    m.control, m.control_since = 0, 3
    band.outside = 2
    assert settling_time(m, band, 9, 1.0) is None
    band.outside = 1
    assert settling_time(m, band, 9, 1.0) == 0.0
    m.stepped = 0
    assert settling_time(m, band, 9, 1.0) is None


@pytest.mark.parametrize(
    ("pvs", "past"), [([0, 10, 12.5, 9], 25.0), ([0, 9.9], 0.0), ([0, 10.0], 0.0), ([0, -5, 10.5], 5.0)]
)
@pytest.mark.parametrize("sign", [1, -1])
def test_overshoot_is_a_share_of_the_step(pvs, past, sign):
    m, _ = measured([20 + sign * pv for pv in pvs], before=20.0, after=20.0 + sign * 10)
    assert overshoot(m) == pytest.approx(past)


@pytest.mark.parametrize(("period", "after"), [(1, 8.0), (2, 9.0), (3, 9.0)])
def test_a_set_point_that_is_limited_a_sample_later_is_the_one_that_is_stepped_to(period, after):
    m, _ = measured([0.0, 0.0, 0.0, 0.0], period=period, set_points=[10.0, 8.0, 9.0, 9.0])
    assert m.after == after


def test_nothing_is_a_step_where_the_set_point_stays_or_the_loop_is_not_in_control():
    for given in ({"after": 0.0}, {"control": 0}):
        m, band = measured([0.0, 5.0], **given)
        assert (overshoot(m), rise_time(m, 1.0), settling_time(m, band, 3, 1.0)) == (None, None, None)


def test_the_integrals_count_base_steps_in_control_and_time_in_s():
    m = Meter(0, 1, 2, control=1)
    begin(m, [0.0, 0.0, 5.0])
    for k, (pv, sp, out) in enumerate([(1, 3, 5), (3, 3, 8), (6, 3, 8), (4, 2, 2)]):
        measure_loop(k, m, [float(pv), float(sp), float(out)])
    found = loop_metrics(m, Band(0, 0.05), 3, 0.5, [4.0, 2.0])

    assert (found["iae"], found["ise"], found["itae"]) == (7 * 0.5, 17 * 0.5, 12 * 0.25)
    assert (found["total_variation"], found["final_error"]) == (9.0, -2.0)
    assert (m.pv_low, m.pv_high, m.sp_low, m.sp_high, m.out_low, m.out_high) == (0, 6, 0, 3, 2, 8)


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_single_base_step_in_control_has_integrals(steps):
    found = loop_metrics(Meter(0, 1, 2, control_steps=steps), Band(0, 0.05), 9, 1.0, [4.0, 2.0])
    assert {found[name] for name in ("iae", "ise", "itae")} == {0.0 if steps else None}


def test_a_loop_that_was_never_in_control_has_no_integrals_and_no_final_error():
    found = loop_metrics(Meter(0, 1, 2), Band(0, 0.05), 9, 1.0, [4.0, 2.0])
    assert {name for name, value in found.items() if value is not None} == {"total_variation"}


@pytest.mark.parametrize(("first", "last", "seen"), [(0, 9, (1, 5)), (1, 3, (2, 4)), (4, 4, (1, 1)), (2, 2, (4, 4))])
def test_a_window_has_both_its_ends(first, last, seen):
    gauge = Gauge(1, first=first, last=last)
    for k, value in enumerate([5.0, 2.0, 4.0, 3.0, 1.0]):
        read_gauges(k, [gauge], [-9.0, value])
    assert (gauge.low, gauge.high) == seen


def test_an_event_that_changes_nothing_concerns_no_loop():
    """Another event of the same words may change something."""
    cfg = [Facts(sig_out=0, sig_pv=1, sig_sp=2), Facts(sig_out=3, sig_pv=4, sig_sp=5)]
    event, same = (Facts(plc=None, disturb=None, loop="A", pv=None, set={"setpoint": 50}) for _ in range(2))
    influence = Influence(Facts(), Facts(cfg=cfg, loops=["A", "B"]), idle=[event])

    assert [influence.concerns(one, loop) for one in (event, same) for loop in (0, 1)] == [False, False, True, False]


def test_nothing_is_known_of_a_loop_before_its_first_base_step():
    """−1 is not yet, or never; every sum and every bit is 0."""
    meter = Meter(0, 0, 0)
    known = {name: value for name in Meter.__slots__ if (value := getattr(meter, name)) != 0}
    not_yet = ("status", "aux_status", "event", "rise_from", "rise_to", "left", "missed", "blind_from", "cut_from")
    later = ("watched", "window", "middle", "late", "swung")
    assert known == {**dict.fromkeys((*not_yet, "extreme_at"), -1), **dict.fromkeys(later, NEVER), "course": 1}
