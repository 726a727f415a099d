"""Neutral fields that a vendor does not have: which of them a loop gives, so that none is lost silently."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.paths import steps

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.generic import Loop

ALARMS = (
    "alarms.pv.low_low",
    "alarms.pv.low",
    "alarms.pv.high",
    "alarms.pv.high_high",
    "alarms.deviation.high",
    "alarms.deviation.high_high",
    "alarms.rate_of_change",
    "alarms.hysteresis",
)
"""Every alarm of the neutral loop."""
HARMLESS = {"setpoint.follows_pv": False}
"""Values that are no default and still ask nothing of a target that has no such field."""


def unmatched(loop: Loop, notes: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Those of these fields that a loop gives (with more than the default), with what to program instead."""
    for path, note in notes.items():
        value, default = _value_and_default(loop, path)
        if value is not None and value != default and not harmless(path, value):
            yield path, note


def harmless(path: str, value: Any) -> bool:
    """Whether nothing is lost with this value in a target without such a field."""
    return path in HARMLESS and HARMLESS[path] == value


def _value_and_default(loop: Loop, path: str) -> tuple[Any, Any]:
    """A field's value and its default; None where nothing stands on the way."""
    value: Any = loop
    default: Any = None
    for step in steps(path):
        if value is None:
            return None, None
        if isinstance(step, int):
            value, default = value[step], None
        else:
            field = type(value).model_fields[step] if isinstance(value, BaseModel) else None
            default = None if field is None or field.is_required() else field.default
            value = getattr(value, step)
    return value, default
