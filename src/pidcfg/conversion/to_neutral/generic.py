"""The neutral form as a vendor: its loops are the neutral loops."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion.ledger import Neutral, Said
from pidcfg.schemas.base import plain_number

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.generic import GenericFile, Loop

NOTHING_LOST = ("name", "description")
"""They go with the loop."""
WHOLE = ("pv.range", "output.range")
"""Pairs that are one thing: a scale. The others are two limits."""


def to_neutral(config: GenericFile) -> list[Neutral]:
    """The loops as they are."""
    return [Neutral(plain(loop), [Said(path, value, (path,)) for path, value in fields(loop)]) for loop in config.loops]


def fields(loop: Loop) -> Iterator[tuple[str, Any]]:
    """Every field that is given, by its path, with its value."""
    for path, value in _given(loop, ""):
        if path not in NOTHING_LOST:
            if isinstance(value, tuple) and path not in WHOLE:
                yield from ((f"{path}.{i}", end) for i, end in enumerate(value))
            else:
                yield path, list(value) if isinstance(value, tuple) else value


def _given(model: BaseModel, above: str) -> Iterator[tuple[str, Any]]:
    for name in type(model).model_fields:
        value = getattr(model, name)
        if name not in model.model_fields_set or value is None:
            continue
        if isinstance(value, BaseModel):
            yield from _given(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def plain(value: Any) -> Any:
    """What is given of a model, as a file has it."""
    if isinstance(value, BaseModel):
        return {
            key: plain(getattr(value, key))
            for key in type(value).model_fields
            if key in value.model_fields_set and getattr(value, key) is not None
        }
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    return plain_number(value) if isinstance(value, Decimal) else value
