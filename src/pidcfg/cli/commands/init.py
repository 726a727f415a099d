"""``pidcfg init``: a commented starter file, or a first scenario for a configuration."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path

import click

from pidcfg.cli import options
from pidcfg.cli.console import echo, write_remark
from pidcfg.text.reader import Limits
from pidcfg.vendors import VENDORS

EPILOG = options.examples_text(
    "pidcfg init --vendor dl06",
    "pidcfg init --vendor dl06 -o oven.yaml",
    "pidcfg init --vendor dl06 | pidcfg validate -",
    "pidcfg init --scenario oven.yaml -o oven.scenario.yaml",
    "pidcfg init --from loops.csv --vendor dl06 -o line4.yaml",
)


@click.command("init", epilog=EPILOG)
@click.option("--vendor", type=click.Choice(list(VENDORS)), help="The PLC family to write for.")
@click.option(
    "--scenario",
    "config",
    metavar="CONFIG",
    help="Write a scenario for this configuration: a plant for each loop, steps, disturbances and expectations.",
)
@click.option(
    "--from",
    "sheet",
    metavar="SHEET",
    help="Write a configuration from a sheet of loops, CSV or XLSX; --vendor unless the sheet names it.",
)
@options.OUTPUT_OPTION
@options.FORCE_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    vendor: str | None,
    config: str | None,
    sheet: str | None,
    out: str | None,
    force: bool,
    quiet: bool,
    limits: Limits,
) -> None:
    """Write a starter file that passes validate, with the usual keys explained.

    With --scenario, write a first scenario for a configuration. Its plants suit the loops' gains; it has been run, and
    no verdict fails that it does not name. With --from, write a configuration from a sheet of loops; its columns are
    keys of the vendor, or common words such as tag, gain, reset, rate, range low, unit, Sollwert.
    """
    from pidcfg.cli.console import suggest_next_step
    from pidcfg.cli.outputs import write_files

    if config is not None and (vendor is not None or sheet is not None):
        raise click.UsageError("--scenario goes with neither --vendor nor --from")
    if (vendor, config, sheet) == (None, None, None):
        raise click.UsageError("one of --vendor, --scenario and --from is wanted: what shall be written?")
    if sheet is not None:
        text = _sheet_text(sheet, vendor, limits, quiet=quiet)
    elif config is not None:
        text = _scenario_text(config, out, limits)
    else:
        starter = VENDORS[str(vendor)].starter
        text = files("pidcfg").joinpath(starter).read_text(encoding="utf-8")
    if out is None:
        echo(text)
        return
    write_files({out: text}, force=force)
    if not quiet:
        write_remark(f"{out}: written")
    suggest_next_step("validate" if config is None else "simulate", out, quiet=quiet)


def _scenario_text(config: str, out: str | None, limits: Limits) -> str:
    """The scenario of a configuration, which it names as seen from the folder that it is written to."""
    from pidcfg.cli.findings import load_configuration, show_errors
    from pidcfg.study.draft import NoDraftError, draft_scenario
    from pidcfg.validate.engine import check_document

    doc = load_configuration(config, limits)
    checked = check_document(doc)
    if checked.failed:
        show_errors(checked.findings, doc, "text")
    folder = Path(out).parent if out is not None else Path()
    name = config if config == "-" else Path(os.path.relpath(config, folder)).as_posix()
    try:
        return draft_scenario(checked, name, max_loop_steps=doc.limits.loop_steps).text
    except NoDraftError as error:
        raise click.ClickException(str(error)) from None


def _sheet_text(sheet: str, vendor: str | None, limits: Limits, *, quiet: bool) -> str:
    """The configuration of a sheet."""
    from pidcfg.cli.environment import require_extra
    from pidcfg.cli.inputs import readable_input
    from pidcfg.cli.options import refuse_all
    from pidcfg.output.sheet_reader import SheetFaultsError, read_configuration

    entry = readable_input(sheet, limits)
    if sheet.lower().endswith(".xlsx"):
        require_extra("openpyxl", "report")
    try:
        configuration = read_configuration(entry.data, sheet, vendor, limits)
    except SheetFaultsError as error:
        refuse_all(error.faults)
    for text in () if quiet else (*configuration.remarks, *(d.message for d in configuration.findings)):
        write_remark(f"note: {text}")
    return configuration.text
