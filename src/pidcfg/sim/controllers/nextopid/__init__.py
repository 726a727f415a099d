"""The virtual NextoPID, and what its blocks do where the manual is silent, or says two things."""

from __future__ import annotations

from pidcfg.text.references import Decision

# --- What the virtual PID blocks and their auto-tuning do where the manual is silent, or says two things --------------

PID_DECISIONS = (
    Decision(
        220,
        "the PID blocks' calculation, operation by operation",
        "P = Kp e, I += (Ki e) Ts, D = (Kd change)/Ts, MV = ((P + I) + D) + BIAS with Ki = Kp/Ti and Kd = Kp Td in "
        "the dependent form; direct control negates P, the increments of I, and D. Every single result is rounded to "
        "single precision, and the actions' outputs show just what was added. A D or I beyond single precision keeps "
        "the value it had.",
        "The parameters are REAL; the manual describes the actions and prints neither an equation nor its order.",
    ),
    Decision(
        221,
        "the derivative's filter and its first call",
        "y += (x − y)(1 − e^(−Ts/Tfd)) for the derivative action as a whole, in every mode; the derivative of the PV "
        "is that of the limited PV. At the first call nothing has changed yet and y is 0.",
        "The printed answers (63 % after 2 s, ±0.25 of ±10) follow from this filter.",
    ),
    Decision(
        222,
        "anti-windup",
        "Of an increment of I, what would push MV past MinMV, MaxMV or the variation that MaxVarMV allows is left out: "
        "the limit less the sum without it is what remains of it. Increments the other way count in full. Windup_H_IN "
        "and Windup_L_IN leave out whole increments.",
        "The manual describes anti-windup between the controllers of a cascade only, and counts MaxVarMV among the "
        "limits that saturate MV.",
    ),
    Decision(
        223,
        "MaxVarMV first, then MinMV and MaxMV",
        "The variation is counted from the MV of the last call, which is 0 before the first one; limits that have "
        "moved away win over it. It holds for what is calculated, also in override; manual, tracking and auto-tuning "
        "set MV at once.",
        "The manual limits the variation between two cycles, and copies ManualMV and TRK_VAL to MV.",
    ),
    Decision(
        224,
        "error bits come first, warning bits tell what is limited in this call",
        "With an error bit set nothing else happens: all other outputs but SampleTime keep their values, and so does "
        "an auto-tuning that runs. SampleTime is the interval of the calls, from the first one. A set point that is "
        "not in use sets no warning bit; a value that equals its limit is not limited. MV's bits hold in every mode.",
        "An error prevents the execution of the block; the manual says of a bit that it is set when a value is being "
        "limited.",
    ),
    Decision(
        225,
        "priority of the modes",
        "AutoTune, then Manual, TRK_IN, OVERR, automatic. CASC chooses the set point in all of them.",
        "The auto-tuning starts in manual and automatic alike and owns MV until AutoTune is reset; of the others, "
        "the operator's command comes first, and what a slave cannot follow before what a selector does not choose.",
    ),
    Decision(
        226,
        "what a cascade master is told",
        "Windup_H_OUT: a higher set point is useless, since MV is limited upward with Direct FALSE, or downward with "
        "Direct TRUE; Windup_L_OUT the other way round. TRK_OUT is FALSE in automatic with CASC only, so TRUE during "
        "an auto-tuning too.",
        "The manual describes both windup outputs in the same words; the master's integral must stop on the side on "
        "which its slave is of no use.",
    ),
    Decision(
        227,
        "override changes only the integral",
        "With OVERR the integral action is TRK_VAL − D − BIAS: the difference of P stays between this MV and the one "
        "that controls. MV is calculated and limited as ever, and the dead band does not hold it.",
        "The manual promises another calculation of the integral action and nothing of MV, which the selector goes "
        "on comparing. With P taken off as well the two MVs would be equal, and rounding would choose.",
    ),
    Decision(
        228,
        "INT blocks",
        "All arithmetic is REAL; MV is rounded half to even when it is written, and is whole wherever it comes back: "
        "as the MV that MaxVarMV counts from, in the dead band, as RefMV.",
        "Only the parameters' types change, and MV is the only INT among the calculated outputs.",
    ),
    Decision(
        229,
        "the integral action where MV is not calculated",
        "In manual, tracking, auto-tuning and while |error| < DeadBand holds MV, I is MV − P − D − BIAS: control "
        "goes on from there. Without integral gain I is 0, and MV jumps to what the other actions make.",
        "The manual wants no bump from tracking and compares it with manual; of the dead band it says both that the "
        "error counts as zero and that MV does not change.",
    ),
    Decision(
        230,
        "how an auto-tuning starts",
        "RefMV is the MV of the last call. Bad parameters and a step past MinMV or MaxMV end it at once, with every "
        "flag that applies. Parameters, MV and PV ranges, Indep apart, are taken at the start. RefPV is the mean of "
        "the samples of 3 s, which all have to lie within H of it; a block that starts with AutoTune TRUE begins at "
        "its first call. Nothing but AutoTune ends the wait for a PV that does not answer. An INT block rounds M, half "
        "to even, and calculates with that; an M of 0 ends it with Bad_PercAmpMV.",
        "The manual names the checks and the 3 s, and no other end. MV as an INT cannot make half steps.",
    ),
    Decision(
        231,
        "how MV comes back from the auto-tuning",
        "At the end MV is RefMV, until AutoTune is reset. In the call of the reset results and flags are cleared. "
        "After an abort that call still sets RefMV; after an end it sets ManualMV or TRK_VAL, and in automatic RefMV "
        "with the integral action that fits the gains, which may just have been copied.",
        "The manual gives MV back to manual or automatic after the reset, and shows code that copies the gains in "
        "the same cycle.",
    ),
    Decision(
        232,
        "what the relay measures",
        "The first step drives the PV up: +M, with Direct TRUE −M. The relay switches when the PV has reached RefPV "
        "+ H or RefPV − H. The first cycle that counts begins with the second switch, each ends two switches later. "
        "The amplitude is the mean of all extremes, the period the mean of all cycles.",
        "The figure of the working principle; it is drawn for one direction.",
    ),
    Decision(
        233,
        "results that cannot be trusted",
        "PEAK_TOO_LOW: amplitude below 2 H. CYCLE_TOO_FAST: period below 10 samples. HIGH_DEAD_TIME: half a period "
        "below 1.5 dead times, a dead time being the time from a switch to the last sample of the extreme that "
        "follows. The results stay to be seen, and AutoTuneError is TRUE.",
        "The manual names the comparisons without their thresholds.",
    ),
    Decision(
        234,
        "the auto-tuning's rule",
        "Ku = 4 M / (π a) and Pu from the relay; P: Kp = 0.5 Ku; PI: Ku/3.2, Ti = 2.2 Pu; PID: Ku/3.2, 2.2 Pu, Td = "
        "Pu/6.3. With Indep the results are Ki = Kp/Ti and Kd = Kp Td; AUTOTUNE_P, _PI and _PID are 0, 1 and 2.",
        "The manual names the relay method and no rule. The values of its example fit Tyreus and Luyben's times with "
        "the gain of their PI controller.",
    ),
    Decision(
        690,
        "what an operator asks for is written before the cycle",
        "Manual, CASC and AutoTune have their new values before the moves and the wires of their base step, of a block "
        "too that is called later; of several requests the last one counts. Results are accepted while they stand: "
        "AutoTuneDone TRUE and AutoTuneError FALSE, until AutoTune is reset.",
        "A panel writes variables between two cycles (D82). Figure 4-6 copies under this condition; results that "
        "have been reset are gains of 0.",
    ),
    Decision(
        691,
        "what is limited when anti-windup cuts an increment",
        "The bits of MV and both windup outputs look at the sum with the whole increment of I: MV is limited although "
        "the increment is cut so that the sum is just at the limit. The reach of MaxVarMV is moved into MinMV to MaxMV "
        "before increments are cut at its ends.",
        "The controller wants to go further and may not, which is what a cascade master has to know.",
    ),
    Decision(
        692,
        "the auto-tuning between its checks",
        "A PercAmpMV out of its range makes no step, so MV_TOO_HIGH and MV_TOO_LOW say nothing of it. The mean is that "
        "of the samples before 3 s have passed; the call in which they have passed takes the first step, and judges "
        "PEAK_TOO_HIGH, and PV_TOO_HIGH and PV_TOO_LOW by the MaxPV and MinPV of this call. After an end MV is that of "
        "override at once, as it is in manual and tracking (D231).",
        "M of a wrong percentage is no step that anybody wants. The figure has the first step at the end of the 3 s.",
    ),
    Decision(
        693,
        "expressions of wires, operation by operation",
        "Every result is rounded to single precision; an INT counts as a REAL, a TIME as seconds. A division by zero "
        "or the root of a negative number leaves the whole expression without a value, also where min, max, AND or OR "
        "would not need it; a sum on the way may be infinite, as long as the whole has a value.",
        "Structured Text may work out all operands, and a REAL holds no more.",
    ),
    Decision(
        694,
        "the PV of a loop that is called every n-th cycle",
        "What the program around assigns is new in every cycle for whoever reads it there; the loop sees what it is in "
        "its call.",
        "The program around runs in every cycle of the task, and assigns before the calls.",
    ),
)
"""In the order of their numbers."""

# --- What the virtual blocks other than PID do where the manual is silent, or says two things -------------------------

BLOCK_DECISIONS = (
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
        "The share of the way of one sample is 1 − e^(−Ts/Tc), the quotient and the share rounded to single precision, "
        "and worked out again when Ts/Tc has changed. Each other result of these blocks is rounded too, so that a slow "
        "lag stops short of its end: what is below half the last digit is lost.",
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
