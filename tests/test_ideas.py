"""Ideas that rules of several vendors share, on the least that each of them needs of a loop."""

from dataclasses import dataclass, field
from decimal import Decimal

import pytest

from pidcfg.text.frozen import frozen
from pidcfg.validate.ideas import (
    MOST_NAMES,
    NUMBERS,
    Extent,
    View,
    alarm_beyond,
    alarm_within,
    at_both,
    block_beyond_bank,
    blocks_overlap,
    complete,
    deadband_of_zero,
    hysteresis_spans_normal_zone,
    in_words,
    neighbours_out_of_order,
    number_text,
    outside_limits,
    rings,
    sharing,
    too_many_loops,
    value_or_switch,
    with_unit,
)


@frozen
class Loop:
    name: str


@frozen
class Registers(View[Loop]):
    """A loop whose registers are given by name; what has none does not fit."""

    words: dict[str, int] = field(default_factory=dict)
    pv_alarms: bool = True
    deviation_alarms: bool = True
    deadband_on: bool = True
    extents: tuple[Extent, ...] = ()

    def value(self, name):
        return self.words.get(name) or None

    def holds(self, *names):
        return complete(self.words.get(name) for name in names)

    def shown(self, name):
        return f"{self.words[name]} counts"

    def distance(self, value):
        return f"{value} apart"


def registers(**words):
    return Registers(0, Loop("A"), words)


# --- cascades and duplicates -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("masters", "expected"),
    [
        ([], []),
        ([None, 0, 1], []),
        ([0], [[0]]),
        ([1, 0], [[0, 1]]),
        ([2, 0, 1], [[0, 2, 1]]),
        ([1, 2, 3, 1], [[1, 2, 3]]),
        ([1, 0, 3, 2, 4, None], [[0, 1], [2, 3], [4]]),
    ],
    ids=["no loops", "a chain", "itself", "two", "three", "a loop outside of the ring", "several"],
)
def test_a_ring_is_told_once_from_its_first_loop_on(masters, expected):
    assert list(rings(masters)) == expected


def test_long_cascades_are_followed_in_linear_time():
    count = 20_000

    assert list(rings([*range(1, count), 0])) == [list(range(count))]


def views(*names):
    return [View(i, Loop(name)) for i, name in enumerate(names)]


def test_what_several_loops_have_is_reported_at_each_of_them():
    a, b, c, d = views("A", "B", "C", "D")
    assert list(sharing([("x", a), ("y", b), ("x", c), ("x", d)])) == [
        ("x", a, ("C", "D")),
        ("x", c, ("A", "D")),
        ("x", d, ("A", "C")),
    ]


def test_a_finding_of_two_loops_stands_at_both_and_names_the_other():
    a, b = views("A", "B")
    found = list(at_both(a, a.at("mode"), b, b.at("pv", "range"), value=3))
    assert [(f.path, f.with_loops, f.values) for f in found] == [
        (("loops", 0, "mode"), ("B",), {"value": 3}),
        (("loops", 1, "pv", "range"), ("A",), {"value": 3}),
    ]


@pytest.mark.parametrize(
    ("count", "text"),
    [
        (1, "L0"),
        (2, "L0 and L1"),
        (3, "L0, L1 and L2"),
        (MOST_NAMES, "L0, L1, L2, L3, L4, L5, L6 and L7"),
        (MOST_NAMES + 2, "L0, L1, L2, L3, L4, L5, L6, L7 and 2 more"),
    ],
)
def test_names_in_a_message(count, text):
    assert in_words([f"L{i}" for i in range(count)]) == text


# --- blocks ----------------------------------------------------------------------------------------------------------


def placed(index, first, size=10):
    return Registers(index, Loop(f"L{index}"), extents=(Extent("registers", "R", first, first + size - 1),))


@pytest.mark.parametrize(("first", "latest"), [(91, None), (92, 91)])
def test_a_block_may_end_at_the_last_address_and_not_beyond(first, latest):
    found = list(block_beyond_bank(placed(0, first), {"R": 100}))

    assert [entry.values["latest"] for entry in found] == ([] if latest is None else [latest])


@pytest.mark.parametrize(("second", "overlaps"), [(10, False), (9, True), (0, True)])
def test_blocks_overlap_where_they_share_a_register(second, overlaps):
    found = list(blocks_overlap([placed(0, 0), placed(1, second)]))

    assert [entry.path for entry in found] == [("loops", i, "registers") for i in (0, 1) if overlaps]
    assert [entry.with_loops for entry in found] == [("L1",), ("L0",)][: 2 * overlaps]


@pytest.mark.parametrize(("count", "expected"), [(2, []), (3, [("loops",)])])
def test_a_file_with_more_loops_than_there_is_room_for_is_reported_once(count, expected):
    found = list(too_many_loops([placed(i, 10 * i) for i in range(count)], 2))

    assert [entry.path for entry in found] == expected


# --- alarms ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "value", "alarm"),
    [
        ({"pv_low": 10, "pv_high": 20}, 9, "low"),
        ({"pv_low": 10, "pv_high": 20}, 10, None),
        ({"pv_low": 10, "pv_high": 20}, 20, None),
        ({"pv_low": 10, "pv_high": 20}, 21, "high"),
        ({"pv_low": 20, "pv_high": 10}, 21, None),
        ({"pv_low": 10}, 9, None),
    ],
)
def test_a_value_is_beyond_an_alarm_where_the_alarms_leave_a_zone(words, value, alarm):
    assert alarm_beyond(registers(**words), value) == alarm


def test_no_value_is_beyond_alarms_that_are_off():
    assert alarm_beyond(Registers(0, Loop("A"), {"pv_low": 10, "pv_high": 20}, pv_alarms=False), 9) is None


@pytest.mark.parametrize(
    ("width", "setpoint", "expected"),
    [
        (2, 15, None),
        (3, 15, ("deviation", 3)),
        (5, 15, ("deviation", 3)),
        (2, 12, ("low", 2)),
        (2, 19, ("high", 1)),
        (2, 10, None),
        (2, None, None),
    ],
)
def test_the_first_alarm_within_a_width_is_told_with_its_distance(width, setpoint, expected):
    view = registers(pv_low=10, pv_high=20, deviation_yellow=3)

    assert alarm_within(view, width, setpoint, ("deviation", "deviation_yellow")) == expected


def test_alarm_points_ascend_with_a_step_between_them():
    view = registers(pv_low_low=1, pv_low=1, pv_high=3, pv_high_high=2)

    assert list(neighbours_out_of_order(view, "pv")) == [("low_low", "low", True), ("high", "high_high", False)]


@pytest.mark.parametrize(("words", "keys"), [({"deadband": 0}, ["deadband_enabled"]), ({"deadband": 1}, []), ({}, [])])
def test_a_deadband_of_zero_is_reported_at_its_switch_where_no_value_is_given(words, keys):
    assert [entry.path[-1] for entry in deadband_of_zero(registers(**words))] == keys


@pytest.mark.parametrize(("hysteresis", "count"), [(9, 0), (10, 1), (12, 1), (13, 0)])
def test_a_hysteresis_spans_the_zone_up_to_where_another_rule_begins(hysteresis, count):
    view = registers(pv_low=10, pv_high=20, hysteresis=hysteresis)

    assert len(list(hysteresis_spans_normal_zone(view, 12))) == count


# --- words of messages ------------------------------------------------------------------------------------------------


def test_numbers_are_shortened_and_have_their_unit():
    assert number_text(Decimal("1.50")) == "1.5"
    assert number_text(Decimal("0.1234567890123")) == "0.123457"
    assert with_unit(Decimal(3), "bar") == "3 bar"
    assert with_unit(Decimal(3), None) == "3"


def test_a_feature_is_pointed_at_by_its_value_or_by_its_switch():
    @dataclass
    class Part:
        filter: int | None

    assert value_or_switch(Part(3), "filter") == "filter"
    assert value_or_switch(Part(None), "filter") == "filter_enabled"


# --- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [(10, 20), (Decimal(10), Decimal(20)), (15, 15), (Decimal("14.999"), 15), None])
@pytest.mark.parametrize("value", [9, 10, 15, 20, 21, Decimal("9.999"), Decimal("20.001"), None])
def test_a_value_outside_its_limits_is_a_finding_at_its_key(value, limits):
    found = list(outside_limits(registers(), "output", "bias", value=value, limits=limits, shown="{} %".format))

    is_outside = value is not None and limits is not None and not limits[0] <= value <= limits[1]
    assert len(found) == is_outside
    if found:
        assert found[0].path == ("loops", 0, "output", "bias")
        assert found[0].values == {"value": f"{value} %", "low": str(limits[0]), "high": f"{limits[1]} %"}


@pytest.mark.parametrize("units", [(), ("low",), ("value", "high"), NUMBERS])
def test_a_finding_about_limits_has_units_where_its_message_wants_them(units):
    (found,) = outside_limits(
        registers(), "SV", value=3, limits=(1, 2), shown="{} C".format, units=units, field="sv", what="x"
    )

    assert found.values == {
        "sv": "3 C" if "value" in units else "3",
        "low": "1 C" if "low" in units else "1",
        "high": "2 C" if "high" in units else "2",
        "what": "x",
    }
