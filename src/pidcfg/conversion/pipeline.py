"""A configuration of one vendor to one of another: neutral loops, target, what its registers hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion.ledger import LOSSES, Change, ConvertError, Missing, NeutralLoop, TargetFile, changes
from pidcfg.conversion.settle import settled, validated
from pidcfg.conversion.unmatched import harmless
from pidcfg.encoders.words import DecodeError
from pidcfg.paths import steps
from pidcfg.schemas.generic import GenericFile

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.image import Encoding
    from pidcfg.vendors import Vendor

__all__ = ["ConvertError", "Converted", "convert", "generic_file", "neutral_loops"]


@dataclass(frozen=True)
class Converted:
    """The target's file as plain data, and the report by loop; its model and registers when they are asked for."""

    vendor: Vendor
    data: dict[str, Any]
    loops: tuple[tuple[str, tuple[Change, ...]], ...]

    @property
    def losses(self) -> bool:
        """Whether anything was dropped or clamped."""
        return any(change.kind in LOSSES for _, rows in self.loops for change in rows)

    @cached_property
    def config(self) -> Any:
        """The file as the vendor's model; raises `ConvertError` where rounded values do not fit together."""
        return validated(self.vendor, self.data)

    @cached_property
    def encoding(self) -> Encoding:
        """The registers or parameters that the model becomes; raises as ``config`` does."""
        encoding: Encoding = self.vendor.encoder(self.config)
        return encoding


def neutral_loops(config: Any, source: Vendor) -> tuple[GenericFile, list[NeutralLoop]]:
    """The neutral file of a configuration; raises `ConvertError` for what it must say before."""
    loops: list[NeutralLoop] = source.load("to_neutral")(config)
    missing = [entry for loop in loops for entry in loop.missing]
    if missing:
        raise ConvertError(missing)
    return generic_file(config, loops), loops


def generic_file(config: Any, loops: Sequence[NeutralLoop]) -> GenericFile:
    """The neutral file of a configuration's loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [loop.data for loop in loops]}
    data |= {key: getattr(config, key) for key in ("name", "description") if getattr(config, key) is not None}
    return GenericFile.model_validate(data)


def convert(config: Any, source: Vendor, target: Vendor, options: Mapping[str, Any]) -> Converted:
    """The same loops for another vendor, with what became of every field.

    ``options``: where things go that the source does not say, by the keys of the target's `CONVERT_OPTIONS`. Raises
    `ConvertError` for what the source must say before, and for what the target cannot hold at all.
    """
    generic, loops = neutral_loops(config, source)
    file: TargetFile = target.load("from_neutral")(generic, options)
    try:
        stored = settled(file, target)
    except DecodeError:
        if generic.loops:
            raise
        raise ConvertError([Missing(("loops",), "there is no loop to convert: add one")]) from None
    report = []
    for i, (loop, neutral) in enumerate(zip(generic.loops, loops, strict=True)):
        is_default = partial(_is_default, loop)
        report.append((loop.name, tuple(changes(neutral.fields, file.fields[i], stored[i], is_default))))
    return Converted(target, file.data, tuple(report))


def _is_default(loop: BaseModel, field: str) -> bool:
    """Whether a neutral field is at its default or harmless: what a loop is like that does not give it."""
    item: Any = loop
    for key in steps(field):
        if not isinstance(item, BaseModel) or key not in type(item).model_fields:
            return False
        default, item = type(item).model_fields[str(key)].default, getattr(item, str(key))
        if item == default:
            return True
    return harmless(field, item)
