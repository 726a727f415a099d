"""Paths from the command line to documents: files, folders, patterns and standard input."""

from __future__ import annotations

import glob
import os
import sys
from dataclasses import dataclass, field
from difflib import get_close_matches
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli.files.folders import is_for_pidcfg
from pidcfg.cli.files.identity import mention, remember
from pidcfg.cli.terminal.console import remark
from pidcfg.cli.terminal.progress import held
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.frozen import frozen
from pidcfg.reader import SUFFIXES, Disk, refusal
from pidcfg.source import Document, Node, read_document

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from typing import IO

    from pidcfg.limits import Limits
    from pidcfg.vendors import Vendor

STDIN = "-"
UNNAMED = "<stdin>"
"""Standard input in findings, unless ``--stdin-filename`` names it."""
NAME_OF_STDIN = "pidcfg.stdin"
"""Where a command keeps that name."""
MOST_NAMES = 3
"""Names of what was left out."""
MOST_BESIDE = 1000
"""Names of a folder that are compared with one that is not there."""


@frozen
class Input:
    """A file's name as reports print it, and its bytes; or why there are none."""

    name: str
    data: bytes = b""
    problem: str | None = None
    piped: bool = False
    """Whether it is standard input, by whatever name."""
    foreign: bool = False
    """A YAML file without the ``pidcfg`` key, in a folder or where such files are to be skipped."""
    remark: str | None = None
    """Why a foreign entry of a folder was not even looked at."""
    left_out: str | None = None
    """Why a foreign entry of a folder was to be left out; the name of a folder ends with a slash."""


def read_inputs(paths: Sequence[str], limits: Limits) -> Iterator[Document]:
    """The documents that the paths of a command line stand for, each once."""
    return (document(entry, limits) for entry in read_entries(paths, limits))


def read_entries(paths: Sequence[str], limits: Limits) -> Iterator[Input]:
    """The inputs that are for pidcfg; behind them a remark says what was left out."""
    others = []
    for entry in gather(paths, limits):
        if entry.foreign:
            others.append(entry)
        else:
            yield entry
    ctx = click.get_current_context(silent=True)
    params = {} if ctx is None else ctx.params
    if (text := left_out(others)) and not params.get("quiet"):
        remark(text)
    for reason in reasons(others) if params.get("verbose") else ():
        remark(reason)


def left_out(entries: Iterable[Input]) -> str:
    """How many folders and files were left out, and the names of some; nothing where none was."""
    names = [entry.name for entry in entries if entry.left_out is not None]
    folders = sum(name.endswith("/") for name in names)
    counts = ((folders, "folder"), (len(names) - folders, "file"))
    number = " and ".join(f"{n} {what}{'s' if n != 1 else ''}" for n, what in counts if n)
    kinds = list(dict.fromkeys(Path(name).name for name in names))
    kinds[MOST_NAMES:] = ["…"] * (len(kinds) > MOST_NAMES)
    return f"{number} left out ({', '.join(kinds)})" if names else ""


def reasons(entries: Iterable[Input]) -> Iterator[str]:
    """Each entry that was left out, and why."""
    return (f"left out: {entry.name} ({entry.left_out})" for entry in entries if entry.left_out is not None)


def document(entry: Input, limits: Limits) -> Document:
    """An input as a document; a file that could not be opened is one with that finding."""
    if entry.problem is None:
        return read_document(entry.data, entry.name, limits)
    cure = _beside(entry.name) or "check the path"
    finding = Diagnostic("PID040", Severity.ERROR, entry.problem, entry.name, help=cure)
    return Document(entry.name, "", None, Node(None), (finding,))


def _beside(name: str) -> str | None:
    """The cure that names a file of the same folder whose name is like that of one that is not there."""
    path = Path(name)
    if path.exists() or not path.parent.is_dir():
        return None
    names = (entry.name for entry in islice(path.parent.iterdir(), MOST_BESIDE) if entry.suffix.lower() in SUFFIXES)
    near = get_close_matches(path.name, names, 1, 0.7)
    return f"did you mean {(path.parent / near[0]).as_posix()}?" if near else None


def gather(paths: Sequence[str], limits: Limits, *, skip_foreign: bool = False) -> Iterator[Input]:
    """The inputs one by one; a folder stands for the files below it that carry a ``pidcfg`` key.

    ``skip_foreign``: a YAML file without one counts as foreign even when it is named. Standard input comes first: it
    stands for the file that ``--stdin-filename`` names, also in a folder.
    """
    taken = _Taken(limits)
    for name in sorted(expand(paths), key=lambda name: name != STDIN):
        folder = name != STDIN and Path(name).is_dir()
        if not taken.adds(name_of(name), folder=folder):
            continue
        if _is_pattern(name):
            yield Input(name, problem=f"no file matches {name}")
            continue
        if taken.full:
            yield taken.refusal(name)
            return
        if folder:
            yield from _folder(name, taken)
        else:
            entry = read_input(name, limits)
            foreign = skip_foreign and name != STDIN and not concerns_pidcfg(entry, limits)
            yield Input(name, foreign=True) if foreign else entry


@dataclass(slots=True)
class _Taken:
    """What has been taken: each file once, by whatever way its folder is reached, and no more than the limit."""

    limits: Limits
    places: set[tuple[str, str]] = field(default_factory=set)
    files: int = 0

    def adds(self, name: str, *, folder: bool = False) -> bool:
        """Takes a file or a folder, unless it has been."""
        above, file = os.path.split(name)
        key = (os.path.realpath(name), "") if folder else (os.path.realpath(above), file)
        new = key not in self.places
        self.places.add(key)
        self.files += new and not folder
        return new

    @property
    def full(self) -> bool:
        """Whether there are more than the limit allows."""
        return self.files > self.limits.files

    def refusal(self, name: str) -> Input:
        """The input that reports the limit."""
        return Input(name, problem=f"more than {self.limits.files} files; raise it with --limit files=N")


def concerns_pidcfg(entry: Input, limits: Limits) -> bool:
    """Whether a file has the ``pidcfg`` key, or is to be reported because it cannot be read."""
    return entry.problem is not None or is_for_pidcfg(entry.name, entry.data, limits.file_bytes)


def expand(paths: Sequence[str]) -> Iterator[str]:
    """Patterns that the shell has left alone."""
    for path in paths:
        if _is_pattern(path):
            matches = sorted(glob.glob(path, recursive=True))  # noqa: PTH207 - patterns may be absolute
            yield from (Path(m).as_posix() for m in matches) if matches else [path]
        else:
            yield path if path == STDIN else Path(path).as_posix()


def _is_pattern(path: str) -> bool:
    """Whether a path is a pattern and no file."""
    return any(c in path for c in "*?[") and not Path(path).exists()


def _folder(name: str, taken: _Taken) -> Iterator[Input]:
    """The files below a folder that have the ``pidcfg`` key or cannot be read; other YAML files as foreign."""
    has_files, others = False, []
    for entry in _walked(name, taken.limits):
        if entry.foreign:
            others.append(entry)
            yield entry
        elif taken.adds(entry.name):
            has_files = True
            yield taken.refusal(entry.name) if taken.full else entry
            if taken.full:
                return
        else:
            has_files = True
    if not has_files:
        without = f"; {text}" if (text := left_out(others)) else ""
        yield Input(name, problem=f"{name} holds no .yaml or .yml file with a pidcfg key{without}")


def _walked(name: str, limits: Limits) -> Iterator[Input]:
    """Every YAML file below a folder, and whatever may hide some."""
    from pidcfg.cli.files.walk import walk

    closed: list[OSError] = []
    root = Path(name).resolve()
    for folder in walk(name, closed.append):
        yield from (Input(path, foreign=True, remark=reason) for path, reason in folder.unused)
        for entry, reason in folder.left_out:
            yield Input(Path(folder.path, entry).as_posix() + "/" * entry.endswith("/"), foreign=True, left_out=reason)
        for path in (Path(folder.path, f) for f in folder.folders):
            if path.is_symlink() and not path.resolve().is_relative_to(root):
                yield Input(path.as_posix(), foreign=True, remark="a link out of the folder is not followed; name it")
        for path in (Path(folder.path, f) for f in folder.files):
            if path.is_file() or not path.exists():
                yield _in_folder(path, limits)
    for error in closed:
        yield Input(Path(error.filename).as_posix(), problem=f"cannot read {error.filename}: {error.strerror}")


def _in_folder(path: Path, limits: Limits) -> Input:
    """One YAML file in a folder; foreign where it has no ``pidcfg`` key."""
    name = path.as_posix()
    entry = read_input(name, limits)
    return entry if concerns_pidcfg(entry, limits) else Input(name, foreign=True)


class RememberedFiles(Disk):
    """The files of the disk, which no output of this run takes the place of."""

    def opened(self, stream: IO[bytes]) -> None:
        """Notes the file as an input of the running command."""
        remember(stream)

    def resolve(self, name: str, other: str) -> str:
        """Notes the file that another one refers to, whether it is there or not."""
        place = super().resolve(name, other)
        mention(place)
        return place


FILES = RememberedFiles()


def name_of(path: str) -> str:
    """What findings call a path of the command line: standard input goes by the name that it was given."""
    if path != STDIN:
        return path
    ctx = click.get_current_context(silent=True)
    name: str = UNNAMED if ctx is None else ctx.meta.get(NAME_OF_STDIN, UNNAMED)
    return name


def read_input(name: str, limits: Limits) -> Input:
    """The bytes of one file or of standard input, at most one more than the limit."""
    most = limits.file_bytes + 1
    try:
        if name == STDIN:
            if sys.stdin is None:
                return Input(name_of(name), problem="cannot read standard input: it is closed", piped=True)
            with held():
                FILES.opened(sys.stdin.buffer)
                return Input(name_of(name), sys.stdin.buffer.read(most), piped=True)
        return Input(name, FILES.read(name, most))
    except (OSError, ValueError) as error:
        return Input(name_of(name), problem=refusal(name_of(name), error), piped=name == STDIN)


def listing_fault(entry: Input, vendor: Vendor, limits: Limits, kind: str | None = None) -> str | None:
    """What is wrong with a file by itself that is to be a memory listing."""
    from pidcfg.encoders.listing import ListingError
    from pidcfg.listings import read_listing

    if entry.problem is not None:
        return entry.problem
    try:
        read_listing(entry.data, vendor, limits, kind)
    except ListingError as error:
        return f"{entry.name}:{error.line}:{error.column}: {error}"
    return None
