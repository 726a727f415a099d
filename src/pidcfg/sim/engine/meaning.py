"""What a run means where no manual says it: start, time, metrics, verdicts, and what has no value."""

from pidcfg.text.references import Decision

RUN_DECISIONS = (
    Decision(
        80,
        "metrics look at the loop's signals as the PLC sees them",
        "PV, SP and output are the words in engineering units, held between samples: with filter, noise, rounding and "
        "a broken sensor. Integrals are sums over the base steps in Auto or Cascade, without the last one, which "
        "stands for no time; a loop that was in neither has none, and one that does not end there no final error.",
        "Every metric can then be worked out again from the trend.",
    ),
    Decision(
        81,
        "a step is measured from its event to where the set point goes",
        "Overshoot, settling time and rise time count from the last event that changed a loop's set point, or a signal "
        "that its set point reads, while the loop was in Auto or Cascade and its PV was driven. The step "
        "goes from the set point before to the one that the controller has limited it to within a sample. A "
        "loop that is "
        "outside the band at the end has not settled: the value is none, and an expectation of it fails.",
        "A set point beyond its limits is never reached; a time that is not known must not pass.",
    ),
    Decision(
        935,
        "a step is measured up to the next event that moves the loop",
        "Overshoot, settling time and rise time end before the next event from which a path leads to the loop's PV or "
        "set point: of the loop itself, its cascade, a plant, a signal or the CPU, or the end of a sensor's fault. A "
        "PV outside the band by then has neither overshoot nor settling time, `until` says when that was, and an "
        "expectation of them fails. Events at the base step of the step itself belong to it.",
        "What a later disturbance makes of the PV is no answer to the step.",
    ),
    Decision(
        82,
        "an event takes effect at the first base step that is not before it",
        "At that step events come first, in the order of the file; then the plants, with new signals and the outputs "
        "of the step before; then the controllers that are due.",
        "Between two base steps nothing is calculated, and nothing may happen before its time.",
    ),
    Decision(
        83,
        "the steady start",
        "The pre-roll runs in windows of the longest time constant or dead time (of an integrator 1/gain), at least 4 "
        "samples of the slowest loop, in whole samples of all loops, so that all of them sample at time 0. Modes are "
        "reported at time 0. When 100 windows or the limit on loop-steps do not suffice, that is an error, and the run "
        "starts from the plants' initial values.",
        "A loop that stays in Manual by a programming error would otherwise hide the very report that names the error.",
    ),
    Decision(
        761,
        "where an output is on or off, or pulses, steady is a cycle that comes back",
        "The pre-roll has ended for such a loop, and for one whose PV it moves, when the highest and the lowest PV of "
        "four windows differ from those of the four before by at most 2 % of the swing, or two counts. Time begins "
        "anywhere in the cycle. Every other loop must be at rest.",
        "A relay never rests: its steady state is its cycle, and the run could not begin there otherwise.",
    ),
    Decision(
        84,
        "an expression without a value keeps the last one",
        "Division by zero, the root of a negative number and a result beyond 1e15 leave the signal as it was "
        "(0 at first). "
        "The first time is reported for each expression, and the scenario fails.",
        "A number that is none would spread through every plant, and stopping would hide what happens next.",
    ),
    Decision(
        85,
        "plants in a ring",
        "Plants are stepped in the order in which they depend on each other; where they form a ring, the one that is "
        "written first reads the value of the step before: of the part before where a base step has several (D916).",
        "A ring has no order; a step of delay is the least that can be assumed.",
    ),
    Decision(
        916,
        "a plant whose input is not held goes through a base step in parts",
        "Every plant moves by the exact solution for an input that is held over a step, as what comes from the PLC is. "
        "Where a plant reads another one or itself, or one of second order has `limits`, all plants go through each "
        "base step in equal parts, with the PLC's signals held: in so many that a part is no longer than a tenth of "
        "the shortest lag of such a plant, with what events write, and in 100 at most; where more are wanted, an info "
        "names the plant, its lag and the base step. An integrator's lag is 1/gain in s; a plant without a lag counts "
        "by its dead time, where that is no whole number of base steps. Noise, connections, sensors, the PLC, what is "
        "measured, rows of the trend and events stay on base steps.",
        "What is read at the end of a part is early by half of it, a twentieth of the lag: within 2 % of the way that "
        "a value goes on lags in series, in a ring, in a tank that drains by its level, and to a limit in a swing.",
    ),
    Decision(
        917,
        "a dead time is as long as it is written",
        "With a dead time of n + f steps, f below 1, the input of n + 1 steps ago acts for the share f of a step, and "
        "that of n steps ago for the rest; the plant stops at its limits after either. A dead time of 0 has no line.",
        "The input is held over a step, so that this is the exact solution at any base step.",
    ),
    Decision(
        86,
        "a sticking valve",
        "The valve stands until its input is further away than the stiction band, then moves all the way at its rate "
        "limit, and sticks again where it arrives.",
        "The simplest model that shows the limit cycle of a sticking valve.",
    ),
    Decision(
        87,
        "flags of a report were on at some time",
        "A flag is true when its bit was on at any time of the run; alarms and modes carry their times. "
        "Lists of a loop "
        "end at 1000 entries each, and the report says how many are left out.",
        "A condition that was corrected still happened; a chattering alarm must not fill the memory.",
    ),
    Decision(
        640,
        "changes of mode within a base step are one entry of the log",
        "With the mode at the end of the step, and the reasons of all of them; a mode that a loop enters and leaves "
        "within a step is none, and without a reason there is no entry at all.",
        "The log is made of the status words after each step, as the trend is; nothing between two steps lasts.",
    ),
    Decision(
        641,
        "a scan that does not fit the sample rates",
        "With `scan_time` a loop is calculated in the first scan that is not before its time; the times themselves "
        "keep their grid, and the equation works with the sample rate of the register.",
        'DL06: the CPU executes calculations "on the appropriate scans". CLICK: with a long scan time the output may '
        "not be calculated as quickly as the sample rate says.",
    ),
    Decision(
        642,
        "a plant of second order rests at its limits",
        "At a limit its value stands and its slope is 0; it leaves with the first input that takes it away. No other "
        "plant has anything that could run on behind its limits.",
        "A full tank keeps nothing of what has run over.",
    ),
    Decision(
        695,
        "another sample rate ends an auto-tune",
        "Where another sample rate is written while DL06, CLICK, EZLogix or DPIDE tune a loop, the tune ends at once "
        "without results: DL06 with bit 13, CLICK in Auto with its autotune error, EZLogix with status 6, DPIDE in "
        "the PID_MODE of before. The output goes back, the gains stay, and a note says why. The same number again "
        "changes nothing.",
        "No manual speaks of it. Dead times and periods are counted in samples, and samples of two rates make gains "
        "that look like any others; who needs the tune starts it again.",
    ),
    Decision(
        330,
        "what takes a loop out of its mode",
        "A loop is meant for the mode of its configuration, of the last event that requests one, or of the parameters "
        "and signals that choose it, and has to reach it and end in it. Where it left it, an event on its cascade, on "
        "those signals or on the CPU within ten samples before says why, or an expectation on its mode.",
        "An event long before, or one of the set point, explains nothing.",
    ),
    Decision(
        331,
        "when an error lasts",
        "It is looked at in the last tenth of the run, and in the last quarter of the time before each event that "
        "moves the loop or takes its mode, three dead times of its plants and ten samples at least: the mean error "
        "of the second half against that of the first. A plant time is the dead times and time constants between "
        "output and PV (of an integrator the time in which the whole output moves the PV through its span) and three "
        "samples. "
        "At a limit of the output an error lasts that changes by less than two counts and 0.1 % of span a plant time "
        "after its last event or change of sign, that has grown for two, or that after three would need more than "
        "four more. Inside the limits one lasts that would need more than four plant times and has had four, or two "
        "if it stands still, unless the set point moves; of a plant that integrates only one that stands still. At a "
        "limit the run is judged by the last look that tells, and by the first if no event came before it; inside the "
        "limits by every look. A loop that comes into Auto or Cascade within the time looked at is judged only if it "
        "is at its set point in all of the second half.",
        "Shorter looks take a dead time for a fault, longer ones what happened before; a mean is free of noise and "
        "ripple. What the end of a run shows is often an event's doing, and a short run says nothing of a slow plant: "
        "against its plant a heat-up is on its way at any moment, and the textbooks' most careful tuning answers "
        "within three time constants. A limit that an event brings about between two others is the scenario's wish.",
    ),
    Decision(
        332,
        "how far from its set point a PV may come to rest",
        "2 % of span (5 % where the output is on or off), or the inner deviation alarm where that is closer, or what "
        "the scenario gives the loop as `tolerance`; two counts and 0.1 % of span in any case. At each moment three "
        "standard deviations of its noise and the ripple of its pulses are added. A dead band or a missing integral "
        "is named as the cause of an offset and is no excuse for it.",
        "Deviation alarms are often set wide for the start-up. Whoever wants a level to give way, or a loop to leave "
        "an offset, knows by how much, and writes it down.",
    ),
    Decision(
        911,
        "when a PV has settled",
        "It is within its band after what moved it last, and stays there for the dead time and the sum of the lags, or "
        "for two dead times and the time that it took to come there if that is shorter; ten samples and a period of "
        "its pulses at least. Of a plant that integrates, or has no lag, the second counts, and without dead time "
        "either a sample. What moves it are events from which a path leads to its PV or its set point, ends of sensor "
        "faults, its start in Auto or Cascade, and moves of its own set point by more than the band; a set point that "
        "a master gives is none. A PV behind a set point that still moves is settled within 1.5 plant times of its "
        "rate. A loop that an event takes out of its mode is judged up to there. Otherwise it is not proven, and the "
        "verdict says what is missing; a swing wider than the band that after a whole period is at least 0.8 of "
        "the first has failed. A limit on the set point leaves the loop not proven where the event asked for more.",
        "What comes back later than the plant takes for a whole answer comes from elsewhere. Shorter stays are what a "
        "slow swing shows on its way through the set point.",
    ),
    Decision(
        912,
        "when a loop does better than nothing",
        "The same plants run a second time beside the run, with the outputs of all loops that are judged held from the "
        "moment at which each first comes into Auto or Cascade; pulses give their mean. The error of both is taken "
        "against the set point of the run, while the loop is in Auto or Cascade and its sensor sound, less three "
        "standard deviations of the noise. More than 70 % of it left is not proven; so is a step of the set point by "
        "more than the band, on a plant with lags, of which 63 % come later than the dead time, 1.5 times the "
        "lags (or the lags and a second dead time, if that is longer) and three samples, or after which the error "
        "beyond the band is that of a whole step for 1.5 times as long. Where the error without "
        "control stays within the band nothing has moved the loop, and it is not judged; nor is one whose PV the PLC's "
        "program makes.",
        "A tenth of a gain, or ten times a reset, comes to rest in the end like any other. Lambda tuning with the "
        "closed loop as fast as the plant takes 63 % in the dead time and the lags; SIMC, which waits for a second "
        "dead time, in two dead times.",
    ),
    Decision(
        913,
        "what a written expectation stands in for",
        "An expectation that holds and that bounds a loop's PV or error to the end (`final` with a tolerance; `min` "
        "and `max` without `until`; a highest `settling_time` or `iae`; `final_error` from both sides) proves in the "
        "place of the band and of the comparison with doing nothing, and of nothing else.",
        "Whoever writes the bound knows the plant better than a share of the span does.",
    ),
    Decision(
        914,
        "which changes of a set point meet nobody",
        "An event that sets a loop's set point while it is meant to be in Auto, and is not for more than a tenth of "
        "the run, leaves it not proven; where the loop is in Manual, off, tracks another output or its PLC is stopped, "
        "and it does not come back to Auto or Cascade, the run fails. To set it before the event of the mode is in "
        "order.",
        "Nothing answers to it, and what was to be tested was not.",
    ),
    Decision(
        344,
        "a sensor that is broken for good controls nothing",
        "A loop that is in Auto or Cascade for more than a tenth of the run with a sensor that an event has broken "
        "without an end in the run is not driven, unless an expectation looks at an alarm, a flag or the mode of that "
        "loop. A fault with an end is the scenario's wish.",
        "Its output no longer answers to its PV; who breaks a sensor to see the alarm writes the alarm down.",
    ),
    Decision(
        339,
        "a set point outside the range is a mistake, limited or not",
        "A loop fails by out-of-range, too, when the set point in force at the end or the one of its configuration is "
        "outside its PV's range, even where the PLC limits it. A PV that leaves the range after an event in the last "
        "tenth of the run, or in the last plant time, leaves the loop not proven. Loops in Manual are judged by their "
        "PV, too. An integrator that ends at its `limits` fails the loop that moves it, unless its output is at its "
        "lower limit.",
        "No sensor can show such a value, so nobody can want it; a limit within the range is there to be met.",
    ),
    Decision(
        337,
        "outputs that may stay at a limit",
        "A loop in whose place a selector, min or max takes another loop's output, one whose windup input is on "
        "without a slave that is itself at a limit, and one of two loops of opposite effect at its lower limit while "
        "the other is inside its limits and sees the same PV (to 5 % of span) are not judged; where both are above "
        "5 % of their way they work against each other, and neither is proven. The reason has to hold when the "
        "window ends. A master is at a limit, too, where its slave's output or set point is. A loop whose output a "
        "plant takes as it is, is not left out, whatever OVERR says.",
        "There the output at its limit is what the program wants. The smaller of an output and a constant is a limit "
        "of the output like any other.",
    ),
    Decision(
        333,
        "what counts as an oscillation",
        "Turning points of the PV in the last third of the run, of swings above 4 counts, 1 % of span and ten "
        "standard deviations of its noise; three periods after the first one, the last swing at least 0.8 of the "
        "first, and the last turning point not longer ago than a period. The period is the mean one, the amplitude "
        "half the mean swing.",
        "Noise alone reaches six to nine standard deviations from peak to peak in a run of ordinary length.",
    ),
    Decision(
        334,
        "oscillations that nobody can cure",
        "A loop whose output is on or off, the ripple of pulses (a period of at most four of their cycles, or an "
        "amplitude of no more than the ripple that pulses make which are on for half of their cycle) and loops that "
        "such a loop drives with its period are not judged; neither is one with an auto-tune or a profile, nor a third "
        "with two events that move the loop and do not leave it alone for three periods.",
        "A slower and larger swing of a loop with pulses is a matter of its tuning like any other.",
    ),
    Decision(
        560,
        "an event that changes nothing excuses nothing",
        "An event that sets a parameter, a signal or a plant's number to what it is, or the CPU to the mode that it is "
        "in, is no event for what is always checked. What the PLC writes itself (an output, a bias, and every "
        "parameter after an event of a mode, an auto-tune or a profile) is never taken for the same.",
        "It moves nothing, and would otherwise cut a run into parts that are each too short to be judged.",
    ),
    Decision(
        561,
        "an oscillation that no event explains",
        "Besides the last third, the time since the last event that moves the loop is looked at, up to the next one, "
        "as far as it reaches into the last third: three periods in it as above, or, however few, three swings in a "
        "row each of which is more than 1.1 times the one before, and the last of at least 0.8 of the largest. "
        "In both the longest period lasts at most twice as long as the shortest.",
        "A run of a few periods never has three in its last third, while one that grows by a tenth each half period "
        "is not stable. The swings that noise makes of an inner loop's set point are less even.",
    ),
    Decision(
        562,
        "a run of fewer than ten samples is an error",
        "A run in which no loop that is judged and meant for Auto or Cascade has ten samples is an error at its "
        "duration, as is one that is shorter than a sample of any loop.",
        "Nothing can be seen in it, and green would mean nothing.",
    ),
    Decision(
        563,
        "an output that moves its PV",
        "A loop is not driven, either, where a plant has had no gain for more than the last tenth of the run in Auto "
        "or Cascade, where what its output is read by does not follow it (0 times the output), and where the whole way "
        "of its output, by the gains and expressions as they are at the start and at the end, moves the PV by less "
        "than 4 counts and 0.1 % of span. A way through another loop or a block tells no such figure. An expectation "
        "on an alarm, a flag or the mode excuses a lost gain as it does a broken sensor (D344).",
        "A wire is no control if nothing comes of it. A gain that comes back is the scenario's wish.",
    ),
    Decision(
        335,
        "alarms that stand",
        "The outermost alarms of a loop, together: low-low and high-high in any mode, the outer deviation in Auto or "
        "Cascade; at the end, or for more than a tenth of the run. An alarm that is there when the run or the control "
        "begins counts once it has gone, and at the end of a loop in Auto or Cascade. The time in which an event has "
        "broken the loop's sensor does not count, nor does an alarm that an expectation waits for.",
        "An alarm of start-up is short; what is broken shows in the alarms and is meant to.",
    ),
    Decision(
        338,
        "a word that is no value is an error of the set-up",
        "A setting in a listing whose content is no value of its format (a BCD digit above 9, bits outside a 12-bit "
        "word, a parameter of another type), or a parameter that every loop has and the listing lacks, fails the loop "
        "by set-up-error, whether its function is on or off. What the PLC writes itself, such as the output, is a "
        "note. An error that was corrected during the run stays one: of +35, of a block's Error, of a flag.",
        "What a CPU does with such a word is nowhere documented (D50), so that a run with it proves nothing.",
    ),
    Decision(
        336,
        "what follows from an error that is expected",
        "An error word of the PLC that an expectation names excuses all loops; an error of a loop, or the expectation "
        "that it never comes into Auto or Cascade where it was in neither, itself and its cascade. Nothing of them is "
        "judged. A loop in Auto that shall never be in Cascade is not asked for Cascade, and judged by the rest.",
        "A wrong set-up can be written down and seen to fail, and what follows from it is no news.",
    ),
)
