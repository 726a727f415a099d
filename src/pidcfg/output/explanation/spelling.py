"""How people write what they ask: a bit in words, a bit by its own letter, a Modbus reference."""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.encoders.listing import FIRST_REFERENCE
from pidcfg.output.explanation.book import book_of
from pidcfg.output.explanation.registers import Registers
from pidcfg.output.explanation.symptoms import FILLERS, has_words, words_of
from pidcfg.text.references import Decision
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from pidcfg.output.explanation.answer import Page
    from pidcfg.output.explanation.book import Book
    from pidcfg.output.explanation.page import Question

D941 = Decision(
    941,
    "a Modbus reference has five or six digits",
    "Its first digit is the table, the others count from 1: 40001 and 400001 are holding register 0. It is explained "
    "with each vendor whose numbering is known; of the others the project's map says it.",
    "Both lengths are in use, and a number alone does not say whose it is.",
)
ASKING, WITHIN = "(?:what|was|is|ist|means|the|das)", "(?:of|in|von|vom|im|der|des)"
BIT_FIRST = re.compile(rf"(?:{ASKING}\s+)*bit\s*([0-9]{{1,2}})\s+{WITHIN}\s+(?:word\s+|wort\s+)?(\S.*)", re.IGNORECASE)
BIT_LAST = re.compile(r"(\S.*?)[\s,]+bit\s*([0-9]{1,2})", re.IGNORECASE)
BIT_BEHIND = re.compile(r"([A-Za-z]{0,4} ?\+ ?[0-9]+|[A-Za-z]{1,2}[0-9]+)\s*[:/]\s*([0-9]{1,2})")
SPACED = re.compile(r"([A-Za-z]{1,2}) ([0-9]+(?:\.[0-9]{1,2})?)")
NO_PLUS = re.compile(r"(Cn|DSn|DFn|Base|addr) ?([0-9]{1,2}(?:\.[0-9]{1,2})?)", re.IGNORECASE)
BIT_OF_WORD = re.compile(r"[Bb]([0-7]+\.[0-9]{1,2})")
"""How the DirectLOGIC family writes a bit of a V-memory word: ``B7642.3``."""
TERM = re.compile(r"([PID])[ -](gain|time)", re.IGNORECASE)
"""How people call the three numbers: ``P gain``, ``I time``."""
TERMS = {"p": "proportional", "i": "integral", "d": "derivative"}
_BIT = r"(?:\.[0-9]{1,2})?"
_NAMES = (
    rf"(?:(?:addr|cn|dsn|dfn|base|ramp) ?)?\+ ?[0-9]{{1,2}}{_BIT}",
    rf"(?:V|C|DS|DF|R|S|CK|AT)[0-9]{{1,6}}{_BIT}",
    r"error [0-9]{1,3}",
    r"[04][0-9]{4,5}",
)
WITHIN_TEXT = re.compile(
    rf"(?<![\w.+])(?:bit\s*(?P<first>[0-9]{{1,2}})\s+\w+\s+)?(?P<name>{'|'.join(_NAMES)})(?!\w)"
    r"(?:,?\s+bit\s*(?P<last>[0-9]{1,2}))?",
    re.IGNORECASE,
)
"""Addresses, offsets, error numbers and references in a sentence, with their bits."""
CONTENT_BEHIND = re.compile(r"([A-Za-z]\w*) ((?:0x)?[0-9A-Fa-f]+)", re.ASCII)
"""A name and a content without the sign between them: ``ErrBits 4``."""
REFERENCE = re.compile(r"[0134][0-9]{4,5}")


def spelled(name: str) -> str:
    """A name with its bit as the tables have it: ``bit 10 of V2006``, ``V2006 bit 10``, ``V2006:10``, ``B2006.10``."""
    name = name.strip(" '\"`?!")
    if match := BIT_FIRST.fullmatch(name):
        name = f"{match[2]}.{match[1]}"
    elif match := BIT_LAST.fullmatch(name) or BIT_BEHIND.fullmatch(name):
        name = f"{match[1].rstrip(' ,')}.{match[2]}"
    if match := SPACED.fullmatch(name):
        name = f"{match[1]}{match[2]}"
    if match := NO_PLUS.fullmatch(name):
        name = f"{match[1]}+{match[2]}"
    if match := BIT_OF_WORD.fullmatch(name):
        name = f"V{match[1]}"
    if match := TERM.fullmatch(name):
        name = f"{TERMS[match[1].lower()]} {match[2]}"
    return name


def within(text: str) -> list[str]:
    """What a sentence is about that has an address or a number of its own."""
    found = WITHIN_TEXT.finditer(text)
    return list(dict.fromkeys(f"{m['name']}.{m['first'] or m['last']}".removesuffix(".None") for m in found))


def referenced(question: Question, vendors: Sequence[str]) -> Iterator[Page]:
    """What a Modbus reference is with the vendors whose numbering is known: ``40001``, ``41025``, ``428673``."""
    if not REFERENCE.fullmatch(question.name):
        return
    number = int(question.name)
    long = len(question.name) - len("40001")
    table, first = max(
        ((table, firsts[long]) for table, firsts in FIRST_REFERENCE.items() if firsts[long] <= number),
        key=lambda row: row[1],
        default=("coil", 1),
    )
    for key in vendors:
        try:
            found = VENDORS[key].load("numbering").find(table, number - first)
        except LookupError:
            continue
        book = book_of(key)
        if found is None or not isinstance(book, Registers):
            continue
        name = book.space.name(found[0])
        part = f", its register {found[1] + 1}" if found[1] else ""
        note = f"Modbus reference {question.name} is {table} {number - first}, counted from 0: {name}{part}"
        for page in book.find(replace(question, name=name)):
            yield replace(page, notes=(note, *page.notes))


SHORT = 2
"""Letters of a word that says nothing of what it is about."""


def titled(name: str, book: Book) -> list[str]:
    """The names and titles of a vendor that have all words of a name; the name itself where there is one."""
    asked = [word for word in words_of(name) if word not in FILLERS]
    if "_" in name or not any(word.isalpha() and len(word) > SHORT for word in asked):
        return []
    found = [other for other in book.spellings if has_words(words_of(other), asked)]
    return [other for other in found if words_of(other) == asked] or found


ALIKE = 0.75
"""How alike two words are of which one is the other's misspelling."""


def mistyped(name: str, names: Iterable[str]) -> str | None:
    """The name that was probably meant: it has all words, each begun alike and almost spelled alike, and few others."""
    asked = words_of(name)
    if not all(map(str.isalpha, asked)):
        return None
    best, nearest = (0.0, 0), None
    for other in names:
        words = words_of(other)
        if not asked or len(words) < len(asked) or (len(asked) == 1 < len(words)):
            continue
        rank = min(max((_likeness(word, one) for one in words), default=0.0) for word in asked), -len(words)
        if rank[0] >= ALIKE and rank > best:
            best, nearest = rank, other
    return nearest


def _likeness(word: str, other: str) -> float:
    """How alike two words are that begin alike."""
    return difflib.SequenceMatcher(None, word, other).ratio() if word[0] == other[0] else 0.0
