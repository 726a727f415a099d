"""What a conversion within one vendor keeps: places and choices of the PLC, which the neutral form does not know."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import Change
from pidcfg.conversion.settle import place
from pidcfg.encoders.words import DecodeError
from pidcfg.paths import is_given, put, value_at

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping, Sequence

    from pidcfg.vendors import Vendor


def own_scales(config: Any, vendor: Vendor, kept: Sequence[int], options: Mapping[str, Any]) -> dict[str, Any]:
    """Options with what the gains and times of a file depend on, unless they say it themselves."""
    return {**vendor.load("own").scales(config, kept), **options}


def own_places(config: Any, vendor: Vendor, kept: Sequence[int], options: Mapping[str, Any]) -> dict[int, list[Change]]:
    """What the loops at some places of a file keep within their vendor, as lines by their number in the result."""
    own = vendor.load("own")
    paths = [path for path, option in own.choices.items() if option not in options]
    paths += () if options else own.addresses
    held = _as_data(config, vendor) if paths else {}
    lines: dict[int, list[Change]] = {}
    for j, i in enumerate(kept):
        found = [(path, value_at(held, place(i, path))) for path in paths if not (path.startswith("/") and j)]
        found = [(path, _default(config, path) if value is None else value) for path, value in found]
        lines[j] = [
            Change(path, "exact", value, value, target_field=path) for path, value in found if value is not None
        ]
    return lines


def _default(config: Any, path: str) -> Any:
    """A choice that the file gives although it is the default; decoding leaves those of the PLC out."""
    keys = path.removeprefix("/").split(".")
    return value_at(config, keys) if path.startswith("/") and is_given(config, keys) else None


def _as_data(config: Any, vendor: Vendor) -> dict[str, Any]:
    """A file as plain data; nothing where its words are no values."""
    image = vendor.encoder(config).image
    try:
        data: dict[str, Any] = vendor.load("decode")(image.words, image.settings, image.plc).data
    except DecodeError:
        return {}
    return data


def keep(data: dict[str, Any], lines: Mapping[int, Sequence[Change]]) -> None:
    """Puts what is kept into the result."""
    for j, rows in lines.items():
        for row in rows:
            put(data, place(j, row.field), row.target)


def with_kept(rows: Sequence[Change], kept: Sequence[Change], of_file: Collection[str]) -> Iterator[Change]:
    """The lines of a loop, in which what is kept is neither assumed nor dropped; ``of_file``: fields of the file."""
    own = {row.field: row for row in kept}
    for row in rows:
        if f"/{row.field}" in of_file:
            continue
        line = own.pop(row.field, None)
        yield row if line is None else replace(line, neutral=row.neutral)
    yield from own.values()
