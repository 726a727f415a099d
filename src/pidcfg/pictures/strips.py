"""The rows of bars below the panels, and the marks that go through everything."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.pictures.layout import ABOVE, letters_in, numbered
from pidcfg.pictures.style import (
    BLACK,
    FIELD,
    GREY,
    INK,
    SIZES,
    VERMILION,
    WARNING,
    fills_of,
    plain,
    shortened,
    unit_of_time,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from pidcfg.pictures.chart import Chart, Strip
    from pidcfg.pictures.layout import Box
    from pidcfg.pictures.style import Look

CLOSE = 0.32
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
    marks = numbered(chart)
    for _, mark in marks:
        look = FAILURE_LINE if mark.kind == "failure" else MARK_LINE
        for axes in (*panels, *below):
            axes.axvline(mark.at / size, zorder=2, gid=f"mark {mark.kind}", **look)
    numbers = [(mark.at, number, mark.kind == "failure") for number, mark in marks]
    for at, text, failed in grouped(numbers, CLOSE / width * (end - begin)):
        if panels:
            look = {"color": WARNING, "weight": "bold"} if failed else {}
            label(panels[0], text, (at / size, 1.0), (0, ABOVE * 12), gid="number", **ABOVE_AXES, **look)


def grouped(marks: Sequence[tuple[float, str, bool]], close: float) -> list[tuple[float, str, bool]]:
    """Numbers of marks that are close together as one text: 3-5."""
    groups: list[tuple[float, str, bool]] = []
    for at, number, failed in marks:
        if groups and at - groups[-1][0] < close:
            first, text, any_failed = groups[-1]
            groups[-1] = (first, f"{text.partition('-')[0]}-{number}", any_failed or failed)
        else:
            groups.append((at, number, failed))
    return groups
