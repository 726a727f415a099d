"""``pidcfg certify --cluster``: the same bytes whoever runs the blocks, and who may."""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import pytest

import pidcfg
from certify_rig import files, scenario
from pidcfg.output.arguments import ArgumentError
from pidcfg.study.certification import certify as certify_module
from pidcfg.study.certification import cluster, tally
from pidcfg.study.certification import cluster as blocks
from pidcfg.study.certification import samples as trial
from pidcfg.study.certification import tally as state
from pidcfg.study.certification.samples import WorkersError

distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

SMALL = 16
SAMPLES = 100
NOISY = scenario().replace("gain: 2}", "gain: 2, noise: 1}")
FOLDER = Path(__file__).parent
HERE = {"processes": False, "protocol": "tcp://", "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
"""Workers that are threads of this process, on loopback."""
LATER: list[int] = []
RAN: list[tuple[object, int]] = []
"""Which worker has had which block."""
GO_ON = threading.Event()
"""What a slow worker waits for."""


def certify(address, samples=SAMPLES, **settings):
    """The result as JSON."""
    settings = {"samples": samples, "cluster": address, "files": files(NOISY), "keep_worst": 5, **settings}
    return pidcfg.certify(Path("run.scenario.yaml"), **settings).to_json()


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    """Many blocks, and no long waits."""
    for module in (blocks, cluster, state, tally):
        monkeypatch.setattr(module, "BLOCK_SAMPLES", SMALL)
    monkeypatch.setattr(certify_module, "SAVE_SECONDS", 0)
    monkeypatch.setattr(cluster, "LOOK_SECONDS", 0.05)
    RAN.clear()
    GO_ON.clear()
    yield
    GO_ON.set()


@pytest.fixture(scope="module")
def two():
    """The address of a scheduler with two workers, which are threads of this process."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **HERE) as here:
        yield here.scheduler_address


@pytest.fixture
def alone():
    """What one process gives, in the same blocks."""
    return certify(None, jobs=1)


def name():
    """Of the worker that runs this."""
    return distributed.get_worker().name


def spied(job, first, end, sizes):
    """Notes who runs a block."""
    RAN.append((name(), first))
    return REAL_BLOCK(job, first, end, sizes)


def noted(job, first, end, sizes):
    """Notes a block in a list that no run before it writes to."""
    LATER.append(first)
    return REAL_BLOCK(job, first, end, sizes)


def held_up(job, first, end, sizes):
    """The first worker never comes to an end by itself."""
    if name() == 0:
        GO_ON.wait(60)
    return spied(job, first, end, sizes)


def another_numba(job, samples):
    """The second worker has another version."""
    found = REAL_FACTS(job, samples)
    return found | {"numba": "0.1"} if name() == 1 else found


def other_digits(job, samples):
    """No worker calculates like this machine."""
    return REAL_FACTS(job, samples) | {"samples": "0" * 64}


def missing(job, samples):
    """The workers cannot even begin."""
    raise ModuleNotFoundError("No module named 'pidcfg'")


def wrong(job, first, end, sizes):
    """A mistake on the worker."""
    raise MemoryError("no room")


REAL_BLOCK, REAL_FACTS = cluster.run_block, trial.trial_facts

# --- the same bytes --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("samples", [5, 16, SAMPLES])
def test_a_cluster_gives_what_one_process_gives(two, samples, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", spied)
    shares = []
    text = NOISY.replace("90 %", "4 %")
    found = certify(two, samples, files=files(text), progress=shares.append)
    assert found == certify(None, samples, files=files(text))
    assert {first for _, first in RAN} == set(range(0, samples, SMALL))
    assert (shares, shares[-1]) == (sorted(shares), 1)


def test_each_thread_has_a_run_of_its_own_and_keeps_it():
    """Two workers may be threads of one process: a run that both begin again would mix their samples."""
    job, seen = SimpleNamespace(make_sampler=object), []

    def ask():
        seen.append([cluster._sampler_of(job), cluster._sampler_of(job)])

    for thread in [threading.Thread(target=ask) for _ in range(2)]:
        thread.start()
        thread.join()
    (one, again), (other, _) = seen
    assert one is again
    assert one is not other


def test_a_batch_goes_on_from_one_to_the_other(two, alone):
    text = files(NOISY.replace("90 %", "4 %"))
    whole = certify(None, files=text)
    for first, second in ((None, two), (two, None), (two, two)):
        kept = []
        certify(first, 40, files=text, keep=kept.append)
        assert certify(second, files=text, state=kept[-1]) == whole
    assert alone["expectations"] == [one | {"wanted": 90.0} for one in whole["expectations"]]


def test_blocks_that_are_ready_too_early_are_kept(two, alone, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", held_up)
    monkeypatch.setattr(cluster.Fleet, "next_block", without_doubles)
    kept = []

    def keep(data):
        kept.append(data)
        if len(kept) == 4:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        certify(two, keep=keep)
    GO_ON.set()
    stopped = json.loads(kept[-1].splitlines()[1])
    done = stopped["tally"]["samples"] // SMALL
    ready = [block["first"] // SMALL for block in stopped["ahead"]]
    assert (done + len(ready), done not in ready) == (4, True)
    assert ready
    LATER.clear()
    monkeypatch.setattr(cluster, "run_block", noted)
    assert certify(two, state=kept[-1]) == alone
    assert {first // SMALL for first in LATER} == set(range(7)) - {*range(done), *ready}


def test_a_block_that_went_with_an_earlier_one_is_not_run_again():
    """One worker had the first block while four after it were ready, and nobody asked in between."""
    fleet = cluster.Fleet(None, None, "", SAMPLES, None, {}, print, accepted_workers={"one", "two"})
    four = dict.fromkeys(range(SMALL, 5 * SMALL, SMALL))
    assert fleet.next_block(0, four) == 0
    assert fleet.next_block(5 * SMALL, {}) == 5 * SMALL


def without_doubles(self, due, ready):
    """As if nobody helped a slow worker."""
    first = REAL_NEXT(self, due, ready)
    return None if first in [task.first_sample for task in self.tasks.values()] else first


REAL_NEXT = cluster.Fleet.next_block


def test_a_slow_worker_keeps_nobody_waiting(two, alone, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", held_up)
    assert certify(two) == alone
    assert {worker for worker, _ in RAN} == {1}
    assert not GO_ON.is_set()


# --- who may ---------------------------------------------------------------------------------------------------------


def test_a_worker_with_another_version_is_left_out(two, alone, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", spied)
    monkeypatch.setattr(cluster, "trial_facts", another_numba)
    remarks = []
    assert certify(two, remark=remarks.append) == alone
    assert {worker for worker, _ in RAN} == {0}
    (remark,) = remarks
    assert remark.startswith("worker tcp://127.0.0.1:")
    assert f"is left out: numba 0.1 and not {trial.describe_machine()['numba']}" in remark


@pytest.mark.parametrize(
    ("trial_of_workers", "reason"),
    [(other_digits, "samples 000000000000… and not "), (missing, "it cannot run this pidcfg: ModuleNotFoundError")],
)
def test_where_nobody_calculates_alike_nothing_runs(two, trial_of_workers, reason, monkeypatch):
    monkeypatch.setattr(cluster, "trial_facts", trial_of_workers)
    monkeypatch.setattr(cluster, "run_block", spied)
    with pytest.raises(WorkersError, match="no worker calculates like this machine: ") as refused:
        certify(two)
    assert str(refused.value).count(reason) == 2
    assert RAN == []


def test_what_goes_wrong_on_a_worker_is_told(two, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", wrong)
    with pytest.raises(WorkersError, match=r"worker tcp://127\.0\.0\.1:\d+: MemoryError: no room"):
        certify(two)


def test_a_worker_with_two_threads_is_refused():
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, **HERE) as here,
        pytest.raises(WorkersError, match=rf"2 threads; start it by 'dask worker {here.scheduler_address} "),
    ):
        certify(here.scheduler_address)


def test_no_scheduler_and_no_workers(monkeypatch):
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.3)
    monkeypatch.setattr(cluster, "PATIENCE_SECONDS", 0.3)
    with pytest.raises(WorkersError, match=r"no scheduler answers at tcp://127\.0\.0\.1:9 "):
        certify("tcp://127.0.0.1:9")
    with (
        distributed.LocalCluster(n_workers=0, **HERE) as here,
        pytest.raises(WorkersError, match=r"no worker is there for 0\.3 s; start some by 'dask worker tcp://"),
    ):
        certify(here.scheduler_address)


@pytest.mark.parametrize("address", ["", "host", "host:8786", "local", "local:0", "local:x", "tcp://host", "udp://a:1"])
def test_what_is_no_address_is_refused(address):
    with pytest.raises(ArgumentError, match="local:2 for two workers here"):
        certify(address)


# --- who goes away ---------------------------------------------------------------------------------------------------


def test_a_killed_worker_costs_nothing_but_time(alone):
    settings = HERE | {"processes": True, "preload": [str(FOLDER / "small_blocks.py")]}
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **settings) as here:
        processes = [one.pid for one in here.workers.values()]
        kept = []

        def keep(data):
            kept.append(data)
            if len(kept) == 1:
                os.kill(processes[0], signal.SIGKILL)

        assert certify(here.scheduler_address, keep=keep) == alone


ELSEWHERE = """\
import time
from distributed import LocalCluster
import small_blocks, test_cluster
here = LocalCluster(n_workers=1, threads_per_worker=1, **test_cluster.HERE)
print(here.scheduler_address, flush=True)
time.sleep(100)
"""


def test_a_scheduler_that_goes_away_is_named_and_what_is_ready_is_kept(alone):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    there = subprocess.Popen([sys.executable, "-c", ELSEWHERE], stdout=subprocess.PIPE, text=True, env=environment)
    kept, loud = [], []

    def keep(data):
        kept.append(data)
        names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
        if len(kept) <= 2:
            loud.extend(name for name in names if logging.getLogger(name).isEnabledFor(logging.ERROR))
        if len(kept) == 2:
            there.kill()

    try:
        address = there.stdout.readline().strip()
        with pytest.raises(WorkersError, match=f"the scheduler at {address} went away"):
            certify(address, keep=keep)
    finally:
        there.kill()
        there.wait()
        there.stdout.close()
    assert len(kept) == 3  # the last one when it was gone
    assert not loud, "Dask's own log is no part of what the command says"
    assert logging.getLogger("distributed.client").level != logging.CRITICAL
    assert certify(None, state=kept[-1]) == alone


# --- a fleet without a cluster ---------------------------------------------------------------------------------------


class Fake:
    """A client whose workers do nothing by themselves, and a clock that stands."""

    def __init__(self, monkeypatch, samples=100):
        self.status, self.scheduler, self.now = "running", SimpleNamespace(address="tcp://s:1"), 100.0
        self.threads, self.sent, self.remarks = {"a": 1, "b": 1}, [], []
        monkeypatch.setattr(cluster, "time", SimpleNamespace(monotonic=lambda: self.now))
        self.fleet = cluster.Fleet(self, "job", "tcp://s:1", samples, (1, 2, 3, 4), {"x": "1"}, self.remarks.append)
        self.fleet.last_worker_at = self.now

    def nthreads(self):
        """Threads by worker."""
        return self.threads

    def submit(self, function, *arguments, workers, allow_other_workers, pure):
        """Notes what a worker has to do."""
        assert not allow_other_workers
        assert not pure
        self.sent.append((function, arguments, workers))
        return SimpleNamespace(key=f"k{len(self.sent)}", add_done_callback=lambda _: None)

    def has(self, worker, first):
        """A worker has a block."""
        self.fleet.submit_task(worker, first, spied)
        return self.fleet.tasks[worker].future

    def brings(self, worker, first, result=None, error=None, status="finished"):
        """What comes of a block, or of a trial, of a worker."""

        def given(timeout):
            assert timeout == cluster.CONNECT_SECONDS
            if error is not None:
                raise error
            return result

        future = self.has(worker, first)
        future.result, future.status = given, status
        self.fleet.done_futures.put(future)
        return list(self.fleet.receive_blocks())


@pytest.fixture
def fake(monkeypatch):
    return Fake(monkeypatch)


def test_where_a_block_ends(fake):
    assert [fake.fleet.block_end(first) for first in (0, 15, 16, 95, 96, 99)] == [16, 16, 32, 96, 100, 100]


def test_blocks_are_handed_out_one_after_the_other_and_then_once_more(fake):
    fleet = fake.fleet
    fleet.accepted_workers = {"a", "b"}
    assert [fleet.next_block(0, {}) for _ in range(8)] == [0, 16, 32, 48, 64, 80, 96, None]
    fake.has("a", 32)
    assert [fleet.next_block(due, {}) for due in (0, 32, 33)] == [32, 32, None]
    fake.has("b", 16)
    assert [fleet.next_block(due, {}) for due in (0, 16, 17)] == [16, 16, 32]
    fake.has("c", 16)
    assert fleet.next_block(0, {}) == 32
    fleet.lost_blocks = [64, 0, 48, 32]
    assert fleet.next_block(16, {48: None}) == 64
    assert fleet.lost_blocks == []
    fleet.lost_blocks = [16 + 64]
    assert fleet.next_block(80, {}) == 80


def test_no_more_than_four_blocks_a_worker_are_ready_before_an_earlier_one(fake):
    fleet = fake.fleet
    fleet.accepted_workers, fleet.next_sample = {"a"}, 16
    assert fleet.next_block(0, dict.fromkeys((16, 32, 48, 64))) == 80
    assert fleet.next_sample == 96
    fleet.next_sample = 16
    assert fleet.next_block(0, dict.fromkeys((16, 32, 48, 64, 80))) is None


def test_a_block_goes_to_an_accepted_worker_that_has_none(fake):
    fleet = fake.fleet
    fleet.accepted_workers = {"a", "b", "c"}
    fake.has("b", 96)
    fake.sent.clear()
    fleet.next_sample = 64
    fleet.hand_blocks_out(0, {})
    sizes = (1, 2, 3, 4)
    assert fake.sent == [
        (cluster.run_block, ("job", 64, 80, sizes), ["a"]),
        (cluster.run_block, ("job", 80, 96, sizes), ["c"]),
    ]
    assert {worker: task.first_sample for worker, task in fleet.tasks.items()} == {"a": 64, "b": 96, "c": 80}


def test_a_block_that_three_workers_end_with_is_named(fake):
    for worker in ("a", "b"):
        fake.has(worker, 96)
        fake.fleet.lose_worker(worker)
    assert (fake.fleet.lost_blocks, fake.fleet.lost_workers) == ([96, 96], {96: 2})
    fake.has("a", None)
    fake.fleet.lose_worker("a")
    assert (fake.fleet.lost_workers, fake.fleet.tasks, fake.fleet.workers) == ({96: 2}, {}, {})
    fake.has("c", 96)
    with pytest.raises(WorkersError, match="3 workers ended with samples 96 to 99; see their logs"):
        fake.fleet.lose_worker("c")


def test_a_block_that_three_workers_do_not_hand_over_is_named(fake):
    for worker in ("a", "b"):
        assert fake.brings(worker, 96, error=TimeoutError()) == []
    with pytest.raises(WorkersError, match="3 workers ended with samples 96 to 99; see their logs"):
        fake.brings("c", 96, error=TimeoutError())


def test_newcomers_have_their_trial_and_the_lost_are_missed(fake):
    fleet = fake.fleet
    fleet.look_at_workers()
    assert fake.sent == [(cluster.trial_facts, ("job", 100), [worker]) for worker in ("a", "b")]
    fake.threads["c"] = 1
    fake.now += 0.04
    fleet.look_at_workers()
    assert len(fake.sent) == 2, "it has just looked"
    fleet.end_task("a")
    fleet.accepted_workers = {"a", "gone"}
    fleet.refused_workers = {"c": "why"}
    del fake.threads["b"]
    fake.now += 0.05
    fleet.look_at_workers()
    assert (len(fake.sent), fleet.accepted_workers, fleet.tasks) == (2, {"a"}, {})
    fake.threads["d"] = 2
    fake.now += 1
    start = "dask worker tcp://s:1 --nthreads 1 --nworkers N"
    with pytest.raises(WorkersError, match=f"worker d has 2 threads; start it by '{start}'"):
        fleet.look_at_workers()


def test_nobody_is_waited_for_longer_than_a_minute(fake):
    fake.threads.clear()
    fake.now += 60.0
    fake.fleet.look_at_workers()
    fake.threads["a"] = 1
    fake.now += 1.0
    fake.fleet.look_at_workers()
    fake.threads.clear()
    fake.now += 60.0
    fake.fleet.look_at_workers()
    fake.now += 0.1
    with pytest.raises(WorkersError, match="no worker is there for 60 s; start some by 'dask worker tcp://s:1 "):
        fake.fleet.look_at_workers()
    fake.status = "closed"
    with pytest.raises(WorkersError, match="the scheduler at tcp://s:1 went away"):
        fake.fleet.worker_threads()


def test_workers_that_are_all_left_out_are_the_end(fake):
    fake.fleet.refused_workers = {"a": "one", "b": "two", "gone": "three"}
    with pytest.raises(WorkersError, match=r"no worker calculates like this machine: a: one; b: two$"):
        fake.fleet.look_at_workers()
    fake.fleet.refused_workers.pop("a")
    fake.now += 1.0
    fake.fleet.look_at_workers()
    assert [workers for *_, workers in fake.sent] == [["a"]]


def test_what_a_worker_brings(fake):
    fleet, lost = fake.fleet, ConnectionError("lost")
    assert fake.brings("a", 16, "block") == [(16, "block")]
    assert fake.brings("a", None, {"x": "1"}) == []
    assert (fleet.accepted_workers, fleet.refused_workers, fake.remarks) == ({"a"}, {}, [])
    fleet.last_look_at = 7.0
    assert fake.brings("b", None, {"x": "2"}) == []
    assert (fleet.accepted_workers, fleet.refused_workers, fleet.last_look_at) == ({"a"}, {"b": "x 2 and not 1"}, 0.0)
    assert fake.remarks == ["worker b is left out: x 2 and not 1"]
    assert fake.brings("c", None, error=ModuleNotFoundError("no pidcfg")) == []
    assert fleet.refused_workers["c"] == "it cannot run this pidcfg: ModuleNotFoundError: no pidcfg"
    fleet.last_look_at = 7.0
    assert fake.brings("a", 32, error=lost, status="lost") == []
    assert (fleet.lost_blocks, fleet.last_look_at) == ([32], 0.0)
    assert fake.brings("a", None, error=lost, status="error") == []
    assert (fleet.lost_blocks, fleet.tasks, fleet.workers) == ([32], {}, {})
    for error, status in ((lost, "error"), (MemoryError("no room"), "error")):
        with pytest.raises(WorkersError, match=f"worker a: {type(error).__name__}: {error}"):
            fake.brings("a", 32, error=error, status=status)
    fleet.done_futures.put(SimpleNamespace(key="of one that was lost"))
    assert list(fleet.receive_blocks()) == []
    assert list(fleet.receive_blocks()) == []


def test_a_block_that_comes_twice_counts_once_and_an_early_one_waits(fake, monkeypatch):
    tallies = {first: tally.Tally(first=first) for first in (0, 16, 32)}
    coming = [[(16, tallies[16])], [(16, "late")], [(0, ["samples"]), (32, tallies[32])]]
    monkeypatch.setattr(cluster.Fleet, "look_at_workers", lambda _: None)
    monkeypatch.setattr(cluster.Fleet, "receive_blocks", lambda _: coming.pop(0))
    fake.fleet.samples = 48
    progress = SimpleNamespace(tally=SimpleNamespace(end=0), early_blocks={})
    assert list(fake.fleet.run_blocks(progress)) == [[], ["samples", tallies[16]], [tallies[32]]]
    assert coming == []
    assert progress.early_blocks == {}


def test_a_local_cluster_has_workers_of_one_thread(monkeypatch):
    opened = []

    def noted(*words, **settings):
        opened.append((words, settings))
        return SimpleNamespace(close=lambda **how: opened.append(how))

    monkeypatch.setattr(distributed, "LocalCluster", noted)
    monkeypatch.setattr(distributed, "Client", noted)
    with cluster.connect_client("local:3"):
        pass
    (_, local), ((given,), settings), *closed = opened
    assert (local["n_workers"], local["threads_per_worker"], local["host"]) == (3, 1, "127.0.0.1")
    assert hasattr(given, "close")
    assert settings == {"timeout": 10.0, "set_as_default": False}
    assert closed == [{"timeout": 10.0}] * 2
    with cluster.connect_client("tcp://s:1"):
        pass
    assert opened[-2][0] == ("tcp://s:1",)
