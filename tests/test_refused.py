"""What readers refuse is refused at its place and in the words that somebody has read, to the last letter."""

from __future__ import annotations

import pytest

import refused


@pytest.mark.parametrize("name", refused.BOOKS)
def test_every_refusal_is_that_of_its_book(name):
    assert "".join(refused.BOOKS[name]()) == (refused.FOLDER / f"{name}.txt").read_text("utf-8")
