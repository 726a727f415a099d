"""CLICK loops to the neutral loop and back: the action, gains in % per unit, off codes, filters, alarms in groups."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import click_strategies
import neutral_strategies
from click_strategies import configurations
from nested import merged
from neutral_strategies import leaves, neutral_files, unheard
from pidcfg.conversion import ConvertError
from pidcfg.conversion.click import HARMLESS_FIELDS, from_neutral, to_neutral
from pidcfg.conversion.pipeline import convert, fit_to_registers
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.maps.click import TABLES
from pidcfg.schemas.click import ClickFile, Loop
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples" / "click"
CLICK = VENDORS["click"]
PLAIN = {
    "name": "L1",
    "bits": "C1",
    "integers": "DS1",
    "floats": "DF1",
    "mode": "auto",
    "action": "direct",
    "sample_rate": "500 ms",
    "bumpless": 2,
    "freeze_bias": True,
    "tuning": {"proportional_gain": 2.5, "reset_time": 30},
    "pv": {"range": [0, 200], "input_range": [0, 200]},
    "setpoint": {"value": 50},
}
NEUTRAL = {
    "name": "L1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 0.5, "integral_time": 30},
    "pv": {"range": [0, 200]},
    "setpoint": {"value": 50},
    "output": {"range": [0, 50]},
}
EVERYTHING = PLAIN | click_strategies.EVERYTHING


def click(*loops: dict) -> ClickFile:
    """A CLICK file of loops that differ from a plain one; a section is merged with that of the plain one."""
    entries = [
        merged(
            {**PLAIN, "name": f"L{i}", "bits": f"C{40 * i}", "integers": f"DS{15 * i}", "floats": f"DF{25 * i}"}, loop
        )
        for i, loop in enumerate(loops, start=1)
    ]
    return ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": entries})


def generic(*loops: dict) -> GenericFile:
    """A neutral file of loops that differ from a plain one."""
    entries = [merged({**NEUTRAL, "name": f"L{i}"}, loop) for i, loop in enumerate(loops, start=1)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


def neutral(loop: dict):
    """The neutral loop of a CLICK loop."""
    found = to_neutral(click(loop))[0]
    assert found.missing == []
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [found.data]}).loops[0]


def lost(loop: dict) -> dict[str, str]:
    """What a CLICK loop loses, by field, with the advice."""
    return {field.path: field.note for field in to_neutral(click(loop))[0].fields if not field.neutral}


def one(loop: dict, **options) -> Loop:
    """The CLICK loop of a neutral one."""
    return ClickFile.model_validate(from_neutral(generic(loop), options).data).loops[0]


def puts(loop: dict) -> list:
    """What became of each neutral field."""
    return from_neutral(generic(loop), {}).fields[0]


def dropped(loop: dict) -> dict[str, str]:
    """The neutral fields that find no place, with the advice."""
    return {put.neutral: put.note for put in puts(loop) if not put.path}


# --- action and gains ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("action", "raises"), [("direct", True), ("reverse", False)])
def test_the_action_is_that_of_the_process(action, raises):
    assert neutral({"action": action}).output_raises_pv is raises
    assert one({"output_raises_pv": raises}).action == action
    assert one({"output_raises_pv": raises}).action_verified is False


def test_the_gain_is_in_per_cent_of_the_output_per_unit_of_the_pv():
    loop = neutral({"tuning": {"proportional_gain": 2.4}})
    assert loop.tuning.gain == Decimal("2.4")
    assert (loop.output.range, loop.output.unit) == ((0, 100), "%")
    assert neutral({"output": {"unit": "% open"}}).output.unit == "% open"


@pytest.mark.parametrize(("span", "gain"), [([0, 100], "0.5"), ([0, 50], "1"), ([4, 20], "3.125"), ([-10, 10], "2.5")])
def test_a_gain_in_output_units_becomes_one_in_per_cent(span, gain):
    assert one({"output": {"range": span}}).tuning.proportional_gain == Decimal(gain)


@pytest.mark.parametrize(("reset", "integral"), [(6000, 0), (5999, 5999), (1200, 1200), (0.01, "0.01")])
def test_only_the_longest_reset_time_is_no_integral(reset, integral):
    assert neutral({"tuning": {"reset_time": reset}}).tuning.integral_time == Decimal(integral)
    assert one({"tuning": {"integral_time": Decimal(integral)}}).tuning.reset_time == Decimal(str(reset))


@pytest.mark.parametrize(("integral", "told"), [(0, True), (5999.99, False), (6000, True), (9000, True)])
def test_a_reset_time_that_counts_as_no_integral_says_so(integral, told):
    (put,) = (put for put in puts({"tuning": {"integral_time": integral}}) if put.neutral == "tuning.integral_time")
    assert ("counts as no integral" in put.note) is told


def stored(loop: dict) -> dict:
    """What the registers hold of each field of a converted loop."""
    return fit_to_registers(from_neutral(generic(loop), {}), CLICK)[0]


def test_values_beyond_what_the_registers_take_are_clamped():
    found = stored({"tuning": {"gain": 9000, "integral_time": 9000, "derivative_time": 7000}})
    held = {
        key: (found[f"tuning.{key}"].kind, found[f"tuning.{key}"].value)
        for key in ("proportional_gain", "reset_time", "derivative_gain")
    }
    assert held == {
        "proportional_gain": ("clamped", 10000),
        "reset_time": ("clamped", 6000),
        "derivative_gain": ("clamped", 6000),
    }


def test_whole_numbers_and_milliseconds_are_rounded_with_their_error():
    found = stored(
        {
            "sample_time": Decimal("0.1234"),
            "pv": {"filter": Decimal("0.3")},
            "tuning": {"derivative_time": 4, "derivative_filter": Decimal("0.39")},
        }
    )
    assert (found["sample_rate"].kind, found["sample_rate"].value) == ("rounded", "123 ms")
    assert found["sample_rate"].error_percent == pytest.approx(100 * 0.4 / 123.4)
    assert (found["pv.filter"].kind, found["pv.filter"].value) == ("rounded", 34)  # 1 - exp(-0.41) = 33.6 %
    limit = found["derivative_gain_limit"]
    assert (limit.kind, limit.value) == ("rounded", 0.4)  # s, of 4 s / 10
    assert limit.error_percent == pytest.approx(100 * 0.01 / 0.39)


def test_the_limit_is_the_one_whose_filter_is_nearest_to_the_wanted_time():
    loop = {"tuning": {"derivative_time": 10, "derivative_filter": Decimal("6.8")}}  # 10 / 6.8 = 1.47, 10 / 2 = 5
    assert one(loop).derivative_gain_limit == 2
    limit = stored(loop)["derivative_gain_limit"]
    assert (limit.value, limit.error_percent) == (5, pytest.approx(100 * 1.8 / 6.8))
    assert one({"tuning": {"derivative_time": 10, "derivative_filter": 8}}).derivative_gain_limit == 1


@pytest.mark.parametrize(("integral", "derivative"), [(100, 0), (0, 20), (50, 8), (0.5, 400)])
def test_without_a_proportional_action_the_gain_shrinks_and_the_others_act_as_before(integral, derivative):
    tuning = {"gain": 2, "integral_time": integral, "derivative_time": derivative, "proportional": False}
    loop = one({"tuning": tuning, "output": {"range": [0, 100]}})
    gain, reset, rate = loop.tuning.proportional_gain, loop.tuning.reset_time, loop.tuning.derivative_gain
    assert Decimal("0.01") <= gain < Decimal("0.2")
    assert Decimal("0.01") <= reset <= 6000
    assert rate <= 6000
    assert float(gain * rate) == pytest.approx(2 * derivative)
    assert reset == 6000 if not integral else float(gain / reset) == pytest.approx(2 / integral)
    assert "tuning.proportional" in dropped({"tuning": tuning})


# --- derivative and filters ------------------------------------------------------------------------------------------


def test_the_derivative_acts_on_the_error():
    assert neutral({"tuning": {"derivative_gain": 4}}).tuning.derivative_on == "error"
    assert "tuning.derivative_on" in dropped({"tuning": {"derivative_time": 4}})
    assert "tuning.derivative_on" not in dropped({"tuning": {"derivative_time": 4, "derivative_on": "error"}})
    assert "tuning.derivative_on" not in dropped({"tuning": {"derivative_on": "pv"}})


@pytest.mark.parametrize(
    ("limit", "constant", "derivative"),
    [(10, "0.4", 4), (99, "0.040404040404", 4), (100, "0", 4), (0, "0", 0)],
)
def test_the_derivative_gain_limit_is_the_time_constant_of_a_filter(limit, constant, derivative):
    found = neutral({"tuning": {"derivative_gain": 4}, "derivative_gain_limit": limit}).tuning
    assert (found.derivative_filter, found.derivative_time) == (Decimal(constant), derivative)


def test_a_limit_that_limits_nothing_is_told():
    assert "derivative_gain_limit" in lost({"derivative_gain_limit": 10})
    off = {"tuning": {"derivative_gain": 4}, "derivative_gain_limit": 10, "derivative_gain_limit_enabled": False}
    assert "switched off" in lost(off)["derivative_gain_limit"]
    assert neutral(off).tuning.derivative_filter == 0
    assert (
        "switches the derivative off"
        in lost({"tuning": {"derivative_gain": 4}, "derivative_gain_limit_enabled": True})["tuning.derivative_gain"]
    )


@pytest.mark.parametrize(
    ("constant", "limit"), [("0.4", 10), ("4", 1), ("20", 1), ("0.05", 80), ("0.0404", 99), ("0.04", None)]
)
def test_a_derivative_filter_becomes_a_limit_of_its_gain(constant, limit):
    tuning = {"derivative_time": 4, "derivative_filter": Decimal(constant)}
    assert one({"tuning": tuning}).derivative_gain_limit == limit
    assert ("tuning.derivative_filter" in dropped({"tuning": tuning})) == (limit is None)


@pytest.mark.parametrize(("constant", "limit"), [(2.5, None), (600, 10)])
def test_without_a_proportional_action_the_filter_is_that_of_the_derivative_time_which_is_written(constant, limit):
    tuning = {"gain": 1, "proportional": False, "integral_time": 10, "derivative_time": 60}
    loop = one({"tuning": {**tuning, "derivative_filter": constant}, "output": {"range": [0, 100]}})
    assert (loop.tuning.derivative_gain, loop.derivative_gain_limit) == (6000, limit)


def test_a_filter_longer_than_the_derivative_is_clamped_and_one_between_whole_limits_is_rounded():
    long = {"tuning": {"derivative_time": 4, "derivative_filter": 20}}
    between = {"tuning": {"derivative_time": 4, "derivative_filter": Decimal("0.39")}}
    [put] = [put for put in puts(long) if put.neutral == "tuning.derivative_filter"]
    assert put.clamped
    [put] = [put for put in puts(between) if put.neutral == "tuning.derivative_filter"]
    assert not put.clamped
    assert (put.exact, put.held) == (Decimal("0.39"), Decimal("0.4"))


@pytest.mark.parametrize(
    ("percent", "constant"), [(50, 0.721348), (80, 0.310667), (1, 49.749), (99, 0.108574), (100, 0)]
)
def test_the_pv_filter_is_a_time_constant(percent, constant):
    found = neutral({"pv": {"filter": percent}}).pv.filter
    assert float(found) == pytest.approx(constant, rel=1e-4)
    assert (one({"pv": {"filter": found}}).pv.filter or 100) == percent


def test_the_pv_filter_counts_in_the_sample_rate_that_the_plc_can_hold():
    loop = one({"sample_time": "20 ms", "pv": {"filter": Decimal("0.1")}})
    assert loop.sample_rate == Decimal("0.1")
    assert loop.pv.filter == 63  # 1 - exp(-0.1 / 0.1), not of 20 ms


def test_a_filter_that_would_pass_everything_is_told():
    assert "passes everything" in dropped({"pv": {"filter": Decimal("0.05")}})["pv.filter"]
    assert one({"pv": {"filter": Decimal("0.05")}}).pv.filter is None


def test_a_filter_that_is_switched_off_is_none():
    assert neutral({"pv": {"filter": 50, "filter_enabled": False}}).pv.filter == 0
    assert "pv.filter" in lost({"pv": {"filter": 50, "filter_enabled": False}})


@pytest.mark.parametrize(
    ("time", "text", "clamped"),
    [
        ("0.5", "500 ms", False),
        ("0.02", "100 ms", True),
        ("60", "30000 ms", True),
        ("0.1234", "123 ms", False),
        ("0.1", "100 ms", False),
        ("30", "30000 ms", False),
    ],
)
def test_the_sample_rate_is_whole_milliseconds_within_the_limits(time, text, clamped):
    made = from_neutral(generic({"sample_time": Decimal(time)}), {})
    [put] = [put for put in made.fields[0] if put.neutral == "sample_time"]
    assert made.data["loops"][0]["sample_rate"] == text
    assert (put.clamped, put.exact) == (clamped, Decimal(time))


# --- error -----------------------------------------------------------------------------------------------------------


def test_a_squared_error_is_dropped_with_the_gain_of_a_full_error():
    loop = {"error": {"curve": "squared", "deadband": 4}, "tuning": {"proportional_gain": 0.5}}
    found = neutral(loop)
    assert found.tuning.gain == 100  # 0.5 * 200 * 200 = 100 * 200
    assert found.deadband == 2
    assert "error.curve" in lost(loop)
    said = {field.path: field for field in to_neutral(click(loop))[0].fields}
    assert said["tuning.proportional_gain"].assumed
    assert said["error.deadband"].assumed


def test_the_deadband_goes_over_and_one_that_is_off_does_not():
    assert neutral({"error": {"deadband": 0.5}}).deadband == Decimal("0.5")
    assert neutral({"error": {"deadband": 0.5, "deadband_enabled": False}}).deadband == 0
    assert neutral({"error": {"deadband_enabled": True}}).deadband == 0
    assert one({"deadband": 0.5}).error.deadband == Decimal("0.5")
    assert one({}).error.deadband is None


# --- PV and set point ------------------------------------------------------------------------------------------------


def test_the_range_of_the_process_is_taken_for_the_instruments_and_said_so():
    data = {**PLAIN, "pv": {"range": [40, 140]}}
    found = to_neutral(ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": [data]}))[0]
    [field] = [field for field in found.fields if field.path == "pv.range"]
    assert field.assumed
    assert "pv.input_range" in field.note
    assert found.data["pv"]["range"] == [40, 140]


def test_the_range_of_the_instrument_is_used_where_it_is_given():
    loop = {"pv": {"range": [40, 140], "input_range": [-328, 1562]}}
    assert neutral(loop).pv.range == (-328, 1562)
    assert "autotune" in lost(loop)["pv.range"]
    back = one({"pv": {"range": [-328, 1562]}}).pv
    assert (back.range, back.input_range) == ((-328, 1562), (-328, 1562))
    [put] = [put for put in puts({}) if put.path == "pv.range"]
    assert put.assumed


@pytest.mark.parametrize(
    ("setpoint", "limits"),
    [
        ({"lower_limit": 10, "upper_limit": 90}, (10, 90)),
        ({"lower_limit": 10}, (10, 200)),
        ({"upper_limit": 90}, (0, 90)),
        ({"upper_limit": 90, "upper_limit_enabled": False}, None),
        ({"lower_limit": 10, "upper_limit_enabled": True, "upper_limit": 90, "lower_limit_enabled": False}, (0, 90)),
        ({"lower_limit": 50, "upper_limit": 50}, None),
        ({"lower_limit": 300}, None),
    ],
)
def test_set_point_limits(setpoint, limits):
    assert neutral({"setpoint": setpoint}).setpoint.limits == limits


def test_a_limit_that_is_on_without_a_value_is_0():
    pv = {"range": [-50, 200], "input_range": [-50, 200]}
    low = {"lower_limit_enabled": True, "upper_limit": 90}
    assert neutral({"pv": pv, "setpoint": low}).setpoint.limits == (0, 90)
    assert neutral({"pv": pv, "setpoint": {"lower_limit": -20, "upper_limit_enabled": True}}).setpoint.limits == (
        -20,
        0,
    )


def test_a_limit_that_is_not_given_is_the_end_of_the_range_and_said_so():
    said = {field.path: field for field in to_neutral(click({"setpoint": {"lower_limit": 10}}))[0].fields}
    assert said["setpoint.upper_limit"].assumed
    assert not said["setpoint.lower_limit"].assumed


def test_a_limit_that_is_not_given_is_the_end_of_the_instruments_range():
    loop = {"pv": {"range": [0, 100], "input_range": [-50, 150]}, "setpoint": {"lower_limit": 110}}
    assert neutral(loop).setpoint.limits == (110, 150)
    loop["setpoint"] = {"upper_limit": -10}
    assert neutral(loop).setpoint.limits == (-50, -10)


def test_limits_without_a_range_between_them_are_lost_by_name():
    assert set(lost({"setpoint": {"lower_limit": 50, "upper_limit": 50}})) == {
        "setpoint.lower_limit",
        "setpoint.upper_limit",
    }


def test_set_point_limits_come_back():
    loop = one({"setpoint": {"limits": [10, 90]}})
    assert (loop.setpoint.lower_limit, loop.setpoint.upper_limit, loop.setpoint.value) == (10, 90, 50)


def test_the_set_point_stays_at_the_transfer_unless_there_is_none():
    assert one({}).bumpless == 2
    assert one({"setpoint": {"value": None, "source": "L1"}}).bumpless == 2
    plain = {key: value for key, value in NEUTRAL.items() if key != "setpoint"}
    file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [plain]})
    assert from_neutral(file, {}).data["loops"][0]["bumpless"] == 1


@pytest.mark.parametrize(("mode", "kind", "follows"), [(1, "I", True), (2, "II", False)])
def test_the_bumpless_mode_is_the_type_of_a_dl06(mode, kind, follows):
    config = click({"bumpless": mode})
    assert neutral({"bumpless": mode}).setpoint.follows_pv is follows
    assert one({"setpoint": {"follows_pv": follows}}).bumpless == mode
    dl06 = convert(config, CLICK, VENDORS["dl06"], {})
    there = next(change for change in dl06.loops[0][1] if change.field == "bumpless")
    assert (there.kind, there.source, there.target) == ("exact", mode, kind)
    back = convert(VENDORS["dl06"].model.model_validate(dl06.data), VENDORS["dl06"], CLICK, {})
    again = next(change for change in back.loops[0][1] if change.field == "bumpless")
    assert (again.kind, again.source, again.target) == ("exact", kind, mode)


def test_the_bumpless_mode_that_is_not_given_counts_as_given():
    loop = {key: value for key, value in PLAIN.items() if key != "bumpless"} | {"name": "L1"}
    config = ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": [loop]})
    assert to_neutral(config)[0].data["setpoint"]["follows_pv"] is True


@pytest.mark.parametrize("target", ["ezlogix", "dpide"])
def test_a_set_point_that_follows_the_pv_is_lost_where_there_is_no_such_thing(target):
    for mode, kind in ((1, "dropped"), (2, "exact")):
        found = convert(click({"bumpless": mode}), CLICK, VENDORS[target], {}).loops[0][1]
        change = next(change for change in found if change.field == "bumpless")
        assert change.kind == kind
        assert ("into" in change.note) is (mode == 1)


def test_a_cascade_is_wired_in_the_program():
    file = generic({}, {"setpoint": {"source": "L1"}, "mode": "cascade", "pv": {"range": [0, 50]}})
    made = from_neutral(file, {})
    [put] = [put for put in made.fields[1] if put.neutral == "setpoint.source"]
    assert "DF9 of L1" in put.note
    assert "0 to 50" in put.note
    assert "DF26" in put.note
    assert made.data["loops"][1]["mode"] == "auto"


# --- output ----------------------------------------------------------------------------------------------------------


def test_output_values_are_rescaled_to_per_cent():
    output = {"range": [4, 20], "limits": [4.8, 12], "manual": 8, "bias": 12, "unit": "mA"}
    made = from_neutral(generic({"output": output}), {})
    loop = made.data["loops"][0]
    assert loop["output"] == {"limits": [5, 50]}
    assert loop["state"] == {"output": 25, "bias": 50}
    told = {put.neutral: put.note for put in made.fields[0] if put.path == "output.limits"}
    assert told["output.range"] == told["output.unit"] == "the output is in %: 0 to 100 % of the output are 4 to 20 mA"


def test_limits_of_the_output_stay_within_0_and_100_per_cent():
    made = from_neutral(generic({"output": {"range": [0, 50], "limits": [-5, 40]}}), {})
    assert made.data["loops"][0]["output"]["limits"] == [0, 80]
    assert [put.clamped for put in made.fields[0] if put.path.startswith("output.limits.")] == [True, False]


def test_a_loop_without_an_integral_begins_with_its_bias_as_output():
    loop = {"output": {"range": [0, 50], "bias": 20}, "tuning": {"integral_time": 0}}
    state = one(loop).state
    assert (state.output, state.bias) == (40, 40)
    [put] = [put for put in puts(loop) if put.neutral == "output.bias"]
    assert put.assumed
    loop["output"]["manual"] = 5
    assert one(loop).state.output == 10
    [put] = [put for put in puts(loop) if put.neutral == "output.bias"]
    assert put.assumed
    assert "bring the output to 40 % in Manual" in put.note


@pytest.mark.parametrize(
    ("output", "integral", "state"),
    [
        ({"range": [-50, 50]}, 0, {"output": 50, "bias": 50}),
        ({"range": [-50, 50]}, 60, {}),
        ({"range": [4, 20]}, 0, {"output": 0, "bias": 0}),
        ({"range": [0, 50]}, 0, {}),
        ({"range": [0, 50], "bias": 0}, 0, {"output": 0, "bias": 0}),
        ({"range": [0, 50], "manual": 10}, 0, {"output": 20, "bias": 0}),
        ({"range": [0, 50], "manual": 10}, 60, {"output": 20}),
        ({"range": [0, 50], "limits": [10, 40]}, 0, {"output": 20, "bias": 20}),
        ({"range": [0, 50], "limits": [10, 40], "bias": 0}, 0, {"output": 20, "bias": 20}),
        ({"range": [0, 50], "limits": [10, 40], "bias": 2, "manual": 12}, 0, {"output": 24, "bias": 20}),
        ({"range": [0, 50], "limits": [10, 40], "bias": 45}, 0, {"output": 80, "bias": 80}),
    ],
)
def test_a_bias_that_is_not_given_is_0_without_an_integral(output, integral, state):
    made = from_neutral(generic({"output": output, "tuning": {"integral_time": integral}}), {})
    assert made.data["loops"][0].get("state", {}) == state


@pytest.mark.parametrize(("reset", "bias"), [(100, None), (5999.9, None), (6000, 57.5)])
def test_the_bias_of_a_loop_with_an_integral_is_the_integral_and_no_constant(reset, bias):
    found = to_neutral(click({"tuning": {"reset_time": reset}, "state": {"bias": 57.5, "output": 40}}))[0]
    assert found.data["output"].get("bias") == bias


def test_output_limits_that_do_not_ascend_must_be_mended_first():
    [missing] = to_neutral(click({"output": {"limits": [60, 60]}}))[0].missing
    assert missing.path == ("loops", 0, "output", "limits")


def test_pulses():
    assert neutral({"output": {"pwm": {"bit": "Y002", "period": 20}}}).output.pulse.period == 20
    pulse = {"period": 20, "min_on": 1, "min_off": 2}
    loop = one({"output": {"pulse": pulse}})
    assert (loop.output.pwm.bit, loop.output.pwm.period) == ("Y001", 20)
    assert {"output.pulse.min_on", "output.pulse.min_off"} <= set(dropped({"output": {"pulse": pulse}}))
    assert one({"output": {"pulse": pulse}}, pwm_bit=[{"bit": "Y021"}]).output.pwm.bit == "Y021"
    assert one({}).output.pwm is None


def test_what_a_click_does_not_have_is_told():
    loop = {"pv": {"square_root": True}, "output": {"max_rate": 2, "range": [0, 100]}}
    assert set(dropped(loop)) == {"pv.square_root", "output.max_rate"}
    assert dropped({"output": {"range": [0, 100]}}) == {}


# --- alarms ----------------------------------------------------------------------------------------------------------


def test_alarms_go_over():
    found = neutral(EVERYTHING).alarms
    assert dict(found.pv) == {"low_low": 5, "low": 10, "high": 150, "high_high": 190}
    assert dict(found.deviation) == {"high": 5, "high_high": 10}
    assert (found.rate_of_change, found.hysteresis) == (4, 1)  # 2 per sample of 0.5 s


@pytest.mark.parametrize(("rate", "second"), [(2, "4"), ("15 /min", "0.25"), ("0.25 /s", "0.25")])
def test_the_rate_of_change_is_per_second(rate, second):
    assert neutral({"alarms": {"rate_of_change": rate}}).alarms.rate_of_change == Decimal(second)
    back = one({"alarms": {"rate_of_change": Decimal(second)}}).alarms.rate_of_change
    assert back.value == Decimal(second) / 2


OFF = "stored, but switched off"
HELD_AT_0 = "not given: this PLC compares with 0, since one bit enables all"


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ({"derivative_gain_limit": 10, "derivative_gain_limit_enabled": False}, {"derivative_gain_limit": (10, OFF)}),
        ({"pv": {"filter": 50, "filter_enabled": False}}, {"pv.filter": (50, OFF)}),
        ({"error": {"deadband": 2.5, "deadband_enabled": False}}, {"error.deadband": (Decimal("2.5"), OFF)}),
        (
            {"setpoint": {"lower_limit": 10, "lower_limit_enabled": False}},
            {"setpoint.lower_limit": (10, OFF)},
        ),
        (
            {"setpoint": {"upper_limit": 90, "upper_limit_enabled": False}},
            {"setpoint.upper_limit": (90, OFF)},
        ),
        (
            {"alarms": {"pv": {"low_low": 5, "low": 10, "high": 150, "high_high": 160, "enabled": False}}},
            {"alarms.pv.low_low": (5, OFF), "alarms.pv.low": (10, OFF), "alarms.pv.high": (150, OFF)}
            | {"alarms.pv.high_high": (160, OFF)},
        ),
        (
            {"alarms": {"deviation": {"high": 5, "high_high": 9, "enabled": False}}},
            {"alarms.deviation.high": (5, OFF), "alarms.deviation.high_high": (9, OFF)},
        ),
        (
            {"alarms": {"rate_of_change": "15 /min", "rate_of_change_enabled": False}},
            {"alarms.rate_of_change": ("15 /min", OFF)},
        ),
        (
            {"alarms": {"pv": {"enabled": True}}},
            {f"alarms.pv.{key}": (None, HELD_AT_0) for key in ("high", "high_high")},
        ),
        (
            {"alarms": {"pv": {"enabled": True}}, "pv": {"range": [-9, 9], "input_range": [-9, 9]}},
            {f"alarms.pv.{key}": (None, HELD_AT_0) for key in ("low_low", "low", "high", "high_high")},
        ),
        (
            {"alarms": {"pv": {"enabled": True}}, "pv": {"range": [-0.5, 0.5], "input_range": [-0.5, 0.5]}},
            {f"alarms.pv.{key}": (None, HELD_AT_0) for key in ("low_low", "low", "high", "high_high")},
        ),
        (
            {"alarms": {"pv": {"enabled": True}}, "pv": {"range": [-9, 0], "input_range": [-9, 0]}},
            {f"alarms.pv.{key}": (None, HELD_AT_0) for key in ("low_low", "low")},
        ),
        (
            {"alarms": {"deviation": {"enabled": True, "high": 5}}},
            {"alarms.deviation.high_high": (None, HELD_AT_0)},
        ),
    ],
)
def test_a_value_that_is_switched_off_is_told_as_the_file_has_it_and_one_that_is_not_given_where_0_matters(loop, told):
    tuning = {"derivative_gain": 4} if "derivative_gain_limit" in loop else {}
    fields = to_neutral(click({**loop, "tuning": tuning}))[0].fields
    assert {field.path: (field.value, field.note) for field in fields if not field.neutral} == told


@pytest.mark.parametrize(
    ("alarms", "told"),
    [
        ({"rate_of_change": "15 /min"}, ("15 /min", Decimal("0.25"))),
        ({"rate_of_change": 2}, ("2 /sample", 4)),
        ({"rate_of_change_enabled": True}, (0, 0)),
    ],
)
def test_a_rate_of_change_is_told_as_the_file_has_it_and_0_where_it_is_on_without_a_value(alarms, told):
    (found,) = to_neutral(click({"alarms": alarms}))
    values = [field.value for field in found.fields if field.path == "alarms.rate_of_change"]
    assert (values, found.data["alarms"]["rate_of_change"]) == ([told[0]], told[1])


def test_groups_that_are_switched_off_are_lost():
    alarms = {
        "pv": {"high": 150, "enabled": False},
        "deviation": {"high": 5, "enabled": False},
        "rate_of_change": 2,
        "rate_of_change_enabled": False,
    }
    assert set(lost({"alarms": alarms})) == {"alarms.pv.high", "alarms.deviation.high", "alarms.rate_of_change"}
    assert neutral({"alarms": alarms}).alarms.pv.high is None


def test_a_point_that_is_not_given_is_told_where_its_0_matters():
    assert set(lost({"alarms": {"pv": {"low": 10, "high": 150}}})) == {"alarms.pv.high_high"}
    assert set(lost({"alarms": {"pv": {"high": 150, "high_high": 190}}})) == set()
    assert set(lost({"alarms": {"deviation": {"high": 5}}})) == {"alarms.deviation.high_high"}
    below = {"pv": {"range": [-50, 0], "input_range": [-50, 0]}, "alarms": {"pv": {"low": -40, "low_low": -45}}}
    assert set(lost(below)) == set()
    wider = {"pv": {"range": [0, 200], "input_range": [-50, 200]}, "alarms": {"pv": {"high": 150, "high_high": 190}}}
    assert {"alarms.pv.low", "alarms.pv.low_low"} <= set(lost(wider))


@pytest.mark.parametrize(
    ("wanted", "points"),
    [
        ({"high": 150}, (-200, -200, 150, 400)),
        ({"high_high": 150}, (-200, -200, 150, 150)),
        ({"low": 10}, (-200, 10, 400, 400)),
        ({"low_low": 10, "high": 700}, (10, 10, 700, 700)),
        ({"low": -900, "high": 150}, (-900, -900, 150, 400)),
    ],
)
def test_alarms_that_are_not_wanted_are_out_of_reach(wanted, points):
    found = one({"alarms": {"pv": wanted}}).alarms.pv
    assert (found.low_low, found.low, found.high, found.high_high) == points
    chosen = {put.path for put in puts({"alarms": {"pv": wanted}}) if put.neutral is None and "alarms" in put.path}
    assert chosen == {f"alarms.pv.{key}" for key in ("low_low", "low", "high", "high_high") if key not in wanted}


@pytest.mark.parametrize(
    ("wanted", "points"), [({"high": 5}, (5, 200)), ({"high_high": 9}, (9, 9)), ({"high": 300}, (300, 300))]
)
def test_a_deviation_alarm_that_is_not_wanted_is_out_of_reach(wanted, points):
    found = one({"alarms": {"deviation": wanted}}).alarms.deviation
    assert (found.high, found.high_high) == points


def test_no_alarms_are_no_alarms():
    assert one({}).alarms.pv is None
    assert one({}).alarms.deviation is None


# --- places ----------------------------------------------------------------------------------------------------------


def starts(file, **options):
    """Where the blocks of every loop begin."""
    loops = ClickFile.model_validate(from_neutral(file, options).data).loops
    return [(loop.bits, loop.integers, loop.floats) for loop in loops]


def test_blocks_follow_each_other_from_the_first_register():
    assert starts(generic({}, {}, {})) == [(1, 1, 1), (41, 16, 26), (81, 31, 51)]


def test_options_say_where_blocks_begin_and_the_rest_follows_without_overlapping():
    assert starts(generic({}, {}), bits=["C101"], floats=["DF100", "DF10"]) == [(101, 1, 100), (141, 16, 10)]
    found = starts(generic({}, {}, {}), bits=["C101", "C50"])
    assert [row[0] for row in found] == [101, 50, 141]  # C90 would reach into C101


def test_options_for_loops_that_there_are_not_and_blocks_without_room_are_refused():
    with pytest.raises(ConvertError, match="2 for 1"):
        starts(generic({}), bits=["C1", "C101"])
    with pytest.raises(ConvertError, match="C1980"):
        starts(generic({}), bits=["C1980"])


def test_pulse_outputs_do_not_meet():
    file = generic(*[{"output": {"pulse": {"period": 10}}}] * 3)
    data = from_neutral(file, {"pwm_bit": [{"bit": "Y002"}, {"bit": "Y001"}]}).data
    assert [loop["output"]["pwm"]["bit"] for loop in data["loops"]] == ["Y002", "Y001", "Y003"]


# --- the whole -------------------------------------------------------------------------------------------------------


def test_every_field_is_said_or_known_to_be_none_of_anybodys_business():
    loop = click(EVERYTHING).loops[0]
    spoken = {field.path for field in to_neutral(click(EVERYTHING))[0].fields}
    assert leaves(loop) - spoken <= set(HARMLESS_FIELDS)


def test_the_report_says_what_became_of_every_field():
    config = click({"tuning": {"derivative_gain": 4}, "pv": {"filter": 80}, "derivative_gain_limit": 7})
    found = {(change.field, change.kind) for change in convert(config, CLICK, CLICK, {}).loops[0][1]}
    fields = ("pv.filter", "derivative_gain_limit", "sample_rate", "action", "pv.input_range")
    assert {(field, "exact") for field in fields} <= found
    assert {("pv.range", "assumed"), ("bits", "exact")} <= found


def test_every_neutral_field_is_put_somewhere_or_dropped_by_name():
    file = generic({}, neutral_strategies.EVERYTHING)
    assert unheard(file, from_neutral(file, {}).fields[1]) == set()
    linear = merged(neutral_strategies.EVERYTHING, {"tuning": {"proportional": True, "derivative_time": 0}})
    file = generic({}, linear)
    assert unheard(file, from_neutral(file, {}).fields[1]) <= {"tuning.proportional"}


def effective(config: ClickFile) -> dict:
    """The settings in the registers of the loops, with switches off whose value means none."""
    cells = {(c.loop, c.field): c.raw for c in encode(config).image.cells if c.access == "setting"}
    for loop in config.loops:
        name = loop.name
        if not loop.error.deadband:
            cells[name, "deadband_enable"] = 0
        if not loop.pv.filter or loop.pv.filter == 100:
            cells[name, "filter_enable"] = 0
        if loop.derivative_gain_limit == 100 or not loop.tuning.derivative_gain:
            cells[name, "derivative_limit_enable"] = cells[name, "derivative_gain_limit"] = 0
        del cells[name, "autotune_hysteresis"]
    return cells


ASIDE = {"pv.range", "pv.input_range"}
"""What only the autotune and other controllers look at."""


@settings(suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(configurations())
def test_there_and_back_are_the_same_registers(config):
    found = to_neutral(config)
    assume(not any(loop.missing for loop in found))
    made = from_neutral(
        GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [n.data for n in found]}), {}
    )
    back = ClickFile.model_validate(made.data)
    there, again = effective(config), effective(back)
    for neutral_loop, placed, loop in zip(found, made.fields, config.loops, strict=True):
        changed = {
            field.path
            for field in neutral_loop.fields
            if (not field.neutral or field.assumed) and field.path not in ASIDE
        }
        changed |= {put.neutral for put in placed if not put.path or put.clamped}
        changed |= {put.path for put in placed if put.neutral is None and "alarms" in put.path}
        if changed:
            continue
        different = {
            field
            for (name, field), raw in there.items()
            if name == loop.name and again[name, field] != raw and field not in {"pv_lower", "pv_upper"}
        }
        assert different == set()


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_examples_come_back_with_the_same_registers(path):
    checked = check_document(read_document(path.read_bytes(), path.name))
    if checked.vendor is None:  # a scenario
        return
    back = ClickFile.model_validate(convert(checked.config, CLICK, CLICK, {}).data)
    there, again = effective(checked.config), effective(back)
    linear = {loop.name for loop in checked.config.loops if loop.error.curve == "linear"}
    different = {field for (name, field), raw in there.items() if again[name, field] != raw and name in linear}
    assert different <= {"autotune_method", "autotune_type", "pv_lower", "pv_upper"}


def test_a_whole_loop_comes_back_but_for_what_the_report_calls_lost():
    """So that the property test above cannot pass by skipping everything."""
    full = merged(EVERYTHING, {"bumpless": 2, "error": {"curve": "linear"}, "autotune": {"method": "open"}})
    full |= {"pv": {**full["pv"], "range": [-100, 500]}, "autotune": {}}
    config = click(full)
    made = convert(config, CLICK, CLICK, {})
    there, again = effective(config), effective(ClickFile.model_validate(made.data))
    lost = {change.field for change in made.loops[0].changes if change.loss}
    names = {word.name for table in TABLES for word in table.words if word.path in lost}
    assert {key[1] for key, raw in there.items() if again[key] != raw} == names


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(neutral_files())
def test_what_is_made_has_no_errors_of_its_own(file):
    made = from_neutral(file, {})
    fit_to_registers(made, CLICK)
    text = yaml_text(made.data)
    found = check_document(read_document(text.encode(), "made.yaml")).findings
    errors = [f for f in found if f.severity is Severity.ERROR]
    assert errors == []


@settings(max_examples=60)
@given(st.sampled_from([True, False]), st.decimals("0.1", 50, places=2), st.sampled_from([(0, 100), (4, 20), (-5, 5)]))
def test_gain_and_action_survive_the_way_through_the_plc(raises, gain, span):
    loop = one({"output_raises_pv": raises, "tuning": {"gain": gain}, "output": {"range": span}})
    assert float(loop.tuning.proportional_gain) == pytest.approx(float(gain) * 100 / (span[1] - span[0]))
    assert (loop.action == "direct") is raises
