"""The control output: its limits, and formats and ranges that do not mean what they look like."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, error, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

LIMITS = DL06.at("Control Output Configuration")
CHECKS = DL06.at("Open-Loop Test")
TROUBLE = DL06.at("Troubleshooting Tips")

D15 = Decision(
    15,
    "0 % of a bipolar format is its negative end",
    "In a bipolar format the low end of a range stands for −4095 (12 bit) or −32767 counts (15 bit), the high end "
    "for the positive maximum.",
    "A range names the values at both ends of the data format; a signal that is never negative then uses half of it.",
)


@per_loop
@error("DL224", LIMITS, "the upper output limit {high} is below the lower limit {low}")
def output_limits_crossed(view: LoopView) -> Findings:
    """The upper output limit is below the lower one.

    Why: every output is outside one of the limits; what the CPU writes is not documented, and the actuator sits still.

    Fix: write the lower limit first. The direction of control is the loop's `action`, not the order of the limits.
    """
    if (limits := view.holds("output_low", "output_high")) and limits[0] > limits[1]:
        yield view.at("output", "limits", 1, high=view.shown("output_high"), low=view.shown("output_low"))


@per_loop
@error("DL225", CHECKS, "the output limits {low} and {high} are equal for the PLC: the output cannot move")
def output_limits_equal(view: LoopView) -> Findings:
    """The two output limits are the same number of counts.

    Why: the output is pinned. The manual's open-loop test says: make sure that the limits are not equal to each other.
    Limits that differ by less than one count of the data format are equal for the PLC.

    Fix: set the limits apart; leave them out for the full range.
    """
    limits = view.holds("output_low", "output_high")
    if limits and limits[0] == limits[1] and not pinned_to_zero(limits):
        yield view.at("output", "limits", 1, low=view.shown("output_low"), high=view.shown("output_high"))


def pinned_to_zero(limits: list[int]) -> bool:
    """Whether the upper limit leaves nothing but an output of 0."""
    return limits[1] == 0 and limits[0] >= 0


@per_loop
@error("DL226", TROUBLE, "the upper output limit is {high}, so {word} stays 0 whatever the error is")
def output_upper_limit_zero(view: LoopView) -> Findings:
    """The upper output limit is 0 counts.

    Why: "the control output stays at zero constantly in Automatic Mode" has this as its first cause in the manual's
    troubleshooting section. A bipolar output whose lower limit is negative may end at 0; any other cannot move.

    Fix: set the upper limit to the highest output that the process may see, or leave the limits out.
    """
    limits = view.holds("output_low", "output_high")
    if limits and limits[0] <= limits[1] and pinned_to_zero(limits):
        yield view.at("output", "limits", 1, high=view.shown("output_high"), word=view.v("output"))


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
            yield view.at(
                key,
                "range",
                low=decimal_text(part.range[0]),
                counts=scale.format.minimum,
                format=scale.format.name,
                middle=view.eu(0, key),
            )
