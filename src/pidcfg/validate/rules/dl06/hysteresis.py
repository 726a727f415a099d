"""The alarm hysteresis: its range, and what it must stay below."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.words import nearest
from pidcfg.refs import DL06, Decision
from pidcfg.validate.ideas import alarms
from pidcfg.validate.rule import Findings, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

HYSTERESIS = DL06.at("PV Alarm Hysteresis")
FEATURES = DL06.at("Alarm Feature Specifications, Deadband")
RATE = DL06.at("PV Rate-of-Change Alarm")

D22 = Decision(
    22,
    "hysteresis 1 to 200 hex is counts, perhaps of 12 bit",
    "More than 5 % of the span or more than 512 counts is a warning, more than 12.5 % of the span (0x200 of 4095 "
    "counts) an error; without a value it is 1 count.",
    "The manual says 1 to 200 (hex) in the text and 0.1 % to 5 % in the feature table, which is 4 to 205 of 4095 "
    "counts. Whether the 512 counts grow with the format it does not say: 4097 of 15 bit are the same share.",
)
D23 = Decision(
    23,
    "the hysteresis must leave a zone without alarm",
    "A hysteresis as wide as the zone between low and high alarm is a warning.",
    "The high alarm would go off only where the low alarm is already on.",
)

WIDEST = Decimal("0.05")
MOST = 0x200
LARGEST = Decimal(MOST) / 4095


def in_use(view: LoopView) -> int | None:
    """The counts of a hysteresis that some alarm uses."""
    return view.counts("hysteresis") if view.pv_alarms or view.deviation_alarms else None


def span_share(view: LoopView, share: Decimal) -> int:
    """A part of the PV's span in whole counts."""
    return nearest(share * view.scales["pv"].format.span)


@per_loop
@error("DL249", HYSTERESIS, "hysteresis is {value}; its range begins at {least}")
def hysteresis_of_zero(view: LoopView) -> Findings:
    """The hysteresis is 0 counts while alarms are on.

    Why: the amount is programmable from 1. With 0, or a value of less than half a count, noise at a threshold switches
    the alarm on and off and annoys the operators, which is what the hysteresis is for.

    Fix: give at least one count; 0.1 % to 5 % of the range is the feature table's advice.
    """
    if view.loop.alarms.hysteresis is not None and in_use(view) == 0:
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"), least=view.distance(1))


@per_loop
@warning("DL250", D22, "hysteresis is {value}, {passed}")
def hysteresis_wide(view: LoopView) -> Findings:
    """The hysteresis is wider than 5 % of the span, or than the 200 hex of the manual's text if they are counts.

    Why: the feature table ends at 5 %, the text at 200 hex, which are 512 counts. Whether these grow with the data
    format the manual does not say; if not, a loop of 15 or 16 bits has a value that the CPU does not take. An alarm
    with a wide hysteresis stays on long after its cause has gone.

    Fix: choose 0.1 % to 5 % of the range, at most 512 counts.
    """
    counts, widest, largest = in_use(view), span_share(view, WIDEST), span_share(view, LARGEST)
    if counts is None or not min(widest, MOST) < counts <= largest:
        return
    passed = f"more than 5 % of the span ({view.distance(widest)})"
    if counts > MOST:
        readings = (
            f"more than 200 hex if these are counts ({MOST}), within them if they grow with the format ({largest})"
        )
        passed = readings if counts <= widest else f"{passed}, {readings}"
    yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"), passed=passed)


@per_loop
@error("DL251", D22, "hysteresis is {value}, more than 12.5 % of the span ({limit})")
def hysteresis_beyond_range(view: LoopView) -> Findings:
    """The hysteresis is wider than any reading of the manual allows.

    Why: the text ends at 200 hex, which is 512 of 4095 counts, and no more if it grows with the data format. What the
    CPU does beyond is not documented.

    Fix: choose 0.1 % to 5 % of the range.
    """
    counts = in_use(view)
    if counts is not None and counts > span_share(view, LARGEST):
        limit = view.distance(span_share(view, LARGEST))
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"), limit=limit)


@per_loop
@error("DL252", HYSTERESIS, "hysteresis is {value}, not less than the yellow deviation limit {limit} in {word}")
def hysteresis_swallows_deviation_alarm(view: LoopView) -> Findings:
    """The hysteresis is not less than the deviation limits.

    Why: a deviation alarm goes off once the PV is back by the hysteresis. If that is as much as the limit, the PV would
    have to return exactly to the set point or beyond: the alarm, once on, stays on. The manual demands less.

    Fix: make the hysteresis smaller than the yellow limit.
    """
    yellow, counts = view.counts("deviation_yellow"), view.counts("hysteresis")
    if view.deviation_alarms and yellow and counts is not None and counts >= yellow:
        key = "hysteresis" if view.loop.alarms.hysteresis is not None else "deviation"
        yield view.at(
            "alarms",
            key,
            value=view.shown("hysteresis"),
            limit=view.shown("deviation_yellow"),
            word=view.v("deviation_yellow"),
        )


@per_loop
@warning(
    "DL253",
    D23,
    "hysteresis is {value}, but low and high alarm are only {zone} apart: neither goes off before the other comes",
)
def hysteresis_spans_normal_zone(view: LoopView) -> Findings:
    """The hysteresis is as wide as the zone between the low and the high alarm.

    Why: after a high alarm the PV must fall by the hysteresis to clear it, and by then it is at the low alarm. There is
    no PV without an alarm left.

    Fix: make the hysteresis much smaller than the distance from low to high.
    """
    return alarms.hysteresis_spans_normal_zone(view, span_share(view, LARGEST))


@per_loop
@info("DL254", D22, "no hysteresis is given: alarms are released after {least}")
def hysteresis_not_given(view: LoopView) -> Findings:
    """Alarms are on without a hysteresis: 1 count is taken.

    Why: real signals are noisier than one count of 4095. The alarm comes and goes at its threshold.

    Fix: give `alarms.hysteresis`, 0.1 % to 5 % of the range.
    """
    if view.loop.alarms.hysteresis is None and in_use(view) is not None:
        yield view.at("alarms", "hysteresis", least=view.distance(1))


@per_loop
@info(
    "DL255",
    RATE,
    "hysteresis is {value}, but neither PV nor deviation alarms are on, and the rate-of-change alarm has none",
)
def hysteresis_without_effect(view: LoopView) -> Findings:
    """A hysteresis is given for a loop whose only alarm, if any, is the rate of change.

    Why: the hysteresis works with the absolute and the deviation alarms. It does not affect the rate-of-change alarm,
    which may therefore come and go with each sample.

    Fix: remove it, or switch on the alarms it was meant for.
    """
    if view.loop.alarms.hysteresis is not None and not view.pv_alarms and not view.deviation_alarms:
        yield view.at("alarms", "hysteresis", value=view.shown("hysteresis"))
