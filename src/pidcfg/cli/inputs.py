"""Paths from the command line to documents: files, folders, patterns and standard input."""

from __future__ import annotations

import glob
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pidcfg.cli.identity import remember
from pidcfg.cli.progress import held
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.source import Document, Node, read_document

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.limits import Limits

STDIN = "-"
SUFFIXES = {".yaml", ".yml"}
LIKE_OURS = (
    re.compile(rb"^(?:vendor|scenario)\s*:", re.MULTILINE),
    re.compile(rb"^(?:loops|config|plants|expect)\s*:", re.MULTILINE),
)
"""Keys at the top by which a file is ours although its ``pidcfg`` key is missing or misspelt."""
OURS = re.compile(rb"^(?:\xef\xbb\xbf|\xff\xfe|\xfe\xff)?\t*[\"']?pidcfg[\"']?\s*:", re.MULTILINE)
"""A ``pidcfg`` key at the top; also after a tab, or in UTF-16 without its zero bytes: ours to complain about."""


@dataclass(frozen=True, slots=True)
class Input:
    """A file's name as reports print it, and its bytes; or why there are none."""

    name: str
    data: bytes = b""
    problem: str | None = None
    foreign: bool = False
    """A YAML file that does not say it is ours, in a folder or where such files are to be left out."""


def read_inputs(paths: Sequence[str], limits: Limits) -> Iterator[Document]:
    """The documents that the paths of a command line stand for, each once."""
    return (document(entry, limits) for entry in gather(paths, limits) if not entry.foreign)


def document(entry: Input, limits: Limits) -> Document:
    """An input as a document; a file that could not be opened is one with that finding."""
    if entry.problem is None:
        return read_document(entry.data, entry.name, limits)
    found = Diagnostic("PID040", Severity.ERROR, entry.problem, entry.name, help="check the path")
    return Document(entry.name, "", None, Node(None), (found,))


def gather(paths: Sequence[str], limits: Limits, *, only_ours: bool = False) -> Iterator[Input]:
    """The inputs one by one; a folder stands for the files below it that carry a ``pidcfg`` key.

    ``only_ours``: a YAML file without one counts as foreign even when it is named.
    """
    seen: set[str] = set()
    for name in _expand(paths):
        if name in seen:
            continue
        seen.add(name)
        if len(seen) > limits.files:
            yield Input(name, problem=f"more than {limits.files} files; raise it with --limit files=N")
            return
        if name != STDIN and Path(name).is_dir():
            yield from _folder(name, seen, limits)
        else:
            entry = read_input(name, limits)
            foreign = only_ours and name != STDIN and not ours(entry)
            yield Input(name, foreign=True) if foreign else entry


def ours(entry: Input) -> bool:
    """Whether a file carries our key, or is ours to complain about since nobody can tell."""
    text = entry.data.replace(b"\0", b"")
    return entry.problem is not None or bool(OURS.search(text)) or all(key.search(text) for key in LIKE_OURS)


def _expand(paths: Sequence[str]) -> Iterator[str]:
    """Patterns that the shell has left alone."""
    for path in paths:
        if any(c in path for c in "*?[") and not Path(path).exists():
            matches = sorted(glob.glob(path, recursive=True))  # noqa: PTH207 - patterns may be absolute
            yield from (Path(m).as_posix() for m in matches) if matches else [path]
        else:
            yield path if path == STDIN else Path(path).as_posix()


def _folder(name: str, seen: set[str], limits: Limits) -> Iterator[Input]:
    """The regular files below a folder that carry our key; the other YAML files as foreign."""
    found = False
    for folder, folders, files in os.walk(name):
        folders[:] = sorted(f for f in folders if not f.startswith("."))
        for file in sorted(files):
            path = Path(folder, file).as_posix()
            if not path.lower().endswith(tuple(SUFFIXES)) or path in seen or not Path(path).is_file():
                continue
            entry = read_input(path, limits)
            if ours(entry):
                seen.add(path)
                found = True
                yield entry
            else:
                yield Input(path, foreign=True)
    if not found:
        yield Input(name, problem=f"{name} holds no .yaml or .yml file with a pidcfg key")


def read_input(name: str, limits: Limits) -> Input:
    """The bytes of one file, at most one more than the limit; no output of this run takes its place."""
    try:
        if name == STDIN:
            if sys.stdin is None:
                return Input("<stdin>", problem="cannot read standard input: it is closed")
            with held():
                remember(sys.stdin.buffer)
                return Input("<stdin>", sys.stdin.buffer.read(limits.file_bytes + 1))
        with Path(name).open("rb") as stream:
            remember(stream)
            return Input(name, stream.read(limits.file_bytes + 1))
    except OSError as error:
        return Input(name, problem=f"cannot read {name}: {error.strerror or error}")
    except ValueError as error:
        return Input(name, problem=f"cannot read {name!r}: {error}")
