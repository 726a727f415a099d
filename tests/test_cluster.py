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

import pytest

import pidcfg
from certify_rig import files, scenario
from pidcfg.certification import blocks, cluster, state, tally, trial
from pidcfg.certification import certify as certify_module
from pidcfg.certification.workers import WorkersError
from pidcfg.results.arguments import ArgumentError

distributed = pytest.importorskip("distributed", reason="the extra `cluster` is not installed")

SMALL = 16
SAMPLES = 100
NOISY = scenario().replace("gain: 2}", "gain: 2, noise: 1}")
FOLDER = Path(__file__).parent
HERE = {"processes": False, "protocol": "tcp://", "host": "127.0.0.1", "dashboard_address": "127.0.0.1:0"}
"""Workers that are threads of this process, on loopback."""
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
        monkeypatch.setattr(module, "BLOCK", SMALL)
    monkeypatch.setattr(certify_module, "KEPT_AFTER", 0)
    monkeypatch.setattr(cluster, "LOOK", 0.05)
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


REAL_BLOCK, REAL_FACTS = cluster.run_block, trial.facts

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
    RAN.clear()
    monkeypatch.setattr(cluster, "run_block", spied)
    assert certify(two, state=kept[-1]) == alone
    assert {first // SMALL for _, first in RAN} == set(range(7)) - {*range(done), *ready}


def without_doubles(self, due, ready):
    """As if nobody helped a slow worker."""
    first = REAL_NEXT(self, due, ready)
    return None if first in [task.first for task in self.tasks.values()] else first


REAL_NEXT = cluster.Fleet.next_block


def test_a_slow_worker_keeps_nobody_waiting(two, alone, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", held_up)
    assert certify(two) == alone
    assert {worker for worker, _ in RAN} == {1}
    assert not GO_ON.is_set()


# --- who may ---------------------------------------------------------------------------------------------------------


def test_a_worker_with_another_version_is_left_out(two, alone, monkeypatch):
    monkeypatch.setattr(cluster, "run_block", spied)
    monkeypatch.setattr(cluster, "facts", another_numba)
    remarks = []
    assert certify(two, remark=remarks.append) == alone
    assert {worker for worker, _ in RAN} == {0}
    (remark,) = remarks
    assert remark.startswith("worker tcp://127.0.0.1:")
    assert f"is left out: numba 0.1 and not {trial.machine()['numba']}" in remark


@pytest.mark.parametrize(
    ("trial_of_workers", "reason"),
    [(other_digits, "samples 000000000000… and not "), (missing, "it cannot run this pidcfg: ModuleNotFoundError")],
)
def test_where_nobody_calculates_alike_nothing_runs(two, trial_of_workers, reason, monkeypatch):
    monkeypatch.setattr(cluster, "facts", trial_of_workers)
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
    monkeypatch.setattr(cluster, "CONNECT", 0.3)
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
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
