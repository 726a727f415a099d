"""Modes of a DPIDE instruction: both anti-windups, the changes between automatic and manual, PID_RUN, MOUT_AUTO."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest

from dpide_rig import Rig
from pidcfg.schemas.base import Quantity

PI = {"Kc_Kp": 2, "Ti_Ki": 1, "SV": 10}
"""0.1 s: I_MV grows by a tenth of the error."""
WITHOUT = "MV jumps at the end of manual: without Ti_Ki there is no I_MV that could carry MOUT"


def near(rows):
    """Rows of signals in single precision."""
    return [pytest.approx(row, rel=1e-5, abs=1e-5) for row in rows]


# --- anti-windup -----------------------------------------------------------------------------------------------------


def test_pid_mode_0_holds_i_mv_while_mv_is_beyond_its_limits():
    """P is 20 at first: MV passes 22 with the third part of 1."""
    rig = Rig({**PI, "MV_MAX": 22})

    assert rig.play([0.0] * 5, "MV", "I_MV") == near([(21, 1), (22, 2), (22, 2), (22, 2), (22, 2)])


def test_pid_mode_0_holds_i_mv_whichever_way_the_error_points():
    """The error turns round, but MV stays beyond MV_MAX by its bias."""
    rig = Rig({**PI, "BIAS": 300, "MV_MAX": 100})
    rig.set("I_MV", 50)

    assert rig.play([0.0, 30.0, 90.0], "MV", "I_MV") == [(100.0, 50.0)] * 3
    assert rig.play([200.0], "MV", "I_MV") == near([(0, 50)])
    assert rig.play([160.0], "MV", "I_MV") == near([(35, 35)])


def test_pid_mode_2_works_i_mv_out_of_the_limited_mv():
    """I_MV = MV - P - BIAS = 22 - 2 E - 5."""
    rig = Rig({**PI, "MV_MAX": 22, "BIAS": 5, "PID_MODE": 2})

    assert rig.play([0.0, 0.0, 2.0, 10.0], "MV", "I_MV") == near([(22, -3), (22, -3), (18.8, -2.2), (2.8, -2.2)])


def test_pid_mode_2_counts_the_derivative():
    """D is 40 at the second sample: I_MV = 22 - 24 - 40."""
    rig = Rig({**PI, "MV_MAX": 22, "PID_MODE": 2, "Td_Kd": 2})

    assert rig.play([0.0, -2.0], "I_MV") == pytest.approx([1.0, -42.0])


@pytest.mark.parametrize("mode", [0, 2])
def test_the_low_limit_works_alike(mode):
    """P is -20; in mode 2 I_MV = 5 + 20."""
    rig = Rig({**PI, "MV_MIN": 5, "PID_MODE": mode})

    assert rig.play([20.0] * 2, "MV", "I_MV") == near([(5, 25 if mode else 0)] * 2)


@pytest.mark.parametrize("mode", [0, 2])
def test_mv_at_a_limit_is_not_beyond_it(mode):
    rig = Rig({**PI, "MV_MAX": 21, "PID_MODE": mode})

    assert rig.play([0.0], "MV", "I_MV") == [(21.0, 1.0)]
    assert rig.st[0].status & rig.plc.flag_bits["mv_limited"] == 0


def test_back_calculation_reacts_sooner_than_holding():
    """As the manual says of PID_MODE 2: the error falls by 1 a sample from 20, and P with I_MV is far above MV_MAX."""
    left = {}
    for mode in (0, 2):
        rig = Rig({**PI, "Ti_Ki": 0.01, "SV": 20, "PID_MODE": mode, "I_MV": 90})
        left[mode] = [mv < 100.0 for mv in rig.play([float(k) for k in range(20)], "MV")].index(True)

    assert left == {0: 16, 2: 1}


# --- automatic and manual --------------------------------------------------------------------------------------------


def test_manual_puts_mout_out_within_the_limits():
    rig = Rig({**PI, "PID_MAN": True, "MOUT": 42})
    seen, limited = [], []
    for mout in (42, 250, -3, 100):
        rig.set("output", mout)
        seen += rig.play([0.0], "MV", "MOUT")
        limited.append(bool(rig.st[0].status & rig.plc.flag_bits["mv_limited"]))

    assert seen == [(42.0, 42.0), (100.0, 250.0), (0.0, -3.0), (100.0, 100.0)]
    assert limited == [False, True, True, False]
    assert rig.mode() == "manual"


@pytest.mark.parametrize("mode", [0, 2])
def test_manual_leaves_i_mv(mode):
    rig = Rig({**PI, "PID_MODE": mode})
    rig.play([0.0] * 2, "MV")
    rig.set("PID_MAN", value=True)

    assert rig.play([0.0] * 3, "I_MV") == [2.0] * 3


@pytest.mark.parametrize("mode", [0, 2])
def test_the_end_of_manual_does_not_bump(mode):
    """I_MV = 60 - 2 - 7 and one part of 0.1."""
    rig = Rig({**PI, "PID_MAN": True, "MOUT": 60, "BIAS": 7, "PID_MODE": mode, "Td_Kd": 5})
    rig.play([5.0, 9.0], "MV")
    rig.set("PID_MAN", value=False)

    assert rig.play([9.0, 9.0], "MV", "I_MV") == near([(60.1, 51.1), (60.2, 51.2)])
    assert rig.log == []


def test_without_an_integral_manual_ends_with_a_bump_in_both_modes():
    for mode in (0, 2):
        rig = Rig({**PI, "Ti_Ki": 0, "PID_MAN": True, "MOUT": 60, "PID_MODE": mode})
        rig.play([9.0], "MV")
        rig.plc.request(0, "auto")
        assert rig.play([9.0], "MV", "I_MV") == [(2.0, 0.0)]
        assert rig.log == [("L1", WITHOUT)]


def test_a_small_bump_is_not_worth_a_word():
    rig = Rig({**PI, "Ti_Ki": 0, "PID_MAN": True, "MOUT": 2.9})
    rig.play([9.0], "MV")
    rig.plc.request(0, "auto")
    rig.play([9.0], "MV")

    assert rig.log == []


def test_the_derivative_has_no_past_after_manual():
    """MV would be lower by 5 x 40 / 0.1 if PV's move during manual counted."""
    rig = Rig({**PI, "Ti_Ki": 0, "Td_Kd": 5, "Tf": 3, "SV": 50, "MV_MIN": -1e6})
    rig.play([0.0, 4.0], "MV")
    rig.set("PID_MAN", value=True)
    rig.play([4.0, 20.0], "MV")
    rig.set("PID_MAN", value=False)

    assert rig.play([40.0], "MV") == [20.0]


def test_an_end_of_manual_without_a_measurement_is_forgotten_when_pid_run_is_false():
    rig = Rig({**PI, "PID_MAN": True, "MOUT": 60, "PID_MODE": 2})
    rig.play([9.0], "MV")
    rig.plc.request(0, "auto")
    assert rig.play([math.nan], "MV") == [60.0]
    rig.plc.request(0, "off")
    rig.step()
    rig.plc.request(0, "auto")

    assert rig.play([9.0], "I_MV") == pytest.approx([0.1])


def test_start_in_automatic_is_no_end_of_manual():
    """In PID_MODE 2 nothing is worked out of the MV that the loop starts with."""
    rig = Rig({**PI, "PID_MODE": 2, "MV": 77})

    assert rig.signal("MV") == 77.0
    assert rig.play([9.0], "MV", "I_MV") == near([(2.1, 0.1)])
    assert rig.log == []


# --- MOUT_AUTO -------------------------------------------------------------------------------------------------------


def test_mout_follows_mv_and_makes_the_change_to_manual_smooth():
    rig = Rig({**PI, "MOUT_AUTO": True})
    rows = rig.play([0.0, 5.0, 3.0], "MV", "MOUT")
    rig.plc.request(0, "manual")

    assert all(mv == mout for mv, mout in rows)
    assert rig.play([9.0], "MV") == [rows[-1][0]]


def test_mout_stands_still_without_it():
    rig = Rig({**PI, "MOUT": 33})

    assert rig.play([0.0, 5.0], "MOUT") == [33.0, 33.0]


def test_in_manual_a_written_mout_acts_and_becomes_what_the_limits_leave():
    rig = Rig({**PI, "MOUT_AUTO": True, "PID_MAN": True})
    rig.set("MOUT", 120)

    assert rig.play([0.0], "MV", "MOUT") == [(100.0, 100.0)]


@pytest.mark.parametrize(
    ("given", "effect"),
    [
        ({}, "MOUT acts in manual only"),
        ({"MOUT_AUTO": True}, "MOUT acts in manual only; MOUT_AUTO is TRUE, so MOUT follows MV again"),
        ({"PID_MAN": True}, None),
        ({"PID_MAN": True, "PID_MODE": 1}, "MOUT acts in manual only"),
        ({"PID_RUN": False}, "MV stays 0 while PID_RUN is FALSE"),
    ],
)
def test_an_output_that_does_not_act_is_told(given, effect):
    rig = Rig({**PI, **given})

    assert rig.set("output", 40) == effect
    assert rig.signal("MOUT") == 40.0


# --- PID_RUN ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("given", [{}, {"PID_MAN": True, "MOUT": 50}, {"MV_MIN": 15}])
def test_pid_run_false_makes_mv_0_at_once(given):
    rig = Rig({**PI, **given, "CYCLE": 1000})
    rig.step(3)
    assert rig.signal("MV") > 10.0
    rig.set("PID_RUN", value=False)
    rig.step()

    assert (rig.signal("MV"), rig.mode()) == (0.0, "off")


def test_while_pid_run_is_false_only_pv_is_renewed():
    rig = Rig({**PI, "MOUT_AUTO": True})
    rig.play([0.0] * 3, "MV")
    kept = rig.signal("I_MV"), rig.signal("MOUT"), rig.signal("E")
    rig.plc.request(0, "off")
    rows = rig.play([4.0, 5.0], "MV", "PV")

    assert rows == [(0.0, 4.0), (0.0, 5.0)]
    assert (rig.signal("I_MV"), rig.signal("MOUT"), rig.signal("E")) == kept


def test_pid_run_true_goes_on_with_i_mv_and_without_a_past():
    rig = Rig({**PI, "Td_Kd": 3, "ERR_DBW": 5})
    rig.play([0.0, 0.0, 0.0], "MV")
    rig.set("PID_RUN", value=False)
    rig.play([11.0], "MV")
    rig.set("PID_RUN", value=True)

    assert rig.play([9.0], "MV", "I_MV", "E") == near([(5.1, 3.1, 1.0)])


def test_pid_run_true_forgets_the_dead_band_and_the_end_of_manual_does_not():
    """Back from FALSE an error inside the band is normal until PV crosses SV."""
    rig = Rig({**PI, "ERR_DBW": 5})
    assert rig.play([9.0, 11.0], "E") == [1.0, 0.0]
    rig.set("PID_MAN", value=True)
    rig.step()
    rig.set("PID_MAN", value=False)
    assert rig.play([12.0], "E") == [0.0]
    rig.set("PID_RUN", value=False)
    rig.step()
    rig.set("PID_RUN", value=True)

    assert rig.play([12.0, 9.0], "E") == [-2.0, 0.0]
    again = Rig({**PI, "ERR_DBW": 5})
    again.play([9.0], "E")
    again.set("PID_RUN", value=False)
    again.step()
    again.set("PID_RUN", value=True)
    assert again.play([12.0], "E") == [-2.0]


def test_pid_run_true_is_no_end_of_manual():
    rig = Rig({**PI, "PID_MODE": 2})
    rig.play([0.0] * 2, "MV")
    rig.plc.request(0, "off")
    rig.step()
    rig.plc.request(0, "auto")

    assert rig.play([9.0], "I_MV") == pytest.approx([2.1])
    assert rig.log == []


def test_calculations_stay_at_whole_multiples_of_the_sampling_time():
    rig = Rig({**PI, "CYCLE": 500})
    rig.step(2)
    rig.set("PID_RUN", value=False)
    rig.step(1)
    rig.set("PID_RUN", value=True)

    assert rig.trace(4, "MV") == [0.0, 0.0, 30.0, 30.0]


def test_false_and_true_within_a_base_step_change_nothing():
    rig = Rig(PI)
    rig.play([0.0], "MV")
    rig.set("PID_RUN", value=False)
    rig.set("PID_RUN", value=True)

    assert rig.play([0.0], "MV", "I_MV") == [(22.0, 2.0)]


# --- modes by name ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "mode"),
    [
        ({}, "auto"),
        ({"PID_MODE": 2}, "auto"),
        ({"PID_MAN": True}, "manual"),
        ({"PID_MODE": 1}, "autotune"),
        ({"PID_MODE": 1, "PID_MAN": True}, "autotune"),
        ({"PID_RUN": False}, "off"),
        ({"PID_RUN": False, "PID_MAN": True, "PID_MODE": 1}, "off"),
    ],
)
def test_a_loop_starts_in_the_mode_that_its_operands_state(given, mode):
    rig = Rig({**PI, **given})

    assert (rig.plc.goals, rig.mode()) == ([mode], mode)
    assert rig.step().mode() == mode


@pytest.mark.parametrize("start", ["auto", "manual", "off", "autotune"])
@pytest.mark.parametrize("mode", ["auto", "manual", "off", "autotune"])
def test_a_request_makes_the_mode_with_the_next_calculation(start, mode):
    given = {"auto": {}, "manual": {"PID_MAN": True}, "off": {"PID_RUN": False}, "autotune": {"PID_MODE": 1}}[start]
    rig = Rig({**PI, **given}).step()
    rig.plc.request(0, mode)
    assert rig.mode() == start
    rig.step()

    assert rig.mode() == ("autotune" if (start, mode) == ("autotune", "manual") else mode)


def test_manual_waits_for_the_end_of_an_autotune():
    rig = Rig({**PI, "PID_MODE": 1, "MOUT": 12}).step()
    rig.plc.request(0, "manual")
    notice = rig.st[0].notice
    rig.step()

    assert (rig.plc.requested(notice), rig.plc.describe(notice)) == (
        "manual",
        ("waits: PID_MAN has no effect while PID_MODE is 1", ""),
    )
    rig.plc.autotune(0, "cancel")
    assert (rig.step().mode(), rig.signal("MV")) == ("manual", 12.0)


def test_automatic_keeps_pid_mode_2():
    rig = Rig({**PI, "PID_MODE": 2, "PID_MAN": True}).step()
    rig.plc.request(0, "auto")

    assert (rig.step().mode(), rig.st[0].mode) == ("auto", 2)


def test_a_written_operand_makes_a_mode_too():
    rig = Rig(PI).step()
    seen = []
    for name, value in (("PID_MAN", True), ("PID_MODE", 1), ("PID_MODE", 2), ("PID_MAN", False), ("PID_RUN", False)):
        rig.set(name, value)
        seen.append(rig.step().mode())

    assert seen == ["manual", "autotune", "manual", "auto", "off"]


# --- the PLC stops ---------------------------------------------------------------------------------------------------


def test_a_stopped_plc_keeps_every_operand_and_begins_without_a_past():
    rig = Rig({**PI, "Td_Kd": 3})
    rig.play([0.0, 0.0], "MV")
    rig.plc.program(rig.sig)
    before = rig.trace(1, "MV", "PV", "I_MV")
    assert rig.play([9.0] * 20, "MV", "PV", "I_MV") == before * 20
    assert rig.log == [("L1", "the PLC is stopped: the instruction is not executed, MV stays as it is")]
    rig.plc.run(rig.tick)

    assert rig.play([9.0], "MV", "PV", "I_MV") == near([(4.1, 9.0, 2.1)])


def test_what_is_asked_of_a_stopped_plc_waits():
    rig = Rig({**PI, "MV_MIN": 5}).step()
    rig.plc.program(rig.sig)
    rig.step()
    rig.log.clear()
    rig.plc.request(0, "off")
    before = rig.signal("MV")

    assert rig.trace(3, "MV") == [before] * 3
    assert rig.log == [("L1", "waits: the PLC is stopped")]
    rig.plc.run(rig.tick)
    assert (rig.step().mode(), rig.signal("MV")) == ("off", 0.0)


def test_stop_and_run_twice_are_once():
    rig = Rig({**PI, "Td_Kd": 1})
    rig.plc.run(0)
    rig.play([0.0, 1.0], "MV")
    rig.plc.run(rig.tick)
    assert rig.play([2.0], "MV")[0] == pytest.approx(16.0 + 2.7 - 10.0)
    for _ in range(2):
        rig.plc.program(rig.sig)
    rig.step()
    assert len(rig.log) == 1


# --- devices that are shared -----------------------------------------------------------------------------------------

CASCADE = ({"MV": "D304"}, {"SV": "D304", "MV": "D310"})


def test_the_mv_of_one_loop_is_the_sv_of_another():
    rig = Rig({"SV": 30}, {"Kc_Kp": 3}, devices=CASCADE)
    rig.plants[0].value, rig.plants[1].value = 10.0, 5.0
    rig.step()

    assert (rig.signal("MV"), rig.signal("SV", 1), rig.signal("MV", 1)) == (20.0, 20.0, 45.0)
    effect = rig.set("SV", 77, 1)
    assert effect == "MV of L1 stands in the same device and overwrites it"
    assert rig.step().signal("SV", 1) == 20.0


@pytest.mark.parametrize(("operand", "given", "mv"), [("BIAS", {}, 25.0), ("MOUT", {"PID_MAN": True}, 20.0)])
def test_the_mv_of_one_loop_is_the_bias_or_the_mout_of_another(operand, given, mv):
    rig = Rig({"SV": 20}, {"SV": 5, **given}, devices=({"MV": "D304"}, {operand: "D304"}))

    assert rig.step().signal("MV", 1) == mv


def test_a_writer_that_comes_later_is_seen_with_the_next_calculation():
    rig = Rig({}, {"SV": 30}, devices=CASCADE[::-1])

    assert rig.trace(2, "SV") == [0.0, 30.0]


def test_an_mv_of_its_own_is_no_writer():
    rig = Rig({"SV": 30, "MOUT": 7}, devices=({"MV": "D304", "MOUT": "D304"},))

    assert rig.cfg[0].mout_from == -1


@pytest.mark.parametrize("follow", [False, True])
def test_a_mout_in_the_device_of_its_own_mv_is_that_mv(follow):
    devices = ({"MV": "D304", "MOUT": "D304"},)
    rig = Rig({"SV": 30, "MOUT": 7, "MOUT_AUTO": follow}, devices=devices)
    assert (rig.signal("MV"), rig.signal("MOUT")) == (7.0, 7.0)
    assert rig.play([10.0, 12.0], "MV", "MOUT") == [(20.0, 20.0), (18.0, 18.0)]
    rig.plc.request(0, "manual")
    assert rig.play([0.0, 5.0], "MV", "MOUT") == [(18.0, 18.0)] * 2
    assert rig.set("MOUT", 130) is None
    assert (rig.signal("MV"), rig.signal("MOUT")) == (130.0, 130.0)
    assert rig.play([5.0], "MV", "MOUT") == [(100.0, 100.0)]
    rig.set("Kc_Kp", 2)
    assert (rig.signal("MV"), rig.signal("MOUT")) == (100.0, 100.0)
    rig.plc.request(0, "off")
    assert rig.play([5.0], "MV", "MOUT") == [(0.0, 0.0)]
    assert rig.set("MOUT", 30) == "MV stays 0 while PID_RUN is FALSE"
    assert (rig.signal("MV"), rig.signal("MOUT")) == (0.0, 0.0)
    rig.plc.request(0, "manual")
    assert rig.play([5.0], "MV", "MOUT") == [(0.0, 0.0)]


def test_a_mout_that_is_the_mv_begins_there_and_is_told_to_be_overwritten():
    devices = ({"MV": "D304", "MOUT": "D304"},)
    rig = Rig({"SV": 30, "MOUT": 7}, devices=devices)
    rig.plc.set_output(0, Quantity(Decimal(150)), rig.sig)

    assert (rig.signal("MV"), rig.signal("MOUT")) == (100.0, 100.0)
    assert rig.set("MOUT", 30) == "MOUT acts in manual only; it stands in the device of MV, which overwrites it"
    off = Rig({"PID_RUN": False, "MOUT": 7}, devices=devices)
    assert (off.signal("MV"), off.signal("MOUT")) == (0.0, 0.0)
    assert off.step().signal("MOUT") == 0.0


def test_one_start_bit_starts_and_stops_all_loops_that_have_it():
    devices = ({"PID_RUN": "M100"}, {"PID_RUN": "M100"}, {"PID_RUN": "M101"})
    rig = Rig({"SV": 30}, {"SV": 40}, {"SV": 50}, devices=devices).step()
    rig.plc.request(0, "off")
    rig.step()
    assert [rig.signal("MV", i) for i in range(3)] == [0.0, 0.0, 50.0]
    rig.set("PID_RUN", value=True, i=1)
    rig.step()

    assert [rig.signal("MV", i) for i in range(3)] == [30.0, 40.0, 50.0]


def test_operands_of_one_loop_in_one_device_are_written_together():
    devices = ({"SV": "D10", "BIAS": "D10", "PID_RUN": "M1", "MOUT_AUTO": "M1"}, {"BIAS": "D10"})
    rig = Rig({"SV": 4, "BIAS": 4, "PID_RUN": False}, {}, devices=devices)
    rig.set("BIAS", 12)
    assert (rig.st[0].sp, rig.st[0].bias, rig.st[1].bias) == (12.0, 12.0, 12.0)
    rig.set("SV", 15)
    assert (rig.st[0].sp, rig.st[0].bias, rig.st[1].bias) == (15.0, 15.0, 15.0)
    rig.plc.request(0, "auto")
    rig.step()

    assert (rig.mode(), rig.cfg[0].mout_follows, rig.signal("MV"), rig.signal("MOUT")) == ("auto", 1, 30.0, 30.0)


def test_what_an_event_writes_itself_is_not_overwritten_by_a_shared_device():
    rig = Rig({"PID_MAN": True}, devices=({"PID_RUN": "M1", "PID_MAN": "M1"},))
    rig.plc.request(0, "auto")

    assert rig.step().mode() == "auto"


def test_a_set_point_of_two_loops_shows_in_both():
    rig = Rig({}, {}, devices=({"SV": "D10"}, {"SV": "D10"}))
    rig.set("SV", 12)

    assert (rig.signal("SV"), rig.signal("SV", 1)) == (12.0, 12.0)
