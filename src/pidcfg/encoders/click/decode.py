"""CLICK registers back to a configuration.

The result is plain data in the order of a hand-written file, with everything left out that is a default, so that
encoding it again gives the same registers. What cannot be carried is in the notes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.blocks import read_loops
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import defaults_of, file_data
from pidcfg.encoders.maps.click import BANKS, BLOCKS, SPACE, UNUSED
from pidcfg.encoders.settings import LoopOption, read_settings, settings_values, with_options
from pidcfg.encoders.values import Data, present
from pidcfg.schemas.click import Loop, LoopSettings, PlcSettings
from pidcfg.schemas.numbers import decimal_text

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.blocks import LoopBlock

LOOP_OPTIONS = (
    LoopOption(("bits",), "bits", "where the C bits begin"),
    LoopOption(("integers",), "integers", "where the DS registers begin"),
    LoopOption(("floats",), "floats", "where the DF registers begin"),
    LoopOption(("output", "pwm"), "pwm_bit", "whether the output is pulsed (PWM), which no register holds"),
)
"""What options say when no settings stand beside the registers."""
ALWAYS = frozenset({"mode", "tuning.derivative_gain", "output.pwm.period"})
"""Fields that are written even where they are defaults."""


def default_name(index: int) -> str:
    """What a loop is called whose listing does not say its name: a name that nicknames can be made of."""
    return f"LOOP{index + 1}"


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration that these registers hold; raises `DecodeError` with the address of what is no value.

    ``settings`` and ``plc`` are what an encoder put beside the registers. ``options``: ``bits``, ``integers``,
    ``floats`` and ``pwm_bit``, each a list of one entry a loop.
    """
    entries = with_options(settings, options or {}, LOOP_OPTIONS, default_name)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for loop, blocks in read_loops(LoopSettings, entries, words, SPACE, BLOCKS):
        loops.append(_loop(loop, blocks))
        notes += [note for block in blocks for note in block.left_out()]
    data: Data = {"pidcfg": 1, "vendor": "click"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    return Decoded({**data, "loops": loops}, tuple(notes))


def _loop(settings: LoopSettings, blocks: Sequence[LoopBlock]) -> Data:
    values = settings_values(settings, BANKS) | {"mode": settings.mode}
    unset: Data = {}
    for block in blocks:
        values |= block.values({})
        unset |= block.table.held(defaults_of(Loop, [block.table], UNUSED), {})
    if settings.output.pwm is None:
        values["output.pwm"] = None
    values["sample_rate"] = f"{decimal_text(values['sample_rate'].scaleb(3))} ms"
    return file_data(Loop, values, unset, ALWAYS | {"setpoint.value"} if settings.setpoint else ALWAYS)
