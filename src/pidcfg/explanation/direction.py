"""The words for the direction of control, of which some mean the opposite with another vendor."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pidcfg.explanation.page import Value
from pidcfg.explanation.question import Thing
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.explanation.page import Page
    from pidcfg.explanation.question import Asked

ASKED = "action"
"""What people ask for, whatever the vendor's key is called."""
RISES = {True: "the PV rises with the output (heating)", False: "the PV falls when the output rises (cooling)"}


@dataclass(frozen=True, slots=True)
class Direction:
    """A vendor's key for the direction, whose action its words name, and how each word is set."""

    key: str
    whose: str
    words: Mapping[str, str]
    """Each word as `pidcfg.encoders.tuned.Tuned` has it, which says whether that is heating."""


def find(vendor: str, thing: Thing, asked: Asked) -> list[Page]:
    """What a thing is with a vendor; words for the direction lead to the key that sets it."""
    book = VENDORS[vendor].load("explainer")
    own: Direction = book.direction
    head, dot, last = thing.name.rpartition(".")
    word = _word(own, last, thing.value)
    if word is None and (last.lower() != ASKED or thing.value is not None):
        pages: list[Page] = book.find(thing, asked)
    else:
        pages = book.find(Thing(thing.text, f"{head}{dot}{own.key}", None), asked)
    return [_told(page, vendor, own, word) for page in pages]


def _word(own: Direction, last: str, value: str | None) -> str | None:
    """The word that was asked for: ``reverse``, or ``action=reverse``."""
    name = last.lower()
    if value is None:
        return name if name in own.words and name != own.key.lower() else None
    return value.lower() if name in {ASKED, own.key.lower()} and value.lower() in own.words else None


def _told(page: Page, vendor: str, own: Direction, word: str | None) -> Page:
    """A page of the direction with what its words mean here and elsewhere."""
    if own.key not in {page.key, *(point.key for point in page.points)}:
        return page
    if word is not None and not page.origins:
        page = replace(page, value=Value(word, word, RISES[heats(vendor)[word]]), points=())
    if page.value is not None and not page.value.text and page.value.shown in own.words:
        page = replace(page, value=page.value._replace(text=RISES[heats(vendor)[page.value.shown]]))
    return replace(page, notes=(*page.notes, *_notes(vendor, own)))


def heats(vendor: str) -> dict[str, bool]:
    """Whether the PV rises with the output, by the vendor's words."""
    own: Direction = VENDORS[vendor].load("explainer").direction
    heating = VENDORS[vendor].load("tuned").heating
    return {word: content == heating for word, content in own.words.items()}


def _notes(vendor: str, own: Direction) -> Iterator[str]:
    mine = heats(vendor)
    if not mine:
        return
    meant = "; ".join(f"{word}: {RISES[heating]}" for word, heating in mine.items())
    yield f"the word names {own.whose} action. {meant}"
    same: list[str] = []
    opposite: list[str] = []
    for other in VENDORS:
        theirs = heats(other)
        shared = [word for word in mine if word in theirs]
        if other != vendor and shared:
            (same if all(mine[w] == theirs[w] for w in shared) else opposite).append(VENDORS[other].title)
    if opposite:
        told = f"; the same: {', '.join(same)}" if same else ""
        yield f"the same word means the opposite with {', '.join(opposite)}{told}"
