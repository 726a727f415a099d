"""The EZLogix as made of registers: what a configuration encodes to is what runs, and any memory can be run."""

from __future__ import annotations

import random
from dataclasses import replace
from decimal import Decimal
from math import sqrt

import pytest
from pydantic_core import PydanticCustomError

from ezlogix_rig import BIAS, CV, PV, SCALED, SP, STATUS, change, image, play, plc
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.maps.ezlogix import R_BLOCK, S_BLOCK, SPACE
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix.scan import FLAG_BITS, load
from pidcfg.sim.controllers.ezlogix.scan import MODE_BITS as MODES
from pidcfg.sim.controllers.plc import NoOptions as Options
from pidcfg.sim.engine.run import plc_options, prepare_network


class Controller:
    Options = Options


def with_words(made, words):
    """The image with other contents of some addresses."""
    cells = tuple(replace(cell, raw=words.get(cell.number, cell.raw)) for cell in made.cells)
    return replace(made, cells=cells)


# --- from words ------------------------------------------------------------------------------------------------------


def test_every_setting_reaches_the_controller_through_its_register():
    machine = plc(
        {
            "action": "direct",
            "algorithm": "velocity",
            "sample_rate": 0.25,
            "deadband": 1,
            "anti_windup": True,
            "tuning": {"proportional_gain": 2.5, "integral_time": 180, "derivative_time": 1.2},
            "pv": {"tag": "IR1", "range": [-50, 50], "counts": [819, 4095]},
            "setpoint": {"value": 0, "limits": [-40, 40]},
            "output": {
                "tag": "OR1",
                "range": [0, 50],
                "limits": [5, 45],
                "offset": 10,
                "pulse": {"tag": "O1", "cycle_time": 10, "min_on": 0.5, "min_off": 0.3},
            },
            "autotune": {"type": "PI", "timeout": 300},
        },
    )
    c, s = machine.configs[0], machine.states[0]

    assert (c.direct, c.velocity, c.square_root, c.anti_windup, c.tune_pi, c.scale) == (1, 1, 0, 1, 1, 1.0)
    assert (c.pv_min, c.pv_max, c.pv_span, c.pv_low, c.pv_width) == (819.0, 4095.0, 3276.0, -50.0, 100.0)
    assert (c.out_low, c.out_width, c.deadband) == (0.0, 50.0, 33.0)
    assert (c.sp_low, c.sp_high, s.sp) == (1147.0, 3767.0, 2457.0)
    assert (c.cv_low_limit, c.cv_high_limit, c.offset) == (410.0, 3686.0, 819.0)
    assert (s.gain, s.reset, s.rate, s.period, c.period) == (2.5, 180.0, 1.2, 250_000, 250_000)
    assert (s.kp, s.ki, s.kd) == pytest.approx((2.5, 2.5 * 0.25 / 180, 2.5 * 1.2 / 0.25))
    assert (c.cycle, c.min_on, c.min_off, c.timeout) == (10_000_000, 500_000, 300_000, 300_000_000)
    assert machine.scales == [(-50.0, 50.0, 3276)]


@pytest.mark.parametrize(("action", "direct"), [("direct", 1), ("reverse", 0)])
@pytest.mark.parametrize(("algorithm", "velocity"), [("velocity", 1), ("position", 0)])
def test_the_dialog_decides_action_and_algorithm(action, direct, algorithm, velocity):
    c = plc({"action": action, "algorithm": algorithm}).configs[0]

    assert (c.direct, c.velocity) == (direct, velocity)


def test_a_square_root_loop_has_its_set_point_on_the_roots_scale():
    machine = plc(
        {
            "pv": {"tag": "IR1", "range": [0, 100], "square_root": True},
            "setpoint": {"value": 50},
            "deadband": 10,
            "mode": "auto",
            "output": {"tag": "OR1", "offset": 1000},
        }
    )
    c, s = machine.configs[0], machine.states[0]
    assert (s.sp, c.sp_high, c.deadband, c.square_root, c.scale) == (32.0, 64.0, 6.0, 1, sqrt(4095.0))
    play(machine, 1, [10.0])

    error = (32.0 - sqrt(410.0)) * sqrt(4095.0)
    assert (s.error, s.out) == (round(error), round(error) + 1000.0)


def test_words_beyond_the_printed_ranges_are_taken_as_they_are():
    words = {100: 20000, 102: 10000, 103: 65535, 104: 65535, 110: 5000, 108: 9000, 109: 65535}
    machine = load(with_words(image({"mode": "auto"}), words))
    c, s = machine.configs[0], machine.states[0]

    assert (s.period, s.gain, s.reset, s.rate, c.offset) == (200_000_000, 100.0, 6553.5, 6553.5, 5000.0)
    assert (c.cv_low_limit, c.cv_high_limit) == (4095.0, 4095.0), "the CV has 4095 counts"


def test_a_missing_word_counts_as_zero():
    made = image({"setpoint": {"value": 100}, "tuning": {"proportional_gain": 3}})
    machine = load(replace(made, cells=tuple(c for c in made.cells if c.number not in {101, 109})))

    assert (machine.states[0].sp, machine.configs[0].cv_high_limit, machine.states[0].gain) == (0.0, 0.0, 3.0)


def test_a_block_at_the_end_of_its_bank_does_not_run_into_the_next():
    made = image({})
    sample_rate = replace(made.cells[0], address="R65535", number=SPACE.number_of("R", 65535))
    cells = (sample_rate, *(cell for cell in made.cells if cell.address.startswith("S")))
    cells = (*cells, Cell("S0", SPACE.number_of("S", 0), 1, ""), Cell("S1", SPACE.number_of("S", 1), 1, ""))
    machine = load(replace(made, cells=cells, settings=({**made.settings[0], "registers": "R65535"},)))

    assert machine.periods == [100_000], "the first register is the last of the bank"
    assert machine.configs[0].sp_high == 0.0
    assert (machine.states[0].sp, machine.states[0].gain) == (0.0, 0.0)


def test_the_image_says_which_loops_there_are():
    machine = plc(
        {"name": "A", "mode": "auto"}, {"name": "B", "output": {"tag": "OR2", "pulse": {"tag": "O1", "cycle_time": 1}}}
    )

    assert machine.loops == ["A", "B"]
    names = ("PV", "SP", "CV", "BIAS", "ERROR", "STATUS", "O", "COUNTDOWN")
    assert machine.signals[:9] == ["", *("" if name == "O" else f"A.{name}" for name in names)]
    assert machine.signals[9:] == ["", *(f"B.{name}" for name in names)]
    assert len(machine.signal_values) == 18
    c = machine.configs[1]
    slots = (
        c.in_slot,
        c.pv_slot,
        c.sp_slot,
        c.out_slot,
        c.bias_slot,
        c.error_slot,
        c.status_slot,
        c.pulse_slot,
        c.countdown_slot,
    )
    assert slots == tuple(range(9, 18))
    assert machine.configs[0].tune_buffer + 512 == c.tune_buffer
    assert len(machine.aux) == c.tune_buffer + 512


def test_what_the_runner_asks():
    machine = plc({"sample_rate": 0.2}, {"sample_rate": 0.5})

    assert (machine.base_ticks, machine.periods) == (100_000, [200_000, 500_000])
    assert (machine.running, machine.error_words, machine.alarm_bits, machine.aux_bits) == (True, {}, {}, {})
    assert (machine.out_name, tuple(machine.modes), machine.options) == ("CV", ("manual", "auto"), ())
    assert machine.commands == {"ramp_soak": (), "autotune": ("start", "cancel"), "plc": ("stop", "run")}
    assert (machine.pulses, machine.output_raises_pv) == (("O",), [True, True])
    assert plc({"action": "direct"}).output_raises_pv == [False]
    assert machine.tuned_names == ("proportional_gain", "integral_time", "derivative_time")
    assert (machine.scan_time(0.01), machine.problems) == (None, ())


def test_a_cv_in_an_r_register_begins_with_its_content():
    made = image({**SCALED, "output": {"tag": "R150", "range": [0, 50]}})
    cells = (*made.cells, Cell("R150", 150, 819, ""))

    machine = load(replace(made, cells=tuple(sorted(cells, key=lambda c: c.number))))
    assert (machine.states[0].out, machine.signal_values[CV]) == (819.0, 10.0)
    high = load(replace(made, cells=(*made.cells, Cell("R150", 150, 60000, ""))))
    assert high.states[0].out == 4095.0


def test_a_physical_cv_tag_is_no_register():
    made = image({"output": {"tag": "OR201"}}, {"setpoint": {"value": 700}})
    machine = load(made)

    assert (machine.configs[0].inner_loop, machine.states[0].out) == (-1, 0.0)


def test_signals_before_the_first_sample():
    machine = plc(
        {**SCALED, "setpoint": {"value": 25, "limits": [30, 80]}, "output": {**SCALED["output"], "offset": 10}}
    )

    assert machine.signal_values[SP] == pytest.approx(30.0, abs=0.02), (
        "its register is overwritten at the first calculation"
    )
    assert machine.states[0].sp == 1024.0
    assert machine.signal_values[BIAS] == pytest.approx(10.0, abs=0.01)
    assert (machine.signal_values[PV], machine.signal_values[CV], machine.signal_values[STATUS]) == (0.0, 0.0, 0.0)
    elsewhere = plc({"pv": {"tag": "IR1", "range": [10, 110], "counts": [819, 4095]}})
    assert (elsewhere.signal_values[PV], elsewhere.states[0].tune_countdown) == (10.0, 600_000_000)


def test_any_memory_can_be_run():
    """Random words: no exception, and the CV stays within its counts."""
    rng = random.Random(8)
    for _ in range(150):
        count = rng.randint(1, 8)
        settings, words = [], {}
        for i in range(count):
            first, bit = rng.randint(1, 65535), rng.randint(1, 65535)
            pv, cv = rng.choice(["IR1", "R5", f"R{first}"]), rng.choice(["OR1", f"R{rng.randint(1, 65535)}"])
            settings.append(
                {
                    "loop": f"L{i}",
                    "registers": f"R{first}",
                    "discretes": f"S{bit}",
                    "action": rng.choice(["direct", "reverse"]),
                    "algorithm": rng.choice(["position", "velocity"]),
                    "pv": {"tag": pv},
                    "output": {"tag": cv, "pulse": rng.choice([None, {"tag": "O1"}])},
                }
            )
            words |= {first + k: rng.choice([0, 7, rng.getrandbits(16)]) for k in range(R_BLOCK.size)}
            words |= {SPACE.number_of("S", bit) + k: rng.getrandbits(1) for k in range(S_BLOCK.size)}
        cells = tuple(Cell("", a, w, "") for a, w in sorted(words.items()))
        machine = load(Image("ezlogix", cells, tuple(settings), {"process_when_stopped": rng.random() < 0.5}))
        for phase in range(3):
            play(machine, 4, [rng.uniform(0, 4095) for _ in machine.loops], start=4 * phase)
            for i in range(count):
                machine.request(i, rng.choice(["auto", "manual"]))
                machine.autotune(i, rng.choice(["start", "cancel"]))
            if phase == 0:
                machine.program(machine.signal_values)
            elif phase == 1:
                machine.run(800_000)
        assert all(0.0 <= s.out <= 4095.0 and s.out == int(s.out) for s in machine.states)


# --- set -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "name", "expected"),
    [
        ("setpoint", 50, "sp", 2048.0),
        ("setpoint.value", "100 counts", "sp", 100.0),
        ("output", 25, "out", 2048.0),
        ("tuning.proportional_gain", 3.5, "gain", 3.5),
        ("proportional_gain", 3.5, "kp", 3.5),
        ("tuning.integral_time", "2 min", "reset", 120.0),
        ("integral_time", "off", "reset", 0.0),
        ("integral_time", "off", "ki", 0.0),
        ("derivative_time", 2, "rate", 2.0),
        ("sample_rate", "500 ms", "period", 500_000),
        ("autotune.timeout", 60, "tune_countdown", 60_000_000),
    ],
)
def test_set_writes_registers(key, value, name, expected):
    machine = plc({**SCALED, "tuning": {"proportional_gain": 1, "integral_time": 10}})

    assert change(machine, key, value) is None
    assert getattr(machine.states[0], name) == expected


@pytest.mark.parametrize(
    ("key", "value", "names", "expected"),
    [
        ("setpoint.limits", [10, 90], ("sp_low", "sp_high"), (410.0, 3686.0)),
        ("output.limits", [5, 45], ("cv_low_limit", "cv_high_limit"), (410.0, 3686.0)),
        ("output.offset", 10, ("offset",), (819.0,)),
        ("deadband", 2, ("deadband",), (82.0,)),
        ("anti_windup", False, ("anti_windup",), (0,)),
        ("autotune.type", "PI", ("tune_pi",), (1,)),
        ("pv.square_root", True, ("square_root", "scale"), (1, sqrt(4095.0))),
        ("output.pulse.cycle_time", 4, ("cycle",), (4_000_000,)),
        ("min_on", "200 ms", ("min_on",), (200_000,)),
        ("min_off", 0.4, ("min_off",), (400_000,)),
        ("sample_rate", 0.3, ("period",), (300_000,)),
    ],
)
def test_set_writes_dialog_fields_and_discretes(key, value, names, expected):
    machine = plc({**SCALED, "output": {**SCALED["output"], "pulse": {"tag": "O1", "cycle_time": 1}}})
    change(machine, key, value)

    assert tuple(getattr(machine.configs[0], name) for name in names) == expected


def test_set_of_one_register_leaves_the_others():
    """The set point that its limits have overwritten stays overwritten; a pending one waits for its limits."""
    machine = plc({**SCALED, "setpoint": {"value": 95, "limits": [0, 80]}})
    play(machine, 1, [0.0])
    change(machine, "setpoint.limits", [0, 100])
    play(machine, 1, [0.0], start=1)
    assert machine.signal_values[SP] == pytest.approx(80.0, abs=0.02)
    change(machine, "setpoint", 99)
    change(machine, "deadband", 1)

    assert machine.signal_values[SP] == pytest.approx(99.0, abs=0.02)


def test_a_new_set_point_shows_at_once_and_within_its_limits():
    machine = plc({**SCALED, "setpoint": {"value": 20, "limits": [0, 60]}})
    signal_values = list(machine.signal_values)
    change(machine, "setpoint", 70, signals=signal_values)

    assert signal_values[SP] == pytest.approx(60.0, abs=0.02)
    assert machine.signal_values[SP] == pytest.approx(20.0, abs=0.02)


def test_the_output_is_the_operators_in_manual_only():
    machine = plc({**SCALED, "mode": "auto", "setpoint": {"value": 50}})
    machine.set_output(0, Quantity(Decimal(20)), machine.signal_values)
    assert (machine.states[0].out, machine.signal_values[CV]) == (1638.0, pytest.approx(20.0, abs=0.01))
    why = "the loop is in Auto and calculates the CV itself"
    assert change(machine, "output", 30) == why, "Auto is asked for"
    play(machine, 1, [50.0])
    assert change(machine, "output", 30) == why
    machine.request(0, "manual")
    assert change(machine, "output", 30) is None
    play(machine, 2, [10.0], start=1)
    assert machine.signal_values[CV] == pytest.approx(30.0, abs=0.01)
    machine.request(0, "auto")

    assert change(machine, "output", 30) == why


def test_a_loop_without_a_sample_rate_has_no_auto_that_writes_its_cv():
    machine = plc({**SCALED, "mode": "auto"})
    change(machine, "sample_rate", 0)

    assert change(machine, "output", 30) is None


@pytest.mark.parametrize(
    ("key", "value", "kind"),
    [
        ("mode", "auto", "set_key"),
        ("autotune", "start", "set_key"),
        ("nonsense", 1, "set_key"),
        ("action", "direct", "set_key"),
        ("algorithm", "velocity", "set_key"),
        ("pv.tag", "IR2", "set_key"),
        ("proportional_gain", "x", "number_type"),
        ("setpoint", 1000, "set_value"),
        ("output", 51, "set_value"),
        ("setpoint.limits", 5, "pair_type"),
        ("autotune.type", "P", "choice"),
        ("anti_windup", "yes", "boolean_form"),
        ("proportional_gain", 0.004, "set_value"),
        ("autotune.timeout", 1.5, "number_type"),
        ("output.pulse.cycle_time", 6553.6, "set_value"),
    ],
)
def test_set_refuses_what_cannot_be_written(key, value, kind):
    with pytest.raises(PydanticCustomError) as caught:
        plc(SCALED).check_set(0, tuple(key.split(".")), value)

    assert caught.value.type == kind


@pytest.mark.parametrize(
    ("key", "value", "ticks"),
    [
        ("sample_rate", "250 ms", 250_000),
        ("sample_rate", "50 ms", 50_000),
        ("sample_rate", "40 ms", 0),
        ("sample_rate", 0, 0),
        ("integral_time", 5, 0),
    ],
)
def test_the_sample_rate_that_an_event_sets_is_known_beforehand(key, value, ticks):
    machine = plc({})

    assert machine.new_period(0, (key,), machine.check_set(0, (key,), value)) == ticks


# --- with the runner -------------------------------------------------------------------------------------------------


def scenario(**given):
    return Scenario.model_validate({"pidcfg": 1, "scenario": "s", "config": "c", "duration": 1, **given})


@pytest.mark.parametrize(
    ("event", "message"),
    [
        ({"ramp_soak": "start"}, "this PLC has no ramp/soak"),
        ({"mode": "cascade"}, "'cascade' is no mode"),
        ({"autotune": "cancel"}, None),
        ({"mode": "auto"}, None),
    ],
)
def test_events_that_it_has(event, message):
    found = prepare_network(scenario(events=[{"at": 0, "loop": "L1", **event}]), plc({})).problems
    said = [p.message for p in found if p.severity == "error"]

    assert len(said) == (message is not None)
    assert all(str(message)[:12] in text for text in said)


def test_the_plc_stops_and_has_no_options():
    found = prepare_network(
        scenario(events=[{"at": 0, "plc": "stop"}, {"at": 0.5, "plc": "program"}]), plc({})
    ).problems
    assert ["program" in p.message for p in found if p.severity == "error"] == [True]
    assert plc_options(scenario(), Controller) == Options()
    refused = prepare_network(scenario(plc={"scan_time": 0.1}), plc({})).problems

    assert [p.path for p in refused if p.severity == "error"] == [("plc", "scan_time")]


def test_bits_and_modes_are_distinct():
    masks = [*FLAG_BITS.values(), *MODES.values()]
    pending = [bits.STOPPED, bits.PV_STALE, bits.OUTPUT_CUT, bits.NO_PAST, bits.REQUEST, bits.TUNE, bits.CV_HELD]

    assert all(sum(group) == _union(group) for group in (masks, pending))


def _union(masks):
    result = 0
    for mask in masks:
        result |= mask
    return result
