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
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return _Ending().run(work)
    return _beside(work)


def _beside(work: Coroutine[Any, Any, R]) -> R:
    """The result of the work in a thread of its own; what interrupts the wait for it, Ctrl-C say, cancels it."""
    from concurrent.futures import ThreadPoolExecutor

    ending = _Ending()
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(asyncio.run, ending.watched(work))
        try:
            return future.result()
        except BaseException:
            if not future.done():
                ending.cancel()
                with suppress(asyncio.CancelledError):
                    return future.result()
            raise


class _Ending:
    """What signals do while work is running: the first one cancels it, the next one is none of ours."""

    def __init__(self) -> None:
        self._before: dict[int, Callable[[int, Any], Any]] = {}
        self._cancel: Callable[[], Any] | None = None
        self._came: int | None = None
        self._begun = threading.Event()

    def run(self, work: Coroutine[Any, Any, R]) -> R:
        """The result of the work; a signal that ended it without one does what it would have done."""
        self._install()
        try:
            return asyncio.run(self.watched(work))
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
        if self._came is not None or self._cancel is None:
            self._before[number](number, frame)
            return
        self._came = number
        self._cancel()

    def cancel(self) -> None:
        """Cancels the work from another thread, as soon as it has begun."""
        self._begun.wait()
        if self._cancel is not None:
            self._cancel()

    async def watched(self, work: Coroutine[Any, Any, R]) -> R:
        """The work, which can be cancelled while it is running."""
        loop, task = asyncio.get_running_loop(), asyncio.current_task()
        if task is not None:
            self._cancel = partial(loop.call_soon_threadsafe, task.cancel)  # wakes a loop that waits
        self._begun.set()
        try:
            return await _quiet(work)
        finally:
            self._cancel = None


async def _quiet(work: Coroutine[Any, Any, R]) -> R:
    """What a malformed answer breaks inside of the library is told by the request that gets none."""
    asyncio.get_running_loop().set_exception_handler(lambda _loop, _context: None)
    return await work
