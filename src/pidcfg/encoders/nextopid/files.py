"""The files that a NextoPID program is written to and read from."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING

from pidcfg.encoders.files import DecodeOption
from pidcfg.encoders.named_files import named_listings
from pidcfg.schemas.base import parse_seconds

if TYPE_CHECKING:
    from pidcfg.schemas.nextopid import NextopidFile

FORMATS = named_listings("parameter listing")


def _seconds(text: str) -> Decimal | None:
    try:
        time = parse_seconds(Decimal(text) if text.replace(".", "", 1).isdigit() else text)
    except (ValueError, ArithmeticError):
        return None
    return time if time > 0 else None


DECODE_OPTIONS = (
    DecodeOption("sample_time", "TIME", "Interval of the task that calls the blocks.", "100 ms", _seconds),
)


def checklist(config: NextopidFile) -> tuple[str, ...]:
    """What the program around has to do."""
    items = [f"call the program in a cyclic task of {config.plc.sample_time} s"]
    outside = [
        f"{item.name}.{key}"
        for item in (*config.blocks, *config.loops)
        for key in ("PV", "InVar", "MV")
        if key in type(item).model_fields and getattr(item, key) is None
    ]
    if outside:
        items.append(f"assign before the calls, since nothing is wired to them: {', '.join(outside)}")
    if config.signals:
        items.append(f"assign the signals from outside: {', '.join(config.signals)}")
    return tuple(items)
