"""Terms of a vendor whose parameters have names: every parameter of a loop, of a block, and the signals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.differences.leaves import Leaf
from pidcfg.differences.terms import (
    SIGNALS,
    Item,
    Owner,
    OwnerKind,
    Subject,
    Terms,
    beside,
    kind_by,
    number,
    others,
    said,
    whole_file,
)
from pidcfg.differences.wired import content_of
from pidcfg.encoders.parameters import Entry, read, shown
from pidcfg.encoders.written import D345, Written, writer_of
from pidcfg.listings import name_in
from pidcfg.paths import steps, value_at
from pidcfg.schemas.iec import BOOL, DINT, LOOP_MODE, LREAL, Wire

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from pidcfg.differences.reading import Reading

TYPE_OF = {bool: BOOL, int: DINT, float: LREAL, str: LOOP_MODE}
"""The type of a content that no table knows, as far as it is shown."""
OUTPUT_DEVICE = ("devices", "MV")
"""Where a loop says in which device its output stands, in a cascade that of another loop's set point."""


def parameter_terms(subject: Subject) -> Terms:
    """The loops, blocks and signals of a file or listing."""
    image, table = subject.encoding.image, subject.vendor.load("written")
    names = [name_in(entry) for entry in image.settings]
    models = {item.name: item for item in (*getattr(subject.config, "blocks", ()), *subject.config.loops)}
    cells: dict[str, list[Entry]] = {name: [] for name in names}
    for cell in (*image.cells, *_others(subject)):
        cells.setdefault(owner_of(cell.address, names), []).append(cell)
    loops = {loop.name: i for i, loop in enumerate(subject.config.loops, start=1)}
    owners, settings = [whole_file(subject, {})], subject.settings
    outputs = {place: loop.name for loop in subject.config.loops if (place := value_at(loop, OUTPUT_DEVICE))}
    for name, entries in cells.items():
        model = models.get(name)
        values = {cell.field: cell.raw for cell in entries}
        items, place = {}, str(getattr(model, "device", ""))
        for cell in entries:
            key = cell.field or cell.address.removeprefix(f"{name}.")
            writer = writer_of(table, SIGNALS if model is None else key, values)
            if outer := outputs.get(cell.device):
                writer = Written(key, "live", f"{outer}, whose output it is", D345)
            items[key] = _item(subject, cell, key, model, writer)
        if model is not None:
            entry = settings[names.index(name)]
            items |= beside(entry, model, {}, subject.faults(name))
            items |= dict(others(model, subject, [*items, *image.settings[names.index(name)]]))
        kind: OwnerKind = "signals" if model is None else "loop" if name in loops else "block"
        owners.append(Owner(name, kind, place, items, subject.is_described, loops.get(name, 0)))
    return Terms(tuple(owners), is_listing=subject.reading is not None)


def _others(subject: Subject) -> Iterator[Entry]:
    """The parameters of a listing that its configuration does not have."""
    if subject.reading is None or subject.reading.listing.mixed:
        return
    own = subject.encoding.image.words
    for name, raw in subject.reading.listing.words.items():
        if name not in own:
            yield Entry(name, TYPE_OF.get(type(raw), LREAL), raw, "")


def owner_of(address: str, names: Iterable[str]) -> str:
    """The loop or block that a parameter belongs to: the longest name that it begins with."""
    return max((name for name in names if address.startswith(f"{name}.")), key=len, default=SIGNALS)


def _content(cell: Entry, reading: Reading | None) -> tuple[Any, str, bool]:
    """The content of a parameter on a side, why it is no value, and whether the side has it."""
    if reading is None:
        return cell.raw, "", True
    raw = reading.listing.words.get(cell.address)
    if raw is None:
        return cell.raw, "", not (reading.partial or reading.fault)
    held = None if isinstance(raw, Wire) else read(cell.type, raw)
    return raw if held is None else held, reading.unreadable.get(cell.address, ""), True


def _item(subject: Subject, cell: Entry, key: str, model: Any, writer: Written | None) -> Item:
    """A parameter; one that is wired is a setting, whoever writes what it is wired to."""
    content, fault, known = _content(cell, subject.reading)
    unit = ""
    if model is not None and not isinstance(content, Wire):
        leaf = _leaf(model, key, content)
        unit = "" if leaf is None else said(leaf, model, subject.vendor)[1]
    is_mine = isinstance(content, Wire) or writer is None or writer.kind == "compared"
    return Item(
        key,
        None if fault else number(content),
        unit,
        content_of(content),
        cell.device or cell.address,
        _word(cell, content, fault),
        "setting" if is_mine else kind_by("setting", writer),
        "" if writer is None or isinstance(content, Wire) else writer.by,
        fault,
        known,
    )


def _word(cell: Entry, content: Any, fault: str) -> str:
    """A content as the PLC shows it."""
    if isinstance(content, Wire):
        return f":= {content.text}"
    return str(content) if fault else shown(cell.type, content)


def _leaf(model: Any, key: str, content: Any) -> Leaf | None:
    """The parameter in its section of the model, with a content."""
    path = steps(key)
    named = path[:-1] if isinstance(path[-1], int) else path
    section = value_at(model, named[:-1]) if named[:-1] else model
    given: Mapping[str, Any] = {} if section is None else type(section).model_fields
    return Leaf(named, content, section, str(named[-1]), given=True) if named[-1] in given else None
