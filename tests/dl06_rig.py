"""Loops of a virtual DL06 with plants, in counts of the data format, for the tests of the controller."""

from __future__ import annotations

import random
from dataclasses import fields

from pidcfg.sim.controllers.dl06 import equation as bits
from pidcfg.sim.controllers.dl06.autotune import POINTS, REQUESTED
from pidcfg.sim.controllers.dl06.equation import Config, State, calculate_gains
from pidcfg.sim.controllers.dl06.plc import Dl06
from pidcfg.sim.controllers.dl06.scan import scan
from pidcfg.sim.controllers.plc import TICKS
from rig_plants import Fixed

TABLE = 32
MODES = {"manual": bits.MANUAL, "auto": bits.AUTO, "cascade": bits.CASCADE}


class Rig:
    """Some loops, their plants, and the clock; ``base`` is the base step in seconds."""

    def __init__(self, base=0.05, noise=0.0, seed=1):
        self.base, self.noise = base, noise
        self.tick, self.random = 0, random.Random(seed)
        self.configs, self.states, self.plants, self.signal_values, self.aux = [], [], [], [], []
        self.log = []

    def add(self, plant=None, mode="manual", **given):
        """Another loop; what is given goes to its `Config` or `State`, ``period`` is in seconds."""
        i = len(self.configs)
        given["period"] = round(given.get("period", self.base) * TICKS)
        c, s = Config(), State()
        for item in (c, s):
            for f in fields(item):
                if f.name in given:
                    setattr(item, f.name, given[f.name])
        assert set(given) <= {f.name for item in (c, s) for f in fields(item)}, given
        if "pv_width" not in given:
            c.pv_low, c.pv_width = c.pv_min, c.pv_span
        if "out_width" not in given:
            c.out_low, c.out_width = c.out_min, c.out_span
        c.in_slot, c.pv_slot, c.sp_slot, c.out_slot, c.bias_slot, c.step_slot = (6 * i + k for k in range(6))
        c.shapes_error = int(c.square_root or c.squared or c.deadband > 0.0)
        c.is_special = int(c.velocity or c.shapes_error or c.derivative_on_pv or c.step_bias)
        c.rs_table, c.tune_buffer = i * (TABLE + POINTS), i * (TABLE + POINTS) + TABLE
        self.aux += [0.0] * (TABLE + POINTS)
        self.signal_values += [plant.value if plant else 0.0, 0.0, 0.0, s.out, 0.0, 0.0]
        calculate_gains(c, s)
        s.pending |= bits.FIRST_SAMPLE
        self.configs.append(c)
        self.states.append(s)
        self.plants.append(plant or Fixed())
        if mode != "manual":
            self.request(mode, i)
        return c, s

    def request(self, mode, i=0):
        self.states[i].request = MODES[mode]
        self.states[i].pending |= bits.REQUEST

    def command(self, bit, i=0):
        self.states[i].rs_command |= bit
        self.states[i].pending |= bits.SOAK

    def tune(self, i=0):
        self.states[i].tune_phase = REQUESTED
        self.states[i].pending |= bits.TUNE

    def profile(self, *pairs, i=0):
        """Pairs of target, slope a second, soak seconds, deviation."""
        flat = [float(x) for pair in pairs for x in pair]
        self.aux[self.configs[i].rs_table : self.configs[i].rs_table + len(flat)] = flat

    def step(self, count=1):
        """Base steps: plants with the outputs of the step before, then the controllers."""
        for _ in range(count):
            for i, plant in enumerate(self.plants):
                if self.tick:
                    plant.step(self.states[i].out, self.base)
                self.signal_values[6 * i] = plant.value + (self.random.gauss(0.0, self.noise) if self.noise else 0.0)
            scan(self.tick, self.configs, self.states, self.aux, self.signal_values)
            self.tick += round(self.base * TICKS)
            for i, s in enumerate(self.states):
                if s.notice:
                    self.log.append((i, "; ".join(filter(None, Dl06.describe(s.notice)))))
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
