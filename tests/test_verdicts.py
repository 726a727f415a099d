"""What each expectation says of what was measured, at its bounds: passed or not, the value, and the words."""

from __future__ import annotations

from types import SimpleNamespace as Facts

import pytest

from pidcfg.sim.judgement.expect import NO_STEP, Outcome, place_verdict, verdict
from pidcfg.sim.judgement.meters import Gauge, Meter, Onset
from pidcfg.sim.judgement.report import Range
from scenario_rig import scenario

AUTO, HIGH, ODD, COMPLETE, EVEN = 2, 8, 16, 1, 2
TUNED = {"done": True, "error": False, "results": {"gain": 2.5, "reset": None}}
PLC = Facts(
    loops=["B", "A"],
    modes={"manual": 1, "auto": AUTO},
    mode=lambda status: "auto" if status & AUTO else "manual",
    flags={"V1": 4, "V2": 0},
    word_of_flags="0x{:04X}",
    flag_bits={"odd": ODD},
    aux_bits={"complete": COMPLETE, "even": EVEN},
    tuned=lambda loop: TUNED if loop == 1 else None,
)
METRICS = {"iae": 3.0, "overshoot": 5.0, "settling_time": None, "rise_time": None, "oscillation_period": None}
OUT = Outcome(
    PLC,
    [{**dict.fromkeys(METRICS), "iae": None}, METRICS],
    [
        Meter(0, 0, 0, status=1, ever=1),
        Meter(0, 0, 0, status=AUTO, ever=AUTO | ODD, ever_aux=COMPLETE, event=3, stepped=1),
    ],
    {"A.PV": Range(10.0, 60.0, 50.0), "B.PV": Range(-1.0, 1.0, 0.0)}.__getitem__,
    0.5,
    100,
    {("B", "high")},
    {7: "manual"},
)
NONE, AT_4, AT_0 = Onset(1, HIGH), Onset(1, HIGH, 8), Onset(1, HIGH, 0)
NARROW = Gauge(0, low=20.0, high=30.0)
TIMELESS = Gauge(0, low=1.0, high=-1.0)
ON_B = Onset(0, HIGH)
VERDICTS = [
    # expectation, what was measured for it alone, passed, value, words
    ("loop: A, metric: iae, max: 3", None, True, 3.0, "A iae at most 3"),
    ("loop: A, metric: iae, max: 2.999", None, False, 3.0, "A iae at most 2.999"),
    ("loop: A, metric: iae, min: 3", None, True, 3.0, "A iae at least 3"),
    ("loop: A, metric: iae, min: 3.001", None, False, 3.0, "A iae at least 3.001"),
    ("loop: A, metric: overshoot, min: 1, max: 5 %", None, True, 5.0, "A overshoot at least 1 % and at most 5 %"),
    ("loop: A, metric: settling_time, max: 3", None, False, None, "A settling_time at most 3 s"),
    (
        "loop: A, metric: oscillation_period, max: 3",
        None,
        False,
        None,
        "A oscillation_period at most 3 s (nothing was measured: the PV does not oscillate)",
    ),
    (
        "loop: B, metric: rise_time, max: 3",
        None,
        False,
        None,
        f"B rise_time at most 3 s (nothing was measured: {NO_STEP})",
    ),
    (
        "loop: B, metric: iae, max: 3",
        None,
        False,
        None,
        "B iae at most 3 (nothing was measured: the loop was not in Auto or Cascade)",
    ),
    ("signal: A.PV, max: 60", None, True, 60.0, "A.PV at most 60"),
    ("signal: A.PV, max: 59.9", None, False, 60.0, "A.PV at most 59.9"),
    ("signal: A.PV, min: 10", None, True, 10.0, "A.PV at least 10"),
    ("signal: A.PV, min: 10.1", None, False, 10.0, "A.PV at least 10.1"),
    ("signal: A.PV, min: 10, max: 60", None, True, [10.0, 60.0], "A.PV at least 10 and at most 60"),
    ("signal: A.PV, final: 51, tolerance: 1", None, True, 50.0, "A.PV 51 ± 1 at the end"),
    ("signal: A.PV, final: 49, tolerance: 1", None, True, 50.0, "A.PV 49 ± 1 at the end"),
    ("signal: A.PV, final: 51, tolerance: 0.9", None, False, 50.0, "A.PV 51 ± 0.9 at the end"),
    ("signal: A.PV, max: 50, final: 50, tolerance: 1", None, False, 60.0, "A.PV at most 50, 50 ± 1 at the end"),
    ("signal: A.PV, min: 20, final: 50, tolerance: 1", None, False, 10.0, "A.PV at least 20, 50 ± 1 at the end"),
    ("signal: A.PV, max: 30, from: 1, until: 2", NARROW, True, 30.0, "A.PV at most 30 from 1 s until 2 s"),
    ("signal: A.PV, min: 20, from: 1", NARROW, True, 20.0, "A.PV at least 20 from 1 s"),
    ("signal: A.PV, max: 29, until: 2", NARROW, False, 30.0, "A.PV at most 29 until 2 s"),
    ("signal: A.PV, max: 29, until: 2", TIMELESS, False, None, "A.PV: no base step lies in its time"),
    ("loop: A, alarm: high, never: true", NONE, True, None, "A alarm high never"),
    ("loop: A, alarm: high, never: true", AT_0, False, 0.0, "A alarm high never"),
    ("loop: A, alarm: high, never: false", NONE, False, None, "A alarm high at some time"),
    ("loop: A, alarm: high, never: false", AT_4, True, 4.0, "A alarm high at some time"),
    ("loop: A, alarm: high, never: true, before: 4", AT_4, True, 4.0, "A alarm high never before 4 s"),
    ("loop: A, alarm: high, never: true, before: 4.1", AT_4, False, 4.0, "A alarm high never before 4.1 s"),
    ("loop: A, alarm: high, never: true, before: 4", NONE, True, None, "A alarm high never before 4 s"),
    (
        "loop: B, alarm: high, never: true",
        ON_B,
        False,
        None,
        "B alarm high never (nothing was measured: the alarm is off)",
    ),
    ("loop: A, alarm: high, at: 4.25", AT_4, True, 4.0, "A alarm high at 4.25 s"),
    ("loop: A, alarm: high, at: 3.75", AT_4, True, 4.0, "A alarm high at 3.75 s"),
    ("loop: A, alarm: high, at: 4.3", AT_4, False, 4.0, "A alarm high at 4.3 s"),
    ("loop: A, alarm: high, at: 5.25, tolerance: 1", AT_4, True, 4.0, "A alarm high at 5.25 s ± 1 s"),
    ("loop: A, alarm: high, at: 5.3, tolerance: 1", AT_4, False, 4.0, "A alarm high at 5.3 s ± 1 s"),
    ("loop: A, alarm: high, at: 0", NONE, False, None, "A alarm high at 0 s"),
    ("loop: A, alarm: high, at: 0", AT_0, True, 0.0, "A alarm high at 0 s"),
    ("loop: A, alarm: high, before: 4", AT_4, True, 4.0, "A alarm high before 4 s"),
    ("loop: A, alarm: high, before: 3.9", AT_4, False, 4.0, "A alarm high before 3.9 s"),
    ("loop: A, alarm: high, after: 4", AT_4, True, 4.0, "A alarm high after 4 s"),
    ("loop: A, alarm: high, after: 4.1", AT_4, False, 4.0, "A alarm high after 4.1 s"),
    ("loop: A, alarm: high, before: 9, after: 1", AT_4, True, 4.0, "A alarm high before 9 s and after 1 s"),
    ("loop: A, alarm: high, at: 4, after: 5", AT_4, False, 4.0, "A alarm high at 4 s and after 5 s"),
    ("flag: V1", None, True, "0x0004", "V1 is set"),
    ("flag: V1, is: 4", None, True, "0x0004", "V1 is 0x0004"),
    ("flag: V1, is: 5", None, False, "0x0004", "V1 is 0x0005"),
    ("flag: V1, is: false", None, False, "0x0004", "V1 is clear"),
    ("flag: V2, is: false", None, True, "0x0000", "V2 is clear"),
    ("flag: V2", None, False, "0x0000", "V2 is set"),
    ("loop: A, flag: odd", None, True, True, "A flag odd on"),
    ("loop: A, flag: odd, is: false", None, False, True, "A flag odd off"),
    ("loop: A, flag: complete", None, True, True, "A flag complete on"),
    ("loop: A, flag: even", None, False, False, "A flag even on"),
    ("loop: B, flag: odd, is: false", None, True, False, "B flag odd off"),
    ("loop: A, autotune: done", None, True, True, "A autotune done is true"),
    ("loop: A, autotune: done, is: false", None, False, True, "A autotune done is false"),
    ("loop: A, autotune: error", None, False, False, "A autotune error is true"),
    ("loop: A, autotune: error, is: false", None, True, False, "A autotune error is false"),
    ("loop: B, autotune: done, is: false", None, False, None, "B autotune done is false"),
    ("loop: A, autotune: gain, min: 2.5, max: 2.5", None, True, 2.5, "A autotune gain at least 2.5 and at most 2.5"),
    ("loop: A, autotune: gain, max: 2.4", None, False, 2.5, "A autotune gain at most 2.4"),
    ("loop: A, autotune: gain", None, True, 2.5, "A autotune gain is found"),
    ("loop: A, autotune: reset", None, False, None, "A autotune reset is found"),
    ("loop: B, autotune: gain, max: 9", None, False, None, "B autotune gain at most 9"),
    ("loop: A, mode: auto", None, True, "auto", "A mode is auto at the end"),
    ("loop: A, mode: manual", None, False, "auto", "A mode is manual at the end"),
    ("loop: B, mode: manual", None, True, "manual", "B mode is manual at the end"),
    ("loop: A, mode: {never: manual}", None, True, None, "A mode is never manual"),
    ("loop: A, mode: {never: auto}", None, False, "auto", "A mode is never auto"),
]


@pytest.mark.parametrize(("text", "watch", "passed", "value", "words"), VERDICTS, ids=[row[0] for row in VERDICTS])
def test_an_expectation_at_its_bounds(text, watch, passed, value, words):
    (wanted,) = scenario(f"expect: [{{{text}}}]\n").expect
    found = verdict(0, wanted, watch, OUT)
    assert (found.passed, found.value, found.text) == (passed, value, words)
    assert type(found.value) is type(value)


def test_a_mode_at_a_time_is_what_was_seen_then():
    (wanted,) = scenario("expect: [{loop: A, mode: manual, at: 2.5}]\n").expect
    found = verdict(7, wanted, None, OUT)
    assert (found.passed, found.value, found.text) == (True, "manual", "A mode is manual at 2.5 s")


@pytest.mark.parametrize(
    ("text", "loop", "at"),
    [
        ("loop: A, mode: auto", "A", None),
        ("loop: A, mode: auto, at: 3", "A", 3.0),
        ("signal: B.PV, max: 3", "B", None),
        ("flag: V1", None, None),
    ],
)
def test_a_verdict_has_its_loop_and_its_time(text, loop, at):
    (wanted,) = scenario(f"expect: [{{{text}}}]\n").expect
    found = place_verdict(verdict(0, wanted, None, OUT), wanted)
    assert (found.loop, found.at) == (loop, at)
