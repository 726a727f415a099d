"""One question to all that knows an answer: the vendors, the rules and the decisions."""

from __future__ import annotations

import difflib
import re
from typing import TYPE_CHECKING, Any

from pidcfg.explanation.direction import ASKED, find
from pidcfg.explanation.page import Page
from pidcfg.explanation.question import Asked, Thing, ThingError, thing_of
from pidcfg.validate.catalog import CODE, rules
from pidcfg.validate.pages import as_data, page
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from pidcfg.refs import Decision

DECISION = re.compile(r"D0?([0-9]{1,3})", re.IGNORECASE)
Decisions = "Callable[[], Sequence[Decision]]"


def explain(text: str, asked: Asked, vendors: Iterable[str], decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """Every reading of a thing; raises `ThingError` when there is none."""
    thing = thing_of(text)
    pages, problems = _rule(thing), []
    chosen = list(vendors)
    for key in chosen:
        try:
            pages += find(key, thing, asked)
        except ThingError as error:
            problems.append(str(error))
    if not pages or len(chosen) == len(VENDORS):
        pages = _decisions(thing, decisions) + pages
    if not pages:
        raise ThingError(problems[0] if problems else _unknown(thing, chosen))
    return pages


def check_starts(starts: Iterable[str], vendors: Iterable[str]) -> None:
    """Refuses the start of a block that is no address of any of the vendors."""
    spaces = [book.space for key in vendors if hasattr(book := VENDORS[key].load("explainer"), "space")]
    for text in starts:
        if all(space.parse(text.upper()) is None for space in spaces):
            raise ThingError(f"--block {text}: this is no address; write it like V2000, DF101 or R101")


def _decisions(thing: Thing, decisions: Callable[[], Sequence[Decision]]) -> list[Page]:
    """A decision, which has no content."""
    number = DECISION.fullmatch(thing.name) if thing.value is None else None
    found = next((d for d in decisions() if d.number == int(number.group(1))), None) if number else None
    return [] if found is None else [_decision(found)]


def _rule(thing: Thing) -> list[Page]:
    """A rule, which has no content either."""
    code = thing.name.upper()
    if thing.value is not None or not CODE.fullmatch(code):
        return []
    rule = rules(code).get(code)
    if rule is None:
        near = difflib.get_close_matches(code, rules(), n=1)
        raise ThingError(f"no rule {code}" + (f"; did you mean {near[0]}?" if near else "; 'pidcfg rule' lists all"))
    return [Page("rule", rule.code, rule.title, reference=str(rule.basis), markdown=page(rule), extra=as_data(rule))]


def _decision(found: Decision) -> Page:
    extra: Mapping[str, Any] = {"number": found.number, "title": found.title, "text": found.text, "why": found.why}
    name = f"D{found.number:02d}"
    text = f"# {name} {found.title}\n\n{found.text}\n\n**Grounds.** {found.why}\n"
    return Page("decision", name, found.title, reference="docs/decisions.md", markdown=text, extra=extra)


def _unknown(thing: Thing, vendors: list[str]) -> str:
    """What was probably meant, and what can be asked for."""
    names = {name: shown for key in vendors for name, shown in _names(VENDORS[key].load("explainer")).items()}
    near = difflib.get_close_matches(thing.name.lower(), names, n=1, cutoff=0.7)
    meant = f"; did you mean {names[near[0]]}?" if near else ""
    return f"nothing is known of {thing.name!r}{meant}"


def _names(book: Any) -> dict[str, str]:
    """The names that a vendor has, with their spelling."""
    found = {}
    for name, entries in book.names.items():
        first = entries[0]
        found[name] = first if isinstance(first, str) else name
    beside = {path.rpartition(".")[2] for path in getattr(book, "beside", ())}
    return found | {name: name for name in (*beside, *book.direction.words, ASKED)}


def forms(vendors: Iterable[str]) -> list[tuple[str, str, str]]:
    """What can be asked for: an example, what it is, and the vendor."""
    rows = [("PID242", "a rule", ""), ("D46", "a decision", "")]
    for key in vendors:
        rows += [(example, what, VENDORS[key].title) for what, example in VENDORS[key].load("explainer").forms]
    return rows
