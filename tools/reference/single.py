"""Arithmetic of single precision: every result of NumPy's float32 is rounded as a PLC's REAL is."""

from __future__ import annotations

import numpy as np

F = np.float32

np.seterr(all="ignore")  # what is beyond single precision is the reference's own business


def real(value):
    """A number as a REAL."""
    return F(float(value))


def finite(value):
    """Whether a result is a number."""
    return bool(np.isfinite(value))


def shown(value):
    """A REAL as the plain number that a trend has."""
    return float(value)
