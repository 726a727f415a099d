"""One question to all that knows an answer: vendors, rules, decisions, a configuration."""

from __future__ import annotations

import pkgutil
import re
from contextlib import suppress
from dataclasses import replace
from importlib import import_module
from typing import TYPE_CHECKING

from pidcfg.encoders.contract import tables_of
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.explanation import ExplainResult, Page, QuestionError, UnknownError, Value, rule_page
from pidcfg.output.explanation.book import book_of
from pidcfg.output.explanation.page import ADDRESS_PATTERN, MAX_QUOTED_LENGTH, ConfigIndex, Question
from pidcfg.output.explanation.registers import Registers
from pidcfg.output.explanation.wording import (
    NAME_AND_VALUE,
    REFERENCE_PATTERN,
    message_subjects,
    names_in_text,
    names_with_words,
    nearest_name,
    reference_pages,
    symptom_pages,
    symptoms_in,
    usual_spelling,
    words_of,
)
from pidcfg.text.references import Decision
from pidcfg.validate import rule_texts
from pidcfg.validate.catalog import CODE_PATTERN, suggest_code
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from pidcfg.output.explanation import Origin
    from pidcfg.output.explanation.book import Book, Direction
    from pidcfg.text.paths import Path
    from pidcfg.validate.engine import Checked

# --- The numbered decisions, wherever in the program they stand -------------------------------------------------------


class SameNumberError(ValueError):
    """Two decisions have one number."""


def all_decisions() -> list[Decision]:
    """Every decision, in the order of their numbers."""
    return [decision for _, decision in decisions_with_modules()]


def decisions_with_modules() -> list[tuple[str, Decision]]:
    """Every decision with the first module that names it, in the order of their numbers."""
    by_number: dict[int, tuple[str, Decision]] = {}
    for module, decision in _decisions_in_modules():
        if by_number.setdefault(decision.number, (module, decision))[1] is not decision:
            raise SameNumberError(f"two decisions have the number D{decision.number:02d}")
    return [by_number[number] for number in sorted(by_number)]


def _decisions_in_modules() -> Iterator[tuple[str, Decision]]:
    """The decisions of every module; those that an extra is missing for have none of their own."""
    package = import_module("pidcfg")
    for info in pkgutil.walk_packages(package.__path__, "pidcfg."):
        if info.name.endswith("__main__"):
            continue
        try:
            module = import_module(info.name)
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("pidcfg"):
                raise
            continue
        for value in vars(module).values():
            for entry in value if isinstance(value, tuple | list) else (value,):
                if isinstance(entry, Decision):
                    yield info.name, entry


# ----------------------------------------------------------------------------------------------------------------------
# What a configuration says of a name that no register map has: a loop, or a tag, point or signal that a key names.

PROSE_KEYS = frozenset(("description", "unit", "vendor"))
"""Keys whose texts name nothing."""


def mention_pages(config: ConfigIndex, name: str) -> list[Page]:
    """The page of a name, with every line that says it; none where no line does."""
    vendor = config.checked.vendor
    data = config.document.data or {}
    pattern = re.compile(rf"(?<![\w.]){re.escape(name)}(?![\w])", re.IGNORECASE)
    origins = [origin for path, text in _texts(data) if pattern.search(text) and (origin := _origin(config, path))]
    signals = data.get("signals")
    if isinstance(signals, dict):
        origins += [o for key in signals if pattern.fullmatch(key) and (o := config.origin(("signals", key), None))]
    loop = next((entry for entry in config.loops if entry.lower() == name.lower()), None)
    if vendor is None or not (origins or loop):
        return []
    title = "a loop of this configuration" if loop else _mention_title(origins)
    notes = _block_spans(config, loop) if loop else ()
    description = next(
        (str(entry.get("description") or "") for entry in data["loops"] if entry.get("name") == loop), ""
    )
    page = Page("named", loop or name, title, vendor.key, vendor.title, holds=description, loop=loop, notes=notes)
    return [replace(page, origins=tuple(origins))]


def _texts(data: object, path: Path = ()) -> Iterator[tuple[Path, str]]:
    """Every text of a configuration that may name something."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        if isinstance(value, str) and key not in PROSE_KEYS:
            yield (*path, key), value
        elif isinstance(value, dict | list):
            yield from _texts(value, (*path, key))


def _origin(config: ConfigIndex, path: Path) -> Origin | None:
    loop = config.loops[path[1]] if path[0] == "loops" and isinstance(path[1], int) else None
    return config.origin(path, loop)


def _mention_title(origins: list[Origin]) -> str:
    """What it is to the first line that names it."""
    first = origins[0]
    key = re.sub(r"^\w+\[\d+\]\.", "", first.key)
    return f"named at {key}" + (f" of {first.loop}" if first.loop else "")


def _block_spans(config: ConfigIndex, loop: str) -> tuple[str, ...]:
    """Where the loop's registers are."""
    spans: dict[str, tuple[int, int]] = {}
    for block in config.blocks:
        if block.loop == loop:
            first, last = spans.get(block.table.title, (block.start, 0))
            spans[block.table.title] = min(first, block.start), max(last, block.start + block.table.size - 1)
    name = config.encoding.space.name if spans else str
    return tuple(f"{title}: {name(first)} to {name(last)}" for title, (first, last) in spans.items())


# --- The words for the direction of control, of which some mean the opposite with another vendor ----------------------

ACTION_NAME = "action"
"""What people ask for, whatever the vendor's key is called."""
PV_RISES = {
    True: "PV rises when the output rises (as in heating)",
    False: "PV falls when the output rises (as in cooling)",
}
"""Where the PV goes, as a fact of a loop."""
DIRECTION_TEXTS = {
    True: "the PV rises with the output (heating)",
    False: "the PV falls when the output rises (cooling)",
}
"""The same of a word for the direction."""


def vendor_pages(vendor: str, question: Question) -> list[Page]:
    """What a question is about with a vendor; words for the direction lead to the key that sets it."""
    book = book_of(vendor)
    head, dot, key_name = question.name.rpartition(".")
    word = _direction_word(book.direction, key_name, question.value)
    if word is not None or (key_name.lower() == ACTION_NAME and question.value is None):
        question = replace(question, name=f"{head}{dot}{book.direction.key}", value=None)
    return [_with_direction(page, vendor, book.direction, word) for page in book.find(question)]


def _direction_word(direction: Direction, key_name: str, value: str | None) -> str | None:
    """The word that a question is about: ``reverse``, or ``action=reverse``."""
    name, key = key_name.lower(), direction.key.lower()
    if value is None:
        return name if name in direction.words and name != key else None
    return value.lower() if name in {ACTION_NAME, key} and value.lower() in direction.words else None


def _with_direction(page: Page, vendor: str, direction: Direction, word: str | None) -> Page:
    """A page of the direction with what its words mean here and elsewhere."""
    if direction.key not in {page.key, *(point.key for point in page.points)}:
        return page
    if word is not None and not page.origins:
        page = replace(page, value=Value(word, word, DIRECTION_TEXTS[heating_words(vendor)[word]]), points=())
    if page.value is not None and not page.value.text and page.value.shown in direction.words:
        page = replace(page, value=page.value._replace(text=DIRECTION_TEXTS[heating_words(vendor)[page.value.shown]]))
    return replace(page, notes=(*page.notes, *_direction_notes(vendor, direction)))


def heating_words(vendor: str) -> dict[str, bool]:
    """Whether the PV rises with the output, by the vendor's words."""
    book, heating = book_of(vendor), tables_of(VENDORS[vendor]).TUNING_NUMBERS.heating
    return {word: content == heating for word, content in book.direction.words.items()}


def _direction_notes(vendor: str, direction: Direction) -> Iterator[str]:
    """Whose action the words name, and the vendors with whom a word means the same or the opposite."""
    words = heating_words(vendor)
    if not words:
        return
    texts = "; ".join(f"{word}: {DIRECTION_TEXTS[heating]}" for word, heating in words.items())
    yield f"the word names {direction.action_of} action. {texts}"
    same_vendors: list[str] = []
    opposite_vendors: list[str] = []
    for key, other in VENDORS.items():
        meanings = heating_words(key)
        common = [word for word in words if word in meanings]
        if key != vendor and common:
            (same_vendors if all(words[w] == meanings[w] for w in common) else opposite_vendors).append(other.title)
    if opposite_vendors:
        same_text = f"; the same: {', '.join(same_vendors)}" if same_vendors else ""
        yield f"the same word means the opposite with {', '.join(opposite_vendors)}{same_text}"


# --- One question to all that knows an answer: the vendors, the rules and the decisions -------------------------------

DECISION_NUMBER = re.compile(r"D0?([0-9]{1,4})", re.IGNORECASE)


def explain_question(
    question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]
) -> list[Page]:
    """Every reading of a question, and what people see that is called so; raises `QuestionError` when there is none."""
    whole_text = question.text
    question, vendors = _named_vendors(replace(question, name=usual_spelling(question.name)), vendors)
    if question.value is None and (match := STRUCTURE_BIT.fullmatch(question.name)):
        question = replace(question, name=match[1], value=f"0x{1 << int(match[2]):04X}")
    try:
        pages = _readings(question, vendors, decisions)
    except UnknownError as error:
        pages = _text_pages(question, vendors, decisions) or _readings_without_loop(question, vendors, decisions)
        pages = pages or _message_pages(whole_text, vendors)  # one that names the PLC
        if not pages:
            raise error from None
        return pages
    if question.config is None and NAME_IN_WORDS.fullmatch(question.text):
        vendor_keys = {page.vendor for page in pages}
        if len(vendor_keys) == 1:
            pages += [page for key in vendors if key not in vendor_keys for page in _few_titled_pages(question, key)]
        pages += _symptom_pages(question, vendors, all_words=True)
    return pages


def _readings(question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    pages: list[Page] = []
    problems: list[str] = []
    try:
        pages += _rule_pages(question)
    except QuestionError as error:  # CK200 looks like a rule of the CLICK, and may be an error number
        problems.append(str(error))
    question = replace(question, one_vendor=len(vendors) == 1)
    if not pages:
        pages, _ = _search_vendors(question, _vendors_of_address(question, vendors))
    if not pages:
        pages = [*reference_pages(question, vendors)]
    if not pages:
        pages, refusals = _search_vendors(question, vendors)
        problems += refusals
    if not pages or len(vendors) == len(VENDORS):
        pages = _decision_pages(question, decisions) + pages
    if not pages and question.config is not None and question.value is None:
        pages = mention_pages(question.config, question.name)
    if not pages:
        raise QuestionError(problems[0]) if problems else UnknownError(_unknown_message(question, vendors))
    return pages


def _text_pages(question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """A name with blanks for underscores, a text of pidcfg's own, the words of a title, or what people see."""
    pages = _readings_or_none(replace(question, name="_".join(question.name.split())), vendors, decisions)
    if pages:
        return [*pages, *_symptom_pages(question, vendors, all_words=True)]
    pages = _message_pages(question.text, vendors) if len(question.text.split()) > 1 else []
    if REFERENCE_PATTERN.fullmatch(question.name):
        return symptom_pages(symptoms_in(MODBUS_SYMPTOM), vendors)
    if not pages and question.value is None and (match := NAME_AND_VALUE.fullmatch(question.name)):
        pages = _readings_or_none(replace(question, name=match[1], value=match[2]), vendors, decisions)
    pages = pages or _symptom_pages(question, vendors)
    for name in () if pages else names_in_text(question.text):
        pages += _readings_or_none(replace(question, name=name, value=None), vendors, decisions)
    return pages or _all_titled_pages(question, vendors)


def _readings_without_loop(
    question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]
) -> list[Page]:
    """What is known of a name without the loop of the configuration that stands before it."""
    head, dot, last = question.name.rpartition(".")
    if question.config is None or not dot or head.lower() not in {loop.lower() for loop in question.config.loops}:
        return []
    return _readings_or_none(replace(question, name=last, config=None), vendors, decisions)


def _named_vendors(question: Question, vendors: Sequence[str]) -> tuple[Question, Sequence[str]]:
    """A question without the PLC's name in it, and that PLC; all of them where it has none."""
    words = question.text.split()
    named_vendors = [key for key in vendors if any(word.casefold() == key for word in words)]
    if question.value is not None or not named_vendors or len(words) == 1:
        return question, vendors
    text = " ".join(word for word in words if word.casefold() not in named_vendors)
    return replace(question, text=text, name=usual_spelling(text)), named_vendors


def _readings_or_none(
    question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]
) -> list[Page]:
    """Every reading of a question; none where there is none."""
    try:
        return _readings(question, vendors, decisions)
    except QuestionError:
        return []


STRUCTURE_BIT = re.compile(r"(ErrBits)\.([0-9])", re.IGNORECASE)
"""A member of a structure of bits by its number."""
NAME_IN_WORDS = re.compile(r"[A-Za-z]+( [A-Za-z]+)*")
"""What may be a name in words, or what people see: no key of a file and no address."""
MODBUS_SYMPTOM = "modbus"
MAX_PAGES = 12
"""Of registers that have some words in their names; more are only listed."""
MAX_FEW_PAGES = 2
"""Of such registers of one vendor, beside those of another one that have just this name."""


def _few_titled_pages(question: Question, key: str) -> list[Page]:
    """The registers of a vendor with these words in their names; none where they are too many to be meant."""
    pages = _titled_pages(question, key)
    return pages if len(pages) <= MAX_FEW_PAGES else []


def _titled_pages(question: Question, key: str) -> list[Page]:
    """The registers of a vendor with these words in their names."""
    pages: list[Page] = []
    for name in names_with_words(question.name, book_of(key)):
        pages += [page for page in vendor_pages(key, replace(question, name=name)) if page not in pages]
    return pages


def _all_titled_pages(question: Question, vendors: Sequence[str]) -> list[Page]:
    """The registers with these words in their names; raises `QuestionError` where they are too many to be meant."""
    pages = [one for key in vendors for one in _titled_pages(question, key)]
    if len(pages) > MAX_PAGES:
        names = ", ".join(list(dict.fromkeys(page.title.partition(" [")[0] for page in pages))[:MAX_PAGES])
        raise QuestionError(f"{question.name!r} is in {len(pages)} names; say which, or name the --vendor: {names} …")
    return pages


def _message_pages(text: str, vendors: Sequence[str]) -> list[Page]:
    """The rules and lines that a text of pidcfg's own is of."""
    pages: list[Page] = []
    for meaning in message_subjects(text, vendors):
        pages += [rule_page(rule_texts()[meaning])] if isinstance(meaning, str) else symptom_pages([meaning], vendors)
    return pages


def _symptom_pages(question: Question, vendors: Sequence[str], *, all_words: bool = False) -> list[Page]:
    """What people see, for the vendors that the words name, or all."""
    words = {*words_of(question.text)}
    named_vendors = [key for key in vendors if words & {key, *words_of(VENDORS[key].title)}]
    return symptom_pages(symptoms_in(question.text, all_words=all_words), named_vendors or vendors)


def _vendors_of_address(question: Question, vendors: Sequence[str]) -> list[str]:
    """The vendors whose addresses begin as the question does: no other one has to be loaded."""
    match = ADDRESS_PATTERN.fullmatch(question.name)
    return [key for key in vendors if match and match.group(1).upper() in VENDORS[key].banks]


def _search_vendors(question: Question, vendors: Sequence[str]) -> tuple[list[Page], list[str]]:
    """What vendors know of a question; and why some refuse it."""
    pages: list[Page] = []
    problems: list[str] = []
    for key in vendors:
        try:
            pages += vendor_pages(key, question)
        except QuestionError as error:
            problems.append(str(error))
    return pages, problems


def _books(vendors: Iterable[str]) -> list[Book]:
    return [book_of(key) for key in vendors]


def check_starts(starts: Iterable[str], vendors: Iterable[str]) -> None:
    """Refuses the start of a block that is no address of any of the vendors."""
    spaces = [book.space for book in _books(vendors) if isinstance(book, Registers)]
    for text in starts:
        if all(space.parse(text.upper()) is None for space in spaces):
            raise QuestionError(f"--block {text}: this is no address; write it like V2000, DF101 or R101")


def _decision_pages(question: Question, decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """A decision, which has no content."""
    match = DECISION_NUMBER.fullmatch(question.name) if question.value is None else None
    decision = next((d for d in decisions() if d.number == int(match.group(1))), None) if match else None
    if decision is None:
        return []
    number, title, text, grounds = decision.number, decision.title, decision.text, decision.why
    return [
        Page(
            "decision",
            f"D{number:02d}",
            title,
            reference="docs/decisions.md",
            markdown=f"# D{number:02d} {title}\n\n{text}\n\n**Grounds.** {grounds}\n",
            extra={"number": number, "title": title, "text": text, "why": grounds},
        )
    ]


def _rule_pages(question: Question) -> list[Page]:
    """A rule, which has no content either."""
    code = question.name.upper()
    if question.value is not None or not CODE_PATTERN.fullmatch(code):
        return []
    rule = rule_texts().get(code)
    if rule is None:
        raise QuestionError(f"no rule {code}; {suggest_code(code)}")
    return [rule_page(rule)]


def _unknown_message(question: Question, vendors: Iterable[str]) -> str:
    """What was probably meant: a name of as many words, each with a letter or two amiss."""
    names: dict[str, str] = {}
    for book in _books(vendors):
        names.update(book.spellings)
        names.update({word: word for word in (*book.direction.words, ACTION_NAME)})
    nearest = nearest_name(question.name, names)
    quoted = question.name if len(question.name) <= MAX_QUOTED_LENGTH else f"{question.name[:MAX_QUOTED_LENGTH]}…"
    return f"nothing is known of {quoted!r}" + (f"; did you mean {names[nearest]}?" if nearest else "")


def question_examples(vendors: Iterable[str]) -> list[tuple[str, str, str]]:
    """What can be asked for: an example, what it is, and the vendor."""
    rows = [("DL242", "a rule, or a whole message of pidcfg", ""), ("D46", "a decision", "")]
    rows += [("loop stuck in manual", "what people see", ""), ("41025", "a Modbus reference", "")]
    return rows + [(example, what, book.title) for book in _books(vendors) for what, example in book.examples]


# --- All that was asked ----------------------------------------------------------------------------------------------


def explain_things(
    queries: Sequence[str], vendor: str | None, blocks: tuple[str, ...], checked: Checked | None, *, loop: bool
) -> ExplainResult:
    """Every reading of every thing, or of all as one text; with a configuration, in its vendor's terms."""
    document = config = family = None
    if checked is not None:
        document = checked.document
        if checked.encoding is None or checked.vendor is None:
            return ExplainResult(findings=checked.findings, document=document)
        family, config = checked.vendor.key, ConfigIndex(checked)
        if vendor not in {None, family}:
            raise ArgumentError(f"`config` is of vendor {family}, not {vendor}", "config")
    vendors = list(VENDORS) if (key := vendor or family) is None else [key]
    if not queries:
        return ExplainResult(examples=tuple(question_examples(vendors)), document=document)
    named_vendors = [key for key in vendors if any(thing.casefold() == key for thing in queries)]
    if named_vendors and (rest := [thing for thing in queries if thing.casefold() not in named_vendors]):
        queries, vendors = rest, named_vendors
    if blocks:
        check_starts(blocks, vendors)

    def ask(thing: str) -> list[Page]:
        question = Question.parse(thing, at_example=loop, starts=blocks, config=config)
        return explain_question(question, vendors, all_decisions)

    return ExplainResult(tuple(_answer_things(queries, ask)), document=document)


def _answer_things(queries: Sequence[str], ask: Callable[[str], list[Page]]) -> list[Page]:
    """The answers to all things; where one is nothing, or they spell a bit or an error, to all of them as one text.

    Things of which one is an address or a code are no text.
    """
    text = " ".join(queries)
    if len(queries) > 1 and usual_spelling(text) != text:
        return ask(text)
    if len(queries) > 1 and queries[-1].isdecimal() and not CODE_PATTERN.fullmatch(queries[-2].upper()):
        with suppress(QuestionError):
            return ask(text)
    try:
        return [page for thing in queries for page in ask(thing)]
    except QuestionError as error:
        if len(queries) == 1 or any(CODE_PATTERN.fullmatch(thing.upper()) or names_in_text(thing) for thing in queries):
            raise
        try:
            return ask(text)
        except QuestionError:
            raise error from None
