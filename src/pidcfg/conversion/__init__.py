"""From one vendor's configuration to another's, through the neutral loop; what is lost is told.

Here what became of every field: lines of the report, when rounding is a loss, values for people.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal

from pidcfg.schemas.base import Duration, Quantity, Rate
from pidcfg.schemas.numbers import NUMBER, decimal_text, plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import outer_keys
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pidcfg.text.paths import Data, Path

# --- What became of every field: the two halves of a conversion, and the report that they make together ---------------
#
# A vendor's `to_neutral` lists for each of its fields the neutral fields that it went to (`SourceField`),
# `from_neutral` for each neutral field where it was put (`TargetField`). `list_changes` joins the two lists: a field
# that went nowhere is dropped, and nobody can forget one without a test noticing.

Kind = Literal["exact", "rounded", "clamped", "dropped", "assumed"]
KINDS_BY_HARM: tuple[Kind, ...] = ("exact", "rounded", "assumed", "clamped", "dropped")
"""From harmless to harmful."""
LOSSES = frozenset(("clamped", "dropped"))
"""Kinds that are a loss, unless the line says that nothing is lost."""
COMMON_FIELDS = ("name", "description")
"""Fields of every loop, which a vendor need not list."""


@frozen
class SourceField:
    """A field of the source: its path below the loop, its value as people write it, and the neutral fields it became.

    Without any it is dropped, and ``note`` says what to program by hand instead; ``assumed``: the file does not say it.
    """

    path: str
    value: Any
    neutral: tuple[str, ...] = ()
    note: str = ""
    assumed: bool = False
    harmless: bool = False
    """It goes nowhere and nothing is lost with it: a place in the source's PLC, a choice that it has alone."""


@frozen
class TargetField:
    """A field of the target: its path below the loop (after ``/``: of the file), and the neutral field it came from.

    ``neutral`` None: nothing of the source says it, so it is assumed. An empty ``path``: the target has no such thing,
    the neutral field is dropped, and ``note`` says what to program by hand instead.
    """

    path: str
    neutral: str | None
    note: str = ""
    assumed: bool = False
    exact: Decimal | None = None
    """What was wanted, where the file holds less: a whole number, or a text with a unit that is rounded already."""
    clamped: bool = False
    """Brought within what the target allows, or to what it has instead, by the conversion itself."""
    held: Decimal | None = None
    """What the file then means, in the unit of ``exact``, where its own number does not say it."""


@frozen
class MissingField:
    """What the source must say before it can be converted: where, and why."""

    path: Path
    message: str


class ConvertError(Exception):
    """A configuration that cannot be converted as it is; each problem names the key."""

    def __init__(self, missing: list[MissingField]) -> None:
        super().__init__("; ".join(entry.message for entry in missing))
        self.missing = missing


@dataclass(slots=True)
class NeutralLoop:
    """One loop of the source: its neutral data, and what each of its fields became."""

    data: Data = field(default_factory=dict)
    fields: list[SourceField] = field(default_factory=list)
    missing: list[MissingField] = field(default_factory=list)
    harmless_items: dict[str, str] = field(default_factory=dict)
    """Fields beside the loops that go with it, each with the reason why nothing of them is lost."""


@dataclass(slots=True)
class TargetFile:
    """A vendor's file as plain data, and where the neutral fields of each loop were put."""

    data: Data
    fields: list[list[TargetField]]
    model: Any = None
    """The data as the vendor's model, as long as it is up to date."""
    encoding: Any = None
    """What registers hold of it; of a rounded number as it was wanted."""


@frozen
class Change:
    """A line of the report."""

    field: str
    kind: Kind
    source: Any
    target: object
    error_percent: float = 0.0
    note: str = ""
    loss: bool = False
    """Whether it needs leave: dropped, clamped, or rounded beyond what is allowed."""
    neutral: tuple[str, ...] = ()
    """The neutral fields that it is about."""
    terms: Terms | None = None
    """The same in neutral terms, for a number that is not exact."""
    target_field: str = ""
    """Its key in the target; empty where it has none there."""
    counts_apart: float = 0.0
    """Of an exact number: how far the words of both sides are apart, in counts of the coarser one."""


@frozen
class Terms:
    """What a number was and what the target holds instead, both in the unit of one neutral field."""

    field: str
    wanted: Decimal
    held: Decimal
    unit: str = ""


@frozen
class Stored:
    """What the target holds of a field: the value in the file, and how it came to differ from what was wanted."""

    value: Any
    kind: Kind = "exact"
    error_percent: float = 0.0
    note: str = ""


def list_changes(
    source: Sequence[SourceField],
    target: Sequence[TargetField],
    stored: Mapping[str, Stored],
    is_default: Callable[[str], bool] = lambda _: False,
) -> Iterator[Change]:
    """Every field of the source, then what the target has besides.

    ``is_default``: whether a neutral field says what a loop is like without it, so that nothing is lost with it.
    """
    by_neutral: dict[str, list[TargetField]] = {}
    for target_field in target:
        by_neutral.setdefault(target_field.neutral or "", []).append(target_field)
    for entry in source:
        if entry.path not in COMMON_FIELDS or entry.path in by_neutral:
            yield from _field_changes(entry, by_neutral, stored, is_default)
    source_names = {name for entry in source for name in entry.neutral}
    for name, target_fields in by_neutral.items():
        if any(do_overlap(name, other) for other in source_names):
            continue
        for target_field in target_fields:
            stored_value = stored.get(target_field.path, Stored(None))
            kind = _worst_kind("assumed", stored_value.kind, _clamped_kind(target_field))
            is_silent = name in COMMON_FIELDS or (target_field.neutral is not None and is_default(target_field.neutral))
            if target_field.path and (target_field.assumed or kind in LOSSES or not is_silent):
                note = _join_notes(target_field.note, stored_value.note)
                neutral = (name,) if target_field.neutral else ()
                row = Change(
                    target_field.path,
                    kind,
                    None,
                    stored_value.value,
                    stored_value.error_percent,
                    note,
                    kind in LOSSES,
                    neutral,
                )
                yield replace(row, target_field=target_field.path)


def _field_changes(
    entry: SourceField,
    by_neutral: Mapping[str, list[TargetField]],
    stored: Mapping[str, Stored],
    is_default: Callable[[str], bool],
) -> Iterator[Change]:
    if not entry.neutral:
        yield Change(entry.path, "dropped", entry.value, None, note=entry.note, loss=not entry.harmless)
        return
    target_fields = [
        target_field
        for name in entry.neutral
        for other, group in by_neutral.items()
        if do_overlap(name, other)
        for target_field in group
    ]
    if not target_fields:
        kind: Kind = "exact" if all(is_default(name) for name in entry.neutral) else "dropped"
        note = entry.note or ("" if kind == "exact" else "the target has no such field")
        yield Change(entry.path, kind, entry.value, None, note=note, loss=kind in LOSSES, neutral=entry.neutral)
    for target_field in target_fields:
        stored_value = stored.get(target_field.path, Stored(None)) if target_field.path else Stored(None, "dropped")
        assumed: Kind = "assumed" if entry.assumed or target_field.assumed else "exact"
        note = _join_notes(entry.note, target_field.note, stored_value.note)
        kind = _worst_kind(assumed, stored_value.kind, _clamped_kind(target_field))
        neutral = tuple(
            max(name, target_field.neutral or "", key=len)
            for name in entry.neutral
            if do_overlap(name, target_field.neutral or "")
        )
        row = Change(
            entry.path, kind, entry.value, stored_value.value, stored_value.error_percent, note, kind in LOSSES, neutral
        )
        yield replace(row, target_field=target_field.path)


def _clamped_kind(target_field: TargetField) -> Kind:
    return "clamped" if target_field.clamped else "exact"


def _join_notes(*notes: str) -> str:
    return "; ".join(dict.fromkeys(filter(None, notes)))


def do_overlap(name: str, other: str) -> bool:
    """Whether two neutral fields are one, or one is an end of the other: ``output.limits`` and ``output.limits.0``."""
    return name == other or f"{name}.".startswith(f"{other}.") or f"{other}.".startswith(f"{name}.")


class FieldIndex:
    """Fields of many lines, to ask whether one of them and another field overlap."""

    def __init__(self, fields: Iterable[str]) -> None:
        self._fields = set(fields)
        self._parents = {outer for field in self._fields for outer in outer_keys(field)}

    def has_overlap(self, name: str) -> bool:
        """Whether `do_overlap` holds of a field and one of these."""
        return name in self._parents or name in self._fields or any(outer in self._fields for outer in outer_keys(name))


def _worst_kind(*kinds: Kind) -> Kind:
    return max(kinds, key=KINDS_BY_HARM.index)


# --- When a rounded value is a loss: how far each kind of number may be off -------------------------------------------

D340 = Decision(
    340,
    "a value that is rounded too far is a loss",
    "A gain may be 2 % off, a time 5 %, the time constant of a filter 10 %, a deadband, a hysteresis, a rate of "
    "change or a set point on the few counts of a root 10 %; `--max-loss` says otherwise. A value beyond stays "
    "`rounded` and is a loss. Errors are those of time constants and gains in engineering units, not of the numbers in "
    "registers.",
    "2 % of a gain is within what a tuning leaves open, and the steps of all registers are finer at usual gains; times "
    "and filters move a loop less. A filter word of 0.2 for 0.23 is 14 % off, its time constant 18 %.",
)
QUANTITY_OF_FIELD = {
    "tuning.gain": "gain",
    "output.max_rate": "gain",
    "sample_time": "time",
    "tuning.integral_time": "time",
    "tuning.derivative_time": "time",
    "output.pulse.period": "time",
    "output.pulse.min_on": "time",
    "output.pulse.min_off": "time",
    "tuning.derivative_filter": "filter",
    "pv.filter": "filter",
    "setpoint.value": "band",
    "deadband": "band",
    "alarms.rate_of_change": "band",
    "alarms.hysteresis": "band",
}
"""The limit of each neutral number; positions are as near as their counts are, but for the few of a root."""


@frozen
class MaxLoss:
    """How far numbers may be rounded without being a loss, in % of the value (D340)."""

    gain: float = 2.0
    time: float = 5.0
    filter: float = 10.0
    band: float = 10.0

    def limit_for(self, neutral: Sequence[str]) -> float:
        """The limit of a line about these neutral fields; infinite without one."""
        limits = [float(getattr(self, QUANTITY_OF_FIELD[name])) for name in neutral if name in QUANTITY_OF_FIELD]
        return min(limits, default=float("inf"))


DEFAULT_MAX_LOSS = MaxLoss()


class MaxLossError(ValueError):
    """A text that is no list of limits."""


def parse_max_loss(text: str) -> MaxLoss:
    """``gain=2%,time=5%``: those that are not named keep their limits; raises `MaxLossError`."""
    names = [field.name for field in fields(MaxLoss)]
    limits = {}
    for part in text.split(","):
        name, _, percent = (piece.strip() for piece in part.partition("="))
        percent = percent.removesuffix("%").strip()
        value = float(percent) if NUMBER.fullmatch(percent) else -1.0
        if name not in names or not 0 <= value < float("inf"):
            raise MaxLossError(f"{part.strip()!r}; write limits such as gain=2%,time=5% ({', '.join(names)})")
        limits[name] = value
    return replace(DEFAULT_MAX_LOSS, **limits)


def judge_change(change: Change, limits: MaxLoss) -> Change:
    """A line, a loss when it is one by its kind or its error."""
    is_beyond = change.error_percent > limits.limit_for(change.neutral)
    return replace(change, loss=True) if is_beyond and change.kind not in LOSSES else change


# --- Values of a configuration as numbers, as JSON has them, and as people read them ----------------------------------

MAX_TEXT_LENGTH = 20
"""Signs of a number that is shown without an exponent."""


def number_of(value: object) -> Decimal | None:
    """The number of a value in its own unit; None: it is none."""
    if isinstance(value, bool) or value is None:
        return None
    if isinstance(value, Quantity | Rate):
        return None if value.counts else value.value
    if isinstance(value, Duration):
        return value.seconds()
    if hasattr(value, "duration"):  # a time that may be off
        return number_of(value.duration)
    if isinstance(value, int | float | Decimal):
        return Decimal(str(value))
    return None


def json_value(value: object) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Decimal):
        return plain_number(value)
    if isinstance(value, Quantity | Duration):
        return str(value)
    if isinstance(value, dict):  # such as the devices of an instruction
        return ", ".join(f"{key}: {json_value(inner)}" for key, inner in value.items())
    return [json_value(v) for v in value] if isinstance(value, list | tuple) else value


def text_of(value: object) -> str:
    """A value as people read it."""
    value = json_value(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    if not isinstance(value, int | float):
        return str(value)
    text = decimal_text(Decimal(repr(value)))
    return text if len(text) <= MAX_TEXT_LENGTH else repr(value)
