"""How a conversion fills a neutral loop and a target's file, exactly, and what its lines may claim of equal fields."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import count as counter
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TypeAlias, TypeVar

from pydantic import BaseModel

from pidcfg.conversion import (
    QUANTITY_OF_FIELD,
    ConvertError,
    MissingField,
    NeutralLoop,
    SourceField,
    TargetField,
    TargetFile,
    Terms,
)
from pidcfg.encoders.codecs import Distance, Position
from pidcfg.encoders.image import without_none
from pidcfg.schemas.base import Quantity
from pidcfg.schemas.numbers import EXACT_CONTEXT, plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import is_given, parse_path, set_value, value_at
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from pidcfg.conversion import Change
    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.encoders.regmap import Word
    from pidcfg.schemas.base import BankRange, ConfigurationFile
    from pidcfg.schemas.generic import GenericFile, Loop
    from pidcfg.text.paths import Data, Path

# --- What adapters calculate with: exact decimals between the terms of vendors ----------------------------------------

ZERO, ONE, HUNDRED = Decimal(0), Decimal(1), Decimal(100)
SIGNIFICANT_DIGITS = 12
"""Significant digits of what a quotient or a logarithm gives."""
Span = tuple[Decimal, Decimal]


def round_computed(value: Decimal) -> Decimal:
    """A computed number without the noise of its last digits."""
    return Decimal(f"{value:.{SIGNIFICANT_DIGITS}g}") if value else ZERO


def file_number(value: Decimal) -> int | float:
    """A number as a file has it, its computed digits rounded."""
    return plain_number(round_computed(value))


def width(span: Sequence[Decimal]) -> Decimal:
    """From 0 % to 100 %."""
    return span[1] - span[0]


def quotient(a: Decimal, b: Decimal) -> Decimal:
    """A / b."""
    return EXACT_CONTEXT.divide(a, b)


def product(*factors: Decimal) -> Decimal:
    """All factors multiplied."""
    result = ONE
    for factor in factors:
        result = EXACT_CONTEXT.multiply(result, factor)
    return result


def rescale(value: Decimal, source: Sequence[Decimal], target: Sequence[Decimal]) -> Decimal:
    """A value of one scale at the same place of another."""
    return target[0] + quotient(product(value - source[0], width(target)), width(source))


def filter_time(factor: Decimal, sample_time: Decimal) -> Decimal:
    """The time constant of a filter that takes this share of a difference in each sample; 1: no filter."""
    if factor >= ONE:
        return ZERO
    return round_computed(-quotient(sample_time, EXACT_CONTEXT.ln(ONE - factor)))


def filter_factor(time: Decimal, sample_time: Decimal) -> Decimal:
    """The share of a difference that a filter with this time constant takes in each sample."""
    if time <= ZERO:
        return ONE
    return round_computed(ONE - EXACT_CONTEXT.exp(-quotient(sample_time, time)))


def backward_factor(sample_time: Decimal, time: Decimal) -> Decimal:
    """The share of a difference that a backward step of a filter with this time constant takes in each sample."""
    return round_computed(quotient(sample_time, sample_time + time))


def gain_limit(derivative: Decimal, constant: Decimal, highest: int) -> int:
    """The whole N from 1 on with which derivative / N is nearest to the wanted time constant of its filter."""
    below = min(max(int(quotient(derivative, constant)), 1), highest)
    above = min(below + 1, highest)
    return min((below, above), key=lambda n: abs(quotient(derivative, Decimal(n)) - constant))


def to_dependent(kp: Decimal, ki: Decimal, kd: Decimal) -> tuple[Decimal, Decimal, Decimal, bool]:
    """Independent gains as gain, integral and derivative time, and whether there is a proportional action.

    Without one the gain is 1: the times then are 1/Ki and Kd. Without any of the three it is 0.
    """
    gain = kp or (ONE if ki or kd else ZERO)
    integral = round_computed(quotient(gain, ki)) if ki else ZERO
    return gain, integral, round_computed(quotient(kd, gain)) if kd else ZERO, bool(kp) or not (ki or kd)


def to_independent(gain: Decimal, integral: Decimal, derivative: Decimal) -> tuple[Decimal, Decimal]:
    """Ki and Kd of gain, integral time (0: none) and derivative time."""
    return round_computed(quotient(gain, integral)) if integral else ZERO, round_computed(product(gain, derivative))


# --- How a conversion fills a neutral loop and a target's file, recording what each field became ----------------------


@dataclass(slots=True)
class NeutralBuilder:
    """Fills a neutral loop from a vendor's: the one at ``index`` of its file."""

    index: int
    loop: NeutralLoop = field(default_factory=NeutralLoop)

    def put(
        self, path: str, value: object, neutral: str, neutral_value: Any, note: str = "", *, assumed: bool = False
    ) -> None:
        """A field of the source with its value, and the neutral field with what it became."""
        self.set(neutral, neutral_value)
        self.mark(path, value, neutral, note=note, assumed=assumed)

    def put_same(self, row: SameField, value: object) -> None:
        """A field that keeps its value."""
        self.put(row.path, value, row.other_path or row.path, row.convert(value), row.note)

    def set(self, neutral: str, value: Any) -> None:
        """A neutral field alone; the fields of the source that it comes from are marked."""
        set_value(self.loop.data, parse_path(neutral), value)

    def mark(self, path: str, value: object, *neutral: str, note: str = "", assumed: bool = False) -> None:
        """A field of the source that is part of neutral fields which are set elsewhere."""
        self.loop.fields.append(SourceField(path, value, neutral, note, assumed))

    def drop(self, path: str, value: object, note: str) -> None:
        """A field that the neutral form does not have, and what to program instead."""
        self.loop.fields.append(SourceField(path, value, note=note))

    def drop_choices(self, path: str, section: BaseModel, note: str) -> None:
        """The fields of a section that are not at their defaults."""
        for key, row in type(section).model_fields.items():
            value = getattr(section, key)
            if value != row.default:
                self.drop(f"{path}.{key}", value, note)

    def require(self, path: str, message: str) -> None:
        """What the source must say first, by its path below the loop; empty: the loop."""
        self.loop.missing.append(MissingField(("loops", self.index, *parse_path(path)), message))


@dataclass(slots=True)
class TargetBuilder:
    """Fills a loop of the target: the one at ``index`` of its file."""

    index: int = 0
    data: Data = field(default_factory=dict)
    fields: list[TargetField] = field(default_factory=list)

    def put(self, path: str, value: object, neutral: str | None, note: str = "", **details: Any) -> None:
        """A field of the target, and the neutral field that it came from; None: chosen here.

        Decimals become plain numbers without the noise of their last digits; ``details``: see `TargetField`.
        """
        set_value(self.data, parse_path(path), _file_value(value))
        self.mark(path, neutral, note, **details)

    def put_same(self, row: SameField, value: object) -> None:
        """A field that keeps its value."""
        target_path = row.other_path or row.path
        if row.is_pair:
            set_value(self.data, parse_path(target_path), _file_value(value))
            for i in range(2):
                self.mark(f"{target_path}.{i}", f"{row.path}.{i}", row.note)
        else:
            self.put(target_path, row.convert(value), row.path, row.note)

    def mark(self, path: str, neutral: str | None, note: str = "", **details: Any) -> None:
        """A field that is set otherwise holds this neutral field too."""
        self.fields.append(TargetField(path, neutral, note, **details))

    def drop(self, neutral: str, note: str) -> None:
        """A neutral field that the target does not have, and what to program instead."""
        self.mark("", neutral, note)

    def drop_all(self, unmatched: Iterable[tuple[str, str]]) -> None:
        """Neutral fields that the target does not have, each with its note."""
        for neutral, note in unmatched:
            self.drop(neutral, note)

    def refuse(self, path: str, message: str) -> NoReturn:
        """Ends the conversion for a value that the target cannot have at all."""
        raise ConvertError([MissingField(("loops", self.index, *parse_path(path)), message)])


def target_file(vendor: str, file: GenericFile, builders: Sequence[TargetBuilder], **sections: object) -> TargetFile:
    """The target's file of its loops; empty ``sections`` are left out."""
    data = {"pidcfg": 1, "vendor": vendor} | without_none({"name": file.name, "description": file.description})
    data |= {key: section for key, section in sections.items() if section}
    return TargetFile({**data, "loops": [b.data for b in builders]}, [b.fields for b in builders])


def _file_value(value: object) -> Any:
    """A value as a file has it."""
    if isinstance(value, tuple | list):
        return [_file_value(item) for item in value]
    return file_number(value) if isinstance(value, Decimal) else value


def assign_addresses(bank: BankRange, size: int, count: int, given_addresses: Sequence[str]) -> list[int]:
    """Where the blocks of each loop begin: as wanted, the others behind the last one without overlapping any."""
    _refuse_too_many(given_addresses, count)
    starts = [bank.parse(address) for address in given_addresses]
    start = starts[-1] + size if starts else bank.first
    while len(starts) < count:
        overlapping = next((other for other in starts if abs(other - start) < size), None)
        if overlapping is None:
            starts.append(start)
        start = (start if overlapping is None else overlapping) + size
    top = max(starts, default=bank.first)
    if top + size - 1 > bank.last:
        raise _place_error(f"{size} addresses from {bank.prefix}{top} on do not end by {bank.prefix}{bank.last}")
    return starts


def assign_names(given_names: Sequence[str | None], count: int, make_name: Callable[[int], str]) -> list[str]:
    """One name a loop: as wanted, the others the first that are free, counted from 1."""
    _refuse_too_many(given_names, count)
    free_names = (name for n in counter(1) if (name := make_name(n)) not in given_names)
    all_names = [*given_names, *[None] * (count - len(given_names))]
    return [next(free_names) if name is None else name for name in all_names]


def _refuse_too_many(names: Sequence[str | None], count: int) -> None:
    if len(names) > count:
        raise _place_error(f"{', '.join(str(name) for name in names)}: that is {len(names)} for {count} of the loops")


def _place_error(message: str) -> ConvertError:
    return ConvertError([MissingField(("loops",), message)])


# ----------------------------------------------------------------------------------------------------------------------
# Cascades that hand the output on as a position: 0 to 100 % of the outer loop's output are 0 to 100 % of the inner
# PV.
# In the neutral form the source's output is the set point itself. Where the two ranges differ, the outer loop's
# output is therefore given in the inner loop's units, with its gain (D305).

D305 = Decision(
    305,
    "the output of an outer loop is in the units of the inner one's PV",
    "DL06 and EZLogix write the outer loop's output word into the inner loop's set point word. Where its own range is "
    "another than that of the inner PV, the neutral loop has the inner range, and gain, limits and bias on it.",
    "The words are handed on as they are; taken as engineering units, the set point would be wrong by the ratio.",
)


def rescale_outer_loops(loops: list[NeutralLoop]) -> list[NeutralLoop]:
    """The loops, each source of a set point on the scale of the PV that it commands."""
    by_name = {loop.data.get("name"): loop for loop in loops}
    for inner in loops:
        outer = by_name.get(value_at(inner.data, ("setpoint", "source")))
        if outer is not None and "output" in outer.data and "pv" in inner.data:
            _rescale_loop(outer, [Decimal(str(end)) for end in inner.data["pv"]["range"]], inner.data["name"])
    return loops


def _rescale_loop(outer: NeutralLoop, span: list[Decimal], inner: str) -> None:
    """The outer loop's output on another scale."""
    output, tuning = outer.data["output"], outer.data["tuning"]
    old_span = [Decimal(str(end)) for end in output["range"]]
    if old_span == span:
        return
    factor = quotient(width(span), width(old_span))
    tuning["gain"] = round_computed(product(Decimal(str(tuning["gain"])), factor))
    output["range"] = span
    for key in ("bias", "manual"):
        if key in output:
            output[key] = _rescale_value(output[key], old_span, span)
    if "limits" in output:
        output["limits"] = [_rescale_value(end, old_span, span) for end in output["limits"]]
    output.pop("unit", None)
    note = f"it commands {inner}: told in the units of its PV"
    outer.fields[:] = [
        replace(field, note=note) if "output.range" in field.neutral or "output.unit" in field.neutral else field
        for field in outer.fields
    ]


def _rescale_value(value: Decimal | float, source: Sequence[Decimal], target: Sequence[Decimal]) -> Decimal:
    return round_computed(rescale(Decimal(str(value)), source, target))


# --- Fields that go over as they are: rows of a vendor's table, which stand between the steps that calculate ----------
#
# A conversion is one table in the order of its report: a row `SameField` for a field that keeps its value, a function
# for what has to be worked out.


@frozen
class SameField:
    """A field and the one that it becomes with the same value; one that is not given says nothing."""

    path: str
    other_path: str = ""
    """Its path on the other side; empty: the same."""
    words: Mapping[Any, object] | None = None
    """What the other side calls each choice."""
    skip_falsy: bool = False
    """0 and false say nothing either."""
    note: str = ""
    """For the report."""
    is_pair: bool = False
    """Two limits, each of which the target may round or clamp."""

    def value_of(self, model: object) -> Any:
        """The field's value in a loop; None: it says nothing."""
        value = value_at(model, parse_path(self.path))
        return None if self.skip_falsy and not value else value

    def convert(self, value: object) -> Any:
        """What a value is on the other side."""
        return value if self.words is None else self.words[value]


class Builder(Protocol):
    """What takes the fields of a loop."""

    def put_same(self, row: SameField, value: Any) -> None:
        """Takes a field with its value."""


B = TypeVar("B", bound=Builder)
C = TypeVar("C")


Table: TypeAlias = "tuple[SameField | Callable[[B, C], None], ...]"
"""Rows, and steps that get the builder and what they work with."""


def same_fields(*paths: str, skip_falsy: bool = False) -> tuple[SameField, ...]:
    """Rows of fields that have one path on both sides."""
    return tuple(SameField(path, skip_falsy=skip_falsy) for path in paths)


def apply_table(builder: B, loop: object, context: C, table: Table[B, C]) -> None:
    """Goes through a table: rows take the fields of a loop, steps work out the others of ``context``."""
    for row in table:
        if not isinstance(row, SameField):
            row(builder, context)
        elif (value := row.value_of(loop)) is not None:
            builder.put_same(row, value)


# --- Neutral fields that a vendor does not have: which of them a loop gives, so that none is lost silently ------------

ALARMS = (
    *(f"alarms.pv.{key}" for key in ("low_low", "low", "high", "high_high")),
    *("alarms.deviation.high", "alarms.deviation.high_high", "alarms.rate_of_change", "alarms.hysteresis"),
)
"""Every alarm of the neutral loop."""
HARMLESS_VALUES = {"setpoint.follows_pv": False}
"""Values that are no default and still ask nothing of a target that has no such field."""


def unmatched_fields(loop: Loop, notes: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Those of these fields that a loop gives (with more than the default), with what to program instead."""
    for path, note in notes.items():
        *outer, key = parse_path(path)
        value, section = value_at(loop, (*outer, key)), value_at(loop, outer)
        default = type(section).model_fields[str(key)].default if isinstance(section, BaseModel) else None
        is_idle = path == HYSTERESIS and not has_alarms(loop)
        if value is not None and value != default and not is_idle and not is_harmless(path, value):
            yield path, note


HYSTERESIS = "alarms.hysteresis"


def has_alarms(loop: object) -> bool:
    """Whether a neutral loop has an alarm that a hysteresis could act on."""
    return any(key.startswith(("alarms.pv.", "alarms.deviation.")) for key in flatten(loop))


def is_harmless(path: str, value: object) -> bool:
    """Whether nothing is lost with this value in a target without such a field."""
    return path in HARMLESS_VALUES and HARMLESS_VALUES[path] == value


# --- Two neutral loops made comparable: one scale of the output, one way to say what has no proportional action -------

FlatLoop = dict[str, Any]
"""The values of a loop by path, as `flatten` gives them."""
OUTPUT_RANGE = ("output.range.0", "output.range.1")
PV_SCALE_FIELDS = (
    "setpoint.value",
    "setpoint.limits.0",
    "setpoint.limits.1",
    *(f"alarms.pv.{key}" for key in ("low_low", "low", "high", "high_high")),
)
OUTPUT_SCALE_FIELDS = ("output.limits.0", "output.limits.1", "output.bias", "output.manual")
"""Fields that are points of the scale of the PV, and of the output."""


def flatten(model: Any, prefix: str = "") -> FlatLoop:
    """Every value of a neutral loop by its path; limits that are not given are the ends of their range."""
    values: dict[str, object] = {}
    for name in type(model).model_fields:
        value, path = getattr(model, name), f"{prefix}{name}"
        if isinstance(value, BaseModel):
            values |= flatten(value, f"{path}.")
        elif isinstance(value, tuple):
            values |= {f"{path}.{k}": end for k, end in enumerate(value)}
        elif value is not None:
            values[path] = value
    if not prefix:
        for limits, range_path in (("setpoint.limits", "pv.range"), ("output.limits", "output.range")):
            for end in ("0", "1"):
                values.setdefault(f"{limits}.{end}", values[f"{range_path}.{end}"])
    return values


def without_unused_terms(loop: FlatLoop) -> FlatLoop:
    """Without a proportional action the gain is 1, and the times make up for it; no derivative acts on nothing."""
    values = dict(loop)
    gain = values["tuning.gain"]
    if not values["tuning.proportional"] and gain:
        values["tuning.gain"] = Decimal(1)
        values["tuning.integral_time"] = round_computed(quotient(values["tuning.integral_time"], gain))
        values["tuning.derivative_time"] = round_computed(product(values["tuning.derivative_time"], gain))
    if not values["tuning.derivative_time"]:
        for key in ("tuning.derivative_on", "tuning.derivative_filter"):
            values.pop(key, None)
    return values


def rescale_output(reference: FlatLoop, two: FlatLoop) -> FlatLoop:
    """The second loop with its output on the scale of the first: a vendor may know its output in % only."""
    first, second = ([Decimal(loop[end]) for end in OUTPUT_RANGE] for loop in (reference, two))
    if first == second:
        return two
    values = dict(two)
    factor = quotient(width(first), width(second))
    values["tuning.gain"] = round_computed(product(values["tuning.gain"], factor))
    for key in OUTPUT_SCALE_FIELDS:
        value = values.get(key)
        if value is not None and not isinstance(value, Quantity):
            values[key] = round_computed(rescale(Decimal(value), second, first))
    if values.get("output.max_rate") is not None:
        values["output.max_rate"] = round_computed(product(values["output.max_rate"], factor))
    return values | dict(zip(OUTPUT_RANGE, first, strict=True))


def make_comparable(one: object, two: object) -> tuple[FlatLoop, FlatLoop]:
    """Two neutral loops by path, the second in the terms of the first.

    Where the first has no proportional action, the other two are compared as the second has them, with one or without.
    """
    before, after = flatten(one), flatten(two)
    if not before["tuning.proportional"]:
        after["tuning.proportional"] = False
    after = rescale_output(before, after)
    return _without_idle_gains(without_unused_terms(before)), _without_idle_gains(without_unused_terms(after))


def _without_idle_gains(loop: FlatLoop) -> FlatLoop:
    """Without the times of a gain of 0, and without the gain of a loop in which nothing acts."""
    values = dict(loop)
    if not values["tuning.gain"]:
        values |= {"tuning.integral_time": Decimal(0), "tuning.derivative_time": Decimal(0)}
    acts = values["tuning.proportional"] or values["tuning.integral_time"] or values["tuning.derivative_time"]
    if not acts or not values["tuning.gain"]:
        values |= {"tuning.gain": Decimal(0), "tuning.proportional": False}
    return values


# --- Words that are less than a count apart ---------------------------------------------------------------------------

D929 = Decision(
    929,
    "a value is exact when both sides have the count that is nearest to it",
    "A line stays exact where a word in counts lies beside the number of the file and the other side has that number, "
    "or other counts; it says how many counts of the coarser side the words are apart.",
    "41 degC on 0 to 200 degC are 839 counts of 4095, which is 40.98 degC: a PLC with REAL numbers that gets 41 is "
    "0.48 counts apart from it. Each module rounds so, and nobody can write it nearer.",
)
SCALED_CODECS = (Position, Distance)
"""Registers whose counts are told in engineering units."""
COUNT_DIGITS = 3
"""Of a count, to which two words are told apart."""


def scaled_words(encoding: AnyEncoding) -> Iterator[tuple[Path, Word, Scale, int]]:
    """The words of a file on a scale in engineering units: place, word, scale and content."""
    for block in encoding.blocks:
        for word in block.table.words:
            if isinstance(word.codec, SCALED_CODECS) and word.path is not None:
                scale = block.scales[word.codec.scale]
                if scale.range is not None:
                    yield (*block.path, *parse_path(word.path)), word, scale, block.encoded.words[word.offset]


@frozen
class RoundingExcess:
    """What rounding to counts leaves of a value, as a share of its scale, and the counts of that."""

    scale_share: Decimal
    full_counts: Decimal


def rounding_excesses(config: ConfigurationFile, encoding: AnyEncoding) -> dict[Path, RoundingExcess]:
    """What rounding leaves of the values of a file, by their places."""
    excesses = {}
    for path, word, scale, content in scaled_words(encoding):
        value = value_at(config, path)
        if isinstance(value, Quantity) and isinstance(word.codec, SCALED_CODECS):
            excesses[path] = RoundingExcess(
                quotient(word.codec.rounding_excess(value, content, scale), scale.full_counts), scale.full_counts
            )
    return excesses


def counts_between(one: RoundingExcess | None, two: RoundingExcess | None) -> float:
    """How far two words for the same number are apart, in counts of the coarser one; 0: neither rounds it."""
    excesses = [excess for excess in (one, two) if excess is not None]
    if not excesses:
        return 0.0
    shares = [Decimal(0) if excess is None else excess.scale_share for excess in (one, two)]
    difference = abs(shares[0] - shares[1]) * min(excess.full_counts for excess in excesses)
    return round(float(difference), COUNT_DIGITS)


# --- Lines of a report held against what the target's file says in neutral terms, so that no line claims too much -----
#
# Design. The target's file, as its registers round it, is brought to neutral terms like any source. Each line knows
# its neutral fields; their values before and after decide: an ``exact`` line whose numbers differ is rounded, and one
# whose choice differs is dropped. Gains, times and filters get the error of what acts (a time constant, not the share
# in a register), and every number that differs is told in one unit.

NUMBER_TOLERANCE, SCALE_TOLERANCE = Decimal("1e-6"), Decimal("1e-9")
"""Relative difference of numbers, and difference as a share of their scale, that single precision makes."""


def correct_lines(rows: Sequence[Change], before: Loop, after: Loop) -> Iterator[Change]:
    """The lines of a loop, each as true as the neutral loops of both sides make it."""
    unstated_fields = frozenset(key for key in RUNNING_VALUES if not is_given(after, key.split(".")))
    if not has_alarms(before):
        unstated_fields |= {HYSTERESIS}
    sides = NeutralValues(*make_comparable(before, after), before, unstated_fields)
    return (sides.correct_line(row) for row in rows)


OMITTED_DEFAULTS = ("output.manual",)
"""Numbers that are not told on the way back where they are what the PLC has without them."""
RUNNING_VALUES = ("output.bias",)
"""Numbers that are not told on the way back where the loop writes them itself."""


@frozen
class NeutralValues:
    """A loop's neutral values on both sides, in the terms of the source."""

    before: FlatLoop
    after: FlatLoop
    loop: Loop
    unstated_fields: frozenset[str]
    """Numbers of which the target says nothing."""

    def correct_line(self, row: Change) -> Change:
        """A line, with what the target holds."""
        if row.kind == "dropped" or not row.neutral:
            return row
        keys = [key for key in self.before if any(_is_within(key, name) for name in row.neutral)]
        terms = [terms for key in keys if (terms := self._differing_terms(key)) is not None]
        if terms:
            return _mark_rounded(row, max(terms, key=error_percent_of))
        differing_key = next((key for key in keys if self._is_other_choice(key, row)), None)
        if row.kind != "exact" or differing_key is None:
            return row
        note = f"the result has {self.after.get(differing_key)} there"
        return replace(row, kind="dropped", note=f"{row.note}; {note}" if row.note else note, loss=True)

    def _differing_terms(self, key: str) -> Terms | None:
        """A number that differs."""
        wanted, held = _number_of(self.before[key]), _number_of(self.after.get(key))
        if wanted is None or held is None or key in self.unstated_fields:
            return None
        size, scale = max(abs(wanted), abs(held)), self._range_width(key)
        if abs(held - wanted) <= max(NUMBER_TOLERANCE * size, SCALE_TOLERANCE * scale):
            return None
        return Terms(key, wanted, held, self._unit_of(key))

    def _is_other_choice(self, key: str, row: Change) -> bool:
        """Whether a choice, or a number that is gone, differs; without a place only what acts otherwise does."""
        wanted, held = self.before[key], self.after.get(key)
        if _number_of(wanted) is not None and (_number_of(held) is not None or key in OMITTED_DEFAULTS):
            return False
        return wanted != held and not (row.target is None and is_harmless(key, wanted))

    def _range_width(self, key: str) -> Decimal:
        section = "output" if key.startswith("output.") else "pv"
        return abs(Decimal(self.before[f"{section}.range.1"]) - Decimal(self.before[f"{section}.range.0"]))

    def _unit_of(self, key: str) -> str:
        out, pv = self.loop.output.unit or "output", self.loop.pv.unit or "PV"
        if key == "tuning.gain":
            return f"{out}/{pv}"
        if key in {"output.max_rate", "alarms.rate_of_change"}:
            return f"{out if key.startswith('output') else pv}/s"
        if QUANTITY_OF_FIELD.get(key) in {"time", "filter"}:
            return "s"
        return (self.loop.output.unit if key.startswith("output.") else self.loop.pv.unit) or ""


def error_percent_of(terms: Terms) -> Decimal:
    """How far a number is off, in %; infinite beside 0."""
    if not terms.wanted:
        return Decimal("Infinity")
    return abs(quotient(terms.held - terms.wanted, terms.wanted)) * 100


def _mark_rounded(row: Change, terms: Terms) -> Change:
    """A line with a number that differs; gains, times and filters have the error of what acts."""
    if row.error_percent and QUANTITY_OF_FIELD.get(terms.field, "band") == "band":
        return row
    error = error_percent_of(terms)
    percent = float(error) if error.is_finite() else row.error_percent
    return replace(row, kind="rounded" if row.kind == "exact" else row.kind, error_percent=percent, terms=terms)


def _is_within(key: str, name: str) -> bool:
    return key == name or key.startswith(f"{name}.")


def _number_of(value: object) -> Decimal | None:
    return Decimal(value) if isinstance(value, Decimal | int) and not isinstance(value, bool) else None
