"""How much of an increment of the integral action counts at a limit of MV (D222)."""

from __future__ import annotations

import pytest

from pidcfg.sim.controllers.nextopid.terms import FALL_LIMITED, MV_HIGH, MV_LOW, RISE_LIMITED, State, accepted_change


@pytest.mark.parametrize(
    ("bits", "change", "out", "accepted"),
    [
        (0, 4.0, 41.0, 4.0),
        (0, -4.0, 39.0, -4.0),
        (MV_HIGH, 4.0, 41.0, 1.0),
        (RISE_LIMITED, 4.0, 41.0, 1.0),
        (MV_HIGH, 4.0, 39.0, 0.0),
        (MV_HIGH, 4.0, 49.0, 4.0),
        (MV_HIGH, -4.0, 41.0, -4.0),
        (MV_LOW, -4.0, 39.0, -1.0),
        (FALL_LIMITED, -4.0, 39.0, -1.0),
        (MV_LOW, -4.0, 41.0, 0.0),
        (MV_LOW, -4.0, 31.0, -4.0),
        (MV_LOW, 4.0, 39.0, 4.0),
        (MV_HIGH, 0.0, 41.0, 0.0),
    ],
)
def test_an_increment_counts_up_to_the_limit_and_wholly_away_from_it(bits, change, out, accepted):
    """Without it MV would be 40."""
    assert accepted_change(State(out=out), bits, 40.0, change) == accepted
