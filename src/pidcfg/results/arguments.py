"""Arguments of the public calls that make no sense."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping

    from pidcfg.vendors import Vendor

T = TypeVar("T")


class ArgumentError(ValueError):
    """A wrong argument; the message names it, and the choices where there are some."""

    def __init__(self, message: str, *names: str) -> None:
        super().__init__(message)
        self.names = names
        """The arguments, which stand in the message as `name`."""

    def spelled(self, spell: Callable[[str], str]) -> str:
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


def vendor_options(vendor: Vendor, column: str, options: Mapping[str, object]) -> dict[str, Any]:
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


def refuse_below(least: int, **values: int | None) -> None:
    """Raises `ArgumentError` for an argument below a whole number; None is none at all."""
    for name, value in values.items():
        if value is not None and value < least:
            wanted = "above 0" if least == 1 else f"from {least} on"
            raise ArgumentError(f"`{name}` is {value}; write a whole number {wanted}", name)
