"""The files that a DL06 image is written to and read from, Intel HEX among them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from pidcfg.encoders.dl06.image import loop_start
from pidcfg.encoders.image import Image
from pidcfg.encoders.listing import FileKind, Listing, ListingError, Place, listing_kinds
from pidcfg.encoders.maps.dl06 import LOOP_TABLES, SPACE
from pidcfg.schemas.base import v_name
from pidcfg.schemas.dl06 import Dl06File
from pidcfg.text.references import Decision

# --- Intel HEX: bytes by address (Intel, Hexadecimal Object File Format Specification, revision A, 1988) --------------
#
# Read is all that the specification has and nothing else; start addresses say nothing of the memory. See
# `write_records`, `read_bytes`.

DATA_RECORD, END_RECORD, SEGMENT, START_SEGMENT, LINEAR, START_LINEAR = range(6)
RECORD_LENGTHS = {END_RECORD: 0, SEGMENT: 2, START_SEGMENT: 4, LINEAR: 2, START_LINEAR: 4}
SEGMENT_UNITS = {SEGMENT: 1 << 4, LINEAR: 1 << 16}  # what one of an extended address counts, in bytes
PAGE_BYTES, MAX_RECORD_BYTES = 1 << 16, 16
RECORD_PATTERN = re.compile(":(?:[0-9A-Fa-f]{2}){5,}")


def write_records(memory: Mapping[int, int]) -> str:
    """The bytes as records, in the order of their addresses."""
    page, paged, lines = None, max(memory, default=0) >= PAGE_BYTES, []
    for first, data in _byte_runs(memory):
        if paged and first // PAGE_BYTES != page:
            page = first // PAGE_BYTES
            lines.append(_record_text(LINEAR, 0, page.to_bytes(2)))
        lines.append(_record_text(DATA_RECORD, first % PAGE_BYTES, data))
    return "".join(f"{line}\n" for line in (*lines, _record_text(END_RECORD, 0, b"")))


def _byte_runs(memory: Mapping[int, int]) -> Iterator[tuple[int, bytes]]:
    """Bytes that stand in one record, with the address of the first."""
    places = sorted(memory)
    ends = [i for i, at in enumerate(places) if i and (at != places[i - 1] + 1 or at % PAGE_BYTES == 0)]
    for begin, end in zip([0, *ends], [*ends, len(places)], strict=True):
        for i in range(begin, end, MAX_RECORD_BYTES):
            yield places[i], bytes(memory[at] for at in places[i : min(i + MAX_RECORD_BYTES, end)])


def _record_text(kind: int, address: int, data: bytes) -> str:
    body = bytes((len(data), *address.to_bytes(2), kind, *data))
    return f":{body.hex()}{-sum(body) & 0xFF:02x}".upper()


def read_bytes(text: str) -> dict[int, int]:
    """The bytes of a file by their addresses; raises `ListingError`."""
    memory: dict[int, int] = {}
    base, has_ended, number = 0, False, 0
    for number, line in enumerate(text.splitlines(), start=1):
        if has_ended and line.strip():
            raise ListingError("something stands behind the end-of-file record", number)
        if line.strip():
            kind, address, data = _parse_record(line.rstrip(), number)
            base, has_ended = (
                int.from_bytes(data) * SEGMENT_UNITS[kind] if kind in SEGMENT_UNITS else base,
                kind == END_RECORD,
            )
            for place, byte in enumerate(data if kind == DATA_RECORD else b"", start=base + address):
                if place in memory or place >= base + PAGE_BYTES:
                    fault = "stands there twice" if place in memory else "is beyond the 64 KiB of its record"
                    raise ListingError(f"byte 0x{place:X} {fault}", number)
                memory[place] = byte
    if not has_ended:
        raise ListingError("the file ends without its end-of-file record", number or 1)
    return memory


def _parse_record(line: str, number: int) -> tuple[int, int, bytes]:
    """Type, address and data of a record."""
    if not RECORD_PATTERN.fullmatch(line):
        raise ListingError("a record is a colon and pairs of hexadecimal digits, five at least", number)
    body = bytes.fromhex(line[1:])
    length, address, kind, data = body[0], int.from_bytes(body[1:3]), body[3], body[4:-1]
    if length != len(data):
        raise ListingError(f"the record says {length} bytes of data and has {len(data)}", number)
    if sum(body) & 0xFF:
        raise ListingError(f"the checksum is {body[-1]:02X}, not {-sum(body[:-1]) & 0xFF:02X}", number)
    if kind != DATA_RECORD and (RECORD_LENGTHS.get(kind) != length or (address and kind != END_RECORD)):
        raise ListingError(f"no record of type {kind:02X} has {length} bytes of data at {address:04X}", number)
    return kind, address, data


# --- Intel HEX of 16-bit words: word address n is byte address 2n, low byte first -------------------------------------

WORD_BYTES = 2


def write_ihex(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """All words; names, ranges and units have no place in this format (and neither has the checklist)."""
    del checklist
    return write_records(
        {cell.number * WORD_BYTES + i: byte for cell in image.cells for i, byte in enumerate(_word_bytes(cell.raw))}
    )


def _word_bytes(word: int) -> bytes:
    return word.to_bytes(WORD_BYTES, "little")


def read_ihex(text: str) -> Listing:
    """All words; half a word is refused."""
    try:
        memory = read_bytes(text)
    except ListingError as error:
        raise ListingError(f"not Intel HEX: {error}", error.line) from None
    listing = Listing()
    for byte in sorted(memory):
        if byte % WORD_BYTES == 0:
            if byte + 1 not in memory:
                raise ListingError(
                    f"byte 0x{byte + 1:X} is missing, so the word at 0x{byte // WORD_BYTES:X} is incomplete"
                )
            listing.add(byte // WORD_BYTES, memory[byte] | memory[byte + 1] << 8, f"word 0x{byte // WORD_BYTES:X}")
        elif byte - 1 not in memory:
            raise ListingError(f"byte 0x{byte - 1:X} is missing, so the word at 0x{byte // WORD_BYTES:X} is incomplete")
    return listing


# --- The files that a DL06 image is written to and read from ----------------------------------------------------------


class Numbering:
    """The DirectLOGIC family numbers holding registers by the V-memory address itself."""

    @staticmethod
    def place(number: int) -> Place:
        """Where an address is."""
        return Place("holding", number)

    @staticmethod
    def find(table: str, register: int) -> tuple[int, int] | None:
        """The address of a holding register."""
        return (register, 0) if table == "holding" else None


def _read_rows(text: str) -> Listing:
    from pidcfg.encoders.dl06.spellings import read_rows

    return read_rows(text)


def _is_rows(text: str) -> bool:
    from pidcfg.encoders.dl06.spellings import looks_like_rows

    return looks_like_rows(text)


def _read_table(text: str) -> Listing:
    from pidcfg.encoders.dl06.spellings import read_table

    return read_table(text)


def _is_table(text: str) -> bool:
    from pidcfg.encoders.dl06.spellings import looks_like_table

    return looks_like_table(text)


NUMBERING = Numbering()
LISTINGS = listing_kinds(SPACE, "V-memory listing", NUMBERING)
FORMATS = LISTINGS | {
    "text": replace(LISTINGS["text"], read=_read_rows, looks_like=_is_rows),
    "csv": replace(LISTINGS["csv"], read=_read_table, looks_like=_is_table),
    "ihex": FileKind(
        "ihex",
        "Intel HEX, 16-bit words",
        write_ihex,
        read_ihex,
        lambda text: text.startswith(":"),
        may_be_partial=True,
    ),
}


CHECK_TRANSITION = "change the CPU from Program to Run: it reads V7640 and V7641 only then"
CHANGE_WORDS = "change words of the loop table later only with the loop in Manual and the PLC stopped"


D956 = Decision(
    956,
    "what must outlast a power cycle is a line of the checklist",
    "`encode` and `report` ask for the retentive memory and the battery of a DL06, and of a CLICK whether a register "
    "of a loop begins with its initial value or with the retained one. No ranges are stated.",
    "Public problems: a DL06 whose V7640 and V7641 were 0 after a power cycle (industrialmonitordirect.com, "
    "dl06-pid-loop-configuration-lost-after-power-cycle), a set point that came back as -201 (same site, "
    "automationdirect-dl205-pid-setpoint-not-retained-after-power-off), a CLICK whose registers went with its battery "
    "(same site, click-plc-c0-01dr-d-sram-backup-battery-memory-retention-time). The texts at hand name no retentive "
    "ranges, and pages of that site contradict each other.",
)
CHECK_RETENTIVE = (
    "check that V7640, V7641, {first} to {last}{profiles} lie in retentive memory, and look at the battery: without "
    "them no loop runs after a power cycle, or with another set point"
)


def _retentive_words(config: Dl06File) -> str:
    """What must outlast a power cycle: the set-up words and the loop table."""
    first = loop_start(config.plc, 0)
    last = loop_start(config.plc, len(config.loops)) - 1
    profiles = " and the ramp/soak tables" if any(loop.ramp_soak for loop in config.loops) else ""
    return CHECK_RETENTIVE.format(first=v_name(first), last=v_name(last), profiles=profiles)


def checklist(config: Dl06File) -> tuple[str, ...]:
    """What no download does, and what to compare by eye because the manual contradicts itself there."""
    items = (
        _compare_resets(config),
        _copy_values(config),
        CHECK_TRANSITION,
        _request_modes(config),
        _later_changes(config),
        _retentive_words(config) if config.loops else "",
    )
    return tuple(item for item in items if item) if config.loops else ()


def _request_modes(config: Dl06File) -> str:
    """Loops that are meant for another mode than the one in which they begin."""
    other_modes = [f"{loop.name} ({loop.mode})" for loop in config.loops if loop.mode != "manual"]
    return (
        f"request the mode of {', '.join(other_modes)}, inner loops first: new loops begin in Manual"
        if other_modes
        else ""
    )


def _copy_values(config: Dl06File) -> str:
    """PVs and outputs that no auto transfer carries."""
    table = LOOP_TABLES[1]

    def places(word: str, part: str) -> str:
        notes = [
            f"{loop.name} ({v_name(loop_start(config.plc, i) + table.offset_of(word))})"
            for i, loop in enumerate(config.loops)
            if getattr(loop, part).transfer is None and not (part == "output" and loop.name in majors)
        ]
        return ", ".join(notes)

    majors = {loop.cascade_from for loop in config.loops}
    pv, output = places("pv", "pv"), places("output", "output")
    parts = [f"the PV into the word of {pv}" if pv else "", f"the output from the word of {output}" if output else ""]
    carried = " and ".join(part for part in parts if part)
    return f"see that the ladder program copies {carried}: no auto transfer does" if carried else ""


def _later_changes(config: Dl06File) -> str:
    """How words are changed, also of loops that do not follow the CPU."""
    independent = [loop.name for loop in config.loops if loop.independent_of_cpu_mode]
    if not independent:
        return CHANGE_WORDS
    names = ", ".join(independent)
    return f"{CHANGE_WORDS}; of {names} set bit 15 of +00 to 0 before, so that they follow it, and to 1 afterwards"


def _compare_resets(config: Dl06File) -> str:
    """The reset word has one decimal in one place of the manual and two in another."""
    with_reset = [loop.name for loop in config.loops if loop.tuning.reset.duration is not None]
    if not with_reset or "reset_decimals" in config.plc.model_fields_set:
        return ""
    return (
        f"compare the reset time of {', '.join(with_reset)} in the PID dialog with the file: the manual gives its word "
        "one decimal in one place and two in another; then state `reset_decimals` under `plc`"
    )
