"""A configuration or a listing in the words of its file and of its PLC: loop by loop, value by value, with units."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import field, replace
from decimal import Decimal
from functools import cache
from typing import Any, Literal, NamedTuple

from pydantic import BaseModel

from pidcfg.conversion import json_value
from pidcfg.encoders.contract import tables_of, units_by_path
from pidcfg.encoders.decoding import Reading, owner_name
from pidcfg.encoders.image import Settings
from pidcfg.encoders.regmap import Access, TuningNumbers, Writer
from pidcfg.schemas.base import (
    UNIT_WORDS,
    ConfigurationFile,
    Duration,
    Parser,
    Quantity,
    Rate,
    limits_at,
    parse_seconds,
    unit_text,
    units_of,
)
from pidcfg.schemas.expressions import (
    BOOL_VALUES,
    CONSTANT,
    FUNCTIONS,
    OPERATOR_WORDS,
    SIGNAL,
    TRUTH,
    ExpressionError,
    TypedParser,
    lengths_of,
)
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.diagnostics import path_text
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, dotted_text, outer_keys, parse_path
from pidcfg.vendors import Vendor

# --- The values of a configuration one by one, each with the unit that a reader needs ---------------------------------

RANGE_KEYS = ("range", "input_range")
GAIN_UNITS = {"percent": "%/pv", "engineering": "output/pv"}
"""Units of a gain by what the vendor counts it in; a gain of counts per count has none."""
TERM_UNITS = ("output/pv", "output/pv/s", "output per pv/s")
"""Units of the three gains of an independent form: MV for the error, for its integral, for its derivative."""


@frozen
class Leaf:
    """A value of a model: its path, the model that has it, and whether the file says it."""

    path: Path
    value: Any
    model: BaseModel
    key: str
    is_given: bool = True

    @property
    def text(self) -> str:
        """Its path as text: ``steps[0].slope``."""
        return path_text(self.path)


def leaves(model: BaseModel, prefix: Path = (), *, is_given: bool = True) -> Iterator[Leaf]:
    """Every value of a model that is one, in the order of its fields."""
    for key in type(model).model_fields:
        value, is_written = getattr(model, key), is_given and key in model.model_fields_set
        path = (*prefix, key)
        if isinstance(value, BaseModel):
            yield from leaves(value, path, is_given=is_written)
        elif isinstance(value, tuple) and value and all(isinstance(part, BaseModel) for part in value):
            for i, part in enumerate(value):
                yield from leaves(part, (*path, i), is_given=is_written)
        elif hasattr(value, "items"):
            yield from (Leaf((*path, name), part, model, key, is_written) for name, part in value.items())
        elif value not in (None, ()):
            yield Leaf(path, value, model, key, is_written)


def _is_raw(leaf: Leaf, unit: str, loop: object) -> bool:
    """Whether a quantity is raw counts: written so, or on a scale without a range."""
    quantities = leaf.value if isinstance(leaf.value, tuple) and type(leaf.value) is tuple else (leaf.value,)
    if not all(isinstance(part, Quantity) for part in quantities):
        return False
    section = getattr(loop, unit.partition("/")[0], None)
    return all(part.counts for part in quantities) or getattr(section, "range", None) is None


def unit_of(leaf: Leaf, loop: object, vendor: Vendor, units: Mapping[str, str]) -> str:
    """The unit of a setting as a reader needs it, with nothing left to be chosen.

    ``units``: those of PV and output, or what stands for them.
    """
    value = leaf.value
    chosen_unit = getattr(leaf.model, f"{leaf.key}_unit", None)
    duration = value if isinstance(value, Duration) else getattr(value, "duration", None)
    if isinstance(duration, Duration):
        return duration.unit or UNIT_WORDS.get(str(chosen_unit), "") or _table_unit(leaf, vendor)
    if isinstance(value, Rate):
        return unit_text(f"pv/{value.per}", {**units, "pv": "counts"} if value.counts else units)
    if isinstance(value, bool | str | Wire) and not str(leaf.path[-1]).endswith(RANGE_KEYS):
        return ""
    unit = _table_unit(leaf, vendor)
    if _is_raw(leaf, unit, loop):
        return "/".join(["counts", *unit.split("/")[1:]])
    return unit_text(unit, units)


def _term_unit(leaf: Leaf, vendor: Vendor) -> str:
    """The unit of one of the three terms, where the vendor's tables leave it open."""
    tuning_numbers, term_indices = _tuning_terms(vendor)
    index = term_indices.get(leaf.path, -1)
    if index == 0:
        return GAIN_UNITS.get(tuning_numbers.gain_unit, "")
    form = getattr(tuning_numbers, "dependent", None) if index > 0 else None
    form_value = getattr(leaf.model, form[0], None) if form else None
    if form is None or not isinstance(form_value, bool):
        return ""
    return "s" if form_value is form[1] else TERM_UNITS[index]


@cache
def _tuning_terms(vendor: Vendor) -> tuple[TuningNumbers, Mapping[Path, int]]:
    """How a vendor's gains are stored, and where the three terms stand, in their order."""
    tuning_numbers = tables_of(vendor).TUNING_NUMBERS
    return tuning_numbers, {parse_path(tuning_numbers.key(name)): i for i, name in enumerate(tuning_numbers.names)}


def _table_unit(leaf: Leaf, vendor: Vendor) -> str:
    """The unit by the vendor's tables, then by the limits of the field, then by its type."""
    return _term_unit(leaf, vendor) or _field_unit(leaf.path, type(leaf.model), leaf.key, vendor)


@cache
def _field_unit(path: Path, model: type[BaseModel], key: str, vendor: Vendor) -> str:
    table, text = units_by_path(vendor), path_text(path)
    unit = next((table[place] for place in (text, f"{text}.0", text.rpartition("].")[2]) if place in table), "")
    marks = [] if unit else model.model_fields[key].metadata
    limits = None if unit else limits_at(model, key)
    unit = unit or (limits.unit if limits else "")
    if not unit and key in RANGE_KEYS:
        return str(path[-2])
    return unit or ("s" if Parser(parse_seconds) in marks else "")


# --- What a wire means, however it is written: two expressions are compared by what they calculate, step by step ------

WIRED_KEYS = ("move", "when")
"""Keys of a move that hold a wire."""
RESERVED_WORDS = frozenset((*OPERATOR_WORDS, *BOOL_VALUES))
NAME_PATTERN = re.compile(r"[A-Za-z_]\w*(?:\.\w+)*")


class WireContent(NamedTuple):
    """The steps of an expression, each with its constant or the name of its signal; else its text."""

    steps: tuple[tuple[int, float | str | None], ...]
    text: str = ""

    def rename_blocks(self, names: Mapping[str, str]) -> WireContent:
        """The same with other names of blocks."""
        return WireContent(tuple((op, _rename_operand(operand, names)) for op, operand in self.steps), self.text)


def _rename_operand(operand: float | str | None, names: Mapping[str, str]) -> float | str | None:
    if not isinstance(operand, str):
        return operand
    block, dot, key = operand.partition(".")
    return f"{names.get(block, block)}{dot}{key}"


def content_of(raw: object) -> Any:
    """A content as it is compared: of a wire what it means."""
    if not isinstance(raw, Wire):
        return raw
    names = [
        name
        for name in dict.fromkeys(NAME_PATTERN.findall(raw.text))
        if name not in FUNCTIONS and name.upper() not in RESERVED_WORDS
    ]
    try:
        code, constants = _expression_code(raw.text, names)
    except ExpressionError:
        return WireContent((), raw.text)
    steps = []
    for op, operand in zip(code[::2], code[1::2], strict=True):
        value = names[operand] if op == SIGNAL else constants[operand] if op == CONSTANT else None
        value = float(operand) if op == TRUTH else value
        steps.append((op, value))
    return WireContent(tuple(steps))


def move_content(value: object) -> Any:
    """What the wires of a move mean, however they are written; None for a content that is no move."""
    if not isinstance(value, dict) or "move" not in value:
        return None
    parts = ((key, content_of(Wire(str(part))) if key in WIRED_KEYS else part) for key, part in value.items())
    return tuple(sorted(parts))


def order_moves(entry: Mapping[str, object]) -> Mapping[str, object]:
    """What stands beside the parameters, with its moves as they are executed: those before all blocks come first."""
    moves = entry.get("moves")
    if not isinstance(moves, list | tuple):
        return entry
    return {**entry, "moves": sorted(moves, key=lambda move: move.get("at") != "start")}


def _expression_code(text: str, names: list[str]) -> tuple[tuple[int, ...], tuple[float, ...]]:
    expression = TypedParser(text, {name: i for i, name in enumerate(names)}, lengths_of(names)).read()
    return expression.code, expression.constants


# ----------------------------------------------------------------------------------------------------------------------
# A configuration or a listing in the words of its file and of its PLC: loop by loop, every key with its register.
# `memory_terms` makes them of a vendor with registers, `parameter_terms` of one with named parameters; both are
# compared by `pidcfg.conversion.comparison`. What is compared is the content of a register (or of one choice inside
# it),
# so that a spelling is no difference; what is shown is what the file says, and for a listing what its word means.

Kind = Literal["setting", "live", "operated", "reserved"]
"""The engineer's; the PLC's or the process's; the operator's; nobody's."""
SIGNALS: Literal["signals"] = "signals"
"""Where values that belong to no block are listed."""
OwnerKind = Literal["file", "loop", "block", "signals"]
OWNER_NAME_KEYS = frozenset(("loop", "block"))
"""Settings beside the words that are the name of what they are of."""
LISTING_KEYS = ("name", "description")
"""What a listing says of the whole file that stands at the top of it."""
CONFIGURATION_KEY = "configuration"
"""What a listing is said to lack whose words and settings give none."""
CALCULATED_TEXT = "calculated"
"""What is told of a loop that the PLC runs."""
SETPOINT_SWITCH = "setpoint"
"""The switch beside the words that says that the set point is left to the operator."""


@frozen
class Item:
    """A key of a loop: what the file says of it, and the register that holds it."""

    key: str
    value: Any = None
    """As JSON has it; None: it is not given, or its word is no value."""
    unit: str | Callable[[], str] = ""
    """Its unit, or what works it out where it is told."""
    content: Any = None
    """What is compared."""
    address: str = ""
    word: str | None = None
    """The content of the register as the PLC shows it."""
    kind: Kind = "setting"
    writer: str = ""
    """Who else writes it."""
    fault: str = ""
    """Why its word is no value."""
    is_known: bool = True
    """Whether the listing holds it."""
    is_default: bool = False
    """Whether it means the same when it is not given."""
    file_only: bool = False
    """Whether no listing says it."""
    is_optional: bool = False
    """Whether a file may leave its register alone."""
    number: Any = None
    """What tells its register or parameter from the others of an image; None: it has none."""


@frozen
class Owner:
    """A loop, a block, the signals or the whole file, with its keys."""

    name: str
    kind: OwnerKind = "loop"
    addresses: str = ""
    """The addresses at which its registers begin."""
    items: dict[str, Item] = field(default_factory=dict)
    """By what is told apart: the path of a register's row, or a key."""
    is_described: bool = True
    """Whether this side says what no register holds, so that what it does not say is not there."""
    number: int = 0
    """Of a loop: its place in the order of the file, from 1."""


@frozen
class Terms:
    """One side of a comparison."""

    owners: tuple[Owner, ...]
    is_listing: bool = False
    has_address: Callable[[str], bool] = bool
    """Whether a listing holds an address; a file holds all of its own."""


class Subject(NamedTuple):
    """What is put into terms: a configuration, its encoding, and the listing that both were read from."""

    vendor: Vendor
    config: ConfigurationFile
    encoding: Any
    reading: Reading | None = None

    @property
    def settings(self) -> list[Settings]:
        """What this side itself says beside its words, an entry a loop or block; nothing that a listing was given."""
        if self.reading is None:
            return list(self.encoding.image.settings)
        by_name = {owner_name(entry): entry for entry in self.reading.listing.settings}
        return [by_name.get(owner_name(entry), {}) for entry in self.encoding.image.settings]

    def faults(self, name: str) -> dict[str, str]:
        """What is refused of the settings of a loop, by key, and why; of no loop: of the whole file."""
        refused = {} if self.reading is None else self.reading.refused
        return {key: fault for (owner, key), fault in refused.items() if owner == name}

    @property
    def is_described(self) -> bool:
        """Whether this side says what no register holds, so that what it does not say is not there."""
        return self.reading is None or self.reading.listing.has_settings


def value_and_unit(leaf: Leaf, loop: object, vendor: Vendor, units: Mapping[str, str]) -> tuple[object, str]:
    """A value as JSON has it, and its unit; ``units``: the loop's `unit_names`."""
    value = leaf.value
    if isinstance(getattr(value, "duration", value), Duration):
        value = getattr(value, "duration", value)
    elif hasattr(value, "duration"):
        return str(value), ""
    return json_number(value), trim_unit(unit_of(leaf, loop, vendor, units))


def json_number(value: Any) -> Any:
    """A value without its unit, as JSON has it."""
    if isinstance(value, Quantity | Duration | Rate):
        return plain_number(value.value)
    if isinstance(value, Wire):
        return value.text
    if isinstance(value, float):
        return plain_number(Decimal(repr(value)))
    if isinstance(value, list | tuple):
        return [json_number(part) for part in value]
    return json_value(value)


def unit_names(loop: object) -> dict[str, str]:
    """The units of PV and output of a loop, empty where it does not say them."""
    return {"pv": "", "output": "", **units_of(loop)}


def trim_unit(unit: str) -> str:
    """A unit without the quotient by a unit that is not known."""
    return unit.strip(" ").removesuffix("/").removesuffix(" per")


def item_kind(access: Access, writer: Writer | None) -> Kind:
    """Whose an item is, by the row of who else writes it, else by its access."""
    if writer is not None:
        return "setting" if writer.kind == "compared" else writer.kind
    return "setting" if access == "setting" else "reserved" if access == "reserved" else "live"


def flatten(entry: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """The values of nested mappings by their dotted keys, without what is nothing."""
    for key, value in entry.items():
        if isinstance(value, dict):
            yield from flatten(value, f"{prefix}{key}.")
        elif isinstance(value, list):
            yield from ((f"{prefix}{key}.{i}", end) for i, end in enumerate(value))
        elif value is not None:
            yield f"{prefix}{key}", value


def setting_items(
    entry: Mapping[str, object], loop: object, writers: Mapping[str, Writer], faults: Mapping[str, str]
) -> dict[str, Item]:
    """What stands beside the words of a loop, by its keys; ``faults``: what is refused of it, and why."""
    units, items = unit_names(loop), {}
    for key, value in flatten({key: value for key, value in entry.items() if key not in OWNER_NAME_KEYS}):
        writer = writers.get(key)
        unit = units.get(key.partition(".")[0], "") if ".range." in key else ""
        if key == SETPOINT_SWITCH:
            items[key] = Item(f"{SETPOINT_SWITCH}.value", "left to the operator", content=value, kind="operated")
        else:
            kind = item_kind("setting", writer)
            items[key] = Item(
                key, json_number(value), unit, json_number(value), kind=kind, writer=writer.writer if writer else ""
            )
    return add_faults(items, faults)


def add_faults(items: Mapping[str, Item], faults: Mapping[str, str]) -> dict[str, Item]:
    """Settings with why they are refused; what is refused because it is not there becomes one of its own."""
    marked = dict(items)
    for key, fault in faults.items():
        affected = [name for name in items if do_keys_overlap(name, key)]
        marked |= {name: replace(items[name], fault=fault) for name in affected} or {key: Item(key, fault=fault)}
    return marked


def file_items(model: Any, subject: Subject, keys_used: Iterable[str]) -> Iterator[tuple[str, Item]]:
    """The keys of a file's section that nothing else is made of: no register holds them, nor does any listing."""
    if subject.reading is not None:
        return
    ids, units = set(keys_used), unit_names(model)
    outer_ids = {outer for name in ids for outer in outer_keys(name)}
    for leaf in leaves(model):
        key = dotted_text(leaf.path)
        if key in LISTING_KEYS or key in ids or key in outer_ids or not ids.isdisjoint(outer_keys(key)):
            continue
        value, unit = value_and_unit(leaf, model, subject.vendor, units)
        yield key, Item(key, value, unit, value, is_default=is_default(leaf), file_only=True)


def is_default(leaf: Leaf) -> bool:
    """Whether a value is what the schema takes where it is not given."""
    entry = type(leaf.model).model_fields.get(leaf.key)
    return entry is not None and not entry.is_required() and entry.default == leaf.value


def do_keys_overlap(key: str, other: str) -> bool:
    """Whether two keys are one, or one is a part of the other: ``output.limits`` and ``output.limits.0``."""
    return key == other or key.startswith(f"{other}.") or other.startswith(f"{key}.")


def file_owner(subject: Subject, registers: Mapping[str, Item]) -> Owner:
    """The keys of a file that belong to no loop; ``registers``: those that a register holds."""
    entry: Settings = subject.encoding.image.plc
    if subject.reading is not None:
        entry = subject.reading.listing.plc
    items = dict(registers)
    if subject.reading is not None and subject.reading.fault:
        items[CONFIGURATION_KEY] = Item(CONFIGURATION_KEY, "none", fault=subject.reading.fault)
    plc = getattr(subject.config, "plc", None)
    if plc is not None and subject.reading is None:
        for leaf in leaves(plc):
            key = f"plc.{dotted_text(leaf.path)}"
            if not any(do_keys_overlap(key, other) for other in registers):
                value, unit = value_and_unit(leaf, plc, subject.vendor, unit_names(plc))
                items[key] = Item(key, value, unit, value, is_default=is_default(leaf))
    for name, value in flatten(order_moves(entry)):
        key = name if name in LISTING_KEYS else f"plc.{name}"
        items.setdefault(key, Item(key, json_number(value), "", move_content(value) or json_number(value)))
    items = add_faults(items, subject.faults(""))
    return Owner("", "file", "", items, is_described=subject.is_described)
