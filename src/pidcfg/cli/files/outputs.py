"""Output files: all written or none, never in part, and over a different file only with ``--force``."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import click

from pidcfg.cli.files import temporary as beside
from pidcfg.cli.files.identity import one_file, was_read
from pidcfg.cli.files.temporary import temporary_for
from pidcfg.cli.interrupts import whole
from pidcfg.cli.terminal.glyphs import encodable
from pidcfg.reader import STREAM, open_file, read_file

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

BLOCK = 1 << 20
"""Bytes that are compared at a time."""


class Staged(NamedTuple):
    """A whole file under another name in the folder where it belongs."""

    name: str
    """As the command line calls it."""
    target: Path
    temporary: Path


def write_files(
    files: Mapping[str, str | bytes],
    *,
    force: bool = False,
    renewed: Collection[str] = (),
    streamed: Sequence[Staged] = (),
    over_inputs: bool = False,
) -> None:
    """Writes texts or bytes to paths: first everything to temporary files beside the targets, then each in place.

    ``renewed`` are paths that are written anew by every run, such as reports for CI; ``streamed`` are files that lie
    beside their targets already. ``over_inputs``: files that were read may be replaced, for commands that correct
    them.
    """
    contents = {name: to_bytes(file) if isinstance(file, str) else file for name, file in files.items()}
    names = [*(entry.name for entry in streamed), *contents]
    problem = one_file(names)
    if problem is not None:
        raise click.ClickException(problem)
    if not over_inputs:
        refuse_read(names)
    staged = list(streamed)
    name = ""
    try:
        for name, target, temporary in streamed:
            _refuse(name, target, force=force or _same(target, temporary))
        targets = {name: place(name) for name in contents}
        for name, content in contents.items():
            _refuse(name, targets[name], force=force or name in renewed or _holds(targets[name], content))
        for name, content in contents.items():
            staged.append(Staged(name, targets[name], _stage(targets[name], content)))
        with whole():
            _commit(staged)
    except OSError as error:
        raise _failed(name, error) from None
    finally:
        discard(staged)


def to_bytes(text: str) -> bytes:
    """A text as UTF-8; a byte of a file's name that is none of UTF-8 shows as on the terminal."""
    return encodable(text, "utf-8").encode()


def refuse_read(names: Collection[str]) -> None:
    """No output takes the place of a file that this run has read, with force or without."""
    for name in names:
        if was_read(name):
            raise click.ClickException(f"{name} is a file that is read; give the output another name")


def _instead(name: str) -> str:
    """What to do instead of writing to a device: the option ``-o`` can be left out."""
    context = click.get_current_context(silent=True)
    out = context.params.get("out") if context is not None else None
    return "without -o the result goes to standard output" if out == name else "name a file"


def place(name: str) -> Path:
    """Where a file is written, through a link; refused when a device, a pipe or a folder is there."""
    if not name:
        raise click.ClickException("the output has no name")
    if STREAM.fullmatch(name):
        raise click.ClickException(f"{name} is a stream and no file; {_instead(name)}")
    try:
        target = Path(name).resolve()
        if target.exists() and not target.is_file():
            raise click.ClickException(f"{name} is no regular file; {_instead(name)}")
    except (OSError, RuntimeError, ValueError) as error:
        raise _failed(name, error) from None
    return target


def take_rights(temporary: Path, target: Path) -> None:
    """Gives a file the rights of the one that it replaces, or of a new one."""
    if os.name == "posix":
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~umask)


def discard(staged: Sequence[Staged]) -> None:
    """Removes temporary files that are still there."""
    for entry in staged:
        beside.discard(entry.temporary)


def _failed(name: str, error: Exception) -> click.ClickException:
    return click.ClickException(f"cannot write {name}: {getattr(error, 'strerror', None) or error}")


def _refuse(name: str, target: Path, *, force: bool) -> None:
    """Ends the command when something else is there; ``force``: it may be replaced, or is the same."""
    if not force and target.exists():
        raise click.ClickException(f"{name} exists and differs; use --force to overwrite it")


def _holds(target: Path, content: bytes) -> bool:
    """Whether a file is there with these bytes."""
    return target.exists() and target.stat().st_size == len(content) and read_file(target) == content


def _same(target: Path, other: Path) -> bool:
    """Whether a file is there with the same bytes as another one, however long they are."""
    if not target.exists() or target.stat().st_size != other.stat().st_size:
        return False
    with open_file(target) as first, open_file(other) as second:
        while block := first.read(BLOCK):
            if block != second.read(BLOCK):
                return False
    return True


def _stage(target: Path, content: bytes) -> Path:
    """A flushed temporary file in the target's folder, with the rights that the target will have."""
    handle, temporary = temporary_for(target)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        take_rights(temporary, target)
    except BaseException:
        beside.discard(temporary)
        raise
    return temporary


def _commit(staged: Sequence[Staged]) -> None:
    """Puts every file in place; when one cannot be, those before it get their old contents back."""
    backups: list[Staged] = []
    done: list[Staged] = []
    name = ""
    try:
        for entry in staged[:-1]:  # what stands last needs nothing to go back to
            name = entry.name
            backups += _backup(entry)
        for entry in staged:
            name = entry.name
            entry.temporary.replace(entry.target)
            done.append(entry)
    except OSError as error:
        remaining = _undo(done, backups)
        remark = (
            f"; {', '.join(remaining)} {'is' if len(remaining) == 1 else 'are'} written all the same"
            if remaining
            else ""
        )
        raise click.ClickException(f"{_failed(name, error).message}{remark}") from None
    finally:
        discard(backups)


def _backup(entry: Staged) -> list[Staged]:
    """The present contents of a target under another name, where there are any."""
    if not entry.target.exists():
        return []
    handle, backup = temporary_for(entry.target)
    os.close(handle)
    try:
        backup.unlink()
        os.link(entry.target, backup)
    except OSError:  # a file system without links
        import shutil

        try:
            shutil.copy2(entry.target, backup)
        except OSError:
            beside.discard(backup)
            raise
    return [Staged(entry.name, entry.target, backup)]


def _undo(done: Sequence[Staged], kept: Sequence[Staged]) -> list[str]:
    """Takes back what was put in place; the names of what could not be."""
    backups = {entry.target: entry.temporary for entry in kept}
    remaining = []
    for entry in done:
        try:
            if entry.target in backups:
                backups[entry.target].replace(entry.target)
            else:
                entry.target.unlink()
        except OSError:
            remaining.append(entry.name)
    return remaining
