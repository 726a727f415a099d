"""``pidcfg convert``: another vendor's configuration, and a report of what became of every field."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click
from click.core import ParameterSource

from pidcfg.cli import options, plots
from pidcfg.cli.console import echo, echo_json, write_note, write_remark
from pidcfg.cli.formats import report_options
from pidcfg.cli.main import Exit
from pidcfg.cli.options import VerifyCommand, usage_errors
from pidcfg.cli.terminal import LINE
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from pidcfg.output.conversion import ConvertResult
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg convert reactor.yaml --to click -o reactor-click.yaml --allow-loss",
    "pidcfg convert tank.yaml --to nextopid --report json -o tank-nextopid.yaml",
    "pidcfg convert tank.yaml --to dpide -o tank-dpide.yaml --report-output markdown=changes.md",
    "pidcfg convert tank.yaml --to dl06 -o tank-dl06.yaml --allow-loss --plot tank-dl06.svg",
    "pidcfg convert kiln.yaml --to dl06 --loop-table V3000 -o kiln-dl06.yaml",
)


def placement_options(command: Callable[..., object]) -> Callable[..., object]:
    """Where things go that the source does not say, as options of the command."""
    rows = {row.key: row for vendor in VENDORS.values() for row in vendor.load("convert_options")}
    for row in reversed(rows.values()):
        command = click.option(f"--{row.key.replace('_', '-')}", row.key, metavar=row.metavar, help=row.title)(command)
    return command


def parse_percent(ctx: click.Context, param: click.Parameter, text: str | None) -> float | None:
    """``1 %`` or ``1`` as a number."""
    if text is None:
        return None
    try:
        value = options.NUMBER_TYPE.convert(text.removesuffix("%").strip(), None, None)
    except click.UsageError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise click.BadParameter(f"{text!r}; write a percentage like 1 %", ctx, param)
    return value


@click.command("convert", cls=VerifyCommand, epilog=EPILOG)
@click.argument("file")
@click.option("--to", "target", type=click.Choice(list(VENDORS)), required=True, help="The PLC family to convert to.")
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@click.option("--allow-loss", is_flag=True, help="Write the file although something is lost: the report says what.")
@click.option(
    "--max-loss",
    metavar="LIMITS",
    help="How far values may be rounded without being a loss.  [default: gain=2%,time=5%,filter=10%,band=10%]",
)
@click.option(
    "--report",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="How the report is printed: text on stderr, in full where it is asked for, JSON on stdout.",
)
@click.option("-v", "--verbose", is_flag=True, help="Print every change, and every picture of --verify.")
@report_options.report_files("convert")
@click.option(
    "--verify",
    type=click.Choice(["pass", "report"]),
    metavar="[=report]",
    help="Run both sides through a battery of stages on the same plants: exit 1, nothing written, where they behave "
    "otherwise than the report says; with =report only say so.",
)
@click.option(
    "--max-deviation",
    metavar="PERCENT",
    callback=parse_percent,
    help="As --verify, and exit 1, nothing written, when a PV is further apart than this, in % of its range.",
)
@plots.VERIFIED_OPTION
@options.JOBS_OPTION
@placement_options
@options.STDIN_FILENAME_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
@options.exit_zero
def command(
    file: str,
    target: str,
    out: str | None,
    force: bool,
    allow_loss: bool,
    max_loss: str | None,
    report: str,
    verbose: bool,
    quiet: bool,
    limits: Limits,
    reports: tuple[report_options.Report, ...],
    verify: str | None,
    max_deviation: float | None,
    plot: tuple[str, ...],
    jobs: int | None,
    **placements: str | None,
) -> None:
    """Convert the configuration FILE to another vendor's, and report what became of every field.

    A loop that cannot be converted does not stop the others; it is a loss like what is dropped, clamped or rounded too
    far, and nothing is written without --allow-loss.

    Exit codes: 0 written, 1 nothing was written because something would be lost, is missing or behaves otherwise,
    2 unusable input.
    """
    from pidcfg.api import convert
    from pidcfg.cli.findings import exit_code, load_configuration, show_errors
    from pidcfg.cli.formats.conversion import render_conversion

    if report == "json" and out is None:
        raise click.UsageError("the report and the file would both go to standard output; name the file with -o")
    report_options.refuse_inputs(reports, () if out is None else (out,), "is where the result goes")
    report_options.refuse_outputs((out, *plot, *(entry.path for entry in reports)), (file,))
    is_verified = bool(verify or plot or max_deviation is not None)
    with usage_errors():
        result = convert(
            load_configuration(file, limits),
            target,
            verify=is_verified,
            jobs=options.process_count(jobs),
            max_loss=max_loss,
            limits=limits,
            options=placements,
            progress=show_progress,
        )
    if not result.text:
        show_errors(result.findings, result.document, report)
        write_note("nothing was written")
        click.get_current_context().exit(exit_code(result.findings))
    if result.unverified and result.ok:
        raise click.ClickException(f"the conversion cannot be verified: {result.unverified}")
    result, has_losses = name_charts(result, out), result.losses and not allow_loss
    is_too_far = max_deviation is not None and result.pv_percent > max_deviation
    differs = bool(verify == "pass" or max_deviation is not None) and verify != "report" and not result.alike
    if report == "json":
        echo_json(render_conversion("json", result))
    else:
        shows_verdict = not quiet or is_too_far or differs
        show_report(result, verbose, changes=not quiet, losses=has_losses, with_verdict=shows_verdict)
    if not result.ok or has_losses or is_too_far or differs:
        report_options.write_reports(reports, lambda fmt: render_conversion(fmt, result))
        refuse_result(result, has_losses, differs, max_deviation)
    charts = [loop.chart for loop in result.verified or ()]
    pictures = plots.draw_files(plot, charts, f"{Path(file).name} for {VENDORS[target].title}")
    files = {**({} if out is None else {out: result.text}), **pictures}
    report_options.write_reports(reports, lambda fmt: render_conversion(fmt, result), files, force=force)
    print_result(result.text, out, () if quiet else files)


def show_report(result: ConvertResult, verbose: bool, **parts: bool) -> None:
    """The report on standard error; whole where the command line names it, and not by default."""
    from pidcfg.cli.formats.conversion import conversion_report

    source = click.get_current_context().get_parameter_source("report")
    if shown_text := conversion_report(result, **parts, full=verbose or source is not ParameterSource.DEFAULT).strip():
        write_note(shown_text)


def show_progress(share: float) -> None:
    """What the line on the terminal shows while both sides run."""
    LINE.update("simulating both sides", share)


def name_charts(result: ConvertResult, out: str | None) -> ConvertResult:
    """The result with charts that call it by the name of its file."""
    if result.verified is None or out is None:
        return result
    name = f"{Path(out).name} ({result.target})"
    sides = (f"{Path(result.document.file).name} ({result.source})", name)
    return replace(result, verified=tuple(replace(v, chart=replace(v.chart, sides=sides)) for v in result.verified))


def print_result(text: str, out: str | None, written_files: Collection[str]) -> None:
    """Prints the result that goes to no file, and names the files."""
    from pidcfg.cli.console import suggest_next_step

    if out is None:
        echo(text)
    for name in written_files:
        write_remark(f"{name}: written")
    if out is not None and written_files:
        suggest_next_step("validate", out)


def refuse_result(result: ConvertResult, has_losses: bool, differs: bool, max_deviation: float | None) -> NoReturn:
    """Ends the command with why nothing was written."""
    from pidcfg.cli.formats.findings import findings_text
    from pidcfg.output.findings import errors_in

    document = result.target_document
    if not result.ok and document is not None:
        write_note(findings_text(errors_in(result.target_findings), {document.file: document}).rstrip())
        write_note(f"{VENDORS[result.target].title} would not take the result: nothing was written")
    elif differs:
        write_note(
            "the result behaves otherwise than the report says: nothing was written; --verify=report only says so"
        )
    elif has_losses:
        write_note("something would be lost: nothing was written; --allow-loss writes it all the same")
    else:
        write_note(f"a PV is further apart than {max_deviation:g} % of its range: nothing was written")
    click.get_current_context().exit(Exit.FINDINGS)
