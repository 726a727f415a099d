"""Intel HEX of 16-bit words: word address n is byte address 2n, low byte first. The only module that knows intelhex."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import Listing, ListingError

if TYPE_CHECKING:
    from pidcfg.encoders.image import Image

BYTES = 2
END_OF_FILE = ":00000001FF"


def write_ihex(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """All words; names, ranges and units have no place in this format (and neither has the checklist)."""
    from intelhex import IntelHex

    del checklist
    memory = IntelHex()
    for cell in image.cells:
        memory.puts(cell.number * BYTES, cell.raw.to_bytes(BYTES, "little"))
    out = io.StringIO()
    memory.write_hex_file(out, eolstyle="native")
    return out.getvalue().replace("\r\n", "\n")


def read_ihex(text: str) -> Listing:
    """All words; half a word is refused."""
    from intelhex import IntelHex, IntelHexError

    try:
        memory = IntelHex(io.StringIO(text)).todict()
    except (IntelHexError, UnicodeError) as error:
        raise ListingError(f"not Intel HEX: {error}", getattr(error, "line", 1)) from None
    memory.pop("start_addr", None)
    rows = [row.strip().upper() for row in text.splitlines()]
    if END_OF_FILE not in rows:
        raise ListingError("the file ends without its end-of-file record", len(rows) or 1)
    end = rows.index(END_OF_FILE) + 1
    behind = next((number for number, row in enumerate(rows[end:], start=end + 1) if row), None)
    if behind is not None:
        raise ListingError("a record stands behind the end-of-file record: keep one of the two files", behind)
    listing = Listing()
    for byte in sorted(memory):
        if byte % BYTES == 0:
            if byte + 1 not in memory:
                raise ListingError(f"byte 0x{byte + 1:X} is missing, so the word at 0x{byte // BYTES:X} is incomplete")
            listing.add(byte // BYTES, memory[byte] | memory[byte + 1] << 8, f"word 0x{byte // BYTES:X}")
        elif byte - 1 not in memory:
            raise ListingError(f"byte 0x{byte - 1:X} is missing, so the word at 0x{byte // BYTES:X} is incomplete")
    return listing
