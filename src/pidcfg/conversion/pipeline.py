"""A configuration of one vendor to one of another: neutral loops, target, what its registers hold, and the report.

A loop that cannot go, because it says too little or the target cannot hold it at all, does not stop the others: it is
left out, with its reasons, and the rest is converted without it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import BaseModel

from pidcfg.conversion.ledger import Change, ConvertError, Missing, NeutralLoop, TargetFile, changes
from pidcfg.conversion.losses import DEFAULT, judged
from pidcfg.conversion.operation.rules import differing_rules
from pidcfg.conversion.own_places import keep, own_places, own_scales, with_kept
from pidcfg.conversion.readback import held_lines
from pidcfg.conversion.remainder import beside, of_loop, remaining
from pidcfg.conversion.settle import settled, validated
from pidcfg.conversion.unmatched import harmless
from pidcfg.paths import steps
from pidcfg.schemas.generic import GenericFile, Loop

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.conversion.ledger import Stored
    from pidcfg.conversion.losses import MaxLoss
    from pidcfg.conversion.operation.rules import Operation
    from pidcfg.encoders.image import Encoding
    from pidcfg.vendors import Vendor

__all__ = ["ConvertError", "Converted", "LoopReport", "convert", "generic_file", "neutral_loops"]


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
    data: dict[str, Any]
    loops: tuple[LoopReport, ...]
    config: Any
    """The file as the vendor's model."""
    missing: tuple[Missing, ...] = ()
    """What the loops that were dropped lack, by their places in the source."""

    @property
    def losses(self) -> bool:
        """Whether anything was lost: a loop, or a line of one."""
        return any(loop.status == "dropped" or any(row.loss for row in loop.changes) for loop in self.loops)

    @property
    def kept(self) -> tuple[int, ...]:
        """The places in the source of the loops that went over."""
        return tuple(i for i, loop in enumerate(self.loops) if loop.status == "converted")

    @cached_property
    def encoding(self) -> Encoding:
        """The registers or parameters that the model becomes."""
        encoding: Encoding = self.vendor.encoder(self.config)
        return encoding


def neutral_loops(config: Any, source: Vendor) -> tuple[GenericFile, list[NeutralLoop]]:
    """The neutral file of a configuration; raises `ConvertError` for what it must say before."""
    loops: list[NeutralLoop] = source.load("to_neutral")(config)
    missing = [entry for loop in loops for entry in loop.missing]
    if missing:
        raise ConvertError(missing)
    return generic_file(config, loops), loops


def generic_file(config: Any, loops: Sequence[NeutralLoop]) -> GenericFile:
    """The neutral file of a configuration's loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [loop.data for loop in loops]}
    data |= {key: getattr(config, key) for key in ("name", "description") if getattr(config, key) is not None}
    return GenericFile.model_validate(data)


def convert(
    config: Any,
    source: Vendor,
    target: Vendor,
    options: Mapping[str, Any],
    *,
    max_loss: MaxLoss = DEFAULT,
    left_out: Mapping[int, str] | None = None,
) -> Converted:
    """The same loops for another vendor, with what became of every field.

    ``options``: where things go that the source does not say, by the keys of the target's `CONVERT_OPTIONS`.
    ``left_out``: loops that are not converted, by their places, each with the reason. Raises `ConvertError` where no
    loop can be converted, and for what the target cannot hold at all.
    """
    loops: list[NeutralLoop] = source.load("to_neutral")(config)
    if not loops:
        raise ConvertError([Missing(("loops",), "there is no loop to convert: add one")])
    dropped = {i: [Missing(("loops", i), reason)] for i, reason in (left_out or {}).items()}
    dropped |= {i: loop.missing for i, loop in enumerate(loops) if loop.missing}
    while True:
        kept = [i for i in range(len(loops)) if i not in dropped]
        missing = tuple(entry for i in sorted(dropped) for entry in dropped[i])
        if not kept:
            raise ConvertError(list(missing))
        try:
            outcome = _Conversion(config, source, target, [loops[i] for i in kept], kept)
            return outcome.result(_for_loops(options, kept, len(loops)), max_loss, missing)
        except ConvertError as error:
            dropped |= _of_loops(error, kept)


def _for_loops(options: Mapping[str, Any], kept: Sequence[int], count: int) -> dict[str, Any]:
    """Options without what they say of loops that are left out; one value alone is where all begin."""
    return {
        key: [item for i, item in enumerate(value) if i in kept or i >= count]
        if isinstance(value, list) and len(value) > 1
        else value
        for key, value in options.items()
    }


def _of_loops(error: ConvertError, kept: Sequence[int]) -> dict[int, list[Missing]]:
    """The problems of an error by loop of the source; raises it again where one is not about a loop."""
    problems: dict[int, list[Missing]] = {}
    for entry in error.missing:
        top, *below = entry.path
        if top != "loops" or not below or not isinstance(below[0], int):
            raise error
        place = kept[below[0]]
        problems.setdefault(place, []).append(Missing(("loops", place, *below[1:]), entry.message))
    return problems


@dataclass(slots=True)
class _Conversion:
    """Loops on their way from one vendor to another."""

    config: Any
    source: Vendor
    target: Vendor
    loops: list[NeutralLoop]
    kept: list[int]
    """Their places in the source."""

    def result(self, options: Mapping[str, Any], max_loss: MaxLoss, missing: tuple[Missing, ...]) -> Converted:
        """The target's file, and the report."""
        generic = generic_file(self.config, self.loops)
        habits: list[Operation] = self.source.load("operation")(self.config)
        before = [habits[i] for i in self.kept]
        is_own = self.source is self.target
        own = own_places(self.config, self.source, self.kept, options) if is_own else {}
        scaled = own_scales(self.config, self.source, self.kept, options) if is_own else options
        file: TargetFile = self.target.load("from_neutral")(generic, scaled, before)
        keep(file.data, own)
        stored = settled(file, self.target)
        model = validated(self.target, file.data) if file.model is None else file.model
        sides = Sides(
            generic.loops, before, self.target.load("to_neutral")(model), self.target.load("operation")(model)
        )
        reports = {i: self._rows(j, file, stored[j], sides, own) for j, i in enumerate(self.kept)}
        told = [row for rows in reports.values() for row in rows]
        reports[self.kept[0]] += beside(self.config, told, self._reasons())
        whys = {entry.path[1]: entry.message for entry in reversed(missing)}
        report = tuple(
            LoopReport(loop.name, tuple(judged(row, max_loss) for row in reports[i]))
            if i in reports
            else LoopReport(loop.name, (), "dropped", whys[i])
            for i, loop in enumerate(self.config.loops)
        )
        return Converted(self.target, file.data, report, model, missing)

    def _reasons(self) -> dict[str, str]:
        """Why nothing is lost of what stands beside the loops."""
        return {path: reason for loop in self.loops for path, reason in loop.beside.items()}

    def _rows(
        self, j: int, file: TargetFile, stored: Mapping[str, Stored], sides: Sides, kept: Mapping[int, Sequence[Change]]
    ) -> list[Change]:
        """The lines of one of the loops; ``kept``: of what all keep within their vendor."""
        loop = sides.before[j]
        rows = list(changes(self.loops[j].fields, file.fields[j], stored, partial(_is_default, loop)))
        own = kept.get(j, ())
        rows = list(with_kept(rows, own, {row.field for row in kept.get(0, ()) if row.field.startswith("/")}))
        rows = [*held_lines(rows, loop, after)] if (after := sides.held(j)) is not None else rows
        lines = list(differing_rules(sides.habits[j], sides.new_habits[j], loop, is_master=sides.is_master(j)))
        about = {name for line in lines if line.loss for name in line.neutral}
        rows = [_named(row) if about.intersection(row.neutral) else row for row in rows] + lines
        given = of_loop(self.config, self.kept[j], with_plc=j == 0)
        told = [*rows, *(replace(row, field=row.field.removeprefix("/")) for row in own)]
        return [*rows, *remaining(given, told, self.source.load("nothing_lost"), file.data["loops"][j])]


def _named(row: Change) -> Change:
    """A line about a field that acts otherwise in the target, which another line tells."""
    return replace(row, kind="assumed") if row.kind == "exact" else row


class Sides(NamedTuple):
    """The neutral loops of both sides, and what their PLCs do with them."""

    before: Sequence[Loop]
    habits: Sequence[Operation]
    after: Sequence[NeutralLoop]
    new_habits: Sequence[Operation]

    def held(self, j: int) -> Loop | None:
        """A loop as the target has it, linked by the names of the source; None where it cannot be told."""
        loop = self.after[j]
        if loop.missing:
            return None
        held = Loop.model_validate(loop.data)
        names = {after.data.get("name"): before.name for before, after in zip(self.before, self.after, strict=True)}
        link = held.setpoint.model_copy(update={"source": names.get(held.setpoint.source, held.setpoint.source)})
        return held.model_copy(update={"setpoint": link})

    def is_master(self, j: int) -> bool:
        """Whether another loop takes its set point from this one, on both sides."""
        return any(
            loop.setpoint.source == self.before[j].name
            and after.data.get("setpoint", {}).get("source") == self.after[j].data.get("name")
            for loop, after in zip(self.before, self.after, strict=True)
        )


def _is_default(loop: BaseModel, field: str) -> bool:
    """Whether a neutral field is at its default or harmless: what a loop is like that does not give it."""
    item: Any = loop
    for key in steps(field):
        if not isinstance(item, BaseModel) or key not in type(item).model_fields:
            return False
        default, item = type(item).model_fields[str(key)].default, getattr(item, str(key))
        if item == default:
            return True
    return harmless(field, item)
