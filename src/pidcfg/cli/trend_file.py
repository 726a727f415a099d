"""A trend on its way to a file: written as it comes to a temporary file beside the target, then put in its place."""

from __future__ import annotations

import filecmp
import os
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from pidcfg.cli.outputs import write_files

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


@contextmanager
def trend_file(
    name: str | None, *, force: bool, beside: Mapping[str, str | bytes] | None = None
) -> Iterator[TextIO | None]:
    """An open stream for a trend (None without a name); the target appears when a run has come to its end.

    Files that are ``beside`` it by then are written too: all or none.
    """
    if name is None:
        yield None
        write_files(beside or {}, force=force)
        return
    target = Path(name)
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        if Path(temporary).stat().st_size:
            _check(Path(temporary), target, force=force)
            write_files(beside or {}, force=force)
            _put(Path(temporary), target)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    finally:
        Path(temporary).unlink(missing_ok=True)


def _check(temporary: Path, target: Path, *, force: bool) -> None:
    """Refuses to replace a different file."""
    if target.exists() and not force and not filecmp.cmp(temporary, target, shallow=False):
        raise click.ClickException(f"{target} exists and differs; use --force to overwrite it")


def _put(temporary: Path, target: Path) -> None:
    """Moves the file in place, with the rights a new file would have."""
    if os.name == "posix":
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
    temporary.replace(target)
