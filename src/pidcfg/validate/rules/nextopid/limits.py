"""Limits of PV and MV in NextoPID, on-off control, pulse width, split range, and settings that do not go together."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import ROUND_HALF_EVEN, Decimal
from itertools import permutations

from pidcfg.schemas.base import Limits, limits_at
from pidcfg.schemas.expressions import Expression
from pidcfg.schemas.iec import INT
from pidcfg.schemas.nextopid import D201, MIN_INTEGRAL_TIME
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import NEXTOPID, Decision
from pidcfg.validate.rule import Finding, Findings, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.context import ON_OFF, BlockView, NextopidContext, all_known
from pidcfg.validate.rules.nextopid.first_scan import D208, PERMANENT, as_int
from pidcfg.validate.shared_checks import D955, crossed_set_points, number_text, pairs_with_same_key

# --- The limits of PV and MV, the bits that the block sets, and values outside ----------------------------------------

ERRORS = NEXTOPID.cite("chapter 2: ErrBits")
WARNINGS = NEXTOPID.cite("chapter 2: WarnBits")
SCALE = NEXTOPID.cite("chapter 2: MaxMV, MinMV")


@per_pid
@error("NX610", ERRORS, "MaxMV {high} is not above MinMV {low}")
def mv_limits_crossed(view: BlockView) -> Findings:
    """MaxMV is not above MinMV.

    Why: the block stops with an error bit, and MV stays where it is.

    Fix: give MaxMV the larger of the two values.
    """
    return crossed_limits(view, "MinMV", "MaxMV", "ErrBits.MaxMinMV")


@error("NX611", ERRORS, "MaxPV {high} is not above MinPV {low}")
def pv_limits_crossed(context: NextopidContext) -> Findings:
    """MaxPV is not above MinPV.

    Why: the block stops with an error bit, and MV stays where it is.

    Fix: give MaxPV the larger of the two values.
    """
    for view in context.controllers:
        yield from crossed_limits(view, "MinPV", "MaxPV", "ErrBits.MaxMinPV")


@per_pid
@error("NX612", ERRORS, "Kp is {gain}; the {form} form needs {wanted}")
def gain_not_positive(view: BlockView) -> Findings:
    """The proportional gain is 0 or negative.

    Why: the block stops with an error bit. The direction of control is not made with the sign of the gain, and an
    integral without a proportional term is made with DisableP or with the independent form.

    Fix: give a gain above 0, and choose the direction with Direct. A pure integral has `DisableP: true` in the
    dependent form, and `Kp: 0` in the independent one.
    """
    gain, indep = view.number_of("Kp"), view.is_on("Indep")
    if gain is not None and (gain < 0 or (gain == 0 and indep is False)):
        wanted = "a value above 0" if indep is False else "0 or more"
        form = "dependent" if indep is False else "independent"
        yield view.report("Kp", "ErrBits.Kp", gain=view.quote("Kp"), form=form, wanted=wanted)


def crossed_limits(view: BlockView, low: str, high: str, effect: str) -> Findings:
    """A finding at the higher one of two limits that leave no room between them."""
    ends = view.number_of(low), view.number_of(high)
    if all_known(ends) and ends[1] <= ends[0]:
        yield view.report(high, effect, high=view.quote(high), low=view.quote(low))


def exceeded_limit(view: BlockView, key: str, low: str, high: str) -> tuple[str, str] | None:
    """The limit that a parameter lies beyond, and the word for it."""
    value, ends = view.number_of(key), (view.pv_limits if low == "MinPV" else view.mv_limits)
    if value is None or ends is None or ends[0] <= value <= ends[1]:
        return None
    return (low, "below") if value < ends[0] else (high, "above")


def limit_finding(
    view: BlockView,
    key: str,
    end: tuple[str, str],
    plc_effect: str | None,
    severity: Severity | None = None,
    **values: str,
) -> Finding:
    """A finding about a parameter beyond a limit."""
    values |= {"value": view.quote(key), "side": end[1], "limit": end[0], "end": view.quote(end[0])}
    return view.report(key, plc_effect, severity, **values)


@warning("NX615", WARNINGS, "SP {value} is {side} {limit} {end}: the block controls at {end}")
def set_point_outside_pv_limits(context: NextopidContext) -> Findings:
    """The set point is outside MinPV..MaxPV.

    Why: the block limits it without asking, and controls at the limit instead.

    Fix: correct the set point, or widen the limits.
    """
    for view in context.controllers:
        end = exceeded_limit(view, "SP", "MinPV", "MaxPV")
        if end is not None:
            in_use = not view.is_pid or view.is_wired("CASC") or not view.is_on("CASC")
            yield limit_finding(view, "SP", end, f"WarnBits.SP_{end[0]}" if in_use else None)


@per_pid
@warning("NX616", WARNINGS, "SP_CASC {value} is {side} {limit} {end}: cascade mode controls at {end}")
def cascade_set_point_outside_pv_limits(view: BlockView) -> Findings:
    """The set point of the cascade mode is outside MinPV..MaxPV.

    Why: in cascade mode the block limits it without asking, and controls at the limit instead.

    Fix: correct the value, or widen the limits.
    """
    end = exceeded_limit(view, "SP_CASC", "MinPV", "MaxPV")
    if end is not None and view.is_given("SP_CASC"):
        effect = f"WarnBits.SP_CASC_{end[0]}" if view.may_be_on("CASC") else None
        yield limit_finding(view, "SP_CASC", end, effect)


@per_pid
@warning("NX617", WARNINGS, "ManualMV {value} is {side} {limit} {end}: manual mode puts out {end}")
def manual_mv_outside_limits(view: BlockView) -> Findings:
    """The output of manual mode is outside MinMV..MaxMV.

    Why: MV is limited in manual mode as well. Where ManualMV is not given it is 0, which may lie below MinMV.

    Fix: give a ManualMV inside the limits.
    """
    end = exceeded_limit(view, "ManualMV", "MinMV", "MaxMV")
    if end is not None and (view.is_given("ManualMV") or view.may_be_on("Manual")):
        effect = f"WarnBits.MV_{end[0]}" if view.may_be_on("Manual") else None
        yield limit_finding(view, "ManualMV", end, effect)


@per_pid
@warning("NX618", WARNINGS, "BIAS {value} is {side} {limit} {end}: {effect}")
def bias_outside_limits(view: BlockView) -> Findings:
    """The offset alone drives MV to its limit.

    Why: BIAS is added to MV. Without an integral it is the output at zero error; outside the limits MV stays at one of
    them until the error is large enough. With an integral it only shifts where the integral settles.

    Fix: give the output that holds the set point.
    """
    end = exceeded_limit(view, "BIAS", "MinMV", "MaxMV")
    integral = view.integral
    if end is None or not view.is_given("BIAS") or integral is None:
        return
    effect = "only the integral brings MV back" if integral else "without an error MV stays at its limit"
    severity = Severity.INFO if integral else None
    yield limit_finding(view, "BIAS", end, f"WarnBits.MV_{end[0]}", severity, effect=effect)


@per_pid
@warning("NX619", WARNINGS, "TRK_VAL {value} is {side} {limit} {end}: tracking puts out {end}")
def tracking_value_outside_limits(view: BlockView) -> Findings:
    """The output of tracking mode is outside MinMV..MaxMV.

    Why: MV follows TRK_VAL while TRK_IN is TRUE, but not beyond its limits: the return from tracking is then a bump.

    Fix: give a TRK_VAL inside the limits, or widen them.
    """
    end = exceeded_limit(view, "TRK_VAL", "MinMV", "MaxMV")
    if end is not None and view.is_given("TRK_VAL") and view.may_be_on("TRK_IN"):
        yield limit_finding(view, "TRK_VAL", end, f"WarnBits.MV_{end[0]}")


@per_pid
@warning("NX620", D201, "{key} {value} is outside output.range {low} to {high}: {percent} % of the output")
def output_range_narrower_than_limits(view: BlockView) -> Findings:
    """MV can go beyond the scale of the output.

    Why: `output.range` says what 0 % and 100 % are. An MV beyond it is more than the valve can do: the integral goes on
    while the valve stands, and comes back late.

    Fix: keep MinMV and MaxMV inside the range, or correct the range.
    """
    scale = view.item.output.range
    for key in ("MinMV", "MaxMV"):
        value = view.number_of(key)
        if scale is not None and value is not None and not scale[0] <= value <= scale[1]:
            percent = (value - scale[0]) / (scale[1] - scale[0]) * 100
            yield view.report(
                key,
                key=key,
                value=view.quote(key),
                low=number_text(scale[0]),
                high=number_text(scale[1]),
                percent=number_text(percent),
            )


@per_pid
@info("NX621", D201, "without output.range, MinMV {low} counts as 0 % and MaxMV {high} as 100 % of the output")
def output_scale_assumed(view: BlockView) -> Findings:
    """Nothing says what 0 % and 100 % of the output are.

    Why: MinMV and MaxMV are limits. A valve that is limited to 20..80 % has another scale, and tuning rules, reports
    and conversions in % then are wrong by that factor.

    Fix: give `output.range` where the limits are not the ends of the scale.
    """
    if view.item.output.range is None and view.mv_limits not in {None, (Decimal(0), Decimal(100))}:
        yield view.report("MaxMV", low=view.quote("MinMV"), high=view.quote("MaxMV"))


# --- Values that come through a wire: the limits that a number in the file is held against, for them too --------------

INTEGERS = NEXTOPID.cite("chapter 3: PIDA_INT")


@error("NX613", D208, "{key} is {value}; it must be {allowed}")
def wired_value_out_of_range(context: NextopidContext) -> Findings:
    """A parameter is wired to a value that the manual does not allow for it, or a move writes one.

    Why: the block stops with an error bit as soon as it has the value. A number of the parameter itself is found by
    the rule for every vendor (PID101).

    Fix: correct the expression, give the signal another first value, or limit it on its way.
    """
    for view in context.views:
        for row, _ in view.placed.given_inputs():
            limits = limits_at(view.placed.kind.model, row.name)
            value = view.number_of(row.name) if limits and view.is_wired(row.name) else None
            if limits is not None and value is not None and not limits.holds(value):
                yield view.report(
                    row.name, limits.effect, key=row.name, value=view.quote(row.name), allowed=_limits_text(limits)
                )
    kinds = {view.name: view.placed.kind for view in context.views}
    for i, move in enumerate(context.config.moves):
        block, _, key = move.to.partition(".")
        has_key = block in kinds and any(row.name == key for row in kinds[block].inputs)
        limits = limits_at(kinds[block].model, key) if has_key else None
        if limits is not None and isinstance(move.move, Decimal) and not limits.holds(move.move):
            values = {"key": key, "value": number_text(move.move), "allowed": _limits_text(limits)}
            yield Finding(("moves", i, "move"), values, plc_effect=limits.effect)


def _limits_text(limits: Limits) -> str:
    return f"{limits.low} or more" if limits.high is None else f"{limits.low} to {limits.high}"


@error("NX614", INTEGERS, "{key} is an INT and wired to {value}: {problem}")
def wired_value_does_not_fit_int(context: NextopidContext) -> Findings:
    """A REAL signal is wired to an INT parameter that cannot hold its value.

    Why: INT holds whole numbers from -32768 to 32767. The virtual PLC takes the nearest one of them; in a PLC that
    does not, decimals may be cut off, and what is too large comes out as another number, of either sign.

    Fix: give the signal in the units of the INT controller, or use the REAL one.
    """
    for view in context.views:
        for row, _ in view.placed.given_inputs():
            value = view.number_of(row.name) if row.type is INT and view.is_wired(row.name) else None
            stored = None if value is None else as_int(value)
            if value is None or stored is None or value == stored:
                continue
            fits = value.to_integral_value(ROUND_HALF_EVEN) == stored
            problem = f"{'its decimals are lost' if fits else 'it does not fit'}, {number_text(stored)} is taken"
            yield view.report(
                row.name,
                severity=Severity.WARNING if fits else None,
                key=row.name,
                value=view.quote(row.name),
                problem=problem,
            )


# --- On-off control, pulse width modulation and split range -----------------------------------------------------------

CONTROL_ON_OFF = NEXTOPID.cite("chapter 6: ControlON_OFF")
PULSES = NEXTOPID.cite("chapter 7: Error")
PULSE_RANGE = NEXTOPID.cite("chapter 7: MaxMV, MinMV")
SPLIT = NEXTOPID.cite("chapter 15: Error")

D215 = Decision(
    215,
    "an on-off dead band of 0 is an error",
    "DeadBand of ControlON_OFF must be above 0; the bit ErrBits.DeadBand is set below 0 only, as the block does.",
    "The manual's range says above 0, its list of bits below 0. With 0 the output follows the noise of the PV.",
)
D216 = Decision(
    216,
    "a PWM period below 10 cycles is a warning",
    "The output then has steps of more than 10 %.",
    "The manual's own example has 10 cycles.",
)
MIN_CYCLES = 10
FULL_PERCENT = Decimal(100)
PWM_BLOCK = "ControlPWM"
SPLIT_RANGE_BLOCK = "ControlSplitRange"
BOTH_OUTPUTS_ZERO = ": both outputs are 0"


@error("NX649", D215, "DeadBand is {band}; it must be above 0{silent}")
def on_off_dead_band_not_positive(context: NextopidContext) -> Findings:
    """An on-off controller has no dead band.

    Why: with 0 the output is switched by the noise of PV, in every cycle if need be, which ruins a contactor. The block
    reports only a negative one, and stops then.

    Fix: give the error that can be tolerated, in units of PV.
    """
    for view in context.blocks_of_type(ON_OFF):
        band = view.number_of("DeadBand")
        if band is not None and band <= 0:
            silent = "" if band < 0 else ", though the block reports only values below 0"
            yield view.report(
                "DeadBand", None if band == 0 else "ErrBits.DeadBand", band=view.quote("DeadBand"), silent=silent
            )


@error(
    "NX650",
    CONTROL_ON_OFF,
    "MV is switched {what} when PV is {side} {point}{source}, but PV is limited to {limit} {end}: it never is",
)
def switch_point_out_of_reach(context: NextopidContext) -> Findings:
    """An on-off controller never switches on, or never off.

    Why: PV is limited to MinPV..MaxPV before it is compared. A switch point at or beyond a limit is never passed: a
    heater that has been switched on once stays on. With a set point that comes from a signal it is a warning: it
    holds for the first value.

    Fix: lower DeadBand, move SP away from the limit, or widen the limits of PV.
    """
    for view in context.blocks_of_type(ON_OFF):
        sp, band, pv, direct = (
            view.known_value("SP"),
            view.number_of("DeadBand"),
            view.pv_limits,
            view.is_on("Direct"),
        )
        if sp is None or band is None or pv is None or direct is None or band <= 0:
            continue
        point = min(max(sp.value, pv[0]), pv[1])
        severity = Severity.WARNING if sp.life < PERMANENT else None
        for value, limit, side in ((point - band, "MinPV", "below"), (point + band, "MaxPV", "above")):
            if value <= pv[0] or value >= pv[1]:
                description = "on" if (side == "above") == direct else "off"
                text = f"{number_text(value)}{view.unit('SP')}"
                yield view.report(
                    "DeadBand",
                    None,
                    severity,
                    what=description,
                    side=side,
                    point=text,
                    limit=limit,
                    end=view.quote(limit),
                    source=sp.source.replace("(", "(SP: ", 1),
                )


@error("NX651", PULSES, "MaxMV {high} is not above MinMV {low}")
def pulse_limits_crossed(context: NextopidContext) -> Findings:
    """The range of a pulse width modulation is empty.

    Why: the block stops with its Error, and its output stays as it is, on or off.

    Fix: give MaxMV the larger of the two values.
    """
    for view in context.blocks_of_type(PWM_BLOCK):
        yield from crossed_limits(view, "MinMV", "MaxMV", "Error")


@warning("NX652", D216, "Period {period} cycles: the output has steps of {percent} %")
def coarse_pulses(context: NextopidContext) -> Findings:
    """The period of a pulse width modulation has few cycles.

    Why: the on-time is a whole number of cycles. With few of them MV has to move far before anything changes, and the
    loop swings between two steps.

    Fix: lengthen Period, or call the task more often.
    """
    for view in context.blocks_of_type(PWM_BLOCK):
        period = view.item.Period
        if 0 < period < MIN_CYCLES:
            yield view.report("Period", period=period, percent=f"{100 / period:.3g}")


def pid_wired_to(view: BlockView, key: str) -> BlockView | None:
    """The PID controller whose MV a parameter is wired to, with nothing in between."""
    expression = view.wire(key)
    return None if expression is None or expression.signal is None else view.context.pid_output(expression.signal)


@warning("NX653", PULSE_RANGE, "{key} is {mine}, that of {loop} is {theirs}: {effect}")
def pulse_range_differs_from_loop(context: NextopidContext) -> Findings:
    """A pulse width modulation has another range than the loop that it serves.

    Why: MinMV and MaxMV say where the output is always off and always on. Where the loop goes further, its MV changes
    and the pulses do not; where it goes less far, the output never is fully on or off.

    Fix: give both the same limits, unless the loop is limited on purpose.
    """
    for view in context.blocks_of_type(PWM_BLOCK):
        loop = pid_wired_to(view, "MV") if view.mv_limits else None
        for key, direction in (("MinMV", -1), ("MaxMV", 1)):
            block_limit = view.number_of(key)
            loop_limit = None if loop is None else loop.number_of(key)
            if loop is not None and block_limit is not None and loop_limit is not None and block_limit != loop_limit:
                is_beyond = (loop_limit - block_limit) * direction > 0
                effect = "the pulses do not follow beyond it" if is_beyond else "the pulses never reach the end"
                yield view.report(
                    key,
                    "Warning" if is_beyond else None,
                    key=key,
                    mine=view.quote(key),
                    loop=loop.name,
                    theirs=loop.quote(key),
                    effect=effect,
                )


@error("NX654", SPLIT, "SPLIT is {point} %; it must be above 0 % and below 100 %: both outputs are 0")
def split_point_out_of_range(context: NextopidContext) -> Findings:
    """The split point leaves one of the valves no room.

    Why: the function reports its Error, and both its outputs are 0 until the split point is corrected.

    Fix: give the percentage of MV at which one valve hands over to the other.
    """
    for view in context.blocks_of_type(SPLIT_RANGE_BLOCK):
        point = view.number_of("SPLIT")
        if point is not None and not 0 < point < FULL_PERCENT:
            yield view.report("SPLIT", "Error", point=view.quote("SPLIT"))


@error("NX655", SPLIT, "MV is in % of 0 to 100, but {what}{effect}")
def split_range_not_in_percent(context: NextopidContext) -> Findings:
    """What a split range is given is not a percentage.

    Why: below 0 or above 100 the function reports its Error, and both its outputs are 0: a valve that was open closes
    at once. A loop that ends earlier never opens, or never closes, one of them fully.

    Fix: give the loop MinMV 0 and MaxMV 100, or scale its MV in the wire: `TIC.MV / 300`.
    """
    for view in context.blocks_of_type(SPLIT_RANGE_BLOCK):
        loop, value = pid_wired_to(view, "MV"), view.number_of("MV")
        limits = None if loop is None else loop.mv_limits
        if value is not None and not 0 <= value <= FULL_PERCENT:
            yield view.report("MV", "Error", what=f"it is {view.quote('MV')}", effect=BOTH_OUTPUTS_ZERO)
        elif loop is not None and limits is not None and limits != (Decimal(0), FULL_PERCENT):
            is_beyond = limits[0] < 0 or limits[1] > FULL_PERCENT
            description = f"{loop.name} goes from {loop.quote('MinMV')} to {loop.quote('MaxMV')}"
            yield view.report(
                "MV",
                "Error" if is_beyond else None,
                None if is_beyond else Severity.WARNING,
                what=description,
                effect="; beyond 0 to 100 both outputs are 0" if is_beyond else "",
            )


# --- Settings that are sound by themselves and not beside each other --------------------------------------------------

TRACKING = NEXTOPID.cite("chapter 2: TRK_IN, TRK_VAL")
WINDUP = NEXTOPID.cite("chapter 2: Windup_H_IN, Windup_L_IN")
DIRECTION = NEXTOPID.cite("chapter 2: Direct")
D552 = Decision(
    552,
    "a derivative or filter slower than what it is part of",
    "With an integral, Td_Kd above Ti_Ki, Tfd above Td_Kd and a filter of the PV slower than Ti_Ki are warnings; with "
    "Indep TRUE, where they are gains, nothing is said.",
    "A derivative time is a fraction of the integral time by every tuning rule of chapter 17, and a filter a fraction "
    "of the time that it filters; larger ones are mostly two numbers that have changed places.",
)
D553 = Decision(
    553,
    "two loops of one PV that act against each other",
    "An info, unless both go to a selector or a split range: one of them heats and the other cools there.",
    "Both may be meant so, with a gap between their set points; that no file shows.",
)
D957 = Decision(
    957,
    "two moves of MV to one output",
    "An error where both are moved as they are, in every cycle and at the same end of it. With conditions, or through "
    "a block, nothing is said.",
    "Moves are executed in their order, so that the last one has the output in every cycle; a loop that never has it "
    "is no design.",
)
JOINING_BLOCKS = ("ControlSelectMax", "ControlSelectMin", "ControlSplitRange")


@per_pid
@warning("NX687", TRACKING, "TRK_IN is {value}, and TRK_VAL is not given: MV stays at {mv}")
def tracking_without_value(view: BlockView) -> Findings:
    """A loop follows a tracking value that is not there.

    Why: while TRK_IN is TRUE the block does not control, and MV is TRK_VAL. Without an entry that is 0, or the limit
    of MV next to it.

    Fix: give or wire TRK_VAL; write TRK_IN only where a slave, or the program, says when to follow.
    """
    if view.is_on("TRK_IN") and not view.is_wired("TRK_IN") and not view.is_given("TRK_VAL"):
        low, high = view.mv_limits or (None, None)
        at_rest = "0" if low is None or high is None else number_text(min(max(low * 0, low), high))
        yield view.report("TRK_IN", value=view.quote("TRK_IN"), mv=f"{at_rest}{view.unit('MV')}")


@per_pid
@warning("NX688", WINDUP, "Windup_H_IN and Windup_L_IN are both TRUE: the integral never moves")
def integral_held_both_ways(view: BlockView) -> Findings:
    """The integral may neither rise nor fall.

    Why: each of the two inputs holds it in one direction. Both constant make a loop with an integral time that has no
    integral, so that an error stays for good.

    Fix: wire them to the slave's outputs, or remove them.
    """
    keys = ("Windup_H_IN", "Windup_L_IN")
    if view.integral and all(view.is_on(key) and not view.is_wired(key) for key in keys):
        yield view.report("Windup_L_IN")


@per_pid
@warning("NX689", D552, "{long} {value} is longer than {short} {other}")
def times_out_of_proportion(view: BlockView) -> Findings:
    """A derivative time is longer than the integral time, or a filter longer than what it filters.

    Why: the loop then answers to the slope of the PV more than to its value, or filters away what it should act on.
    Mostly two numbers have changed places, or one is in another unit.

    Fix: correct the time; a derivative is 1/4 of the integral time and less, its filter 1/8 of the derivative.
    """
    integral, derivative, indep = view.number_of("Ti_Ki"), view.number_of("Td_Kd"), view.is_on("Indep")
    if indep is not False or integral is None or integral < MIN_INTEGRAL_TIME:
        return
    for key, short, value, limit in (
        ("Td_Kd", "Ti_Ki", derivative, integral),
        ("Tfd", "Td_Kd", view.number_of("Tfd") if derivative and derivative > 0 else None, derivative),
    ):
        if value is not None and limit is not None and value > limit:
            yield view.report(key, long=key, value=view.quote(key), short=short, other=view.quote(short))
    for name, time in _pv_filters(view):
        if time > integral:
            text = f"{number_text(time)} s ({name}.Tc)"
            yield view.report("Ti_Ki", long="the filter of PV", value=text, short="Ti_Ki", other=view.quote("Ti_Ki"))


def _pv_filters(view: BlockView) -> Iterator[tuple[str, Decimal]]:
    """The low-pass filter that PV comes from, with its time constant."""
    expression = view.wire("PV")
    owner = None if expression is None or expression.signal is None else view.context.owner(expression.signal)
    if owner is not None and owner[0].type == "ControlLowFilter" and owner[1].name == "OutVar":
        time = owner[0].number_of("Tc")
        if time is not None:
            yield owner[0].name, time


@info("NX690", D553, "{one} and {two} have one PV, {pv}, and act in opposite directions")
def opposite_loops_of_one_pv(context: NextopidContext) -> Findings:
    """Two loops control the same PV, one heating and one cooling.

    Why: where their set points meet they work against each other, and their integrals go to opposite limits.

    Fix: join them by a split range, or leave a gap between the set points; correct Direct where it was not meant.
    """
    joined_signals = {
        number
        for block in context.blocks_of_type(*JOINING_BLOCKS)
        for key in ("MV", "MV1", "MV2")
        if key in type(block.item).model_fields and (wire := block.wire(key)) is not None
        for number in wire.signals
    }
    joined_loops = {view.number for number in joined_signals if (view := context.pid_output(number)) is not None}
    crossed_pairs = {frozenset((first.number, two.number)) for first, two in _crossed_pairs(context)}
    for first, two, pv in pairs_with_same_key(context.pids, lambda view: view.source("PV")):
        if {first.is_on("Direct"), two.is_on("Direct")} != {True, False} or {first.number, two.number} <= joined_loops:
            continue
        if frozenset((first.number, two.number)) in crossed_pairs:
            continue
        for this, other in ((first, two), (two, first)):
            key = "Direct" if this.is_given("Direct") else "PV"
            yield this.report(key, one=first.name, two=two.name, pv=pv).with_other_loops(other.name)


def _crossed_pairs(context: NextopidContext) -> list[tuple[BlockView, BlockView]]:
    """Pairs of loops with one PV, the heating one first, that heat to above where they cool."""
    views = [view for view in context.pids if view.is_on("Direct") or not view.may_be_on("Direct")]
    pairs = ((one, two) for one, two, _ in pairs_with_same_key(views, lambda view: view.source("PV")))
    return [*crossed_set_points(pairs, lambda view: not view.is_on("Direct"), lambda view: view.number_of("SP"))]


@warning("NX691", D955, "{heating} raises {pv} to {high}, {cooling} lowers it to {low}: between them both MV are on")
def set_points_crossed(context: NextopidContext) -> Findings:
    """A heating and a cooling loop on one PV have crossed set points.

    Why: the loop with Direct FALSE raises the PV to its SP, the one with TRUE lowers it to its own. With the first
    above the second, both run to their limits and work against each other.

    Fix: put the SP of the loop with Direct TRUE above that of the other, with a gap between them.
    """
    for heating, cooling in _crossed_pairs(context):
        names = {"heating": heating.name, "cooling": cooling.name, "pv": heating.source("PV")}
        for this, other in ((heating, cooling), (cooling, heating)):
            values = {"high": heating.quote("SP"), "low": cooling.quote("SP")}
            yield this.report("SP").with_values(**names, **values).with_other_loops(other.name)


@error("NX692", D957, "{to} is also written by the move of {other}.MV, {which}: the last move has the output")
def output_written_twice(context: NextopidContext) -> Findings:
    """Two loops move their MV to one output in each cycle.

    Why: the last move wins; the other loop controls nothing, and its integral runs to a limit.

    Fix: give each loop its own output; join two loops of one valve by a selector or a split range, or write with `when`
    which of them has it.
    """
    moves_by_target: dict[tuple[int, bool], list[tuple[int, BlockView]]] = {}
    for i, copy in enumerate(context.encoding.copies):
        view = None if copy is None or copy.when is not None else _moved_output(context, copy.value)
        if copy is not None and view is not None:
            moves_by_target.setdefault((copy.target, copy.at_start), []).append((i, view))
    for moves in moves_by_target.values():
        for (i, one), (j, two) in permutations(moves, 2):
            if one is not two:
                to, which = context.config.moves[i].to, "before it" if j < i else "behind it"
                yield Finding(("moves", i, "move"), {"to": to, "other": two.name, "which": which})


def _moved_output(context: NextopidContext, value: Expression) -> BlockView | None:
    """The controller whose MV is moved as it is; None: something else is."""
    return None if value.signal is None else context.pid_output(value.signal)
