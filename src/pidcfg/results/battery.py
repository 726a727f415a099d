"""Both sides of a comparison in the battery of `pidcfg.verification`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.results.differences import DiffResult


def with_verdict(result: DiffResult, progress: Callable[[float], None] | None, jobs: int = 1) -> DiffResult:
    """A comparison with both sides in the battery; its notes say which loops cannot be run, and why."""
    from pidcfg.verification.diff_charts import verified_sides

    if result.sides is None or result.sources is None:
        reason = "not compared: nothing says the ranges of both sides, so neither can be run"
        return replace(result, verified=(), notes=(*result.notes, reason))
    notes: list[str] = []
    loops = verified_sides(result.sides, result.sources, (result.before, result.after), notes.append, progress, jobs)
    return replace(result, verified=tuple(loops), notes=(*result.notes, *notes))
