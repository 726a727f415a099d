"""Single-precision numbers (IEEE 754) in registers of 32 bits."""

from __future__ import annotations

import struct
from decimal import Decimal
from math import inf, isfinite, nextafter
from typing import ClassVar

from pidcfg.encoders.words import DecodeError, EncodeError
from pidcfg.frozen import frozen

SINGLE_MINUS_ZERO = 0x80000000
LARGEST_SINGLE = Decimal("3.4028234663852886E+38")


def single_bits(value: float) -> int | None:
    """The bits of the nearest single-precision number; None when there is no finite one."""
    try:
        return int.from_bytes(struct.pack(">f", value), "big") if isfinite(value) else None
    except OverflowError:
        return None


def single_value(raw: int) -> float:
    """The shortest decimal that means these single-precision bits, as a float: ``2.4``, not ``2.4000000953674316``."""
    exact: float = struct.unpack(">f", raw.to_bytes(4, "big"))[0]
    if not isfinite(exact):
        return exact
    return next(v for v in (float(f"{exact:.{digits}g}") for digits in range(1, 10)) if single_bits(v) == raw)


def _to_odd(value: Decimal) -> float:
    """One of the two doubles around a number, that with the odd last bit: rounded again it is as if rounded once."""
    double = float(value)
    exact = Decimal(double)
    if exact == value or not isfinite(double) or struct.pack(">d", double)[-1] & 1:
        return double
    return nextafter(double, inf if value > exact else -inf)


@frozen
class Single:
    """A single-precision number (IEEE 754), rounded to the nearest, ties to even."""

    rounds: ClassVar[bool] = False

    @property
    def notation(self) -> str:
        """How the register is written, for reference pages."""
        return "float"

    def encode(self, value: Decimal) -> int:
        """A value to its bits; what is too large, or so small that it would become 0, is refused."""
        bits = single_bits(_to_odd(value))
        if bits is None:
            raise EncodeError("range", "is outside the range of single precision", -LARGEST_SINGLE, LARGEST_SINGLE)
        if value and not bits & 0x7FFFFFFF:
            raise EncodeError("off", "rounds to 0 in single precision")
        return 0 if bits == SINGLE_MINUS_ZERO else bits

    def decode(self, raw: int) -> Decimal:
        """Bits to the shortest decimal that means them."""
        value = single_value(raw)
        if not isfinite(value):
            raise DecodeError(f"0x{raw:08X} is not a finite number")
        return Decimal(repr(value))
