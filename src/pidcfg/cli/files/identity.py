"""What tells files apart, by whatever name they are called, and which of them the running command has read."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import click

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import IO

Identity: TypeAlias = "str | tuple[int, int]"
READ = "pidcfg.files_read"
"""Where a command keeps the identities of its inputs."""
NAMES = "pidcfg.names_read"
"""Where it keeps their names, and those of files that it looked for."""
EXCLUDED = "pidcfg.files_excluded"
"""Where it keeps what it leaves out of folders."""


class Exclusion(NamedTuple):
    """Patterns of files that are left out, the folder that they begin at, and what reasons call them."""

    root: Path
    origin: str
    patterns: tuple[str, ...]


def identity(name: str) -> Identity:
    """A file's own number; where there is none yet, the place where it would be."""
    try:
        status = Path(name).stat()
    except (OSError, ValueError):
        return os.path.normcase(os.path.realpath(name))
    return (status.st_dev, status.st_ino)


def one_file(names: Iterable[str]) -> str | None:
    """What is wrong with the names of outputs where two of them mean one file."""
    names_of: dict[Identity, str] = {}
    for name in names:
        place = identity(name)
        if place in names_of:
            return f"{names_of[place]} and {name} are one file; name two"
        names_of[place] = name
    return None


def remember(stream: IO[bytes]) -> None:
    """Notes an open file as an input of the running command."""
    ctx = click.get_current_context(silent=True)
    if ctx is None:
        return
    try:
        status = os.fstat(stream.fileno())
    except (OSError, ValueError):  # standard input that is no file
        return
    files_read(ctx).add((status.st_dev, status.st_ino))


def mention(name: str) -> None:
    """Notes the name of a file that the running command reads or looks for."""
    ctx = click.get_current_context(silent=True)
    if ctx is not None:
        ctx.meta.setdefault(NAMES, set()).add(name)


def note_read(name: str) -> None:
    """Notes a file that another process has read for the running command."""
    ctx = click.get_current_context(silent=True)
    if ctx is not None and name:
        mention(name)
        files_read(ctx).add(identity(name))


def was_read(name: str) -> bool:
    """Whether the running command has read this file."""
    ctx = click.get_current_context(silent=True)
    return ctx is not None and identity(name) in files_read(ctx)


def files_read(ctx: click.Context) -> set[Identity]:
    """The identities of the command's inputs so far."""
    identities: set[Identity] = ctx.meta.setdefault(READ, set())
    return identities


def relative(file: str, folder: Path) -> str:
    """A file's path seen from a folder, with forward slashes; as it is where there is no such path."""
    try:
        return Path(os.path.relpath(file, folder)).as_posix()
    except ValueError:
        return Path(file).as_posix()
