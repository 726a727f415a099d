"""What people ask in words: what they see at a panel, messages of pidcfg's own, how they spell a bit or a reference."""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from pidcfg.encoders.listing import FIRST_REFERENCE
from pidcfg.encoders.regmap import Meaning
from pidcfg.output.explanation import SYMPTOM_KIND, Page, Point
from pidcfg.output.explanation.book import Book, book_of
from pidcfg.output.explanation.page import Question
from pidcfg.output.explanation.registers import Registers
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.validate import PID_PREFIX, rule_texts
from pidcfg.validate.catalog import CODE_PATTERN
from pidcfg.vendors import VENDORS

# --- What people see at a panel, by its usual names, and what to look at: the rows of symptoms.toml -------------------

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
SYMPTOMS_FILE = Path(__file__).with_name("symptoms.toml")
WORD_PATTERN = re.compile(r"[^\W_]+")
NEGATION_PATTERN = re.compile(r"\b(?:no|kein(?:en?|er|es|em)?)\s+(?=[^\W_])")
"""What makes one word with the next: ``no pv`` is not said of a text with ``no`` and ``pv`` in it."""
SPELLINGS = (("ae", "a"), ("oe", "o"), ("ue", "u"), ("setpoint", "set point"))
"""Letters and words of two spellings."""
MIN_PREFIX_LETTERS, MAX_ENDING_LETTERS = 4, 4
"""Letters of a word from which on it is the beginning of others, and letters that are only their ending."""
_FILLERS = """
    a an the of in on at is are be to it its my our this that when why how what does do did with for and or by has have
    der die das ein eine im in am ist sind wird zu von mein warum wie was mit bei auf und nach
    bit which where register value parameter address wo welches loop loops pid plc controller regler regelkreis
"""
FILLER_WORDS = frozenset(_FILLERS.split())
"""Words that say nothing of what is wrong."""


class Cause(NamedTuple):
    """What to look at with a vendor: registers as `pidcfg explain` knows them, what they have to do with it, rules."""

    registers: tuple[str, ...]
    advice: str
    rules: tuple[str, ...]


@frozen
class Symptom:
    """A row: what it is, what is true of every PLC, its names, and the causes by vendor, the likeliest first."""

    title: str
    meaning: str
    names: tuple[str, ...]
    causes: Mapping[str, tuple[Cause, ...]]


@cache
def symptoms() -> tuple[Symptom, ...]:
    """All rows."""
    import tomllib

    return parse_symptoms(tomllib.loads(SYMPTOMS_FILE.read_text("utf-8"))["symptom"])


def parse_symptoms(rows: Iterable[Mapping[str, object]]) -> tuple[Symptom, ...]:
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
    text = "".join(c for c in unicodedata.normalize("NFKD", text.casefold()) if not unicodedata.combining(c))
    for spelling, other in SPELLINGS:
        text = text.replace(spelling, other)
    return WORD_PATTERN.findall(NEGATION_PATTERN.sub("no", text))


@cache
def _phrases() -> tuple[tuple[tuple[str, ...], Symptom], ...]:
    """Every name with its words, and whose it is."""
    return tuple((tuple(words_of(phrase)), row) for row in symptoms() for phrase in row.names)


def _matches_prefix(word: str, question_word: str) -> bool:
    return question_word == word or (len(word) >= MIN_PREFIX_LETTERS and question_word.startswith(word))


def _matches_inflection(word: str, question_word: str) -> bool:
    return _matches_prefix(word, question_word) and len(question_word) - len(word) <= MAX_ENDING_LETTERS


def has_words(question_words: Sequence[str], words: Sequence[str]) -> bool:
    """Whether each of some words, or one that begins with it, is among those that were asked."""
    return all(any(_matches_prefix(word, one) for one in question_words) for word in words)


def symptoms_in(text: str, *, all_words: bool = False) -> list[Symptom]:
    """The symptoms that a text names, by the name of most words; ``all_words``: by one that leaves no word over."""
    question_words = words_of(text)
    telling_words = [word for word in question_words if word not in FILLER_WORDS]
    matches: list[Symptom] = []
    most_words = 0
    for words, row in _phrases():
        if len(words) < most_words or not has_words(question_words, words):
            continue
        if all_words and not all(any(_matches_inflection(word, one) for word in words) for one in telling_words):
            continue
        matches = [row] if len(words) > most_words else [*matches, *([] if row in matches else [row])]
        most_words = len(words)
    return matches


def symptom_pages(rows: Iterable[Symptom], vendors: Sequence[str]) -> list[Page]:
    """A page of each symptom for each vendor that it has causes with; for another one only what is always true."""
    return [page for row in rows for page in _pages_by_vendor(row, vendors)]


def _pages_by_vendor(row: Symptom, vendors: Sequence[str]) -> list[Page]:
    general_page = Page(SYMPTOM_KIND, row.names[0], row.title, meaning=Meaning(row.meaning))
    pages = []
    for key in vendors:
        causes = row.causes.get(key, ())
        points = tuple(_cause_point(key, cause) for cause in causes)
        title = VENDORS[key].title
        pages += [
            Page(SYMPTOM_KIND, row.names[0], row.title, key, title, meaning=general_page.meaning, points=points)
        ] * bool(points)
    return pages or [general_page]


def _cause_point(vendor: str, cause: Cause) -> Point:
    titles = "; ".join(title for title in dict.fromkeys(title_of(vendor, name) for name in cause.registers) if title)
    return Point(
        ", ".join(cause.registers),
        titles or cause.advice,
        meaning=Meaning(cause.advice if titles else "", "", cause.rules),
    )


def title_of(vendor: str, name: str) -> str:
    """What a register is called; empty where its name says it all."""
    page = book_of(vendor).find(Question(name, name))[0]
    title = (page.points[0].title if page.kind == "bit" else page.title).partition(" [")[0]
    return "" if title == "a switch" else title


# --- What pidcfg itself says, asked for as it stands: a message, a line of the checklist, a note of a run -------------

MESSAGES_FILE = Path(__file__).with_name("messages.toml")
LINES_KEY = "line"
PLACEHOLDER = re.compile(r"\{[^{}]*\}")
"""Where a template has something else each time."""
MIN_LETTERS, MIN_HEAD_LETTERS = 6, 15
"""Letters that a template, and a beginning of one, must have of its own."""
DETAIL_SIGN = re.compile(r" \(|[:;] ")
"""What a message goes into detail with."""
LOCATION_PREFIX = re.compile(
    r"^\s*(?:\S+:[0-9]+(?::[0-9]+)?:?\s+)?(?:(?:error|warning|info|note|Error|check after the download):?\s+)?"
)
"""What stands before a message in a terminal."""
LOOP_SUFFIX = re.compile(r"\s*\[[^\][]+\]$")
WRITTEN_CODE = re.compile(rf"\b{CODE_PATTERN.pattern}\b")
WRITTEN_ADDRESS = re.compile(r"\b([A-Z]{1,2})[0-9]+\b")
SPACES = re.compile(r"\s+")


class Template(NamedTuple):
    """A text with holes, as a pattern; ``own``: how many of its letters are its own."""

    pattern: re.Pattern[str]
    letters: int
    subject: str | Symptom
    """The code of a rule, or a line."""

    @classmethod
    def from_text(cls, text: str, subject: str | Symptom) -> Template:
        """``unknown key {}`` as a pattern."""
        parts = [re.escape(SPACES.sub(" ", part)) for part in PLACEHOLDER.split(text)]
        letters = sum(map(len, PLACEHOLDER.split(text)))
        return cls(re.compile(".*?".join(parts), re.IGNORECASE), letters, subject)


@cache
def templates() -> tuple[Template, ...]:
    """Those of all rules, then those of the table; a text that is nothing but a hole is none."""
    import tomllib

    table = tomllib.loads(MESSAGES_FILE.read_text("utf-8"))
    templates = [Template.from_text(rule.message, code) for code, rule in rule_texts().items()]
    templates += [Template.from_text(text, code) for code, texts in table["rules"].items() for text in texts]
    templates += [Template.from_text(text, row) for row in parse_symptoms(table[LINES_KEY]) for text in row.names]
    return tuple(template for template in templates if template.letters >= MIN_LETTERS)


@cache
def template_heads() -> tuple[Template, ...]:
    """Messages up to where they go into detail: people ask for as much as a line on their screen has."""
    heads = [(DETAIL_SIGN.split(rule.message, maxsplit=1), code) for code, rule in rule_texts().items()]
    templates = [Template.from_text(parts[0], code) for parts, code in heads if len(parts) > 1]
    return tuple(template for template in templates if template.letters >= MIN_HEAD_LETTERS)


def message_subjects(text: str, vendors: Sequence[str]) -> list[str | Symptom]:
    """The rules, by their codes, and lines that a text is of: by a code in it, and by its wording."""
    subjects: list[str | Symptom] = [code for code in dict.fromkeys(WRITTEN_CODE.findall(text)) if code in rule_texts()]
    templates = [template for template in _matching_templates(text) if _is_of_vendors(template, vendors)]
    banks = set(WRITTEN_ADDRESS.findall(text))
    vendors_addressed = [key for key in vendors if banks & {*VENDORS[key].banks}]
    templates = [
        template for template in templates if _is_of_vendors(template, vendors_addressed, shared=False)
    ] or templates
    most_letters = max((template.letters for template in templates), default=0)
    for template in templates:
        if template.letters == most_letters and template.subject not in subjects:
            subjects.append(template.subject)
    return subjects


def _is_of_vendors(template: Template, vendors: Sequence[str], *, shared: bool = True) -> bool:
    """Whether a template is of one of some vendors; ``shared``: or of all."""
    prefixes = tuple(VENDORS[key].prefix for key in vendors)
    if not isinstance(template.subject, str) or template.subject.startswith(PID_PREFIX):
        return shared
    return template.subject.startswith(prefixes)


def _matching_templates(text: str) -> Iterator[Template]:
    """The templates that a text is of: as it stands, without its place, without the loop behind or before it."""
    line = SPACES.sub(" ", text).strip()
    message = LOCATION_PREFIX.sub("", line)
    texts = {line, message, LOOP_SUFFIX.sub("", message), message.partition(": ")[2] or message}
    matches = [template for template in templates() if any(map(template.pattern.fullmatch, texts))]
    letters = max((template.letters for template in matches), default=None)
    heads = (t for t in template_heads() if letters in {None, t.letters} and any(map(t.pattern.fullmatch, texts)))
    return iter((*matches, *heads))


# --- How people write what they ask: a bit in words, a bit by its own letter, a Modbus reference ----------------------

D941 = Decision(
    941,
    "a Modbus reference has five or six digits",
    "Its first digit is the table, the others count from 1: 40001 and 400001 are holding register 0. It is explained "
    "with each vendor whose numbering is known; of the others the project's map says it.",
    "Both lengths are in use, and a number alone does not say whose it is.",
)
ASKING_WORD, WITHIN_WORD = "(?:what|was|is|ist|means|the|das)", "(?:of|in|von|vom|im|der|des)"
BIT_FIRST = re.compile(
    rf"(?:{ASKING_WORD}\s+)*bit\s*([0-9]{{1,2}})\s+{WITHIN_WORD}\s+(?:word\s+|wort\s+)?(\S.*)", re.IGNORECASE
)
BIT_LAST = re.compile(r"(\S.*?)[\s,]+bit\s*([0-9]{1,2})", re.IGNORECASE)
BIT_SUFFIX = re.compile(r"([A-Za-z]{0,4} ?\+ ?[0-9]+|[A-Za-z]{1,2}[0-9]+)\s*[:/]\s*([0-9]{1,2})")
SPACED_ADDRESS = re.compile(r"([A-Za-z]{1,2}) ([0-9]+(?:\.[0-9]{1,2})?)")
OFFSET_WITHOUT_PLUS = re.compile(r"(Cn|DSn|DFn|Base|addr) ?([0-9]{1,2}(?:\.[0-9]{1,2})?)", re.IGNORECASE)
BIT_OF_WORD = re.compile(r"[Bb]([0-7]+\.[0-9]{1,2})")
"""How the DirectLOGIC family writes a bit of a V-memory word: ``B7642.3``."""
TERM_NAME = re.compile(r"([PID])[ -](gain|time)", re.IGNORECASE)
"""How people call the three numbers: ``P gain``, ``I time``."""
TERM_BY_LETTER = {"p": "proportional", "i": "integral", "d": "derivative"}
_BIT = r"(?:\.[0-9]{1,2})?"
_NAMES = (
    rf"(?:(?:addr|cn|dsn|dfn|base|ramp) ?)?\+ ?[0-9]{{1,2}}{_BIT}",
    rf"(?:V|C|DS|DF|R|S|CK|AT)[0-9]{{1,6}}{_BIT}",
    r"error [0-9]{1,3}",
    r"[04][0-9]{4,5}",
)
NAME_IN_TEXT = re.compile(
    rf"(?<![\w.+])(?:bit\s*(?P<first>[0-9]{{1,2}})\s+\w+\s+)?(?P<name>{'|'.join(_NAMES)})(?!\w)"
    r"(?:,?\s+bit\s*(?P<last>[0-9]{1,2}))?",
    re.IGNORECASE,
)
"""Addresses, offsets, error numbers and references in a sentence, with their bits."""
NAME_AND_VALUE = re.compile(r"([A-Za-z]\w*) ((?:0x)?[0-9A-Fa-f]+)", re.ASCII)
"""A name and a content without the sign between them: ``ErrBits 4``."""
REFERENCE_PATTERN = re.compile(r"[0134][0-9]{4,5}")


def usual_spelling(name: str) -> str:
    """A name with its bit as the tables have it: ``bit 10 of V2006``, ``V2006 bit 10``, ``V2006:10``, ``B2006.10``."""
    name = name.strip(" '\"`?!")
    if match := BIT_FIRST.fullmatch(name):
        name = f"{match[2]}.{match[1]}"
    elif match := BIT_LAST.fullmatch(name) or BIT_SUFFIX.fullmatch(name):
        name = f"{match[1].rstrip(' ,')}.{match[2]}"
    if match := SPACED_ADDRESS.fullmatch(name):
        name = f"{match[1]}{match[2]}"
    if match := OFFSET_WITHOUT_PLUS.fullmatch(name):
        name = f"{match[1]}+{match[2]}"
    if match := BIT_OF_WORD.fullmatch(name):
        name = f"V{match[1]}"
    if match := TERM_NAME.fullmatch(name):
        name = f"{TERM_BY_LETTER[match[1].lower()]} {match[2]}"
    return name


def names_in_text(text: str) -> list[str]:
    """What a sentence is about that has an address or a number of its own."""
    matches = NAME_IN_TEXT.finditer(text)
    return list(dict.fromkeys(f"{m['name']}.{m['first'] or m['last']}".removesuffix(".None") for m in matches))


def reference_pages(question: Question, vendors: Sequence[str]) -> Iterator[Page]:
    """What a Modbus reference is with the vendors whose numbering is known: ``40001``, ``41025``, ``428673``."""
    if not REFERENCE_PATTERN.fullmatch(question.name):
        return
    number = int(question.name)
    is_long = len(question.name) - len("40001")
    table, first = max(
        ((table, firsts[is_long]) for table, firsts in FIRST_REFERENCE.items() if firsts[is_long] <= number),
        key=lambda row: row[1],
        default=("coil", 1),
    )
    for key in vendors:
        try:
            entry = VENDORS[key].load("numbering").find(table, number - first)
        except LookupError:
            continue
        book = book_of(key)
        if entry is None or not isinstance(book, Registers):
            continue
        name = book.space.name(entry[0])
        part = f", its register {entry[1] + 1}" if entry[1] else ""
        note = f"Modbus reference {question.name} is {table} {number - first}, counted from 0: {name}{part}"
        for page in book.find(replace(question, name=name)):
            yield replace(page, notes=(note, *page.notes))


MAX_FILLER_LETTERS = 2
"""Letters of a word that says nothing of what it is about."""


def names_with_words(name: str, book: Book) -> list[str]:
    """The names and titles of a vendor that have all words of a name; the name itself where there is one."""
    words = [word for word in words_of(name) if word not in FILLER_WORDS]
    if "_" in name or not any(word.isalpha() and len(word) > MAX_FILLER_LETTERS for word in words):
        return []
    names = [other for other in book.spellings if has_words(words_of(other), words)]
    return [other for other in names if words_of(other) == words] or names


MIN_LIKENESS = 0.75
"""How alike two words are of which one is the other's misspelling."""


def nearest_name(name: str, names: Iterable[str]) -> str | None:
    """The name that was probably meant: it has all words, each begun alike and almost spelled alike, and few others."""
    name_words = words_of(name)
    if not all(map(str.isalpha, name_words)):
        return None
    best, nearest = (0.0, 0), None
    for candidate in names:
        words = words_of(candidate)
        if not name_words or len(words) < len(name_words) or (len(name_words) == 1 < len(words)):
            continue
        rank = min(max((_likeness(word, one) for one in words), default=0.0) for word in name_words), -len(words)
        if rank[0] >= MIN_LIKENESS and rank > best:
            best, nearest = rank, candidate
    return nearest


def _likeness(word: str, other: str) -> float:
    """How alike two words are that begin alike."""
    return difflib.SequenceMatcher(None, word, other).ratio() if word[0] == other[0] else 0.0
