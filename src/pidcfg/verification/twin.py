"""The source with what the report of a conversion says was written: rounded, clamped, assumed or dropped.

Each neutral field that differs between both sides, and that a line of the report names, is brought to the target's
value by changing the source's own key (`edits`), so that the twin runs the source's algorithm with the target's
numbers. A line that no key can follow changes nothing: `lines` says what it explains.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Any

from pidcfg.conversion.ledger import overlap
from pidcfg.conversion.operation.rules import PREFIX, differing_rules
from pidcfg.conversion.values import number_of
from pidcfg.verification.edits import Builder
from pidcfg.verification.names import slaves_of
from pidcfg.verification.neutral import ACTION, FOLLOWS, differing, neutral_of, neutral_values, same
from pidcfg.verification.smoothing import FILTER, SMOOTHING, alike

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.conversion.ledger import Change, NeutralLoop
    from pidcfg.conversion.operation.rules import Operation
    from pidcfg.conversion.pipeline import LoopReport
    from pidcfg.schemas.generic import Loop
    from pidcfg.vendors import Vendor

SLACK = 5.0
"""How much more than a line's own error the neutral value may differ: a share of a filter is not its time."""
RULES_OF_FIELDS = frozenset(("tuning.integral_time",))
"""Neutral fields that a target may have with another rule, although the value is the same."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of the report, the loop that it is of, and the neutral field that it explains."""

    neutral: str
    change: Change
    held: Any = None
    """What the target has in that field: the line explains nothing where it has something else."""


@dataclass(slots=True)
class Twin:
    """The source as the report has it."""

    config: Any
    followed: dict[int, list[Line]] = field(default_factory=dict)
    """By loop the lines that the twin follows."""
    left: dict[int, list[Line]] = field(default_factory=dict)
    """By loop the lines that no key of the source can follow."""


def twin_of(
    config: Any,
    vendor: Vendor,
    result: Any,
    target: Vendor,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
) -> Twin:
    """The twin of a source for a conversion's result and its report; ``pairs``: the places of loops on both sides."""
    builder = Builder(vendor, config)
    twin = Twin(config)
    after, fields = neutral_of(result, target)
    for i, j in pairs:
        other = after[j]
        if other is not None and builder.loop(i) is not None:
            twin.followed[i], twin.left[i] = _of_loop(builder, i, report[i].changes, other, partial(_places, fields[j]))
    for i, j in pairs:
        if i in twin.left:
            twin.left[i] += _consequences(builder, i, target.load("operation")(result)[j], twin, after[j])
    twin.config = builder.config
    return twin


def _consequences(builder: Builder, i: int, after: Operation, twin: Twin, other: Loop | None) -> list[Line]:
    """Rules that differ because the twin follows a line, such as another form of the equation."""
    because = [line.change for line in twin.followed[i] if line.neutral in {"", FOLLOWS}]
    known = {line.neutral for line in (*twin.left[i], *twin.followed[i])}
    if not because or other is None:
        return []
    before = builder.vendor.load("operation")(builder.config)[i]
    slaves = slaves_of(neutral_of(builder.config, builder.vendor)[0], i)
    rules = differing_rules(before, after, other, is_master=bool(slaves))
    return [Line(rule.field, because[0], rule.target) for rule in rules if rule.field not in known]


def _of_loop(
    builder: Builder, i: int, changes: Sequence[Change], other: Loop, of_target: Callable[[str], tuple[str, ...]]
) -> tuple[list[Line], list[Line]]:
    followed: list[Line] = []
    left: list[Line] = []
    values = [change for change in changes if not change.field.startswith(PREFIX)]
    for change in values:
        if change.kind == "dropped" and change.loss and not change.neutral:
            (followed if builder.reset(i, change.field) else left).append(Line("", change))
    first = differing(*neutral_values(builder.whole(i), other))
    for path in first:
        one, two = neutral_values(builder.whole(i), other)
        if same(one.get(path), two.get(path)):
            continue  # it went with another one
        rows = [c for c in values if c.kind != "exact" and any(overlap(path, name) for name in c.neutral)]
        if not rows or path == ACTION or _more_than_said(one.get(path), two.get(path), rows):
            continue
        if any(builder.bring(i, key, path, two.get(path)) for key in _keys(builder, i, path)):
            followed.extend(Line(path, change) for change in rows)
    _restore(builder, i, other, first)
    followed.extend(_smoothed(builder, i, changes, other))
    through = [line.change.field for line in followed]
    rules = [row for row in changes if row.field.startswith(PREFIX) and row.field not in through]
    left.extend(Line(row.field, row, row.target) for row in rules)
    rest = differing(*neutral_values(builder.whole(i), other))
    for change in values:
        for name in change.neutral or of_target(change.field):
            is_rule = name in RULES_OF_FIELDS and bool(change.note)
            if is_rule or (change.kind != "exact" and any(overlap(name, path) for path in rest)):
                left.append(Line(name, change, neutral_values(builder.whole(i), other)[1].get(name)))
    return followed, left


def _smoothed(builder: Builder, i: int, changes: Sequence[Change], other: Loop) -> Iterator[Line]:
    """Gives the filter of the derivative the time constant that lets as much through as the target's."""
    row = next((row for row in changes if row.field == SMOOTHING), None)
    if row is None:
        return
    wanted = alike(row, other)
    if any(builder.bring(i, key, FILTER, wanted) for key in _keys(builder, i, FILTER)):
        yield Line(row.field, row, row.target)


def _restore(builder: Builder, i: int, other: Loop, first: Sequence[str]) -> None:
    """Brings back what went with another field: the alarms of a loop whose root is taken elsewhere."""
    for path in differing(*neutral_values(builder.whole(i), other)):
        if path not in first:
            _, two = neutral_values(builder.whole(i), other)
            any(builder.bring(i, key, path, two.get(path)) for key in _keys(builder, i, path))


def _keys(builder: Builder, i: int, path: str) -> list[str]:
    """The keys of a loop that a neutral field comes from."""
    return [entry.path for entry in builder.fields(i).fields if any(overlap(path, to) for to in entry.to)]


def _places(fields: NeutralLoop, key: str) -> tuple[str, ...]:
    """The neutral fields of a key that the target has and the source has not."""
    return tuple(name for entry in fields.fields if entry.path == key for name in entry.to)


def _more_than_said(one: Any, two: Any, rows: Sequence[Change]) -> bool:
    """Whether a number differs by more than its line says: then the line does not explain it."""
    if {change.kind for change in rows} != {"rounded"}:
        return False
    a, b = number_of(one), number_of(two)
    if a is None or b is None or not a:
        return False
    return float(abs(b - a) / abs(a)) * 100 > SLACK * max(change.error_percent for change in rows) + 0.1
