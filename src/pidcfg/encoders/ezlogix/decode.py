"""EZLogix registers and discretes back to a configuration.

A listing alone cannot tell a heating loop from a cooling one: action, algorithm and tags stand beside the registers, or
are demanded. Everything that is a default is left out, so that encoding the result again gives the same registers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.blocks import read_loops
from pidcfg.encoders.ezlogix.encode import scales_of, unset_limits
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import defaults_of, file_data
from pidcfg.encoders.maps.ezlogix import BANKS, BLOCKS, SPACE
from pidcfg.encoders.settings import LoopOption, read_settings, settings_values, with_options
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.ezlogix import Loop, LoopSettings, Plc, PlcSettings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.blocks import LoopBlock

LOOP_OPTIONS = (
    LoopOption(("registers",), "registers", "where the 32 registers begin"),
    LoopOption(("discretes",), "discretes", "where the 8 discretes begin"),
    LoopOption(("action",), "action", "the controller action (direct or reverse), which no register holds"),
    LoopOption(("algorithm",), "algorithm", "the algorithm (position or velocity), which no register holds"),
    LoopOption(("pv", "tag"), "pv_tag", "the tag of the PV"),
    LoopOption(("output", "tag"), "cv_tag", "the tag of the CV"),
    LoopOption(("output", "pulse"), "output_tag", "whether there is a control output", needed=False),
)
"""What options say when no settings stand beside the registers."""
TIMES = ("tuning.integral_time", "tuning.derivative_time")
"""Times of terms that 0 switches off."""
ALWAYS = frozenset({"mode", *TIMES})
"""Fields that are written even where they are defaults."""


def decode(
    words: Mapping[int, int],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration that these registers hold; raises `DecodeError` with the address of what is no value.

    ``settings`` and ``plc`` are what an encoder put beside the registers. ``options``: one list for each row of
    `LOOP_OPTIONS`, of one entry a loop.
    """
    entries = with_options(settings, options or {}, LOOP_OPTIONS)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for loop, (registers, discretes) in read_loops(LoopSettings, entries, words, SPACE, BLOCKS):
        _know_pulses(loop, registers)
        loops.append(_loop(loop, registers, discretes))
        notes += [*registers.left_out(), *discretes.left_out()]
    data: Data = {"pidcfg": 1, "vendor": "ezlogix"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    section = file_data(Plc, dict(plc_settings))
    if not plc:
        notes.append("process_when_stopped is taken as true, the dialog's default; no register holds it")
    return Decoded({**data, **({"plc": section} if section else {}), "loops": loops}, tuple(notes))


def _know_pulses(settings: LoopSettings, registers: LoopBlock) -> None:
    """A cycle time without a word on the control output could be either."""
    if registers.word("cycle_time") and "pulse" not in settings.output.model_fields_set:
        raise DecodeError(
            f"{settings.loop}: {registers.address('cycle_time')} holds a cycle time, but the listing does not say "
            "whether the control output is enabled; give --output-tag (none: it is not)",
            registers.start + registers.table.offset("cycle_time"),
        )


def _loop(settings: LoopSettings, registers: LoopBlock, discretes: LoopBlock) -> Data:
    chosen = discretes.values({})
    scales = scales_of(settings.pv, settings.output, root=chosen["pv.square_root"])
    values = settings_values(settings, BANKS) | chosen | registers.values(scales)
    if settings.output.pulse is None:
        values["output.pulse"] = None
    for path in TIMES:
        values[path] = values[path] or "off"
    unset = registers.table.held(defaults_of(Loop, [registers.table], unset_limits(scales)), scales)
    return file_data(Loop, values, unset, ALWAYS | {"setpoint.value"} if settings.setpoint else ALWAYS)
