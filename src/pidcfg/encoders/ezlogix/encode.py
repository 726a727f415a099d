"""An EZLogix configuration to its registers and discretes."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding
from pidcfg.encoders.maps.ezlogix import BLOCKS, CV, SPACE, counts_format
from pidcfg.encoders.scales import Scale
from pidcfg.encoders.values import present
from pidcfg.schemas.base import Quantity, plain_number
from pidcfg.schemas.ezlogix import CV_FULL, Plc

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.schemas.ezlogix import EzlogixFile, Loop, OutputSettings, PvSettings
    from pidcfg.schemas.ezlogix import Output as OutputSection
    from pidcfg.schemas.ezlogix import Pv as PvSection


def encode(config: EzlogixFile) -> Encoding:
    """Both blocks of every loop; what the PLC itself writes, and the request to tune, are 0."""
    blocks = tuple(block for i, loop in enumerate(config.loops) for block in _blocks(i, loop))
    return Encoding("ezlogix", blocks, SPACE, tuple(_settings(loop) for loop in config.loops), _plc_settings(config))


def _blocks(i: int, loop: Loop) -> Iterator[Block]:
    scales = scales_of(loop.pv, loop.output, root=loop.pv.square_root)
    values = values_of(loop, scales)
    for key, (prefix, table) in BLOCKS.items():
        start = SPACE.number(prefix, getattr(loop, key))
        yield Block(("loops", i), start, table, table.encode(values, scales), loop.name, scales=scales)


def scales_of(pv: PvSection | PvSettings, output: OutputSection | OutputSettings, *, root: bool) -> dict[str, Scale]:
    """The scales ``pv``, ``sp`` and ``output`` of a loop's registers; ``root``: it extracts the root of its PV."""
    form = counts_format(*(pv.counts or (0, CV_FULL)))
    return {"pv": Scale(form, pv.range), "sp": Scale(form, pv.range, root=root), "output": Scale(CV, output.range)}


def ends(scale: Scale) -> tuple[Quantity, Quantity]:
    """The counts at both ends of a scale: what a limit that is not given is encoded as."""
    return Quantity(Decimal(scale.zero), counts=True), Quantity(Decimal(scale.top), counts=True)


def values_of(loop: Loop, scales: Mapping[str, Scale]) -> dict[str, Any]:
    """Every register's value by path."""
    low, high = loop.setpoint.limits or ends(scales["sp"])
    pulse = {} if loop.output.pulse is None else dict(loop.output.pulse)
    return {
        "mode": loop.mode,
        "sample_rate": loop.sample_rate,
        **{f"tuning.{key}": value for key, value in dict(loop.tuning).items()},
        "setpoint.value": loop.setpoint.value,
        "setpoint.limits.0": low,
        "setpoint.limits.1": high,
        "deadband": loop.deadband,
        "output.limits.0": loop.output.limits[0],
        "output.limits.1": loop.output.limits[1],
        "output.offset": loop.output.offset,
        **{f"output.pulse.{key}": value for key, value in pulse.items() if key != "tag"},
        "anti_windup": loop.anti_windup,
        "pv.square_root": loop.pv.square_root,
        **{f"autotune.{key}": value for key, value in dict(loop.autotune).items()},
    }


def _settings(loop: Loop) -> Mapping[str, Any]:
    """What the dialog alone holds; ``pulse`` always, since its absence says that the control output is not enabled."""
    pulse = loop.output.pulse
    entry = {
        "loop": loop.name,
        "description": loop.description,
        **{key: f"{prefix}{getattr(loop, key)}" for key, (prefix, _) in BLOCKS.items()},
        "algorithm": loop.algorithm,
        "action": loop.action,
        "pv": {"tag": loop.pv.tag, **_scaling(loop.pv), **present({"counts": loop.pv.counts and [*loop.pv.counts]})},
        "output": {
            "tag": loop.output.tag,
            **_scaling(loop.output),
            "pulse": None if pulse is None else {"tag": pulse.tag},
        },
        "setpoint": False if loop.setpoint.value is None else None,
    }
    return present(entry)


def _scaling(part: PvSection | OutputSection) -> dict[str, Any]:
    return present({"range": part.range and [plain_number(end) for end in part.range], "unit": part.unit})


def _plc_settings(config: EzlogixFile) -> dict[str, Any]:
    """What no register holds for the whole file; that the PLC goes on when it is stopped, always."""
    names = config.plc.tag_names
    return present(
        {
            "name": config.name,
            "description": config.description,
            "process_when_stopped": config.plc.process_when_stopped,
            "tag_names": None if names == Plc.model_fields["tag_names"].default else names,
        }
    )
