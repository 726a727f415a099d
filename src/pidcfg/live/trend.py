"""What the loops of a PLC do, row by row: `pidcfg.trend`."""

from __future__ import annotations

import asyncio
import time
from contextlib import suppress
from dataclasses import replace
from decimal import Decimal
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.image import read_settings
from pidcfg.encoders.listing import csv_lines
from pidcfg.encoders.modbus_map import NamedNumbering
from pidcfg.encoders.parameters import register_content
from pidcfg.live.link import Link, run_async
from pidcfg.live.pull import plc_of, retry_policy
from pidcfg.live.reading import register_encoder_of
from pidcfg.output.arguments import ArgumentError, check_arguments
from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.output.words import DecodeOptions, decode_files
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DEFAULT, Limits
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.live.link import RetryPolicy
    from pidcfg.live.pull import Plc
    from pidcfg.live.reading import Registers
    from pidcfg.schemas.iec import IecType
    from pidcfg.sim.engine.run import Sink
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Files
    from pidcfg.validate.engine import Source
    from pidcfg.vendors import Vendor

D874 = Decision(
    874,
    "what a trend of a PLC has of a loop",
    "PV, SP and output as their registers say, on the ranges of the file, and the mode where a register tells it: +06 "
    "of a DL06, and of a CLICK two bits whose rows say that they are unconfirmed (D952). SP is the register of the "
    "loop, also where a loop in Cascade takes another one's output.",
    "A mode that is guessed from requests would be wrong whenever one was refused.",
)
COLUMN_TITLES = {"state.pv": "PV", "setpoint.value": "SP", "state.output": "OUT"}
"""What becomes of the registers with these paths."""
MODE_TITLE = "MODE"


class Channel(NamedTuple):
    """A column: its title, the registers that it is of, and their contents as it shows them."""

    title: str
    register_keys: tuple[Any, ...]
    show: Callable[[Mapping[object, int]], str]
    block_start: int | None = None
    """Where the block begins that they are in: its registers are read at once."""


@frozen
class TrendResult:
    """What was recorded."""

    __repr__ = short_repr

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


@frozen
class TrendOptions:
    """How a trend is taken: s between two rows, s altogether (None: until it is interrupted), and who gets what."""

    sink: Sink
    interval: float
    seconds: float | None
    on_row: Callable[[float, Mapping[str, str]], None]
    """Called after each row with its time and its values."""


def record_trend(source: Plc, trend_options: TrendOptions, policy: RetryPolicy, limits: Limits) -> TrendResult:
    """Records until the end or an interrupt, which keeps every row; raises `PlcError`, with the rows written too."""
    if source.like is not None and source.image is None:
        return TrendResult(str(source.address), tuple(errors_in(source.like.findings)))
    return run_async(_record_rows(source, trend_options, policy, limits))


async def _record_rows(source: Plc, trend_options: TrendOptions, policy: RetryPolicy, limits: Limits) -> TrendResult:
    result = TrendResult(str(source.address))
    async with Link(source.address, policy) as link:
        registers = source.registers
        image = await registers.read_image(link)
        options = DecodeOptions(like=source.like, with_text=False)
        decoded = decode_files(
            [(registers.listing(image), result.plc)], source.vendor, options, source.option_texts, limits
        )
        if decoded.data is None:
            return replace(result, findings=decoded.findings)
        if isinstance(source.numbering, NamedNumbering):
            channels = list(named_channels(source.vendor, source.numbering, image))
        else:
            encoding = encoder_of(source.vendor).encode(read_settings(source.vendor.model, decoded.data, "the PLC"))
            channels = [*_loop_channels(encoding, source), *_tag_channels(encoding, source)]
        columns = ("time", *(channel.title for channel in channels))
        result = replace(result, columns=columns)
        trend_options.sink.write(csv_lines([columns]))
        rows = 0
        try:
            async for seconds, words in _readings(link, registers, channels, trend_options):
                values = [channel.show(words) for channel in channels]
                trend_options.sink.write(csv_lines([[f"{seconds:.3f}", *values]]))
                rows += 1
                trend_options.on_row(seconds, dict(zip(columns[1:], values, strict=True)))
        except asyncio.CancelledError:  # somebody has pressed Ctrl-C: what is there stays
            pass
        return replace(result, rows=rows)


async def _readings(link: Link, registers: Registers, channels: Sequence[Channel], trend_options: TrendOptions) -> Any:
    """The words of all channels again and again, with the time of each reading since the first."""
    spans: dict[int, list[int]] = {}
    for channel in channels:
        if channel.block_start is not None:
            spans.setdefault(channel.block_start, []).extend(channel.register_keys)
    numbers = [n for channel in channels if channel.block_start is None for n in channel.register_keys]
    numbers += [n for span in spans.values() for n in range(min(span), max(span) + 1)]
    begin, due_time, first_time = time.monotonic(), 0.0, None
    while trend_options.seconds is None or due_time <= trend_options.seconds:
        await asyncio.sleep(max(0.0, begin + due_time - time.monotonic()))
        words = await registers.read_words(link, numbers)
        now = time.monotonic()  # a request that was sent again has made it late
        first_time = now if first_time is None else first_time
        yield now - first_time, words
        delay = time.monotonic() - begin - due_time
        due_time += trend_options.interval * max(1, -(-delay // trend_options.interval))


def _loop_channels(encoding: AnyEncoding, source: Plc) -> Iterator[Channel]:
    """The columns of all loops, as far as their blocks have them."""
    registers = register_encoder_of(source.vendor).MODE_REGISTERS
    for block in encoding.blocks:
        if block.loop is None or block.prefix:
            continue
        for word in block.table.words:
            number = block.start + word.offset
            signal = COLUMN_TITLES.get(str(word.path))
            if word.name == registers[0]:
                numbers = tuple(block.start + block.table.offset_of(name) for name in registers)
                show = _mode_text(source.vendor.load("mode_of"), numbers)
                yield Channel(f"{block.loop}.{MODE_TITLE}", numbers, show, block.start)
            elif signal is not None:
                show = _value_text(partial(word.decode, scales=block.scales), number)
                yield Channel(f"{block.loop}.{signal}", (number,), show, block.start)


def _tag_channels(encoding: AnyEncoding, source: Plc) -> Iterator[Channel]:
    """The columns of registers outside of the blocks, as far as the map has them."""
    with suppress(LookupError):
        tags = source.vendor.load("tags")
        scales = {block.loop: block.scales for block in encoding.blocks}
        for entry in encoding.image.settings:
            for signal, number, codec in tags(entry):
                if source.numbering is not None and is_mapped(source.numbering, number):
                    loop = str(entry["loop"])
                    decode = partial(codec.decode, scale=scales[loop][codec.scale])
                    yield Channel(f"{loop}.{signal}", (number,), _value_text(decode, number))


def is_mapped(numbering: Any, number: object) -> bool:
    """Whether a client finds an address."""
    try:
        numbering.place(number)
    except LookupError:
        return False
    return True


def _mode_text(mode_of: Callable[..., str], numbers: tuple[int, ...]) -> Callable[[Mapping[object, int]], str]:
    return lambda words: mode_of(*(words[number] for number in numbers))


def _value_text(decode: Callable[[int], Any], number: int) -> Callable[[Mapping[object, int]], str]:
    """How a register is shown; empty: its content is no value."""

    def show(words: Mapping[object, int]) -> str:
        try:
            value = decode(words[number])
        except DecodeError:
            return ""
        return decimal_text(getattr(value, "value", value))

    return show


def named_channels(vendor: Vendor, numbering: NamedNumbering, image: object) -> Iterator[Channel]:
    """The columns of named parameters, as far as the map has them."""
    points = vendor.module("points")
    loops = dict.fromkeys(point.loop for point in numbering.points.values() if point.loop)
    for loop in loops:
        for name, signal in points.SIGNALS.items():
            parameter = f"{loop}.{name}"
            if parameter in numbering.places:
                yield Channel(
                    f"{loop}.{signal}", (parameter,), _parameter_text(numbering.points[parameter].type, parameter)
                )
        keys = [name for name in points.MODE_KEYS if f"{loop}.{name}" in numbering.points]
        mapped_keys = tuple(f"{loop}.{name}" for name in keys if f"{loop}.{name}" in numbering.places)
        if mapped_keys and (points.LITERALS or len(mapped_keys) == len(keys)):
            yield Channel(f"{loop}.{MODE_TITLE}", mapped_keys, _named_mode_text(points.mode_of, numbering, loop, image))


def _parameter_text(kind: IecType, name: str) -> Callable[[Mapping[object, int]], str]:
    def show(words: Mapping[object, int]) -> str:
        try:
            content = register_content(kind, words[name])
        except DecodeError:
            return ""
        return str(int(content)) if isinstance(content, bool) else decimal_text(Decimal(repr(content)))

    return show


def _named_mode_text(
    mode_of: Callable[[Mapping[str, object]], str], numbering: NamedNumbering, loop: str, image: Any
) -> Callable[[Mapping[object, int]], str]:
    """How the parameters that select a mode are shown; those without a register are what the program says."""
    prefix = f"{loop}."
    unmapped_contents = {cell.field: cell.raw for cell in image.cells if cell.loop == loop}

    def show(words: Mapping[Any, int]) -> str:
        contents = {
            name.removeprefix(prefix): register_content(numbering.points[name].type, raw)
            for name, raw in words.items()
            if name.startswith(prefix)
        }
        return mode_of(unmapped_contents | contents)

    return show


@check_arguments
def trend(
    plc: str,
    sink: Sink,
    *,
    like: Source | None = None,
    vendor: str | None = None,
    options: Mapping[str, object] | None = None,
    map: Path | str | bytes | None = None,
    interval: float = 1.0,
    seconds: float | None = None,
    taken: Callable[[float, Mapping[str, str]], None] | None = None,
    timeout: float = 2.0,
    retries: int = 2,
    files: Files = None,
    limits: Limits = DEFAULT,
) -> TrendResult:
    """Records PV, set point, output and mode of each loop as CSV, a row every ``interval`` s, for ``tune``.

    ``sink``: an open text stream; a row is written at once. ``seconds``: how long, else until Ctrl-C, which keeps every
    row. ``taken`` is called after each row with its time and its values by column. The others as in `pull`.
    """
    if not 0 < interval < float("inf"):
        raise ArgumentError(f"`interval` is {interval:g}; write seconds above 0", "interval")
    if seconds is not None and not 0 <= seconds < float("inf"):
        raise ArgumentError(f"`seconds` is {seconds:g}; write seconds from 0 on", "seconds")
    source = plc_of(plc, (like, vendor, map), options, files, limits)
    trend_options = TrendOptions(sink, interval, seconds, taken or _ignore_row)
    return record_trend(source, trend_options, retry_policy(timeout, retries), limits)


def _ignore_row(_at: float, _values: Mapping[str, str]) -> None:
    """Nobody watches the rows."""
