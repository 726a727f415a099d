"""Modes of the virtual DL06: requests, refusals, overrides, cascade chains, bumpless transfers, CPU modes."""

from __future__ import annotations

import pytest

from dl06_rig import Rig
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.operate import MODE_REASONS as REASONS
from pidcfg.sim.controllers.dl06.plc import Dl06
from pidcfg.sim.controllers.kernels import NOTICES, REASON_BITS, notices
from rig_plants import FirstOrder, Fixed


def mode(rig, i=0):
    return Dl06.mode(rig.st[i].status)


def reasons(rig):
    return [text for _, text in rig.log]


def pair(rig=None, *, inner="manual", outer="manual", **major):
    """Loop 0 is the minor loop, loop 1 its major."""
    rig = rig or Rig(base=0.1)
    rig.add(Fixed(1200.0), inner, sp=1000.0, gain=1.0, major=1)
    rig.add(Fixed(2000.0), outer, sp=2000.0, gain=0.5, **major)
    return rig


def cascaded():
    """A pair that has come to Cascade and Auto."""
    rig = pair()
    rig.request("auto", 0)
    rig.step()
    rig.request("cascade", 0)
    rig.step()
    rig.request("auto", 1)
    rig.step(2)
    assert (mode(rig, 0), mode(rig, 1)) == ("cascade", "auto")
    return rig


def test_loops_begin_in_manual_and_the_output_stays_as_the_operator_left_it():
    rig = Rig()
    _, s = rig.add(Fixed(100.0), sp=3000.0, gain=5.0, out=777.0)
    rig.step(10)

    assert (mode(rig), s.out, rig.sig[3]) == ("manual", 777.0, 777.0)


@pytest.mark.parametrize(("now", "wanted"), [("manual", "cascade"), ("cascade", "manual")])
def test_manual_and_cascade_are_never_neighbours(now, wanted):
    rig = cascaded() if now == "cascade" else pair()
    rig.request(wanted, 0)
    rig.step()

    assert mode(rig, 0) == now
    assert reasons(rig) == ["refused: a loop cannot go from Manual to Cascade or back without Auto in between"]


def test_a_request_is_momentary():
    rig = pair()
    rig.request("cascade", 0)
    rig.step(5)

    assert len(rig.log) == 1
    assert rig.st[0].request == 0


def test_a_request_for_the_present_mode_changes_nothing():
    rig = Rig()
    _, s = rig.add(Fixed(1000.0), "auto", sp=1000.0, gain=1.0, out=500.0)
    rig.step(3)
    s.sp = 1010.0
    rig.step()
    rig.request("auto")
    rig.step()

    assert (mode(rig), s.sp, s.out) == ("auto", 1010.0, 510.0)


def test_a_major_loop_cannot_leave_manual_until_its_minor_is_in_cascade():
    rig = pair(inner="auto", outer="auto")
    rig.step(3)

    assert (mode(rig, 0), mode(rig, 1)) == ("auto", "manual")
    assert rig.log == [(1, "refused: the minor loop is not in Cascade")]


@pytest.mark.parametrize("way_out", ["auto", "overflow"])
def test_when_a_minor_loop_leaves_cascade_its_major_goes_to_manual(way_out):
    rig = cascaded()
    if way_out == "auto":
        rig.request("auto", 0)
    else:
        rig.st[0].kp = 1e12
        rig.plants[0].value = 1100.0
    rig.step()

    assert mode(rig, 0) == ("auto" if way_out == "auto" else "manual")
    assert mode(rig, 1) == "manual"
    assert (1, "to Manual: the minor loop left Cascade") in rig.log


def test_a_chain_falls_apart_outwards():
    """Minor 0, middle 1, outer 2: when 0 leaves Cascade, 1 leaves it too, and 2 follows."""
    rig = Rig(base=0.1)
    rig.add(Fixed(1000.0), sp=1000.0, major=1)
    rig.add(Fixed(1000.0), sp=1000.0, major=2)
    rig.add(Fixed(1000.0), sp=1000.0)
    for s, goal in zip(rig.st, (bits.CASCADE, bits.CASCADE, bits.AUTO), strict=True):
        s.goal = goal
        s.busy |= bits.GOAL
    rig.step(8)
    assert [mode(rig, i) for i in range(3)] == ["cascade", "cascade", "auto"]
    assert rig.log == []
    rig.request("auto", 0)
    rig.step()

    assert [mode(rig, i) for i in range(3)] == ["auto", "manual", "manual"]
    assert sorted(rig.log) == [(i, "to Manual: the minor loop left Cascade") for i in (1, 2)]


def test_cascade_without_a_pointer_is_refused():
    rig = Rig()
    rig.add(Fixed(1000.0), "auto", sp=1000.0)
    rig.step()
    rig.request("cascade")
    rig.step()

    assert mode(rig) == "auto"
    assert "names no control output" in reasons(rig)[0]


def test_in_cascade_the_set_point_is_the_majors_output_and_the_own_word_stays():
    """ "The minor loop's normal SP location, addr+02, remains unchanged." (D675)"""
    rig = cascaded()
    rig.st[0].sp = 50.0
    rig.step()
    major_out = rig.st[1].out

    assert rig.sig[2] == major_out != 50.0
    assert rig.st[0].sp == 50.0
    rig.request("auto")
    rig.step()
    assert (mode(rig), rig.sig[2]) == ("auto", 50.0)


def test_goals_are_pursued_inside_out_and_write_their_set_point():
    """Bumpless I makes SP the PV; the operator's set point follows one sample after the mode."""
    rig = pair()
    rig.st[0].goal, rig.st[1].goal = bits.CASCADE, bits.AUTO
    rig.st[1].goal_sp, rig.st[1].goal_writes = 2222.0, 1
    for s in rig.st:
        s.busy |= bits.GOAL
    seen = []
    for _ in range(4):
        rig.step()
        seen.append((mode(rig, 0), mode(rig, 1), rig.st[1].sp))

    assert seen == [
        ("auto", "manual", 2000.0),
        ("cascade", "auto", 2000.0),
        ("cascade", "auto", 2222.0),
        ("cascade", "auto", 2222.0),
    ]
    assert rig.log == []
    assert all(s.busy == 0 for s in rig.st)


def test_a_goal_that_is_refused_is_asked_for_again_and_logged_once():
    rig = Rig(base=0.1)
    pv = Fixed(100.0)
    rig.add(pv, low=500.0, sp=1000.0)
    rig.st[0].goal = bits.AUTO
    rig.st[0].busy |= bits.GOAL
    rig.step(10)
    assert rig.log == [(0, "refused: a PV alarm is active")]
    pv.value = 600.0
    rig.step()

    assert mode(rig) == "auto"
    assert len(rig.log) == 1


def test_an_event_takes_the_place_of_a_pending_goal():
    rig = Rig(base=0.1)
    pv = Fixed(100.0)
    rig.add(pv, low=500.0, sp=1000.0)
    rig.st[0].goal = bits.AUTO
    rig.st[0].busy |= bits.GOAL
    rig.step(2)
    rig.request("manual")
    rig.step()
    pv.value = 600.0
    rig.step(5)

    assert rig.st[0].status & bits.MODES == bits.MANUAL
    assert (rig.st[0].goal, rig.st[0].busy) == (0, 0)


def test_a_major_loop_learns_why_when_its_minor_is_refused():
    rig = pair()
    rig.cfg[0].low = 4000.0
    rig.st[0].goal, rig.st[1].goal = bits.CASCADE, bits.AUTO
    for s in rig.st:
        s.busy |= bits.GOAL
    rig.step(5)

    assert rig.log == [(0, "refused: a PV alarm is active"), (1, "refused: the minor loop is not in Cascade")]


@pytest.mark.parametrize(
    ("limits", "reason"),
    [
        ({"low_low": 500.0}, True),
        ({"low": 500.0}, True),
        ({"high": 50.0}, True),
        ({"high_high": 50.0}, True),
        ({"yellow": 5.0}, False),
        ({"red": 5.0}, False),
        ({"rate_of_change": 1.0}, False),
        ({"low": 100.0}, False),
    ],
)
def test_only_absolute_alarms_refuse_auto(limits, reason):
    rig = Rig()
    rig.add(Fixed(100.0), "auto", sp=1000.0, bumpless=2, **limits)
    rig.step()

    assert mode(rig) == ("manual" if reason else "auto")
    assert reasons(rig) == (["refused: a PV alarm is active"] if reason else [])


def test_the_interlock_can_be_switched_off():
    rig = Rig()
    rig.add(Fixed(100.0), "auto", low=500.0, interlock=0)
    rig.step()

    assert mode(rig) == "auto"


def test_an_alarm_programming_error_keeps_the_loop_in_manual_even_without_interlock():
    rig = Rig()
    _, s = rig.add(Fixed(100.0), "auto", interlock=0)
    s.status |= bits.ALARM_ERROR
    rig.step()

    assert mode(rig) == "manual"
    assert reasons(rig) == ["refused: alarm programming error (+06 bit 10)"]


def test_an_alarm_programming_error_that_comes_up_forces_manual():
    rig = Rig()
    _, s = rig.add(Fixed(100.0), "auto", sp=100.0, out=300.0)
    rig.step(2)
    s.status |= bits.ALARM_ERROR
    s.busy |= bits.TRIP
    rig.step(2)

    assert (mode(rig), s.out) == ("manual", 300.0)
    assert reasons(rig) == ["to Manual: alarm programming error (+06 bit 10)"]


def test_an_alarm_that_comes_up_in_auto_leaves_the_mode_alone():
    rig = Rig()
    pv = Fixed(1000.0)
    rig.add(pv, "auto", sp=1000.0, high=1500.0)
    rig.step(2)
    pv.value = 2000.0
    rig.step(2)

    assert mode(rig) == "auto"


# --- bumpless transfers ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("on_pv", [0, 1])
@pytest.mark.parametrize("velocity", [0, 1])
def test_bumpless_one_has_no_bump_at_any_error(velocity, on_pv):
    rig = Rig(base=0.1)
    _, s = rig.add(
        Fixed(1000.0),
        sp=3000.0,
        gain=5.0,
        reset=4.0,
        rate=2.0,
        velocity=velocity,
        derivative_on_pv=on_pv,
        bias=123.0,
        out=1800.0,
    )
    rig.step(3)
    rig.request("auto")
    outs = [out for (out,) in rig.trace(5, "out")]

    assert outs == [1800.0] * 5
    assert s.sp == 1000.0
    assert s.bias == (123.0 if velocity else 1800.0)


def test_bumpless_two_has_no_bump_without_error():
    rig = Rig(base=0.1)
    _, s = rig.add(Fixed(1000.0), sp=1000.0, gain=5.0, reset=4.0, rate=2.0, bumpless=2, bias=123.0, out=1800.0)
    rig.step(3)
    rig.request("auto")

    assert [out for (out,) in rig.trace(5, "out")] == [1800.0] * 5
    assert s.bias == 1800.0


def test_bumpless_two_keeps_the_set_point_and_shows_the_proportional_step_but_no_kick():
    rig = Rig(base=0.1)
    _, s = rig.add(Fixed(1000.0), sp=1010.0, gain=5.0, rate=20.0, bumpless=2, out=1800.0)
    rig.step(3)
    rig.request("auto")

    assert [out for (out,) in rig.trace(3, "out")] == [1850.0] * 3
    assert s.sp == 1010.0


def test_bumpless_one_sets_the_set_point_on_the_roots_scale():
    rig = Rig(base=0.1)
    _, s = rig.add(Fixed(1600.0), "auto", square_root=1, span=4095.0**0.5, sp=10.0, gain=1.0, out=900.0)
    rig.step()

    assert (s.sp, s.out) == (40.0, 900.0)


def test_into_cascade_the_majors_output_becomes_the_minors_pv():
    rig = pair(inner="auto")
    rig.step()
    rig.st[0].sp, before = 1300.0, None
    rig.step()
    before = rig.st[0].out
    rig.st[1].out = 3000.0
    rig.request("cascade", 0)
    rig.step()

    assert rig.st[1].out == 1200.0
    assert rig.sig[2] == 1200.0
    assert before == 100.0
    assert rig.st[0].out == 0.0, "the error is 0 now, and the bias is the output of the transfer"


def test_bumpless_two_leaves_the_majors_output_alone():
    rig = Rig(base=0.1)
    rig.add(Fixed(1200.0), "auto", sp=1200.0, major=1, bumpless=2)
    rig.add(Fixed(2000.0), sp=2000.0, out=3000.0)
    rig.step()
    rig.request("cascade", 0)
    rig.step()

    assert rig.st[1].out == 3000.0


def test_from_manual_the_past_of_the_error_does_not_kick():
    """The PV moved while the loop was in Manual; the derivative must not see it at the transfer."""
    rig = Rig(base=0.1)
    pv = Fixed(500.0)
    rig.add(pv, sp=2000.0, gain=1.0, rate=5.0, bumpless=2, out=1000.0)
    rig.step(3)
    pv.value = 1900.0
    rig.step()
    rig.request("auto")

    assert [out for (out,) in rig.trace(3, "out")] == [1100.0] * 3


def test_back_to_manual_the_output_stays():
    rig = Rig(base=0.1)
    _, s = rig.add(FirstOrder(1.0, 5.0, initial=1000.0), "auto", sp=1000.0, gain=2.0, reset=5.0, out=1000.0)
    rig.step(2)
    s.sp = 1500.0
    rig.run(3)
    held = s.out
    rig.request("manual")
    rig.run(3)

    assert (mode(rig), s.out) == ("manual", held)


# --- the CPU's mode --------------------------------------------------------------------------------------------------


def test_restoring_returns_a_cascade_to_its_modes_at_once():
    rig = cascaded()
    rig.log.clear()
    for s in rig.st:
        s.prior = s.status & bits.MODES
        s.status = (s.status & ~bits.MODES) | bits.MANUAL
        s.busy |= bits.RESTORE
    rig.step()

    assert (mode(rig, 0), mode(rig, 1)) == ("cascade", "auto")
    assert reasons(rig) == ["back to the mode before Program mode"] * 2


def test_a_stopped_loop_does_nothing_and_its_module_is_off():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, out=700.0, out_low=4.0, out_width=16.0)
    rig.step()
    s.busy |= bits.STOPPED
    pv.value = 3000.0
    rig.step()

    assert (s.pv, s.out, rig.sig[3]) == (1000.0, 700.0, 4.0)


def test_an_independent_loop_without_transfer_is_blind_and_mute_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, reset=10.0, out=700.0)
    rig.step()
    s.sp = 1100.0
    s.busy |= bits.PROGRAM | bits.PV_STALE | bits.OUTPUT_CUT
    pv.value = 3000.0
    rig.step(5)

    assert s.pv == 1000.0
    assert s.out > 800.0
    assert rig.sig[3] == 0.0


def test_an_independent_loop_with_transfer_goes_on_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, out=700.0)
    rig.step()
    s.busy |= bits.PROGRAM
    pv.value = 900.0
    rig.step()

    assert (s.pv, s.out, rig.sig[3]) == (900.0, 800.0, 800.0)


# --- notices ---------------------------------------------------------------------------------------------------------


def test_several_notices_of_one_sample_come_out_in_order():
    rig = pair()
    s = rig.st[0]
    s.notice = 0
    rig.request("cascade", 0)
    rig.cfg[0].rs_enabled = 0
    rig.command(bits.RS_START)
    rig.step()

    assert [text.split(":")[0] for _, text in rig.log] == ["refused"]
    assert rig.log[0][1].count(";") == 1


def test_a_notice_knows_what_was_requested():
    rig = pair()
    rig.st[0].requested = bits.CASCADE
    number = (bits.CASCADE << REASON_BITS | 3) * NOTICES + 12

    assert notices(number) == [(bits.CASCADE, 3), (0, 12)]
    assert Dl06.requested(number) == "cascade"
    assert Dl06.describe(number) == (f"{REASONS[3]}; {REASONS[12]}", "")
    assert Dl06.requested(12) is None
    assert Dl06.describe(0) == ("", "")
