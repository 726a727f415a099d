"""What a vendor with registers says of a loop that no neutral field does: places, tags, formats."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from pydantic import BaseModel

from pidcfg.conversion.ledger import COMMON
from pidcfg.conversion.values import shown

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import NeutralLoop

PLACES = ("loop_table", "registers", "discretes", "bits", "integers", "floats", "device")
LIVE = ("tag", "format", "transfer", "counts", "pwm", "curve")
"""Words of keys that say which signal is read or driven, and what its counts mean."""


def unsaid(held: Any, i: int, loop: NeutralLoop) -> dict[str, Any]:
    """What a vendor with registers knows of a loop that no neutral field says: places, tags, formats."""
    said = [field.path for field in loop.fields]
    fields = leaves(held.loops[i])
    if i == 0 and hasattr(held, "plc"):
        fields |= {f"plc.{key}": value for key, value in leaves(held.plc).items()}
    return {
        key: value
        for key, value in fields.items()
        if key not in COMMON and not any(_related(key, field) for field in said)
    }


def _related(one: str, two: str) -> bool:
    return one == two or one.startswith(f"{two}.") or two.startswith(f"{one}.")


def leaves(model: BaseModel, prefix: str = "") -> dict[str, Any]:
    """Every value of a vendor's own model by its path, as text."""
    found: dict[str, Any] = {}
    for name in type(model).model_fields:
        value = getattr(model, name)
        if isinstance(value, BaseModel):
            found |= leaves(value, f"{prefix}{name}.")
        elif value is not None:
            found[f"{prefix}{name}"] = str(shown(value))
    return found


def own_risk(key: str) -> Literal["high", "medium", "low"]:
    """How grave a difference of the vendor's own words is: of what the PV and the output are, or of a place only."""
    if key.rpartition(".")[2] in PLACES:
        return "low"
    return "high" if any(word in key for word in LIVE) else "medium"
