"""A folder of entries by hash: kept whole or not at all, and never worth an error.

An entry repeats its key and ends with its checksum: whatever is cut off, changed, of another version or in the place of
another one is a miss. Entries are written beside their place and moved there, so that a reader sees the old one or the
new one. Who may write to the folder is trusted as who may write to the installation, compiled code lies there: so it is
the user's alone, and so are the way to it and what lies in it.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

from pidcfg.text.frozen import frozen
from pidcfg.text.reader import read_file

FOLDER_VARIABLE = "PIDCFG_CACHE_DIR"
"""The variable that names another folder."""
KERNEL_FOLDER = "kernels"
"""The folder of compiled kernels; to look into it loads no compiler."""
SHELF_BYTES = 512 << 10
"""How much lies in one of the 256 shelves before its oldest half goes: 128 MiB in all."""
ENTRY_BYTES = 64 << 10
"""What is larger is not kept."""
CHECKSUM_BYTES = 65
"""Bytes of a checksum and the line break before it."""
OTHERS_WRITE = stat.S_IWGRP | stat.S_IWOTH
ROOT_USER = 0
"""The user to whom the folders above a home belong."""


class UnsafeFolderError(OSError):
    """Somebody else could put files into the cache folder, or another folder into its place."""


def user_cache() -> Path:
    """The user's cache folder as the platform has it; raises `RuntimeError` where there is no home."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    folder = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return folder if folder.is_absolute() else Path.home() / ".cache"


def cache_folder(name: str) -> Path:
    """The folder of a name in the user's cache, made where there is none; links are followed once, here.

    Raises `UnsafeFolderError` where it is not the user's alone, and `OSError` where there can be none.
    """
    try:
        place = os.environ.get(FOLDER_VARIABLE)
        folder = ((Path(place) if place else user_cache() / "pidcfg") / name).resolve()
    except (RuntimeError, ValueError) as error:
        raise OSError(errno.ENOENT, str(error)) from error
    for part in (*reversed(folder.parents), folder):
        if not part.exists():
            part.mkdir(mode=0o700, exist_ok=True)
        if hasattr(os, "geteuid"):
            _require_private(part, part.lstat(), os.geteuid(), is_last=part == folder)
    return folder


def holds_entries(name: str) -> bool:
    """Whether anything is kept in the folder of a name."""
    try:
        return any(cache_folder(name).iterdir())
    except OSError:
        return False


def require_private(part: Path) -> None:
    """Raises `UnsafeFolderError` unless a folder or file of the cache is the user's alone, and no link."""
    if hasattr(os, "geteuid"):
        facts = part.lstat()
        if stat.S_ISLNK(facts.st_mode):
            raise UnsafeFolderError(errno.EPERM, f"{part} is a link")
        _require_private(part, facts, os.geteuid(), is_last=True)


def _require_private(part: Path, facts: os.stat_result, user: int, *, is_last: bool) -> None:
    """Raises where another user than ``user`` and root could exchange what lies in a part of the way.

    In a folder such as /tmp all may write, but exchange only what is their own: that will do, but for the ``is_last``.
    """
    if facts.st_uid not in ({user} if is_last else {user, ROOT_USER}):
        raise UnsafeFolderError(errno.EPERM, f"{part} belongs to another user")
    if facts.st_mode & OTHERS_WRITE and (is_last or not facts.st_mode & stat.S_ISVTX):
        raise UnsafeFolderError(errno.EPERM, f"others may write to {part}")


@frozen
class Store:
    """Entries in a folder, by keys of hexadecimal digits."""

    folder: Path
    entry_bytes: int = ENTRY_BYTES
    shelf_bytes: int = SHELF_BYTES

    def get(self, key: str) -> Any:
        """The value of plain data that was kept under a key; None where none is whole."""
        data = self.read(key)
        try:
            return None if data is None else json.loads(data)
        except (ValueError, RecursionError):
            return None

    def put(self, key: str, value: object) -> None:
        """Keeps a value of plain data, if that can be done."""
        with suppress(OSError):
            self.write(key, json.dumps(value, separators=(",", ":")).encode())

    def read(self, key: str) -> bytes | None:
        """The bytes that were kept under a key; None where none are whole."""
        path = self._entry_path(key)
        try:
            for part in (path.parent, path):
                require_private(part)
            text, _, checksum = read_file(path, self._max_bytes(key)).rpartition(b"\n")
        except OSError:
            return None
        is_whole = checksum == hashlib.sha256(text).hexdigest().encode()
        head = f"{key}\n".encode()
        return text.removeprefix(head) if is_whole and text.startswith(head) else None

    def write(self, key: str, data: bytes) -> None:
        """Keeps bytes, unless they are too many; raises `OSError` where that cannot be done."""
        text = f"{key}\n".encode() + data
        if len(data) > self.entry_bytes:
            return
        path = self._entry_path(key)
        path.parent.mkdir(mode=0o700, exist_ok=True)
        require_private(path.parent)
        _make_room(path.parent, self.shelf_bytes)
        _write_file(path, text + b"\n" + hashlib.sha256(text).hexdigest().encode())

    def _entry_path(self, key: str) -> Path:
        return self.folder / key[:2] / key

    def _max_bytes(self, key: str) -> int:
        return len(key) + 1 + self.entry_bytes + CHECKSUM_BYTES


def _write_file(path: Path, data: bytes) -> None:
    """Puts a whole file in its place, and leaves nothing beside it."""
    from tempfile import NamedTemporaryFile

    with NamedTemporaryFile(dir=path.parent, prefix=".", delete=False) as stream:
        temporary = Path(stream.name)
        try:
            stream.write(data)
            stream.close()
            temporary.replace(path)
        except OSError:
            stream.close()
            temporary.unlink(missing_ok=True)
            raise


def _make_room(shelf: Path, max_bytes: int) -> None:
    """Removes the oldest half of a shelf that is full, with what killed writers have left there."""
    with os.scandir(shelf) as entries:
        files = [(facts.st_mtime, facts.st_size, entry.path) for entry in entries if (facts := _file_status(entry))]
    if sum(size for _, size, _ in files) <= max_bytes:
        return
    for _, _, path in sorted(files)[: len(files) // 2 + 1]:
        with suppress(OSError):
            Path(path).unlink()


def _file_status(entry: os.DirEntry[str]) -> os.stat_result | None:
    """What is known of a file; None where another run has just removed it."""
    try:
        return entry.stat(follow_symlinks=False)
    except OSError:
        return None
