"""A sample of the measure of `spoil_runs`: mistakes in the examples fail by a standing expectation."""

from __future__ import annotations

import pytest

import spoil_runs
from spoils import VENDORS, spoils

EVERY = sorted(
    f"{path.parent.name}/{path.name.partition('.')[0]}" for path in spoil_runs.EXAMPLES.glob("*/*.scenario.yaml")
)
SAMPLE = ("dl06/flow", "click/tank", "ezlogix/dosing", "nextopid/ratio", "dpide/oven", "generic/boiler")
"""One of each vendor, the ones that run fastest."""
GROSS = (
    ": action",
    "PID_DIR",
    "Direct",
    "output_raises_pv",
    "output limits the lowest",
    "no plant",
    "PV not connected",
)
"""Mistakes with which no loop can control, whatever its plant is like; the script has all."""


def files(example):
    """Both files of an example as data."""
    scenario = spoil_runs.read(spoil_runs.EXAMPLES / f"{example}.scenario.yaml")
    return spoil_runs.read(spoil_runs.EXAMPLES / example.partition("/")[0] / scenario["config"]), scenario


@pytest.mark.parametrize("example", EVERY)
def test_every_example_can_be_spoiled_in_thirty_ways_by_small_edits(example):
    config, scenario = files(example)
    made = list(spoils(config, scenario))

    assert len([one for one in made if not one.intent]) >= 30
    assert len({one.name for one in made}) == len(made)
    assert all("expect" not in one.scenario for one in made)
    assert files(example) == (config, scenario)


def test_the_sample_has_every_vendor():
    assert {example.partition("/")[0] for example in SAMPLE} == set(VENDORS)


def test_gross_mistakes_fail_and_what_is_good_does_not():
    results = [result for example in SAMPLE for result in spoil_runs.measure(example, 100, GROSS)]
    good = [result for result in results if not result.spoil]
    counting = [result for result in results if result.ran and result.differs and not result.intent]

    assert [result.failures for result in good] == [()] * len(SAMPLE)
    assert len(counting) >= 20
    assert [(r.example, r.spoil) for r in counting if not r.failures and not r.other] == []
    assert sum(bool(r.failures) for r in counting) >= 0.9 * len(counting)
