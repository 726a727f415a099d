"""``--verbose``: what a command has read, left out and taken from elsewhere, on standard error."""

from __future__ import annotations

import platform
import time
from typing import TYPE_CHECKING

import click

from pidcfg import __version__
from pidcfg.cli import environment
from pidcfg.cli.terminal.console import remark

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pidcfg.scenario.outcome import Outcome


class Detail:
    """What is said with ``--verbose``, and nothing without it."""

    def __init__(self, ctx: click.Context, *, wanted: bool, quiet: bool) -> None:
        if wanted and quiet:
            raise click.UsageError("--verbose and --quiet exclude each other", ctx)
        self.wanted = wanted
        self._begin = self._last = time.perf_counter()
        self.say(f"pidcfg {__version__}, Python {platform.python_version()}, {platform.system()}")
        self.say(*(f"environment: {setting}" for setting in environment.in_force(ctx.command)))

    def say(self, *lines: str) -> None:
        """Lines for whoever wants to know."""
        for line in lines if self.wanted else ():
            remark(line)

    def listed(self, what: str, names: Iterable[str]) -> None:
        """A line for each name."""
        self.say(*(f"{what} {name}" for name in names))

    def ran(self, outcome: Outcome) -> None:
        """What a run read, and how fast it was."""
        self.say(*(f"read {name}" for name in dict.fromkeys((outcome.file, outcome.config)) if name))
        now = time.perf_counter()
        took, self._last = now - self._last, now
        if outcome.report is not None:
            duration = outcome.report.duration
            self.say(f"ran {outcome.file}: {duration:g} s in {took:.2f} s, engine {outcome.report.engine}")

    def end(self) -> None:
        """How long it took."""
        self.say(f"took {time.perf_counter() - self._begin:.2f} s")
