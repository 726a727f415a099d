"""Auto-tuning: a start that nobody asked for, modes and limits that stop it, and the manual's two contradictions."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.words import nearest
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

PROCEDURE = DL06.at("Auto Tuning Procedure")
FILTER = DL06.at("The DL06 Built-in Analog Filter")

D28 = Decision(
    28,
    "auto-tune starts with the PV 205 counts from the set point",
    "The PV must be at least 205 of 4095 counts below the set point for direct action, above it for reverse action.",
    "A note of the procedure says so; the paragraph on the error bit demands PV and SP within 5 % of full scale, "
    "which is the opposite. The procedure is followed.",
)
D29 = Decision(
    29,
    "a closed-loop auto-tune switches between the output limits",
    "Output limits at the ends of the data range set the error bit, and the gains are written all the same; narrower "
    "limits make the relay smaller and set no bit.",
    "The timing diagram switches between the upper and lower limit settings, while the error bit is said to come on "
    "when the output goes to the limits of the range.",
)
APART = Decimal(205) / 4095


@per_loop
@warning("DL296", PROCEDURE, "autotune.start is true: bit 7 of {word} is already 1 when the program is downloaded")
def autotune_start_preset(view: LoopView) -> Findings:
    """The start bit of auto-tuning is set in the download.

    Why: auto-tuning induces large changes of the output, and the manual warns of injury and damage. With the bit in the
    image it begins as soon as the PLC runs, with nobody watching, and overwrites gain, reset, rate and sample rate.

    Fix: remove `start`; start auto-tuning from the programming software or the ladder program.
    """
    if view.loop.autotune.start:
        yield view.at("autotune", "start", word=view.v("mode_setting_2"))


@per_loop
@warning("DL297", PROCEDURE, "{method}-loop auto-tuning is to start in mode {mode}; it needs the loop in {wanted}")
def autotune_in_wrong_mode(view: LoopView) -> Findings:
    """Auto-tuning is to start in a mode that its method does not work in.

    Why: the open-loop method steps the output and wants the loop in Manual; the closed-loop method is for a loop that
    is in Auto and cannot be shut down.

    Fix: choose the method that fits the mode.
    """
    tune, mode = view.loop.autotune, view.loop.mode
    wanted = "manual" if tune.method == "open" else "auto"
    if tune.start and mode != wanted:
        yield view.at("autotune", "method", method=tune.method, mode=mode, wanted=wanted)


@per_loop
@checklist("DL298", D29, "a closed-loop auto-tune switches the output between {low} and {high} only")
def autotune_between_narrow_limits(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned for a loop with narrowed output limits.

    Why: the relay switches between the output limits. Narrow ones make the PV's swing smaller, so that noise counts for
    more; the full range, on the other hand, is what the manual calls an error (DL501).

    Fix: see that the PV moves clearly; otherwise widen the limits while tuning, or use the open-loop method.
    """
    if closed_loop_planned(view) and view.holds("output_low", "output_high") and not relay_reaches_an_end(view):
        yield view.at_key("autotune", low=view.shown("output_low"), high=view.shown("output_high"))


@per_loop
@warning(
    "DL501",
    D29,
    "a closed-loop auto-tune switches the output between {low} and {high}, and an end of the range is an error by the "
    "manual: bit 13 of {word} comes on",
)
def autotune_relay_at_the_end_of_the_range(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned for a loop whose output limits reach an end of the data range.

    Why: "the bit will also turn on if the closed-loop method is in use, and the output goes to the limits of the
    range", yet the output limits are what the relay switches between. The simulated PLC sets the bit and writes the
    gains all the same; whether a real one does is open, so that gains with bit 13 on are not to be trusted.

    Fix: narrow `output.limits` at both ends while tuning, and read bit 13 of +06 before the gains are used.
    """
    if closed_loop_planned(view) and relay_reaches_an_end(view):
        low, high = view.shown("output_low"), view.shown("output_high")
        yield view.at_key("autotune", low=low, high=high, word=view.v("mode_and_alarm_status"))


@per_loop
@info("DL508", FILTER, "a closed-loop auto-tune is planned without a PV filter, which the manual strongly recommends")
def autotune_without_filter(view: LoopView) -> Findings:
    """A closed-loop auto-tune is planned, and the PV filter is off.

    Why: the relay switches at each crossing of PV and set point; noise switches it too early. "We strongly recommend
    the use of a filter during auto tuning. You may disable the filter after auto tuning is complete."

    Fix: give `pv.filter` while tuning, or filter in the ladder program.
    """
    if closed_loop_planned(view) and not view.filtered:
        yield view.at_key("autotune")


@per_loop
@checklist("DL509", PROCEDURE, "an auto-tune of type PI writes 0 to {word}: the rate of {rate} s is lost")
def autotune_of_pi_clears_the_rate(view: LoopView) -> Findings:
    """An auto-tune of type PI is planned for a loop with a rate time.

    Why: "if you select PI tuning, the auto tune procedure leaves the derivative gain at 0".

    Fix: tune with `type: PID`, or write the rate again afterwards.
    """
    tune, rate = view.loop.autotune, view.loop.tuning.rate
    if "autotune" in view.loop.model_fields_set and tune.type == "PI" and rate:
        yield view.at_key("autotune", word=view.v("rate"), rate=decimal_text(rate))


def closed_loop_planned(view: LoopView) -> bool:
    """Whether the file speaks of a closed-loop auto-tune."""
    return "autotune" in view.loop.model_fields_set and view.loop.autotune.method == "closed"


def relay_reaches_an_end(view: LoopView) -> bool:
    """Whether an output limit is an end of the data range."""
    limits, ends = view.holds("output_low", "output_high"), view.scales["output"].format
    return bool(limits) and (limits[0] <= ends.minimum or limits[1] >= ends.maximum)


@per_loop
@info("DL299", D28, "{condition}")
def autotune_start_condition(view: LoopView) -> Findings:
    """Auto-tuning is planned, and the manual contradicts itself about when it starts.

    Why: the open-loop procedure wants the PV more than 205 counts from the set point, below it for direct and above it
    for reverse action; the text on the error bit wants both within 5 % of full scale, nearly the same number the other
    way round, and that is all it says about the closed loop.

    Fix: for the open loop move the set point that far from the PV before the start, for the closed loop leave it near;
    if bit 13 of +06 comes on, try the other reading.
    """
    if "autotune" in view.loop.model_fields_set:
        counts = nearest(APART * view.scales["pv"].format.span)
        apart = view.text(view.scales["pv"].span_value(counts), "pv", counts)
        side = "below" if view.loop.action == "direct" else "above"
        condition = f"open-loop auto-tuning starts only with the PV at least {apart} {side} the set point"
        if view.loop.autotune.method == "closed":
            condition = f"closed-loop auto-tuning starts only with PV and set point within 5 % of full scale ({apart})"
        yield view.at_key("autotune", condition=condition)
