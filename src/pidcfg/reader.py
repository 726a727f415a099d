"""Where files come from: the disk, or texts that the caller already has, which stand for every file there is."""

from __future__ import annotations

import errno
import os
import posixpath
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from typing import IO

SUFFIXES = frozenset({".yaml", ".yml"})
"""How the names of configurations and scenarios end; a file of another name is a memory listing."""
STREAMS = ("/dev/", "/proc/")
"""How the names of streams begin."""
UNNAMED = "<text>"
"""The name of a text that has none."""


class Reader(Protocol):
    """What a call reads other files with."""

    def read(self, name: str, most: int) -> bytes:
        """The first ``most`` bytes of a file; raises `OSError`, or `ValueError` for a name that no file can have."""

    def resolve(self, name: str, other: str) -> str:
        """The name of a file that the file ``name`` refers to as ``other``: relative names begin in its folder."""


class Disk:
    """The files of the disk."""

    def read(self, name: str, most: int) -> bytes:
        """The first ``most`` bytes of a file."""
        refuse_pipe(name)
        with Path(name).open("rb") as stream:
            self.opened(stream)
            return stream.read(most)

    def opened(self, stream: IO[bytes]) -> None:
        """Called with every file that is opened; a hook for readers that keep track of them."""

    def resolve(self, name: str, other: str) -> str:
        """The name from the folder of ``name``."""
        return shortened(Path(name).parent / other).as_posix()


def refuse_pipe(name: str) -> None:
    """Raises `OSError` at a pipe that has a name in a folder: opening it would wait for whoever writes there.

    What a process has open, ``/dev/fd/63`` of a shell's ``<(…)``, is read.
    """
    if stat.S_ISFIFO(os.stat(name).st_mode) and not name.startswith(STREAMS):  # noqa: PTH116 - as the name stands
        raise OSError(errno.EINVAL, "it is a pipe and no file; '-' reads standard input", name)


class Texts:
    """Texts by the names of their files; another file does not exist."""

    def __init__(self, files: Mapping[str, str | bytes]) -> None:
        self.files = {posixpath.normpath(name): data_of(text) for name, text in files.items()}

    def read(self, name: str, most: int) -> bytes:
        """The first ``most`` bytes of a text."""
        data = self.files.get(posixpath.normpath(name))
        if data is None:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), name)
        return data[:most]

    def resolve(self, name: str, other: str) -> str:
        """The name from the folder of ``name``."""
        return posixpath.normpath(posixpath.join(posixpath.dirname(name), other))


DISK = Disk()
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


def source_data(source: Path | str | bytes, name: str | None, files: Files, most: int) -> tuple[bytes, str]:
    """The first ``most`` bytes of a source, and its name in findings; raises `OSError` for a file that is not there."""
    if isinstance(source, Path):
        return reader_of(files).read(source.as_posix(), most), name or source.as_posix()
    return data_of(source), name or UNNAMED


def may_be_quoted(reader: Reader, file: str, named: str) -> bool:
    """Whether messages may say what stands in a file that ``file`` names: it lies in the folder of that one, or below.

    A configuration of a stranger could name any file, and its lines would stand in the log of whoever checks it. Links
    are followed; texts that the caller has given are his own.
    """
    if isinstance(reader, Texts):
        return True
    return Path(os.path.realpath(named)).is_relative_to(os.path.realpath(Path(file).parent))


def refusal(name: str, error: OSError | ValueError) -> str:
    """Why a file cannot be read, in words."""
    if isinstance(error, OSError):
        return f"cannot read {name}: {error.strerror or error}"
    return f"cannot read {name!r}: {error}"


def shortened(path: Path) -> Path:
    """The path without ``folder/..``, where the folder is one and no link: behind a link ``..`` is somewhere else."""
    short = Path()
    for part in path.parts:
        steps_back = part == ".." and short.name not in {"", ".."}
        short = short.parent if steps_back and short.is_dir() and not short.is_symlink() else short / part
    return short
