"""The two forms of the equation: which terms are on, and values that do not do what they look like."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID
from pidcfg.schemas.nextopid import D202
from pidcfg.validate.rule import Findings, error, info, per_pid, warning

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

DISABLE_P = NEXTOPID.at("chapter 2: DisableP")
INDEP = NEXTOPID.at("chapter 2: Indep")
BIAS = NEXTOPID.at("chapter 2: BIAS")
DERIVATIVE = NEXTOPID.at("chapter 2: DerivEr")
DEAD_BAND = NEXTOPID.at("chapter 2: DeadBand")


@per_pid
@warning("NX635", DISABLE_P, "neither a proportional nor an integral term is on: {left}")
def no_control_term(view: BlockView) -> Findings:
    """Nothing holds the set point.

    Why: with DisableP and no integral, or with Kp and Ki 0 in the independent form, MV stays at BIAS whatever the error
    is; a derivative moves it only while PV moves.

    Fix: give Ti_Ki, or switch the proportional term on.
    """
    gain = view.number_of("Kp")
    dependent_zero = gain == 0 and view.is_on("Indep") is False  # NX612
    if view.proportional == 0 and view.integral == 0 and not dependent_zero:
        left = "the derivative alone holds no set point" if view.derivative else "MV never moves"
        key = "DisableP" if view.is_on("Indep") is False else "Kp"
        yield view.at(key, left=left)


@per_pid
@info("NX636", DISABLE_P, "DisableP is ignored with Indep TRUE: Kp {gain} acts")
def disable_p_ignored(view: BlockView) -> Findings:
    """DisableP is TRUE, and the gains are independent.

    Why: it acts in the dependent form only; the proportional term that was to be off is on.

    Fix: write `Kp: 0`, which leaves Ki and Kd alone in the independent form.
    """
    if view.is_on("DisableP") and view.is_on("Indep") and view.number_of("Kp"):
        yield view.at("DisableP", gain=view.shown("Kp"))


@error("NX637", D202, "{key} is {time} s, a time, but with Indep TRUE it is the gain {gain}")
def time_as_gain(context: NextopidContext) -> Findings:
    """A gain of the independent form is written with a unit of time.

    Why: with Indep TRUE, Ti_Ki is the integral gain and Td_Kd the derivative gain. An integral time of 60 s read as a
    gain of 60 integrates thousands of times faster.

    Fix: divide Kp by the integral time for Ki, multiply it by the derivative time for Kd; or write `Indep: false`.
    """
    for view in context.pids:
        for key, gain in (("Ti_Ki", "Ki"), ("Td_Kd", "Kd")):
            if context.has_time_as_gain(view, key):
                yield view.at(key, key=key, time=view.shown(key), gain=gain)


@per_pid
@warning("NX638", INDEP, "Indep is wired: Ti_Ki and Td_Kd are times while it is FALSE and gains while it is TRUE")
def form_from_a_wire(view: BlockView) -> Findings:
    """The form of the equation can change while the loop runs.

    Why: the same numbers then mean something else: an integral time of 60 s becomes an integral gain of 60.

    Fix: write `true` or `false`.
    """
    if view.wire("Indep") is not None:
        yield view.at("Indep")


@per_pid
@info("NX639", BIAS, "no integral and BIAS {bias}: an error stays as long as the process needs another MV")
def proportional_without_bias(view: BlockView) -> Findings:
    """A loop without an integral has no offset.

    Why: BIAS is MV at zero error. A heater that has to give 30 % to hold the temperature does so only with the error
    that makes 30 %. Where errors may be large that is what is wanted.

    Fix: give the MV that holds the set point as BIAS, or an integral time.
    """
    if view.proportional and view.integral == 0 and view.number_of("BIAS") == 0:
        yield view.at("Ti_Ki", bias=view.shown("BIAS"))


@per_pid
@info(
    "NX640",
    DERIVATIVE,
    "DerivEr is TRUE: a step of 1 % of the set point moves MV by {percent} % through the derivative",
)
def derivative_of_the_error(view: BlockView) -> Findings:
    """The derivative acts on the error.

    Why: each new set point throws MV, by the derivative gain times the step over the sample time. Most applications
    take the derivative of PV.

    Fix: remove DerivEr, unless the set point moves slowly, as that of a cascade's slave does.
    """
    gain, pv, mv = view.derivative, view.pv_limits, view.mv_limits
    if view.is_on("DerivEr") and gain and pv and mv and view.sample_time > 0:
        time = max(view.sample_time, view.number_of("Tfd") or Decimal(0))
        percent = gain * (pv[1] - pv[0]) / time / (mv[1] - mv[0])
        yield view.at("DerivEr", percent=f"{float(percent):.3g}")


@per_pid
@error("NX641", DEAD_BAND, "DeadBand {band} is the whole range of PV, {low} to {high}, or more: MV never moves")
def dead_band_as_wide_as_the_range(view: BlockView) -> Findings:
    """The dead band is so wide that the loop never acts.

    Why: PV and set point are limited to MinPV..MaxPV, so the error cannot be larger than that range. While it is inside
    the dead band, MV stays.

    Fix: give an error that may be left alone, in units of PV.
    """
    band, pv = view.number_of("DeadBand"), view.pv_limits
    if band is not None and pv is not None and band >= pv[1] - pv[0]:
        yield view.at("DeadBand", band=view.shown("DeadBand"), low=view.shown("MinPV"), high=view.shown("MaxPV"))
