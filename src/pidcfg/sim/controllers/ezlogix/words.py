"""From the registers and discretes of a loop, and its dialog, to the numbers that the controller calculates with."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any, cast

from pidcfg.encoders.ezlogix.encode import scales_of
from pidcfg.encoders.maps.ezlogix import BLOCKS, LEAST_SAMPLE_RATE, R_BLOCK, S_BLOCK, SPACE
from pidcfg.schemas.ezlogix import CV_FULL, TAG, LoopSettings
from pidcfg.sim.plc import TICKS, low_and_width
from pidcfg.sim.records import read_registers
from pidcfg.sim.terms import clamp

if TYPE_CHECKING:
    from collections.abc import Mapping
    from decimal import Decimal

    from pidcfg.encoders.regmap import Codec, RegisterMap
    from pidcfg.encoders.scales import Scale
    from pidcfg.sim.controllers.ezlogix.state import Config, State

UNKNOWN_PERIOD = 50_000
"""Ticks that stand for the sample rate of a loop that is not calculated."""


@dataclass(slots=True)
class Loop:
    """A loop's registers and discretes, and what its dialog alone holds."""

    dialog: LoopSettings
    registers: list[int]
    discretes: list[int]

    def word(self, name: str) -> int:
        """The raw content of a register."""
        return self.registers[R_BLOCK.offset(name)]

    def bit(self, name: str) -> int:
        """The state of a discrete."""
        return int(self.discretes[S_BLOCK.offset(name)] != 0)

    def values(self) -> dict[str, Any]:
        """What registers and discretes hold, in counts, and what the dialog says, by name."""
        discretes = {row.name: self.bit(row.name) for row in S_BLOCK.words}
        choices = {"action": self.dialog.action, "algorithm": self.dialog.algorithm}
        return {row.name: self.word(row.name) for row in R_BLOCK.words} | discretes | choices

    def time(self, name: str) -> Decimal:
        """A time in seconds."""
        codec = cast("Codec", R_BLOCK.word(name).codec)
        value: Decimal = codec.decode(self.word(name))
        return value

    def scales(self) -> dict[str, Scale]:
        """The scales of the loop's registers in engineering units."""
        return scales_of(self.dialog.pv, self.dialog.output, root=bool(self.bit("square_root")))

    def write(self, row: str, raw: int) -> None:
        """The raw content of a register or a discrete."""
        block, table = (self.registers, R_BLOCK) if row in REGISTER_NAMES else (self.discretes, S_BLOCK)
        block[table.offset(row)] = raw


REGISTER_NAMES = frozenset(word.name for word in R_BLOCK.words if word.access != "reserved")


def block_of(words: Mapping[int, int], prefix: str, first: int, table: RegisterMap) -> list[int]:
    """A block of registers; what lies beyond the end of its bank counts as 0."""
    bank = next(bank for bank in SPACE.banks if bank.prefix == prefix)
    start = SPACE.number(prefix, first)
    return [words.get(start + k, 0) if first + k <= bank.last else 0 for k in range(table.size)]


def loop_of(words: Mapping[int, int], dialog: LoopSettings) -> Loop:
    """A loop from the memory."""
    blocks = {key: block_of(words, prefix, getattr(dialog, key), table) for key, (prefix, table) in BLOCKS.items()}
    return Loop(dialog, blocks["registers"], blocks["discretes"])


def ticks(seconds: Any) -> int:
    """Seconds as ticks."""
    return int(seconds * TICKS)


def configure(c: Config, loop: Loop, *, goes_on: bool) -> None:
    """A loop's `Config`; values beyond the manual's ranges are taken as they are (D171)."""
    dialog = loop.dialog
    read_registers(c, loop.values())
    low, high = dialog.pv.counts or (0, CV_FULL)
    c.pv_min, c.pv_max, c.pv_span = float(low), float(high), float(high - low)
    c.pv_low, c.pv_width = low_and_width(dialog.pv.range, c.pv_min, c.pv_span)
    c.out_low, c.out_width = low_and_width(dialog.output.range, 0.0, float(CV_FULL))
    c.halt = int(loop.word("sample_rate") < LEAST_SAMPLE_RATE)  # a sample rate below 0.05 s is none (D162)
    c.period = UNKNOWN_PERIOD if c.halt else ticks(loop.time("sample_rate"))
    c.goes_on = int(goes_on)
    c.sees_pv = int(dialog.pv.tag.startswith("IR"))
    c.drives = int(dialog.output.tag.startswith("OR") or dialog.output.pulse is not None)
    c.scale = sqrt(c.pv_span) if c.root else 1.0
    c.m_low, c.m_high = (clamp(float(loop.word(name)), 0.0, float(CV_FULL)) for name in ("cv_low", "cv_high"))
    c.timeout = ticks(loop.word("autotune_timeout"))
    c.cycle = 0 if dialog.output.pulse is None else ticks(loop.time("cycle_time"))
    c.min_on, c.min_off = ticks(loop.time("min_on")), ticks(loop.time("min_off"))


def tuning(c: Config, s: State, loop: Loop) -> None:
    """The gain registers and the sample rate."""
    s.gain = float(loop.time("proportional_gain"))
    s.reset = float(loop.time("integral_time"))
    s.rate = float(loop.time("derivative_time"))
    s.period = c.period


def absorb(loop: Loop, s: State) -> None:
    """Put what the PLC has written into the registers: results of an autotune, a set point within its limits."""
    loop.write("setpoint", int(s.sp))
    loop.write("proportional_gain", round(s.gain * 100))
    loop.write("integral_time", round(s.reset * 10))
    loop.write("derivative_time", round(s.rate * 10))


def tag_number(tag: str) -> int | None:
    """The plain number of an R register; None for a physical tag."""
    match = TAG.fullmatch(tag)
    return SPACE.number("R", int(match.group(2))) if match and match.group(1) == "R" else None
