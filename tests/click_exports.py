"""CLICK's own exports of all addresses, made from their shapes: too large to be kept as files."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

HEAD = "Address,Data Type,Modbus Address,Function Code,Nickname,Initial Value,Retentive,Address Comment"
COIL, INPUTS, FIRST_HOLDING, FIRST_INPUT = "FC=01,05,15", "FC=02", 400_001, 300_001
HOLDING, INPUT = "FC=03,06,16", "FC=04"
PLAIN = (
    # bank, last, type, first register, registers each, function codes, initial value, retentive
    ("C", 2000, "BIT", 0x4000, 1, COIL, "0", "No"),
    ("T", 500, "BIT", 0xB000, 1, INPUTS, "0", "No"),
    ("CT", 250, "BIT", 0xC000, 1, INPUTS, "0", "Yes"),
    ("SC", 1000, "BIT", 0xF000, 1, INPUTS, "0", "No"),
    ("DS", 4500, "INT", 0x0000, 1, HOLDING, "0", "Yes"),
    ("DD", 1000, "INT2", 0x4000, 2, HOLDING, "0", "Yes"),
    ("DH", 500, "HEX", 0x6000, 1, HOLDING, "0", "Yes"),
    ("DF", 500, "FLOAT", 0x7000, 2, HOLDING, "0", "Yes"),
)
LATE = (
    ("TD", 500, "INT", 0xB000, 1, HOLDING, "0", "No"),
    ("CTD", 250, "INT2", 0xC000, 2, HOLDING, "0", "Yes"),
    ("SD", 1000, "INT", 0xF000, 1, INPUT, "0", "No"),
)
SYSTEM = {"SC1": "_Always_ON", "SC2": "_1st_SCAN", "SC19": "_PLC_Error", "SD1": "_PLC_Error_Code", "SD9": "_PLC_Error"}
"""Some of the nicknames that CLICK gives itself, one of them twice."""
FIRST = {COIL: 1, INPUTS: 100_001, HOLDING: FIRST_HOLDING, INPUT: FIRST_INPUT}
"""The number that people count by of the first register of each kind."""


def rows(style: str) -> Iterator[str]:
    """The rows of an export of all addresses; ``style``: how it writes Modbus addresses, ``hex`` or ``984``."""
    for address, kind, register, codes, value, retentive in (
        *_switches(),
        *_banks(PLAIN),
        *_bytes(),
        *_banks(LATE),
        *_text(),
    ):
        where = f"{register:04X}h" if style == "hex" else str(FIRST[codes] + register)
        yield f'{address},{kind},{where},"{codes}","{SYSTEM.get(address, "")}",{value},{retentive},""'


Parts = tuple[str, str, int, str, str, str]
"""Address, type, register, function codes, initial value, retentive."""


def _switches() -> Iterator[Parts]:
    """Inputs and outputs, sixteen a slot."""
    slots = ((1, 0), (21, 0x10), *((100 * n + 1, 0x20 * n) for n in range(1, 9)))
    for bank, base, codes in (("X", 0, INPUTS), ("Y", 0x2000, COIL)):
        for first, register in slots:
            for i in range(16):
                yield f"{bank}{first + i:03d}", "BIT", base + register + i, codes, "0", "No"


def _banks(banks: tuple[tuple[str, int, str, int, int, str, str, str], ...]) -> Iterator[Parts]:
    for bank, last, kind, base, each, codes, value, retentive in banks:
        for n in range(1, last + 1):
            yield f"{bank}{n}", kind, base + each * (n - 1), codes, value, retentive


def _bytes() -> Iterator[Parts]:
    """Inputs and outputs as words, whose upper halves but the first have no address."""
    for bank, base, codes in (("XD", 0xE000, INPUT), ("YD", 0xE200, HOLDING)):
        for register in range(18):
            address = f"{bank}0u" if register == 1 else "" if register % 2 else f"{bank}{register // 2}"
            yield address, "HEX", base + register, codes, "0", "No"


def _text() -> Iterator[Parts]:
    for n in range(1, 1001):
        yield f"TXT{n}", "TEXT", 0x9000 + (n - 1) // 2, HOLDING, "", "Yes"


def export(style: str) -> str:
    """The whole file: 13,357 lines, the header among them, of which 16 rows have no address."""
    return "".join(f"{line}\n" for line in (HEAD, *rows(style)))
