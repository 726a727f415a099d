"""What a line of the report explains, and which key of the other side explains a difference."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pidcfg.conversion.builder import flatten
from pidcfg.conversion.contract import source_of, target_of
from pidcfg.conversion.ledger import ConvertError, number_of, overlap
from pidcfg.conversion.operation import PREFIX
from pidcfg.schemas.generic import GenericFile
from pidcfg.study.verification.comparison import (
    FOLLOWS,
    LIMIT_DISTANCE,
    SAMPLE_TOLERANCE,
    SMOOTHING,
    difference_of_rules,
    differing,
    distance_at,
    neutral_of,
    neutral_values,
    same_value,
)
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from decimal import Decimal
    from typing import Any

    from pidcfg.conversion.ledger import SourceField
    from pidcfg.conversion.operation import Operation
    from pidcfg.schemas.generic import Loop
    from pidcfg.study.verification.comparison import SignalDifference
    from pidcfg.study.verification.stages import Bench, Stage
    from pidcfg.study.verification.trial import Side, Trial
    from pidcfg.study.verification.twin import ReportLine
    from pidcfg.vendors import Vendor

# ----------------------------------------------------------------------------------------------------------------------
# Which key of the other side explains a difference: among the neutral fields that differ, the one that acts on it.

LABELS = ("name", "description", "pv.unit", "output.unit")
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
        if field not in elsewhere and _is_material(field, one, two) and not any(overlap(field, name) for name in told)
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


def _is_material(field: str, one: Mapping[str, Any], two: Mapping[str, Any]) -> bool:
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


# --- Lines that are true of the side that runs: one that says something else of it explains nothing -------------------


def true_lines(lines: Sequence[ReportLine], loop: Loop, side: Side, j: int) -> Iterator[ReportLine]:
    """The lines that fit the loop at ``j`` of a side; ``loop`` is the one that it is held against."""
    operation: Operation = source_of(side.vendor).operations(side.config)[j]
    _, values = neutral_values(loop, side.loop(j))
    for line in lines:
        if line.neutral.startswith(PREFIX):
            rule = line.neutral.removeprefix(PREFIX)
            same_band = rule != "deadband" or same_value(values.get(rule), loop.deadband)
            if line.held in _answers(operation, rule) and same_band:
                yield line
        elif same_value(values.get(line.neutral), line.held):
            yield line


def _answers(operation: Operation, rule: str) -> set[str]:
    """What a loop does by a rule; without an integral it goes to Auto in another way."""
    answers = [getattr(operation, rule, None)]
    if rule == "transfer":
        answers.append(operation.without_integral)
    return {answer.text for answer in answers if answer is not None}


# --- What a line of the report explains, where no value of the source can follow it: another rule of the target -------
#
# A line about a rule explains only what follows from that rule: a windup rule acts from the time at which the output
# is at a limit, a transfer from the change to Auto, a dead band moves the PV by no more than the band.

LIMITED_DISTANCE = 0.02
"""How near to a limit an output may be limited on the other side: a share of its range."""
PV_ALARMS = {"low_low", "low", "high", "high_high"}
DEADBAND_WIDTHS = 4
"""Widths of a dead band within which a loop is led by its rule."""
LARGE_KICK = 2.0
"""Times what a filter lets more through of the largest change: both sides kick, and the loop answers."""
SLOW_SHARE = 0.02
"""Share of the range that the slowest integral of a PLC without its own switch moves a loop by in a stage."""
VALUES = ("pv", "output")
SETPOINT_MOVES = ("start", "auto", "step 5 %", "step 50 %", "dead band", "transfers", "set point limits")


@frozen
class Scene:
    """A stage as both sides went through it."""

    stage: Stage
    bench: Bench
    loop: Loop
    one: Trial
    two: Trial
    counts: float
    """By which the PVs may be apart for their rounding."""


def explains(line: ReportLine, difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether a line of the report is the reason of what differs at a sample."""
    path, signal = line.neutral, difference.signal
    if signal == "sample time":
        return path == "sample_time"
    if path.startswith("alarms."):
        return signal == _alarm(path)
    if k in difference.at_limits or (signal == "output" and scene.stage.name != "start" and _beyond(k, scene)):
        return False  # no rule explains another limit
    if signal not in {*VALUES, "setpoint", "mode"} and not _pv_differs(k, scene):
        return False
    if path == SMOOTHING:
        return _smoothed(difference_of_rules(line.change, scene.loop), difference, k, scene)
    rule = RULES.get(path)
    return rule is not None and rule(difference, k, scene)


def _pv_differs(k: int, scene: Scene) -> bool:
    """Whether the PVs are apart, so that an alarm of one of them may be on."""
    near = range(max(k - SAMPLE_TOLERANCE, 0), min(k + SAMPLE_TOLERANCE + 1, len(scene.one.pv)))
    return any(abs(scene.one.pv[n] - scene.two.pv[n]) > scene.counts for n in near)


def _alarm(path: str) -> str:
    """The alarm that a neutral field is of."""
    head, _, end = path.rpartition(".")
    return f"deviation_{end}" if head.endswith("deviation") else end


def _at_start(difference: SignalDifference, k: int, scene: Scene) -> bool:
    return scene.stage.name == "start"


def _from_zero(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Where one side goes on from its output in Manual, and the other from an integral of 0."""
    return difference.signal in VALUES and scene.stage.name == "start" and scene.loop.mode != "manual"


def _first_in_manual(difference: SignalDifference, k: int, scene: Scene) -> bool:
    return difference.signal in VALUES and scene.stage.name == "start"


def _since_auto(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """From the last change to Auto on, where the stage has one while it is compared."""
    if difference.signal == "mode" or (difference.signal == "setpoint" and scene.stage.name == "start"):
        return False
    stage, sample = scene.stage, scene.bench.sample
    changes = [act.at for act in stage.acts if act.mode == "auto" and act.at >= stage.begin]
    if stage.name == "start":
        changes = [0.0] if {*scene.one.modes[: k + 1], *scene.two.modes[: k + 1]} - {"manual"} else []
    return bool(changes) and k * sample >= changes[0] - 2 * sample


def _transfer(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """The same for PV and output."""
    return difference.signal not in {"setpoint", "mode"} and _since_auto(difference, k, scene)


def _rate_anew(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """From the change to Auto on, by what the derivative makes of the PV's rate at that time."""
    if difference.signal not in VALUES or not _since_auto(difference, k, scene):
        return False
    bench, loop, sample = scene.bench, scene.loop, scene.bench.sample
    ns = [round(act.at / sample) for act in scene.stage.acts if act.mode == "auto"]
    rates = [abs(trial.pv[n] - trial.pv[n - 1]) / sample for trial in (scene.one, scene.two) for n in ns if n]
    width = float(loop.output.range[1] - loop.output.range[0])
    most = LARGE_KICK * abs(float(loop.tuning.gain * loop.tuning.derivative_time)) / width * max(rates, default=0.0)
    return _within(most * (abs(bench.gain) if difference.signal == "pv" else 1.0), difference, k, scene)


def _within(most: float, difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether both sides are apart by no more than a line makes them, besides what is allowed."""
    one, two = (getattr(trial, difference.signal)[k] for trial in (scene.one, scene.two))
    return bool(abs(one - two) <= difference.allowed + most)


def _within_a_sample(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether one side comes by less than a sample later."""
    if difference.signal not in VALUES:
        return False
    one, two = (getattr(trial, difference.signal) for trial in (scene.one, scene.two))
    return distance_at(one, two, k, 1) <= difference.allowed


def _since_manual(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """From the change to Manual on."""
    changes = [act.at for act in scene.stage.acts if act.mode == "manual" and act.at >= scene.stage.begin]
    return difference.signal not in {"setpoint", "mode"} and bool(changes) and k * scene.bench.sample >= changes[0]


def _kick(difference: SignalDifference, k: int, scene: Scene) -> bool:
    derives = bool(scene.loop.tuning.derivative_time)
    return derives and difference.signal in VALUES and scene.stage.name in SETPOINT_MOVES


def _smoothed(share: float, difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether a difference is no larger than what another filter of the derivative makes of the stage's changes."""
    if difference.signal not in VALUES:
        return False
    bench, tuning = scene.bench, scene.loop.tuning
    first = round(scene.stage.begin / bench.sample)
    changes = range(max(first, 1), k + 1)
    jumps = [_error(trial, n) - _error(trial, n - 1) for trial in (scene.one, scene.two) for n in changes]
    width = float(scene.loop.output.range[1] - scene.loop.output.range[0])
    rate = abs(float(tuning.gain)) * float(tuning.derivative_time) / bench.sample / width
    most = LARGE_KICK * share * rate * max(map(abs, jumps), default=0.0)
    if difference.signal == "pv":
        most *= abs(bench.gain) * min(1.0, LARGE_KICK * bench.sample / bench.time_constant)
    return _within(most, difference, k, scene)


def _error(trial: Trial, n: int) -> float:
    return trial.setpoint[n] - trial.pv[n]


def _since_limit(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """From the time at which the output of the first side is at one of its limits."""
    if difference.signal in {"setpoint", "mode"}:
        return False
    low, high = scene.bench.limits
    one = scene.one
    if scene.stage.name == "start" and not low < _first_output(scene.loop) < high:
        return all(trial.modes[k] != "manual" for trial in (one, scene.two))
    return any(
        not low + LIMITED_DISTANCE < one.output[n] < high - LIMITED_DISTANCE and one.modes[n] != "manual"
        for n in range(min(k + 3, len(one.output)))
    )


def _beyond(k: int, scene: Scene) -> bool:
    """Whether the other side's output is beyond the limits."""
    low, high = scene.bench.limits
    return not low - LIMIT_DISTANCE <= scene.two.output[k] <= high + LIMIT_DISTANCE


def _first_output(loop: Loop) -> float:
    """With which a loop begins, as a share of its range."""
    low, high = (float(end) for end in loop.output.range)
    return ((0.0 if loop.output.manual is None else float(loop.output.manual)) - low) / (high - low)


def _within_band(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether a difference is no larger than what the dead band can make.

    Beyond it a loop answers to the whole error, or to what is beyond its edge: no more than a band apart.
    """
    if difference.signal not in VALUES:
        return False
    bench, band, loop = scene.bench, float(scene.loop.deadband), scene.loop
    share = abs(float(loop.tuning.gain)) * band / float(loop.output.range[1] - loop.output.range[0])
    kicked = share * (1 + float(loop.tuning.derivative_time) / bench.sample)
    one, two = (getattr(trial, difference.signal)[k] for trial in (scene.one, scene.two))
    if scene.stage.swept:
        inside = any(abs(side.setpoint[k] - side.pv[k]) <= band for side in (scene.one, scene.two))
        return difference.signal == "output" and (inside or abs(one - two) <= kicked + difference.allowed)
    most = DEADBAND_WIDTHS * (band if difference.signal == "pv" else max(kicked, band / abs(bench.gain)))
    return bool(abs(one - two) <= most)


def _slow_integral(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether a difference is no larger than what the slowest integral makes of a loop that shall have none."""
    if difference.signal not in VALUES or scene.loop.tuning.integral_time:
        return False
    one, two = (getattr(trial, difference.signal) for trial in (scene.one, scene.two))
    span = 1.0 if difference.signal == "output" else scene.bench.span
    return distance_at(one, two, k, 1) <= difference.allowed + SLOW_SHARE * span


def _later(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether one side only comes later, by no more than the filter and some samples."""
    if difference.signal not in VALUES:
        return False
    one, two = (getattr(trial, difference.signal) for trial in (scene.one, scene.two))
    window = 3 + int(float(scene.loop.pv.filter) / scene.bench.sample)
    return distance_at(one, two, k, window) <= difference.allowed


def _alarmed(difference: SignalDifference, k: int, scene: Scene) -> bool:
    """Whether an alarm of the PV was on, on either side, when Auto was last asked for."""
    sample = scene.bench.sample
    asked = [round(act.at / sample) for act in scene.stage.acts if act.mode == "auto" and act.at <= k * sample]
    if scene.stage.output is None:
        asked = [0]
    return any(
        any(trial.alarms[name][at : at + 2])
        for at in asked[-1:]
        for trial in (scene.one, scene.two)
        for name in PV_ALARMS & trial.alarms.keys()
    )


RULES: Mapping[str, Callable[[SignalDifference, int, Scene], bool]] = {
    "mode": _at_start,
    "setpoint.follows_pv": _since_auto,
    "tuning.derivative_on": _kick,
    "anti_windup": _since_limit,
    "pv.filter": _later,
    "tuning.integral_time": _slow_integral,
    f"{PREFIX}start": _from_zero,
    f"{PREFIX}transfer": _transfer,
    f"{PREFIX}rate": _rate_anew,
    f"{PREFIX}filter": _within_a_sample,
    f"{PREFIX}master": _at_start,
    "output.manual": _first_in_manual,
    f"{PREFIX}manual": _since_manual,
    f"{PREFIX}windup": _since_limit,
    f"{PREFIX}deadband": _within_band,
    f"{PREFIX}interlock": _alarmed,
}
"""What a line explains, by its neutral field; alarms explain themselves."""


def find_line(difference: SignalDifference, lines: Sequence[ReportLine], scene: Scene) -> tuple[ReportLine | None, int]:
    """The line that explains where a difference begins; None and the first sample that no line explains."""
    first = None
    for k in difference.samples:
        line = next((line for line in lines if explains(line, difference, k, scene)), None)
        if line is None:
            return None, k
        first = first or line
    return first, difference.samples[0]
