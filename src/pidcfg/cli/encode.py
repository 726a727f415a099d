"""``pidcfg encode``: a configuration to the PLC's memory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, echo_json, note
from pidcfg.cli.main import Exit
from pidcfg.vendors import format_names, format_of

if TYPE_CHECKING:
    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg encode reactor.yaml",
    "pidcfg encode reactor.yaml --format ihex -o reactor.hex",
    "pidcfg encode reactor.yaml --format json | jq '.words[0]'",
)


@click.command("encode", epilog=EPILOG)
@click.argument("file")
@options.output_format(*format_names())
@options.OUT
@options.FORCE
@click.option(
    "--allow-errors", is_flag=True, help="Encode although validate reports errors, to see what the PLC would do."
)
@options.QUIET
@options.LIMITS
def command(file: str, fmt: str, out: str | None, force: bool, allow_errors: bool, quiet: bool, limits: Limits) -> None:
    """Write the PLC's memory for the configuration FILE (- for standard input): every word with its address."""
    from pidcfg.cli.checks import one_configuration, show_errors
    from pidcfg.cli.outputs import write_files
    from pidcfg.cli.validate import exit_code

    checked = one_configuration(file, limits)
    status = exit_code(list(checked.findings))
    unfit = checked.encoding is None or bool(checked.encoding.misfits)
    if status is not Exit.OK and (unfit or not allow_errors):
        show_errors(checked, fmt)
        note("nothing was written")
        click.get_current_context().exit(status)
    if checked.encoding is None or checked.vendor is None:
        raise click.ClickException(f"{file} could not be encoded")
    try:
        kind = format_of(checked.vendor, fmt)
    except KeyError as error:
        raise click.UsageError(error.args[0]) from None
    checklist = checked.vendor.load("checklist")(checked.config)
    text = kind.write(checked.encoding.image, checklist)
    if out is None:
        (echo_json if fmt == "json" else echo)(text)
    else:
        write_files({out: text}, force=force)
    if not quiet and (out is not None or fmt == "ihex"):
        for item in checklist:
            note(f"check after the download: {item}")
        if out is not None:
            note(f"{out}: {len(checked.encoding.image.cells)} words")
