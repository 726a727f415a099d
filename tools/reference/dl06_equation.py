"""The PID equation of a DL06 loop (D30 to D40, D649, D677, D678)."""

from __future__ import annotations

import math

from reference.dl06_memory import bcd

OVERFLOW = 2048


class Equation:
    """The part of a loop that calculates; ``past`` is None when the next calculation has none (D42, D681)."""

    past = None

    def counted_error(self):
        w = self.words
        low, high = w.pv_ends()
        span = high - low
        if w.mode(6):
            scale = math.sqrt(span)
            e = (self.setpoint() - math.sqrt(max(self.pv, 0))) / scale
        else:
            scale = span
            e = (self.setpoint() - self.pv) / span
        if w.mode(7):
            e = e * abs(e)
        if w.mode(8) and abs(e) <= w.distance(0o23) / scale and w.distance(0o23):
            self.reached["deadband"] += 1
            e = 0.0
        return e

    def calculate(self):
        w, reached = self.words, self.reached
        ts, ti, td = self.period() / 100, bcd(w[0o11]), bcd(w[0o12]) / 100
        out_low, out_high = w.out_ends()
        gain = bcd(w[0o10]) / 100 * (out_high - out_low)
        factor = gain or 1.0 * (out_high - out_low)
        seconds = 60 if w.mode2(4) else 1
        ki = 0.0 if ti in {0, 9999} else factor * ts / (ti / 10**self.plc.decimals * seconds)
        kr = factor * td / ts
        sign = -1 if w.mode(4) else 1
        e = self.counted_error()
        low, high = w.pv_ends()
        on_pv = self.plc.on_pv
        x = -self.pv / (high - low) if on_pv else e
        if on_pv and w.mode(6):
            x = -math.sqrt(max(self.pv, 0)) / math.sqrt(high - low)
        if self.past is None:
            self.e1 = e
            self.y1 = self.y2 = x
            self.past = True
            self.last_sp = self.shown_sp
        y = x
        if w.mode(9):
            limit = self.limit
            if limit == 0:
                kr = 0.0
            elif td:
                y = self.y1 + ts / (ts + td / limit) * (x - self.y1)
                reached["derivative limited"] += 1
        self.step_bias()
        if w.mode(5):
            slope = y - 2 * self.y1 + self.y2
            result = self.m + sign * (gain * (e - self.e1) + ki * e + kr * slope)
        else:
            self.integrate(sign * ki * e)
            result = self.bias + sign * (gain * e + kr * (y - self.y1))
        self.e1, self.y2, self.y1 = e, self.y1, y
        m = self.held(result)
        if abs(result) > 2**31 - 1:
            self.status |= OVERFLOW
            reached["overflow"] += 1
            self.to_manual()
            return
        self.m = max(min(m, self.out_high), self.out_low)
        self.out = round(self.m)
        reached["output limit"] += self.m != m
        for name, happened in (
            ("reverse" if w.mode(4) else "direct", True), ("velocity" if w.mode(5) else "position", True),
            ("squared", w.mode(7)), ("square root", w.mode(6)), ("gain 0", not gain), ("reset off", not ki),
            ("derivative", td), ("derivative of the PV", on_pv and td), ("reset in minutes", w.mode2(4)),
            (w.pv_format(), True), ("output format", w.mode2(10)),
        ):  # fmt: skip
            reached[name] += bool(happened)

    def step_bias(self):
        old, new, self.last_sp = self.last_sp, self.shown_sp, self.shown_sp
        if not self.plc.step_bias or self.words.mode(5) or old == new or old * new <= 0:
            return
        self.reached["step bias"] += 1
        ratio = old / new if self.words.mode(4) else new / old
        self.bias *= ratio

    def integrate(self, step):
        low, high = self.words.out_ends()
        if self.words.mode(10) and ((self.out >= high and step > 0) or (self.out <= low and step < 0)):
            self.reached["freeze"] += 1
            step = 0.0
        bias = self.bias + step
        self.bias = self.held(bias)
        self.reached["bias at an end"] += self.bias != bias
