"""PID errors of the virtual CLICK, alarms by the letter of their rule, and registers that hold no number."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from click_rig import Rig, image_of, poked
from pidcfg.encoders.image import Image
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click.equation import ALARMS
from pidcfg.sim.controllers.click.scan import ALARM_BITS, FLAG_BITS, Click
from pidcfg.sim.controllers.kernels import add_notice
from rig_plants import Fixed


def at(measured=50.0, **loop):
    """A loop at a set point of 60 with a PV of its own."""
    return Rig({"setpoint": {"value": 60}, **loop}, plants=[Fixed(measured)])


# --- requests --------------------------------------------------------------------------------------------------------


def test_a_set_point_that_is_not_meant_stays_the_pv():
    rig = Rig({"mode": "auto", "bumpless": 1}, plants=[Fixed(50.0)], goals=True)

    assert rig.step(5).states[0].sp == 50.0


# --- PID errors ------------------------------------------------------------------------------------------------------

WRONG = {
    # number: register, an allowed value, wrong ones (raw for integers, numbers for floats)
    10: ("sample_rate", 100, (99, 30001, 0, -1)),
    11: ("derivative_gain_limit", 100, (101, -1)),
    12: ("pwm_period", 600, (0, 601)),
    13: ("filter", 1, (0, 101)),
    20: ("setpoint", -1e30, (math.nan, math.inf)),
    21: ("setpoint_lower", 1e30, (math.nan, -math.inf)),
    22: ("setpoint_upper", -3.0, (math.nan,)),
    24: ("deadband", 0.0, (-0.01, math.nan)),
    25: ("bias", 500.0, (math.nan, math.inf)),
    26: ("proportional_gain", 0.01, (0.0099, 10000.01, math.nan, -1.0)),
    27: ("reset_time", 6000.0, (0.005, 0.0, 6001.0, math.nan)),
    28: ("derivative_gain", 6000.0, (-0.1, 6000.1, math.nan)),
    30: ("output_lower", 0.0, (-0.1, math.nan)),
    200: ("autotune_hysteresis", 10.0, (0.0, 0.99, 10.01, math.nan)),
}


def test_every_error_of_the_table_is_tried():
    assert sorted({*WRONG, 23}) == [error.number for error in ERRORS]


@pytest.mark.parametrize(
    ("number", "register", "value"), [(n, name, v) for n, (name, _, wrong) in WRONG.items() for v in wrong]
)
def test_a_wrong_register_is_its_error_and_keeps_the_loop_in_manual(number, register, value):
    image = poked(image_of({"mode": "auto", "setpoint": {"value": 60}}), **{register: value})
    rig = Rig(image=image, plants=[Fixed(50.0)], goals=True)
    rig.step(30)

    assert rig.plc.error_words == {"DS1": number}
    assert rig.mode() == "manual"
    assert [text.split(":")[0] for _, text in rig.log] == [f"PID error {number}", "refused"]
    assert f"PID error {number}: " in rig.log[1][1]
    assert all(math.isfinite(x) for x in rig.signal_values)


@pytest.mark.parametrize(("register", "value"), [(name, v) for name, v, _ in WRONG.values()])
def test_the_ends_of_what_a_register_may_hold_are_no_error(register, value):
    rig = Rig(image=poked(image_of({"mode": "auto"}), **{register: value}), goals=True)
    rig.step(5)

    assert rig.plc.error_words == {"DS1": 0}
    assert rig.log == []
    assert rig.mode() == "auto"


@pytest.mark.parametrize(
    ("upper", "low_on", "high_on", "number"),
    [
        (40.0, 1, 1, 23),
        (40.0, 1, 0, 0),
        (40.0, 0, 1, 0),
        (40.0, 0, 0, 0),
        (50.0, 1, 1, 0),
    ],
)
def test_crossed_set_point_limits_are_an_error_when_both_count(upper, low_on, high_on, number):
    image = poked(
        image_of({}),
        setpoint_lower=50.0,
        setpoint_upper=upper,
        setpoint_lower_enable=low_on,
        setpoint_upper_enable=high_on,
    )

    assert Rig(image=image).plc.error_words == {"DS1": number}


def test_an_unwritten_plc_shows_its_lowest_error_and_runs_as_far_as_it_can():
    """All registers 0, as after a download: the first error is the sample rate's; the measurement goes on."""
    blank = Image("click", (), image_of({}).settings)
    rig = Rig(image=blank, plants=[Fixed(7.5)])
    rig.auto().step(3)

    assert rig.plc.error_words == {"DS1": 10}
    assert (rig.mode(), rig.signal_values[rig.configs[0].pv_slot]) == ("manual", 7.5)
    assert rig.plc.periods == [100_000]


def test_errors_come_and_go_and_the_lowest_shows():
    rig = at().auto().step(3)
    out = rig.out()
    seen = []
    for key, value in (
        ("tuning.reset_time", 0.005),
        ("tuning.derivative_gain", 7000),
        ("sample_rate", "50 ms"),
        ("sample_rate", "100 ms"),
        ("tuning.reset_time", 10),
        ("tuning.derivative_gain", 1),
    ):
        rig.set(key, value)
        rig.step()
        seen.append((rig.plc.error_words["DS1"], rig.mode(), rig.out()))

    assert [number for number, _, _ in seen] == [27, 27, 10, 27, 28, 0]
    assert {(mode, value) for _, mode, value in seen} == {("manual", out)}
    assert [text.partition(":")[0] for _, text in rig.log] == [
        "to Manual",
        "PID error 10",
        "PID error 27",
        "PID error 28",
        "no PID error any more",
    ]
    assert "reset time (DFn+06) is not within 0.01 to 6000 s" in rig.log[0][1]
    assert rig.states[0].status & FLAG_BITS["pid_error"] == 0
    assert rig.auto().step().mode() == "auto"


def test_a_bias_that_is_no_number_comes_from_an_output_that_is_none():
    """No error stands for the output, but the transfer makes it the bias."""
    rig = Rig(image=poked(image_of({}), output=math.nan))
    assert rig.plc.error_words == {"DS1": 0}
    rig.auto().step(2)

    assert rig.plc.error_words == {"DS1": 25}
    assert rig.mode() == "manual"
    assert rig.log == [("L1", "to Manual: PID error 25: bias is not a number (DFn+04)")]
    rig.set("output", 10)
    rig.set("bias", 0)
    assert rig.auto().step(2).mode() == "auto"


def test_a_notice_knows_what_was_requested():
    number = add_notice(add_notice(0, 2, 100 + 12), 0, 4)

    assert Click.requested_mode(number) == "auto"
    assert Click.describe(number) == (
        "refused: PID error 27: reset time (DFn+06) is not within 0.01 to 6000 s",
        "no PID error any more",
    )
    assert Click.requested_mode(4) is None
    assert Click.describe(0) == ("", "")


# --- alarms ----------------------------------------------------------------------------------------------------------


def names(status):
    return [name for name, bit in ALARM_BITS.items() if status & bit]


PV_LIMITS = {"low_low": 10, "low": 20, "high": 80, "high_high": 90}


def test_the_manuals_rate_of_15_a_minute_is_half_a_unit_in_2_s():
    rig = at(sample_rate="2 s", alarms={"rate_of_change": "15 /min"})

    assert rig.configs[0].rate_of_change == 0.5


def test_a_group_that_is_switched_off_loses_alarms_whatever_the_hysteresis_holds():
    image = poked(image_of({"alarms": {"pv": PV_LIMITS}}), hysteresis=math.nan)
    rig = Rig(image=image, plants=[Fixed(95.0)])
    rig.step()
    assert names(rig.states[0].status) == ["pv_high", "pv_high_high"]
    rig.set("alarms.pv.enabled", value=False)

    assert names(rig.step().states[0].status) == []


def expected(pvs, limits, hysteresis):
    """The rule by the letter, in whole numbers, which single precision holds exactly."""
    status = 0
    for pv in pvs:
        excesses = (
            limits[0] - pv,
            limits[1] - pv,
            pv - limits[2],
            pv - limits[3],
            abs(pv - 60) - limits[4],
            abs(pv - 60) - limits[5],
        )
        for bit, excess in zip(ALARM_BITS.values(), excesses, strict=False):
            if excess > 0:
                status |= bit
            elif excess <= -hysteresis:
                status &= ~bit
    return status


@given(
    st.lists(st.integers(0, 120), min_size=2, max_size=20),
    st.tuples(*[st.integers(0, 60)] * 2, *[st.integers(60, 120)] * 2, *[st.integers(0, 60)] * 2),
    st.integers(0, 20),
)
@settings(max_examples=60, deadline=None)
def test_alarms_follow_the_rule_by_the_letter(pvs, limits, hysteresis):
    keys = ("low_low", "low", "high", "high_high")
    alarms = {
        "pv": dict(zip(keys, limits, strict=False)),
        "hysteresis": hysteresis,
        "deviation": {"high": limits[4], "high_high": limits[5]},
    }
    rig = at(alarms=alarms)
    for rig.plants[0].value in pvs:
        rig.step()

    assert rig.states[0].status & ALARMS == expected(pvs, limits, hysteresis)


NUMBERS = st.floats(-200, 200, width=32) | st.integers(-20, 20).map(float)
KEYS = ("pv_low_low", "pv_low", "pv_high", "pv_high_high", "deviation_high", "deviation_high_high", "rate_of_change")


@given(
    st.lists(NUMBERS, min_size=3, max_size=25),
    st.lists(NUMBERS | st.just(math.nan), min_size=7, max_size=7),
    st.floats(0, 20, width=32),
    st.lists(NUMBERS, min_size=1, max_size=3),
)
@settings(max_examples=150, deadline=None)
def test_the_quiet_band_never_hides_an_alarm(pvs, limits, hysteresis, setpoints):
    """The step looks at limits only when the PV leaves a band; the outcome is that of always looking."""
    on = {"enabled": True}
    image = image_of({"alarms": {"pv": on, "deviation": on, "rate_of_change_enabled": True}})
    image = poked(image, **dict(zip(KEYS, limits, strict=True)), hysteresis=hysteresis)
    short, full = Rig(image=image), Rig(image=image)
    for n, pv in enumerate(pvs):
        for rig in (short, full):
            rig.plants[0].value = pv
            rig.states[0].sp = setpoints[n % len(setpoints)]
        full.states[0].alarm_band_low = math.inf
        short.step()
        full.step()
        assert short.states[0].status == full.states[0].status
        assert short.signal_values == full.signal_values


def test_limits_that_are_no_numbers_make_no_alarm():
    image = poked(
        image_of({"alarms": {"pv": PV_LIMITS, "rate_of_change": 5}}),
        pv_high=math.nan,
        rate_of_change=math.nan,
        hysteresis=math.nan,
    )
    rig = Rig(image=image, plants=[Fixed(50.0)])
    rig.step(2)
    rig.plants[0].value = 95.0
    rig.step(2)

    assert names(rig.states[0].status) == ["pv_high_high"]
