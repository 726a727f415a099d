"""Where things are: the word that a key becomes, and every place that names a loop, which may get another name."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.parameters import content_text
from pidcfg.schemas.iec import Wire
from pidcfg.text.diagnostics import Edit, Severity, Span
from pidcfg.text.document import span_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import parse_path
from pidcfg.text.reader import read_named_file
from pidcfg.text.source import read_document
from pidcfg.validate.engine import is_configuration, is_scenario
from pidcfg.validate.fixes import apply_edits
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence

    from pidcfg.encoders.image import Block
    from pidcfg.encoders.parameters import Parameter
    from pidcfg.encoders.regmap import Point, Space
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document, Node
    from pidcfg.text.paths import Path
    from pidcfg.text.reader import Reader
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

    Check = Callable[[Mapping[str, Document]], Iterable[Diagnostic]]

# --- Which word a key of a file becomes -------------------------------------------------------------------------------


class Holder(NamedTuple):
    """What holds the value of a key: a register or some bits of one, or a parameter with a name."""

    path: Path
    address: str
    """As the vendor writes it: ``V2010``, ``V2000.2``, ``DF106``, ``TIC_1.Kp``."""
    shown: str
    """The content as the PLC shows it."""
    raw: int | None = None
    """The whole register; None for a parameter with a name."""
    loop: str = ""
    title: str = ""
    basis: str = ""
    """The manual's place."""


def held_words(checked: Checked) -> Iterator[Holder]:
    """What holds the values of a configuration, key by key; nothing where it cannot be encoded."""
    encoding: Any = checked.encoding
    if encoding is None:
        return
    for block in encoding.blocks:
        for point in block.table.points if block not in encoding.blocks_outside else ():
            if point.path is not None:
                yield _register_of(encoding.space, block, point)
    data = checked.document.data or {}
    paths_by_name: dict[str, Path] = {
        str(item.get(NAME_KEY)): (section, i)
        for section in (LOOPS_KEY, "blocks")
        for i, item in enumerate(data.get(section) or ())
        if isinstance(item, dict)
    }
    for entry in encoding.entries:
        item_path = paths_by_name.get(entry.address.removesuffix(f".{entry.field}"))
        if item_path is not None:
            content = entry.raw.text if isinstance(entry.raw, Wire) else content_text(entry.type, entry.raw)
            row = _parameters_of(checked.vendor).get(entry.field)
            title_and_basis = (row.title, str(row.basis or "")) if row is not None else ("", "")
            path = (*item_path, *parse_path(entry.field))
            yield Holder(path, entry.device or entry.address, content, None, entry.loop or "", *title_and_basis)


@cache
def _parameters_of(vendor: Vendor | None) -> dict[str, Parameter]:
    """The parameters of a vendor that have names, by these."""
    tables: Any = () if vendor is None else tables_of(vendor).TABLES
    return {row.name: row for table in tables for row in getattr(table, "rows", ())}


def _register_of(space: Space, block: Block, point: Point) -> Holder:
    """The register of a key, or the bits of it that say the key's choice."""
    number, raw = block.start + point.offset, block.encoded.words[point.offset]
    name, shown = space.name(number), space.content_text(number, raw)
    if point.bits:
        first, last = min(point.bits), max(point.bits)
        name += f".{first}" if first == last else f".{','.join(map(str, point.bits))}"
        shown = str(sum((raw >> bit & 1) << i for i, bit in enumerate(point.bits)))
    path = (*block.path, *parse_path(point.path or ""))
    return Holder(path, name, shown, raw, block.loop or "", point.title, str(getattr(point, "basis", "")))


def wires_of(doc: Document) -> list[str]:
    """What a parameter of a configuration may be wired to: its signals, and the outputs of its loops and blocks."""
    data, vendor = doc.data or {}, VENDORS.get(str((doc.data or {}).get("vendor")))
    if vendor is None or vendor.banks:
        return []
    tables: Any = tables_of(vendor).TABLES
    outputs = {table.title: [row.name for row in table.rows if row.access == "output"] for table in tables}
    signals = data.get("signals")
    wires = [*signals] if isinstance(signals, dict) else []
    for section in (LOOPS_KEY, "blocks"):
        for item in data.get(section) or ():
            names = outputs.get(str(item.get("type")), ()) if isinstance(item, dict) and NAME_KEY in item else ()
            wires += [f"{item[NAME_KEY]}.{name}" for name in names if "." not in name]
    return wires


# --- What names a loop: keys and texts, but for those that are prose, names of files, or names of other things --------

LOOPS_KEY, NAME_KEY, CONFIG_KEY = "loops", "name", "config"
OTHER_KEYS = frozenset(("description", "unit", "vendor", "scenario", CONFIG_KEY, "reference", "map", "tag", "nickname"))
"""Keys whose texts name no loop."""
LOOP_KEYS = frozenset((NAME_KEY, "loop", "cascade_from", "source", "signal", "input"))
"""Keys whose texts name one, or a signal that is called as it is."""
CONNECT_KEY = "connect"
LOOP_MAPPINGS = frozenset((("plants",), ("initial",), ("tolerance",), ("vary", LOOPS_KEY), ("vary", "plants")))
"""Mappings of a scenario whose keys are loops."""
LOOP_LISTS = frozenset(((LOOPS_KEY,), ("assumed_signs",)))
"""Lists of a scenario whose items are loops."""


@frozen
class Reference:
    """A place that names a loop; ``defines``: the ``name`` of the loop itself."""

    loop: str
    file: str
    span: Span
    path: Path
    defines: bool = False


class LoopPlace(NamedTuple):
    """A loop of a configuration: its name, where that is written, and where the loop begins and ends (lines)."""

    name: str
    span: Span
    path: Path
    last_line: int


def loops_of(doc: Document) -> list[LoopPlace]:
    """The loops of a configuration that have names, in their order."""
    loops = (doc.data or {}).get(LOOPS_KEY)
    if not is_configuration(doc) or not isinstance(loops, list):
        return []
    places = []
    for i, loop in enumerate(loops):
        name = loop.get(NAME_KEY) if isinstance(loop, dict) else None
        if isinstance(name, str):
            path = (LOOPS_KEY, i, NAME_KEY)
            entry = doc.root.child(LOOPS_KEY)
            node = entry[1].child(i) if entry is not None else None
            last_line = doc.locate(path).line if node is None else _last_line(node[1])
            places.append(LoopPlace(name, doc.locate(path), path, last_line))
    return places


def _last_line(node: Node) -> int:
    """The last line of a value that is written in one piece."""
    return max([node.span.end_line, *map(_last_line, node.items)])


def configuration_of(doc: Document, reader: Reader) -> Document | None:
    """The configuration that a scenario runs, as far as it can be read; a configuration is its own."""
    if not is_scenario(doc):
        return doc if is_configuration(doc) else None
    name = (doc.data or {}).get(CONFIG_KEY)
    if not isinstance(name, str):
        return None
    path = reader.resolve(doc.file, name)
    try:
        data = read_named_file(reader, path, doc.limits.listing_bytes + 1)
    except (OSError, ValueError):
        return None
    config = read_document(data, path, doc.limits)
    return config if is_configuration(config) else None


def references(doc: Document, names: Collection[str]) -> list[Reference]:
    """Every place of a configuration or scenario that names one of these loops, in the order of the file."""
    if doc.data is None or not names:
        return []
    alternatives = "|".join(map(re.escape, sorted(names, key=len, reverse=True)))
    pattern = re.compile(rf"(?<![\w.\-/#])(?:{alternatives})(?![\w\-/#])")
    unique = {reference.span: reference for reference in _iter_references(doc, doc.data, doc.root, (), pattern)}
    return sorted(unique.values(), key=lambda reference: reference.span)


def _iter_references(
    doc: Document, data: object, node: Node, path: Path, pattern: re.Pattern[str]
) -> Iterator[Reference]:
    if isinstance(data, dict) and isinstance(node.children, dict):
        for key, value in data.items():
            event, child = node.children.get(key, (None, None))
            if event is not None:
                yield from _references_in_text(
                    doc, key, span_of(event), (*path, key), pattern, allow_bare=_path_keys(path) in LOOP_MAPPINGS
                )
            if child is not None and key not in OTHER_KEYS:
                yield from _iter_references(doc, value, child, (*path, key), pattern)
    elif isinstance(data, list) and isinstance(node.children, list):
        for i, (value, child) in enumerate(zip(data, node.children, strict=False)):
            yield from _iter_references(doc, value, child, (*path, i), pattern)
    elif isinstance(data, str) and path:
        names = _path_keys(path)
        whole = bool(names) and (names[-1] in LOOP_KEYS or names[0] == CONNECT_KEY or names in LOOP_LISTS)
        yield from _references_in_text(doc, data, node.span, path, pattern, allow_bare=whole and names != (NAME_KEY,))


def _path_keys(path: Path) -> tuple[str, ...]:
    """The keys of a path, without places in lists."""
    return tuple(step for step in path if isinstance(step, str))


def _references_in_text(
    doc: Document, text: str, span: Span, path: Path, pattern: re.Pattern[str], *, allow_bare: bool
) -> Iterator[Reference]:
    """The names in a key or a value, where it is written in one line as it reads.

    ``allow_bare``: a loop's name means the loop there; elsewhere only one of its parameters does, ``TIC_1.MV``.
    """
    if span.line != span.end_line:
        return
    line = doc.lines[span.line - 1]
    start = line.find(text, span.column - 1, span.end_column - 1)
    if start < 0:
        return
    defines = len(path) == 3 and path[0] == LOOPS_KEY and path[2] == NAME_KEY
    for match in pattern.finditer(text):
        of_parameter = text[match.end() : match.end() + 1] == "."
        if (allow_bare or of_parameter) and (not defines or match.group() == text):
            name_span = Span(span.line, start + match.start() + 1, span.line, start + match.end() + 1)
            yield Reference(match.group(), doc.file, name_span, path, defines)


# --- A loop under another name, in every file that names it: all of them or none --------------------------------------


class RenamingError(ValueError):
    """A loop that cannot be called so: why, and where."""


def rename_edits(docs: Sequence[Document], old: str, new: str, check: Check) -> dict[str, list[Edit]]:
    """The edits of each file in which a loop gets another name; ``check`` gives the findings of documents by name.

    Proven: each new text says what the old one said but for that name, and has no more errors. Raises `RenamingError`.
    """
    names = {place.name for doc in docs for place in loops_of(doc)}
    if new in names:
        raise RenamingError(f"there is a loop {new} already")
    edits = {doc.file: [Edit(one.span, new) for one in references(doc, {old})] for doc in docs}
    edits = {file: rows for file, rows in edits.items() if rows}
    before = {doc.file: doc for doc in docs}
    after = {
        file: read_document(apply_edits(doc.text, edits.get(file, ())).encode(), file, doc.limits)
        for file, doc in before.items()
    }
    for file, doc in after.items():
        if len(references(doc, {new})) != len(edits.get(file, ())):
            raise RenamingError(f"{new} would not be read as a name in {file}, or means something there already")
    known_errors = {(d.code, d.where) for d in check(before) if d.severity is Severity.ERROR}
    new_errors = [
        d
        for d in check(after)
        if d.severity is Severity.ERROR and (d.code, d.where.replace(new, old)) not in known_errors
    ]
    if new_errors:
        raise RenamingError(f"{new} cannot be its name: {new_errors[0].message}")
    return edits
