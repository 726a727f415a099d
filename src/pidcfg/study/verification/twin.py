"""The source as the report of a conversion says it was written: keys changed until the neutral loop fits."""

from __future__ import annotations

from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from types import NoneType
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

from pidcfg.conversion.contract import source_of
from pidcfg.conversion.ledger import ConvertError, number_of, overlap
from pidcfg.conversion.operation import PREFIX, differing_rules
from pidcfg.encoders.codecs import DecodeError, EncodeError, nearest
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.base import Duration, Quantity
from pidcfg.study.verification.comparison import (
    ACTION,
    FILTER,
    FOLLOWS,
    SMOOTHING,
    differing,
    equivalent_time,
    neutral_at,
    neutral_of,
    neutral_values,
    same_value,
)
from pidcfg.study.verification.trial import slaves_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import steps, value_at

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.conversion.ledger import Change, NeutralLoop
    from pidcfg.conversion.operation import Operation
    from pidcfg.conversion.pipeline import LoopReport
    from pidcfg.schemas.generic import Loop
    from pidcfg.text.paths import Path
    from pidcfg.vendors import Vendor

# --- Keys of a configuration changed one by one, until the neutral loop has a wanted value ----------------------------
#
# Numbers are found by the secant method through the vendor's own `to_neutral`; switches and words by trying each.

SEARCH_TOLERANCE = Decimal("1e-9")
SHORT_SHARE = Decimal("1e-6")
"""Of a time constant, what is as good as none."""
CONDITION = "when"
"""The key of it."""
TRIES = 12
"""Steps of the secant method."""
UNFIT_ERRORS = (ArithmeticError, ConvertError, DecodeError, EncodeError, LookupError, TypeError, ValueError)
"""What a value that does not fit its key may raise on the way to the neutral form."""


@dataclass(slots=True)
class Builder:
    """A configuration whose keys are changed one by one."""

    vendor: Vendor
    config: Any
    known: tuple[tuple[Loop | None, ...], list[NeutralLoop]] | None = None

    def _neutral(self) -> tuple[tuple[Loop | None, ...], list[NeutralLoop]]:
        if self.known is None:
            self.known = neutral_of(self.config, self.vendor)
        return self.known

    def loop(self, i: int) -> Loop | None:
        """A loop in the neutral form, as it is now."""
        return self._neutral()[0][i]

    def whole(self, i: int) -> Loop:
        """The same, of a loop that has one."""
        loop = self.loop(i)
        if loop is None:
            raise ValueError(f"loop {i} has no neutral form")
        return loop

    def fields(self, i: int) -> NeutralLoop:
        """What became of the fields of a loop."""
        return self._neutral()[1][i]

    def place(self, i: int, key: str) -> Path | None:
        """Where a key of a loop stands in the file: below the loop, else in the file itself; None: nowhere."""
        path = steps(key)
        if isinstance(self.config.loops[i], BaseModel) and str(path[0]) in type(self.config.loops[i]).model_fields:
            return ("loops", i, *path)
        blocks = [b.name for b in getattr(self.config, "blocks", ())]
        if path[0] == "blocks" and path[1] in blocks:
            return ("blocks", blocks.index(str(path[1])), *path[2:])
        return path if str(path[0]) in type(self.config).model_fields else None

    def _try(self, path: Path, value: Any, i: int, neutral: str) -> Any:
        """The neutral value with another value at a key; the key stays so."""
        self.config, self.known = with_value_at(self.config, path, value), None
        return neutral_at(self.whole(i), neutral)

    def reset(self, i: int, key: str) -> bool:
        """A key that the target does not have goes back to its default."""
        path = self.place(i, key)
        default: Any = None
        if path is not None and _is_conditional(self.config, path):  # a copy that is never made
            path, default = (*path, CONDITION), False
        elif path is not None:
            default = _default(self.config, path)
        if path is None or default is _NONE:
            return False
        before = self.config
        self.config, self.known = with_value_at(self.config, path, default), None
        if self._runs(i):
            return True
        self.config, self.known = before, None
        return False

    def _runs(self, i: int) -> bool:
        """Whether the configuration is still one that can be encoded."""
        try:
            return self.loop(i) is not None and encoder_of(self.vendor).encode(self.config) is not None
        except UNFIT_ERRORS:
            return False

    def bring(self, i: int, key: str, neutral: str, wanted: Any) -> bool:
        """Changes a key until the neutral field has a value; says whether it could be."""
        path, before = self.place(i, key), self.config
        if path is None:
            return False
        try:
            if self._bring(i, path, neutral, wanted):
                return True
        except UNFIT_ERRORS:
            pass
        self.config, self.known = before, None
        return False

    def _bring(self, i: int, path: Path, neutral: str, wanted: Any) -> bool:
        present, number = value_at(self.config, path), number_of(wanted)
        for choice in _choices(self.config, path, present):
            if same_value(self._try(path, choice, i, neutral), wanted):
                return True
        typed = typed_number(present)
        if number is None or typed is None:
            return False
        return self._secant(i, path, neutral, number, present, typed)

    def _secant(self, i: int, path: Path, neutral: str, wanted: Decimal, present: Any, x0: Decimal) -> bool:
        y0 = number_of(self._try(path, present, i, neutral))
        if y0 is None:
            return False
        whole = isinstance(present, Quantity) and present.counts
        if not wanted and neutral.endswith("filter"):  # a filter block wants a time, however short
            self._try(path, with_number(present, x0 * SHORT_SHARE), i, neutral)
            return True
        x1 = x0 * wanted / y0 if y0 and x0 else x0 + (wanted - y0)
        for _ in range(TRIES):
            y1 = number_of(self._try(path, with_number(present, x1), i, neutral))
            if y1 is None:
                return False
            if abs(y1 - wanted) <= SEARCH_TOLERANCE * max(abs(wanted), Decimal(1)):
                if whole:  # a word in counts holds the nearest one
                    self._try(path, with_number(present, Decimal(nearest(x1))), i, neutral)
                return True
            if y1 == y0:
                return False
            x0, x1, y0 = x1, x1 + (wanted - y1) * (x1 - x0) / (y1 - y0), y1
        return False


class _Nothing:
    """No default."""


_NONE = _Nothing()


def _is_conditional(config: Any, path: Path) -> bool:
    """Whether an entry of a list is carried out under a condition."""
    entry = value_at(config, path)
    listed = isinstance(path[-1], int) and isinstance(entry, BaseModel)
    return listed and CONDITION in type(entry).model_fields


def _default(config: Any, path: Path) -> Any:
    owner = value_at(config, path[:-1])
    if not isinstance(owner, BaseModel) or str(path[-1]) not in type(owner).model_fields:
        return _NONE
    row = type(owner).model_fields[str(path[-1])]
    return _NONE if row.is_required() else row.get_default(call_default_factory=True)


def _choices(config: Any, path: Path, present: Any) -> Iterator[Any]:
    """Other values that a key can have, where they can be counted: switches, words, and the default."""
    if isinstance(present, bool):
        yield not present
    owner = value_at(config, path[:-1])
    if isinstance(owner, BaseModel) and str(path[-1]) in type(owner).model_fields:
        for word in _words(type(owner).model_fields[str(path[-1])].annotation):
            if word != present:
                yield word
        default = _default(config, path)
        if default is not _NONE and default != present:
            yield default


def _words(annotation: Any) -> Iterator[Any]:
    for argument in get_args(annotation):
        if isinstance(argument, str):
            yield argument
        elif argument is not NoneType:
            yield from _words(argument)


def typed_number(value: Any) -> Decimal | None:
    """The number in a value, in the unit that it is written in."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, Quantity | Duration) or hasattr(value, "per"):
        return Decimal(value.value)
    if hasattr(value, "duration"):
        return typed_number(value.duration)
    return Decimal(str(value)) if isinstance(value, int | float | Decimal) else None


def with_number(value: Any, number: Decimal) -> Any:
    """A value of the same kind with another number."""
    if isinstance(value, Quantity):
        return Quantity(number, value.counts, derived=True)
    if hasattr(value, "duration"):
        return value._replace(duration=with_number(value.duration, number))
    if hasattr(value, "_replace"):
        return value._replace(value=number)
    if isinstance(value, int) and number == number.to_integral_value():
        return int(number)
    return number


def with_value_at(model: Any, path: Path, value: Any) -> Any:
    """A model with another value at a path."""
    if not path:
        return value
    step, below = path[0], path[1:]
    if isinstance(model, BaseModel):
        return model.model_copy(update={str(step): with_value_at(getattr(model, str(step)), below, value)})
    if isinstance(model, tuple) and isinstance(step, int):
        items = list(model)
        items[step] = with_value_at(items[step], below, value)
        return tuple(items) if type(model) is tuple else type(model)(*items)
    raise KeyError(step)


# --- The source with what the report of a conversion says was written: rounded, clamped, assumed or dropped -----------
#
# Each neutral field that differs between both sides, and that a line of the report names, is brought to the target's
# value by changing the source's own key (`edits`), so that the twin runs the source's algorithm with the target's
# numbers. A line that no key can follow changes nothing: `lines` says what it explains.

LINE_TOLERANCE = 5.0
"""How much more than a line's own error the neutral value may differ: a share of a filter is not its time."""
RULES_OF_FIELDS = frozenset(("tuning.integral_time",))
"""Neutral fields that a target may have with another rule, although the value is the same."""


@frozen
class ReportLine:
    """A line of the report, the loop that it is of, and the neutral field that it explains."""

    neutral: str
    change: Change
    held: Any = None
    """What the target has in that field: the line explains nothing where it has something else."""


@dataclass(slots=True)
class ReportSource:
    """The source as the report has it."""

    config: Any
    followed: dict[int, list[ReportLine]] = field(default_factory=dict)
    """By loop the lines that the twin follows."""
    left: dict[int, list[ReportLine]] = field(default_factory=dict)
    """By loop the lines that no key of the source can follow."""


def reported_source(
    config: Any,
    vendor: Vendor,
    result: Any,
    target: Vendor,
    pairs: Sequence[tuple[int, int]],
    report: Sequence[LoopReport],
) -> ReportSource:
    """The twin of a source for a conversion's result and its report; ``pairs``: the places of loops on both sides."""
    builder = Builder(vendor, config)
    twin = ReportSource(config)
    after, fields = neutral_of(result, target)
    for i, j in pairs:
        other = after[j]
        if other is not None and builder.loop(i) is not None:
            twin.followed[i], twin.left[i] = _of_loop(builder, i, report[i].changes, other, partial(_places, fields[j]))
    for i, j in pairs:
        if i in twin.left:
            twin.left[i] += _consequences(builder, i, source_of(target).operations(result)[j], twin, after[j])
    twin.config = builder.config
    return twin


def _consequences(
    builder: Builder, i: int, after: Operation, twin: ReportSource, other: Loop | None
) -> list[ReportLine]:
    """Rules that differ because the twin follows a line, such as another form of the equation."""
    because = [line.change for line in twin.followed[i] if line.neutral in {"", FOLLOWS}]
    known = {line.neutral for line in (*twin.left[i], *twin.followed[i])}
    if not because or other is None:
        return []
    before = source_of(builder.vendor).operations(builder.config)[i]
    slaves = slaves_of(neutral_of(builder.config, builder.vendor)[0], i)
    rules = differing_rules(before, after, other, is_master=bool(slaves))
    return [ReportLine(rule.field, because[0], rule.target) for rule in rules if rule.field not in known]


def _of_loop(
    builder: Builder, i: int, changes: Sequence[Change], other: Loop, of_target: Callable[[str], tuple[str, ...]]
) -> tuple[list[ReportLine], list[ReportLine]]:
    followed: list[ReportLine] = []
    left: list[ReportLine] = []
    values = [change for change in changes if not change.field.startswith(PREFIX)]
    for change in values:
        if change.kind == "dropped" and change.loss and not change.neutral:
            (followed if builder.reset(i, change.field) else left).append(ReportLine("", change))
    first = differing(*neutral_values(builder.whole(i), other))
    for path in first:
        one, two = neutral_values(builder.whole(i), other)
        if same_value(one.get(path), two.get(path)):
            continue  # it went with another one
        rows = [c for c in values if c.kind != "exact" and any(overlap(path, name) for name in c.neutral)]
        if not rows or path == ACTION or _more_than_said(one.get(path), two.get(path), rows):
            continue
        if any(builder.bring(i, key, path, two.get(path)) for key in _keys(builder, i, path)):
            followed.extend(ReportLine(path, change) for change in rows)
    _restore(builder, i, other, first)
    followed.extend(_smoothed(builder, i, changes, other))
    through = [line.change.field for line in followed]
    rules = [row for row in changes if row.field.startswith(PREFIX) and row.field not in through]
    left.extend(ReportLine(row.field, row, row.target) for row in rules)
    rest = differing(*neutral_values(builder.whole(i), other))
    for change in values:
        for name in change.neutral or of_target(change.field):
            is_rule = name in RULES_OF_FIELDS and bool(change.note)
            if is_rule or (change.kind != "exact" and any(overlap(name, path) for path in rest)):
                left.append(ReportLine(name, change, neutral_values(builder.whole(i), other)[1].get(name)))
    return followed, left


def _smoothed(builder: Builder, i: int, changes: Sequence[Change], other: Loop) -> Iterator[ReportLine]:
    """Gives the filter of the derivative the time constant that lets as much through as the target's."""
    row = next((row for row in changes if row.field == SMOOTHING), None)
    if row is None:
        return
    wanted = equivalent_time(row, other)
    if any(builder.bring(i, key, FILTER, wanted) for key in _keys(builder, i, FILTER)):
        yield ReportLine(row.field, row, row.target)


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
    return float(abs(b - a) / abs(a)) * 100 > LINE_TOLERANCE * max(change.error_percent for change in rows) + 0.1
