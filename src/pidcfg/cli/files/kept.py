"""The file of ``--resume``: read whole, replaced whole."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import click

from pidcfg.cli.files.outputs import place
from pidcfg.cli.files.temporary import discard, temporary_for
from pidcfg.reader import read_file

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def kept(name: str) -> bytes | None:
    """What the file holds; None: it is not there yet."""
    try:
        return read_file(place(name))
    except FileNotFoundError:
        return None
    except OSError as error:
        raise click.ClickException(f"cannot read {name}: {error.strerror or error}") from None


def keeper(name: str) -> Callable[[bytes], None]:
    """What writes the file; a reader sees the old content or the new one, whenever the writer is stopped."""
    target = place(name)
    if not target.parent.is_dir():
        raise click.ClickException(f"the folder {target.parent} of {name} does not exist; make it first")

    def keep(data: bytes) -> None:
        temporary: Path | None = None
        try:
            handle, temporary = temporary_for(target)
            with os.fdopen(handle, "wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(target)
        except OSError as error:
            raise click.ClickException(f"cannot write {name}: {error.strerror or error}") from None
        finally:
            if temporary is not None:
                discard(temporary)

    return keep
