"""The registers of a virtual PLC as somebody outside sees them: what they hold now, and what may be written."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, NamedTuple

from pidcfg.refs import Decision

if TYPE_CHECKING:
    from collections.abc import Mapping, MutableSequence, Sequence

D873 = Decision(
    873,
    "what a client may write to the virtual PLC",
    "Settings and requests, and an output where the PLC takes one. A register that only the controller writes, or that "
    "is reserved, is exception 2; a content that is no value of its register is exception 3; a value that the PLC does "
    "not take at this moment is exception 4. What the PLC takes and overwrites with its next calculation is written.",
    "The manuals speak of no Modbus exceptions; the three say where, what and when.",
)


class RegisterError(ValueError):
    """A write that the PLC refuses; ``code`` is the Modbus exception."""

    def __init__(self, code: int, message: str) -> None:
        super().__init__(message)
        self.code = code


NO_REGISTER, NO_VALUE, NOT_NOW = 2, 3, 4
"""Exceptions of D873."""


class Done(NamedTuple):
    """What a write has done, in words, and the mode that it requested, if it did."""

    text: str
    mode: str | None = None


class Registers(ABC):
    """The registers of a virtual PLC by plain number; loops are counted from 0, and −1 is what belongs to none."""

    @abstractmethod
    def places(self) -> Mapping[int, int]:
        """Every register that there is, with its loop."""

    @abstractmethod
    def contents(self, loop: int, sig: Sequence[float]) -> Mapping[int, int]:
        """What the registers of a loop hold now, raw; ``sig``: the signals of the run."""

    @abstractmethod
    def write(self, number: int, raw: int, sig: MutableSequence[float]) -> Done:
        """Writes a register as an operator's panel does. Raises `RegisterError`."""
