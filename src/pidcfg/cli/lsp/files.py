"""The files that an editor has open: their texts and places, and what is found in them, as ``validate`` finds it."""

from __future__ import annotations

import re
from bisect import bisect_right
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import unquote, urlsplit
from urllib.request import url2pathname

from lsprotocol import types

from pidcfg.text.document import LINE_BREAK
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT, Overlay, data_of
from pidcfg.text.source import read_document

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.output.places import Holder
    from pidcfg.text.diagnostics import Diagnostic, Span
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path as KeyPath
    from pidcfg.text.reader import Reader
    from pidcfg.validate.engine import Checked

# --- Texts and places: the editor counts lines and characters in its own way, from 0 ----------------------------------

EDITOR_BREAK = re.compile(r"\r\n|\n|\r")
"""What ends a line to an editor; to YAML some more signs do."""
BYTE_ORDER_MARK = "\ufeff"
UNIT_BYTES = {"utf-8": 1, "utf-16": 2, "utf-32": 4}
"""Bytes of a unit in which the editor counts characters."""


@frozen
class Buffer:
    """A text of the editor, whose columns are counted in ``encoding``."""

    text: str
    encoding: str = "utf-16"

    @cached_property
    def _line_starts(self) -> list[int]:
        return [0, *(match.end() for match in EDITOR_BREAK.finditer(self.text))]

    @cached_property
    def _finding_starts(self) -> list[int]:
        """Where the lines begin that findings count; a byte order mark is no part of the first one."""
        first = len(BYTE_ORDER_MARK) if self.text.startswith(BYTE_ORDER_MARK) else 0
        return [first, *(match.end() for match in LINE_BREAK.finditer(self.text))]

    def offset(self, position: types.Position) -> int:
        """The character that a position stands before; the end of the line, or of the text, where there is none."""
        if position.line >= len(self._line_starts):
            return len(self.text)
        start = self._line_starts[position.line]
        row = EDITOR_BREAK.split(self.text[start : self._end_of_line(position.line)], maxsplit=1)[0]
        if row.isascii():
            return start + min(position.character, len(row))
        remaining = position.character
        for index, sign in enumerate(row):
            if remaining <= 0:
                return start + index
            remaining -= self._size(sign)
        return start + len(row)

    def position(self, offset: int) -> types.Position:
        """A character as the editor counts it."""
        line = bisect_right(self._line_starts, offset) - 1
        return types.Position(line, self._size(self.text[self._line_starts[line] : offset]))

    def line_and_column(self, position: types.Position) -> tuple[int, int]:
        """Line and column of a position as findings count them, from 1."""
        offset = self.offset(position)
        line = max(bisect_right(self._finding_starts, offset) - 1, 0)
        return line + 1, offset - self._finding_starts[line] + 1

    def offset_of(self, line: int, column: int) -> int:
        """The character at a place that findings count."""
        if line > len(self._finding_starts):
            return len(self.text)
        return min(self._finding_starts[line - 1] + column - 1, len(self.text))

    def range(self, span: Span) -> types.Range:
        """A place as the editor has it."""
        first, last = self.offset_of(span.line, span.column), self.offset_of(span.end_line, span.end_column)
        return types.Range(self.position(first), self.position(max(first, last)))

    def _end_of_line(self, line: int) -> int:
        return self._line_starts[line + 1] if line + 1 < len(self._line_starts) else len(self.text)

    def _size(self, text: str) -> int:
        if text.isascii():
            return len(text)
        width = UNIT_BYTES[self.encoding]
        return len(text.encode(f"{self.encoding}-le" if width > 1 else self.encoding, "surrogatepass")) // width


def difference_range(before: str, after: str) -> tuple[int, int, str]:
    """The one stretch in which two texts differ: its begin and end in the first, and the text in its place."""
    begin, max_length = 0, min(len(before), len(after))
    while begin < max_length and before[begin] == after[begin]:
        begin += 1
    end = 0
    while end < max_length - begin and before[-1 - end] == after[-1 - end]:
        end += 1
    return begin, len(before) - end, after[begin : len(after) - end]


# --- Files by their URIs ----------------------------------------------------------------------------------------------


def path_of(uri: str) -> str:
    """The file of a URI; what has no file goes by its URI."""
    parts = urlsplit(uri)
    if parts.scheme != "file":
        return uri
    host = f"//{parts.netloc}" if parts.netloc else ""
    return Path(url2pathname(unquote(host + parts.path) if host else parts.path)).as_posix()


def uri_of(path: str) -> str:
    """The URI of a file; of what is none, itself."""
    return Path(path).as_uri() if Path(path).is_absolute() else path


# --- What is found in a file ------------------------------------------------------------------------------------------


@frozen
class Analysis:
    """A file in one of its versions: its text, data and findings, and the words that it becomes."""

    uri: str
    version: int
    buffer: Buffer
    document: Document
    findings: Sequence[Diagnostic] = ()
    """Of this file, without what comments, settings and a baseline leave out."""
    checked: Checked | None = None
    last_doc: Document | None = None
    """The file as it was when its text could be read last; itself, mostly."""
    remark: str = ""
    """Why settings or a baseline do not count."""

    @cached_property
    def words(self) -> dict[KeyPath, Holder]:
        """What holds the value of each key."""
        from pidcfg.output.places import held_words

        return {} if self.checked is None else {held.path: held for held in held_words(self.checked)}

    @property
    def file(self) -> str:
        """The file's name."""
        return self.document.file


@dataclass(slots=True)
class _OpenBuffer:
    """A buffer of the editor."""

    version: int
    buffer: Buffer
    last_doc: Document | None = None


@dataclass
class Files:
    """The buffers of an editor, before those of the disk, and what is known of them."""

    encoding: str = "utf-16"
    folders: list[str] = field(default_factory=list)
    """Of the workspace."""
    buffers: dict[str, _OpenBuffer] = field(default_factory=dict)
    """By URI."""

    def put_buffer(self, uri: str, version: int, text: str) -> None:
        """A buffer as it is now."""
        last_doc = self.buffers[uri].last_doc if uri in self.buffers else None
        self.buffers[uri] = _OpenBuffer(version, Buffer(text, self.encoding), last_doc)

    def drop_buffer(self, uri: str) -> None:
        """A buffer that the editor has closed: the disk's file counts again."""
        self.buffers.pop(uri, None)

    @property
    def reader(self) -> Overlay:
        """What reads files: buffers first."""
        return Overlay({path_of(uri): one.buffer.text for uri, one in list(self.buffers.items())})

    def read_document(self, path: str) -> Document | None:
        """A file as a document, a buffer or the disk's; None where it cannot be read."""
        try:
            data = self.reader.read(path, DEFAULT.listing_bytes + 1)
        except (OSError, ValueError):
            return None
        return read_document(data, path)

    def buffer_of(self, path: str, text: str) -> Buffer:
        """The buffer of a file, else its text from the disk."""
        entry = self.buffers.get(uri_of(path))
        return Buffer(text, self.encoding) if entry is None else entry.buffer

    def analyse(self, uri: str) -> Analysis:
        """Everything that is found in a buffer as it is now."""
        from pidcfg.cli.inputs import is_for_pidcfg
        from pidcfg.cli.policy import validated_findings
        from pidcfg.output.findings import check_with_words

        entry = self.buffers.get(uri) or _OpenBuffer(0, Buffer(""))  # closed meanwhile
        path, data = path_of(uri), data_of(entry.buffer.text)
        doc = read_document(data, path)
        base = Analysis(uri, entry.version, entry.buffer, doc)
        if not is_for_pidcfg(path, data, DEFAULT.listing_bytes):
            return replace(base, document=doc.without_data())
        entry.last_doc = entry.last_doc if doc.data is None else doc
        all_findings, checked = check_with_words(doc, self.reader)
        findings, remark = validated_findings(all_findings, doc)
        return replace(base, findings=findings, checked=checked, last_doc=entry.last_doc, remark=remark)

    def scenarios(self, config: str) -> Iterator[Document]:
        """The scenarios of the workspace that run a configuration, buffers among them."""
        from pidcfg.cli.inputs import document_of_input, gather_inputs

        roots = self.folders or [str(Path(config).parent)]
        reader = self.reader
        names = {entry.name: entry for root in roots if Path(root).is_dir() for entry in gather_inputs([root], DEFAULT)}
        paths = [path_of(uri) for uri in self.buffers]
        for name in dict.fromkeys([*paths, *(name for name, entry in names.items() if not entry.is_foreign)]):
            doc = self.read_document(name) if name in paths or name not in names else document_of_input(names[name])
            if doc is not None and runs_configuration(doc, config, reader):
                yield doc


def runs_configuration(doc: Document, config: str, reader: Reader) -> bool:
    """Whether a file is a scenario that runs a configuration."""
    name = (doc.data or {}).get("config")
    return isinstance(name, str) and Path(reader.resolve(doc.file, name)).resolve() == Path(config).resolve()
