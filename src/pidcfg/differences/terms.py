"""A configuration or a listing in the words of its file and of its PLC: loop by loop, every key with its register.

`memory_terms` makes them of a vendor with registers, `parameter_terms` of one with named parameters; both are compared
by `pidcfg.differences.within`. What is compared is the content of a register (or of one choice inside it), so that a
spelling is no difference; what is shown is what the file says, and for a listing what its word means.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pidcfg.conversion.values import shown
from pidcfg.differences.leaves import Leaf, leaves, unit_of
from pidcfg.differences.wired import executed, move_content
from pidcfg.listings import name_in
from pidcfg.paths import dotted
from pidcfg.schemas.base import Duration, Quantity
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import plain_number
from pidcfg.schemas.rates import Rate
from pidcfg.schemas.units import units_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from pidcfg.differences.reading import Reading
    from pidcfg.encoders.regmap import Access
    from pidcfg.encoders.written import Written
    from pidcfg.vendors import Vendor

Kind = Literal["setting", "live", "operated", "reserved"]
"""The engineer's; the PLC's or the process's; the operator's; nobody's."""
SIGNALS: Literal["signals"] = "signals"
"""Where values that belong to no block are listed."""
OwnerKind = Literal["file", "loop", "block", "signals"]
NAMES = frozenset(("loop", "block"))
"""Settings beside the words that are the name of what they are of."""
TOP = ("name", "description")
"""What a listing says of the whole file that stands at the top of it."""
CONFIGURATION = "configuration"
"""What a listing is said to lack whose words and settings give none."""
SETPOINT = "setpoint"
"""The switch beside the words that says that the set point is left to the operator."""


@dataclass(frozen=True, slots=True)
class Item:
    """A key of a loop: what the file says of it, and the register that holds it."""

    key: str
    value: Any = None
    """As JSON has it; None: it is not given, or its word is no value."""
    unit: str = ""
    content: Any = None
    """What is compared."""
    address: str = ""
    word: str | None = None
    """The content of the register as the PLC shows it."""
    kind: Kind = "setting"
    by: str = ""
    """Who else writes it."""
    fault: str = ""
    """Why its word is no value."""
    known: bool = True
    """Whether the listing holds it."""
    default: bool = False
    """Whether it means the same when it is not given."""
    file_only: bool = False
    """Whether no listing says it."""
    optional: bool = False
    """Whether a file may leave its register alone."""


@dataclass(frozen=True, slots=True)
class Owner:
    """A loop, a block, the signals or the whole file, with its keys."""

    name: str
    kind: OwnerKind = "loop"
    place: str = ""
    """The addresses at which its registers begin."""
    items: dict[str, Item] = field(default_factory=dict)
    """By what is told apart: the path of a register's row, or a key."""
    is_described: bool = True
    """Whether this side says what no register holds, so that what it does not say is not there."""
    number: int = 0
    """Of a loop: its place in the order of the file, from 1."""


@dataclass(frozen=True, slots=True)
class Terms:
    """One side of a comparison."""

    owners: tuple[Owner, ...]
    is_listing: bool = False
    holds: Callable[[str], bool] = bool
    """Whether a listing holds an address; a file holds all of its own."""


class Subject(NamedTuple):
    """What is put into terms: a configuration, its encoding, and the listing that both were read from."""

    vendor: Vendor
    config: Any
    encoding: Any
    reading: Reading | None = None

    @property
    def settings(self) -> list[Mapping[str, Any]]:
        """What this side itself says beside its words, an entry a loop or block; nothing that a listing was given."""
        if self.reading is None:
            return list(self.encoding.image.settings)
        by_name = {name_in(entry): entry for entry in self.reading.listing.settings}
        return [by_name.get(name_in(entry), {}) for entry in self.encoding.image.settings]

    def faults(self, name: str) -> dict[str, str]:
        """What is refused of the settings of a loop, by key, and why; of no loop: of the whole file."""
        refused = {} if self.reading is None else self.reading.refused
        return {key: fault for (owner, key), fault in refused.items() if owner == name}

    @property
    def is_described(self) -> bool:
        """Whether this side says what no register holds, so that what it does not say is not there."""
        return self.reading is None or self.reading.listing.described


def said(leaf: Leaf, loop: Any, vendor: Vendor) -> tuple[Any, str]:
    """A value as JSON has it, and its unit."""
    value = leaf.value
    if isinstance(getattr(value, "duration", value), Duration):
        value = getattr(value, "duration", value)
    elif hasattr(value, "duration"):
        return str(value), ""
    unit = unit_of(leaf, loop, vendor, unit_names(loop))
    return number(value), trimmed(unit)


def number(value: Any) -> Any:
    """A value without its unit, as JSON has it."""
    if isinstance(value, Quantity | Duration | Rate):
        return plain_number(value.value)
    if isinstance(value, Wire):
        return value.text
    if isinstance(value, float):
        return plain_number(Decimal(repr(value)))
    if isinstance(value, list | tuple):
        return [number(part) for part in value]
    return shown(value)


def unit_names(loop: Any) -> dict[str, str]:
    """The units of PV and output of a loop, empty where it does not say them."""
    return {"pv": "", "output": "", **units_of(loop)}


def trimmed(unit: str) -> str:
    """A unit without the quotient by a unit that is not known."""
    return unit.strip(" ").removesuffix("/").removesuffix(" per")


def kind_by(access: Access, writer: Written | None) -> Kind:
    """Whose an item is, by the row of who else writes it, else by its access."""
    if writer is not None:
        return "setting" if writer.kind == "compared" else writer.kind
    return "setting" if access == "setting" else "reserved" if access == "reserved" else "live"


def flat(entry: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, Any]]:
    """The values of nested mappings by their dotted keys, without what is nothing."""
    for key, value in entry.items():
        if isinstance(value, dict):
            yield from flat(value, f"{above}{key}.")
        elif isinstance(value, list):
            yield from ((f"{above}{key}.{i}", end) for i, end in enumerate(value))
        elif value is not None:
            yield f"{above}{key}", value


def beside(
    entry: Mapping[str, Any], loop: Any, writers: Mapping[str, Written], faults: Mapping[str, str]
) -> dict[str, Item]:
    """What stands beside the words of a loop, by its keys; ``faults``: what is refused of it, and why."""
    units, items = unit_names(loop), {}
    for key, value in flat({key: value for key, value in entry.items() if key not in NAMES}):
        writer = writers.get(key)
        unit = units.get(key.partition(".")[0], "") if ".range." in key else ""
        if key == SETPOINT:
            items[key] = Item(f"{SETPOINT}.value", "left to the operator", content=value, kind="operated")
        else:
            kind = kind_by("setting", writer)
            items[key] = Item(key, number(value), unit, number(value), kind=kind, by=writer.by if writer else "")
    return with_faults(items, faults)


def with_faults(items: Mapping[str, Item], faults: Mapping[str, str]) -> dict[str, Item]:
    """Settings with why they are refused; what is refused because it is not there becomes one of its own."""
    marked = dict(items)
    for key, fault in faults.items():
        told = [name for name in items if overlap(name, key)]
        marked |= {name: replace(items[name], fault=fault) for name in told} or {key: Item(key, fault=fault)}
    return marked


def others(model: Any, subject: Subject, taken: Iterable[str], above: str = "") -> Iterator[tuple[str, Item]]:
    """The keys of a file's section that nothing else is made of: no register holds them, nor does any listing."""
    if subject.reading is not None:
        return
    ids = list(taken)
    for leaf in leaves(model):
        key = above + dotted(leaf.path)
        if key in TOP or any(overlap(key, other) for other in ids):
            continue
        value, unit = said(leaf, model, subject.vendor)
        yield key, Item(key, value, unit, value, default=is_default(leaf), file_only=True)


def is_default(leaf: Leaf) -> bool:
    """Whether a value is what the schema takes where it is not given."""
    entry = type(leaf.model).model_fields.get(leaf.key)
    return entry is not None and not entry.is_required() and entry.default == leaf.value


def overlap(key: str, other: str) -> bool:
    """Whether two keys are one, or one is a part of the other: ``output.limits`` and ``output.limits.0``."""
    return key == other or key.startswith(f"{other}.") or other.startswith(f"{key}.")


def whole_file(subject: Subject, registers: Mapping[str, Item]) -> Owner:
    """The keys of a file that belong to no loop; ``registers``: those that a register holds."""
    entry: Mapping[str, Any] = subject.encoding.image.plc
    if subject.reading is not None:
        entry = subject.reading.listing.plc
    items = dict(registers)
    if subject.reading is not None and subject.reading.fault:
        items[CONFIGURATION] = Item(CONFIGURATION, "none", fault=subject.reading.fault)
    plc = getattr(subject.config, "plc", None)
    if plc is not None and subject.reading is None:
        for leaf in leaves(plc):
            key = f"plc.{dotted(leaf.path)}"
            if not any(overlap(key, other) for other in registers):
                value, unit = said(leaf, plc, subject.vendor)
                items[key] = Item(key, value, unit, value, default=is_default(leaf))
    for name, value in flat(executed(entry)):
        key = name if name in TOP else f"plc.{name}"
        items.setdefault(key, Item(key, number(value), "", move_content(value) or number(value)))
    items = with_faults(items, subject.faults(""))
    return Owner("", "file", "", items, is_described=subject.is_described)
