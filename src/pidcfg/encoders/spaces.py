"""A vendor's address space: its banks of registers, how an address is written, and what one cell holds.

Addresses are plain numbers in the order in which a listing shows them; vendors with several banks have them one after
the other, ``BANK`` numbers apart. Raw contents are whole numbers too: the bits of a word, a switch or a
single-precision number.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING

from pidcfg.encoders.singles import single_bits, single_value
from pidcfg.encoders.words import WORD_MAX
from pidcfg.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

BANK = 1 << 16
"""Numbers that each bank has to itself."""
Value = bool | int | float


@frozen
class Kind:
    """What one address holds: how its raw bits are shown, and read again (None: it cannot hold that value)."""

    name: str
    digits: int
    show: Callable[[int], Value]
    read: Callable[[object], int | None]
    holds: str

    def hex(self, raw: int) -> str:
        """The raw content in hexadecimal."""
        return f"{raw:0{self.digits}X}"

    def text(self, raw: int) -> str:
        """The value as a listing writes it: a switch as 0 or 1."""
        value = self.show(raw)
        return str(int(value)) if isinstance(value, bool) else str(value)

    @property
    def highest(self) -> int:
        """The largest raw content."""
        return 1 if self is BIT else (1 << 4 * self.digits) - 1

    def __reduce__(self) -> tuple[Callable[[str], Kind], tuple[str]]:
        """A copy, be it in another process, is the kind itself."""
        return kind_named, (self.name,)


def _whole(value: object, low: int, high: int) -> int | None:
    return value if isinstance(value, int) and not isinstance(value, bool) and low <= value <= high else None


def _signed(value: object) -> int | None:
    whole = _whole(value, -0x8000, 0x7FFF)
    return None if whole is None else whole & WORD_MAX


def _bit(value: object) -> int | None:
    return int(value) if isinstance(value, bool) else _whole(value, 0, 1)


def _single(value: object) -> int | None:
    return single_bits(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


WORD = Kind("word", 4, int, lambda v: _whole(v, 0, WORD_MAX), "a word of 0 to 65535")
INT16 = Kind("integer", 4, lambda raw: raw - 0x10000 if raw > 0x7FFF else raw, _signed, "an integer of -32768 to 32767")
BIT = Kind("bit", 1, bool, _bit, "true or false")
SINGLE = Kind("float", 8, single_value, _single, "a finite single-precision number")


def kind_named(name: str) -> Kind:
    """One of the kinds that there are."""
    return next(kind for kind in (WORD, INT16, BIT, SINGLE) if kind.name == name)


class NoRegisterError(LookupError):
    """A register that does not exist: it lies behind the last one of its bank."""


@frozen
class Bank:
    """Registers with one prefix, from ``first`` to ``last``."""

    prefix: str
    first: int
    last: int
    kind: Kind
    octal: bool = False

    def name(self, n: int) -> str:
        """An address as the vendor writes it: ``DF106``."""
        return f"{self.prefix}{n:{'o' if self.octal else 'd'}}"


@frozen
class Space:
    """All banks of a vendor."""

    banks: Sequence[Bank]

    @cached_property
    def _row(self) -> dict[str, int]:
        return {bank.prefix: i for i, bank in enumerate(self.banks)}

    def number(self, prefix: str, n: int) -> int:
        """An address as a plain number."""
        return self._row[prefix] * BANK + n

    def place(self, number: int) -> tuple[Bank, int]:
        """A plain number's bank, and its number there; raises `NoRegisterError` behind the last bank."""
        if not self.holds(number):
            raise NoRegisterError(f"no register lies behind {self.banks[-1].name(self.banks[-1].last)}")
        return self.banks[number // BANK], number % BANK

    def holds(self, number: int) -> bool:
        """Whether a plain number belongs to a bank that there is."""
        return number // BANK < len(self.banks)

    def same_bank(self, first: int, last: int) -> bool:
        """Whether two plain numbers belong to one bank that there is."""
        return first // BANK == last // BANK < len(self.banks)

    def name(self, number: int) -> str:
        """An address as the vendor writes it: ``DF106``."""
        bank, n = self.place(number)
        return bank.name(n)

    def kind(self, number: int) -> Kind:
        """What an address holds."""
        return self.place(number)[0].kind

    def shown(self, number: int, raw: int) -> str:
        """A content as the vendor's tools show it: hexadecimal where addresses are octal, so that BCD is its digits."""
        bank, _ = self.place(number)
        return bank.kind.hex(raw) if bank.octal else bank.kind.text(raw)

    def parse(self, text: str) -> int | None:
        """A written address as a plain number; None for anything else."""
        match = re.fullmatch(r"([A-Z]+)([0-9]{1,6})", text)
        row = self._row.get(match.group(1)) if match else None
        if match is None or row is None:
            return None
        bank, digits = self.banks[row], match.group(2)
        if bank.octal and not set(digits) <= set("01234567"):
            return None
        n = int(digits, 8 if bank.octal else 10)
        return row * BANK + n if bank.first <= n <= bank.last else None
