"""``pidcfg decode``: a memory listing back to a configuration."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, note
from pidcfg.cli.inputs import read_input
from pidcfg.cli.main import Exit
from pidcfg.diagnostics import Diagnostic, Severity, Span
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg decode reactor.json --vendor dl06",
    "pidcfg decode reactor.hex --vendor dl06 -o decoded.yaml",
    "pidcfg decode table.csv --vendor dl06 --loop-table V2000 --number-of-loops 3",
)


@click.command("decode", epilog=EPILOG)
@click.argument("image")
@click.option("--vendor", type=click.Choice(list(VENDORS)), required=True, help="The PLC family that the memory is of.")
@click.option("--from", "kind", type=click.Choice(["text", "csv", "json", "ihex", "modbus"]),
              help="The listing's format; found out by itself when not given.")  # fmt: skip
@click.option("--loop-table", metavar="ADDRESS", help="Start of the loop table, for a listing without its pointer.")
@click.option("--number-of-loops", type=click.IntRange(0, 99), help="How many loops, for a listing without the count.")
@click.option("--reset-decimals", type=click.Choice(["1", "2"]), help="Implied decimals of the reset words.")
@options.OUT
@options.FORCE
@options.QUIET
@options.LIMITS
def command(
    image: str, vendor: str, kind: str | None, loop_table: str | None, number_of_loops: int | None,
    reset_decimals: str | None, out: str | None, force: bool, quiet: bool, limits: Limits,
) -> None:  # fmt: skip
    """Read the memory listing IMAGE (- for standard input) back into a configuration."""
    from pidcfg.cli.listings import decode_listing
    from pidcfg.cli.outputs import write_files
    from pidcfg.encoders.listing import ListingError
    from pidcfg.encoders.words import DecodeError
    from pidcfg.writer import yaml_text

    entry = read_input(image, limits)
    if entry.problem is not None:
        raise click.ClickException(entry.problem)
    choices: dict[str, Any] = {"number_of_loops": number_of_loops, "reset_decimals": reset_decimals}
    choices["loop_table"] = _address(loop_table)
    try:
        decoded = decode_listing(entry, VENDORS[vendor], choices, limits, kind)
    except ListingError as error:
        _fail(entry.name, str(error), Span(error.line, error.column, error.line, error.column + 1))
    except DecodeError as error:
        _fail(entry.name, str(error), Span(1, 1, 1, 1))
    text = yaml_text(decoded.data)
    if out is None:
        echo(text)
    else:
        write_files({out: text}, force=force)
    if not quiet:
        for line in decoded.notes:
            note(f"note: {line}")


def _address(text: str | None) -> int | None:
    from pidcfg.encoders.dl06_files import parse_address

    address = None if text is None else parse_address(text)
    if text is not None and address is None:
        raise click.BadParameter(f"{text!r} is not an address; write it like V2000", param_hint="--loop-table")
    return address


def _fail(file: str, message: str, span: Span) -> None:
    from pidcfg.cli.reporters import text

    found = Diagnostic("PID041", Severity.ERROR, message, file, span)
    note(text([found], {}).rstrip())
    click.get_current_context().exit(Exit.UNUSABLE)
