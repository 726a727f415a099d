"""Fields that a file gives and no line of the report speaks of: a line for each, so that none is lost silently.

Those that mean nothing to another PLC are in the vendor's table of what is lost harmlessly (`NOTHING_LOST`), each with
its reason; any other is a loss, so that a new field cannot be forgotten.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import COMMON, Change, overlap
from pidcfg.conversion.values import shown
from pidcfg.paths import dotted, given_fields
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pidcfg.paths import Path

WITH_LOOP = "part of a block that goes with its loop"
WITH_READER = "its value goes with what reads it"
UNKNOWN = "no conversion knows this field: see what it does in the source, and program it"


def remaining(
    given: Iterable[tuple[Path, Any]], rows: Sequence[Change], reasons: Mapping[str, str], target: Mapping[str, Any]
) -> Iterator[Change]:
    """The lines of those fields that no row is about; ``target``: the loop's data there."""
    for path, value in given:
        key, text = dotted(path), _shown(value)
        if any(overlap(key, row.field) for row in rows):
            continue
        if key in COMMON and target.get(key) == value:
            yield Change(key, "exact", text, text, neutral=(key,), target_field=key)
        else:
            reason = next((text for path, text in reasons.items() if f"{key}.".startswith(f"{path}.")), None)
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN, loss=reason is None)


def of_loop(config: Any, i: int, *, with_plc: bool) -> Iterator[tuple[Path, Any]]:
    """The fields that a file gives of a loop, and of the PLC beside it."""
    yield from given_fields(config.loops[i])
    if with_plc and getattr(config, "plc", None) is not None:
        yield from given_fields(config.plc, ("plc",))


def beside(config: Any, rows: Sequence[Change], reasons: Mapping[str, str]) -> Iterator[Change]:
    """Blocks, signals and moves that stand beside the loops and go with one of them; ``rows`` of all loops.

    ``reasons``: why nothing is lost of some of them.
    """
    for block in getattr(config, "blocks", ()):
        lines = [row.field for row in rows if overlap(f"blocks.{block.name}", row.field)]
        for path, value in given_fields(block):
            key = f"blocks.{block.name}.{dotted(path)}"
            if not any(overlap(key, field) for field in lines):
                yield Change(key, "dropped", _shown(value), None, note=WITH_LOOP if lines else UNKNOWN, loss=not lines)
    for name, value in getattr(config, "signals", {}).items():
        if not any(overlap(f"signals.{name}", row.field) for row in rows):
            yield Change(f"signals.{name}", "dropped", _shown(value), None, note=WITH_READER)
    for i, move in enumerate(getattr(config, "moves", ())):
        key = f"moves.{i}"
        if not any(overlap(key, row.field) for row in rows):
            reason = reasons.get(key)
            text = f"{_shown(move.move)} to {move.to}"
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN, loss=reason is None)


def _shown(value: Any) -> Any:
    """A value as JSON has it; what is neither number nor word as text."""
    plain = value.text if isinstance(value, Wire) else shown(value)
    return plain if isinstance(plain, bool | int | float | str | list) else str(plain)
