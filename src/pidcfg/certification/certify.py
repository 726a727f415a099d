"""A batch from a scenario file to its result."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from pidcfg.certification.bound import samples_needed
from pidcfg.certification.outcome import WHOLE, Names, Outcome, certification
from pidcfg.certification.sample import Batch
from pidcfg.certification.state import Progress, key_of, read, written
from pidcfg.certification.tally import Tally
from pidcfg.certification.workers import Job, WorkersError, recordings, results
from pidcfg.diagnostics import Severity
from pidcfg.reader import DISK, Reader
from pidcfg.scenario.axes import axes_of
from pidcfg.scenario.load import load
from pidcfg.sim.engine import calls_of, choose
from pidcfg.sim.plc import TICKS
from pidcfg.sim.prepare import base_step, prepare
from pidcfg.sim.problems import Problem
from pidcfg.sim.run import Settings, UnusableError, simulate

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from pidcfg.certification.run import Seen
    from pidcfg.certification.tally import Sizes
    from pidcfg.document import Document
    from pidcfg.limits import Limits
    from pidcfg.scenario.vary import Uncertainty
    from pidcfg.schemas.scenario import Scenario
    from pidcfg.sim.report import Report

KEPT_EVERY = 64
"""Samples between two states that are kept."""
KEPT_AFTER = 1.0
"""Seconds between two states of a cluster, whose blocks may come by the hundred."""
NOTHING_MEASURED = " (nothing was measured"
"""What follows an expectation in a run that measured nothing for it."""


@dataclass(frozen=True, slots=True)
class Plan:
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
    keep: Callable[[bytes], None] | None = None
    """Called with the state now and then, and at the end."""
    progress: Callable[[float], None] | None = None
    remark: Callable[[str], None] | None = None
    """Called with what is worth knowing on the way: workers that are left out."""


def certify_document(doc: Document, plan: Plan, limits: Limits, reader: Reader = DISK) -> Outcome:
    """Runs the samples of one scenario file."""
    loaded = load(doc, limits, reader)
    outcome = Outcome(doc.file, loaded.config, documents=loaded.documents)
    scenario = loaded.scenario
    if scenario is None or loaded.image is None:
        return replace(outcome, findings=loaded.findings)
    plc = loaded.plc()
    net = prepare(scenario, plc)
    varies, problems = loaded.uncertainties(plc)
    problems += _not_shown(scenario, plan.samples)
    if not varies and not net.noisy:
        problems.append(Problem((), "nothing varies: there is no vary and no noise", help="write what is uncertain"))
    loaded.add([*net.problems, *problems])
    if any(finding.severity is Severity.ERROR for finding in loaded.findings):
        return replace(outcome, findings=loaded.findings)
    batch = Batch(loaded.document, varies, seed_of(scenario, plan.seed))
    steps = int(scenario.duration * TICKS) // base_step(scenario, plc) + 1
    work = steps * len(plc.loops) * plan.samples
    engine = choose("auto", work, loaded.controller, calls_of(scenario, net))
    try:
        report = simulate(scenario, loaded.plc, loaded.controller, Settings(engine, max_loop_steps=limits.loop_steps))
    except UnusableError as error:
        loaded.add(error.problems)
        return replace(outcome, findings=loaded.findings)
    names = names_of(scenario, report)
    config = reader.read(loaded.config, limits.file_bytes + 1)
    job = Job(doc.file, doc.text, loaded.config, config, batch.seed, engine, limits)
    tally = run_all(job, names, varies, plan)
    return replace(
        outcome,
        certification=certification(names, batch, tally, plan.keep_worst),
        findings=[*loaded.findings, *loaded.config_errors],
        fan=recordings(job, plan.samples, plan.jobs) if plan.record else None,
        axes=axes_of(plc, loaded.image.settings),
        duration=report.duration,
        unjudged=bool(loaded.config_errors) and not scenario.expect,
    )


def seed_of(scenario: Scenario, wanted: int | None) -> int:
    """The seed of the row of samples."""
    if wanted is not None:
        return wanted
    varied = None if scenario.vary is None else scenario.vary.seed
    return scenario.seed if varied is None else varied


def _not_shown(scenario: Scenario, samples: int) -> list[Problem]:
    """Shares that so many samples cannot show, even if none fails."""
    problems = []
    for i, wanted in enumerate(scenario.expect):
        if wanted.share is None or not 0 < wanted.share < WHOLE:
            continue
        needed = samples_needed(float(wanted.share) / WHOLE)
        if needed > samples:
            message = f"{samples:,} samples cannot show {wanted.share:f} % even if none fails; {needed:,} are needed"
            problems.append(Problem(("expect", i, "share"), message, "value", help=f"give --samples {needed}"))
    return problems


def run_all(job: Job, names: Names, varies: Sequence[Uncertainty], plan: Plan) -> Tally:
    """All samples, or those that the state lacks; raises `StateError` and `WorkersError`."""
    key = key_of(job) if plan.state is not None or plan.keep is not None else ""
    sizes = (len(names.expectations), len(names.standing), len(names.loops), len(varies))
    progress = Progress(Tally.empty(sizes)) if plan.state is None else read(plan.state, key, job, plan.samples)
    tally, kept, when = progress.tally, progress.tally.samples, 0.0

    def keep() -> None:
        if plan.keep is not None:
            plan.keep(written(progress, key))

    for parts in _kept_when_lost(_parts(job, progress, sizes, plan), keep):
        for part in parts:
            if isinstance(part, Tally):
                tally.append(part)
            else:
                progress.trial.take(part)
                tally.add(part, varies)
            if plan.progress is not None:
                plan.progress(tally.samples / plan.samples)
        due = tally.samples - kept >= KEPT_EVERY if plan.cluster is None else time.monotonic() - when >= KEPT_AFTER
        if due or tally.samples == plan.samples:
            keep()
            kept, when = tally.samples, time.monotonic()
    return tally


def _kept_when_lost(
    parts: Iterator[Sequence[Tally | Seen]], keep: Callable[[], None]
) -> Iterator[Sequence[Tally | Seen]]:
    """The same; what is ready is kept before `WorkersError` says that nobody is left."""
    try:
        yield from parts
    except WorkersError:
        keep()
        raise


def _parts(job: Job, progress: Progress, sizes: Sizes, plan: Plan) -> Iterator[Sequence[Tally | Seen]]:
    """What comes next in the order of the samples, by processes or by a cluster."""
    if plan.cluster is None:
        return ((seen,) for seen in results(job, progress.tally.samples, plan.samples, plan.jobs))
    from pidcfg.certification import cluster

    remark = plan.remark or (lambda _: None)
    return cluster.results(job, plan.cluster, progress, plan.samples, sizes, remark)


def names_of(scenario: Scenario, report: Report) -> Names:
    """What the samples are counted by, in the words of a run."""
    return Names(
        scenario.scenario,
        [
            (verdict.text.partition(NOTHING_MEASURED)[0], None if wanted.share is None else float(wanted.share))
            for verdict, wanted in zip(report.expectations, scenario.expect, strict=True)
        ],
        [(verdict.kind, verdict.loop) for verdict in report.standing],
        list(report.loops),
    )
