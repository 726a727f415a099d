"""What stands behind a virtual controller in its tests."""

from __future__ import annotations

import math
from collections import deque


class Fixed:
    """A measurement that the test writes itself."""

    def __init__(self, value=0.0):
        self.value = value

    def step(self, _output, _dt):
        return self.value


class FirstOrder:
    """T dPV/dt = gain u + offset - PV behind a dead time, exact at the base step."""

    def __init__(self, gain=1.0, time_constant=10.0, dead_time=0.0, initial=0.0, offset=0.0):
        self.gain, self.time_constant, self.dead_time, self.offset = gain, time_constant, dead_time, offset
        self.value = initial
        self.line = None

    def step(self, output, dt):
        if self.line is None:
            rest = (self.value - self.offset) / self.gain
            self.line = deque([rest] * round(self.dead_time / dt))
        self.line.append(output)
        target = self.gain * self.line.popleft() + self.offset
        self.value += (target - self.value) * -math.expm1(-dt / self.time_constant)
        return self.value


class Moving:
    """A process whose PV moves by so many counts a sample of its own."""

    def __init__(self, plant, moves):
        self.plant, self.moves, self.moved = plant, moves, 0.0

    @property
    def value(self):
        return self.plant.value + self.moved

    def step(self, output, dt):
        self.moved += self.moves
        return self.plant.step(output, dt)
