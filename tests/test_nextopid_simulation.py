"""Networks of NextoPID blocks as they run: the manual's own peaks, cascade, override, and what scenarios may do."""

from __future__ import annotations

import pytest
from pydantic_core import PydanticCustomError

from nextopid_rig import GAINS, controller, findings, image_of, plc_of, run
from pidcfg.api import simulate
from pidcfg.sim.controllers.dl06.plc import scan_time
from pidcfg.sim.judgement.report import Range
from standing_rig import SCENARIO, outcome

FEED_FORWARD = """
signals: {Ti: 20.0, Fi: 2.0}
blocks:
  - {name: D_Ti,  type: ControlDelay,   InVar: Ti, DelayTime: 1.0, InitDelayedVar: 20.0}
  - {name: LL_Ti, type: ControlLeadLag, InVar: D_Ti.OutVar, G: 1, Tlead: 10, Tlag: 5, Min_OutVar: -999, Max_OutVar: 999}
  - {name: D_Fi,  type: ControlDelay,   InVar: Fi, DelayTime: 0.5, InitDelayedVar: 2.0}
  - {name: LL_Fi, type: ControlLeadLag, InVar: D_Fi.OutVar, G: 1, Tlead: 10, Tlag: 4, Min_OutVar: -999, Max_OutVar: 999}
loops:
  - {name: TIC, type: PIDA_REAL, SP: 50, %s, BIAS: %s}
"""
EXCHANGER = """
duration: 240
initial: steady
plants:
  - {name: MV_out, model: first_order, input: TIC.MV, gain: 1, time_constant: 10, dead_time: 1}
  - {name: Ti_out, model: first_order, input: Ti, gain: 1, time_constant: 5, dead_time: 2}
  - {name: InvFi, model: first_order, input: "1 / max(Fi, 1)", gain: 1, time_constant: 4, dead_time: 1.5}
connect: {TIC.PV: MV_out * 2 * InvFi + Ti_out}
events: [{at: 5, set: {%s: %s}}, {at: 120, set: {%s: %s}}]
"""
WITH, WITHOUT = "(TIC.SP - LL_Ti.OutVar) * LL_Fi.OutVar / 2", "0"


def exchanger(bias, signal, changed, usual):
    """Lowest and highest outlet temperature while an inflow changes and comes back."""
    report = run(FEED_FORWARD % (GAINS, bias), EXCHANGER % (signal, changed, signal, usual))
    assert not report.problems
    return report.signals["TIC.PV"]


@pytest.mark.parametrize(("bias", "low", "high"), [(WITHOUT, 49.177, 50.855), (WITH, 49.964, 50.037)])
def test_the_peaks_that_the_manual_prints_for_the_inflow_rate(bias, low, high):
    found = exchanger(bias, "Fi", 2.1, 2.0)
    assert (found.low, found.high) == (pytest.approx(low, abs=0.004), pytest.approx(high, abs=0.004))


def test_the_peaks_for_the_inflow_temperature_are_as_large_as_the_manual_says():
    without, with_it = exchanger(WITHOUT, "Ti", 21, 20), exchanger(WITH, "Ti", 21, 20)
    assert 0.5 < without.high - 50 < 0.6
    assert 0.5 < 50 - without.low < 0.6
    assert 0.005 < with_it.high - 50 < 0.02
    assert 0.005 < 50 - with_it.low < 0.02


# --- cascade ---------------------------------------------------------------------------------------------------------

CASCADE = """
signals: {Casc: true}
loops:
  - {name: MA, type: PIDA_REAL, SP: 50, Kp: 2, Ti_Ki: 20, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100,
     TRK_VAL: SL.PV, TRK_IN: SL.TRK_OUT%s}
  - {name: SL, type: PIDA_REAL, SP: 40, SP_CASC: MA.MV, CASC: Casc, Kp: 1, Ti_Ki: 5, Td_Kd: 0, MinMV: 0, MaxMV: 60,
     MinPV: 0, MaxPV: 100}
"""
WINDUP = ", Windup_H_IN: SL.Windup_H_OUT, Windup_L_IN: SL.Windup_L_OUT"
TWO_TANKS = """
duration: 900
initial: steady
plants:
  SL: {model: first_order, gain: 1, time_constant: 5}
  MA: {model: first_order, input: SL.PV, gain: 1, time_constant: 60, dead_time: 2}
events: [%s]
"""
STARVED = "{at: 10, loop: SL, disturb: {gain: 0.5}}, {at: 500, loop: SL, disturb: {gain: 1}}"


def test_a_master_does_not_wind_up_while_its_slave_is_saturated():
    bound, loose = (run(CASCADE % wires, TWO_TANKS % STARVED) for wires in (WINDUP, ""))
    assert bound.signals["SL.MV"].high == 60
    assert bound.signals["MA.IntegralAction"].high < 70 < loose.signals["MA.IntegralAction"].high
    assert bound.signals["MA.PV"].high < 53
    assert loose.signals["MA.PV"].high > bound.signals["MA.PV"].high + 3
    assert bound.signals["MA.PV"].final == pytest.approx(50, abs=0.1)


def test_a_master_tracks_its_slave_s_pv_and_comes_back_without_a_bump():
    events = "{at: 10, set: {Casc: false}}, {at: 11, loop: SL, set: {SP: 30}}, {at: 60, set: {Casc: true}}"
    report = run(CASCADE % WINDUP, TWO_TANKS % events)
    modes = [(change.at, change.mode) for change in report.loops["MA"].modes]
    assert modes == [(0, "auto"), (10.1, "tracking"), (60.1, "auto")]
    assert [change.mode for change in report.loops["SL"].modes] == ["cascade", "auto", "cascade"]
    assert report.signals["SL.SP"].low == pytest.approx(30, abs=0.01)
    assert report.signals["MA.PV"].final == pytest.approx(50, abs=0.1)


# --- override --------------------------------------------------------------------------------------------------------

OVERRIDE = """
blocks: [{name: SEL, type: ControlSelectMin, MV1: A.MV, MV2: B.MV}]
loops:
  - {name: A, type: PIDA_REAL, SP: 60, Kp: 1, Ti_Ki: 20, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100%s}
  - {name: B, type: PIDA_REAL, SP: 50, Kp: 2, Ti_Ki: 10, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100%s}
"""
ONE_VALVE = """
duration: 600
initial: steady
plants:
  A: {model: first_order, input: SEL.MV, gain: 1, time_constant: 20, dead_time: 0.5}
  B: {model: first_order, input: SEL.MV, gain: 0.7, time_constant: 8, dead_time: 0.3}
events: [{at: 50, loop: B, disturb: {gain: 1.2}}, {at: 300, loop: B, disturb: {gain: 0.7}}]
"""


def test_an_override_pair_changes_over_without_a_bump_and_holds_both_limits():
    wires = [f", OVERR: SEL.OVERR{n}, TRK_VAL: SEL.MV" for n in (1, 2)]
    report = run(OVERRIDE % tuple(wires), ONE_VALVE)
    assert report.signals["A.PV"].final == pytest.approx(60, abs=0.1)
    assert report.signals["B.PV"].high < 58  # without the pair 72
    assert report.loops["A"].metrics["total_variation"] < 200
    wound = run(OVERRIDE % ("", ""), ONE_VALVE)
    assert wound.signals["A.PV"].high > report.signals["A.PV"].high + 3


# --- what a scenario may do ------------------------------------------------------------------------------------------

LOOP = "loops: [{name: L, type: PIDA_TUNE_REAL, SP: 50, %s%s}]\n"
TANK = "duration: 30\nplants: {L: {model: first_order, gain: 1, time_constant: 5}}\n"


def test_modes_are_asked_for_and_wired_ones_refused():
    events = TANK + "events: [{at: 5, loop: L, mode: manual}, {at: 10, loop: L, mode: auto}]"
    report = run(LOOP % (GAINS, ", ManualMV: 20"), events)
    assert [change.mode for change in report.loops["L"].modes] == ["auto", "manual", "auto"]
    wired = run("signals: {Hand: false}\n" + LOOP % (GAINS, ", Manual: Hand"), events)
    assert [change.mode for change in wired.loops["L"].modes] == ["auto", "auto", "auto"]
    assert "Manual is wired" in wired.loops["L"].modes[1].reason


@pytest.mark.parametrize("mode", ["tracking", "autotune"])
def test_a_mode_that_nobody_can_request_leaves_one_notice(mode):
    """Its bit has no room in a notice: it once ran over into a second one, "Manual is wired"."""
    report = run(LOOP % (GAINS, ""), TANK + f"events: [{{at: 5, loop: L, mode: {mode}}}]")
    refusal = report.loops["L"].modes[1]
    assert (refusal.requested, refusal.mode) == (mode, "auto")
    assert refusal.reason.startswith("this mode comes about by itself")
    assert report.loops["L"].notes == []


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ("{at: 1, loop: L, set: {Kq: 2}}", "'Kq' is nothing that can be set"),
        ("{at: 1, loop: L, set: {PV: 2}}", "the plant writes it"),
        ("{at: 1, loop: L, set: {SP: x}}", "'x' is not a number"),
        ("{at: 1, set: {X: 2}}", "'X' is no signal"),
        ("{at: 1, set: {Hand: 2}}", "not true or false"),
        ("{at: 1, loop: L, set: {Manual: true}}", "the program wires Hand to L.Manual"),
        ("{at: 1, loop: L, mode: remote}", "'remote' is no mode"),
        ("{at: 1, loop: L, ramp_soak: start}", "no ramp/soak"),
    ],
)
def test_what_cannot_be_done_is_said_before_the_run(event, message):
    from pidcfg.sim.engine.run import UnusableError

    with pytest.raises(UnusableError, match=message):
        run("signals: {Hand: false}\n" + LOOP % (GAINS, ", Manual: Hand"), f"{TANK}events: [{event}]")


@pytest.mark.parametrize("key", ["Ti_Ki", "Td_Kd"])
def test_times_are_set_with_units_as_in_the_configuration(key):
    plc = plc_of(LOOP % (GAINS, ""))
    assert [plc.check_set(0, (key,), text) for text in ("2 min", "500 ms", 7)] == [120, 0.5, 7]


@pytest.mark.parametrize("indep", ["true", "Form"])
@pytest.mark.parametrize("key", ["Ti_Ki", "Td_Kd"])
def test_a_time_is_no_gain(key, indep):
    plc = plc_of("signals: {Form: true}\n" + LOOP % (GAINS, f", Indep: {indep}"))
    assert plc.check_set(0, (key,), 0.25) == 0.25
    with pytest.raises(PydanticCustomError, match="2 min is a time, but with Indep TRUE it is a gain"):
        plc.check_set(0, (key,), "2 min")


@pytest.mark.parametrize("key", ["Ti_Ki", "Td_Kd"])
def test_a_time_is_not_written_once_an_event_has_made_it_a_gain(key):
    events = (
        f"{{at: 1, loop: L, set: {{Indep: true, {key}: 0.25}}}}",
        f"{{at: 2, loop: L, set: {{{key}: 2 min}}}}",
        f"{{at: 3, loop: L, set: {{Indep: false, {key}: 2 min}}}}",
        f"{{at: 4, loop: L, set: {{{key}: 2 min, Indep: true}}}}",
        f"{{at: 5, loop: L, set: {{{key}: 2 min, Indep: false}}}}",
    )
    report = run(LOOP % (GAINS, ""), f"{TANK}events: [{', '.join(events)}]")
    told = f"{key}: is not written: a time, but Indep is TRUE now, and {key} a gain"
    assert [(note.at, note.text) for note in report.notes if key in note.text] == [(2.0, told), (4.0, told)]


def test_a_plant_may_be_wired_to_a_signal_that_the_program_filters():
    text = "signals: {FT: 0}\nblocks: [{name: F, type: ControlLowFilter, InVar: FT, Tc: 1}]\n"
    loop = LOOP % (GAINS, ", PV: F.OutVar")
    plant = "plants: [{name: Tank, model: first_order, input: L.MV, gain: 1, time_constant: 5}]\n"
    report = run(text + loop, f"duration: 120\n{plant}connect: {{FT: Tank}}\n")
    assert not report.problems
    assert report.signals["L.PV"].final == pytest.approx(50, abs=0.1)
    from pidcfg.sim.engine.run import UnusableError

    with pytest.raises(UnusableError, match="comes from the PLC's program"):
        run(text + loop, TANK)


def test_a_wire_without_a_value_keeps_the_last_one_and_is_told_once():
    report = run("signals: {D: 2}\n" + LOOP % (GAINS, ", BIAS: 10 / D"), TANK + "events: [{at: 5, set: {D: 0}}]")
    assert [note.text for note in report.notes] == [
        "the wire of L.BIAS has no value (division by zero); it kept the one that it had"
    ]
    assert report.notes[0].at == 5
    assert not report.passed


def test_results_of_the_auto_tuning_are_accepted_only_when_they_are_sound():
    tuned = ", AutoTuneParam: {PercAmpMV: 5, PercHystPV: 0.1, PercMaxPeakPV: 10, NumCycles: 1, Mode: PI}, Manual: true"
    plant = "duration: 60\nplants: {L: {model: first_order, gain: 2, time_constant: 10, dead_time: 1, initial: 40}}\n"
    events = "events: [{at: 1, loop: L, autotune: start}, {at: 50, loop: L, autotune: accept}]"
    report = run(LOOP % (GAINS, tuned + ", ManualMV: 20"), plant + events)
    found = report.loops["L"].autotune
    assert (found["done"], found["error"], found["status"]) == (True, False, "done")
    assert found["results"]["Td_Kd"] == 0
    spoilt = run(LOOP % (GAINS, tuned + ", ManualMV: 2"), plant + events)
    found = spoilt.loops["L"].autotune
    assert (found["done"], found["error"], found["status"]) == (True, True, "MV_TOO_LOW")
    assert any("no results" in note.text for note in spoilt.notes)


def test_the_last_of_several_requests_counts():
    text = LOOP % (GAINS, ", ManualMV: 20, SP_CASC: 60, sample_time: 0.5")
    for first, last, mode in (
        ("mode: manual", "mode: auto", "auto"),
        ("mode: cascade", "mode: auto", "auto"),
        ("mode: auto", "mode: cascade", "cascade"),
        ("autotune: start", "autotune: cancel", "auto"),
    ):
        events = f"step: 0.1\nevents: [{{at: 1.1, loop: L, {first}}}, {{at: 1.2, loop: L, {last}}}]\n"
        report = run(text, TANK + events)
        assert report.loops["L"].modes[-1].mode == mode


def test_a_request_is_there_before_the_moves_of_its_cycle():
    text = "signals: {By_Hand: false}\n" + LOOP % (GAINS, ", ManualMV: 20")
    for place in ("start", "end"):
        moves = f"moves: [{{move: L.Manual, to: By_Hand, at: {place}}}]\n"
        report = run(
            text + moves,
            TANK + "events: [{at: 10, loop: L, mode: manual}]\n" + "expect: [{signal: By_Hand, min: 1, from: 10}]\n",
        )
        assert report.expectations[0].passed, place


def test_results_that_have_been_cleared_are_not_accepted():
    tuned = ", AutoTuneParam: {PercAmpMV: 5, PercHystPV: 0.1, PercMaxPeakPV: 10, NumCycles: 1, Mode: PI}, Manual: true"
    plant = "duration: 60\nplants: {L: {model: first_order, gain: 2, time_constant: 10, dead_time: 1, initial: 40}}\n"
    events = (
        "events: [{at: 1, loop: L, autotune: start}, {at: 50, loop: L, autotune: cancel}, "
        "{at: 55, loop: L, autotune: accept}]"
    )
    report = run(LOOP % (GAINS, tuned + ", ManualMV: 20"), plant + events)
    assert report.loops["L"].autotune["done"]
    assert any("no results" in note.text for note in report.notes)
    assert not report.loops["L"].flags["ErrBits.Kp"]


# --- order of execution ----------------------------------------------------------------------------------------------


def turns(text):
    """Names in the order of execution."""
    plc = plc_of(text)
    names = [plc.items[i].name for i in plc.listed_items]
    return [names[c.call_order] for c in plc.configs]


def test_blocks_come_after_those_they_read_and_rings_begin_with_a_loop():
    assert turns(FEED_FORWARD % (GAINS, WITH)) == ["D_Ti", "LL_Ti", "D_Fi", "LL_Fi", "TIC"]
    backwards = "blocks:\n" + "".join(
        f"  - {{name: F{i}, type: ControlLowFilter, InVar: F{i + 1}.OutVar, Tc: 1}}\n" for i in range(3)
    )
    backwards += "  - {name: F3, type: ControlLowFilter, InVar: L.MV, Tc: 1}\n"
    assert turns(backwards + LOOP % (GAINS, "")) == ["L", "F3", "F2", "F1", "F0"]
    assert turns(OVERRIDE % (", OVERR: SEL.OVERR1", ", OVERR: SEL.OVERR2")) == ["A", "B", "SEL"]
    assert turns(CASCADE % WINDUP) == ["MA", "SL"]


def test_a_ring_behind_another_one_does_not_begin_before_it():
    text = f"""
blocks:
  - {{name: LATE, type: ControlLowFilter, InVar: SEL.MV + LATE2.OutVar, Tc: 1}}
  - {{name: LATE2, type: ControlLowFilter, InVar: LATE.OutVar, Tc: 1}}
  - {{name: SEL, type: ControlSelectMin, MV1: A.MV, MV2: 50}}
loops: [{{name: A, type: PIDA_REAL, SP: 50, {GAINS}, OVERR: SEL.OVERR1, TRK_VAL: SEL.MV}}]
"""
    assert turns(text) == ["A", "SEL", "LATE", "LATE2"]


# --- the schema's own messages ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("loops: [{name: L, type: PIDX}]", "PID027", "type is 'PIDX', not one of PIDA_REAL"),
        ("loops: [{name: L}]", "PID021", "type is missing"),
        ("loops: [5]", "PID022", "0 must be a mapping of keys"),
        (f"loops: [{{name: L, type: PIDA_REAL, SP: 1, {GAINS}, Tii: 2}}]", "PID020", "unknown key 'Tii'"),
        (f"loops: [{{name: L, type: PIDA_REAL, SP: on, {GAINS}}}]", "PID022", "neither a number nor an expression"),
        (f"loops: [{{name: L, type: PIDA_REAL, SP: 010, {GAINS}}}]", "PID024", "octal"),
        (f"loops: [{{name: 1L, type: PIDA_REAL, SP: 1, {GAINS}}}]", "PID033", "not usable as the name"),
        (f"loops: [{{name: L, type: PIDA_REAL, SP: 1, {GAINS}, Manual: yes}}]", "PID026", "not true or false"),
    ],
)
def test_messages_name_the_key_that_is_meant(text, code, message):
    found = findings(text)
    assert any(c == code and message in m for c, m in found), found


def test_an_int_is_wired_through_rounding_and_its_ends():
    gains = GAINS.replace(".0", "").replace("MinMV: 0, MaxMV: 100", "MinMV: -32768, MaxMV: 32767")
    wires = "ManualMV: X * 20000, Manual: true"
    text = f"signals: {{X: 2.5}}\nloops: [{{name: L, type: PIDA_INT, SP: 5, {gains}, {wires}}}]\n"
    report = run(text, "duration: 2\nplants: {L: {model: dead_time}}\nevents: [{at: 1, set: {X: 0.000125}}]")
    found = report.signals["L.MV"]
    assert (found.low, found.high) == (2, 32767)


READER = """
loops:
  - {name: A, type: PIDA_REAL, SP: 40, %s, Manual: true, ManualMV: B.PV}
  - {name: B, type: %s, SP: 40, %s, sample_time: 0.3, SP_CASC: A.MV, BIAS: B.PV * 2}
"""
OPEN_BLOCK = """
blocks: [{name: F, type: ControlLowFilter, InVar: A.MV, Tc: 1}, {name: G, type: ControlLowFilter, Tc: 1}]
loops: [{name: A, type: PIDA_REAL, SP: 40, %s, Manual: true, ManualMV: G.InVar * 2}]
"""


def cycles(plc, slot, values, shown):
    """A signal in every cycle, with the program around assigning an input before the first call."""
    signal_values, found = list(plc.signal_values), []
    for n, value in enumerate(values):
        signal_values[slot] = value
        controller.scan(n * plc.base_ticks, plc.configs, plc.states, plc.aux, signal_values)
        found.append(signal_values[plc.layout.numbers[shown]])
    return found


@pytest.mark.parametrize(
    ("kind", "expected"),
    [("PIDA_REAL", [12.5, 13.25, 14.75, 80, 90]), ("PIDA_INT", [12, 13, 15, 80, 90])],
)
def test_an_input_that_the_program_around_assigns_is_read_as_it_is_in_this_cycle(kind, expected):
    """A comes first and is called in every cycle; B, whose PV it reads, in every third one."""
    gains = GAINS.replace(".0,", ",").replace("100.0", "100")
    plc = plc_of(READER % (GAINS, kind, gains))
    assert cycles(plc, plc.outside_inputs["B.PV"], [12.5, 13.25, 14.75, 80, 90], "A.MV") == expected

    plc = plc_of(READER % (GAINS, kind, gains))
    bias = cycles(plc, plc.outside_inputs["B.PV"], [12.5, 13.25, 14.75, 80, 90], "B.BIAS")
    assert bias == [2 * expected[0]] * 3 + [160] * 2


def test_an_open_input_of_a_block_is_read_as_it_is_in_this_cycle():
    plc = plc_of(OPEN_BLOCK % GAINS)
    assert cycles(plc, plc.outside_inputs["G.InVar"], [20, 30, 10], "A.MV") == [40, 60, 20]


def test_an_open_input_without_a_value_keeps_the_last_one_and_is_told():
    plc = plc_of(READER % (GAINS, "PIDA_REAL", GAINS))
    assert cycles(plc, plc.outside_inputs["B.PV"], [12.5, float("inf"), 14], "A.MV") == [12.5, 12.5, 14]
    assert plc.states[1].fault


def test_names_of_an_image_are_the_manual_s():
    words = image_of(FEED_FORWARD % (GAINS, WITH)).words
    assert words["TIC.Td_Kd"] == 0.525
    assert words["TIC.BIAS"].text == WITH
    assert "TIC.PV" not in words


@pytest.mark.parametrize("pv", ["FT", "F.OutVar"])
def test_a_wrong_direction_is_seen_through_a_signal_and_a_filter(pv):
    text = "signals: {FT: 0}\nblocks: [{name: F, type: ControlLowFilter, InVar: FT, Tc: 1}]\n"
    plant = "duration: 20\nplants: [{name: Tank, model: first_order, input: L.MV, gain: 1, time_constant: 5}]\n"
    for direct, kinds in (("true", ["wrong_action"]), ("false", [])):
        loop = LOOP % (GAINS, f", PV: {pv}, Direct: {direct}")
        report = run(text + loop, f"{plant}connect: {{FT: Tank}}\n")
        assert [problem.kind for problem in report.problems] == kinds


def test_the_pre_roll_waits_for_blocks_of_the_program():
    process = "{name: P, type: ControlDelayLag, InVar: L.MV, Gs: 1, Tc: 30, DelayTime: 2, Max_OutVar: 100}"
    report = run(f"blocks: [{process}]\n" + LOOP % (GAINS, ", PV: P.OutVar"), "duration: 10\ninitial: steady\n")
    assert not report.problems
    assert report.signals["L.PV"].low == pytest.approx(50, abs=0.01)


# --- the output that a loop starts with ------------------------------------------------------------------------------

WHOLE = (
    ("PIDA_REAL", "PIDA_INT"),
    ("60.0", "60"),
    ("100.0", "100"),
    ("MinMV: 0.0", "MinMV: 0"),
    ("MinPV: 0.0", "MinPV: 0"),
)
MANUAL = ("TRK_IN: Hold", "Manual: true")
NO_EVENT = ("events:\n  - {at: 80, loop: TANK, set: {setpoint: 65}}\n", "")


def started(value, *config):
    """A run of a tank whose loop starts with an output."""
    return outcome("nextopid", ("plants:", f"initial: {{TANK: {value}}}\nplants:"), NO_EVENT, config=config)


@pytest.mark.parametrize("config", [(MANUAL,), (*WHOLE, MANUAL)], ids=["REAL", "INT"])
def test_a_block_in_manual_starts_with_the_output_that_the_scenario_gives(config):
    report = started("40", *config).report
    assert report.signals["TANK.MV"] == Range(40, 40, 40)
    assert not [note for note in report.notes if "initial" in note.text]


@pytest.mark.parametrize("config", [(), WHOLE], ids=["REAL", "INT"])
def test_an_automatic_block_has_no_output_to_start_with_and_says_so(config):
    (note,) = started("40", *config).report.notes
    assert (note.loop, note.text) == ("TANK", "initial output 40: the loop is not in manual mode")


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ("40.5", "output: 40.5 is not a whole number"),
        ("400000", "output: 400000 does not fit a INT: it is outside the range of INT: -32768 to 32767"),
        ("40 counts", "output: 40 counts is in counts, but the parameter holds a number in its own unit"),
    ],
)
def test_an_output_that_is_no_int_is_refused(value, message):
    result = started(value, *WHOLE, MANUAL)
    assert [d.message for d in result.findings if d.severity.name == "ERROR"] == [message]


@pytest.mark.parametrize(("value", "seen"), [("1", 1), ("0", 0), ("2", None)])
def test_an_on_off_block_starts_on_or_off(value, seen):
    config = (
        "pidcfg: 1\nvendor: nextopid\nplc: {sample_time: 0.5}\nloops:\n"
        "  - {name: TANK, type: ControlON_OFF, SP: 60, DeadBand: 2, MinPV: 0, MaxPV: 100, Manual: true}\n"
    )
    text = SCENARIO.replace("plants:", f"initial: {{TANK: {value}}}\nplants:").replace(*NO_EVENT)
    result = simulate(text, name="tank.scenario.yaml", files={"tank.yaml": config})
    if seen is None:
        assert "output: 2 is neither on nor off" in [d.message for d in result.findings]
    else:
        assert result.report.signals["TANK.MV"] == Range(seen, seen, seen)


def test_a_lead_lag_is_called_in_its_program():
    text = f"""
signals: {{X: 20.0}}
blocks:
  - {{name: F, type: ControlLeadLag, InVar: X, G: 2, Tlead: 1, Tlag: 4, Max_OutVar: 100}}
loops:
  - {{name: A, type: PIDA_REAL, SP: 50, PV: F.OutVar, {GAINS}}}
"""
    report = run(text, "duration: 60\nexpect:\n  - {signal: F.OutVar, final: 40, tolerance: 0.1}\n")

    assert [(v.passed, v.text) for v in report.expectations] == [(True, "F.OutVar 40 ± 0.1 at the end")]


# --- The scan time estimate against the two examples of the manual ----------------------------------------------------


def test_one_slow_loop_adds_four_microseconds():
    assert scan_time(0.050, [3.0]).typical == pytest.approx(50.004e-3, abs=0.5e-6)


def test_the_four_loops_of_the_example_add_sixty_microseconds():
    assert scan_time(0.050, [0.25, 30.0, 10.0, 1.5]).typical == pytest.approx(50.06e-3, abs=5e-6)


def test_minimum_and_maximum_bracket_the_typical_time():
    estimate = scan_time(0.010, [0.1, 0.1])

    assert estimate == pytest.approx((10.03e-3, 10.05e-3, 10.07e-3))


def test_without_loops_the_scan_time_stays():
    assert scan_time(0.02, []) == (0.02, 0.02, 0.02)
