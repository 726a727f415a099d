"""Gains put into a loop of a configuration: what changes in the file, what rules find, and what the words do then."""

from __future__ import annotations

from dataclasses import replace
from decimal import Context, Decimal
from functools import partial
from math import ceil, isclose, isinf, log
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.contract import encoder_of
from pidcfg.output.arguments import ArgumentError
from pidcfg.output.findings import CheckSettings, check_loaded, errors_in, finding_data
from pidcfg.schemas.base import DURATION, SECONDS, UNIT_WORDS, units_of
from pidcfg.schemas.numbers import decimal_text
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.plc import CONTROL_MODES, TICKS
from pidcfg.sim.engine.run import Run, Settings, UnusableError, base_step, begin_run, plc_options
from pidcfg.sim.judgement.meters import Band, overshoot, settling_time
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import parse_path, value_at
from pidcfg.text.signs import closest_name
from pidcfg.text.source import read_document
from pidcfg.tuning.margins import Answer
from pidcfg.tuning.robust import SIGNIFICANT_DIGITS, fit_in_other_unit, fit_loop
from pidcfg.tuning.rules import TuningError
from pidcfg.validate.engine import check_document
from pidcfg.validate.fixes import PlacingError, replace_values

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from pidcfg.encoders.regmap import LoopTuning
    from pidcfg.output.process import GainsFile, Target
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data, Path
    from pidcfg.text.reader import Limits, Reader
    from pidcfg.tuning.robust import FittedNumber
    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.transfer import Transfer
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

SPAN_TOLERANCE = 1e-9
LAST_DIGIT_TOLERANCE = 10.0 ** (1 - SIGNIFICANT_DIGITS)
"""Relative difference of numbers that are the same to all their digits."""


@frozen
class FileNumber:
    """One of the three numbers in the file: its key, how it was written (None: not at all), and how it is now."""

    key: str
    unit: str
    old: str | None
    new: str | None

    @property
    def is_changed(self) -> bool:
        """Whether the file says it otherwise now."""
        return self.old != self.new


@frozen
class RetunedFile:
    """A configuration with the gains in one of its loops."""

    file: str
    loop: str
    vendor: Vendor
    before: bytes
    data: bytes
    """The file with the gains; the same bytes where it holds them already."""
    values: tuple[FileNumber, ...]
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
        values = [
            {"key": v.key, "unit": v.unit, "old": v.old, "new": v.new, "changes": v.is_changed} for v in self.values
        ]
        return {
            "file": self.file,
            "loop": self.loop,
            "ok": self.ok,
            "action_compared": self.action is not None,
            "values": values,
            "findings": [finding_data(d) for d in self.findings],
        }


def retune_loop(
    gains: Gains, target: Target, file: GainsFile, limits: Limits, *, heating: bool | None
) -> tuple[RetunedFile, list[FittedNumber]]:
    """The file with the gains of a rule in a loop, and the three numbers as the loop holds them.

    Raises `ArgumentError` for a loop that is not there and ranges that contradict the file, `TuningError` for a file
    that cannot be read, a loop that the gains are not for, and a number that does not fit.
    """
    doc = read_document(file.data, file.name, limits)
    checked_file = check_document(doc)
    vendor, index = _loop_of(checked_file, file)
    if target.vendor is not None and target.vendor is not vendor:
        raise ArgumentError(f"`vendor` is {target.vendor.key}, and {file.name} is for {vendor.key}", "vendor")
    config: Any = checked_file.config
    name, tuning = config.loops[index].name, encoder_of(vendor).tuning_of(config, config.loops[index])
    label = f"{file.name}: {name}"
    _refuse_loop(label, gains, tuning, heating=heating)
    tuning = _with_ranges(label, tuning, target)
    fits = fit_loop(gains, vendor.model, tuning)
    problems = [f"{value.key}: {value.problem}" for value in fits if value.problem is not None]
    if problems:
        refit = fit_in_other_unit(gains, vendor.model, tuning, fits[1])
        if refit is not None:
            unit, held = ("minutes" if refit.unit == "min" else "seconds", decimal_text(refit.stored or refit.wanted))
            problems.append(f"with `reset_unit: {unit}` it is {held} {refit.unit}")
        raise TuningError(f"{label}: {'; '.join(problems)}; nothing was written")
    values = _file_numbers(label, doc, index, gains, tuning, fits)
    data = _write_values(label, doc, file.data, index, values)
    new_doc = read_document(data, file.name, limits)
    findings = _findings_after(doc, new_doc, name, file.reader)
    action = None if heating is None else tuning.words.heating if heating else tuning.words.cooling
    return RetunedFile(file.name, name, vendor, file.data, data, values, new_doc, findings, action), fits


def loop_tuning(target: Target, file: GainsFile, limits: Limits) -> tuple[Vendor, LoopTuning]:
    """The vendor of a file, and how its loop holds its gains; raises as `retune_loop` does."""
    checked_file = check_document(read_document(file.data, file.name, limits))
    vendor, index = _loop_of(checked_file, file)
    config: Any = checked_file.config
    loop = config.loops[index]
    return vendor, _with_ranges(f"{file.name}: {loop.name}", encoder_of(vendor).tuning_of(config, loop), target)


def _loop_of(checked: Checked, file: GainsFile) -> tuple[Vendor, int]:
    """The vendor of a file, and the place of the loop."""
    vendor, config = checked.vendor, checked.config
    if vendor is None or config is None:
        (first, *more) = [d for d in checked.findings if d.severity is Severity.ERROR]
        more_text = f", and {len(more)} more" if more else ""
        location = f"{file.name}:{first.span.line}:{first.span.column}"
        raise TuningError(
            f"{location}: {first.message} ({first.code}{more_text}); correct the file first, nothing was written"
        )
    names = [loop.name for loop in config.loops]
    if not names:
        raise TuningError(f"{file.name} has no loop; nothing was written")
    loop_names = ", ".join(names)
    if file.loop is None:
        if len(names) > 1:
            raise ArgumentError(f"{file.name} has several loops, say which with `loop`: {loop_names}", "loop")
        return vendor, 0
    if names.count(file.loop) != 1:
        nearest = closest_name(file.loop, names)
        suggestion = f"; did you mean {nearest}?" if nearest and nearest != file.loop else ""
        raise ArgumentError(f"`loop` {file.loop!r}: {file.name} has {loop_names}{suggestion}", "loop")
    return vendor, names.index(file.loop)


def _refuse_loop(label: str, gains: Gains, tuning: LoopTuning, *, heating: bool | None) -> None:
    """Raises `TuningError` for a loop that would not act as the rule means."""
    obstacle = tuning.obstacle or (tuning.no_derivative if gains.derivative_time else "")
    if obstacle:
        raise TuningError(f"{label}: {obstacle}, which the gains are not for; nothing was written")
    if heating is None or tuning.raises_pv is None or heating is tuning.raises_pv:
        return
    action = tuning.words.heating if heating else tuning.words.cooling
    sign = "positive: the PV rises" if heating else "negative: the PV falls"
    raise TuningError(
        f"{label}: the process's gain is {sign} with the output, which needs action {action}, and the loop has the "
        "other one; correct the action, or the sign of the gain; nothing was written"
    )


def _with_ranges(label: str, tuning: LoopTuning, target: Target) -> LoopTuning:
    """With the spans that are given, where the file does not say them."""
    sides = ("pv_range", target.pv_range, tuning.pv_span), ("output_range", target.output_range, tuning.output_span)
    for name, given_range, file_span in sides:
        span = None if given_range is None else Decimal(str(given_range[1])) - Decimal(str(given_range[0]))
        if span is None or tuning.words.gain_unit == "engineering":
            continue
        if file_span is not None and not isclose(file_span, span, rel_tol=SPAN_TOLERANCE):
            widths = f"{decimal_text(span)} wide, and that of {label} {decimal_text(file_span)}"
            raise ArgumentError(f"`{name}` is {widths}: leave it out", name)
        tuning = replace(tuning, pv_span=span) if name == "pv_range" else replace(tuning, output_span=span)
    if tuning.words.gain_unit == "span" and tuning.pv_span is None:
        message = f"{label} has no pv.range, and its gain is a share of it: add it to the loop, or give `pv_range`"
        raise ArgumentError(message, "pv_range")
    return tuning


def _file_numbers(
    label: str, doc: Document, index: int, gains: Gains, tuning: LoopTuning, fits: list[FittedNumber]
) -> tuple[FileNumber, ...]:
    """How the file says the three numbers, before and after; what it says already stays as it is written."""
    numbers = []
    integral, derivative = tuning.off_texts
    off_texts = (None, integral if isinf(gains.integral_time) else None, None if gains.derivative_time else derivative)
    for name, value, current, text in zip(tuning.words.names, fits, tuning.current_values, off_texts, strict=True):
        old = value_at(doc.data, _loop_path(index, value.key))
        if current is None:
            raise TuningError(f"{label}: {value.key} is the expression {old}: change it there; nothing was written")
        stored = value.stored or Decimal(0)
        round_to_stored = partial(tuning.words.stored_value, name)
        new = old if current == stored else text or format_like(old, stored, value.unit, round_to_stored)
        numbers.append(FileNumber(value.key, value.unit, old, None if new is None else str(new)))
    return tuple(numbers)


def format_like(old: str | None, value: Decimal, unit: str, round_to_stored: Callable[[Decimal], Decimal]) -> str:
    """A number as the file writes it: in the unit that stood there, with the fewest digits that make the same word."""
    match = DURATION.fullmatch(old or "")
    if match is None or unit not in SECONDS:
        return decimal_text(value)
    factor = SECONDS[UNIT_WORDS.get(match[2], match[2])] / SECONDS[unit]
    gap = " " if " " in match[0] else ""
    for digits in range(1, SIGNIFICANT_DIGITS + 1):
        number = Context(digits).divide(value, factor)
        try:
            stored_value = round_to_stored(number * factor)
        except EncodeError:
            continue
        if isclose(stored_value, value, rel_tol=LAST_DIGIT_TOLERANCE):
            return f"{decimal_text(number)}{gap}{match[2]}"
    return decimal_text(value)


def _loop_path(index: int, key: str) -> Path:
    return ("loops", index, *parse_path(key))


def _write_values(label: str, doc: Document, data: bytes, index: int, values: tuple[FileNumber, ...]) -> bytes:
    """The bytes of the file with the values that change."""
    paths = [_loop_path(index, value.key) for value in values]
    texts = {path: value.new for path, value in zip(paths, values, strict=True) if value.is_changed and value.new}
    predecessors: Mapping[Path, Path] = dict(zip(paths[1:], paths, strict=False))
    if not texts:
        return data
    try:
        return replace_values(data, doc, texts, _present_predecessors(doc, predecessors))
    except PlacingError as error:
        numbers = ", ".join(f"{value.key}: {value.new}" for value in values if value.is_changed)
        raise TuningError(
            f"{label}: {error} (line {error.line}); write {numbers} by hand, there or in the loop itself"
        ) from None


def _present_predecessors(doc: Document, predecessors: Mapping[Path, Path]) -> dict[Path, Path]:
    """The key that each goes behind, past those that are missing and stay so."""
    anchors = {}
    for path, predecessor in predecessors.items():
        anchor = predecessor
        while value_at(doc.data, anchor) is None and anchor in predecessors:
            anchor = predecessors[anchor]
        anchors[path] = anchor
    return anchors


def _findings_after(before: Document, after: Document, loop: str, reader: Reader) -> tuple[Diagnostic, ...]:
    """What is found at the loop after the change, and what is new elsewhere."""
    old_findings = {(d.code, d.where, d.message) for d in check_loaded(before, reader, CheckSettings()).findings}
    new_findings = check_loaded(after, reader, CheckSettings()).findings
    return tuple(
        d
        for d in new_findings
        if d.loop == loop or loop in d.with_loops or (d.code, d.where, d.message) not in old_findings
    )


# --- What the words of a loop do on its process: a step of the set point and one of the load, on the virtual PLC ------

STEP_SHARE, MIN_STEP_COUNTS = 0.1, 40
"""Of the PV's range, and counts of the PV at least: how far the set point steps."""
MIN_COUNT_RANGE = 1000
"""An output with such a range may be one of counts, and rests at a whole one."""
MAX_MOVE_SHARE = 0.7
"""Of the way from the middle of the output to its limits, that the first move of a step may take."""
LENGTH_FACTOR = 12
"""Times the slowest time of loop and process: how long each of the two steps is looked at."""
MAX_LOOP_STEPS = 150_000
"""Of a run: more take too long, and a loop that samples so often is as good as a continuous one."""
MAX_ATTEMPTS, STEP_SHRINK_FACTOR = 3, 0.9
"""Runs with a shorter step where the output meets a limit, each of this part of what it would take."""
HUNTING_SHARE = 0.05
"""Of the IAE, that the error of the second half, were it all the time, would make."""
CHUNKS_PER_STEP = 8
"""At a step, from its beginning to its end."""
SETTLING_BAND_SHARE = 0.05
"""Of the step: within which a PV has settled."""
RANGE_MARGIN_SHARE, MIN_STEP_SHARE, UNLIMITED_RANGE = 0.5, 0.01, 1e5
"""Of a range: how far beside it all of a record's PV is in other units, and the least step of an output in its own; and
a range that is none."""
KNOWN_UNITS = {
    **dict.fromkeys(("c", "°c", "℃", "degc", "deg c", "celsius"), "degC"),
    **dict.fromkeys(("f", "°f", "℉", "degf", "deg f", "fahrenheit"), "degF"),
    **dict.fromkeys(("k", "degk", "kelvin"), "K"),
    **dict.fromkeys(("%", "percent", "pct"), "%"),
    **{unit.casefold(): unit for unit in ("mA", "V", "Pa", "kPa", "mbar", "bar", "psi")},
}
"""Units of which two are surely not the same, by their spellings."""


@frozen
class LoopConditions:
    """What of a loop gains are made for."""

    sample_time: float | None
    """In s; None: no file says it."""
    filter_time: float
    """The time constant of the PV's filter, in s; 0: there is none."""
    action: str | None
    """None: a program decides."""
    output_span: float = 100.0
    """Of the output from 0 to 100 %, in the unit that gains are per."""

    @classmethod
    def from_loop(cls, loop: LoopTuning) -> LoopConditions:
        """Of a loop as its file holds it."""
        pv_share, seconds, raises_pv = loop.pv_share, loop.sample_time, loop.raises_pv
        is_filtered = seconds is not None and 0 < pv_share < 1
        action = None if raises_pv is None else loop.words.heating if raises_pv else loop.words.cooling
        lag = -(seconds or 0.0) / log(1 - pv_share) if is_filtered else 0.0
        return cls(seconds, lag, action, 100.0 if loop.output_span is None else float(loop.output_span))


@frozen
class Forecast:
    """What a run of the words shows, or why there is none."""

    why: str = ""
    """Why nothing ran; empty: it did."""
    answer: Answer | None = None
    step: tuple[float, float] = (0.0, 0.0)
    """The set point before and after."""
    largest_step: float = 0.0
    """A step of the set point up to which the output stays within its limits."""
    settles: bool = True
    final_error: float = 0.0
    """How far from its set point the PV is in the end, on average."""
    hunts: bool = False
    """That counts in the IAE, which grows with the length of a run."""
    pv_range: tuple[float, float] = (0.0, 0.0)
    limits: tuple[float, float] = (0.0, 0.0)
    """Of the output."""

    def to_json(self) -> Data:
        """Under ``forecast``."""
        if self.why:
            return {"of": "continuous loop", "why": self.why}
        return {
            "of": "words",
            "why": None,
            "setpoint": list(self.step),
            "largest_step": self.largest_step,
            "settles": self.settles,
            "hunts": self.hunts,
            "error_at_the_end": self.final_error,
            "pv_range": list(self.pv_range),
            "output_limits": list(self.limits),
        }

    def warnings(self) -> Iterator[str]:
        """What an engineer has to know."""
        if not self.why and not self.settles:
            yield "with these words the PV does not settle"


class RecordScale(NamedTuple):
    """The numbers of a record, which must be in the units of the loop that is to have its gains."""

    file: str
    pv: tuple[float, float]
    """Lowest and highest."""
    step: float
    """Of the output."""
    units: tuple[str, str] = ("", "")
    """Of output and PV, as the headers say."""

    def refuse_other_units(
        self, label: str, pv_range: tuple[float, float], output_span: float, units: Mapping[str, str]
    ) -> None:
        """Raises `TuningError` for numbers that are surely in other units: their gain would be wrong by as much."""
        if difference := self._unit_contradiction(units) or self._range_contradiction(pv_range, output_span):
            raise TuningError(
                f"{label}: {self.file} is in other units: {difference}; bring the record to the units of the loop "
                "(counts or shares of 1 may have been recorded); nothing was written"
            )

    def _unit_contradiction(self, units: Mapping[str, str]) -> str:
        """What the headers say that the loop contradicts."""
        for side, unit in zip(("output", "pv"), self.units, strict=True):
            record_unit, loop_unit = (KNOWN_UNITS.get(text.casefold()) for text in (unit, units.get(side, "")))
            if record_unit and loop_unit and record_unit != loop_unit:
                return (
                    f"its header has {unit} for the {'PV' if side == 'pv' else side}, which is in {units[side]} there"
                )
        return ""

    def _range_contradiction(self, pv_range: tuple[float, float], output_span: float) -> str:
        """What lies far beside the loop's ranges."""
        low, high = pv_range
        margin = (high - low) * RANGE_MARGIN_SHARE
        if high - low < UNLIMITED_RANGE and (self.pv[0] > high + margin or self.pv[1] < low - margin):
            return f"the PV goes from {self.pv[0]:.6g} to {self.pv[1]:.6g}, and its range there is {low:g} to {high:g}"
        if output_span < UNLIMITED_RANGE and not MIN_STEP_SHARE <= self.step / output_span <= 1 + RANGE_MARGIN_SHARE:
            share = f"{100 * self.step / output_span:.3g} % of the {output_span:g} that it has there"
            return f"the output steps by {self.step:.6g}, {share}"
        return ""


def forecast_words(
    retuned: RetunedFile,
    conditions: LoopConditions,
    plant: Transfer | None,
    gains: Gains,
    scale: RecordScale | None = None,
) -> Forecast:
    """What the words do on a process, whose gain has its sign; raises `TuningError` for a record in other units."""
    if plant is None:
        return Forecast("the gain of the process is not known")
    if plant.zeros:
        return Forecast("a transfer function with zeros is no plant of a run")
    checked = check_document(retuned.document)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.is_complete:
        return Forecast(f"{retuned.file} has errors")
    controller, image = checked.vendor.module("controller"), checked.encoding.image
    trial = Trial(controller.load(image), retuned.loop, conditions, plant, gains)
    if scale is not None:
        label = f"{retuned.file}: {retuned.loop}"
        units = units_of(checked.config.loops[trial.index])
        scale.refuse_other_units(label, (trial.pv_low, trial.pv_high), (trial.high - trial.low) * trial.unit, units)
    forecast = _run_trial(trial, controller, image)
    for _ in range(MAX_ATTEMPTS):
        if forecast.why or not trial.shorten_step(forecast):
            break
        forecast = _run_trial(trial, controller, image)
    return forecast


def _run_trial(trial: Trial, controller: Any, image: object) -> Forecast:
    """What one run shows."""
    try:
        scenario = Scenario.model_validate(trial.scenario())
        steps = trial.steps(base_step(scenario, trial.plc))
        if steps * len(trial.plc.loops) > MAX_LOOP_STEPS:
            return Forecast(f"a run of {steps:,} steps would take too long")
        run = begin_run(
            scenario, lambda: controller.load(image, plc_options(scenario, controller)), controller, RUN_SETTINGS
        )
    except (ValidationError, UnusableError) as error:
        return Forecast(f"the loop does not run alone: {str(error).splitlines()[0]}")
    return trial.measure(run)


RUN_SETTINGS = Settings(with_verdicts=False, with_reference=False)


class Trial:
    """A loop alone with its process: from rest, a step of its set point, and then one at its output."""

    def __init__(self, plc: Plc, loop: str, conditions: LoopConditions, plant: Transfer, gains: Gains) -> None:
        self.plc, self.loop, self.index = plc, loop, plc.loops.index(loop)
        output_scale = plc.out_ranges[self.index] if plc.out_ranges else (0.0, conditions.output_span)
        self.unit = conditions.output_span / abs(output_scale[1] - output_scale[0])
        self.plant = replace(plant, gain=plant.gain * self.unit)
        self.gains = replace(gains, gain=gains.gain / self.unit)
        self.low, self.high = plc.output_limits(self.index, plc.signal_values)
        self.pv_low, self.pv_high, counts = plc.scales[self.index]
        span, middle = self.pv_high - self.pv_low, (self.low + self.high) / 2
        self.resting_output = middle if self.high - self.low < MIN_COUNT_RANGE else float(round(middle))
        self.load_step = STEP_SHARE * (self.high - self.low)
        headroom = MAX_MOVE_SHARE * (self.high - self.low) / 2
        max_step = headroom / max(self.gains.gain, 0.0 if plant.integrators else 1 / abs(self.plant.gain))
        self.min_step = MIN_STEP_COUNTS * span / counts
        self.step = max(min(STEP_SHARE * span, max_step), self.min_step)
        self.first_setpoint = (self.pv_high + self.pv_low - self.step) / 2

    def shorten_step(self, forecast: Forecast) -> bool:
        """Takes a smaller step where the output met a limit; whether there is one."""
        shorter = max(forecast.largest_step * STEP_SHRINK_FACTOR, self.min_step)
        if forecast.largest_step >= self.step or shorter >= self.step:
            return False
        self.step, self.first_setpoint = shorter, (self.pv_high + self.pv_low - shorter) / 2
        return True

    def part_length(self) -> float:
        """How long each part lasts, in s, in whole samples."""
        plant, gains = self.plant, self.gains
        times = [*plant.poles, plant.dead_time, gains.derivative_time]
        if not isinf(gains.integral_time):
            loop_gain = abs(plant.gain * gains.gain)
            times += [gains.integral_time, (1 if plant.integrators else gains.integral_time) / loop_gain]
        seconds = self.plc.configs[self.index].period / TICKS
        return float(ceil(LENGTH_FACTOR * max(times) / seconds + LENGTH_FACTOR) * seconds)

    def steps(self, step: int) -> int:
        """Base steps of the whole run, each so many ticks."""
        return ceil(3 * self.part_length() * TICKS / step)

    def scenario(self) -> Data:
        """As a file would have it."""
        length, load = self.part_length(), self._rest_load()
        plants = self._plants(load)
        start: list[Data] = [{"at": 0, "loop": self.loop, "set": {"setpoint": self.first_setpoint}}]
        if self.plc.initial_modes[self.index] != "auto":
            start.insert(0, {"at": 0, "loop": self.loop, "mode": "auto"})
        return {
            "pidcfg": 1,
            "scenario": "forecast",
            "config": "-",
            "duration": 3 * length,
            "initial": {self.loop: self.resting_output},
            "plants": plants,
            "connect": {self.plc.pv_inputs.get(self.loop, f"{self.loop}.PV"): plants[-1]["name"]},
            "events": [
                *start,
                {"at": length, "loop": self.loop, "set": {"setpoint": self.first_setpoint + self.step}},
                {
                    "at": 2 * length,
                    "plant": plants[0]["name"],
                    "disturb": {"load": load + self.plant.gain * self.load_step},
                },
            ],
        }

    def _rest_load(self) -> float:
        """With which the PV rests at the first set point while the output rests in the middle."""
        return (0.0 if self.plant.integrators else self.first_setpoint) - self.plant.gain * self.resting_output

    def _plants(self, load: float) -> list[Data]:
        """The process as plants, one behind the other."""
        plant = self.plant
        poles = list(plant.poles)
        rows: list[Data] = []
        while poles:
            first, *second = [poles.pop() for _ in range(min(2, len(poles)))]
            lags = {"model": "second_order", "time_constants": [first, *second]}
            rows.append(lags if second else {"model": "first_order", "time_constant": first})
        if plant.integrators:
            rows.append({"model": "integrator"})
        rows = rows or [{"model": "dead_time"}]
        inputs = [f"{self.loop}.{self.plc.out_name}", *(f"process_{n}" for n in range(1, len(rows)))]
        process_values = {"gain": plant.gain, "dead_time": plant.dead_time, "load": load}
        for n, row in enumerate(rows):
            row.update(process_values if n == 0 else {"gain": 1.0})
            initial = self.first_setpoint if n + 1 == len(rows) or not plant.integrators else 0.0
            row.update({"name": f"process_{n + 1}", "input": inputs[n], "initial": initial})
        return rows

    def measure(self, run: Run) -> Forecast:
        """Runs, and reads the meter of the loop when its set point steps, when the load does, and at the end."""
        meter, signals = run.machine.meters[self.index], run.net.signal_values
        first, second = (int(n * self.part_length() * TICKS) // run.step for n in (1, 2))
        run.chunk_steps = max(1, (second - first) // CHUNKS_PER_STEP)
        errors, overshoot_percent, output_before, settles, late_iae = [0.0], None, 0.0, True, [(0, 0.0), (0, 0.0)]
        rise = fall = 0.0
        for k in run.steps_to_end():
            if k == first:
                if self.plc.mode(meter.status) not in CONTROL_MODES:
                    return Forecast(f"the loop is in {self.plc.mode(meter.status)} when its set point steps")
                meter.out_low = meter.out_high = output_before = signals[meter.out]
                errors = [meter.iae]
            elif first < k <= (first + second) / 2:
                late_iae[0] = (k, meter.iae)
            elif k == second:
                errors.append(meter.iae)
                overshoot_percent = overshoot(meter, Band(self.index, SETTLING_BAND_SHARE))
                settles = settling_time(meter, run.machine.bands[self.index], k - 1, run.dt) is not None
                rise, fall = meter.out_high - output_before, output_before - meter.out_low
            elif second < k <= (3 * second - first) / 2:
                late_iae[1] = (k, meter.iae)
        step = abs(meter.sp_after - meter.sp_before)
        if overshoot_percent is None or not step:
            return Forecast("the set point does not move: see its limits")
        headroom = min((self.high - output_before) / max(rise, 1e-12), (output_before - self.low) / max(fall, 1e-12))
        setpoint_iae, load_iae = (
            None if isinf(self.gains.integral_time) else (b - a) * run.dt / unit
            for a, b, unit in zip(errors, (*errors[1:], meter.iae), (step, self.load_step * self.unit), strict=True)
        )
        windows = zip((second, run.last), (*errors[1:], meter.iae), late_iae, strict=True)
        final_error = max((iae - before) / (k - begin) for k, iae, (begin, before) in windows)
        return Forecast(
            answer=Answer(overshoot_percent, setpoint_iae, load_iae),
            step=(meter.sp_before, meter.sp_after),
            largest_step=step * headroom,
            settles=settles,
            final_error=final_error,
            hunts=final_error * (second - first) > HUNTING_SHARE * (errors[1] - errors[0]),
            pv_range=(self.pv_low, self.pv_high),
            limits=(self.low, self.high),
        )
