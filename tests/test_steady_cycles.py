"""`initial: steady` where an output is on or off, or pulses: the cycle that comes back is the steady state."""

import pytest

from nextopid_rig import run
from pidcfg.sim.engine.run import CYCLE_WINDOWS, swings_alike

SCALE = (0.0, 100.0, 2**24)
RELAY = "  - {name: OO, type: ControlON_OFF, SP: 50, DeadBand: 2, MaxPV: 100, MinPV: 0}\n"
OVEN = "  OO: {model: first_order, gain: 80, time_constant: 6, dead_time: 0.5, load: 20, initial: 20}\n"
GIVEN = "type: PIDA_REAL, SP: 50, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100"
OTHER = "  L: {model: first_order, gain: 1, time_constant: 2, dead_time: 1.5, initial: 20}\n"


def steady(loops: str, plants: str, duration: int = 60, blocks: str = ""):
    """The report of a run that begins in the steady state."""
    return run(f"{blocks}loops:\n{loops}", f"duration: {duration}\ninitial: steady\nplants:\n{plants}")


def test_a_relay_begins_in_its_cycle():
    report = steady(RELAY, OVEN)
    assert not report.problems
    assert report.settled
    plain = run(f"loops:\n{RELAY}", f"duration: 60\nplants:\n{OVEN}")
    pv, start = report.signals["OO.PV"], plain.signals["OO.PV"]
    assert start.low == 20
    assert 44 < pv.low < 48
    assert 52 < pv.high < 57
    assert start.high == pytest.approx(pv.high, abs=0.3), "the same cycle, reached from 20"


def test_a_loop_that_a_relay_moves_may_swing_and_another_one_may_not():
    moved = f"  - {{name: L, {GIVEN}, Kp: 0.3, Ti_Ki: 4}}\n"
    hunting = moved.replace("Kp: 0.3, Ti_Ki: 4", "Kp: 9, Ti_Ki: 1")
    follows = OTHER.replace("gain: 1", "input: L.MV + OO.MV * 5, gain: 1")
    assert not steady(RELAY + moved, OVEN + OTHER).problems
    assert not steady(RELAY + moved, OVEN + follows).problems
    problems = steady(RELAY + hunting, OVEN + OTHER).problems
    assert [(p.kind, p.loop) for p in problems] == [("no_steady_state", "L")]


def test_a_relay_that_never_comes_to_its_cycle_is_an_error():
    drifting = "  OO: {model: integrator, gain: 0.01, load: 0.2, initial: 5}\n"
    assert [p.kind for p in steady(RELAY, drifting).problems] == ["no_steady_state"]


def test_pulses_begin_in_their_cycle():
    blocks = "blocks:\n  - {name: PWM, type: ControlPWM, MV: L.MV, MinMV: 0, MaxMV: 100, Period: 20}\n"
    loop = f"  - {{name: L, {GIVEN}, Kp: 0.5, Ti_Ki: 6}}\n"
    plants = "  L: {model: first_order, gain: 100, time_constant: 8, dead_time: 1, input: PWM.PWM}\n"
    report = steady(loop, plants, blocks=blocks)
    assert not report.problems
    assert report.signals["L.PV"].low > 40


@pytest.mark.parametrize(
    ("before", "now", "comes"),
    [
        ((45.0, 55.0), (45.0, 55.0), True),
        ((45.0, 55.0), (45.1, 55.1), True),
        ((45.0, 55.0), (45.0, 55.3), False),
        ((45.0, 55.0), (44.7, 55.0), False),
        ((20.0, 55.0), (45.0, 55.0), False),
    ],
)
def test_extremes_come_back_within_a_share_of_the_swing(before, now, comes):
    assert swings_alike([before] * CYCLE_WINDOWS + [now] * CYCLE_WINDOWS, SCALE) == comes
    assert not swings_alike([now] * (2 * CYCLE_WINDOWS - 1), SCALE), "too few windows"
    half = (50.0, now[1])
    longer = [half, (now[0], 50.0)] * CYCLE_WINDOWS
    assert swings_alike(longer, SCALE), "a cycle over two windows"
