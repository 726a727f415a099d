"""Temporary files beside their targets, named after them and locked while they are written.

What a killed run has left for a target goes when the next run writes that target: a file of its name whose lock is
free. A command that ends in any other way leaves none.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import stat
import sys
from contextlib import suppress
from pathlib import Path

from pidcfg.cli.interrupts import whole

SUFFIX = ".pidcfg"
RANDOM = 8
"""Hexadecimal digits that tell two writers of one target apart."""
LONGEST = 200
"""Bytes of a name; file systems have 255."""
LOCKS: dict[Path, int] = {}
"""The temporary files of this process, each with the descriptor that holds its lock; -1: without one."""


def _remove_all() -> None:
    """Removes what an interrupt has kept others from removing."""
    for path in [*LOCKS]:
        discard(path)


atexit.register(_remove_all)


def temporary_for(target: Path) -> tuple[int, Path]:
    """An open temporary file in the target's folder, and its path; raises `OSError`."""
    _remove_left(target)
    while True:
        path = target.with_name(f"{_beginning(target)}{os.urandom(RANDOM // 2).hex()}{SUFFIX}")
        with whole():
            try:
                handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
            except FileExistsError:
                continue
            LOCKS[path] = -1
        try:
            if sys.platform != "win32":
                LOCKS[path] = os.dup(handle)
            if _lock(LOCKS[path]) and path.exists():
                return handle, path
        except OSError:  # no more files may be open
            os.close(handle)
            discard(path)
            raise
        os.close(handle)  # another run took it for one that was left
        discard(path)


def discard(path: Path) -> None:
    """Removes a temporary file, if it is still there, and gives up its lock."""
    with whole(), suppress(OSError):
        path.unlink(missing_ok=True)
    release(path)


def release(path: Path) -> None:
    """Gives up the lock of a file that is in its place now."""
    with whole():
        lock = LOCKS.pop(path, -1)
        if lock != -1:
            os.close(lock)


def _beginning(target: Path) -> str:
    """How the names of a target's temporary files begin."""
    name = target.name
    if len(os.fsencode(name)) > LONGEST:
        name = hashlib.sha256(os.fsencode(name)).hexdigest()
    return f".{name}."


def _lock(handle: int) -> bool:
    """Takes the lock of an open file, if nobody has it; Windows lets nobody remove a file that is open."""
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks: nothing is ever taken for left there
        pass
    return True


def _remove_left(target: Path) -> None:
    """Removes what killed runs have left for a target."""
    begin = _beginning(target)
    length = len(begin) + RANDOM + len(SUFFIX)
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if entry.name.startswith(begin) and entry.name.endswith(SUFFIX) and len(entry.name) == length:
                _remove_if_left(Path(entry.path))


def _remove_if_left(path: Path) -> None:
    """Removes a regular file whose lock is free."""
    if sys.platform == "win32":
        with suppress(OSError):
            path.unlink()
        return
    import fcntl

    with suppress(OSError):
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            if stat.S_ISREG(os.fstat(handle).st_mode):
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                path.unlink()
        finally:
            os.close(handle)
