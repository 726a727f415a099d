"""Arguments of the public calls: their types, by annotations, and those that make no sense."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from decimal import Context, Decimal, localcontext
from functools import cache, wraps
from inspect import signature
from numbers import Real
from pathlib import Path
from reprlib import repr as shorten
from typing import TYPE_CHECKING, ParamSpec, TypeGuard, TypeVar

from pidcfg.text.reader import Files, Limits, source_data
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Collection
    from inspect import Signature

    from pidcfg.text.paths import Data
    from pidcfg.vendors import Vendor

# --- Arguments of the public calls that make no sense -----------------------------------------------------------------

T = TypeVar("T")


class ArgumentError(ValueError):
    """A wrong argument; the message names it, and the choices where there are some."""

    def __init__(self, message: str, *names: str) -> None:
        super().__init__(message)
        self.names = names
        """The arguments, which stand in the message as `name`."""

    def with_names(self, spell: Callable[[str], str]) -> str:
        """The message with other names for the arguments, such as the options of the command line."""
        message = str(self)
        for name in self.names:
            message = message.replace(f"`{name}`", spell(name))
        return message


class OptionError(ArgumentError):
    """A value of a vendor's own option that cannot be read."""

    def __init__(self, remark: str, name: str) -> None:
        super().__init__(f"`{name}`: {remark}", name)
        self.remark = remark
        """The message without the option."""


def refuse_unknown(name: str, value: object, choices: Collection[str]) -> None:
    """Raises `ArgumentError` for a value that is none of the choices."""
    if value not in choices:
        raise ArgumentError(f"`{name}` is {value!r}; it is one of {', '.join(choices)}", name)


def vendor_named(key: str, name: str = "vendor") -> Vendor:
    """The PLC family with this key; raises `ArgumentError`."""
    refuse_unknown(name, key, VENDORS)
    return VENDORS[key]


def vendor_options(vendor: Vendor, column: str, options: Mapping[str, object]) -> Data:
    """The vendor's own options (the ``column`` of its row) as values; what is None was not given.

    Texts are read as the command line reads them. Raises `ArgumentError` for an option of another vendor, `OptionError`
    for a value that makes no sense.
    """
    rows = {row.key: row for row in vendor.load(column)}
    values = {}
    for key, value in options.items():
        if value is None:
            continue
        if key not in rows:
            raise ArgumentError(f"`{key}` is not for {vendor.title}", key)
        values[key] = rows[key].read(str(value))
        if values[key] is None:
            raise OptionError(f"{str(value)!r}; write it like {rows[key].example}", key)
    return values


def check_minimum(minimum: int, **values: int | None) -> None:
    """Raises `ArgumentError` for an argument below a whole number; None is none at all."""
    for name, value in values.items():
        if value is not None and value < minimum:
            range_text = "above 0" if minimum == 1 else f"from {minimum} on"
            raise ArgumentError(f"`{name}` is {value}; write a whole number {range_text}", name)


# ----------------------------------------------------------------------------------------------------------------------
# What the public calls take, by the annotations of their parameters: another type is refused before anything runs.
# `ANNOTATION_KINDS` has a row for every annotation; ``| None`` at its end is no part of it.

OPTIONAL_SUFFIX = " | None"
PAIR_LENGTH = 2
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


def is_integer(value: object) -> bool:
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


def is_sink_or_flag(value: object) -> bool:
    """What can be written to, or whether to keep it."""
    return is_flag(value) or is_sink(value)


def is_result(value: object) -> bool:
    """What a call has returned."""
    return hasattr(value, "findings")


def is_source(value: object) -> bool:
    """A file, or the document of another result."""
    from pidcfg.text.document import Document

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
    return lambda value: is_list(value) and len(value) == PAIR_LENGTH and all(is_kind(part) for part in value)


def one_or_list_of(is_kind: Kind) -> Kind:
    """One of a kind, or any number of it."""
    return lambda value: is_kind(value) or list_of(is_kind)(value)


def is_source_map(value: object) -> bool:
    """Files by whole numbers."""
    return isinstance(value, Mapping) and all(is_integer(key) and is_source(one) for key, one in value.items())


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


TEXT_KIND, DATA_KIND = "a text", "a pathlib.Path, str or bytes"
# fmt: off
ANNOTATION_KINDS: Mapping[str, tuple[Kind, str]] = {
    "str":                           (is_text,                     TEXT_KIND),
    "Form":                          (is_text,                     TEXT_KIND),
    "Model":                         (is_text,                     TEXT_KIND),
    "EngineName":                    (is_text,                     TEXT_KIND),
    "bool":                          (is_flag,                     "True or False"),
    "int":                           (is_integer,                  "a whole number"),
    "float":                         (is_number,                   "a number"),
    "Source":                        (is_source,                   f"{DATA_KIND}, or the document of a result"),
    "Path | str | bytes":            (is_data,                     DATA_KIND),
    "Path | str | bytes | Sequence[Path | str | bytes]":
                                     (one_or_list_of(is_data),     f"{DATA_KIND}, or a list of them"),
    "str | Sequence[str]":           (one_or_list_of(is_text),     "a text, or a list of texts"),
    "Sequence[str]":                 (list_of(is_text),            "a list of texts"),
    "tuple[str | None, str | None]": (pair_of(is_optional_text),   "two texts, or None for one without a name"),
    "tuple[float, float]":           (pair_of(is_number),          "two numbers"),
    "Mapping[str, object]":          (is_mapping,                  "a mapping"),
    "Mapping[int, Source]":          (is_source_map,               f"a mapping of whole numbers to {DATA_KIND}"),
    "Files":                         (is_files,                    "texts by their names, or a reader"),
    "Limits":                        (is_limits,                   "a pidcfg.text.reader.Limits"),
    "Sink":                          (is_sink,                     "an open text stream"),
    "Sink | bool":                   (is_sink_or_flag,             "an open text stream, or True to keep the trend"),
    "Result":                        (is_result,                   "a result of simulate, certify, diff or convert"),
    "PictureFormat":                 (is_text,                     TEXT_KIND),
    "Callable[[float], None]":       (callable,                    "a function"),
    "Callable[[bytes], None]":       (callable,                    "a function"),
    "Callable[[str], None]":         (callable,                    "a function"),
    "Callable[[float, Mapping[str, str]], None]":
                                     (callable,                    "a function"),
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
    call_signature = signature_of(call)
    for name, value in call_signature.bind(*args, **kwargs).arguments.items():
        parameter = call_signature.parameters[name]
        annotation = str(parameter.annotation)
        if value is None and annotation.endswith(OPTIONAL_SUFFIX):
            continue
        is_kind, expected = ANNOTATION_KINDS[annotation.removesuffix(OPTIONAL_SUFFIX)]
        for argument in value if parameter.kind is parameter.VAR_POSITIONAL else (value,):
            if not is_kind(argument):
                raise ArgumentTypeError(f"`{name}` is {shorten(argument)}; give {expected}", name)


# --- Several files of a call ------------------------------------------------------------------------------------------


def files_of(
    source: Path | str | bytes | Sequence[Path | str | bytes],
    name: str | Sequence[str] | None,
    files: Files,
    limits: Limits,
) -> list[tuple[bytes, str]]:
    """One or several files, each its bytes and its name; raises `ArgumentError` where names and files do not agree."""
    source = bytes(source) if isinstance(source, bytearray | memoryview) else source
    sources = source if isinstance(source, Sequence) and not isinstance(source, str | bytes) else [source]
    names = [name] * len(sources) if name is None or isinstance(name, str) else list(name)
    if not sources or len(names) != len(sources):
        raise ArgumentError("`source` and `name` are lists of the same length, and not empty", "source", "name")
    max_bytes = limits.listing_bytes + 1
    return [source_data(one, label, files, max_bytes) for one, label in zip(sources, names, strict=True)]


# --- What every public call does first: it refuses arguments of other types, and sets decimals as it needs them -------

P = ParamSpec("P")
R = TypeVar("R")
DECIMAL_CONTEXT = Context()
"""How the calls calculate, whatever the caller has set: 28 digits, half to even."""


def check_arguments(call: Callable[P, R]) -> Callable[P, R]:
    """Arguments are of their types; the rounding of decimals is not that of the caller's thread, nor left there."""

    @wraps(call)
    def in_context(*args: P.args, **kwargs: P.kwargs) -> R:
        refuse_types(call, args, kwargs)
        with localcontext(DECIMAL_CONTEXT):
            return call(*args, **kwargs)

    return in_context
