"""Programs by hand: values that they change on the way, and what stands beside the program.

Followed as moves, or refused, and never read as if it were not there.
"""

import pytest

from pidcfg.encoders.listing import ListingError
from pidcfg.encoders.nextopid.st_read import read_st
from pidcfg.schemas.iec import Wire

TUNED = (
    "T : PIDA_TUNE_REAL; P : AUTOTUNE_PARAM := (PercAmpMV := 5.0, NumCycles := 3); R : AUTOTUNE_RESULT; Done : BOOL;"
)
TUNE = "T(AutoTuneParam := P, AutoTuneDone => Done, AutoTuneResult => R);"


def body(statements: str, variables: str = "") -> str:
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
    variables = f"{TUNED} Y : INT; Other : AUTOTUNE_PARAM;\n"
    with pytest.raises(ListingError, match=says):
        read_st(body(statements, variables))


def test_what_no_block_reads_may_be_written_over():
    found = read_st(body(f"A(MV => Q); IF Z THEN Q := 0.0; END_IF\n{TUNE} R.Kp := 1.0;", TUNED + "\n"))
    assert found.notes[1:2] == ("statements that are not about blocks of the library are left out: lines 4, 5",)


def test_an_input_of_a_function_is_not_what_it_was_before_if():
    call = "ControlSelectMin(MV1 := S_MV1, MV2 := A.MV);"
    variables = "S_MV1 : REAL := 5.0; (* S.MV1 *)\n"
    described = '(* loop: {"block": "S", "type": "ControlSelectMin"} *)'
    with pytest.raises(ListingError, match="S_MV1 is assigned in line 5"):
        read_st(described + body(f"A();\nIF Z THEN S_MV1 := 6.0; END_IF\n{call}", variables))


@pytest.mark.parametrize(
    ("statement", "value", "when"),
    [("Z S= W;", True, "W"), ("Z R= W;", False, "W"), ("IF X > 1.0 THEN Z s= NOT W; END_IF", True, "X > 1 AND NOT W")],
)
def test_to_set_and_to_reset_are_moves_on_a_condition(statement, value, when):
    found = read_st(body(f"{statement} A(Manual := Z);"))
    assert found.words["A.Manual"] == Wire("Z")
    assert found.plc["moves"] == [{"move": value, "to": "Z", "when": when, "at": "start"}]


TYPED = "TYPE Recipe : STRUCT Low : REAL; END_STRUCT END_TYPE\nFUNCTION Twice : REAL VAR_INPUT V : REAL; END_VAR\n"
TYPED += "Twice := V * 2.0; END_FUNCTION\n"
LISTS = "VAR_GLOBAL L : PIDA_REAL; Target : REAL := 30.0; END_VAR\n"


def test_types_and_functions_beside_the_program_are_named_by_line():
    found = read_st(TYPED + body("A(PV := X);") + "\nTYPE T9 : INT; END_TYPE")
    assert found.words["A.PV"] == Wire("X")
    assert "lines 1, 2, 8" in " ".join(found.notes)


def test_a_block_of_the_library_in_a_function_block_is_refused():
    with pytest.raises(ListingError, match="PIDA_REAL stands in a FUNCTION_BLOCK") as error:
        read_st("FUNCTION_BLOCK F VAR I : PIDA_REAL; END_VAR I(); END_FUNCTION_BLOCK\n" + body("A();"))
    assert (error.value.line, error.value.column) == (1, 26)


def test_names_of_lists_of_global_variables_may_stand_before_them():
    found = read_st(LISTS + body("GVL.L(SP := gvl.Target, PV := X); GVL.L.Kp := 2.0;\nA(SP := GVL.L.MV);"))
    assert (found.words["L.SP"], found.words["A.SP"]) == (Wire("Target"), Wire("L.MV"))
    assert found.plc["moves"] == [{"move": 2.0, "to": "L.Kp"}]


@pytest.mark.parametrize(
    "statements", ["Line_1.L(PV := X);\nLine_2.L.Kp := 2.0;", "A(SP := G.Target, BIAS := H.Target);"]
)
def test_a_variable_of_two_lists_is_refused(statements):
    with pytest.raises(ListingError, match=r"stands in \w+ in line \d and in \w+ here"):
        read_st(LISTS + body(statements))


@pytest.mark.parametrize("word", ["IF defined (Simulation)", "else", " End_If", "elsif x"])
def test_what_is_compiled_on_a_condition_is_refused(word):
    with pytest.raises(ListingError, match="compiled on a condition only"):
        read_st(body(f"{{{word}}} A(PV := X);"))
    assert read_st(body("{region 'if'} A(PV := X); {endregion}")).words["A.PV"] == Wire("X")


@pytest.mark.parametrize("call", ["THIS^.A(PV := X);", "Other.A(PV := X);"])
def test_a_block_that_is_called_by_another_name_is_refused(call):
    with pytest.raises(ListingError, match="A is called here with another name before it"):
        read_st(body(call))
