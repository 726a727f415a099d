"""The open loop in the complex plane: the curve, the circle that Ms keeps it out of, and both margins."""

from __future__ import annotations

from cmath import phase
from math import cos, pi, sin
from typing import TYPE_CHECKING, Any

from pidcfg.pictures.layout import LABEL
from pidcfg.pictures.strips import label
from pidcfg.pictures.style import BLUE, GREY, INK, PALE, SIZES, WARNING

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from pidcfg.pictures.chart import Locus
    from pidcfg.pictures.layout import Box

BOTTOM, TOP, MIDDLE = -1.8, 1.2, -0.45
"""Ends of the imaginary axis, and the middle of the real one: the unit circle and what is below it."""
ROUND = 180
"""Points of a circle."""


def draw_locus(axes: Axes, locus: Locus, box: Box) -> None:
    """Draws the curve with its margins; both axes have one scale."""
    half = (TOP - BOTTOM) * box.width / box.height / 2
    axes.set_xlim(MIDDLE - half, MIDDLE + half)
    axes.set_ylim(BOTTOM, TOP)
    axes.axhline(0, color=PALE, linewidth=0.8, zorder=1)
    axes.axvline(0, color=PALE, linewidth=0.8, zorder=1)
    _arc(axes, 0j, 1.0, 0.0, 2 * pi, color=GREY, linewidth=0.9, linestyle=(0, (4, 3)), gid="line circle unit")
    _arc(axes, -1 + 0j, 1 / locus.ms, 0.0, 2 * pi, color=WARNING, linewidth=1.3, gid="line circle ms")
    axes.plot(
        [z.real for z in locus.points], [z.imag for z in locus.points], color=BLUE, linewidth=1.9, gid="line locus only"
    )
    axes.plot([-1], [0], marker="+", markersize=9, color=WARNING, markeredgewidth=1.8, gid="mark critical")
    _name(axes, "-1", -1 + 0j, (4, -11), WARNING)
    _name(axes, f"Ms {locus.ms:.3g}", complex(-1 - 0.75 / locus.ms, 0.75 / locus.ms), (-4, 4), WARNING, ha="right")
    if locus.turn is not None:
        _dot(axes, locus.turn)
        _name(axes, f"gain margin {locus.gain_margin:.3g}", locus.turn, (6, 8), INK)
    if locus.crossover is not None:
        _dot(axes, locus.crossover)
        ends = [0.0, locus.crossover.real], [0.0, locus.crossover.imag]
        axes.plot(*ends, color=GREY, linewidth=0.9, gid="line radius")
        angle = phase(locus.crossover)
        _arc(axes, 0j, 0.45, -pi if angle < 0 else pi, angle, color=INK, linewidth=1.1, gid="line angle")
        at = (8, -10) if angle < 0 else (8, 4)
        _name(axes, f"phase margin {locus.phase_margin:.3g}°", locus.crossover, at, INK)
    axes.set_xlabel("real part of the open loop", size=SIZES["label"], color=INK, labelpad=2, gid="axis real")
    axes.set_ylabel("imaginary part", size=SIZES["label"], color=INK, gid="axis imaginary")
    axes.yaxis.set_label_coords(-LABEL / box.width, 0.5)


def _arc(axes: Axes, centre: complex, radius: float, begin: float, end: float, **look: Any) -> None:
    """A part of a circle, angles in radians."""
    angles = [begin + (end - begin) * i / ROUND for i in range(ROUND + 1)]
    points = [(centre.real + radius * cos(a), centre.imag + radius * sin(a)) for a in angles]
    axes.plot([x for x, _ in points], [y for _, y in points], zorder=2, **look)


def _dot(axes: Axes, point: complex) -> None:
    axes.plot([point.real], [point.imag], marker="o", markersize=5, color=INK, zorder=5, gid="mark margin")


def _name(axes: Axes, text: str, point: complex, offset: tuple[float, float], colour: str, ha: str = "left") -> None:
    """A text at a point, on a ground of its own where lines pass below it."""
    ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.8}
    look = {"color": colour, "weight": "bold", "ha": ha, "bbox": ground, "zorder": 6}
    label(axes, text, (point.real, point.imag), offset, gid="name", **look)
