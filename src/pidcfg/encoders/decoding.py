"""A memory listing of any vendor and format to a configuration, also where something of it is refused."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from dataclasses import field, replace
from typing import Any, NamedTuple

from pidcfg.encoders.codecs import Bcd, DecodeError, typed_digits
from pidcfg.encoders.contract import encoder_of, formats_of
from pidcfg.encoders.image import Cell, Decoded, Encoding, Image, NoValueError, RefusedError, read_settings
from pidcfg.encoders.listing import (
    HEADERS_ADVICE,
    PLC_PREFIX,
    FileKind,
    Listing,
    ListingError,
    column_names,
    detect_kind,
    first_line,
    shorten_names,
    write_text,
)
from pidcfg.encoders.parameters import AnyEncoding, AnyImage, UnknownContent
from pidcfg.encoders.regmap import NoRegisterError
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, dotted_text, has_key, parse_path, set_value, value_at
from pidcfg.text.reader import DEFAULT, Limits
from pidcfg.text.references import Decision
from pidcfg.text.signs import describe_binary
from pidcfg.vendors import VENDORS, Vendor

# --- A memory listing of any vendor and format to a configuration -----------------------------------------------------

ZERO_BY_TYPE = {bool: False, int: 0, float: 0.0}
"""What stands for a content that is no value, by its type."""
CONFIGURATION_START = re.compile(r"^pidcfg:", re.MULTILINE)
NAME_AND_SIGN = re.compile(r'"?(?P<name>[A-Za-z][\w.]*)"?\s*(?P<sign>[,;:=])')
"""An address or name, and behind it another sign than the blank of a text listing."""
MAX_NUMBER_DIGITS = DEFAULT.scalar_bytes
"""Digits of a number: as many as a value of a configuration may have signs, and fewer than Python reads."""
LONG_NUMBER = re.compile(rf"(?<![0-9])[0-9]{{{MAX_NUMBER_DIGITS + 1},}}")
DECODE_ADVICE = (
    "decode what 'pidcfg encode' writes as text, csv or json, or read the PLC itself with 'pidcfg pull --map'"
)
HEAD_CHARACTERS = 1000
"""Characters in which a listing names its vendor."""


def read_listing(
    data: bytes | Listing, vendor: Vendor, limits: Limits, kind: str | None = None, pou: str | None = None
) -> Listing:
    """The words of a listing, read or not; raises `ListingError` with the place of what cannot be read.

    ``pou``: the program that is wanted of a file that may hold several.
    """
    if isinstance(data, Listing):
        return data
    refuse_large(data, limits)
    kinds = formats_of(vendor).FORMATS
    text = _text_of(data, [kinds[kind]] if kind else [*kinds.values()])
    file_kind = kinds[kind] if kind else detect_kind(text, kinds)
    if file_kind is None:
        if other := describe_binary(data):
            raise ListingError(f"{other[0]}, no memory listing; {other[1]}")
        vendor_named = next((key for key in VENDORS if f"{key} memory listing" in text[:HEAD_CHARACTERS]), None)
        if vendor_named not in {None, vendor.key}:
            raise ListingError(f"this is a listing of vendor {vendor_named}, not {vendor.key}")
        raise ListingError(_no_listing_problem(text, kinds))
    if pou and file_kind.read_program is None:
        raise ListingError(
            f"--pou names a program of a project in PLCopen XML, and this file is of the format {file_kind.name}"
        )
    listing: Listing = file_kind.read_program(text, pou) if pou and file_kind.read_program else file_kind.read(text)
    if listing.vendor not in {None, vendor.key}:
        raise ListingError(f"the listing is of vendor {listing.vendor!r}, not {vendor.key}")
    return listing


def _no_listing_problem(text: str, kinds: Mapping[str, FileKind]) -> str:
    """What a text is that is no listing, with the cure where there is one."""
    if not text.strip():
        return "the file is empty: export the listing again"
    if CONFIGURATION_START.search(text):
        return "this is a file of pidcfg and no listing; 'pidcfg encode' writes the words of a configuration"
    if {"table", "register"} <= set(column_names(text)):
        return f"this is a Modbus listing, whose registers only a map of the project explains: {DECODE_ADVICE}"
    problem = f"this is no memory listing that pidcfg reads ({', '.join(kinds)})"
    row = NAME_AND_SIGN.match(first_line(text))
    if row is None or not kinds["text"].looks_like(f"{row['name']} "):
        return problem
    sign, name = row["sign"], row["name"]
    return f"{problem}; write blanks in place of {sign!r} behind {name}, or begin a table with {HEADERS_ADVICE}"


def _text_of(data: bytes, kinds: Iterable[FileKind]) -> str:
    """The text of a listing; one that is not UTF-8 is in the encoding of the format that it looks like."""
    try:
        return listing_text(data)
    except ListingError:
        for kind in kinds:
            if kind.encoding != "utf-8":
                with suppress(ListingError):
                    text = _decode_bytes(data, kind.encoding)
                    if kind.looks_like(text):
                        return text
        raise


def refuse_large(data: bytes, limits: Limits) -> None:
    """Raises `ListingError` for a file that is larger than the limit."""
    if len(data) > limits.listing_bytes:
        raise ListingError(f"the file is larger than {limits.listing_bytes} bytes")


def listing_text(data: bytes) -> str:
    """The text of a file in UTF-8, or in UTF-16 when it begins so."""
    return _decode_bytes(data, "utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")


def exact_text(data: bytes, encoding: str) -> str:
    """The text of a file that goes back byte for byte: a byte order mark stays its first character."""
    return _decode_bytes(data, encoding)


def _decode_bytes(data: bytes, encoding: str) -> str:
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        place = f"byte 0x{data[error.start]:02X} at {error.start}" if error.start < len(data) else "the end of the file"
        name = encoding.upper().removesuffix("-SIG").removesuffix("-LE")
        raise ListingError(f"{place} is not {name}; save the file as {name}") from None
    if long_number := LONG_NUMBER.search(text):
        begin = text.rfind("\n", 0, long_number.start()) + 1
        line, column = text.count("\n", 0, begin) + 1, long_number.start() - begin + 1
        raise ListingError(f"a number of {len(long_number[0])} digits; the limit is {MAX_NUMBER_DIGITS}", line, column)
    return text


def join_listings(listings: list[Listing]) -> Listing:
    """Several files of one image as one; an address in two of them is refused."""
    first, *others = sorted(listings, key=lambda listing: not listing.is_leading)
    for other in others:
        first.join(other)
    return first


def with_names(listing: Listing, image: Image) -> Listing:
    """A listing with the names, ranges, units and dialog settings of another image, as far as it does not say them.

    A loop belongs to the one of the same name; where the listing names none, to the one at the same place.
    """
    settings = listing.settings
    if settings:
        by_name = {owner_name(entry): entry for entry in image.settings}
        settings = tuple(_merge_settings(by_name.get(owner_name(entry), {}), entry) for entry in settings)
    else:
        settings = tuple(entry for entry in image.settings if _may_have_loop(owner_name(entry), listing))
    return replace(listing, settings=settings, plc={**image.plc, **listing.plc})


def owner_name(entry: Mapping[str, object]) -> str:
    """The loop or block that settings beside the words are of."""
    return str(entry.get("loop") or entry.get("block") or "")


def _may_have_loop(name: object, listing: Listing) -> bool:
    """Whether a listing may hold a loop: where its words have names, one of them begins with the loop's."""
    return any(not isinstance(word, str) or word.startswith(f"{name}.") for word in listing.words)


def naming_options(listing: Listing, options: Mapping[str, object]) -> Mapping[str, object]:
    """The options of a decoder for a listing that takes its names from another image."""
    return options if listing.settings else {**options, "names_only": True}


def _merge_settings(lower: Mapping[str, Any], upper: Mapping[str, Any]) -> dict[str, object]:
    merged = {**lower, **upper}
    for key in lower.keys() & upper.keys():
        if isinstance(lower[key], dict) and isinstance(upper[key], dict):
            merged[key] = _merge_settings(lower[key], upper[key])
    return merged


def decode_listing(
    listing: Listing, vendor: Vendor, options: Mapping[str, object], like: Image | None = None
) -> Decoded:
    """The configuration that a listing holds; the notes name words that do not come back when it is encoded again.

    ``like``: an image that gives names, ranges and units where the listing does not.
    """
    if like is not None:
        options, listing = naming_options(listing, options), with_names(listing, like)
    try:
        decoded, faults = decode_words(listing, vendor, options)
        config = read_settings(vendor.model, decoded.data, "the listing gives no configuration")
        encoding = encoder_of(vendor).encode(config)
        encoded = encoding.image
    except NoRegisterError as error:
        raise ListingError(str(error)) from None
    except DecodeError as error:
        text = "; ".join((str(error), *listing.notes))
        raise ListingError(text, listing.lines.get(error.address or -1, 1)) from None
    zero_notes = tuple(f"{text}; it counts as 0 (D50)" for text in faults)
    doubt_notes, suggestion = _decimal_notes(listing, encoding) if faults else ((), "")
    differences = _difference_notes(listing, encoded, decoded.status)
    notes = (*listing.notes, *zero_notes, *doubt_notes, *decoded.notes, *differences)
    return replace(decoded, notes=notes, warnings=zero_notes, suggestion=suggestion)


def _decimal_notes(listing: Listing, encoding: AnyEncoding) -> tuple[tuple[str, ...], str]:
    """Notes on words that seem typed in decimal, and the listing without them; empty: none does."""
    if not isinstance(encoding, Encoding):
        return (), ""
    suspects = find_suspects(listing.words, encoding)
    return tuple(suspect_notes(suspects)), suggested_listing(listing, encoding, suspects) if suspects else ""


def decode_words(listing: Listing, vendor: Vendor, options: Mapping[str, object]) -> tuple[Decoded, list[str]]:
    """What the words of a listing say, and which of them are no values of their format: those count as 0 (D50).

    Raises `DecodeError` where something else is wrong with them.
    """
    words, faults = dict(listing.words), list[str]()
    while True:
        try:
            return encoder_of(vendor).decode(words, listing.settings, listing.plc, options), faults
        except NoValueError as error:
            words[error.address] = zero_of(words[error.address])
            faults.append(str(error))


def annotate_listing(listing: Listing, vendor: Vendor, options: Mapping[str, object]) -> tuple[str, tuple[str, ...]]:
    """A listing with a meaning beside every word, also of words that are no values; with the reader's notes."""
    try:
        text: str = vendor.load("explainer").annotate(listing, options)
    except (DecodeError, NoRegisterError) as error:
        raise ListingError(str(error)) from None
    return text, listing.notes


def _difference_notes(listing: Listing, encoded: AnyImage, status: Collection[int]) -> Iterator[str]:
    """Words that do not come back: encoded otherwise, or not at all."""
    contents = {number: raw for number, raw in listing.words.items() if not isinstance(raw, UnknownContent)}
    different = [c.address for c in encoded.cells if contents.get(c.number, c.raw) != c.raw]
    if different:
        yield f"encoded again, these words differ from the listing: {shorten_names(different)}"
    name_of = {c.number: c.address for c in encoded.cells}
    unassigned = sorted(number for number in listing.words if number not in name_of and number not in status)
    if unassigned and not listing.is_mixed:
        lines = [listing.shown_addresses.get(number, str(number)) for number in unassigned]
        yield f"these words of the listing belong to no loop and are left out: {shorten_names(lines)}"


def check_settings(listing: Listing, vendor: Vendor) -> None:
    """Raises `DecodeError` unless what stands beside the words is sound; words that are no values do not matter."""
    words, unreadable = dict(listing.words), set[int | str]()
    while True:
        try:
            encoder_of(vendor).decode(words, listing.settings, listing.plc)
        except DecodeError as error:
            if error.address not in words or error.address in unreadable:
                raise
            unreadable.add(error.address)
            words[error.address] = zero_of(words[error.address])
        else:
            return


def zero_of(content: Any) -> Any:
    """What stands for a content that is no value."""
    return ZERO_BY_TYPE.get(type(content), 0.0)


# --- A listing read as far as it goes: what is refused of it is named, and hides nothing else -------------------------
#
# A word that is no value, a pair of words that contradict each other, a setting beside the words that cannot be: each
# is remembered with its reason, and what the other side of the comparison has stands in its place until the rest
# gives a configuration. That configuration says only what the words mean; what is compared is what the listing itself
# holds.

OWNER_SECTIONS = ("loops", "blocks")
SIGNALS_KEY = "signals"


@frozen
class Reading:
    """A listing that is read as far as it goes: a word that is no value does not hide the others."""

    listing: Listing
    config: Any
    """The configuration; what is refused, or is not there, is that of the other side."""
    encoding: AnyEncoding
    """Where the words of that configuration are, and what they mean."""
    unreadable: Mapping[int | str, str]
    """Words that are no values, and why."""
    partial: bool = False
    """Whether words are missing, and those of the other image stand in their place."""
    notes: tuple[str, ...] = ()
    refused: Mapping[tuple[str, str], str] = field(default_factory=dict)
    """Settings beside the words that cannot be, by loop and key, and why."""
    fault: str = ""
    """Why the listing gives no configuration at all: it is then compared at the places of the other side."""


def reading_of(listing: Listing, vendor: Vendor, like: object = None) -> Reading:
    """The loops of a listing; raises `ListingError` where nothing tells where they are.

    ``like``: a configuration and its encoding, which gives names, ranges and units, and what is missing or refused.
    """
    return _Reader(listing, vendor, like).read_loops()


class _Reader:
    """A listing on its way to a reading."""

    def __init__(self, listing: Listing, vendor: Vendor, like: Any) -> None:
        self.listing, self.vendor, self.other_side = listing, vendor, like
        self.image: Any = None if like is None else like[1].image
        renamed = listing if self.image is None else with_names(listing, self.image)
        self.options = {} if self.image is None else naming_options(listing, {})
        self.other_words: Mapping[Any, Any] = {} if self.image is None else self.image.words
        self.words, self.plc = dict(listing.words), deepcopy(dict(renamed.plc))
        self.settings = [deepcopy(dict(entry)) for entry in renamed.settings]
        self.unreadable: dict[int | str, str] = {}
        self.refused: dict[tuple[str, str], str] = {}
        self.partial = False
        self.data: Mapping[str, Any] = {}

    def read_loops(self) -> Reading:
        """The configuration of what is not refused; where that is none, the other side's."""
        while True:
            try:
                decoded = encoder_of(self.vendor).decode(self.words, self.settings, self.plc, self.options)
                self.data = decoded.data
                config = read_settings(self.vendor.model, self.data, "the listing gives no configuration")
                return self._make_reading(config, encoder_of(self.vendor).encode(config))
            except DecodeError as error:
                if isinstance(error, RefusedError) and self.other_side is not None:
                    is_cured = self._replace_refused(error)
                else:
                    is_cured = self._replace_word(error) or self._add_missing_words()
                if not is_cured and self.other_side is None:
                    raise ListingError(str(error), self.listing.lines.get(error.address, 1)) from None
                if not is_cured:
                    return self._make_reading(self.other_side[0], self.other_side[1], str(error))

    def _make_reading(self, config: Any, encoding: AnyEncoding, fault: str = "") -> Reading:
        note = (f"compared word by word at the places of the other side: {fault}",) if fault else ()
        notes = (*self.listing.notes, *note)
        return Reading(self.listing, config, encoding, self.unreadable, self.partial, notes, self.refused, fault)

    def _replace_word(self, error: DecodeError) -> bool:
        """Leaves out a word that is no value, at first by what the other side has, then altogether."""
        address = error.address
        if address not in self.listing.words or address not in self.words:
            return False
        if address not in self.unreadable:
            self.words[address] = self.other_words.get(address, zero_of(self.words[address]))
        elif address not in self.other_words:
            del self.words[address]
        else:
            return False
        self.unreadable.setdefault(address, str(error))
        return True

    def _add_missing_words(self) -> bool:
        """Takes words that are missing from the other side."""
        if self.other_words.keys() <= self.words.keys():
            return False
        self.words, self.partial = {**self.other_words, **self.words}, True
        return True

    # --- what a schema refuses --------------------------------------------------------------------------------------

    def _replace_refused(self, error: RefusedError) -> bool:
        """Takes what a schema refuses from the other side: a setting beside the words, or words of one section."""
        path = _setting_path(error.path)
        if error.where == "plc":
            return self._replace_setting(("", dotted_text(("plc", *path))), self.plc, self.image.plc, path, error)
        if error.where.startswith("settings["):
            i = int(error.where.removeprefix("settings[").removesuffix("]"))
            entry = self.settings[i]
            return self._replace_setting(
                (owner_name(entry), dotted_text(path)), entry, self._other_settings(entry, i), path, error
            )
        return self._replace_section(error)

    def _other_settings(self, entry: Mapping[str, object], i: int) -> Mapping[str, object]:
        """The settings of the other side for a loop: by its name, else by its place."""
        entries: Sequence[Mapping[str, object]] = self.image.settings
        same_name = next((other for other in entries if owner_name(other) == owner_name(entry)), None)
        return same_name or (entries[i] if i < len(entries) else {})

    def _replace_setting(
        self,
        key: tuple[str, str],
        entry: dict[str, object],
        other: Mapping[str, object],
        path: Path,
        error: RefusedError,
    ) -> bool:
        """Puts the other side's setting in place of a refused one; False: that was done already."""
        if key in self.refused or not path:
            return False
        self.refused[key] = str(error)
        if has_key(other, path):
            set_value(entry, path, deepcopy(value_at(other, path)))
        elif has_key(entry, path):
            del value_at(entry, path[:-1])[path[-1]]
        return True

    def _replace_section(self, error: RefusedError) -> bool:
        """Takes the words of a section that contradict each other from the other side."""
        name, path = self._find_owner(error.path)
        if not path:
            return False
        readable = self.listing.words.keys() - self.unreadable.keys()
        addresses = [
            address
            for address in dict.fromkeys(self.other_side[1].addresses_under(name, dotted_text(path), self.words))
            if address in readable
        ]
        for address in addresses:
            self.unreadable[address] = str(error)
            if address in self.other_words:
                self.words[address] = self.other_words[address]
            else:
                del self.words[address]
        return bool(addresses)

    def _find_owner(self, path: Path) -> tuple[str, Path]:
        """The loop or block that a place of the configuration is in, and the rest of the place."""
        top, *rest = path or ("",)
        if top == SIGNALS_KEY and rest:
            return "", (str(rest[0]),)
        if top not in OWNER_SECTIONS or not rest or not isinstance(rest[0], int):
            return "", ()
        item: Any = self.data[top][rest[0]]
        inner: list[str | int] = []
        for step in rest[1:]:  # a step that is no key of the data names the kind of a block
            if has_key(item, (step,)) or (isinstance(item, dict) and inner):
                inner.append(step)
                item = value_at(item, (step,))
        return str(value_at(self.data, (top, rest[0], "name"))), _setting_path(inner)


def _setting_path(path: Sequence[str | int]) -> Path:
    """A place up to its first list: a pair is one setting."""
    steps = parse_path(dotted_text(path))
    end = next((i for i, step in enumerate(steps) if isinstance(step, int)), len(steps))
    return steps[:end]


# --- BCD words that somebody seems to have typed in decimal: both readings, and a listing that suggests BCD -----------

D950 = Decision(
    950,
    "a BCD word that seems typed in decimal is told and never changed",
    "A word with a digit above 9 counts as 0 (D50), and the number that it is in decimal is told with the digits that "
    "would mean it: 00FA is 250, 0250 would be 2.50. Beside such a word the other BCD words of its loop are told with "
    "both readings. `decode --suggest FILE` writes the listing with digits in place of the words that are no BCD; "
    "words that are BCD keep their content, and have both readings beside them.",
    "A memory view takes words in decimal, too, and the manual's loop table has binary and BCD words side by side. "
    "Of a word that is BCD nobody can know which reading was meant.",
)


class Suspect(NamedTuple):
    """A BCD word that was perhaps typed in decimal, and what it means either way."""

    address: str
    number: int
    loop: str | None
    raw: int
    word: int
    """The four BCD digits of the number that it is in decimal."""
    as_bcd: str
    """What it means as it stands; empty: it is no BCD."""
    as_decimal: str

    @property
    def both_readings(self) -> str:
        """Both readings."""
        if not self.as_bcd:
            return f"{self.raw:04X} is no BCD; {self.as_decimal} if {self.raw} was typed in decimal"
        return f"{self.raw:04X} is {self.as_bcd}, or {self.as_decimal} if {self.raw} was typed in decimal"


def find_suspects(words: Mapping[int, int], encoding: Encoding) -> tuple[Suspect, ...]:
    """Words that are no BCD but would be a number typed in decimal, and the other BCD words of the same loops."""
    by_number = {suspect.number: suspect for suspect in _bcd_words(words, encoding)}
    loops = {suspect.loop for suspect in by_number.values() if not suspect.as_bcd}
    return tuple(by_number[number] for number in sorted(by_number) if by_number[number].loop in loops)


def _bcd_words(words: Mapping[int, int], encoding: Encoding) -> Iterator[Suspect]:
    """The BCD words of all loops that mean something else typed in decimal; where blocks overlap the later wins."""
    for block in encoding.blocks:
        for row in block.table.words:
            number, codec = block.start + row.offset, getattr(row.codec, "bcd", row.codec)
            raw = words.get(number, 0)
            typed = typed_digits(raw)
            if isinstance(codec, Bcd) and typed is not None and typed != raw:
                as_bcd = codec.show(raw) if f"{raw:04X}".isdecimal() else ""
                name = encoding.space.name(number)
                yield Suspect(name, number, block.loop, raw, typed, as_bcd, codec.show(typed))


def suspect_notes(suspects: tuple[Suspect, ...]) -> Iterator[str]:
    """A note a loop on BCD words that stand beside one that is none."""
    for loop in dict.fromkeys(suspect.loop for suspect in suspects):
        loop_suspects = [suspect for suspect in suspects if suspect.loop == loop]
        wrong = ", ".join(suspect.address for suspect in loop_suspects if not suspect.as_bcd)
        others = [f"{suspect.address} {suspect.both_readings}" for suspect in loop_suspects if suspect.as_bcd]
        if others:
            yield f"{loop}: beside {wrong} these may be typed in decimal, too: {'; '.join(others)}"


def suggested_listing(listing: Listing, encoding: Encoding, suspects: tuple[Suspect, ...]) -> str:
    """The listing as text with BCD in place of the words that are none, and all readings beside them."""
    by_number = {suspect.number: suspect for suspect in suspects}
    cells = {cell.number: cell for cell in encoding.image.cells}
    new_cells = []
    for number, content in sorted(listing.words.items()):
        suspect, cell = by_number.get(number), cells.get(number)
        raw = suspect.word if suspect is not None and not suspect.as_bcd else content
        field, loop = ("-", None) if cell is None else (cell.field, cell.loop)
        new_cells.append(Cell(encoding.space.name(number), number, raw, field, loop, encoding.space.kind_of(number)))
    text = write_text(Image(encoding.vendor, tuple(new_cells), listing.settings, listing.plc))
    return "".join(f"{_with_readings(line, suspects)}\n" for line in _suggested_lines(text, listing))


def _suggested_lines(text: str, listing: Listing) -> Iterator[str]:
    """The lines, with what was done above them; a listing that says nothing beside its words still says nothing."""
    first, *others = text.splitlines()
    yield first
    yield "# suggested: the words marked 'no BCD' have digits instead; compare every marked word with the PID dialog"
    yield from (line for line in others if listing.has_settings or not line.startswith(PLC_PREFIX))


def _with_readings(line: str, suspected: tuple[Suspect, ...]) -> str:
    suspect = next((suspect for suspect in suspected if line.startswith(f"{suspect.address} ")), None)
    return line if suspect is None else f"{line}  # {suspect.both_readings}"
