"""``pidcfg simulate``: the encoded loops against plants, judged by expectations."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.extras import need
from pidcfg.cli.files import plots
from pidcfg.cli.files.inputs import read_inputs
from pidcfg.cli.formats import report_options
from pidcfg.cli.formats.simulation import render_runs
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import note
from pidcfg.cli.terminal.progress import LINE
from pidcfg.diagnostics import Diagnostic, Severity

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from pidcfg.cli.formats.simulation_text import Outcome
    from pidcfg.limits import Limits
    from pidcfg.scenario.charts import Axes
    from pidcfg.scenario.load import Loaded
    from pidcfg.sim.recording import Recording
    from pidcfg.sim.run import Settings
    from pidcfg.source import Document

EPILOG = options.examples(
    "pidcfg simulate reactor.scenario.yaml",
    "pidcfg simulate reactor.scenario.yaml --csv trend.csv --every 5",
    "pidcfg simulate reactor.scenario.yaml --plot trend.svg --plot -",
    "pidcfg simulate scenarios/ --format json",
    "pidcfg simulate scenarios/ --output junit=simulation.xml",
)


@click.command("simulate", epilog=EPILOG)
@click.argument("paths", nargs=-1, required=True, metavar="SCENARIO...")
@report_options.report_format("simulate")
@report_options.report_files("simulate")
@click.option("--csv", "csv", type=click.Path(dir_okay=False), help="Write the trend: time and one column a signal.")
@click.option(
    "--every", type=click.IntRange(1), default=1, show_default=True, help="Rows of the trend: one every N base steps."
)
@plots.PLOT
@plots.LOOPS
@click.option(
    "--engine",
    type=click.Choice(["auto", "python", "numba"]),
    default="auto",
    show_default=True,
    help="numba (extra pidcfg[fast]) pays for long runs; the results are the same.",
)
@click.option("--no-limit", is_flag=True, help="Run however many loop-steps it takes.")
@options.FORCE
@options.STRICT
@options.QUIET
@options.LIMITS
def command(
    paths: tuple[str, ...],
    fmt: str,
    reports: tuple[report_options.Report, ...],
    csv: str | None,
    every: int,
    plot: tuple[str, ...],
    plot_loops: tuple[str, ...],
    engine: str,
    no_limit: bool,
    force: bool,
    strict: bool,
    quiet: bool,
    limits: Limits,
) -> None:
    """Run each SCENARIO against its plants and judge its expectations.

    Exit codes: 0 all hold, 1 a failed expectation (or a configuration with errors of which nothing is expected), 2 a
    scenario that cannot run.
    """
    from pidcfg.cli.files.trend import trend_file
    from pidcfg.cli.formats.simulation_text import verdict_line
    from pidcfg.sim.run import Settings

    if engine == "numba":
        need("numba", "fast")
    scenarios = wanted(list(read_inputs(paths, limits)), paths)
    if not scenarios:
        raise click.UsageError(f"{', '.join(paths)}: no scenario there; one begins with 'scenario: …'")
    if csv is not None and len(scenarios) != 1:
        raise click.UsageError(f"--csv takes one scenario, not {len(scenarios)}")
    report_options.refuse_inputs(reports, () if csv is None else (csv,), "is where the trend goes")
    report_options.refuse_outputs((csv, *plot, *(report.path for report in reports)), files_of(scenarios))
    if fmt != "text" and plots.TERMINAL in plot:
        raise click.UsageError(f"--plot - and --format {fmt} would both go to standard output; name a file")
    if plot_loops and not plot:
        raise click.UsageError("--plot-loop needs --plot")
    files: dict[str, str | bytes] = {}
    with trend_file(csv, force=force, beside=files) as trend:
        settings = Settings(
            engine=engine,  # type: ignore[arg-type]  # one of the choices
            every=every,
            max_loop_steps=None if no_limit else limits.loop_steps,
            trend=trend,
        )
        outcomes = run_all(scenarios, settings, limits, record=bool(plot))
        charts = plots.of_runs(outcomes, plot_loops) if plot else []
        files |= plots.drawn(plot, charts, *plots.heading(outcomes))
        # Told before trend and pictures are put in their places: a file there that differs costs no result.
        fails = Severity.WARNING if strict else Severity.ERROR
        report_options.deliver(fmt, reports, lambda name: render_runs(name, outcomes, fails))
        if plots.TERMINAL in plot:
            plots.show(charts)
    if fmt == "github" and not quiet:
        for outcome in outcomes:
            line = "cannot run" if outcome.report is None else verdict_line(outcome, outcome.report)
            note(f"{outcome.file}: {line}")
    click.get_current_context().exit(exit_code(outcomes, strict=strict))


def run_all(scenarios: Sequence[Document], settings: Settings, limits: Limits, *, record: bool) -> list[Outcome]:
    """Runs the scenarios one after another; the line on the terminal shows how many are done, in shares of a run."""
    outcomes = []
    for done, doc in enumerate(scenarios):

        def told(share: float, done: int = done, label: str = Path(doc.file).name) -> None:
            LINE.update(f"simulating {label}", (done + share) / len(scenarios))

        LINE.update(f"simulating {Path(doc.file).name}", done / len(scenarios) if done else None)
        outcomes.append(simulate_document(doc, replace(settings, progress=told), limits, record=record))
    return outcomes


def wanted(documents: list[Document], paths: Sequence[str]) -> list[Document]:
    """The scenarios among the documents, and whatever was named but is none; configurations in folders are left out."""
    from pidcfg.validate.engine import is_scenario

    return [doc for doc in documents if is_scenario(doc) or doc.data is None or doc.file in paths]


def files_of(scenarios: Sequence[Document]) -> Iterator[str]:
    """The files that a run reads: the scenarios, and the configuration or listing that each names."""
    for doc in scenarios:
        yield doc.file
        named = doc.data.get("config") if doc.data else None
        if isinstance(named, str):
            yield (Path(doc.file).parent / named).as_posix()


def simulate_document(doc: Document, settings: Settings, limits: Limits, *, record: bool = False) -> Outcome:
    """Runs one scenario file; ``record``: with the trend of its loops, for `charts_of`."""
    from pidcfg.cli.formats.simulation_text import Outcome
    from pidcfg.scenario.load import load
    from pidcfg.sim.run import UnusableError, simulate
    from pidcfg.validate.engine import is_scenario

    if doc.data is not None and not is_scenario(doc):
        cure = "a scenario begins with 'scenario: …' and names its configuration"
        found = Diagnostic("PID032", Severity.ERROR, "the file is no scenario", doc.file, help=cure)
        return Outcome(doc.file, findings=[found], documents={doc.file: doc})
    loaded = load(doc, limits)
    if loaded.scenario is None or loaded.image is None:
        return Outcome(doc.file, loaded.config, None, loaded.findings, loaded.documents)
    try:
        axes, recording = recorded(loaded) if record else ({}, None)
        settings = replace(settings, recording=recording)
        report = simulate(loaded.scenario, loaded.plc, loaded.controller, settings)
    except UnusableError as error:
        loaded.add(error.problems)
        return Outcome(doc.file, loaded.config, None, loaded.findings, loaded.documents)
    loaded.add(report.problems)
    findings, wrong = [*loaded.findings, *loaded.config_errors], bool(loaded.config_errors)
    return Outcome(doc.file, loaded.config, report, findings, loaded.documents, wrong, recording, axes)


def recorded(loaded: Loaded) -> tuple[dict[str, Axes], Recording]:
    """What the loops' signals are called, and where they will be recorded."""
    from pidcfg.scenario.charts import axes_of, signals_of
    from pidcfg.sim.recording import Recording

    axes = axes_of(loaded.plc(), loaded.image.settings)
    return axes, Recording(signals_of(axes))


def exit_code(outcomes: Sequence[Outcome], *, strict: bool = False) -> Exit:
    """A scenario that cannot run outweighs one that fails."""
    from pidcfg.cli.formats.simulation_text import worst

    if any(outcome.report is None for outcome in outcomes):
        return Exit.UNUSABLE
    failed = not all(outcome.passed for outcome in outcomes)
    return Exit.FOUND if failed or (strict and worst(outcomes) >= Severity.WARNING) else Exit.OK


def check_scenario(doc: Document, limits: Limits) -> list[Diagnostic]:
    """All findings of a scenario file, for ``validate``."""
    from pidcfg.scenario import load

    return load.check_scenario(doc, limits)
