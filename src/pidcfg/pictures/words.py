"""What a chart shows, in words: for those who hear a page instead of seeing it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.pictures.style import drawable, moment, plain, with_unit

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.pictures.chart import Chart, Line

SAID = 20
"""Bars and marks that are named, of each kind."""


def described(charts: Iterable[Chart]) -> str:
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
    more = f" and {len(texts) - SAID} more" if len(texts) > SAID else ""
    return "; ".join(texts[:SAID]) + more
