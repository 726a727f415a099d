"""Gains by a rule: the result of `pidcfg.tune`, and its JSON."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf, isinf
from typing import TYPE_CHECKING

from pidcfg.results.arguments import ArgumentError
from pidcfg.results.processes import Known, as_float, model_of, process_of, reduced, refuse_missing
from pidcfg.tuning.judgement import finite, judged, process_of_cycle, remarks
from pidcfg.tuning.methods import METHODS, Method
from pidcfg.tuning.rules import Cycle, Form, Gains, Model, Process, TuningError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.diagnostics import Diagnostic
    from pidcfg.limits import Limits
    from pidcfg.results.findings import Data
    from pidcfg.tuning.fit import Fitted
    from pidcfg.tuning.identify import Identified
    from pidcfg.tuning.judgement import Judgement
    from pidcfg.tuning.samples import Record, Request
    from pidcfg.vendors import Vendor

IDENTIFIED = ("gain", "time_constant", "dead_time")
"""What a recorded step tells."""
FORMS: tuple[Form, ...] = ("PID", "PI", "P")
"""The order in which they are tried where none is asked for."""


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
    model: Model | None
    """The kind of process; None: only its ultimate cycle is known."""
    judgement: Judgement
    """Whether the rule holds for it, and how robust the loop is."""
    warnings: tuple[str, ...] = ()
    """What the rule's range, the margins and the rules' authors warn of."""
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
            "process": {**self._process(), **self._sureness()},
            "gain": gains.gain,
            "integral_time": gains.integral_time if integral else None,
            "derivative_time": gains.derivative_time,
            "independent": {"kp": gains.gain, "ki": gains.ki if integral else 0.0, "kd": gains.kd},
            **self._robustness(),
            "heating": self.heating,
            "warnings": list(self.warnings),
            "identified": None if self.identified is None else _identified(self.identified),
        }
        return data if self.vendor is None else {**data, "for": self.vendor.to_json()}

    def _process(self) -> Data:
        """The numbers of the process, with its kind."""
        names = {"second_time_constant": "time_constant_2"}
        numbers = {names.get(key, key): value for key, value in self.numbers.items()}
        return numbers if self.model is None else {**numbers, "model": self.model}

    def _robustness(self) -> Data:
        """Margins and figures of the closed loop; null: unknown, unstable or without a limit."""
        judgement = self.judgement
        margins, answer = judgement.margins, judgement.answer
        return {
            "ms": None if margins is None else margins.ms,
            "gain_margin": None if margins is None else finite(margins.gain_margin),
            "phase_margin": None if margins is None else finite(margins.phase_margin),
            "stable": margins is not None if judgement.known else None,
            "overshoot_percent": None if answer is None else answer.overshoot,
            "iae_setpoint": None if answer is None else answer.iae_setpoint,
            "iae_disturbance": None if answer is None else answer.iae_disturbance,
            "valid": judgement.valid,
            "valid_reason": judgement.reason,
        }

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
                ends = " to ".join(f"{as_float(end):g}" for end in span)
                raise ArgumentError(f"`{name}` {ends} does not ascend; write the lower end first", name)

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


def tuned(
    method: str,
    form: Form | None,
    known: Known,
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
        if fit.integrating and "integrating" not in METHODS[method].models:
            names = [row.name for row in METHODS.values() if "integrating" in row.models]
            raise TuningError(
                f"{name}: the process integrates ({fit.process.gain:.4g} per s and unit of the output); {method} is "
                f"for one that settles: use {', '.join(names[:-1])} or {names[-1]} ({'; '.join(fit.remarks)})"
            )
        for key in IDENTIFIED:
            if key in known.numbers:
                raise ArgumentError(f"`{key}` and `record` do not go together", key, "record")
        told = [key for key in IDENTIFIED if not (fit.integrating and key == "time_constant")]
        numbers = {**{key: getattr(fit.process, key) for key in told}, **known.numbers}
        known = Known(numbers, "integrating" if fit.integrating else None)
    target.refuse_ranges()
    result = computed(method, form, known)
    return replace(result, identified=fit, record=record, vendor=target.gains(result))


def computed(name: str, form: Form | None, known: Known) -> TuneResult:
    """The result of a rule; raises `ArgumentError` where a number is missing, `TuningError` beyond the rule's range."""
    method = METHODS[name]
    if form is not None and form not in method.forms:
        raise ArgumentError(f"{name} has no rule for {form}; it has {' and '.join(method.forms)}")
    known = reduced(method, form, known)
    model = model_of(method, known)
    refuse_missing(method, known.numbers, model)
    numbers, process = known.numbers, process_of(known.numbers, model)
    cycle = Cycle(numbers.get("ultimate_gain", 0.0), numbers.get("ultimate_period", 0.0))
    chosen, gains = _gains(method, form, process, cycle)
    if method.of_ultimate is None:
        judgement = judged(method, chosen, gains, process, known.transfer)
        warnings = (*remarks(process), *judgement.warnings())
        return TuneResult(method, chosen, numbers, gains, model, judgement, warnings)
    judgement = judged(
        method, chosen, gains, process_of_cycle(abs(numbers["gain"]), cycle) if "gain" in numbers else None
    )
    return TuneResult(method, chosen, numbers, gains, None, judgement, tuple(judgement.warnings()))


def _gains(method: Method, form: Form | None, process: Process, cycle: Cycle) -> tuple[Form, Gains]:
    """The gains of a form, or of the first from PID down that the rule has for this process."""
    *more, last = (form,) if form else tuple(f for f in FORMS if f in method.forms)
    for chosen in more:
        try:
            return chosen, method.gains(chosen, process, cycle)
        except ValueError:
            continue
    try:
        return last, method.gains(last, process, cycle)
    except (ValueError, OverflowError, ZeroDivisionError) as error:
        raise TuningError(f"{method.name}: {error}") from None
