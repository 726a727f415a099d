"""The PID errors of the CLICK in words: the register, and what it may hold."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.maps.click import TABLES
from pidcfg.encoders.words import Implied

if TYPE_CHECKING:
    from pidcfg.encoders.maps.click import PidError

WORDS = {word.name: word for table in TABLES for word in table.words}
LABELS = {word.name: table.at(word.offset) for table in TABLES for word in table.words}


def in_words(error: PidError) -> str:
    """An error with its register and what that may hold."""
    return f"PID error {error.number}: {condition(error)}"


def condition(error: PidError) -> str:
    """What is wrong: the register, and what it may hold."""
    where = f"{error.title} ({LABELS[error.register]})"
    unit = f" {WORDS[error.register].unit}".rstrip().replace(" pv", "")
    codec = WORDS[error.register].codec
    if isinstance(codec, Implied) and codec.decimals and error.low is not None and error.high is not None:
        held = f"{error.low / codec.step:f} to {error.high / codec.step:f} ms"
        return f"{where} is not within {held} ({error.low} to {error.high}{unit})"
    if error.low is None:
        return where
    if error.high is None:
        return f"{where} is below {error.low}{unit} or not a number"
    return f"{where} is not within {error.low} to {error.high}{unit}"
