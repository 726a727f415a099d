"""Files that people rely on: all written or none, never half, never over one that differs without being told."""

from __future__ import annotations

import os
import re
import stat
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping


STREAM = re.compile(r"/dev/(?:std(?:in|out|err)|fd/.*)|/proc/[^/]+/fd/.*")
"""Names of what a process has open: a file can take the place of none."""


def write_files(files: Mapping[str, str | bytes], *, force: bool = False, renewed: Collection[str] = ()) -> None:
    """Writes texts or bytes to paths: first everything to temporary files beside the targets, then each in place.

    ``renewed`` are paths that are written anew by every run, such as reports for CI.
    """
    contents = {name: file.encode() if isinstance(file, str) else file for name, file in files.items()}
    targets = {name: _target(name, content, force=force or name in renewed) for name, content in contents.items()}
    staged: list[tuple[str, str]] = []
    name = ""
    try:
        for name, content in contents.items():
            staged.append((_stage(targets[name], content), name))
        for temporary, name in staged:
            Path(temporary).replace(targets[name])
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    finally:
        for temporary, _ in staged:
            Path(temporary).unlink(missing_ok=True)


def _instead(name: str) -> str:
    """What to do instead of writing to a device: the option ``-o`` can be left out."""
    context = click.get_current_context(silent=True)
    out = context.params.get("out") if context is not None else None
    return "without -o the result goes to standard output" if out == name else "name a file"


def _target(name: str, content: bytes, *, force: bool) -> Path:
    """Where a file is written, through a link; refused when it differs, and when it is a device, a pipe or a folder."""
    if not name:
        raise click.ClickException("the output has no name")
    if STREAM.fullmatch(name):
        raise click.ClickException(f"{name} is a stream and no file; {_instead(name)}")
    try:
        target = Path(name).resolve()
        if not target.exists():
            return target
        if not target.is_file():
            raise click.ClickException(f"{name} is no regular file; {_instead(name)}")
        differs = target.stat().st_size != len(content) or target.read_bytes() != content
    except (OSError, RuntimeError) as error:
        raise click.ClickException(f"cannot write {name}: {getattr(error, 'strerror', None) or error}") from None
    if differs and not force:
        raise click.ClickException(f"{name} exists and differs; use --force to overwrite it")
    return target


def _stage(target: Path, content: bytes) -> str:
    """A flushed temporary file in the target's folder, with the rights of the file it replaces, or of a new one."""
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    with os.fdopen(handle, "wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    if os.name == "posix":
        umask = os.umask(0)
        os.umask(umask)
        Path(name).chmod(stat.S_IMODE(target.stat().st_mode) if target.exists() else 0o666 & ~umask)
    return name
