"""``tune --plot``: the margins of a loop in the complex plane, and what it does after steps."""

from __future__ import annotations

from math import isinf
from typing import TYPE_CHECKING

import click

from pidcfg.pictures.chart import Chart, Line, Locus, Panel

if TYPE_CHECKING:
    from pidcfg.results.gains import TuneResult
    from pidcfg.tuning.rules import Gains

LOUDEST = 12.0
"""Points of the curve that are farther out are in no picture."""


def chart_of(result: TuneResult) -> Chart:
    """The picture of a loop; ends the command where its process is not known, or it is unstable."""
    from pidcfg.tuning.closed_loop import curves
    from pidcfg.tuning.margins import traced

    judgement, gains = result.judgement, result.gains
    margins, plant = judgement.margins, judgement.plant
    if plant is None:
        raise click.ClickException("--plot needs the process: add its --gain")
    if margins is None:
        raise click.ClickException("--plot: with these gains the loop is unstable, there is nothing to be drawn")
    trace, moves = traced(gains, plant), curves(gains, plant)
    points = tuple(point for point in trace.points if abs(point) < LOUDEST)
    locus = Locus(
        points, margins.ms, trace.nearest, margins.gain_margin, trace.turn, margins.phase_margin, trace.crossover
    )
    step = Line("SP", "setpoint", (0.0, moves.times[-1]), (1.0, 1.0))
    panels = (
        Panel("PV, set point +1", "", (Line("PV", "pv", moves.times, moves.setpoint), step), (0.0, 1.0)),
        Panel("PV, output +1", "", (Line("PV", "pv", moves.times, moves.disturbance),), (0.0, 0.0)),
    )
    return Chart(_title(gains), "", panels, locus=locus, notes=tuple(_notes(result, locus)))


def _title(gains: Gains) -> str:
    """The controller."""
    parts = [f"Kp {gains.gain:.4g}"]
    parts += [] if isinf(gains.integral_time) else [f"Ti {gains.integral_time:.4g} s"]
    parts += [f"Td {gains.derivative_time:.4g} s"] if gains.derivative_time else []
    return ", ".join(parts)


def _notes(result: TuneResult, locus: Locus) -> list[str]:
    """What stands below the picture."""
    answer = result.judgement.answer
    figures = "" if answer is None else f"; overshoot {answer.overshoot:.3g} %"
    return [f"{locus.said}{figures}", *(f"warning: {text}" for text in result.warnings)]
