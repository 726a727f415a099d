"""The samples of a batch: what is drawn, each run as a scenario of its own, in one process or several."""

from __future__ import annotations

import hashlib
import pickle
import platform
import re
import sys
from array import array
from dataclasses import dataclass, field, replace
from functools import cache, cached_property, partial
from importlib.metadata import PackageNotFoundError, version
from math import ceil, inf
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, cast

from pidcfg.schemas.scenario import rejoin_expressions
from pidcfg.sim.controllers.plc import axes_of, signals_of
from pidcfg.sim.engine.recording import Recording
from pidcfg.sim.engine.repeat import IrregularError, RepeatedRun, replace_numbers
from pidcfg.sim.engine.run import Settings, UnusableError, simulate
from pidcfg.sim.judgement.meters import METRICS
from pidcfg.sim.judgement.report import ten_digits
from pidcfg.study.scenario import LoadedScenario, load_scenario, read_scenario
from pidcfg.text.document import Plain
from pidcfg.text.frozen import frozen
from pidcfg.text.paths import parse_path, set_value
from pidcfg.text.processes import ITEMS_AHEAD, WorkerPool
from pidcfg.text.references import Decision
from pidcfg.text.source import read_document
from pidcfg.text.writer import json_line

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from pidcfg.schemas.scenario import Bound, Expectation, Scenario
    from pidcfg.sim.controllers.plc import Plc
    from pidcfg.sim.engine.expressions import Problem
    from pidcfg.sim.engine.run import Run
    from pidcfg.sim.judgement.report import Note, Report, Standing, Verdict
    from pidcfg.study.uncertainty import NumberSpread, Uncertainty
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

# ----------------------------------------------------------------------------------------------------------------------
# Random numbers by counters: a sample's depend on the seed, its number, and the name of what varies, on nothing else.
# SplitMix64 (Steele, Lea and Flood 2014) mixes a counter to 64 bits. Every sample has 64 bits of its own, of which 63
# are the seed of its scenario; every uncertainty has a row of numbers that begins at those bits and its name.

D801 = Decision(
    801,
    "how a sample is drawn",
    "The 64 bits of sample i are SplitMix64 at seed + (i + 1)·0x9E3779B97F4A7C15 modulo 2⁶⁴; their upper 63 seed the "
    "noise of its scenario. The row of an uncertainty begins at those bits XOR the first eight bytes of SHA-256 of "
    "`plants.NAME.KEY` or `loops.NAME.KEY`, mixed once; each number is the upper 53 bits of the next one, plus a half, "
    "over 2⁵³. A normal number is the inverse of its distribution there (Wichura's AS 241, as in Python's statistics); "
    "one outside its limits is drawn again from its row, at most 100 times, after which the sample cannot run.",
    "Samples are independent, more of them continue the same row, and another uncertainty in the file does not change "
    "those that were there.",
)
GOLDEN_STEP, BITS_MASK = 0x9E3779B97F4A7C15, (1 << 64) - 1
MAX_DRAWS = 100
"""Numbers that are drawn for one that has limits."""
STANDARD_NORMAL = NormalDist()


class DrawError(Exception):
    """No number within its limits was drawn."""


def mix_bits(counter: int) -> int:
    """SplitMix64's output for a counter."""
    z = counter & BITS_MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & BITS_MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & BITS_MASK
    return z ^ (z >> 31)


def bits_of(seed: int, sample: int) -> int:
    """The 64 bits of a sample."""
    return mix_bits(seed + (sample + 1) * GOLDEN_STEP)


def seed_of(seed: int, sample: int) -> int:
    """The seed of a sample's scenario, 63 bits."""
    return bits_of(seed, sample) >> 1


@cache
def _name_bits(row: str) -> int:
    return int.from_bytes(hashlib.sha256(row.encode()).digest()[:8], "big")


def unit_number(seed: int, sample: int, row: str, draw: int = 0) -> float:
    """A number above 0 and below 1: the one at ``draw`` in a row of a sample."""
    begin = mix_bits(bits_of(seed, sample) ^ _name_bits(row))
    return ((mix_bits(begin + (draw + 1) * GOLDEN_STEP) >> 11) + 0.5) / (1 << 53)


def draw_number(uncertainty: Uncertainty, seed: int, sample: int) -> float:
    """The number of a sample; raises `DrawError`."""
    spread = uncertainty.spread
    for draw in range(MAX_DRAWS):
        value = quantile(spread, unit_number(seed, sample, uncertainty.random_stream, draw))
        if spread.low <= value <= spread.high:
            return value
    raise DrawError(f"{uncertainty.label}: {MAX_DRAWS} numbers, none within {spread.low:g} to {spread.high:g}")


def quantile(spread: NumberSpread, probability: float) -> float:
    """Where a spread reaches a share, its limits left aside."""
    if spread.sigma is None:
        return spread.low + (spread.high - spread.low) * probability
    return spread.mean + spread.sigma * STANDARD_NORMAL.inv_cdf(probability)


def fifth_bounds(spread: NumberSpread) -> tuple[float, float]:
    """Below the first lies a fifth of all samples, above the second another one."""
    if spread.sigma is None:
        return quantile(spread, 0.2), quantile(spread, 0.8)
    low = 0.0 if spread.low == -inf else STANDARD_NORMAL.cdf((spread.low - spread.mean) / spread.sigma)
    high = 1.0 if spread.high == inf else STANDARD_NORMAL.cdf((spread.high - spread.mean) / spread.sigma)
    span = high - low
    if not span > 0:  # limits so far out that no number comes there
        return spread.low, spread.high
    return quantile(spread, low + 0.2 * span), quantile(spread, low + 0.8 * span)


# --- The data of a scenario as YAML in block style, each scalar as the file had it: unquoted ones stay unquoted -------

SAFE_KEY = re.compile(r"[A-Za-z_][\w.\-]*")
NEEDS_QUOTES = re.compile("[\n\r\x85\u2028\u2029\t]|: | #|^[-?:] ")
"""What an unquoted scalar of a block cannot hold."""


def block_yaml(data: dict[str, Any]) -> str:
    """A mapping as YAML; reading it gives the same data."""
    return "\n".join(_yaml_lines(data, 0)) + "\n"


def _yaml_lines(value: Any, depth: int) -> Iterator[str]:
    """A mapping or a list that holds something, a line each."""
    indent = "  " * depth
    entries = (
        ((f"{_yaml_key(key)}:", item) for key, item in value.items())
        if isinstance(value, dict)
        else (("-", v) for v in value)
    )
    for begin, item in entries:
        if isinstance(item, dict | list) and item:
            first, *rest = _yaml_lines(item, depth + 1)
            if begin == "-":
                yield f"{indent}- {first.lstrip(' ')}"
                yield from rest
            else:
                yield f"{indent}{begin}"
                yield first
                yield from rest
        else:
            yield f"{indent}{begin} {_yaml_scalar(item)}"


def _yaml_key(key: str) -> str:
    return key if SAFE_KEY.fullmatch(key) else json_line(key)


def _yaml_scalar(value: Any) -> str:
    if isinstance(value, Plain) and value and not NEEDS_QUOTES.search(value):
        return str(value)
    return json_line(str(value) if isinstance(value, str) else value)


# --- A sample as the scenario that it is: data with the drawn numbers in place, and its text --------------------------


class UnusableSampleError(Exception):
    """A sample that cannot run, and why."""


@frozen
class Batch:
    """A scenario and what varies in it: everything that a sample is made of."""

    document: Document
    varies: Sequence[Uncertainty]
    seed: int
    plc: bytes = b""
    """A new PLC as `pickle` keeps it, which is read many times as fast as words are decoded; empty: each is loaded."""

    def draw_numbers(self, sample: int) -> list[float]:
        """The drawn numbers of a sample; raises `UnusableSampleError`."""
        try:
            return [draw_number(uncertainty, self.seed, sample) for uncertainty in self.varies]
        except DrawError as error:
            raise UnusableSampleError(str(error)) from None

    def new_plc(self, loaded: LoadedScenario) -> Plc:
        """A PLC at its program-to-run transition; the same for all samples, since no key of ``plc`` varies."""
        return cast("Plc", pickle.loads(self.plc)) if self.plc else loaded.new_plc()  # noqa: S301 - our own bytes

    def scenario_data(self, sample: int, numbers: Sequence[float]) -> dict[str, Any]:
        """The scenario of a sample as plain data."""
        data: dict[str, Any] = dict(rejoin_expressions(self.document.data))  # type: ignore[call-overload]  # a mapping, as it is loaded
        texts = {
            uncertainty: Plain(uncertainty.number_text(number))
            for uncertainty, number in zip(self.varies, numbers, strict=True)
        }
        data["scenario"] = f"{data['scenario']} (sample {sample})"
        data["seed"] = Plain(seed_of(self.seed, sample))
        if "plants" in data:
            data["plants"] = _set_plants(data["plants"], texts)
        events = _first_events(texts)
        if events:
            data["events"] = [*events, *data.get("events", ())]
        if "expect" in data:
            data["expect"] = [
                {key: v for key, v in expectation.items() if key != "share"} for expectation in data["expect"]
            ]
        data.pop("vary", None)
        return data

    def make_scenario(self, sample: int, numbers: Sequence[float]) -> Scenario:
        """A sample as it runs; raises `UnusableSampleError`."""
        data = self.scenario_data(sample, numbers)
        scenario, findings = read_scenario(replace(self.document, data=data, problems=()))
        if scenario is None:
            raise UnusableSampleError("; ".join(finding.message for finding in findings))
        return scenario

    def repeat_scenario(self, base: Scenario, sample: int, numbers: Sequence[float]) -> Scenario:
        """The same, made of another sample's scenario, but for its title; raises `IrregularError`."""
        texts = {
            uncertainty: Plain(uncertainty.number_text(number))
            for uncertainty, number in zip(self.varies, numbers, strict=True)
        }
        plants = _set_plants(self.varied_plants, texts)
        return replace_numbers(base, seed_of(self.seed, sample), plants, _first_events(texts))

    @cached_property
    def varied_plants(self) -> dict[str | int, Any]:
        """The plants that vary, by their keys in the model: names of loops, or places in the list."""
        names = {uncertainty.name for uncertainty in self.varies if uncertainty.section == "plants"}
        plants: Any = dict(rejoin_expressions(self.document.data)).get("plants", {})  # type: ignore[call-overload]  # it has loaded
        entries = plants.items() if isinstance(plants, dict) else enumerate(plants)
        return {key: plant for key, plant in entries if str(plant.get("name", key)) in names}

    def scenario_text(self, sample: int, numbers: Sequence[float]) -> str:
        """A sample as the file that `pidcfg simulate` runs in the same way."""
        name = self.document.file.rpartition("/")[2]
        head = f"# Sample {sample} of pidcfg certify with seed {self.seed}, from {name}.\n"
        return head + block_yaml(self.scenario_data(sample, numbers))


def _first_events(texts: Mapping[Uncertainty, Plain]) -> list[dict[str, Any]]:
    """The events that write the drawn numbers of loops."""
    loops: dict[str, dict[str, Plain]] = {}
    for uncertainty, text in texts.items():
        if uncertainty.section == "loops":
            loops.setdefault(uncertainty.name, {})[uncertainty.key] = text
    return [{"at": Plain(0), "loop": Plain(name), "set": keys} for name, keys in loops.items()]


def _set_plants(plants: Any, texts: Mapping[Uncertainty, Plain]) -> Any:
    """The plants, by key or as a list, with the drawn numbers."""
    keyed = isinstance(plants, dict)
    copies = [(name, dict(plant)) for name, plant in (plants.items() if keyed else enumerate(plants))]
    for uncertainty, text in texts.items():
        for name, plant in copies:
            if uncertainty.section == "plants" and uncertainty.name == str(plant.get("name", name)):
                if isinstance(plant.get(uncertainty.key.partition(".")[0]), list):
                    plant[uncertainty.key.partition(".")[0]] = list(plant[uncertainty.key.partition(".")[0]])
                set_value(plant, parse_path(uncertainty.key), text)
    return dict(copies) if keyed else [plant for _, plant in copies]


# --- One sample through the ordinary simulation, and what a batch keeps of it -----------------------------------------


@frozen
class SampleResult:
    """What a batch keeps of a sample; it travels between processes."""

    sample: int
    numbers: tuple[float, ...] = ()
    """As drawn, in the order of the uncertainties."""
    passed: bool = False
    held: tuple[bool, ...] = ()
    """Of each expectation."""
    margin: float = inf
    """The smallest (limit − value) / |limit| of all expectations."""
    tightest: int = -1
    """The expectation that has it."""
    standing: str = ""
    """Of each standing expectation: ``+`` holds, ``-`` fails, ``!`` is not proven, ``a`` allowed, ``?`` not judged."""
    metrics: tuple[tuple[float | None, ...], ...] = ()
    """Of each loop, in the order of `METRICS`."""
    reason: str = ""
    """Why it could not run, or had an error on its way."""


def run_sample(
    loaded: LoadedScenario, batch: Batch, sample: int, settings: Settings
) -> tuple[SampleResult, Report | None]:
    """Runs a sample exactly as `pidcfg simulate` runs its written-out scenario."""
    numbers: Sequence[float] = ()
    try:
        numbers = batch.draw_numbers(sample)
        scenario = batch.make_scenario(sample, numbers)
        report = simulate(scenario, partial(batch.new_plc, loaded), loaded.controller, settings)
    except (UnusableSampleError, UnusableError) as error:
        return SampleResult(sample, tuple(numbers), margin=-inf, reason=str(error)), None
    metrics = [loop.metrics for loop in report.loops.values()]
    verdicts = RunVerdicts(report.expectations, report.standing, metrics, report.notes, report.problems)
    return _make_result(sample, numbers, scenario, verdicts), report


class Sampler:
    """Runs the samples of a batch, of which one run is made: the others are that run with other numbers."""

    def __init__(self, loaded: LoadedScenario, batch: Batch, settings: Settings) -> None:
        self.loaded, self.batch, self.settings = loaded, batch, settings
        self.repeated_run: RepeatedRun | None = None

    def run_sample(self, sample: int) -> SampleResult:
        """What `run_sample` finds; what the run cannot be made with runs by itself."""
        try:
            return self._repeat_run(sample)
        except (UnusableSampleError, UnusableError, IrregularError):
            return run_sample(self.loaded, self.batch, sample, self.settings)[0]

    def _repeat_run(self, sample: int) -> SampleResult:
        numbers, run = self._begin_run(sample)
        for _ in run.steps_to_end():
            pass
        judged_run = run.judge()
        verdicts = RunVerdicts(
            judged_run.evidence.verdicts, judged_run.standing, judged_run.metrics, judged_run.faults, run.problems
        )
        return _make_result(sample, numbers, run.scenario, verdicts)

    def record_sample(self, sample: int, thinned: ThinnedRecording) -> bool:
        """Takes down the signals of a sample; whether it could run."""
        try:
            _, run = self._begin_run(sample)
            run.settings = replace(run.settings, recording=thinned)
            for _ in run.steps_to_end():
                pass
        except (UnusableSampleError, UnusableError, IrregularError):
            settings = replace(self.settings, recording=thinned)
            return run_sample(self.loaded, self.batch, sample, settings)[1] is not None
        return True

    def _begin_run(self, sample: int) -> tuple[Sequence[float], Run]:
        """The drawn numbers of a sample, and its run at time 0."""
        batch, numbers = self.batch, self.batch.draw_numbers(sample)
        if self.repeated_run is None:
            scenario = batch.make_scenario(sample, numbers)
            new_plc, settings = partial(batch.new_plc, self.loaded), replace(self.settings, with_report=False)
            self.repeated_run = RepeatedRun(scenario, new_plc, self.loaded.controller, settings)
        else:
            scenario = batch.repeat_scenario(self.repeated_run.run.scenario, sample, numbers)
        return numbers, self.repeated_run.begin(scenario)


class RunVerdicts(NamedTuple):
    """What a run has shown, with or without a report."""

    expectations: Sequence[Verdict]
    standing: Sequence[Standing]
    metrics: Sequence[Mapping[str, float | None]]
    """Of each loop."""
    notes: Sequence[Note]
    problems: Sequence[Problem]


def _make_result(sample: int, numbers: Sequence[float], scenario: Scenario, verdicts: RunVerdicts) -> SampleResult:
    """What is kept of it."""
    expectations, standing, metrics, notes, problems = verdicts
    errors = [note.text for note in sorted(notes, key=lambda note: note.at) if note.error]
    errors += [problem.message for problem in problems if problem.severity == "error"]
    fails = bool(errors) or any(v.fails for v in standing)
    margins = [margin(expectation, v) for expectation, v in zip(scenario.expect, expectations, strict=True)]
    if fails:
        margins.append(-inf)
    min_margin = min(margins, default=inf)
    tightest = margins.index(min_margin) if margins else -1
    return SampleResult(
        sample,
        tuple(numbers),
        passed=not fails and all(v.passed for v in expectations),
        held=tuple(v.passed for v in expectations),
        margin=min_margin,
        tightest=tightest if tightest < len(scenario.expect) else -1,
        standing="".join(VERDICT_SIGNS[v.word] for v in standing),
        metrics=tuple(tuple(loop.get(name) for name in METRICS) for loop in metrics),
        reason="; ".join(errors),
    )


VERDICT_SIGNS = {"passed": "+", "FAILED": "-", "NOT PROVEN": "!", "allowed": "a", "not judged": "?"}
"""What a batch keeps of a verdict, by its `Standing.word`."""


def margin(expectation: Expectation, verdict: Verdict) -> float:
    """How far a value lies within its limits, as a share of the limit; of 0 in its unit.

    What has no number is at an end: infinite where it holds.
    """
    value, bounds = verdict.value, (expectation.min, expectation.max)
    if expectation.alarm is not None or expectation.flag is not None or expectation.mode is not None or value is None:
        return inf if verdict.passed else -inf
    values = value if isinstance(value, list) else [value, value]
    if not all(type(number) in {int, float} for number in values):
        return inf if verdict.passed else -inf
    if expectation.final is not None and expectation.tolerance is not None and bounds == (None, None):
        return _bound_share(expectation.tolerance, abs(float(values[0]) - float(expectation.final)), 1)
    if expectation.final is not None and not verdict.passed:
        return -inf
    shares = [
        _bound_share(bound, number, sign) for bound, number, sign in zip(bounds, values, (-1, 1), strict=True) if bound
    ]
    return min(shares, default=inf if verdict.passed else -inf)


def _bound_share(bound: Bound, value: float, sign: int) -> float:
    """How far a value lies below (``sign`` −1: above) a bound, as a share of it."""
    limit = float(bound.value)
    return sign * (limit - value) / (abs(limit) or 1.0)


# --- How far signals spread over time: samples 0 to 499, thinned to 400 times, and of these the quantiles at each -----

FAN_SAMPLES, FAN_TIMES = 500, 400
FAN_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles that are drawn."""


@dataclass(slots=True)
class ThinnedRecording(Recording):
    """Signals of one run at equal distances: at most `FAN_TIMES` values of each, the first and the last among them."""

    chosen_steps: list[int] = field(default_factory=list)
    columns: dict[str, array[float]] = field(default_factory=dict)
    _next_step: int = 0

    def begin(self, names: Sequence[str], steps: int, dt: float) -> None:
        """A run of so many base steps begins."""
        self.dt, self._rows, self._width, self._next_step = dt, 0, len(names), 0
        self._columns = [(i, name) for i, name in enumerate(names) if self.chosen is None or name in self.chosen]
        self.names = [name for _, name in self._columns]
        count = min(steps, FAN_TIMES)
        self.chosen_steps = [round(i * (steps - 1) / max(count - 1, 1)) for i in range(count)]
        self.columns = {name: array("d") for name in self.names}

    def add_rows(self, rows_of_values: Sequence[float], rows: int) -> None:
        """Rows of values, one a base step."""
        while self._next_step < len(self.chosen_steps) and self.chosen_steps[self._next_step] < self._rows + rows:
            row = (self.chosen_steps[self._next_step] - self._rows) * self._width
            for column, name in self._columns:
                self.columns[name].append(rows_of_values[row + column])
            self._next_step += 1
        self._rows += rows

    def end(self) -> None:
        """The run is over."""


@frozen
class Fan:
    """The spread of each signal."""

    samples: int
    times: Sequence[float]
    """In s."""
    quantiles: Mapping[str, Sequence[Sequence[float]]]
    """By signal, of each of `FAN_QUANTILES` a value a time."""


def fan_of(times: Sequence[float], runs: Sequence[Mapping[str, Sequence[float]]]) -> Fan:
    """The quantiles of some runs, each by its signals; a quantile is the value of the nearest rank."""
    ranks = [max(1, ceil(level * len(runs))) - 1 for level in FAN_QUANTILES]
    quantiles: dict[str, list[list[float]]] = {}
    for name in runs[0] if runs else ():
        columns = [sorted(values) for values in zip(*(run[name] for run in runs), strict=True)]
        quantiles[name] = [[column[rank] for column in columns] for rank in ranks]
    return Fan(len(runs), list(times), quantiles)


# --- Who runs the samples: this process, or several, whose results come back in the order of the samples --------------

SAMPLES_AT_ONCE = 8
"""Samples that a process takes at a time."""


class WorkersError(RuntimeError):
    """Nobody is left who runs the samples, and why."""


@frozen
class Job:
    """What a process needs to run samples: bytes, from which it reads everything itself."""

    name: str
    scenario: str
    config_name: str
    config: bytes
    seed: int
    engine: Literal["python", "numba"]
    limits: Limits

    def read(self, name: str, max_bytes: int) -> bytes:
        """As a `pidcfg.text.reader.Reader`: the only other file that there is."""
        del name
        return self.config[:max_bytes]

    def resolve(self, name: str, other: str) -> str:
        """As a `pidcfg.text.reader.Reader`."""
        del name, other
        return self.config_name

    @property
    def settings(self) -> Settings:
        """How each sample runs."""
        return Settings(self.engine, max_loop_steps=self.limits.loop_steps)

    def load_batch(self) -> tuple[LoadedScenario, Batch]:
        """The scenario with its configuration, and what varies."""
        loaded = load_scenario(
            read_document(self.scenario.encode("utf-8", "surrogatepass"), self.name, self.limits), self
        )
        plc = loaded.new_plc()
        plc_bytes = pickle.dumps(plc, pickle.HIGHEST_PROTOCOL)
        return loaded, Batch(loaded.document, loaded.uncertainties(plc)[0], self.seed, plc_bytes)

    def make_sampler(self) -> Sampler:
        """What runs its samples."""
        return Sampler(*self.load_batch(), self.settings)


def process_results(job: Job, first: int, samples: int, jobs: int) -> Iterator[SampleResult]:
    """The results of the samples from ``first`` on, in order; raises `WorkersError`.

    A process that is ended from outside costs what it had begun, unless they end one after the other.
    """
    if jobs == 1 or samples - first <= SAMPLES_AT_ONCE:
        yield from map(job.make_sampler().run_sample, range(first, samples))
        return
    while first < samples:
        before = first
        try:
            for part in WorkerPool(jobs, _make_runner, (job,)).results(process_parts(first, samples)):
                yield from part
                first += len(part)
        except ChildProcessError:
            if first == before:
                last = min(first + jobs * ITEMS_AHEAD * SAMPLES_AT_ONCE, samples) - 1
                why = "perhaps for want of memory, of which fewer --jobs need less"
                raise WorkersError(f"a process ended at samples {first} to {last}, {why}") from None


def process_parts(first: int, samples: int) -> Iterator[range]:
    """What a process takes at a time."""
    return (range(begin, min(begin + SAMPLES_AT_ONCE, samples)) for begin in range(first, samples, SAMPLES_AT_ONCE))


def _make_runner(job: Job) -> Callable[[range], list[SampleResult]]:
    """What runs samples one after the other."""
    sampler = job.make_sampler()
    return lambda samples: list(map(sampler.run_sample, samples))


def record_fan(job: Job, samples: int, jobs: int) -> Fan:
    """How the signals that a picture needs spread over the first samples; those that cannot run are left out."""
    samples = min(samples, FAN_SAMPLES)
    if jobs == 1 or samples <= SAMPLES_AT_ONCE:
        recorded = _make_recorder(job)(range(samples))
    else:
        recorded = [
            signals_of_run
            for part in WorkerPool(jobs, _make_recorder, (job,)).results(process_parts(0, samples))
            for signals_of_run in part
        ]
    ran = [signals_of_run for signals_of_run in recorded if signals_of_run is not None]
    return fan_of(ran[0][0] if ran else (), [signals for _, signals in ran])


RecordedSignals = tuple[list[float], dict[str, "array[float]"]]
"""Times in s, and the values of each signal."""


def _make_recorder(job: Job) -> Callable[[range], list[RecordedSignals | None]]:
    """What records samples one after the other."""
    sampler = job.make_sampler()
    signals = signals_of(axes_of(sampler.loaded.new_plc(), sampler.loaded.image.settings))

    def record(sample: int) -> RecordedSignals | None:
        thinned = ThinnedRecording(signals)
        if not sampler.record_sample(sample, thinned):
            return None
        return [ten_digits(step * thinned.dt) for step in thinned.chosen_steps], thinned.columns

    return lambda samples: list(map(record, samples))


# --- Which pidcfg runs ------------------------------------------------------------------------------------------------


PACKAGE = Path(__file__).parents[2]
"""The folder of pidcfg's sources."""


@cache
def hash_sources() -> str:
    """A hash of the package's sources."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(PACKAGE).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


# ----------------------------------------------------------------------------------------------------------------------
# Whether two machines calculate alike, which is tried and not assumed: the first samples of a batch, as a hash.

TRIAL_SAMPLES = 64
"""Of the beginning of a batch."""
PACKAGES = ("numba", "NumPy", "llvmlite", "distributed")
"""What calculates, and what carries the results, besides Python and pidcfg."""
NO_VERSION = "none"
HASH_CHARACTERS = 12
"""Characters of a hash that are shown."""


@dataclass(slots=True)
class Trial:
    """The first samples of a batch: how many, and a hash of all that was seen of them."""

    samples: int = 0
    _hash: Any = field(default_factory=hashlib.sha256)

    def add_result(self, result: SampleResult) -> None:
        """The next sample of the batch; those that come later than the first ones do not count."""
        if result.sample == self.samples < TRIAL_SAMPLES:
            self._hash.update(repr(result).encode())
            self.samples += 1

    def run_samples(self, job: Job, samples: int) -> None:
        """Runs what is missing of so many first samples."""
        count = min(samples, TRIAL_SAMPLES)
        if self.samples < count:
            for result in map(job.make_sampler().run_sample, range(self.samples, count)):
                self.add_result(result)

    @property
    def digest(self) -> str:
        """The hash."""
        return str(self._hash.hexdigest())


def describe_machine() -> dict[str, str]:
    """What calculates here."""
    return {
        "Python": sys.version,
        "machine": f"{platform.machine()} {platform.system()}",
        "pidcfg": hash_sources(),
        **{package: _package_version(package) for package in PACKAGES},
    }


def trial_facts(job: Job, samples: int) -> dict[str, str]:
    """All that must be alike: what calculates, and the hash of the first samples, or why they cannot run."""
    trial = Trial()
    try:
        trial.run_samples(job, samples)
    except Exception as error:  # noqa: BLE001 - whatever goes wrong on another machine is what differs there
        return {**describe_machine(), "samples": f"{type(error).__name__}: {error}"}
    return {**describe_machine(), "samples": trial.digest}


def _package_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return NO_VERSION


def name_differences(mine: Mapping[str, str], other: Mapping[str, str]) -> list[str]:
    """What differs, in words; nothing: the two calculate alike."""
    return [
        f"{name} {_short_text(other.get(name, NO_VERSION))} and not {_short_text(text)}"
        for name, text in mine.items()
        if text != other.get(name)
    ]


def _short_text(text: str) -> str:
    """A hash by its beginning, a text in one line."""
    line = " ".join(text.split())
    return f"{line[:HASH_CHARACTERS]}…" if len(line) == len(hashlib.sha256().hexdigest()) and " " not in line else line
