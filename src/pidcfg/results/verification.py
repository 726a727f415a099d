"""The verdicts of the battery as plain data: for `convert --verify` and `diff --verify`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

State = float | str | bool
"""What a signal shows."""

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.results.differences import DiffResult
    from pidcfg.results.findings import Data
    from pidcfg.verification.comparison import Difference
    from pidcfg.verification.verdict import Verified


def with_verdict(result: DiffResult, progress: Callable[[float], None] | None) -> DiffResult:
    """A comparison with both sides in the battery; its notes say which loops cannot be run, and why."""
    from pidcfg.verification.diff_charts import verified_sides

    if result.sides is None or result.sources is None:
        reason = "not compared: nothing says the ranges of both sides, so neither can be run"
        return replace(result, verified=(), notes=(*result.notes, reason))
    notes: list[str] = []
    loops = verified_sides(result.sides, result.sources, (result.before, result.after), notes.append, progress)
    return replace(result, verified=tuple(loops), notes=(*result.notes, *notes))


def verified_data(loop: Verified) -> Data:
    """One loop's verdict."""
    return {
        "loop": loop.loop,
        "passed": loop.passed,
        "pv_percent": round(loop.pv_percent, 6),
        "output_percent": round(loop.output_percent, 6),
        "iae_ratio": None if loop.iae_ratio is None else round(loop.iae_ratio, 6),
        "stages": list(loop.stages),
        "differences": [{**_difference(one.difference), "key": one.key or None} for one in loop.failures],
        "named": [{**_difference(one.difference), "line": one.line.field, "note": one.line.note} for one in loop.named],
    }


def _difference(one: Difference) -> dict[str, Any]:
    worst = None if one.worst is None else round(100 * one.worst, 6)
    return {
        "stage": one.stage,
        "signal": one.signal,
        "at": round(one.at, 6),
        "from": _shown(one.before),
        "to": _shown(one.after),
        "percent": worst,
    }


def _shown(value: State) -> State:
    return value if isinstance(value, bool | str) else float(f"{value:.10g}")
