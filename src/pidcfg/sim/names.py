"""Alarms and flags in the words of a trend; files and JSON keep the names."""

from __future__ import annotations

# fmt: off
WORDS = {
    "pv_low_low":               "PV low-low",
    "pv_low":                   "PV low",
    "pv_high":                  "PV high",
    "pv_high_high":             "PV high-high",
    "low_low":                  "PV low-low",
    "low":                      "PV low",
    "high":                     "PV high",
    "high_high":                "PV high-high",
    "deviation_yellow":         "deviation yellow",
    "deviation_red":            "deviation red",
    "deviation_high":           "deviation high",
    "deviation_high_high":      "deviation high-high",
    "rate_of_change":           "PV rate of change",
    "out_limited":              "output limited",
    "mv_limited":               "MV limited",
    "saturation":               "output saturated",
    "rate_limited":             "output rate limited",
    "in_deadband":              "in the deadband",
    "in_dead_band":             "in the dead band",
    "pid_error":                "PID error",
    "autotune_running":         "auto-tune running",
    "autotune_error":           "auto-tune error",
    "ramp_soak_complete":       "profile complete",
    "ramp_soak_deviation":      "profile deviation",
    "ramp_soak_hold":           "profile held",
    "WarnBits.PV_MaxPV":        "PV above MaxPV",
    "WarnBits.PV_MinPV":        "PV below MinPV",
    "WarnBits.SP_MaxPV":        "SP above MaxPV",
    "WarnBits.SP_MinPV":        "SP below MinPV",
    "WarnBits.SP_CASC_MaxPV":   "SP_CASC above MaxPV",
    "WarnBits.SP_CASC_MinPV":   "SP_CASC below MinPV",
    "WarnBits.MV_MaxMV":        "MV at MaxMV",
    "WarnBits.MV_MinMV":        "MV at MinMV",
    "WarnBits.MV_P_MaxVarMV":   "MV rising by MaxVarMV",
    "WarnBits.MV_N_MaxVarMV":   "MV falling by MaxVarMV",
}
# fmt: on
LIMITED_ABOVE = frozenset({"out_limited", "mv_limited", "saturation", "WarnBits.MV_MaxMV"})
LIMITED_BELOW = frozenset({"out_limited", "mv_limited", "saturation", "WarnBits.MV_MinMV"})
"""Flags that say that an output is at its upper or its lower limit."""


def in_words(name: str) -> str:
    """What people call an alarm or a flag; the other names of parameters stay as the manual writes them."""
    return WORDS.get(name) or (name if "." in name else name.replace("_", " "))
