"""The set point: its limits, the process range, and what the PLC makes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.encoders.maps.click import SETPOINT_CROSSED
from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.click import EFFECT
from pidcfg.validate.ideas.limits import NUMBERS, outside_limits
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from decimal import Decimal

    from pidcfg.validate.rules.click.context import LoopView

LIMITS = CLICK.at("Setpoint Upper and Lower Limits")
RANGE = CLICK.at("PV Upper and Lower Limits")
TRANSFER = CLICK.at("Bumpless Transfer (Cn+08)")

D132 = Decision(
    132,
    "crossed set point limits are an error when both are enabled",
    "With one of them switched off they are an info, and a limit alone is compared with nothing.",
    "The limits are enabled individually, and only one that is enabled has to be given a value; so a single limit is a "
    "regular use, whatever the other register holds.",
)
ENDS = ("lower", "upper")
CROSSED_EFFECT = f"{EFFECT}{SETPOINT_CROSSED}"


def limits_on(view: LoopView) -> dict[str, Decimal]:
    """The limits that are enabled and hold a value."""
    limits = {end: view.held(f"setpoint_{end}") for end in ENDS if view.setpoint_limited(end)}
    return {end: value for end, value in limits.items() if value is not None}


def crossed(view: LoopView) -> bool:
    """Whether both limits are enabled, and the lower one is above the upper one."""
    return SETPOINT_CROSSED in {error.number for error in view.errors}


def missing(view: LoopView) -> list[str]:
    """The limits that are enabled without a value."""
    return [end for end in ENDS if view.setpoint_limited(end) and view.value(f"setpoint_{end}") is None]


def effective(view: LoopView, setpoint: Decimal) -> Decimal:
    """A set point as the PLC leaves it in the register."""
    ends = limits_on(view)
    if not crossed(view):
        setpoint = max(setpoint, ends.get("lower", setpoint))
        setpoint = min(setpoint, ends.get("upper", setpoint))
    return setpoint


def written(view: LoopView) -> Decimal | None:
    """The set point that the file gives."""
    return None if view.loop.setpoint.value is None else view.held("setpoint")


@per_loop
@error(
    "CK311",
    D132,
    "the lower set point limit {low} in {low_register} is above the upper limit {high} in {high_register}{when}",
)
def setpoint_limits_crossed(view: LoopView) -> Findings:
    """The lower set point limit is above the upper one.

    Why: with both enabled the PLC reports error 23 and keeps the loop in Manual. With one of them switched off that
    waits for the day on which somebody switches it on (an info).

    Fix: write the smaller number as `lower_limit`.
    """
    ends = view.holds("setpoint_lower", "setpoint_upper")
    both = all(view.value(f"setpoint_{end}") is not None for end in ENDS)
    if both and ends and ends[0] > ends[1]:
        active = crossed(view)
        yield view.at(
            "setpoint",
            "lower_limit",
            plc_effect=CROSSED_EFFECT if active else None,
            severity=None if active else Severity.INFO,
            low=view.eu(ends[0]),
            low_register=view.register("setpoint_lower"),
            high=view.eu(ends[1]),
            high_register=view.register("setpoint_upper"),
            when="" if active else ": error 23 as soon as both are enabled",
        )


@per_loop
@error("CK312", LIMITS, "the {end} set point limit is enabled without a value: {register} holds 0, and {consequence}")
def setpoint_limit_without_value(view: LoopView) -> Findings:
    """A set point limit is enabled, but not given.

    Why: its register holds 0, and the PLC writes the limit over every set point beyond it. The help demands a value
    for a limit that is enabled.

    Fix: give the limit, or leave it switched off.
    """
    for end in missing(view):
        broken = crossed(view)
        consequence = f"set points {'below' if end == 'lower' else 'above'} 0 are replaced by 0"
        if broken:
            consequence = "the limits are crossed"
        yield view.at(
            "setpoint",
            f"{end}_limit_enabled",
            plc_effect=CROSSED_EFFECT if broken else None,
            end=end,
            register=view.register(f"setpoint_{end}"),
            consequence=consequence,
        )


@per_loop
@warning("CK313", LIMITS, "both set point limits are {value}: there is no other set point")
def setpoint_limits_equal(view: LoopView) -> Findings:
    """Both set point limits are enabled, and equal.

    Why: the PLC writes the nearer limit over every set point, so an operator's entry jumps back as if the display were
    broken. Limits that differ by less than a single-precision number can hold are equal for the PLC.

    Fix: set the limits apart.
    """
    ends = limits_on(view)
    if len(ends) == len(ENDS) and ends["lower"] == ends["upper"] and not missing(view):
        yield view.at("setpoint", "upper_limit", value=view.shown("setpoint_upper"))


@per_loop
@warning(
    "CK314", LIMITS, "the set point {value} is {side} its {end} limit: the PLC writes {limit} over it in {register}"
)
def setpoint_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside its own limits.

    Why: an enabled limit does not only act inside the calculation. The PLC changes the set point in its register, and
    the loop controls to another one than the file says.

    Fix: correct the set point, or widen the limits.
    """
    value = written(view)
    if value is None or crossed(view):
        return
    kept = effective(view, value)
    if kept != value:
        end, side = ("lower", "below") if kept > value else ("upper", "above")
        yield view.at(
            "setpoint",
            "value",
            value=view.shown("setpoint"),
            end=end,
            limit=view.eu(kept),
            side=side,
            register=view.register("setpoint"),
        )


@per_loop
@warning("CK315", RANGE, "the set point {value} is outside the process range {low} to {high}")
def setpoint_outside_range(view: LoopView) -> Findings:
    """The set point is a value that the process does not reach.

    Why: the PV's range is what the process reaches at 0 % and at 100 % of the output. For a set point beyond it the
    output runs to a limit and stays there.

    Fix: correct the set point. If the process does get there, correct `pv.range`, from which the autotune works out the
    gain.
    """
    value = written(view)
    kept = None if value is None else effective(view, value)
    yield from outside_limits(
        view, "setpoint", "value", value=kept, limits=view.process_range, shown=view.eu, units=NUMBERS
    )


@per_loop
@warning(
    "CK316",
    LIMITS,
    "the {end} set point limit {value} is outside the process range {low} to {high}: it lets set points pass "
    "that the process does not reach",
)
def setpoint_limit_outside_range(view: LoopView) -> Findings:
    """A set point limit lies outside the process range.

    Why: limits are there to prevent an entry outside the limits of the process. One that lies beyond the range prevents
    nothing that matters; often the range of the measuring device was written as limits.

    Fix: bring the limit inside `pv.range`, or correct the range.
    """
    limits = view.process_range
    for end, value in limits_on(view).items():
        if view.value(f"setpoint_{end}") is not None:
            yield from outside_limits(
                view, "setpoint", f"{end}_limit", value=value, limits=limits, shown=view.eu, units=NUMBERS, end=end
            )


@per_loop
@info("CK317", LIMITS, "the {end} set point limit {value} is stored, but {register} is off: it limits nothing")
def setpoint_limit_switched_off(view: LoopView) -> Findings:
    """A set point limit is given, but not enabled.

    Why: its register shows up in every listing; without the enable bit it guards nothing.

    Fix: remove the `…_enabled: false`, or the limit.
    """
    for end in ENDS:
        if view.value(f"setpoint_{end}") is not None and not view.setpoint_limited(end):
            yield view.at(
                "setpoint",
                f"{end}_limit_enabled",
                end=end,
                value=view.shown(f"setpoint_{end}"),
                register=view.register(f"setpoint_{end}_enable"),
            )


@per_loop
@info(
    "CK318",
    TRANSFER,
    "the set point {value} is replaced by the PV when the loop goes from Manual to Auto (bumpless 1)",
)
def setpoint_replaced_by_pv(view: LoopView) -> Findings:
    """The set point of the file does not survive the change to Auto.

    Why: bumpless mode 1 makes set point and PV equal at that moment, so that the output need not move.

    Fix: let the operator or the ladder program write the set point after the change to Auto, or take `bumpless: 2`.
    """
    if view.loop.mode == "auto" and view.loop.bumpless == 1 and view.loop.setpoint.value is not None:
        yield view.at("setpoint", "value", value=view.shown("setpoint"))


@per_loop
@warning("CK319", TRANSFER, "no set point is given: with bumpless 2 the loop goes to Auto with {register} at {zero}")
def setpoint_left_at_zero(view: LoopView) -> Findings:
    """A loop with bumpless mode 2 is meant for Auto, and nothing gives its set point.

    Why: the register is downloaded as 0, and mode 2 does not make it equal to the PV. The loop drives the process
    towards 0, or towards the nearest limit of the set point.

    Fix: give `setpoint.value`, or take `bumpless: 1`.
    """
    loop = view.loop
    setpoint = view.held("setpoint")
    if loop.mode == "auto" and loop.bumpless == 2 and loop.setpoint.value is None and setpoint is not None:
        yield view.at("setpoint", register=view.register("setpoint"), zero=view.eu(effective(view, setpoint)))
