"""What readers refuse is refused at its place and in the words that somebody has read, to the last letter."""

from __future__ import annotations

import pytest

import refused
import spoiled_listings as spoiled

PROGRAMS = [name for name in spoiled.SOURCES if "-by-hand-" in name or name.endswith("-function-block")]


@pytest.mark.parametrize("name", refused.BOOKS)
def test_every_refusal_is_that_of_its_book(name):
    assert "".join(refused.BOOKS[name]()) == (refused.FOLDER / f"{name}.txt").read_text("utf-8")


@pytest.mark.parametrize("name", PROGRAMS)
def test_every_sixth_fault_of_a_program_is_answered_as_it_was(name):
    source = spoiled.SOURCES[name]()
    sound = source.read(source.text)
    _, *answers = (spoiled.FOLDER / f"{name}.txt").read_text("utf-8").split("\n=== ")
    faults = [*spoiled.spoiled(source.text, source.places, source.part)]
    for (change, text), wanted in [*zip(faults, answers, strict=True)][::6]:
        assert [change, *spoiled.answer(source.read, text, sound)] == wanted.splitlines()
