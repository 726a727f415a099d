"""What explains a difference: the source's loop as the lines of the report say, and the key of the other side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

from pidcfg.conversion import LOSSES, Change, ConvertError, do_overlap, number_of
from pidcfg.conversion import operation as rules_of_operation
from pidcfg.conversion.builder import flatten
from pidcfg.conversion.operation import PREFIX, Answer, Operation, WithoutIntegral, first_output, source_of, target_of
from pidcfg.conversion.pipeline import LoopReport
from pidcfg.encoders.codecs import DecodeError, EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.encoders.image import default_of
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.study.verification.comparison import (
    ACTION,
    DERIVATIVE_TIME,
    FOLLOWS_PV_FIELD,
    GAIN,
    INTEGRAL_TIME,
    LABEL_FIELDS,
    differing_fields,
    neutral_values,
)
from pidcfg.study.verification.trial import loops_of, neutral_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, parse_path, value_at
from pidcfg.vendors import Vendor

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.conversion import SourceField
    from pidcfg.study.verification.comparison import SignalDifference
    from pidcfg.study.verification.trial import Side

# Design. The stand-in of a conversion has every number of the source's file. It takes another number only where a line
# of the report says which one was written: then the target must have that very number, so that a line about a gain
# excuses no other gain. A rule is another one only where a line says so, and is the rule that the line names, whatever
# the target does. The action is never another one.

MANUAL_OUTPUT = "output.manual"
"""Acts in a loop that starts in Manual, and in no other."""
PROPORTIONAL = "tuning.proportional"
SAME_TOLERANCE = Decimal("1e-4")
"""Share by which a number may differ from the one that its line says."""
LINE_TOLERANCE = Decimal(5)
"""How much more than a line's own error a value may be off, where the line says it in another unit; in errors, and in
percent."""
MIN_ERROR = Decimal("0.1")
PLC_DETAILS = (
    "has_edge",
    "leads_master",
    "moves_by_hand",
    "limits_master",
    "follows_output",
    "keeps_following",
    "slowest_integral",
)
"""What is so with a PLC, whatever a file says, and too little for a line of a report."""
NO_WIDTH = Decimal(0)
PERCENT = (Decimal(0), Decimal(100))
ALARMS_PREFIX = "alarms."
"""Points that a PLC with one switch for a whole group has, too, where they do least."""
POSITION_FIELDS = {"output.limits": "output", "output.bias": "output", "setpoint.": "pv", "alarms.pv.": "pv"}
"""Neutral fields that are positions on a range."""
END_STEPS = ("0", "1")
"""Last steps of the paths of a range or of limits."""


@frozen
class ReportLine:
    """A line of the report, and the neutral field or the rule (`operation.windup`) that it is about."""

    neutral: str
    change: Change


@dataclass(slots=True)
class ReportedLoops:
    """The loops of a source as a report has them, by their places."""

    loops: list[Loop | None]
    rules: list[Operation]
    lines: dict[int, list[ReportLine]] = field(default_factory=dict)
    """What each loop follows."""


def reported_loops(
    config: Any,
    vendor: Vendor,
    result: Any,
    target: Vendor,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
) -> ReportedLoops:
    """The loops of a source for a conversion's result and its report; ``pairs``: the places of loops on both sides."""
    before, (after, fields) = neutral_of(config, vendor)[0], neutral_of(result, target)
    operations, other_rules = source_of(vendor).operations(config), source_of(target).operations(result)
    copy = ReportedLoops(list(before), list(operations))
    for i, j in pairs:
        loop, other = before[i], after[j]
        if loop is None or other is None:
            continue
        changes = report[i].changes
        neutral_by_key = {entry.path: entry.neutral for entry in fields[j].fields}
        reported = dict(_reported_fields(loop, other, changes, neutral_by_key))
        begin_values = {} if loop.mode != "manual" else {MANUAL_OUTPUT: first_output(operations[i], loop)}
        copy.loops[i] = replace_fields(loop, begin_values | {path: value for path, (value, _) in reported.items()})
        copy.rules[i] = replace_rules(operations[i], changes, other_rules[j], integral=bool(loop.tuning.integral_time))
        if reported.get(MANUAL_OUTPUT, (0, None))[0] is None:
            copy.rules[i] = replace(copy.rules[i], zero=other_rules[j].zero)  # it begins as the target does without
        copy.lines[i] = [ReportLine(path, row) for path, (_, row) in reported.items()]
        copy.lines[i] += [ReportLine(row.field, row) for row in changes if row.field.startswith(PREFIX)]
        copy.lines[i] += [ReportLine("", row) for row in changes if _is_beyond_neutral(row)]
    return copy


def _reported_fields(
    loop: Loop, other: Loop, changes: Sequence[Change], neutral_by_key: Mapping[str, Sequence[str]]
) -> Iterator[tuple[str, tuple[Any, Change]]]:
    """The neutral fields in which the target differs as a line says: its value, and the line.

    ``neutral_by_key``: the neutral fields of the target's keys. A line may say an output in the target's own unit
    where that is per cent, which no file need say; any other scale is one that a file says, and must have the
    source's ends.
    """
    one, two = neutral_values(loop, other)
    target = flatten(other) if other.output.range == PERCENT else two
    for path in differing_fields(one, two):
        if path == ACTION or path in LABEL_FIELDS:
            continue
        rows = [row for row in changes if row.kind != "exact" and _is_about(row, path, neutral_by_key)]
        section = "pv" if path.startswith("setpoint") else "output"
        is_end = "limits" in path and two.get(path) in {one.get(f"{section}.range.0"), one.get(f"{section}.range.1")}
        width = _range_width(path, one)
        row = next(
            (r for r in rows if is_end or _is_listed(path, one.get(path), two.get(path), target.get(path), r, width)),
            None,
        )
        if row is not None:
            yield path, (two.get(path), row)
            if path == PROPORTIONAL and not loop.tuning.proportional and _acts_alike(one, two):
                yield from ((name, (two[name], row)) for name in (GAIN, INTEGRAL_TIME, DERIVATIVE_TIME))


def _acts_alike(one: Mapping[str, Any], two: Mapping[str, Any]) -> bool:
    """Whether integral and derivative act as strongly with a gain that is smaller and hardly acts itself."""
    gain, other = one[GAIN], two[GAIN]
    pairs = (
        (gain * two[INTEGRAL_TIME], other * one[INTEGRAL_TIME]),
        (gain * one[DERIVATIVE_TIME], other * two[DERIVATIVE_TIME]),
    )
    return abs(other) < abs(gain) and all(abs(a - b) <= SAME_TOLERANCE * max(abs(a), abs(b)) for a, b in pairs)


def _is_about(row: Change, path: str, neutral_by_key: Mapping[str, Sequence[str]]) -> bool:
    names = (*row.neutral, *neutral_by_key.get(row.target_field, ()))
    return not row.field.startswith(PREFIX) and any(do_overlap(path, name) for name in names)


def _is_listed(path: str, before: Any, after: Any, target: Any, row: Change, width: Decimal = NO_WIDTH) -> bool:
    """Whether a target's value is the one that a line of the report says.

    ``target``: on the target's scale, which a line about a rounded number never excuses; ``width``: of the scale that a
    position is on.
    """
    one, two = number_of(before), number_of(after)
    if row.terms is not None and row.terms.field == path:
        return two is not None and abs(two - row.terms.held) <= SAME_TOLERANCE * max(abs(two), abs(row.terms.held))
    is_said = _is_target(two, row) or (row.kind != "rounded" and _is_target(number_of(target), row))
    if not isinstance(after, bool | str) and two is not None and one is not None:
        most = (LINE_TOLERANCE * Decimal(row.error_percent) + MIN_ERROR) / 100
        is_near = abs(two - one) <= most * max(abs(one), abs(two), width)
        is_dropped = row.kind == "dropped" and (path.startswith(ALARMS_PREFIX) or _is_default(path, after))
        return is_near or is_said or is_dropped
    if two is None or one is None:
        return is_said or (not two and row.kind == "dropped")
    return row.kind in LOSSES


def _range_width(path: str, values: Mapping[str, Any]) -> Decimal:
    """The width of the range that a position is on; 0 for what is no position."""
    section = next((name for kind, name in POSITION_FIELDS.items() if path.startswith(kind)), None)
    ends = [number_of(values.get(f"{section}.range.{end}")) for end in END_STEPS]
    return abs(ends[1] - ends[0]) if ends[0] is not None and ends[1] is not None else NO_WIDTH


def _is_target(value: Decimal | None, row: Change) -> bool:
    """Whether a line says this number for the target."""
    held = number_of(row.target)
    return held is not None and value is not None and abs(held - value) <= SAME_TOLERANCE * max(abs(held), abs(value))


def _is_default(path: str, value: Any) -> bool:
    """Whether a neutral value is what a loop has that does not give it."""
    return not value if path == FOLLOWS_PV_FIELD else bool(value == default_of(Loop, path))


def replace_fields(loop: Loop, values: Mapping[str, Any]) -> Loop:
    """A neutral loop with other values; None takes a value away."""
    if not values:
        return loop
    data = loop.model_dump(exclude_none=True)
    for path, value in values.items():
        *parents, last = path.split(".")
        if last in END_STEPS:
            section, pair = parents
            section_data = data[section]
            ends = list(section_data.get(pair) or section_data.get("range") or data["pv"]["range"])
            ends[int(last)] = value
            section_data[pair] = tuple(ends)
            continue
        parent = data
        for key in parents:
            parent = parent.setdefault(key, {})
        if value is None:
            parent.pop(last, None)
        else:
            parent[last] = value
    if not data["output"].get("pulse", {"period": 1}).get("period"):
        del data["output"]["pulse"]
    return Loop.model_validate(data)


def replace_rules(operation: Operation, changes: Sequence[Change], target: Operation, *, integral: bool) -> Operation:
    """The rules of a loop with those that the lines of a report name; ``target``: what they are of."""
    answers: dict[str, Any] = {name: getattr(target, name) for name in PLC_DETAILS}
    answers["squares_error"] = operation.squares_error and target.squares_error
    if not integral and target.slowest_integral:
        answers |= {"windup": target.windup, "transfer": target.transfer}
    for row in changes:
        rule = row.field.removeprefix(PREFIX)
        if rule == row.field:
            continue
        for name in (rule, *(("without_integral",) if rule == "transfer" else ())):
            answer = _find_answer(name, row.target)
            if answer is not None:
                answers[name] = answer
    if not integral and answers.get("without_integral") is WithoutIntegral.CONSTANT:
        answers["windup"] = target.windup  # whether the limits of the output bound a constant bias, too
    return replace(operation, **answers)


def _find_answer(rule: str, text: Any) -> Answer | None:
    """The answer of a rule by its text; None: it is one of another rule."""
    kind = WithoutIntegral if rule == "without_integral" else getattr(rules_of_operation, rule.capitalize(), None)
    return None if kind is None else next((answer for answer in kind if answer.text == text), None)


# --- The source without what a report says is lost, and no neutral loop has ------------------------------------------

UNFIT_ERRORS = (ArithmeticError, ConvertError, DecodeError, EncodeError, LookupError, TypeError, ValueError)
"""What a configuration without one of its keys may raise on the way to its registers."""
CONDITION_KEY = "when"
"""The key that says when an entry of a list is carried out."""


def _is_beyond_neutral(row: Change) -> bool:
    """Whether something is lost that no neutral loop has."""
    return row.kind == "dropped" and row.loss and not row.neutral and not row.field.startswith(PREFIX)


def drop_losses(config: Any, vendor: Vendor, report: Sequence[LoopReport]) -> Any:
    """A configuration in which every key that is lost, and that is part of no neutral field, is as if not given."""
    for i, loop in enumerate(report):
        for row in loop.changes:
            if _is_beyond_neutral(row):
                config = _drop_key(config, vendor, i, row.field)
    return config


def _drop_key(config: Any, vendor: Vendor, i: int, key: str) -> Any:
    """The same without a key of a loop; as it is where it cannot be without."""
    path = _key_path(config, i, key)
    if path is None:
        return config
    entry = value_at(config, path)
    try:
        if isinstance(path[-1], int) and CONDITION_KEY in getattr(type(entry), "model_fields", {}):
            config_without = replace_value(config, (*path, CONDITION_KEY), value=False)  # a copy that is never made
        else:
            owner = value_at(config, path[:-1])
            row = type(owner).model_fields[str(path[-1])]
            if row.is_required():
                return config
            config_without = replace_value(config, path, value=row.get_default(call_default_factory=True))
        encoder_of(vendor).encode(config_without)
        return config if loops_of(config_without, vendor)[i] is None else config_without
    except (AttributeError, *UNFIT_ERRORS):
        return config


def _key_path(config: Any, i: int, key: str) -> Path | None:
    """Where a key of a loop stands in the file: below the loop, else in the file itself; None: nowhere."""
    path = parse_path(key)
    if str(path[0]) in type(config.loops[i]).model_fields:
        return ("loops", i, *path)
    blocks = [block.name for block in getattr(config, "blocks", ())]
    if path[0] == "blocks" and path[1] in blocks:
        return ("blocks", blocks.index(str(path[1])), *path[2:])
    return path if str(path[0]) in type(config).model_fields else None


def replace_value(model: Any, path: Path, *, value: Any) -> Any:
    """A model with another value at a path."""
    if not path:
        return value
    step, below = path[0], path[1:]
    if isinstance(model, BaseModel):
        return model.model_copy(update={str(step): replace_value(getattr(model, str(step)), below, value=value)})
    items = list(model)
    items[int(step)] = replace_value(items[int(step)], below, value=value)
    return tuple(items) if type(model) is tuple else type(model)(*items)


# ----------------------------------------------------------------------------------------------------------------------
# Which key of the other side explains a difference: among the neutral fields that differ, the one that acts on it.

RANGE_FIELDS = ("pv.range", "output.range")
"""Of which gains and limits are shares in some PLCs; another range of the output is often but another scale."""
CONTROL_FIELDS = (
    "pv.range",
    "tuning.",
    "output.limits",
    "pv.",
    "sample_time",
    "deadband",
    "anti_windup",
    "setpoint.limits",
    FOLLOWS_PV_FIELD,
    "output.",
)
FIELDS_OF_SIGNALS: Mapping[str, Sequence[str]] = {
    "sample time": ("sample_time",),
    "mode": ("mode", "setpoint.source"),
    "setpoint": ("setpoint.", "mode", "pv.range"),
    "pv": ("pv.filter", "pv.range", "pv.", "output_raises_pv", *CONTROL_FIELDS),
    "output": ("output_raises_pv", *CONTROL_FIELDS),
}
"""Neutral fields that move a signal, those first that do it most directly; alarms have their own."""
ALARM_CONTEXT = ("alarms.hysteresis", "pv.", "setpoint.limits")
"""What an alarm depends on besides its own limit."""
FIELDS_AT_LIMITS = ("output_raises_pv", "output.limits", "anti_windup")
"""Those first in the stages at the limits of the output."""
FIELDS_AT_START = ("mode", "setpoint.value", "output.manual", "output.bias")
"""Those that act as configured at the start alone: elsewhere the battery sets what they say."""
LIMIT_ZONE = 0.002
"""Of its range: an output so near to a limit stands at it."""
MATERIAL_SHARE = 0.005
"""From which difference on a number explains anything: a share of it, or of the range of the PV or the output."""


def explaining_key(difference: SignalDifference, loop: Loop, side: Side, j: int, reported: Iterable[str] = ()) -> str:
    """The key of the other side that explains a difference; empty where none is known.

    ``reported``: neutral fields of which the report says that they differ.
    """
    entries = neutral_of(side.config, side.vendor)[1][j].fields
    fields = _explaining_fields(difference, loop, side.loop(j), tuple(reported))
    keys = (_key_in_file(field, entries) or _key_not_given(field, loop, side.vendor) for field in fields)
    return next(filter(None, keys), "")


def _key_in_file(field: str, entries: Sequence[SourceField]) -> str:
    """The key of a file that says a neutral field; empty where none does."""
    return next((entry.path for entry in entries if any(do_overlap(field, to) for to in entry.neutral)), "")


def _key_not_given(field: str, loop: Loop, vendor: Vendor) -> str:
    """The key where a vendor has a neutral field that its file does not give; empty where it has none."""
    alone = loop.model_copy(update={"setpoint": loop.setpoint.model_copy(update={"source": None})})
    try:
        file = target_of(vendor).from_neutral(GenericFile(pidcfg=1, vendor="generic", loops=[alone]), {})
    except ConvertError:
        return ""
    return next((entry.path for entry in file.fields[0] if entry.neutral and do_overlap(field, entry.neutral)), "")


def field_of(difference: SignalDifference, loop: Loop, other: Loop, reported: Iterable[str] = ()) -> str:
    """The neutral field that explains a difference of two loops; empty where none is known."""
    return next(_explaining_fields(difference, loop, other, tuple(reported)), "")


def _explaining_fields(difference: SignalDifference, loop: Loop, other: Loop, reported: Sequence[str]) -> Iterator[str]:
    """The neutral fields that may explain a difference of two loops, the likeliest first."""
    one, two = neutral_values(loop, other)
    if difference.signal in {"pv", "output", "setpoint"}:
        two |= {path: value for path, value in flatten(other).items() if path.startswith(RANGE_FIELDS)}
    ignored = {*LABEL_FIELDS, *(() if difference.stage == "start" else FIELDS_AT_START)}
    if not loop.tuning.integral_time:
        ignored.discard("output.bias")
    if "manual" not in {loop.mode, other.mode}:
        ignored.add(MANUAL_OUTPUT)
    if not loop.tuning.derivative_time and not other.tuning.derivative_time:
        ignored.add("tuning.derivative_on")
    fields = [
        field
        for field in differing_fields(one, two)
        if field not in ignored
        and is_material(field, one, two)
        and not any(do_overlap(field, name) for name in reported)
    ]
    kinds = (*_first_kinds(difference, fields, loop, other), *_explaining_kinds(difference, loop))
    yield from (field for kind in kinds for field in fields if field.startswith(kind))


def _first_kinds(difference: SignalDifference, fields: Sequence[str], loop: Loop, other: Loop) -> Sequence[str]:
    """What explains a difference before all else: the range of limits that look alike; a limit that is reached."""
    if difference.signal not in {"pv", "output"}:
        return ()
    if loop.output.limits == other.output.limits and any(field.startswith("output.limits") for field in fields):
        return ("output.range",)
    return FIELDS_AT_LIMITS if _stands_at_a_limit(difference, loop, other) else ()


def _explaining_kinds(difference: SignalDifference, loop: Loop) -> Iterator[str]:
    """What may explain a difference, the most direct first."""
    signal, stage = difference.signal, difference.stage
    if signal == "sample time":
        yield "sample_time"
    if signal in {"pv", "output"}:
        yield "pv.range"
    if stage == "start":
        yield from FIELDS_AT_START
    elif not loop.tuning.integral_time:
        yield "output.bias"
    if stage.endswith("limit") and signal in {"pv", "output"}:
        yield from FIELDS_AT_LIMITS
    if stage == "manual":
        yield from ("output.limits", "output.range")
    if stage.startswith("dead band"):
        yield "deadband"
    if signal in FIELDS_OF_SIGNALS:
        kinds = FIELDS_OF_SIGNALS[signal]
    else:
        head, _, end = signal.partition("deviation_")
        kinds = (f"alarms.deviation.{end}" if end else f"alarms.pv.{head}", f"alarms.{signal}", *ALARM_CONTEXT)
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
    return any(abs(float((limit - low) / (high - low)) - share) < LIMIT_ZONE for limit in loop.output.limits or ())


def is_material(field: str, one: Mapping[str, Any], two: Mapping[str, Any]) -> bool:
    """Whether a field differs by more than the rounding of a file."""
    a, b = number_of(one.get(field)), number_of(two.get(field))
    if a is None or b is None or isinstance(one.get(field), bool):
        return True
    return abs(a - b) > _difference_scale(field, a, b, one) * type(a)(str(MATERIAL_SHARE))


def _difference_scale(field: str, a: Decimal, b: Decimal, values: Mapping[str, Any]) -> Decimal:
    """What a difference of a field is a share of."""
    ranged = {"setpoint.": "pv.range", "alarms.pv.": "pv.range", "pv.range": "pv.range", "output.": "output.range"}
    name = next((name for kind, name in ranged.items() if field.startswith(kind)), None)
    ends = [number_of(values.get(f"{name}.{end}")) for end in "01"]
    if name is None or ends[0] is None or ends[1] is None:
        return max(abs(a), abs(b))
    return abs(ends[1] - ends[0])
