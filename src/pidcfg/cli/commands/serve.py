"""``pidcfg serve``: the virtual PLC of a scenario behind its vendor's register map, in real time."""

from __future__ import annotations

from ipaddress import ip_address
from typing import TYPE_CHECKING, Any

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
    "pidcfg serve reactor.scenario.yaml tank.scenario.yaml --unit 1,7",
    "pidcfg serve tank.scenario.yaml --listen 'modbus+rtu:///dev/ttyUSB0?baud=38400&parity=odd'",
)
LISTEN = "127.0.0.1:5020"


class Units(click.ParamType[tuple[int, ...]]):
    """Whole numbers from 1 on with commas between."""

    name = "units"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> tuple[int, ...]:
        """The numbers."""
        if isinstance(value, tuple):
            return value
        return tuple(options.Whole(1).convert(part.strip(), param, ctx) for part in str(value).split(","))


@click.command("serve", epilog=EPILOG)
@click.argument("scenario", nargs=-1, required=True)
@options.MAP
@click.option(
    "--listen", default=LISTEN, show_default=True, metavar="HOST:PORT", help="Where to listen, or modbus+rtu:///DEVICE."
)
@click.option(
    "--unit",
    type=Units(),
    metavar="N,N…",
    help="The Modbus unit of each scenario, which it alone answers as; 1, 2, 3 … unless --listen says another one.",
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
    scenario: tuple[str, ...],
    stated: str | None,
    listen: str,
    unit: tuple[int, ...] | None,
    speed: float,
    seconds: float | None,
    fmt: str,
    quiet: bool,
    limits: Limits,
) -> None:
    """Serve the virtual PLC of SCENARIO over Modbus until Ctrl-C, which prints the report of the run.

    An HMI, a SCADA driver or a script reads it, writes set points, modes and outputs as an operator does, and sees the
    loops answer. The events of the scenario happen; its duration and its expectations do not count. Several scenarios
    are as many PLCs at one address, each with its unit, as behind a gateway.
    """
    options.require_packages(listen)
    from pidcfg.cli.findings import show_errors
    from pidcfg.cli.formats.runs import simulations_text
    from pidcfg.cli.inputs import read_inputs
    from pidcfg.live.calls import serve
    from pidcfg.text.writer import json_text

    documents = [list(read_inputs((name,), limits)) for name in scenario]
    for name, found in zip(scenario, documents, strict=True):
        if len(found) != 1:
            raise click.ClickException(f"{name} stands for {len(found)} files; name one scenario")
        if found[0].data is not None and "vendor" in found[0].data:
            message = f"{name} is a configuration, and serve runs scenarios; 'pidcfg init --scenario {name}' writes one"
            raise click.UsageError(message)
    units = _units(unit, scenario, stated)
    LINE.silence()

    def ready(place: str) -> None:
        if not quiet:
            note(
                f"serving {_what(scenario, units)} at {place}, {_who(place)}, {speed:g} times real time; "
                "Ctrl-C ends with the report"
            )

    with options.reach_plc(), options.usage({"others": "--unit", "seconds": "--for"}):
        result = serve(
            documents[0][0],
            listen=listen,
            unit=units[0],
            others={number: found[0] for number, found in zip(units[1:], documents[1:], strict=True) if number},
            map=options.map_file(stated, limits),
            speed=speed,
            seconds=seconds,
            ready=ready,
            tell=note,
            limits=limits,
        )
    if not result.ok:
        show_errors(result.findings, documents[0][0], fmt)
        click.get_current_context().exit(Exit.UNUSABLE)
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    else:
        show(simulations_text([*result.outcomes], tables=True))


def _units(given: tuple[int, ...] | None, scenarios: tuple[str, ...], stated: str | None) -> tuple[int | None, ...]:
    """The unit of each scenario; None: what --listen says, or 1."""
    if len(scenarios) == 1 and given is None:
        return (None,)
    if len(scenarios) > 1 and stated is not None:
        raise click.UsageError("--map is of one PLC; name the map of each in its configuration")
    units = given or tuple(range(1, len(scenarios) + 1))
    if len(units) != len(scenarios):
        raise click.UsageError(f"--unit names {len(units)} units for {len(scenarios)} scenarios; name one for each")
    if len(set(units)) < len(units):
        raise click.UsageError("--unit names a unit twice; each PLC has one of its own")
    return units


def _what(scenarios: tuple[str, ...], units: tuple[int | None, ...]) -> str:
    """What is served, with the units where there are several."""
    if len(scenarios) == 1:
        return scenarios[0]
    return ", ".join(f"{name} as unit {unit}" for name, unit in zip(scenarios, units, strict=True))


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
