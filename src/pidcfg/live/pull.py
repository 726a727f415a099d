"""What a PLC holds, as a configuration or a memory listing: the result of `pidcfg.pull`."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Image
from pidcfg.encoders.listing import few
from pidcfg.encoders.map_rows import shown
from pidcfg.encoders.modbus_map import StatedNumbering
from pidcfg.encoders.parameters import Program
from pidcfg.encoders.settings import read_settings
from pidcfg.encoders.symbol_map import NamedNumbering
from pidcfg.encoders.words import DecodeError
from pidcfg.live.doubts import doubts
from pidcfg.live.link import Link
from pidcfg.live.named import NamedRegisters, written
from pidcfg.live.reading import Registers
from pidcfg.live.running import run
from pidcfg.results.arguments import ArgumentError, refuse_unknown, vendor_options
from pidcfg.results.findings import errors_in, findings_data
from pidcfg.results.words import DecodeOptions, decoded
from pidcfg.vendors import VENDORS, format_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.encoders.modbus import Numbering
    from pidcfg.limits import Limits
    from pidcfg.live.address import Address
    from pidcfg.live.link import Patience
    from pidcfg.results.findings import Data
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

YAML = "yaml"
"""The format of a configuration; all others are listings."""


@dataclass(frozen=True, slots=True)
class Source:
    """A PLC, and everything that is needed to read it."""

    address: Address
    vendor: Vendor
    numbering: Numbering | NamedNumbering | None
    """None: the configuration has no memory, so that nothing is read."""
    like: Checked | None = None
    """A configuration that gives names, ranges, units and places."""
    texts: Mapping[str, object] = field(default_factory=dict)
    """Options of the vendor's decoder as texts."""

    @property
    def image(self) -> Image | None:
        """The memory of that configuration; None where there is none, or it cannot be encoded."""
        encoding = None if self.like is None else self.like.encoding
        return encoding.image if encoding is not None and encoding.whole else None

    @property
    def registers(self) -> Registers:
        """Where to read."""
        if self.numbering is None:
            raise ValueError("the configuration has no memory")
        if isinstance(self.numbering, NamedNumbering):
            return NamedRegisters(self.vendor, self.numbering, self.image)
        options = vendor_options(self.vendor, "decode_options", self.texts)
        return Registers(self.vendor, self.numbering, self.image, options)

    def register(self, address: str) -> str:
        """Where a stated map has an address or a parameter; empty without such a map, or where it has none."""
        with suppress(LookupError):
            if isinstance(self.numbering, StatedNumbering):
                number = self.numbering.space.parse(address)
                return "" if number is None else shown(self.numbering.place(number))
            if isinstance(self.numbering, NamedNumbering):
                points = self.numbering.points.values()
                name = next((point.name for point in points if address in {point.name, point.device}), "")
                return shown(self.numbering.place(name))
        return ""

    @property
    def unread(self) -> tuple[str, ...]:
        """Settings that are in no register, by name."""
        named = self.numbering if isinstance(self.numbering, NamedNumbering) else None
        return (*named.without, *named.literals) if named is not None else ()

    @property
    def left_out(self) -> tuple[str, ...]:
        """Settings that are in no register, as notes."""
        if not isinstance(self.numbering, NamedNumbering):
            return ()
        reasons = {
            "the map says that no register has them": self.numbering.without,
            "they are numbers of the program, without a device": self.numbering.literals,
        }
        return tuple(f"not read, since {why}: {few([*names])}" for why, names in reasons.items() if names)


@dataclass(frozen=True, slots=True)
class PullResult:
    """What a PLC holds: its words, and the text of a configuration or a listing."""

    plc: str
    """The PLC, as ``10.0.0.5:502``."""
    vendor: str
    findings: tuple[Diagnostic, ...] = ()
    """What is wrong with the configuration that it was to be read like, or with the words; empty: there is a text."""
    image: Image | Program | None = None
    """Every word that was read; None: nothing was."""
    data: Data | None = None
    """The configuration as plain data; None: a listing was asked for."""
    text: str = ""
    notes: tuple[str, ...] = ()
    """What a configuration cannot carry, and contents that seem to be none."""

    @property
    def ok(self) -> bool:
        """Whether there is a text."""
        return not self.findings

    def to_json(self) -> Data:
        """The configuration as data, or the words; where there is neither, the findings."""
        if not self.ok:
            return findings_data(errors_in(self.findings))
        if self.data is not None:
            return dict(self.data)
        if isinstance(self.image, Program):
            return {"version": 1, "plc": self.plc, **_program_words(self.image)}
        cells = self.image.cells if self.image is not None else ()
        words = [{"address": c.address, "hex": c.hex, "loop": c.loop, "field": c.field} for c in cells]
        return {"version": 1, "vendor": self.vendor, "plc": self.plc, "words": words}


def _program_words(program: Program) -> Data:
    """The parameters of a program as its JSON listing has them."""
    listed: Data = json.loads(format_of(VENDORS[program.vendor], "json").write(program, ()))
    return {"vendor": program.vendor, "words": listed["words"]}


def pulled(source: Source, name: str, patience: Patience, limits: Limits) -> PullResult:
    """Reads a PLC and writes what it holds in a format; raises `PlcError` where it cannot be read."""
    if name != YAML:
        kinds = [kind.name for kind in source.vendor.load("formats").values() if kind.whole]
        refuse_unknown("format", name, [YAML, *kinds])
    result = PullResult(str(source.address), source.vendor.key)
    if source.like is not None and source.image is None:
        return replace(result, findings=tuple(errors_in(source.like.findings)))
    image = read(source, patience)
    result = replace(result, image=image, notes=tuple(doubts(image)))
    configuration = decoded(
        [(listing(image), str(source.address))],
        source.vendor,
        DecodeOptions(like=source.like, write=name == YAML),
        source.texts,
        limits,
    )
    if name == YAML:
        return replace(
            result,
            findings=configuration.findings,
            data=configuration.data,
            text=configuration.text,
            notes=(*source.left_out, *result.notes, *configuration.notes),
        )
    return _listed(result, image, source, name, configuration.data)


def read(source: Source, patience: Patience) -> Image | Program:
    """What a PLC holds; raises `PlcError`."""

    async def reading() -> Image | Program:
        async with Link(source.address, patience) as link:
            return await source.registers.image(link)

    return run(reading())


def _listed(result: PullResult, image: Image | Program, source: Source, name: str, data: Any) -> PullResult:
    """A listing, with what no register holds beside it as far as that is known."""
    beside = source.image
    with suppress(DecodeError):  # words that give no configuration make a listing all the same
        if data is not None:
            beside = source.vendor.encoder(read_settings(source.vendor.model, data, "")).image
    known = image if beside is None else replace(image, settings=beside.settings, plc=beside.plc)
    odd = None
    if isinstance(known, Image):
        odd = next((cell for cell in known.cells if not isfinite(cell.value)), None)
    if name == "json" and odd is not None:
        raise ArgumentError(f"`format` json has no word for what {odd.address} holds, {odd.hex}; csv has", "format")
    return replace(result, image=known, text=format_of(source.vendor, name).write(known, ()))


def listing(image: Image | Program) -> bytes:
    """The words of an image and nothing beside them, as a listing that holds any content."""
    if isinstance(image, Program):
        return written(image)
    rows = [f"{cell.address},{cell.hex}\n" for cell in image.cells]
    return "".join(["address,hex\n", *rows]).encode()
