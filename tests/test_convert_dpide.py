"""Conversion of DPIDE instructions: what every operand becomes, what every neutral field becomes, and both ways."""

from __future__ import annotations

from decimal import Decimal
from itertools import islice
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dpide_strategies import configurations
from pidcfg.conversion import ConvertError, json_value
from pidcfg.conversion.builder import to_dependent, to_independent
from pidcfg.conversion.dpide import (
    CALL_KEYS,
    DEAD_BAND_NOTE,
    HARMLESS_FIELDS,
    _free_registers,
    from_neutral,
    operations,
    to_neutral,
)
from pidcfg.conversion.operation import Manual
from pidcfg.conversion.pipeline import convert, neutral_loops
from pidcfg.encoders.dpide import CONVERT_OPTIONS
from pidcfg.encoders.dpide.image import encode
from pidcfg.schemas.dpide import DpideFile, Loop
from pidcfg.schemas.generic import GenericFile
from pidcfg.schemas.generic import Loop as NeutralLoop
from pidcfg.text.diagnostics import Severity
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

DPIDE = VENDORS["dpide"]
LOOP = {
    "name": "L1",
    "device": "D0",
    "SV": 50,
    "CYCLE": 200,
    "Kc_Kp": 2,
    "Ti_Ki": 30,
    "Td_Kd": 0,
    "PID_EQ": True,
    "PID_DIR": True,
    "PID_MODE": 2,
    "MV_MAX": 90,
    "MV_MIN": 10,
    "pv": {"range": [0, 200]},
    "output": {"range": [0, 100]},
}
NEUTRAL = {
    "name": "L1",
    "output_raises_pv": True,
    "sample_time": 0.2,
    "tuning": {"gain": 2, "integral_time": 30},
    "pv": {"range": [0, 200]},
    "setpoint": {"value": 50},
    "output": {"range": [0, 100]},
}
FULL = {
    **LOOP,
    "description": "Oven",
    "devices": {"SV": "D900"},
    "PID_RUN": True,
    "PV": 20,
    "PID_MAN": True,
    "MOUT_AUTO": True,
    "Td_Kd": 4,
    "Tf": 1,
    "PID_DE": True,
    "ERR_DBW": 0.5,
    "MOUT": 20,
    "BIAS": 5,
    "call": {"EN": "M1", "function_block": "AS_DPIDE", "timer": "T0", "GPWM": {"cycle": 4000, "output": "Y0.1"}},
    "pv": {"range": [0, 200], "unit": "degC"},
    "output": {"range": [0, 100], "unit": "%"},
}


def dpide(*loops: dict[str, Any], **file: Any) -> DpideFile:
    """A DPIDE file of loops that differ from a plain one."""
    entries = [{**LOOP, "name": f"L{i}", "device": f"D{30 * i}", **loop} for i, loop in enumerate(loops, start=1)]
    return DpideFile.model_validate({"pidcfg": 1, "vendor": "dpide", **file, "loops": entries})


def generic(*loops: dict[str, Any]) -> GenericFile:
    """A neutral file of loops that differ from a plain one."""
    entries = [{**NEUTRAL, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


def neutral(loop: dict[str, Any], **file: Any) -> NeutralLoop:
    """The neutral loop of a DPIDE instruction."""
    return neutral_loops(dpide(loop, **file), DPIDE)[0].loops[0]


def notes(loop: dict[str, Any], **file: Any) -> dict[str, str]:
    """What is said of each operand."""
    return {field.path: field.note for field in to_neutral(dpide(loop, **file))[0].fields}


def lost(loop: dict[str, Any]) -> set[str]:
    """The operands that go nowhere."""
    return {field.path for field in to_neutral(dpide(loop))[0].fields if not field.neutral}


def one(loop: dict[str, Any], **options: Any) -> Loop:
    """The DPIDE instruction of a neutral loop."""
    return DpideFile.model_validate(from_neutral(generic(loop), options).data).loops[0]


def dropped(loop: dict[str, Any]) -> set[str]:
    """The neutral fields that find no place."""
    return {put.neutral or "" for put in from_neutral(generic(loop), {}).fields[0] if not put.path}


def changes(config: DpideFile) -> dict[str, Any]:
    """The report of a conversion to DPIDE itself, by the source's fields, of the first loop."""
    return {change.field: change for change in convert(config, DPIDE, DPIDE, {}).loops[0][1]}


# --- to the neutral loop ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("raises", [True, False])
def test_forward_is_heating(raises):
    assert neutral({"PID_DIR": raises}).output_raises_pv is raises
    assert one({"output_raises_pv": raises}).PID_DIR is raises


def test_dependent_gains_are_the_neutral_ones():
    tuning = neutral({"Kc_Kp": 2, "Ti_Ki": 30, "Td_Kd": 4, "Tf": 0.5, "PID_DE": True}).tuning
    assert (tuning.gain, tuning.integral_time, tuning.derivative_time) == (2, 30, 4)
    assert (tuning.derivative_on, tuning.derivative_filter, tuning.proportional) == ("pv", Decimal("0.5"), True)
    assert neutral({"Td_Kd": 4, "PID_DE": False}).tuning.derivative_on == "error"


def test_independent_gains_become_times():
    tuning = neutral({"PID_EQ": False, "Kc_Kp": 4, "Ti_Ki": 0.5, "Td_Kd": 6}).tuning
    assert (tuning.gain, tuning.integral_time, tuning.derivative_time) == (4, 8, Decimal("1.5"))


def test_without_a_proportional_action_the_gain_stands_before_the_others():
    tuning = neutral({"PID_EQ": False, "Kc_Kp": 0, "Ti_Ki": 0.5, "Td_Kd": 6}).tuning
    assert tuning.proportional is False
    assert tuning.gain / tuning.integral_time == Decimal("0.5")
    assert tuning.gain * tuning.derivative_time == 6


@pytest.mark.parametrize(
    ("gains", "terms"),
    [
        ((0, 0, 0), (0, 0, 0, True)),
        ((0, 5, 0), (1, "0.2", 0, False)),
        ((0, 0, 8), (1, 0, 8, False)),
        ((0, 5, 8), (1, "0.2", 8, False)),
        ((4, 0, 0), (4, 0, 0, True)),
        ((4, 5, 0), (4, "0.8", 0, True)),
        ((4, 0, 8), (4, 0, 2, True)),
        ((4, 5, 8), (4, "0.8", 2, True)),
    ],
)
def test_independent_gains_are_terms_behind_one_gain_which_is_1_without_a_proportional_action(gains, terms):
    """Ti = Kp / Ki and Td = Kd / Kp; a dead controller stays dead."""
    assert to_dependent(*map(Decimal, gains)) == (*map(Decimal, terms[:3]), terms[3])
    tuning = neutral({"PID_EQ": False, **dict(zip(("Kc_Kp", "Ti_Ki", "Td_Kd"), gains, strict=True))}).tuning
    assert (tuning.gain, tuning.proportional) == (terms[0], terms[3])


BELOW_0 = "what is below 0 counts as 0"
NO_RANGE = "no output.range is given: MV_MIN and MV_MAX are taken for 0 % and 100 %"
SWAPPED = "MV_MIN is above MV_MAX: the PLC swaps them"


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ({"Kc_Kp": 0.5}, {"Kc_Kp": ("0.5", "tuning.gain", "", "0.5")}),
        ({"Kc_Kp": -0.5}, {"Kc_Kp": ("-0.5", "tuning.gain", BELOW_0, 0)}),
        ({"Ti_Ki": 0.5}, {"Ti_Ki": ("0.5", "tuning.integral_time", "", "0.5")}),
        ({"Ti_Ki": -0.5}, {"Ti_Ki": ("-0.5", "tuning.integral_time", BELOW_0, 0)}),
        ({"Td_Kd": 0.5}, {"Td_Kd": ("0.5", "tuning.derivative_time", "", "0.5")}),
        ({"Td_Kd": -0.5}, {"Td_Kd": ("-0.5", "tuning.derivative_time", BELOW_0, 0)}),
        ({"Tf": 0.5}, {"Tf": ("0.5", "tuning.derivative_filter", "", "0.5")}),
        ({"Tf": -0.5}, {"Tf": ("-0.5", "tuning.derivative_filter", BELOW_0, 0)}),
        ({"Tf": 0}, {"Tf": None}),
        ({"ERR_DBW": -0.5}, {"ERR_DBW": ("-0.5", "deadband", DEAD_BAND_NOTE, "0.5")}),
        ({"ERR_DBW": 0}, {"ERR_DBW": None}),
        ({"BIAS": -3}, {"BIAS": (-3, "output.bias", "", -3)}),
        ({"BIAS": 0}, {"BIAS": None}),
        ({"CYCLE": 0}, {"CYCLE": (0, "sample_time", "", "0.001")}),
        ({"CYCLE": 50_000}, {"CYCLE": (50_000, "sample_time", "", 40)}),
        ({"MOUT": 5}, {"MOUT": (5, "output.manual", "", 10)}),
        ({"MOUT": 95}, {"MOUT": (95, "output.manual", "", 90)}),
        (
            {"MV_MIN": 90, "MV_MAX": 10},
            {"MV_MIN": (90, "output.limits.1", SWAPPED, 90), "MV_MAX": (10, "output.limits.0", SWAPPED, 10)},
        ),
        ({"MV_MIN": 10}, {"MV_MIN": (10, "output.limits.0", "", 10), "MV_MAX": (90, "output.limits.1", "", 90)}),
        ({"output": {}}, {"output.range": (None, "output.range.0", NO_RANGE, 10)}),
        ({"PID_RUN": False, "MOUT": 0}, {"MOUT": None}),
        (
            {"PID_MODE": 0},
            {"PID_MODE": (0, "anti_windup", "DPIDE always holds its integral at the limits of MV", True)},
        ),
    ],
)
def test_each_operand_is_told_as_the_file_has_it_with_what_it_becomes(loop, told):
    (found,) = to_neutral(dpide(loop))
    lines = {field.path: field for field in found.fields}
    for path, row in told.items():
        if row is None:
            assert path not in lines
            continue
        value, neutral, note, becomes = row
        line = lines[path]
        assert (line.value, line.note) == (value if value is None else Decimal(value), note)
        assert neutral.removesuffix(".0") in {*line.neutral, *(name.removesuffix(".0") for name in line.neutral)}
        held = value_at(found.data, parse_path(neutral))
        assert held is becomes if becomes is True else Decimal(held) == Decimal(becomes)


def test_zero_is_off():
    tuning = neutral({"Ti_Ki": 0, "Td_Kd": 0}).tuning
    assert (tuning.integral_time, tuning.derivative_time) == (0, 0)


def test_what_is_below_zero_counts_as_zero():
    loop = {"Ti_Ki": -1, "Td_Kd": -2, "Tf": -3}
    tuning = neutral(loop).tuning
    assert (tuning.integral_time, tuning.derivative_time, tuning.derivative_filter) == (0, 0, 0)
    assert all("below 0" in notes(loop)[key] for key in loop)
    assert "below 0" not in notes(LOOP)["Ti_Ki"]


@pytest.mark.parametrize(("cycle", "time"), [(200, "0.2"), (0, "0.001"), (90_000, "40")])
def test_the_cycle_is_what_the_plc_counts(cycle, time):
    assert neutral({"CYCLE": cycle}).sample_time == Decimal(time)


def test_an_interrupt_task_has_the_say():
    assert neutral({}, plc={"interrupt_task": 50}).sample_time == Decimal("0.05")
    assert "50 ms" in notes({}, plc={"interrupt_task": 50})["CYCLE"]


def test_limits_are_not_the_scale():
    output = neutral({}).output
    assert (output.range, output.limits) == ((0, 100), (10, 90))
    config = dpide({"output": {}})
    assert neutral_loops(config, DPIDE)[0].loops[0].output.range == (10, 90)
    assert {field.path for field in to_neutral(config)[0].fields if field.assumed} == {"output.range"}


def test_swapped_limits_are_those_of_the_plc():
    output = neutral({"MV_MAX": 10, "MV_MIN": 90}).output
    assert output.limits == (10, 90)
    said = {entry.path: entry.neutral for entry in to_neutral(dpide({"MV_MAX": 10, "MV_MIN": 90}))[0].fields}
    assert (said["MV_MAX"], said["MV_MIN"]) == (("output.limits.0",), ("output.limits.1",))


def test_the_modes():
    assert neutral({}).mode == "auto"
    assert neutral({"PID_MAN": True, "MOUT": 30}).mode == "manual"
    assert neutral({"PID_MAN": True, "MOUT": 30}).output.manual == 30


@pytest.mark.parametrize(("low", "manual"), [(-10, 0), (10, 10), (-90, -5)])
def test_what_is_off_stays_off(low, manual):
    loop = {"PID_RUN": False, "MOUT": 80, "MV_MIN": low, "MV_MAX": -5 if low == -90 else 90}
    found = neutral(loop)
    assert (found.mode, found.output.manual) == ("manual", manual)
    assert "MOUT" in lost(loop)
    assert "MOUT" not in lost({**loop, "MOUT": 0})


def test_both_kinds_of_windup_protection_are_one():
    assert neutral({"PID_MODE": 0}).anti_windup
    assert changes(dpide({"PID_MODE": 0}))["PID_MODE"].kind == "assumed"
    assert changes(dpide({"PID_MODE": 2}))["PID_MODE"].kind == "exact"
    assert changes(dpide({"PID_MODE": 1}))["PID_MODE"].source == 1
    assert lost({"PID_MODE": 1}) == {"PID_MODE"}


def test_the_dead_band_counts_without_its_sign():
    assert neutral({"ERR_DBW": -0.5}).deadband == Decimal("0.5")


@pytest.mark.parametrize(
    ("loop", "path", "text"),
    [({"pv": {}}, (), "add pv.range"), ({"MV_MAX": 5, "MV_MIN": 5}, ("MV_MAX",), "MV_MAX and MV_MIN")],
)
def test_what_is_missing_is_asked_for(loop, path, text):
    found = to_neutral(dpide({}, loop))
    assert [entry.path for entry in found[1].missing] == [("loops", 1, *path)]
    assert text in found[1].missing[0].message
    assert found[0].missing == []
    with pytest.raises(ConvertError, match="L1"):
        convert(dpide(loop), DPIDE, DPIDE, {})
    first, second = convert(dpide({}, loop), DPIDE, DPIDE, {}).loops
    assert (first.status, second.status, second.changes) == ("converted", "dropped", ())
    assert text in second.reason


OUTER = {"name": "OUT", "device": "D60", "devices": {"MV": "D100"}, "MV_MAX": 150, "output": {"range": [0, 150]}}


def cascade(**devices: str) -> list[Any]:
    """The neutral loops of an instruction whose MV stands in operands of the next one."""
    return to_neutral(dpide(OUTER, {"devices": devices}))


def test_a_set_point_in_the_device_of_an_mv_is_a_cascade():
    outer, inner = (found.data for found in cascade(SV="D100"))
    assert (inner["setpoint"], inner["mode"]) == ({"value": 50, "source": "OUT"}, "cascade")
    assert outer["output"]["range"] == (0, 200)
    assert (outer["output"]["limits"], outer["tuning"]["gain"], outer["mode"]) == ([10, 150], 2, "auto")
    (line,) = (field for field in cascade(SV="D100")[0].fields if field.path == "output.range")
    assert (line.assumed, line.note) == (True, "0 % and 100 % of the PV of L2, whose set point it is")


def test_the_slave_of_a_cascade_may_be_in_manual():
    _, inner = to_neutral(dpide(OUTER, {"devices": {"SV": "D100"}, "PID_MAN": True}))
    assert (inner.data["mode"], inner.data["setpoint"]["source"]) == ("manual", "OUT")


@pytest.mark.parametrize("operand", ["BIAS", "MOUT"])
def test_another_operand_in_the_device_of_an_mv_is_dropped_with_advice(operand):
    _, inner = cascade(**{operand: "D100"})
    (line,) = (field for field in inner.fields if field.path == f"devices.{operand}")
    assert not line.neutral
    assert line.note.startswith("MV of OUT stands there: ")
    assert (inner.data["mode"], inner.data["output"]["bias"]) == ("auto", 0)


@pytest.mark.parametrize(
    ("devices", "manual"),
    [
        ({"MV": "D100", "MOUT": "D100"}, Manual.STAYS),
        ({"MV": "D100", "MOUT": "D102"}, Manual.JUMPS),
        ({"MOUT": "D102"}, Manual.JUMPS),
        ({}, Manual.JUMPS),
    ],
)
def test_the_output_stays_in_manual_where_mout_has_the_device_of_mv(devices, manual):
    (rules,) = operations(dpide({"devices": devices, "MOUT_AUTO": False}))
    assert rules.manual is manual


def test_devices_of_one_operand_are_told_by_their_names():
    assert json_value({"MV": "D100", "number": Decimal("1.50")}) == "MV: D100, number: 1.5"


def test_a_device_that_no_mv_stands_in_links_nothing():
    outer, inner = cascade(SV="D102", PID_RUN="M1")
    assert (inner.data["setpoint"], inner.data["mode"]) == ({"value": 50}, "auto")
    assert outer.data["output"]["range"] == (0, 150)


def test_a_set_point_that_loops_share_is_lost_by_all_but_the_first():
    first, second = to_neutral(dpide({**OUTER, "devices": {"SV": "D300"}}, {"devices": {"SV": "D300"}}))
    shared = [[field for field in loop.fields if field.path == "devices.SV"] for loop in (first, second)]
    assert shared[0] == []
    (line,) = shared[1]
    assert (line.neutral, line.value) == ((), "D300")
    assert line.note == "SV of OUT is there, too: whoever writes one of the two set points must write both"
    assert (second.data["setpoint"], second.data["mode"]) == ({"value": 50}, "auto")


def test_every_operand_is_spoken_of():
    config = dpide(FULL)
    unneeded = {key for key, why in HARMLESS_FIELDS.items() if not why.startswith(("0: ", "of no effect "))}
    spoken = {field.path for field in to_neutral(config)[0].fields} | unneeded
    leaves = {name for name in Loop.model_fields if name not in {"pv", "output", "call"}} | set(CALL_KEYS)
    assert leaves | {"pv.range", "pv.unit", "output.range", "output.unit"} <= spoken
    assert set(FULL) >= set(Loop.model_fields)
    assert lost(FULL) == set(CALL_KEYS)
    assert lost({key: value for key, value in FULL.items() if key != "call"}) == set()


# --- from the neutral loop -------------------------------------------------------------------------------------------


def test_a_plain_loop_is_of_the_dependent_form():
    loop = one({"tuning": {"gain": 3, "integral_time": 20, "derivative_time": 2, "derivative_filter": 0.4}})
    assert (loop.PID_EQ, loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd, loop.Tf) == (True, 3, 20, 2, Decimal("0.4"))
    assert (loop.PID_DE, loop.PID_MODE, loop.PID_MAN, loop.MV_MIN, loop.MV_MAX) == (True, 2, False, 0, 100)
    assert (loop.SV, loop.CYCLE, loop.pv.range, loop.output.range) == (50, 200, (0, 200), (0, 100))


def test_a_loop_without_a_proportional_action_is_independent():
    loop = one({"tuning": {"gain": 3, "integral_time": 20, "derivative_time": 2, "proportional": False}})
    assert (loop.PID_EQ, loop.Kc_Kp, loop.Ti_Ki, loop.Td_Kd) == (False, 0, Decimal("0.15"), 6)
    off = one({"tuning": {"gain": 3, "integral_time": "off", "derivative_time": 2, "proportional": False}})
    assert off.Ti_Ki == 0


def test_what_else_there_is_goes_over():
    loop = one(
        {
            "mode": "manual",
            "deadband": 0.5,
            "anti_windup": False,
            "description": "Oven",
            "tuning": {"gain": 1, "derivative_on": "error"},
            "output": {"range": [0, 50], "limits": [5, 45], "bias": 3, "manual": 7, "unit": "%"},
        }
    )
    assert (True, Decimal("0.5"), 2, False) == (loop.PID_MAN, loop.ERR_DBW, loop.PID_MODE, loop.PID_DE)
    assert (loop.MV_MIN, loop.MV_MAX, loop.BIAS, loop.MOUT, loop.output.unit) == (5, 45, 3, 7, "%")
    assert loop.description == "Oven"


@pytest.mark.parametrize(("raises", "value"), [(True, 0), (False, 200)])
def test_without_a_set_point_the_output_is_least(raises, value):
    assert value == one({"setpoint": {}, "output_raises_pv": raises}).SV
    made = from_neutral(generic({"setpoint": {}}), {})
    assert [put.neutral for put in made.fields[0] if put.path == "SV"] == [None]


WHOLE, IN_LIMITS = "CYCLE is whole milliseconds", "CYCLE is 1 to 40000 ms"


@pytest.mark.parametrize(
    ("time", "cycle", "clamped", "note"),
    [
        (0.2, 200, False, ""),
        ("1.6 ms", 2, False, WHOLE),
        ("0.2 ms", 1, True, IN_LIMITS),
        ("0.999 ms", 1, True, IN_LIMITS),
        ("1 ms", 1, False, ""),
        (40, 40_000, False, ""),
        ("40000.4 ms", 40_000, True, IN_LIMITS),
        (60, 40_000, True, IN_LIMITS),
    ],
)
def test_the_cycle_is_whole_milliseconds_in_its_limits(time, cycle, clamped, note):
    made = from_neutral(generic({"sample_time": time}), {})
    put = next(put for put in made.fields[0] if put.path == "CYCLE")
    assert (made.data["loops"][0]["CYCLE"], put.clamped, put.note) == (cycle, clamped, note)


def test_a_rounded_cycle_is_reported():
    source, generic_vendor = generic({"sample_time": "1.6 ms"}), VENDORS["generic"]
    found = {change.field: change for change in convert(source, generic_vendor, DPIDE, {}).loops[0][1]}
    assert (found["sample_time"].kind, found["sample_time"].error_percent) == ("rounded", 25)


@pytest.mark.parametrize(
    ("loop", "path"),
    [
        ({"setpoint": {"value": 1, "limits": [0, 100]}}, {"setpoint.limits.0", "setpoint.limits.1"}),
        ({"setpoint": {"source": "L2"}}, {"setpoint.source"}),
        ({"pv": {"range": [0, 1], "filter": 2}}, {"pv.filter"}),
        ({"pv": {"range": [0, 1], "square_root": True}}, {"pv.square_root"}),
        ({"output": {"range": [0, 1], "max_rate": 2}}, {"output.max_rate"}),
        (
            {"output": {"range": [0, 1], "pulse": {"period": 2, "min_on": 1}}},
            {"output.pulse.period", "output.pulse.min_on"},
        ),
        (
            {"alarms": {"pv": {"low": 1, "high_high": 3}, "rate_of_change": 2}},
            {"alarms.pv.low", "alarms.pv.high_high", "alarms.rate_of_change"},
        ),
        ({}, set()),
    ],
)
def test_what_has_no_twin_is_dropped_with_advice(loop, path):
    assert dropped(loop) == path
    assert all(put.note for put in from_neutral(generic(loop), {}).fields[0] if not put.path)


SLAVE = {"name": "IN", "mode": "cascade", "setpoint": {"value": 5, "source": "L1"}, "pv": {"range": [0, 100]}}


@pytest.mark.parametrize(
    ("changes", "linked"),
    [
        ({}, True),
        ({"mode": "manual"}, True),
        ({"mode": "auto"}, False),  # its set point is its own for now
        ({"pv": {"range": [0, 50]}}, False),
        ({"setpoint": {"value": 5, "source": "NOBODY"}}, False),
        ({"setpoint": {"value": 5, "source": "IN"}}, False),
    ],
)
def test_a_cascade_becomes_one_device(changes, linked):
    made = from_neutral(generic({}, {**SLAVE, **changes}), {"device": ["D500"]})
    outer, inner = made.data["loops"]
    assert (outer.get("devices"), inner.get("devices")) == (
        ({"MV": "D530"}, {"SV": "D530"}) if linked else (None, None)
    )
    (mode,) = (put for put in made.fields[1] if put.neutral == "mode")
    assert mode.clamped is (not linked and changes.get("mode", "cascade") == "cascade")
    (source,) = (put for put in made.fields[1] if put.neutral == "setpoint.source")
    assert bool(source.path) is linked
    if not linked:
        assert source.note.startswith("move MV of ")


def test_slaves_of_one_loop_share_a_device_and_masters_do_not():
    loops = [{}, SLAVE, {**SLAVE, "name": "I2"}, {**SLAVE, "name": "I3", "setpoint": {"value": 5, "source": "I2"}}]
    made = from_neutral(generic(*loops), {"device": ["D29940", "D29970", "D0", "D31"]})
    assert [loop.get("devices") for loop in made.data["loops"]] == [
        {"MV": "D62"},
        {"SV": "D62"},
        {"SV": "D62", "MV": "D64"},
        {"SV": "D64"},
    ]
    found = check_document(read_document(yaml_text(made.data).encode(), "made.yaml")).findings
    assert [finding for finding in found if finding.severity is Severity.ERROR] == []


def test_a_cascade_is_linked_by_hand():
    made = from_neutral(generic({"mode": "cascade"}), {})
    put = next(put for put in made.fields[0] if put.neutral == "mode")
    assert (put.clamped, made.data["loops"][0]["PID_MAN"]) == (True, False)
    assert "link" in put.note


def test_blocks_stand_one_behind_the_other():
    made = from_neutral(generic({}, {}, {}), {})
    assert [loop["device"] for loop in made.data["loops"]] == ["D0", "D30", "D60"]
    placed = from_neutral(generic({}, {}), {"device": ["D500"]})
    assert [loop["device"] for loop in placed.data["loops"]] == ["D500", "D30"]
    assert [row.key for row in CONVERT_OPTIONS] == ["device"]


# --- both ways -------------------------------------------------------------------------------------------------------


def test_a_full_configuration_comes_back_as_it_was():
    config = dpide({**FULL, "devices": {}, "MOUT_AUTO": False})
    made = convert(config, DPIDE, DPIDE, {"device": ["D30"]})
    assert not made.has_losses
    back = DpideFile.model_validate(made.data)
    assert dict(encode(back).image.words) == {
        key: value for key, value in encode(config).image.words.items() if key != "L1.PV"
    }
    found = check_document(read_document(yaml_text(made.data).encode(), "made.yaml")).findings
    assert [finding for finding in found if finding.severity is Severity.ERROR] == []


def near(a: Any, b: Any) -> bool:
    """Whether two neutral values differ by no more than single precision makes of them."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(near(a[key], b[key]) for key in a)
    if isinstance(a, tuple):
        return all(near(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Decimal):
        return abs(a - b) <= Decimal("4e-7") * max(abs(a), abs(b))
    return bool(a == b)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(configurations())
def test_any_configuration_is_asked_about_or_is_a_neutral_one(config):
    for i, found in enumerate(to_neutral(config)):
        loop = config.loops[i]
        assert bool(found.missing) == (loop.pv.range is None or loop.MV_MAX == loop.MV_MIN)
        if not found.missing:
            data = {"pidcfg": 1, "vendor": "generic", "loops": [found.data]}
            assert GenericFile.model_validate(data).loops[0].output_raises_pv is loop.PID_DIR


VALUES = st.decimals("0.01", "500", places=2)
LOOPS = st.fixed_dictionaries(
    {
        "SV": VALUES,
        "CYCLE": st.integers(1, 40_000),
        "Kc_Kp": VALUES | st.just(0),
        "Ti_Ki": VALUES | st.just(0),
        "Td_Kd": VALUES | st.just(0),
        "Tf": VALUES | st.just(0),
        "PID_EQ": st.booleans(),
        "PID_DE": st.booleans(),
        "PID_DIR": st.booleans(),
        "PID_MAN": st.booleans(),
        "ERR_DBW": VALUES | st.just(0),
        "BIAS": VALUES,
        "MOUT": VALUES,
        "PID_MODE": st.sampled_from([0, 2]),
    },
    optional={"output": st.just({})},
)


@settings(max_examples=150, deadline=None)
@given(LOOPS)
def test_a_conversion_to_itself_keeps_the_loop(loop):
    config = dpide(loop)
    before = neutral_loops(config, DPIDE)[0].loops[0]
    made = convert(config, DPIDE, DPIDE, {})
    after = neutral_loops(DpideFile.model_validate(made.data), DPIDE)[0].loops[0]
    assert not made.has_losses
    assert near(before.model_dump(), after.model_dump())


@given(VALUES, VALUES | st.just(Decimal(0)), VALUES | st.just(Decimal(0)))
def test_the_two_forms_are_each_other_s_way_back(kp, ki, kd):
    gain, integral, derivative, acts = to_dependent(kp, ki, kd)
    back = to_independent(gain, integral, derivative)
    assert acts
    assert near((kp, ki, kd), (gain, *back))


@pytest.mark.parametrize(
    ("blocks", "registers"),
    [
        ([0], ["D30", "D32"]),
        ([30, 0], ["D60", "D62"]),
        ([29968], ["D29998", "D0"]),
        ([29969], ["D0", "D2"]),
        ([29970], ["D0", "D2"]),
        ([0, 29970], ["D30", "D32"]),
        ([1, 29970], ["D32", "D34"]),
        ([3, 35, 29970], ["D0", "D66"]),
    ],
)
def test_a_cascade_gets_two_registers_behind_all_blocks_then_in_front_of_and_between_them(blocks, registers):
    """A block of I_MV has 30 registers; the last is D29999. D33 and D34 are free, but no pair from an even one on."""
    assert [*islice(_free_registers(blocks), 2)] == registers


# --- the derivative's kick -------------------------------------------------------------------------------------------

KICKING = {"PID_MODE": 2, "PID_DE": False, "Td_Kd": 20, "Tf": 0}


def windup_notes(loop: dict[str, Any], target: str = "nextopid") -> list[str]:
    """What the report says of the integral at a limit."""
    changes = convert(dpide({**LOOP, **loop}), DPIDE, VENDORS[target], {"sample_time": Decimal(1)}).loops[0].changes
    return [change.note for change in changes if change.field == "operation.windup"]


def test_a_kick_that_goes_into_the_integral_is_named():
    assert windup_notes(KICKING) == [
        (
            "a kick of the derivative that a limit cuts off goes into the source's integral: "
            "after a step of the set point the PV goes another way"
        )
    ]


@pytest.mark.parametrize("other", [{"PID_MODE": 0}, {"PID_DE": True}, {"Td_Kd": 0}])
def test_without_such_a_kick_nothing_is_said_of_it(other):
    assert windup_notes({**KICKING, **other}) == [""]


def test_within_the_vendor_the_call_is_kept():
    config = dpide(FULL)
    result = convert(config, DPIDE, DPIDE, {})
    assert DpideFile.model_validate(result.data).loops[0].call == config.loops[0].call
    kinds = {change.field: change.kind for change in result.loops[0].changes if change.field in CALL_KEYS}
    assert kinds == dict.fromkeys(CALL_KEYS, "exact")


@pytest.mark.parametrize("field", CALL_KEYS)
def test_what_stands_around_the_instruction_is_named_elsewhere(field):
    changes = convert(dpide(FULL), DPIDE, VENDORS["ezlogix"], {}).loops[0].changes
    (line,) = [change for change in changes if change.field == field]
    assert (line.kind, line.note) == ("dropped", CALL_KEYS[field])


def test_what_a_dead_band_does_is_told_of_a_loop_that_has_one():
    assert changes(dpide({"ERR_DBW": 0.5}))["ERR_DBW"].note == DEAD_BAND_NOTE
    assert DEAD_BAND_NOTE not in [line.note for line in changes(dpide({"ERR_DBW": 0})).values()]
