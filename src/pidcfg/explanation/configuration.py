"""The configuration that a question is about: which loop and which line sets a register, and to what."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import path_text
from pidcfg.encoders.image import Block, Encoding, no_registers
from pidcfg.explanation.page import Origin, Page
from pidcfg.explanation.texts import units_of
from pidcfg.explanation.values import Placement
from pidcfg.paths import has_key, steps, value_at

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.parameters import Entry
    from pidcfg.encoders.regmap import RegisterMap, Word
    from pidcfg.explanation.values import Scaling
    from pidcfg.paths import Path
    from pidcfg.validate.engine import Checked


class Configured:
    """The registers of one configuration, each with the line that sets it."""

    def __init__(self, checked: Checked) -> None:
        self.checked = checked
        self.document = checked.document
        self.loops: tuple[str, ...] = tuple(loop.name for loop in checked.config.loops)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks of an encoding with addresses."""
        encoding: Any = self.checked.encoding
        return encoding.blocks if isinstance(encoding, Encoding) else ()

    @property
    def entries(self) -> tuple[Entry, ...]:
        """The parameters of an encoding with names."""
        encoding: Any = self.checked.encoding
        return () if isinstance(encoding, Encoding) else encoding.image.cells

    @property
    def settings(self) -> Sequence[Mapping[str, Any]]:
        """What stands beside the parameters."""
        encoding: Any = self.checked.encoding
        settings: Sequence[Mapping[str, Any]] = encoding.image.settings
        return settings

    def units(self, loop: str | None) -> dict[str, str]:
        """The units of a loop's PV and output."""
        return units_of(next((entry for entry in self.settings if entry.get("loop") == loop), {}))

    def at(self, number: int) -> Placement | None:
        """The register at an address; where blocks overlap, the later wins."""
        block = next((b for b in reversed(self.blocks) if 0 <= number - b.start < b.table.size), None)
        return None if block is None else self._placement(block, number - block.start)

    def named(self, table: RegisterMap, word: Word, loop: str | None) -> Iterator[tuple[Placement, int]]:
        """A register in every block of its kind, or in that of one loop, with its addresses.

        Raises `NoRegisterError` for a block that leaves the PLC's memory, where it has none.
        """
        encoding: Any = self.checked.encoding
        for block in self.blocks:
            if block.table.title == table.title and loop in {None, block.loop}:
                if block in encoding.outside:
                    raise no_registers(block, encoding.space)
                yield self._placement(block, word.offset), block.start + word.offset

    def _placement(self, block: Block, offset: int) -> Placement:
        """A register; a word of many choices has an origin for each that the file gives."""
        word = next(w for w in block.table.words if w.offset == offset)
        rows = [row for row in block.table.bits if row.offset == offset and row.access == "setting"]
        paths = [path for path in (word.path, *(row.path for row in rows)) if path is not None]
        origins = [o for path in paths if (o := self.origin((*block.place, *steps(path)), block.loop))]
        raw = block.encoded.words[offset]
        return Placement(block.table, word, block.loop, self._scaling(block), raw, tuple(origins))

    def _scaling(self, block: Block) -> Scaling | None:
        loops, vendor = self.checked.config.loops, self.checked.vendor
        if vendor is None or len(block.place) < 2 or block.place[0] != "loops" or not isinstance(block.place[1], int):
            return None
        scaling: Scaling = vendor.load("explainer").scaling(loops[block.place[1]], self.checked.config)
        return scaling

    def with_origin(self, page: Page, entry: Entry) -> Page:
        """A parameter's page with its loop and the line that gives it."""
        data: Any = self.document.data
        for key in ("loops", "blocks", "signals"):
            for i, item in enumerate(data.get(key) or ()):
                if isinstance(item, dict) and item.get("name") == entry.address.removesuffix(f".{entry.field}"):
                    origin = self.origin((key, i, *steps(entry.field)), entry.loop)
                    return replace(page, loop=entry.loop, origins=(origin,) if origin else ())
        return replace(page, loop=entry.loop)

    def origins(self, key: str, *, in_loops: bool) -> list[Origin]:
        """The lines that give a key, of every loop or of the file."""
        path = steps(key)
        if not in_loops:
            return [origin] if (origin := self.origin(path, None)) else []
        lines = [self.origin(("loops", i, *path), loop) for i, loop in enumerate(self.loops)]
        return [origin for origin in lines if origin]

    def origin(self, path: Path, loop: str | None) -> Origin | None:
        """Where a key stands in the file; None where the file does not give it."""
        if not has_key(self.document.data, path):
            return None
        span = self.document.locate(path)
        text = str(value_at(self.document.data, path))
        return Origin(self.document.file, span.line, span.column, loop, path_text(path), text)
