"""What the loops of a PLC do, row by row: the result of `pidcfg.trend`."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.listing import csv_lines
from pidcfg.encoders.regmap import decode_one
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.live.link import Link
from pidcfg.live.pull import listing
from pidcfg.live.running import run
from pidcfg.refs import Decision
from pidcfg.results.findings import errors_in, findings_data
from pidcfg.results.words import DecodeOptions, decoded
from pidcfg.schemas.base import decimal_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.encoders.image import Block
    from pidcfg.encoders.regmap import Word
    from pidcfg.limits import Limits
    from pidcfg.live.link import Patience
    from pidcfg.live.pull import Source
    from pidcfg.live.reading import Registers
    from pidcfg.results.findings import Data
    from pidcfg.sim.trace import Sink

D874 = Decision(
    874,
    "what a trend of a PLC has of a loop",
    "PV, SP and output as their registers say, on the ranges of the file, and the mode where a register tells it: +06 "
    "of a DL06. The help names no register of a CLICK that does, so that its trends have no such column. SP is the "
    "register of the loop, also where a loop in Cascade takes another one's output.",
    "A mode that is guessed from requests would be wrong whenever one was refused.",
)
SIGNALS = {"state.pv": "PV", "setpoint.value": "SP", "state.output": "OUT"}
"""What becomes of the registers with these paths."""
MODE = "MODE"


class Channel(NamedTuple):
    """A column: its title, and the register with what it is on."""

    title: str
    number: int
    word: Word
    block: Block


@dataclass(frozen=True, slots=True)
class TrendResult:
    """What was recorded."""

    plc: str
    """The PLC, as ``10.0.0.5:502``."""
    findings: tuple[Diagnostic, ...] = ()
    """What is wrong with the configuration, or with the words; empty: it was recorded."""
    columns: tuple[str, ...] = ()
    rows: int = 0
    notes: tuple[str, ...] = ()

    @property
    def ok(self) -> bool:
        """Whether there was something to record."""
        return not self.findings

    def to_json(self) -> Data:
        """How many rows of which columns; where there are none, the errors."""
        if not self.ok:
            return findings_data(errors_in(self.findings))
        return {"version": 1, "plc": self.plc, "columns": list(self.columns), "rows": self.rows}


@dataclass(frozen=True, slots=True)
class Recording:
    """How a trend is taken: s between two rows, s altogether (None: until it is interrupted), and who gets what."""

    sink: Sink
    interval: float
    seconds: float | None
    taken: Callable[[float, Mapping[str, str]], None]
    """Called after each row with its time and its values."""


def recorded(source: Source, recording: Recording, patience: Patience, limits: Limits) -> TrendResult:
    """Records until the end or an interrupt, which keeps every row; raises `PlcError`, with the rows written too."""
    if source.like is not None and source.image is None:
        return TrendResult(str(source.address), tuple(errors_in(source.like.findings)))
    return run(_record(source, recording, patience, limits))


async def _record(source: Source, recording: Recording, patience: Patience, limits: Limits) -> TrendResult:
    result = TrendResult(str(source.address))
    async with Link(source.address, patience) as link:
        registers = source.registers
        image = await registers.image(link)
        options = DecodeOptions(like=source.like, write=False)
        held = decoded([(listing(image), result.plc)], source.vendor, options, source.texts, limits)
        if held.data is None:
            return replace(result, findings=held.findings)
        encoding = source.vendor.encoder(read_settings(source.vendor.model, held.data, "the PLC"))
        channels = [channel for block in encoding.blocks for channel in _channels(block, source)]
        columns = ("time", *(channel.title for channel in channels))
        result = replace(result, columns=columns)
        recording.sink.write(csv_lines([columns]))
        rows = 0
        try:
            async for at, words in _readings(link, registers, channels, recording):
                values = [_shown(channel, words[channel.number], source) for channel in channels]
                recording.sink.write(csv_lines([[f"{at:.3f}", *values]]))
                rows += 1
                recording.taken(at, dict(zip(columns[1:], values, strict=True)))
        except asyncio.CancelledError:  # somebody has pressed Ctrl-C: what is there stays
            pass
        return replace(result, rows=rows)


async def _readings(link: Link, registers: Registers, channels: Sequence[Channel], recording: Recording) -> Any:
    """The words of all channels again and again, with the time of each reading since the first."""
    spans: dict[int, list[int]] = {}
    for channel in channels:
        spans.setdefault(channel.block.start, []).append(channel.number)
    numbers = [n for span in spans.values() for n in range(min(span), max(span) + 1)]
    begin, due, zero = time.monotonic(), 0.0, None
    while recording.seconds is None or due <= recording.seconds:
        await asyncio.sleep(max(0.0, begin + due - time.monotonic()))
        words = await registers.words(link, numbers)
        at = time.monotonic()  # a request that was sent again has made it late
        zero = at if zero is None else zero
        yield at - zero, words
        late = time.monotonic() - begin - due
        due += recording.interval * max(1, -(-late // recording.interval))


def _channels(block: Block, source: Source) -> Iterator[Channel]:
    """The columns of a loop, as far as this block has them."""
    if block.loop is None or block.prefix:
        return
    for word in block.table.words:
        signal = MODE if word.name == source.vendor.load("mode_register") else SIGNALS.get(str(word.path))
        if signal is not None:
            yield Channel(f"{block.loop}.{signal}", block.start + word.offset, word, block)


def _shown(channel: Channel, raw: int, source: Source) -> str:
    """A register as the trend has it; empty: its content is no value."""
    if channel.title.endswith(f".{MODE}"):
        return str(source.vendor.load("mode_of")(raw))
    try:
        value = decode_one(channel.word.codec, raw, channel.block.scales)
    except DecodeError:
        return ""
    return decimal_text(getattr(value, "value", value))
