"""The rules over a file of which some loops cannot be read: each of the others is judged by itself.

Design. The file is read twice more: with a copy of a readable loop in the place of each that cannot be read, which
keeps positions and addresses, and without these loops. What both readings find at a loop does not come from the loops
that are missing, and is told; what follows from several loops may do so, and waits until all can be read.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.frozen import frozen
from pidcfg.validate.identity import LOOPS, loop_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from pidcfg.document import Document
    from pidcfg.paths import Path

    Judge = Callable[[dict[str, Any]], Iterable[Diagnostic] | None]
    """The findings of the rules over data; None where they cannot be read."""

SHOWN = 3
"""Loops that the remark names."""


@frozen
class Readable:
    """The loops of a file that can be read, by their places, and those that cannot."""

    doc: Document
    sound: Sequence[int]
    broken: Sequence[int]

    def findings(self, judge: Judge) -> list[Diagnostic]:
        """What both readings find at the sound loops, and the remark that something waits."""
        full, short = judge(self._filled()), judge(self._without())
        if full is None or short is None:
            return []
        places = {(d.code, self.sound[i], d.path[2:]) for d in short if (i := place_of(d.path)) is not None}
        kept = [d for d in full if (d.code, place_of(d.path), d.path[2:]) in places]
        return [*(d for d in kept if not self._names.intersection(d.with_loops)), self._remark()]

    @property
    def _names(self) -> set[str]:
        """The names of the loops that cannot be read, as far as they can."""
        return {loop_name(self.doc, (LOOPS, i)) for i in self.broken}

    def _filled(self) -> dict[str, Any]:
        loops = list(self._loops)
        for i in self.broken:
            name = loop_name(self.doc, (LOOPS, i))
            loops[i] = {**loops[self.sound[0]], **({"name": name} if name else {})}
        return {**(self.doc.data or {}), LOOPS: loops}

    def _without(self) -> dict[str, Any]:
        return {**(self.doc.data or {}), LOOPS: [self._loops[i] for i in self.sound]}

    @property
    def _loops(self) -> list[Any]:
        loops: list[Any] = (self.doc.data or {})[LOOPS]
        return loops

    def _remark(self) -> Diagnostic:
        names = [loop_name(self.doc, (LOOPS, i)) or f"loop {i + 1}" for i in self.broken]
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        message = (
            f"{', '.join(names[:SHOWN])}{more} cannot be read: each other loop was checked by itself, "
            "what concerns several loops was not"
        )
        cure = "correct the errors, and check again"
        place = self.doc.locate((LOOPS,), key=True)
        return Diagnostic("PID038", Severity.INFO, message, self.doc.file, place, (LOOPS,), help=cure)


def readable(doc: Document, errors: Iterable[Diagnostic]) -> Readable | None:
    """The loops without errors, where every error is in a loop, and some loop has none."""
    loops = (doc.data or {}).get(LOOPS)
    broken = {place_of(d.path) for d in errors if d.severity is Severity.ERROR}
    if not isinstance(loops, list) or None in broken:
        return None
    sound = [i for i in range(len(loops)) if i not in broken]
    return Readable(doc, sound, [i for i in range(len(loops)) if i in broken]) if sound and broken else None


def place_of(path: Path) -> int | None:
    """The number of the loop that a path is in; None: it is in none."""
    return path[1] if len(path) > 1 and path[0] == LOOPS and isinstance(path[1], int) else None
