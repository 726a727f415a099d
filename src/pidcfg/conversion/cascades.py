"""Cascades that hand the output on as a position: 0 to 100 % of the outer loop's output are 0 to 100 % of the inner PV.

In the neutral form the source's output is the set point itself. Where the two ranges differ, the outer loop's output is
therefore told in the inner loop's units, with its gain (D305).
"""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.arithmetic import product, quotient, rescaled, rounded, width
from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.conversion.ledger import Neutral

D305 = Decision(
    305,
    "the output of an outer loop is in the units of the inner one's PV",
    "DL06 and EZLogix write the outer loop's output word into the inner loop's set point word. Where its own range is "
    "another than that of the inner PV, the neutral loop has the inner range, and gain, limits and bias on it.",
    "The words are handed on as they are; taken as engineering units, the set point would be wrong by the ratio.",
)


def told_in_inner_units(loops: list[Neutral]) -> list[Neutral]:
    """The loops, each source of a set point on the scale of the PV that it commands."""
    by_name = {entry.loop.get("name"): entry for entry in loops}
    for inner in loops:
        outer = by_name.get(inner.loop.get("setpoint", {}).get("source"))
        if outer is not None and "output" in outer.loop and "pv" in inner.loop:
            _retell(outer, [Decimal(str(end)) for end in inner.loop["pv"]["range"]], inner.loop["name"])
    return loops


def _retell(outer: Neutral, span: list[Decimal], name: str) -> None:
    """The outer loop's output on another scale."""
    output = outer.loop["output"]
    own = [Decimal(str(end)) for end in output["range"]]
    if own == span:
        return
    factor = quotient(width(span), width(own))
    outer.loop["tuning"]["gain"] = rounded(product(Decimal(str(outer.loop["tuning"]["gain"])), factor))
    output["range"] = span
    for key in ("bias", "manual"):
        if key in output:
            output[key] = _moved(output[key], own, span)
    if "limits" in output:
        output["limits"] = [_moved(end, own, span) for end in output["limits"]]
    output.pop("unit", None)
    note = f"it commands {name}: told in the units of its PV"
    outer.said[:] = [
        replace(entry, note=note) if "output.range" in entry.to or "output.unit" in entry.to else entry
        for entry in outer.said
    ]


def _moved(value: Any, own: Iterable[Decimal], span: Iterable[Decimal]) -> Decimal:
    return rounded(rescaled(Decimal(str(value)), list(own), list(span)))
