"""The special connections of a cascade, by the part that a loop has in it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID
from pidcfg.validate.rule import Findings, error, warning
from pidcfg.validate.rules.nextopid.links import Link, fault_of

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

CASCADE = NEXTOPID.at("chapter 16: Cascade Configurations, Special Connections")
MASTER_INPUTS = ("TRK_IN", "Windup_H_IN", "Windup_L_IN")
SLAVE_OUTPUTS = ("TRK_OUT", "Windup_H_OUT", "Windup_L_OUT")


@error("NX668", CASCADE, "{loop} is {role}: TRK_IN must come from {slave}.TRK_OUT, and is {found}")
def tracking_not_connected(context: NextopidContext) -> Findings:
    """A master does not learn when its slave leaves it.

    Why: while the slave is in manual or follows its own SP, the master's integral runs to a limit. When the slave comes
    back, it gets that as its set point.

    Fix: wire TRK_IN to TRK_OUT of the slave.
    """
    for master, links in context.network.masters():
        fault = fault_of(master, "TRK_IN", {f"{link.slave.name}.TRK_OUT" for link in links})
        if fault is not None:
            yield master.at(
                "TRK_IN",
                None,
                fault.severity,
                loop=master.name,
                role=context.network.role(master),
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
    for master, links in context.network.masters():
        if any(_tracks(master, link) for link in links):
            continue
        fault = fault_of(master, "TRK_VAL", set())
        if fault is not None:
            yield master.at(
                "TRK_VAL",
                None,
                fault.severity,
                loop=master.name,
                role=context.network.role(master),
                slave=links[0].slave.name,
                scaled="" if links[0].exact else ", scaled back",
                found=fault.text,
            )


def _tracks(master: BlockView, link: Link) -> bool:
    """Whether TRK_VAL is the slave's PV; behind a scaled set point, whether it is made of it."""
    tracked, pv = master.wire("TRK_VAL"), link.slave.wire("PV")
    if tracked is None:
        return False
    number = master.context.number(link.slave, "PV")
    if not link.exact:
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
    for master, links in context.network.masters():
        for side, other in (("H", "L"), ("L", "H")):
            key = f"Windup_{side}_IN"
            fault = fault_of(master, key, {f"{link.slave.name}.Windup_{side}_OUT" for link in links})
            if fault is not None:
                crossed = master.source(key) in {f"{link.slave.name}.Windup_{other}_OUT" for link in links}
                yield master.at(
                    key,
                    None,
                    fault.severity,
                    loop=master.name,
                    role=context.network.role(master),
                    slave=links[0].slave.name,
                    side=side,
                    found=f"{fault.text}: crossed" if crossed else fault.text,
                )


@warning("NX671", CASCADE, "{loop} is only slave, of {master}: its {key} must be FALSE, and is {found}")
def slave_with_connections_of_a_master(context: NextopidContext) -> Findings:
    """The innermost loop of a cascade has the connections of a master.

    Why: it has no slave. While TRK_IN is TRUE its MV is TRK_VAL, and the process is not controlled; the windup inputs
    stop its integral for no reason of its own.

    Fix: take the wire away.
    """
    for link in context.network.links:
        if context.network.role(link.slave) != "only slave":
            continue
        for key in MASTER_INPUTS:
            if link.slave.may_be_on(key):
                wire = link.slave.wire(key)
                state = f"wired to {wire.text}" if wire is not None else "TRUE"
                yield link.slave.at(key, loop=link.slave.name, master=link.master.name, key=key, found=state)


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
    for master, links in context.network.masters():
        if context.network.role(master) != "only master":
            continue
        for output in SLAVE_OUTPUTS:
            number = context.number(master, output)
            for (i, key), wire in context.encoding.wires.items():
                if number in wire.signals and not (key in MASTER_INPUTS and context.network.role(context.views[i])):
                    yield context.views[i].at(
                        key,
                        master=master.name,
                        slave=links[0].slave.name,
                        output=output,
                        reader=context.views[i].name,
                        key=key,
                    )
