"""The examples give the committed images, trends and reports, byte for byte."""

from __future__ import annotations

import pytest

import golden


@pytest.mark.parametrize("name", golden.IMAGES)
def test_images(name):
    for file, text in golden.images(name).items():
        assert text == (golden.GOLDEN / file).read_text("utf-8"), file


@pytest.mark.parametrize("name", golden.IMAGES)
def test_trends_and_reports(name):
    for file, text in golden.run(name).items():
        assert text == (golden.GOLDEN / file).read_text("utf-8"), file


def test_no_golden_file_is_left_over():
    expected = {file for name in golden.IMAGES for file in (f"{name}.trend.csv", f"{name}.report.json")}
    expected |= {f"{name}.{end}" for name, kinds in golden.IMAGES.items() for end in kinds.values()}
    assert {path.name for path in golden.GOLDEN.iterdir()} == expected


def test_every_example_has_a_scenario_and_goldens():
    names = {path.stem for path in golden.FOLDER.glob("*.yaml") if ".scenario" not in path.name}
    assert names == set(golden.IMAGES)
    assert all((golden.FOLDER / f"{name}.scenario.yaml").exists() for name in names)
