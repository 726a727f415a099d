"""The neutral form as a vendor: its loops are the neutral loops, and every field goes to itself."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion import COMMON_FIELDS, NeutralLoop, SourceField, TargetField, TargetFile
from pidcfg.conversion.operation import (
    ADDED_ANTI_WINDUP,
    Master,
    Operation,
    Rate,
    Smoothing,
    Stopped,
    VendorSettings,
    Windup,
)
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.paths import dotted_text, given_fields

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.schemas.generic import GenericFile, Loop

# --- The neutral form as a vendor: its loops are the neutral loops ----------------------------------------------------

HARMLESS_FIELDS = dict.fromkeys(COMMON_FIELDS, "it goes with the loop")
"""Fields without a line of their own."""
RANGE_FIELDS = ("pv.range", "output.range")
"""Pairs that are one thing: a scale. The others are two limits."""


def to_neutral(config: GenericFile) -> list[NeutralLoop]:
    """The loops as they are."""
    return [
        NeutralLoop(to_plain_data(loop), [SourceField(path, value, (path,)) for path, value in fields_by_path(loop)])
        for loop in config.loops
    ]


def fields_by_path(loop: Loop) -> Iterator[tuple[str, object]]:
    """Every field that is given, by its path, with its value; limits as two."""
    for keys, value in given_fields(loop):
        path = dotted_text(keys)
        if path in HARMLESS_FIELDS:
            continue
        if isinstance(value, tuple) and path not in RANGE_FIELDS:
            yield from ((f"{path}.{i}", end) for i, end in enumerate(value))
        else:
            yield path, value


def to_plain_data(value: object) -> Any:
    """What is given of a model, as a file has it."""
    if isinstance(value, BaseModel):
        return {
            key: to_plain_data(getattr(value, key))
            for key in type(value).model_fields
            if key in value.model_fields_set and getattr(value, key) is not None
        }
    if isinstance(value, tuple):
        return [to_plain_data(item) for item in value]
    return plain_number(value) if isinstance(value, Decimal) else value


# --- Neutral loops: nothing bumps (D301), and the integral stops at the limits (D300) ---------------------------------

OWN_SETTINGS = VendorSettings()
"""Nothing has an address, and nothing else is left out."""


def operations(config: GenericFile) -> list[Operation]:
    """Of each loop (D300, D301)."""
    return [
        Operation(
            moves_by_hand=True,
            windup=Windup.CONDITIONAL if loop.anti_windup else Windup.ENDLESS,
            smoothing=Smoothing.EXACT,
            rate=Rate.KEPT_UP,
            master=Master.FOLLOWS,
            stopped=Stopped.UNSAID,
        )
        for loop in config.loops
    ]


# --- The neutral form as a target -------------------------------------------------------------------------------------


def from_neutral(
    file: GenericFile,
    options: Mapping[str, object],
    operations: Sequence[Operation] = (),
) -> TargetFile:
    """The file as it is; an integral that some limit stops is one that the limits of the output stop (D342)."""
    data = to_plain_data(file)
    bounded_loops = {i for i, operation in enumerate(operations) if operation.bounds_integral}
    target_fields = []
    for i, loop in enumerate(file.loops):
        target_fields.append([TargetField(path, path) for path, _ in fields_by_path(loop)])
        if i in bounded_loops and not loop.anti_windup:
            data["loops"][i]["anti_windup"] = True
            target_fields[i] = [field for field in target_fields[i] if field.path != "anti_windup"]
            target_fields[i].append(TargetField("anti_windup", "anti_windup", ADDED_ANTI_WINDUP, assumed=True))
    return TargetFile(data, target_fields)
