"""``--plot``: charts in a file by its suffix, or in the terminal."""

from __future__ import annotations

import shutil
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from pidcfg.cli.console import show_text as print_report
from pidcfg.cli.environment import require_extra

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures import Chart
    from pidcfg.study.certification.certify import BatchOutcome
    from pidcfg.study.outcome import Outcome

TERMINAL_NAME = "-"
SUFFIXES = (".svg", ".png", ".html")
MAX_LOOPS = 40
"""Charts in one file: what a page of pictures can hold and a person look through."""
MIN_WIDTH, MAX_WIDTH, PICTURE_HEIGHT = 40, 160, 12
"""Characters of a picture in the terminal."""
PIPED_WIDTH = 80
"""Its width where the output is not a terminal."""


def name_files(ctx: click.Context, param: click.Parameter, names: tuple[str, ...]) -> tuple[str, ...]:
    """File names whose suffixes give the format; what a PNG needs is checked before anything runs."""
    for name in names:
        if name != TERMINAL_NAME and Path(name).suffix.lower() not in SUFFIXES:
            ends = f"{', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}"
            raise click.BadParameter(f"{name!r}; write a name that ends in {ends}, or - for the terminal", ctx, param)
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise click.BadParameter(f"{repeated!r} stands there twice", ctx, param)
    if any(Path(name).suffix.lower() == ".png" for name in names):
        require_extra("matplotlib", "png")
    return names


def refuse_terminal(ctx: click.Context, param: click.Parameter, names: tuple[str, ...]) -> tuple[str, ...]:
    """The same where the terminal shows the pictures anyway."""
    if TERMINAL_NAME in names:
        raise click.BadParameter("--verify draws in the terminal; name a file", ctx, param)
    return name_files(ctx, param, names)


_plot = partial(click.option, "--plot", multiple=True, metavar="FILE")
PLOT_OPTION = _plot(
    callback=name_files, help="Draw the loops: FILE.svg, .png or .html, or - in the terminal; repeatable."
)
MARGINS_OPTION = _plot(
    callback=name_files, help="Draw margins and answers of the loop: FILE.svg, .png or .html, or - in the terminal."
)
VERIFIED_OPTION = _plot(
    callback=refuse_terminal,
    help="As --verify, and draw both sides over each other: FILE.svg, .png or .html; repeatable.",
)
OVERLAY_OPTION = _plot(
    callback=name_files,
    help="Draw both sides over each other on the same plants: FILE.svg, .png or .html, or - in the "
    "terminal; repeatable.",
)
VERIFY_OPTION = click.option(
    "--verify",
    type=click.Choice(["pass", "report"]),
    metavar="[=report]",
    help="Run both sides through a battery of stages on the same plants: exit 1 where they behave differently, 0 where "
    "they are alike; with =report only say so.",
)
LOOPS_OPTION = click.option(
    "--plot-loop", "plot_loops", multiple=True, metavar="NAME", help="With --plot: draw this loop only; repeatable."
)


def check_options(fmt: str, plot: Sequence[str], loops: Sequence[str] = ()) -> None:
    """Ends the command where a picture and the result would take one way, or loops are named for no picture."""
    if fmt != "text" and TERMINAL_NAME in plot:
        raise click.UsageError(f"--plot - and --format {fmt} would both go to standard output; name a file")
    if loops and not plot:
        raise click.UsageError("--plot-loop needs --plot")


def refuse_unknown_loops(loops: Sequence[str], outcomes: Sequence[Outcome | BatchOutcome]) -> None:
    """Ends the command where a picture of a loop is wanted that did not run."""
    drawn_loops = list(dict.fromkeys(loop for outcome in outcomes for loop in outcome.axes))
    unknown = next((loop for loop in loops if loop not in drawn_loops), None)
    if unknown is not None and drawn_loops:
        raise click.UsageError(f"--plot-loop {unknown}: no such loop; there are {', '.join(drawn_loops)}")


def charts_of_runs(outcomes: Sequence[Outcome], loops: Sequence[str]) -> list[Chart]:
    """The charts of all runs; where there are several, each says of which one it is."""
    from pidcfg.study.outcome import charts_of

    refuse_unknown_loops(loops, outcomes)
    drawn_charts = []
    for outcome in outcomes:
        charts = charts_of(outcome, loops)
        if outcome.report is not None and len(outcomes) > 1:
            charts = [replace(chart, title=f"{outcome.report.scenario}: {chart.title}") for chart in charts]
        drawn_charts += charts
    return drawn_charts


def picture_heading(outcomes: Sequence[Outcome]) -> tuple[str, list[str]]:
    """The title of a picture of runs, and what ran."""
    reports = [outcome.report for outcome in outcomes if outcome.report is not None]
    title = reports[0].scenario if len(reports) == 1 else f"{len(reports)} scenarios"
    return title, [
        f"{Path(outcome.file).name} runs {Path(outcome.config).name}"
        for outcome in outcomes
        if outcome.report is not None
    ]


def draw_files(
    names: Sequence[str], charts: Sequence[Chart], title: str, intro: Sequence[str] = ()
) -> dict[str, str | bytes]:
    """The files of all names but the terminal's, by name."""
    files: dict[str, str | bytes] = {}
    if not charts:
        return files
    for name in names:
        suffix = Path(name).suffix.lower()
        if name == TERMINAL_NAME:
            continue
        if len(charts) > MAX_LOOPS:
            raise click.ClickException(f"{name}: {len(charts)} loops are too many for one picture, at most {MAX_LOOPS}")
        if suffix == ".svg":
            from pidcfg.pictures.figure import draw_svg

            files[name] = draw_svg(charts, title=title)
        elif suffix == ".png":
            from pidcfg.pictures.figure import draw_png

            files[name] = draw_png(charts, title=title)
        else:
            from pidcfg.pictures.page import render_page

            files[name] = render_page(charts, title=title, intro=intro)
    return files


def chart_text(chart: Chart, stream: TextIO, height: int = PICTURE_HEIGHT) -> str:
    """A chart as wide as the terminal, in the signs that its code page has."""
    from pidcfg.pictures.characters import can_encode_signs, draw_rows

    width = min(max(shutil.get_terminal_size((PIPED_WIDTH, 24)).columns - 1, MIN_WIDTH), MAX_WIDTH)
    return "\n".join(draw_rows(chart, width, height, ascii_only=not can_encode_signs(stream.encoding)))


def show_charts(charts: Sequence[Chart]) -> None:
    """The charts in the terminal, as a result."""
    for chart in charts:
        print_report(f"\n{chart_text(chart, sys.stdout)}\n")
