"""``pidcfg decode``: a memory listing back to a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, write_note, write_remark
from pidcfg.cli.inputs import listing_fault, read_input
from pidcfg.cli.main import Exit
from pidcfg.cli.options import refuse_all, usage_errors
from pidcfg.vendors import VENDORS, format_names

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterable

    from pidcfg.output.words import DecodeResult
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg decode reactor.json --vendor dl06",
    "pidcfg decode reactor.hex --vendor dl06 -o decoded.yaml",
    "pidcfg decode table.csv --vendor dl06 --loop-table V2000 --number-of-loops 3",
    "pidcfg decode upload.hex --vendor dl06 --like reactor.yaml",
    "pidcfg decode nicknames.csv --vendor click --pwm-bit none",
    "pidcfg decode reactor.hex --vendor dl06 --annotate",
    "pidcfg decode upload.csv --vendor dl06 --suggest corrected.txt",
    "pidcfg decode project.xml --vendor nextopid --pou Boiler",
)


def vendor_options(command: Callable[..., object]) -> Callable[..., object]:
    """What listings of any vendor may lack, as options of the command."""
    rows = {row.key: row for vendor in VENDORS.values() for row in vendor.load("decode_options")}
    for row in reversed(rows.values()):
        command = click.option(f"--{row.key.replace('_', '-')}", row.key, metavar=row.metavar, help=row.title)(command)
    return command


@click.command("decode", epilog=EPILOG)
@click.argument("image", nargs=-1, required=True)
@click.option("--vendor", type=click.Choice(list(VENDORS)), required=True, help="The PLC family that the memory is of.")
@click.option(
    "--from",
    "kind",
    type=click.Choice(format_names()),
    help="The listing's format; found out by itself when not given.",
)
@click.option(
    "--like",
    metavar="FILE",
    help="A configuration that gives names, ranges and units where the listing does not.",
)
@click.option("--pou", metavar="NAME", help="Which program to read of a NextoPID project (PLCopen XML) with several.")
@click.option("--annotate", is_flag=True, help="Print the listing with a meaning beside every word instead.")
@click.option(
    "--suggest",
    metavar="FILE",
    callback=options.refuse_dash,
    help="Also write the listing with BCD where words seem typed in decimal, and both readings beside them.",
)
@vendor_options
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@options.STDIN_FILENAME_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    image: tuple[str, ...],
    vendor: str,
    kind: str | None,
    like: str | None,
    annotate: bool,
    suggest: str | None,
    pou: str | None,
    out: str | None,
    force: bool,
    quiet: bool,
    limits: Limits,
    **vendor_texts: str | None,
) -> None:
    """Read the memory listing IMAGE (- for standard input) back into a configuration.

    Several files are read as one listing: an image may be spread over them.
    """
    from pidcfg.api import decode
    from pidcfg.cli.findings import load_configuration
    from pidcfg.cli.formats.findings import findings_text
    from pidcfg.cli.outputs import write_files

    if annotate and suggest is not None:
        raise click.UsageError("--annotate and --suggest do not go together")
    entries = [read_input(name, limits) for name in image]
    if any(entry.problem is not None for entry in entries):
        refuse_all([fault for entry in entries if (fault := listing_fault(entry, VENDORS[vendor], kind)) is not None])
    data, names = [entry.data for entry in entries], [entry.name for entry in entries]
    like_document = None if like is None else load_configuration(like, limits)
    with usage_errors({"format": "--from"}):
        result = decode(
            data,
            vendor,
            format=kind,
            like=like_document,
            annotate=annotate,
            pou=pou,
            options=vendor_texts,
            name=names,
            limits=limits,
        )
    if not result.text:
        write_note(findings_text(result.findings, {}).rstrip())
        click.get_current_context().exit(Exit.UNUSABLE)
    outputs = {
        path: content for path, content in ((out, result.text), (suggest, result.suggestion)) if path and content
    }
    if out is None:
        echo(result.text)
    write_files(outputs, force=force)
    tell_notes((*result.notes, *_suggestion_notes(result, suggest)), result.warnings, quiet=quiet)
    if out is not None and not annotate:
        from pidcfg.cli.console import suggest_next_step

        suggest_next_step("validate", out, quiet=quiet)


def tell_notes(notes: Iterable[str], warnings: Collection[str], *, quiet: bool) -> None:
    """Notes on a listing; those that are warnings are never kept quiet."""
    for line in notes:
        if line in warnings or not quiet:
            write_remark(f"{'warning' if line in warnings else 'note'}: {line}")


def _suggestion_notes(result: DecodeResult, suggest: str | None) -> tuple[str, ...]:
    """How to get the corrected listing, or that there is none."""
    if suggest is None:
        return ("--suggest FILE writes the corrected listing, with both readings",) if result.suggestion else ()
    return () if result.suggestion else (f"{suggest} is not written: no word seems typed in decimal",)
