"""Registers back to the plain data of a configuration file: what the decoders of all vendors need."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

from pydantic import BaseModel, ValidationError

from pidcfg.encoders.words import DecodeError
from pidcfg.schemas.base import Quantity, plain_number

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from decimal import Decimal

    from pidcfg.encoders.regmap import RegisterMap
    from pidcfg.encoders.scales import Scale
    from pidcfg.encoders.spaces import Space
    from pidcfg.schemas.addresses import BankRange

Data = dict[str, Any]
S = TypeVar("S", bound=BaseModel)


def unnamed(index: int) -> str:
    """What a loop is called whose listing does not say its name, counted from 0."""
    return f"LOOP-{index + 1}"


def switched_on(bit: bool | None, *values: object) -> bool:  # noqa: FBT001 - a bit is what it is about
    """The state of an enable bit: as written, else on when any of its values is given."""
    return any(v is not None for v in values) if bit is None else bit


def quantity(value: Quantity | Decimal) -> int | float | str:
    """A value as the file writes it."""
    if isinstance(value, Quantity):
        return f"{value.value} counts" if value.counts else plain_number(value.value)
    return plain_number(value)


def present(data: Mapping[str, Any]) -> Data:
    """Without what is not given."""
    return {key: value for key, value in data.items() if value is not None}


def read_settings(model: type[S], entry: Mapping[str, Any], place: str) -> S:
    """Settings from beside the words, as strictly as from a file."""
    try:
        return model.model_validate(entry)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(step) for step in first["loc"])
        raise DecodeError(f"{place}: {where}: {first['msg']}") from None


class Said(NamedTuple):
    """What an option says of every loop, one text a loop: the key in the settings, the option, what it is."""

    path: tuple[str, ...]
    option: str
    what: str
    needed: bool = True


def completed(
    settings: Sequence[Mapping[str, Any]],
    options: Mapping[str, Any],
    said: Iterable[Said],
    named: Callable[[int], str] = unnamed,
) -> list[dict[str, Any]]:
    """The settings of each loop with what options say; what neither says and is needed is asked for.

    The number of loops is that of the settings, or of the longest option; an option that is shorter than that speaks
    of no loop in particular, and is refused unless it says one thing for all.
    """
    rows = list(said)
    count = len(settings) or max((len(options.get(row.option) or ()) for row in rows), default=0)
    loops = [_copy(settings[i]) if settings else {"loop": named(i)} for i in range(count)]
    for row in rows:
        texts = options.get(row.option)
        if texts is not None and len(texts) not in {1, count}:
            flag = row.option.replace("_", "-")
            raise DecodeError(f"--{flag} names {len(texts)} for {count} loops; give one for each, with commas between")
        for i, loop in enumerate(loops):
            if texts is not None:
                _put(loop, row.path, texts[0] if len(texts) == 1 else texts[i])
    if not loops:
        raise _missing(rows[0], "")
    for loop in loops:
        for row in rows:
            if row.needed and not _has(loop, row.path):
                raise _missing(row, f" of {loop.get('loop', 'a loop')}")
    return loops


def _missing(row: Said, whose: str) -> DecodeError:
    return DecodeError(f"the listing does not say {row.what}{whose}; give --{row.option.replace('_', '-')}")


def _copy(data: Mapping[str, Any]) -> dict[str, Any]:
    return {key: _copy(value) if isinstance(value, dict) else value for key, value in data.items()}


def _put(data: dict[str, Any], path: tuple[str, ...], value: object) -> None:
    for key in path[:-1]:
        below = data.get(key)
        data[key] = below if isinstance(below, dict) else {}
        data = data[key]
    data[path[-1]] = value


def _has(data: Any, path: tuple[str, ...]) -> bool:
    for key in path:
        if not isinstance(data, dict) or key not in data:
            return False
        data = data[key]
    return True


def listed(read: Callable[[str], object]) -> Callable[[str], list[object] | None]:
    """A reader of options that say one thing a loop, with commas between; None when ``read`` refuses one."""

    def values(text: str) -> list[object] | None:
        try:
            return [read(part.strip()) for part in text.split(",")]
        except ValueError:
            return None

    return values


def one_of(*words: str) -> Callable[[str], str]:
    """A reader of options that are one of some words."""

    def word(text: str) -> str:
        if text not in words:
            raise ValueError(text)
        return text

    return word


def address_of(bank: BankRange) -> Callable[[str], str]:
    """A reader of addresses of one bank, as settings have them."""
    return lambda text: f"{bank.prefix}{bank.parse(text)}"


@dataclass(frozen=True, slots=True)
class LoopBlock:
    """One block of a loop in a listing: its raw registers by name, and the values of its settings by path."""

    loop: str
    space: Space
    start: int
    table: RegisterMap
    raw: tuple[int, ...]

    def word(self, name: str) -> int:
        """A register as it is."""
        return self.raw[self.table.offset(name)]

    def address(self, name: str) -> str:
        """Where a register is."""
        return self.space.name(self.start + self.table.offset(name))

    def values(self, scales: Mapping[str, Scale]) -> Data:
        """Values by path; a register that is no value is named with its address."""
        try:
            return self.table.decode(self.raw, scales)
        except DecodeError as error:
            address = self.start + (error.place or 0)
            raise DecodeError(f"{self.loop}, {self.space.name(address)}: {error}", address) from None

    def left_out(self) -> Iterator[str]:
        """Says what is not carried over: momentary requests, what the controller writes, reserved registers."""
        for row in self.table.words:
            if row.path is None and self.raw[row.offset]:
                address = self.start + row.offset
                value = self.space.kind(address).text(self.raw[row.offset])
                yield f"{self.loop}: {self.space.name(address)} = {value} ({row.title}) is not carried over"


def read_loops(
    model: type[S],
    settings: Sequence[Mapping[str, Any]],
    words: Mapping[int, int],
    space: Space,
    blocks: Mapping[str, tuple[str, RegisterMap]],
) -> Iterator[tuple[Any, list[LoopBlock]]]:
    """The settings of each loop as ``model`` says, and its blocks, whose addresses stand among them."""
    for i, entry in enumerate(settings):
        own: Any = read_settings(model, entry, f"settings[{i}]")
        yield (
            own,
            [
                loop_block(words, space, space.number(prefix, getattr(own, key)), table, own.loop)
                for key, (prefix, table) in blocks.items()
            ],
        )


def loop_block(words: Mapping[int, int], space: Space, start: int, table: RegisterMap, loop: str) -> LoopBlock:
    """A loop's block at ``start``; settings must be there, what the controller writes may be missing."""
    missing = next((w for w in table.words if w.access == "setting" and start + w.offset not in words), None)
    if missing is not None:
        name = space.name(start + missing.offset)
        raise DecodeError(f"the listing does not hold {name} ({missing.title}) of {loop}")
    return LoopBlock(loop, space, start, table, tuple(words.get(start + n, 0) for n in range(table.size)))
