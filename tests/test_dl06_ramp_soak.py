"""The ramp/soak generator of the virtual DL06: fractions of words, Program mode, its step as a signal."""

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
from rig_plants import Fixed


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
