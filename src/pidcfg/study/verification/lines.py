"""Which key of the other side explains a difference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.builder import flatten
from pidcfg.conversion.ledger import ConvertError, number_of, overlap
from pidcfg.conversion.operation import target_of
from pidcfg.schemas.generic import GenericFile
from pidcfg.study.verification.comparison import FOLLOWS, LABELS, differing, neutral_of, neutral_values

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from decimal import Decimal
    from typing import Any

    from pidcfg.conversion.ledger import SourceField
    from pidcfg.schemas.generic import Loop
    from pidcfg.study.verification.comparison import SignalDifference
    from pidcfg.study.verification.trial import Side
    from pidcfg.vendors import Vendor

# ----------------------------------------------------------------------------------------------------------------------
# Which key of the other side explains a difference: among the neutral fields that differ, the one that acts on it.

RANGES = ("pv.range", "output.range")
"""Of which gains and limits are shares in some PLCs; another range of the output is often but another scale."""
CONTROL = (
    "pv.range",
    "tuning.",
    "output.limits",
    "pv.",
    "sample_time",
    "deadband",
    "anti_windup",
    "setpoint.limits",
    FOLLOWS,
    "output.",
)
ACTS_ON: Mapping[str, Sequence[str]] = {
    "sample time": ("sample_time",),
    "mode": ("mode", "setpoint.source"),
    "setpoint": ("setpoint.", "mode", "pv.range"),
    "pv": ("pv.filter", "pv.range", "pv.", "output_raises_pv", *CONTROL),
    "output": ("output_raises_pv", *CONTROL),
}
"""Neutral fields that move a signal, those first that do it most directly; alarms have their own."""
CONTEXT = ("alarms.hysteresis", "pv.", "setpoint.limits")
"""What an alarm depends on besides its own limit."""
AT_LIMITS = ("output_raises_pv", "output.limits", "anti_windup")
"""Those first in the stages at the limits of the output."""
AT_START = ("mode", "setpoint.value", "output.manual", "output.bias")
"""Those that act as configured at the start alone: elsewhere the battery sets what they say."""
BY_HAND = "output.manual"
"""Acts in a loop that starts in Manual, and in no other."""
NEAR_LIMIT = 0.002
"""Of its range: an output so near to a limit stands at it."""
MATERIAL_SHARE = 0.005
"""From which difference on a number explains anything: a share of it, or of the range of the PV or the output."""


def key_of(difference: SignalDifference, loop: Loop, side: Side, j: int, told: Iterable[str] = ()) -> str:
    """The key of the other side that explains a difference; empty where none is known.

    ``told``: neutral fields of which the report says that they differ.
    """
    entries = neutral_of(side.config, side.vendor)[1][j].fields
    fields = _fields(difference, loop, side.loop(j), tuple(told))
    keys = (_written(field, entries) or _unwritten(field, loop, side.vendor) for field in fields)
    return next(filter(None, keys), "")


def _written(field: str, entries: Sequence[SourceField]) -> str:
    """The key of a file that says a neutral field; empty where none does."""
    return next((entry.path for entry in entries if any(overlap(field, to) for to in entry.to)), "")


def _unwritten(field: str, loop: Loop, vendor: Vendor) -> str:
    """The key where a vendor has a neutral field that its file does not give; empty where it has none."""
    alone = loop.model_copy(update={"setpoint": loop.setpoint.model_copy(update={"source": None})})
    try:
        file = target_of(vendor).from_neutral(GenericFile(pidcfg=1, vendor="generic", loops=[alone]), {})
    except ConvertError:
        return ""
    return next((entry.path for entry in file.fields[0] if entry.neutral and overlap(field, entry.neutral)), "")


def field_of(difference: SignalDifference, loop: Loop, other: Loop, told: Iterable[str] = ()) -> str:
    """The neutral field that explains a difference of two loops; empty where none is known."""
    return next(_fields(difference, loop, other, tuple(told)), "")


def _fields(difference: SignalDifference, loop: Loop, other: Loop, told: Sequence[str]) -> Iterator[str]:
    """The neutral fields that may explain a difference of two loops, the likeliest first."""
    one, two = neutral_values(loop, other)
    if difference.signal in {"pv", "output", "setpoint"}:
        two |= {path: value for path, value in flatten(other).items() if path.startswith(RANGES)}
    elsewhere = {*LABELS, *(() if difference.stage == "start" else AT_START)}
    if not loop.tuning.integral_time:
        elsewhere.discard("output.bias")
    if "manual" not in {loop.mode, other.mode}:
        elsewhere.add(BY_HAND)
    if not loop.tuning.derivative_time and not other.tuning.derivative_time:
        elsewhere.add("tuning.derivative_on")
    fields = [
        field
        for field in differing(one, two)
        if field not in elsewhere and is_material(field, one, two) and not any(overlap(field, name) for name in told)
    ]
    kinds = (*_first_kinds(difference, fields, loop, other), *_kinds(difference, loop))
    yield from (field for kind in kinds for field in fields if field.startswith(kind))


def _first_kinds(difference: SignalDifference, fields: Sequence[str], loop: Loop, other: Loop) -> Sequence[str]:
    """What explains a difference before all else: the range of limits that look alike; a limit that is reached."""
    if difference.signal not in {"pv", "output"}:
        return ()
    if loop.output.limits == other.output.limits and any(field.startswith("output.limits") for field in fields):
        return ("output.range",)
    return AT_LIMITS if _stands_at_a_limit(difference, loop, other) else ()


def _kinds(difference: SignalDifference, loop: Loop) -> Iterator[str]:
    """What may explain a difference, the most direct first."""
    signal, stage = difference.signal, difference.stage
    if signal == "sample time":
        yield "sample_time"
    if signal in {"pv", "output"}:
        yield "pv.range"
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


def _stands_at_a_limit(difference: SignalDifference, loop: Loop, other: Loop) -> bool:
    """Whether one side's output stands at a limit that the other side goes beyond."""
    if difference.signal != "output":
        return False
    ends = zip((loop, other), (difference.before, difference.after), strict=True)
    return any(_is_limit(one, float(share)) for one, share in ends if isinstance(share, float))


def _is_limit(loop: Loop, share: float) -> bool:
    """Whether an output, as a share of its range, is one of a loop's limits."""
    low, high = loop.output.range
    return any(abs(float((limit - low) / (high - low)) - share) < NEAR_LIMIT for limit in loop.output.limits or ())


def is_material(field: str, one: Mapping[str, Any], two: Mapping[str, Any]) -> bool:
    """Whether a field differs by more than the rounding of a file."""
    a, b = number_of(one.get(field)), number_of(two.get(field))
    if a is None or b is None or isinstance(one.get(field), bool):
        return True
    return abs(a - b) > _scale(field, a, b, one) * type(a)(str(MATERIAL_SHARE))


def _scale(field: str, a: Decimal, b: Decimal, values: Mapping[str, Any]) -> Decimal:
    """What a difference of a field is a share of."""
    ranged = {"setpoint.": "pv.range", "alarms.pv.": "pv.range", "pv.range": "pv.range", "output.": "output.range"}
    name = next((name for kind, name in ranged.items() if field.startswith(kind)), None)
    ends = [number_of(values.get(f"{name}.{end}")) for end in "01"]
    if name is None or ends[0] is None or ends[1] is None:
        return max(abs(a), abs(b))
    return abs(ends[1] - ends[0])
