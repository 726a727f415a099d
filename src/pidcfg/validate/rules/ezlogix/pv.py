"""The process variable: its counts and its square root."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.ezlogix import D154
from pidcfg.refs import EZLOGIX, Decision
from pidcfg.schemas.ezlogix import CV_FULL, D150
from pidcfg.validate.rule import Findings, checklist, error, per_loop, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.ezlogix.context import LoopView

ROOT = EZLOGIX.at("Use PV Square Root")
MUCH = 2
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
        top = view.scales["sp"].top
        yield view.at("pv", "square_root", register=view.register("setpoint"), top=top, step=f"{100 / top:.2g}")


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
        yield view.at(*place, low=form.minimum, root=f"{form.minimum**0.5:.0f}", top=f"{form.maximum**0.5:.0f}")


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
        yield view.at("pv", "range", low=f"{number_text(pv.range[0])} {pv.unit or ''}".strip())


@per_loop
@checklist("EZ448", D150, "the PV spans {span} counts, the CV 4095: a gain of 1 acts as {times} would on percentages")
def counts_beyond_cv(view: LoopView) -> Findings:
    """The PV has more than twice as many counts as the CV.

    Why: the gain is in counts of the CV per count of the PV. With a PV of 16 bits the same gain is 16 times as strong
    as with one of 12 bits, and gains below 0.10 have few digits.

    Fix: see that the gain was chosen for these counts. Otherwise scale the PV to 0 to 4095 in the ladder program.
    """
    span = view.scales["pv"].format.span
    if span > MUCH * CV_FULL:
        yield view.at("pv", "counts", span=span, times=f"{span / CV_FULL:.3g}")
