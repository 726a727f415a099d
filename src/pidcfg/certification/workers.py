"""Who runs the samples: this process, or several, whose results come back in the order of the samples."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass, replace
from multiprocessing import get_context, parent_process
from multiprocessing.connection import wait
from typing import TYPE_CHECKING, Literal

from pidcfg.certification.fan import SAMPLES, Fan, Thinned, fan_of
from pidcfg.certification.run import Seen, run_sample
from pidcfg.certification.sample import Batch
from pidcfg.scenario.axes import axes_of, signals_of
from pidcfg.scenario.load import Loaded, load
from pidcfg.sim.report import rounded
from pidcfg.sim.run import Settings
from pidcfg.source import read_document

if TYPE_CHECKING:
    from array import array
    from collections.abc import Iterator
    from concurrent.futures import Future

    from pidcfg.limits import Limits

UNIT = 8
"""Samples that a process takes at a time."""
AHEAD = 4
"""Such parts that wait for each process."""


class WorkersError(RuntimeError):
    """Nobody is left who runs the samples, and why."""


@dataclass(frozen=True, slots=True)
class Job:
    """What a process needs to run samples: bytes, from which it reads everything itself."""

    name: str
    scenario: str
    config_name: str
    config: bytes
    seed: int
    engine: Literal["python", "numba"]
    limits: Limits

    def read(self, name: str, most: int) -> bytes:
        """As a `pidcfg.reader.Reader`: the only other file that there is."""
        del name
        return self.config[:most]

    def resolve(self, name: str, other: str) -> str:
        """As a `pidcfg.reader.Reader`."""
        del name, other
        return self.config_name

    @property
    def settings(self) -> Settings:
        """How each sample runs."""
        return Settings(self.engine, max_loop_steps=self.limits.loop_steps)

    def loaded(self) -> tuple[Loaded, Batch]:
        """The scenario with its configuration, and what varies."""
        loaded = load(
            read_document(self.scenario.encode("utf-8", "surrogatepass"), self.name, self.limits), self.limits, self
        )
        plc = loaded.plc()
        kept = pickle.dumps(plc, pickle.HIGHEST_PROTOCOL)
        return loaded, Batch(loaded.document, loaded.uncertainties(plc)[0], self.seed, kept)


class _Mine:
    """What this process runs, once it knows."""

    job: Job
    loaded: Loaded
    batch: Batch


def results(job: Job, first: int, samples: int, jobs: int) -> Iterator[Seen]:
    """The results of the samples from ``first`` on, in order; raises `WorkersError`.

    A process that is ended from outside costs what it had begun, unless they end one after the other.
    """
    if jobs == 1 or samples - first <= UNIT:
        loaded, batch = job.loaded()
        for sample in range(first, samples):
            yield run_sample(loaded, batch, sample, job.settings)[0]
        return
    while first < samples:
        before = first
        try:
            for seen in _by_processes(job, first, samples, jobs):
                yield seen
                first += 1
        except BrokenProcessPool:
            if first == before:
                last = min(first + jobs * AHEAD * UNIT, samples) - 1
                why = "perhaps for want of memory, of which fewer --jobs need less"
                raise WorkersError(f"a process ended at samples {first} to {last}, {why}") from None


def _by_processes(job: Job, first: int, samples: int, jobs: int) -> Iterator[Seen]:
    """The same, as long as all processes live."""
    with _pool(job, jobs) as pool:
        waiting: deque[Future[list[Seen]]] = deque()
        for begin in range(first, samples, UNIT):
            waiting.append(pool.submit(_run_part, begin, min(begin + UNIT, samples)))
            if len(waiting) >= jobs * AHEAD:
                yield from waiting.popleft().result()
        while waiting:
            yield from waiting.popleft().result()


@contextmanager
def _pool(job: Job, jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that are started anew, as every system can; what waits is dropped where the caller stops."""
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), _begin, (job,))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(job: Job) -> None:
    """A new process reads what it runs; it ends with its parent, which alone hears Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    _Mine.job = job
    _Mine.loaded, _Mine.batch = job.loaded()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        wait([parent.sentinel])
        os._exit(1)


def recordings(job: Job, samples: int, jobs: int) -> Fan:
    """How the signals that a picture needs spread over the first samples; those that cannot run are left out."""
    samples = min(samples, SAMPLES)
    if jobs == 1 or samples <= UNIT:
        loaded, batch = job.loaded()
        kept = [_record(loaded, batch, sample, job.settings) for sample in range(samples)]
    else:
        with _pool(job, jobs) as pool:
            kept = list(pool.map(_record_mine, range(samples), chunksize=UNIT))
    ran = [one for one in kept if one is not None]
    return fan_of(ran[0][0] if ran else (), [signals for _, signals in ran])


Recorded = tuple[list[float], dict[str, "array[float]"]]
"""Times in s, and the values of each signal."""


def _record(loaded: Loaded, batch: Batch, sample: int, settings: Settings) -> Recorded | None:
    """One sample's signals."""
    thinned = Thinned(signals_of(axes_of(loaded.plc(), loaded.image.settings)))
    _, report = run_sample(loaded, batch, sample, replace(settings, recording=thinned))
    if report is None:
        return None
    return [rounded(step * thinned.dt) for step in thinned.wanted_steps], thinned.taken


def _record_mine(sample: int) -> Recorded | None:
    return _record(_Mine.loaded, _Mine.batch, sample, _Mine.job.settings)


def _run_part(begin: int, end: int) -> list[Seen]:
    """Samples one after the other."""
    return [run_sample(_Mine.loaded, _Mine.batch, i, _Mine.job.settings)[0] for i in range(begin, end)]
