"""Work on many items in several processes: results come back in the order of the items, whoever did the work.

A worker is a function that one call of ``make`` returns, in this process or in one that is started anew, as every
system can; ``make`` and what it is given travel there, then items and results. Processes end with the one that has
started them, do not hear Ctrl-C, and warn of nothing.
"""

from __future__ import annotations

import os
import signal
import sys
from collections import deque
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pidcfg.text.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.connection import Connection

Item = TypeVar("Item")
Result = TypeVar("Result")
ITEMS_AHEAD = 4
"""Items that wait for each process."""
FILE_MICROSECONDS = 20_000
"""µs that reading and checking a file takes."""
START_MICROSECONDS = 1_500_000
"""µs of work from which on two processes are done sooner than one: each takes 0.7 s to start and to import."""


def cores() -> int:
    """How many processes this one may keep busy."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Process:
    """What this process does with an item."""

    worker: Callable[[object], object]


@frozen
class WorkerPool(Generic[Item, Result]):
    """Up to ``jobs`` processes, each with a worker that ``make(*given)`` returns there."""

    jobs: int
    make_worker: Callable[..., Callable[[Item], Result]]
    arguments: tuple[object, ...] = ()

    def results(self, items: Iterable[Item]) -> Iterator[Result]:
        """The results in order; raises `ChildProcessError` where a process is gone before its work is done."""
        from concurrent.futures.process import BrokenProcessPool

        with self._pool() as pool:
            futures: deque[Future[Result]] = deque()
            try:
                for item in items:
                    with _ignore_interrupts():
                        futures.append(pool.submit(_run_item, item))
                    if len(futures) >= self.jobs * ITEMS_AHEAD:
                        yield futures.popleft().result()
                while futures:
                    yield futures.popleft().result()
            except BrokenProcessPool:
                raise ChildProcessError("a process ended in the middle of its work; try --jobs 1") from None

    def adaptive_results(
        self,
        items: Sequence[Item],
        effort: Callable[[Result], float],
        make_worker: Callable[..., Callable[[Item], Result]] | None = None,
    ) -> Iterator[Result]:
        """The same, with processes only where they pay: this one works until what is left is worth starting them.

        ``effort``: what an item with this result has taken beside a file, in µs by a count of its work. What is left is
        taken to be like the largest so far. ``make_worker``: for this process; its worker may also say how far it is.
        """
        worker, max_effort = None, 0.0
        for i, item in enumerate(items):
            remaining = len(items) - i
            if self.jobs > 1 and remaining > 1 and remaining * (FILE_MICROSECONDS + max_effort) >= START_MICROSECONDS:
                yield from self.results(items[i:])
                return
            worker = worker or (make_worker or self.make_worker)(*self.arguments)
            result = worker(item)
            max_effort = max(max_effort, effort(result))
            yield result

    @contextmanager
    def _pool(self) -> Iterator[ProcessPoolExecutor]:
        """The processes; they are stopped at once where the caller does not wait for the end."""
        from concurrent.futures import ProcessPoolExecutor
        from multiprocessing import get_context

        context = get_context("spawn")
        child_end, parent_end = context.Pipe(duplex=False)
        pool = ProcessPoolExecutor(self.jobs, context, _start_worker, (child_end, self.make_worker, self.arguments))
        try:
            yield pool
        except BaseException:
            parent_end.close()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
            parent_end.close()
            child_end.close()


@contextmanager
def _ignore_interrupts() -> Iterator[None]:
    """A process that starts now never hears Ctrl-C; this one hears it afterwards."""
    if sys.platform == "win32":
        yield
        return
    old_mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, old_mask)


def _start_worker(
    parent_end: Connection, make_worker: Callable[..., Callable[[Any], object]], arguments: tuple[object, ...]
) -> None:
    """A new process makes its worker; it ends with its parent, which alone hears Ctrl-C."""
    import threading
    import warnings

    warnings.simplefilter("ignore")  # what there is to say, the parent says
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(parent_end,), daemon=True).start()
    _Process.worker = make_worker(*arguments)


def _end_with_parent(parent_end: Connection) -> None:
    """Ends this process with the other end of a pipe, which its parent closes, or which is closed with it."""
    from multiprocessing import parent_process
    from multiprocessing.connection import wait

    parent = parent_process()
    wait([parent_end] if parent is None else [parent_end, parent.sentinel])
    os._exit(1)


def _run_item(item: object) -> Any:
    return _Process.worker(item)
