"""``pidcfg certify``: samples of a scenario whose plants are not known exactly, and how sure one may be."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli import console, options, plots
from pidcfg.cli.environment import require_extra
from pidcfg.cli.formats import report_options
from pidcfg.cli.inputs import RECORDED_DISK, read_inputs
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import LINE, hold_line

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.pictures import Chart
    from pidcfg.study.certification.certify import BatchOutcome
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg certify chiller.scenario.yaml --samples 100",
    "pidcfg certify chiller.scenario.yaml --samples 200 --resume chiller.state",
    "pidcfg certify chiller.scenario.yaml --samples 100 --keep-worst 3 --plot fan.svg",
    "pidcfg certify chiller.scenario.yaml --samples 100 --report-output junit=certify.xml",
)
DEFAULT_WORST = 3
"""Worst samples that are listed where none is to be kept."""
MAX_KEPT_SAMPLES = 100
DEFAULT_SAMPLES = 2_000
MIN_RATE_SECONDS = 1.0
"""Seconds after which a rate says something."""


@click.command("certify", epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, metavar="SCENARIO...")
@report_options.report_format("certify")
@report_options.report_files("certify", "--output")
@click.option(
    "--samples", type=options.LimitedInteger(1), default=DEFAULT_SAMPLES, show_default=True, help="How many to run."
)
@click.option(
    "--seed", type=options.Integer(), help="Of the row of samples.  [default: seed of vary, else of the scenario]"
)
@options.JOBS_OPTION
@click.option(
    "--cluster",
    metavar="ADDRESS",
    help="Run the samples on the workers of a Dask cluster: tcp://HOST:8786, or local:2 for two of them here.",
)
@click.option(
    "--resume",
    type=click.Path(dir_okay=False),
    callback=options.refuse_dash,
    help="Keep in this file how far the samples have come, and continue there.",
)
@click.option(
    "--keep-worst",
    type=options.LimitedInteger(0, MAX_KEPT_SAMPLES),
    help="Write the N worst samples as scenarios beside theirs: NAME.sample-I.scenario.yaml.",
    metavar="N",
)
@plots.PLOT_OPTION
@plots.LOOPS_OPTION
@options.EXCLUDE_OPTION
@options.FORCE_OPTION
@click.option("-v", "--verbose", is_flag=True, help="Print metrics, counts and the numbers of the worst samples, too.")
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    paths: tuple[str, ...],
    fmt: str,
    reports: tuple[report_options.Report, ...],
    samples: int,
    seed: int | None,
    jobs: int | None,
    cluster: str | None,
    resume: str | None,
    keep_worst: int | None,
    plot: tuple[str, ...],
    plot_loops: tuple[str, ...],
    force: bool,
    verbose: bool,
    quiet: bool,
    limits: Limits,
) -> None:
    """Run each SCENARIO against many plants, since nobody knows the real one exactly, and say how often it holds.

    Each sample draws anew what `vary` names: a stronger or slower plant, a longer dead time, more noise, other gains.
    The result is how sure one may be that each expectation holds on the real plant.

    Exit codes: 0 every bound reaches its share, 1 one does not, 2 a scenario that cannot run or samples that could not
    show a share.
    """
    from pidcfg.cli.commands.simulate import files_of, scenarios_of
    from pidcfg.cli.formats.batches import render_batches

    del quiet
    if cluster is not None:
        if jobs is not None:
            raise click.UsageError("--jobs and --cluster: the samples run here or there; give one of them")
        require_extra("distributed", "cluster")
    scenarios = scenarios_of(list(read_inputs(paths, limits)), paths)
    if not scenarios:
        raise click.UsageError(f"{', '.join(paths)}: no scenario there; one begins with 'scenario: …'")
    refuse_configurations(scenarios)
    if resume is not None and len(scenarios) != 1:
        raise click.UsageError(f"--resume takes one scenario, not {len(scenarios)}")
    report_options.refuse_outputs((resume, *plot, *(report.path for report in reports)), files_of(scenarios))
    report_options.refuse_missing_folder((resume, *plot))
    plots.check_options(fmt, plot, plot_loops)
    worst_count = DEFAULT_WORST if keep_worst is None else keep_worst
    workers = options.process_count(jobs), cluster
    outcomes = list(run_all(scenarios, samples, seed, workers, resume, worst_count, limits, record=bool(plot)))
    files: dict[str, str | bytes] = {}
    sample_names = {} if not keep_worst else worst_files(outcomes, files)
    charts = fan_charts(outcomes, plot_loops) if plot else []
    files |= plots.draw_files(plot, charts, *picture_heading(outcomes))

    def render(name: str) -> str:
        return render_batches(name, outcomes, sample_names, tables=verbose)

    report_options.deliver_reports(fmt, reports, render, files, force=force)
    if plots.TERMINAL_NAME in plot:
        plots.show_charts(charts)
    click.get_current_context().exit(exit_code(outcomes))


def refuse_configurations(documents: Sequence[Document]) -> None:
    """A configuration says nothing of plants, and nothing of it varies."""
    for doc in documents:
        if doc.data is not None and "vendor" in doc.data:
            raise click.UsageError(
                f"{doc.file} is a configuration, and certify runs scenarios with vary; 'pidcfg init --scenario "
                f"{doc.file}' writes one without vary"
            )


def run_all(
    scenarios: Sequence[Document],
    samples: int,
    seed: int | None,
    workers: tuple[int, str | None],
    resume: str | None,
    worst_count: int,
    limits: Limits,
    *,
    record: bool,
) -> Iterator[BatchOutcome]:
    """The batches one after the other; the line on the terminal shows how many samples are done."""
    from pidcfg.api import certify
    from pidcfg.cli.outputs import file_keeper, read_existing
    from pidcfg.output.arguments import ArgumentError
    from pidcfg.study.certification.samples import WorkersError

    jobs, cluster = workers
    for doc in scenarios:
        label = f"certifying {Path(doc.file).name}"
        LINE.update(label)
        try:
            yield certify(
                doc,
                samples=samples,
                seed=seed,
                jobs=jobs,
                cluster=cluster,
                keep_worst=worst_count,
                record=record,
                state=None if resume is None else read_existing(resume),
                keep=None if resume is None else file_keeper(resume),
                files=RECORDED_DISK,
                limits=limits,
                progress=RateLabel(label, samples).update,
                remark=show_remark,
            ).outcome
        except ArgumentError as error:
            option = f"--cluster {cluster}" if "cluster" in error.names else f"--resume {resume}"
            raise click.ClickException(f"{option}: {error.with_names(lambda _: 'it')}") from None
        except WorkersError as error:
            raise click.ClickException(f"{error}{_resume_hint(resume)}") from None


class RateLabel:
    """The line's label, with how many samples are run in a second."""

    def __init__(self, label: str, samples: int) -> None:
        self.label, self.samples = label, samples
        self.start: tuple[float, float] | None = None

    def update(self, share: float) -> None:
        """So large a share is done; what an earlier run has done does not count."""
        now = time.monotonic()
        if self.start is None:
            self.start = now, share
        seconds, done = now - self.start[0], share - self.start[1]
        rate = f", {done * self.samples / seconds:.3g} samples a second" if done and seconds > MIN_RATE_SECONDS else ""
        LINE.update(f"{self.label}{rate}", share)


def show_remark(text: str) -> None:
    """What is worth knowing on the way; the line goes on after it."""
    with hold_line():
        console.write_remark(f"note: {text}")


def _resume_hint(resume: str | None) -> str:
    """What to do once a batch has stopped."""
    return "" if resume is None else f"; {resume} keeps what is ready, and the same command goes on there"


def worst_files(outcomes: Sequence[BatchOutcome], files: dict[str, str | bytes]) -> dict[tuple[str, int], str]:
    """Adds the worst samples to the files that are to be written; their names by scenario and number."""
    names = {}
    for outcome in outcomes:
        for sample in outcome.certification.worst if outcome.certification is not None else ():
            if sample.text:
                name = sample_name(outcome.file, sample.sample)
                names[outcome.file, sample.sample] = name
                files[name] = sample.text
    return names


def sample_name(file: str, sample: int) -> str:
    """The file of a sample, beside its scenario, so that it finds the configuration."""
    path = Path(file)
    first, *rest = path.name.split(".")
    return path.with_name(".".join([first, f"sample-{sample}", *rest])).as_posix()


def fan_charts(outcomes: Sequence[BatchOutcome], loops: Sequence[str]) -> list[Chart]:
    """The fan charts of all batches."""
    from pidcfg.study.certification.certify import charts_of

    plots.refuse_unknown_loops(loops, outcomes)
    return [chart for outcome in outcomes for chart in charts_of(outcome, loops)]


def picture_heading(outcomes: Sequence[BatchOutcome]) -> tuple[str, list[str]]:
    """The title of a picture of batches, and what ran."""
    batches = [outcome for outcome in outcomes if outcome.certification is not None]
    titles = [batch.certification.scenario for batch in batches if batch.certification is not None]
    return (
        titles[0] if len(titles) == 1 else f"{len(titles)} scenarios",
        [f"{Path(batch.file).name} runs {Path(batch.config).name}" for batch in batches],
    )


def exit_code(outcomes: Sequence[BatchOutcome]) -> Exit:
    """A scenario that cannot run outweighs one that fails."""
    if any(outcome.certification is None for outcome in outcomes):
        return Exit.UNUSABLE
    return Exit.OK if all(outcome.passed for outcome in outcomes) else Exit.FINDINGS
