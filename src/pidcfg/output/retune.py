"""Gains put into a loop of a configuration: what changes in the file, and what the rules find at the loop then."""

from __future__ import annotations

from dataclasses import replace
from decimal import Context, Decimal
from functools import partial
from math import isclose, isinf
from typing import TYPE_CHECKING, Any

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.findings import Chosen, check_loaded, errors_in, finding_data
from pidcfg.schemas.base import DURATION, SECONDS, UNIT_WORDS
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import steps, value_at
from pidcfg.text.signs import closest_name
from pidcfg.text.source import read_document
from pidcfg.tuning.robust import DIGITS, fit_in_other_unit, fit_loop
from pidcfg.tuning.rules import TuningError
from pidcfg.validate.engine import check_document
from pidcfg.validate.fixes import PlacingError, with_values

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pidcfg.encoders.regmap import LoopTuning
    from pidcfg.output.process import GainsFile, Target
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data, Path
    from pidcfg.text.reader import Limits, Reader
    from pidcfg.tuning.robust import Fitted
    from pidcfg.tuning.rules import Gains
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

SAME_SPAN = 1e-9
LAST_DIGIT = 10.0 ** (1 - DIGITS)
"""Relative difference of numbers that are the same to all their digits."""


@frozen
class Value:
    """One of the three numbers in the file: its key, how it was written (None: not at all), and how it is now."""

    key: str
    unit: str
    old: str | None
    new: str | None

    @property
    def changes(self) -> bool:
        """Whether the file says it otherwise now."""
        return self.old != self.new


@frozen
class Written:
    """A configuration with the gains in one of its loops."""

    file: str
    loop: str
    vendor: Vendor
    before: bytes
    data: bytes
    """The file with the gains; the same bytes where it holds them already."""
    values: tuple[Value, ...]
    document: Document
    findings: tuple[Diagnostic, ...]
    """What the rules find at the loop with these gains, and what is new elsewhere."""
    action: str | None
    """The loop's action as it has to be; None: the sign of the process's gain is not known, nobody compared it."""

    @property
    def ok(self) -> bool:
        """Whether the file may be saved: no rule finds an error."""
        return not errors_in(self.findings)

    def to_json(self) -> Data:
        """What changes, and what the rules find."""
        values = [{"key": v.key, "unit": v.unit, "old": v.old, "new": v.new, "changes": v.changes} for v in self.values]
        return {
            "file": self.file,
            "loop": self.loop,
            "ok": self.ok,
            "action_compared": self.action is not None,
            "values": values,
            "findings": [finding_data(d) for d in self.findings],
        }


def retune_loop(
    gains: Gains, target: Target, into: GainsFile, limits: Limits, *, heating: bool | None
) -> tuple[Written, list[Fitted]]:
    """The file with the gains of a rule in a loop, and the three numbers as the loop holds them.

    Raises `ArgumentError` for a loop that is not there and ranges that contradict the file, `TuningError` for a file
    that cannot be read, a loop that the gains are not for, and a number that does not fit.
    """
    doc = read_document(into.data, into.name, limits)
    checked_file = check_document(doc)
    vendor, index = _loop_of(checked_file, into)
    if target.vendor is not None and target.vendor is not vendor:
        raise ArgumentError(f"`vendor` is {target.vendor.key}, and {into.name} is for {vendor.key}", "vendor")
    config: Any = checked_file.config
    name, tuning = config.loops[index].name, encoder_of(vendor).tuning_of(config, config.loops[index])
    where = f"{into.name}: {name}"
    _refuse(where, gains, tuning, heating=heating)
    tuning = _with_ranges(where, tuning, target)
    fitted = fit_loop(gains, vendor.model, tuning)
    problems = [f"{value.key}: {value.problem}" for value in fitted if value.problem is not None]
    if problems:
        other = fit_in_other_unit(gains, vendor.model, tuning, fitted[1])
        if other is not None:
            unit, held = "minutes" if other.unit == "min" else "seconds", decimal_text(other.stored or other.wanted)
            problems.append(f"with `reset_unit: {unit}` it is {held} {other.unit}")
        raise TuningError(f"{where}: {'; '.join(problems)}; nothing was written")
    values = _values(where, doc, index, gains, tuning, fitted)
    data = _write_values(where, doc, into.data, index, values)
    after = read_document(data, into.name, limits)
    findings = _findings(doc, after, name, into.reader)
    action = None if heating is None else tuning.words.heating if heating else tuning.words.cooling
    return Written(into.name, name, vendor, into.data, data, values, after, findings, action), fitted


def loop_tuning(target: Target, into: GainsFile, limits: Limits) -> tuple[Vendor, LoopTuning]:
    """The vendor of a file, and how its loop holds its gains; raises as `retune_loop` does."""
    checked_file = check_document(read_document(into.data, into.name, limits))
    vendor, index = _loop_of(checked_file, into)
    config: Any = checked_file.config
    loop = config.loops[index]
    return vendor, _with_ranges(f"{into.name}: {loop.name}", encoder_of(vendor).tuning_of(config, loop), target)


def _loop_of(found: Checked, into: GainsFile) -> tuple[Vendor, int]:
    """The vendor of a file, and the place of the loop."""
    vendor, config = found.vendor, found.config
    if vendor is None or config is None:
        (first, *more) = [d for d in found.findings if d.severity is Severity.ERROR]
        rest = f", and {len(more)} more" if more else ""
        place = f"{into.name}:{first.span.line}:{first.span.column}"
        raise TuningError(f"{place}: {first.message} ({first.code}{rest}); correct the file first, nothing was written")
    names = [loop.name for loop in config.loops]
    if not names:
        raise TuningError(f"{into.name} has no loop; nothing was written")
    listed = ", ".join(names)
    if into.loop is None:
        if len(names) > 1:
            raise ArgumentError(f"{into.name} has several loops, say which with `loop`: {listed}", "loop")
        return vendor, 0
    if names.count(into.loop) != 1:
        near = closest_name(into.loop, names)
        meant = f"; did you mean {near}?" if near and near != into.loop else ""
        raise ArgumentError(f"`loop` {into.loop!r}: {into.name} has {listed}{meant}", "loop")
    return vendor, names.index(into.loop)


def _refuse(where: str, gains: Gains, tuning: LoopTuning, *, heating: bool | None) -> None:
    """Raises `TuningError` for a loop that would not act as the rule means."""
    wrong = tuning.wrong or (tuning.no_derivative if gains.derivative_time else "")
    if wrong:
        raise TuningError(f"{where}: {wrong}, which the gains are not for; nothing was written")
    if heating is None or tuning.raises_pv is None or heating is tuning.raises_pv:
        return
    action = tuning.words.heating if heating else tuning.words.cooling
    way = "positive: the PV rises" if heating else "negative: the PV falls"
    raise TuningError(
        f"{where}: the process's gain is {way} with the output, which needs action {action}, and the loop has the "
        "other one; correct the action, or the sign of the gain; nothing was written"
    )


def _with_ranges(where: str, tuning: LoopTuning, target: Target) -> LoopTuning:
    """With the spans that are given, where the file does not say them."""
    for name, given in (("pv_range", target.pv_range), ("output_range", target.output_range)):
        span = None if given is None else Decimal(str(given[1])) - Decimal(str(given[0]))
        field = name.replace("range", "span")
        present: Decimal | None = getattr(tuning, field)
        if span is None or tuning.words.gain_unit == "engineering":
            continue
        if present is not None and not isclose(present, span, rel_tol=SAME_SPAN):
            wide = f"{decimal_text(span)} wide, and that of {where} {decimal_text(present)}"
            raise ArgumentError(f"`{name}` is {wide}: leave it out", name)
        tuning = replace(tuning, **{field: span})  # type: ignore[arg-type]  # one of the two spans
    if tuning.words.gain_unit == "span" and tuning.pv_span is None:
        message = f"{where} has no pv.range, and its gain is a share of it: add it to the loop, or give `pv_range`"
        raise ArgumentError(message, "pv_range")
    return tuning


def _values(
    where: str, doc: Document, index: int, gains: Gains, tuning: LoopTuning, fitted: list[Fitted]
) -> tuple[Value, ...]:
    """How the file says the three numbers, before and after; what it says already stays as it is written."""
    out = []
    integral, derivative = tuning.off
    off = (None, integral if isinf(gains.integral_time) else None, None if gains.derivative_time else derivative)
    for name, value, now, word in zip(tuning.words.names, fitted, tuning.now, off, strict=True):
        old = value_at(doc.data, _path(index, value.key))
        if now is None:
            raise TuningError(f"{where}: {value.key} is the expression {old}: change it there; nothing was written")
        stored = value.stored or Decimal(0)
        held = partial(tuning.words.stored, name)
        new = old if now == stored else word or number_as_written(old, stored, value.unit, held)
        out.append(Value(value.key, value.unit, old, None if new is None else str(new)))
    return tuple(out)


def number_as_written(old: str | None, value: Decimal, unit: str, stored: Callable[[Decimal], Decimal]) -> str:
    """A number as the file writes it: in the unit that stood there, with the fewest digits that make the same word."""
    match = DURATION.fullmatch(old or "")
    if match is None or unit not in SECONDS:
        return decimal_text(value)
    factor = SECONDS[UNIT_WORDS.get(match[2], match[2])] / SECONDS[unit]
    gap = " " if " " in match[0] else ""
    for digits in range(1, DIGITS + 1):
        number = Context(digits).divide(value, factor)
        try:
            held = stored(number * factor)
        except EncodeError:
            continue
        if isclose(held, value, rel_tol=LAST_DIGIT):
            return f"{decimal_text(number)}{gap}{match[2]}"
    return decimal_text(value)


def _path(index: int, key: str) -> Path:
    return ("loops", index, *steps(key))


def _write_values(where: str, doc: Document, data: bytes, index: int, values: tuple[Value, ...]) -> bytes:
    """The bytes of the file with the values that change."""
    paths = [_path(index, value.key) for value in values]
    texts = {path: value.new for path, value in zip(paths, values, strict=True) if value.changes and value.new}
    after: Mapping[Path, Path] = dict(zip(paths[1:], paths, strict=False))
    if not texts:
        return data
    try:
        return with_values(data, doc, texts, _behind_present(doc, after))
    except PlacingError as error:
        numbers = ", ".join(f"{value.key}: {value.new}" for value in values if value.changes)
        raise TuningError(
            f"{where}: {error} (line {error.line}); write {numbers} by hand, there or in the loop itself"
        ) from None


def _behind_present(doc: Document, after: Mapping[Path, Path]) -> dict[Path, Path]:
    """The key that each goes behind, past those that are missing and stay so."""
    out = {}
    for path, before in after.items():
        while value_at(doc.data, before) is None and before in after:
            before = after[before]  # noqa: PLW2901 - up to one that is there
        out[path] = before
    return out


def _findings(before: Document, after: Document, loop: str, reader: Reader) -> tuple[Diagnostic, ...]:
    """What is found at the loop after the change, and what is new elsewhere."""
    old = {(d.code, d.where, d.message) for d in check_loaded(before, reader, Chosen()).findings}
    found = check_loaded(after, reader, Chosen()).findings
    return tuple(d for d in found if d.loop == loop or loop in d.with_loops or (d.code, d.where, d.message) not in old)
