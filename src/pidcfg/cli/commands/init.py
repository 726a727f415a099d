"""``pidcfg init``: a commented starter file."""

from __future__ import annotations

from importlib.resources import files

import click

from pidcfg.cli import options
from pidcfg.cli.terminal.console import echo, note
from pidcfg.vendors import VENDORS

EPILOG = options.examples(
    "pidcfg init --vendor dl06",
    "pidcfg init --vendor dl06 -o oven.yaml",
    "pidcfg init --vendor dl06 | pidcfg validate -",
)


@click.command("init", epilog=EPILOG)
@click.option("--vendor", type=click.Choice(list(VENDORS)), required=True, help="The PLC family to write for.")
@options.OUT
@options.FORCE
def command(vendor: str, out: str | None, force: bool) -> None:
    """Write a starter file that passes validate, with the usual keys explained."""
    from pidcfg.cli.files.outputs import write_files

    text = files("pidcfg").joinpath(VENDORS[vendor].starter).read_text(encoding="utf-8")
    if out is None:
        echo(text)
        return
    write_files({out: text}, force=force)
    note(f"{out}: edit it, then run 'pidcfg validate {out}'")
