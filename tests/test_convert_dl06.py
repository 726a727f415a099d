"""DL06 loops to the neutral loop and back: the action, what the gains count in, off codes, alarms in groups."""

from __future__ import annotations

from decimal import Decimal
from itertools import combinations
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

import neutral_strategies
import pidcfg
from dl06_strategies import EVERYTHING, FORMAT_NAMES, configurations
from neutral_strategies import neutral_files, unheard
from pidcfg.conversion import ConvertError
from pidcfg.conversion.dl06 import UNWANTED_INNER_POINT, UNWANTED_POINT, from_neutral
from pidcfg.conversion.from_dl06 import HARMLESS_FIELDS, SWITCHED_OFF_NOTE, round_to_ten_digits, to_neutral
from pidcfg.conversion.pipeline import convert, fit_to_registers
from pidcfg.encoders.dl06 import CONVERT_OPTIONS
from pidcfg.encoders.dl06.image import encode, reset_value, scales_of
from pidcfg.encoders.maps.dl06 import LOOP_TABLE
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dl06 import Dl06File, Loop
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.diagnostics import Severity
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples" / "dl06"
DL06 = VENDORS["dl06"]
LOOP = {
    "name": "L1",
    "sample_rate": 0.5,
    "action": "direct",
    "tuning": {"gain": 2, "reset": 30},
    "pv": {"range": [0, 200]},
    "output": {"range": [0, 50]},
}
NEUTRAL = {
    "name": "L1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 0.5, "integral_time": 30},
    "pv": {"range": [0, 200]},
    "output": {"range": [0, 50]},
}


def dl06(*loops: dict, **plc) -> Dl06File:
    """A DL06 file of loops that differ from a plain one."""
    entries = [{**LOOP, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    data = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000", **plc}, "loops": entries}
    return Dl06File.model_validate(data)


def generic(*loops: dict) -> GenericFile:
    """A neutral file of loops that differ from a plain one."""
    entries = [{**NEUTRAL, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


def neutral(loop: dict, **plc):
    """The neutral loop of a DL06 loop, as its model has it."""
    found = to_neutral(dl06(loop, **plc))[0]
    assert found.missing == []
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [found.data]}).loops[0]


def lost(loop: dict, **plc) -> dict[str, str]:
    """What a DL06 loop loses, by field, with the advice."""
    return {field.path: field.note for field in to_neutral(dl06(loop, **plc))[0].fields if not field.neutral}


def target(*loops: dict, **options):
    """The DL06 file of neutral loops, and what happened to each neutral field of the first."""
    made = from_neutral(generic(*loops), options)
    return Dl06File.model_validate(made.data), made.fields[0]


def one(loop: dict, **options):
    """The DL06 loop of a neutral one."""
    return target(loop, **options)[0].loops[0]


def dropped(*loops: dict, **options) -> dict[str, str]:
    """The neutral fields of the first loop that find no place, with the advice."""
    return {put.neutral: put.note for put in target(*loops, **options)[1] if not put.path}


def clamped(loop: dict, **options) -> set[str]:
    """The fields that the DL06 cannot hold as they are."""
    return {put.path for put in target(loop, **options)[1] if put.clamped}


def convert_neutral(loop: dict) -> dict:
    """The alarms of the file, with what the DL06 can hold."""
    made = from_neutral(generic(loop), {})
    fit_to_registers(made, DL06)
    return made.data["loops"][0]["alarms"]


def back_and_forth(config: Dl06File, **options):
    """A conversion to the same family, with its report."""
    return convert(config, DL06, DL06, options)


def error_codes(data: dict) -> list[str]:
    """The rules that a file breaks."""
    found = check_document(read_document(yaml_text(data).encode(), "made.yaml")).findings
    return [f"{d.code} {d.message}" for d in found if d.severity is Severity.ERROR]


# --- action ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("action", "raises"), [("direct", True), ("reverse", False)])
def test_the_action_is_that_of_the_process(action, raises):
    assert neutral({"action": action}).output_raises_pv is raises
    config, _ = target({"output_raises_pv": raises})
    assert config.loops[0].action == action
    assert bool(encode(config).image.words[0o2000] & 0o20) is not raises


# --- gain ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("pv", "output", "share", "gain"),
    [
        ([0, 200], [0, 50], "2", "0.5"),
        ([0, 100], [0, 100], "1.5", "1.5"),
        ([-50, 150], [4, 20], "5", "0.4"),
        ([0, 50], [0, 100], "0.8", "1.6"),
    ],
)
def test_gains_are_shares_of_the_spans(pv, output, share, gain):
    parts = {"pv": {"range": pv}, "output": {"range": output}}
    assert neutral({**parts, "tuning": {"gain": share}} | {"tuning": {"gain": float(share)}}).tuning.gain == Decimal(
        gain
    )
    assert one({**parts, "tuning": {"gain": float(gain)}}).tuning.gain == Decimal(share)


def test_gain_zero_is_no_proportional_action_and_gain_one():
    """Ki = Ts/Ti and Kr = Td/Ts then: the span of the output for the span of the PV."""
    tuning = neutral({"tuning": {"gain": 0, "reset": 30}}).tuning
    assert (tuning.proportional, tuning.gain, tuning.integral_time) == (False, Decimal("0.25"), Decimal(30))
    [told] = [field for field in to_neutral(dl06({"tuning": {"gain": 0}}))[0].fields if field.path == "tuning.gain"]
    assert (told.value, told.neutral) == (0, ("tuning.gain", "tuning.proportional"))


def test_without_a_proportional_action_the_gain_goes_into_the_times():
    tuning = one({"tuning": {"gain": 0.5, "proportional": False, "integral_time": 30, "derivative_time": 4}}).tuning
    assert tuning.gain == 0
    assert tuning.reset.duration.value == 15  # half the time, twice as fast: gain 0.5 is 2 % per %
    assert tuning.rate == 8


def test_a_gain_of_zero_takes_the_other_terms_with_it():
    """A DL06 would let them act as with gain 1."""
    loop = one({"tuning": {"gain": 0, "integral_time": 30, "derivative_time": 4}})
    assert (loop.tuning.gain, str(loop.tuning.reset), loop.tuning.rate) == (0, "off", 0)


def test_a_gain_that_rounds_onto_the_off_code_is_refused():
    with pytest.raises(ConvertError, match="switches it off"):
        back_and_forth(dl06({"tuning": {"gain": 0.004, "reset": 30}}))


# --- reset -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("reset", "unit", "decimals", "seconds", "shown"),
    [
        (30, "seconds", 1, "30", "30 s"),
        (2, "minutes", 1, "120", "2 min"),
        ("2 min", "seconds", 1, "120", "2 min"),
        ("120 s", "minutes", 1, "120", "120 s"),
        ("off", "seconds", 1, "0", "off"),
        (0, "seconds", 1, "0", "0 s"),
        (999.9, "seconds", 1, "0", "999.9 s"),
        (999.9, "minutes", 1, "0", "999.9 min"),
        (99.99, "minutes", 2, "0", "99.99 min"),
        (99.99, "minutes", 1, "5999.4", "99.99 min"),
        (999.8, "seconds", 1, "999.8", "999.8 s"),
    ],
)
def test_reset_times_are_seconds_and_the_codes_are_off(reset, unit, decimals, seconds, shown):
    loop = {"tuning": {"gain": 1, "reset": reset, "reset_unit": unit}}
    assert neutral(loop, reset_decimals=decimals).tuning.integral_time == Decimal(seconds)
    (loop,) = to_neutral(dl06(loop, reset_decimals=decimals))
    assert [field.value for field in loop.fields if field.path == "tuning.reset"] == [shown]


@pytest.mark.parametrize(
    ("seconds", "options", "reset", "unit"),
    [
        (30, {}, "30", "seconds"),
        (999.8, {}, "999.8", "seconds"),
        (1200, {}, "20", "minutes"),
        (0, {}, None, None),
        (99.98, {"reset_decimals": 2}, "99.98", "seconds"),
        (99.99, {"reset_decimals": 2}, "99.98", "seconds"),
        (100.1, {"reset_decimals": 2}, "1.668333333", "minutes"),
        (1000.9, {}, "999.8", "seconds"),
        (1000.91, {}, "16.68183333", "minutes"),
        (1e35, {}, "999.8", "minutes"),
        (1e300, {"reset_decimals": 2}, "99.98", "minutes"),
        (59988, {}, "999.8", "minutes"),
    ],
)
def test_a_reset_is_in_the_unit_that_holds_it(seconds, options, reset, unit):
    tuning = one({"tuning": {"gain": 1, "integral_time": seconds}}, **options).tuning
    duration = tuning.reset.duration
    assert (duration and duration.value) == (None if reset is None else Decimal(reset))
    assert unit is None or tuning.reset_unit == unit


def test_a_reset_never_becomes_the_code_that_switches_it_off():
    loop = {"tuning": {"gain": 1, "integral_time": 59994}}  # 999.9 min
    assert one(loop).tuning.reset.duration.value == Decimal("999.8")
    assert clamped(loop) == {"tuning.reset"}
    assert clamped({"tuning": {"gain": 1, "integral_time": 59988}}) == set()  # 999.8 min


def test_a_rounded_reset_is_reported():
    made = back_and_forth(dl06({"tuning": {"gain": 1, "reset": "1201 s"}}))
    change = next(c for c in made.loops[0][1] if c.field == "tuning.reset")
    assert (change.kind, change.target) == ("rounded", 20)
    assert change.error_percent == pytest.approx(100 / 1201)


# --- derivative ------------------------------------------------------------------------------------------------------


def test_the_derivative_gain_limit_is_a_filter():
    loop = {"tuning": {"gain": 1, "rate": 6}, "derivative_gain_limit": 10}
    tuning = neutral(loop).tuning
    assert (tuning.derivative_time, tuning.derivative_filter, tuning.derivative_on) == (6, Decimal("0.6"), "error")
    assert neutral(loop, derivative="pv").tuning.derivative_on == "pv"
    made = one({"tuning": {"gain": 1, "derivative_time": 6, "derivative_filter": 0.6}})
    assert (made.tuning.rate, made.derivative_gain_limit) == (6, 10)


def test_the_limit_is_the_one_whose_filter_is_nearest_to_the_wanted_time():
    loop = {"tuning": {"gain": 1, "derivative_time": 10, "derivative_filter": 6.8}}
    assert one(loop).derivative_gain_limit == 2
    found = convert(generic(loop), VENDORS["generic"], DL06, {}).loops[0][1]
    limit = next(change for change in found if change.field == "tuning.derivative_filter")
    assert (limit.kind, limit.source, limit.target) == ("rounded", Decimal("6.8"), 5)
    assert limit.error_percent == pytest.approx(100 * 1.8 / 6.8)


def test_the_rate_of_change_is_reported_as_the_word_holds_it():
    loop = {"pv": {"range": [0, 400]}, "sample_time": 1, "alarms": {"rate_of_change": 0.25}}
    found = convert(generic(loop), VENDORS["generic"], DL06, {}).loops[0][1]
    rate = next(change for change in found if change.field == "alarms.rate_of_change")
    assert (rate.kind, rate.target) == ("rounded", 0.293)  # 3 counts of 400 / 4095
    assert rate.error_percent == pytest.approx(100 * (1200 / 4095 / 0.25 - 1))


def test_a_limit_of_zero_is_no_derivative_and_one_without_a_rate_is_nothing():
    assert neutral({"tuning": {"gain": 1, "rate": 6}, "derivative_gain_limit": 0}).tuning.derivative_time == 0
    assert (
        neutral({"tuning": {"gain": 1, "rate": 6}, "derivative_gain_limit_enabled": True}).tuning.derivative_time == 0
    )
    assert "derivative_gain_limit" in lost({"derivative_gain_limit": 10})
    off = {"tuning": {"gain": 1, "rate": 6}, "derivative_gain_limit": 10, "derivative_gain_limit_enabled": False}
    assert neutral(off).tuning.derivative_filter == 0
    assert "derivative_gain_limit" in lost(off)


NONE_LEFT = "a derivative gain limit of 0 leaves no derivative"
ENABLED = {"derivative_gain_limit_enabled": True}


@pytest.mark.parametrize(
    ("rate", "limit", "told"),
    [
        (6, {}, {"tuning.rate": (6, ("tuning.derivative_time",), "")}),
        (0, {}, {"tuning.rate": (0, ("tuning.derivative_time",), "")}),
        (
            6, {"derivative_gain_limit": 10},
            {
                "tuning.rate": (6, ("tuning.derivative_time",), ""),
                "derivative_gain_limit": (10, ("tuning.derivative_filter",), ""),
            },
        ),
        (
            0, {"derivative_gain_limit": 10},
            {
                "tuning.rate": (0, ("tuning.derivative_time",), ""),
                "derivative_gain_limit": (10, (), "without a rate it does nothing"),
            },
        ),
        (
            6, {"derivative_gain_limit": 0},
            {"tuning.rate": (6, (), NONE_LEFT), "derivative_gain_limit": (0, (), NONE_LEFT)},
        ),
        (
            0, {"derivative_gain_limit": 0},
            {
                "tuning.rate": (0, ("tuning.derivative_time",), ""),
                "derivative_gain_limit": (0, (), NONE_LEFT),
            },
        ),
        (6, ENABLED, {"tuning.rate": (6, (), NONE_LEFT), "derivative_gain_limit_enabled": (True, (), NONE_LEFT)}),
    ],
)  # fmt: skip
def test_the_rate_and_its_limit_are_told_by_what_they_leave(rate, limit, told):
    (found,) = to_neutral(dl06({"tuning": {"gain": 1, "rate": rate}, **limit}))
    lines = {f.path: (f.value, f.neutral, f.note) for f in found.fields if f.path in told}
    assert lines == told
    acts = [field.value for field in found.fields if field.path == "plc.derivative"]
    assert acts == ["error"] * bool(rate and told["tuning.rate"][1])


@pytest.mark.parametrize(("time", "limit", "brought"), [(0.1, 20, True), (60, 1, True), (0.6, 10, False)])
def test_a_filter_is_brought_within_the_limits_of_the_limit(time, limit, brought):
    loop = {"tuning": {"gain": 1, "derivative_time": 6, "derivative_filter": time}}
    assert one(loop).derivative_gain_limit == limit
    assert clamped(loop) == ({"derivative_gain_limit"} if brought else set())


def test_a_derivative_of_the_pv_is_reported_unless_the_cpu_has_it():
    loop = {"tuning": {"gain": 1, "derivative_time": 6, "derivative_on": "pv"}}
    assert "kicks the output" in dropped(loop)["tuning.derivative_on"]
    assert dropped(loop, derivative="pv") == {}
    assert target(loop, derivative="pv")[0].plc.derivative == "pv"
    error = {"tuning": {"gain": 1, "derivative_time": 6, "derivative_on": "error"}}
    assert dropped(error) == {}
    assert target(error)[0].plc.derivative == "error"
    assert "tuning.derivative_on" in dropped(error, derivative="pv")


# --- PV and its filter -----------------------------------------------------------------------------------------------


def test_the_filter_constant_is_a_time_constant():
    """Tc = -Ts/ln(1 - k), here ln 2 in half a second."""
    pv = {"range": [0, 200], "filter": 0.5}
    time = neutral({"pv": pv}).pv.filter
    assert float(time) == pytest.approx(0.5 / 0.6931471805599453)
    assert one({"pv": {"range": [0, 200], "filter": float(time)}}).pv.filter == Decimal("0.5")


@pytest.mark.parametrize("k", [0, 1.0, 1.1, 999.9])
def test_a_filter_that_does_nothing_is_none(k):
    assert neutral({"pv": {"range": [0, 200], "filter": k}}).pv.filter == 0


SPAN = {"range": [0, 200]}


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ({"derivative_gain_limit": 10, "derivative_gain_limit_enabled": False}, {"derivative_gain_limit": 10}),
        ({"pv": {**SPAN, "filter": 0.5, "filter_enabled": False}}, {"pv.filter": Decimal("0.5")}),
        ({"setpoint": {"limits": [10, 90.5], "limits_enabled": False}}, {"setpoint.limits": [10, Decimal("90.5")]}),
        (
            {"setpoint": {"limits": ["7 counts", "4000 counts"], "limits_enabled": False}},
            {"setpoint.limits": ["7 counts", "4000 counts"]},
        ),
        ({"error": {"deadband": 2.5, "deadband_enabled": False}}, {"error.deadband": Decimal("2.5")}),
        ({"error": {"deadband": "41 counts", "deadband_enabled": False}}, {"error.deadband": "41 counts"}),
        (
            {"alarms": {"pv": {"low": 10, "high": "4000 counts", "enabled": False}}},
            {"alarms.pv.low": 10, "alarms.pv.high": "4000 counts"},
        ),
        (
            {"alarms": {"deviation": {"yellow": "9 counts", "red": 20, "enabled": False}}},
            {"alarms.deviation.yellow": "9 counts", "alarms.deviation.red": 20},
        ),
        *(
            ({"alarms": {"rate_of_change": rate, "rate_of_change_enabled": False}}, {"alarms.rate_of_change": told})
            for rate, told in ((0.5, "0.5 /sample"), ("6 /min", "6 /min"), ("3 counts/s", "3 counts /s"))
        ),
    ],
)
def test_a_value_that_is_switched_off_is_not_carried_over_and_told_as_the_file_has_it(loop, told):
    tuning = {"tuning": {"gain": 1, "rate": 6}}
    fields = to_neutral(dl06({**loop, **tuning}))[0].fields
    assert {field.path: field.value for field in fields if field.note == SWITCHED_OFF_NOTE} == told
    assert not [field.neutral for field in fields if field.path in told and field.neutral]
    assert neutral({**loop, **tuning}) == neutral(tuning)


def test_the_strongest_filter_is_a_tenth():
    loop = {"pv": {"range": [0, 200], "filter": 60}}
    assert one(loop).pv.filter == Decimal("0.1")
    assert clamped(loop) == {"pv.filter"}


def test_a_filter_of_a_tenth_comes_back_as_it_was():
    loop = {"pv": {"range": [0, 200], "filter": neutral({"pv": {"range": [0, 200], "filter": 0.1}}).pv.filter}}
    assert one(loop).pv.filter == Decimal("0.1")
    assert clamped(loop) == set()


def test_filter_and_rate_of_change_count_in_the_samples_that_the_word_holds():
    loop = {"sample_time": 0.01, "pv": {"range": [0, 200], "filter": 0.1}, "alarms": {"rate_of_change": 20}}
    made = one(loop)
    assert clamped(loop) == {"sample_rate"}
    assert made.sample_rate == Decimal("0.05")
    assert float(made.pv.filter) == pytest.approx(1 - 2.718281828459045**-0.5)
    assert made.alarms.rate_of_change.value == 1


# --- what the file must say ------------------------------------------------------------------------------------------


def test_what_must_be_known_is_named_and_a_sample_rate_of_0_is_none():
    found = to_neutral(dl06({"sample_rate": 0, "pv": {}}))[0]
    assert found.data == {}
    assert [(missing.path, missing.message) for missing in found.missing] == [
        (
            ("loops", 0, "pv", "range"),
            "add pv.range: the engineering values at 0 % and 100 %; the gain depends on its span",
        ),
        (("loops", 0, "sample_rate"), "correct sample_rate: a loop with 0 s is not calculated"),
    ]


def test_a_missing_range_names_the_key():
    found = to_neutral(dl06({}, {"pv": {"unit": "degC"}}))[1].missing
    assert [m.path for m in found] == [("loops", 1, "pv", "range")]
    assert "add pv.range" in found[0].message


def test_limits_that_do_not_ascend_are_named():
    with pytest.raises(ConvertError, match=r"correct output\.limits"):
        back_and_forth(dl06({"output": {"range": [0, 50], "limits": [40, 5]}}))
    with pytest.raises(ConvertError, match=r"correct setpoint\.limits"):
        back_and_forth(dl06({"setpoint": {"limits": [40, 40]}}))


def test_an_output_without_a_range_is_percent_and_its_values_are_counts():
    found = to_neutral(dl06({"output": {"limits": [0, 4095]}, "tuning": {"gain": 2}}))[0]
    field = next(s for s in found.fields if s.path == "output.range")
    assert field.assumed
    assert found.data["output"]["range"] == [0, 100]
    assert found.data["output"]["limits"] == [0, 100]
    assert found.data["tuning"]["gain"] == 1


def test_counts_are_engineering_values():
    loop = neutral({"setpoint": {"value": "2048 counts"}, "error": {"deadband": "41 counts"}})
    assert float(loop.setpoint.value) == pytest.approx(2048 / 4095 * 200)
    assert float(loop.deadband) == pytest.approx(41 / 4095 * 200)


# --- alarms ----------------------------------------------------------------------------------------------------------


ALARMS = {
    "pv": {"low_low": 10, "low": 20, "high": 150, "high_high": 160},
    "deviation": {"yellow": 5, "red": 10},
    "rate_of_change": 0.5,
    "hysteresis": 1,
}


def test_alarms_go_to_their_twins_and_back():
    alarms = neutral({"alarms": ALARMS}).alarms
    assert (alarms.pv.low_low, alarms.pv.low, alarms.pv.high, alarms.pv.high_high) == (10, 20, 150, 160)
    assert (alarms.deviation.high, alarms.deviation.high_high, alarms.hysteresis) == (5, 10, 1)
    assert alarms.rate_of_change == 1  # half a unit in half a second
    assert neutral({"alarms": {"rate_of_change": "6 /min"}}).alarms.rate_of_change == Decimal("0.1")
    made = one({"alarms": alarms.model_dump()}).alarms
    assert dict(made.pv) == {k: Quantity(Decimal(v)) for k, v in ALARMS["pv"].items()} | {"enabled": None}
    assert (made.deviation.yellow.value, made.deviation.red.value, made.hysteresis.value) == (5, 10, 1)
    assert made.rate_of_change.per_sample(Decimal("0.5")) == Quantity(Decimal("0.5"))


def test_alarms_that_are_switched_off_are_not_carried_over():
    off = {
        "pv": {**ALARMS["pv"], "enabled": False},
        "deviation": {**ALARMS["deviation"], "enabled": False},
        "rate_of_change": 0.5,
        "rate_of_change_enabled": False,
    }
    alarms = neutral({"alarms": off}).alarms
    assert alarms.pv.low is None
    assert alarms.deviation.high is None
    assert alarms.rate_of_change is None
    assert {"alarms.pv.low_low", "alarms.pv.high", "alarms.deviation.red", "alarms.rate_of_change"} <= set(
        lost({"alarms": off})
    )


NOT_GIVEN = "not given: the PLC compares with 0 counts"


@pytest.mark.parametrize(
    ("alarms", "told"),
    [
        ({"pv": {"low": 20, "high": "4000 counts", "high_high": 200}}, {
            "alarms.pv.low_low": (None, 0, NOT_GIVEN), "alarms.pv.low": (20, 20, ""),
            "alarms.pv.high": ("4000 counts", "195.360195360", ""), "alarms.pv.high_high": (200, 200, ""),
        }),
        ({"deviation": {"red": "41 counts"}}, {
            "alarms.deviation.yellow": ("0 counts", 0, NOT_GIVEN),
            "alarms.deviation.red": ("41 counts", "2.00244200244", ""),
        }),
        ({"rate_of_change": 0.5}, {"alarms.rate_of_change": ("0.5 /sample", 1, "")}),
        ({"rate_of_change": "6 /min"}, {"alarms.rate_of_change": ("6 /min", "0.1", "")}),
        ({"rate_of_change_enabled": True}, {"alarms.rate_of_change_enabled": (True, 0, NOT_GIVEN)}),
        ({"hysteresis": "41 counts"}, {"alarms.hysteresis": ("41 counts", "2.00244200244", "")}),
    ],
)  # fmt: skip
def test_alarms_are_told_as_the_file_has_them_and_a_word_that_is_not_given_is_0_counts(alarms, told):
    (found,) = to_neutral(dl06({"alarms": alarms}))
    lines = {f.path: (f.value, f.note, f.assumed) for f in found.fields if f.path.startswith("alarms.")}
    assert lines == {path: (value, note, bool(note) and value is not True) for path, (value, _, note) in told.items()}
    values = {f.path: value_at(found.data, parse_path(f.neutral[0])) for f in found.fields if f.path in told}
    assert {path: float(value) for path, value in values.items()} == pytest.approx(
        {path: float(value) for path, (_, value, _) in told.items()}
    )


def test_a_point_that_is_not_given_is_zero_counts():
    """One bit enables them all (D20)."""
    pv = {"range": [-50, 150], "format": "12-bit bipolar"}
    alarms = neutral({"pv": pv, "alarms": {"pv": {"low": 60, "high": 100, "high_high": 120}}}).alarms
    assert alarms.pv.low_low == 50


def test_a_rate_of_change_that_is_on_without_a_value_is_zero_counts():
    found = to_neutral(dl06({"alarms": {"rate_of_change_enabled": True}}))[0]
    (field,) = [field for field in found.fields if field.path.startswith("alarms")]
    assert (field.path, field.value) == ("alarms.rate_of_change_enabled", True)
    assert field.note == "not given: the PLC compares with 0 counts"
    assert (field.neutral, found.data["alarms"]) == (("alarms.rate_of_change",), {"rate_of_change": 0})


def test_a_hysteresis_goes_over_without_alarms_and_is_told():
    made, fields = target({"alarms": {"hysteresis": 1}})
    assert made.loops[0].alarms.hysteresis.value == 1
    assert [put.path for put in fields if put.neutral == "alarms.hysteresis"] == ["alarms.hysteresis"]


POINTS = {"low_low": 10, "low": 20, "high": 150, "high_high": 160}
IN_COUNTS = {"low_low": 205, "high_high": 3276}
"""Those of the outer points on 0 to 200 in 0 to 4095."""


@pytest.mark.parametrize("wanted", [keys for n in range(1, 5) for keys in combinations(POINTS, n)])
def test_points_that_a_group_needs_besides_stand_out_of_the_way(wanted):
    """At an end of the scale, or one count within the outer neighbour, which at the end refuses Auto (D282)."""
    outer = {"low_low": 0, "high_high": 4095} | {key: IN_COUNTS[key] for key in wanted if key in IN_COUNTS}
    places = {**outer, "low": outer["low_low"] + 1, "high": outer["high_high"] - 1}
    texts = {key: str(value) if key in wanted else f"{places[key]} counts" for key, value in POINTS.items()}
    notes = {key: "" if key in wanted else UNWANTED_POINT for key in POINTS}
    notes |= {key: UNWANTED_INNER_POINT for key in POINTS if key not in wanted and places[key] in {1, 4094}}
    made, fields = target({"alarms": {"pv": {key: POINTS[key] for key in wanted}}})
    assert {key: str(getattr(made.loops[0].alarms.pv, key)) for key in POINTS} == texts
    assert {put.path.rpartition(".")[2]: put.note for put in fields if put.path.startswith("alarms.pv.")} == notes


@pytest.mark.parametrize(
    ("given", "places"),
    [
        ({"low_low": 0, "low": 20, "high": 150, "high_high": 200}, ["0", "20", "150", "200"]),
        ({"low": 0, "high": 150}, ["0 counts", "1 counts", "150", "4095 counts"]),
        ({"low": 20, "high": 200}, ["0 counts", "20", "4094 counts", "4095 counts"]),
    ],
)
def test_points_at_an_end_of_the_scale(given, places):
    made = one({"alarms": {"pv": given}})
    assert [str(getattr(made.alarms.pv, key)) for key in POINTS] == places


def test_a_point_that_no_pv_passes_makes_room_and_is_reported():
    assert set(dropped({"alarms": {"pv": {"low": 0, "high": 150}}})) == {"alarms.pv.low"}
    assert set(dropped({"alarms": {"pv": {"low": 20, "high": 200}}})) == {"alarms.pv.high"}
    assert one({"alarms": {"pv": {"high": 200}}}).alarms.pv is None
    below = {"alarms": {"pv": {"low_low": -20, "low": -10, "high": 150, "high_high": 160}}}
    assert set(dropped(below)) == {"alarms.pv.low"}
    made = convert_neutral(below)
    assert made["pv"] == {"low_low": 0, "low": "1 counts", "high": 150, "high_high": 160}


def test_points_that_round_to_the_same_counts_are_refused():
    with pytest.raises(ConvertError, match=r"high 150 and high_high 150\.01"):
        target({"alarms": {"pv": {"high": 150, "high_high": 150.01}}})
    with pytest.raises(ConvertError, match=r"yellow 5 and red 5\.005"):
        target({"alarms": {"deviation": {"high": 5, "high_high": 5.005}}})


def test_a_deviation_alone_gets_its_partner():
    made = one({"alarms": {"deviation": {"high": 5}}}).alarms.deviation
    assert (str(made.yellow), str(made.red)) == ("5", "4095 counts")
    made = one({"alarms": {"deviation": {"high_high": 10}}}).alarms.deviation
    assert (str(made.yellow), str(made.red)) == ("204 counts", "10")
    assert set(dropped({"alarms": {"deviation": {"high": 250}}})) == {"alarms.deviation.high"}


@pytest.mark.parametrize(
    ("wanted", "deviation", "held", "field"),
    [
        (0, 5, "1 counts", set()),
        (0.01, 5, "1 counts", set()),
        (2, 5, "2", set()),
        (8, 5, None, {"alarms.hysteresis"}),
        (100, None, "25", {"alarms.hysteresis"}),
    ],
)
def test_the_hysteresis_is_brought_where_the_plc_takes_it(wanted, deviation, held, field):
    alarms = {"pv": {"high": 150}, "deviation": {"high": deviation}, "hysteresis": wanted}
    made = target({"alarms": alarms})[0]
    assert clamped({"alarms": alarms}) == field
    assert held is None or str(made.loops[0].alarms.hysteresis) == held
    assert error_codes(from_neutral(generic({"alarms": alarms}), {}).data) == []


@pytest.mark.parametrize(
    ("yellow", "wanted", "held", "note"),
    [
        (None, 0, "1 counts", "a DL06 wants at least one count"),
        (None, 0.5, "1 counts", "a DL06 wants at least one count"),
        (None, 1, "1", ""),
        (None, 512, "512", ""),
        (None, 513, "512", "at most 12.5 % of the span and less than the yellow deviation"),
        (600, 513, "512", "at most 12.5 % of the span and less than the yellow deviation"),
        (9, 8, "8", ""),
        (9, 9, "8", "at most 12.5 % of the span and less than the yellow deviation"),
        (2, 2, "1", "at most 12.5 % of the span and less than the yellow deviation"),
        (1, 1, "1", ""),
        (1, 2, "1", "at most 12.5 % of the span and less than the yellow deviation"),
    ],
)
def test_a_hysteresis_is_a_count_at_least_and_an_eighth_of_the_span_at_most_below_the_yellow_deviation(
    yellow, wanted, held, note
):
    """On a scale of a unit a count: 0 to 4095 (D282)."""
    alarms = {"pv": {"high": 3000}, "deviation": {"high": yellow}, "hysteresis": wanted}
    made, fields = target({"pv": {"range": [0, 4095]}, "alarms": alarms})
    assert str(made.loops[0].alarms.hysteresis) == held
    (put,) = (put for put in fields if put.path == "alarms.hysteresis")
    assert (put.neutral, put.note) == ("alarms.hysteresis", note)
    assert (put.assumed, put.clamped) == ("at least" in note, "at most" in note)


def test_a_rate_of_change_of_less_than_half_a_count_is_dropped():
    assert set(dropped({"alarms": {"rate_of_change": 0.04}})) == {"alarms.rate_of_change"}
    assert dropped({"alarms": {"rate_of_change": 0.05}}) == {}


# --- square root -----------------------------------------------------------------------------------------------------


def test_alarms_of_a_square_root_loop_become_alarms_of_the_flow():
    """A quarter of the differential pressure is half of the flow."""
    loop = {"pv": {"range": [0, 200], "square_root": True}, "alarms": ALARMS | {"pv": {**ALARMS["pv"], "low": 50}}}
    found = neutral(loop)
    assert found.pv.square_root
    assert found.alarms.pv.low == 100
    assert found.alarms.deviation.high is None
    assert {"alarms.deviation.red", "alarms.rate_of_change", "alarms.hysteresis"} <= set(lost(loop))
    made = one({"pv": {"range": [0, 200], "square_root": True}, "alarms": found.alarms.model_dump()})
    assert made.alarms.pv.low.value == 50
    assert made.pv.square_root


@pytest.mark.parametrize("low", [0, -50])
@pytest.mark.parametrize("data_format", FORMAT_NAMES)
def test_alarms_of_a_flow_come_back_from_the_squares_of_any_data_format(data_format, low):
    """The root is taken of the counts above 0, as a share of the span: a negative PV has none (D284)."""
    flows = {key: low + share * 2 for key, share in (("low_low", 10), ("low", 25), ("high", 60), ("high_high", 70))}
    loop = {"pv": {"range": [low, low + 200], "square_root": True}, "alarms": {"pv": flows}}
    config, _ = target(loop, data_format=data_format)
    assert to_neutral(config)[0].data["alarms"]["pv"] == pytest.approx({k: Decimal(v) for k, v in flows.items()})
    scale = scales_of(config.loops[0])["pv"]
    counts = {key: scale.position(getattr(config.loops[0].alarms.pv, key)) / scale.format.span for key in flows}
    shares = {"low_low": "0.01", "low": "0.0625", "high": "0.36", "high_high": "0.49"}
    assert counts == pytest.approx({key: Decimal(share) for key, share in shares.items()}, abs=Decimal("1e-8"))


def test_a_number_that_was_worked_out_has_ten_digits():
    assert round_to_ten_digits(Decimal("0.0123456781249")) == Decimal("0.01234567812")


def test_differences_cannot_be_squared():
    alarms = {"deviation": {"high": 5}, "rate_of_change": 1, "hysteresis": 1}
    assert set(dropped({"pv": {"range": [0, 200], "square_root": True}, "alarms": alarms})) == {
        "alarms.deviation.high",
        "alarms.rate_of_change",
        "alarms.hysteresis",
    }


def test_the_set_point_of_a_square_root_loop_is_a_flow():
    loop = {"pv": {"range": [0, 200], "square_root": True}, "setpoint": {"value": 100}, "error": {"deadband": 2}}
    assert (neutral(loop).setpoint.value, neutral(loop).deadband) == (100, 2)


# --- error, bias, forms ----------------------------------------------------------------------------------------------


def test_a_squared_error_is_dropped_and_its_deadband_is_a_root():
    """The deadband is applied to the square: a hundredth of the span is a tenth of it."""
    loop = {"error": {"curve": "squared", "deadband": 2}}
    assert "error.curve" in lost(loop)
    assert neutral(loop).deadband == 20
    assert one({"deadband": 2}).error.deadband.value == 2
    assert "error.deadband" in lost({"error": {"deadband": 2, "deadband_enabled": False}})


def test_the_bias_is_a_constant_without_an_integral_only():
    state = {"bias": 10, "output": 12}
    p_only = neutral({"tuning": {"gain": 2}, "state": state})
    assert (p_only.output.bias, p_only.output.manual) == (10, 12)
    assert neutral({"state": state}).output.bias == 0
    live_zero = {"tuning": {"gain": 2}, "output": {"range": [4, 20]}}
    assert neutral(live_zero).output.bias == 4
    assert one({"tuning": {"gain": 1}, "output": {"range": [4, 20], "bias": 4}}).state.bias is None


IN_THE_MIDDLE = "the output begins with 0 counts, in the middle of its range"
TAKEN_OVER = "a change to Auto makes it the bias"
AT_0_COUNTS = "without an integral the output stands at 0 counts when there is no error"
BIPOLAR = {"pv": {"range": [0, 200], "format": "12-bit bipolar"}, "output": {"range": [-40, 60]}}
LIVE_ZERO = {"output": {"range": [4, 20]}}


@pytest.mark.parametrize(
    ("loop", "state", "with_integral", "without"),
    [
        ({}, {}, [], []),
        (
            {}, {"bias": 10, "output": 12.5},
            [("state.output", 12.5, "manual", 12.5, "")],
            [("state.output", 12.5, "manual", 12.5, ""), ("state.bias", 10, "bias", 10, "")],
        ),
        (
            {}, {"output": "819 counts"},
            [("state.output", "819 counts", "manual", 10, "")],
            [("state.output", "819 counts", "manual", 10, ""), ("state.output", "819 counts", "bias", 10, TAKEN_OVER)],
        ),
        ({}, {"bias": "819 counts"}, [], [("state.bias", "819 counts", "bias", 10, "")]),
        ({}, {"bias": 0}, [], [("state.bias", 0, "bias", 0, "")]),
        (
            {"output": {}}, {"bias": 819, "output": 4095},
            [("state.output", "4095 counts", "manual", 100, "")],
            [("state.output", "4095 counts", "manual", 100, ""), ("state.bias", "819 counts", "bias", 20, "")],
        ),
        (LIVE_ZERO, {}, [], [("state.bias", None, "bias", 4, AT_0_COUNTS)]),
        (LIVE_ZERO, {"bias": 12}, [], [("state.bias", 12, "bias", 12, "")]),
        (BIPOLAR, {}, [("state.output", None, "manual", 10, IN_THE_MIDDLE)], [
            ("state.output", None, "manual", 10, IN_THE_MIDDLE), ("state.bias", None, "bias", 10, AT_0_COUNTS),
        ]),
        (BIPOLAR, {"output": -40}, [("state.output", -40, "manual", -40, "")], [
            ("state.output", -40, "manual", -40, ""), ("state.output", -40, "bias", -40, TAKEN_OVER),
        ]),
    ],
)  # fmt: skip
def test_the_words_of_bias_and_output_are_told_as_the_file_has_them(loop, state, with_integral, without):
    """The bias is a constant only without an integral (D283); a word that is not given is 0 counts."""
    for reset, told in ((30, with_integral), ("off", without)):
        (found,) = to_neutral(dl06({**loop, "state": state, "tuning": {"gain": 1, "reset": reset}}))
        lines = [
            (f.path, f.value, f.neutral[0].removeprefix("output."), f.note, f.assumed)
            for f in found.fields
            if f.path.startswith("state.")
        ]
        assert lines == [(path, value, key, note, value is None) for path, value, key, _, note in told]
        values = {key: value for key, value in found.data["output"].items() if key in {"bias", "manual"}}
        assert values == {key: value for _, _, key, value, _ in told}


@pytest.mark.parametrize(
    ("setpoint", "limits", "told"),
    [
        ({}, None, {}),
        ({"limits_enabled": False}, None, {}),
        ({"limits_enabled": True}, [0, 200], {"setpoint.limits_enabled": (True, "not given: the ends of the range")}),
        ({"limits": [20, "4095 counts"]}, [20, 200], {"setpoint.limits": ([20, "4095 counts"], "")}),
        (
            {"limits": [20, 180], "limits_enabled": False}, None,
            {"setpoint.limits": ([20, 180], SWITCHED_OFF_NOTE)},
        ),
    ],
)  # fmt: skip
def test_limits_of_the_set_point_that_are_not_given_are_the_ends_of_the_data_range(setpoint, limits, told):
    (found,) = to_neutral(dl06({"setpoint": setpoint}))
    assert found.data.get("setpoint", {}).get("limits") == limits
    lines = {field.path: (field.value, field.note) for field in found.fields if "limits" in field.path}
    assert lines == told


@pytest.mark.parametrize(
    ("output", "with_integral", "without"),
    [
        ({}, (None, None), (None, None)),
        ({"bias": 0}, (None, None), (None, None)),
        ({"bias": 10}, (10, None), (10, 10)),
        ({"manual": 20}, (None, 20), (None, 20)),
        ({"bias": 0, "manual": 0}, (None, 0), (None, 0)),
        ({"bias": 0, "manual": 20}, (None, 20), (0, 20)),
        ({"bias": 10, "manual": 20}, (10, 20), (10, 20)),
        ({"bias": 10, "manual": 10}, (10, 10), (10, 10)),
    ],
)
def test_a_bias_that_is_written_is_assumed_since_auto_takes_the_output(output, with_integral, without):
    """What +04 and +05 hold: without an integral the loop begins in Manual at its bias, which Auto then keeps."""
    for integral, held in ((30, with_integral), (0, without)):
        tuning = {"gain": 1, "integral_time": integral}
        made, fields = target({"tuning": tuning, "output": {"range": [0, 50], **output}})
        state = made.loops[0].state
        assert tuple(None if part is None else part.value for part in (state.bias, state.output)) == held
        told = [put.assumed for put in fields if put.neutral == "output.bias"]
        assert told == ([True] if held[0] is not None else [] if integral else [False])


def test_the_freeze_is_the_anti_windup_and_the_velocity_form_needs_none():
    assert [neutral({"bias_freeze": on}).anti_windup for on in (True, False)] == [True, False]
    assert neutral({"algorithm": "velocity"}).anti_windup
    assert "algorithm" in lost({"algorithm": "velocity"})
    assert [one({"anti_windup": on}).bias_freeze for on in (True, False)] == [True, False]


@pytest.mark.parametrize(
    ("freezes", "limits", "told"),
    [(True, [5, 45], True), (True, [0, 50], False), (False, [5, 45], False)],
)
def test_a_freeze_that_limits_inside_the_range_do_not_begin_is_told(freezes, limits, told):
    loop = {"anti_windup": freezes, "output": {"range": [0, 50], "limits": limits}}
    (note,) = (field.note for field in target(loop)[1] if field.neutral == "anti_windup")
    assert ("ends of the data range" in note) is told


def test_choices_of_the_auto_tune_are_made_anew():
    note = "choose it when the target's auto-tune is started"
    assert lost({"autotune": {"method": "open", "type": "PI"}}) == {"autotune.method": note, "autotune.type": note}
    assert lost({"autotune": {"method": "closed", "type": "PID"}}) == {}


def test_what_a_dl06_loop_cannot_do_is_dropped():
    output = {"range": [0, 50], "max_rate": 2, "pulse": {"period": 10}}
    assert set(dropped({"output": output})) == {
        "output.max_rate",
        "output.pulse.period",
        "output.pulse.min_on",
        "output.pulse.min_off",
    }


def test_the_set_point_becomes_the_pv_with_bumpless_one():
    assert [neutral(loop).setpoint.follows_pv for loop in ({}, {"bumpless": "I"}, {"bumpless": "II"})] == [
        True,
        True,
        False,
    ]
    loops = [{"setpoint": {"follows_pv": follows}} for follows in (True, False)]
    assert [one(loop).bumpless for loop in (*loops, {})] == ["I", "II", "I"]
    assert [next(p.neutral for p in target(loop)[1] if p.path == "bumpless") for loop in (*loops, {})] == [
        "setpoint.follows_pv",
        "setpoint.follows_pv",
        None,
    ]


def test_a_set_point_of_which_nothing_is_said_stays_where_there_is_one():
    told = [next(p.note for p in target(loop)[1] if p.path == "bumpless") for loop in ({"setpoint": {"value": 7}}, {})]
    assert told == ["the set point stays", "Auto begins with the present PV"]


RAMP = {"ramp_to": 60, "slope": 0.1, "soak": 10, "deviation": 2}


@pytest.mark.parametrize(
    ("steps", "text"),
    [
        ({}, "table at V3000, which the file does not hold"),
        ({"steps": []}, "no steps"),
        ({"steps": [RAMP]}, "ramp to 60 at 0.1 /s, soak 10 min within 2"),
        (
            {"steps": [RAMP, {"ramp_to": "100 counts", "slope": "2 counts", "deviation": "9 counts"}]},
            "ramp to 60 at 0.1 /s, soak 10 min within 2; ramp to 100 counts at 2 counts /s, soak 0 min within 9 counts",
        ),
        (
            {"steps": [{"ramp_to": 6.5, "slope": 0}, RAMP]},
            "ramp to 6.5 at 0 /s, soak 0 min; ramp to 60 at 0.1 /s, soak 10 min within 2",
        ),
    ],
)
@pytest.mark.parametrize("state", [{}, {"enabled": True}, {"enabled": False}])
def test_the_profile_is_in_the_report(steps, text, state):
    (field,) = (
        field
        for field in to_neutral(dl06({"ramp_soak": {"table": "V3000", **steps, **state}}))[0].fields
        if field.path == "ramp_soak"
    )
    shown = text + " (switched off)" * (state == {"enabled": False})
    assert (field.value, field.note) == (shown, f"program the profile of the set point: {shown}")


# --- cascade ---------------------------------------------------------------------------------------------------------

MINOR = {"mode": "cascade", "pv": {"range": [0, 50]}, "output": {"range": [0, 100]}}


def test_a_cascade_is_a_link_by_name_or_by_pointer():
    for link in ({"cascade_from": "L2"}, {"remote_setpoint": "V2045"}):
        assert to_neutral(dl06({**MINOR, **link}, {"mode": "auto"}))[0].data["setpoint"]["source"] == "L2"
    assert "V3000" in lost({"remote_setpoint": "V3000"})["remote_setpoint"]
    made = target({**MINOR, "setpoint": {"source": "L2"}}, {"mode": "auto"})[0]
    assert (made.loops[0].cascade_from, made.loops[0].mode) == ("L2", "cascade")


@pytest.mark.parametrize(
    ("minor", "major"),
    [
        ({}, {"output": {"range": [0, 60]}}),
        ({"pv": {"range": [0, 50], "unit": "l/h"}}, {"output": {"range": [0, 50], "unit": "m3/h"}}),
        ({"setpoint": {"source": "L9"}}, {}),
        ({"setpoint": {"source": "L1"}}, {}),
        ({"pv": {"range": [0, 50], "square_root": True}}, {}),
    ],
)
def test_a_cascade_that_a_dl06_cannot_make_is_dropped(minor, major):
    loops = {**MINOR, "setpoint": {"source": "L2"}, **minor}, {"mode": "auto", **major}
    made = target(*loops)[0].loops[0]
    assert (made.cascade_from, made.mode) == (None, "auto")
    assert "setpoint.source" in dropped(*loops)
    assert error_codes(from_neutral(generic(*loops), {}).data) == []


def test_a_major_loop_that_could_not_leave_manual_is_not_linked():
    loops = {**MINOR, "mode": "auto", "setpoint": {"source": "L2"}}, {"mode": "auto"}
    assert "cannot leave Manual" in dropped(*loops)["setpoint.source"]
    assert error_codes(from_neutral(generic(*loops), {}).data) == []


# --- placement -------------------------------------------------------------------------------------------------------


def test_options_say_where_and_for_which_cpu():
    read = {option.key: option.read for option in CONVERT_OPTIONS}
    texts = {"loop_table": "V3000", "reset_decimals": "2", "data_format": "15-bit unipolar", "derivative": "pv"}
    options = {key: read[key](text) for key, text in texts.items()}
    config, puts = target({}, **options)
    assert (config.plc.loop_table, config.plc.reset_decimals, config.plc.derivative) == (0o3000, 2, "pv")
    assert config.loops[0].pv.format == "15-bit unipolar"
    assert any(put.neutral is None and put.path == "/plc.loop_table" for put in puts)
    source = generic({})
    found = [*convert(source, VENDORS["generic"], DL06, {}).loops[0][1], *back_and_forth(dl06({})).loops[0][1]]
    told = [(row.kind, row.target) for row in found if row.field == "/plc.loop_table"]
    assert told == [("assumed", "V2000"), ("exact", "V2000")]
    assert read["data_format"]("14-bit") is None
    assert target({})[0].plc.loop_table == 0o2000


def test_eight_loops_and_no_faster_than_they_can():
    eight = [{"sample_time": 0.05, "name": f"L{i}"} for i in range(8)]
    assert target(*eight)[0].loops[7].sample_rate == Decimal("0.1")
    assert error_codes(from_neutral(generic(*eight), {}).data) == []
    with pytest.raises(ConvertError, match="9 loops"):
        target(*eight, {"name": "L9"})


# --- any neutral loop ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("part", "change"),
    [
        ("pv", {}),
        ("pv", {"square_root": False}),
        ("tuning", {"gain": 0}),
        ("tuning", {"derivative_time": 0}),
        ("tuning", {"proportional": True}),
        ("output", {"limits": [0, 50]}),
    ],
)
def test_no_neutral_field_goes_unheard(part, change):
    whole = neutral_strategies.EVERYTHING
    file = generic({"name": "L0", "mode": "manual"}, {**whole, part: {**whole[part], **change}})
    silent = unheard(file, from_neutral(file, {}).fields[1])
    assert silent - {f"{part}.{key}" for key in change} == set()


def test_limits_within_a_count_of_the_root_are_refused():
    """The converter writes what it is told, and the rules of the DL06 stop the file."""
    root = {"pv": {"range": [-50, 150], "square_root": True}, "setpoint": {"value": 9, "limits": [8, 10]}}
    file = generic(root)
    assert limits_share_a_count(file.loops[0])
    [fault] = error_codes(from_neutral(file, {}).data)
    assert fault.startswith("DL228 ")
    assert "19 counts" in fault


@given(file=neutral_files())
@settings(max_examples=40, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
def test_any_neutral_loop_makes_a_valid_file(file):
    """No error of the converter's own making; what is put without a change is the same on the way back."""
    data = file.model_dump()
    try:
        made = from_neutral(file, {})
        stored = fit_to_registers(made, DL06)
    except ConvertError as error:
        assume("at least one count" not in str(error) and "switches it off" not in str(error))
        raise
    excused = (*EXCUSED, *(["DL228"] if any(map(limits_share_a_count, file.loops)) else []))
    assert [code for code in error_codes(made.data) if not code.startswith(excused)] == [], data
    again = [loop.data for loop in to_neutral(Dl06File.model_validate(made.data))]
    for loop, back, held in zip(file.loops, again, stored, strict=True):
        assert back["output_raises_pv"] is loop.output_raises_pv
        if loop.tuning.proportional and "clamped" not in {held[f"tuning.{key}"].kind for key in ("gain", "reset")}:
            for key, of in (("gain", "gain"), ("reset", "integral_time")):
                wanted = float(getattr(loop.tuning, of))
                error = held[f"tuning.{key}"].error_percent / 100 + 1e-6
                assert float(back["tuning"][of]) == pytest.approx(wanted, rel=error)


EXCUSED = ("DL214",)
"""What the neutral loop brings with it: no term at all."""


def limits_share_a_count(loop) -> bool:
    """Whether the set point limits may be one count of a root, whose span has 64: no DL06 can hold such a pair."""
    limits, (low, high) = loop.setpoint.limits, loop.pv.range
    return loop.pv.square_root and limits is not None and abs(limits[1] - limits[0]) * 64 < abs(high - low)


# --- everything ------------------------------------------------------------------------------------------------------


def leaves(model, prefix: str = ""):
    """The paths of a model's given fields."""
    for key in sorted(model.model_fields_set):
        value = getattr(model, key)
        if hasattr(value, "model_fields_set"):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}"


def test_nothing_is_forgotten():
    config = dl06(EVERYTHING, {"mode": "auto", "output": {"range": [0, 50]}})
    said = {s.path for s in to_neutral(config)[0].fields}
    known = set(leaves(config.loops[0]))
    assert len(known) > 50
    spoken = {path for path in known for field in said if path == field or path.startswith(f"{field}.")}
    assert sorted(known - spoken - set(HARMLESS_FIELDS)) == []
    assert {path for path in HARMLESS_FIELDS if not path.startswith("plc.")} <= known
    assert {path for path in known if path.startswith(("tuning", "error.d", "alarms"))} - spoken <= set(HARMLESS_FIELDS)


def test_every_field_of_the_schema_is_in_that_test():
    def paths(model, prefix=""):
        for key, field in model.model_fields.items():
            inner = next(
                (
                    m
                    for m in (field.annotation, *getattr(field.annotation, "__args__", ()))
                    if hasattr(m, "model_fields")
                ),
                None,
            )
            if inner is None or key in {"transfer", "ramp_soak"}:
                yield f"{prefix}{key}"
            else:
                yield from paths(inner, f"{prefix}{key}.")

    given_here = set(leaves(dl06(EVERYTHING).loops[0]))
    missing = [p for p in paths(Loop) if not any(g == p or g.startswith(f"{p}.") for g in given_here)]
    assert missing == []


@pytest.mark.parametrize("name", ["reactor", "oven", "extruder", "flow"])
def test_examples_come_back_without_errors(name):
    config = Dl06File.model_validate(read_document((EXAMPLES / f"{name}.yaml").read_bytes(), name).data)
    assert error_codes(back_and_forth(config).data) == []


WITHOUT_TWIN = {"remote_setpoint", "ramp_soak.table", "state.pv", "state.bias", "state.output"}
SWITCHES = (
    "action",
    "bias_freeze",
    "pv.square_root",
    "derivative_gain_limit_enabled",
    "setpoint.limits_enabled",
    "error.deadband_enabled",
    "alarms.pv.enabled",
    "alarms.deviation.enabled",
    "alarms.rate_of_change_enabled",
)


@given(data=st.data())
@settings(max_examples=30, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
def test_what_is_not_reported_comes_back_the_same(data):
    """Word for word in the same data format; what the report does not call exact may differ."""
    form = data.draw(st.sampled_from(FORMAT_NAMES))
    config = tidy(data.draw(configurations(form)))
    try:
        made = back_and_forth(config, data_format=form, reset_decimals=config.plc.reset_decimals)
    except ConvertError as error:
        assume("correct" not in str(error) and "least one count" not in str(error))
        raise
    assume(len(made.source_loops) == len(config.loops))
    second = held(Dl06File.model_validate(made.data))
    for i, first in enumerate(held(config)):
        reported = {c.field for c in made.loops[i][1] if c.kind != "exact"}
        reported |= {"bias_freeze"} if "algorithm" in reported else set()
        reported |= {"error.deadband"} if "error.curve" in reported else set()  # of the square, or of the error
        if config.loops[i].alarms.hysteresis is None:
            reported.add("alarms.hysteresis")  # its word follows from the alarms that are left
        kept = {path for path in first if not any(same_part(path, field) for field in reported)}
        assert {"action", "sample_rate"} <= kept
        assert {path: first[path] for path in kept} == {path: second[i][path] for path in kept}


def same_part(path: str, field: str) -> bool:
    """Whether a word or bit belongs to a field of the report."""
    part = path.removesuffix("enabled").rstrip("._")
    return path.startswith(field) or (part != path and field.startswith(part))


def held(config: Dl06File) -> list[dict]:
    """The words and switches of each loop by path; times in s, what does nothing (filter 1.0, deadband 0) as none."""
    image, found = encode(config).image.words, []
    for i, loop in enumerate(config.loops):
        words = [image[config.plc.loop_table + i * 32 + n] for n in range(32)]
        values = {str(row.path): words[row.offset] for row in LOOP_TABLE.words if row.path}
        values |= {path: LOOP_TABLE.decode_bits(words)[path] for path in SWITCHES}
        values["error.deadband_enabled"] &= words[0o23] > 0
        values["pv.filter"] = 0 if words[0o24] >= 0x10 else words[0o24]
        values["tuning.reset"] = reset_value(loop) * (60 if loop.tuning.reset_unit == "minutes" else 1)
        found.append({path: value for path, value in values.items() if path not in WITHOUT_TWIN})
    return found


def tidy(config: Dl06File) -> Dl06File:
    """With limits and alarm points in order, as a PLC wants them."""
    loops = []
    for loop in config.loops:
        scales = scales_of(loop)

        def ordered(values, scale):
            return sorted(values, key=scale.position)

        update: dict = {}
        if loop.setpoint.limits:
            limits = tuple(ordered(loop.setpoint.limits, scales["sp"]))
            update["setpoint"] = loop.setpoint.model_copy(update={"limits": limits})
        if loop.output.limits:
            update["output"] = loop.output.model_copy(
                update={"limits": tuple(ordered(loop.output.limits, scales["output"]))}
            )
        pv = loop.alarms.pv
        points = [getattr(pv, key) for key in ("low_low", "low", "high", "high_high")] if pv else [None]
        if None not in points:
            keys = ("low_low", "low", "high", "high_high")
            pv = pv.model_copy(update=dict(zip(keys, ordered(points, scales["pv"]), strict=True)))
            update["alarms"] = loop.alarms.model_copy(update={"pv": pv})
        loops.append(loop.model_copy(update=update))
    return config.model_copy(update={"loops": tuple(loops)})


@pytest.mark.parametrize(("value", "held"), [("2", "1.5627"), ("30", "29.69"), ("0.7", "0"), ("11", "10.939")])
@pytest.mark.parametrize("target", ["dl06", "ezlogix"])
def test_a_set_point_on_a_root_is_told_as_its_word_means_it(target, value, held):
    """A 12-bit root has 64 counts: the line says what the register holds, never ``exact``."""
    source = f"""\
pidcfg: 1
vendor: generic
loops:
  - name: L3
    output_raises_pv: true
    sample_time: 1
    tuning: {{gain: 1, integral_time: 20}}
    pv: {{range: [0, 100], square_root: true}}
    setpoint: {{value: {value}, follows_pv: false}}
    output: {{range: [0, 100]}}
"""
    result = pidcfg.convert(source, target)
    row = next(r for r in result.loops[0].changes if r.field == "setpoint.value")
    assert (row.kind, str(row.target)) == ("rounded", held)
    assert row.loss == (abs(float(held) - float(value)) > 0.1 * float(value))


def test_a_band_of_few_counts_is_told_as_its_word_means_it():
    source = """\
pidcfg: 1
vendor: generic
loops:
  - {name: L, output_raises_pv: true, sample_time: 1, tuning: {gain: 1, integral_time: 20},
     pv: {range: [0, 200]}, setpoint: {value: 50}, output: {range: [0, 100]}, deadband: 0.7}
"""
    result = pidcfg.convert(source, "dl06")
    row = next(r for r in result.loops[0].changes if r.field == "deadband")
    assert (row.kind, str(row.target), row.loss) == ("rounded", "0.6838", False)
