"""The reaction curve and the rest before it, piece by piece: against known lines, and at each of its limits."""

from __future__ import annotations

from statistics import linear_regression

import pytest

from pidcfg.sim.controllers.autotune import (
    ANSWERED,
    GOES_ON,
    NO_ANSWER,
    POINTS,
    RELAY_PATIENCE_SAMPLES,
    RELAY_PATIENCE_SECONDS,
    TOO_SMALL,
    begin_curve,
    begin_noise,
    first_crossing,
    is_stalled,
    judge_response,
    measure_noise,
    record_point,
    steepest_line,
    was_moving,
)
from pidcfg.sim.controllers.click.equation import Config as ClickConfig
from pidcfg.sim.controllers.click.equation import is_tunable
from pidcfg.sim.controllers.kernels import RelayState

PLACE = 3
"""Of the first point: others of the memory are not the curve's."""


def curve(points, **fields):
    """A state with these points, a sample each, and the memory that holds them."""
    s = RelayState(tune_points=len(points), tune_count=len(points), period=1_000_000, **fields)
    return s, [-1e9] * PLACE + [*points] + [1e9] * PLACE


def recorded(rises):
    """A curve of such samples, 0.5 s each."""
    s, aux = RelayState(period=500_000, tune_count=9, tune_points=9, tune_sum=9.0), [-1e9] * (PLACE + POINTS + 1)
    begin_curve(s)
    for rise in rises:
        record_point(s, PLACE, aux, rise)
    return s, aux


@pytest.mark.parametrize(("samples", "stride", "points"), [(200, 1, 200), (600, 2, 300), (2000, 4, 500), (512, 1, 512)])
def test_a_line_has_its_slope_and_its_dead_time_however_long_it_was_recorded(samples, stride, points):
    s, aux = recorded(max(0.0, 2.0 * (n - 12)) for n in range(1, samples + 1))

    assert (s.tune_stride, s.tune_points) == (stride, points)
    assert aux[:PLACE] == [-1e9] * PLACE
    assert aux[-1] == -1e9
    assert aux[PLACE + points - 1] == 2.0 * (samples - 12) - (stride - 1), "the mean of its samples"
    assert steepest_line(s, PLACE, aux, aux[PLACE + points - 1]) == pytest.approx((4.0, 6.0))


@pytest.mark.parametrize(("noise", "width"), [(0.0, 10), (1.0, 12), (9.0, 20)])
def test_the_steepest_line_is_a_regression_over_a_tenth_of_the_answer_or_more_where_it_is_noisy(noise, width):
    """Of an answer of 100: 10, twelve deviations of the noise, at most 20; where it grows by 1 a point at first."""
    points = [*range(40), *(40 + 3 * k for k in range(15)), *(85 + k / 4 for k in range(60))]
    s, aux = curve([float(point) for point in points], tune_noise=noise)
    at = range(width + 1)
    lines = [linear_regression(at, points[j : j + width + 1]) for j in range(len(points) - width)]
    steepest = max(lines, key=lambda line: line.slope)
    j = lines.index(steepest)

    slope, dead = steepest_line(s, PLACE, aux, 100.0)
    assert slope == pytest.approx(steepest.slope)
    assert dead == pytest.approx(j + 1 - steepest.intercept / steepest.slope)


def test_an_answer_at_once_has_the_dead_time_of_a_sample_and_one_that_falls_has_no_line():
    s, aux = curve([10.0 + k for k in range(30)])
    assert steepest_line(s, PLACE, aux, 39.0) == (pytest.approx(1.0), 1.0)
    s, aux = curve([-float(k) for k in range(30)])
    assert steepest_line(s, PLACE, aux, 10.0) == (0.0, 0.0)


@pytest.mark.parametrize(("level", "first"), [(-1.0, 0), (0.0, 0), (1.5, 2), (2.0, 2), (4.0, 4), (9.0, 4)])
def test_a_level_is_crossed_where_it_is_reached_or_at_the_last_point(level, first):
    s, aux = curve([0.0, 1.0, 2.0, 3.0, 4.0])
    assert first_crossing(s, PLACE, aux, level) == first


def judged(points, *, span=100.0, count=0.0, rest=0.0, last_step=0, **fields):
    s, aux = curve(points, **fields)
    return judge_response(s, PLACE, aux, span, count, rest, last_step)


@pytest.mark.parametrize(
    ("change", "given", "verdict"),
    [
        (10.0, {}, ANSWERED),
        (9.99, {}, GOES_ON),
        (12.0, {"tune_noise": 2.0}, ANSWERED),
        (11.99, {"tune_noise": 2.0}, GOES_ON),
        (12.0, {"count": 3.0}, ANSWERED),
        (11.99, {"count": 3.0}, GOES_ON),
    ],
)
def test_a_tenth_of_the_range_above_noise_and_resolution_is_an_answer(change, given, verdict):
    """Six deviations of the noise and four counts; the last twelfth of the points is its mean."""
    assert judged([0.0] * 20 + [change], **given) == (verdict, pytest.approx(change))
    before = [0.0] * 22
    assert judged([*before, change], **given)[0] == verdict


def test_an_answer_is_the_mean_of_the_last_twelfth():
    assert judged([0.0] * 44 + [8.0, 8.0, 16.0, 16.0]) == (ANSWERED, 12.0)
    assert judged([0.0] * 44 + [8.0, 16.0, 16.0]) == (ANSWERED, pytest.approx(40 / 3))


@pytest.mark.parametrize(
    ("level", "given", "verdict"),
    [
        (2.0, {}, ANSWERED),
        (1.99, {}, TOO_SMALL),
        (1.99, {"last_step": 1}, ANSWERED),
        (1.99, {"tune_noise": 1.99 / 6}, GOES_ON),
        (1.99, {"count": 1.99 / 4}, GOES_ON),
        (1.99, {"count": 1.98 / 4}, TOO_SMALL),
    ],
)
def test_what_settles_below_a_fiftieth_of_the_range_is_too_small(level, given, verdict):
    """D123: the output steps by as much again then; after the second step every answer counts."""
    assert judged([level] * 24, **given)[0] == verdict
    assert judged([level] * 23, **given)[0] == GOES_ON, "24 points show that it settles"


@pytest.mark.parametrize(
    ("moved", "given", "settled"),
    [
        (0.1, {}, True),
        (0.101, {}, False),
        (0.5, {"rest": 0.5}, True),
        (0.501, {"rest": 0.5}, False),
        (0.5, {"tune_noise": 0.5}, True),
        (0.501, {"tune_noise": 0.5}, False),
    ],
)
def test_an_answer_has_settled_when_its_last_third_moves_by_a_fiftieth_of_it_at_most(moved, given, settled):
    """Or by what a PV at rest moves, or its noise."""
    points = [0.0] * 15 + [5.0 - moved] * 5 + [5.0] * 7
    assert judged(points, **given)[0] == (ANSWERED if settled else GOES_ON)


@pytest.mark.parametrize(
    ("samples", "period", "verdict"),
    [
        (600, 1.0, GOES_ON),
        (601, 1.0, NO_ANSWER),
        (6000, 0.1, GOES_ON),
        (6001, 0.1, NO_ANSWER),
        (256, 10.0, GOES_ON),
        (257, 10.0, NO_ANSWER),
    ],
)
def test_a_pv_that_does_not_answer_is_given_up_after_600_s_and_256_samples(samples, period, verdict):
    """D123: both of them."""
    s, aux = curve([0.0] * 300)
    s.tune_count, s.period = samples, round(period * 1e6)
    assert judge_response(s, PLACE, aux, 100.0, 0.025, 0.025, 0)[0] == verdict


@pytest.mark.parametrize(
    ("drift", "slope", "noise", "count", "moving"),
    [
        (0.5, 10.0, 0.0, 0.0, False),
        (0.501, 10.0, 0.0, 0.0, True),
        (-0.501, 10.0, 0.0, 0.0, True),
        (0.2169, 1.0, 1.0, 0.0, False),
        (0.2170, 1.0, 1.0, 0.0, True),
        (0.6507, 1.0, 1.0, 10.0, False),
        (0.6509, 1.0, 1.0, 10.0, True),
    ],
)
def test_a_pv_that_surely_moved_by_a_tenth_of_the_slope_before_the_step_was_moving(drift, slope, noise, count, moving):
    """D623; four deviations of the slope of 16 samples, of which whole counts have 0.3."""
    assert was_moving(RelayState(tune_drift=drift, tune_noise=noise, period=500_000), slope, count) == moving


def test_sixteen_samples_at_rest_give_mean_slope_and_noise():
    """The noise is the mean second difference by that of white noise of 1, √6 · √(2/π)."""
    values = [50.0 + 0.25 * k + (-1) ** (k // 2) * 0.125 * (k % 5) for k in range(16)]
    s = RelayState(tune_count=7, tune_sum=7.0, tune_base=7.0, tune_drift=7.0)
    begin_noise(s)

    assert [measure_noise(s, value) for value in values] == [False] * 15 + [True]
    assert s.tune_base == pytest.approx(sum(values) / 16)
    assert s.tune_drift == pytest.approx(linear_regression(range(16), values).slope)
    seconds = [abs(a - 2 * b + c) for a, b, c in zip(values, values[1:], values[2:], strict=False)]
    assert s.tune_noise == pytest.approx(sum(seconds) / 14 / (12 / 3.141592653589793) ** 0.5, rel=1e-4)


@pytest.mark.parametrize(("quiet", "seconds", "ended"), [(1000, 4.0, False), (1001, 4.0, True), (1001, 3.0, False)])
@pytest.mark.parametrize("begun", [0, 500])
def test_a_relay_is_stopped_when_it_has_not_switched_for_an_hour_and_1000_samples(quiet, seconds, ended, begun):
    s = RelayState(tune_count=begun + quiet, tune_points=begun, period=round(seconds * 1e6))
    assert is_stalled(s, RELAY_PATIENCE_SAMPLES, RELAY_PATIENCE_SECONDS) == ended


@pytest.mark.parametrize(("count", "ended"), [(1200, False), (1201, True)])
def test_an_hour_is_3600_s(count, ended):
    state = RelayState(tune_count=count, period=3_000_000)
    assert is_stalled(state, RELAY_PATIENCE_SAMPLES, RELAY_PATIENCE_SECONDS) == ended


@pytest.mark.parametrize(
    ("low", "high", "is_a_range"),
    [(0.0, 0.5, True), (0.0, 0.0, False), (1.0, 0.0, False), (-5e14, 5e14, True), (-6e14, 6e14, False)],
)
@pytest.mark.parametrize("ends", ["pv", "out"])
def test_an_autotune_needs_limits_of_pv_and_output_that_are_ranges(ends, low, high, is_a_range):
    c = ClickConfig(pv_low=0.0, pv_high=100.0, out_low=0.0, out_high=100.0)
    setattr(c, f"{ends}_low", low)
    setattr(c, f"{ends}_high", high)
    assert is_tunable(c) == is_a_range
