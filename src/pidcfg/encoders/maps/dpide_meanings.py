"""What DPIDE's modes and the registers of I_MV mean for the plant: tables only."""

from __future__ import annotations

from pidcfg.encoders.maps.dpide import TABLE, WRITTEN
from pidcfg.encoders.meanings import Code, Meaning

# fmt: off
CODES = (
    Code("PID_MODE", 0, "automatic", Meaning(
        "The algorithm sets MV. While MV is beyond MV_MAX or MV_MIN the integral I_MV stands still.", "", (), TABLE)),
    Code("PID_MODE", 1, "autotune", Meaning(
        "The instruction tunes itself for temperature control and moves MV to do so; PID_MAN has no effect. When it is "
        "done, Kc_Kp, Ti_Ki, Td_Kd and Tf are new and PID_MODE is 0.",
        "Stay at the plant. PID_MODE and the four coefficients must be registers, not numbers in the program.",
        ("DP705", "DP706", "DP707"), TABLE)),
    Code("PID_MODE", 2, "automatic, with I_MV worked out of MV", Meaning(
        "As 0, but I_MV follows MV at its limits and at the end of manual, so that the loop comes back sooner and "
        "without a bump.", "", (), TABLE)),
)
"""Numbers that PID_MODE holds."""

STATES = {
    ("PID_RUN", True): "the algorithm runs", ("PID_RUN", False): "the algorithm does not run, and MV is 0",
    ("PID_MAN", True): "manual: MV is MOUT, within MV_MIN and MV_MAX", ("PID_MAN", False): "automatic: the algorithm sets MV",
    ("MOUT_AUTO", True): "MOUT follows MV", ("MOUT_AUTO", False): "MOUT stays as it is written",
    ("PID_EQ", True): "dependent form: Kc, Ti, Td", ("PID_EQ", False): "independent form: Kp, Ki, Kd",
    ("PID_DE", True): "derivative of PV", ("PID_DE", False): "derivative of the error",
    ("PID_DIR", True): "forward, E = SV - PV: MV rises while PV is below SV (heating)",
    ("PID_DIR", False): "reverse, E = PV - SV: MV rises while PV is above SV (cooling)",
}
"""What a BOOL operand chooses."""

WRITERS = {row.name: row.by for row in WRITTEN if row.name in {"PV", "I_MV"}}
"""Who writes an operand that is not yours alone."""

INTEGRAL = (
    (0, 0, "I_MV", "The accumulated integral. It may be read, cleared or changed."),
    (1, 1, "previous error", "The error of the calculation before; the PLC writes it."),
    (2, 5, "system use", "The PLC's own; leave it alone."),
    (6, 6, "previous PV", "The PV of the calculation before; the PLC writes it."),
    (7, 14, "system use", "The PLC's own; leave it alone."),
)
"""The 15 double words of I_MV: first and last, what they hold, and what that means."""
# fmt: on
