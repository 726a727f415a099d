"""Process variable, set point and output of the CLICK: ranges, filters, limits and pulses."""

from __future__ import annotations

from decimal import Decimal
from math import log

from pidcfg.encoders.maps.click import OUTPUT_BELOW_ZERO, SETPOINT_CROSSED
from pidcfg.schemas.click import ERROR_PREFIX, PID_ERRORS
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import CLICK, Decision
from pidcfg.validate.rule import Findings, error, info, per_loop, warning
from pidcfg.validate.rules.click.setup import NO_LIMIT, LoopView
from pidcfg.validate.shared_checks import NUMBER_FIELDS, number_text, outside_limits_findings, value_or_switch_key

# --- The process variable: its range and its filter -------------------------------------------------------------------

RANGE = CLICK.cite("PV Upper and Lower Limits")
FILTER = CLICK.cite("PV Filter")

D133 = Decision(
    133,
    "a filter slower than a quarter of the reset time is a warning",
    "The time constant of the filter is -Ts/ln(1 - k/100) for a constant of k % and a sample rate Ts.",
    "The help warns of the lag without a number. A lag of a quarter of the reset time costs a loop that is tuned with "
    "that reset time about 14 degrees of phase, a third of what it usually has.",
)
MIN_RESET_RATIO = 4


def time_constant(view: LoopView) -> float | None:
    """The filter's time constant in s; None when it filters nothing."""
    constant, sample = view.register_value("filter"), view.loop.sample_rate
    if not view.pv_filter_on or constant is None or not 0 < constant < NO_LIMIT or sample <= 0:
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

    Why: the range gives the process gain, from which the PLC's autotune computes the proportional gain: without a width
    there is none, and with crossed ends it has the wrong sign. (The virtual PLC measures the gain, D123, and refuses an
    autotune without a width.) Registers that were never written hold 0 to 0. They are single-precision floats, of about
    7 digits, in which ends that are close together become one number.

    Fix: write what the process reaches at 0 % and at 100 % of the output, the lower number first, in a unit in which
    they differ by more than a ten-millionth of their size. Of a PV that falls as the output rises the lower number
    comes first, too: `action: reverse` says that it falls.
    """
    low, high = view.loop.pv.range
    ends = view.register_values("pv_lower", "pv_upper")
    registers = f"{view.register('pv_lower')} and {view.register('pv_upper')}"
    if low > high:
        fault = f"{registers} are crossed"
    elif low == high:
        fault = "it has no width" + (f", as in {registers} of a PLC into which nothing was written" if low == 0 else "")
    elif ends and ends[0] == ends[1]:
        fault = f"it is twice the same number in {registers}, which have single precision"
    else:
        return
    yield view.report("pv", "range", low=decimal_text(low), high=decimal_text(high), fault=fault)


@per_loop
@warning("CK322", FILTER, "the PV filter is on with {value}: all of the raw PV is passed")
def filter_without_effect(view: LoopView) -> Findings:
    """The PV filter is on with a constant of 100, or without one.

    Why: the constant is the percentage of the raw PV that is passed each sample, so a large one filters little and 100
    nothing; without a value the register holds 100. The PV stays as noisy as it is.

    Fix: choose a smaller constant, or leave the filter off.
    """
    pv = view.loop.pv
    if view.pv_filter_on and view.register_value("filter") == NO_LIMIT:
        yield view.report(
            "pv",
            value_or_switch_key(pv, "filter"),
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
    if tau is not None and tau * MIN_RESET_RATIO > reset and view.has_no_error_at("reset_time", "sample_rate"):
        yield view.report(
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
    if pv.filter is not None and pv.filter != NO_LIMIT and not view.pv_filter_on:
        yield view.report("pv", "filter_enabled", constant=Decimal(pv.filter), register=view.register("filter_enable"))


# --- The set point: its limits, the process range, and what the PLC makes of it ---------------------------------------

LIMITS = CLICK.cite("Setpoint Upper and Lower Limits")
TRANSFER = CLICK.cite("Bumpless Transfer (Cn+08)")

D132 = Decision(
    132,
    "crossed set point limits are an error when both are enabled",
    "With one of them switched off they are an info, and a limit alone is compared with nothing.",
    "The limits are enabled individually, and only one that is enabled has to be given a value; so a single limit is a "
    "regular use, whatever the other register holds.",
)
LIMIT_ENDS = ("lower", "upper")
CROSSED_EFFECT = f"{ERROR_PREFIX}{SETPOINT_CROSSED}"


def enabled_limits(view: LoopView) -> dict[str, Decimal]:
    """The limits that are enabled and hold a value."""
    limits = {end: view.register_value(f"setpoint_{end}") for end in LIMIT_ENDS if view.setpoint_limit_on(end)}
    return {end: value for end, value in limits.items() if value is not None}


def has_crossed_limits(view: LoopView) -> bool:
    """Whether both limits are enabled, and the lower one is above the upper one."""
    return SETPOINT_CROSSED in {error.number for error in view.errors}


def limits_without_value(view: LoopView) -> list[str]:
    """The limits that are enabled without a value."""
    return [end for end in LIMIT_ENDS if view.setpoint_limit_on(end) and view.value(f"setpoint_{end}") is None]


def limited_setpoint(view: LoopView, setpoint: Decimal) -> Decimal:
    """A set point as the PLC leaves it in the register."""
    ends = enabled_limits(view)
    if not has_crossed_limits(view):
        setpoint = max(setpoint, ends.get("lower", setpoint))
        setpoint = min(setpoint, ends.get("upper", setpoint))
    return setpoint


def setpoint_in_file(view: LoopView) -> Decimal | None:
    """The set point that the file gives."""
    return None if view.loop.setpoint.value is None else view.register_value("setpoint")


@per_loop
@error(
    "CK311",
    D132,
    "the lower set point limit {low} in {low_register} is above the upper limit {high} in {high_register}{when}",
)
def setpoint_limits_crossed(view: LoopView) -> Findings:
    """The lower set point limit is above the upper one.

    Why: with both enabled the PLC reports error 23 and keeps the loop in Manual. With one of them switched off that
    waits for the day on which somebody switches it on (an info).

    Fix: write the smaller number as `lower_limit`.
    """
    ends = view.register_values("setpoint_lower", "setpoint_upper")
    both = all(view.value(f"setpoint_{end}") is not None for end in LIMIT_ENDS)
    if both and ends and ends[0] > ends[1]:
        is_active = has_crossed_limits(view)
        yield view.report(
            "setpoint",
            "lower_limit",
            plc_effect=CROSSED_EFFECT if is_active else None,
            severity=None if is_active else Severity.INFO,
            low=view.eu(ends[0]),
            low_register=view.register("setpoint_lower"),
            high=view.eu(ends[1]),
            high_register=view.register("setpoint_upper"),
            when="" if is_active else ": error 23 as soon as both are enabled",
        )


@per_loop
@error("CK312", LIMITS, "the {end} set point limit is enabled without a value: {register} holds 0, and {consequence}")
def setpoint_limit_without_value(view: LoopView) -> Findings:
    """A set point limit is enabled, but not given.

    Why: its register holds 0, and the PLC writes the limit over every set point beyond it. The help demands a value
    for a limit that is enabled.

    Fix: give the limit, or leave it switched off.
    """
    for end in limits_without_value(view):
        is_crossed = has_crossed_limits(view)
        consequence = f"set points {'below' if end == 'lower' else 'above'} 0 are replaced by 0"
        if is_crossed:
            consequence = "the limits are crossed"
        yield view.report(
            "setpoint",
            f"{end}_limit_enabled",
            plc_effect=CROSSED_EFFECT if is_crossed else None,
            end=end,
            register=view.register(f"setpoint_{end}"),
            consequence=consequence,
        )


@per_loop
@warning("CK313", LIMITS, "both set point limits are {value}: there is no other set point")
def setpoint_limits_equal(view: LoopView) -> Findings:
    """Both set point limits are enabled, and equal.

    Why: the PLC writes the nearer limit over every set point, so an operator's entry jumps back as if the display were
    broken. Limits that differ by less than a single-precision number can hold are equal for the PLC.

    Fix: set the limits apart.
    """
    ends = enabled_limits(view)
    if len(ends) == len(LIMIT_ENDS) and ends["lower"] == ends["upper"] and not limits_without_value(view):
        yield view.report("setpoint", "upper_limit", value=view.quote("setpoint_upper"))


@per_loop
@warning(
    "CK314", LIMITS, "the set point {value} is {side} its {end} limit: the PLC writes {limit} over it in {register}"
)
def setpoint_outside_limits(view: LoopView) -> Findings:
    """The set point lies outside its own limits.

    Why: an enabled limit does not only act inside the calculation. The PLC changes the set point in its register, and
    the loop controls to another one than the file says.

    Fix: correct the set point, or widen the limits.
    """
    value = setpoint_in_file(view)
    if value is None or has_crossed_limits(view):
        return
    limited_value = limited_setpoint(view, value)
    if limited_value != value:
        end, side = ("lower", "below") if limited_value > value else ("upper", "above")
        yield view.report(
            "setpoint",
            "value",
            value=view.quote("setpoint"),
            end=end,
            limit=view.eu(limited_value),
            side=side,
            register=view.register("setpoint"),
        )


@per_loop
@warning("CK315", RANGE, "the set point {value} is outside the process range {low} to {high}")
def setpoint_outside_range(view: LoopView) -> Findings:
    """The set point is a value that the process does not reach.

    Why: the PV's range is what the process reaches at 0 % and at 100 % of the output. For a set point beyond it the
    output runs to a limit and stays there.

    Fix: correct the set point. If the process does get there, correct `pv.range`, from which the PLC's autotune works
    out the process gain; the virtual one measures it (D123).
    """
    value = setpoint_in_file(view)
    limited_value = None if value is None else limited_setpoint(view, value)
    yield from outside_limits_findings(
        view, "setpoint", "value", value=limited_value, limits=view.process_range, quote=view.eu, units=NUMBER_FIELDS
    )


@per_loop
@warning(
    "CK316",
    LIMITS,
    "the {end} set point limit {value} is outside the process range {low} to {high}: it lets set points pass "
    "that the process does not reach",
)
def setpoint_limit_outside_range(view: LoopView) -> Findings:
    """A set point limit lies outside the process range.

    Why: limits are there to prevent an entry outside the limits of the process. One that lies beyond the range prevents
    nothing that matters; often the range of the measuring device was written as limits.

    Fix: bring the limit inside `pv.range`, or correct the range.
    """
    limits = view.process_range
    for end, value in enabled_limits(view).items():
        if view.value(f"setpoint_{end}") is not None:
            yield from outside_limits_findings(
                view,
                "setpoint",
                f"{end}_limit",
                value=value,
                limits=limits,
                quote=view.eu,
                units=NUMBER_FIELDS,
                end=end,
            )


@per_loop
@info("CK317", LIMITS, "the {end} set point limit {value} is stored, but {register} is off: it limits nothing")
def setpoint_limit_switched_off(view: LoopView) -> Findings:
    """A set point limit is given, but not enabled.

    Why: its register shows up in every listing; without the enable bit it guards nothing.

    Fix: remove the `…_enabled: false`, or the limit.
    """
    for end in LIMIT_ENDS:
        if view.value(f"setpoint_{end}") is not None and not view.setpoint_limit_on(end):
            yield view.report(
                "setpoint",
                f"{end}_limit_enabled",
                end=end,
                value=view.quote(f"setpoint_{end}"),
                register=view.register(f"setpoint_{end}_enable"),
            )


@per_loop
@info(
    "CK318",
    TRANSFER,
    "the set point {value} is replaced by the PV when the loop goes from Manual to Auto (bumpless 1)",
)
def setpoint_replaced_by_pv(view: LoopView) -> Findings:
    """The set point of the file does not survive the change to Auto.

    Why: bumpless mode 1 makes set point and PV equal at that moment, so that the output need not move.

    Fix: let the operator or the ladder program write the set point after the change to Auto, or take `bumpless: 2`.
    """
    if view.loop.mode == "auto" and view.loop.bumpless == 1 and view.loop.setpoint.value is not None:
        yield view.report("setpoint", "value", value=view.quote("setpoint"))


@per_loop
@warning("CK319", TRANSFER, "no set point is given: with bumpless 2 the loop goes to Auto with {register} at {zero}")
def setpoint_left_at_zero(view: LoopView) -> Findings:
    """A loop with bumpless mode 2 is meant for Auto, and nothing gives its set point.

    Why: the register is downloaded as 0, and mode 2 does not make it equal to the PV. The loop drives the process
    towards 0, or towards the nearest limit of the set point.

    Fix: give `setpoint.value`, or take `bumpless: 1`.
    """
    loop = view.loop
    setpoint = view.register_value("setpoint")
    if loop.mode == "auto" and loop.bumpless == 2 and loop.setpoint.value is None and setpoint is not None:
        yield view.report(
            "setpoint", register=view.register("setpoint"), zero=view.eu(limited_setpoint(view, setpoint))
        )


# --- The control output: its limits, and pulses in place of an analog signal ------------------------------------------

OUTPUT = CLICK.cite("Control Output (DFn+08)")
PWM = CLICK.cite("PWM Control")

D140 = Decision(
    140,
    "an output whose upper limit is 1 % or less is a warning",
    "It is taken for a fraction of 1 in place of a percentage, unless the output has a unit of its own.",
    "The range is 0 to 100 % by default; other controllers scale it from 0 to 1.",
)
D141 = Decision(
    141,
    "a pulse period beyond the reset time is a warning",
    "The period of the pulses should not be longer than the reset time; one shorter than the sample rate is an info.",
    "The help gives no relation. Within a period the actuator is fully on and fully off: a process that a loop with "
    "that reset time controls follows both, and swings with the period.",
)
FULL_OUTPUT = Decimal(100)


def output_is_percent(view: LoopView) -> bool:
    """Whether the output is a percentage."""
    return view.loop.output.unit in {None, "%"}


@per_loop
@error("CK361", OUTPUT, "the upper output limit is {high}: in Auto {register} never gets above zero")
def output_upper_limit_zero(view: LoopView) -> Findings:
    """The upper output limit is 0 or less.

    Why: the output never gets above zero, and the loop does not function. On a new loop this is what a register that
    was never written holds.

    Fix: set the upper limit to the highest output that the process may see; 100 when `limits` is left out.
    """
    high = view.register_value("output_upper")
    if high is not None and high <= 0:
        yield view.report("output", "limits", 1, high=view.co_text(high), register=view.register("output"))


@per_loop
@error("CK362", OUTPUT, "the upper output limit {high} is not above the lower limit {low}: the output cannot move")
def output_limits_not_ascending(view: LoopView) -> Findings:
    """The lower output limit is equal to or above the upper one.

    Why: the output stays within its limits in Auto. Equal limits pin it; with crossed ones every output is outside one
    of them, and what the PLC writes is not documented.

    Fix: write the lower limit first. The direction of control is the loop's `action`, not the order of the limits.
    """
    limits = view.register_values("output_lower", "output_upper")
    if limits and limits[0] >= limits[1] > 0:
        yield view.report("output", "limits", 1, high=view.co_text(limits[1]), low=view.co_text(limits[0]))


@per_loop
@error("CK363", PID_ERRORS, "the lower output limit is {low}; the PLC wants at least 0")
def output_lower_limit_negative(view: LoopView) -> Findings:
    """The lower output limit is below 0.

    Why: the PLC reports error 30 and keeps the loop in Manual. An output that goes both ways, such as heating and
    cooling, has to be split outside the loop.

    Fix: begin the limits at 0 or above.
    """
    low = view.register_value("output_lower")
    if low is not None and low < 0:
        yield view.report("output", "limits", 0, plc_effect=f"{ERROR_PREFIX}{OUTPUT_BELOW_ZERO}", low=view.co_text(low))


@per_loop
@info("CK364", PWM, "the upper output limit is {high}: {effect}")
def output_limit_beyond_full(view: LoopView) -> Findings:
    """The upper output limit is more than 100 %.

    Why: the pulses are on for the whole period from 100 % on, so that a loop whose output goes further saturates where
    nobody sees it, and the anti-windup acts too late (a warning). An analog output has more than 100 only when it is
    scaled in another unit (an info).

    Fix: end the limits at 100, or give the unit in `output.unit`.
    """
    high = view.register_value("output_upper")
    if high is None or high <= FULL_OUTPUT:
        return
    if view.loop.output.pwm is not None:
        effect = "the pulses are on all the time from 100 % on"
        yield view.report("output", "limits", 1, severity=Severity.WARNING, high=view.co_text(high), effect=effect)
    elif output_is_percent(view):
        yield view.report(
            "output", "limits", 1, high=view.co_text(high), effect="more than 100 % wants a unit of its own"
        )


@per_loop
@warning("CK365", D140, "the upper output limit is {high}: one hundredth of the usual 100 %, or a fraction of 1")
def output_limit_looks_like_fraction(view: LoopView) -> Findings:
    """The output may not exceed 1 %.

    Why: the output is a percentage. Limits of [0, 1] are meant as the full range on other controllers; here the
    actuator hardly opens.

    Fix: write [0, 100], or give the unit in `output.unit` when the output really is scaled from 0 to 1.
    """
    limits = view.register_values("output_lower", "output_upper")
    if limits and limits[0] < limits[1] and 0 < limits[1] <= 1 and (output_is_percent(view) or view.loop.output.pwm):
        yield view.report("output", "limits", 1, high=view.co_text(limits[1]))


@per_loop
@warning(
    "CK366",
    D141,
    "the pulses have a period of {period} s, longer than the reset_time of {reset} s: the PV follows single pulses",
)
def pwm_period_beyond_reset(view: LoopView) -> Findings:
    """The pulse period is longer than the reset time.

    Why: within one period the actuator is fully on and fully off. A process that is fast enough for this reset time
    swings with the pulses, and the loop answers the swing.

    Fix: shorten the period to a small part of the reset time. A relay that is to be spared wants a slower loop.
    """
    pwm, reset = view.loop.output.pwm, view.loop.tuning.reset_time
    if pwm is not None and reset < pwm.period and view.has_no_error_at("reset_time", "pwm_period"):
        yield view.report("output", "pwm", "period", period=decimal_text(pwm.period), reset=decimal_text(reset))


@per_loop
@info(
    "CK367",
    D141,
    "the pulses have a period of {period} s, and the output changes every {sample} s: {times} equal pulses "
    "between two calculations",
)
def pwm_period_below_sample_rate(view: LoopView) -> Findings:
    """The pulse period is shorter than the sample rate.

    Why: the output is the same until the next calculation, so shorter pulses control no better. A relay switches the
    more often for nothing.

    Fix: for a relay make the period at least as long as the sample rate; for a solid-state output it does no harm.
    """
    pwm, sample = view.loop.output.pwm, view.loop.sample_rate
    if pwm is not None and pwm.period < sample and view.has_no_error_at("sample_rate", "pwm_period"):
        yield view.report(
            "output",
            "pwm",
            "period",
            period=decimal_text(pwm.period),
            sample=decimal_text(sample),
            times=number_text((sample / pwm.period).quantize(Decimal("0.1"))),
        )
