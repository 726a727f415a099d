"""What the autotune needs, and registers that the controller itself writes."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, info, per_loop

if TYPE_CHECKING:
    from pidcfg.validate.rules.click.context import LoopView

TUNING = CLICK.at("PID Autotuning")
OUTPUT = CLICK.at("Control Output (DFn+08)")
RAW = CLICK.at("Raw Process Variable (DFn+11)")

D146 = Decision(
    146,
    "an autotune for PI leaves no derivative",
    "A derivative gain beside `autotune.type: PI` is an info.",
    "That the autotune sets the gains is printed; what it does with the derivative for PI is not.",
)
FULL = (Decimal(0), Decimal(100))
OUTSIDE = {
    "bias": "the change to Auto replaces it by the output",
    "output": "the first sample in Auto brings it back",
}


@per_loop
@info("CK391", D146, "autotune.type is PI, but derivative_gain is {gain} s: an autotune would tune a loop without it")
def autotune_drops_derivative(view: LoopView) -> Findings:
    """An autotune for P and I is chosen for a loop with a derivative.

    Why: gains that were found for PI do not fit a loop that has a derivative as well; whether the PLC sets it to 0 is
    not printed.

    Fix: choose `type: PID`, or check the derivative gain after the autotune.
    """
    gain = view.loop.tuning.derivative_gain
    if view.loop.autotune.type == "PI" and gain > 0:
        yield view.at("autotune", "type", gain=decimal_text(gain))


@per_loop
@checklist("CK392", OUTPUT, "a closed-loop autotune moves the output between {low} and {high} only")
def autotune_between_narrow_limits(view: LoopView) -> Findings:
    """A closed-loop autotune is planned for a loop with narrowed output limits.

    Why: the output stays within its limits during the autotune too. Narrow ones make the PV's swing smaller, so that
    noise counts for more.

    Fix: see that the PV moves clearly; otherwise widen the limits while tuning, or use the open-loop method.
    """
    limits = view.holds("output_lower", "output_upper")
    planned = "autotune" in view.loop.model_fields_set and view.loop.autotune.method == "closed"
    if planned and limits and 0 <= limits[0] < limits[1] and (limits[0] > FULL[0] or limits[1] < FULL[1]):
        yield view.at("autotune", "method", low=view.co(limits[0]), high=view.co(limits[1]))


@per_loop
@info("CK393", OUTPUT, "{register} holds {value}, outside the output limits {low} to {high}: {effect}")
def stored_output_outside_limits(view: LoopView) -> Findings:
    """The output or bias that is stored lies outside the output limits.

    Why: the limits have no effect in Manual, so the output may stand there. On the change to Auto the bias takes the
    output's value, and the output jumps to its limit.

    Fix: bring the output inside its limits before the change to Auto, or leave `state` out.
    """
    limits = view.holds("output_lower", "output_upper")
    for name in ("bias", "output"):
        value = view.held(name)
        inside = not limits or limits[0] >= limits[1] or value is None or limits[0] <= value <= limits[1]
        if getattr(view.loop.state, name) is not None and value is not None and not inside:
            effect = OUTSIDE[name]
            yield view.at(
                "state",
                name,
                effect=effect,
                register=view.register(name),
                value=view.co(value),
                low=view.co(limits[0]),
                high=view.co(limits[1]),
            )


@per_loop
@info("CK394", RAW, "state.pv is {pv} and state.raw_pv is {raw}, but without a filter both are the same")
def stored_pv_differs_from_raw(view: LoopView) -> Findings:
    """PV and raw PV differ in a loop without a filter.

    Why: when the filter is off the PV equals the raw PV, so one of the two values is from another time. The PLC writes
    its own at the first sample.

    Fix: leave `state` out, or give both the same value.
    """
    state = view.loop.state
    if state.pv is not None and state.raw_pv is not None and state.pv != state.raw_pv and not view.filtered:
        yield view.at("state", "pv", pv=view.eu(state.pv), raw=view.eu(state.raw_pv))
