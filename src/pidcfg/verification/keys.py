"""Which key of the other side explains a difference: among the neutral fields that differ, the one that acts on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.ledger import overlap
from pidcfg.verification.neutral import differing, neutral_of, neutral_values

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.comparison import Difference
    from pidcfg.verification.trial import Side

ACTS_ON: Mapping[str, Sequence[str]] = {
    "mode": ("mode", "setpoint.source"),
    "setpoint": ("setpoint.", "mode"),
    "pv": (
        "pv.",
        "output_raises_pv",
        "tuning.",
        "output.",
        "sample_time",
        "deadband",
        "anti_windup",
        "setpoint.",
        "mode",
    ),
    "output": (
        "output_raises_pv",
        "tuning.",
        "output.",
        "pv.",
        "sample_time",
        "deadband",
        "anti_windup",
        "setpoint.",
        "mode",
    ),
}
"""Neutral fields that move a signal, those first that do it most directly; alarms have their own."""
AT_LIMITS = ("output.limits", "anti_windup", "output.range")
"""Those first in the stages at the limits of the output."""


def key_of(difference: Difference, loop: Loop, side: Side, j: int) -> str:
    """The key of the other side that explains a difference; empty where no neutral field does."""
    other = side.loop(j)
    fields = differing(*neutral_values(loop, other))
    kinds = ACTS_ON.get(difference.signal, ("alarms.", "pv.range"))
    if difference.stage.endswith("limit"):
        kinds = (*AT_LIMITS, *kinds)
    if difference.stage == "manual":
        kinds = ("output.", *kinds)
    field = next((field for kind in kinds for field in fields if field.startswith(kind)), None)
    if field is None:
        return ""
    entries = neutral_of(side.config, side.vendor)[1][j].fields
    key = next((entry.path for entry in entries if any(overlap(field, to) for to in entry.to)), None)
    return key or field
