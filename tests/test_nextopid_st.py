"""NextoPID programs in Structured Text: what is written, and what is read of it and of programs by hand."""

from __future__ import annotations

import copy
import math
import re
from contextlib import nullcontext
from decimal import Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from nextopid_networks import DATA, FULL, NETWORKS, OVERRIDE, fault, network
from nextopid_strategies import EXPRESSIONS, PLACE, configurations
from pidcfg.encoders.decoding import decode_listing
from pidcfg.encoders.listing import ListingError, UnwritableError
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES
from pidcfg.encoders.nextopid.files import checklist, looks_like_st
from pidcfg.encoders.nextopid.image import decode, encode
from pidcfg.encoders.nextopid.st_read import add_zeros, read_st
from pidcfg.encoders.nextopid.st_scope import Scope, Wiring
from pidcfg.encoders.nextopid.st_write import (
    ST_DIALECT,
    cycles_of,
    parenthesis_depth,
    print_expression,
    wire_text,
    write_st,
)
from pidcfg.encoders.structured_text import INTEGER_TYPES, REAL_TYPES, Token, number_of, tokens_of
from pidcfg.schemas.expressions import parse
from pidcfg.schemas.iec import REAL, Wire, real_text
from pidcfg.schemas.nextopid import NextopidFile
from pidcfg.sim.engine.expressions import evaluate
from pidcfg.vendors import VENDORS

# --- NextoPID programs in Structured Text: what is written, and what is read of it and of programs by hand ------------


def written(config) -> str:
    return write_st(encode(config).image, checklist(config))


def again(text: str) -> NextopidFile:
    """The configuration of a program."""
    return NextopidFile.model_validate(decode_listing(read_st(text), VENDORS["nextopid"], {}).data)


@pytest.mark.parametrize("name", NETWORKS)
def test_golden(name):
    assert written(network(name)).encode() == (DATA / f"{name}.st").read_bytes()


@settings(max_examples=60, deadline=None)
@given(configurations())
def test_encode_decode_encode_is_identical(config):
    text = write_st(encode(config).image)
    found = read_st(text)
    back = encode(NextopidFile.model_validate(decode(found.words, found.settings, found.plc).data))
    assert not back.misfits
    assert write_st(back.image) == text
    assert not found.notes
    assert back.order == encode(config).order


# --- expressions -----------------------------------------------------------------------------------------------------

NAMES = {"a": 0, "b": 1, "c": 2}


def calculated(expression, signals: list[float]) -> float:
    stack = [0.0] * (expression.depth + 2)
    return evaluate(expression.code, expression.constants, 0, len(expression.code), signals, stack)


def in_st(expression) -> str:
    return print_expression(expression.code, expression.constants, list(NAMES).__getitem__, ST_DIALECT)


def from_st(text: str):
    """Structured Text back to an expression."""
    tokens = tokens_of(text)[0][:-1]
    wiring = Wiring.parse(tokens, REAL, lambda parts: (parts[0].text, REAL))
    return parse(wire_text(wiring.code, wiring.constants, wiring.names.__getitem__), NAMES)


@settings(max_examples=300, deadline=None)
@given(EXPRESSIONS, st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3))
def test_an_expression_keeps_its_value(text, signals):
    text = PLACE.sub(lambda place: "abc"[int(place.group(1)) % 3], text)
    expression = parse(text, NAMES)
    back = from_st(in_st(expression))
    assert back.code == expression.code
    assert back.constants == expression.constants
    wanted, found = calculated(expression, signals), calculated(back, signals)
    assert found == wanted or (math.isnan(found) and math.isnan(wanted))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("1/2", "1.0 / 2.0"),
        ("a - (b - c)", "a - (b - c)"),
        ("(a - b) - c", "a - b - c"),
        ("a / (b * c)", "a / (b * c)"),
        ("(a + b) * c", "(a + b) * c"),
        ("a - -b", "a - (-b)"),
        ("a * -2", "a * (-2.0)"),
        ("-(a + b) * c", "-(a + b) * c"),
        ("a + (-b * c)", "a + (-b * c)"),
        ("-a", "-a"),
        ("--a", "a"),
        ("- 50", "(-50.0)"),
        ("(50)", "(50.0)"),
        ("max(a, b, 1e-7)", "MAX(MAX(a, b), 1.0E-7)"),
        ("min(a, min(b, c))", "MIN(a, MIN(b, c))"),
        ("sqrt(abs(a)) * 3E6", "SQRT(ABS(a)) * 3000000.0"),
    ],
)
def test_how_an_expression_is_printed(text, wanted):
    assert in_st(parse(text, NAMES)) == wanted


def test_numbers():
    assert [real_text(x) for x in (2.0, 0.1, -0.0, 1e-6, 1e16, 123456.5, -3.4e38)] == [
        "2.0",
        "0.1",
        "0.0",
        "1.0E-6",
        "1.0E16",
        "123456.5",
        "-3.4E38",
    ]


def test_long_expressions_are_written_without_blanks():
    text = "+".join("a" * 500)
    back = from_st(in_st(parse(text, NAMES)))
    assert back.text == text
    assert parenthesis_depth("(a(b)c)(d)") == 2


# --- writing ---------------------------------------------------------------------------------------------------------


def changed(**loop) -> NextopidFile:
    """The second network with another first loop."""
    data = copy.deepcopy(OVERRIDE)
    data["loops"][0].update(loop)
    return NextopidFile.model_validate(data)


def test_names_that_differ_only_in_capitals_are_refused():
    data = copy.deepcopy(OVERRIDE)
    data["signals"]["pic"] = 1
    with pytest.raises(UnwritableError, match="takes the name for that of another"):
        written(NextopidFile.model_validate(data))
    with pytest.raises(UnwritableError, match="takes the name for that of a type or function of the library"):
        written(changed(name="ControlLag", type="PIDA_REAL"))


def test_a_variable_of_the_program_is_not_called_like_a_type():
    split = {"name": "AutoTune", "type": "ControlSplitRange", "MV": "FIC.MV", "SPLIT": 50, "Mode": 0}
    data = copy.deepcopy(OVERRIDE)
    data["blocks"].append(split)
    data["loops"][0]["SP"] = "AutoTune.Mode * 2"
    text = written(NextopidFile.model_validate(data))
    assert "AutoTune_Mode_1 : USINT := 0;" in text  # AUTOTUNE_MODE is what the library calls an enumeration


def test_an_interval_that_is_no_multiple_is_refused():
    with pytest.raises(UnwritableError, match=r"PIC: 0.25 s is no whole number of cycles of the task, 0.1 s"):
        written(changed(sample_time=0.25))
    assert "_Cycle" not in written(changed(sample_time=0.1)).replace("FIC_Cycle", "")
    assert "PIC_Cycle : UDINT;" in written(changed(sample_time=6553.6))


def test_a_call_says_what_it_reads_of_the_previous_cycle():
    lines = written(changed(BIAS="PIC.MV / 2 + PIC.SP", SP_CASC="HEAT.SP", MaxVarMV="FIC.SP")).splitlines()
    at = next(i for i, line in enumerate(lines) if line.startswith("PIC("))
    assert lines[at - 1] == "(* of the previous cycle: SEL.MV, SEL.OVERR1, PIC.MV *)"
    found = read_st("\n".join(lines))
    assert found.words["PIC.BIAS"] == Wire("PIC.MV / 2 + PIC.SP")
    assert not found.notes


def test_nothing_in_a_text_ends_a_comment():
    text = written(changed(description="*) (* *) // {x} 'y\u2028", pv={"unit": "(**)"}))
    comments = tokens_of(text)[1]
    assert all(comment.text.count("*)") == comment.text.count("(*") == 0 for comment in comments)
    assert again(text).loops[0] == changed(description="*) (* *) // {x} 'y\u2028", pv={"unit": "(**)"}).loops[0]


# --- reading ---------------------------------------------------------------------------------------------------------

PLAIN = """(* plc: {"sample_time": 0.1} *)
program Plant // by hand
var_global constant
    FT_101 AT %ID0 : REAL; Factor, Unused : REAL := 1_0.5E-1; (* two *)
end_var
VAR
    {attribute 'hide'}
    tic_1 : pida_real := (kp := 16#10, Ti_Ki := REAL#1.5, indep := 1, SP := INT#-5);
    Timer : TON := (PT := T#5s);
    Alarm : BOOL := true;
END_VAR
TIC_1.SP := 50.0; /* set point */
TIC_1.TRK_IN := Alarm;
Timer(IN := Alarm, PT := T#1h2m);
Tic_1(PV := Factor * FT_101 - MAX(1, 2, ft_101), MAXMV := -1_00);
IF Timer.Q THEN Lamp := TIC_1.MV > 5; END_IF;
AO := tic_1.MV;;
END_PROGRAM
"""


def test_a_program_by_hand():
    found = read_st(PLAIN)
    assert found.plc == {"sample_time": 0.1, "program": "Plant"}
    assert found.settings == ({"loop": "tic_1", "type": "PIDA_REAL"},)
    assert found.words == {
        "FT_101": 0.0,
        "Factor": 1.05,
        "Unused": 1.05,
        "Alarm": True,
        "tic_1.Kp": 16.0,
        "tic_1.Ti_Ki": 1.5,
        "tic_1.Indep": True,
        "tic_1.SP": 50.0,
        "tic_1.MaxMV": -100.0,
        "tic_1.TRK_IN": Wire("Alarm"),
        "tic_1.PV": Wire("Factor * FT_101 - max(1, 2, FT_101)"),
    }
    assert found.notes == (
        "statements that are not about blocks of the library are left out: lines 14, 16, 17",
        "variables that no block reads are left out: Timer",
    )


def body(statements: str, variables: str = "") -> str:
    """A program with two loops, a filter and some signals; the statements begin in line 4."""
    return (
        "PROGRAM Main VAR A : PIDA_REAL; B : PIDA_REAL; F : ControlLowFilter; X : REAL := 3.0; Y : INT; Z : BOOL;\n"
        f"{variables}\nEND_VAR\n{statements}\nEND_PROGRAM"
    )


OTHER_VARIABLES = "S : STRING; T : TIME; V : REAL := X; N__1 : REAL; L : PIDA_TUNE_REAL;"


def test_only_what_is_wired_is_a_signal_where_no_comment_says_more():
    found = read_st(body("A(PV := X, TRK_IN := Z); Q := 1;", "Q : REAL; S : STRING;"))
    assert {name: value for name, value in found.words.items() if "." not in name} == {"X": 3.0, "Z": False}
    assert found.notes[0] == "these blocks are declared and never called: B, F"
    assert found.notes[-1] == "variables that no block reads are left out: Y, Q, S"


def test_whole_variables_keep_their_type_where_a_configuration_has_it():
    found = read_st(body("A(PV := Y / 10.0, SP := INT_TO_REAL(Y), BIAS := DINT_TO_REAL(W));", "W : DINT := 7;"))
    assert found.words["A.PV"] == Wire("Y / 10")
    assert found.words["A.SP"] == Wire("(Y)")
    assert repr(found.words["Y"]) == "0"
    assert repr(found.words["W"]) == "7.0"
    assert found.notes[-1] == "these variables are not REAL in the program, and are REAL signals here: W"


@pytest.mark.parametrize("kind", sorted(REAL_TYPES | INTEGER_TYPES))
def test_only_whole_numbers_are_divided_without_a_remainder(kind):
    text = body("A(PV := V / 2);", f"V : {kind};")
    if kind in REAL_TYPES:
        assert read_st(text).words["A.PV"] == Wire("V / 2")
    else:
        with pytest.raises(ListingError, match="whole numbers are divided without a remainder"):
            read_st(text)


def test_functions_are_named_after_their_variables():
    variables = "Low_MV, Low_OVERR1, Low_OVERR2, Other : REAL;"
    call = "ControlSelectMin(MV1 := A.MV, MV2 := B.MV, MV => Low_MV, OVERR1 => Low_OVERR1, OVERR2 => Low_OVERR2);"
    more = "controlselectmax(MV1 := Low_MV, MV2 := 5.0, MV => Other);"
    found = read_st(body(f"A(TRK_VAL := Low_MV); B(); {call} {more}", variables))
    assert [entry for entry in found.settings if "block" in entry] == [
        {"block": "F", "type": "ControlLowFilter"},
        {"block": "Low", "type": "ControlSelectMin"},
        {"block": "SelectMax_1", "type": "ControlSelectMax"},
    ]
    assert found.words["A.TRK_VAL"] == Wire("Low.MV")
    assert found.words["SelectMax_1.MV1"] == Wire("Low.MV")
    assert found.words["SelectMax_1.MV2"] == 5.0


def test_a_variable_that_takes_an_output_stands_for_it():
    found = read_st(body("F(InVar := X, OutVar => Q); A(PV := Q);", "Q : REAL;"))
    assert found.words["A.PV"] == Wire("F.OutVar")


def test_another_order_of_execution_is_told():
    notes = read_st(body("A(PV := F.OutVar); F(InVar := X); B(PV := F.OutVar);")).notes
    assert len(notes) == 2
    assert notes[0].startswith("A.PV reads F of the previous cycle in the program, and of the same one in the order")
    assert not any("cycle" in note for note in read_st(body("F(InVar := X); A(PV := F.OutVar); B();")).notes)


@pytest.mark.parametrize(
    ("reads", "order"),
    [
        ({"A": "B", "B": "X", "L": "A", "M": "L"}, "BALM"),
        ({"A": "B", "B": "A", "L": "A"}, "ABL"),
        ({"B": "A", "A": "B"}, "BA"),
        ({"A": "A", "B": "X"}, "AB"),
        ({"A": "L", "B": "A", "L": "B"}, "LAB"),
        ({"A": "M", "B": "A", "L": "B", "M": "L"}, "LMAB"),
        ({"A": "L", "B": "A", "M": "X", "L": "B"}, "MLAB"),
        ({"A": "C", "B": "A", "C": "B", "L": "X"}, "LABC"),
        ({"C": "D", "D": "C", "A": "C", "B": "A"}, "CDAB"),
    ],
)
def test_a_ring_begins_with_its_first_loop_or_its_first_block(reads, order):
    wires = {name: {"L": "L.MV", "M": "M.MV", "X": "X"}.get(read, f"{read}.OutVar") for name, read in reads.items()}
    loop = {"type": "PIDA_REAL", "Kp": 1, "Ti_Ki": 0, "Td_Kd": 0, "SP": 1, **FULL}
    items = [
        {
            "name": name,
            **(loop | {"PV": wire} if name in "LM" else {"type": "ControlLowFilter", "Tc": 1, "InVar": wire}),
        }
        for name, wire in wires.items()
    ]
    file = {"pidcfg": 1, "vendor": "nextopid", "plc": {"sample_time": 0.1}, "signals": {"X": 1.0}}
    file |= {"blocks": [item for item in items if "Tc" in item], "loops": [item for item in items if "PV" in item]}
    encoding = encode(NextopidFile.model_validate(file))
    assert "".join(encoding.layout.instances[i].name for i in encoding.order) == order


def test_every_nth_cycle():
    gate = "IF Y = 0 THEN A(PV := X); END_IF Y := (Y + 1) MOD 5;"
    found = read_st('(* plc: {"sample_time": 0.1} *)' + body(gate))
    assert found.settings[0] == {"loop": "A", "type": "PIDA_REAL", "sample_time": 0.5}
    bare = add_zeros(read_st(body(gate)))
    assert bare.settings[0] == {"loop": "A", "type": "PIDA_REAL", "cycles": 5}
    decoded = decode(bare.words, bare.settings, bare.plc, {"sample_time": Decimal("0.2")}).data
    assert decoded["loops"][0]["sample_time"] == 1
    beside = '(* plc: {"sample_time": 0.1} *) (* loop: {"loop": "A", "type": "PIDA_REAL", "sample_time": 1} *)'
    with pytest.raises(ListingError, match=r"called in every 5 cycles of 0.1 s, not of 1 s together"):
        read_st(beside + body(gate))


@pytest.mark.parametrize(("cycles", "time"), [("1", None), ("2", 0.2), ("16#A", 1.0)])
def test_a_counter_may_count_any_number_of_cycles(cycles, time):
    gate = f"IF Y = 0 THEN A(PV := X); END_IF Y := (Y + 1) MOD {cycles};"
    assert read_st('(* plc: {"sample_time": 0.1} *)' + body(gate)).settings[0].get("sample_time") == time


GATE = "IF Y = 0 THEN A(PV := X); END_IF"
COUNT = "Y := (Y + 1) MOD 4;"
NOT_COUNTED = r"Y is not counted as in Y := \(Y \+ 1\) MOD 5"
INSIDE = "[AB] is called inside another statement"


@pytest.mark.parametrize(
    ("statements", "says"),
    [
        *((f"{GATE} Y := (Y + 1) MOD {cycles};", NOT_COUNTED) for cycles in ("0", "BOOL#1", "2.0", "T#2s")),
        *(
            (f"{GATE} Y := {value};", NOT_COUNTED)
            for value in (
                "(Y + 2) MOD 4",
                "(Y - 1) MOD 4",
                "(1 + Y) MOD 4",
                "Y + 1 MOD 4",
                "(X + 1) MOD 4",
                "(Y + 1) * 4",
            )
        ),
        (f"{COUNT} {GATE}", NOT_COUNTED),
        (f"{GATE} {COUNT} {COUNT}", NOT_COUNTED),
        (f"Y := 0; {GATE} {COUNT}", NOT_COUNTED),
        (f"{GATE} {COUNT} IF Z THEN Y := 0; END_IF", NOT_COUNTED),
        (f"{GATE} {COUNT} CASE Y OF 2: Y := 3; END_CASE", NOT_COUNTED),
        (f"{GATE} {COUNT} FOR Y := 1 TO 3 DO ; END_FOR", NOT_COUNTED),
        (f"{GATE} {COUNT} Foo(Q => Y);", NOT_COUNTED),
        (f"{GATE} {COUNT} B(PV := Y);", NOT_COUNTED),
        (f"{GATE} {COUNT} X := Y;", NOT_COUNTED),
        (f"{GATE} {COUNT} IF Y = 2 THEN B.Manual := Z; END_IF B(PV := X);", NOT_COUNTED),
        (f"{GATE} {COUNT} {GATE.replace('A', 'B')}", INSIDE),
        *(
            (f"IF {gate} THEN {calls} END_IF {COUNT}", INSIDE)
            for gate, calls in (
                ("Y = 1", "A(PV := X);"),
                ("Y <> 0", "A(PV := X);"),
                ("0 = Y", "A(PV := X);"),
                ("Y = 0 AND Z", "A(PV := X);"),
                ("X = 0", "A(PV := X);"),
                ("Q = 0", "A(PV := X);"),
                ("Z", "A(PV := X);"),
                ("Y = 0", "A(PV := X); B(PV := X);"),
                ("Y = 0", "A(PV := X); A(PV := X);"),
                ("Y = 0", "A(PV := X); A.SP := 5.0;"),
                ("Y = 0", "A(PV := X); X := 1.0;"),
                ("Y = 0", "X := 1.0; A(PV := X);"),
                ("Y = 0", "A(PV := X); ELSE ;"),
                ("Y = 0", "IF Z THEN ; END_IF; A(PV := X);"),
            )
        ),
    ],
)
def test_a_loop_that_is_called_otherwise_than_in_every_nth_cycle_is_refused(statements, says):
    for plc in ("", '(* plc: {"sample_time": 0.1} *)'):
        with pytest.raises(ListingError, match=says):
            read_st(plc + body(statements))


@pytest.mark.parametrize("initial", ["", " := 0"])
def test_a_loop_of_every_nth_cycle_may_be_assigned_before_its_call_and_its_counter_begins_with_0(initial):
    text = body(f"IF Y = 0 THEN A.SP := 5.0; A(PV := X); END_IF {COUNT}").replace("Y : INT", f"Y : INT{initial}")
    assert (read_st(text).settings[0]["cycles"], read_st(text).words["A.SP"]) == (4, 5.0)
    for other in ("1", "(A := 1)"):
        with pytest.raises(ListingError, match="Y counts the cycles of A, and must begin with 0"):
            read_st(body(f"{GATE} {COUNT}").replace("Y : INT", f"Y : INT := {other}"))


def test_two_loops_may_share_a_counter():
    gates = "IF Y = 0 THEN A(PV := X); END_IF IF Y = 0 THEN B(PV := X); END_IF Y := (Y + 1) MOD 3;"
    found = read_st('(* plc: {"sample_time": 0.1} *)' + body(gates))
    assert [entry.get("sample_time") for entry in found.settings] == [0.3, 0.3, None]


def test_a_structure_is_no_input():
    with pytest.raises(ListingError, match="E is read by a block, and is neither a number nor a TIME nor a BOOL"):
        read_st(body("A(PV := X, ErrBits => E); B(PV := E);", "E : PID_ERR;"))


@pytest.mark.parametrize(
    ("interval", "task", "cycles"),
    [
        (None, None, 1),
        (None, 0.5, 1),
        (1, 0.5, 2),
        (0.2, 0.2, 1),
        (0.3, 0.1, 3),
        (3600, 1, 3600),
        (5, 2.5, 2),
        (1, None, None),
        (1, 0, None),
        (1, -1, None),
        (0, 1, None),
        (-1, 1, None),
        (1, 0.3, None),
        (0.5, 1, None),
    ],
)
def test_the_interval_of_a_loop_is_whole_cycles_of_the_task(interval, task, cycles):
    for key in ("loop", "block"):
        if cycles is None:
            with pytest.raises(
                UnwritableError, match=f"L: {interval} s is no whole number of cycles of the task, {task}"
            ):
                cycles_of({key: "L", "sample_time": interval}, {"sample_time": task})
        else:
            assert cycles_of({key: "L", "sample_time": interval}, {"sample_time": task}) == cycles


def test_a_name_that_ends_in_a_point_is_left_out_with_its_statement():
    assert (
        "statements that are not about blocks of the library are left out: lines 4" in read_st(body("X := Y.;")).notes
    )


def test_names_that_read_like_truths_stay_names():
    found = read_st(body("A(PV := N, SP := inf);", "N : REAL; inf : REAL;"))
    assert (found.words["A.PV"], found.words["A.SP"]) == (Wire("(N)"), Wire("(inf)"))


@pytest.mark.parametrize(
    ("statements", "place", "says"),
    [
        ("A(PV := X", (4, 1), "the statement that begins here has no end: ';' or ')' is missing"),
        ("A(PV := X);\nA(PV := X);", (5, 1), "A is called again"),
        ("A(50.0);", (4, 3), "has no name; write it as in PV := FT_101"),
        ("A(PV := X, PV := X);", (4, 12), "PV stands here again"),
        ("A.SP := 1; A(SP := 2);", (4, 14), "A.SP is assigned again"),
        ("A(EN := Z);", (4, 3), "A is called on a condition"),
        ("A(QV := X);", (4, 3), "PIDA_REAL has no input parameter QV; did you mean"),
        ("A(PV := FT_101);", (4, 9), "FT_101 is no variable that the program declares"),
        ("A(PV := B.XV);", (4, 11), "PIDA_REAL has no parameter XV"),
        ("A(PV := L.AutoTuneParam.Mode);", (4, 9), "L.AutoTuneParam.Mode is AUTOTUNE_MODE; numbers and BOOLs can"),
        ("A(PV := N__1);", (2, 38), "'N__1' is not usable as the name of an instance"),
        ("A(PV := V);", (2, 23), "V is read by a block, and begins with something that is no literal"),
        ("A(PV := X.Y);", (4, 9), "X.Y is no variable that the program declares, and no parameter"),
        ("A(PV := Z);", (4, 9), "Z is a BOOL; numbers are wanted"),
        ("A(TRK_IN := NOT X);", (4, 17), "NOT takes a BOOL; put a comparison into parentheses: NOT (PV < 4.0)"),
        ("A(TRK_IN := X);", (4, 13), "X is a REAL; a BOOL is wanted"),
        ("A(TRK_IN := X + 1.0);", (4, 13), "this is a REAL; a BOOL is wanted"),
        ("A(TRK_IN := X > Z);", (4, 15), "a REAL and a BOOL are compared here"),
        ("A(TRK_IN := T#5s > X);", (4, 18), "a TIME and a REAL are compared here"),
        ("A(TRK_IN := Z AND X);", (4, 15), "AND takes BOOLs"),
        ("A(PV := X + Z);", (4, 11), "+ takes two numbers"),
        ("A(PV := -Z);", (4, 10), "a sign wants a number"),
        ("A(PV := ABS(Z));", (4, 9), "ABS takes numbers"),
        *(
            (f"A(PV := {word}({', '.join('X' * count)}));", (4, 9), f"{word} does not take {count} argument{s}")
            for words, count, s in (
                (("MIN", "MAX"), 1, ""),
                (("ABS", "SQRT", "INT_TO_REAL", "TO_REAL", "TIME_TO_REAL"), 2, "s"),
            )
            for word in words
        ),
        ("A(PV := TIME_TO_REAL(T#5s));", (4, 9), "write TIME_TO_REAL(…) / 1000.0, since a configuration has s"),
        ("A(PV := TIME_TO_REAL(T));", (4, 9), "TIME_TO_REAL gives ms; write TIME_TO_REAL(…) / 1000.0"),
        ("A(PV := X + );", (4, 11), "a number or a name is missing before 'the end of the expression'"),
        ("A(PV := B);", (4, 9), "B is no variable that the program declares, and no parameter"),
        ("A(PV := B.ErrBits.KX);", (4, 11), "PIDA_REAL has no parameter ErrBits.KX; did you mean ErrBits.Kp?"),
        ("B.ErrBits.Kp := Z;", (4, 3), "PIDA_REAL has no input parameter ErrBits.Kp"),
        ("A(PV := S);", (2, 1), "S is read by a block, and is neither a number nor a TIME nor a BOOL"),
        ("A(PV := T#5s);", (4, 9), "A.PV: T#5s is not a value of REAL; numbers are in s"),
        ("A(Tfd := TIME#100ms);", (4, 10), "numbers are in s"),
        ("A(PV := T#5s7m);", (4, 9), "T#5s7m is not a TIME; write it as in T#1m30s or T#500ms"),
        ("A(PV := 1 / 2 * X);", (4, 11), "whole numbers are divided without a remainder"),
        ("A(PV := Y / 2);", (4, 11), "whole numbers are divided without a remainder"),
        ("A(PV := X MOD 2);", (4, 11), "unexpected 'MOD'"),
        ("A(PV := X ** 2);", (4, 11), "unexpected '**'"),
        ("A(PV := LIMIT(0.0, X, 1.0));", (4, 9), "LIMIT is a function that cannot be wired"),
        ("A(PV := REAL_TO_INT(X));", (4, 9), "can only be around the whole expression of an INT parameter"),
        ("A(SP := 1E39);", (4, 9), "1E39 is not a value of REAL"),
        ("A(SP := TRUE);", (4, 9), "A.SP: TRUE is not a value of REAL"),
        ("A(Manual := 2);", (4, 13), "A.Manual: 2 is not a value of BOOL"),
        ("IF Z THEN A(PV := X); END_IF", (4, 11), "A is called inside another statement"),
        ("Check(A);", (4, 7), "A is used as a whole inside another statement"),
        ("R := ControlSelectMax(1.0, 2.0);", (4, 6), "ControlSelectMax is called inside another statement"),
        ("FOR Y := 1 TO 3 DO ; END_FOR A(PV := Y);", (4, 38), "Y is assigned in line 4"),
        ("Foo(Q => X); A(PV := X);", (4, 22), "X is assigned in line 4"),
        ("RETURN; A();", (4, 1), "what stands behind is not always executed"),
        ("PIDA_REAL(PV := X);", (4, 1), "PIDA_REAL is a function block: declare an instance"),
        ("IF Z THEN A.B", (4, 1), "IF has no END_IF"),
        ("(* open", (4, 1), "has no end"),
        ("A(PV := ?);", (4, 9), "is nothing that Structured Text has here"),
        ("A(PV := " + "(" * 200 + "X" + ")" * 200 + ");", (4, 110), "more than 100 levels of nesting"),
        ("A(PV := " + "+X" * 600 + ");", (4, 9), "the expression is longer than 1000 characters"),
        ("A(SP := " + "9" * 5000 + ");", (4, 9), "a number of more than 32 digits"),
        ("END_PROGRAM X := 1;", (4, 13), "stands behind END_PROGRAM"),
        ("FUNCTION G : REAL", (4, 1), "FUNCTION has no END_FUNCTION"),
        ("ACTION G :", (4, 1), "a file holds one PROGRAM"),
        ('(* loop: {"loop": "C", "type": "PIDA_REAL"} *)', (4, 1), "C is not declared"),
        ('(* loop: {"loop": "A", "type": "PIDA_INT"} *)', (1, 18), "declared otherwise than the comment in line 4"),
        ('(* loop: {"block": "C", "type": "PID"} *)', (4, 1), "the comment names no block of the library"),
        ('(* loop: {"loop": "' + "C" * 99 + '"} *)', (4, 1), ': {"loop": "' + "C" * 70),
        ("IF Z THEN A := X; END_IF", (4, 11), "A is assigned as a whole"),
        ('(* plc: {"sample_time": ' + "1" * 5000 + "} *)", (4, 1), "has too many digits"),
        ("(* plc: {oops} *)", (4, 1), "the settings are not JSON"),
        ("IF Y = 0 THEN A(); END_IF", (4, 4), "Y is not counted as in Y := (Y + 1) MOD 5"),
        ("IF Y = 0 THEN A; END_IF", (4, 15), "A is used as a whole inside another statement"),
        ("A(Manual := -TRUE);", (4, 14), "a sign wants a number"),
    ],
)
def test_refused(statements, place, says):
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        read_st(body(statements, OTHER_VARIABLES))
    assert "C" * 71 not in str(error.value)
    assert (error.value.line, error.value.column) == place


GLOBAL = "VAR_GLOBAL\n TIC_1 : PIDA_REAL := (Kp := 1.5, MaxMV := 100.0, MaxPV := 200.0); X : REAL := 2.0;\nEND_VAR\n"
PROGRAM_BEGIN = "PROGRAM Main\n"
EXTERNAL = "VAR_EXTERNAL\n tic_1 : pida_real; X : REAL;\nEND_VAR\n"


@pytest.mark.parametrize("before", [True, False])
def test_an_external_variable_is_the_global_one(before):
    text, call = PROGRAM_BEGIN + EXTERNAL, "TIC_1(PV := X);\nEND_PROGRAM"
    plain = read_st(GLOBAL + PROGRAM_BEGIN + call)
    found = read_st((GLOBAL + text if before else text + GLOBAL) + call)
    assert found.words["TIC_1.Kp"] == Decimal("1.5")
    assert (found.words, [entry["loop"] for entry in found.settings]) == (plain.words, ["TIC_1"])


@pytest.mark.parametrize(
    ("external", "says"),
    [
        ("X : INT;", "X is declared with another type than in line 2"),
        ("X : REAL := 3.0;", "X is declared again"),
        ("TIC_1 : PIDA_INT;", "TIC_1 is declared with another type than in line 2"),
    ],
)
def test_an_external_variable_that_is_another_one_is_refused(external, says):
    text = f"{GLOBAL}{PROGRAM_BEGIN}VAR_EXTERNAL {external} END_VAR\nTIC_1(PV := X);\nEND_PROGRAM"
    with pytest.raises(ListingError, match=says) as error:
        read_st(text)
    assert (error.value.line, error.value.column) == (5, 14)


@pytest.mark.parametrize(
    ("variables", "says"),
    [
        ("L : ARRAY [1..3] OF PIDA_REAL;", "instances of PIDA_REAL are declared one by one"),
        ("L : ControlSelectMax;", "ControlSelectMax is a function, which has no instance"),
        ("a : REAL;", "a is declared again"),
        ("L : PIDA_REAL := 5;", "initial values of an instance stand in parentheses"),
        ("L : PIDA_REAL := (SP := 1) + X;", "'X' stands behind the structure"),
        ("L : PIDA_REAL := (SP := 1, );", "a name is missing after the parenthesis or comma, before ')'"),
        ("L : PIDA_REAL := (SP := X);", "L.SP begins with something that is no literal"),
        ("L : PIDA_REAL := (SP := 1, sp := 2);", "sp stands here again"),
        ("L : PIDA_REAL := (MV := 1);", "PIDA_REAL has no input parameter MV"),
        ("L : PIDA_TUNE_REAL := (AutoTuneParam := (Mode := AUTOTUNE_X));", "AUTOTUNE_X is none of AUTOTUNE_P"),
        ("L__1 : PIDA_REAL;", "is not usable as the name of an instance"),
        ("L : PIDA_REAL", "';' is missing"),
        ("L PIDA_REAL;", "':' is missing after L"),
        (f"L : PIDA_TUNE_REAL := {'(A := ' * 60}1{')' * 60};", "structures are nested too deeply"),
    ],
)
def test_declarations_that_are_refused(variables, says):
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        read_st(body("A();", variables))
    assert error.value.line >= 1


@pytest.mark.parametrize(
    ("text", "wire"),
    [
        ("TIME_TO_REAL(T) / 1000.0", "T"),
        ("ABS(X) / 1000.0", "abs(X) / 1000"),
        ("(X) / 1000.0", "X / 1000"),
        ("X + TIME_TO_REAL(T) / 1000.0", "X + T"),
        ("TIME_TO_REAL(T) / 1000.0 - X", "T - X"),
        ("TIME_TO_REAL(T) / 1000.0 * X", "T * X"),
        ("X < 1.0", None),
        ("X * TIME_TO_REAL(T) / 1000.0", None),
        ("TIME_TO_REAL(T) / 100.0", None),
        ("TIME_TO_REAL(T) * 1000.0", None),
    ],
)
def test_a_time_counts_in_seconds_where_it_is_divided_by_1000(text, wire):
    program = body(f"A(PV := {text});", "T : TIME;")
    if wire is None:
        with pytest.raises(ListingError):
            read_st(program)
    else:
        assert read_st(program).words["A.PV"] == Wire(wire)


@pytest.mark.parametrize("count", range(5))
def test_an_even_number_of_negations_is_none(count):
    for sign, name, parameter in (("NOT ", "Z", "TRK_IN"), ("-", "X", "PV")):
        found = read_st(body(f"A({parameter} := {sign * count}{name});")).words[f"A.{parameter}"]
        assert found == Wire(f"{sign * (count % 2)}{name}")


@pytest.mark.parametrize("name", ["X", "B.MV", "B.ErrBits.Kp"])
def test_what_is_no_time_does_not_count_in_seconds(name):
    kind = "BOOL" if "Bits" in name else "REAL"
    with pytest.raises(ListingError, match=f"^{name} is {kind}; a TIME is wanted$") as error:
        read_st(body(f"A(PV := X + TIME_TO_REAL({name}) / 1000.0);"))
    assert (error.value.line, error.value.column) == (4, 26)


@pytest.mark.parametrize(("before", "levels"), [("A", 100), ("L", 99)])
def test_a_hundred_levels_of_nesting_are_read_a_conversion_among_them(before, levels):
    conversion = "REAL_TO_INT" if before == "L" else ""
    for count, fits in ((levels, True), (levels + 1, False)):
        inside = f"{'(' * count}X{')' * count}"
        text = body(f"{before}(PV := {f'{conversion}({inside})' if conversion else inside});", "L : PIDA_INT;")
        with nullcontext() if fits else pytest.raises(ListingError, match="more than 100 levels of nesting"):
            assert read_st(text).words[f"{before}.PV"] == Wire("X")


def test_an_expression_of_a_thousand_parts_is_the_longest():
    assert read_st(body(f"A(PV := -X{'+X' * 499});")).words["A.PV"] == Wire("-X" + "+X" * 499)
    with pytest.raises(ListingError, match="longer than 1000 characters"):
        read_st(body(f"A(PV := X{'+X' * 500});"))


@pytest.mark.parametrize(
    ("name", "hint"), [("Levl", "; did you mean Level?"), ("B", ""), ("Level.X", ""), ("Something", "")]
)
def test_a_name_that_means_nothing_is_told_with_the_nearest_variable(name, hint):
    with pytest.raises(ListingError) as error:
        read_st(body(f"A(PV := {name});", "Level : REAL;"))
    assert str(error.value) == f"{name} is no variable that the program declares, and no parameter{hint}"


@pytest.mark.parametrize(
    ("variables", "statements", "name"),
    [
        ("P : ControlPWM;", "P(MV := X, Period := Y);", "P.Period"),
        ("M1, M2 : REAL;", "ControlSplitRange(MV := X, Mode := Y, MV1 => M1, MV2 => M2);", "SplitRange_1.Mode"),
        ("L : PIDA_TUNE_REAL;", "L.AutoTuneParam.Mode := Y; L(PV := X);", "L.AutoTuneParam.Mode"),
    ],
)
def test_a_parameter_that_chooses_something_takes_a_literal(variables, statements, name):
    said = f"{name}( takes a literal, and cannot be wired|: Y is none of AUTOTUNE_P, AUTOTUNE_PI, AUTOTUNE_PID)$"
    with pytest.raises(ListingError, match=said) as error:
        read_st(body(statements, variables))
    assert error.value.line == 4


@pytest.mark.parametrize(
    ("text", "says", "place"),
    [
        ("L : ARRAY [1..2] OF PIDA_REAL;", "L: instances of PIDA_REAL are declared one by one", (2, 5)),
        ("L : ControlSelectMax;", "ControlSelectMax is a function, which has no instance", (2, 5)),
        ("L : REAL; l : INT;", "l is declared again", (2, 11)),
        ('(* loop: {"loop": "A", "type": "PIDA_REAL"} *)' * 2, "A stands here again", (2, 47)),
        ('(* loop: {"block": "Ö", "type": 1} *)', 'names no block of the library: {"block": "Ö", "type": 1}', (2, 1)),
        ('(* loop: {"loop": "C", "type": "PIDA_REAL"} *)', "C is not declared", (2, 1)),
        ('(* loop: {"block": "N__1", "type": "ControlSelectMax"} *)', "'N__1' is not usable as the name", (2, 1)),
        ("N__1 : PIDA_REAL;", "'N__1' is not usable as the name", (2, 1)),
    ],
)
def test_a_declaration_or_a_comment_is_refused_at_its_place(text, says, place):
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        read_st(body("A(PV := X);", text))
    assert (error.value.line, error.value.column) == place


def test_words_of_an_enumeration_and_structures():
    for mode in ("AUTOTUNE_PI", "AUTOTUNE_MODE.AUTOTUNE_PI", "autotune_mode#autotune_pi"):
        found = read_st(body("", f"L : PIDA_TUNE_REAL := (AutoTuneParam := (NumCycles := 3, Mode := {mode}));"))
        assert found.words == {"L.AutoTuneParam.NumCycles": 3, "L.AutoTuneParam.Mode": "AUTOTUNE_PI"}
    found = read_st(body("L.AutoTuneParam.NumCycles := 4;", "L : PIDA_TUNE_REAL;"))
    assert found.words == {"L.AutoTuneParam.NumCycles": 4}
    found = read_st(body("L.AutoTuneParam.NumCycles := TO_UINT(Y);", "L : PIDA_TUNE_REAL;"))
    assert found.words["L.AutoTuneParam.NumCycles"] == Wire("(Y)")
    with pytest.raises(ListingError, match=r"L.AutoTuneParam.Mode: Y is none of AUTOTUNE_P"):
        read_st(body("L.AutoTuneParam.Mode := Y;", "L : PIDA_TUNE_REAL;"))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("PROGRAM a", True),
        ("\n(* x *) // y\nvar\n", True),
        ("(* a (* b *) c *)\nPROGRAM a", True),
        ("/* a (* b */ PROGRAM a", True),
        ("{attribute 'x'}\nVAR_GLOBAL\n", True),
        ('{"words": []}', False),
        ("name,type,value\n", False),
        ("VAR_1 REAL 5", False),
        ("PROGRAM_1", False),
        ("(* open", False),
        ("(*" * 50_000, False),
    ],
)
def test_what_a_program_looks_like(text, wanted):
    assert looks_like_st(text) == wanted


PIECES = [
    "(*",
    "*)",
    ";",
    ":=",
    "(",
    ")",
    "END_IF",
    "IF ",
    "TIC",
    "1",
    "=>",
    ",",
    ".",
    "-",
    "REAL_TO_INT",
    " TRUE ",
    "{",
    "}",
    "'",
    "#",
    "16#FF",
    "T#1s",
    "\n",
    "VAR ",
    "END_VAR",
    "PROGRAM ",
    "é",
    "\x00",
    "[",
    '"',
    "9" * 5000,
    "1e400",
    "null",
]


@settings(max_examples=300, deadline=None)
@given(st.sampled_from(sorted(NETWORKS)), st.randoms(use_true_random=False))
def test_a_damaged_program_is_read_or_refused(name, random):
    text = (DATA / f"{name}.st").read_text("utf-8")
    for _ in range(random.randint(1, 3)):
        at, other = random.randrange(len(text)), random.randrange(len(text))
        piece = random.choice([*PIECES, "", "", text[other : other + 30]])
        text = text[:at] + piece + text[at + random.choice([0, 0, 1, 5, 20]) :]
    found = fault(read_st, text)
    assert found is None or (found.line >= 1 and found.column >= 1)


def test_a_large_program_is_read_in_time():
    statements = "IF Z THEN\n" + "Q := Q + 1;\n" * 40_000 + "END_IF;\n" + "A(PV := X);"
    assert read_st(body(statements)).words["A.PV"] == Wire("X")


def test_what_a_program_does_not_mention_is_zero_and_said():
    declared = "TIC : PIDA_REAL := (SP := 50.0, Kp := 2.0, MaxMV := 100.0, MaxPV := 80.0);"
    found = add_zeros(read_st(f"PROGRAM P\nVAR\n  {declared}\nEND_VAR\nTIC();\nEND_PROGRAM\n"))
    assert (found.words["TIC.Ti_Ki"], found.words["TIC.MinMV"]) == (0.0, 0.0)
    assert found.notes == ("TIC: Td_Kd, Ti_Ki, MinMV, MinPV are not given in the program, and so are 0",)


# --- Programs by hand: values that they change on the way, and what stands beside the program -------------------------

TUNED = (
    "T : PIDA_TUNE_REAL; P : AUTOTUNE_PARAM := (PercAmpMV := 5.0, NumCycles := 3); R : AUTOTUNE_RESULT; Done : BOOL;"
)
WRITTEN_OVER = f"{TUNED} Y : INT; Other : AUTOTUNE_PARAM;\n"
TUNE = "T(AutoTuneParam := P, AutoTuneDone => Done, AutoTuneResult => R);"


def changed_body(statements: str, variables: str = "") -> str:
    """A program with two loops; the statements begin behind the line of the variables."""
    return (
        f"PROGRAM Main VAR A, B : PIDA_REAL; X, Q : REAL; Z, W : BOOL;\n{variables}END_VAR\n{statements}\nEND_PROGRAM"
    )


@pytest.mark.parametrize(
    ("statements", "says"),
    [
        ("A(MV => Q);\nIF Z THEN Q := 0.0; END_IF\nB(SP := Q);", "Q is assigned in line 5"),
        ("A(MV => Q);\nCASE Y OF 1: Q := 0.0; END_CASE\nB(SP := Q);", "Q is assigned in line 5"),
        ("A(MV => Q);\nQ S= Z;\nB(Manual := Q);", "Q is assigned in line 5"),
        (f"P.PercAmpMV := 10.0;\n{TUNE}", "P is assigned in line 4, and is AutoTuneParam of T in line 5"),
        (f"IF Z THEN P.NumCycles := 5; END_IF\n{TUNE}", "P is assigned in line 4, and is AutoTuneParam of T"),
        (f"P := Other;\n{TUNE}", "P is assigned in line 4, and is AutoTuneParam of T"),
        (f"{TUNE}\nP.PercAmpMV := 10.0;", "P is assigned in line 5, and is AutoTuneParam of T in line 4"),
        (f"{TUNE}\nIF Z THEN R.Kp := 1.0; END_IF\nT.Kp := R.Kp;", "R is assigned in line 5"),
        (f"{TUNE}\nDone := FALSE;\nT.Kp := SEL(Done, 1.0, 2.0);", "SEL is a function that cannot be wired"),
        ("X REF= Q;\nA(SP := X);", "X is assigned in line 4"),
    ],
)
def test_what_is_written_over_is_refused_where_a_block_reads_it(statements, says):
    with pytest.raises(ListingError, match=says):
        read_st(changed_body(statements, WRITTEN_OVER))


def test_what_no_block_reads_may_be_written_over():
    found = read_st(changed_body(f"A(MV => Q); IF Z THEN Q := 0.0; END_IF\n{TUNE} R.Kp := 1.0;", TUNED + "\n"))
    assert found.notes[1:2] == ("statements that are not about blocks of the library are left out: lines 4, 5",)


def test_an_input_of_a_function_is_not_what_it_was_before_if():
    call = "ControlSelectMin(MV1 := S_MV1, MV2 := A.MV);"
    variables = "S_MV1 : REAL := 5.0; (* S.MV1 *)\n"
    described = '(* loop: {"block": "S", "type": "ControlSelectMin"} *)'
    with pytest.raises(ListingError, match="S_MV1 is assigned in line 5"):
        read_st(described + changed_body(f"A();\nIF Z THEN S_MV1 := 6.0; END_IF\n{call}", variables))


@pytest.mark.parametrize(
    ("statements", "says"),
    [
        ("{call}\nS_MV1 := 6.0;", "S.MV1 is assigned behind the call of S; assign it before"),
        ("S_MV1 := 6.0;\nS_MV1 := 7.0; {call}", "S.MV1 is assigned again"),
        ("S_MV1 := 6.0;\n{call}", ""),
    ],
)
def test_an_input_of_a_function_is_assigned_once_before_its_call(statements, says):
    variables = "S_MV1 : REAL := 5.0; (* S.MV1 *) S_MV : REAL; (* S.MV *)\n"
    call = "ControlSelectMin(MV1 := S_MV1, MV2 := A.MV, MV => S_MV);"
    described = '(* loop: {"block": "S", "type": "ControlSelectMin"} *)'
    text = described + changed_body("A();\n" + statements.format(call=call), variables)
    if not says:
        assert read_st(text).words["S.MV1"] == 6
        return
    with pytest.raises(ListingError, match=f"^{re.escape(says)}$") as error:
        read_st(text)
    assert (error.value.line, error.value.column) == (6, 1)


@pytest.mark.parametrize(
    ("statement", "value", "when"),
    [("Z S= W;", True, "W"), ("Z R= W;", False, "W"), ("IF X > 1.0 THEN Z s= NOT W; END_IF", True, "X > 1 AND NOT W")],
)
def test_to_set_and_to_reset_are_moves_on_a_condition(statement, value, when):
    found = read_st(changed_body(f"{statement} A(Manual := Z);"))
    assert found.words["A.Manual"] == Wire("Z")
    assert found.plc["moves"] == [{"move": value, "to": "Z", "when": when, "at": "start"}]


@pytest.mark.parametrize(
    ("statements", "says", "line"),
    [
        ("IF THEN B.SP := 5; END_IF A(PV := X);", "a condition is missing after IF", 4),
        ("CASE OF 1: B.SP := 5; END_CASE A(PV := X);", "a condition is missing after CASE", 4),
        ("IF Z THEN X := ; END_IF A(PV := X);", "X is assigned in line 4: wire what it is assigned there", 4),
        (
            "IF Z THEN Z := FALSE;\nB\n.SP := 3; END_IF B(PV := X); A(PV := X);",
            "Z is assigned inside the statement whose condition reads it, before line 5: assign it last",
            4,
        ),
    ],
)
def test_a_branch_that_is_not_read_says_what_it_is_about(statements, says, line):
    with pytest.raises(ListingError) as error:
        read_st(body(statements))
    assert (str(error.value), error.value.line) == (says, line)


@pytest.mark.parametrize(
    "statement", ["Box.A := 1.0;", "Box.B.MV := 1.0;", "Box.Foo(1);", "Y := ;", "Y;", "Foo(Box.A);", "Y[1] := 2;"]
)
def test_what_does_not_concern_a_block_is_left_out(statement):
    found = read_st(body(f"A(PV := X); B(PV := X);\n{statement}"))
    assert "statements that are not about blocks of the library are left out: lines 5" in found.notes


@pytest.mark.parametrize(
    "statement",
    [
        "FOR Q := (1) TO 3 DO Y := 5; END_FOR",
        "FOR Q := 1 TO (3) DO IF (Z) THEN Y := (5); END_IF END_FOR",
        "WHILE (Z) DO Foo(Q := 1); Y := 5; END_WHILE",
        "Foo(Q := (1), R => Y);",
        "Y REF= Q;",
        "FOR Y := 1 TO 3 DO ; END_FOR",
    ],
)
def test_what_a_statement_that_is_left_out_assigns_no_block_reads(statement):
    with pytest.raises(ListingError, match="Y is assigned in line 4: wire what it is assigned there"):
        read_st(body(f"{statement}\nA(PV := Y);"))


CALLED = "V1 : REAL; Q : REAL; L : PIDA_TUNE_REAL; Box : INT;"


@pytest.mark.parametrize(
    ("statements", "says", "place"),
    [
        ("A(PV := X, MV => V1); B(PV := X, MV => V1);", "V1 stands for A.MV already", (4, 40)),
        ("ControlSelectMax(MV1 := X, MV => V1, OVERR1 => V1);", "V1 stands for SelectMax_1.MV already", (4, 48)),
        ("L(PV := X, AutoTuneParam := Y);", "PIDA_TUNE_REAL has no input parameter AutoTuneParam; did you", (4, 12)),
        ("L.AutoTuneParam.NumCycles := 3;\nL.AutoTuneParam.NumCycles := 4;", "NumCycles is assigned again", (5, 3)),
        ("A := X;", "A is used as a whole inside another statement", (4, 1)),
        ("PIDA_REAL(PV := X);", "PIDA_REAL is a function block: declare an instance, and call that", (4, 1)),
        ("A(PV := X); A(PV := X);", "A is called again", (4, 13)),
        ("A(PV := X, EN := Z);", "A is called on a condition; a configuration has none", (4, 12)),
        ("A(PV := X, ENO => Z);", "A is called on a condition; a configuration has none", (4, 12)),
        ("A(PV := X, SP => V1);", "PIDA_REAL has no output parameter SP", (4, 12)),
        ("A(PV := X, MV => B);", "B is used as a whole inside another statement", (4, 18)),
        ("A(PV := X, X);", "an argument of A has no name; write it as in PV := FT_101", (4, 12)),
        ("A(PV := );", "nothing stands behind PV :=", (4, 6)),
        ("A(PV := X, pv := X);", "pv stands here again", (4, 12)),
        ("A(PV := X) + 1;", "'+' stands behind the call of A", (4, 12)),
    ],
)
def test_a_call_is_refused_at_its_place(statements, says, place):
    with pytest.raises(ListingError, match=re.escape(says)) as error:
        read_st(body(statements, CALLED))
    assert (error.value.line, error.value.column) == place


def test_moves_are_executed_in_the_order_of_the_program():
    text = "IF Z THEN Q := 3.0; END_IF A.SP := Q; IF Z THEN A.SP := 5.0; END_IF A(PV := X);"
    moves = read_st(body(text, CALLED)).plc["moves"]
    assert [(move["move"], move["to"]) for move in moves] == [(3.0, "Q"), ("Q", "A.SP"), (5.0, "A.SP")]
    assert {move["at"] for move in moves} == {"start"}


def test_setting_takes_the_whole_condition_and_nothing_without_one():
    found = read_st(body("A.Manual S= Z AND Y > 2; A(PV := X);"))
    assert found.plc["moves"] == [{"move": True, "to": "A.Manual", "when": "Z AND Y > 2", "at": "start"}]
    empty = read_st(body("A(PV := X); Z S= ;"))
    assert "moves" not in empty.plc
    assert "statements that are not about blocks of the library are left out: lines 4" in empty.notes


TYPED = "TYPE Recipe : STRUCT Low : REAL; END_STRUCT END_TYPE\nFUNCTION Twice : REAL VAR_INPUT V : REAL; END_VAR\n"
TYPED += "Twice := V * 2.0; END_FUNCTION\n"
LISTS = "VAR_GLOBAL L : PIDA_REAL; Target : REAL := 30.0; END_VAR\n"


def test_types_and_functions_beside_the_program_are_named_by_line():
    found = read_st(TYPED + changed_body("A(PV := X);") + "\nTYPE T9 : INT; END_TYPE")
    assert found.words["A.PV"] == Wire("X")
    assert "lines 1, 2, 8" in " ".join(found.notes)


UNITS = ("CONFIGURATION", "RESOURCE", "CLASS", "INTERFACE", "METHOD", "PROPERTY", "ACTION", "NAMESPACE")


@pytest.mark.parametrize("first", [f"{unit} X" for unit in UNITS] + ["PROGRAM P END_PROGRAM", "PROGRAM P"])
def test_a_file_is_one_program_and_nothing_around_it(first):
    last = "PROGRAM" if first.startswith("PROGRAM") else first.split()[0]
    with pytest.raises(
        ListingError, match=f"{last}: a file holds one PROGRAM, with its variables and statements"
    ) as error:
        read_st(f"{first}\nPROGRAM Q END_PROGRAM")
    assert error.value.line == (2 if first.startswith("PROGRAM") else 1)


def test_a_block_of_the_library_in_a_function_block_is_refused():
    with pytest.raises(ListingError, match="PIDA_REAL stands in a FUNCTION_BLOCK") as error:
        read_st("FUNCTION_BLOCK F VAR I : PIDA_REAL; END_VAR I(); END_FUNCTION_BLOCK\n" + changed_body("A();"))
    assert (error.value.line, error.value.column) == (1, 26)


def test_names_of_lists_of_global_variables_may_stand_before_them():
    found = read_st(LISTS + changed_body("GVL.L(SP := gvl.Target, PV := X); GVL.L.Kp := 2.0;\nA(SP := GVL.L.MV);"))
    assert (found.words["L.SP"], found.words["A.SP"]) == (Wire("Target"), Wire("L.MV"))
    assert found.plc["moves"] == [{"move": 2.0, "to": "L.Kp"}]


@pytest.mark.parametrize("name", ["Box.GVL.Target", "Box.Box.GVL.Target"])
def test_a_member_that_is_called_like_a_list_is_none(name):
    with pytest.raises(ListingError, match=f"{name} is no variable that the program declares"):
        read_st(LISTS + changed_body(f"GVL.L(SP := {name}, PV := GVL.Target);"))


@pytest.mark.parametrize(
    "statements", ["Line_1.L(PV := X);\nLine_2.L.Kp := 2.0;", "A(SP := G.Target, BIAS := H.Target);"]
)
def test_a_variable_of_two_lists_is_refused(statements):
    with pytest.raises(ListingError, match=r"stands in \w+ in line \d and in \w+ here"):
        read_st(LISTS + changed_body(statements))


@pytest.mark.parametrize("word", ["IF defined (Simulation)", "else", " End_If", "elsif x"])
def test_what_is_compiled_on_a_condition_is_refused(word):
    with pytest.raises(ListingError, match="compiled on a condition only"):
        read_st(changed_body(f"{{{word}}} A(PV := X);"))
    assert read_st(changed_body("{region 'if'} A(PV := X); {endregion}")).words["A.PV"] == Wire("X")


@pytest.mark.parametrize("call", ["THIS^.A(PV := X);", "Other.A(PV := X);"])
def test_a_block_that_is_called_by_another_name_is_refused(call):
    with pytest.raises(ListingError, match="A is called here with another name before it"):
        read_st(changed_body(call))


# --- Literals of Structured Text, and the names of functions that no comment speaks of --------------------------------


def token(text):
    return Token("number", text, 3, 5)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5", 5),
        ("1_000", 1000),
        ("5.0", Decimal("5.0")),
        ("REAL#5", Decimal(5)),
        ("lreal#-2.5", Decimal("-2.5")),
        ("INT#5", 5),
        ("16#FF", 255),
        ("INT#16#fF", 255),
        ("2#101", 5),
        ("8#17", 15),
        ("UDINT#8#17", 15),
        ("BOOL#1", True),
        ("BOOL#0", False),
        ("BOOL#true", True),
        ("BOOL#FALSE", False),
        ("T#1m30s", Decimal(90)),
    ],
)
def test_a_literal_means_a_number(text, value):
    found = number_of(token(text))
    assert found == value
    assert isinstance(found, Decimal) == isinstance(value, Decimal)
    assert isinstance(found, bool) == isinstance(value, bool)


@pytest.mark.parametrize("text", ["X#5", "X#INT#5", "INT#REAL#5", "REAL#16#F", "BOOL#2", "INT#5.5", "16#G", "T#5"])
def test_what_is_no_literal_is_refused_at_its_place(text):
    with pytest.raises(ListingError) as caught:
        number_of(token(text))
    assert (caught.value.line, caught.value.column) == (3, 5)


def test_functions_without_a_name_are_numbered_from_1():
    kind = next(iter(BLOCK_TYPES.values()))
    plain, scope = kind.name.removeprefix("Control"), Scope()
    names = [scope.new_function(kind, wanted, token("x")).name for wanted in (None, None, "Mine", "MINE", None)]
    assert names == [f"{plain}_1", f"{plain}_2", "Mine", f"{plain}_3", f"{plain}_4"]


# --- Operators: which kinds of operands each takes (IEC 61131-3), and what it gives; how long a text may be ----------

KINDS = {"X": "REAL", "Y": "INT", "Z": "BOOL", "T": "TIME"}
"""Variables of the programs here, by name."""
OPERATORS = ("OR", "XOR", "AND", "&", "=", "<>", "<", "<=", ">", ">=", "+", "-", "*", "/")


def kind_given(left: str, operator: str, right: str) -> str | None:
    """The kind of an operator's value; None: it does not take these operands."""
    both = {left, right}
    alike = both <= {"REAL", "INT"} or both == {"TIME"}
    if operator in {"OR", "XOR", "AND", "&"}:
        return "BOOL" if both == {"BOOL"} else None
    if operator in {"=", "<>"}:
        return "BOOL" if alike or both == {"BOOL"} else None
    if operator in {"<", "<=", ">", ">="}:
        return "BOOL" if alike else None
    if both == {"TIME"} and operator in {"+", "-"}:
        return "TIME"
    if not both <= {"REAL", "INT"} or (operator == "/" and both == {"INT"}):
        return None
    return "INT" if both == {"INT"} else "REAL"


@pytest.mark.parametrize("operator", OPERATORS)
@pytest.mark.parametrize("right", KINDS)
@pytest.mark.parametrize("left", KINDS)
def test_an_operator_takes_what_it_is_for_and_nothing_else(left, operator, right):
    given = kind_given(KINDS[left], operator, KINDS[right])
    told = {"= Z": {"BOOL"}, "= T": {"TIME"}, "= X": {"REAL", "INT"}, "/ 2 > 1.0": {"REAL"}}
    for rest, kinds in told.items():
        text = body(f"A(TRK_IN := ({left} {operator} {right}) {rest});", "T : TIME;")
        with nullcontext() if given in kinds else pytest.raises(ListingError):
            read_st(text)


LONG = {
    # what is long: the statements, and where their expression is found
    "wire": ("A(PV := {});", lambda found: found.words["A.PV"].text),
    "wired BOOL": ("A(TRK_IN := {});", lambda found: found.words["A.TRK_IN"].text),
    "move": ("IF Z THEN A.SP := {}; END_IF A();", lambda found: found.plc["moves"][0]["move"]),
    "condition": ("IF {} THEN A.SP := 1.0; END_IF A();", lambda found: found.plc["moves"][0]["when"]),
}


@pytest.mark.parametrize("what", LONG)
def test_a_text_of_1000_characters_is_the_longest(what):
    statements, text_in = LONG[what]
    kind, join, count = ("REAL", " + ", 30) if what in {"wire", "move"} else ("BOOL", " OR ", 27)

    def text(length: int) -> str:
        """Of names with 32 characters and one with so many."""
        first, other = "L" * length, "V" * 32
        together = join.join([first, *[other] * count])
        return text_in(read_st(body(statements.format(together), f"{first}, {other} : {kind};")))

    longest = 1 + 1000 - len(text(1))
    assert len(text(longest)) == 1000
    with pytest.raises(ListingError, match="longer than 1000 characters"):
        text(longest + 1)
