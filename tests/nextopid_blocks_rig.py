"""One block of a NextoPID program, by the names of its parameters; and the same blocks in NumPy's float32."""

from __future__ import annotations

import math
from collections import deque

import pytest

pytest.importorskip("numpy")
import numpy as np

from pidcfg.sim.controllers.kernels import single
from pidcfg.sim.controllers.nextopid import terms as slots
from pidcfg.sim.controllers.nextopid.scan import (
    call_delay,
    call_lag,
    call_pwm,
    delay_lag,
    lead_lag,
    low_filter,
    on_off,
    select_max,
    select_min,
    split_range,
)
from pidcfg.sim.controllers.nextopid.terms import Config, State

MARGIN = 7
"""Signals and places of the shared vector around the block, which it must leave alone."""
LINE = 100
UNTOUCHED = -12345.0


def call(c, s, aux, signals):
    """One call of the block that ``c.kind`` names (kernel)."""
    kind = c.kind
    if kind == slots.ON_OFF:
        on_off(c, s, signals)
    elif kind == slots.PWM:
        call_pwm(c, s, signals)
    elif kind == slots.LOW_FILTER:
        low_filter(c, s, signals)
    elif kind == slots.DELAY:
        call_delay(c, s, aux, signals)
    elif kind == slots.LAG:
        call_lag(c, s, signals)
    elif kind == slots.DELAY_LAG:
        delay_lag(c, s, aux, signals)
    elif kind == slots.LEAD_LAG:
        lead_lag(c, s, signals)
    elif kind == slots.SELECT_MAX:
        select_max(c, signals)
    elif kind == slots.SELECT_MIN:
        select_min(c, signals)
    else:
        split_range(c, signals)


class Block:
    """A block of a type, called every ``ts`` seconds."""

    def __init__(self, kind, ts=0.1, **given):
        self.places = slots.OFFSETS[kind]
        self.c = Config(kind=slots.KINDS[kind], base=MARGIN, sample_time=single(ts), buffer=MARGIN)
        self.s = State()
        self.signal_values = [UNTOUCHED] * MARGIN + [0.0] * len(self.places) + [UNTOUCHED] * MARGIN
        self.aux = [UNTOUCHED] * (LINE + 2 * MARGIN)
        self.set(**given)

    def set(self, **given):
        """Parameters by name, as the program holds them."""
        for name, value in given.items():
            self.signal_values[MARGIN + self.places[name]] = single(float(value))

    def __getitem__(self, name):
        return self.signal_values[MARGIN + self.places[name]]

    def __call__(self, **given):
        """One call; the output, or the outputs."""
        self.set(**given)
        call(self.c, self.s, self.aux, self.signal_values)
        assert {*self.signal_values[:MARGIN], *self.signal_values[-MARGIN:]} == {UNTOUCHED}
        assert {*self.aux[:MARGIN], *self.aux[-MARGIN:]} == {UNTOUCHED}
        return self

    def run(self, output, name, values):
        """The output after each call with the values of an input."""
        return [self(**{name: value})[output] for value in values]


# --- the same in float32 ---------------------------------------------------------------------------------------------

F = np.float32


def part(ts, time_constant):
    """Share of the way of one sample."""
    return F(-math.expm1(-float(F(ts) / F(time_constant))))


def low_filter_32(ts, p, xs):
    y = F(xs[0])
    for x in xs:
        y += (F(x) - y) * part(ts, p["Tc"])
        yield y


def lag_32(ts, p, xs):
    y = F(p["Init_OutVar"])
    yield y
    for x in xs[1:]:
        y += (F(p["Gs"]) * F(x) + F(p["Offset"]) - y) * part(ts, p["Tc"])
        y = min(max(y, F(p["Min_OutVar"])), F(p["Max_OutVar"]))
        yield y


def delay_32(ts, p, xs):
    line = deque([F(p["InitDelayedVar"])] * round(float(F(p["DelayTime"]) / F(ts))))
    for x in xs:
        line.append(F(x))
        yield line.popleft()


def delay_lag_32(ts, p, xs):
    return lag_32(ts, p, list(delay_32(ts, p, xs)))


def lead_lag_32(ts, p, xs):
    y = F(xs[0])
    for x in xs:
        out = F(p["G"]) * (y + F(p["Tlead"]) / F(p["Tlag"]) * (F(x) - y))
        yield min(max(out, F(p["Min_OutVar"])), F(p["Max_OutVar"]))
        y += (F(x) - y) * part(ts, p["Tlag"])


IN_FLOAT32 = {
    "ControlLowFilter": low_filter_32,
    "ControlLag": lag_32,
    "ControlDelay": delay_32,
    "ControlDelayLag": delay_lag_32,
    "ControlLeadLag": lead_lag_32,
}
