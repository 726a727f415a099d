"""``pidcfg pull``: what a PLC holds, as a configuration or a memory listing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.commands.decode import tell_notes, vendor_options
from pidcfg.cli.console import echo
from pidcfg.cli.main import Exit
from pidcfg.vendors import format_names

if TYPE_CHECKING:
    from pidcfg.text.reader import Limits

EPILOG = options.examples(
    "pidcfg pull --plc modbus://10.0.0.5 --like reactor.yaml -o running.yaml",
    "pidcfg pull --plc modbus://10.0.0.5 --vendor dl06 --format csv",
    "pidcfg pull --plc modbus://10.0.0.6 --vendor click --bits C101 --integers DS101 --floats DF101 --pwm-bit none",
    "pidcfg pull --plc 'modbus+rtu:///dev/ttyUSB0?baud=9600&parity=odd' --vendor dl06",
)


@click.command("pull", epilog=EPILOG)
@options.PLC
@options.MAP
@options.LIKE
@options.VENDOR
@options.output_format("yaml", *format_names())
@vendor_options
@options.OUT
@options.FORCE
@options.TIMEOUT
@options.RETRIES
@options.QUIET
@options.LIMITS
def command(
    plc: str,
    stated: str | None,
    like: str | None,
    vendor: str | None,
    fmt: str,
    out: str | None,
    force: bool,
    timeout: float,
    retries: int,
    quiet: bool,
    limits: Limits,
    **texts: str | None,
) -> None:
    """Read the loops of a PLC. Nothing is written to it: there is no command that does.

    A DL06 tells its own loop table by V7640 and V7641; of other PLCs --like FILE or options say where the loops are.
    """
    options.require_packages(plc)
    from pidcfg.cli.findings import one_configuration, show_errors
    from pidcfg.cli.outputs import write_files
    from pidcfg.live.calls import pull

    other = None if like is None else one_configuration(like, limits)
    with options.reach_plc():
        result = pull(
            plc,
            like=other,
            vendor=vendor,
            format=fmt,
            options=texts,
            map=options.map_file(stated, limits),
            timeout=timeout,
            retries=retries,
            limits=limits,
        )
    if not result.ok:
        show_errors(result.findings, other, fmt)
        click.get_current_context().exit(Exit.UNUSABLE)
    if out is None:
        echo(result.text)
    else:
        write_files({out: result.text}, force=force)
    tell_notes(result.notes, quiet=quiet)
