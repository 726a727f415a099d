"""On-off control, pulse width modulation and split range."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.validate.rule import Findings, error, warning
from pidcfg.validate.rules.nextopid.limits import crossed
from pidcfg.validate.rules.nextopid.program import ON_OFF, BlockView
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext

SWITCH = NEXTOPID.at("chapter 6: ControlON_OFF")
PULSES = NEXTOPID.at("chapter 7: Error")
PULSE_RANGE = NEXTOPID.at("chapter 7: MaxMV, MinMV")
SPLIT = NEXTOPID.at("chapter 15: Error")

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
FEWEST_CYCLES = 10
FULL = Decimal(100)
PULSE = "ControlPWM"
SPLITTER = "ControlSplitRange"
ZEROES = ": both outputs are 0"


@error("NX649", D215, "DeadBand is {band}; it must be above 0{silent}")
def on_off_dead_band_not_positive(context: NextopidContext) -> Findings:
    """An on-off controller has no dead band.

    Why: with 0 the output is switched by the noise of PV, in every cycle if need be, which ruins a contactor. The block
    reports only a negative one, and stops then.

    Fix: give the error that can be tolerated, in units of PV.
    """
    for view in context.of(ON_OFF):
        band = view.number_of("DeadBand")
        if band is not None and band <= 0:
            silent = "" if band < 0 else ", though the block reports only values below 0"
            yield view.at(
                "DeadBand", None if band == 0 else "ErrBits.DeadBand", band=view.shown("DeadBand"), silent=silent
            )


@error(
    "NX650",
    SWITCH,
    "MV is switched {what} when PV is {side} {point}{source}, but PV is limited to {limit} {end}: it never is",
)
def switch_point_out_of_reach(context: NextopidContext) -> Findings:
    """An on-off controller never switches on, or never off.

    Why: PV is limited to MinPV..MaxPV before it is compared. A switch point at or beyond a limit is never passed: a
    heater that has been switched on once stays on. With a set point that comes from a signal it is a warning: it
    holds for the first value.

    Fix: lower DeadBand, move SP away from the limit, or widen the limits of PV.
    """
    for view in context.of(ON_OFF):
        sp, band, pv, direct = (
            view.known("SP"),
            view.number_of("DeadBand"),
            view.pv_limits,
            view.is_on("Direct"),
        )
        if sp is None or band is None or pv is None or direct is None or band <= 0:
            continue
        point = min(max(sp.value, pv[0]), pv[1])
        severity = Severity.WARNING if sp.source else None
        for value, limit, side in ((point - band, "MinPV", "below"), (point + band, "MaxPV", "above")):
            if value <= pv[0] or value >= pv[1]:
                what = "on" if (side == "above") == direct else "off"
                text = f"{number_text(value)}{view.unit('SP')}"
                yield view.at(
                    "DeadBand",
                    None,
                    severity,
                    what=what,
                    side=side,
                    point=text,
                    limit=limit,
                    end=view.shown(limit),
                    source=sp.source.replace("(", "(SP: ", 1),
                )


@error("NX651", PULSES, "MaxMV {high} is not above MinMV {low}")
def pulse_limits_crossed(context: NextopidContext) -> Findings:
    """The range of a pulse width modulation is empty.

    Why: the block stops with its Error, and its output stays as it is, on or off.

    Fix: give MaxMV the larger of the two values.
    """
    for view in context.of(PULSE):
        yield from crossed(view, "MinMV", "MaxMV", "Error")


@warning("NX652", D216, "Period {period} cycles: the output has steps of {percent} %")
def coarse_pulses(context: NextopidContext) -> Findings:
    """The period of a pulse width modulation has few cycles.

    Why: the on-time is a whole number of cycles. With few of them MV has to move far before anything changes, and the
    loop swings between two steps.

    Fix: lengthen Period, or call the task more often.
    """
    for view in context.of(PULSE):
        period = view.item.Period
        if 0 < period < FEWEST_CYCLES:
            yield view.at("Period", period=period, percent=f"{100 / period:.3g}")


def driver(view: BlockView, key: str) -> BlockView | None:
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
    for view in context.of(PULSE):
        loop = driver(view, "MV") if view.mv_limits else None
        for key, way in (("MinMV", -1), ("MaxMV", 1)):
            block_limit = view.number_of(key)
            loop_limit = None if loop is None else loop.number_of(key)
            if loop is not None and block_limit is not None and loop_limit is not None and block_limit != loop_limit:
                beyond = (loop_limit - block_limit) * way > 0
                effect = "the pulses do not follow beyond it" if beyond else "the pulses never reach the end"
                yield view.at(
                    key,
                    "Warning" if beyond else None,
                    key=key,
                    mine=view.shown(key),
                    loop=loop.name,
                    theirs=loop.shown(key),
                    effect=effect,
                )


@error("NX654", SPLIT, "SPLIT is {point} %; it must be above 0 % and below 100 %: both outputs are 0")
def split_point_out_of_range(context: NextopidContext) -> Findings:
    """The split point leaves one of the valves no room.

    Why: the function reports its Error, and both its outputs are 0 until the split point is corrected.

    Fix: give the percentage of MV at which one valve hands over to the other.
    """
    for view in context.of(SPLITTER):
        point = view.number_of("SPLIT")
        if point is not None and not 0 < point < FULL:
            yield view.at("SPLIT", "Error", point=view.shown("SPLIT"))


@error("NX655", SPLIT, "MV is in % of 0 to 100, but {what}{effect}")
def split_range_not_in_percent(context: NextopidContext) -> Findings:
    """What a split range is given is not a percentage.

    Why: below 0 or above 100 the function reports its Error, and both its outputs are 0: a valve that was open closes
    at once. A loop that ends earlier never opens, or never closes, one of them fully.

    Fix: give the loop MinMV 0 and MaxMV 100, or scale its MV in the wire: `TIC.MV / 300`.
    """
    for view in context.of(SPLITTER):
        loop, value = driver(view, "MV"), view.number_of("MV")
        limits = None if loop is None else loop.mv_limits
        if value is not None and not 0 <= value <= FULL:
            yield view.at("MV", "Error", what=f"it is {view.shown('MV')}", effect=ZEROES)
        elif loop is not None and limits is not None and limits != (Decimal(0), FULL):
            beyond = limits[0] < 0 or limits[1] > FULL
            what = f"{loop.name} goes from {loop.shown('MinMV')} to {loop.shown('MaxMV')}"
            yield view.at(
                "MV",
                "Error" if beyond else None,
                None if beyond else Severity.WARNING,
                what=what,
                effect="; beyond 0 to 100 both outputs are 0" if beyond else "",
            )
