"""A kernel compiled and not, on the same records: both must leave the same bits behind."""

from __future__ import annotations

import struct
from dataclasses import astuple, fields

import pytest

pytest.importorskip("numba")
import numpy as np

from pidcfg.sim.engine.compile import Rows


def vector(values):
    """A list of floats for a compiled kernel."""
    return np.array(values, np.float64)


def words(configs, states, aux, signals):
    """Every bit of the outcome."""
    flat = [value for item in (*configs, *states) for value in astuple(item)]
    return [struct.pack("<d", x) if isinstance(x, float) else x for x in (*flat, *aux, *signals)]


def advance(drive, fast, head, lists, noise):
    """Runs ``drive`` on the lists and its compiled twin on a copy, and compares what they leave.

    ``head``: the numbers that both are called with first; ``lists``: configurations, states, registers and signals.
    """
    configs, states, aux, signals = lists
    twins, numbers = (Rows.from_objects(configs), Rows.from_objects(states)), (vector(aux), vector(signals))
    fast(*head, *(rows.array for rows in twins), *numbers, vector(noise))
    drive(*head, *lists, noise)
    assert words(*twins, *(values.tolist() for values in numbers)) == words(*lists)


def check_types(items):
    """Every field of the records holds the type that it is declared with: compiled, a float would be cut off."""
    for item in items:
        for field in fields(item):
            assert type(getattr(item, field.name)).__name__ == field.type, field.name
