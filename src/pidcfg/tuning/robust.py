"""Robust gains: the best real numbers, the best that a PLC can hold, and what its grid costs.

`search` has the design of the search itself. Here are the numbers that are tried: all words of gain and reset where
they are words, grids that become finer where they are numbers in floating point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from decimal import Decimal
from math import inf, log
from typing import TYPE_CHECKING

from pidcfg.encoders.words import EncodeError
from pidcfg.refs import Decision
from pidcfg.tuning.fit import fit_loop, gain_factor
from pidcfg.tuning.published import simc
from pidcfg.tuning.rules import Gains, TuningError
from pidcfg.tuning.search import Ratios, Words

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pydantic import BaseModel

    from pidcfg.encoders.tuned import LoopTuning
    from pidcfg.tuning.rules import Form
    from pidcfg.tuning.search import Candidate, Result, Search
    from pidcfg.tuning.uncertainty import Spread

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
LEAST_TIME, MOST_TIMES = 0.2, 20.0
"""Of the delay of the loop, and of all times: the range of integral times."""
LEAST_DERIVATIVE, MOST_DERIVATIVE = 0.05, 4.0
"""Of the delay and the second time constant: the range of derivative times."""
BELOW = 1 - 1e-6
"""Of the limit of Ms, for numbers that are rounded afterwards."""
WORDS_AROUND = ((1.08, 1.2, 12), (1.025, 1.05, inf))
"""Reach of integral and derivative times around the best so far, and about how many of each; infinite: all words."""


@dataclass(frozen=True, slots=True)
class Robust:
    """The gains that a loop gets, and the best real numbers beside them."""

    result: Result
    """As the PLC holds them; real numbers without a PLC."""
    real: Result
    words: bool
    """Whether the gains are words with steps between them."""
    every_word: bool
    """Whether there is no better word at all."""
    spreads: tuple[Spread, ...]
    plants: int
    limit: float
    """Of Ms."""
    search: Search

    @property
    def cost_percent(self) -> float:
        """What the PLC's words cost, in IAE."""
        return (self.result.error / self.real.error - 1) * 100


def robust(
    form: Form,
    search: Search,
    loop: LoopTuning | None,
    model: type[BaseModel] | None,
    spreads: Sequence[Spread] = (),
) -> Robust:
    """The gains for a loop, or real numbers; raises `TuningError` where none keep Ms below its limit."""
    grid = _Grid(search, form, loop, model)
    limit = search.ms
    search.begin(simc("PI", search.plants[0]))
    real = grid.real()
    result, words, every = real, False, False
    if loop is not None and model is not None:
        words = loop.words.step(loop.words.names[0]) is not None
        every = words and form == "PI"
        result = grid.words(real) if words else grid.rounded(real)
    return Robust(result, real, words, every, tuple(spreads), len(search.plants), limit, search)


@dataclass
class _Grid:
    """The numbers that are tried."""

    search: Search
    form: Form
    loop: LoopTuning | None
    model: type[BaseModel] | None

    def real(self) -> Result:
        """The best real numbers."""
        best = self.search.best(self._levels)
        if best is None:
            process, limit = self.search.plants[0], self.search.ms
            raise TuningError(
                f"no {self.form} controller keeps Ms below {limit:g} on all {len(self.search.plants)} plants "
                f"(dead time {process.dead_time:g} s, sample time {self.search.sampling.sample_time:g} s); allow a "
                "larger Ms, or narrow what varies"
            )
        return best

    def _levels(self) -> Candidate | None:
        """The best of grids that become finer."""
        best: Candidate | None = None
        for time_ratio, gain_ratio, reach, *derivative in PID_LEVELS if self.form == "PID" else PI_LEVELS:
            around = None if best is None else best.gains
            times = self._times(1, time_ratio, reach, around)
            rates = self._times(2, derivative[0], derivative[1], around) if derivative else [0.0]
            around_gain = (0.0, inf) if around is None else (around.gain / reach**2, around.gain * reach**2)
            axis = Ratios(gain_ratio, *self._range(0, around_gain))
            best = self.search.among(axis, [(time, rate) for time in times for rate in rates], best)
            if best is None:
                return None
        return best

    def _times(self, number: int, ratio: float, reach: float, around: Gains | None) -> list[float]:
        """Times that grow by a ratio, ascending."""
        plants, sample = self.search.plants, self.search.sampling.sample_time
        dead = plants[0].dead_time + sample / 2
        second = plants[0].second_time_constant
        slow = (0.0 if plants[0].integrating else plants[0].time_constant) + second + dead
        low, high = (
            (LEAST_TIME * dead, MOST_TIMES * slow)
            if number == 1
            else (LEAST_DERIVATIVE * dead, MOST_DERIVATIVE * (dead + second))
        )
        if around is not None:
            middle = around.integral_time if number == 1 else around.derivative_time
            low, high = middle / reach, middle * reach
        least, most = self._range(number, (low, high))
        count = max(0, int(log(most / least) / log(ratio) + 0.5)) if most > least else 0
        return [least * ratio**i for i in range(count + 1)]

    def _range(self, number: int, wanted: tuple[float, float]) -> tuple[float, float]:
        """A range within what the PLC holds of a number, in the units of the search."""
        if self.loop is None or self.model is None:
            return wanted
        words = self.loop.words
        limits = words.limits(self.model, words.names[number])
        if limits is None or self.loop.independent:
            return wanted
        scale = self._scale(number)
        low = float(limits.low or 0) / scale
        high = inf if limits.high is None else float(limits.high) / scale
        if number == 1 and Decimal(limits.high or 0) == words.no_integral:
            high *= BELOW
        return max(low, wanted[0]), min(high, wanted[1])

    def _scale(self, number: int) -> float:
        """From the search's unit to that of a word."""
        if self.loop is None:
            return 1.0
        return gain_factor(self.loop) if number == 0 else 1 / 60 if number == 1 and self.loop.minutes else 1.0

    # --- words -------------------------------------------------------------------------------------------------------

    def words(self, real: Result) -> Result:
        """The best words: all of PI, those around the best of PID; raises `TuningError` where they are too coarse."""
        best = self.search.best(self._all_words if self.form == "PI" else lambda: self._words_around(real.gains))
        if best is None:
            raise TuningError("no word of the PLC keeps Ms below its limit: its gain is too coarse for this process")
        return best

    def _all_words(self) -> Candidate | None:
        rows = [(time, 0.0) for time in reversed(list(self._axis(1).between(0, inf)))]
        return self.search.among(self._axis(0), rows)

    def _words_around(self, near: Gains) -> Candidate | None:
        best, times, rates = None, self._axis(1), self._axis(2)
        for time_reach, rate_reach, many in WORDS_AROUND:
            ours = list(times.between(near.integral_time / time_reach, near.integral_time * time_reach))
            theirs = list(rates.between(near.derivative_time / rate_reach, near.derivative_time * rate_reach))
            rows = [(time, rate) for time in _thinned(ours, many) for rate in _thinned(theirs, many)]
            gains = self._axis(0).around(near.gain, time_reach)
            best = self.search.among(gains, sorted(rows), best)
            if best is None:
                return None
            near = best.gains
        return best

    def _axis(self, number: int) -> Words:
        """All words of a number, in the units of the search."""
        if self.loop is None or self.model is None:
            raise AssertionError("words are those of a PLC")
        name = self.loop.words.names[number]
        step = self.loop.words.step(name) or Decimal(1)
        limits = self.loop.words.limits(self.model, name)
        first = 1
        last = int(Decimal(limits.high) / step) if limits is not None and limits.high is not None else 9999
        while last > first and not self._holds(name, last * step):
            last -= 1
        return Words(float(step) / self._scale(number), first, last)

    def _holds(self, name: str, value: Decimal) -> bool:
        """Whether a word has a value and keeps its term on."""
        try:
            return self.loop is not None and self.loop.words.stored(name, value) == value
        except EncodeError:
            return False

    def rounded(self, real: Result) -> Result:
        """Real numbers as registers in floating point hold them; a last digit less gain where Ms would be too large."""
        gains = real.gains
        while True:
            result = self.search.judged(self._stored(gains))
            if result.ms <= self.search.ms:
                return result
            gains = replace(gains, gain=gains.gain * BELOW)

    def _stored(self, gains: Gains) -> Gains:
        """As the registers hold them; a number that does not fit stays, and is told with the result."""
        if self.loop is None or self.model is None:
            return gains
        values = [value.stored for value in fit_loop(gains, self.model, self.loop)]
        if None in values:
            return gains
        gain, integral, derivative = (float(value or 0) for value in values)
        gain /= self._scale(0)
        if self.loop.independent:
            return Gains(gain, gain / integral, derivative / gain)
        return Gains(gain, integral / self._scale(1), derivative)


def _thinned(values: Sequence[float], many: float) -> Iterator[float]:
    """About so many of them, evenly."""
    yield from values[:: max(1, round(len(values) / many))]
