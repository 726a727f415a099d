"""Who runs the samples: this process, or several, whose results come back in the order of the samples."""

from __future__ import annotations

import pickle
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from pidcfg.certification.fan import SAMPLES, Fan, Thinned, fan_of
from pidcfg.certification.run import Seen, run_sample
from pidcfg.certification.sample import Batch
from pidcfg.processes import AHEAD, Crew
from pidcfg.scenario.axes import axes_of, signals_of
from pidcfg.scenario.load import Loaded, load
from pidcfg.sim.report import rounded
from pidcfg.sim.run import Settings
from pidcfg.source import read_document

if TYPE_CHECKING:
    from array import array
    from collections.abc import Callable, Iterator

    from pidcfg.limits import Limits

UNIT = 8
"""Samples that a process takes at a time."""


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
            for part in Crew(jobs, _runner, (job,)).results(parts(first, samples)):
                yield from part
                first += len(part)
        except ChildProcessError:
            if first == before:
                last = min(first + jobs * AHEAD * UNIT, samples) - 1
                why = "perhaps for want of memory, of which fewer --jobs need less"
                raise WorkersError(f"a process ended at samples {first} to {last}, {why}") from None


def parts(first: int, samples: int) -> Iterator[range]:
    """What a process takes at a time."""
    return (range(begin, min(begin + UNIT, samples)) for begin in range(first, samples, UNIT))


def _runner(job: Job) -> Callable[[range], list[Seen]]:
    """What runs samples one after the other."""
    loaded, batch = job.loaded()
    return lambda samples: [run_sample(loaded, batch, i, job.settings)[0] for i in samples]


def recordings(job: Job, samples: int, jobs: int) -> Fan:
    """How the signals that a picture needs spread over the first samples; those that cannot run are left out."""
    samples = min(samples, SAMPLES)
    if jobs == 1 or samples <= UNIT:
        kept = _recorder(job)(range(samples))
    else:
        kept = [one for part in Crew(jobs, _recorder, (job,)).results(parts(0, samples)) for one in part]
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


def _recorder(job: Job) -> Callable[[range], list[Recorded | None]]:
    """What records samples one after the other."""
    loaded, batch = job.loaded()
    return lambda samples: [_record(loaded, batch, i, job.settings) for i in samples]
