"""A DL06 configuration to its V-memory words."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding, Route
from pidcfg.encoders.mapping import switched_on
from pidcfg.encoders.maps.dl06 import (
    FORMATS,
    LOOP_TABLES,
    RAMP_SOAK_PAIR,
    RAMP_SOAK_PAIRS,
    SETUP_WORDS,
    SPACE,
    TABLE_POINTER,
)
from pidcfg.encoders.scales import Scale
from pidcfg.schemas.base import Quantity, plain_number

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.dl06 import Dl06File, Loop, Plc, RampSoak, Transfer

LOOP_SIZE = LOOP_TABLES[1].size
OUTPUT_OFFSET = LOOP_TABLES[1].offset("output")
Range = tuple[Decimal, Decimal] | None
UNUSED_PAIR = RAMP_SOAK_PAIR.encode({}, {})
STATED = ("reset_decimals", "derivative")
ONE_COUNT = Quantity(Decimal(1), counts=True)


def loop_start(plc: Plc, index: int) -> int:
    """Address of the first word of a loop, counted from 0."""
    return plc.loop_table + index * LOOP_SIZE


def scales_of(loop: Loop) -> dict[str, Scale]:
    """The scales that the registers of a loop are on."""
    return scales(loop.pv.format, loop.output.format, (loop.pv.range, loop.output.range), root=loop.pv.square_root)


def scales(pv_format: str, output_format: str | None, ranges: tuple[Range, Range], *, root: bool) -> dict[str, Scale]:
    """The scales ``pv``, ``sp`` and ``output`` from the formats and the ranges of PV and output."""
    return {
        "pv": Scale(FORMATS[pv_format], ranges[0]),
        "sp": Scale(FORMATS[pv_format], ranges[0], root=root),
        "output": Scale(FORMATS[output_format or pv_format], ranges[1]),
    }


def encode(config: Dl06File) -> Encoding:
    """All words: loop tables, ramp/soak tables, then the set-up words, which win where blocks overlap."""
    blocks = (*_loop_blocks(config), *_ramp_soak_blocks(config), _setup_block(config))
    return Encoding("dl06", blocks, SPACE, _settings(config), _plc_settings(config))


def _loop_blocks(config: Dl06File) -> list[Block]:
    table = LOOP_TABLES[config.plc.reset_decimals]
    return [
        Block(
            ("loops", i),
            loop_start(config.plc, i),
            table,
            table.encode(values_of(config, loop), scales_of(loop)),
            loop.name,
            scales=scales_of(loop),
        )
        for i, loop in enumerate(config.loops)
    ]


def _ramp_soak_blocks(config: Dl06File) -> list[Block]:
    blocks: list[Block] = []
    for i, loop in enumerate(config.loops):
        if loop.ramp_soak is not None and loop.ramp_soak.steps is not None:
            blocks += _ramp_soak_table(i, loop, loop.ramp_soak)
    return blocks


def _ramp_soak_table(i: int, loop: Loop, profile: RampSoak) -> list[Block]:
    scales, steps, pairs = scales_of(loop), profile.steps or (), []
    for j in range(RAMP_SOAK_PAIRS):
        values = dict(steps[j]) if j < len(steps) else {}
        place: Route = ("loops", i, "ramp_soak", "steps", j)
        start = profile.table + j * RAMP_SOAK_PAIR.size
        encoded = RAMP_SOAK_PAIR.encode(values, scales) if values else UNUSED_PAIR
        pairs.append(Block(place, start, RAMP_SOAK_PAIR, encoded, loop.name, f"ramp_soak[{j}].", scales))
    return pairs


def _setup_block(config: Dl06File) -> Block:
    count = config.plc.number_of_loops
    values = {
        "plc.loop_table": config.plc.loop_table,
        "plc.number_of_loops": Decimal(len(config.loops) if count is None else count),
    }
    return Block((), TABLE_POINTER, SETUP_WORDS, SETUP_WORDS.encode(values, {}))


def values_of(config: Dl06File, loop: Loop) -> dict[str, Any]:
    """Every register's value by path, with what follows from what is not given."""
    scales = scales_of(loop)
    return {
        "bumpless": loop.bumpless,
        "action": loop.action,
        "algorithm": loop.algorithm,
        "bias_freeze": loop.bias_freeze,
        "independent_of_cpu_mode": loop.independent_of_cpu_mode,
        "sample_rate": loop.sample_rate,
        "derivative_gain_limit": loop.derivative_gain_limit,
        "derivative_gain_limit_enabled": switched_on(loop.derivative_gain_limit_enabled, loop.derivative_gain_limit),
        "remote_setpoint": remote_setpoint(config, loop),
        **_tuning(loop),
        **_scaled_values(loop, scales),
        **_alarm_values(loop),
        **_ramp_soak_values(loop),
        "autotune.method": loop.autotune.method,
        "autotune.type": loop.autotune.type,
        "autotune.start": loop.autotune.start,
    }


def reset_value(loop: Loop) -> Decimal:
    """The reset time in the unit of its word; 0 when it is off."""
    duration, unit = loop.tuning.reset.duration, loop.tuning.reset_unit
    if duration is None:
        return Decimal(0)
    if duration.unit is None:
        return duration.value
    return duration.seconds() / (60 if unit == "minutes" else 1)


def remote_setpoint(config: Dl06File, loop: Loop) -> int | None:
    """The pointer in +32: the output word of the major loop, or the address that is written."""
    for i, other in enumerate(config.loops):
        if other.name == loop.cascade_from:
            return loop_start(config.plc, i) + OUTPUT_OFFSET
    return loop.remote_setpoint


def _tuning(loop: Loop) -> dict[str, Any]:
    return {
        "tuning.gain": loop.tuning.gain,
        "tuning.reset": reset_value(loop),
        "tuning.reset_unit": loop.tuning.reset_unit,
        "tuning.rate": loop.tuning.rate,
    }


def _scaled_values(loop: Loop, scales: Mapping[str, Scale]) -> dict[str, Any]:
    setpoint_limits = loop.setpoint.limits or ends(scales["sp"])
    output_limits = loop.output.limits or ends(scales["output"])
    return {
        "pv.format": loop.pv.format,
        "pv.square_root": loop.pv.square_root,
        "pv.filter": loop.pv.filter,
        "pv.filter_enabled": switched_on(loop.pv.filter_enabled, loop.pv.filter),
        "pv.transfer": _transfer(loop.pv.transfer),
        "setpoint.value": loop.setpoint.value,
        "setpoint.limits.0": setpoint_limits[0],
        "setpoint.limits.1": setpoint_limits[1],
        "setpoint.limits_enabled": switched_on(loop.setpoint.limits_enabled, loop.setpoint.limits),
        "output.format": loop.output.format,
        "output.limits.0": output_limits[0],
        "output.limits.1": output_limits[1],
        "output.transfer": _transfer(loop.output.transfer),
        "error.curve": loop.error.curve,
        "error.deadband": loop.error.deadband,
        "error.deadband_enabled": switched_on(loop.error.deadband_enabled, loop.error.deadband),
        "state.pv": loop.state.pv,
        "state.bias": loop.state.bias,
        "state.output": loop.state.output,
    }


def ends(scale: Scale) -> tuple[Quantity, Quantity]:
    """The counts at both ends of a scale: what a limit that is not given is encoded as."""
    return Quantity(Decimal(scale.zero), counts=True), Quantity(Decimal(scale.top), counts=True)


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    pv = loop.alarms.pv
    return pv is not None and switched_on(pv.enabled, pv.low_low, pv.low, pv.high, pv.high_high)


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    deviation = loop.alarms.deviation
    return deviation is not None and switched_on(deviation.enabled, deviation.yellow, deviation.red)


def _alarm_values(loop: Loop) -> dict[str, Any]:
    alarms = loop.alarms
    on_pv, on_deviation = pv_alarms_on(loop), deviation_alarms_on(loop)
    rate = alarms.rate_of_change
    hysteresis = alarms.hysteresis
    if hysteresis is None and (on_pv or on_deviation):
        hysteresis = ONE_COUNT
    return {
        **({f"alarms.pv.{k}": v for k, v in dict(alarms.pv).items()} if alarms.pv else {}),
        **({f"alarms.deviation.{k}": v for k, v in dict(alarms.deviation).items()} if alarms.deviation else {}),
        "alarms.pv.enabled": on_pv,
        "alarms.deviation.enabled": on_deviation,
        "alarms.rate_of_change": None if rate is None else rate.per_sample(loop.sample_rate),
        "alarms.rate_of_change_enabled": switched_on(alarms.rate_of_change_enabled, rate),
        "alarms.hysteresis": hysteresis,
    }


def _ramp_soak_values(loop: Loop) -> dict[str, Any]:
    profile = loop.ramp_soak
    if profile is None:
        return {"ramp_soak.enabled": False}
    return {
        "ramp_soak.enabled": profile.enabled,
        "ramp_soak.table": profile.table,
        "ramp_soak.request": profile.request,
    }


def _transfer(transfer: Transfer | None) -> tuple[int, int, int] | int | None:
    if transfer is None or transfer.address is not None:
        return None if transfer is None else transfer.address
    return transfer.base, transfer.slot or 0, transfer.channel or 0


def _settings(config: Dl06File) -> tuple[Mapping[str, Any], ...]:
    """What no register holds, one mapping a loop."""
    return tuple(_loop_settings(loop) for loop in config.loops)


def _loop_settings(loop: Loop) -> dict[str, Any]:
    entry: dict[str, Any] = {"loop": loop.name, "description": loop.description, "mode": loop.mode}
    for key, part in (("pv", loop.pv), ("output", loop.output)):
        scale = {"range": part.range and [plain_number(end) for end in part.range], "unit": part.unit}
        entry[key] = {k: v for k, v in scale.items() if v is not None} or None
    entry["setpoint"] = False if loop.setpoint.value is None else None
    return {k: v for k, v in entry.items() if v is not None}


def _plc_settings(config: Dl06File) -> dict[str, Any]:
    """What no register holds for the whole file; a choice only when the file has made it."""
    plc = {"name": config.name, "description": config.description}
    stated = {key: getattr(config.plc, key) for key in STATED if key in config.plc.model_fields_set}
    return {key: value for key, value in plc.items() if value is not None} | stated
