"""Two neutral loops made comparable: one scale of the output, one way to say what has no proportional action."""

from __future__ import annotations

from decimal import Decimal
from typing import Any

from pydantic import BaseModel

from pidcfg.conversion.arithmetic import product, quotient, rescaled, rounded, width
from pidcfg.schemas.base import Quantity

Flat = dict[str, Any]
"""The values of a loop by path, as `flat` gives them."""
ENDS = ("output.range.0", "output.range.1")
ON_THE_SCALE = ("output.limits.0", "output.limits.1", "output.bias", "output.manual")


def flat(model: Any, prefix: str = "") -> dict[str, Any]:
    """Every value of a neutral loop by its path; limits that are not given are the ends of their range."""
    values: dict[str, Any] = {}
    for name in type(model).model_fields:
        value, path = getattr(model, name), f"{prefix}{name}"
        if isinstance(value, BaseModel):
            values |= flat(value, f"{path}.")
        elif isinstance(value, tuple):
            values |= {f"{path}.{k}": end for k, end in enumerate(value)}
        elif value is not None:
            values[path] = value
    if not prefix:
        for limits, whole in (("setpoint.limits", "pv.range"), ("output.limits", "output.range")):
            for end in ("0", "1"):
                values.setdefault(f"{limits}.{end}", values[f"{whole}.{end}"])
    return values


def normal(loop: Flat) -> Flat:
    """Without a proportional action the gain is 1, and the times make up for it; no derivative acts on nothing."""
    values = dict(loop)
    gain = values["tuning.gain"]
    if not values["tuning.proportional"] and gain:
        values["tuning.gain"] = Decimal(1)
        values["tuning.integral_time"] = rounded(quotient(values["tuning.integral_time"], gain))
        values["tuning.derivative_time"] = rounded(product(values["tuning.derivative_time"], gain))
    if not values["tuning.derivative_time"]:
        for key in ("tuning.derivative_on", "tuning.derivative_filter"):
            values.pop(key, None)
    return values


def on_the_same_scale(one: Flat, two: Flat) -> Flat:
    """The second loop with its output on the scale of the first: a vendor may know its output in % only."""
    first, second = ([Decimal(loop[end]) for end in ENDS] for loop in (one, two))
    if first == second:
        return two
    values = dict(two)
    factor = quotient(width(first), width(second))
    values["tuning.gain"] = rounded(product(values["tuning.gain"], factor))
    for key in ON_THE_SCALE:
        value = values.get(key)
        if value is not None and not isinstance(value, Quantity):
            values[key] = rounded(rescaled(Decimal(value), second, first))
    if values.get("output.max_rate") is not None:
        values["output.max_rate"] = rounded(product(values["output.max_rate"], factor))
    return values | dict(zip(ENDS, first, strict=True))


def comparable(one: Any, two: Any) -> tuple[Flat, Flat]:
    """Two neutral loops by path, the second in the terms of the first.

    Where the first has no proportional action, the other two are compared as the second has them, with one or without.
    """
    before, after = flat(one), flat(two)
    if not before["tuning.proportional"]:
        after["tuning.proportional"] = False
    return _acting(normal(before)), _acting(normal(on_the_same_scale(before, after)))


def _acting(loop: Flat) -> Flat:
    """Without the times of a gain of 0, and without the gain of a loop in which nothing acts."""
    values = dict(loop)
    if not values["tuning.gain"]:
        values |= {"tuning.integral_time": Decimal(0), "tuning.derivative_time": Decimal(0)}
    acts = values["tuning.proportional"] or values["tuning.integral_time"] or values["tuning.derivative_time"]
    if not acts or not values["tuning.gain"]:
        values |= {"tuning.gain": Decimal(0), "tuning.proportional": False}
    return values
