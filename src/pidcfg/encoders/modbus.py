"""A Modbus map of the words: which holding register a client reads or writes, with the value to write."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import DECIMAL, Listing, ListingError, comments, csv_rows
from pidcfg.encoders.words import WORD_MAX

if TYPE_CHECKING:
    from pidcfg.encoders.image import Image

COLUMNS = ("register", "reference", "address", "value", "hex", "loop", "field")
FIVE_DIGITS = 9_999
"""Registers up to here have a five-digit reference 4xxxx; the others a six-digit one."""


def reference(register: int) -> int:
    """The conventional number of a 0-based holding register: 1024 is 41025."""
    return (40_001 if register < FIVE_DIGITS else 400_001) + register


def write_modbus(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """Holding registers in order; the DirectLOGIC family numbers them by the V-memory address itself."""
    out = io.StringIO()
    out.writelines(f"{line}\n" for line in comments(image, checklist))
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    for c in image.cells:
        writer.writerow((c.number, reference(c.number), c.address, c.value, c.hex, c.loop or "", c.field))
    return out.getvalue()


def read_modbus(text: str) -> Listing:
    """Registers and values; the other columns are for people."""
    found = Listing()
    for number, row in csv_rows(text, found, required=("register", "value")):
        for key in ("register", "value"):
            if not DECIMAL.fullmatch(row[key]) or int(row[key]) > WORD_MAX:
                raise ListingError(f"{key} {row[key]!r} is not a number of 0 to {WORD_MAX}", number)
        found.add(int(row["register"]), int(row["value"]), f"register {row['register']}", number)
    return found
