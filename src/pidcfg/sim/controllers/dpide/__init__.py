"""The virtual DPIDE instruction of the Delta AS, and what it does where its manual is silent."""

from __future__ import annotations

from pidcfg.text.references import Decision

# --- What the virtual DPIDE does where its manual is silent: every place where a real PLC may turn out to differ ------

ENGINE_DECISIONS = (
    Decision(
        265,
        "DPIDE's calculation, operation by operation",
        "I_MV := I_MV + (Ki Ts) E, or (Kc Ts / Ti) E; D of the backward difference of two samples over Ts, smoothed; "
        "MV := ((P + I_MV) + D) + BIAS. Every single result is rounded to single precision, so a slow integral can "
        "stall: what is below half the last digit of I_MV is lost. A result that is no number is not written.",
        "Operands are single-precision numbers. The manual prints continuous formulas; sum and difference are those of "
        "the older DVP PID instructions.",
    ),
    Decision(
        266,
        "when operands act, and whose they are",
        "Calculations come at whole multiples of the sampling time since the PLC began to run, and operands act with "
        "the next one, modes too. FALSE for PID_RUN acts at the next base step. A new CYCLE counts after the "
        "calculation that is already due. What an event writes goes to all operands with the same device, those of the "
        "same loop too; an SV, BIAS or MOUT in the device of another loop's MV is that MV at each calculation: a "
        "cascade. A MOUT in the device of its own MV is that MV at all times, also when PID_RUN becomes FALSE.",
        "The instruction refreshes MV after each sampling time; of PID_RUN the manual says that FALSE resets MV. One "
        "device holds one value.",
    ),
    Decision(
        267,
        "DPIDE's derivative has no past at first",
        "The derivative is 0, and its smoothing empty, at the first calculation of the algorithm: at the start, after "
        "PID_RUN was FALSE, after manual and after an autotune.",
        "A difference from a value of another time, or from 0, would be a kick that no change of PV explains.",
    ),
    Decision(
        268,
        "DPIDE's dead band",
        "PV has crossed SV when the error's sign is another one than that of the last error that was not 0, whichever "
        "of the two values moved. An error that equals ERR_DBW is outside. The derivative of the error then goes down "
        "to 0 in one kick and back in another one on leaving; that of PV counts no change inside and the real one of "
        "the last sample on leaving.",
        "The manual counts the error, or the change of PV, as 0 after the crossing, and keeps the previous error and "
        "the previous PV.",
    ),
    Decision(
        269,
        "PID_MODE 0 holds I_MV while MV is beyond its limits",
        "When MV with the new I_MV is above MV_MAX or below MV_MIN, the new I_MV is dropped, whichever way the error "
        "points. A step of BIAS, or of a limit, that leaves I_MV beyond can thus only be undone by P and D.",
        "The manual leaves I_MV unchanged while MV is beyond, and makes no difference between the two directions.",
    ),
    Decision(
        270,
        "PID_MODE 2 works I_MV out of MV",
        "Beyond the limits I_MV := MV − P − D − BIAS with the limited MV, and at the end of manual with the MV of "
        "manual, to which the sample then adds its own part. In manual I_MV stands still. D counts too, so that noise "
        "in the derivative moves I_MV at the limits.",
        "The manual speaks of a formula that calculates the correct value, and does not print it.",
    ),
    Decision(
        271,
        "without Ti_Ki I_MV is 0",
        "Ti_Ki of 0 or below, or Kc 0 in the dependent form, makes I_MV 0 with the next calculation, in PID_MODE 2 "
        "too: nothing is worked out of MV.",
        "The block diagram puts 0 in the integral's place. A value that stayed would come back with the next Ti_Ki.",
    ),
    Decision(
        272,
        "the end of manual bumps without an integral only",
        "I_MV := MV − P − D − BIAS with the MV of manual, in PID_MODE 0 as in 2: MV goes on from there. Without "
        "Ti_Ki nothing can be set: MV becomes P and BIAS, and the report says so when it jumps by more than 1 % of the "
        "way between the limits.",
        "The manual says of both modes that the MV of manual goes into the automatic algorithm; they differ where MV "
        "is beyond its limits.",
    ),
    Decision(
        273,
        "while PID_RUN is FALSE",
        "MV is 0 also where MV_MIN is above 0. I_MV, MOUT and the others stand still, MOUT_AUTO or not; TRUE goes on "
        "with the I_MV of before. An autotune ends without results.",
        "The manual resets MV alone, and stops the algorithm.",
    ),
    Decision(
        274,
        "DPIDE in manual",
        "MV := MOUT within the limits, then MOUT := MV while MOUT_AUTO is TRUE: a MOUT that is written still acts, and "
        "one beyond a limit becomes the limit. MOUT follows MV in an autotune too. `set: {output: …}` writes MOUT; "
        "outside manual the report says that it does not act.",
        "The diagram feeds the limited MV back to MOUT; nothing tells the order.",
    ),
    Decision(
        275,
        "DPIDE's modes by name",
        "off: PID_RUN is FALSE. autotune: PID_MODE is 1, whatever PID_MAN says. manual: PID_MAN is TRUE. auto: the "
        "rest. A request writes what makes its mode: all but off make PID_RUN TRUE; auto makes PID_MAN FALSE, and "
        "PID_MODE what it was before an autotune. Manual during an autotune waits for its end. Nothing is refused.",
        "There is no mode word. PID_MODE 0 and 2 differ in what becomes of I_MV alone.",
    ),
    Decision(
        276,
        "DPIDE's autotune is a relay around SV",
        "MV is held for 16 samples that tell the noise of PV, then switches between MV_MAX, while the error is above "
        "0, and MV_MIN: a cold process is heated first. Where MV_MAX lasts less than 0.4 or more than 0.6 of the "
        "second full cycle, MV goes on evenly around its mean, as far as the nearer limit or 0.5 % of the way between "
        "both; up to four times. Two cycles are measured. "
        "The hysteresis is 4 standard deviations, the dead band has no effect. "
        "No answer within 600 s and 256 samples, an error that keeps its sign for 4 h and 1000 samples, "
        "a cycle below 6 samples, one whose halves stay unlike (beyond 0.2 to 0.8), "
        "or equal limits end it without results.",
        "The manual shows a picture alone: PV rises, swings around SV, then goes on under control. The uneven swing of "
        "a strong heater has a period many times the ultimate one, and gains made of it are unstable.",
    ),
    Decision(
        277,
        "what DPIDE's autotune writes",
        "Tyreus and Luyben: Kc = Ku/2.2, Ti = 2.2 Pu, Td = Pu/6.3, and Tf = Td/10, as gains Kc/Ti and Kc Td in the "
        "independent form; "
        "PID_MODE becomes 0, CYCLE stays. I_MV becomes the mean MV of the measured cycles less BIAS, so that the "
        "algorithm goes on without a dip. Without results PID_MODE becomes what it was before (0 where the "
        "configuration has 1), and nothing else has changed.",
        "The manual names the operands that are filled in and calls it temperature control, where a gentle rule that "
        "bears dead time is wanted.",
    ),
    Decision(
        278,
        "the Delta AS stops",
        "Nothing is calculated, and every operand keeps its value, MV too. When the PLC runs again the first "
        "calculation comes at once and has no past; an autotune begins again.",
        "As with EN FALSE, of which the manual says that the data stay.",
    ),
    Decision(
        279,
        "the scale of DPIDE's PV",
        "Where a run needs PV's range it is `pv.range`; without one 0 to 1, widened to the SV of the start. It has "
        "1,048,576 counts.",
        "PV is a single-precision number in its own unit.",
    ),
    Decision(
        685,
        "a new CYCLE counts from the calculation that is due",
        "Its multiples are counted from that calculation on, no longer from the time at which the PLC began to run.",
        "The instruction waits until the sampling time has passed since its last calculation.",
    ),
    Decision(
        686,
        "Tf smooths the change, before the gain",
        "The backward difference over Ts is smoothed, and then multiplied with the Kd, or Kc Td, of this calculation: "
        "a new gain acts on D at once, and a Td_Kd of 0 does not stop the smoothing.",
        "The block diagrams have Td_Kd and Tf in one box; with the gain inside, a gain that is set to 0 would go on "
        "acting for some Tf.",
    ),
    Decision(
        687,
        "what a calculation of DPIDE remembers after a pause",
        "After PID_RUN was FALSE, and after a stop, neither a crossing in the dead band nor the sign of the last error "
        "is known; manual keeps both. A stop between manual and automatic hinders nothing: MV is taken over (D272).",
        "As with the derivative (D267): what lies before a pause tells nothing of now. MV itself stays in its device.",
    ),
    Decision(
        688,
        "what is written to the MV of a loop that is off",
        "Nothing comes of it where MOUT stands in MV's device: MV and MOUT stay 0, before the first calculation too, "
        "and while the PLC is stopped.",
        "The instruction resets MV in every scan; a value that stood for one scan would reach other loops by the order "
        "of the program alone.",
    ),
    Decision(
        689,
        "sums beyond single precision",
        "An infinite sum is beyond its limit, so MV is that limit. Where the sum is no number, P being infinite "
        "against I_MV, D or BIAS, nothing is written: MV stands, within its limits, and the next calculation has no "
        "past.",
        "A comparison with infinity has a result, and one with no number has none.",
    ),
    Decision(
        1016,
        "a CYCLE shorter than the scan",
        "The instruction calculates in every scan, with CYCLE as Ts, and its sampling time counts from that scan on. "
        "With a CYCLE that is longer it stays at whole multiples of CYCLE (D266), which are carried out in the next "
        "scan.",
        "The instruction calculates only when it is scanned. What a sample is late by is not made up for, and Ts is "
        "the operand: a CYCLE that the scan does not keep integrates too slowly, which PID056 says of a scenario.",
    ),
)
"""In the order of their numbers."""
