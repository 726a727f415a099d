"""What the virtual PLCs do around their equations, decision by decision, as a run shows it."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import pytest

from dl06_rig import Rig
from pidcfg.api import simulate
from pidcfg.sim.controllers.click import OPERATION_DECISIONS as CLICK
from pidcfg.sim.controllers.dl06 import OPERATION_DECISIONS as DL06
from pidcfg.sim.controllers.ezlogix import SIGNAL_DECISIONS as EZLOGIX
from pidcfg.sim.controllers.kernels import GOAL_ENDED
from pidcfg.sim.engine import recording as run_decisions

LAG = "plants:\n  L1: {model: first_order, time_constant: 10}\n"
EMPTY = "plants:\n  L1: {model: first_order, time_constant: 10, initial: 0}\n"
ALARMS = "alarms: {pv: {low_low: 10, low: 20, high: 4000, high_high: 4050}}"
MINOR = LAG + "  L2: {model: first_order, time_constant: 9, input: L1.PV}\n"
SOURCES = Path(run_decisions.__file__).parents[1]


def loop(rest="", name="L1", sample_rate=1, tuning="{gain: 0.5}"):
    """A loop of a DL06, in counts."""
    return f"{{name: {name}, sample_rate: {sample_rate}, action: direct, tuning: {tuning}{rest and ', ' + rest}}}"


def dl06(*loops):
    return "pidcfg: 1\nvendor: dl06\nplc: {loop_table: V2000}\nloops:\n" + "".join(f"  - {one}\n" for one in loops)


def click(rest):
    return f"""\
pidcfg: 1
vendor: click
loops:
  - {{name: L1, bits: C1, integers: DS1, floats: DF1, action: direct, action_verified: true, sample_rate: 5 s,
     pv: {{range: [0, 100]}}, tuning: {{proportional_gain: 1, reset_time: 100}}, {rest}}}
"""


def ezlogix(rest):
    return f"""\
pidcfg: 1
vendor: ezlogix
loops:
  - {{name: L1, registers: R1, discretes: S1, algorithm: position, action: reverse, sample_rate: 2, pv: {{tag: IR1}},
     {rest}}}
"""


def run(config, scenario, *events, duration=12, step="step: 1", engine="python"):
    """The columns of a run's trend, and its report."""
    text = f"pidcfg: 1\nscenario: s\nconfig: c.yaml\nduration: {duration}\n{step}\n{scenario}"
    text += "events:\n" + "".join(f"  - {event}\n" for event in events) if events else ""
    out = io.StringIO()
    result = simulate(text, engine=engine, trend=out, files={"c.yaml": config})
    names, *rows = csv.reader(io.StringIO(out.getvalue()))
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}, result.report


def modes(report, name="L1"):
    return [(m.at, m.mode, m.reason) for m in report.loops[name].modes]


def notes(report):
    return [(note.at, note.text) for note in report.notes]


# --- every run -------------------------------------------------------------------------------------------------------


def test_d640_changes_of_mode_within_a_base_step_are_one_entry():
    events = (
        "{at: 3, loop: L1, mode: auto}",
        "{at: 3, loop: L1, mode: manual}",
        "{at: 5, loop: L1, mode: auto}",
        "{at: 7, plc: program}",
        "{at: 7, plc: run}",
    )
    _, report = run(dl06(loop()), LAG, *events)
    both = "to Manual: the CPU went to Program mode; back to the mode before Program mode"
    assert modes(report) == [(5.0, "auto", None), (7.0, "auto", both)]


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_d641_a_loop_is_calculated_in_the_first_scan_behind_its_time(engine):
    ramp = "plants:\n  L1: {model: integrator, load: 100, initial: 0}\n"
    columns, _ = run(dl06(loop()), f"plc: {{scan_time: 0.3}}\n{ramp}", duration=4.5, step="", engine=engine)
    changes = [
        round(0.3 * k, 1)
        for k, (a, b) in enumerate(zip([-1.0, *columns["L1.PV"]], columns["L1.PV"], strict=False))
        if a != b
    ]
    assert changes == [0.0, 1.2, 2.1, 3.0, 4.2], "the first scans that are not before 0, 1, 2, 3 and 4 s"


def test_d642_a_plant_of_second_order_leaves_its_limit_at_once():
    plant = "plants:\n  L1: {model: second_order, time_constants: [2, 3], limits: [0, 1000], initial: 0}\n"
    events = "{at: 0, loop: L1, set: {output: 4000}}", "{at: 20, loop: L1, set: {output: 900}}"
    columns, _ = run(dl06(loop()), plant, *events, duration=24)
    pv = columns["L1.PV"]
    assert pv[10:21] == [1000.0] * 11
    assert 900 < pv[21] < 1000, "without a limit the plant would stand near 4000"


# --- the configured mode and set point -------------------------------------------------------------------------------

WITH_ALARM = dl06(loop(f"mode: auto, setpoint: {{value: 2000}}, {ALARMS}"))
RELEASE = "{at: 4, loop: L1, set: {output: 4000}}"


def test_d643_the_configured_set_point_is_written_a_sample_after_the_mode_is_reached():
    columns, report = run(WITH_ALARM, EMPTY, RELEASE)
    assert modes(report)[-1] == (5.0, "auto", None)
    assert columns["L1.SP"][5:8] == [columns["L1.PV"][5], 2000, 2000]


def test_d643_a_set_point_that_an_event_writes_before_takes_its_place():
    columns, report = run(WITH_ALARM, EMPTY, "{at: 2, loop: L1, set: {setpoint: 1500}}", RELEASE)
    assert columns["L1.SP"][5:8] == [columns["L1.PV"][5], 1500, 1500]
    assert notes(report) == []


@pytest.mark.parametrize("engine", ["python", "numba"])
@pytest.mark.parametrize("mode", ["cascade", "manual", "auto"])
def test_d643_a_mode_that_an_event_requests_before_ends_both_and_the_log_says_so(mode, engine):
    events = f"{{at: 2, loop: L1, mode: {mode}}}", RELEASE, "{at: 8, loop: L1, mode: auto}"
    columns, report = run(WITH_ALARM, EMPTY, *events, engine=engine)
    assert modes(report)[-1] == (8.0, "auto", None)
    assert set(columns["L1.SP"][8:]) == {columns["L1.PV"][8]}, "Bumpless I; nobody writes 2000"
    assert notes(report) == [(2.0, GOAL_ENDED)]


def test_d643_a_request_after_the_set_point_has_been_written_ends_nothing():
    _, report = run(WITH_ALARM, EMPTY, RELEASE, "{at: 8, loop: L1, mode: manual}")
    assert notes(report) == []


def test_d643_a_mode_that_was_reached_is_not_told_as_one_that_was_not():
    slow = dl06(loop("mode: auto, setpoint: {value: 2000}", sample_rate=5))
    _, report = run(slow, LAG, "{at: 3, loop: L1, mode: manual}", duration=50)
    assert modes(report)[0] == (0.0, "auto", None)
    assert notes(report) == [(3.0, GOAL_ENDED)]
    assert "not yet been in its configured mode for a sample" in GOAL_ENDED


@pytest.mark.parametrize("event", ["mode: auto", "mode: manual", "autotune: start"])
def test_d643_of_the_click(event):
    config = click("mode: auto, setpoint: {value: 50}, alarms: {hysteresis: 1}")
    events = "{at: 0, loop: L1, set: {reset_time: 0}}", f"{{at: 7, loop: L1, {event}}}"
    _, report = run(config, "plants: {L1: {model: first_order, time_constant: 20}}\n", *events, duration=60)
    assert [note for note in notes(report) if note[1] == GOAL_ENDED] == [(7.0, GOAL_ENDED)]


def test_d644_a_major_loop_waits_without_a_word_until_its_minor_loop_is_refused():
    major = loop("mode: auto", name="L2")
    _, waiting = run(dl06(loop("mode: cascade, cascade_from: L2", sample_rate=2), major), MINOR)
    assert modes(waiting, "L2") == [(2.0, "auto", None)]
    _, refused = run(dl06(loop(f"mode: cascade, cascade_from: L2, {ALARMS}", sample_rate=2), major), MINOR)
    assert modes(refused, "L1") == [(0.0, "manual", "refused: a PV alarm is active")]
    assert modes(refused, "L2") == [(0.0, "manual", "refused: the minor loop is not in Cascade")]


# --- outputs, set points, the past -----------------------------------------------------------------------------------


def test_d645_an_output_in_manual_has_no_limits_until_the_first_calculation():
    events = "{at: 3, loop: L1, set: {output: 3000}}", "{at: 6, loop: L1, mode: auto}"
    columns, _ = run(dl06(loop("output: {limits: [500, 1000]}")), LAG, *events)
    assert columns["L1.OUT"] == [0, 0, 0, 3000, 3000, 3000, *[1000] * 7]


@pytest.mark.parametrize("bumpless", [1, 2])
def test_d646_cascade_to_auto_keeps_the_past(bumpless):
    rig = Rig(base=1.0)
    minor, _ = rig.add(mode="auto", gain=1.0, reset=100.0, rate=10.0, sp=1000.0, bumpless=bumpless)
    rig.add(mode="manual", out=600.0)
    minor.major = 1
    rig.step(2)
    rig.request("cascade")
    rig.step(5)
    before, rig.states[0].sp = rig.states[0], 2000.0
    out, bias, last = before.unrounded_output, before.bias, before.derivative_input_1
    remote = rig.states[1].out
    rig.request("auto")
    rig.step()
    kp, ki, kd, span = before.kp, before.ki, before.kd, minor.span
    error = 2000.0 / span
    assert rig.states[0].status & 2
    assert last == pytest.approx(remote / span)
    bias += ki * error
    assert rig.states[0].unrounded_output == pytest.approx(
        min(max(kp * error + bias + kd * (error - last), 0.0), 4095.0)
    )
    assert rig.states[0].unrounded_output > out, "the derivative answers the change, unlike after Manual (D42)"


def test_d647_step_bias_takes_signed_counts():
    config = dl06(
        loop(
            "mode: auto, setpoint: {value: 1000}, pv: {format: 12-bit bipolar}, state: {output: 1000}",
            tuning="{gain: 0.01, reset: 999}",
        )
    )
    events = (
        "{at: 4, loop: L1, set: {setpoint: 2000}}",
        "{at: 6, loop: L1, set: {setpoint: -2000}}",
        "{at: 8, loop: L1, set: {setpoint: -1000}}",
    )
    columns, _ = run(config, "plc: {step_bias: true}\nconnect: {L1.PV: 0}\n", *events)
    assert [columns["L1.BIAS"][k] for k in (3, 5, 7, 9)] == pytest.approx([1000, 2000, 2000, 1000], abs=1)


@pytest.mark.parametrize("independent", [False, True])
def test_d648_the_change_to_run_reads_alarm_words_and_begins_filter_and_grid_anew(independent):
    rest = "pv: {filter: 0.2}, alarms: {pv: {low_low: 0, low: 10, high: 3500, high_high: 4050}}"
    config = dl06(loop(rest + f", independent_of_cpu_mode: {str(independent).lower()}", sample_rate=3))
    plants = "plants:\n  L1: {model: integrator, load: 100, initial: 0}\n"
    events = "{at: 4, loop: L1, set: {alarms.pv.high: 50}}", "{at: 7, plc: program}", "{at: 11, plc: run}"
    columns, report = run(config, plants, *events, duration=60)
    pv = columns["L1.PV"]
    sampled = [k for k in range(11, 20) if pv[k] != pv[k - 1]]
    assert sampled == [11, 14, 17]
    assert pv[11] == 1100, "the PV of 11 s, unfiltered"
    alarms = [alarm.at for alarm in report.loops["L1"].alarms if alarm.alarm == "pv_high"]
    assert alarms == [11.0], "an independent loop too keeps its limit in Program mode"


def test_d649_output_limits_bound_the_sum_of_the_velocity_form():
    rest = "algorithm: velocity, output: {limits: [500, 1000]}, mode: auto, setpoint: {value: 4000}"
    columns, _ = run(
        dl06(loop(rest, tuning="{gain: 1, reset: 5}")),
        "connect: {L1.PV: 2000}\n",
        "{at: 6, loop: L1, set: {setpoint: 1900}}",
    )
    assert columns["L1.OUT"][1:6] == [1000] * 5
    assert columns["L1.OUT"][6] == 500, "the step of -2100 counts acts at once: nothing has run up behind 1000"


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_d650_loops_that_stand_still_take_no_turn(engine):
    transfer = "pv: {transfer: {slot: 1, channel: 1}}, output: {transfer: {slot: 2, channel: 1}}"
    own = f"independent_of_cpu_mode: true, {transfer}"
    ramps = "".join(f"  L{n}: {{model: integrator, load: 10, initial: 0}}\n" for n in (1, 2, 3))
    slow = [
        loop(name="L1", sample_rate=3),
        loop(own, name="L2", sample_rate=3),
        loop(own.replace("1}", "2}"), name="L3", sample_rate=3),
    ]
    for count, expected in ((2, {"L2": [6, 9, 12, 15]}), (3, {"L2": [6, 9, 12, 15], "L3": [5, 7, 10, 13, 16]})):
        columns, _ = run(
            dl06(*slow[:count]),
            "plc: {scan_time: 1}\nplants:\n" + "".join(ramps.splitlines(keepends=True)[:count]),
            "{at: 4, plc: program}",
            duration=16,
            step="",
            engine=engine,
        )
        found = {
            name: [k for k in range(5, 17) if columns[f"{name}.PV"][k] != columns[f"{name}.PV"][k - 1]]
            for name in expected
        }
        assert found == expected


def test_d651_a_raw_set_point_of_a_root_loop_is_the_word():
    config = dl06(loop("mode: auto, pv: {range: [0, 100], square_root: true}, setpoint: {value: 20 counts}"))
    columns, _ = run(config, "connect: {L1.PV: 0}\n", "{at: 4, loop: L1, set: {setpoint: 30 counts}}")
    assert columns["L1.SP"][1] == pytest.approx(100 * 20**2 / 4095)
    assert columns["L1.SP"][5] == pytest.approx(100 * 30**2 / 4095)


# --- ramp/soak -------------------------------------------------------------------------------------------------------

PROFILE = (
    "setpoint: {value: 1000}, "
    "ramp_soak: {table: V3000, steps: [{ramp_to: 2000, slope: 33.4, soak: SOAK}, {ramp_to: 0, slope: 77, soak: 1}]}"
)
START = "{at: 2, loop: L1, ramp_soak: start}"


def profile(soak="6 s", sample_rate=1):
    return dl06(loop(PROFILE.replace("SOAK", soak), sample_rate=sample_rate))


def test_d652_a_profile_moves_from_the_sample_after_its_start_on():
    columns, _ = run(profile(), LAG, START, "{at: 6, loop: L1, ramp_soak: jog}", "{at: 8, loop: L1, ramp_soak: jog}")
    assert columns["L1.SP"][:7] == [1000, 1000, 1000, 1033, 1067, 1100, 1100]
    assert columns["L1.SP"][8:11] == [1100, 1023, 946]


@pytest.mark.parametrize(("soak", "samples"), [("6 s", 2), ("12 s", 4), ("18 s", 7)])
def test_d652_a_soak_lasts_whole_samples(soak, samples):
    """With a sample every 2.7 s: 2.2, 4.4 and 6.7 of them."""
    _, report = run(profile(soak, 2.7), LAG, "{at: 0, loop: L1, ramp_soak: start}", duration=140, step="")
    steps = {step.name: step for step in report.loops["L1"].steps}
    lasted = steps["2 soak"].until - steps["2 soak"].at
    assert lasted == pytest.approx(2.7 * samples)


def test_d653_a_set_point_that_is_written_holds_during_a_soak_only():
    jog, write = "{{at: {}, loop: L1, ramp_soak: jog}}", "{{at: {}, loop: L1, set: {{setpoint: 300}}}}"
    columns, report = run(profile(), LAG, START, jog.format(5), write.format(6), jog.format(8))
    assert columns["L1.SP"][4:11] == [1067, 1067, 300, 300, 300, 990, 913], "1066.8 - 77 and so on"
    assert [text.partition(":")[0] for _, text in notes(report)] == ["setpoint"]


def test_d653_after_hold_and_resume_the_ramp_goes_on_from_what_was_written():
    command, write = "{{at: {}, loop: L1, ramp_soak: {}}}", "{at: 6, loop: L1, set: {setpoint: 300}}"
    columns, report = run(profile(), LAG, START, command.format(5, "hold"), write, command.format(8, "resume"))
    assert columns["L1.SP"][4:11] == [1067, 1067, 300, 300, 333, 367, 400]
    assert notes(report) == []


# --- CLICK and EZLogix -----------------------------------------------------------------------------------------------


def test_d655_alarms_of_a_group_that_is_switched_off_go_off_at_the_event():
    config = click("mode: manual, alarms: {pv: {low_low: 1, low: 2, high: 30, high_high: 40}, hysteresis: 1}")
    switch = "{{at: {}, loop: L1, set: {{alarms.pv.enabled: {}}}}}"
    _, report = run(config, "connect: {L1.PV: 35}\n", switch.format(7, "false"), switch.format(12, "true"), duration=20)
    assert [(a.alarm, a.at, a.cleared) for a in report.loops["L1"].alarms] == [
        ("pv_high", 0.0, 7.0),
        ("pv_high", 15.0, None),
    ]


EZ_TUNING = "tuning: {proportional_gain: 1, integral_time: 2, derivative_time: off}"


def test_d656_the_set_point_is_shown_within_its_limits_at_once():
    config = ezlogix(f"mode: manual, {EZ_TUNING}, output: {{tag: OR1}}, setpoint: {{value: 1000, limits: [0, 2000]}}")
    columns, _ = run(config, LAG, "{at: 5, loop: L1, set: {setpoint: 3000}}", duration=8)
    assert columns["L1.SP"] == [1000] * 5 + [2000] * 4, "the next calculation is at 6 s"


def test_d657_bias_runs_beyond_the_control_value_without_anti_windup():
    config = ezlogix(
        f"mode: auto, {EZ_TUNING}, anti_windup: false, setpoint: {{value: 2000}}, "
        "output: {tag: OR1, limits: [0, 3000]}"
    )
    columns, _ = run(config, "connect: {L1.PV: 0}\n", duration=20)
    assert max(columns["L1.CV"]) == 3000
    assert columns["L1.BIAS"][-1] > 4095 * 4


# --- the pages -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("decision", [*DL06, *CLICK, *EZLOGIX], ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    modules = [m for m in SOURCES.rglob("*.py") if m.name not in {"__init__.py", "recording.py"}]
    assert any(f"D{decision.number}" in m.read_text("utf-8") for m in modules)
