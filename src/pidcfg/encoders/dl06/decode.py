"""V-memory words back to a DL06 configuration.

The result is plain data in the order of a hand-written file, with everything left out that is a default, so that
encoding it again gives the same words. What cannot be carried (status flags, requests, reserved bits) is in the notes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.blocks import LoopBlock
from pidcfg.encoders.dl06.encode import LOOP_SIZE, OUTPUT_OFFSET, STATED
from pidcfg.encoders.dl06.loop_reader import LoopReader
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.maps.dl06 import ERROR_FLAGS, LOOP_COUNT, LOOP_TABLES, SPACE, TABLE_POINTER
from pidcfg.encoders.settings import default_name, read_settings
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError, bcd_digits
from pidcfg.schemas.dl06 import LoopSettings, PlcSettings
from pidcfg.schemas.octal import v_name

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration that these words hold.

    ``settings`` and ``plc`` are what an encoder put beside the words. ``options``: ``loop_table`` and
    ``number_of_loops`` for a listing without set-up words, ``reset_decimals``; ``names_only``: the settings are those
    of another image, so that the words say how many loops there are. Raises `DecodeError` naming the address of a word
    that is missing or is no value.
    """
    options = options or {}
    entries = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(settings)]
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    pointer = _option(
        options,
        "loop_table",
        words.get(TABLE_POINTER),
        v_name(TABLE_POINTER),
    )
    count = _count(options, words, entries)
    decimals = int(options.get("reset_decimals") or plc_settings.reset_decimals)
    table = range(pointer, pointer + count * LOOP_SIZE)
    loops = [_reader(words, entries, table, i, decimals) for i in range(count)]
    names = {loop.block.start + OUTPUT_OFFSET: loop.block.loop for loop in loops}
    data: Data = {"pidcfg": 1, "vendor": "dl06"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    stated = {key: getattr(plc_settings, key) for key in STATED if key in plc_settings.model_fields_set}
    if options.get("reset_decimals"):
        stated["reset_decimals"] = decimals
    data["plc"] = _plc_data(pointer, words, count) | stated
    data["loops"] = [loop.data(words, names) for loop in loops]
    notes = [note for loop in loops for note in loop.notes]
    if _is_no_count(words.get(LOOP_COUNT)):
        notes.append(f"{v_name(LOOP_COUNT)} is no BCD number: the PLC sets bit 2 of V7642 and calculates no loop (D53)")
    if "reset_decimals" not in stated and any(loop.block.word("reset") for loop in loops):
        notes.append("the reset words are read with 1 decimal (decision D01); --reset-decimals 2 reads them with two")
    if flags := words.get(ERROR_FLAGS):
        notes.append(f"{v_name(ERROR_FLAGS)} {flags:04X}: the PLC's error flags of the set-up are not carried over")
    return Decoded(data, tuple(notes), (ERROR_FLAGS,))


def _option(options: Mapping[str, Any], key: str, stored: int | None, title: str) -> int:
    value = stored if options.get(key) is None else options[key]
    if value is None:
        raise DecodeError(f"the listing does not hold {title}; give it with --{key.replace('_', '-')}")
    return int(value)


def _count(options: Mapping[str, Any], words: Mapping[int, int], settings: Sequence[LoopSettings]) -> int:
    """How many loops to read; the listing of a set-up that is wrong on purpose says so in its settings."""
    stored = words.get(LOOP_COUNT)
    if options.get("number_of_loops") is not None:
        return int(options["number_of_loops"])
    if settings and (stored is None or not options.get("names_only")):
        return len(settings)
    if _is_no_count(stored):
        cure = "--number-of-loops says how many loops to read"
        raise DecodeError(f"{v_name(LOOP_COUNT)}: 0x{stored:04X} has a digit above 9; {cure}", LOOP_COUNT)
    digits = None if stored is None else bcd_digits(stored)
    return _option(options, "number_of_loops", digits, v_name(LOOP_COUNT))


def _is_no_count(stored: int | None) -> bool:
    """Whether V7641 holds something that is no BCD number."""
    return stored is not None and not f"{stored:04X}".isdecimal()


def _plc_data(pointer: int, words: Mapping[int, int], count: int) -> Data:
    data: Data = {"loop_table": v_name(pointer)}
    stored = words.get(LOOP_COUNT)
    if stored is not None and not _is_no_count(stored) and bcd_digits(stored) != count:
        data["number_of_loops"] = bcd_digits(stored)
    return data


def _reader(
    words: Mapping[int, int], settings: Sequence[LoopSettings], table: range, index: int, decimals: int
) -> LoopReader:
    start = table[index * LOOP_SIZE]
    missing = next((a for a in range(start, start + LOOP_SIZE) if a not in words), None)
    if missing is not None:
        raise DecodeError(f"the listing does not hold {v_name(missing)} of loop {index + 1}")
    loop_settings = settings[index] if index < len(settings) else LoopSettings(loop=default_name(index))
    raw = tuple(words[a] for a in range(start, start + LOOP_SIZE))
    return LoopReader(LoopBlock(loop_settings.loop, SPACE, start, LOOP_TABLES[decimals], raw), loop_settings, table)
