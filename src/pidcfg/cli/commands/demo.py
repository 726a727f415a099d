"""``pidcfg demo``: one loop from a mistake to its run, on one screen."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from dataclasses import replace
from importlib.resources import files
from textwrap import fill

import click

from pidcfg.cli import options, plots
from pidcfg.cli.console import show_text
from pidcfg.vendors import VENDORS

EPILOG = options.examples_text("pidcfg demo", "pidcfg demo --vendor click", "pidcfg demo --color always")
MISTAKES = {
    "dl06": ("low_low: 5, low: 10", "low_low: 10, low: 10"),
    "click": ("proportional_gain: 2.0", "proportional_gain: 20000"),
    "ezlogix": ("limits: [0, 300]", "limits: [300, 0]"),
    "nextopid": ("MaxMV: 100.0", "MaxMV: 0.0"),
    "dpide": ("MV: D104", "MV: D510"),
    "generic": ("low: 40, high: 250", "low: 250, high: 40"),
}
"""What a vendor's starter file says, and what somebody has typed in its place."""
SHOWN_FIELDS = (
    {"setpoint", "SP", "SV"}
    | {"gain", "proportional_gain", "Kp", "Kc_Kp"}
    | {"reset", "reset_time", "integral_time", "Ti_Ki"}
)
"""Registers and parameters that are shown."""
WIDTH, HEIGHT = 80, 6
"""Columns of the screen, lines of the picture."""
FILE_NAME = "loop.yaml"
COMMENT_PATTERN = re.compile(r" +# .*")
REFERENCE_PREFIX = "      = see: "
"""How the line of a finding begins that names the manual's page."""


@click.command("demo", epilog=EPILOG)
@click.option("--vendor", type=click.Choice(list(VENDORS)), default="dl06", show_default=True, help="The PLC family.")
def command(vendor: str) -> None:
    """Show one loop on one screen: a mistake that is found, the words for the PLC, and a run on a simulated plant.

    No file is written, and no PLC is asked.
    """
    show_text("\n".join(screen_lines(vendor)) + "\n")


def screen_lines(vendor: str) -> Iterator[str]:
    """The lines of the screen."""
    text = (files("pidcfg") / VENDORS[vendor].starter).read_text("utf-8")
    yield f"{VENDORS[vendor].title}: pidcfg validate finds a mistake"
    yield from finding_lines(COMMENT_PATTERN.sub("", text.replace(*MISTAKES[vendor])))
    words, count = sample_words(text)
    yield f"Corrected: pidcfg encode gives {count} words for the PLC, among them"
    yield from words
    yield "pidcfg simulate runs the loop on a simulated plant"
    yield from run_lines(text)
    for line, purpose in (
        (f"pidcfg init --vendor {vendor} -o {FILE_NAME}", "this loop as a file of your own"),
        (f"pidcfg simulate {FILE_NAME} --plot -", "its run as a picture"),
        ("pidcfg --help", "all commands"),
    ):
        yield f"Next: {line:<42} {purpose}"


def finding_lines(text: str) -> Iterator[str]:
    """What is wrong with the text, as ``validate`` explains it."""
    from pidcfg.api import check
    from pidcfg.cli.formats.findings import findings_text as as_text
    from pidcfg.output.findings import errors_in

    result = check(text, name=FILE_NAME)
    worst = errors_in(result.findings)[:1]
    for line in as_text(worst, {FILE_NAME: result.document}).rstrip("\n").split("\n"):
        if not line.startswith(REFERENCE_PREFIX):
            yield fill(line, WIDTH, subsequent_indent=" " * 8) if "|" not in line else line


def sample_words(text: str) -> tuple[list[str], int]:
    """Some lines of the listing, and how many it has."""
    from pidcfg.api import encode

    lines = [line for line in encode(text).text.splitlines() if not line.startswith("#")]
    sample = [line for line in lines if SHOWN_FIELDS & {line.split()[-1], line.split()[0].rpartition(".")[2]}]
    return [f"  {line}" for line in sample], len(lines)


def run_lines(text: str) -> Iterator[str]:
    """PV and set point of the loop as a picture, and its verdict."""
    from pidcfg.api import simulate
    from pidcfg.cli.formats.runs import loops_text
    from pidcfg.study.outcome import charts_of

    outcome = simulate(text, name=FILE_NAME, record=True).outcome
    for chart in charts_of(outcome, ()):
        signals = tuple(line for line in chart.panels[0].lines if line.role in {"pv", "setpoint"})
        small_chart = replace(chart, title="", panels=(replace(chart.panels[0], lines=signals),), strips=())
        yield from plots.chart_text(small_chart, sys.stdout, HEIGHT).strip("\n").split("\n")
    if outcome.report is not None:
        yield fill(loops_text(outcome.report).strip(), WIDTH, initial_indent="  ", subsequent_indent="    ")
