"""EZLogix's equation and modes in single steps; whole runs stand in trajectories."""

from __future__ import annotations

import copy
import io
import random
from dataclasses import replace
from fractions import Fraction
from itertools import accumulate, pairwise
from pathlib import Path

import pytest

from ezlogix_rig import COLUMNS, CV, ERROR, LOOP, PV, SCALED, SP, O, Rig, change, image, play, plc
from pidcfg.encoders.ezlogix.image import encode
from pidcfg.schemas.ezlogix import EzlogixFile
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers import ezlogix as ezlogix_decisions
from pidcfg.sim.controllers.ezlogix import ENGINE_DECISIONS
from pidcfg.sim.controllers.ezlogix import scan as ezlogix
from pidcfg.sim.controllers.ezlogix.scan import load
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.run import Settings, simulate
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
    assert [decision.number for decision in ENGINE_DECISIONS] == [*range(160, 180), 623, 670, 672]


@pytest.mark.parametrize("decision", ENGINE_DECISIONS, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    text = "".join(m.read_text("utf-8") for m in sorted(FOLDER.glob("*.py")) if m.name != "decisions.py")

    assert f"D{decision.number}" in text


# --- EZLogix loops in scenarios, and the pulses of their control outputs ----------------------------------------------


# --- Scenarios on the virtual EZLogix, from the configuration to the report: what it would do to a process ------------

OVEN = {
    **LOOP,
    "name": "OVEN1",
    "mode": "auto",
    "sample_rate": 0.5,
    "tuning": {"proportional_gain": 1.8, "integral_time": 22.5, "derivative_time": 5},
    "pv": {"tag": "IR1", "range": [0, 400], "unit": "degC"},
    "setpoint": {"value": 180, "limits": [0, 300]},
    "output": {"tag": "OR1", "range": [0, 100]},
}
HEATER = {"model": "first_order", "gain": 3.5, "load": 20, "time_constant": 60, "dead_time": 5, "initial": 20}
COOLER = {"model": "first_order", "gain": -3.5, "load": 340, "time_constant": 60, "dead_time": 5, "initial": 340}
PULSES = {"tag": "O1", "cycle_time": 10}


def simulated(loop=None, plant=None, engine="python", plc=None, **given):
    """The report and the trend (a list of rows by column) of a scenario on one oven."""
    own = {**copy.deepcopy(OVEN), **(loop or {})}
    config = EzlogixFile.model_validate({"pidcfg": 1, "vendor": "ezlogix", "plc": plc or {}, "loops": [own]})
    image = encode(config).image
    plants = {"OVEN1": plant or HEATER}
    text = {"pidcfg": 1, "scenario": "s", "config": "c", "duration": 600, "plants": plants, **given}
    out = io.StringIO()
    settings = Settings(engine=engine, trend=out)
    report = simulate(Scenario.model_validate(text), lambda: ezlogix.load(image), ezlogix, settings)
    head, *rows = (line.split(",") for line in out.getvalue().splitlines())
    return report, {name: [float(row[k]) for row in rows] for k, name in enumerate(head)}


@pytest.mark.parametrize("algorithm", ["position", "velocity"])
@pytest.mark.parametrize(("plant", "action"), [(HEATER, "reverse"), (COOLER, "direct")])
def test_heating_with_reverse_and_cooling_with_direct_action_settle(plant, action, algorithm):
    report, trend = simulated({"action": action, "algorithm": algorithm}, plant)

    assert trend["OVEN1.PV"][-1] == pytest.approx(180.0, abs=1.0)
    assert 5.0 < report.signals["OVEN1.CV"].final < 95.0
    assert report.passed


@pytest.mark.parametrize("algorithm", ["position", "velocity"])
@pytest.mark.parametrize(
    ("plant", "action", "end", "cv"),
    [
        (HEATER, "direct", 20.0, 0.0),
        (COOLER, "reverse", 340.0, 0.0),
        ({**HEATER, "initial": 250}, "direct", 370.0, 100.0),
        ({**COOLER, "initial": 100}, "reverse", -10.0, 100.0),
    ],
)
def test_the_wrong_action_runs_away_to_a_limit(plant, action, end, cv, algorithm):
    report, _ = simulated({"action": action, "algorithm": algorithm}, plant, initial={"OVEN1": 50})

    assert report.signals["OVEN1.CV"].final == cv
    assert report.signals["OVEN1.PV"].final == pytest.approx(min(max(end, 0.0), 400.0), abs=1.0)
    assert report.loops["OVEN1"].flags["saturation"]


def test_the_derivative_of_the_pv_damps_whatever_the_action():
    """A gain near the limit of stability swings; the sign that the manual prints would make it worse for one action."""
    for plant, action in ((HEATER, "reverse"), (COOLER, "direct")):
        swing = {}
        for rate in (0, 1):
            tuning = {"proportional_gain": 22, "integral_time": 100, "derivative_time": rate}
            _, trend = simulated({"action": action, "algorithm": "velocity", "tuning": tuning}, plant)
            late = trend["OVEN1.PV"][-300:]
            swing[rate] = max(late) - min(late)
        assert swing[1] < 0.1 * swing[0]


def test_a_loop_in_auto_starts_there_and_in_manual_stays():
    report, _ = simulated(
        {"mode": "manual"}, initial={"OVEN1": 30}, events=[{"at": 100, "loop": "OVEN1", "mode": "auto"}]
    )
    modes = [(m.at, m.requested, m.mode, m.reason) for m in report.loops["OVEN1"].modes]
    assert modes == [(100.0, "auto", "auto", None)]
    report, trend = simulated(initial={"OVEN1": 30})

    assert [(m.at, m.mode) for m in report.loops["OVEN1"].modes] == [(0.0, "auto")]
    assert trend["OVEN1.BIAS"][0] == pytest.approx(30.0 + 1.8 * (0.5 / 22.5) * 40.0, abs=0.1)


def test_steady_is_steady():
    report, trend = simulated(initial="steady", duration=50)

    assert report.settled
    assert all(value == pytest.approx(180.0, abs=0.3) for value in trend["OVEN1.PV"])


@pytest.mark.parametrize("cycle", [2, 10])
def test_a_plant_on_the_control_output_settles_around_the_set_point(cycle):
    """The ripple is the slope of the process at full output times the shorter part of the cycle, and a little more."""
    plant = {**HEATER, "input": "OVEN1.O * 100"}
    output = {**OVEN["output"], "pulse": {**PULSES, "cycle_time": cycle}}
    report, trend = simulated(
        {"output": output, "tuning": {"proportional_gain": 1, "integral_time": 60}}, plant, step=0.1, duration=900
    )
    late = trend["OVEN1.PV"][-3000:]

    assert sum(late) / len(late) == pytest.approx(180.0, abs=1.0)
    duty = 160.0 / 350.0
    assert 1.0 < (max(late) - min(late)) / (duty * (1 - duty) * cycle * 350.0 / 60.0) < 1.7
    assert set(trend["OVEN1.O"]) == {0.0, 1.0}
    assert sum(trend["OVEN1.O"][-3000:]) / 3000 == pytest.approx(duty, abs=0.03)
    assert report.step == 0.1


def test_without_a_control_output_there_is_no_signal_of_it():
    assert "OVEN1.O" not in simulated()[1]
    assert "OVEN1.O" in simulated({"output": {**OVEN["output"], "pulse": PULSES}})[1]


def test_an_autotune_makes_gains_that_settle():
    events = [
        {"at": 0, "loop": "OVEN1", "autotune": "start"},
        {"at": 400, "loop": "OVEN1", "mode": "auto"},
        {"at": 700, "loop": "OVEN1", "set": {"setpoint": 200}},
    ]
    expect = [
        {"loop": "OVEN1", "autotune": "done"},
        {"loop": "OVEN1", "autotune": "integral_time", "min": 9, "max": 13},
        {"loop": "OVEN1", "metric": "settling_time", "max": 150},
    ]
    report, _ = simulated(
        {"mode": "manual"},
        {**HEATER, "initial": 160},
        initial={"OVEN1": 40},
        duration=1000,
        events=events,
        expect=expect,
    )
    tuned = report.loops["OVEN1"].autotune

    assert (tuned["done"], tuned["error"]) == (True, False)
    assert report.passed, report.expectations
    assert report.loops["OVEN1"].flags["autotune_running"]
    assert not report.loops["OVEN1"].flags["autotune_error"]


def test_an_autotune_with_the_wrong_action_fails_and_is_reported():
    """The PV falls where the action says that it rises: no gains, and the report says why."""
    plant = {**COOLER, "initial": 200}
    report, _ = simulated(
        {"mode": "manual"},
        plant,
        initial={"OVEN1": 40},
        duration=800,
        events=[{"at": 0, "loop": "OVEN1", "autotune": "start"}],
    )
    tuned = report.loops["OVEN1"].autotune

    assert (tuned["done"], tuned["error"], tuned["results"]) == (False, True, {})
    assert tuned["status"] == "6: the curve could not be fitted"
    assert report.loops["OVEN1"].flags["autotune_error"]
    assert [note.text for note in report.notes] == ["autotune: the curve could not be fitted (status 6)"]


@pytest.mark.parametrize(("processed", "pv"), [(True, 180.0), (False, None)])
def test_the_plc_stops_while_the_load_changes(processed, pv):
    events = [
        {"at": 300, "plc": "stop"},
        {"at": 300, "loop": "OVEN1", "disturb": {"load": 60}},
        {"at": 700, "plc": "run"},
    ]
    report, trend = simulated(plc={"process_when_stopped": processed}, events=events, duration=1000)
    at = {time: k for k, time in enumerate(trend["time"])}

    held = trend["OVEN1.CV"][at[300]]
    assert (trend["OVEN1.CV"][at[699]] == held) is not processed
    if pv is not None:
        assert trend["OVEN1.PV"][at[699]] == pytest.approx(pv, abs=1.0)
    assert trend["OVEN1.PV"][-1] == pytest.approx(180.0, abs=1.0)
    assert len(report.notes) == (not processed)


def test_both_engines_write_the_same_trend():
    pytest.importorskip("numba")
    given = {
        "loop": {"output": {**OVEN["output"], "pulse": PULSES}},
        "step": 0.1,
        "duration": 300,
        "seed": 3,
        "plant": {**HEATER, "noise": 0.3},
        "initial": {"OVEN1": 20},
        "events": [
            {"at": 50, "loop": "OVEN1", "autotune": "start"},
            {"at": 200, "loop": "OVEN1", "set": {"setpoint": 120}},
        ],
    }
    (slow, plain), (fast, compiled) = (simulated(engine=engine, **given) for engine in ("python", "numba"))

    assert plain == compiled
    assert (slow.engine, fast.engine, slow.signals, slow.loops) == ("python", "numba", fast.signals, fast.loops)


# --- The control output of the virtual EZLogix: widths, minimum times, cycles -----------------------------------------


def pulses(outs, base, cycle, **given):
    """The control output of each base step, while the CV (in Manual) is one of ``outs`` for one cycle each."""
    rig = Rig(base=base)
    times = {key: round(value * TICKS) for key, value in given.items() if key != "period"}
    _, s = rig.add(Fixed(), period=given.get("period", base), cycle=round(cycle * TICKS), **times)
    seen = []
    for out in outs:
        s.out = out
        for _ in range(round(cycle / base)):
            rig.step()
            seen.append(int(rig.signal_values[O]))
    return seen


def width(out, base=0.1, cycle=10.0, **given):
    """Base steps of the pulse of one cycle, which comes first in it; the first step of all knows no length yet."""
    seen = pulses([0.0, out], base, cycle, **given)[round(cycle / base) :]
    assert seen == sorted(seen, reverse=True)
    return sum(seen)


def test_a_fine_step_shows_the_gap_of_full_scale():
    assert width(4095.0, base=0.001, cycle=4.096) == 4095


@pytest.mark.parametrize(
    ("given", "out", "steps"),
    [
        ({"min_on": 1.0}, 1000.0, 1000),
        ({"min_on": 1.0}, 999.0, 0),
        ({"min_off": 1.0}, 3096.0, 3096),
        ({"min_off": 1.0}, 3097.0, 4096),
    ],
)
def test_a_time_that_equals_its_minimum_is_kept(given, out, steps):
    assert width(out, base=0.001, cycle=4.096, **given) == steps


def test_a_pulse_that_ends_in_the_middle_of_a_step_lasts_to_its_end():
    assert [width(out, base=0.001, cycle=2.048) for out in (1.0, 2.0, 3.0)] == [1, 1, 2]


def test_a_cycle_that_the_base_step_misses_keeps_its_mean_length():
    """Cycles of 0.25 s in steps of 0.1 s begin every 2 or 3 steps."""
    rig = Rig(base=0.1)
    rig.add(Fixed(), cycle=250_000, out=1600.0)
    seen = [rig.step() or rig.signal_values[O] for _ in range(40)]

    assert 14 <= sum(seen) <= 18
    starts = [k for k in range(1, 40) if seen[k] > seen[k - 1]]
    assert starts[-1] - starts[0] == pytest.approx(2.5 * (len(starts) - 1), abs=0.6)


@pytest.mark.parametrize(("out", "on"), [(4095.0, 20), (3072.0, 15), (1024.0, 5)])
def test_a_cycle_that_begins_within_a_step_loses_nothing_of_its_pulse(out, on):
    """The last cycles of 18.8 s in steps of 1 s begin at 75.2 s and 94 s: a step belongs to the cycle of its middle."""
    rig = Rig(base=1.0)
    rig.add(Fixed(), cycle=18_800_000, out=out)
    seen = [rig.step() or rig.signal_values[O] for _ in range(94)]

    assert sum(seen) == pytest.approx(on / 20 * 94, abs=1.5)
    assert seen[75:77] == [1, 1]


@pytest.mark.parametrize("cycle", [100_000, 500_000])
def test_a_cycle_shorter_than_the_base_step_starts_over_at_each_one(cycle):
    rig = Rig(base=1.0)
    rig.add(Fixed(), cycle=cycle, out=4095.0)
    rig.step(100)

    assert rig.states[0].cycle_start == 99_000_000


def test_without_a_control_output_or_a_cycle_time_there_is_none():
    rig = Rig()
    rig.add(Fixed(), out=4095.0)
    rig.step(30)
    assert rig.signal_values[O] == 0.0
    machine = plc({"output": {"tag": "OR1", "pulse": {"tag": "O1", "cycle_time": 2}}}, {})

    assert [c.cycle for c in machine.configs] == [2_000_000, 0]
    assert [name for name in machine.signals if name.endswith(".O")] == ["L1.O"]
