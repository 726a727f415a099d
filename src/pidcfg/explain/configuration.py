"""A configuration beside the question: which loop and which line sets a register, and to what."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.encoders.image import Block, Encoding, route
from pidcfg.explain.page import Origin
from pidcfg.explain.register_page import Found

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pidcfg.encoders.regmap import RegisterMap, Word
    from pidcfg.explain.values import Setting
    from pidcfg.validate.engine import Checked


class Configured:
    """The registers of one configuration, each with the line that sets it."""

    def __init__(self, checked: Checked, settings: Any) -> None:
        self.checked = checked
        self.document = checked.document
        self._settings = settings
        self.loops: tuple[str, ...] = tuple(loop.name for loop in checked.config.loops)

    @property
    def blocks(self) -> tuple[Block, ...]:
        """The blocks of an encoding with addresses."""
        encoding: Any = self.checked.encoding
        return encoding.blocks if isinstance(encoding, Encoding) else ()

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
        raw = block.encoded.words[word.offset]
        setting = self._setting(block)
        paths = [word.path, *(row.path for row in block.table.bits if row.offset == word.offset and row.access == "setting")]
        origins = [o for path in paths if path is not None and (o := self.origin(route(block.place, path), block.loop))]
        return Found(block.table, word, block.loop, raw, setting, origins[0] if len(paths) < 3 and origins else None)

    def _setting(self, block: Block) -> Setting | None:
        loops = self.checked.config.loops
        if len(block.place) < 2 or block.place[0] != "loops" or not isinstance(block.place[1], int):
            return None
        found: Setting = self._settings(loops[block.place[1]])
        return found

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
