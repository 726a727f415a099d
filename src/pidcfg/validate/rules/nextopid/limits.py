"""The limits of PV and MV, the bits that the block sets, and values outside."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import NEXTOPID
from pidcfg.schemas.nextopid import D201
from pidcfg.validate.rule import Finding, Findings, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.known import all_known
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

ERRORS = NEXTOPID.at("chapter 2: ErrBits")
WARNINGS = NEXTOPID.at("chapter 2: WarnBits")
SCALE = NEXTOPID.at("chapter 2: MaxMV, MinMV")


@per_pid
@error("NX610", ERRORS, "MaxMV {high} is not above MinMV {low}")
def mv_limits_crossed(view: BlockView) -> Findings:
    """MaxMV is not above MinMV.

    Why: the block stops with an error bit, and MV stays where it is.

    Fix: give MaxMV the larger of the two values.
    """
    return crossed(view, "MinMV", "MaxMV", "ErrBits.MaxMinMV")


@error("NX611", ERRORS, "MaxPV {high} is not above MinPV {low}")
def pv_limits_crossed(context: NextopidContext) -> Findings:
    """MaxPV is not above MinPV.

    Why: the block stops with an error bit, and MV stays where it is.

    Fix: give MaxPV the larger of the two values.
    """
    for view in context.controllers:
        yield from crossed(view, "MinPV", "MaxPV", "ErrBits.MaxMinPV")


@per_pid
@error("NX612", ERRORS, "Kp is {gain}; the {form} form needs {wanted}")
def gain_not_positive(view: BlockView) -> Findings:
    """The proportional gain is 0 or negative.

    Why: the block stops with an error bit. The direction of control is not made with the sign of the gain, and an
    integral without a proportional term is made with DisableP or with the independent form.

    Fix: give a gain above 0, and choose the direction with Direct; for a pure integral add `DisableP: true`.
    """
    gain, indep = view.number_of("Kp"), view.is_on("Indep")
    if gain is not None and (gain < 0 or (gain == 0 and indep is False)):
        wanted = "a value above 0" if indep is False else "0 or more"
        form = "dependent" if indep is False else "independent"
        yield view.at("Kp", "ErrBits.Kp", gain=view.shown("Kp"), form=form, wanted=wanted)


def crossed(view: BlockView, low: str, high: str, effect: str) -> Findings:
    """A finding at the higher one of two limits that leave no room between them."""
    ends = view.number_of(low), view.number_of(high)
    if all_known(ends) and ends[1] <= ends[0]:
        yield view.at(high, effect, high=view.shown(high), low=view.shown(low))


def outside(view: BlockView, key: str, low: str, high: str) -> tuple[str, str] | None:
    """The limit that a parameter lies beyond, and the word for it."""
    value, ends = view.number_of(key), (view.pv_limits if low == "MinPV" else view.mv_limits)
    if value is None or ends is None or ends[0] <= value <= ends[1]:
        return None
    return (low, "below") if value < ends[0] else (high, "above")


def beyond(
    view: BlockView,
    key: str,
    end: tuple[str, str],
    plc_effect: str | None,
    severity: Severity | None = None,
    **values: str,
) -> Finding:
    """A finding about a parameter beyond a limit."""
    values |= {"value": view.shown(key), "side": end[1], "limit": end[0], "end": view.shown(end[0])}
    return view.at(key, plc_effect, severity, **values)


@warning("NX615", WARNINGS, "SP {value} is {side} {limit} {end}: the block controls at {end}")
def set_point_outside_pv_limits(context: NextopidContext) -> Findings:
    """The set point is outside MinPV..MaxPV.

    Why: the block limits it without asking, and controls at the limit instead.

    Fix: correct the set point, or widen the limits.
    """
    for view in context.controllers:
        end = outside(view, "SP", "MinPV", "MaxPV")
        if end is not None:
            in_use = not view.is_pid or view.is_wired("CASC") or not view.is_on("CASC")
            yield beyond(view, "SP", end, f"WarnBits.SP_{end[0]}" if in_use else None)


@per_pid
@warning("NX616", WARNINGS, "SP_CASC {value} is {side} {limit} {end}: cascade mode controls at {end}")
def cascade_set_point_outside_pv_limits(view: BlockView) -> Findings:
    """The set point of the cascade mode is outside MinPV..MaxPV.

    Why: in cascade mode the block limits it without asking, and controls at the limit instead.

    Fix: correct the value, or widen the limits.
    """
    end = outside(view, "SP_CASC", "MinPV", "MaxPV")
    if end is not None and view.is_given("SP_CASC"):
        effect = f"WarnBits.SP_CASC_{end[0]}" if view.may_be_on("CASC") else None
        yield beyond(view, "SP_CASC", end, effect)


@per_pid
@warning("NX617", WARNINGS, "ManualMV {value} is {side} {limit} {end}: manual mode puts out {end}")
def manual_mv_outside_limits(view: BlockView) -> Findings:
    """The output of manual mode is outside MinMV..MaxMV.

    Why: MV is limited in manual mode as well. Where ManualMV is not given it is 0, which may lie below MinMV.

    Fix: give a ManualMV inside the limits.
    """
    end = outside(view, "ManualMV", "MinMV", "MaxMV")
    if end is not None and (view.is_given("ManualMV") or view.may_be_on("Manual")):
        effect = f"WarnBits.MV_{end[0]}" if view.may_be_on("Manual") else None
        yield beyond(view, "ManualMV", end, effect)


@per_pid
@warning("NX618", WARNINGS, "BIAS {value} is {side} {limit} {end}: {effect}")
def bias_outside_limits(view: BlockView) -> Findings:
    """The offset alone drives MV to its limit.

    Why: BIAS is added to MV. Without an integral it is the output at zero error; outside the limits MV stays at one of
    them until the error is large enough. With an integral it only shifts where the integral settles.

    Fix: give the output that holds the set point.
    """
    end = outside(view, "BIAS", "MinMV", "MaxMV")
    integral = view.integral
    if end is None or not view.is_given("BIAS") or integral is None:
        return
    effect = "only the integral brings MV back" if integral else "without an error MV stays at its limit"
    severity = Severity.INFO if integral else None
    yield beyond(view, "BIAS", end, f"WarnBits.MV_{end[0]}", severity, effect=effect)


@per_pid
@warning("NX619", WARNINGS, "TRK_VAL {value} is {side} {limit} {end}: tracking puts out {end}")
def tracking_value_outside_limits(view: BlockView) -> Findings:
    """The output of tracking mode is outside MinMV..MaxMV.

    Why: MV follows TRK_VAL while TRK_IN is TRUE, but not beyond its limits: the return from tracking is then a bump.

    Fix: give a TRK_VAL inside the limits, or widen them.
    """
    end = outside(view, "TRK_VAL", "MinMV", "MaxMV")
    if end is not None and view.is_given("TRK_VAL") and view.may_be_on("TRK_IN"):
        yield beyond(view, "TRK_VAL", end, f"WarnBits.MV_{end[0]}")


@per_pid
@warning("NX620", D201, "{key} {value} is outside output.range {low} to {high}: {percent} % of the output")
def output_range_narrower_than_limits(view: BlockView) -> Findings:
    """MV can go beyond the scale of the output.

    Why: `output.range` says what 0 % and 100 % are. An MV beyond it is more than the valve can do: the integral goes on
    while the valve stands, and comes back late.

    Fix: keep MinMV and MaxMV inside the range, or correct the range.
    """
    scale = view.item.output.range
    for key in ("MinMV", "MaxMV"):
        value = view.number_of(key)
        if scale is not None and value is not None and not scale[0] <= value <= scale[1]:
            percent = (value - scale[0]) / (scale[1] - scale[0]) * 100
            yield view.at(
                key,
                key=key,
                value=view.shown(key),
                low=number_text(scale[0]),
                high=number_text(scale[1]),
                percent=f"{percent:.0f}",
            )


@per_pid
@info("NX621", D201, "without output.range, MinMV {low} counts as 0 % and MaxMV {high} as 100 % of the output")
def output_scale_assumed(view: BlockView) -> Findings:
    """Nothing says what 0 % and 100 % of the output are.

    Why: MinMV and MaxMV are limits. A valve that is limited to 20..80 % has another scale, and tuning rules, reports
    and conversions in % then are wrong by that factor.

    Fix: give `output.range` where the limits are not the ends of the scale.
    """
    if view.item.output.range is None and view.mv_limits not in {None, (Decimal(0), Decimal(100))}:
        yield view.at("MaxMV", low=view.shown("MinMV"), high=view.shown("MaxMV"))
