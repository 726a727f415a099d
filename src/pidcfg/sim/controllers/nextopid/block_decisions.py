"""What the virtual blocks other than PID do where the manual is silent, or says two things."""

from __future__ import annotations

from pidcfg.refs import Decision

BLOCKS = (
    Decision(
        235,
        "a fatal error leaves a block as it is",
        "Its outputs, its warnings and what it remembers stay; Error or ErrBits and SampleTime alone are written. "
        "Functions remember nothing: their outputs are 0. A block that has had errors from the start begins with the "
        "first call without one. A parameter that is no number is such an error.",
        "The manual says that a fatal error aborts the execution, and not what the outputs are then.",
    ),
    Decision(
        236,
        "coefficients of filters and lags",
        "The share of the way of one sample is 1 − e^(−Ts/Tc), rounded to single precision once, and worked out again "
        "when Ts/Tc has changed. Each other result of these blocks is rounded too, so that a slow lag stops short of "
        "its end: what is below half the last digit is lost.",
        "The parameters are REAL. A block that rounds e^(−Ts/Tc) before subtracting it from 1 would differ by up to "
        "6e-8 of the way.",
    ),
    Decision(
        237,
        "the first call of a block",
        "It has no time before it: ControlLag and ControlDelayLag show Init_OutVar, ControlLowFilter its input, "
        "ControlLeadLag G times its input. SampleTime is known from the first call on.",
        "The manual gives the lags an initial value of the output, and the other two none.",
    ),
    Decision(
        238,
        "limits of lags",
        "ControlLag and ControlDelayLag go on from the limited output: they leave a limit at once. ControlLeadLag "
        "limits its output alone; where its limits contradict each other, the low one wins.",
        "The manual copies the limit to the output value, from which a lag goes on. It lists crossed limits as an "
        "error of the lags, and not of ControlLeadLag.",
    ),
    Decision(
        239,
        "how many samples a delay is",
        "DelayTime / SampleTime, rounded half to even. It is too long when it exceeds 100 · SampleTime by more than "
        "the last digits of single precision.",
        "The block keeps samples. Both times are rounded to REAL: 2.9 s would be more than 100 times 29 ms.",
    ),
    Decision(
        240,
        "a changed delay",
        "When the number of samples changes, the delayed value stands for the new DelayTime, and the input is delayed "
        "again from there on. A change of less than that has no effect; a delay of 0 passes the input on.",
        "The manual has the output unchanged during DelayTime seconds after a change.",
    ),
    Decision(
        241,
        "cycles with pulses",
        "(MV − MinMV)/(MaxMV − MinMV) · Period, rounded half to even; they come first in a period.",
        "The printed examples divide MV by the range, and have a MinMV of 0; IEC 61131-3 rounds half to even.",
    ),
    Decision(
        242,
        "when ControlPWM looks at MV and Period",
        "At the first cycle of each period; Warning and Error are renewed in every cycle. An error stops the period "
        "where it is.",
        "A period whose width changed halfway would be on for neither share.",
    ),
    Decision(
        243,
        "the lead/lag step",
        "OutVar = G · (y + Tlead/Tlag · (InVar − y)), then y := y + (InVar − y) · (1 − e^(−Ts/Tlag)), from y = InVar "
        "at the start. Disabled, OutVar is 0 whatever its limits, and y goes on.",
        "This is exact for an input that is held between samples, and steps by G · Tlead/Tlag as the figures do.",
    ),
    Decision(
        244,
        "ControlON_OFF at the edges of its dead band",
        "An error of just DeadBand leaves MV as it is; so does 0 with a DeadBand of 0, which sets no error bit. MV "
        "goes on from ManualMV after manual mode, in which warnings work as well.",
        "The manual switches when the error is bigger; it wants a DeadBand above 0 and sets the bit below 0.",
    ),
    Decision(
        245,
        "selectors of equal outputs",
        "Both select MV2: OVERR1 is on, OVERR2 is not.",
        "The manual prints it so for ControlSelectMin; ControlSelectMax is its mirror image.",
    ),
    Decision(
        246,
        "the split of a range",
        "MV/SPLIT · 100 below SPLIT and (MV − SPLIT)/(100 − SPLIT) · 100 from there on, in this order; falling outputs "
        "are 100 minus that.",
        "Outputs then never leave 0 to 100, in spite of rounding.",
    ),
    Decision(
        247,
        "results of filters and lags beyond single precision",
        "An output or a state that would be no number keeps the value that it had. An output with limits is limited "
        "before: an infinite one is at its limit.",
        "What the PLC does then depends on its settings, and a number that is none would spread.",
    ),
)
"""In the order of their numbers."""
