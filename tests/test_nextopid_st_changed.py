"""Values that a program changes on the way: followed as moves, or refused, and never read as what they were before."""

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
