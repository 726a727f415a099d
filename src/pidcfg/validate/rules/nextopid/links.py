"""How controllers hang together: masters and slaves of cascades, and the selectors of overrides."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.diagnostics import Severity
from pidcfg.refs import Decision
from pidcfg.validate.rules.nextopid.paths import SELECTORS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.validate.rules.nextopid.context import BlockView, NextopidContext

D218 = Decision(
    218, "what a cascade and an override are",
    "A loop whose SP_CASC reads the MV of another is the slave of that one; a loop whose MV is read by a selector is "
    "overridden by it. A special connection that is missing, crossed or of another loop is an error, one that comes "
    "from a signal a warning. SP_CASC wired to anything else is ratio control, of which nothing is demanded.",
    "The manual says which connections must be made; a signal may be logic of the program around, as the OR of two.",
)  # fmt: skip


class Link(NamedTuple):
    """A cascade: the slave, its master, and whether the set point is the master's MV as it is, not a term of it."""

    slave: BlockView
    master: BlockView
    exact: bool


class Leg(NamedTuple):
    """A loop at a selector: which of its inputs, and whether MV goes there as it is."""

    selector: BlockView
    number: int
    loop: BlockView
    exact: bool


class Fault(NamedTuple):
    """A special connection that is not as it must be: what it is instead, and how bad that is."""

    text: str
    severity: Severity


def links(context: NextopidContext) -> list[Link]:
    """All cascades, slave by slave."""
    found = []
    for slave in context.pids:
        expression = slave.wire("SP_CASC")
        for number in sorted(expression.signals) if expression is not None else ():
            master = context.pid_output(number)
            if expression is not None and master is not None:
                found.append(Link(slave, master, expression.signal is not None))
    return found


def slaves_of(context: NextopidContext) -> Iterator[tuple[BlockView, list[Link]]]:
    """The masters, each with its slaves; what is its own master is none."""
    table = [link for link in links(context) if link.slave is not link.master]
    for view in context.pids:
        own = [link for link in table if link.master is view]
        if own:
            yield view, own


def role_of(context: NextopidContext, view: BlockView) -> str:
    """The part that a loop has in cascades: ``only master``, ``slave and master``, ``only slave``; or empty."""
    table = links(context)
    is_slave = any(link.slave is view for link in table)
    if any(link.master is view for link in table):
        return "slave and master" if is_slave else "only master"
    return "only slave" if is_slave else ""


def legs(context: NextopidContext) -> list[Leg]:
    """All loops whose MV a selector reads."""
    found = []
    for selector in context.of(*SELECTORS):
        for n in (1, 2):
            expression = selector.wire(f"MV{n}")
            for number in sorted(expression.signals) if expression is not None else ():
                loop = context.pid_output(number)
                if expression is not None and loop is not None:
                    found.append(Leg(selector, n, loop, expression.signal is not None))
    return found


def behind(context: NextopidContext, selector: BlockView) -> set[str]:
    """The names of the MV that a selector, or one behind it, selects."""
    found, waiting = set(), [selector]
    while waiting:
        name = f"{waiting.pop().name}.MV"
        if name not in found:
            found.add(name)
            waiting += [own for own in context.of(*SELECTORS) if name in {own.source("MV1"), own.source("MV2")}]
    return found


def fault_of(view: BlockView, key: str, wanted: set[str]) -> Fault | None:
    """What is wrong with a connection that must come from one of some names; a wire without meaning is none of ours."""
    if not view.is_wired(key):
        value = view.known(key)
        text = f"{view.shown(key)}, not wired" if view.given(key) and value is not None else "not wired"
        return Fault(text, Severity.ERROR)
    expression = view.wire(key)
    if expression is None or view.source(key) in wanted:
        return None
    is_signal = expression.signal is not None and view.context.owner(expression.signal) is None
    return Fault(f"wired to {expression.text}", Severity.WARNING if is_signal else Severity.ERROR)
