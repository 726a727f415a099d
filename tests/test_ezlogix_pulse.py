"""The control output of the virtual EZLogix: widths, minimum times, cycles."""

from __future__ import annotations

import pytest

from ezlogix_rig import O, Rig, plc
from pidcfg.sim.controllers.plc import TICKS
from rig_plants import Fixed


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
            seen.append(int(rig.sig[O]))
    return seen


def width(out, base=0.1, cycle=10.0, **given):
    """Base steps of the pulse of one cycle, which comes first in it; the first step of all knows no length yet."""
    seen = pulses([0.0, out], base, cycle, **given)[round(cycle / base) :]
    assert seen == sorted(seen, reverse=True)
    return sum(seen)


@pytest.mark.parametrize(
    ("out", "steps"),
    [
        (0.0, 0),
        (1024.0, 25),
        (2048.0, 50),
        (3072.0, 75),
        (4095.0, 100),
        (20.0, 0),
        (21.0, 1),
        (61.0, 1),
        (62.0, 2),
    ],
)
def test_the_on_time_is_the_cv_by_4096_of_the_cycle_to_the_nearest_step(out, steps):
    assert width(out) == steps


def test_a_fine_step_shows_the_gap_of_full_scale():
    assert width(4095.0, base=0.001, cycle=4.096) == 4095


@pytest.mark.parametrize(("out", "steps"), [(204.0, 0), (205.0, 5), (2048.0, 50)])
def test_a_pulse_below_the_minimum_on_time_is_left_out(out, steps):
    assert width(out, min_on=0.5) == steps


@pytest.mark.parametrize(("out", "steps"), [(3891.0, 95), (3892.0, 100), (2048.0, 50), (0.0, 0)])
def test_a_gap_below_the_minimum_off_time_is_left_out(out, steps):
    assert width(out, min_off=0.5) == steps


def test_a_cv_of_nothing_never_switches_on():
    assert [width(out, min_off=11.0) for out in (0.0, 1.0)] == [0, 100]


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


def test_the_first_step_of_all_is_what_it_is_at_its_beginning():
    assert [pulses([out], 1.0, 2.0)[0] for out in (0.0, 1.0)] == [0, 1]


def test_with_both_times_too_long_there_is_no_pulse():
    assert width(2048.0, min_on=6.0, min_off=6.0) == 0
    assert width(2900.0, min_on=6.0, min_off=6.0) == 100


def test_cycles_follow_each_other_and_take_the_cv_of_their_beginning():
    assert pulses([1024.0, 3072.0, 0.0, 2048.0], 0.5, 4.0) == [
        *(1, 1, 0, 0, 0, 0, 0, 0),
        *(1, 1, 1, 1, 1, 1, 0, 0),
        *(0,) * 8,
        *(1, 1, 1, 1, 0, 0, 0, 0),
    ]
    rig = Rig(base=0.5)
    _, s = rig.add(Fixed(), cycle=4_000_000, out=2048.0)
    rig.step(2)
    s.out = 0.0
    assert [rig.step() or rig.sig[O] for _ in range(7)] == [1, 1, 0, 0, 0, 0, 0]


def test_pulses_move_between_samples():
    assert width(1024.0, period=5.0) == 25


def test_a_cycle_that_the_base_step_misses_keeps_its_mean_length():
    """Cycles of 0.25 s in steps of 0.1 s begin every 2 or 3 steps."""
    rig = Rig(base=0.1)
    rig.add(Fixed(), cycle=250_000, out=1600.0)
    seen = [rig.step() or rig.sig[O] for _ in range(40)]

    assert 14 <= sum(seen) <= 18
    starts = [k for k in range(1, 40) if seen[k] > seen[k - 1]]
    assert starts[-1] - starts[0] == pytest.approx(2.5 * (len(starts) - 1), abs=0.6)


@pytest.mark.parametrize(("out", "on"), [(4095.0, 20), (3072.0, 15), (1024.0, 5)])
def test_a_cycle_that_begins_within_a_step_loses_nothing_of_its_pulse(out, on):
    """The last cycles of 18.8 s in steps of 1 s begin at 75.2 s and 94 s: a step belongs to the cycle of its middle."""
    rig = Rig(base=1.0)
    rig.add(Fixed(), cycle=18_800_000, out=out)
    seen = [rig.step() or rig.sig[O] for _ in range(94)]

    assert sum(seen) == pytest.approx(on / 20 * 94, abs=1.5)
    assert seen[75:77] == [1, 1]


@pytest.mark.parametrize("cycle", [100_000, 500_000])
def test_a_cycle_shorter_than_the_base_step_starts_over_at_each_one(cycle):
    rig = Rig(base=1.0)
    rig.add(Fixed(), cycle=cycle, out=4095.0)
    rig.step(100)

    assert rig.st[0].cycle_start == 99_000_000


def test_without_a_control_output_or_a_cycle_time_there_is_none():
    rig = Rig()
    rig.add(Fixed(), out=4095.0)
    rig.step(30)
    assert rig.sig[O] == 0.0
    machine = plc({"output": {"tag": "OR1", "pulse": {"tag": "O1", "cycle_time": 2}}}, {})

    assert [c.cycle for c in machine.cfg] == [2_000_000, 0]
    assert [name for name in machine.signals if name.endswith(".O")] == ["L1.O"]
