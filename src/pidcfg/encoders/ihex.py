"""Intel HEX of 16-bit words: word address n is byte address 2n, low byte first."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.intel_hex import read, write
from pidcfg.encoders.listing import Listing, ListingError

if TYPE_CHECKING:
    from pidcfg.encoders.image import Image

BYTES = 2


def write_ihex(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """All words; names, ranges and units have no place in this format (and neither has the checklist)."""
    del checklist
    return write({cell.number * BYTES + i: byte for cell in image.cells for i, byte in enumerate(_bytes(cell.raw))})


def _bytes(word: int) -> bytes:
    return word.to_bytes(BYTES, "little")


def read_ihex(text: str) -> Listing:
    """All words; half a word is refused."""
    try:
        memory = read(text)
    except ListingError as error:
        raise ListingError(f"not Intel HEX: {error}", error.line) from None
    listing = Listing()
    for byte in sorted(memory):
        if byte % BYTES == 0:
            if byte + 1 not in memory:
                raise ListingError(f"byte 0x{byte + 1:X} is missing, so the word at 0x{byte // BYTES:X} is incomplete")
            listing.add(byte // BYTES, memory[byte] | memory[byte + 1] << 8, f"word 0x{byte // BYTES:X}")
        elif byte - 1 not in memory:
            raise ListingError(f"byte 0x{byte - 1:X} is missing, so the word at 0x{byte // BYTES:X} is incomplete")
    return listing
