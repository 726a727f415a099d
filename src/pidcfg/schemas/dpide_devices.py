"""Devices of a Delta AS: where the operands of a DPIDE instruction can stand in the PLC's memory."""

from __future__ import annotations

import re
from typing import Annotated, NamedTuple

from pydantic import WithJsonSchema

from pidcfg.refs import Decision
from pidcfg.schemas.base import Model, Parser
from pidcfg.schemas.numbers import refuse, text_schema

D250 = Decision(
    250,
    "words stand in D0 to D29999, flags in X, Y, M, S, SM or a bit of D",
    "Real and double-word operands take two D registers; flags take X0.0 to X63.15, Y0.0 to Y63.15, M0 to M8191, S0 to "
    "S2047, SM0 to SM4095, or a bit of a D register such as D100.5. Other devices are refused.",
    "The marks of the operand table are lost, and it prints no upper ends; these are the ranges of the AS300.",
)

LAST_REGISTER = 29999
BLOCK = 30
"""Registers of I_MV: 15 double words."""
WORD = 2
"""Registers of a real number or a double word."""
FLAG_BANKS = {"M": 8191, "S": 2047, "SM": 4095}
"""Last numbers of the banks of single bits."""
BIT_BANKS = {"X": 63, "Y": 63, "D": LAST_REGISTER}
"""Last numbers of the words whose bits are written like ``X0.15``."""
BITS = 16
DIGITS = "(0|[1-9][0-9]{0,4})"
REGISTER = re.compile(f"D{DIGITS}")
FLAG = re.compile(f"(M|SM|S){DIGITS}")
BIT = re.compile(rf"(X|Y|D){DIGITS}\.(0|[1-9][0-9]?)")
LIKE_REGISTER = re.compile(r"[dD] ?0*([0-9]{1,5})")


class Place(NamedTuple):
    """Devices that an operand takes: their bank, first and last number; of a single bit of a word its number."""

    bank: str
    first: int
    last: int
    bit: int | None = None

    def __str__(self) -> str:
        end = f" to {self.bank}{self.last}" if self.last > self.first else ""
        return f"{self.bank}{self.first}{'' if self.bit is None else f'.{self.bit}'}{end}"

    def overlaps(self, other: Place) -> bool:
        """Whether both take the same device; two bits of one word are two devices."""
        apart = self.bit is not None and other.bit is not None and self.bit != other.bit
        return self.bank == other.bank and self.first <= other.last and other.first <= self.last and not apart


def place_of(operand: str, device: str) -> Place:
    """The devices of an operand that begins at a device which its field has let through."""
    if REGISTER.fullmatch(device):
        first = int(device.removeprefix("D"))
        return Place("D", first, first + (BLOCK if operand == "I_MV" else WORD) - 1)
    if match := FLAG.fullmatch(device):
        return Place(match.group(1), int(match.group(2)), int(match.group(2)))
    bank, number, bit = device[0], *device[1:].split(".")
    return Place(bank, int(number), int(number), int(bit))


def parse_register(value: object) -> str:
    """``D500``: the first register of an operand."""
    if not isinstance(value, str):
        refuse("address_form", "the address of a D register is wanted", help="write it like D500")
    like = LIKE_REGISTER.fullmatch(value)
    if like is None:
        refuse("address_form", f"{value!r} is not the address of a D register", help="write it like D500")
    only = f"D{int(like.group(1))}"
    if int(like.group(1)) > LAST_REGISTER:
        refuse("address_form", f"{only} does not exist", help=f"addresses go from D0 to D{LAST_REGISTER}")
    if value != only:
        refuse("address_form", f"{value!r} is not spelled as an address", help=f"write {only}", only=only)
    return only


def parse_flag_device(value: object) -> str:
    """``M10``, ``Y0.1``, ``D100.5``: a single bit."""
    if not isinstance(value, str):
        refuse("address_form", "the address of a bit is wanted", help="write it like M10, Y0.1 or D100.5")
    single, bit = FLAG.fullmatch(value), BIT.fullmatch(value)
    if single is None and bit is None:
        refuse("address_form", f"{value!r} is not the address of a bit", help="write it like M10, Y0.1 or D100.5")
    fits = (single is not None and int(single.group(2)) <= FLAG_BANKS[single.group(1)]) or (
        bit is not None and int(bit.group(2)) <= BIT_BANKS[bit.group(1)] and int(bit.group(3)) < BITS
    )
    if not fits:
        banks = [f"{bank}0.0 to {bank}{last}.15" for bank, last in BIT_BANKS.items()]
        banks += [f"{bank}0 to {bank}{last}" for bank, last in FLAG_BANKS.items()]
        refuse("address_form", f"{value} does not exist", help=f"there are {', '.join(banks)}")
    return str(value)


Register = Annotated[str, Parser(parse_register), WithJsonSchema(text_schema(REGISTER.pattern, "D500"))]
Flag = Annotated[
    str,
    Parser(parse_flag_device),
    WithJsonSchema(text_schema(f"{FLAG.pattern}|{BIT.pattern}", "M10", "Y0.1", "D100.5")),
]


class Devices(Model):
    """Devices of operands other than I_MV; words take two D registers, flags one bit."""

    PID_RUN: Flag | None = None
    """Bit of PID_RUN."""
    SV: Register | None = None
    """First register of SV."""
    PV: Register | None = None
    """First register of PV."""
    PID_MODE: Register | None = None
    """First register of PID_MODE; the autotune needs one."""
    PID_MAN: Flag | None = None
    """Bit of PID_MAN."""
    MOUT_AUTO: Flag | None = None
    """Bit of MOUT_AUTO."""
    CYCLE: Register | None = None
    """First register of CYCLE."""
    Kc_Kp: Register | None = None
    """First register of Kc_Kp; the autotune writes it."""
    Ti_Ki: Register | None = None
    """First register of Ti_Ki; the autotune writes it."""
    Td_Kd: Register | None = None
    """First register of Td_Kd; the autotune writes it."""
    Tf: Register | None = None
    """First register of Tf; the autotune writes it."""
    PID_EQ: Flag | None = None
    """Bit of PID_EQ."""
    PID_DE: Flag | None = None
    """Bit of PID_DE."""
    PID_DIR: Flag | None = None
    """Bit of PID_DIR."""
    ERR_DBW: Register | None = None
    """First register of ERR_DBW."""
    MV_MAX: Register | None = None
    """First register of MV_MAX."""
    MV_MIN: Register | None = None
    """First register of MV_MIN."""
    MOUT: Register | None = None
    """First register of MOUT."""
    BIAS: Register | None = None
    """First register of BIAS."""
    MV: Register | None = None
    """First register of MV."""

    def given(self) -> dict[str, str]:
        """Device by operand."""
        return {name: getattr(self, name) for name in type(self).model_fields if getattr(self, name) is not None}
