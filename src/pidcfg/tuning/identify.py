"""A process from the record of a step test: the samples that count, a lag or integrator with dead time, how sure it is.

Design. The output may step, step several times or ramp; the fit follows it. The PV must be at rest before the first
change, or drift evenly. What a first-order process does not do is looked for and named: a PV that first goes the
wrong way, one that swings, one that has not settled, one that is lost in noise, spikes, a sensor at its end. The rest
is fitted by least squares.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby, pairwise
from math import inf, isfinite, sqrt
from statistics import fmean, median
from typing import NamedTuple

from pidcfg.text.frozen import frozen
from pidcfg.text.reader import Limits
from pidcfg.text.references import Decision
from pidcfg.tuning import response
from pidcfg.tuning.response import (
    Fit,
    Path,
    Record,
    RecordError,
    Request,
    Samples,
    Segment,
    least_squares,
    output_path,
    refuse_shape,
    refuse_spikes,
    refuse_stop,
    search_minimum,
    second_order_response,
)
from pidcfg.tuning.rules import Process, TuningError
from pidcfg.tuning.sheet import (
    MISSING_WORDS,
    Columns,
    Row,
    Sheet,
    StampError,
    UnreadableRecordError,
    find_columns,
    looks_like_stamp,
    read_column_options,
    read_sheet,
    seconds_of,
)

# --- A process from a record of output and PV -------------------------------------------------------------------------

MIN_REST_SAMPLES, MIN_ANSWER_SAMPLES = 3, 12
"""Samples before the first change that show the rest, and after it that are needed."""
DRIFT_SAMPLES = 8
"""Samples before the first change that show a drift."""
RECORDED_CONSTANTS = 2.0
"""Time constants of the answer that the record must hold."""
MIN_NOISE_RATIO = 5.0
"""How many standard deviations of noise an answer must have."""
MIN_GAIN_CHANGE = 0.01
"""Change of the gain from which on a drift matters."""
REST_STRAY = 0.01
"""How far a PV at rest may stray beside its noise, in the range of the PV."""
MIN_DRIFT = 0.002
"""Drift over the record, in the range of the PV, that is fitted."""
CONSISTENT_ERRORS = 3.0
"""How many standard errors of the slope at rest a drift may be off it."""
MIN_DRIFT_EFFECT = 12.0
"""How far a drift must lower the sum of squares, in variances of what is left."""
SIGNIFICANT_ERRORS = 4.0
"""How many of its standard errors a drift must have."""
SECOND_DIFFERENCE = 6.0
"""Variance of y(n) - 2 y(n-1) + y(n-2) of white noise, in variances of the noise."""
INTEGRATOR_LENGTHS = 3.0
"""Time constant, in lengths of the answer, from which a lag looks like an integrator."""
MAX_CONFIDENCE = 0.3
"""Confidence, in the number itself, beyond which a record does not tell it."""
POOR_MISFIT, WRONG_MISFIT = 0.03, 0.1
"""What a fit may leave beside noise, in answers: more is told, much more refused."""
MIN_LAG_RATIO = 0.05
"""Of the first time constant: a second one that is shorter is none."""
MIN_DEAD_TIME = 1e-6
"""Samples: a shorter dead time is none, and what is left of it the arithmetic's."""


@frozen
class Identification:
    """What was identified: the process, when the output first changed, the PV before it, and how well it fits.

    The process of an integrator has the time constant 1 s, so that its gain is the slope of the PV, per s and output.
    """

    process: Process
    step_time: float
    base: float
    step: float
    """The largest change of the output from its rest."""
    noise: float
    misfit: float
    """Standard deviation of what is left, in answers."""
    integrating: bool
    drift: float
    """Of the PV, in its unit per s; 0 where none was found."""
    confidence: tuple[float, float, float]
    """95 % confidence of gain, time constant and dead time: plus or minus so much."""
    fitted_pv: tuple[float, ...]
    """The PV of the process at the times of the record."""
    remarks: tuple[str, ...] = ()
    """What was read as what, and what makes the numbers less sure."""
    second_confidence: float = 0.0
    """The same of the second time constant; 0: there is none."""
    cautions: tuple[str, ...] = ()
    """Those of the remarks that make the numbers less sure."""

    @property
    def model(self) -> str:
        """The kind of process."""
        return "integrating" if self.integrating else self.process.model

    def with_remarks(self, remarks: Sequence[str]) -> Identification:
        """The same with remarks before its own."""
        return replace(self, remarks=(*remarks, *self.remarks))


def identify(record: Record, rest: float | None = None) -> Identification:
    """The process of a record; ``rest`` is the output before it, where it changed at the first sample.

    Raises `RecordError`.
    """
    path = output_path(record, rest)
    segments, k = path.segments, path.first_sample
    after = len(record.time) - k
    if after < MIN_ANSWER_SAMPLES:
        raise RecordError(
            f"the output first changes after {k} and before {after} samples",
            f"record at least {MIN_REST_SAMPLES} before and {MIN_ANSWER_SAMPLES} after",
        )
    noise = _noise(record.pv)
    refuse_spikes(record, noise)
    remarks = []
    if k < MIN_REST_SAMPLES:
        remarks.append(f"{k} samples before the change: that the PV was at rest is not shown")
    rest_slope, error = _slope_at_rest(record, k, noise)
    slope = rest_slope if _is_drift(record, rest_slope, error) else 0.0
    _refuse_small(record, k, slope, noise)
    if len(segments) == 1:
        refuse_stop(record, k, _quantum(record.pv))
        refuse_shape(record, k, slope, noise)
    best, nearest = _second_lag(record, segments, _best_fit(record, path, (rest_slope, error), noise, remarks))
    _refuse_upset(record, segments, nearest)
    _refuse_unsure(best, record, segments, noise)
    return _make_identification(record, best, path, noise, remarks)


def _make_identification(record: Record, best: Fit, path: Path, noise: float, remarks: Sequence[str]) -> Identification:
    segments, k = path.segments, path.first_sample
    start = segments[0].time
    shape = response.second_order_response(
        record.time, segments, best.dead_time, best.time_constant, best.second_time_constant
    )
    pvs = [best.base + best.drift * (t - start) + best.gain * x for t, x in zip(record.time, shape, strict=True)]
    size = max(abs(best.gain * x) for x in shape)
    step = median(b - a for a, b in pairwise(record.time[max(0, k - 1) :]))
    half_step = max(step, record.time[k] - record.time[k - 1] if k else step) / 2
    gain, constant, dead_time = best.errors
    notes = list(remarks)
    if best.drift and best.time_constant != inf:
        notes.append(f"the PV drifts by {best.drift:.4g} per s; the drift was fitted and taken out of the gain")
    misfit = best.residual / size
    cautions = list(remarks)
    if misfit > POOR_MISFIT and best.residual > 2 * noise:
        kind = "process of two lags" if best.second_time_constant else "first-order process"
        notes.append(f"a {kind} with dead time leaves {misfit * 100:.2g} % of the answer: take care")
        cautions.append(notes[-1])
    delay = best.dead_time if best.dead_time > MIN_DEAD_TIME * half_step else 0.0
    constant_found = 1.0 if best.time_constant == inf else best.time_constant
    process = Process(best.gain, constant_found, delay, second_time_constant=best.second_time_constant)
    errors = (gain, constant, sqrt(dead_time * dead_time + half_step * half_step))
    integrating = best.time_constant == inf
    return Identification(
        process,
        start,
        best.base,
        path.span,
        noise,
        misfit,
        integrating,
        best.drift,
        errors,
        tuple(pvs),
        tuple(notes),
        best.second_time_constant_error,
        tuple(cautions),
    )


def _noise(pv: Sequence[float]) -> float:
    """The standard deviation of the noise, from second differences, which a slow answer hardly has."""
    seconds = [c - 2 * b + a for a, b, c in zip(pv, pv[1:], pv[2:], strict=False)]
    if not seconds:
        return 0.0
    middle = sorted(abs(d) for d in seconds)[len(seconds) // 2] / 0.6745
    return max(middle / sqrt(SECOND_DIFFERENCE), _quantum(pv) / sqrt(12))


def _quantum(pv: Sequence[float]) -> float:
    """The resolution of a PV that has few different values; 0 for others."""
    values = sorted(set(pv))
    if len(values) * 3 > len(pv) or len(values) < 2:
        return 0.0
    return min(b - a for a, b in pairwise(values))


def _slope_at_rest(record: Record, k: int, noise: float) -> tuple[float, float]:
    """How the PV moves before the first change, per s, and how sure that is; refuses one that does not move evenly."""
    if k < MIN_REST_SAMPLES:
        return 0.0, inf
    times, values = record.time[:k], record.pv[:k]
    answer = max(record.pv) - min(record.pv)
    middle = fmean(times)
    columns = [[1.0] * k, [t - middle for t in times]]
    line = least_squares(columns, values) if k >= DRIFT_SAMPLES else None
    slope = line[1] if line else 0.0
    mean = line[0] if line else fmean(values)
    residuals = [y - mean - slope * (t - middle) for t, y in zip(times, values, strict=True)]
    spread = sqrt(fmean([y * y for y in residuals]))
    half = max(1, k // 2)
    jump = abs(fmean(residuals[k - half :]) - fmean(residuals[:half]))
    if spread > 2.5 * noise + REST_STRAY * answer or jump > 2 * REST_STRAY * answer + 3 * noise / sqrt(half):
        moved = max(values) - min(values)
        crossings = [t for t, (a, b) in zip(times, pairwise(residuals), strict=False) if a * b < 0]
        swings = len(crossings) >= 4 and spread > 3 * noise
        period = 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1) if swings else 0.0
        raise RecordError(
            f"the PV was not at rest before the step: it {'swung' if swings else 'moved'} by {moved:.4g}"
            + (f" with a period of about {period:.3g} s" if swings else ""),
            "wait until it is at rest, then step, or leave out the beginning with --from",
            0,
        )
    error = max(noise, spread) / sqrt(sum(x * x for x in columns[1])) if line else inf
    return slope, error


def _is_drift(record: Record, slope: float, error: float) -> bool:
    """Whether a slope of the PV at rest is one, and matters."""
    moves = abs(slope) * (record.time[-1] - record.time[0])
    return abs(slope) > SIGNIFICANT_ERRORS * error and moves > MIN_DRIFT * (max(record.pv) - min(record.pv))


def _refuse_small(record: Record, k: int, slope: float, noise: float) -> None:
    """Refuses a PV that, without its drift, goes no farther than noise."""
    base = fmean(record.pv[:k]) if k else record.pv[0]
    begin = fmean(record.time[:k]) if k else record.time[0]
    width = max(1, (len(record.pv) - k) // 20)
    moved = [y - base - slope * (t - begin) for t, y in zip(record.time[k:], record.pv[k:], strict=True)]
    means = [fmean(moved[i : i + width]) for i in range(0, len(moved) - width + 1, width)]
    answer = max(means, key=abs)
    if abs(answer) <= MIN_NOISE_RATIO * noise or answer == 0:
        raise RecordError(
            f"the PV answers by {abs(answer):.4g}, with noise of {noise:.4g}", "take a larger step, or filter the PV"
        )


def _best_fit(record: Record, path: Path, rest: tuple[float, float], noise: float, remarks: list[str]) -> Fit:
    """A lag, a lag whose rest drifts, or an integrator: the simplest that explains the record."""
    samples, segments = Samples(record.time, record.pv), path.segments
    slope, error = rest
    has_drift = _is_drift(record, slope, error)
    length = samples.time[-1] - segments[0].time
    lag = response.fit_process(samples, segments, drift=has_drift)
    if lag.time_constant > INTEGRATOR_LENGTHS * (length - lag.dead_time):
        line = response.fit_process(samples, segments, drift=path.first_sample >= MIN_REST_SAMPLES, integrating=True)
        whole = sum((y - fmean(samples.value)) ** 2 for y in samples.value)
        if line.squares <= lag.squares * 1.1 + 1e-9 * whole:
            return line
    if has_drift:
        return lag
    drifting = response.fit_process(samples, segments, drift=True, guess=lag)
    if abs(drifting.drift - slope) > CONSISTENT_ERRORS * error:
        return lag
    better = lag.squares - drifting.squares > MIN_DRIFT_EFFECT * drifting.squares / max(1, drifting.points - 5)
    if better and abs(drifting.gain / lag.gain - 1) > MIN_GAIN_CHANGE:
        alone = noise / sqrt(max(1, len(samples.time) // drifting.points))
        if error < inf and drifting.residual < 1.2 * alone:
            return drifting
        remarks.append(
            f"a drift of the PV of {drifting.drift:.4g} per s would make the gain {drifting.gain:.4g}; record longer "
            "before the step to tell"
        )
    return lag.widen(drifting)


def _second_lag(record: Record, segments: Sequence[Segment], best: Fit) -> tuple[Fit, Fit]:
    """The same with a second lag where the record shows one, and whichever leaves less, shown or not."""
    if best.time_constant == inf:
        return best, best
    two_lags = response.fit_process(
        Samples(record.time, record.pv), segments, drift=bool(best.drift), guess=best, with_second_lag=True
    )
    better = best.squares - two_lags.squares > MIN_DRIFT_EFFECT * two_lags.squares / max(1, two_lags.points - 5)
    shown = (
        two_lags.second_time_constant > MIN_LAG_RATIO * two_lags.time_constant
        and two_lags.second_time_constant_error < two_lags.second_time_constant
    )
    return two_lags if better and shown else best, min(best, two_lags, key=lambda fit: fit.squares)


def _answer_duration(record: Record, segments: Sequence[Segment], best: Fit) -> float:
    """For how long the answer is recorded, in s."""
    return record.time[-1] - segments[0].time - best.dead_time


def _refuse_upset(record: Record, segments: Sequence[Segment], best: Fit) -> None:
    """Refuses a record with a second change of the PV, with the part that is without it."""
    if best.time_constant == inf or _answer_duration(record, segments, best) < RECORDED_CONSTANTS * best.time_constant:
        return
    at = find_upset(Samples(record.time, record.pv), segments, best)
    if at is None:
        return
    row = max(i for i, t in enumerate(record.time) if t <= at)
    raise RecordError(
        f"from about {record.time[row]:.4g} s on the PV moves again, and the output does not (a disturbance)",
        f"take the part before it with --until {record.time[row]:.6g}, or repeat the test",
        row,
    )


def _refuse_unsure(best: Fit, record: Record, segments: Sequence[Segment], noise: float) -> None:
    """Refuses a record that does not tell the numbers."""
    duration = _answer_duration(record, segments, best)
    moved = response.second_order_response(
        record.time, segments, best.dead_time, best.time_constant, best.second_time_constant
    )
    size = max(abs(best.gain * x) for x in moved)
    if size == 0 or best.residual > WRONG_MISFIT * size + 3 * noise:
        raise RecordError(
            f"a first-order process with dead time leaves {best.residual / size * 100 if size else 100:.2g} % of the "
            "answer unexplained",
            "look for a disturbance or a second change during the test, and take the part without it with --from and "
            "--until",
        )
    if best.time_constant != inf and duration < RECORDED_CONSTANTS * best.time_constant:
        raise RecordError(
            f"the PV has not settled: the record ends {max(duration, 0):.4g} s after the dead time, and the time "
            f"constant is about {best.time_constant:.4g} s",
            "record until it is at rest; a process that never comes to rest is an integrator",
            len(record.pv) - 1,
        )
    gain, constant, _ = best.errors
    for name, value, error in (("gain", best.gain, gain), ("time constant", best.time_constant, constant)):
        if error > MAX_CONFIDENCE * abs(value) and value != inf:
            raise RecordError(
                f"the record does not tell the {name}: {value:.4g} ± {error:.2g}",
                "take a larger step, record longer or more often, or filter the PV",
            )


# --- Disturbances of a record, which a fit must not take for the process ----------------------------------------------

D938 = Decision(
    938,
    "a second disturbance in a record is looked for, and refused",
    "The record is fitted again with a step of the load at each of 16 times after the change, at the PV or before the "
    "process. Where the best process leaves more than 0.5 % of the way of the PV on average, and a step leaves less "
    "than 60 % of those squares, by more than 40 variances, and is larger than 3 % of the answer, the record is "
    "refused with the time where it begins and the --until before it; one that has not settled is refused as such. A "
    "second lag is one where it lowers the squares by more than 12 variances; confidences are widened by the "
    "correlation of what is left.",
    "An upset 250 s after a step made gain 2.63 ± 0.07 of a true 1.5, and no warning.",
)

UPSET_TIMES, FIRST_UPSET, LAST_UPSET = 16, 0.15, 0.97
"""Times that are tried, and the part of the answer in which they lie."""
MAX_SQUARES, MIN_VARIANCES, MIN_UPSET = 0.6, 40.0, 0.03
MIN_RESIDUAL = 0.005
"""Of the way of the PV, what the best process leaves on average where a disturbance may be looked for."""
UPSET_POINTS, UPSET_ROUNDS = 100, 40
"""Points of the record that are looked at, and rounds of each search."""


def find_upset(samples: Samples, output: Sequence[Segment], best: Fit) -> float | None:
    """When a second change of the PV begins, in s of the record; None: there is none."""
    begin = output[0].time
    points = samples.average(UPSET_POINTS, begin)
    plain_squares = _residual_squares(points, output, best)
    if plain_squares <= len(points.time) * (MIN_RESIDUAL * (max(points.value) - min(points.value))) ** 2:
        return None
    length = points.time[-1] - begin
    best_step: tuple[float, float, float] | None = None
    for n in range(UPSET_TIMES):
        at = begin + length * (FIRST_UPSET + (LAST_UPSET - FIRST_UPSET) * n / (UPSET_TIMES - 1))
        squares, size = _fit_with_step(points, output, best, at)
        if best_step is None or squares < best_step[0]:
            best_step = (squares, at, size)
    if best_step is None or abs(best_step[2]) < MIN_UPSET or best_step[0] >= MAX_SQUARES * plain_squares:
        return None
    variance = best_step[0] / max(1, len(points.time) - 5)
    step = length * (LAST_UPSET - FIRST_UPSET) / (UPSET_TIMES - 1)
    return max(begin, best_step[1] - step / 2) if plain_squares - best_step[0] > MIN_VARIANCES * variance else None


def _residual_squares(points: Samples, output: Sequence[Segment], best: Fit) -> float:
    """What the best process leaves of these points."""
    columns = [
        [1.0] * len(points.time),
        second_order_response(points.time, output, best.dead_time, best.time_constant, best.second_time_constant),
    ]
    return _fit_columns([*columns, *_drift_columns(points, output, best)], points.value)[0]


def _drift_columns(points: Samples, output: Sequence[Segment], best: Fit) -> list[list[float]]:
    return [[t - output[0].time for t in points.time]] if best.drift else []


def _fit_with_step(points: Samples, output: Sequence[Segment], best: Fit, step_time: float) -> tuple[float, float]:
    """What is left with a step at this time, and its size in answers."""
    length, drift = points.time[-1] - output[0].time, _drift_columns(points, output, best)

    def cost(place: Sequence[float], *, with_size: bool = False) -> float:
        dead, constant = abs(place[0]) * length, max(abs(place[1]), 1e-4) * length
        unit = response.first_order_response(points.time, output, dead, constant)
        upset = response.first_order_response(points.time, [Segment(step_time, 1.0)], 0.0, constant)
        squares, weights = _fit_columns([[1.0] * len(unit), unit, upset, *drift], points.value)
        if with_size:
            size = weights[1] * max(map(abs, unit))
            return weights[2] / size if size else 0.0
        return squares

    early = min((step_time - output[0].time) / length / 3, 0.3)
    starts = [(best.dead_time / length, min(best.time_constant / length, 1.0)), (early / 4, early)]
    place = search_minimum(cost, min(starts, key=cost), 0.05, UPSET_ROUNDS)
    return cost(place), cost(place, with_size=True)


def _fit_columns(columns: Sequence[Sequence[float]], values: Sequence[float]) -> tuple[float, list[float]]:
    """The sum of squares that these columns leave, and their weights."""
    weights = least_squares(columns, values)
    if weights is None:
        return float("inf"), [0.0] * len(columns)
    residuals = list(values)
    for weight, column in zip(weights, columns, strict=True):
        residuals = [y - weight * x for y, x in zip(residuals, column, strict=True)]
    return sum(y * y for y in residuals), weights


# --- The record of a step test as people have it: a table with time, output and PV somewhere in its columns -----------

UNIT_SECONDS = {"ms": 0.001, "s": 1.0, "sec": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}
"""Units of time that a header may name, in s."""
UNIT_WORDS = {"msec": "ms", "millis": "ms", "milliseconds": "ms", "seconds": "s", "secs": "s", "minutes": "min"}
UNIT_WORDS |= {"minute": "min", "hours": "h", "hour": "h", "hr": "h", "days": "d", "std": "h", "sek": "s"}
EXCEL_DAYS = (20_000.0, 80_000.0)
"""Dates of spreadsheets as numbers of days: 1954 to 2119."""
MILLISECONDS_SINCE_1970 = 1e11
MIN_EPOCH_TIME = 1e8
"""Numbers of seconds from here on count from 1970, so the first sample becomes 0."""
MAX_MISSING_SHARE = 0.2
"""Share of rows that may lack a value."""
GAP_SAMPLES = 10.0
"""How many sample times a gap lasts that is told."""
NUMBER_AND_UNIT = re.compile(r"\s*([+-]?[0-9]+(?:\.[0-9]+)?)\s*([a-z]*)\s*")


class Sample(NamedTuple):
    """A row of the record."""

    time: float
    output: float
    pv: float
    line: int


def identify_record(
    data: bytes, name: str, limits: Limits, request: Request | None = None
) -> tuple[Identification, Record]:
    """The process of a recorded step, and its samples; raises `UnreadableRecordError`."""
    request = request or Request()
    record, lines, remarks = read_record(data, name, limits, request)
    try:
        identification = identify(record, request.rest)
    except RecordError as error:
        where = name if error.row is None else f"{name}:{lines[error.row]}"
        raise UnreadableRecordError(f"{where}: {error}; {error.cure} ({'; '.join(remarks)})") from None
    return identification.with_remarks(remarks), record


D1080 = Decision(
    1080,
    "what a program has written may be three times as large as a configuration",
    "A configuration or scenario has at most 1 MiB, a memory listing, an export, a project, a sheet or a recording 3 "
    "MiB; `--limit file_bytes` raises both.",
    "Nobody writes a megabyte of loops by hand; a CODESYS project with all its programs has 1.1 MB.",
)


def read_record(
    data: bytes, name: str, limits: Limits, request: Request | None = None
) -> tuple[Record, list[int], tuple[str, ...]]:
    """The samples of a file, the lines that they stand in, and what was read as what."""
    request = request or Request()
    if len(data) > limits.listing_bytes:
        raise UnreadableRecordError(
            f"{name} is larger than {limits.listing_bytes} bytes; --limit file_bytes=… raises that"
        )
    try:
        stated = read_column_options(request.columns) if request.columns else {}
        sheet = read_sheet(data, name)
        columns = find_columns(sheet, stated)
        remarks = [columns.text(sheet), *sheet.remarks]
        rows = _complete_rows(sheet, columns, remarks)
        times, origin = _read_times(sheet, columns, rows, remarks)
        samples = [
            Sample(time, *_numbers_of_row(sheet, row, columns), row.line) for time, row in zip(times, rows, strict=True)
        ]
        samples = _cut_window(_sort_samples(samples, name, remarks), request, origin, remarks)
    except UnreadableRecordError:
        raise
    except TuningError as error:
        raise UnreadableRecordError(str(error)) from None
    units = sheet.units[columns.output], sheet.units[columns.pv]
    record = Record([s.time for s in samples], [s.output for s in samples], [s.pv for s in samples], units)
    return record, [s.line for s in samples], tuple(remarks)


def _numbers_of_row(sheet: Sheet, row: Row, columns: Columns) -> tuple[float, float]:
    output, pv = sheet.number(row, columns.output), sheet.number(row, columns.pv)
    if output is None or pv is None:
        raise TuningError(f"{sheet.name}:{row.line}: a value is missing")
    return output, pv


def _complete_rows(sheet: Sheet, columns: Columns, remarks: list[str]) -> list[Row]:
    """The rows that have all values; a few may lack one, which is told."""
    needed = (*columns.time, columns.output, columns.pv)
    rows = [row for row in sheet.rows if not any(row.cells[c].lower() in MISSING_WORDS for c in needed)]
    if len(rows) < len(sheet.rows):
        first = next(row.line for row in sheet.rows if row not in rows)
        lost = len(sheet.rows) - len(rows)
        if lost > MAX_MISSING_SHARE * len(sheet.rows):
            raise TuningError(
                f"{sheet.name}:{first}: {lost} of {len(sheet.rows)} rows lack a value ({columns.text(sheet)}); choose "
                "other columns, or a part of the record with --from and --until"
            )
        remarks.append(f"{lost} rows without a value were left out, the first in line {first}")
    return rows


def _read_times(
    sheet: Sheet, columns: Columns, rows: Sequence[Row], remarks: list[str]
) -> tuple[list[float], TimeOrigin]:
    """Times in s, and what they are counted from."""
    texts = [" ".join(row.cells[c] for c in columns.time) for row in rows]
    if looks_like_stamp(texts[0]):
        first = sheet.units[columns.time[0]].lower()
        try:
            times, stamp_remarks = seconds_of(texts, minutes_first=first in {"mm:ss", "min:s", "m:s"})
        except StampError as error:
            place = f"{sheet.name}:{rows[error.row].line}:{columns.time[0] + 1}"
            raise TuningError(f"{place}: {error}; correct the row, or give the column of the time") from None
        start = min(times)
        remarks += [*stamp_remarks, f"the time counts from {texts[times.index(start)]}"]
        return [time - start for time in times], TimeOrigin(texts[0], times[0] - start)
    if len(columns.time) > 1:
        raise TuningError(f"{sheet.name}:{rows[0].line}: {texts[0][:40]!r} is no date and time")
    column = columns.time[0]
    numbers = [sheet.number(row, column) or 0.0 for row in rows]
    unit = _time_unit(sheet, column, numbers)
    if unit is None:
        remarks.append("the time has no unit and is taken for s")
    factor = UNIT_SECONDS[unit or "s"]
    times = [number * factor for number in numbers]
    if min(times) >= MIN_EPOCH_TIME or unit == "d":
        start = min(times)
        remarks.append(
            f"the time counts from the first sample, {min(numbers):.10g}{'' if unit is None else ' ' + unit}"
        )
        return [time - start for time in times], TimeOrigin("", start)
    if unit not in {None, "s"}:
        remarks.append(f"times in {unit} are shown in s")
    return times, TimeOrigin("", 0.0)


class TimeOrigin(NamedTuple):
    """Where the times of a record begin: its first stamp and the time of it, or (no stamp) what numbers count from."""

    stamp: str
    seconds: float


def _time_unit(sheet: Sheet, column: int, numbers: Sequence[float]) -> str | None:
    """The unit of a column of times, by its header; days and ms by their size."""
    words = [sheet.units[column].lower(), *re.split(r"[^a-z]+", sheet.names[column].lower())[::-1]]
    unit = next((UNIT_WORDS.get(word, word) for word in words if UNIT_WORDS.get(word, word) in UNIT_SECONDS), None)
    if unit is None and min(numbers) >= MILLISECONDS_SINCE_1970:
        return "ms"
    dated = {"date", "datetime", "timestamp", "datum", "zeitstempel"} & set(words)
    if unit is None and dated and EXCEL_DAYS[0] < min(numbers) and max(numbers) < EXCEL_DAYS[1]:
        return "d"
    return unit


def _sort_samples(samples: list[Sample], name: str, remarks: list[str]) -> list[Sample]:
    """Oldest first; equal rows once, equal stamps of a coarse clock apart."""
    steps = [b.time - a.time for a, b in pairwise(samples)]
    if sum(s < 0 for s in steps) > sum(s > 0 for s in steps):
        samples.reverse()
        remarks.append("the record has its newest sample first and was turned round")
    for earlier, later in pairwise(samples):
        if later.time < earlier.time:
            raise TuningError(
                f"{name}:{later.line}: the time does not go on ({later.time:g} after {earlier.time:g} s); correct the "
                "row, or take a part of the record with --from and --until"
            )
    unique = [s for i, s in enumerate(samples) if not i or s[:3] != samples[i - 1][:3]]
    groups = [list(group) for _, group in groupby(unique, key=lambda s: s.time)]
    if len(groups) < 2:
        raise TuningError(f"{name}:{samples[0].line}: all samples have the same time")
    if len(samples) > len(unique) and len(unique) <= len(groups) * 1.1:
        remarks.append(f"{len(samples) - len(unique)} rows that stand twice count once")
    else:
        groups = [list(group) for _, group in groupby(samples, key=lambda s: s.time)]
        unique = samples
    if len(unique) > len(groups) * 1.1:
        remarks.append("several samples have the same time; they are put evenly between the times")
        unique = _spread_ticks(groups)
    _tell_gaps(unique, remarks)
    return unique


def _spread_ticks(groups: Sequence[Sequence[Sample]]) -> list[Sample]:
    """Samples of a coarse clock, evenly from its tick to the next one; the first tick is seen from its end."""
    spread = []
    typical = median(b[0].time - a[0].time for a, b in pairwise(groups)) / median(len(g) for g in groups[1:])
    for i, group in enumerate(groups):
        start = group[0].time
        if i == 0:
            step, start = typical, groups[1][0].time - len(group) * typical
        elif i + 1 < len(groups):
            step = (groups[i + 1][0].time - start) / len(group)
        else:
            step = typical
        spread += [s._replace(time=start + j * step) for j, s in enumerate(group)]
    return spread


def _tell_gaps(samples: Sequence[Sample], remarks: list[str]) -> None:
    steps = [b.time - a.time for a, b in pairwise(samples)]
    usual = median(steps)
    if usual > 0 and max(steps) > GAP_SAMPLES * usual:
        i = steps.index(max(steps))
        remarks.append(f"a gap of {steps[i]:.4g} s ends in line {samples[i + 1].line}")


def _cut_window(samples: list[Sample], request: Request, origin: TimeOrigin, remarks: list[str]) -> list[Sample]:
    """The part of the record that counts."""
    start = _read_time(request.start, "from", origin)
    until = _read_time(request.until, "until", origin)
    kept = [s for s in samples if (start is None or s.time >= start) and (until is None or s.time <= until)]
    if start is None and until is None:
        return samples
    if start is not None and until is not None and start >= until:
        raise TuningError(f"--from {start:g} s is not before --until {until:g} s; exchange them")
    if not kept:
        raise TuningError(
            f"no sample lies between --from and --until; the record goes from {samples[0].time:g} to "
            f"{samples[-1].time:g} s"
        )
    remarks.append(f"{len(kept)} of {len(samples)} samples count, {kept[0].time:g} to {kept[-1].time:g} s")
    return kept


def _read_time(text: str | None, option: str, origin: TimeOrigin) -> float | None:
    """A time that the user gives: seconds of the record, a duration, or a stamp as the record has them."""
    if text is None:
        return None
    match = NUMBER_AND_UNIT.fullmatch(text.lower())
    if match and (match[2] or "s") in UNIT_SECONDS:
        value = float(match[1]) * UNIT_SECONDS[match[2] or "s"]
        if isfinite(value):
            return value - (origin.seconds if not origin.stamp and value >= MIN_EPOCH_TIME else 0.0)
    if origin.stamp and looks_like_stamp(text):
        try:
            (there, here), _ = seconds_of([origin.stamp, text])
        except StampError:
            pass  # a stamp of another kind than the record's
        else:
            return origin.seconds + here - there
    raise TuningError(
        f"--{option} {text[:40]!r} is no time of the record; write seconds, a time with its unit as 2 min, or a stamp "
        "as the record writes it"
    )
