"""One neutral loop on its way into a DL06 file."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from typing import TYPE_CHECKING, Any, NoReturn

from pidcfg.conversion.arithmetic import number
from pidcfg.conversion.ledger import Missing, Put
from pidcfg.conversion.pipeline import ConvertError
from pidcfg.conversion.to_neutral.dl06_scales import short

if TYPE_CHECKING:
    from pidcfg.encoders.scales import Scale
    from pidcfg.schemas.generic import Loop


@dataclass(slots=True)
class Writer:
    """A loop's data so far, and where its neutral fields were put."""

    index: int
    loop: Loop
    scales: dict[str, Scale]
    sample: Decimal
    """The sample time as its word will hold it."""
    data: dict[str, Any] = field(default_factory=dict)
    puts: list[Put] = field(default_factory=list)

    def put(
        self, path: str, value: Any, of: str | None, note: str = "", *, assumed: bool = False, clamped: bool = False
    ) -> None:
        """A field of the target with its value, and the neutral field that it came from (None: it is chosen)."""
        keys, section = path.split("."), self.data
        for key in keys[:-1]:
            section = section.setdefault(key, {})
        section[keys[-1]] = value
        self.puts.append(Put(path, of, note, assumed=assumed, clamped=clamped))

    def means(self, path: str, value: Decimal | int, of: str, note: str = "", **how: Any) -> None:
        """A field whose number in the file is not what is meant; ``how``: see `Put`."""
        self.put(path, number(Decimal(value)), of, note)
        self.puts[-1] = Put(path, of, note, **how)

    def number(self, path: str, value: Decimal, of: str | None, note: str = "", *, clamped: bool = False) -> None:
        """A field that is a number."""
        self.put(path, number(value), of, note, clamped=clamped)

    def computed(self, path: str, value: Decimal, of: str, note: str = "", *, clamped: bool = False) -> None:
        """A field that is worked out from neutral numbers."""
        self.put(path, number(short(value)), of, note, clamped=clamped)

    def pair(self, path: str, ends: tuple[Decimal, Decimal], of: str) -> None:
        """A field that is a pair of numbers."""
        self.put(f"{path}.0", None, f"{of}.0")
        self.put(f"{path}.1", None, f"{of}.1")
        keys, section = path.split("."), self.data
        for key in keys[:-1]:
            section = section[key]
        section[keys[-1]] = [number(end) for end in ends]

    def also(self, path: str, of: str, note: str = "") -> None:
        """Another neutral field that went into a field that is put already."""
        self.puts.append(Put(path, of, note))

    def lost(self, of: str, note: str) -> None:
        """A neutral field that the target has no place for."""
        self.puts.append(Put("", of, note))

    def refuse(self, path: str, message: str) -> NoReturn:
        """What cannot be put at all."""
        keys = path.split(".")
        raise ConvertError([Missing(("loops", self.index, *keys), keys[-1], f"{self.loop.name}: {message}")])
