"""V7642, +35 and the alarm order as the CPU works them out, at every edge."""

from __future__ import annotations

import pytest

from pidcfg.encoders.codecs import bcd_word
from pidcfg.encoders.dl06.image import Setup, alarm_order_broken, check_ramp_soak, check_setup


def flags(start, count):
    return check_setup(start, bcd_word(count)).flags


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (0o0, 1),
        (0o1177, 1),
        (0o1200, 0),
        (0o7340, 0),
        (0o7341, 1),
        (0o7577, 1),
        (0o7640, 1),
        (0o7777, 1),
        (0o10000, 0),
        (0o17740, 0),
        (0o17741, 2),
        (0o20000, 2),
        (0o177777, 2),
    ],
)
def test_the_start_of_the_table_sets_bit_0_below_v10000_and_bit_1_from_there(start, expected):
    assert flags(start, 1) == expected


@pytest.mark.parametrize(("count", "expected"), [(0, 0), (1, 0), (8, 0), (9, 4), (10, 4)])
def test_more_than_eight_loops_set_bit_2(count, expected):
    assert flags(0o2000, count) == expected


@pytest.mark.parametrize(
    ("start", "count", "expected"),
    [
        (0o7340, 5, 0),  # ends at V7577
        (0o7340, 6, 8),
        (0o7000, 8, 0),  # ends at V7377
        (0o7577 - 0o37, 1, 1),  # V7540 is no start, however short the table
        (0o17740, 8, 0),  # past V17777, which the CPU does not look at
    ],
)
def test_a_table_past_v7577_sets_bit_3_in_the_lower_range_only(start, count, expected):
    assert flags(start, count) == expected


def test_the_last_fitting_start_of_eight_loops_is_v7200():
    assert flags(0o7200, 8) == 0
    assert flags(0o7201, 8) == 8


def test_faults_add_up():
    assert flags(0o7340, 9) == 4 | 8
    assert flags(0o1000, 9) == 1 | 4
    assert flags(0o17777, 9) == 2 | 4


@pytest.mark.parametrize("word", [0x000A, 0x00F0, 0xFFFF])
def test_a_count_that_is_no_bcd_number_counts_as_too_many(word):
    assert check_setup(0o2000, word) == Setup(0o2000, 0, 4)


def test_no_word_makes_the_check_fail():
    """Any 16-bit words can be read; each start belongs to one range, so bits 0 and 1 exclude each other."""
    for start in range(0x10000):
        found = check_setup(start, start ^ 0x1234).flags
        assert 0 <= found < 16
        assert found & 3 != 3


def test_the_loop_task_runs_with_loops_and_without_flags():
    assert check_setup(0o2000, 4).running
    assert not check_setup(0o2000, 0).running
    assert not check_setup(0o2000, 9).running


@pytest.mark.parametrize(
    ("start", "expected"),
    [
        (0o1177, 1),
        (0o1200, 0),
        (0o3000, 0),
        (0o7540, 0),
        (0o7541, 1),
        (0o7577, 1),
        (0o7600, 16),
        (0o7777, 16),
        (0o10000, 0),
        (0o17740, 0),
        (0o17741, 2),
        (0o20000, 2),
        (0, 1),
    ],
)
def test_a_ramp_soak_table_outside_user_memory_sets_one_bit_of_35(start, expected):
    assert check_ramp_soak(start) == expected


@pytest.mark.parametrize(
    ("pv", "deviation", "broken"),
    [
        ([1, 2, 3, 4], None, False),
        ([1, 1, 3, 4], None, True),
        ([1, 2, 2, 4], None, True),
        ([1, 2, 4, 4], None, True),
        ([4, 3, 2, 1], None, True),
        (None, [1, 2], False),
        (None, [2, 2], True),
        (None, [3, 2], True),
        (None, None, False),
        ([1, 2, 3, 4], [2, 1], True),
        ([0, 0, 0, 0], None, True),
    ],
)
def test_alarms_must_be_in_order_when_their_group_is_on(pv, deviation, broken):
    assert alarm_order_broken(pv, deviation) is broken
