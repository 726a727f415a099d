"""A NextoPID program back to a configuration.

Which block a name is of stands beside the parameters, in the settings or in the declarations of a program. Everything
that is a default is left out, so that encoding the result again gives the same program.
"""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pydantic import ConfigDict

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import file_data
from pidcfg.encoders.maps.nextopid import BLOCK_TYPES, LOOP_TYPES
from pidcfg.encoders.nextopid.moves import entry_of
from pidcfg.encoders.parameters import read
from pidcfg.encoders.settings import RefusedError, read_settings
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError
from pidcfg.paths import put, steps
from pidcfg.schemas.base import Integer, Model, Seconds, Text
from pidcfg.schemas.common import SectionSettings
from pidcfg.schemas.iec import Identifier, Wire
from pidcfg.schemas.map_file import MapFile
from pidcfg.schemas.nextopid import Move, OutputText, Plc, PvText
from pidcfg.schemas.numbers import plain_number

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.encoders.maps.nextopid import BlockType
    from pidcfg.encoders.parameters import Content


REQUIRED = "required"


class ItemSettings(Model):
    """What stands beside the parameters of one block."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    loop: Identifier | None = None
    """Name of a controller."""
    block: Identifier | None = None
    """Name of another block or function."""
    type: str
    """Its type."""
    description: Text | None = None
    """What it does."""
    sample_time: Seconds | None = None
    """Interval of a loop's calls in s."""
    cycles: Integer | None = None
    """The same in cycles of the task, where a program does not say how long they are."""
    pv: PvText = PvText()
    """Unit of the PV."""
    output: OutputText = OutputText()
    """Scale and unit of the output."""

    @property
    def name(self) -> str:
        """Its name."""
        return self.loop or self.block or ""


class PlcSettings(SectionSettings):
    """What stands beside the parameters for the whole file."""

    sample_time: Seconds | None = None
    """Interval of the task in s."""
    program: Identifier = "PidLoops"
    """Name of the program."""
    moves: tuple[Move, ...] = ()
    """What the program copies."""
    map: MapFile | None = None
    """Modbus map."""


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
) -> Decoded:
    """The configuration of these parameters; raises `DecodeError` with the name of what is no value.

    ``options``: ``sample_time``, the interval of the task in s, where the listing does not say it.
    """
    plc_settings = read_settings(PlcSettings, plc or {}, "plc")
    time = (options or {}).get("sample_time") or plc_settings.sample_time
    if not settings:
        raise DecodeError(f"the program declares no block of the library ({', '.join(sorted(LOOP_TYPES))}, …)")
    if time is None:
        raise DecodeError("the listing does not say the interval of the task; give --sample-time")
    data: Data = {"pidcfg": 1, "vendor": "nextopid", **present({"name": plc_settings.name})}
    data |= present({"description": plc_settings.description})
    data["plc"] = {"sample_time": plain_number(Decimal(time))}
    if plc_settings.program != Plc.model_fields["program"].default:
        data["plc"]["program"] = plc_settings.program
    data["plc"] |= present({"map": plc_settings.map})
    signals = {name: _signal(content) for name, content in words.items() if "." not in name}
    data |= {"signals": signals} if signals else {}
    items = [read_item(entry, i) for i, entry in enumerate(settings)]
    for key in ("blocks", "loops"):
        entries = [_item(item, words, Decimal(time)) for item in items if (item.loop is None) == (key == "blocks")]
        data |= {key: entries} if entries or key == "loops" else {}
    if plc_settings.moves:
        data["moves"] = [entry_of(move) for move in plc_settings.moves]
    return Decoded(data)


def read_item(entry: Mapping[str, Any], number: int) -> ItemSettings:
    """The settings of a block, whose type the library must have."""
    item = read_settings(ItemSettings, entry, f"settings[{number}]")
    if (item.loop is None) == (item.block is None):
        raise DecodeError(f"settings[{number}]: either 'loop' or 'block' names it")
    kind = BLOCK_TYPES.get(item.type)
    if kind is None or (item.loop is not None and kind.name not in LOOP_TYPES):
        message = f"{item.name}: {item.type!r} is no {'controller' if item.loop else 'block'} of the library"
        raise RefusedError(message, f"settings[{number}]", ("type",))
    return item


def _item(item: ItemSettings, words: Mapping[str, Content | Wire], task: Decimal) -> Data:
    kind = BLOCK_TYPES[item.type]
    data: Data = {"name": item.name, "type": item.type, **present({"description": item.description})}
    interval = item.sample_time if item.cycles is None else item.cycles * task
    if interval is not None:
        data["sample_time"] = plain_number(interval)
    for row in kind.inputs:
        content = words.get(f"{item.name}.{row.name}")
        if content is None and _kept(kind, row.name) == REQUIRED:
            raise DecodeError(f"the listing does not hold {item.name}.{row.name}")
        if content is not None and not isinstance(content, Wire) and read(row.type, content) is None:
            raise DecodeError(f"{item.name}.{row.name}: {content!r} is not a value of {row.type.name}")
        if content is not None and (_kept(kind, row.name) or content != row.type.default):
            text = str(content).removeprefix("AUTOTUNE_") if row.type.kind == "word" else _plain(content)
            put(data, steps(row.name), text)
    sections = {"pv": file_data(PvText, dict(item.pv)), "output": file_data(OutputText, dict(item.output))}
    return data | {key: section for key, section in sections.items() if section}


def _kept(kind: BlockType, name: str) -> str:
    """Why a parameter is written although it is 0: it is required, or without it something else is meant."""
    field = kind.model.model_fields.get(name)
    if field is None or field.default is None:
        return "given"
    return REQUIRED if field.is_required() else ""


def _signal(content: Content | Wire) -> bool | int | float | str:
    """The first value of a signal as the file writes it, with its type where a number would be a REAL."""
    if isinstance(content, int) and not isinstance(content, bool):
        return f"INT#{content}"
    return content if isinstance(content, str) else _plain(content)


def _plain(content: Content | Wire) -> bool | int | float | str:
    """A content as the file writes it."""
    if isinstance(content, Wire):
        return content.text
    return content if isinstance(content, bool) else plain_number(Decimal(repr(content)))
