"""A batch from a scenario file to its result: shares with their bounds, distributions, and the fan chart."""

from __future__ import annotations

import time
from dataclasses import field, replace
from math import ceil, exp, lgamma, log, log1p
from typing import TYPE_CHECKING

from pidcfg.pictures import Band, Chart, Line, Panel
from pidcfg.sim.controllers.plc import TICKS, axes_of
from pidcfg.sim.engine.choice import calls_of, choose_engine
from pidcfg.sim.engine.expressions import Problem
from pidcfg.sim.engine.run import Settings, UnusableError, base_step, prepare_network, simulate
from pidcfg.sim.judgement.meters import METRICS
from pidcfg.sim.judgement.report import ten_digits
from pidcfg.study.certification.samples import FAN_QUANTILES, Batch, Job, WorkersError, process_results, record_fan
from pidcfg.study.certification.tally import Progress, Tally, key_of, read_state, state_text
from pidcfg.study.scenario import load_scenario
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen
from pidcfg.text.reader import DISK, Reader

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator, Mapping, Sequence

    from pidcfg.pictures import Role
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.controllers.plc import Axes
    from pidcfg.sim.judgement.report import Report
    from pidcfg.study.certification.samples import Fan, SampleResult
    from pidcfg.study.certification.tally import Distribution, NearLimit, Sizes
    from pidcfg.study.uncertainty import Uncertainty
    from pidcfg.text.diagnostics import Diagnostic
    from pidcfg.text.document import Document

# --- How sure one may be of a share: the one-sided lower bound of Clopper and Pearson (1934), at 95 % -----------------

BOUND_RISK = 0.05
"""How often a bound may lie above the true share."""
NEGLIGIBLE_SHARE = 1e-17
"""A share of a sum that does not change it."""


def lower_bound(passed: int, samples: int) -> float:
    """The smallest share at which at least ``passed`` of so many ``samples`` are as likely as the risk.

    By bisection on the logarithm of the exact binomial tail; the lower of the last two numbers.
    """
    if not passed:
        return 0.0
    low, high = 0.0, passed / samples
    while low < (middle := (low + high) / 2) < high:
        if log_tail(passed, samples, middle) < log(BOUND_RISK):
            low = middle
        else:
            high = middle
    return low


def log_tail(passed: int, samples: int, share: float) -> float:
    """The logarithm of the probability that at least so many pass; ``share`` is not above passed / samples."""
    failed = samples - passed
    first = lgamma(samples + 1) - lgamma(passed + 1) - lgamma(failed + 1)
    first += passed * log(share) + failed * log1p(-share)
    odds, term, total = share / (1 - share), 1.0, 1.0
    for k in range(passed, samples):
        term *= (samples - k) / (k + 1) * odds
        total += term
        if term < total * NEGLIGIBLE_SHARE:
            break
    return first + log(total)


def samples_needed(share: float) -> int:
    """How many samples show a share, if none fails: 299 for 0.99, 2,995 for 0.999."""
    needed = max(1, ceil(log(BOUND_RISK) / log(share)) - 1)
    while exp(log(BOUND_RISK) / needed) < share:
        needed += 1
    return needed


MAX_SAMPLES = 10_000_000
"""More than anybody runs."""


def samples_that_show(share: float, passed: int, samples: int) -> int | None:
    """About how many samples show a share, if as many of them hold as of these; None where no number of them does."""
    if passed / samples <= share:
        return None
    lower, upper = samples, samples
    while lower_bound(upper * passed // samples, upper) < share:
        lower, upper = upper, 2 * upper
        if upper > MAX_SAMPLES:
            return None
    while lower + 1 < upper:
        middle = (lower + upper) // 2
        shown = lower_bound(middle * passed // samples, middle) >= share
        lower, upper = (lower, middle) if shown else (middle, upper)
    return upper


# ----------------------------------------------------------------------------------------------------------------------
# The result of a batch as data: shares with their bounds, distributions, what mattered most, and the worst samples.

QUANTILES = {"p5": 0.05, "p25": 0.25, "p50": 0.5, "p75": 0.75, "p95": 0.95, "p99": 0.99}
PERCENT = 100.0


@frozen
class Share:
    """How many samples keep an expectation; shares are in %."""

    text: str
    held: int
    samples: int
    wanted: float | None = None
    """None: no sample may fail."""
    judged: int | None = None
    """Of a standing expectation: the samples in which it was judged."""

    @property
    def share(self) -> float:
        """Of these samples."""
        return ten_digits(PERCENT * self.held / self.samples)

    @property
    def bound(self) -> float:
        """What the share of all plants is at least, at 95 %."""
        return ten_digits(PERCENT * lower_bound(self.held, self.samples))

    @property
    def passed(self) -> bool:
        """Whether the bound reaches what is wanted."""
        if self.wanted is None:
            return self.held == self.samples
        return lower_bound(self.held, self.samples) >= self.wanted / PERCENT

    @property
    def failed(self) -> bool:
        """Whether the samples themselves say no; else what has not passed is not proven by so few of them."""
        return not self.passed and (self.wanted is None or PERCENT * self.held < self.wanted * self.samples)

    @property
    def requirement(self) -> str:
        """What is wanted, in words, and about how many samples would show it."""
        if self.wanted is None:
            return "all samples are wanted"
        enough = samples_that_show(self.wanted / PERCENT, self.held, self.samples)
        if enough is None:
            return f"{self.wanted:g} % are wanted, which no number of samples shows while so many fail"
        return f"{self.wanted:g} % are wanted, for which about {enough:,} samples with such a share would do"


@frozen
class StandingShare(Share):
    """The same of a standing expectation."""

    kind: str = ""
    loop: str = ""
    unproven: int = 0
    """Samples that do not show it, of those that do not keep it."""

    @property
    def failed(self) -> bool:
        """Whether any sample fails, and does not merely leave it open."""
        return self.samples - self.held > self.unproven


@frozen
class Effect:
    """What an uncertainty does: the share of samples that pass where it is low, and where it is high; in %."""

    label: str
    text: str
    lowest: float | None
    highest: float | None
    """None: no sample lies there."""

    @property
    def size(self) -> float:
        """How far the two are apart."""
        return 0.0 if self.lowest is None or self.highest is None else abs(self.lowest - self.highest)


@frozen
class WorstSample:
    """A sample near a limit, or beyond it."""

    sample: int
    margin: float | None
    """None: nothing that has a number holds or fails, or it could not run."""
    failed: bool
    expectation: str
    """Empty: a standing one, or it could not run."""
    numbers: Mapping[str, float]
    text: str
    """Its scenario, for `pidcfg simulate`."""


@frozen
class Certification:
    """All that a batch of samples says."""

    scenario: str
    samples: int
    seed: int
    expectations: Sequence[Share]
    standing: Sequence[StandingShare]
    metrics: Mapping[str, Mapping[str, Mapping[str, float | int | None]]]
    """By loop and metric: ``count``, ``mean``, ``min``, ``max`` and quantiles."""
    effects: Sequence[Effect]
    worst: Sequence[WorstSample]
    all_passed: int
    """Samples in which everything holds."""
    failed_to_run: int
    reasons: Sequence[str]
    """Why the first of them could not run."""

    @property
    def passed(self) -> bool:
        """Whether every bound reaches what is wanted, and all samples ran."""
        return not self.failed_to_run and all(share.passed for share in (*self.expectations, *self.standing))


@frozen
class BatchOutcome:
    """One scenario file: its findings, and the certification when it could run."""

    file: str
    config: str = ""
    certification: Certification | None = None
    findings: Sequence[Diagnostic] = ()
    documents: Mapping[str, Document] = field(default_factory=dict)
    fan: Fan | None = None
    """How far signals spread, for a picture, where one is wanted."""
    axes: Mapping[str, Axes] = field(default_factory=dict)
    """Names and units of each loop's signals."""
    duration: float = 0.0
    """Of each run, in s."""
    lacks_expectations: bool = False
    """The configuration has errors, and nothing is expected of the runs."""

    @property
    def passed(self) -> bool:
        """Whether it ran and all is shown that is wanted."""
        return self.certification is not None and self.certification.passed and not self.lacks_expectations


@frozen
class BatchNames:
    """What the counts of a batch are about."""

    scenario: str
    expectations: Sequence[tuple[str, float | None]]
    """In words, with the share that is wanted in %."""
    standing: Sequence[tuple[str, str]]
    """Kind and loop."""
    loops: Sequence[str]


def make_certification(names: BatchNames, batch: Batch, tally: Tally, worst_count: int) -> Certification:
    """What the counts say; ``worst_count``: how many of the worst samples."""
    unrun_count = tally.failed_to_run
    counts = zip(tally.standing_failed, tally.standing_unproven, tally.standing_judged, strict=True)
    standing = zip(names.standing, counts, strict=True)
    effects = [
        Effect(uncertainty.label, uncertainty.text, _passed_share(low), _passed_share(high))
        for uncertainty, low, high in zip(batch.varies, tally.lowest, tally.highest, strict=True)
    ]
    return Certification(
        scenario=names.scenario,
        samples=tally.samples,
        seed=batch.seed,
        expectations=[
            Share(text, held, tally.samples, wanted)
            for (text, wanted), held in zip(names.expectations, tally.held, strict=True)
        ],
        standing=[
            StandingShare(
                f"{loop} {kind}".strip(),
                tally.samples - unrun_count - failed,
                tally.samples,
                None,
                judged,
                kind,
                loop,
                unproven,
            )
            for (kind, loop), (failed, unproven, judged) in standing
        ],
        metrics={
            loop: {name: _summarise_metric(one) for name, one in zip(METRICS, row, strict=True)}
            for loop, row in zip(names.loops, tally.metrics, strict=True)
        },
        effects=sorted(effects, key=lambda effect: -effect.size),
        worst=[_worst_sample(one, names, batch) for one in tally.worst[:worst_count]],
        all_passed=tally.passed,
        failed_to_run=unrun_count,
        reasons=list(tally.reasons),
    )


def _passed_share(counts: Sequence[int]) -> float | None:
    samples, passed = counts
    return ten_digits(PERCENT * passed / samples) if samples else None


def _summarise_metric(metric: Distribution) -> dict[str, float | int | None]:
    if not metric.count:
        return {"count": 0, "mean": None, "min": None, **dict.fromkeys(QUANTILES), "max": None}
    ends = {"min": metric.low, "max": metric.high}
    # An edge of a bin lies beyond all numbers where they end.
    quantiles = {
        name: ten_digits(min(max(metric.quantile(q), metric.low), metric.high)) for name, q in QUANTILES.items()
    }
    return {"count": metric.count, "mean": ten_digits(metric.mean), "min": ends["min"], **quantiles, "max": ends["max"]}


def _worst_sample(worst: NearLimit, names: BatchNames, batch: Batch) -> WorstSample:
    numbers = {
        uncertainty.label: ten_digits(number) for uncertainty, number in zip(batch.varies, worst.numbers, strict=False)
    }
    finite = abs(worst.margin) < float("inf")
    text = batch.scenario_text(worst.sample, worst.numbers) if len(worst.numbers) == len(batch.varies) else ""
    expectation = names.expectations[worst.expectation][0] if worst.expectation >= 0 else ""
    return WorstSample(
        worst.sample, ten_digits(worst.margin) if finite else None, worst.margin < 0, expectation, numbers, text
    )


# --- A batch from a scenario file to its result -----------------------------------------------------------------------

SAVE_SAMPLES = 64
"""Samples between two states that are kept."""
SAVE_SECONDS = 1.0
"""Seconds between two states of a cluster, whose blocks may come by the hundred."""
NOT_MEASURED_TEXT = " (nothing was measured"
"""What follows an expectation in a run that measured nothing for it."""


@frozen
class CertifyOptions:
    """How many samples, of which row, by whom."""

    samples: int = 2_000
    seed: int | None = None
    """None: that of the scenario's ``vary``, else its own."""
    jobs: int = 1
    cluster: str | None = None
    """Of a Dask cluster, whose workers run the samples in the place of processes."""
    keep_worst: int = 3
    record: bool = False
    """Also record how the signals of the loops spread."""
    state: bytes | None = None
    """Of an earlier batch, which is continued; raises `StateError` where it cannot be."""
    save_state: Callable[[bytes], None] | None = None
    """Called with the state now and then, and at the end."""
    progress: Callable[[float], None] | None = None
    remark: Callable[[str], None] | None = None
    """Called with what is worth knowing on the way: workers that are left out."""


def certify_document(doc: Document, options: CertifyOptions, reader: Reader = DISK) -> BatchOutcome:
    """Runs the samples of one scenario file."""
    loaded = load_scenario(doc, reader)
    outcome = BatchOutcome(doc.file, loaded.config, documents=loaded.documents)
    scenario = loaded.scenario
    if scenario is None or loaded.image is None:
        return replace(outcome, findings=loaded.findings)
    plc = loaded.new_plc()
    net = prepare_network(scenario, plc)
    varies, problems = loaded.uncertainties(plc)
    problems += _unprovable_shares(scenario, options.samples)
    if not varies and not net.noisy_plants:
        plant = next(iter(scenario.plants), "TIC-1")
        cure = f"write what is uncertain, as in 'vary: {{plants: {{{plant}: {{gain: ±30 %}}}}}}'"
        problems.append(Problem((), "nothing varies: there is no vary and no noise", help=cure))
    loaded.add_problems([*net.problems, *problems])
    if any(finding.severity is Severity.ERROR for finding in loaded.findings):
        return replace(outcome, findings=loaded.findings)
    batch = Batch(loaded.document, varies, seed_of(scenario, options.seed))
    steps = int(scenario.duration * TICKS) // base_step(scenario, plc) + 1
    work = steps * len(plc.loops) * options.samples
    engine = choose_engine("auto", work, loaded.controller, calls_of(scenario, net))
    try:
        report = simulate(
            scenario, loaded.new_plc, loaded.controller, Settings(engine, max_loop_steps=doc.limits.loop_steps)
        )
    except UnusableError as error:
        loaded.add_problems(error.problems)
        return replace(outcome, findings=loaded.findings)
    names = names_of(scenario, report)
    config = reader.read(loaded.config, doc.limits.listing_bytes + 1)
    job = Job(doc.file, doc.text, loaded.config, config, batch.seed, engine, doc.limits)
    tally = run_samples(job, names, varies, options)
    return replace(
        outcome,
        certification=make_certification(names, batch, tally, options.keep_worst),
        findings=[*loaded.findings, *loaded.config_errors],
        fan=record_fan(job, options.samples, options.jobs) if options.record else None,
        axes=axes_of(plc, loaded.image.settings),
        duration=report.duration,
        lacks_expectations=bool(loaded.config_errors) and not scenario.expect,
    )


def seed_of(scenario: Scenario, chosen: int | None) -> int:
    """The seed of the row of samples."""
    if chosen is not None:
        return chosen
    varied = None if scenario.vary is None else scenario.vary.seed
    return scenario.seed if varied is None else varied


def _unprovable_shares(scenario: Scenario, samples: int) -> list[Problem]:
    """Shares that so many samples cannot show, even if none fails."""
    problems = []
    for i, expectation in enumerate(scenario.expect):
        if expectation.share is None or not 0 < expectation.share < PERCENT:
            continue
        needed = samples_needed(float(expectation.share) / PERCENT)
        if needed > samples:
            message = (
                f"{samples:,} samples cannot show {expectation.share:f} % even if none fails; {needed:,} are needed"
            )
            problems.append(Problem(("expect", i, "share"), message, "value", help=f"give --samples {needed}"))
    return problems


def run_samples(job: Job, names: BatchNames, varies: Sequence[Uncertainty], options: CertifyOptions) -> Tally:
    """All samples, or those that the state lacks; raises `StateError` and `WorkersError`."""
    key = key_of(job) if options.state is not None or options.save_state is not None else ""
    sizes = (len(names.expectations), len(names.standing), len(names.loops), len(varies))
    progress = (
        Progress(Tally.empty(sizes)) if options.state is None else read_state(options.state, key, job, options.samples)
    )
    tally, kept_samples, kept_at = progress.tally, progress.tally.samples, 0.0

    def keep_state() -> None:
        if options.save_state is not None:
            options.save_state(state_text(progress, key))

    for parts in _keep_when_lost(_next_results(job, progress, sizes, options), keep_state):
        for part in parts:
            if isinstance(part, Tally):
                tally.append_block(part)
            else:
                progress.trial.add_result(part)
                tally.add_result(part, varies)
            if options.progress is not None:
                options.progress(tally.samples / options.samples)
        due = (
            tally.samples - kept_samples >= SAVE_SAMPLES
            if options.cluster is None
            else time.monotonic() - kept_at >= SAVE_SECONDS
        )
        if due or tally.samples == options.samples:
            keep_state()
            kept_samples, kept_at = tally.samples, time.monotonic()
    return tally


def _keep_when_lost(
    parts: Iterator[Sequence[Tally | SampleResult]], keep: Callable[[], None]
) -> Iterator[Sequence[Tally | SampleResult]]:
    """The same; what is ready is kept before `WorkersError` says that nobody is left."""
    try:
        yield from parts
    except WorkersError:
        keep()
        raise


def _next_results(
    job: Job, progress: Progress, sizes: Sizes, options: CertifyOptions
) -> Iterator[Sequence[Tally | SampleResult]]:
    """What comes next in the order of the samples, by processes or by a cluster."""
    if options.cluster is None:
        return ((result,) for result in process_results(job, progress.tally.samples, options.samples, options.jobs))
    from pidcfg.study.certification import cluster

    remark = options.remark or (lambda _: None)
    return cluster.cluster_results(job, options.cluster, progress, options.samples, sizes, remark)


def names_of(scenario: Scenario, report: Report) -> BatchNames:
    """What the samples are counted by, in the words of a run."""
    return BatchNames(
        scenario.scenario,
        [
            (
                verdict.text.partition(NOT_MEASURED_TEXT)[0],
                None if expectation.share is None else float(expectation.share),
            )
            for verdict, expectation in zip(report.expectations, scenario.expect, strict=True)
        ],
        [(verdict.kind, verdict.loop) for verdict in report.standing],
        list(report.loops),
    )


# --- The fan chart of a loop: PV, set point and output, how far each spreads over the samples -------------------------

MEDIAN_INDEX = len(FAN_QUANTILES) // 2


def charts_of(outcome: BatchOutcome, loops: Collection[str] = ()) -> list[Chart]:
    """One chart a loop, in the order of the PLC; ``loops``: only these."""
    fan = outcome.fan
    if fan is None or not fan.quantiles:
        return []
    return [
        _loop_chart(loop, axes, fan, outcome.duration)
        for loop, axes in outcome.axes.items()
        if not loops or loop in loops
    ]


def _loop_chart(loop: str, axes: Axes, fan: Fan, duration: float) -> Chart:
    title = f"{loop}: {axes.description}" if axes.description else loop
    panels = [_fan_panel(fan, {axes.setpoint: "setpoint", axes.pv: "pv"}, axes.pv_unit)]
    if axes.output:
        panels.append(_fan_panel(fan, {axes.output: "output"}, axes.output_unit, axes.output_range))
    note = f"{fan.samples} samples: the line is the median, the bands hold the middle 50 % and 90 % at each time"
    return Chart(title, loop, tuple(panels), begin=0.0, end=duration, notes=(note,))


def _fan_panel(fan: Fan, roles: dict[str, Role], unit: str, min_range: tuple[float, float] | None = None) -> Panel:
    names = [name for name in roles if name]
    labels = {name: name.rpartition(".")[2] for name in names}
    lines = [Line(labels[name], roles[name], fan.times, fan.quantiles[name][MEDIAN_INDEX]) for name in names]
    bands = [
        Band(roles[name], fan.times, fan.quantiles[name][i], fan.quantiles[name][-1 - i])
        for name in names
        for i in range(MEDIAN_INDEX)
    ]
    return Panel(", ".join(labels[name] for name in reversed(names)), unit, tuple(lines), min_range, tuple(bands))
