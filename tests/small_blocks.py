"""Loaded by a worker of a cluster before anything else: blocks of 16 samples, so that a test has many of them."""

from pidcfg.study.certification import cluster, tally
from pidcfg.study.certification import cluster as blocks
from pidcfg.study.certification import tally as histogram

SAMPLES = 16
for module in (blocks, cluster, histogram, tally):
    module.BLOCK = SAMPLES
