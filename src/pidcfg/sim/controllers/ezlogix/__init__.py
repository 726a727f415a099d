"""The virtual EZLogix, and what it does where its manual is silent: every place where a real PLC may differ."""

from __future__ import annotations

from pidcfg.text.references import Decision

# ----------------------------------------------------------------------------------------------------------------------
# What the virtual EZLogix does where its manual is silent: every place where a real PLC may turn out to differ.

ENGINE_DECISIONS = (
    Decision(
        160,
        "gain 0",
        "Kp = 0 takes the proportional term out and leaves Ts/Ti and Td/Ts as factors of the other two.",
        "The text says that 0 removes the proportional term; the printed formula would remove all three.",
    ),
    Decision(
        161,
        "the derivative of the PV carries the sign of the error",
        "The algorithm called velocity is the position form with Td/Ts (PV(n) − PV(n−1)) for direct action and the "
        "opposite sign for reverse action. It is no incremental form.",
        "The formula is printed with one sign for both actions; with reverse action, where the error falls when the PV "
        "rises, it would be positive feedback.",
    ),
    Decision(
        162,
        "a sample rate below 0.05 s is none",
        "0 (the dialog's default) to 0.04 s: the loop is not calculated, and what is asked of it waits until the "
        "register holds a sample rate.",
        "The manual's range begins at 0.05 s, and the equation divides by the sample rate.",
    ),
    Decision(
        163,
        "square root of the PV",
        "E is the difference of √PV and the set point, times √span of the PV's counts; the derivative of the PV is "
        "that of the root, likewise. The root is that of the register, wherever its counts begin. The recorded SP is "
        "the PV that satisfies it.",
        "A full-scale error keeps full-scale effect; the manual only says that the root takes the place of the PV.",
    ),
    Decision(
        164,
        "set point limits write the register",
        "A set point outside its limits is overwritten with the limit at the next calculation, in every mode; limits "
        "of 0 and 0 make it 0. Of crossed limits the low limit wins.",
        "The manual says of a set point beyond a limit that it is set to the limit, as it does of the CV.",
    ),
    Decision(
        165,
        "Manual to Auto",
        "The integral term becomes CV − offset, and the derivative has no past; the proportional term of the present "
        "error comes on top. Starting in Auto and running again after a stop are such changes. "
        "Without integral time there is no integral term, and the CV jumps to what the other terms make.",
        "Set to the CV itself, as the manual has it, the integral term would bump by the offset; a time of 0 removes "
        "the term.",
    ),
    Decision(
        166,
        "the integral term is a sum in counts of the CV",
        "Each sample adds Kp Ts/Ti E, so that a gain or time that is changed later acts from then on. It keeps its "
        "fraction and stays within a signed 32-bit number.",
        "It can be set to the control value, so it is on its scale; a formula by the letter would rescale its past.",
    ),
    Decision(
        167,
        "saturation",
        "The bit tells whether the CV in its tag, as its limits have left it, is 0 or 4095, in every mode: one that is "
        "held at a limit in between does not set it. Anti-windup looks at the sample before and at the CV as it was "
        "calculated, before its limits: no integration on the side on which that was 0 or 4095.",
        "The manual defines the bit by the Control Variable being either 0 or 4095, and a Control Variable beyond a "
        "limit is set to the limit. Of anti-windup it says that the output is saturated, not where it is looked at: "
        "behind limits inside the range an integral would grow without end. The CV of this sample is not known yet "
        "when its error is integrated.",
    ),
    Decision(
        168,
        "the CV is a whole number",
        "The result is limited to 0 to 4095, rounded half to even, then put within the CV limits; of crossed limits "
        "the low limit wins. In Manual the operator's value stands as it is.",
        "It is a register; the manual speaks of the limits of a computed control value.",
    ),
    Decision(
        169,
        "the error register has a sign",
        "Base+11 is E before the deadband, rounded, as a signed word that stays within ±32767; the signal ERROR shows "
        "it with its sign.",
        "The error has a sign and registers have 16 bits.",
    ),
    Decision(
        170,
        "within the deadband the error is 0 in every term",
        "|E| below the deadband counts as 0, also for the derivative of the error; one that equals it does not. With "
        "the square root the deadband is compared with the difference of the roots.",
        "The manual makes it zero for all computations alike.",
    ),
    Decision(
        171,
        "registers act at the next calculation, as they are",
        "All registers and discretes are read on the fly, and values beyond the printed ranges are used: 100.00 as a "
        "gain, 200 s as a sample rate. CV limits alone stay within 0 to 4095.",
        "The manual lets ladder logic change them at run time, and does not say what it refuses.",
    ),
    Decision(
        172,
        "who writes the CV",
        "A loop starts with a CV of 0, of what its R tag holds in the image, or of what a scenario gives. In Manual "
        "`set: {output: …}` writes it; in Auto and during an autotune that has no effect and is reported.",
        "The manual's monitor changes the CV in Manual only.",
    ),
    Decision(
        173,
        "the PLC stops",
        "Without processing when stopped, a loop stands still with its outputs as they are, and begins as at the start "
        "when the PLC runs again: an autotune is then cancelled (status 4), and the CV is that of before. With it, the "
        "loop goes on: a PV in an R register stands still, a CV in an R register "
        "(without control output) no longer reaches its output, and the scenario says so.",
        "A stopped PLC does not execute the ladder program or update its I/O, but for that of its PID loops. An answer "
        "with a gap fits no curve, and a bit that is on when the PLC starts is no transition (D179).",
    ),
    Decision(
        174,
        "cycles of the control output",
        "The on-time of a cycle is the CV at its beginning / 4096 times the cycle time, the pulse comes first, and "
        "cycles begin when the PLC starts, in every mode. A cycle time of 0 gives no pulses.",
        "The manual prints the duty cycle as CV / 4096; its figure is lost.",
    ),
    Decision(
        175,
        "the control output is as fine as the base step",
        "The signal O is 1 or 0 for a whole base step, as it is in the middle of that step (of the first one: at its "
        "beginning). A scenario with pulses that are short against the sample rate gives a `step`; a plant on the "
        "pulses reads `O`, in an expression such as `OVEN.O * 100`, any other one reads `CV`.",
        "Nothing is calculated between two base steps.",
    ),
    Decision(
        176,
        "short pulses and gaps are left out",
        "An on-time of 0 or below the minimum on time makes a cycle without a pulse; an off-time below the minimum "
        "off time one without a gap. Nothing is made up for in the next cycle.",
        "The manual names the two times and does not explain them.",
    ),
    Decision(
        177,
        "a CV tag that is a set point makes a cascade",
        "Where the CV's R tag is the set point register of another loop, every calculation writes it there, in "
        "counts; the set point's limits change the outer loop's CV when they change the set point. In Manual whoever "
        "writes the one writes the other. The trend shows both when they are written, whatever the sample rates are.",
        "They are one register.",
    ),
    Decision(
        178,
        "autotune's reaction curve",
        "The CV is held for 16 samples that tell the noise, then steps up by 410 counts (10 % of its range) until the "
        "PV has moved by 10 % of its span, has settled, or rises half as fast as before. Slope by regression, dead "
        "time at least one sample; PID: Kp = 1.2/(R L), Ti = 2 L, Td = 0.5 L; PI: 0.9/(R L) and 3.33 L, without "
        "derivative. The sample rate stays.",
        "The manual names the method, the step and the states; the coefficients are those of Ziegler and Nichols.",
    ),
    Decision(
        179,
        "how an autotune ends",
        "The CV goes back to what it was, the mode stays (in Auto with the integral term of before), the register of "
        "the timeout is full again. A countdown that "
        "ends is status 8 when the PV has not moved, else 6; 6 also when it settles on the wrong side, 5 when the step "
        "goes beyond the CV's high limit, 9 when a result is outside its register's range; 10 does not occur. "
        "State 2 lasts one sample, without a countdown of its own. A bit "
        "that is on when the PLC starts is no transition; `start` makes one even when the bit is still on.",
        "The table of states has no entry for the timeout; results outside their ranges are not written.",
    ),
    Decision(
        623,
        "an autotune on a moving PV is told",
        "The 16 samples before the step have a slope. Where it is surely there, and more than a tenth of the steepest "
        "one of the answer, a note says that the PV was moving; gains are delivered all the same. The open-loop "
        "auto-tunes of DL06 and CLICK are looked at alike.",
        "The manual wants a process in a steady state before the start, and refuses nothing. The slope of before adds "
        "to that of the answer, and its line meets the PV of before too early: dead times come out too short, and "
        "gains too high.",
    ),
    Decision(
        670,
        "the PV stays within its counts",
        "A measurement beyond the ends of `pv.range` is the count of that end.",
        "An input module shows its end beyond the end of its signal; the manual says nothing of one.",
    ),
    Decision(
        672,
        "outputs that come back",
        "After a stop a CV in an R register reaches its output with the loop's next calculation.",
        "The ladder program copies it within a scan; a trend shows an output where it is calculated.",
    ),
)
"""In the order of their numbers."""

SIGNAL_DECISIONS = (
    Decision(
        656,
        "the EZLogix's set point is shown within its limits at once",
        "The signal SP has a set point that an event writes within its limits from the event on; the register takes "
        "the limit at the next calculation.",
        "A trend shows what the loop works with, and no calculation ever sees another value.",
    ),
    Decision(
        657,
        "the EZLogix's BIAS is integral term and offset, wherever they are",
        "The signal is not held within the CV limits or 0 to 4095; without anti-windup it runs on as far as a signed "
        "32-bit number.",
        "No register holds it, and the manual limits the control value alone.",
    ),
)
"""What the signals tell that no register does."""
