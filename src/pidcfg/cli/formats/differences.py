"""Differences as text, JSON and Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.cli.formats.markdown import cell
from pidcfg.cli.formats.verification import verdict_markdown, verdict_text
from pidcfg.control_characters import one_line
from pidcfg.conversion.values import text_of
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.differences.result import Compared, Difference
    from pidcfg.results.differences import DiffResult

WORD = "word "
"""What stands before a content that is no value."""
REST = "file"
"""What belongs to no loop."""
FEW = 6
"""Keys that a line lists before it only counts."""


def render(fmt: str, result: DiffResult) -> str:
    """The differences in one of the formats."""
    return {"text": as_text, "json": json_v1, "markdown": as_markdown}[fmt](result)


def json_v1(result: DiffResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


# --- what both formats say --------------------------------------------------------------------------------------------


def _heading(entry: Compared) -> str:
    """A loop, and what became of it as a whole."""
    parts = []
    if entry.was:
        parts.append(f"renamed, was {entry.was}")
    if entry.moved is not None:
        parts.append(f"moved {entry.moved[0]} → {entry.moved[1]}")
    if entry.status in {"added", "removed"}:
        parts.append(entry.status)
    return ", ".join(parts)


def _change(d: Difference) -> str:
    """Both values with their unit: ``2.5 → 3.1 %/%``."""
    values = [_value(d.before, d.word_before), _value(d.after, d.word_after)]
    unit = "" if any(value.startswith(WORD) for value in values) else d.unit
    return f"{values[0]} → {values[1]} {unit}".rstrip()


def _value(value: Any, word: str | None) -> str:
    """A value; where there is none, a dash, and for what is no value its word."""
    if isinstance(value, list):
        return f"[{', '.join(map(text_of, value))}]"
    return text_of(value) if value is not None or not word or not word.strip("0.") else f"{WORD}{word}"


def _word(d: Difference) -> str:
    """The register with both contents; only its address where these are the values themselves."""
    if not d.address or d.address == d.key:
        return ""
    words = (d.word_before, d.word_after)
    plain = all(word is None or _is_number(word, value) for word, value in zip(words, (d.before, d.after), strict=True))
    return d.address if plain else f"{d.address} {words[0] or '-'} → {words[1] or '-'}"


def _is_number(word: str, value: Any) -> bool:
    """Whether a content is shown as its value already; with zeros in front it is a word."""
    if len(word) > 1 and word.startswith("0") and word.isdigit():
        return False
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(word) == value
        except ValueError:
            return False
    return word.removeprefix(":= ").casefold() == text_of(value).casefold()


def _same_values(rows: tuple[Difference, ...]) -> str:
    """Values that are the same in other words, in one line."""
    words = tuple(f"{d.key} {_word(d)}" for d in rows if d.other_word_only)
    return f"same values, other words: {_some(words)}" if words else ""


def _some(keys: tuple[str, ...]) -> str:
    more = len(keys) - FEW
    return ", ".join(keys[:FEW]) + (f" and {more} more" if more > 0 else "")


def _asides(entry: Compared) -> Iterator[str]:
    """What is told of a loop without being a difference."""
    if entry.left_out:
        yield f"left out, since it runs: {_some(entry.left_out)} (--live)"
    if entry.missing:
        yield f"not in the listing: {_some(entry.missing)}"


# --- text -------------------------------------------------------------------------------------------------------------


def as_text(result: DiffResult) -> str:
    """Loops that differ, the gravest difference first."""
    lines = [f"{result.before} → {result.after}"]
    for entry in result.loops:
        body = [_row(d) for d in entry.differences if not d.other_word_only]
        body += [f"  {line}" for line in (_same_values(entry.differences),) if line]
        body += [_row(d, "operated") for d in entry.operated] + [f"  {line}" for line in _asides(entry)]
        heading = _heading(entry)
        if body or heading:
            lines += ["", f"{entry.loop or REST}{': ' if heading else ''}{heading}", *body]
    same = [entry.loop for entry in result.loops if entry.same and entry.loop and not (entry.missing or entry.operated)]
    if same:
        lines += ["", f"the same: {', '.join(same)}"]
    lines = [one_line(line) for line in lines]
    if result.verified is not None:
        lines += ["", verdict_text(result.verified, pictures=False).rstrip()]
    return "\n".join(lines) + "\n"


def _row(d: Difference, title: str = "") -> str:
    word = f" ({text})" if (text := _word(d)) else ""
    note = f"  {d.note}" if d.note else ""
    return f"  {title or d.risk:<8}  {d.key or d.field}: {_change(d)}{word}{note}"


# --- Markdown ---------------------------------------------------------------------------------------------------------

HEADER = ("", "| risk | key | before → after | register | |", "|---|---|---|---|---|")


def as_markdown(result: DiffResult) -> str:
    """Tables for a pull request."""
    lines = [one_line(f"### PID loops: `{result.before}` → `{result.after}`")]
    for entry in result.loops:
        heading = _heading(entry)
        rows = [_cells(d, d.risk) for d in entry.differences if not d.other_word_only]
        rows += [_cells(d, "operated") for d in entry.operated]
        asides = [text for text in (_same_values(entry.differences), *_asides(entry)) if text]
        if rows or asides or heading:
            lines += ["", f"**{cell(entry.loop or REST)}**{' ' if heading else ''}{cell(heading)}"]
            lines += [*HEADER, *rows] if rows else []
            lines += [line for text in asides for line in ("", cell(f"{text[:1].upper()}{text[1:]}."))]
    if result.same:
        lines += ["", "No other difference." if any(entry.operated for entry in result.loops) else "No difference."]
    if result.verified is not None:
        lines += verdict_markdown(result.verified)
    return "\n".join(lines) + "\n"


def _cells(d: Difference, risk: str) -> str:
    texts = (f"**{risk}**" if risk in {"critical", "high"} else risk, d.key or d.field, _change(d), _word(d), d.note)
    return "| " + " | ".join(text if text.startswith("**") else cell(text) for text in texts) + " |"
