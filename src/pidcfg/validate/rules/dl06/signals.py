"""Process variable, set point and output of the DL06: filter, square root, limits and formats."""

from __future__ import annotations

from decimal import Decimal
from itertools import combinations

from pidcfg.encoders.codecs import round_to_integer
from pidcfg.encoders.maps.dl06 import D16
from pidcfg.schemas.numbers import EXACT_CONTEXT, decimal_text
from pidcfg.text.references import DL06, Decision
from pidcfg.validate import shared_checks
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning
from pidcfg.validate.rules.dl06.alarms import Dl06Context, LoopView
from pidcfg.validate.rules.dl06.setup import source_of
from pidcfg.validate.shared_checks import D955, PV_POINTS, crossed_set_points, report_at_both, value_or_switch_key

# --- The PV's low-pass filter -----------------------------------------------------------------------------------------

FILTER = DL06.cite("The DL06 Built-in Analog Filter")
OPTIONS = DL06.cite("PV Auto Transfer Functions with Filtering Options")
ROUNDING = DL06.cite("Creating an Analog Filter in Ladder Logic")

D19 = Decision(
    19,
    "a filtered PV may stall short of its end",
    "The filter works on whole counts: it stands still once k times the remaining distance rounds to 0, which is "
    "0.5/k counts away at most.",
    "The manual warns of an error of 1 part in 1000 because of rounding; at k = 0.1 this gives 5 counts of 4095.",
)
MIN_TENTHS, MAX_TENTHS = 1, 10
"""Tenths, as the word holds them."""
OFFSET_SPAN_DIVISOR = 1000


@per_loop
@warning(
    "DL239", FILTER, "the PV filter is on with {value}, which disables it; the filter constant's range is 0.1 to 1.0"
)
def filter_without_effect(view: LoopView) -> Findings:
    """The PV filter is on with a constant outside 0.1 to 1.0.

    Why: 0 and everything from 1.1 to 999.9 essentially disable the filter, while the programming software would quietly
    change them to 0.1 or 1.0: downloaded as words, they leave the PV as noisy as it is.

    Fix: choose 0.1 (strong, slow) to 1.0 (no filtering), or switch the filter off.
    """
    pv = view.loop.pv
    if view.pv_filter_on and "filter" not in view.misfits and not MIN_TENTHS <= view.digits("filter") <= MAX_TENTHS:
        key = value_or_switch_key(pv, "filter")
        yield view.report("pv", key, value="no constant" if pv.filter is None else f"k = {decimal_text(pv.filter)}")


@per_loop
@info("DL240", D19, "filter k = {k}: the filtered PV may stay up to {offset} short of the true one")
def filter_leaves_an_offset(view: LoopView) -> Findings:
    """A strong filter rounds so that the PV stays a thousandth of the span off.

    Why: the filtered value is kept in whole counts and stands still once k times the difference rounds to 0. Neither
    the alarms nor the integral see what is left.

    Fix: use a larger constant, or the 15-bit format, where the same counts are an eighth of the error.
    """
    tenths = view.digits("filter")
    if not view.pv_filter_on or not MIN_TENTHS <= tenths <= MAX_TENTHS:
        return
    offset = 10 // (2 * tenths)
    if offset * OFFSET_SPAN_DIVISOR >= view.scales["pv"].format.span:
        text = view.text(view.scales["pv"].span_value(offset), "pv", offset)
        yield view.report("pv", "filter", k=f"0.{tenths}", offset=text)


@per_loop
@warning(
    "DL241", ROUNDING, "the {alarm} alarm is at {value}, an end of the scale, but a filtered PV need not get there"
)
def filtered_alarm_at_end_of_scale(view: LoopView) -> Findings:
    """An alarm point at zero or full scale while the PV filter is on.

    Why: filtering may leave an error of 1 part in 1000 because of rounding, so the PV may stop short of the end. The
    manual says: you should not use zero or full scale as alarm points.

    Fix: move the alarm point inside by at least a thousandth of the range.
    """
    if not view.pv_filter_on or not view.pv_alarms_on:
        return
    data_format = view.scales["pv"].format
    for key in PV_POINTS:
        if getattr(view.loop.alarms.pv, key) is not None and view.counts(f"pv_{key}") in {
            data_format.minimum,
            data_format.maximum,
        }:
            yield view.report("alarms", "pv", key, alarm=key, value=view.quote(f"pv_{key}"))


@per_loop
@info(
    "DL273",
    OPTIONS,
    "the PV filter is on, but nothing is transferred to {word}: the manual shows the filter behind an auto "
    "transfer only",
)
def filter_without_auto_transfer(view: LoopView) -> Findings:
    """The PV filter is on for a PV that the ladder program writes.

    Why: bit 2 of +01 is called "analog input filter/auto-transfer", and the manual draws the filter between an auto
    transfer and the PV word. Whether a PV that the ladder program writes is filtered, it does not say.

    Fix: watch the PV after the download; use `pv.transfer` (from a V-memory word as well), or filter in the ladder
    program.
    """
    pv = view.loop.pv
    if view.pv_filter_on and pv.transfer is None:
        yield view.report("pv", value_or_switch_key(pv, "filter"), word=view.address_of("pv"))


# --- PV square-root extract: what it does to the scales of set point and alarms ---------------------------------------

ROOT = DL06.cite("Process Variable (PV) Configuration, IMPORTANT")

D17 = Decision(
    17,
    "the root of a negative PV is 0",
    "With square-root extract a negative PV counts as 0.",
    "A differential-pressure signal is not negative, and the manual says nothing about one.",
)


@per_loop
@checklist(
    "DL235",
    D16,
    "square-root extract: {word} holds the set point divided by the root of the span, 0 to {top} counts, "
    "{step} % of full scale a count; the error is SP - sqrt(PV), alarms stay on the raw PV",
)
def square_root_rescales_setpoint(view: LoopView) -> Findings:
    """PV square-root extract changes the scale of the set point.

    Why: the loop compares the set point with the root of the PV word, so the set point is divided by the root of the
    span. Of a 12-bit span 64 steps are left, 1.6 % of full flow each. `pidcfg` converts what is written in the file; a
    set point that a panel or the ladder writes must be converted there. An error of full flow keeps its full effect;
    the absolute alarms compare the raw PV.

    Fix: see that all who write the set point know its scale. The 15-bit format gives finer steps.
    """
    if view.loop.pv.square_root:
        top = round_to_integer(view.scales["sp"].full_counts)
        yield view.report("pv", "square_root", word=view.address_of("setpoint"), top=top, step=f"{100 / top:.2g}")


@per_loop
@info(
    "DL236",
    D16,
    "the {alarm} alarm at {value} compares the raw PV: it comes at a flow of {flow} % of full scale, not "
    "{percent} %{others}",
)
def square_root_alarm_scale(view: LoopView) -> Findings:
    """Alarms of a square-root loop are on the scale of the differential pressure, not of the flow.

    Why: the alarm words are compared with the raw PV. A limit at half of the range is half of the differential
    pressure, which is 71 % of the flow.

    Fix: square the flow: to alarm at 80 % of the flow, write 64 % of the range.
    """
    if not view.loop.pv.square_root or not view.pv_alarms_on or view.is_bipolar:
        return
    full = view.scales["pv"].format.maximum
    all_counts = {key: view.counts(f"pv_{key}") for key in PV_POINTS}
    shares = {key: counts / full for key, counts in all_counts.items() if counts is not None and 0 < counts < full}
    texts = {key: (f"{100 * share**0.5:.0f}", f"{100 * share:.0f}") for key, share in shares.items()}
    for key in list(texts)[:1]:
        others = [f"{other} at {flow} %, not {percent} %" for other, (flow, percent) in texts.items() if other != key]
        yield view.report(
            "alarms",
            "pv",
            key,
            alarm=key,
            value=view.quote(f"pv_{key}"),
            flow=texts[key][0],
            percent=texts[key][1],
            others="".join(f"; {text}" for text in others),
        )


@per_loop
@info(
    "DL237",
    ROOT,
    "square-root extract without set point limits: a set point written to {word} in PV counts, anything above "
    "{top}, would open the loop's output fully",
)
def square_root_without_setpoint_limits(view: LoopView) -> Findings:
    """A loop with square-root extract has no upper set point limit.

    Why: the set point word ends at 64 counts (12 bit). A panel that writes it on the PV's scale, 0 to 4095, asks for a
    flow that cannot exist. The manual advises to set the SP upper limit to the top of the allowed range.

    Fix: give `setpoint.limits`.
    """
    if view.loop.pv.square_root and not view.setpoint_limit_on:
        yield view.report(
            "pv", "square_root", word=view.address_of("setpoint"), top=round_to_integer(view.scales["sp"].full_counts)
        )


@per_loop
@warning(
    "DL238",
    D17,
    "square-root extract on the {format} format: negative counts have no root and are taken as 0, and the largest root "
    "is {most} of the set point's {top} counts",
)
def square_root_of_signed_signal(view: LoopView) -> Findings:
    """Square-root extract is on for a bipolar PV.

    Why: the lower half of the format, and of the range, has no root. A flow that reverses reads as no flow. The manual
    divides the set point by the root of the span, which is twice the largest PV: above 70.7 % of full scale no PV
    reaches the set point.

    Fix: use a unipolar format for a differential-pressure signal.
    """
    if view.loop.pv.square_root and view.is_bipolar:
        most, top = round_to_integer(largest_root(view)), round_to_integer(view.scales["sp"].full_counts)
        yield view.report("pv", "square_root", format=view.loop.pv.format, most=most, top=top)


@per_loop
@error("DL510", D16, "the set point {value} is above the root of the largest PV ({most} counts): no PV reaches it")
def setpoint_above_every_root(view: LoopView) -> Findings:
    """A set point or ramp target of a bipolar loop with square-root extract is larger than the root of any PV.

    Why: the set point's scale ends at the root of the span, the roots of a bipolar PV at 70.7 % of that. The error
    never becomes zero, and the output runs to its limit.

    Fix: use a unipolar format for a differential-pressure signal.
    """
    if not (view.loop.pv.square_root and view.is_bipolar):
        return
    root = largest_root(view)
    counts = view.counts("setpoint") if view.loop.setpoint.value is not None else None
    if counts is not None and counts > root:
        yield view.report("setpoint", "value", value=view.quote("setpoint"), most=f"{root:.4g}")
    for pair in view.pairs:
        if pair.target is not None and pair.target > root:
            value = view.text(pair.step.ramp_to, "sp", pair.target)
            yield view.report("ramp_soak", "steps", pair.index, "ramp_to", value=value, most=f"{root:.4g}")


def largest_root(view: LoopView) -> Decimal:
    """The root of the largest PV, in counts."""
    return EXACT_CONTEXT.sqrt(Decimal(view.scales["pv"].format.maximum))


# --- The set point: its limits and what becomes of it, and the deadband of the error ----------------------------------

LIMITS = DL06.cite("Setpoint (SP) Limits")
BUMPLESS = DL06.cite("Bumpless Transfers")
TROUBLE_TIPS = DL06.cite("Troubleshooting Tips")
DEADBAND = DL06.cite("Error Term Configuration")

D18 = Decision(
    18,
    "a deadband should end inside the alarms",
    "A deadband as wide as the yellow deviation limit, or from the set point to the high or low alarm, is a warning.",
    "Inside the deadband the error counts as zero: the loop would let the PV drift into an alarm that it could "
    "prevent.",
)


@per_loop
@error("DL228", LIMITS, "the upper set point limit {high} is not above the lower limit {low}")
def setpoint_limits_not_ascending(view: LoopView) -> Findings:
    """The set point limits are on, and the upper one is equal to or below the lower one.

    Why: the calculation applies the limits before each sample; limits that are equal pin the set point, crossed ones
    leave no set point at all.

    Fix: write the lower limit first, and leave at least one count between them.
    """
    limits = view.register_values("setpoint_low", "setpoint_high")
    if view.setpoint_limit_on and limits and limits[0] >= limits[1]:
        yield view.report("setpoint", "limits", 1, high=view.quote("setpoint_high"), low=view.quote("setpoint_low"))


@per_loop
@warning(
    "DL229",
    LIMITS,
    "the set point {value} is outside the limits {low} to {high}: the loop controls to the nearer limit",
)
def setpoint_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside the loop's own set point limits.

    Why: any value may be written to +02, and the word keeps it; the limit is applied inside the calculation only. The
    display then shows a set point that the loop never controls to.

    Fix: correct the set point, or widen the limits.
    """
    words = view.register_values("setpoint_low", "setpoint", "setpoint_high")
    if view.loop.setpoint.value is None or not view.setpoint_limit_on or not words or words[0] >= words[2]:
        return
    if not words[0] <= words[1] <= words[2]:
        yield view.report(
            "setpoint",
            "value",
            value=view.quote("setpoint"),
            low=view.quote("setpoint_low"),
            high=view.quote("setpoint_high"),
        )


@per_loop
@info("DL230", LIMITS, "set point limits {low} and {high} are stored, but bit 3 of {word} is off: they limit nothing")
def setpoint_limits_switched_off(view: LoopView) -> Findings:
    """Set point limits are given, but not enabled.

    Why: the words +26 and +27 hold them, so they show up in every listing; without the enable bit they guard nothing.

    Fix: remove `limits_enabled: false`, or the limits.
    """
    if view.loop.setpoint.limits is not None and not view.setpoint_limit_on:
        yield view.report(
            "setpoint",
            "limits_enabled",
            word=view.address_of("mode_setting_2"),
            low=view.quote("setpoint_low"),
            high=view.quote("setpoint_high"),
        )


@per_loop
@info(
    "DL231",
    TROUBLE_TIPS,
    "the set point {value} is replaced by the PV when the loop goes from Manual to Auto (Bumpless I)",
)
def setpoint_replaced_on_transfer(view: LoopView) -> Findings:
    """The set point of the file does not survive the change to Auto.

    Why: Bumpless Transfer I makes the set point equal to the PV at that moment. "The loop setpoint appears to be
    changing by itself" is a question of the manual's troubleshooting section.

    Fix: let the operator or the ladder program write the set point after the change to Auto, or take Bumpless II.
    """
    if view.loop.mode == "auto" and view.loop.bumpless == "I" and view.loop.setpoint.value is not None:
        yield view.report("setpoint", "value", value=view.quote("setpoint"))


@per_loop
@warning("DL232", BUMPLESS, "no set point is given: with Bumpless II the loop goes to Auto with {word} at {zero}")
def setpoint_left_at_zero(view: LoopView) -> Findings:
    """A loop with Bumpless Transfer II is meant for Auto, and nothing gives its set point.

    Why: the word is downloaded as 0. Type II does not copy the PV to it (type I would), so the loop drives the process
    towards 0 counts unless something writes the set point first.

    Fix: give `setpoint.value`, or take `bumpless: I`.
    """
    loop = view.loop
    if loop.mode == "auto" and loop.bumpless == "II" and loop.setpoint.value is None:
        yield view.report("setpoint", word=view.address_of("setpoint"), zero=view.eu(0, "sp"))


@per_loop
@warning("DL233", DEADBAND, "the error deadband is on with {value}: it ignores nothing")
def deadband_of_zero(view: LoopView) -> Findings:
    """The error deadband is on, but its word holds 0 counts.

    Why: a deadband narrower than half a count of the data format is stored as 0, and a bit without a value means 0 too.

    Fix: give a deadband of at least one count, or switch it off.
    """
    return shared_checks.zero_deadband_findings(view)


@per_loop
@error(
    "DL504", DEADBAND, "the error deadband is {value}, as wide as the PV's whole range ({span}): no error is outside it"
)
def deadband_covers_the_range(view: LoopView) -> Findings:
    """The error deadband is as wide as the span of the PV, or of its root.

    Why: an error inside the deadband counts as zero, and no error can be larger. In Auto the output stays where it is,
    whatever happens to the PV.

    Fix: make the deadband as wide as the noise of the PV, no more.
    """
    width, scale = view.counts("deadband"), view.scales["sp"]
    if view.deadband_on and width is not None and width >= scale.full_counts:
        span = view.text(
            scale.span_value(round_to_integer(scale.full_counts)), "sp", round_to_integer(scale.full_counts)
        )
        yield view.report("error", "deadband", value=view.quote("deadband"), span=span)


@per_loop
@warning(
    "DL234",
    D18,
    "the error deadband of {value} is not less than the distance {limit} from the set point to the {alarm} alarm",
)
def deadband_reaches_alarm(view: LoopView) -> Findings:
    """The error deadband is as wide as the distance from the set point to an alarm.

    Why: inside the deadband the error counts as zero and the output stays where it is. The PV may drift into the alarm,
    and the loop does nothing about it.

    Fix: make the deadband narrower than the yellow deviation limit and the distance to the low and high alarms.
    """
    width = view.counts("deadband")
    if view.deadband_on and width and not view.loop.pv.square_root:
        setpoint = None if view.loop.setpoint.value is None else view.counts("setpoint")
        alarm = shared_checks.nearby_alarm(view, width, setpoint, ("yellow deviation", "deviation_yellow"))
        if alarm is not None:
            yield view.report(
                "error", "deadband", value=view.quote("deadband"), alarm=alarm[0], limit=view.distance(alarm[1])
            )


# --- The control output: its limits, and formats and ranges that do not mean what they look like ----------------------

OUTPUT_LIMITS = DL06.cite("Control Output Configuration")
OPEN_LOOP_TEST = DL06.cite("Open-Loop Test")

D15 = Decision(
    15,
    "0 % of a bipolar format is its negative end",
    "In a bipolar format the low end of a range stands for −4095 (12 bit) or −32767 counts (15 bit), the high end "
    "for the positive maximum.",
    "A range names the values at both ends of the data format; a signal that is never negative then uses half of it.",
)


@per_loop
@error("DL224", OUTPUT_LIMITS, "the upper output limit {high} is below the lower limit {low}")
def output_limits_crossed(view: LoopView) -> Findings:
    """The upper output limit is below the lower one.

    Why: every output is outside one of the limits; what the CPU writes is not documented, and the actuator sits still.

    Fix: write the lower limit first. The direction of control is the loop's `action`, not the order of the limits.
    """
    if (limits := view.register_values("output_low", "output_high")) and limits[0] > limits[1]:
        yield view.report("output", "limits", 1, high=view.quote("output_high"), low=view.quote("output_low"))


@per_loop
@error("DL225", OPEN_LOOP_TEST, "the output limits {low} and {high} are equal for the PLC: the output cannot move")
def output_limits_equal(view: LoopView) -> Findings:
    """The two output limits are the same number of counts.

    Why: the output is pinned. The manual's open-loop test says: make sure that the limits are not equal to each other.
    Limits that differ by less than one count of the data format are equal for the PLC.

    Fix: set the limits apart; leave them out for the full range.
    """
    limits = view.register_values("output_low", "output_high")
    if limits and limits[0] == limits[1] and not is_pinned_to_zero(limits):
        yield view.report("output", "limits", 1, low=view.quote("output_low"), high=view.quote("output_high"))


def is_pinned_to_zero(limits: list[int]) -> bool:
    """Whether the upper limit leaves nothing but an output of 0."""
    return limits[1] == 0 and limits[0] >= 0


@per_loop
@error("DL226", TROUBLE_TIPS, "the upper output limit is {high}, so {word} stays 0 whatever the error is")
def output_upper_limit_zero(view: LoopView) -> Findings:
    """The upper output limit is 0 counts.

    Why: "the control output stays at zero constantly in Automatic Mode" has this as its first cause in the manual's
    troubleshooting section. A bipolar output whose lower limit is negative may end at 0; any other cannot move.

    Fix: set the upper limit to the highest output that the process may see, or leave the limits out.
    """
    limits = view.register_values("output_low", "output_high")
    if limits and limits[0] <= limits[1] and is_pinned_to_zero(limits):
        yield view.report("output", "limits", 1, high=view.quote("output_high"), word=view.address_of("output"))


@per_loop
@warning("DL227", D15, "{low} is {counts} counts in the {format} format: a signal of 0 counts would read as {middle}")
def bipolar_format_for_positive_range(view: LoopView) -> Findings:
    """A bipolar data format is scaled with a range that has no negative values.

    Why: the low end of the range stands for the negative end of the format. An analog module that delivers 0 to 4095
    counts then reads as the upper half of the range only, and every set point and limit is off by half of it.

    Fix: choose the unipolar format, or write the range for the whole format, as in [-100, 100].
    """
    for key, part in (("pv", view.loop.pv), ("output", view.loop.output)):
        scale = view.scales[key]
        if part.range is not None and part.range[0] >= 0 and scale.format.minimum < 0:
            yield view.report(
                key,
                "range",
                low=decimal_text(part.range[0]),
                counts=scale.format.minimum,
                format=scale.format.name,
                middle=view.eu(0, key),
            )


# --- A heating and a cooling loop of one PV ---------------------------------------------------------------------------


@warning(
    "DL522", D955, "{heating} raises {place} to {high}, {cooling} lowers it to {low}: between them both outputs are on"
)
def set_points_crossed(context: Dl06Context) -> Findings:
    """A heating and a cooling loop on one PV have crossed set points.

    Why: the direct-acting loop raises the PV to its set point, the reverse-acting one lowers it to its own. With the
    first above the second, both run to their limits and work against each other.

    Fix: put the set point of the reverse-acting loop above that of the direct-acting one, with a gap between them.
    """
    pairs = ((one, other) for one, other in combinations(context.loops, 2) if _have_same_source(one, other))
    for heating, cooling in crossed_set_points(
        pairs, lambda view: view.loop.action == "direct", lambda view: view.counts("setpoint")
    ):
        first, second = sorted((heating, cooling), key=lambda view: view.index)
        values = {"high": heating.quote("setpoint"), "low": cooling.quote("setpoint")}
        names = {"heating": heating.name, "cooling": cooling.name, "place": source_of(first.loop.pv.transfer)}
        at_first, at_second = (view.report("setpoint", "value") for view in (first, second))
        yield from report_at_both(first, at_first, second, at_second, **values, **names)


def _have_same_source(*views: LoopView) -> bool:
    """Whether loops read one place on one scale, and each has a set point of its own."""
    scales = {(source_of(view.loop.pv.transfer), view.scales["sp"]) for view in views}
    own = all(view.loop.setpoint.value is not None and view.loop.cascade_from is None for view in views)
    return own and len(scales) == 1 and source_of(views[0].loop.pv.transfer) is not None
