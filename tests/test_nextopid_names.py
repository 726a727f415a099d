"""Names that the programming language or CODESYS has for itself."""

import pytest

from nextopid_rig import HEAD
from pidcfg.api import check_text

LOOP = "type: PIDA_REAL, SP: 1, Kp: 1, Ti_Ki: 1, Td_Kd: 0, MinMV: 0, MaxMV: 100, MinPV: 0, MaxPV: 100"


def errors(name: str) -> set[str]:
    """Codes of the errors about a loop with this name."""
    found = check_text(f"{HEAD}loops:\n  - {{name: {name}, {LOOP}}}\n").findings
    return {finding.code for finding in found if finding.severity.name == "ERROR"}


@pytest.mark.parametrize("name", ["DT", "TOD", "ltime", "DATE_AND_TIME", "Time_Of_Day", "LDATE", "LTOD", "LDT", "REAL"])
def test_types_are_no_names(name):
    assert errors(name) == {"PID033"}


@pytest.mark.parametrize(
    "name", ["CONTINUE", "jmp", "POINTER", "Reference", "INTERFACE", "UNION", "SEL", "DINT_TO_REAL", "to_real"]
)
def test_names_that_codesys_does_not_compile_are_errors(name):
    assert errors(name) == {"NX606"}


def test_other_names_are_none():
    assert errors("DT_1") == errors("TIC") == errors("TO_WORDS") == errors("LEN") == set()
