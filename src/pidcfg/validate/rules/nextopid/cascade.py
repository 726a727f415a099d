"""Cascades: who is whose master, and what master and slave have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.refs import NEXTOPID
from pidcfg.validate.ideas.cascades import rings
from pidcfg.validate.ideas.duplicates import at_both, in_words
from pidcfg.validate.rule import Findings, error, info, per_pid, warning
from pidcfg.validate.rules.nextopid.links import D218
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.validate.rules.nextopid.context import NextopidContext
    from pidcfg.validate.rules.nextopid.program import BlockView

CASCADE = NEXTOPID.at("chapter 16: Cascade Configurations, Special Connections")
CASC = NEXTOPID.at("chapter 2: CASC")
LIMITS = NEXTOPID.at("chapter 2: MaxPV, WarnBits")
MOST_NAMES = 5
HINTS = NEXTOPID.at("chapter 17: Hints for Tuning PID in Cascade Configuration")


@error("NX662", D218, "{name} is its own master: {way}")
def cascade_in_a_circle(context: NextopidContext) -> Findings:
    """Loops take their set points from each other in a circle.

    Why: nobody says what any of them is to hold; their MVs drift to a limit.

    Fix: wire SP_CASC of the outermost loop to something else, or leave it out.
    """
    masters = {link.slave.number: link.master.number for link in context.network.links}
    for ring in rings([masters.get(view.number) for view in context.views]):
        names = [context.views[i].name for i in ring]
        circle = [*names, names[0]]
        way = " follows ".join(circle if len(circle) <= MOST_NAMES else [*circle[:MOST_NAMES], "…"])
        for view in (context.views[i] for i in ring):
            finding = view.at("SP_CASC", name=view.name, way=way)
            yield finding.shared_with(*(name for name in names if name != view.name))


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
    for links in context.network.links_of_slave.values():
        masters, view = [link.master for link in links], links[0].slave
        if len(masters) > 1:
            names = [master.name for master in masters]
            values = {"slave": view.name, "masters": in_words(names)}
            yield view.at("SP_CASC").quoting(**values).shared_with(*names)
            for master in masters:
                yield master.at("name").quoting(**values).shared_with(view.name)


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
    for master, links in context.network.masters():
        if len(links) > 1:
            names = [link.slave.name for link in links]
            values = {"master": master.name, "slaves": in_words(names)}
            yield master.at("name").quoting(**values).shared_with(*names)
            for link in links:
                yield link.slave.at("SP_CASC").quoting(**values).shared_with(master.name)


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
            role = context.network.role(view)
            yield view.at("CASC", loop=view.name, role=f" ({role})" if "slave" in role else "", source=expression.text)


@per_pid
@error("NX666", CASC, "CASC is {value}, but SP_CASC is not given: the set point is 0{unit}")
def cascade_mode_without_set_point(view: BlockView) -> Findings:
    """Cascade mode can be switched on, and nothing gives the set point.

    Why: with CASC TRUE the set point is SP_CASC, which is 0 when it is not given.

    Fix: wire SP_CASC, or remove CASC.
    """
    if not view.is_given("SP_CASC") and view.may_be_on("CASC"):
        value = "wired" if view.is_wired("CASC") else "TRUE"
        yield view.at("CASC", value=value, unit=view.unit("SP"))


@warning("NX667", CASCADE, "{loop} is only master, of {slave}: its CASC must be FALSE, and is {value}")
def master_in_cascade_mode(context: NextopidContext) -> Findings:
    """The outermost loop of a cascade can be in cascade mode.

    Why: its set point comes from the operator, as SP. In cascade mode it follows SP_CASC, which no loop gives.

    Fix: remove CASC. If SP_CASC is a ratio on purpose, leave it.
    """
    for master, links in context.network.masters():
        if master.may_be_on("CASC") and master.is_given("SP_CASC") and context.network.role(master) == "only master":
            value = "wired" if master.is_wired("CASC") else "TRUE"
            yield master.at("CASC", loop=master.name, slave=links[0].slave.name, value=value)


@warning("NX673", LIMITS, "{parameter} {mine} of the master {master} is beyond {limit} {theirs} of its slave {slave}")
def master_range_beyond_slave(context: NextopidContext) -> Findings:
    """A master can ask its slave for more than the slave takes.

    Why: MV of the master is the set point of the slave, which is limited to MinPV..MaxPV of the slave. Beyond that the
    master moves and nothing happens: its integral winds up, and no windup output tells it.

    Fix: give the master the slave's MinPV and MaxPV, or less, as MinMV and MaxMV.
    """
    for link in context.network.links:
        for key, limit, way in (("MinMV", "MinPV", -1), ("MaxMV", "MaxPV", 1)):
            mv, pv = link.master.number_of(key), link.slave.number_of(limit)
            if mv is None or pv is None or link.master.mv_limits is None or link.slave.pv_limits is None:
                continue
            if link.exact and (mv - pv) * way > 0:
                effect = f"{link.slave.name}.WarnBits.SP_CASC_{limit}"
                shown = {"mine": link.master.shown(key), "limit": limit, "theirs": link.slave.shown(limit)}
                names = {"parameter": key, "master": link.master.name, "slave": link.slave.name}
                at_master, at_slave = link.master.at(key, effect), link.slave.at(limit, effect)
                yield from at_both(link.master, at_master, link.slave, at_slave, **shown, **names)


@warning("NX674", HINTS, "the slave {slave} is calculated every {time} s, its master {master} every {other} s")
def slave_slower_than_master(context: NextopidContext) -> Findings:
    """A slave is calculated less often than its master.

    Why: for the master the slave is part of the process, and the faster part. A slave that does not even see every new
    set point is dead time.

    Fix: give the slave the shorter sample time.
    """
    for link in context.network.links:
        if link.slave.sample_time > link.master.sample_time:
            times = {"time": number_text(link.slave.sample_time), "other": number_text(link.master.sample_time)}
            values = {"slave": link.slave.name, "master": link.master.name, **times}
            at_slave, at_master = link.slave.at("sample_time"), link.master.at("sample_time")
            yield from at_both(link.slave, at_slave, link.master, at_master, **values)
