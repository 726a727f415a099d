"""The DL06's closed-loop auto-tune: a relay in place of the controller (D57, D58, D60 to D62, D64, D65)."""

from __future__ import annotations

import math
from fractions import Fraction

LISTENING = 16
SECOND_DIFFERENCE = 1.9544
"""Mean of |y(n) - 2 y(n-1) + y(n-2)| of white noise, in its standard deviations."""
FIRST, LAST = 4, 8
"""Switches that begin the first cycle that counts and end the last one."""
GAINS = {"PID": (0.45, "0.60", "0.10", "0.014"), "PI": (0.30, "1.00", "0", "0.03")}
"""Kc over Kpc; Ti, Td and Ts over Tpc, to be worked out without rounding."""
TUNING, ERROR = 4096, 8192


class Tuning:
    """The auto-tune of a loop."""

    def __init__(self, loop):
        self.loop, self.phase = loop, ""

    def request(self):
        """Bit 7 of +01 goes on; in an auto-tune it is on already (D683)."""
        self.phase = self.phase or "requested"

    def end(self, *, error):
        """The loop is released."""
        self.phase = ""
        self.loop.status &= ~TUNING
        if error:
            self.loop.status |= ERROR

    def stop(self):
        """The loop has left Auto (D64)."""
        if self.phase not in {"", "requested"}:
            self.loop.reached["tuning stopped"] += 1
            if self.phase == "relay":
                self.give_back()
            self.end(error=True)

    def give_back(self):
        """The output of before the relay, and the bias; the next calculation has no past (D60, D64)."""
        loop = self.loop
        loop.out = loop.m = self.out
        loop.bias, loop.past = self.bias, None

    def sample(self):
        """One sample; whether the relay owns the output."""
        if self.phase == "requested":
            self.begin()
        elif self.phase == "listening":
            self.listen()
        elif self.phase == "relay":
            self.relay()
        return self.phase == "relay"

    def measured(self):
        """The PV on the set point's scale, and what a deviation is measured by."""
        w, pv = self.loop.words, self.loop.pv
        low, high = w.pv_ends()
        return (math.sqrt(max(pv, 0)), math.sqrt(high - low)) if w.mode(6) else (pv, high - low)

    def begin(self):
        """Auto, and PV within 5 % of the set point."""
        loop = self.loop
        loop.status &= ~ERROR
        pv, scale = self.measured()
        if loop.mode != 2 or abs(loop.shown_sp - pv) > 205 / 4095 * scale:
            loop.reached["tuning refused"] += 1
            self.end(error=True)
            return
        self.phase, self.heard = "listening", []
        loop.status |= TUNING

    def listen(self):
        """16 samples tell the noise; a count is none."""
        self.heard.append(self.measured()[0])
        if len(self.heard) < LISTENING:
            return
        y = self.heard
        total = sum(abs(y[n] - 2 * y[n - 1] + y[n - 2]) for n in range(2, LISTENING))
        noise = total / (LISTENING - 2) / SECOND_DIFFERENCE
        self.band = 3 * noise if noise > 1 else 0
        self.phase, self.side, self.switches, self.samples = "relay", 0, [], 0
        self.cycle, self.swings = [], []
        loop = self.loop
        self.out, self.bias = loop.out, loop.bias
        low, high = loop.words.out_ends()
        if loop.out_high >= high or loop.out_low <= low:
            loop.reached["tuning at the ends"] += 1
            loop.status |= ERROR

    def relay(self):
        """The output goes to its other limit when the error has changed its sign."""
        loop = self.loop
        pv, _ = self.measured()
        self.samples += 1
        self.cycle.append(pv)
        e = loop.shown_sp - pv
        side = self.side
        if side == 0:
            side = -1 if e < 0 else 1
        elif side * e < -self.band:
            side = -side
        if side == self.side:
            return
        self.side = side
        self.switches.append(self.samples)
        if len(self.switches) % 2 == 0:
            if len(self.switches) > FIRST:
                self.swings.append(max(self.cycle) - min(self.cycle))
            self.cycle = []
        if len(self.switches) == LAST:
            self.finish()
        else:
            loop.out = loop.out_high if (side > 0) != bool(loop.words.mode(4)) else loop.out_low

    def finish(self):
        """The gains of the cycle go to their words; the loop goes on from its old bias."""
        loop, w = self.loop, self.loop.words
        _, scale = self.measured()
        low, high = w.out_ends()
        swing = sum(self.swings) / len(self.swings)
        kpc = 4 * (loop.out_high - loop.out_low) / (high - low) / (math.pi * max(swing, 1) / scale)
        tpc = Fraction((self.switches[-1] - self.switches[FIRST - 1]) * loop.period(), 200)
        gain, *times = GAINS["PI" if w.mode2(6) else "PID"]
        reset, rate, seconds = (Fraction(time) for time in times)
        unit = 60 if w.mode2(4) else 1
        for offset, value, least, most in (
            (0o10, gain * kpc * 100, 1, 9999),
            (0o11, reset * tpc / unit * 10**loop.plc.decimals, 1, 9998),
            (0o12, rate * tpc * 100, 0, 9999),
            (0o07, seconds * tpc * 100, 5 if len(loop.plc.loops) < 5 else 10, 9999),
        ):
            loop.plc.memory[w.table + offset] = int(str(min(max(round(value), least), most)), 16)
        self.give_back()
        loop.reached["tuned"] += 1
        self.end(error=False)
