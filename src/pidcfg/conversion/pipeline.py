"""A configuration of one vendor to one of another: neutral loops, target, and what the target's registers make of it.

Design. The target's adapter writes exact values. They are held against the manual's limits and encoded; what does not
fit is clamped, and what comes back from the registers otherwise is rounded: the file gets the value that the PLC will
hold, and the report says by how much it differs from what was wanted.
"""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from functools import partial
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel, ValidationError

from pidcfg.conversion.ledger import Change, Missing, Neutral, Stored, Target, changes
from pidcfg.conversion.unmatched import harmless
from pidcfg.schemas.base import Duration, Quantity, decimal_text, plain_number
from pidcfg.schemas.generic import GenericFile
from pidcfg.schemas.limits import Limits
from pidcfg.schemas.rates import Rate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from pidcfg.paths import Path
    from pidcfg.vendors import Vendor

EXACT = 2e-7
"""Relative error that counts as none: what single precision makes of a decimal."""


class ConvertError(Exception):
    """A configuration that cannot be converted as it is; each problem names the key."""

    def __init__(self, missing: list[Missing]) -> None:
        super().__init__("; ".join(entry.message for entry in missing))
        self.missing = missing


@dataclass(frozen=True, slots=True)
class Converted:
    """The target's file as plain data, and the report by loop."""

    data: dict[str, Any]
    loops: tuple[tuple[str, tuple[Change, ...]], ...]

    @property
    def losses(self) -> bool:
        """Whether anything was dropped or clamped."""
        return any(change.kind in {"dropped", "clamped"} for _, found in self.loops for change in found)


def neutral_loops(config: Any, source: Vendor) -> tuple[GenericFile, list[Neutral]]:
    """The neutral file of a configuration; raises `ConvertError` for what it must say before."""
    loops: list[Neutral] = source.load("to_neutral")(config)
    missing = [entry for loop in loops for entry in loop.missing]
    if missing:
        raise ConvertError(missing)
    return generic_file(config, loops), loops


def generic_file(config: Any, loops: Sequence[Neutral]) -> GenericFile:
    """The neutral file of a configuration's loops."""
    data = {"pidcfg": 1, "vendor": "generic", "loops": [loop.loop for loop in loops]}
    data |= {key: getattr(config, key) for key in ("name", "description") if getattr(config, key) is not None}
    return GenericFile.model_validate(data)


def convert(config: Any, source: Vendor, target: Vendor, options: Mapping[str, Any]) -> Converted:
    """The same loops for another vendor; raises `ConvertError`."""
    generic, loops = neutral_loops(config, source)
    made: Target = target.load("from_neutral")(generic, options)
    stored = settled(made, target)
    report = []
    for i, (loop, neutral) in enumerate(zip(generic.loops, loops, strict=True)):
        idle = partial(_idle, loop)
        report.append((loop.name, tuple(changes(neutral.said, made.puts[i], stored[i], idle))))
    return Converted(made.data, tuple(report))


def _idle(loop: Any, field: str) -> bool:
    """Whether a neutral field is at its default or harmless: what a loop is like that does not give it."""
    item = loop
    for key in path_of(field):
        if not isinstance(item, BaseModel) or key not in type(item).model_fields:
            return False
        default, item = type(item).model_fields[str(key)].default, getattr(item, str(key))
        if item == default:
            return True
    return harmless(field, item)


def settled(made: Target, target: Vendor) -> list[dict[str, Stored]]:
    """Puts the values that the target can hold into its data; what became of each field, by loop."""
    places = made.items or [("loops", i) for i in range(len(made.puts))]
    wanted = [
        {
            put.field: at(made.data, route_of(place, put.field)) if put.exact is None else put.exact
            for put in puts
            if put.field
        }
        for place, puts in zip(places, made.puts, strict=True)
    ]
    meant = [{put.field: (put.exact, put.held) for put in puts if put.exact and put.held} for puts in made.puts]
    notes: dict[Path, Stored] = {}
    for _ in range(2):  # a clamped value is encoded again
        encoding = target.encoder(_validated(target, made.data))
        for path, misfit in encoding.misfits:
            low, high = misfit.error.low, misfit.error.high
            value = at(made.data, path)
            number = number_of(value)
            if number is None or low is None or high is None or misfit.error.fault != "range":
                raise ConvertError([Missing(path, str(path[-1]), f"{misfit.word.name} {value}: {misfit.error}")])
            bound = min(max(number, low), high)
            put_at(made.data, path, plain_number(bound))
            notes[path] = Stored(plain_number(bound), "clamped", note=f"{target.title} holds {low} to {high}")
    _within_limits(made, target, places, notes)
    held = _decoded(target, made.data)
    found = []
    for place, fields, means in zip(places, wanted, meant, strict=True):
        row = {}
        for field, value in fields.items():
            path = route_of(place, field)
            row[field] = notes.get(path) or _held(made.data, path, value, held)
            if field in means and path not in notes:
                row[field] = _meant(at(made.data, path), *means[field])
        found.append(row)
    return found


def _validated(target: Vendor, data: dict[str, Any]) -> Any:
    try:
        return target.model.model_validate(data)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        text = (first.get("ctx") or {}).get("text", first["msg"])
        place = tuple(first["loc"])
        raise ConvertError([Missing(place, str(place[-1]), f"{'.'.join(map(str, place))}: {text}")]) from None


def _within_limits(made: Target, target: Vendor, places: list[Path], notes: dict[Path, Stored]) -> None:
    """Brings numbers within what the manual allows."""
    model = _validated(target, made.data)
    for place, puts in zip(places, made.puts, strict=True):
        item = at(model, place)
        for put in puts:
            whole = put.field.startswith("/")
            limits = _limits(model if whole else item, path_of(put.field.lstrip("/"))) if put.field else None
            path = route_of(place, put.field)
            number = number_of(at(model, path)) if limits else None
            if limits is None or number is None or limits.holds(number):
                continue
            low, high = (None if end is None else Decimal(end) for end in (limits.low, limits.high))
            bound = low if low is not None and number < low else high
            if bound is not None:
                put_at(made.data, path, plain_number(bound))
                notes[path] = Stored(plain_number(bound), "clamped", note=f"allowed is {limits.low} to {limits.high}")


def _limits(item: Any, path: Path) -> Limits | None:
    """The limits of a field, found on the way through the models."""
    for i, key in enumerate(path):
        if not isinstance(item, BaseModel) or key not in type(item).model_fields:
            return None
        field = type(item).model_fields[str(key)]
        if i == len(path) - 1:
            return next((m for m in (*field.metadata, *_metadata(field.annotation)) if isinstance(m, Limits)), None)
        item = getattr(item, str(key))
    return None


def _metadata(annotation: Any) -> Iterator[Any]:
    yield from getattr(annotation, "__metadata__", ())
    for inner in getattr(annotation, "__args__", ()):
        yield from _metadata(inner)


def _decoded(target: Vendor, data: dict[str, Any]) -> Any:
    """The configuration that comes back from the target's memory."""
    image = target.encoder(_validated(target, data)).image
    back = target.load("decode")(image.words, image.settings, image.plc)
    return target.model.model_validate(back.data)


def _held(data: dict[str, Any], path: Path, wanted: Any, held: Any) -> Stored:
    """What the memory holds of a field; the file gets it where it differs, unless it is a text such as ``500 ms``."""
    written = at(data, path)
    number, back = number_of(wanted), number_of(at(held, path))
    if number is None or back is None:
        return Stored(written)
    error = abs(back - number) / abs(number) if number else abs(back)
    if error <= Decimal(EXACT):
        return Stored(written)
    if not isinstance(written, str):
        written = plain_number(back)
        put_at(data, path, written)
    return Stored(written, "rounded", float(error * 100))


def _meant(written: Any, wanted: Decimal, held: Decimal) -> Stored:
    """What a field means where its number in the file is of another kind, or shorter than what the memory holds."""
    error = abs(held - wanted) / abs(wanted)
    if error <= Decimal(EXACT):
        return Stored(written)
    return Stored(plain_number(Decimal(f"{held:.4g}")), "rounded", float(error * 100))


# --- paths and numbers -----------------------------------------------------------------------------------------------


def path_of(field: str) -> Path:
    """``setpoint.limits.0`` as keys and indices."""
    return tuple(int(step) if step.isdigit() else step for step in field.split(".")) if field else ()


def route_of(place: Path, field: str) -> Path:
    """Where a field of a loop stands in the file; with ``/`` before it, it is one of the file."""
    return path_of(field[1:]) if field.startswith("/") else (*place, *path_of(field))


def at(data: Any, path: Path) -> Any:
    """What stands at a path of plain data or of models; None where there is nothing."""
    for step in path:
        if isinstance(data, dict):
            data = data.get(step)
        elif isinstance(data, list | tuple) and isinstance(step, int):
            data = data[step] if step < len(data) else None
        else:
            data = getattr(data, str(step), None)
        if data is None:
            return None
    return data


def put_at(data: Any, path: Path, value: Any) -> None:
    """Replaces what stands at a path."""
    parent = at(data, path[:-1])
    parent[path[-1]] = value


def number_of(value: Any) -> Decimal | None:
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


def shown(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, Decimal):
        return plain_number(value)
    if isinstance(value, Quantity | Duration):
        return str(value)
    return [shown(v) for v in value] if isinstance(value, list | tuple) else value


def text_of(value: Any) -> str:
    """A value as people read it."""
    value = shown(value)
    if value is None:
        return "-"
    if isinstance(value, bool):
        return str(value).lower()
    return decimal_text(Decimal(repr(value))) if isinstance(value, int | float) else str(value)
