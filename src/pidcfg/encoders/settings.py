"""What no register holds of a loop and stands beside the registers in a listing, or is said by options."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from pidcfg.encoders.mapping import NOTHING, fields
from pidcfg.encoders.values import plain
from pidcfg.encoders.words import DecodeError
from pidcfg.paths import dotted, given_fields, has_key, put, value_at
from pidcfg.schemas.base import Model

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from pidcfg.encoders.values import Data

S = TypeVar("S", bound=BaseModel)


class RefusedError(DecodeError):
    """Settings that a schema refuses: ``where`` they stand, and the ``path`` in them of what is wrong."""

    def __init__(self, message: str, where: str, path: Sequence[str | int]) -> None:
        super().__init__(message)
        self.where = where
        self.path = tuple(path)


def default_name(index: int) -> str:
    """What a loop is called whose listing does not say its name, counted from 0."""
    return f"LOOP-{index + 1}"


def read_settings(model: type[S], entry: Mapping[str, Any], place: str) -> S:
    """Settings from beside the words, as strictly as from a file; raises `RefusedError`."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        raise RefusedError(f"{place}: {dotted(first['loc'])}: {first['msg']}", place, first["loc"]) from None


class LoopOption(NamedTuple):
    """An option for what a listing may lack, one text a loop: the key in the settings, the option, what it says."""

    path: tuple[str, ...]
    option: str
    title: str
    needed: bool = True


def with_options(
    settings: Sequence[Mapping[str, Any]],
    options: Mapping[str, Any],
    rows: Sequence[LoopOption],
    name: Callable[[int], str] = default_name,
) -> list[dict[str, Any]]:
    """The settings of each loop with what options say; what neither says and is needed is asked for.

    The number of loops is that of the settings, or of the longest option; an option that is shorter than that speaks
    of no loop in particular, and is refused unless it says one thing for all.
    """
    count = len(settings) or max((len(options.get(row.option) or ()) for row in rows), default=0)
    loops = [deepcopy(dict(settings[i])) if settings else {"loop": name(i)} for i in range(count)]
    for row in rows:
        texts = options.get(row.option)
        if texts is not None and len(texts) not in {1, count}:
            flag = row.option.replace("_", "-")
            raise DecodeError(f"--{flag} names {len(texts)} for {count} loops; give one for each, with commas between")
        for i, loop in enumerate(loops):
            if texts is not None:
                put(loop, row.path, texts[0] if len(texts) == 1 else texts[i])
    if not loops:
        raise _missing(rows[0], "")
    for loop in loops:
        for row in rows:
            if row.needed and not has_key(loop, row.path):
                raise _missing(row, f" of {loop.get('loop', 'a loop')}")
    return loops


def _missing(row: LoopOption, whose: str) -> DecodeError:
    what, comma, why = row.title.partition(", ")
    return DecodeError(f"the listing does not say {what}{whose}{comma}{why}; give --{row.option.replace('_', '-')}")


def settings_of(
    model: type[Model], loop: Any, banks: Mapping[str, str] = NOTHING, explicit: frozenset[str] = frozenset()
) -> Data:
    """What no register of a loop holds: the fields that ``model`` has of it, as far as they are given.

    ``banks``: prefixes of the addresses at which its blocks begin; ``explicit``: fields whose absence says something.
    """
    entry = {"loop": loop.name, **_settings(model, loop, explicit, "")}
    return entry | {key: f"{prefix}{entry[key]}" for key, prefix in banks.items()}


def _settings(model: type[Model], part: Any, explicit: frozenset[str], above: str) -> Data:
    data: Data = {}
    for field in fields(model):
        path, value = above + field.key, getattr(part, field.key, None)
        if field.section is not None and value is not None:
            value = _settings(field.section, value, explicit, f"{path}.") or None
        elif isinstance(value, Model):  # a switch for a section: false where the file leaves its value to the operator
            value = False if value_at(value, ("value",)) is None else None
        is_default = value is None or (isinstance(value, bool) and value == field.default)
        if path in explicit or not is_default:
            data[field.key] = plain(value)
    return data


def settings_values(settings: Any, banks: Mapping[str, str] = NOTHING) -> Data:
    """What stands beside the registers of a loop as values of its fields, by path."""
    values = {dotted(path): value for path, value in given_fields(settings)}
    del values["loop"]
    values.pop("setpoint", None)
    return {"name": settings.loop, **values, **{key: f"{prefix}{values[key]}" for key, prefix in banks.items()}}
