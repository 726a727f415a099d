"""``pidcfg tune``: gains by the manuals' own rules, in the terms of a PLC."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Unpack

import click

from pidcfg.cli import options
from pidcfg.cli.arguments import NUMBER, usage
from pidcfg.cli.terminal.console import echo_json, note, show
from pidcfg.tuning.methods import METHODS
from pidcfg.tuning.rules import TuningError
from pidcfg.vendors import VENDORS
from pidcfg.writer import json_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.limits import Limits
    from pidcfg.results.processes import Numbers
    from pidcfg.tuning.rules import Form, Model

EPILOG = options.examples(
    "pidcfg tune --method zn-open --gain 2 --time-constant 10 --dead-time 1 --for click",
    "pidcfg tune --method simc --transfer '2 exp(-3s)/((10s+1)(2s+1))'",
    "pidcfg tune --method simc --model integrating --gain 0.02 --dead-time 5 --for click",
    "pidcfg tune --method zn-open --from-csv step.csv --columns time=Date+Time,output=Valve,pv=3 --from 60",
    "pidcfg tune --method zn-closed --ultimate-gain 8 --ultimate-period 4 --for dl06 --pv-range 0 200",
)


def number(name: str, text: str, *, signed: bool = False) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """An option that is a finite number; above 0 unless it may be negative."""

    def check(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
        if value is None or (abs(value) <= 1e12 and (value > 0 or (signed and value))):
            return value
        raise click.BadParameter(f"{value:g}; write a number {'other than' if signed else 'above'} 0", ctx, param)

    return click.option(f"--{name}", type=NUMBER, metavar="N", help=text, callback=check)


@click.command("tune", epilog=EPILOG)
@click.option("--method", type=click.Choice(list(METHODS)), required=True, help="The rule.")
@click.option(
    "--form", type=click.Choice(["P", "PI", "PID"]), help="The controller; without it the most that the rule has."
)
@click.option(
    "--model",
    type=click.Choice(["first-order", "second-order", "integrating"]),
    help="The process; integrating: --gain is the slope of the PV, per s.",
)
@number("gain", "Process: PV units per unit of the output; negative for cooling.", signed=True)
@number("time-constant", "Process: time constant in s.")
@number("dead-time", "Process: dead time in s.")
@number("second-time-constant", "Process: its second time constant in s.")
@click.option(
    "--transfer", metavar="'NUM/DEN'", help="Process as a transfer function, such as '2 exp(-3s)/((10s+1)(2s+1))'."
)
@number("closed-loop", "synthesis, simc, lambda: the time constant wanted in closed loop, in s.")
@number("sample-time", "Sample time in s; half of it acts like dead time.")
@number("ultimate-gain", "Gain at which a P controller just keeps swinging.")
@number("ultimate-period", "Period of that swing in s.")
@click.option("--from-csv", metavar="FILE", help="Identify the process from a recorded step.")
@click.option(
    "--columns", metavar="LIST", help="Its columns by name or number: time=…,output=…,pv=…; time=1+2 for date and time."
)
@click.option("--rest", type=NUMBER, metavar="VALUE", help="The output before the record, if it stepped at its start.")
@click.option("--from", "start", metavar="TIME", help="The record counts from here: s, 2 min, or a stamp of its own.")
@click.option("--until", metavar="TIME", help="The record counts until here.")
@click.option("--for", "vendor", type=click.Choice(list(VENDORS)), help="Show the numbers as this PLC holds them.")
@click.option(
    "--pv-range", type=NUMBER, nargs=2, metavar="LOW HIGH", help="Engineering values of the PV at 0 and 100 %."
)
@click.option(
    "--output-range",
    type=NUMBER,
    nargs=2,
    metavar="LOW HIGH",
    default=(0, 100),
    show_default=True,
    help="The output at 0 and 100 %.",
)
@options.output_format("text", "json")
@options.LIMITS
def command(
    method: str,
    form: Form | None,
    model: Model | None,
    transfer: str | None,
    from_csv: str | None,
    columns: str | None,
    rest: float | None,
    start: str | None,
    until: str | None,
    vendor: str | None,
    fmt: str,
    limits: Limits,
    pv_range: tuple[float, float] | None,
    output_range: tuple[float, float],
    **numbers: Unpack[Numbers],
) -> None:
    """Work out gains from a process (or a recorded step of it), or from its ultimate cycle.

    Gains are output units per PV unit, times are seconds.
    """
    from pidcfg.api import tune
    from pidcfg.cli.formats.tuning import as_text

    record = None if from_csv is None else _record(from_csv, limits)
    try:
        with usage({"record": "--from-csv", "vendor": "--for", "start": "--from"}):
            result = tune(
                method,
                form,
                model=model,
                transfer=transfer,
                record=record,
                columns=columns,
                rest=rest,
                start=start,
                until=until,
                vendor=vendor,
                pv_range=pv_range,
                output_range=output_range,
                name=from_csv,
                limits=limits,
                **numbers,
            )
    except TuningError as error:
        raise click.ClickException(str(error)) from None
    in_order = {name: result.numbers[name] for name in numbers if name in result.numbers}  # of the command line
    result = replace(result, numbers=in_order)
    for value in () if result.vendor is None else result.vendor.values:
        if value.problem is not None:
            note(f"{value.key}: {value.problem}")
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    else:
        show(as_text(result))


def _record(name: str, limits: Limits) -> bytes:
    """The bytes of a recorded step."""
    from pidcfg.cli.files.inputs import read_input

    entry = read_input(name, limits)
    if entry.problem is not None:
        raise click.ClickException(entry.problem)
    return entry.data
