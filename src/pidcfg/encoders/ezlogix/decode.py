"""EZLogix registers and discretes back to a configuration.

A listing alone cannot tell a heating loop from a cooling one: action, algorithm and tags stand beside the registers, or
are demanded. Everything that is a default is left out, so that encoding the result again gives the same registers.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.blocks import read_loops
from pidcfg.encoders.ezlogix.encode import ends, scales_of
from pidcfg.encoders.image import Decoded
from pidcfg.encoders.maps.ezlogix import BLOCKS, SPACE
from pidcfg.encoders.settings import LoopOption, read_settings, with_options
from pidcfg.encoders.values import Data, present, quantity
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import plain_number
from pidcfg.schemas.ezlogix import Autotune, LoopSettings, PlcSettings

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.blocks import LoopBlock
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.ezlogix import OutputSettings, PvSettings

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
    beside = with_options(settings, options or {}, LOOP_OPTIONS)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for own, blocks in read_loops(LoopSettings, beside, words, SPACE, BLOCKS):
        _know_pulses(own, blocks[0])
        loops.append(_loop(own, blocks))
        notes += [note for block in blocks for note in block.left_out()]
    data: Data = {"pidcfg": 1, "vendor": "ezlogix"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    own_plc = {
        k: getattr(plc_settings, k)
        for k, f in PlcSettings.model_fields.items()
        if k not in data and f.default != getattr(plc_settings, k)
    }
    if not plc:
        notes.append("process_when_stopped is taken as true, the dialog's default; no register holds it")
    return Decoded({**data, **({"plc": own_plc} if own_plc else {}), "loops": loops}, tuple(notes))


def _know_pulses(own: LoopSettings, registers: LoopBlock) -> None:
    """A cycle time without a word on the control output could be either."""
    if registers.word("cycle_time") and "pulse" not in own.output.model_fields_set:
        raise DecodeError(
            f"{own.loop}: {registers.address('cycle_time')} holds a cycle time, but the listing does not say whether "
            "the control output is enabled; give --output-tag (none: it is not)",
            registers.start + registers.table.offset("cycle_time"),
        )


def _loop(own: LoopSettings, blocks: Sequence[LoopBlock]) -> Data:
    registers, discretes = blocks
    values = discretes.values({})
    scales = scales_of(own.pv, own.output, root=values["pv.square_root"])
    values |= registers.values(scales)
    data: Data = {"name": own.loop, **present({"description": own.description})}
    data |= {key: f"{prefix}{getattr(own, key)}" for key, (prefix, _) in BLOCKS.items()}
    data |= {"mode": values["mode"], "algorithm": own.algorithm, "action": own.action}
    data["sample_rate"] = quantity(values["sample_rate"])
    data["tuning"] = _tuning(values)
    data["pv"] = {"tag": own.pv.tag, **_scaling(own.pv), **present({"counts": own.pv.counts and [*own.pv.counts]})}
    if values["pv.square_root"]:
        data["pv"]["square_root"] = True
    data |= {"setpoint": setpoint} if (setpoint := _setpoint(own, values, scales["sp"], registers)) else {}
    data["output"] = _output(own, values, scales["output"], registers)
    if registers.word("deadband"):
        data["deadband"] = quantity(values["deadband"])
    if not values["anti_windup"]:
        data["anti_windup"] = False
    autotune = {key: values[f"autotune.{key}"] for key in Autotune.model_fields}
    differ = {key: value for key, value in autotune.items() if value != Autotune.model_fields[key].default}
    return data | (
        {"autotune": {k: v if isinstance(v, str) else quantity(v) for k, v in differ.items()}} if differ else {}
    )


def _tuning(values: Data) -> Data:
    data: Data = {"proportional_gain": quantity(values["tuning.proportional_gain"])}
    for key in ("integral_time", "derivative_time"):
        data[key] = quantity(values[f"tuning.{key}"]) if values[f"tuning.{key}"] else "off"
    return data


def _scaling(part: PvSettings | OutputSettings) -> Data:
    return present({"range": part.range and [plain_number(end) for end in part.range], "unit": part.unit})


def _setpoint(own: LoopSettings, values: Data, scale: Scale, registers: LoopBlock) -> Data:
    data: Data = {"value": quantity(values["setpoint.value"])} if own.setpoint or registers.word("setpoint") else {}
    return data | _limits(values, "setpoint", scale, registers)


def _limits(values: Data, part: str, scale: Scale, registers: LoopBlock) -> Data:
    """Both limits, unless they are what limits that are not given are encoded as."""
    prefix = "cv" if part == "output" else part
    low, high = (int(end.value) for end in ends(scale))
    if (registers.word(f"{prefix}_low"), registers.word(f"{prefix}_high")) == (low, high):
        return {}
    return {"limits": [quantity(values[f"{part}.limits.{i}"]) for i in range(2)]}


def _output(own: LoopSettings, values: Data, scale: Scale, registers: LoopBlock) -> Data:
    data: Data = {"tag": own.output.tag, **_scaling(own.output), **_limits(values, "output", scale, registers)}
    if registers.word("cv_offset"):
        data["offset"] = quantity(values["output.offset"])
    if own.output.pulse is not None:
        data["pulse"] = {"tag": own.output.pulse.tag, "cycle_time": quantity(values["output.pulse.cycle_time"])}
        times = {key: values[f"output.pulse.{key}"] for key in ("min_on", "min_off")}
        data["pulse"] |= {key: quantity(time) for key, time in times.items() if time}
    return data
