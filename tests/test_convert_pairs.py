"""Every ordered pair of vendors: the action, the gains and the answer of a loop survive, there and back again."""

from __future__ import annotations

from decimal import Decimal
from itertools import permutations

import pytest
from hypothesis import HealthCheck, given, settings

from neutral_strategies import neutral_files
from pidcfg.api import check_text
from pidcfg.conversion.ledger import ConvertError
from pidcfg.conversion.pipeline import convert, neutral_loops
from pidcfg.encoders.codecs import EncodeError
from pidcfg.schemas.generic import GenericFile
from pidcfg.study.verification.verify import verify
from pidcfg.text.writer import yaml_text
from pidcfg.vendors import VENDORS

PLCS = [key for key in VENDORS if key != "generic"]
PAIRS = list(permutations(PLCS, 2))
OVEN = {
    "name": "TIC1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 2.5, "integral_time": 60, "derivative_time": 0},
    "pv": {"range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180},
    "output": {"range": [0, 100], "unit": "%"},
}


def checked(data):
    """A configuration as anybody would check it, without an error."""
    found = check_text(yaml_text(data))
    assert not found.failed, [(d.code, d.message) for d in found.findings]
    return found


def of_vendor(loops, vendor):
    """Neutral loops as a vendor's configuration."""
    from pidcfg.conversion.settle import settle_values

    file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": loops})
    made = VENDORS[vendor].load("from_neutral")(file, {})
    settle_values(made, VENDORS[vendor])
    return checked(made.data)


def apart(source, target):
    """The verdicts on two checked configurations with the same loops."""
    pairs = [(i, i) for i in range(len(source.config.loops))]
    return verify((source.vendor, source.config), (target.vendor, target.config), pairs)


def converted(source, target):
    """A checked configuration for another vendor."""
    return checked(convert(source.config, source.vendor, VENDORS[target], {}).data)


@pytest.mark.parametrize("heats", [True, False], ids=["heating", "cooling"])
@pytest.mark.parametrize(("one", "two"), PAIRS)
def test_both_sides_hold_the_same_plant_alike(one, two, heats):
    """Where cooling, the sign is held of every pair, and the plant of each vendor as source and as target once."""
    source = of_vendor([{**OVEN, "output_raises_pv": heats}], one)
    target = converted(source, two)
    if heats or two == PLCS[PLCS.index(one) - 1]:
        found = apart(source, target)[0]
        assert found.pv_percent < 0.5
        assert found.iae_ratio == pytest.approx(1, abs=0.05)
    loop = neutral_loops(target.config, target.vendor)[0].loops[0]
    assert loop.output_raises_pv is heats
    assert float(loop.tuning.gain) == pytest.approx(2.5, rel=0.005)


def test_a_wrong_sign_would_be_seen():
    source = of_vendor([OVEN], "click")
    data = convert(source.config, source.vendor, VENDORS["nextopid"], {}).data
    data["loops"][0]["Direct"] = True
    target = checked(data)
    found = apart(source, target)[0]
    assert not found.passed
    assert found.pv_percent > 10


def close(a, b, error):
    """Whether two numbers differ by no more than the reported error, in %."""
    a, b = (Decimal(0) if x is None else Decimal(str(x)) for x in (a, b))
    return abs(a - b) <= max(abs(a), abs(b)) * Decimal(str(error / 100 + 2e-6))


def actions_of(loop):
    """P, I and D in shares of both ranges: CLICK knows its output in % only, and without P no gain stands alone."""
    low, high = loop.output.range
    tuning = loop.tuning
    share = tuning.gain * (loop.pv.range[1] - loop.pv.range[0]) / (high - low)
    integral = share / tuning.integral_time if tuning.integral_time else Decimal(0)
    return {"P": share if tuning.proportional else Decimal(0), "I": integral, "D": share * tuning.derivative_time}


@pytest.mark.parametrize(("one", "two"), PAIRS)
@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck))
@given(file=neutral_files())
def test_there_and_back_gives_the_same_loop_up_to_the_reported_rounding(one, two, file):
    try:
        source = of_vendor([loop.model_dump(mode="python", exclude_none=True) for loop in file.loops], one)
        there = convert(source.config, source.vendor, VENDORS[two], {})
        back = convert(checked(there.data).config, VENDORS[two], VENDORS[one], {})
    except (ConvertError, AssertionError, EncodeError):
        return  # one of the two cannot hold the loop, and says so
    if len(there.source_places) < len(there.loops) or len(back.source_places) < len(back.loops):
        return  # a loop cannot go, and its report says why
    before, _ = neutral_loops(source.config, source.vendor)
    after, _ = neutral_loops(checked(back.data).config, source.vendor)
    for i, (a, b) in enumerate(zip(before.loops, after.loops, strict=True)):
        rows = [*there.loops[i][1], *back.loops[i][1]]
        error = sum(change.error_percent for change in rows)
        lost = any(change.kind in {"dropped", "clamped"} for change in rows)
        assert a.output_raises_pv is b.output_raises_pv
        if not lost:
            was, now = actions_of(a), actions_of(b)
            assert all(close(was[key], now[key], error) for key in was), (was, now, rows)
            assert close(a.sample_time, b.sample_time, error)
            if a.setpoint.value is not None:  # else one is chosen, and reported
                assert close(a.setpoint.value, b.setpoint.value, error)


def test_a_kick_of_the_derivative_does_not_go_into_the_integral_of_a_dpide():
    kicking = {**OVEN, "tuning": {**OVEN["tuning"], "derivative_time": 10, "derivative_on": "error"}}
    source = of_vendor([kicking], "ezlogix")
    target = converted(source, "dpide")
    assert target.config.loops[0].PID_MODE == 0
    assert apart(source, target)[0].pv_percent < 0.1


@pytest.mark.parametrize("target", ["generic", "nextopid"])
def test_the_output_of_an_outer_loop_is_in_the_units_of_the_inner_pv(target):
    text = """
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: OUTER, mode: auto, sample_rate: 1, action: direct, tuning: {gain: 2.0, reset: 60}, setpoint: {value: 50},
     pv: {range: [0, 200]}, output: {range: [0, 100], limits: [10, 90]}}
  - {name: INNER, mode: cascade, cascade_from: OUTER, sample_rate: 1, action: direct, tuning: {gain: 1.0, reset: 9},
     setpoint: {value: 10}, pv: {range: [0, 50]}}
"""
    source = check_text(text)
    loop = neutral_loops(source.config, source.vendor)[0].loops[0]
    assert [float(end) for end in loop.output.range] == [0, 50]
    assert [float(end) for end in loop.output.limits] == [5, 45]
    assert float(loop.tuning.gain) == 0.5  # 2.0 of the spans: 2.0 * 50 / 200
    result = converted(source, target)
    assert max(found.pv_percent for found in apart(source, result)) < 0.1
