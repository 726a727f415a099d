"""Devices of operands that the configuration places but gives no content, and second registers of words."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.explanation.parameter_texts import Placed

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.explanation.find_parameter import NamedBook
    from pidcfg.explanation.page import Page
    from pidcfg.explanation.question import Asked, Thing

WORD = re.compile(r"D([0-9]{1,6})")
"""A word's device: it and the register behind it."""


def device_pages(book: NamedBook, thing: Thing, asked: Asked) -> Iterator[Page]:
    """An operand by a register of its device, or by its name behind the loop's, in every loop."""
    if asked.config is None:
        return
    for i, own in enumerate(asked.config.settings):
        for operand, device in (own.get("devices") or {}).items():
            named = f"{own['loop']}.{operand}".lower() == thing.name.lower()
            register = 0 if named else _register(device, thing.name.upper())
            if register is not None:
                yield _page(book, thing, asked, (i, own, operand, device, register))


def _page(book: NamedBook, thing: Thing, asked: Asked, found: tuple[int, Mapping[str, Any], str, str, int]) -> Page:
    i, own, operand, device, register = found
    loop = str(own["loop"])
    table, row = next((t, r) for t in book.tables.values() for r in t.rows if r.name == operand)
    units = asked.config.units(loop) if asked.config is not None else {}
    value = None if register else thing.value
    origin = asked.config.origin(("loops", i, "devices", operand), loop) if asked.config is not None else None
    page = book.page(row, (table.title,), value, Placed(table, row, None, units))
    return replace(
        page,
        name=f"{loop}.{operand}",
        loop=loop,
        place=f"{device} of {loop}" + (f"; {thing.name.upper()} is its second register" if register else ""),
        origins=(origin,) if origin else (),
    )


def _register(device: str, asked: str) -> int | None:
    """Which register of a device was asked for: 0, or 1 for the second of a word; None for neither."""
    first, wanted = WORD.fullmatch(device), WORD.fullmatch(asked)
    if first is None or wanted is None:
        return 0 if device == asked else None
    register = int(wanted.group(1)) - int(first.group(1))
    return register if register in {0, 1} else None
