"""Charts in characters, for terminals: with signs that every code page has, or with finer ones where it has them.

A line of one sign a column cannot show all values of a long run: a column shows the lowest and the highest one of its
time and everything between, so that no spike is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from pidcfg.pictures import Bar, Chart, Line, Panel, Strip
from pidcfg.pictures.layout import (
    STEP_ROLES,
    drawable_points,
    explain_marks,
    number_marks,
    plain_text,
    unit_of_time,
    with_unit,
)
from pidcfg.text.frozen import frozen
from pidcfg.text.signs import pad_left, width_of

GUTTER, NAMES_SHARE = 12, 4
"""Characters left of a panel at least, for its numbers; and the part of the width that names of strips may take."""
LONGEST_SIDE_NAME = 28
"""Longest name of a side in a legend."""
OUTPUT_SHARE = 0.5
"""Height of the further panels as a share of the first one's."""


@frozen
class Signs:
    """What is drawn with."""

    axis: str
    corner: str
    floor: str
    lines: dict[str, str]
    """By role, or by side in an overlay."""
    overlap: str
    mark: str
    bar: tuple[str, str, str]
    """Beginning, middle and end of a bar."""
    ellipsis: str
    gutter: int = GUTTER
    """Characters left of a panel."""


ASCII = Signs(
    "|",
    "+",
    "-",
    {"setpoint": "-", "pv": "o", "output": "*", "level": "_", "other": ".", "before": "o", "after": "x"},
    "@",
    ":",
    ("[", "=", "]"),
    "~",
)
UNICODE = Signs(
    "│",
    "└",
    "─",
    {"setpoint": "╌", "pv": "●", "output": "■", "level": "╴", "other": "·", "before": "○", "after": "×"},
    "◉",
    "┊",
    ("▕", "━", "▏"),
    "…",
)


def can_encode_signs(encoding: str | None) -> bool:
    """Whether a terminal with this encoding can show the finer signs."""
    texts = (
        UNICODE.axis,
        UNICODE.corner,
        UNICODE.floor,
        *UNICODE.lines.values(),
        UNICODE.overlap,
        UNICODE.mark,
        *UNICODE.bar,
        UNICODE.ellipsis,
    )
    try:
        "".join(texts).encode(encoding or "ascii")
    except (UnicodeEncodeError, LookupError):
        return False
    return True


def draw_rows(chart: Chart, width: int, height: int, *, ascii_only: bool) -> list[str]:
    """The chart, ``width`` characters wide; ``height``: rows of its first panel."""
    longest = max((len(plain_text(strip.title)) for strip in chart.strips), default=0)
    gutter = max(GUTTER, min(longest + 1, width // NAMES_SHARE))
    signs = replace(ASCII if ascii_only else UNICODE, gutter=gutter)
    columns = max(width - gutter - 2, 10)
    rows = [
        *([_cut_text(plain_text(chart.title), width, signs)] if chart.title else []),
        *_mark_numbers(chart, columns, signs),
    ]
    for i, panel in enumerate(chart.panels):
        rows += _panel_rows(chart, panel, columns, max(height if i == 0 else round(height * OUTPUT_SHARE), 2), signs)
    rows += [_strip_row(chart, strip, columns, signs) for strip in chart.strips]
    rows += [*_time_axis(chart, columns, signs), *(_cut_text(text, width, signs) for text in explain_marks(chart))]
    return [_to_ascii(row) if ascii_only else row for row in rows]


def _to_ascii(text: str) -> str:
    return text.encode("ascii", "replace").decode("ascii")


def _cut_text(text: str, width: int, signs: Signs) -> str:
    """A text that is not longer than its place."""
    if width_of(text) <= width:
        return text
    while text and width_of(text) >= width:
        text = text[:-1]
    return text.rstrip() + signs.ellipsis


def _gutter_text(text: str, signs: Signs) -> str:
    return pad_left(_cut_text(plain_text(text), signs.gutter - 1, signs), signs.gutter) + " "


# --- panels ----------------------------------------------------------------------------------------------------------


def _panel_rows(chart: Chart, panel: Panel, columns: int, height: int, signs: Signs) -> list[str]:
    """What the panel shows, then its rows."""
    layered = sorted(panel.lines, key=_line_layer)
    spans = [(line, spans_of(line, *chart.time_span, columns)) for line in layered]
    values = [v for line, cells in spans if line.role != "level" for cell in cells if cell for v in cell]
    low, high = min(values, default=0.0), max(values, default=0.0)
    grid = [[" "] * columns for _ in range(height)]
    for mark in chart.marks:
        _draw_mark(grid, _column_of(mark.time, *chart.time_span, columns), signs.mark)
    for line, cells in spans:
        sign = signs.lines[line.side or line.role]
        for column, cell in enumerate(cells):
            if cell is None or (line.role == "level" and not low <= cell[0] <= cell[1] <= high):
                continue
            top, bottom = (_row_of(value, low, high, height) for value in (cell[1], cell[0]))
            for row in range(top, bottom + 1):
                present = grid[row][column]
                overlaid = line.side == "after" and present in {signs.lines["before"], signs.overlap}
                grid[row][column] = signs.overlap if overlaid else sign
    labels = {0: f"{high:.5g}", height - 1: f"{low:.5g}"}
    rows = [f"{_gutter_text(labels.get(i, ''), signs)}{signs.axis}{''.join(cells)}" for i, cells in enumerate(grid)]
    return [*_panel_head(chart, panel, columns, signs), *(row.rstrip() for row in rows)]


def _panel_head(chart: Chart, panel: Panel, columns: int, signs: Signs) -> list[str]:
    """What the panel shows and the signs of its lines, on one row if they fit."""
    title = plain_text(with_unit(panel.title, panel.unit))
    legend = _legend(sorted(panel.lines, key=_line_layer), chart, signs)
    combined = f"{title}:  {legend}"
    rows = [combined] if len(combined) <= columns else [title, legend]
    return [f"{'':{signs.gutter + 2}}{_cut_text(row, columns, signs)}".rstrip() for row in rows]


def _legend(layered: Sequence[Line], chart: Chart, signs: Signs) -> str:
    """The signs of the lines; in an overlay of both sides by name."""
    names: dict[str, str] = {}
    for line in layered:
        sign, name = signs.lines[line.side or line.role], plain_text(line.side or line.name)
        if name not in names.get(sign, "").split(", "):
            names[sign] = f"{names[sign]}, {name}" if line.role == "level" and sign in names else name
    if chart.sides and any(line.side for line in layered):
        names |= {
            signs.lines["before"]: _cut_text(plain_text(chart.sides[0]), LONGEST_SIDE_NAME, signs),
            signs.lines["after"]: _cut_text(plain_text(chart.sides[1]), LONGEST_SIDE_NAME, signs),
            signs.overlap: "both",
        }
    return "   ".join(f"{sign} {name}" for sign, name in names.items())


def _line_layer(line: Line) -> tuple[bool, bool, bool]:
    """Levels lie below all, then the set point, before below after."""
    return line.role != "level", line.role != "setpoint", line.side != "before"


def _row_of(value: float, low: float, high: float, height: int) -> int:
    if high <= low:
        return height // 2
    return height - 1 - min(height - 1, int((value / 2 - low / 2) / (high / 2 - low / 2) * height))


def _column_of(time: float, begin: float, end: float, columns: int) -> int:
    return max(0, min(columns - 1, int((time - begin) / (end - begin) * columns))) if end > begin else 0


def _draw_mark(grid: list[list[str]], column: int, sign: str) -> None:
    for row in grid:
        row[column] = sign


def spans_of(line: Line, begin: float, end: float, columns: int) -> list[tuple[float, float] | None]:
    """Lowest and highest value in each column's time; where there is none, the line goes on from before."""
    spans: list[tuple[float, float] | None] = [None] * columns
    points = [(t, v) for t, v in zip(*drawable_points(line), strict=True) if begin <= t <= end]
    for time, value in points:
        column = _column_of(time, begin, end, columns)
        low, high = spans[column] or (value, value)
        spans[column] = min(low, value), max(high, value)
    if line.role in STEP_ROLES:
        _fill_held(spans, points, begin, end)
    else:
        _fill_slopes(spans, points, begin, end)
    return spans


def _fill_held(
    spans: list[tuple[float, float] | None], points: Sequence[tuple[float, float]], begin: float, end: float
) -> None:
    """Columns between two values of a signal that keeps its value."""
    for i, (time, value) in enumerate(points):
        until = points[i + 1][0] if i + 1 < len(points) else end
        for column in range(_column_of(time, begin, end, len(spans)) + 1, _column_of(until, begin, end, len(spans))):
            spans[column] = value, value


def _fill_slopes(
    spans: list[tuple[float, float] | None], points: Sequence[tuple[float, float]], begin: float, end: float
) -> None:
    """Columns between two values of a signal that moves from one to the other."""
    for (t0, v0), (t1, v1) in pairwise(points):
        first, last = (_column_of(t, begin, end, len(spans)) for t in (t0, t1))
        for column in range(first + 1, last):
            value = v0 + (v1 - v0) * (column - first) / (last - first)
            spans[column] = value, value


# --- strips and text -------------------------------------------------------------------------------------------------


def _strip_row(chart: Chart, strip: Strip, columns: int, signs: Signs) -> str:
    cells = [" "] * columns
    for bar in strip.bars:
        _draw_bar(cells, chart, bar, signs)
    return f"{_gutter_text(strip.title, signs)}{signs.axis}{''.join(cells)}".rstrip()


def _draw_bar(cells: list[str], chart: Chart, bar: Bar, signs: Signs) -> None:
    """A bar with its name in it, as far as there is room; the shortest one is one sign."""
    first = _column_of(bar.begin, *chart.time_span, len(cells))
    last = max(first, _column_of(bar.end, *chart.time_span, len(cells)) - (bar.end < chart.time_span[1]))
    begin, middle, end = signs.bar
    room = last - first - 1
    name = plain_text(bar.label)
    inner = _cut_text(name, room, signs) if room >= min(len(name), 3) else ""
    text = begin + inner + middle * (room - len(inner)) + end if last > first else middle
    cells[first : last + 1] = text


def _time_axis(chart: Chart, columns: int, signs: Signs) -> list[str]:
    """The time axis with its ends, and its unit in the middle."""
    begin, end = chart.time_span
    unit, size = unit_of_time(chart)
    first, last, title = f"{begin / size:.4g}", f"{end / size:.4g}", with_unit("time", unit)
    room = columns - len(first) - len(last)
    line = f"{' ':{signs.gutter}} {signs.corner}{signs.floor * columns}"
    return [line, f"{' ':{signs.gutter}}  {first}{title:^{room}}{last}"]


def _mark_numbers(chart: Chart, columns: int, signs: Signs) -> list[str]:
    """The numbers of the marks above them, as far as they do not cover each other."""
    row = [" "] * columns
    for number, mark in number_marks(chart):
        column = min(_column_of(mark.time, *chart.time_span, columns), columns - len(number))
        if all(cell == " " for cell in row[max(column - 1, 0) : column + len(number)]):
            row[column : column + len(number)] = number
    return [f"{'':{signs.gutter + 2}}{''.join(row)}".rstrip()] if chart.marks else []
