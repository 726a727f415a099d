"""How pictures look: colours that survive greyscale printing and colour blindness, line styles, sizes, units of time.

Colours are those of Okabe and Ito; whatever a colour tells is also told by a line style, a label or a place.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.typing import LineStyleType as LineStyle

    from pidcfg.pictures.chart import Chart, Line, Strip, StripKind

    Look = dict[str, Any]
    """Properties of a text or a line, by the library's names for them."""

BLACK, INK, GREY, PALE, FIELD = "#000000", "#222222", "#707070", "#d9d9d9", "#f7f7f7"
BLUE, GREEN, VERMILION, PURPLE, ORANGE, SKY = "#0072B2", "#007A5A", "#D55E00", "#CC79A7", "#E69F00", "#56B4E9"
WARNING = "#A84300"
"""Vermilion as small letters need it: dark enough on white."""


@dataclass(frozen=True, slots=True)
class Pen:
    """A colour, a width in points and a pattern of dashes (empty: solid)."""

    colour: str
    width: float
    dashes: tuple[float, ...] = ()


PENS = {
    ("setpoint", None): Pen(INK, 1.2, (5, 2.5)),
    ("pv", None): Pen(BLUE, 1.9),
    ("output", None): Pen(GREEN, 1.6),
    ("level", None): Pen(WARNING, 1.0, (1.5, 2.5)),
    ("other", None): Pen(PURPLE, 1.3, (7, 2, 1.5, 2)),
    ("pv", "after"): Pen(BLUE, 2.4),
    ("output", "after"): Pen(GREEN, 2.2),
    ("other", "after"): Pen(PURPLE, 2.0),
}
"""By the role of a line and the side it belongs to: SP dashed, PV solid and thick."""
BEFORE = Pen("#8a8a8a", 1.2, (4, 2))
"""Thin dashed grey, which can be seen on white and on a line of after."""
BESIDE = Pen(INK, 1.0, (1.2, 1.6))
"""A set point where dashes are those of before."""


def pen_of(line: Line, *, overlaid: bool) -> Pen:
    """How a line is drawn; ``overlaid``: in a chart of two runs."""
    if line.side == "before":
        return BEFORE
    return BESIDE if overlaid and line.role == "setpoint" else PENS[line.role, line.side]


def pattern(pen: Pen) -> LineStyle:
    """A pen's dashes as the library takes them: relative to its width."""
    return (0, tuple(dash / pen.width for dash in pen.dashes)) if pen.dashes else "-"


def stroke(pen: Pen) -> Look:
    """A pen as the library draws a line with it."""
    return {"color": pen.colour, "linewidth": pen.width, "linestyle": pattern(pen)}


HELD = {"setpoint", "output", "level"}
"""Roles of signals that keep their value until the next one."""

MODES = {"manual": ("#ececec", GREY), "auto": ("#cfe3f1", BLUE), "cascade": ("#cfeadf", GREEN)}
"""Fill and edge of the bars of the modes that most vendors have."""
FILLS: dict[StripKind, tuple[tuple[str, str], ...]] = {
    "mode": (("#f6e3c0", ORANGE), ("#f1dbe7", PURPLE)),
    "alarm": (("#f7cdb2", VERMILION),),
    "step": (("#dff0fb", SKY), ("#f9ecd0", ORANGE)),
    "condition": (("#f1dbe7", PURPLE),),
}
"""Fill and edge of the other bars, by turns for those of a strip that are called differently."""


def fills_of(strip: Strip) -> dict[str, tuple[str, str]]:
    """Fill and edge of each bar of a strip by what it is called."""
    names = list(dict.fromkeys(bar.label for bar in strip.bars))
    others = [name for name in names if strip.kind != "mode" or name not in MODES]
    fills = FILLS[strip.kind]
    return MODES | {name: fills[i % len(fills)] for i, name in enumerate(others)}


LARGEST = 1e100
"""From here on a value has no place on an axis."""
SIZES = {"title": 11.0, "label": 9.0, "small": 8.0}
"""Of letters, in points."""
LETTER = 0.62
"""Width of an average letter as a share of its size, rather too much."""


def drawable(line: Line) -> tuple[list[float], list[float]]:
    """The times and values of a line that have a place on an axis."""
    times, values = line.times, line.values
    if values and isfinite(sum(times)) and isfinite(sum(values)) and -LARGEST < min(values) <= max(values) < LARGEST:
        return list(times), list(values)
    pairs = [(t, v) for t, v in zip(line.times, line.values, strict=True) if isfinite(t) and abs(v) < LARGEST]
    return [t for t, _ in pairs], [v for _, v in pairs]


UNITS_OF_TIME = ((180.0, "s", 1.0), (3 * 3600.0, "min", 60.0), (float("inf"), "h", 3600.0))
"""The longest time shown in each unit, its name, and its seconds."""


def unit_of_time(chart: Chart) -> tuple[str, float]:
    """In which unit the time axis of a chart is labelled, and its seconds."""
    begin, end = chart.ends
    return next((name, size) for longest, name, size in UNITS_OF_TIME if end - begin <= longest)


def moment(chart: Chart, time: float) -> str:
    """A time as the axis would label it."""
    name, size = unit_of_time(chart)
    return f"{time / size:.4g} {name}"


def with_unit(title: str, unit: str) -> str:
    """An axis' label."""
    return f"{title} ({unit})" if unit else title


def plain(text: str) -> str:
    """A text on one line without control characters, which no picture can show."""
    return "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in " ".join(text.split()))


def shortened(text: str, letters: int) -> str:
    """A text that is not longer than its place."""
    text = plain(text)
    return text if len(text) <= letters else text[: max(letters - 1, 0)].rstrip() + "…"
