"""Terms of a vendor whose parameters have names: every parameter of a loop, of a block, and the signals."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.differences.leaves import Leaf
from pidcfg.differences.terms import (
    Item,
    Owner,
    OwnerKind,
    Subject,
    Terms,
    beside,
    kind_by,
    name_in,
    number,
    others,
    said,
    whole_file,
)
from pidcfg.differences.wired import content_of
from pidcfg.encoders.parameters import shown
from pidcfg.encoders.written import D345, Written, writer_of
from pidcfg.paths import steps, value_at
from pidcfg.schemas.iec import Wire

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.encoders.parameters import Entry

OUTPUT_DEVICE = ("devices", "MV")
"""Where a loop says in which device its output stands, in a cascade that of another loop's set point."""
SIGNALS = "signals"
"""Where values that belong to no block are listed."""


def parameter_terms(subject: Subject) -> Terms:
    """The loops, blocks and signals of a file or listing."""
    image, table = subject.encoding.image, subject.vendor.load("written")
    names = [name_in(entry) for entry in image.settings]
    models = {item.name: item for item in (*getattr(subject.config, "blocks", ()), *subject.config.loops)}
    cells: dict[str, list[Entry]] = {name: [] for name in names}
    for cell in image.cells:
        cells.setdefault(owner_of(cell.address, names), []).append(cell)
    loops = {loop.name: i for i, loop in enumerate(subject.config.loops, start=1)}
    owners, settings = [whole_file(subject, {})], subject.settings
    outputs = {place: loop.name for loop in subject.config.loops if (place := value_at(loop, OUTPUT_DEVICE))}
    for name, entries in cells.items():
        model = models.get(name)
        values = {cell.field: cell.raw for cell in entries}
        items, place = {}, str(getattr(model, "device", ""))
        for cell in entries:
            writer = writer_of(table, SIGNALS if model is None else cell.field, values)
            if outer := outputs.get(cell.device):
                writer = Written(cell.field, "live", f"{outer}, whose output it is", D345)
            items[cell.field] = _item(subject, cell, model, writer)
        if model is not None:
            entry = settings[names.index(name)]
            items |= beside(entry, model, {})
            items |= dict(others(model, subject, [*items, *image.settings[names.index(name)]]))
        kind: OwnerKind = "signals" if model is None else "loop" if name in loops else "block"
        owners.append(Owner(name, kind, place, items, subject.is_described, loops.get(name, 0)))
    return Terms(tuple(owners), is_listing=subject.reading is not None)


def owner_of(address: str, names: Iterable[str]) -> str:
    """The loop or block that a parameter belongs to: the longest name that it begins with."""
    return max((name for name in names if address.startswith(f"{name}.")), key=len, default=SIGNALS)


def _item(subject: Subject, cell: Entry, model: Any, writer: Written | None) -> Item:
    """A parameter; one that is wired is a setting, whoever writes what it is wired to."""
    reading, content, fault, known = subject.reading, cell.raw, "", True
    if reading is not None:
        fault = reading.unreadable.get(cell.address, "")
        known = cell.address in reading.listing.words or not reading.partial
        content = reading.listing.words.get(cell.address, content) if fault else content
    value, unit = number(content), ""
    if model is not None and not isinstance(content, Wire):
        leaf = _leaf(model, cell.field, content)
        unit = "" if leaf is None else said(leaf, model, subject.vendor)[1]
    word = (
        f":= {content.text}" if isinstance(content, Wire) else shown(cell.type, content) if not fault else str(content)
    )
    is_mine = isinstance(content, Wire) or writer is None or writer.kind == "compared"
    kind = "setting" if is_mine else kind_by("setting", writer)
    address = cell.device or cell.address
    return Item(
        cell.field,
        None if fault else value,
        unit,
        content_of(content),
        address,
        word,
        kind,
        "" if writer is None or isinstance(content, Wire) else writer.by,
        fault,
        known,
    )


def _leaf(model: Any, key: str, content: Any) -> Leaf | None:
    """The parameter in its section of the model, with a content."""
    path = steps(key)
    named = path[:-1] if isinstance(path[-1], int) else path
    section = value_at(model, named[:-1]) if named[:-1] else model
    given: Mapping[str, Any] = {} if section is None else type(section).model_fields
    return Leaf(named, content, section, str(named[-1]), given=True) if named[-1] in given else None
