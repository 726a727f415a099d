"""Batches that take next to no time: a loop in Manual whose PV is its output times an uncertain gain."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from pidcfg.study.scenario import load_scenario
from pidcfg.study.uncertainty import NumberSpread, Uncertainty
from pidcfg.text import processes
from pidcfg.text.reader import DEFAULT, Texts
from pidcfg.text.source import read_document

CONFIG = """\
pidcfg: 1
vendor: generic
loops:
  - name: TIC-1
    mode: manual
    output_raises_pv: true
    sample_time: 1 s
    tuning: {gain: 2.5, integral_time: 2 min, derivative_time: off}
    pv: {range: [0, 200]}
    setpoint: {value: 50, limits: [0, 200]}
    output: {range: [0, 100], manual: 50}
"""
SCENARIO = """\
pidcfg: 1
scenario: An output that stands
config: loop.yaml
duration: 10
plants:
  TIC-1: {{model: dead_time, gain: 2}}
seed: 3
vary:
{vary}
expect:
{expect}
"""
GAIN = "  plants:\n    TIC-1: {gain: ±30 %}"
PASSES = "  - {signal: TIC-1.PV, max: 129.9, share: 90 %}"
"""The PV is 50 times a gain of 1.4 to 2.6: 70 to 130."""


def scenario(vary=GAIN, expect=PASSES):
    """A scenario's text."""
    return SCENARIO.format(vary=vary, expect=expect)


def files(text):
    """What a call reads."""
    return {"run.scenario.yaml": text, "loop.yaml": CONFIG}


def loaded_of(text, config=CONFIG, name="loop.yaml"):
    """A scenario with its configuration."""
    document = read_document(text.encode(), "run.scenario.yaml", DEFAULT)
    return load_scenario(document, Texts({name: config}))


def uniform(low, high, key="gain"):
    """A number of a plant that varies."""
    return Uncertainty("plants", "TIC-1", key, f"{low} to {high}", NumberSpread(low, high))


def normal(mean, sigma, low=float("-inf"), high=float("inf")):
    """The same, normal."""
    return Uncertainty("plants", "TIC-1", "gain", "normal", NumberSpread(low, high, mean, sigma))


HAS_BEGUN = []
"""Not empty in the process that has run the first part."""


def killed_once(samples):
    """A part whose process is ended from outside, the first time: it has handed in the first part, the others wait."""
    mark = Path(os.environ["KILLED_ONCE"])
    if samples[0] and not mark.exists():
        if HAS_BEGUN:
            mark.touch()
            os.kill(os.getpid(), signal.SIGTERM)
        while not mark.exists():
            time.sleep(0.005)
    found = processes._run_item(samples)
    HAS_BEGUN.extend([True] * (samples[0] == 0))
    return found


def killed_always(samples):
    """A part that no process survives."""
    del samples
    os.kill(os.getpid(), signal.SIGTERM)
