"""The neutral form converted to itself and to others: nothing of it is lost on the way in."""

from __future__ import annotations

import pytest
from hypothesis import given, settings

from generic_rig import configurations, file_of
from pidcfg import api
from pidcfg.conversion.generic import NOTHING_LOST, RANGE_FIELDS, from_neutral, to_neutral
from pidcfg.conversion.pipeline import convert, neutral_loops
from pidcfg.encoders.generic import CONVERT_OPTIONS
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.vendors import VENDORS
from standing_rig import SIDES
from test_generic_encoding import leaves

GENERIC = VENDORS["generic"]
FULL = {
    "description": "x",
    "mode": "cascade",
    "tuning": {
        "gain": 2,
        "integral_time": 60,
        "derivative_time": 5,
        "proportional": False,
        "derivative_on": "error",
        "derivative_filter": 1,
    },
    "pv": {"range": [0, 40], "unit": "bar", "filter": 1, "square_root": True},
    "setpoint": {"value": 20, "limits": [1, 30], "source": "L1", "follows_pv": True},
    "output": {
        "range": [0, 100],
        "unit": "%",
        "limits": [5, 95],
        "bias": 10,
        "manual": 20,
        "max_rate": 3,
        "pulse": {"period": 10, "min_on": 1, "min_off": 1},
    },
    "deadband": 0.5,
    "anti_windup": False,
    "alarms": {
        "pv": {"low_low": 1, "low": 2, "high": 30, "high_high": 35},
        "deviation": {"high": 3, "high_high": 4},
        "rate_of_change": 2,
        "hysteresis": 0.1,
    },
}


def test_every_field_that_is_given_says_where_it_goes():
    (loop,) = to_neutral(file_of(FULL))
    pairs = {f"{path}.{i}" for path in RANGE_FIELDS for i in range(2)}

    assert sorted(entry.path for entry in loop.fields) == sorted(
        {*leaves(Loop), *RANGE_FIELDS} - pairs - {*NOTHING_LOST}
    )
    assert all(entry.to == (entry.path,) for entry in loop.fields)
    assert not loop.missing


@settings(max_examples=40)
@given(configurations())
def test_it_is_converted_to_itself(config):
    assert neutral_loops(config, GENERIC)[0] == config
    assert GenericFile.model_validate(from_neutral(config, {}).data) == config


def test_a_conversion_to_itself_is_exact_and_complete():
    config = file_of({}, FULL)

    result = convert(config, GENERIC, GENERIC, {})

    assert not result.losses
    assert {change.kind for loop in result.loops for change in loop.changes} == {"exact"}
    assert GenericFile.model_validate(result.data) == config
    assert CONVERT_OPTIONS == ()


def test_what_a_vendor_does_not_have_is_dropped():
    result = convert(file_of({"output": {"range": [0, 100], "max_rate": 3}}), GENERIC, VENDORS["dpide"], {})

    assert [change.field for loop in result.loops for change in loop.changes if change.loss] == ["output.max_rate"]


@pytest.mark.parametrize(("vendor", "edit"), [("dl06", ("bumpless: II", "bumpless: I")), ("click", ("ss: 2", "ss: 1"))])
def test_a_set_point_that_follows_the_pv_does_so_in_the_neutral_form_too(vendor, edit):
    result = api.convert(SIDES[vendor].config.replace(*edit), "generic", verify=True)
    assert result.data["loops"][0]["setpoint"]["follows_pv"] is True
    (found,) = result.verified
    assert found.stages
    assert found.passed, found.failures
