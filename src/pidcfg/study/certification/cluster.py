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


class KeptSampler(threading.local):
    """The job that a worker had last, and what runs its samples: one run, which no other thread may begin again."""

    job: Job | None = None
    sampler: Sampler | None = None


KEPT_SAMPLER = KeptSampler()


def _sampler_of(job: Job) -> Sampler:
    """What runs the samples in this thread."""
    if KEPT_SAMPLER.sampler is None or KEPT_SAMPLER.job != job:
        KEPT_SAMPLER.job, KEPT_SAMPLER.sampler = job, job.make_sampler()
    return KEPT_SAMPLER.sampler


def run_block(job: Job, first: int, end: int, sizes: Sizes) -> Tally | list[SampleResult]:
    """Samples of one block: counted, or one by one where their block has begun elsewhere."""
    sampler = _sampler_of(job)
    results = map(sampler.run_sample, range(first, end))
    if first % BLOCK_SAMPLES:
        return list(results)
    tally = Tally.empty(sizes, first)
    for result in results:
        tally.add_result(result, sampler.batch.varies)
    return tally


# --- Who runs the samples: the workers of a Dask cluster, each a block of 1,024 samples at a time ---------------------
#
# Before it gets a block, a worker runs the first samples of the batch, and its hash, its Python and its packages are
# held against those of this machine. Who differs is left out. A block whose worker goes away is handed to another
# one, and an idle worker also gets what a slow one has not brought yet; whoever brings a block first, it is the same
# block.

LOCAL_ADDRESS = re.compile(r"local:([1-9]\d{0,3})")
REMOTE_ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")
CONNECT_SECONDS, LOOK_SECONDS, PATIENCE_SECONDS = 10.0, 1.0, 60.0
"""Seconds: for a connection, between two looks at the workers, and until one must be there."""
BLOCKS_AHEAD = 4
"""Blocks for each worker that may be ready before an earlier one."""
MAX_WORKER_ENDS = 3
"""Workers that a block may end."""


class Task(NamedTuple):
    """A block that a worker has, or its trial."""

    future: Future
    first_sample: int | None
    """The block's first sample; None: the trial."""


def is_address(text: str) -> bool:
    """Whether a text names a cluster."""
    return bool(LOCAL_ADDRESS.fullmatch(text) or REMOTE_ADDRESS.fullmatch(text))


@contextmanager
def connect_client(address: str) -> Iterator[Client]:
    """A client of the scheduler at an address, or of a cluster on this machine; raises `WorkersError`."""
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise WorkersError("distributed is not installed; install pidcfg with its extra `cluster`") from None
    levels = _silence_logs()
    client = cluster = None
    try:
        if local := LOCAL_ADDRESS.fullmatch(address):
            cluster = LocalCluster(
                n_workers=int(local[1]),
                threads_per_worker=1,
                host="127.0.0.1",
                dashboard_address="127.0.0.1:0",
                silence_logs=logging.CRITICAL,
            )
        try:
            client = Client(cluster or address, timeout=CONNECT_SECONDS, set_as_default=False)
        except (OSError, ValueError):
            cure = "start one by 'dask scheduler', and give the address that it prints"
            raise WorkersError(f"no scheduler answers at {address} within {CONNECT_SECONDS:g} s; {cure}") from None
        yield client
    finally:
        for opened in (client, cluster):
            if opened is not None:
                with suppress(Exception):  # what has gone already cannot be closed
                    opened.close(timeout=CONNECT_SECONDS)
        for log, level in levels.items():
            log.setLevel(level)


def _silence_logs() -> dict[logging.Logger, int]:
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
    progress.trial.run_samples(job, samples)
    own_facts = {**describe_machine(), "samples": progress.trial.digest}
    with connect_client(address) as client:
        yield from Fleet(client, job, address, samples, sizes, own_facts, remark).run_blocks(progress)


@dataclass(slots=True)
class Fleet:
    """The workers, and what each of them has to do."""

    client: Client
    job: Job
    address: str
    samples: int
    sizes: Sizes
    local_facts: dict[str, str]
    """What a worker is held against."""
    remark: Callable[[str], None]
    tasks: dict[str, Task] = field(default_factory=dict)
    """By worker."""
    workers: dict[str, str] = field(default_factory=dict)
    """By the key of the future that each works on."""
    next_sample: int = 0
    """The first sample of the first block that nobody has had."""
    lost_blocks: list[int] = field(default_factory=list)
    """Blocks whose workers went away."""
    accepted_workers: set[str] = field(default_factory=set)
    refused_workers: dict[str, str] = field(default_factory=dict)
    """Workers that are left out, and why."""
    lost_workers: dict[int, int] = field(default_factory=dict)
    """How many workers have gone away with a block."""
    done_futures: SimpleQueue[Future] = field(default_factory=SimpleQueue)
    last_look_at: float = 0.0
    last_worker_at: float = field(default_factory=time.monotonic)  # when there was a worker last

    def run_blocks(self, progress: Progress) -> Iterator[list[Tally | SampleResult]]:
        """All blocks that are missing."""
        due, tallies = progress.tally.end, progress.early_blocks
        self.next_sample = due
        single_results: dict[int, list[SampleResult]] = {}
        while due < self.samples:
            self.look_at_workers()
            self.hand_blocks_out(due, tallies)
            for first, part in self.receive_blocks():
                if first < due or first in tallies:
                    continue  # another worker was faster
                if isinstance(part, Tally):
                    tallies[first] = part
                else:
                    single_results[first] = part
                parts: list[Tally | SampleResult] = []
                while due in tallies or due in single_results:
                    parts += single_results.pop(due) if due in single_results else [tallies.pop(due)]
                    due = self.block_end(due)
                yield parts

    def block_end(self, first: int) -> int:
        """Where the block of a sample ends."""
        return min((first // BLOCK_SAMPLES + 1) * BLOCK_SAMPLES, self.samples)

    def look_at_workers(self) -> None:
        """Who is there: newcomers have their trial, and what the lost ones had is free again."""
        if time.monotonic() - self.last_look_at < LOOK_SECONDS:
            return
        self.last_look_at = time.monotonic()
        members = self.worker_threads()
        for worker in [worker for worker in self.tasks if worker not in members]:
            self.lose_worker(worker)
        self.accepted_workers &= members.keys()
        for worker, threads in members.items():
            if threads != 1:
                raise WorkersError(f"worker {worker} has {threads} threads; start it by '{self.start_command}'")
            if worker not in self.accepted_workers and worker not in self.refused_workers and worker not in self.tasks:
                self.submit_task(worker, None, trial_facts, self.job, self.samples)
        if members and members.keys() <= self.refused_workers.keys():
            reasons = "; ".join(f"{worker}: {self.refused_workers[worker]}" for worker in members)
            raise WorkersError(f"no worker calculates like this machine: {reasons}")
        if members:
            self.last_worker_at = time.monotonic()
        elif time.monotonic() - self.last_worker_at > PATIENCE_SECONDS:
            raise WorkersError(f"no worker is there for {PATIENCE_SECONDS:g} s; start some by '{self.start_command}'")

    @property
    def start_command(self) -> str:
        """The line that starts workers right."""
        return f"dask worker {self.client.scheduler.address} --nthreads 1 --nworkers N"

    def worker_threads(self) -> dict[str, int]:
        """The threads of each worker that the scheduler knows."""
        with suppress(OSError, RuntimeError, AttributeError):  # closed connections, and what a closed client raises
            if self.client.status == "running":
                return dict(self.client.nthreads())
        raise WorkersError(f"the scheduler at {self.address} went away")

    def lose_worker(self, worker: str) -> None:
        """A worker went away, with what it had."""
        self.take_block_back(self.end_task(worker))

    def take_block_back(self, first: int | None) -> None:
        """A block that a worker did not end; raises `WorkersError` where it has ended too many of them."""
        if first is None:
            return
        self.lost_blocks.append(first)
        self.lost_workers[first] = self.lost_workers.get(first, 0) + 1
        if self.lost_workers[first] >= MAX_WORKER_ENDS:
            last = self.block_end(first) - 1
            raise WorkersError(f"{MAX_WORKER_ENDS} workers ended with samples {first} to {last}; see their logs")

    def hand_blocks_out(self, due: int, tallies: dict[int, Tally]) -> None:
        """A block for each worker that has none: one that nobody has, else the first that one other has."""
        for worker in sorted(self.accepted_workers - self.tasks.keys()):
            first = self.next_block(due, tallies)
            if first is not None:
                self.submit_task(worker, first, run_block, self.job, first, self.block_end(first), self.sizes)

    def next_block(self, due: int, tallies: dict[int, Tally]) -> int | None:
        """What is worth running next."""
        held_blocks = [task.first_sample for task in self.tasks.values() if task.first_sample is not None]
        while self.lost_blocks:
            first = self.lost_blocks.pop()
            if first >= due and first not in tallies and first not in held_blocks:
                return first
        self.next_sample = max(self.next_sample, due)  # blocks that were ready went with the one that they waited for
        while self.next_sample in tallies:
            self.next_sample = self.block_end(self.next_sample)
        if self.next_sample < self.samples and len(tallies) <= BLOCKS_AHEAD * len(self.accepted_workers):
            first, self.next_sample = self.next_sample, self.block_end(self.next_sample)
            return first
        times = Counter(held_blocks)
        return min((first for first, times in times.items() if first >= due and times == 1), default=None)

    def end_task(self, worker: str) -> int | None:
        """Takes away what a worker has: a block's first sample, or None for a trial."""
        future, first = self.tasks.pop(worker)
        del self.workers[future.key]
        return first

    def submit_task(self, worker: str, first: int | None, function: Callable[..., Any], *arguments: Any) -> None:
        """Something for one worker and no other."""
        future = self.client.submit(function, *arguments, workers=[worker], allow_other_workers=False, pure=False)
        self.tasks[worker] = Task(future, first)
        self.workers[future.key] = worker
        future.add_done_callback(self.done_futures.put)

    def receive_blocks(self) -> Iterator[tuple[int, Tally | list[SampleResult]]]:
        """Blocks that have come, after a wait of a second at most."""
        try:
            future = self.done_futures.get(timeout=LOOK_SECONDS)
        except Empty:
            return
        worker = self.workers.get(future.key)
        if worker is None:
            return  # it was lost
        first = self.end_task(worker)
        try:
            result = future.result(timeout=CONNECT_SECONDS)
        except (TimeoutError, OSError, CancelledError) as error:
            if future.status == "error" and first is not None:
                raise WorkersError(f"worker {worker}: {type(error).__name__}: {error}") from None
            self.last_look_at = 0.0  # it went away with what was ready
            self.take_block_back(first)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong on another machine
            problem = f"{type(error).__name__}: {error}"
            if first is not None:
                raise WorkersError(f"worker {worker}: {problem}") from None
            self.judge_worker(worker, [f"it cannot run this pidcfg: {problem}"])
        else:
            if first is None:
                self.judge_worker(worker, name_differences(self.local_facts, result))
            else:
                yield first, result

    def judge_worker(self, worker: str, differences: list[str]) -> None:
        """What a worker's trial says: ``differences`` from this machine."""
        if differences:
            self.refused_workers[worker] = "; ".join(differences)
            self.remark(f"worker {worker} is left out: {self.refused_workers[worker]}")
            self.last_look_at = 0.0
        else:
            self.accepted_workers.add(worker)
