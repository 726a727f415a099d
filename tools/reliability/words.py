"""Every register word there and back by the product's own codecs: the same word, or a declared error.

A field of up to 16 bits gets every word, a wider one drawn patterns and made ones; a row on a scale gets another scale
each time. Numbers are encoded, too (`reliability.rounding`). An execution is one decode or one
encode of one field.
"""

from __future__ import annotations

import random
import traceback
from dataclasses import dataclass, field
from typing import Any

from pidcfg.encoders.codecs import WORD_MAX, DecodeError, EncodeError
from reliability import rounding
from reliability.fields import Pair, fields

WORDS = range(WORD_MAX + 1)
PATTERNS = 60_000
"""Drawn for a field of more than 16 bits, each time."""
MADE = [sign << 31 | power << 23 | part for sign in (0, 1) for power in range(256)
        for part in (0, 1, 2, 0x3FFFFF, 0x400000, 0x400001, 0x7FFFFE, 0x7FFFFF)]  # fmt: skip
"""Patterns of single precision: both signs, every exponent, the ends and the middle of the fraction."""
SHOWN = 3
"""Faults of a field that are told."""


@dataclass
class Found:
    """What was executed, and what did not come back."""

    fields: int = 0
    executions: int = 0
    refused: int = 0
    rounded: int = 0
    failures: list[str] = field(default_factory=list)


class Words:
    """All fields one after the other, then again and again those that are drawn."""

    def __init__(self, seed: int) -> None:
        self.seed = seed
        self.fields = fields()
        self.drawn = [each for each in self.fields if each.drawn]
        self.found = Found()

    def run(self, number: int) -> None:
        """One field with all its words."""
        more = number - len(self.fields)
        one = self.fields[number] if more < 0 else self.drawn[more % len(self.drawn)]
        rng = random.Random(f"{self.seed} words {number}")
        self.found.fields += 1
        try:
            pair = one.pair(rng)
            faults = self._there_and_back(pair, _patterns(one.bits, rng))
            if pair.known:
                faults += self._numbers(pair, pair.known, rng)
        except Exception:  # noqa: BLE001 - whatever is raised is a finding
            faults = [traceback.format_exc().strip().replace("\n", " | ")[-400:]]
        self.found.failures += [f"words {self.seed} {number} {one.name}: {fault}" for fault in faults[:SHOWN]]

    def _there_and_back(self, pair: Pair, words: Any) -> list[str]:
        decode, encode, same, _ = pair
        faults, refused, executions = [], 0, 0
        for word in words:
            executions += 1
            try:
                value = decode(word)
            except DecodeError:
                refused += 1
                continue
            executions += 1
            try:
                back = encode(value)
            except EncodeError as error:  # what means nothing may stand in a word all the same
                back = error.stored if error.stored is not None else -1
            if back != same(word):
                faults.append(f"0x{word:X} is {value!r} and comes back as 0x{back:X}")
        self.found.executions += executions
        self.found.refused += refused
        return faults

    def _numbers(self, pair: Pair, known: rounding.Rounding, rng: random.Random) -> list[str]:
        faults = []
        for _ in range(rounding.DRAWN):
            value = known.drawn(rng)
            self.found.executions += 1
            self.found.rounded += 1
            try:
                word = pair.encode(value)
            except EncodeError as error:
                fault = None if known.refuses(value, error.fault) else f"{value} is refused: {error}"
            else:
                fault = None if known.is_nearest(value, word) else f"{value} becomes 0x{word:X}"
            faults += [fault] if fault else []
        return faults


def _patterns(bits: int, rng: random.Random) -> Any:
    if bits <= 16:
        return WORDS if bits == 16 else range(1 << bits)
    made = MADE if bits == 32 else [word << 32 for word in MADE]
    return [*made, *(rng.getrandbits(bits) for _ in range(PATTERNS))]
