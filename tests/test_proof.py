"""Whether a run proves control: settled after what moved it last, and better than without the loop."""

from __future__ import annotations

import csv
import io
from math import expm1
from types import SimpleNamespace as Facts

import pytest

from pidcfg.sim.judgement import control
from pidcfg.sim.judgement.meters import Benefit, Meter, compare_errors
from standing_rig import SCENARIO, SIDES, failures, outcome, unproven, verdict

VENDORS = [*SIDES]
EVENT = SCENARIO[SCENARIO.index("events:") :]
STEADY = ("plants:", "initial: steady\nplants:")
MANUAL = {
    "dl06": ("mode: auto", "mode: manual"),
    "click": ("mode: auto", "mode: manual"),
    "ezlogix": ("mode: auto", "mode: manual"),
    "nextopid": ("    SP:", "    Manual: true\n    SP:"),
    "dpide": ("    SV:", "    PID_MAN: true\n    SV:"),
    "generic": ("    pv:", "    mode: manual\n    pv:"),
}


def tank(result):
    """The verdict on the loop, and what is missing."""
    loop = result.report.loops["TANK"]
    return loop.verdict, loop.missing


# --- settled ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_sound_run_is_proven_and_says_why(vendor):
    result = outcome(vendor)
    assert tank(result) == ("proven", "")
    assert verdict(result, "not-settled").text.startswith("stays within 2 of its set point for ")
    assert verdict(result, "no-better").text.endswith(" % of the error that there would be without it")


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize(
    ("edits", "missing"),
    [
        ([("at: 80", "at: 199.8")], "what happens at 199.8 s: nothing after it was seen"),
        ([("duration: 200", "duration: 98")], "settled for "),
        ([("dead_time: 1", "dead_time: 30")], ""),
        ([("time_constant: 20", "time_constant: 2000")], ""),
    ],
    ids=["event at the end", "short", "dead time", "slow plant"],
)
def test_what_a_run_does_not_show_is_not_proven_and_says_what_is_missing(vendor, edits, missing):
    result = outcome(vendor, *edits)
    word, text = tank(result)
    assert word in {"failed", "not-proven"}
    assert missing in text
    assert not result.passed


@pytest.mark.parametrize("vendor", VENDORS)
def test_the_time_that_is_missing_is_the_time_that_proves(vendor):
    text = verdict(outcome(vendor, ("duration: 200", "duration: 98")), "not-settled").text
    until = float(text.rpartition("run to ")[2].removesuffix(" s"))
    assert 98 < until < 140
    assert tank(outcome(vendor, ("duration: 200", f"duration: {until:g}")))[0] == "proven"


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_slow_swing_is_no_arrival(vendor):
    """Half a period lies within the run: no oscillation is counted."""
    slow = ("time_constant: 20, dead_time: 1", "time_constant: 60, dead_time: 12")
    result = outcome(vendor, slow, config=[(SIDES[vendor].slow[0], SIDES[vendor].slow[0].replace("20", "6"))])
    assert tank(result)[0] in {"failed", "not-proven"}


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_offset_is_told_with_its_cause_unless_the_scenario_allows_it(vendor):
    side = SIDES[vendor]
    config = [(side.slow[0], side.off)]
    result = outcome(vendor, config=config)
    assert tank(result)[0] == "failed"
    assert "it has no integral" in tank(result)[1]
    assert failures(outcome(vendor, config=config, more="tolerance: {TANK: 40}\n")) == set()
    assert verdict(outcome(vendor, config=config, more="tolerance: {TANK: 40}\n"), "not-settled").passed


def test_a_dead_band_is_the_cause_of_an_offset_and_no_excuse():
    band = ("    output:", "    deadband: 10\n    output:")
    result = outcome("generic", config=[band])
    assert tank(result)[0] == "failed"
    assert "its dead band is 10" in tank(result)[1]


@pytest.mark.parametrize("vendor", ["dl06", "ezlogix", "generic"])
def test_a_set_point_that_is_limited_is_not_the_one_that_was_asked_for(vendor):
    limits = {"ezlogix": ("limits: [0, 100]}\n    output", "limits: [0, 62]}\n    output")}.get(
        vendor, ("    setpoint: {value: 60}", "    setpoint: {value: 60, limits: [0, 62]}")
    )
    word, text = tank(outcome(vendor, config=[limits]))
    assert word == "not-proven"
    assert "the event at 80 s asks for 65, and 62 is in force" in text


# --- in its mode -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_new_set_point_that_meets_manual_fails(vendor):
    result = outcome(vendor, config=[MANUAL[vendor]])
    found = verdict(result, "not-in-mode")
    assert (found.verdict, found.at) == ("failed", 80.0)
    assert found.text.startswith("its set point is changed at 80 s, and it is in ")


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "generic"])
def test_a_set_point_may_be_set_before_the_loop_comes_into_auto(vendor):
    more = "  - {at: 90, loop: TANK, mode: auto}\n"
    result = outcome(vendor, config=[MANUAL[vendor]], more=more)
    assert tank(result) == ("proven", "")


def test_auto_that_is_refused_while_the_set_point_changes_tests_nothing():
    alarm = ("    output:", "    alarms: {pv: {low_low: 20, low: 45, high: 90, high_high: 95}}\n    output:")
    more = "  - {at: 120, loop: TANK, disturb: {load: 58}}\n  - {at: 150, loop: TANK, mode: auto}\n"
    result = outcome("dl06", config=[alarm], more=more)
    assert verdict(result, "not-in-mode").text == "the event at 80 s met manual: nothing was tested"
    assert "not-in-mode" in unproven(result)


@pytest.mark.parametrize(
    ("vendor", "mode"), [("dl06", "program"), ("click", "stop"), ("ezlogix", "stop"), ("dpide", "stop")]
)
def test_a_new_set_point_that_meets_a_plc_that_stands_for_good_fails(vendor, mode):
    """It is no lack of an excitation, nor proven by what the loop had done until then."""
    more = f"  - {{at: 70, plc: {mode}}}\n"
    result = outcome(vendor, STEADY, more=more)
    assert tank(result)[0] == "failed"
    assert not result.passed


def test_a_new_set_point_that_meets_tracking_for_good_fails():
    result = outcome("nextopid", more="  - {at: 70, set: {Hold: true}}\n")
    assert tank(result) == ("failed", "its set point is changed at 80 s, and it is in tracking to the end")


def test_a_set_point_that_a_signal_gives_is_asked_for_too():
    signal = [("{Hold: false}", "{Hold: false, Wanted: 60.0}"), ("SP: 60.0", "SP: Wanted")]
    event = ("{at: 80, loop: TANK, set: {setpoint: 65}}", "{at: 80, set: {Wanted: 65.0}}")
    assert tank(outcome("nextopid", event, config=signal)) == ("proven", "")
    narrow = [*signal, ("MaxPV: 100.0", "MaxPV: 62.0")]
    assert "asks for 65, and 62 is in force" in tank(outcome("nextopid", event, config=narrow))[1]


@pytest.mark.parametrize("vendor", ["dl06", "generic"])
def test_a_run_from_rest_is_judged_at_once_at_an_output_limit(vendor):
    """The output would have to be 40 % at rest, and may be 50 % at least."""
    limits = ("output: {range: [0, 100]", "output: {range: [0, 100], limits: [50, 100]")
    event = ("at: 80", "at: 10")
    result = outcome(vendor, STEADY, event, ("setpoint: 65", "setpoint: 75"), config=[limits])
    found = verdict(result, "saturated")
    assert found.verdict == "failed"
    assert "until the event at 10 s" in found.text


def test_a_loop_on_a_long_dead_time_may_wait_for_a_second_one():
    """SIMC with the closed loop as fast as the dead time: 63 % come after two of them."""
    slow = ("time_constant: 20, dead_time: 1", "time_constant: 10, dead_time: 30")
    gains = [("gain: 2.00", "gain: 0.17"), ("reset: 20.0", "reset: 10.0")]
    result = outcome("dl06", STEADY, slow, ("duration: 200", "duration: 600"), config=gains)
    assert tank(result) == ("proven", "")
    late = outcome(
        "dl06", STEADY, slow, ("duration: 200", "duration: 900"), config=[("gain: 2.00", "gain: 0.05"), gains[1]]
    )
    assert unproven(late) == {"no-better"}


# --- better than nothing ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_tenth_of_the_gain_is_no_better_than_nothing(vendor):
    result = outcome(vendor, STEADY, config=[(SIDES[vendor].gain[0], SIDES[vendor].soft), SIDES[vendor].slow])
    assert tank(result)[0] in {"failed", "not-proven"}


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix"])
def test_an_integral_that_is_far_too_long_creeps_to_its_set_point(vendor):
    """The gain brings the PV two thirds of the way at once; the rest takes ten times the plant's time constant."""
    slow = (SIDES[vendor].slow[0], SIDES[vendor].slow[0].replace("20", "200"))
    edits = STEADY, ("setpoint: 65", "setpoint: 90"), ("duration: 200", "duration: 1500")
    assert tank(outcome(vendor, *edits)) == ("proven", "")
    found = verdict(outcome(vendor, *edits, config=[slow]), "no-better")
    assert found.verdict == "not-proven"
    assert "the error after the step is that of a whole step for " in found.text


def test_a_run_without_a_reference_is_not_proven():
    result = outcome("dl06", reference=False)
    assert tank(result) == ("not-proven", "whether it does better than without control: the run had no reference")


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_loop_that_nothing_moves_is_not_judged(vendor):
    result = outcome(vendor, STEADY, (EVENT, ""))
    word, text = tank(result)
    assert (word, result.passed) == ("not-judged", True)
    assert text.startswith("no excitation")


@pytest.mark.parametrize("vendor", VENDORS)
def test_what_is_left_of_the_error_is_what_two_runs_give(vendor):
    """The reference against a plant that is worked out by hand: its output stays where it was."""
    trend = io.StringIO()
    result = outcome(vendor, trend=trend)
    held, own_error, held_error = 40.0, 0.0, 0.0
    for row in list(csv.DictReader(io.StringIO(trend.getvalue())))[1:]:
        held += (20.0 - held) * -expm1(-0.1 / 20)
        set_point = float(row.get("TANK.SP") or row["TANK.SV"])
        own_error += abs(set_point - float(row["TANK.PV"]))
        held_error += abs(set_point - held)
    said = float(verdict(result, "no-better").text.split()[1])
    assert said == pytest.approx(100 * own_error / held_error, abs=1.5)


def test_an_expectation_that_bounds_the_pv_to_the_end_takes_the_place_of_both():
    slow = ("time_constant: 20", "time_constant: 800")
    assert tank(outcome("dl06", slow))[0] == "not-proven"
    expect = "expect:\n  - {signal: TANK.PV, final: 60, tolerance: 30}\n"
    result = outcome("dl06", slow, more=expect)
    assert tank(result) == ("proven", "")
    assert verdict(result, "no-better").text.startswith(
        "an expectation holds that bounds it: TANK.PV 60 ± 30 at the end"
    )
    early = "expect:\n  - {signal: TANK.PV, min: 0, max: 100, until: 100}\n"
    assert tank(outcome("dl06", slow, more=early))[0] == "not-proven", "it does not hold to the end"
    one = "expect:\n  - {signal: TANK.PV, max: 100}\n"
    assert tank(outcome("dl06", slow, more=one))[0] == "not-proven", "one bound is none"
    wrong = "expect:\n  - {signal: TANK.PV, final: 90, tolerance: 1}\n"
    assert tank(outcome("dl06", slow, more=wrong))[0] == "not-proven", "it does not hold"


def test_what_is_not_proven_can_be_allowed():
    slow = ("time_constant: 20", "time_constant: 800")
    allow = "allow:\n  - {kind: not-proven, loop: TANK, reason: the tank takes a day}\n"
    result = outcome("dl06", slow, more=allow)
    assert result.passed
    word, text = tank(result)
    assert word == "not-judged"
    assert "(allowed: the tank takes a day)" in text
    assert not outcome("dl06", ("gain: 1,", "gain: 0.3,"), more=allow).passed, "a failure is not allowed by it"


def test_an_allowance_that_allows_nothing_excuses_nothing():
    """Without it as with it: a closed loop of 40 s on a lag of 20 s."""
    slow = [(SIDES["dl06"].gain[0], "gain: 0.50")]
    allow = "allow:\n  - {kind: oscillates, loop: TANK, reason: of old}\n"
    one, two = outcome("dl06", config=slow), outcome("dl06", config=slow, more=allow)
    assert tank(one)[0] == "not-proven"
    assert unproven(one) == {"no-better"}
    assert (tank(two), two.passed) == (tank(one), False)


@pytest.mark.parametrize(
    ("control", "broken", "sums"), [(1, 0, (3.0, 9.0, 5.0)), (0, 0, (0.0, 0.0, 0.0)), (1, 1, (0.0, 0.0, 0.0))]
)
def test_errors_beyond_the_noise_are_summed_in_control_with_a_sound_sensor(control, broken, sums):
    """The set point is 10 and the noise 1: errors of 2, 0.5 and 3 with the loop, of 5, 0 and 6 without it."""
    rival = Benefit(loop=0, slot=1, margin=1.0)
    meter = Facts(in_control=control, sensor_broken=broken, sp=0)
    for pv, held in ((12.0, 15.0), (9.5, 10.0), (7.0, 4.0)):
        compare_errors([rival], [meter], [10.0, pv], [0.0, held])

    assert (rival.error, rival.held_error, rival.widest_error) == sums


@pytest.mark.parametrize(("error", "word"), [(70.0, "proven"), (70.1, "not-proven")])
def test_seven_tenths_of_the_error_may_be_left(monkeypatch, error, word):
    monkeypatch.setattr(control, "_judge_exempt", lambda *_: None)
    monkeypatch.setattr(control, "_slow_answer", lambda *_: "")
    e = Facts(benefits={0: Benefit(0, 0, error=error, held_error=100.0, widest_error=9.0)}, bands=[2.0])
    assert control.judge_benefit(e, 0).verdict == word


@pytest.mark.parametrize(("away", "word"), [(2.0, "proven"), (4.5, "proven"), (4.51, "not-proven")])
def test_a_pv_may_be_one_and_a_half_plant_times_behind_a_ramp(monkeypatch, away, word):
    """The set point moves by 10 in the 50 s between the halves of the window; the plant takes 15 s."""
    monkeypatch.setattr(control, "last_event", lambda *_: 0)
    meter = Meter(0, 1, 2, in_control=1, sp_moved_at=95, window_start=0, window_middle=50)
    e = Facts(
        meters=[meter],
        paces=[Facts(seconds=15.0)],
        bands=[2.0],
        masters=[-1],
        plc=Facts(configs=[Facts(period=1)]),
        step=1,
        seconds=float,
        mean_errors=lambda _: (away, -away),
        set_point_moves=lambda _: 10.0,
        unit=lambda _: "",
    )
    assert control._judge_unsettled(e, 0, 95, 100).verdict == word


def test_both_engines_give_the_same_verdicts():
    pytest.importorskip("numba")
    one, two = (outcome("dl06", engine=engine) for engine in ("python", "numba"))
    assert one.report.standing == two.report.standing


def test_a_broken_sensor_does_not_reach_the_reference():
    result = outcome("generic", more="  - {at: 100, loop: TANK, pv: 0, for: 10}\n")
    assert verdict(result, "no-better").passed


def test_a_fault_that_is_shorter_than_a_base_step_is_seen_once_and_ends():
    result = outcome("generic", more="  - {at: 99.95, loop: TANK, pv: 0, for: 0.02}\n")
    assert tank(result) == ("proven", "")
    assert result.report.signals["TANK.PV"].low == 0
