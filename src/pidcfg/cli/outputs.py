"""Output files: all written or none, never in part, and over a different file only when that is wanted."""

from __future__ import annotations

import atexit
import hashlib
import os
import stat
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from difflib import unified_diff
from pathlib import Path
from typing import NamedTuple, TextIO

import click

from pidcfg.cli.console import echo, write_user_file
from pidcfg.cli.inputs import equal_file_fault, was_read
from pidcfg.cli.interrupts import defer_signals
from pidcfg.cli.terminal import encodable
from pidcfg.text.reader import STREAM_NAME, open_file, read_file
from pidcfg.text.signs import UNPRINTABLE

# --- Temporary files beside their targets, named after them and locked while they are written -------------------------
#
# What a killed run has left for a target goes when the next run writes that target: a file of its name whose lock is
# free. A command that ends in any other way leaves none.

TEMPORARY_SUFFIX = ".pidcfg"
RANDOM_DIGITS = 8
"""Hexadecimal digits that tell two writers of one target apart."""
MAX_NAME_BYTES = 200
"""Bytes of a name; file systems have 255."""
LOCKS: dict[Path, int] = {}
"""The temporary files of this process, each with the descriptor that holds its lock; -1: without one."""


def _remove_all() -> None:
    """Removes what an interrupt has kept others from removing."""
    for path in [*LOCKS]:
        discard_file(path)


atexit.register(_remove_all)


def open_temporary(target: Path) -> tuple[int, Path]:
    """An open temporary file in the target's folder, and its path; raises `OSError`."""
    _remove_leftovers(target)
    while True:
        path = target.with_name(f"{_name_beginning(target)}{os.urandom(RANDOM_DIGITS // 2).hex()}{TEMPORARY_SUFFIX}")
        with defer_signals():
            try:
                handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o600)
            except FileExistsError:
                continue
            LOCKS[path] = -1
        try:
            if sys.platform != "win32":
                LOCKS[path] = os.dup(handle)
            if _take_lock(LOCKS[path]) and path.exists():
                return handle, path
        except OSError:  # no more files may be open
            os.close(handle)
            discard_file(path)
            raise
        os.close(handle)  # another run took it for one that was left
        discard_file(path)


def discard_file(path: Path) -> None:
    """Removes a temporary file, if it is still there, and gives up its lock."""
    with defer_signals(), suppress(OSError):
        path.unlink(missing_ok=True)
    release_lock(path)


def release_lock(path: Path) -> None:
    """Gives up the lock of a file that is in its place now."""
    with defer_signals():
        lock = LOCKS.pop(path, -1)
        if lock != -1:
            os.close(lock)


def _name_beginning(target: Path) -> str:
    """How the names of a target's temporary files begin."""
    name = target.name
    if len(os.fsencode(name)) > MAX_NAME_BYTES:
        name = hashlib.sha256(os.fsencode(name)).hexdigest()
    return f".{name}."


def _take_lock(handle: int) -> bool:
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


def _remove_leftovers(target: Path) -> None:
    """Removes what killed runs have left for a target."""
    begin = _name_beginning(target)
    length = len(begin) + RANDOM_DIGITS + len(TEMPORARY_SUFFIX)
    with suppress(OSError), os.scandir(target.parent) as entries:
        for entry in entries:
            if entry.name.startswith(begin) and entry.name.endswith(TEMPORARY_SUFFIX) and len(entry.name) == length:
                _remove_leftover(Path(entry.path))


def _remove_leftover(path: Path) -> None:
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


# --- Output files: all written or none, never in part, and over a different file only with ``--force`` ----------------

BLOCK_BYTES = 1 << 20
"""Bytes that are compared at a time."""


class StagedFile(NamedTuple):
    """A whole file under another name in the folder where it belongs."""

    name: str
    """As the command line calls it."""
    target: Path
    temporary: Path


def write_files(
    files: Mapping[str, str | bytes],
    *,
    force: bool = False,
    rewritable: Collection[str] = (),
    streamed_files: Sequence[StagedFile] = (),
    allow_inputs: bool = False,
) -> None:
    """Writes texts or bytes to paths: first everything to temporary files beside the targets, then each in place.

    ``rewritable`` are paths that are written anew by every run, such as reports for CI; ``streamed_files`` lie
    beside their targets already. ``allow_inputs``: files that were read may be replaced, for commands that correct
    them.
    """
    contents = {name: to_bytes(file) if isinstance(file, str) else file for name, file in files.items()}
    names = [*(entry.name for entry in streamed_files), *contents]
    problem = equal_file_fault(names)
    if problem is not None:
        raise click.ClickException(problem)
    if not allow_inputs:
        refuse_read_files(names)
    staged = list(streamed_files)
    name = ""
    try:
        for name, target, temporary in streamed_files:
            _guard_file(name, target, force=force or _has_same_bytes(target, temporary))
        targets = {name: output_path(name) for name in contents}
        for name, content in contents.items():
            _guard_file(name, targets[name], force=force or name in rewritable or _has_content(targets[name], content))
        for name, content in contents.items():
            staged.append(StagedFile(name, targets[name], _stage_file(targets[name], content)))
        with defer_signals():
            _commit_files(staged)
    except OSError as error:
        raise _write_error(name, error) from None
    finally:
        discard_files(staged)


def to_bytes(text: str) -> bytes:
    """A text as UTF-8; a byte of a file's name that is none of UTF-8 shows as on the terminal."""
    return encodable(text, "utf-8").encode()


def refuse_read_files(names: Collection[str]) -> None:
    """No output takes the place of a file that this run has read, with force or without."""
    for name in names:
        if was_read(name):
            raise click.ClickException(f"{name} is a file that is read; give the output another name")


def _device_advice(name: str) -> str:
    """What to do instead of writing to a device: the option ``-o`` can be left out."""
    context = click.get_current_context(silent=True)
    out = context.params.get("out") if context is not None else None
    return "without -o the result goes to standard output" if out == name else "name a file"


def output_path(name: str) -> Path:
    """Where a file is written, through a link; refused when a device, a pipe or a folder is there."""
    if not name:
        raise click.ClickException("the output has no name")
    if STREAM_NAME.fullmatch(name):
        raise click.ClickException(f"{name} is a stream and no file; {_device_advice(name)}")
    try:
        target = Path(name).resolve()
        if target.exists() and not target.is_file():
            raise click.ClickException(f"{name} is no regular file; {_device_advice(name)}")
    except (OSError, RuntimeError, ValueError) as error:
        raise _write_error(name, error) from None
    return target


def copy_permissions(temporary: Path, target: Path) -> None:
    """Gives a file the rights of the one that it replaces, or of a new one."""
    if os.name == "posix":
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~umask)


def discard_files(staged: Sequence[StagedFile]) -> None:
    """Removes temporary files that are still there."""
    for entry in staged:
        discard_file(entry.temporary)


def _write_error(name: str, error: Exception) -> click.ClickException:
    return click.ClickException(f"cannot write {name}: {getattr(error, 'strerror', None) or error}")


def _guard_file(name: str, target: Path, *, force: bool) -> None:
    """Ends the command when something else is there; ``force``: it may be replaced, or is the same."""
    if not force and target.exists():
        raise click.ClickException(f"{name} exists and differs; use --force to overwrite it")


def _has_content(target: Path, content: bytes) -> bool:
    """Whether a file is there with these bytes."""
    return target.exists() and target.stat().st_size == len(content) and read_file(target) == content


def _has_same_bytes(target: Path, other: Path) -> bool:
    """Whether a file is there with the same bytes as another one, however long they are."""
    if not target.exists() or target.stat().st_size != other.stat().st_size:
        return False
    with open_file(target) as first, open_file(other) as second:
        while block := first.read(BLOCK_BYTES):
            if block != second.read(BLOCK_BYTES):
                return False
    return True


def _stage_file(target: Path, content: bytes) -> Path:
    """A flushed temporary file in the target's folder, with the rights that the target will have."""
    handle, temporary = open_temporary(target)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        copy_permissions(temporary, target)
    except BaseException:
        discard_file(temporary)
        raise
    return temporary


def _commit_files(staged: Sequence[StagedFile]) -> None:
    """Puts every file in place; when one cannot be, those before it get their old contents back."""
    backups: list[StagedFile] = []
    replaced: list[StagedFile] = []
    name = ""
    try:
        for entry in staged[:-1]:  # what stands last needs nothing to go back to
            name = entry.name
            backups += _backup_file(entry)
        for entry in staged:
            name = entry.name
            entry.temporary.replace(entry.target)
            replaced.append(entry)
    except OSError as error:
        remaining = _undo_files(replaced, backups)
        remark = (
            f"; {', '.join(remaining)} {'is' if len(remaining) == 1 else 'are'} written all the same"
            if remaining
            else ""
        )
        raise click.ClickException(f"{_write_error(name, error).message}{remark}") from None
    finally:
        discard_files(backups)


def _backup_file(entry: StagedFile) -> list[StagedFile]:
    """The present contents of a target under another name, where there are any."""
    if not entry.target.exists():
        return []
    handle, backup = open_temporary(entry.target)
    os.close(handle)
    try:
        backup.unlink()
        os.link(entry.target, backup)
    except OSError:  # a file system without links
        import shutil

        try:
            shutil.copy2(entry.target, backup)
        except OSError:
            discard_file(backup)
            raise
    return [StagedFile(entry.name, entry.target, backup)]


def _undo_files(replaced: Sequence[StagedFile], backed_up: Sequence[StagedFile]) -> list[str]:
    """Takes back what was put in place; the names of what could not be."""
    backups = {entry.target: entry.temporary for entry in backed_up}
    remaining = []
    for entry in replaced:
        try:
            if entry.target in backups:
                backups[entry.target].replace(entry.target)
            else:
                entry.target.unlink()
        except OSError:
            remaining.append(entry.name)
    return remaining


# --- The file of ``--resume``: read whole, replaced whole -------------------------------------------------------------


def read_existing(name: str) -> bytes | None:
    """What the file holds; None: it is not there yet."""
    try:
        return read_file(output_path(name))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise click.ClickException(f"cannot read {name}: {error.strerror or error}") from None


def file_keeper(name: str) -> Callable[[bytes], None]:
    """What writes the file; a reader sees the old content or the new one, whenever the writer is stopped."""
    target = output_path(name)
    if not target.parent.is_dir():
        raise click.ClickException(f"the folder {target.parent} of {name} does not exist; make it first")

    def keep_data(data: bytes) -> None:
        temporary: Path | None = None
        try:
            handle, temporary = open_temporary(target)
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(target)
        except OSError as error:
            raise click.ClickException(f"cannot write {name}: {error.strerror or error}") from None
        finally:
            if temporary is not None:
                discard_file(temporary)

    return keep_data


# ----------------------------------------------------------------------------------------------------------------------
# Files that a command edits: the change as a patch, and new contents in the place of the old, whole or not at all.

UNQUOTED_BYTES = frozenset(range(0x20, 0x7F)) - {ord('"'), ord("\\")}
"""Bytes that stand for themselves in a quoted name."""
NO_NEWLINE = "\\ No newline at end of file"


def patch_text(name: str, before: bytes, after: bytes) -> str:
    """What changes, as `patch` reads it."""
    quoted = _quote_name(name)
    rows = unified_diff(_patch_lines(before), _patch_lines(after), quoted, quoted)
    return "".join(row if row.endswith("\n") else f"{row}\n{NO_NEWLINE}\n" for row in rows)


def _quote_name(name: str) -> str:
    """A name as `patch` and git write it in a header: in quotes where it would end early, a tab behind blanks."""
    if UNPRINTABLE.search(name) or any(c in '\t\n"\\' or "\ud800" <= c <= "\udfff" for c in name):
        data = os.fsencode(name)
        return '"' + "".join(chr(b) if b in UNQUOTED_BYTES else f"\\{b:03o}" for b in data) + '"'
    return f"{name}\t" if " " in name else name


def print_patch(text: str) -> None:
    """Prints what another program may read: every byte as it is, unless a terminal shows it."""
    if sys.stdout.isatty():
        echo(text)
    else:
        write_user_file(text.encode())


def _patch_lines(data: bytes) -> list[str]:
    """Lines with their ends, split where `patch` splits them."""
    parts = data.decode().split("\n")
    return [f"{part}\n" for part in parts[:-1]] + ([parts[-1]] if parts[-1] else [])


def replace_files(changes: Mapping[str, tuple[bytes, bytes]]) -> None:
    """Puts new contents in the place of those that were read, by name; nothing where one file is protected or changed.

    Ends the command with the reason.
    """
    for name, (before, _) in changes.items():
        try:
            content, status = read_file(name), Path(name).stat()
        except OSError as error:
            reason = f"cannot read {name} again: {error.strerror}"
            raise click.ClickException(f"{reason}; nothing was written") from None
        if content != before:
            raise click.ClickException(f"{name} has changed since it was read; nothing was written")
        if not status.st_mode & stat.S_IWUSR or not os.access(name, os.W_OK):
            raise click.ClickException(f"{name} is read-only; nothing was written")
        if status.st_nlink > 1:
            links = "has more than one name (hard links), and the others would keep the old text"
            raise click.ClickException(f"{name} {links}; nothing was written")
    write_files({name: data for name, (_, data) in changes.items()}, force=True, allow_inputs=True)


# ----------------------------------------------------------------------------------------------------------------------
# A trend on its way to a file: written as it comes to a temporary file beside the target, then put in its place.


@contextmanager
def trend_file(
    name: str | None, *, force: bool, other_files: Mapping[str, str | bytes] | None = None
) -> Iterator[TextIO | None]:
    """An open stream for a trend (None without a name); the target appears when a run has come to its end.

    The ``other_files``, files by name, are written with it: all or none.
    """
    if name is None:
        yield None
        write_files(other_files or {}, force=force)
        return
    target = output_path(name)
    refuse_read_files([name])
    try:
        handle, temporary = open_temporary(target)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    staged = [StagedFile(name, target, temporary)]
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        if temporary.stat().st_size:
            copy_permissions(temporary, target)
            write_files(other_files or {}, force=force, streamed_files=staged)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    finally:
        discard_files(staged)
