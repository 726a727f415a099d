"""Names that were probably meant."""

from __future__ import annotations

import difflib
from itertools import takewhile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def nearest(word: str, names: Iterable[str]) -> str | None:
    """The name that was probably meant: the most alike, of equals the one that begins alike."""
    near = difflib.get_close_matches(word, names, 4, 0.5)
    likeness = difflib.SequenceMatcher(b=word)

    def rank(name: str) -> tuple[float, int]:
        likeness.set_seq1(name)
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(name, word, strict=False))
        return likeness.ratio(), sum(1 for _ in alike)

    return max(near, key=rank, default=None)
