"""The examples give the committed images, trends and reports, byte for byte."""

from __future__ import annotations

from pathlib import Path

import pytest

import golden


@pytest.mark.parametrize("example", golden.IMAGES)
def test_images(example):
    for file, text in golden.images(example).items():
        assert text == golden.golden(example, file).read_text("utf-8"), file


@pytest.mark.parametrize("example", golden.IMAGES)
def test_trends_and_reports(example):
    for file, text in golden.run(example).items():
        assert text == golden.golden(example, file).read_text("utf-8"), file


def test_no_golden_file_is_left_over():
    expected = set()
    for example, kinds in golden.IMAGES.items():
        ends = ("trend.csv", "report.json", *kinds.values())
        expected |= {golden.golden(example, f"{Path(example).name}.{end}") for end in ends}
    assert set(golden.EXAMPLES.glob("*/golden/*")) == expected


def test_every_example_has_a_scenario_and_goldens():
    found = {path for path in golden.EXAMPLES.glob("*/*.yaml") if ".scenario" not in path.name}
    examples = {path for path in found if path.parent.name != "mistakes"}
    assert examples == {golden.EXAMPLES / f"{example}.yaml" for example in golden.IMAGES}
    assert all(path.with_suffix(".scenario.yaml").exists() for path in examples)
