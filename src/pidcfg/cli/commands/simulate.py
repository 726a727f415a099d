"""``pidcfg simulate``: the encoded loops against plants, judged by expectations."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options, plots, watch
from pidcfg.cli.console import VerboseLog, write_remark
from pidcfg.cli.environment import require_extra
from pidcfg.cli.formats import report_options
from pidcfg.cli.formats.runs import render_runs
from pidcfg.cli.inputs import (
    RECORDED_DISK,
    STDIN,
    document_of_input,
    name_of,
    note_read,
    read_input,
    read_inputs,
    readable_input,
)
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import LINE
from pidcfg.text.diagnostics import Severity
from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from typing import TextIO

    from pidcfg.output.runs import SimulateResult
    from pidcfg.sim.engine.choice import EngineName
    from pidcfg.study.outcome import Outcome
    from pidcfg.text.document import Document
    from pidcfg.text.paths import Data
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg simulate reactor.scenario.yaml",
    "pidcfg simulate reactor.scenario.yaml -v",
    "pidcfg simulate reactor.scenario.yaml --trend trend.csv --every 5",
    "pidcfg simulate reactor.scenario.yaml --plot trend.svg --plot -",
    "pidcfg simulate scenarios/ --format json",
    "pidcfg simulate reactor.yaml",
    "pidcfg simulate reactor.scenario.yaml --accept reactor.accepted.json",
    "pidcfg simulate reactor.scenario.yaml --against reactor.accepted.json",
    "pidcfg simulate scenarios/ --report-output junit=simulation.xml",
)
FAILS_FROM = {False: Severity.ERROR, True: Severity.WARNING}
"""From which severity on a finding fails, by ``--strict``."""
DRAFT_REMARK = (
    "{file} is a configuration: it runs with a drafted scenario, which "
    "'pidcfg init --scenario {file} -o {name}.scenario.yaml' writes"
)


@click.command("simulate", cls=watch.WatchCommand, epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, metavar="SCENARIO...")
@report_options.report_format("simulate")
@report_options.report_files("simulate", "--output")
@click.option(
    "--trend",
    "--csv",
    "csv",
    type=click.Path(dir_okay=False),
    callback=options.refuse_dash,
    help="Write the trend as CSV: time and one column a signal.",
)
@click.option(
    "--every",
    type=options.LimitedInteger(1),
    default=1,
    show_default=True,
    help="Rows of the trend: one every N base steps.",
)
@plots.PLOT_OPTION
@plots.LOOPS_OPTION
@click.option(
    "--engine",
    type=click.Choice(["auto", "python", "numba"]),
    default="auto",
    show_default=True,
    help="numba (extra pidcfg[fast]) pays for long runs; the results are the same.",
)
@options.JOBS_OPTION
@click.option(
    "--no-reference", is_flag=True, help="Do not run the plants without control beside it: no loop can be proven then."
)
@click.option(
    "--against",
    metavar="FILE",
    callback=options.refuse_dash,
    help="A run that was accepted: what differs from it fails. It takes the place of the scenario's 'reference'.",
)
@click.option(
    "--accept",
    type=click.Path(dir_okay=False),
    callback=options.refuse_dash,
    help="Write the run to a file, as accepted; review it. One that has failed is not written.",
)
@click.option("--no-limit", is_flag=True, help="Run however many loop-steps it takes.")
@options.FORCE_OPTION
@options.STRICT_OPTION
@options.EXCLUDE_OPTION
@options.STDIN_FILENAME_OPTION
@watch.WATCH_OPTION
@click.option(
    "-v",
    "--verbose",
    is_flag=True,
    help="Print what happened, metrics, signals and flags, too, and say on standard error what is read.",
)
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    paths: tuple[str, ...],
    fmt: str,
    reports: tuple[report_options.Report, ...],
    csv: str | None,
    every: int,
    plot: tuple[str, ...],
    plot_loops: tuple[str, ...],
    engine: EngineName,
    jobs: int | None,
    no_reference: bool,
    against: str | None,
    accept: str | None,
    no_limit: bool,
    force: bool,
    strict: bool,
    verbose: bool,
    quiet: bool,
    limits: Limits,
) -> None:
    """Run each SCENARIO against its plants and judge it, by its expectations and by what is expected of every run.

    A configuration in its place runs with the scenario that 'pidcfg init --scenario' writes for it.

    Each loop that is meant to control ends proven, failed or not proven; the last two fail.

    Exit codes: 0 all hold, 1 something failed or is not proven (or a configuration with errors of which nothing is
    expected), 2 a scenario that cannot run.
    """
    from pidcfg.cli.formats.runs import run_remarks
    from pidcfg.cli.outputs import trend_file

    log = VerboseLog(click.get_current_context(), verbose=verbose, quiet=quiet)
    if engine == "numba":
        require_extra("numba", "fast")
    scenarios = scenarios_of(list(read_inputs(paths, limits)), paths)
    if not scenarios:
        _nothing_to_run(paths, plot, quiet=quiet)
    refuse_several(scenarios, {"--trend": csv, "--against": against, "--accept": accept})
    report_options.refuse_inputs(reports, () if csv is None else (csv,), "is where the trend goes")
    outputs = (csv, accept, *plot, *(report.path for report in reports))
    report_options.refuse_outputs(outputs, files_of(scenarios, reference=accept is None))
    plots.check_options(fmt, plot, plot_loops)
    tell_drafts(() if quiet else scenarios)
    files: dict[str, str | bytes] = {}
    with trend_file(csv, force=force, other_files=files) as trend:
        limits = replace(limits, loop_steps=sys.maxsize) if no_limit else limits
        arguments = accepted_run(against, accept, limits) | {"record": bool(plot), "reference": not no_reference}
        arguments |= {"engine": engine, "runs": len(scenarios), "every": every, "limits": limits}
        outcomes = [result.outcome for result in run_all(scenarios, arguments, trend, log, options.process_count(jobs))]
        charts = plots.charts_of_runs(outcomes, plot_loops) if plot else []
        files |= plots.draw_files(plot, charts, *plots.picture_heading(outcomes))
        # Told before trend and pictures are put in their places: a file there that differs costs no result.
        report_options.deliver_reports(
            fmt, reports, lambda name: render_runs(name, outcomes, FAILS_FROM[strict], tables=verbose)
        )
        if plots.TERMINAL_NAME in plot:
            plots.show_charts(charts)
        files |= accepted_file(accept, outcomes, force=force)
    written = [f"{accept}: written; review it"] * (accept in files)
    for text in () if quiet else (*written, *run_remarks(outcomes, fmt, csv)):
        write_remark(text)
    log.write_time()
    if len(outcomes) == 1:
        _next_step(outcomes[0], quiet=quiet, fmt=fmt)
    click.get_current_context().exit(exit_code(outcomes, strict=strict))


def refuse_several(scenarios: Sequence[Document], files: Mapping[str, str | None]) -> None:
    """Ends the command where a file that is of one run, by its option, is given for several."""
    for option, name in files.items():
        if name is not None and len(scenarios) != 1:
            raise click.UsageError(f"{option} takes one scenario, not {len(scenarios)}")


def _nothing_to_run(paths: Sequence[str], plot: Sequence[str], *, quiet: bool) -> None:
    """Folders of configurations: a project need not have scenarios, but there is nothing to draw."""
    message = f"{', '.join(paths)}: no scenario there"
    if plot:
        raise click.UsageError(f"{message} to draw; one begins with 'scenario: …'")
    if not quiet:
        write_remark(f"{message}, so nothing was run; one begins with 'scenario: …'")


def _next_step(outcome: Outcome, *, quiet: bool, fmt: str) -> None:
    """After one run: the words for the PLC, or a look at what went wrong."""
    from pidcfg.cli.console import suggest_next_step

    if outcome.passed:
        suggest_next_step("encode", outcome.config, quiet=quiet, fmt=fmt)
    elif outcome.report is not None:
        suggest_next_step("simulate", outcome.file, "--plot", "trend.html", quiet=quiet, fmt=fmt)


def run_all(
    scenarios: Sequence[Document], arguments: Mapping[str, object], trend: TextIO | None, log: VerboseLog, jobs: int
) -> Iterator[SimulateResult]:
    """Runs the scenarios, here or in several processes; the line on the terminal shows how many are done."""
    from pidcfg.text.processes import WorkerPool

    documents, done = {doc.file: doc for doc in scenarios}, 0

    def show_share(share: float) -> None:
        LINE.update(f"simulating {Path(scenarios[done].file).name}", (done + share) / len(scenarios))

    def make_runner(arguments: Mapping[str, object]) -> Callable[[Document | str], SimulateResult]:
        run = Runner({**arguments, "trend": trend, "progress": show_share})
        return lambda one: run(documents[one] if isinstance(one, str) else one)

    LINE.update(f"simulating {Path(scenarios[0].file).name}" if scenarios else "simulating")
    items = [doc if doc.file == name_of(STDIN) else doc.file for doc in scenarios]
    for result in WorkerPool(jobs, Runner, (arguments,)).adaptive_results(
        items, lambda result: result.outcome.estimated_cost, make_runner
    ):
        note_read(result.outcome.config)
        note_read(result.outcome.reference)
        log.write_run(result.outcome)
        done += 1
        yield result


@frozen
class Runner:
    """Runs one scenario after the other, each a document or the name of a file."""

    arguments: Mapping[str, Any]

    def __call__(self, scenario: Document | str) -> SimulateResult:
        """One run."""
        from pidcfg.api import simulate

        limits = self.arguments["limits"]
        doc = document_of_input(read_input(scenario, limits)) if isinstance(scenario, str) else scenario
        return simulate(doc, files=RECORDED_DISK, **self.arguments)


def tell_drafts(documents: Iterable[Document]) -> None:
    """Names the configurations that run without a scenario, and how to get it as a file."""
    for doc in documents:
        if doc.data is not None and "vendor" in doc.data:
            write_remark(DRAFT_REMARK.format(file=doc.file, name=doc.file.removesuffix(".yaml").removesuffix(".yml")))


def scenarios_of(documents: list[Document], paths: Sequence[str]) -> list[Document]:
    """The scenarios, and files that were named but are none; configurations in folders are left out."""
    from pidcfg.validate.engine import is_scenario

    return [doc for doc in documents if is_scenario(doc) or doc.data is None or doc.file in paths]


def accepted_run(name: str | None, accept: str | None, limits: Limits) -> Data:
    """What the call is given for ``--against`` and ``--accept``; a file that cannot be read ends the command."""
    if name is None:
        return {"accept": accept}
    if accept is not None:
        raise click.UsageError("--against and --accept exclude each other")
    entry = readable_input(name, limits)
    return {"against": entry.data, "against_name": entry.name}


def accepted_file(name: str | None, outcomes: Sequence[Outcome], *, force: bool) -> dict[str, str | bytes]:
    """What ``--accept`` writes; another run that is there already ends the command with what is different."""
    if name is None:
        return {}
    from pidcfg.cli.outputs import read_existing
    from pidcfg.output.runs import accepted_difference

    text, before = outcomes[0].accepted_text, None if force else read_existing(name)
    if text is None:
        write_remark(f"{name} is not written: the run has failed")
        return {}
    if before not in {None, text.encode()}:
        difference = accepted_difference(before or b"", text)
        raise click.ClickException(f"{name} exists and {difference}; use --force to overwrite it")
    return {name: text}


def files_of(scenarios: Sequence[Document], *, reference: bool = True) -> Iterator[str]:
    """The files that a run reads: the scenarios, and the configuration or listing and the reference that each names."""
    for doc in scenarios:
        yield doc.file
        names = [doc.data.get(key) for key in ("config", *["reference"] * reference)] if doc.data else []
        yield from ((Path(doc.file).parent / name).as_posix() for name in names if isinstance(name, str))


def exit_code(outcomes: Sequence[Outcome], *, strict: bool = False) -> Exit:
    """A scenario that cannot run outweighs one that fails."""
    from pidcfg.cli.formats.runs import worst_severity

    if any(outcome.report is None for outcome in outcomes):
        return Exit.UNUSABLE
    failed = not all(outcome.passed for outcome in outcomes)
    return Exit.FINDINGS if failed or (strict and worst_severity(outcomes) >= Severity.WARNING) else Exit.OK
