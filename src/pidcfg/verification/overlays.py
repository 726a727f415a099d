"""Charts of two runs laid over each other: a configuration and what became of it, on the same plants."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.pictures.chart import Chart, Line, Mark, Panel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pidcfg.pictures.chart import Role
    from pidcfg.schemas.generic import Loop


def overlay(  # noqa: PLR0913, PLR0917 - two trends and their times, each in columns
    loop: Loop,
    times: Sequence[float],
    setpoints: Sequence[float],
    pvs: Sequence[Sequence[float]],
    outputs: Sequence[Sequence[float]],
    names: tuple[str, str],
    happenings: tuple[float, float],
) -> Chart:
    """PV and output of both sides; outputs are in % of their ranges, since these may differ."""
    shares = [[100 * value for value in side] for side in outputs]
    return Chart(
        title=f"{loop.name}: {loop.description}" if loop.description else loop.name,
        loop=loop.name,
        panels=(
            Panel(
                "PV, SP",
                loop.pv.unit or "",
                (Line("SP", "setpoint", times, setpoints), *_sides("PV", "pv", times, pvs)),
            ),
            Panel("OUT", "%", _sides("OUT", "output", times, shares)),
        ),
        marks=(Mark("step of the set point", happenings[0]), Mark("disturbance", happenings[1])),
        sides=names,
    )


def _sides(name: str, role: Role, times: Sequence[float], both: Sequence[Sequence[float]]) -> tuple[Line, Line]:
    return Line(name, role, times, both[0], "before"), Line(name, role, times, both[1], "after")
