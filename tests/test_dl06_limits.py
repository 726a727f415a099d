"""Rules of DL06 alarms and tuning at their limits, and the numbers in their messages."""

from __future__ import annotations

import json

import pytest

from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document

LOOP = {
    "name": "A",
    "sample_rate": 1,
    "action": "direct",
    "tuning": {"gain": 2, "reset": "10 s"},
    "pv": {"range": [0, 4095]},
}


def told(**changes):
    """The messages of a loop with other values, by their codes."""
    plc = {"loop_table": "V2000", "reset_decimals": changes.pop("decimals", 1)}
    data = {"pidcfg": 1, "vendor": "dl06", "plc": plc, "loops": [{**LOOP, **changes}]}
    return {d.code: d.message for d in check_document(read_document(json.dumps(data).encode(), "a.yaml")).findings}


def tuned(decimals=1, **tuning):
    return told(tuning={"gain": 2, "reset": "10 s", **tuning}, decimals=decimals)


def test_a_sample_rate_of_zero_has_no_rate_of_change():
    assert not {"DL246", "DL247", "DL507", "DL219"} & set(told(sample_rate=0, alarms={"rate_of_change": "5 /s"}))
    assert "DL219" not in told(sample_rate=0, tuning={"gain": 2, "reset": "10 s", "rate": 1})


def test_deviation_points_of_zero_are_told_once():
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 0, "red": 0}})) == {"DL244"}
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 0, "red": 1}})) == {"DL245"}
    assert {"DL244", "DL245"} & set(told(alarms={"deviation": {"yellow": 1, "red": 2}})) == set()


@pytest.mark.parametrize(
    ("tuning", "decimals", "said"),
    [
        ({"reset": "1000 s"}, 1, "reset is 1000 s; its word holds 0.1 s to 999.8 s; write `reset: 16.7 min`"),
        ({"reset": "1000 s"}, 2, "reset is 1000 s; its word holds 0.01 s to 99.98 s; write `reset: 16.67 min`"),
        ({"reset": "59988 s"}, 1, "write `reset: 999.8 min` and `reset_unit: minutes`"),
        ({"reset": "59994 s"}, 1, "its word holds 0.1 s to 999.8 s"),
        ({"reset": "0.01 min", "reset_unit": "minutes"}, 1, "holds 0.1 min to 999.8 min; write `reset: 0.6 s` and"),
        ({"reset": "0.0005 min", "reset_unit": "minutes"}, 1, "holds 0.1 min to 999.8 min"),
        ({"reset": "-5 s"}, 1, "a time is not negative"),
    ],
)
def test_a_reset_beyond_its_word_is_met_with_what_the_word_holds(tuning, decimals, said):
    found = tuned(decimals, **tuning)
    assert said in found["DL502"]
    assert ("write" in found["DL502"]) == ("write" in said)
    assert "DL216" not in found


def test_the_code_of_no_integral_is_met_with_the_largest_time():
    assert tuned(1, reset="999.9 s")["DL212"].endswith("the largest reset is 999.8 s")
    assert tuned(2, reset="99.99 s")["DL212"].endswith("the largest reset is 99.98 s")
    assert "DL212" not in tuned(1, reset="999.8 s")


def test_a_reset_of_zero_is_a_code_and_no_fast_integral():
    assert {"DL216", "DL502", "DL503"} & set(tuned(reset="0 s")) == {"DL503"}
    assert {"DL216", "DL502", "DL503"} & set(tuned(reset="0.9 s")) == {"DL216"}


@pytest.mark.parametrize(("gain", "counts"), [(2, 50), (0, 25), (0.5, 12)])
def test_what_a_count_of_noise_does_is_said_with_the_gain(gain, counts):
    assert f"moves the output by {counts} counts" in tuned(gain=gain, rate=25)["DL219"]


@pytest.mark.parametrize(
    ("slope", "said"),
    [(0.0152, "stored as 0.02: the ramp takes 24.0 % less"), (0.014, "as 0.01: the ramp takes 40.0 % longer")],
)
def test_a_rounded_slope_makes_the_ramp_shorter_or_longer(slope, said):
    steps = [{"ramp_to": 100, "slope": slope, "soak": 1}]

    assert said in told(ramp_soak={"table": "V3000", "steps": steps})["DL285"]


def test_an_upper_output_limit_of_zero_is_told_once():
    limits = {low: told(output={"limits": [f"{low} counts", "0 counts"]}) for low in (0, 5)}

    assert [{"DL224", "DL226"} & set(found) for found in limits.values()] == [{"DL226"}, {"DL224"}]


def test_the_last_step_of_a_profile_is_looked_at():
    steps = [*[{"ramp_to": 100, "slope": 1, "soak": 1}] * 7, {"ramp_to": 100, "slope": 0.0152, "soak": 1}]

    assert "DL285" in told(ramp_soak={"table": "V3000", "steps": steps})


@pytest.mark.parametrize(("count", "words"), [(8, "V7340-V7737"), (9, "words from V7340")])
def test_a_loop_table_with_more_loops_than_there_are_is_told_by_its_beginning(count, words):
    plc = {"loop_table": "V7340", "reset_decimals": 1, "number_of_loops": count}
    text = json.dumps({"pidcfg": 1, "vendor": "dl06", "plc": plc, "loops": [LOOP]})

    found = {d.code: d.message for d in check_document(read_document(text.encode(), "a.yaml")).findings}
    assert found["DL204"] == f"the loop table of {count} loops occupies {words}, past the boundary at V7577"


def test_a_key_of_another_place_is_told_its_place():
    text = json.dumps(
        {"pidcfg": 1, "vendor": "dl06", "plc": {"reset_decimals": 1}, "loops": [{**LOOP, "loop_table": "V2000"}]}
    )
    (found,) = (d for d in check_document(read_document(text.encode(), "a.yaml")).findings if d.code == "PID020")

    assert "it belongs below plc" in f"{found.message} {found.help}"
