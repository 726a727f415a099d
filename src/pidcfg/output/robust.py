"""Gains by the method robust, and their trial by `certify`."""

from __future__ import annotations

from dataclasses import asdict, replace
from decimal import Decimal
from math import ceil, log
from typing import TYPE_CHECKING

from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.regmap import LoopTuning
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.conversion import convert_checked
from pidcfg.output.process import model_of, process_of, refuse_missing, refuse_other_sample_time
from pidcfg.study.certification.certify import CertifyOptions, certify_document
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import reader_of
from pidcfg.text.source import read_document
from pidcfg.tuning.margins import finite_or_none
from pidcfg.tuning.robust import RobustTuning, Search, find_robust_gains, in_other_unit
from pidcfg.tuning.rules import SEED, Spread, plants_of, read_spreads, spread_of
from pidcfg.tuning.sampled import Sampling, absolute_error, default_sample_time
from pidcfg.validate.engine import check_document

if TYPE_CHECKING:
    from pidcfg.output.process import KnownProcess, Robustness, Target
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Limits
    from pidcfg.tuning import Form
    from pidcfg.tuning.identify import Identification
    from pidcfg.tuning.rules import Method, Model, Process
    from pidcfg.vendors import Vendor

# ----------------------------------------------------------------------------------------------------------------------
# Robust gains tried by `certify`: the virtual PLC with the loop alone, and samples of the plants that it is for.

IAE_ALLOWANCE, PV_COUNT_ALLOWANCE, FULL_COUNTS = 1.1, 2.0, 4095
"""Of the IAE: what the words of PV and output, and the time of the step, may add; and counts of the PV all the time."""
LOAD_STEP_SHARE, RESTING_OUTPUT_SHARE, MAX_RESTING_OUTPUT = 0.1, 0.5, 0.85
"""Of the output's range: the step of the load, where the output rests on the process itself, and on no plant beyond."""
RUN_LENGTH_FACTOR = 15.0
"""Times all times of loop and process: how long a run lasts."""
NEUTRAL_VENDOR = "generic"
LOOP_TEMPLATE = """pidcfg: 1
vendor: generic
loops:
  - name: LOOP
    mode: auto
    output_raises_pv: true
    sample_time: {sample!r}
    tuning: {{gain: {gain!r}, integral_time: {integral!r}, derivative_time: {rate!r}, derivative_filter: {lag!r}}}
    pv: {{range: [0, {pv!r}], filter: {filter!r}}}
    setpoint: {{value: {middle!r}}}
    output: {{range: [0, {output!r}], limits: [0, {output!r}]}}
"""
SCENARIO_TEMPLATE = """pidcfg: 1
scenario: A step of the load
config: loop.yaml
duration: {duration!r}
initial: steady
plants:
  LOOP: {{{plant}, load: {load!r}, initial: {middle!r}}}
vary:
  seed: {seed}
  plants:
    LOOP: {{{varies}}}
events:
  - {{at: {at!r}, loop: LOOP, disturb: {{load: {more!r}}}}}
expect:
  - {{loop: LOOP, metric: iae, max: {most!r}}}
"""
FILE_NAMES = ("loop.yaml", "loop.scenario.yaml")


@frozen
class Confirmation:
    """How many samples have an IAE below a limit; shares in %."""

    plc: str
    samples: int
    held_count: int
    bound: float
    limit: float
    max_iae: float | None

    @property
    def passed(self) -> bool:
        """Whether all have."""
        return self.held_count == self.samples

    def to_json(self) -> Data:
        """Under ``robust.certified``."""
        return {
            "plc": self.plc,
            "samples": self.samples,
            "held": self.held_count,
            "at_least_percent": self.bound,
            "iae_limit": self.limit,
            "iae_max": self.max_iae,
            "passed": self.passed,
        }


def confirm_gains(
    tuning: RobustTuning, process: Process, vendor: Vendor | None, loop: LoopTuning | None, samples: int, limits: Limits
) -> Confirmation | None:
    """What `certify` says of the gains; None: nothing varies, or the loop does not run in its virtual PLC."""
    if not tuning.spreads or (process.integrating and process.second_time_constant):
        return None
    output = 100.0 if loop is None or loop.output_span is None else float(loop.output_span)
    pv = process.gain * output if loop is None or loop.pv_span is None else float(loop.pv_span)
    text = _loop_text(tuning, pv, output)
    plc, config = _convert_loop(text, vendor, limits)
    scenario, iae_limit = _scenario_text(tuning, process, pv, output)
    files = {FILE_NAMES[0]: config, FILE_NAMES[1]: scenario.encode()}
    doc = read_document(files[FILE_NAMES[1]], FILE_NAMES[1], limits)
    certification = certify_document(doc, CertifyOptions(samples, SEED, keep_worst=0), reader_of(files)).certification
    if certification is None:
        return None
    (expectation,) = certification.expectations
    max_iae = certification.metrics["LOOP"]["iae"]["max"]
    held_count = min(expectation.held, certification.all_passed)
    return Confirmation(plc, samples, held_count, expectation.bound, iae_limit, max_iae)


def _loop_text(tuning: RobustTuning, pv: float, output: float) -> str:
    """The loop in the neutral form."""
    gains, sampling = tuning.result.gains, tuning.search.sampling
    seconds = sampling.sample_time
    limit = sampling.derivative_limit
    lag = _filter_time(sampling.derivative_share, seconds) if limit is None else gains.derivative_time / limit
    return LOOP_TEMPLATE.format(
        sample=seconds,
        gain=gains.gain,
        integral=gains.integral_time,
        rate=gains.derivative_time,
        lag=lag if gains.derivative_time else 0.0,
        pv=pv,
        filter=_filter_time(sampling.pv_share, seconds),
        middle=pv / 2,
        output=output,
    )


def _filter_time(share: float, seconds: float) -> float:
    """The time constant of a filter that takes a share of each difference."""
    return 0.0 if share >= 1 else -seconds / log(1 - share)


def _convert_loop(text: str, vendor: Vendor | None, limits: Limits) -> tuple[str, bytes]:
    """The loop as a file of a PLC, with its name; the neutral form where the PLC cannot have it alone."""
    neutral = text.encode()
    if vendor is not None and vendor.key != NEUTRAL_VENDOR:
        checked = check_document(read_document(neutral, FILE_NAMES[0], limits))
        result = convert_checked(checked, vendor, {}, None)
        if result.text and result.ok:
            return vendor.key, result.text.encode()
    return NEUTRAL_VENDOR, neutral


def _scenario_text(tuning: RobustTuning, process: Process, pv: float, output: float) -> tuple[str, float]:
    """The scenario, and the largest IAE that is expected."""
    lowest_gain = next((spread.low for spread in tuning.spreads if spread.name == "gain"), process.gain)
    resting_output = output * min(RESTING_OUTPUT_SHARE, MAX_RESTING_OUTPUT * lowest_gain / process.gain)
    load_step = min(LOAD_STEP_SHARE * output, resting_output / 2) * process.gain
    gains, search = tuning.result.gains, tuning.search
    sampling, plants = search.sampling, search.plants
    total_time = gains.integral_time + process.time_constant + process.second_time_constant + process.dead_time
    duration = ceil(RUN_LENGTH_FACTOR * total_time / sampling.sample_time) * sampling.sample_time
    errors = (
        absolute_error(gains, curve.plant, sampling) / plant.gain
        for curve, plant in zip(search.curves, plants, strict=True)
    )
    iae_limit = IAE_ALLOWANCE * load_step * max(errors) + PV_COUNT_ALLOWANCE * pv / FULL_COUNTS * duration
    load = (0.0 if process.integrating else pv / 2) - process.gain * resting_output
    text = SCENARIO_TEMPLATE.format(
        duration=duration,
        plant=_plant_text(process),
        load=load,
        middle=pv / 2,
        seed=SEED,
        varies=", ".join(f"{_vary_key(s.name, process)}: {{uniform: [{s.low!r}, {s.high!r}]}}" for s in tuning.spreads),
        at=2 * sampling.sample_time,
        more=load + load_step,
        most=iae_limit,
    )
    return text, iae_limit


def _plant_text(process: Process) -> str:
    """The process as a scenario has it."""
    if process.integrating:
        return f"model: integrator, gain: {process.gain!r}, dead_time: {process.dead_time!r}"
    common = f"gain: {process.gain!r}, dead_time: {process.dead_time!r}"
    if process.second_time_constant:
        times = f"[{process.time_constant!r}, {process.second_time_constant!r}]"
        return f"model: second_order, time_constants: {times}, {common}"
    return f"model: first_order, time_constant: {process.time_constant!r}, {common}"


def _vary_key(name: str, process: Process) -> str:
    """A number of the process as ``vary`` names it."""
    if not process.second_time_constant:
        return name
    return {"time_constant": "time_constants.0", "second_time_constant": "time_constants.1"}.get(name, name)


# ----------------------------------------------------------------------------------------------------------------------
# Gains by the method robust: for a loop of a file, for a PLC, or as real numbers; and what holds on which plants.

PERCENT_RANGE = (0.0, 100.0)
"""The range of a PV in % of its span."""


@frozen
class RobustGains:
    """What holds on which plants."""

    tuning: RobustTuning
    sampling: Sampling
    assumptions: tuple[str, ...]
    """What nobody said."""
    confirmation: Confirmation | None = None
    """What `certify` says; None: it was not asked, or cannot run this."""
    is_negative: bool = False
    """Whether the process's gain is; those of the plants are amounts."""

    @property
    def worst_ms_plant(self) -> Process:
        """The plant with the largest Ms."""
        return self.tuning.search.plants[self.tuning.result.worst_ms]

    @property
    def worst_iae_plant(self) -> Process:
        """The plant with the largest IAE."""
        return self.tuning.search.plants[self.tuning.result.worst_error]

    def to_json(self) -> Data:
        """Of the result's JSON, under ``robust``."""
        tuning, sampling = self.tuning, self.sampling
        result, real = tuning.result, tuning.real
        margins = tuning.search.margins(result.gains, result.worst_ms)
        return {
            "ms_limit": tuning.ms_limit,
            "plants": tuning.plants,
            "varies": {s.name: {"low": s.low, "high": s.high} for s in tuning.spreads},
            "sample_time": sampling.sample_time,
            "pv_share": sampling.pv_share,
            "worst_ms": result.ms,
            "worst_ms_plant": numbers_of(self.worst_ms_plant),
            "gain_margin": finite_or_none(margins.gain_margin),
            "phase_margin": finite_or_none(margins.phase_margin),
            "worst_iae": result.error,
            "worst_iae_plant": numbers_of(self.worst_iae_plant),
            "every_word": tuning.is_exhaustive if tuning.has_words else None,
            "real": {**asdict(real.gains), "worst_iae": real.error, "worst_ms": real.ms},
            "cost_percent": round(tuning.cost_percent, 4),
            "assumed": list(self.assumptions),
            "certified": None if self.confirmation is None else self.confirmation.to_json(),
        }


def numbers_of(process: Process) -> dict[str, float]:
    """The numbers of a plant that it has."""
    keys = ("gain", "time_constant", "second_time_constant", "dead_time")
    own_keys = [key for key in keys if getattr(process, key) and not (process.integrating and key == "time_constant")]
    names = {"second_time_constant": "time_constant_2"}
    return {names.get(key, key): getattr(process, key) for key in own_keys}


@frozen
class SearchResult:
    """The gains that were found, and where they go."""

    form: Form
    model: Model
    process: Process
    """As given, with the sample time of the loop."""
    robust: RobustGains
    loop: LoopTuning | None
    target: Target


def search_gains(
    method: Method,
    form: Form | None,
    facts: KnownProcess,
    fit: Identification | None,
    target: Target,
    limits: Limits,
) -> SearchResult:
    """The gains that robust finds; raises `ArgumentError` and `TuningError` as the rules do."""
    robustness = facts.robustness
    if robustness is None:
        raise AssertionError("robust says what it wants")
    if facts.transfer is not None:
        raise ArgumentError("robust needs the numbers of the process, not `transfer`", "transfer")
    chosen_form: Form = form or "PI"
    if chosen_form not in method.forms:
        raise ArgumentError(f"{method.name} has no rule for {form}; it has {' and '.join(method.forms)}")
    model = model_of(method, facts)
    refuse_missing(method, {key: v for key, v in facts.numbers.items() if key != "sample_time"}, model)
    process = replace(process_of(facts.numbers, model), sample_time=0.0)
    negative = facts.numbers["gain"] < 0
    spreads = spreads_of(robustness, process, fit, negative=negative)
    vendor, loop, target, assumptions = _target_loop(target, limits)
    sampling, sampling_notes = _loop_sampling(facts, process, loop, target)
    _refuse_fast_sampling(sampling, process)
    plants = plants_of(process, spreads)

    def search_for(loop: LoopTuning | None) -> RobustTuning:
        search = Search(plants, sampling, robustness.ms, derivative=chosen_form == "PID")
        return find_robust_gains(chosen_form, search, loop, None if vendor is None else vendor.model, spreads)

    tuning = search_for(loop)
    minutes_loop = None if vendor is None or loop is None else _loop_in_minutes(tuning, vendor, loop)
    if minutes_loop is not None and target.file is not None:
        sampling_notes = (
            *sampling_notes,
            "the reset stays in seconds, of which its word is at the end; `reset_unit: minutes` has more",
        )
    elif minutes_loop is not None and (minutes_result := search_for(minutes_loop)).result.error < tuning.result.error:
        tuning, loop = minutes_result, minutes_loop
    confirmation = None
    if robustness.samples:
        confirmation = confirm_gains(tuning, process, vendor, loop, robustness.samples, limits)
    gains = RobustGains(tuning, sampling, (*assumptions, *sampling_notes), confirmation, negative)
    return SearchResult(chosen_form, model, replace(process, sample_time=sampling.sample_time), gains, loop, target)


def spreads_of(robustness: Robustness, process: Process, fit: Identification | None, *, negative: bool) -> list[Spread]:
    """What varies: as it is said, and of an identified process all else within its confidence."""
    given_spreads = [] if robustness.vary is None else read_spreads(robustness.vary, process, negative=negative)
    if fit is None:
        return given_spreads
    names = {spread.name for spread in given_spreads}
    spreads = list(given_spreads)
    for name, confidence in zip(("gain", "time_constant", "dead_time"), fit.confidence, strict=True):
        middle = getattr(process, name)
        if name in names or not confidence or (name == "time_constant" and process.integrating):
            continue
        low = middle - confidence if middle > confidence else middle * MIN_LOW_SHARE
        spreads.append(spread_of(name, low, middle + confidence, process))
    return spreads


MAX_DEAD_TIME_SAMPLES = 1000
"""Samples: a run of more would not come to rest within the samples that are looked at."""


def _refuse_fast_sampling(sampling: Sampling, process: Process) -> None:
    """Raises `ArgumentError` for a loop that samples the dead time so often that the search would not end."""
    samples = process.dead_time / sampling.sample_time
    if samples > MAX_DEAD_TIME_SAMPLES * (1 + MIN_LOW_SHARE):
        raise ArgumentError(
            f"`sample_time` {sampling.sample_time:g} s divides the dead time {process.dead_time:g} s by "
            f"{samples:,.0f}; robust searches up to {MAX_DEAD_TIME_SAMPLES:,}: let the loop sample every "
            f"{process.dead_time / MAX_DEAD_TIME_SAMPLES:.3g} s or slower, which costs next to nothing",
            "sample_time",
        )


MIN_LOW_SHARE = 0.01
"""Of a number that its confidence does not tell from 0."""


def _target_loop(target: Target, limits: Limits) -> tuple[Vendor | None, LoopTuning | None, Target, tuple[str, ...]]:
    """The loop that is to hold the gains, and what is assumed of it."""
    if target.file is not None:
        from pidcfg.output.retune import loop_tuning

        target.refuse_ranges()
        return *loop_tuning(target, target.file, limits), target, ()
    assumptions: tuple[str, ...] = ()
    if target.vendor is None:
        return None, None, target, assumptions
    vendor = target.vendor
    words = tables_of(vendor).TUNING_NUMBERS
    if target.pv_range is None and words.gain_unit == "span":
        assumptions = ("the gain is in % of the PV's span per % of the output; --pv-range says another",)
        target = replace(target, pv_range=PERCENT_RANGE, output_range=target.output_range or PERCENT_RANGE)
    target.refuse_ranges()
    spans = [
        Decimal(str(high)) - Decimal(str(low))
        for low, high in (target.pv_range or (0, 1), target.output_range or PERCENT_RANGE)
    ]
    return vendor, LoopTuning(words, pv_span=spans[0], output_span=spans[1]), target, assumptions


NEAR_LIMIT_SHARE = 0.9
"""Of the longest time that a word holds."""


def _loop_in_minutes(tuning: RobustTuning, vendor: Vendor, loop: LoopTuning) -> LoopTuning | None:
    """The loop with its integral time in min, where the gains that were found use up what it holds in s."""
    limits, minutes_loop = loop.words.limits(vendor.model, loop.words.names[1]), in_other_unit(loop)
    if minutes_loop is None or loop.minutes or limits is None or limits.high is None:
        return None
    return minutes_loop if tuning.result.gains.integral_time >= NEAR_LIMIT_SHARE * float(limits.high) else None


def _loop_sampling(
    facts: KnownProcess, process: Process, loop: LoopTuning | None, target: Target
) -> tuple[Sampling, tuple[str, ...]]:
    """How the loop samples and filters, and what is assumed of it."""
    given_time = facts.numbers.get("sample_time")
    if loop is not None and loop.sample_time is not None:
        refuse_other_sample_time(given_time, loop.sample_time, None if target.file is None else target.file.name)
        shares = (loop.pv_share, loop.derivative_share, loop.derivative_limit)
        return Sampling(loop.sample_time, *shares), ()
    if given_time is not None:
        return Sampling(given_time), ()
    seconds = default_sample_time(process)
    return Sampling(seconds), (f"the loop samples every {seconds:g} s; --sample-time says another",)
