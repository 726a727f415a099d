"""Noise of transmitters: whoever draws it, the numbers are those of `random.gauss`, to the bit."""

from __future__ import annotations

import math
import random
from array import array

import pytest

from pidcfg.sim.engine import plants as noise
from pidcfg.sim.engine.choice import fast_normals
from pidcfg.sim.engine.plants import Noise, draws_alike, normals, state_of

COUNTS = (1, 2, 3, 700, 1, 625)
"""Odd ones leave the second number of a pair for the next call."""


def gauss(seed, count):
    source = random.Random(seed)
    return array("d", [source.gauss(0.0, 1.0) for _ in range(count)])


@pytest.fixture(scope="module")
def fast():
    pytest.importorskip("numba")
    return fast_normals()


def by_parts(drawn, counts=COUNTS):
    whole = array("d")
    for count in counts:
        whole.extend(drawn.rows(count))
    return whole


def test_the_kernel_as_it_is_written_draws_what_python_draws():
    assert by_parts(Noise(["a"], normals)).tobytes() == gauss("a", sum(COUNTS)).tobytes()


def test_the_compiled_kernel_draws_what_python_draws(fast):
    assert by_parts(Noise(["a"], fast), [*COUNTS, 20_001]).tobytes() == gauss("a", sum(COUNTS) + 20_001).tobytes()


def test_each_column_has_a_source_of_its_own(fast):
    wanted = array("d", bytes(8 * 3 * 500))
    for column, seed in enumerate("abc"):
        wanted[column::3] = gauss(seed, 500)

    for drawn in (Noise([*"abc"]), Noise([*"abc"], fast)):
        assert by_parts(drawn, (1, 2, 497)).tobytes() == wanted.tobytes()


def test_a_state_with_the_second_number_of_a_pair_goes_on_with_it():
    source = random.Random(3)
    source.gauss(0.0, 1.0)
    state, spare = state_of(source)
    drawn = array("d", bytes(8 * 5))
    normals(5, 0, 1, state, spare, drawn)

    assert drawn.tolist() == [source.gauss(0.0, 1.0) for _ in range(5)]


def test_without_noise_there_are_no_numbers():
    assert len(Noise([]).rows(100)) == 0


@pytest.mark.parametrize("wrong", [0, noise.TRIED - 1])
def test_one_number_that_is_off_by_its_last_bit_is_seen_and_python_draws(wrong):
    def off(rows, column, columns, state, spare, drawn):
        done = normals(rows, column, columns, state, spare, drawn)
        drawn[wrong] = math.nextafter(drawn[wrong], 9.0)
        return done

    assert draws_alike(normals)
    assert not draws_alike(off)
