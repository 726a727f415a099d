"""The record of a step test as people have it: a CSV file with time, output and PV in its columns."""

from __future__ import annotations

import csv
from math import isfinite
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import ListingError
from pidcfg.listings import listing_text
from pidcfg.tuning.identify import Identified, Record, RecordError, identify
from pidcfg.tuning.rules import TuningError

if TYPE_CHECKING:
    from pidcfg.limits import Limits

COLUMNS = 3


class UnreadableRecordError(TuningError):
    """A record that tells no process, with its name and line."""


def identified(data: bytes, name: str, limits: Limits) -> tuple[Identified, Record]:
    """The process of a recorded step, and its samples; raises `UnreadableRecordError`."""
    record, lines = read_record(data, name, limits)
    try:
        return identify(record), record
    except RecordError as error:
        where = name if error.row is None else f"{name}:{lines[error.row]}"
        raise UnreadableRecordError(f"{where}: {error}; {error.cure}") from None


def read_record(data: bytes, name: str, limits: Limits) -> tuple[Record, list[int]]:
    """The samples of a file and the lines that they stand in; the first three columns count, a header is skipped."""
    if len(data) > limits.file_bytes:
        raise UnreadableRecordError(
            f"{name} is larger than {limits.file_bytes} bytes; --limit file_bytes=… raises that"
        )
    try:
        text = listing_text(data)
    except ListingError as error:
        raise UnreadableRecordError(f"{name}: {error}") from None
    samples, lines = _samples(name, text)
    if not samples:
        raise UnreadableRecordError(f"{name} holds no samples")
    for line, earlier, later in zip(lines[1:], samples, samples[1:], strict=False):
        if later[0] <= earlier[0]:
            raise UnreadableRecordError(f"{name}:{line}: the time does not go on ({later[0]:g} after {earlier[0]:g} s)")
    time, output, pv = zip(*samples, strict=True)
    return Record(time, output, pv), lines


def _samples(name: str, text: str) -> tuple[list[tuple[float, ...]], list[int]]:
    samples: list[tuple[float, ...]] = []
    lines = []
    for line, row in enumerate(text.splitlines(), start=1):
        if not row.strip() or row.lstrip().startswith("#"):
            continue
        cells = next(csv.reader([row], delimiter=";" if ";" in row else ","))[:COLUMNS]
        numbers = [_number(cell) for cell in cells]
        if len(cells) < COLUMNS or None in numbers:
            if not samples and all(n is None for n in numbers):
                continue
            raise UnreadableRecordError(f"{name}:{line}: {row.strip()[:40]!r} is not time, output and PV")
        samples.append(tuple(n for n in numbers if n is not None))
        lines.append(line)
    return samples, lines


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if isfinite(value) and "_" not in text else None
