"""``pidcfg init``: a commented starter file, or a first scenario for a configuration."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.terminal.console import echo, note
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg init --vendor dl06",
    "pidcfg init --vendor dl06 -o oven.yaml",
    "pidcfg init --vendor dl06 | pidcfg validate -",
    "pidcfg init --scenario oven.yaml -o oven.scenario.yaml",
)


@click.command("init", epilog=EPILOG)
@click.option("--vendor", type=click.Choice(list(VENDORS)), help="The PLC family to write for.")
@click.option(
    "--scenario",
    "config",
    metavar="CONFIG",
    help="Write a scenario for this configuration: a plant for each loop, steps, disturbances and expectations.",
)
@options.OUT
@options.FORCE
@options.QUIET
@options.LIMITS
def command(
    vendor: str | None, config: str | None, out: str | None, force: bool, quiet: bool, limits: Limits
) -> None:
    """Write a starter file that passes validate, with the usual keys explained.

    With --scenario, write a first scenario for a configuration. Its plants suit the loops' gains; it has been run, and
    no verdict fails that it does not name.
    """
    from pidcfg.cli.files.outputs import write_files

    if (vendor is None) == (config is None):
        raise click.UsageError("one of --vendor and --scenario is wanted: a starter file, or a scenario for a file")
    if config is not None:
        text, then = _scenario(config, out, limits), f"run it with 'pidcfg simulate {out}'"
    else:
        starter = VENDORS[str(vendor)].starter
        text = files("pidcfg").joinpath(starter).read_text(encoding="utf-8")
        then = f"edit it, then run 'pidcfg validate {out}'"
    if out is None:
        echo(text)
        return
    write_files({out: text}, force=force)
    if not quiet:
        note(f"{out}: {then}")


def _scenario(config: str, out: str | None, limits: Limits) -> str:
    """The scenario of a configuration, which it names as seen from the folder that it is written to."""
    from pidcfg.cli.findings.collect import one_configuration, show_errors
    from pidcfg.draft.write import NoDraftError, draft_of
    from pidcfg.validate.engine import check_document

    doc = one_configuration(config, limits)
    checked = check_document(doc, limits)
    if checked.failed:
        show_errors(checked.findings, doc, "text")
    folder = Path(out).parent if out is not None else Path()
    name = config if config == "-" else Path(os.path.relpath(config, folder)).as_posix()
    try:
        return draft_of(checked, name).text
    except NoDraftError as error:
        raise click.ClickException(str(error)) from None
