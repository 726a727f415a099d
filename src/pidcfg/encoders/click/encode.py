"""A CLICK configuration to its C, DS and DF registers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.mapping import is_enabled
from pidcfg.encoders.mapping import values_of as mapped
from pidcfg.encoders.maps.click import BANKS, BLOCKS, SPACE, TABLES, UNUSED
from pidcfg.encoders.settings import settings_of
from pidcfg.encoders.values import Data, present
from pidcfg.schemas.click import LoopSettings

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.schemas.click import ClickFile, Loop

EXPLICIT = frozenset({"output.pwm"})
"""No register holds whether the output is pulsed."""


def encode(config: ClickFile) -> Encoding:
    """The three blocks of every loop; requests and what the help does not name are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _blocks(i, loop))
    settings = tuple(settings_of(LoopSettings, loop, BANKS, EXPLICIT) for loop in config.loops)
    return Encoding("click", blocks, SPACE, settings, present({"name": config.name, "description": config.description}))


def _blocks(i: int, loop: Loop) -> Iterator[Block]:
    values = values_of(loop)
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, {}), loop.name)


def values_of(loop: Loop) -> Data:
    """Every register's value by path; the rate-of-change alarm is that of one sample."""
    rate = loop.alarms.rate_of_change
    per_sample = None if rate is None else rate.per_sample(loop.sample_rate).value
    return {**mapped(loop, TABLES, UNUSED), "alarms.rate_of_change": per_sample}


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    return is_enabled(loop, "alarms.pv.enabled")


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    return is_enabled(loop, "alarms.deviation.enabled")
