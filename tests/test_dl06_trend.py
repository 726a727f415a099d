"""What the trend of a DL06 shows at an event, and when plants see it: the same words make the same trend."""

from __future__ import annotations

import csv
import io

import pytest

from pidcfg.api import simulate

CONFIG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
"""
PLANTS = "plants:\n  L1: {model: first_order, time_constant: 10}\n"
CASCADE = (
    "  - {name: L1, sample_rate: 2, action: direct, mode: cascade, cascade_from: L2, tuning: {gain: 0.5, reset: 20}}",
    "  - {name: L2, sample_rate: 1, action: direct, mode: auto, tuning: {gain: 0.5, reset: 20}}",
)
MINOR = PLANTS + "  L2: {model: first_order, time_constant: 10, input: L1.PV}\n"


def trend(loops, scenario, *events, engine="python", step=1, duration=12):
    """The columns of a run's trend, and its report."""
    head = f"pidcfg: 1\nscenario: trend\nconfig: c.yaml\nduration: {duration}\nstep: {step}\n"
    text = f"{head}{scenario}events:\n" + "".join(f"  - {event}\n" for event in events)
    out = io.StringIO()
    files = {"c.yaml": CONFIG + "\n".join(loops) + "\n"}
    result = simulate(text, engine=engine, trend=out, files=files)
    table = list(csv.reader(io.StringIO(out.getvalue())))
    return {name: [float(row[i]) for row in table[1:]] for i, name in enumerate(table[0])}, result.report


def log(report, loop):
    return [(m.at, m.requested, m.mode) for m in report.loops[loop].modes]


# --- the set point of a minor loop -----------------------------------------------------------------------------------

DRIVEN = (
    "{at: 3, loop: L2, mode: manual}",
    "{at: 3, loop: L2, set: {output: 3000}}",
    "{at: 5, loop: L2, set: {output: 1000}}",
    "{at: 6, loop: L2, set: {output: 3000}}",
)


@pytest.mark.parametrize(
    "key", ["output.limits: [0, 4000]", "derivative_gain_limit: 5", "alarms.pv.high: 4000", "alarms.hysteresis: 3"]
)
@pytest.mark.parametrize("engine", ["python", "numba"])
def test_a_word_that_is_read_late_leaves_the_trend_of_a_minor_loop_alone(key, engine):
    plain, before = trend(CASCADE, MINOR, *DRIVEN, engine=engine)
    written = *DRIVEN[:3], f"{{at: 5, loop: L1, set: {{{key}}}}}", DRIVEN[3]
    with_word, after = trend(CASCADE, MINOR, *written, engine=engine)

    assert with_word == plain
    assert plain["L1.SP"] == [0, 0, 0, 0, *[3000] * 9], "L1 samples at 4 s and 6 s, each time with 3000"
    assert after.loops["L1"].metrics == before.loops["L1"].metrics
    assert after.loops["L1"].metrics["final_error"] == 3000 - plain["L1.PV"][-1]


def test_the_output_that_a_transfer_gives_the_major_loop_is_shown_at_once():
    """The minor loop L2 samples every second, its major loop L1 every 5 s."""
    loops = (
        "  - {name: L1, sample_rate: 5, action: direct, tuning: {gain: 0.5}}",
        "  - {name: L2, sample_rate: 1, action: direct, cascade_from: L1, state: {output: 1000}, tuning: {gain: 0.5}}",
    )
    plants = "plants:\n  L2: {model: first_order, time_constant: 10, initial: 700}\nconnect: {L1.PV: 0}\n"
    events = "{at: 1, loop: L2, mode: auto}", "{at: 2, loop: L2, mode: cascade}"
    columns, _ = trend(loops, plants, *events, duration=6)
    other, _ = trend(loops, plants, *events, "{at: 3, loop: L1, set: {gain: 0.5}}", duration=6)

    assert columns["L1.OUT"] == other["L1.OUT"] == [0, 0, *[columns["L2.PV"][2]] * 5]
    assert columns["L2.PV"][2] > 700


# --- what plants see -------------------------------------------------------------------------------------------------

MANUAL = ("  - {name: L1, sample_rate: 5, action: direct, tuning: {gain: 0.5}}",)
FAST = "plants:\n  L1: {model: integrator, gain: 0.1}\n"


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_an_output_that_an_event_writes_acts_from_its_base_step_on(engine):
    events = "{at: 5, loop: L1, set: {output: 3000}}", "{at: 5, loop: L1, disturb: {load: 20}}"
    columns, _ = trend(MANUAL, FAST, *events, engine=engine, step=5, duration=15)

    assert columns["L1.OUT"] == [0, 3000, 3000, 3000]
    assert columns["L1.PV"] == [0, 100, 1700, 3300], "the load acts up to 5 s (D82), the output from 5 s on"


def test_two_outputs_at_one_moment_leave_plants_with_the_one_of_before():
    events = "{at: 5, loop: L1, set: {output: 3000}}", "{at: 5, loop: L1, set: {output: 2000}}"
    columns, _ = trend(MANUAL, FAST, *events, step=5, duration=15)
    assert columns["L1.PV"] == [0, 0, 1000, 2000]


def test_program_and_run_act_from_their_base_step_on():
    events = "{at: 0, loop: L1, set: {output: 1000}}", "{at: 5, plc: program}", "{at: 10, plc: run}"
    columns, _ = trend(MANUAL, FAST, *events, step=5, duration=20)

    assert columns["L1.OUT"] == [1000, 0, 1000, 1000, 1000]
    assert columns["L1.PV"] == [0, 0, 500, 1000, 1500], "Program cuts the module from 5 s on; its PV word stands still"


# --- requests --------------------------------------------------------------------------------------------------------


def test_a_request_that_program_mode_refuses_ends_the_configured_one():
    alarms = "alarms: {pv: {low_low: 10, low: 20, high: 4000, high_high: 4050}}"
    loops = (f"  - {{name: L1, sample_rate: 1, mode: auto, action: direct, tuning: {{gain: 0.5}}, {alarms}}}",)
    plants = "plants:\n  L1: {model: first_order, time_constant: 10, initial: 0}\n"
    events = (
        "{at: 2, plc: program}",
        "{at: 3, loop: L1, mode: manual}",
        "{at: 5, plc: run}",
        "{at: 6, loop: L1, set: {output: 4000}}",
    )
    _, asked = trend(loops, plants, *events, duration=20)
    _, silent = trend(loops, plants, events[0], *events[2:], duration=20)

    assert log(asked, "L1") == [(0.0, "auto", "manual"), (3.0, "manual", "manual")]
    assert log(silent, "L1")[-1][1:] == ("auto", "auto"), "nobody has asked for Manual"


# --- writes that are lost --------------------------------------------------------------------------------------------

PROFILE = "ramp_soak: {table: V3000, steps: [{ramp_to: 2000, slope: 50, soak: 1}]}"
LOST = {
    "{at: 5, loop: L1, set: {output: 3000}}": ("mode: auto", "output: the next calculation overwrites +05"),
    "{at: 5, loop: L1, set: {bias: 3000}}": ("mode: auto, algorithm: velocity", "bias: the velocity form has no bias"),
    "{at: 5, loop: L1, set: {setpoint: 3000}}": (PROFILE, "setpoint: a ramp/soak profile runs"),
}


@pytest.mark.parametrize(("event", "loop"), LOST.items())
def test_a_write_that_the_loop_overrules_is_told(event, loop):
    settings, told = loop
    loops = (f"  - {{name: L1, sample_rate: 1, action: direct, tuning: {{gain: 0.5}}, {settings}}}",)
    start = ("{at: 1, loop: L1, ramp_soak: start}",) if settings == PROFILE else ()
    _, report = trend(loops, PLANTS, *start, event)
    assert [note.text.startswith(told) for note in report.notes] == [True]


def test_a_set_point_that_is_written_in_cascade_waits():
    _, report = trend(CASCADE, MINOR, "{at: 8, loop: L1, set: {setpoint: 3000}}")
    assert [note.text for note in report.notes] == [
        "setpoint: in Cascade the set point is the output of the major loop, +02 waits"
    ]


@pytest.mark.parametrize("settings", ["mode: manual", "mode: manual, algorithm: velocity", "mode: auto"])
def test_a_write_that_acts_is_not_told(settings):
    loops = (f"  - {{name: L1, sample_rate: 1, action: direct, tuning: {{gain: 0.5}}, {settings}}}",)
    key = "setpoint" if "auto" in settings else "output"
    _, report = trend(loops, PLANTS, f"{{at: 5, loop: L1, set: {{{key}: 3000}}}}")
    assert report.notes == []
