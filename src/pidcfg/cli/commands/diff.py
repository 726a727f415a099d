"""``pidcfg diff``: two configurations or memory listings compared, in their own words within a vendor."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from pidcfg.cli import options, plots
from pidcfg.cli.console import write_remark
from pidcfg.cli.formats import report_options
from pidcfg.cli.main import Exit
from pidcfg.cli.options import VerifyCommand, usage_errors
from pidcfg.cli.terminal import LINE
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.cli.inputs import Input
    from pidcfg.output.differences import DiffResult
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

UNREADABLE_CODE, UNKNOWN_MEANING_CODE = "PID041", "PID042"
"""A listing that cannot be read; a configuration that does not say what its values mean."""
EPILOG = options.examples_text(
    "pidcfg diff main.yaml branch.yaml",
    "pidcfg diff reactor.yaml upload.hex --exit-code",
    "pidcfg diff monday.hex friday.hex --like reactor.yaml",
    "pidcfg diff reactor.yaml reactor-click.yaml --format markdown",
    "pidcfg diff main.yaml branch.yaml --report-output markdown=changes.md",
    "pidcfg diff main.yaml branch.yaml --plot before-after.svg",
)


@click.command("diff", cls=VerifyCommand, epilog=EPILOG)
@click.argument("before")
@click.argument("after")
@click.option(
    "--vendor",
    type=click.Choice(list(VENDORS)),
    help="The PLC family of a memory listing, where the other side does not tell.",
)
@click.option(
    "--like",
    metavar="FILE",
    help="A configuration that gives listings their names, ranges and units; else it is the other side.",
)
@click.option(
    "--live", is_flag=True, help="Compare with a listing also what runs: PV, output, mode, set point, status, requests."
)
@report_options.report_format("diff")
@report_options.report_files("diff", "--output")
@plots.OVERLAY_OPTION
@options.FORCE_OPTION
@plots.VERIFY_OPTION
@options.JOBS_OPTION
@click.option("--exit-code", "exit_on_difference", is_flag=True, help="Exit 1 when there are differences.")
@options.STDIN_FILENAME_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    before: str,
    after: str,
    vendor: str | None,
    like: str | None,
    live: bool,
    fmt: str,
    reports: tuple[report_options.Report, ...],
    plot: tuple[str, ...],
    force: bool,
    exit_on_difference: bool,
    verify: str | None,
    jobs: int | None,
    limits: Limits,
) -> None:
    """Compare BEFORE and AFTER, configurations of any vendors or memory listings.

    Two of one vendor are compared key by key, with units and registers; two of different vendors by meaning, in
    engineering units. Differences are ranked by what can go wrong. Against a listing are left out: PV, output, mode,
    status, requests, the bias of a loop with an integral, a set point under ramp/soak or from another loop. Another set
    point is shown as operated, and is no difference.
    """
    from pidcfg.api import diff
    from pidcfg.cli.formats.conversion import render_differences
    from pidcfg.cli.inputs import STDIN, Input

    if before == after == STDIN:
        raise click.UsageError("standard input can be read only once: name a file for BEFORE or for AFTER")
    report_options.refuse_outputs((*plot, *(report.path for report in reports)), (before, after))
    plots.check_options(fmt, plot)
    sources = [_read_source(name, limits) for name in (before, after)]
    for entry, other in zip(sources, reversed(sources), strict=True):
        if isinstance(entry, Input) and entry.problem is not None:
            _refuse_unreadable(entry, other, vendor or like, fmt)
    before_source, after_source = (source.data if isinstance(source, Input) else source for source in sources)
    with usage_errors():
        like_document = None if like is None else _read_configuration(like, limits)
        result = diff(
            before_source,
            after_source,
            vendor=vendor,
            like=like_document,
            live=live,
            verify=bool(plot or verify),
            jobs=options.process_count(jobs),
            names=(before, after),
            limits=limits,
            progress=lambda share: LINE.update("simulating both sides", share),
        )
    if not result.ok:
        refuse_result(result, fmt)
    for line in result.notes:
        write_remark(f"note: {line}")
    charts = [loop.chart for loop in result.verified or ()]
    pictures = plots.draw_files(plot, charts, f"{Path(before).name} and {Path(after).name}")
    report_options.deliver_reports(fmt, reports, lambda name: render_differences(name, result), pictures, force=force)
    if plots.TERMINAL_NAME in plot:
        plots.show_charts(charts)
    is_unlike = verify == "pass" and not result.alike
    if is_unlike or (exit_on_difference and not result.same):
        click.get_current_context().exit(Exit.FINDINGS)


def _read_configuration(name: str, limits: Limits) -> Document:
    """The document of a configuration."""
    from pidcfg.cli.findings import load_configuration

    return load_configuration(name, limits)


def _read_source(name: str, limits: Limits) -> Document | Input:
    """A YAML file's document, or a memory listing as it was read."""
    from pidcfg.cli.inputs import STDIN_TITLE, name_of, read_input
    from pidcfg.output.differences import is_listing

    if name_of(name) == STDIN_TITLE or not is_listing(name_of(name)):
        return _read_configuration(name, limits)
    return read_input(name, limits)


def _refuse_unreadable(entry: Input, other: Document | Input, family: str | None, fmt: str) -> NoReturn:
    """Ends the command with what is wrong with the configuration on the other side, else with the listing's fault."""
    from pidcfg.api import diff
    from pidcfg.cli.findings import show_errors
    from pidcfg.cli.inputs import Input, document_of_input

    if not isinstance(other, Input):
        result = diff(other, other, names=(other.file, other.file), limits=other.limits)
        if not result.ok:
            refuse_result(result, fmt)
    elif family is None:
        raise click.UsageError("neither file says the PLC family; name it with --vendor")
    if fmt == "json":
        listing = document_of_input(entry)
        show_errors(listing.problems, listing, fmt)
    raise click.ClickException(entry.problem or "")


def refuse_result(result: DiffResult, fmt: str) -> NoReturn:
    """Ends the command with what is wrong with a side: as the result where JSON was asked for."""
    from pidcfg.cli.findings import show_errors

    findings, name = result.findings, result.refused
    codes = {d.code for d in findings}
    if fmt == "json" or not codes & {UNREADABLE_CODE, UNKNOWN_MEANING_CODE}:
        show_errors(findings, result.document, fmt)
    if UNREADABLE_CODE in codes:
        d = findings[0]
        raise click.ClickException(f"{name}:{d.span.line}: {'; '.join(filter(None, (d.message, d.help)))}")
    if UNKNOWN_MEANING_CODE not in codes:
        raise click.ClickException(f"{name} cannot be compared")
    for d in findings:
        write_remark(f"{name}: {d.message}")
    raise click.ClickException(f"{name} does not say what its values mean")
