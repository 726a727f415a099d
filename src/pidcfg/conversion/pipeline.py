"""A configuration of one vendor to one of another: neutral loops, target, and a line for every field."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import BaseModel

from pidcfg.conversion import (
    COMMON,
    DEFAULT_MAX_LOSS,
    Change,
    ConvertError,
    FieldIndex,
    Missing,
    NeutralLoop,
    TargetFile,
    changes,
    json_value,
    judge_change,
    overlap,
)
from pidcfg.conversion.builder import HYSTERESIS, has_alarms, is_harmless
from pidcfg.conversion.operation import differing_rules, first_output, source_of, target_of
from pidcfg.conversion.settle import (
    correct_lines,
    counts_apart,
    path_in_file,
    rests_of,
    settle_values,
    validate_data,
)
from pidcfg.encoders.codecs import DecodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.schemas.base import Parser
from pidcfg.schemas.generic import GenericFile, Loop
from pidcfg.schemas.iec import Wire
from pidcfg.text.paths import dotted, given_fields, is_given, put, steps, value_at

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
    from decimal import Decimal

    from pidcfg.conversion import MaxLoss, Stored
    from pidcfg.conversion.operation import Operation, VendorSettings
    from pidcfg.encoders.parameters import AnyEncoding
    from pidcfg.schemas.base import ConfigurationFile
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data, Path
    from pidcfg.vendors import Vendor

# ----------------------------------------------------------------------------------------------------------------------
# What a conversion within one vendor keeps: places and choices of the PLC, which the neutral form does not know.


def own_setting_lines(
    config: ConfigurationFile, vendor: Vendor, places: Sequence[int], options: Mapping[str, object]
) -> dict[int, list[Change]]:
    """What the loops at some places of a file keep within their vendor, as lines by their number in the result."""
    own = source_of(vendor).OWN_SETTINGS
    paths = [path for path, option in own.choices.items() if option not in options]
    paths += () if options else own.addresses
    held = _as_data(config, vendor) if paths else {}
    lines: dict[int, list[Change]] = {}
    for j, i in enumerate(places):
        found = [(path, value_at(held, path_in_file(i, path))) for path in paths if not (path.startswith("/") and j)]
        found = [(path, _default(config, path) if value is None else value) for path, value in found]
        lines[j] = [
            Change(path, "exact", value, value, target_field=path) for path, value in found if value is not None
        ]
    return lines


def _default(config: ConfigurationFile, path: str) -> Any:
    """A choice that the file gives although it is the default; decoding leaves those of the PLC out."""
    keys = path.removeprefix("/").split(".")
    return value_at(config, keys) if path.startswith("/") and is_given(config, keys) else None


def _as_data(config: ConfigurationFile, vendor: Vendor) -> dict[str, object]:
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
            put(data, path_in_file(j, row.field), row.target)


def merge_own_lines(rows: Sequence[Change], kept: Sequence[Change], of_file: Collection[str]) -> Iterator[Change]:
    """The lines of a loop, in which what is kept is neither assumed nor dropped; ``of_file``: fields of the file."""
    own = {row.field: row for row in kept}
    for row in rows:
        if f"/{row.field}" in of_file:
            continue
        line = own.pop(row.field, None)
        yield row if line is None else replace(line, neutral=row.neutral)
    yield from own.values()


ENDS = ("0", "1")
"""Last steps of the neutral names of a range's ends, for which some vendors have one field."""

# --- Fields that a file gives and no line of the report speaks of: a line for each, so that none is lost silently -----
#
# Those that mean nothing to another PLC are in the vendor's table of what is lost harmlessly (`NOTHING_LOST`), each
# with its reason; any other is a loss, so that a new field cannot be forgotten.

WITH_LOOP = "part of a block that goes with its loop"
WITH_READER = "its value goes with what reads it"
UNKNOWN = "no conversion knows this field: see what it does in the source, and program it"


def unreported_fields(
    given: Iterable[tuple[Path, Any]], rows: Sequence[Change], reasons: Mapping[str, str], target: Mapping[str, object]
) -> Iterator[Change]:
    """The lines of those fields that no row is about; ``target``: the loop's data there."""
    for path, value in given:
        key, text = dotted(path), _plain_value(value)
        if any(overlap(key, row.field) for row in rows):
            continue
        if key in COMMON and target.get(key) == value:
            yield Change(key, "exact", text, text, neutral=(key,), target_field=key)
        else:
            reason = next((text for path, text in reasons.items() if f"{key}.".startswith(f"{path}.")), None)
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN, loss=reason is None)


def fields_of_loop(config: ConfigurationFile, i: int, *, with_plc: bool) -> Iterator[tuple[Path, object]]:
    """The fields that a file gives of a loop, and of the PLC beside it."""
    yield from _fields_as_spelled(config.loops[i])
    plc = getattr(config, "plc", None)
    if with_plc and plc is not None:
        yield from _fields_as_spelled(plc, ("plc",))


def _fields_as_spelled(model: BaseModel, above: Path = ()) -> Iterator[tuple[Path, object]]:
    """The fields that a file gives of a model; addresses by their names, as the file has them."""
    fields = type(model).model_fields
    spellings = {key: mark.spell for key, row in fields.items() for mark in row.metadata if isinstance(mark, Parser)}
    for path, value in given_fields(model, above):
        spell = spellings.get(str(path[-1])) if len(path) == len(above) + 1 else None
        yield path, spell(value) if spell is not None and isinstance(value, int) else value


def items_beside_loops(
    config: ConfigurationFile, rows: Sequence[Change], reasons: Mapping[str, str]
) -> Iterator[Change]:
    """Blocks, signals and moves that stand beside the loops and go with one of them; ``rows`` of all loops.

    ``reasons``: why nothing is lost of some of them.
    """
    told = FieldIndex(row.field for row in rows)
    for block in getattr(config, "blocks", ()):
        is_told = told.overlaps(f"blocks.{block.name}")
        for path, value in given_fields(block):
            key = f"blocks.{block.name}.{dotted(path)}"
            if not told.overlaps(key):
                note = WITH_LOOP if is_told else UNKNOWN
                yield Change(key, "dropped", _plain_value(value), None, note=note, loss=not is_told)
    for name, value in getattr(config, "signals", {}).items():
        if not told.overlaps(f"signals.{name}"):
            yield Change(f"signals.{name}", "dropped", _plain_value(value), None, note=WITH_READER)
    for i, move in enumerate(getattr(config, "moves", ())):
        key = f"moves.{i}"
        if not told.overlaps(key):
            reason = reasons.get(key)
            text = f"{_plain_value(move.move)} to {move.to}"
            yield Change(key, "dropped", text, None, note=reason or UNKNOWN, loss=reason is None)


def _plain_value(value: object) -> Any:
    """A value as JSON has it; what is neither number nor word as text."""
    plain = value.text if isinstance(value, Wire) else json_value(value)
    return plain if isinstance(plain, bool | int | float | str | list) else str(plain)


# --- Comments of a configuration that survive its conversion: those at its head, and those of each loop ---------------

QUOTED = re.compile(r"\"(?:[^\"\\]|\\.)*\"|'(?:[^']|'')*'")
ITEM = "  - "
"""How a loop begins in a file that pidcfg writes."""


def comment_of(line: str, known: Collection[str] = ()) -> str | None:
    """The comment of a line; None: there is none, or it is a known one.

    One behind a value speaks of that key and value, which another vendor writes otherwise: they come along.
    """
    bare = QUOTED.sub(lambda text: "x" * len(text.group()), line)
    start = next((i for i, c in enumerate(bare) if c == "#" and (i == 0 or bare[i - 1].isspace())), None)
    if start is None:
        return None
    text, value = line[start + 1 :].strip(), " ".join(line[:start].split()).removeprefix("- ")
    if text in known:
        return None
    return f"{value}  # {text}" if value and text else text


def comments(doc: Document, loops: int, known: Collection[str] = ()) -> tuple[list[str], list[list[str]]]:
    """The comments above the loops, and those of each loop: before it, and behind its values; ``known`` stay behind."""
    lines = doc.lines
    starts = [_first_line(doc, lines, i) for i in range(loops)]
    texts: list[list[str]] = []
    for i, start in enumerate(starts):
        end = starts[i + 1] if i + 1 < loops else len(lines)
        texts.append(_comments_of(lines[start:end], known))
    return _comments_of(lines[: starts[0]] if starts else lines, known), texts


def _first_line(doc: Document, lines: list[str], loop: int) -> int:
    """Where a loop begins, with the comment lines directly above it."""
    line = doc.locate(("loops", loop)).line - 1
    while line > 0 and lines[line - 1].lstrip().startswith("#") and lines[line - 1][:1].isspace():
        line -= 1
    return line


def _comments_of(lines: list[str], known: Collection[str]) -> list[str]:
    return [text for line in lines if (text := comment_of(line, known))]


def insert_comments(text: str, head: list[str], loops: list[list[str]]) -> str:
    """A file with comments at its head and above its loops."""
    out = [f"# {comment}" for comment in head]
    number, within = 0, False
    for line in text.splitlines():
        if within and line.startswith(ITEM) and number < len(loops):
            out += [f"  # {comment}" for comment in loops[number]]
            number += 1
        within = line.startswith("loops:") or (within and (line.startswith(" ") or not line))
        out.append(line)
    return "\n".join(out) + "\n"


# ----------------------------------------------------------------------------------------------------------------------
# A configuration of one vendor to one of another: neutral loops, target, what its registers hold, and the report.
# A loop that cannot go, because it says too little or the target cannot hold it at all, does not stop the others: it
# is left out, with its reasons, and the rest is converted without it.

__all__ = ["ConvertError", "Converted", "LoopReport", "convert", "generic_file", "neutral_loops"]


DERIVATIVE_ON = "tuning.derivative_on"
FIRST_OUTPUT = "the output that the loop begins with: limits hold in Manual, too"


class LoopReport(NamedTuple):
    """What became of a loop: of each of its fields, or why it could not go."""

    loop: str
    """Its name."""
    changes: tuple[Change, ...]
    status: Literal["converted", "dropped"] = "converted"
    reason: str = ""
    """Why it was dropped."""


@dataclass(frozen=True)
class Converted:
    """The target's file as plain data and as its model, and the report by loop; its registers when asked for."""

    vendor: Vendor
    data: Data
    loops: tuple[LoopReport, ...]
    config: ConfigurationFile
    """The file as the vendor's model."""
    missing: tuple[Missing, ...] = ()
    """What the loops that were dropped lack, by their places in the source."""

    @property
    def losses(self) -> bool:
        """Whether anything was lost: a loop, or a line of one."""
        return any(loop.status == "dropped" or any(row.loss for row in loop.changes) for loop in self.loops)

    @property
    def source_places(self) -> tuple[int, ...]:
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
) -> Converted:
    """The same loops for another vendor, with what became of every field.

    ``options``: where things go that the source does not say, by the keys of the target's `CONVERT_OPTIONS`.
    ``excluded``: loops that are not converted, by their places, each with the reason. Raises `ConvertError` where no
    loop can be converted, and for what the target cannot hold at all.
    """
    loops: list[NeutralLoop] = source_of(source).to_neutral(config)
    if not loops:
        raise ConvertError([Missing(("loops",), "there is no loop to convert: add one")])
    dropped = {i: [Missing(("loops", i), reason)] for i, reason in (excluded or {}).items()}
    dropped |= {i: loop.missing for i, loop in enumerate(loops) if loop.missing}
    while True:
        kept = [i for i in range(len(loops)) if i not in dropped]
        missing = tuple(entry for i in sorted(dropped) for entry in dropped[i])
        if not kept:
            raise ConvertError(list(missing))
        try:
            outcome = _Conversion(config, source, target, [loops[i] for i in kept], kept)
            return outcome.result(_options_of_kept_loops(options, kept, len(loops)), max_loss, missing)
        except ConvertError as error:
            dropped |= _problems_by_loop(error, kept)


def _options_of_kept_loops(options: Mapping[str, object], kept: Sequence[int], count: int) -> dict[str, object]:
    """Options without what they say of loops that are left out; one value alone is where all begin."""
    return {
        key: [item for i, item in enumerate(value) if i in kept or i >= count]
        if isinstance(value, list) and len(value) > 1
        else value
        for key, value in options.items()
    }


def _problems_by_loop(error: ConvertError, places: Sequence[int]) -> dict[int, list[Missing]]:
    """The problems of an error by loop of the source; raises it again where one is not about a loop."""
    problems: dict[int, list[Missing]] = {}
    for entry in error.missing:
        top, *below = entry.path
        if top != "loops" or not below or not isinstance(below[0], int):
            raise error
        place = places[below[0]]
        problems.setdefault(place, []).append(Missing(("loops", place, *below[1:]), entry.message))
    return problems


@dataclass(slots=True)
class _Conversion:
    """Loops on their way from one vendor to another."""

    config: ConfigurationFile
    source: Vendor
    target: Vendor
    loops: list[NeutralLoop]
    source_places: list[int]
    """Their places in the source."""

    def result(self, options: Mapping[str, object], max_loss: MaxLoss, missing: tuple[Missing, ...]) -> Converted:
        """The target's file, and the report."""
        operations: list[Operation] = source_of(self.source).operations(self.config)
        before = [operations[i] for i in self.source_places]
        generic = generic_file(self.config, self.loops)
        first = self._first_outputs(generic.loops, before)
        begun = [_with_output(loop, first.get(j)) for j, loop in enumerate(generic.loops)]
        generic = generic.model_copy(update={"loops": tuple(begun)})
        own: dict[int, list[Change]] = {}
        if self.source is self.target:
            own = own_setting_lines(self.config, self.source, self.source_places, options)
            scales = source_of(self.source).OWN_SETTINGS.scales(self.config, self.source_places)
            options = {**scales, **options}  # what gains and times depend on, unless the options say it
        file: TargetFile = target_of(self.target).from_neutral(generic, options, before)
        write_own_settings(file.data, own)
        stored = settle_values(file, self.target)
        model = validate_data(self.target, file.data) if file.model is None else file.model
        sides = Sides(
            generic.loops, before, source_of(self.target).to_neutral(model), source_of(self.target).operations(model)
        )
        reports = {i: self._rows(j, file, stored[j], sides, own) for j, i in enumerate(self.source_places)}
        reports = self._with_counts(reports, model, file.encoding)
        reports |= {self.source_places[j]: list(map(_mark_first_output, reports[self.source_places[j]])) for j in first}
        reported = [row for rows in reports.values() for row in rows]
        reports[self.source_places[0]] += items_beside_loops(self.config, reported, self._reasons())
        reasons = {entry.path[1]: entry.message for entry in reversed(missing)}
        report = tuple(
            LoopReport(loop.name, tuple(judge_change(row, max_loss) for row in reports[i]))
            if i in reports
            else LoopReport(loop.name, (), "dropped", reasons[i])
            for i, loop in enumerate(self.config.loops)
        )
        return Converted(self.target, file.data, report, model, missing)

    def _first_outputs(self, loops: Sequence[Loop], before: Sequence[Operation]) -> dict[int, Decimal]:
        """The outputs with which loops begin in Manual, where the target would begin with another one."""
        rules: VendorSettings = source_of(self.target).OWN_SETTINGS
        outputs = {j: first_output(before[j], loop) for j, loop in enumerate(loops) if loop.mode == "manual"}
        return {
            j: output
            for j, output in outputs.items()
            if first_output(rules, _with_output(loops[j], output)) != first_output(rules, loops[j])
        }

    def _with_counts(
        self, reports: Mapping[int, Sequence[Change]], model: Any, encoding: AnyEncoding
    ) -> dict[int, list[Change]]:
        """The lines of all loops; an exact one says how far the words are apart where one side rounds to counts."""
        one = rests_of(self.config, encoder_of(self.source).encode(self.config))
        two = rests_of(model, encoding)

        def line(row: Change, i: int, j: int) -> Change:
            if row.kind != "exact" or not row.target_field:
                return row
            ends = ["", *(f".{name[-1]}" for name in row.neutral if name[-1] in ENDS)]
            first = next((one[path] for end in ends if (path := path_in_file(i, row.field + end)) in one), None)
            apart = counts_apart(first, two.get(path_in_file(j, row.target_field)))
            return replace(row, counts_apart=apart) if apart else row

        places = {i: j for j, i in enumerate(self.source_places)}
        return {i: [line(row, i, places[i]) for row in rows] for i, rows in reports.items()}

    def _reasons(self) -> dict[str, str]:
        """Why nothing is lost of what stands beside the loops."""
        return {path: reason for loop in self.loops for path, reason in loop.beside.items()}

    def _rows(
        self,
        j: int,
        file: TargetFile,
        stored: Mapping[str, Stored],
        sides: Sides,
        own_lines: Mapping[int, Sequence[Change]],
    ) -> list[Change]:
        """The lines of one of the loops; ``own_lines``: of what all keep within their vendor."""
        loop = sides.before[j]
        rows = list(changes(self.loops[j].fields, file.fields[j], stored, partial(_is_default, loop)))
        own = own_lines.get(j, ())
        rows = list(
            merge_own_lines(rows, own, {row.field for row in own_lines.get(0, ()) if row.field.startswith("/")})
        )
        if (after := sides.loop_in_target(j)) is not None:
            rows = [*correct_lines(rows, loop, after), *_derivative_line(rows, loop, after)]
        lines = list(
            differing_rules(sides.operations_before[j], sides.operations_after[j], loop, is_master=sides.is_master(j))
        )
        about = {name for line in lines if line.loss for name in line.neutral}
        rows = [_mark_assumed(row) if about.intersection(row.neutral) else row for row in rows] + lines
        given = fields_of_loop(self.config, self.source_places[j], with_plc=j == 0)
        reported = [*rows, *(replace(row, field=row.field.removeprefix("/")) for row in own)]
        return [*rows, *unreported_fields(given, reported, source_of(self.source).NOTHING_LOST, file.data["loops"][j])]


def _derivative_line(rows: Sequence[Change], before: Loop, after: Loop) -> Iterator[Change]:
    """A line about a derivative that acts on something else, where the source does not say on what."""
    one, two = before.tuning, after.tuning
    told = any(DERIVATIVE_ON in row.neutral for row in rows)
    if one.derivative_time and two.derivative_time and one.derivative_on != two.derivative_on and not told:
        note = f"the derivative acts on the {two.derivative_on}, not on the {one.derivative_on}"
        yield Change(DERIVATIVE_ON, "dropped", one.derivative_on, None, note=note, loss=True, neutral=(DERIVATIVE_ON,))


def _with_output(loop: Loop, output: Decimal | None) -> Loop:
    """A loop that begins in Manual with an output."""
    if output is None:
        return loop
    return loop.model_copy(update={"output": loop.output.model_copy(update={"manual": output})})


def _mark_first_output(row: Change) -> Change:
    """A line about the output in Manual that the source's limits, or its own zero, make another one."""
    if "output.manual" not in row.neutral or row.kind != "exact":
        return row
    return replace(row, kind="assumed", note="; ".join(filter(None, (row.note, FIRST_OUTPUT))))


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
        held = Loop.model_validate(loop.data)
        link = held.setpoint.model_copy(update={"source": self._names.get(held.setpoint.source, held.setpoint.source)})
        return held.model_copy(update={"setpoint": link})

    def is_master(self, j: int) -> bool:
        """Whether another loop takes its set point from this one, on both sides."""
        return (self.before[j].name, self.after[j].data.get("name")) in self._masters

    @cached_property
    def _names(self) -> dict[object, str]:
        """The names of the source by those of the target."""
        return {after.data.get("name"): before.name for before, after in zip(self.before, self.after, strict=True)}

    @cached_property
    def _masters(self) -> set[tuple[Any, object]]:
        """The loops that loops take their set points from, on both sides."""
        sides = zip(self.before, self.after, strict=True)
        return {(before.setpoint.source, after.data.get("setpoint", {}).get("source")) for before, after in sides}


def _is_default(loop: BaseModel, field: str) -> bool:
    """Whether a neutral field is at its default or harmless: what a loop is like that does not give it."""
    if field == HYSTERESIS and not has_alarms(loop):
        return True
    item: Any = loop
    for key in steps(field):
        if not isinstance(item, BaseModel) or key not in type(item).model_fields:
            return False
        default, item = type(item).model_fields[str(key)].default, getattr(item, str(key))
        if item == default:
            return True
    return is_harmless(field, item)
