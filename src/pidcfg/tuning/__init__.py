"""Gains by rule: from a process or its ultimate cycle to P, I and D, and to what a vendor's registers can hold.

Here the coefficients of tuning rules, of which the auto-tunes of the virtual PLCs take theirs.
"""

from math import inf
from typing import Literal

Form = Literal["P", "PI", "PID"]
Row = tuple[float, float, float]
"""What the gain, the integral and the derivative time are multiplied with; infinite: no integral term."""

ZIEGLER_NICHOLS_OPEN: dict[Form, Row] = {"P": (1.0, inf, 0.0), "PI": (0.9, 3.33, 0.0), "PID": (1.2, 2.0, 0.5)}
"""Of 1/(R L), the dead time and the dead time."""
ZIEGLER_NICHOLS_CLOSED: dict[Form, Row] = {
    "P": (0.5, inf, 0.0),
    "PI": (0.45, 1 / 1.2, 0.0),
    "PID": (0.6, 0.5, 0.125),
}
"""Of the ultimate gain and its period, as all that follow."""
OPEN_SAMPLE = {"PI": 0.12, "PID": 0.056}
CLOSED_SAMPLE = {"PI": 0.03, "PID": 0.014}
"""The sample rates that the auto-tunes set: shares of the dead time, and of the ultimate period."""
GENTLE_CLOSED: dict[Form, Row] = {"P": (0.30, inf, 0.0), "PI": (0.30, 1.00, 0.0), "PID": (0.45, 0.60, 0.10)}
TYREUS_LUYBEN: dict[Form, Row] = {"P": (0.5, inf, 0.0), "PI": (1 / 3.2, 2.2, 0.0), "PID": (1 / 2.2, 2.2, 1 / 6.3)}
NEXTOPID_P, NEXTOPID_PART, NEXTOPID_TI, NEXTOPID_TD = 0.5, 3.2, 2.2, 6.3
"""Kp = 0.5 Ku for P, else Ku / 3.2; Ti = 2.2 Pu; Td = Pu / 6.3."""
NEXTOPID_CLOSED: dict[Form, Row] = {
    "P": (NEXTOPID_P, inf, 0.0),
    "PI": (1 / NEXTOPID_PART, NEXTOPID_TI, 0.0),
    "PID": (1 / NEXTOPID_PART, NEXTOPID_TI, 1 / NEXTOPID_TD),
}
