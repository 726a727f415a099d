"""Charts as parts of an HTML page, or as a page that needs nothing else."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from html import escape
from pathlib import Path

from pidcfg.pictures import Chart, Line, Panel, Strip
from pidcfg.pictures.figure import id_prefix_of, locus_svg
from pidcfg.pictures.layout import (
    MAX_VALUE_TICKS,
    SQUARE_SIZE,
    axis_limits,
    band_corners,
    describe_charts,
    explain_marks,
    group_numbers,
    layer_of,
    level_names,
    line_points,
    number_marks,
    plain_text,
    spread_apart,
    tick_text,
    ticks,
    time_ticks,
    unit_of_time,
    with_unit,
)

# ----------------------------------------------------------------------------------------------------------------------
# Charts as parts of an HTML page: one drawing for every width and colour scheme, which a small script can zoom.
# Lines are polylines in a square of `SQUARE` by `SQUARE`, which the browser stretches to the width that there is;
# letters are HTML and keep their size. Without the script the page shows the whole run.

CLOSE_MARKS_SHARE = 0.03
"""Marks that are closer than this share of the time axis share one number."""
NAME_DISTANCE = 9_000.0
"""What is between the names of two lines."""
COLOURED_MODES = {"manual", "auto", "cascade"}
"""Modes that have a colour of their own; others take turns."""
STYLE = (Path(__file__).parent / "trend.css").read_text("utf-8")
SCRIPT = (Path(__file__).parent / "trend.js").read_text("utf-8")
SCRIPT_HASH = "sha256-" + base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
CONTENT_POLICY = (
    "default-src 'none'; style-src 'unsafe-inline'; "
    f"script-src '{SCRIPT_HASH}'; img-src data:; base-uri 'none'; form-action 'none'"
)
"""What a page with `render_figures` may load and run: its own styles, this script, nothing from elsewhere."""


def render_figures(charts: Iterable[Chart]) -> str:
    """The charts, for a page that has `STYLE`, and after them a script element with `SCRIPT`."""
    return "".join(map(render_figure, charts))


def render_figure(chart: Chart) -> str:
    """One chart."""
    begin, end = chart.time_span
    unit, size = unit_of_time(chart)
    notes = "".join(
        f'<p class="note{" failure" if "failed: " in text else ""}">{escape(text)}</p>\n'
        for text in explain_marks(chart)
    )
    return (
        f'<figure class="chart">\n<figcaption dir="auto">{escape(plain_text(chart.title))}</figcaption>\n'
        f"{_render_key(chart)}"
        f'<p class="said">{escape(describe_charts([chart]))}</p>\n'
        f"{locus_svg(chart.locus, id_prefix_of(chart.title)) if chart.locus else ''}"
        f'<div class="area" data-begin="{begin!r}" data-end="{end!r}" data-unit="{unit}" data-size="{size!r}">\n'
        f'<div class="over">{_render_numbers(chart)}</div>\n<div class="stack">\n'
        + "".join(_render_panel(chart, panel) for panel in chart.panels)
        + "".join(_render_strip(chart, strip) for strip in chart.strips)
        + f'<div class="through">{_render_marks(chart)}</div>\n</div>\n{_render_times(chart)}</div>\n{notes}</figure>\n'
    )


def _render_key(chart: Chart) -> str:
    """What before and after are."""
    sides = zip(("before", "after"), chart.sides or (), strict=False)
    rows = "".join(
        f'<span><i class="{side}"></i>{side}: <bdi>{escape(plain_text(name))}</bdi></span>' for side, name in sides
    )
    return f'<p class="key">{rows}</p>\n' if rows else ""


def x_of_time(chart: Chart, time: float) -> int:
    """Where a time stands on its axis."""
    begin, end = chart.time_span
    return round((time - begin) / ((end - begin) or 1.0) * SQUARE_SIZE)


def css_percent(part: float) -> str:
    """A part of the square as a style wants it."""
    return f"{100 * part / SQUARE_SIZE:.5g}%"


# --- panels ----------------------------------------------------------------------------------------------------------


def _render_panel(chart: Chart, panel: Panel) -> str:
    low, high = axis_limits(panel)
    unit = escape(plain_text(panel.unit))
    title = escape(with_unit(plain_text(panel.title), plain_text(panel.unit)))

    def height(value: float) -> int:
        return round((high - value) / (high - low) * SQUARE_SIZE)

    rows = [(tick, height(tick)) for tick in ticks(low, high, MAX_VALUE_TICKS)]
    columns = [x_of_time(chart, tick * unit_of_time(chart)[1]) for tick in time_ticks(chart)]
    grid = "".join([*(f"M0 {y}H{SQUARE_SIZE}" for _, y in rows), *(f"M{x} 0V{SQUARE_SIZE}" for x in columns)])
    bands = "".join(
        f'<polygon class="band {band.role}" points="{_points_attribute(band_corners(chart, band, low, high))}"/>\n'
        for band in panel.bands
    )
    drawn_lines = [(line, line_points(chart, line, low, high)) for line in sorted(panel.lines, key=layer_of)]
    lines = "".join(
        f'<polyline class="line {line.role} {line.side or "only"}" data-name="{escape(plain_text(line.name))}" '
        f'points="{_points_attribute(corners)}"/>\n'
        for line, corners in drawn_lines
        if corners
    )
    names = "".join(_render_names(panel, drawn_lines, height))
    numbers = "".join(f'<span class="y" style="top:{css_percent(y)}">{tick_text(tick)}</span>' for tick, y in rows)
    return (
        f'<div class="panel" data-low="{low!r}" data-high="{high!r}" data-unit="{unit}">'
        f'<span class="axis" dir="auto">{title}</span>'
        f'<svg viewBox="0 0 {SQUARE_SIZE} {SQUARE_SIZE}" preserveAspectRatio="none" aria-hidden="true">\n'
        f'<path class="grid" d="{grid}"/>\n{bands}{lines}</svg>{numbers}{names}</div>\n'
    )


def _points_attribute(corners: Iterable[tuple[int, int]]) -> str:
    return " ".join([f"{x},{y}" for x, y in corners])


def _render_names(
    panel: Panel, lines: Sequence[tuple[Line, Sequence[tuple[int, int]]]], height: Callable[[float], int]
) -> Iterator[str]:
    """The names of the signals where they end, pushed apart, and of the levels above them."""
    ends = {line.name: (corners[-1][1], line) for line, corners in reversed(lines) if corners and line.role != "level"}
    line_ends = sorted(ends.values(), key=lambda end: end[0])
    for y, (_, line) in zip(
        spread_apart([y for y, _ in line_ends], SQUARE_SIZE, NAME_DISTANCE), line_ends, strict=True
    ):
        side = "before" if line.side == "before" else "only"
        yield f'<b class="name {line.role} {side}" style="top:{css_percent(y)}">{escape(plain_text(line.name))}</b>'
    levels = level_names(panel)[::-1]
    for y, (_, name) in zip(
        spread_apart([height(value) for value, _ in levels], SQUARE_SIZE, NAME_DISTANCE), levels, strict=True
    ):
        yield f'<span class="limit" style="top:{css_percent(y)}">{escape(plain_text(name))}</span>'


# --- strips, marks and time ------------------------------------------------------------------------------------------


def _render_strip(chart: Chart, strip: Strip) -> str:
    """A row of bars; a bar tells its name unless the row does."""
    others = list(
        dict.fromkeys(bar.label for bar in strip.bars if strip.kind != "mode" or bar.label not in COLOURED_MODES)
    )
    bars = []
    for bar in strip.bars:
        first, last = x_of_time(chart, bar.begin), x_of_time(chart, bar.end)
        colour = "ab"[others.index(bar.label) % 2] if bar.label in others else bar.label
        label = "" if bar.label == strip.title else escape(plain_text(bar.label))
        place = f"left:{css_percent(first)};width:{css_percent(last - first)}"
        bars.append(
            f'<i class="bar {strip.kind} {colour}" data-from="{first}" data-to="{last}" style="{place}">'
            f'<span dir="auto">{label}</span></i>'
        )
    title = escape(plain_text(strip.title))
    return f'<div class="strip"><span class="row" dir="auto">{title}</span>{"".join(bars)}</div>\n'


def _render_marks(chart: Chart) -> str:
    """A line through everything at each event and failure."""
    places = ((x_of_time(chart, mark.time), mark.kind) for _, mark in number_marks(chart))
    return "".join(f'<i class="mark {kind}" data-at="{at}" style="left:{css_percent(at)}"></i>' for at, kind in places)


def _render_numbers(chart: Chart) -> str:
    """The numbers of the marks, above them."""
    numbers = [
        (float(x_of_time(chart, mark.time)), number, mark.kind == "failure") for number, mark in number_marks(chart)
    ]
    return "".join(
        f'<b class="{"failure" if failed else "event"}" data-at="{at:.0f}" style="left:{css_percent(at)}">{text}</b>'
        for at, text, failed in group_numbers(numbers, CLOSE_MARKS_SHARE * SQUARE_SIZE)
    )


def _render_times(chart: Chart) -> str:
    unit, size = unit_of_time(chart)
    numbers = "".join(
        f'<span class="x" style="left:{css_percent(x_of_time(chart, tick * size))}">{tick_text(tick)}</span>'
        for tick in time_ticks(chart)
    )
    return f'<div class="times">{numbers}<span class="unit">{with_unit("time", unit)}</span></div>\n'


# ----------------------------------------------------------------------------------------------------------------------
# Charts as one HTML file that needs nothing else: its script stands in it, and no font or network is asked for.

PAGE_STYLE = """\
:root { color-scheme: light dark; }
body { margin: 0 auto; padding: 1rem; max-width: 66rem; background: #f4f4f4; color: #1a1a1a;
  font: 16px/1.5 system-ui, 'Segoe UI', Roboto, Arial, sans-serif; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.2; margin: .5rem 0 1rem; }
@media (prefers-color-scheme: dark) { body { background: #0f1317; color: #ececec; } }
@media (max-width: 640px) { body { padding: .5rem; } }
@media print {
  body { background: #fff; color: #000; max-width: none; padding: 0; }
  @page { size: A4; margin: 15mm; }
}
"""


def render_page(charts: Sequence[Chart], *, title: str, intro: Sequence[str] = ()) -> str:
    """A page with the charts; ``intro``: paragraphs of plain text above them."""
    paragraphs = "".join(f"<p>{escape(plain_text(text))}</p>\n" for text in intro)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{CONTENT_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(plain_text(title))}</title>\n<style>\n{STYLE}{PAGE_STYLE}</style>\n</head>\n<body>\n"
        f"<main>\n<h1>{escape(plain_text(title))}</h1>\n{paragraphs}{render_figures(charts)}</main>\n"
        f"<script>{SCRIPT}</script>\n</body>\n</html>\n"
    )
