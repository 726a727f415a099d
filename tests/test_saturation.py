"""The ladder of questions behind ``saturated`` and ``error-stands``: each at the limit at which its answer changes."""

from __future__ import annotations

from math import exp
from types import SimpleNamespace as Facts

import pytest

from pidcfg.sim.judgement import standing as saturation
from pidcfg.sim.judgement.evidence import Look, Pace

DUE = 1 - exp(-1 / 4)
"""Of an error: what it loses in a plant time when it goes in four of them."""
CFG = [Facts(period=1, sig_out=0, sig_sp=1, sig_pv=2), Facts(period=1, sig_out=3, sig_sp=4, sig_pv=5)]


@pytest.fixture(autouse=True)
def alone(monkeypatch):
    """No selector, and no other loop."""
    monkeypatch.setattr(saturation, "is_deselected", lambda e, _: e.away)
    monkeypatch.setattr(saturation, "_opponents", lambda e, _: e.against)


def evidence(early=3.0, late=3.0, *, least=0.1, pace=10.0, turn=10.0, integrates=False, **given):
    """A loop with an error, which may be 1, for 100 s; a base step is a second."""
    meter = Facts(control_since=given.pop("control_since", 0), since=0, broken=0, late_aux=0, aux_status=0, control=1)
    plc = Facts(
        cfg=CFG,
        loops=["A", "B"],
        inner_deviation=lambda _: given.get("inner"),
        only_switches=lambda _: given.get("switches", False),
        integrates=lambda *_: given.get("integral", True),
        dead_band=lambda *_: given.get("dead_band", 0.0),
        output_limits=lambda *_: (0.0, 100.0),
        windup_input=lambda *_: given.get("windup", False),
        profile_step=lambda _: given.get("profile", 0),
        in_run=True,
    )
    return Facts(
        plc=plc,
        meters=[meter, Facts(control=1)],
        errors=lambda _: (early, late),
        least=lambda _: least,
        span=lambda _: 100.0,
        seconds=float,
        set_point_moves=lambda _: given.get("moves", 0.0),
        paces=[Pace(pace, turn, 0.0, integrates)] * 2,
        step=1,
        slaves=lambda i: given.get("slaves", []) if i == 0 else [],
        sig=given.get("sig", [50.0, 0.0, 0.0, 50.0, 0.0, 0.0]),
        away=given.get("away", False),
        against=given.get("against", ()),
    )


def look(start=80, end=99, stage=0):
    """Twenty base steps, ten in either half."""
    return Look(start, (start + end + 1) // 2, end, stage, final=True, following=100.0)


def of(judgement):
    return "passed" if judgement.passed and judgement.judged else "unjudged" if judgement.passed else "failed"


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, "failed"),
        ({"early": 1.0, "late": 1.0}, "passed"),
        ({"early": 1.0, "late": 1.001}, "failed"),
        ({"early": -1.0, "late": -1.001}, "failed"),
        ({"early": 3.0, "late": 3.0 - 3.0 * DUE - 0.001}, "passed"),
        ({"early": 3.0, "late": 3.0 - 3.0 * DUE + 0.001}, "failed"),
        ({"integrates": True, "early": 30.0, "late": 29.9, "least": 0.1}, "passed"),
        ({"integrates": True, "early": 30.0, "late": 29.901, "least": 0.1}, "failed"),
        ({"moves": 0.1}, "unjudged"),
        ({"moves": 0.099}, "failed"),
        ({"profile": 1}, "unjudged"),
        ({"away": True}, "unjudged"),
        ({"control_since": 79}, "failed"),
        ({"control_since": 80}, "unjudged"),
        ({"control_since": 59, "late": 2.8}, "failed"),
        ({"control_since": 60, "late": 2.8}, "unjudged"),
        ({"least": 3.0 * DUE}, "failed"),
        ({"least": 3.0 * DUE / 3 + 0.001, "control_since": 60}, "unjudged"),
        ({"least": 3.0 * DUE / 3 - 0.001, "control_since": 60}, "failed"),
    ],
)
def test_an_error_inside_the_limits_lasts(given, found):
    """The allowed one is 1; it should lose e^(−1/4) of itself between the halves of its window."""
    assert of(saturation._stands(evidence(**given), 0, look())) == found


@pytest.mark.parametrize(("stage", "found"), [(80, "failed"), (81, "unjudged")])
def test_an_event_within_the_window_leaves_the_error_open(stage, found):
    assert of(saturation._stands(evidence(pace=5.0), 0, look(stage=stage))) == found


@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({"early": 1.0, "late": 1.0}, "passed"),
        ({"early": 1.001, "late": 1.001}, "failed"),
        ({"early": -3.0, "late": -3.0}, "failed"),
        ({"control_since": 89}, "failed"),
        ({"control_since": 90}, "unjudged"),
        ({"early": 2.9, "turn": 4.5, "control_since": 90}, "failed"),
        ({"early": 2.9, "turn": 4.5, "control_since": 91}, "unjudged"),
        ({"early": 3.1, "control_since": 69}, "failed"),
        ({"early": 3.1, "control_since": 70}, "passed"),
        ({"early": 3.0 / (1 - DUE) + 0.01, "control_since": 0}, "passed"),
        ({"early": 3.0 / (1 - DUE) - 0.01, "control_since": 0}, "failed"),
        ({"integrates": True, "early": 30.1, "late": 30.0}, "passed"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 34.0, "control_since": 89}, "failed"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 33.0, "control_since": 89}, "unjudged"),
        ({"integrates": True, "early": 30.0, "late": 30.0, "least": 33.0, "control_since": 79}, "failed"),
        ({"away": True}, "unjudged"),
        ({"windup": True}, "unjudged"),
    ],
)
def test_an_error_at_a_limit_lasts(given, found):
    """It stands for a plant time, or grows for two; or it gets smaller too slowly for three of them."""
    assert of(saturation._saturated(evidence(**given), 0, look(), "its upper output limit")) == found


@pytest.mark.parametrize(
    ("given", "allowed"),
    [
        ({}, 1.0),
        ({"integral": False}, 5.0),
        ({"integral": False, "integrates": True}, 20.0),
        ({"switches": True}, 5.0),
        ({"inner": 0.5}, 0.5),
        ({"inner": 2.0}, 1.0),
        ({"dead_band": 3.0}, 3.0),
        ({"dead_band": 9.0}, 5.0),
        ({"inner": 0.5, "dead_band": 0.6}, 0.6),
    ],
)
def test_the_error_that_is_left_alone_is_a_share_of_the_span(given, allowed):
    assert saturation.allowed_error(evidence(**given), 0) == allowed


@pytest.mark.parametrize(
    ("start", "end", "pace", "found"),
    [(80, 90, 1.0, "failed"), (80, 89, 1.0, "unjudged"), (80, 90, 274.9, "failed"), (80, 90, 275.1, "unjudged")],
)
def test_a_window_of_ten_samples_and_a_fiftieth_of_the_plant_time_tells(start, end, pace, found):
    assert look(start, end).half == (end + 1 - start) / 2
    assert of(saturation._failed(evidence(pace=pace), 0, look(start, end), "with")) == found


@pytest.mark.parametrize(
    ("sig", "limit"),
    [
        ([50.0, 0, 0, 50.0, 50.0, 0], ""),
        ([99.95, 0, 0, 50.0, 99.95, 0], "its upper output limit"),
        ([50.0, 0, 0, 0.05, 50.0, 0], "the lower output limit of B"),
        ([50.0, 0, 0, 50.0, 50.09, 0], ""),
        ([50.0, 0, 0, 50.0, 50.11, 0], "a set-point limit of B"),
    ],
)
def test_a_limit_is_that_of_the_loop_or_of_a_slave_in_control(sig, limit):
    e = evidence(slaves=[1], sig=sig)
    assert saturation._limit(e, 0) == limit
    e.meters[1].control = 0
    assert saturation._limit(e, 0) == (limit if "its" in limit else "")


@pytest.mark.parametrize(("out", "works"), [(5.0, False), (5.1, True)])
def test_a_loop_works_with_more_than_a_twentieth_of_its_output(out, works):
    assert saturation._works(evidence(sig=[out, 0, 0, 0, 0, 0]), 0) == works
