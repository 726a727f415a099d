"""An explanation and the question that it answers: what a content says in words, what a key is, which line sets it."""

from __future__ import annotations

import re
from dataclasses import replace
from decimal import Decimal
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.codecs import Choice, DecodeError, Position, pv_before_root
from pidcfg.encoders.image import Block, bank_end_error
from pidcfg.encoders.parameters import read_content
from pidcfg.output.explanation import Origin, Page, QuestionError
from pidcfg.schemas.base import Limits, Quantity, limits_at, unit_text, units_of
from pidcfg.schemas.document import field_texts, models_in, models_of
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import path_text
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import has_key, parse_path, value_at

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.parameters import Content, Entry, Parameter
    from pidcfg.encoders.regmap import Bits, Kind, RegisterMap, Word
    from pidcfg.schemas.iec import IecType
    from pidcfg.text.paths import Data, Path
    from pidcfg.validate.engine import Checked

# --- What a key of a configuration is, from the text below its field in the schema, and what is allowed there ---------


@cache
def texts_of(model: type[BaseModel]) -> Mapping[str, str]:
    """The text below each field of a model."""
    return field_texts(model)


@cache
def key_text(file: type[BaseModel], path: str) -> str:
    """The text of a key by its path, wherever in the file it stands; its section's where it has none of its own."""
    steps = [step for step in path.split(".") if not step.isdigit()]
    while steps:
        for model in models_of(file):
            text = _nested_text(model, steps)
            if text:
                return text
        steps.pop()
    return ""


def _nested_text(model: type[BaseModel], steps: list[str]) -> str:
    """The text of the last key, if the keys lead through the model."""
    field = model.model_fields.get(steps[0])
    if field is None:
        return ""
    if len(steps) == 1:
        return texts_of(model).get(steps[0], "")
    sections = (section for section in models_in(field.annotation) if section is not model)
    return next((text for section in sections if (text := _nested_text(section, steps[1:]))), "")


@cache
def key_limits(file: type[BaseModel], path: str) -> Limits | None:
    """What the manual allows for the number at a key of a loop, or of the file; None where it says nothing."""
    limits = limits_at(file, f"loops.{path}")
    return limits_at(file, path) if limits is None and path.partition(".")[0] in file.model_fields else limits


def limits_text(limits: Limits) -> str:
    """Limits as the remark on a number that passes them."""
    if limits.high is None:
        return f"not allowed: below {limits.low}"
    return f"not allowed: above {limits.high}" if limits.low is None else f"not within {limits.low} to {limits.high}"


def first_sentence(text: str) -> str:
    """A text up to where it goes into details."""
    for end in range(1, len(text) - 1):
        if text[end : end + 2] in {"; ", ". ", ": "} and text.count("(", 0, end) == text.count(")", 0, end):
            return text[:end]
    return text.removesuffix(".")


# --- What a register's content says, in words -------------------------------------------------------------------------

PERCENT = Decimal(100)
MAX_CHOICES = 5
"""A row with more choices is not spelled out."""
UNIT_NAMES = {"pv": "PV units", "output": "output units"}
"""What stands for units that are not known."""


class Scaling(NamedTuple):
    """What makes values of a loop's registers: its scales, and the units of PV and output."""

    scales: Mapping[str, Scale]
    units: Mapping[str, str]
    chosen_readings: frozenset[str] = frozenset()
    """Readings of the registers that somebody has chosen, where the manual leaves a choice."""


UNKNOWN_SCALING = Scaling({}, {})


class Placement(NamedTuple):
    """A register in its place: its row, the loop, and what makes values of it."""

    table: RegisterMap
    word: Word
    loop: str | None = None
    scaling: Scaling | None = None
    raw: int | None = None
    """Its content in the configuration."""
    origins: tuple[Origin, ...] = ()
    prefix: str = ""
    """What stands before its name in a listing."""


def is_on_raw_signal(word: Word, scales: Mapping[str, Scale]) -> bool:
    """Whether a word is compared with the PV of which the loop takes the root."""
    root = scales.get("sp")
    return word.scale == "pv" and root is not None and root.has_root


def raw_signal_share(word: Word, raw: int, scales: Mapping[str, Scale]) -> tuple[Decimal, Decimal | None]:
    """What a word before the root is: percent of the signal, and the PV at which the signal has it.

    There is no such PV for a difference, nor without a range.
    """
    pv, root = scales["pv"], scales["sp"]
    if not isinstance(word.codec, Position):
        return PERCENT * raw / pv.format.span, None
    return pv_before_root(pv, root, pv.format.codec.decode(raw))


def unit_of(word: Word, units: Mapping[str, str]) -> str:
    """A register's unit in the loop's own units: ``degC`` for ``pv``; ``PV units`` where they are not known."""
    return unit_text(word.unit, {**UNIT_NAMES, **units}, "/")


def text_of(word: Word, raw: int, scaling: Scaling) -> str:
    """A content in words, empty where the scale is not known; raises `DecodeError` where it is no value."""
    scale = word.scale
    if scale is not None and scale not in scaling.scales:
        return ""
    value = word.decode(raw, scaling.scales)
    if scale is not None:
        return _quantity_text(word, value, raw, scaling)
    if isinstance(word.codec, Choice):
        return "on" if value is True else "off" if value is False else str(value)
    code = special_code(word.codec, raw)
    text = f"{decimal_text(Decimal(value))} {unit_of(word, scaling.units)}".rstrip()
    return f"{text}: {code}" if code else text


def special_code(codec: Any, raw: int) -> str:
    """What a content does that is a code: it mostly switches the register's function off."""
    if raw not in {codec.encode(number * codec.step) for number in getattr(codec, "off", ())}:
        return ""
    return {"off": "switched off", "not allowed": ""}.get(codec.off_effect, str(codec.off_effect))


def _quantity_text(word: Word, value: Any, raw: int, scaling: Scaling) -> str:
    scale = scaling.scales[str(word.scale)]
    if is_on_raw_signal(word, scaling.scales):
        return _raw_signal_text(word, raw, scaling)
    bcd = getattr(word.codec, "bcd", None)
    if bcd is not None and (code := special_code(bcd, raw)):
        return f"0 {unit_of(word, scaling.units)}: {code}"
    if not isinstance(value, Quantity) or value.counts or scale.range is None:
        number = value.value if isinstance(value, Quantity) else value
        return f"{decimal_text(number)} counts{_share_text(word, raw, scale)}"
    return f"{decimal_text(value.value)} {unit_of(word, scaling.units)}"


def _raw_signal_text(word: Word, raw: int, scaling: Scaling) -> str:
    """Percent of the signal, and for a position on it the value that the signal means: its root."""
    share, value = raw_signal_share(word, raw, scaling.scales)
    pv_text = "" if value is None else f" ({float(value):.4g} {unit_of(word, scaling.units)})"
    return f"{float(share):.4g} % of the signal before the root{pv_text}"


def _share_text(word: Word, raw: int, scale: Scale) -> str:
    """How far along its data format a raw position is, in percent."""
    if not isinstance(word.codec, Position) or scale.has_root:
        return ""
    counts = scale.format.codec.decode(raw)
    share = PERCENT * (counts - scale.format.minimum) / scale.format.span
    return f", {share:.4g} % of {scale.format.minimum} to {scale.format.maximum}"


def choice_text(row: Bits, word: int) -> tuple[str, bool]:
    """What the bits of a row choose, and whether that is something that is on; `DecodeError` for no choice."""
    value = row.decode(word)
    if isinstance(value, bool):
        return ("on" if value else "off"), value
    return ("off" if value is None else str(value)), bool(word & row.mask)


def choices_text(row: Bits) -> str:
    """What the codes of a row choose, where it is not just on or off."""
    values = [value for value in row.bits_by_value if value is not None]
    if len(values) > MAX_CHOICES or all(isinstance(value, bool) for value in values):
        return ""
    is_single_bit = len(row.bits) == 1
    return ": " + ", ".join(f"{row.bits_by_value[v] >> row.bits[0]} {v}" if is_single_bit else str(v) for v in values)


def bits_text(rows: Iterable[Bits], raw: int) -> str:
    """A word of bits in one line: what it chooses, then what is on."""
    choices, bits_on = [], []
    for row in rows:
        try:
            state, active = choice_text(row, raw)
        except DecodeError as error:
            choices.append(str(error))
            continue
        if state == "on" or (state == "off" and active):
            bits_on.append(f"{row.title} ({bits_label(row)})")
        elif state != "off" and (active or row.access == "setting"):
            choices.append(f"{row.path or row.title} {state}")
    parts = [", ".join(choices)] if choices else []
    parts.append("on: " + ", ".join(bits_on) if bits_on else "no bit is on" if not raw else "")
    return "; ".join(part for part in parts if part)


def bits_label(row: Bits) -> str:
    """The bits of a row as people say them."""
    bits = row.bits
    if len(bits) == 1:
        return f"bit {bits[0]}"
    if bits == tuple(range(bits[0], bits[0] + len(bits))):
        return f"bits {bits[0]}-{bits[-1]}"
    return "bits " + ", ".join(map(str, bits))


# --- A question: a name, perhaps with a content, and what is known of the loops around it -----------------------------

ADDRESS_PATTERN = re.compile(r"([A-Za-z]{1,2})([0-9]{1,9})(?:\.([0-9]{1,3}))?")
OFFSET_PATTERN = re.compile(r"([A-Za-z/ ()]*)\+ ?([0-9]{1,3})\)?(?:\.([0-9]{1,3}))?")
MAX_QUESTION_LENGTH = 2000
"""Of a question: a message of pidcfg fits in."""
MAX_QUOTED_LENGTH = 80
MAX_NUMBER_DIGITS = 5
"""Of a number that a PLC shows."""


def is_number(text: str) -> bool:
    """Whether a text is a number such as a PLC shows."""
    return text.isdecimal() and len(text) <= MAX_NUMBER_DIGITS


@frozen
class Question:
    """One thing to explain: its name, the content given to it, and what the options say of the loops."""

    text: str
    name: str
    value: str | None = None
    at_example: bool = False
    """Whether loops begin where the example does."""
    starts: tuple[str, ...] = ()
    """Addresses at which blocks of registers begin."""
    config: ConfigIndex | None = None
    one_vendor: bool = False
    """Whether a single vendor is asked, so that a number alone (``26``) can only be one that its PLC shows."""

    @classmethod
    def parse(
        cls, text: str, *, at_example: bool = False, starts: tuple[str, ...] = (), config: ConfigIndex | None = None
    ) -> Question:
        """``V7642=0008`` in its two parts; raises `QuestionError` where it has no name, or an empty content."""
        name, equals, value = text.partition("=")
        if not name.strip() or len(text) > MAX_QUESTION_LENGTH or not text.isprintable():
            raise QuestionError(f"{text[:MAX_QUOTED_LENGTH]!r} is not a name, NAME.BIT or NAME=VALUE")
        if equals and not value.strip():
            raise QuestionError(f"{text!r} has no value behind its '='")
        return cls(text.strip(), name.strip(), value.strip() if equals else None, at_example, starts, config)

    @property
    def name_and_loop(self) -> tuple[str, str | None]:
        """``TIC-101.gain`` as name and loop, where the configuration has that loop."""
        loop, _, rest = self.name.partition(".")
        return (rest, loop) if rest and self.config is not None and loop in self.config.loops else (self.name, None)


# --- A content as a person writes it, to the raw content of a register or parameter -----------------------------------

HEX_PATTERN = re.compile(r"(?:0[xX]|16#)?([0-9A-Fa-f]{1,8})[hH]?")
MARKED_HEX = re.compile(r"(?:0[xX]|16#)([0-9A-Fa-f]{1,8})")
NUMBER_PATTERN = re.compile(r"[-+]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][-+]?[0-9]{1,3})?")
MAX_CONTENT_DIGITS = 11
STATE_BY_WORD = {"on": True, "true": True, "off": False, "false": False}
SWITCH_STATES = {**STATE_BY_WORD, "1": True, "0": False}


def parse_integer(text: str, maximum: int) -> int | None:
    """A whole number in decimal, or in hexadecimal when it is marked (0x0005, 16#0005)."""
    match = MARKED_HEX.fullmatch(text)
    decimal = int(text) if text.isdecimal() and len(text) <= MAX_CONTENT_DIGITS else None
    number = int(match.group(1), 16) if match else decimal
    return number if number is not None and number <= maximum else None


def raw_of(text: str, kind: Kind, name: str, *, hexadecimal: bool) -> int:
    """The raw content that ``text`` writes: in hexadecimal for vendors that show it so, else as a value of its kind.

    ``0x`` marks hexadecimal for every vendor.
    """
    match = (HEX_PATTERN if hexadecimal else MARKED_HEX).fullmatch(text)
    if match:
        raw = int(match.group(1), 16)
        if raw > kind.highest:
            raise QuestionError(f"{name}={text}: {kind.name} content has up to {kind.digits} hexadecimal digits")
        return raw
    if hexadecimal:
        raise QuestionError(
            f"{name}={text}: the value is not up to {kind.digits} hexadecimal digits, like 0402 or 0x0402"
        )
    value: bool | int | float | None = STATE_BY_WORD.get(text.lower())
    if value is None and NUMBER_PATTERN.fullmatch(text):
        number = float(text)
        value = int(number) if number == number // 1 and kind.digits != 8 else number
    content = None if value is None else kind.read(value)
    if content is None:
        digits = HEX_PATTERN.fullmatch(text)
        cure = f"; hexadecimal digits are written 0x{digits.group(1)}" if digits and not text.isdecimal() else ""
        raise QuestionError(f"{name}={text}: the value is not {kind.holds}{cure}")
    return content


def content_of(row: Parameter, text: str) -> Content:
    """The content of a parameter that ``text`` writes."""
    value: object = None
    if row.type.kind == "bool":
        value = SWITCH_STATES.get(text.lower())
    elif row.type.kind == "word":
        value = next((w for w in row.type.words if text.upper() in {w.upper(), w.upper().rpartition("_")[2]}), None)
    elif row.type.kind == "whole":
        is_decimal = text.lstrip("+-").isdecimal() and len(text) <= MAX_CONTENT_DIGITS
        value = int(text) if is_decimal else parse_integer(text, row.type.high)
    elif NUMBER_PATTERN.fullmatch(text):
        value = float(text)
    content = read_content(row.type, value)
    if content is None:
        raise QuestionError(f"{row.name}={text}: the value is not one of {contents_text(row.type)}")
    return content


def contents_text(kind: IecType) -> str:
    """What a parameter of a type holds."""
    if kind.kind == "bool":
        return "TRUE and FALSE"
    if kind.kind == "word":
        return ", ".join(kind.words)
    return f"{kind.name} ({kind.low} to {kind.high})" if kind.kind == "whole" else f"{kind.name}, a finite number"


# --- The configuration that a question is about: which loop and which line sets a register, and to what ---------------


class ConfigIndex:
    """The registers of one configuration, each with the line that sets it."""

    def __init__(self, checked: Checked) -> None:
        self.checked = checked
        self.document = checked.document
        self.encoding: Any = checked.encoding
        """Of registers or of parameters: of each kind it has what it has."""
        self.loops: tuple[str, ...] = tuple(loop.name for loop in checked.config.loops)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks of an encoding with addresses."""
        blocks: tuple[Block, ...] = self.encoding.blocks
        return blocks

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The parameters of an encoding with names."""
        entries: tuple[Entry, ...] = self.encoding.entries
        return entries

    @property
    def settings(self) -> Sequence[Data]:
        """What stands beside the parameters."""
        settings: Sequence[Data] = self.encoding.image.settings
        return settings

    def units(self, loop: str | None) -> dict[str, str]:
        """The units of a loop's PV and output."""
        return units_of(self._settings_by_loop.get(loop, {}))

    @cached_property
    def _settings_by_loop(self) -> dict[object, Data]:
        return {entry.get("loop"): entry for entry in reversed(self.settings)}

    def placement_at(self, number: int) -> Placement | None:
        """The register at an address; where blocks overlap, the later wins."""
        block = next((b for b in reversed(self.blocks) if 0 <= number - b.start < b.table.size), None)
        return None if block is None else self._placement(block, number - block.start)

    def placements_of(self, table: RegisterMap, word: Word, loop: str | None) -> Iterator[tuple[Placement, int]]:
        """A register in every block of its kind, or in that of one loop, with its addresses.

        Raises `NoRegisterError` for a block that leaves the PLC's memory, where it has none.
        """
        for block in self.blocks:
            if block.table.title == table.title and loop in {None, block.loop}:
                if block in self.encoding.blocks_outside:
                    raise bank_end_error(block, self.encoding.space)
                yield self._placement(block, word.offset), block.start + word.offset

    def _placement(self, block: Block, offset: int) -> Placement:
        """A register; a word of many choices has an origin for each that the file gives."""
        word = next(w for w in block.table.words if w.offset == offset)
        rows = [row for row in block.table.bits if row.offset == offset and row.access == "setting"]
        paths = [path for path in (word.path, *(row.path for row in rows)) if path is not None]
        origins = [o for path in paths if (o := self.origin((*block.path, *parse_path(path)), block.loop))]
        raw = block.encoded.words[offset]
        return Placement(block.table, word, block.loop, self._scaling(block), raw, tuple(origins))

    def _scaling(self, block: Block) -> Scaling | None:
        loops, vendor = self.checked.config.loops, self.checked.vendor
        if vendor is None or len(block.path) < 2 or block.path[0] != "loops" or not isinstance(block.path[1], int):
            return None
        scaling: Scaling = vendor.load("explainer").scaling(loops[block.path[1]], self.checked.config)
        return scaling

    def with_origin(self, page: Page, entry: Entry) -> Page:
        """A parameter's page with its loop and the line that gives it."""
        place = self._places.get(entry.address.removesuffix(f".{entry.field}"))
        if place is None:
            return replace(page, loop=entry.loop)
        origin = self.origin((*place, *parse_path(entry.field)), entry.loop)
        return replace(page, loop=entry.loop, origins=(origin,) if origin else ())

    @cached_property
    def _places(self) -> dict[object, Path]:
        """Where loops, blocks and signals stand in the file, by their names; of two with one name, the first."""
        data = self.document.data or {}
        items = [(key, i, item) for key in ("loops", "blocks", "signals") for i, item in enumerate(data.get(key) or ())]
        return {item.get("name"): (key, i) for key, i, item in reversed(items) if isinstance(item, dict)}

    def origins(self, key: str, *, in_loops: bool) -> list[Origin]:
        """The lines that give a key, of every loop or of the file."""
        path = parse_path(key)
        if not in_loops:
            return [origin] if (origin := self.origin(path, None)) else []
        lines = [self.origin(("loops", i, *path), loop) for i, loop in enumerate(self.loops)]
        return [origin for origin in lines if origin]

    def origin(self, path: Path, loop: str | None) -> Origin | None:
        """Where a key stands in the file; None where the file does not give it."""
        if not has_key(self.document.data, path):
            return None
        span = self.document.locate(path)
        text = str(value_at(self.document.data, path))
        return Origin(self.document.file, span.line, span.column, loop, path_text(path), text)
