"""Intel HEX: bytes by address (Intel, Hexadecimal Object File Format Specification, revision A, 1988).

Read is all that the specification has and nothing else; start addresses say nothing of the memory. See `write`, `read`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import ListingError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

DATA, END, SEGMENT, START_SEGMENT, LINEAR, START_LINEAR = range(6)
LENGTHS = {END: 0, SEGMENT: 2, START_SEGMENT: 4, LINEAR: 2, START_LINEAR: 4}
UNITS = {SEGMENT: 1 << 4, LINEAR: 1 << 16}  # what one of an extended address counts, in bytes
PAGE, LONGEST = 1 << 16, 16
RECORD = re.compile(":(?:[0-9A-Fa-f]{2}){5,}")


def write(memory: Mapping[int, int]) -> str:
    """The bytes as records, in the order of their addresses."""
    page, paged, lines = None, max(memory, default=0) >= PAGE, []
    for first, data in _runs(memory):
        if paged and first // PAGE != page:
            page = first // PAGE
            lines.append(_record(LINEAR, 0, page.to_bytes(2)))
        lines.append(_record(DATA, first % PAGE, data))
    return "".join(f"{line}\n" for line in (*lines, _record(END, 0, b"")))


def _runs(memory: Mapping[int, int]) -> Iterator[tuple[int, bytes]]:
    """Bytes that stand in one record, with the address of the first."""
    places = sorted(memory)
    ends = [i for i, at in enumerate(places) if i and (at != places[i - 1] + 1 or at % PAGE == 0)]
    for begin, end in zip([0, *ends], [*ends, len(places)], strict=True):
        for i in range(begin, end, LONGEST):
            yield places[i], bytes(memory[at] for at in places[i : min(i + LONGEST, end)])


def _record(kind: int, address: int, data: bytes) -> str:
    body = bytes((len(data), *address.to_bytes(2), kind, *data))
    return f":{body.hex()}{-sum(body) & 0xFF:02x}".upper()


def read(text: str) -> dict[int, int]:
    """The bytes of a file by their addresses; raises `ListingError`."""
    memory: dict[int, int] = {}
    base, ended, number = 0, False, 0
    for number, line in enumerate(text.splitlines(), start=1):
        if ended and line.strip():
            raise ListingError("something stands behind the end-of-file record", number)
        if line.strip():
            kind, address, data = _parsed(line.rstrip(), number)
            base, ended = int.from_bytes(data) * UNITS[kind] if kind in UNITS else base, kind == END
            for place, byte in enumerate(data if kind == DATA else b"", start=base + address):
                if place in memory or place >= base + PAGE:
                    wrong = "stands there twice" if place in memory else "is beyond the 64 KiB of its record"
                    raise ListingError(f"byte 0x{place:X} {wrong}", number)
                memory[place] = byte
    if not ended:
        raise ListingError("the file ends without its end-of-file record", number or 1)
    return memory


def _parsed(line: str, number: int) -> tuple[int, int, bytes]:
    """Type, address and data of a record."""
    if not RECORD.fullmatch(line):
        raise ListingError("a record is a colon and pairs of hexadecimal digits, five at least", number)
    body = bytes.fromhex(line[1:])
    length, address, kind, data = body[0], int.from_bytes(body[1:3]), body[3], body[4:-1]
    if length != len(data):
        raise ListingError(f"the record says {length} bytes of data and has {len(data)}", number)
    if sum(body) & 0xFF:
        raise ListingError(f"the checksum is {body[-1]:02X}, not {-sum(body[:-1]) & 0xFF:02X}", number)
    if kind != DATA and (LENGTHS.get(kind) != length or (address and kind != END)):
        raise ListingError(f"no record of type {kind:02X} has {length} bytes of data at {address:04X}", number)
    return kind, address, data
