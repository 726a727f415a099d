"""Random numbers by counters, the bound, and counting: what a batch rests on, without a run."""

from __future__ import annotations

import random
from fractions import Fraction
from hashlib import sha256
from math import comb, inf, log, nextafter
from statistics import NormalDist, fmean

import pytest

from certify_bound import SHARE, held_by
from certify_rig import normal, uniform
from pidcfg.study.certification.certify import BOUND_RISK, log_tail, lower_bound, samples_needed
from pidcfg.study.certification.samples import (
    GOLDEN_STEP,
    DrawError,
    bits_of,
    draw_number,
    fifth_bounds,
    mix_bits,
    seed_of,
    unit_number,
)
from pidcfg.study.certification.tally import BLOCK_SAMPLES, Distribution, bin_of, upper_edge

# --- draws -----------------------------------------------------------------------------------------------------------


def test_the_numbers_are_those_of_splitmix64():
    published = [
        6457827717110365317,
        3203168211198807973,
        9817491932198370423,
        4593380528125082431,
        16408922859458223821,
    ]
    assert [mix_bits(1234567 + (i + 1) * GOLDEN_STEP) for i in range(5)] == published
    assert [bits_of(1234567, i) for i in range(5)] == published
    assert seed_of(1234567, 0) == published[0] >> 1 < 1 << 63


def test_a_number_depends_on_seed_sample_and_name_alone():
    numbers = {unit_number(seed, i, row, k) for seed in (1, 2) for i in range(50) for row in ("a", "b") for k in (0, 1)}
    assert len(numbers) == 2 * 50 * 2 * 2
    assert all(0 < number < 1 for number in numbers)
    assert (
        draw_number(uniform(1, 2), 7, 5) == draw_number(uniform(1, 2), 7, 5) != draw_number(uniform(1, 2, "load"), 7, 5)
    )


def test_a_row_begins_at_the_bits_of_its_sample_and_its_name():
    bits = int.from_bytes(sha256(b"plants.TIC-1.gain").digest()[:8], "big")
    begin = mix_bits(bits_of(7, 3) ^ bits)
    for draw in range(3):
        number = mix_bits(begin + (draw + 1) * GOLDEN_STEP) >> 11
        assert unit_number(7, 3, "plants.TIC-1.gain", draw) == (number + 0.5) / 2**53


def test_a_negative_and_a_large_seed_are_seeds():
    assert len({bits_of(seed, 0) for seed in (-1, 0, 1, 1 << 63, (1 << 64) - 2)}) == 5


def test_a_uniform_number_covers_its_range_evenly():
    values = [draw_number(uniform(40, 90), 1, i) for i in range(4000)]
    assert 40 <= min(values) < 40.1
    assert 89.9 < max(values) <= 90
    counts = [sum(low <= value < low + 10 for value in values) for low in range(40, 90, 10)]
    assert all(700 < count < 900 for count in counts)


def test_a_normal_number_has_its_mean_and_deviation():
    values = [draw_number(normal(8, 2), 3, i) for i in range(4000)]
    found = NormalDist.from_samples(values)
    assert abs(found.mean - 8) < 0.12
    assert abs(found.stdev - 2) < 0.1


def test_limits_draw_again_from_the_same_row():
    wide, narrow = normal(8, 2), normal(8, 2, 7, 9)
    rows = [[unit_number(1, i, wide.row, k) for k in range(100)] for i in range(300)]
    inside = [next(v for v in (8 + 2 * NormalDist().inv_cdf(u) for u in row) if 7 <= v <= 9) for row in rows]
    assert [draw_number(narrow, 1, i) for i in range(300)] == inside
    assert any(draw_number(wide, 1, i) != inside[i] for i in range(300))


def test_a_hundred_numbers_without_one_within_the_limits_are_enough():
    with pytest.raises(DrawError, match=r"TIC-1 gain: 100 numbers, none within 30 to 31"):
        draw_number(normal(8, 2, 30, 31), 1, 0)
    first = next(
        i for i in range(500) if not 12 <= 8 + 2 * NormalDist().inv_cdf(unit_number(1, i, "plants.TIC-1.gain")) <= 99
    )
    assert 12 <= draw_number(normal(8, 2, 12, 99), 1, first) <= 99


@pytest.mark.parametrize("what", [uniform(40, 90), normal(8, 2), normal(8, 2, 4, 9), normal(8, 2, 9, inf)])
def test_a_fifth_of_the_samples_lies_in_each_outer_fifth(what):
    low, high = fifth_bounds(what.ends)
    values = [draw_number(what, 5, i) for i in range(3000)]
    assert abs(fmean(value < low for value in values) - 0.2) < 0.03
    assert abs(fmean(value >= high for value in values) - 0.2) < 0.03


# --- the bound -------------------------------------------------------------------------------------------------------


def tail(passed, samples, share):
    """The probability that at least so many pass, in fractions."""
    p = Fraction(share)
    return sum(comb(samples, k) * p**k * (1 - p) ** (samples - k) for k in range(passed, samples + 1))


@pytest.mark.parametrize(("passed", "samples"), [(1, 1), (1, 7), (59, 59), (58, 60), (3, 30), (99, 100), (150, 300)])
def test_the_bound_is_where_the_exact_tail_is_the_risk(passed, samples):
    bound = lower_bound(passed, samples)
    assert abs(float(tail(passed, samples, bound)) / BOUND_RISK - 1) < 1e-10
    assert log_tail(passed, samples, bound) < log(BOUND_RISK) <= log_tail(passed, samples, nextafter(bound, 1))
    assert tail(passed, samples, bound * (1 - 1e-9)) < BOUND_RISK < tail(passed, samples, bound * (1 + 1e-9))


def test_the_bound_in_special_cases():
    assert lower_bound(0, 100) == 0
    assert lower_bound(100, 100) == pytest.approx(0.05 ** (1 / 100), rel=1e-12)
    assert lower_bound(2000, 2000) == pytest.approx(0.998503, abs=1e-6)
    assert lower_bound(1_000_000, 1_000_000) < 1
    half = lower_bound(500_000, 1_000_000)
    assert half == pytest.approx(0.5 - 1.6449 * 0.0005, abs=2e-6)
    assert log_tail(500_000, 1_000_000, half) < log_tail(500_000, 1_000_000, nextafter(half, 1))


def test_how_many_samples_show_a_share():
    assert [samples_needed(share) for share in (0.99, 0.999, 0.95, 0.5, 0.04)] == [299, 2995, 59, 5, 1]
    for share in (0.5, 0.9, 0.99, 0.999, 0.9999):
        needed = samples_needed(share)
        assert lower_bound(needed, needed) >= share
        assert needed == 1 or lower_bound(needed - 1, needed - 1) < share


def test_the_bound_lies_below_a_share_in_closed_form_at_least_as_often_as_it_says():
    """PV = 50 gain is at most 120 where the gain is at most 2.4: 5 of 6 of 1.4 to 2.6; 200 seeds of 100 samples."""
    share, below = (2.4 - 1.4) / (2.6 - 1.4), 0
    for seed in range(200):
        passed = sum(50 * draw_number(uniform(1.4, 2.6), seed, i) <= 120 for i in range(100))
        below += lower_bound(passed, 100) <= share
    assert 180 <= below < 200


def test_batches_that_run_count_what_is_drawn():
    """The same plants through `tests/certify_bound.py`, which runs them: 3 seeds of 40 samples."""
    for seed in range(3):
        drawn_ones = sum(50 * draw_number(uniform(1.4, 2.6), seed, i) <= 120 for i in range(40))
        assert held_by(seed, 40) == drawn_ones
    assert abs(SHARE - 5 / 6) < 1e-15


# --- counting --------------------------------------------------------------------------------------------------------


def test_a_bin_is_sign_exponent_and_eight_bits():
    assert bin_of(1.0) == bin_of(1 + 1 / 257) != bin_of(1 + 1 / 256)
    assert bin_of(-1.0) == bin_of(1.0) + (1 << 19)
    assert upper_edge(bin_of(1.0)) == 1 + 1 / 256
    assert upper_edge(bin_of(-1.0)) == -1.0
    assert upper_edge(bin_of(-1.001)) == -1.0
    assert upper_edge(bin_of(0.0)) == upper_edge(bin_of(-0.0)) == upper_edge(bin_of(1e-310)) == 0.0
    assert (bin_of(1.5 * 2.0**-1023), bin_of(2.0**-1022)) == (0, 1 << 8)


def test_an_edge_is_at_most_a_bin_above_its_number():
    source = random.Random(1)
    for _ in range(2000):
        value = source.uniform(-1, 1) * 10 ** source.uniform(-12, 12)
        assert value <= upper_edge(bin_of(value)) <= value + abs(value) / 256


def filled(values):
    """A distribution of numbers, a sample each."""
    found = Distribution()
    for i, value in enumerate(values, 1):
        found.add(value)
        if i % BLOCK_SAMPLES == 0:
            found.end_block()
    return found


def test_quantiles_are_edges_of_the_bins_in_which_they_lie():
    values = [float(i) for i in range(-500, 501)]
    found = filled(values)
    assert (found.count, found.low, found.high, found.mean) == (1001, -500, 500, 0)
    for share, exact in ((0.0, -500), (0.05, -450), (0.5, 0), (0.95, 450), (1.0, 500)):
        assert exact <= found.quantile(share) <= exact + abs(exact) / 256
    with pytest.raises(ValueError, match="nothing was measured"):
        Distribution().quantile(0.5)


def test_the_mean_is_a_sum_over_blocks():
    source = random.Random(2)
    values = [source.uniform(0, 1e6) for _ in range(3 * BLOCK_SAMPLES + 17)]
    total = 0.0
    for begin in range(0, len(values), BLOCK_SAMPLES):
        part = 0.0
        for value in values[begin : begin + BLOCK_SAMPLES]:
            part += value
        total += part
    assert filled(values).mean == total / len(values)
    assert total != sum(values)


def test_a_distribution_goes_on_from_its_state():
    source = random.Random(3)
    values = [source.gauss(0, 5) for _ in range(BLOCK_SAMPLES + 300)]
    first = Distribution.of_state(filled(values[:200]).state())
    for i, value in enumerate(values[200:], 201):
        first.add(value)
        if i % BLOCK_SAMPLES == 0:
            first.end_block()
    assert first == filled(values)
