"""Runs that are sound, and spoiled ones."""

from __future__ import annotations

import pytest

import good_runs
import mistakes
import spoil_runs
from spoils import VENDORS, spoils

# --- A sample of the measure of `good_runs`: runs in which control happens as it should do not fail -------------------

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


# --- A sample of the measure of `spoil_runs`: mistakes in the examples fail by a standing expectation -----------------

EVERY = sorted(
    f"{path.parent.name}/{path.name.partition('.')[0]}" for path in spoil_runs.EXAMPLES.glob("*/*.scenario.yaml")
)
SPOIL_SAMPLE = ("dl06/flow", "click/tank", "ezlogix/dosing", "nextopid/ratio", "dpide/oven", "generic/boiler")
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
    assert {example.partition("/")[0] for example in SPOIL_SAMPLE} == set(VENDORS)


def test_gross_mistakes_fail_and_what_is_good_does_not():
    results = [result for example in SPOIL_SAMPLE for result in spoil_runs.measure(example, 100, GROSS)]
    good = [result for result in results if not result.spoil]
    counting = [result for result in results if result.ran and result.differs and not result.intent]

    flow, *others = (result.failures for result in good)
    assert [failure.partition(" FIC-301: ")[0] for failure in flow] == ["no-better"], (
        "a bound of the scenario proves it"
    )
    assert others == [()] * (len(SPOIL_SAMPLE) - 1)
    assert len(counting) >= 20
    assert [(r.example, r.spoil) for r in counting if not r.failures and not r.other] == []
    assert sum(bool(r.failures) for r in counting) >= 0.9 * len(counting)


# --- Typical mistakes: the whole of what is said to each is what somebody has read and judged -------------------------

CASES = [(name, title) for name in mistakes.GROUPS for title in mistakes.cases(name)]
MANY = 150


@pytest.mark.parametrize(("name", "title"), CASES)
def test_what_is_said_to_a_mistake(name, title):
    assert mistakes.answer(name, title) == mistakes.committed(name)[title]


@pytest.mark.parametrize("name", mistakes.GROUPS)
def test_every_answer_belongs_to_a_mistake(name):
    assert [*mistakes.committed(name)] == [*mistakes.cases(name)]


def test_there_are_many():
    assert len(CASES) >= MANY
