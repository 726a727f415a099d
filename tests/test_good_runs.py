"""A sample of the measure of `good_runs`: runs in which control happens as it should do not fail."""

from __future__ import annotations

import pytest

import good_runs

SAMPLE = range(7)


@pytest.mark.parametrize("vendor", good_runs.VENDORS)
def test_good_runs_do_not_fail(vendor):
    for seed in SAMPLE:
        ((run, why),) = good_runs.measured(seed, [vendor])
        assert not why, run.name


def test_the_sample_has_something_of_everything():
    names = " ".join(
        good_runs.Drawer(seed, vendor).course(seed).name for seed in SAMPLE for vendor in good_runs.VENDORS
    )
    wanted = ["lag", "integrator", "cascade", "pulses", "noise", "steady", "deadband", "no integral"]
    wanted += ["step", "ramp", "load", "sensor", "manual"]
    assert [word for word in wanted if word not in names] == []


def test_a_run_that_is_spoiled_does_fail():
    run = good_runs.Drawer(0, "generic").course(0)
    for plant in run.scenario["plants"].values():
        plant["gain"] = 0
    assert any(text.startswith("pv-not-driven") for text in good_runs.failures(run))
