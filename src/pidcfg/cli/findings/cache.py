"""The findings of files that have not changed since they were last checked.

Kept are the findings as the rules give them, before comments, settings and baselines take any away, and without the
names of files, which are put in where the entry is used. The key is a hash of everything that they follow from: the
file's bytes, the limits, pidcfg's own sources, Python and the libraries that read and check. A scenario's entry also
says which other files were read with it, and holds only as long as these are the same. Nothing is kept of a file that
could not be read.
"""

from __future__ import annotations

import hashlib
import os
import sys
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pidcfg.cli.files.inputs import FILES
from pidcfg.cli.findings.reads import hash_of
from pidcfg.cli.terminal.console import remark
from pidcfg.diagnostics import Diagnostic, Edit, Severity, Span
from pidcfg.document import Document, Node
from pidcfg.store import Store, UnsafeFolderError, cache_folder

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.cli.files.inputs import Input
    from pidcfg.cli.findings.reads import Reads
    from pidcfg.limits import Limits

FORMAT = 1
"""Of an entry; a new one makes all former entries misses."""
LIBRARIES = ("pydantic", "pydantic_core", "ruamel")
PACKAGE = Path(__file__).parents[2]


@dataclass(frozen=True, slots=True)
class Cache:
    """Kept findings under given limits."""

    store: Store
    limits: Limits
    ground: bytes
    """What all keys begin with."""

    @classmethod
    def open(cls, limits: Limits) -> Cache | None:
        """The user's cache; None where there is none."""
        try:
            return cls(Store(cache_folder("findings")), limits, _ground(limits))
        except UnsafeFolderError as error:
            remark(f"note: findings are not kept: {error.strerror}")
        except OSError:
            pass
        return None

    def get(self, entry: Input) -> tuple[Document, list[Diagnostic]] | None:
        """An input's text and kept findings; None where it has to be checked."""
        if entry.problem is not None or len(entry.data) > self.limits.file_bytes:
            return None
        kept = self.store.get(self._key(entry))
        if kept is None:
            return None
        try:
            reads, rows = kept
            files = [entry.name, *(FILES.resolve(entry.name, other) for other in reads)]
            if not self._same(files[1:], reads.values()):
                return None
            findings = [_finding(row, files) for row in rows]
        except (OSError, ValueError, TypeError, AttributeError, IndexError):
            return None
        text = entry.data.decode("utf-8-sig", "replace")
        return Document(entry.name, text, None, Node(None)), findings

    def put(self, entry: Input, findings: Sequence[Diagnostic], reads: Reads) -> None:
        """Keeps an input's findings, unless they say more than the key can know."""
        from pidcfg.validate.catalog import unusable

        if entry.problem is not None or not reads.known or any(map(unusable, findings)):
            return
        others = {other: name for name, other in reads.called.items() if other in reads.hashes}
        files = [entry.name, *(others[other] for other in reads.hashes)]
        if any(d.file not in files for d in findings) or _names_one(findings, files):
            return
        rows = [_row(d, files.index(d.file)) for d in findings]
        self.store.put(self._key(entry), [reads.hashes, rows])

    def _key(self, entry: Input) -> str:
        return hashlib.sha256(self.ground + entry.data).hexdigest()

    def _same(self, names: Iterable[str], hashes: Iterable[str]) -> bool:
        """Whether other files are what they were."""
        most = self.limits.file_bytes + 1
        return all(hash_of(FILES.read(name, most)) == kept for name, kept in zip(names, hashes, strict=True))


def _names_one(findings: Iterable[Diagnostic], files: Iterable[str]) -> bool:
    """Whether findings say the name of a file in words."""
    return any(name in text for d in findings for text in _texts(d) for name in files)


def _texts(d: Diagnostic) -> Iterator[str]:
    """What a finding says in words."""
    yield from filter(None, (d.message, d.help, d.plc_effect, d.value, d.quotes))
    yield from (edit.text for edit in d.edits)


def _row(d: Diagnostic, at: int) -> list[Any]:
    """A finding as it is kept: its values in their order, the name of its file as its number among those read."""
    values = {f.name: getattr(d, f.name) for f in fields(d)}
    edits = [(_place(edit.span), edit.text) for edit in d.edits]
    return [at, *(values | {"file": "", "span": _place(d.span), "edits": edits}).values()]


def _place(span: Span) -> tuple[int, int, int, int]:
    """Where something is written, as four numbers."""
    return span.line, span.column, span.end_line, span.end_column


def _finding(row: list[Any], files: Sequence[str]) -> Diagnostic:
    """A kept finding with the name of its file."""
    at, code, severity, message, _, span, path, loop, others, effect, reference, cure, edits, *rest = row
    return Diagnostic(
        code,
        Severity(severity),
        message,
        files[at],
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


def _ground(limits: Limits) -> bytes:
    """A hash of what all findings follow from, whatever the file."""
    machine = os.uname().machine if hasattr(os, "uname") else os.environ.get("PROCESSOR_ARCHITECTURE", "")
    facts = (FORMAT, sys.version, sys.platform, machine, astuple(limits), _libraries(), _sources())
    return hashlib.sha256(repr(facts).encode()).digest()


def _libraries() -> list[str]:
    """The libraries that read and check, with their versions, as the folders of installed packages name them."""
    found: list[str] = []
    for folder in dict.fromkeys(sys.path):
        try:
            names = os.listdir(folder or ".")  # noqa: PTH208 - names alone
        except OSError:
            continue
        found += sorted(n for n in names if n.endswith(".dist-info") and n.lower().startswith(LIBRARIES))
    return found


def _sources() -> object:
    """Pidcfg itself: its record where it is installed, the size and time of each source in a working copy."""
    records = sorted(PACKAGE.parent.glob("pidcfg-*.dist-info/RECORD"))
    if records:
        return [hash_of(path.read_bytes()) for path in records]
    found = []
    for folder, folders, names in os.walk(PACKAGE):
        folders.sort()
        for name in sorted(names):
            if not name.endswith(".pyc"):
                facts = os.stat(os.path.join(folder, name))  # noqa: PTH116, PTH118 - a thousand of them
                found.append((folder, name, facts.st_size, facts.st_mtime_ns))
    return found
