"""Cascades and overrides of NextoPID: who is whose master, their special connections, and feed-forward through BIAS."""

from __future__ import annotations

from collections.abc import Iterator

from pidcfg.schemas.nextopid import MAX_SAMPLE_TIME
from pidcfg.text.diagnostics import Severity
from pidcfg.text.references import NEXTOPID, Decision
from pidcfg.validate.rule import Findings, checklist, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.context import D218, SELECTORS, BlockView, Link, NextopidContext, connection_fault
from pidcfg.validate.rules.nextopid.first_scan import dependencies_of
from pidcfg.validate.shared_checks import find_circles, list_names, number_text, report_at_both

# --- Cascades: who is whose master, and what master and slave have in common ------------------------------------------

CASCADE = NEXTOPID.cite("chapter 16: Cascade Configurations, Special Connections")
CASC = NEXTOPID.cite("chapter 2: CASC")
LIMITS = NEXTOPID.cite("chapter 2: MaxPV, WarnBits")
MAX_NAMES = 5
CASCADE_HINTS = NEXTOPID.cite("chapter 17: Hints for Tuning PID in Cascade Configuration")


@error("NX662", D218, "{name} is its own master: {way}")
def cascade_in_a_circle(context: NextopidContext) -> Findings:
    """Loops take their set points from each other in a circle.

    Why: nobody says what any of them is to hold; their MVs drift to a limit.

    Fix: wire SP_CASC of the outermost loop to something else, or leave it out.
    """
    masters = {link.slave.number: link.master.number for link in context.connections.links}
    for ring in find_circles([masters.get(view.number) for view in context.views]):
        names = [context.views[i].name for i in ring]
        circle = [*names, names[0]]
        way = " follows ".join(circle if len(circle) <= MAX_NAMES else [*circle[:MAX_NAMES], "…"])
        for view in (context.views[i] for i in ring):
            finding = view.report("SP_CASC", name=view.name, way=way)
            yield finding.with_other_loops(*(name for name in names if name != view.name))


@error(
    "NX663",
    CASCADE,
    "{slave} is the slave of {masters} at once: TRK_OUT and the windup outputs can tell only one of them",
)
def two_masters(context: NextopidContext) -> Findings:
    """A slave takes its set point from several loops.

    Why: each of the masters believes that it has the slave. Their integrals work against each other, and move away.

    Fix: choose one, or put a selector between them and wire it as an override.
    """
    for links in context.connections.links_by_slave.values():
        masters, view = [link.master for link in links], links[0].slave
        if len(masters) > 1:
            names = [master.name for master in masters]
            values = {"slave": view.name, "masters": list_names(names)}
            yield view.report("SP_CASC").with_values(**values).with_other_loops(*names)
            for master in masters:
                yield master.report("name").with_values(**values).with_other_loops(view.name)


@warning(
    "NX664",
    CASCADE,
    "{master} is the master of {slaves}: TRK_IN, TRK_VAL and the windup inputs can follow only one of them",
)
def several_slaves(context: NextopidContext) -> Findings:
    """A master serves several slaves.

    Why: the master learns from one slave whether it is followed. When another one is in manual or at its limit, the
    master's integral winds up.

    Fix: let the special connections come from the slave that matters, and switch the slaves together.
    """
    for master, links in context.connections.masters():
        if len(links) > 1:
            names = [link.slave.name for link in links]
            values = {"master": master.name, "slaves": list_names(names)}
            yield master.report("name").with_values(**values).with_other_loops(*names)
            for link in links:
                yield link.slave.report("SP_CASC").with_values(**values).with_other_loops(master.name)


@info("NX665", CASCADE, "CASC is FALSE: {loop}{role} never follows SP_CASC, {source}")
def never_in_cascade_mode(context: NextopidContext) -> Findings:
    """SP_CASC is wired, and cascade mode is off.

    Why: the loop controls SP as long as nobody writes CASC; its master, if it has one, tracks. CASC normally comes from
    an operator.

    Fix: wire CASC to the operator's switch, or write `true`.
    """
    for view in context.pids:
        expression = view.wire("SP_CASC")
        if expression is not None and view.is_on("CASC") is False and not view.is_wired("CASC"):
            role = context.connections.role(view)
            yield view.report(
                "CASC", loop=view.name, role=f" ({role})" if "slave" in role else "", source=expression.text
            )


@per_pid
@error("NX666", CASC, "CASC is {value}, but SP_CASC is not given: the set point is 0{unit}")
def cascade_mode_without_set_point(view: BlockView) -> Findings:
    """Cascade mode can be switched on, and nothing gives the set point.

    Why: with CASC TRUE the set point is SP_CASC, which is 0 when it is not given.

    Fix: wire SP_CASC, or remove CASC.
    """
    if not view.is_given("SP_CASC") and view.may_be_on("CASC"):
        value = "wired" if view.is_wired("CASC") else "TRUE"
        yield view.report("CASC", value=value, unit=view.unit("SP"))


@warning("NX667", CASCADE, "{loop} is only master, of {slave}: its CASC must be FALSE, and is {value}")
def master_in_cascade_mode(context: NextopidContext) -> Findings:
    """The outermost loop of a cascade can be in cascade mode.

    Why: its set point comes from the operator, as SP. In cascade mode it follows SP_CASC, which no loop gives.

    Fix: remove CASC. If SP_CASC is a ratio on purpose, leave it.
    """
    for master, links in context.connections.masters():
        in_cascade = master.may_be_on("CASC") and master.is_given("SP_CASC")
        if in_cascade and context.connections.role(master) == "only master":
            value = "wired" if master.is_wired("CASC") else "TRUE"
            yield master.report("CASC", loop=master.name, slave=links[0].slave.name, value=value)


@warning("NX673", LIMITS, "{parameter} {mine} of the master {master} is beyond {limit} {theirs} of its slave {slave}")
def master_range_beyond_slave(context: NextopidContext) -> Findings:
    """A master can ask its slave for more than the slave takes.

    Why: MV of the master is the set point of the slave, which is limited to MinPV..MaxPV of the slave. Beyond that the
    master moves and nothing happens: its integral winds up, and no windup output tells it.

    Fix: give the master the slave's MinPV and MaxPV, or less, as MinMV and MaxMV.
    """
    for link in context.connections.links:
        for key, limit, direction in (("MinMV", "MinPV", -1), ("MaxMV", "MaxPV", 1)):
            mv, pv = link.master.number_of(key), link.slave.number_of(limit)
            if mv is None or pv is None or link.master.mv_limits is None or link.slave.pv_limits is None:
                continue
            if link.is_exact and (mv - pv) * direction > 0:
                effect = f"{link.slave.name}.WarnBits.SP_CASC_{limit}"
                shown = {"mine": link.master.quote(key), "limit": limit, "theirs": link.slave.quote(limit)}
                names = {"parameter": key, "master": link.master.name, "slave": link.slave.name}
                at_master, at_slave = link.master.report(key, effect), link.slave.report(limit, effect)
                yield from report_at_both(link.master, at_master, link.slave, at_slave, **shown, **names)


@warning("NX674", CASCADE_HINTS, "the slave {slave} is calculated every {time} s, its master {master} every {other} s")
def slave_slower_than_master(context: NextopidContext) -> Findings:
    """A slave is calculated less often than its master.

    Why: for the master the slave is part of the process, and the faster part. A slave that does not even see every new
    set point is dead time.

    Fix: give the slave the shorter sample time.
    """
    for link in context.connections.links:
        if link.slave.sample_time > link.master.sample_time:
            times = {"time": number_text(link.slave.sample_time), "other": number_text(link.master.sample_time)}
            values = {"slave": link.slave.name, "master": link.master.name, **times}
            at_slave, at_master = link.slave.report("sample_time"), link.master.report("sample_time")
            yield from report_at_both(link.slave, at_slave, link.master, at_master, **values)


# --- The special connections of a cascade, by the part that a loop has in it ------------------------------------------

MASTER_INPUTS = ("TRK_IN", "Windup_H_IN", "Windup_L_IN")
SLAVE_OUTPUTS = ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")


@error("NX668", CASCADE, "{loop} is {role}: TRK_IN must come from {slave}.TRK_OUT, and is {found}")
def tracking_not_connected(context: NextopidContext) -> Findings:
    """A master does not learn when its slave leaves it.

    Why: while the slave is in manual or follows its own SP, the master's integral runs to a limit. When the slave comes
    back, it gets that as its set point.

    Fix: wire TRK_IN to TRK_OUT of the slave.
    """
    for master, links in context.connections.masters():
        fault = connection_fault(master, "TRK_IN", {f"{link.slave.name}.TRK_OUT" for link in links})
        if fault is not None:
            yield master.report(
                "TRK_IN",
                None,
                fault.severity,
                loop=master.name,
                role=context.connections.role(master),
                slave=links[0].slave.name,
                found=fault.text,
            )


@error("NX669", CASCADE, "{loop} is {role}: TRK_VAL must be {slave}.PV{scaled}, and is {found}")
def tracking_value_not_slave_pv(context: NextopidContext) -> Findings:
    """A master does not track the PV of its slave.

    Why: while tracking, MV is TRK_VAL. Only if that is the slave's PV does the slave come back to cascade mode without
    a bump; if it is not given, the slave comes back to a set point of 0.

    Fix: wire TRK_VAL to what the slave's PV is wired to, or to the slave's PV itself.
    """
    for master, links in context.connections.masters():
        if any(_tracks_slave_pv(master, link) for link in links):
            continue
        fault = connection_fault(master, "TRK_VAL", set())
        if fault is not None:
            yield master.report(
                "TRK_VAL",
                None,
                fault.severity,
                loop=master.name,
                role=context.connections.role(master),
                slave=links[0].slave.name,
                scaled="" if links[0].is_exact else ", scaled back",
                found=fault.text,
            )


def _tracks_slave_pv(master: BlockView, link: Link) -> bool:
    """Whether TRK_VAL is the slave's PV; behind a scaled set point, whether it is made of it."""
    tracked, pv = master.wire("TRK_VAL"), link.slave.wire("PV")
    if tracked is None:
        return False
    number = master.context.number(link.slave, "PV")
    if not link.is_exact:
        return number in tracked.signals or (pv is not None and bool(tracked.signals & pv.signals))
    return tracked.signal == number or (pv is not None and (tracked.code, tracked.constants) == (pv.code, pv.constants))


@error("NX670", CASCADE, "{loop} is {role}: Windup_{side}_IN must come from {slave}.Windup_{side}_OUT, and is {found}")
def windup_not_connected(context: NextopidContext) -> Findings:
    """A master does not learn that its slave cannot do more.

    Why: while the slave's MV is at a limit, the master's integral runs on, and the way back takes as long. Crossed, the
    integral is stopped in the direction that would help, and winds up in the other. Direct of the slave is in the
    outputs already.

    Fix: wire H to H and L to L.
    """
    for master, links in context.connections.masters():
        for side, other in (("H", "L"), ("L", "H")):
            key = f"Windup_{side}_IN"
            fault = connection_fault(master, key, {f"{link.slave.name}.Windup_{side}_OUT" for link in links})
            if fault is not None:
                is_crossed = master.source(key) in {f"{link.slave.name}.Windup_{other}_OUT" for link in links}
                yield master.report(
                    key,
                    None,
                    fault.severity,
                    loop=master.name,
                    role=context.connections.role(master),
                    slave=links[0].slave.name,
                    side=side,
                    found=f"{fault.text}: crossed" if is_crossed else fault.text,
                )


@warning("NX671", CASCADE, "{loop} is only slave, of {master}: its {key} must be FALSE, and is {found}")
def slave_with_connections_of_a_master(context: NextopidContext) -> Findings:
    """The innermost loop of a cascade has the connections of a master.

    Why: it has no slave. While TRK_IN is TRUE its MV is TRK_VAL, and the process is not controlled; the windup inputs
    stop its integral for no reason of its own.

    Fix: take the wire away.
    """
    for link in context.connections.links:
        if context.connections.role(link.slave) != "only slave":
            continue
        for key in MASTER_INPUTS:
            if link.slave.may_be_on(key):
                wire = link.slave.wire(key)
                state = f"wired to {wire.text}" if wire is not None else "TRUE"
                yield link.slave.report(key, loop=link.slave.name, master=link.master.name, key=key, found=state)


@warning(
    "NX672",
    CASCADE,
    "{master} is only master, of {slave}: its {output} must not be connected, and {reader}.{key} reads it",
)
def outputs_of_a_master_connected(context: NextopidContext) -> Findings:
    """The outputs that are for a master are taken from a loop that has none.

    Why: TRK_OUT of the outermost loop is TRUE all the time, since it is never in cascade mode.

    Fix: take the wire away.
    """
    for master, links in context.connections.masters():
        if context.connections.role(master) != "only master":
            continue
        for output in SLAVE_OUTPUTS:
            number = context.number(master, output)
            for (i, key), wire in context.encoding.wires.items():
                if number in wire.signals and not (key in MASTER_INPUTS and context.connections.role(context.views[i])):
                    yield context.views[i].report(
                        key,
                        master=master.name,
                        slave=links[0].slave.name,
                        output=output,
                        reader=context.views[i].name,
                        key=key,
                    )


@error("NX693", CASCADE, "{master}.TRK_IN is {slave}.TRK_OUT, but {slave}.SP_CASC is {found}, not {master}.MV")
def slave_without_set_point_of_its_master(context: NextopidContext) -> Findings:
    """A loop is told what becomes of its slave, which does not take its set point from it.

    Why: the slave holds a set point of its own, and says that it is in cascade mode. The MV of the master goes nowhere,
    and its integral runs to a limit.

    Fix: wire SP_CASC of the slave to MV of the master; where they are no cascade, take the connections of one away.
    """
    views = {f"{view.name}.TRK_OUT": view for view in context.pids}
    for master in context.pids:
        slave = views.get(master.source("TRK_IN") or "")
        if slave is None or slave is master or slave.is_wired("SP_CASC"):
            continue
        given = slave.is_given("SP_CASC")
        values = {"master": master.name, "slave": slave.name, "found": slave.quote("SP_CASC") if given else "not given"}
        at_slave = slave.report("SP_CASC" if given else "name")
        yield from report_at_both(slave, at_slave, master, master.report("TRK_IN"), **values)


# --- Masters that are not told the truth: behind another block, and of a slave that is in error -----------------------

ERRORS = NEXTOPID.cite("chapter 2: ErrBits")
NON_NEGATIVE_KEYS = ("Td_Kd", "Ti_Ki", "Tfd", "MaxVarMV", "DeadBand")


def indirect_masters(context: NextopidContext, slave: BlockView) -> Iterator[tuple[BlockView, str]]:
    """The loops whose MV reaches a set point through blocks, each with the block that the slave reads."""
    first = slave.wire("SP_CASC")
    direct_signals = frozenset() if first is None else first.signals
    for start in sorted(direct_signals):
        block = context.owner(start)
        if block is None or block[0].is_pid:
            continue
        pending, visited = [start], {start}
        while pending:
            number = pending.pop()
            master = context.pid_output(number)
            if master is not None and number not in direct_signals and master.number != slave.number:
                yield master, block[0].name
            fresh = dependencies_of(context.encoding, number) - visited
            visited |= fresh
            pending += sorted(fresh)


@warning(
    "NX684",
    CASCADE,
    "{master}.MV is the set point of {slave} through {block}, and {missing} of {master} {verb} not wired",
)
def master_behind_a_block_not_connected(context: NextopidContext) -> Findings:
    """A master that reaches its slave through another block does not learn what becomes of it.

    Why: with a selector or a filter between them it is a cascade all the same. While the slave is at a limit, or does
    not follow, the integral of the master runs on, and the way back takes as long.

    Fix: wire TRK_IN to TRK_OUT of the slave, and Windup_H_IN and Windup_L_IN to its windup outputs; behind a selector
    also OVERR and TRK_VAL.
    """
    reported: set[tuple[int, int]] = set()
    for slave in context.pids:
        for master, block in indirect_masters(context, slave):
            missing = [key for key in MASTER_INPUTS if not master.is_wired(key)]
            if missing and (master.number, slave.number) not in reported:
                reported.add((master.number, slave.number))
                yield master.report(
                    missing[0],
                    master=master.name,
                    slave=slave.name,
                    block=block,
                    missing=", ".join(missing),
                    verb="are" if missing[1:] else "is",
                )


def first_error_bit(view: BlockView) -> str | None:
    """The first error bit that a controller sets in its first call, as far as its values are known."""
    for bit, low, high in (("MaxMinMV", "MinMV", "MaxMV"), ("MaxMinPV", "MinPV", "MaxPV")):
        ends = view.number_of(low), view.number_of(high)
        if ends[0] is not None and ends[1] is not None and ends[1] <= ends[0]:
            return bit
    gain = view.number_of("Kp")
    if gain is not None and (gain < 0 or (gain == 0 and view.is_on("Indep") is False)):
        return "Kp"
    for key in NON_NEGATIVE_KEYS:
        value = view.number_of(key)
        if value is not None and value < 0:
            return key
    return "SampleTime" if view.sample_time > MAX_SAMPLE_TIME else None


@warning(
    "NX685",
    ERRORS,
    "{slave} is in error from its first call; its TRK_OUT stays FALSE, and {master} believes that it follows",
)
def slave_in_error(context: NextopidContext) -> Findings:
    """The slave of a cascade is not executed, and does not say so to its master.

    Why: a block with an error bit keeps its outputs, and TRK_OUT begins as FALSE, which means that the slave follows.
    The master does not track: its integral runs to a limit, and MV of the slave is 0.

    Fix: correct the parameter of the slave; in the program, let its ErrBits reach the operator.
    """
    for link in context.connections.links:
        bit = first_error_bit(link.slave)
        if bit is not None and link.master.number != link.slave.number:
            yield link.slave.report(
                "SP_CASC", f"{link.slave.name}.ErrBits.{bit}", slave=link.slave.name, master=link.master.name
            )


# --- Overrides, and feed-forward through BIAS -------------------------------------------------------------------------

OVERRIDE = NEXTOPID.cite("chapter 16: Override Configurations")
SELECTOR = NEXTOPID.cite("chapters 13 and 14: MV1, MV2")
BIAS = NEXTOPID.cite("chapter 2: BIAS")

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
    for selector, first, second in context.connections.overrides():
        if first.loop is second.loop:
            yield selector.report("MV2", selector=selector.name, loop=first.loop.name)


@error("NX676", OVERRIDE, "OVERR of {loop}, {input} of {selector}, must come from {selector}.{output}, and is {found}")
def override_not_connected(context: NextopidContext) -> Findings:
    """A loop does not learn that another one has the valve.

    Why: its integral winds up while the other loop controls; when it is needed, it comes late. Crossed, the loop that
    controls is treated as overridden, and the other one winds up.

    Fix: wire OVERR of the loop at MV1 to OVERR1, and of the one at MV2 to OVERR2.
    """
    for inputs in context.connections.inputs_by_loop.values():
        connection = inputs[0]
        fault = connection_fault(
            connection.loop, "OVERR", {f"{other.selector.name}.OVERR{other.number}" for other in inputs}
        )
        if fault is not None:
            is_crossed = connection.loop.source("OVERR") == f"{connection.selector.name}.OVERR{3 - connection.number}"
            yield connection.loop.report(
                "OVERR",
                None,
                fault.severity,
                loop=connection.loop.name,
                input=f"MV{connection.number}",
                selector=connection.selector.name,
                output=f"OVERR{connection.number}",
                found=f"{fault.text}: crossed" if is_crossed else fault.text,
            )


@error("NX677", OVERRIDE, "TRK_VAL of {loop}, overridden by {selector}, must be {selector}.MV, and is {found}")
def override_value_not_selected_mv(context: NextopidContext) -> Findings:
    """An overridden loop does not know the MV that controls in its stead.

    Why: its integral is calculated back to TRK_VAL. If that is not the selected MV the loop comes back with a bump, or
    takes the valve when it should not.

    Fix: wire TRK_VAL to MV of the selector; not to MV of the other loop, which may be overridden itself.
    """
    for inputs in context.connections.inputs_by_loop.values():
        connection = inputs[0]
        wanted = set().union(*(context.connections.downstream_outputs(other.selector) for other in inputs))
        fault = connection_fault(connection.loop, "TRK_VAL", wanted)
        wire = connection.loop.wire("TRK_VAL")
        reads = wire is not None and {context.names[number] for number in wire.signals} & wanted
        if fault is not None and not (reads and not connection.is_exact):
            yield connection.loop.report(
                "TRK_VAL",
                None,
                fault.severity,
                loop=connection.loop.name,
                selector=connection.selector.name,
                found=fault.text,
            )


@info("NX678", D219, "{selector} holds PV of {first} {side} its SP and PV of {second} {other_side}: Direct differs")
def selector_of_opposite_loops(context: NextopidContext) -> Findings:
    """Two loops that act in opposite directions share a valve.

    Why: the smaller MV keeps PV of a reverse loop at or below its set point, and PV of a direct loop at or above; the
    larger MV the other way round. It is right for suction and discharge pressure, and wrong for two temperatures of a
    heater.

    Fix: check that opening the valve moves the two PVs in opposite directions.
    """
    for selector, first, second in context.connections.overrides():
        modes = first.loop.is_on("Direct"), second.loop.is_on("Direct")
        if None not in modes and modes[0] != modes[1]:
            smaller = selector.type == "ControlSelectMin"
            sides = ["above" if bool(mode) == smaller else "below" for mode in modes]
            values = {"selector": selector.name, "first": first.loop.name, "second": second.loop.name}
            values |= {"side": sides[0], "other_side": sides[1]}
            at_first, at_second = first.loop.report("Direct"), second.loop.report("Direct")
            yield from report_at_both(first.loop, at_first, second.loop, at_second, **values)


@warning("NX679", OVERRIDE, "{selector} compares MV of {first} ({limits}) with MV of {second} ({others})")
def override_limits_differ(context: NextopidContext) -> Findings:
    """Two loops of an override have different limits of MV.

    Why: both move the same valve. The selector compares their numbers: with other limits, or another scale, one of them
    is selected because its range ends, not because its process asks for it.

    Fix: give both loops the same MinMV and MaxMV.
    """
    for selector, first, second in context.connections.overrides():
        one, other = first.loop.mv_limits, second.loop.mv_limits
        if one and other and one != other and first.is_exact and second.is_exact:
            key = "MinMV" if one[0] != other[0] else "MaxMV"
            ranges = {"limits": _mv_range_text(first.loop), "others": _mv_range_text(second.loop)}
            values = {"selector": selector.name, "first": first.loop.name, "second": second.loop.name, **ranges}
            yield from report_at_both(
                first.loop, first.loop.report(key), second.loop, second.loop.report(key), **values
            )


def _mv_range_text(loop: BlockView) -> str:
    return f"{loop.quote('MinMV')} to {loop.quote('MaxMV')}"


@warning("NX680", D218, "OVERR is {found}, but {what}")
def override_without_selector(context: NextopidContext) -> Findings:
    """A loop is overridden by nothing.

    Why: while OVERR is TRUE the integral is calculated back to TRK_VAL, which is 0 when it is not given. The loop then
    behaves like a proportional one, or follows a selector that it is not part of.

    Fix: wire MV of the loop to the selector, or take OVERR away; with a selector of your own give TRK_VAL its MV.
    """
    for view in context.pids:
        if view.number in context.connections.inputs_by_loop or not view.may_be_on("OVERR"):
            continue
        wire = view.wire("OVERR")
        owner = None if wire is None or wire.signal is None else context.owner(wire.signal)
        state = "TRUE" if wire is None else f"wired to {wire.text}"
        if owner is not None and owner[0].type in SELECTORS:
            what = f"{owner[0].name} does not read {view.name}.MV"
            yield view.report("OVERR", None, Severity.ERROR, found=state, what=what)
        elif not view.is_given("TRK_VAL"):
            yield view.report("OVERR", found=state, what="TRK_VAL, the MV that controls instead, is not given")


@checklist("NX681", D219, "{loop} has no integral: OVERR and TRK_VAL change nothing in it")
def override_without_integral(context: NextopidContext) -> Findings:
    """A loop of an override has no integral.

    Why: override works on the integral alone. Without one the loop takes the valve at a fixed distance from its set
    point, which may be what is wanted of a limiter.

    Fix: see that a loop without an integral is meant; otherwise give Ti_Ki.
    """
    for inputs in context.connections.inputs_by_loop.values():
        loop = inputs[0].loop
        if loop.integral == 0:
            yield loop.report("Ti_Ki", loop=loop.name)


@per_pid
@info("NX682", BIAS, "BIAS is added to MV as it is: Direct TRUE does not turn its sign")
def bias_of_a_direct_loop(view: BlockView) -> Findings:
    """A loop with direct control has a feed-forward.

    Why: Direct negates the actions of the loop, not BIAS. A feed-forward that was calculated for the other sign doubles
    the disturbance.

    Fix: check that a disturbance that needs more MV raises BIAS.
    """
    if view.is_wired("BIAS") and view.is_on("Direct"):
        yield view.report("BIAS")


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
            yield view.report(
                "BIAS",
                source=f"{owner[0].name}.OutVar",
                low=number_text(low),
                high=number_text(high),
                limits=_mv_range_text(view),
            )
