"""Typical mistakes: the whole of what is said to each is what somebody has read and judged."""

from __future__ import annotations

import pytest

import mistakes

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
