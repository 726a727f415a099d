"""The files that an EZLogix image is written to and read from, the tag list among them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from pidcfg.encoders.codecs import Choice, Distance, Implied, Position
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.listing import (
    CONFLICT,
    LOOP_PREFIX,
    PLC_PREFIX,
    FileKind,
    Listing,
    ListingError,
    UnwritableError,
    column_names,
    csv_lines,
    csv_text,
    find_delimiter,
    listing_kinds,
    settings_comments,
    shorten_names,
    table_rows,
)
from pidcfg.encoders.maps.ezlogix import MAP_SPACE, PULSE_REGISTERS, R_BLOCK, S_BLOCK, SPACE, TAG_NAME, VARIABLES
from pidcfg.encoders.modbus_map import bank_template_rows, map_kind
from pidcfg.encoders.regmap import Word
from pidcfg.schemas.ezlogix import EzlogixFile, PlcSettings, tag_name
from pidcfg.text.paths import Data
from pidcfg.text.references import Decision

# ----------------------------------------------------------------------------------------------------------------------
# The tag list of an EZLogix image: one tag a loop variable, written, added to a list of the user's, and read back.
# The columns are ours, since the vendor's are not public. What no register holds stands in comment lines as in the
# other listings.

D155 = Decision(
    155,
    "the tag list holds the variables of the blocks",
    "One tag for each register and discrete that the manual names, those of the control output only where it is "
    "enabled; settings with their raw value, the others without. PV, CV and control output get none.",
    "Those three are entered in the dialog as tags, so they are there before the loop is.",
)
D156 = Decision(
    156,
    "a tag that exists is left as it is",
    "A tag whose name or address stands in the user's list is not created but reported, also with another value.",
    "The vendor's own tool creates no tag that exists, and says which.",
)

COLUMNS = ("tag", "address", "type", "value", "loop", "field", "comment")
NUMBER_PATTERN = re.compile(r"[0-9]{1,5}")
BYTE_ORDER_MARK = "\ufeff"
TABLES = {"R": R_BLOCK, "S": S_BLOCK}
BLOCK_KEYS = {"R": "registers", "S": "discretes"}


class Tag(NamedTuple):
    """One row of a tag list."""

    tag: str
    address: str
    type: str
    value: str
    loop: str
    field: str
    comment: str


def make_tags(image: Image) -> list[Tag]:
    """The tags of all loops in address order; raises `UnwritableError` for a name that cannot be one."""
    template = str(image.plc.get("tag_names", PlcSettings.model_fields["tag_names"].default))
    numbers = {entry["loop"]: i for i, entry in enumerate(image.settings, start=1)}
    loops_with_pulses = {entry["loop"] for entry in image.settings if (entry.get("output") or {}).get("pulse")}
    rows: dict[str, Tag] = {}
    for cell in image.cells:
        is_variable = cell.field in VARIABLES and cell.loop is not None
        if not is_variable or (cell.field in PULSE_REGISTERS and cell.loop not in loops_with_pulses):
            continue
        row = _make_tag(cell, template, numbers.get(cell.loop, 0))
        other = rows.setdefault(row.tag.casefold(), row)
        if other is not row:
            raise UnwritableError(
                f"{other.address} and {row.address} would both have the tag {row.tag}; `plc.tag_names` needs {{loop}}, "
                "or other names of loops"
            )
    return list(rows.values())


def _make_tag(cell: Cell, template: str, number: int) -> Tag:
    loop = str(cell.loop)
    name = tag_name(template, number, loop, VARIABLES[cell.field])
    if not TAG_NAME.fullmatch(name):
        raise UnwritableError(
            f"loop {loop}: {name!r} is not usable as a tag; rename the loop with letters, digits and _, or use "
            "{loop} in `plc.tag_names`"
        )
    bank, _ = SPACE.bank_and_number(cell.number)
    word = TABLES[bank.prefix].words[TABLES[bank.prefix].offset_of(cell.field)]
    value = cell.text if cell.access == "setting" else ""
    return Tag(name, cell.address, cell.kind.name, value, loop, cell.field, _comment_text(word))


def _comment_text(word: Word) -> str:
    """The register's title, and what one of its counts is worth."""
    codec = word.codec
    if isinstance(codec, Choice):
        return f"{word.title}: {codec.notation}"
    if isinstance(codec, Position | Distance) or word.unit == "pv":
        return f"{word.title}, counts"
    step = [f"{codec.step:f}"] if isinstance(codec, Implied) and codec.decimals else []
    return ", ".join([word.title, *filter(None, [" ".join([*step, word.unit]).strip()])])


def write_tags(image: Image, checklist: tuple[str, ...] = ()) -> str:
    """The whole list, with what no register holds above it."""
    del checklist
    rows = make_tags(image)
    return csv_text(COLUMNS, rows, settings_comments(image))


def read_tags(text: str) -> Listing:
    """Values of R and S tags; the loops from the comment lines, else from the columns ``loop`` and ``field``."""
    listing = Listing(is_mixed=True)
    rows = _read_rows(text, listing)
    for line, row in rows:
        number, value = SPACE.parse(row["address"]), row.get("value", "")
        if number is None or not value:
            continue
        kind = SPACE.kind_of(number)
        raw = kind.read(int(value)) if NUMBER_PATTERN.fullmatch(value) else None
        if raw is None:
            raise ListingError(f"{row['tag']} ({row['address']}): the value {value[:40]!r} is not {kind.holds}", line)
        listing.add(number, raw, row["address"], line)
    if not listing.settings:
        listing.settings = tuple(_loop_settings(rows))
    _add_pulse_times(listing)
    return listing


def _read_rows(text: str, listing: Listing) -> list[tuple[int, dict[str, str]]]:
    """The rows with their lines; a tag's name twice is refused."""
    rows = list(table_rows(text.removeprefix(BYTE_ORDER_MARK), listing, required=("tag", "address")))
    for _, row in rows:
        row["address"] = row["address"].upper()
    lines: dict[str, int] = {}
    for line, row in rows:
        first = lines.setdefault(row["tag"].casefold(), line)
        if first != line:
            raise ListingError(f"the tag {row['tag'][:60]} stands here again, after line {first}", line)
    return rows


def _loop_settings(rows: Iterable[tuple[int, Mapping[str, str]]]) -> Iterator[Data]:
    """Where the blocks of each loop begin, as its tags say; they must agree."""
    loops: dict[str, Data] = {}
    for line, row in rows:
        number, name = SPACE.parse(row["address"]), row.get("loop")
        prefix = "" if number is None else SPACE.bank_and_number(number)[0].prefix
        word = next((w for w in TABLES[prefix].words if w.name == row.get("field")), None) if prefix else None
        if number is None or word is None or not name:
            continue
        entry = loops.setdefault(name, {"loop": name, "output": {"pulse": None}})
        start = f"{prefix}{SPACE.bank_and_number(number)[1] - word.offset}"
        if entry.setdefault(BLOCK_KEYS[prefix], start) != start or SPACE.parse(start) is None:
            raise ListingError(f"{row['tag']} at {row['address']} is not in the block of {name} with its others", line)
        if word.name in PULSE_REGISTERS:
            entry.pop("output", None)
    yield from loops.values()


def _add_pulse_times(listing: Listing) -> None:
    """A loop without a control output has no tags for its times, which then are 0."""
    for entry in listing.settings:
        output, base = entry.get("output"), entry.get("registers")
        start = SPACE.parse(base) if isinstance(base, str) else None
        if start is None or not isinstance(output, dict) or output.get("pulse", "") is not None:
            continue
        for field in PULSE_REGISTERS:
            number = start + R_BLOCK.offset_of(field)
            if number not in listing.words:
                listing.add(number, 0, SPACE.name(number))


def merge_tags(image: Image, text: str) -> tuple[str, tuple[str, ...]]:
    """A list of the user's with the tags that are not in it (D156), in the columns that it has."""
    listing = Listing()
    rows = _read_rows(text, listing)
    head, separator = (
        column_names(text.removeprefix(BYTE_ORDER_MARK)),
        find_delimiter(text.removeprefix(BYTE_ORDER_MARK)),
    )
    if not head:
        raise ListingError(f"the list has no header; it begins with a line like {','.join(COLUMNS)}")
    by_tag = {row["tag"].casefold(): row for _, row in rows}
    by_address = {row["address"]: row for _, row in rows}
    created: list[Tag] = []
    existing: list[str] = []
    notes: list[str] = []
    for tag in make_tags(image):
        same_address, same_name = by_address.get(tag.address), by_tag.get(tag.tag.casefold())
        if same_address is None and same_name is None:
            created.append(tag)
            continue
        if same_address is same_name:
            existing.append(tag.tag)
        notes += _difference_notes(tag, same_address, same_name)
    notes += _differing_settings(image, listing)
    end = "\r\n" if "\r\n" in text else "\n"
    added = "".join(line + end for line in _missing_comments(image, listing))
    cells = [[getattr(tag, name) if name in COLUMNS else "" for name in head] for tag in created]
    added += csv_lines(cells, end, separator)
    merged = text + ("" if text.endswith("\n") or not added else end) + added
    if len(_read_rows(merged, Listing())) != len(rows) + len(created):
        raise ListingError("the tags could not be added to this file")
    if "value" not in head:
        notes.append("the list has no column value, so the values are not in it")
    return merged, (f"created {len(created)}, already there: {shorten_names(existing) or 'none'}", *notes)


def _missing_comments(image: Image, listing: Listing) -> Iterator[str]:
    """The comment lines of loops that the list does not know yet."""
    loops = [entry.get("loop") for entry in listing.settings]
    lines = [line for line in settings_comments(image) if line.startswith((PLC_PREFIX, LOOP_PREFIX))]
    if not listing.plc:
        yield lines[0]
    for entry, line in zip(image.settings, lines[1:], strict=True):
        if entry["loop"] not in loops:
            yield line


def _differing_settings(image: Image, listing: Listing) -> Iterator[str]:
    """What the user's list says otherwise of what no register holds, such as the action."""
    pairs = [(PLC_PREFIX, listing.plc, image.plc)] if listing.plc else []
    for entry in image.settings:
        same = [theirs for theirs in listing.settings if theirs.get("loop") == entry["loop"]]
        pairs += [(f"{LOOP_PREFIX}{entry['loop']}", theirs, entry) for theirs in same]
    for name, theirs, own in pairs:
        keys = [key for key in {**theirs, **own} if theirs.get(key) != own.get(key)]
        if keys:
            yield f"left as it is: the line {name.strip()!r}; the configuration says otherwise in {', '.join(keys)}"


def _difference_notes(
    tag: Tag, same_address: Mapping[str, str] | None, same_name: Mapping[str, str] | None
) -> Iterator[str]:
    """What the user's list says otherwise."""
    if same_address is not None and same_address is same_name:
        value = same_address.get("value", "") or "(none)"
        if tag.value and value != tag.value:
            yield f"left with its value {value}: {tag.tag} ({tag.address}); the configuration says {tag.value}"
        return
    reasons = []
    if same_address is not None:
        reasons.append(f"{tag.address} has the tag {same_address['tag']}")
    if same_name is not None:
        reasons.append(f"the name is that of {same_name['address']}")
    yield f"{CONFLICT}, left as it is: {tag.tag} ({tag.address}) was not created, since {' and '.join(reasons)}"


# --- The files that an EZLogix image is written to and read from ------------------------------------------------------

FORMATS = listing_kinds(SPACE, "register listing") | {
    "tags": FileKind(
        "tags",
        "tag list (CSV)",
        write_tags,
        read_tags,
        lambda text: {"tag", "address"} <= set(column_names(text)),
        merge=merge_tags,
        is_complete=False,
    ),
    "modbus-map": map_kind(lambda _image: bank_template_rows(SPACE, MAP_SPACE)),
}


def checklist(config: EzlogixFile) -> tuple[str, ...]:
    """What stands in the PID dialog only, to be entered by hand."""
    loops = [f"{loop.name}: {loop.algorithm}, {loop.action}, {loop.pv.tag}, {loop.output.tag}" for loop in config.loops]
    items = [
        "set in the PID dialog, since no register holds them: algorithm, controller action, PV and CV tag of "
        + "; ".join(loops)
    ]
    pulsed = [f"{loop.name} ({loop.output.pulse.tag})" for loop in config.loops if loop.output.pulse is not None]
    if pulsed:
        items.append(f"enable the control output in the PID dialog: {', '.join(pulsed)}")
    stopped = "check" if config.plc.process_when_stopped else "clear"
    items.append(f"{stopped} 'Process PID when PLC is Stopped' in the PID dialog")
    return tuple(items)
