"""Loaded by a worker of a cluster before anything else: blocks of 16 samples, so that a test has many of them."""

from pidcfg.certification import blocks, cluster, histogram, tally

SAMPLES = 16
for module in (blocks, cluster, histogram, tally):
    module.BLOCK = SAMPLES
