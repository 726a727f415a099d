"""One question to all that knows an answer: vendors, rules, decisions, a configuration; the answer as text and JSON."""

from __future__ import annotations

import difflib
import pkgutil
import re
from dataclasses import replace
from importlib import import_module
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.contract import tables_of
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.explanation.book import book_of
from pidcfg.output.explanation.page import ADDRESS, Configured, Page, Question, QuestionError, Value
from pidcfg.output.explanation.registers import Registers
from pidcfg.output.findings import Data, errors_in, findings_data, short_repr
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.validate.catalog import CODE, as_data, page, rules, suggestion
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from pidcfg.encoders.regmap import Meaning
    from pidcfg.output.explanation.book import Book, Direction
    from pidcfg.output.explanation.page import Origin, Point
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Path
    from pidcfg.validate.engine import Checked

# --- The numbered decisions, wherever in the program they stand -------------------------------------------------------


class SameNumberError(ValueError):
    """Two decisions have one number."""


def all_decisions() -> list[Decision]:
    """Every decision, in the order of their numbers."""
    return [decision for _, decision in placed_decisions()]


def placed_decisions() -> list[tuple[str, Decision]]:
    """Every decision with the first module that names it, in the order of their numbers."""
    places: dict[int, tuple[str, Decision]] = {}
    for module, decision in _everywhere():
        if places.setdefault(decision.number, (module, decision))[1] is not decision:
            raise SameNumberError(f"two decisions have the number D{decision.number:02d}")
    return [places[number] for number in sorted(places)]


def _everywhere() -> Iterator[tuple[str, Decision]]:
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

PROSE = frozenset(("description", "unit", "vendor"))
"""Keys whose texts name nothing."""


def mentions(config: Configured, name: str) -> list[Page]:
    """The page of a name, with every line that says it; none where no line does."""
    vendor = config.checked.vendor
    data: Any = config.document.data
    word = re.compile(rf"(?<![\w.]){re.escape(name)}(?![\w])", re.IGNORECASE)
    origins = [origin for path, text in _texts(data) if word.search(text) and (origin := _origin(config, path))]
    signals = data.get("signals")
    if isinstance(signals, dict):
        origins += [o for key in signals if word.fullmatch(key) and (o := config.origin(("signals", key), None))]
    loop = next((one for one in config.loops if one.lower() == name.lower()), None)
    if vendor is None or not (origins or loop):
        return []
    title = "a loop of this configuration" if loop else _title(origins)
    notes = _blocks(config, loop) if loop else ()
    description = next((str(one.get("description") or "") for one in data["loops"] if one.get("name") == loop), "")
    page = Page("named", loop or name, title, vendor.key, vendor.title, holds=description, loop=loop, notes=notes)
    return [replace(page, origins=tuple(origins))]


def _texts(data: Any, above: Path = ()) -> Iterator[tuple[Path, str]]:
    """Every text of a configuration that may name something."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, value in items:
        if isinstance(value, str) and key not in PROSE:
            yield (*above, key), value
        elif isinstance(value, dict | list):
            yield from _texts(value, (*above, key))


def _origin(config: Configured, path: Path) -> Origin | None:
    loop = config.loops[path[1]] if path[0] == "loops" and isinstance(path[1], int) else None
    return config.origin(path, loop)


def _title(origins: list[Origin]) -> str:
    """What it is to the first line that names it."""
    first = origins[0]
    key = re.sub(r"^\w+\[\d+\]\.", "", first.key)
    return f"named at {key}" + (f" of {first.loop}" if first.loop else "")


def _blocks(config: Configured, loop: str) -> tuple[str, ...]:
    """Where the loop's registers are."""
    encoding: Any = config.checked.encoding
    ends: dict[str, tuple[int, int]] = {}
    for block in config.blocks:
        if block.loop == loop:
            first, last = ends.get(block.table.title, (block.start, 0))
            ends[block.table.title] = min(first, block.start), max(last, block.start + block.table.size - 1)
    name = encoding.space.name if ends else str
    return tuple(f"{title}: {name(first)} to {name(last)}" for title, (first, last) in ends.items())


# --- Explanations as text for people and as JSON for programs ---------------------------------------------------------

WIDTH = 100
LABEL = 13


def as_text(pages: Sequence[Page]) -> str:
    """All explanations, with a line between two."""
    return "\n".join(page.markdown or "\n".join(_lines(page)) + "\n" for page in pages)


def _lines(page: Page) -> Iterator[str]:
    shown = f" = {page.value.shown}" if page.value else ""
    yield f"{page.name}{shown}: {page.title}" + (f"  ({page.vendor_title})" if page.vendor_title else "")
    yield ""
    if page.value:
        yield from row("value", page.value.text)
        yield from row("no value", page.value.problem)
    if page.meaning:
        yield from _meaning("it means", page.meaning)
    for point in page.points:
        if _is_listed(point, page):
            yield from _point(point)
    off = [p.label.removeprefix("bit ") for p in page.points if p.label.startswith("bit") and not _is_listed(p, page)]
    yield from row("off", numbers(off))
    yield from row("holds", page.holds)
    yield from row("unit", page.unit)
    yield from row("written as", page.notation)
    yield from row("written by", page.by)
    yield from row("stands at", page.place or page.loop or "")
    yield from row("in a file", f"key {page.key}" if page.key else "")
    for at in page.origins:
        yield from row("set by", f"{at.file}:{at.line}:{at.column}, {at.key}: {at.text}")
    yield from row("manual", page.reference)
    for text in page.notes:
        yield from row("note", text)


def numbers(labels: Sequence[str]) -> str:
    """Bits in short: ``bits 0, 2-9``; groups of bits as they are."""
    runs: list[list[int]] = []
    others = [label for label in labels if not label.isdecimal()]
    for n in sorted(int(label) for label in labels if label.isdecimal()):
        if runs and runs[-1][-1] == n - 1:
            runs[-1].append(n)
        else:
            runs.append([n])
    texts = [str(run[0]) if len(run) == 1 else f"{run[0]}-{run[-1]}" for run in runs]
    single = [f"bit{'s' if len(texts) > 1 or '-' in texts[0] else ''} {', '.join(texts)}"] if texts else []
    return ", ".join([*single, *others])


def _is_listed(point: Point, page: Page) -> bool:
    """A bit that is off is only counted, where a value was given."""
    return page.value is None or point.active or point.state not in {"off", ""}


def _point(point: Point) -> Iterator[str]:
    state = f": {point.state}" if point.state not in {"", "on"} else ""
    yield from row(f"{point.label} on" if point.state == "on" else point.label, f"{point.title}{state}")
    if point.meaning:
        yield from _meaning("", point.meaning)


def _meaning(label: str, meaning: Meaning) -> Iterator[str]:
    yield from row(label, meaning.effect)
    yield from row("to do", meaning.cure)
    if meaning.rules:
        yield from row("found by", "pidcfg rule " + ", ".join(meaning.rules))


def row(label: str, text: str) -> Iterator[str]:
    """A label and a text beside it, wrapped; nothing for an empty text."""
    if not text:
        return
    first, *rest = wrap(text, WIDTH - LABEL - 2, break_on_hyphens=False)
    yield f"  {label:<{LABEL - 1}} {first}" if len(label) < LABEL else f"  {label}  {first}"
    yield from (f"  {'':<{LABEL - 1}} {line}" for line in rest)


def forms_text(rows: Sequence[tuple[str, str, str]]) -> str:
    """What can be asked for, by vendor."""
    wide = max(len(example) for example, _, _ in rows)
    lines: list[str] = []
    last = None
    for example, what, vendor in rows:
        if vendor != last:
            lines += [] if last is None else [""]
            lines.append(vendor or "pidcfg")
            last = vendor
        lines.append(f"  {example:<{wide}}  {what}")
    return "\n".join(lines) + "\n"


def explanation_data(pages: Sequence[Page], forms: Sequence[tuple[str, str, str]] = ()) -> dict[str, Any]:
    """The layout of the public interface, spelled out key by key."""
    rows = [{"example": example, "what": what, "vendor": vendor or None} for example, what, vendor in forms]
    return {"version": 1, "explanations": [_data(page) for page in pages], **({"forms": rows} if rows else {})}


def _data(page: Page) -> dict[str, Any]:
    value = page.value
    return {
        "kind": page.kind,
        "vendor": page.vendor,
        "name": page.name,
        "title": page.title,
        "value": None
        if value is None
        else {"raw": value.raw, "shown": value.shown, "text": value.text or None, "problem": value.problem or None},
        **_meaning_data(page.meaning),
        "bits": [
            {
                "bit": p.label,
                "title": p.title,
                "state": p.state or None,
                "active": p.active,
                "key": p.key,
                **_meaning_data(p.meaning),
            }
            for p in page.points
        ],
        "holds": page.holds or None,
        "unit": page.unit or None,
        "notation": page.notation or None,
        "access": page.access or None,
        "written_by": page.by or None,
        "key": page.key,
        "loop": page.loop,
        "place": page.place or None,
        "set_by": [
            {"file": at.file, "line": at.line, "column": at.column, "loop": at.loop, "key": at.key, "text": at.text}
            for at in page.origins
        ],
        "reference": page.reference or None,
        "notes": list(page.notes),
        "page": None if page.extra is None else dict(page.extra),
    }


def _meaning_data(meaning: Meaning | None) -> dict[str, Any]:
    return {
        "meaning": meaning.effect if meaning else None,
        "cure": (meaning.cure or None) if meaning else None,
        "rules": list(meaning.rules) if meaning else [],
        "basis": str(meaning.basis) if meaning and meaning.basis else None,
    }


# --- The words for the direction of control, of which some mean the opposite with another vendor ----------------------

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
    book = book_of(vendor)
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
    book, heating = book_of(vendor), tables_of(VENDORS[vendor]).TUNED.heating
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


# --- One question to all that knows an answer: the vendors, the rules and the decisions -------------------------------

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
        pages, _ = _search_vendors(question, _with_bank(question, vendors))
    if not pages:
        pages, refusals = _search_vendors(question, vendors)
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


def _search_vendors(question: Question, vendors: Sequence[str]) -> tuple[list[Page], list[str]]:
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
    return [book_of(key) for key in vendors]


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
    code = question.name.upper()
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


# --- What a register, a bit, a number or a code means: the result of `pidcfg.explain`, and its JSON -------------------

Example = tuple[str, str, str]
"""A thing that can be asked for, what it is, and the vendor's title."""


@frozen
class ExplainResult:
    """Explanations, one for each reading of each thing; or, where no thing was named, examples of what can be."""

    __repr__ = short_repr

    pages: tuple[Page, ...] = ()
    examples: tuple[Example, ...] = ()
    findings: tuple[Diagnostic, ...] = ()
    """What keeps the configuration from being read; empty where there is none."""
    document: Document | None = None
    """The configuration, where one was given."""

    @property
    def ok(self) -> bool:
        """Whether there is something to read."""
        return bool(self.pages or self.examples)

    def to_json(self) -> Data:
        """What ``pidcfg explain --format json`` prints; where the configuration cannot be read, its errors."""
        return explanation_data(self.pages, self.examples) if self.ok else findings_data(errors_in(self.findings))


def explain_things(
    things: Sequence[str], vendor: str | None, blocks: tuple[str, ...], checked: Checked | None, *, loop: bool
) -> ExplainResult:
    """Every reading of every thing; with a configuration, in its vendor's terms."""
    document = configured = family = None
    if checked is not None:
        document = checked.document
        if checked.encoding is None or checked.vendor is None:
            return ExplainResult(findings=checked.findings, document=document)
        family, configured = checked.vendor.key, Configured(checked)
        if vendor not in {None, family}:
            raise ArgumentError(f"`config` is of vendor {family}, not {vendor}", "config")
    vendors = list(VENDORS) if (key := vendor or family) is None else [key]
    if not things:
        return ExplainResult(examples=tuple(forms(vendors)), document=document)
    if blocks:
        check_starts(blocks, vendors)
    pages = []
    for thing in things:
        question = Question.of(thing, loop=loop, starts=blocks, config=configured)
        pages += explain(question, vendors, all_decisions)
    return ExplainResult(tuple(pages), document=document)
