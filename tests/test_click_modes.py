"""Modes of the virtual CLICK: requests, bumpless transfers, PID errors, set-point limits, STOP and RUN, alarms."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from click_rig import Rig, image_of, poked
from pidcfg.encoders.image import Image
from pidcfg.encoders.maps.click import ERRORS
from pidcfg.sim.controllers.click.equation import ALARMS
from pidcfg.sim.controllers.click.operate import ALARM_BITS, FLAG_BITS
from pidcfg.sim.controllers.click.plc import Click
from pidcfg.sim.controllers.kernels import GOAL_ENDS, noticed
from rig_plants import Fixed


def at(measured=50.0, **loop):
    """A loop at a set point of 60 with a PV of its own."""
    return Rig({"setpoint": {"value": 60}, **loop}, plants=[Fixed(measured)])


# --- requests --------------------------------------------------------------------------------------------------------


def test_a_loop_begins_in_manual_with_the_output_of_its_register():
    rig = Rig({"state": {"output": 12.5}, "setpoint": {"value": 60}})
    rig.step(3)

    assert (rig.mode(), rig.out()) == ("manual", 12.5)


def test_auto_is_entered_with_the_next_sample_and_manual_holds_the_output():
    rig = at()
    rig.step()
    rig.auto()
    assert rig.mode() == "manual"
    rig.step(3)
    assert rig.mode() == "auto"
    out = rig.out()
    assert out == pytest.approx(10.0, abs=0.01)
    rig.plc.request(0, "manual")
    rig.plants[0].value = 0.0
    rig.step(3)

    assert (rig.mode(), rig.out()) == ("manual", out)
    assert rig.log == []


def test_bumpless_one_makes_the_set_point_the_pv():
    rig = at(measured=42.0, bumpless=1)
    rig.set("output", 33)
    rig.auto().step(3)

    assert (rig.st[0].sp, rig.out(), rig.st[0].bias) == (42.0, 33.0, 33.0)


def test_bumpless_two_keeps_the_set_point():
    rig = at(measured=42.0, bumpless=2)
    rig.set("output", 33)
    rig.auto().step()

    assert rig.st[0].sp == 60.0
    assert rig.out() == pytest.approx(51.0, abs=0.01)


def test_a_transfer_has_no_past():
    """With a derivative, what happened to the error in Manual must not kick."""
    rig = at(tuning={"derivative_gain": 10})
    rig.auto().step(3)
    rig.plc.request(0, "manual")
    rig.step()
    rig.set("output", 20)
    rig.plants[0].value = 58.0
    rig.auto().step()

    assert rig.out() == pytest.approx(22.0, abs=0.01)


def test_the_configured_mode_is_requested_and_its_set_point_written_a_sample_later():
    loop = {"mode": "auto", "bumpless": 1, "setpoint": {"value": 60}}
    rig = Rig(loop, plants=[Fixed(50.0)], goals=True)
    seen = [(rig.step().mode(), rig.st[0].sp) for _ in range(3)]

    assert seen == [("auto", 50.0), ("auto", 60.0), ("auto", 60.0)]


def test_a_set_point_that_is_not_meant_stays_the_pv():
    rig = Rig({"mode": "auto", "bumpless": 1}, plants=[Fixed(50.0)], goals=True)

    assert rig.step(5).st[0].sp == 50.0


def test_a_request_takes_the_place_of_the_goal():
    rig = Rig({"mode": "auto", "setpoint": {"value": 60}}, goals=True)
    rig.plc.request(0, "manual")

    assert rig.step(5).mode() == "manual"
    assert (rig.log, rig.plc.tuned(0)) == ([("L1", GOAL_ENDS)], None)


def test_a_set_point_set_before_the_goal_is_reached_is_the_one_that_is_written():
    rig = Rig({"mode": "auto", "bumpless": 1, "setpoint": {"value": 60}}, plants=[Fixed(50.0)], goals=True)
    rig.set("setpoint", 70)

    assert rig.step(3).st[0].sp == 70.0


def test_output_is_read_only_in_auto():
    rig = at().auto().step(2)
    before = rig.out()

    assert "read-only" in rig.set("output", 77)
    assert rig.step().out() == pytest.approx(before, abs=0.01)
    rig.plc.request(0, "manual")
    rig.step()
    assert rig.set("output", 77) is None
    assert rig.out() == 77.0


# --- set-point limits ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["manual", "auto"])
@pytest.mark.parametrize(
    ("written", "becomes"), [(10, 30.0), (30, 30.0), (55.5, 55.5), (70, 70.0), (70.5, 70.0), (99, 70.0)]
)
def test_an_enabled_limit_overwrites_the_set_point(mode, written, becomes):
    rig = at(setpoint={"value": 60, "lower_limit": 30, "upper_limit": 70})
    if mode == "auto":
        rig.auto().step()
    rig.set("setpoint", written)
    rig.step()

    assert (rig.st[0].sp, rig.sig[rig.cfg[0].sig_sp]) == (becomes, becomes)
    rig.set("setpoint.lower_limit_enabled", value=False)
    rig.set("setpoint.upper_limit_enabled", value=False)
    assert rig.step().st[0].sp == becomes, "the register itself was changed"


def test_limits_are_enabled_one_by_one():
    rig = at(setpoint={"value": 60, "lower_limit": 30})
    rig.set("setpoint", 5000)
    assert rig.step().st[0].sp == 5000.0
    rig.set("setpoint", -5000)
    assert rig.step().st[0].sp == 30.0
    rig = at(setpoint={"value": 60, "upper_limit": 70})
    rig.set("setpoint", -5000)
    assert rig.step().st[0].sp == -5000.0


def test_a_bumpless_transfer_is_limited_too():
    rig = at(measured=10.0, bumpless=1, setpoint={"lower_limit": 30})

    assert rig.auto().step().st[0].sp == 30.0


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

    assert rig.plc.flags == {"DS1": number}
    assert rig.mode() == "manual"
    assert [text.split(":")[0] for _, text in rig.log] == [f"PID error {number}", "refused"]
    assert f"PID error {number}: " in rig.log[1][1]
    assert all(math.isfinite(x) for x in rig.sig)


@pytest.mark.parametrize(("register", "value"), [(name, v) for name, v, _ in WRONG.values()])
def test_the_ends_of_what_a_register_may_hold_are_no_error(register, value):
    rig = Rig(image=poked(image_of({"mode": "auto"}), **{register: value}), goals=True)
    rig.step(5)

    assert rig.plc.flags == {"DS1": 0}
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

    assert Rig(image=image).plc.flags == {"DS1": number}


def test_an_unwritten_plc_shows_its_lowest_error_and_runs_as_far_as_it_can():
    """All registers 0, as after a download: the first error is the sample rate's; the measurement goes on."""
    blank = Image("click", (), image_of({}).settings)
    rig = Rig(image=blank, plants=[Fixed(7.5)])
    rig.auto().step(3)

    assert rig.plc.flags == {"DS1": 10}
    assert (rig.mode(), rig.sig[rig.cfg[0].sig_pv]) == ("manual", 7.5)
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
        seen.append((rig.plc.flags["DS1"], rig.mode(), rig.out()))

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
    assert rig.st[0].status & FLAG_BITS["pid_error"] == 0
    assert rig.auto().step().mode() == "auto"


def test_a_cured_error_lets_a_loop_reach_the_mode_it_has_never_reached():
    rig = Rig({"mode": "auto", "setpoint": {"value": 60}, "tuning": {"reset_time": "0.005 s"}}, goals=True)
    rig.step(5)
    assert rig.mode() == "manual"
    rig.set("tuning.reset_time", 20)

    assert rig.step().mode() == "auto"
    assert rig.st[0].ki == pytest.approx(0.1 / 20, rel=1e-6)


def test_a_bias_that_is_no_number_comes_from_an_output_that_is_none():
    """No error stands for the output, but the transfer makes it the bias."""
    rig = Rig(image=poked(image_of({}), output=math.nan))
    assert rig.plc.flags == {"DS1": 0}
    rig.auto().step(2)

    assert rig.plc.flags == {"DS1": 25}
    assert rig.mode() == "manual"
    assert rig.log == [("L1", "to Manual: PID error 25: bias is not a number (DFn+04)")]
    rig.set("output", 10)
    rig.set("bias", 0)
    assert rig.auto().step(2).mode() == "auto"


def test_a_notice_knows_what_was_requested():
    number = noticed(noticed(0, 2, 100 + 12), 0, 4)

    assert Click.requested(number) == "auto"
    assert Click.describe(number) == (
        "refused: PID error 27: reset time (DFn+06) is not within 0.01 to 6000 s",
        "no PID error any more",
    )
    assert Click.requested(4) is None
    assert Click.describe(0) == ("", "")


# --- STOP and RUN ----------------------------------------------------------------------------------------------------


def test_stop_turns_outputs_off_and_run_begins_in_manual_with_the_register():
    rig = at(output={"pwm": {"bit": "Y001", "period": 1}})
    rig.set("output", 40)
    rig.auto().step(3)
    out = rig.out()
    assert out > 45.0
    rig.plc.program(rig.sig)
    rig.plants[0].value = 99.0
    rig.step(20)

    assert rig.mode() == "manual"
    assert (rig.out(), rig.sig[rig.cfg[0].sig_pwm], rig.sig[rig.cfg[0].sig_pv]) == (0.0, 0.0, 50.0)
    assert rig.st[0].out == out
    rig.auto().step(3)
    assert rig.log == [
        ("L1", "to Manual: the PLC went to STOP mode"),
        ("L1", "refused: the PLC is in STOP mode"),
    ]
    rig.plc.run(rig.tick)
    rig.step(5)
    assert (rig.mode(), rig.out(), rig.sig[rig.cfg[0].sig_pv]) == ("manual", out, 99.0)
    rig.auto().step()
    assert rig.mode() == "auto"


def test_after_stop_the_first_sample_has_no_past():
    rig = at(pv={"filter": 10}, alarms={"rate_of_change": 5})
    rig.step(3)
    rig.plc.program(rig.sig)
    rig.plants[0].value = 90.0
    rig.step(3)
    rig.plc.run(rig.tick)
    rig.step()

    assert rig.st[0].pv == 90.0
    assert rig.st[0].status & ALARM_BITS["rate_of_change"] == 0


def test_stop_ends_the_goal_and_run_and_stop_twice_are_once():
    rig = Rig({"mode": "auto", "tuning": {"reset_time": "0.005 s"}}, goals=True)
    rig.step()
    rig.plc.program(rig.sig)
    rig.plc.program(rig.sig)
    rig.plc.run(rig.tick)
    rig.plc.run(rig.tick + 50_000)
    rig.set("tuning.reset_time", 1)
    rig.step(3)

    assert rig.mode() == "manual"
    assert [text.partition(":")[0] for _, text in rig.log] == ["PID error 27", "refused", "no PID error any more"]
    assert rig.plc.tuned(0) is None


def test_stop_forgets_requests():
    rig = at()
    rig.plc.autotune(0, "start")
    rig.plc.program(rig.sig)
    rig.plc.run(rig.tick)
    rig.auto().step(2)

    assert (rig.mode(), rig.log) == ("auto", [])


# --- alarms ----------------------------------------------------------------------------------------------------------


def names(status):
    return [name for name, bit in ALARM_BITS.items() if status & bit]


def trail(pvs, **loop):
    """The alarms that are on after each PV."""
    rig = at(**loop)
    seen = []
    for rig.plants[0].value in pvs:
        rig.step()
        seen.append(names(rig.st[0].status))
    return seen


PV_LIMITS = {"low_low": 10, "low": 20, "high": 80, "high_high": 90}


def test_alarms_come_beyond_the_limit_and_go_with_the_hysteresis():
    alarms = {"pv": PV_LIMITS, "hysteresis": 2}

    assert trail([80, 80.5, 80, 78.5, 78, 79], alarms=alarms) == [[], *[["pv_high"]] * 3, [], []]
    assert trail([20, 19.5, 20, 21.5, 22, 21], alarms=alarms) == [[], *[["pv_low"]] * 3, [], []]
    assert trail([9, 15, 50, 85, 95], alarms=alarms) == [
        ["pv_low_low", "pv_low"],
        ["pv_low"],
        [],
        ["pv_high"],
        ["pv_high", "pv_high_high"],
    ]


def test_deviation_counts_in_both_directions():
    alarms = {"deviation": {"high": 5, "high_high": 10}, "hysteresis": 1}

    assert trail([65, 65.5, 70.5, 69.5, 69, 64, 54.5, 49], alarms=alarms) == [
        [],
        ["deviation_high"],
        *[["deviation_high", "deviation_high_high"]] * 2,
        ["deviation_high"],
        [],
        ["deviation_high"],
        ["deviation_high", "deviation_high_high"],
    ]


def test_rate_of_change_is_per_sample_without_hysteresis_and_not_at_first():
    alarms = {"rate_of_change": 5, "hysteresis": 20}

    assert trail([90, 85, 79.5, 79.5, 84.5, 90], alarms=alarms) == [
        [],
        [],
        ["rate_of_change"],
        [],
        [],
        ["rate_of_change"],
    ]


def test_the_manuals_rate_of_15_a_minute_is_half_a_unit_in_2_s():
    rig = at(sample_rate="2 s", alarms={"rate_of_change": "15 /min"})

    assert rig.cfg[0].rate_of_change == 0.5


def test_alarms_look_at_the_filtered_pv():
    assert trail([50, 90, 90, 90], pv={"filter": 50}, alarms={"pv": PV_LIMITS}) == [[], [], [], ["pv_high"]]


@pytest.mark.parametrize("group", ["pv", "deviation", "rate_of_change"])
def test_a_group_that_is_off_has_no_alarms_and_loses_those_it_had(group):
    alarms = {"pv": PV_LIMITS, "deviation": {"high": 5, "high_high": 10}, "rate_of_change": 5}
    rig = at(alarms=alarms)
    rig.step()
    rig.plants[0].value = 95.0
    rig.step()
    before = set(names(rig.st[0].status))
    rig.set(f"alarms.{group}_enabled" if group == "rate_of_change" else f"alarms.{group}.enabled", value=False)
    rig.plants[0].value = 10.0
    rig.step()
    after = set(names(rig.st[0].status))

    assert before == {"pv_high", "pv_high_high", "deviation_high", "deviation_high_high", "rate_of_change"}
    assert not any(name.startswith(group) for name in after)
    assert len(after) >= 2


def test_a_new_limit_alarms_a_pv_that_stands_still():
    rig = at(alarms={"pv": PV_LIMITS})
    rig.step(3)
    rig.set("alarms.pv.high", 45)

    assert names(rig.step().st[0].status) == ["pv_high"]


def test_a_group_that_is_switched_off_loses_alarms_whatever_the_hysteresis_holds():
    image = poked(image_of({"alarms": {"pv": PV_LIMITS}}), hysteresis=math.nan)
    rig = Rig(image=image, plants=[Fixed(95.0)])
    rig.step()
    assert names(rig.st[0].status) == ["pv_high", "pv_high_high"]
    rig.set("alarms.pv.enabled", value=False)

    assert names(rig.step().st[0].status) == []


@pytest.mark.parametrize("mode", ["manual", "auto"])
def test_alarms_work_in_every_mode_and_refuse_none(mode):
    rig = at(measured=95.0, alarms={"pv": PV_LIMITS})
    rig.step()
    if mode == "auto":
        rig.auto()
    rig.step()

    assert (rig.mode(), names(rig.st[0].status)) == (mode, ["pv_high", "pv_high_high"])


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

    assert rig.st[0].status & ALARMS == expected(pvs, limits, hysteresis)


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
            rig.st[0].sp = setpoints[n % len(setpoints)]
        full.st[0].quiet_low = math.inf
        short.step()
        full.step()
        assert short.st[0].status == full.st[0].status
        assert short.sig == full.sig


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

    assert names(rig.st[0].status) == ["pv_high_high"]
