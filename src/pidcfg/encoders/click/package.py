"""How pyclickplc is asked: it works on paths and trusts what it reads, so it gets a file of its own and is checked."""

from __future__ import annotations

import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from pidcfg.encoders.listing import ListingError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

T = TypeVar("T")


@contextmanager
def scratch() -> Iterator[Path]:
    """A path of a file that is gone afterwards; never one of the user's."""
    try:
        with tempfile.TemporaryDirectory(prefix="pidcfg-") as folder:
            yield Path(folder) / "file"
    except OSError as error:
        raise ListingError(f"no temporary file can be used: {error.strerror or error}") from None


def read_with(read: Callable[[Path], T], content: bytes) -> T:
    """What pyclickplc reads from this content; whatever it raises is a listing that cannot be read."""
    with scratch() as path:
        path.write_bytes(content)
        try:
            return read(path)
        except (ValueError, LookupError, OverflowError) as error:
            raise ListingError(f"pyclickplc refuses the file: {error}") from None


def written_by(write: Callable[[Path], object]) -> bytes:
    """The bytes that pyclickplc writes."""
    with scratch() as path:
        write(path)
        return path.read_bytes()
