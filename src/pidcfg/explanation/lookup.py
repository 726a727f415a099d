"""One question to all that knows an answer: the vendors, the rules and the decisions."""

from __future__ import annotations

import difflib
import re
from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.explanation.direction import ACTION, find
from pidcfg.explanation.mentions import mentions
from pidcfg.explanation.page import Page
from pidcfg.explanation.question import ADDRESS, Question, QuestionError
from pidcfg.explanation.registers import Registers
from pidcfg.validate.catalog import CODE, current, rules, suggestion
from pidcfg.validate.pages import as_data, page
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from pidcfg.explanation.book import Book
    from pidcfg.refs import Decision

DECISION = re.compile(r"D0?([0-9]{1,3})", re.IGNORECASE)


def explain(question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """Every reading of a question, also with blanks for underscores; raises `QuestionError` when there is none."""
    try:
        return _readings(question, vendors, decisions)
    except QuestionError:
        joined = replace(question, name="_".join(question.name.split()))
        if joined == question:
            raise
        try:
            return _readings(joined, vendors, decisions)
        except QuestionError:
            pass
        raise


def _readings(question: Question, vendors: Sequence[str], decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    pages: list[Page] = []
    problems: list[str] = []
    try:
        pages += _rule(question)
    except QuestionError as error:  # CK200 looks like a rule of the CLICK, and may be an error number
        problems.append(str(error))
    question = replace(question, one_vendor=len(vendors) == 1)
    if not pages:
        pages, _ = _found(question, _with_bank(question, vendors))
    if not pages:
        pages, refusals = _found(question, vendors)
        problems += refusals
    if not pages or len(vendors) == len(VENDORS):
        pages = _decision(question, decisions) + pages
    if not pages and question.config is not None and question.value is None:
        pages = mentions(question.config, question.name)
    if not pages:
        raise QuestionError(problems[0] if problems else _unknown(question, vendors))
    return pages


def _with_bank(question: Question, vendors: Sequence[str]) -> list[str]:
    """The vendors whose addresses begin as the question does: no other one has to be loaded."""
    match = ADDRESS.fullmatch(question.name)
    return [key for key in vendors if match and match.group(1).upper() in VENDORS[key].banks]


def _found(question: Question, vendors: Sequence[str]) -> tuple[list[Page], list[str]]:
    """What vendors know of a question, in the blocks that are meant or else in all; and why some refuse it."""
    pages: list[Page] = []
    problems: list[str] = []
    for asked in (question, replace(question, every_block=True)):
        for key in () if pages else vendors:
            try:
                pages += find(key, asked)
            except QuestionError as error:
                problems.append(str(error))
    return pages, problems


def _books(vendors: Iterable[str]) -> list[Book]:
    return [VENDORS[key].load("explainer") for key in vendors]


def check_starts(starts: Iterable[str], vendors: Iterable[str]) -> None:
    """Refuses the start of a block that is no address of any of the vendors."""
    spaces = [book.space for book in _books(vendors) if isinstance(book, Registers)]
    for text in starts:
        if all(space.parse(text.upper()) is None for space in spaces):
            raise QuestionError(f"--block {text}: this is no address; write it like V2000, DF101 or R101")


def _decision(question: Question, decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """A decision, which has no content."""
    match = DECISION.fullmatch(question.name) if question.value is None else None
    decision = next((d for d in decisions() if d.number == int(match.group(1))), None) if match else None
    if decision is None:
        return []
    number, title, text, why = decision.number, decision.title, decision.text, decision.why
    return [
        Page(
            "decision",
            f"D{number:02d}",
            title,
            reference="docs/decisions.md",
            markdown=f"# D{number:02d} {title}\n\n{text}\n\n**Grounds.** {why}\n",
            extra={"number": number, "title": title, "text": text, "why": why},
        )
    ]


def _rule(question: Question) -> list[Page]:
    """A rule, which has no content either."""
    code = current(question.name.upper())
    if question.value is not None or not CODE.fullmatch(code):
        return []
    rule = rules(code).get(code)
    if rule is None:
        raise QuestionError(f"no rule {code}; {suggestion(code)}")
    return [Page("rule", rule.code, rule.title, reference=str(rule.basis), markdown=page(rule), extra=as_data(rule))]


def _unknown(question: Question, vendors: Iterable[str]) -> str:
    """What was probably meant."""
    names: dict[str, str] = {}
    for book in _books(vendors):
        names.update(book.spellings)
        names.update({word: word for word in (*book.direction.words, ACTION)})
    near = difflib.get_close_matches(question.name.lower(), names, n=1, cutoff=0.7)
    return f"nothing is known of {question.name!r}" + (f"; did you mean {names[near[0]]}?" if near else "")


def forms(vendors: Iterable[str]) -> list[tuple[str, str, str]]:
    """What can be asked for: an example, what it is, and the vendor."""
    rows = [("DL242", "a rule", ""), ("D46", "a decision", "")]
    return rows + [(example, what, book.title) for book in _books(vendors) for what, example in book.forms]
