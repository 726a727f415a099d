"""Decisions on what a conversion says of a loop that is switched, limited or stopped."""

from __future__ import annotations

from pidcfg.refs import Decision

D341 = Decision(
    341,
    "a conversion compares what an operator sees",
    "How a loop starts, what its output does on the way to Manual and to Auto, what its integral does at a limit, what "
    "a deadband does, what refuses Auto, and what a master does while its slave has another set point. An output that "
    "jumps where it stayed, a bias that is not taken over, an integral that runs further and a master that no longer "
    "follows are losses; a start in another mode, a change to Auto with the error's action on top, and other rules "
    "are named.",
    "The first can move a valve to 0 or leave an offset for good; the others an operator sees and can wait for.",
)
D342 = Decision(
    342,
    "an integral that has an end gets anti-windup where it would have none",
    "DL06 and CLICK keep their bias within the range or the limits of the output without their freeze, too; EZLogix "
    "and the neutral form without anti-windup let it run without end. Their anti-windup is therefore switched on, and "
    "the report says so.",
    "An integral that runs without end holds the output at its limit for as long again as it was there.",
)
D343 = Decision(
    343,
    "the filter of a derivative keeps its time constant, and its first sample is named",
    "Of a step NextoPID and the neutral form let 1 - e^(-Ts/Tf) through in a sample, DL06, CLICK and DPIDE "
    "Ts/(Ts + Tf). The time constant is converted as it is; a line of the report names both shares, and the time "
    "constant with which the target's would be the source's.",
    "Both are first-order lags of the same time, and alike where Tf is many samples. With a Tf of one sample 63 % pass "
    "instead of 50 %: a kick that is a quarter larger is to be seen on a valve, and nothing is lost.",
)
D581 = Decision(
    581,
    "a conversion tells what a loop does from the start, in Manual, in each cycle and while its PLC is stopped",
    "A loop that begins in its mode begins with an integral of 0, one that waits in Manual goes on from its output. "
    "NextoPID and the neutral form keep the derivative up in Manual, the others begin it anew with Auto. A NextoPID "
    "filter is worked out in each cycle of its task, not with the samples of a slower loop. A DL06 loop that is "
    "independent of the CPU mode and an EZLogix with process_when_stopped control a process whose PLC is stopped: "
    "it is a loss where the source asks for it and the target stands still, else it is named.",
    "Each was found by running both sides: outputs differ by up to the whole range at the start, by gain x Td x the "
    "rate of the PV after Manual, and by what the PV does in half a sample. Only the EZLogix goes on by default, which "
    "nobody asked for: from it a conversion names that, to it the check box is cleared (D760).",
)
