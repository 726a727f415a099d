"""What the virtual DL06 does around its equation where the manual says nothing of it: modes, set points, profiles."""

from __future__ import annotations

from pidcfg.refs import Decision

OPERATING = (
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
)
"""In the order of their numbers."""
