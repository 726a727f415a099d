"""What the EZLogix's autotune status, requests and status registers mean for the plant: tables only."""

from __future__ import annotations

from pidcfg.encoders.maps.ezlogix import OPTIONS
from pidcfg.encoders.meanings import Code, Meaning
from pidcfg.schemas.ezlogix import AUTOTUNE, LIMITS

BACK = "The loop goes on with the gains that it had."
IDLE_AGAIN = "Switch discrete Base+4 off and on: the status goes back to 0, then off and on again starts the next try."
STEADY = "Let the process come to rest near its working point first, within 10 % of the set point."

# fmt: off
WORDS = {
    "error": Meaning("The difference of PV and set point as the loop calculates with it: PV - SP with direct controller "
                     "action, SP - PV with reverse.", "", (), LIMITS),
    "autotune_status": Meaning("Tells where the autotune is, or how the last one ended.", "", (), AUTOTUNE),
    "saturation": Meaning("The CV is at an end of its range, 0 or 4095: the actuator can do no more. With anti-windup "
                          "(Base+1) the integral does not go on in that direction. A CV that stands at a limit in "
                          "between (Base+8, Base+9) does not set this bit (D167).",
                          "Normal for a while after a change, and at 0 while a heating loop's PV is above its set point "
                          "(cooling: below). If it stays on the other side too, look whether the actuator is too small "
                          "or shut off. Never change the controller action before a small step of the CV in Manual has "
                          "shown which way the PV goes.", (), OPTIONS),
    "start_autotune": Meaning("From 0 to 1 starts the autotune, in Manual as well as in Auto: the CV steps up by 10 %. "
                              "Back to 0 cancels it.", f"{STEADY} Watch the PV while it runs.", (), AUTOTUNE),
}

CODES = (
    Code("autotune_status", 0, "idle", Meaning("No autotune runs.", "", (), AUTOTUNE)),
    Code("autotune_status", 1, "collecting data", Meaning(
        "The autotune has the CV and records how the PV answers. Base+13 counts the time down that is left.",
        "Watch the PV; discrete Base+4 to 0 cancels.", (), AUTOTUNE)),
    Code("autotune_status", 2, "calculating", Meaning("The answer is recorded; the gains are being worked out.", "Wait.", (), AUTOTUNE)),
    Code("autotune_status", 3, "done", Meaning(
        "The autotune has ended well; gain, integral and derivative time (Base+2 to +4) are new.",
        "Try the loop out with a small step of the set point before you leave it alone.", (), AUTOTUNE)),
    Code("autotune_status", 4, "cancelled", Meaning(f"Somebody set discrete Base+4 to 0. {BACK}", IDLE_AGAIN, (), AUTOTUNE)),
    Code("autotune_status", 5, "the CV could not be incremented", Meaning(
        f"There is no room for a step of 10 % above the present CV. {BACK}",
        f"Bring the CV 10 % below the CV high limit (Base+9) and below 90 % of its range first. Raise that limit only if the "
        f"plant bears it: it may protect the plant; put it back after the autotune. {IDLE_AGAIN}", ("EZ484",), AUTOTUNE)),
    Code("autotune_status", 6, "the curve could not be fitted", Meaning(
        f"The PV moved, but not like the answer of a process to a step. {BACK}",
        f"Look for disturbances and noise; give it more time (Base+13). {STEADY} {IDLE_AGAIN}",
        ("EZ481",), AUTOTUNE)),
    Code("autotune_status", 7, "division by zero", Meaning(
        f"The recorded answer has no slope to work with. {BACK}",
        f"See that the PV moves when the CV does. {IDLE_AGAIN}", (), AUTOTUNE)),
    Code("autotune_status", 8, "no dead time was found", Meaning(
        f"The PV did not move, or not in the time of Base+13. {BACK}",
        f"See that actuator and sensor work; give it more time (Base+13). {IDLE_AGAIN}", ("EZ480", "EZ481"), AUTOTUNE)),
    Code("autotune_status", 9, "a gain or time is out of range", Meaning(
        f"The gains that fit the answer do not fit their registers. {BACK}",
        f"Tune by hand, or change the sample rate (Base+0) and try again. {IDLE_AGAIN}", (), AUTOTUNE)),
    Code("autotune_status", 10, "low memory", Meaning(
        f"The PLC had no memory left for the recording. {BACK}",
        f"End other autotunes (Base+4 off and on frees their memory). {IDLE_AGAIN}", (), AUTOTUNE)),
)
# fmt: on
"""The manual's table of Base+12."""
