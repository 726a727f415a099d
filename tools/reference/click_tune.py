"""The CLICK's closed-loop autotune: a relay in place of the controller (D123 to D125)."""

from __future__ import annotations

import math

from reference.single import F

LISTENING = 16
FIRST, LAST = 4, 8
"""Switches that begin the first cycle that counts and end the last one."""
GAINS = {"PID": (0.45, 0.60, 0.10, 0.014), "PI": (0.30, 1.00, 0.0, 0.03)}
LEAST_SWING = 1e-6
"""Share of the PV's range that the amplitude counts as at least."""
ONLY_PI = 7
P, RESET, D, CO_LOW, CO_HIGH, HYSTERESIS, PV_LOW, PV_HIGH = 5, 6, 7, 9, 10, 21, 22, 23
RATE = 5


class Tuning:
    """The autotune of a loop."""

    def __init__(self, loop):
        self.loop, self.on = loop, False

    def begin(self):
        """From Auto, where the ranges of PV and output are ranges; the output is held."""
        loop = self.loop
        if not loop.auto or loop.df(PV_LOW) >= loop.df(PV_HIGH) or loop.df(CO_LOW) >= loop.df(CO_HIGH):
            loop.reached["tuning refused"] += 1
            return
        self.on, loop.auto = True, False
        self.kept, self.heard, self.samples, self.side = loop.co(), 0, 0, 0
        self.switches, self.cycle, self.swings = [], [], []

    def end(self):
        """The output is the one of before, and the error has no past; the mode is the caller's."""
        self.on = False
        self.loop.write_co(self.kept)
        self.loop.fresh = True

    def cancel(self):
        """The request is cleared: back to Auto."""
        if self.on:
            self.end()
            self.loop.auto = True
            self.loop.reached["tuning cancelled"] += 1

    def stop(self):
        """Another mode ends it."""
        if self.on:
            self.end()
            self.loop.reached["tuning stopped"] += 1

    def sample(self, setpoint, pv):
        """16 samples of listening, then the relay around the set point."""
        if self.heard < LISTENING:
            self.heard += 1
            return
        loop = self.loop
        span = loop.df(PV_HIGH) - loop.df(PV_LOW)
        band = loop.df(HYSTERESIS) * span / 100
        self.samples += 1
        self.cycle.append(pv)
        side, e = self.side, setpoint - pv
        if side == 0:
            side = -1 if e < 0 else 1
        elif side * e < -band:
            side = -side
        if side == self.side:
            return
        self.side = side
        self.switches.append(self.samples)
        loop.write_co(loop.df(CO_HIGH if (side > 0) != loop.reverse() else CO_LOW))
        if len(self.switches) % 2 == 0:
            if len(self.switches) > FIRST:
                self.swings.append(max(self.cycle) - min(self.cycle))
            self.cycle = []
        if len(self.switches) == LAST:
            self.finish(span, band)

    def finish(self, span, band):
        """The gains of the cycle, and back to Auto."""
        loop = self.loop
        amplitude = sum(self.swings) / 4
        least = LEAST_SWING * span
        root = math.sqrt(max(amplitude * amplitude - band * band, least * least))
        ku = 2 * (loop.df(CO_HIGH) - loop.df(CO_LOW)) / (math.pi * root)
        tu = (self.switches[-1] - self.switches[FIRST - 1]) / 2 * loop.ds(RATE) / 1000
        gain, reset, rate, seconds = GAINS["PI" if loop.c(ONLY_PI) else "PID"]
        for offset, value, least, most in (
            (P, gain * ku, 0.01, 10000),
            (RESET, reset * tu, 0.01, 6000),
            (D, rate * tu, 0, 6000),
        ):
            loop.write(offset, float(F(min(max(value, least), most))))
        loop.memory[f"DS{loop.places['DS'] + RATE}"] = min(max(round(seconds * tu * 1000), 100), 30000)
        self.end()
        loop.auto = True
        loop.reached["tuned"] += 1
