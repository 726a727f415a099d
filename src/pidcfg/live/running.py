"""Asynchronous work from synchronous calls, also where a loop runs already, as in a notebook."""

from __future__ import annotations

import asyncio
import signal
import threading
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

R = TypeVar("R")

ENDINGS = (signal.SIGINT, signal.SIGTERM)
"""Signals that somebody sends who wants the work to end."""


def run(work: Coroutine[Any, Any, R]) -> R:
    """The result of the work, in an event loop of its own.

    Ctrl-C and SIGTERM cancel the work, which may come to an end with what it has; otherwise they do what they did
    before. A signal that is ignored, or whose default nobody has changed, stays as it is.
    """
    ending = _Ending()
    watched = ending.watched(work)
    try:
        return ending.around(lambda: _beside(watched) if _is_in_a_loop() else asyncio.run(watched))
    finally:  # where no loop can be made, neither has begun
        watched.close()
        work.close()


def _is_in_a_loop() -> bool:
    """Whether an event loop runs in this thread, as in a notebook."""
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return False
    return True


def _beside(work: Coroutine[Any, Any, R]) -> R:
    """The result of the work in a thread of its own."""
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(1) as pool:
        return pool.submit(asyncio.run, work).result()


class _Ending:
    """What signals do while work is running: the first one cancels it, the next one is none of ours."""

    def __init__(self) -> None:
        self._before: dict[int, Callable[[int, Any], Any]] = {}
        self._cancel: Callable[[], object] | None = None
        self._came: int | None = None

    def around(self, work: Callable[[], R]) -> R:
        """What the work gives; a signal that ended it without a result does what it would have done."""
        self._install()
        try:
            return work()
        except asyncio.CancelledError:
            if self._came is not None:
                self._before[self._came](self._came, None)
            raise
        finally:
            for number, handler in self._before.items():
                signal.signal(number, handler)

    def _install(self) -> None:
        """Takes the signals that have a handler, in the one thread that may."""
        if threading.current_thread() is not threading.main_thread():
            return
        for number in ENDINGS:
            handler = signal.getsignal(number)
            if callable(handler):
                self._before[number] = handler
                signal.signal(number, self._end)

    def _end(self, number: int, frame: object) -> None:
        if self._came is not None:
            self._before[number](number, frame)
            return
        self._came = number
        if self._cancel is not None:
            with suppress(RuntimeError):  # its loop has just been closed
                self._cancel()

    async def watched(self, work: Coroutine[Any, Any, R]) -> R:
        """The work, which a signal cancels while it is running, or as it begins."""
        loop, task = asyncio.get_running_loop(), asyncio.ensure_future(_quiet(work))
        self._cancel = partial(loop.call_soon_threadsafe, task.cancel)  # wakes a loop that waits
        if self._came is not None:
            task.cancel()
        try:
            return await task
        finally:
            self._cancel = None


async def _quiet(work: Coroutine[Any, Any, R]) -> R:
    """What a malformed answer breaks inside of the library is told by the request that gets none."""
    asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
    return await work
