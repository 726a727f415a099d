"""How often the bound of a batch lies below a share that is known: `python tests/certify_bound.py [SEEDS [SAMPLES]]`.

A loop in Manual holds its output at 50 %, and its plant is a gain that is drawn from 1.4 to 2.6: the PV is at most 120
where the gain is at most 2.4, in 5 of 6 plants. Each seed is a batch, run as `pidcfg certify` runs it.
"""

from __future__ import annotations

import sys

from certify_rig import CONFIG, scenario
from pidcfg.study.certification.certify import lower_bound
from pidcfg.study.certification.samples import Job
from pidcfg.study.certification.samples import process_results as results
from pidcfg.text.reader import DEFAULT

SHARE = (2.4 - 1.4) / (2.6 - 1.4)
TEXT = scenario(expect="  - {signal: TIC-1.PV, max: 120, share: 50 %}")


def held_by(seed, samples):
    """In how many samples of a batch the expectation holds."""
    job = Job("run.scenario.yaml", TEXT, "loop.yaml", CONFIG.encode(), seed, "python", DEFAULT)
    return sum(seen.held[0] for seen in results(job, 0, samples, 1))


def below(seeds, samples):
    """Of how many batches the bound lies below the share."""
    return sum(lower_bound(held_by(seed, samples), samples) <= SHARE for seed in seeds)


if __name__ == "__main__":
    seeds, samples = (*map(int, sys.argv[1:3]), *(200, 100)[len(sys.argv) - 1 :])
    print(f"{below(range(seeds), samples):,} of {seeds:,} bounds of {samples} samples lie below {SHARE:.4f}")  # noqa: T201
