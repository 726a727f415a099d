"""A sheet of charts as a matplotlib figure: panels, strips, marks and names of lines."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.pictures.layout import ABOVE, KEY, LEFT, LINE, MARGIN, POINTS, RIGHT, TITLE, letters_in, numbered, sheet
from pidcfg.pictures.style import (
    BLACK,
    GREY,
    HELD,
    INK,
    PALE,
    PENS,
    SIZES,
    VERMILION,
    WARNING,
    fills_of,
    pen_of,
    plain,
    shortened,
    unit_of_time,
    with_unit,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from pidcfg.pictures.chart import Chart, Line, Panel, Strip
    from pidcfg.pictures.layout import Box, Place, Sheet

ROOM = 0.06
"""What is left free above and below the lines, as a share of what they cover."""
FLAT = 1e-9
"""Values that differ by less than this share of their size are one value."""
APART = 10.0
"""Points between the names of two lines."""
CLOSE = 0.02
"""Marks that are closer than this share of the time axis share one number above it."""


def figure_of(charts: Sequence[Chart], title: str, *, narrow: bool) -> Figure:
    """The figure of a picture."""
    from matplotlib.figure import Figure

    plan = sheet(charts, title, narrow=narrow)
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
    style = {"color": INK, "va": "center", "size": SIZES["small"]} | style
    figure.text(left / plan.width, 1 - top / plan.height, text, **style)


def _axes(figure: Figure, plan: Sheet, box: Box, chart: Chart) -> Axes:
    """Empty axes over the chart's time, in the unit of its axis."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    bottom = 1 - (box.top + box.height) / plan.height
    axes = figure.add_axes((box.left / plan.width, bottom, box.width / plan.width, box.height / plan.height))
    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    axes.set_xlim(begin / size, (end if end > begin else begin + 1.0) / size)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("bottom", "left"):
        axes.spines[side].set(color=GREY, linewidth=0.8)
    axes.tick_params(labelsize=SIZES["small"], color=GREY, labelcolor=INK, length=3, width=0.8)
    axes.tick_params(axis="x", labelbottom=False)
    axes.xaxis.set_major_locator(MaxNLocator(8 if plan.width > 6 else 5, steps=[1, 2, 3, 5, 6, 10]))
    axes.xaxis.set_major_formatter(FuncFormatter(_number))
    return axes


def _draw(figure: Figure, plan: Sheet, place: Place) -> None:
    chart = place.chart
    size = SIZES["title"]
    title = shortened(chart.title, letters_in(plan.width - 2 * MARGIN, size))
    _text(figure, plan, MARGIN, place.top + TITLE / 2, title, size=size, weight="bold", gid="loop")
    if place.key is not None:
        _draw_key(figure, plan, place)
    axes = [_axes(figure, plan, box, chart) for box in (*place.panels, *place.strips)]
    panels, strips = axes[: len(place.panels)], axes[len(place.panels) :]
    for target, panel in zip(panels, chart.panels, strict=True):
        _draw_panel(target, panel, chart)
    for row, (target, strip) in enumerate(zip(strips, chart.strips, strict=True)):
        _draw_strip(target, strip, chart, first=row == 0)
    if axes:
        _label_time(axes[-1], chart)
    _draw_marks(panels, strips, chart)
    failed = {number for number, mark in numbered(chart) if mark.kind == "failure"}
    for i, text in enumerate(place.texts):
        colour = WARNING if text.split(" ", 1)[0] in failed or text.startswith("failed") else INK
        _text(figure, plan, MARGIN, place.text_top + LINE * (i + 0.5), text, color=colour, gid="note")


def _draw_key(figure: Figure, plan: Sheet, place: Place) -> None:
    """What before and after are, beside a piece of their lines."""
    from matplotlib.lines import Line2D

    top, wide = (place.key or 0.0) + KEY / 2, (plan.width - 2 * MARGIN) / 2
    for i, (side, name) in enumerate(zip(("before", "after"), place.chart.sides or (), strict=True)):
        left = MARGIN + i * wide
        pen = PENS["pv", "before" if side == "before" else "after"]
        piece = Line2D(
            [left / plan.width, (left + 0.35) / plan.width], [1 - top / plan.height] * 2, color=pen.colour,
            linewidth=pen.width, linestyle=(0, pen.dashes) if pen.dashes else "-", gid=f"key {side}",
        )  # fmt: skip
        figure.add_artist(piece)
        text = shortened(f"{side}: {name}", letters_in(wide - 0.5, SIZES["small"]))
        _text(figure, plan, left + 0.42, top, text, gid=f"side {side}")


def _label_time(axes: Axes, chart: Chart) -> None:
    name, _ = unit_of_time(chart)
    axes.spines["bottom"].set_visible(True)
    axes.tick_params(axis="x", labelbottom=True, bottom=True)
    axes.set_xlabel(with_unit("time", name), size=SIZES["label"], color=INK, labelpad=2, gid="axis time")


def _number(value: float, _place: int | None = None) -> str:
    return f"{value:.10g}"


# --- panels ----------------------------------------------------------------------------------------------------------


def _draw_panel(axes: Axes, panel: Panel, chart: Chart) -> None:
    """All lines of a panel, those of after above those of before, with their names on the right."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    _, size = unit_of_time(chart)
    axes.grid(visible=True, color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    axes.set_ylim(*_limits(panel))
    axes.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10], min_n_ticks=2))
    axes.yaxis.set_major_formatter(FuncFormatter(_number))
    letters = letters_in(axes.get_position().height * axes.figure.get_figheight(), SIZES["label"])
    label = shortened(with_unit(panel.title, panel.unit), letters)
    axes.set_ylabel(label, size=SIZES["label"], color=INK, gid="axis value")
    axes.yaxis.set_label_coords(-(LEFT - 0.22) / (axes.get_position().width * axes.figure.get_figwidth()), 0.5)
    names: dict[str, tuple[float, str]] = {}
    for layer, line in enumerate(sorted(panel.lines, key=_layer), start=3):
        times, values = finite(line)
        if not times:
            continue
        pen = pen_of(line)
        dashes = (0, tuple(d / pen.width for d in pen.dashes)) if pen.dashes else "-"
        axes.plot(
            [t / size for t in times], values, color=pen.colour, linewidth=pen.width, linestyle=dashes, zorder=layer,
            drawstyle="steps-post" if line.role in HELD else "default", gid=f"line {line.role} {line.side or 'only'}",
            marker="o" if len(times) == 1 else "", markersize=4,
        )  # fmt: skip
        names[line.name] = (values[-1], pen.colour)
    _name_lines(axes, names)


def finite(line: Line) -> tuple[list[float], list[float]]:
    """The times and values of a line that can be drawn."""
    pairs = [(t, v) for t, v in zip(line.times, line.values, strict=True) if isfinite(t) and isfinite(v)]
    return [t for t, _ in pairs], [v for _, v in pairs]


def _layer(line: Line) -> tuple[bool, bool]:
    return line.side != "before", line.role != "setpoint"


def _limits(panel: Panel) -> tuple[float, float]:
    """The ends of a value axis: all lines with some room, and around a flat line something to see it in."""
    values = [v for line in panel.lines for v in finite(line)[1]] + list(panel.least or ())
    low, high = min(values, default=0.0), max(values, default=1.0)
    if high - low <= FLAT * max(abs(low), abs(high)):
        low, high = low - 0.05 * (abs(low) or 10.0), high + 0.05 * (abs(high) or 10.0)
    room = ROOM * (high - low)
    return low - room, high + room


def _name_lines(axes: Axes, names: dict[str, tuple[float, str]]) -> None:
    """The names of the lines at their right ends, pushed apart where they would cover each other."""
    low, high = axes.get_ylim()
    points = axes.get_position().height * axes.figure.get_figheight() * POINTS
    wanted = sorted(((value - low) / (high - low) * points, name, colour) for name, (value, colour) in names.items())
    letters = letters_in(RIGHT - 0.06, SIZES["small"])
    for at, (_, name, colour) in zip(spread([w[0] for w in wanted], points), wanted, strict=True):
        axes.annotate(
            shortened(name, letters), (1.0, at / points), xycoords="axes fraction", xytext=(4, 0), va="center",
            textcoords="offset points", size=SIZES["small"], color=colour, weight="bold", gid="name",
        )  # fmt: skip


def spread(places: Sequence[float], room: float) -> list[float]:
    """Ascending places, moved as little as needed to be apart, and within the room as far as it allows."""
    found: list[float] = []
    for place in places:
        found.append(max(place, found[-1] + APART if found else place))
    for i in range(len(found) - 1, -1, -1):
        ceiling = room if i == len(found) - 1 else found[i + 1] - APART
        found[i] = min(found[i], ceiling)
    return found


# --- strips and marks ------------------------------------------------------------------------------------------------


def _draw_strip(axes: Axes, strip: Strip, chart: Chart, *, first: bool) -> None:
    """One row of bars; a name stands in its bar, or beside it where it is too short and nothing follows."""
    from matplotlib.patches import Rectangle

    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.tick_params(axis="x", bottom=False)
    axes.spines["bottom"].set_visible(False)
    axes.spines["left"].set_visible(False)
    axes.set_facecolor("#f7f7f7")
    wide = axes.get_position().width * axes.figure.get_figwidth()
    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    scale = wide / ((end - begin) or 1.0)
    title = shortened(strip.title, letters_in(LEFT - 0.1, SIZES["small"]))
    axes.annotate(title, (0, 0.5), xycoords="axes fraction", xytext=(-5, 0), textcoords="offset points", ha="right",
                  va="center", size=SIZES["small"], color=INK, gid=f"strip {strip.kind}")  # fmt: skip
    fills = fills_of(strip)
    for i, bar in enumerate(strip.bars):
        fill, edge = fills[bar.label]
        width = max(bar.end - bar.begin, 0.012 / scale)
        shape = Rectangle((bar.begin / size, 0.04), width / size, 0.92, facecolor=fill, edgecolor=edge, linewidth=0.9,
                          gid=f"bar {strip.kind}")  # fmt: skip
        axes.add_patch(shape)
        following = strip.bars[i + 1].begin if i + 1 < len(strip.bars) else end
        inside, beside = ((stop - start) * scale - 0.08 for start, stop in
                          ((bar.begin, bar.end), (bar.end, following)))  # fmt: skip
        place = bar.begin if len(bar.label) <= letters_in(inside, SIZES["small"]) else bar.end
        if place == bar.begin or len(bar.label) <= letters_in(beside, SIZES["small"]):
            axes.annotate(plain(bar.label), (place / size, 0.5), xytext=(3, -0.5), textcoords="offset points",
                          va="center", size=SIZES["small"], color=BLACK, gid=f"label {strip.kind}")  # fmt: skip


def _draw_marks(panels: Sequence[Axes], strips: Sequence[Axes], chart: Chart) -> None:
    """A line through everything at each mark, and their numbers above the first panel."""
    (begin, end), (_, size) = chart.ends, unit_of_time(chart)
    marks = numbered(chart)
    for _, mark in marks:
        failed = mark.kind == "failure"
        for axes in (*panels, *strips):
            axes.axvline(mark.at / size, color=VERMILION if failed else GREY, linewidth=1.1 if failed else 0.7,
                         linestyle=(0, (6, 2, 1, 2)) if failed else (0, (1, 2)), zorder=2,
                         gid=f"mark {mark.kind}")  # fmt: skip
    for at, text, failed in grouped([(mark.at, number, mark.kind == "failure") for number, mark in marks],
                                    CLOSE * (end - begin)):  # fmt: skip
        if panels:
            panels[0].annotate(text, (at / size, 1.0), xycoords=("data", "axes fraction"), xytext=(0, ABOVE * 12),
                               textcoords="offset points", ha="center", va="bottom", size=SIZES["small"],
                               color=WARNING if failed else INK, gid="number",
                               weight="bold" if failed else "normal")  # fmt: skip


def grouped(marks: Sequence[tuple[float, str, bool]], close: float) -> list[tuple[float, str, bool]]:
    """Numbers of marks that are close together as one text: 3-5."""
    found: list[tuple[float, str, bool]] = []
    for at, number, failed in marks:
        if found and at - found[-1][0] < close:
            first, text, any_failed = found[-1]
            found[-1] = (first, f"{text.partition('-')[0]}-{number}", any_failed or failed)
        else:
            found.append((at, number, failed))
    return found
