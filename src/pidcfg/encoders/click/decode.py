"""CLICK registers back to a configuration.

The result is plain data in the order of a hand-written file, with everything left out that is a default, so that
encoding it again gives the same registers. What cannot be carried is in the notes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.maps.click import BLOCKS, SPACE, UNUSED
from pidcfg.encoders.plain import Data, Said, completed, present, quantity, read_loops, read_settings
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import decimal_text, plain_number
from pidcfg.schemas.click import Autotune, Loop, LoopSettings, PlcSettings, State

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from decimal import Decimal

    from pidcfg.encoders.plain import LoopBlock

SAID = (
    Said(("bits",), "bits", "where the C bits begin"),
    Said(("integers",), "integers", "where the DS registers begin"),
    Said(("floats",), "floats", "where the DF registers begin"),
    Said(("output", "pwm"), "pwm_bit", "whether the output is pulsed (PWM), which no register holds"),
)
"""What options say when nothing stands beside the registers."""
CHOICES = ("bumpless", "freeze_bias")


def unnamed(index: int) -> str:
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
    beside = completed(settings, options or {}, SAID, unnamed)
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    loops, notes = [], []
    for own, blocks in read_loops(LoopSettings, beside, words, SPACE, BLOCKS):
        loops.append(_loop(own, blocks))
        notes += [note for block in blocks for note in block.left_out()]
    data: Data = {"pidcfg": 1, "vendor": "click"}
    data |= present({"name": plc_settings.name, "description": plc_settings.description})
    return Decoded({**data, "loops": loops}, tuple(notes))


def _loop(own: LoopSettings, blocks: Sequence[LoopBlock]) -> Data:
    values: Data = {}
    for block in blocks:
        values |= block.values({})
    data: Data = {"name": own.loop, **present({"description": own.description})}
    data |= {key: f"{prefix}{getattr(own, key)}" for key, (prefix, _) in BLOCKS.items()}
    data["mode"] = own.mode
    data["action"] = values["action"]
    if own.action_verified:
        data["action_verified"] = True
    data["sample_rate"] = f"{decimal_text(values['sample_rate'].scaleb(3))} ms"
    data |= {key: values[key] for key in CHOICES if values[key] != Loop.model_fields[key].default}
    data["tuning"] = {
        key: quantity(values[f"tuning.{key}"]) for key in ("proportional_gain", "reset_time", "derivative_gain")
    }
    limit = valued(values, "derivative_gain_limit")
    data |= {key: int(value) if key == "derivative_gain_limit" else value for key, value in limit.items()}
    sections = {
        "pv": _pv(own, values, blocks[-1]),
        "setpoint": _setpoint(values, meant=own.setpoint),
        "output": _output(own, values),
        "error": _error(values),
        "alarms": _alarms(values),
        "autotune": _autotune(values),
        "state": {k: quantity(values[f"state.{k}"]) for k in State.model_fields if values[f"state.{k}"]},
    }
    return data | {key: section for key, section in sections.items() if section}


def valued(values: Data, path: str) -> Data:
    """A value with its enable bit: left out when it is unused, with ``…_enabled: false`` when only the bit is off."""
    key = path.rpartition(".")[2]
    on, value = values[f"{path}_enabled"], values[path]
    if on:
        return {key: quantity(value)}
    unused: Decimal | int = UNUSED.get(path, 0)
    return {} if value == unused else {key: quantity(value), f"{key}_enabled": False}


def _pv(own: LoopSettings, values: Data, floats: LoopBlock) -> Data:
    low, high = values["pv.range.0"], values["pv.range.1"]
    if low >= high:
        ends = {"pv_lower": low, "pv_upper": high}
        shown = ", ".join(f"{floats.address(name)} = {quantity(end)}" for name, end in ends.items())
        raise DecodeError(
            f"{own.loop}: the PV's lower limit is not below its upper one ({shown})",
            floats.start + floats.table.offset("pv_lower"),
        )
    data: Data = {"range": [plain_number(low), plain_number(high)]}
    data |= present({"input_range": own.pv.input_range and [plain_number(end) for end in own.pv.input_range]})
    data |= present({"unit": own.pv.unit})
    return data | valued(values, "pv.filter")


def _setpoint(values: Data, *, meant: bool) -> Data:
    value = values["setpoint.value"]
    data: Data = {"value": quantity(value)} if meant or value else {}
    return data | valued(values, "setpoint.lower_limit") | valued(values, "setpoint.upper_limit")


def _output(own: LoopSettings, values: Data) -> Data:
    limits = values["output.limits.0"], values["output.limits.1"]
    data: Data = {} if limits == Loop.model_fields["output"].default.limits else {"limits": [*map(quantity, limits)]}
    data |= present({"unit": own.output.unit})
    if own.output.pwm is not None:
        data["pwm"] = {"bit": own.output.pwm.bit, "period": quantity(values["output.pwm.period"])}
    return data


def _error(values: Data) -> Data:
    curve = values["error.curve"]
    return ({} if curve == "linear" else {"curve": curve}) | valued(values, "error.deadband")


def _alarms(values: Data) -> Data:
    groups = {
        "pv": _group(values, "alarms.pv", ("low_low", "low", "high", "high_high")),
        "deviation": _group(values, "alarms.deviation", ("high", "high_high")),
    }
    data: Data = {key: group for key, group in groups.items() if group}
    data |= valued(values, "alarms.rate_of_change")
    if values["alarms.hysteresis"]:
        data["hysteresis"] = quantity(values["alarms.hysteresis"])
    return data


def _group(values: Data, path: str, keys: tuple[str, ...]) -> Data:
    """Alarms that share an enable bit: all of them when it is on, the stored ones and ``enabled: false`` if not."""
    on = values[f"{path}.enabled"]
    data: Data = {key: quantity(values[f"{path}.{key}"]) for key in keys if on or values[f"{path}.{key}"]}
    return data if on or not data else {**data, "enabled": False}


def _autotune(values: Data) -> Data:
    found = {key: values[f"autotune.{key}"] for key in Autotune.model_fields}
    differ = {key: value for key, value in found.items() if value != Autotune.model_fields[key].default}
    return {key: value if isinstance(value, str) else quantity(value) for key, value in differ.items()}
