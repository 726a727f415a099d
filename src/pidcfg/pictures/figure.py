"""A sheet of charts as a matplotlib figure: panels, strips, marks and names of lines."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.pictures.chart import Line
from pidcfg.pictures.layout import KEY, LABEL, LINE, MARGIN, POINTS, RIGHT, TITLE, letters_in, numbered, sheet
from pidcfg.pictures.locus import draw_locus
from pidcfg.pictures.scale import layer_of, level_names, limits, spread, tick_text
from pidcfg.pictures.strips import draw_marks, draw_strips, label
from pidcfg.pictures.style import (
    BEFORE,
    GREY,
    HELD,
    INK,
    PALE,
    PENS,
    SIZES,
    WARNING,
    drawable,
    pen_of,
    plain,
    shortened,
    stroke,
    unit_of_time,
    with_unit,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pidcfg.pictures.chart import Chart, Panel
    from pidcfg.pictures.layout import Box, Place, Sheet

FAINT = 0.18
"""How dense a band is; where two lie over each other they are denser."""
APART = 10.0
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
    failed = {number for number, mark in numbered(chart) if mark.kind == "failure"}
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
        look: dict[str, Any] = {"color": colour, "alpha": FAINT, "linewidth": 0, "gid": "band"}
        axes.fill_between(times, band.low, band.high, step="post" if band.role in HELD else None, **look)
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
            drawstyle="steps-post" if line.role in HELD else "default",
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
    for at, (_, name, colour) in zip(spread([place for place, *_ in names_at], points, APART), names_at, strict=True):
        look = {"xycoords": "axes fraction", "color": colour, "weight": "bold"}
        label(axes, shortened(name, letters), (1.0, at / points), (4, 0), gid="name", **look)


def _name_levels(axes: Axes, panel: Panel, points: float) -> None:
    """The names of the levels above their ends, pushed apart."""
    low, high = axes.get_ylim()
    levels = level_names(panel)
    places = spread([(value - low) / (high - low) * points for value, _ in levels], points, APART)
    for at, (_, name) in zip(places, levels, strict=True):
        look = {"xycoords": "axes fraction", "color": PENS["level", None].colour, "ha": "right"}
        label(axes, plain(name), (1.0, at / points), (-3, 5), gid="level", **look)
