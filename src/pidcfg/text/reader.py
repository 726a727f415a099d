"""Where files come from, the disk or texts that the caller already has, and the limits on what is read."""

from __future__ import annotations

import errno
import os
import posixpath
import re
import stat
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import IO, Protocol

from pidcfg.text.frozen import frozen

# --- Limits on untrusted input, all in one place; the command line may raise them, a file never can -------------------


LISTING_FACTOR = 3
"""How many times the size of a configuration a file of another program may have: CODESYS projects have 1.1 MB."""


@frozen
class Limits:
    """How large an input may be before it is refused (exit code 2, naming the limit)."""

    file_bytes: int = 1 << 20
    """Of a configuration or scenario; what a program has written may have `LISTING_FACTOR` times as much."""
    depth: int = 32
    nodes: int = 50_000
    aliases: int = 100
    scalar_bytes: int = 4 << 10
    key_bytes: int = 256
    loops: int = 1_000
    files: int = 10_000
    loop_steps: int = 100_000_000

    @property
    def listing_bytes(self) -> int:
        """How many bytes a memory listing, a project, a sheet or a recording may have."""
        return LISTING_FACTOR * self.file_bytes


DEFAULT = Limits()

# --- Where files come from: the disk, or texts that the caller already has, which stand for every file there is -------

SUFFIXES = frozenset({".yaml", ".yml"})
"""How the names of configurations and scenarios end; a file of another name is a memory listing."""
STREAM_NAME = re.compile(r"/dev/(?:std(?:in|out|err)|fd/.*)|/proc/[^/]+/fd/.*")
"""Names of what a process has open."""
PROC_FOLDER = "/proc/"
"""Where the kernel shows its own state as if in files: some are waited for, and some take what they show away."""
SPECIAL_FILES = {stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device"}
OPEN_FLAGS = os.O_RDONLY | sum(getattr(os, flag, 0) for flag in ("O_NONBLOCK", "O_NOCTTY", "O_CLOEXEC", "O_BINARY"))
"""How a file is opened: nothing is waited for that takes its place meanwhile."""
DEFAULT_TEXT_NAME = "<text>"
"""The name of a text that has none."""


class Reader(Protocol):
    """What a call reads other files with."""

    def read(self, name: str, max_bytes: int) -> bytes:
        """The first ``max_bytes`` bytes of a file; raises `OSError`, or `ValueError` for an impossible name."""

    def resolve(self, name: str, other: str) -> str:
        """The name of a file that the file ``name`` refers to as ``other``: relative names begin in its folder."""


class Disk:
    """The files of the disk."""

    def read(self, name: str, max_bytes: int) -> bytes:
        """The first ``max_bytes`` bytes of a file."""
        return read_file(name, max_bytes, self.on_open)

    def on_open(self, stream: IO[bytes]) -> None:
        """Called with every file that is opened; a hook for readers that keep track of them."""

    def resolve(self, name: str, other: str) -> str:
        """The name from the folder of ``name``."""
        return shorten_path(Path(name).parent / other).as_posix()


def is_stream(name: str) -> bool:
    """Whether a name is one of what the process has open, ``/dev/fd/63`` of a shell's ``<(…)``, or of nothing."""
    return STREAM_NAME.fullmatch(name) is not None or name == os.devnull


def open_file(name: str | Path) -> IO[bytes]:
    """A file, opened for reading; raises `OSError` for what is none, before it is opened.

    A pipe or a device may be waited for for ever or never end, and opening one may do something. Streams are opened
    whatever they are: who names one on a command line has opened it; what a file names is read by `read_named_file`.
    """
    name = os.fspath(name)
    if is_stream(name):
        return Path(name).open("rb")
    _refuse_special(os.stat(name), name)  # noqa: PTH116 - as the name stands
    if os.path.realpath(name).startswith(PROC_FOLDER):
        raise OSError(errno.EINVAL, f"it lies in {PROC_FOLDER[:-1]} and is no file", name)
    handle = os.open(name, OPEN_FLAGS)
    try:
        _refuse_special(os.fstat(handle), name)
    except OSError:
        os.close(handle)
        raise
    return os.fdopen(handle, "rb")


def _refuse_special(facts: os.stat_result, name: str) -> None:
    """Raises `OSError` for what is no regular file."""
    if stat.S_ISDIR(facts.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), name)
    if not stat.S_ISREG(facts.st_mode):
        kind = SPECIAL_FILES.get(stat.S_IFMT(facts.st_mode), "something else")
        raise OSError(errno.EINVAL, f"it is {kind} and no file", name)


def read_file(name: str | Path, max_bytes: int = -1, on_open: Callable[[IO[bytes]], None] | None = None) -> bytes:
    """The first ``max_bytes`` bytes of a file, or all of them; ``on_open`` is called with it."""
    with open_file(name) as stream:
        if on_open is not None:
            on_open(stream)
        data: bytes | None = stream.read(max_bytes)
    if data is None:
        raise BlockingIOError(errno.EAGAIN, "it is waited for and no file", os.fspath(name))
    return data


def read_named_file(reader: Reader, name: str, max_bytes: int) -> bytes:
    """The first ``max_bytes`` bytes of what another file names: what the process has open is not meant."""
    if is_stream(name):
        raise OSError(errno.EINVAL, "it is a stream and no file", name)
    return reader.read(name, max_bytes)


class Texts:
    """Texts by the names of their files; another file does not exist."""

    def __init__(self, files: Mapping[str, str | bytes]) -> None:
        self.files = {posixpath.normpath(name): data_of(text) for name, text in files.items()}

    def read(self, name: str, max_bytes: int) -> bytes:
        """The first ``max_bytes`` bytes of a text."""
        data = self.files.get(posixpath.normpath(name))
        if data is None:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), name)
        return data[:max_bytes]

    def resolve(self, name: str, other: str) -> str:
        """The name from the folder of ``name``."""
        return posixpath.normpath(posixpath.join(posixpath.dirname(name), other))


class Overlay(Disk):
    """Texts that stand for files, such as the buffers of an editor; every other file is that of the disk."""

    def __init__(self, texts: Mapping[str, str | bytes]) -> None:
        self.texts = {_full_name(name): data_of(text) for name, text in texts.items()}

    def read(self, name: str, max_bytes: int) -> bytes:
        """The first ``max_bytes`` bytes of a text, else of the file."""
        data = self.texts.get(_full_name(name))
        return super().read(name, max_bytes) if data is None else data[:max_bytes]


def _full_name(name: str) -> str:
    """A file by whatever name it is called; links are not followed."""
    return os.path.normcase(os.path.abspath(name))  # noqa: PTH100 - as it is named


DISK = Disk()
MAX_NEARBY = 1000
"""Files of a folder that are looked at for a name like another one."""
MIN_LIKENESS = 0.7
"""How like it must be."""
Files = Mapping[str, str | bytes] | Reader | None
"""Texts by name, or a reader; None: the disk."""


def reader_of(files: Files) -> Reader:
    """The reader that an argument ``files`` stands for."""
    if files is None:
        return DISK
    return Texts(files) if isinstance(files, Mapping) else files


def data_of(text: str | bytes) -> bytes:
    """A text as a file holds it; what is no character stays there for the parser to find."""
    if isinstance(text, str):
        return text.encode("utf-8", "surrogatepass")
    if isinstance(text, bytes | bytearray | memoryview):
        return bytes(text)
    raise TypeError(f"a source is a pathlib.Path, str or bytes, not {type(text).__name__}")


def source_data(source: Path | str | bytes, name: str | None, files: Files, max_bytes: int) -> tuple[bytes, str]:
    """The first ``max_bytes`` bytes of a source, and its name in findings; raises `OSError` for a missing file."""
    if isinstance(source, Path):
        return reader_of(files).read(source.as_posix(), max_bytes), name or source.as_posix()
    return data_of(source), name or DEFAULT_TEXT_NAME


def may_be_quoted(reader: Reader, file: str, named_file: str) -> bool:
    """Whether messages may say what stands in a file that ``file`` names: it lies in the folder of that one, or below.

    A configuration of a stranger could name any file, and its lines would stand in the log of whoever checks it. Links
    are followed; texts that the caller has given are his own.
    """
    if isinstance(reader, Texts):
        return True
    return Path(os.path.realpath(named_file)).is_relative_to(os.path.realpath(Path(file).parent))


def similar_file(name: str, reader: Reader) -> str | None:
    """A file beside one that is not there whose name is like that one's."""
    from difflib import get_close_matches
    from itertools import islice

    path, base_reader = Path(name), getattr(reader, "reader", reader)
    if isinstance(base_reader, Texts):
        others = [Path(other) for other in base_reader.files]
    elif isinstance(base_reader, Disk):
        try:
            others = [] if path.exists() else list(islice(path.parent.iterdir(), MAX_NEARBY))
        except (OSError, ValueError):
            return None
    else:
        return None
    names = {other.name: other for other in others if other.suffix.lower() in SUFFIXES}
    near = get_close_matches(path.name, names, 1, MIN_LIKENESS)
    return (path.parent / near[0]).as_posix() if near else None


def read_failure(name: str, error: OSError | ValueError) -> str:
    """Why a file cannot be read, in words."""
    if isinstance(error, OSError):
        return f"cannot read {name}: {error.strerror or error}"
    return f"cannot read {name!r}: {error}"


def shorten_path(path: Path) -> Path:
    """The path without ``folder/..``, where the folder is one and no link: behind a link ``..`` is somewhere else."""
    short = Path()
    for part in path.parts:
        steps_back = part == ".." and short.name not in {"", ".."}
        short = short.parent if steps_back and short.is_dir() and not short.is_symlink() else short / part
    return short
