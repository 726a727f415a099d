"""The first scan of NextoPID programs: rules judge what an expression or a wire gives then, as the block does."""

from __future__ import annotations

import random
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from nextopid_rig import HEAD, plc_of, random_program
from pidcfg.api import check_text
from pidcfg.encoders.nextopid.image import encode
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.sim.controllers.nextopid import scan as controller
from pidcfg.text.diagnostics import Severity
from pidcfg.text.source import read_document
from pidcfg.validate.rules.nextopid.context import NextopidContext
from pidcfg.validate.rules.nextopid.first_scan import as_int, round_to_single

SIGNALS = "signals: {G: 2.0, HALF: 0.5, T: 500 ms, WHOLE: INT#3, UP: true, SENSOR: 0.0, Z: 0.0, LATER: 2.0}\n"
LOOP = {
    "SP": "50",
    "PV": "SENSOR",
    "Kp": "2",
    "Ti_Ki": "30",
    "Td_Kd": "0",
    "MinMV": "0",
    "MaxMV": "100",
    "MinPV": "0",
    "MaxPV": "100",
}
LAG = {"InVar": "SENSOR", "Gs": "1", "Tc": "5", "Init_OutVar": "0", "Min_OutVar": "0", "Max_OutVar": "100"}
ON_OFF, DELAY_LAG, SPLIT_RANGE = "ControlON_OFF", "ControlDelayLag", "ControlSplitRange"
BLOCKS = {
    ON_OFF: {"SP": "50", "PV": "SENSOR", "DeadBand": "2", "MinPV": "0", "MaxPV": "100"},
    "ControlLag": LAG,
    DELAY_LAG: LAG | {"DelayTime": "1"},
    "ControlLeadLag": {"InVar": "SENSOR", "G": "1", "Tlag": "5", "Min_OutVar": "0", "Max_OutVar": "100"},
    "ControlLowFilter": {"InVar": "SENSOR", "Tc": "5"},
    "ControlDelay": {"InVar": "SENSOR", "DelayTime": "1"},
    "ControlPWM": {"MV": "L.MV", "MinMV": "0", "MaxMV": "100", "Period": "20"},
    SPLIT_RANGE: {"MV": "L.MV", "SPLIT": "50", "Mode": "1"},
}


def rows(name, kind, values):
    """A block or loop, a key a line."""
    given = {key: value for key, value in values.items() if value is not None}
    return [f"  - name: {name}", f"    type: {kind}", *(f"    {key}: {value}" for key, value in given.items())]


def program(kind="PIDA_REAL", more=(), moves=(), **values):
    """A loop L with these values; or a block B of another type beside a loop that reads nothing of it."""
    is_loop = kind.startswith("PIDA")
    blocks = [*more, *([] if is_loop else rows("B", kind, BLOCKS[kind] | values))]
    loop = rows("L", kind, LOOP | values) if is_loop else rows("L", "PIDA_REAL", LOOP)
    lists = {"blocks:": blocks, "loops:": loop, "moves:": [f"  - {move}" for move in moves]}
    return SIGNALS + "\n".join(line for head, lines in lists.items() if lines for line in (head, *lines)) + "\n"


def serious(text):
    """Errors and warnings, but that nothing reads a block."""
    return [d for d in check_text(HEAD + text).findings if d.severity > Severity.INFO and d.code != "NX607"]


def errors(text):
    return [d for d in serious(text) if d.severity is Severity.ERROR]


def first_scan(text, cycles=1):
    """Signals by name after the first scan of the virtual PLC, or after more of them."""
    plc = plc_of(text)
    for cycle in range(cycles):
        controller.scan(cycle * plc.task_ticks, plc.configs, plc.states, plc.aux, plc.signal_values)
    return {name: plc.signal_values[number] for name, number in plc.layout.numbers.items()}


def context_of(text):
    config = NextopidFile.model_validate(read_document((HEAD + text).encode(), "x.yaml").data)
    return NextopidContext(config, encode(config))


# --- errors of the first scan ----------------------------------------------------------------------------------------

LOW = ["  - {name: LOW, type: ControlSelectMin, MV1: 1.0, MV2: G * -1.0}"]
STEEP = ["  - {name: RAMP, type: ControlLag, InVar: SENSOR, Gs: 1, Tc: 5, Init_OutVar: 0, Max_OutVar: 100}"]
FILTER = ["  - {name: FF, type: ControlLowFilter, InVar: G - 3, Tc: 5}"]
HELD = ["  - {name: HELD, type: ControlDelay, InVar: G, DelayTime: 3, InitDelayedVar: -4}"]
LEAD = ["  - {name: LL, type: ControlLeadLag, InVar: G, G: -3, Tlead: 2, Tlag: 1, Min_OutVar: -9, Max_OutVar: 9}"]
TO_G = ["{move: HALF - 1, to: G, at: start}"]
ZERO_TO_G = ["{move: 0.0, to: G, at: start, when: UP AND WHOLE > 2}"]
BACK = ["  - {name: BACK, type: ControlDelay, InVar: L.MV, DelayTime: 3, InitDelayedVar: -4}"]
# fmt: off
WRONG = [
    # what the file says                          key            code     bit                 its value
    (program(Kp="1.0 - 1.0"),                     "Kp",          "NX612", "ErrBits.Kp",       "0 (1.0 - 1.0);"),
    (program(Kp="-G"),                            "Kp",          "NX612", "ErrBits.Kp",       "-2 (-G at the"),
    (program(Kp="G * -1.0", Indep="true"),        "Kp",          "NX612", "ErrBits.Kp",       "-2 (G * -1.0 at"),
    (program(Kp="min(G, HALF) - HALF"),           "Kp",          "NX612", "ErrBits.Kp",       "0 (min(G, HALF) - HALF"),
    (program(Ti_Ki="G * -1.0"),                   "Ti_Ki",       "NX613", "ErrBits.Ti_Ki",    "-2 s (G * -1.0 at"),
    (program(Td_Kd="T - 1"),                      "Td_Kd",       "NX613", "ErrBits.Td_Kd",    "-0.5 s (T - 1 at"),
    (program(Tfd="0 - WHOLE"),                    "Tfd",         "NX613", "ErrBits.Tfd",      "-3 s (0 - WHOLE at"),
    (program(MaxVarMV="-G"),                      "MaxVarMV",    "NX613", "ErrBits.MaxVarMV", "-2 (-G at"),
    (program(DeadBand="HALF - 1"),                "DeadBand",    "NX613", "ErrBits.DeadBand", "-0.5 (HALF - 1 at"),
    (program(MaxMV="100 * (G - 2)"),              "MaxMV",       "NX610", "ErrBits.MaxMinMV", "0 (100 * (G - 2) at"),
    (program(MinMV="G * 60"),                     "MaxMV",       "NX610", "ErrBits.MaxMinMV", "120 (G * 60 at"),
    (program(MinPV="G + 2", MaxPV="WHOLE"),       "MaxPV",       "NX611", "ErrBits.MaxMinPV", "4 (G + 2 at"),
    (program(Kp="L.ManualMV - 5", ManualMV="5"),  "Kp",          "NX612", "ErrBits.Kp",       "0 (L.ManualMV - 5 at"),
    (program(Kp="LOW.MV", more=LOW),              "Kp",          "NX612", "ErrBits.Kp",       "-2 (LOW.MV at"),
    (program(Kp="RAMP.OutVar * 2", more=STEEP),   "Kp",          "NX612", "ErrBits.Kp",       "0 (RAMP.OutVar * 2 at"),
    (program(Kp="FF.OutVar", more=FILTER),        "Kp",          "NX612", "ErrBits.Kp",       "-1 (FF.OutVar at"),
    (program(Ti_Ki="HELD.OutVar", more=HELD),     "Ti_Ki",       "NX613", "ErrBits.Ti_Ki",    "-4 s (HELD.OutVar at"),
    (program(MaxVarMV="LL.OutVar", more=LEAD),    "MaxVarMV",    "NX613", "ErrBits.MaxVarMV", "-6 (LL.OutVar at"),
    (program(Kp="G", moves=TO_G),                 "Kp",          "NX612", "ErrBits.Kp",       "-0.5 (G at"),
    (program(Kp="G", moves=ZERO_TO_G),            "Kp",          "NX612", "ErrBits.Kp",       "0 (G at"),
    (program("PIDA_INT", DeadBand="WHOLE - 4"),   "DeadBand",    "NX613", "ErrBits.DeadBand", "-1 (WHOLE - 4 at"),
    (program(ON_OFF, DeadBand="G - 3"),           "DeadBand",    "NX649", "ErrBits.DeadBand", "-1 (G - 3 at"),
    (program(ON_OFF, MinPV="G * 100"),            "MaxPV",       "NX611", "ErrBits.MaxMinPV", "200 (G * 100 at"),
    (program("ControlLag", Tc="T * 0"),           "Tc",          "NX644", "Error",            "0 s (T * 0 at"),
    (program("ControlLag", Init_OutVar="G * -1"), "Init_OutVar", "NX647", "Error",            "-2 (G * -1 at"),
    (program(DELAY_LAG, Min_OutVar="50 + 60"),    "Min_OutVar",  "NX645", "Error",            "110 (50 + 60) is"),
    (program("ControlLeadLag", Tlag="-T"),        "Tlag",        "NX644", "Error",            "-0.5 s (-T at"),
    (program("ControlDelay", DelayTime="G * 6"),  "DelayTime",   "NX642", "Error",            "12 s (G * 6 at"),
    (program("ControlPWM", MaxMV="Z * 5"),        "MaxMV",       "NX651", "Error",            "0 (Z * 5 at"),
    (program(SPLIT_RANGE, SPLIT="50 * G"),        "SPLIT",       "NX654", "Error",            "100 (50 * G at"),
]
"""Errors, each at the parameter whose limits it is beyond; the bit is that of its block."""
LEGAL = [
    program(Kp="1.0 + 1.0"),
    program(Kp="G * 1.5", Ti_Ki="G * 15", Td_Kd="T * 2", Tfd="T / 2", MaxVarMV="G * 10", DeadBand="HALF - 0.5"),
    program(Kp="1.0 - 1.0", Indep="true", Ti_Ki="0.1"),           # a pure integral
    program(Kp="-G", Indep="true", Ti_Ki="0.1").replace("G: 2.0", "G: -2.0"),
    program(Ti_Ki="30 - 30", BIAS="20 + 30"),                     # no integral, with an offset
    program(MinMV="G * -50", MaxMV="G * 50", ManualMV="HALF", output="{range: [-100, 100]}"),
    program(SP="G * 25", MinPV="G - 2", MaxPV="WHOLE * 40"),
    program(Kp="SENSOR / 50"),                                    # 0 until the sensor is read
    program(Kp="G - SENSOR", SP="SENSOR - 5", PV="SENSOR + 0.0"),
    program(Kp="1 / Z"),                                          # no value
    program(Kp="G / Z", Direct="NOT UP"),
    program(Kp="sqrt(0 - G)"),
    program(Kp="L.MV"),                                           # of the cycle before
    program(Kp="RAMP.OutVar + 2", more=STEEP),
    program(BIAS="RAMP.OutVar", MinMV="10", ManualMV="20", Ti_Ki="0", more=STEEP),  # leaves 0 at once
    program(SP="HELD.OutVar", more=HELD),                         # -4 for three seconds
    program(Kp="B2.OutVar", PV="B2.OutVar", more=["  - {name: B2, type: ControlLowFilter, InVar: SENSOR, Tc: 5}"]),
    program(Kp="LATER", moves=["{move: G - 2, to: LATER}"]),        # later in the run
    program(Kp="LATER", moves=["{move: 0.0, to: LATER, at: start, when: WHOLE < 2}"]),
    program(Kp="LATER", moves=["{move: 0.0, to: LATER, at: start, when: SENSOR > 50}"]),
    program(Kp="Z", moves=["{move: G, to: Z, at: start}"]),
    program(Kp="L.ManualMV - 5", ManualMV="5", moves=["{move: 8.0, to: L.ManualMV, at: start, when: UP}"]),
    program(MaxVarMV="BACK.OutVar", more=BACK),  # L is called first, and sees the 0 before the first call
    program(ON_OFF, DeadBand="G - 1", Manual="UP AND WHOLE > 5"),
    program("ControlLag", Tc="T * 10", Init_OutVar="G * 20", Max_OutVar="40 + 60"),
    program(SPLIT_RANGE, SPLIT="25 * G"),
]
# fmt: on


@pytest.mark.parametrize(("text", "key", "code", "bit", "value"), WRONG)
def test_an_expression_is_judged_by_its_value_in_the_first_scan(text, key, code, bit, value):
    lines, name = (HEAD + text).split("\n"), "B" if "  - name: B\n" in text else "L"
    start = lines.index(f"  - name: {name}")
    line = next(i for i in range(start, len(lines)) if lines[i].startswith(f"    {key}: "))
    [found] = errors(text)

    assert (found.code, found.span.line, found.span.column) == (code, line + 1, len(f"    {key}: ") + 1)
    assert f" {value}" in found.message
    assert found.plc_effect == bit
    assert first_scan(text)[f"{name}.{bit}"] == 1, "the virtual block reports it"


@pytest.mark.parametrize("text", LEGAL)
def test_nothing_is_said_of_an_expression_that_is_right_or_unknown(text):
    assert [(d.code, d.message) for d in serious(text)] == []


def test_an_expression_that_becomes_bad_later_is_the_business_of_the_run():
    text = program(Kp="LATER", moves=["{move: G - 2, to: LATER}"])
    first, second = first_scan(text), first_scan(text, cycles=2)

    assert not serious(text)
    assert (first["L.ErrBits.Kp"], second["L.ErrBits.Kp"]) == (0, 1)


NUMBERS = st.decimals("-200", "200", places=2)


@given(NUMBERS, NUMBERS, st.sampled_from(["Kp", "SP", "MaxMV", "MinPV", "BIAS"]))
def test_a_number_and_a_sum_of_that_value_are_judged_alike(first, second, key):
    def judged(value):
        return sorted((d.code, str(d.severity), d.plc_effect or "") for d in serious(program(**{key: value})))

    assert judged(f"{first} + {second}") == judged(f"{first + second}")


def compared(text):
    """How many signals, wires and outputs of a program are known; each is what the virtual PLC has."""
    context, values, known = context_of(text), first_scan(text), 0
    moved = {copy.target for copy in context.encoding.copies}
    for number, name in enumerate(context.names):
        kind, owner = context.encoding.layout.types[name], context.owner(number)
        found = None if kind.kind == "word" else context.first_scan.find_value(number)
        if found is None or (owner is not None and number in moved):
            continue
        value = as_int(Decimal(found.value)) if kind.name == "INT" else found.value
        assert round_to_single(float(value)) == values[name], name
        known += owner is None or owner[1].access == "output" or owner[0].is_wired(owner[1].name)
    return known


def without_end_moves(text):
    """A program without what it copies behind the last call."""
    kept = [line for line in text.split("\n") if "move:" not in line or "at: start" in line]
    return "\n".join(line for line in kept if line != "moves:" or "move:" in "".join(kept))


def test_what_the_rules_know_is_what_the_virtual_plc_has_after_its_first_scan():
    known = sum(compared(without_end_moves(random_program(random.Random(seed)))) for seed in range(250))
    assert known > 1000, "of signals, wires and outputs many are known"


INT_LOOP = "\n".join(rows("WHOLES", "PIDA_INT", LOOP | {"PV": None, "ManualMV": "G * 1.3"})) + "\n"
OFF = ["  - {name: LL, type: ControlLeadLag, InVar: G, G: 1, Tlag: 1, Max_OutVar: 9, Disable: G > HALF}"]
SPECIAL = [
    (program(Kp="WHOLES.ManualMV") + INT_LOOP, "L.Kp", 3),  # an INT takes 3 of 2.6
    (program(Kp="WHOLE", moves=["{move: HALF * 9.2, to: WHOLE, at: start}"]), "L.Kp", 5),
    (program(Kp="LL.OutVar", more=OFF), "LL.OutVar", 0),
]


@pytest.mark.parametrize(("text", "name", "value"), SPECIAL)
def test_a_value_is_taken_as_the_plc_takes_it(text, name, value):
    context = context_of(text)

    assert compared(text)
    assert context.first_scan.find_value(context.names.index(name)).value == first_scan(text)[name] == value


def test_an_on_off_block_beside_the_loops_leaves_the_signals_alone():
    text = program(ON_OFF, SP="40")
    values = first_scan(text)

    assert (values["T"], values["G"], values["HALF"]) == (0.5, 2.0, 0.5)
