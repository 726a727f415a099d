"""Charts as SVG and PNG by matplotlib: panels, the open loop in the complex plane, and what makes an SVG readable."""

from __future__ import annotations

import hashlib
import io
import logging
import re
import warnings
from cmath import phase
from contextlib import contextmanager
from dataclasses import replace
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

from pidcfg.pictures.chart import Line
from pidcfg.pictures.layout import (
    BEFORE,
    BLUE,
    GREY,
    HELD_ROLES,
    INK,
    KEY,
    LABEL,
    LINE,
    MARGIN,
    PALE,
    PENS,
    POINTS,
    RIGHT,
    SIZES,
    TITLE,
    WARNING,
    describe_charts,
    draw_marks,
    draw_strips,
    drawable,
    label,
    layer_of,
    letters_in,
    level_names,
    limits,
    number_marks,
    pen_of,
    plain,
    sheet,
    shortened,
    spread,
    stroke,
    tick_text,
    unit_of_time,
    with_unit,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

    from pidcfg.pictures.chart import Chart, Locus, Panel
    from pidcfg.pictures.layout import Box, Place, Sheet

# ----------------------------------------------------------------------------------------------------------------------
# What is done to an SVG once it is drawn: identifiers of its own, classes, words for screen readers, common fonts.

SVG, XLINK = "http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"
FONTS = "'DejaVu Sans', Verdana, 'Segoe UI', Arial, sans-serif"
"""The font that the places are made for, and wide ones that most systems have."""
REFERENCE = re.compile(r"url\(#([^)]*)\)")
CLASSES = {
    "title",
    "loop",
    "note",
    "key",
    "side",
    "axis",
    "line",
    "name",
    "strip",
    "bar",
    "label",
    "mark",
    "number",
    "level",
    "band",
}
"""First words of what `figure` calls the parts; they become classes."""


def clean_drawing(text: str, title: str, description: str) -> str:
    """The drawing as it is handed out: without metadata, and with no identifier that another drawing could have."""
    root = ET.fromstring(text)  # noqa: S314 - the drawing was made here
    salt = hashlib.sha256(f"{title}\0{text}".encode()).hexdigest()[:8]
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in {f"{{{SVG}}}metadata", f"{{{SVG}}}style"}:
                parent.remove(child)
    used = _references(root)
    for element in root.iter():
        _name_element(element, f"p{salt}-", used)
    root.attrib |= {
        "role": "img",
        "aria-labelledby": f"p{salt}-title p{salt}-desc",
        "class": "pidcfg-chart",
        "style": "stroke-linejoin: round",
    }
    for place, (tag, words) in enumerate((("title", plain(title)), ("desc", description))):
        element = ET.Element(f"{{{SVG}}}{tag}", {"id": f"p{salt}-{tag}"})
        element.text = words
        root.insert(place, element)
    ET.register_namespace("", SVG)
    ET.register_namespace("xlink", XLINK)
    return ET.tostring(root, encoding="unicode") + "\n"


def _references(root: ET.Element) -> set[str]:
    """Identifiers that something refers to."""
    names: set[str] = set()
    for element in root.iter():
        for key, value in element.attrib.items():
            names |= set(REFERENCE.findall(value))
            if key in {"href", f"{{{XLINK}}}href"} and value.startswith("#"):
                names.add(value[1:])
    return names


def _name_element(element: ET.Element, prefix: str, used: set[str]) -> None:
    """Identifiers that are needed get the prefix, names of parts become classes, the rest goes."""
    name = element.attrib.pop("id", None)
    if name is not None and name in used:
        element.set("id", prefix + name)
    elif name is not None and name.split(" ")[0] in CLASSES:
        element.set("class", name)
    for key, value in list(element.attrib.items()):
        if key in {"href", f"{{{XLINK}}}href"} and value.startswith("#"):
            element.set(key, f"#{prefix}{value[1:]}")
        else:
            element.set(key, REFERENCE.sub(rf"url(#{prefix}\1)", value).replace("'DejaVu Sans'", FONTS))


# --- The open loop in the complex plane: the curve, the circle that Ms keeps it out of, and both margins --------------

LOCUS_BOTTOM, LOCUS_TOP, LOCUS_MIDDLE = -1.8, 1.2, -0.45
"""Ends of the imaginary axis, and the middle of the real one: the unit circle and what is below it."""
CIRCLE_POINTS = 180
"""Points of a circle."""


def draw_locus(axes: Axes, locus: Locus, box: Box) -> None:
    """Draws the curve with its margins; both axes have one scale."""
    half = (LOCUS_TOP - LOCUS_BOTTOM) * box.width / box.height / 2
    axes.set_xlim(LOCUS_MIDDLE - half, LOCUS_MIDDLE + half)
    axes.set_ylim(LOCUS_BOTTOM, LOCUS_TOP)
    axes.axhline(0, color=PALE, linewidth=0.8, zorder=1)
    axes.axvline(0, color=PALE, linewidth=0.8, zorder=1)
    _arc(axes, 0j, 1.0, 0.0, 2 * pi, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), gid="line circle unit")
    _arc(axes, -1 + 0j, 1 / locus.ms, 0.0, 2 * pi, color=WARNING, linewidth=1.3, gid="line circle ms")
    axes.plot(
        [z.real for z in locus.points], [z.imag for z in locus.points], color=BLUE, linewidth=1.9, gid="line locus only"
    )
    axes.plot([-1], [0], marker="+", markersize=9, color=WARNING, markeredgewidth=1.8, gid="mark critical")
    _label(axes, "-1", -1 + 0j, (4, -11), WARNING)
    _label(axes, f"Ms {locus.ms:.3g}", complex(-1 - 0.75 / locus.ms, 0.75 / locus.ms), (-4, 4), WARNING, ha="right")
    if locus.turn is not None:
        _dot(axes, locus.turn)
        _label(axes, f"gain margin {locus.gain_margin:.3g}", locus.turn, (6, 8), INK)
    if locus.crossover is not None:
        _dot(axes, locus.crossover)
        ends = [0.0, locus.crossover.real], [0.0, locus.crossover.imag]
        axes.plot(*ends, color=GREY, linewidth=0.9, gid="line radius")
        angle = phase(locus.crossover)
        _arc(axes, 0j, 0.45, -pi if angle < 0 else pi, angle, color=INK, linewidth=1.1, gid="line angle")
        at = (8, -10) if angle < 0 else (8, 4)
        _label(axes, f"phase margin {locus.phase_margin:.3g}°", locus.crossover, at, INK)
    axes.set_xlabel("real part of the open loop", size=SIZES["label"], color=INK, labelpad=2, gid="axis real")
    axes.set_ylabel("imaginary part", size=SIZES["label"], color=INK, gid="axis imaginary")
    axes.yaxis.set_label_coords(-LABEL / box.width, 0.5)


def _arc(axes: Axes, centre: complex, radius: float, begin: float, end: float, **look: Any) -> None:
    """A part of a circle, angles in radians."""
    angles = [begin + (end - begin) * i / CIRCLE_POINTS for i in range(CIRCLE_POINTS + 1)]
    points = [(centre.real + radius * cos(a), centre.imag + radius * sin(a)) for a in angles]
    axes.plot([x for x, _ in points], [y for _, y in points], zorder=2, **look)


def _dot(axes: Axes, point: complex) -> None:
    axes.plot([point.real], [point.imag], marker="o", markersize=5, color=INK, zorder=5, gid="mark margin")


def _label(axes: Axes, text: str, point: complex, offset: tuple[float, float], colour: str, ha: str = "left") -> None:
    """A text at a point, on a ground of its own where lines pass below it."""
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
    look = {"color": colour, "weight": "bold", "ha": ha, "bbox": ground, "zorder": 6}
    label(axes, text, (point.real, point.imag), offset, gid="name", **look)


# --- A sheet of charts as a matplotlib figure: panels, strips, marks and names of lines -------------------------------

BAND_OPACITY = 0.18
"""How dense a band is; where two lie over each other they are denser."""
NAME_DISTANCE = 10.0
"""Points between the names of two lines."""


def figure_of(charts: Sequence[Chart], title: str) -> Figure:
    """The figure of a picture."""
    from matplotlib.figure import Figure

    plan = sheet(charts, title)
    figure = Figure(figsize=(plan.width, plan.height))
    if plan.title:
        size = SIZES["title"] + 2
        text = shortened(plan.title, letters_in(plan.width - 2 * MARGIN, size))
        _text(figure, plan, MARGIN, MARGIN + TITLE / 2, text, size=size, weight="bold", gid="title")
    for place in plan.places:
        _draw(figure, plan, place)
    return figure


def _text(figure: Figure, plan: Sheet, left: float, top: float, text: str, **style: Any) -> None:
    """A text beside the axes, its middle at ``top``."""
    whole: dict[str, Any] = {"color": INK, "va": "center", "size": SIZES["small"], **style}
    figure.text(left / plan.width, 1 - top / plan.height, text, **whole)


def _axes(figure: Figure, plan: Sheet, box: Box, chart: Chart) -> Axes:
    """Empty axes over the chart's time, in the unit of its axis."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axes = _plane(figure, plan, box)
    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    axes.set_xlim(begin / size, (end if end > begin else begin + 1.0) / size)
    axes.tick_params(axis="x", labelbottom=False)
    axes.xaxis.set_major_locator(MaxNLocator(8 if plan.width > 6 else 5, steps=[1, 2, 3, 5, 6, 10]))
    axes.xaxis.set_major_formatter(FuncFormatter(_number))
    return axes


def _plane(figure: Figure, plan: Sheet, box: Box) -> Axes:
    """Empty axes."""
    bottom = 1 - (box.top + box.height) / plan.height
    axes = figure.add_axes((box.left / plan.width, bottom, box.width / plan.width, box.height / plan.height))
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("bottom", "left"):
        axes.spines[side].set(color=GREY, linewidth=0.8)
    axes.tick_params(labelsize=SIZES["small"], color=GREY, labelcolor=INK, length=3, width=0.8)
    return axes


def _draw(figure: Figure, plan: Sheet, place: Place) -> None:
    chart = place.chart
    size = SIZES["title"]
    title = shortened(chart.title, letters_in(plan.width - 2 * MARGIN, size))
    _text(figure, plan, MARGIN, place.top + TITLE / 2, title, size=size, weight="bold", gid="loop")
    if place.key is not None:
        _draw_key(figure, plan, place)
    if chart.locus is not None and place.locus is not None:
        draw_locus(_plane(figure, plan, place.locus), chart.locus, place.locus)
    panels = [_axes(figure, plan, box, chart) for box in place.panels]
    for target, panel, box in zip(panels, chart.panels, place.panels, strict=True):
        _draw_panel(target, panel, box, chart)
    below = []
    if place.strips:
        first, last = place.strips[0], place.strips[-1]
        box = replace(first, height=last.top + last.height - first.top)
        below.append(_axes(figure, plan, box, chart))
        draw_strips(below[0], place.strips, chart)
    for axes in (*panels, *below)[-1:]:
        _label_time(axes, chart)
    draw_marks(panels, below, chart, plan.width - plan.left - RIGHT)
    failed = {number for number, mark in number_marks(chart) if mark.kind == "failure"}
    for i, text in enumerate(place.texts):
        colour = WARNING if text.split(" ", 1)[0] in failed or text.startswith("failed") else INK
        _text(figure, plan, MARGIN, place.text_top + LINE * (i + 0.5), text, color=colour, gid="note")


def _draw_key(figure: Figure, plan: Sheet, place: Place) -> None:
    """What before and after are, beside a piece of their lines."""
    from matplotlib.lines import Line2D

    wide = (plan.width - 2 * MARGIN) / 2
    for i, (side, name) in enumerate(zip(("before", "after"), place.chart.sides or (), strict=True)):
        left, top = MARGIN + i * wide, (place.key or 0.0) + KEY / 2
        pen = BEFORE if side == "before" else PENS["pv", "after"]
        ends, height = [left / plan.width, (left + 0.35) / plan.width], 1 - top / plan.height
        figure.add_artist(Line2D(ends, [height, height], gid=f"key {side}", **stroke(pen)))
        text = shortened(f"{side}: {name}", letters_in(wide - 0.5, SIZES["small"]))
        _text(figure, plan, left + 0.42, top, text, gid=f"side {side}")


def _label_time(axes: Axes, chart: Chart) -> None:
    name, _ = unit_of_time(chart)
    axes.spines["bottom"].set_visible(True)
    axes.tick_params(axis="x", labelbottom=True, bottom=True)
    axes.set_xlabel(with_unit("time", name), size=SIZES["label"], color=INK, labelpad=2, gid="axis time")


def _number(value: float, _place: int | None = None) -> str:
    return tick_text(value)


# --- panels ----------------------------------------------------------------------------------------------------------


def _draw_panel(axes: Axes, panel: Panel, box: Box, chart: Chart) -> None:
    """All lines of a panel, with their names on the right."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    _, size = unit_of_time(chart)
    axes.grid(visible=True, color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_ylim(*limits(panel))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10], min_n_ticks=2))
    axes.yaxis.set_major_formatter(FuncFormatter(_number))
    title = shortened(with_unit(panel.title, panel.unit), letters_in(box.height, SIZES["label"]))
    axes.set_ylabel(title, size=SIZES["label"], color=INK, gid="axis value")
    axes.yaxis.set_label_coords(-LABEL / box.width, 0.5)
    for band in panel.bands:
        colour = pen_of(Line("", band.role, (), ()), overlaid=False).colour
        times = [t / size for t in band.times]
        look: dict[str, Any] = {"color": colour, "alpha": BAND_OPACITY, "linewidth": 0, "gid": "band"}
        axes.fill_between(times, band.low, band.high, step="post" if band.role in HELD_ROLES else None, **look)
    names: dict[str, tuple[float, str]] = {}
    for layer, line in enumerate(sorted(panel.lines, key=layer_of), start=3):
        times, values = drawable(line)
        if not times:
            continue
        pen = pen_of(line, overlaid=chart.sides is not None)
        axes.plot(
            [t / size for t in times],
            values,
            **stroke(pen),
            drawstyle="steps-post" if line.role in HELD_ROLES else "default",
            gid=f"line {line.role} {line.side or 'only'}",
            marker="o" if len(times) == 1 else "",
            markersize=4,
            zorder=layer,
        )
        if line.role != "level":
            names.setdefault(line.name, (values[-1], pen.colour))
    _name_lines(axes, names, box.height * POINTS)
    _name_levels(axes, panel, box.height * POINTS)


def _name_lines(axes: Axes, names: dict[str, tuple[float, str]], points: float) -> None:
    """The names of the lines at their right ends, pushed apart where they would cover each other."""
    low, high = axes.get_ylim()
    names_at = sorted(((value - low) / (high - low) * points, name, colour) for name, (value, colour) in names.items())
    letters = letters_in(RIGHT - 0.06, SIZES["small"])
    for at, (_, name, colour) in zip(
        spread([place for place, *_ in names_at], points, NAME_DISTANCE), names_at, strict=True
    ):
        look = {"xycoords": "axes fraction", "color": colour, "weight": "bold"}
        label(axes, shortened(name, letters), (1.0, at / points), (4, 0), gid="name", **look)


def _name_levels(axes: Axes, panel: Panel, points: float) -> None:
    """The names of the levels above their ends, pushed apart."""
    low, high = axes.get_ylim()
    levels = level_names(panel)
    places = spread([(value - low) / (high - low) * points for value, _ in levels], points, NAME_DISTANCE)
    for at, (_, name) in zip(places, levels, strict=True):
        look = {"xycoords": "axes fraction", "color": PENS["level", None].colour, "ha": "right"}
        label(axes, plain(name), (1.0, at / points), (-3, 5), gid="level", **look)


# --- Charts as SVG and PNG, drawn with matplotlib on figures of its own, without global state or a display ------------

DRAWING_SETTINGS: dict[RcKeyType, Any] = {
    "font.family": ["DejaVu Sans"],
    "text.parse_math": False,
    "svg.fonttype": "none",
    "svg.hashsalt": "pidcfg",
    "svg.image_inline": True,
    "axes.unicode_minus": False,
    "path.simplify": True,
    "path.simplify_threshold": 0.1,
}
"""What differs from matplotlib's defaults; a user's own matplotlibrc has no say."""
DPI = 144
"""Of a PNG: 1382 pixels across."""


def svg(charts: Sequence[Chart], *, title: str) -> str:
    """All charts below each other as one SVG, without an XML declaration: a file, or a part of a page.

    Its identifiers are its own, so that a page can hold several.
    """
    with _drawing():
        sink = io.StringIO()
        figure_of(charts, title).savefig(sink, format="svg", metadata={"Date": None})
    return clean_drawing(sink.getvalue(), title, describe_charts(charts))


def png(charts: Sequence[Chart], *, title: str) -> bytes:
    """All charts below each other as one PNG."""
    with _drawing():
        sink = io.BytesIO()
        metadata = {"Software": None, "Description": describe_charts(charts)}
        figure_of(charts, title).savefig(sink, format="png", dpi=DPI, metadata=metadata)
    return sink.getvalue()


@contextmanager
def _drawing() -> Iterator[None]:
    """The library with its defaults and `DRAWING_SETTINGS`, silent about letters that its font lacks."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    import matplotlib as mpl

    with mpl.rc_context(), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        mpl.rcdefaults()
        mpl.rcParams.update(DRAWING_SETTINGS)
        yield
