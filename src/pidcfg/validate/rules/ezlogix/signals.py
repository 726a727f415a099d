"""Process variable, set point and output of the EZLogix: ranges, tags and limits."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction
from itertools import combinations, permutations
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import D154, DUTY_COUNTS
from pidcfg.schemas.ezlogix import CV_FULL, D150
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import EZLOGIX, Decision
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.shared_checks import (
    NUMBER_FIELDS,
    crossed_set_points,
    number_text,
    number_with_unit,
    outside_limits_findings,
    report_at_both,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.ezlogix import Pv
    from pidcfg.validate.rules.ezlogix.setup import EzlogixContext, LoopView

# --- The process variable: its counts and its square root -------------------------------------------------------------

ROOT = EZLOGIX.cite("Use PV Square Root")
MAX_COUNTS_RATIO = 2
"""From how many times as many counts of the PV as of the CV on they are worth a word."""

D187 = Decision(
    187,
    "the root is that of the register",
    "With the square root, `pv.counts` that do not begin at 0 are an error, and a range that does not begin at 0 is a "
    "warning.",
    "The manual takes the root of the PV as it stands; no flow gives 819 counts of a 4 to 20 mA signal, whose root is "
    "29 of 64. A root is in proportion to the flow only where no signal is no flow.",
)


@per_loop
@checklist(
    "EZ445",
    D154,
    "square root: {register} holds the set point on the scale of the root, 0 to {top} counts, {step} % of full "
    "scale a count",
)
def square_root_rescales_set_point(view: LoopView) -> Findings:
    """The square root of the PV changes the scale of the set point.

    Why: the loop compares the set point with the root of the PV, so the set point, its limits and the deadband are on
    the root's scale. Of 4095 counts 64 are left. `pidcfg` converts what is written in the file; a set point that a
    panel or the ladder program writes must be converted there.

    Fix: see that all who write the set point know its scale. For finer steps take the root in the ladder program, into
    an R register with 0 to 4095 counts, and switch `square_root` off.
    """
    if view.loop.pv.square_root and view.scales["pv"].format.minimum == 0:
        top = view.scales["sp"].top_counts
        yield view.report("pv", "square_root", register=view.register("setpoint"), top=top, step=f"{100 / top:.2g}")


@per_loop
@error(
    "EZ446",
    D187,
    "square root of counts that begin at {low}: the PLC takes the root of the whole register, and without any "
    "flow that is {root} of {top}",
)
def square_root_of_offset_counts(view: LoopView) -> Findings:
    """The square root is on for a PV whose counts do not begin at 0.

    Why: the root is that of the register. The counts below the range, as a 4 to 20 mA signal on a 0 to 20 mA input has
    them, are in it: without flow the loop sees a large part of full flow.

    Fix: use an input range that begins at 0 counts, or take the offset away in the ladder program and let an R register
    be the PV.
    """
    form = view.scales["pv"].format
    if view.loop.pv.square_root and form.minimum:
        place = ("pv", "counts")
        yield view.report(*place, low=form.minimum, root=f"{form.minimum**0.5:.0f}", top=f"{form.maximum**0.5:.0f}")


@per_loop
@warning("EZ447", D187, "square root with a range that begins at {low}: no flow, root 0, is taken for {low}")
def square_root_of_offset_range(view: LoopView) -> Findings:
    """The square root is on for a PV whose range does not begin at 0.

    Why: the root of a differential pressure is in proportion to the flow only when no pressure is no flow. With another
    beginning of the range the set point is converted wrongly at every value but the highest.

    Fix: let the range begin at 0.
    """
    pv = view.loop.pv
    if pv.square_root and pv.range is not None and pv.range[0] != 0:
        yield view.report("pv", "range", low=f"{number_text(pv.range[0])} {pv.unit or ''}".strip())


@per_loop
@checklist("EZ448", D150, "the PV spans {span} counts, the CV 4095: a gain of 1 acts as {times} would on percentages")
def counts_beyond_cv(view: LoopView) -> Findings:
    """The PV has more than twice as many counts as the CV.

    Why: the gain is in counts of the CV per count of the PV. With a PV of 16 bits the same gain is 16 times as strong
    as with one of 12 bits, and gains below 0.10 have few digits.

    Fix: see that the gain was chosen for these counts. Otherwise scale the PV to 0 to 4095 in the ladder program.
    """
    span = view.scales["pv"].format.span
    if span > MAX_COUNTS_RATIO * CV_FULL:
        yield view.report("pv", "counts", span=span, times=f"{span / CV_FULL:.3g}")


# --- Loops that read one tag, and loops that read what another one puts out -------------------------------------------

D181 = Decision(
    181,
    "loops with one PV",
    "Two loops may read one tag: a heating and a cooling loop do. They are a warning when the heating set point is "
    "above the cooling one, and an info when both act in the same direction.",
    "The manual does not say. Between crossed set points both outputs are on and work against each other.",
)
D621 = Decision(
    621,
    "a CV that is another loop's PV is a warning",
    "The loops run as they are written: the second one measures the register that the first one writes.",
    "The manual lets any R register be a PV or a CV tag. A loop that holds a valve near the middle by another actuator "
    "is built like this, a mistyped tag far more often.",
)
PV_COUNTS = (0, CV_FULL)
"""Counts of a PV for which the file gives none (D150)."""


def pairs_with_one_pv(context: EzlogixContext) -> Iterator[tuple[LoopView, LoopView]]:
    """Pairs of loops that read one tag."""
    return (pair for pair in combinations(context.loops, 2) if pair[0].loop.pv.tag == pair[1].loop.pv.tag)


@info("EZ408", D181, "{tag} is also the PV of {other}, which acts in the same direction: {action}")
def pv_tag_shared(context: EzlogixContext) -> Findings:
    """Two loops read the same measurement and act in the same direction.

    Why: two integral terms on one PV share the work in any proportion, and drift against each other. Often the tag was
    copied with the rest of the loop.

    Fix: give each loop its own PV. Where two actuators are to serve one process, make one of the loops proportional
    only. A heating and a cooling loop on one PV are not reported.
    """
    for first, second in pairs_with_one_pv(context):
        if first.loop.action == second.loop.action:
            at_first, at_second = (
                first.report("pv", "tag", other=second.name),
                second.report("pv", "tag", other=first.name),
            )
            values = {"tag": second.loop.pv.tag, "action": second.loop.action}
            yield from report_at_both(first, at_first, second, at_second, **values)


@warning(
    "EZ409", D181, "{heating} raises {tag} to {high} counts, {cooling} lowers it to {low}: between them both are on"
)
def set_points_crossed(context: EzlogixContext) -> Findings:
    """A heating and a cooling loop on one PV have crossed set points.

    Why: the reverse-acting loop raises the PV to its set point, the direct-acting one lowers it to its own. With the
    first above the second, both run to their limits and work against each other.

    Fix: put the set point of the direct-acting loop above that of the reverse-acting one, with a gap between them.
    """
    rows = (pair for pair in pairs_with_one_pv(context) if len({view.loop.pv.square_root for view in pair}) == 1)
    pairs = (pair for pair in rows if all(view.loop.setpoint.value is not None for view in pair))
    for heating, cooling in crossed_set_points(
        pairs, lambda view: view.loop.action == "reverse", lambda view: view.setpoint
    ):
        first, second = sorted((heating, cooling), key=lambda view: view.index)
        values = {"tag": first.loop.pv.tag, "high": heating.setpoint, "low": cooling.setpoint}
        names = {"heating": heating.name, "cooling": cooling.name}
        at_first, at_second = (view.report("setpoint", "value") for view in (first, second))
        yield from report_at_both(first, at_first, second, at_second, **values, **names)


@warning(
    "EZ414",
    D181,
    "{tag} is {scale} here and {other_scale} in {other}: one register has one scale",
)
def pv_tag_with_two_scales(context: EzlogixContext) -> Findings:
    """Two loops read the same tag on different scales.

    Why: the counts are the same, so one of the loops takes them for another temperature, level or flow than it is: its
    set point and alarms are as wrong as its scale, and its gain too.

    Fix: give both `pv.range` and `pv.counts` alike. Where they are meant to differ in their unit only, write both
    units.
    """
    for first, second in pairs_with_one_pv(context):
        one, other = (view.loop.pv for view in (first, second))
        if one.square_root == other.square_root and scales_differ(one, other):
            at_first = first.report(
                "pv", "tag", scale=scale_text(one), other_scale=scale_text(other), other=second.name
            )
            at_second = second.report(
                "pv", "tag", scale=scale_text(other), other_scale=scale_text(one), other=first.name
            )
            yield from report_at_both(first, at_first, second, at_second, tag=one.tag)


def scales_differ(first: Pv, other: Pv) -> bool:
    """Whether equal counts are different values in one unit, or the same value in different units."""
    if (first.range is None) != (other.range is None):
        return False
    alike = [value_at(first, counts) for counts in PV_COUNTS] == [value_at(other, counts) for counts in PV_COUNTS]
    units = {first.unit, other.unit}
    return alike == (None not in units and len(units) > 1)


def value_at(pv: Pv, counts: int) -> Fraction:
    """What counts are on a PV's scale, exactly; without a range the share of its counts."""
    first, last = pv.counts or PV_COUNTS
    low, high = map(Fraction, pv.range or (0, 1))
    return low + (high - low) * (counts - first) / (last - first)


def scale_text(pv: Pv) -> str:
    """A scale as a message quotes it."""
    first, last = pv.counts or PV_COUNTS
    values = f"{decimal_text(pv.range[0])} to {number_with_unit(pv.range[1], pv.unit)} at " if pv.range else ""
    return f"{values}{first} to {last} counts"


@warning(
    "EZ413",
    D621,
    "{tag} is the CV of {writer} and the PV of {reader}: {reader} controls what {writer} puts out, and measures no "
    "process",
)
def cv_tag_is_another_pv(context: EzlogixContext) -> Findings:
    """The CV tag of a loop is the PV tag of another one.

    Why: the register holds what the first loop works out, in counts of its CV. The second loop takes it for a
    measurement. Often one of the two tags was mistyped, or a cascade was meant, which needs the set point's register.

    Fix: give the second loop the register of its measurement; for a cascade make the CV tag the set point register
    (Base+1) of the inner loop. Where the position of an actuator is controlled on purpose, ignore the finding with
    that reason.
    """
    for writer, reader in permutations(context.loops, 2):
        if writer.loop.output.tag == reader.loop.pv.tag:
            names = {"tag": reader.loop.pv.tag, "writer": writer.name, "reader": reader.name}
            yield from report_at_both(
                writer, writer.report("output", "tag"), reader, reader.report("pv", "tag"), **names
            )


# --- The set point, its limits and the deadband -----------------------------------------------------------------------

SETPOINT_LOW = EZLOGIX.cite("Setpoint Low Limit")
LIMITS = EZLOGIX.cite("PID Limits")
SETPOINT = EZLOGIX.cite("Setpoint")

D186 = Decision(
    186,
    "a deadband of more than a tenth of the PV's span is a warning",
    "It is an error when no PV is that far from the set point. A deadband of one count or less of an integer error is "
    "an info: it changes nothing.",
    "The manual gives no bounds. An error below the deadband counts as zero, and errors are whole counts; those of a "
    "square-root loop are not.",
)
DEADBAND_DIVISOR = 10
"""Parts of the span that a deadband may be one of."""


def has_limits_of_zero(view: LoopView) -> bool:
    """Whether both limits are the dialog's 0, and make any other set point 0."""
    zero = view.loop.setpoint.value is not None and view.counts("setpoint") == 0
    return view.setpoint_limits == (0, 0) and not zero


@per_loop
@error("EZ435", LIMITS, "the low set point limit {low} is above the high limit {high}")
def set_point_limits_crossed(view: LoopView) -> Findings:
    """The low set point limit is above the high one.

    Why: every set point is outside one of them, and is replaced by a limit; by which one, the manual does not say.

    Fix: write the low limit first.
    """
    limits = view.all_counts("setpoint_low", "setpoint_high")
    if limits and limits[0] > limits[1]:
        yield view.report("setpoint", "limits", low=view.pv_text(limits[0]), high=view.pv_text(limits[1]))


@per_loop
@error(
    "EZ436",
    LIMITS,
    "both set point limits are 0 counts, as in the dialog of a new loop: {register} becomes 0 whatever is "
    "written to it",
)
def set_point_limits_zero(view: LoopView) -> Findings:
    """Both set point limits are left at 0.

    Why: they do not mean "no limits". A set point above the high limit is set to it, so every set point becomes 0: a
    heating loop stays off, and a cooling one runs at full output.

    Fix: give the limits of the process, or leave `setpoint.limits` out, which stores the ends of the PV's counts.
    """
    if has_limits_of_zero(view):
        yield view.report("setpoint", "limits", register=view.register("setpoint"))


@per_loop
@warning("EZ437", LIMITS, "both set point limits are {value}: there is no other set point")
def set_point_limits_equal(view: LoopView) -> Findings:
    """Both set point limits are equal.

    Why: every entry of an operator jumps back to this one value, as if the display were broken.

    Fix: set the limits apart.
    """
    limits = view.setpoint_limits
    if limits is not None and limits[0] == limits[1] and not has_limits_of_zero(view):
        yield view.report("setpoint", "limits", value=view.pv_text(limits[0]))


@per_loop
@error("EZ438", SETPOINT_LOW, "the set point {value} is {side} its {end} limit: {register} becomes {limit}")
def set_point_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside its own limits.

    Why: the PLC sets it to the limit, and the loop controls to another set point than the file says.

    Fix: correct the set point, or widen the limits.
    """
    value, limited_setpoint = view.counts("setpoint"), view.setpoint
    if (
        view.loop.setpoint.value is None
        or value is None
        or limited_setpoint in {None, value}
        or has_limits_of_zero(view)
    ):
        return
    side, end = ("below", "low") if value < (limited_setpoint or 0) else ("above", "high")
    yield view.report(
        "setpoint",
        "value",
        value=view.pv_text(value),
        side=side,
        end=end,
        limit=view.pv_text(limited_setpoint or 0),
        register=view.register("setpoint"),
    )


@warning(
    "EZ439",
    SETPOINT,
    "the loop starts in Auto without a set point: {register} is downloaded as 0 counts, and the loop controls "
    "to {value}",
)
def set_point_left_at_zero(context: EzlogixContext) -> Findings:
    """A loop starts in Auto, and nothing gives its set point.

    Why: the register holds 0, or the low limit that replaces it, until an operator or the ladder program writes it.
    A cooling loop runs at full output until then.

    Fix: give `setpoint.value`, or start the loop with `mode: manual`.
    """
    for view in context.loops:
        if (
            view.loop.mode != "auto"
            or view.loop.setpoint.value is not None
            or view.index in context.remote_setpoint_loops
        ):
            continue
        if view.setpoint is not None and not has_limits_of_zero(view):
            yield view.report("mode", register=view.register("setpoint"), value=view.pv_text(view.setpoint))


@per_loop
@warning("EZ440", D186, "the deadband is {deadband}: {consequence}")
def deadband_wide(view: LoopView) -> Findings:
    """The deadband is a large part of the PV's span.

    Why: an error below it counts as zero, so the PV may wander that far to both sides of the set point. A deadband that
    no error can reach (an error) leaves the output standing for good.

    Fix: make it as wide as the noise of the measurement, no more. It is a difference, in the PV's unit.
    """
    deadband, limits = view.counts("deadband"), view.setpoint_limits
    if not deadband or limits is None:
        return
    scale = view.scales["sp"]
    max_error = max(limits[1] - scale.zero_counts, scale.top_counts - limits[0])
    if deadband > max_error:
        consequence = "no error is that large, the loop rests"
        yield view.report(
            "deadband", severity=Severity.ERROR, deadband=view.pv_distance(deadband), consequence=consequence
        )
    elif deadband * DEADBAND_DIVISOR > scale.top_counts - scale.zero_counts:
        share = f"{100 * deadband / (scale.top_counts - scale.zero_counts):.0f}"
        yield view.report(
            "deadband",
            deadband=view.pv_distance(deadband),
            consequence=f"errors of up to {share} % of the PV's span are not corrected",
        )


@per_loop
@info("EZ441", D186, "a deadband stored as {counts} has no effect: errors are whole counts")
def deadband_without_effect(view: LoopView) -> Findings:
    """A deadband is so small that it does nothing.

    Why: errors below the deadband count as zero. Below one count there is only the error 0, so a deadband of 1 is the
    same as none.

    Fix: write a deadband of two counts or more, or leave it out.
    """
    counts = view.counts("deadband")
    has_deadband = view.loop.deadband.value > 0 and not view.loop.pv.square_root
    if has_deadband and counts is not None and counts <= 1:
        yield view.report("deadband", counts="1 count" if counts else "0 counts")


# --- The control value: its limits, its offset, and windup ------------------------------------------------------------

CV_LOW = EZLOGIX.cite("Control Value (CV) Low Limit")
CV_HIGH = EZLOGIX.cite("Control Value (CV) High Limit")
ANTI_WINDUP = EZLOGIX.cite("Anti-Windup")
OFFSET = EZLOGIX.cite("CV Offset")

D188 = Decision(
    188,
    "anti-windup acts at 0 and 4095, not at the CV limits",
    "Limits narrower than these are a warning where there is an integral term and anti-windup is on: the integral goes "
    "on until the CV before its limits is 0 or 4095, and the saturation bit does not come on meanwhile.",
    "The manual calls the CV saturated at 0 and at 4095. A CV that is held at a limit in between is neither, and what "
    "anti-windup looks at is the CV before that (D167).",
)
D189 = Decision(
    189,
    "an upper CV limit of 100 counts or less is a warning",
    "It is taken for a percentage, unless the output has a range or the limit is written with the word counts.",
    "100 of 4095 counts are 2.4 %; other controllers limit their outputs in %.",
)
MAX_PERCENT = 100


def looks_like_percent(view: LoopView) -> bool:
    """Whether the CV limits look like percentages."""
    limits, output = view.cv_limits, view.loop.output
    return limits is not None and limits[1] <= MAX_PERCENT and output.range is None and not output.limits[1].counts


def is_pulse_skipped(view: LoopView, cv: int) -> bool:
    """Whether the pulse for a CV is shorter than the minimum on time, and there is none."""
    return view.pulses is not None and view.pulses[0] * cv < view.pulses[1] * DUTY_COUNTS


@per_loop
@error("EZ455", CV_HIGH, "the CV high limit {high} is not above the low limit {low}: the output cannot move")
def cv_limits_not_ascending(view: LoopView) -> Findings:
    """The CV low limit is equal to or above the high one.

    Why: equal limits pin the output. With crossed ones every CV is outside one of them, and which one wins is not
    documented; limits of 0 and 0 keep it off.

    Fix: write the low limit first; 0 and 4095 counts when `limits` is left out. The direction of control is the loop's
    `action`, not the order of the limits.
    """
    limits = view.all_counts("cv_low", "cv_high")
    if limits and limits[0] >= limits[1]:
        yield view.report("output", "limits", low=view.cv_text(limits[0]), high=view.cv_text(limits[1]))


@per_loop
@warning(
    "EZ456",
    D188,
    "anti-windup acts at 0 and 4095 counts only: while the CV is held at {limits}, the integral goes on until "
    "the calculated CV is there",
)
def anti_windup_blind_to_limits(view: LoopView) -> Findings:
    """The CV limits are narrower than 0 to 4095, and anti-windup is to protect the integral.

    Why: anti-windup looks at the CV before its limits. While the CV is held at a limit in between, the integral goes on
    until the unlimited value is 0 or 4095, and has to come back from there before the output moves. The saturation bit
    tells nothing of it: it looks at the CV itself.

    Fix: leave the limits at 0 and 4095 where they are not needed; otherwise expect the overshoot, or make the integral
    time longer.
    """
    limits = view.cv_limits
    if limits is None or limits == (0, CV_FULL) or looks_like_percent(view):
        return
    if view.loop.anti_windup and view.integrates:
        held = [view.cv_text(limit) for limit, end in zip(limits, (0, CV_FULL), strict=True) if limit != end]
        yield view.report("output", "limits", limits=" or ".join(held))


@per_loop
@checklist("EZ457", CV_LOW, "the CV low limit is {low}: in Auto the output never goes below {percent} %")
def output_never_off(view: LoopView) -> Findings:
    """The CV low limit is above 0.

    Why: the loop cannot switch its output off, whatever the PV is; pulses keep the minimum duty cycle that the dialog
    shows. With a heater that is more than the losses at the set point, the temperature goes on rising.

    Fix: see that the process needs this minimum; otherwise write a low limit of 0.
    """
    low = view.cv_limits[0] if view.cv_limits is not None else 0
    if low and not is_pulse_skipped(view, low):
        yield view.report("output", "limits", low=view.cv_text(low), percent=f"{100 * low / DUTY_COUNTS:.3g}")


@per_loop
@warning("EZ458", OFFSET, "the CV offset {offset} is outside the CV limits {low} and {high}")
def offset_outside_limits(view: LoopView) -> Findings:
    """The CV offset lies outside the CV limits.

    Why: the offset is the CV when the error is zero. The limit cuts it off, so the loop answers only from a certain
    error on.

    Fix: bring the offset inside the limits.
    """
    offset, limits = view.counts("cv_offset"), view.cv_limits
    default = "offset" not in view.loop.output.model_fields_set
    if default or (offset == 0 and view.integrates):
        return
    yield from outside_limits_findings(
        view, "output", "offset", value=offset, limits=limits, quote=view.cv_text, units=NUMBER_FIELDS, field="offset"
    )


@per_loop
@info("EZ459", OFFSET, "the CV offset {offset} is added to an integral term, which cancels it")
def offset_beside_integral(view: LoopView) -> Findings:
    """A CV offset is given for a loop with an integral term.

    Why: the integral takes up whatever the process needs, so a constant beside it has no lasting effect; when the loop
    goes to Auto the integral term begins at the CV without the offset.

    Fix: leave the offset out, or take it as the place where the CV begins after an integral time is set to 0.
    """
    offset, limits = view.counts("cv_offset"), view.cv_limits
    if offset and view.integrates and limits is not None and limits[0] <= offset <= limits[1]:
        yield view.report("output", "offset", offset=view.cv_text(offset))


@per_loop
@warning(
    "EZ460",
    ANTI_WINDUP,
    "anti_windup is off with an integral_time of {integral} s: the integral goes on while the CV is saturated",
)
def integral_without_anti_windup(view: LoopView) -> Findings:
    """A loop with integral term has no anti-windup.

    Why: while the CV is at 0 or 4095 the sum goes on growing, and the PV has to stay on the other side of the set point
    for as long until it has shrunk again. Heating up from cold ends in a long overshoot.

    Fix: `anti_windup: true`, the dialog's own choice.
    """
    if not view.loop.anti_windup and view.integrates:
        yield view.report("anti_windup", integral=decimal_text(view.register_value("integral_time") or Decimal(0)))


@per_loop
@warning("EZ461", D189, "the CV high limit is {high} counts of 4095: {percent} %, if it is not meant as {high} %")
def cv_limit_looks_like_percent(view: LoopView) -> Findings:
    """The CV may not exceed 100 counts.

    Why: without a range the limits are counts, 4095 at full output. Limits of [0, 100] are meant as percentages; here
    the actuator hardly opens.

    Fix: give the output the range [0, 100], or write `"100 counts"` if that little is meant.
    """
    if looks_like_percent(view) and view.cv_limits is not None:
        high = view.cv_limits[1]
        yield view.report("output", "limits", high=high, percent=f"{100 * high / CV_FULL:.2g}")
