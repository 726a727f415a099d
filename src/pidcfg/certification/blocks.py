"""What a worker of a cluster does: the samples of one block, counted."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from pidcfg.certification.histogram import BLOCK
from pidcfg.certification.run import run_sample
from pidcfg.certification.tally import Tally

if TYPE_CHECKING:
    from pidcfg.certification.run import Seen
    from pidcfg.certification.sample import Batch
    from pidcfg.certification.tally import Sizes
    from pidcfg.certification.workers import Job
    from pidcfg.scenario.load import Loaded


@lru_cache(maxsize=1)
def _loaded(job: Job) -> tuple[Loaded, Batch]:
    """What this process runs."""
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
