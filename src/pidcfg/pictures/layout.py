"""What all pictures share: colours and pens, ends and ticks of axes, points of lines, words for those who hear them."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import ceil, floor, isfinite, log10

from pidcfg.pictures import Band, Chart, Line, Mark, Panel, Strip, StripKind
from pidcfg.text.frozen import frozen

# ----------------------------------------------------------------------------------------------------------------------
# How pictures look: colours that survive greyscale printing and colour blindness, line styles, sizes, units of time.
# Colours are those of Okabe and Ito; whatever a colour tells is also told by a line style, a label or a place.

BLACK, INK, GREY, LIGHT_GREY, FIELD = "#000000", "#222222", "#707070", "#d9d9d9", "#f7f7f7"
BLUE, GREEN, VERMILION, PURPLE, ORANGE, SKY = "#0072B2", "#007A5A", "#D55E00", "#CC79A7", "#E69F00", "#56B4E9"
WARNING_COLOUR = "#A84300"
"""Vermilion as small letters need it: dark enough on white."""


@frozen
class Pen:
    """A colour, a width in points and a pattern of dashes (empty: solid)."""

    colour: str
    width: float
    dashes: tuple[float, ...] = ()


PENS = {
    ("setpoint", None): Pen(INK, 1.2, (5, 2.5)),
    ("pv", None): Pen(BLUE, 1.9),
    ("output", None): Pen(GREEN, 1.6),
    ("level", None): Pen(WARNING_COLOUR, 1.0, (1.5, 2.5)),
    ("other", None): Pen(PURPLE, 1.3, (7, 2, 1.5, 2)),
    ("pv", "after"): Pen(BLUE, 2.4),
    ("output", "after"): Pen(GREEN, 2.2),
    ("other", "after"): Pen(PURPLE, 2.0),
}
"""By the role of a line and the side it belongs to: SP dashed, PV solid and thick."""
BEFORE_PEN = Pen("#8a8a8a", 1.2, (4, 2))
"""Thin dashed grey, which can be seen on white and on a line of after."""
OVERLAID_SETPOINT_PEN = Pen(INK, 1.0, (1.2, 1.6))
"""A set point where dashes are those of before."""


def pen_of(line: Line, *, overlaid: bool) -> Pen:
    """How a line is drawn; ``overlaid``: in a chart of two runs."""
    if line.side == "before":
        return BEFORE_PEN
    return OVERLAID_SETPOINT_PEN if overlaid and line.role == "setpoint" else PENS[line.role, line.side]


STEP_ROLES = {"setpoint", "output", "level"}
"""Roles of signals that keep their value until the next one."""

MODE_COLOURS = {"manual": ("#ececec", GREY), "auto": ("#cfe3f1", BLUE), "cascade": ("#cfeadf", GREEN)}
"""Fill and edge of the bars of the modes that most vendors have."""
BAR_COLOURS: dict[StripKind, tuple[tuple[str, str], ...]] = {
    "mode": (("#f6e3c0", ORANGE), ("#f1dbe7", PURPLE)),
    "alarm": (("#f7cdb2", VERMILION),),
    "step": (("#dff0fb", SKY), ("#f9ecd0", ORANGE)),
    "condition": (("#f1dbe7", PURPLE),),
}
"""Fill and edge of the other bars, by turns for those of a strip that are called differently."""


def bar_colours(strip: Strip) -> dict[str, tuple[str, str]]:
    """Fill and edge of each bar of a strip by what it is called."""
    names = list(dict.fromkeys(bar.label for bar in strip.bars))
    others = [name for name in names if strip.kind != "mode" or name not in MODE_COLOURS]
    fills = BAR_COLOURS[strip.kind]
    return MODE_COLOURS | {name: fills[i % len(fills)] for i, name in enumerate(others)}


MAX_DRAWN_VALUE = 1e100
"""From here on a value has no place on an axis."""
LETTER_SIZES = {"title": 11.0, "label": 9.0, "small": 8.0}
"""Of letters, in points."""
LETTER_WIDTH = 0.62
"""Width of an average letter as a share of its size, rather too much."""


def drawable_points(line: Line) -> tuple[list[float], list[float]]:
    """The times and values of a line that have a place on an axis."""
    times, values = line.times, line.values
    if (
        values
        and isfinite(sum(times))
        and isfinite(sum(values))
        and -MAX_DRAWN_VALUE < min(values) <= max(values) < MAX_DRAWN_VALUE
    ):
        return list(times), list(values)
    pairs = [(t, v) for t, v in zip(line.times, line.values, strict=True) if isfinite(t) and abs(v) < MAX_DRAWN_VALUE]
    return [t for t, _ in pairs], [v for _, v in pairs]


UNITS_OF_TIME = ((180.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (float("inf"), "h", 3600.0))
"""The longest time shown in each unit, its name, and its seconds."""


def unit_of_time(chart: Chart) -> tuple[str, float]:
    """In which unit the time axis of a chart is labelled, and its seconds."""
    begin, end = chart.time_span
    return next((name, size) for longest, name, size in UNITS_OF_TIME if end - begin <= longest)


def time_text(chart: Chart, time: float) -> str:
    """A time as the axis would label it."""
    name, size = unit_of_time(chart)
    return f"{time / size:.4g} {name}"


def with_unit(title: str, unit: str) -> str:
    """An axis' label."""
    return f"{title} ({unit})" if unit else title


def plain_text(text: str) -> str:
    """A text on one line without control characters, which no picture can show."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in " ".join(text.split()))


def shorten(text: str, letters: int) -> str:
    """A text that is not longer than its place."""
    text = plain_text(text)
    return text if len(text) <= letters else text[: max(letters - 1, 0)].rstrip() + "…"


# --- Texts below a chart, and how much of a text has room -------------------------------------------------------------

MAX_EVENTS = 12
"""Events that are explained below a chart."""
MAX_TEXT_LINES = 3
"""Lines that one explanation may take."""


def letter_capacity(width: float, size: float) -> int:
    """How many letters of a size fit into a width."""
    return max(int(width / (size * LETTER_WIDTH)), 1)


def number_marks(chart: Chart) -> list[tuple[str, Mark]]:
    """The marks in the order of time, with their numbers."""
    return [(str(i), mark) for i, mark in enumerate(sorted(chart.marks, key=lambda mark: mark.time), start=1)]


def texts_of(chart: Chart, letters: int) -> tuple[str, ...]:
    """What stands below a chart: its marks by number, and its notes."""
    return tuple(line for text in explain_marks(chart) for line in _wrap_text(text, letters))


def explain_marks(chart: Chart) -> list[str]:
    """What each mark is, as far as there is room (failures always), and the notes."""
    marks = number_marks(chart)
    left_out = [number for number, mark in marks if mark.kind == "event"][MAX_EVENTS:]
    lines = []
    for number, mark in marks:
        prefix = "failed: " if mark.kind == "failure" else ""
        if number not in left_out:
            lines.append(f"{number} at {time_text(chart, mark.time)}: {prefix}{plain_text(mark.label)}")
    if left_out:
        lines.append(f"and {len(left_out)} more events")
    return [*lines, *map(plain_text, chart.notes)]


def _wrap_text(text: str, letters: int) -> list[str]:
    return textwrap.wrap(text, letters, max_lines=MAX_TEXT_LINES, placeholder=" …", subsequent_indent="    ")


# --- Ends and ticks of an axis, and numbers as people write them beside it --------------------------------------------

AXIS_ROOM = 0.06
"""What is left free above and below the lines, as a share of what they cover."""
LEVEL_REACH = 0.25
"""How far beyond the signals an axis reaches to show a level, as a share of what they cover."""
FLAT_SHARE = 1e-9
"""Values that differ by less than this share of their size are one value."""
TICK_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Distances of ticks, times a power of ten."""
TIME_TICK_STEPS = (1.0, 2.0, 3.0, 5.0, 6.0, 10.0)
"""The same of minutes and hours: 30, not 25."""
MAX_TIME_TICKS, MAX_VALUE_TICKS = 8, 5
"""Most ticks of the axes."""
TICK_SLACK = 1e-9
"""What rounding may add to the ends of an axis, as a share of a step."""


def axis_limits(panel: Panel) -> tuple[float, float]:
    """The ends of a value axis: all signals with some room, and around a flat line something to see it in.

    A level widens it only where it is near: an alarm that is far away would make a line of the signal.
    """
    values = [v for line in panel.lines if line.role != "level" for v in drawable_points(line)[1]] + list(
        panel.shown_range or ()
    )
    values += [v for band in panel.bands for side in (band.low, band.high) for v in side]
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high - low <= FLAT_SHARE * max(abs(low), abs(high)):
        low, high = low - 0.05 * (abs(low) or 10.0), high + 0.05 * (abs(high) or 10.0)
    reach = LEVEL_REACH * (high - low)
    levels = [v for line in panel.lines if line.role == "level" for v in drawable_points(line)[1]]
    close = [v for v in levels if low - reach <= v <= high + reach]
    low, high = min([low, *close]), max([high, *close])
    room = AXIS_ROOM * (high - low)
    return low - room, high + room


def layer_of(line: Line) -> tuple[bool, bool, bool]:
    """Levels lie below all, thin lines on thick ones."""
    return line.role != "level", line.role == "setpoint", line.side == "before"


def level_names(panel: Panel) -> list[tuple[float, str]]:
    """Where the name of each level stands, the lowest first: once, at the highest end that is seen."""
    low, high = axis_limits(panel)
    ends: dict[str, float] = {}
    for line in panel.lines:
        if line.role == "level" and line.values and low <= line.values[-1] <= high:
            ends[line.name] = max(line.values[-1], ends.get(line.name, low))
    return sorted((value, name) for name, value in ends.items())


def ticks(low: float, high: float, max_ticks: int, steps: Sequence[float] = TICK_STEPS) -> list[float]:
    """Round numbers between the ends of an axis, at most so many."""
    rough = (high - low) / max_ticks
    power = 10.0 ** floor(log10(rough))
    step = next(size * power for size in steps if size * power >= rough * (1 - TICK_SLACK))
    first, last = ceil(low / step - TICK_SLACK), floor(high / step + TICK_SLACK)
    return [i * step for i in range(first, last + 1)]


def time_ticks(chart: Chart) -> list[float]:
    """Where the time axis has numbers, in its unit."""
    (begin, end), (_, size) = chart.time_span, unit_of_time(chart)
    return ticks(begin / size, (end if end > begin else begin + 1.0) / size, MAX_TIME_TICKS, TIME_TICK_STEPS)


def tick_text(value: float) -> str:
    """A tick's number."""
    return f"{value:.10g}"


def spread_apart(places: Sequence[float], room: float, distance: float) -> list[float]:
    """Ascending places, moved as little as needed to be apart, and within the room as far as it allows."""
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + distance if moved else place))
    for i in range(len(moved) - 1, -1, -1):
        ceiling = room if i == len(moved) - 1 else moved[i + 1] - distance
        moved[i] = min(moved[i], ceiling)
    return moved


# --- The points of a line, in a square that is as large as its panel --------------------------------------------------

SQUARE_SIZE = 100_000
"""Width and height of a panel in its own units: finer than any screen."""


def line_points(chart: Chart, line: Line, low: float, high: float) -> list[tuple[int, int]]:
    """A line's points in the square of a panel from ``low`` to ``high``, without those that change nothing.

    The last point goes where the line is level before and after it.
    """
    (begin, end), (times, values) = chart.time_span, drawable_points(line)
    scale, span, is_held = SQUARE_SIZE / ((end - begin) or 1.0), high - low, line.role in STEP_ROLES
    xs = [round((time - begin) * scale) for time in times]
    ys = [round((high - value) / span * SQUARE_SIZE) for value in values]
    corners = list(zip(xs[:1], ys[:1], strict=True))
    level = False
    for (before, height), (x, y) in pairwise(zip(xs, ys, strict=True)):
        if y == height:
            if level:
                corners[-1] = (x, y)
            elif x != before:
                corners.append((x, y))
                level = True
        else:
            if is_held and x != before:
                corners[-1 if level else len(corners) :] = [(x, height)]
            corners.append((x, y))
            level = False
    return corners


def band_corners(chart: Chart, band: Band, low: float, high: float) -> list[tuple[int, int]]:
    """The corners of a band, in the same square."""
    sides = (line_points(chart, Line("", band.role, band.times, side), low, high) for side in (band.high, band.low))
    return next(sides) + next(sides)[::-1]


# --- What a chart shows, in words: for those who hear a page instead of seeing it -------------------------------------

MAX_DESCRIBED = 20
"""Bars and marks that are named, of each kind."""


def describe_charts(charts: Iterable[Chart]) -> str:
    """All charts in sentences."""
    return " ".join(_describe_chart(chart) for chart in charts)


def _describe_chart(chart: Chart) -> str:
    begin, end = chart.time_span
    sentences = [f"{plain_text(chart.title)}, from {time_text(chart, begin)} to {time_text(chart, end)}."]
    if chart.sides:
        sentences.append(f"Before is {plain_text(chart.sides[0])}, after is {plain_text(chart.sides[1])}.")
    sentences += [] if chart.locus is None else [f"The open loop in the complex plane: {chart.locus.text}."]
    for panel in chart.panels:
        lines = "; ".join(_describe_line(line) for line in panel.lines)
        sentences.append(f"{plain_text(with_unit(panel.title, panel.unit))}: {lines}.")
    for strip in chart.strips:
        bars = [
            f"{plain_text(bar.label)} from {time_text(chart, bar.begin)} to {time_text(chart, bar.end)}"
            for bar in strip.bars
        ]
        if bars:
            sentences.append(f"{plain_text(strip.title)}: {_list_first(bars)}.")
    marks = [
        f"{plain_text(mark.label)} at {time_text(chart, mark.time)}" for mark in chart.marks if mark.kind == "event"
    ]
    failures = [
        f"{plain_text(mark.label)} at {time_text(chart, mark.time)}" for mark in chart.marks if mark.kind == "failure"
    ]
    sentences += [f"Events: {_list_first(marks)}."] if marks else []
    sentences += [f"Failed: {_list_first(failures)}."] if failures else []
    return " ".join([*sentences, *(f"{plain_text(note)}." for note in chart.notes)])


def _describe_line(line: Line) -> str:
    side = f" {line.side}" if line.side else ""
    _, values = drawable_points(line)
    if not values:
        return f"{plain_text(line.name)}{side} without values"
    return f"{plain_text(line.name)}{side} between {min(values):.5g} and {max(values):.5g}, at the end {values[-1]:.5g}"


def _list_first(texts: list[str]) -> str:
    more = f" and {len(texts) - MAX_DESCRIBED} more" if len(texts) > MAX_DESCRIBED else ""
    return "; ".join(texts[:MAX_DESCRIBED]) + more


def group_numbers(marks: Sequence[tuple[float, str, bool]], distance: float) -> list[tuple[float, str, bool]]:
    """Numbers of marks that are close together as one text: 3-5."""
    groups: list[tuple[float, str, bool]] = []
    for position, number, failed in marks:
        if groups and position - groups[-1][0] < distance:
            first, text, any_failed = groups[-1]
            groups[-1] = (first, f"{text.partition('-')[0]}-{number}", any_failed or failed)
        else:
            groups.append((position, number, failed))
    return groups
