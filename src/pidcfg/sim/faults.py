"""Expressions of a run that had no value, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.expressions import FAULTS
from pidcfg.sim.plc import TICKS
from pidcfg.sim.report import Note, rounded

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.network import Network
    from pidcfg.sim.plc import Plc


def faults(scenario: Scenario, plc: Plc, net: Network, step: int, zero: int) -> Iterator[Note]:
    """A note for each expression, with the first time; ``step`` in ticks, time 0 is base step ``zero``."""

    def time(k: int) -> float:
        return rounded(max(0, k - zero) * step / TICKS)

    named = {at: name for name, at in net.plant_of.items()}
    for i, plant in enumerate(net.plants):
        if plant.fault:
            text = str(net.texts[named[i]][1].input)
            yield _fault(time(plant.fault_at), plant.fault, f"input of {named[i]}", text)
    for i, channel in enumerate(net.channels):
        if channel.fault:
            key = str(net.sources[i][-1])
            yield _fault(time(channel.fault_at), channel.fault, key, scenario.connect[key])
    for tick, name, why in plc.faults():
        message = f"the wire of {name} has no value ({why}); it kept the one that it had"
        yield Note(time(tick // step), None, message, error=True)


def _fault(time: float, fault: int, what: str, text: str) -> Note:
    return Note(time, None, f"{what}: {FAULTS[fault]} in {text!r}; the signal kept its last value", error=True)
