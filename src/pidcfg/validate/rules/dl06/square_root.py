"""PV square-root extract: what it does to the scales of set point and alarms."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.maps.dl06 import D16
from pidcfg.encoders.words import nearest
from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import EXACT
from pidcfg.validate.ideas.alarms import PV_POINTS
from pidcfg.validate.rule import Findings, checklist, error, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import LoopView

ROOT = DL06.at("Process Variable (PV) Configuration, IMPORTANT")

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
        top = nearest(view.scales["sp"].full)
        yield view.at("pv", "square_root", word=view.v("setpoint"), top=top, step=f"{100 / top:.2g}")


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
    if not view.loop.pv.square_root or not view.pv_alarms or view.bipolar:
        return
    full = view.scales["pv"].format.maximum
    held = {key: view.counts(f"pv_{key}") for key in PV_POINTS}
    shares = {key: counts / full for key, counts in held.items() if counts is not None and 0 < counts < full}
    texts = {key: (f"{100 * share**0.5:.0f}", f"{100 * share:.0f}") for key, share in shares.items()}
    for key in list(texts)[:1]:
        more = [f"{other} at {flow} %, not {percent} %" for other, (flow, percent) in texts.items() if other != key]
        yield view.at(
            "alarms",
            "pv",
            key,
            alarm=key,
            value=view.shown(f"pv_{key}"),
            flow=texts[key][0],
            percent=texts[key][1],
            others="".join(f"; {text}" for text in more),
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
    if view.loop.pv.square_root and not view.setpoint_limited:
        yield view.at("pv", "square_root", word=view.v("setpoint"), top=nearest(view.scales["sp"].full))


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
    if view.loop.pv.square_root and view.bipolar:
        most, top = nearest(largest_root(view)), nearest(view.scales["sp"].full)
        yield view.at("pv", "square_root", format=view.loop.pv.format, most=most, top=top)


@per_loop
@error("DL510", D16, "the set point {value} is above the root of the largest PV ({most} counts): no PV reaches it")
def setpoint_above_every_root(view: LoopView) -> Findings:
    """A set point or ramp target of a bipolar loop with square-root extract is larger than the root of any PV.

    Why: the set point's scale ends at the root of the span, the roots of a bipolar PV at 70.7 % of that. The error
    never becomes zero, and the output runs to its limit.

    Fix: use a unipolar format for a differential-pressure signal.
    """
    if not (view.loop.pv.square_root and view.bipolar):
        return
    root = largest_root(view)
    counts = view.counts("setpoint") if view.loop.setpoint.value is not None else None
    if counts is not None and counts > root:
        yield view.at("setpoint", "value", value=view.shown("setpoint"), most=nearest(root))
    for pair in view.pairs:
        if pair.target is not None and pair.target > root:
            value = view.text(pair.step.ramp_to, "sp", pair.target)
            yield view.at("ramp_soak", "steps", pair.index, "ramp_to", value=value, most=nearest(root))


def largest_root(view: LoopView) -> Decimal:
    """The root of the largest PV, in counts."""
    return EXACT.sqrt(Decimal(view.scales["pv"].format.maximum))
