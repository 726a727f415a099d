"""A content as a person writes it, to the raw content of a register."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from pidcfg.explain.asked import HEX, MARKED_HEX, ThingError

if TYPE_CHECKING:
    from pidcfg.encoders.spaces import Kind

NUMBER = re.compile(r"[-+]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][-+]?[0-9]{1,3})?")
STATES = {"on": True, "true": True, "off": False, "false": False}


def raw_of(text: str, kind: Kind, name: str, *, hexadecimal: bool) -> int:
    """The raw content that ``text`` writes: in hexadecimal for vendors that show it so, else as a value of its kind.

    ``0x`` marks hexadecimal for every vendor.
    """
    marked = (HEX if hexadecimal else MARKED_HEX).fullmatch(text)
    if marked:
        raw = int(marked.group(1), 16)
        if raw > kind.highest:
            raise ThingError(f"{name}={text}: {kind.name} content has up to {kind.digits} hexadecimal digits")
        return raw
    value = STATES.get(text.lower())
    if value is None and NUMBER.fullmatch(text) and not hexadecimal:
        number = float(text)
        value = int(number) if number == number // 1 and kind.digits != 8 else number  # type: ignore[assignment]
    read = None if value is None or hexadecimal else kind.read(value)
    if read is None:
        wanted = f"up to {kind.digits} hexadecimal digits, like 0402 or 0x0402" if hexadecimal else kind.holds
        raise ThingError(f"{name}={text}: the value is not {wanted}")
    return read
