"""Rules for NextoPID configurations at their limits: at the limit nothing, one step beyond the finding."""

import json
import re
from copy import deepcopy
from decimal import Decimal
from itertools import product
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from nextopid_pid_rig import Block
from nextopid_rig import findings as rig_findings
from nextopid_rig import run
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.schemas.expressions import parse
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.validate.engine import check_document
from pidcfg.validate.rules.nextopid import RULES
from pidcfg.validate.rules.nextopid import blocks as plant_rules
from pidcfg.validate.rules.nextopid import cascade as override_rules
from pidcfg.validate.rules.nextopid.context import Signs, response_of_expression

ROOT = Path(__file__).parents[1]
EXAMPLES = sorted(p for p in (ROOT / "examples/nextopid").glob("*.yaml") if ".scenario" not in p.name)
OWN = "NX6"
LOOP = {
    "name": "A",
    "type": "PIDA_REAL",
    "SP": 50,
    "Kp": 1,
    "Ti_Ki": 60,
    "Td_Kd": 0,
    "MinMV": 0,
    "MaxMV": 100,
    "MinPV": 0,
    "MaxPV": 100,
}
ON_OFF = {"name": "A", "type": "ControlON_OFF", "SP": 50, "DeadBand": 2, "MinPV": 0, "MaxPV": 100}
PARAM = {"PercAmpMV": 5, "PercHystPV": 0.1, "PercMaxPeakPV": 10, "NumCycles": 3, "Mode": "PI"}
TUNED = {"type": "PIDA_TUNE_REAL", "AutoTuneParam": PARAM}
BLOCKS = {
    "ControlLowFilter": {"InVar": "X", "Tc": 5},
    "ControlDelay": {"InVar": "X", "DelayTime": 1},
    "ControlLag": {"InVar": "X", "Gs": 1, "Tc": 5, "Max_OutVar": 100},
    "ControlDelayLag": {"InVar": "X", "DelayTime": 1, "Gs": 1, "Tc": 5, "Max_OutVar": 100},
    "ControlLeadLag": {"InVar": "X", "G": 1, "Tlead": 2, "Tlag": 5, "Max_OutVar": 100},
}
SIGNALS = {"X": 20.0, "UP": True, "DOWN": False}


def changed(name="A", **values):
    """A loop with other values; None takes a key away."""
    loop = deepcopy(LOOP) | {"name": name} | values
    if loop["type"] == "ControlON_OFF":
        loop = ON_OFF | {"name": name} | values
    return {key: value for key, value in loop.items() if value is not None}


def block(kind, name="F", **values):
    found = {"name": name, "type": kind, **BLOCKS.get(kind, {}), **values}
    return {key: value for key, value in found.items() if value is not None}


def checked(*loops, blocks=(), signals=None, moves=(), **plc):
    config = {
        "pidcfg": 1,
        "vendor": "nextopid",
        "plc": {"sample_time": 0.1, **plc},
        "signals": signals or SIGNALS,
        "blocks": blocks,
        "loops": loops,
        "moves": moves,
    }
    result = check_document(read_document(json.dumps(config, default=float).encode(), "case.yaml"))
    assert result.config is not None, result.findings
    return result


def findings(*loops, **others):
    result = checked(*loops, **others)
    return (*result.findings, *result.to_check)


def codes(*loops, **others):
    return {d.code for d in findings(*loops, **others)} - {"NX605"}


def serious(*loops, **others):
    """Codes of errors and warnings, each as often as it is found."""
    return sorted(d.code for d in findings(*loops, **others) if d.severity > Severity.INFO)


def effects(code, *loops, **others):
    return [d.plc_effect for d in findings(*loops, **others) if d.code == code]


def master(name, slave, **values):
    wires = {"TRK_VAL": "PV", "TRK_IN": "TRK_OUT", "Windup_H_IN": "Windup_H_OUT", "Windup_L_IN": "Windup_L_OUT"}
    return changed(name, **{key: f"{slave}.{output}" for key, output in wires.items()} | values)


def slave(name, of, **values):
    return changed(name, **{"SP_CASC": f"{of}.MV", "CASC": "UP", **values})


def overridden(name, number, **values):
    return changed(name, **{"OVERR": f"S.OVERR{number}", "TRK_VAL": "S.MV", **values})


def selector(kind="ControlSelectMin", **values):
    return {"name": "S", "type": kind, "MV1": "A.MV", "MV2": "B.MV", **values}


def test_what_the_tests_change_is_in_order():
    assert not codes(changed())
    assert not codes(changed(**TUNED))
    assert not codes(changed(type="ControlON_OFF"))
    assert not codes(master("A", "B"), slave("B", "A"))
    assert not codes(overridden("A", 1), overridden("B", 2), blocks=[selector()])
    for kind in BLOCKS:
        assert not codes(changed(PV="F.OutVar"), blocks=[block(kind)]), kind


# fmt: off
STEPS = [
    # code     key         what else                                              at the limit  one step beyond
    ("NX610", "MaxMV",    {},                                                    0.001, 0),
    ("NX610", "MinMV",    {},                                                    99.999, 100),
    ("NX611", "MaxPV",    {"SP": 0},                                             0.001, 0),
    ("NX611", "MinPV",    {"SP": 100},                                           99.999, 100),
    ("NX611", "MaxPV",    {"type": "ControlON_OFF", "SP": 0},                    0.001, 0),
    ("NX612", "Kp",       {},                                                    0.001, 0),
    ("NX612", "Kp",       {"Indep": True, "Ti_Ki": 0.1},                         0, -0.001),
    ("PID101", "Td_Kd",    {},                                                    0, -0.001),
    ("PID101", "Ti_Ki",    {},                                                    0, -0.001),
    ("PID101", "Tfd",      {},                                                    0, -0.001),
    ("PID101", "MaxVarMV", {},                                                    0, -0.001),
    ("PID101", "DeadBand", {},                                                    0, -0.001),
    ("NX615", "SP",       {},                                                    100, 100.001),
    ("NX615", "SP",       {},                                                    0, -0.001),
    ("NX616", "SP_CASC",  {},                                                    100, 100.001),
    ("NX616", "SP_CASC",  {"MinPV": 10},                                         None, 9.999),
    ("NX617", "ManualMV", {},                                                    0, -0.001),
    ("NX617", "MinMV",    {"Manual": "DOWN"},                                     0, 0.001),
    ("NX618", "BIAS",     {},                                                    100, 100.001),
    ("NX619", "TRK_VAL",  {"TRK_IN": "DOWN"},                                     100, 100.001),
    ("NX620", "MaxMV",    {"output": {"range": [0, 100]}},                       100, 100.001),
    ("NX620", "MinMV",    {"output": {"range": [0, 100]}},                       0, -0.001),
    ("NX621", "MaxMV",    {},                                                    100, 99.999),
    ("NX624", "sample_time", {"Ti_Ki": 600},                                     60, 60.1),
    ("NX625", "sample_time", {},                                                 0.1, 0),
    ("NX626", "sample_time", {},                                                 0.3, 0.31),
    ("NX628", "Tfd",      {"Td_Kd": 1},                                          0.1, 0.09),
    ("NX630", "Ti_Ki",    {"sample_time": None},                                 0.001, 0.0009),
    ("NX631", "Ti_Ki",    {},                                                    0.1, 0.099),
    ("NX631", "Ti_Ki",    {"Indep": True},                                       10, 10.1),
    ("NX632", "Td_Kd",    {},                                                    10, 10.01),
    ("NX632", "Td_Kd",    {"Kp": 2},                                             5, 5.01),
    ("NX632", "Td_Kd",    {"Kp": 2, "Indep": True, "Ti_Ki": 1},                  10, 10.01),
    ("NX633", "MaxVarMV", {},                                                    0.0167, 0.0166),
    ("NX633", "MaxVarMV", {"sample_time": 0.3},                                  0.05, 0.0499),
    ("NX634", "MaxVarMV", {},                                                    99.99, 100),
    ("NX635", "Ti_Ki",    {"DisableP": True},                                    0.001, 0.0009),
    ("NX635", "Ti_Ki",    {"Kp": 0, "Indep": True},                              0.0001, 0),
    ("NX636", "DisableP", {"Indep": True, "Ti_Ki": 1},                           False, True),
    ("NX637", "Ti_Ki",    {"Indep": True},                                       1, "1 s"),
    ("NX637", "Indep",    {"Td_Kd": "100 ms", "Ti_Ki": 1},                       False, True),
    ("NX639", "BIAS",     {"Ti_Ki": 0},                                          1, 0),
    ("NX640", "Td_Kd",    {"DerivEr": True},                                     0, 0.1),
    ("NX641", "DeadBand", {},                                                    99.99, 100),
    ("NX649", "DeadBand", {"type": "ControlON_OFF"},                             0.001, 0),
    ("NX650", "SP",       {"type": "ControlON_OFF"},                             97.99, 98),
    ("NX650", "SP",       {"type": "ControlON_OFF"},                             2.01, 2),
    ("NX658", "ManualMV", {**TUNED, "Manual": True},                             95, 95.01),
    ("NX658", "ManualMV", {**TUNED, "Manual": True},                             5, 4.99),
    ("NX658", "Manual",   {**TUNED, "ManualMV": 0},                              False, True),
    ("NX656", "AutoTuneParam", {"type": "PIDA_TUNE_INT", "AutoTune": "DOWN"},     {**PARAM, "PercAmpMV": 5}, None),
    ("NX657", "AutoTune", {**TUNED},                                             "DOWN", "UP"),
    ("NX659", "AutoTuneParam", {"type": "PIDA_TUNE_REAL"},
                                                   PARAM | {"PercMaxPeakPV": 0.21}, PARAM | {"PercMaxPeakPV": 0.2}),
    ("NX660", "AutoTuneParam", {"type": "PIDA_TUNE_INT"},    PARAM | {"PercAmpMV": 1}, PARAM | {"PercAmpMV": 0.99}),
    ("NX660", "AutoTuneParam", {"type": "PIDA_TUNE_INT"},    PARAM | {"PercAmpMV": 7}, PARAM | {"PercAmpMV": 7.1}),
    ("NX658", "ManualMV", {**TUNED, "type": "PIDA_TUNE_INT", "Manual": True,
                            "AutoTuneParam": PARAM | {"PercAmpMV": 5.4}},         95, 96),
    ("NX666", "CASC",     {},                                                    False, True),
]
BLOCK_STEPS = [
    # code     type                key             what else                      at the limit  one step beyond
    ("NX629", "ControlLowFilter", "Tc",           {},                            0.1, 0.099),
    ("NX629", "ControlLeadLag",   "Tlag",         {},                            0.1, 0.099),
    ("NX642", "ControlDelay",     "DelayTime",    {},                            10, 10.01),
    ("NX642", "ControlDelayLag",  "DelayTime",    {},                            10, 10.01),
    ("PID101", "ControlDelay",     "DelayTime",    {},                            0.1, -0.1),
    ("PID101", "ControlLeadLag",   "Tlead",        {},                            0, -0.1),
    ("NX643", "ControlDelay",     "DelayTime",    {},                            0.3, 0.31),
    ("NX644", "ControlLowFilter", "Tc",           {},                            0.001, 0),
    ("NX644", "ControlLag",       "Tc",           {},                            0.001, 0),
    ("NX644", "ControlDelayLag",  "Tc",           {},                            0.001, 0),
    ("NX644", "ControlLeadLag",   "Tlag",         {},                            0.001, 0),
    ("NX645", "ControlLag",       "Min_OutVar",   {"Init_OutVar": 100},          100, 100.1),
    ("NX645", "ControlLeadLag",   "Min_OutVar",   {},                            100, 100.1),
    ("NX646", "ControlLag",       "Max_OutVar",   {},                            0.1, 0),
    ("NX646", "ControlDelayLag",  "Max_OutVar",   {},                            0.1, None),
    ("NX646", "ControlLeadLag",   "Max_OutVar",   {},                            0.1, None),
    ("NX647", "ControlLag",       "Init_OutVar",  {},                            100, 100.1),
    ("NX647", "ControlDelayLag",  "Init_OutVar",  {},                            0, -0.1),
    ("NX648", "ControlLag",       "Gs",           {},                            0.1, None),
    ("NX648", "ControlLeadLag",   "G",            {},                            -0.1, 0),
]
# fmt: on


@pytest.mark.parametrize(("code", "key", "others", "inside", "outside"), STEPS)
def test_one_step_beyond_the_limit_is_found_and_the_limit_is_not(code, key, others, inside, outside):
    assert code not in codes(changed(**others | {key: inside}))
    assert code in codes(changed(**others | {key: outside}))


@pytest.mark.parametrize(("code", "kind", "key", "others", "inside", "outside"), BLOCK_STEPS)
def test_one_step_beyond_the_limit_of_a_block_is_found(code, kind, key, others, inside, outside):
    loop = changed(PV="F.OutVar")

    assert code not in codes(loop, blocks=[block(kind, **others | {key: inside})])
    assert code in codes(loop, blocks=[block(kind, **others | {key: outside})])


WIRED = [
    row
    for row in STEPS
    if all(isinstance(row[i], int | float) and not isinstance(row[i], bool) for i in (3, 4)) and row[1] != "sample_time"
]


@pytest.mark.parametrize(("code", "key", "others", "inside", "outside"), WIRED)
def test_the_first_value_of_a_signal_is_judged_like_a_number(code, key, others, inside, outside):
    code = "NX613" if code == "PID101" else code
    found = findings(changed(**others | {key: "V"}), signals=SIGNALS | {"V": float(outside)})

    assert code not in codes(changed(**others | {key: "V"}), signals=SIGNALS | {"V": float(inside)})
    assert code in {d.code for d in found}
    if code not in {"NX621", "NX631", "NX632", "NX635", "NX639", "NX640", "NX650"}:
        assert "first value of V" in next(d.message for d in found if d.code == code)


@pytest.mark.parametrize(
    ("values", "effect"),
    [
        ({"MaxMV": 0}, "ErrBits.MaxMinMV"),
        ({"MaxPV": 0}, "ErrBits.MaxMinPV"),
        ({"Kp": 0}, "ErrBits.Kp"),
        ({"Td_Kd": -1}, "ErrBits.Td_Kd"),
        ({"Ti_Ki": -1}, "ErrBits.Ti_Ki"),
        ({"Tfd": -1}, "ErrBits.Tfd"),
        ({"MaxVarMV": -1}, "ErrBits.MaxVarMV"),
        ({"DeadBand": -1}, "ErrBits.DeadBand"),
        ({"sample_time": 61, "Ti_Ki": 600}, "ErrBits.SampleTime"),
        ({"SP": 101}, "WarnBits.SP_MaxPV"),
        ({"SP": -1}, "WarnBits.SP_MinPV"),
        ({"CASC": True, "SP_CASC": 101}, "WarnBits.SP_CASC_MaxPV"),
        ({"CASC": "DOWN", "SP_CASC": -1}, "WarnBits.SP_CASC_MinPV"),
        ({"Manual": "DOWN", "ManualMV": 101}, "WarnBits.MV_MaxMV"),
        ({"ManualMV": -1}, None),
        ({"SP_CASC": -1}, None),
        ({"SP": 101, "CASC": True, "SP_CASC": 5}, None),
        ({"Manual": True, "ManualMV": -1}, "WarnBits.MV_MinMV"),
        ({"type": "ControlON_OFF", "DeadBand": -1}, "ErrBits.DeadBand"),
        ({"type": "ControlON_OFF", "DeadBand": 0}, None),
        ({**TUNED, "AutoTuneParam": PARAM | {"PercAmpMV": 51}}, "AutoTuneResult.Bad_PercAmpMV"),
        ({**TUNED, "AutoTuneParam": PARAM | {"NumCycles": 11}}, "AutoTuneResult.Bad_NumCycles"),
        ({**TUNED, "Manual": True, "ManualMV": 99}, "AutoTuneResult.MV_TOO_HIGH"),
        ({**TUNED, "Manual": True, "ManualMV": 1}, "AutoTuneResult.MV_TOO_LOW"),
    ],
)
def test_each_bit_is_reported_under_its_own_name(values, effect):
    serious_ones = [d for d in findings(changed(**values)) if d.severity > Severity.INFO]
    outputs = {row.name for kind in BLOCK_TYPES.values() for row in kind.outputs}

    assert [d.plc_effect for d in serious_ones] == [effect]
    assert effect is None or effect in outputs


EDGES = st.sampled_from([-1, -0.001, 0, 0.0005, 1, 5, 99, 100, 101])
CONTENT = (
    "SP",
    "SP_CASC",
    "Kp",
    "Ti_Ki",
    "Td_Kd",
    "Tfd",
    "MaxVarMV",
    "DeadBand",
    "MinMV",
    "MinPV",
    "ManualMV",
    "MaxMV",
    "MaxPV",
)
SWITCHES = ("Indep", "CASC", "Manual")
VALUES = st.fixed_dictionaries(dict.fromkeys(CONTENT, EDGES) | dict.fromkeys(SWITCHES, st.booleans()))


@given(VALUES, st.sampled_from([0.1, 60, 60.5]))
def test_the_rules_tell_the_bits_that_the_block_then_sets(values, sample_time):
    block_ = Block("PIDA_REAL", sample_time, PV=50, **values)
    block_.call()
    told = {d.plc_effect for d in findings(changed(**values, PV=50), sample_time=sample_time) if d.plc_effect}

    errors = {f"ErrBits.{bit}" for bit in block_.true("ErrBits.")}
    assert {effect for effect in told if effect.startswith("ErrBits.")} == errors
    if not errors:
        warned = {f"WarnBits.{bit}" for bit in block_.true("WarnBits.") if bit.startswith("SP")}
        assert {effect for effect in told if effect.startswith("WarnBits.SP")} == warned
        manual = {f"WarnBits.{bit}" for bit in block_.true("WarnBits.") if bit in {"MV_MaxMV", "MV_MinMV"}}
        assert not values["Manual"] or {effect for effect in told if effect.startswith("WarnBits.MV")} == manual


ONE = [
    # what is changed, and all errors and warnings that it makes
    ({"Ti_Ki": "60 s", "Indep": True}, ["NX637"]),
    ({"Td_Kd": "500 s", "Indep": True, "Ti_Ki": 1}, ["NX637"]),
    ({"Kp": -1, "Ti_Ki": 0}, ["NX612"]),
    ({"Kp": 0, "Ti_Ki": 0}, ["NX612"]),
    ({"MaxMV": 0, "ManualMV": 5, "BIAS": 7, "MaxVarMV": 1}, ["NX610"]),
    ({"MaxPV": 0, "SP_CASC": 7}, ["NX611"]),
    ({"SP": "Z"}, ["NX601"]),
    ({"MaxMV": "Z"}, ["NX601"]),
    ({"Manual": "Z"}, ["NX601"]),
    ({"Indep": "Z"}, ["NX601"]),
    ({"OVERR": "Z"}, ["NX601"]),
    ({"CASC": "Z", "SP_CASC": "X"}, ["NX601"]),
    ({**TUNED, "AutoTuneParam": None, "AutoTune": "Z"}, ["NX601"]),
    ({"SP_CASC": "B.MV", "CASC": "UP"}, ["NX601"]),
    ({"SP_CASC": "A.MV", "CASC": "UP"}, ["NX662"]),
    ({"sample_time": -1}, ["NX625"]),
    ({"sample_time": 0.05}, ["NX626"]),
    ({"type": "PIDA_TUNE_REAL", "AutoTune": True}, ["NX656"]),
    ({"type": "PIDA_INT", "SP": 12.5}, ["PID104"]),
    ({"type": "PIDA_INT", "MaxPV": 40000}, ["PID102"]),
    ({"type": "PIDA_INT", "MaxPV": "BIG", "Kp": 0.1}, ["NX614"]),
    ({"type": "ControlON_OFF", "DeadBand": -1}, ["NX649"]),
    ({"type": "ControlON_OFF", "DeadBand": 0, "SP": 100}, ["NX649"]),
    ({"name": "Pidloops"}, ["NX604", "NX604"]),
    ({"name": "x"}, ["NX604", "NX604"]),
    ({"name": "controlpwm"}, ["NX603"]),
]


@pytest.mark.parametrize(("values", "expected"), ONE, ids=[f"{row[1][0]}-{i}" for i, row in enumerate(ONE)])
def test_one_fault_is_one_finding(values, expected):
    assert serious(changed(**values), signals=SIGNALS | {"BIG": 40000.0}) == expected


# --- wires -----------------------------------------------------------------------------------------------------------

LINES = """pidcfg: 1
vendor: nextopid
plc: {sample_time: 0.1}
signals: {FLOW: 20.0, UP: true}
loops:
  - {name: A, type: PIDA_REAL, SP: 50, Kp: 1, Ti_Ki: 60, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100,
     PV: WIRE}
"""


@pytest.mark.parametrize(
    ("wire", "character"),
    [
        ("2 * FLOWS", "F"),
        ('"2 * FLOWS"', "F"),
        ("'2 * FLOWS'", "F"),
        ("2  *   FLOWS", "F"),
        ('"  2 * FLOWS"', "F"),
        ("FLOW * UP", "U"),
        ("min(FLOW 2)", "2"),
        ('"min(FLOW, sin(2))"', "s"),
        ("FLOW % 2", "%"),
        ("A.MW", "A"),
    ],
)
def test_a_finding_about_a_wire_points_at_the_character(wire, character):
    text = LINES.replace("WIRE", wire).replace("\n     PV: ", "\n     PV: ")
    found = next(d for d in check_document(read_document(text.encode(), "case.yaml")).findings if d.code == "NX601")

    row = text.split("\n")[found.span.line - 1]
    assert row[found.span.column - 1] == character
    assert row.index(character, row.index("PV: ") + 4) == found.span.column - 1
    assert found.span.end_column == found.span.column + 1


@pytest.mark.parametrize(
    ("key", "wire", "meant"),
    [
        ("PV", "FLOWS", "FLOW"),
        ("PV", "A.MW", "A.MV"),
        ("Manual", "UPP", "UP"),
        ("PV", "A.Proportional", "A.ProportionalAction"),
    ],
)
def test_the_name_that_was_probably_meant_is_proposed(key, wire, meant):
    found = findings(changed(**{key: wire}), signals=SIGNALS | {"FLOW": 1.0})

    assert next(d.help for d in found if d.code == "NX601") == f"did you mean {meant!r}?"


@pytest.mark.parametrize(
    ("blocks", "ring"),
    [
        ([selector(MV1="S.MV", MV2="X")], True),
        ([selector(MV1="F.OutVar", MV2="X"), block("ControlLeadLag", InVar="S.MV")], True),
        ([selector(MV1="F.OutVar", MV2="X"), block("ControlDelay", InVar="S.MV", DelayTime=0)], True),
        ([selector(MV1="F.OutVar", MV2="X"), block("ControlDelay", InVar="S.MV", DelayTime=0.1)], False),
        ([selector(MV1="F.OutVar", MV2="X"), block("ControlLowFilter", InVar="S.MV")], False),
    ],
)
def test_only_a_ring_of_blocks_that_answer_at_once_is_found(blocks, ring):
    assert ("NX602" in codes(changed(PV="S.MV"), blocks=blocks)) == ring


# --- direction of control --------------------------------------------------------------------------------------------

SIGNED = st.sampled_from([-2, -0.5, 0.5, 3])


@given(
    SIGNED,
    SIGNED,
    SIGNED,
    st.booleans(),
    st.sampled_from(
        [
            ("{0} * F.OutVar", 1),
            ("100 - F.OutVar * {0}", -1),
            ("F.OutVar / {0} + X", 1),
            ("-(-F.OutVar) * {0}", 1),
            ("max(F.OutVar, 0) * {0}", 1),
            ("{0} * min(F.OutVar * 2, X, 90)", 1),
            ("F.OutVar * {0} / max(LOAD, 1)", 1),
            ("sqrt(F.OutVar) * {0}", 1),
        ]
    ),
)
def test_the_direction_follows_from_the_product_of_all_gains(process, lead, factor, direct, wire):
    text, sign = wire[0].format(factor), wire[1] * factor * process * lead
    blocks = [
        block("ControlLeadLag", "L", InVar="A.MV", G=lead, Min_OutVar=-1000, Max_OutVar=1000),
        block("ControlDelayLag", InVar="L.OutVar", Gs=process, Min_OutVar=-1000, Max_OutVar=1000),
    ]
    found = codes(changed(PV=text, Direct=direct), blocks=blocks, signals=SIGNALS | {"LOAD": 0.0})

    assert ("NX622" in found) == (direct == (sign > 0))


@pytest.mark.parametrize("factor", [-2, 3])
@pytest.mark.parametrize("process", [-0.5, 2])
@pytest.mark.parametrize("direct", [True, False])
@pytest.mark.parametrize("wire", ["F.OutVar * L.G", "L.G * F.OutVar", "F.OutVar / L.G"])
def test_a_parameter_that_nothing_changes_is_a_factor_of_the_direction(factor, process, direct, wire):
    blocks = [
        block("ControlLeadLag", "L", InVar="X", G=factor),
        block("ControlDelayLag", InVar="A.MV", Gs=process, Min_OutVar=-1000, Max_OutVar=1000),
    ]
    assert ("NX622" in codes(changed(PV=wire, Direct=direct), blocks=blocks)) == (direct == (factor * process > 0))


@pytest.mark.parametrize("wire", ["F.OutVar * LOAD", "F.OutVar - A.MV", "abs(F.OutVar)", "X", "F.OutVar * 0", "A.MV"])
@pytest.mark.parametrize("direct", [True, False])
def test_nothing_is_said_of_the_direction_where_nobody_can_know_it(wire, direct):
    lag = block("ControlLag", InVar="A.MV", Min_OutVar=-100)

    assert "NX622" not in codes(changed(PV=wire, Direct=direct), blocks=[lag], signals=SIGNALS | {"LOAD": 0.0})


@pytest.mark.parametrize("gain", [2, -2])
@pytest.mark.parametrize("direct", [False, True])
def test_the_loop_whose_direction_is_found_runs_away_and_the_other_holds_its_set_point(gain, direct):
    text = f"""blocks:
  - {{name: P, type: ControlLag, InVar: A.MV, Gs: {gain}, Offset: {50 - 25 * gain}, Tc: 20, Init_OutVar: 30,
     Min_OutVar: -500, Max_OutVar: 500}}
loops:
  - {{name: A, type: PIDA_REAL, SP: 40, PV: P.OutVar, Kp: 1, Ti_Ki: 10, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0,
     MaxPV: 100, Direct: {str(direct).lower()}}}
"""
    report = run(text, "duration: 200\nexpect:\n  - {signal: A.PV, final: 40, tolerance: 0.5}\n")

    assert [e.passed for e in report.expectations] == ["NX622" not in {code for code, _ in rig_findings(text)}]


@pytest.mark.parametrize(("low", "high", "sign"), [(-10, 0, -1), (0, 10, 1), (-1, 1, None)])
@pytest.mark.parametrize("direct", [False, True])
def test_the_limits_of_an_output_tell_its_sign(low, high, sign, direct):
    blocks = [block("ControlLag", InVar="A.MV"), block("ControlLag", "G", Min_OutVar=low, Max_OutVar=high)]
    found = codes(changed(PV="F.OutVar * G.OutVar", Direct=direct), blocks=blocks)

    assert ("NX622" in found) == (sign is not None and direct == (sign > 0))


@pytest.mark.parametrize(
    ("casc", "sp", "found"),
    [
        (True, "0 - A.MV", True),
        ("UP", "0 - A.MV", False),
        (False, "A.MV", True),
        (False, "0 - A.MV", False),
    ],
)
def test_a_slave_that_may_follow_either_set_point_is_judged_by_both(casc, sp, found):
    blocks = [block("ControlLag", "P2", InVar="B.MV"), block("ControlLag", "P1", InVar="P2.OutVar")]
    loops = [master("A", "B", PV="P1.OutVar", Direct=True), slave("B", "A", PV="P2.OutVar", CASC=casc, SP=sp)]

    assert ("NX622" in codes(*loops, blocks=blocks)) == found


@pytest.mark.parametrize(
    ("mode", "output", "rises"),
    [
        (1, "MV1", True),
        (1, "MV2", False),
        (2, "MV1", True),
        (2, "MV2", True),
        (3, "MV1", True),
        (3, "MV2", False),
        (4, "MV1", False),
        (4, "MV2", True),
    ],
)
def test_a_split_range_turns_the_direction_of_some_valves(mode, output, rises):
    blocks = [
        {"name": "V", "type": "ControlSplitRange", "MV": "A.MV", "SPLIT": 40, "Mode": mode},
        block("ControlLag", InVar=f"V.{output}"),
    ]

    for direct in (True, False):
        assert ("NX622" in codes(changed(PV="F.OutVar", Direct=direct), blocks=blocks)) == (direct == rises)


@pytest.mark.parametrize(("outer", "inner"), list(product([True, False], repeat=2)))
@pytest.mark.parametrize("cooling", [True, False])
def test_in_a_cascade_the_loop_that_is_wrong_is_found_and_not_the_echo(outer, inner, cooling):
    blocks = [
        block("ControlLag", "P2", InVar="B.MV", Gs=-1 if cooling else 1, Min_OutVar=-100),
        block("ControlLag", "P1", InVar="P2.OutVar"),
    ]
    loops = [master("A", "B", PV="P1.OutVar", Direct=outer), slave("B", "A", PV="P2.OutVar", Direct=inner)]
    found = [d.loop for d in findings(*loops, blocks=blocks) if d.code == "NX622"]

    wrong_inside = inner != cooling
    assert found == (["B"] if wrong_inside else ["A"] if outer else [])


@pytest.mark.parametrize("kind", ["ControlSelectMin", "ControlSelectMax"])
def test_a_selector_keeps_the_direction(kind):
    blocks = [selector(kind), block("ControlLag", InVar="S.MV")]
    loops = [overridden("A", 1, PV="F.OutVar", Direct=True), overridden("B", 2, PV="F.OutVar * 2")]

    assert [d.loop for d in findings(*loops, blocks=blocks) if d.code == "NX622"] == ["A"]


@pytest.mark.parametrize(("constant", "found"), [(1, True), (1.01, False)])
def test_the_slowest_process_of_a_loop_decides_on_its_sample_time(constant, found):
    blocks = [
        block("ControlLag", "P2", InVar="A.MV", Tc=0.5),
        block("ControlLag", "P1", InVar="P2.OutVar", Tc=constant),
    ]

    assert ("NX623" in codes(changed(PV="P1.OutVar"), blocks=blocks)) == found


# --- cascades --------------------------------------------------------------------------------------------------------

CASCADE = [
    # a connection of the master, what it is instead, and the finding
    ("TRK_IN", None, "NX668"),
    ("TRK_IN", "A.TRK_OUT", "NX668"),
    ("TRK_IN", "DOWN", "NX668"),
    ("TRK_IN", True, "NX668"),
    ("TRK_VAL", None, "NX669"),
    ("TRK_VAL", "B.SP", "NX669"),
    ("TRK_VAL", "X * 2", "NX669"),
    ("TRK_VAL", 20, "NX669"),
    ("Windup_H_IN", None, "NX670"),
    ("Windup_H_IN", "B.Windup_L_OUT", "NX670"),
    ("Windup_L_IN", "DOWN", "NX670"),
    ("Windup_L_IN", "B.TRK_OUT", "NX670"),
]


@pytest.mark.parametrize(("key", "wire", "code"), CASCADE)
def test_each_connection_of_a_master_is_demanded(key, wire, code):
    loops = master("A", "B", **{key: wire}), slave("B", "A", PV="X / 2")
    found = [d for d in findings(*loops) if d.severity > Severity.INFO]

    assert [d.code for d in found] == [code]
    assert (found[0].severity is Severity.ERROR) == (wire != "DOWN")
    assert "A is only master" in found[0].message
    assert "B." in found[0].message


@pytest.mark.parametrize(
    ("pv", "value"),
    [
        ("X / 2", "X / 2"),
        ("X / 2", "X/2"),
        ("X / 2", "B.PV"),
        (None, "B.PV"),
        ("F.OutVar", "F.OutVar"),
    ],
)
def test_the_pv_of_a_slave_may_be_named_either_way(pv, value):
    blocks = [block("ControlLowFilter")] if pv == "F.OutVar" else []

    assert serious(master("A", "B", TRK_VAL=value), slave("B", "A", PV=pv), blocks=blocks) == []


def test_three_loops_have_the_three_parts():
    loops = [
        master("A", "B", TRK_IN=None),
        master("B", "C", SP_CASC="A.MV", CASC="UP", Windup_H_IN=None),
        slave("C", "B", TRK_IN="UP"),
    ]
    texts = [d.message for d in findings(*loops) if d.severity > Severity.INFO]

    assert [re.search(r"(\w) is (only master|slave and master|only slave)", text).groups() for text in texts] == [
        ("A", "only master"),
        ("B", "slave and master"),
        ("C", "only slave"),
    ]


def test_a_ratio_is_no_cascade():
    assert codes(changed(SP_CASC="X * 2", CASC="UP")) == set()


@pytest.mark.parametrize(
    ("casc", "found"), [("UP", False), ("DOWN", False), (True, False), (False, True), (None, True)]
)
def test_a_slave_that_never_is_in_cascade_mode_is_an_info(casc, found):
    assert ("NX665" in codes(master("A", "B"), slave("B", "A", CASC=casc))) == found


@given(st.integers(1, 4), st.integers(1, 4))
def test_a_slave_may_be_as_fast_as_its_master(first, second):
    loops = master("A", "B", sample_time=first / 10), slave("B", "A", sample_time=second / 10)

    assert ("NX674" in codes(*loops)) == (second > first)


@given(st.integers(-5, 5), st.integers(95, 105))
def test_a_master_asks_for_no_more_than_its_slave_takes(low, high):
    loops = master("A", "B", MinMV=low, MaxMV=high), slave("B", "A")

    assert sorted(effects("NX673", *loops)) == sorted(
        ["B.WarnBits.SP_CASC_MinPV"] * 2 * (low < 0) + ["B.WarnBits.SP_CASC_MaxPV"] * 2 * (high > 100)
    )


@pytest.mark.parametrize("size", [2, 3, 7])
def test_a_circle_of_any_size_is_a_finding_of_each_of_its_loops(size):
    loops = [changed(f"L{i}", SP_CASC=f"L{(i + 1) % size}.MV", CASC="UP") for i in range(size)]
    found = [d for d in findings(*loops, slave("T", "L0")) if d.code == "NX662"]

    assert [d.loop for d in found] == [f"L{i}" for i in range(size)]
    assert all(set(d.with_loops) | {d.loop} == {e.loop for e in found} for d in found)
    assert found[0].message.startswith("L0 is its own master: L0 follows L1 follows ")


def test_a_master_is_found_behind_a_selector_and_a_filter():
    filtered = {"name": "F", "type": "ControlLowFilter", "InVar": "S.MV", "Tc": 1}
    loops = changed("A"), changed("B"), changed("C", SP_CASC="F.OutVar", CASC="UP")
    found = [d for d in findings(*loops, blocks=[selector(), filtered]) if d.code == "NX684"]

    assert [(d.loop, "through F" in d.message) for d in found] == [("A", True), ("B", True)]
    assert "NX684" not in codes(master("A", "B"), slave("B", "A"))
    assert "NX684" not in codes(changed("A"), changed("C", SP_CASC="F.OutVar"), blocks=[block("ControlLowFilter")])


@pytest.mark.parametrize(
    ("values", "bit"),
    [
        ({"MaxMV": 0}, "MaxMinMV"),
        ({"MaxPV": 0}, "MaxMinPV"),
        ({"Kp": 0}, "Kp"),
        ({"Kp": -1, "Indep": True}, "Kp"),
        ({"Kp": 0, "Indep": True}, None),
        ({"Tfd": -1}, "Tfd"),
        ({"Ti_Ki": -1}, "Ti_Ki"),
        ({"Td_Kd": -1}, "Td_Kd"),
        ({"MaxVarMV": -1}, "MaxVarMV"),
        ({"DeadBand": -1}, "DeadBand"),
        ({"sample_time": 60.1}, "SampleTime"),
        ({"sample_time": 60}, None),
        ({}, None),
    ],
)
def test_a_master_is_not_told_that_its_slave_is_in_error(values, bit):
    assert effects("NX685", master("A", "B"), slave("B", "A", **values)) == [f"B.ErrBits.{bit}"] * (bit is not None)


# --- overrides -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "wire", "code"),
    [
        ("OVERR", None, "NX676"),
        ("OVERR", "S.OVERR2", "NX676"),
        ("OVERR", "DOWN", "NX676"),
        ("OVERR", True, "NX676"),
        ("TRK_VAL", None, "NX677"),
        ("TRK_VAL", "B.MV", "NX677"),
        ("TRK_VAL", "X", "NX677"),
        ("TRK_VAL", "S.MV / 2", "NX677"),
    ],
)
def test_each_connection_of_an_overridden_loop_is_demanded(key, wire, code):
    found = [
        d
        for d in findings(overridden("A", 1, **{key: wire}), overridden("B", 2), blocks=[selector()])
        if d.severity > Severity.INFO
    ]

    assert [d.code for d in found] == [code]
    assert (found[0].severity is Severity.ERROR) == (wire not in {"DOWN", "X"})


@pytest.mark.parametrize(
    ("kind", "first", "second", "sides"),
    [
        ("ControlSelectMin", False, True, ("below", "above")),
        ("ControlSelectMin", True, False, ("above", "below")),
        ("ControlSelectMax", False, True, ("above", "below")),
        ("ControlSelectMax", True, False, ("below", "above")),
    ],
)
def test_a_selector_says_on_which_side_it_holds_each_pv(kind, first, second, sides):
    loops = overridden("A", 1, Direct=first), overridden("B", 2, Direct=second)
    text = next(d.message for d in findings(*loops, blocks=[selector(kind)]) if d.code == "NX678")

    assert text.startswith(f"S holds PV of A {sides[0]} its SP and PV of B {sides[1]}")


@pytest.mark.parametrize("direct", [True, False])
def test_loops_of_one_direction_share_a_selector_without_a_word(direct):
    assert codes(overridden("A", 1, Direct=direct), overridden("B", 2, Direct=direct), blocks=[selector()]) == set()


# --- pulses and split range ------------------------------------------------------------------------------------------


@given(st.integers(-2, 2), st.integers(98, 102))
def test_pulses_and_loop_have_one_range(low, high):
    pulses = {"name": "W", "type": "ControlPWM", "MV": "A.MV", "MinMV": 0, "MaxMV": 100, "Period": 50}
    found = effects("NX653", changed(MinMV=low, MaxMV=high), blocks=[pulses])

    assert len(found) == (low != 0) + (high != 100)
    assert found.count("Warning") == (low < 0) + (high > 100)


@pytest.mark.parametrize(("period", "expected"), [(0, ["PID101"]), (1, ["NX652"]), (9, ["NX652"]), (10, [])])
def test_a_period_has_at_least_ten_cycles(period, expected):
    pulses = {"name": "W", "type": "ControlPWM", "MV": "A.MV", "MaxMV": 100, "Period": period}

    assert serious(changed(), blocks=[pulses]) == expected


@given(st.integers(-2, 2), st.integers(98, 102))
def test_a_split_range_takes_a_percentage(low, high):
    split = {"name": "V", "type": "ControlSplitRange", "MV": "A.MV", "SPLIT": 40, "Mode": 4}
    found = [d for d in findings(changed(MinMV=low, MaxMV=high), blocks=[split]) if d.code == "NX655"]

    assert bool(found) == ((low, high) != (0, 100))
    assert [d.severity is Severity.ERROR for d in found] == [low < 0 or high > 100] * len(found)


@pytest.mark.parametrize(("value", "found"), [(-0.001, True), (0, False), (100, False), (100.001, True)])
def test_a_number_for_a_split_range_is_a_percentage_too(value, found):
    split = {"name": "V", "type": "ControlSplitRange", "MV": value, "SPLIT": 40, "Mode": 4}

    assert effects("NX655", changed(), blocks=[split]) == ["Error"] * found


@given(st.integers(0, 100), st.integers(1, 60), st.booleans())
def test_an_on_off_controller_can_switch_both_ways_unless_it_is_found(point, band, direct):
    found = findings(changed(type="ControlON_OFF", SP=point, DeadBand=band, Direct=direct))
    switched = {word for d in found if d.code == "NX650" for word in re.findall(r"switched (\w+)", d.message)}
    reached = set()
    for pv in (0, 100):  # the ends of what the block can see
        error = point - pv
        if abs(error) > band:
            reached.add("on" if (error > 0) != direct else "off")

    assert switched == {"on", "off"} - reached


# --- all of them -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_are_in_order(example):
    result = check_document(read_document(example.read_bytes(), example.name))

    assert [d.message for d in result.findings if d.severity > Severity.INFO] == []


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
@pytest.mark.parametrize("extreme", ["0", "-1", "1e30", "1e-300"])
def test_no_number_in_an_example_makes_a_rule_fail(example, extreme):
    text = example.read_text("utf-8")
    for number in re.finditer(r"(?<=[ \[])\d+(\.\d+)?(?=[,}\] \n])", text):
        check_document(read_document((text[: number.start()] + extreme + text[number.end() :]).encode(), "case.yaml"))


NUMERIC = sorted(LOOP.keys() - {"name", "type"} | {"BIAS", "TRK_VAL", "Tfd", "MaxVarMV", "DeadBand", "sample_time"})


@given(
    st.decimals("-40000", "40000", places=3),
    st.sampled_from(NUMERIC),
    st.sampled_from(["PIDA_REAL", "PIDA_INT", "PIDA_TUNE_INT"]),
)
def test_no_number_makes_a_rule_fail(value, key, kind):
    assert checked(changed(type=kind, **{key: Decimal(value)})).encoding is not None


NAMES = [
    "A.MV",
    "B.MV",
    "S.MV",
    "F.OutVar",
    "X",
    "B.SP",
    "A.PV",
    "B.TRK_OUT",
    "S.OVERR1",
    "UP",
    "-A.MV",
    "Z",
    "F.InVar",
]


@given(st.lists(st.sampled_from(NAMES), min_size=10, max_size=10), st.sampled_from(sorted(BLOCKS)))
def test_no_network_makes_a_rule_fail(wires, kind):
    keys = ("PV", "SP_CASC", "TRK_VAL", "OVERR", "TRK_IN")
    a, b = (
        changed(name, CASC="UP", **dict(zip(keys, part, strict=True)))
        for name, part in (("A", wires[:5]), ("B", wires[3:8]))
    )
    blocks = [selector(MV1=wires[8], MV2=wires[9]), block(kind, InVar=wires[7])]

    assert checked(a, b, blocks=blocks).encoding is not None


def test_long_chains_are_followed_without_end():
    size = 300
    blocks = [
        block("ControlLag", f"F{i}", InVar=f"F{i - 1}.OutVar + F{i - 1}.OutVar" if i else "A.MV") for i in range(size)
    ]
    loops = [changed(f"L{i}", SP=f"L{i - 1}.SP" if i else 200) for i in range(size)]
    found = findings(changed(PV=f"F{size - 1}.OutVar", Direct=True), *loops, blocks=blocks)

    assert sum(d.code == "NX615" for d in found) == size
    assert "NX622" not in {d.code for d in found}


def test_decisions_of_rules_have_numbers_of_their_own():
    """Two are no rule's basis: an erratum of the manual, and what a rule with a place in the manual adds to it."""
    decisions = {
        rule.basis.number for code, rule in RULES.items() if isinstance(rule.basis, Decision) and code.startswith(OWN)
    }
    others = {override_rules.D211.number, plant_rules.D212.number}

    assert sorted({n for n in decisions if n >= 208} | others) == [*range(208, 220), 550, 552, 553, 955, 957]
    assert not decisions & others


def test_a_library_of_fourteen_blocks_has_more_than_eighty_rules():
    assert sum(code.startswith(OWN) for code in RULES) >= 80


@pytest.mark.parametrize(
    ("value", "says"),
    [
        (32767.4, "its decimals are lost, 32767 is taken"),
        (32767.5, "it does not fit, 32767 is taken"),
        (-32768.4, "its decimals are lost, -32768 is taken"),
        (-32769, "it does not fit, -32768 is taken"),
    ],
)
def test_an_int_takes_the_nearest_whole_number_of_its_range(value, says):
    loop = changed(type="PIDA_INT", BIAS="V")
    found = [d for d in findings(loop, signals=SIGNALS | {"V": float(value)}) if d.code == "NX614"]

    assert [d.message.partition(": ")[2] for d in found] == [says]
    assert (found[0].severity is Severity.WARNING) is ("decimals" in says)


@pytest.mark.parametrize(("number", "switch"), [(1, "true"), (0, "false")])
def test_a_switch_as_a_number_is_met_with_the_switch(number, switch):
    found = [(d.message, d.help) for d in findings(changed(Manual=number)) if d.code == "NX601"]

    assert found == [("Manual: this is a number; a BOOL is wanted", f"write {switch}")]


@pytest.mark.parametrize(
    ("number", "key", "says"),
    [
        (-1, "Ti_Ki", ["Ti_Ki is -1; it must be 0 or more"]),
        (0, "Ti_Ki", []),
        (-0.5, "DeadBand", ["DeadBand is -0.5; it must be 0 or more"]),
        ("V", "DeadBand", []),
        (-5, "BIAS", []),
    ],
)
@pytest.mark.parametrize("when", [{}, {"when": "UP"}])
def test_a_number_that_a_move_writes_is_held_against_the_limits_too(number, key, says, when):
    moves = [{"move": number, "to": f"A.{key}", **when}]
    found = [
        d for d in findings(changed(), signals=SIGNALS | {"V": -1.0, "UP": True}, moves=moves) if d.code == "NX613"
    ]

    assert [d.message for d in found] == says
    assert all(d.path == ("moves", 0, "move") and d.plc_effect == f"ErrBits.{key}" for d in found)


def test_a_decimal_in_an_int_is_cured_by_what_the_block_has():
    cures = [d.help for d in findings(changed(type="PIDA_INT", DeadBand=1.5)) if d.code == "PID104"]

    assert cures == ["round it, or take the block whose parameters are REAL"]


@pytest.mark.parametrize(("limit", "share"), [(100.1, "100.1"), (100.001, "100.001"), (-5, "-5"), (110, "110")])
def test_a_limit_beyond_the_scale_is_told_in_percent_that_are_beyond(limit, share):
    key = "MaxMV" if limit > 0 else "MinMV"
    found = findings(changed(**{key: limit}, output={"range": [0, 100]}))

    assert [d.message.split(": ")[1] for d in found if d.code == "NX620"] == [f"{share} % of the output"]


@given(st.integers(-32769, 32769))
def test_an_int_holds_what_a_wire_gives_it_or_it_is_found(value):
    assume(value != 0)
    found = codes(changed(type="PIDA_INT", BIAS="V"), signals=SIGNALS | {"V": float(value)})

    assert ("NX614" in found) == (not -32768 <= value <= 32767)


def test_the_first_of_several_slaves_is_named():
    loops = master("A", "B", TRK_IN=None), slave("B", "A"), slave("C", "A")

    (found,) = (d.message for d in findings(*loops) if d.code == "NX668")
    assert "must come from B.TRK_OUT" in found


@pytest.mark.parametrize(("derivative", "found"), [(-0.5, False), (0, False), (0.05, True)])
def test_a_filter_is_compared_with_a_derivative_time_and_with_nothing_else(derivative, found):
    assert ("NX689" in codes(changed(Td_Kd=derivative, Tfd=0.1, Indep=False))) == found


@pytest.mark.parametrize("smoothing", [0, 0.01, 0.1, 1, 30])
@pytest.mark.parametrize(("indep", "gain"), [(False, 2), (True, 0.5)])
def test_the_kick_of_a_set_point_is_the_one_that_the_block_makes(smoothing, indep, gain):
    values = {"Kp": gain, "Ti_Ki": 60, "Td_Kd": 3, "Tfd": smoothing, "Indep": indep, "MaxPV": 200, "MaxMV": 80}
    block_ = Block("PIDA_REAL", 0.1, PV=50, SP=50, DerivEr=True, MinPV=0, MinMV=0, **values)
    block_.call()
    block_.call(SP=52)  # 1 % of 200

    (found,) = (d.message for d in findings(changed(DerivEr=True, **values)) if d.code == "NX640")
    assert f"moves MV by {block_['DerivativeAction'] / 80 * 100:.3g} % through the derivative" in found


@pytest.mark.parametrize(
    ("text", "sign"),
    [
        ("X * UP", None),
        ("-UP", -1),
        ("X + UP", 1),
        ("UP - X", 1),
        ("X - UP", -1),
        ("2 * UP + 3 * UP", 1),
        ("UP - 2 * UP", None),
        ("min(-2, X) * UP", -1),
        ("max(2, X) * UP", 1),
        ("min(2, 3) * UP", 1),
        ("min(2, X) * UP", None),
        ("abs(X) * UP", 1),
        ("abs(UP)", None),
        ("abs(2 + 3 * 4) * UP", 1),
        ("sqrt(X) * UP", 1),
        ("sqrt(UP)", 1),
        ("2 / max(1, X) * UP", 1),
        ("2 / UP", -1),
        ("min(X, UP)", 1),
        ("X", 0),
    ],
)
def test_the_answer_of_an_expression_has_the_sign_that_its_parts_give_it(text, sign):
    signs = [Signs(None, 0), Signs(None, 1)]

    assert response_of_expression(parse(text, {"X": 0, "UP": 1}), signs.__getitem__) == sign


def test_limits_that_are_wired_in_a_circle_have_no_known_value():
    gains = "SP: 4, Kp: 1, Ti_Ki: 10.0, Td_Kd: 0.0, MaxMV: 100.0, MinPV: 0.0, MaxPV: 100.0"
    loops = "".join(f"  - {{name: {a}, type: PIDA_REAL, MinMV: {b}.MinMV, {gains}}}\n" for a, b in ("AB", "BA"))
    assert "NX" not in str(rig_findings(f"loops:\n{loops}"))
