"""The scan time estimate against the two examples of the manual."""

from __future__ import annotations

import pytest

from pidcfg.sim.controllers.dl06.plc import scan_time


def test_one_slow_loop_adds_four_microseconds():
    assert scan_time(0.050, [3.0]).typical == pytest.approx(50.004e-3, abs=0.5e-6)


def test_the_four_loops_of_the_example_add_sixty_microseconds():
    assert scan_time(0.050, [0.25, 30.0, 10.0, 1.5]).typical == pytest.approx(50.06e-3, abs=5e-6)


def test_minimum_and_maximum_bracket_the_typical_time():
    estimate = scan_time(0.010, [0.1, 0.1])

    assert estimate == pytest.approx((10.03e-3, 10.05e-3, 10.07e-3))


def test_without_loops_the_scan_time_stays():
    assert scan_time(0.02, []) == (0.02, 0.02, 0.02)
