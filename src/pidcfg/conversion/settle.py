"""What the target's registers make of exact values, and the report held against what the target's file then says."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, TypeAdapter, ValidationError

from pidcfg.conversion import QUANTITY_OF_FIELD, ConvertError, Missing, Stored, Terms, number_of
from pidcfg.conversion.builder import HYSTERESIS, has_alarms, is_harmless, make_comparable, quotient
from pidcfg.encoders.codecs import Distance, Position
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.base import Quantity, limits_at
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import dotted, is_given, put, steps, value_at
from pidcfg.text.references import Decision

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.conversion import Change, TargetFile
    from pidcfg.conversion.builder import Flat
    from pidcfg.encoders.codecs import Scale
    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.encoders.regmap import Word
    from pidcfg.schemas.base import ConfigurationFile
    from pidcfg.schemas.generic import Loop
    from pidcfg.text.paths import Path
    from pidcfg.vendors import Vendor

# --- What the target's registers make of the exact values that a conversion wrote -------------------------------------
#
# Values are held against what registers can hold and what the manual allows; those outside are clamped. What comes
# back from the registers otherwise is rounded: the file gets the value that the PLC will hold, and the report says by
# how much it differs from what was wanted. Unless something is clamped, the target is validated and encoded once.

REGISTER_PRECISION = Decimal("2e-7")
"""Relative error that counts as none: what single precision makes of a decimal."""
SCALED = (Position, Distance)
"""Registers whose counts are told in engineering units."""
ROUNDS = 3
"""A clamped value is encoded again, and may then be beyond what a register holds together with others."""


def settle_values(file: TargetFile, target: Vendor) -> list[dict[str, Stored]]:
    """Puts the values that the target can hold into a file; what became of each field, by loop.

    Raises `ConvertError` for a value that cannot be clamped, such as a name that is too long.
    """
    wanted = [
        {f.path: value_at(file.data, path_in_file(i, f.path)) if f.exact is None else f.exact for f in fields if f.path}
        for i, fields in enumerate(file.fields)
    ]
    clamped: dict[Path, Stored] = {}
    for _ in range(ROUNDS):
        model = validate_data(target, file.data)
        encoding = encoder_of(target).encode(model)
        outside = _beyond_registers(file.data, encoding, target)
        outside |= _beyond_limits(file, model, outside)
        clamped |= outside
        if all(value_at(file.data, path) == stored.value for path, stored in outside.items()):
            break
        for path, stored in outside.items():
            put(file.data, path, stored.value)
    image = encoding.image
    file.model, file.encoding = model, encoding
    held = encoder_of(target).decode(image.words, image.settings, image.plc).data
    coarse = {path: rounded.stored for path, rounded in encoding.rounded if isinstance(rounded.word.codec, SCALED)}
    widths = {path: width for path, width in _widths(encoding) if path not in coarse}
    rows: list[dict[str, Stored]] = []
    for i, fields in enumerate(file.fields):
        other = {f.path: (f.exact, f.held) for f in fields if f.exact and f.held}
        sizes = {f.path for f in fields if f.neutral in QUANTITY_OF_FIELD}  # decoding leaves out a size that is 0
        row = {}
        for key, value in wanted[i].items():
            path = path_in_file(i, key)
            if path in clamped:
                row[key] = clamped[path]
                continue
            there = coarse[path] if path in coarse else number_of(read_back(model, held, path))
            if there is None and key in sizes:
                there = Decimal(0)
            row[key] = _of_register(file.data, path, number_of(value), there, widths.get(path))
            if key in other:
                row[key] = _of_other_kind(value_at(file.data, path), *other[key])
        rows.append(row)
    if any(stored.kind == "rounded" for row in rows for stored in row.values()):
        file.model = None
    return rows


def path_in_file(loop: int, path: str) -> Path:
    """Where a field of a loop stands in the file; with ``/`` before it, it is one of the file."""
    return steps(path[1:]) if path.startswith("/") else ("loops", loop, *steps(path))


def validate_data(target: Vendor, data: dict[str, object]) -> Any:
    """Plain data as the target's model; raises `ConvertError` with the first key that it refuses."""
    try:
        return target.model.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        text = (first.get("ctx") or {}).get("text", first["msg"])
        path = tuple(first["loc"])
        raise ConvertError([Missing(path, f"{dotted(path)}: {text}")]) from None


def _beyond_registers(data: Mapping[str, object], encoding: AnyEncoding, target: Vendor) -> dict[Path, Stored]:
    """Numbers that registers cannot hold, brought to the end that they hold."""
    outside: dict[Path, Stored] = {}
    for path, misfit in encoding.misfits:
        low, high = misfit.error.low, misfit.error.high
        value = value_at(data, path)
        number = number_of(value)
        if number is None or low is None or high is None or misfit.error.fault != "range":
            raise ConvertError([Missing(path, f"{misfit.word.name} {value}: {misfit.error}")])
        bound = plain_number(min(max(number, low), high))
        outside[path] = Stored(bound, "clamped", note=f"{target.title} holds {low} to {high}")
    return outside


def _beyond_limits(file: TargetFile, model: BaseModel, clamped: Mapping[Path, Stored]) -> dict[Path, Stored]:
    """Numbers that the manual does not allow, brought to the end that it allows; some are ``clamped`` already."""
    outside: dict[Path, Stored] = {}
    for i, fields in enumerate(file.fields):
        for field in fields:
            path = path_in_file(i, field.path)
            of_file = field.path.startswith("/")
            owner: type[BaseModel] = type(model if of_file else value_at(model, ("loops", i)))
            number = number_of(clamped[path].value if path in clamped else value_at(model, path))
            limits = None if number is None else limits_at(owner, field.path.lstrip("/"))
            if limits is None or number is None or limits.holds(number):
                continue
            low, high = (None if end is None else Decimal(end) for end in (limits.low, limits.high))
            bound = low if low is not None and number < low else high
            if bound is not None:
                note = f"allowed is {limits.low} to {limits.high}"
                outside[path] = Stored(plain_number(bound), "clamped", note=note)
    return outside


def _scaled_words(encoding: AnyEncoding) -> Iterator[tuple[Path, Word, Scale, int]]:
    """The words of a file on a scale in engineering units: place, word, scale and content."""
    for block in encoding.blocks:
        for word in block.table.words:
            if isinstance(word.codec, SCALED) and word.path is not None:
                scale = block.scales[word.codec.scale]
                if scale.range is not None:
                    yield (*block.place, *steps(word.path)), word, scale, block.encoded.words[word.offset]


def _widths(encoding: AnyEncoding) -> Iterator[tuple[Path, Decimal]]:
    """The positions of a file by place, each with the width of its scale."""
    return ((path, scale.width) for path, word, scale, _ in _scaled_words(encoding) if isinstance(word.codec, Position))


def _of_register(
    data: dict[str, object], path: Path, wanted: Decimal | None, held: Decimal | None, width: Decimal | None
) -> Stored:
    """What the memory holds of a field; the file gets it where it differs, unless it is a text such as ``500 ms``.

    A position is off by a share of ``width``, that of its scale: beside 0 a count would be many times the value.
    """
    written = value_at(data, path)
    if wanted is None or held is None:
        return Stored(written)
    size = abs(wanted) or Decimal(1)
    if abs(held - wanted) <= REGISTER_PRECISION * size:
        return Stored(written)
    error = abs(held - wanted) / (width or size)
    if not isinstance(written, str):
        written = plain_number(held)
        put(data, path, written)
    return Stored(written, "rounded", float(error * 100))


def _of_other_kind(written: object, wanted: Decimal, held: Decimal) -> Stored:
    """What a field means where its number in the file is of another kind, or shorter than what the memory holds."""
    error = abs(held - wanted) / abs(wanted)
    if error <= REGISTER_PRECISION:
        return Stored(written)
    return Stored(plain_number(Decimal(f"{held:.4g}")), "rounded", float(error * 100))


def read_back(model: BaseModel, data: object, path: Path) -> Any:
    """What decoded data say at a path, read as the field's own type; ``model`` shows the types on the way.

    A field alone is read, so that a decoded file need not be validated as a whole.
    """
    here: object = model
    for i, key in enumerate(path):
        below = value_at(here, (key,))
        if isinstance(here, BaseModel):
            field = type(here).model_fields.get(str(key))
            if field is None:
                return None
            if not isinstance(data, dict) or key not in data:
                return value_at(field.get_default(call_default_factory=True), path[i + 1 :])
            if not _has_models(below):
                return value_at(_reader(type(here), str(key)).validate_python(data[key]), path[i + 1 :])
        here, data = below, value_at(data, (key,))
    return None


def _has_models(value: object) -> bool:
    """Whether the way to a number goes on through models."""
    inner: Sequence[Any] = value if isinstance(value, tuple | list) else (value,)
    return any(isinstance(item, BaseModel) for item in inner)


@cache
def _reader(model: type[BaseModel], key: str) -> TypeAdapter[object]:
    """What reads the text of a field."""
    field = model.model_fields[key]
    kind: Any = field.annotation
    return TypeAdapter(Annotated[kind, *field.metadata] if field.metadata else kind)


# --- Words that are less than a count apart ---------------------------------------------------------------------------

D929 = Decision(
    929,
    "a value is exact when both sides have the count that is nearest to it",
    "A line stays exact where a word in counts lies beside the number of the file and the other side has that number, "
    "or other counts; it says how many counts of the coarser side the words are apart.",
    "41 degC on 0 to 200 degC are 839 counts of 4095, which is 40.98 degC: a PLC with REAL numbers that gets 41 is "
    "0.48 counts apart from it. Each module rounds so, and nobody can write it nearer.",
)
COUNT_DIGITS = 3
"""Of a count, to which two words are told apart."""


@frozen
class Rest:
    """What rounding to counts leaves of a value, as a share of its scale, and the counts of that."""

    share: Decimal
    counts: Decimal


def rests_of(config: ConfigurationFile, encoding: AnyEncoding) -> dict[Path, Rest]:
    """What rounding leaves of the values of a file, by their places."""
    rests = {}
    for path, word, scale, held in _scaled_words(encoding):
        value = value_at(config, path)
        if isinstance(value, Quantity) and isinstance(word.codec, SCALED):
            rests[path] = Rest(quotient(word.codec.rest(value, held, scale), scale.full), scale.full)
    return rests


def counts_apart(one: Rest | None, two: Rest | None) -> float:
    """How far two words for the same number are apart, in counts of the coarser one; 0: neither rounds it."""
    rests = [rest for rest in (one, two) if rest is not None]
    if not rests:
        return 0.0
    shares = [Decimal(0) if rest is None else rest.share for rest in (one, two)]
    apart = abs(shares[0] - shares[1]) * min(rest.counts for rest in rests)
    return round(float(apart), COUNT_DIGITS)


# --- Lines of a report held against what the target's file says in neutral terms, so that no line claims too much -----
#
# Design. The target's file, as its registers round it, is brought to neutral terms like any source. Each line knows
# its neutral fields; their values before and after decide: an ``exact`` line whose numbers differ is rounded, and one
# whose choice differs is dropped. Gains, times and filters get the error of what acts (a time constant, not the share
# in a register), and every number that differs is told in one unit.

EXACT_SHARE, SCALE = Decimal("1e-6"), Decimal("1e-9")
"""Relative difference of numbers, and difference as a share of their scale, that single precision makes."""


def correct_lines(rows: Sequence[Change], before: Loop, after: Loop) -> Iterator[Change]:
    """The lines of a loop, each as true as the neutral loops of both sides make it."""
    not_stated = frozenset(key for key in RUNNING_VALUES if not is_given(after, key.split(".")))
    if not has_alarms(before):
        not_stated |= {HYSTERESIS}
    sides = NeutralValues(*make_comparable(before, after), before, not_stated)
    return (sides.line(row) for row in rows)


NOT_READ_BACK = ("output.manual",)
"""Numbers that are not told on the way back where they are what the PLC has without them."""
RUNNING_VALUES = ("output.bias",)
"""Numbers that are not told on the way back where the loop writes them itself."""


@frozen
class NeutralValues:
    """A loop's neutral values on both sides, in the terms of the source."""

    before: Flat
    after: Flat
    loop: Loop
    not_stated: frozenset[str]
    """Numbers of which the target says nothing."""

    def line(self, row: Change) -> Change:
        """A line, with what the target holds."""
        if row.kind == "dropped" or not row.neutral:
            return row
        keys = [key for key in self.before if any(_within(key, name) for name in row.neutral)]
        terms = [terms for key in keys if (terms := self._terms(key)) is not None]
        if terms:
            return _rounded(row, max(terms, key=error_of))
        other = next((key for key in keys if self._is_other(key, row)), None)
        if row.kind != "exact" or other is None:
            return row
        note = f"the result has {self.after.get(other)} there"
        return replace(row, kind="dropped", note=f"{row.note}; {note}" if row.note else note, loss=True)

    def _terms(self, key: str) -> Terms | None:
        """A number that differs."""
        wanted, held = _number(self.before[key]), _number(self.after.get(key))
        if wanted is None or held is None or key in self.not_stated:
            return None
        size, scale = max(abs(wanted), abs(held)), self._width(key)
        if abs(held - wanted) <= max(EXACT_SHARE * size, SCALE * scale):
            return None
        return Terms(key, wanted, held, self._unit(key))

    def _is_other(self, key: str, row: Change) -> bool:
        """Whether a choice, or a number that is gone, differs; without a place only what acts otherwise does."""
        wanted, held = self.before[key], self.after.get(key)
        if _number(wanted) is not None and (_number(held) is not None or key in NOT_READ_BACK):
            return False
        return wanted != held and not (row.target is None and is_harmless(key, wanted))

    def _width(self, key: str) -> Decimal:
        section = "output" if key.startswith("output.") else "pv"
        return abs(Decimal(self.before[f"{section}.range.1"]) - Decimal(self.before[f"{section}.range.0"]))

    def _unit(self, key: str) -> str:
        out, pv = self.loop.output.unit or "output", self.loop.pv.unit or "PV"
        if key == "tuning.gain":
            return f"{out}/{pv}"
        if key in {"output.max_rate", "alarms.rate_of_change"}:
            return f"{out if key.startswith('output') else pv}/s"
        if QUANTITY_OF_FIELD.get(key) in {"time", "filter"}:
            return "s"
        return (self.loop.output.unit if key.startswith("output.") else self.loop.pv.unit) or ""


def error_of(terms: Terms) -> Decimal:
    """How far a number is off, in %; infinite beside 0."""
    if not terms.wanted:
        return Decimal("Infinity")
    return abs(quotient(terms.held - terms.wanted, terms.wanted)) * 100


def _rounded(row: Change, terms: Terms) -> Change:
    """A line with a number that differs; gains, times and filters have the error of what acts."""
    if row.error_percent and QUANTITY_OF_FIELD.get(terms.field, "band") == "band":
        return row
    error = error_of(terms)
    percent = float(error) if error.is_finite() else row.error_percent
    return replace(row, kind="rounded" if row.kind == "exact" else row.kind, error_percent=percent, terms=terms)


def _within(key: str, name: str) -> bool:
    return key == name or key.startswith(f"{name}.")


def _number(value: object) -> Decimal | None:
    return Decimal(value) if isinstance(value, Decimal | int) and not isinstance(value, bool) else None
