"""NextoPID: function blocks and their wires as named parameters; here what a program does not say."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.encoders import Option

if TYPE_CHECKING:
    from decimal import Decimal

# --- What a NextoPID program does not say, and what a conversion cannot know: the interval of its task ----------------

FORMATS = ("text", "csv", "json", "st", "plcopen", "modbus-map")


def _read_seconds(text: str) -> Decimal | None:
    from decimal import Decimal

    from pidcfg.schemas.base import parse_seconds

    try:
        time = parse_seconds(Decimal(text) if text.replace(".", "", 1).isdigit() else text)
    except (ValueError, ArithmeticError):
        return None
    return time if time > 0 else None


DECODE_OPTIONS = (
    Option("sample_time", "TIME", "Interval of the task that calls the blocks.", "100 ms", _read_seconds),
)
CONVERT_OPTIONS = DECODE_OPTIONS
