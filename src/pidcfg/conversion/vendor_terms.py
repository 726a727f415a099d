"""The terms of a configuration's registers or named parameters, and what of an image differs from a listing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

from pidcfg.conversion.terms import (
    CALCULATED_TEXT,
    OWNER_NAME_KEYS,
    SETPOINT_SWITCH,
    SIGNALS,
    Item,
    Kind,
    Leaf,
    Owner,
    OwnerKind,
    Subject,
    Terms,
    content_of,
    file_items,
    file_owner,
    flatten,
    item_kind,
    json_number,
    setting_items,
    trim_unit,
    unit_names,
    unit_of,
    value_and_unit,
)
from pidcfg.encoders.codecs import Choice, DecodeError
from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.decoding import Reading, owner_name
from pidcfg.encoders.image import Block
from pidcfg.encoders.listing import Listing, shorten_names
from pidcfg.encoders.parameters import AnyImage, Entry, content_text, read_content
from pidcfg.encoders.regmap import D345, Bits, NoRegisterError, Point, Word, Writer, writer_of
from pidcfg.schemas.base import Quantity, unit_text
from pidcfg.schemas.iec import BOOL, DINT, LOOP_MODE, LREAL, Wire
from pidcfg.text.paths import dotted_text, is_given, outer_keys, parse_path, value_at
from pidcfg.text.references import Decision
from pidcfg.vendors import Vendor

# --- Terms of a vendor with registers: every row of its map that a loop has, with the register's content --------------

SETPOINT_VALUE = f"{SETPOINT_SWITCH}.value"
LIMIT_ENDS = ("limits.0", "limits.1")
"""Last steps of keys whose words are limits whatever they hold: 0 counts is one, too."""
LOOP_COUNT, LOOP_TABLE = "plc.number_of_loops", "plc.loop_table"
"""Registers of a set-up that says which loops the PLC calculates, and where they begin."""
LOOP_PATH_STEPS = 2
"""Steps of the place of a loop: ``("loops", 0)``."""


def memory_terms(subject: Subject) -> Terms:
    """The loops and the set-up of a file or listing."""
    setup = [_Block(subject, block, subject.config) for block in subject.encoding.blocks if not block.path]
    registers = {key: item for block in setup for key, item in block.items((), {})}
    setup_values = {path: value for block in setup for path, value in block.row_values()}
    loops, settings, shift = [], subject.settings, _loop_shift(subject, setup_values)
    outputs = {tag: loop.name for loop in subject.config.loops if (tag := getattr(loop.output, "tag", None))}
    for i, loop in enumerate(subject.config.loops):
        own_blocks = [block for block in subject.encoding.blocks if block.path[:2] == ("loops", i)]
        blocks = [_Block(subject, block, loop, outputs) for block in own_blocks]
        values = {path: value for block in blocks if not block.prefix for path, value in block.row_values()}
        writers: tuple[Writer, ...] = tables_of(subject.vendor).WRITERS
        items = {key: item for block in blocks for key, item in block.items(writers, values)}
        writers_by_name, entry = {row.name: row for row in writers if row.applies(values)}, settings[i]
        items |= setting_items(entry, loop, writers_by_name, subject.faults(loop.name))
        items |= dict(_table_items(blocks)) if subject.reading is None else {}
        if entry.get(SETPOINT_SWITCH) is False:
            items[SETPOINT_VALUE] = replace(items[SETPOINT_VALUE], kind="live")
        items |= dict(file_items(loop, subject, [*items, *(key for block in blocks for key in block.other_keys())]))
        items |= _calculated_item(registers, setup_values, i)
        addresses = " ".join(_address_name(subject, b.block.start + shift) for b in blocks if not b.prefix)
        loops.append(Owner(loop.name, "loop", addresses, items, subject.is_described))
    owners = (file_owner(subject, registers), *loops)
    reading = subject.reading
    if reading is None:
        return Terms(owners)
    words, space = reading.listing.words, subject.encoding.space
    return Terms(owners, is_listing=True, has_address=lambda address: space.parse(address.partition(".")[0]) in words)


def _calculated_item(registers: Mapping[str, Item], setup_values: Mapping[str, Any], i: int) -> dict[str, Item]:
    """Whether the PLC calculates loop ``i``, where a register says how many loops it does."""
    item, count = registers.get(LOOP_COUNT), setup_values.get(LOOP_COUNT)
    if item is None or count is None:
        return {}
    value = CALCULATED_TEXT if i < count else "not calculated"
    return {LOOP_COUNT: replace(item, value=value, content=value, unit="", file_only=True)}


def _loop_shift(subject: Subject, setup_values: Mapping[str, object]) -> int:
    """How far the loops of a listing stand behind those whose places it is compared at."""
    start = setup_values.get(LOOP_TABLE)
    if subject.reading is None or not subject.reading.fault or start is None:
        return 0
    return int(start - value_at(subject.config, parse_path(LOOP_TABLE)))


def _address_name(subject: Subject, number: int) -> str:
    """An address; a set-up that is no value may place a loop where nothing is."""
    try:
        return str(subject.encoding.space.name(number))
    except NoRegisterError:
        return "no register"


def _table_items(blocks: list[_Block]) -> Iterator[tuple[str, Item]]:
    """The tables of a loop that a file may leave alone, ``ramp_soak.steps``: that it writes them, if only zeros."""
    for key in dict.fromkeys(block.prefix.rstrip(".0123456789") for block in blocks if block.prefix):
        yield key, Item(key, "the table is written", content=True, file_only=True)


class _Block:
    """A block of registers of one side."""

    def __init__(self, subject: Subject, block: Block, model: Any, outputs: Mapping[str, str] | None = None) -> None:
        self.subject, self.block, self.model = subject, block, model
        self.outputs = outputs or {}
        """Loops by the register that their output is written to, where they choose it: in a cascade another's."""
        inner = dotted_text(block.path[LOOP_PATH_STEPS:])
        self.prefix = f"{inner}." if inner else ""
        self.units = unit_names(model)
        self.is_own = subject.reading is None or not subject.reading.fault

    def raw_content(self, offset: int) -> int | None:
        """The content of a register; None: the listing does not hold it."""
        if self.subject.reading is None:
            return self.block.encoded.words[offset]
        word: int | None = self.subject.reading.listing.words.get(self.block.start + offset)
        return word

    def word_fault(self, offset: int) -> str:
        """Why the listing's word is no value."""
        reading = self.subject.reading
        return "" if reading is None else reading.unreadable.get(self.block.start + offset, "")

    def row_values(self) -> Iterator[tuple[str, Any]]:
        """What the registers and choices mean, by their paths; None: nothing."""
        for row in self.block.table.points:
            if row.path is not None:
                yield row.path, self.row_value(row)

    def row_value(self, row: Point) -> Any:
        """What a row means."""
        raw = self.raw_content(row.offset)
        try:
            if raw is None or self.word_fault(row.offset):
                return None
            return row.decode(raw, self.block.scales)
        except (DecodeError, ArithmeticError):
            return None

    def other_keys(self) -> list[str]:
        """Keys that say in other words what a register holds."""
        return [row.other_key for row in self.block.table.words if row.other_key is not None]

    def items(self, writers: tuple[Writer, ...], values: Mapping[str, Any]) -> Iterator[tuple[str, Item]]:
        """Every row; the bits of a word that no key sets are one item, and those that are reserved another."""
        by_offset: dict[int, list[Bits]] = {}
        for row in self.block.table.bits:
            by_offset.setdefault(row.offset, []).append(row)
        for word in self.block.table.words:
            if not self.block.loop and word.access == "status":
                continue
            rows = by_offset.get(word.offset, [])
            writer = writer_of(writers, word.name, values)
            yield from (
                (f"{self.prefix}{row.path}", self.choice_item(word, row)) for row in rows if row.path is not None
            )
            if not rows:
                item = self.register_item(word, writer)
                yield self.prefix + (word.path or word.name), replace(item, is_optional=bool(self.prefix))
            if bits_left := sum(row.mask for row in rows if row.path is None and row.access != "reserved"):
                yield self.prefix + word.name, self.bits_item(word, word.name, bits_left, "live")
            if reserved := sum(row.mask for row in rows if row.access == "reserved"):
                name = f"{word.name}.reserved"
                yield self.prefix + name, self.bits_item(word, name, reserved, "reserved")

    def choice_item(self, word: Word, row: Bits) -> Item:
        """A choice inside a word."""
        raw, key = self.raw_content(row.offset), f"{self.prefix}{row.path}"
        address, text = self.address_and_text(row.offset)
        if raw is None:
            return Item(key, address=address, is_known=False)
        if len(row.bits) == 1:
            address, text = f"{address}.{row.bits[0]}", str(raw >> row.bits[0] & 1)
        access = row.access if row.access != "setting" else word.access
        kind, value, fault = item_kind(access, None), self.row_value(row), self.word_fault(row.offset)
        number = self.block.start + row.offset
        return Item(key, json_number(value), "", raw & row.mask, address, text, kind, fault=fault, number=number)

    def bits_item(self, word: Word, name: str, mask: int, kind: Kind) -> Item:
        """The bits of a word that the PLC sets, or that ask it for something; or those that are nobody's."""
        raw, (address, text) = self.raw_content(word.offset), self.address_and_text(word.offset)
        content = None if raw is None else raw & mask
        key, number = self.prefix + name, self.block.start + word.offset
        return Item(key, None, "", content, address, text, kind, is_known=raw is not None, number=number)

    def register_item(self, word: Word, writer: Writer | None) -> Item:
        """A register of its own."""
        raw, (address, text) = self.raw_content(word.offset), self.address_and_text(word.offset)
        key = self.prefix + (word.path or word.name)
        if raw is None:
            return Item(key, address=address, is_known=False)
        key, value, unit = self.describe_content(word, raw, key)
        kind, author = item_kind(word.access, writer), "" if writer is None else writer.writer
        if outer := self.outputs.get(address):
            kind, author = "live", f"{outer}, whose output it is"
        number = self.block.start + word.offset
        return Item(key, value, unit, raw, address, text, kind, author, self.word_fault(word.offset), number=number)

    def describe_content(self, word: Word, raw: int, key: str) -> tuple[str, object, str]:
        """The key of a register, what the file says of it, and its unit; else what its content means."""
        other = None if word.other_key is None or not self.is_own else value_at(self.model, parse_path(word.other_key))
        if other is not None and word.other_key is not None:
            return word.other_key, json_number(other), ""
        if self.word_fault(word.offset) or word.path is None:
            return key, None, ""
        spell = getattr(word.codec, "spell", None)
        if spell is not None:
            return key, spell(raw, self.subject.encoding.space.name) if raw else None, ""
        leaf = None if isinstance(word.codec, Choice) or not self.is_own else self.find_leaf(key)
        if leaf is not None:
            return key, *value_and_unit(leaf, self.model, self.subject.vendor, self.units)
        value = self.row_value(word)
        is_given = bool(raw) or isinstance(word.codec, Choice) or word.path.endswith(LIMIT_ENDS)
        is_raw = isinstance(value, Quantity) and (value.counts or not self.block.scales[str(word.scale)].range)
        unit = "counts" if is_raw else unit_text(word.unit, self.units)
        return key, json_number(value) if is_given else None, trim_unit(unit)

    def find_leaf(self, key: str) -> Leaf | None:
        """The value that the configuration gives for a key; None: it gives none."""
        path = parse_path(key)
        value = value_at(self.model, path)
        field_path = path[:-1] if isinstance(path[-1], int) else path
        model = value_at(self.model, field_path[:-1]) if field_path[:-1] else self.model
        return None if value is None or model is None else Leaf(field_path, value, model, str(field_path[-1]))

    def address_and_text(self, offset: int) -> tuple[str, str]:
        """The address of a register, and its content as the PLC shows it."""
        space, address = self.subject.encoding.space, self.block.start + offset
        raw = self.raw_content(offset)
        return space.name(address), "" if raw is None else space.content_text(address, raw)


# --- Terms of a vendor whose parameters have names: every parameter of a loop, of a block, and the signals ------------

TYPES_BY_CONTENT = {bool: BOOL, int: DINT, float: LREAL, str: LOOP_MODE}
"""The type of a content that no table knows, as far as it is shown."""
OUTPUT_DEVICE = ("devices", "MV")
"""Where a loop says in which device its output stands, in a cascade that of another loop's set point."""


def parameter_terms(subject: Subject) -> Terms:
    """The loops, blocks and signals of a file or listing."""
    image, rows, output_titles = subject.encoding.image, tables_of(subject.vendor).WRITERS, outputs_of(subject.vendor)
    entry_indices: dict[str, int] = {}
    for i, entry in enumerate(image.settings):
        entry_indices.setdefault(owner_name(entry), i)
    models = {item.name: item for item in (*getattr(subject.config, "blocks", ()), *subject.config.loops)}
    cells: dict[str, list[Entry]] = {name: [] for name in entry_indices}
    for cell in (*image.cells, *_other_entries(subject)):
        cells.setdefault(owner_of(cell, cells), []).append(cell)
    loops = {loop.name: i for i, loop in enumerate(subject.config.loops, start=1)}
    owners, settings = [file_owner(subject, {})], subject.settings
    outputs = {device: loop.name for loop in subject.config.loops if (device := value_at(loop, OUTPUT_DEVICE))}
    for name, entries in cells.items():
        model = models.get(name)
        values = {cell.field: cell.raw for cell in entries}
        items, device, units = {}, str(getattr(model, "device", "")), unit_names(model)
        for cell in entries:
            key = cell.field or cell.address.removeprefix(f"{name}.")
            writer = writer_of(rows, SIGNALS if model is None else key, values)
            if writer is None and model is not None and key in output_titles:
                writer = Writer(key, "live", "the block, whose output it is", D345)
            if outer := outputs.get(cell.device):
                writer = Writer(key, "live", f"{outer}, whose output it is", D345)
            items[key] = _parameter_item(subject, cell, key, model, units, writer)
        if model is not None:
            items |= setting_items(settings[entry_indices[name]], model, {}, subject.faults(name))
            items |= dict(file_items(model, subject, [*items, *image.settings[entry_indices[name]]]))
        kind: OwnerKind = "signals" if model is None else "loop" if name in loops else "block"
        owners.append(Owner(name, kind, device, items, subject.is_described, loops.get(name, 0)))
    return Terms(tuple(owners), is_listing=subject.reading is not None)


def outputs_of(vendor: Vendor) -> dict[str, str]:
    """The outputs of a vendor's blocks, with what they are."""
    rows = (row for table in tables_of(vendor).TABLES for row in getattr(table, "rows", ()))
    return {row.name: row.title for row in rows if row.access == "output"}


def _other_entries(subject: Subject) -> Iterator[Entry]:
    """The parameters of a listing that its configuration does not have."""
    if subject.reading is None or subject.reading.listing.is_mixed:
        return
    own = subject.encoding.image.words
    for name, raw in subject.reading.listing.words.items():
        if name not in own:
            yield Entry(name, TYPES_BY_CONTENT.get(type(raw), LREAL), raw, "")


def owner_of(cell: Entry, names: Collection[str]) -> str:
    """The loop or block of a parameter; of one that no configuration has, the longest name that it begins with."""
    outer = [cell.address.removesuffix(f".{cell.field}")] if cell.field else outer_keys(cell.address)
    return next((name for name in outer if name in names), SIGNALS)


def _cell_content(cell: Entry, reading: Reading | None) -> tuple[object, str, bool]:
    """The content of a parameter on a side, why it is no value, and whether the side has it."""
    if reading is None:
        return cell.raw, "", True
    raw = reading.listing.words.get(cell.address)
    if raw is None:
        return cell.raw, "", not (reading.partial or reading.fault)
    content = None if isinstance(raw, Wire) else read_content(cell.type, raw)
    return raw if content is None else content, reading.unreadable.get(cell.address, ""), True


def _parameter_item(
    subject: Subject, cell: Entry, key: str, model: object, units: Mapping[str, str], writer: Writer | None
) -> Item:
    """A parameter; one that is wired is a setting, whoever writes what it is wired to."""
    content, fault, is_known = _cell_content(cell, subject.reading)
    has_unit = model is not None and not isinstance(content, Wire)
    is_setting = isinstance(content, Wire) or writer is None or writer.kind == "compared"
    return Item(
        key,
        None if fault else json_number(content),
        partial(_parameter_unit, subject.vendor, model, key, content, units) if has_unit else "",
        content_of(content),
        cell.device or cell.address,
        _content_word(cell, content, fault),
        "setting" if is_setting else item_kind("setting", writer),
        "" if writer is None or isinstance(content, Wire) else writer.writer,
        fault,
        is_known,
        number=cell.number,
    )


def _content_word(cell: Entry, content: Any, fault: str) -> str:
    """A content as the PLC shows it."""
    if isinstance(content, Wire):
        return f":= {content.text}"
    return str(content) if fault else content_text(cell.type, content)


def _parameter_unit(vendor: Vendor, model: Any, key: str, content: Any, units: Mapping[str, str]) -> str:
    """The unit of a parameter with a content, by its section of the model."""
    path = parse_path(key)
    field_path = path[:-1] if isinstance(path[-1], int) else path
    section = value_at(model, field_path[:-1]) if field_path[:-1] else model
    if section is None or field_path[-1] not in type(section).model_fields:
        return ""
    return trim_unit(unit_of(Leaf(field_path, content, section, str(field_path[-1])), model, vendor, units))


# --- Terms of what no configuration places: words by their addresses, settings by the names that they have ------------


def raw_terms(listing: Listing, vendor: Vendor) -> Terms:
    """Every word of a listing, and every setting beside them."""
    items = dict(unplaced_words(listing, vendor, (), ()))
    items |= {
        key: Item(key, json_number(value), "", json_number(value)) for key, value in flatten({"plc": dict(listing.plc)})
    }
    owner = Owner("", "file", "", items, is_described=listing.has_settings)
    return Terms((owner,), is_listing=True, has_address=items.__contains__)


def unplaced_words(
    listing: Listing, vendor: Vendor, words: Collection[object], names: Collection[str]
) -> Iterator[tuple[str, Item]]:
    """What a listing holds besides certain ``words`` and the settings of loops of certain ``names``."""
    space = getattr(vendor.module("registers"), "SPACE", None)
    for address, raw in listing.words.items():
        if address not in words:
            name_shown = listing.shown_addresses[address] if space is None else space.name(address)
            value = raw if space is None else space.kind_of(address).show(raw)
            text = (
                raw.text if isinstance(raw, Wire) else str(raw) if space is None else space.content_text(address, raw)
            )
            yield name_shown, Item(name_shown, json_number(value), "", raw, name_shown, text, is_optional=True)
    for entry in listing.settings:
        name = owner_name(entry)
        if name not in names:
            for key, value in flatten({name: {key: part for key, part in entry.items() if key not in OWNER_NAME_KEYS}}):
                yield key, Item(key, json_number(value), "", json_number(value))


# --- Terms of any vendor ----------------------------------------------------------------------------------------------


def terms_of(subject: Subject) -> Terms:
    """A side by its registers, or by its named parameters; of a listing without a configuration also all else of it."""
    encoding, reading = subject.encoding, subject.reading
    terms = parameter_terms(subject) if encoding.space is None else memory_terms(subject)
    if reading is not None and reading.fault:
        words = reading.listing.words if encoding.space is None or reading.listing.is_mixed else encoding.image.words
        names = {owner_name(entry) for entry in encoding.image.settings}
        terms.owners[0].items.update(unplaced_words(reading.listing, subject.vendor, words, names))
    return terms


# ----------------------------------------------------------------------------------------------------------------------
# The part of an image that differs from a listing: what is to be written into a PLC that holds the listing's words.

D347 = Decision(
    347,
    "what is written in part leaves alone what runs",
    "`encode --changed-from` writes the words that differ. Those that the PLC or the process writes (D345) and of "
    "which the file says nothing are left out, but for `--live`; a set point that differs is written, and named.",
    "A listing of a running PLC differs in its bias and output; writing 0 there is a bump of the valve.",
)


class Changes(NamedTuple):
    """An image of the words that differ, and what is to be told of them."""

    image: AnyImage
    notes: tuple[str, ...]


def changes_from(subject: Subject, listing: Listing, *, live: bool) -> Changes:
    """What a PLC lacks that holds the words of a listing; ``live``: also words that the PLC or the process writes."""
    image = subject.encoding.image
    written_numbers, left_out, operated = set[object](), list[str](), list[str]()
    items_by_name = {item.name: item for item in (*getattr(subject.config, "blocks", ()), *subject.config.loops)}
    for owner, item, item_number in _differing_items(subject, listing):
        key_texts = [f"{owner} {item.key}".lstrip()] if item_number in listing.words else []
        is_said = owner in items_by_name and is_given(items_by_name[owner], parse_path(item.key))
        if item.kind in {"live", "reserved"} and not (live or is_said):
            left_out += key_texts
        else:
            written_numbers.add(item_number)
            operated += key_texts if item.kind in {"live", "operated"} else []
    cells = tuple(cell for cell in image.cells if cell.number in written_numbers)
    notes = [f"written, although it may be set while the PLC runs: {shorten_names(operated)}"] if operated else []
    notes += (
        [f"left out, since the PLC or the process writes it: {shorten_names(left_out)} (--live)"] if left_out else []
    )
    own_numbers = {cell.number for cell in image.cells}
    other_addresses = [listing.shown_addresses[number] for number in listing.words if number not in own_numbers]
    notes += (
        [f"stays as it is, since no loop has it any more: {shorten_names(other_addresses)}"]
        if other_addresses and not listing.is_mixed
        else []
    )
    return Changes(replace(image, cells=cells), tuple(notes))


def _differing_items(subject: Subject, listing: Listing) -> Iterator[tuple[str, Item, object]]:
    """Every register or parameter whose content differs: its owner, what it is, and its number."""
    listing_side = Subject(*subject[:3], Reading(listing, subject.config, subject.encoding, {}, partial=True))
    for new, old in zip(terms_of(subject).owners, terms_of(listing_side).owners, strict=False):
        for key, item in new.items.items():
            other = old.items.get(key)
            if item.number is not None and (other is None or not other.is_known or other.content != item.content):
                yield new.name, item, item.number
