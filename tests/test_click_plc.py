"""The CLICK as made of registers: what a configuration encodes to is what runs, any memory can be run, pulses."""

from __future__ import annotations

import math
import random
from decimal import Decimal
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from click_rig import Rig, image_of, poked
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.click import ClickFile
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers import click as click_decisions
from pidcfg.sim.controllers.click import CONTROLLER_DECISIONS
from pidcfg.sim.controllers.click import scan as click
from pidcfg.sim.controllers.click.equation import bits_of, float_of
from pidcfg.sim.controllers.click.scan import load
from pidcfg.sim.controllers.plc import ScanOptions as Options
from pidcfg.sim.engine.run import Settings, prepare_network, simulate
from pidcfg.text.source import read_document
from rig_plants import FirstOrder, Fixed

CONTRACT = """
pidcfg: 1
vendor: click
loops:
  - name: TANK1
    bits: C101
    integers: DS101
    floats: DF101
    mode: auto
    action: direct
    sample_rate: 500 ms
    bumpless: 1
    freeze_bias: true
    tuning: {proportional_gain: 2.4, reset_time: 30.0, derivative_gain: 4.0}
    derivative_gain_limit: 10
    pv: {range: [40, 140], unit: degF, filter: 80}
    setpoint: {value: 105.0, lower_limit: 50.0, upper_limit: 130.0}
    output: {limits: [0, 100], pwm: {bit: Y001, period: 10}}
    error: {curve: linear, deadband: 0.5}
    alarms:
      pv: {low_low: 45, low: 50, high: 125, high_high: 135}
      deviation: {high: 5, high_high: 10}
      rate_of_change: 1.0
      hysteresis: 0.5
    autotune: {method: closed, type: PID, hysteresis: 1}
"""
PLANT = "{model: first_order, gain: 1, load: 40, time_constant: 60, dead_time: 2, initial: 40}"


def tank(**changes):
    """The image of a heated tank."""
    data = read_document(CONTRACT.encode(), "tank.yaml").data
    for key, value in changes.items():
        data["loops"][0][key] = value
    return encode(ClickFile.model_validate(data)).image


def scenario(text, **given):
    head = {"pidcfg": 1, "scenario": "test", "config": "none.yaml", "duration": 600, **given}
    lines = [f"{key}: {value}" for key, value in head.items()]
    document = read_document(("\n".join(lines) + "\n" + text).encode(), "test.yaml")
    assert not document.problems, document.problems
    return Scenario.model_validate(document.data)


def run(text="", image=None, plant=PLANT, engine="python", **given):
    """A scenario of the tank, to its report."""
    image = image or tank()
    plan = scenario(f"plants: {{TANK1: {plant}}}\n{text}", **given)
    return simulate(plan, lambda: load(image, Options()), click, Settings(engine))


# --- from registers --------------------------------------------------------------------------------------------------


def test_every_register_reaches_the_controller():
    rig = Rig(image=tank(action="reverse", error={"curve": "squared", "deadband": 0.5}), goals=True)
    c, s = rig.configs[0], rig.states[0]

    assert (c.period, s.period, s.sample_ms) == (500_000, 500_000, 500)
    assert (c.sp_low_on, c.sp_low, c.sp_high_on, c.sp_high) == (1, 50.0, 1, 130.0)
    assert (c.reverse, c.bumpless, c.freeze_bias, c.squared, c.deadband_on, c.deadband) == (1, 1, 1, 1, 1, 0.5)
    assert (c.gain_limit_on, c.gain_limit, c.filter_on, c.filter) == (1, 10.0, 1, float_of(bits_of(0.8)))
    assert (c.out_low, c.out_high, c.pwm, c.pwm_period) == (0.0, 100.0, 1, 10_000_000)
    assert (c.low_low, c.low, c.high, c.high_high) == (45.0, 50.0, 125.0, 135.0)
    assert (c.deviation_high, c.deviation_high_high) == (5.0, 10.0)
    assert (c.rate_of_change, c.hysteresis) == (1.0, 0.5)
    assert (c.tune_closed, c.tune_pi, c.tune_hysteresis, c.pv_low, c.pv_high) == (1, 0, 1.0, 40.0, 140.0)
    assert (s.sp, s.gain, s.reset, s.rate) == (105.0, float_of(bits_of(2.4)), 30.0, 4.0)
    assert s.gain != 2.4, "the number in the register, not its shortest decimal"


def test_names_signals_and_scales():
    plc = load(image_of({"mode": "auto"}, {"output": {"pwm": {"bit": "Y002"}}}))

    assert plc.loops == ["L1", "L2"]
    assert plc.signals == [
        "",
        "L1.PV",
        "L1.SP",
        "L1.CO",
        "L1.BIAS",
        "L1.ERROR",
        "",
        "",
        "L2.PV",
        "L2.SP",
        "L2.CO",
        "L2.BIAS",
        "L2.ERROR",
        "L2.PWM",
    ]
    assert plc.initial_modes == ["auto", "manual"]
    assert [scale[:2] for scale in plc.scales] == [(0.0, 100.0)] * 2
    assert plc.error_words == {"DS1": 0, "DS16": 0}
    assert tuple(plc.modes) == ("manual", "auto", "autotune")
    assert plc.scan_time(0.001) is None


@pytest.mark.parametrize(
    ("rate", "period", "base"),
    [
        ("500 ms", 10, 100_000),
        ("500 ms", 1, 10_000),
        ("333 ms", 7, 66_600),
        ("100 ms", 600, 100_000),
        ("100 ms", 10, 100_000),
        ("500 ms", 3, 25_000),
    ],
)
def test_the_base_step_divides_the_sample_rate_and_is_a_hundredth_of_the_pulses(rate, period, base):
    plc = load(image_of({"sample_rate": rate, "output": {"pwm": {"bit": "Y001", "period": period}}}))

    assert plc.base_ticks == base
    assert plc.configs[0].period % base == 0


def test_the_base_step_without_pulses_is_the_greatest_common_one():
    assert load(image_of({"sample_rate": "300 ms"}, {"sample_rate": "500 ms"})).base_ticks == 100_000
    assert load(Image("click", ())).base_ticks == 1_000_000


def test_any_memory_can_be_run():
    """Random registers, infinities and none-numbers among them: no exception, finite signals, errors as DSn+00."""
    rng = random.Random(12)
    settings = image_of({"output": {"pwm": {"bit": "Y001"}}}, {}).settings
    seen = set()
    odd = [0, 0x7FC00000, 0x7F800000, 0xFF800000, 0x7F7FFFFF, 1, 0x80000000, 0x42C80000, 0x7F800001]
    for n in range(300):
        cells = []
        for entry in settings:
            for key, (prefix, table) in BLOCKS.items():
                start = SPACE.parse(entry[key])
                for row in table.words:
                    wild = rng.choice(odd) if rng.random() < 0.3 else rng.getrandbits(32)
                    sane = {"C": rng.getrandbits(1), "DS": rng.choice([100, 10, 20]), "DF": bits_of(rng.uniform(1, 9))}
                    width = {"C": 1, "DS": 0xFFFF, "DF": 0xFFFFFFFF}[prefix]
                    raw = wild & width if rng.random() < (n % 10) / 20 else sane[prefix]
                    cells.append(Cell("", start + row.offset, raw, ""))
        rig = Rig(image=Image("click", tuple(cells), settings), plants=[Fixed(3.0), Fixed(1e15)])
        for command in ("start", "cancel", "start"):
            rig.auto(0).auto(1)
            rig.plc.autotune(0, command)
            rig.plc.autotune(1, command)
            rig.step(30)
            assert all(math.isfinite(x) for x in rig.signal_values)
        rig.plc.program(rig.signal_values)
        rig.step(3)
        rig.plc.run(rig.tick)
        rig.set("tuning.reset_time", 5)
        rig.step(20)
        assert all(math.isfinite(x) for x in rig.signal_values)
        assert rig.plc.scales[0][0] < rig.plc.scales[0][1]
        seen |= set(rig.plc.error_words.values())
    assert len(seen) > 8


# --- set -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "field", "becomes"),
    [
        ("tuning.proportional_gain", 2.5, "gain", 2.5),
        ("proportional_gain", 3, "gain", 3.0),
        ("tuning.reset_time", "2 min", "reset", 120.0),
        ("tuning.derivative_gain", 0.5, "rate", 0.5),
        ("sample_rate", "250 ms", "sample_ms", 250),
        ("setpoint", 55.5, "sp", 55.5),
        ("setpoint.value", 12, "sp", 12.0),
        ("output", 17, "out", 17.0),
        ("bias", -3, "bias", -3.0),
    ],
)
def test_a_key_is_written_to_its_register(key, value, field, becomes):
    rig = Rig({})
    assert rig.set(key, value) is None

    assert getattr(rig.states[0], field) == becomes


@pytest.mark.parametrize(
    ("key", "value", "field", "becomes"),
    [
        ("alarms.pv.high", 80, "high", 80.0),
        ("alarms.deviation.high_high", 8, "deviation_high_high", 8.0),
        ("alarms.rate_of_change", "60 /min", "rate_of_change", float_of(bits_of(0.1))),
        ("pv.filter", 25, "filter", 0.25),
        ("pv.filter_enabled", True, "filter_on", 1),
        ("action", "reverse", "reverse", 1),
        ("error.curve", "squared", "squared", 1),
        ("bumpless", 1, "bumpless", 1),
        ("freeze_bias", True, "freeze_bias", 1),
        ("derivative_gain_limit", 12, "gain_limit", 12.0),
        ("output.limits.0", 5, "out_low", 5.0),
        ("output.pwm.period", "1 min", "pwm_period", 60_000_000),
        ("autotune.method", "closed", "tune_closed", 1),
        ("autotune.hysteresis", 2, "tune_hysteresis", 2.0),
    ],
)
def test_a_key_reaches_the_configuration(key, value, field, becomes):
    on = {"enabled": True}
    rig = Rig({"alarms": {"pv": on, "deviation": on, "rate_of_change_enabled": True}})
    rig.set(key, value)

    assert getattr(rig.configs[0], field) == becomes


def test_both_ends_of_a_pair_are_written_at_once():
    rig = Rig({})
    rig.set("output.limits", [5, 95])
    rig.set("pv.range", [-10, 40])

    assert (rig.configs[0].out_low, rig.configs[0].out_high, rig.configs[0].pv_low, rig.configs[0].pv_high) == (
        5.0,
        95.0,
        -10.0,
        40.0,
    )


def test_new_gains_act_with_the_next_sample():
    rig = Rig({"setpoint": {"value": 60}}, plants=[Fixed(50.0)])
    rig.auto().step(2)
    rig.set("tuning.proportional_gain", 3)

    assert rig.step().out() == pytest.approx(30.0, abs=0.01)
    rig.set("action", "reverse")
    assert rig.step().out() == 0.0


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("setpoint", "2048 counts", "not a number"),
        ("setpoint", Quantity(Decimal(5), counts=True), "in counts"),
        ("setpoint", 1e39, "does not fit"),
        ("sample_rate", 250, "250 can be ms"),
        ("sample_rate", "40 s", "does not fit"),
        ("state.pv", 5, "nothing that can be set"),
        ("raw_pv", 5, "nothing that can be set"),
        ("autotune", "start", "an event of its own"),
        ("mode", "auto", "an event of its own"),
        ("action", "forward", "none of direct, reverse"),
        ("bumpless", 3, "none of 1, 2"),
        ("freeze_bias", "yes", "true"),
        ("pv.filter", 2.5, "whole number"),
        ("hysteresis", 1, "nothing that can be set"),
        ("output.limits", 5, "both limits"),
        ("alarms.rate_of_change", "5 counts", "in counts"),
        ("proportional_gian", 5, "nothing that can be set"),
    ],
)
def test_what_no_register_takes_is_refused(key, value, message):
    plc = load(image_of({}))
    with pytest.raises(PydanticCustomError) as refused:
        plc.check_set(0, tuple(key.split(".")), value)

    assert message in refused.value.message()


def test_a_typing_mistake_is_recognised():
    with pytest.raises(PydanticCustomError) as refused:
        load(image_of({})).check_set(0, ("tuning", "proportional_gian"), 5)

    assert refused.value.context["help"] == "did you mean tuning.proportional_gain?"


@pytest.mark.parametrize(
    ("rate", "ticks"), [("250 ms", 250_000), ("-1 ms", 100_000), ("50 ms", 100_000), ("31 s", 30_000_000)]
)
def test_a_new_sample_rate_is_known_beforehand(rate, ticks):
    plc = load(image_of({}))
    key = ("sample_rate",)
    value = plc.check_set(0, key, rate)

    assert plc.new_period(0, key, value) == ticks
    assert plc.new_period(0, ("setpoint",), Decimal(5)) == 0
    plc.set(0, key, value, plc.signal_values)
    assert plc.periods == [ticks]


def test_writing_one_register_leaves_what_the_controller_has_written():
    rig = Rig({"bumpless": 1, "setpoint": {"value": 60}}, plants=[Fixed(43.25)])
    rig.set("output", 31.5)
    rig.auto().step(3)
    rig.set("alarms.pv.high", 90)

    assert (rig.states[0].sp, rig.states[0].bias, rig.out()) == (43.25, 31.5, 31.5)


# --- pulses ----------------------------------------------------------------------------------------------------------


def pulses(rig, count):
    seen = []
    for _ in range(count):
        rig.step()
        seen.append(int(rig.signal_values[rig.configs[0].pwm_slot]))
    return seen


@pytest.mark.parametrize(
    ("out", "on"),
    [
        (0, 0),
        (-5, 0),
        (4, 0),
        (6, 1),
        (14, 1),
        (16, 2),
        (24, 2),
        (30, 3),
        (50, 5),
        (96, 10),
        (100, 10),
        (130, 10),
    ],
)
def test_the_on_time_is_the_output_in_percent_of_the_period(out, on):
    """A period of 1 s in steps of 100 ms: the nearest whole number of steps."""
    rig = Rig({"output": {"pwm": {"bit": "Y001", "period": 1}}})
    rig.set("output", out)
    first = pulses(rig, 10)

    assert first[1:] == ([1] * on + [0] * (10 - on))[1:]
    assert pulses(rig, 20) == ([1] * on + [0] * (10 - on)) * 2


def test_a_new_output_counts_from_the_next_period_on():
    rig = Rig({"output": {"pwm": {"bit": "Y001", "period": 1}}})
    rig.set("output", 30)
    first = pulses(rig, 5)
    rig.set("output", 80)

    assert first + pulses(rig, 15) == [1] * 3 + [0] * 7 + [1] * 8 + [0] * 2


def test_periods_keep_their_grid_when_steps_do_not_fit():
    """Periods of 1 s in steps of 0.3 s: every second one pulse of the nearest step."""
    rig = Rig({"output": {"pwm": {"bit": "Y001", "period": 1}}, "sample_rate": "300 ms"}, base=0.3)
    rig.set("output", 30)
    seen = pulses(rig, 100)

    assert sum(seen) == 30
    assert seen[:11] == [1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1]


def test_full_power_has_no_gaps_where_steps_do_not_fit():
    rig = Rig({"output": {"pwm": {"bit": "Y001", "period": 1}}, "sample_rate": "300 ms"}, base=0.3)
    rig.set("output", 100)

    assert pulses(rig, 50) == [1] * 50


def test_an_output_that_is_no_number_gives_no_pulses_and_one_beyond_its_range_no_more_than_all():
    rig = Rig(image=poked(image_of({"output": {"pwm": {"bit": "Y001", "period": 1}}}), output=math.nan))
    assert pulses(rig, 20) == [0] * 20
    rig.set("output", 1000)
    rig.step(10)
    assert rig.states[0].on_time == 1e6


def test_in_stop_there_are_no_pulses_and_run_begins_a_period():
    rig = Rig({"output": {"pwm": {"bit": "Y001", "period": 1}}})
    rig.set("output", 50)
    rig.step(14)
    rig.plc.program(rig.signal_values)
    stopped = pulses(rig, 9)
    rig.plc.run(rig.tick)

    assert stopped == [0] * 9
    assert pulses(rig, 20) == ([1] * 5 + [0] * 5) * 2


def test_steps_longer_than_periods_show_no_pulse_twice():
    """A period of 1 s in steps of 2.5 s: each step tells whether the output is on in its middle."""
    rig = Rig({"sample_rate": "2500 ms", "output": {"pwm": {"bit": "Y001", "period": 1}}}, base=2.5)
    rig.set("output", 40)
    rig.step(20)

    assert abs(rig.states[0].pulse_start - rig.tick) <= 2 * 2_500_000


def test_pulses_run_between_samples():
    rig = Rig({"sample_rate": "2 s", "output": {"pwm": {"bit": "Y001", "period": 1}}})
    rig.set("output", 30)

    assert pulses(rig, 20) == ([1] * 3 + [0] * 7) * 2


def test_pulses_heat_as_the_output_would():
    plant = FirstOrder(gain=100.0, time_constant=200.0, initial=20.0, offset=20.0)
    rig = Rig(
        {
            "setpoint": {"value": 60},
            "tuning": {"proportional_gain": 4, "reset_time": 100},
            "freeze_bias": True,
            "output": {"pwm": {"bit": "Y001", "period": 5}},
        },
        plants=[plant],
    )
    rig.auto().run(3000, drive="pwm_slot")
    on = []
    for _ in range(5000):
        rig.step(drive="pwm_slot")
        on.append(rig.signal_values[rig.configs[0].pwm_slot])

    assert plant.value == pytest.approx(60.0, abs=1.0)
    assert sum(on) / len(on) == pytest.approx(0.40, abs=0.01)


# --- scenarios -------------------------------------------------------------------------------------------------------


def test_the_tank_heats_up_and_settles():
    report = run(
        "events: [{at: 300, loop: TANK1, set: {setpoint: 110}}]\nexpect:\n"
        "  - {signal: TANK1.PV, final: 110, tolerance: 0.6}\n"
        "  - {loop: TANK1, mode: auto}\n  - {flag: DS101, is: 0}"
    )
    tank1 = report.loops["TANK1"]

    assert report.passed, report.expectations
    assert [(m.at, m.mode, m.reason) for m in tank1.modes] == [(0.0, "auto", None)]
    assert {alarm.alarm for alarm in tank1.alarms} >= {"pv_low", "deviation_high"}
    assert tank1.flags == {"pid_error": False, "autotune_error": False}
    assert report.signals["TANK1.CO"].high <= 100.0
    assert report.plc_flags == {"DS101": "0"}


@pytest.mark.parametrize("initial", ["steady", "{TANK1: 65}"])
def test_a_scenario_starts_where_it_says(initial):
    report = run(initial=initial, plant=PLANT.replace(", initial: 40", ""))

    assert report.passed, report.problems
    if initial == "steady":
        assert report.signals["TANK1.PV"].low == pytest.approx(105.0, abs=0.6)


def test_the_wrong_action_heats_to_the_end():
    """At 67 % the tank is 2 degrees too warm: reverse action heats all the more."""
    report = run(
        image=tank(action="reverse", bumpless=2), plant=PLANT.replace(", initial: 40", ""), initial="{TANK1: 67}"
    )

    assert report.signals["TANK1.CO"].final == 100.0
    assert report.signals["TANK1.PV"].final > 135.0


def test_an_error_shows_in_the_report_while_the_loop_waits_in_manual():
    image = poked(tank(), reset_time=float_of(bits_of(0.005)))
    report = run(image=image, duration=60)
    tank1 = report.loops["TANK1"]

    assert report.plc_flags == {"DS101": "27"}
    assert report.running
    assert tank1.flags["pid_error"]
    assert [(m.at, m.requested, m.mode) for m in tank1.modes] == [(0.0, "auto", "manual")]
    assert tank1.modes[0].reason.startswith("refused: PID error 27: reset time (DFn+06)")
    assert [note.text for note in tank1.notes] == [
        "PID error 27: reset time (DFn+06) is not within 0.01 to 6000 s",
    ]
    assert report.signals["TANK1.ERROR"].final == 27.0


@pytest.mark.parametrize("register", ["setpoint", "bias", "output", "output_upper", "pv_upper", "deadband"])
def test_a_register_that_is_no_number_is_survived(register):
    report = run(
        "events: [{at: 20, loop: TANK1, pv: 32, for: 5}]", image=poked(tank(), **{register: math.nan}), duration=60
    )

    assert all(math.isfinite(x) for seen in report.signals.values() for x in (seen.low, seen.high, seen.final))
    assert report.plc_flags["DS101"] in {"0", "20", "24", "25"}


def test_events_of_a_scenario():
    text = """events:
  - {at: 100, loop: TANK1, mode: manual}
  - {at: 110, loop: TANK1, set: {output: 20}}
  - {at: 150, loop: TANK1, mode: auto}
  - {at: 200, loop: TANK1, autotune: start}
  - {at: 230, loop: TANK1, autotune: cancel}
  - {at: 240, loop: TANK1, set: {output: 30}}
  - {at: 250, plc: stop}
  - {at: 260, plc: run}
"""
    report = run(text, duration=300)
    tank1 = report.loops["TANK1"]

    assert [(m.at, m.mode) for m in tank1.modes] == [
        (0.0, "auto"),
        (100.0, "manual"),
        (150.0, "auto"),
        (200.0, "autotune"),
        (230.0, "auto"),
        (250.0, "manual"),
    ]
    assert any("read-only" in note.text and note.at == 240.0 for note in report.notes)
    assert tank1.autotune["status"] == "cancelled"


def test_an_autotune_in_a_scenario_finds_parameters():
    text = """events: [{at: 300, loop: TANK1, autotune: start}]
expect:
  - {loop: TANK1, autotune: done}
  - {loop: TANK1, autotune: proportional_gain, min: 1, max: 40}
  - {loop: TANK1, mode: auto}
"""
    report = run(text, duration=900)

    assert report.passed, report.expectations
    assert set(report.loops["TANK1"].autotune["results"]) == set(load(tank()).tuned_names)


def test_compiled_runs_give_the_same_report():
    text = "events: [{at: 30, loop: TANK1, autotune: start}, {at: 200, loop: TANK1, set: {sample_rate: 50 ms}}]"
    reports = [
        run(text, duration=300, engine=engine, plant=PLANT.replace("}", ", noise: 0.05}"))
        for engine in ("python", "numba")
    ]
    for report in reports:
        report.engine = ""

    assert reports[0] == reports[1]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{at: 5, loop: TANK1, ramp_soak: start}", "this PLC has no ramp/soak"),
        ("{at: 5, plc: program}", "'program' is no command of plc"),
        ("{at: 5, loop: TANK1, mode: cascade}", "'cascade' is no mode"),
    ],
)
def test_what_this_plc_does_not_have_is_said(text, message):
    plan = scenario(f"plants: {{TANK1: {PLANT}}}\nevents: [{text}]")

    assert any(message in problem.message for problem in prepare_network(plan, load(tank())).problems)


# --- decisions -------------------------------------------------------------------------------------------------------


def test_numbers_go_on_without_a_gap():
    assert [decision.number for decision in CONTROLLER_DECISIONS] == [*range(110, 129), 673, 674]
    assert CONTROLLER_DECISIONS[18].number < 130


@pytest.mark.parametrize("decision", CONTROLLER_DECISIONS, ids=lambda decision: f"D{decision.number}")
def test_a_decision_is_named_where_it_is_carried_out(decision):
    modules = sorted(Path(click_decisions.__file__).parent.glob("*.py"))

    assert f"D{decision.number}" in "".join(m.read_text("utf-8") for m in modules if m.name != "decisions.py")
