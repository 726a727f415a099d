"""How controllers hang together: masters and slaves of cascades, and the selectors of overrides."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from pidcfg.diagnostics import Severity
from pidcfg.refs import Decision
from pidcfg.validate.rules.nextopid.paths import SELECTORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.validate.rules.nextopid.program import BlockView, Program

D218 = Decision(
    218,
    "what a cascade and an override are",
    "A loop whose SP_CASC reads the MV of another is the slave of that one; a loop whose MV is read by a selector is "
    "overridden by it. A special connection that is missing, crossed or of another loop is an error, one that comes "
    "from a signal a warning. SP_CASC wired to anything else is ratio control, of which nothing is demanded.",
    "The manual says which connections must be made; a signal may be logic of the program around, as the OR of two.",
)


Row = TypeVar("Row")


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


class Network:
    """All cascades and overrides of a configuration."""

    def __init__(self, context: Program) -> None:
        self.context = context
        self.links = list(self._links())
        self.legs = list(self._legs())
        self.links_of_master = _grouped(self.links, lambda link: link.master.number)
        self.links_of_slave = _grouped(self.links, lambda link: link.slave.number)
        self.legs_of_loop = _grouped(self.legs, lambda leg: leg.loop.number)
        self.legs_of_selector = _grouped(self.legs, lambda leg: leg.selector.number)

    def _links(self) -> Iterator[Link]:
        for slave in self.context.pids:
            expression = slave.wire("SP_CASC")
            for number in sorted(expression.signals) if expression is not None else ():
                master = self.context.pid_output(number)
                if expression is not None and master is not None:
                    yield Link(slave, master, expression.signal is not None)

    def _legs(self) -> Iterator[Leg]:
        for selector in self.context.of(*SELECTORS):
            for n in (1, 2):
                expression = selector.wire(f"MV{n}")
                for number in sorted(expression.signals) if expression is not None else ():
                    loop = self.context.pid_output(number)
                    if expression is not None and loop is not None:
                        yield Leg(selector, n, loop, expression.signal is not None)

    def masters(self) -> Iterator[tuple[BlockView, list[Link]]]:
        """The masters, each with its slaves; what is its own master is none."""
        for number, links in self.links_of_master.items():
            slaves = [link for link in links if link.slave.number != number]
            if slaves:
                yield slaves[0].master, slaves

    def role(self, view: BlockView) -> str:
        """A loop's part in cascades: ``only master``, ``slave and master``, ``only slave``; or empty."""
        is_slave = view.number in self.links_of_slave
        if view.number in self.links_of_master:
            return "slave and master" if is_slave else "only master"
        return "only slave" if is_slave else ""

    def pairs(self) -> Iterator[tuple[BlockView, Leg, Leg]]:
        """The selectors that have one loop at each input."""
        for legs in self.legs_of_selector.values():
            if [leg.number for leg in legs] == [1, 2]:
                yield legs[0].selector, legs[0], legs[1]

    @cached_property
    def _next(self) -> dict[str, list[str]]:
        """The MV of the selectors that read a name."""
        readers: dict[str, list[str]] = defaultdict(list)
        for selector in self.context.of(*SELECTORS):
            for source in (selector.source("MV1"), selector.source("MV2")):
                if source is not None:
                    readers[source].append(f"{selector.name}.MV")
        return readers

    def behind(self, selector: BlockView) -> set[str]:
        """The names of the MV that a selector, or one behind it, selects."""
        names: set[str] = set()
        waiting = [f"{selector.name}.MV"]
        while waiting:
            name = waiting.pop()
            if name not in names:
                names.add(name)
                waiting += self._next.get(name, [])
        return names


def _grouped(rows: list[Row], key: Callable[[Row], int]) -> dict[int, list[Row]]:
    groups: dict[int, list[Row]] = {}
    for row in rows:
        groups.setdefault(key(row), []).append(row)
    return groups


def fault_of(view: BlockView, key: str, wanted: set[str]) -> Fault | None:
    """What is wrong with a connection that must come from one of some names; not of a meaningless wire."""
    if not view.is_wired(key):
        value = view.known(key)
        text = f"{view.shown(key)}, not wired" if view.is_given(key) and value is not None else "not wired"
        return Fault(text, Severity.ERROR)
    expression = view.wire(key)
    if expression is None or view.source(key) in wanted:
        return None
    is_signal = expression.signal is not None and view.context.owner(expression.signal) is None
    return Fault(f"wired to {expression.text}", Severity.WARNING if is_signal else Severity.ERROR)
