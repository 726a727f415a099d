"""A folder of entries by hash: kept whole or not at all, and never worth an error.

An entry repeats its key and ends with its checksum: whatever is cut off, changed, of another version or in the place of
another one is a miss. Entries are written beside their place and moved there, so that a reader sees the old one or the
new one. Who may write to the folder is trusted as who may write to the installation: it is made for its user alone, and
one that others may write to is not used.
"""

from __future__ import annotations

import hashlib
import json
import os
import stat
import sys
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PLACE = "PIDCFG_CACHE_DIR"
"""The variable that names another folder."""
SHELF_BYTES = 512 << 10
"""How much lies in one of the 256 shelves before its oldest half goes: 128 MiB in all."""
ENTRY_BYTES = 64 << 10
"""What is larger is not kept."""
CHECKSUM = 65
"""Bytes of a checksum and the line break before it."""
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH


def user_cache() -> Path:
    """The user's cache folder as the platform has it; raises `RuntimeError` where there is no home."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


@dataclass(frozen=True, slots=True)
class Store:
    """Entries in a folder, by keys of hexadecimal digits."""

    folder: Path

    @classmethod
    def open(cls, name: str) -> Store | None:
        """The folder of that name in the user's cache; None where there is none that is the user's own."""
        try:
            place = os.environ.get(PLACE)
            folder = (Path(place) if place else user_cache() / "pidcfg") / name
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            facts = folder.stat()
        except (OSError, RuntimeError, ValueError):
            return None
        mine = not hasattr(os, "geteuid") or facts.st_uid == os.geteuid()
        return cls(folder) if mine and not (sys.platform != "win32" and facts.st_mode & OTHERS_WRITE) else None

    def get(self, key: str) -> Any:
        """The value that was kept under a key; None where none is whole."""
        try:
            text, _, checksum = _read(self._path(key)).rpartition(b"\n")
            if checksum.decode() != hashlib.sha256(text).hexdigest():
                return None
            kept, value = json.loads(text)
        except (OSError, ValueError, RecursionError):
            return None
        return value if kept == key else None

    def put(self, key: str, value: Any) -> None:
        """Keeps a value of plain data, if that can be done."""
        text = json.dumps([key, value], separators=(",", ":")).encode()
        if len(text) > ENTRY_BYTES:
            return
        path = self._path(key)
        with suppress(OSError):
            path.parent.mkdir(mode=0o700, exist_ok=True)
            _make_room(path.parent)
            _write(path, text + b"\n" + hashlib.sha256(text).hexdigest().encode())

    def _path(self, key: str) -> Path:
        return self.folder / key[:2] / key


def _read(path: Path) -> bytes:
    """The bytes of a regular file, as many as an entry may have; raises `OSError` where something else is there."""
    handle = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    with os.fdopen(handle, "rb") as stream:
        if not stat.S_ISREG(os.fstat(handle).st_mode):
            raise OSError("a pipe or a device in the place of an entry")
        return stream.read(ENTRY_BYTES + CHECKSUM)


def _write(path: Path, data: bytes) -> None:
    """Puts a whole file in its place, and leaves nothing beside it."""
    from tempfile import NamedTemporaryFile

    with NamedTemporaryFile(dir=path.parent, prefix=".", delete=False) as stream:
        beside = Path(stream.name)
        try:
            stream.write(data)
            stream.close()
            beside.replace(path)
        except OSError:
            stream.close()
            beside.unlink(missing_ok=True)
            raise


def _make_room(shelf: Path) -> None:
    """Removes the oldest half of a shelf that is full, with what killed writers have left there."""
    with os.scandir(shelf) as entries:
        found = [(facts.st_mtime, facts.st_size, entry.path) for entry in entries if (facts := _facts(entry))]
    if sum(size for _, size, _ in found) <= SHELF_BYTES:
        return
    for _, _, path in sorted(found)[: len(found) // 2 + 1]:
        with suppress(OSError):
            Path(path).unlink()


def _facts(entry: os.DirEntry[str]) -> os.stat_result | None:
    """What is known of a file; None where another run has just removed it."""
    try:
        return entry.stat(follow_symlinks=False)
    except OSError:
        return None
