"""Conversion of NextoPID programs: parameters, wires and blocks to the neutral loop, and a program of neutral loops."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from nextopid_networks import network
from nextopid_strategies import configurations
from pidcfg.conversion.builder import TargetBuilder
from pidcfg.conversion.nextopid import (
    HARMLESS_FIELDS,
    Names,
    bumpless_moves_of,
    common_step,
    from_neutral,
    task_of,
    to_neutral,
)
from pidcfg.conversion.pipeline import ConvertedFile, convert, neutral_loops
from pidcfg.encoders.nextopid import CONVERT_OPTIONS
from pidcfg.schemas.generic import GenericFile
from pidcfg.schemas.generic import Loop as NeutralLoop
from pidcfg.schemas.iec import IDENTIFIER
from pidcfg.schemas.nextopid import NextopidFile, Pida, PidaReal, PidaTuneReal, TuneParam
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import read_document
from pidcfg.text.writer import yaml_text
from pidcfg.validate.engine import check_document
from pidcfg.vendors import VENDORS

EXAMPLES = Path(__file__).parents[1] / "examples" / "nextopid"
NEXTOPID, GENERIC = VENDORS["nextopid"], VENDORS["generic"]
LOOP = {
    "name": "L1",
    "type": "PIDA_REAL",
    "SP": 50,
    "Kp": 2,
    "Ti_Ki": 30,
    "Td_Kd": 0,
    "MinMV": 10,
    "MaxMV": 90,
    "MinPV": 0,
    "MaxPV": 200,
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
SIGNALS = {"Raw": 12.5, "Run": True, "Halt": False, "Two": 2}
BLOCKS = [
    {"name": "F", "type": "ControlLowFilter", "InVar": "Raw", "Tc": 1.5},
    {"name": "D", "type": "ControlDelay", "InVar": "Two", "DelayTime": 1},
    {"name": "P", "type": "ControlPWM", "MV": "L1.MV", "MaxMV": 100, "Period": 50},
]


def nextopid(*loops: dict[str, Any], **file: Any) -> NextopidFile:
    """A NextoPID file of loops that differ from a plain one."""
    entries = [{**LOOP, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    data = {"pidcfg": 1, "vendor": "nextopid", "plc": {"sample_time": 0.1}, "signals": SIGNALS, **file}
    return NextopidFile.model_validate({**data, "loops": entries})


def generic(*loops: dict[str, Any]) -> GenericFile:
    """A neutral file of loops that differ from a plain one."""
    entries = [{**NEUTRAL, "name": f"L{i}", **loop} for i, loop in enumerate(loops, start=1)]
    return GenericFile.model_validate({"pidcfg": 1, "vendor": "generic", "loops": entries})


def neutral(*loops: dict[str, Any], **file: Any) -> NeutralLoop:
    """The neutral loop of the first of some NextoPID loops."""
    return neutral_loops(nextopid(*loops, **file), NEXTOPID)[0].loops[0]


def said(*loops: dict[str, Any], **file: Any) -> dict[str, Any]:
    """What is said of each parameter of the first loop."""
    return {entry.path: entry for entry in to_neutral(nextopid(*loops, **file))[0].fields}


def lost(*loops: dict[str, Any], **file: Any) -> dict[str, str]:
    """What of the first loop goes nowhere, with the advice."""
    return {field: entry.note for field, entry in said(*loops, **file).items() if not entry.neutral}


def made(*loops: dict[str, Any], **options: Any) -> ConvertedFile:
    """The NextoPID file of neutral loops."""
    return convert(generic(*loops), GENERIC, NEXTOPID, options)


def one(loop: dict[str, Any]) -> PidaReal:
    """The NextoPID loop of a neutral one."""
    found = NextopidFile.model_validate(made(loop).data).loops[0]
    assert isinstance(found, PidaReal)
    return found


def lost_of(converted: ConvertedFile) -> set[str]:
    """The fields that are lost in any loop."""
    return {change.field for loop in converted.loops for change in loop.changes if change.loss}


def report(converted: ConvertedFile, loop: int = 0) -> dict[str, Any]:
    """The changes of one loop, by field."""
    return {change.field: change for change in converted.loops[loop][1]}


def dropped(*loops: dict[str, Any]) -> set[str]:
    """The neutral fields of the first loop that find no place; all have an advice."""
    puts = [put for put in from_neutral(generic(*loops), {}).fields[0] if not put.path]
    assert all(put.note for put in puts)
    return {put.neutral or "" for put in puts}


def errors(data: dict[str, Any]) -> list[str]:
    """The rules that a file breaks."""
    found = check_document(read_document(yaml_text(data).encode(), "made.yaml")).findings
    return [f"{d.code} {d.message}" for d in found if d.severity is Severity.ERROR]


# --- the equation ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("direct", [True, False])
def test_direct_is_cooling(direct):
    assert neutral({"Direct": direct}).output_raises_pv is not direct
    assert one({"output_raises_pv": not direct}).Direct is direct


def test_dependent_gains_are_the_neutral_ones():
    tuning = neutral({"Kp": 2, "Ti_Ki": 30, "Td_Kd": 4, "Tfd": 0.5, "DerivEr": True}).tuning
    assert (tuning.gain, tuning.integral_time, tuning.derivative_time) == (2, 30, 4)
    assert (tuning.derivative_on, tuning.derivative_filter, tuning.proportional) == ("error", Decimal("0.5"), True)
    assert neutral({"Td_Kd": 4}).tuning.derivative_on == "pv"
    for acts_on, switch in (("error", True), ("pv", False)):
        assert one({"tuning": {"gain": 2, "derivative_time": 4, "derivative_on": acts_on}}).DerivEr is switch


def test_independent_gains_become_times():
    tuning = neutral({"Indep": True, "Kp": 4, "Ti_Ki": 0.5, "Td_Kd": 6, "DisableP": True}).tuning
    assert (tuning.gain, tuning.integral_time, tuning.derivative_time) == (4, 8, Decimal("1.5"))
    assert tuning.proportional


def test_a_gain_of_zero_is_no_proportional_action():
    tuning = neutral({"Indep": True, "Kp": 0, "Ti_Ki": 0.5, "Td_Kd": 6}).tuning
    assert not tuning.proportional
    assert (tuning.gain / tuning.integral_time, tuning.gain * tuning.derivative_time) == (Decimal("0.5"), 6)
    assert one({"tuning": tuning.model_dump()}).DisableP is True


def test_disabled_p_is_no_proportional_action():
    assert neutral({"DisableP": True}).tuning.proportional is False
    assert one({"tuning": {"gain": 3, "integral_time": 2, "proportional": False}}).DisableP is True


@pytest.mark.parametrize(("time", "integral"), [(0, 0), ("0.9 ms", 0), (0.001, Decimal("0.001"))])
def test_a_short_integral_time_is_off(time, integral):
    assert neutral({"Ti_Ki": time}).tuning.integral_time == integral
    assert ("no integral" in said({"Ti_Ki": time})["Ti_Ki"].note) is (time == "0.9 ms")


@pytest.mark.parametrize(("acts", "gain"), [(True, 2), (False, 0)])
def test_a_time_that_would_be_off_is_a_gain(acts, gain):
    loop = one({"tuning": {"gain": 2, "integral_time": 0.0005, "derivative_time": 3, "proportional": acts}})
    assert (loop.Indep, loop.Kp, loop.Ti_Ki, loop.Td_Kd, loop.DisableP) == (True, gain, 4000, 6, False)
    at_least = one({"tuning": {"gain": 2, "integral_time": 0.001}})
    assert (at_least.Indep, at_least.Ti_Ki) == (False, Decimal("0.001"))
    assert one({"tuning": {"gain": 1, "integral_time": "off"}}).Ti_Ki == 0


def test_a_rate_is_per_second_there_and_per_cycle_here():
    assert neutral({"MaxVarMV": 2, "sample_time": 0.5}).output.max_rate == 4
    assert one({"output": {"range": [0, 100], "max_rate": 4}}).MaxVarMV == Decimal("0.8")
    assert dropped({"output": {"range": [0, 100], "max_rate": 0}}) == {"output.max_rate"}


def test_the_dead_band_goes_over():
    assert neutral({"DeadBand": 3}).deadband == 3
    assert one({"deadband": 3}).DeadBand == 3


# --- PV, set point and output ----------------------------------------------------------------------------------------


def test_limits_of_mv_are_not_the_scale():
    output = neutral({"output": {"range": [0, 100], "unit": "%"}}).output
    assert (output.range, output.limits, output.unit) == ((0, 100), (10, 90), "%")
    assert neutral({}).output.range == (10, 90)
    assert said({})["output.range"].assumed
    assert not said({"output": {"range": [0, 100]}})["output.range"].assumed
    loop = one({"output": {"range": [0, 100], "limits": [10, 90], "unit": "%"}})
    assert (loop.MinMV, loop.MaxMV, loop.output.range, loop.output.unit) == (10, 90, (0, 100), "%")


def test_limits_of_pv_are_its_range():
    loop = neutral({"type": "PIDA_INT", "MinPV": 0, "MaxPV": 30000, "SP": 15000, "pv": {"unit": "raw"}})
    assert (loop.pv.range, loop.pv.unit, loop.setpoint.value, loop.tuning.gain) == ((0, 30000), "raw", 15000, 2)
    back = one({"pv": {"range": [-5, 60], "unit": "degC"}, "setpoint": {"value": 5}})
    assert (back.type, back.MinPV, back.MaxPV, back.pv.unit) == ("PIDA_REAL", -5, 60, "degC")


def test_set_point_limits_are_those_of_the_pv():
    assert dropped({"setpoint": {"value": 50, "limits": [0, 200]}}) == set()
    assert dropped({"setpoint": {"value": 50, "limits": [-10, 300]}}) == set()
    assert dropped({"setpoint": {"value": 50, "limits": [10, 200]}}) == {"setpoint.limits.0"}
    assert dropped({"setpoint": {"value": 50, "limits": [0, 190]}}) == {"setpoint.limits.1"}


@pytest.mark.parametrize(("raises", "value"), [(True, 0), (False, 200)])
def test_without_a_set_point_the_output_is_least(raises, value):
    converted = made({"setpoint": {}, "output_raises_pv": raises})
    assert converted.data["loops"][0]["SP"] == value
    assert report(converted)["SP"].kind == "assumed"


def test_bias_and_manual_output():
    loop = neutral({"BIAS": 4, "ManualMV": 30, "Manual": True})
    assert (loop.output.bias, loop.output.manual, loop.mode) == (4, 30, "manual")
    assert neutral({}).output.manual is None
    assert neutral({"Manual": True}).output.manual == 0
    back = one({"mode": "manual", "output": {"range": [0, 100], "bias": 4, "manual": 30}})
    assert (back.BIAS, back.ManualMV, back.Manual) == (4, 30, True)
    assert one({}).Manual is False
    unsaid = made({"mode": "manual", "output": {"range": [0, 100], "limits": [20, 90]}})
    assert (unsaid.data["loops"][0]["ManualMV"], report(unsaid)["ManualMV"].kind) == (20, "assumed")


def test_what_has_no_twin_is_dropped():
    found = dropped(
        {
            "pv": {"range": [0, 1], "square_root": True},
            "alarms": {"pv": {"low": 1}, "hysteresis": 2},
            "output": {"range": [0, 1], "pulse": {"period": 2, "min_on": 1, "min_off": 1}},
        }
    )
    pulses = {"output.pulse.min_on", "output.pulse.min_off"}
    assert found == {"pv.square_root", "alarms.pv.low", "alarms.hysteresis"} | pulses
    assert dropped({}) == set()


def test_the_blocks_do_not_wind_up():
    change = report(made({"anti_windup": False}))["anti_windup"]
    assert (change.kind, "never integrate" in change.note) == ("assumed", True)
    assert report(made({"anti_windup": True}))["anti_windup"].kind == "exact"


# --- wires -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "wire", "path", "value"),
    [
        ("Kp", "Two", "tuning.gain", 2),
        ("SP", "Two * 10 + 1", "setpoint.value", 21),
        ("Kp", "L2.Kp", "tuning.gain", 7),
        ("SP", "L2.SP", "setpoint.value", 8),
        ("SP", "max(abs(-3), sqrt(4), -Two)", "setpoint.value", 3),
        ("Manual", "Run", "mode", "manual"),
        ("Manual", "Halt", "mode", "auto"),
        ("Direct", "Run", "output_raises_pv", False),
        ("ManualMV", "min(Two, 1 / 4)", "output.manual", Decimal("0.25")),
    ],
)
def test_a_wired_setting_takes_its_first_value(key, wire, path, value):
    second = {"Kp": 7, "SP": "Two * 4"}
    found: Any = neutral({key: wire}, second)
    for step in path.split("."):
        found = getattr(found, step)
    assert found == value
    entry = said({key: wire}, second)[key]
    assert (entry.value, entry.assumed, wire in entry.note) == (wire, True, True)


@pytest.mark.parametrize("key", ["Kp", "Ti_Ki", "Td_Kd", "MinMV", "MaxMV", "MinPV", "MaxPV"])
def test_what_nobody_knows_is_asked_for(key):
    found = to_neutral(nextopid({}, {key: "L1.MV"}))[1]
    assert [entry.path for entry in found.missing] == [("loops", 1, key)]
    assert "L1.MV" in found.missing[0].message


@pytest.mark.parametrize("key", ["Direct", "Indep", "DisableP"])
def test_a_form_that_nobody_knows_is_asked_for(key):
    assert [entry.path[-1] for entry in to_neutral(nextopid({}, {key: "L1.TRK_OUT"}))[1].missing] == [key]


@pytest.mark.parametrize("key", ["SP", "ManualMV", "MaxVarMV", "DeadBand", "Tfd", "Manual", "CASC", "BIAS", "SP_CASC"])
def test_what_nobody_knows_is_dropped_where_the_loop_can_do_without(key):
    wire = "L2.TRK_OUT" if key in {"Manual", "CASC"} else "L2.MV * L2.MV"
    found = lost({key: wire}, {})
    assert key in found
    assert wire in found[key] or key in {"Manual", "CASC"}


@pytest.mark.parametrize("wire", ["(L1.MV - L1.MV)", "1 / (Two - Two)", "sqrt(-Two)"])
def test_what_cannot_be_calculated_is_not_known(wire):
    assert "SP" in lost({"SP": wire})


def test_a_ring_of_wires_has_no_value():
    ring = {"SP": "L2.SP"}, {"SP": "L1.SP"}
    assert "SP" in lost(*ring)
    shown = convert(nextopid(*ring), NEXTOPID, GENERIC, {}).data["loops"][0]
    assert shown["setpoint"] == {}  # the section is there to be filled in


IS_2 = "wired to Two, which is 2 at the start"
IS_TRUE = "wired to Run, which is TRUE at the start"
TO_MANUAL = "put the loop into manual in the program, with TRK_VAL as its output"


@pytest.mark.parametrize(
    ("loop", "told"),
    [
        ({"Kp": "Two"}, {"Kp": ("Two", "tuning.gain", IS_2)}),
        ({"Kp": 3}, {"Kp": (3, "tuning.gain", "")}),
        ({"Kp": "Two", "Indep": "Run"}, {"Kp": ("Two", "tuning.gain", IS_2), "Indep": ("Run", "tuning.gain", IS_TRUE)}),
        ({"Direct": "Run"}, {"Direct": ("Run", "output_raises_pv", IS_TRUE)}),
        (
            {"Direct": "Halt"},
            {"Direct": ("Halt", "output_raises_pv", IS_TRUE.replace("Run", "Halt").replace("TRUE", "FALSE"))},
        ),
        (
            {"DisableP": "Run", "Indep": True},
            {"DisableP": ("Run", "tuning.proportional", f"{IS_TRUE}; of no effect with Indep TRUE")},
        ),
        (
            {"DisableP": True, "Indep": True},
            {"DisableP": (True, "tuning.proportional", "of no effect with Indep TRUE")},
        ),
        ({"DisableP": True}, {"DisableP": (True, "tuning.proportional", "")}),
        ({"Ti_Ki": 0.0009}, {"Ti_Ki": (Decimal("0.0009"), "tuning.integral_time", "below 0.001 s: no integral")}),
        ({"Ti_Ki": 0.001}, {"Ti_Ki": (Decimal("0.001"), "tuning.integral_time", "")}),
        ({"Ti_Ki": 0}, {"Ti_Ki": (0, "tuning.integral_time", "")}),
        ({"MaxVarMV": "Two"}, {"MaxVarMV": ("Two", "output.max_rate", f"{IS_2}; per cycle here")}),
        ({"MaxVarMV": 4}, {"MaxVarMV": (4, "output.max_rate", "per cycle here")}),
        ({"MaxVarMV": "L1.MV"}, {"MaxVarMV": ("L1.MV", None, "L1.MV: limit the change of MV in the program")}),
        (
            {"DeadBand": "Two"},
            {"DeadBand": ("Two", "deadband", f"{IS_2}; while the error is smaller, MV is held here")},
        ),
        (
            {"DeadBand": "L1.MV"},
            {"DeadBand": ("L1.MV", None, "L1.MV: hold MV in the program while the error is small")},
        ),
        (
            {"Tfd": "Two - 2"},
            {"Tfd": ("Two - 2", "tuning.derivative_filter", "wired to Two - 2, which is 0 at the start")},
        ),
        ({"Tfd": "L1.MV"}, {"Tfd": ("L1.MV", None, "L1.MV: filter the derivative in the program")}),
        ({"Manual": "Run"}, {"Manual": ("Run", "mode", IS_TRUE)}),
        (
            {"Manual": "L1.TRK_OUT"},
            {"Manual": ("L1.TRK_OUT", None, "L1.TRK_OUT: switch in the program; it counts as FALSE")},
        ),
        ({"SP": "Two"}, {"SP": ("Two", "setpoint.value", IS_2)}),
        ({"SP": "L1.MV"}, {"SP": ("L1.MV", None, "L1.MV: work out the set point in the program")}),
        ({"ManualMV": "Two"}, {"ManualMV": ("Two", "output.manual", IS_2)}),
        ({"BIAS": "Two"}, {"BIAS": ("Two", None, "Two: a feed-forward: add it to the output in the program")}),
        ({"BIAS": 3}, {"BIAS": (3, "output.bias", "")}),
        (
            {"TRK_IN": "Run", "TRK_VAL": 33},
            {
                "TRK_IN": ("Run", None, f"Run: {TO_MANUAL}"),
                "TRK_VAL": (33, None, "where the output comes from meanwhile"),
            },
        ),
        ({"OVERR": True, "TRK_VAL": 33}, {"TRK_VAL": (33, None, "where the output comes from meanwhile")}),
        (
            {"TRK_IN": True, "ManualMV": 5},
            {
                "TRK_IN": (True, None, TO_MANUAL),
                "ManualMV": (5, None, "TRK_IN is on, so TRK_VAL is the output: write it in the program"),
            },
        ),
        ({"Windup_H_IN": True}, {"Windup_H_IN": (True, None, "hold the integral in the program")}),
        ({"Windup_L_IN": "Run"}, {"Windup_L_IN": ("Run", None, "Run: hold the integral in the program")}),
        (
            {"CASC": True, "SP_CASC": 60},
            {
                "SP_CASC": (60, "setpoint.value", ""),
                "SP": (
                    50,
                    None,
                    "cascade mode is on, so SP_CASC is the set point: switch between the two in the program",
                ),
            },
        ),
        (
            {"SP_CASC": 60},
            {"SP_CASC": (60, None, "a second set point, in force while CASC is TRUE: switch it in the program")},
        ),
        (
            {"CASC": True, "SP_CASC": "L1.PV"},
            {
                "SP_CASC": ("L1.PV", None, "L1.PV: the set point while CASC is TRUE: work it out in the program"),
                "CASC": (True, "setpoint.value", ""),
            },
        ),
        ({"CASC": True, "SP_CASC": 60, "Manual": True}, {"CASC": (True, "setpoint.value", "manual comes first")}),
        (
            {"PV": "Raw * 2"},
            {"PV": ("Raw * 2", None, "Raw * 2: work it out in the program and give it to the controller")},
        ),
        ({"PV": "Raw"}, {"PV": None}),
    ],
)
def test_each_parameter_is_told_with_what_it_is_wired_to_and_what_to_program_instead(loop, told):
    found = said(loop)
    lines = {key: found.get(key) for key in told}
    assert {
        key: line and (line.value, next(iter(line.neutral), None), line.note) for key, line in lines.items()
    } == told
    wired = {key for key, value in loop.items() if isinstance(value, str)}
    assert {key for key, line in lines.items() if line and line.assumed} == {
        key for key, row in told.items() if row and row[1] and key in wired
    }


def test_a_wired_bias_is_a_feed_forward():
    assert "Two * 3" in lost({"BIAS": "Two * 3"})["BIAS"]
    assert neutral({"BIAS": "Two * 3"}).output.bias == 0
    assert neutral({"BIAS": "(1 + 1)"}).output.bias == 2


def test_limits_without_room_are_asked_for():
    assert [entry.path[-1] for entry in to_neutral(nextopid({"MaxPV": 0}))[0].missing] == ["MaxPV"]
    assert [entry.path[-1] for entry in to_neutral(nextopid({"MaxMV": "Two"}))[0].missing] == ["MaxPV"]


# --- modes and cascades ----------------------------------------------------------------------------------------------

MASTER = {"MinMV": 20, "MaxMV": 180}
SPECIAL = {
    "TRK_VAL": "L2.PV",
    "TRK_IN": "L2.TRK_OUT",
    "Windup_H_IN": "L2.Windup_H_OUT",
    "Windup_L_IN": "L2.Windup_L_OUT",
}


@pytest.mark.parametrize("first", [0, 4])
def test_each_bumpless_move_is_told_at_its_place(first):
    loop = generic({"setpoint": {"follows_pv": True}}).loops[0]
    b = TargetBuilder(0, {"name": "L1"})
    moves = bumpless_moves_of(b, loop, first, output_stays=True)
    assert [(move["move"], move["to"], move["when"]) for move in moves] == [
        ("L1.MV", "L1.ManualMV", "NOT L1.Manual"),
        ("L1.PV", "L1.SP", "L1.Manual"),
    ]
    marked = [(put.path, put.neutral) for put in b.fields]
    assert marked == [(f"/moves.{first}.move", None), (f"/moves.{first + 1}.move", "setpoint.follows_pv")]


@pytest.mark.parametrize(("casc", "mode"), [(True, "cascade"), (False, "auto"), ("Run", "cascade"), ("Halt", "auto")])
def test_a_cascade_is_a_source(casc, mode):
    config = nextopid({**MASTER, **SPECIAL}, {"SP_CASC": "L1.MV", "CASC": casc})
    master, slave = neutral_loops(config, NEXTOPID)[0].loops
    assert (slave.setpoint.source, slave.setpoint.value, slave.mode, master.mode) == ("L1", 50, mode, "auto")
    assert (master.output.range, master.output.limits) == ((0, 200), (20, 180))
    assert [entry.path for found in to_neutral(config) for entry in found.fields if not entry.neutral] == []


def test_the_pv_of_the_slave_is_the_scale_of_the_master():
    slave = {"SP_CASC": "L1.MV", "CASC": True}
    assert neutral({"output": {"range": [0, 90]}, **SPECIAL}, slave).output.range == (0, 200)
    assert said({"output": {"range": [0, 90]}, **SPECIAL}, slave)["output.range"].assumed
    assert not said({"output": {"range": [0, 200]}, **SPECIAL}, slave)["output.range"].assumed


@pytest.mark.parametrize("wire", ["L1.MV * 2", "max(L1.MV, 20)", "L1.PV", "L2.MV"])
def test_what_is_not_the_mv_of_a_master_is_no_link(wire):
    config = nextopid({}, {"SP_CASC": wire, "CASC": True})
    found = to_neutral(config)[1]
    assert found.data["setpoint"] == {"value": 50}
    assert found.data["mode"] == "auto"
    assert wire in next(entry.note for entry in found.fields if entry.path == "SP_CASC" and not entry.neutral)


def test_of_two_scales_of_one_master_the_first_counts():
    slaves = [{"SP_CASC": "L1.MV", "CASC": True}, {"SP_CASC": "L1.MV", "CASC": True, "MaxPV": 100}]
    loops = [found.data for found in to_neutral(nextopid(SPECIAL, *slaves))]
    assert [loop["setpoint"].get("source") for loop in loops] == [None, "L1", None]


NO_RANGE = "no output.range is given: MinMV and MaxMV are taken for 0 % and 100 %"


@pytest.mark.parametrize(
    ("loop", "around", "span", "note"),
    [
        ({}, {}, [10, 90], NO_RANGE),
        ({"output": {"range": [0, 100]}}, {}, [0, 100], ""),
        ({"output": {"range": [10, 90]}}, {}, [10, 90], ""),
        ({}, {"blocks": BLOCKS[2:]}, [0, 100], "0 % and 100 % of the pulses of P"),
        ({"output": {"range": [0, 100]}}, {"blocks": BLOCKS[2:]}, [0, 100], ""),
        ({"output": {"range": [0, 50]}}, {"blocks": BLOCKS[2:]}, [0, 100], "0 % and 100 % of the pulses of P"),
        (SPECIAL, {}, [0, 200], "0 % and 100 % of the set point of L2"),
        ({**SPECIAL, "output": {"range": [0, 200]}}, {}, [0, 200], ""),
    ],
)
def test_the_range_of_an_output_is_told_with_what_reads_it(loop, around, span, note):
    """What reads MV decides, then `output.range`, then the limits."""
    slave = [{"SP_CASC": "L1.MV", "CASC": True}] if "TRK_IN" in loop else []
    found = to_neutral(nextopid(loop, *slave, **around))[0]
    (field,) = (field for field in found.fields if field.path == "output.range")
    assert ([*found.data["output"]["range"]], field.note, field.assumed) == (span, note, bool(note))
    given = loop.get("output", {}).get("range")
    assert (field.value and [*field.value]) == given


def test_a_literal_set_point_of_cascade_mode_is_in_force():
    assert neutral({"SP_CASC": 70, "CASC": True}).setpoint.value == 70
    assert neutral({"SP_CASC": "Two", "CASC": True}).setpoint.value == 2
    assert set(lost({"SP_CASC": 70, "CASC": True})) == {"SP"}
    assert neutral({"SP_CASC": 70}).setpoint.value == 50
    assert set(lost({"SP_CASC": 70})) == {"SP_CASC"}


def test_tracking_is_manual():
    loop = neutral({"TRK_IN": True, "TRK_VAL": 33, "ManualMV": 5})
    assert (loop.mode, loop.output.manual) == ("manual", 33)
    assert {"TRK_IN", "TRK_VAL"} <= set(lost({"TRK_IN": "Run", "TRK_VAL": 33}))
    assert lost({"TRK_VAL": 33}) == {}


def test_special_connections_elsewhere_are_dropped():
    assert set(lost({**SPECIAL, "OVERR": "Run"}, {})) == {
        "TRK_IN",
        "TRK_VAL",
        "Windup_H_IN",
        "Windup_L_IN",
        "OVERR",
        "signals.Run",
    }
    assert set(lost({"Windup_H_IN": True, "OVERR": True, "TRK_VAL": 4})) == {"Windup_H_IN", "OVERR", "TRK_VAL"}


def test_all_connections_of_a_cascade_are_wired():
    converted = made({"output": {"range": [0, 200]}}, {"mode": "cascade", "setpoint": {"value": 50, "source": "L1"}})
    master, slave = converted.data["loops"]
    assert {key: master[key] for key in SPECIAL} == SPECIAL
    assert (slave["SP_CASC"], slave["CASC"], slave["SP"]) == ("L1.MV", True, 50)
    assert errors(converted.data) == []
    assert lost_of(converted) == set()


def test_a_cascade_whose_ranges_differ_is_dropped():
    converted = made({"output": {"range": [0, 100]}}, {"mode": "cascade", "setpoint": {"value": 5, "source": "L1"}})
    master, slave = converted.data["loops"]
    assert "TRK_IN" not in master
    assert (slave["CASC"], "SP_CASC" in slave) == (False, False)
    change = report(converted, 1)["setpoint.source"]
    assert (change.kind, "0 to 100, this PV 0 to 200" in change.note) == ("dropped", True)
    assert errors(converted.data) == []


def test_a_second_slave_is_not_followed():
    slave = {"mode": "cascade", "pv": {"range": [0, 100]}, "setpoint": {"source": "L1"}}
    converted = made({}, slave, slave)
    assert converted.data["loops"][0]["TRK_IN"] == "L2.TRK_OUT"
    assert "L2 only" in report(converted, 2)["setpoint.source"].note
    assert errors(converted.data) == []


@pytest.mark.parametrize("source", ["L1", "L9"])
def test_a_master_that_is_none_is_dropped(source):
    converted = made({"mode": "cascade", "setpoint": {"source": source, "value": 20}})
    assert report(converted)["setpoint.source"].kind == "dropped"
    assert report(converted)["mode"].kind == "clamped"
    assert converted.data["loops"][0].get("CASC") is False
    assert errors(converted.data) == []


# --- blocks and signals ----------------------------------------------------------------------------------------------


def test_a_low_filter_before_pv_is_its_filter():
    assert neutral({"PV": "F.OutVar"}, blocks=BLOCKS[:1]).pv.filter == Decimal("1.5")
    assert lost({"PV": "F.OutVar"}, blocks=BLOCKS[:1]) == {}
    wired = [{**BLOCKS[0], "InVar": "Raw * 2"}]
    assert set(lost({"PV": "F.OutVar"}, blocks=wired)) == {"blocks.F.InVar"}


def test_a_filter_becomes_a_block_before_pv():
    converted = made({}, {"pv": {"range": [0, 100], "filter": 1.5}})
    (block,), loop = converted.data["blocks"], converted.data["loops"][1]
    assert (block["type"], block["Tc"], block["InVar"], loop["PV"]) == (
        "ControlLowFilter",
        1.5,
        "L2_IN",
        f"{block['name']}.OutVar",
    )
    assert converted.data["signals"] == {"L2_IN": 50}
    assert report(converted, 1)["pv.filter"].target == 1.5
    assert errors(converted.data) == []
    assert neutral_loops(NextopidFile.model_validate(converted.data), NEXTOPID)[0].loops[1].pv.filter == Decimal("1.5")


@pytest.mark.parametrize("wire", ["Raw * 2", "D.OutVar", "sqrt(Raw)"])
def test_a_pv_that_is_worked_out_is_dropped(wire):
    assert wire in lost({"PV": wire}, blocks=BLOCKS[1:2])["PV"]


@pytest.mark.parametrize("pv", ["Raw", "L2.PV", 12])
def test_a_pv_from_outside_is_no_loss(pv):
    assert lost({"PV": pv}, {}) == {}


def test_a_pwm_behind_mv_is_its_pulses():
    output = neutral({"MinMV": 5}, blocks=BLOCKS[2:]).output
    assert (output.range, output.limits, output.pulse.period) == ((0, 100), (5, 90), 5)
    assert neutral({"output": {"range": [0, 200]}}, blocks=BLOCKS[2:]).output.range == (0, 100)
    assert "blocks.Q" in lost({}, blocks=[BLOCKS[2], {**BLOCKS[2], "name": "Q"}])
    assert "blocks.P" in lost({}, blocks=[{**BLOCKS[2], "MV": "L1.MV + 1"}])


def test_a_cascade_comes_before_pulses():
    found = lost(SPECIAL, {"SP_CASC": "L1.MV", "CASC": True}, blocks=BLOCKS[2:])
    assert set(found) == {"blocks.P"}


def test_pulses_become_a_block_behind_mv():
    converted = made({"output": {"range": [-5, 15], "pulse": {"period": 30}}})
    assert converted.data["blocks"] == [
        {"name": "L1_PWM", "type": "ControlPWM", "MV": "L1.MV", "MinMV": -5, "MaxMV": 15, "Period": 150}
    ]
    assert report(converted)["output.pulse.period"].kind == "exact"
    back = neutral_loops(NextopidFile.model_validate(converted.data), NEXTOPID)[0].loops[0]
    assert (back.output.pulse.period, back.output.range) == (30, (-5, 15))
    assert errors(converted.data) == []


@pytest.mark.parametrize(
    ("period", "cycles", "kind"), [(0.5, 2, "rounded"), (30_000, 65_535, "clamped"), ("1 ms", 1, "clamped")]
)
def test_the_period_is_whole_cycles(period, cycles, kind):
    converted = made({"output": {"range": [0, 100], "pulse": {"period": period}}})
    assert converted.data["blocks"][0]["Period"] == cycles
    assert report(converted)["output.pulse.period"].kind == kind


def test_a_rough_period_says_how_to_get_more_steps():
    few, many = ({"output": {"range": [0, 100], "pulse": {"period": period}}} for period in (19.8, 20))
    assert "99 steps" in report(made(few))["output.pulse.period"].note
    assert "steps" not in report(made(many))["output.pulse.period"].note
    assert made(few, sample_time=Decimal("0.01")).data["blocks"][0]["Period"] == 1980


@pytest.mark.parametrize(
    ("seconds", "cycles", "clamped"),
    [(0.04, 1, True), (0.1, 1, False), (1, 10, False), (6553.5, 65535, False), (6553.6, 65535, True)],
)
def test_a_period_is_a_cycle_at_least_and_65535_at_most(seconds, cycles, clamped):
    loop = {"sample_time": 0.1, "output": {"range": [0, 100], "pulse": {"period": seconds}}}
    found = from_neutral(generic(loop), {})
    (put,) = [put for put in found.fields[0] if put.neutral == "output.pulse.period"]
    assert (found.data["blocks"][0]["Period"], put.clamped) == (cycles, clamped)


def test_other_blocks_and_signals_are_dropped_with_their_expressions():
    loops = ({}, {"BIAS": "D.OutVar"}, {"SP": "Two"})
    found = to_neutral(nextopid(*loops, blocks=BLOCKS[1:2]))
    assert lost(*loops, blocks=BLOCKS[1:2]) == {}
    of_second = {entry.path: entry.note for entry in found[1].fields if not entry.neutral}
    assert set(of_second) == {"BIAS", "blocks.D", "signals.Two"}
    assert "InVar Two" in of_second["blocks.D"]


def test_a_block_that_nobody_reads_is_of_whom_it_reads():
    split = {"name": "S", "type": "ControlSplitRange", "MV": "L2.MV", "SPLIT": 50, "Mode": 1}
    found = to_neutral(nextopid({}, {}, blocks=[split, BLOCKS[1]]))
    assert [[entry.path for entry in own.fields if not entry.neutral] for own in found] == [
        ["blocks.D", "signals.Two"],
        ["blocks.S"],
    ]


def test_a_block_is_of_the_loop_that_reads_it_not_of_those_behind():
    loops = ({}, {"TRK_VAL": "L3.MV", "OVERR": "Run"}, {"BIAS": "D.OutVar"})
    found = to_neutral(nextopid(*loops, blocks=BLOCKS[1:2]))
    assert [any(entry.path == "blocks.D" for entry in own.fields) for own in found] == [False, False, True]


def test_an_on_off_controller_is_no_pid():
    on_off = {"name": "FAN", "type": "ControlON_OFF", "SP": 5, "DeadBand": 1, "MinPV": 0, "MaxPV": 10}
    data = nextopid({}).model_dump() | {"loops": [LOOP, on_off]}
    found = to_neutral(NextopidFile.model_validate(data))
    assert [len(own.missing) for own in found] == [0, 1]
    assert "move it from loops to blocks" in found[1].missing[0].message
    assert "blocks.FAN" in lost({}, blocks=[on_off])


def test_the_auto_tuning_is_dropped():
    tune = {key: 1 for key in TuneParam.model_fields if key != "Mode"} | {"Mode": "PI"}
    found = lost({"type": "PIDA_TUNE_REAL", "AutoTune": "Run", "AutoTuneParam": tune})
    assert {f"AutoTuneParam.{key}" for key in tune} | {"AutoTune", "signals.Run"} == set(found)


def test_every_parameter_is_spoken_of():
    loop = {
        **LOOP,
        "type": "PIDA_TUNE_REAL",
        "description": "Oven",
        "sample_time": 0.5,
        "Td_Kd": 3,
        "Tfd": 1,
        "BIAS": 2,
        "SP_CASC": 60,
        "PV": 3,
        "ManualMV": 20,
        "TRK_VAL": 5,
        "MaxVarMV": 1,
        "DeadBand": 1,
        "Indep": True,
        "DisableP": True,
        "DerivEr": True,
        "CASC": True,
        "TRK_IN": True,
        "Windup_H_IN": True,
        "Windup_L_IN": True,
        "OVERR": True,
        "Manual": True,
        "Direct": True,
        "AutoTune": True,
        "pv": {"unit": "C"},
        "output": {"range": [0, 100], "unit": "%"},
        "AutoTuneParam": {"PercAmpMV": 1},
    }
    assert set(loop) == set(PidaTuneReal.model_fields)
    spoken = set(said(loop)) | set(HARMLESS_FIELDS)
    sections = {"pv.unit", "output.range", "output.unit", *(f"AutoTuneParam.{key}" for key in TuneParam.model_fields)}
    assert set(PidaTuneReal.model_fields) - {"pv", "output", "AutoTuneParam"} | sections <= spoken
    silent = set(HARMLESS_FIELDS) & set(said(loop))
    assert {path for path in HARMLESS_FIELDS if not path.startswith("plc.")} - silent == {"type", "PV"}


# --- names and times -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wanted", "name"),
    [
        ("TIC-101", "TIC_101"),
        ("101", "L_101"),
        ("Öfen #2", "Ofen_2"),
        ("a__b", "a_b"),
        ("___", "Loop"),
        ("IF", "IF_2"),
        ("pidloops", "pidloops_2"),
        ("ControlPWM", "ControlPWM_2"),
        ("Autotune-PI", "Autotune_PI_2"),
        ("log", "log_2"),
        ("x" * 60, "x" * 40),
        ("y" * 39 + "-z", "y" * 39),
    ],
)
def test_names_are_identifiers(wanted, name):
    assert Names().new_name(wanted) == name


@pytest.mark.parametrize("ending", ["", "_IN", "_FILTER", "_PWM"])
def test_names_of_any_length_end_as_they_should_and_are_no_longer_than_an_identifier(ending):
    names = Names()
    given = [names.new_name(f"{'x' * length}-y", ending) for length in range(28, 44) for _ in range(11)]
    assert all(name.endswith(ending) and IDENTIFIER.fullmatch(name) for name in given)
    assert len({name.casefold() for name in given}) == len(given)
    assert {len(name) for name in given} == {*range(30 + len(ending), 41)}


def test_names_differ_by_more_than_capitals():
    converted = made({"name": "TIC-1"}, {"name": "tic_1", "pv": {"range": [0, 9], "filter": 1}}, {"name": "tic_1_2_IN"})
    assert [loop["name"] for loop in converted.data["loops"]] == ["TIC_1", "tic_1_2", "tic_1_2_IN"]
    assert list(converted.data["signals"]) == ["tic_1_2_2_IN"]
    assert [report(converted, i)["name"].kind for i in (0, 1)] == ["assumed", "assumed"]
    assert report(converted, 2)["name"].kind == "exact"
    assert errors(converted.data) == []


def test_a_renamed_master_is_still_followed():
    loops = (
        {"name": "A-1"},
        {"name": "B-1", "mode": "cascade", "pv": {"range": [0, 100]}, "setpoint": {"source": "A-1"}},
    )
    assert made(*loops).data["loops"][1]["SP_CASC"] == "A_1.MV"


@pytest.mark.parametrize(
    ("times", "step"),
    [
        ([0.1, 0.25], "0.05"),
        ([1, 2, 3], "1"),
        ([0.5], "0.5"),
        ([], "0.1"),
        (["0.0105", "0.021"], "0.0105"),
        ([0.1, "0.0333"], "0.001"),
        ([0, 0.5], "0.001"),
        ([90, 120], "60"),
        (["0.0001"], "0.001"),
    ],
)
def test_the_task_is_the_common_step(times, step):
    assert task_of([Decimal(str(time)) for time in times], None).interval == Decimal(step)


def test_the_common_step_divides_all():
    assert common_step([Decimal("0.6"), Decimal("0.9"), Decimal("1.5")]) == Decimal("0.3")


def test_loops_are_called_every_so_many_cycles():
    converted = made({"sample_time": 0.2}, {"sample_time": 0.5}, {"sample_time": 0.1})
    assert converted.data["plc"] == {"sample_time": 0.1}
    assert [loop.get("sample_time") for loop in converted.data["loops"]] == [0.2, 0.5, None]
    assert [report(converted, i)["sample_time"].target for i in range(3)] == [0.2, 0.5, 0.1]
    assert errors(converted.data) == []


def test_the_interval_can_be_chosen():
    converted = made({"sample_time": 0.2}, {"sample_time": 0.11}, sample_time=Decimal("0.05"))
    assert converted.data["plc"] == {"sample_time": 0.05}
    assert [loop["sample_time"] for loop in converted.data["loops"]] == [0.2, 0.1]
    change = report(converted, 1)["sample_time"]
    assert (change.kind, round(change.error_percent, 2)) == ("rounded", 9.09)
    assert [row.key for row in CONVERT_OPTIONS] == ["sample_time"]


@pytest.mark.parametrize(("time", "held"), [(90, 60), ("0.2 ms", 0.001)])
def test_times_are_those_that_the_blocks_allow(time, held):
    converted = made({"sample_time": time})
    assert converted.data["plc"]["sample_time"] == held
    assert report(converted)["sample_time"].kind == "clamped"
    assert errors(converted.data) == []


def test_the_task_s_time_is_that_of_a_loop_without_one():
    assert neutral({}).sample_time == Decimal("0.1")
    assert neutral({"sample_time": 0.3}).sample_time == Decimal("0.3")


# --- whole programs --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["feed_forward", "override"])
def test_networks_lose_what_has_no_twin(name):
    config = network(name)
    loops = tuple(loop for loop in config.loops if isinstance(loop, Pida))
    converted = convert(config.model_copy(update={"loops": loops}), NEXTOPID, NEXTOPID, {})
    assert converted.has_losses
    assert errors(converted.data) == []


@pytest.mark.parametrize("name", ["cascade", "override", "ratio", "splitrange", "heatexchanger", "autotune"])
@pytest.mark.parametrize("target", VENDORS)
def test_examples_convert_to_every_vendor(name, target):
    data = read_document((EXAMPLES / f"{name}.yaml").read_bytes(), name).data
    config = NextopidFile.model_validate(data)
    converted = convert(config, NEXTOPID, VENDORS[target], {})
    assert errors(converted.data) == []
    assert (target == "nextopid" and name == "cascade") <= (not converted.has_losses)


def near(a: Any, b: Any) -> bool:
    """Whether two neutral values differ by no more than single precision makes of them."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(near(a[key], b[key]) for key in a)
    if isinstance(a, tuple):
        return all(near(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, Decimal):
        return abs(a - b) <= Decimal("1e-6") * max(abs(a), abs(b))
    return bool(a == b)


VALUES = st.decimals("0.01", "500", places=2)
LOOPS = st.fixed_dictionaries(
    {
        "SP": VALUES,
        "Kp": VALUES,
        "Ti_Ki": VALUES | st.just(0),
        "Td_Kd": VALUES | st.just(0),
        "Tfd": VALUES | st.just(0),
        "Indep": st.booleans(),
        "DerivEr": st.booleans(),
        "Direct": st.booleans(),
        "Manual": st.booleans(),
        "ManualMV": VALUES,
        "DeadBand": VALUES | st.just(0),
        "MaxVarMV": VALUES | st.just(0),
        "BIAS": VALUES,
        "sample_time": st.sampled_from(["0.1 s", "0.2 s", "1.3 s"]),
    },
    optional={
        "DisableP": st.just(True),
        "output": st.just({"range": (0, 300)}),
        "PV": st.just("F.OutVar"),
        "type": st.sampled_from(["PIDA_REAL", "PIDA_TUNE_REAL"]),
    },
)


@settings(max_examples=150, deadline=None)
@given(LOOPS, st.booleans())
def test_a_conversion_to_itself_keeps_the_loops(loop, linked):
    slave = {**loop, "SP_CASC": "L1.MV", "CASC": True, "Manual": False} if linked else loop
    config = nextopid({**loop, **(SPECIAL if linked else {})}, slave, blocks=BLOCKS[:1])
    before = neutral_loops(config, NEXTOPID)[0].loops
    converted = convert(config, NEXTOPID, NEXTOPID, {})
    after = neutral_loops(NextopidFile.model_validate(converted.data), NEXTOPID)[0].loops
    assert all(near(a.model_dump(), b.model_dump()) for a, b in zip(before, after, strict=True))
    lost = {f for f, c in report(converted).items() if c.loss}
    assert lost <= {"blocks.F", "signals.Raw"}


@settings(max_examples=60, deadline=None, suppress_health_check=list(HealthCheck))
@given(configurations())
def test_any_program_is_asked_about_or_is_a_neutral_one(config):
    found = to_neutral(config)
    assert len(found) == len(config.loops)
    for own, loop in zip(found, config.loops, strict=True):
        if not own.missing:
            data = {"pidcfg": 1, "vendor": "generic", "loops": [own.data]}
            assert GenericFile.model_validate(data).loops[0].name == loop.name
