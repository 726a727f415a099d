"""A kernel compiled and not, on the same records: both must leave the same bits behind."""

from __future__ import annotations

import itertools
import struct
from collections.abc import MutableSequence, Sequence  # noqa: TC003 - the lists' annotations are read
from dataclasses import astuple, fields, replace
from typing import Any, NamedTuple

import pytest

pytest.importorskip("numba")
import numpy as np

from pidcfg.sim.compile import records, write_back
from pidcfg.sim.pieces import Pieces

PIECES = {}
COUNT = itertools.count()
EACH = 16
"""Of so many calls one is held to a piece, too: each PLC here needs one of its own."""


class Lists(NamedTuple):
    """What a kernel is called with; its configurations are only read."""

    cfg: Sequence[Any]
    st: MutableSequence[Any]
    aux: MutableSequence[float]
    sig: MutableSequence[float]


def drive_it(*arguments):
    """In its place stands the kernel that is tried."""
    raise AssertionError(arguments)


def whole(first, last, lists, noise):
    """A kernel as one that is written in one piece (kernel)."""
    cfg, st, aux, sig = lists
    return drive_it(first, last, cfg, st, aux, sig, noise)


def counted(first, last, count, lists, noise):
    """The same with another number (kernel)."""
    cfg, st, aux, sig = lists
    return drive_it(first, last, count, cfg, st, aux, sig, noise)


def in_one_piece(drive, hot, head, lists, noise):
    """What the kernel leaves when it is written in one piece."""
    cfg, st, aux, sig = lists
    copies = Lists(cfg, [replace(one) for one in st], list(aux), list(sig))
    kernel = whole if len(head) == 2 else counted
    pieces = PIECES.setdefault(drive, Pieces(kernel, kernel, {drive_it: drive}, frozenset({drive, *hot}), 10**6))
    arguments = (*head, copies, noise)
    pieces.step(10**6, arguments).run(*arguments)
    return words(*copies)


def vector(values):
    """A list of floats for a compiled kernel."""
    return np.array(values, np.float64)


def words(cfg, st, aux, sig):
    """Every bit of the outcome."""
    flat = [value for item in (*cfg, *st) for value in astuple(item)]
    return [struct.pack("<d", x) if isinstance(x, float) else x for x in (*flat, *aux, *sig)]


def advance(drive, fast, head, lists, noise, hot=()):
    """Runs ``drive`` on the lists and its compiled twin on a copy, and compares what they leave.

    Now and then it is written in one piece, too, with the kernels ``hot`` in the place of their calls.

    ``head``: the numbers that both are called with first; ``lists``: configurations, states, registers and signals.
    """
    cfg, st, aux, sig = lists
    kinds = type(cfg[0]), type(st[0])
    arrays = records(cfg, kinds[0]), records(st, kinds[1]), vector(aux), vector(sig)
    fast(*head, *arrays, vector(noise))
    piece = in_one_piece(drive, hot, head, lists, noise) if next(COUNT) % EACH == 0 else None
    drive(*head, *lists, noise)
    assert piece is None or piece == words(*lists)
    twins = [kinds[0]() for _ in cfg], [kinds[1]() for _ in st]
    for array, twin in zip(arrays, twins, strict=False):
        write_back(array, twin)
    assert words(*twins, arrays[2].tolist(), arrays[3].tolist()) == words(*lists)


def check_types(items):
    """Every field of the records holds the type that it is declared with: compiled, a float would be cut off."""
    for item in items:
        for field in fields(item):
            assert type(getattr(item, field.name)).__name__ == field.type, field.name
