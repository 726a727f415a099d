"""Plants at rest before time begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.expressions import evaluate
from pidcfg.sim.plants import settle_at

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.sim.network import Network


def rest(net: Network, initial: Sequence[float | None]) -> None:
    """Every plant at rest at its initial value (by plant; None: where its input holds it), in order of dependence."""
    stack = net.pool.stack()
    for plant, value in zip(net.plants, initial, strict=True):
        if plant.source >= 0:
            u = net.sig[plant.source]
        else:
            u = evaluate(net.pool.code, net.pool.constants, plant.first, plant.last, net.sig, stack)
        settle_at(plant, value, u, net.delay)
        net.sig[plant.slot] = net.sig[plant.measured] = plant.y


def initial_values(net: Network) -> list[float | None]:
    """The initial values as the scenario gives them, in the order of the plants."""
    values = [net.texts[name][1].initial for name in net.plant_of]
    return [None if value is None else float(value) for value in values]
