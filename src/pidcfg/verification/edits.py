"""Keys of a configuration changed one by one, until the neutral loop has a wanted value.

Numbers are found by the secant method through the vendor's own `to_neutral`; switches and words by trying each.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from types import NoneType
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from pidcfg.conversion.ledger import ConvertError
from pidcfg.conversion.values import number_of
from pidcfg.encoders.words import DecodeError, EncodeError, nearest
from pidcfg.paths import steps, value_at
from pidcfg.schemas.base import Duration, Quantity
from pidcfg.verification.neutral import neutral_at, neutral_of, same

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.conversion.ledger import NeutralLoop
    from pidcfg.paths import Path
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor

NEAR = Decimal("1e-9")
SHORT = Decimal("1e-6")
"""Of a time constant, what is as good as none."""
CONDITION = "when"
"""The key of it."""
TRIES = 12
"""Steps of the secant method."""
UNFIT = (ArithmeticError, ConvertError, DecodeError, EncodeError, LookupError, TypeError, ValueError)
"""What a value that does not fit its key may raise on the way to the neutral form."""


@dataclass(slots=True)
class Builder:
    """A configuration whose keys are changed one by one."""

    vendor: Vendor
    config: Any
    known: tuple[tuple[Loop | None, ...], list[NeutralLoop]] | None = None

    def _neutral(self) -> tuple[tuple[Loop | None, ...], list[NeutralLoop]]:
        if self.known is None:
            self.known = neutral_of(self.config, self.vendor)
        return self.known

    def loop(self, i: int) -> Loop | None:
        """A loop in the neutral form, as it is now."""
        return self._neutral()[0][i]

    def whole(self, i: int) -> Loop:
        """The same, of a loop that has one."""
        loop = self.loop(i)
        if loop is None:
            raise ValueError(f"loop {i} has no neutral form")
        return loop

    def fields(self, i: int) -> NeutralLoop:
        """What became of the fields of a loop."""
        return self._neutral()[1][i]

    def place(self, i: int, key: str) -> Path | None:
        """Where a key of a loop stands in the file: below the loop, else in the file itself; None: nowhere."""
        path = steps(key)
        if isinstance(self.config.loops[i], BaseModel) and str(path[0]) in type(self.config.loops[i]).model_fields:
            return ("loops", i, *path)
        blocks = [b.name for b in getattr(self.config, "blocks", ())]
        if path[0] == "blocks" and path[1] in blocks:
            return ("blocks", blocks.index(str(path[1])), *path[2:])
        return path if str(path[0]) in type(self.config).model_fields else None

    def _try(self, path: Path, value: Any, i: int, neutral: str) -> Any:
        """The neutral value with another value at a key; the key stays so."""
        self.config, self.known = replaced(self.config, path, value), None
        return neutral_at(self.whole(i), neutral)

    def reset(self, i: int, key: str) -> bool:
        """A key that the target does not have goes back to its default."""
        path = self.place(i, key)
        default: Any = None
        if path is not None and _is_conditional(self.config, path):  # a copy that is never made
            path, default = (*path, CONDITION), False
        elif path is not None:
            default = _default(self.config, path)
        if path is None or default is _NONE:
            return False
        before = self.config
        self.config, self.known = replaced(self.config, path, default), None
        if self._runs(i):
            return True
        self.config, self.known = before, None
        return False

    def _runs(self, i: int) -> bool:
        """Whether the configuration is still one that can be encoded."""
        try:
            return self.loop(i) is not None and self.vendor.encoder(self.config) is not None
        except UNFIT:
            return False

    def bring(self, i: int, key: str, neutral: str, wanted: Any) -> bool:
        """Changes a key until the neutral field has a value; says whether it could be."""
        path, before = self.place(i, key), self.config
        if path is None:
            return False
        try:
            if self._bring(i, path, neutral, wanted):
                return True
        except UNFIT:
            pass
        self.config, self.known = before, None
        return False

    def _bring(self, i: int, path: Path, neutral: str, wanted: Any) -> bool:
        present, number = value_at(self.config, path), number_of(wanted)
        for choice in _choices(self.config, path, present):
            if same(self._try(path, choice, i, neutral), wanted):
                return True
        typed = typed_number(present)
        if number is None or typed is None:
            return False
        return self._secant(i, path, neutral, number, present, typed)

    def _secant(self, i: int, path: Path, neutral: str, wanted: Decimal, present: Any, x0: Decimal) -> bool:
        y0 = number_of(self._try(path, present, i, neutral))
        if y0 is None:
            return False
        whole = isinstance(present, Quantity) and present.counts
        if not wanted and neutral.endswith("filter"):  # a filter block wants a time, however short
            self._try(path, with_number(present, x0 * SHORT), i, neutral)
            return True
        x1 = x0 * wanted / y0 if y0 and x0 else x0 + (wanted - y0)
        for _ in range(TRIES):
            y1 = number_of(self._try(path, with_number(present, x1), i, neutral))
            if y1 is None:
                return False
            if abs(y1 - wanted) <= NEAR * max(abs(wanted), Decimal(1)):
                if whole:  # a word in counts holds the nearest one
                    self._try(path, with_number(present, Decimal(nearest(x1))), i, neutral)
                return True
            if y1 == y0:
                return False
            x0, x1, y0 = x1, x1 + (wanted - y1) * (x1 - x0) / (y1 - y0), y1
        return False


class _Nothing:
    """No default."""


_NONE = _Nothing()


def _is_conditional(config: Any, path: Path) -> bool:
    """Whether an entry of a list is carried out under a condition."""
    entry = value_at(config, path)
    listed = isinstance(path[-1], int) and isinstance(entry, BaseModel)
    return listed and CONDITION in type(entry).model_fields


def _default(config: Any, path: Path) -> Any:
    owner = value_at(config, path[:-1])
    if not isinstance(owner, BaseModel) or str(path[-1]) not in type(owner).model_fields:
        return _NONE
    row = type(owner).model_fields[str(path[-1])]
    return _NONE if row.is_required() else row.get_default(call_default_factory=True)


def _choices(config: Any, path: Path, present: Any) -> Iterator[Any]:
    """Other values that a key can have, where they can be counted: switches, words, and the default."""
    if isinstance(present, bool):
        yield not present
    owner = value_at(config, path[:-1])
    if isinstance(owner, BaseModel) and str(path[-1]) in type(owner).model_fields:
        for word in _words(type(owner).model_fields[str(path[-1])].annotation):
            if word != present:
                yield word
        default = _default(config, path)
        if default is not _NONE and default != present:
            yield default


def _words(annotation: Any) -> Iterator[Any]:
    for argument in get_args(annotation):
        if isinstance(argument, str):
            yield argument
        elif argument is not NoneType:
            yield from _words(argument)


def typed_number(value: Any) -> Decimal | None:
    """The number in a value, in the unit that it is written in."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, Quantity | Duration) or hasattr(value, "per"):
        return Decimal(value.value)
    if hasattr(value, "duration"):
        return typed_number(value.duration)
    return Decimal(str(value)) if isinstance(value, int | float | Decimal) else None


def with_number(value: Any, number: Decimal) -> Any:
    """A value of the same kind with another number."""
    if isinstance(value, Quantity):
        return Quantity(number, value.counts, derived=True)
    if hasattr(value, "duration"):
        return value._replace(duration=with_number(value.duration, number))
    if hasattr(value, "_replace"):
        return value._replace(value=number)
    if isinstance(value, int) and number == number.to_integral_value():
        return int(number)
    return number


def replaced(model: Any, path: Path, value: Any) -> Any:
    """A model with another value at a path."""
    if not path:
        return value
    step, below = path[0], path[1:]
    if isinstance(model, BaseModel):
        return model.model_copy(update={str(step): replaced(getattr(model, str(step)), below, value)})
    if isinstance(model, tuple) and isinstance(step, int):
        items = list(model)
        items[step] = replaced(items[step], below, value)
        return tuple(items) if type(model) is tuple else type(model)(*items)
    raise KeyError(step)
