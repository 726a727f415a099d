"""What a program in Structured Text does with operands of DPIDE besides the call: named with its line."""

import pytest

from pidcfg.encoders.dpide.files import FORMATS
from pidcfg.encoders.dpide.st_read import read_st
from pidcfg.encoders.listing import kind_of

OPERANDS = (
    "PID_RUN := TRUE, SV := 80.0, PV := D102, PID_MODE := 0, PID_MAN := Man, MOUT_AUTO := FALSE, CYCLE := 1000, "
    "Kc_Kp := Kp, Ti_Ki := 180.0, Td_Kd := 0.0, Tf := 0.0, PID_EQ := TRUE, PID_DE := TRUE, PID_DIR := TRUE, "
    "ERR_DBW := 0.0, MV_MAX := 100.0, MV_MIN := 0.0, MOUT := 0.0, BIAS := 0.0, I_MV := D500, MV => D104"
)
ASSIGNED = "LOOP-1.{} is assigned in line {}, which is not carried over"
PASSED = (
    "LOOP-1.Kc_Kp stands in a call that is not DPIDE's, and may be written there, in line 2, which is not carried over"
)
JUMP = "{} in line 2 is not carried over: what stands behind is not always executed"
LEFT = "statements that are not about DPIDE are left out: lines 2"


def program(statements: str) -> str:
    """A program with one instruction; the statements begin in line 2."""
    declared = "VAR Kp AT D110 : REAL := 2.0; Man : BOOL := FALSE; END_VAR"
    return f"{declared}\n{statements}\nDPIDE({OPERANDS});\n"


@pytest.mark.parametrize(
    ("statements", "note"),
    [
        ("CASE D1 OF 1: Kp := 5.0; END_CASE", ASSIGNED.format("Kc_Kp", 2)),
        ("FOR D1 := 1 TO 3 DO\nD110 := 9.0; END_FOR", ASSIGNED.format("Kc_Kp", 3)),
        ("DMOV(IN := 9.0, OUT => D110);", ASSIGNED.format("Kc_Kp", 2)),
        ("Man S= M3;", ASSIGNED.format("PID_MAN", 2)),
        ("IF M3 THEN Man R= M4; END_IF", ASSIGNED.format("PID_MAN", 2)),
        ("DMOV(9.0, Kp);", PASSED),
        ("DMOV(EN := M0, S := 9.0, D := kp);", PASSED),
        ("CASE D1 OF 1: DMOV(9.0, Kp); END_CASE", PASSED),
        ("X := Kp + 1.0;", LEFT),
        ("X := ABS(Kp);", LEFT),
        ("Scale(D104, D300);", LEFT),
        ("Other(Kp := 3.0);", LEFT),
        ("IF M0 THEN RETURN; END_IF", JUMP.format("RETURN")),
        ("CASE D1 OF 1: JMP a; END_CASE", JUMP.format("JMP")),
    ],
)
def test_what_is_left_out_is_named_as_what_it_does(statements, note):
    assert read_st(program(statements)).notes == (note,)


def test_a_program_may_begin_with_a_pragma():
    assert kind_of("{attribute 'x'}\n" + program(""), FORMATS).name == "st"
