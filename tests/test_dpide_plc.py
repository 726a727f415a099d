"""The Delta AS as made of operands: what a configuration encodes to is what runs, any listing can be run, scenarios."""

from __future__ import annotations

import math
import random
from decimal import Decimal
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from dpide_rig import PLAIN, Rig, program_of
from pidcfg.encoders.dpide.image import encode
from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.parameters import Entry, Program
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dpide import DpideFile
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers import dpide as dpide_decisions
from pidcfg.sim.controllers.dpide import ENGINE_DECISIONS
from pidcfg.sim.controllers.dpide import scan as dpide
from pidcfg.sim.controllers.dpide.scan import load
from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.engine.run import Settings, UnusableError, prepare_network, simulate
from pidcfg.text.source import read_document

CONTRACT = """
pidcfg: 1
vendor: dpide
loops:
  - name: OVEN
    device: D500
    PID_RUN: true
    SV: 80.0
    PID_MODE: 0
    PID_MAN: false
    MOUT_AUTO: true
    CYCLE: 1000
    Kc_Kp: 12.1
    Ti_Ki: 180.0
    Td_Kd: 20.0
    Tf: 2.0
    PID_EQ: true
    PID_DE: true
    PID_DIR: true
    ERR_DBW: -0.5
    MV_MAX: 4000.0
    MV_MIN: 10.0
    MOUT: 15.0
    BIAS: 3.0
    pv: {range: [0, 400], unit: degC}
"""
TOO_LARGE = (
    "1e+39 does not fit a REAL: it is outside the range of single precision: "
    "-3.4028234663852886E+38 to 3.4028234663852886E+38"
)
COUNTED = "3 counts is in counts, but the parameter holds a number in its own unit"
PLANT = "{model: first_order, gain: 0.1, load: 20, time_constant: 120, dead_time: 12, initial: 20}"


def oven(**changes):
    """The operands of a heated oven."""
    data = read_document(CONTRACT.encode(), "oven.yaml").data
    plc = changes.pop("plc", None)
    data |= {"plc": plc} if plc else {}
    data["loops"][0] |= changes
    return encode(DpideFile.model_validate(data)).image


def scenario(text, **given):
    head = {"pidcfg": 1, "scenario": "test", "config": "none.yaml", "duration": 600, **given}
    lines = [f"{key}: {value}" for key, value in head.items()]
    document = read_document(("\n".join(lines) + "\n" + text).encode(), "test.yaml")
    assert not document.problems, document.problems
    return Scenario.model_validate(document.data)


def run(text="", image=None, plant=PLANT, engine="python", **given):
    """A scenario of the oven, to its report."""
    image = image or oven()
    plan = scenario(f"plants: {{OVEN: {plant}}}\n{text}", **given)
    return simulate(plan, lambda: load(image, Options()), dpide, Settings(engine))


# --- from operands ---------------------------------------------------------------------------------------------------


def test_every_operand_reaches_the_controller():
    plc = load(oven())
    c, s = plc.configs[0], plc.states[0]

    assert (c.period, s.period, s.sampling_time) == (1_000_000, 1_000_000, 1.0)
    assert (c.manual, c.mout_follows, c.dependent, c.derivative_on_pv, c.forward_action) == (0, 1, 1, 1, 1)
    assert (c.dead_band, s.bias, c.lowest_mv, c.highest_mv) == (0.5, 3.0, 10.0, 4000.0)
    assert (s.sp, s.reset, s.rate, s.filter_time, s.mout, s.mode) == (80.0, 180.0, 20.0, 2.0, 15.0, 0)
    assert s.gain == single(12.1) != 12.1, "the number in the PLC, not its shortest decimal"
    assert s.kp == s.gain
    assert s.ki == single(single(s.gain * 1.0) / 180.0)
    assert s.kd == single(s.gain * 20.0)
    assert s.filter_share == single(1.0 / 3.0)
    odd = load(oven(ERR_DBW=-0.1, MV_MIN=0.3, MV_MAX=80.1)).configs[0]
    assert (odd.dead_band, odd.lowest_mv, odd.highest_mv) == tuple(map(single, (0.1, 0.3, 80.1)))


@pytest.mark.parametrize("name", ["PID_MAN", "MOUT_AUTO", "PID_EQ", "PID_DE", "PID_DIR"])
def test_each_choice_is_its_own(name):
    fields = ("manual", "mout_follows", "dependent", "derivative_on_pv", "forward_action")
    found = {
        field: [getattr(load(program_of({name: on})).configs[0], field) for on in (False, True)] for field in fields
    }
    own = dict(zip(("PID_MAN", "MOUT_AUTO", "PID_EQ", "PID_DE", "PID_DIR"), fields, strict=True))[name]

    assert found.pop(own) == [0, 1]
    assert all(a == b for a, b in found.values())


def test_names_signals_and_scales():
    plc = load(program_of({"PID_MAN": True}, {"PID_DIR": False}, settings={"pv": {"range": [20, 400], "unit": "degC"}}))

    assert plc.loops == ["L1", "L2"]
    assert plc.signals == [
        "",
        "L1.PV",
        "L1.SV",
        "L1.MV",
        "L1.MOUT",
        "L1.I_MV",
        "L1.E",
        "",
        "L2.PV",
        "L2.SV",
        "L2.MV",
        "L2.MOUT",
        "L2.I_MV",
        "L2.E",
    ]
    assert plc.initial_modes == ["manual", "auto"]
    assert plc.scales == [(20.0, 400.0, 1 << 20)] * 2
    assert plc.output_raises_pv == [True, False]
    assert tuple(plc.modes) == ("manual", "auto", "autotune", "off")
    assert (plc.error_words, plc.problems, plc.scan_time(0.001)) == ({}, [], None)


@pytest.mark.parametrize(("sv", "scale"), [(0.5, (0.0, 1.0)), (80, (0.0, 80.0)), (-40, (-40.0, 1.0))])
def test_without_a_range_the_scale_holds_sv(sv, scale):
    assert load(program_of({"SV": sv})).scales[0][:2] == scale


def test_the_base_step_is_the_greatest_common_one():
    assert load(program_of({"CYCLE": 300}, {"CYCLE": 500})).base_ticks == 100_000
    assert load(Program("dpide", ())).base_ticks == 1_000_000


def test_an_operand_that_a_listing_lacks_is_false_or_0_but_for_pid_run():
    program = Program("dpide", tuple(cell for cell in program_of({}).cells if cell.field == "SV"))
    plc = load(program)
    c, s = plc.configs[0], plc.states[0]

    assert (plc.loops, plc.initial_modes, plc.problems) == (["L1"], ["auto"], [])
    assert (c.forward_action, c.lowest_mv, c.highest_mv, s.gain, s.period) == (0, 0.0, 0.0, 0.0, 1000)


def test_a_loop_name_may_have_dots():
    cells = tuple(Entry(f"A.B.{name}", ROWS[name].type, value, name) for name, value in PLAIN.items())

    assert load(Program("dpide", cells)).signals[1] == "A.B.PV"


@pytest.mark.parametrize(
    ("name", "content", "taken"),
    [
        ("PID_MODE", 7, "PID_MODE: 7 means nothing there, 0 is taken"),
        ("SV", Wire("a + b"), "SV: Wire(text='a + b') means nothing there, 0.0 is taken"),
        ("PID_RUN", Wire("x"), "PID_RUN: Wire(text='x') means nothing there, TRUE is taken"),
    ],
)
def test_what_is_no_value_of_an_operand_is_told(name, content, taken):
    cells = [Entry(f"L1.{n}", ROWS[n].type, content if n == name else v, n, "L1") for n, v in PLAIN.items()]
    plc = load(Program("dpide", tuple(cells), ({"loop": "L1"},)))

    assert (plc.problems, plc.initial_modes) == ([(0, taken, True)], ["auto"])


def test_any_listing_can_be_run():
    """Odd numbers in every operand: no exception, finite signals, MV within the limits or 0."""
    rng = random.Random(12)
    odd = [0, -1, 1e30, -1e30, 3.4e38, 1e-45, 5, 0.1, -3.4e38]
    for _ in range(300):
        cells = []
        for name, row in ROWS.items():
            content = {
                "bool": rng.random() < 0.5,
                "whole": rng.choice([0, 1, 2, 3, 100, -9]),
                "real": float(rng.choice(odd)),
            }[row.type.kind]
            cells.append(Entry(f"L1.{name}", row.type, content, name, "L1"))
        rig = Rig(program=Program("dpide", tuple(cells), ({"loop": "L1"},)))
        for command in ("start", "cancel", "start"):
            rig.play([rng.choice([0.0, 3.0, 1e15, -1e20])] * 5, "MV")
            rig.plc.autotune(0, command)
            mv, c = rig.signal("MV"), rig.configs[0]
            assert all(map(math.isfinite, rig.signal_values))
            assert mv == 0.0 if rig.mode() == "off" else c.lowest_mv <= mv <= c.highest_mv


# --- set events ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "signal"),
    [
        ("SV", 85.5, "SV"),
        ("setpoint", 85.5, "SV"),
        ("setpoint.value", 85.5, "SV"),
        ("output", 85.5, "MOUT"),
        ("MOUT", 85.5, "MOUT"),
        ("I_MV", 85.5, "I_MV"),
    ],
)
def test_a_value_shows_at_once(key, value, signal):
    rig = Rig(program=oven())
    rig.set(key, value)

    assert rig.signal(signal) == value


def test_every_operand_can_be_set():
    values = {"bool": True, "whole": 2, "real": 1.5}
    plc = load(oven(PID_RUN=False))
    for name, row in ROWS.items():
        if name not in {"PV", "MV"}:
            plc.set(0, (name,), plc.check_set(0, (name,), values[row.type.kind]), plc.signal_values)
    c, s = plc.configs[0], plc.states[0]

    assert (c.manual, c.mout_follows, c.dependent, c.derivative_on_pv, c.forward_action, s.wanted_mode) == (
        1,
        1,
        1,
        1,
        1,
        1,
    )
    assert (c.dead_band, s.bias, c.lowest_mv, c.highest_mv, s.mode, s.period) == (1.5, 1.5, 1.5, 1.5, 2, 2000)
    assert (s.sp, s.gain, s.reset, s.rate, s.filter_time, s.mout, s.integral) == (1.5,) * 7


@pytest.mark.parametrize(
    ("key", "value", "message", "cure"),
    [
        ("sv", 3, "'sv' is nothing that can be set in a running loop", "write SV: upper and lower case count"),
        ("KcKp", 3, "'KcKp' is nothing that can be set in a running loop", "did you mean Kc_Kp?"),
        ("device", 3, "'device' is nothing that can be set in a running loop", "write the name of a parameter"),
        ("mode", "auto", "mode is an event of its own", "write mode: in place of set:"),
        ("PV", 3, "PV cannot be set: it comes from the plant", None),
        ("MV", 3, "MV cannot be set: the PLC writes it; MOUT does so in manual", None),
        ("PID_MODE", 3, "3 is none of 0, 1, 2", None),
        ("PID_MAN", 1, "a int stands where true or false is wanted", None),
        ("CYCLE", 1.5, "1.5 is not a whole number of ms", "write 1.5 s if seconds are meant, else whole ms"),
        ("SV", 1e39, TOO_LARGE, "write a value inside the limits"),
        ("output", Quantity(Decimal(3), counts=True), COUNTED, None),
    ],
)
def test_what_cannot_be_set_is_refused(key, value, message, cure):
    plc = load(oven())
    with pytest.raises(PydanticCustomError) as caught:
        plc.check_set(0, tuple(key.split(".")), value)

    assert (caught.value.message(), (caught.value.context or {}).get("help")) == (message, cure)


@pytest.mark.parametrize(
    ("key", "value", "effect"),
    [
        ("SV", 3, None),
        ("Kc_Kp", -1, "what is below 0 counts as 0"),
        ("Kc_Kp", 1, None),
        ("Kc_Kp", 0, None),
        ("CYCLE", 0, "counts as 1 ms"),
        ("CYCLE", 50000, "counts as 40000 ms"),
        ("CYCLE", 250, None),
        ("MV_MAX", 5, "MV_MAX is below MV_MIN: each is taken for the other"),
        ("MV_MAX", 50, None),
        ("I_MV", 5, None),
    ],
)
def test_what_does_not_act_as_it_stands_is_told(key, value, effect):
    assert Rig(program=oven()).set(key, value) == effect


def test_i_mv_without_an_integral_and_pid_man_in_an_autotune():
    rig = Rig(program=oven(Ti_Ki=0))
    assert rig.set("I_MV", 5) == "the next calculation makes it 0: there is no integral"
    rig.set("PID_MODE", 1)
    assert rig.set("PID_MAN", value=True) == "has no effect while PID_MODE is 1"
    assert rig.set("SV", 70) is None


def test_times_may_carry_a_unit():
    rig = Rig(program=oven())
    text = read_document(b"a: 2 min\nb: 500 ms\nc: 2 s\n", "t.yaml").data
    for key, value in zip(("Ti_Ki", "Tf", "CYCLE"), text.values(), strict=True):
        rig.set(key, value)

    assert (rig.states[0].reset, rig.states[0].filter_time, rig.plc.periods) == (120.0, 0.5, [2_000_000])


@pytest.mark.parametrize("text", ["180 s", "3 min", "100 ms"])
def test_an_integral_time_is_refused_where_ti_ki_is_a_gain(text):
    plc = load(oven(PID_EQ=False))
    with pytest.raises(PydanticCustomError) as caught:
        plc.check_set(0, ("Ti_Ki",), text)

    assert caught.value.message() == (
        f"{text} is a time, but the loop begins with PID_EQ FALSE, where Ti_Ki is the gain Ki in 1/s"
    )
    assert plc.check_set(0, ("Ti_Ki",), 0.05) == 0.05
    assert plc.check_set(0, ("Tf",), text) > 0


def test_a_scenario_that_sets_an_integral_time_where_ti_ki_is_a_gain_does_not_run():
    text = "events:\n  - {at: 5, loop: OVEN, set: {Ti_Ki: 180 s}}\n"
    message = "Ti_Ki: 180 s is a time, but the loop begins with PID_EQ FALSE, where Ti_Ki is the gain Ki in 1/s"
    with pytest.raises(UnusableError, match=message):
        run(text, image=oven(PID_EQ=False, Ti_Ki=0.05), duration=10)

    assert run(text, duration=10).notes == []


def test_an_integral_time_is_not_written_once_an_event_has_made_it_a_gain():
    text = """
events:
  - {at: 5, loop: OVEN, set: {PID_EQ: false, Ti_Ki: 0.05}}
  - {at: 6, loop: OVEN, set: {Ti_Ki: 180 s}}
  - {at: 7, loop: OVEN, set: {Td_Kd: 20 s}}
  - {at: 8, loop: OVEN, set: {Ti_Ki: 180 s, PID_EQ: true}}
  - {at: 9, loop: OVEN, set: {Ti_Ki: 180 s, PID_EQ: false}}
"""
    not_written = "Ti_Ki: is not written: a time, but PID_EQ is FALSE now, and Ti_Ki the gain Ki in 1/s"
    assert [(note.at, note.text) for note in run(text, duration=10).notes] == [
        (6, not_written),
        (7, "Td_Kd: PID_EQ is FALSE: the time counts as a gain Kd of 20"),
        (9, not_written),
    ]
    rig = Rig(program=oven())
    rig.set("PID_EQ", value=False)
    rig.set("Ti_Ki", "90 s")
    assert rig.states[0].reset == 180.0
    rig.set("PID_EQ", value=True)
    assert rig.set("Ti_Ki", "90 s") is None
    assert rig.set("Td_Kd", "2 min") is None
    assert (rig.states[0].reset, rig.states[0].rate) == (90.0, 120.0)


def test_a_new_cycle_is_known_beforehand():
    plc = load(oven())

    assert plc.new_period(0, ("CYCLE",), plc.check_set(0, ("CYCLE",), 250)) == 250_000
    assert plc.new_period(0, ("SV",), 250.0) == 0


def test_what_the_controller_has_written_outlives_a_setting():
    rig = Rig({"Ti_Ki": 1, "SV": 10, "MOUT_AUTO": True})
    rig.play([0.0] * 3, "MV")
    before = rig.signal("I_MV"), rig.signal("MV"), rig.signal("MOUT")
    rig.set("Td_Kd", 2)

    assert (rig.signal("I_MV"), rig.signal("MV"), rig.signal("MOUT")) == before


# --- scenarios -------------------------------------------------------------------------------------------------------


def test_an_oven_comes_to_its_set_point():
    report = run(image=oven(Kc_Kp=40, PID_MODE=2), duration=1800)

    assert (report.passed, report.running) == (True, True)
    assert report.signals["OVEN.PV"].final == pytest.approx(80.0, abs=0.6)
    assert [(m.mode, m.at) for m in report.loops["OVEN"].modes] == [("auto", 0.0)]


@pytest.mark.parametrize("key", ["SV", "setpoint"])
def test_a_set_point_event_starts_what_is_measured(key):
    report = run(f"events:\n  - {{at: 100, loop: OVEN, set: {{{key}: 90}}}}\n", image=oven(Kc_Kp=40), initial="steady")

    assert report.loops["OVEN"].metrics["overshoot"] is not None
    assert report.loops["OVEN"].metrics["rise_time"] > 0.0
    assert report.settled > 0.0


def test_a_wrong_direction_is_told_before_anything_runs():
    (problem,) = run(image=oven(PID_DIR=False), duration=10).problems

    assert problem.kind == "wrong_action"
    assert "falls" not in problem.message


def test_output_outside_manual_is_noted():
    report = run("events:\n  - {at: 5, loop: OVEN, set: {output: 40}}\n", duration=10)

    assert [note.text for note in report.notes] == [
        "output: MOUT acts in manual only; MOUT_AUTO is TRUE, so MOUT follows MV again"
    ]


def test_initial_is_the_mv_that_a_loop_starts_with():
    plant = "{model: first_order, gain: 0.1, load: 20, time_constant: 120}"
    report = run("initial: {OVEN: 900}\n", image=oven(PID_MAN=True), plant=plant, duration=20)

    for name in ("OVEN.MV", "OVEN.MOUT"):
        assert (report.signals[name].low, report.signals[name].high) == (900.0, 900.0)
    assert report.signals["OVEN.PV"].final == pytest.approx(110.0)


def test_initial_in_automatic_is_where_the_plant_rests():
    plant = "{model: first_order, gain: 0.1, load: 20, time_constant: 120}"
    report = run("initial: {OVEN: 600}\n", plant=plant, duration=20)

    assert report.signals["OVEN.PV"].high == pytest.approx(80.0, abs=0.01)


def test_modes_stop_and_run_in_a_scenario():
    text = """
events:
  - {at: 10, loop: OVEN, mode: manual}
  - {at: 20, loop: OVEN, mode: off}
  - {at: 30, loop: OVEN, mode: auto}
  - {at: 40, plc: stop}
  - {at: 50, plc: run}
expect:
  - {loop: OVEN, mode: manual, at: 15}
  - {loop: OVEN, mode: off, at: 25}
  - {signal: OVEN.MV, from: 20, until: 29, max: 0}
  - {loop: OVEN, mode: auto}
"""
    report = run(text, duration=60)

    assert [v.passed for v in report.expectations] == [True] * 4
    assert [(m.at, m.mode) for m in report.loops["OVEN"].modes] == [
        (0.0, "auto"),
        (10.0, "manual"),
        (20.0, "off"),
        (30.0, "auto"),
    ]


def test_an_autotune_in_a_scenario():
    text = """
events:
  - {at: 10, loop: OVEN, autotune: start}
expect:
  - {loop: OVEN, autotune: done}
  - {loop: OVEN, autotune: Kc_Kp, min: 30, max: 100}
  - {loop: OVEN, flag: autotune_running}
"""
    report = run(text, duration=2400)

    assert [v.passed for v in report.expectations] == [True] * 3
    assert report.loops["OVEN"].autotune["results"]["Tf"] > 0.0
    assert report.signals["OVEN.PV"].final == pytest.approx(80.0, abs=0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("events:\n  - {at: 1, loop: OVEN, ramp_soak: start}\n", "this PLC has no ramp/soak"),
        ("events:\n  - {at: 1, loop: OVEN, mode: automatic}\n", "'automatic' is no mode"),
        ("events:\n  - {at: 1, plc: program}\n", "'program' is no command of plc on this PLC"),
        ("plc: {step_bias: true}\n", "'step_bias' is no option of this PLC"),
    ],
)
def test_what_this_plc_does_not_have(text, message):
    plan = scenario(f"plants: {{OVEN: {PLANT}}}\n{text}")

    assert [p.message for p in prepare_network(plan, load(oven())).problems] == [message]


def test_a_scan_time_is_the_base_step():
    report = run("plc: {scan_time: 0.3}\n", duration=30)

    assert report.step == 0.3
    assert report.scan_time is None


def test_compiled_and_plain_make_the_same_report():
    text = "events:\n  - {at: 100, loop: OVEN, set: {SV: 90}}\n"
    plant = PLANT.replace("initial", "noise: 0.2, initial")
    plain, fast = (run(text, image=oven(Kc_Kp=40), plant=plant, engine=engine) for engine in ("python", "numba"))

    assert (plain.signals, plain.loops["OVEN"].metrics) == (fast.signals, fast.loops["OVEN"].metrics)


# --- decisions -------------------------------------------------------------------------------------------------------


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in ENGINE_DECISIONS] == [*range(265, 280), *range(685, 690), 1016]


@pytest.mark.parametrize("decision", ENGINE_DECISIONS, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    folder = Path(dpide_decisions.__file__).parent
    text = "".join(m.read_text("utf-8") for m in sorted(folder.glob("*.py")) if m.name != "decisions.py")

    assert f"D{decision.number}" in text
