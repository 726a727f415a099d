"""Loops that read one tag, and loops that read what another one puts out."""

from __future__ import annotations

from fractions import Fraction
from itertools import combinations, permutations
from typing import TYPE_CHECKING

from pidcfg.refs import Decision
from pidcfg.schemas.ezlogix import CV_FULL
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, info, warning
from pidcfg.validate.views import with_unit

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.ezlogix import Pv
    from pidcfg.validate.rules.ezlogix.context import EzlogixContext, LoopView

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
ENDS = (0, CV_FULL)
"""Counts of a PV for which the file gives none (D150)."""


def same_pv(context: EzlogixContext) -> Iterator[tuple[LoopView, LoopView]]:
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
    for first, second in same_pv(context):
        if first.loop.action == second.loop.action:
            at_first, at_second = first.at("pv", "tag", other=second.name), second.at("pv", "tag", other=first.name)
            values = {"tag": second.loop.pv.tag, "action": second.loop.action}
            yield from at_both(first, at_first, second, at_second, **values)


@warning(
    "EZ409", D181, "{heating} raises {tag} to {high} counts, {cooling} lowers it to {low}: between them both are on"
)
def set_points_crossed(context: EzlogixContext) -> Findings:
    """A heating and a cooling loop on one PV have crossed set points.

    Why: the reverse-acting loop raises the PV to its set point, the direct-acting one lowers it to its own. With the
    first above the second, both run to their limits and work against each other.

    Fix: put the set point of the direct-acting loop above that of the reverse-acting one, with a gap between them.
    """
    for first, second in same_pv(context):
        pair = {view.loop.action: view for view in (first, second) if view.loop.setpoint.value is not None}
        if len(pair) < 2:
            continue
        heating, cooling = pair["reverse"], pair["direct"]
        same_scale = heating.loop.pv.square_root == cooling.loop.pv.square_root
        if same_scale and heating.setpoint is not None and cooling.setpoint is not None:
            high, low = heating.setpoint, cooling.setpoint
            if high > low:
                names = {"tag": second.loop.pv.tag, "heating": heating.name, "cooling": cooling.name}
                at_first, at_second = (view.at("setpoint", "value", high=high, low=low) for view in (first, second))
                yield from at_both(first, at_first, second, at_second, **names)


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
    for first, second in same_pv(context):
        one, other = (view.loop.pv for view in (first, second))
        if one.square_root == other.square_root and scales_differ(one, other):
            at_first = first.at("pv", "tag", scale=scale_text(one), other_scale=scale_text(other), other=second.name)
            at_second = second.at("pv", "tag", scale=scale_text(other), other_scale=scale_text(one), other=first.name)
            yield from at_both(first, at_first, second, at_second, tag=one.tag)


def scales_differ(one: Pv, other: Pv) -> bool:
    """Whether equal counts are different values in one unit, or the same value in different units."""
    if (one.range is None) != (other.range is None):
        return False
    alike = [value_at(one, counts) for counts in ENDS] == [value_at(other, counts) for counts in ENDS]
    units = {one.unit, other.unit}
    return alike == (None not in units and len(units) > 1)


def value_at(pv: Pv, counts: int) -> Fraction:
    """What counts are on a PV's scale, exactly; without a range the share of its counts."""
    first, last = pv.counts or ENDS
    low, high = map(Fraction, pv.range or (0, 1))
    return low + (high - low) * (counts - first) / (last - first)


def scale_text(pv: Pv) -> str:
    """A scale as a message quotes it."""
    first, last = pv.counts or ENDS
    values = f"{decimal_text(pv.range[0])} to {with_unit(pv.range[1], pv.unit)} at " if pv.range else ""
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
            yield from at_both(writer, writer.at("output", "tag"), reader, reader.at("pv", "tag"), **names)
