"""Loops of a virtual Delta AS with plants, made of their operands, for the tests of the controller."""

from __future__ import annotations

import random

from pidcfg.encoders.maps.dpide import ROWS
from pidcfg.encoders.parameters import Entry, Program, store_content
from pidcfg.sim.controllers.dpide.scan import load, scan
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.controllers.plc import ScanOptions as Options
from rig_plants import Fixed

PLAIN = {
    "PID_RUN": True,
    "SV": 0,
    "PID_MODE": 0,
    "PID_MAN": False,
    "MOUT_AUTO": False,
    "CYCLE": 100,
    "Kc_Kp": 1,
    "Ti_Ki": 0,
    "Td_Kd": 0,
    "Tf": 0,
    "PID_EQ": False,
    "PID_DE": False,
    "PID_DIR": True,
    "ERR_DBW": 0,
    "MV_MAX": 100,
    "MV_MIN": 0,
    "MOUT": 0,
    "BIAS": 0,
}
"""A proportional loop with a gain of 1."""


def program_of(*loops, plc=None, settings=None, devices=None):
    """The operands of loops that differ from a plain one by those given, None for none; L1, L2 … with their devices."""
    cells, entries = [], []
    for i, given in enumerate(loops):
        loop = f"L{i + 1}"
        entries.append({"loop": loop, "device": f"D{500 + 30 * i}", **(settings or {})})
        if devices:
            entries[-1]["devices"] = devices[i]
        for name, value in {**PLAIN, **given}.items():
            if value is not None:
                kind = ROWS[name].type
                cells.append(Entry(f"{loop}.{name}", kind, store_content(kind, value), name, loop))
    return Program("dpide", tuple(cells), tuple(entries), plc or {})


class Rig:
    """A PLC, the plants of its loops, and the clock; ``base`` is the base step in seconds."""

    def __init__(self, *loops, program=None, plants=(), base=0.1, noise=0.0, devices=None):
        self.plc = load(program if program is not None else program_of(*loops, devices=devices), Options())
        self.configs, self.states, self.signal_values = self.plc.configs, self.plc.states, list(self.plc.signal_values)
        self.plants = [*plants, *(Fixed() for _ in self.configs[len(plants) :])]
        self.base, self.noise, self.random, self.tick = base, noise, random.Random(1), 0
        self.log = []

    def set(self, key, value, i=0):
        """A set event."""
        path = tuple(key.split("."))
        return self.plc.set(i, path, self.plc.check_set(i, path, value), self.signal_values)

    def mode(self, i=0):
        return self.plc.mode(self.states[i].status)

    def signal(self, name, i=0):
        return self.signal_values[self.plc.signals.index(f"{self.plc.loops[i]}.{name}")]

    def step(self, count=1):
        """Base steps: plants with the outputs of the step before, then the controllers."""
        for _ in range(count):
            for c, plant in zip(self.configs, self.plants, strict=True):
                if self.tick:
                    plant.step(self.signal_values[c.out_slot], self.base)
                self.signal_values[c.in_slot] = plant.value + (
                    self.random.gauss(0.0, self.noise) if self.noise else 0.0
                )
            scan(self.tick, self.configs, self.states, self.plc.aux, self.signal_values)
            self.tick += round(self.base * TICKS)
            self._read_log()
        return self

    def run(self, seconds):
        return self.step(round(seconds / self.base))

    def play(self, pvs, *names, i=0):
        """Signals (one: a list of numbers) after each of some measurements."""
        rows = []
        for pv in pvs:
            self.plants[i].value = pv
            self.step()
            rows.append(tuple(self.signal(name, i) for name in names))
        return [row[0] for row in rows] if len(names) == 1 else rows

    def trace(self, count, *names, i=0):
        """Signals after each of some steps."""
        rows = []
        for _ in range(count):
            self.step()
            rows.append(tuple(self.signal(name, i) for name in names))
        return [row[0] for row in rows] if len(names) == 1 else rows

    def _read_log(self):
        for i, s in enumerate(self.states):
            if s.notice:
                self.log.append((self.plc.loops[i], "; ".join(filter(None, self.plc.describe(s.notice)))))
                s.notice = 0
