"""Configurations with one small change each are answered as the committed answers say, byte for byte."""

from __future__ import annotations

import pytest

import spoiled_configurations


@pytest.mark.parametrize("name", spoiled_configurations.SOURCES)
def test_what_is_said_of_a_configuration_with_a_change(name):
    assert spoiled_configurations.answers(name).encode() == (spoiled_configurations.FOLDER / f"{name}.txt").read_bytes()
