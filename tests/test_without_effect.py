"""Why something that an event writes has no effect, or soon none any more: each reason, and what is next to it."""

from __future__ import annotations

import pytest

from generic_rig import Rig as GenericRig
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click.equation import BIAS_ERROR, row_of
from pidcfg.sim.controllers.dl06 import equation as dl06
from pidcfg.sim.controllers.dl06.plc import overruled

OUTPUT, BIAS, SETPOINT = "state.output", "state.bias", "setpoint.value"
OVERWRITTEN = "the next calculation overwrites +05, only in Manual it stays"
NO_BIAS = "the velocity form has no bias: +04 does nothing"
IN_CASCADE = "in Cascade the set point is the output of the major loop, +02 waits"
PROFILE = "a ramp/soak profile runs: its next ramp overwrites +02"


@pytest.mark.parametrize(
    ("path", "config", "state", "reason"),
    [
        (OUTPUT, {}, {"status": dl06.MANUAL}, None),
        (OUTPUT, {}, {"status": dl06.AUTO}, OVERWRITTEN),
        (OUTPUT, {}, {"status": dl06.CASCADE}, OVERWRITTEN),
        (OUTPUT, {"halt": 1}, {"status": dl06.AUTO}, None),
        (OUTPUT, {}, {"status": dl06.AUTO, "busy": dl06.STOPPED}, None),
        (OUTPUT, {}, {"status": dl06.AUTO, "busy": dl06.PROGRAM}, OVERWRITTEN),
        (BIAS, {}, {"status": dl06.AUTO}, None),
        (BIAS, {"velocity": 1}, {"status": dl06.AUTO}, NO_BIAS),
        (BIAS, {"velocity": 1}, {"status": dl06.MANUAL}, NO_BIAS),
        (SETPOINT, {"major": 0}, {"status": dl06.CASCADE}, IN_CASCADE),
        (SETPOINT, {"major": -1}, {"status": dl06.CASCADE}, None),
        (SETPOINT, {"major": 0}, {"status": dl06.AUTO}, None),
        (SETPOINT, {}, {"status": dl06.AUTO, "rs_step": 1}, PROFILE),
        (SETPOINT, {}, {"status": dl06.AUTO, "rs_step": 2, "aux_status": dl06.RS_HELD}, None),
        (SETPOINT, {"velocity": 1}, {"status": dl06.AUTO}, None),
        ("tuning.gain", {"velocity": 1, "major": 0}, {"status": dl06.CASCADE, "rs_step": 1}, None),
    ],
)
def test_a_word_of_a_dl06_is_overruled(path, config, state, reason):
    assert overruled(dl06.Config(**config), dl06.State(**state), path) == reason


@pytest.mark.parametrize(
    ("loop", "key", "value", "reason"),
    [
        (
            {},
            "output.manual",
            20,
            "output.manual acts in manual only, which keeps the output when it begins",
        ),
        ({"mode": "manual"}, "output.manual", 20, None),
        ({}, "setpoint.value", 20, None),
        ({}, "tuning.gain", 2, None),
    ],
)
def test_a_field_of_a_neutral_loop_acts_or_says_why_not(loop, key, value, reason):
    assert GenericRig(loop).set(key, value) == reason


def test_the_set_point_of_a_neutral_slave_is_its_masters_output():
    slave = {"mode": "cascade", "setpoint": {"value": 0, "source": "L1"}}
    rig = GenericRig({}, slave)
    assert rig.set("setpoint.value", 20, 1) == "in cascade the set point is the master's output"
    assert rig.set("setpoint.value", 20, 0) is None


def test_a_pid_error_of_a_click_is_held_by_its_row():
    assert [row_of(error.number) for error in ERRORS] == list(range(1, len(ERRORS) + 1))
    assert (ERRORS[BIAS_ERROR - 1].number, ERRORS[BIAS_ERROR - 1].register) == (25, "bias")
