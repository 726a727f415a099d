"""The virtual DL06, and what it does where its manual is silent: every place where a real PLC may differ."""

from __future__ import annotations

from pidcfg.text.references import Decision

# --- What the virtual DL06 does where its manual is silent: every place where a real CPU may turn out to differ -------

ENGINE_DECISIONS = (
    Decision(
        30,
        "the engine works in fractions of the data range",
        "e = (SP − PV) / span of the PV's format; the output in counts is M times the span of the output's format. "
        "M is limited to the data range and then to +30/+31, the bias to the data range.",
        "A gain is percent per percent, and the family's bias clamp is to 0 and 1. A user says otherwise of a transfer "
        "(community.automationdirect.com, productivity-pid-bumpless-transfer-fix, 2019): DirectLOGIC and Do-more let "
        "the bias go below 0 % and above 100 %, so that no output jumps. That is not followed: the chapter makes the "
        "bias the output at a transfer, which lies in the range, the sister manual prints the clamp, and the word of a "
        "unipolar format (+04) has no place for more.",
    ),
    Decision(
        31,
        "the error is squared first",
        "With both options on, the error is squared and the deadband applied to the square; an error that equals "
        "the deadband is inside.",
        "The block diagram of the sister manual has this order.",
    ),
    Decision(
        32,
        "reverse action",
        "Mx(n) = Mx(n−1) − Ki e(n) and M(n) = −Kc e(n) − Kr (…) + Mx(n).",
        "The sister manuals of the family (DL05, DL405) print it so. A mirrored output (full scale − M) would break"
        " bumpless transfer and feedforward through +04.",
    ),
    Decision(
        33,
        "gain 0",
        "Kc = 0 takes the proportional term out and leaves Ki = Ts/Ti and Kr = Td/Ts.",
        "The manual calls it a way to integral-only loops, which Ki = Kc Ts/Ti would not be; the DL405 manual says so.",
    ),
    Decision(
        34,
        "the derivative and its limit",
        "The limit filters the signal x that the derivative acts on, Y(n) = Y(n−1) + Ts/(Ts + Td/limit) (x(n) − "
        "Y(n−1)); differences of Y replace differences of x. A limit of 0 is no derivative. `plc.derivative: pv` "
        "lets it act on −PV.",
        "The manual says what the limit is for and not how it works; the formula is that of the family. Of a limit of "
        "0, which it allows, it says nothing; CLICK's help says that its own 0 takes the derivative out.",
    ),
    Decision(
        35,
        "words are rounded, sums are not",
        "SP, PV, bias and output are whole counts wherever another part reads them; the controller keeps the "
        "fractions of the bias, of the velocity form's output and of a ramping set point.",
        "A slow integrator (and a slow ramp) would stall otherwise, which real ones do not.",
    ),
    Decision(
        36,
        "the filter works on words",
        "y = y + k (x − y), rounded to counts at each sample; the first sample fills it.",
        "The filtered PV stands in +03, and the manual warns of 1 part in 1000 because of rounding: k = 0.1 stops "
        "up to 5 counts short.",
    ),
    Decision(
        37,
        "square-root extract",
        "e = (SP word − √PV word) / √span; PV alarms look at the raw PV, deviation alarms at the PV and SP². A "
        "negative PV counts as 0. The recorded SP is the PV that satisfies it, so that both can be compared.",
        "A full-scale error keeps full-scale effect; the manual gives the formulas of the words only.",
    ),
    Decision(
        38,
        "step bias",
        "On a change of the set point Mx := Mx SP(n)/SP(n−1), the inverse ratio for reverse action; not when one of"
        " the two is 0 or their signs differ, and not in the velocity form, which has no bias. Off unless a scenario "
        "says `step_bias: true`.",
        "The feature table names it, no bit enables it; the formula is the sister manual's. \"The Velocity Algorithm "
        'discussed next does not have a bias component."',
    ),
    Decision(
        39,
        "bias freeze looks at the output of the calculation before",
        "While that output is at an end of the data range, the bias does not move further out; it may always come "
        "back.",
        'The freeze follows "when the control output goes out of bounds"; the output of this sample is not known yet.',
    ),
    Decision(
        40,
        "overflow",
        "A result beyond a signed 32-bit number of counts sets bit 11, forces Manual and leaves the output where it"
        " is; the next change to Auto clears the bit.",
        "The manual names the bit and says that an error puts a loop into Manual.",
    ),
    Decision(
        41,
        "bumpless transfer",
        "Type I, Manual to Auto: bias := output and SP := PV (velocity form: SP := PV). Auto to Cascade: output of "
        "the major loop := PV of the minor. Type II: bias := output, nothing else.",
        "The manual's chart is lost in the extract. The sister manuals of the family (DL05, DL405) print it so.",
    ),
    Decision(
        42,
        "a transfer to Auto has no past",
        "e(n−1), e(n−2) and Y start as the present error: no derivative kick.",
        "A bumpless transfer could not be bumpless otherwise.",
    ),
    Decision(
        43,
        "what refuses Auto",
        "An alarm programming error, and (unless a scenario says `auto_interlock: false`) an active absolute PV "
        "alarm; deviation and rate-of-change alarms do not. The alarms are renewed before the request is read.",
        'The manual’s troubleshooting list: "a PV alarm exists, or a PV alarm programming error exists".',
    ),
    Decision(
        44,
        "cascades follow the pointers",
        "A loop whose +32 names the output word of another loop of the table is its minor loop; Cascade is refused "
        "without such a pointer. With several minor loops all must be in Cascade, and each that leaves it takes the"
        " major loop to Manual.",
        "The controller knows of cascades by nothing else.",
    ),
    Decision(
        45,
        "how a run begins",
        "Loops start in Manual. The configured mode is requested every sample in legal order, inner loops first; "
        "each kind of refusal is reported once. One sample after a loop has reached its mode, the configured set "
        "point is written; where the configuration gives none, the set point stays.",
        "An operator would do so; a bumpless transfer has just made SP the PV.",
    ),
    Decision(
        46,
        "alarms are strict",
        "On when the PV is beyond the threshold by any count, off when it is back by the hysteresis.",
        '"Activates immediately above the programmed threshold"; "returned through the threshold by the hysteresis".',
    ),
    Decision(
        47,
        "an alarm programming error forces Manual",
        "Bit 10 is worked out whenever the words are read, and only for groups that are on.",
        '"A loop which develops an error condition automatically goes to Manual."',
    ),
    Decision(
        48,
        "the first sample",
        "It has no rate of change.",
        "There is no sample before.",
    ),
    Decision(
        49,
        "Program mode",
        "Loops that follow the CPU go to Manual and are not calculated, and their outputs are 0 counts at once, also "
        "with auto transfer. An independent loop goes on: with auto transfer of the output its module follows, else "
        "the output is 0 counts; without auto transfer of the PV its PV stands still. Run restores the modes by the "
        "usual transfers; nothing but an alarm programming error or a lost remote set point refuses.",
        '"The CPU forces each loop to return to its prior mode"; output modules turn off in Program mode.',
    ),
    Decision(
        50,
        "a word that is no value counts as 0",
        "A BCD digit above 9 or a stray bit switches the word's function off; the report names it.",
        "What a CPU does with it is not documented; 0 is the off code of nearly every word.",
    ),
    Decision(
        51,
        "sample rates",
        "0: the loop is not calculated. Below the least for the number of loops: the least.",
        '"It must be programmed before the loop will operate properly."',
    ),
    Decision(
        52,
        "slow loops take turns",
        "Where a scenario gives `scan_time`, at most one loop with a sample rate above 2 s is calculated in a scan:"
        " the first due one behind the one that was served last.",
        "The text says so; the flow chart is lost. A loop that is not due does not keep others waiting.",
    ),
    Decision(
        53,
        "V7642",
        "A count that is no BCD number sets bit 2; bit 3 takes the count as it is written, 9 and more too, and is set "
        "only when the start itself lies in V1200 to V7340: V7341 with 8 loops sets bit 0 alone.",
        "The manual's table of bits, by the letter; a table that does not start in the lower range cannot straddle "
        "its end.",
    ),
    Decision(
        54,
        "+35",
        "One bit: in system memory (bit 4), else bit 0 below V10000 and bit 1 from there when the 32 words do not "
        "lie in user memory, which is V400 to V677, V1200 to V7577 and V10000 to V17777. A start is then refused.",
        '"One of the bits will turn on when the ramp/soak generator is started." V400 to V677 stand among the data '
        "areas of the transfer table, V7577 is the end that bit 3 of V7642 knows; DL505 warns of both.",
    ),
    Decision(
        55,
        "segments begin and end at samples",
        "A ramp ends at the first sample at which its end value is reached. A slope of 0 ends the profile; then the"
        " complete bit is on and the step number 0. Start clears the complete bit. A soak lasts one "
        "sample at least.",
        'The generator reads its table "during each PID calculation".',
    ),
    Decision(
        56,
        "ramp/soak commands",
        "Start works alone; of the others hold comes before resume and jog. Jog leaves the set point where it is, "
        "and a hold on. Going to Cascade holds a running profile; in Program mode it stands still.",
        '"Ladder logic must set only one control bit at a time"; truncate means that nothing is made up for.',
    ),
    Decision(
        57,
        "auto-tune's conditions",
        "205 counts of 4095 (of any format: that share of the span; of a square-root loop: of the set point's scale) "
        "are the least distance between PV and SP in the open loop, and the greatest one in the closed loop, which is "
        "tuned at its set point. Bit 13 is on after a refusal, off with the next start; the gains stay.",
        'The note on 205 counts stands in the open-loop section. "Verify the PV and SP values are within 5% of full '
        'scale difference, as required by the auto tune function" stands in both and contradicts the note.',
    ),
    Decision(
        58,
        "auto-tune listens first",
        "For 16 samples nothing moves; they give the PV at rest and its noise, which widens the relay's switching "
        "band (3 standard deviations) and the regression. The noise is the mean of |y(n) − 2 y(n−1) + y(n−2)| / 1.9544 "
        "(of white noise, its standard deviation); up to one count it is none.",
        "Without it, noise switches the relay at every crossing.",
    ),
    Decision(
        59,
        "the reaction curve",
        "The output goes up by 10 % of its span; when the PV settles after less than 2 % of its span, or does not "
        "answer at all, by another 10 %, and the second answer counts. Measured until the PV has moved by 10 % of "
        "its span or has settled. R is the steepest regression line over a tenth of the answer (a fifth with "
        "noise), L ends where it leaves the PV at rest and is at least one sample. The output then goes back.",
        "The manual gives the percentages and the meaning of Rr and Lr, not the method.",
    ),
    Decision(
        60,
        "the relay's cycle",
        "Three cycles from the first change of sign, the first one left out; T and X are means of the other two. "
        "Kpc = 4 M/(π X), X as it is measured, with noise too. Afterwards the loop goes on from its old bias, "
        "the velocity form from the output that it had.",
        '"Proceeds through three full cycles"; the first one still contains the way to the set point. Kpc and Tpc are '
        "computed from Xo, the amplitude of the PV, and To, and from nothing else.",
    ),
    Decision(
        61,
        "closed-loop gains",
        "PID 0.45 Kpc, 0.60 Tpc, 0.10 Tpc, Ts 0.014 Tpc; PI 0.30 Kpc, 1.00 Tpc, Ts 0.03 Tpc. Unverified.",
        "The table is lost in the extract; the classic Ziegler-Nichols gains are a third hotter.",
    ),
    Decision(
        62,
        "a relay at the ends of the data range",
        "Sets bit 13, goes on to the end and writes the gains; limits inside the range set no bit.",
        'The manual calls it an error that "the output goes to the limits of the range", and makes it its method.',
    ),
    Decision(
        63,
        "auto-tune's patience",
        "A PV that does not answer a step is given up after 600 s and 256 samples, an error that keeps its sign "
        "under the relay after 3600 s and 1000 samples: bit 13, and the output as before.",
        "The manual names no time; a run must come to an end.",
    ),
    Decision(
        64,
        "a change of mode stops auto-tune",
        "With bit 13; the words keep their old values, and the output goes back to where it was before the transfer: "
        "Manual holds it, and Auto begins with it. Program mode is such a change.",
        "Both methods say which mode they need. Nobody has asked for an output that the tune has moved; CLICK gives it "
        "back as well.",
    ),
    Decision(
        65,
        "auto-tune writes words",
        "Gain, reset, rate and sample rate are rounded to their last digit and kept inside what the words hold and "
        "above the least sample rate; a gain or reset never becomes an off code.",
        "They are registers like all others.",
    ),
    Decision(
        66,
        "a remote set point that is lost",
        "When +32 of a loop in Cascade comes to name no output word of the table, the loop goes to Manual, and its "
        "former major loop with it. A loop that lost it in Program mode returns to Auto.",
        "The word that a real CPU would read is nobody's set point; an error takes a loop to Manual.",
    ),
    Decision(
        67,
        "the set point that is shown",
        "SP is +02 within its limits, shown as soon as it is written; in Cascade it is the major loop's output as the "
        "last calculation has read it, which events between two samples do not change.",
        "A trend shows what the loop works with. Words that are written alike make the same trend, whatever else was "
        "written beside them.",
    ),
    Decision(
        68,
        "a mode that an event requests takes the place of the configured one",
        "Also when the request is refused: in Program mode and for a loop that is not calculated too. The mode that "
        "Program mode has interrupted comes back with Run.",
        'An operator who asks for Manual does not want Auto a minute later; "the CPU forces each loop to return to '
        'its prior mode".',
    ),
)
"""In the order of their numbers."""

# ----------------------------------------------------------------------------------------------------------------------
# What the virtual DL06 does around its equation where the manual says nothing of it: modes, set points, profiles.

OPERATION_DECISIONS = (
    Decision(
        643,
        "the configured set point is written once",
        "When the loop has been in its configured mode for a sample. A set point that an event writes before takes its "
        "place. A mode that an event requests before, granted or not, ends both requests: the loop keeps the set point "
        "that it has, and the log says so. CLICK does the same.",
        "It stands for an operator who puts the plant into operation; whoever asks for another mode meanwhile has "
        "taken over from him.",
    ),
    Decision(
        644,
        "a major loop waits without a word",
        "While a minor loop is on its way to Cascade and nothing has refused it, the configured mode of its major loop "
        "is not requested, so that there is no refusal to log. When the minor loop is refused, the major loop asks, "
        "and is refused with its own reason.",
        "The legal order is inside out; an operator does not ask for what he knows to be refused.",
    ),
    Decision(
        645,
        "an output that is written in Manual has no limits",
        "+05 takes what an event writes, within the data range, and acts at once; +30 and +31 hold from the first "
        "calculation on.",
        'The limits belong to the "final processing selections" of the calculation, and in Manual "the CPU stops '
        'writing values to location addr+05".',
    ),
    Decision(
        646,
        "Cascade to Auto keeps the past",
        "The set point changes over to +02 as it stands, like any other change of a set point: errors and bias of the "
        "calculations before count on, and neither type of bumpless transfer does anything.",
        "The equation goes on without a break; the manual's two types speak of Manual to Auto.",
    ),
    Decision(
        647,
        "step bias takes the set point words as they are",
        "In a bipolar format the ratio is that of the signed counts, not of shares of the range: 1000 to 2000 counts "
        "doubles the bias, -1000 to -2000 too.",
        "The formula is a ratio of set points, and the words are all that the controller has of them.",
    ),
    Decision(
        648,
        "the change to Run begins anew",
        "At the change to Run the CPU reads all words, those of alarms that stay on included; at the change to Program "
        "the alarms keep the limits that they have. The first sample of a loop comes at once, fills its filter and has "
        "no rate of change, and its grid begins there.",
        'Alarm words are read "only when alarm enable bit transitions 0 to 1", those of limits "only on PLC Mode '
        'change". But "to make changes to any loop table parameter values, the PID loop must be in Manual Mode and the '
        'PLC must be stopped": what is changed then holds afterwards. At the transition to Run "the CPU learns the '
        'location of the loop table and the number of loops", so it knows of no enable bit of before.',
    ),
    Decision(
        649,
        "output limits bound the sum of the velocity form",
        "Increments add up from the limited output with its fraction, not from what the sum would be without limits.",
        "There is no bias that could wind up; the output that the formula starts from is Mn-1, the control output.",
    ),
    Decision(
        650,
        "slow loops take turns in Program mode, too",
        "Those that are independent of the CPU mode; loops that stand still take no turn.",
        'Independent loops are "like having two independent processors", and a loop that is not calculated costs no '
        "time.",
    ),
    Decision(
        651,
        "a raw set point of a root loop is the content of +02",
        "`2048 counts` is a word on the root's scale (0 to 64 counts for 12 bit), of the file as of an event.",
        "Raw counts are what a register holds, whatever they mean.",
    ),
    Decision(
        652,
        "a profile moves from the sample after its start on",
        "At the sample that reads the start bit the set point rests, and a segment that Jog enters rests likewise. "
        "A soak lasts the number of whole samples that is nearest to its time; half a sample counts as one.",
        "The first ramp begins at the present set point; the generator counts in calculations of its loop.",
    ),
    Decision(
        653,
        "a set point that is written during a profile",
        "It holds during a soak; the next ramp goes on from where the generator left off, with its fraction. After "
        "Hold and Resume the ramp goes on from what has been written. Jog keeps the set point with its fraction. In "
        "Cascade a start is refused.",
        '"It is the responsibility of your ladder program to ensure only one source attempts to write the SP value"; '
        'Hold freezes the set point, and "the SP values will resume from their previous value". The generator runs "in '
        'Manual or Auto Mode".',
    ),
    Decision(
        675,
        "the set point word of a loop in Cascade",
        "+02 stays as it is while the loop calculates with the major loop's output: going on in Auto, the loop takes "
        "up the set point that its word holds.",
        'The section on cascades is explicit: the minor loop "will ignore its local SP register", and "the minor '
        "loop's normal SP location, addr+02, remains unchanged\"; those on loop modes and remote set points agree. "
        'One sentence of "Data Sources" says of ramp/soak and cascades that the controller "automatically writes the '
        'setpoint data in location addr+02 for you", to tell when no ladder program has to.',
    ),
    Decision(
        676,
        "a segment that a command begins moves from the next sample on",
        "Start and jog alike, and a start while the first ramp is running.",
        "The first ramp begins at the present set point, which has to be in force for a sample.",
    ),
    Decision(
        677,
        "sums are in counts of the output",
        "Gain, Ki and Kr are multiplied by the output's span before they are by errors in fractions of the PV's, and "
        "bias and output are counts, in bipolar formats with their sign; so step bias scales the bias word.",
        "D30 says fractions; the order of the operations decides how a result between two counts is rounded.",
    ),
    Decision(
        678,
        "the equation is added up as it is printed",
        "Position: Kc e(n), then Kr (…), then Mx. Velocity: the three terms of the change in their order, then the "
        "output of the calculation before. Without a limit of the derivative its signal is the error itself.",
        "A result that lies half-way between two counts is rounded by its last digit, which depends on the order.",
    ),
    Decision(
        679,
        "a measurement becomes counts from the low end of its range",
        "(x - low) times the counts of the span, divided by the width of the range, plus the count of the low end, "
        "then rounded, half to even. EZLogix does the same.",
        "So an analog input scales. Where a measurement lies half-way between two counts, the order decides.",
    ),
    Decision(
        680,
        "Program mode takes a minor loop out of Cascade, and so its major loop to Manual",
        "Also a major loop that is independent of the CPU mode, which then stays in Manual: it has no mode to be "
        "restored. The log gives the minor loop as the reason.",
        '"If the minor loop of a cascaded pair of loops leaves Cascade Mode for any reason, its major loop '
        'automatically goes to Manual Mode."',
    ),
    Decision(
        681,
        "another form of the equation begins without a past",
        "When bit 5 of +00 changes in Auto or Cascade, the errors of before count as the present one. The velocity "
        "form goes on from the output; the position form from the bias that +04 holds, which the velocity form has "
        "left as it was.",
        'The selection "is normally never changed after the initial configuration", and a word stays what it is until '
        "somebody writes it.",
    ),
    Decision(
        682,
        "the hysteresis is read with the alarms that have one",
        "+22 is read when bit 12 or 13 of +00 goes from 0 to 1, not with bit 14.",
        'The table says "only when alarm enable bit transitions 0 to 1", not which. The hysteresis "works in '
        'conjunction with both the deviation and absolute value alarms" and "does not affect the Rate-of-Change '
        'Alarm".',
    ),
    Decision(
        683,
        "a second start of an auto-tune does nothing",
        "While an auto-tune runs, bit 7 of +01 is on already; a start is only logged.",
        'The bit is "autotune done" at 0 and "force start" at 1.',
    ),
    Decision(
        992,
        "pulses of a scenario",
        "The plant `pulses` is on from the beginning of each period for its input, in % of the period, to the nearest "
        "step of its resolution; a change of the input within a period counts from the next one on. Its value in a "
        "base step is the share of it in which the pulse is on, so that no base step changes the mean.",
        "The manual's rung of time proportioning (DL06, On/Off Control Program Example): a period of 10 s in 1000 "
        "ticks, the output taken at its end, on at its beginning.",
    ),
)
"""In the order of their numbers."""
