"""What was read for an input, so that its findings can be kept for as long as all of that is the same."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from pidcfg.cli.files.inputs import FILES

if TYPE_CHECKING:
    from pidcfg.reader import Reader


@dataclass(slots=True)
class Reads:
    """What a check reads besides its input: by the name that the input calls a file, a hash of its bytes."""

    name: str
    """Of the input."""
    reader: Reader = FILES
    called: dict[str, str] = field(default_factory=dict)
    """What the input calls a file, by the name under which it was read."""
    hashes: dict[str, str] = field(default_factory=dict)
    known: bool = True
    """Whether all that was read is known by what the input calls it, and could be read."""

    def resolve(self, name: str, other: str) -> str:
        """As the reader does it."""
        resolved = self.reader.resolve(name, other)
        if name == self.name:
            self.called[resolved] = other
        return resolved

    def read(self, name: str, most: int) -> bytes:
        """As the reader does it."""
        try:
            data = self.reader.read(name, most)
        except (OSError, ValueError):
            self.known = False
            raise
        if name in self.called:
            self.hashes[self.called[name]] = hash_of(data)
        else:
            self.known = False
        return data


def hash_of(data: bytes) -> str:
    """The SHA-256 of some bytes in hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()
