"""The virtual CLICK, and what it does where the help is silent: every place where a real PLC may differ."""

from __future__ import annotations

from pidcfg.text.references import Decision

# --- What the virtual CLICK does where the help is silent: every place where a real PLC may turn out to differ --------

CONTROLLER_DECISIONS = (
    Decision(
        110,
        "the CLICK's calculation, operation by operation",
        "Bias := Bias + Ki e, CO := Bias + Kp (e + Kd (e(n) − e(n−1))) with Ki = Kp (Ts/Ti) and Kd = "
        "Td/Ts; reverse action makes Kp negative. Every single result is rounded to single precision. A "
        "slow integrator can stall: what is below half the last digit of the bias is lost.",
        "The registers are single-precision numbers; the help prints the equation and no order of its operations.",
    ),
    Decision(
        111,
        "the CLICK's bias is the integral",
        "The bias starts as the output at the transfer to Auto and adds up Kp Ts/Ti e, before the output "
        "of the same sample is made. It stays within the output's limits (DFn+09, DFn+10), with and "
        "without freeze bias.",
        "Without freeze the help lets the bias integrate up to a limit of its own; the only limits that "
        "it names are those of the output.",
    ),
    Decision(
        112,
        "freeze bias looks at the output of the calculation before",
        "While that output is at DFn+09 or DFn+10 nothing is integrated, whichever way the error points. "
        "As soon as the error drives the output off its limit, integration goes on with the next sample.",
        "The help freezes the bias at the output's limits and says nothing of the error's direction. A "
        "bias within the limits cannot keep the output there against the error.",
    ),
    Decision(
        113,
        "inside the error deadband no term acts",
        "An error whose size is at most the deadband, after squaring, leaves CO = bias, without "
        "integration and without a derivative. The derivative's past goes on with the real error, so "
        "leaving the deadband makes no kick; the derivative's filter is emptied. A deadband of 0 is none.",
        "The help wants no control action inside and the entire error outside: a kick by the deadband's "
        "width would be an action that no change of the PV explains.",
    ),
    Decision(
        114,
        "the derivative gain limit is a first-order filter",
        "The difference of errors is filtered with the time constant Td/limit: y := y + Ts/(Ts + "
        "Td/limit) (x − y). A limit of 100 filters nothing, 0 is no derivative.",
        "The help calls it a high-frequency filter that does nothing at 100, and prints no formula.",
    ),
    Decision(
        115,
        "the PV filter starts full",
        "PV := PV + k/100 (raw − PV) at each sample; the first sample after STOP is passed whole and has "
        "no rate of change.",
        "The formula is a lost figure; the constant is the percentage of the raw PV that is passed.",
    ),
    Decision(
        116,
        "what is no number",
        "A register that holds none is shown as 0 by the signals. A calculation without a result leaves "
        "the output as it is; a bias that is none is error 25. An output, its upper limit, an alarm limit, "
        "the hysteresis or a PV limit that is none has no error.",
        "The help lists errors of the other registers only; a comparison with what is no number is false.",
    ),
    Decision(
        117,
        "PID errors are looked for in every register",
        "Also where the function is off: PWM period and filter constant above all. Infinity is no number. "
        "Only error 23 compares the set-point limits when both are enabled. 200 counts always, with and "
        "without autotune.",
        "A fresh PLC whose loop uses neither PWM nor filter nor autotune shows these errors.",
    ),
    Decision(
        118,
        "a loop with a PID error",
        "It goes to Manual at once, its output as it stands, and goes on measuring, with the nearest "
        "sample rate, filter constant and PWM period that are allowed. Curing the error clears its "
        "number; the mode stays Manual until it is requested. A mode that has never been reached goes on "
        "being requested.",
        "The help says that an error shifts a loop to Manual and that the next lowest one follows; an "
        "operator would go on asking for the mode of a loop that has never run.",
    ),
    Decision(
        119,
        "the CLICK's mode requests",
        "Looked at with the next sample and off again. Auto is refused while an error is active, and in "
        "Autotune, which ends with its own request. The transfer to Auto makes the bias the output (in "
        "mode 1 the set point the PV) and gives the error a past that equals the present.",
        "The request bits are not maintained; a transfer could not be bumpless with a derivative kick.",
    ),
    Decision(
        120,
        "STOP mode of the CLICK",
        "Loops stand still in Manual and drive nothing: CO and pulses are 0, registers keep their values. "
        "RUN begins in Manual with the output that the register holds; nothing requests Auto again but an "
        "event.",
        "Outputs are off in STOP mode; loops begin executing in Manual Mode.",
    ),
    Decision(
        121,
        "pulses",
        "The signal PWM is 1 or 0 for a whole base step, as the discrete output is in the middle of it "
        "(of the first one: at its beginning). The on-time is taken at the start of each period, in every "
        "mode; the base step is at most a hundredth of the period, unless the scenario gives another.",
        "The pulse is the output's percentage of the period; a scenario is run in steps, and an on-time "
        "that always ended late would heat too much.",
    ),
    Decision(
        122,
        "the CLICK's alarms",
        "On when the filtered PV is beyond the limit, off when it is back by the hysteresis; deviation "
        "counts from the set point in both directions, rate of change is a difference of two samples. "
        "How far the PV is back is one result in single precision. They work in every mode and refuse none.",
        "The help has an alarm come when the limit is exceeded and go when the PV is back by the hysteresis.",
    ),
    Decision(
        123,
        "the CLICK's autotune is ours",
        "It starts in Auto and holds the output for 16 samples, which give the PV at rest and its noise. "
        "Open loop: the output steps by 10 % of its limits' range, up or, without room, down, and by as "
        "much again when the PV settles after less than 2 % of the PV limits' range or does not answer; "
        "Ziegler and Nichols' gains of the steepest slope and the dead time. After 600 s and 256 samples "
        "without an answer that stands out of the noise it is given up.",
        'The help names both methods and no rule. It has the PV limits "calculate the Process gain which in turn is '
        'used by Autotune to calculate the Proportional Gain", and not how: a gain, and a time constant that the '
        "slope gives with it, cancel out in Ziegler and Nichols' rule, and a relay needs none. So answers are judged "
        "by the limits, and P comes from the answer, in % per unit; a CLICK with wrong limits may find another one.",
    ),
    Decision(
        124,
        "the CLICK's relay",
        "Closed loop: the output switches between its limits when the error is beyond the hysteresis "
        "DFn+21, in % of the PV limits' range. Three cycles, the first one left out; Ku = 2 (CO range) / "
        "(π √(A² − h²)) with the amplitude A. PID 0.45 Ku, 0.60 Tu, 0.10 Tu, Ts 0.014 Tu; PI 0.30 Ku, Tu, "
        "Ts 0.03 Tu.",
        "Nothing is public of the hysteresis but its name and its range of 1 to 10; noise must not switch the relay.",
    ),
    Decision(
        125,
        "an autotune's results",
        "P, I, D and sample rate are written within what their registers hold without an error. Output "
        "and bias go back to where they were, and the loop to Auto; without results too, with the old "
        "registers. The first sample after it still comes at the old sample rate.",
        "Auto is entered when autotune is completed, and when its request is turned off.",
    ),
    Decision(
        126,
        "set-point limits write the register",
        "At each sample, in every mode, a set point beyond an enabled limit becomes the limit, also one "
        "that a bumpless transfer has just made the PV; where both limits contradict each other the low "
        "limit wins.",
        "The help has the PLC change the set point itself, and names no moment.",
    ),
    Decision(
        127,
        "an output that is written in Auto is refused",
        "The register keeps its value, and the report says so.",
        "The help calls the register read-only in Auto.",
    ),
    Decision(
        128,
        "counts of a PV that has none",
        "Where a run needs a resolution (is the PV at rest?), the PV limits' range has 65536 counts; "
        "without such a range it is 0 to 100.",
        "The PV is a number in its own unit, made by scaling an input of up to 16 bits.",
    ),
    Decision(
        673,
        "a mode request takes over from the start",
        "An event that requests a mode ends what the start of the run still has to do: the configured mode is no "
        "longer requested, and a set point that has not been written yet is not written. With the DL06 as well.",
        "Who asks for a mode has the loop in hand; a set point that came after that would be a step nobody expects.",
    ),
    Decision(
        674,
        "what an event writes shows at once",
        "Set point, output in Manual and a PID error show with the event; an alarm that is switched off "
        "goes off with it. A derivative gain limit of 0 or 100 leaves the filter at the present change of the error.",
        "The registers are the signals. A limit that is switched on later goes on from what it would have filtered.",
    ),
)
"""In the order of their numbers."""

OPERATION_DECISIONS = (
    Decision(
        655,
        "an alarm group that is switched off",
        "Its alarms go off at the event; those of a group that is switched on come with the next sample.",
        "The bit enables the group, and without it nothing keeps an alarm on; alarms are looked for when the PV is.",
    ),
)
"""What an operator's changes do."""
