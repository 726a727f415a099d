"""Completion in half-typed text: where the cursor stands, by brackets and indentation, and what may stand there."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cache
from itertools import islice
from pathlib import Path as FilePath
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

ITEM_PATTERN = re.compile(r"-(?: +|$)")
KEY_PATTERN = re.compile(r"(?P<key>\"[^\"]*\"|'[^']*'|[^\s#\[\]{},:\"'](?:[^:#]|:(?! |$)|(?<! )#)*?) *:(?: +|$)")
COMMENT_PATTERN = re.compile(r"(?:^|\s)#")
CLOSING_BRACKETS = {"{": "}", "[": "]"}


@dataclass(slots=True)
class _Frame:
    """A mapping or a list that is open at the cursor: in a block its column, in brackets -1."""

    column: int
    is_list: bool
    step: str | int | None = None
    """The key, or the number of the item, that the text is at."""
    keys: list[str] = field(default_factory=list)

    @property
    def is_flow(self) -> bool:
        """Whether it is one of brackets."""
        return self.column < 0

    def begin_key(self, key: str) -> None:
        """A key begins."""
        self.step = key
        self.keys.append(key)


@dataclass(frozen=True, slots=True)
class Cursor:
    """What is being written: a key of the mapping at ``path``, or the value that stands there."""

    path: Path
    is_key: bool
    prefix: str
    """Of the word before the cursor."""
    keys: Sequence[str] = ()
    """Of the same mapping above it."""
    is_flow: bool = False
    """Whether it stands in brackets."""


def cursor_in(text: str) -> Cursor | None:
    """The cursor at the end of a text; None in a comment."""
    frames: list[_Frame] = []
    rows = text.split("\n")
    for row in rows[:-1]:
        _take_line(frames, row.rstrip("\r"))
    return _cursor_of_line(frames, rows[-1])


def _take_line(frames: list[_Frame], row: str) -> str:
    """Takes a line; what is left of it is a value that has begun."""
    rest, column = row.lstrip(" "), len(row) - len(row.lstrip(" "))
    if frames and frames[-1].is_flow:
        return _take_flow(frames, row)
    if not rest or rest.startswith("#"):
        return ""
    _close_frames(frames, column, item=ITEM_PATTERN.match(rest) is not None)
    while match := ITEM_PATTERN.match(rest):
        _begin_item(frames, column)
        rest, column = rest[match.end() :], column + match.end()
        _close_frames(frames, column, item=ITEM_PATTERN.match(rest) is not None)
    if match := KEY_PATTERN.match(rest):
        _frame_at(frames, column, items=False).begin_key(match["key"].strip("'\""))
        rest = rest[match.end() :]
    return _take_flow(frames, rest) if rest[:1] in CLOSING_BRACKETS else rest


def _close_frames(frames: list[_Frame], column: int, *, item: bool) -> None:
    """Closes what stands further in than a line that begins; a list may stand in the column of its key."""
    while frames and (frames[-1].column > column or (frames[-1].column == column and frames[-1].is_list and not item)):
        frames.pop()


def _begin_item(frames: list[_Frame], column: int) -> None:
    """An item of a list begins."""
    frame = _frame_at(frames, column, items=True)
    frame.step = frame.step + 1 if isinstance(frame.step, int) else 0


def _frame_at(frames: list[_Frame], column: int, *, items: bool) -> _Frame:
    """The open mapping or list of a column, which begins here if there is none."""
    if not frames or frames[-1].column != column or frames[-1].is_list is not items:
        frames.append(_Frame(column, items))
    return frames[-1]


def _take_flow(frames: list[_Frame], row: str) -> str:
    """Takes text in brackets, up to its end; what is left is the word that has begun."""
    offset, word = 0, ""
    while offset < len(row):
        char = row[offset]
        if char in "\"'" and not word.strip():
            end = row.find(char, offset + 1)
            offset, word = (len(row), row[offset:]) if end < 0 else (end + 1, row[offset : end + 1])
            continue
        if char == "#" and (not offset or row[offset - 1] == " "):
            return ""
        if char in CLOSING_BRACKETS:
            frames.append(_Frame(-1, char == "["))
            frames[-1].step = 0 if char == "[" else None
            word = ""
        elif char in "]}" and frames and frames[-1].is_flow:
            frames.pop()
            word = ""
            if not (frames and frames[-1].is_flow):
                return ""
        elif char == ",":
            frame = frames[-1] if frames else _Frame(-1, is_list=False)
            frame.step = frame.step + 1 if isinstance(frame.step, int) else None
            word = ""
        elif char == ":" and row[offset + 1 : offset + 2] in {"", " "} and frames and not frames[-1].is_list:
            frames[-1].begin_key(word.strip().strip("'\""))
            word = ""
        else:
            word += char
        offset += 1
    return word.lstrip()


def _cursor_of_line(frames: list[_Frame], row: str) -> Cursor | None:
    """The line in which the cursor stands, up to it."""
    if COMMENT_PATTERN.search(_without_quotes(row)):
        return None
    in_brackets = bool(frames and frames[-1].is_flow)
    rest = row.lstrip(" ")
    if not in_brackets and not rest:  # an empty line: the column says what it belongs to
        _close_frames(frames, len(row), item=False)
        mapping = frames[-1] if frames and frames[-1].column == len(row) and not frames[-1].is_list else None
        outer_frames = frames[:-1] if mapping else frames
        return Cursor(_path_of(outer_frames), is_key=True, prefix="", keys=tuple(mapping.keys) if mapping else ())
    prefix = _take_line(frames, row)
    frame = frames[-1] if frames else None
    if frame is not None and frame.is_flow:
        is_key = not frame.is_list and frame.step is None
        return Cursor(_path_of(frames[:-1] if is_key else frames), is_key, prefix, tuple(frame.keys), is_flow=True)
    start = len(row) - len(prefix)
    is_key = not KEY_PATTERN.match(re.sub(r"^(?:- +)+", "", rest)) and prefix == re.sub(r"^(?:- +)*", "", rest)
    if not is_key:
        return Cursor(_path_of(frames), is_key=False, prefix=prefix)
    mapping = frame if frame is not None and frame.column == start and not frame.is_list else None
    return Cursor(
        _path_of(frames[:-1] if mapping else frames),
        is_key=True,
        prefix=prefix,
        keys=tuple(mapping.keys) if mapping else (),
    )


def following_keys(rest: str, cursor: Cursor, column: int) -> Iterator[str]:
    """The keys of the cursor's mapping behind it: up to the bracket, or in the lines of its column."""
    if cursor.is_flow:
        for match in re.finditer(r"[\w-]+(?= *:(?: |$))", re.split(r"[{}\[\]]", rest, maxsplit=1)[0], re.MULTILINE):
            yield match.group()
        return
    for row in rest.split("\n")[1:]:
        stripped = row.lstrip(" ")
        indent = len(row) - len(stripped)
        if stripped and not stripped.startswith("#"):
            if indent < column or (indent == column and stripped.startswith("- ")):
                return
            key = KEY_PATTERN.match(stripped) if indent == column else None
            yield from [key["key"].strip("'\"")] if key is not None else []


def _without_quotes(row: str) -> str:
    """A line without what stands in quotes, in which a # begins nothing."""
    return re.sub(r"\"[^\"]*\"|'[^']*'", lambda found: "x" * len(found.group()), row)


def _path_of(frames: Iterable[_Frame]) -> Path:
    """The keys and numbers of open mappings and lists."""
    return tuple(frame.step for frame in frames if frame.step is not None)


# --- What the JSON Schema says of a path ------------------------------------------------------------------------------

Schema = dict[str, Any]
REFERENCE_PREFIX = "#/$defs/"


@cache
def _schema_named(name: str) -> Schema:
    return schema(name)


def schema_of(doc: Document | None) -> Schema:
    """The JSON Schema of a file, by what it says it is; empty where it does not say."""
    data = (doc.data if doc is not None else None) or {}
    if "vendor" not in data and "scenario" in data:
        return _schema_named(SCENARIO)
    vendor = data.get("vendor")
    return _schema_named(vendor) if vendor in VENDORS else {}


def _plain_schemas(root: Schema, part: Schema, data: Any) -> Iterator[Schema]:
    """The plain schemas that one stands for; of several kinds the one that the data choose, if they do."""
    if "$ref" in part:
        other_keys = {key: value for key, value in part.items() if key != "$ref"}
        target = root["$defs"][part["$ref"].removeprefix(REFERENCE_PREFIX)]
        yield from _plain_schemas(root, {**target, **other_keys}, data)
        return
    kinds = [*part.get("anyOf", ()), *part.get("oneOf", ()), *part.get("allOf", ())]
    kinds += [part[key] for key in ("else", "then") if key in part]
    reference = (
        (part.get("discriminator") or {}).get("mapping", {}).get((data or {}).get("type")) if _is_map(data) else None
    )
    if reference is not None:
        kinds = [{"$ref": reference}]
    if not kinds or "properties" in part:
        yield part
    for kind in kinds:
        yield from _plain_schemas(root, kind, data)


def _is_map(data: object) -> bool:
    return isinstance(data, dict)


def schemas_at(root: Schema, path: Path, data: object) -> list[Schema]:
    """The plain schemas of what stands at a path; ``data``: the file, as far as it is known."""
    schemas: list[Schema] = [root] if root else []
    for n, step in enumerate(path):
        value = value_at(data, path[:n])
        children: list[Schema] = []
        for parent_schema in (case for part in schemas for case in _plain_schemas(root, part, value)):
            children += _schemas_below(parent_schema, step)
        schemas = children
    value = value_at(data, path)
    return [case for part in schemas for case in _plain_schemas(root, part, value)]


def _schemas_below(part: Schema, step: str | int) -> list[Schema]:
    """What a schema says of one of its keys, or of its items."""
    if isinstance(step, int):
        return [part["items"]] if isinstance(part.get("items"), dict) else []
    if step in part.get("properties", {}):
        return [part["properties"][step]]
    others = [part.get("additionalProperties"), *part.get("patternProperties", {}).values()]
    return [other for other in others if isinstance(other, dict)]


def describe_key(root: Schema, path: Path, *, data: object) -> str:
    """What a key is, in Markdown: its meaning, unit, limits, choices and default; empty where nothing is known."""
    steps: list[Schema] = [root] if root else []
    for n, step in enumerate(path):
        value = value_at(data, path[:n])
        steps = [
            inner
            for part in steps
            for case in _plain_schemas(root, part, value)
            for inner in _schemas_below(case, step)
        ]
    if not steps:
        return ""
    first = steps[0]
    cases = [case for part in steps for case in _plain_schemas(root, part, value_at(data, path))]
    text = first.get("description") or next((case["description"] for case in cases if case.get("description")), "")
    inner_path = path[2:] if len(path) > 2 and isinstance(path[1], int) else path
    name = ".".join(str(step) for step in inner_path if isinstance(step, str)) or str(path[0])
    return "\n\n".join(filter(None, [f"**{name}**", text, _limits_text(first, cases)]))


def _limits_text(first: Schema, cases: Sequence[Schema]) -> str:
    """The limits of a number, the words of a choice, and what holds without either."""
    limits = next(
        ((case.get("minimum"), case.get("maximum")) for case in cases if "minimum" in case or "maximum" in case), None
    )
    unit = f" {first['x-unit']}" if first.get("x-unit") else ""
    words = list(dict.fromkeys(str(word) for case in cases for word in case.get("enum", ())))
    rows = []
    if limits is not None:
        low, high = limits
        rows.append(
            f"{low} to {high}{unit}" if None not in limits else f"from {low}" if high is None else f"up to {high}"
        )
    if words:
        rows.append("one of " + ", ".join(f"`{word}`" for word in words))
    if "default" in first:
        rows.append(f"default `{_yaml_text(first['default'])}`")
    return "; ".join(rows)


# --- What may stand at the cursor -------------------------------------------------------------------------------------

HEAD_KEYS = ("pidcfg", "vendor", SCENARIO)
"""Keys that begin a file; one that has begun with others is not for pidcfg."""
LOOP_KEYS = frozenset(("loop", "cascade_from", "source"))
LOOP_MAPPINGS = frozenset(
    (("plants",), ("initial",), ("tolerance",), ("vary", "loops"), ("vary", "plants"), ("loops",))
)
"""Mappings and lists of a scenario whose keys, or items, are loops."""
SIGNAL_KEYS = frozenset(("signal", "input"))


def completions(
    buffer: Buffer, position: types.Position, last_doc: Document | None, reader: Reader
) -> list[types.CompletionItem]:
    """What may stand at a position of a text; ``last_doc``: the file as it was when it could be read last."""
    offset = buffer.offset(position)
    text = buffer.text[:offset]
    cursor = cursor_in(text)
    if cursor is None:
        return []
    edit_range = types.Range(buffer.position(offset - len(cursor.prefix)), position)
    keys_present = {
        *cursor.keys,
        *following_keys(buffer.text[offset:], cursor, offset - text.rfind("\n") - 1 - len(cursor.prefix)),
    }
    offered_items = _offered_items(cursor, text, last_doc, reader, keys_present)
    items = [item for item in offered_items if not cursor.is_key or item.label not in keys_present]
    for item in items:
        item.text_edit = types.TextEdit(edit_range, item.insert_text or item.label)
        item.insert_text = None
    return items


def _offered_items(
    cursor: Cursor, text: str, last_doc: Document | None, reader: Reader, keys_present: set[str]
) -> list[types.CompletionItem]:
    data = last_doc.data if last_doc is not None else _head_keys(text)
    root = schema_of(last_doc) if last_doc is not None and schema_of(last_doc) else _schema_of_head(_head_keys(text))
    names = [*_name_items(cursor, last_doc, reader)]
    items = [*_key_items(root, cursor, data)] if cursor.is_key else [*_value_items(root, cursor, data)]
    if not cursor.path and cursor.is_key and not root and keys_present <= {*HEAD_KEYS}:
        items = [_item_of(word, types.CompletionItemKind.Property, f"{word}: ") for word in HEAD_KEYS]
    if cursor.path == ("config",) and not cursor.is_key and last_doc is not None:
        items = [_item_of(name, types.CompletionItemKind.File, name) for name in _sibling_files(last_doc.file)]
    if cursor.path == ("vendor",) and not cursor.is_key:
        items = [
            _item_of(key, types.CompletionItemKind.EnumMember, key, vendor.title) for key, vendor in VENDORS.items()
        ]
    return [*names, *items]


MAX_FILES = 200


def _sibling_files(file: str) -> list[str]:
    """The YAML files in the folder of a scenario, as far as one wants to look through; no scenario runs another."""
    paths = FilePath(file).parent.glob("*.y*ml") if FilePath(file).is_absolute() else ()
    return sorted(path.name for path in islice(paths, MAX_FILES) if ".scenario." not in path.name)


def _head_keys(text: str) -> Mapping[str, object]:
    """The keys at the top of a text that say what it is."""
    return dict(re.findall(r"^(vendor|scenario) *: *(\S.*?) *$", text, re.MULTILINE))


def _schema_of_head(head: Mapping[str, object]) -> Schema:
    if head.get("vendor") in VENDORS:
        return _schema_named(head["vendor"])
    return _schema_named(SCENARIO) if SCENARIO in head and "vendor" not in head else {}


def _key_items(root: Schema, cursor: Cursor, data: object) -> Iterator[types.CompletionItem]:
    """The keys that the mapping may have and has not."""
    labels: set[str] = set()
    for case in schemas_at(root, cursor.path, data):
        required = case.get("required", ())
        for key, key_schema in case.get("properties", {}).items():
            if key in labels:
                continue
            labels.add(key)
            text = describe_key(root, (*cursor.path, key), data=data)
            order = f"{'0' if key in required else '1'}{len(labels):03}"
            yield _item_of(
                key, types.CompletionItemKind.Property, f"{key}: ", key_schema.get("x-unit", ""), text, order
            )


def _value_items(root: Schema, cursor: Cursor, data: object) -> Iterator[types.CompletionItem]:
    """The words, switches and examples with units that may be the value."""
    labels: set[str] = set()
    for case in schemas_at(root, cursor.path, data):
        words = [*case.get("enum", ()), *([case["const"]] if "const" in case else ())]
        words += [True, False] if case.get("type") == "boolean" else []
        words += [*case.get("examples", ()), *([case["default"]] if "default" in case else ())]
        for word in words:
            text = _yaml_text(word)
            if text not in labels:
                labels.add(text)
                kind = types.CompletionItemKind.EnumMember if "enum" in case else types.CompletionItemKind.Value
                yield _item_of(text, kind, text, order=f"1{len(labels):03}")


def _yaml_text(value: object) -> str:
    """A value as a file has it."""
    if isinstance(value, bool):
        return str(value).lower()
    text = str(value)
    return json_line(text) if text[:1] in {"%", "#", "&", "*", "@", "`", "!", "|", ">"} else text


def _name_items(cursor: Cursor, last_doc: Document | None, reader: Reader) -> Iterator[types.CompletionItem]:
    """Loops and signals, where one is meant."""
    config = None if last_doc is None else configuration_of(last_doc, reader)
    if last_doc is None or config is None:
        return
    last_key = next((step for step in reversed(cursor.path) if isinstance(step, str)), "")
    mapping = tuple(step for step in cursor.path if isinstance(step, str))
    loops = [place.name for place in loops_of(config)]
    kind = types.CompletionItemKind.Reference
    if is_scenario(last_doc) and mapping in LOOP_MAPPINGS and (cursor.is_key or mapping == ("loops",)):
        end = ": " if cursor.is_key and mapping != ("loops",) else ""
        yield from (_item_of(name, kind, f"{name}{end}", "loop", order="0") for name in loops)
    elif not cursor.is_key and last_key in LOOP_KEYS:
        yield from (_item_of(name, kind, name, "loop", order="0") for name in loops)
    elif not cursor.is_key and (last_key in SIGNAL_KEYS or mapping[:1] == ("connect",)) and is_scenario(last_doc):
        yield from (_item_of(name, kind, name, "signal", order="0") for name in signals_of(last_doc, reader))
    elif not cursor.is_key and not is_scenario(last_doc) and _may_be_wired(last_doc, cursor.path):
        yield from (_item_of(name, kind, name, "signal", order="2") for name in wires_of(last_doc))


def _may_be_wired(config: Document, path: Path) -> bool:
    """Whether a text may stand where a number or a switch does."""
    kinds = {
        str(case.get("type")) for case in schemas_at(schema_of(config), path, config.data) if "pattern" not in case
    }
    return "string" in kinds and not kinds.isdisjoint({"number", "integer", "boolean"})


def signals_of(scenario: Document, reader: Reader) -> list[str]:
    """The signals that a scenario may name: those of its PLC, of its plants, and its own."""
    from pidcfg.study.scenario import load_scenario

    loaded = load_scenario(scenario, reader)
    names = [name for name in loaded.new_plc().signals if name] if loaded.image is not None else []
    if loaded.scenario is not None:
        names += [*loaded.scenario.signals, *(str(name) for name in loaded.scenario.plants)]
    return list(dict.fromkeys(names))


def _item_of(
    label: str, kind: types.CompletionItemKind, insert: str, detail: str = "", text: str = "", order: str = "1"
) -> types.CompletionItem:
    documentation = types.MarkupContent(types.MarkupKind.Markdown, text) if text else None
    return types.CompletionItem(
        label, kind=kind, insert_text=insert, detail=detail or None, documentation=documentation, sort_text=order
    )
