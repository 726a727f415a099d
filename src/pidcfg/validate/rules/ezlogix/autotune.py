"""What the autotune would need."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, info, per_loop, warning
from pidcfg.validate.rules.ezlogix.output import looks_like_percent

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import LoopView

TIMEOUT = EZLOGIX.at("Timeout Time (in sec)")
TYPE = EZLOGIX.at("Tuning Type")
STEP = EZLOGIX.at("Autotune Setup")

D190 = Decision(
    190,
    "an autotune needs 40 samples and the integral time",
    "A timeout below 40 sample rates is a warning, one below the integral time an info.",
    "The manual wants it chosen by the dynamics of the process. The noise, the dead time and the slope of the answer "
    "are read from samples; by the rules of Ziegler and Nichols the integral time is two to three dead times, and the "
    "answer to a step lasts longer than that.",
)
SAMPLES = 40
D622 = Decision(
    622,
    "within 10 % of the operating set point is a tenth of the PV's span",
    "An autotune that begins further from the set point starts all the same and leaves a note in a run; where a file "
    "speaks of an autotune, the checklist asks for it.",
    "The manual wants it for best results, and refuses nothing. A tenth of the set point's own value would be another "
    "distance with every zero of the scale.",
)
TENTH = 410
"""Counts of the step: 10 % of the CV."""


def planned(view: LoopView) -> bool:
    """Whether the file speaks of an autotune."""
    return "autotune" in view.loop.model_fields_set


@per_loop
@checklist(
    "EZ485",
    D622,
    "before the autotune bring the process to rest within 10 % of the PV's span of the set point",
)
def autotune_start_condition(view: LoopView) -> Findings:
    """An autotune is planned, and it wants a process at rest near its working point.

    Why: the gains come from one answer to a step of the CV. A PV that was moving already adds its own slope to that
    answer, and far from the set point many processes answer differently. The PLC starts the autotune all the same.

    Fix: in Manual, set the CV that holds the PV near the set point, wait until the PV stands still, then start.
    """
    if planned(view):
        yield view.at_key("autotune")


@per_loop
@warning("EZ480", TIMEOUT, "the autotune's timeout is 0 s: it is aborted as soon as it starts")
def autotune_timeout_zero(view: LoopView) -> Findings:
    """The timeout of the autotune is 0.

    Why: an autotune that has not finished within its timeout is aborted. 0 does not mean "without limit".

    Fix: give several times the time that the process needs to answer a step; the dialog's own value is 600 s.
    """
    if planned(view) and view.loop.autotune.timeout == 0:
        yield view.at("autotune", "timeout")


@per_loop
@info(
    "EZ481",
    D190,
    "the autotune's timeout of {timeout} s is shorter than the integral_time of {integral} s: a process that "
    "needs it has not answered by then",
)
def autotune_timeout_below_integral_time(view: LoopView) -> Findings:
    """The autotune is aborted sooner than the process can answer.

    Why: the integral time is about as long as the process takes to answer a step. A shorter timeout ends the autotune
    before its slope is known. The dialog's 600 s are too short for a slow process.

    Fix: make `autotune.timeout` several integral times long.
    """
    timeout, times = view.loop.autotune.timeout, view.holds("integral_time", "sample_rate")
    if planned(view) and times and SAMPLES * times[1] <= timeout < times[0]:
        yield view.at_key("tuning", timeout=timeout, integral=decimal_text(times[0]))


@per_loop
@warning("EZ482", D190, "the autotune's timeout of {timeout} s leaves it fewer than 40 samples of {sample} s")
def autotune_timeout_few_samples(view: LoopView) -> Findings:
    """The autotune would end after a handful of samples.

    Why: dead time and slope are read from the samples of the answer. Of fewer than 40, some of which must come before
    the step, no line can be drawn.

    Fix: lengthen `autotune.timeout`, or shorten the sample rate.
    """
    timeout, sample = view.loop.autotune.timeout, view.held("sample_rate")
    if planned(view) and sample is not None and 0 < timeout < SAMPLES * sample:
        yield view.at("sample_rate", timeout=timeout, sample=decimal_text(sample))


@per_loop
@info("EZ483", TYPE, "the autotune computes PI gains: the derivative_time of {derivative} s would not fit the new gain")
def autotune_pi_drops_derivative(view: LoopView) -> Findings:
    """The autotune's type is PI, and the loop has a derivative time.

    Why: the gains of a PI loop are computed for a loop without derivative. The derivative time of the file is switched
    off by the autotune, or stays beside a gain that was not made for it.

    Fix: `type: PID`, or switch the derivative off.
    """
    derivative = view.held("derivative_time")
    if planned(view) and view.loop.autotune.type == "PI" and derivative:
        yield view.at("autotune", "type", derivative=decimal_text(derivative))


@per_loop
@warning("EZ484", STEP, "the CV limits {low} and {high} leave no room for the autotune's step of 10 %, {step} counts")
def autotune_step_impossible(view: LoopView) -> Findings:
    """The CV limits are closer together than the step of the autotune.

    Why: the autotune steps the CV up by 10 %. With limits that are closer together it cannot, from any output: it ends
    with status 5.

    Fix: tune by hand; widen the limits for the autotune only if the plant bears it, since they may protect it, and put
    them back afterwards.
    """
    limits = view.cv_limits
    if planned(view) and limits and limits[0] + TENTH > limits[1] and not looks_like_percent(view):
        yield view.at(
            "output",
            "limits",
            plc_effect="autotune status 5",
            low=view.cv(limits[0]),
            high=view.cv(limits[1]),
            step=TENTH,
        )
