"""A trend on its way to a file: written as it comes to a temporary file beside the target, then put in its place."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING, TextIO

import click

from pidcfg.cli.files.outputs import Staged, discard, place, refuse_read, take_rights, write_files
from pidcfg.cli.files.temporary import temporary_for

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping


@contextmanager
def trend_file(
    name: str | None, *, force: bool, others: Mapping[str, str | bytes] | None = None
) -> Iterator[TextIO | None]:
    """An open stream for a trend (None without a name); the target appears when a run has come to its end.

    The ``others``, files by name, are written with it: all or none.
    """
    if name is None:
        yield None
        write_files(others or {}, force=force)
        return
    target = place(name)
    refuse_read([name])
    try:
        handle, temporary = temporary_for(target)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    staged = [Staged(name, target, temporary)]
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        if temporary.stat().st_size:
            take_rights(temporary, target)
            write_files(others or {}, force=force, streamed=staged)
    except OSError as error:
        raise click.ClickException(f"cannot write {name}: {error.strerror}") from None
    finally:
        discard(staged)
