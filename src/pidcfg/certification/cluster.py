"""Who runs the samples: the workers of a Dask cluster, each a block of 1,024 samples at a time.

Before it gets a block, a worker runs the first samples of the batch, and its hash, its Python and its packages are held
against those of this machine. Who differs is left out. A block whose worker goes away is handed to another one, and an
idle worker also gets what a slow one has not brought yet; whoever brings a block first, it is the same block.
"""

from __future__ import annotations

import logging
import re
import time
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import lru_cache
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, NamedTuple

from pidcfg.certification.histogram import BLOCK
from pidcfg.certification.run import run_sample
from pidcfg.certification.tally import Tally
from pidcfg.certification.trial import differences, facts, machine
from pidcfg.certification.workers import WorkersError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from distributed import Client, Future

    from pidcfg.certification.run import Seen
    from pidcfg.certification.sample import Batch
    from pidcfg.certification.state import Progress
    from pidcfg.certification.tally import Sizes
    from pidcfg.certification.workers import Job
    from pidcfg.scenario.load import Loaded

LOCAL = re.compile(r"local:([1-9]\d{0,3})")
REMOTE = re.compile(r"(tcp|tls)://\S+:\d+")
CONNECT, LOOK, PATIENCE = 10.0, 1.0, 60.0
"""Seconds: for a connection, between two looks at the workers, and until one must be there."""
AHEAD = 4
"""Blocks for each worker that may be ready before an earlier one."""
MOST_ENDS = 3
"""Workers that a block may end."""
START = "dask worker {} --nthreads 1 --nworkers N"
"""What starts N workers right."""


class Task(NamedTuple):
    """A block that a worker has, or its trial."""

    future: Future
    first: int | None
    """The block's first sample; None: the trial."""


# --- on a worker -----------------------------------------------------------------------------------------------------


@lru_cache(maxsize=1)
def _loaded(job: Job) -> tuple[Loaded, Batch]:
    """What this worker runs."""
    return job.loaded()


def run_block(job: Job, first: int, end: int, sizes: Sizes) -> Tally | list[Seen]:
    """Samples of one block: counted, or one by one where their block has begun elsewhere."""
    loaded, batch = _loaded(job)
    seen = (run_sample(loaded, batch, sample, job.settings)[0] for sample in range(first, end))
    if first % BLOCK:
        return list(seen)
    tally = Tally.empty(sizes, first)
    for one in seen:
        tally.add(one, batch.varies)
    return tally


# --- on the client ---------------------------------------------------------------------------------------------------


def is_address(text: str) -> bool:
    """Whether a text names a cluster."""
    return bool(LOCAL.fullmatch(text) or REMOTE.fullmatch(text))


@contextmanager
def connected(address: str) -> Iterator[Client]:
    """A client of the scheduler at an address, or of a cluster on this machine; raises `WorkersError`."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise WorkersError("distributed is not installed; install pidcfg with its extra `cluster`") from None
    log = logging.getLogger("distributed")
    level = log.level
    log.setLevel(logging.CRITICAL)  # what matters of it is said by errors and remarks
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
        log.setLevel(level)


def results(
    job: Job, address: str, progress: Progress, samples: int, sizes: Sizes, remark: Callable[[str], None]
) -> Iterator[list[Tally | Seen]]:
    """What comes next in the order of the samples, whenever a block is ready; nothing, if it waits for an earlier one.

    Raises `WorkersError` when nobody is left to run them.
    """
    progress.trial.run(job, samples)
    mine = {**machine(), "samples": progress.trial.digest}
    with connected(address) as client:
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
    accepted: set[str] = field(default_factory=set)
    refused: dict[str, str] = field(default_factory=dict)
    """Workers that are left out, and why."""
    ends: dict[int, int] = field(default_factory=dict)
    """How many workers have gone away with a block."""
    done: SimpleQueue[Future] = field(default_factory=SimpleQueue)
    looked: float = 0.0
    met: float = field(default_factory=time.monotonic)
    """When there was a worker last."""

    def run(self, progress: Progress) -> Iterator[list[Tally | Seen]]:
        """All blocks that are missing."""
        due, ready = progress.tally.end, progress.ahead
        begun: dict[int, list[Seen]] = {}
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
                parts: list[Tally | Seen] = []
                while due in ready or due in begun:
                    parts += begun.pop(due) if due in begun else [ready.pop(due)]
                    due = self.end_of(due)
                yield parts

    def end_of(self, first: int) -> int:
        """Where the block of a sample ends."""
        return min((first // BLOCK + 1) * BLOCK, self.samples)

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
                right = START.format(self.client.scheduler.address)
                raise WorkersError(f"worker {worker} has {threads} threads; start it by '{right}'")
            if worker not in self.accepted and worker not in self.refused and worker not in self.tasks:
                self.submit(worker, None, facts, self.job, self.samples)
        if members and members.keys() <= self.refused.keys():
            reasons = "; ".join(f"{worker}: {self.refused[worker]}" for worker in members)
            raise WorkersError(f"no worker calculates like this machine: {reasons}")
        if members:
            self.met = time.monotonic()
        elif time.monotonic() - self.met > PATIENCE:
            right = START.format(self.client.scheduler.address)
            raise WorkersError(f"no worker is there for {PATIENCE:g} s; start some by '{right}'")

    def members(self) -> dict[str, int]:
        """The threads of each worker that the scheduler knows."""
        with suppress(OSError, RuntimeError, AttributeError):  # closed connections, and what a closed client raises
            if self.client.status == "running":
                return dict(self.client.nthreads())
        raise WorkersError(f"the scheduler at {self.address} went away")

    def lose(self, worker: str) -> None:
        """A worker went away, with what it had."""
        first = self.tasks.pop(worker).first
        if first is not None:
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
        held = [task.first for task in self.tasks.values()]
        first, most = due, AHEAD * len(self.accepted)
        while first < self.samples and len(ready) <= most:
            if first not in held and first not in ready:
                return first
            first = self.end_of(first)
        return min((one for one in held if one is not None and one >= due and held.count(one) == 1), default=None)

    def submit(self, worker: str, first: int | None, function: Callable[..., Any], *arguments: Any) -> None:
        """Something for one worker and no other."""
        future = self.client.submit(function, *arguments, workers=[worker], allow_other_workers=False, pure=False)
        self.tasks[worker] = Task(future, first)
        future.add_done_callback(self.done.put)

    def brought(self) -> Iterator[tuple[int, Tally | list[Seen]]]:
        """Blocks that have come, after a wait of a second at most."""
        try:
            future = self.done.get(timeout=LOOK)
        except Empty:
            return
        worker = next((worker for worker, task in self.tasks.items() if task.future.key == future.key), None)
        if worker is None:
            return  # it was lost
        first = self.tasks.pop(worker).first
        if future.status == "cancelled":
            self.looked = 0.0
        elif first is None:
            self.judge(worker, future)
        elif future.status == "error":
            error = future.exception()
            raise WorkersError(f"worker {worker}: {type(error).__name__}: {error}")
        else:
            yield first, future.result()

    def judge(self, worker: str, future: Future) -> None:
        """What a worker's trial says."""
        if future.status == "error":
            error = future.exception()
            differs = [f"it cannot run this pidcfg: {type(error).__name__}: {error}"]
        else:
            differs = differences(self.mine, future.result())
        if differs:
            self.refused[worker] = "; ".join(differs)
            self.remark(f"worker {worker} is left out: {self.refused[worker]}")
            self.looked = 0.0
        else:
            self.accepted.add(worker)
