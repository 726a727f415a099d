"""The blocks of a DL06 that a client reads, from the words that say where they are."""

from __future__ import annotations

from pathlib import Path

import pytest

import pidcfg
from pidcfg.encoders.dl06.image import areas
from pidcfg.encoders.image import Area, AreaError
from pidcfg.encoders.maps.dl06 import LOOP_COUNT, LOOP_TABLE, LOOP_TABLES, RAMP_SOAK_PAIR, SETUP_WORDS, TABLE_POINTER

EXAMPLES = Path(__file__).parents[1] / "examples"
SETUP = Area(TABLE_POINTER, SETUP_WORDS)
WORDS = {TABLE_POINTER: 0o2000, LOOP_COUNT: 2}
PROFILE = 0o2000 + LOOP_TABLE.offset("ramp_soak_table")


def test_the_set_up_words_come_first_and_the_loops_from_them():
    assert areas({}, None, {}) == [SETUP]
    tables = [Area(0o2000, LOOP_TABLES[1], "LOOP-1"), Area(0o2040, LOOP_TABLES[1], "LOOP-2")]
    assert areas(WORDS, None, {}) == [SETUP, *tables]
    assert areas(WORDS, None, {"number_of_loops": 1, "reset_decimals": 2}) == [
        SETUP,
        Area(0o2000, LOOP_TABLES[2], "LOOP-1"),
    ]


def test_a_configuration_names_the_loops_as_far_as_it_has_them():
    like = pidcfg.encode((EXAMPLES / "dl06/oven.yaml").read_text("utf-8")).image
    found = areas({**WORDS, LOOP_COUNT: 3}, like, {})
    assert [area.loop for area in found[1:]] == [*(entry["loop"] for entry in like.settings), "LOOP-2", "LOOP-3"]


@pytest.mark.parametrize(
    ("start", "there"),
    [
        (0o377, False),
        (0o400, True),
        (0o640, True),
        (0o641, False),
        (0o7540, True),
        (0o7541, False),
        (0o17740, True),
        (0o17741, False),
    ],
)
def test_a_profile_is_read_where_its_32_words_are_user_memory(start, there):
    """User memory: V400 to V677 and V10000 to V17777 (Addr + 36), V1200 up to the boundary at V7577 (V7642, bit 3)."""
    pairs = [Area(start + 4 * k, RAMP_SOAK_PAIR, "LOOP-1", f"ramp_soak[{k}].") for k in range(8)] if there else []
    found = areas({**WORDS, PROFILE: start}, None, {"number_of_loops": 1})
    assert found == [SETUP, Area(0o2000, LOOP_TABLES[1], "LOOP-1"), *pairs]


@pytest.mark.parametrize("count", [0, 9, 0x0A])
def test_a_number_of_loops_that_is_none_is_told_with_the_way_round_it(count):
    with pytest.raises(AreaError, match=f"V7641 holds 0x{count:04X}.*--number-of-loops"):
        areas({**WORDS, LOOP_COUNT: count}, None, {})
