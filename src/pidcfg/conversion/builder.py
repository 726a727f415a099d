"""How a conversion fills a neutral loop and a target's file, recording what each field became."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from itertools import count as counter
from typing import TYPE_CHECKING, Any, NoReturn

from pidcfg.conversion.arithmetic import number
from pidcfg.conversion.ledger import ConvertError, Missing, NeutralLoop, SourceField, TargetField, TargetFile
from pidcfg.encoders.values import present
from pidcfg.paths import put, steps

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from pydantic import BaseModel

    from pidcfg.conversion.same import Same
    from pidcfg.schemas.addresses import BankRange
    from pidcfg.schemas.generic import GenericFile


@dataclass(slots=True)
class NeutralBuilder:
    """Fills a neutral loop from a vendor's: the one at ``index`` of its file."""

    index: int
    loop: NeutralLoop = field(default_factory=NeutralLoop)

    def put(self, path: str, value: Any, to: str, became: Any, note: str = "", *, assumed: bool = False) -> None:
        """A field of the source with its value, and the neutral field with what it became."""
        self.set(to, became)
        self.mark(path, value, to, note=note, assumed=assumed)

    def same(self, row: Same, value: Any) -> None:
        """A field that keeps its value."""
        self.put(row.path, value, row.to or row.path, row.becomes(value), row.note)

    def set(self, to: str, value: Any) -> None:
        """A neutral field alone; the fields of the source that it comes from are marked."""
        put(self.loop.data, steps(to), value)

    def mark(self, path: str, value: Any, *to: str, note: str = "", assumed: bool = False) -> None:
        """A field of the source that is part of neutral fields which are set elsewhere."""
        self.loop.fields.append(SourceField(path, value, to, note, assumed))

    def drop(self, path: str, value: Any, note: str) -> None:
        """A field that the neutral form does not have, and what to program instead."""
        self.loop.fields.append(SourceField(path, value, note=note))

    def drop_choices(self, path: str, section: BaseModel, note: str) -> None:
        """The fields of a section that are not at their defaults."""
        for key, row in type(section).model_fields.items():
            value = getattr(section, key)
            if value != row.default:
                self.drop(f"{path}.{key}", value, note)

    def need(self, path: str, message: str) -> None:
        """What the source must say first, by its path below the loop; empty: the loop."""
        self.loop.missing.append(Missing(("loops", self.index, *steps(path)), message))


@dataclass(slots=True)
class TargetBuilder:
    """Fills a loop of the target: the one at ``index`` of its file."""

    index: int = 0
    data: dict[str, Any] = field(default_factory=dict)
    fields: list[TargetField] = field(default_factory=list)

    def put(self, path: str, value: Any, of: str | None, note: str = "", **details: Any) -> None:
        """A field of the target, and the neutral field that it came from; None: chosen here.

        Decimals become plain numbers without the noise of their last digits; ``details``: see `TargetField`.
        """
        put(self.data, steps(path), _plain(value))
        self.mark(path, of, note, **details)

    def same(self, row: Same, value: Any) -> None:
        """A field that keeps its value."""
        to = row.to or row.path
        if row.two:
            put(self.data, steps(to), _plain(value))
            for i in range(2):
                self.mark(f"{to}.{i}", f"{row.path}.{i}", row.note)
        else:
            self.put(to, row.becomes(value), row.path, row.note)

    def mark(self, path: str, of: str | None, note: str = "", **details: Any) -> None:
        """A field that is set otherwise holds this neutral field too."""
        self.fields.append(TargetField(path, of, note, **details))

    def drop(self, of: str, note: str) -> None:
        """A neutral field that the target does not have, and what to program instead."""
        self.mark("", of, note)

    def drop_all(self, unmatched: Iterable[tuple[str, str]]) -> None:
        """Neutral fields that the target does not have, each with its note."""
        for of, note in unmatched:
            self.drop(of, note)

    def refuse(self, path: str, message: str) -> NoReturn:
        """Ends the conversion for a value that the target cannot have at all."""
        raise ConvertError([Missing(("loops", self.index, *steps(path)), message)])


def target_file(vendor: str, file: GenericFile, builders: Sequence[TargetBuilder], **sections: Any) -> TargetFile:
    """The target's file of its loops; empty ``sections`` are left out."""
    data = {"pidcfg": 1, "vendor": vendor} | present({"name": file.name, "description": file.description})
    data |= {key: section for key, section in sections.items() if section}
    return TargetFile({**data, "loops": [b.data for b in builders]}, [b.fields for b in builders])


def _plain(value: Any) -> Any:
    """A value as a file has it."""
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return number(value) if isinstance(value, Decimal) else value


def starts(bank: BankRange, size: int, count: int, wanted: Sequence[str]) -> list[int]:
    """Where the blocks of each loop begin: as wanted, the others behind the last one without overlapping any."""
    _refuse_too_many(wanted, count)
    places = [bank.parse(address) for address in wanted]
    start = places[-1] + size if places else bank.first
    while len(places) < count:
        clash = next((other for other in places if abs(other - start) < size), None)
        if clash is None:
            places.append(start)
        start = (start if clash is None else clash) + size
    top = max(places, default=bank.first)
    if top + size - 1 > bank.last:
        raise _no_place(f"{size} addresses from {bank.prefix}{top} on do not end by {bank.prefix}{bank.last}")
    return places


def names(wanted: Sequence[str | None], count: int, free: Callable[[int], str]) -> list[str]:
    """One name a loop: as wanted, the others the first that are free, counted from 1."""
    _refuse_too_many(wanted, count)
    unused = (name for n in counter(1) if (name := free(n)) not in wanted)
    all_wanted = [*wanted, *[None] * (count - len(wanted))]
    return [next(unused) if name is None else name for name in all_wanted]


def _refuse_too_many(wanted: Sequence[str | None], count: int) -> None:
    if len(wanted) > count:
        raise _no_place(f"{', '.join(str(name) for name in wanted)}: that is {len(wanted)} for {count} of the loops")


def _no_place(message: str) -> ConvertError:
    return ConvertError([Missing(("loops",), message)])
