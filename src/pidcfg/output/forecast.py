"""What the words of a loop do on its process: a step of the set point and one of the load, run on the virtual PLC."""

from __future__ import annotations

from dataclasses import replace
from math import ceil, isinf, log
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import ValidationError

from pidcfg.schemas.base import units_of
from pidcfg.schemas.scenario import Scenario
from pidcfg.sim.controllers.plc import IN_CONTROL, TICKS
from pidcfg.sim.engine.run import Run, Settings, UnusableError, base_step, begin_run, options
from pidcfg.sim.judgement.meters import Band, overshoot, settling_time
from pidcfg.text.frozen import frozen
from pidcfg.tuning.margins import Answer
from pidcfg.tuning.rules import TuningError
from pidcfg.validate.engine import check_document

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from pidcfg.encoders.regmap import LoopTuning
    from pidcfg.output.retune import Written
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.text.paths import Data
    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.transfer import Transfer

STEP, LEAST_COUNTS = 0.1, 40
"""Of the PV's range, and counts of the PV at least: how far the set point steps."""
COUNTED = 1000
"""An output with such a range may be one of counts, and rests at a whole one."""
HEADROOM = 0.7
"""Of the way from the middle of the output to its limits, that the first move of a step may take."""
LENGTH = 12
"""Times the slowest time of loop and process: how long each of the two steps is looked at."""
MOST_LOOP_STEPS = 150_000
"""Of a run: more take too long, and a loop that samples so often is as good as a continuous one."""
ATTEMPTS, SHORTER = 3, 0.9
"""Runs with a shorter step where the output meets a limit, each of this part of what it would take."""
HUNTS = 0.05
"""Of the IAE, that the error of the second half, were it all the time, would make."""
LOOKS = 8
"""At a step, from its beginning to its end."""
SETTLED = 0.05
"""Of the step: within which a PV has settled."""
BESIDE, LEAST_SHARE, UNLIMITED = 0.5, 0.01, 1e5
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
class Around:
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
    def of(cls, loop: LoopTuning) -> Around:
        """Of a loop as its file holds it."""
        share, seconds, raises = loop.pv_share, loop.sample_time, loop.raises_pv
        filtered = seconds is not None and 0 < share < 1
        action = None if raises is None else loop.words.heating if raises else loop.words.cooling
        lag = -(seconds or 0.0) / log(1 - share) if filtered else 0.0
        return cls(seconds, lag, action, 100.0 if loop.output_span is None else float(loop.output_span))


@frozen
class Forecast:
    """What a run of the words shows, or why there is none."""

    why: str = ""
    """Why nothing ran; empty: it did."""
    answer: Answer | None = None
    step: tuple[float, float] = (0.0, 0.0)
    """The set point before and after."""
    largest: float = 0.0
    """A step of the set point up to which the output stays within its limits."""
    settled: bool = True
    rest: float = 0.0
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
            "largest_step": self.largest,
            "settles": self.settled,
            "hunts": self.hunts,
            "error_at_the_end": self.rest,
            "pv_range": list(self.pv_range),
            "output_limits": list(self.limits),
        }

    def warnings(self) -> Iterator[str]:
        """What an engineer has to know."""
        if not self.why and not self.settled:
            yield "with these words the PV does not settle"


class Recorded(NamedTuple):
    """The numbers of a record, which must be in the units of the loop that is to have its gains."""

    file: str
    pv: tuple[float, float]
    """Lowest and highest."""
    step: float
    """Of the output."""
    units: tuple[str, str] = ("", "")
    """Of output and PV, as the headers say."""

    def refuse(self, where: str, pv_range: tuple[float, float], output_span: float, units: Mapping[str, str]) -> None:
        """Raises `TuningError` for numbers that are surely in other units: their gain would be wrong by as much."""
        if what := self._other_units(units) or self._other_numbers(pv_range, output_span):
            raise TuningError(
                f"{where}: {self.file} is in other units: {what}; bring the record to the units of the loop (counts or "
                "shares of 1 may have been recorded); nothing was written"
            )

    def _other_units(self, units: Mapping[str, str]) -> str:
        """What the headers say that the loop contradicts."""
        for side, unit in zip(("output", "pv"), self.units, strict=True):
            known, there = (KNOWN_UNITS.get(text.casefold()) for text in (unit, units.get(side, "")))
            if known and there and known != there:
                return (
                    f"its header has {unit} for the {'PV' if side == 'pv' else side}, which is in {units[side]} there"
                )
        return ""

    def _other_numbers(self, pv_range: tuple[float, float], output_span: float) -> str:
        """What lies far beside the loop's ranges."""
        low, high = pv_range
        margin = (high - low) * BESIDE
        if high - low < UNLIMITED and (self.pv[0] > high + margin or self.pv[1] < low - margin):
            return f"the PV goes from {self.pv[0]:.6g} to {self.pv[1]:.6g}, and its range there is {low:g} to {high:g}"
        if output_span < UNLIMITED and not LEAST_SHARE <= self.step / output_span <= 1 + BESIDE:
            share = f"{100 * self.step / output_span:.3g} % of the {output_span:g} that it has there"
            return f"the output steps by {self.step:.6g}, {share}"
        return ""


def forecast_words(
    written: Written, around: Around, plant: Transfer | None, gains: Gains, recorded: Recorded | None = None
) -> Forecast:
    """What the words do on a process, whose gain has its sign; raises `TuningError` for a record in other units."""
    if plant is None:
        return Forecast("the gain of the process is not known")
    if plant.zeros:
        return Forecast("a transfer function with zeros is no plant of a run")
    checked = check_document(written.document)
    if checked.vendor is None or checked.encoding is None or not checked.encoding.whole:
        return Forecast(f"{written.file} has errors")
    controller, image = checked.vendor.module("controller"), checked.encoding.image
    trial = Trial(controller.load(image), written.loop, around, plant, gains)
    if recorded is not None:
        where = f"{written.file}: {written.loop}"
        units = units_of(checked.config.loops[trial.i])
        recorded.refuse(where, (trial.bottom, trial.top), (trial.high - trial.low) * trial.unit, units)
    seen = _run(trial, controller, image)
    for _ in range(ATTEMPTS):
        if seen.why or not trial.shorten(seen):
            break
        seen = _run(trial, controller, image)
    return seen


def _run(trial: Trial, controller: Any, image: object) -> Forecast:
    """What one run shows."""
    try:
        scenario = Scenario.model_validate(trial.scenario())
        steps = trial.steps(base_step(scenario, trial.plc))
        if steps * len(trial.plc.loops) > MOST_LOOP_STEPS:
            return Forecast(f"a run of {steps:,} steps would take too long")
        run = begin_run(scenario, lambda: controller.load(image, options(scenario, controller)), controller, SETTINGS)
    except (ValidationError, UnusableError) as error:
        return Forecast(f"the loop does not run alone: {str(error).splitlines()[0]}")
    return trial.watch(run)


SETTINGS = Settings(judged=False, reference=False)


class Trial:
    """A loop alone with its process: from rest, a step of its set point, and then one at its output."""

    def __init__(self, plc: Plc, loop: str, around: Around, plant: Transfer, gains: Gains) -> None:
        self.plc, self.loop, self.i = plc, loop, plc.loops.index(loop)
        shown = plc.outputs[self.i] if plc.outputs else (0.0, around.output_span)
        self.unit = around.output_span / abs(shown[1] - shown[0])
        self.plant = replace(plant, gain=plant.gain * self.unit)
        self.gains = replace(gains, gain=gains.gain / self.unit)
        self.low, self.high = plc.output_limits(self.i, plc.signal_values)
        self.bottom, self.top, counts = plc.scales[self.i]
        span, middle = self.top - self.bottom, (self.low + self.high) / 2
        self.rest = middle if self.high - self.low < COUNTED else float(round(middle))
        self.push = STEP * (self.high - self.low)
        reach = HEADROOM * (self.high - self.low) / 2
        most = reach / max(self.gains.gain, 0.0 if plant.integrators else 1 / abs(self.plant.gain))
        self.least = LEAST_COUNTS * span / counts
        self.step = max(min(STEP * span, most), self.least)
        self.begin = (self.top + self.bottom - self.step) / 2

    def shorten(self, seen: Forecast) -> bool:
        """Takes a smaller step where the output met a limit; whether there is one."""
        shorter = max(seen.largest * SHORTER, self.least)
        if seen.largest >= self.step or shorter >= self.step:
            return False
        self.step, self.begin = shorter, (self.top + self.bottom - shorter) / 2
        return True

    def length(self) -> float:
        """How long each part lasts, in s, in whole samples."""
        plant, gains = self.plant, self.gains
        times = [*plant.poles, plant.dead_time, gains.derivative_time]
        if not isinf(gains.integral_time):
            loud = abs(plant.gain * gains.gain)
            times += [gains.integral_time, (1 if plant.integrators else gains.integral_time) / loud]
        seconds = self.plc.configs[self.i].period / TICKS
        return float(ceil(LENGTH * max(times) / seconds + LENGTH) * seconds)

    def steps(self, step: int) -> int:
        """Base steps of the whole run, each so many ticks."""
        return ceil(3 * self.length() * TICKS / step)

    def scenario(self) -> Data:
        """As a file would have it."""
        length, load = self.length(), self._load()
        plants = self._plants(load)
        start: list[Data] = [{"at": 0, "loop": self.loop, "set": {"setpoint": self.begin}}]
        if self.plc.goals[self.i] != "auto":
            start.insert(0, {"at": 0, "loop": self.loop, "mode": "auto"})
        return {
            "pidcfg": 1,
            "scenario": "forecast",
            "config": "-",
            "duration": 3 * length,
            "initial": {self.loop: self.rest},
            "plants": plants,
            "connect": {self.plc.inlets.get(self.loop, f"{self.loop}.PV"): plants[-1]["name"]},
            "events": [
                *start,
                {"at": length, "loop": self.loop, "set": {"setpoint": self.begin + self.step}},
                {"at": 2 * length, "plant": plants[0]["name"], "disturb": {"load": load + self.plant.gain * self.push}},
            ],
        }

    def _load(self) -> float:
        """With which the PV rests at the first set point while the output rests in the middle."""
        return (0.0 if self.plant.integrators else self.begin) - self.plant.gain * self.rest

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
        own = {"gain": plant.gain, "dead_time": plant.dead_time, "load": load}
        for n, row in enumerate(rows):
            row.update(own if n == 0 else {"gain": 1.0})
            rest = self.begin if n + 1 == len(rows) or not plant.integrators else 0.0
            row.update({"name": f"process_{n + 1}", "input": inputs[n], "initial": rest})
        return rows

    def watch(self, run: Run) -> Forecast:
        """Runs, and reads the meter of the loop when its set point steps, when the load does, and at the end."""
        meter, signals = run.machine.meters[self.i], run.net.signal_values
        first, second = (int(n * self.length() * TICKS) // run.step for n in (1, 2))
        run.chunk = max(1, (second - first) // LOOKS)
        errors, past, out, settled, late = [0.0], None, 0.0, True, [(0, 0.0), (0, 0.0)]
        up = down = 0.0
        for k in run.course():
            if k == first:
                if self.plc.mode(meter.status) not in IN_CONTROL:
                    return Forecast(f"the loop is in {self.plc.mode(meter.status)} when its set point steps")
                meter.out_low = meter.out_high = out = signals[meter.out]
                errors = [meter.iae]
            elif first < k <= (first + second) / 2:
                late[0] = (k, meter.iae)
            elif k == second:
                errors.append(meter.iae)
                past = overshoot(meter, Band(self.i, SETTLED))
                settled = settling_time(meter, run.machine.bands[self.i], k - 1, run.dt) is not None
                up, down = meter.out_high - out, out - meter.out_low
            elif second < k <= (3 * second - first) / 2:
                late[1] = (k, meter.iae)
        step = abs(meter.after - meter.before)
        if past is None or not step:
            return Forecast("the set point does not move: see its limits")
        room = min((self.high - out) / max(up, 1e-12), (out - self.low) / max(down, 1e-12))
        of_setpoint, of_load = (
            None if isinf(self.gains.integral_time) else (b - a) * run.dt / unit
            for a, b, unit in zip(errors, (*errors[1:], meter.iae), (step, self.push * self.unit), strict=True)
        )
        ends = zip((second, run.last), (*errors[1:], meter.iae), late, strict=True)
        rest = max((iae - before) / (k - begin) for k, iae, (begin, before) in ends)
        return Forecast(
            answer=Answer(past, of_setpoint, of_load),
            step=(meter.before, meter.after),
            largest=step * room,
            settled=settled,
            rest=rest,
            hunts=rest * (second - first) > HUNTS * (errors[1] - errors[0]),
            pv_range=(self.bottom, self.top),
            limits=(self.low, self.high),
        )
