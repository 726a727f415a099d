"""What a conversion takes along and leaves behind, at the limits of its conditions."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import pytest

from pidcfg.api import convert
from pidcfg.conversion.ledger import DEFAULT_MAX_LOSS, MaxLossError, parse_max_loss
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples"

DL06 = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000, reset_decimals: 1}
loops:
  # of A
  - name: A
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: 10, rate: 5}
    derivative_gain_limit: 0
    derivative_gain_limit_enabled: true
    pv: {range: [0, 100]}
  # of B
  - name: B
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: off, rate: 5}
    state: {output: 1000}
    derivative_gain_limit_enabled: true
    pv: {range: [0, 100]}
  # of C
  - name: C
    sample_rate: 1
    action: direct
    tuning: {gain: 1, reset: 10}
    pv: {range: [0, 100]}
"""
DPIDE = """\
pidcfg: 1
vendor: dpide
loops:
  - {name: A, device: D500, SV: 80, CYCLE: 1000, Kc_Kp: 12, Ti_Ki: 180, Td_Kd: 0, PID_EQ: true, PID_DIR: true,
     MV_MAX: 4000, MV_MIN: 0, pv: {range: [0, 100]}}
"""
PLAIN = "output_raises_pv: true, sample_time: 1, tuning: {gain: 1}"
CASCADE = """\
pidcfg: 1
vendor: generic
loops:
  - {name: M, mode: auto, PLAIN, pv: {range: [0, 100]}, output: {range: [0, 50], unit: kg}}
  - {name: S, mode: cascade, PLAIN, pv: {range: [0, 50]UNIT}, output: {range: [0, 100]}, setpoint: {source: M}}
""".replace("PLAIN", PLAIN)


@pytest.fixture(scope="module")
def result():
    return convert(DL06, "generic", name="a.yaml")


def changes(result, loop):
    """The lines of a loop by the field they begin with."""
    return {change.field: change for change in result.loops[loop].changes}


def test_a_comment_stays_with_its_loop(result):
    lines = result.text.splitlines()
    for name in "ABC":
        assert lines[lines.index(f"  - name: {name}") - 1] == f"  # of {name}"
    assert result.text.count("# of") == 3


def test_a_comment_behind_a_value_keeps_its_value_and_the_starters_own_stay_behind():
    tank = (EXAMPLES / "click" / "tank.yaml").read_text("utf-8")
    lines = convert(tank, "ezlogix", name="a.yaml").text.splitlines()
    assert "    action: reverse" in lines  # of the controller; the comment is of the process's
    assert "  # action: direct  # more heat, warmer water" in lines
    starter = resources.files("pidcfg").joinpath(VENDORS["click"].starter).read_text("utf-8")
    assert "#" not in convert(starter, "ezlogix", name="a.yaml").text


def test_a_derivative_that_a_limit_of_nothing_switches_off_is_left_by_the_key_that_does_it(result):
    given, missing = changes(result, 0), changes(result, 1)
    assert given["derivative_gain_limit"].source == 0
    assert missing["derivative_gain_limit_enabled"].source is True
    assert {given["tuning.rate"].kind, missing["tuning.rate"].kind} == {"dropped"}


def test_the_output_at_the_start_of_a_loop_without_an_integral_is_its_bias_as_it_was_written(result):
    change = changes(result, 1)["state.output"]
    assert change.source == "1000 counts"
    assert "output: {range: [0, 100], bias: 24.42002442, manual: 24.42002442}" in result.text


def test_an_instruction_that_holds_its_integral_at_its_limits_is_one_with_anti_windup():
    assert "anti_windup: true" in convert(DPIDE, "generic", name="a.yaml").text


@pytest.mark.parametrize(("unit", "linked"), [(", unit: kg", True), ("", True), (", unit: l", False)])
def test_loops_are_linked_where_their_units_do_not_differ(unit, linked):
    text = convert(CASCADE.replace("UNIT", unit), "dl06", name="a.yaml").text
    assert ("cascade_from: M" in text) is linked


def test_a_loss_may_be_limited_to_none():
    assert parse_max_loss("gain=0%").gain == 0
    assert parse_max_loss("time=5").time == 5
    assert parse_max_loss("time=5").gain == DEFAULT_MAX_LOSS.gain
    for text in ("gain=-1%", "gain=inf", "gain=nan", "gain=x", "other=1%"):
        with pytest.raises(MaxLossError):
            parse_max_loss(text)
