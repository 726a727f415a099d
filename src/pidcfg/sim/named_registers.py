"""The parameters of a virtual PLC that has names for them, as registers by a map show them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic_core import PydanticCustomError

from pidcfg.encoders.iec_registers import content_of
from pidcfg.encoders.parameters import shown
from pidcfg.encoders.words import DecodeError
from pidcfg.sim.registers import NO_REGISTER, NO_VALUE, Done, RegisterError

if TYPE_CHECKING:
    from pidcfg.encoders.parameters import Content, Parameter
    from pidcfg.sim.named_settings import NamedKeys


def content_written(name: str, row: Parameter, raw: int) -> Content:
    """What registers hold, as a content of their parameter; raises `RegisterError` for what is none."""
    try:
        return content_of(row.type, raw)
    except DecodeError as error:
        raise RegisterError(NO_VALUE, f"{name}: {error}") from None


def checked_row(keys: NamedKeys, name: str, row: str) -> Parameter:
    """A parameter that can be written; raises `RegisterError` where the PLC, or its program, writes it."""
    try:
        return keys.find((row,))
    except PydanticCustomError as error:
        raise RegisterError(NO_REGISTER, f"{name}: {error.message()}") from None


def done(name: str, row: Parameter, content: Any, late: str | None, mode: str | None) -> Done:
    """What a write has done, in words."""
    return Done(f"set {name} to {shown(row.type, content)}" + (f"; {late}" if late else ""), mode)
