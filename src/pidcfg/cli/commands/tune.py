"""``pidcfg tune``: gains by the manuals' own rules, in the terms of a PLC."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import click

from pidcfg.cli import options
from pidcfg.cli.terminal.console import echo_json, note, show
from pidcfg.tuning.rules import METHODS, Cycle, Process
from pidcfg.vendors import VENDORS

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from pidcfg.limits import Limits
    from pidcfg.tuning.identify import Found, Record
    from pidcfg.tuning.rules import Form

EPILOG = options.examples(
    "pidcfg tune --method zn-open --gain 2 --time-constant 10 --dead-time 1 --for click",
    "pidcfg tune --method iae-setpoint --form PI --gain 2 --time-constant 10 --dead-time 1 --sample-time 0.1",
    "pidcfg tune --method zn-closed --ultimate-gain 8 --ultimate-period 4 --for dl06 --pv-range 0 200",
)
SAMPLE_SHARE = 10
"""A sample time should be below this part of the time constant."""


def number(name: str, text: str, *, signed: bool = False) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """An option that is a finite number; above 0 unless it may be negative."""

    def check(ctx: click.Context, param: click.Parameter, value: float | None) -> float | None:
        if value is None or (abs(value) <= 1e12 and (value > 0 or (signed and value))):
            return value
        raise click.BadParameter(f"{value:g}; write a number {'other than' if signed else 'above'} 0", ctx, param)

    return click.option(f"--{name}", type=float, metavar="N", help=text, callback=check)


@click.command("tune", epilog=EPILOG)
@click.option("--method", type=click.Choice(list(METHODS)), required=True, help="The rule.")
@click.option("--form", type=click.Choice(["P", "PI", "PID"]), default="PID", show_default=True, help="The controller.")
@number("gain", "Process: PV units per unit of the output; negative for cooling.", signed=True)
@number("time-constant", "Process: time constant in s.")
@number("dead-time", "Process: dead time in s.")
@number("closed-loop", "synthesis: the time constant wanted in closed loop, in s.")
@number("sample-time", "Sample time in s; half of it acts like dead time.")
@number("ultimate-gain", "Gain at which a P controller just keeps swinging.")
@number("ultimate-period", "Period of that swing in s.")
@click.option("--from-csv", metavar="FILE", help="Identify the process from a recorded step: time, output, PV.")
@click.option("--for", "vendor", type=click.Choice(list(VENDORS)), help="Show the numbers as this PLC holds them.")
@click.option(
    "--pv-range", type=float, nargs=2, metavar="LOW HIGH", help="Engineering values of the PV at 0 and 100 %."
)
@click.option(
    "--output-range",
    type=float,
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
    form: Form,
    from_csv: str | None,
    vendor: str | None,
    fmt: str,
    limits: Limits,
    pv_range: tuple[float, float] | None,
    output_range: tuple[float, float],
    **numbers: float | None,
) -> None:
    """Work out gains from a process (or a recorded step of it), or from its ultimate cycle.

    Gains are output units per PV unit, times are seconds.
    """
    from pidcfg.cli.formats.tuning import as_text

    found, record = (None, None) if from_csv is None else identified(from_csv, numbers, limits)
    if vendor is not None and VENDORS[vendor].load("tuned").gain_unit == "span" and pv_range is None:
        raise click.UsageError(f"{VENDORS[vendor].title} has gains in shares of the span: add --pv-range LOW HIGH")
    for name, span in (("--pv-range", pv_range), ("--output-range", output_range)):
        if span is not None and not 0 < span[1] - span[0] < float("inf"):
            raise click.UsageError(f"{name} does not ascend")
    result = tuned(method, form, numbers)
    result |= {"identified": None if found is None else found_data(found)}
    if vendor is not None:
        result["for"] = for_vendor(vendor, result, pv_range, output_range)
    if fmt == "json":
        echo_json(json.dumps(result, indent=2, ensure_ascii=False) + "\n")
        return
    show(as_text(result, found, record))


def identified(name: str, numbers: dict[str, float | None], limits: Limits) -> tuple[Found, Record]:
    """The process of a recorded step; its numbers take the place of options that are not given."""
    from pidcfg.tuning.identify import RecordError, identify
    from pidcfg.tuning.record import read_record

    record, lines = read_record(name, limits)
    try:
        found = identify(record)
    except RecordError as error:
        where = name if error.row is None else f"{name}:{lines[error.row]}"
        raise click.ClickException(f"{where}: {error}; {error.cure}") from None
    for key in ("gain", "time_constant", "dead_time"):
        if numbers[key] is not None:
            raise click.UsageError(f"--{key.replace('_', '-')} and --from-csv do not go together")
        numbers[key] = getattr(found.process, key)
    return found, record


def tuned(name: str, form: Form, numbers: dict[str, float | None]) -> dict[str, Any]:
    """The result of a rule, as JSON prints it."""
    method = METHODS[name]
    if form not in method.forms:
        raise click.UsageError(f"{name} has no rule for {form}; it has {' and '.join(method.forms)}")
    wanted = ["ultimate_gain", "ultimate_period"] if method.of_ultimate else [n for n in method.needs if n != "delay"]
    if "delay" in method.needs:
        wanted.append("dead_time")
    for key in wanted:
        if numbers[key] is None:
            raise click.UsageError(f"{name} needs --{key.replace('_', '-')}")
    process = Process(**{field.name: abs(numbers[field.name] or 0.0) for field in fields(Process)})
    cycle = Cycle(numbers["ultimate_gain"] or 0.0, numbers["ultimate_period"] or 0.0)
    try:
        gains = method.gains(form, process, cycle)
    except (ValueError, OverflowError) as error:
        raise click.ClickException(f"{name}: {error}") from None
    integral = gains.integral_time < float("inf")
    return {
        "version": 1,
        "method": name,
        "title": method.title,
        "form": form,
        "basis": str(method.basis),
        "process": {key: value for key, value in numbers.items() if value is not None},
        "gain": gains.gain,
        "integral_time": gains.integral_time if integral else None,
        "derivative_time": gains.derivative_time,
        "independent": {"kp": gains.gain, "ki": gains.ki if integral else 0.0, "kd": gains.kd},
        "heating": None if numbers["gain"] is None else numbers["gain"] > 0,
        "warnings": list(warnings(process)) if method.of_process else [],
    }


def warnings(process: Process) -> Iterator[str]:
    """What the rules' authors warn of."""
    if process.dead_time and process.time_constant / process.dead_time < 1:
        yield "the dead time is longer than the time constant: hard to control, whatever the gains"
    if process.sample_time and process.sample_time * SAMPLE_SHARE >= process.time_constant:
        yield "the sample time is not below a tenth of the time constant"


def for_vendor(
    key: str, result: dict[str, Any], pv_range: tuple[float, float] | None, output_range: tuple[float, float]
) -> dict[str, Any]:
    """The three numbers as a vendor's registers hold them, and its word for the action."""
    from pidcfg.tuning.fit import fit
    from pidcfg.tuning.rules import Gains

    vendor = VENDORS[key]
    integral = result["integral_time"]
    gains = Gains(result["gain"], float("inf") if integral is None else integral, result["derivative_time"])
    low, high = pv_range or (0.0, 1.0)
    values = fit(gains, vendor, high - low, output_range[1] - output_range[0])
    words = vendor.load("tuned")
    for value in values:
        if value.problem is not None:
            note(f"{value.key}: {value.problem}")
    return {
        "vendor": key,
        "action": None if result["heating"] is None else words.heating if result["heating"] else words.cooling,
        "values": [
            {
                "key": v.key,
                "unit": v.unit,
                "value": float(v.wanted),
                "stored": None if v.stored is None else float(v.stored),
                "error_percent": round(v.error_percent, 4),
                "problem": v.problem,
            }
            for v in values
        ],
    }


def found_data(found: Found) -> dict[str, float]:
    """What was identified, as JSON prints it."""
    return {
        "gain": found.process.gain,
        "time_constant": found.process.time_constant,
        "dead_time": found.process.dead_time,
        "step_at": found.at,
        "noise": found.noise,
        "misfit_percent": found.misfit * 100,
    }
