"""The derivative term and its gain limit."""

from __future__ import annotations

from decimal import Decimal

from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, info, per_loop, warning
from pidcfg.validate.rules.click.context import NO_LIMIT, LoopView
from pidcfg.validate.views import value_or_switch

LIMIT = CLICK.at("Derivative Gain Limit")

D135 = Decision(
    135,
    "a derivative beyond 20 samples wants a limit",
    "A derivative gain of more than 20 sample rates with neither derivative gain limit nor PV filter is a warning.",
    "Td/Ts is the gain of the derivative over the proportional term for a change within one sample; 20 is the upper "
    "end of the limits that the help calls typical.",
)
D136 = Decision(
    136,
    "a derivative gain beyond half the reset time is a warning",
    "Td above Ti/2 is reported for loops that integrate.",
    "Tuning rules for this form of the algorithm give Ti/8 to Ti/4; beyond that the two terms work against each other.",
)
D137 = Decision(
    137,
    "a kick that fills the output is an info",
    "It is reported when a step of the set point by a tenth of the PV's range moves the output by 100 % or more "
    "through the derivative alone, and the derivative has no gain limit.",
    "The topic prints a derivative of the error, so that steps of the set point count as well; it gives no number.",
)
TYPICAL = (8, 20)
TIMES = ("reset_time", "derivative_gain")
GAINS = ("proportional_gain", "derivative_gain")
STEP = Decimal("0.1")
FULL = Decimal(100)


def limit_in_use(view: LoopView) -> Decimal | None:
    """The limit's factor; None when it is off or filters nothing."""
    limit = view.held("derivative_gain_limit") if view.derivative_limited else None
    return None if limit is None or limit >= NO_LIMIT else limit


def has_filter(view: LoopView) -> bool:
    """Whether the PV is filtered by something less than 100 %."""
    constant = view.held("filter")
    return view.filtered and constant is not None and constant < NO_LIMIT


@per_loop
@warning(
    "CK341",
    LIMIT,
    "the derivative gain limit is on with {limit}, which is no derivative: derivative_gain {gain} s has no effect",
)
def derivative_limited_to_nothing(view: LoopView) -> Findings:
    """The derivative gain limit is on, but its register holds 0.

    Why: a factor of 0 is the same as a derivative gain of 0. A limit that is enabled without a value holds 0.

    Fix: give `derivative_gain_limit` a value from 8 to 20, or switch the limit off.
    """
    loop, limit = view.loop, view.loop.derivative_gain_limit
    if view.derivative_limited and not limit and loop.tuning.derivative_gain > 0:
        key = value_or_switch(loop, "derivative_gain_limit")
        yield view.at(key, limit="no value" if limit is None else 0, gain=decimal_text(loop.tuning.derivative_gain))


@per_loop
@info("CK342", LIMIT, "derivative_gain_limit is {limit}, but derivative_gain is 0 s: there is no derivative to limit")
def derivative_limit_without_derivative(view: LoopView) -> Findings:
    """A derivative gain limit is set for a loop without a derivative.

    Why: it does nothing; usually the derivative gain was meant to be set, or was taken out during tuning.

    Fix: set `derivative_gain`, or remove the limit.
    """
    limit = limit_in_use(view)
    if limit and view.loop.tuning.derivative_gain == 0:
        yield view.at("derivative_gain_limit", limit=decimal_text(limit))


@per_loop
@warning(
    "CK343",
    D135,
    "derivative_gain {gain} s is {times} samples of {sample} s: noise of one unit moves the output by {moves} "
    "for a sample, and neither derivative_gain_limit nor pv.filter is on",
)
def derivative_without_limit_or_filter(view: LoopView) -> Findings:
    """A strong derivative acts on an unfiltered PV without a gain limit.

    Why: a change within one sample is multiplied by Kp·Td/Ts, so noise is amplified significantly and the output
    becomes erratic. A limit of 100 filters nothing.

    Fix: set `derivative_gain_limit` (8 to 20), filter the PV, or sample more slowly.
    """
    tuning, sample = view.loop.tuning, view.loop.sample_rate
    if not has_filter(view) and limit_in_use(view) is None and view.sound("sample_rate", "derivative_gain"):
        times = tuning.derivative_gain / sample
        if times > TYPICAL[1]:
            moves = f"{float(times * tuning.proportional_gain):.3g} {view.loop.output.unit or '%'}"
            yield view.at(
                "tuning",
                "derivative_gain",
                gain=decimal_text(tuning.derivative_gain),
                times=f"{float(times):.4g}",
                sample=decimal_text(sample),
                moves=moves,
            )


@per_loop
@info("CK344", LIMIT, "derivative_gain_limit is {limit}; 8 to 20 is typical: {effect}")
def derivative_limit_untypical(view: LoopView) -> Findings:
    """The derivative gain limit is outside the range that the help calls typical.

    Why: below 8 so little of the derivative is left that it can be left out; far above 20 noise passes as if there were
    no limit, and 100 is none at all.

    Fix: choose 8 to 20.
    """
    limit = view.held("derivative_gain_limit")
    if not view.derivative_limited or not limit or view.loop.tuning.derivative_gain <= 0:
        return
    if not TYPICAL[0] <= limit <= TYPICAL[1]:
        effect = "little of the derivative is left" if limit < TYPICAL[0] else "much of the noise passes"
        if limit >= NO_LIMIT:
            effect = "100 filters nothing"
        yield view.at("derivative_gain_limit", limit=decimal_text(limit), effect=effect)


@per_loop
@warning("CK345", D136, "derivative_gain {gain} s is more than half the reset_time of {reset} s")
def derivative_exceeds_reset(view: LoopView) -> Findings:
    """The derivative time is long compared with the reset time.

    Why: the derivative then works against the integral instead of leading it, and the loop swings. Usually minutes and
    seconds were mixed up, or the two values exchanged.

    Fix: a quarter of the reset time is the most that tuning rules give.
    """
    tuning = view.loop.tuning
    if view.integrates and tuning.reset_time < 2 * tuning.derivative_gain and view.sound(*TIMES):
        yield view.at(
            "tuning",
            "derivative_gain",
            gain=decimal_text(tuning.derivative_gain),
            reset=decimal_text(tuning.reset_time),
        )


@per_loop
@info(
    "CK346",
    D137,
    "the derivative is of the error: a set point step of {step} (10 % of the range) moves the output by {kick} "
    "% for a sample",
)
def setpoint_step_kicks_output(view: LoopView) -> Findings:
    """A step of the set point kicks the output through the derivative.

    Why: the algorithm differentiates the error, not the PV, so that a change of the set point counts as an infinitely
    fast change of the process. The output jumps to a limit for a sample and back.

    Fix: change the set point in small steps, set `derivative_gain_limit`, or do without the derivative.
    """
    tuning, sample = view.loop.tuning, view.loop.sample_rate
    if limit_in_use(view) is not None or view.squared or not view.sound("sample_rate", *GAINS) or view.span is None:
        return
    step = STEP * view.span
    kick = tuning.proportional_gain * tuning.derivative_gain / sample * step
    if kick >= FULL:
        yield view.at("tuning", "derivative_gain", step=view.eu(step), kick=f"{float(kick):.4g}")
