"""EZLogix's equation and modes in single steps; whole runs stand in trajectories."""

from __future__ import annotations

import random
from dataclasses import replace
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path

import pytest

from ezlogix_rig import COLUMNS, CV, ERROR, PV, SCALED, SP, Rig, change, image, play, plc
from pidcfg.sim.controllers import ezlogix as ezlogix_decisions
from pidcfg.sim.controllers.ezlogix import ENGINE
from pidcfg.sim.controllers.ezlogix.plc import load
from rig_plants import Fixed

# --- The equation of the virtual EZLogix against the manual's formulas, worked out in exact fractions -----------------


def formula(pvs, sp, out, offset=0, *, direct, velocity=False, gain, ts, ti=0, td=0):
    """CV(n) by the printed formula; the sum begins with what makes the term CV - CV0 (exact, without limits)."""
    gain, ts, ti, td = (Fraction(str(x)) for x in (gain, ts, ti, td))
    sign = 1 if direct else -1
    factor = gain or 1
    errors = [sign * (Fraction(pv) - sp) for pv in pvs]
    ramp = [sign * Fraction(pv) for pv in pvs] if velocity else errors
    slopes = [Fraction(0), *(b - a for a, b in pairwise(ramp))]
    sums = list(accumulate(errors))
    start = out - offset if ti else 0
    return [
        gain * e + start + (factor * ts / ti * total if ti else 0) + factor * td / ts * slope + offset
        for e, total, slope in zip(errors, sums, slopes, strict=True)
    ]


def controlled(pvs, **given):
    """The CV of each sample of a loop in Auto with these measurements."""
    rig = Rig(base=given.pop("period", 0.1))
    rig.add(Fixed(), "auto", **given)
    return [out for (out,) in rig.follow(pvs, "out")]


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("velocity", [False, True])
@pytest.mark.parametrize(
    ("gain", "ti", "td"),
    [
        (2, 0, 0),
        (0.75, 3, 0),
        (1.25, 0, 0.4),
        (1.5, 20, 0.3),
        (0, 5, 0),
        (0, 7, 0.2),
        (0, 0, 0.5),
    ],
)
def test_the_result_is_that_of_the_printed_formula(direct, velocity, gain, ti, td):
    rng = random.Random(repr((direct, velocity, gain, ti, td)))
    for offset in (0, 1900):
        pvs = [2000 + rng.randint(-30, 30) for _ in range(25)]
        start = 0 if ti else offset
        if not ti and not offset:
            pvs = [pv + (40 if direct else -40) for pv in pvs]
        want = formula(
            pvs, 2000, 2000 if ti else start, offset, direct=direct, velocity=velocity, gain=gain, ts=0.1, ti=ti, td=td
        )
        got = controlled(
            pvs,
            sp=2000.0,
            out=2000.0,
            offset=float(offset),
            direct=int(direct),
            velocity=int(velocity),
            gain=float(gain),
            reset=float(ti),
            rate=float(td),
        )
        for value, exact in zip(got, want, strict=True):
            assert abs(value - min(max(exact, 0), 4095)) <= Fraction(1, 2) + Fraction(1, 10**9)


def test_the_deadband_of_a_square_root_loop_is_on_the_roots_scale():
    outs = controlled(
        [1024.0, 961.0], sp=30.0, gain=1.0, square_root=1, scale=64.0, direct=1, deadband=1.5, offset=1000.0
    )

    assert outs == [1000.0 + 128.0, 1000.0]


# --- Cascades of the virtual EZLogix by a shared register, loops without a sample rate, and a stopped PLC that goes on

PI = {"proportional_gain": 2, "integral_time": 10}
PULSE = {"tag": "O1", "cycle_time": 1.0}


def mode(machine, i=0):
    return machine.mode(machine.states[i].status)


# --- no sample rate --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("raw", [0, 1, 4])
def test_without_a_sample_rate_a_loop_is_not_calculated(raw):
    machine = _with_word(100, raw)
    said = play(machine, 5, [50.0])

    assert machine.periods == [0]
    assert (machine.states[0].due > 10**15, mode(machine)) == (True, "manual")
    assert said == [(0, "L1", "auto", "waits: the loop is not calculated, its sample rate is below 0.05 s")]


def _with_word(number, raw):
    made = image({**SCALED, "mode": "auto", "setpoint": {"value": 50}})
    cells = tuple(replace(cell, raw=raw) if cell.number == number else cell for cell in made.cells)
    return load(replace(made, cells=cells))


def test_the_least_sample_rate_is_calculated():
    assert _with_word(100, 5).periods == [50_000]


def test_a_loop_that_gets_a_sample_rate_begins():
    machine = _with_word(100, 0)
    play(machine, 3, [40.0])
    assert change(machine, "sample_rate", 0.1) is None
    play(machine, 1, [40.0], start=3)
    assert (mode(machine), machine.states[0].pv) == ("auto", 1638.0)
    assert change(machine, "sample_rate", 0) == "the loop is not calculated: its sample rate is below 0.05 s"
    play(machine, 2, [60.0], start=4)

    assert machine.states[0].pv == 1638.0


def test_from_then_on_it_keeps_its_rate():
    machine = _with_word(100, 0)
    play(machine, 3, [40.0])
    change(machine, "sample_rate", 0.3)
    seen = []
    for k in range(3, 12):
        play(machine, 1, [float(k)], start=k)
        seen.append(round(machine.signal_values[PV]))

    assert seen == [3, 3, 3, 6, 6, 6, 9, 9, 9]


# --- cascade ---------------------------------------------------------------------------------------------------------


def test_a_cv_tag_that_is_a_set_point_register_makes_a_cascade():
    outer = {"output": {"tag": "R201"}, "tuning": {"proportional_gain": 1}, "setpoint": {"value": 2000}, "mode": "auto"}
    machine = plc(outer, {"setpoint": {"value": 700}, "mode": "auto"}, {"output": {"tag": "R102"}})
    assert [c.inner_loop for c in machine.configs] == [1, -1, -1]
    assert machine.states[0].out == 700.0, "the register already holds the inner loop's set point"
    play(machine, 1, [1700.0, 0.0, 0.0])

    assert (machine.states[0].out, machine.states[1].sp, machine.signal_values[COLUMNS + SP]) == (300.0, 300.0, 300.0)
    assert machine.states[1].out == 300.0
    assert change(machine, "setpoint", 900, loop=1) == "the CV of L1 stands in the same register and overwrites it"
    assert (machine.states[0].out, machine.signal_values[CV], machine.signal_values[COLUMNS + SP]) == (
        900.0,
        900.0,
        900.0,
    ), "one register"
    assert change(machine, "setpoint", 900, loop=0) is None
    play(machine, 1, [1700.0, 0.0, 0.0], start=1)
    assert (machine.states[0].sp, machine.states[1].sp) == (900.0, 0.0)
    change(machine, "sample_rate", 0, loop=0)
    assert change(machine, "setpoint", 800, loop=1) is None


def test_an_inner_loop_that_comes_first_takes_the_cv_of_the_sample_before():
    outer = {"output": {"tag": "R101"}, "tuning": {"proportional_gain": 1}, "setpoint": {"value": 2000}, "mode": "auto"}
    machine = plc({"setpoint": {"value": 700}}, outer)
    play(machine, 1, [0.0, 1700.0])
    assert (machine.signal_values[ERROR], machine.signal_values[SP]) == (700.0, 300.0), (
        "calculated with the one, then written"
    )
    play(machine, 1, [0.0, 1700.0], start=1)

    assert (machine.signal_values[ERROR], machine.signal_values[SP]) == (300.0, 300.0)


def cascade(**inner):
    """An outer loop every 0.1 s, whose CV is the set point of an inner one every 0.5 s; its limits are 500 and 900."""
    outer = {"output": {"tag": "R201"}, "setpoint": {"value": 2000}, "tuning": {"proportional_gain": 1}, "mode": "auto"}
    limits = {"setpoint": {"value": 700, "limits": [500, 900]}, "sample_rate": 0.5, "mode": "auto"}
    return plc(outer, {**limits, **inner})


def trace(machine, *events):
    """All signals after each of 24 base steps with a moving outer PV; events: step, loop, key, value."""
    rows = []
    for k in range(24):
        for at, loop, key, value in events:
            if at == k:
                change(machine, key, value, loop)
        play(machine, 1, [1100.0 + 100.0 * (k % 7), 600.0], start=k)
        rows.append(tuple(machine.signal_values))
    return rows


@pytest.mark.parametrize("loop", [0, 1])
@pytest.mark.parametrize("at", [1, 3, 7, 12])
def test_an_event_that_changes_nothing_leaves_no_trace_in_a_cascade(at, loop):
    """The words are the same with it and without, so the trend is."""
    assert trace(cascade(), (at, loop, "output.limits", [0, 4095])) == trace(cascade())


def test_set_point_and_outer_cv_are_one_register_in_every_sample():
    machine = cascade()
    for k in range(24):
        play(machine, 1, [1100.0 + 100.0 * (k % 7), 600.0], start=k)
        cv, sp = machine.signal_values[CV], machine.signal_values[COLUMNS + SP]
        assert sp == min(max(cv, 500.0), 900.0)
        if k % 5 == 0:
            assert machine.states[1].sp == sp


def test_a_set_point_limit_of_the_inner_loop_changes_the_outer_cv():
    machine = cascade(sample_rate=0.1)
    play(machine, 1, [1900.0, 600.0])
    assert (machine.states[0].out, machine.signal_values[CV], machine.signal_values[COLUMNS + SP]) == (
        500.0,
        500.0,
        500.0,
    )
    machine.request(0, "manual")
    play(machine, 3, [1900.0, 600.0], start=1)
    assert machine.signal_values[CV] == 500.0, "Manual holds what the register has"


def test_in_manual_whoever_writes_the_register_writes_both():
    machine = cascade()
    machine.request(0, "manual")
    play(machine, 2, [1900.0, 600.0])
    assert change(machine, "setpoint", 800, loop=1) is None
    assert (machine.signal_values[CV], machine.signal_values[COLUMNS + SP]) == (800.0, 800.0)
    assert change(machine, "output", 600, loop=0) is None
    assert (machine.signal_values[CV], machine.signal_values[COLUMNS + SP], machine.states[1].sp) == (
        600.0,
        600.0,
        600.0,
    )
    play(machine, 20, [1900.0, 600.0], start=2)
    assert (machine.signal_values[CV], machine.signal_values[COLUMNS + SP]) == (600.0, 600.0)


# --- the PLC's switch ------------------------------------------------------------------------------------------------

AUTO = {**SCALED, "mode": "auto", "setpoint": {"value": 50}, "tuning": PI}


@pytest.mark.parametrize("pulse", [None, PULSE])
def test_with_physical_tags_a_loop_goes_on(pulse):
    machine = plc({**AUTO, "output": {**SCALED["output"], "pulse": pulse}})
    play(machine, 2, [49.0])
    machine.program(machine.signal_values)
    said = play(machine, 3, [45.0], start=2)
    before = machine.signal_values[CV]
    play(machine, 1, [45.0], start=5)

    assert said == []
    assert machine.signal_values[PV] == pytest.approx(45.0, abs=0.02)
    assert machine.signal_values[CV] > before
    integral = machine.states[0].integral
    machine.run(600_000)
    play(machine, 1, [50.0], start=6)
    assert machine.states[0].integral == pytest.approx(integral, abs=0.1), "it went on: there is no new start"


def test_a_pv_in_an_r_register_stands_still_while_the_loop_goes_on():
    machine = plc({**AUTO, "pv": {**SCALED["pv"], "tag": "R1"}})
    play(machine, 2, [49.0])
    machine.program(machine.signal_values)
    before = machine.states[0].integral
    said = play(machine, 3, [60.0], start=2)

    assert said == [(2, "L1", None, "the PLC is stopped: the loop goes on, but nothing renews its PV in an R register")]
    assert machine.signal_values[PV] == pytest.approx(49.0, abs=0.02)
    assert machine.states[0].integral > before
    machine.run(500_000)
    play(machine, 1, [60.0], start=5)
    assert machine.signal_values[PV] == pytest.approx(60.0, abs=0.02)


def test_a_cv_in_an_r_register_does_not_reach_its_output():
    machine = plc({**AUTO, "output": {**SCALED["output"], "tag": "R2"}})
    play(machine, 2, [49.0])
    machine.program(machine.signal_values)
    before = machine.signal_values[CV]
    said = play(machine, 3, [40.0], start=2)

    what = "the PLC is stopped: the loop goes on, but nothing carries its CV from an R register to an output"
    assert said == [(2, "L1", None, what)]
    assert machine.signal_values[CV] == before
    assert machine.states[0].out > before / 50 * 4095 + 100
    machine.run(500_000)
    play(machine, 1, [40.0], start=5)
    assert machine.signal_values[CV] == pytest.approx(machine.states[0].out * 50 / 4095)


def test_a_control_output_drives_the_process_by_itself():
    machine = plc({**AUTO, "output": {**SCALED["output"], "tag": "R2", "pulse": PULSE}})
    play(machine, 2, [49.0])
    machine.program(machine.signal_values)

    assert play(machine, 3, [40.0], start=2) == []
    assert machine.signal_values[CV] == pytest.approx(machine.states[0].out * 50 / 4095)


def test_stop_when_stopped_and_run_when_running_change_nothing():
    machine = plc(AUTO, process_when_stopped=False)
    play(machine, 3, [49.0])
    due, pending = machine.states[0].due, machine.states[0].pending
    machine.run(300_000)
    assert (machine.states[0].due, machine.states[0].pending) == (due, pending)
    machine.program(machine.signal_values)
    play(machine, 1, start=3)
    machine.program(machine.signal_values)

    assert play(machine, 1, start=4) == []


# --- The decisions of the virtual EZLogix are numbered without a gap, and each is named where it is carried out -------

FOLDER = Path(ezlogix_decisions.__file__).parent


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE] == [*range(160, 180), 623, 670, 672]


@pytest.mark.parametrize("decision", ENGINE, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    text = "".join(m.read_text("utf-8") for m in sorted(FOLDER.glob("*.py")) if m.name != "decisions.py")

    assert f"D{decision.number}" in text
