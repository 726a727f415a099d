"""The examples give the committed images, trends and reports, byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

import golden


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
