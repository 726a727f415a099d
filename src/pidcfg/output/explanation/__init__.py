"""Explanations: what was asked for and what it means, in plain words, as JSON, as a result; the pages of rules."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from pidcfg.output.findings import errors_in, findings_data, short_repr
from pidcfg.text.frozen import frozen
from pidcfg.validate import RuleText, rule_data, text_by_code
from pidcfg.validate import rule_page as rule_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.regmap import Meaning
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data


SYMPTOM_KIND = "symptom"
"""The kind of a page about what people see."""


class Value(NamedTuple):
    """A content: the raw number, as the vendor shows it, and what it says; ``problem``: why it says nothing."""

    raw: bool | int | float | str
    shown: str
    text: str = ""
    problem: str = ""


class Point(NamedTuple):
    """One bit, or a group of bits or numbers, of what is explained."""

    label: str
    title: str
    state: str = ""
    """What the value chooses: on, off, reverse; empty without a value."""
    active: bool = False
    """Whether the value has it on."""
    meaning: Meaning | None = None
    key: str | None = None


class Origin(NamedTuple):
    """The line of a configuration that sets a register."""

    file: str
    line: int
    column: int
    loop: str | None
    key: str
    text: str


@frozen
class Page:
    """One explanation; `as_text` prints it."""

    kind: str
    name: str
    title: str
    vendor: str | None = None
    vendor_title: str = ""
    value: Value | None = None
    meaning: Meaning | None = None
    points: tuple[Point, ...] = ()
    holds: str = ""
    unit: str = ""
    notation: str = ""
    access: str = ""
    writer: str = ""
    key: str | None = None
    reference: str = ""
    loop: str | None = None
    place: str = ""
    """Where in the loop's block it stands."""
    origins: tuple[Origin, ...] = ()
    notes: tuple[str, ...] = ()
    markdown: str = ""
    """A page that stands as it is (rules, decisions); ``extra`` are its parts for programs."""
    extra: Mapping[str, object] | None = None


class QuestionError(ValueError):
    """Something that cannot be explained: what is wrong with it, and what to write instead."""


class UnknownError(QuestionError):
    """A name that nobody knows."""


# --- As text for people, and as JSON for programs ---------------------------------------------------------------------

PAGE_WIDTH = 100
LABEL_WIDTH = 13


def as_text(pages: Sequence[Page]) -> str:
    """All explanations, with a line between two."""
    texts = []
    for i, page in enumerate(pages):
        if page.markdown:
            texts.append(page.markdown)
            continue
        lines = [*_page_lines(page)]
        if (
            i and page.kind == SYMPTOM_KIND and pages[i - 1].title == page.title
        ):  # what is true of every PLC is said once
            lines = [
                page.vendor_title,
                *lines[2 + len([*label_lines("", page.meaning.effect if page.meaning else "")]) :],
            ]
        texts.append("\n".join(lines) + "\n")
    return "\n".join(texts)


def _page_lines(page: Page) -> Iterator[str]:
    shown = f" = {page.value.shown}" if page.value else ""
    name = "" if page.kind == SYMPTOM_KIND else f"{page.name}{shown}: "
    yield f"{name}{page.title}" + (f"  ({page.vendor_title})" if page.vendor_title else "")
    yield ""
    if page.value:
        yield from label_lines("value", page.value.text)
        yield from label_lines("no value", page.value.problem)
    if page.meaning:
        yield from _meaning_lines("it means", page.meaning)
    for point in page.points:
        if _is_listed(point, page):
            yield from _point_lines(point)
    bits_off = [
        p.label.removeprefix("bit ") for p in page.points if p.label.startswith("bit") and not _is_listed(p, page)
    ]
    yield from label_lines("off", bit_ranges(bits_off))
    yield from label_lines("holds", page.holds)
    yield from label_lines("unit", page.unit)
    yield from label_lines("written as", page.notation)
    yield from label_lines("written by", page.writer)
    yield from label_lines("stands at", page.place or page.loop or "")
    yield from label_lines("in a file", f"key {page.key}" if page.key else "")
    for origin in page.origins:
        yield from label_lines("set by", f"{origin.file}:{origin.line}:{origin.column}, {origin.key}: {origin.text}")
    yield from label_lines("manual", page.reference)
    for text in page.notes:
        yield from label_lines("note", text)


def bit_ranges(labels: Sequence[str]) -> str:
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


def _point_lines(point: Point) -> Iterator[str]:
    state = f": {point.state}" if point.state not in {"", "on"} else ""
    yield from label_lines(f"{point.label} on" if point.state == "on" else point.label, f"{point.title}{state}")
    if point.meaning:
        yield from _meaning_lines("", point.meaning)


def _meaning_lines(label: str, meaning: Meaning) -> Iterator[str]:
    yield from label_lines(label, meaning.effect)
    yield from label_lines("to do", meaning.cure)
    if meaning.rules:
        yield from label_lines("found by", "pidcfg rule " + ", ".join(meaning.rules))


def label_lines(label: str, text: str) -> Iterator[str]:
    """A label and a text beside it, wrapped; nothing for an empty text."""
    if not text:
        return
    from textwrap import wrap

    first, *rest = wrap(text, PAGE_WIDTH - LABEL_WIDTH - 2, break_on_hyphens=False)
    yield f"  {label:<{LABEL_WIDTH - 1}} {first}" if len(label) < LABEL_WIDTH else f"  {label}  {first}"
    yield from (f"  {'':<{LABEL_WIDTH - 1}} {line}" for line in rest)


def examples_text(rows: Sequence[tuple[str, str, str]]) -> str:
    """What can be asked for, by vendor."""
    width = max(len(example) for example, _, _ in rows)
    lines: list[str] = []
    last_vendor = None
    for example, title, vendor in rows:
        if vendor != last_vendor:
            lines += [] if last_vendor is None else [""]
            lines.append(vendor or "pidcfg")
            last_vendor = vendor
        lines.append(f"  {example:<{width}}  {title}")
    return "\n".join(lines) + "\n"


def explanation_data(pages: Sequence[Page], forms: Sequence[tuple[str, str, str]] = ()) -> Data:
    """The layout of the public interface, spelled out key by key."""
    rows = [{"example": example, "what": what, "vendor": vendor or None} for example, what, vendor in forms]
    return {"version": 1, "explanations": [_page_data(page) for page in pages], **({"forms": rows} if rows else {})}


def _page_data(page: Page) -> Data:
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
        "written_by": page.writer or None,
        "key": page.key,
        "loop": page.loop,
        "place": page.place or None,
        "set_by": [
            {
                "file": origin.file,
                "line": origin.line,
                "column": origin.column,
                "loop": origin.loop,
                "key": origin.key,
                "text": origin.text,
            }
            for origin in page.origins
        ],
        "reference": page.reference or None,
        "notes": list(page.notes),
        "page": None if page.extra is None else dict(page.extra),
    }


def _meaning_data(meaning: Meaning | None) -> Data:
    return {
        "meaning": meaning.effect if meaning else None,
        "cure": (meaning.cure or None) if meaning else None,
        "rules": list(meaning.rules) if meaning else [],
        "basis": str(meaning.basis) if meaning and meaning.basis else None,
    }


# --- The result of the call, and the pages of rules -------------------------------------------------------------------

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


def rule_page(rule: RuleText) -> Page:
    """The page of a rule."""
    return Page(
        "rule", rule.code, rule.title, reference=rule.reference, markdown=rule_text(rule), extra=rule_data(rule)
    )


def rule_pages(things: Sequence[str]) -> tuple[Page, ...]:
    """The pages of things that are all codes of rules, for which nothing else has to be asked; else none."""
    rules = [text_by_code(thing.strip().upper()) for thing in things]
    return tuple(rule_page(rule) for rule in rules if rule is not None) if None not in rules else ()
