"""Modes of the virtual DL06 that words alone reach: overflows, programming errors, the CPU, notices."""

from __future__ import annotations

from dl06_rig import Rig
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.operate import MODE_REASONS as REASONS
from pidcfg.sim.controllers.dl06.plc import Dl06
from pidcfg.sim.controllers.kernels import NOTICES, REASON_BITS, notices
from rig_plants import FirstOrder, Fixed


def mode(rig, i=0):
    return Dl06.mode(rig.states[i].status)


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


def test_when_a_minor_loop_overflows_its_major_goes_to_manual():
    rig = cascaded()
    rig.states[0].kp = 1e12
    rig.plants[0].value = 1100.0
    rig.step()

    assert (mode(rig, 0), mode(rig, 1)) == ("manual", "manual")
    assert (1, "to Manual: the minor loop left Cascade") in rig.log


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
    s.pending |= bits.TRIP
    rig.step(2)

    assert (mode(rig), s.out) == ("manual", 300.0)
    assert reasons(rig) == ["to Manual: alarm programming error (+06 bit 10)"]


# --- bumpless transfers ----------------------------------------------------------------------------------------------


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
    for s in rig.states:
        s.prior = s.status & bits.MODES
        s.status = (s.status & ~bits.MODES) | bits.MANUAL
        s.pending |= bits.RESTORE
    rig.step()

    assert (mode(rig, 0), mode(rig, 1)) == ("cascade", "auto")
    assert reasons(rig) == ["back to the mode before Program mode"] * 2


def test_a_stopped_loop_does_nothing_and_its_module_is_off():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, out=700.0, out_low=4.0, out_width=16.0)
    rig.step()
    s.pending |= bits.STOPPED
    pv.value = 3000.0
    rig.step()

    assert (s.pv, s.out, rig.signal_values[3]) == (1000.0, 700.0, 4.0)


def test_an_independent_loop_without_transfer_is_blind_and_mute_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, reset=10.0, out=700.0)
    rig.step()
    s.sp = 1100.0
    s.pending |= bits.PROGRAM | bits.PV_STALE | bits.OUTPUT_CUT
    pv.value = 3000.0
    rig.step(5)

    assert s.pv == 1000.0
    assert s.out > 800.0
    assert rig.signal_values[3] == 0.0


def test_an_independent_loop_with_transfer_goes_on_in_program_mode():
    rig = Rig(base=0.1)
    pv = Fixed(1000.0)
    _, s = rig.add(pv, "auto", sp=1000.0, gain=1.0, out=700.0)
    rig.step()
    s.pending |= bits.PROGRAM
    pv.value = 900.0
    rig.step()

    assert (s.pv, s.out, rig.signal_values[3]) == (900.0, 800.0, 800.0)


# --- notices ---------------------------------------------------------------------------------------------------------


def test_several_notices_of_one_sample_come_out_in_order():
    rig = pair()
    s = rig.states[0]
    s.notice = 0
    rig.request("cascade", 0)
    rig.configs[0].rs_enabled = 0
    rig.command(bits.RS_START)
    rig.step()

    assert [text.split(":")[0] for _, text in rig.log] == ["refused"]
    assert rig.log[0][1].count(";") == 1


def test_a_notice_knows_what_was_requested():
    rig = pair()
    rig.states[0].requested = bits.CASCADE
    number = (bits.CASCADE << REASON_BITS | 3) * NOTICES + 12

    assert notices(number) == [(bits.CASCADE, 3), (0, 12)]
    assert Dl06.requested(number) == "cascade"
    assert Dl06.describe(number) == (f"{REASONS[3]}; {REASONS[12]}", "")
    assert Dl06.requested(12) is None
    assert Dl06.describe(0) == ("", "")
