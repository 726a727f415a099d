"""Where everything of a picture stands, in inches from the top left: charts of the same kind get the same sizes."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.pictures.style import LETTER, SIZES, moment, plain

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Chart, Mark

POINTS = 72
"""In an inch."""
WIDTH, LEFT = 9.6, 1.55
"""Width of a picture, and of it what is left of the axes: titles and numbers."""
RIGHT = 0.5
"""What is right of them: names of lines."""
LABEL = 0.78
"""How far the title of a value axis is from it."""
TITLE, KEY, ABOVE = 0.30, 0.22, 0.16
"""Heights of a chart's title, of the line that says what before and after are, and of the numbers of the marks."""
FIRST, FURTHER, GAP = 1.85, 1.05, 0.13
"""Heights of the first panel and of the others, and what is between two."""
LOCUS, LOCUS_TITLE = 3.3, 0.42
"""Height of a curve in the complex plane, no more than its width; and of the title of its real axis."""
STRIP, STRIP_GAP = 0.20, 0.045
TIME = 0.46
"""The time axis: its numbers and its title."""
LINE, BELOW, MARGIN = 0.165, 0.26, 0.12
"""A line of text below a chart, what separates two charts, and the margin around all."""
LISTED = 12
"""Events that are explained below a chart."""
MOST_LINES = 3
"""Lines that one explanation may take."""


@dataclass(frozen=True, slots=True)
class Box:
    """A rectangle from the top left, in inches."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True, slots=True)
class Place:
    """Where the parts of one chart stand."""

    chart: Chart
    top: float
    key: float | None
    """Top of the line that names both sides."""
    locus: Box | None
    panels: tuple[Box, ...]
    strips: tuple[Box, ...]
    text_top: float
    texts: tuple[str, ...]
    """Lines below the time axis."""
    bottom: float


@dataclass(frozen=True, slots=True)
class Sheet:
    """The whole picture."""

    width: float
    left: float
    height: float
    title: str
    """Above all charts; empty where the only chart says it."""
    places: tuple[Place, ...]


def sheet(charts: Sequence[Chart], title: str) -> Sheet:
    """The places of all charts; the title stands above them unless the only one has it."""
    top = MARGIN
    heading = "" if [title] == [chart.title for chart in charts] else plain(title)
    if heading:
        top += TITLE + 0.08
    places = []
    for chart in charts:
        place = _place(chart, top)
        places.append(place)
        top = place.bottom + BELOW
    return Sheet(WIDTH, LEFT, (places[-1].bottom if places else top) + MARGIN, heading, tuple(places))


def letters_in(width: float, size: float) -> int:
    """How many letters of a size in points fit into a width in inches."""
    return max(int(width * POINTS / (size * LETTER)), 1)


def _place(chart: Chart, begin: float) -> Place:
    wide = WIDTH - LEFT - RIGHT
    top = begin + TITLE
    key = top if chart.sides else None
    top += KEY if chart.sides else 0.0
    top += ABOVE if chart.marks else 0.05
    locus = Box(LEFT, top, wide, min(LOCUS, wide)) if chart.locus else None
    top += locus.height + LOCUS_TITLE if locus else 0.0
    panels, strips = [], []
    for i in range(len(chart.panels)):
        height = FURTHER if i else FIRST
        panels.append(Box(LEFT, top, wide, height))
        top += height + GAP
    for _ in chart.strips:
        strips.append(Box(LEFT, top, wide, STRIP))
        top += STRIP + STRIP_GAP
    top += TIME - (STRIP_GAP if strips else GAP)
    texts = texts_of(chart, letters_in(WIDTH - 2 * MARGIN, SIZES["small"]))
    return Place(chart, begin, key, locus, tuple(panels), tuple(strips), top, texts, top + LINE * len(texts))


def numbered(chart: Chart) -> list[tuple[str, Mark]]:
    """The marks in the order of time, with their numbers."""
    return [(str(i), mark) for i, mark in enumerate(sorted(chart.marks, key=lambda mark: mark.at), start=1)]


def texts_of(chart: Chart, letters: int) -> tuple[str, ...]:
    """What stands below a chart: its marks by number, and its notes."""
    return tuple(line for text in explained(chart) for line in _wrapped(text, letters))


def explained(chart: Chart) -> list[str]:
    """What each mark is, as far as there is room (failures always), and the notes."""
    marks = numbered(chart)
    left_out = [number for number, mark in marks if mark.kind == "event"][LISTED:]
    lines = []
    for number, mark in marks:
        what = "failed: " if mark.kind == "failure" else ""
        if number not in left_out:
            lines.append(f"{number} at {moment(chart, mark.at)}: {what}{plain(mark.label)}")
    if left_out:
        lines.append(f"and {len(left_out)} more events")
    return [*lines, *map(plain, chart.notes)]


def _wrapped(text: str, letters: int) -> list[str]:
    return textwrap.wrap(text, letters, max_lines=MOST_LINES, placeholder=" …", subsequent_indent="    ")
