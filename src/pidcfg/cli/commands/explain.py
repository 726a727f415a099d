"""``pidcfg explain``: what a register, a bit, a number or a code means."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import echo_json, markdown, note, show
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from pidcfg.explanation.configuration import Configured
    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg explain V7642=0008",
    "pidcfg explain V2006=0x0402 --loop",
    "pidcfg explain CK27 AT5 ErrBits=0x0005",
    "pidcfg explain addr+06.10 --format json",
    "pidcfg explain V2013 TIC-101.gain --in reactor.yaml",
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
    "--in", "config", metavar="FILE", help="A configuration: which loop and line set the register, and to what."
)
@options.output_format("text", "json")
@options.LIMITS
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
    (gain), a rule (PID242) or a decision (D46).

    Without a THING, lists what can be asked for.
    """
    from pidcfg.explanation.decisions import all_decisions
    from pidcfg.explanation.lookup import check_starts, explain, forms
    from pidcfg.explanation.question import Question, QuestionError
    from pidcfg.explanation.render import as_json, as_text, forms_text

    configured = None if config is None else _configured(config, limits)
    own = configured.checked.vendor if configured is not None else None
    vendors = [vendor] if vendor else list(VENDORS) if own is None else [own.key]
    if own is not None and vendor not in {None, own.key}:
        raise click.UsageError(f"{config} is of vendor {own.key}, not {vendor}")
    if not things:
        rows = forms(vendors)
        show(forms_text(rows)) if fmt == "text" else echo_json(as_json([], rows))
        return
    try:
        check_starts(blocks, vendors)
        pages = []
        for thing in things:
            question = Question.of(thing, loop=loop, starts=blocks, config=configured)
            pages += explain(question, vendors, all_decisions)
    except QuestionError as error:
        note(f"Error: {error}")
        note("'pidcfg explain' without arguments shows what can be asked for.")
        click.get_current_context().exit(Exit.UNUSABLE)
    if fmt == "json":
        echo_json(as_json(pages))
    elif all(page.markdown for page in pages):
        markdown(as_text(pages))
    else:
        show(as_text(pages))


def _configured(name: str, limits: Limits) -> Configured:
    """The configuration of ``--in``; one with errors is taken as far as it can be encoded."""
    from pidcfg.cli.findings.collect import one_configuration, show_errors
    from pidcfg.explanation.configuration import Configured

    checked = one_configuration(name, limits)
    if checked.encoding is None or checked.vendor is None:
        show_errors(checked, "text")
        raise click.ClickException(f"{name} could not be read")
    return Configured(checked)
