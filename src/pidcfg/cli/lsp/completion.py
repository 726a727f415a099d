"""Completion in half-typed text: where the cursor stands, by brackets and indentation, and what may stand there."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from pathlib import Path as Place
from typing import TYPE_CHECKING, Any

from lsprotocol import types

from pidcfg.output.json_schemas import SCENARIO, schema
from pidcfg.output.places import configuration_of, loops_of, wires_of
from pidcfg.text.paths import value_at
from pidcfg.text.writer import json_line
from pidcfg.validate.engine import is_scenario
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from pidcfg.cli.lsp.files import Buffer
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.text.reader import Reader

# --- Where the cursor stands: a text that is half written has no document, but it has brackets and indentation --------

ITEM = re.compile(r"-(?: +|$)")
KEY = re.compile(r"(?P<key>\"[^\"]*\"|'[^']*'|[^\s#\[\]{},:\"'](?:[^:#]|:(?! |$)|(?<! )#)*?) *:(?: +|$)")
COMMENT = re.compile(r"(?:^|\s)#")
ENDS = {"{": "}", "[": "]"}


@dataclass(slots=True)
class _Frame:
    """A mapping or a list that is open at the cursor: in a block its column, in brackets -1."""

    column: int
    items: bool
    step: str | int | None = None
    """The key, or the number of the item, that the text is at."""
    keys: list[str] = field(default_factory=list)

    @property
    def flows(self) -> bool:
        """Whether it is one of brackets."""
        return self.column < 0

    def take(self, key: str) -> None:
        """A key begins."""
        self.step = key
        self.keys.append(key)


@dataclass(frozen=True, slots=True)
class Cursor:
    """What is being written: a key of the mapping at ``path``, or the value that stands there."""

    path: Path
    key: bool
    typed: str
    """Of the word before the cursor."""
    keys: Sequence[str] = ()
    """Of the same mapping above it."""
    flows: bool = False
    """Whether it stands in brackets."""


def cursor_in(text: str) -> Cursor | None:
    """The cursor at the end of a text; None in a comment."""
    frames: list[_Frame] = []
    rows = text.split("\n")
    for row in rows[:-1]:
        _line(frames, row.rstrip("\r"))
    return _last(frames, rows[-1])


def _line(frames: list[_Frame], row: str) -> str:
    """Takes a line; what is left of it is a value that has begun."""
    rest, column = row.lstrip(" "), len(row) - len(row.lstrip(" "))
    if frames and frames[-1].flows:
        return _flow(frames, row)
    if not rest or rest.startswith("#"):
        return ""
    _close(frames, column, item=ITEM.match(rest) is not None)
    while match := ITEM.match(rest):
        _item(frames, column)
        rest, column = rest[match.end() :], column + match.end()
        _close(frames, column, item=ITEM.match(rest) is not None)
    if match := KEY.match(rest):
        _at(frames, column, items=False).take(match["key"].strip("'\""))
        rest = rest[match.end() :]
    return _flow(frames, rest) if rest[:1] in ENDS else rest


def _close(frames: list[_Frame], column: int, *, item: bool) -> None:
    """Closes what stands further in than a line that begins; a list may stand in the column of its key."""
    while frames and (frames[-1].column > column or (frames[-1].column == column and frames[-1].items and not item)):
        frames.pop()


def _item(frames: list[_Frame], column: int) -> None:
    """An item of a list begins."""
    frame = _at(frames, column, items=True)
    frame.step = frame.step + 1 if isinstance(frame.step, int) else 0


def _at(frames: list[_Frame], column: int, *, items: bool) -> _Frame:
    """The open mapping or list of a column, which begins here if there is none."""
    if not frames or frames[-1].column != column or frames[-1].items is not items:
        frames.append(_Frame(column, items))
    return frames[-1]


def _flow(frames: list[_Frame], row: str) -> str:
    """Takes text in brackets, up to its end; what is left is the word that has begun."""
    at, word = 0, ""
    while at < len(row):
        sign = row[at]
        if sign in "\"'" and not word.strip():
            end = row.find(sign, at + 1)
            at, word = (len(row), row[at:]) if end < 0 else (end + 1, row[at : end + 1])
            continue
        if sign == "#" and (not at or row[at - 1] == " "):
            return ""
        if sign in ENDS:
            frames.append(_Frame(-1, sign == "["))
            frames[-1].step = 0 if sign == "[" else None
            word = ""
        elif sign in "]}" and frames and frames[-1].flows:
            frames.pop()
            word = ""
            if not (frames and frames[-1].flows):
                return ""
        elif sign == ",":
            frame = frames[-1] if frames else _Frame(-1, items=False)
            frame.step = frame.step + 1 if isinstance(frame.step, int) else None
            word = ""
        elif sign == ":" and row[at + 1 : at + 2] in {"", " "} and frames and not frames[-1].items:
            frames[-1].take(word.strip().strip("'\""))
            word = ""
        else:
            word += sign
        at += 1
    return word.lstrip()


def _last(frames: list[_Frame], row: str) -> Cursor | None:
    """The line in which the cursor stands, up to it."""
    if COMMENT.search(_unquoted(row)):
        return None
    inside = bool(frames and frames[-1].flows)
    rest = row.lstrip(" ")
    if not inside and not rest:  # an empty line: the column says what it belongs to
        _close(frames, len(row), item=False)
        known = frames[-1] if frames and frames[-1].column == len(row) and not frames[-1].items else None
        above = frames[:-1] if known else frames
        return Cursor(_path(above), key=True, typed="", keys=tuple(known.keys) if known else ())
    typed = _line(frames, row)
    frame = frames[-1] if frames else None
    if frame is not None and frame.flows:
        is_key = not frame.items and frame.step is None
        return Cursor(_path(frames[:-1] if is_key else frames), is_key, typed, tuple(frame.keys), flows=True)
    begins = len(row) - len(typed)
    is_key = not KEY.match(re.sub(r"^(?:- +)+", "", rest)) and typed == re.sub(r"^(?:- +)*", "", rest)
    if not is_key:
        return Cursor(_path(frames), key=False, typed=typed)
    known = frame if frame is not None and frame.column == begins and not frame.items else None
    return Cursor(
        _path(frames[:-1] if known else frames), key=True, typed=typed, keys=tuple(known.keys) if known else ()
    )


def keys_behind(rest: str, cursor: Cursor, column: int) -> Iterator[str]:
    """The keys of the cursor's mapping behind it: up to the bracket, or in the lines of its column."""
    if cursor.flows:
        for match in re.finditer(r"[\w-]+(?= *:(?: |$))", re.split(r"[{}\[\]]", rest, maxsplit=1)[0], re.MULTILINE):
            yield match.group()
        return
    for row in rest.split("\n")[1:]:
        bare = row.lstrip(" ")
        indent = len(row) - len(bare)
        if bare and not bare.startswith("#"):
            if indent < column or (indent == column and bare.startswith("- ")):
                return
            key = KEY.match(bare) if indent == column else None
            yield from [key["key"].strip("'\"")] if key is not None else []


def _unquoted(row: str) -> str:
    """A line without what stands in quotes, in which a # begins nothing."""
    return re.sub(r"\"[^\"]*\"|'[^']*'", lambda found: "x" * len(found.group()), row)


def _path(frames: Iterable[_Frame]) -> Path:
    """The keys and numbers of open mappings and lists."""
    return tuple(frame.step for frame in frames if frame.step is not None)


# --- What the JSON Schema says of a path ------------------------------------------------------------------------------

Schema = dict[str, Any]
REFERENCE = "#/$defs/"


@cache
def _schema(name: str) -> Schema:
    return schema(name)


def schema_of(doc: Document | None) -> Schema:
    """The JSON Schema of a file, by what it says it is; empty where it does not say."""
    data = (doc.data if doc is not None else None) or {}
    if "vendor" not in data and "scenario" in data:
        return _schema(SCENARIO)
    vendor = data.get("vendor")
    return _schema(vendor) if vendor in VENDORS else {}


def _ways(root: Schema, one: Schema, data: Any) -> Iterator[Schema]:
    """The plain schemas that one stands for; of several kinds the one that the data choose, if they do."""
    if "$ref" in one:
        beside = {key: value for key, value in one.items() if key != "$ref"}
        target = root["$defs"][one["$ref"].removeprefix(REFERENCE)]
        yield from _ways(root, {**target, **beside}, data)
        return
    kinds = [*one.get("anyOf", ()), *one.get("oneOf", ()), *one.get("allOf", ())]
    kinds += [one[key] for key in ("else", "then") if key in one]
    chosen = (
        (one.get("discriminator") or {}).get("mapping", {}).get((data or {}).get("type")) if _is_map(data) else None
    )
    if chosen is not None:
        kinds = [{"$ref": chosen}]
    if not kinds or "properties" in one:
        yield one
    for kind in kinds:
        yield from _ways(root, kind, data)


def _is_map(data: object) -> bool:
    return isinstance(data, dict)


def schemas_at(root: Schema, path: Path, data: object) -> list[Schema]:
    """The plain schemas of what stands at a path; ``data``: the file, as far as it is known."""
    here: list[Schema] = [root] if root else []
    for n, step in enumerate(path):
        known = value_at(data, path[:n])
        below: list[Schema] = []
        for one in (way for part in here for way in _ways(root, part, known)):
            below += _below(one, step)
        here = below
    known = value_at(data, path)
    return [way for part in here for way in _ways(root, part, known)]


def _below(one: Schema, step: str | int) -> list[Schema]:
    """What a schema says of one of its keys, or of its items."""
    if isinstance(step, int):
        return [one["items"]] if isinstance(one.get("items"), dict) else []
    if step in one.get("properties", {}):
        return [one["properties"][step]]
    others = [one.get("additionalProperties"), *one.get("patternProperties", {}).values()]
    return [other for other in others if isinstance(other, dict)]


def described(root: Schema, path: Path, *, data: object) -> str:
    """What a key is, in Markdown: its meaning, unit, limits, choices and default; empty where nothing is known."""
    steps: list[Schema] = [root] if root else []
    for n, step in enumerate(path):
        known = value_at(data, path[:n])
        steps = [inner for part in steps for way in _ways(root, part, known) for inner in _below(way, step)]
    if not steps:
        return ""
    first = steps[0]
    ways = [way for part in steps for way in _ways(root, part, value_at(data, path))]
    text = first.get("description") or next((way["description"] for way in ways if way.get("description")), "")
    below = path[2:] if len(path) > 2 and isinstance(path[1], int) else path
    name = ".".join(str(step) for step in below if isinstance(step, str)) or str(path[0])
    return "\n\n".join(filter(None, [f"**{name}**", text, _allowed(first, ways)]))


def _allowed(first: Schema, ways: Sequence[Schema]) -> str:
    """The limits of a number, the words of a choice, and what holds without either."""
    limits = next(
        ((way.get("minimum"), way.get("maximum")) for way in ways if "minimum" in way or "maximum" in way), None
    )
    unit = f" {first['x-unit']}" if first.get("x-unit") else ""
    words = list(dict.fromkeys(str(word) for way in ways for word in way.get("enum", ())))
    rows = []
    if limits is not None:
        low, high = limits
        rows.append(
            f"{low} to {high}{unit}" if None not in limits else f"from {low}" if high is None else f"up to {high}"
        )
    if words:
        rows.append("one of " + ", ".join(f"`{word}`" for word in words))
    if "default" in first:
        rows.append(f"default `{_written(first['default'])}`")
    return "; ".join(rows)


# --- What may stand at the cursor -------------------------------------------------------------------------------------

HEADS = ("pidcfg", "vendor", SCENARIO)
"""Keys that begin a file; one that has begun with others is not for pidcfg."""
LOOP_KEYS = frozenset(("loop", "cascade_from", "source"))
BY_LOOP = frozenset((("plants",), ("initial",), ("tolerance",), ("vary", "loops"), ("vary", "plants"), ("loops",)))
"""Mappings and lists of a scenario whose keys, or items, are loops."""
SIGNAL_KEYS = frozenset(("signal", "input"))


def completions(
    buffer: Buffer, position: types.Position, good: Document | None, reader: Reader
) -> list[types.CompletionItem]:
    """What may stand at a position of a text; ``good``: the file as it was when it could be read last."""
    offset = buffer.offset(position)
    text = buffer.text[:offset]
    cursor = cursor_in(text)
    if cursor is None:
        return []
    place = types.Range(buffer.position(offset - len(cursor.typed)), position)
    there = {
        *cursor.keys,
        *keys_behind(buffer.text[offset:], cursor, offset - text.rfind("\n") - 1 - len(cursor.typed)),
    }
    offered = _offered(cursor, text, good, reader, there)
    items = [item for item in offered if not cursor.key or item.label not in there]
    for item in items:
        item.text_edit = types.TextEdit(place, item.insert_text or item.label)
        item.insert_text = None
    return items


def _offered(
    cursor: Cursor, text: str, good: Document | None, reader: Reader, there: set[str]
) -> list[types.CompletionItem]:
    data = good.data if good is not None else _head(text)
    root = schema_of(good) if good is not None and schema_of(good) else _schema_of_head(_head(text))
    names = [*_names(cursor, good, reader)]
    items = [*_keys(root, cursor, data)] if cursor.key else [*_values(root, cursor, data)]
    if not cursor.path and cursor.key and not root and there <= {*HEADS}:
        items = [_item_of(word, types.CompletionItemKind.Property, f"{word}: ") for word in HEADS]
    if cursor.path == ("config",) and not cursor.key and good is not None:
        items = [_item_of(name, types.CompletionItemKind.File, name) for name in _beside(good.file)]
    if cursor.path == ("vendor",) and not cursor.key:
        items = [
            _item_of(key, types.CompletionItemKind.EnumMember, key, vendor.title) for key, vendor in VENDORS.items()
        ]
    return [*names, *items]


MOST_FILES = 200


def _beside(file: str) -> list[str]:
    """The YAML files in the folder of a scenario, as far as one wants to look through; no scenario runs another."""
    found = Place(file).parent.glob("*.y*ml") if Place(file).is_absolute() else ()
    return sorted(path.name for path in islice(found, MOST_FILES) if ".scenario." not in path.name)


def _head(text: str) -> Mapping[str, object]:
    """The keys at the top of a text that say what it is."""
    return dict(re.findall(r"^(vendor|scenario) *: *(\S.*?) *$", text, re.MULTILINE))


def _schema_of_head(head: Mapping[str, object]) -> Schema:
    if head.get("vendor") in VENDORS:
        return _schema(head["vendor"])
    return _schema(SCENARIO) if SCENARIO in head and "vendor" not in head else {}


def _keys(root: Schema, cursor: Cursor, data: object) -> Iterator[types.CompletionItem]:
    """The keys that the mapping may have and has not."""
    offered: set[str] = set()
    for way in schemas_at(root, cursor.path, data):
        required = way.get("required", ())
        for key, one in way.get("properties", {}).items():
            if key in offered:
                continue
            offered.add(key)
            text = described(root, (*cursor.path, key), data=data)
            order = f"{'0' if key in required else '1'}{len(offered):03}"
            yield _item_of(key, types.CompletionItemKind.Property, f"{key}: ", one.get("x-unit", ""), text, order)


def _values(root: Schema, cursor: Cursor, data: object) -> Iterator[types.CompletionItem]:
    """The words, switches and examples with units that may be the value."""
    offered: set[str] = set()
    for way in schemas_at(root, cursor.path, data):
        words = [*way.get("enum", ()), *([way["const"]] if "const" in way else ())]
        words += [True, False] if way.get("type") == "boolean" else []
        words += [*way.get("examples", ()), *([way["default"]] if "default" in way else ())]
        for word in words:
            written = _written(word)
            if written not in offered:
                offered.add(written)
                kind = types.CompletionItemKind.EnumMember if "enum" in way else types.CompletionItemKind.Value
                yield _item_of(written, kind, written, order=f"1{len(offered):03}")


def _written(value: object) -> str:
    """A value as a file has it."""
    if isinstance(value, bool):
        return str(value).lower()
    text = str(value)
    return json_line(text) if text[:1] in {"%", "#", "&", "*", "@", "`", "!", "|", ">"} else text


def _names(cursor: Cursor, good: Document | None, reader: Reader) -> Iterator[types.CompletionItem]:
    """Loops and signals, where one is meant."""
    config = None if good is None else configuration_of(good, reader)
    if good is None or config is None:
        return
    last = next((step for step in reversed(cursor.path) if isinstance(step, str)), "")
    mapping = tuple(step for step in cursor.path if isinstance(step, str))
    loops = [place.name for place in loops_of(config)]
    kind = types.CompletionItemKind.Reference
    if is_scenario(good) and mapping in BY_LOOP and (cursor.key or mapping == ("loops",)):
        end = ": " if cursor.key and mapping != ("loops",) else ""
        yield from (_item_of(name, kind, f"{name}{end}", "loop", order="0") for name in loops)
    elif not cursor.key and last in LOOP_KEYS:
        yield from (_item_of(name, kind, name, "loop", order="0") for name in loops)
    elif not cursor.key and (last in SIGNAL_KEYS or mapping[:1] == ("connect",)) and is_scenario(good):
        yield from (_item_of(name, kind, name, "signal", order="0") for name in signals_of(good, reader))
    elif not cursor.key and not is_scenario(good) and _may_be_wired(good, cursor.path):
        yield from (_item_of(name, kind, name, "signal", order="2") for name in wires_of(good))


def _may_be_wired(config: Document, path: Path) -> bool:
    """Whether a text may stand where a number or a switch does."""
    kinds = {str(way.get("type")) for way in schemas_at(schema_of(config), path, config.data) if "pattern" not in way}
    return "string" in kinds and not kinds.isdisjoint({"number", "integer", "boolean"})


def signals_of(scenario: Document, reader: Reader) -> list[str]:
    """The signals that a scenario may name: those of its PLC, of its plants, and its own."""
    from pidcfg.study.scenario import load_scenario

    loaded = load_scenario(scenario, reader)
    found = [name for name in loaded.new_plc().signals if name] if loaded.image is not None else []
    if loaded.scenario is not None:
        found += [*loaded.scenario.signals, *(str(name) for name in loaded.scenario.plants)]
    return list(dict.fromkeys(found))


def _item_of(
    label: str, kind: types.CompletionItemKind, insert: str, detail: str = "", text: str = "", order: str = "1"
) -> types.CompletionItem:
    told = types.MarkupContent(types.MarkupKind.Markdown, text) if text else None
    return types.CompletionItem(
        label, kind=kind, insert_text=insert, detail=detail or None, documentation=told, sort_text=order
    )
