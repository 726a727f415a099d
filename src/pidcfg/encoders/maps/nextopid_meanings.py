"""What the bits of the NextoPID blocks mean for the plant: tables only. The bits themselves stand in the blocks' tables."""

from __future__ import annotations

from pidcfg.encoders.meanings import Meaning
from pidcfg.refs import NEXTOPID, Decision

ERRORS = NEXTOPID.at("ErrBits - Fatal Error Indication Bits")
WARNINGS = NEXTOPID.at("WarnBits - Warning Indication Bits")
RESULTS = NEXTOPID.at("AutoTuneResult")

D325 = Decision(
    325,
    "a structure of bits as a number",
    "`ErrBits=0x0005` counts the structure's bits from 0 in the order of its members; `AutoTuneResult` without its three "
    "numbers, so that Bad_PercAmpMV is bit 0.",
    "The manual names the bits and shows the structures as figures; members of the type BIT are packed in their order. "
    "A panel that shows the number of the whole structure has no other one to show.",
)

STOPPED = "The block is not executed: MV and all other outputs stay as they are until it is cured."
UNCONTROLLED = "MV stands at RefMV, where the auto-tuning found it, and nothing controls until AutoTune is FALSE."
UNTRUSTED = f"The gains that it shows are not to be trusted. {UNCONTROLLED}"
ENDED = f"The auto-tuning has ended. {UNCONTROLLED}"
AGAIN = "Switch AutoTune off, so that the block controls again, before the next try."
STEP = "Never change Direct before a small step of MV in manual has shown which way PV goes."
LIMITED = "The block goes on."

# fmt: off
GROUPS = {
    "ErrBits": Meaning("Fatal errors: while one is on, the block is not executed and MV does not move.", "", (), ERRORS),
    "WarnBits": Meaning("What the block limits in this call; it goes on working.", "", (), WARNINGS),
    "AutoTuneResult": Meaning(f"What the auto-tuning found, and what went wrong; reset when AutoTune is FALSE. When it has ended: {UNCONTROLLED}", "", (), RESULTS),
}
"""Outputs that are structures."""

BITS = {
    "ErrBits.MaxMinMV":   Meaning(STOPPED, "Set MaxMV above MinMV.", ("NX610",), ERRORS),
    "ErrBits.MaxMinPV":   Meaning(STOPPED, "Set MaxPV above MinPV.", ("NX611",), ERRORS),
    "ErrBits.Kp":         Meaning(STOPPED, "Set Kp above 0; the independent form (Indep TRUE) takes 0 too. The direction of control is Direct's business, not the sign of Kp's.", ("NX612",), ERRORS),
    "ErrBits.Td_Kd":      Meaning(STOPPED, "Set Td_Kd to 0 (no derivative) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.Ti_Ki":      Meaning(STOPPED, "Set Ti_Ki to 0 (no integral) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.Tfd":        Meaning(STOPPED, "Set Tfd to 0 (no filter) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.MaxVarMV":   Meaning(STOPPED, "Set MaxVarMV to 0 (no limit) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.DeadBand":   Meaning(STOPPED, "Set DeadBand to 0 (none) or above.", ("PID101", "NX613"), ERRORS),
    "ErrBits.SampleTime": Meaning(STOPPED, "Call the block at least once in 60 s: look at the task's interval, and whether the call is skipped by a condition.", ("NX624",), ERRORS),

    "WarnBits.PV_MaxPV":      Meaning(f"The measurement is above MaxPV; the block calculates with MaxPV. {LIMITED}", "Look at the sensor, and whether MaxPV is the top of its range.", (), WARNINGS),
    "WarnBits.PV_MinPV":      Meaning(f"The measurement is below MinPV; the block calculates with MinPV. {LIMITED}", "Look at the sensor (a broken wire reads low), and whether MinPV is the bottom of its range.", (), WARNINGS),
    "WarnBits.SP_MaxPV":      Meaning(f"The set point is above MaxPV; the block works towards MaxPV. {LIMITED}", "Lower SP, or set MaxPV to the top of the sensor's range.", ("NX615",), WARNINGS),
    "WarnBits.SP_MinPV":      Meaning(f"The set point is below MinPV; the block works towards MinPV. {LIMITED}", "Raise SP, or set MinPV to the bottom of the sensor's range.", ("NX615",), WARNINGS),
    "WarnBits.SP_CASC_MaxPV": Meaning(f"The master asks for more than MaxPV; the block works towards MaxPV. {LIMITED}", "Set the master's MaxMV to this block's MaxPV.", ("NX616", "NX673"), WARNINGS),
    "WarnBits.SP_CASC_MinPV": Meaning(f"The master asks for less than MinPV; the block works towards MinPV. {LIMITED}", "Set the master's MinMV to this block's MinPV.", ("NX616", "NX673"), WARNINGS),
    "WarnBits.MV_MaxMV":      Meaning(f"MV is at its upper limit: the actuator can do no more. {LIMITED}", f"Normal for a while after a change; if it stays, the actuator is too small or shut off. {STEP}", (), WARNINGS),
    "WarnBits.MV_MinMV":      Meaning(f"MV is at its lower limit: the actuator can do no less. {LIMITED}", f"Right while a heating block's PV is above SP (cooling: below); if it stays on the other side too, something else moves the PV. {STEP}", (), WARNINGS),
    "WarnBits.MV_P_MaxVarMV": Meaning(f"MV rises as fast as MaxVarMV lets it. {LIMITED}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("NX633",), WARNINGS),
    "WarnBits.MV_N_MaxVarMV": Meaning(f"MV falls as fast as MaxVarMV lets it. {LIMITED}", "Normal after a change; if it is on most of the time, MaxVarMV makes the loop slow.", ("NX633",), WARNINGS),

    "AutoTuneResult.Bad_PercAmpMV":     Meaning(ENDED, f"Set AutoTuneParam.PercAmpMV to 0.1 to 50 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercHystPV":    Meaning(ENDED, f"Set AutoTuneParam.PercHystPV to 0.01 to 1 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_PercMaxPeakPV": Meaning(ENDED, f"Set AutoTuneParam.PercMaxPeakPV to 0.1 to 50 %. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_NumCycles":     Meaning(ENDED, f"Set AutoTuneParam.NumCycles to 1 to 10. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.Bad_Mode":          Meaning(ENDED, f"Set AutoTuneParam.Mode to P, PI or PID. {AGAIN}", ("PID101",), RESULTS),
    "AutoTuneResult.MV_TOO_HIGH":       Meaning(ENDED, f"Start from a lower MV, or make PercAmpMV smaller. {AGAIN}", ("NX658",), RESULTS),
    "AutoTuneResult.MV_TOO_LOW":        Meaning(ENDED, f"Start from a higher MV, or make PercAmpMV smaller. {AGAIN}", ("NX658",), RESULTS),
    "AutoTuneResult.PV_TOO_HIGH":       Meaning(ENDED, f"Start from a lower PV, or make PercHystPV smaller. {AGAIN}", (), RESULTS),
    "AutoTuneResult.PV_TOO_LOW":        Meaning(ENDED, f"Start from a higher PV, or make PercHystPV smaller. {AGAIN}", (), RESULTS),
    "AutoTuneResult.PEAK_TOO_HIGH":     Meaning(f"Aborted for safety. {UNCONTROLLED}", f"Make PercAmpMV smaller, or allow a higher peak (PercMaxPeakPV) if the plant does. {AGAIN}", ("NX659",), RESULTS),
    "AutoTuneResult.PEAK_TOO_LOW":      Meaning(UNTRUSTED, f"Make PercAmpMV larger or PercHystPV smaller; a process with almost no dead time does this too. {AGAIN}", ("NX659",), RESULTS),
    "AutoTuneResult.PV_NOT_STEADY":     Meaning(f"Ended in the first 3 s. {UNCONTROLLED}", f"Let PV come to rest, or make PercHystPV larger than its noise. {AGAIN}", (), RESULTS),
    "AutoTuneResult.CYCLE_TOO_FAST":    Meaning(UNTRUSTED, f"Call the block more often; a process with almost no dead time does this too. {AGAIN}", (), RESULTS),
    "AutoTuneResult.HIGH_DEAD_TIME":    Meaning(UNTRUSTED, "Switch AutoTune off, then tune by hand: the dead time is long against the time constant.", (), RESULTS),
}
# fmt: on
"""By the name of the output."""

BLOCK_BITS = {
    ("ControlON_OFF", "ErrBits.DeadBand"): Meaning(
        STOPPED, "Set DeadBand above 0: this block has no 0 that means none.", ("PID101",), ERRORS
    ),
}
"""By the type of block and the name of the output, where a block differs from the others."""

# fmt: off
STATES = {
    ("Direct", True): "direct: MV rises when PV rises (cooling)", ("Direct", False): "reverse: MV falls when PV rises (heating)",
    ("Indep", True): "independent form: gains Kp, Ki, Kd", ("Indep", False): "dependent form: gain Kp, times Ti, Td",
    ("DerivEr", True): "derivative of the error", ("DerivEr", False): "derivative of PV",
    ("Disable", True): "the output is 0", ("Disable", False): "the block works",
}
# fmt: on
"""What an input chooses of which TRUE and FALSE have meanings of their own."""
