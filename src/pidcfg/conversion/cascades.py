"""Cascades that hand the output on as a position: 0 to 100 % of the outer loop's output are 0 to 100 % of the inner PV.

In the neutral form the source's output is the set point itself. Where the two ranges differ, the outer loop's output is
therefore given in the inner loop's units, with its gain (D305).
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import product, quotient, rescaled, rounded, width
from pidcfg.paths import value_at
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.conversion.ledger import NeutralLoop

D305 = Decision(
    305,
    "the output of an outer loop is in the units of the inner one's PV",
    "DL06 and EZLogix write the outer loop's output word into the inner loop's set point word. Where its own range is "
    "another than that of the inner PV, the neutral loop has the inner range, and gain, limits and bias on it.",
    "The words are handed on as they are; taken as engineering units, the set point would be wrong by the ratio.",
)


def outputs_in_inner_units(loops: list[NeutralLoop]) -> list[NeutralLoop]:
    """The loops, each source of a set point on the scale of the PV that it commands."""
    by_name = {loop.data.get("name"): loop for loop in loops}
    for inner in loops:
        outer = by_name.get(value_at(inner.data, ("setpoint", "source")))
        if outer is not None and "output" in outer.data and "pv" in inner.data:
            _rescale(outer, [Decimal(str(end)) for end in inner.data["pv"]["range"]], inner.data["name"])
    return loops


def _rescale(outer: NeutralLoop, span: list[Decimal], inner: str) -> None:
    """The outer loop's output on another scale."""
    output, tuning = outer.data["output"], outer.data["tuning"]
    present = [Decimal(str(end)) for end in output["range"]]
    if present == span:
        return
    factor = quotient(width(span), width(present))
    tuning["gain"] = rounded(product(Decimal(str(tuning["gain"])), factor))
    output["range"] = span
    for key in ("bias", "manual"):
        if key in output:
            output[key] = _moved(output[key], present, span)
    if "limits" in output:
        output["limits"] = [_moved(end, present, span) for end in output["limits"]]
    output.pop("unit", None)
    note = f"it commands {inner}: told in the units of its PV"
    outer.fields[:] = [
        replace(field, note=note) if "output.range" in field.to or "output.unit" in field.to else field
        for field in outer.fields
    ]


def _moved(value: Any, source: Sequence[Decimal], target: Sequence[Decimal]) -> Decimal:
    return rounded(rescaled(Decimal(str(value)), source, target))
