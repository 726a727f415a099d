"""What a run means where no manual says it: start, time, metrics, and what has no value."""

from __future__ import annotations

from pidcfg.refs import Decision

RUN = (
    Decision(
        80,
        "metrics look at the loop's signals as the PLC sees them",
        "PV, SP and output are the words in engineering units, held between samples: with filter, noise, rounding and "
        "a broken sensor. Integrals are sums over base steps, without the last one, which stands for no time.",
        "Every metric can then be worked out again from the trend.",
    ),
    Decision(
        81,
        "a step is measured from its event to where the set point goes",
        "Overshoot, settling time and rise time count from the last event that changed a loop's set point. The step "
        "goes from the set point before to the one that the controller has limited it to within a sample. A "
        "loop that is "
        "outside the band at the end has not settled: the value is none, and an expectation of it fails.",
        "A set point beyond its limits is never reached; a time that is not known must not pass.",
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
        "written first reads the value of the step before.",
        "A ring has no order; a base step of delay is the least that can be assumed.",
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
)
