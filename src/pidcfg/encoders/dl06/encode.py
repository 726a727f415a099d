"""A DL06 configuration to its V-memory words."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.mapping import is_enabled
from pidcfg.encoders.mapping import values_of as mapped
from pidcfg.encoders.maps.dl06 import (
    FORMATS,
    LOOP_TABLES,
    RAMP_SOAK_PAIR,
    RAMP_SOAK_PAIRS,
    RESET,
    SETUP_WORDS,
    SPACE,
    TABLE_POINTER,
)
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.settings import settings_of
from pidcfg.encoders.values import present
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.dl06 import LoopSettings

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.encoders.values import Data
    from pidcfg.paths import Path
    from pidcfg.schemas.dl06 import Dl06File, Loop, Plc, RampSoak, Transfer

TABLE = (LOOP_TABLES[1],)
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
    settings = tuple(settings_of(LoopSettings, loop) for loop in config.loops)
    return Encoding("dl06", blocks, SPACE, settings, _plc_settings(config))


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
        place: Path = ("loops", i, "ramp_soak", "steps", j)
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


def values_of(config: Dl06File, loop: Loop) -> Data:
    """Every register's value by path, with what follows from what is not given."""
    rate = loop.alarms.rate_of_change
    values = mapped(loop, TABLE, unset_values(loop))
    return values | {
        "tuning.reset": table_reset(config, loop),
        "remote_setpoint": remote_setpoint(config, loop),
        "pv.transfer": _transfer(loop.pv.transfer),
        "output.transfer": _transfer(loop.output.transfer),
        "alarms.rate_of_change": None if rate is None else rate.per_sample(loop.sample_rate),
    }


def unset_values(loop: Loop) -> Data:
    """What follows for words whose values are not given: the hysteresis of alarms that are on."""
    on = pv_alarms_on(loop) or deviation_alarms_on(loop)
    return unset_limits(scales_of(loop)) | ({"alarms.hysteresis": ONE_COUNT} if on else {})


def unset_limits(scales: Mapping[str, Scale]) -> Data:
    """The limits of a set point and an output that have none: the ends of their scales."""
    parts = {"setpoint": scales["sp"], "output": scales["output"]}
    return {f"{part}.limits.{i}": end for part, scale in parts.items() for i, end in enumerate(scale.ends)}


def pv_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the four PV alarms is set."""
    return is_enabled(loop, "alarms.pv.enabled")


def deviation_alarms_on(loop: Loop) -> bool:
    """Whether the bit of the two deviation alarms is set."""
    return is_enabled(loop, "alarms.deviation.enabled")


def table_reset(config: Dl06File, loop: Loop) -> Decimal:
    """The reset time that its word holds: one of the two codes when it is off."""
    return RESET[config.plc.reset_decimals].high if loop.tuning.reset.nines else reset_value(loop)


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


def _transfer(transfer: Transfer | None) -> tuple[int, int, int] | int | None:
    if transfer is None or transfer.address is not None:
        return None if transfer is None else transfer.address
    return transfer.base, transfer.slot or 0, transfer.channel or 0


def _plc_settings(config: Dl06File) -> dict[str, Any]:
    """What no register holds for the whole file; a choice only when the file has made it."""
    stated = {key: getattr(config.plc, key) for key in STATED if key in config.plc.model_fields_set}
    return present({"name": config.name, "description": config.description}) | stated
