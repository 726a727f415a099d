"""Numbers and times as people write them."""

from __future__ import annotations

NEAT = (1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10)
"""What half a run may last, times a power of ten."""
HOUR, MINUTES = 3600, 120
"""Seconds from which on a time is told in hours, and in minutes."""
LARGEST_WHOLE = 1e15


def digits(value: float, most: int = 4) -> float:
    """A number of so many significant digits; a whole one as such."""
    rounded = float(f"{value:.{most}g}")
    return int(rounded) if rounded == int(rounded) and abs(rounded) < LARGEST_WHOLE else rounded


def neat(value: float, span: float) -> float:
    """A value to a ten-thousandth of its range."""
    decimals = 4 - len(f"{abs(span):.0f}") if abs(span) >= 1 else 4 + max(0, -int(f"{span:e}".split("e")[1]))
    rounded = round(value, max(decimals, 0))
    return int(rounded) if rounded == int(rounded) else rounded


def round_up(seconds: float) -> float:
    """A neat time that is not shorter."""
    power = 10.0 ** int(f"{seconds:e}".split("e")[1])
    return digits(next(step * power for step in NEAT if step * power >= seconds * (1 - 1e-9)))


def time_text(seconds: float) -> str:
    """A time for a comment."""
    if seconds >= HOUR:
        return f"{seconds / HOUR:.3g} h"
    return f"{seconds / 60:.3g} min" if seconds >= MINUTES else f"{seconds:.3g} s"
