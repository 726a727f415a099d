"""What a batch costs: time and memory over samples, steps and loops, and what Dask takes for a block.

`python tests/benchmarks/bench_certify.py [MOST]`: up to so many samples, 1,000 where nothing is said. Each row is a
process of its own, since memory is the most that it ever had. Times are those of the processor, in one process.
"""

from __future__ import annotations

import json
import logging
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Literal

import production
from twin import Twin, compiler

from pidcfg.sim.engine.choice import is_installed
from pidcfg.sim.judgement.meters import METRICS
from pidcfg.study.certification.cluster import run_block
from pidcfg.study.certification.samples import Job, run_sample
from pidcfg.study.certification.tally import BLOCK_SAMPLES, Tally
from pidcfg.text.reader import DEFAULT

ENGINE: Literal["python", "numba"] = "numba" if is_installed() else "python"
MOST = 1_000
ROUNDS, EACH = 7, 20
"""Rounds of so many samples."""
HAND_STEPS = 300_000
BLOCKS = 40
"""Whose way to a worker and back is measured."""
LOOP = """\
  - name: TIC-{n}
    mode: auto
    output_raises_pv: true
    sample_time: 1 s
    tuning: {{gain: 2.5, integral_time: 2 min, derivative_time: off}}
    pv: {{range: [0, 200]}}
    setpoint: {{value: 50, limits: [0, 200]}}
    output: {{range: [0, 100]}}
"""
PLANT = "  TIC-{n}: {{model: first_order, gain: 2, time_constant: 60, dead_time: 5, noise: 0.2}}\n"
SCENARIO = """\
pidcfg: 1
scenario: Steps of {loops} loops
config: loops.yaml
duration: {duration}
plants:
{plants}seed: 3
vary: {{plants: {{TIC-1: {{gain: ±30 %, time_constant: ±20 %}}}}}}
expect:
  - {{signal: TIC-1.PV, max: 100, share: 50 %}}
"""


def job_of(duration: int, loops: int) -> Job:
    """A batch of runs so long, with so many loops and noisy plants."""
    numbers = range(1, loops + 1)
    config = "pidcfg: 1\nvendor: generic\nloops:\n" + "".join(LOOP.format(n=n) for n in numbers)
    plants = "".join(PLANT.format(n=n) for n in numbers)
    scenario = SCENARIO.format(duration=duration, loops=loops, plants=plants)
    return Job("run.scenario.yaml", scenario, "loops.yaml", config.encode(), 3, ENGINE, DEFAULT)


def peak() -> float:
    """The most memory that this process has had, in MB; not a number where the system does not tell."""
    try:
        import resource
    except ImportError:
        return float("nan")
    kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return kilobytes / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def measured(samples: int, duration: int, loops: int) -> dict[str, float]:
    """Processor time of a sample in ms, without the first one, and the most memory in MB."""
    job = job_of(duration, loops)
    sampler = job.make_sampler()
    varies = sampler.batch.varies
    tally = Tally.empty((1, len(loops_kinds(job)), loops, len(varies)))
    tally.add_result(sampler.run_sample(0), varies)
    began = time.process_time()
    for sample in range(1, samples):
        tally.add_result(sampler.run_sample(sample), varies)
    return {"ms": (time.process_time() - began) / (samples - 1) * 1e3, "MB": peak()}


VARIED = "vary: {plants: {T1: {gain: ±30 %, time_constant: ±20 %}}}\n"


def vendor_job(vendor: str, steps: int) -> Job:
    """A batch of production runs of one loop, with noise and ten events of its set point."""
    text = production.scenario(vendor, 1, steps, noise=True) + VARIED
    return Job("s.yaml", text, "c.yaml", production.configuration(vendor, 1).encode(), 3, ENGINE, DEFAULT)


def sample_seconds(job: Job) -> float:
    """Processor time of a sample: the middle of some rounds."""
    sampler = job.make_sampler()
    sampler.run_sample(0)
    times = []
    for first in range(1, ROUNDS * EACH, EACH):
        began = time.process_time()
        for sample in range(first, first + EACH):
            sampler.run_sample(sample)
        times.append((time.process_time() - began) / EACH)
    return statistics.median(times)


def hand_seconds() -> float | None:
    """Processor time of a base step of the DL06 by hand in C, with noise; None: there is no C compiler."""
    if compiler() is None or ENGINE != "numba":
        return None
    case = production.loaded(
        production.configuration("dl06", 1), production.scenario("dl06", 1, HAND_STEPS, noise=True)
    )
    with tempfile.TemporaryDirectory() as folder:
        twin = Twin(Path(folder))
        return (
            statistics.median(twin.run(lambda: production.ours(case, "numba", judged=False)) for _ in range(ROUNDS))
            / HAND_STEPS
        )


def vendors() -> None:
    """A sample of each vendor, beside C."""
    hand = hand_seconds()
    print(f"\na sample of one loop with noise and {production.EVENTS} events; C takes of a DL06 the share behind it")
    for vendor in production.VENDORS:
        row = f"{vendor:9}"
        for steps in (601, 3_001, 30_001):
            took = sample_seconds(vendor_job(vendor, steps))
            beside = "" if hand is None else f" = C / {took / hand / steps:5.1f}"
            row += f"   {steps:>6,} steps {took * 1e3:7.2f} ms{beside}"
        print(row, flush=True)


def loops_kinds(job: Job) -> str:
    """A sign for each standing expectation of a run."""
    loaded, batch = job.load_batch()
    return run_sample(loaded, batch, 0, job.settings)[0].standing


def overhead() -> tuple[float, float, int] | None:
    """Seconds for a block there and back besides its samples, at best and in the middle, and its bytes as JSON.

    None: distributed is not installed.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        return None
    job, bare = job_of(60, 1), []
    sizes = (1, len(loops_kinds(job)), 1, 2)
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    options = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "silence_logs": logging.CRITICAL}
    with LocalCluster(n_workers=1, threads_per_worker=1, **options) as here, Client(here) as client:
        for first in range(0, (BLOCKS + 1) * BLOCK_SAMPLES, BLOCK_SAMPLES):
            began = time.perf_counter()
            block = client.submit(run_block, job, first, first + 1, sizes, pure=False).result()
            bare.append(time.perf_counter() - began)
        alone = [timed(job, first, sizes) for first in range(0, BLOCKS * BLOCK_SAMPLES, BLOCK_SAMPLES)]
    assert len(block.metrics[0]) == len(METRICS)
    middle = statistics.median(bare[1:]) - statistics.median(alone)
    return min(bare[1:]) - min(alone), middle, len(json.dumps(block.to_json()))


def timed(job: Job, first: int, sizes: tuple[int, int, int, int]) -> float:
    """Seconds of the same block here."""
    began = time.perf_counter()
    run_block(job, first, first + 1, sizes)
    return time.perf_counter() - began


def in_a_process(samples: int, duration: int, loops: int) -> dict[str, float]:
    """`measured` in a process of its own."""
    words = [sys.executable, str(Path(__file__)), "--row", str(samples), str(duration), str(loops)]
    found: dict[str, float] = json.loads(subprocess.run(words, capture_output=True, check=True, text=True).stdout)
    return found


def main(most: int = MOST) -> None:
    """Prints the curves."""
    rows = [(10**n, 600, 1) for n in range(2, len(str(most)))]
    rows += [(200, duration, 1) for duration in (600, 6_000, 60_000)] + [(200, 600, loops) for loops in (1, 4, 8, 16)]
    print(f"engine: {ENGINE}; base steps of 1 s")
    print(f"{'samples':>9} {'steps':>7} {'loops':>6} {'ms a sample':>12} {'ns a loop-step':>15} {'MB':>6}")
    for samples, duration, loops in rows:
        row = in_a_process(samples, duration, loops)
        each = row["ms"] * 1e6 / (duration + 1) / loops
        print(f"{samples:>9,} {duration + 1:>7,} {loops:>6} {row['ms']:>12.2f} {each:>15.0f} {row['MB']:>6.0f}")
    vendors()
    found = overhead()
    if found is not None:
        least, middle, size = found
        best, median = least * 1e3, middle * 1e3
        print(f"Dask: {best:.1f} ms at best, {median:.1f} ms in the middle, for the way of a block ({size:,} bytes)")


if __name__ == "__main__":
    if sys.argv[1:2] == ["--row"]:
        print(json.dumps(measured(*map(int, sys.argv[2:]))))
    else:
        main(*(int(word) for word in sys.argv[1:] if word != "--quick"))
