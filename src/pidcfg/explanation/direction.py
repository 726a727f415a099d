"""The words for the direction of control, of which some mean the opposite with another vendor."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.explanation.page import Value
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.explanation.book import Book, Direction
    from pidcfg.explanation.page import Page
    from pidcfg.explanation.question import Question

ACTION = "action"
"""What people ask for, whatever the vendor's key is called."""
PV_RISES = {
    True: "PV rises when the output rises (as in heating)",
    False: "PV falls when the output rises (as in cooling)",
}
"""Where the PV goes, as a fact of a loop."""
RISES = {True: "the PV rises with the output (heating)", False: "the PV falls when the output rises (cooling)"}
"""The same of a word for the direction."""


def find(vendor: str, question: Question) -> list[Page]:
    """What a question is about with a vendor; words for the direction lead to the key that sets it."""
    book: Book = VENDORS[vendor].load("explainer")
    head, dot, last = question.name.rpartition(".")
    word = _word(book.direction, last, question.value)
    if word is not None or (last.lower() == ACTION and question.value is None):
        question = replace(question, name=f"{head}{dot}{book.direction.key}", value=None)
    return [_with_direction(page, vendor, book.direction, word) for page in book.find(question)]


def _word(direction: Direction, last: str, value: str | None) -> str | None:
    """The word that a question is about: ``reverse``, or ``action=reverse``."""
    name, key = last.lower(), direction.key.lower()
    if value is None:
        return name if name in direction.words and name != key else None
    return value.lower() if name in {ACTION, key} and value.lower() in direction.words else None


def _with_direction(page: Page, vendor: str, direction: Direction, word: str | None) -> Page:
    """A page of the direction with what its words mean here and elsewhere."""
    if direction.key not in {page.key, *(point.key for point in page.points)}:
        return page
    if word is not None and not page.origins:
        page = replace(page, value=Value(word, word, RISES[heats(vendor)[word]]), points=())
    if page.value is not None and not page.value.text and page.value.shown in direction.words:
        page = replace(page, value=page.value._replace(text=RISES[heats(vendor)[page.value.shown]]))
    return replace(page, notes=(*page.notes, *_notes(vendor, direction)))


def heats(vendor: str) -> dict[str, bool]:
    """Whether the PV rises with the output, by the vendor's words."""
    book: Book = VENDORS[vendor].load("explainer")
    heating = VENDORS[vendor].load("tuned").heating
    return {word: content == heating for word, content in book.direction.words.items()}


def _notes(vendor: str, direction: Direction) -> Iterator[str]:
    """Whose action the words name, and the vendors with whom a word means the same or the opposite."""
    words = heats(vendor)
    if not words:
        return
    texts = "; ".join(f"{word}: {RISES[heating]}" for word, heating in words.items())
    yield f"the word names {direction.whose} action. {texts}"
    same: list[str] = []
    opposite: list[str] = []
    for key, other in VENDORS.items():
        meanings = heats(key)
        shared = [word for word in words if word in meanings]
        if key != vendor and shared:
            (same if all(words[w] == meanings[w] for w in shared) else opposite).append(other.title)
    if opposite:
        agreeing = f"; the same: {', '.join(same)}" if same else ""
        yield f"the same word means the opposite with {', '.join(opposite)}{agreeing}"
