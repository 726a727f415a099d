"""Modes of the virtual DL06 that words alone reach: overflows, programming errors, the CPU, notices."""

from __future__ import annotations

import csv
import io

import pytest

from dl06_rig import Rig
from pidcfg.api import simulate
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.equation import (
    RS_HOLD,
    RS_RESUME,
    RS_START,
)
from pidcfg.sim.controllers.dl06.operate import MODE_REASONS as REASONS
from pidcfg.sim.controllers.dl06.plc import Dl06
from pidcfg.sim.controllers.kernels import NOTICE_BASE, REASON_BITS, split_notices
from rig_plants import FirstOrder, Fixed


def mode(rig, i=0):
    return Dl06.mode(rig.states[i].status)


def reasons(rig):
    return [text for _, text in rig.log]


def pair(rig=None, *, inner="manual", outer="manual", **major):
    """Loop 0 is the minor loop, loop 1 its major."""
    rig = rig or Rig(base=0.1)
    rig.add(Fixed(1200.0), inner, sp=1000.0, gain=1.0, major=1)
    rig.add(Fixed(2000.0), outer, sp=2000.0, gain=0.5, **major)
    return rig


def cascaded():
    """A pair that has come to Cascade and Auto."""
    rig = pair()
    rig.request("auto", 0)
    rig.step()
    rig.request("cascade", 0)
    rig.step()
    rig.request("auto", 1)
    rig.step(2)
    assert (mode(rig, 0), mode(rig, 1)) == ("cascade", "auto")
    return rig


def test_when_a_minor_loop_overflows_its_major_goes_to_manual():
    rig = cascaded()
    rig.states[0].kp = 1e12
    rig.plants[0].value = 1100.0
    rig.step()

    assert (mode(rig, 0), mode(rig, 1)) == ("manual", "manual")
    assert (1, "to Manual: the minor loop left Cascade") in rig.log


def test_an_alarm_programming_error_keeps_the_loop_in_manual_even_without_interlock():
    rig = Rig()
    _, s = rig.add(Fixed(100.0), "auto", interlock=0)
    s.status |= bits.ALARM_ERROR
    rig.step()

    assert mode(rig) == "manual"
    assert reasons(rig) == ["refused: alarm programming error (+06 bit 10)"]


def test_an_alarm_programming_error_that_comes_up_forces_manual():
    rig = Rig()
    _, s = rig.add(Fixed(100.0), "auto", sp=100.0, out=300.0)
    rig.step(2)
    s.status |= bits.ALARM_ERROR
    s.pending |= bits.TRIP
    rig.step(2)

    assert (mode(rig), s.out) == ("manual", 300.0)
    assert reasons(rig) == ["to Manual: alarm programming error (+06 bit 10)"]


# --- bumpless transfers ----------------------------------------------------------------------------------------------


def test_back_to_manual_the_output_stays():
    rig = Rig(base=0.1)
    _, s = rig.add(FirstOrder(1.0, 5.0, initial=1000.0), "auto", sp=1000.0, gain=2.0, reset=5.0, out=1000.0)
    rig.step(2)
    s.sp = 1500.0
    rig.run(3)
    held = s.out
    rig.request("manual")
    rig.run(3)

    assert (mode(rig), s.out) == ("manual", held)


# --- the CPU's mode --------------------------------------------------------------------------------------------------


def test_restoring_returns_a_cascade_to_its_modes_at_once():
    rig = cascaded()
    rig.log.clear()
    for s in rig.states:
        s.prior_mode = s.status & bits.MODES
        s.status = (s.status & ~bits.MODES) | bits.MANUAL
        s.pending |= bits.RESTORE
    rig.step()

    assert (mode(rig, 0), mode(rig, 1)) == ("cascade", "auto")
    assert reasons(rig) == ["back to the mode before Program mode"] * 2


def test_a_stopped_loop_does_nothing_and_its_module_is_off():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, out=700.0, out_low=4.0, out_width=16.0)
    rig.step()
    s.pending |= bits.STOPPED
    pv.value = 3000.0
    rig.step()

    assert (s.pv, s.out, rig.signal_values[3]) == (1000.0, 700.0, 4.0)


def test_an_independent_loop_without_transfer_is_blind_and_mute_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, reset=10.0, out=700.0)
    rig.step()
    s.sp = 1100.0
    s.pending |= bits.PROGRAM | bits.PV_STALE | bits.OUTPUT_CUT
    pv.value = 3000.0
    rig.step(5)

    assert s.pv == 1000.0
    assert s.out > 800.0
    assert rig.signal_values[3] == 0.0


def test_an_independent_loop_with_transfer_goes_on_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, out=700.0)
    rig.step()
    s.pending |= bits.PROGRAM
    pv.value = 900.0
    rig.step()

    assert (s.pv, s.out, rig.signal_values[3]) == (900.0, 800.0, 800.0)


# --- notices ---------------------------------------------------------------------------------------------------------


def test_several_notices_of_one_sample_come_out_in_order():
    rig = pair()
    s = rig.states[0]
    s.notice = 0
    rig.request("cascade", 0)
    rig.configs[0].rs_enabled = 0
    rig.command(bits.RS_START)
    rig.step()

    assert [text.split(":")[0] for _, text in rig.log] == ["refused"]
    assert rig.log[0][1].count(";") == 1


def test_a_notice_knows_what_was_requested():
    rig = pair()
    rig.states[0].requested_mode = bits.CASCADE
    number = (bits.CASCADE << REASON_BITS | 3) * NOTICE_BASE + 12

    assert split_notices(number) == [(bits.CASCADE, 3), (0, 12)]
    assert Dl06.requested_mode(number) == "cascade"
    assert Dl06.describe(number) == (f"{REASONS[3]}; {REASONS[12]}", "")
    assert Dl06.requested_mode(12) is None
    assert Dl06.describe(0) == ("", "")


# --- What the trend of a DL06 shows at an event, and when plants see it: the same words make the same trend -----------


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


# --- The ramp/soak generator of the virtual DL06: fractions of words, Program mode, its step as a signal --------------


def oven(*pairs, sp=100.0, pv=100.0, base=1.0, **fields):
    rig = Rig(base=base)
    _, s = rig.add(Fixed(pv), sp=sp, rs_enabled=1, **fields)
    rig.profile(*pairs)
    return rig, s


def step_of(s):
    return s.aux_status >> 8


def test_a_slow_ramp_moves_by_fractions_of_a_count():
    rig, _ = oven((103, 0.25, 60, 0))
    rig.command(RS_START)
    rows = [sp for (sp,) in rig.trace(13, "sp")]

    assert rows == [100, 100, 100, 101, 101, 101, 102, 102, 102, 102, 102, 103, 103]


def test_holding_and_resuming_keeps_the_fraction_of_the_set_point():
    """0.3 counts/s for 60 s is 18 counts, however often the profile is held in between; a written word wins."""
    rig, s = oven((200, 0.3, 1, 0))
    rig.command(RS_START)
    rig.run(1)
    for _ in range(20):
        rig.run(3)
        rig.command(RS_HOLD)
        rig.run(2)
        rig.command(RS_RESUME)
    assert abs(s.rs_sp - 118.0) < 0.4

    rig.command(RS_HOLD)
    rig.run(1)
    s.sp = 150.0
    rig.command(RS_RESUME)
    rig.run(1)
    assert s.rs_sp == pytest.approx(150.3)


def test_a_soak_in_hold_keeps_its_remaining_time():
    rig, s = oven((110, 10, 10, 0))
    rig.command(RS_START)
    rig.step(5)
    rig.command(RS_HOLD)
    rig.step(50)
    left = s.rs_ticks_left
    rig.command(RS_RESUME)
    rig.step()

    assert (left, s.rs_ticks_left) == (7e6, 6e6)
    assert step_of(s) == 2


@pytest.mark.parametrize(("seconds", "samples"), [(5.4, 18), (5.7, 19), (5.69, 19), (5.55, 19), (5.54, 18)])
def test_a_soak_lasts_the_nearest_number_of_samples(seconds, samples):
    """Counted without rounding: 18.5 samples of 0.3 s are 19, however long the sum of fractions is."""
    rig, s = oven((100, 10, seconds, 0), base=0.3)
    rig.command(RS_START)
    rig.step(2)
    count = 0
    while step_of(s) == 2:
        rig.step()
        count += 1

    assert count == samples


def test_a_start_is_refused_where_the_table_is_at_fault():
    rig, s = oven((200, 10, 5, 0))
    rig.configs[0].rs_fault = 16
    refused = (0, "ramp/soak refused: the table is not in user memory (+35)")
    rig.command(RS_START)
    rig.step(3)
    assert (s.sp, s.aux_status, s.rs_error, rig.log) == (100.0, 0, 16, [refused])

    rig.configs[0].rs_fault = 0
    rig.step()
    assert (s.rs_step, rig.log) == (0, [refused]), "the command was taken"
    rig.command(RS_START)
    rig.step()
    assert s.rs_step == 1


def test_in_program_mode_an_independent_loop_pauses_its_profile():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START)
    rig.step(4)
    s.pending |= bits.PROGRAM
    rig.step(3)
    assert s.sp == 130.0
    s.pending &= ~bits.PROGRAM
    rig.step()

    assert s.sp == 140.0


# --- the step as a signal ---------------------------------------------------------------------------------------------

SCENARIO = """\
pidcfg: 1
scenario: s
config: c.yaml
duration: 20
step: 1
plants:
  - {name: oven, model: first_order, input: L1.OUT, time_constant: 10}
  - {name: siren, model: lead_lag, input: L1.STEP, gain: 10, lead: 1, lag: 1}
connect: {L1.PV: oven}
events:
  - {at: 2, loop: L1, ramp_soak: start}
  - {at: 6, loop: L1, ramp_soak: hold}
  - {at: 8, loop: L1, ramp_soak: resume}
expect:
  - {signal: L1.STEP, max: 2, from: 1}
  - {signal: L1.STEP, final: 0, tolerance: 0}
"""
SOAK_CONFIG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: L1, sample_rate: 1, action: direct, tuning: {gain: 0.5}, setpoint: {value: 100}, RAMP_SOAK}
  - {name: L2, sample_rate: 1, action: direct, tuning: {gain: 0.5}}
"""
SOAK_PROFILE = "ramp_soak: {table: V3000, steps: [{ramp_to: 250, slope: 50, soak: 0.1}]}"


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_the_step_is_a_signal_of_loops_with_a_profile(engine):
    out = io.StringIO()
    files = {"c.yaml": SOAK_CONFIG.replace("RAMP_SOAK", SOAK_PROFILE)}
    result = simulate(SCENARIO, engine=engine, trend=out, files=files)
    names, *rows = csv.reader(io.StringIO(out.getvalue()))
    columns = {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}

    assert columns["L1.STEP"] == [0, 0, 1, 1, 1, *[2] * 8, *[0] * 8]
    assert columns["siren"][6] == 20, "a plant reads it"
    assert "L2.STEP" not in columns
    assert result.report.passed


def test_a_loop_without_a_profile_has_no_step():
    files = {"c.yaml": SOAK_CONFIG.replace("RAMP_SOAK", "mode: manual")}
    result = simulate(SCENARIO, files=files)
    assert any("L1.STEP" in finding.message for finding in result.findings)
