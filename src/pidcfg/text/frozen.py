"""Frozen records: what `dataclass(frozen=True, slots=True)` makes, in a quarter of the time.

A command defines sixty such classes before it reads a file. `dataclass` writes and compiles the text of six methods for
each, a tenth of what checking one file takes. Here only ``__init__`` is written; the others are the same functions over
another list of fields. Fields, `dataclasses.replace`, pickling and what type checkers see are those of a data class.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, FrozenInstanceError, dataclass, field, fields
from functools import cached_property
from operator import attrgetter
from types import FunctionType
from typing import Any, NoReturn, TypeVar, dataclass_transform

T = TypeVar("T")
set_field = object.__setattr__


class _Factory:
    """What a signature shows for a value that is made anew for each record."""

    def __repr__(self) -> str:
        return "<factory>"


FACTORY = _Factory()


@dataclass_transform(frozen_default=True, field_specifiers=(field,))
def frozen(cls: type[T], /) -> type[T]:
    """A class of frozen records, with slots unless it has cached properties, which need a dictionary to be kept in.

    Keyword-only fields and orders are left to `dataclass`, and hashes of other fields than those that are compared.
    """
    slots = not any(isinstance(value, cached_property) for value in vars(cls).values())
    record_class = dataclass(init=False, repr=False, eq=False, slots=slots)(cls)
    methods = {
        "__init__": _make_init(record_class),
        "__setattr__": _refuse_set,
        "__delattr__": _refuse_delete,
        **_make_value_methods(record_class),
    }
    if slots:
        methods |= {"__getstate__": _get_state, "__setstate__": _set_state}
    for name, method in methods.items():
        if name not in vars(cls):
            setattr(record_class, name, method)
    return record_class


def _make_init(cls: type) -> FunctionType:
    """The constructor, as `dataclass` writes it."""
    parameters, lines = ["self"], []
    names: dict[str, Any] = {"put_": set_field, "MADE_": FACTORY}
    for f in fields(cls):
        value = name = f.name
        if f.default_factory is not MISSING:
            names[f"{name}__default"] = f.default_factory
            parameters += [f"{name}=MADE_"] if f.init else []
            value = f"{name}__default() if {name} is MADE_ else {name}" if f.init else f"{name}__default()"
        elif f.default is not MISSING:
            names[f"{name}__default"] = f.default
            parameters.append(f"{name}={name}__default")
        else:
            parameters.append(name)
        lines.append(f" put_(self, {name!r}, {value})")
    lines += [" self.__post_init__()"] if hasattr(cls, "__post_init__") else []
    text = f"def __init__({', '.join(parameters)}):\n" + "\n".join(lines or [" pass"])
    exec(text, names)  # noqa: S102 - the names of fields, and nothing from outside
    init: FunctionType = names["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {f.name: f.type for f in fields(cls) if f.init} | {"return": None}
    return init


def _make_value_methods(cls: type) -> dict[str, Callable[..., object]]:
    """How two records are compared, and how one is shown."""
    get_values = _make_getter([f for f in fields(cls) if f.compare])
    shown_names = [f.name for f in fields(cls) if f.repr]

    def equal(self: object, other: object) -> bool:
        return get_values(self) == get_values(other) if other.__class__ is self.__class__ else NotImplemented

    def hash_values(self: object) -> int:
        return hash(get_values(self))

    def repr_text(self: object) -> str:
        return f"{type(self).__qualname__}({', '.join(f'{name}={getattr(self, name)!r}' for name in shown_names)})"

    return {"__eq__": equal, "__hash__": hash_values, "__repr__": repr_text}


def _make_getter(members: list[Field[object]]) -> Callable[[object], object]:
    """What reads some fields of a record at once."""
    return attrgetter(*(f.name for f in members)) if members else lambda _: ()


def _refuse_set(self: object, name: str, value: object) -> NoReturn:
    """A frozen record has no other values than it was made with."""
    del self, value
    raise FrozenInstanceError(f"cannot assign to field {name!r}")


def _refuse_delete(self: object, name: str) -> NoReturn:
    """A frozen record keeps its values."""
    del self
    raise FrozenInstanceError(f"cannot delete field {name!r}")


def _get_state(self: Any) -> list[object]:
    """What is pickled of a record with slots."""
    return [getattr(self, f.name) for f in fields(self)]


def _set_state(self: Any, state: list[object]) -> None:
    """A record as it was pickled."""
    for f, value in zip(fields(self), state, strict=True):
        set_field(self, f.name, value)
