"""Gains by a rule: the result of `pidcfg.tune`, and its JSON."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import inf, isinf
from typing import TYPE_CHECKING, TypedDict

from pidcfg.results.arguments import ArgumentError
from pidcfg.tuning.rules import METHODS, Cycle, Form, Gains, Method, Process, TuningError
from pidcfg.tuning.samples import Request

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.results.findings import Data
    from pidcfg.tuning.fit import Fitted
    from pidcfg.tuning.identify import Identified
    from pidcfg.tuning.samples import Record
    from pidcfg.vendors import Vendor

SAMPLE_SHARE = 10
"""A sample time should be below this part of the time constant."""
LARGEST = 1e12
IDENTIFIED = ("gain", "time_constant", "dead_time")
"""What a recorded step tells."""
OF_SLOPE = ("zn-open",)
"""Rules of gain over time constant alone, which an integrating process has too: the slope."""


class Numbers(TypedDict):
    """The numbers of a process or of its ultimate cycle as they are given: gains, times in s."""

    gain: float | None
    time_constant: float | None
    dead_time: float | None
    closed_loop: float | None
    sample_time: float | None
    ultimate_gain: float | None
    ultimate_period: float | None


@dataclass(frozen=True, slots=True)
class VendorGains:
    """The three numbers as the registers of a PLC hold them, and its word for the action."""

    vendor: str
    action: str | None
    """None: the sign of the process's gain is not known."""
    values: tuple[Fitted, ...]

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


@dataclass(frozen=True, slots=True)
class TuneResult:
    """Gains in output units per PV unit and times in s, and the inputs that they follow from."""

    method: Method
    form: Form
    numbers: Mapping[str, float]
    """The numbers of the process or of its ultimate cycle: gain, times in s."""
    gains: Gains
    warnings: tuple[str, ...] = ()
    """What the rules' authors warn of."""
    identified: Identified | None = None
    """The process of the recorded step, where one was given."""
    record: Record | None = None
    vendor: VendorGains | None = None
    findings: tuple[Diagnostic, ...] = ()
    """Always empty: what is wrong with numbers or a record is a `ValueError`."""

    @property
    def ok(self) -> bool:
        """Always; numbers that a register cannot hold say so in ``vendor.values``."""
        return True

    @property
    def heating(self) -> bool | None:
        """Whether the PV rises with the output; None where the process's gain is not known."""
        return None if "gain" not in self.numbers else self.numbers["gain"] > 0

    def to_json(self) -> Data:
        """What ``pidcfg tune --format json`` prints."""
        gains, integral = self.gains, not isinf(self.gains.integral_time)
        data = {
            "version": 1,
            "method": self.method.name,
            "title": self.method.title,
            "form": self.form,
            "basis": str(self.method.basis),
            "process": {**self.numbers, **self._sureness()},
            "gain": gains.gain,
            "integral_time": gains.integral_time if integral else None,
            "derivative_time": gains.derivative_time,
            "independent": {"kp": gains.gain, "ki": gains.ki if integral else 0.0, "kd": gains.kd},
            "heating": self.heating,
            "warnings": list(self.warnings),
            "identified": None if self.identified is None else _identified(self.identified),
        }
        return data if self.vendor is None else {**data, "for": self.vendor.to_json()}

    def _sureness(self) -> Data:
        """What kind of process was identified, and how well."""
        fit = self.identified
        if fit is None:
            return {}
        return {"model": fit.model, "fit": 100 * (1 - fit.misfit), "confidence": _confidence(fit)}


def _confidence(fit: Identified) -> Data:
    gain, constant, dead = fit.confidence
    return {"gain": gain, "time_constant": None if fit.integrating else constant, "dead_time": dead}


def _identified(fit: Identified) -> Data:
    return {
        "model": fit.model,
        "gain": fit.process.gain,
        "time_constant": None if fit.integrating else fit.process.time_constant,
        "dead_time": fit.process.dead_time,
        "confidence": _confidence(fit),
        "drift": fit.drift,
        "remarks": list(fit.remarks),
        "step_at": fit.at,
        "noise": fit.noise,
        "misfit_percent": fit.misfit * 100,
    }


@dataclass(frozen=True, slots=True)
class Target:
    """The PLC that is to hold the gains, if any, and the engineering values of PV and output at 0 and 100 %."""

    vendor: Vendor | None
    pv_range: tuple[float, float] | None
    output_range: tuple[float, float]

    def refuse_ranges(self) -> None:
        """Raises `ArgumentError` where the PV's range is needed and not given, or a range does not ascend."""
        vendor = self.vendor
        if vendor is not None and vendor.load("tuned").gain_unit == "span" and self.pv_range is None:
            raise ArgumentError(f"{vendor.title} has gains in shares of the span: add `pv_range` LOW HIGH", "pv_range")
        for name, span in (("pv_range", self.pv_range), ("output_range", self.output_range)):
            if span is not None and not 0 < as_float(span[1]) - as_float(span[0]) < inf:
                raise ArgumentError(f"`{name}` does not ascend", name)

    def gains(self, result: TuneResult) -> VendorGains | None:
        """The three numbers as the registers hold them."""
        if self.vendor is None:
            return None
        from pidcfg.tuning.fit import fit

        spans = (float(high) - float(low) for low, high in (self.pv_range or (0.0, 1.0), self.output_range))
        values = tuple(fit(result.gains, self.vendor, *spans))
        words = self.vendor.load("tuned")
        action = None if result.heating is None else words.heating if result.heating else words.cooling
        return VendorGains(self.vendor.key, action, values)


def request(columns: str | None, rest: float | None, start: str | None, until: str | None, *, given: bool) -> Request:
    """What is said of a record; raises `ArgumentError` where there is none, or for an output that is no number."""
    said = {"columns": columns, "rest": rest, "start": start, "until": until}
    for name, value in said.items():
        if value is not None and not given:
            raise ArgumentError(f"`{name}` is for `record`", name, "record")
    if rest is not None and not abs(as_float(rest)) <= LARGEST:
        raise ArgumentError(f"`rest`: {rest:g}; write the output before the record", "rest")
    return Request(columns, None if rest is None else float(rest), start, until)


def tuned(
    method: str,
    form: Form,
    numbers: Mapping[str, float],
    step: tuple[bytes, str, Request] | None,
    target: Target,
    limits: Limits,
) -> TuneResult:
    """The result of a rule; ``step``: bytes and name of a recorded step, and what is said of it.

    The step tells gain, time constant and dead time.
    """
    fit = record = None
    if step is not None:
        from pidcfg.tuning.record import identified

        data, name, said = step
        fit, record = identified(data, name, limits, said)
        if fit.integrating and method not in OF_SLOPE:
            raise TuningError(
                f"{name}: the process integrates ({fit.process.gain:.4g} per s and unit of the output); {method} is "
                f"for one that settles: use {' or '.join(OF_SLOPE)} ({'; '.join(fit.remarks)})"
            )
        process = {key: getattr(fit.process, key) for key in IDENTIFIED}
        for key in IDENTIFIED:
            if key in numbers:
                raise ArgumentError(f"`{key}` and `record` do not go together", key, "record")
        numbers = {**process, **numbers}
    target.refuse_ranges()
    result = computed(method, form, numbers)
    if fit is not None and fit.integrating:
        settled = {key: value for key, value in numbers.items() if key != "time_constant"}
        result = replace(result, numbers=settled, warnings=())
    return replace(result, identified=fit, record=record, vendor=target.gains(result))


def usable(name: str, value: float) -> float:
    """A number of the process; raises `ArgumentError` unless it is finite and above 0, a gain also below."""
    signed, number = name == "gain", as_float(value)
    if not (abs(number) <= LARGEST and (number > 0 or (signed and number))):
        raise ArgumentError(f"`{name}`: {number:g}; write a number {'other than' if signed else 'above'} 0", name)
    return number


def as_float(value: float) -> float:
    """Any number as a float; one that is too large is infinite."""
    try:
        return float(value)
    except OverflowError:
        return inf


def computed(name: str, form: Form, numbers: Mapping[str, float]) -> TuneResult:
    """The result of a rule; raises `ArgumentError` where a number is missing, `TuningError` beyond the rule's range."""
    method = METHODS[name]
    if form not in method.forms:
        raise ArgumentError(f"{name} has no rule for {form}; it has {' and '.join(method.forms)}")
    needed = ["ultimate_gain", "ultimate_period"] if method.of_ultimate else [n for n in method.needs if n != "delay"]
    if "delay" in method.needs:
        needed.append("dead_time")
    missing = [key for key in needed if key not in numbers]
    if missing:
        *most, last = (f"`{key}`" for key in missing)
        raise ArgumentError(f"{name} needs {', '.join(most)}{' and ' if most else ''}{last}", *missing)
    process = Process(**{field.name: abs(numbers.get(field.name, 0.0)) for field in fields(Process)})
    cycle = Cycle(numbers.get("ultimate_gain", 0.0), numbers.get("ultimate_period", 0.0))
    try:
        gains = method.gains(form, process, cycle)
    except (ValueError, OverflowError) as error:
        raise TuningError(f"{name}: {error}") from None
    return TuneResult(method, form, numbers, gains, tuple(warnings(process)) if method.of_process else ())


def warnings(process: Process) -> Iterator[str]:
    """What the rules' authors warn of."""
    if process.dead_time and process.time_constant / process.dead_time < 1:
        yield "the dead time is longer than the time constant: hard to control, whatever the gains"
    if process.sample_time and process.sample_time * SAMPLE_SHARE >= process.time_constant:
        yield "the sample time is not below a tenth of the time constant"
