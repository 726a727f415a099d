"""The DL06 as made of words: what a configuration encodes to is what runs, and any memory can be run."""

from __future__ import annotations

import random
from decimal import Decimal
from pathlib import Path

import pytest
from pydantic_core import PydanticCustomError

from pidcfg.encoders.dl06.image import encode
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.maps.dl06 import LOOP_TABLE, RAMP_SOAK_SIZE
from pidcfg.schemas.base import Quantity, v_name
from pidcfg.schemas.dl06 import Dl06File
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.autotune import POINTS
from pidcfg.sim.controllers.dl06.operate import ALARM_BITS, AUX_BITS, FLAG_BITS
from pidcfg.sim.controllers.dl06.operate import MODE_BITS as MODES
from pidcfg.sim.controllers.dl06.plc import Options, load
from pidcfg.sim.controllers.dl06.scan import Dl06Registers, scan
from pidcfg.sim.engine.run import prepare_network
from pidcfg.text.source import read_document

LOOP = {"name": "L", "sample_rate": 0.1, "action": "direct", "tuning": {"gain": 1}}
SCALED = {"pv": {"range": [0, 100], "unit": "degC"}, "output": {"range": [0, 50]}}
REACTOR = Path(__file__).parents[1] / "examples" / "dl06" / "reactor.yaml"


def plc(*loops, options=None, **given):
    """A PLC of loops that differ from a plain one by the keys given."""
    entries = [{**LOOP, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    data = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000", **given}, "loops": entries}
    return load(encode(Dl06File.model_validate(data)).image, options)


def listing(words, settings=()):
    """An image of bare words."""
    return Image("dl06", tuple(Cell(v_name(a), a, w, "") for a, w in sorted(words.items())), settings)


def play(machine, steps, pv=(), base=100_000, start=0):
    """Scans with fixed measurements; returns the signals and the notices."""
    signal_values, said = list(machine.signal_values), []
    for k in range(start, start + steps):
        for c, value in zip(machine.configs, pv, strict=False):
            signal_values[c.in_slot] = value
        scan(k * base, machine.configs, machine.states, machine.aux, signal_values)
        for i, s in enumerate(machine.states):
            text = "; ".join(filter(None, machine.describe(s.notice)))
            said += [(k, machine.loops[i], machine.requested_mode(s.notice), text)] if s.notice else []
            s.notice = 0
    return signal_values, said


def mode(machine, i=0):
    return machine.mode(machine.states[i].status)


# --- from words ------------------------------------------------------------------------------------------------------


def test_every_setting_reaches_the_controller_through_its_word():
    machine = plc(
        {
            "name": "A",
            "action": "reverse",
            "bumpless": "II",
            "bias_freeze": True,
            "sample_rate": 0.5,
            "tuning": {"gain": 2.5, "reset": 3, "reset_unit": "minutes", "rate": 1.25},
            "derivative_gain_limit": 8,
            "pv": {"range": [0, 100], "filter": 0.5},
            "output": {"range": [0, 50], "limits": [5, 45]},
            "setpoint": {"value": 50, "limits": [10, 90]},
            "error": {"curve": "squared", "deadband": 1},
            "alarms": {
                "pv": {"low_low": 5, "low": 10, "high": 90, "high_high": 95},
                "hysteresis": 0.5,
                "deviation": {"yellow": 5, "red": 10},
                "rate_of_change": 2,
            },
        },
    )
    c, s = machine.configs[0], machine.states[0]

    assert (c.reverse, c.bumpless, c.bias_freeze, c.squared, c.shapes_error, c.is_special) == (1, 2, 1, 1, 1, 1)
    assert (s.gain, s.reset, s.rate, s.period) == (2.5, 180.0, 1.25, 500_000)
    assert (c.gain_limit_on, c.gain_limit, c.filter) == (1, 8.0, 0.5)
    assert (c.output_low_limit, c.output_high_limit, c.sp_min, c.sp_max) == (410.0, 3686.0, 410.0, 3686.0)
    assert (c.low_low, c.low, c.high, c.high_high) == (205.0, 410.0, 3686.0, 3890.0)
    assert (c.yellow, c.red, c.rate_of_change, c.hysteresis) == (205.0, 410.0, 82.0, 20.0)
    assert (s.sp, c.deadband, s.kp) == (2048.0, 41.0 / 4095.0, -2.5 * 4095.0)


@pytest.mark.parametrize(("decimals", "minutes"), [(1, 30.0), (2, 3.0)])
def test_the_same_reset_word_means_ten_times_as_much_with_one_decimal(decimals, minutes):
    image = encode(
        Dl06File.model_validate(
            {
                "pidcfg": 1,
                "vendor": "dl06",
                "plc": {"loop_table": "V2000", "reset_decimals": 1},
                "loops": [{**LOOP, "tuning": {"gain": 1, "reset": 30, "reset_unit": "minutes"}}],
            }
        )
    ).image
    machine = load(Image("dl06", image.cells, image.settings, {"reset_decimals": decimals}))

    assert machine.states[0].reset == minutes * 60


@pytest.mark.parametrize("word", [0x0000, 0x9999])
def test_reset_all_zeros_and_all_nines_are_off(word):
    words = {0o7640: 0o2000, 0o7641: 1, 0o2007: 0x0010, 0o2010: 0x0100, 0o2011: word}

    assert load(listing(words)).states[0].ki == 0.0


@pytest.mark.parametrize("decimals", [1, 2])
def test_an_event_writes_either_word_that_takes_the_integral_out(decimals):
    machine = plc({"tuning": {"gain": 1, "reset": 10}}, reset_decimals=decimals)
    for value, word in (("off 9999", 0x9999), ("off", 0x0000)):
        change(machine, "tuning.reset", value)
        assert (machine.states[0].ki, machine._loops[0].memory[0o11]) == (0.0, word)


def test_a_bare_listing_runs_in_counts_with_names_of_its_own():
    machine = load(listing({0o7640: 0o2000, 0o7641: 2, 0o2002: 77, 0o2007: 0x0010, 0o2047: 0x0010}))

    assert machine.loops == ["LOOP-1", "LOOP-2"]
    assert machine.signals[:5] == ["", "LOOP-1.PV", "LOOP-1.SP", "LOOP-1.OUT", "LOOP-1.BIAS"]
    assert machine.scales == [(0.0, 4095.0, 4095)] * 2
    assert machine.signal_values[2] == 77.0


def test_a_word_that_is_no_number_counts_as_zero_and_is_reported():
    machine = load(listing({0o7640: 0o2000, 0o7641: 1, 0o2007: 0x0010, 0o2010: 0x0A00}))

    assert machine.states[0].gain == 0.0
    no_bcd = "0x0A00 has a digit above 9; it is 2560 (typed in decimal? 25.60 would be 2560)"
    assert machine.problems == [(0, f"+10 Gain (proportional): {no_bcd}; taken as 0", True)]


def test_the_filter_is_off_outside_its_range_and_without_its_bit():
    seen = {}
    for k in (0, 0.1, 1.0, 1.1, 999.9):
        seen[k] = plc({"pv": {"filter": k, "filter_enabled": True}}).configs[0].filter

    assert seen == {0: 1.0, 0.1: 0.1, 1.0: 1.0, 1.1: 1.0, 999.9: 1.0}
    assert plc({"pv": {"filter": 0.1, "filter_enabled": False}}).configs[0].filter == 1.0


def test_the_remote_set_point_pointer_finds_its_loop_by_address():
    machine = plc({"cascade_from": "L2"}, {}, {"remote_setpoint": "V2006"}, {"remote_setpoint": "V2145"})

    assert [c.major for c in machine.configs] == [1, -1, -1, -1], "+05 of another loop, nothing else"


def test_loops_with_a_sample_rate_below_the_least_run_at_the_least():
    eight = plc(*[{"sample_rate": 0.05}] * 8)

    assert {s.period for s in eight.states} == {100_000}
    assert plc({"sample_rate": 0.05}).states[0].period == 50_000


@pytest.mark.parametrize("scan_time", [0, 20_000])
def test_a_sample_rate_of_more_than_2_s_is_slow_where_scans_have_a_length(scan_time):
    loops = [{**LOOP, "name": f"L{rate}", "sample_rate": rate} for rate in (0.05, 2.0, 2.05, 3.0)]
    machine = plc(*loops, options=Options(scan_time=scan_time))
    assert [config.slow for config in machine.configs] == ([0, 0, 1, 1] if scan_time else [0, 0, 0, 0])


@pytest.mark.parametrize(
    ("key", "value", "ticks"),
    [("sample_rate", 3, 3_000_000), ("sample_rate", 0, 0), ("derivative_gain_limit", 3, 0)],
)
def test_a_new_sample_rate_is_known_beforehand(key, value, ticks):
    assert plc(LOOP).new_period(0, (key,), Decimal(value)) == ticks


def test_the_base_step_is_the_greatest_common_one():
    assert plc({"sample_rate": 0.2}, {"sample_rate": 0.5}).base_ticks == 100_000


# --- the set-up ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "flags"),
    [
        ({}, 0),
        ({"loop_table": "V1000"}, 1),
        ({"loop_table": "V20000"}, 2),
        ({"number_of_loops": 9}, 4),
        ({"loop_table": "V7640"}, 1),
    ],
)
def test_flags_stop_the_loop_task(given, flags):
    machine = plc({"mode": "auto"}, **given)
    _, said = play(machine, 5, [10.0])

    assert machine.error_words == {"V7642": flags}
    assert machine.running is (flags == 0)
    assert mode(machine) == ("auto" if flags == 0 else "manual")
    assert said == []


def test_a_scenario_can_override_the_number_of_loops():
    machine = plc({}, options=Options(number_of_loops=9))

    assert machine.error_words == {"V7642": 4}


def test_no_loops_turn_the_task_off_without_a_flag():
    machine = plc({"mode": "auto"}, number_of_loops=0)
    play(machine, 3, [0.0])

    assert (machine.running, machine.error_words, mode(machine)) == (False, {"V7642": 0}, "manual")


def test_loops_beyond_the_count_do_not_run():
    machine = plc({"mode": "auto"}, {"mode": "auto"}, number_of_loops=1)
    play(machine, 3, [0.0, 0.0])
    machine.request(1, "auto")
    _, said = play(machine, 1, [0.0, 0.0], start=3)

    assert (mode(machine, 0), mode(machine, 1)) == ("auto", "manual")
    assert said == [(3, "L2", "auto", "refused: the loop is not calculated")]


def test_any_memory_can_be_run():
    """Random words, the table anywhere, set-up words inside it: no exception, flags as the check says."""
    rng = random.Random(8)
    ran = 0
    for _ in range(400):
        words = {rng.randrange(0o400, 0o20000): rng.getrandbits(16) for _ in range(20)}
        start = rng.choice([0o7640, 0o7641, 0o7600, 0o2000, 0o1200, 0o7340, 0o10000, rng.getrandbits(16)])
        words |= {start + k: rng.choice([rng.getrandbits(16), rng.getrandbits(4), 0]) for k in range(64)}
        words |= {0o7640: start, 0o7641: rng.choice([1, 2, 2, 2, 9, 0xAAAA])}
        machine = load(listing({a: w for a, w in words.items() if a < 0o200000}))
        for i in range(len(machine.loops)):
            machine.request(i, "auto")
            machine.ramp_soak(i, "start")
            machine.autotune(i)
        play(machine, 20, [rng.uniform(0, 4095) for _ in machine.loops], base=50_000)
        machine.program(machine.signal_values)
        play(machine, 5, base=50_000, start=20)
        machine.run(25 * 50_000)
        play(machine, 5, base=50_000, start=25)
        ran += machine.running
    assert ran > 50


def test_a_table_on_top_of_the_set_up_words_is_survived():
    """The loop table starts at V7640: its first words are the set-up words themselves."""
    image = listing({0o7640 + k: 0 for k in range(32)} | {0o7640: 0o7640, 0o7641: 1})
    machine = load(image)
    play(machine, 5, [1.0])

    assert machine.error_words == {"V7642": 1}


# --- modes and the start ---------------------------------------------------------------------------------------------


def test_each_loop_reaches_its_mode_and_then_gets_its_set_point():
    machine = plc({**SCALED, "mode": "auto", "setpoint": {"value": 60}})
    before = list(machine.signal_values)
    signal_values, _ = play(machine, 1, [40.0])
    assert (before[2], signal_values[2]) == (pytest.approx(60.0, abs=0.02), pytest.approx(40.0, abs=0.02))
    signal_values, _ = play(machine, 1, [40.0], start=1)

    assert signal_values[2] == pytest.approx(60.0, abs=0.02)


def test_an_alarm_programming_error_keeps_the_loop_in_manual():
    machine = plc({**SCALED, "mode": "auto", "alarms": {"pv": {"low_low": 5, "low": 10, "high": 95, "high_high": 90}}})
    _, said = play(machine, 5, [50.0])

    assert mode(machine) == "manual"
    assert machine.states[0].status & FLAG_BITS["alarm_programming_error"]
    assert said == [(0, "L1", "auto", "refused: alarm programming error (+06 bit 10)")]


def test_interlock_and_step_bias_are_options():
    c = plc({}, options=Options(auto_interlock=False, step_bias=True)).configs[0]

    assert (c.interlock, c.step_bias, c.is_special) == (0, 1, 1)


def test_the_output_that_a_scenario_gives_is_on_the_module_at_once():
    machine = plc(SCALED)
    signal_values = list(machine.signal_values)
    machine.set_output(0, Quantity(Decimal(20)), signal_values)

    assert signal_values[3] == pytest.approx(20.0, abs=0.01)
    assert machine.states[0].out == 1638.0


# --- set -------------------------------------------------------------------------------------------------------------


def change(machine, key, value, loop=0, signal_values=None):
    path = tuple(key.split("."))
    return machine.set(
        loop,
        path,
        machine.check_set(loop, path, value),
        signal_values if signal_values is not None else list(machine.signal_values),
    )


@pytest.mark.parametrize(
    ("key", "value", "name", "expected"),
    [
        ("setpoint", 50, "sp", 2048.0),
        ("setpoint.value", "100 counts", "sp", 100.0),
        ("bias", 25, "bias", 2048.0),
        ("output", 25, "out", 2048.0),
        ("tuning.gain", 3.5, "gain", 3.5),
        ("gain", 3.5, "gain", 3.5),
        ("tuning.reset", "2 min", "reset", 120.0),
        ("tuning.reset", "off", "reset", 0.0),
        ("rate", 2, "rate", 2.0),
        ("sample_rate", "500 ms", "period", 500_000),
    ],
)
def test_set_writes_words_that_are_read_on_the_fly(key, value, name, expected):
    machine = plc(SCALED)

    assert change(machine, key, value) is None
    assert getattr(machine.states[0], name) == expected


@pytest.mark.parametrize(
    ("key", "value", "names", "expected"),
    [
        ("setpoint.limits", [10, 90], ("sp_min", "sp_max"), (410.0, 3686.0)),
        ("error.curve", "squared", ("squared", "shapes_error"), (1, 1)),
        ("action", "reverse", ("reverse",), (1,)),
        ("bias_freeze", True, ("bias_freeze",), (1,)),
        ("pv.filter_enabled", True, ("filter",), (0.3,)),
    ],
)
def test_set_writes_bits_and_pairs(key, value, names, expected):
    machine = plc(
        {**SCALED, "pv": {**SCALED["pv"], "filter": 0.3, "filter_enabled": False}, "setpoint": {"limits_enabled": True}}
    )
    change(machine, key, value)

    assert tuple(getattr(machine.configs[0], name) for name in names) == expected


def test_alarm_words_are_read_when_their_enable_bit_goes_on():
    machine = plc({**SCALED, "alarms": {"pv": {"low_low": 5, "low": 10, "high": 90, "high_high": 95}}})

    assert change(machine, "alarms.pv.high", 50) == "+15 is not read until the alarm's enable bit goes from 0 to 1"
    assert machine.configs[0].high == 3686.0
    change(machine, "alarms.pv.enabled", value=False)
    assert machine.configs[0].high == bits.UNBOUNDED
    change(machine, "alarms.pv.enabled", value=True)
    assert machine.configs[0].high == 2048.0


def test_output_limits_are_read_at_a_change_of_the_cpu_mode():
    machine = plc(SCALED)

    assert change(machine, "output.limits", [5, 45]) == (
        "+30 is not read until the PLC changes between Program and Run; "
        "+31 is not read until the PLC changes between Program and Run"
    )
    assert machine.configs[0].output_high_limit == 4095.0
    machine.program(machine.signal_values)
    machine.run(100_000)
    assert (machine.configs[0].output_low_limit, machine.configs[0].output_high_limit) == (410.0, 3686.0)


def test_alarm_words_are_read_when_the_cpu_goes_to_run_not_when_it_goes_to_program():
    machine = plc({**SCALED, "alarms": {"pv": {"low_low": 5, "low": 10, "high": 90, "high_high": 95}}})
    change(machine, "alarms.pv.high", 50)
    machine.program(machine.signal_values)
    in_program = machine.configs[0].high
    machine.run(100_000)

    assert (in_program, machine.configs[0].high) == (3686.0, 2048.0)


def test_alarms_in_the_wrong_order_force_the_loop_to_manual_when_they_are_read():
    machine = plc({**SCALED, "mode": "auto", "alarms": {"deviation": {"yellow": 5, "red": 10, "enabled": False}}})
    play(machine, 2, [40.0])
    change(machine, "alarms.deviation.yellow", 50)
    change(machine, "alarms.deviation.enabled", value=True)
    _, said = play(machine, 1, [40.0], start=2)

    assert mode(machine) == "manual"
    assert said == [(2, "L1", None, "to Manual: alarm programming error (+06 bit 10)")]


def test_rate_of_change_is_converted_with_the_sample_rate():
    machine = plc({**SCALED, "sample_rate": 2.0})
    change(machine, "alarms.rate_of_change", "15 /min")
    change(machine, "alarms.rate_of_change_enabled", value=True)

    assert machine.configs[0].rate_of_change == 20.0


def test_cascade_from_can_be_set_by_name():
    machine = plc({}, {})
    change(machine, "cascade_from", "L2")

    assert machine.configs[0].major == 1


@pytest.mark.parametrize(
    ("key", "value", "kind"),
    [
        ("mode", "auto", "set_key"),
        ("autotune.start", True, "set_key"),
        ("nonsense", 1, "set_key"),
        ("pv.transfer", 1, "set_key"),
        ("gain", 100, "set_value"),
        ("gain", "x", "number_type"),
        ("setpoint", 1000, "set_value"),
        ("setpoint.limits", 5, "pair_type"),
        ("error.curve", "cubic", "choice"),
        ("bias_freeze", "yes", "boolean_form"),
        ("gain", 0.004, "set_value"),
        ("cascade_from", "nobody", "set_value"),
    ],
)
def test_set_refuses_what_cannot_be_written(key, value, kind):
    with pytest.raises(PydanticCustomError) as caught:
        plc(SCALED, {}).check_set(0, tuple(key.split(".")), value)

    assert caught.value.type == kind


def test_a_misspelt_key_gets_a_proposal():
    with pytest.raises(PydanticCustomError) as caught:
        plc({}).check_set(0, ("tuning", "gian"), 1)

    assert caught.value.context["help"] == "did you mean tuning.gain?"


# --- the CPU ---------------------------------------------------------------------------------------------------------


def test_program_mode_forces_manual_and_run_restores_the_modes():
    machine = plc({"mode": "cascade", "cascade_from": "L2"}, {"mode": "auto"})
    play(machine, 4, [1000.0, 1000.0])
    assert [mode(machine, i) for i in (0, 1)] == ["cascade", "auto"]
    machine.program(machine.signal_values)
    _, said = play(machine, 3, [1000.0, 1000.0], start=4)
    assert [mode(machine, i) for i in (0, 1)] == ["manual", "manual"]
    assert [text for *_, text in said] == ["to Manual: the CPU went to Program mode"] * 2
    machine.request(0, "auto")
    _, said = play(machine, 1, start=7)
    assert said == [(7, "L1", "auto", "refused: the CPU is in Program mode and the loop is not independent of it")]
    machine.run(800_000)
    play(machine, 1, [1000.0, 1000.0], start=8)

    assert [mode(machine, i) for i in (0, 1)] == ["cascade", "auto"]


def test_an_independent_loop_keeps_its_mode_in_program_mode():
    transfer = {"slot": 1, "channel": 1}
    machine = plc(
        {
            "independent_of_cpu_mode": True,
            "mode": "auto",
            "pv": {"transfer": transfer},
            "output": {"transfer": {"slot": 2, "channel": 1}},
        }
    )
    play(machine, 2, [1000.0])
    machine.program(machine.signal_values)
    change(machine, "setpoint", 1200)
    signal_values, _ = play(machine, 2, [900.0], start=2)

    assert mode(machine) == "auto"
    assert machine.states[0].pv == 900.0
    assert signal_values[3] == machine.states[0].out > 0.0


def test_an_independent_loop_is_not_restored_to_a_mode_it_had_long_ago():
    machine = plc({"mode": "auto"})
    play(machine, 2, [1000.0])
    machine.program(machine.signal_values)
    machine.run(200_000)
    play(machine, 2, [1000.0], start=2)
    machine.request(0, "manual")
    play(machine, 1, [1000.0], start=4)
    change(machine, "independent_of_cpu_mode", value=True)
    machine.program(machine.signal_values)
    machine.run(500_000)
    play(machine, 2, [1000.0], start=5)

    assert mode(machine) == "manual"


def test_run_in_run_mode_changes_nothing():
    machine = plc({**SCALED, "mode": "auto"})
    play(machine, 2, [40.0])
    change(machine, "output.limits", [5, 45])
    machine.run(200_000)

    assert machine.configs[0].output_high_limit == 4095.0


@pytest.mark.parametrize("what", ["ramp_soak", "autotune"])
def test_commands_to_a_loop_that_is_not_calculated_are_refused(what):
    machine = plc({}, number_of_loops=9)
    getattr(machine, what)(0, "start")
    _, said = play(machine, 1, [1.0])

    assert said == [(0, "L1", None, "refused: the loop is not calculated")]


def test_a_second_program_keeps_the_recorded_modes():
    machine = plc({"mode": "auto"})
    play(machine, 2, [1000.0])
    machine.program(machine.signal_values)
    machine.program(machine.signal_values)
    machine.run(200_000)
    play(machine, 1, [1000.0], start=2)

    assert mode(machine) == "auto"


# --- ramp/soak and auto-tune -----------------------------------------------------------------------------------------


def test_a_ramp_soak_profile_runs_from_its_table():
    machine = plc(
        {
            **SCALED,
            "sample_rate": 1.0,
            "setpoint": {"value": 20},
            "ramp_soak": {"table": "V3000", "steps": [{"ramp_to": 30, "slope": 2, "soak": 0.1}]},
        }
    )
    machine.ramp_soak(0, "start")
    signal_values, _ = play(machine, 3, [20.0], base=1_000_000)

    assert machine.states[0].sp == pytest.approx(819 + 2 * 81.9, abs=1)
    assert machine.states[0].aux_status == 1 << 8
    play(machine, 12, [20.0], base=1_000_000, start=3)
    assert machine.states[0].aux_status == AUX_BITS["ramp_soak_complete"]
    assert signal_values[2] == pytest.approx(24.0, abs=0.05)


def test_a_start_bit_in_the_image_starts_at_once():
    machine = plc(
        {
            "ramp_soak": {"table": "V3000", "request": "start", "steps": [{"ramp_to": 100, "slope": 5, "soak": 1}]},
            "autotune": {"start": True},
        }
    )
    play(machine, 1, [0.0])

    assert machine.states[0].aux_status == 1 << 8
    assert machine.states[0].status & FLAG_BITS["autotune_error"], "closed loop, but the loop is in Manual"


def tuning_bench():
    """A loop in Auto on a first-order plant with dead time, and a function that runs it for some samples."""
    machine = plc(
        {
            **SCALED,
            "output": {"range": [0, 100], "limits": [20, 80]},
            "mode": "auto",
            "setpoint": {"value": 50},
            "tuning": {"gain": 0.5, "reset": 10},
        }
    )
    signal_values, plant = list(machine.signal_values), {"k": 0, "y": 50.0, "line": [50.0] * 10}
    machine.set_output(0, Quantity(Decimal(50)), signal_values)

    def go(samples):
        for _ in range(samples):
            plant["line"].append(signal_values[3])
            plant["y"] += 0.02 * (plant["line"].pop(0) - plant["y"])
            signal_values[0] = plant["y"]
            scan(plant["k"] * 100_000, machine.configs, machine.states, machine.aux, signal_values)
            plant["k"] += 1

    go(20)
    return machine, signal_values, go


def test_auto_tune_writes_its_results_to_the_words():
    machine, signal_values, go = tuning_bench()
    machine.autotune(0)
    go(10)
    assert machine.tuning_result(0)["status"] == "running"
    go(2000)
    tuned = machine.tuning_result(0)

    assert (tuned["done"], tuned["error"], tuned["status"]) == (True, False, "done")
    assert list(tuned["results"]) == list(machine.tuned_names)
    assert tuned["results"]["gain"] == machine.states[0].gain != 0.5
    change(machine, "rate", 0, signal_values=signal_values)
    assert machine.states[0].gain == tuned["results"]["gain"], "another word that is written leaves the results alone"
    assert machine.states[0].rate == 0.0
    assert machine.tuning_result(0) == tuned
    machine.program(machine.signal_values)
    machine.run(300_000_000)
    assert machine.states[0].gain == tuned["results"]["gain"]


def test_a_second_auto_tune_takes_the_place_of_the_first():
    machine, signal_values, go = tuning_bench()
    machine.autotune(0)
    go(2000)
    first = machine.tuning_result(0)["results"]
    change(machine, "autotune.type", "PI", signal_values=signal_values)
    machine.autotune(0)
    change(machine, "rate", 9, signal_values=signal_values)
    go(2000)
    change(machine, "bias_freeze", value=True, signal_values=signal_values)
    second = machine.tuning_result(0)["results"]

    assert (machine.states[0].gain, machine.states[0].rate) == (second["gain"], 0.0)
    assert second["gain"] < first["gain"]


def test_without_a_tune_there_is_nothing_to_tell():
    assert plc({}).tuning_result(0) is None


# --- names -----------------------------------------------------------------------------------------------------------


def test_bits_of_the_status_words_are_those_of_the_register_map():
    titles = {
        (0o06, MODES["manual"]): "Manual mode",
        (0o06, MODES["auto"]): "Automatic mode",
        (0o06, MODES["cascade"]): "Cascade mode",
        (0o06, ALARM_BITS["pv_low_low"]): "PV low-low alarm",
        (0o06, ALARM_BITS["pv_low"]): "PV low alarm",
        (0o06, ALARM_BITS["pv_high"]): "PV high alarm",
        (0o06, ALARM_BITS["pv_high_high"]): "PV high-high alarm",
        (0o06, ALARM_BITS["deviation_yellow"]): "PV yellow deviation alarm",
        (0o06, ALARM_BITS["deviation_red"]): "PV red deviation alarm",
        (0o06, ALARM_BITS["rate_of_change"]): "PV rate-of-change alarm",
        (0o06, FLAG_BITS["alarm_programming_error"]): "Alarm value programming error",
        (0o06, FLAG_BITS["overflow"]): "Loop calculation overflow/underflow",
        (0o06, FLAG_BITS["autotune_running"]): "Loop in auto-tune",
        (0o06, FLAG_BITS["autotune_error"]): "Auto-tune error",
        (0o33, AUX_BITS["ramp_soak_complete"]): "Ramp/soak profile complete",
        (0o33, AUX_BITS["ramp_soak_deviation"]): "Ramp/soak deviation",
        (0o33, AUX_BITS["ramp_soak_hold"]): "Ramp/soak profile in hold",
    }

    assert {(row.offset, row.mask): row.title for row in LOOP_TABLE.bits if (row.offset, row.mask) in titles} == titles


def test_the_reactor_starts_inside_out_without_a_refusal():
    machine = load(encode(Dl06File.model_validate(read_document(REACTOR.read_bytes(), "reactor").data)).image)
    _, said = play(machine, 40, [20.0, 80.0, 50.0], base=200_000)

    assert [mode(machine, i) for i in range(3)] == ["cascade", "auto", "auto"]
    assert said == []


# --- what changes while it runs --------------------------------------------------------------------------------------


def test_without_a_configured_set_point_bumpless_one_keeps_the_pv_as_set_point():
    machine = plc({**SCALED, "mode": "auto"})
    signal_values, _ = play(machine, 5, [40.0])

    assert signal_values[2] == pytest.approx(40.0, abs=0.02)


def test_a_set_point_that_an_event_writes_before_auto_is_reached_counts_as_given():
    machine = plc({**SCALED, "mode": "auto"})
    change(machine, "setpoint", 60)
    signal_values, _ = play(machine, 5, [40.0])

    assert signal_values[2] == pytest.approx(60.0, abs=0.02)


def test_a_bare_listing_runs_in_the_mode_of_its_status_word():
    words = {0o7640: 0o2000, 0o7641: 1, 0o2006: 0x0002, 0o2007: 0x0010}
    machine = load(listing(words))
    play(machine, 3, [100.0])

    assert machine.initial_modes == ["auto"]
    assert mode(machine) == "auto"
    beside = load(listing({**words, 0o2006: 0}, ({"loop": "A", "mode": "auto"},)))
    assert beside.initial_modes == ["auto"]


def cascade():
    """Loop 1 in Cascade below loop 2 in Auto, and loop 3 with an output that is not 0."""
    machine = plc({"mode": "cascade", "cascade_from": "L2"}, {"mode": "auto"}, {"state": {"output": "3000 counts"}})
    play(machine, 4, [1000.0] * 3)
    assert [mode(machine, i) for i in range(3)] == ["cascade", "auto", "manual"]
    return machine


def test_a_loop_that_loses_its_remote_set_point_leaves_cascade_and_its_major_loop_goes_to_manual():
    machine = cascade()
    change(machine, "remote_setpoint", "V2006")
    signal_values, said = play(machine, 2, [1000.0] * 3, start=4)

    assert [mode(machine, i) for i in range(3)] == ["manual"] * 3
    assert [text for *_, text in said] == [
        "to Manual: the remote set point pointer (+32) names no control output any more",
        "to Manual: the minor loop left Cascade",
    ]
    assert signal_values[2] == 1000.0, "not the output of the last loop"


def test_a_remote_set_point_that_is_lost_in_program_mode_is_not_restored():
    machine = cascade()
    machine.program(machine.signal_values)
    change(machine, "remote_setpoint", "V2006")
    machine.run(400_000)
    _, said = play(machine, 2, [1000.0] * 3, start=4)

    assert mode(machine) == "auto"
    assert machine.states[2].out == 3000.0, "the output of the last loop is not taken for the lost one"
    assert any(text.endswith("names no control output of the loop table") for *_, text in said)


def test_after_an_event_the_set_point_in_force_is_shown():
    machine = cascade()
    signal_values = list(machine.signal_values)
    signal_values[2], machine.states[1].out = 1000.0, 1234.0
    change(machine, "setpoint", 77, signal_values=signal_values)
    assert signal_values[2] == 1000.0, "in Cascade the one that the last calculation has read"
    limited = plc({**SCALED, "setpoint": {"limits": [0, 50]}})
    signal_values = list(limited.signal_values)
    change(limited, "setpoint", 90, signal_values=signal_values)
    assert signal_values[2] == pytest.approx(50.0, abs=0.02)


def test_an_independent_major_loop_goes_to_manual_when_program_mode_takes_its_minor_out_of_cascade():
    """ "For any reason", as the manual says; after Program mode it stays there (D680)."""
    machine = plc({"mode": "cascade", "cascade_from": "L2"}, {"mode": "auto", "independent_of_cpu_mode": True})
    play(machine, 4, [1000.0, 1000.0])
    assert [mode(machine, i) for i in (0, 1)] == ["cascade", "auto"]
    machine.program(machine.signal_values)
    assert [mode(machine, i) for i in (0, 1)] == ["manual", "manual"]
    machine.run(400_000)
    play(machine, 2, [1000.0, 1000.0], start=4)

    assert [mode(machine, i) for i in (0, 1)] == ["cascade", "manual"]


def test_the_set_point_of_a_root_loop_is_shown_as_the_pv_that_satisfies_it():
    machine = plc({"pv": {"square_root": True}})
    signal_values = list(machine.signal_values)
    change(machine, "setpoint", "30 counts", signal_values=signal_values)

    assert signal_values[machine.configs[0].sp_slot] == 900.0


def test_a_second_start_of_an_auto_tune_is_only_logged():
    """D683; begun anew, the relay would leave its output where it is for 16 samples."""
    tuned = {"mode": "auto", "autotune": {"method": "closed"}, "output": {"limits": ["500 counts", "3000 counts"]}}
    machine = plc(tuned)
    play(machine, 2, [1000.0])
    machine.autotune(0)
    play(machine, 20, [1000.0], start=2)
    assert machine.states[0].out == 3000.0
    machine.autotune(0)
    assert machine.describe(machine.states[0].notice)[1] == "auto-tune is running already (D683)"
    play(machine, 1, [1001.0], start=22)

    assert machine.states[0].out == 500.0, "the relay goes on"


def test_another_form_of_the_equation_begins_without_a_past():
    """D681: the output that the velocity form goes on from is the last one, and the error of before counts as now's."""
    machine = plc({"mode": "auto", "bumpless": "II", "tuning": {"gain": 1}, "setpoint": {"value": 1500}})
    play(machine, 3, [1000.0])
    change(machine, "algorithm", "velocity")
    play(machine, 1, [900.0], start=3)
    first = machine.states[0].out
    play(machine, 1, [800.0], start=4)

    assert (first, machine.states[0].out) == (500.0, 600.0)


def test_program_mode_turns_outputs_off_at_once_but_for_independent_loops_with_transfer():
    transfer = {"pv": {"transfer": {"slot": 1, "channel": 1}}, "output": {"transfer": {"slot": 2, "channel": 1}}}
    held = {"state": {"output": "700 counts"}}
    machine = plc(held, {**transfer, **held}, {**transfer, **held, "independent_of_cpu_mode": True})
    signal_values = list(machine.signal_values)
    assert [signal_values[c.out_slot] for c in machine.configs] == [700.0] * 3
    machine.program(signal_values)

    assert [signal_values[c.out_slot] for c in machine.configs] == [0.0, 0.0, 700.0]
    change(machine, "output", "800 counts", signal_values=signal_values)
    assert signal_values[machine.configs[0].out_slot] == 0.0


def test_a_derivative_that_is_switched_on_does_not_kick():
    machine = plc({**SCALED, "mode": "auto", "setpoint": {"value": 60}})
    play(machine, 20, [40.0])
    before = machine.states[0].out
    change(machine, "rate", 10)
    play(machine, 1, [40.0], start=20)

    assert machine.states[0].out == before


def test_a_sample_rate_is_known_before_it_is_set():
    machine = plc({"sample_rate": 1.0})

    def period_set(key, value):
        path = tuple(key.split("."))
        return machine.new_period(0, path, machine.check_set(0, path, value))

    assert period_set("sample_rate", "70 ms") == 70_000
    assert period_set("sample_rate", 0.01) == 50_000, "not below the least"
    assert period_set("gain", 5) == 0
    assert machine.periods == [1_000_000]
    change(machine, "sample_rate", 0.2)
    assert machine.periods == [200_000]


def test_the_scan_counts_only_loops_that_are_calculated():
    machine = plc({}, {"sample_rate": 0})

    assert machine.scan_time(0.1).typical == pytest.approx(0.1 + 250e-6)


def test_reasons_apart_from_modes_are_kept_apart():
    machine = plc({}, number_of_loops=9)
    machine.ramp_soak(0, "start")
    assert machine.describe(machine.states[0].notice) == ("", "refused: the loop is not calculated")
    machine.states[0].notice = 0
    machine.request(0, "auto")
    assert machine.describe(machine.states[0].notice) == ("refused: the loop is not calculated", "")


def test_another_form_of_the_equation_takes_over_without_a_kick():
    machine = plc({**SCALED, "mode": "auto", "setpoint": {"value": 60}, "tuning": {"gain": 1, "rate": 5}})
    play(machine, 20, [40.0])
    before = machine.states[0].out
    change(machine, "algorithm", "velocity")
    play(machine, 5, [40.0], start=20)

    assert machine.states[0].out == before


def test_a_loop_that_is_not_calculated_misses_no_scan():
    text = {"pidcfg": 1, "scenario": "t", "config": "c", "duration": 10, "plc": {"scan_time": 1}}
    machine = plc({"sample_rate": 0}, {"sample_rate": 1}, {"sample_rate": 0.5})
    found = prepare_network(Scenario.model_validate(text), machine).problems

    assert [p.loop for p in found if "sample rate" in p.message] == ["L3"]


@pytest.mark.parametrize(("raw", "wanted"), [(1, "manual"), (2, "auto"), (4, "cascade")])
def test_a_mode_whose_bit_is_written_is_requested_and_its_bit_reads_as_0(raw, wanted):
    registers, word = Dl06Registers(machine := plc({})), 0o2000 + LOOP_TABLE.offset_of("mode_setting_1")
    done = registers.write(word, raw, list(machine.signal_values))

    assert (done.text, done.mode) == (f"request mode {wanted}", wanted)
    assert registers.contents(0, machine.signal_values)[word] & raw == 0


def test_a_client_reads_what_the_controller_has_written():
    machine = plc({}, {})
    registers, s = Dl06Registers(machine), machine.states[1]
    s.sp, s.pv, s.bias, s.out = 1200.4, 70.0, 4095.0, 5000.0
    s.status, s.aux_status, s.rs_error = bits.AUTO | bits.LOW, bits.RS_COMPLETE | 3 * bits.RS_STEP | bits.RS_JOG, 16
    held = registers.contents(1, machine.signal_values)
    table = 0o2000 + LOOP_TABLE.size
    names = ("setpoint", "pv", "bias", "output", "mode_and_alarm_status", "ramp_soak_flags", "ramp_soak_errors")
    found = {name: held[table + LOOP_TABLE.offset_of(name)] for name in names}

    assert found == {
        "setpoint": 1200,
        "pv": 70,
        "bias": 4095,
        "output": 4095,
        "mode_and_alarm_status": bits.AUTO | bits.LOW,
        "ramp_soak_flags": bits.RS_COMPLETE | 3 * bits.RS_STEP,
        "ramp_soak_errors": 16,
    }


def test_every_loop_has_a_ramp_soak_table_and_a_tuning_buffer_of_its_own():
    machine = plc({}, {}, {})
    places = [(c.rs_table, RAMP_SOAK_SIZE) for c in machine.configs] + [
        (c.tune_buffer, POINTS) for c in machine.configs
    ]
    ends = [begin + size for begin, size in places]

    assert [begin for begin, _ in places] == [0, *ends[:-1]]
    assert ends[-1] <= len(machine.aux)


def words_with_profile(enabled):
    """The words of a loop at V2000 whose ramp/soak table is at V3000."""
    steps = [{"ramp_to": 100, "slope": 1, "soak": 5}]
    loop = {**LOOP, "ramp_soak": {"enabled": enabled, "table": "V3000", "steps": steps}}
    config = {"pidcfg": 1, "vendor": "dl06", "plc": {"loop_table": "V2000"}, "loops": [loop]}
    return {cell.number: cell.raw for cell in encode(Dl06File.model_validate(config)).image.cells}


def test_a_ramp_soak_table_that_a_listing_does_not_have_counts_as_zeros():
    words = {number: raw for number, raw in words_with_profile(True).items() if not 0o3000 <= number < 0o3040}

    assert load(listing(words)).problems == []


@pytest.mark.parametrize("enabled", [True, False])
def test_a_word_of_a_ramp_soak_table_that_is_no_number_is_told_with_its_table(enabled):
    words = words_with_profile(enabled) | {0o3001: 0x0A00}

    texts = [problem.text for problem in load(listing(words)).problems]
    assert [text.partition("+")[0] for text in texts] == ["ramp/soak table "] * enabled
