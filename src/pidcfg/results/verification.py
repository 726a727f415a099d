"""The verdicts of the battery as plain data: for `convert --verify` and `diff --verify`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

State = float | str | bool
"""What a signal shows."""
SEVERAL = "of the values that the report says were written"
"""Why two sides differ where no line alone does it."""

if TYPE_CHECKING:
    from pidcfg.conversion.ledger import Change
    from pidcfg.results.findings import Data
    from pidcfg.verification.comparison import Difference
    from pidcfg.verification.verdict import Verified


def verified_data(loop: Verified) -> Data:
    """One loop's verdict."""
    return {
        "loop": loop.loop,
        "passed": loop.passed,
        "pv_percent": round(loop.pv_percent, 6),
        "output_percent": round(loop.output_percent, 6),
        "iae_ratio": None if loop.iae_ratio is None else round(loop.iae_ratio, 6),
        "stages": list(loop.stages),
        "not_tried": [{"stage": one.stage, "mode": one.mode} for one in loop.untried],
        "differences": [{**_difference(one.difference), "key": one.key or None} for one in loop.failures],
        "named": [{**_difference(one.difference), **_line(one.line)} for one in loop.named],
    }


def _line(line: Change | None) -> dict[str, Any]:
    return {"line": None, "note": SEVERAL} if line is None else {"line": line.field, "note": line.note}


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
