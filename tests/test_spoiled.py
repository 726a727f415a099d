"""Of the answers to spoiled files, which ``generated`` compares in full, every eighth; and the sound file itself."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

import spoiled_configurations as configurations
import spoiled_listings as listings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

SHARE = 8
"""One of so many faults is tried here."""


def compare(golden: Path, source: listings.Source, faults: Callable[..., Iterator[listings.Spoiled]]) -> None:
    """A part of the answers with those that are committed."""
    sound = source.read(source.text)
    wanted, *answers = golden.read_text("utf-8").split("\n=== ")
    assert sound.rstrip() == wanted.rstrip("\n")
    spoiled = [*faults(source.text, source.places, source.part)]
    for (change, text), answer in [*zip(spoiled, answers, strict=True)][::SHARE]:
        assert [change, *listings.answer(source.read, text, sound)] == answer.splitlines()


@pytest.mark.parametrize("name", listings.SOURCES)
def test_a_spoiled_listing_is_answered_as_it_was(name):
    compare(listings.FOLDER / f"{name}.txt", listings.SOURCES[name](), listings.spoiled)


@pytest.mark.parametrize("name", [name for name in configurations.SOURCES if "-to-" in name])
def test_a_spoiled_configuration_is_converted_as_it_was(name):
    faults = partial(configurations.spoiled, numbers=configurations.MILD)
    compare(configurations.FOLDER / f"{name}.txt", configurations.SOURCES[name](), faults)
