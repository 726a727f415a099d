"""Words about a PV of which the loop takes the root: they are compared with the signal before it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pidcfg.explanation.values import is_before_root, share_before_root

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from decimal import Decimal

    from pidcfg.encoders.image import Block, Encoding
    from pidcfg.encoders.regmap import Word
    from pidcfg.report.content import Group, Setting

SIGNAL = "% of the signal before the root"
LINEAR = "of a linear PV"


@dataclass(frozen=True, slots=True)
class BeforeRoot:
    """What a word means there: a share of the signal, and the PV at which the signal has it (None: a difference)."""

    percent: Decimal
    value: Decimal | None
    per: str = ""
    """What a change is counted in: ``sample``."""

    @property
    def unit(self) -> str:
        """The unit of the share."""
        return f"{SIGNAL} per {self.per}" if self.per else SIGNAL

    def reached(self, unit: str) -> str:
        """Where the PV is then, as a clause; empty for a difference."""
        return "" if self.value is None else f"reached at {self.value:.4g} {unit}".rstrip()


def word_before_root(word: Word, block: Block, raw: int) -> BeforeRoot | None:
    """A content before the root; None where the word is about something else."""
    if not is_before_root(word, block.scales):
        return None
    percent, value = share_before_root(word, raw, block.scales)
    return BeforeRoot(round(percent, 2), value, word.unit.partition("/")[2])


def loop_words(encoding: Encoding, loop: int) -> Iterator[tuple[Block, Word, int]]:
    """The registers of a loop's own blocks, by its number, with their contents."""
    memory = encoding.image.words
    for block in encoding.blocks:
        if block.place == ("loops", loop):
            yield from ((block, word, memory.get(block.start + word.offset, 0)) for word in block.table.words)


def settings_before_root(encoding: Encoding, loop: int) -> dict[str, BeforeRoot]:
    """The settings of a loop, by its number, that are compared with the signal before the root."""
    shares = ((word.path, word_before_root(word, block, raw)) for block, word, raw in loop_words(encoding, loop))
    return {path: share for path, share in shares if path is not None and share is not None}


def with_shares(groups: tuple[Group, ...], shares: Mapping[str, BeforeRoot], unit: str) -> tuple[Group, ...]:
    """The settings with what they mean before the root; ``unit``: that of the PV."""
    return tuple(
        replace(group, settings=tuple(_with_share(s, shares.get(s.path), unit) for s in group.settings))
        for group in groups
    )


def _with_share(setting: Setting, before: BeforeRoot | None, unit: str) -> Setting:
    if before is None:
        return setting
    reached = before.reached(unit)
    linear = f"{setting.unit} {LINEAR}" if setting.unit == unit else setting.unit
    per = f" per {before.per}" if before.per else ""
    meaning = f"{setting.meaning} Compared with the signal before the root: {before.percent} % of it{per}"
    return replace(setting, unit=linear, meaning=f"{meaning}{f', {reached}' if reached else ''}.")
