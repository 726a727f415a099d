"""A configuration of one vendor to one of another: neutral loops, target, what it holds, and a line for every field."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, TypeAdapter, ValidationError

from pidcfg.conversion import (
    COMMON_FIELDS,
    DEFAULT_MAX_LOSS,
    QUANTITY_OF_FIELD,
    Change,
    ConvertError,
    FieldIndex,
    MissingField,
    NeutralLoop,
    Stored,
    TargetFile,
    do_overlap,
    json_value,
    judge_change,
    list_changes,
    number_of,
)
from pidcfg.conversion.builder import (
    HYSTERESIS,
    SCALED_CODECS,
    correct_lines,
    counts_between,
    has_alarms,
    is_harmless,
    rounding_excesses,
    scaled_words,
)
from pidcfg.conversion.operation import differing_rules, first_output, source_of, target_of
from pidcfg.encoders.codecs import DecodeError, Position
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.base import Parser, limits_at
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.schemas.iec import Wire
from pidcfg.schemas.numbers import plain_number
from pidcfg.text.paths import dotted_text, given_fields, is_given, parse_path, set_value, value_at

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from pidcfg.conversion import MaxLoss
    from pidcfg.conversion.operation import Operation, VendorSettings
    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.schemas.base import ConfigurationFile
    from pidcfg.text.paths import Data, Path
    from pidcfg.vendors import Vendor

# --- What the target's registers make of the exact values that a conversion wrote -------------------------------------
#
# Values are held against what registers can hold and what the manual allows; those outside are clamped. What comes
# back from the registers otherwise is rounded: the file gets the value that the PLC will hold, and the report says by
# how much it differs from what was wanted. Unless something is clamped, the target is validated and encoded once.

REGISTER_PRECISION = Decimal("2e-7")
"""Relative error that counts as none: what single precision makes of a decimal."""
MAX_CLAMP_PASSES = 3
"""A clamped value is encoded again, and may then be beyond what a register holds together with others."""


def fit_to_registers(file: TargetFile, target: Vendor) -> list[dict[str, Stored]]:
    """Puts the values that the target can hold into a file; what became of each field, by loop.

    Raises `ConvertError` for a value that cannot be clamped, such as a name that is too long.
    """
    values_wanted = [
        {f.path: value_at(file.data, path_in_file(i, f.path)) if f.exact is None else f.exact for f in fields if f.path}
        for i, fields in enumerate(file.fields)
    ]
    clamped: dict[Path, Stored] = {}
    for _ in range(MAX_CLAMP_PASSES):
        model = validate_data(target, file.data)
        encoding = encoder_of(target).encode(model)
        newly_clamped = _clamp_to_registers(file.data, encoding, target)
        newly_clamped |= _clamp_to_limits(file, model, newly_clamped)
        clamped |= newly_clamped
        if all(value_at(file.data, path) == stored.value for path, stored in newly_clamped.items()):
            break
        for path, stored in newly_clamped.items():
            set_value(file.data, path, stored.value)
    image = encoding.image
    file.model, file.encoding = model, encoding
    decoded = encoder_of(target).decode(image.words, image.settings, image.plc).data
    rounded_numbers = {
        path: rounded.stored for path, rounded in encoding.rounded if isinstance(rounded.word.codec, SCALED_CODECS)
    }
    widths = {path: width for path, width in _scale_widths(encoding) if path not in rounded_numbers}
    rows: list[dict[str, Stored]] = []
    for i, fields in enumerate(file.fields):
        other_numbers = {f.path: (f.exact, f.held) for f in fields if f.exact and f.held}
        size_fields = {f.path for f in fields if f.neutral in QUANTITY_OF_FIELD}  # decoding leaves out a size that is 0
        row = {}
        for key, value in values_wanted[i].items():
            path = path_in_file(i, key)
            if path in clamped:
                row[key] = clamped[path]
                continue
            stored_number = (
                rounded_numbers[path] if path in rounded_numbers else number_of(read_back(model, decoded, path))
            )
            if stored_number is None and key in size_fields:
                stored_number = Decimal(0)
            row[key] = _stored_in_register(file.data, path, number_of(value), stored_number, widths.get(path))
            if key in other_numbers:
                row[key] = _stored_as_other_kind(value_at(file.data, path), *other_numbers[key])
        rows.append(row)
    if any(stored.kind == "rounded" for row in rows for stored in row.values()):
        file.model = None
    return rows


def path_in_file(loop: int, path: str) -> Path:
    """Where a field of a loop stands in the file; with ``/`` before it, it is one of the file."""
    return parse_path(path[1:]) if path.startswith("/") else ("loops", loop, *parse_path(path))


def validate_data(target: Vendor, data: dict[str, object]) -> Any:
    """Plain data as the target's model; raises `ConvertError` with the first key that it refuses."""
    try:
        return target.model.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        text = (first.get("ctx") or {}).get("text", first["msg"])
        path = tuple(first["loc"])
        raise ConvertError([MissingField(path, f"{dotted_text(path)}: {text}")]) from None


def _clamp_to_registers(data: Mapping[str, object], encoding: AnyEncoding, target: Vendor) -> dict[Path, Stored]:
    """Numbers that registers cannot hold, brought to the end that they hold."""
    clamped: dict[Path, Stored] = {}
    for path, misfit in encoding.misfits:
        low, high = misfit.error.low, misfit.error.high
        value = value_at(data, path)
        number = number_of(value)
        if number is None or low is None or high is None or misfit.error.fault != "range":
            raise ConvertError([MissingField(path, f"{misfit.word.name} {value}: {misfit.error}")])
        bound = plain_number(min(max(number, low), high))
        clamped[path] = Stored(bound, "clamped", note=f"{target.title} holds {low} to {high}")
    return clamped


def _clamp_to_limits(file: TargetFile, model: BaseModel, clamped: Mapping[Path, Stored]) -> dict[Path, Stored]:
    """Numbers that the manual does not allow, brought to the end that it allows; some are ``clamped`` already."""
    clamped_values: dict[Path, Stored] = {}
    for i, fields in enumerate(file.fields):
        for field in fields:
            path = path_in_file(i, field.path)
            is_file_field = field.path.startswith("/")
            owner: type[BaseModel] = type(model if is_file_field else value_at(model, ("loops", i)))
            number = number_of(clamped[path].value if path in clamped else value_at(model, path))
            limits = None if number is None else limits_at(owner, field.path.lstrip("/"))
            if limits is None or number is None or limits.holds(number):
                continue
            low, high = (None if end is None else Decimal(end) for end in (limits.low, limits.high))
            bound = low if low is not None and number < low else high
            if bound is not None:
                note = f"allowed is {limits.low} to {limits.high}"
                clamped_values[path] = Stored(plain_number(bound), "clamped", note=note)
    return clamped_values


def _scale_widths(encoding: AnyEncoding) -> Iterator[tuple[Path, Decimal]]:
    """The positions of a file by place, each with the width of its scale."""
    return ((path, scale.width) for path, word, scale, _ in scaled_words(encoding) if isinstance(word.codec, Position))


def _stored_in_register(
    data: dict[str, object], path: Path, wanted_value: Decimal | None, held_value: Decimal | None, width: Decimal | None
) -> Stored:
    """What the memory holds of a field; the file gets it where it differs, unless it is a text such as ``500 ms``.

    A position is off by a share of ``width``, that of its scale: beside 0 a count would be many times the value.
    """
    file_value = value_at(data, path)
    if wanted_value is None or held_value is None:
        return Stored(file_value)
    size = abs(wanted_value) or Decimal(1)
    if abs(held_value - wanted_value) <= REGISTER_PRECISION * size:
        return Stored(file_value)
    error = abs(held_value - wanted_value) / (width or size)
    if not isinstance(file_value, str):
        file_value = plain_number(held_value)
        set_value(data, path, file_value)
    return Stored(file_value, "rounded", float(error * 100))


def _stored_as_other_kind(file_value: object, wanted_value: Decimal, held_value: Decimal) -> Stored:
    """What a field means where its number in the file is of another kind, or shorter than what the memory holds."""
    error = abs(held_value - wanted_value) / abs(wanted_value)
    if error <= REGISTER_PRECISION:
        return Stored(file_value)
    return Stored(plain_number(Decimal(f"{held_value:.4g}")), "rounded", float(error * 100))


def read_back(model: BaseModel, data: object, path: Path) -> Any:
    """What decoded data say at a path, read as the field's own type; ``model`` shows the types on the way.

    A field alone is read, so that a decoded file need not be validated as a whole.
    """
    current: object = model
    for i, key in enumerate(path):
        inner = value_at(current, (key,))
        if isinstance(current, BaseModel):
            field = type(current).model_fields.get(str(key))
            if field is None:
                return None
            if not isinstance(data, dict) or key not in data:
                return value_at(field.get_default(call_default_factory=True), path[i + 1 :])
            if not _has_models(inner):
                return value_at(_field_reader(type(current), str(key)).validate_python(data[key]), path[i + 1 :])
        current, data = inner, value_at(data, (key,))
    return None


def _has_models(value: object) -> bool:
    """Whether the way to a number goes on through models."""
    inner: Sequence[Any] = value if isinstance(value, tuple | list) else (value,)
    return any(isinstance(item, BaseModel) for item in inner)


@cache
def _field_reader(model: type[BaseModel], key: str) -> TypeAdapter[object]:
    """What reads the text of a field."""
    field = model.model_fields[key]
    kind: Any = field.annotation
    return TypeAdapter(Annotated[kind, *field.metadata] if field.metadata else kind)


# ----------------------------------------------------------------------------------------------------------------------
# What a conversion within one vendor keeps: places and choices of the PLC, which the neutral form does not know.


def own_setting_lines(
    config: ConfigurationFile, vendor: Vendor, source_loops: Sequence[int], options: Mapping[str, object]
) -> dict[int, list[Change]]:
    """What the loops at some places of a file keep within their vendor, as lines by their number in the result."""
    own_settings = source_of(vendor).OWN_SETTINGS
    paths = [path for path, option in own_settings.choices.items() if option not in options]
    paths += () if options else own_settings.addresses
    data = _plain_data(config, vendor) if paths else {}
    lines: dict[int, list[Change]] = {}
    for j, i in enumerate(source_loops):
        values = [(path, value_at(data, path_in_file(i, path))) for path in paths if not (path.startswith("/") and j)]
        values = [(path, _given_default(config, path) if value is None else value) for path, value in values]
        lines[j] = [
            Change(path, "exact", value, value, target_field=path) for path, value in values if value is not None
        ]
    return lines


def _given_default(config: ConfigurationFile, path: str) -> Any:
    """A choice that the file gives although it is the default; decoding leaves those of the PLC out."""
    keys = path.removeprefix("/").split(".")
    return value_at(config, keys) if path.startswith("/") and is_given(config, keys) else None


def _plain_data(config: ConfigurationFile, vendor: Vendor) -> dict[str, object]:
    """A file as plain data; nothing where its words are no values."""
    image = encoder_of(vendor).encode(config).image
    try:
        data: Data = encoder_of(vendor).decode(image.words, image.settings, image.plc).data
    except DecodeError:
        return {}
    return data


def write_own_settings(data: dict[str, object], lines: Mapping[int, Sequence[Change]]) -> None:
    """Puts what is kept into the result."""
    for j, rows in lines.items():
        for row in rows:
            set_value(data, path_in_file(j, row.field), row.target)


def merge_own_lines(rows: Sequence[Change], own_rows: Sequence[Change], file_keys: Collection[str]) -> Iterator[Change]:
    """The lines of a loop, in which what is kept is neither assumed nor dropped; ``file_keys``: fields of the file."""
    own_by_field = {row.field: row for row in own_rows}
    for row in rows:
        if f"/{row.field}" in file_keys:
            continue
        line = own_by_field.pop(row.field, None)
        yield row if line is None else replace(line, neutral=row.neutral)
    yield from own_by_field.values()


RANGE_ENDS = ("0", "1")
"""Last steps of the neutral names of a range's ends, for which some vendors have one field."""

# --- Fields that a file gives and no line of the report speaks of: a line for each, so that none is lost silently -----
#
# Those that mean nothing to another PLC are in the vendor's table of what is lost harmlessly (`HARMLESS_FIELDS`), each
# with its reason; any other is a loss, so that a new field cannot be forgotten.

KEPT_BLOCK_NOTE = "part of a block that goes with its loop"
READ_SIGNAL_NOTE = "its value goes with what reads it"
UNKNOWN_FIELD_NOTE = "no conversion knows this field: see what it does in the source, and program it"


def unreported_fields(
    given_values: Iterable[tuple[Path, Any]],
    rows: Sequence[Change],
    reasons: Mapping[str, str],
    target: Mapping[str, object],
) -> Iterator[Change]:
    """The lines of those fields that no row is about; ``target``: the loop's data there."""
    for path, value in given_values:
        key, text = dotted_text(path), _plain_value(value)
        if any(do_overlap(key, row.field) for row in rows):
            continue
        if key in COMMON_FIELDS and target.get(key) == value:
            yield Change(key, "exact", text, text, neutral=(key,), target_field=key)
        else:
            reason = next((text for path, text in reasons.items() if f"{key}.".startswith(f"{path}.")), None)
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN_FIELD_NOTE, loss=reason is None)


def fields_of_loop(config: ConfigurationFile, i: int, *, with_plc: bool) -> Iterator[tuple[Path, object]]:
    """The fields that a file gives of a loop, and of the PLC beside it."""
    yield from _fields_as_spelled(config.loops[i])
    plc = getattr(config, "plc", None)
    if with_plc and plc is not None:
        yield from _fields_as_spelled(plc, ("plc",))


def _fields_as_spelled(model: BaseModel, outer: Path = ()) -> Iterator[tuple[Path, object]]:
    """The fields that a file gives of a model; addresses by their names, as the file has them."""
    fields = type(model).model_fields
    spellings = {key: mark.spell for key, row in fields.items() for mark in row.metadata if isinstance(mark, Parser)}
    for path, value in given_fields(model, outer):
        spell = spellings.get(str(path[-1])) if len(path) == len(outer) + 1 else None
        yield path, spell(value) if spell is not None and isinstance(value, int) else value


def unreported_items(config: ConfigurationFile, rows: Sequence[Change], reasons: Mapping[str, str]) -> Iterator[Change]:
    """Blocks, signals and moves that stand beside the loops and go with one of them; ``rows`` of all loops.

    ``reasons``: why nothing is lost of some of them.
    """
    reported = FieldIndex(row.field for row in rows)
    for block in getattr(config, "blocks", ()):
        is_reported = reported.has_overlap(f"blocks.{block.name}")
        for path, value in given_fields(block):
            key = f"blocks.{block.name}.{dotted_text(path)}"
            if not reported.has_overlap(key):
                note = KEPT_BLOCK_NOTE if is_reported else UNKNOWN_FIELD_NOTE
                yield Change(key, "dropped", _plain_value(value), None, note=note, loss=not is_reported)
    for name, value in getattr(config, "signals", {}).items():
        if not reported.has_overlap(f"signals.{name}"):
            yield Change(f"signals.{name}", "dropped", _plain_value(value), None, note=READ_SIGNAL_NOTE)
    for i, move in enumerate(getattr(config, "moves", ())):
        key = f"moves.{i}"
        if not reported.has_overlap(key):
            reason = reasons.get(key)
            text = f"{_plain_value(move.move)} to {move.to}"
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN_FIELD_NOTE, loss=reason is None)


def _plain_value(value: object) -> Any:
    """A value as JSON has it; what is neither number nor word as text."""
    plain = value.text if isinstance(value, Wire) else json_value(value)
    return plain if isinstance(plain, bool | int | float | str | list) else str(plain)


# ----------------------------------------------------------------------------------------------------------------------
# A configuration of one vendor to one of another: neutral loops, target, what its registers hold, and the report.
# A loop that cannot go, because it says too little or the target cannot hold it at all, does not stop the others: it
# is left out, with its reasons, and the rest is converted without it.

__all__ = ["ConvertError", "ConvertedFile", "LoopReport", "convert", "generic_file", "neutral_loops"]


DERIVATIVE_ON = "tuning.derivative_on"
FIRST_OUTPUT_NOTE = "the output that the loop begins with: limits hold in Manual, too"


class LoopReport(NamedTuple):
    """What became of a loop: of each of its fields, or why it could not go."""

    loop: str
    """Its name."""
    changes: tuple[Change, ...]
    status: Literal["converted", "dropped"] = "converted"
    reason: str = ""
    """Why it was dropped."""


@dataclass(frozen=True)
class ConvertedFile:
    """The target's file as plain data and as its model, and the report by loop; its registers when asked for."""

    vendor: Vendor
    data: Data
    loops: tuple[LoopReport, ...]
    config: ConfigurationFile
    """The file as the vendor's model."""
    missing: tuple[MissingField, ...] = ()
    """What the loops that were dropped lack, by their places in the source."""

    @property
    def has_losses(self) -> bool:
        """Whether anything was lost: a loop, or a line of one."""
        return any(loop.status == "dropped" or any(row.loss for row in loop.changes) for loop in self.loops)

    @property
    def source_loops(self) -> tuple[int, ...]:
        """The places in the source of the loops that went over."""
        return tuple(i for i, loop in enumerate(self.loops) if loop.status == "converted")

    @cached_property
    def encoding(self) -> AnyEncoding:
        """The registers or parameters that the model becomes."""
        return encoder_of(self.vendor).encode(self.config)


def neutral_loops(config: ConfigurationFile, source: Vendor) -> tuple[GenericFile, list[NeutralLoop]]:
    """The neutral file of a configuration; raises `ConvertError` for what it must say before."""
    loops: list[NeutralLoop] = source_of(source).to_neutral(config)
    missing = [entry for loop in loops for entry in loop.missing]
    if missing:
        raise ConvertError(missing)
    return generic_file(config, loops), loops


def generic_file(config: ConfigurationFile, loops: Sequence[NeutralLoop]) -> GenericFile:
    """The neutral file of a configuration's loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [loop.data for loop in loops]}
    data |= {key: getattr(config, key) for key in ("name", "description") if getattr(config, key) is not None}
    return GenericFile.model_validate(data)


def convert(
    config: ConfigurationFile,
    source: Vendor,
    target: Vendor,
    options: Mapping[str, object],
    *,
    max_loss: MaxLoss = DEFAULT_MAX_LOSS,
    excluded: Mapping[int, str] | None = None,
) -> ConvertedFile:
    """The same loops for another vendor, with what became of every field.

    ``options``: where things go that the source does not say, by the keys of the target's `CONVERT_OPTIONS`.
    ``excluded``: loops that are not converted, by their places, each with the reason. Raises `ConvertError` where no
    loop can be converted, and for what the target cannot hold at all.
    """
    loops: list[NeutralLoop] = source_of(source).to_neutral(config)
    if not loops:
        raise ConvertError([MissingField(("loops",), "there is no loop to convert: add one")])
    problems = {i: [MissingField(("loops", i), reason)] for i, reason in (excluded or {}).items()}
    problems |= {i: loop.missing for i, loop in enumerate(loops) if loop.missing}
    while True:
        kept_loops = [i for i in range(len(loops)) if i not in problems]
        missing = tuple(entry for i in sorted(problems) for entry in problems[i])
        if not kept_loops:
            raise ConvertError(list(missing))
        try:
            outcome = _Conversion(config, source, target, [loops[i] for i in kept_loops], kept_loops)
            return outcome.result(_options_of_kept_loops(options, kept_loops, len(loops)), max_loss, missing)
        except ConvertError as error:
            problems |= _problems_by_loop(error, kept_loops)


def _options_of_kept_loops(options: Mapping[str, object], kept_loops: Sequence[int], count: int) -> dict[str, object]:
    """Options without what they say of loops that are left out; one value alone is where all begin."""
    return {
        key: [item for i, item in enumerate(value) if i in kept_loops or i >= count]
        if isinstance(value, list) and len(value) > 1
        else value
        for key, value in options.items()
    }


def _problems_by_loop(error: ConvertError, source_loops: Sequence[int]) -> dict[int, list[MissingField]]:
    """The problems of an error by loop of the source; raises it again where one is not about a loop."""
    problems: dict[int, list[MissingField]] = {}
    for entry in error.missing:
        top, *inner = entry.path
        if top != "loops" or not inner or not isinstance(inner[0], int):
            raise error
        source_loop = source_loops[inner[0]]
        problems.setdefault(source_loop, []).append(MissingField(("loops", source_loop, *inner[1:]), entry.message))
    return problems


@dataclass(slots=True)
class _Conversion:
    """Loops on their way from one vendor to another."""

    config: ConfigurationFile
    source: Vendor
    target: Vendor
    loops: list[NeutralLoop]
    source_loops: list[int]
    """Their places in the source."""

    def result(
        self, options: Mapping[str, object], max_loss: MaxLoss, missing: tuple[MissingField, ...]
    ) -> ConvertedFile:
        """The target's file, and the report."""
        operations: list[Operation] = source_of(self.source).operations(self.config)
        before = [operations[i] for i in self.source_loops]
        generic = generic_file(self.config, self.loops)
        outputs = self._first_outputs(generic.loops, before)
        with_outputs = [_set_manual_output(loop, outputs.get(j)) for j, loop in enumerate(generic.loops)]
        generic = generic.model_copy(update={"loops": tuple(with_outputs)})
        own_lines: dict[int, list[Change]] = {}
        if self.source is self.target:
            own_lines = own_setting_lines(self.config, self.source, self.source_loops, options)
            scales = source_of(self.source).OWN_SETTINGS.scale_options(self.config, self.source_loops)
            options = {**scales, **options}  # what gains and times depend on, unless the options say it
        file: TargetFile = target_of(self.target).from_neutral(generic, options, before)
        write_own_settings(file.data, own_lines)
        stored = fit_to_registers(file, self.target)
        model = validate_data(self.target, file.data) if file.model is None else file.model
        sides = Sides(
            generic.loops, before, source_of(self.target).to_neutral(model), source_of(self.target).operations(model)
        )
        reports = {i: self._loop_lines(j, file, stored[j], sides, own_lines) for j, i in enumerate(self.source_loops)}
        reports = self._add_count_distances(reports, model, file.encoding)
        reports |= {self.source_loops[j]: list(map(_mark_first_output, reports[self.source_loops[j]])) for j in outputs}
        reported = [row for rows in reports.values() for row in rows]
        reports[self.source_loops[0]] += unreported_items(self.config, reported, self._harmless_reasons())
        reasons = {entry.path[1]: entry.message for entry in reversed(missing)}
        report = tuple(
            LoopReport(loop.name, tuple(judge_change(row, max_loss) for row in reports[i]))
            if i in reports
            else LoopReport(loop.name, (), "dropped", reasons[i])
            for i, loop in enumerate(self.config.loops)
        )
        return ConvertedFile(self.target, file.data, report, model, missing)

    def _first_outputs(self, loops: Sequence[Loop], before: Sequence[Operation]) -> dict[int, Decimal]:
        """The outputs with which loops begin in Manual, where the target would begin with another one."""
        rules: VendorSettings = source_of(self.target).OWN_SETTINGS
        outputs = {j: first_output(before[j], loop) for j, loop in enumerate(loops) if loop.mode == "manual"}
        return {
            j: output
            for j, output in outputs.items()
            if first_output(rules, _set_manual_output(loops[j], output)) != first_output(rules, loops[j])
        }

    def _add_count_distances(
        self, reports: Mapping[int, Sequence[Change]], model: Any, encoding: AnyEncoding
    ) -> dict[int, list[Change]]:
        """The lines of all loops; an exact one says how far the words are apart where one side rounds to counts."""
        source_excess = rounding_excesses(self.config, encoder_of(self.source).encode(self.config))
        target_excess = rounding_excesses(model, encoding)

        def add_distance(row: Change, i: int, j: int) -> Change:
            if row.kind != "exact" or not row.target_field:
                return row
            ends = ["", *(f".{name[-1]}" for name in row.neutral if name[-1] in RANGE_ENDS)]
            excess = next(
                (source_excess[path] for end in ends if (path := path_in_file(i, row.field + end)) in source_excess),
                None,
            )
            apart = counts_between(excess, target_excess.get(path_in_file(j, row.target_field)))
            return replace(row, counts_apart=apart) if apart else row

        places = {i: j for j, i in enumerate(self.source_loops)}
        return {i: [add_distance(row, i, places[i]) for row in rows] for i, rows in reports.items()}

    def _harmless_reasons(self) -> dict[str, str]:
        """Why nothing is lost of what stands beside the loops."""
        return {path: reason for loop in self.loops for path, reason in loop.harmless_items.items()}

    def _loop_lines(
        self,
        j: int,
        file: TargetFile,
        stored: Mapping[str, Stored],
        sides: Sides,
        own_lines: Mapping[int, Sequence[Change]],
    ) -> list[Change]:
        """The lines of one of the loops; ``own_lines``: of what all keep within their vendor."""
        loop = sides.before[j]
        rows = list(list_changes(self.loops[j].fields, file.fields[j], stored, partial(_is_default, loop)))
        own_rows = own_lines.get(j, ())
        rows = list(
            merge_own_lines(rows, own_rows, {row.field for row in own_lines.get(0, ()) if row.field.startswith("/")})
        )
        if (after := sides.loop_in_target(j)) is not None:
            rows = [*correct_lines(rows, loop, after), *_derivative_line(rows, loop, after)]
        lines = list(
            differing_rules(sides.operations_before[j], sides.operations_after[j], loop, is_master=sides.is_master(j))
        )
        worse_fields = {name for line in lines if line.loss for name in line.neutral}
        rows = [_mark_assumed(row) if worse_fields.intersection(row.neutral) else row for row in rows] + lines
        fields_given = fields_of_loop(self.config, self.source_loops[j], with_plc=j == 0)
        reported = [*rows, *(replace(row, field=row.field.removeprefix("/")) for row in own_rows)]
        return [
            *rows,
            *unreported_fields(fields_given, reported, source_of(self.source).HARMLESS_FIELDS, file.data["loops"][j]),
        ]


def _derivative_line(rows: Sequence[Change], before: Loop, after: Loop) -> Iterator[Change]:
    """A line about a derivative that acts on something else, where the source does not say on what."""
    tuning_before, tuning_after = before.tuning, after.tuning
    is_told = any(DERIVATIVE_ON in row.neutral for row in rows)
    if (
        tuning_before.derivative_time
        and tuning_after.derivative_time
        and tuning_before.derivative_on != tuning_after.derivative_on
        and not is_told
    ):
        note = f"the derivative acts on the {tuning_after.derivative_on}, not on the {tuning_before.derivative_on}"
        yield Change(
            DERIVATIVE_ON, "dropped", tuning_before.derivative_on, None, note=note, loss=True, neutral=(DERIVATIVE_ON,)
        )


def _set_manual_output(loop: Loop, output: Decimal | None) -> Loop:
    """A loop that begins in Manual with an output."""
    if output is None:
        return loop
    return loop.model_copy(update={"output": loop.output.model_copy(update={"manual": output})})


def _mark_first_output(row: Change) -> Change:
    """A line about the output in Manual that the source's limits, or its own zero, make another one."""
    if "output.manual" not in row.neutral or row.kind != "exact":
        return row
    return replace(row, kind="assumed", note="; ".join(filter(None, (row.note, FIRST_OUTPUT_NOTE))))


def _mark_assumed(row: Change) -> Change:
    """A line about a field that acts otherwise in the target, which another line tells."""
    return replace(row, kind="assumed") if row.kind == "exact" else row


@dataclass
class Sides:
    """The neutral loops of both sides, and what their PLCs do with them."""

    before: Sequence[Loop]
    operations_before: Sequence[Operation]
    after: Sequence[NeutralLoop]
    operations_after: Sequence[Operation]

    def loop_in_target(self, j: int) -> Loop | None:
        """A loop as the target has it, linked by the names of the source; None where it cannot be told."""
        loop = self.after[j]
        if loop.missing:
            return None
        target_loop = Loop.model_validate(loop.data)
        link = target_loop.setpoint.model_copy(
            update={"source": self._source_names.get(target_loop.setpoint.source, target_loop.setpoint.source)}
        )
        return target_loop.model_copy(update={"setpoint": link})

    def is_master(self, j: int) -> bool:
        """Whether another loop takes its set point from this one, on both sides."""
        return (self.before[j].name, self.after[j].data.get("name")) in self._master_names

    @cached_property
    def _source_names(self) -> dict[object, str]:
        """The names of the source by those of the target."""
        return {after.data.get("name"): before.name for before, after in zip(self.before, self.after, strict=True)}

    @cached_property
    def _master_names(self) -> set[tuple[Any, object]]:
        """The loops that loops take their set points from, on both sides."""
        sides = zip(self.before, self.after, strict=True)
        return {(before.setpoint.source, after.data.get("setpoint", {}).get("source")) for before, after in sides}


def _is_default(loop: BaseModel, field: str) -> bool:
    """Whether a neutral field is at its default or harmless: what a loop is like that does not give it."""
    if field == HYSTERESIS and not has_alarms(loop):
        return True
    value: Any = loop
    for key in parse_path(field):
        if not isinstance(value, BaseModel) or key not in type(value).model_fields:
            return False
        default, value = type(value).model_fields[str(key)].default, getattr(value, str(key))
        if value == default:
            return True
    return is_harmless(field, value)
