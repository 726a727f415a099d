"""The blocks of a DL06: V7640 and V7641 say where its loop table is, and each loop where its ramp/soak table is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.areas import Area, AreaError
from pidcfg.encoders.dl06.encode import LOOP_SIZE
from pidcfg.encoders.dl06.status import intended_mode
from pidcfg.encoders.maps.dl06 import (
    CPU,
    LOOP_COUNT,
    LOOP_TABLE,
    LOOP_TABLES,
    RAMP_SOAK_PAIR,
    RAMP_SOAK_PAIRS,
    SETUP_WORDS,
    TABLE_POINTER,
)
from pidcfg.encoders.settings import default_name
from pidcfg.encoders.words import DecodeError, bcd_digits
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.image import Image

MODE_REGISTER = "mode_and_alarm_status"
"""The register that tells a loop's mode."""


def mode_of(raw: int) -> str:
    """The mode that +06 tells; empty: none yet."""
    return intended_mode(raw, "")


def areas(words: Mapping[int, int], like: Image | None, options: Mapping[str, Any]) -> list[Area]:
    """The blocks that are known from the words that have been read; at first the set-up words alone.

    ``like``: the image of a configuration, which says names, and where the table is that the PLC itself does not tell.
    ``options``: those of `decode`. Raises `AreaError` where nothing says where the loops are.
    """
    found = [Area(TABLE_POINTER, SETUP_WORDS)]
    if TABLE_POINTER not in words:
        return found
    start = _start(words, like, options)
    names = [str(entry["loop"]) for entry in like.settings] if like is not None else []
    table = LOOP_TABLES[int(options.get("reset_decimals") or 1)]
    for i in range(_count(words, like, options)):
        name = names[i] if i < len(names) else default_name(i)
        found.append(Area(start + i * LOOP_SIZE, table, name))
        found += _ramp_soak(words.get(start + i * LOOP_SIZE + LOOP_TABLE.offset("ramp_soak_table"), 0), name)
    return found


def _start(words: Mapping[int, int], like: Image | None, options: Mapping[str, Any]) -> int:
    """Where the loop table begins: as an option says, as the PLC says, else as the file says."""
    given = options.get("loop_table")
    start = int(words[TABLE_POINTER] if given is None else given)
    if _in_user_memory(start):
        return start
    if like is not None:
        return like.words[TABLE_POINTER]
    said = f"{v_name(TABLE_POINTER)} holds 0x{start:04X}, which is no place of a loop table"
    raise AreaError(f"{said}; give it with --loop-table", TABLE_POINTER)


def _count(words: Mapping[int, int], like: Image | None, options: Mapping[str, Any]) -> int:
    """How many loops there are, in the same order of who says so."""
    if options.get("number_of_loops") is not None:
        return min(int(options["number_of_loops"]), CPU.loops)
    try:
        count = bcd_digits(words[LOOP_COUNT])
    except DecodeError:
        count = 0
    if 0 < count <= CPU.loops:
        return count
    if like is not None:
        return len(like.settings)
    held = f"{v_name(LOOP_COUNT)} holds 0x{words[LOOP_COUNT]:04X}"
    said = (
        f"{held}, which is no number of loops from 1 to {CPU.loops}"
        if words[LOOP_COUNT]
        else f"{held}: the PLC calculates no loop"
    )
    raise AreaError(f"{said}; --number-of-loops reads the table all the same", LOOP_COUNT)


def _ramp_soak(start: int, loop: str) -> Iterator[Area]:
    """The pairs of a loop's ramp/soak table; none where its pointer names no user memory."""
    size = RAMP_SOAK_PAIR.size
    if start and _in_user_memory(start) and _in_user_memory(start + RAMP_SOAK_PAIRS * size - 1):
        for k in range(RAMP_SOAK_PAIRS):
            yield Area(start + k * size, RAMP_SOAK_PAIR, loop, f"ramp_soak[{k}].")


def _in_user_memory(number: int) -> bool:
    return any(first <= number <= last for first, last in CPU.user)
