"""Files that people rely on: all written or none, never half, never over one that differs without being told."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from collections.abc import Mapping


def write_files(files: Mapping[str, str], *, force: bool = False) -> None:
    """Writes texts to paths: first everything to temporary files beside the targets, then each in place."""
    for name, text in files.items():
        _refuse_different(Path(name), text.encode(), force=force)
    staged: list[tuple[str, Path]] = []
    try:
        for name, text in files.items():
            staged.append((_stage(Path(name), text.encode()), Path(name)))
        for temporary, target in staged:
            Path(temporary).replace(target)
    except OSError as error:
        raise click.ClickException(f"cannot write {error.filename or ''}: {error.strerror}") from None
    finally:
        for temporary, _ in staged:
            Path(temporary).unlink(missing_ok=True)


def _refuse_different(target: Path, content: bytes, *, force: bool) -> None:
    try:
        differs = target.exists() and target.read_bytes() != content
    except OSError as error:
        raise click.ClickException(f"cannot read {target}: {error.strerror}") from None
    if differs and not force:
        raise click.ClickException(f"{target} exists and differs; use --force to overwrite it")


def _stage(target: Path, content: bytes) -> str:
    """A flushed temporary file in the target's folder, with the rights a new file would have."""
    handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    with os.fdopen(handle, "wb") as stream:
        stream.write(content)
        stream.flush()
        os.fsync(stream.fileno())
    if os.name == "posix":
        umask = os.umask(0)
        os.umask(umask)
        Path(name).chmod(0o666 & ~umask)
    return name
