"""Loops of a virtual CLICK with plants, made of their registers, for the tests of the controller."""

from __future__ import annotations

import random

from nested import merged
from pidcfg.encoders.click.image import encode
from pidcfg.encoders.image import Cell, Image
from pidcfg.encoders.maps.click import BLOCKS, SPACE
from pidcfg.schemas.click import ClickFile
from pidcfg.sim.controllers.click.equation import bits_of
from pidcfg.sim.controllers.click.scan import load, scan
from pidcfg.sim.controllers.plc import TICKS
from pidcfg.sim.controllers.plc import ScanOptions as Options
from rig_plants import Fixed

PLAIN = {
    "sample_rate": "100 ms",
    "action": "direct",
    "bumpless": 2,
    "pv": {"range": [0, 100]},
    "tuning": {"proportional_gain": 1, "reset_time": 6000},
}
"""A loop that hardly integrates."""


def image_of(*loops):
    """The registers of loops that differ from a plain one by the keys given; L1, L2 …"""
    entries = []
    for i, given in enumerate(loops):
        own = {"bits": f"C{1 + 40 * i}", "integers": f"DS{1 + 15 * i}", "floats": f"DF{1 + 25 * i}"}
        entries.append(merged({**PLAIN, "name": f"L{i + 1}", **own}, given))
    return encode(ClickFile.model_validate({"pidcfg": 1, "vendor": "click", "loops": entries})).image


def row_of(register):
    """Bank, block and offset of a register by its name."""
    for key, (prefix, table) in BLOCKS.items():
        for row in table.words:
            if row.name == register:
                return key, prefix, row.offset
    raise KeyError(register)


def poked(image, loop=0, **registers):
    """An image with some registers overwritten: raw bits, or a number for a float."""
    words = image.words
    for name, value in registers.items():
        key, prefix, offset = row_of(name)
        start = SPACE.parse(str(image.settings[loop][key]))
        raw = bits_of(value) if isinstance(value, float) else value & 0xFFFF
        words[start + offset] = raw
        assert prefix in SPACE.name(start)
    cells = tuple(Cell(SPACE.name(n), n, raw, "") for n, raw in sorted(words.items()))
    return Image("click", cells, image.settings, image.plc)


class Rig:
    """A PLC, the plants of its loops, and the clock; ``base`` is the base step in seconds."""

    def __init__(self, *loops, image=None, plants=(), base=0.1, noise=0.0, goals=False):
        self.plc = load(image if image is not None else image_of(*loops), Options())
        self.configs, self.states, self.signal_values = self.plc.configs, self.plc.states, list(self.plc.signal_values)
        self.plants = [*plants, *(Fixed() for _ in self.configs[len(plants) :])]
        self.base, self.noise, self.random, self.tick = base, noise, random.Random(1), 0
        self.log = []
        if not goals:
            for s in self.states:
                s.goal = s.pending = s.pending & 1
        self._read_log()

    def auto(self, i=0):
        """Auto at once, as the next sample finds it."""
        self.plc.request(i, "auto")
        return self

    def set(self, key, value, i=0):
        """A set event."""
        path = tuple(key.split("."))
        return self.plc.set(i, path, self.plc.check_set(i, path, value), self.signal_values)

    def mode(self, i=0):
        return self.plc.mode(self.states[i].status)

    def out(self, i=0):
        return self.signal_values[self.configs[i].out_slot]

    def step(self, count=1, drive="out_slot"):
        """Base steps: plants with the outputs of the step before, then the controllers."""
        for _ in range(count):
            for c, plant in zip(self.configs, self.plants, strict=True):
                if self.tick:
                    plant.step(self.signal_values[getattr(c, drive)], self.base)
                self.signal_values[c.in_slot] = plant.value + (
                    self.random.gauss(0.0, self.noise) if self.noise else 0.0
                )
            scan(self.tick, self.configs, self.states, self.plc.aux, self.signal_values)
            self.tick += round(self.base * TICKS)
            self._read_log()
        return self

    def run(self, seconds, drive="out_slot"):
        return self.step(round(seconds / self.base), drive)

    def trace(self, count, *names, i=0):
        """Registers after each of some steps."""
        rows = []
        for _ in range(count):
            self.step()
            rows.append(tuple(getattr(self.states[i], name) for name in names))
        return rows

    def _read_log(self):
        for i, s in enumerate(self.states):
            if s.notice:
                self.log.append((self.plc.loops[i], "; ".join(filter(None, self.plc.describe(s.notice)))))
                s.notice = 0
