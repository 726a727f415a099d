"""Neutral fields without a twin in a vendor: which of them a loop has, so that none is lost silently."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion.ledger import Put

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


def dropped(loop: Loop, notes: Mapping[str, str]) -> Iterator[Put]:
    """What of these fields the loop says (more than its default), with what to program instead."""
    for path, note in notes.items():
        value, default = found(loop, path)
        if value is not None and value != default and not harmless(path, value):
            yield Put("", path, note)


def harmless(path: str, value: Any) -> bool:
    """Whether nothing is lost with this value in a target without such a field."""
    return path in HARMLESS and HARMLESS[path] == value


def found(loop: Loop, path: str) -> tuple[Any, Any]:
    """A field's value and its default; None where nothing stands on the way."""
    value: Any = loop
    default: Any = None
    for step in path.split("."):
        if value is None:
            return None, None
        if step.isdigit():
            value, default = value[int(step)], None
        else:
            field = type(value).model_fields[step] if isinstance(value, BaseModel) else None
            default = None if field is None or field.is_required() else field.default
            value = getattr(value, step)
    return value, default
