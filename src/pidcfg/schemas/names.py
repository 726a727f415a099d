"""Names that were probably meant."""

from __future__ import annotations

import difflib
from itertools import takewhile
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable


SPOKEN = (
    ({"p", "kp", "kc", "pgain", "gain"}, ("gain", "proportional_gain", "Kp", "Kc_Kp")),
    (
        {"i", "ti", "tn", "reset", "resettime", "integral", "integraltime"},
        ("reset", "reset_time", "integral_time", "Ti_Ki"),
    ),
    ({"d", "td", "tv", "rate", "derivative", "derivativetime"}, ("rate", "derivative_time", "Td_Kd")),
    ({"sp", "sv", "setpoint"}, ("setpoint", "SP", "SV", "set: {setpoint: …}")),
    ({"mv", "cv", "out", "output"}, ("output", "set: {output: …}")),
    ({"ll", "lolo"}, ("low_low",)),
    ({"l", "lo"}, ("low",)),
    ({"h", "hi"}, ("high",)),
    ({"hh", "hihi"}, ("high_high",)),
    ({"time", "t", "when"}, ("at",)),
)
"""What engineers call a setting, and the keys that it has, of which a place knows one."""
BETWEEN = str.maketrans("", "", "-_ ")


def folded(word: str) -> str:
    """A word without capitals, hyphens, underscores and blanks."""
    return word.casefold().translate(BETWEEN)


def spoken(key: str, known: Collection[str]) -> str | None:
    """The known key that a word of the field stands for; None where there is none."""
    names = next((names for words, names in SPOKEN if folded(key) in words), ())
    return next((name for name in names if name in known), None)


def nearest(word: str, names: Iterable[str]) -> str | None:
    """The name that was probably meant: the most alike, of equals the one that begins alike."""
    near = difflib.get_close_matches(word, names, 4, 0.5)
    likeness = difflib.SequenceMatcher(b=word)

    def rank(name: str) -> tuple[float, int]:
        likeness.set_seq1(name)
        alike = takewhile(lambda pair: pair[0] == pair[1], zip(name, word, strict=False))
        return likeness.ratio(), sum(1 for _ in alike)

    return max(near, key=rank, default=None)
