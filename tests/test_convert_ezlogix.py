"""EZLogix loops to the neutral loop and back: the action, gains in counts per count, times, cascades by tags."""

from __future__ import annotations

import json
from decimal import Decimal
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

import ezlogix_strategies
import neutral_strategies
from ezlogix_strategies import configurations
from nested import merged
from neutral_strategies import leaves, neutral_files, unheard
from pidcfg import api
from pidcfg.conversion import ConvertError
from pidcfg.conversion.ezlogix import HARMLESS_FIELDS, from_neutral, stopped_section, to_neutral
from pidcfg.conversion.operation import Stopped
from pidcfg.conversion.pipeline import convert, fit_to_registers
from pidcfg.encoders.ezlogix import CONVERT_OPTIONS
from pidcfg.encoders.ezlogix.image import encode
from pidcfg.schemas.ezlogix import EzlogixFile, Loop
from pidcfg.schemas.generic import GenericFile
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples" / "ezlogix"
EZLOGIX = VENDORS["ezlogix"]
PLAIN = {
    "name": "L1",
    "registers": "R1",
    "discretes": "S1",
    "mode": "auto",
    "algorithm": "position",
    "action": "reverse",
    "sample_rate": 0.5,
    "tuning": {"proportional_gain": 2.5, "integral_time": 30},
    "pv": {"tag": "IR1", "range": [0, 200]},
    "setpoint": {"value": 50},
    "output": {"tag": "OR1", "range": [0, 50]},
}
NEUTRAL = {
    "name": "L1",
    "output_raises_pv": True,
    "sample_time": 0.5,
    "tuning": {"gain": 0.5, "integral_time": 30},
    "pv": {"range": [0, 200]},
    "setpoint": {"value": 50},
    "output": {"range": [0, 50]},
}
EVERYTHING = PLAIN | ezlogix_strategies.EVERYTHING


def ezlogix(*loops: dict, **plc) -> EzlogixFile:
    """An EZLogix file of loops that differ from a plain one; a section is merged with that of the plain one."""
    entries = [
        merged({**PLAIN, "name": f"L{i}", "registers": f"R{32 * i}", "discretes": f"S{8 * i}"}, loop)
        for i, loop in enumerate(loops, start=1)
    ]
    return EzlogixFile.model_validate({"pidcfg": 1, "vendor": "ezlogix", "plc": plc, "loops": entries})


def generic(*loops: dict) -> GenericFile:
    """A neutral file of loops that differ from a plain one."""
    entries = [merged({**NEUTRAL, "name": f"L{i}"}, loop) for i, loop in enumerate(loops, start=1)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


def neutral(*loops: dict):
    """The last neutral loop of EZLogix loops."""
    found = to_neutral(ezlogix(*loops))
    assert [loop.missing for loop in found] == [[]] * len(loops)
    data = {"pidcfg": 1, "vendor": "generic", "loops": [loop.data for loop in found]}
    return GenericFile.model_validate(data).loops[-1]


def lost(*loops: dict, **plc) -> dict[str, str]:
    """What the last EZLogix loop loses, by field, with the advice."""
    return {field.path: field.note for field in to_neutral(ezlogix(*loops, **plc))[-1].fields if not field.neutral}


def one(loop: dict, **options) -> Loop:
    """The EZLogix loop of a neutral one."""
    return EzlogixFile.model_validate(from_neutral(generic(loop), options).data).loops[0]


def dropped(loop: dict, **options) -> dict[str, str]:
    """The neutral fields that find no place, with the advice."""
    return {put.neutral: put.note for put in from_neutral(generic(loop), options).fields[0] if not put.path}


def stored(loop: dict) -> dict:
    """What the registers hold of each field of a converted loop."""
    return fit_to_registers(from_neutral(generic(loop), {}), EZLOGIX)[0]


# --- action and gains ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("action", "raises"), [("reverse", True), ("direct", False)])
def test_the_action_is_that_of_the_controller(action, raises):
    assert neutral({"action": action}).output_raises_pv is raises
    assert one({"output_raises_pv": raises}).action == action


@pytest.mark.parametrize(
    ("pv", "counts", "output", "gain"),
    [
        ([0, 200], None, [0, 50], "0.625"),  # 2.5 * 50 / 200
        ([0, 200], [0, 4095], [0, 100], "1.25"),
        ([-50, 150], None, [4, 20], "0.2"),
        ([0, 200], [0, 8190], [0, 100], "2.5"),
        ([0, 200], [1000, 5095], [0, 100], "1.25"),
    ],
)
def test_a_gain_in_counts_per_count_is_one_in_units(pv, counts, output, gain):
    loop = {"pv": {"range": pv, **({"counts": counts} if counts else {})}, "output": {"range": output}}
    assert neutral(loop).tuning.gain == Decimal(gain)
    options = {"pv_counts": [tuple(counts)]} if counts else {}
    back = one({"tuning": {"gain": Decimal(gain)}, "pv": {"range": pv}, "output": {"range": output}}, **options)
    assert back.tuning.proportional_gain == Decimal("2.5")
    assert back.pv.counts == tuple(counts or (0, 4095))


def test_without_a_range_of_the_output_it_is_per_cent_and_that_is_said():
    loop = ezlogix({"output": {"range": None, "limits": [0, 2047.5 * 2]}})
    found = to_neutral(loop)[0]
    assert found.data["output"]["range"] == [0, 100]
    assert found.data["output"]["limits"] == [0, 100]
    assert found.data["output"]["unit"] == "%"
    assert found.data["tuning"]["gain"] == Decimal("1.25")
    assert {field.path for field in found.fields if field.assumed} == {"output.range", "output.unit"}
    assert neutral({}).output.unit is None
    assert neutral({"output": {"range": None, "unit": "Hz"}}).output.unit == "Hz"


@pytest.mark.parametrize(("counts", "ends"), [({}, "0 and 4095"), ({"counts": [800, 8000]}, "800 and 8000")])
def test_without_a_range_of_the_pv_the_key_is_asked_for(counts, ends):
    [missing] = to_neutral(ezlogix({"pv": {"range": None, **counts}}))[0].missing
    assert missing.path == ("loops", 0, "pv", "range")
    assert missing.message == f"add pv.range: [low, high], the engineering values at {ends} counts of the PV"


def test_gain_0_takes_the_proportional_term_out_and_counts_as_1():
    found = neutral({"tuning": {"proportional_gain": 0}}).tuning
    assert (found.proportional, found.gain) == (False, Decimal("0.25"))
    assert neutral({}).tuning.proportional is True


@pytest.mark.parametrize(("gain", "factor"), [("0.25", 1), ("0.5", 2), ("0.125", "0.5")])
def test_without_a_proportional_term_the_gain_goes_into_the_times(gain, factor):
    tuning = {"gain": Decimal(gain), "integral_time": 40, "derivative_time": 8, "proportional": False}
    back = one({"tuning": tuning}).tuning
    assert back.proportional_gain == 0
    assert back.integral_time == 40 / Decimal(factor)
    assert back.derivative_time == 8 * Decimal(factor)


def test_a_gain_of_0_leaves_no_term_at_all():
    back = one({"tuning": {"gain": 0, "integral_time": 40, "derivative_time": 8}}).tuning
    assert (back.proportional_gain, back.integral_time, back.derivative_time) == (0, 0, 0)


def test_times_of_0_are_off_both_ways():
    found = neutral({"tuning": {"integral_time": "off", "derivative_time": 0}}).tuning
    assert (found.integral_time, found.derivative_time) == (0, 0)
    back = one({"tuning": {"integral_time": 0, "derivative_time": 0}}).tuning
    assert (back.integral_time, back.derivative_time) == (0, 0)


@pytest.mark.parametrize(
    "tuning", [{"integral_time": Decimal("0.04")}, {"derivative_time": Decimal("0.04")}, {"gain": Decimal("0.001")}]
)
def test_a_value_that_would_round_to_off_is_refused(tuning):
    with pytest.raises(ConvertError, match="switches it off"):
        stored({"tuning": tuning})


def test_values_are_rounded_and_clamped_to_what_the_registers_hold():
    found = stored(
        {"sample_time": 200, "tuning": {"gain": 50, "integral_time": Decimal("33.33"), "derivative_time": 700}}
    )
    held = {key: (row.kind, row.value) for key, row in found.items() if key == "sample_rate" or "tuning" in key}
    assert held == {
        "sample_rate": ("clamped", 99.99),
        "tuning.proportional_gain": ("clamped", 99.99),
        "tuning.integral_time": ("rounded", 33.3),
        "tuning.derivative_time": ("clamped", 600),
    }


# --- derivative ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("algorithm", "acts_on"), [("position", "error"), ("velocity", "pv")])
def test_the_algorithm_says_what_the_derivative_acts_on(algorithm, acts_on):
    assert neutral({"algorithm": algorithm}).tuning.derivative_on == acts_on
    assert one({"tuning": {"derivative_time": 5, "derivative_on": acts_on}}).algorithm == algorithm


def test_without_a_derivative_the_algorithm_is_position():
    assert one({}).algorithm == "position"
    assert one({"tuning": {"derivative_time": 5}}).algorithm == "velocity"


def test_filters_are_programmed_by_hand():
    found = dropped({"pv": {"filter": 2}, "tuning": {"derivative_time": 5, "derivative_filter": 1}})
    assert set(found) == {"pv.filter", "tuning.derivative_filter"}
    assert "IR1" in found["pv.filter"]
    assert "2 s" in found["pv.filter"]
    assert "no derivative" in dropped({"tuning": {"derivative_filter": 1}})["tuning.derivative_filter"]
    assert dropped({}) == {}


# --- PV, set point and output ----------------------------------------------------------------------------------------


def test_quantities_in_counts_become_units():
    loop = {
        "setpoint": {"value": "2047.5 counts", "limits": ["0 counts", "4095 counts"]},
        "deadband": "409.5 counts",
        "output": {"range": [4, 20], "limits": ["1023.75 counts", 20], "offset": "2047.5 counts"},
    }
    found = neutral(loop)
    assert (found.setpoint.value, found.setpoint.limits, found.deadband) == (100, (0, 200), 20)
    assert (found.output.limits, found.output.bias) == ((8, 20), 12)
    live_zero = {"pv": {"counts": [1000, 5095]}, "setpoint": {"value": "3047.5 counts"}}
    assert neutral(live_zero).setpoint.value == 100


def test_the_set_point_of_a_square_root_loop_is_the_flow():
    found = neutral({"pv": {"square_root": True, "counts": [0, 4096]}, "setpoint": {"value": "32 counts"}})
    assert found.pv.square_root is True
    assert found.setpoint.value == 100  # half of the root of 4096
    assert one({"pv": {"square_root": True}}).pv.square_root is True


def test_limits_of_the_set_point():
    assert neutral({}).setpoint.limits is None
    assert "setpoint.limits" in lost({"setpoint": {"limits": [50, 50]}})
    [missing] = to_neutral(ezlogix({"setpoint": {"limits": [90, 10]}}))[0].missing
    assert missing.path == ("loops", 0, "setpoint", "limits")
    assert "90 and 10 do not ascend" in missing.message
    assert [q.value for q in one({"setpoint": {"limits": [10, 90]}}).setpoint.limits] == [10, 90]


def test_output_limits_that_do_not_ascend_must_be_mended_first():
    [missing] = to_neutral(ezlogix({"output": {"limits": [30, 30]}}))[0].missing
    assert missing.path == ("loops", 0, "output", "limits")


@pytest.mark.parametrize(
    ("span", "offset", "integral", "bias"),
    [([0, 50], "0 counts", 0, None), ([0, 50], 10, 30, 10), ([4, 20], "0 counts", 30, None), ([4, 20], 4, 0, 4)],
)
def test_the_offset_is_a_place_on_the_scale_of_the_output(span, offset, integral, bias):
    loop = {"output": {"range": span, "offset": offset}, "tuning": {"integral_time": integral}}
    assert to_neutral(ezlogix(loop))[0].data["output"].get("bias") == bias


@pytest.mark.parametrize(
    ("output", "integral", "offset", "counts"),
    [
        ({"range": [-50, 50], "bias": 0}, 60, 0, 2048),
        ({"range": [-50, 50]}, 60, None, 0),
        ({"range": [-50, 50]}, 0, 0, 2048),
        ({"range": [-50, 50], "bias": -50}, 0, -50, 0),
        ({"range": [0, 50]}, 0, None, 0),
        ({"range": [0, 50], "bias": 0}, 60, 0, 0),
        ({"range": [-50, 0], "bias": 0}, 60, 0, 4095),
        ({"range": [4, 20], "bias": 12}, 60, 12, 2048),
        ({"range": [4, 20], "bias": 0}, 60, None, 0),
        ({"range": [-20, -4], "bias": 0}, 60, None, 0),
    ],
)
def test_the_bias_becomes_the_offset_and_none_is_0_without_an_integral(output, integral, offset, counts):
    loop = {"output": output, "tuning": {"integral_time": integral}}
    made = from_neutral(generic(loop), {}).data
    assert made["loops"][0]["output"].get("offset") == offset
    kept = encode(EzlogixFile.model_validate(made))
    assert next(c.raw for c in kept.image.cells if c.field == "cv_offset") == counts


@pytest.mark.parametrize("given", [{}, {"BIAS": 0}])
def test_a_bias_of_0_that_an_output_of_4_to_20_does_not_have_is_a_loss(given):
    loop = {"name": "A", "device": "D500", "SV": 50, "CYCLE": 1000, "Kc_Kp": 0.3, "Ti_Ki": 0, "Td_Kd": 0}
    loop |= {"PID_EQ": True, "PID_DIR": True, "MV_MAX": 20, "MV_MIN": 4, "MOUT_AUTO": True, "pv": {"range": [0, 100]}}
    file = {"pidcfg": 1, "vendor": "dpide", "loops": [{**loop, "output": {"range": [4, 20], "unit": "mA"}, **given}]}
    for target, key in (("ezlogix", "output.offset"), ("click", "state.bias"), ("dl06", "state.bias")):
        result = api.convert(json.dumps(file), target)
        [line] = [line for entry in result.loops for line in entry.changes if line.target_field == key]
        assert (target, line.kind, line.loss) == (target, "clamped", True)


def test_a_bias_is_a_value_of_the_output():
    assert stored({"output": {"range": [4, 20], "bias": 12}})["output.offset"].kind == "exact"


@pytest.mark.parametrize(
    ("period", "min_on", "held"),
    [
        (10, 10, "9.9"),
        (10, "9.99", "9.9"),
        (10, "9.9", "9.9"),
        (600, 600, "599.8"),
        (600, "599.8", "599.8"),
        (10, 0, "0"),
    ],
)
def test_a_pulse_of_the_whole_cycle_still_switches_on(period, min_on, held):
    made = from_neutral(generic({"output": {"pulse": {"period": period, "min_on": Decimal(min_on)}}}), {})
    config = EzlogixFile.model_validate(made.data)
    assert config.loops[0].output.pulse.min_on == Decimal(held)
    found = check_document(read_document(yaml_text(made.data).encode(), "made.yaml")).findings
    assert "EZ467" not in {f.code for f in found}
    marks = [change for change in made.fields[0] if change.path == "output.pulse.min_on"]
    assert [change.clamped for change in marks] == ([Decimal(min_on) != Decimal(held)] if min_on else [])


@pytest.mark.parametrize("time", [6553.5, 6554, 1e28, 1e300])
def test_a_cycle_of_any_length_becomes_the_longest_that_a_register_holds_and_its_pulse_fits(time):
    """4095/4096 of 6553.5 s are 6551.9 s."""
    found = stored({"output": {"pulse": {"period": time, "min_on": time}}})
    held = [(found[f"output.pulse.{key}"].kind, found[f"output.pulse.{key}"].value) for key in ("cycle_time", "min_on")]
    assert held == [("exact" if time == 6553.5 else "clamped", 6553.5), ("rounded", 6551.9)]


def test_pulses():
    pulse = {"period": 10, "min_on": Decimal("0.5"), "min_off": Decimal("0.7")}
    found = neutral({"output": {"pulse": {"tag": "O3", "cycle_time": 10, "min_on": 0.5, "min_off": 0.7}}}).output.pulse
    assert dict(found) == pulse
    back = one({"output": {"pulse": pulse}}).output.pulse
    assert (back.tag, back.cycle_time, back.min_on, back.min_off) == ("O1", 10, Decimal("0.5"), Decimal("0.7"))
    assert one({"output": {"pulse": pulse}}, output_tag=[{"tag": "O9"}]).output.pulse.tag == "O9"
    assert one({}).output.pulse is None


def test_the_report_goes_down_the_file():
    fields = [field.path for field in to_neutral(ezlogix(EVERYTHING))[0].fields]
    assert fields[:5] == ["name", "description", "mode", "action", "sample_rate"]
    assert fields[-6:-2] == ["output.pulse.cycle_time", "output.pulse.min_on", "output.pulse.min_off", "anti_windup"]


def test_what_an_ezlogix_does_not_have_is_told():
    loop = {
        "output": {"manual": 25, "max_rate": 2},
        "alarms": {
            "pv": {"low_low": 10, "low": 20, "high": 100, "high_high": 150},
            "deviation": {"high": 5, "high_high": 9},
            "rate_of_change": 2,
            "hysteresis": 1,
        },
    }
    found = dropped(loop)
    assert set(found) == {
        "output.manual",
        "output.max_rate",
        "alarms.pv.low_low",
        "alarms.pv.low",
        "alarms.pv.high",
        "alarms.pv.high_high",
        "alarms.deviation.high",
        "alarms.deviation.high_high",
        "alarms.rate_of_change",
        "alarms.hysteresis",
    }
    assert "2048 counts into OR1" in found["output.manual"]
    assert "output.manual" not in dropped({"output": {"range": [4, 20], "manual": 4}})
    assert "IR1" in found["alarms.pv.high"]
    assert "above 2048 counts" in found["alarms.pv.high"]
    assert "below 410 counts" in found["alarms.pv.low"]
    assert "1000 counts" in dropped({"alarms": {"pv": {"high": 100}}}, pv_counts=[(0, 2000)])["alarms.pv.high"]


@pytest.mark.parametrize(
    ("root", "rate", "apart"),
    [(False, 4, ": 41 counts apart"), (False, 0.0001, ""), (True, 4, ""), (True, 0.0001, "")],
)
def test_a_rate_of_change_is_told_in_counts_a_sample_where_there_are_any(root, rate, apart):
    pv = {"range": [0, 200], "square_root": root}
    found = dropped({"pv": pv, "alarms": {"rate_of_change": rate}})["alarms.rate_of_change"]
    assert found == f"compare IR1 with what it was a sample before in the program{apart}"


@pytest.mark.parametrize(
    ("tag", "counts", "key", "point", "trips"),
    [
        ("IR1", 4095, "low", 0, False),
        ("IR1", 4095, "low_low", 0.5, False),
        ("IR1", 4095, "low", 1, True),
        ("IR1", 4095, "high", 4094, True),
        ("IR1", 4095, "high_high", 4095, False),
        ("IR1", 65535, "high", 65535, False),
        ("R9", 65535, "high", 65534, True),
        ("R9", 65535, "high", 65535, False),
        ("R9", 4095, "high", 4095, True),
        ("R9", 4095, "low_low", 0, False),
    ],
)
def test_a_point_that_no_content_of_the_pv_is_beyond_never_trips(tag, counts, key, point, trips):
    """An analog input holds 0 to 4095, a register 0 to 65535."""
    loop = {"pv": {"range": [0, counts]}, "alarms": {"pv": {key: point}}}
    note = dropped(loop, pv_tag=[tag], pv_counts=[(0, counts)])[f"alarms.pv.{key}"]
    side = f"{'above' if key.startswith('high') else 'below'} {round(point)} counts"
    assert note == (
        f"compare {tag} in the program: {side}"
        if trips
        else f"{tag} is never {side}, so that it never trips: nothing to program"
    )


def test_what_the_program_compares_is_in_the_counts_of_its_registers():
    wanted = {"pv": {"low": -5, "high": 250}, "deviation": {"high": 10}, "rate_of_change": 4, "hysteresis": 2}
    found = dropped({"pv": {"range": [0, 200], "unit": "degC"}, "alarms": wanted})
    assert "Error (Base+11) in the program: beyond 205 counts (10 degC)" in found["alarms.deviation.high"]
    assert found["alarms.hysteresis"].endswith("back by 41 counts")
    assert "counts apart" in found["alarms.rate_of_change"]
    for key in ("alarms.pv.low", "alarms.pv.high"):  # below 0 and above 4095 counts there is nothing
        assert "never trips" in found[key]
    always = dropped({"pv": {"range": [0, 200]}, "alarms": {"pv": {"low": 205, "high": 210}}})
    assert "compare IR1 in the program: below 4197 counts" in always["alarms.pv.low"]  # and not: it never trips
    live = {"pv": {"low": 10, "high": 100}, "deviation": {"high": 10}, "rate_of_change": 20, "hysteresis": 2}
    found = dropped({"pv": {"range": [0, 200]}, "alarms": live}, pv_counts=[(800, 4000)])  # 16 counts a unit
    ends = [found[f"alarms.{key}"].split(": ")[-1] for key in ("pv.low", "pv.high", "rate_of_change")]
    assert ends == ["below 960 counts", "above 2400 counts", "160 counts apart"]
    assert "beyond 160 counts (10)" in found["alarms.deviation.high"]
    assert found["alarms.hysteresis"].endswith("back by 32 counts")
    rooted = dropped({"pv": {"range": [0, 200], "unit": "m3/h", "square_root": True}, "alarms": wanted})
    assert "set point and PV in the program: 10 m3/h apart" in rooted["alarms.deviation.high"]
    assert rooted["alarms.hysteresis"].endswith("back by 2 m3/h")
    beyond = {"alarms": {"pv": {"high": 250}}, "pv": {"range": [0, 200]}}
    assert "above 5119 counts" in dropped(beyond, pv_tag=["R900"])["alarms.pv.high"]


def test_alarms_of_a_square_root_loop_are_compared_with_the_square():
    found = dropped({"pv": {"square_root": True}, "alarms": {"pv": {"high": 100}}})
    assert "above 1024 counts" in found["alarms.pv.high"]  # a quarter of 4095


def test_an_autotune_is_told():
    assert set(lost({"autotune": {"type": "PI", "timeout": 900}})) == {"autotune.type", "autotune.timeout"}
    assert set(lost({"autotune": {"type": "PID", "timeout": 600}})) == set()
    assert lost({}, process_when_stopped=False) == {}
    assert lost({}) == {}


# --- cascades --------------------------------------------------------------------------------------------------------


def test_a_cv_tag_that_is_a_set_point_is_a_cascade():
    outer, inner = {"output": {"tag": "R65"}}, {"mode": "auto"}
    found = neutral(outer, inner)
    assert (found.setpoint.source, found.mode) == ("L1", "cascade")
    assert neutral(outer, {"mode": "manual"}).mode == "manual"
    assert neutral({"output": {"tag": "R64"}}, inner).setpoint.source is None
    assert "registers" in lost(outer, {"pv": {"square_root": True}})
    assert "registers" in lost(outer, {"pv": {"counts": [0, 8000]}})


OUTER = {"output": {"range": NEUTRAL["pv"]["range"]}}
"""Its output is a set point of the inner loop, in the units of its PV."""


def test_a_source_of_the_set_point_becomes_the_other_loops_cv_tag():
    made = from_neutral(generic(OUTER, {"setpoint": {"source": "L1"}, "mode": "cascade"}), {})
    outer, inner = made.data["loops"]
    assert outer["output"]["tag"] == "R34"
    assert (inner["registers"], inner["mode"]) == ("R33", "auto")
    assert not [put for put in made.fields[1] if not put.path]
    back = to_neutral(EzlogixFile.model_validate(made.data))[1].data
    assert (back["setpoint"]["source"], back["mode"]) == ("L1", "cascade")


NO_CASCADE = "a loop has no cascade: the program writes its set point in auto"
ALWAYS_LINKED = "its set point is always the CV of the other loop"


@pytest.mark.parametrize(
    ("source", "mode", "written", "note"),
    [
        (None, "manual", "manual", ""),
        (None, "auto", "auto", ""),
        (None, "cascade", "auto", NO_CASCADE),
        ("elsewhere", "manual", "manual", ""),
        ("elsewhere", "auto", "auto", ""),
        ("elsewhere", "cascade", "auto", NO_CASCADE),
        ("L1", "manual", "manual", ""),
        ("L1", "auto", "auto", ALWAYS_LINKED),
        ("L1", "cascade", "auto", ""),
    ],
)
def test_the_mode_of_a_loop_is_told_with_what_becomes_of_its_cascade(source, mode, written, note):
    setpoint = {} if source is None else {"setpoint": {"source": source}}
    made = from_neutral(generic(OUTER, {"mode": mode, **setpoint}), {})
    assert made.data["loops"][1]["mode"] == written
    told = [(put.path, put.note, put.clamped) for put in made.fields[1] if put.neutral == "mode"]
    assert told == [("mode", note, bool(note))]


@pytest.mark.parametrize(
    ("inner", "options"),
    [
        ({"setpoint": {"source": "elsewhere"}}, {}),
        ({"setpoint": {"source": "L1"}, "pv": {"square_root": True}}, {}),
        ({"setpoint": {"source": "L1"}}, {"cv_tag": ["OR7"]}),
        ({"setpoint": {"source": "L1"}}, {"pv_counts": [(0, 8000)]}),
        ({"setpoint": {"source": "L1"}, "pv": {"range": [0, 777]}}, {}),
    ],
)
def test_a_cascade_that_no_tag_can_make_is_programmed(inner, options):
    made = from_neutral(generic(OUTER, inner), options)
    [put] = [put for put in made.fields[1] if put.neutral == "setpoint.source"]
    assert not put.path
    assert "R34" in put.note
    assert made.data["loops"][0]["output"]["tag"] == (options.get("cv_tag") or ["OR1"])[0]


def test_one_output_feeds_one_set_point():
    made = from_neutral(generic(OUTER, {"setpoint": {"source": "L1"}}, {"setpoint": {"source": "L1"}}), {})
    assert made.data["loops"][0]["output"]["tag"] == "R34"
    assert [put.neutral for put in made.fields[2] if not put.path] == ["setpoint.source"]


# --- places ----------------------------------------------------------------------------------------------------------


def places(file, **options):
    """Where blocks and tags of every loop are."""
    loops = EzlogixFile.model_validate(from_neutral(file, options).data).loops
    return [(loop.registers, loop.discretes, loop.pv.tag, loop.output.tag) for loop in loops]


def test_blocks_and_tags_follow_each_other():
    assert places(generic({}, {})) == [(1, 1, "IR1", "OR1"), (33, 9, "IR2", "OR2")]


def test_options_say_where_blocks_and_tags_are_and_the_rest_follows():
    options = {"registers": ["R100"], "discretes": ["S50", "S9"], "pv_tag": ["IR2"], "cv_tag": ["R1000"]}
    assert places(generic({}, {}), **options) == [(100, 50, "IR2", "R1000"), (132, 9, "IR1", "OR1")]


def test_options_are_read_as_people_write_them():
    rows = {row.key: row for row in CONVERT_OPTIONS}
    assert set(rows) == {"registers", "discretes", "pv_tag", "cv_tag", "output_tag", "pv_counts"}
    assert rows["pv_counts"].read("0-32767,819-4095") == [(0, 32767), (819, 4095)]
    assert rows["pv_counts"].read("0-99999") is None
    assert rows["pv_counts"].read("4095") is None


def test_options_that_do_not_fit_the_loops_are_refused():
    with pytest.raises(ConvertError, match="2 for 1"):
        places(generic({}), registers=["R1", "R100"])
    with pytest.raises(ConvertError, match="2 for 1"):
        places(generic({}), pv_tag=["IR1", "IR2"])
    with pytest.raises(ConvertError, match="2 ranges of counts for 3"):
        places(generic({}, {}, {}), pv_counts=[(0, 10), (0, 20)])
    with pytest.raises(ConvertError, match="R65535"):
        places(generic({}), registers=["R65510"])


# --- the whole -------------------------------------------------------------------------------------------------------


def test_every_field_is_said_or_known_to_be_none_of_anybodys_business():
    spoken = {field.path for field in to_neutral(ezlogix(EVERYTHING))[0].fields}
    assert leaves(ezlogix(EVERYTHING).loops[0]) - spoken <= set(HARMLESS_FIELDS)


def test_every_neutral_field_is_put_somewhere_or_dropped_by_name():
    file = generic({}, neutral_strategies.EVERYTHING)
    assert unheard(file, from_neutral(file, {}).fields[1]) == set()
    linear = merged(neutral_strategies.EVERYTHING, {"tuning": {"proportional": True, "derivative_time": 0}})
    file = generic({}, linear)
    assert unheard(file, from_neutral(file, {}).fields[1]) <= {"tuning.proportional"}


def cells(config: EzlogixFile) -> dict:
    """The settings in the registers of the loops, and what the dialog alone holds."""
    found = {(c.loop, c.field): c.raw for c in encode(config).image.cells if c.access == "setting"}
    for loop in config.loops:
        found |= {(loop.name, "action"): loop.action, (loop.name, "algorithm"): loop.algorithm}
        for aside in ("autotune_timeout", "tuning_type"):
            del found[loop.name, aside]
    return found


@settings(suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(configurations())
def test_there_and_back_are_the_same_registers(config):
    found = to_neutral(config)
    assume(not any(loop.missing for loop in found))
    file = GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": [n.data for n in found]})
    counts = [loop.pv.counts or (0, 4095) for loop in config.loops]
    made = from_neutral(file, {"pv_counts": counts})
    there, again = cells(config), cells(EzlogixFile.model_validate(made.data))
    for neutral_loop, loop, puts in zip(found, config.loops, made.fields, strict=True):
        gone = {field.path for field in neutral_loop.fields if not field.neutral}
        different = {key for (name, key), raw in there.items() if name == loop.name and again[name, key] != raw}
        if any(put.path == "output.pulse.min_on" and put.clamped for put in puts):  # the whole cycle: never on
            different -= {"min_on"}
        low, at, high = (there[loop.name, name] for name in ("setpoint_low", "setpoint", "setpoint_high"))
        given = loop.setpoint.value is not None and "setpoint.limits" not in gone
        if (
            given and low <= high and not low <= at <= high
        ):  # an error of its own (EZ438): the limit is what the PLC controls to
            assert again[loop.name, "setpoint"] == max(min(at, high), low)
            different -= {"setpoint"}
        assert different <= ({"setpoint_low", "setpoint_high"} if "setpoint.limits" in gone else set())


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_examples_come_back_with_the_same_registers(path):
    checked = check_document(read_document(path.read_bytes(), path.name))
    if checked.vendor is None:  # a scenario
        return
    counts = [loop.pv.counts or (0, 4095) for loop in checked.config.loops]
    made = convert(checked.config, EZLOGIX, EZLOGIX, {"pv_counts": counts})
    assert cells(EzlogixFile.model_validate(made.data)) == cells(checked.config)


def test_a_loop_with_everything_comes_back_whole():
    """So that the property test above cannot pass by skipping everything."""
    config = ezlogix(EVERYTHING)
    back = EzlogixFile.model_validate(convert(config, EZLOGIX, EZLOGIX, {}).data)
    assert cells(back) == cells(config)
    assert (back.loops[0].pv.unit, back.loops[0].output.unit, back.loops[0].description) == ("degC", "Hz", "An oven")


@settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])
@given(neutral_files())
@example(generic({"output": {"range": [0, 100], "limits": [0, 1], "pulse": {"period": 2, "min_on": 1}}}))
def test_what_is_made_has_no_errors_of_its_own(file):
    made = from_neutral(file, {})
    try:
        fit_to_registers(made, EZLOGIX)
    except ConvertError as error:
        assert "switches it off" in str(error)  # noqa: PT017 - only that may be refused
        return
    found = check_document(read_document(yaml_text(made.data).encode(), "made.yaml")).findings
    errors = {f.code for f in found if f.severity is Severity.ERROR}
    without_term = any(not (loop.tuning.proportional or loop.tuning.integral_time) for loop in file.loops)
    never_on = any(loop.output.pulse and longest_pulse(loop) < loop.output.pulse.min_on for loop in file.loops)
    assert errors <= ({"EZ424"} if without_term else set()) | ({"EZ467"} if never_on else set())


def longest_pulse(loop):
    """Of a neutral loop's discrete output at its high limit, in s, as 4095 of 4096 parts of its cycle have it."""
    low, high = loop.output.range
    top = loop.output.limits[1] if loop.output.limits else high
    return loop.output.pulse.period * int((top - low) / (high - low) * 4095 + Decimal("0.5")) / 4096


@settings(max_examples=60)
@given(st.booleans(), st.decimals("0.1", 20, places=2), st.sampled_from([(0, 100), (4, 20), (-5, 5)]))
def test_gain_and_action_survive_the_way_through_the_plc(raises, counts, span):
    gain = counts * (span[1] - span[0]) / 200
    loop = {"output_raises_pv": raises, "tuning": {"gain": gain}, "output": {"range": span}}
    made = from_neutral(generic(loop), {})
    assert made.data["loops"][0]["action"] == ("reverse" if raises else "direct")
    back = to_neutral(EzlogixFile.model_validate(made.data))[0].data
    assert (float(back["tuning"]["gain"]), back["output_raises_pv"]) == (pytest.approx(float(gain)), raises)


@pytest.mark.parametrize(("value", "held"), [(10, 20), (90, 80), (50, 50)])
def test_a_set_point_beyond_its_limits_becomes_the_limit_and_is_told(value, held):
    made = from_neutral(generic({"setpoint": {"value": value, "limits": [20, 80]}}), {})
    assert made.data["loops"][0]["setpoint"]["value"] == held
    (change,) = (change for loop in made.fields for change in loop if change.path == "setpoint.value")
    assert change.clamped is (held != value)


@pytest.mark.parametrize(
    ("stopped", "told"),
    [
        (Stopped.GOES_ON, "the dialog's check box"),
        (Stopped.STANDS, "clear the dialog's check box: its default is to go on"),
    ],
)
def test_the_check_box_of_a_stopped_plc_is_told_as_it_must_be(stopped, told):
    marks = []
    builder = SimpleNamespace(mark=lambda *words: marks.append(words))
    goes_on = stopped is Stopped.GOES_ON
    assert stopped_section([builder], [SimpleNamespace(stopped=stopped)]) == {"process_when_stopped": goes_on}
    assert marks == [("/plc.process_when_stopped", None, told)]
