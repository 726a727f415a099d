"""One walk of a register map, both ways: a loop to the values of its registers, and those to the plain data of a file.

A register's path names its field in the schema: ``pv.filter`` is that field, ``pv.range.0`` the lower end of a pair. An
enable bit follows from its value where the file does not give it: ``pv.filter_enabled`` is on when ``pv.filter`` is
given, ``alarms.pv.enabled`` when anything of ``alarms.pv`` is. A value that is not given leaves its register at the
schema's default, else at what the vendor's map says (``unset``), else at 0.

On the way back a field is left out where its register holds just that, and its enable bit, if it has one, is off; the
others stand in the order of the schema, which is that of a hand-written file. What a map cannot say (a pointer that is
a loop's name, a time that is ``off``) is code of the vendor, which changes values on their way.
"""

from __future__ import annotations

from functools import cache
from types import MappingProxyType, UnionType
from typing import TYPE_CHECKING, Any, NamedTuple, Union, get_args, get_origin

from pidcfg.encoders.values import plain, present
from pidcfg.paths import steps, value_at
from pidcfg.schemas.base import Model

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.encoders.values import Data

NOTHING: Mapping[str, Any] = MappingProxyType({})
ENABLED = "enabled"
"""How the key of an enable bit ends."""


class Field(NamedTuple):
    """A field of a model, and the section that it opens, if it does."""

    key: str
    section: type[Model] | None
    required: bool
    default: Any


@cache
def fields(model: type[Model]) -> tuple[Field, ...]:
    """The fields of a model in their order."""
    return tuple(
        Field(key, _section(field.annotation), field.is_required(), None if field.is_required() else field.default)
        for key, field in model.model_fields.items()
    )


def _section(annotation: Any) -> type[Model] | None:
    kinds = get_args(annotation) if get_origin(annotation) in {Union, UnionType} else (annotation,)
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Model)), None)


@cache
def default_of(model: type[Model], path: str) -> Any:
    """What the schema takes for a field that is not given; None where it has no default."""
    section: type[Model] | None = model
    value: Any = None
    for step in steps(path):
        if section is None:
            return None if value is None else value[step]
        field = next(field for field in fields(section) if field.key == step)
        section, value = field.section, field.default
    return value


def values_of(loop: Model, tables: Iterable[RegisterMap], unset: Mapping[str, Any] = NOTHING) -> Data:
    """The value of every register of a loop, by path; None where there is none."""
    return {path: _value(loop, path, unset) for table in tables for path in table.paths()}


def _value(loop: Model, path: str, unset: Mapping[str, Any]) -> Any:
    if path.endswith(ENABLED):
        return is_enabled(loop, path)
    value = value_at(loop, steps(path))
    return _default(type(loop), path, unset) if value is None else value


def _default(model: type[Model], path: str, unset: Mapping[str, Any]) -> Any:
    value = default_of(model, path)
    return unset.get(path) if value is None else value


def switched_on(bit: bool | None, *values: object) -> bool:  # noqa: FBT001 - a bit is what it is about
    """The state of an enable bit: as written, else on when any of its values is given."""
    return any(v is not None for v in values) if bit is None else bit


def is_enabled(loop: Model, path: str) -> bool:
    """The state of an enable bit: as written, else on when its value, or anything of its section, is given."""
    *above, key = steps(path)
    bit = value_at(loop, (*above, key))
    if bit is not None:
        return bool(bit)
    if key != ENABLED:
        return value_at(loop, (*above, str(key).removesuffix(f"_{ENABLED}"))) is not None
    section = value_at(loop, above)
    return section is not None and any(value is not None for value in dict(section).values())


def defaults_of(model: type[Model], tables: Iterable[RegisterMap], unset: Mapping[str, Any] = NOTHING) -> Data:
    """The value of every register by path for a loop whose file gives none."""
    return {path: _default(model, path, unset) for table in tables for path in table.paths()}


def file_data(
    model: type[Model],
    values: Mapping[str, Any],
    unset: Mapping[str, Any] = NOTHING,
    always: frozenset[str] = frozenset(),
    above: str = "",
) -> Data:
    """The section of a file that gives these values, in the order of its schema.

    ``values`` are by path, of registers and of what no register holds. Required fields are always given, and those
    named in ``always``; of the others those that differ from ``unset``, or from the schema's default where that says
    nothing. A section that has a value of its own is not walked; where that is None it is left out.
    """
    data: Data = {}
    for field in fields(model):
        path = above + field.key
        if field.section is not None and path not in values:
            section = file_data(field.section, values, unset, always, f"{path}.")
            data |= {field.key: section} if section else {}
        elif field.key.endswith(ENABLED):
            has_value = data if field.key == ENABLED else field.key.removesuffix(f"_{ENABLED}") in data
            if has_value and not values[path]:
                data[field.key] = False
        elif (
            field.required
            or path in always
            or _switched_on(values, path, above)
            or _differs(field, path, values, unset)
        ):
            data |= present({field.key: plain(_whole(values, path))})
    return data


def _switched_on(values: Mapping[str, Any], path: str, above: str) -> bool:
    """Whether the enable bit of a field, or of all of its section, is on."""
    return bool(values.get(f"{path}_{ENABLED}") or values.get(above + ENABLED))


def _differs(field: Field, path: str, values: Mapping[str, Any], unset: Mapping[str, Any]) -> bool:
    absent = _whole(unset, path)
    return bool(_whole(values, path) != (field.default if absent is None else absent))


def _whole(values: Mapping[str, Any], path: str) -> Any:
    """A value, or both ends of a pair."""
    low, high = f"{path}.0", f"{path}.1"
    return (values[low], values[high]) if low in values else values.get(path)
