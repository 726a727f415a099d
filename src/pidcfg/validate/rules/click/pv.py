"""The process variable: its range and its filter."""

from __future__ import annotations

from decimal import Decimal
from math import log

from pidcfg.refs import CLICK, Decision
from pidcfg.schemas.numbers import decimal_text
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules.click.context import NO_LIMIT, LoopView
from pidcfg.validate.views import value_or_switch

RANGE = CLICK.at("PV Upper and Lower Limits")
FILTER = CLICK.at("PV Filter")

D133 = Decision(
    133,
    "a filter slower than a quarter of the reset time is a warning",
    "The time constant of the filter is -Ts/ln(1 - k/100) for a constant of k % and a sample rate Ts.",
    "The help warns of the lag without a number. A lag of a quarter of the reset time costs a loop that is tuned with "
    "that reset time about 14 degrees of phase, a third of what it usually has.",
)
SHARE = 4


def time_constant(view: LoopView) -> float | None:
    """The filter's time constant in s; None when it filters nothing."""
    constant, sample = view.held("filter"), view.loop.sample_rate
    if not view.filtered or constant is None or not 0 < constant < NO_LIMIT or sample <= 0:
        return None
    return float(-sample) / log(1 - float(constant) / 100)


@per_loop
@error(
    "CK321",
    RANGE,
    "the PV's range is {low} to {high}: {fault}",
)
def pv_range_without_width(view: LoopView) -> Findings:
    """The PV's range does not ascend, or its two ends are the same number for the PLC.

    Why: the range gives the process gain, from which the autotune computes the proportional gain: without a width there
    is none, and with crossed ends it has the wrong sign. Registers that were never written hold 0 to 0. They are
    single-precision floats, of about 7 digits, in which ends that are close together become one number.

    Fix: write what the process reaches at 0 % and at 100 % of the output, the lower number first, in a unit in which
    they differ by more than a ten-millionth of their size.
    """
    low, high = view.loop.pv.range
    ends = view.holds("pv_lower", "pv_upper")
    registers = f"{view.register('pv_lower')} and {view.register('pv_upper')}"
    if low > high:
        fault = f"{registers} are crossed"
    elif low == high:
        fault = "it has no width" + (f", as in {registers} of a PLC into which nothing was written" if low == 0 else "")
    elif ends and ends[0] == ends[1]:
        fault = f"it is twice the same number in {registers}, which have single precision"
    else:
        return
    yield view.at("pv", "range", low=decimal_text(low), high=decimal_text(high), fault=fault)


@per_loop
@warning("CK322", FILTER, "the PV filter is on with {value}: all of the raw PV is passed")
def filter_without_effect(view: LoopView) -> Findings:
    """The PV filter is on with a constant of 100, or without one.

    Why: the constant is the percentage of the raw PV that is passed each sample, so a large one filters little and 100
    nothing; without a value the register holds 100. The PV stays as noisy as it is.

    Fix: choose a smaller constant, or leave the filter off.
    """
    pv = view.loop.pv
    if view.filtered and view.held("filter") == NO_LIMIT:
        yield view.at(
            "pv",
            value_or_switch(pv, "filter"),
            value="no constant, which is 100 %" if pv.filter is None else "100 %",
        )


@per_loop
@warning(
    "CK323",
    D133,
    "filter {constant} % at a sample rate of {sample} s is a lag with a time constant of {tau} s, more than a "
    "quarter of the reset time of {reset} s",
)
def filter_lags(view: LoopView) -> Findings:
    """The PV filter is slow compared with the reset time.

    Why: the loop controls the filtered PV, which runs behind the process. A lag that is not small against the reset
    time makes a loop swing that was tuned without it, and hides peaks from the alarms.

    Fix: pass a larger percentage, sample faster, or tune the loop with the filter on.
    """
    tau, reset = time_constant(view), view.loop.tuning.reset_time
    if tau is not None and tau * SHARE > reset and view.sound("reset_time", "sample_rate"):
        yield view.at(
            "pv",
            "filter",
            constant=view.loop.pv.filter,
            sample=decimal_text(view.loop.sample_rate),
            tau=f"{tau:.3g}",
            reset=decimal_text(reset),
        )


@per_loop
@info("CK324", FILTER, "filter {constant} % is stored, but {register} is off: the PV is the raw PV")
def filter_switched_off(view: LoopView) -> Findings:
    """A filter constant is given, but the filter is off.

    Why: the register shows up in every listing; without the enable bit nothing is filtered.

    Fix: remove `filter_enabled: false`, or the constant.
    """
    pv = view.loop.pv
    if pv.filter is not None and pv.filter != NO_LIMIT and not view.filtered:
        yield view.at("pv", "filter_enabled", constant=Decimal(pv.filter), register=view.register("filter_enable"))
