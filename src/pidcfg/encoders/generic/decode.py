"""Named parameters back to a neutral configuration; defaults are left out, so that encoding it gives the same again."""

from __future__ import annotations

from decimal import Decimal
from typing import TYPE_CHECKING, Any, get_args

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.maps.generic import LOOP_TABLE, NEEDED, PAIRS, ROWS, split
from pidcfg.encoders.named import read
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.values import Data, present
from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import Flag, Model, Name, Text, plain_number
from pidcfg.schemas.generic import Loop
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.names import nearest

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from pidcfg.encoders.named import Content, Parameter

SHOWN = 60


class Unit(Model):
    """A unit that stands beside the parameters."""

    unit: Text | None = None
    """Engineering unit."""


class Link(Model):
    """Where the set point comes from, which stands beside the parameters."""

    source: Name | None = None
    """Name of the loop whose output is the set point."""
    follows_pv: Flag | None = None
    """Whether the set point follows the PV in manual."""


class LoopSettings(Model):
    """What no parameter of a loop holds."""

    loop: Name
    """Name of the loop."""
    description: Text | None = None
    """What the loop does."""
    pv: Unit = Unit()
    """Of the PV."""
    output: Unit = Unit()
    """Of the output."""
    setpoint: Link = Link()
    """Where the set point comes from."""


class FileSettings(Model):
    """What no parameter of the file holds."""

    name: Text | None = None
    """Name of the machine or plant section."""
    description: Text | None = None
    """Anything worth knowing."""


def decode(
    words: Mapping[str, Content | Wire],
    settings: Sequence[Mapping[str, Any]] = (),
    plc: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,  # noqa: ARG001 - a listing says everything
) -> Decoded:
    """The configuration that these parameters hold; raises `DecodeError` for what is missing or is no value.

    ``words`` have names such as ``TIC-101.tuning.gain``; ``settings`` and ``plc`` are what an encoder put beside them.
    """
    file = read_settings(FileSettings, plc or {}, "plc")
    entries = list(settings) or [{"loop": name} for name in loop_names(words)]
    if not entries:
        raise DecodeError("the listing holds no parameter of a loop, such as TIC-101.tuning.gain")
    own = [read_settings(LoopSettings, entry, f"settings[{i}]") for i, entry in enumerate(entries)]
    _know_all(words, {loop.loop for loop in own})
    data: Data = {"pidcfg": 1, "vendor": "generic", **present({"name": file.name, "description": file.description})}
    strange = [name for name in loop_names(words) if name not in {loop.loop for loop in own}]
    notes = tuple(f"{name} is not carried over: the settings do not name it" for name in strange)
    return Decoded({**data, "loops": [_loop(loop, words) for loop in own]}, notes)


def loop_names(words: Iterable[str]) -> list[str]:
    """The loops that names with a known field speak of, in their order."""
    return list(dict.fromkeys(loop for loop, _ in map(split, words) if loop))


def _know_all(words: Mapping[str, Any], loops: set[str]) -> None:
    """A misspelt field would leave its default in place."""
    for name in words:
        if split(name)[0]:
            continue
        loop = next((loop for loop in sorted(loops, key=len, reverse=True) if name.startswith(f"{loop}.")), None)
        if loop is not None:
            path = name.removeprefix(f"{loop}.")
            near = nearest(path, ROWS)
            cure = f"; did you mean {near}?" if near else ""
            raise DecodeError(f"{name[:SHOWN]}: {path[:SHOWN]!r} is not a field of a loop{cure}", name)


def _loop(own: LoopSettings, words: Mapping[str, Content | Wire]) -> Data:
    data: Data = {"name": own.loop, **present({"description": own.description})}
    for row in LOOP_TABLE.rows:
        name = f"{own.loop}.{row.name}"
        if name not in words:
            if row.name in NEEDED:
                raise DecodeError(f"the listing does not hold {name} ({row.title})")
            continue
        content = _content(name, row, words[name])
        if content != _default(row.name):
            _put(data, row.name, content)
    for key in PAIRS:
        _whole(data, own.loop, key)
    link = present(dict(own.setpoint))
    if link:
        data.setdefault("setpoint", {}).update(link)
    for key in ("pv", "output"):
        data[key] |= present({"unit": getattr(own, key).unit})
    return data


def _default(path: str) -> Any:
    """What a field is when it is not given; None: it has no default."""
    model: Any = Loop
    steps = path.split(".")
    for step in steps[:-1]:
        if step.isdigit() or step not in getattr(model, "model_fields", ()):
            return None
        kinds = (model.model_fields[step].annotation, *get_args(model.model_fields[step].annotation))
        model = next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Model)), None)
    field = getattr(model, "model_fields", {}).get(steps[-1])
    return None if field is None or field.is_required() else field.default


def _put(data: Data, path: str, content: Content) -> None:
    value = plain_number(Decimal(repr(content))) if type(content) in {int, float} else content
    keys = path.split(".")
    for key in keys[:-1]:
        data = data.setdefault(key, {})
    data[keys[-1]] = value


def _whole(data: Data, loop: str, key: str) -> None:
    """Makes a pair of its two ends; one alone is refused."""
    section, name = key.split(".")
    ends = data.get(section, {}).get(name)
    if ends is None:
        return
    if sorted(ends) != ["0", "1"]:
        missing = "1" if "0" in ends else "0"
        raise DecodeError(f"the listing does not hold {loop}.{key}.{missing} ({ROWS[f'{key}.{missing}'].title})")
    data[section][name] = [ends["0"], ends["1"]]


def _content(name: str, row: Parameter, raw: Content | Wire) -> Content:
    if isinstance(raw, Wire):
        raise DecodeError(f"{name} is an expression; a field of a neutral loop is a value", name)
    content = read(row.type, raw)
    if content is None:
        raise DecodeError(f"{name}: {raw!r} is not a value of {row.type.name}", name)
    return content
