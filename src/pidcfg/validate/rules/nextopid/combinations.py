"""Settings that are sound by themselves and not beside each other."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID, Decision
from pidcfg.schemas.nextopid import SHORTEST_INTEGRAL
from pidcfg.validate.rule import Findings, info, per_pid, warning
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from collections.abc import Iterator
    from decimal import Decimal

    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

TRACKING = NEXTOPID.at("chapter 2: TRK_IN, TRK_VAL")
WINDUP = NEXTOPID.at("chapter 2: Windup_H_IN, Windup_L_IN")
DIRECTION = NEXTOPID.at("chapter 2: Direct")
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
JOINING = ("ControlSelectMax", "ControlSelectMin", "ControlSplitRange")


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
        yield view.at("TRK_IN", value=view.shown("TRK_IN"), mv=f"{at_rest}{view.unit('MV')}")


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
        yield view.at("Windup_L_IN")


@per_pid
@warning("NX689", D552, "{long} {value} is longer than {short} {other}")
def times_out_of_proportion(view: BlockView) -> Findings:
    """A derivative time is longer than the integral time, or a filter longer than what it filters.

    Why: the loop then answers to the slope of the PV more than to its value, or filters away what it should act on.
    Mostly two numbers have changed places, or one is in another unit.

    Fix: correct the time; a derivative is 1/4 of the integral time and less, its filter 1/8 of the derivative.
    """
    integral, derivative, indep = view.number_of("Ti_Ki"), view.number_of("Td_Kd"), view.is_on("Indep")
    if indep is not False or integral is None or integral < SHORTEST_INTEGRAL:
        return
    for key, short, value, limit in (
        ("Td_Kd", "Ti_Ki", derivative, integral),
        ("Tfd", "Td_Kd", view.number_of("Tfd") if derivative and derivative > 0 else None, derivative),
    ):
        if value is not None and limit is not None and value > limit:
            yield view.at(key, long=key, value=view.shown(key), short=short, other=view.shown(short))
    for name, time in _filters(view):
        if time > integral:
            text = f"{number_text(time)} s ({name}.Tc)"
            yield view.at("Ti_Ki", long="the filter of PV", value=text, short="Ti_Ki", other=view.shown("Ti_Ki"))


def _filters(view: BlockView) -> Iterator[tuple[str, Decimal]]:
    """The low-pass filter that PV comes from, with its time constant."""
    source = view.source("PV") or ""
    for block in view.context.of("ControlLowFilter"):
        time = block.number_of("Tc")
        if source == f"{block.name}.OutVar" and time is not None:
            yield block.name, time


@info("NX690", D553, "{one} and {two} have one PV, {pv}, and act in opposite directions")
def opposite_loops_of_one_pv(context: NextopidContext) -> Findings:
    """Two loops control the same PV, one heating and one cooling.

    Why: where their set points meet they work against each other, and their integrals go to opposite limits.

    Fix: join them by a split range, or leave a gap between the set points; correct Direct where it was not meant.
    """
    joined = {
        number
        for block in context.of(*JOINING)
        for key in ("MV", "MV1", "MV2")
        if key in type(block.item).model_fields and (wire := block.wire(key)) is not None
        for number in wire.signals
    }
    outputs = {view.number for number in joined if (view := context.pid_output(number)) is not None}
    for one, two in combinations(context.pids, 2):
        pv, directions = one.source("PV"), {one.is_on("Direct"), two.is_on("Direct")}
        if pv is None or pv != two.source("PV") or directions != {True, False} or {one.number, two.number} <= outputs:
            continue
        for this, other in ((one, two), (two, one)):
            key = "Direct" if this.is_given("Direct") else "PV"
            yield this.at(key, one=one.name, two=two.name, pv=pv).shared_with(other.name)
