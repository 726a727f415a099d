"""What the bits of the NextoPID blocks mean for the plant: tables only. The bits themselves stand in the blocks' tables."""

from __future__ import annotations

from pidcfg.encoders.meanings import Meaning
from pidcfg.refs import NEXTOPID, Decision

ERRORS = NEXTOPID.at("ErrBits - Fatal Error Indication Bits")
WARNINGS = NEXTOPID.at("WarnBits - Warning Indication Bits")
RESULTS = NEXTOPID.at("AutoTuneResult")

D325 = Decision(
    325, "a structure of bits as a number",
    "`ErrBits=0x0005` counts the structure's bits from 0 in the order of its members; `AutoTuneResult` without its three "
    "numbers, so that Bad_PercAmpMV is bit 0.",
    "The manual names the bits and shows the structures as figures; members of the type BIT are packed in their order. "
    "A panel that shows the number of the whole structure has no other one to show.",
)  # fmt: skip

STOPPED = "The block is not executed: MV and all other outputs stay as they are until it is cured."
UNTRUSTED = "The gains that it shows are not to be trusted."
ENDED = "The auto-tuning has ended; MV is as it was."
AGAIN = "Then switch AutoTune off and on."
LIMITED = "The block goes on."

# fmt: off
GROUPS = {
    "ErrBits": Meaning("Fatal errors: while one is on, the block is not executed and MV does not move.", "", (), ERRORS),
    "WarnBits": Meaning("What the block limits in this call; it goes on working.", "", (), WARNINGS),
    "AutoTuneResult": Meaning("What the auto-tuning found, and what went wrong; reset when AutoTune is FALSE.", "", (), RESULTS),
}
"""Outputs that are structures."""

BITS = {
    "ErrBits.MaxMinMV":   Meaning(STOPPED, "Set MaxMV above MinMV.", ("PID610",), ERRORS),
    "ErrBits.MaxMinPV":   Meaning(STOPPED, "Set MaxPV above MinPV.", ("PID611",), ERRORS),
    "ErrBits.Kp":         Meaning(STOPPED, "Set Kp above 0; the independent form (Indep TRUE) takes 0 too. The direction of control is Direct's business, not the sign of Kp's.", ("PID612",), ERRORS),
    "ErrBits.Td_Kd":      Meaning(STOPPED, "Set Td_Kd to 0 (no derivative) or above.", ("PID101", "PID613"), ERRORS),
    "ErrBits.Ti_Ki":      Meaning(STOPPED, "Set Ti_Ki to 0 (no integral) or above.", ("PID101", "PID613"), ERRORS),
    "ErrBits.Tfd":        Meaning(STOPPED, "Set Tfd to 0 (no filter) or above.", ("PID101", "PID613"), ERRORS),
    "ErrBits.MaxVarMV":   Meaning(STOPPED, "Set MaxVarMV to 0 (no limit) or above.", ("PID101", "PID613"), ERRORS),
    "ErrBits.DeadBand":   Meaning(STOPPED, "Set DeadBand to 0 (none) or above.", ("PID101", "PID613"), ERRORS),
    "ErrBits.SampleTime": Meaning(STOPPED, "Call the block at least once in 60 s: look at the task's interval, and whether the call is skipped by a condition.", ("PID624",), ERRORS),

    "WarnBits.PV_MaxPV":      Meaning(f"The measurement is above MaxPV; the block calculates with MaxPV. {LIMITED}", "Look at the sensor, and whether MaxPV is the top of its range.", (), WARNINGS),
    "WarnBits.PV_MinPV":      Meaning(f"The measurement is below MinPV; the block calculates with MinPV. {LIMITED}", "Look at the sensor (a broken wire reads low), and whether MinPV is the bottom of its range.", (), WARNINGS),
    "WarnBits.SP_MaxPV":      Meaning(f"The set point is above MaxPV; the block works towards MaxPV. {LIMITED}", "Lower SP, or set MaxPV to the top of the sensor's range.", ("PID615",), WARNINGS),
    "WarnBits.SP_MinPV":      Meaning(f"The set point is below MinPV; the block works towards MinPV. {LIMITED}", "Raise SP, or set MinPV to the bottom of the sensor's range.", ("PID615",), WARNINGS),
    "WarnBits.SP_CASC_MaxPV": Meaning(f"The master asks for more than MaxPV; the block works towards MaxPV. {LIMITED}", "Set the master's MaxMV to this block's MaxPV.", ("PID616", "PID673"), WARNINGS),
    "WarnBits.SP_CASC_MinPV": Meaning(f"The master asks for less than MinPV; the block works towards MinPV. {LIMITED}", "Set the master's MinMV to this block's MinPV.", ("PID616", "PID673"), WARNINGS),
    "WarnBits.MV_MaxMV":      Meaning(f"MV is at its upper limit: the actuator can do no more. {LIMITED}", "Normal for a while after a change; if it stays, the actuator is too small or shut off, or Direct is the wrong way round.", (), WARNINGS),
    "WarnBits.MV_MinMV":      Meaning(f"MV is at its lower limit: the actuator can do no less. {LIMITED}", "Normal for a while after a change; if it stays, something else moves the PV, or Direct is the wrong way round.", (), WARNINGS),
    "WarnBits.MV_P_MaxVarMV": Meaning(f"MV rises as fast as MaxVarMV lets it. {LIMITED}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("PID633",), WARNINGS),
    "WarnBits.MV_N_MaxVarMV": Meaning(f"MV falls as fast as MaxVarMV lets it. {LIMITED}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("PID633",), WARNINGS),

    "AutoTuneResult.Bad_PercAmpMV":     Meaning(ENDED, f"Set AutoTuneParam.PercAmpMV to 0.1 to 50 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercHystPV":    Meaning(ENDED, f"Set AutoTuneParam.PercHystPV to 0.01 to 1 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercMaxPeakPV": Meaning(ENDED, f"Set AutoTuneParam.PercMaxPeakPV to 0.1 to 50 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_NumCycles":     Meaning(ENDED, f"Set AutoTuneParam.NumCycles to 1 to 10. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_Mode":          Meaning(ENDED, f"Set AutoTuneParam.Mode to P, PI or PID. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.MV_TOO_HIGH":       Meaning(ENDED, f"Start from a lower MV, or make PercAmpMV smaller. {AGAIN}", ("PID658",), RESULTS),
    "AutoTuneResult.MV_TOO_LOW":        Meaning(ENDED, f"Start from a higher MV, or make PercAmpMV smaller. {AGAIN}", ("PID658",), RESULTS),
    "AutoTuneResult.PV_TOO_HIGH":       Meaning(ENDED, f"Start from a lower PV, or make PercHystPV smaller. {AGAIN}", (), RESULTS),
    "AutoTuneResult.PV_TOO_LOW":        Meaning(ENDED, f"Start from a higher PV, or make PercHystPV smaller. {AGAIN}", (), RESULTS),
    "AutoTuneResult.PEAK_TOO_HIGH":     Meaning("Aborted for safety; MV is back where it was.", f"Make PercAmpMV smaller, or allow a higher peak (PercMaxPeakPV) if the plant does. {AGAIN}", ("PID659",), RESULTS),
    "AutoTuneResult.PEAK_TOO_LOW":      Meaning(UNTRUSTED, f"Make PercAmpMV larger or PercHystPV smaller; a process with almost no dead time does this too. {AGAIN}", ("PID659",), RESULTS),
    "AutoTuneResult.PV_NOT_STEADY":     Meaning("Ended in the first 3 s; MV is back where it was.", f"Let PV come to rest, or make PercHystPV larger than its noise. {AGAIN}", (), RESULTS),
    "AutoTuneResult.CYCLE_TOO_FAST":    Meaning(UNTRUSTED, f"Call the block more often; a process with almost no dead time does this too. {AGAIN}", (), RESULTS),
    "AutoTuneResult.HIGH_DEAD_TIME":    Meaning(UNTRUSTED, "The dead time is long against the time constant: tune by hand.", (), RESULTS),
}
# fmt: on
"""By the name of the output."""
