"""How adapters fill a neutral loop and a target's loop, saying of each field what it became."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import count as counter
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import Missing, Neutral, Put, Said
from pidcfg.conversion.pipeline import ConvertError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from pydantic import BaseModel

    from pidcfg.paths import Path
    from pidcfg.schemas.addresses import BankRange


def given(model: BaseModel | None, *path: str) -> bool:
    """Whether the file gives a field, by its path below a model."""
    item: Any = model
    for key in path:
        if item is None or key not in item.model_fields_set:
            return False
        item = getattr(item, key)
    return item is not None


def set_at(data: dict[str, Any], path: str, value: Any) -> None:
    """Sets a value below sections, which are made as needed."""
    *sections, last = path.split(".")
    for key in sections:
        data = data.setdefault(key, {})
    data[last] = value


@dataclass(slots=True)
class Teller:
    """Fills a neutral loop from a vendor's; ``place`` is where that loop stands in its file."""

    place: Path
    neutral: Neutral = field(default_factory=lambda: Neutral({}))

    def keep(self, path: str, value: Any, to: str, became: Any, note: str = "", *, assumed: bool = False) -> None:
        """A field of the source and the neutral field that it became."""
        set_at(self.neutral.loop, to, became)
        self.say(path, value, to, note=note, assumed=assumed)

    def say(self, path: str, value: Any, *to: str, note: str = "", assumed: bool = False) -> None:
        """A field of the source and the neutral fields that it is part of, which are set elsewhere."""
        self.neutral.said.append(Said(path, value, to, note, assumed))

    def lose(self, path: str, value: Any, note: str) -> None:
        """A field that the neutral form does not have, and what to program instead."""
        self.neutral.said.append(Said(path, value, note=note))

    def miss(self, path: str, message: str) -> None:
        """What the source must say first."""
        route = tuple(path.split("."))
        self.neutral.missing.append(Missing((*self.place, *route), route[-1], message))


@dataclass(slots=True)
class Builder:
    """Fills a loop of the target."""

    data: dict[str, Any] = field(default_factory=dict)
    puts: list[Put] = field(default_factory=list)

    def put(self, path: str, value: Any, of: str | None, note: str = "", **how: Any) -> None:
        """A field of the target, and the neutral field that it came from; None: chosen here. ``how``: see `Put`."""
        set_at(self.data, path, value)
        self.puts.append(Put(path, of, note, **how))

    def mark(self, path: str, of: str, note: str = "", **how: Any) -> None:
        """A field that is set otherwise carries this neutral field too."""
        self.puts.append(Put(path, of, note, **how))

    def drop(self, of: str, note: str) -> None:
        """A neutral field that the target does not have, and what to program instead."""
        self.puts.append(Put("", of, note))


def starts(bank: BankRange, size: int, count: int, wanted: Sequence[str]) -> list[int]:
    """Where the blocks of each loop begin: as wanted, the others behind the last one without overlapping any."""
    _not_too_many(wanted, count)
    found = [bank.parse(address) for address in wanted]
    start = found[-1] + size if found else bank.first
    while len(found) < count:
        clash = next((other for other in found if abs(other - start) < size), None)
        if clash is None:
            found.append(start)
        start = (start if clash is None else clash) + size
    top = max(found, default=bank.first)
    if top + size - 1 > bank.last:
        raise _unplaced(f"{size} addresses from {bank.prefix}{top} on do not end by {bank.prefix}{bank.last}")
    return found


def chosen(wanted: Sequence[str | None], count: int, free: Callable[[int], str]) -> list[str]:
    """One name a loop: as wanted, the others the first that are free, counted from 1."""
    _not_too_many(wanted, count)
    unused = (name for n in counter(1) if (name := free(n)) not in wanted)
    given_names = [*wanted, *[None] * (count - len(wanted))]
    return [next(unused) if name is None else name for name in given_names]


def _not_too_many(wanted: Sequence[str | None], count: int) -> None:
    if len(wanted) > count:
        raise _unplaced(f"{', '.join(str(name) for name in wanted)}: that is {len(wanted)} for {count} of the loops")


def _unplaced(message: str) -> ConvertError:
    return ConvertError([Missing(("loops",), "loops", message)])
