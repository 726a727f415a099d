"""A content as a person writes it, to the raw content of a register."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING

from pidcfg.encoders.spaces import SINGLE
from pidcfg.explanation.question import HEX, MARKED_HEX, ThingError

if TYPE_CHECKING:
    from pidcfg.encoders.spaces import Kind
    from pidcfg.explanation.find_register import RegisterBook
    from pidcfg.explanation.page import Page
    from pidcfg.explanation.question import Thing

NUMBER = re.compile(r"[-+]?(?:[0-9]{1,40}\.?[0-9]{0,40}|\.[0-9]{1,40})(?:[eE][-+]?[0-9]{1,3})?")
HEXADECIMAL_FROM = 10
"""Smaller numbers are the same in both notations."""
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
        digits = None if hexadecimal else HEX.fullmatch(text)
        hint = f"; hexadecimal digits are written 0x{digits.group(1)}" if digits and not text.isdecimal() else ""
        raise ThingError(f"{name}={text}: the value is not {wanted}{hint}")
    return read


def read_in_base(page: Page, thing: Thing, book: RegisterBook) -> Page:
    """A page of a content whose decimal digits are another number where a listing shows them, with a note on that."""
    text = thing.value
    if text is None or book.hexadecimal or page.value is None or not text.isdecimal() or int(text) < HEXADECIMAL_FROM:
        return page
    kind = next((bank.kind for bank in book.space.banks if type(bank.kind.show(0)) is type(page.value.raw)), None)
    if kind is None or len(text) > kind.digits or (kind is SINGLE and len(text) < kind.digits):
        return page
    other = kind.text(int(text, 16))
    note = f"read as decimal; the listing's hex {text} is {other}: write 0x{text}"
    return replace(page, notes=(*page.notes, note))
