"""What a person sees of a command that takes longer than a second: one line on stderr that is gone when it ends.

One line serves all commands. `main` begins it, whoever knows how far the work has come tells `update`, and everything
that writes to the terminal takes the line away first. Nobody is shown anything where stderr is no terminal, or after
``--quiet``.
"""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from pidcfg.cli.terminal import colour

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from threading import Timer

    from rich.progress import Progress

T = TypeVar("T")
AFTER = 1.0
"""Seconds of silence."""


class Line:
    """The line: a timer waits for its second, then a bar is there until the line ends."""

    def __init__(self) -> None:
        self.label = "working"
        self.share: float | None = None
        self.silent = False
        self._timer: Timer | None = None
        self._bar: Progress | None = None

    def begin(self) -> None:
        """From now on the second counts, if a person watches."""
        if self.silent or self._timer is not None or not watched():
            return
        from threading import Timer

        self._timer = Timer(AFTER, self._show)
        self._timer.daemon = True
        self._timer.start()

    def _show(self) -> None:
        """Draws the bar; the timer's thread does this, while the work goes on."""
        bar = _bar()
        bar.add_task(self.label, total=None)
        self._bar = bar
        self._draw()
        bar.start()

    def _draw(self) -> None:
        """Brings the bar up to date."""
        if self._bar is not None and self._bar.task_ids:
            total, done = (None, 0.0) if self.share is None else (1.0, self.share)
            self._bar.update(self._bar.task_ids[0], description=self.label, total=total, completed=done)

    def update(self, label: str, share: float | None = None) -> None:
        """What is done, and how much of it; without a share it is unknown."""
        self.label, self.share = label, share
        self._draw()

    def end(self) -> bool:
        """Takes the line away; tells whether there was one, or would have been."""
        timer, self._timer = self._timer, None
        if timer is None:
            return False
        timer.cancel()
        timer.join()
        bar, self._bar = self._bar, None
        if bar is not None:
            bar.stop()
        return True

    def silence(self) -> None:
        """``--quiet``."""
        self.end()
        self.silent = True


LINE = Line()


def watched() -> bool:
    """Whether stderr is a terminal: progress is shown nowhere else."""
    return sys.stderr is not None and colour.terminal(sys.stderr)


def _bar() -> Progress:
    """A bar on stderr that leaves nothing behind."""
    from rich.console import Console
    from rich.progress import Progress

    plain = not colour.enabled(sys.stderr)
    console = Console(file=sys.stderr, no_color=plain)
    return Progress(console=console, transient=True, redirect_stdout=False, redirect_stderr=False)


def progress(items: Iterable[T], label: str, total: int) -> Iterator[T]:
    """The items, while the line shows how many have come."""
    LINE.update(label)
    for done, item in enumerate(items, start=1):
        yield item
        LINE.update(label, done / max(total, 1))


@contextmanager
def held() -> Iterator[None]:
    """Without the line: while somebody types, or processes are forked, which no thread survives."""
    begun = LINE.end()
    try:
        yield
    finally:
        if begun:
            LINE.begin()
