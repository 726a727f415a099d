"""A PV that swings, and one that is at rest: each limit of what counts as an oscillation and as a steady state."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.kernel import Span
from pidcfg.sim.engine.run import is_steady, refused_modes, swings_alike, window_of
from pidcfg.sim.judgement.meters import Meter, begin_calm, calm_oscillation, oscillation, watch_swings


def watched(pvs, *, least=1.0, late=0, **fields):
    """A meter that has seen these PVs, one a base step."""
    m = Meter(0, 1, 2, control=1, least=least, late=late, **fields)
    for k, pv in enumerate(pvs):
        watch_swings(k, m, pv)
    return m


def zigzag(*extremes):
    """PVs that go from one extreme to the next by 1 a base step."""
    pvs = [float(extremes[0])]
    for end in extremes[1:]:
        pvs += [pvs[-1] + (1.0 if end > pvs[-1] else -1.0) * (n + 1) for n in range(int(abs(end - pvs[-1])))]
    return pvs


def test_turning_points_are_where_the_pv_has_come_back_by_more_than_the_least_move():
    pvs = zigzag(0, 5, 0, 5, 0, 5, 0, 5, 0, 5, 0)
    m = watched(pvs)
    assert (m.turns, m.last_turn, m.last_swing) == (9, 45, 5.0)
    assert (m.shortest, m.longest) == (10, 10)
    assert oscillation(m, 50) == (10.0, 2.5)
    assert calm_oscillation(m, 50) == (10.0, 2.5)
    assert watched(pvs, least=4.0).turns == 9
    assert watched(pvs, least=5.0).turns == 0


def test_the_first_swing_of_the_last_third_and_of_the_calm_is_left_out():
    """Each began before it, so that it may have been cut."""
    m = watched(zigzag(0, 9, 0, 5, 1, 5, 1, 5, 1, 5, 1, 5, 1, 5), late=20)
    assert (m.first_turn, m.first_swing, m.swings) == (23, 4.0, 36.0)
    assert (m.calm_first_turn, m.calm_first_swing) == (18, 5.0)


def test_an_event_and_a_loop_out_of_control_begin_anew():
    m = watched(zigzag(0, 5, 0, 5, 0, 5, 0))
    assert (m.turns, m.calm_turns) == (5, 5)
    begin_calm(m)
    assert (m.turns, m.calm_turns) == (5, 0)
    m.control = 0
    watch_swings(99, m, 7.0)
    assert (m.turns, m.calm_turns, m.extreme, m.extreme_at) == (0, 0, 7.0, 99)


SWINGING = {
    "turns": 8,
    "first_swing": 5.0,
    "last_swing": 4.0,
    "shortest": 10,
    "longest": 20,
    "first_turn": 10,
    "last_turn": 55,
    "swings": 27.0,
}
CALM = {
    "calm_turns": 8,
    "calm_first_swing": 5.0,
    "last_swing": 4.0,
    "calm_shortest": 10,
    "calm_longest": 20,
    "calm_first_turn": 10,
    "last_turn": 55,
    "calm_swings": 27.0,
    "widest": 99.0,
}


@pytest.mark.parametrize(
    ("changed", "last", "found"),
    [
        ({}, 70, True),
        ({}, 71, False),
        ({"turns": 7}, 70, False),
        ({"last_swing": 3.999}, 70, False),
        ({"longest": 21}, 70, False),
    ],
)
def test_three_even_periods_of_swings_that_hardly_get_smaller_are_an_oscillation(changed, last, found):
    """Six half periods of 45 base steps: 15 of a period, and swings of 4.5."""
    assert oscillation(Meter(0, 1, 2, **{**SWINGING, **changed}), last) == ((15.0, 2.25) if found else None)


@pytest.mark.parametrize(
    ("changed", "k", "found"),
    [
        ({}, 70, True),
        ({}, 71, False),
        ({"calm_turns": 7, "grown": 2}, 70, False),
        ({"last_swing": 3.999}, 70, False),
        ({"calm_longest": 21}, 70, False),
        ({"grown": 3}, 70, False),
        ({"grown": 3, "widest": 5.0}, 70, True),
        ({"grown": 2}, 70, True),
    ],
)
def test_an_oscillation_since_the_last_event_is_held_against_its_widest_swing_where_it_grew(changed, k, found):
    assert calm_oscillation(Meter(0, 1, 2, **{**CALM, **changed}), k) == ((15.0, 2.25) if found else None)


@pytest.mark.parametrize(("turns", "grown", "found"), [(3, 3, True), (2, 3, False), (3, 2, False)])
def test_one_that_grows_three_times_need_not_have_three_periods(turns, grown, found):
    m = Meter(0, 1, 2, **{**CALM, "calm_turns": turns, "grown": grown, "widest": 4.0, "calm_first_turn": 50})
    assert (calm_oscillation(m, 55) is not None) == found


@pytest.mark.parametrize(
    ("low", "high", "mean", "steady"),
    [
        (50.0, 50.00009, 50.0, True),
        (49.75, 50.25, 50.0, True),
        (49.75, 50.26, 50.0, False),
        (49.74, 50.25, 50.0, False),
        (49.75, 50.25, 49.99, False),
    ],
)
def test_a_pv_is_at_rest_within_two_counts_of_its_mean(low, high, mean, steady):
    """Of 800 counts in 100; or when it moves by less than a millionth of the range."""
    assert is_steady(Span(0, low, high, 8 * mean), (0.0, 100.0, 800), 8) == steady
    assert is_steady(Span(0, low, high, 8 * mean), (100.0, 0.0, 800), 8) == steady
    assert is_steady(Span(0, 50.0, 50.0001, 0.0), (0.0, 100.0, 10**9), 8) is False


@pytest.mark.parametrize(
    ("now", "same"),
    [((10.0, 20.0), True), ((10.2, 20.2), True), ((9.79, 20.0), False), ((10.0, 20.21), False), ((10.21, 20.0), False)],
)
def test_a_pv_that_swings_comes_back_to_its_extremes_of_four_windows_before(now, same):
    """Within a fiftieth of the swing, and two counts."""
    before = [(12.0, 18.0), (10.0, 15.0), (12.0, 20.0), (13.0, 13.0)]
    past = [(0.0, 99.0), *before, (13.0, 13.0), now, (13.0, 13.0), (13.0, 13.0)]
    assert swings_alike(past, (0.0, 100.0, 1000)) == same
    assert swings_alike(before + [now] * 3, (0.0, 100.0, 1000)) is False, "there are only seven windows"


@pytest.mark.parametrize(
    ("periods", "longest", "step", "window"),
    [
        ([1.0], 7.0, 0.5, 14),
        ([1.0], 7.5, 0.5, 16),
        ([1.0], 0.0, 0.5, 8),
        ([2.0, 3.0], 5.0, 0.5, 24),
        ([2.0, 3.0], 13.0, 0.5, 36),
        ([0.7, 1.1], 0.77, 0.1, 77),
        ([0.7, 1.1, 1.3], 1.0, 0.1, 52),
        ([], 3.0, 0.5, 6),
    ],
)
def test_a_window_is_the_longest_time_constant_in_whole_samples(periods, longest, step, window):
    plc = Facts(cfg=[Facts(period=round(period * TICKS)) for period in periods], longest=0.0)
    machine = Facts(plc=plc, net=Facts(longest=lambda: longest), step=round(step * TICKS))
    assert window_of(machine) == window


@pytest.mark.parametrize(
    ("status", "goal", "told"), [(1, "auto", True), (1, "manual", False), (2, "auto", False), (2, "cascade", False)]
)
def test_a_loop_that_rests_in_manual_though_it_is_meant_for_more_is_told(status, goal, told):
    plc = Facts(
        loops=["A"], st=[Facts(status=status)], goals=[goal], modes={"manual": 1}, mode={1: "manual", 2: "auto"}.get
    )
    found = [(p.path, p.message, p.severity, p.loop) for p in refused_modes(Facts(plc=plc))]
    assert found == ([(("initial",), f"A rests in manual, though {goal} is meant", "warning", "A")] if told else [])
