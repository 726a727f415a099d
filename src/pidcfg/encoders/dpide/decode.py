"""Operands of DPIDE instructions back to a configuration.

A listing alone tells all but the device of I_MV. Defaults are left out, so that encoding the result again gives the
same operands; PID_EQ and PID_DIR are written whenever the listing has them, since they decide what the gains mean and
on which side the loop acts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import file_data
from pidcfg.encoders.maps.dpide import DPIDE_TABLE, NEEDED, ROWS
from pidcfg.encoders.parameters import content_of, shown, unknown_name, value_of
from pidcfg.encoders.settings import LoopOption, read_settings, settings_values, with_options
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.dpide import Loop, LoopSettings, PlcSettings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.iec import Wire

LOOP_OPTIONS = (LoopOption(("device",), "device", "the device of I_MV (30 registers)"),)
"""What options say when no settings stand beside the operands."""
ALWAYS = frozenset({"PID_EQ", "PID_DIR"})
"""Choices that are written even where they are defaults."""


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration that these operands hold; raises `DecodeError` for what is missing or is no value.

    ``words`` have names such as ``OVEN.SV``; ``settings`` and ``plc`` are what an encoder put beside them. ``options``:
    one list for each row of `LOOP_OPTIONS`, of one entry a loop.
    """
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    entries = list(settings) or [{"loop": name} for name in loop_names(words)]
    if not entries:
        raise DecodeError("the listing holds no operand of a DPIDE instruction, such as OVEN.SV")
    settings_of_loops = [
        read_settings(LoopSettings, entry, f"settings[{i}]")
        for i, entry in enumerate(with_options(entries, options or {}, LOOP_OPTIONS))
    ]
    _check_names(words, {loop.loop for loop in settings_of_loops})
    notes: list[str] = []
    loops = [_loop(loop, words, notes) for loop in settings_of_loops]
    data: Data = {"pidcfg": 1, "vendor": "dpide"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    if plc_settings.interrupt_task is not None:
        data["plc"] = {"interrupt_task": plc_settings.interrupt_task}
    return Decoded({**data, "loops": loops}, tuple(notes))


def split(name: str) -> tuple[str, str]:
    """The loop and the operand of a name: ``("OVEN", "SV")``."""
    loop, _, operand = name.rpartition(".")
    return loop, operand


def loop_names(words: Mapping[str, Any]) -> list[str]:
    """The loops that names with a known operand speak of, in their order."""
    pairs = (split(name) for name in words)
    return list(dict.fromkeys(loop for loop, operand in pairs if loop and operand in ROWS))


def _check_names(words: Mapping[str, Any], loops: set[str]) -> None:
    """A unknown_name operand would leave its default in place, which may be the other direction."""
    for name in words:
        loop, operand = split(name)
        if loop in loops and operand not in ROWS:
            raise unknown_name(name, operand, ROWS, "an operand of DPIDE")


def _loop(settings: LoopSettings, words: Mapping[str, Content | Wire], notes: list[str]) -> Data:
    values = settings_values(settings)
    for row in DPIDE_TABLE.rows:
        name = f"{settings.loop}.{row.name}"
        if name not in words:
            if row.name in NEEDED:
                raise DecodeError(f"the listing does not hold {name} ({row.title})")
            continue
        content = content_of(name, row, words[name], "an operand of DPIDE")
        if row.name in Loop.model_fields:
            values[row.name] = value_of(content)
        elif content:
            notes.append(f"{name} = {shown(row.type, content)} ({row.title}) is not carried over")
    notes += [
        f"{settings.loop}: the listing does not hold {key}, which then is FALSE"
        for key in sorted(ALWAYS)
        if f"{settings.loop}.{key}" not in words
    ]
    return file_data(Loop, values, always=ALWAYS)
