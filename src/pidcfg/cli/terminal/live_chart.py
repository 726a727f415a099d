"""What a PLC's loops are doing, drawn on stderr while a trend is recorded; the last picture stays when it ends."""

from __future__ import annotations

import sys
import time
from collections import deque
from typing import TYPE_CHECKING

from pidcfg.cli.terminal import colour
from pidcfg.cli.terminal.progress import LINE, watched
from pidcfg.pictures.characters import fits, lines
from pidcfg.pictures.chart import Chart, Line, Panel

if TYPE_CHECKING:
    from collections.abc import Mapping

    from rich.live import Live

    from pidcfg.pictures.chart import Role

KEPT = 2000
"""Rows that a picture shows at most: the last ones."""
EVERY = 0.5
"""Seconds between two pictures."""
LEAST, MOST = 4, 12
"""Rows of a loop's upper panel."""
BESIDE = 8
"""Rows of a loop's chart that are neither panel: title, axes, times, legend."""
MARGIN = 4
"""Columns of the terminal that stay free."""
ROLES: dict[str, Role] = {"SP": "setpoint", "PV": "pv", "OUT": "output"}


class LiveChart:
    """The charts of all loops that the terminal has room for; nobody is shown anything where stderr is none."""

    def __init__(self, seconds: float | None) -> None:
        self.seconds, self.rows, self.at = seconds, 0, 0.0
        self.signals: dict[str, deque[tuple[float, float]]] = {}
        self.modes: dict[str, str] = {}
        self._live: Live | None = None
        self._drawn = float("-inf")

    def row(self, at: float, values: Mapping[str, str]) -> None:
        """A row that was taken; a value that is none is left out."""
        self.rows, self.at = self.rows + 1, at
        for name, text in values.items():
            loop, _, signal = name.rpartition(".")
            if signal not in ROLES:
                self.modes[loop] = text
            elif text:
                self.signals.setdefault(name, deque(maxlen=KEPT)).append((at, float(text)))
        if time.monotonic() - self._drawn >= EVERY:
            self._draw()

    def close(self) -> None:
        """The last picture, which stays."""
        if self._live is not None:
            self._draw()
            self._live.stop()

    def text(self, width: int, height: int, *, ascii_only: bool) -> str:
        """The picture: as many loops as ``height`` rows have room for, and how far the recording is."""
        loops = list(dict.fromkeys(name.rpartition(".")[0] for name in self.signals))
        room = max((height - 1) // (BESIDE + LEAST + LEAST // 2), 1)
        shown = loops[:room]
        panel = (height - 1) // max(len(shown), 1) - BESIDE
        rows = [
            row
            for loop in shown
            for row in lines(self._chart(loop), width, min(max(panel * 2 // 3, LEAST), MOST), ascii_only)
        ]
        left = f"; {len(loops) - room} more loops are recorded" if len(loops) > room else ""
        whole = f" of {self.seconds:g} s" if self.seconds else " s, until Ctrl-C"
        return "\n".join([*rows, f"{self.at:.0f}{whole}, {self.rows} rows{left}"])

    def _chart(self, loop: str) -> Chart:
        found = {s: self.signals[f"{loop}.{s}"] for s in ROLES if f"{loop}.{s}" in self.signals}
        drawn = {s: Line(s, ROLES[s], [t for t, _ in points], [v for _, v in points]) for s, points in found.items()}
        process = tuple(line for s, line in drawn.items() if s != "OUT")
        panels = [Panel("PV", "", process)] if process else []
        panels += [Panel("output", "", (drawn["OUT"],))] if "OUT" in drawn else []
        mode = self.modes.get(loop)
        return Chart(f"{loop}, {mode}" if mode else loop, loop, tuple(panels))

    def _draw(self) -> None:
        """Brings the picture up to date; with the first one the progress line makes room."""
        from rich.console import Console
        from rich.live import Live
        from rich.text import Text

        if self._live is None:
            LINE.end()
            console = Console(file=sys.stderr, no_color=not colour.enabled(sys.stderr), highlight=False)
            self._live = Live(console=console, auto_refresh=False, redirect_stdout=False, redirect_stderr=False)
            self._live.start()
        size = self._live.console.size
        text = self.text(size.width - MARGIN, size.height - 1, ascii_only=not fits(sys.stderr.encoding))
        self._live.update(Text(text, no_wrap=True), refresh=True)
        self._drawn = time.monotonic()


def chart_for(out: str | None, seconds: float | None) -> LiveChart | None:
    """A chart where a person watches and the rows go somewhere else."""
    if not watched() or LINE.silent or (out is None and colour.terminal(sys.stdout)):
        return None
    return LiveChart(seconds)
