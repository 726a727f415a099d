"""``pidcfg serve``: the virtual PLC of a scenario behind its vendor's register map, in real time."""

from __future__ import annotations

from ipaddress import ip_address
from typing import TYPE_CHECKING

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo_json, note, show
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal import LINE

if TYPE_CHECKING:
    from pidcfg.text.reader import Limits

EPILOG = options.examples(
    "pidcfg serve reactor.scenario.yaml",
    "pidcfg serve reactor.scenario.yaml --speed 10 --listen 127.0.0.1:1502",
    "pidcfg serve oven.scenario.yaml --map oven-map.csv --unit 3",
    "pidcfg serve tank.scenario.yaml --listen 'modbus+rtu:///dev/ttyUSB0?baud=38400&parity=odd'",
)
LISTEN = "127.0.0.1:5020"


@click.command("serve", epilog=EPILOG)
@click.argument("scenario")
@options.MAP
@click.option(
    "--listen", default=LISTEN, show_default=True, metavar="HOST:PORT", help="Where to listen, or modbus+rtu:///DEVICE."
)
@click.option(
    "--unit",
    type=options.Whole(1),
    metavar="N",
    help="The Modbus unit that it answers as, and no other; 1 unless --listen says another one.",
)
@click.option(
    "--speed",
    type=options.NUMBER,
    default=1.0,
    show_default=True,
    metavar="FACTOR",
    help="How many times as fast as the clock.",
)
@click.option(
    "--for", "seconds", type=options.NUMBER, metavar="SECONDS", help="End by itself after so many seconds of the clock."
)
@options.output_format("text", "json")
@options.QUIET
@options.LIMITS
def command(
    scenario: str,
    stated: str | None,
    listen: str,
    unit: int | None,
    speed: float,
    seconds: float | None,
    fmt: str,
    quiet: bool,
    limits: Limits,
) -> None:
    """Serve the virtual PLC of SCENARIO over Modbus until Ctrl-C, which prints the report of the run.

    An HMI, a SCADA driver or a script reads it, writes set points, modes and outputs as an operator does, and sees the
    loops answer. The events of the scenario happen; its duration and its expectations do not count.
    """
    options.require_packages(listen)
    from pidcfg.cli.findings import show_errors
    from pidcfg.cli.formats.runs import simulations_text
    from pidcfg.cli.inputs import read_inputs
    from pidcfg.live.calls import serve
    from pidcfg.text.writer import json_text

    documents = list(read_inputs((scenario,), limits))
    if len(documents) != 1:
        raise click.ClickException(f"{scenario} stands for {len(documents)} files; name one scenario")
    LINE.silence()

    def ready(place: str) -> None:
        if not quiet:
            note(
                f"serving {scenario} at {place}, {_who(place)}, {speed:g} times real time; Ctrl-C ends with the report"
            )

    with options.reach_plc():
        result = serve(
            documents[0],
            listen=listen,
            unit=unit,
            map=options.map_file(stated, limits),
            speed=speed,
            seconds=seconds,
            ready=ready,
            tell=note,
            limits=limits,
        )
    if not result.ok:
        show_errors(result.findings, documents[0], fmt)
        click.get_current_context().exit(Exit.UNUSABLE)
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    else:
        show(simulations_text([result.outcome], tables=True))


def _who(place: str) -> str:
    """Who can come: a server that reaches further than this machine says so."""
    host = place.rpartition(":")[0].strip("[]")
    try:
        is_local = ip_address(host).is_loopback
    except ValueError:
        is_local = host == "localhost"
    if place.startswith("/") or not host:
        return "for whoever is on the line"
    return "for this machine only" if is_local else "FOR EVERYBODY WHO REACHES THIS ADDRESS: Modbus knows no password"
