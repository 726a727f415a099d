"""The form of the equation and what depends on it: bumpless transfer, bias freeze, and what the derivative acts on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import DL06, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, checklist, error, finding, info, per_loop, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.dl06.context import Dl06Context, LoopView

FEATURES = DL06.at("PID Loop Feature Specifications")
FREEZE = DL06.at("Bias Freeze")
BUMPLESS = DL06.at("Bumpless Transfers")

D14 = Decision(
    14,
    "the DL06's derivative acts on the error",
    "`derivative: pv` is accepted for other CPUs of the family, with an info.",
    "The DL06 manual prints Kr·(e(n) − e(n−1)), the DL405 manual a derivative of the PV.",
)


@info("DL220", D14, "derivative is pv, but the DL06's manual prints a derivative of the error")
def derivative_of_another_cpu(context: Dl06Context) -> Findings:
    """The file says that the derivative acts on the PV, as on other CPUs of the family.

    Why: no word of the DL06 selects it; the choice only changes the simulation. With the derivative of the error, a
    step of the set point kicks the output, and a simulation with `pv` would hide that.

    Fix: remove `derivative: pv` unless the file is for another CPU of the family.
    """
    if context.config.plc.derivative == "pv":
        yield finding("plc", "derivative")


@per_loop
@error("DL221", BUMPLESS, "bumpless is II, but the velocity form needs Bumpless Transfer I")
def velocity_form_with_bumpless_two(view: LoopView) -> Findings:
    """The velocity form of the equation is combined with Bumpless Transfer II.

    Why: type II sets the bias, and the velocity form has no bias: the change to Auto would not be bumpless at all. The
    manual demands type I.

    Fix: write `bumpless: I`, or take the position form.
    """
    if view.loop.algorithm == "velocity" and view.loop.bumpless == "II":
        yield view.at("bumpless")


@per_loop
@warning(
    "DL222",
    FREEZE,
    "bias_freeze is on, but the output stays between {low} and {high}: it never reaches {ends} counts, where "
    "the bias would freeze",
)
def freeze_never_reached(view: LoopView) -> Findings:
    """Bias freeze is on while the output limits are narrower than the data range.

    Why: the freeze works only when the output reaches an end of the data range (0 and 4095 counts for 12-bit unipolar).
    Behind narrower limits the bias keeps integrating: the loop winds up and overshoots when it comes back, which the
    freeze was meant to prevent.

    Fix: set the output limits to the ends of the data range and limit the actuator elsewhere, or expect windup and
    remove `bias_freeze`.
    """
    if (
        view.loop.bias_freeze
        and view.loop.algorithm == "position"
        and (limits := view.holds("output_low", "output_high"))
    ):
        ends = view.scales["output"].format
        if limits[0] > ends.minimum or limits[1] < ends.maximum:
            yield view.at(
                "bias_freeze",
                low=view.shown("output_low"),
                high=view.shown("output_high"),
                ends=f"{ends.minimum} or {ends.maximum}",
            )


@per_loop
@warning("DL223", FEATURES, "bias_freeze is on, but the velocity form has no bias to freeze")
def freeze_in_velocity_form(view: LoopView) -> Findings:
    """Bias freeze is on in a loop of the velocity form.

    Why: anti-windup is a feature of the position form. The velocity form keeps no integral sum, so the bit does
    nothing.

    Fix: remove `bias_freeze`, or take the position form.
    """
    if view.loop.bias_freeze and view.loop.algorithm == "velocity":
        yield view.at("bias_freeze")


@per_loop
@checklist(
    "DL521",
    FREEZE,
    "with the reset of {reset} s and without bias_freeze the bias goes on to the end of its range while the output "
    "stands at {low} or {high} counts",
)
def windup_not_prevented(view: LoopView) -> Findings:
    """A loop integrates while its output is at an end of the data range.

    Why: as long as there is an error the bias goes on to its own limit, although the output cannot follow. After a
    start-up or a lost signal it takes a long time to come back, and the PV overshoots meanwhile; the manual calls it
    reset windup. Loops whose output limits are narrower than the data range are not reported: there the freeze does
    not work.

    Fix: write `bias_freeze: true`, or see that the overshoot after a start-up does no harm.
    """
    loop, reset, limits = view.loop, view.reset, view.holds("output_low", "output_high")
    if loop.bias_freeze or loop.algorithm != "position" or not limits or reset is None or "reset" in view.misfits:
        return
    ends = view.scales["output"].format
    if reset > 0 and (limits[0], limits[1]) == (ends.minimum, ends.maximum):
        yield view.at("bias_freeze", low=limits[0], high=limits[1], reset=decimal_text(reset))
