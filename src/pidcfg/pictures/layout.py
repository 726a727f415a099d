"""Where everything of a picture stands and how it looks: colours, axes, strips, and its text for those who hear it."""

from __future__ import annotations

import textwrap
from math import ceil, floor, isfinite, log10
from typing import TYPE_CHECKING, Any

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from matplotlib.axes import Axes
    from matplotlib.typing import LineStyleType as LineStyle

    from pidcfg.pictures.chart import Chart, Line, Mark, Panel, Strip, StripKind

    Look = dict[str, Any]
    """Properties of a text or a line, by the library's names for them."""

# ----------------------------------------------------------------------------------------------------------------------
# How pictures look: colours that survive greyscale printing and colour blindness, line styles, sizes, units of time.
# Colours are those of Okabe and Ito; whatever a colour tells is also told by a line style, a label or a place.

BLACK, INK, GREY, PALE, FIELD = "#000000", "#222222", "#707070", "#d9d9d9", "#f7f7f7"
BLUE, GREEN, VERMILION, PURPLE, ORANGE, SKY = "#0072B2", "#007A5A", "#D55E00", "#CC79A7", "#E69F00", "#56B4E9"
WARNING = "#A84300"
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
    ("level", None): Pen(WARNING, 1.0, (1.5, 2.5)),
    ("other", None): Pen(PURPLE, 1.3, (7, 2, 1.5, 2)),
    ("pv", "after"): Pen(BLUE, 2.4),
    ("output", "after"): Pen(GREEN, 2.2),
    ("other", "after"): Pen(PURPLE, 2.0),
}
"""By the role of a line and the side it belongs to: SP dashed, PV solid and thick."""
BEFORE = Pen("#8a8a8a", 1.2, (4, 2))
"""Thin dashed grey, which can be seen on white and on a line of after."""
SETPOINT_BESIDE = Pen(INK, 1.0, (1.2, 1.6))
"""A set point where dashes are those of before."""


def pen_of(line: Line, *, overlaid: bool) -> Pen:
    """How a line is drawn; ``overlaid``: in a chart of two runs."""
    if line.side == "before":
        return BEFORE
    return SETPOINT_BESIDE if overlaid and line.role == "setpoint" else PENS[line.role, line.side]


def pattern(pen: Pen) -> LineStyle:
    """A pen's dashes as the library takes them: relative to its width."""
    return (0, tuple(dash / pen.width for dash in pen.dashes)) if pen.dashes else "-"


def stroke(pen: Pen) -> Look:
    """A pen as the library draws a line with it."""
    return {"color": pen.colour, "linewidth": pen.width, "linestyle": pattern(pen)}


HELD_ROLES = {"setpoint", "output", "level"}
"""Roles of signals that keep their value until the next one."""

MODES = {"manual": ("#ececec", GREY), "auto": ("#cfe3f1", BLUE), "cascade": ("#cfeadf", GREEN)}
"""Fill and edge of the bars of the modes that most vendors have."""
FILLS: dict[StripKind, tuple[tuple[str, str], ...]] = {
    "mode": (("#f6e3c0", ORANGE), ("#f1dbe7", PURPLE)),
    "alarm": (("#f7cdb2", VERMILION),),
    "step": (("#dff0fb", SKY), ("#f9ecd0", ORANGE)),
    "condition": (("#f1dbe7", PURPLE),),
}
"""Fill and edge of the other bars, by turns for those of a strip that are called differently."""


def fills_of(strip: Strip) -> dict[str, tuple[str, str]]:
    """Fill and edge of each bar of a strip by what it is called."""
    names = list(dict.fromkeys(bar.label for bar in strip.bars))
    others = [name for name in names if strip.kind != "mode" or name not in MODES]
    fills = FILLS[strip.kind]
    return MODES | {name: fills[i % len(fills)] for i, name in enumerate(others)}


LARGEST = 1e100
"""From here on a value has no place on an axis."""
SIZES = {"title": 11.0, "label": 9.0, "small": 8.0}
"""Of letters, in points."""
LETTER = 0.62
"""Width of an average letter as a share of its size, rather too much."""


def drawable(line: Line) -> tuple[list[float], list[float]]:
    """The times and values of a line that have a place on an axis."""
    times, values = line.times, line.values
    if values and isfinite(sum(times)) and isfinite(sum(values)) and -LARGEST < min(values) <= max(values) < LARGEST:
        return list(times), list(values)
    pairs = [(t, v) for t, v in zip(line.times, line.values, strict=True) if isfinite(t) and abs(v) < LARGEST]
    return [t for t, _ in pairs], [v for _, v in pairs]


UNITS_OF_TIME = ((180.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (float("inf"), "h", 3600.0))
"""The longest time shown in each unit, its name, and its seconds."""


def unit_of_time(chart: Chart) -> tuple[str, float]:
    """In which unit the time axis of a chart is labelled, and its seconds."""
    begin, end = chart.ends
    return next((name, size) for longest, name, size in UNITS_OF_TIME if end - begin <= longest)


def moment(chart: Chart, time: float) -> str:
    """A time as the axis would label it."""
    name, size = unit_of_time(chart)
    return f"{time / size:.4g} {name}"


def with_unit(title: str, unit: str) -> str:
    """An axis' label."""
    return f"{title} ({unit})" if unit else title


def plain(text: str) -> str:
    """A text on one line without control characters, which no picture can show."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in " ".join(text.split()))


def shortened(text: str, letters: int) -> str:
    """A text that is not longer than its place."""
    text = plain(text)
    return text if len(text) <= letters else text[: max(letters - 1, 0)].rstrip() + "…"


# ----------------------------------------------------------------------------------------------------------------------
# Where everything of a picture stands, in inches from the top left: charts of the same kind get the same sizes.

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
MOST_EVENTS = 12
"""Events that are explained below a chart."""
MOST_LINES = 3
"""Lines that one explanation may take."""


@frozen
class Box:
    """A rectangle from the top left, in inches."""

    left: float
    top: float
    width: float
    height: float


@frozen
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


@frozen
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


def number_marks(chart: Chart) -> list[tuple[str, Mark]]:
    """The marks in the order of time, with their numbers."""
    return [(str(i), mark) for i, mark in enumerate(sorted(chart.marks, key=lambda mark: mark.at), start=1)]


def texts_of(chart: Chart, letters: int) -> tuple[str, ...]:
    """What stands below a chart: its marks by number, and its notes."""
    return tuple(line for text in explain_marks(chart) for line in _wrapped(text, letters))


def explain_marks(chart: Chart) -> list[str]:
    """What each mark is, as far as there is room (failures always), and the notes."""
    marks = number_marks(chart)
    left_out = [number for number, mark in marks if mark.kind == "event"][MOST_EVENTS:]
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


# --- Ends and ticks of an axis, and numbers as people write them beside it --------------------------------------------

AXIS_ROOM = 0.06
"""What is left free above and below the lines, as a share of what they cover."""
LEVEL_REACH = 0.25
"""How far beyond the signals an axis reaches to show a level, as a share of what they cover."""
FLAT_SHARE = 1e-9
"""Values that differ by less than this share of their size are one value."""
STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)
"""Distances of ticks, times a power of ten."""
TICK_SLACK = 1e-9
"""What rounding may add to the ends of an axis, as a share of a step."""


def limits(panel: Panel) -> tuple[float, float]:
    """The ends of a value axis: all signals with some room, and around a flat line something to see it in.

    A level widens it only where it is near: an alarm that is far away would make a line of the signal.
    """
    values = [v for line in panel.lines if line.role != "level" for v in drawable(line)[1]] + list(panel.least or ())
    values += [v for band in panel.bands for side in (band.low, band.high) for v in side]
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high - low <= FLAT_SHARE * max(abs(low), abs(high)):
        low, high = low - 0.05 * (abs(low) or 10.0), high + 0.05 * (abs(high) or 10.0)
    near = LEVEL_REACH * (high - low)
    levels = [v for line in panel.lines if line.role == "level" for v in drawable(line)[1]]
    close = [v for v in levels if low - near <= v <= high + near]
    low, high = min([low, *close]), max([high, *close])
    room = AXIS_ROOM * (high - low)
    return low - room, high + room


def layer_of(line: Line) -> tuple[bool, bool, bool]:
    """Levels lie below all, thin lines on thick ones."""
    return line.role != "level", line.role == "setpoint", line.side == "before"


def level_names(panel: Panel) -> list[tuple[float, str]]:
    """Where the name of each level stands, the lowest first: once, at the highest end that is seen."""
    low, high = limits(panel)
    ends: dict[str, float] = {}
    for line in panel.lines:
        if line.role == "level" and line.values and low <= line.values[-1] <= high:
            ends[line.name] = max(line.values[-1], ends.get(line.name, low))
    return sorted((value, name) for name, value in ends.items())


def ticks(low: float, high: float, most: int) -> list[float]:
    """Round numbers between the ends of an axis, at most so many."""
    rough = (high - low) / most
    power = 10.0 ** floor(log10(rough))
    step = next(size * power for size in STEPS if size * power >= rough * (1 - TICK_SLACK))
    first, last = ceil(low / step - TICK_SLACK), floor(high / step + TICK_SLACK)
    return [i * step for i in range(first, last + 1)]


def tick_text(value: float) -> str:
    """A tick's number."""
    return f"{value:.10g}"


def spread(places: Sequence[float], room: float, apart: float) -> list[float]:
    """Ascending places, moved as little as needed to be apart, and within the room as far as it allows."""
    moved: list[float] = []
    for place in places:
        moved.append(max(place, moved[-1] + apart if moved else place))
    for i in range(len(moved) - 1, -1, -1):
        ceiling = room if i == len(moved) - 1 else moved[i + 1] - apart
        moved[i] = min(moved[i], ceiling)
    return moved


# --- What a chart shows, in words: for those who hear a page instead of seeing it -------------------------------------

MOST_DESCRIBED = 20
"""Bars and marks that are named, of each kind."""


def describe_charts(charts: Iterable[Chart]) -> str:
    """All charts in sentences."""
    return " ".join(_chart(chart) for chart in charts)


def _chart(chart: Chart) -> str:
    begin, end = chart.ends
    sentences = [f"{plain(chart.title)}, from {moment(chart, begin)} to {moment(chart, end)}."]
    if chart.sides:
        sentences.append(f"Before is {plain(chart.sides[0])}, after is {plain(chart.sides[1])}.")
    sentences += [] if chart.locus is None else [f"The open loop in the complex plane: {chart.locus.said}."]
    for panel in chart.panels:
        lines = "; ".join(_line(line) for line in panel.lines)
        sentences.append(f"{plain(with_unit(panel.title, panel.unit))}: {lines}.")
    for strip in chart.strips:
        bars = [f"{plain(bar.label)} from {moment(chart, bar.begin)} to {moment(chart, bar.end)}" for bar in strip.bars]
        if bars:
            sentences.append(f"{plain(strip.title)}: {_some(bars)}.")
    marks = [f"{plain(mark.label)} at {moment(chart, mark.at)}" for mark in chart.marks if mark.kind == "event"]
    failures = [f"{plain(mark.label)} at {moment(chart, mark.at)}" for mark in chart.marks if mark.kind == "failure"]
    sentences += [f"Events: {_some(marks)}."] if marks else []
    sentences += [f"Failed: {_some(failures)}."] if failures else []
    return " ".join([*sentences, *(f"{plain(note)}." for note in chart.notes)])


def _line(line: Line) -> str:
    side = f" {line.side}" if line.side else ""
    _, values = drawable(line)
    if not values:
        return f"{plain(line.name)}{side} without values"
    return f"{plain(line.name)}{side} between {min(values):.5g} and {max(values):.5g}, at the end {values[-1]:.5g}"


def _some(texts: list[str]) -> str:
    more = f" and {len(texts) - MOST_DESCRIBED} more" if len(texts) > MOST_DESCRIBED else ""
    return "; ".join(texts[:MOST_DESCRIBED]) + more


# --- The rows of bars below the panels, and the marks that go through everything --------------------------------------

CLOSE_MARKS = 0.32
"""Marks that are closer than this, in inches, share one number above the panel."""
EDGE = 0.01
"""What a bar leaves free of its row above and below, in inches."""
THINNEST = 0.012
"""Width of the shortest bar in inches: an alarm of one sample is seen."""
MARK_LINE: Look = {"color": GREY, "linewidth": 0.7, "linestyle": (0, (1, 2))}
FAILURE_LINE: Look = {"color": VERMILION, "linewidth": 1.1, "linestyle": (0, (6, 2, 1, 2))}
ABOVE_AXES: Look = {"xycoords": ("data", "axes fraction"), "ha": "center", "va": "bottom"}
"""Where the number of a mark stands."""


def label(
    axes: Axes, text: str, point: tuple[float, float], offset: tuple[float, float], gid: str, **look: Any
) -> None:
    """Small letters beside a point of the axes, ``offset`` points away from it."""
    text_look: Look = {"va": "center", "size": SIZES["small"], "color": INK, **look}
    axes.annotate(text, point, xytext=offset, textcoords="offset points", gid=gid, **text_look)


def draw_strips(axes: Axes, boxes: Sequence[Box], chart: Chart) -> None:
    """All rows in one pair of axes, which count inches downwards."""
    axes.set_ylim(boxes[-1].top + boxes[-1].height - boxes[0].top, 0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    for strip, box in zip(chart.strips, boxes, strict=True):
        _draw_strip(axes, strip, box, box.top - boxes[0].top, chart)


def _draw_strip(axes: Axes, strip: Strip, box: Box, top: float, chart: Chart) -> None:
    """One row of bars; a name stands in its bar, or beside it where it is too short and nothing follows."""
    from matplotlib.patches import Rectangle

    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    scale, middle = box.width / ((end - begin) or 1.0), top + box.height / 2
    axes.axhspan(top, top + box.height, color=FIELD, linewidth=0, zorder=0)
    title = shortened(strip.title, letters_in(box.left - 0.1, SIZES["small"]))
    at_left: Look = {"xycoords": ("axes fraction", "data"), "ha": "right"}
    label(axes, title, (0, middle), (-5, 0), gid=f"strip {strip.kind}", **at_left)
    fills = fills_of(strip)
    for i, bar in enumerate(strip.bars):
        fill, edge = fills[bar.label]
        width = max(bar.end - bar.begin, THINNEST / scale)
        corner, height = (bar.begin / size, top + EDGE), box.height - 2 * EDGE
        look: Look = {"facecolor": fill, "edgecolor": edge, "linewidth": 0.9}
        axes.add_patch(Rectangle(corner, width / size, height, gid=f"bar {strip.kind}", **look))
        following = strip.bars[i + 1].begin if i + 1 < len(strip.bars) else end
        inside, beside = ((stop - start) * scale - 0.08 for start, stop in ((bar.begin, bar.end), (bar.end, following)))
        if bar.label == strip.title:
            continue
        place = bar.begin if len(bar.label) <= letters_in(inside, SIZES["small"]) else bar.end
        if place == bar.begin or len(bar.label) <= letters_in(beside, SIZES["small"]):
            label(axes, plain(bar.label), (place / size, middle), (3, -0.5), gid=f"label {strip.kind}", color=BLACK)


def draw_marks(panels: Sequence[Axes], below: Sequence[Axes], chart: Chart, width: float) -> None:
    """A line through everything at each mark, and numbers above the first panel; ``width``: of the axes in inches."""
    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    marks = number_marks(chart)
    for _, mark in marks:
        look = FAILURE_LINE if mark.kind == "failure" else MARK_LINE
        for axes in (*panels, *below):
            axes.axvline(mark.at / size, zorder=2, gid=f"mark {mark.kind}", **look)
    numbers = [(mark.at, number, mark.kind == "failure") for number, mark in marks]
    for at, text, failed in group_numbers(numbers, CLOSE_MARKS / width * (end - begin)):
        if panels:
            look = {"color": WARNING, "weight": "bold"} if failed else {}
            label(panels[0], text, (at / size, 1.0), (0, ABOVE * 12), gid="number", **ABOVE_AXES, **look)


def group_numbers(marks: Sequence[tuple[float, str, bool]], close: float) -> list[tuple[float, str, bool]]:
    """Numbers of marks that are close together as one text: 3-5."""
    groups: list[tuple[float, str, bool]] = []
    for at, number, failed in marks:
        if groups and at - groups[-1][0] < close:
            first, text, any_failed = groups[-1]
            groups[-1] = (first, f"{text.partition('-')[0]}-{number}", any_failed or failed)
        else:
            groups.append((at, number, failed))
    return groups
