"""Events that write what is already there: nothing happens, so that they explain nothing of what a run shows.

Design. What an event writes is tried beforehand, in the order of the events, on a PLC that does not run. What the PLC
itself writes while it runs (an output, a set point that follows the PV in Manual, gains after an auto-tune) is never
taken for idle.
"""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING, Any

from pidcfg.paths import dotted, leaves
from pidcfg.schemas.numbers import parse_number
from pidcfg.sim.parameters import numbers_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.schemas.scenario import Event, Scenario
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc

LIVE = ("output", "bias", "MV", "MOUT", "I_MV", "ManualMV")
"""Keys of a loop that the PLC overwrites while it controls."""


def idle_events(scenario: Scenario, new_plc: Callable[[], Plc], net: Network) -> list[Event]:
    """The events of a scenario that has no errors which change nothing."""
    trial = _Trial(new_plc, net, scenario)
    return [event for event in sorted(scenario.events, key=lambda event: event.at) if not trial.changes(event)]


class _Trial:
    """What stands where, as far as events have written it."""

    def __init__(self, new_plc: Callable[[], Plc], net: Network, scenario: Scenario) -> None:
        self.new_plc, self.net = new_plc, net
        self.plc: Plc | None = None
        self.sig: list[float] = []
        self.numbers = {name: numbers_of(text) for name, (_, text) in net.texts.items()}
        self.signals: dict[str, float] = {name: net.sig[slot] for name, slot in net.outside.items()}
        self.signals |= {name: float(value) for name, value in scenario.signals.items()}
        self.live: set[str | None] = set()
        """Loops whose parameters the PLC may have written itself; None: all."""
        self.running = True

    def changes(self, event: Event) -> bool:
        """Whether anything is otherwise after an event."""
        if event.disturb is not None:
            return _renews(self.numbers[event.plant or event.loop or ""], event.disturb)
        if event.set is None:
            return self._switches(event)
        if event.loop is not None:
            return self._writes(event.loop, event.set)
        return _renews(self.signals, {dotted(keys): self._input(keys, value) for keys, value, _ in leaves(event.set)})

    def _switches(self, event: Event) -> bool:
        """Whether an event may change a mode: the CPU's, or that of a loop, which only the run can tell."""
        was = self.running
        if event.plc is not None:
            self.running = event.plc == "run"
            if self.running == was:
                return False
        self.live.add(event.loop)
        return True

    def _input(self, keys: tuple[str, ...], value: object) -> float:
        """The value of a signal as an event gives it."""
        self.plc = self.plc or self.new_plc()
        name = dotted(keys)
        return self.plc.check_input(name, value) if name in self.plc.inputs else float(parse_number(value))

    def _writes(self, loop: str, values: dict[str, Any]) -> bool:
        """Whether parameters of a loop become others."""
        if self.plc is None or not self.sig:
            self.plc = self.plc or self.new_plc()
            self.sig = list(self.plc.sig)
        plc, i, changed = self.plc, self.plc.loops.index(loop), bool(self.live & {loop, None})
        for keys, value, _ in leaves(values):
            before = copy(plc.cfg[i]), copy(plc.st[i]), list(plc.aux), list(self.sig)
            plc.set(i, keys, plc.check_set(i, keys, value), self.sig)
            changed |= dotted(keys) in LIVE or before != (plc.cfg[i], plc.st[i], list(plc.aux), self.sig)
        return changed


def _renews(present: dict[str, float], new: Any) -> bool:
    """Writes numbers into those that are there; whether one of them is another now."""
    changed = any(present.get(key) != float(value) for key, value in new.items())
    present |= {key: float(value) for key, value in new.items()}
    return changed
