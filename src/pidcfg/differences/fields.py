"""The neutral fields that the keys of a vendor's loops become: by them a difference is ranked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import ConvertError, overlap
from pidcfg.encoders.words import DecodeError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pydantic import BaseModel

    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.vendors import Vendor

SCALES = ("pv", "output")


def fields_of(vendor: Vendor, config: Any, encoding: Any) -> dict[str, list[tuple[str, tuple[str, ...]]]]:
    """By loop, each key with the neutral fields that it becomes; a key of a block stands with the block's name."""
    try:
        loops: list[NeutralLoop] = vendor.load("to_neutral")(with_ranges(config, encoding))
    except (ConvertError, DecodeError, ArithmeticError):
        return {}
    fields: dict[str, list[tuple[str, tuple[str, ...]]]] = {}
    for loop, neutral in zip(config.loops, loops, strict=True):
        for row in neutral.fields:
            _, _, inner = row.path.partition("blocks.")
            block, _, key = inner.partition(".")
            owner, path = (block, key) if row.path.startswith("blocks.") and key else (loop.name, row.path)
            fields.setdefault(owner, []).append((path, row.to))
    return fields


def neutral_fields(fields: Mapping[str, list[tuple[str, tuple[str, ...]]]], owner: str, key: str) -> Iterator[str]:
    """The neutral fields of a key."""
    for path, names in fields.get(owner, ()):
        if overlap(path, key):
            yield from names


def with_ranges(config: Any, encoding: Any) -> Any:
    """A configuration in which a scale without a range counts from end to end, so that it has a neutral form."""
    scales = {
        block.place[1]: block.scales for block in getattr(encoding, "blocks", ()) if block.place[:1] == ("loops",)
    }
    loops = []
    for i, loop in enumerate(config.loops):
        given: dict[str, BaseModel] = {}
        for part, scale in ((part, scales.get(i, {}).get(part)) for part in SCALES):
            if scale is not None and scale.range is None:
                ends = {"range": (scale.format.minimum, scale.format.maximum)}
                given[part] = getattr(loop, part).model_copy(update=ends)
        loops.append(loop.model_copy(update=given) if given else loop)
    return config.model_copy(update={"loops": tuple(loops)})
