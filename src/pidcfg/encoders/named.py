"""Configurations whose loops are rows of one table of named parameters: to their contents and back.

A parameter is called ``LOOP.NAME``, where the name is its path in a loop of the file (``OVEN.SV``,
``TIC-101.tuning.gain``). A vendor makes one `NamedLoops`, which says what its table cannot: what stands beside the
parameters, which of them have no default, and what messages call them. Defaults are left out on the way back, so that
encoding the result again gives the same contents.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Decoded
from pidcfg.encoders.mapping import NOTHING, file_data
from pidcfg.encoders.parameters import (
    Entry,
    Program,
    ProgramEncoding,
    content_of,
    shown,
    stored,
    unknown_name,
    value_of,
)
from pidcfg.encoders.settings import read_settings, settings_of, settings_values, with_options
from pidcfg.encoders.values import plain, present
from pidcfg.encoders.words import DecodeError
from pidcfg.paths import put, steps, value_at
from pidcfg.schemas.common import SectionSettings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pidcfg.encoders.parameters import Content, Parameter, ParameterTable
    from pidcfg.encoders.settings import LoopOption
    from pidcfg.encoders.values import Data
    from pidcfg.paths import Path
    from pidcfg.schemas.base import Model
    from pidcfg.schemas.iec import Wire


@dataclass(frozen=True, kw_only=True)
class NamedLoops:
    """What a vendor's loops are made of, and what messages call it."""

    vendor: str
    table: ParameterTable
    loop: type[Model]
    """The schema of a loop."""
    settings: type[Model]
    """What no parameter of a loop holds; its ``loop`` is the name."""
    file: type[SectionSettings]
    """What no parameter of the file holds."""
    title: str
    """A parameter, ``an operand of DPIDE``."""
    kind: str
    """The same, of a name that is none."""
    entry: str
    """An entry of a listing, for the message that there is none."""
    needed: Sequence[str] = ()
    """Parameters without a default."""
    always: frozenset[str] = frozenset()
    """Choices that are written even where they are defaults, and remarked on where a listing lacks them."""
    first: Mapping[str, int] = field(default_factory=dict)
    """Parameters that the file never gives, and what they hold at the start."""
    options: Sequence[LoopOption] = ()
    """What options say where no settings stand beside the parameters."""
    last: Sequence[str] = ()
    """Settings that a file has behind the parameters of their section."""
    devices: Callable[[Any], Mapping[str, str]] = lambda _loop: NOTHING
    """Where parameters of a loop stand in the PLC's memory."""

    @cached_property
    def rows(self) -> dict[str, Parameter]:
        """The parameters by name."""
        return {row.name: row for row in self.table.rows}

    @cached_property
    def places(self) -> list[tuple[Parameter, Path | None]]:
        """The parameters in their order, each with its place in a loop; None for one that the file never gives."""
        return [(row, None if row.name in self.first else steps(row.name)) for row in self.table.rows]

    def split(self, name: str) -> tuple[str, str]:
        """The loop and the parameter of a full name; two empty texts for another name.

        No name of a parameter is the end of another one, so that a loop may have dots in its name.
        """
        parts = name.split(".")
        ends = (".".join(parts[i:]) for i in range(1, len(parts)))
        end = next((end for end in ends if end in self.rows), "")
        return (name[: -len(end) - 1], end) if end else ("", "")

    def loop_names(self, words: Iterable[str]) -> list[str]:
        """The loops of names with a known parameter, in their order."""
        return list(dict.fromkeys(loop for loop, _ in map(self.split, words) if loop))

    def values_of(self, loop: Any) -> Iterator[tuple[Parameter, Any]]:
        """Parameters with their values; what is not given and has no default is left out."""
        for row, path in self.places:
            value = self.first[row.name] if path is None else value_at(loop, path)
            if value is not None:
                yield row, value

    def encode(self, config: Any) -> ProgramEncoding:
        """All parameters of every loop that have a value; what none holds stands beside them."""
        entries, misfits = [], []
        for i, loop in enumerate(config.loops):
            devices = self.devices(loop)
            for row, value in self.values_of(loop):
                content, misfit = stored(row, value)
                device = devices.get(row.name)
                entries.append(Entry(f"{loop.name}.{row.name}", row.type, content, row.name, loop.name, device))
                if misfit is not None:
                    misfits.append((("loops", i, *steps(row.name)), misfit))
        settings = tuple(settings_of(self.settings, loop) for loop in config.loops)
        values = {**dict(config), **dict(getattr(config, "plc", {}))}
        beside = present({key: plain(values.get(key)) for key in self.file.model_fields})
        return ProgramEncoding(Program(self.vendor, tuple(entries), settings, beside), tuple(misfits))

    def decode(
        self,
        words: Mapping[str, Content | Wire],
        settings: Sequence[Mapping[str, Any]] = (),
        plc: Mapping[str, Any] | None = None,
        options: Mapping[str, Any] | None = None,
    ) -> Decoded:
        """The configuration that these parameters hold; raises `DecodeError` for what is missing or is no value.

        ``words`` are contents by full name; ``settings`` and ``plc`` are what an encoder put beside them; ``options``
        one list for each of the vendor's, of one entry a loop.
        """
        file = read_settings(self.file, plc or {}, "plc")
        entries: Sequence[Mapping[str, Any]] = list(settings) or [{"loop": name} for name in self.loop_names(words)]
        if not entries:
            raise DecodeError(f"the listing holds no {self.entry}")
        if self.options:
            entries = with_options(entries, options or {}, self.options)
        loops: list[Any] = [read_settings(self.settings, entry, f"settings[{i}]") for i, entry in enumerate(entries)]
        names = {loop.loop for loop in loops}
        self._check_names(words, names)
        others = [name for name in self.loop_names(words) if name not in names]
        notes = [f"{name} is not carried over: the settings do not name it" for name in others]
        data: Data = {"pidcfg": 1, "vendor": self.vendor}
        data |= present({key: getattr(file, key) for key in SectionSettings.model_fields})
        of_plc = present({key: value for key, value in dict(file).items() if key not in SectionSettings.model_fields})
        data |= {"plc": of_plc} if of_plc else {}
        return Decoded({**data, "loops": [self._loop(loop, words, notes) for loop in loops]}, tuple(notes))

    def _check_names(self, words: Iterable[str], loops: set[str]) -> None:
        """An unknown name would leave its default in place, which may be the other direction."""
        nested = any("." in name for name in self.rows)
        for name in words:
            loop = max((loop for loop in loops if name.startswith(f"{loop}.")), key=len, default=None)
            key = name.removeprefix(f"{loop}.")
            if loop is not None and not self.split(name)[0] and (nested or "." not in key):
                raise unknown_name(name, key, self.rows, self.kind)

    def _loop(self, settings: Any, words: Mapping[str, Content | Wire], notes: list[str]) -> Data:
        values = settings_values(settings)
        behind = {path: values.pop(path) for path in self.last if path in values}
        for row in self.table.rows:
            name = f"{settings.loop}.{row.name}"
            if name not in words:
                if row.name in self.needed:
                    raise DecodeError(f"the listing does not hold {name} ({row.title})")
                continue
            content = content_of(name, row, words[name], self.title)
            if row.access == "input" and row.name not in self.first:
                values[row.name] = value_of(content)
            elif content:
                notes.append(f"{name} = {shown(row.type, content)} ({row.title}) is not carried over")
        self._check_pairs(settings.loop, values)
        for key in sorted(self.always - values.keys()):
            default = shown(self.rows[key].type, self.rows[key].type.default)
            notes.append(f"{settings.loop}: the listing does not hold {key}, which then is {default}")
        data = file_data(self.loop, values, always=self.always)
        for path, value in behind.items():
            put(data, steps(path), value)
        return data

    def _check_pairs(self, loop: str, values: Mapping[str, Any]) -> None:
        """Refuses one end of a pair alone."""
        for low in (name for name in self.rows if name.endswith(".0")):
            ends = (low, f"{low.removesuffix('0')}1")
            missing = [end for end in ends if end not in values]
            if len(missing) == 1:
                raise DecodeError(f"the listing does not hold {loop}.{missing[0]} ({self.rows[missing[0]].title})")
