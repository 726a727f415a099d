"""Fields of a vendor with registers that the neutral form does not have: places, tags, formats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion.ledger import COMMON, overlap
from pidcfg.conversion.values import shown
from pidcfg.differences.result import Difference
from pidcfg.paths import dotted

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.differences.result import Risk
    from pidcfg.paths import Path

PLACES = ("loop_table", "registers", "discretes", "bits", "integers", "floats", "device")
LIVE = ("tag", "format", "transfer", "counts", "pwm", "curve")
"""Words of keys that say which signal is read or driven, and what its counts mean."""


def vendor_fields(config: Any, i: int, loop: NeutralLoop) -> dict[str, Any]:
    """The fields of a loop that no neutral field says, as text; those of the PLC stand with the first loop."""
    fields = dict(_fields(config.loops[i]))
    if i == 0 and hasattr(config, "plc"):
        fields |= dict(_fields(config.plc, ("plc",)))
    return {
        key: value
        for key, value in fields.items()
        if key not in COMMON and not any(overlap(key, row.path) for row in loop.fields)
    }


def _fields(model: BaseModel, above: Path = ()) -> Iterator[tuple[str, str]]:
    """Every value of a model by its path, defaults too."""
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, BaseModel):
            yield from _fields(value, (*above, name))
        elif value is not None:
            yield dotted((*above, name)), str(shown(value))


def differences_of_fields(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[Difference]:
    """What differs between the fields of two loops of one vendor."""
    return [
        Difference(key, _risk(key), shown(before.get(key)), shown(after.get(key)))
        for key in {**before, **after}
        if before.get(key) != after.get(key)
    ]


def _risk(key: str) -> Risk:
    """How grave a difference of a vendor's field is: of what the PV and the output are, or of a place only."""
    if key.rpartition(".")[2] in PLACES:
        return "low"
    return "high" if any(word in key for word in LIVE) else "medium"
