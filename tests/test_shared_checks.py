"""Ideas that rules of several vendors share, on the least that each of them needs of a loop."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, replace
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace as Facts

import pytest

import pidcfg as api
from one_loop import PLANT
from pidcfg.schemas.dl06 import Tuning
from pidcfg.schemas.numbers import NUMBER, number_cure
from pidcfg.study.scenario import check_scenario
from pidcfg.text.document import LINE_BREAK
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.rules import Scales, _range_text
from pidcfg.validate.schema import KIND_TEXTS, _shape_cure
from pidcfg.validate.shared_checks import (
    MAX_NAMES,
    NUMBER_FIELDS,
    Extent,
    View,
    all_or_none,
    block_beyond_bank,
    blocks_overlap,
    exceeded_alarm,
    find_circles,
    find_shared_keys,
    hysteresis_spans_normal_zone,
    list_names,
    nearby_alarm,
    neighbours_out_of_order,
    number_text,
    number_with_unit,
    outside_limits_findings,
    report_at_both,
    too_many_loops,
    value_or_switch_key,
    zero_deadband_findings,
)
from pidcfg.validate.terms import _unit_of
from pidcfg.vendors import VENDORS

# --- Ideas that rules of several vendors share, on the least that each of them needs of a loop ------------------------


@frozen
class Loop:
    name: str


@frozen
class Registers(View[Loop]):
    """A loop whose registers are given by name; what has none does not fit."""

    words: dict[str, int] = field(default_factory=dict)
    pv_alarms_on: bool = True
    deviation_alarms_on: bool = True
    deadband_on: bool = True
    extents: tuple[Extent, ...] = ()

    def value(self, name):
        return self.words.get(name) or None

    def register_values(self, *names):
        return all_or_none(self.words.get(name) for name in names)

    def quote(self, name):
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
    assert list(find_circles(masters)) == expected


def test_long_cascades_are_followed_in_linear_time():
    count = 20_000

    assert list(find_circles([*range(1, count), 0])) == [list(range(count))]


def views(*names):
    return [View(i, Loop(name)) for i, name in enumerate(names)]


def test_what_several_loops_have_is_reported_at_each_of_them():
    a, b, c, d = views("A", "B", "C", "D")
    assert list(find_shared_keys([("x", a), ("y", b), ("x", c), ("x", d)])) == [
        ("x", a, ("C", "D")),
        ("x", c, ("A", "D")),
        ("x", d, ("A", "C")),
    ]


def test_a_finding_of_two_loops_stands_at_both_and_names_the_other():
    a, b = views("A", "B")
    found = list(report_at_both(a, a.report("mode"), b, b.report("pv", "range"), value=3))
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
        (MAX_NAMES, "L0, L1, L2, L3, L4, L5, L6 and L7"),
        (MAX_NAMES + 2, "L0, L1, L2, L3, L4, L5, L6, L7 and 2 more"),
    ],
)
def test_names_in_a_message(count, text):
    assert list_names([f"L{i}" for i in range(count)]) == text


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
    assert exceeded_alarm(registers(**words), value) == alarm


def test_no_value_is_beyond_alarms_that_are_off():
    assert exceeded_alarm(Registers(0, Loop("A"), {"pv_low": 10, "pv_high": 20}, pv_alarms_on=False), 9) is None


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

    assert nearby_alarm(view, width, setpoint, ("deviation", "deviation_yellow")) == expected


def test_alarm_points_ascend_with_a_step_range_text_them():
    view = registers(pv_low_low=1, pv_low=1, pv_high=3, pv_high_high=2)

    assert list(neighbours_out_of_order(view, "pv")) == [("low_low", "low", True), ("high", "high_high", False)]


@pytest.mark.parametrize(("words", "keys"), [({"deadband": 0}, ["deadband_enabled"]), ({"deadband": 1}, []), ({}, [])])
def test_a_deadband_of_zero_is_reported_at_its_switch_where_no_value_is_given(words, keys):
    assert [entry.path[-1] for entry in zero_deadband_findings(registers(**words))] == keys


@pytest.mark.parametrize(
    ("low", "hysteresis", "count"), [(10, 9, 0), (10, 10, 1), (10, 12, 1), (10, 13, 0), (19, 1, 1), (20, 1, 0)]
)
def test_a_hysteresis_spans_the_zone_up_to_where_another_rule_begins(low, hysteresis, count):
    view = registers(pv_low=low, pv_high=20, hysteresis=hysteresis)

    assert len(list(hysteresis_spans_normal_zone(view, 12))) == count


# --- words of messages ------------------------------------------------------------------------------------------------


def test_numbers_are_shortened_and_have_their_unit():
    assert number_text(Decimal("1.50")) == "1.5"
    assert number_text(Decimal("0.1234567890123")) == "0.123457"
    assert number_with_unit(Decimal(3), "bar") == "3 bar"
    assert number_with_unit(Decimal(3), None) == "3"


def test_a_feature_is_pointed_at_by_its_value_or_by_its_switch():
    @dataclass
    class Part:
        filter: int | None

    assert value_or_switch_key(Part(3), "filter") == "filter"
    assert value_or_switch_key(Part(None), "filter") == "filter_enabled"


# --- limits ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limits", [(10, 20), (Decimal(10), Decimal(20)), (15, 15), (Decimal("14.999"), 15), None])
@pytest.mark.parametrize("value", [9, 10, 15, 20, 21, Decimal("9.999"), Decimal("20.001"), None])
def test_a_value_outside_its_limits_is_a_finding_at_its_key(value, limits):
    found = list(
        outside_limits_findings(registers(), "output", "bias", value=value, limits=limits, quote="{} %".format)
    )

    is_outside = value is not None and limits is not None and not limits[0] <= value <= limits[1]
    assert len(found) == is_outside
    if found:
        assert found[0].path == ("loops", 0, "output", "bias")
        assert found[0].values == {"value": f"{value} %", "low": str(limits[0]), "high": f"{limits[1]} %"}


@pytest.mark.parametrize("units", [(), ("low",), ("value", "high"), NUMBER_FIELDS])
def test_a_finding_about_limits_has_units_where_its_message_wants_them(units):
    (found,) = outside_limits_findings(
        registers(), "SV", value=3, limits=(1, 2), quote="{} C".format, units=units, field="sv", what="x"
    )

    assert found.values == {
        "sv": "3 C" if "value" in units else "3",
        "low": "1 C" if "low" in units else "1",
        "high": "2 C" if "high" in units else "2",
        "what": "x",
    }


# --- What is written the way people write it is refused with the way it is written here; no value changes silently ----

EVENT = """\
pidcfg: 1
scenario: step
config: a.yaml
duration: 10
plants: {A: {model: first_order, gain: 1, time_constant: 60}}
events:
  - {at: 5, loop: A, sp: 80}
"""


def first(text):
    data = text if isinstance(text, bytes) else text.encode()
    return min(check_document(read_document(data, "a.yaml")).findings, key=lambda d: d.sort_key)


def test_the_plant_is_a_good_one():
    assert not [d for d in check_document(read_document(PLANT.encode(), "a.yaml")).findings if d.severity > 1]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("2,5", "write 2.5: the decimal sign is a point"),
        ("-2,50", "write -2.50: the decimal sign is a point"),
        ("2,0", "write 2.0: the decimal sign is a point"),
        ("1,800", "write 1.800 or 1800: a comma says neither"),
        ("1,800.0", "write 1800.0: nothing stands between thousands"),
        ("1.800,0", "write 1800.0: nothing stands between thousands"),
        ("1'085.0", "write 1085.0: nothing stands between thousands"),
        ("1 085", "write 1085: nothing stands between thousands"),
        ("1\N{NO-BREAK SPACE}085", "write 1085: nothing stands between thousands"),
        ("1,234,567", "write 1234567: nothing stands between thousands"),
        ("85 %", "write the number alone; it is taken in the key's own unit, which need not be %"),
        ("85°C", "write the number alone; it is taken in the key's own unit, which need not be °C"),
        ("2.50 %/degC", "write the number alone; it is taken in the key's own unit, which need not be %/degC"),
        (
            "2,5 degC",
            "write 2.5: the decimal sign is a point; it is taken in the key's own unit, which need not be degC",
        ),
        ("2,5 counts", "write 2.5: the decimal sign is a point; counts may stay"),
        ("\N{EN DASH}5", "write -5: U+2013 is a dash, not a minus"),
        ("\N{MINUS SIGN}2.5", "write -2.5: U+2212 is a dash, not a minus"),
        ("5\N{NO-BREAK SPACE}", "write 5: U+00A0 is a no-break space, not a space"),
        (
            "\N{LEFT DOUBLE QUOTATION MARK}5\N{RIGHT DOUBLE QUOTATION MARK}",
            "write 5: U+201C is a quote, not a quote of YAML",
        ),
        ("abc", None),
        ("2.5.6", None),
        ("12.345.678", "write 12345678: nothing stands between thousands"),
        ("1O0", "write 100: a letter stands where a digit belongs"),
        ("\N{FULLWIDTH DIGIT TWO}", "write 2: U+FF12 is FULLWIDTH DIGIT TWO"),
        ("1/3", None),
        ("1,2,3", None),
        ("5 - 6", None),
        ("5 counts", None),
        ("", None),
    ],
)
def test_the_cure_of_a_text_that_is_no_number(text, says):
    assert number_cure(text) == says


@pytest.mark.parametrize(
    ("before", "after", "place", "message", "cure"),
    [
        (
            "gain: 2.5",
            "gain: 2,5",
            (8, 22),
            "5 has no value",
            "write 2.5: the decimal sign is a point; 2,5 inside braces is two keys",
        ),
        ("100}", "1,800.0}", (8, 34), "800.0 has no value", "write 1800.0: nothing stands between thousands"),
        ("sample_rate: 2", "sample_rate: 2,5", (6, 18), "sample_rate: '2,5' is not a number", "write 2.5"),
        ("sample_rate: 2", "sample_rate: 2,5 s", (6, 18), "sample_rate: '2,5 s' is not a time", "write 2.5"),
        ("sample_rate: 2", "sample_rate: 2 parsec", (6, 18), "'2 parsec' is not a time", "units are ms, s, min and h"),
        ("sample_rate: 2", f"sample_rate: 1{' 1' * 2000}", (6, 18), "1' is not a number", "write one number in digits"),
        ("sample_rate: 2", f"sample_rate: {'1' * 4000}!", (6, 18), "1!' is not a number", "write one number in digits"),
        ("400]", "400,5]", (9, 17), "a list of two values, not of 3", "that is a point"),
        ("400]", "1e-320]", (9, 21), "range: 1e-320 is too small; the limit is 1e-300", "write 0 where that is meant"),
        ("400]", "1e301]", (9, 21), "range: 1e301 is too large; the limit is 1e300", "write a smaller number"),
        ("value: 85", "value: 85 °F", (10, 23), "value: '85 °F' is not a number", "the key is in degC, not in degF"),
        ("value: 85", "value: 1e-3 counts", (10, 23), "setpoint is 0.001 counts, but raw counts are whole", "round it"),
        (
            "value: 85",
            "value: 1e300",
            (10, 23),
            "setpoint is 1e+300 degC, but its word holds 0 to 400",
            "write a value that the word holds",
        ),
        (
            "  - name",
            "    name",
            (5, 5),
            "loops must be a list, not a mapping",
            "begin each item of loops with a dash: '- name: …'",
        ),
        ("gain", "Kp", (8, 14), "unknown key 'Kp'", "did you mean gain?"),
        ("    setpoint: {value: 85}", "    sp: 85", (10, 5), "unknown key 'sp'", "did you mean setpoint: {value: …}?"),
        (
            "    setpoint",
            "    alarms: {low: 5}\n    setpoint",
            (10, 14),
            "unknown key 'low'",
            "did you mean pv: {low: …}?",
        ),
        (
            "    setpoint",
            "    reset: 5\n    setpoint",
            (10, 5),
            "unknown key 'reset'",
            "did you mean tuning: {reset: …}?",
        ),
        ("dl06", "click", (2, 9), "this looks like dl06: its keys are those of the file", "write vendor: dl06"),
        (PLANT[PLANT.index("loops:") :], "loops: [null]\n", (4, 9), "item 1 of loops has no value", "remove the item"),
        (
            PLANT[PLANT.index("loops:") :],
            "loops: []\n",
            (4, 1),
            "the list of loops is empty: there is nothing",
            "add a loop",
        ),
    ],
)
def test_where_it_stands_what_it_is_and_what_to_do(before, after, place, message, cure):
    assert before in PLANT
    d = first(PLANT.replace(before, after))
    assert d.severity.label == "error"
    assert (d.span.line, d.span.column) == place
    assert message in d.message
    assert cure in d.help


def test_a_key_of_an_event_is_named():
    (d,) = api.load(EVENT).findings
    assert (d.message, d.help) == ("unknown key 'sp'", "did you mean set: {setpoint: …}?")


def test_another_unit_in_an_event_is_told_with_that_of_the_key(tmp_path):
    (tmp_path / "a.yaml").write_text(PLANT, "utf-8")
    (tmp_path / "s.yaml").write_text(EVENT.replace("sp: 80", "set: {setpoint: 203 °F}"), "utf-8")
    doc = read_document((tmp_path / "s.yaml").read_bytes(), str(tmp_path / "s.yaml"))
    (d,) = [d for d in check_scenario(doc) if d.code == "PID053"]
    assert (d.message, d.help) == (
        "setpoint: '203 °F' is not a number",
        "the key is in degC, not in degF: write the number of degC alone",
    )


@pytest.mark.parametrize("kind", [*KIND_TEXTS, "value_error"])
@pytest.mark.parametrize("inner", [None, Tuning])
@pytest.mark.parametrize(("value", "first", "named"), [(5, "gain: …", "gain: …"), ({"A": {}}, "A: …", "name: A")])
def test_the_shape_that_is_wanted_is_shown_where_the_schema_has_one(kind, inner, value, first, named):
    for key, item in (("k", first), ("loops", named)):
        cure = None
        if KIND_TEXTS.get(kind) == "a list" and (inner is not None or isinstance(value, dict)):
            cure = f"begin each item of {key} with a dash: '- {item}'"
        elif kind in KIND_TEXTS and inner is not None:
            cure = f"write '{key}: {{gain: …}}'; known keys here: gain, reset, reset_unit, rate"
        assert _shape_cure(kind, key, value, inner) == cure


@pytest.mark.parametrize(
    ("before", "after", "cure"),
    [
        ("[0, 400]", "(0, 400)", "write [0, 400]: a list stands in square brackets"),
        ("[0, 400]", "(-10.5, 400)", "write [-10.5, 400]: a list stands in square brackets"),
        ("[0, 400]", "(0, 400", None),
        ("[0, 400]", "0, 400)", None),
        ("2.5", "-2,5", "write -2.5: the decimal sign is a point; -2,5 inside braces is two keys"),
        ("2.5", "25,75", "write 25.75: the decimal sign is a point; 25,75 inside braces is two keys"),
        ("2.5", "2,5 s", "write 2.5: the decimal sign is a point; s may stay; 2,5 s inside braces is two keys"),
        ("2.5", "2,x", None),
        ("degC", "degC,5", None),
    ],
)
def test_a_comma_in_braces_makes_a_key_of_what_stands_behind_it(before, after, cure):
    assert PLANT.count(before) == 1
    found = check_document(read_document(PLANT.replace(before, after).encode(), "a.yaml")).findings
    assert [d.help for d in found if d.code == "PID037"] == [cure or "give a value, or remove the key"]


def test_a_file_with_one_odd_key_is_still_of_its_vendor():
    assert "this looks like" not in first(PLANT.replace("gain", "proportional_gain")).message


@pytest.mark.parametrize(("channel", "lines"), [(2, [(9, 39), (17, 14)]), (3, [])])
def test_a_channel_that_one_loop_reads_and_another_writes_is_told_at_both(channel, lines):
    reading = PLANT.replace("unit: degC}", "unit: degC, transfer: {slot: 1, channel: 2}}")
    writing = PLANT[PLANT.index("  - name:") :].replace("name: A", "name: B")
    writing += f"    output: {{transfer: {{slot: 1, channel: {channel}}}}}\n"
    found = check_document(read_document(f"{reading}{writing}".encode(), "a.yaml")).findings
    assert [(d.span.line, d.span.column) for d in found if d.code == "DL293"] == lines


@pytest.mark.parametrize("count", [2, 3])
def test_a_file_of_more_loops_than_are_read_is_refused_at_its_list(count):
    loop = PLANT[PLANT.index("  - name:") :]
    text = PLANT + "".join(loop.replace("name: ", f"name: L{n}_", 1) for n in range(1, count))
    found = check_document(read_document(text.encode(), "a.yaml", replace(DEFAULT, loops=2)))
    assert found.vendor.key == "dl06"
    told = [(d.message, d.span.line) for d in found.findings if d.code == "PID013"]
    assert told == [("more than 2 loops", PLANT.splitlines().index("loops:") + 1)] * (count > 2)


@pytest.mark.parametrize(("count", "told"), [(1, "L1"), (3, "L1, L2, L3"), (4, "L1, L2, L3 and 1 more")])
def test_three_loops_that_cannot_be_read_are_named(count, told):
    loop = PLANT[PLANT.index("  - name:") :]
    name = loop.split("name: ", 1)[1].split("\n", 1)[0]
    bad = "".join(loop.replace(name, f"L{n}", 1).replace("gain:", "gian:") for n in range(1, count + 1))
    found = check_document(read_document((PLANT + bad).encode(), "a.yaml")).findings
    (remark,) = [d.message for d in found if d.code == "PID038"]
    assert remark.startswith(f"{told} cannot be read: ")


@pytest.mark.parametrize(
    ("low", "high", "unit", "text"),
    [
        (1, 5, "", "1 to 5"),
        (1, 5, "s", "1 to 5 s"),
        (1, None, "s", "at least 1 s"),
        (None, 5, "", "at most 5"),
        (5, 5, "%", "5 %"),
        (0, 0, "", "0"),
    ],
)
def test_what_is_allowed_is_told_by_its_ends(low, high, unit, text):
    assert _range_text(low, high, unit) == text


@pytest.mark.parametrize(
    ("pv", "output", "share"),
    [
        ([0, 100], [0, 50], 4),
        ([50, 150], [0, 50], 4),
        ([-100, 0], [10, 60], 4),
        ([100, 200], [100, 0], 2),
        ([0, 1], [5, 5], None),
    ],
)
def test_a_gain_in_units_is_told_in_ranges(pv, output, share):
    loop = Facts(gain=Decimal(2), pv=Facts(range=[*map(Decimal, pv)]), output=Facts(range=[*map(Decimal, output)]))
    assert Scales("gain").normalized_gain(loop) == share


# --- A number may carry its key's own unit; another unit is an error that names both ----------------------------------

EXAMPLES = Path(__file__).parents[1] / "examples"
FILES = sorted(p for p in EXAMPLES.glob("*/*.yaml") if "scenario" not in p.name and p.parent.name in VENDORS)
EXPRESSIONS = {"nextopid"}
"""Vendors whose values may be expressions: a number with a unit is none."""

TIMED = ("s", "min", "sample", "cycle", "cycles")
"""Ends of units that times and rates have, which are read by types of their own."""


def checked(text):
    return check_document(read_document(text.encode(), "a.yaml"))


def numbers(data, path=()):
    """The places of numbers that are written plain."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for step, value in items:
        if isinstance(value, str) and type(value) is not str and NUMBER.fullmatch(value):
            yield (*path, step)
        yield from numbers(value, (*path, step))


def with_units(doc, vendor, spelled):
    """The text with each number's own unit behind it, and how many there are."""
    lines, places = LINE_BREAK.split(doc.text), set()  # an alias shares the place of its anchor
    for path in numbers(doc.data):
        if path[0] == "loops":
            loop = doc.data["loops"][path[1]]
            unit = _unit_of(vendor, loop, path[2:])
            if unit and not unit.endswith(TIMED):
                places.add((doc.locate(path), spelled(unit)))
    for span, unit in sorted(places, key=lambda row: (row[0].line, row[0].column), reverse=True):
        line = lines[span.line - 1]
        lines[span.line - 1] = f"{line[: span.end_column - 1]} {unit}{line[span.end_column - 1 :]}"
    return "\n".join(lines), len(places)


@pytest.mark.parametrize("path", FILES, ids=lambda p: f"{p.parent.name}/{p.stem}")
def test_a_number_in_its_own_unit_is_the_number(path):
    vendor = VENDORS[path.parent.name]
    bare = checked(path.read_text("utf-8"))
    text, count = with_units(bare.document, vendor, str)
    stated = checked(text)
    if vendor.key in EXPRESSIONS:
        assert stated.failed or not count
        return
    assert count
    assert stated.config == bare.config
    assert [d.message for d in stated.findings] == [d.message for d in bare.findings]


@pytest.mark.parametrize("vendor", [key for key in VENDORS if key not in EXPRESSIONS])
def test_any_other_unit_is_refused_and_both_are_named(vendor):
    path = next(p for p in FILES if p.parent.name == vendor)
    bare = checked(path.read_text("utf-8"))
    text, count = with_units(bare.document, VENDORS[vendor], lambda _: "furlong")
    refused = [d for d in checked(text).findings if d.code == "PID022"]
    assert count
    assert refused
    assert {d.loop for d in refused} == {loop["name"] for loop in bare.document.data["loops"]}
    assert all(d.help.startswith("the key is in ") and ", not in furlong:" in d.help for d in refused)


LOOP = PLANT.replace("degC", "UNIT").replace("value: 85", "value: 85 SAID")


@pytest.mark.parametrize(
    ("unit", "said"),
    [("degC", "°C"), ("°C", "degC"), ("degC", "℃"), ("degF", "°F"), ("m3/h", "m3 / h"), ("'%'", "%"), ("bar", "bar")],
)
def test_spellings_of_one_unit(unit, said):
    result = checked(LOOP.replace("UNIT", unit).replace("SAID", said))
    assert not result.failed
    assert str(result.config.loops[0].setpoint.value) == "85"


@pytest.mark.parametrize(("unit", "said"), [("degC", "degF"), ("degC", "C"), ("bar", "mbar"), ("m3/h", "m3")])
def test_what_is_not_the_same_unit(unit, said):
    (d,) = (
        d for d in checked(LOOP.replace("UNIT", unit).replace("SAID", said)).findings if d.severity.label == "error"
    )
    assert d.help == f"the key is in {unit}, not in {said}: write the number of {unit} alone"
    assert (d.span.line, d.span.column) == (10, 23)


def test_without_a_unit_of_the_pv_nothing_is_assumed():
    (d,) = (d for d in checked(LOOP.replace(", unit: UNIT", "").replace("SAID", "degC")).findings if d.code == "PID022")
    assert d.help == "write the number alone; it is taken in the key's own unit, which need not be degC"


BARE = {
    "dl06": """
    mode: auto
    bumpless: II
    sample_rate: 2
    action: direct
    tuning: {gain: 2.5, reset: 100}
    pv: {unit: degC}
    setpoint: {value: 85, limits: [1, 300]}
    output: {unit: "%", limits: [2, 95]}
    error: {deadband: 3}
    alarms:
      pv: {low_low: 3, low: 5, high: 310, high_high: 320}
      deviation: {yellow: 5, red: 10}
      rate_of_change: 44
      hysteresis: 2
    ramp_soak: {table: V3000, steps: [{ramp_to: 60, slope: 3, soak: 10, deviation: 4}]}
    state: {pv: 81, bias: 7, output: 6}
""",
    "ezlogix": """
    registers: R101
    discretes: S101
    algorithm: position
    action: reverse
    sample_rate: 0.5
    tuning: {proportional_gain: 2, integral_time: 120}
    pv: {tag: IR1, unit: degC}
    setpoint: {value: 85, limits: [1, 300]}
    output: {tag: OR1, unit: "%", limits: [2, 95], offset: 7}
    deadband: 5
    anti_windup: true
""",
}
"""Loops of the families that hold values in counts, with units and without ranges."""
SCALED_NUMBERS = [
    (vendor, match.start("number"))
    for vendor, text in BARE.items()
    for match in re.finditer(r"(?:(?P<key>\w+): |[\[,] ?)\[?(?P<number>\d+)(?=[,\]}\n])", text)
    if match["key"] not in {"sample_rate", "gain", "reset", "soak", "proportional_gain", "integral_time"}
]

COUNTED_IN = {vendor: sum(other == vendor for other, _ in SCALED_NUMBERS) for vendor in BARE}


def bare_loop(vendor, text):
    plc = "plc: {loop_table: V2000, reset_decimals: 1}\n" * (vendor == "dl06")
    head = f"pidcfg: 1\nvendor: {vendor}\n{plc}loops:\n  - name: A"
    return head.count("\n"), checked(head + text)


@pytest.mark.parametrize(("vendor", "at"), SCALED_NUMBERS)
def test_a_number_under_a_unit_without_a_range_is_counts_and_said_so_and_with_a_unit_an_error(vendor, at):
    text = BARE[vendor]
    line, column = text.count("\n", 0, at), at - text.rfind("\n", 0, at)
    number = re.match(r"\d+", text[at:])[0]
    unit = "%" if re.search(r"^    output|bias: $|output: $", text[text.rfind("\n", 0, at) + 1 : at]) else "degC"

    head, result = bare_loop(vendor, text)
    bare = {(d.span.line, d.span.column): d.message for d in result.findings if d.code == "PID109"}
    assert f"{number} is taken as {number} counts, not {unit}: " in bare[head + line + 1, column].replace(
        " /sample", ""
    )

    head, result = bare_loop(vendor, f"{text[:at]}{number} {unit}{text[at + len(number) :]}")
    (refused,) = (d for d in result.findings if d.severity.label == "error")
    assert refused.code == "PID039"
    assert refused.span.line == head + line + 1
    assert f"{number} {unit}, and " in refused.message

    _, result = bare_loop(vendor, f"{text[:at]}{number} counts{text[at + len(number) :]}")
    assert len([d for d in result.findings if d.code == "PID109"]) == COUNTED_IN[vendor] - 1
