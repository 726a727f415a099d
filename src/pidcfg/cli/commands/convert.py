"""``pidcfg convert``: another vendor's configuration, and a report of what became of every field."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options
from pidcfg.cli.commands.decode import read_rows
from pidcfg.cli.files import plots
from pidcfg.cli.formats import report_options
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import echo, echo_json, note
from pidcfg.diagnostics import Diagnostic, Severity
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from pidcfg.conversion.pipeline import Converted
    from pidcfg.limits import Limits
    from pidcfg.scenario.verify import Verified
    from pidcfg.validate.engine import Checked
    from pidcfg.vendors import Vendor

EPILOG = options.examples(
    "pidcfg convert reactor.yaml --to click -o reactor-click.yaml --allow-loss",
    "pidcfg convert tank.yaml --to nextopid --report json -o tank-nextopid.yaml",
    "pidcfg convert tank.yaml --to dpide -o tank-dpide.yaml --report-output markdown=changes.md",
    "pidcfg convert tank.yaml --to dl06 -o tank-dl06.yaml --allow-loss --plot tank-dl06.svg",
    "pidcfg convert kiln.yaml --to dl06 --loop-table V3000 -o kiln-dl06.yaml",
)


def placement_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where things go that the source does not say, as options of the command."""
    rows = {row.key: row for vendor in VENDORS.values() for row in vendor.load("convert_options")}
    for row in reversed(rows.values()):
        command = click.option(f"--{row.key.replace('_', '-')}", row.key, metavar=row.metavar, help=row.title)(command)
    return command


def percent(ctx: click.Context, param: click.Parameter, text: str | None) -> float | None:
    """``1 %`` or ``1`` as a number."""
    if text is None:
        return None
    try:
        value = float(text.removesuffix("%").strip())
    except ValueError:
        value = -1.0
    if not 0 <= value < float("inf"):
        raise click.BadParameter(f"{text!r}; write a percentage like 1 %", ctx, param)
    return value


@click.command("convert", epilog=EPILOG)
@click.argument("file")
@click.option("--to", "target", type=click.Choice(list(VENDORS)), required=True, help="The PLC family to convert to.")
@options.OUT
@options.FORCE
@click.option("--allow-loss", is_flag=True, help="Write the file although something was dropped or clamped.")
@click.option(
    "--report",
    type=click.Choice(["text", "json"]),
    default="text",
    show_default=True,
    help="How the report is printed: text on stderr, JSON on stdout.",
)
@report_options.report_files("convert", flag="--report-output")
@click.option("--verify", is_flag=True, help="Run both sides on the same plants and report how far they lie apart.")
@click.option(
    "--max-deviation",
    metavar="PERCENT",
    callback=percent,
    help="With --verify: exit 1, nothing written, when a PV is further apart than this, in % of its range.",
)
@plots.VERIFIED
@placement_options
@options.QUIET
@options.LIMITS
def command(
    file: str,
    target: str,
    out: str | None,
    force: bool,
    allow_loss: bool,
    report: str,
    quiet: bool,
    limits: Limits,
    reports: tuple[report_options.Report, ...],
    verify: bool,
    max_deviation: float | None,
    plot: tuple[str, ...],
    **texts: str | None,
) -> None:
    """Convert the configuration FILE to another vendor's, and report what became of every field.

    Exit codes: 0 written, 1 nothing was written because something would be lost or is missing, 2 unusable input.
    """
    from pidcfg.cli.commands.validate import exit_code
    from pidcfg.cli.findings.collect import one_configuration, show_errors
    from pidcfg.cli.formats.conversion import Told

    if report == "json" and out is None:
        raise click.UsageError("the report and the file would both go to standard output; name the file with -o")
    report_options.refuse_inputs(reports, () if out is None else (out,), "is where the result goes")
    report_options.refuse_outputs((out, *plot, *(entry.path for entry in reports)), (file,))
    checked = one_configuration(file, limits)
    status = exit_code(list(checked.findings))
    if status is not Exit.OK or checked.vendor is None:
        show_errors(checked, report)
        note("nothing was written")
        click.get_current_context().exit(status)
    to = VENDORS[target]
    placed = read_rows(to, "convert_options", texts)
    converted = converted_or_ended(checked, to, placed, report)
    text = whole_text(checked, converted)
    result = recheck(text, to, limits)
    findings = [finding for finding in result.findings if finding.severity is Severity.ERROR]
    tested = (verify or plot or max_deviation is not None) and not findings
    verified = sides(checked, result, out) if tested else None
    told = Told(checked.vendor.key, target, converted, verified)
    lossy = bool(converted.losses) and not allow_loss
    apart = max_deviation is not None and told.pv_percent > max_deviation
    if report == "json":
        echo_json(told.json())
    elif shown := told.text(changes=not quiet or lossy, apart=not quiet or apart).strip():
        note(shown)
    if findings or lossy or apart:
        report_options.write_reports(reports, told.render)
        if findings:
            refuse(findings, text, to)
        note(
            "something would be lost: nothing was written; --allow-loss writes it all the same"
            if lossy
            else f"a PV is further apart than {max_deviation:g} % of its range: nothing was written"
        )
        click.get_current_context().exit(Exit.FOUND)
    charts = [entry.chart for entry in verified or ()]
    pictures = plots.drawn(plot, charts, f"{Path(file).name} for {to.title}")
    files = {**({} if out is None else {out: text}), **pictures}
    report_options.write_reports(reports, told.render, files, force=force)
    put(text, out, () if quiet else files)


def put(text: str, out: str | None, written: Iterable[str]) -> None:
    """Prints the result that goes to no file, and names the files."""
    if out is None:
        echo(text)
    for name in written:
        note(f"{name}: written")


def sides(checked: Checked, result: Checked, out: str | None) -> list[Verified]:
    """Both sides on the same plants."""
    from pidcfg.scenario.verify import verify
    from pidcfg.sim.run import UnusableError

    both = [
        (side.vendor, side.config, side.encoding.image)
        for side in (checked, result)
        if side.vendor is not None and side.encoding is not None
    ]
    names = [
        f"{Path(name).name} ({vendor.key})"
        for name, (vendor, _, _) in zip((checked.document.file, out or "result"), both, strict=True)
    ]
    try:
        return verify(both[0], both[1], (names[0], names[1]))
    except UnusableError as error:
        raise click.ClickException(f"the conversion cannot be verified: {error}") from None


def converted_or_ended(checked: Checked, target: Vendor, placed: dict[str, Any], fmt: str) -> Converted:
    """The conversion; what the source must say before it ends the command with findings at its keys."""
    from pidcfg.cli.formats.reporters import json_v1, text
    from pidcfg.conversion.pipeline import ConvertError, convert

    if checked.vendor is None:
        raise click.ClickException("the configuration names no vendor")
    try:
        return convert(checked.config, checked.vendor, target, placed)
    except ConvertError as error:
        doc = checked.document
        found = [
            Diagnostic("PID042", Severity.ERROR, entry.message, doc.file, doc.locate(entry.path, key=True), entry.path)
            for entry in error.missing
        ]
        if fmt == "json":
            echo_json(json_v1(found, {doc.file: doc}))
        else:
            note(text(found, {doc.file: doc}).rstrip())
        note("nothing was written")
        click.get_current_context().exit(Exit.FOUND)


def whole_text(checked: Checked, converted: Converted) -> str:
    """The file with the comments of the source."""
    from pidcfg.conversion.comments import comments, with_comments
    from pidcfg.writer import yaml_text

    head, loops = comments(checked.document, len(converted.loops))
    return with_comments(yaml_text(converted.data), head, loops)


def recheck(text: str, target: Vendor, limits: Limits) -> Checked:
    """The converted file as anybody would check it."""
    from pidcfg.source import read_document
    from pidcfg.validate.engine import check_document

    return check_document(read_document(text.encode(), f"<{target.key}>", limits), limits)


def refuse(findings: list[Diagnostic], written: str, target: Vendor) -> None:
    """Ends the command with what is wrong with the result."""
    from pidcfg.cli.formats.reporters import text
    from pidcfg.source import read_document

    name = f"<{target.key}>"
    note(text(findings, {name: read_document(written.encode(), name)}).rstrip())
    note(f"{target.title} would not take the result: nothing was written")
    click.get_current_context().exit(Exit.FOUND)
