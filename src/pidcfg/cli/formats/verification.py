"""The verdicts of the battery as text and Markdown."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.cli.files.plots import in_characters
from pidcfg.cli.formats.markdown import cell
from pidcfg.results.verification import SEVERAL

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.verification.comparison import Difference
    from pidcfg.verification.verdict import Named, Untried, Verified

UNITS = {"pv": "PV", "output": "output", "setpoint": "set point", "mode": "mode", "run": "no run"}
NOTHING = "  no loop could be compared"


def verdict_text(loops: Sequence[Verified], *, pictures: bool = True) -> str:
    """What differs, loop by loop, and where a line of the report says why; with pictures for the terminal."""
    lines = ["both sides in the same battery of stages, on the same plants"]
    for loop in loops:
        lines += ["", f"{loop.loop}: {headline(loop)}"]
        lines += [f"  differs: {in_words(one.difference)}{_because(one.key)}" for one in loop.failures]
        lines += [f"  named: {text}" for text in _named(loop.named)]
        lines += [f"  not tried: {text}" for text in _untried(loop.untried)]
        if pictures:
            lines.append(in_characters(replace(loop.chart, title=""), sys.stderr))
    return "\n".join(lines if loops else [*lines, NOTHING]) + "\n"


def headline(loop: Verified) -> str:
    """The verdict, and how far both sides lie apart in a step and a disturbance."""
    ratio = "" if loop.iae_ratio is None else f", ratio of IAE {loop.iae_ratio:.4g}"
    verdict = "alike" if loop.passed else "NOT alike"
    stages = f"{len(loop.stages)} stages" if len(loop.stages) > 1 else "one stage"
    apart = f"PV at most {loop.pv_percent:.3g} % of its range apart, output {loop.output_percent:.3g} %"
    return f"{verdict} in {stages}; {apart}{ratio}"


def in_words(one: Difference) -> str:
    """A difference: stage, signal, time, and what both sides show."""
    signal = UNITS.get(one.signal, f"alarm {one.signal}")
    if one.signal == "run":
        return f"{one.stage}: {one.after}"
    most = "" if one.worst is None else f", at most {100 * one.worst:.3g} % of the range apart"
    return f"{one.stage}: {signal} {_shown(one, one.before)} against {_shown(one, one.after)} at {one.at:.4g} s{most}"


def _shown(one: Difference, value: float | str | bool) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    return f"{100 * value:.4g} %" if one.signal == "output" else f"{value:.5g}"


def _because(key: str) -> str:
    return f" (see {key})" if key else ""


def _named(rows: Sequence[Named]) -> Iterator[str]:
    """Each line of the report once, with the stages in which it shows."""
    stages: dict[tuple[str, str], dict[str, None]] = {}
    for row in rows:
        line = ("rounding", SEVERAL) if row.line is None else (row.line.field, row.line.note)
        stages.setdefault(line, {})[row.difference.stage] = None
    for (field, note), names in stages.items():
        yield f"{field} ({', '.join(names)}){f': {note}' if note else ''}"


def _untried(rows: Sequence[Untried]) -> Iterator[str]:
    """The stages of each mode that the source does not go to."""
    for mode in dict.fromkeys(row.mode for row in rows):
        stages = ", ".join(row.stage for row in rows if row.mode == mode)
        yield f"{stages}: the source does not go to {mode} when it is asked to; its program, or an input, decides"


def verdict_markdown(loops: Sequence[Verified]) -> list[str]:
    """The same as lines of Markdown."""
    lines = ["", "### Verified", ""]
    for loop in loops:
        lines.append(f"- **{cell(loop.loop)}**: {cell(headline(loop))}")
        lines += [f"  - differs: {cell(in_words(one.difference) + _because(one.key))}" for one in loop.failures]
        lines += [f"  - named: {cell(text)}" for text in _named(loop.named)]
        lines += [f"  - not tried: {cell(text)}" for text in _untried(loop.untried)]
    return lines
