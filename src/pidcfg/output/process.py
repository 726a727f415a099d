"""What is said of a process, and where the gains of a rule go."""

from __future__ import annotations

from dataclasses import fields, replace
from decimal import Decimal
from math import inf
from typing import TYPE_CHECKING, Any, TypedDict, get_args

from pidcfg.encoders.contract import tables_of
from pidcfg.output.arguments import ArgumentError
from pidcfg.text.frozen import frozen
from pidcfg.tuning.response import Request
from pidcfg.tuning.rules import MAX_NUMBER, METHODS, MIN_NUMBER, Process, is_usable
from pidcfg.tuning.transfer import Transfer
from pidcfg.tuning.transfer import reduce_by_half_rule as half_rule

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Reader
    from pidcfg.tuning import Form
    from pidcfg.tuning.robust import FittedNumber
    from pidcfg.tuning.rules import Gains, Method, Model
    from pidcfg.vendors import Vendor

# --- What is said of a process: its numbers, kind or transfer function, and what a rule still needs of them -----------

DEFAULT_MS, MIN_MS, MAX_MS = 1.6, 1.1, 3.0
"""Of the maximum sensitivity: below, next to nothing is left of the controller; above, the loop hardly settles."""
MAX_SAMPLES = 100_000
PROCESS_NUMBERS = ("gain", "time_constant", "second_time_constant", "dead_time")
"""Numbers that a transfer function stands for."""


class Numbers(TypedDict):
    """The numbers of a process or of its ultimate cycle as they are given: gains, times in s."""

    gain: float | None
    time_constant: float | None
    dead_time: float | None
    second_time_constant: float | None
    closed_loop: float | None
    sample_time: float | None
    ultimate_gain: float | None
    ultimate_period: float | None


@frozen
class KnownProcess:
    """The process as the caller gives it: its numbers, its kind, or its transfer function."""

    numbers: Mapping[str, float]
    model: Model | None = None
    transfer: Transfer | None = None
    robustness: Robustness | None = None
    """Of the method robust alone."""
    filter_time: float = 0.0
    """The time constant of the loop's PV filter, in s; 0: there is none, or it is not known."""


@frozen
class Robustness:
    """What is asked of robust gains: what varies, as text, and the limit of Ms."""

    vary: str | None
    ms: float
    samples: int = 0
    """Of `certify`, which confirms the gains; 0: it does not."""


def robustness_of(vary: str | None, ms: float | None, samples: int, *, is_robust: bool) -> Robustness | None:
    """What is asked of robust gains; None for other methods, which raise `ArgumentError` where something is."""
    for name, value in (("vary", vary), ("ms", ms)):
        if value is not None and not is_robust:
            raise ArgumentError(f"`{name}` is for the method robust", name)
    limit = DEFAULT_MS if ms is None else as_float(ms)
    if not MIN_MS <= limit <= MAX_MS:
        raise ArgumentError(f"`ms`: {limit:g}; write a number from {MIN_MS:g} to {MAX_MS:g}, such as 1.6", "ms")
    if not 0 <= samples <= MAX_SAMPLES:
        raise ArgumentError(f"`samples` is {samples}; write a whole number from 0 to {MAX_SAMPLES}", "samples")
    return Robustness(vary, limit, samples) if is_robust else None


def record_request(
    columns: str | None, rest: float | None, start: str | None, until: str | None, *, has_record: bool
) -> Request:
    """What is said of a record; raises `ArgumentError` where there is none, or for an output that is no number."""
    given_options = {"columns": columns, "rest": rest, "start": start, "until": until}
    for name, value in given_options.items():
        if value is not None and not has_record:
            raise ArgumentError(f"`{name}` is for `record`", name, "record")
    if rest is not None and not abs(as_float(rest)) <= MAX_NUMBER:
        raise ArgumentError(f"`rest`: {rest:g}; write the output before the record", "rest")
    return Request(columns, None if rest is None else float(rest), start, until)


def check_process(
    numbers: Mapping[str, float], model: Model | None, transfer: str | None, *, has_record: bool
) -> KnownProcess:
    """What is said of the process.

    Raises `ArgumentError` for what does not go together, `TuningError` for a transfer function that cannot be read.
    """
    for name, value in (("model", model), ("transfer", transfer)):
        if value is not None and has_record:
            raise ArgumentError(f"`{name}` and `record` do not go together", name, "record")
    if transfer is None:
        return KnownProcess(numbers, model)
    for key in ("model", *PROCESS_NUMBERS):
        if key in numbers or (key == "model" and model is not None):
            raise ArgumentError(f"`{key}` and `transfer` do not go together", key, "transfer")
    from pidcfg.tuning.transfer import read_transfer

    return KnownProcess(numbers, None, read_transfer(transfer))


def check_number(name: str, value: float) -> float:
    """A number of the process; raises `ArgumentError` unless a process can have it: above 0, a gain also below."""
    signed, number = name == "gain", as_float(value)
    if not is_usable(number) or (number < 0 and not signed):
        raise ArgumentError(f"`{name}`: {number_fault(number, signed=signed)}", name)
    return number


def number_fault(number: float, *, signed: bool) -> str:
    """What is wrong with a number that is none of a process, and what to write."""
    if not (number > 0 or (signed and number < 0)):
        return f"{number:g}; write a number {'other than' if signed else 'above'} 0"
    return f"{number:g}; write a number from {MIN_NUMBER:g} to {MAX_NUMBER:g}"


def as_float(value: float) -> float:
    """Any number as a float; one that is too large is infinite."""
    try:
        return float(value)
    except OverflowError:
        return inf


SAMPLE_TIME_TOLERANCE = 0.01
"""Relative difference of two sample times that count as one."""


def refuse_other_sample_time(given_time: float | None, loop_time: float, file: str | None) -> None:
    """Raises `ArgumentError` for a sample time that is not the loop's own."""
    if given_time is not None and abs(given_time - loop_time) > SAMPLE_TIME_TOLERANCE * given_time:
        prefix = "" if file is None else f"{file}: "
        message = f"`sample_time` is {given_time:g} s, and {prefix}the loop samples every {loop_time:g} s: leave it out"
        raise ArgumentError(message, "sample_time")


def filtered_process(process: Process, filter_time: float) -> Process:
    """The process with a filter of this time constant behind it, as one more lag, by the half rule."""
    if not filter_time:
        return process
    lags = (process.second_time_constant,) if process.second_time_constant else ()
    poles = (*lags, filter_time) if process.integrating else (process.time_constant, *lags, filter_time)
    slope = process.slope if process.integrating else process.gain
    order = 1 + len(lags)
    reduced = half_rule(Transfer(slope, (), poles, int(process.integrating), process.dead_time), order)
    return replace(reduced, sample_time=process.sample_time, closed_loop=process.closed_loop)


def reduce_transfer(method: Method, form: Form | None, facts: KnownProcess) -> KnownProcess:
    """With the numbers of the process that a transfer function is reduced to by the half rule."""
    if facts.transfer is None:
        return facts
    order = 2 if "second-order" in method.models and form in {None, "PID"} else 1
    process = half_rule(facts.transfer, order)
    reduced = {key: getattr(process, key) for key in PROCESS_NUMBERS if getattr(process, key)}
    if process.integrating:
        del reduced["time_constant"]
    return replace(facts, numbers={**reduced, **facts.numbers}, model=process.model)


def model_of(method: Method, facts: KnownProcess) -> Model:
    """The kind of process; raises `ArgumentError` where the numbers contradict it, or the rule is not for it."""
    is_second_order = "second_time_constant" in facts.numbers
    model: Model = facts.model or ("second-order" if is_second_order else "first-order")
    if model == "integrating" and "time_constant" in facts.numbers:
        message = "an integrating process has no `time_constant`; its `gain` is the slope"
        raise ArgumentError(message, "time_constant", "gain")
    if model == "first-order" and is_second_order:
        raise ArgumentError("a first-order process has no `second_time_constant`", "second_time_constant")
    if model == "integrating" and "integrating" not in method.models and not method.of_ultimate:
        names = ", ".join(row.name for row in METHODS.values() if "integrating" in row.models)
        raise ArgumentError(f"{method.name} is not for a process that integrates; use {names}")
    return model


def refuse_missing(method: Method, numbers: Mapping[str, float], model: Model) -> None:
    """Raises `ArgumentError` with all numbers that the rule still needs."""
    required = ["ultimate_gain", "ultimate_period"] if method.of_ultimate else [n for n in method.needs if n != "delay"]
    if model == "integrating":
        required = [key for key in required if key != "time_constant"]
    if model == "second-order" and not method.of_ultimate:
        required.append("second_time_constant")
    if "delay" in method.needs and "sample_time" not in numbers:
        required.append("dead_time")
    missing = [key for key in required if key not in numbers]
    if missing:
        *earlier, last = (f"`{key}`" for key in missing)
        raise ArgumentError(f"{method.name} needs {', '.join(earlier)}{' and ' if earlier else ''}{last}", *missing)


def process_of(numbers: Mapping[str, float], model: Model) -> Process:
    """The numbers as a process of this kind, its gain without a sign."""
    magnitudes: dict[str, Any] = {field.name: abs(numbers.get(field.name, 0.0)) for field in fields(Process)}
    integrating = {"time_constant": 1.0} if model == "integrating" else {}
    return Process(**{**magnitudes, **integrating, "integrating": bool(integrating)})


# --- Where the gains of a rule go: the terms of a PLC, or a loop of a configuration -----------------------------------


@frozen
class VendorGains:
    """The three numbers as the registers of a PLC hold them, and its word for the action."""

    vendor: str
    action: str | None
    """None: the sign of the process's gain is not known."""
    values: tuple[FittedNumber, ...]

    def to_json(self) -> Data:
        """Key, unit, value, what is stored of it, and the error that this makes."""
        values = [
            {
                "key": v.key,
                "unit": v.unit,
                "value": float(v.wanted),
                "stored": None if v.stored is None else float(v.stored),
                "error_percent": round(v.error_percent, 4),
                "problem": v.problem,
            }
            for v in self.values
        ]
        return {"vendor": self.vendor, "action": self.action, "values": values}


@frozen
class GainsFile:
    """The file that gains are put into: its bytes, its name, and which of its loops; None: the only one."""

    data: bytes
    name: str
    loop: str | None
    reader: Reader


@frozen
class Target:
    """The PLC that is to hold the gains, if any, and the engineering values of PV and output at 0 and 100 %."""

    vendor: Vendor | None
    pv_range: tuple[float, float] | None
    output_range: tuple[float, float] | None
    """None: 0 to 100, or what the configuration says."""
    file: GainsFile | None = None
    """The configuration that the gains are put into."""

    def refuse_ranges(self) -> None:
        """Raises `ArgumentError` where the PV's range is needed and nobody says it, or a range does not ascend."""
        vendor = self.vendor if self.file is None and self.pv_range is None else None
        if vendor is not None and tables_of(vendor).TUNING_NUMBERS.gain_unit == "span":
            raise ArgumentError(f"{vendor.title} has gains in shares of the span: add `pv_range` LOW HIGH", "pv_range")
        for name, span in (("pv_range", self.pv_range), ("output_range", self.output_range)):
            if span is not None and not 0 < as_float(span[1]) - as_float(span[0]) < inf:
                ends = " to ".join(f"{as_float(end):g}" for end in span)
                raise ArgumentError(f"`{name}` {ends} does not ascend; write the lower end first", name)

    def warn_of_sampling(self, seconds: float | None) -> tuple[str, ...]:
        """What to say of a sample time, in s, that no loop of the PLC can have; a file's loop has its own."""
        vendor = None if self.file is not None or not seconds else self.vendor
        loop = None if vendor is None else get_args(vendor.model.model_fields["loops"].annotation)[0]
        if vendor is None or "sample_rate" not in getattr(loop, "model_fields", {}):
            return ()
        from pidcfg.schemas.base import limits_at

        limits = limits_at(loop, "sample_rate")
        if limits is None or limits.holds(Decimal(str(seconds))):
            return ()
        return (f"{vendor.title} samples a loop every {limits.low} to {limits.high} s, and never every {seconds:g} s",)

    def vendor_gains(self, gains: Gains, *, heating: bool | None) -> VendorGains | None:
        """The three numbers as the registers hold them."""
        if self.vendor is None:
            return None
        from pidcfg.tuning.robust import fit_gains

        ranges = (self.pv_range or (0.0, 1.0), self.output_range or (0.0, 100.0))
        spans = (float(high) - float(low) for low, high in ranges)
        return make_vendor_gains(self.vendor, fit_gains(gains, self.vendor, *spans), heating=heating)


def warn_of_unit(vendor: Vendor | None, vendor_gains: VendorGains | None) -> tuple[str, ...]:
    """What to say of a reset in min where the word counts in s unless the file says otherwise (D1086)."""
    if vendor is None or vendor_gains is None:
        return ()
    from pidcfg.schemas.base import RESET_UNIT

    words = tables_of(vendor).TUNING_NUMBERS
    keys = {words.key(name) for name in words.names if words.unit(name) == RESET_UNIT}
    rows = (v for v in vendor_gains.values if v.key in keys and v.unit == "min")
    return tuple(f"{v.key} is in min: write `reset_unit: minutes` beside it, or its number counts as s" for v in rows)


def make_vendor_gains(vendor: Vendor, values: Sequence[FittedNumber], *, heating: bool | None) -> VendorGains:
    """The three numbers of a PLC with its word for the action."""
    words = tables_of(vendor).TUNING_NUMBERS
    action = None if heating is None else words.heating if heating else words.cooling
    return VendorGains(vendor.key, action, tuple(values))
