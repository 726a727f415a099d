"""Gains by a rule: the result of `pidcfg.tune`, and its JSON."""

from __future__ import annotations

from dataclasses import asdict, replace
from math import isinf
from typing import TYPE_CHECKING

from pidcfg.output.arguments import ArgumentError
from pidcfg.output.findings import short_repr
from pidcfg.output.process import (
    KnownProcess,
    filtered_process,
    make_vendor_gains,
    model_of,
    process_of,
    reduce_transfer,
    refuse_missing,
    refuse_other_sample_time,
    warn_of_unit,
)
from pidcfg.text.frozen import frozen
from pidcfg.tuning.margins import (
    finite_or_none,
    judge_gains,
    process_of_cycle,
    warnings_of_authors,
    warnings_of_sensitivity,
)
from pidcfg.tuning.rules import METHODS, Cycle, Gains, Method, Model, Process, TuningError
from pidcfg.tuning.transfer import transfer_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.output.process import GainsFile, Target, VendorGains
    from pidcfg.output.retune import Forecast, LoopConditions, RecordScale, RetunedFile
    from pidcfg.output.robust import RobustGains, SearchResult
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Limits
    from pidcfg.tuning import Form
    from pidcfg.tuning.identify import Identification
    from pidcfg.tuning.margins import Judgement
    from pidcfg.tuning.response import Record, Request
    from pidcfg.tuning.transfer import Transfer

IDENTIFIED_NUMBERS = ("gain", "time_constant", "dead_time")
"""What a recorded step tells."""
FORMS: tuple[Form, ...] = ("PID", "PI", "P")
"""The order in which they are tried where none is asked for."""


@frozen
class TuneResult:
    """Gains in output units per PV unit and times in s, and the inputs that they follow from."""

    __repr__ = short_repr

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
    identified: Identification | None = None
    """The process of the recorded step, where one was given."""
    record: Record | None = None
    vendor: VendorGains | None = None
    robust: RobustGains | None = None
    """What holds on which plants, of gains by the method robust."""
    written: RetunedFile | None = None
    """The configuration with the gains in one of its loops, where one was given."""
    around: LoopConditions | None = None
    """What of that loop the gains are made for."""
    forecast: Forecast | None = None
    """What its words do on the process."""
    plant: Transfer | None = None
    """The process itself, its gain without a sign; None: it is not known."""

    @property
    def findings(self) -> tuple[Diagnostic, ...]:
        """What the rules find at that loop with these gains; wrong numbers and records are a `ValueError`."""
        return () if self.written is None else self.written.findings

    @property
    def ok(self) -> bool:
        """Whether the configuration may be saved; always without one (what does not fit is in ``vendor.values``)."""
        return self.written is None or self.written.ok

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
            "process": {**self._process_data(), **self._fit_data()},
            "gain": gains.gain,
            "integral_time": gains.integral_time if integral else None,
            "derivative_time": gains.derivative_time,
            "independent": {"kp": gains.gain, "ki": gains.ki if integral else 0.0, "kd": gains.kd},
            **self._robustness_data(),
            "heating": self.heating,
            "warnings": list(self.warnings),
            "identified": None if self.identified is None else _identified_data(self.identified),
        }
        if self.robust is not None:
            data["robust"] = self.robust.to_json()
        if self.vendor is not None:
            data["for"] = self.vendor.to_json()
        if self.written is not None:
            data["written"] = self.written.to_json()
        if self.forecast is not None and self.around is not None:
            data["loop"] = asdict(self.around)
            data["forecast"] = self.forecast.to_json()
        return data

    def _process_data(self) -> Data:
        """The numbers of the process, with its kind."""
        names = {"second_time_constant": "time_constant_2"}
        numbers = {names.get(key, key): value for key, value in self.numbers.items()}
        return numbers if self.model is None else {**numbers, "model": self.model}

    def _robustness_data(self) -> Data:
        """Margins and figures of the closed loop; null: unknown, unstable or without a limit."""
        judgement = self.judgement
        margins, answer = judgement.margins, judgement.answer
        return {
            "ms": None if margins is None else margins.ms,
            "gain_margin": None if margins is None else finite_or_none(margins.gain_margin),
            "phase_margin": None if margins is None else finite_or_none(margins.phase_margin),
            "stable": margins is not None if judgement.known else None,
            "overshoot_percent": None if answer is None else answer.overshoot,
            "iae_setpoint": None if answer is None else answer.iae_setpoint,
            "iae_disturbance": None if answer is None else answer.iae_disturbance,
            "valid": judgement.valid,
            "valid_reason": judgement.reason,
        }

    def _fit_data(self) -> Data:
        """What kind of process was identified, and how well."""
        fit = self.identified
        if fit is None:
            return {}
        return {"model": fit.model, "fit": 100 * (1 - fit.misfit), "confidence": _confidence_data(fit)}


def _confidence_data(fit: Identification) -> Data:
    gain, constant, dead = fit.confidence
    data = {"gain": gain, "time_constant": None if fit.integrating else constant, "dead_time": dead}
    return {**data, "time_constant_2": fit.second_confidence} if fit.process.second_time_constant else data


def _identified_data(fit: Identification) -> Data:
    return {
        "model": fit.model,
        "gain": fit.process.gain,
        "time_constant": None if fit.integrating else fit.process.time_constant,
        "dead_time": fit.process.dead_time,
        **({"time_constant_2": second} if (second := fit.process.second_time_constant) else {}),
        "confidence": _confidence_data(fit),
        "drift": fit.drift,
        "remarks": list(fit.remarks),
        "step_at": fit.step_time,
        "noise": fit.noise,
        "misfit_percent": fit.misfit * 100,
    }


def tune_gains(
    method: str,
    form: Form | None,
    facts: KnownProcess,
    step: tuple[bytes, str, Request] | None,
    target: Target,
    limits: Limits,
) -> TuneResult:
    """The result of a rule; ``step``: bytes and name of a recorded step, and what is said of it.

    The step tells gain, time constant and dead time.
    """
    fit = record = conditions = None
    if step is not None:
        facts, fit, record = _use_record(method, facts, step, limits)
    if target.file is not None:
        target.refuse_ranges()
        facts, conditions = _use_loop(facts, target, target.file, limits)
    if facts.robustness is None:
        target.refuse_ranges()
        result = replace(compute_gains(method, form, facts), identified=fit, record=record)
    else:
        from pidcfg.output.robust import search_gains

        search = search_gains(METHODS[method], form, facts, fit, target, limits)
        target = search.target
        result = replace(_search_result(METHODS[method], facts, search), identified=fit, record=record)
    if fit is not None:
        result = replace(result, warnings=(*result.warnings, *fit.cautions))
    if target.file is None or conditions is None:
        vendor_gains = target.vendor_gains(result.gains, heating=result.heating)
        warnings = (
            *target.warn_of_sampling(facts.numbers.get("sample_time")),
            *warn_of_unit(target.vendor, vendor_gains),
        )
        return replace(result, vendor=vendor_gains, warnings=(*result.warnings, *warnings))
    return _put_into_loop(result, target, target.file, conditions, limits, "" if step is None else step[1])


def _use_record(
    method: str, facts: KnownProcess, step: tuple[bytes, str, Request], limits: Limits
) -> tuple[KnownProcess, Identification, Record]:
    """What is known, with the numbers that a recorded step tells."""
    from pidcfg.tuning.identify import identify_record

    data, name, request = step
    fit, record = identify_record(data, name, limits, request)
    if fit.integrating and "integrating" not in METHODS[method].models:
        names = [row.name for row in METHODS.values() if "integrating" in row.models]
        raise TuningError(
            f"{name}: the process integrates ({fit.process.gain:.4g} per s and unit of the output); {method} is "
            f"for one that settles: use {', '.join(names[:-1])} or {names[-1]} ({'; '.join(fit.remarks)})"
        )
    for key in IDENTIFIED_NUMBERS:
        if key in facts.numbers:
            raise ArgumentError(f"`{key}` and `record` do not go together", key, "record")
    identified = [key for key in IDENTIFIED_NUMBERS if not (fit.integrating and key == "time_constant")]
    identified += ["second_time_constant"] if fit.process.second_time_constant else []
    numbers = {**{key: getattr(fit.process, key) for key in identified}, **facts.numbers}
    facts = replace(facts, numbers=numbers, model="integrating" if fit.integrating else None)
    return facts, fit, record


def _record_scale(result: TuneResult, name: str) -> RecordScale | None:
    """What of a record has to be in the units of the loop; None: there is no record."""
    from pidcfg.output.retune import RecordScale

    fit, record = result.identified, result.record
    if fit is None or record is None:
        return None
    return RecordScale(name, (min(record.pv), max(record.pv)), abs(fit.step), record.units)


def _put_into_loop(
    result: TuneResult, target: Target, file: GainsFile, conditions: LoopConditions, limits: Limits, record_name: str
) -> TuneResult:
    """The result with the file that has the gains in a loop, and what its words do on the process.

    ``record_name``: the name of the record, if it is of one.
    """
    from pidcfg.output.retune import forecast_words, retune_loop

    retuned, values = retune_loop(result.gains, target, file, limits, heating=result.heating)
    plant = result.plant
    if plant is not None and not result.heating:
        plant = replace(plant, gain=-plant.gain)
    forecast = forecast_words(retuned, conditions, plant, result.gains, _record_scale(result, record_name))
    judgement = result.judgement if forecast.why else replace(result.judgement, answer=forecast.answer)
    return replace(
        result,
        written=retuned,
        vendor=make_vendor_gains(retuned.vendor, values, heating=result.heating),
        around=conditions,
        forecast=forecast,
        judgement=judgement,
        warnings=(*result.warnings, *forecast.warnings()),
    )


def _use_loop(
    facts: KnownProcess, target: Target, file: GainsFile, limits: Limits
) -> tuple[KnownProcess, LoopConditions]:
    """What is known, with the sample time and the PV filter of the loop that is to have the gains."""
    from pidcfg.output.retune import LoopConditions, loop_tuning

    conditions = LoopConditions.from_loop(loop_tuning(target, file, limits)[1])
    if conditions.sample_time is None or facts.robustness is not None:
        return facts, conditions
    numbers = facts.numbers
    refuse_other_sample_time(numbers.get("sample_time"), conditions.sample_time, file.name)
    if "dead_time" in numbers or facts.transfer is not None:
        numbers = {**numbers, "sample_time": conditions.sample_time}
    return replace(facts, numbers=numbers, filter_time=conditions.filter_time), conditions


def _search_result(method: Method, facts: KnownProcess, search: SearchResult) -> TuneResult:
    """The result of a search, beside its judgement by the continuous loop on the process itself."""
    gains = search.robust.tuning.result.gains
    judgement = judge_gains(method, search.form, gains, search.process)
    notes = (*warnings_of_authors(search.process), *warnings_of_sensitivity(search.robust.tuning.result.ms))
    plant = transfer_of(replace(search.process, sample_time=0.0))
    return TuneResult(
        method, search.form, facts.numbers, gains, search.model, judgement, notes, robust=search.robust, plant=plant
    )


def compute_gains(name: str, form: Form | None, facts: KnownProcess) -> TuneResult:
    """The result of a rule; raises `ArgumentError` where a number is missing, `TuningError` beyond the rule's range."""
    method = METHODS[name]
    if form is not None and form not in method.forms:
        raise ArgumentError(f"{name} has no rule for {form}; it has {' and '.join(method.forms)}")
    facts = reduce_transfer(method, form, facts)
    model = model_of(method, facts)
    refuse_missing(method, facts.numbers, model)
    numbers, unfiltered = facts.numbers, process_of(facts.numbers, model)
    process = filtered_process(unfiltered, facts.filter_time) if method.of_ultimate is None else unfiltered
    cycle = Cycle(numbers.get("ultimate_gain", 0.0), numbers.get("ultimate_period", 0.0))
    chosen_form, gains = _gains_of_form(method, form, process, cycle)
    if method.of_ultimate is None:
        plant: Transfer | None = facts.transfer or transfer_of(replace(unfiltered, sample_time=0.0))
        filtered_plant = facts.transfer
        if plant is not None and facts.filter_time:
            filtered_plant = replace(plant, poles=(*plant.poles, facts.filter_time))
        judgement = judge_gains(method, chosen_form, gains, process, filtered_plant)
        warnings = (*warnings_of_authors(process), *judgement.warnings())
        return TuneResult(method, chosen_form, numbers, gains, model, judgement, warnings, plant=plant)
    cycle_process = process_of_cycle(abs(numbers["gain"]), cycle) if "gain" in numbers else None
    judgement = judge_gains(method, chosen_form, gains, cycle_process)
    plant = None if cycle_process is None else transfer_of(cycle_process)
    return TuneResult(method, chosen_form, numbers, gains, None, judgement, tuple(judgement.warnings()), plant=plant)


def _gains_of_form(method: Method, form: Form | None, process: Process, cycle: Cycle) -> tuple[Form, Gains]:
    """The gains of a form, or of the first from PID down that the rule has for this process."""
    *earlier, last = (form,) if form else tuple(f for f in FORMS if f in method.forms)
    for chosen_form in earlier:
        try:
            return chosen_form, method.gains(chosen_form, process, cycle)
        except ValueError:
            continue
    try:
        return last, method.gains(last, process, cycle)
    except ZeroDivisionError:
        raise TuningError(f"{method.name} divides by the dead time, which is 0: give the sample time") from None
    except (ValueError, OverflowError) as error:
        raise TuningError(f"{method.name}: {error}") from None
