"""One PID block of a virtual NextoPID among its signals, called by hand."""

from __future__ import annotations

import math

from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid.equation import call_pid
from pidcfg.sim.controllers.nextopid.terms import KINDS, OFFSETS, Config, State
from pidcfg.sim.controllers.plc import TICKS

PLAIN = {"Kp": 1, "MaxMV": 100, "MaxPV": 100, "Indep": 1}
"""A proportional controller with independent gains."""


class Block:
    """A block by its parameters' names, a dot as two underscores; ``before`` lies in front of it."""

    def __init__(self, kind="PIDA_TUNE_REAL", ts=0.1, before=3, **parameters):
        self.places = OFFSETS[kind]
        self.c = Config(
            kind=KINDS[kind],
            base=before,
            sample_time=single(ts),
            period=round(ts * TICKS),
            is_integer=int("INT" in kind),
        )
        self.s = State()
        self.signal_values = [-1.0] * before + [0.0] * len(self.places) + [-1.0]
        self.set(**{**PLAIN, **parameters})

    def place(self, name):
        return self.c.base + self.places[name.replace("__", ".")]

    def set(self, **parameters):
        for name, value in parameters.items():
            self.signal_values[self.place(name)] = single(float(value))
        return self

    def call(self, n=1, **parameters):
        """Its MV after some calls with the parameters."""
        self.set(**parameters)
        for _ in range(n):
            call_pid(self.c, self.s, self.signal_values)
        return self["MV"]

    def __getitem__(self, name):
        return self.signal_values[self.place(name)]

    @property
    def actions(self):
        return self["ProportionalAction"], self["IntegralAction"], self["DerivativeAction"]

    def true(self, prefix):
        """Names of the bits that are set, of those with a prefix."""
        return {n.removeprefix(prefix) for n in self.places if n.startswith(prefix) and self[n] == 1.0}

    @property
    def windup(self):
        return self["Windup_H_OUT"], self["Windup_L_OUT"]


class Process:
    """First order with dead time, after the relay or controller: moved before each call with the MV of the last one."""

    def __init__(self, gain, time_constant, dead_time, ts, mv, pv):
        self.gain, self.offset, self.value = gain, pv - gain * mv, pv
        self.share = -math.expm1(-ts / time_constant) if time_constant else 1.0
        self.line = [mv] * round(dead_time / ts)

    def step(self, mv):
        self.line.append(mv)
        self.value += (self.gain * self.line.pop(0) + self.offset - self.value) * self.share
        return self.value


def run(block, process, n, **parameters):
    """MV and PV of some cycles."""
    block.set(**parameters)
    trend = []
    for _ in range(n):
        pv = process.step(block["MV"])
        trend.append((block.call(PV=pv), pv))
    return trend
