"""The share of a first-order lag: against the library's e^x, and as a number of its own."""

from __future__ import annotations

import math
import random
from itertools import pairwise

import pytest

pytest.importorskip("numba")

from pidcfg.sim.controllers.nextopid.terms import ALL_THE_WAY, lag_share
from pidcfg.sim.engine.compile import compile_functions

EXACT = 1e-15


def exact(x):
    """1 − e^(−x)."""
    return -math.expm1(-x)


def off(x):
    """Relative error of the share."""
    return abs(lag_share(x) / exact(x) - 1.0)


def test_it_is_the_share_of_a_lag_from_the_shortest_to_the_longest_time():
    rng = random.Random(1)
    points = [10.0 ** rng.uniform(-12.0, math.log10(50.0)) for _ in range(40_000)]

    assert max(off(x) for x in points) < EXACT


@pytest.mark.parametrize("edge", [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 50.0])
def test_it_has_no_jump_where_it_is_calculated_in_another_way(edge):
    around = [math.nextafter(edge, 0.0), edge, math.nextafter(edge, 100.0)]

    assert max(off(x) for x in around) < EXACT


def test_nothing_in_no_time_and_everything_in_a_long_one():
    assert lag_share(0.0) == 0.0
    assert lag_share(ALL_THE_WAY) == lag_share(1e300) == lag_share(math.inf) == 1.0
    assert lag_share(5e-324) == 5e-324


@pytest.mark.parametrize(
    ("x", "expected"), [(0.1, 0.09516258196404043), (1.0, 0.6321205588285577), (0.01, 0.009950166250831947)]
)
def test_known_values(x, expected):
    assert lag_share(x) == pytest.approx(expected, rel=EXACT)


def test_it_never_leaves_0_to_1_and_rises_with_the_time():
    rng = random.Random(2)
    points = sorted(10.0 ** rng.uniform(-12.0, 2.0) for _ in range(20_000))
    shares = [lag_share(x) for x in points]

    assert all(0.0 < a <= 1.0 for a in shares)
    assert all(b - a > -EXACT for a, b in pairwise(shares))


def test_two_halves_are_the_whole():
    for x in (1e-9, 0.3, 0.9, 3.0, 20.0):
        half = lag_share(x / 2.0)
        assert half + (1.0 - half) * half == pytest.approx(lag_share(x), rel=2.0 * EXACT)


def test_it_is_the_same_compiled():
    fast = compile_functions([lag_share])[lag_share]
    rng = random.Random(3)
    points = [10.0 ** rng.uniform(-12.0, 2.0) for _ in range(5_000)]

    assert [fast(x) for x in points] == [lag_share(x) for x in points]
