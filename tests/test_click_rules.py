"""Rules for CLICK configurations at their limits: at the limit nothing, one step beyond the finding."""

import math
import re
import struct
from decimal import Decimal
from itertools import permutations
from pathlib import Path

import pytest

pytest.importorskip("pyclickplc")
from hypothesis import example, given
from hypothesis import strategies as st
from pyclickplc.validation import FORBIDDEN_CHARS, NICKNAME_MAX_LENGTH, validate_nickname

from click_cases import changed, checked, codes, findings
from pidcfg.encoders.codecs import single_bits
from pidcfg.encoders.maps.click import ERRORS, SPACE, SUFFIXES, TABLES, error_text
from pidcfg.sim.controllers.click.equation import lowest_error
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.rules.click.alarms import resolution
from pidcfg.validate.rules.click.setup import MAX_NICKNAME_LENGTH, REFUSED_CHARS, ClickContext
from pidcfg.validate.rules.click.signals import time_constant

ROOT = Path(__file__).parents[1]
PWM = {"bit": "Y001", "period": 10}

# fmt: off
LIMITS = [
    # key                          at limits       one step beyond  error
    ("sample_rate",                ("100 ms", "30000 ms"), ("99 ms", "30001 ms"), 10),
    ("derivative_gain_limit",      (0, 100),       (-1, 101),       11),
    ("output.pwm",                 ({**PWM, "period": 1}, {**PWM, "period": 600}),
                                   ({**PWM, "period": 0}, {**PWM, "period": 601}), 12),
    ("pv.filter",                  (1, 100),       (0, 101),        13),
    ("setpoint.lower_limit",       (19.9, 20),     (20.1, 21),      23),
    ("error.deadband",             (0, 1),         (-0.0001, -1),   24),
    ("tuning.proportional_gain",   (0.01, 10000),  (0.0099, 10000.1), 26),
    ("tuning.reset_time",          (0.01, 6000),   (0.0099, 6000.1), 27),
    ("tuning.derivative_gain",     (0, 6000),      (-0.001, 6000.1), 28),
    ("output.limits",              ([0, 100],),    ([-0.001, 100],), 30),
    ("autotune.hysteresis",        (1, 10),        (0.999, 10.001), 200),
]
# fmt: on


def with_value(key, value):
    return changed(**{"setpoint.upper_limit": 20, key: value})


def addresses(bits, integers, floats):
    return {"bits": f"C{bits}", "integers": f"DS{integers}", "floats": f"DF{floats}"}


def effects(*loops):
    return [d.plc_effect for d in findings(*loops) if d.plc_effect is not None]


@pytest.mark.parametrize(("key", "inside", "outside", "number"), LIMITS, ids=[row[0] for row in LIMITS])
def test_a_value_beyond_its_limit_names_the_plcs_error_and_one_at_it_none(key, inside, outside, number):
    assert [effects(with_value(key, value)) for value in inside] == [[]] * len(inside)
    assert [effects(with_value(key, value)) for value in outside] == [[f"CLICK error {number}"]] * len(outside)


def test_the_limits_of_every_error_that_a_file_can_cause_are_tested():
    not_a_number = {20, 21, 22, 25}

    assert {number for *_, number in LIMITS} == {error.number for error in ERRORS} - not_a_number


HELD = {
    10: "sample rate (DSn+05) is not within 100 to 30000 ms (0.1 to 30 s)",
    11: "derivative gain limit (DSn+06) is not within 0 to 100",
    12: "PWM period (DSn+07) is not within 1 to 600 s",
    13: "PV filter constant (DSn+08) is not within 1 to 100 %",
    20: "set point is not a number (DFn+00)",
    21: "SP lower limit is not a number (DFn+01)",
    22: "SP upper limit is not a number (DFn+02)",
    23: "SP lower limit above the upper limit (DFn+01)",
    24: "error deadband (DFn+03) is below 0 or not a number",
    25: "bias is not a number (DFn+04)",
    26: "proportional gain (DFn+05) is not within 0.01 to 10000",
    27: "reset time (DFn+06) is not within 0.01 to 6000 s",
    28: "derivative gain (DFn+07) is not within 0 to 6000 s",
    30: "CO lower limit (DFn+09) is below 0 % or not a number",
    200: "autotune output hysteresis (DFn+21) is not within 1 to 10 %",
}
"""What a register may hold: CLICK's help on its errors."""


def test_an_error_is_told_with_its_register_and_what_that_may_hold():
    assert {error.number: error_text(error) for error in ERRORS} == {
        number: f"PID error {number}: {text}" for number, text in HELD.items()
    }


def test_what_the_plc_reports_is_a_number_and_nothing_else():
    cases = [check_document(read_document(case.read_bytes(), case.name)) for case in ROOT.glob("tests/cases/CK3*.yaml")]
    found = {d.plc_effect for case in cases for d in case.findings} - {None}

    assert "CLICK error 10" in found
    assert all(re.fullmatch(r"CLICK error [0-9]+", effect) for effect in found)


@given(st.sets(st.sampled_from(LIMITS).map(lambda row: (row[0], row[3]))))
def test_several_errors_name_the_one_that_is_shown_and_those_behind_it(faults):
    wrong = {key: next(row[2][0] for row in LIMITS if row[0] == key) for key, _ in faults}
    if "output.pwm" in wrong and "output.limits" in wrong:
        wrong = {**wrong, "output": {"pwm": wrong.pop("output.pwm"), "limits": wrong.pop("output.limits")}}
    numbers = sorted(number for _, number in faults)
    found = [d for d in findings(changed(**{"setpoint.upper_limit": 20, **wrong})) if d.code == "CK309"]

    if len(numbers) < 2:
        assert not found
    else:
        (only,) = found
        assert only.plc_effect == f"CLICK error {numbers[0]}"
        assert [int(n) for n in re.findall(r"(?:error|shows|then) (\d+)", only.message)] == numbers
        assert only.message.startswith(f"DS1 shows error {numbers[0]} (")
        assert len(only.message) < 240
        assert (only.path, only.loop) == (("loops", 0), "A")


@given(
    st.fixed_dictionaries(
        {"sample_rate": st.integers(0, 32767).map("{} ms".format)},
        optional={
            "derivative_gain_limit": st.integers(-200, 200),
            "pv.filter": st.integers(-10, 110),
            "error.deadband": st.decimals(-1, 1, places=3),
            "output.pwm": st.just({**PWM, "period": 0}),
            "tuning.proportional_gain": st.decimals("0.0001", 20000, places=4),
            "tuning.reset_time": st.decimals(0, 7000, places=3),
            "tuning.derivative_gain": st.decimals(-1, 7000, places=2),
            "setpoint.lower_limit": st.integers(-2, 2),
            "setpoint.upper_limit": st.integers(-2, 2),
            "setpoint.lower_limit_enabled": st.booleans(),
            "setpoint.upper_limit_enabled": st.booleans(),
            "autotune.hysteresis": st.decimals(0, 11, places=2),
        },
    )
)
def test_rules_and_virtual_controller_agree_on_the_error_that_is_shown(values):
    result = checked(changed(**values))
    (view,) = ClickContext(result.config, result.encoding).loops
    words = result.encoding.image.words
    starts = (SPACE.number_of("C", 1), SPACE.number_of("DS", 1), SPACE.number_of("DF", 1))
    held = {
        word.name: float(SPACE.kind_of(start).show(words[start + word.offset]))
        for start, table in zip(starts, TABLES, strict=True)
        for word in table.words
    }
    row = lowest_error(held)

    assert [error.number for error in view.errors[:1]] == ([ERRORS[row - 1].number] if row else [])


def test_auto_with_one_error_says_that_the_loop_stays_in_manual():
    one = findings(changed(mode="auto", **{"tuning.reset_time": 0}))
    two = codes(changed(mode="auto", sample_rate="1 ms", **{"tuning.reset_time": 0}))

    assert next(d for d in one if d.code == "CK310").plc_effect == "CLICK error 27"
    assert "CK310" not in two
    assert "CK309" in two
    assert not {"CK310", "CK320"} & codes(changed(mode="manual", **{"tuning.reset_time": 0}))


# --- blocks and names ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "prefix", "size", "last"),
    [("bits", "C", 40, 2000), ("integers", "DS", 15, 4500), ("floats", "DF", 25, 500)],
)
def test_a_block_may_end_with_its_bank(key, prefix, size, last):
    latest = last - size + 1

    for start in range(latest - 3, last + 1):
        found = [d.path[-1] for d in findings(changed(**{key: f"{prefix}{start}"})) if d.code == "CK301"]
        assert found == ([key] if start > latest else [])


@pytest.mark.parametrize(("key", "prefix", "size"), [("bits", "C", 40), ("integers", "DS", 15), ("floats", "DF", 25)])
def test_blocks_overlap_when_they_are_closer_than_their_size(key, prefix, size):
    first = changed(name="A", **addresses(150, 150, 150))

    for distance in (-size - 1, -size, 1 - size, -1, 0, 1, size - 1, size, size + 1):
        second = changed(name="B", **addresses(401, 401, 401)) | {key: f"{prefix}{150 + distance}"}
        found = [d.path for d in findings(first, second) if d.code == "CK302"]
        assert found == [("loops", i, key) for i in (0, 1) if abs(distance) < size]


@pytest.mark.parametrize("count", [7, 8, 9, 10])
def test_eight_loops_are_the_most(count):
    loops = [changed(name=f"L{i}", **addresses(40 * i + 1, 15 * i + 1, 25 * i + 1)) for i in range(count)]
    found = [d.path for d in findings(*loops) if d.code == "CK303"]

    assert found == ([("loops",)] if count > 8 else [])


def test_the_limits_of_nicknames_are_those_of_the_package_that_writes_them():
    assert NICKNAME_MAX_LENGTH == MAX_NICKNAME_LENGTH
    assert FORBIDDEN_CHARS == REFUSED_CHARS


@given(st.text("AbZ_-./# 09", min_size=1, max_size=30).filter(lambda s: s[0] not in " -./#" and s[-1] not in " -./"))
def test_a_name_is_reported_when_the_package_refuses_one_of_its_nicknames(name):
    if "  " in name or name.isspace():
        return
    refused = [suffix for suffix in SUFFIXES.values() if not validate_nickname(name + suffix)[0]]
    found = codes(changed(name=name))

    assert bool({"CK305", "CK306"} & found) == bool(refused)
    assert ("CK305" in found) == (len(name) > 6)


@pytest.mark.parametrize("length", range(1, 65))
def test_the_number_of_nicknames_that_are_too_long_is_counted(length):
    name = "A" * length
    too_long = [s for s in SUFFIXES.values() if length + len(s) > 24]
    found = [d.message for d in findings(changed(name=name)) if d.code == "CK305"]

    assert bool(found) == (length > 6)
    assert not found or f": {len(too_long)} of its nicknames" in found[0]


@pytest.mark.parametrize(("first", "second"), [("OVEN", "oven"), ("T1", "T1_EN"), ("T1_EN", "T1"), ("t1", "T1_EN")])
def test_loops_with_a_nickname_in_common_are_reported_at_both(first, second):
    other = changed(name=second, **addresses(101, 101, 101))

    found = [d for d in findings(changed(name=first), other) if d.code == "CK307"]
    assert [(d.path, d.with_loops) for d in found] == [
        (("loops", 0, "name"), (second,)),
        (("loops", 1, "name"), (first,)),
    ]


def test_one_name_twice_is_not_also_a_collision_of_nicknames():
    other = changed(**addresses(101, 101, 101))

    assert codes(changed(), other) == {"PID106"}


# --- action ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("action", "bit", "shown"), [("direct", 0, "Forward"), ("reverse", 1, "Reverse")])
def test_the_warning_about_the_action_states_the_bit_that_the_image_holds(action, bit, shown):
    result = checked(changed(action=action, action_verified=False, bits="C101"))
    (found,) = (d for d in result.findings if d.code == "CK308")

    assert found.severity is Severity.WARNING
    assert f"{action} is written as {bit} to C110" in found.message
    assert f"it must show {shown} " in found.message
    assert result.encoding.image.words[SPACE.number_of("C", 110)] == bit
    assert not result.failed


@pytest.mark.parametrize(
    "file", ["examples/click/tank.yaml", "examples/click/brewery.yaml", "examples/click/booster.yaml"]
)
def test_a_sound_file_has_no_warning(file):
    found = check_document(read_document((ROOT / file).read_bytes(), file)).findings

    assert not {d.code for d in found if d.severity > Severity.INFO}


def test_the_starter_is_warned_of_its_action_alone_until_somebody_has_compared_it():
    text = (ROOT / "src/pidcfg/cli/starters/click.yaml").read_text("utf-8")
    compared = text.replace("action_verified: false", "action_verified: true")
    found = [check_document(read_document(t.encode(), "click.yaml")).findings for t in (text, compared)]

    assert [{d.code for d in ds if d.severity > Severity.INFO} for ds in found] == [{"CK308"}, set()]


def test_the_loop_that_the_other_tests_change_has_no_finding_at_all():
    assert not findings(changed())


# --- set point -------------------------------------------------------------------------------------------------------

POINT = st.integers(0, 100)


@given(
    POINT,
    st.none() | POINT,
    st.none() | POINT,
    st.sampled_from([None, True, False]),
    st.sampled_from([None, True, False]),
)
def test_a_set_point_is_reported_exactly_when_the_plc_would_overwrite_it(value, low, high, low_on, high_on):
    given_keys = {
        "value": value,
        "lower_limit": low,
        "upper_limit": high,
        "lower_limit_enabled": low_on,
        "upper_limit_enabled": high_on,
    }
    found = codes(changed(setpoint={k: v for k, v in given_keys.items() if v is not None}))
    lower = (low or 0) if (low is not None if low_on is None else low_on) else -math.inf
    upper = (high or 0) if (high is not None if high_on is None else high_on) else math.inf

    assert ("CK314" in found) == (lower <= upper and not lower <= value <= upper)
    assert ("CK312" in found) == (bool(low_on and low is None) or bool(high_on and high is None))


@given(POINT, POINT)
def test_limits_are_crossed_or_equal_or_in_order(low, high):
    found = codes(changed(setpoint={"lower_limit": low, "upper_limit": high}))

    assert {"CK311", "CK313"} & found == ({"CK311"} if low > high else {"CK313"} if low == high else set())


# --- PV, tuning, error -----------------------------------------------------------------------------------------------


@given(st.integers(1, 99), st.integers(100, 30000))
def test_the_filters_time_constant_is_where_its_step_response_has_done_63_percent(constant, sample):
    result = checked(changed(sample_rate=f"{sample} ms", **{"pv.filter": constant}))
    tau = time_constant(ClickContext(result.config, result.encoding).loops[0])
    left = (1 - constant / 100) ** (tau / (sample / 1000))

    assert left == pytest.approx(math.exp(-1))
    assert ("CK323" in {d.code for d in result.findings}) == (tau > 15)


@given(st.decimals("0.01", 5000, places=2), st.integers(1, 1000), st.booleans())
def test_the_proportional_band_is_compared_with_a_hundredth_of_the_range(gain, span, squared):
    curve = "squared" if squared else "linear"
    loop = changed(**{"tuning.proportional_gain": gain, "pv.range": [0, span], "error.curve": curve})
    moved = gain * (Decimal(span) / 100) ** (2 if squared else 1)

    assert ("CK333" in codes(loop)) == (moved > 100)


@example(deadband=Decimal(100), squared=False)
@example(deadband=Decimal(5), squared=False)
@example(deadband=Decimal(25), squared=True)
@example(deadband=Decimal(10000), squared=True)
@given(deadband=st.decimals("0.01", 200, places=2), squared=st.booleans())
def test_a_squared_error_is_compared_with_the_deadband_as_it_is(deadband, squared):
    curve = "squared" if squared else "linear"
    error = {"curve": curve, "deadband": deadband}
    alarms = {"deviation": {"high": 5, "high_high": 50}, "hysteresis": 1}
    found = codes(changed(error=error, alarms=alarms))
    reach = deadband.sqrt() if squared else deadband

    assert ("CK355" in found) == (5 <= reach < 100)
    assert ("CK354" in found) == (reach >= 100)
    assert ("CK352" in found) == (squared and deadband != 1)


@pytest.mark.parametrize(
    ("limit", "on", "nothing"),
    [(0, None, True), (None, True, True), (1, None, False), (0, False, False), (None, None, False)],
)
def test_a_limit_of_0_is_no_derivative(limit, on, nothing):
    keys = {"derivative_gain_limit": limit, "derivative_gain_limit_enabled": on}
    values = {key: value for key, value in keys.items() if value is not None}

    assert ("CK341" in codes(changed(**{"tuning.derivative_gain": 2}, **values))) == nothing


@pytest.mark.parametrize(("constant", "filtered"), [(100, False), (99, True)])
def test_a_filter_that_passes_everything_does_not_quieten_a_derivative(constant, filtered):
    found = codes(changed(**{"tuning.derivative_gain": 30, "pv.filter": constant}))

    assert ("CK343" in found) != filtered
    assert ("CK322" in found) != filtered


@pytest.mark.parametrize("low", [9, 10])
def test_a_set_point_at_its_alarm_leaves_no_room_for_any_deadband(low):
    alarms = {"pv": {"low_low": 5, "low": low, "high": 90, "high_high": 95}, "hysteresis": 1}

    found = codes(changed(alarms=alarms, setpoint={"value": 10}, error={"deadband": 1}))
    assert found == (set() if low == 10 else {"CK355"})


def test_a_deadband_that_is_off_reaches_nothing():
    error = {"curve": "squared", "deadband": 20000, "deadband_enabled": False}

    assert codes(changed(error=error)) == {"CK351", "CK356"}


@pytest.mark.parametrize("reset", ["999.99", "1000", "0", "6000.1"])
def test_windup_is_reported_for_a_loop_that_integrates(reset):
    found = codes(changed(freeze_bias=False, **{"tuning.reset_time": Decimal(reset)}))

    assert ("CK335" in found) == (reset == "999.99")


# --- alarms ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("points", set(permutations((10, 20, 80, 90))) | {(10, 10, 90, 90), (10, 50, 50, 90)})
def test_alarm_points_are_in_order_or_reported(points):
    alarms = dict(zip(("low_low", "low", "high", "high_high"), points, strict=True))
    found = [d for d in findings(changed(alarms={"pv": alarms, "hysteresis": 1})) if d.code == "CK371"]
    low_low, low, high, high_high = points

    wrong = {"low": low_low > low, "high": low >= high, "high_high": high > high_high}
    assert {d.path[-1] for d in found} == {key for key, is_wrong in wrong.items() if is_wrong}
    assert {d.path[-1] for d in found if d.severity is Severity.ERROR} == ({"high"} if low >= high else set())


@pytest.mark.parametrize(
    ("given_points", "span", "severity"),
    [
        ({"high": 90, "high_high": 95}, [0, 100], Severity.INFO),
        ({"high": 90, "high_high": 95}, [-1, 100], Severity.WARNING),
        ({"low": 10, "high": 90, "high_high": 95}, [0, 100], Severity.INFO),
        ({"low_low": 5, "low": 10}, [0, 100], Severity.ERROR),
        ({"low_low": 5, "low": 10, "high": 90}, [0, 100], Severity.ERROR),
        ({"low_low": -38, "low": -35}, [-40, 0], Severity.INFO),
        ({"low_low": -38, "low": -35}, [-40, 1], Severity.ERROR),
        ({"high": -10, "high_high": -5}, [-40, 0], Severity.ERROR),
        ({"enabled": True}, [0, 100], Severity.ERROR),
        ({"low": 50, "high": 40, "high_high": 95}, [0, 100], Severity.INFO),
    ],
)
def test_alarms_that_are_not_given_are_as_bad_as_what_0_does(given_points, span, severity):
    alarms = {"pv": given_points, "hysteresis": 1}
    found = [d for d in findings(changed(alarms=alarms, **{"pv.range": span})) if d.code == "CK372"]

    assert [d.severity for d in found] == [severity]


@given(st.floats(2.0**-100, 2.0**100, width=32))
def test_the_resolution_of_a_pv_is_the_distance_to_the_next_float(largest):
    result = checked(changed(**{"pv.range": [0, largest]}))
    following = struct.unpack(">f", (single_bits(largest) + 1).to_bytes(4, "big"))[0]

    assert resolution(ClickContext(result.config, result.encoding).loops[0]) == Decimal(following) - Decimal(largest)


@pytest.mark.parametrize(
    ("rate", "found"),
    [
        ("1.26 /s", False),
        ("75 /min", False),
        (1.25, False),
        ("101 /s", True),
        ("6001 /min", True),
        (100, False),
        (100.1, True),
    ],
)
def test_a_rate_is_compared_per_sample(rate, found):
    assert ("CK384" in codes(changed(alarms={"rate_of_change": rate}))) == found


def test_alarms_that_leave_no_pv_without_one_are_not_also_reported_for_the_set_point():
    loop = changed(alarms={"pv": {"low_low": 10, "low": 50, "high": 50, "high_high": 90}, "hysteresis": 1})
    loop["setpoint"] = {"value": 60}

    assert codes(loop) == {"CK371"}


# --- output ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("limit", [1, 50])
def test_limits_that_leave_no_output_are_one_finding(limit):
    loop = changed(output={"limits": [limit, limit]}, autotune={"method": "closed"}, state={"output": 60, "bias": 40})

    assert codes(loop) == {"CK362"}


@pytest.mark.parametrize(("key", "value"), [("output", 90.1), ("output", 9.9), ("bias", 90.1), ("bias", 9.9)])
def test_a_stored_value_outside_the_limits_is_reported_where_it_stands(key, value):
    found = findings(changed(output={"limits": [10, 90]}, state={key: value}))

    assert [(d.code, d.path[-1]) for d in found] == [("CK393", key)]


def test_an_upper_limit_of_0_is_no_fraction():
    assert codes(changed(output={"limits": [-1, 0]})) == {"CK361", "CK363"}


@pytest.mark.parametrize(
    ("high", "high_high", "found"), [(0.8, 0.5, True), (0.5, 0.8, False), (0.5, 0, False), (0.5, 0.5, False)]
)
def test_deviation_points_below_one_unit_have_an_order_too(high, high_high, found):
    assert ("CK376" in codes(changed(**{"alarms.deviation": {"high": high, "high_high": high_high}}))) == found
