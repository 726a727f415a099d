"""Named parameters back to a neutral configuration; defaults are left out, so that encoding it gives the same again."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import file_data
from pidcfg.encoders.maps.generic import LOOP_TABLE, NEEDED, PAIRS, ROWS, split
from pidcfg.encoders.parameters import content_of, unknown_name, value_of
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.generic import Loop, LoopSettings, PlcSettings

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from pidcfg.encoders.parameters import Content
    from pidcfg.schemas.iec import Wire


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,  # noqa: ARG001 - a listing says everything
) -> Decoded:
    """The configuration that these parameters hold; raises `DecodeError` for what is missing or is no value.

    ``words`` have names such as ``TIC-101.tuning.gain``; ``settings`` and ``plc`` are what an encoder put beside them.
    """
    file = read_settings(PlcSettings, plc or {}, "plc")
    entries = list(settings) or [{"loop": name} for name in loop_names(words)]
    if not entries:
        raise DecodeError("the listing holds no parameter of a loop, such as TIC-101.tuning.gain")
    loops = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(entries)]
    names = {loop.loop for loop in loops}
    _check_names(words, names)
    data: Data = {"pidcfg": 1, "vendor": "generic", **present({"name": file.name, "description": file.description})}
    strange = [name for name in loop_names(words) if name not in names]
    notes = tuple(f"{name} is not carried over: the settings do not name it" for name in strange)
    return Decoded({**data, "loops": [_loop(loop, words) for loop in loops]}, notes)


def loop_names(words: Iterable[str]) -> list[str]:
    """The loops that names with a known field speak of, in their order."""
    return list(dict.fromkeys(loop for loop, _ in map(split, words) if loop))


def _check_names(words: Mapping[str, Any], loops: set[str]) -> None:
    """A unknown_name field would leave its default in place."""
    for name in words:
        if split(name)[0]:
            continue
        loop = next((loop for loop in sorted(loops, key=len, reverse=True) if name.startswith(f"{loop}.")), None)
        if loop is not None:
            raise unknown_name(name, name.removeprefix(f"{loop}."), ROWS, "a field of a loop")


def _loop(settings: LoopSettings, words: Mapping[str, Content | Wire]) -> Data:
    values: Data = {"name": settings.loop, "description": settings.description}
    for row in LOOP_TABLE.rows:
        name = f"{settings.loop}.{row.name}"
        if name in words:
            values[row.name] = value_of(content_of(name, row, words[name], "a field of a neutral loop"))
        elif row.name in NEEDED:
            raise DecodeError(f"the listing does not hold {name} ({row.title})")
    for pair in PAIRS:
        _check_ends(pair, values, settings.loop)
    data = file_data(Loop, values)
    link = present(dict(settings.setpoint))
    if link:
        data.setdefault("setpoint", {}).update(link)
    for key in ("pv", "output"):
        data[key] |= present({"unit": getattr(settings, key).unit})
    return data


def _check_ends(pair: str, values: Data, loop: str) -> None:
    """Refuses one end of a pair alone."""
    ends = [f"{pair}.0", f"{pair}.1"]
    missing = [end for end in ends if end not in values]
    if len(missing) == 1:
        raise DecodeError(f"the listing does not hold {loop}.{missing[0]} ({ROWS[missing[0]].title})")
