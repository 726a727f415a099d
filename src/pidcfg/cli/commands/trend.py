"""``pidcfg trend``: what the loops of a PLC do, as CSV, and drawn while it is recorded."""

from __future__ import annotations

import sys
import time
from collections import deque
from typing import TYPE_CHECKING, TextIO

import click

from pidcfg.cli import options, terminal
from pidcfg.cli.commands import plc as plc_options
from pidcfg.cli.commands.decode import vendor_options
from pidcfg.cli.console import write_remark
from pidcfg.cli.main import Exit
from pidcfg.cli.outputs import output_path, refuse_read_files
from pidcfg.cli.terminal import LINE, is_watched
from pidcfg.pictures import Chart, Line, Panel
from pidcfg.pictures.characters import can_encode_signs, draw_rows

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.live import Live

    from pidcfg.pictures import Role
    from pidcfg.text.reader import Limits

# --- What a PLC's loops are doing, drawn on stderr while a trend is recorded; the last picture stays when it ends -----

MAX_ROWS_SHOWN = 2000
"""Rows that a picture shows at most: the last ones."""
REDRAW_SECONDS = 0.5
"""Seconds between two pictures."""
MIN_CHART_ROWS, MAX_CHART_ROWS = 4, 12
"""Rows of a loop's upper panel."""
ROWS_BESIDE_PANELS = 8
"""Rows of a loop's chart that are neither panel: title, axes, times, legend."""
FREE_COLUMNS = 4
"""Columns of the terminal that stay free."""
ROLES: dict[str, Role] = {"SP": "setpoint", "PV": "pv", "OUT": "output"}


class LiveChart:
    """The charts of all loops that the terminal has room for; nobody is shown anything where stderr is none."""

    def __init__(self, seconds: float | None) -> None:
        self.seconds, self.rows, self.seconds_now = seconds, 0, 0.0
        self.signals: dict[str, deque[tuple[float, float]]] = {}
        self.modes: dict[str, str] = {}
        self._live: Live | None = None
        self._last_drawn = float("-inf")

    def add_row(self, seconds: float, values: Mapping[str, str]) -> None:
        """A row that was taken; a value that is none is left out."""
        self.rows, self.seconds_now = self.rows + 1, seconds
        for name, text in values.items():
            loop, _, signal = name.rpartition(".")
            if signal not in ROLES:
                self.modes[loop] = text
            elif text:
                self.signals.setdefault(name, deque(maxlen=MAX_ROWS_SHOWN)).append((seconds, float(text)))
        if time.monotonic() - self._last_drawn >= REDRAW_SECONDS:
            self._draw()

    def close(self) -> None:
        """The last picture, which stays."""
        if self._live is not None:
            self._draw()
            self._live.stop()

    def text(self, width: int, height: int, *, ascii_only: bool) -> str:
        """The picture: as many loops as ``height`` rows have room for, and how far the recording is."""
        loops = list(dict.fromkeys(name.rpartition(".")[0] for name in self.signals))
        max_loops = max((height - 1) // (ROWS_BESIDE_PANELS + MIN_CHART_ROWS + MIN_CHART_ROWS // 2), 1)
        drawn_loops = loops[:max_loops]
        panel = (height - 1) // max(len(drawn_loops), 1) - ROWS_BESIDE_PANELS
        chart_height = min(max(panel * 2 // 3, MIN_CHART_ROWS), MAX_CHART_ROWS)
        rows = [
            row
            for loop in drawn_loops
            for row in draw_rows(self._loop_chart(loop), width, chart_height, ascii_only=ascii_only)
        ]
        more_text = f"; {len(loops) - max_loops} more loops are recorded" if len(loops) > max_loops else ""
        length_text = f" of {self.seconds:g} s" if self.seconds else " s, until Ctrl-C"
        return "\n".join([*rows, f"{self.seconds_now:.0f}{length_text}, {self.rows} rows{more_text}"])

    def _loop_chart(self, loop: str) -> Chart:
        points_by_signal = {s: self.signals[f"{loop}.{s}"] for s in ROLES if f"{loop}.{s}" in self.signals}
        lines = {
            s: Line(s, ROLES[s], [t for t, _ in points], [v for _, v in points])
            for s, points in points_by_signal.items()
        }
        process = tuple(line for s, line in lines.items() if s != "OUT")
        panels = [Panel("PV", "", process)] if process else []
        panels += [Panel("output", "", (lines["OUT"],))] if "OUT" in lines else []
        mode = self.modes.get(loop)
        return Chart(f"{loop}, {mode}" if mode else loop, loop, tuple(panels))

    def _draw(self) -> None:
        """Brings the picture up to date; with the first one the progress line makes room."""
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        if self._live is None:
            LINE.end()
            console = Console(file=sys.stderr, no_color=not terminal.is_coloured(sys.stderr), highlight=False)
            self._live = Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
            self._live.start()
        size = self._live.console.size
        text = self.text(
            size.width - FREE_COLUMNS, size.height - 1, ascii_only=not can_encode_signs(sys.stderr.encoding)
        )
        self._live.update(Text(text, no_wrap=True), refresh=True)
        self._last_drawn = time.monotonic()


def chart_for(out: str | None, seconds: float | None) -> LiveChart | None:
    """A chart where a person watches and the rows go somewhere else."""
    if not is_watched() or LINE.silent or (out is None and terminal.is_terminal(sys.stdout)):
        return None
    return LiveChart(seconds)


# --- ``pidcfg trend``: what the loops of a PLC do, as CSV -------------------------------------------------------------

EPILOG = options.examples_text(
    "pidcfg trend --plc modbus://10.0.0.5 --like reactor.yaml -o run.csv --for 10min",
    "pidcfg trend --plc modbus://10.0.0.5 --like reactor.yaml -o run.csv --interval 0.2",
    "pidcfg tune --from-csv run.csv --columns 'time=time,output=TIC-101.OUT,pv=TIC-101.PV' --method simc",
)


class TrendFile:
    """A file that is there from its first row on, and has every row that was taken."""

    def __init__(self, name: str | None, *, force: bool) -> None:
        self.name, self.force = name, force
        self._path = None if name is None else output_path(name)
        self._stream: TextIO | None = None if name is not None else sys.stdout

    def write(self, text: str) -> None:
        """Rows, which are on the disk when this returns."""
        if self._stream is None and self._path is not None:
            try:
                self._stream = self._path.open("w" if self.force else "x", encoding="utf-8", newline="")
            except FileExistsError:
                raise click.ClickException(f"{self.name} exists already; --force overwrites it") from None
        if self._stream is not None:
            self._stream.write(text)
            self._stream.flush()

    def close(self) -> None:
        """No more rows."""
        if self._stream is not None and self.name is not None:
            self._stream.close()


def _parse_seconds(ctx: click.Context, param: click.Parameter, value: str | None) -> float | None:
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
@plc_options.PLC_OPTION
@options.MAP_OPTION
@plc_options.LIKE_OPTION
@plc_options.VENDOR_OPTION
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(dir_okay=False),
    callback=options.dash_as_none,
    help="The file; rows are in it at once.",
)
@click.option(
    "--for", "seconds", metavar="TIME", callback=_parse_seconds, help="How long: 90, 10min; else until Ctrl-C."
)
@click.option(
    "--interval",
    type=options.NUMBER_TYPE,
    default=1.0,
    show_default=True,
    metavar="SECONDS",
    help="Time between two rows.",
)
@vendor_options
@options.FORCE_OPTION
@plc_options.TIMEOUT_OPTION
@plc_options.RETRIES_OPTION
@options.QUIET_OPTION
@options.LIMITS_OPTION
def command(
    plc: str,
    map_path: str | None,
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
    **vendor_texts: str | None,
) -> None:
    """Record PV, set point, output and mode of each loop of a PLC as CSV, which tune reads.

    Ctrl-C ends it; every row that was taken stays. In a terminal the loops are drawn meanwhile. The PLC is only read.
    """
    plc_options.require_packages(plc)
    from pidcfg.cli.findings import load_configuration, show_errors
    from pidcfg.live.trend import trend

    like_document = None if like is None else load_configuration(like, limits)
    if out is not None:
        refuse_read_files([out])
    file = TrendFile(out, force=force)

    chart = chart_for(out, seconds)
    try:
        with plc_options.report_plc_errors():
            result = trend(
                plc,
                file,
                like=like_document,
                vendor=vendor,
                options=vendor_texts,
                map=options.map_file(map_path, limits),
                interval=interval,
                seconds=seconds,
                taken=None if chart is None else chart.add_row,
                timeout=timeout,
                retries=retries,
                limits=limits,
            )
    finally:
        if chart is not None:
            chart.close()
        file.close()
    if not result.ok:
        show_errors(result.findings, like_document, "text")
        click.get_current_context().exit(Exit.UNUSABLE)
    if not quiet:
        rows = f"{result.rows} row{'s' if result.rows != 1 else ''}"
        write_remark(f"{rows} of {len(result.columns) - 1} signals" + (f" in {out}" if out else ""))
