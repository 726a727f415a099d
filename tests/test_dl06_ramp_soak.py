"""The ramp/soak generator of the virtual DL06: profile, commands, status word, errors."""

from __future__ import annotations

import csv
import io

import pytest

from dl06_rig import Rig
from pidcfg.api import simulate
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.equation import (
    RS_COMPLETE,
    RS_DEVIATION,
    RS_HELD,
    RS_HOLD,
    RS_JOG,
    RS_RESUME,
    RS_START,
)
from rig_plants import Fixed


def oven(*pairs, sp=100.0, pv=100.0, base=1.0, **fields):
    rig = Rig(base=base)
    _, s = rig.add(Fixed(pv), sp=sp, rs_enabled=1, **fields)
    rig.profile(*pairs)
    return rig, s


def step_of(s):
    return s.aux_status >> 8


def test_a_profile_ramps_soaks_and_completes():
    """From 100 to 200 at 10 counts/s, 5 s of soak, down to 180 at 4 counts/s, 2 s of soak."""
    rig, s = oven((200, 10, 5, 0), (180, 4, 2, 0))
    rig.command(RS_START)
    seen = [(sp, status >> 8) for sp, status in rig.trace(26, "sp", "aux_status")]

    assert seen[0] == (100.0, 1), "the first ramp begins at the present set point"
    assert seen[1:10] == [(100.0 + 10 * n, 1) for n in range(1, 10)]
    assert seen[10:15] == [(200.0, 2)] * 5
    assert seen[15:20] == [(200.0, 3), (196.0, 3), (192.0, 3), (188.0, 3), (184.0, 3)]
    assert seen[20:22] == [(180.0, 4)] * 2
    assert seen[22:] == [(180.0, 0)] * 4
    assert s.aux_status == RS_COMPLETE
    assert s.busy == 0


def test_the_step_number_stands_in_the_high_byte_up_to_sixteen():
    rig, s = oven(*[(100 + n, 99, 1, 0) for n in range(1, 9)])
    rig.command(RS_START)
    steps = [status >> 8 for (status,) in rig.trace(40, "aux_status")]

    assert sorted(set(steps)) == list(range(17))
    assert s.aux_status == RS_COMPLETE


def test_a_slope_of_zero_ends_the_profile():
    rig, s = oven((110, 10, 1, 0), (200, 0, 9, 0), (300, 10, 9, 0))
    rig.command(RS_START)
    rig.run(20)

    assert (s.sp, s.aux_status) == (110.0, RS_COMPLETE)


def test_an_empty_table_is_complete_at_once():
    rig, s = oven()
    rig.command(RS_START)
    rig.step()

    assert (s.sp, s.aux_status) == (100.0, RS_COMPLETE)


def test_a_first_ramp_without_length_goes_to_the_soak_at_once():
    rig, s = oven((100, 10, 5, 0))
    rig.command(RS_START)
    rig.step(2)

    assert step_of(s) == 2


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


def test_hold_freezes_and_resume_goes_on():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START)
    rig.step(4)
    rig.command(RS_HOLD)
    rig.step(5)
    assert (s.sp, s.aux_status) == (130.0, RS_HELD | 1 << 8)
    rig.command(RS_RESUME)
    rig.step()

    assert (s.sp, s.aux_status) == (140.0, 1 << 8), "the profile is late by exactly the time of the hold"


def test_a_soak_in_hold_keeps_its_remaining_time():
    rig, s = oven((110, 10, 10, 0))
    rig.command(RS_START)
    rig.step(5)
    rig.command(RS_HOLD)
    rig.step(50)
    left = s.rs_left
    rig.command(RS_RESUME)
    rig.step()

    assert (left, s.rs_left) == (7e6, 6e6)
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


def test_jog_truncates_the_segment_and_the_set_point_stays():
    rig, s = oven((200, 10, 50, 0), (300, 10, 5, 0))
    rig.command(RS_START)
    rig.step(4)
    rig.command(RS_JOG)
    rig.step()
    assert (s.sp, step_of(s)) == (130.0, 2)
    rig.command(RS_JOG)
    rig.step(2)

    assert (s.sp, step_of(s)) == (140.0, 3)


def test_jog_in_hold_goes_on_to_the_next_segment_and_stays_in_hold():
    rig, s = oven((200, 10, 50, 0), (300, 10, 5, 0))
    rig.command(RS_START)
    rig.step(2)
    rig.command(RS_HOLD)
    rig.step()
    rig.command(RS_JOG)
    rig.step(3)

    assert s.aux_status == RS_HELD | 2 << 8


def test_start_again_begins_anew_and_clears_complete():
    rig, s = oven((110, 10, 1, 0))
    rig.command(RS_START)
    rig.run(10)
    assert s.aux_status == RS_COMPLETE
    s.sp = 50.0
    rig.command(RS_START)
    rig.step(2)

    assert (s.sp, s.aux_status) == (60.0, 1 << 8)


def test_a_start_within_the_first_ramp_waits_a_sample_like_any_other():
    rig, s = oven((110, 10, 1, 0))
    s.sp = 50.0
    rig.command(RS_START)
    rig.step(2)
    assert s.sp == 60.0
    rig.command(RS_START)
    rig.step()
    assert s.sp == 60.0
    rig.step()
    assert s.sp == 70.0


def test_the_deviation_bit_is_on_only_while_a_soak_sees_too_large_an_error():
    rig, s = oven((110, 10, 3, 5), (130, 10, 9, 5), pv=105.0)
    pv = rig.plants[0]
    rig.command(RS_START)
    rig.step(2)
    assert s.aux_status == 2 << 8, "5 counts are allowed"
    pv.value = 104.0
    rig.step()
    assert s.aux_status == RS_DEVIATION | 2 << 8
    rig.step(2)

    assert s.aux_status == 3 << 8, "a ramp has no deviation"


def test_the_commands_are_read_and_cleared():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START)
    rig.step()

    assert s.rs_command == 0


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"rs_enabled": 0}, "ramp/soak refused: not enabled (+00 bit 11)"),
        ({"rs_fault": 16}, "ramp/soak refused: the table is not in user memory (+35)"),
    ],
)
def test_a_start_can_be_refused(change, reason):
    rig, s = oven((200, 10, 5, 0))
    for name, value in change.items():
        setattr(rig.cfg[0], name, value)
    rig.command(RS_START)
    rig.step(3)

    assert (s.sp, s.aux_status, rig.log) == (100.0, 0, [(0, reason)])
    assert s.rs_error == change.get("rs_fault", 0)
    rig.cfg[0].rs_enabled, rig.cfg[0].rs_fault = 1, 0
    rig.step()
    assert (s.rs_step, rig.log) == (0, [(0, reason)]), "the command was taken"
    rig.command(RS_START)
    rig.step()
    assert s.rs_step == 1


@pytest.mark.parametrize("command", [RS_HOLD, RS_RESUME, RS_JOG])
def test_other_commands_need_a_running_profile(command):
    rig, s = oven((200, 10, 5, 0))
    rig.command(command)
    rig.step()

    assert s.aux_status == 0
    assert rig.log == [(0, "ramp/soak refused: no profile is running")]


def test_start_does_nothing_while_another_control_bit_is_on():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START | RS_HOLD)
    rig.step(3)

    assert (s.sp, step_of(s)) == (100.0, 0)


def test_switching_the_generator_off_stops_the_profile():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START)
    rig.step(4)
    rig.cfg[0].rs_enabled = 0
    rig.step(3)

    assert (s.sp, s.aux_status, s.busy) == (130.0, 0, 0)


def test_in_cascade_a_start_is_refused_and_a_running_profile_is_held():
    rig, s = oven((200, 10, 5, 0), pv=100.0, mode="auto", major=1)
    rig.add(Fixed(0.0))
    rig.command(RS_START)
    rig.step(3)
    rig.request("cascade")
    rig.step(3)
    held = s.sp
    rig.command(RS_START)
    rig.step(3)

    assert s.aux_status == RS_HELD | 1 << 8
    assert s.sp == held
    assert [text for _, text in rig.log] == [
        "ramp/soak held: the loop went to Cascade",
        "ramp/soak refused: the loop is in Cascade",
    ]


def test_the_generator_runs_in_manual_and_in_auto():
    for mode in ("manual", "auto"):
        rig, s = oven((200, 10, 5, 0), mode=mode)
        rig.command(RS_START)
        rig.step(4)
        assert s.sp == 130.0


def test_in_program_mode_an_independent_loop_pauses_its_profile():
    rig, s = oven((200, 10, 5, 0))
    rig.command(RS_START)
    rig.step(4)
    s.busy |= bits.PROGRAM
    rig.step(3)
    assert s.sp == 130.0
    s.busy &= ~bits.PROGRAM
    rig.step()

    assert s.sp == 140.0


def test_the_deviation_alarm_follows_the_ramp():
    rig, _ = oven((200, 10, 5, 0), yellow=45.0, red=400.0)
    rig.command(RS_START)
    rows = [bool(status & bits.YELLOW) for (status,) in rig.trace(8, "status")]

    assert rows == [False] * 5 + [True] * 3


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
CONFIG = """\
pidcfg: 1
vendor: dl06
plc: {loop_table: V2000}
loops:
  - {name: L1, sample_rate: 1, action: direct, tuning: {gain: 0.5}, setpoint: {value: 100}, RAMP_SOAK}
  - {name: L2, sample_rate: 1, action: direct, tuning: {gain: 0.5}}
"""
PROFILE = "ramp_soak: {table: V3000, steps: [{ramp_to: 250, slope: 50, soak: 0.1}]}"


@pytest.mark.parametrize("engine", ["python", "numba"])
def test_the_step_is_a_signal_of_loops_with_a_profile(engine):
    out = io.StringIO()
    files = {"c.yaml": CONFIG.replace("RAMP_SOAK", PROFILE)}
    result = simulate(SCENARIO, engine=engine, trend=out, files=files)
    names, *rows = csv.reader(io.StringIO(out.getvalue()))
    columns = {name: [float(row[i]) for row in rows] for i, name in enumerate(names)}

    assert columns["L1.STEP"] == [0, 0, 1, 1, 1, *[2] * 8, *[0] * 8]
    assert columns["siren"][6] == 20, "a plant reads it"
    assert "L2.STEP" not in columns
    assert result.report.passed


def test_a_loop_without_a_profile_has_no_step():
    files = {"c.yaml": CONFIG.replace("RAMP_SOAK", "mode: manual")}
    result = simulate(SCENARIO, files=files)
    assert any("L1.STEP" in finding.message for finding in result.findings)
