"""A configuration beside the question: which loop and which line sets a register, and to what."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding
from pidcfg.explanation.page import Origin, Page
from pidcfg.explanation.register_page import Found
from pidcfg.paths import steps

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.encoders.parameters import Entry
    from pidcfg.encoders.regmap import RegisterMap, Word
    from pidcfg.explanation.values import Setting
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
        found: Sequence[Mapping[str, Any]] = encoding.image.settings
        return found

    def units(self, loop: str | None) -> dict[str, str]:
        """The units of a loop's PV and output."""
        own = next((entry for entry in self.settings if entry.get("loop") == loop), {})
        parts = {key: own.get(key) for key in ("pv", "output")}
        return {key: str(part["unit"]) for key, part in parts.items() if isinstance(part, dict) and part.get("unit")}

    def at(self, number: int) -> Found | None:
        """The register at an address; where blocks overlap, the later wins."""
        for block in reversed(self.blocks):
            offset = number - block.start
            if 0 <= offset < block.table.size:
                return self._found(block, next(w for w in block.table.words if w.offset == offset))
        return None

    def named(self, table: RegisterMap, word: Word, loop: str | None) -> Iterator[tuple[Found, int]]:
        """A register in every block of its kind, or in that of one loop, with its addresses."""
        for block in self.blocks:
            if block.table.title == table.title and loop in {None, block.loop}:
                row = next(w for w in block.table.words if w.offset == word.offset)
                yield self._found(block, row), block.start + word.offset

    def _found(self, block: Block, word: Word) -> Found:
        """A register; a word of many choices has an origin for each that the file gives."""
        rows = [row for row in block.table.bits if row.offset == word.offset and row.access == "setting"]
        paths = [path for path in (word.path, *(row.path for row in rows)) if path is not None]
        origins = [o for path in paths if (o := self.origin((*block.place, *steps(path)), block.loop))]
        raw = block.encoded.words[word.offset]
        return Found(block.table, word, block.loop, raw, self._setting(block), tuple(origins))

    def _setting(self, block: Block) -> Setting | None:
        loops, vendor = self.checked.config.loops, self.checked.vendor
        if vendor is None or len(block.place) < 2 or block.place[0] != "loops" or not isinstance(block.place[1], int):
            return None
        found: Setting = vendor.load("explainer").settings(loops[block.place[1]], self.checked.config)
        return found

    def with_origin(self, page: Page, entry: Entry) -> Page:
        """A parameter's page with its loop and the line that gives it."""
        data: Any = self.document.data
        for key in ("loops", "blocks", "signals"):
            for i, item in enumerate(data.get(key) or ()):
                if isinstance(item, dict) and item.get("name") == entry.address.removesuffix(f".{entry.field}"):
                    origin = self.origin((key, i, *steps(entry.field)), entry.loop)
                    return replace(page, loop=entry.loop, origins=(origin,) if origin else ())
        return replace(page, loop=entry.loop)

    def origin(self, path: tuple[str | int, ...], loop: str | None) -> Origin | None:
        """Where a key stands in the file; None where the file does not give it."""
        value: Any = self.document.data
        for step in path:
            try:
                value = value[step]
            except (KeyError, IndexError, TypeError):
                return None
        span = self.document.locate(path)
        key = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).lstrip(".")
        return Origin(self.document.file, span.line, span.column, loop, key, str(value))
