"""Which key of the other side explains a difference: among the neutral fields that differ, the one that acts on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.common_scale import flat
from pidcfg.conversion.ledger import overlap
from pidcfg.conversion.values import number_of
from pidcfg.verification.neutral import differing, neutral_of, neutral_values

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from decimal import Decimal
    from typing import Any

    from pidcfg.schemas.generic import Loop
    from pidcfg.verification.comparison import Difference
    from pidcfg.verification.trial import Side

LABELS = ("name", "description", "pv.unit", "output.unit")
RANGES = ("pv.range", "output.range")
"""Of which gains and limits are shares in some PLCs."""
CONTROL = (
    *RANGES,
    "tuning.",
    "output.limits",
    "output.",
    "pv.",
    "sample_time",
    "deadband",
    "anti_windup",
    "setpoint.limits",
)
ACTS_ON: Mapping[str, Sequence[str]] = {
    "sample time": ("sample_time",),
    "mode": ("mode", "setpoint.source"),
    "setpoint": ("setpoint.", "mode"),
    "pv": ("pv.filter", "pv.range", "pv.", "output_raises_pv", *CONTROL),
    "output": ("output_raises_pv", *CONTROL),
}
"""Neutral fields that move a signal, those first that do it most directly; alarms have their own."""
CONTEXT = ("alarms.hysteresis", "pv.", "setpoint.limits")
"""What an alarm depends on besides its own limit."""
AT_LIMITS = ("output.limits", "anti_windup", "output.range")
"""Those first in the stages at the limits of the output."""
AT_START = ("mode", "setpoint.value", "output.manual", "output.bias")
"""Those that act as configured at the start alone: elsewhere the battery sets what they say."""
MATERIAL = 0.005
"""From which difference on a number explains anything: a share of it, or of the range of the PV or the output."""


def key_of(difference: Difference, loop: Loop, side: Side, j: int, told: Iterable[str] = ()) -> str:
    """The key of the other side that explains a difference; empty where none is known.

    ``told``: neutral fields of which the report says that they differ.
    """
    field = field_of(difference, loop, side.loop(j), told)
    entries = neutral_of(side.config, side.vendor)[1][j].fields if field else ()
    return next((entry.path for entry in entries if any(overlap(field, to) for to in entry.to)), "")


def field_of(difference: Difference, loop: Loop, other: Loop, told: Iterable[str] = ()) -> str:
    """The neutral field that explains a difference of two loops; empty where none is known."""
    (one, two), told = neutral_values(loop, other), tuple(told)
    if difference.signal in {"pv", "output"}:
        two |= {path: value for path, value in flat(other).items() if path.startswith(RANGES)}
    elsewhere = {*LABELS, *(() if difference.stage == "start" else AT_START)}
    if not loop.tuning.integral_time:
        elsewhere.discard("output.bias")
    fields = [
        field
        for field in differing(one, two)
        if field not in elsewhere and _is_material(field, one, two) and not any(overlap(field, name) for name in told)
    ]
    kinds = _kinds(difference, loop)
    return next((field for kind in kinds for field in fields if field.startswith(kind)), "")


def _kinds(difference: Difference, loop: Loop) -> Iterator[str]:
    """What may explain a difference, the most direct first."""
    signal, stage = difference.signal, difference.stage
    if signal in {"pv", "output"}:
        yield from RANGES
    if stage == "start":
        yield from AT_START
    elif not loop.tuning.integral_time:
        yield "output.bias"
    if stage.endswith("limit") and signal in {"pv", "output"}:
        yield from AT_LIMITS
    if stage == "manual":
        yield from ("output.limits", "output.range")
    if stage.startswith("dead band"):
        yield "deadband"
    if signal in ACTS_ON:
        kinds = ACTS_ON[signal]
    else:
        head, _, end = signal.partition("deviation_")
        kinds = (f"alarms.deviation.{end}" if end else f"alarms.pv.{head}", f"alarms.{signal}", *CONTEXT)
    yield from kinds


def _is_material(field: str, one: Mapping[str, Any], two: Mapping[str, Any]) -> bool:
    """Whether a field differs by more than the rounding of a file."""
    a, b = number_of(one.get(field)), number_of(two.get(field))
    if a is None or b is None or isinstance(one.get(field), bool):
        return True
    return abs(a - b) > _scale(field, a, b, one) * type(a)(str(MATERIAL))


def _scale(field: str, a: Decimal, b: Decimal, values: Mapping[str, Any]) -> Decimal:
    """What a difference of a field is a share of."""
    ranged = {"setpoint.": "pv.range", "alarms.pv.": "pv.range", "pv.range": "pv.range", "output.": "output.range"}
    name = next((name for kind, name in ranged.items() if field.startswith(kind)), None)
    ends = [number_of(values.get(f"{name}.{end}")) for end in "01"]
    if name is None or ends[0] is None or ends[1] is None:
        return max(abs(a), abs(b))
    return abs(ends[1] - ends[0])
