"""What is known of a parameter of a NextoPID block, and how people write that."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any, NamedTuple, TypeGuard

from pidcfg.encoders.parameters import store
from pidcfg.encoders.words import EncodeError
from pidcfg.validate.views import number_text

if TYPE_CHECKING:
    from pidcfg.schemas.iec import IecType


class Known(NamedTuple):
    """The value of a parameter, and in words where it is from, if not from the parameter itself."""

    value: Any
    source: str = ""


def held(kind: IecType, value: Any) -> Any:
    """A value as the PLC holds it: a Decimal or a switch; None for one that it cannot hold, or for none at all."""
    if value is None:
        return None
    try:
        content = store(kind, value)
    except EncodeError:
        return None
    if kind.kind == "time":
        return Decimal(value)
    return content if isinstance(content, bool) else Decimal(repr(content))


def all_known(values: tuple[Decimal | None, ...]) -> TypeGuard[tuple[Decimal, ...]]:
    """Whether all values are known."""
    return None not in values


def value_text(value: object) -> str:
    """A number or a switch as people write it."""
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    return number_text(Decimal(str(value)))
