"""Listings with one small fault each are answered as the committed answers say, byte for byte."""

from __future__ import annotations

import pytest

import spoiled_listings


@pytest.mark.parametrize("name", spoiled_listings.SOURCES)
def test_what_is_said_of_a_listing_with_a_fault(name):
    assert spoiled_listings.answers(name).encode() == (spoiled_listings.FOLDER / f"{name}.txt").read_bytes()
