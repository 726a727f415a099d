"""The rules: those for every vendor, and how a vendor's list is made of its modules, one a topic.

Rules for every vendor look at limits of the schema, at what registers cannot hold, and at names.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from decimal import Decimal
from functools import cache
from types import ModuleType, SimpleNamespace
from typing import Any, TypeAlias, get_args

from pydantic import BaseModel

from pidcfg.encoders.codecs import Position
from pidcfg.encoders.image import Encoding
from pidcfg.encoders.regmap import Misfit, Rounded
from pidcfg.schemas.base import SIDES, Limits, Quantity, Rate, unit_text, units_of
from pidcfg.schemas.numbers import EXACT_CONTEXT, MAX_DIGITS, decimal_text
from pidcfg.text.diagnostics import number_of
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import Path, value_at
from pidcfg.text.references import Decision
from pidcfg.validate.rule import D930, Finding, Findings, Rule, checklist, error, make_finding, never_ignorable, warning
from pidcfg.validate.shared_checks import Context, action_of, list_names, number_text, purpose_of
from pidcfg.vendors import VENDORS

D06 = Decision(
    6,
    "a value that rounds onto an off code is an error",
    "A gain of 0.004 and a reset of 0.04 would be stored as "
    "0000: the term would be switched off, or act as if the gain were 1.",
    "The loop would run with other control than the file says; no rounding error may do that.",
)
D07 = Decision(
    7,
    "nearest value, ties to even",
    "What a register cannot hold exactly is stored as the nearest value, ties to even, computed on exact decimals.",
    "It is the rounding of IEEE 754 and of Python, and the same on every system.",
)
D08 = Decision(
    8,
    "names are unique",
    "Two loops of a file may not have one name.",
    "Cascade links, scenarios and reports refer to loops by name.",
)
D1017 = Decision(
    1017,
    "pulses of one period are a line of the checklist",
    "Outputs of pulses with one period are told: they may switch on together. In NextoPID they begin with the "
    "first cycle (D241, D242); of the others the manuals say nothing.",
    "A public plan of four SSRs gives each a quarter of the period of 1 s, so that not all are switched at once "
    "(industrialmonitordirect.com, automationdirect-plc-for-pid-ssr-pwm-control-selection).",
)
D09 = Decision(
    9,
    "limits come from the manual",
    "Each parameter's limits are the manual's own; the message names the place.",
    "Values outside them have no documented effect.",
)
D945 = Decision(
    945,
    "words of heating and cooling tell the action that is meant",
    "An action that does not fit a word of heating or cooling in the loop's name or description is a warning that "
    "names both, for every vendor, in English and German. Words of both kinds, of an exhaust, or of an actuator that "
    "works the other way round are none, nor is a PV whose unit, or without one whose name, is not of a temperature. "
    "A drafted scenario takes the sign of its plant from the word; without a word from the action, and says so. It "
    "stands in the place of D183 (EZLogix) and D261 (DPIDE).",
    "DL06 and CLICK name the process's action, EZLogix and NextoPID the controller's, and manuals do not agree on "
    "forward: swapping it is the likeliest mistake, and a heater that runs away its result.",
)

ROUNDING_WARNING = Decimal("0.01")
MIN_SHOWN_PERCENT = Decimal("0.1")
AnyContext: TypeAlias = "Context[Any, Encoding]"


@cache
def fields_with_limits(model: type[BaseModel]) -> tuple[tuple[tuple[str, Limits], ...], tuple[str, ...]]:
    """What there is to look at in a model: its fields with limits, and its fields that hold further models."""
    limited_fields, nested_fields = [], []
    for name, field in model.model_fields.items():
        limits = next((m for m in (*field.metadata, *_metadata(field.annotation)) if isinstance(m, Limits)), None)
        if limits is not None:
            limited_fields.append((name, limits))
        elif any(isinstance(t, type) and issubclass(t, BaseModel) for t in _types(field.annotation)):
            nested_fields.append(name)
    return tuple(limited_fields), tuple(nested_fields)


def _metadata(annotation: object) -> Iterator[object]:
    yield from getattr(annotation, "__metadata__", ())
    for inner in get_args(annotation):
        yield from _metadata(inner)


def _types(annotation: object) -> Iterator[object]:
    yield annotation
    for inner in get_args(annotation):
        yield from _types(inner)


def find_outliers(model: BaseModel, path: Path) -> Iterator[tuple[Path, Decimal, Limits]]:
    """Every number of a model that lies outside the limits of its field."""
    limited_fields, nested_fields = fields_with_limits(type(model))
    for name, limits in limited_fields:
        value = getattr(model, name)
        if isinstance(value, Decimal | int) and not limits.holds(Decimal(value)):
            yield (*path, name), Decimal(value), limits
    for name in nested_fields:
        value = getattr(model, name)
        if isinstance(value, tuple):
            for i, inner in enumerate(value):
                yield from find_outliers(inner, (*path, name, i))
        elif value is not None:
            yield from find_outliers(value, (*path, name))


def _numbers_outside_limits(context: AnyContext) -> Iterator[tuple[Path, Decimal, Limits]]:
    """Every number outside the limits of its field, as the register holds it."""
    outside = list(find_outliers(context.config, ()))
    rounded_by_path = dict(context.encoding.rounded) if outside else {}
    for path, value, limits in outside:
        rounded = rounded_by_path.get(path)
        if rounded is None or rounded.value != value or not limits.holds(rounded.stored):
            yield path, value, limits


def _range_text(low: Decimal | str | None, high: Decimal | str | None, unit: str) -> str:
    texts = [number_text(Decimal(end)) if end is not None else None for end in (low, high)]
    suffix = f" {unit}" if unit else ""
    if texts[0] is None or texts[1] is None:
        return f"at least {texts[0]}{suffix}" if texts[1] is None else f"at most {texts[1]}{suffix}"
    if texts[0] == texts[1]:
        return f"{texts[0]}{suffix}"
    return f"{texts[0]} to {texts[1]}{suffix}"


@error("PID101", D09, "{key} is {value}{unit}; allowed is {allowed}")
def value_out_of_range(context: AnyContext) -> Findings:
    """A number lies outside the limits that the manual gives its parameter.

    Why: the PLC rejects it, or does something that the manual does not say.

    Fix: choose a value inside the limits.
    """
    for path, value, limits in _numbers_outside_limits(context):
        if path in context.explained_paths:
            continue
        unit = f" {limits.unit}" if limits.unit else ""
        allowed = _range_text(limits.low, limits.high, limits.unit)
        values = {"key": path[-1], "value": _short_text(value), "unit": unit, "allowed": allowed}
        yield Finding(path, values, basis=limits.basis, plc_effect=limits.effect)


def _misfits(context: AnyContext, fault: str) -> Iterator[tuple[Path, Misfit]]:
    """What a register cannot hold for one reason, unless it already breaks the manual's own limits or has a rule."""
    misfits = [(path, misfit) for path, misfit in context.encoding.misfits if misfit.error.fault == fault]
    paths = (
        {*context.explained_paths, *(path for path, _, _ in find_outliers(context.config, ()))} if misfits else set()
    )
    yield from ((path, misfit) for path, misfit in misfits if all(place[: len(path)] != path for place in paths))


def unit_of(context: AnyContext, path: Path, found: Misfit | Rounded) -> str:
    """The unit of a register in the loop's own words, with a blank before it; empty where the loop does not say it."""
    unit, units = found.word.unit, units_of(value_at(context.config, path[:2]))
    if not unit or "counts" in str(found.value) or any(side in unit and side not in units for side in SIDES):
        return ""
    return f" {unit_text(unit, units)}"


@error("PID102", D09, "{field} is {value}{unit}, but its word holds {allowed}")
def value_exceeds_word(context: AnyContext) -> Findings:
    """A value does not fit the register that holds it.

    Why: the register has no digits or bits for it, so the loop would run with another value.

    Fix: write a value that the word holds, or change what it is scaled with: the range, a DL06's data format or an
    EZLogix's counts.
    """
    for path, misfit in _misfits(context, "range"):
        low, high = misfit.error.low, misfit.error.high
        unit, value = unit_of(context, path, misfit), _short_text(misfit.value)
        allowed = str(misfit.error) if high is None else _range_text(low, high, unit.strip())
        if value in allowed.split():  # alike in six digits
            value, *ends = (f"{Decimal(str(number)):.9g}" for number in (misfit.value, low, high))
            allowed = f"{' to '.join(ends)}{unit}"
        values = {"field": misfit.word.name, "value": value, "unit": unit, "allowed": allowed}
        yield Finding(path, values, fix=_scale_cure(context, path, misfit))


SCALE_KEYS = {
    "range": "",
    "format": "",
    "counts": ", what the register of the PV holds at both ends: at most [0, 65535]",
}
"""What values of a side of a loop may be scaled with, and what a cure says of it."""


def _scale_cure(context: AnyContext, path: Path, misfit: Misfit) -> str:
    """The cure, with the keys of the loop that the value is scaled with."""
    cure, scale = "write a value that the word holds", getattr(misfit.word, "scale", None)
    side = "pv" if scale == "sp" else str(scale)
    part = getattr(value_at(context.config, path[:2]), side, None)
    if not isinstance(part, BaseModel):
        return cure
    has_range = getattr(part, "range", None) is not None
    if scale == "sp" and getattr(part, "square_root", False) and _looks_unrooted(misfit, has_range=has_range):
        return _root_cure(misfit.value, has_range=has_range)
    useless = set() if has_range else {"range"} | ({"counts"} if _is_too_low(misfit) else set())
    keys = [key for key in SCALE_KEYS if key in type(part).model_fields and key not in useless]
    changes = " or ".join(f"`{side}.{key}`{SCALE_KEYS[key]}" for key in keys)
    return f"{cure}, or set {changes}" if changes else cure


def _is_too_low(misfit: Misfit) -> bool:
    """Whether a number is less than its register holds."""
    low, value = misfit.error.low, getattr(misfit.value, "value", misfit.value)
    return low is not None and isinstance(value, Decimal) and value < low


def _looks_unrooted(misfit: Misfit, *, has_range: bool) -> bool:
    """Whether raw counts of the PV seem to stand where the root of them is compared."""
    is_place = isinstance(getattr(misfit.word, "codec", None), Position)
    return is_place and not _is_too_low(misfit) and (misfit.value.counts or not has_range)


def _root_cure(number: Quantity, *, has_range: bool) -> str:
    """The cure of a raw set point that is no root."""
    root = number_text(number.value.sqrt(EXACT_CONTEXT).quantize(Decimal(1)))
    scaled = "write it in the unit of `pv.range`" if has_range else "give `pv.range`, which converts values"
    return f"the set point is compared with the root of the PV: write {root} for a PV of {number}, or {scaled}"


@error("PID103", D06, "{field} is {value}{unit}, which {effect}")
def rounds_onto_off_code(context: AnyContext) -> Findings:
    """A value is so small or large that its register would hold the code for "off".

    Why: the term would be switched off, or with a gain of 0 the integral would act at gain 1: not what was written.

    Fix: choose a value that the register can hold, or write the off value on purpose.
    """
    for path, misfit in _misfits(context, "off"):
        unit = unit_of(context, path, misfit)
        yield make_finding(
            *path, field=misfit.word.name, value=_short_text(misfit.value), unit=unit, effect=str(misfit.error)
        )


FRACTION_FIXES = {
    "INT": "round it, or take the block whose parameters are REAL",
    "TIME": "write whole milliseconds",
}
"""What to do about decimals in a variable of the program, which has no range that would make counts of it."""


@error("PID104", D07, "{field} is {value}, but raw counts are whole numbers")
def fractional_counts(context: AnyContext) -> Findings:
    """A raw value is not a whole number of counts.

    Why: a register holds whole counts only, and a raw value is meant exactly.

    Fix: round it. Where a loop may have a range (`pv.range`, `output.range`), values are in engineering units with it.
    """
    for path, misfit in _misfits(context, "form"):
        kind = getattr(misfit.word, "type", None)
        fix = FRACTION_FIXES.get(getattr(kind, "name", ""))
        yield Finding(path, {"field": misfit.word.name, "value": _short_text(misfit.value)}, fix=fix)


@warning("PID105", D07, "{field} {value}{unit} is stored as {stored}{unit}, {percent} % off")
def rounded_value(context: AnyContext) -> Findings:
    """A value is stored more than 1 % off, or comes into its limits only so, because its register has too few digits.

    Why: the loop runs with the stored value, not with the one in the file.

    Fix: write the stored value if it will do; otherwise change the unit or the sample rate so that more digits count.
    """
    written_outside = {path for path, _, _ in find_outliers(context.config, ())} if context.encoding.rounded else set()
    stored_outside = {path for path, _, _ in _numbers_outside_limits(context)} if written_outside else set()
    moved_inside = written_outside - stored_outside
    for path, rounded in context.encoding.rounded:
        tolerance = getattr(rounded.word.codec, "tolerance", ROUNDING_WARNING)
        far = abs(rounded.stored - rounded.value) > tolerance * abs(rounded.value)
        if rounded.value and path not in stored_outside and (far or path in moved_inside):
            percent = abs(rounded.stored / rounded.value - 1) * 100
            percent_text = f"{percent:.1f}" if percent >= MIN_SHOWN_PERCENT else f"less than {MIN_SHOWN_PERCENT}"
            unit = unit_of(context, path, rounded)
            yield make_finding(
                *path,
                field=rounded.word.name,
                value=_short_text(rounded.value),
                unit=unit,
                stored=decimal_text(rounded.stored),
                percent=percent_text,
            )


def _bare_numbers(model: BaseModel, path: Path) -> Iterator[tuple[Path, Quantity | Rate]]:
    """Every number on a scale that a model was given without ``counts``."""
    for name in sorted(model.model_fields_set):
        value = getattr(model, name)
        if isinstance(value, Quantity | Rate):
            if not value.counts:
                yield (*path, name), value
            continue
        for step, inner in enumerate(value) if isinstance(value, tuple) else [(None, value)]:
            place = (*path, name) if step is None else (*path, name, step)
            if isinstance(inner, Quantity) and not inner.counts:
                yield place, inner
            elif isinstance(inner, BaseModel):
                yield from _bare_numbers(inner, place)


@warning("PID109", D930, "{key}: {value} is taken as {counts}, not {unit}: {side} has a unit and no range")
def bare_number_under_a_unit(context: AnyContext) -> Findings:
    """A number is counts, since its side of the loop has a unit and no range.

    Why: whoever reads the unit reads the number in it: 85 under °C is 85 counts, which is 4.2 °C of a range of 200.

    Fix: give the range of that side, what 0 % and 100 % of the signal stand for, or write `870 counts`.
    """
    vendor = VENDORS[context.config.vendor]
    for i, loop in enumerate(context.config.loops):
        units = units_of(loop)
        if any(value_at(loop, (side, "range")) is None for side in SIDES if side in units):
            from pidcfg.validate.terms import side_without_range

            for path, number in _bare_numbers(loop, ()):
                side = side_without_range(vendor, loop, path)
                if side in units:
                    key = next(step for step in reversed(path) if isinstance(step, str))
                    counts = number._replace(counts=True)
                    values = {"key": key, "value": number, "counts": counts, "unit": units[side], "side": side}
                    yield Finding(("loops", i, *path), values)


@never_ignorable
@error("PID106", D08, "the name {name} is used by {count} loops")
def duplicate_loop_name(context: AnyContext) -> Findings:
    """Two loops have the same name.

    Why: cascade links, scenarios and reports could mean either, and so could a baseline. No comment, setting or
    baseline covers it.

    Fix: rename one of them.
    """
    counts = Counter(loop.name for loop in context.config.loops)
    for i, loop in enumerate(context.config.loops):
        if counts[loop.name] > 1:
            yield make_finding("loops", i, "name", name=loop.name, count=counts[loop.name])


@error("PID107", D09, "the list of loops is empty: there is nothing to calculate")
def no_loops(context: AnyContext) -> Findings:
    """A configuration without a single loop.

    Why: the PLC's loop task would be turned off, and nothing controlled.

    Fix: add a loop under loops, beginning with '- name:', or leave the file out.
    """
    if not context.config.loops:
        yield make_finding("loops", key=True)


@warning("PID108", D08, "the name {name} differs from {other} in capitals only")
def same_name_but_for_capitals(context: AnyContext) -> Findings:
    """Two loops have names that differ in capitals alone.

    Why: a list, a screen or a program that does not tell capitals apart takes one for the other, and so does a reader.

    Fix: rename one of them.
    """
    groups: dict[str, list[tuple[int, str]]] = {}
    for i, loop in enumerate(context.config.loops):
        groups.setdefault(loop.name.casefold(), []).append((i, loop.name))
    for loops in groups.values():
        for i, name in loops:
            others = tuple(dict.fromkeys(other for _, other in loops if other != name))
            if others and ("loops", i, "name") not in context.explained_paths:
                yield make_finding("loops", i, "name", name=name, other=list_names(others)).with_other_loops(*others)


@warning(
    "PID110",
    D945,
    "{here} is for a PV that {way} when the output rises, but the {place} says {word!r} ({purpose}), which needs "
    "{other}",
)
def action_against_words(context: AnyContext) -> Findings:
    """The action is the other one than the loop's name or description suggests.

    Why: the output would drive the PV away from the set point: a heater is switched on the further, the hotter it gets.
    DL06 and CLICK name the process's action, EZLogix and NextoPID the controller's, which is the opposite word, and
    manuals do not agree which is forward.

    Fix: change the action. If it is right because the actuator works the other way round, say so in the description:
    "air to close", "normally open", "fail open", "inverted".
    """
    vendor = VENDORS[context.config.vendor]
    for i, loop in enumerate(context.config.loops):
        purpose, action = purpose_of(loop), action_of(vendor, loop)
        path = None if action is None else ("loops", i, action.key)
        if purpose is None or action is None or action.raises_pv is purpose.heats or path in context.explained_paths:
            continue
        way = "rises" if action.raises_pv else "falls"
        yield make_finding(
            "loops",
            i,
            action.key,
            here=action.own_text,
            way=way,
            place=purpose.key,
            word=purpose.word,
            purpose=purpose.text,
            other=action.opposite_text,
        )


PULSE_PERIODS = {
    "click": ("loops", "output.pwm.period", "s"),
    "ezlogix": ("loops", "output.pulse.cycle_time", "s"),
    "nextopid": ("blocks", "Period", "cycles"),
    "dpide": ("loops", "call.GPWM.cycle", "ms"),
}
"""Where a vendor has the period of its pulses: the list in the file, the key of an item, the unit."""


@checklist("PID113", D1017, "{count} outputs make pulses of {period} {unit}: they may switch on together")
def pulses_of_one_period(context: AnyContext) -> Findings:
    """Several outputs make pulses of the same period.

    Why: pulses come first in a period. Outputs that begin their periods together switch all heaters on at once: the
    supply, its fuse and its neutral carry the sum, however little each of them gets.

    Fix: begin the periods apart, of four outputs by a quarter of the period; where the program cannot, size the supply
    for all outputs at once, or take periods that differ.
    """
    if context.config.vendor not in PULSE_PERIODS:
        return
    items, key, unit = PULSE_PERIODS[context.config.vendor]
    path = key.split(".")
    periods = [value_at(i, path) if hasattr(i, path[0]) else None for i in getattr(context.config, items)]
    counts = Counter(periods)
    for i, period in enumerate(periods):
        if period is not None and counts[period] > 1:
            yield make_finding(items, i, *path, count=counts[period], period=_short_text(period), unit=unit)


def _short_text(value: object) -> str:
    """A value as a message quotes it: one of very many digits to six of them."""
    text = decimal_text(value) if isinstance(value, Decimal) else str(value)
    number = getattr(value, "value", value)
    if len(text) <= MAX_DIGITS or not isinstance(number, Decimal):
        return text
    return text.replace(
        decimal_text(number) if isinstance(value, Decimal) else str(number), f"{number.normalize():.6g}"
    )


# --- Gains and output limits that look as if they were meant for another scale ----------------------------------------

Ends = tuple[Decimal, Decimal]

D953 = Decision(
    953,
    "a gain that acts like a switch",
    "A gain by which an error of 1.25 % of the PV's range or less drives the output through its whole range is a "
    "warning. CLICK has a rule of its own at 1 % of the process range (D134).",
    "The words of a DL06 and an EZLogix end at 99.99, so that no gain of theirs reaches 1 %; who types 9999 means an "
    "end of the word, not a proportional band of 1 %.",
)
D954 = Decision(
    954,
    "output limits that equal the PV's range",
    "Limits of the output that are the two numbers of the PV's range, on another scale of which they leave less than "
    "half, are a warning.",
    "A public problem: a CLICK with a PV of 0 to 6 had CO limits of 0 and 6 % and did nothing in Auto "
    "(industrialmonitordirect.com, click-plc-pid-scaling-fixing-0-6-range-vs-0-100-output). Limits that leave half of "
    "the output or more may equal a range by chance.",
)
CV_FULL = 4095
"""Counts of an EZLogix's control value at 100 %."""
MIN_PERCENT = Decimal("0.01")
SWITCH_ERROR_SHARE = Decimal("0.0125")
"""Of the PV's range: the error that is driven through the whole output."""

# --- Where each vendor has its scales, and what an error makes of the output ------------------------------------------


def _number_pair(loop: object, *keys: str) -> Ends | None:
    """Two numbers under one key or two; None where they are not given, are counts, or an expression."""
    values = [value_at(loop, key.split(".")) for key in keys]
    ends = [
        end.value if isinstance(end, Quantity) and not end.counts else end
        for end in (values[0] if len(keys) == 1 else values) or ()
    ]
    return (ends[0], ends[1]) if len(ends) == 2 and all(isinstance(end, Decimal) for end in ends) else None


@frozen
class Scales:
    """The keys of a vendor: of the gain, the PV's range, the output's limits and its range."""

    gain: str
    pv: tuple[str, ...] = ("pv.range",)
    limits: tuple[str, ...] = ("output.limits",)
    is_linear: Callable[[Any], bool] = lambda _: True
    """Whether the proportional term is the gain times the error."""
    fixed_output_range: Ends | None = None
    """The output's range, where it is the same for all loops."""

    def output(self, loop: Any) -> Ends | None:
        """What 0 % and 100 % of the output are; None: the file does not say."""
        return self.fixed_output_range or _number_pair(loop, "output.range")

    def normalized_gain(self, loop: object) -> Decimal | None:
        """Output ranges that an error of the whole PV range makes; None: the file does not say, or not by a gain."""
        gain, pv, output = (
            value_at(loop, self.gain.split(".")),
            _number_pair(loop, *self.pv),
            self.output(loop) or _number_pair(loop, *self.limits),
        )
        if (
            not isinstance(gain, Decimal)
            or pv is None
            or output is None
            or output[0] == output[1]
            or not self.is_linear(loop)
        ):
            return None
        return abs(EXACT_CONTEXT.divide(EXACT_CONTEXT.multiply(gain, pv[1] - pv[0]), output[1] - output[0]))


class Dl06Scales(Scales):
    """Those of a DL06, whose gain is ranges per range, whatever the units are."""

    def normalized_gain(self, loop: object) -> Decimal | None:
        """The gain itself."""
        return Decimal(value_at(loop, self.gain.split("."))) if self.is_linear(loop) else None


class EzlogixScales(Scales):
    """Those of an EZLogix, whose gain is in counts of the CV per count of the PV."""

    def normalized_gain(self, loop: Any) -> Decimal | None:
        """The gain times the PV's counts, as a share of the CV's."""
        low, high = loop.pv.counts or (0, CV_FULL)
        gain: Decimal = loop.tuning.proportional_gain
        return gain * (high - low) / CV_FULL if self.is_linear(loop) else None


SCALES: Mapping[str, Scales] = {
    "dl06": Dl06Scales("tuning.gain", is_linear=lambda loop: loop.error.curve == "linear"),
    "click": Scales("", fixed_output_range=(Decimal(0), Decimal(100))),
    "ezlogix": EzlogixScales("tuning.proportional_gain", is_linear=lambda loop: not loop.pv.square_root),
    "nextopid": Scales(
        "Kp", ("MinPV", "MaxPV"), ("MinMV", "MaxMV"), lambda loop: loop.DisableP is False or loop.Indep is True
    ),
    "dpide": Scales("Kc_Kp", limits=("MV_MIN", "MV_MAX")),
    "generic": Scales("tuning.gain", is_linear=lambda loop: loop.tuning.proportional and not loop.pv.square_root),
}


def _gain_loops(context: AnyContext) -> Iterator[tuple[int, Any, Scales]]:
    """The loops with gains, their places and keys; of a NextoPID what its parameters hold in the first scan."""
    scales = SCALES[context.config.vendor]
    key = scales.limits[0].partition(".")[0]
    views = {id(view.item): view for view in getattr(context, "pids", ())}
    for i, loop in enumerate(context.config.loops):
        if hasattr(loop, key):
            view = views.get(id(loop))
            yield i, loop if view is None else _first_values(view, scales), scales


def _first_values(view: Any, scales: Scales) -> Any:
    """A NextoPID loop with the numbers that its wires and expressions have when the program starts."""
    numbers = {key: view.number_of(key) for key in (scales.gain, *scales.pv, *scales.limits)}
    output = value_at(view.item, ("output",))
    return SimpleNamespace(**numbers, DisableP=view.is_on("DisableP"), Indep=view.is_on("Indep"), output=output)


@warning("PID111", D953, "{field} {gain}: an error of {error} % of the PV's range drives the output from end to end")
def gain_like_a_switch(context: AnyContext) -> Findings:
    """The gain is so high that the smallest error saturates the output.

    Why: sensors and converters are hardly better than 1 % of their range. The output is at one end or the other, as
    that of a thermostat, and what the noise of the PV makes of it wears the actuator out.

    Fix: lower the gain: 100 / gain is the proportional band in % where both ranges are alike. See that it was not
    carried over from a PLC that counts it in other units, and that 9999 was not typed for 1.00.
    """
    switches = [
        (i, loop, scales, ratio) for i, loop, scales in _gain_loops(context) if (ratio := _switch_gain(loop, scales))
    ]
    misfits = {path[:2] for path, _ in context.encoding.misfits}
    refused_paths = {path for path, _, _ in find_outliers(context.config, ())} if switches else set()
    for i, loop, scales, ratio in switches:
        keys = scales.gain.split(".")
        if ("loops", i, *keys) not in refused_paths and ("loops", i) not in misfits:
            gain = number_text(value_at(loop, keys))
            yield make_finding("loops", i, *keys, field=keys[-1], gain=gain, error=_percent_text(100 / ratio))


def _switch_gain(loop: Any, scales: Scales) -> Decimal | None:
    """`Scales.normalized_gain` of a loop whose gain is that of a switch."""
    gain = scales.normalized_gain(loop) if scales.gain else None
    return gain if gain is not None and gain * SWITCH_ERROR_SHARE >= 1 else None


def _percent_text(value: Decimal) -> str:
    """A small number of percent, without an exponent."""
    return "less than 0.01" if value < MIN_PERCENT else f"{float(value):.3g}"


@warning("PID112", D954, "the output stays between {low} and {high}, the two numbers of the PV's range, of {scale}")
def output_limits_are_the_pv_range(context: AnyContext) -> Findings:
    """The limits of the output are the two numbers of the PV's range, and leave less than half of the output.

    Why: limits are on the output's scale. A loop with a PV of 0 to 6 bar and an output of 0 to 100 % that may give 0 to
    6 % does as good as nothing in Auto, though Manual moves the actuator.

    Fix: write the limits in the unit of the output, such as 0 to 100 %.
    """
    for i, loop, scales in _gain_loops(context):
        limits, pv, output = _number_pair(loop, *scales.limits), _number_pair(loop, *scales.pv), scales.output(loop)
        if limits is None or output is None or limits != pv or limits[0] >= limits[1]:
            continue
        if 2 * (limits[1] - limits[0]) < output[1] - output[0]:
            texts = [number_text(end) for end in (*limits, *output)]
            path = scales.limits[-1].split(".")
            yield make_finding("loops", i, *path, low=texts[0], high=texts[1], scale=f"{texts[2]} to {texts[3]}")


# --- A vendor's rules: those of every vendor, and those of its modules, which its list names --------------------------


def collect_rules(*modules: ModuleType) -> dict[str, Rule]:
    """The rules for every vendor and those of some modules by code, in order; two with one code are a bug."""
    tables = (globals(), *map(vars, modules))
    rules = [value for names in tables for value in names.values() if isinstance(value, Rule)]
    table = {rule.code: rule for rule in sorted(rules, key=lambda rule: number_of(rule.code))}
    if len(table) != len(rules):
        raise RuntimeError(f"two rules share a code: {sorted(rule.code for rule in rules)}")
    return table
