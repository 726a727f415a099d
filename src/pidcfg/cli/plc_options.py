"""Options of the commands that speak to a PLC."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

from pidcfg.cli.arguments import usage
from pidcfg.cli.extras import need
from pidcfg.cli.options import NUMBER, Integer
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from pidcfg.limits import Limits

PLC = click.option(
    "--plc",
    required=True,
    metavar="URL",
    envvar="PIDCFG_PLC",
    help="Where the PLC is: modbus://HOST[:502][?unit=1] or modbus+rtu:///DEVICE?baud=9600&parity=odd.",
)
LIKE = click.option("--like", metavar="FILE", help="A configuration that gives names, ranges, units and places.")
VENDOR = click.option("--vendor", type=click.Choice(list(VENDORS)), help="The PLC family, where no file says it.")
TIMEOUT = click.option(
    "--timeout", type=NUMBER, default=2.0, show_default=True, metavar="SECONDS", help="How long an answer may take."
)
RETRIES = click.option(
    "--retries",
    type=Integer(),
    default=2,
    show_default=True,
    metavar="COUNT",
    help="How often a request without an answer is sent again.",
)


FOR = {"seconds": "--for"}
"""An option that the calls have by another name."""


def map_file(name: str | None, limits: Limits) -> Path | None:
    """The file of a map; one that cannot be read ends the command."""
    if name is None:
        return None
    from pathlib import Path

    from pidcfg.cli.files.inputs import read_input

    entry = read_input(name, limits)
    if entry.problem is not None:
        raise click.ClickException(entry.problem)
    return Path(name)


def needed(url: str) -> None:
    """Ends the command where a package is missing that reaches this PLC."""
    need("pymodbus", "live")
    if url.startswith("modbus+rtu"):
        need("serial", "live")


@contextmanager
def reached() -> Iterator[None]:
    """Ends the command with one line where the PLC cannot be reached or an option makes no sense."""
    from pidcfg.encoders.map_rows import UnusableMapError
    from pidcfg.live.errors import PlcError

    try:
        with usage(FOR):
            yield
    except (PlcError, UnusableMapError) as error:
        raise click.ClickException(str(error)) from None
