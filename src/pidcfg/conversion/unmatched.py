"""Neutral fields that a vendor does not have: which of them a loop gives, so that none is lost silently."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.paths import steps, value_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.generic import Loop

ALARMS = (
    *(f"alarms.pv.{key}" for key in ("low_low", "low", "high", "high_high")),
    *("alarms.deviation.high", "alarms.deviation.high_high", "alarms.rate_of_change", "alarms.hysteresis"),
)
"""Every alarm of the neutral loop."""
HARMLESS = {"setpoint.follows_pv": False}
"""Values that are no default and still ask nothing of a target that has no such field."""


def unmatched(loop: Loop, notes: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Those of these fields that a loop gives (with more than the default), with what to program instead."""
    for path, note in notes.items():
        *above, key = steps(path)
        value, section = value_at(loop, (*above, key)), value_at(loop, above)
        default = type(section).model_fields[str(key)].default if isinstance(section, BaseModel) else None
        if value is not None and value != default and not harmless(path, value):
            yield path, note


def harmless(path: str, value: Any) -> bool:
    """Whether nothing is lost with this value in a target without such a field."""
    return path in HARMLESS and HARMLESS[path] == value
