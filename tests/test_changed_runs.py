"""Short runs with one change each give what the committed answers say, byte for byte."""

from __future__ import annotations

import pytest

import changed_runs


@pytest.mark.parametrize("name", changed_runs.SOURCES)
def test_what_a_run_with_a_change_gives(name):
    assert changed_runs.answers(name).encode() == (changed_runs.FOLDER / f"{name}.txt").read_bytes()
