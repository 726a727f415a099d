"""Who runs the samples elsewhere: the workers of a Dask cluster, each a block of 1,024."""

from __future__ import annotations

import logging
import re
import threading
import time
from collections import Counter
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.study.certification.samples import WorkersError, describe_machine, name_differences, trial_facts
from pidcfg.study.certification.tally import BLOCK_SAMPLES, Tally

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from distributed import Client, Future

    from pidcfg.study.certification.samples import Job, Sampler, SampleResult
    from pidcfg.study.certification.tally import Progress, Sizes

# --- What a worker of a cluster does: the samples of one block, counted -----------------------------------------------


class Kept(threading.local):
    """The job that a worker had last, and what runs its samples: one run, which no other thread may begin again."""

    job: Job | None = None
    sampler: Sampler | None = None


KEPT = Kept()


def _sampler(job: Job) -> Sampler:
    """What runs the samples in this thread."""
    if KEPT.sampler is None or KEPT.job != job:
        KEPT.job, KEPT.sampler = job, job.sampler()
    return KEPT.sampler


def run_block(job: Job, first: int, end: int, sizes: Sizes) -> Tally | list[SampleResult]:
    """Samples of one block: counted, or one by one where their block has begun elsewhere."""
    sampler = _sampler(job)
    seen = map(sampler.run, range(first, end))
    if first % BLOCK_SAMPLES:
        return list(seen)
    tally = Tally.empty(sizes, first)
    for one in seen:
        tally.add(one, sampler.batch.varies)
    return tally


# --- Who runs the samples: the workers of a Dask cluster, each a block of 1,024 samples at a time ---------------------
#
# Before it gets a block, a worker runs the first samples of the batch, and its hash, its Python and its packages are
# held against those of this machine. Who differs is left out. A block whose worker goes away is handed to another
# one, and an idle worker also gets what a slow one has not brought yet; whoever brings a block first, it is the same
# block.

LOCAL = re.compile(r"local:([1-9]\d{0,3})")
REMOTE = re.compile(r"(tcp|tls)://\S+:\d+")
CONNECT, LOOK, PATIENCE = 10.0, 1.0, 60.0
"""Seconds: for a connection, between two looks at the workers, and until one must be there."""
BLOCKS_AHEAD = 4
"""Blocks for each worker that may be ready before an earlier one."""
MOST_ENDS = 3
"""Workers that a block may end."""


class Task(NamedTuple):
    """A block that a worker has, or its trial."""

    future: Future
    first: int | None
    """The block's first sample; None: the trial."""


def is_address(text: str) -> bool:
    """Whether a text names a cluster."""
    return bool(LOCAL.fullmatch(text) or REMOTE.fullmatch(text))


@contextmanager
def connect(address: str) -> Iterator[Client]:
    """A client of the scheduler at an address, or of a cluster on this machine; raises `WorkersError`."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise WorkersError("distributed is not installed; install pidcfg with its extra `cluster`") from None
    levels = _silenced()
    client = cluster = None
    try:
        if local := LOCAL.fullmatch(address):
            cluster = LocalCluster(
                n_workers=int(local[1]),
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        try:
            client = Client(cluster or address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError):
            cure = "start one by 'dask scheduler', and give the address that it prints"
            raise WorkersError(f"no scheduler answers at {address} within {CONNECT:g} s; {cure}") from None
        yield client
    finally:
        for opened in (client, cluster):
            if opened is not None:
                with suppress(Exception):  # what has gone already cannot be closed
                    opened.close(timeout=CONNECT)
        for log, level in levels.items():
            log.setLevel(level)


def _silenced() -> dict[logging.Logger, int]:
    """Dask's logs and the levels that they had; what matters of them is said by errors and remarks."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    levels = {log: log.level for log in map(logging.getLogger, ["distributed", *names])}
    for log in levels:
        log.setLevel(logging.CRITICAL)
    return levels


def cluster_results(
    job: Job, address: str, progress: Progress, samples: int, sizes: Sizes, remark: Callable[[str], None]
) -> Iterator[list[Tally | SampleResult]]:
    """What comes next in the order of the samples, whenever a block is ready; nothing, if it waits for an earlier one.

    Raises `WorkersError` when nobody is left to run them.
    """
    progress.trial.run(job, samples)
    mine = {**describe_machine(), "samples": progress.trial.digest}
    with connect(address) as client:
        yield from Fleet(client, job, address, samples, sizes, mine, remark).run(progress)


@dataclass(slots=True)
class Fleet:
    """The workers, and what each of them has to do."""

    client: Client
    job: Job
    address: str
    samples: int
    sizes: Sizes
    mine: dict[str, str]
    """What a worker is held against."""
    remark: Callable[[str], None]
    tasks: dict[str, Task] = field(default_factory=dict)
    """By worker."""
    workers: dict[str, str] = field(default_factory=dict)
    """By the key of the future that each works on."""
    fresh: int = 0
    """The first sample of the first block that nobody has had."""
    again: list[int] = field(default_factory=list)
    """Blocks whose workers went away."""
    accepted: set[str] = field(default_factory=set)
    refused: dict[str, str] = field(default_factory=dict)
    """Workers that are left out, and why."""
    ends: dict[int, int] = field(default_factory=dict)
    """How many workers have gone away with a block."""
    done: SimpleQueue[Future] = field(default_factory=SimpleQueue)
    looked: float = 0.0
    met: float = field(default_factory=time.monotonic)  # when there was a worker last

    def run(self, progress: Progress) -> Iterator[list[Tally | SampleResult]]:
        """All blocks that are missing."""
        due, ready = progress.tally.end, progress.ahead
        self.fresh = due
        begun: dict[int, list[SampleResult]] = {}
        while due < self.samples:
            self.look()
            self.hand_out(due, ready)
            for first, part in self.brought():
                if first < due or first in ready:
                    continue  # another worker was faster
                if isinstance(part, Tally):
                    ready[first] = part
                else:
                    begun[first] = part
                parts: list[Tally | SampleResult] = []
                while due in ready or due in begun:
                    parts += begun.pop(due) if due in begun else [ready.pop(due)]
                    due = self.end_of(due)
                yield parts

    def end_of(self, first: int) -> int:
        """Where the block of a sample ends."""
        return min((first // BLOCK_SAMPLES + 1) * BLOCK_SAMPLES, self.samples)

    def look(self) -> None:
        """Who is there: newcomers have their trial, and what the lost ones had is free again."""
        if time.monotonic() - self.looked < LOOK:
            return
        self.looked = time.monotonic()
        members = self.members()
        for worker in [worker for worker in self.tasks if worker not in members]:
            self.lose(worker)
        self.accepted &= members.keys()
        for worker, threads in members.items():
            if threads != 1:
                raise WorkersError(f"worker {worker} has {threads} threads; start it by '{self.start}'")
            if worker not in self.accepted and worker not in self.refused and worker not in self.tasks:
                self.submit(worker, None, trial_facts, self.job, self.samples)
        if members and members.keys() <= self.refused.keys():
            reasons = "; ".join(f"{worker}: {self.refused[worker]}" for worker in members)
            raise WorkersError(f"no worker calculates like this machine: {reasons}")
        if members:
            self.met = time.monotonic()
        elif time.monotonic() - self.met > PATIENCE:
            raise WorkersError(f"no worker is there for {PATIENCE:g} s; start some by '{self.start}'")

    @property
    def start(self) -> str:
        """The line that starts workers right."""
        return f"dask worker {self.client.scheduler.address} --nthreads 1 --nworkers N"

    def members(self) -> dict[str, int]:
        """The threads of each worker that the scheduler knows."""
        with suppress(OSError, RuntimeError, AttributeError):  # closed connections, and what a closed client raises
            if self.client.status == "running":
                return dict(self.client.nthreads())
        raise WorkersError(f"the scheduler at {self.address} went away")

    def lose(self, worker: str) -> None:
        """A worker went away, with what it had."""
        self.take_back(self.put_down(worker))

    def take_back(self, first: int | None) -> None:
        """A block that a worker did not end; raises `WorkersError` where it has ended too many of them."""
        if first is None:
            return
        self.again.append(first)
        self.ends[first] = self.ends.get(first, 0) + 1
        if self.ends[first] >= MOST_ENDS:
            last = self.end_of(first) - 1
            raise WorkersError(f"{MOST_ENDS} workers ended with samples {first} to {last}; see their logs")

    def hand_out(self, due: int, ready: dict[int, Tally]) -> None:
        """A block for each worker that has none: one that nobody has, else the first that one other has."""
        for worker in sorted(self.accepted - self.tasks.keys()):
            first = self.next_block(due, ready)
            if first is not None:
                self.submit(worker, first, run_block, self.job, first, self.end_of(first), self.sizes)

    def next_block(self, due: int, ready: dict[int, Tally]) -> int | None:
        """What is worth running next."""
        held = [task.first for task in self.tasks.values() if task.first is not None]
        while self.again:
            first = self.again.pop()
            if first >= due and first not in ready and first not in held:
                return first
        self.fresh = max(self.fresh, due)  # blocks that were ready went with the one that they waited for
        while self.fresh in ready:
            self.fresh = self.end_of(self.fresh)
        if self.fresh < self.samples and len(ready) <= BLOCKS_AHEAD * len(self.accepted):
            first, self.fresh = self.fresh, self.end_of(self.fresh)
            return first
        times = Counter(held)
        return min((first for first, times in times.items() if first >= due and times == 1), default=None)

    def put_down(self, worker: str) -> int | None:
        """Takes away what a worker has: a block's first sample, or None for a trial."""
        future, first = self.tasks.pop(worker)
        del self.workers[future.key]
        return first

    def submit(self, worker: str, first: int | None, function: Callable[..., Any], *arguments: Any) -> None:
        """Something for one worker and no other."""
        future = self.client.submit(function, *arguments, workers=[worker], allow_other_workers=False, pure=False)
        self.tasks[worker] = Task(future, first)
        self.workers[future.key] = worker
        future.add_done_callback(self.done.put)

    def brought(self) -> Iterator[tuple[int, Tally | list[SampleResult]]]:
        """Blocks that have come, after a wait of a second at most."""
        try:
            future = self.done.get(timeout=LOOK)
        except Empty:
            return
        worker = self.workers.get(future.key)
        if worker is None:
            return  # it was lost
        first = self.put_down(worker)
        try:
            result = future.result(timeout=CONNECT)
        except (TimeoutError, OSError, CancelledError) as error:
            if future.status == "error" and first is not None:
                raise WorkersError(f"worker {worker}: {type(error).__name__}: {error}") from None
            self.looked = 0.0  # it went away with what was ready
            self.take_back(first)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong on another machine
            problem = f"{type(error).__name__}: {error}"
            if first is not None:
                raise WorkersError(f"worker {worker}: {problem}") from None
            self.judge(worker, [f"it cannot run this pidcfg: {problem}"])
        else:
            if first is None:
                self.judge(worker, name_differences(self.mine, result))
            else:
                yield first, result

    def judge(self, worker: str, differs: list[str]) -> None:
        """What a worker's trial says: ``differs`` from this machine."""
        if differs:
            self.refused[worker] = "; ".join(differs)
            self.remark(f"worker {worker} is left out: {self.refused[worker]}")
            self.looked = 0.0
        else:
            self.accepted.add(worker)
