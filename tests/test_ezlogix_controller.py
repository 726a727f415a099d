"""The equation of the virtual EZLogix against the manual's formulas, worked out in exact fractions.

Each case keeps the result away from the middle between two counts, so that rounding cannot hide a wrong term.
"""

from __future__ import annotations

import random
from fractions import Fraction
from itertools import accumulate, pairwise

import pytest

from ezlogix_rig import Rig
from rig_plants import Fixed


def formula(pvs, sp, out, offset=0, *, direct, velocity=False, gain, ts, ti=0, td=0):
    """CV(n) by the printed formula; the sum begins with what makes the term CV - CV0 (exact, without limits)."""
    gain, ts, ti, td = (Fraction(str(x)) for x in (gain, ts, ti, td))
    sign = 1 if direct else -1
    factor = gain or 1
    errors = [sign * (Fraction(pv) - sp) for pv in pvs]
    ramp = [sign * Fraction(pv) for pv in pvs] if velocity else errors
    slopes = [Fraction(0), *(b - a for a, b in pairwise(ramp))]
    sums = list(accumulate(errors))
    start = out - offset if ti else 0
    return [
        gain * e + start + (factor * ts / ti * total if ti else 0) + factor * td / ts * slope + offset
        for e, total, slope in zip(errors, sums, slopes, strict=True)
    ]


def controlled(pvs, **given):
    """The CV of each sample of a loop in Auto with these measurements."""
    rig = Rig(base=given.pop("period", 0.1))
    rig.add(Fixed(), "auto", **given)
    return [out for (out,) in rig.follow(pvs, "out")]


@pytest.mark.parametrize("direct", [False, True])
@pytest.mark.parametrize("velocity", [False, True])
@pytest.mark.parametrize(
    ("gain", "ti", "td"),
    [
        (2, 0, 0),
        (0.75, 3, 0),
        (1.25, 0, 0.4),
        (1.5, 20, 0.3),
        (0, 5, 0),
        (0, 7, 0.2),
        (0, 0, 0.5),
    ],
)
def test_the_result_is_that_of_the_printed_formula(direct, velocity, gain, ti, td):
    rng = random.Random(repr((direct, velocity, gain, ti, td)))
    for offset in (0, 1900):
        pvs = [2000 + rng.randint(-30, 30) for _ in range(25)]
        start = 0 if ti else offset
        if not ti and not offset:
            pvs = [pv + (40 if direct else -40) for pv in pvs]
        want = formula(
            pvs, 2000, 2000 if ti else start, offset, direct=direct, velocity=velocity, gain=gain, ts=0.1, ti=ti, td=td
        )
        got = controlled(
            pvs,
            sp=2000.0,
            out=2000.0,
            offset=float(offset),
            direct=int(direct),
            velocity=int(velocity),
            gain=float(gain),
            reset=float(ti),
            rate=float(td),
        )
        for value, exact in zip(got, want, strict=True):
            assert abs(value - min(max(exact, 0), 4095)) <= Fraction(1, 2) + Fraction(1, 10**9)


def test_the_deadband_of_a_square_root_loop_is_on_the_roots_scale():
    outs = controlled(
        [1024.0, 961.0], sp=30.0, gain=1.0, square_root=1, scale=64.0, direct=1, deadband=1.5, offset=1000.0
    )

    assert outs == [1000.0 + 128.0, 1000.0]
