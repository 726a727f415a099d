"""Overrides, and feed-forward through BIAS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.diagnostics import Severity
from pidcfg.refs import NEXTOPID, Decision
from pidcfg.validate.ideas.duplicates import at_both
from pidcfg.validate.rule import Findings, checklist, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.links import D218, fault_of
from pidcfg.validate.rules.nextopid.paths import SELECTORS
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

OVERRIDE = NEXTOPID.at("chapter 16: Override Configurations")
SELECTOR = NEXTOPID.at("chapters 13 and 14: MV1, MV2")
BIAS = NEXTOPID.at("chapter 2: BIAS")

D211 = Decision(
    211,
    "figure 16-18's second peak is 50.855",
    "Without the feed-forward PV rises to 50.855 when Fi falls from 2.1 to 2.0, not to 50.885.",
    "The example, calculated cycle by cycle, gives the other peaks that the manual prints, and this.",
)
D219 = Decision(
    219,
    "selectors of loops that act in opposite directions",
    "Direct TRUE beside Direct FALSE at one selector is an info that says on which side of its set point each PV is "
    "held; an overridden loop without integral is an info too.",
    "The manual's example has two reverse loops at ControlSelectMin, which keep both PVs below; a suction pressure "
    "beside a discharge pressure is the other way round and right. Override changes nothing but the integral.",
)


@error("NX675", SELECTOR, "MV1 and MV2 of {selector} are both {loop}.MV")
def selector_of_one_loop(context: NextopidContext) -> Findings:
    """A selector compares a loop with itself.

    Why: the second loop, the one that was to protect the plant, has no say.

    Fix: wire MV2 to the second loop.
    """
    for selector, first, second in context.network.pairs():
        if first.loop is second.loop:
            yield selector.at("MV2", selector=selector.name, loop=first.loop.name)


@error("NX676", OVERRIDE, "OVERR of {loop}, {input} of {selector}, must come from {selector}.{output}, and is {found}")
def override_not_connected(context: NextopidContext) -> Findings:
    """A loop does not learn that another one has the valve.

    Why: its integral winds up while the other loop controls; when it is needed, it comes late. Crossed, the loop that
    controls is treated as overridden, and the other one winds up.

    Fix: wire OVERR of the loop at MV1 to OVERR1, and of the one at MV2 to OVERR2.
    """
    for legs in context.network.legs_of_loop.values():
        leg = legs[0]
        fault = fault_of(leg.loop, "OVERR", {f"{other.selector.name}.OVERR{other.number}" for other in legs})
        if fault is not None:
            crossed = leg.loop.source("OVERR") == f"{leg.selector.name}.OVERR{3 - leg.number}"
            yield leg.loop.at(
                "OVERR",
                None,
                fault.severity,
                loop=leg.loop.name,
                input=f"MV{leg.number}",
                selector=leg.selector.name,
                output=f"OVERR{leg.number}",
                found=f"{fault.text}: crossed" if crossed else fault.text,
            )


@error("NX677", OVERRIDE, "TRK_VAL of {loop}, overridden by {selector}, must be {selector}.MV, and is {found}")
def override_value_not_selected_mv(context: NextopidContext) -> Findings:
    """An overridden loop does not know the MV that controls in its stead.

    Why: its integral is calculated back to TRK_VAL. If that is not the selected MV the loop comes back with a bump, or
    takes the valve when it should not.

    Fix: wire TRK_VAL to MV of the selector; not to MV of the other loop, which may be overridden itself.
    """
    for legs in context.network.legs_of_loop.values():
        leg = legs[0]
        wanted = set().union(*(context.network.behind(other.selector) for other in legs))
        fault = fault_of(leg.loop, "TRK_VAL", wanted)
        wire = leg.loop.wire("TRK_VAL")
        reads = wire is not None and {context.names[number] for number in wire.signals} & wanted
        if fault is not None and not (reads and not leg.exact):
            yield leg.loop.at(
                "TRK_VAL", None, fault.severity, loop=leg.loop.name, selector=leg.selector.name, found=fault.text
            )


@info("NX678", D219, "{selector} holds PV of {first} {side} its SP and PV of {second} {other_side}: Direct differs")
def selector_of_opposite_loops(context: NextopidContext) -> Findings:
    """Two loops that act in opposite directions share a valve.

    Why: the smaller MV keeps PV of a reverse loop at or below its set point, and PV of a direct loop at or above; the
    larger MV the other way round. It is right for suction and discharge pressure, and wrong for two temperatures of a
    heater.

    Fix: check that opening the valve moves the two PVs in opposite directions.
    """
    for selector, first, second in context.network.pairs():
        modes = first.loop.is_on("Direct"), second.loop.is_on("Direct")
        if None not in modes and modes[0] != modes[1]:
            smaller = selector.type == "ControlSelectMin"
            sides = ["above" if bool(mode) == smaller else "below" for mode in modes]
            values = {"selector": selector.name, "first": first.loop.name, "second": second.loop.name}
            values |= {"side": sides[0], "other_side": sides[1]}
            at_first, at_second = first.loop.at("Direct"), second.loop.at("Direct")
            yield from at_both(first.loop, at_first, second.loop, at_second, **values)


@warning("NX679", OVERRIDE, "{selector} compares MV of {first} ({limits}) with MV of {second} ({others})")
def override_limits_differ(context: NextopidContext) -> Findings:
    """Two loops of an override have different limits of MV.

    Why: both move the same valve. The selector compares their numbers: with other limits, or another scale, one of them
    is selected because its range ends, not because its process asks for it.

    Fix: give both loops the same MinMV and MaxMV.
    """
    for selector, first, second in context.network.pairs():
        one, other = first.loop.mv_limits, second.loop.mv_limits
        if one and other and one != other and first.exact and second.exact:
            key = "MinMV" if one[0] != other[0] else "MaxMV"
            ranges = {"limits": _range(first.loop), "others": _range(second.loop)}
            values = {"selector": selector.name, "first": first.loop.name, "second": second.loop.name, **ranges}
            yield from at_both(first.loop, first.loop.at(key), second.loop, second.loop.at(key), **values)


def _range(loop: BlockView) -> str:
    return f"{loop.shown('MinMV')} to {loop.shown('MaxMV')}"


@warning("NX680", D218, "OVERR is {found}, but {what}")
def override_without_selector(context: NextopidContext) -> Findings:
    """A loop is overridden by nothing.

    Why: while OVERR is TRUE the integral is calculated back to TRK_VAL, which is 0 when it is not given. The loop then
    behaves like a proportional one, or follows a selector that it is not part of.

    Fix: wire MV of the loop to the selector, or take OVERR away; with a selector of your own give TRK_VAL its MV.
    """
    for view in context.pids:
        if view.number in context.network.legs_of_loop or not view.may_be_on("OVERR"):
            continue
        wire = view.wire("OVERR")
        owner = None if wire is None or wire.signal is None else context.owner(wire.signal)
        state = "TRUE" if wire is None else f"wired to {wire.text}"
        if owner is not None and owner[0].type in SELECTORS:
            what = f"{owner[0].name} does not read {view.name}.MV"
            yield view.at("OVERR", None, Severity.ERROR, found=state, what=what)
        elif not view.is_given("TRK_VAL"):
            yield view.at("OVERR", found=state, what="TRK_VAL, the MV that controls instead, is not given")


@checklist("NX681", D219, "{loop} has no integral: OVERR and TRK_VAL change nothing in it")
def override_without_integral(context: NextopidContext) -> Findings:
    """A loop of an override has no integral.

    Why: override works on the integral alone. Without one the loop takes the valve at a fixed distance from its set
    point, which may be what is wanted of a limiter.

    Fix: see that a loop without an integral is meant; otherwise give Ti_Ki.
    """
    for legs in context.network.legs_of_loop.values():
        loop = legs[0].loop
        if loop.integral == 0:
            yield loop.at("Ti_Ki", loop=loop.name)


@per_pid
@info("NX682", BIAS, "BIAS is added to MV as it is: Direct TRUE does not turn its sign")
def bias_of_a_direct_loop(view: BlockView) -> Findings:
    """A loop with direct control has a feed-forward.

    Why: Direct negates the actions of the loop, not BIAS. A feed-forward that was calculated for the other sign doubles
    the disturbance.

    Fix: check that a disturbance that needs more MV raises BIAS.
    """
    if view.is_wired("BIAS") and view.is_on("Direct"):
        yield view.at("BIAS")


@info("NX683", BIAS, "{source} may go from {low} to {high}, and MV has only {limits}")
def feed_forward_beyond_mv(context: NextopidContext) -> Findings:
    """A feed-forward can be larger than the whole range of MV.

    Why: BIAS then holds MV at a limit, whatever the loop calculates, and the integral works against it.

    Fix: limit the feed-forward with Min_OutVar and Max_OutVar to what MV can do.
    """
    for view in context.pids:
        wire, mv = view.wire("BIAS"), view.mv_limits
        owner = None if wire is None or wire.signal is None else context.owner(wire.signal)
        if (
            owner is None
            or mv is None
            or owner[1].name != "OutVar"
            or "Max_OutVar" not in type(owner[0].item).model_fields
        ):
            continue
        low, high = owner[0].number_of("Min_OutVar"), owner[0].number_of("Max_OutVar")
        span = mv[1] - mv[0]
        if low is not None and high is not None and (low < -span or high > span):
            yield view.at(
                "BIAS",
                source=f"{owner[0].name}.OutVar",
                low=number_text(low),
                high=number_text(high),
                limits=_range(view),
            )
