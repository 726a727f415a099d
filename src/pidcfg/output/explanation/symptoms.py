"""What people see at a panel, by its usual names, and what to look at: the rows of ``symptoms.toml`` as pages."""

from __future__ import annotations

import re
import unicodedata
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.encoders.regmap import Meaning
from pidcfg.output.explanation.answer import SYMPTOM, Page, Point
from pidcfg.output.explanation.book import book_of
from pidcfg.output.explanation.page import Question
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

D940 = Decision(
    940,
    "what people see is a table of its own",
    "`explain` knows what a loop does wrong by its usual names, in English and German, and says for every PLC what to "
    "look at, the likeliest first. The registers are named as the vendor's tables have them, the rules by their codes; "
    "what they have to do with it follows from the manuals, their order is ours. Of several names that a question has "
    "in it, that of most words counts; names of as many words are all answered.",
    "The manuals have a page of causes for the DL06 only, and none has all five PLCs side by side. A person at a "
    "cabinet knows what he sees, not the register.",
)
TABLE = Path(__file__).with_name("symptoms.toml")
WORD = re.compile(r"[^\W_]+")
NONE_OF = re.compile(r"\b(?:no|kein(?:en?|er|es|em)?)\s+(?=[^\W_])")
"""What makes one word with the next: ``no pv`` is not said of a text with ``no`` and ``pv`` in it."""
SPELLINGS = (("ae", "a"), ("oe", "o"), ("ue", "u"), ("setpoint", "set point"))
"""Letters and words of two spellings."""
BEGINNING, ENDING = 4, 4
"""Letters of a word from which on it is the beginning of others, and letters that are only their ending."""
_FILLERS = """
    a an the of in on at is are be to it its my our this that when why how what does do did with for and or by has have
    der die das ein eine im in am ist sind wird zu von mein warum wie was mit bei auf und nach
    bit which where register value parameter address wo welches loop loops pid plc controller regler regelkreis
"""
FILLERS = frozenset(_FILLERS.split())
"""Words that say nothing of what is wrong."""


class Cause(NamedTuple):
    """What to look at with a vendor: registers as `pidcfg explain` knows them, what they have to do with it, rules."""

    at: tuple[str, ...]
    see: str
    rules: tuple[str, ...]


@frozen
class Symptom:
    """A row: what it is, what is true of every PLC, its names, and the causes by vendor, the likeliest first."""

    title: str
    says: str
    words: tuple[str, ...]
    causes: Mapping[str, tuple[Cause, ...]]


@cache
def symptoms() -> tuple[Symptom, ...]:
    """All rows."""
    import tomllib

    return rows_of(tomllib.loads(TABLE.read_text("utf-8"))["symptom"])


def rows_of(rows: Iterable[Mapping[str, Any]]) -> tuple[Symptom, ...]:
    """Rows of a table."""
    return tuple(map(_symptom, rows))


def _symptom(row: Mapping[str, Any]) -> Symptom:
    causes = {
        key: tuple(Cause(tuple(cause["at"]), cause["see"], tuple(cause["rules"])) for cause in row[key])
        for key in VENDORS
        if key in row
    }
    return Symptom(row["title"], row["says"], tuple(row["words"]), causes)


def words_of(text: str) -> list[str]:
    """The words of a text in one spelling: small letters, without dots and accents."""
    plain = "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(c))
    for spelling, other in SPELLINGS:
        plain = plain.replace(spelling, other)
    return WORD.findall(NONE_OF.sub("no", plain))


@cache
def _phrases() -> tuple[tuple[tuple[str, ...], Symptom], ...]:
    """Every name with its words, and whose it is."""
    return tuple((tuple(words_of(phrase)), row) for row in symptoms() for phrase in row.words)


def _is(word: str, asked: str) -> bool:
    return asked == word or (len(word) >= BEGINNING and asked.startswith(word))


def _is_all(word: str, asked: str) -> bool:
    return _is(word, asked) and len(asked) - len(word) <= ENDING


def has_words(asked: Sequence[str], words: Sequence[str]) -> bool:
    """Whether each of some words, or one that begins with it, is among those that were asked."""
    return all(any(_is(word, one) for one in asked) for word in words)


def named_by(text: str, *, whole: bool = False) -> list[Symptom]:
    """The symptoms that a text names, by the name of most words; ``whole``: by one that leaves no word over."""
    asked = words_of(text)
    telling = [word for word in asked if word not in FILLERS]
    best: list[Symptom] = []
    most = 0
    for words, row in _phrases():
        if len(words) < most or not has_words(asked, words):
            continue
        if whole and not all(any(_is_all(word, one) for word in words) for one in telling):
            continue
        best = [row] if len(words) > most else [*best, *([] if row in best else [row])]
        most = len(words)
    return best


def pages_of(rows: Iterable[Symptom], vendors: Sequence[str]) -> list[Page]:
    """A page of each symptom for each vendor that it has causes with; for another one only what is always true."""
    return [page for row in rows for page in _pages(row, vendors)]


def _pages(row: Symptom, vendors: Sequence[str]) -> list[Page]:
    always = Page(SYMPTOM, row.words[0], row.title, meaning=Meaning(row.says))
    pages = []
    for key in vendors:
        causes = row.causes.get(key, ())
        points = tuple(_point(key, cause) for cause in causes)
        title = VENDORS[key].title
        pages += [Page(SYMPTOM, row.words[0], row.title, key, title, meaning=always.meaning, points=points)] * bool(
            points
        )
    return pages or [always]


def _point(vendor: str, cause: Cause) -> Point:
    titles = "; ".join(title for title in dict.fromkeys(title_of(vendor, name) for name in cause.at) if title)
    return Point(
        ", ".join(cause.at), titles or cause.see, meaning=Meaning(cause.see if titles else "", "", cause.rules)
    )


def title_of(vendor: str, name: str) -> str:
    """What a register is called; empty where its name says it all."""
    page = book_of(vendor).find(Question(name, name))[0]
    title = (page.points[0].title if page.kind == "bit" else page.title).partition(" [")[0]
    return "" if title == "a switch" else title
