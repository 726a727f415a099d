"""Loops of a virtual EZLogix with plants, in counts, for the tests of the controller."""

from __future__ import annotations

import random
from dataclasses import fields

from pidcfg.encoders.ezlogix.image import encode
from pidcfg.schemas.ezlogix import EzlogixFile
from pidcfg.sim.controllers.autotune import POINTS
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix.equation import OFF, ON, Config, State, calculate_gains
from pidcfg.sim.controllers.ezlogix.scan import MODE_BITS as MODES
from pidcfg.sim.controllers.ezlogix.scan import SIGNALS, Ezlogix, load, scan
from pidcfg.sim.controllers.plc import TICKS
from rig_plants import Fixed

COLUMNS = len(SIGNALS)
LOOP = {
    "name": "L",
    "registers": "R100",
    "discretes": "S100",
    "algorithm": "position",
    "action": "reverse",
    "sample_rate": 0.1,
    "tuning": {"proportional_gain": 1},
    "pv": {"tag": "IR1"},
    "output": {"tag": "OR1"},
}
SCALED = {"pv": {"tag": "IR1", "range": [0, 100]}, "output": {"tag": "OR1", "range": [0, 50]}}
IN, PV, SP, CV, BIAS, ERROR, STATUS, O, COUNTDOWN = range(COLUMNS)  # noqa: E741 - the signal's name


class Rig:
    """Some loops, their plants, and the clock; ``base`` is the base step in seconds."""

    def __init__(self, base=0.1, noise=0.0, seed=1):
        self.base, self.noise = base, noise
        self.tick, self.random = 0, random.Random(seed)
        self.configs, self.states, self.plants, self.signal_values, self.aux, self.log = [], [], [], [], [], []

    def add(self, plant=None, mode="manual", **given):
        """Another loop; what is given goes to its `Config` or `State`, ``period`` is in seconds."""
        i = len(self.configs)
        given["period"] = round(given.get("period", self.base) * TICKS)
        c, s = Config(), State()
        known = {f.name for item in (c, s) for f in fields(item)}
        assert set(given) <= known, set(given) - known
        for item in (c, s):
            for f in fields(item):
                if f.name in given:
                    setattr(item, f.name, given[f.name])
        for k, slot in enumerate(SIGNALS):
            setattr(c, slot, COLUMNS * i + k)
        c.tune_buffer = i * POINTS
        self.aux += [0.0] * POINTS
        self.signal_values += [plant.value if plant else 0.0] + [0.0] * (COLUMNS - 1)
        calculate_gains(s)
        self.configs.append(c)
        self.states.append(s)
        self.plants.append(plant or Fixed())
        if mode != "manual":
            self.request(mode, i)
        return c, s

    def request(self, mode, i=0):
        self.states[i].wanted_mode = MODES[mode]
        self.states[i].pending |= bits.REQUEST

    def tune(self, i=0, *, on=True):
        self.states[i].tune_command = ON if on else OFF
        self.states[i].pending |= bits.TUNE

    def step(self, count=1):
        """Base steps: plants with the outputs of the step before, then the controllers."""
        for _ in range(count):
            for i, plant in enumerate(self.plants):
                if self.tick:
                    plant.step(self.states[i].out, self.base)
                self.signal_values[COLUMNS * i] = plant.value + (
                    self.random.gauss(0.0, self.noise) if self.noise else 0.0
                )
            scan(self.tick, self.configs, self.states, self.aux, self.signal_values)
            self.tick += round(self.base * TICKS)
            for s in self.states:
                if s.notice:
                    self.log.append("; ".join(filter(None, Ezlogix.describe(s.notice))))
                    s.notice = 0

    def run(self, seconds):
        self.step(round(seconds / self.base))

    def trace(self, count, *names, i=0):
        """States after each of some steps."""
        rows = []
        for _ in range(count):
            self.step()
            rows.append(tuple(getattr(self.states[i], name) for name in names))
        return rows

    def follow(self, values, *names):
        """States of the first loop while its measurement takes these values."""
        rows = []
        for value in values:
            self.plants[0].value = value
            rows += self.trace(1, *names)
        return rows


def image(*loops, **plc):
    """The image of loops that differ from a plain one by the keys given."""
    entries = [
        {**LOOP, "name": f"L{i}", "registers": f"R{100 * i}", "discretes": f"S{100 * i}", **loop}
        for i, loop in enumerate(loops, start=1)
    ]
    return encode(EzlogixFile.model_validate({"pidcfg": 1, "vendor": "ezlogix", "plc": plc, "loops": entries})).image


def plc(*loops, **given):
    """The PLC of these loops."""
    return load(image(*loops, **given))


def change(machine, key, value, loop=0, signals=None):
    """A set event."""
    path = tuple(key.split("."))
    return machine.set(
        loop, path, machine.check_set(loop, path, value), machine.signal_values if signals is None else signals
    )


def play(machine, steps, pv=(), base=100_000, start=0):
    """Scans with fixed measurements; the signals stay with the machine, notices are returned."""
    said = []
    for k in range(start, start + steps):
        for c, value in zip(machine.configs, pv, strict=False):
            machine.signal_values[c.in_slot] = value
        scan(k * base, machine.configs, machine.states, machine.aux, machine.signal_values)
        for i, s in enumerate(machine.states):
            if s.notice:
                text = "; ".join(filter(None, machine.describe(s.notice)))
                said.append((k, machine.loops[i], machine.requested_mode(s.notice), text))
            s.notice = 0
    return said
