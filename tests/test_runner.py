"""The run: closed loops against their closed form, metrics by hand, events to the step, noise, faults, limits."""

from __future__ import annotations

import io
import math
from itertools import pairwise

import pytest

from pidcfg.sim.engine.events import describe_event
from pidcfg.sim.engine.recording import GROUP_VALUES, MAX_POINTS, Recording
from pidcfg.sim.engine.run import Settings, UnusableError, simulate
from scenario_rig import Controller, rows, run, scenario

QUIET = "plants:\n  B: {model: dead_time, input: 50}\n"
"""Loop B out of the way: its PV is its set point."""


def test_a_proportional_loop_on_a_first_order_plant_follows_its_closed_form():
    report, trend = run(
        "plants:\n  A: {model: first_order, gain: 1.5, time_constant: 5, initial: 10}\n" + QUIET[8:], duration=60
    )
    a, kp, gain = -math.expm1(-1 / 5), 2.0, 1.5
    end, factor = kp * gain * 50 / (1 + kp * gain), 1 - a * (1 + kp * gain)
    pv = [end + (10 - end) * factor**k for k in range(61)]
    assert rows(trend)["A.PV"] == pytest.approx(pv, rel=1e-9)
    assert report.loops["A"].metrics["iae"] == pytest.approx(sum(abs(50 - v) for v in pv[:-1]), rel=1e-9)
    assert report.loops["A"].metrics["ise"] == pytest.approx(sum((50 - v) ** 2 for v in pv[:-1]), rel=1e-9)
    assert report.loops["A"].metrics["itae"] == pytest.approx(
        sum(abs(50 - v) * k for k, v in enumerate(pv[:-1])), rel=1e-9
    )
    assert report.loops["A"].metrics["final_error"] == pytest.approx(50 - pv[-1], rel=1e-9)


def test_plants_hold_their_initial_value_at_time_zero_and_answer_one_step_later():
    _, trend = run("plants:\n  A: {model: dead_time, initial: 10}\n" + QUIET[8:])
    assert rows(trend)["A.PV"][:4] == [10, 80, -60, 220]
    assert rows(trend)["A.OUT"][:4] == [80, -60, 220, -340]


def test_the_trend_has_every_step_from_zero_to_the_end_with_exact_times():
    _, trend = run(QUIET, duration=10.2, step=0.3)
    times = [line.split(",")[0] for line in trend.splitlines()]
    assert times[:6] == ["time", "0", "0.3", "0.6", "0.9", "1.2"]
    assert (len(times), times[-1]) == (36, "10.2")
    assert trend.splitlines()[0] == "time,A.PV,A.SP,A.OUT,A.BIAS,B.PV,B.SP,B.OUT,B.BIAS"
    _, thin = run(QUIET, duration=10, every=4)
    assert rows(thin)["time"] == [0, 4, 8]


FOLLOW = "signals: {x: 0, ramp: 0}\nconnect: {A.PV: x, B.PV: 50}\n"


SWING = "plants:\n  A: {model: first_order, gain: 1, time_constant: 1, load: LOAD, initial: 50}\n" + QUIET[8:]
"""Loop A, a sample a second: swings to its set point of 60 with a factor of -0.9 a sample, where the load is 60."""


def swing(at=2, to=60, load=60, **events):
    """A step of loop A's set point, and other events."""
    more = "".join(f"  - {event}\n" for event in events.values())
    return f"{SWING}events:\n  - {{at: {at}, loop: A, set: {{setpoint: {to}}}}}\n{more}".replace("LOAD", str(load))


def of_trend(trend, at, before, after, band=0.05, until=None):
    """Overshoot, settling time and rise time of a step by the rows of the trend."""
    pv = rows(trend)["A.PV"][at:until]
    shares = [(value - before) / (after - before) for value in pv]
    outside = max((k for k, share in enumerate(shares) if abs(share - 1) > band), default=-1)
    rise = next(k for k, share in enumerate(shares) if share >= 0.9) - next(
        k for k, share in enumerate(shares) if share >= 0.1
    )
    return max(0.0, max(shares) - 1) * 100, float(outside + 1), float(rise)


@pytest.mark.parametrize("to", [60, 40])
def test_overshoot_settling_and_rise_time_count_from_the_set_point_event(to):
    expect = "expect:\n" + "".join(
        f"  - {{loop: A, metric: settling_time, band: {band} %, max: 1000}}\n" for band in (12, 3)
    )
    report, trend = run(swing(to=to, load=to) + expect, duration=60)
    metrics = report.loops["A"].metrics
    found = metrics["overshoot"], metrics["settling_time"], metrics["rise_time"]
    assert found == pytest.approx(of_trend(trend, 2, 50, to))
    assert report.loops["A"].until is None
    assert found[1] > 10
    bands = [of_trend(trend, 2, 50, to, band)[1] for band in (0.12, 0.03)]
    assert [v.value for v in report.expectations] == bands
    assert bands[0] < found[1] < bands[1]


MOVES = {
    "its plant": "{at: 40, plant: A, disturb: {load: 90}}",
    "a signal": "{at: 40, set: {x: 30}}",
    "the loop itself": "{at: 40, loop: A, set: {gain: 1.5}}",
    "its mode": "{at: 40, loop: A, mode: manual}",
    "its sensor": "{at: 40, loop: A, pv: 7, for: 3}",
    "another loop": "{at: 40, loop: B, set: {setpoint: 81}}",
    "the CPU": "{at: 40, plc: program}",
}
STAYS = {
    "a loop without a path": "{at: 40, loop: B, set: {setpoint: 80}}",
    "a signal without a path": "{at: 40, set: {y: 30}}",
    "a plant without a path": "{at: 40, plant: B, disturb: {load: 9}}",
    "nothing new": "{at: 40, set: {x: 0}}",
    "the start of a sensor's fault long after": "{at: 70, loop: A, pv: 7}",
}
LINKED = "signals: {x: 0, y: 0}\n"


@pytest.mark.parametrize(
    ("event", "moves"), [*((e, True) for e in MOVES.values()), *((e, False) for e in STAYS.values())]
)
def test_a_step_is_measured_up_to_the_next_event_that_moves_the_loop(event, moves):
    text = LINKED + swing(load=60, other=event).replace("  A: {model", "  A: {input: A.OUT + x + LINK * B.OUT, model")
    text = text.replace("LINK", "1" if event == MOVES["another loop"] else "0")
    alone, trend = run(text.replace(event, "{at: 90, set: {y: 1}}"), duration=60)
    report, moved = run(text, duration=60)
    metrics, before = report.loops["A"].metrics, alone.loops["A"].metrics
    for name in ("overshoot", "settling_time", "rise_time"):
        assert metrics[name] == before[name] is not None
    assert before["settling_time"] == of_trend(trend, 2, 50, 60)[1] < 38
    assert report.loops["A"].until == (40 if moves else None)
    assert (moved != trend) or not moves or "mode" in event or "plc" in event


@pytest.mark.parametrize(("at", "settled"), [(3, None), (20, None), (29, None), (30, 27.0), (31, 27.0), (45, 27.0)])
def test_a_step_that_had_not_settled_when_the_next_event_came_has_no_settling_time(at, settled):
    expect = "expect:\n" + "".join(f"  - {{loop: A, metric: {m}, max: 1000}}\n" for m in ("settling_time", "overshoot"))
    report, _ = run(swing(other=f"{{at: {at}, plant: A, disturb: {{load: 300}}}}") + expect, duration=60)
    loop = report.loops["A"]
    assert loop.metrics["settling_time"] == settled
    assert (loop.metrics["overshoot"] is None) == (settled is None)
    assert loop.until == at
    assert [v.passed for v in report.expectations] == [settled is not None] * 2
    why = f" (not settled at {at} s, when an event moved it)" if settled is None else ""
    assert report.expectations[0].text == f"A settling_time at most 1000 s{why}"


def test_metrics_of_a_step_are_null_without_a_step_and_when_it_was_never_reached():
    report, _ = run(FOLLOW)
    assert [report.loops["A"].metrics[m] for m in ("overshoot", "settling_time", "rise_time")] == [None, None, None]
    report, _ = run(
        FOLLOW
        + "events: [{at: 1, loop: A, set: {setpoint: 60}}]\nexpect: [{loop: A, metric: settling_time, max: 1 h}]\n"
    )
    assert report.loops["A"].metrics["settling_time"] is None
    assert [v.passed for v in report.expectations] == [False]


def test_the_last_set_point_event_counts():
    again = "{at: 40, loop: A, set: {setpoint: 59}}"
    report, trend = run(swing(other="{at: 20, plant: A, disturb: {load: 59}}", last=again), duration=90)
    metrics = report.loops["A"].metrics
    assert (metrics["overshoot"], metrics["settling_time"], metrics["rise_time"]) == pytest.approx(
        of_trend(trend, 40, 60, 59)
    )


def test_a_step_is_measured_to_where_the_controller_limits_the_set_point():
    report, trend = run(swing(to=400, load=100), duration=60)
    assert report.loops["A"].metrics["overshoot"] == pytest.approx(of_trend(trend, 2, 50, 100)[0])
    assert report.loops["A"].metrics["overshoot"] > 10


def test_total_variation_is_the_way_the_output_went():
    report, _ = run(FOLLOW + "events:\n  - {at: 2, set: {x: 10}}\n  - {at: 4, set: {x: 5}}\n  - {at: 6, set: {x: 5}}\n")
    assert report.loops["A"].metrics["total_variation"] == 30.0


def test_signals_report_smallest_largest_and_last_value():
    report, _ = run(
        FOLLOW + "events:\n  - {at: 2, set: {x: 10}}\n  - {at: 4, set: {x: -5}}\n  - {at: 6, set: {x: 5}}\n"
    )
    assert (report.signals["A.PV"].low, report.signals["A.PV"].high, report.signals["A.PV"].final) == (-5, 10, 5)
    assert (report.signals["x"].low, report.signals["x"].high, report.signals["x"].final) == (-5, 10, 5)
    assert (report.signals["A.OUT"].low, report.signals["A.OUT"].high) == (80, 110)


def test_set_points_report_their_extremes_too():
    events = "events:\n  - {at: 2, loop: A, set: {setpoint: 40}}\n  - {at: 4, loop: A, set: {setpoint: 60}}\n"
    report, _ = run(FOLLOW + events + "  - {at: 6, loop: A, set: {setpoint: 55}}\n")
    assert (report.signals["A.SP"].low, report.signals["A.SP"].high, report.signals["A.SP"].final) == (40, 60, 55)


def test_a_window_limits_what_an_expectation_looks_at():
    report, _ = run(
        FOLLOW + "events:\n  - {at: 2, set: {x: 10}}\n  - {at: 4, set: {x: 3}}\nexpect:\n"
        "  - {signal: x, max: 5, from: 4}\n  - {signal: x, max: 5, from: 3}\n"
        "  - {signal: x, max: 5, until: 1}\n  - {signal: x, max: 5, until: 2}\n"
        "  - {signal: x, final: 3.4, tolerance: 0.5}\n  - {signal: x, final: 3.6, tolerance: 0.5}\n"
        "  - {signal: x, min: 0, max: 10}\n  - {signal: x, min: 0, max: 9}\n"
    )
    assert [v.passed for v in report.expectations] == [True, False, True, False, True, False, True, False]
    assert report.expectations[6].value == [0, 10]


def test_a_window_without_a_base_step_does_not_pass_by_being_empty():
    report, _ = run(FOLLOW + "expect: [{signal: x, max: 5, from: 1.2, until: 1.8}]\n")
    assert [(v.passed, v.value) for v in report.expectations] == [(False, None)]


def test_an_event_between_two_steps_takes_effect_at_the_next_one():
    _, trend = run(FOLLOW + "events:\n  - {at: 2, set: {x: 1}}\n  - {at: 3.1, set: {x: 2}}\n")
    assert rows(trend)["x"][:6] == [0, 0, 1, 1, 2, 2]


def test_events_of_one_moment_happen_in_the_order_of_the_file():
    _, trend = run(FOLLOW + "events:\n  - {at: 2, set: {x: 1}}\n  - {at: 2, set: {x: 7}}\n  - {at: 1, set: {x: 3}}\n")
    assert rows(trend)["x"][:4] == [0, 3, 7, 7]


def test_a_disturbance_replaces_a_number_of_the_plant_and_its_signal():
    _, trend = run(
        "plants:\n  A: {model: dead_time, gain: 0, load: 5}\n  B: {model: dead_time, input: A.load * 2}\n"
        "events: [{at: 3, loop: A, disturb: {load: 8}}]\n",
    )
    assert rows(trend)["A.PV"][:6] == [5, 5, 5, 8, 8, 8]
    assert rows(trend)["B.PV"][:6] == [10, 10, 10, 16, 16, 16]


def test_a_changed_time_constant_makes_the_plant_slower_from_then_on():
    _, trend = run(
        "plants:\n  A: {model: first_order, input: 1, time_constant: 1, initial: 0}\n"
        + QUIET[8:]
        + "events: [{at: 2, loop: A, disturb: {time_constant: 10}}]\n",
    )
    pv = rows(trend)["A.PV"]
    assert pv[1] == pytest.approx(1 - math.exp(-1), rel=1e-9)
    assert pv[2] == pytest.approx(1 - math.exp(-1.1), rel=1e-9)
    assert pv[3] == pytest.approx(1 - math.exp(-1.2), rel=1e-9)


def test_a_broken_sensor_shows_its_value_from_the_event_to_its_end_and_nothing_else_changes():
    text = "plants:\n  A: {model: dead_time, input: 42}\n  B: {model: dead_time, input: A.PV}\n"
    _, trend = run(text + "events: [{at: 2, loop: A, pv: 7, for: 3}]\n")
    assert rows(trend)["A.PV"] == [42, 42, 7, 7, 7, 42, 42, 42, 42, 42, 42]
    assert set(rows(trend)["B.PV"]) == {42}, "the process itself has not changed"
    _, trend = run(text + 'events: [{at: 2, loop: A, pv: "100 counts"}]\n')
    assert rows(trend)["A.PV"] == [42, 42] + [10] * 9


def test_a_later_fault_outlasts_the_end_of_an_earlier_one():
    text = "plants:\n  A: {model: dead_time, input: 42}\n" + QUIET[8:]
    _, trend = run(text + "events: [{at: 1, loop: A, pv: 7, for: 3}, {at: 2, loop: A, pv: 9, for: 4}]\n")
    assert rows(trend)["A.PV"] == [42, 7, 9, 9, 9, 9, 42, 42, 42, 42, 42]


def test_a_connected_pv_can_break_too():
    _, trend = run(FOLLOW + "events: [{at: 2, loop: A, pv: 7, for: 2}]\n")
    assert rows(trend)["A.PV"][:6] == [0, 0, 7, 7, 0, 0]


def test_a_pv_to_which_nothing_is_wired_can_break_and_comes_back_to_the_low_end():
    _, trend = run("plants:\n  B: {model: dead_time}\nevents: [{at: 2, loop: A, pv: 7, for: 2}]\n")
    assert rows(trend)["A.PV"][:6] == [0, 0, 7, 7, 0, 0]


def test_modes_are_logged_with_time_request_and_reason():
    report, _ = run(
        FOLLOW + "events:\n  - {at: 2, loop: A, mode: manual}\n  - {at: 3, loop: A, set: {gain: 0}}\n"
        "  - {at: 4, loop: A, mode: auto}\nexpect:\n  - {loop: A, mode: auto, at: 1}\n"
        "  - {loop: A, mode: auto, at: 2}\n  - {loop: A, mode: manual}\n"
    )
    modes = [(m.at, m.requested, m.mode, m.reason) for m in report.loops["A"].modes]
    assert modes == [
        (0, "auto", "auto", None),
        (2, "manual", "manual", None),
        (4, "auto", "manual", "refused: because"),
    ]
    assert [v.passed for v in report.expectations] == [True, False, True]


def test_alarms_are_logged_from_on_to_off():
    plc = Controller.load()
    plc.states[0].limit = 5.0
    events = "events:\n" + "".join(f"  - {{at: {at}, set: {{x: {x}}}}}\n" for at, x in [(2, 6), (4, 5), (7, 9)])
    report, _ = run(
        FOLLOW + events + "expect:\n"
        "  - {loop: A, alarm: high, never: true}\n  - {loop: A, alarm: high, at: 2}\n"
        "  - {loop: A, alarm: high, at: 3}\n  - {loop: A, alarm: high, at: 3, tolerance: 1}\n"
        "  - {loop: A, alarm: high, before: 2}\n  - {loop: A, alarm: high, before: 1.5}\n"
        "  - {loop: A, alarm: high, after: 2}\n  - {loop: A, alarm: high, after: 2.5}\n"
        "  - {loop: A, alarm: high, never: true, before: 2}\n"
        "  - {loop: A, alarm: high, never: true, before: 3}\n"
        "  - {loop: B, alarm: high, never: true}\n"
        "  - {loop: B, alarm: high, never: false}\n",
        plc,
    )
    assert [(a.alarm, a.at, a.cleared) for a in report.loops["A"].alarms] == [("high", 2, 4), ("high", 7, None)]
    assert [v.passed for v in report.expectations] == [
        False,
        True,
        False,
        True,
        True,
        False,
        True,
        False,
        True,
        False,
        True,
        False,
    ]


def test_flags_and_auto_tune_are_reported_and_expected():
    plc = Controller.load()
    report, _ = run(
        FOLLOW + "events:\n  - {at: 2, loop: A, autotune: start}\n  - {at: 3, loop: B, ramp_soak: jog}\n"
        "  - {at: 5, plc: program}\n  - {at: 6, plc: run}\nexpect:\n"
        "  - {loop: A, flag: odd}\n  - {loop: B, flag: odd}\n  - {loop: B, flag: complete, is: true}\n"
        "  - {flag: V1, is: 0x0000}\n  - {flag: V1, is: 0x0008}\n  - {flag: V1, is: false}\n"
        "  - {loop: A, autotune: done}\n  - {loop: B, autotune: done}\n"
        "  - {loop: A, autotune: error, is: false}\n  - {loop: A, autotune: gain, min: 2.5, max: 2.5}\n"
        "  - {loop: A, autotune: gain, max: 2.4}\n",
        plc,
    )
    assert plc.calls == [("autotune", 0, "start"), ("ramp_soak", 1, "jog"), ("program",), ("run", 6_000_000)]
    assert report.loops["A"].flags == {"odd": True, "complete": False}
    assert [v.passed for v in report.expectations] == [
        True,
        False,
        True,
        True,
        False,
        True,
        True,
        False,
        True,
        True,
        False,
    ]
    assert ("to manual: because", 6.0) in [(m.reason, m.at) for m in report.loops["A"].modes]


def test_a_set_that_has_no_effect_yet_is_noted():
    plants = "plants: {A: {model: first_order, gain: 0.1, time_constant: 5}}\nloops: [A]\n"
    report, _ = run(f"{plants}events: [{{at: 2, loop: A, set: {{limit: 5}}}}]\n")
    assert [(n.at, n.loop, n.text, n.error) for n in report.notes] == [(2, "A", "limit: is read later", False)]


def test_more_changes_than_the_log_holds_lose_nothing():
    plc = Controller.load()
    plc.states[0].limit = 0.5
    text = (
        "signals: {t: 0}\nplants:\n  - {name: n, model: dead_time, input: 0, noise: 1}\nconnect: {A.PV: n, B.PV: 50}\n"
    )
    report, trend = run(text, plc, duration=1500)
    on = [pv > 0.5 for pv in rows(trend)["A.PV"]]
    rises = [k for k in range(1501) if on[k] and not (k and on[k - 1])]
    assert len(rises) > 300
    assert [a.at for a in report.loops["A"].alarms] == rises


def test_lists_end_somewhere_and_say_what_they_leave_out():
    plc = Controller.load()
    plc.states[0].limit = 0.0
    text = "plants:\n  - {name: n, model: dead_time, input: 0, noise: 1}\nconnect: {A.PV: n, B.PV: 50}\n"
    report, _ = run(text, plc, duration=8000)
    found = report.loops["A"]
    assert len(found.alarms) in {1000, 1001}
    assert found.unlisted > 500


NOISY = "plants:\n  A: {model: dead_time, input: 20, noise: 0.5}\n  B: {model: dead_time, input: A.PV}\n"


def test_noise_is_reproducible_and_depends_on_the_seed():
    one, two, other = (run(NOISY, duration=500, seed=seed)[1] for seed in (3, 3, 4))
    assert one == two
    assert one != other


def test_noise_has_the_deviation_that_was_asked_for():
    pv = rows(run(NOISY, duration=4000)[1])["A.PV"]
    mean = sum(pv) / len(pv)
    deviation = math.sqrt(sum((v - mean) ** 2 for v in pv) / len(pv))
    assert mean == pytest.approx(20, abs=4 * 0.5 / math.sqrt(4000))
    assert deviation == pytest.approx(0.5, abs=4 * 0.5 / math.sqrt(8000))


def test_noise_stays_out_of_other_plants_but_not_out_of_connections():
    assert set(rows(run(NOISY)[1])["B.PV"]) == {20}
    text = "plants:\n  - {name: n, model: dead_time, input: 20, noise: 0.5}\nconnect: {A.PV: n, B.PV: n}\n"
    columns = rows(run(text)[1])
    assert columns["A.PV"] == columns["B.PV"] == columns["n"]
    assert len(set(columns["A.PV"])) == 11


def test_a_connection_sees_what_the_transmitter_of_a_loop_shows():
    text = "plants:\n  A: {model: dead_time, input: 20, noise: 0.5}\nconnect: {B.PV: A.PV * 2}\n"
    columns = rows(run(text)[1])
    assert columns["B.PV"] == pytest.approx([2 * v for v in columns["A.PV"]], rel=1e-9)
    assert len(set(columns["B.PV"])) == 11


def test_the_noise_of_one_plant_does_not_depend_on_the_others():
    both = "plants:\n  A: {model: dead_time, input: 20, noise: 0.5}\n  B: {model: dead_time, input: 20, noise: 0.5}\n"
    alone, pair = rows(run(NOISY)[1]), rows(run(both)[1])
    assert alone["A.PV"] == pair["A.PV"]
    assert pair["A.PV"] != pair["B.PV"]


def test_a_quiet_plant_can_be_made_noisy():
    text = (
        "plants:\n  A: {model: dead_time, input: 20}\n"
        + QUIET[8:]
        + "events: [{at: 5, loop: A, disturb: {noise: 1}}]\n"
    )
    pv = rows(run(text)[1])["A.PV"]
    assert pv[:5] == [20] * 5
    assert 20 not in pv[5:]


def test_plants_are_stepped_in_the_order_in_which_they_depend_on_each_other():
    text = (
        "plants:\n  - {name: last, model: dead_time, input: next}\n  - {name: next, model: dead_time, input: x * 2}\n"
    )
    _, trend = run("signals: {x: 1}\nconnect: {A.PV: last, B.PV: 50}\n" + text + "events: [{at: 2, set: {x: 5}}]\n")
    assert rows(trend)["A.PV"][:4] == [2, 2, 10, 10]


def test_plants_in_a_ring_read_the_step_before():
    text = "plants:\n  - {name: p, model: dead_time, input: q + 1}\n  - {name: q, model: dead_time, input: p}\n"
    _, trend = run(text + "connect: {A.PV: p, B.PV: 50}\n")
    assert [b - a for a, b in pairwise(rows(trend)["A.PV"])] == [1] * 10


def test_a_dead_time_between_two_base_steps_is_none_of_them():
    report, trend = run(
        "signals: {x: 1}\nplants:\n  A: {model: integrator, input: x - 1, dead_time: 2.4, initial: 1}\n"
        + QUIET[8:]
        + "events: [{at: 3, set: {x: 3}}, {at: 5, set: {x: 2}}]\n"
    )
    assert rows(trend)["A.PV"] == pytest.approx([1, 1, 1, 1, 1, 2.2, 4.2, 5.6, 6.6, 7.6, 8.6], rel=1e-9)
    assert not report.problems


def test_an_expression_without_a_value_holds_the_last_one_and_fails_the_run():
    report, trend = run(
        "signals: {x: 2}\nconnect: {A.PV: 10 / x, B.PV: sqrt(x)}\n"
        "events: [{at: 3, set: {x: 0}}, {at: 6, set: {x: -4}}]\n"
    )
    assert rows(trend)["A.PV"] == [5, 5, 5, 5, 5, 5, -2.5, -2.5, -2.5, -2.5, -2.5]
    assert [(n.at, n.text, n.error) for n in report.notes] == [
        (3, "A.PV: division by zero in '10 / x'; the signal kept its last value", True),
        (6, "B.PV: square root of a negative number in 'sqrt(x)'; the signal kept its last value", True),
    ]
    assert not report.passed


def test_a_plant_whose_input_has_no_value_keeps_the_last_one():
    report, trend = run(
        "signals: {x: 2}\nplants:\n  A: {model: dead_time, input: 10 / x}\n"
        + QUIET[8:]
        + "events: [{at: 3, set: {x: 0}}]\n"
    )
    assert set(rows(trend)["A.PV"]) == {5}
    assert [(n.at, n.text) for n in report.notes] == [
        (3, "input of A: division by zero in '10 / x'; the signal kept its last value")
    ]


def test_outputs_start_where_the_scenario_says():
    plc = Controller.load()
    for s in plc.states:
        s.status = 1
    _, trend = run("initial: {A: 30}\nplants:\n  A: {model: first_order, time_constant: 5}\n" + QUIET[8:], plc)
    assert rows(trend)["A.OUT"] == [30] * 11
    assert rows(trend)["A.PV"] == [30] * 11, "a plant without 'initial' rests where its input holds it"


def test_a_steady_start_is_settled_when_time_begins():
    text = "initial: steady\nplants:\n  A: {model: first_order, gain: 0.2, time_constant: 8, initial: 0}\n" + QUIET[8:]
    report, trend = run(text)
    end = 2 * 0.2 * 50 / 1.4
    assert rows(trend)["A.PV"] == pytest.approx([end] * 11, abs=2 * 2 * 0.1), "each within 2 counts of the mean"
    assert rows(trend)["A.PV"] != pytest.approx([0] * 11, abs=10)
    assert report.settled is not None
    assert report.settled % 8 == 0, "whole windows"
    assert [m.at for m in report.loops["A"].modes] == [0]


def test_a_network_that_never_settles_is_an_error_and_still_runs_from_its_initial_values():
    plc = Controller.load()
    plc.states[0].status = 1
    report, trend = run("initial: steady\nplants:\n  A: {model: integrator, load: 1, initial: 5}\n" + QUIET[8:], plc)
    assert [p.kind for p in report.problems] == ["no_steady_state"]
    assert "the PV of A still moves" in report.problems[0].message
    assert not report.passed
    assert report.settled is None
    assert rows(trend)["A.PV"][0] == 5


def test_the_pre_roll_counts_against_the_limit_on_loop_steps():
    text = (
        "initial: steady\nplants:\n  A: {model: first_order, gain: 0.1, time_constant: 500, initial: 5}\n" + QUIET[8:]
    )
    assert not run(text, limit=100_000)[0].problems
    report, _ = run(text, limit=999)
    assert [p.kind for p in report.problems] == ["no_steady_state"]


def test_a_thinned_trend_holds_rows_of_the_full_one_also_after_a_steady_start():
    text = "initial: steady\nplants:\n  A: {model: first_order, gain: 0.2, time_constant: 8, noise: 1}\n" + QUIET[8:]
    full, thin = run(text)[1].splitlines(), run(text, every=3)[1].splitlines()
    assert thin[1:] == full[1::3]


def test_a_plc_that_does_not_run_is_not_settled_but_shown():
    report, _ = run(
        "initial: steady\nplants:\n  A: {model: integrator, load: 1}\n" + QUIET[8:], Controller.load(running=False)
    )
    assert report.settled is None
    assert not report.problems


def test_the_limit_on_loop_steps_is_checked_before_the_run():
    assert run(FOLLOW, duration=10, limit=22)[0].steps == 11
    with pytest.raises(UnusableError, match="22 loop-steps; the limit is 21"):
        run(FOLLOW, duration=10, limit=21)


def test_a_scenario_shorter_than_its_step_cannot_run():
    with pytest.raises(UnusableError, match="shorter than its base step"):
        run(FOLLOW, duration=0.5)


def test_progress_goes_from_nothing_to_one():
    shares = []
    settings = Settings(progress=shares.append)
    simulate(scenario(FOLLOW, duration=40_000), Controller.load, Controller, settings)
    assert shares == sorted(shares)
    assert shares[-1] == 1


def test_the_trend_does_not_depend_on_how_often_python_looks(monkeypatch):
    whole = run(NOISY, duration=300)
    monkeypatch.setattr("pidcfg.sim.engine.run.CHUNK", 7)
    assert run(NOISY, duration=300) == whole


def test_without_a_sink_nothing_is_recorded():
    report = simulate(scenario(FOLLOW), Controller.load, Controller, Settings())
    sink = io.StringIO()
    assert simulate(scenario(FOLLOW), Controller.load, Controller, Settings(trend=sink)) == report
    assert sink.getvalue()


WIRED = "connect: {A.PV: 1, B.PV: 1}\n"


def test_only_an_event_that_names_the_set_point_starts_a_step(monkeypatch):
    plc = Controller.load()
    original = type(plc).set

    def also_moves_the_set_point(self, loop, path, value, signal_values):
        self.states[loop].sp += 1
        signal_values[self.configs[loop].sp_slot] += 1
        return original(self, loop, path, value, signal_values)

    monkeypatch.setattr(type(plc), "set", also_moves_the_set_point)
    plants = "plants: {A: {model: dead_time}, B: {model: dead_time}}\n"
    report, _ = run(plants + "events: [{at: 3, loop: A, set: {gain: 3}}, {at: 4, loop: B, set: {setpoint: 60}}]\n")
    assert report.loops["A"].metrics["overshoot"] is None
    assert report.loops["B"].metrics["overshoot"] is not None


def test_what_a_loop_says_apart_from_its_mode_is_a_note():
    plc = Controller.load()
    plc.states[0].notice = 3
    report, _ = run(WIRED, plc)
    assert [(note.at, note.loop, note.text) for note in report.notes] == [(0.0, "A", "by the way")]
    assert all(change.reason is None for change in report.loops["A"].modes)


def test_a_pair_of_limits_is_told_as_it_was_written():
    events = scenario("events: [{at: 1, loop: A, set: {output.limits: [0, 50]}}]\n").events
    assert describe_event(events[0]) == "set output.limits to [0, 50]"


def test_the_base_step_fits_sample_rates_that_events_set():
    text = WIRED + "events: [{at: 3, loop: A, set: {sample_rate: 0.3}}]\n"
    report, _ = run(text)
    assert report.step == 0.1
    assert not report.problems
    late, _ = run(WIRED + "events: [{at: 30, loop: A, set: {sample_rate: 0.3}}]\n")
    assert late.step == 1.0


def test_a_sample_rate_that_does_not_fit_the_step_from_an_event_on_is_said():
    report, _ = run(WIRED + "events: [{at: 3, loop: A, set: {sample_rate: 0.3}}]\n", step=1)
    assert [(p.path, p.severity, p.message) for p in report.problems] == [
        (("step",), "warning", "by 3 s: the sample rate of A, 0.3 s, is shorter than the step, 1 s")
    ]


def test_a_sample_rate_that_the_controller_changes_by_itself_is_said(monkeypatch):
    plc = Controller.load()
    monkeypatch.setattr(type(plc), "autotune", lambda self, loop, _: setattr(self.configs[loop], "period", 1_500_000))
    report, _ = run(WIRED + "events: [{at: 3, loop: A, autotune: start}]\n", plc)
    assert [p.message for p in report.problems] == [
        "by 3 s: the sample rate of A, 1.5 s, is no multiple of the step, 1 s"
    ]


def test_a_scan_longer_than_a_sample_rate_is_said():
    report, _ = run(WIRED + "plc: {scan_time: 2}\n")
    assert [p.message for p in report.problems] == [
        f"the sample rate of {loop}, 1 s, is shorter than the step, 2 s" for loop in "AB"
    ]


def test_a_sample_rate_that_changes_between_events_is_said(monkeypatch):
    plc = Controller.load()
    later = property(lambda self: [1_500_000 if self.states[0].due > 5_000_000 else 1_000_000, 1_000_000])
    monkeypatch.setattr(type(plc), "periods", later)
    report, _ = run(WIRED, plc)
    assert [p.message for p in report.problems] == [
        "by 10 s: the sample rate of A, 1.5 s, is no multiple of the step, 1 s"
    ]


def test_progress_ends_with_the_whole_run():
    shares = []
    simulate(scenario(FOLLOW), Controller.load, Controller, Settings("python", progress=shares.append))

    assert shares == sorted(shares)
    assert shares[-1] == 1.0


def test_an_expectation_about_the_end_says_so():
    report, _ = run(FOLLOW + "expect:\n  - {signal: x, final: 3.4, tolerance: 0.5}\n")
    assert report.expectations[0].text == "x 3.4 ± 0.5 at the end"


def test_an_alarm_at_the_first_base_step_has_come():
    text = FOLLOW + "events: [{at: 0, loop: A, set: {limit: -1}}]\nexpect:\n"
    report, _ = run(text + "  - {loop: A, alarm: high, at: 0}\n  - {loop: A, alarm: high, never: true}\n")

    assert [(v.passed, v.value) for v in report.expectations] == [(True, 0), (False, 0)]


@pytest.mark.parametrize(("steps", "group"), [(1, 1), (MAX_POINTS, 1), (MAX_POINTS + 1, GROUP_VALUES + 1)])
def test_a_recording_keeps_every_base_step_until_they_are_too_many(steps, group):
    recording = Recording()
    recording.begin(["A.PV"], steps, 0.1)

    assert recording.group_size == group
