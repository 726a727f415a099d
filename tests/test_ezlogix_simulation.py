"""EZLogix loops in scenarios, and the pulses of their control outputs."""

from __future__ import annotations

import copy
import io

import pytest

from ezlogix_rig import LOOP, O, Rig, plc
from pidcfg.encoders.ezlogix.image import encode
from pidcfg.schemas.ezlogix import EzlogixFile
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.ezlogix import scan as ezlogix
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.engine.run import Settings, simulate
from rig_plants import Fixed

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
PULSE = {"tag": "O1", "cycle_time": 10}


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
    output = {**OVEN["output"], "pulse": {**PULSE, "cycle_time": cycle}}
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
    assert "OVEN1.O" in simulated({"output": {**OVEN["output"], "pulse": PULSE}})[1]


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
        "loop": {"output": {**OVEN["output"], "pulse": PULSE}},
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
