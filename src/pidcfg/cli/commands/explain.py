"""``pidcfg explain``: what a register, a bit, a number or a code means."""

from __future__ import annotations

from typing import TYPE_CHECKING, NoReturn

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo_json, show_markdown, show_text, write_note, write_remark
from pidcfg.cli.main import Exit
from pidcfg.cli.options import usage_errors
from pidcfg.text.writer import json_text
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.output.explanation import ExplainResult
    from pidcfg.text.document import Document
    from pidcfg.text.reader import Limits

EPILOG = options.examples_text(
    "pidcfg explain V7642=0008",
    "pidcfg explain V2006=0x0402 --loop",
    "pidcfg explain CK27 AT5 ErrBits=0x0005",
    "pidcfg explain addr+06.10 --format json",
    "pidcfg explain V2013 TIC-101.gain --in reactor.yaml",
    "pidcfg explain TIC-101 --in reactor.yaml",
    "pidcfg explain output stays 0 --vendor click",
    "pidcfg explain",
)


@click.command("explain", epilog=EPILOG)
@click.argument("things", metavar="[THING]...", nargs=-1)
@click.option("--vendor", type=click.Choice(list(VENDORS)), help="Only what this PLC family means by it.")
@click.option(
    "--loop",
    is_flag=True,
    help="Addresses are of loops that begin where the manual's or the starter "
    "file's example does: V2000; C101, DS101, DF101; R101, S101.",
)
@click.option(
    "--block",
    "--loop-table",
    "--registers",
    "--discretes",
    "--bits",
    "--integers",
    "--floats",
    "blocks",
    multiple=True,
    metavar="ADDRESS",
    help="Where a block of loop registers begins, e.g. V2000, DF101 or "
    "R101; its first letters say of which kind it is.",
)
@click.option(
    "--in",
    "--config",
    "config",
    metavar="FILE",
    help="A configuration: which loop and line set the register, and to what.",
)
@options.output_format("text", "json")
@options.LIMITS_OPTION
def command(
    things: tuple[str, ...],
    vendor: str | None,
    loop: bool,
    blocks: tuple[str, ...],
    config: str | None,
    fmt: str,
    limits: Limits,
) -> None:
    """Explain each THING in plain words, with the manual's place.

    A THING is a word (V7642), its content (V7642=0008), a bit (addr+06.10), an error number (CK27), a register's name
    (gain), a rule (DL242), a decision (D46) or a Modbus reference (41025); with --in also a loop, tag or signal that
    the configuration names. What you see works too ("oscillates", "will not go to auto"), as does a message of pidcfg.

    Without a THING, lists what can be asked for.
    """
    from pidcfg.api import explain
    from pidcfg.output.explanation import QuestionError, as_text, examples_text

    configuration = None if config is None else _read_configuration(config, limits)
    try:
        with usage_errors({"config": str(config)}):
            result = explain(*things, vendor=vendor, loop=loop, blocks=blocks, config=configuration, limits=limits)
    except QuestionError as error:
        write_remark(f"Error: {error}")
        write_note("'pidcfg explain' without arguments shows what can be asked for.")
        click.get_current_context().exit(Exit.UNUSABLE)
    if not result.ok:
        _refuse_configuration(result, str(config))
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    elif not result.pages:
        show_text(examples_text(result.examples))
    elif all(page.markdown for page in result.pages):
        show_markdown(as_text(result.pages))
    else:
        show_text(as_text(result.pages))


def _read_configuration(name: str, limits: Limits) -> Document:
    """The configuration of ``--in``; one with errors is taken as far as it can be encoded."""
    from pidcfg.cli.findings import load_configuration

    return load_configuration(name, limits)


def _refuse_configuration(result: ExplainResult, name: str) -> NoReturn:
    """Ends the command with what keeps the configuration from being read."""
    from pidcfg.cli.findings import show_errors

    show_errors(result.findings, result.document, "text")
    raise click.ClickException(f"{name} could not be read")
