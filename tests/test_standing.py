"""Standing expectations: a sound run of each vendor passes, and each kind finds what has been spoiled."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from pidcfg.api import encode, simulate
from pidcfg.cli.formats.runs import number_text, render_runs
from pidcfg.cli.formats.runs import run_verdict_line as verdict_line
from pidcfg.schemas.scenario import Allowance, StandingKind
from pidcfg.sim.judgement.meters import (
    Meter,
    calm_oscillation,
    change_status,
    oscillation,
    time_in_alarm,
    time_in_control,
    want_mode,
    watch_swings,
)
from pidcfg.sim.judgement.report import STANDING_KINDS
from pidcfg.sim.judgement.standing import STANDING_JUDGES
from standing_rig import SCENARIO, SIDES, failures, outcome, unproven, verdict

VENDORS = [*SIDES]
EVENT = SCENARIO[SCENARIO.index("events:") :]
PLANT = SCENARIO[SCENARIO.index("plants:") : SCENARIO.index("events:")]
WEAK = ("gain: 1,", "gain: 0.3,")
"""Full power does not reach the set point."""
LOW_ALARM = ("    output:", "    alarms: {pv: {low_low: 70, low: 80, high: 90, high_high: 95}}\n    output:")
"""The PV starts below it, and a DL06 in alarm refuses Auto."""
OUTPUTS = {"dl06": "OUT", "click": "CO", "ezlogix": "CV", "nextopid": "MV", "dpide": "MV", "generic": "OUT"}
ALARMING = [vendor for vendor, side in SIDES.items() if side.alarms is not None]


def test_the_kinds_are_the_same_everywhere():
    assert tuple(STANDING_JUDGES) == STANDING_KINDS == StandingKind.__args__
    assert Allowance.model_fields["kind"].annotation == Literal[StandingKind, "not-proven"]


# --- each kind, each vendor ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_sound_run_passes_with_every_kind_judged(vendor):
    result = outcome(vendor)
    assert result.passed
    assert [(v.kind, v.loop) for v in result.report.standing] == [
        ("set-up-error", ""),
        *((kind, "TANK") for kind in STANDING_KINDS),
    ]
    assert all(v.passed and v.is_judged for v in result.report.standing)
    assert result.report.loops["TANK"].metrics["oscillation_period"] is None


@pytest.mark.parametrize("vendor", VENDORS)
def test_without_a_plant_nothing_is_controlled(vendor):
    result = outcome(vendor, (PLANT, ""))
    assert "pv-not-driven" in failures(result)
    assert result.report.loops["TANK"].metrics["overshoot"] is None


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize("pv", ["50", "other"])
def test_a_pv_from_elsewhere_is_not_driven(vendor, pv):
    other = "" if pv != "other" else "signals: {other: 50}\n"
    result = outcome(vendor, (PLANT, f"{other}connect: {{TANK.PV: {pv}}}\n"))
    assert "pv-not-driven" in failures(result)


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_signal_that_the_scenario_drives_will_do(vendor):
    events = "events:\n  - {at: 20, set: {other: 55}}\n"
    result = outcome(vendor, (PLANT, "signals: {other: 50}\nconnect: {TANK.PV: other}\n"), ("events:\n", events))
    assert verdict(result, "pv-not-driven").text == "a signal that the scenario sets moves its PV"


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_plant_without_gain_moves_nothing(vendor):
    assert "pv-not-driven" in failures(outcome(vendor, ("gain: 1,", "gain: 0,")))


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize("text", ["{} * 0", "{0} - {0} + 40", "min(max({}, 40), 40)"])
def test_what_does_not_follow_the_output_does_not_drive_the_pv(vendor, text):
    signal = f"TANK.{OUTPUTS[vendor]}"
    edit = ("{model:", f"{{input: '{text.format(signal)}', model:")
    assert "pv-not-driven" in failures(outcome(vendor, edit))
    for harmless in ("{} * 1 + 0", "min({}, 100)", "100 - (100 - {}) * 1"):
        edit = ("{model:", f"{{input: '{harmless.format(signal)}', model:")
        assert failures(outcome(vendor, edit)) == set(), harmless


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_gain_that_an_event_takes_away_leaves_nothing_controlled(vendor):
    lost = "  - {at: 100, loop: TANK, disturb: {gain: 0}}\n"
    result = outcome(vendor, more=lost)
    assert "pv-not-driven" in failures(result)
    assert "for 100 s while a plant without gain" in verdict(result, "pv-not-driven").text
    back = f"{lost}  - {{at: 103, loop: TANK, disturb: {{gain: 1}}}}\n"
    assert "pv-not-driven" not in failures(outcome(vendor, more=back))
    assert "pv-not-driven" not in failures(outcome(vendor, more=f"{lost}expect:\n  - {{loop: TANK, mode: auto}}\n"))


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_gain_that_moves_nothing_to_be_seen_drives_nothing(vendor):
    result = outcome(vendor, ("gain: 1, load: 20", "gain: 0.0009, load: 60"))
    assert "moves its PV by no more than 0.0" in verdict(result, "pv-not-driven").text
    assert verdict(outcome(vendor, ("gain: 1, load: 20", "gain: 0.0011, load: 60")), "pv-not-driven").passed
    tank = ("{model: first_order, gain: 1, load: 20, time_constant: 20,", "{model: integrator, gain: 0.01, load: -0.2,")
    assert verdict(outcome(vendor, tank), "pv-not-driven").passed, "it has 200 s for it"


def test_a_wire_that_leaves_nothing_of_an_output_drives_nothing():
    def run(text):
        blocks = f"blocks:\n  - {{name: SEL, type: ControlSelectMin, MV1: '{text}', MV2: 100.0}}\nloops:"
        return outcome("nextopid", ("{model:", "{input: SEL.MV, model:"), config=[("loops:", blocks)])

    for text in ("TANK.MV * {}", "{} * TANK.MV", "TANK.PV * 0.1 + TANK.MV * {}", "TANK.MV / 2 * {}"):
        assert "pv-not-driven" in failures(run(text.format("0.0")))
        assert "pv-not-driven" not in failures(run(text.format("1.0")))


@pytest.mark.parametrize("vendor", VENDORS)
def test_full_power_that_does_not_suffice_is_saturated(vendor):
    result = outcome(vendor, WEAK)
    found = verdict(result, "saturated")
    assert (found.passed, found.is_judged, found.at) == (False, True, 180.0)
    assert "upper output limit" in found.text
    assert not result.passed


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_error_that_gets_smaller_is_not_saturated(vendor):
    slow = ("time_constant: 20", "time_constant: 800")
    assert "saturated" not in failures(outcome(vendor, slow))


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_integral_that_hardly_acts_leaves_an_error(vendor):
    config = [(SIDES[vendor].gain[0], SIDES[vendor].soft), SIDES[vendor].slow]
    result = outcome(vendor, config=config)
    assert failures(result) == {"error-stands"}
    assert verdict(result, "error-stands").text.startswith("ends inside its output limits with an error of ")
    off = [(SIDES[vendor].gain[0], SIDES[vendor].soft), (SIDES[vendor].slow[0], SIDES[vendor].off)]
    assert failures(outcome(vendor, config=off)) == {"error-stands"}, "an offset of more than 2 % has to be allowed"


def with_gain(vendor, gain):
    """The edits of a configuration that give a loop this gain and no integral."""
    side = SIDES[vendor]
    return [(side.gain[0], re.sub(r"\d+(\.0*)?", rf"{gain}\1", side.gain[0])), (side.slow[0], side.off)]


@pytest.mark.parametrize("vendor", VENDORS)
def test_without_an_integral_an_offset_of_a_fiftieth_is_too_much(vendor):
    assert failures(outcome(vendor, config=with_gain(vendor, 4))) == {"error-stands"}
    assert failures(outcome(vendor, ("load: 20", "load: 40"), config=with_gain(vendor, 12))) == set()


def test_a_level_that_stands_elsewhere_without_an_integral_has_a_tolerance():
    tank = ("{model: first_order, gain: 1, load: 20, time_constant: 20,", "{model: integrator, gain: 0.02, load: -0.5,")
    edits = tank, ("duration: 200", "duration: 900")
    found = outcome("generic", *edits, config=with_gain("generic", 2))
    assert verdict(found, "error-stands").text.endswith(": it has no integral")
    found = outcome("generic", *edits, config=with_gain("generic", 2), more="tolerance: {TANK: 15 %}\n")
    assert failures(found) == set()
    assert 10 < abs(found.report.loops["TANK"].metrics["final_error"]) < 20


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_event_in_the_last_tenth_is_judged_by_what_comes_before_it(vendor):
    found = verdict(outcome(vendor, WEAK, ("at: 80", "at: 190")), "saturated")
    assert (found.passed, found.is_judged) == (False, True)
    assert found.text.endswith("until the event at 190 s")
    assert verdict(outcome(vendor, ("at: 80", "at: 190")), "saturated").is_judged


@pytest.mark.parametrize("vendor", [vendor for vendor in VENDORS if vendor != "dpide"])
def test_a_loop_that_comes_into_auto_late_is_not_proven(vendor):
    late = "  - {at: 0, loop: TANK, mode: manual}\n  - {at: 960, loop: TANK, mode: auto}\n"
    edits = (WEAK, ("duration: 200", "duration: 1000"))
    found = verdict(outcome(vendor, *edits, more=late), "saturated")
    assert found.verdict == "not-proven"
    assert found.text == "it is in auto from 960 s on only"


@pytest.mark.parametrize("vendor", [vendor for vendor in VENDORS if vendor != "dpide"])
@pytest.mark.parametrize("at", [900, 950, 999, 1000])
def test_a_loop_that_comes_into_auto_in_the_last_tenth_is_judged_only_at_its_set_point(vendor, at):
    late = f"  - {{at: 0, loop: TANK, mode: manual}}\n  - {{at: {at}, loop: TANK, mode: auto}}\n"
    found = outcome(vendor, ("duration: 200", "duration: 1000"), more=late)
    verdicts = {verdict(found, kind).verdict for kind in ("saturated", "error-stands")}
    assert verdicts == {"proven" if at == 900 else "not-proven"}


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_pv_that_has_not_come_to_its_set_point_is_not_said_to_be_there(vendor):
    found = verdict(outcome(vendor, ("duration: 200", "duration: 8"), ("at: 80", "at: 1")), "error-stands")
    assert (found.passed, found.text) == (True, "its PV is on its way to its set point")


@pytest.mark.parametrize("vendor", VENDORS)
def test_the_window_is_three_dead_times_long_at_least(vendor):
    found = verdict(outcome(vendor, WEAK, ("dead_time: 1", "dead_time: 15")), "saturated")
    assert found.at == 155.0


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_pv_beyond_its_range_is_found(vendor):
    assert {"saturated", "out-of-range"} <= failures(outcome(vendor, ("load: 20", "load: 150")))
    assert failures(outcome(vendor, ("load: 20", "load: 150"), more="loops: [TANK]\n"))


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_gain_far_too_high_oscillates(vendor):
    result = outcome(vendor, config=[SIDES[vendor].gain])
    assert "oscillates" in failures(result)
    metrics = result.report.loops["TANK"].metrics
    assert 4.5 < metrics["oscillation_period"] < 5.5, "about 4.9 dead times of 1 s with their samples"
    assert 2.5 < metrics["oscillation_amplitude"] < 3


@pytest.mark.parametrize("vendor", VENDORS)
def test_events_that_repeat_leave_an_oscillation_open(vendor):
    steps = ((at, 66 + at % 2) for at in range(124, 200, 11))
    more = "".join(f"  - {{at: {at}, loop: TANK, set: {{setpoint: {value}}}}}\n" for at, value in steps)
    found = verdict(outcome(vendor, config=[SIDES[vendor].gain], more=more), "oscillates")
    assert (found.passed, found.is_judged) == (True, False)
    assert found.text.endswith("6 events move it in the last third")


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_oscillation_of_three_periods_between_two_events_is_the_loops_own(vendor):
    times = (120, 130, 140, 171, 181)
    more = "".join(f"  - {{at: {at}, loop: TANK, set: {{setpoint: {60 + at % 4}}}}}\n" for at in times)
    found = verdict(outcome(vendor, config=[SIDES[vendor].gain], more=more), "oscillates")
    assert not found.passed
    assert 140 < found.at < 150


TUNING = {vendor: side.gain[0].partition(":")[0] for vendor, side in SIDES.items()} | {
    "dl06": "tuning.gain",
    "click": "tuning.proportional_gain",
    "ezlogix": "tuning.proportional_gain",
    "generic": "tuning.gain",
}
"""The key of the gain, as an event writes it."""


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize(
    "what",
    ["set: {setpoint: 65}", "set: {%s: %s}", "disturb: {gain: 1}", "disturb: {load: 20}"],
    ids=["set point", "gain of the loop", "gain of the plant", "load"],
)
def test_events_that_change_nothing_excuse_nothing(vendor, what):
    high = SIDES[vendor].gain[1].partition(": ")[2].strip(",")
    action = what % (TUNING[vendor], high) if "%s" in what else what
    more = "".join(f"  - {{at: {at}, loop: TANK, {action}}}\n" for at in range(130, 200, 5))
    assert "oscillates" in failures(outcome(vendor, config=[SIDES[vendor].gain], more=more))
    idle = [one for one in (more, more.replace("130", "5")) if "setpoint" not in one]
    for events in idle:
        assert "saturated" in failures(outcome(vendor, WEAK, more=events.replace("gain: 1}", "gain: 0.3}")))


def test_signals_that_keep_their_value_excuse_nothing():
    more = "".join(f"  - {{at: {at}, set: {{Target: 65}}}}\n" for at in range(81, 200, 5))
    config = [("signals: {Hold: false}", "signals: {Hold: false, Target: 60.0}"), ("SP: 60.0", "SP: Target")]
    step = ("loop: TANK, set: {setpoint: 65}", "set: {Target: 65}")
    assert "oscillates" in failures(outcome("nextopid", step, config=[*config, SIDES["nextopid"].gain], more=more))


def test_what_the_plc_writes_itself_is_not_taken_for_the_same_value():
    to_and_fro = "".join(
        f"  - {{at: {at}, loop: TANK, mode: manual}}\n  - {{at: {at + 2}, loop: TANK, set: {{output: 40}}}}\n"
        f"  - {{at: {at + 4}, loop: TANK, mode: auto}}\n  - {{at: {at + 5}, loop: TANK, set: {{setpoint: 65}}}}\n"
        for at in range(130, 200, 10)
    )
    found = verdict(outcome("dl06", config=[SIDES["dl06"].gain], more=to_and_fro), "oscillates")
    assert found.passed, found.text


UNSTABLE = {vendor: (side.gain[0], re.sub(r"\d+(\.0*)?", r"16\1", side.gain[0])) for vendor, side in SIDES.items()}
"""The gain, and one with which the swings grow."""
SHORT = (
    ("duration: 200", "duration: 55"),
    ("at: 80", "at: 3"),
    ("setpoint: 65", "setpoint: 60.5"),
    ("dead_time: 1,", "dead_time: 2,"),
    ("initial: 40", "initial: 59.5"),
)
"""About six periods of a loop that is not stable."""


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_growing_oscillation_is_found_though_the_run_is_short(vendor):
    found = verdict(outcome(vendor, *SHORT, config=[UNSTABLE[vendor]]), "oscillates")
    assert not found.passed
    assert failures(outcome(vendor, *SHORT, config=[])) == set()


@pytest.mark.parametrize("vendor", ALARMING)
def test_an_outer_alarm_that_stands_is_found(vendor):
    result = outcome(vendor, WEAK, config=[SIDES[vendor].alarms])
    assert "alarm-stands" in failures(result)
    assert verdict(result, "alarm-stands").at == 0.0


@pytest.mark.parametrize("vendor", ALARMING)
def test_an_outer_alarm_may_stand_for_a_tenth_of_the_run(vendor):
    config = [SIDES[vendor].alarms]
    assert "alarm-stands" not in failures(outcome(vendor, ("initial: 40", "initial: 58"), config=config))
    cold = ("time_constant: 20", "time_constant: 60")
    assert "alarm-stands" not in failures(outcome(vendor, cold, config=config)), "it was cold"
    dip = "  - {at: 120, loop: TANK, disturb: {load: -40}}\n  - {at: 150, loop: TANK, disturb: {load: 20}}\n"
    assert "% of the run" in verdict(outcome(vendor, more=dip, config=config), "alarm-stands").text


@pytest.mark.parametrize("vendor", ALARMING)
def test_an_alarm_that_is_expected_may_stand(vendor):
    name = {"dl06": "deviation_red"}.get(vendor, "deviation_high_high")
    expected = f"expect:\n  - {{loop: TANK, alarm: {name}, after: 0}}\n"
    assert "alarm-stands" not in failures(outcome(vendor, WEAK, config=[SIDES[vendor].alarms], more=expected))


@pytest.mark.parametrize("vendor", ALARMING)
def test_an_alarm_of_a_broken_sensor_may_stand_as_long_as_it_is_broken(vendor):
    config = [SIDES[vendor].alarms]
    start = ("initial: 40", "initial: 58")
    assert "alarm-stands" not in failures(
        outcome(vendor, start, config=config, more="  - {at: 100, loop: TANK, pv: 0}\n")
    )
    afterwards = "  - {at: 100, loop: TANK, pv: 0, for: 60}\n"
    found = verdict(
        outcome(vendor, start, ("time_constant: 20", "time_constant: 80"), config=config, more=afterwards),
        "alarm-stands",
    )
    assert not found.passed, "the loop has been driven away meanwhile"


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_sensor_that_is_broken_for_good_leaves_nothing_controlled(vendor):
    broken = "  - {at: 100, loop: TANK, pv: 50}\n"
    found = verdict(outcome(vendor, more=broken), "pv-not-driven")
    assert not found.passed
    assert "100 s with a sensor that is broken for good" in found.text
    for end in (100, 1e6):
        assert verdict(outcome(vendor, more=broken.replace("50}", f"50, for: {end}}}")), "pv-not-driven") == found
    assert "pv-not-driven" in failures(outcome(vendor, more=f"{broken}  - {{at: 150, loop: TANK, pv: 40, for: 20}}\n"))
    for harmless in (
        broken.replace("50}", "50, for: 99}"),
        broken.replace("at: 100", "at: 185"),
        f"{broken}  - {{at: 105, loop: TANK, mode: manual}}\n",
        f"{broken}expect:\n  - {{loop: TANK, mode: auto}}\n",
    ):
        assert "pv-not-driven" not in failures(outcome(vendor, more=harmless)), harmless


@pytest.mark.parametrize("vendor", ["click", "nextopid", "dpide", "generic"])
def test_a_set_point_outside_the_range_is_found_though_the_plc_limits_it(vendor):
    old, new = {
        "click": ("setpoint: {value: 60}", "setpoint: {value: 160, lower_limit: 0, upper_limit: 65}"),
        "nextopid": ("SP: 60.0", "SP: 160.0"),
        "dpide": ("SV: 60.0", "SV: 160.0"),
        "generic": ("setpoint: {value: 60}", "setpoint: {value: 160, limits: [0, 65]}"),
    }[vendor]
    result = outcome(vendor, config=[(old, new)])
    assert "out-of-range" in failures(result)
    assert verdict(result, "out-of-range").text == "its set point is 160, outside its PV's range of 0 to 100"


def test_an_opposite_loop_has_the_pv_only_if_it_is_the_same_one():
    cool = CASCADE.replace("FLOW", "COOL").replace("mode: cascade", "mode: auto").replace("direct", "reverse")
    cool = cool.replace("    cascade_from: TANK\n", "").replace("value: 30", "value: 70")
    config = [("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{cool}")]
    water = (
        "plants:\n  - {name: water, model: first_order, input: TANK.OUT - COOL.OUT, gain: 1, load: 20, "
        "time_constant: 20, dead_time: 1, initial: 40}\nconnect: {TANK.PV: water, COOL.PV: water}\n"
    )
    assert verdict(outcome("dl06", (PLANT, water), config=config), "saturated", "COOL").text.startswith("TANK has the")
    weak = water.replace("TANK.OUT - COOL.OUT, gain: 1, load: 20", "TANK.OUT - COOL.OUT, gain: 0.4, load: 44")
    assert verdict(outcome("dl06", (PLANT, weak), config=config), "saturated", "COOL").text.startswith("TANK has the")
    tenth = water.replace("COOL.PV: water", "COOL.PV: water / 10")
    assert "saturated" in failures(outcome("dl06", (PLANT, tenth), config=config))


@pytest.mark.parametrize("vendor", VENDORS)
@pytest.mark.parametrize("text", ["min({}, 30)", "max(0, min({}, hand))"])
def test_a_limit_outside_the_plc_is_no_selector(vendor, text):
    limited = ("{model:", f"{{input: '{text.format(f'TANK.{OUTPUTS[vendor]}')}', model:")
    signals = ("plants:", "signals: {hand: 30}\nplants:")
    assert "saturated" in failures(outcome(vendor, limited, signals))


SELECTED = """\
blocks:
  - {name: SEL, type: ControlSelectMin, MV1: TANK.MV, MV2: OTHER}
  - {name: LAST, type: ControlSelectMin, MV1: SEL.MV, MV2: 100.0}
loops:"""


@pytest.mark.parametrize("wires", ["", "    OVERR: SEL.OVERR1\n    TRK_VAL: SEL.MV\n"])
def test_a_selector_of_an_output_and_a_constant_is_a_limit(wires):
    config = [("loops:", SELECTED.replace("OTHER", "30.0")), ("    TRK_IN", f"{wires}    TRK_IN")]
    found = failures(outcome("nextopid", ("{model:", "{input: LAST.MV, model:"), config=config))
    assert found == {"error-stands" if wires else "saturated"}


def test_an_override_input_without_a_selector_leaves_nothing_out():
    found = outcome("nextopid", WEAK, config=[("Kp: ", "OVERR: true\n    TRK_VAL: -500\n    Kp: ")])
    assert failures(found) == {"saturated"}


@pytest.mark.parametrize("after", [False, True])
def test_a_selector_that_takes_another_loop_leaves_out_the_first(after):
    blocks = SELECTED.replace("OTHER", "LEAN.MV")
    if after:
        blocks = SELECTED.replace("OTHER", "100.0").replace("MV2: 100.0}\nloops", "MV2: LEAN.MV}\nloops")
    text = SIDES["nextopid"].config
    lean = text[text.index("  - name") :].replace("TANK", "LEAN").replace("60.0", "30.0")
    config = [("loops:", blocks), ("    TRK_IN: Hold\n", f"    TRK_IN: Hold\n{lean}")]
    plants = (
        "  TANK:",
        "  LEAN: {model: first_order, input: LAST.MV, gain: 1, time_constant: 10, initial: 20}\n  TANK:",
    )
    result = outcome(
        "nextopid",
        plants,
        ("{model: first_order, gain: 1, load", "{model: first_order, input: LAST.MV, gain: 1, load"),
        config=config,
    )
    assert failures(result) == set()
    assert verdict(result, "saturated").text == "a selector leaves its output out"


@pytest.mark.parametrize(
    ("taken", "is_left_out"),
    [
        ("min(TANK.OUT, LEAN.OUT)", True),
        ("LEAN.OUT", True),
        ("TANK.OUT", False),
        ("min(TANK.OUT + LEAN.OUT, 200)", False),
        ("max(TANK.OUT, LEAN.OUT)", False),
    ],
)
def test_an_output_is_left_out_where_every_plant_takes_a_smaller_one(taken, is_left_out):
    text = SIDES["generic"].config
    lean = text[text.index("  - name") :].replace("TANK", "LEAN").replace("value: 60", "value: 30")
    plant = "model: first_order, gain: 1, load: 20, time_constant: 20, initial: 40"
    plants = (
        f"plants:\n  - {{name: one, input: 'min(TANK.OUT, LEAN.OUT)', {plant}}}\n"
        f"  - {{name: two, input: '{taken}', {plant}}}\nconnect: {{TANK.PV: one, LEAN.PV: two}}\n"
    )
    result = outcome("generic", (PLANT, plants), config=[("loops:", f"loops:\n{lean}")])
    assert (verdict(result, "saturated").text == "a selector leaves its output out") == is_left_out


def heat_and_cool(heat, cool, *edits):
    """A tank that is heated to one set point and cooled to another, with its report."""
    loop = CASCADE.replace("FLOW", "COOL").replace("mode: cascade", "mode: auto").replace("direct", "reverse")
    loop = loop.replace("    cascade_from: TANK\n", "").replace("value: 30", f"value: {cool}")
    set_point = ("setpoint: {value: 60}", f"setpoint: {{value: {heat}}}")
    config = [set_point, ("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{loop}")]
    water = (
        "plants:\n  - {name: water, model: first_order, input: TANK.OUT - COOL.OUT, gain: 1, load: 20, "
        "time_constant: 20, dead_time: 1, initial: 40}\nconnect: {TANK.PV: water, COOL.PV: water}\n"
    )
    return outcome("dl06", (PLANT, water), ("setpoint: 65", f"setpoint: {heat}"), *edits, config=config)


def test_full_heat_against_a_cooler_is_saturated():
    assert failures(heat_and_cool(70, 60)) == {"saturated"}
    assert failures(heat_and_cool(60, 70)) == set()
    assert failures(heat_and_cool(60, 65, ("load: 20", "load: 80"))) == set(), "the cooler has the PV, no heat"


def test_loops_that_work_against_each_other_are_named():
    result = heat_and_cool(65, 64)
    assert verdict(result, "saturated", "COOL").text == "TANK works against it: both move one PV, with opposite effects"
    assert [verdict(result, "saturated", name).verdict for name in ("TANK", "COOL")] == ["not-proven"] * 2


def test_a_slave_may_lag_behind_a_set_point_that_moves():
    steps = "".join(f"  - {{at: {at}, loop: TANK, set: {{setpoint: {at / 5 + 30}}}}}\n" for at in range(90, 200, 2))
    found = verdict(outcome("dl06", more=steps), "error-stands")
    assert found.passed


# --- modes -----------------------------------------------------------------------------------------------------------


def test_a_loop_that_is_refused_auto_for_the_whole_run_fails():
    result = outcome("dl06", config=[LOW_ALARM])
    assert failures(result) == {"not-in-mode"}
    found = verdict(result, "not-in-mode")
    assert (found.text, found.at) == ("is meant for auto and stays in manual: refused: a PV alarm is active", 0.0)
    others = {v.kind: v.text for v in result.report.standing if not v.is_judged}
    kinds = ("pv-not-driven", "saturated", "error-stands", "oscillates", "not-settled", "no-better")
    assert others == dict.fromkeys(kinds, "in manual from start to end")
    assert result.report.loops["TANK"].metrics["iae"] is None


@pytest.mark.parametrize("vendor", ["dl06", "click", "ezlogix", "generic"])
def test_a_loop_that_is_meant_for_manual_is_judged_by_its_alarms_and_its_range(vendor):
    result = outcome(
        vendor,
        (PLANT, ""),
        (EVENT, ""),
        config=[("mode: auto", "mode: manual")] if vendor != "generic" else [("    pv:", "    mode: manual\n    pv:")],
    )
    assert {v.kind for v in result.report.standing if v.is_judged and v.loop} == {
        "set-up-error",
        "out-of-range",
        "alarm-stands",
    }
    assert failures(result) == unproven(result) == set()
    assert result.report.loops["TANK"].verdict == "not-judged"


@pytest.mark.parametrize(
    ("vendor", "key"), [("nextopid", "Manual: true"), ("dpide", "PID_MAN: true"), ("dpide", "PID_RUN: false")]
)
def test_parameters_say_that_a_loop_is_meant_for_manual(vendor, key):
    first = {"nextopid": "    SP:", "dpide": "    SV:"}[vendor]
    result = outcome(vendor, (PLANT, ""), (EVENT, ""), config=[(first, f"    {key}\n{first}")])
    assert verdict(result, "not-in-mode").text == "is meant for manual"
    assert failures(result) == set()


@pytest.mark.parametrize("vendor", VENDORS)
def test_an_operator_may_take_a_loop_out_of_auto(vendor):
    result = outcome(vendor, more="  - {at: 150, loop: TANK, mode: manual}\n")
    assert result.passed
    assert verdict(result, "not-in-mode").passed
    metrics = result.report.loops["TANK"]
    assert metrics.metrics["final_error"] is None
    assert 149 < metrics.time_in_control < 151


def test_a_request_that_is_refused_fails_though_an_earlier_one_was_granted():
    more = "  - {at: 100, loop: TANK, mode: manual}\n  - {at: 150, loop: TANK, mode: auto}\n"
    alarm = ("    output:", "    alarms: {pv: {low_low: 1, low: 2, high: 62, high_high: 95}}\n    output:")
    result = outcome("dl06", config=[alarm], more=more)
    assert failures(result) == {"not-in-mode"}
    assert verdict(result, "not-in-mode").text.startswith("is meant for auto and stays in manual: refused")
    given_up = outcome("dl06", config=[alarm], more=f"{more}  - {{at: 180, loop: TANK, mode: manual}}\n")
    assert verdict(given_up, "not-in-mode").text.startswith("does not come into its mode until 180 s")


def test_a_loop_that_loses_its_mode_by_itself_fails():
    crossed = "  - {at: 120, loop: TANK, set: {alarms.deviation.yellow: 20}}\n"
    result = outcome("dl06", config=[SIDES["dl06"].alarms], more=crossed)
    assert result.passed, "an alarm limit is read when the alarm is switched on"
    more = f"{crossed}  - {{at: 130, plc: program}}\n  - {{at: 131, plc: run}}\n"
    result = outcome("dl06", ("initial: 40", "initial: 60"), config=[SIDES["dl06"].alarms], more=more)
    assert failures(result) == {"set-up-error"}, "the switch of the CPU is an event that takes modes away"


def test_an_event_long_before_explains_nothing():
    tuned = "  - {at: 90, loop: TANK, autotune: cancel}\n  - {at: 150, loop: TANK, set: {sample_rate: 50 ms}}\n"
    found = verdict(outcome("click", more=tuned), "not-in-mode")
    assert (found.passed, found.is_judged) == (False, True)
    just_before = tuned.replace("at: 90", "at: 149")
    assert not verdict(outcome("click", more=just_before), "not-in-mode").is_judged


@pytest.mark.parametrize("vendor", ["dl06", "click"])
def test_a_stop_of_the_plc_says_why_a_loop_is_in_manual(vendor):
    word = {"dl06": "program"}.get(vendor, "stop")
    found = verdict(outcome(vendor, more=f"  - {{at: 150, plc: {word}}}\n"), "not-in-mode")
    assert (found.passed, found.is_judged) == (True, False)
    assert f"the event at 150 s, PLC to {word} mode" in found.text


def test_a_signal_of_the_program_says_why_a_loop_tracks():
    wired = ("    TRK_IN: Hold\n", "    TRK_IN: Hold\n    TRK_VAL: 30.0\n")
    found = verdict(outcome("nextopid", config=[wired], more="  - {at: 150, set: {Hold: true}}\n"), "not-in-mode")
    assert (found.passed, found.is_judged) == (True, False)
    result = outcome("nextopid", config=[wired, ("Hold: false", "Hold: true")])
    assert failures(result) == {"not-in-mode"}


def test_an_expectation_on_its_mode_says_so_too():
    slow = "  - {at: 120, loop: TANK, set: {sample_rate: 50 ms}}\n"
    assert verdict(outcome("click", more=slow), "not-in-mode").text.startswith("is meant for auto and ends in manual")
    found = verdict(outcome("click", more=f"{slow}expect:\n  - {{loop: TANK, mode: manual}}\n"), "not-in-mode")
    assert (found.passed, found.is_judged) == (True, False)
    assert found.text.endswith("an expectation names manual")


CASCADE = """\
  - name: FLOW
    mode: cascade
    sample_rate: 0.5
    action: direct
    bumpless: II
    tuning: {gain: 1.00, reset: 5.0, rate: 0}
    pv: {range: [0, 100]}
    setpoint: {value: 30}
    output: {range: [0, 100]}
    cascade_from: TANK
"""
SLAVE = (
    PLANT,
    PLANT.replace("  TANK: {", "  FLOW: {model: first_order, gain: 1, time_constant: 1}\n  TANK: {input: FLOW.PV, "),
)


def cascade(*edits, more="", config=()):
    return outcome(
        "dl06",
        SLAVE,
        *edits,
        config=[("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{CASCADE}"), *config],
        more=more,
    )


def test_a_cascade_is_judged_loop_by_loop():
    assert cascade().passed
    result = cascade(more="  - {at: 150, loop: FLOW, mode: auto}\n")
    assert result.passed
    found = verdict(result, "not-in-mode")
    assert not found.is_judged
    assert "the event at 150 s on FLOW" in found.text
    alone = cascade(config=[("mode: cascade", "mode: auto")])
    assert failures(alone) == {"not-in-mode"}, "a master needs its slave in Cascade"


def test_a_master_ends_at_the_limit_of_its_slave():
    result = cascade(WEAK)
    assert not verdict(result, "saturated").passed
    assert failures(cascade(("gain: 1, time_constant: 1}", "gain: 0.4, time_constant: 1}"))) == {"saturated"}


def test_a_windup_input_is_as_good_as_the_slave_that_it_comes_from():
    folder = Path(__file__).parents[1] / "examples/nextopid"
    scenario = (folder / "cascade.scenario.yaml").read_text("utf-8")
    scenario = scenario[: scenario.index("  - {at: 2000,")]
    files = {"cascade.yaml": (folder / "cascade.yaml").read_text("utf-8")}
    result = simulate(scenario, name="s.yaml", files=files)
    assert {v.loop for v in result.report.standing if v.fails and v.kind == "saturated"} == {"FIC_3"}
    assert verdict(result, "saturated", "TIC_2").text == "its windup input is on"
    follows = ("SP_CASC: TIC_2.MV", "SP_CASC: min(TIC_2.MV, 20)")
    files["cascade.yaml"] = files["cascade.yaml"].replace(*follows)
    result = simulate(scenario.replace("gain: 0.3}", "gain: 1.0}"), name="s.yaml", files=files)
    assert "TIC_2" in {v.loop for v in result.report.standing if v.fails and v.kind == "saturated"}


# --- errors of the set-up --------------------------------------------------------------------------------------------


def test_a_set_up_that_the_cpu_refuses_fails_once():
    result = outcome("dl06", more="plc: {number_of_loops: 9}\n")
    assert [(v.loop, v.kind, v.text) for v in result.report.standing if v.fails] == [
        ("", "set-up-error", "V7642 = 0x0004")
    ]
    assert verdict(result, "not-in-mode").text == "V7642 keeps the loop task off"
    assert [f.plc_effect for f in result.findings if f.code == "PID059"] == ["V7642 bit 2"]
    expected = outcome("dl06", more="plc: {number_of_loops: 9}\nexpect:\n  - {flag: V7642, is: 0x0004}\n")
    assert expected.passed
    assert {v.text for v in expected.report.standing} == {"V7642 is expected"}


def test_no_loop_task_without_an_error_fails_by_its_modes():
    assert failures(outcome("dl06", more="plc: {number_of_loops: 0}\n")) == {"not-in-mode"}


ALARM_ORDER = ("    output:", "    alarms: {deviation: {yellow: 5, red: 2}}\n    output:")


def test_an_alarm_programming_error_fails_unless_it_is_expected():
    result = outcome("dl06", config=[ALARM_ORDER])
    assert failures(result) == {"not-in-mode", "set-up-error"}
    assert verdict(result, "set-up-error").text == "alarm_programming_error"
    for expected in ("flag: alarm_programming_error", "mode: {never: auto}"):
        result = outcome("dl06", config=[ALARM_ORDER], more=f"expect:\n  - {{loop: TANK, {expected}}}\n")
        assert failures(result) == set(), expected
        assert result.report.passed
    not_so = outcome(
        "dl06", config=[ALARM_ORDER], more="expect:\n  - {loop: TANK, flag: alarm_programming_error, is: false}\n"
    )
    assert failures(not_so) == {"not-in-mode", "set-up-error"}


def test_an_error_that_is_expected_of_one_loop_excuses_its_cascade():
    broken = CASCADE.replace("    output:", "    alarms: {deviation: {yellow: 5, red: 2}}\n    output:")
    edit = ("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{broken}")
    result = outcome("dl06", SLAVE, config=[edit])
    assert {(v.loop, v.kind) for v in result.report.standing if v.fails} == {
        ("TANK", "not-in-mode"),
        ("FLOW", "not-in-mode"),
        ("FLOW", "set-up-error"),
    }
    result = outcome("dl06", SLAVE, config=[edit], more="expect:\n  - {loop: FLOW, flag: alarm_programming_error}\n")
    assert failures(result) == set()


def test_a_ramp_soak_table_out_of_memory_is_an_error_of_the_set_up():
    table = "    ramp_soak: {table: V7000, steps: [{ramp_to: 65, slope: 1, soak: 1}]}\n"
    edit = ("    output:", f"{table}    output:")
    start = "  - {at: 10, loop: TANK, ramp_soak: start}\n"
    assert failures(outcome("dl06", config=[edit], more=start)) == set()
    outside = (edit[0], edit[1].replace("V7000", "V7700"))
    found = verdict(outcome("dl06", config=[outside], more=start), "set-up-error")
    assert found.text.startswith("ramp/soak programming error, +35 = 0x")


def test_a_pid_error_of_a_click_is_an_error_of_the_set_up():
    result = outcome("click", more="  - {at: 120, loop: TANK, set: {sample_rate: 50 ms}}\n")
    assert {"set-up-error", "not-in-mode"} <= failures(result)
    assert verdict(result, "set-up-error").text == "pid_error, DS101 = 10"


def test_error_bits_of_a_nextopid_are_errors_of_the_set_up():
    result = outcome("nextopid", more="  - {at: 120, loop: TANK, set: {Ti_Ki: -1}}\n")
    assert verdict(result, "set-up-error").text == "ErrBits.Ti_Ki"
    block = (
        "signals:",
        "blocks:\n  - {name: SPLIT, type: ControlSplitRange, MV: TANK.MV, SPLIT: 200, Mode: 4}\nsignals:",
    )
    found = verdict(outcome("nextopid", config=[block]), "set-up-error", "")
    assert found.text == "SPLIT.Error is on"


ON_OFF = """\
pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.5}
loops:
  - {name: TANK, type: ControlON_OFF, SP: 60.0, DeadBand: 2.0, MinPV: 0.0, MaxPV: 100.0}
"""


@pytest.mark.parametrize(
    ("edit", "name"), [("MaxPV: 0", "ErrBits.MaxMinPV"), ("DeadBand: -1", "ErrBits.DeadBand"), ("DeadBand: 1", "")]
)
def test_error_bits_of_an_on_off_block_have_its_own_names(edit, name):
    plant = PLANT.replace("gain: 1,", "gain: 1, input: TANK.MV * 100,")
    text = SCENARIO.replace(PLANT, plant).replace("set: {setpoint: 65}", f"set: {{{edit}}}")
    result = simulate(text, name="tank.scenario.yaml", files={"tank.yaml": ON_OFF})
    assert verdict(result, "set-up-error").text == (name or "no error of the set-up")
    flags = result.report.loops["TANK"].flags
    assert [flag for flag, on in flags.items() if on] == ([name] if name else [])


def test_an_error_of_a_block_that_was_corrected_is_still_one():
    block = (
        "signals: {",
        (
            "blocks:\n  - {name: SPLIT, type: ControlSplitRange, MV: TANK.MV, SPLIT: Share, Mode: 4}\n"
            "signals: {Share: 50, "
        ),
    )
    assert outcome("nextopid", config=[block]).passed
    there_and_back = "  - {at: 20, set: {Share: 200}}\n  - {at: 21, set: {Share: 50}}\n"
    found = verdict(outcome("nextopid", config=[block], more=there_and_back), "set-up-error", "")
    assert (found.passed, found.text) == (False, "SPLIT.Error was on")


# --- words that are no value -----------------------------------------------------------------------------------------

PROFILE = ("    output:", "    ramp_soak: {table: V7000, steps: [{ramp_to: 65, slope: 1, soak: 1}]}\n    output:")


def run_of_listing(*words, config=()):
    """The run of a DL06's listing with some of its words replaced."""
    text = SIDES["dl06"].config
    for old, new in config:
        text = text.replace(old, new)
    listing = encode(text, format="text").text
    for address, word in words:
        listing, count = re.subn(rf"(?m)^{address} +[0-9A-F]+ +\d+", f"{address} {word} {int(word, 16)}", listing)
        assert count == 1, address
    scenario = SCENARIO.replace("tank.yaml", "tank.txt")
    return simulate(scenario, name="tank.scenario.yaml", files={"tank.txt": listing})


@pytest.mark.parametrize(
    ("word", "text"),
    [
        (("V2013", "9000"), "+13 PV low-low alarm: "),
        (
            ("V2024", "00A0"),
            "+24 PV low-pass filter constant: 0x00A0 has a digit above 9; it is 160 (typed in decimal? ",
        ),
        (
            ("V2025", "000F"),
            "+25 Derivative gain limit: 0x000F has a digit above 9; it is 15 (typed in decimal? ",
        ),
        (("V7001", "00A0"), "ramp/soak table +01 "),
        (("V7036", "0A00"), "ramp/soak table +36 "),
        (("V2005", "9000"), ""),
    ],
)
def test_a_setting_that_is_no_value_is_an_error_of_the_set_up(word, text):
    """Whether its function is on or off; a word that the PLC writes itself is only told."""
    result = run_of_listing(word, config=[PROFILE])
    found = verdict(result, "set-up-error")
    notes = [note.text for note in result.report.notes if note.text.startswith("word without a value")]
    assert len(notes) == 1
    assert found.passed == (not text)
    assert found.passed or found.text.startswith(text)


def test_a_ramp_soak_table_that_is_not_enabled_is_nobodys():
    off = (PROFILE[0], PROFILE[1].replace("steps:", "enabled: false, steps:"))
    assert failures(run_of_listing(("V7001", "00A0"), config=[off])) == set()
    assert failures(run_of_listing(("V7001", "00A0"), config=[PROFILE])) == {"set-up-error"}


def test_a_ramp_soak_error_that_was_corrected_is_still_one():
    table = "    ramp_soak: {table: V7700, steps: [{ramp_to: 65, slope: 1, soak: 1}]}\n"
    events = (
        "  - {at: 10, loop: TANK, ramp_soak: start}\n  - {at: 20, loop: TANK, set: {ramp_soak.table: V7000}}\n"
        "  - {at: 30, plc: program}\n  - {at: 31, plc: run}\n  - {at: 40, loop: TANK, ramp_soak: start}\n"
    )
    result = outcome("dl06", config=[("    output:", f"{table}    output:")], more=events)
    assert verdict(result, "set-up-error").text.startswith("ramp/soak programming error, +35 = 0x")


@pytest.mark.parametrize("ti", ["Ti_Ki: 0.0005", "Ti_Ki: 0.0"])
def test_an_integral_time_below_a_millisecond_is_none(ti):
    """An offset below 2 % of span is then what was configured."""
    config = [("Kp: 2.0", "Kp: 15.0"), ("Ti_Ki: 20.0", ti), ("TRK_IN: Hold", "TRK_IN: Hold\n    BIAS: 20.0")]
    result = outcome("nextopid", ("dead_time: 1", "dead_time: 0"), config=config)
    assert 1 < abs(result.report.loops["TANK"].metrics["final_error"]) < 2
    assert verdict(result, "error-stands").passed


# --- what a scenario may say -----------------------------------------------------------------------------------------


def test_what_is_allowed_is_shown_as_not_passed_and_does_not_fail_the_run():
    allow = "allow:\n  - {kind: saturated, loop: TANK, reason: the heater is on loan}\n"
    result = outcome("dl06", WEAK, more=allow)
    found = verdict(result, "saturated")
    assert result.passed
    assert (found.passed, found.is_judged, found.allowed) == (False, True, "the heater is on loan")
    assert result.report.loops["TANK"].verdict == "not-judged"
    line = "passed: 0 of 0 expectations, 8 of 11 always checked, 3 allowed"
    assert verdict_line(result.outcome, result.report) == line


def test_an_entry_that_allows_nothing_is_a_warning():
    result = outcome("dl06", more="allow:\n  - {kind: saturated, loop: TANK, reason: of old}\n")
    assert result.passed
    (found,) = result.findings
    assert (found.code, found.severity.label, found.span.line, found.loop) == ("PID064", "warning", 11, "TANK")


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("allow: [{kind: saturated, loop: TANKS, reason: x}]", "PID050", "'TANKS' is no loop"),
        ("allow: [{kind: saturated, loop: TANK}]", "PID021", "reason"),
        ("allow: [{kind: saturated, loop: TANK, reason: ' '}]", "PID053", "the reason is empty"),
        ("allow: [{kind: saturation, loop: TANK, reason: x}]", "PID027", "saturation"),
        ("tolerance: {TANKS: 3}", "PID050", "'TANKS' is no loop"),
        ("tolerance: {TANK: 0}", "PID053", "is 0; it must be above 0"),
        ("tolerance: {TANK: 100 %}", "PID053", "a tolerance of 100 % passes whatever the PV of TANK does"),
        ("tolerance: {TANK: 1e9}", "PID053", "a tolerance of 1000000000 passes whatever the PV of TANK does"),
        ("loops: [TANKS]", "PID050", "'TANKS' is no loop"),
        ("loops: []", "PID053", "no loop is judged"),
        ("expect: [{loop: TANK, mode: {never: autom}}]", "PID050", "'autom' is no mode"),
        ("expect: [{loop: TANK, mode: {not: auto}}]", "PID022", "a mode is wanted"),
        ("expect: [{loop: TANK, mode: {never: auto}, at: 5}]", "PID052", "has no time"),
    ],
)
def test_bad_input_is_an_error_at_its_line(text, code, message):
    result = outcome("dl06", more=f"{text}\n")
    assert result.report is None
    (found,) = [d for d in result.findings if d.severity.label == "error"]
    assert (found.code, found.span.line) == (code, 10)
    assert message in found.message


@pytest.mark.parametrize(
    ("duration", "message"),
    [
        ("0", "must be above 0 s"),
        ("300 ms", "shorter than a sample of the slowest loop, 0.5 s"),
        ("500 ms", "0.500 s are shorter than 10 samples of any loop, 5 s"),
        ("4.9", "4.9 s are shorter than 10 samples of any loop, 5 s"),
    ],
)
def test_a_run_that_cannot_be_judged_is_an_error_at_its_line(duration, message):
    result = outcome("dl06", ("duration: 200", f"duration: {duration}"))
    assert result.report is None
    found = next(d for d in result.findings if d.severity.label == "error")
    assert (found.span.line, found.code) == (4, "PID053")
    assert message in found.message


@pytest.mark.parametrize("vendor", VENDORS)
def test_a_run_of_one_sample_is_no_proof(vendor):
    assert outcome(vendor, ("duration: 200", "duration: 0.5")).report is None
    assert outcome(vendor, ("duration: 200", "duration: 5")).report is not None


def test_loops_that_are_left_out_are_named():
    two = (
        SLAVE[1]
        .replace("  FLOW: {model: first_order, gain: 1, time_constant: 1}\n", "")
        .replace("input: FLOW.PV, ", "")
    )
    flow = CASCADE.replace("mode: cascade", "mode: auto").replace("    cascade_from: TANK\n", "")
    config = [("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{flow}")]
    assert failures(outcome("dl06", (PLANT, two), config=config)) >= {"pv-not-driven"}
    result = outcome("dl06", (PLANT, two), config=config, more="loops: [TANK]\n")
    assert result.passed
    assert {v.text for v in result.report.standing if v.loop == "FLOW"} == {"the scenario's loops leave it out"}


def test_a_mode_that_must_not_come():
    expected = "expect:\n  - {loop: TANK, mode: {never: auto}}\n"
    came = outcome("dl06", more=expected).report.expectations[0]
    assert (came.text, came.passed, came.value) == ("TANK mode is never auto", False, "auto")
    kept = outcome("dl06", config=[LOW_ALARM], more=expected)
    assert kept.report.expectations[0].passed
    assert kept.passed


@pytest.mark.parametrize("metric", ["overshoot", "settling_time", "rise_time", "iae", "ise", "itae", "final_error"])
def test_nothing_measured_fails_whatever_was_expected(metric):
    expected = f"expect:\n  - {{loop: TANK, metric: {metric}, max: 1000000}}\n"
    found = outcome("dl06", config=[LOW_ALARM], more=expected).report.expectations[0]
    assert (found.passed, found.value) == (False, None)
    assert "nothing was measured" in found.text
    assert outcome("dl06", more=expected).report.expectations[0].passed


@pytest.mark.parametrize("vendor", VENDORS)
def test_overshoot_counts_only_where_the_output_moves_the_pv(vendor):
    expected = "expect:\n  - {loop: TANK, metric: overshoot, max: 100 %}\n"
    assert outcome(vendor, more=expected).passed
    assert not outcome(vendor, (PLANT, ""), more=expected).report.expectations[0].passed


def test_a_signal_that_the_set_point_reads_makes_a_step():
    config = [("signals: {Hold: false}", "signals: {Hold: false, Target: 60.0}"), ("SP: 60.0", "SP: Target")]
    result = outcome("nextopid", ("loop: TANK, set: {setpoint: 65}", "set: {Target: 65}"), config=config)
    assert result.report.loops["TANK"].metrics["overshoot"] is not None
    other = outcome("nextopid", ("loop: TANK, set: {setpoint: 65}", "set: {Hold: false}"))
    assert other.report.loops["TANK"].metrics["overshoot"] is None


def test_opposite_loops_on_one_pv_share_its_range():
    cool = (
        CASCADE.replace("FLOW", "COOL")
        .replace("mode: cascade", "mode: auto")
        .replace("action: direct", "action: reverse")
    )
    cool = cool.replace("    cascade_from: TANK\n", "").replace("value: 30", "value: 61")
    config = [("    output: {range: [0, 100]}\n", f"    output: {{range: [0, 100]}}\n{cool}")]
    water = (
        "plants:\n  - {name: water, model: first_order, input: TANK.OUT - COOL.OUT, gain: 1, load: 20, "
        "time_constant: 20, dead_time: 1, initial: 40}\nconnect: {TANK.PV: water, COOL.PV: water}\n"
    )
    plant = (PLANT, water)
    result = outcome("dl06", plant, ("setpoint: 65", "setpoint: 50"), config=config)
    assert result.passed, [v for v in result.report.standing if v.fails]


# --- formats ---------------------------------------------------------------------------------------------------------


def test_every_format_names_what_fails():
    result = outcome("dl06", WEAK)
    outcomes = [result.outcome]
    message = "saturated: TANK: ends at its upper output limit with an error of 15.02, which was 15.02 from 180 s on"
    text = render_runs("text", outcomes)
    assert "  FAILED      TANK saturated    ends at its upper output limit" in text
    assert "  NOT PROVEN  TANK not-settled  is 15.02 away from its set point" in text
    assert text.rstrip().endswith("FAILED: 1 of 11 always checked, 2 not proven")
    data = json.loads(render_runs("json", outcomes))
    assert data["passed"] is False
    assert [v["kind"] for v in data["standing"] if v["verdict"] == "not-proven"] == ["not-settled", "no-better"]
    assert data["loops"]["TANK"]["verdict"] == "failed"
    assert data["loops"]["TANK"]["missing"] == message[17:]
    assert [v for v in data["standing"] if v["verdict"] == "failed"] == [
        {
            "kind": "saturated",
            "loop": "TANK",
            "passed": False,
            "judged": True,
            "verdict": "failed",
            "at": 180.0,
            "text": message[17:],
            "allowed": None,
        }
    ]
    junit = render_runs("junit", outcomes)
    assert 'tests="12" failures="3"' in junit
    assert junit.count('type="failed"') == 1
    assert junit.count('type="not-proven"') == 2
    assert 'name="TANK saturated"' in junit
    sarif = json.loads(render_runs("sarif", outcomes))["runs"][0]["results"]
    assert [(r["ruleId"], r["level"]) for r in sarif] == [("PID063", "error")] * 3
    place = sarif[0]["locations"][0]["physicalLocation"]
    assert (place["artifactLocation"]["uri"], place["region"]["startLine"]) == ("tank.yaml", 5)
    assert "file=tank.yaml,line=5" in render_runs("github", outcomes)
    assert message in render_runs("github", outcomes)
    assert json.loads(render_runs("gitlab", outcomes))[0]["location"]["lines"]["begin"] == 5
    assert result.to_json() == data


def test_what_is_allowed_or_not_judged_is_skipped_in_junit():
    allow = "allow:\n  - {kind: saturated, loop: TANK, reason: on loan}\n"
    junit = render_runs("junit", [outcome("dl06", WEAK, more=allow).outcome])
    assert '<skipped message="failed, and allowed: on loan" />' in junit
    assert 'failures="0"' in junit
    junit = render_runs("junit", [outcome("dl06", more="  - {at: 100, loop: TANK, pv: 55, for: 300}\n").outcome])
    assert "an event has broken its sensor" in junit
    assert 'skipped="4"' in junit


# --- meters ----------------------------------------------------------------------------------------------------------


def swung(pvs, least=1.0):
    """The meter of a PV in Auto, looked at from its first value on."""
    m = Meter(0, 1, 2, control_bits=2, last_third=0, min_swing=least)
    change_status(0, m, 2, 0)
    for k, pv in enumerate(pvs):
        watch_swings(k, m, pv)
    return m, len(pvs) - 1


@given(
    period=st.integers(8, 200),
    amplitude=st.floats(0.6, 1e3),
    phase=st.floats(0, 6),
    periods=st.floats(5, 12),
)
def test_a_sine_has_its_period_and_amplitude(period, amplitude, phase, periods):
    pvs = [amplitude * math.sin(2 * math.pi * k / period + phase) for k in range(int(period * periods))]
    swings = oscillation(*swung(pvs))
    assert swings is not None
    assert abs(swings[0] - period) <= 1
    assert 0.9 * amplitude <= swings[1] <= amplitude * (1 + 1e-9)


@given(period=st.integers(10, 100), periods=st.floats(0.5, 3))
def test_fewer_than_three_periods_are_no_oscillation(period, periods):
    assert oscillation(*swung([9 * math.sin(2 * math.pi * k / period) for k in range(int(period * periods))])) is None


def test_an_oscillation_must_be_sustained_large_and_last_to_the_end():
    wave = [math.sin(k / 5) for k in range(400)]
    assert oscillation(*swung([10 * y for y in wave]))
    assert oscillation(*swung([10 * y * 0.998**k for k, y in enumerate(wave)])) is None, "it dies away"
    assert oscillation(*swung([10 * y for y in wave], least=21.0)) is None, "it is smaller than what counts"
    assert oscillation(*swung([10 * y for y in wave[:250]] + [0.0] * 150)) is None, "it has ended"
    assert oscillation(*swung([10 * y * 1.002**k for k, y in enumerate(wave)])), "it grows"


def growing(factor, halves, period=20):
    """Swings that grow by ``factor`` each; the last one is over."""
    return [factor ** (2 * k / period) * math.sin(2 * math.pi * k / period) for k in range(int(period * halves / 2))]


def test_an_oscillation_that_grows_needs_no_three_periods():
    waves = [10 * y for y in growing(1.3, 7.2)]
    assert oscillation(*swung(waves)) is None, "three periods after the first turning point are not over"
    assert calm_oscillation(*swung(waves))
    assert calm_oscillation(*swung([10 * y for y in growing(1.04, 7.2)])) is None, "it hardly grows"
    assert calm_oscillation(*swung([10 * y for y in growing(1.3, 4)])) is None, "it may only begin so"
    assert calm_oscillation(*swung([*waves, *(10 * y for y in reversed(growing(1.3, 7.2)))])) is None, "it dies away"
    assert calm_oscillation(*swung(waves + [0.0] * 60)) is None, "it has ended"


statuses = st.lists(st.tuples(st.integers(1, 9), st.sampled_from([1, 2, 2 | 8, 1 | 8])), min_size=1, max_size=30)


@given(statuses)
def test_times_are_what_counting_each_base_step_gives(changes):
    m = Meter(0, 1, 2, control_bits=2, outer_bits=8)
    k, status, control, alarm, armed = 0, 0, 0, 0, False
    for steps, new in changes:
        armed = (armed and bool(status & 2)) or not new & 8
        if new != status:
            status = new
            change_status(k, m, status, 0)
        control += steps * bool(status & 2)
        alarm += steps * (armed and status & 10 == 10)
        k += steps
    assert (time_in_control(m, k), time_in_alarm(m, k)) == (control, alarm)


def test_an_alarm_of_the_pv_counts_in_manual_too_once_it_has_gone():
    m = Meter(0, 1, 2, control_bits=2, outer_bits=24, level_bits=8)
    for k, status in enumerate((1 | 8, 1, 1 | 16, 1 | 8)):
        change_status(10 * k, m, status, 0)
    assert (time_in_alarm(m, 35), m.past_alarms) == (5, 8)


def test_a_wanted_mode_is_missed_when_another_is_wanted_before_it_came():
    m = Meter(0, 1, 2, control_bits=6)
    want_mode(m, 0, 2, 5)
    change_status(0, m, 1, 0)
    want_mode(m, 5, 4, 5)
    assert m.missed_at == -1, "it had no time"
    want_mode(m, 11, 1, 5)
    assert (m.missed_at, m.wanted_bits) == (11, 0)


def test_a_mode_that_an_event_changes_at_once_is_not_missed():
    at_once = "  - {at: 0, loop: FLOW, mode: auto}\n  - {at: 0, loop: TANK, mode: manual}\n"
    assert verdict(cascade(more=at_once), "not-in-mode", "FLOW").passed


@pytest.mark.parametrize("vendor", ["dl06", "generic"])
def test_a_mode_that_a_loop_is_not_meant_for_excuses_nothing(vendor):
    full = ("load: 20", "load: -70")
    assert "saturated" in failures(outcome(vendor, full))
    expected = "expect:\n  - {loop: TANK, mode: {never: cascade}}\n"
    result = outcome(vendor, full, more=expected)
    assert result.report.expectations[0].passed
    assert "saturated" in failures(result)


def test_a_loop_that_shall_never_be_in_the_mode_it_is_meant_for_is_judged_by_the_rest():
    """A master that is missing keeps it from Cascade, as the expectation says."""
    asked = ("events:\n", "events:\n  - {at: 90, loop: TANK, mode: cascade}\n")
    assert failures(outcome("generic", asked)) == {"not-in-mode"}
    expected = "expect:\n  - {loop: TANK, mode: {never: cascade}}\n"
    assert failures(outcome("generic", asked, more=expected)) == set()
    assert failures(outcome("generic", asked, ("load: 20", "load: -70"), more=expected)) == {"saturated"}


@pytest.mark.parametrize(
    ("vendor", "alarm", "words"),
    [
        ("dl06", "deviation_red", "alarms: {deviation: {yellow: 5, red: 40}, hysteresis: 2 counts}"),
        ("click", "deviation_high_high", "alarms: {deviation: {high: 5, high_high: 40}, hysteresis: 1}"),
        ("generic", "deviation_high_high", "alarms: {deviation: {high: 5, high_high: 40}}"),
    ],
)
def test_an_alarm_that_is_off_never_comes_and_proves_nothing(vendor, alarm, words):
    expected = f"expect:\n  - {{loop: TANK, alarm: {alarm}, never: true}}\n"
    off = outcome(vendor, more=expected).report.expectations[0]
    assert (off.passed, off.text) == (False, f"TANK alarm {alarm} never (nothing was measured: the alarm is off)")
    on = outcome(vendor, more=expected, config=[("    output:", f"    {words}\n    output:")])
    assert on.report.expectations[0].passed


def test_an_alarm_that_an_event_switches_may_be_expected_never_to_come():
    event = ("events:\n", "events:\n  - {at: 90, loop: TANK, set: {alarms.pv.enabled: true}}\n")
    expected = "expect:\n  - {loop: TANK, alarm: pv_high_high, never: true, before: 80}\n"
    assert outcome("dl06", event, more=expected).report.expectations[0].passed


def test_a_run_without_a_loop_in_control_says_so():
    result = outcome("dl06", (EVENT, ""), config=[("mode: auto", "mode: manual")])
    assert result.report.passed
    assert "nothing was controlled" in verdict_line(result.outcome, result.report)
    assert "nothing was controlled" not in verdict_line(outcome("dl06").outcome, outcome("dl06").report)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(2.6842e06, 4, "2684000"), (1.2345e-5, 4, "0.00001234"), (0.0, 4, "0"), (-3.5, 4, "-3.5"),
     (5.57682e8, 6, "557682000"), (96.63, 4, "96.63"), (4096, 4, "4096"), (12345.6, 4, "12350"), (1e300, 6, "1e+300")],
)  # fmt: skip
def test_numbers_are_written_without_an_exponent(value, digits, text):
    assert number_text(value, digits) == text
