"""Recorded steps of tests: what is identified in samples is found once, however many files hold them."""

from __future__ import annotations

import functools
from contextlib import contextmanager
from typing import TYPE_CHECKING
from unittest.mock import patch

from pidcfg.tuning.identify import Identification, identify
from pidcfg.tuning.response import Record

if TYPE_CHECKING:
    from collections.abc import Iterator


Column = tuple[float, ...]


@functools.cache
def once(time: Column, output: Column, pv: Column, units: tuple[str, str], rest: float | None) -> Identification:
    """What is identified in samples; the search takes a third of a second."""
    return identify(Record([*time], [*output], [*pv], units), rest)


@contextmanager
def remembering() -> Iterator[None]:
    """Samples that have been seen are not searched again, in this process and in its copies; files are read as ever."""

    def found(record: Record, rest: float | None = None) -> Identification:
        return once(tuple(record.time), tuple(record.output), tuple(record.pv), record.units, rest)

    with patch("pidcfg.tuning.identify.identify", found):
        yield
