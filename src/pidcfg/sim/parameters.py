"""From the numbers of a plant, as the scenario gives them and events replace them, to the coefficients of its step."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.sim.plants import INTEGRATOR, LEAD_LAG, SECOND_ORDER, VALVE, Plant, lag, second_order

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.scenario import Plant as PlantText


def numbers_of(text: PlantText) -> dict[str, float]:
    """The numbers of a plant by key, as a ``disturb`` event may replace them."""
    fields = text.model_dump(exclude={"name", "model", "input", "time_constants", "limits", "dead_time", "initial"})
    numbers = {key: float(value) for key, value in fields.items() if value is not None}
    if text.time_constants is not None:
        numbers["first"], numbers["second"] = (float(t) for t in text.time_constants)
    if text.limits is not None:
        numbers["low"], numbers["high"] = (float(end) for end in text.limits)
    return numbers


def set_parameters(plant: Plant, numbers: Mapping[str, float], dt: float) -> None:
    """Writes a plant's numbers and works out the coefficients of its exact step of ``dt`` seconds."""
    plant.gain, plant.load, plant.sigma = numbers["gain"], numbers["load"], numbers["noise"]
    plant.low, plant.high = numbers.get("low", plant.low), numbers.get("high", plant.high)
    if plant.model == INTEGRATOR:
        plant.a = dt
    elif plant.model == SECOND_ORDER:
        if "first" in numbers:
            squared, damped = numbers["first"] * numbers["second"], numbers["first"] + numbers["second"]
        else:
            squared, damped = numbers["time_constant"] ** 2, 2 * numbers["damping"] * numbers["time_constant"]
        plant.a, plant.b, plant.c, plant.d = second_order(dt, squared, damped)
    elif plant.model == LEAD_LAG:
        plant.a, plant.b = lag(dt, numbers["lag"]), numbers["lead"] / numbers["lag"]
    elif plant.model == VALVE:
        plant.a, plant.b = numbers.get("rate_limit", plant.high) * dt, numbers["stiction"]
    elif "time_constant" in numbers:
        plant.a = lag(dt, numbers["time_constant"])
