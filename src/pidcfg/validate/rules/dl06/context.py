"""What the DL06 rules look at: each loop with its scales and the counts that its words hold."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from pidcfg.diagnostics import Path
from pidcfg.encoders.dl06 import LOOP_SIZE, loop_start, scales_of
from pidcfg.encoders.image import Encoding
from pidcfg.encoders.maps.dl06 import LOOP_TABLE
from pidcfg.encoders.scales import Position, Scale
from pidcfg.schemas.dl06 import Dl06File, Loop


@dataclass(frozen=True)
class LoopView:
    """A loop, its place in the file and its encoded words."""

    index: int
    loop: Loop
    words: dict[str, int]
    misfit: frozenset[str]

    @property
    def path(self) -> Path:
        """Where the loop stands."""
        return ("loops", self.index)

    @cached_property
    def scales(self) -> dict[str, Scale]:
        """The scales its registers are on: ``pv``, ``sp``, ``output``."""
        return scales_of(self.loop)

    def counts(self, name: str) -> int | None:
        """The number of counts in a scaled register (signed in bipolar formats); None when its value does not fit."""
        if name in self.misfit:
            return None
        codec = LOOP_TABLE.word(name).codec
        if isinstance(codec, Position):
            return int(self.scales[codec.scale].format.codec.decode(self.words[name]))
        return self.words[name]


@dataclass(frozen=True)
class Dl06Context:
    """A configuration, its image, and its loops one by one."""

    config: Dl06File
    encoding: Encoding

    @cached_property
    def loops(self) -> tuple[LoopView, ...]:
        """The loops in the order of the table."""
        words = self.encoding.image.words
        misfits = [(path[:2], m.word.name) for path, m in self.encoding.misfits]
        return tuple(
            LoopView(
                i,
                loop,
                {w.name: words[loop_start(self.config.plc, i) + w.offset] for w in LOOP_TABLE.words},
                frozenset(name for place, name in misfits if place == ("loops", i)),
            )
            for i, loop in enumerate(self.config.loops)
        )

    @property
    def table(self) -> tuple[int, int]:
        """First and last address of the loop table."""
        start = self.config.plc.loop_table
        return start, start + max(len(self.config.loops), 1) * LOOP_SIZE - 1
