"""Committed answers: what examples, changed runs, spoiled files and mistakes give, byte for byte."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import changed_runs
import explained
import golden
import good_runs
import mistakes
import spoil_runs
import spoiled_configurations
import spoiled_listings
from clear_messages import COMMANDS, EXAMPLES, FILES, SHEETS, lacks_of_command, lacks_of_file, lacks_of_sheet
from pidcfg.vendors import VENDORS
from spoils import VENDORS as SPOILED
from spoils import spoils


def stem(example: str) -> str:
    """How the names of an example's files begin."""
    return Path(example).name


def belongs(file: str, example: str) -> bool:
    """Whether a golden file is a listing of an example."""
    return file.startswith(stem(example)) and not file.endswith((".trend.csv", ".report.json"))


@pytest.mark.parametrize("example", golden.IMAGES)
def test_images(example):
    found = golden.images(example)
    assert {path.name for path in golden.golden(example, "").iterdir() if belongs(path.name, example)} == set(found)
    for file, data in found.items():
        assert data == golden.golden(example, file).read_bytes(), file


@pytest.mark.parametrize("example", golden.IMAGES)
def test_trends_and_reports(example):
    for file, data in golden.run(example).items():
        assert data == golden.golden(example, file).read_bytes(), file


def test_reports():
    found = golden.reports()
    assert {path.name for path in golden.REPORTS.iterdir() if path.suffix != ".yaml"} == set(found)
    for file, data in found.items():
        assert data == (golden.REPORTS / file).read_bytes(), file


def test_no_golden_file_is_left_over():
    for path in golden.EXAMPLES.glob("*/golden/*"):
        owners = [e for e in golden.IMAGES if golden.golden(e, "") == path.parent and path.name.startswith(stem(e))]
        assert len(owners) == 1, path


def test_every_example_has_a_scenario_and_goldens():
    found = {path for path in golden.EXAMPLES.glob("*/*.yaml") if ".scenario" not in path.name}
    examples = {path for path in found if path.parent.name != "mistakes"}
    assert examples == {golden.EXAMPLES / f"{example}.yaml" for example in golden.IMAGES}
    assert all(path.with_suffix(".scenario.yaml").exists() for path in examples)


# --- Short runs with one change each give what the committed answers say, byte for byte -------------------------------


@pytest.mark.parametrize("name", changed_runs.SOURCES)
def test_what_a_run_with_a_change_gives(name):
    assert changed_runs.answers(name).encode() == (changed_runs.FOLDER / f"{name}.txt").read_bytes()


# --- Configurations with one small change each are answered as the committed answers say, byte for byte ---------------


@pytest.mark.parametrize("name", spoiled_configurations.SOURCES)
def test_what_is_said_of_a_configuration_with_a_change(name):
    assert spoiled_configurations.answers(name).encode() == (spoiled_configurations.FOLDER / f"{name}.txt").read_bytes()


# --- Listings with one small fault each are answered as the committed answers say, byte for byte ----------------------


@pytest.mark.parametrize("name", spoiled_listings.SOURCES)
def test_what_is_said_of_a_listing_with_a_fault(name):
    assert spoiled_listings.answers(name).encode() == (spoiled_listings.FOLDER / f"{name}.txt").read_bytes()


# --- What is said of every name of the tables is what the committed pages say, byte for byte --------------------------


@pytest.mark.parametrize("vendor", VENDORS)
def test_what_is_said_of_every_name(vendor):
    assert explained.pages(vendor).encode() == (explained.FOLDER / f"{vendor}.txt").read_bytes()


# --- Mistakes that people make get an answer with the line, the value and what to do ----------------------------------


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """A copy of the examples."""
    return shutil.copytree(EXAMPLES, tmp_path_factory.mktemp("mistakes") / "examples")


@pytest.fixture
def in_the_examples(examples, monkeypatch):
    monkeypatch.chdir(examples)
    monkeypatch.setenv("NO_COLOR", "1")


@pytest.mark.usefixtures("in_the_examples")
@pytest.mark.parametrize("row", FILES, ids=lambda row: f"{row[0]} {row[2]}")
def test_a_mistake_in_a_file_gets_a_clear_answer(examples, row):
    lacking, answer = lacks_of_file(examples, *row)
    assert not lacking, answer


@pytest.mark.usefixtures("in_the_examples")
@pytest.mark.parametrize("row", SHEETS, ids=lambda row: row[1])
def test_a_mistake_in_a_sheet_gets_a_clear_answer(examples, row):
    lacking, answer = lacks_of_sheet(examples, *row)
    assert not lacking, answer


@pytest.mark.usefixtures("in_the_examples")
@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row[0])
def test_a_mistake_in_a_command_gets_a_clear_answer(row):
    lacking, answer = lacks_of_command(*row)
    assert not lacking, answer


@pytest.mark.usefixtures("in_the_examples")
def test_there_are_as_many_as_were_once_counted_by_hand():
    assert len(FILES) + len(SHEETS) + len(COMMANDS) >= 126


# --- Runs that are sound, and spoiled ones ----------------------------------------------------------------------------


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
    assert {example.partition("/")[0] for example in SPOIL_SAMPLE} == set(SPOILED)


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
