"""Conversions, differences and verdicts of the battery as text, JSON and Markdown."""

from __future__ import annotations

import sys
from collections import Counter
from dataclasses import replace
from decimal import Decimal
from itertools import zip_longest
from textwrap import fill
from typing import TYPE_CHECKING

from pidcfg.cli.formats.findings import distinct_lines, markdown_cell, names_of
from pidcfg.cli.plots import chart_text
from pidcfg.conversion import KINDS_BY_HARM, LOSSES, text_of
from pidcfg.conversion.operation import PREFIX
from pidcfg.output.conversion import SEVERAL_LINES_NOTE
from pidcfg.text.signs import to_one_line
from pidcfg.text.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.conversion import Change
    from pidcfg.conversion.differences import Difference, LoopComparison, State
    from pidcfg.conversion.pipeline import LoopReport
    from pidcfg.output.conversion import ConvertResult
    from pidcfg.output.differences import DiffResult
    from pidcfg.study.verification.comparison import SignalDifference
    from pidcfg.study.verification.verify import NamedDifference, UntriedStage, VerifiedLoop

# --- The verdicts of the battery as text and Markdown -----------------------------------------------------------------

SIGNAL_NAMES = {"pv": "PV", "output": "output", "setpoint": "set point", "mode": "mode", "run": "no run"}
NO_LOOPS_TEXT = "  no loop could be compared"


def verdict_text(loops: Sequence[VerifiedLoop], *, pictures: bool = True) -> str:
    """What differs, loop by loop, and where a line of the report says why; with pictures for the terminal."""
    lines = ["both sides in the same battery of stages, on the same plants"]
    for loop in loops:
        lines += ["", f"{loop.loop}: {verdict_headline(loop)}"]
        lines += [
            f"  differs: {difference_text(failure.difference)}{_key_hint(failure.key)}" for failure in loop.failures
        ]
        lines += [f"  named: {text}" for text in _named_lines(loop.named)]
        lines += [f"  run with: {text}" for text in _switched_lines(loop.switched)]
        lines += [f"  not tried: {text}" for text in _untried_lines(loop.untried)]
        lines += [f"  not shown: {text}" for text in _hidden_lines(loop.hidden)]
        if pictures:
            lines.append(chart_text(replace(loop.chart, title=""), sys.stderr))
    return "\n".join(lines if loops else [*lines, NO_LOOPS_TEXT]) + "\n"


def verdict_brief(loops: Sequence[VerifiedLoop]) -> str:
    """A line a loop, what differs with a picture of it, and what the loops have in common once."""
    lines = ["", "both sides on the same plants: how far PV and output are apart, in % of range:"]
    for loop in loops:
        ratio = "" if loop.iae_ratio is None else f", IAE x {loop.iae_ratio:.4g}"
        distances = f"PV {loop.pv_percent:.3g} %, output {loop.output_percent:.3g} %{ratio}"
        lines.append(f"  {loop.loop}: {_verdict_words(loop)}; {distances}")
        lines += [
            f"    differs: {difference_text(failure.difference)}{_key_hint(failure.key)}" for failure in loop.failures
        ]
        lines += [] if loop.passed else [chart_text(replace(loop.chart, title=""), sys.stderr)]
    named_fields = {loop.loop: [_line_of(row)[0] for row in loop.named] for loop in loops}
    rule_fields = {loop.loop: [row.field for row in _rule_changes(loop.switched)] for loop in loops}
    left_out_fields = {loop.loop: [row.field for row in _left_out_changes(loop.switched)] for loop in loops}
    untried_stages = {loop.loop: [row.stage for row in loop.untried] for loop in loops}
    hidden_fields = {loop.loop: list(loop.hidden) for loop in loops}
    for title, fields in (
        ("differs as the report says", named_fields),
        ("run by the target's rules", rule_fields),
        ("left out", left_out_fields),
        ("not tried", untried_stages),
        ("not shown by any stage", hidden_fields),
    ):
        if shared := _fields_with_loops(fields):
            lines.append(fill(f"  {title}: {'; '.join(shared)}", NARROW_WIDTH, subsequent_indent="    "))
    return "\n".join(lines if loops else [*lines, NO_LOOPS_TEXT]) + "\n"


def _fields_with_loops(fields: Mapping[str, Sequence[str]]) -> list[str]:
    """Fields of loops, each once, with the loops where not all have it."""
    loops: dict[str, list[str]] = {}
    for loop, names in fields.items():
        for name in dict.fromkeys(names):
            loops.setdefault(name, []).append(loop)
    return [
        name if len(names_with_field) == len(fields) else f"{name} ({names_of(names_with_field)})"
        for name, names_with_field in loops.items()
    ]


def _verdict_words(loop: VerifiedLoop) -> str:
    stages = f"{len(loop.stages)} stages" if len(loop.stages) > 1 else "one stage"
    return f"{'alike' if loop.passed else 'NOT alike'} in {stages}"


def verdict_headline(loop: VerifiedLoop) -> str:
    """The verdict, and how far both sides lie apart in a step and a disturbance."""
    ratio = "" if loop.iae_ratio is None else f", ratio of IAE {loop.iae_ratio:.4g}"
    distances = f"PV at most {loop.pv_percent:.3g} % of its range apart, output {loop.output_percent:.3g} %"
    return f"{_verdict_words(loop)}; {distances}{ratio}"


def difference_text(difference: SignalDifference) -> str:
    """A difference: stage, signal, time, and what both sides show."""
    signal = SIGNAL_NAMES.get(difference.signal, f"alarm {difference.signal}")
    if difference.signal == "run":
        return f"{difference.stage}: {difference.after}"
    if difference.stage == "numbers":
        before, after = (
            f"{value:.5g}" if isinstance(value, float) else value for value in (difference.before, difference.after)
        )
        return f"{difference.signal} is {before} in the source and {after} in the result, and no line says so"
    largest = "" if difference.worst is None else f", at most {100 * difference.worst:.3g} % of the range apart"
    before, after = (_signal_text(difference, value) for value in (difference.before, difference.after))
    return f"{difference.stage}: {signal} {before} against {after} at {difference.at:.4g} s{largest}"


def _signal_text(difference: SignalDifference, value: float | str | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    return f"{100 * value:.4g} %" if difference.signal == "output" else f"{value:.5g}"


def _key_hint(key: str) -> str:
    return f" (see {key})" if key else ""


def _named_lines(rows: Sequence[NamedDifference]) -> Iterator[str]:
    """Each line of the report once, with the stages in which it shows."""
    stages: dict[tuple[str, str], dict[str, None]] = {}
    for row in rows:
        stages.setdefault(_line_of(row), {})[row.difference.stage] = None
    for (field, note), names in stages.items():
        yield f"{field} ({', '.join(names)}){f': {note}' if note else ''}"


def _line_of(row: NamedDifference) -> tuple[str, str]:
    """The field and the note of the report's line that names a difference."""
    return ("rounding", SEVERAL_LINES_NOTE) if row.line is None else (row.line.field, row.line.note)


def _rule_changes(rows: Sequence[Change]) -> list[Change]:
    """The rules of the target under which the source's numbers were run."""
    return [row for row in rows if row.field.startswith(PREFIX)]


def _left_out_changes(rows: Sequence[Change]) -> list[Change]:
    """What was left out of the source."""
    return [row for row in rows if not row.field.startswith(PREFIX) and row.target is None and not row.neutral]


def _switched_lines(rows: Sequence[Change]) -> Iterator[str]:
    """Both, a line each."""
    rules, left_out = _rule_changes(rows), _left_out_changes(rows)
    yield from (f"{row.field}: {row.target if row in rules else 'left out'}" for row in rows if row in rules + left_out)


def _hidden_lines(fields: Sequence[str]) -> Iterator[str]:
    """The numbers of which this verdict says nothing."""
    if fields:
        yield f"{', '.join(fields)}: no stage can tell another value from this one"


def _untried_lines(rows: Sequence[UntriedStage]) -> Iterator[str]:
    """The stages of each mode that the source does not go to."""
    for mode in dict.fromkeys(row.mode for row in rows):
        stages = ", ".join(row.stage for row in rows if row.mode == mode)
        yield f"{stages}: the source does not go to {mode} when it is asked to; its program, or an input, decides"


def verdict_markdown(loops: Sequence[VerifiedLoop]) -> list[str]:
    """The same as lines of Markdown."""
    lines = ["", "### Verified", ""]
    for loop in loops:
        lines.append(f"- **{markdown_cell(loop.loop)}**: {markdown_cell(verdict_headline(loop))}")
        lines += [
            f"  - differs: {markdown_cell(difference_text(failure.difference) + _key_hint(failure.key))}"
            for failure in loop.failures
        ]
        lines += [f"  - named: {markdown_cell(text)}" for text in _named_lines(loop.named)]
        lines += [f"  - run with: {markdown_cell(text)}" for text in _switched_lines(loop.switched)]
        lines += [f"  - not tried: {markdown_cell(text)}" for text in _untried_lines(loop.untried)]
        lines += [f"  - not shown: {markdown_cell(text)}" for text in _hidden_lines(loop.hidden)]
    return lines


# --- The report of a conversion as text, JSON and Markdown: what became of every field of every loop ------------------

TABLE_HEADER = ("", "| kind | field | before | after | |", "|---|---|---|---|---|")
WIDTH, NARROW_WIDTH = 100, 79
"""Columns of the whole report, and of the short one."""
MAX_BRIEF_FINDINGS = 3
"""Of the target's rules, that the short report has in words."""
WARN_PERCENT = 1.0
"""A value that the target holds further off than this is warned of."""


def render_conversion(fmt: str, result: ConvertResult) -> str:
    """The report in one of its formats."""
    return {"text": conversion_report, "json": conversion_json, "markdown": conversion_markdown}[fmt](result)


def conversion_json(result: ConvertResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


def conversion_report(
    result: ConvertResult, *, changes: bool = True, losses: bool = False, with_verdict: bool = True, full: bool = True
) -> str:
    """For people: the changes, or the losses alone, and the verdict of the battery where that was asked for.

    Without ``full``: what is lost or far off, and the rest in numbers.
    """
    report, verdict = (conversion_text, verdict_text) if full else (conversion_brief, verdict_brief)
    parts = [report(result) if changes else losses_of(result)] if changes or losses else []
    return "".join(parts + ([verdict(result.verified)] if with_verdict and result.verified is not None else []))


def conversion_brief(result: ConvertResult) -> str:
    """What is lost or far off, which wants a decision first; of the rest numbers, each said once."""
    lines = [f"{result.source} to {result.target}"]
    loops_by_counts: dict[str, list[str]] = {}
    for loop in result.loops:
        rows = [change for change in _notable_changes(loop.changes) if _is_marked(change)]
        if rows or loop.status == "dropped":
            lines += [f"{loop.loop}: {_count_text(loop, with_counts=False)}", *_change_lines(rows)]
        else:
            loops_by_counts.setdefault(_count_text(loop, with_counts=False), []).append(loop.loop)
    lines += [f"{names_of(loops)}: {counts}" for counts, loops in loops_by_counts.items()]
    if any(change.kind == "assumed" for loop in result.loops for change in loop.changes):
        lines.append("-v lists what is assumed")
    if result.faults and result.ok:
        lines += _rules_summary(result)
    return "\n".join(lines) + "\n"


def _change_lines(changes: Sequence[Change]) -> Iterator[str]:
    """A line a change, and a note of several in a row once, behind them."""
    rows = list({_change_line(change, NARROW_WIDTH): change for change in changes}.values())
    for change, following in zip_longest(rows, rows[1:]):
        repeats_note = following is not None and following.note == change.note and following.kind == change.kind
        yield _change_line(replace(change, note="") if repeats_note else change, NARROW_WIDTH)


def _rules_summary(result: ConvertResult) -> list[str]:
    """What the target's rules say about a result that is no error: in words where it is little, else by code."""
    rows = distinct_lines(result.faults)
    if len(rows) <= MAX_BRIEF_FINDINGS:
        findings = (fill(f"  {to_one_line(row)}", NARROW_WIDTH, subsequent_indent="    ") for row in rows)
        return [f"what the rules of {result.target} say about the result:", *findings]
    codes = ", ".join(sorted({d.code for d in result.faults}))
    summary = (
        f"the rules of {result.target} warn of {len(result.faults)} things ({codes}); -v and `validate` say of which"
    )
    return [fill(summary, NARROW_WIDTH, subsequent_indent="  ")]


def _is_marked(change: Change) -> bool:
    """Whether a change is a loss, or so far off that a person should know."""
    return change.loss or change.error_percent > WARN_PERCENT


def conversion_text(result: ConvertResult) -> str:
    """Every change that is worth reading, loop by loop; what came over exactly and needs no word is counted."""
    lines = [f"{result.source} to {result.target}"]
    for loop in result.loops:
        lines.append(f"\n{loop.loop}: {_count_text(loop)}")
        lines += dict.fromkeys(_change_line(change) for change in _notable_changes(loop.changes))
        if unneeded := _unneeded_fields(loop.changes):
            lines.append(fill(f"  not needed there: {', '.join(unneeded)}", WIDTH, subsequent_indent="    "))
    if result.faults and result.ok:
        lines += ["", f"what the rules of {result.target} say about the result:"]
        for d in result.faults:
            loop_text = f" [{d.loop}]" if d.loop else ""
            line = f"  {d.severity.label} {d.code}: {to_one_line(d.message + loop_text)}"
            lines.append(fill(line, WIDTH, subsequent_indent="    "))
    return "\n".join(lines) + "\n"


def losses_of(result: ConvertResult) -> str:
    """What is lost, loop by loop, and nothing else."""
    lines = []
    for loop in result.loops:
        rows = dict.fromkeys(_change_line(change) for change in _notable_changes(loop.changes) if change.loss)
        if rows or loop.status == "dropped":
            lines += [f"{loop.loop}: {_count_text(loop)}", *rows]
    return "\n".join(lines) + "\n"


def _count_text(loop: LoopReport, *, with_counts: bool = True) -> str:
    if loop.status == "dropped":
        return f"dropped: {loop.reason}"
    changes = [change for change in loop.changes if not _is_unneeded(change)]
    count = Counter(change.kind for change in changes)
    text = ", ".join(f"{count[kind]} {kind}" for kind in KINDS_BY_HARM if count[kind]) or "nothing to convert"
    if with_counts and (counts := [change.counts_apart for change in changes if change.counts_apart]):
        text += f" ({len(counts)} of the exact ones up to {max(counts):.2g} counts apart)"
    lost = sum(change.loss for change in changes)
    return f"{text}; {lost} lost" if lost else text


def _is_unneeded(change: Change) -> bool:
    """Whether a field is gone and nothing is lost with it."""
    return change.kind == "dropped" and not change.loss


def _unneeded_fields(changes: Sequence[Change]) -> list[str]:
    return [change.field for change in changes if _is_unneeded(change)]


def _notable_changes(changes: Sequence[Change]) -> list[Change]:
    """Losses first, then by kind; without what came over exactly and needs no word, or is not needed."""
    changes_noted = [row for row in changes if (row.kind != "exact" or row.note) and not _is_unneeded(row)]
    return sorted(
        map(_with_target_keys(changes), changes_noted), key=lambda row: (not row.loss, -KINDS_BY_HARM.index(row.kind))
    )


def _with_target_keys(changes: Sequence[Change]) -> Callable[[Change], Change]:
    """Names the key of the result, too, where one of the source goes to several."""
    targets: dict[str, set[str]] = {}
    for row in changes:
        targets.setdefault(row.field, set()).add(row.target_field)
    return lambda row: (
        replace(row, field=f"{row.field} to {row.target_field}")
        if row.target_field and len(targets[row.field] - {""}) > 1
        else row
    )


def conversion_markdown(result: ConvertResult) -> str:
    """A table a loop, as in ``pidcfg diff --format markdown``."""
    lines = [f"### PID loops: {result.source} to {result.target}"]
    for loop in result.loops:
        lines += ["", f"**{markdown_cell(loop.loop)}**: {markdown_cell(_count_text(loop))}"]
        rows = dict.fromkeys(_change_cells(change) for change in _notable_changes(loop.changes))
        lines += [*TABLE_HEADER, *rows] if rows else []
        if unneeded := _unneeded_fields(loop.changes):
            lines += ["", f"Not needed there: {markdown_cell(', '.join(unneeded))}"]
    if result.faults:
        lines += ["", f"**What the rules of {result.target} say about the result**", ""]
        lines += ["| severity | code | loop | finding |", "|---|---|---|---|"]
    for d in result.faults:
        lines.append(f"| {d.severity.label} | {d.code} | {markdown_cell(d.loop or '')} | {markdown_cell(d.message)} |")
    if result.verified is not None:
        lines += verdict_markdown(result.verified)
    return "\n".join(lines) + "\n"


def _error_text(change: Change) -> str:
    """How far a value is off, with both sides in one unit where the line shows them in two."""
    if not change.error_percent:
        return ""
    text, terms = f"{change.error_percent:.3g} % off", change.terms
    if terms is None or (text_of(change.source), text_of(change.target)) == (
        _short_number(terms.wanted),
        _short_number(terms.held),
    ):
        return text
    return f"{text}: {_short_number(terms.wanted)} becomes {_short_number(terms.held)} {terms.unit}".rstrip()


def _short_number(value: Decimal) -> str:
    return text_of(Decimal(f"{value:.7g}"))


def _change_cells(change: Change) -> str:
    remark = "; ".join(part for part in (_error_text(change), change.note) if part)
    kind = f"{change.kind} (loss)" if change.loss and change.kind not in LOSSES else change.kind
    values = (kind, change.field, text_of(change.source), text_of(change.target), remark)
    return f"| {' | '.join(markdown_cell(value) for value in values)} |"


def _change_line(change: Change, width: int = WIDTH) -> str:
    """A change, and its note in a line of its own; both hang where they are longer than the width."""
    values = f"{text_of(change.source)} -> {text_of(change.target)}"
    if change.target is None:
        values = text_of(change.source)
    elif change.source is None:
        values = text_of(change.target)
    error = f" ({_error_text(change)})" if change.error_percent else ""
    mark = "!" if _is_marked(change) else " "
    texts = [f" {mark}{change.kind:<8} {change.field}: {to_one_line(values)}{error}"]
    texts += [f"             {to_one_line(change.note)}"] if change.note else []
    return "\n".join(
        fill(text, width, subsequent_indent=" " * 15, break_long_words=False, break_on_hyphens=False) for text in texts
    )


# --- Differences as text, JSON and Markdown ---------------------------------------------------------------------------

WORD_PREFIX = "word "
"""What stands before a content that is no value."""
NO_LOOP_TITLE = "file"
"""What belongs to no loop."""
MAX_KEYS = 6
"""Keys that a line lists before it only counts."""


def render_differences(fmt: str, result: DiffResult) -> str:
    """The differences in one of the formats."""
    return {"text": differences_text, "json": differences_json, "markdown": differences_markdown}[fmt](result)


def differences_json(result: DiffResult) -> str:
    """The public layout."""
    return json_text(result.to_json())


# --- what both formats say --------------------------------------------------------------------------------------------


def _loop_heading(entry: LoopComparison) -> str:
    """A loop, and what became of it as a whole."""
    parts = []
    if entry.was:
        parts.append(f"renamed, was {entry.was}")
    if entry.moved is not None:
        parts.append(f"moved {entry.moved[0]} → {entry.moved[1]}")
    if entry.status in {"added", "removed"}:
        parts.append(entry.status)
    return ", ".join(parts)


def _values_text(d: Difference) -> str:
    """Both values with their unit: ``2.5 → 3.1 %/%``."""
    values = [_value_text(d.before, d.word_before), _value_text(d.after, d.word_after)]
    unit = "" if any(value.startswith(WORD_PREFIX) for value in values) else d.unit
    return f"{values[0]} → {values[1]} {unit}".rstrip()


def _value_text(value: object, word: str | None) -> str:
    """A value; where there is none, a dash, and for what is no value its word."""
    if isinstance(value, list):
        return f"[{', '.join(map(text_of, value))}]"
    return text_of(value) if value is not None or not word or not word.strip("0.") else f"{WORD_PREFIX}{word}"


def _register_text(d: Difference) -> str:
    """The register with both contents; only its address where these are the values themselves."""
    if not d.address or d.address == d.key:
        return ""
    words = (d.word_before, d.word_after)
    is_plain = all(
        word is None or _is_number(word, value) for word, value in zip(words, (d.before, d.after), strict=True)
    )
    return d.address if is_plain else f"{d.address} {words[0] or '-'} → {words[1] or '-'}"


def _is_number(word: str, value: object) -> bool:
    """Whether a content is shown as its value already; with zeros in front it is a word."""
    if len(word) > 1 and word.startswith("0") and word.isdigit():
        return False
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            return float(word) == value
        except ValueError:
            return False
    return word.removeprefix(":= ").casefold() == text_of(value).casefold()


def _same_values_text(rows: tuple[Difference, ...]) -> str:
    """Values that are the same in other words, in one line."""
    words = tuple(f"{d.key} {_register_text(d)}" for d in rows if d.other_word_only)
    return f"same values, other words: {_list_first(words)}" if words else ""


def _list_first(keys: tuple[str, ...]) -> str:
    more_count = len(keys) - MAX_KEYS
    return ", ".join(keys[:MAX_KEYS]) + (f" and {more_count} more" if more_count > 0 else "")


def _state_text(state: State) -> str:
    """What a listing says of a loop, and where."""
    side = f"{state.side}: " if state.side else ""
    return f"{side}{state.text} ({state.address} {state.word})"


def _extra_lines(entry: LoopComparison) -> Iterator[str]:
    """What is told of a loop without being a difference."""
    if entry.left_out:
        yield f"left out, since it runs: {_list_first(entry.left_out)} (--live)"
    if entry.missing:
        yield f"not in the listing: {_list_first(entry.missing)}"


# --- text -------------------------------------------------------------------------------------------------------------


def differences_text(result: DiffResult) -> str:
    """Loops that differ, the gravest difference first."""
    lines = [f"{result.before} → {result.after}"]
    for entry in result.loops:
        body = [f"  {state.kind:<8}  {_state_text(state)}" for state in entry.states]
        body += [_difference_line(d) for d in entry.differences if not d.other_word_only]
        body += [f"  {line}" for line in (_same_values_text(entry.differences),) if line]
        body += [_difference_line(d, "operated") for d in entry.operated] + [
            f"  {line}" for line in _extra_lines(entry)
        ]
        heading = _loop_heading(entry)
        if body or heading:
            lines += ["", f"{entry.loop or NO_LOOP_TITLE}{': ' if heading else ''}{heading}", *body]
    same = [entry.loop for entry in result.loops if entry.same and entry.loop and not (entry.missing or entry.operated)]
    if same:
        lines += ["", f"the same: {', '.join(same)}"]
    lines = [to_one_line(line) for line in lines]
    if result.verified is not None:
        lines += ["", verdict_text(result.verified, pictures=False).rstrip()]
    return "\n".join(lines) + "\n"


def _difference_line(d: Difference, title: str = "") -> str:
    word = f" ({text})" if (text := _register_text(d)) else ""
    note = f"  {d.note}" if d.note else ""
    return f"  {title or d.risk:<8}  {d.key or d.field}: {_values_text(d)}{word}{note}"


# --- Markdown ---------------------------------------------------------------------------------------------------------

DIFFERENCES_HEADER = ("", "| risk | key | before → after | register | |", "|---|---|---|---|---|")


def differences_markdown(result: DiffResult) -> str:
    """Tables for a pull request."""
    lines = [to_one_line(f"### PID loops: `{result.before}` → `{result.after}`")]
    for entry in result.loops:
        heading = _loop_heading(entry)
        rows = [_difference_cells(d, d.risk) for d in entry.differences if not d.other_word_only]
        rows += [_difference_cells(d, "operated") for d in entry.operated]
        extra_lines = [f"{state.kind}: {_state_text(state)}" for state in entry.states]
        extra_lines += [text for text in (_same_values_text(entry.differences), *_extra_lines(entry)) if text]
        if rows or extra_lines or heading:
            lines += [
                "",
                f"**{markdown_cell(entry.loop or NO_LOOP_TITLE)}**{' ' if heading else ''}{markdown_cell(heading)}",
            ]
            lines += [*DIFFERENCES_HEADER, *rows] if rows else []
            lines += [line for text in extra_lines for line in ("", markdown_cell(f"{text[:1].upper()}{text[1:]}."))]
    if result.same:
        lines += ["", "No other difference." if any(entry.operated for entry in result.loops) else "No difference."]
    if result.verified is not None:
        lines += verdict_markdown(result.verified)
    return "\n".join(lines) + "\n"


def _difference_cells(d: Difference, risk: str) -> str:
    texts = (
        f"**{risk}**" if risk in {"critical", "high"} else risk,
        d.key or d.field,
        _values_text(d),
        _register_text(d),
        d.note,
    )
    return "| " + " | ".join(text if text.startswith("**") else markdown_cell(text) for text in texts) + " |"
