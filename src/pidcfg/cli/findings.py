"""The findings of the inputs of a command, and those that are kept for files that have not changed."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, field, fields
from pathlib import Path
from typing import Any

import click

from pidcfg.cli.console import write_remark
from pidcfg.cli.inputs import RECORDED_DISK, Input, document_of_input, read_inputs
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import hold_line
from pidcfg.text.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.text.document import Document, Node
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import Limits, Reader
from pidcfg.text.store import Store, UnsafeFolderError, cache_folder

# --- What was read for an input, so that its findings can be kept for as long as all of that is the same --------------


@dataclass(slots=True)
class ReadRecorder:
    """What a check reads besides its input: by the name that the input calls a file, a hash of its bytes."""

    name: str
    """Of the input."""
    reader: Reader = RECORDED_DISK
    names_by_file: dict[str, str] = field(default_factory=dict)
    """What the input calls a file, by the name under which it was read."""
    hashes: dict[str, str] = field(default_factory=dict)
    is_cacheable: bool = True
    """Whether all that was read is known by what the input calls it, and could be read."""

    def resolve(self, name: str, other: str) -> str:
        """As the reader does it."""
        resolved = self.reader.resolve(name, other)
        if name == self.name:
            self.names_by_file[resolved] = other
        return resolved

    def read(self, name: str, max_bytes: int) -> bytes:
        """As the reader does it."""
        try:
            data = self.reader.read(name, max_bytes)
        except (OSError, ValueError):
            self.is_cacheable = False
            raise
        if name in self.names_by_file:
            self.hashes[self.names_by_file[name]] = hash_of(data)
        else:
            self.is_cacheable = False
        return data


def hash_of(data: bytes) -> str:
    """The SHA-256 of some bytes in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


# --- The findings of files that have not changed since they were last checked -----------------------------------------
#
# Kept are the findings as the rules give them, before comments, settings and baselines take any away, and without the
# names of files, which are put in where the entry is used. The key is a hash of everything that they follow from: the
# file's bytes, the limits, pidcfg's own sources, Python and the libraries that read and check. A scenario's entry
# also says which other files were read with it, and holds only as long as these are the same. Nothing is kept of a
# file that could not be read.

CACHE_FORMAT = 1
"""Of an entry; a new one makes all former entries misses."""
LIBRARIES = ("pydantic", "pydantic_core", "ruamel")
PACKAGE_FOLDER = Path(__file__).parents[2]


@frozen
class Cache:
    """Kept findings under given limits."""

    store: Store
    limits: Limits
    key_base: bytes
    """What all keys begin with."""

    @classmethod
    def open(cls, limits: Limits) -> Cache | None:
        """The user's cache; None where there is none."""
        try:
            return cls(Store(cache_folder("findings")), limits, _key_base(limits))
        except UnsafeFolderError as error:
            write_remark(f"note: findings are not kept: {error.strerror}")
        except OSError:
            pass
        return None

    def get(self, entry: Input) -> tuple[Document, list[Diagnostic]] | None:
        """An input's text and kept findings; None where it has to be checked."""
        if entry.problem is not None or len(entry.data) > self.limits.file_bytes:
            return None
        stored = self.store.get(self._key(entry))
        if stored is None:
            return None
        try:
            hashes, rows = stored
            files = [entry.name, *(RECORDED_DISK.resolve(entry.name, other) for other in hashes)]
            if not self._are_unchanged(files[1:], hashes.values()):
                return None
            findings = [_finding(row, files) for row in rows]
        except (OSError, ValueError, TypeError, AttributeError, IndexError):
            return None
        text = entry.data.decode("utf-8-sig", "replace")
        return Document(entry.name, text, None, Node(None)), findings

    def put(self, entry: Input, findings: Sequence[Diagnostic], recorder: ReadRecorder) -> None:
        """Keeps an input's findings, unless they say more than the key can know."""
        from pidcfg.validate.catalog import is_unusable

        if entry.problem is not None or not recorder.is_cacheable or any(map(is_unusable, findings)):
            return
        names_read = {other: name for name, other in recorder.names_by_file.items() if other in recorder.hashes}
        files = [entry.name, *(names_read[other] for other in recorder.hashes)]
        if any(d.file not in files for d in findings) or _mention_files(findings, files):
            return
        rows = [_finding_row(d, files.index(d.file)) for d in findings]
        self.store.put(self._key(entry), [recorder.hashes, rows])

    def _key(self, entry: Input) -> str:
        return hashlib.sha256(self.key_base + entry.data).hexdigest()

    def _are_unchanged(self, names: Iterable[str], hashes: Iterable[str]) -> bool:
        """Whether other files are what they were."""
        max_bytes = self.limits.listing_bytes + 1
        return all(
            hash_of(RECORDED_DISK.read(name, max_bytes)) == kept for name, kept in zip(names, hashes, strict=True)
        )


def _mention_files(findings: Iterable[Diagnostic], files: Iterable[str]) -> bool:
    """Whether findings say the name of a file in words."""
    return any(name in text for d in findings for text in _finding_texts(d) for name in files)


def _finding_texts(d: Diagnostic) -> Iterator[str]:
    """What a finding says in words."""
    yield from filter(None, (d.message, d.help, d.plc_effect, d.value, d.quotes))
    yield from (edit.text for edit in d.edits)


def _finding_row(d: Diagnostic, file_number: int) -> list[object]:
    """A finding as it is kept: its values in their order, the name of its file as its number among those read."""
    values = {f.name: getattr(d, f.name) for f in fields(d)}
    edits = [(_span_numbers(edit.span), edit.text) for edit in d.edits]
    return [file_number, *(values | {"file": "", "span": _span_numbers(d.span), "edits": edits}).values()]


def _span_numbers(span: Span) -> tuple[int, int, int, int]:
    """Where something is written, as four numbers."""
    return span.line, span.column, span.end_line, span.end_column


def _finding(row: list[Any], files: Sequence[str]) -> Diagnostic:
    """A kept finding with the name of its file."""
    file_number, code, severity, message, _, span, path, loop, others, effect, reference, cure, edits, *rest = row
    return Diagnostic(
        code,
        Severity(severity),
        message,
        files[file_number],
        Span(*span),
        tuple(path),
        loop,
        tuple(others),
        effect,
        reference,
        cure,
        tuple(Edit(Span(*place), text) for place, text in edits),
        *rest,
    )


def _key_base(limits: Limits) -> bytes:
    """A hash of what all findings follow from, whatever the file."""
    machine = os.uname().machine if hasattr(os, "uname") else os.environ.get("PROCESSOR_ARCHITECTURE", "")
    facts = (CACHE_FORMAT, sys.version, sys.platform, machine, astuple(limits), _library_versions(), _source_state())
    return hashlib.sha256(repr(facts).encode()).digest()


def _library_versions() -> list[str]:
    """The libraries that read and check, with their versions, as the folders of installed packages name them."""
    versions: list[str] = []
    for folder in dict.fromkeys(sys.path):
        try:
            names = os.listdir(folder or ".")  # noqa: PTH208 - names alone
        except OSError:
            continue
        versions += sorted(n for n in names if n.endswith(".dist-info") and n.lower().startswith(LIBRARIES))
    return versions


def _source_state() -> object:
    """Pidcfg itself: its record where it is installed, the size and time of each source in a working copy."""
    records = sorted(PACKAGE_FOLDER.parent.glob("pidcfg-*.dist-info/RECORD"))
    if records:
        return [hash_of(path.read_bytes()) for path in records]
    rows = []
    for folder, folders, names in os.walk(PACKAGE_FOLDER):
        folders.sort()
        for name in sorted(names):
            if not name.endswith(".pyc"):
                status = os.stat(os.path.join(folder, name))  # noqa: PTH116, PTH118 - a thousand of them
                rows.append((folder, name, status.st_size, status.st_mtime_ns))
    return rows


# --- The findings of the inputs of a command, and the one configuration that some commands work on --------------------

MIN_POOL_FILES, CHUNK_SIZE = 200, 25
"""From so many files on a process per processor pays for its start; files are handed out so many at a time."""


def check_all(
    inputs: Sequence[Input], limits: Limits, *, use_cache: bool = True
) -> Iterator[tuple[Document, list[Diagnostic]]]:
    """Each input's text and findings, in order; many files are shared out among the processors.

    ``use_cache``: findings of files that have not changed are taken from the user's cache (`pidcfg.cli.findings`).
    """
    cache = _open_cache(limits) if use_cache else None
    if cache is None:
        yield from ((document, findings) for document, findings, _ in _check_inputs(inputs))
        return
    cached_results = {i: result for i, entry in enumerate(inputs) if (result := cache.get(entry))}
    results = _check_inputs([entry for i, entry in enumerate(inputs) if i not in cached_results])
    for i, entry in enumerate(inputs):
        if i in cached_results:
            yield cached_results[i]
            continue
        document, findings, recorder = next(results)
        cache.put(entry, findings, recorder)
        yield document, findings


def _open_cache(limits: Limits) -> Cache | None:
    return Cache.open(limits)


def _check_inputs(inputs: Sequence[Input]) -> Iterator[tuple[Document, list[Diagnostic], ReadRecorder]]:
    """Inputs that have to be checked, each with what was read for it."""
    processors = os.cpu_count() or 1
    if len(inputs) < MIN_POOL_FILES or processors == 1:
        yield from map(check_input, inputs)
        return
    from concurrent.futures import ProcessPoolExecutor

    yield check_input(inputs[0])  # a process that is forked has what this one has loaded for it
    with ProcessPoolExecutor(processors) as pool:
        with hold_line():
            checked = pool.map(check_input, inputs[1:], chunksize=CHUNK_SIZE)
        yield from checked


def check_input(entry: Input) -> tuple[Document, list[Diagnostic], ReadRecorder]:
    """One input's text and findings; the data are let go, since a report needs the text only."""
    from pidcfg.api import check

    recorder = ReadRecorder(entry.name)
    result = check(document_of_input(entry), files=recorder, comments=False, limits=entry.limits)
    return result.document.without_data(), list(result.findings), recorder


def load_configuration(path: str, limits: Limits) -> Document:
    """The single configuration that a command works on; ends the command when the path names none or several."""
    from pidcfg.validate.engine import is_scenario

    documents = list(read_inputs((path,), limits))
    if len(documents) != 1:
        raise click.ClickException(f"{path} stands for {len(documents)} files; name one configuration")
    if is_scenario(documents[0]):
        raise click.ClickException(f"{path} is a scenario; name the configuration it runs")
    return documents[0]


def show_errors(findings: Sequence[Diagnostic], document: Document | None, fmt: str) -> None:
    """The errors of a configuration: in full on stderr, or as the result where JSON was asked for."""
    from pidcfg.cli.console import echo_json, write_note
    from pidcfg.cli.formats.findings import findings_text, json_v1
    from pidcfg.output.findings import errors_in

    documents = {} if document is None else {document.file: document}
    if fmt == "json":
        echo_json(json_v1(errors_in(findings), documents))
    else:
        write_note(findings_text(errors_in(findings), documents).rstrip())


def exit_code(findings: Sequence[Diagnostic], *, strict: bool = False) -> Exit:
    """Unusable input outweighs findings: CI must not mistake a file that was not read for one that was checked."""
    from pidcfg.validate.catalog import is_unusable

    if any(map(is_unusable, findings)):
        return Exit.UNUSABLE
    severity = max((d.severity for d in findings), default=Severity.INFO)
    return Exit.FINDINGS if severity is Severity.ERROR or (strict and severity is Severity.WARNING) else Exit.OK
