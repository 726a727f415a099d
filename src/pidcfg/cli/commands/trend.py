"""``pidcfg trend``: what the loops of a PLC do, as CSV."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO

import click

from pidcfg.cli import options, plc_options
from pidcfg.cli.commands.decode import vendor_options
from pidcfg.cli.files.outputs import place, refuse_read
from pidcfg.cli.main import Exit
from pidcfg.cli.terminal.console import remark

if TYPE_CHECKING:
    from pidcfg.limits import Limits

EPILOG = options.examples(
    "pidcfg trend --plc modbus://10.0.0.5 --like reactor.yaml -o run.csv --for 10min",
    "pidcfg trend --plc modbus://10.0.0.5 --like reactor.yaml -o run.csv --interval 0.2",
    "pidcfg tune --from-csv run.csv --columns 'time=time,output=TIC-101.OUT,pv=TIC-101.PV' --method simc",
)


class File:
    """A file that is there from its first row on, and has every row that was taken."""

    def __init__(self, name: str | None, *, force: bool) -> None:
        self.name, self.force = name, force
        self._place = None if name is None else place(name)
        self._stream: TextIO | None = None if name is not None else sys.stdout

    def write(self, text: str) -> None:
        """Rows, which are on the disk when this returns."""
        if self._stream is None and self._place is not None:
            try:
                self._stream = self._place.open("w" if self.force else "x", encoding="utf-8", newline="")
            except FileExistsError:
                raise click.ClickException(f"{self.name} exists already; --force overwrites it") from None
        if self._stream is not None:
            self._stream.write(text)
            self._stream.flush()

    def close(self) -> None:
        """No more rows."""
        if self._stream is not None and self.name is not None:
            self._stream.close()


def _seconds(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
    """A time with its unit; a number is in s."""
    if value is None:
        return None
    from pidcfg.schemas.base import parse_seconds

    is_number = value.isascii() and value.replace(".", "", 1).isdecimal()
    try:
        return float(value) if is_number else float(parse_seconds(value))
    except ValueError:
        raise click.BadParameter(f"{value!r} is no time; write it like 90 or '10 min'", ctx, param) from None


@click.command("trend", epilog=EPILOG)
@plc_options.PLC
@options.MAP
@plc_options.LIKE
@plc_options.VENDOR
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False),
    callback=options.or_standard_output,
    help="The file; rows are in it at once.",
)
@click.option("--for", "seconds", metavar="TIME", callback=_seconds, help="How long: 90, 10min; else until Ctrl-C.")
@click.option(
    "--interval", type=options.NUMBER, default=1.0, show_default=True, metavar="SECONDS", help="Time between two rows."
)
@vendor_options
@options.FORCE
@plc_options.TIMEOUT
@plc_options.RETRIES
@options.QUIET
@options.LIMITS
def command(
    plc: str,
    stated: str | None,
    like: str | None,
    vendor: str | None,
    out: str | None,
    seconds: float | None,
    interval: float,
    force: bool,
    timeout: float,
    retries: int,
    quiet: bool,
    limits: Limits,
    **texts: str | None,
) -> None:
    """Record PV, set point, output and mode of each loop of a PLC as CSV, which tune reads.

    Ctrl-C ends it; every row that was taken stays. In a terminal the loops are drawn meanwhile. The PLC is only read.
    """
    plc_options.needed(plc)
    from pidcfg.cli.findings.collect import one_configuration, show_errors
    from pidcfg.cli.terminal.live_chart import chart_for
    from pidcfg.live.calls import trend

    other = None if like is None else one_configuration(like, limits)
    if out is not None:
        refuse_read([out])
    file = File(out, force=force)

    chart = chart_for(out, seconds)
    try:
        with plc_options.reached():
            result = trend(
                plc,
                file,
                like=other,
                vendor=vendor,
                options=texts,
                map=plc_options.map_file(stated, limits),
                interval=interval,
                seconds=seconds,
                taken=None if chart is None else chart.row,
                timeout=timeout,
                retries=retries,
                limits=limits,
            )
    finally:
        if chart is not None:
            chart.close()
        file.close()
    if not result.ok:
        show_errors(result.findings, other, "text")
        click.get_current_context().exit(Exit.UNUSABLE)
    if not quiet:
        rows = f"{result.rows} row{'s' if result.rows != 1 else ''}"
        remark(f"{rows} of {len(result.columns) - 1} signals" + (f" in {out}" if out else ""))
