"""The PV's low-pass filter."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.ideas.alarms import PV_POINTS
from pidcfg.validate.rule import Findings, info, per_loop, warning
from pidcfg.validate.views import value_or_switch

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

FILTER = DL06.at("The DL06 Built-in Analog Filter")
OPTIONS = DL06.at("PV Auto Transfer Functions with Filtering Options")
ROUNDING = DL06.at("Creating an Analog Filter in Ladder Logic")

D19 = Decision(
    19,
    "a filtered PV may stall short of its end",
    "The filter works on whole counts: it stands still once k times the remaining distance rounds to 0, which is "
    "0.5/k counts away at most.",
    "The manual warns of an error of 1 part in 1000 because of rounding; at k = 0.1 this gives 5 counts of 4095.",
)
STRONGEST, WEAKEST = 1, 10
"""Tenths, as the word holds them."""
THOUSANDTH = 1000


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
    if view.filtered and "filter" not in view.misfits and not STRONGEST <= view.digits("filter") <= WEAKEST:
        key = value_or_switch(pv, "filter")
        yield view.at("pv", key, value="no constant" if pv.filter is None else f"k = {decimal_text(pv.filter)}")


@per_loop
@info("DL240", D19, "filter k = {k}: the filtered PV may stay up to {offset} short of the true one")
def filter_leaves_an_offset(view: LoopView) -> Findings:
    """A strong filter rounds so that the PV stays a thousandth of the span off.

    Why: the filtered value is kept in whole counts and stands still once k times the difference rounds to 0. Neither
    the alarms nor the integral see what is left.

    Fix: use a larger constant, or the 15-bit format, where the same counts are an eighth of the error.
    """
    tenths = view.digits("filter")
    if not view.filtered or not STRONGEST <= tenths <= WEAKEST:
        return
    offset = 10 // (2 * tenths)
    if offset * THOUSANDTH >= view.scales["pv"].format.span:
        text = view.text(view.scales["pv"].span_value(offset), "pv", offset)
        yield view.at("pv", "filter", k=f"0.{tenths}", offset=text)


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
    if not view.filtered or not view.pv_alarms:
        return
    ends = view.scales["pv"].format
    for key in PV_POINTS:
        if getattr(view.loop.alarms.pv, key) is not None and view.counts(f"pv_{key}") in {
            ends.minimum,
            ends.maximum,
        }:
            yield view.at("alarms", "pv", key, alarm=key, value=view.shown(f"pv_{key}"))


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
    if view.filtered and pv.transfer is None:
        yield view.at("pv", value_or_switch(pv, "filter"), word=view.v("pv"))
