"""``pidcfg decode``: a memory listing back to a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options
from pidcfg.cli.files.inputs import read_input
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import echo, note
from pidcfg.diagnostics import Diagnostic, Severity, Span
from pidcfg.vendors import VENDORS, Vendor, format_names

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg decode reactor.json --vendor dl06",
    "pidcfg decode reactor.hex --vendor dl06 -o decoded.yaml",
    "pidcfg decode table.csv --vendor dl06 --loop-table V2000 --number-of-loops 3",
    "pidcfg decode nicknames.csv --vendor click --pwm-bit none",
    "pidcfg decode reactor.hex --vendor dl06 --annotate",
)


def vendor_options(command: Callable[..., Any]) -> Callable[..., Any]:
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
@click.option("--annotate", is_flag=True, help="Print the listing with a meaning beside every word instead.")
@vendor_options
@options.OUT
@options.FORCE
@options.QUIET
@options.LIMITS
def command(
    image: tuple[str, ...],
    vendor: str,
    kind: str | None,
    annotate: bool,
    out: str | None,
    force: bool,
    quiet: bool,
    limits: Limits,
    **texts: str | None,
) -> None:
    """Read the memory listing IMAGE (- for standard input) back into a configuration.

    Several files are read as one listing: an image may be spread over them.
    """
    from pidcfg.cli.files.listings import annotate_listing, decode_yaml, read_listing, together
    from pidcfg.cli.files.outputs import write_files
    from pidcfg.encoders.listing import ListingError

    entries = [read_input(name, limits) for name in image]
    listings, entry = [], entries[0]
    try:
        for entry in entries:
            if entry.problem is not None:
                raise click.ClickException(entry.problem)
            listings.append(read_listing(entry, VENDORS[vendor], limits, kind))
        work = annotate_listing if annotate else decode_yaml
        text, notes = work(together(listings), VENDORS[vendor], read_rows(VENDORS[vendor], "decode_options", texts))
    except ListingError as error:
        _fail(entry.name, str(error), Span(error.line, error.column, error.line, error.column + 1))
    if out is None:
        echo(text)
    else:
        write_files({out: text}, force=force)
    if not quiet:
        for line in notes:
            note(f"note: {line}")


def read_rows(vendor: Vendor, column: str, texts: Mapping[str, str | None]) -> dict[str, Any]:
    """The vendor's own options as values; another vendor's option, or a text that makes no sense, is wrong usage."""
    rows = {row.key: row for row in vendor.load(column)}
    values = {}
    for key, text in texts.items():
        if text is None:
            continue
        option = f"--{key.replace('_', '-')}"
        if key not in rows:
            raise click.UsageError(f"{option} is not for {vendor.title}")
        values[key] = rows[key].read(text)
        if values[key] is None:
            raise click.BadParameter(f"{text!r}; write it like {rows[key].example}", param_hint=option)
    return values


def _fail(file: str, message: str, span: Span) -> None:
    from pidcfg.cli.formats.reporters import text

    found = Diagnostic("PID041", Severity.ERROR, message, file, span)
    note(text([found], {}).rstrip())
    click.get_current_context().exit(Exit.UNUSABLE)
