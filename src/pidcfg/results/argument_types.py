"""What the public calls take, by the annotations of their parameters: another type is refused before anything runs.

`KINDS` has a row for every annotation; ``| None`` at its end is no part of it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from functools import cache
from inspect import signature
from numbers import Real
from pathlib import Path
from reprlib import repr as short
from typing import TYPE_CHECKING, TypeGuard

from pidcfg.limits import Limits
from pidcfg.results.arguments import ArgumentError

if TYPE_CHECKING:
    from inspect import Signature

OPTIONAL = " | None"
PAIR = 2
Kind = Callable[[object], bool]
"""Whether a value is of a kind."""


class ArgumentTypeError(ArgumentError, TypeError):
    """An argument of another type than the call takes; it names the argument, its value and what is wanted."""


def is_text(value: object) -> bool:
    """A text."""
    return isinstance(value, str)


def is_bytes(value: object) -> bool:
    """What a file holds."""
    return isinstance(value, bytes)


def is_data(value: object) -> bool:
    """A file by its path, or its content."""
    return isinstance(value, Path | str | bytes | bytearray | memoryview)


def is_flag(value: object) -> bool:
    """True or false."""
    return isinstance(value, bool)


def is_whole(value: object) -> bool:
    """A whole number; true and false are none."""
    return isinstance(value, int) and not isinstance(value, bool)


def is_mapping(value: object) -> bool:
    """Values by keys."""
    return isinstance(value, Mapping)


def is_limits(value: object) -> bool:
    """Limits on untrusted input."""
    return isinstance(value, Limits)


def is_sink(value: object) -> bool:
    """What can be written to."""
    return callable(getattr(value, "write", None))


def is_source(value: object) -> bool:
    """A file, or the document of another result."""
    from pidcfg.document import Document

    return is_data(value) or isinstance(value, Document)


def is_number(value: object) -> bool:
    """A number; true and false are none."""
    return isinstance(value, Real | Decimal) and not isinstance(value, bool)


def is_list(value: object) -> TypeGuard[Sequence[object]]:
    """Several things; a text is not its letters."""
    return isinstance(value, Sequence) and not isinstance(value, str | bytes | bytearray | memoryview)


def list_of(is_kind: Kind) -> Kind:
    """Any number of a kind."""
    return lambda value: is_list(value) and all(is_kind(part) for part in value)


def pair_of(is_kind: Kind) -> Kind:
    """Two of a kind."""
    return lambda value: is_list(value) and len(value) == PAIR and all(is_kind(part) for part in value)


def one_or_list_of(is_kind: Kind) -> Kind:
    """One of a kind, or any number of it."""
    return lambda value: is_kind(value) or list_of(is_kind)(value)


def is_optional_text(value: object) -> bool:
    """A text, or nothing."""
    return value is None or isinstance(value, str)


def is_files(value: object) -> bool:
    """Texts by their names, or what reads files."""
    if isinstance(value, Mapping):
        return all(
            isinstance(name, str) and is_data(text) and not isinstance(text, Path) for name, text in value.items()
        )
    return value is None or (callable(getattr(value, "read", None)) and callable(getattr(value, "resolve", None)))


TEXT, DATA = "a text", "a pathlib.Path, str or bytes"
# fmt: off
KINDS: Mapping[str, tuple[Kind, str]] = {
    "str":                           (is_text,                     TEXT),
    "Form":                          (is_text,                     TEXT),
    "Model":                         (is_text,                     TEXT),
    "EngineName":                    (is_text,                     TEXT),
    "bool":                          (is_flag,                     "True or False"),
    "int":                           (is_whole,                    "a whole number"),
    "float":                         (is_number,                   "a number"),
    "Source":                        (is_source,                   f"{DATA}, or the document of a result"),
    "Path | str | bytes":            (is_data,                     DATA),
    "Path | str | bytes | Sequence[Path | str | bytes]":
                                     (one_or_list_of(is_data),     f"{DATA}, or a list of them"),
    "str | Sequence[str]":           (one_or_list_of(is_text),     "a text, or a list of texts"),
    "Sequence[str]":                 (list_of(is_text),            "a list of texts"),
    "tuple[str | None, str | None]": (pair_of(is_optional_text),   "two texts, or None for one without a name"),
    "tuple[float, float]":           (pair_of(is_number),          "two numbers"),
    "Mapping[str, object]":          (is_mapping,                  "a mapping"),
    "Files":                         (is_files,                    "texts by their names, or a reader"),
    "Limits":                        (is_limits,                   "a pidcfg.limits.Limits"),
    "Sink":                          (is_sink,                     "an open text stream"),
    "Callable[[float], None]":       (callable,                    "a function"),
    "Callable[[bytes], None]":       (callable,                    "a function"),
    "Callable[[str], None]":         (callable,                    "a function"),
    "bytes":                         (is_bytes,                    "bytes"),
}
# fmt: on
"""Whether a value is one, and what is wanted, by the annotation."""


@cache
def signature_of(call: Callable[..., object]) -> Signature:
    """The parameters of a call."""
    return signature(call)


def refuse_types(call: Callable[..., object], args: tuple[object, ...], kwargs: Mapping[str, object]) -> None:
    """Raises `ArgumentTypeError` for an argument of another type; one too many or too few is Python's own error."""
    described = signature_of(call)
    for name, value in described.bind(*args, **kwargs).arguments.items():
        parameter = described.parameters[name]
        annotation = str(parameter.annotation)
        if value is None and annotation.endswith(OPTIONAL):
            continue
        is_kind, wanted = KINDS[annotation.removesuffix(OPTIONAL)]
        for one in value if parameter.kind is parameter.VAR_POSITIONAL else (value,):
            if not is_kind(one):
                raise ArgumentTypeError(f"`{name}` is {short(one)}; give {wanted}", name)
