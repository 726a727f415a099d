"""What the CLICK's error numbers, requests and status bits mean for the plant: tables only."""

from __future__ import annotations

from pidcfg.encoders.click.errors import condition
from pidcfg.encoders.maps.click import ALARMS, ERRORS, MODES, OUTPUT_BELOW_ZERO, WRITTEN, PidError
from pidcfg.encoders.meanings import Code, Meaning
from pidcfg.refs import CLICK
from pidcfg.schemas.click import D100, D101
from pidcfg.schemas.click import ERRORS as ERROR_LIST

FORCED = "The loop stays in Manual, or falls back into it, until the error is gone."
NOT_WRITTEN = "A value that was never written after the download (0) is the usual reason."
INFERRED = "Which state is which is inferred, not printed in the help. Compare it with {shown} in the PID window before {before}."
ALARM = "Off again when the PV is back by the hysteresis (DFn+20). The loop goes on as it is; only the bit tells it."
MOMENT = "Set it for a moment; the PLC reads the change from 0 to 1."

# fmt: off
WORDS = {
    "action": Meaning(INFERRED.format(shown="Forward/Reverse", before="the first Auto"), "The wrong direction is a runaway: the "
                      "output goes to a limit and stays there. When it is compared, write action_verified: true.",
                      ("CK308",), D100),
    "autotune_method": Meaning(INFERRED.format(shown="open or closed loop", before="the autotune"), "", (), D100),
    "autotune_type": Meaning(INFERRED.format(shown="PID or PI", before="the autotune"), "", (), D100),
    "error_code": Meaning("The lowest PID error that is active. 0: none. When it is cured, the next one shows up, so "
                          "look again after each cure.", "", ("CK309",), CLICK.at("CLICK PID Errors")),
    "manual_request": Meaning("Asks for Manual: the output then stays where it is put.", MOMENT, (), MODES),
    "auto_request": Meaning("Asks for Auto; works only from Manual, and not while a PID error is active.", MOMENT, (), MODES),
    "autotune_request": Meaning("Asks for the autotune; works only in Auto. Switched off again, it ends the autotune "
                                "and the loop is back in Auto.", "Stay at the plant while it runs.", (), MODES),
    "alarm_low_low": Meaning(f"The PV is below the low-low limit in DFn+13. {ALARM}", "", (), ALARMS),
    "alarm_low": Meaning(f"The PV is below the low limit in DFn+14. {ALARM}", "", (), ALARMS),
    "alarm_high": Meaning(f"The PV is above the high limit in DFn+15. {ALARM}", "", (), ALARMS),
    "alarm_high_high": Meaning(f"The PV is above the high-high limit in DFn+16. {ALARM}", "", (), ALARMS),
    "alarm_deviation_high": Meaning(f"The PV is further from the set point than DFn+17 allows, above or below. {ALARM}", "", (), ALARMS),
    "alarm_deviation_high_high": Meaning(f"The PV is further from the set point than DFn+18 allows, above or below. {ALARM}", "", (), ALARMS),
    "alarm_rate_of_change": Meaning("The PV changed by more within one sample than DFn+19 allows.",
                                    "A broken sensor or wire jumps like this; if the signal is only noisy, filter it.",
                                    (), CLICK.at("Use PV Rate of Change (Cn+14)")),
    "bias": Meaning("The integral: the part of the output that holds the set point at rest."),
    "output": Meaning("What the loop gives to the actuator. Read only in Auto; in Manual the operator writes it.",
                      "", (), CLICK.at("Control Output (DFn+08)")),
    "raw_pv": Meaning("The measurement as the program writes it here; the loop controls this value."),
    "pv": Meaning("The measurement behind the PV filter; without the filter the same as DFn+11."),
}
# fmt: on
"""By the name of a register that the configuration does not set."""

WRITERS = {row.name: row.by for row in WRITTEN if row.name in {"raw_pv", "output"}}
"""Who writes a register that is not the PLC's alone."""
DOUBTS = dict.fromkeys(
    ("action", "autotune_method", "autotune_type"), f"inferred, not printed: compare the PID window, D{D100.number}"
)
"""Remarks on registers whose states are a reading of ours."""
CROSSED_RULES = ("CK311", "CK312")
"""Rules that find crossed limits before the download."""
OUTPUT_RULES = ("CK363",)


def _code(error: PidError) -> Code:
    wrong = "crossed" if error.above is not None else "number" if error.low is None else "limits"
    cure = {
        "crossed": "Put the lower limit below the upper one, or switch one of them off (Cn+00, Cn+01).",
        "number": "Write a number into the register; a calculation of the program has left something else there.",
        "limits": "Write a value that is allowed."
        + (f" {NOT_WRITTEN}" if error.low is not None and error.low > 0 else "")
        + (" There is an upper bound too, which is not known." if error.number == OUTPUT_BELOW_ZERO else ""),
    }[wrong]
    rules = {"crossed": CROSSED_RULES, "number": (), "limits": ("PID101",)}[wrong]
    if error.number == OUTPUT_BELOW_ZERO:
        rules = OUTPUT_RULES
    basis = D101 if error.register == "autotune_hysteresis" else ERROR_LIST
    return Code("error_code", error.number, condition(error), Meaning(FORCED, cure, rules, basis))


CODES = (
    Code("error_code", 0, "no PID error", Meaning("Nothing is wrong with the loop's values.", "", (), ERROR_LIST)),
    *(_code(error) for error in ERRORS),
)
