"""Mistakes that people make get an answer with the line, the value and what to do."""

from __future__ import annotations

import shutil

import pytest

from clear_messages import COMMANDS, EXAMPLES, FILES, SHEETS, lacks_of_command, lacks_of_file, lacks_of_sheet


@pytest.fixture(scope="module")
def examples(tmp_path_factory):
    """A copy of the examples."""
    return shutil.copytree(EXAMPLES, tmp_path_factory.mktemp("mistakes") / "examples")


@pytest.fixture(autouse=True)
def in_the_examples(examples, monkeypatch):
    monkeypatch.chdir(examples)
    monkeypatch.setenv("NO_COLOR", "1")


@pytest.mark.parametrize("row", FILES, ids=lambda row: f"{row[0]} {row[2]}")
def test_a_mistake_in_a_file_gets_a_clear_answer(examples, row):
    lacking, answer = lacks_of_file(examples, *row)
    assert not lacking, answer


@pytest.mark.parametrize("row", SHEETS, ids=lambda row: row[1])
def test_a_mistake_in_a_sheet_gets_a_clear_answer(examples, row):
    lacking, answer = lacks_of_sheet(examples, *row)
    assert not lacking, answer


@pytest.mark.parametrize("row", COMMANDS, ids=lambda row: row[0])
def test_a_mistake_in_a_command_gets_a_clear_answer(row):
    lacking, answer = lacks_of_command(*row)
    assert not lacking, answer


def test_there_are_as_many_as_were_once_counted_by_hand():
    assert len(FILES) + len(SHEETS) + len(COMMANDS) >= 126
