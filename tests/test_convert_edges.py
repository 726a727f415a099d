"""Pieces of conversions at their edges."""

from __future__ import annotations

from decimal import Decimal
from types import SimpleNamespace as Facts

import pytest

from pidcfg.conversion.dl06 import _derivative_filter
from pidcfg.conversion.settle import _within


@pytest.mark.parametrize(
    ("rate", "n", "clamped"),
    [("10", 1, False), ("9.9", 1, True), ("200", 20, False), ("200.1", 20, True), ("100", 10, False)],
)
def test_a_filter_of_td_through_1_to_20_is_exact_or_the_nearest(rate, n, clamped):
    """The filter's time constant is 10 s."""
    put = []
    b = Facts(put=lambda *given, **more: put.append((given, more)))
    _derivative_filter(b, Decimal(10), Decimal(rate))
    (((path, limit, of, note), more),) = put

    assert (path, limit, of) == ("derivative_gain_limit", n, "tuning.derivative_filter")
    assert (more["clamped"], more["exact"], more["held"]) == (clamped, 10, Decimal(rate) / n)
    assert note == (f"the filter is Td/N with N from 1 to 20: {n}" if clamped else f"Td/{n}")


@pytest.mark.parametrize(
    ("key", "name", "inside"),
    [
        ("pv", "pv", True),
        ("pv.range", "pv", True),
        ("pv", "pv.range", False),
        ("pvs", "pv", False),
        ("pv", "pvs", False),
    ],
)
def test_a_key_is_within_its_name(key, name, inside):
    assert _within(key, name) == inside
