"""The fan chart of a loop: PV, set point and output, how far each spreads over the samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.certification.fan import LEVELS
from pidcfg.pictures.chart import Band, Chart, Line, Panel

if TYPE_CHECKING:
    from collections.abc import Collection

    from pidcfg.certification.fan import Fan
    from pidcfg.certification.outcome import Outcome
    from pidcfg.pictures.chart import Role
    from pidcfg.scenario.axes import Axes

MIDDLE = len(LEVELS) // 2


def charts_of(outcome: Outcome, loops: Collection[str] = ()) -> list[Chart]:
    """One chart a loop, in the order of the PLC; ``loops``: only these."""
    fan = outcome.fan
    if fan is None or not fan.quantiles:
        return []
    return [
        _chart(loop, axes, fan, outcome.duration) for loop, axes in outcome.axes.items() if not loops or loop in loops
    ]


def _chart(loop: str, axes: Axes, fan: Fan, duration: float) -> Chart:
    title = f"{loop}: {axes.description}" if axes.description else loop
    panels = [_panel(fan, {axes.setpoint: "setpoint", axes.pv: "pv"}, axes.pv_unit)]
    if axes.output:
        panels.append(_panel(fan, {axes.output: "output"}, axes.output_unit, axes.output_range))
    note = f"{fan.samples} samples: the line is the median, the bands hold the middle 50 % and 90 % at each time"
    return Chart(title, loop, tuple(panels), begin=0.0, end=duration, notes=(note,))


def _panel(fan: Fan, roles: dict[str, Role], unit: str, least: tuple[float, float] | None = None) -> Panel:
    names = [name for name in roles if name]
    short = {name: name.rpartition(".")[2] for name in names}
    lines = [Line(short[name], roles[name], fan.times, fan.quantiles[name][MIDDLE]) for name in names]
    bands = [
        Band(roles[name], fan.times, fan.quantiles[name][i], fan.quantiles[name][-1 - i])
        for name in names
        for i in range(MIDDLE)
    ]
    return Panel(", ".join(short[name] for name in reversed(names)), unit, tuple(lines), least, tuple(bands))
