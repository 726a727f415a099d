"""Charts as shapes, lines, surfaces and texts with all their looks, and these as an SVG."""

from __future__ import annotations

import hashlib
import io
import logging
import warnings
from cmath import phase, rect
from contextlib import contextmanager
from dataclasses import replace
from html import escape
from math import pi
from typing import TYPE_CHECKING, Literal

from pidcfg.pictures.layout import (
    BEFORE_PEN,
    BLACK,
    BLUE,
    FIELD,
    GREY,
    INK,
    LETTER_SIZES,
    LETTER_WIDTH,
    LIGHT_GREY,
    MAX_TIME_TICKS,
    MAX_VALUE_TICKS,
    PENS,
    SQUARE_SIZE,
    VERMILION,
    WARNING_COLOUR,
    Pen,
    axis_limits,
    band_corners,
    bar_colours,
    describe_charts,
    group_numbers,
    layer_of,
    letter_capacity,
    level_names,
    line_points,
    number_marks,
    pen_of,
    plain_text,
    shorten,
    spread_apart,
    texts_of,
    tick_text,
    ticks,
    time_ticks,
    unit_of_time,
    with_unit,
)
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from matplotlib.figure import Figure
    from matplotlib.path import Path as Outline
    from matplotlib.transforms import Transform
    from matplotlib.typing import RcKeyType

    from pidcfg.pictures import Chart, Locus, Panel, Strip

    Point = tuple[float, float]


# --- Where everything stands, in points (72 an inch) from the top left: charts of the same kind get the same sizes ----

WIDTH, LEFT_EDGE, RIGHT_EDGE = 691.2, 111.6, 36.0
AXES_WIDTH = WIDTH - LEFT_EDGE - RIGHT_EDGE
"""Width of a picture, and of it what is left of the axes (titles and numbers) and right of them (names of lines);
and the width of the axes."""
LABEL_DISTANCE = 59.0
"""How far the title of a value axis is from it."""
TITLE_HEIGHT, KEY_HEIGHT, NUMBERS_HEIGHT, NO_NUMBERS_HEIGHT = 21.6, 15.8, 11.5, 3.6
"""Heights of a title, of the line that says what before and after are, of what is where marks have numbers, or none."""
FIRST_PANEL_HEIGHT, FURTHER_PANEL_HEIGHT, PANEL_GAP = 133.2, 75.6, 9.4
"""Heights of the first panel and of the others, and what is between two."""
LOCUS_HEIGHT, LOCUS_TITLE_HEIGHT = 237.6, 30.2
"""Heights of a curve in the complex plane and of the title of its real axis."""
STRIP_HEIGHT, STRIP_GAP = 14.4, 3.2
TIME_AXIS_HEIGHT = 33.0
"""The time axis: its numbers and its title."""
LINE_HEIGHT, CHART_GAP, MARGIN = 11.9, 18.7, 8.6
"""A line of text below a chart, what separates two charts, and the margin around all."""


@frozen
class Box:
    """A rectangle."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Where it ends from left to right."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Where it ends from top to bottom."""
        return self.top + self.height

    @property
    def corners(self) -> list[tuple[float, float]]:
        """One after the other, from the top left."""
        return [(self.left, self.top), (self.right, self.top), (self.right, self.bottom), (self.left, self.bottom)]


# --- Two kinds of shapes are all that a way of drawing has to know; places in points from the top left ----------------


@frozen
class Path:
    """Lines through points, or the surfaces within them."""

    name: str
    """What it is: its class."""
    parts: Sequence[Sequence[Point]]
    pen: Pen | None = None
    fill: str | None = None
    opacity: float = 1.0
    """Of the surface."""
    clip: Box | None = None
    """Outside of it nothing is seen."""


@frozen
class Text:
    """Letters; the point is at half their height."""

    name: str
    text: str
    point: Point
    size: float = LETTER_SIZES["small"]
    colour: str = INK
    bold: bool = False
    anchor: Literal["start", "middle", "end"] = "start"
    turned: bool = False
    """Upwards."""


@frozen
class Axes:
    """A box with the values at its ends."""

    box: Box
    x_range: tuple[float, float]
    y_range: tuple[float, float] = (0.0, 1.0)

    def x(self, value: float) -> float:
        """Where a value stands from left to right."""
        return self.box.left + self.box.width * (value - self.x_range[0]) / (self.x_range[1] - self.x_range[0])

    def y(self, value: float) -> float:
        """Where a value stands from top to bottom."""
        return self.box.top + self.box.height * (self.y_range[1] - value) / (self.y_range[1] - self.y_range[0])

    def point_of(self, z: complex) -> Point:
        """Where a point of the complex plane stands."""
        return self.x(z.real), self.y(z.imag)

    def points_of(self, places: Iterable[tuple[int, int]]) -> list[Point]:
        """Where points of the square stand that is as large as the box."""
        box, across, down = self.box, self.box.width / SQUARE_SIZE, self.box.height / SQUARE_SIZE
        return [(box.left + x * across, box.top + y * down) for x, y in places]


THIN_PEN, PALE_PEN = Pen(GREY, 0.8), Pen(LIGHT_GREY, 0.6)
TICK_LENGTH, NUMBER_DISTANCE = 3.0, 6.5
"""Length of a tick, and how far its number is from the axis."""
NUMBER_DROP, TITLE_DROP = 11.0, 22.5
"""How far below an axis its numbers and its title are."""


def picture_shapes(charts: Sequence[Chart], title: str) -> tuple[float, list[Path | Text]]:
    """The height of a picture and its shapes, those below first; the title is left out where the only chart has it."""
    heading = "" if [title] == [chart.title for chart in charts] else title
    shapes: list[Path | Text] = [_title_text("title", heading, MARGIN, LETTER_SIZES["title"] + 2)] if heading else []
    top = MARGIN + (TITLE_HEIGHT + 5.8 if heading else 0.0)
    for chart in charts:
        top = _add_chart(chart, top, shapes) + CHART_GAP
    height = top - (CHART_GAP if charts else 0.0) + MARGIN
    return height, [Path("ground", [Box(0, 0, WIDTH, height).corners], fill="#ffffff"), *shapes]


def _title_text(name: str, text: str, top: float, size: float) -> Text:
    letters = letter_capacity(WIDTH - 2 * MARGIN, size)
    return Text(name, shorten(text, letters), (MARGIN, top + TITLE_HEIGHT / 2), size, bold=True)


def _add_chart(chart: Chart, top: float, shapes: list[Path | Text]) -> float:
    """Adds the shapes of one chart, and says where it ends."""
    shapes.append(_title_text("loop", chart.title, top, LETTER_SIZES["title"]))
    top += TITLE_HEIGHT
    if chart.sides:
        shapes += _side_key(chart.sides, top + KEY_HEIGHT / 2)
        top += KEY_HEIGHT
    top += NUMBERS_HEIGHT if chart.marks else NO_NUMBERS_HEIGHT
    if chart.locus:
        shapes += locus_shapes(chart.locus, Box(LEFT_EDGE, top, AXES_WIDTH, LOCUS_HEIGHT))
        top += LOCUS_HEIGHT + LOCUS_TITLE_HEIGHT
    begin, end = chart.time_span
    first = axes = Axes(
        Box(LEFT_EDGE, top, AXES_WIDTH, FIRST_PANEL_HEIGHT), (begin, end if end > begin else begin + 1.0)
    )
    for i, panel in enumerate(chart.panels):
        axes = replace(axes, box=Box(LEFT_EDGE, top, AXES_WIDTH, FURTHER_PANEL_HEIGHT if i else FIRST_PANEL_HEIGHT))
        shapes += _panel_shapes(chart, panel, replace(axes, y_range=axis_limits(panel)))
        top = axes.box.bottom + PANEL_GAP
    if chart.strips:
        rows = [
            replace(axes, box=Box(LEFT_EDGE, top + i * (STRIP_HEIGHT + STRIP_GAP), AXES_WIDTH, STRIP_HEIGHT))
            for i in range(len(chart.strips))
        ]
        shapes += _strip_shapes(chart, list(zip(chart.strips, rows, strict=True)))
        axes = rows[-1]
    shapes += [*_time_axis(chart, axes), *_mark_numbers(chart, first)]
    top = axes.box.bottom + TIME_AXIS_HEIGHT
    failed = {number for number, mark in number_marks(chart) if mark.kind == "failure"}
    for text in texts_of(chart, letter_capacity(WIDTH - 2 * MARGIN, LETTER_SIZES["small"])):
        colour = WARNING_COLOUR if text.split(" ", 1)[0] in failed or text.startswith("failed") else INK
        shapes.append(Text("note", text, (MARGIN, top + LINE_HEIGHT / 2), colour=colour))
        top += LINE_HEIGHT
    return top


def _side_key(sides: tuple[str, str], top: float) -> Iterator[Path | Text]:
    """What before and after are, beside a piece of their lines."""
    width = (WIDTH - 2 * MARGIN) / 2
    pens = BEFORE_PEN, PENS["pv", "after"]
    for left, side, name, pen in zip((MARGIN, MARGIN + width), ("before", "after"), sides, pens, strict=True):
        yield Path(f"key {side}", [[(left, top), (left + 25, top)]], pen)
        text = shorten(f"{side}: {name}", letter_capacity(width - 36, LETTER_SIZES["small"]))
        yield Text(f"side {side}", text, (left + 30, top))


# --- Axes and marks ---------------------------------------------------------------------------------------------------


def _horizontal_axis(axes: Axes, values: Sequence[float], grid: Pen | None = None) -> Iterator[Path]:
    """A horizontal axis with its ticks, and the lines of the grid above them."""
    box, xs = axes.box, [axes.x(tick) for tick in values]
    if grid:
        yield Path("grid", [[(x, box.top), (x, box.bottom)] for x in xs], grid)
    yield Path("axis", [box.corners[:1:-1], *([(x, box.bottom), (x, box.bottom + TICK_LENGTH)] for x in xs)], THIN_PEN)


def _vertical_axis(axes: Axes, values: Sequence[float], title: str, grid: Pen | None = None) -> Iterator[Path | Text]:
    """A vertical axis with its ticks, their numbers and a title."""
    box, ys = axes.box, [axes.y(tick) for tick in values]
    if grid:
        yield Path("grid", [[(box.left, y), (box.right, y)] for y in ys], grid)
    yield Path("axis", [box.corners[::3], *([(box.left - TICK_LENGTH, y), (box.left, y)] for y in ys)], THIN_PEN)
    for tick, y in zip(values, ys, strict=True):
        yield Text("tick", tick_text(tick), (box.left - NUMBER_DISTANCE, y), anchor="end")
    size, middle = LETTER_SIZES["label"], box.top + box.height / 2
    text = shorten(title, letter_capacity(box.height, size))
    yield Text("axis value", text, (box.left - LABEL_DISTANCE, middle), size, anchor="middle", turned=True)


def _axis_labels(axes: Axes, name: str, title: str, ticks: Iterable[tuple[float, float]]) -> Iterator[Text]:
    """The numbers below a horizontal axis, by their places, and its title."""
    box = axes.box
    for place, tick in ticks:
        yield Text("tick", tick_text(tick), (axes.x(place), box.bottom + NUMBER_DROP), anchor="middle")
    point = box.left + box.width / 2, box.bottom + TITLE_DROP
    yield Text(name, title, point, LETTER_SIZES["label"], anchor="middle")


def _time_axis(chart: Chart, axes: Axes) -> Iterator[Path | Text]:
    """The time axis below everything."""
    unit, size = unit_of_time(chart)
    if chart.strips:
        yield from _horizontal_axis(axes, [tick * size for tick in time_ticks(chart)])
    yield from _axis_labels(
        axes, "axis time", with_unit("time", unit), ((tick * size, tick) for tick in time_ticks(chart))
    )


MARK_LINE, FAILURE_LINE = Pen(GREY, 0.7, (0.7, 1.4)), Pen(VERMILION, 1.1, (6.6, 2.2, 1.1, 2.2))
CLOSE_MARKS_DISTANCE = 23.0
"""Marks that are closer than this share one number above the panel."""


def _mark_lines(chart: Chart, axes: Axes) -> Iterator[Path]:
    """A line at each event and failure, through one panel or row."""
    box = axes.box
    for _, mark in number_marks(chart):
        x, pen = axes.x(mark.time), FAILURE_LINE if mark.kind == "failure" else MARK_LINE
        yield Path(f"mark {mark.kind}", [[(x, box.top), (x, box.bottom)]], pen, clip=box)


def _mark_numbers(chart: Chart, axes: Axes) -> Iterator[Text]:
    """The numbers of the marks, above the first panel."""
    marks = [(axes.x(mark.time), number, mark.kind == "failure") for number, mark in number_marks(chart)]
    for x, text, failed in group_numbers(marks, CLOSE_MARKS_DISTANCE):
        point, colour = (x, axes.box.top - NUMBERS_HEIGHT / 2), WARNING_COLOUR if failed else INK
        yield Text("number", text, point, colour=colour, bold=failed, anchor="middle")


# --- Panels and strips ------------------------------------------------------------------------------------------------

BAND_OPACITY = 0.18
"""How dense a band is; where two lie over each other they are denser."""
DOT_RADIUS = 2.5
"""Radius of a point."""
NAME_DISTANCE = 10.0
"""Points between the names of two lines."""


def _panel_shapes(chart: Chart, panel: Panel, axes: Axes) -> Iterator[Path | Text]:
    """All lines of a panel, with their names on the right."""
    box, (low, high), (_, size) = axes.box, axes.y_range, unit_of_time(chart)
    yield from _horizontal_axis(axes, [tick * size for tick in time_ticks(chart)], PALE_PEN)
    yield from _vertical_axis(axes, ticks(low, high, MAX_VALUE_TICKS), with_unit(panel.title, panel.unit), PALE_PEN)
    for band in panel.bands:
        fill, corners = PENS[band.role, None].colour, axes.points_of(band_corners(chart, band, low, high))
        yield Path("band", [corners], fill=fill, opacity=BAND_OPACITY, clip=box)
    yield from _mark_lines(chart, axes)
    names: dict[str, tuple[float, str]] = {}
    for line in sorted(panel.lines, key=layer_of):
        places = axes.points_of(line_points(chart, line, low, high))
        if not places:
            continue
        pen, name = pen_of(line, overlaid=chart.sides is not None), f"line {line.role} {line.side or 'only'}"
        is_point = len(places) == 1
        yield Path(name, [_dot_outline(*places)], fill=pen.colour) if is_point else Path(name, [places], pen, clip=box)
        if line.role != "level":
            names.setdefault(line.name, (places[-1][1], pen.colour))
    letters = letter_capacity(RIGHT_EDGE - 4, LETTER_SIZES["small"])
    ends = sorted((box.bottom - y, name, colour) for name, (y, colour) in names.items())
    for height, (_, name, colour) in zip(
        spread_apart([up for up, *_ in ends], box.height, NAME_DISTANCE), ends, strict=True
    ):
        yield Text("name", shorten(name, letters), (box.right + 4, box.bottom - height), colour=colour, bold=True)
    levels = level_names(panel)
    heights = spread_apart([box.bottom - axes.y(value) for value, _ in levels], box.height, NAME_DISTANCE)
    for height, (_, name) in zip(heights, levels, strict=True):
        colour = PENS["level", None].colour
        yield Text("level", plain_text(name), (box.right - 3, box.bottom - height - 5), colour=colour, anchor="end")


def _dot_outline(centre: Point) -> list[Point]:
    return [(z.real, z.imag) for z in _arc(complex(*centre), DOT_RADIUS, 0, 2 * pi)]


def _arc(centre: complex, radius: float, begin: float, end: float) -> list[complex]:
    """A part of a circle, angles in radians."""
    return [centre + rect(radius, begin + (end - begin) * i / CIRCLE_POINTS) for i in range(CIRCLE_POINTS + 1)]


BAR_INSET, BAR_EDGE = 0.7, 0.9
"""What a bar leaves free of its row above and below, and how thick its edge is."""
MIN_BAR_WIDTH = 0.9
"""Width of the shortest bar: an alarm of one sample is seen."""


def _strip_shapes(chart: Chart, rows: Sequence[tuple[Strip, Axes]]) -> Iterator[Path | Text]:
    """Rows of bars, with the marks through all of them."""
    for strip, axes in rows:
        yield from _bar_shapes(strip, axes)
    first, last = rows[0][1], rows[-1][1].box
    yield from _mark_lines(
        chart, replace(first, box=replace(last, top=first.box.top, height=last.bottom - first.box.top))
    )
    for strip, axes in rows:
        yield from _bar_names(strip, axes)


def _bar_shapes(strip: Strip, axes: Axes) -> Iterator[Path]:
    box, fills = axes.box, bar_colours(strip)
    yield Path("row", [box.corners], fill=FIELD)
    for bar in strip.bars:
        fill, edge = fills[bar.label]
        width = max(axes.x(bar.end) - axes.x(bar.begin), MIN_BAR_WIDTH)
        place = Box(axes.x(bar.begin), box.top + BAR_INSET, width, box.height - 2 * BAR_INSET)
        yield Path(f"bar {strip.kind}", [place.corners], Pen(edge, BAR_EDGE), fill, clip=box)


def _bar_names(strip: Strip, axes: Axes) -> Iterator[Text]:
    """A name stands in its bar, or beside it where it is too short and nothing follows; nowhere if the row says it."""
    box, middle, small = axes.box, axes.box.top + axes.box.height / 2, LETTER_SIZES["small"]
    title = shorten(strip.title, letter_capacity(box.left - 7, small))
    yield Text(f"strip {strip.kind}", title, (box.left - 5, middle), anchor="end")
    begins = [axes.x(bar.begin) for bar in strip.bars] + [box.right]
    for bar, begin, following in zip(strip.bars, begins, begins[1:], strict=False):
        end = axes.x(bar.end)
        rooms = (begin, end), (end, following)
        starts = [x for x, stop in rooms if len(bar.label) <= letter_capacity(stop - x - 6, small)]
        if starts and bar.label != strip.title:
            yield Text(f"label {strip.kind}", plain_text(bar.label), (starts[0] + 3, middle), colour=BLACK)


# --- The open loop in the complex plane: the curve, the circle that Ms keeps it out of, and both margins --------------

LOCUS_BOTTOM, LOCUS_TOP, LOCUS_MIDDLE = -1.8, 1.2, -0.45
"""Ends of the imaginary axis, and the middle of the real one: the unit circle and what is below it."""
CIRCLE_POINTS = 180
"""Points of a circle."""
GROUND_OPACITY = 0.8
"""Of what is between a text and the lines below it."""


def locus_shapes(locus: Locus, box: Box) -> Iterator[Path | Text]:
    """The curve with its margins; both axes have one scale."""
    half = (LOCUS_TOP - LOCUS_BOTTOM) * box.width / box.height / 2
    axes = Axes(box, (LOCUS_MIDDLE - half, LOCUS_MIDDLE + half), (LOCUS_BOTTOM, LOCUS_TOP))

    def line(name: str, values: Iterable[complex], pen: Pen) -> Path:
        return Path(name, [[axes.point_of(z) for z in values]], pen, clip=box)

    yield line("grid", (complex(axes.x_range[0], 0), complex(axes.x_range[1], 0)), PALE_PEN)
    yield line("grid", (complex(0, LOCUS_BOTTOM), complex(0, LOCUS_TOP)), PALE_PEN)
    yield line("line circle unit", _arc(0j, 1.0, 0.0, 2 * pi), Pen(GREY, 0.9, (3.6, 2.7)))
    yield line("line circle ms", _arc(-1 + 0j, 1 / locus.ms, 0.0, 2 * pi), Pen(WARNING_COLOUR, 1.3))
    if locus.gain_crossover is not None:
        yield line("line radius", (0j, locus.gain_crossover), Pen(GREY, 0.9))
        angle = phase(locus.gain_crossover)
        yield line("line angle", _arc(0j, 0.45, -pi if angle < 0 else pi, angle), Pen(INK, 1.1))
    yield line("line locus only", locus.points, Pen(BLUE, 1.9))
    x, y = axes.point_of(-1 + 0j)
    yield Path("mark critical", [[(x - 4.5, y), (x + 4.5, y)], [(x, y - 4.5), (x, y + 4.5)]], Pen(WARNING_COLOUR, 1.8))
    yield from _label_shapes("-1", axes.point_of(-1 + 0j), (4, 11), WARNING_COLOUR)
    corner = axes.point_of(complex(-1 - 0.75 / locus.ms, 0.75 / locus.ms))
    yield from _label_shapes(f"Ms {locus.ms:.3g}", corner, (-4, -4), WARNING_COLOUR, "end")
    if locus.phase_crossover is not None:
        yield from _margin_mark(f"gain margin {locus.gain_margin:.3g}", axes.point_of(locus.phase_crossover), (6, -8))
    if locus.gain_crossover is not None:
        text, below = f"phase margin {locus.phase_margin:.3g}°", locus.gain_crossover.imag < 0
        yield from _margin_mark(text, axes.point_of(locus.gain_crossover), (8, 10 if below else -4))
    values = ticks(*axes.x_range, MAX_TIME_TICKS)
    yield from _horizontal_axis(axes, values)
    yield from _axis_labels(axes, "axis real", "real part of the open loop", zip(values, values, strict=True))
    yield from _vertical_axis(axes, ticks(*axes.y_range, MAX_VALUE_TICKS + 1), "imaginary part")


def locus_svg(locus: Locus, id_prefix: str) -> str:
    """The curve as a part of a page, in the colours of paper."""
    inner = svg_elements(locus_shapes(locus, Box(LEFT_EDGE, MARGIN, AXES_WIDTH, LOCUS_HEIGHT)), id_prefix)
    view = svg_view(WIDTH, MARGIN + LOCUS_HEIGHT + LOCUS_TITLE_HEIGHT)
    return f'<svg class="locus" {view} aria-hidden="true">\n{inner}</svg>\n'


def _margin_mark(text: str, point: Point, offset: Point) -> Iterator[Path | Text]:
    """A point at which a margin is measured, with its value."""
    yield Path("mark margin", [_dot_outline(point)], fill=INK)
    yield from _label_shapes(text, point, offset, INK)


def _label_shapes(
    text: str, point: Point, offset: Point, colour: str, anchor: Literal["start", "end"] = "start"
) -> Iterator[Path | Text]:
    """A text beside a point, on a ground of its own where lines pass below it."""
    size, (x, y) = LETTER_SIZES["small"], (point[0] + offset[0], point[1] + offset[1])
    width = len(text) * size * LETTER_WIDTH
    ground = Box(x - (width if anchor == "end" else 0), y - 0.6 * size, width, 1.2 * size)
    yield Path("paper", [ground.corners], fill="#ffffff", opacity=GROUND_OPACITY)
    yield Text("name", text, (x, y), colour=colour, bold=True, anchor=anchor)


# --- The shapes as an SVG ---------------------------------------------------------------------------------------------

FONTS = "'DejaVu Sans', Verdana, 'Segoe UI', Arial, sans-serif"
"""The font that the places are made for, and wide ones that most systems have."""


BASELINE_DROP = 0.36
"""From half the height of a letter down to the line that it stands on, as a share of its size."""


def draw_svg(charts: Sequence[Chart], *, title: str) -> str:
    """All charts below each other as one SVG, without an XML declaration: a file, or a part of a page.

    Its identifiers are its own, so that a page can hold several.
    """
    (height, shapes), text = picture_shapes(charts, title), describe_charts(charts)
    prefix = id_prefix_of(f"{title}\0{text}")
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{_coordinate(WIDTH)}pt" height="{_coordinate(height)}pt" '
        f'role="img" aria-labelledby="{prefix}-title {prefix}-desc" class="pidcfg-chart" {svg_view(WIDTH, height)}>\n'
        f'<title id="{prefix}-title">{escape(plain_text(title))}</title>\n'
        f'<desc id="{prefix}-desc">{escape(text)}</desc>\n'
        f"{svg_elements(shapes, prefix)}</svg>\n"
    )


def id_prefix_of(text: str) -> str:
    """What identifiers begin with that no other drawing has."""
    return "p" + hashlib.sha256(text.encode()).hexdigest()[:8]


def svg_view(width: float, height: float) -> str:
    """What `svg_elements` need around them."""
    box = f"0 0 {_coordinate(width)} {_coordinate(height)}"
    return f'viewBox="{box}" font-family="{FONTS}" fill="none" stroke-linejoin="round"'


def svg_elements(shapes: Iterable[Path | Text], id_prefix: str) -> str:
    """Shapes as the elements of an SVG; ``id_prefix``: what its identifiers begin with."""
    clips: dict[Box, str] = {}
    parts = []
    for shape in shapes:
        clip = "" if isinstance(shape, Text) or shape.clip is None else _clip_attribute(shape.clip, clips, id_prefix)
        parts.append(_text_element(shape) if isinstance(shape, Text) else _path_element(shape, clip))
    boxes = "".join(
        f'<clipPath id="{name}"><path d="{_line_data(box.corners)}"/></clipPath>' for box, name in clips.items()
    )
    return f"<defs>{boxes}</defs>\n{''.join(parts)}"


def _clip_attribute(box: Box, clips: dict[Box, str], id_prefix: str) -> str:
    return f' clip-path="url(#{clips.setdefault(box, f"{id_prefix}-{len(clips)}")})"'


def _coordinate(number: float) -> str:
    """A place: a hundredth of a point is finer than any print."""
    return f"{round(number, 2):.12g}"


def _line_data(places: Sequence[Point]) -> str:
    return "M" + " ".join([f"{_coordinate(x)},{_coordinate(y)}" for x, y in places])


def _path_element(shape: Path, clip: str) -> str:
    attributes = ""
    if shape.fill:
        attributes += f' fill="{shape.fill}"' + (f' fill-opacity="{shape.opacity}"' if shape.opacity < 1 else "")
    if shape.pen:
        attributes += f' stroke="{shape.pen.colour}" stroke-width="{shape.pen.width}"'
        dashes = " ".join(map(_coordinate, shape.pen.dashes))
        attributes += f' stroke-dasharray="{dashes}"' if dashes else ""
    end = "Z" if shape.fill else ""
    data = "".join(_line_data(part) + end for part in shape.parts)
    return f'<path class="{shape.name}"{attributes}{clip} d="{data}"/>\n'


def _text_element(shape: Text) -> str:
    x, y = map(_coordinate, shape.point)
    attributes = ' font-weight="bold"' if shape.bold else ""
    attributes += "" if shape.anchor == "start" else f' text-anchor="{shape.anchor}"'
    attributes += f' transform="rotate(-90 {x} {y})"' if shape.turned else ""
    return (
        f'<text class="{shape.name}" x="{x}" y="{_coordinate(shape.point[1] + BASELINE_DROP * shape.size)}" '
        f'font-size="{shape.size:g}" fill="{shape.colour}"{attributes}>{escape(shape.text)}</text>\n'
    )


# --- The same as PNG --------------------------------------------------------------------------------------------------

DRAWING_SETTINGS: dict[RcKeyType, object] = {"font.family": ["DejaVu Sans"], "text.parse_math": False}
"""What differs from matplotlib's defaults; a user's own matplotlibrc has no say."""
POINTS_PER_INCH, PIXELS_PER_INCH = 72, 144
"""Of a picture and of a PNG, in an inch: 1382 pixels across."""
MAX_SNAPPED_CORNERS = 4
"""Most corners of what stands on whole pixels: axes, grids and bars, no signals."""
ANCHORS: dict[str, Literal["left", "center", "right"]] = {"start": "left", "middle": "center", "end": "right"}
"""By the library's names."""


def draw_png(charts: Sequence[Chart], *, title: str) -> bytes:
    """All charts below each other as one PNG, drawn without global state or a display."""
    with _matplotlib_defaults():
        from matplotlib.figure import Figure
        from matplotlib.transforms import Affine2D

        (height, shapes), sink = picture_shapes(charts, title), io.BytesIO()
        figure = Figure(figsize=(WIDTH / POINTS_PER_INCH, height / POINTS_PER_INCH), dpi=PIXELS_PER_INCH)
        places = (
            Affine2D()
            .translate(0, -height)
            .scale(PIXELS_PER_INCH / POINTS_PER_INCH, -PIXELS_PER_INCH / POINTS_PER_INCH)
        )
        for shape in shapes:
            if isinstance(shape, Text):
                _write_text(figure, places, shape)
            else:
                _paint_path(figure, places, shape)
        metadata = {"Software": None, "Description": describe_charts(charts)}
        figure.savefig(sink, format="png", metadata=metadata)
    return sink.getvalue()


@contextmanager
def _matplotlib_defaults() -> Iterator[None]:
    """The library with its defaults and `DRAWING_SETTINGS`, silent about letters that its font lacks."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mpl.rcdefaults()
        mpl.rcParams.update(DRAWING_SETTINGS)
        yield


def _write_text(figure: Figure, places: Transform, text: Text) -> None:
    (x, y), lower = text.point, BASELINE_DROP * text.size
    figure.text(
        x + lower * text.turned,
        y + lower * (not text.turned),
        text.text,
        size=text.size,
        color=text.colour,
        weight="bold" if text.bold else "normal",
        ha=ANCHORS[text.anchor],
        rotation=90 * text.turned,
        rotation_mode="anchor",
        transform=places,
    )


def _paint_path(figure: Figure, places: Transform, shape: Path) -> None:
    from matplotlib.patches import PathPatch

    patch = PathPatch(_outline(shape.parts, closed=bool(shape.fill)), facecolor="none", linewidth=0, joinstyle="round")
    figure.add_artist(patch)
    patch.set_transform(places)
    if shape.fill:
        patch.set_facecolor((shape.fill, shape.opacity))
    if shape.pen:
        dashes = tuple(dash / shape.pen.width for dash in shape.pen.dashes)
        patch.set(edgecolor=shape.pen.colour, linewidth=shape.pen.width, linestyle=(0, dashes) if dashes else "-")
    if shape.clip:
        patch.set_clip_path(_outline([shape.clip.corners], closed=True), places)
    patch.set_snap(len(shape.parts[0]) <= MAX_SNAPPED_CORNERS)


def _outline(parts: Sequence[Sequence[Point]], *, closed: bool) -> Outline:
    from matplotlib.path import Path as Outline

    return Outline.make_compound_path(
        *(Outline([*part, part[0]] if closed else [*part], closed=closed) for part in parts)
    )
