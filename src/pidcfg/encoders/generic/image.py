"""Neutral loops to their parameters and back, and the choices that the neutral form's equation leaves."""

from __future__ import annotations

from math import expm1

from pidcfg.encoders.maps.generic import LOOPS, TUNING_NUMBERS
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.text.references import Decision

# --- How the neutral form is calculated, where its equation leaves a choice -------------------------------------------

D299 = Decision(
    299,
    "the neutral loop's calculation, operation by operation",
    "In double precision: the root and the filter of the PV; e = SP - PV, turned round where the PV falls when the "
    "output rises, 0 where it is smaller than the dead band; P = gain e; I := I + (gain Ts / Ti) e; D = gain Td "
    "(change of the PV, with the sign of an error, or of the counted error) / Ts; OUT = ((P + I) + D) + bias, "
    "within max_rate from the OUT before, then within the limits. Filters take the share 1 - exp(-Ts/Tf) of each "
    "difference and begin at their first value. A result that is no number leaves OUT as it is.",
    "It is the equation with the plainest discrete form: rectangles and backward differences.",
)
D300 = Decision(
    300,
    "the neutral loop's anti-windup",
    "An integration that would take OUT beyond a limit, or further beyond, is dropped; OUT is that limit. One that "
    "leads back counts. max_rate has no part in it. Without anti_windup I goes on.",
    "Conditional integration is the one that has no constant of its own.",
)
D301 = Decision(
    301,
    "modes of the neutral loop, and how it starts",
    "A loop starts in its mode: in manual with output.manual, else with the value nearest to 0; in the others with "
    "an empty integral, or from the output that a scenario gives; max_rate counts from 0, beyond the limits or not. "
    "A mode acts with the next sample. Manual holds OUT until `output` is set; auto goes on from OUT, since I is "
    "worked out of it; without an integral OUT jumps, and the report says so. With follows_pv the set point becomes "
    "the PV on the way from manual to auto, within its limits, unless it is set after the request; at the start it "
    "stays. P and D are calculated in manual too.",
    "Bumpless in both directions is what every panel controller does, and a start without a past has no integral.",
)
D302 = Decision(
    302,
    "cascades of neutral loops",
    "In cascade the set point is the master's OUT, within the set point's limits. As long as none of its slaves is "
    "in cascade, the OUT of a master that is not in manual is the first slave's set point, within the master's "
    "limits, and its I is worked out of it. A slave keeps its last set point in auto. Loops are calculated in the "
    "order of the file. Cascade without a source is refused.",
    "Entering cascade then does not bump; a master in manual is the operator's.",
)
D303 = Decision(
    303,
    "alarms and pulses of the neutral loop",
    "Alarms look at the filtered PV in every mode: on beyond the point, off when it has come back by the "
    "hysteresis; the rate of change has none, and is that of one sample. PULSE begins its period with a time on of "
    "the share of OUT in its range, taken then; a pulse below min_on is left out, a gap below min_off is closed. "
    "It is as fine as the base step.",
    "The neutral form says points and times only.",
)

# --- A configuration to the parameters of neutral loops ---------------------------------------------------------------

encode = LOOPS.encode

# --- The parameters of neutral loops back to a configuration ----------------------------------------------------------

decode = LOOPS.decode

# --- How a neutral loop holds its gains: engineering units and seconds ------------------------------------------------


def tuning_of(_: GenericFile, loop: Loop) -> LoopTuning:
    """The three numbers of a loop."""
    tuning, seconds = loop.tuning, float(loop.sample_time)
    return LoopTuning(
        TUNING_NUMBERS,
        raises_pv=loop.output_raises_pv,
        current_values=(tuning.gain, tuning.integral_time, tuning.derivative_time),
        obstacle="" if tuning.proportional else "it acts without its proportional term (tuning.proportional)",
        off_texts=("off", "off"),
        sample_time=seconds,
        pv_share=_filter_share(float(loop.pv.filter), seconds),
        derivative_share=_filter_share(float(tuning.derivative_filter), seconds),
    )


def _filter_share(time: float, seconds: float) -> float:
    """What a filter with this time constant takes of a difference in each sample."""
    return -expm1(-seconds / time) if time > 0 else 1.0
