"""Robust gains: the best real numbers, the best that a PLC can hold, and what its words cost."""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from math import ceil, floor, inf, isinf, log
from typing import TYPE_CHECKING, Protocol

from pidcfg.encoders.codecs import EncodeError
from pidcfg.encoders.contract import tables_of
from pidcfg.encoders.regmap import FULL_OUTPUT, LoopTuning
from pidcfg.schemas.base import RESET_UNIT
from pidcfg.schemas.numbers import decimal_text
from pidcfg.text.frozen import frozen
from pidcfg.text.references import Decision
from pidcfg.tuning.rules import Gains, TuningError, simc
from pidcfg.tuning.sampled import Curve, SampledLoop, absolute_error, allowed_gains, hold_process, sampled_margins

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.regmap import TuningNumbers
    from pidcfg.tuning import Form
    from pidcfg.tuning.margins import Margins
    from pidcfg.tuning.rules import Process, Spread
    from pidcfg.tuning.sampled import Sampling
    from pidcfg.vendors import Vendor

# --- Gains as a vendor's registers hold them: in its own terms, rounded, with the error that this makes ---------------

D1086 = Decision(
    1086,
    "gains without a file have the reset in minutes where seconds do not hold it",
    "`tune --for dl06` gives a reset in minutes that its word does not hold in seconds, and robust searches in minutes "
    "where its gains come to the end of the seconds. Of a file's loop the unit stays; the message, or a line of the "
    "result, names the other one.",
    "Bit 4 of +01 chooses the unit, so that the word goes on to 999.8 min. A rule changes three numbers of a file and "
    "nothing beside them.",
)
SIGNIFICANT_DIGITS = 12
"""Significant digits of a computed number: more are noise of the arithmetic."""


@frozen
class FittedNumber:
    """One number for a vendor: its key, what is wanted, what the register holds (None: it cannot), and why not."""

    key: str
    unit: str
    wanted: Decimal
    stored: Decimal | None
    problem: str | None = None

    @property
    def error_percent(self) -> float:
        """What rounding changes."""
        if self.stored is None or not self.wanted:
            return 0.0
        return float((self.stored / self.wanted - 1) * 100)


def fit_gains(gains: Gains, vendor: Vendor, pv_span: float, output_span: float) -> list[FittedNumber]:
    """Gain, integral and derivative time for a vendor; spans are engineering units from 0 % to 100 %.

    An integral time that does not fit in s is in min where the PLC has both.
    """
    loop = LoopTuning(tables_of(vendor).TUNING_NUMBERS, pv_span=_decimal(pv_span), output_span=_decimal(output_span))
    gain, integral, derivative = fit_loop(gains, vendor.model, loop)
    return [gain, fit_in_other_unit(gains, vendor.model, loop, integral) or integral, derivative]


def fit_loop(gains: Gains, model: type[BaseModel], loop: LoopTuning) -> list[FittedNumber]:
    """The three numbers as a loop of a file holds them; raises `ValueError` where it lacks the PV's span."""
    words, integral = loop.words, _integral_value(gains, loop)
    derivative = gains.kd if loop.independent else gains.derivative_time
    wanted = (_decimal(gains.gain * gain_factor(loop)), integral, _decimal(derivative))
    rows = zip(words.names, loop.units(), wanted, strict=True)
    return [_fit_number(model, words, *row) for row in rows]


def fit_in_other_unit(
    gains: Gains, model: type[BaseModel], loop: LoopTuning, integral: FittedNumber
) -> FittedNumber | None:
    """An integral time that does not fit in s or in min, in the other unit; None: it fits, or not there either."""
    other = in_other_unit(loop) if integral.problem is not None else None
    fitted = None if other is None else fit_loop(gains, model, other)[1]
    return fitted if fitted is not None and fitted.problem is None else None


def in_other_unit(loop: LoopTuning) -> LoopTuning | None:
    """The loop with its integral time in min in the place of s, or in s; None: its word has one unit alone."""
    return replace(loop, minutes=not loop.minutes) if loop.words.unit(loop.words.names[1]) == RESET_UNIT else None


def gain_factor(loop: LoopTuning) -> float:
    """From output units per PV unit to the loop's unit of the gain."""
    if loop.words.gain_unit == "engineering":
        return 1.0
    span = FULL_OUTPUT if loop.output_span is None else loop.output_span
    if loop.words.gain_unit == "percent":
        return float(FULL_OUTPUT / span)
    if loop.pv_span is None:
        raise ValueError("the gain is a share of the PV's span, which is not known")
    return float(loop.pv_span / span)


def _integral_value(gains: Gains, loop: LoopTuning) -> Decimal:
    """What the integral term is written as: a time in s or min, or a gain in 1/s."""
    if isinf(gains.integral_time):
        return loop.words.no_integral
    if loop.independent:
        return _decimal(gains.ki)
    return _decimal(gains.integral_time / (60 if loop.minutes else 1))


def _decimal(value: float) -> Decimal:
    return Decimal(f"{value:.{SIGNIFICANT_DIGITS}g}")


def _fit_number(model: type[BaseModel], words: TuningNumbers, name: str, unit: str, value: Decimal) -> FittedNumber:
    key, limits = words.key(name), words.limits(model, name)
    try:
        stored = words.stored_value(name, value)
    except EncodeError as error:
        return FittedNumber(key, unit, value, None, f"{_number_text(value)} {error}")
    if limits is not None and not limits.holds(value):
        low, high = (end if end is not None else "-" for end in (limits.low, limits.high))
        return FittedNumber(key, unit, value, None, f"{_number_text(value)} is outside {low} to {high}")
    return FittedNumber(key, unit, value, stored)


def _number_text(value: Decimal) -> str:
    return decimal_text(value.quantize(Decimal("0.000001")) if abs(value) < 1 else value)


# --- The gains with the least error after a load, of those that stay below a maximum sensitivity on every plant -------
#
# Design. The answer is exact for a grid of gains and times, and fast for three reasons:
#
# 1. Ti/Kp, the integral of the error itself, is a lower bound of the integral of |error| on every plant. With the
# best gains so far, a pair with a larger bound is not looked at, and a run in time ends as soon as its bound passes
# them. 2. For each pair of times the gains that Ms allows are intervals, from roots at a list of frequencies
# (`allowed_gains`); a finer Ms is only worked out for gains that would be the best. 3. A few plants decide. The
# search runs on these; what it finds is tried on all, and the plant that it fails on most is added, until it fails on
# none. Fewer plants only allow more, so that what holds on all is the best of all.
#
# Real numbers are grids that become finer around the best of the coarser one.

ROW_STRIDE, FEW_ROWS = 16, 64
"""Every so many rows are searched first, where there are not few, for a good bound and the plants that decide."""
LOW_GAIN_SHARE = 0.5
"""Of the highest gain that two times allow: where Ms is too large from there up, the frequencies were too few."""
NEAR_MS_SHARE = 0.98
"""Of an Ms at the frequencies of a list: it may still be the largest between them."""
EQUAL_TOLERANCE = 1e-9
"""Relative difference of numbers that count as equal."""


class Axis(Protocol):
    """Numbers that a gain or a time may have."""

    def values_between(self, low: float, high: float) -> Iterator[float]:
        """Those above ``low`` and up to ``high``, the largest first."""


@frozen
class Words:
    """Multiples of a step."""

    step: float
    first: int
    last: int

    def values_between(self, low: float, high: float) -> Iterator[float]:
        """Those above ``low`` and up to ``high``, the largest first."""
        top = self.last if high == inf else min(self.last, floor(high / self.step * (1 + EQUAL_TOLERANCE)))
        for word in range(top, self.first - 1, -1):
            value = word * self.step
            if value <= low:
                return
            yield value

    def narrow(self, value: float, reach: float) -> Words:
        """Those within a ratio of a number."""
        first, last = floor(value / reach / self.step), ceil(value * reach / self.step)
        return Words(self.step, max(self.first, first), min(self.last, last))


@frozen
class Ratios:
    """Numbers that grow by a ratio, from ``low`` to ``high``; the end of an interval is one of them."""

    ratio: float
    low: float
    high: float

    def values_between(self, low: float, high: float) -> Iterator[float]:
        """From ``high`` down, above ``low``."""
        value = min(high, self.high)
        while value > low and value >= self.low:
            yield value
            value /= self.ratio


@frozen
class Result:
    """Gains, the largest error over all plants, and the largest Ms."""

    gains: Gains
    error: float
    ms: float
    worst_error: int
    """Index of the plant."""
    worst_ms: int


@frozen
class Candidate:
    """Gains, and their largest error over the plants that decide."""

    gains: Gains
    error: float


class Search:
    """Plants, the loop around them, and the limit of Ms."""

    def __init__(self, plants: Sequence[Process], sampling: Sampling, ms: float, *, derivative: bool = False) -> None:
        self.plants, self.sampling, self.ms = plants, sampling, ms
        self.derivative = derivative
        self.curves = [
            Curve(hold_process(plant, sampling.sample_time), sampling, ms, derivative=derivative) for plant in plants
        ]
        self.deciding = self.curves[:1]
        """Of the plants that have decided so far."""
        self.tried_gains = 0
        """Gains whose run in time was looked at."""

    def begin(self, gains: Gains) -> None:
        """Finds the plants that decide for some gains, which are a first guess."""
        result = self.try_gains(gains)
        if result.error == inf:
            result = self.try_gains(replace(gains, gain=gains.gain / 2, integral_time=gains.integral_time * 2))
        self.deciding = [self.curves[i] for i in dict.fromkeys((0, result.worst_ms, result.worst_error))]

    def find_best(self, search: Callable[[], Candidate | None]) -> Result | None:
        """What a search among the plants that decide finds, when it holds on all; None: Ms allows nothing."""
        while True:
            candidate = search()
            if candidate is None:
                return None
            result = self.try_gains(candidate.gains)
            if not self._add_deciding(result, candidate):
                return result

    def search_rows(
        self, gains: Axis, rows: Sequence[tuple[float, float]], best_known: Candidate | None = None
    ) -> Candidate | None:
        """The best for the plants that decide: a gain with one of the pairs of times, or what is known."""
        if len(rows) > FEW_ROWS:
            best_known = self.search_rows(gains, rows[::ROW_STRIDE], best_known)
            rows = self._drop_long_times(rows, best_known)
        best, lower_bound = best_known, inf if best_known is None else best_known.error
        for integral, derivative in rows:
            if self._least_error(integral, derivative) >= lower_bound:
                continue
            for low, high in allowed_gains(self.deciding, integral, derivative):
                for gain in gains.values_between(low, high):
                    if integral / gain >= lower_bound or (best is None and gain < LOW_GAIN_SHARE * high):
                        break
                    candidate = Gains(gain, integral, derivative)
                    if best is None and not self._is_robust(candidate):
                        continue
                    error = self._largest_error(candidate, lower_bound)
                    if error < lower_bound and self._is_robust(candidate):
                        best, lower_bound = Candidate(candidate, error), error
        return best

    def try_gains(self, gains: Gains) -> Result:
        """Gains on all plants."""
        errors = [absolute_error(gains, curve.plant, self.sampling) for curve in self.curves]
        ms = [inf if error == inf else curve.sensitivity(gains, least=inf) for curve, error in self._pairs(errors)]
        near = max(ms) * NEAR_MS_SHARE
        ms = [
            value if value < near or value == inf else curve.sensitivity(gains)
            for curve, value in zip(self.curves, ms, strict=True)
        ]
        error, highest = max(errors), max(ms)
        return Result(gains, error, highest, errors.index(error), ms.index(highest))

    def _pairs(self, errors: Sequence[float]) -> Iterator[tuple[Curve, float]]:
        return zip(self.curves, errors, strict=True)

    def margins(self, gains: Gains, plant: int) -> Margins:
        """Of the sampled loop on one plant."""
        return sampled_margins(SampledLoop(gains, self.curves[plant].plant, self.sampling))

    def _add_deciding(self, result: Result, candidate: Candidate) -> bool:
        """Adds the plants that show that gains are not good enough; whether there are any."""
        failing = []
        if result.ms > self.ms:
            failing.append(self.curves[result.worst_ms])
        if result.error > candidate.error * (1 + EQUAL_TOLERANCE):
            failing.append(self.curves[result.worst_error])
        added = [curve for curve in dict.fromkeys(failing) if curve not in self.deciding]
        self.deciding = [*self.deciding, *added]
        return bool(added)

    def _drop_long_times(
        self, rows: Sequence[tuple[float, float]], best_known: Candidate | None
    ) -> Sequence[tuple[float, float]]:
        """Without the integral times that are too long whatever the gain is: Ti/Kp is then larger than the error."""
        if best_known is None or self.derivative:
            return rows
        most = min(curve.bound_by_error(best_known.error) for curve in self.deciding)
        return [row for row in rows if row[0] < most * best_known.error]

    def _least_error(self, integral: float, derivative: float) -> float:
        """A lower bound of the error with these times."""
        most = min(curve.bound_at_known(integral, derivative) for curve in self.deciding)
        return 0.0 if most == inf else integral / most

    def _largest_error(self, gains: Gains, limit: float) -> float:
        """The largest of the plants that decide; infinite: not below ``limit``."""
        self.tried_gains += 1
        largest = 0.0
        for curve in reversed(self.deciding):
            largest = max(largest, absolute_error(gains, curve.plant, self.sampling, limit))
            if largest >= limit:
                self.deciding.remove(curve)
                self.deciding.append(curve)
                return inf
        return largest

    def _is_robust(self, gains: Gains) -> bool:
        """Whether Ms holds on the plants that decide."""
        return all(curve.sensitivity(gains, least=NEAR_MS_SHARE * self.ms) <= self.ms for curve in self.deciding)


# --- Robust gains: the best real numbers, the best that a PLC can hold, and what its grid costs -----------------------
#
# `search` has the design of the search itself. Here are the numbers that are tried: all words of gain and reset where
# they are words, grids that become finer where they are numbers in floating point.

D853 = Decision(
    853,
    "which numbers are tried for robust gains",
    "DL06 and EZLogix, PI: all words of gain and integral time. PID: a first grid of real numbers, from a fifth of the "
    "dead time to twenty times all times of the process, then finer ones around the best; of words those within 8 % "
    "of the best real integral time and 20 % of the derivative time, then all words around the best of these. Numbers "
    "in floating point: real ones, the last grid by 0.1 % of the times and 0.03 % of the gain, rounded to the "
    "register.",
    "PID has 10¹² combinations of words; what was tried is told with the result.",
)

PI_LEVELS = ((1.06, 1.02, inf), (1.015, 1.005, 1.06), (1.004, 1.0015, 1.015), (1.001, 1.0003, 1.004))
"""Ratio of neighbouring integral times, of neighbouring gains, and how far from the best of the level before."""
PID_LEVELS = (
    (1.2, 1.05, inf, 1.5, inf),
    (1.06, 1.02, 1.2, 1.15, 1.5),
    (1.02, 1.006, 1.06, 1.05, 1.15),
    (1.006, 1.002, 1.02, 1.015, 1.05),
    (1.002, 1.0006, 1.006, 1.005, 1.015),
)
"""The same, and the ratio and reach of derivative times."""
MIN_TIME_FACTOR, MAX_TIME_FACTOR = 0.2, 20.0
"""Of the delay of the loop, and of all times: the range of integral times."""
MIN_DERIVATIVE, MAX_DERIVATIVE = 0.05, 4.0
"""Of the delay and the second time constant: the range of derivative times."""
MS_MARGIN = 1 - 1e-6
"""Of the limit of Ms, for numbers that are rounded afterwards."""
WORD_REACHES = ((1.08, 1.2, 12), (1.025, 1.05, inf))
"""Reach of integral and derivative times around the best so far, and about how many of each; infinite: all words."""


@frozen
class RobustTuning:
    """The gains that a loop gets, and the best real numbers beside them."""

    result: Result
    """As the PLC holds them; real numbers without a PLC."""
    real: Result
    has_words: bool
    """Whether the gains are words with steps between them."""
    is_exhaustive: bool
    """Whether there is no better word at all."""
    spreads: tuple[Spread, ...]
    plants: int
    ms_limit: float
    """Of Ms."""
    search: Search

    @property
    def cost_percent(self) -> float:
        """What the PLC's words cost, in IAE."""
        return (self.result.error / self.real.error - 1) * 100


def find_robust_gains(
    form: Form,
    search: Search,
    loop: LoopTuning | None,
    model: type[BaseModel] | None,
    spreads: Sequence[Spread] = (),
) -> RobustTuning:
    """The gains for a loop, or real numbers; raises `TuningError` where none keep Ms below its limit."""
    grid = _Grid(search, form, loop, model)
    limit = search.ms
    search.begin(simc("PI", search.plants[0]))
    real = grid.best_numbers()
    result, words, every = real, False, False
    if loop is not None and model is not None:
        words = loop.words.step(loop.words.names[0]) is not None
        every = words and form == "PI"
        result = grid.best_words(real) if words else grid.round_gains(real)
    return RobustTuning(result, real, words, every, tuple(spreads), len(search.plants), limit, search)


@dataclass
class _Grid:
    """The numbers that are tried."""

    search: Search
    form: Form
    loop: LoopTuning | None
    model: type[BaseModel] | None

    def best_numbers(self) -> Result:
        """The best real numbers."""
        best = self.search.find_best(self._search_levels)
        if best is None:
            process, limit = self.search.plants[0], self.search.ms
            raise TuningError(
                f"no {self.form} controller keeps Ms below {limit:g} on all {len(self.search.plants)} plants "
                f"(dead time {process.dead_time:g} s, sample time {self.search.sampling.sample_time:g} s); allow a "
                "larger Ms, or narrow what varies"
            )
        return best

    def _search_levels(self) -> Candidate | None:
        """The best of grids that become finer."""
        best: Candidate | None = None
        for time_ratio, gain_ratio, reach, *derivative in PID_LEVELS if self.form == "PID" else PI_LEVELS:
            known = None if best is None else best.gains
            times = self._list_times(1, time_ratio, reach, known)
            rates = self._list_times(2, derivative[0], derivative[1], known) if derivative else [0.0]
            around_gain = (0.0, inf) if known is None else (known.gain / reach**2, known.gain * reach**2)
            axis = Ratios(gain_ratio, *self._limit_range(0, around_gain))
            best = self.search.search_rows(axis, [(time, rate) for time in times for rate in rates], best)
            if best is None:
                return None
        return best

    def _list_times(self, number: int, ratio: float, reach: float, best_known: Gains | None) -> list[float]:
        """Times that grow by a ratio, ascending."""
        plants, sample = self.search.plants, self.search.sampling.sample_time
        delay = plants[0].dead_time + sample / 2
        second = plants[0].second_time_constant
        slow = (0.0 if plants[0].integrating else plants[0].time_constant) + second + delay
        low, high = (
            (MIN_TIME_FACTOR * delay, MAX_TIME_FACTOR * slow)
            if number == 1
            else (MIN_DERIVATIVE * delay, MAX_DERIVATIVE * (delay + second))
        )
        if best_known is not None:
            middle = best_known.integral_time if number == 1 else best_known.derivative_time
            low, high = middle / reach, middle * reach
        least, most = self._limit_range(number, (low, high))
        count = max(0, int(log(most / least) / log(ratio) + 0.5)) if most > least else 0
        return [min(least * ratio**i, most) for i in range(count + 1)]

    def _limit_range(self, number: int, ends: tuple[float, float]) -> tuple[float, float]:
        """A range within what the PLC holds of a number, in the units of the search."""
        if self.loop is None or self.model is None:
            return ends
        words = self.loop.words
        limits = words.limits(self.model, words.names[number])
        if limits is None or self.loop.independent:
            return ends
        scale = self._unit_scale(number)
        low = float(limits.low or 0) / scale
        high = inf if limits.high is None else float(limits.high) / scale
        if number == 1 and Decimal(limits.high or 0) == words.no_integral:
            high *= MS_MARGIN
        return max(low, ends[0]), min(high, ends[1])

    def _unit_scale(self, number: int) -> float:
        """From the search's unit to that of a word."""
        if self.loop is None:
            return 1.0
        return gain_factor(self.loop) if number == 0 else 1 / 60 if number == 1 and self.loop.minutes else 1.0

    # --- words -------------------------------------------------------------------------------------------------------

    def best_words(self, real: Result) -> Result:
        """The best words: all of PI, those around the best of PID; raises `TuningError` where they are too coarse."""
        best = self.search.find_best(
            self._search_all_words if self.form == "PI" else lambda: self._search_words_around(real.gains)
        )
        if best is None:
            raise TuningError("no word of the PLC keeps Ms below its limit: its gain is too coarse for this process")
        return best

    def _search_all_words(self) -> Candidate | None:
        rows = [(time, 0.0) for time in reversed(list(self._word_axis(1).values_between(0, inf)))]
        return self.search.search_rows(self._word_axis(0), rows)

    def _search_words_around(self, start: Gains) -> Candidate | None:
        best, times, rates = None, self._word_axis(1), self._word_axis(2)
        for time_reach, rate_reach, count in WORD_REACHES:
            integral_times = list(
                times.values_between(start.integral_time / time_reach, start.integral_time * time_reach)
            )
            derivative_times = list(
                rates.values_between(start.derivative_time / rate_reach, start.derivative_time * rate_reach)
            )
            rows = [
                (time, rate) for time in _thin_out(integral_times, count) for rate in _thin_out(derivative_times, count)
            ]
            gains = self._word_axis(0).narrow(start.gain, time_reach)
            best = self.search.search_rows(gains, sorted(rows), best)
            if best is None:
                return None
            start = best.gains
        return best

    def _word_axis(self, number: int) -> Words:
        """All words of a number, in the units of the search."""
        if self.loop is None or self.model is None:
            raise AssertionError("words are those of a PLC")
        name = self.loop.words.names[number]
        step = self.loop.words.step(name) or Decimal(1)
        limits = self.loop.words.limits(self.model, name)
        first = 1
        last = int(Decimal(limits.high) / step) if limits is not None and limits.high is not None else 9999
        while last > first and not self._is_word(name, last * step):
            last -= 1
        return Words(float(step) / self._unit_scale(number), first, last)

    def _is_word(self, name: str, value: Decimal) -> bool:
        """Whether a word has a value and keeps its term on."""
        try:
            return self.loop is not None and self.loop.words.stored_value(name, value) == value
        except EncodeError:
            return False

    def round_gains(self, real: Result) -> Result:
        """Real numbers as registers in floating point hold them; a last digit less gain where Ms would be too large."""
        gains = real.gains
        while True:
            result = self.search.try_gains(self._stored_gains(gains))
            if result.ms <= self.search.ms:
                return result
            gains = replace(gains, gain=gains.gain * MS_MARGIN)

    def _stored_gains(self, gains: Gains) -> Gains:
        """As the registers hold them; a number that does not fit stays, and is told with the result."""
        if self.loop is None or self.model is None:
            return gains
        values = [value.stored for value in fit_loop(gains, self.model, self.loop)]
        if None in values:
            return gains
        gain, integral, derivative = (float(value or 0) for value in values)
        gain /= self._unit_scale(0)
        if self.loop.independent:
            return Gains(gain, gain / integral, derivative / gain)
        return Gains(gain, integral / self._unit_scale(1), derivative)


def _thin_out(values: Sequence[float], count: float) -> Iterator[float]:
    """About so many of them, evenly."""
    yield from values[:: max(1, round(len(values) / count))]
