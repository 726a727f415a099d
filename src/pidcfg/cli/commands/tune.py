"""``pidcfg tune``: gains by the manuals' own rules, in the terms of a PLC."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from pidcfg.cli import options, plots
from pidcfg.cli.console import echo_json, show_text, write_remark
from pidcfg.cli.inputs import STDIN
from pidcfg.cli.main import Exit
from pidcfg.cli.options import usage_errors
from pidcfg.text.writer import json_text
from pidcfg.tuning.rules import METHODS, TuningError
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable

    from pidcfg.output.retune import RetunedFile
    from pidcfg.text.reader import Limits
    from pidcfg.tuning import Form

EPILOG = options.examples_text(
    "pidcfg tune --method zn-open --gain 2 --time-constant 10 --dead-time 1 --for click",
    "pidcfg tune --method simc --transfer '2 exp(-3s)/((10s+1)(2s+1))'",
    "pidcfg tune --method simc --model integrating --gain 0.02 --dead-time 5 --for click",
    "pidcfg tune --method robust --gain 2 --time-constant 60 --dead-time 8 --vary gain=±30%,dead-time=80%..130% "
    "--ms 1.6 --for dl06",
    "pidcfg tune --method zn-open --from-csv step.csv --columns time=Date+Time,output=Valve,pv=3 --from 60",
    "pidcfg tune --method zn-closed --ultimate-gain 8 --ultimate-period 4 --for dl06 --pv-range 0 200",
    "pidcfg tune --method simc --from-csv step.csv --write reactor.yaml --loop TIC-101 --plot margins.svg",
)


def number_option(
    name: str, text: str, *, signed: bool = False
) -> Callable[[Callable[..., object]], Callable[..., object]]:
    """An option that is a finite number; above 0 unless it may be negative."""

    def check(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
        if value is None:
            return None
        from pidcfg.output.process import number_fault
        from pidcfg.tuning.rules import is_usable

        if is_usable(value) and (value > 0 or signed):
            return value
        raise click.BadParameter(number_fault(value, signed=signed), ctx, param)

    return click.option(f"--{name}", type=options.NUMBER_TYPE, metavar="N", help=text, callback=check)


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
@number_option("gain", "Process: PV units per unit of the output; negative for cooling.", signed=True)
@number_option("time-constant", "Process: time constant in s.")
@number_option("dead-time", "Process: dead time in s.")
@number_option("second-time-constant", "Process: its second time constant in s.")
@click.option(
    "--transfer", metavar="'NUM/DEN'", help="Process as a transfer function, such as '2 exp(-3s)/((10s+1)(2s+1))'."
)
@number_option("closed-loop", "synthesis, simc, lambda: the time constant wanted in closed loop, in s.")
@number_option("sample-time", "Sample time in s; half of it acts like dead time.")
@number_option("ultimate-gain", "Gain at which a P controller just keeps swinging.")
@number_option("ultimate-period", "Period of that swing in s.")
@click.option("--vary", metavar="LIST", help="robust: what is uncertain, as gain=±30%,dead-time=80%..130%.")
@number_option("ms", "robust: limit of the maximum sensitivity on every plant, 1.1 to 3; 1.6 when not given.")
@click.option(
    "--samples",
    type=options.LimitedInteger(0),
    default=60,
    show_default=True,
    help="robust: plants that certify tries on the virtual PLC; 0 for none.",
)
@click.option("--from-csv", metavar="FILE", help="Identify the process from a recorded step.")
@click.option(
    "--columns", metavar="LIST", help="Its columns by name or number: time=…,output=…,pv=…; time=1+2 for date and time."
)
@click.option(
    "--rest",
    type=options.NUMBER_TYPE,
    metavar="VALUE",
    help="The output before the record, if it stepped at its start.",
)
@click.option("--from", "start", metavar="TIME", help="The record counts from here: s, 2 min, or a stamp of its own.")
@click.option("--until", metavar="TIME", help="The record counts until here.")
@click.option("--for", "vendor", type=click.Choice(list(VENDORS)), help="Show the numbers as this PLC holds them.")
@click.option(
    "--pv-range",
    type=options.NUMBER_TYPE,
    nargs=2,
    metavar="LOW HIGH",
    help="Engineering values of the PV at 0 and 100 %.",
)
@click.option(
    "--output-range",
    type=options.NUMBER_TYPE,
    nargs=2,
    metavar="LOW HIGH",
    help="The output at 0 and 100 %; 0 and 100 when not given.",
)
@click.option("--write", "into", metavar="FILE", help="Put the gains into a loop of this configuration.")
@click.option("--loop", metavar="NAME", help="With --write: which loop; the only one when not given.")
@click.option("--diff", is_flag=True, help="Show what --write would change; write nothing, exit 1 if anything.")
@plots.MARGINS_OPTION
@options.FORCE_OPTION
@options.output_format("text", "json")
@options.LIMITS_OPTION
def command(
    method: str,
    form: Form | None,
    from_csv: str | None,
    into: str | None,
    diff: bool,
    plot: tuple[str, ...],
    force: bool,
    fmt: str,
    limits: Limits,
    **process_options: Any,
) -> None:
    """Work out gains from a process (or a recorded step of it), or from its ultimate cycle.

    Gains are output units per PV unit, times are seconds.
    """
    from pidcfg.api import tune
    from pidcfg.cli.formats.tuning import margin_chart, tuning_text
    from pidcfg.cli.inputs import readable_input
    from pidcfg.cli.outputs import write_files

    ctx = click.get_current_context()
    refuse_options(ctx)
    record = None if from_csv is None else readable_input(from_csv, limits).data
    configuration = None if into is None else readable_input(into, limits).data
    try:
        with usage_errors({"record": "--from-csv", "vendor": "--for", "start": "--from", "into": "--write"}):
            result = tune(
                method,
                form,
                record=record,
                name=from_csv,
                into=configuration,
                into_name=into,
                limits=limits,
                **process_options,
            )
    except TuningError as error:
        if error.is_question:
            raise click.UsageError(str(error), ctx) from None
        raise click.ClickException(str(error)) from None
    numbers = {name: result.numbers[name] for name in process_options if name in result.numbers}  # of the command line
    result = replace(result, numbers=numbers)
    for value in () if result.vendor is None else result.vendor.values:
        if value.problem is not None:
            write_remark(f"{value.key}: {value.problem}")
    charts = [margin_chart(result)] if plot else []
    pictures = plots.draw_files(plot, charts, f"{result.method.name}, {result.form}")
    is_changed = result.written is not None and save_file(result.written, diff=diff)
    if diff:
        ctx.exit(Exit.FINDINGS if is_changed else Exit.OK)
    write_files(pictures, force=force)
    if fmt == "json":
        echo_json(json_text(result.to_json()))
    else:
        show_text(tuning_text(result))
        plots.show_charts(charts if plots.TERMINAL_NAME in plot else [])
    ctx.exit(Exit.OK if result.ok else Exit.FINDINGS)


def refuse_options(ctx: click.Context) -> None:
    """Ends the command where an option would go unheard: a patch stands alone, and a file has to be replaced."""
    if ctx.params["into"] == STDIN:
        raise click.UsageError("--write needs a file that it can replace, not standard input", ctx)
    if ctx.params["diff"] and ctx.params["into"] is None:
        raise click.UsageError("--diff needs --write FILE: it shows what would change there", ctx)
    if ctx.params["diff"] and ctx.params["plot"]:
        raise click.UsageError("--diff prints a patch and nothing else, so it takes no --plot", ctx)
    if plots.TERMINAL_NAME in ctx.params["plot"] and ctx.params["fmt"] != "text":
        raise click.UsageError("--plot - and --format json would both go to standard output; name a file", ctx)
    if ctx.params["diff"] and ctx.get_parameter_source("fmt") is ParameterSource.COMMANDLINE:
        raise click.UsageError("--diff prints a patch and nothing else, so it takes no --format", ctx)


def save_file(retuned: RetunedFile, *, diff: bool) -> bool:
    """Writes the file that a loop's new gains make, or shows the change; whether there is one.

    Nothing is written where a rule finds an error at the loop.
    """
    from pidcfg.cli.outputs import patch_text, print_patch, replace_files

    is_changed = retuned.data != retuned.before
    if diff:
        print_patch(patch_text(retuned.file, retuned.before, retuned.data))
    elif is_changed and retuned.ok:
        replace_files({retuned.file: (retuned.before, retuned.data)})
    return is_changed
