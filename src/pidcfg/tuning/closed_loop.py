"""What the loop does in time: overshoot and absolute error after a step of the set point, and of the output.

The controller has the derivative on the PV, so that a step of the set point makes no spike; process and dead time are
exact for an output that is held over a step of the calculation, which is a small part of the fastest time.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, isinf
from typing import TYPE_CHECKING

from pidcfg.tuning.margins import Loop

if TYPE_CHECKING:
    from pidcfg.tuning.rules import Gains
    from pidcfg.tuning.transfer import Transfer

FINEST, MOST_STEPS = 100, 60_000
"""Steps of the calculation in the fastest time, and in all."""
COARSEST = 5
"""Times that step where the fastest time is not the loop's."""
SETTLED, SHOWN, MOST_SHOWN = 0.01, 1.15, 1500
"""Part of the way within which a PV is at rest; how long, in times until then, and in points, is shown."""
LONG = 12
"""Times the slowest of integral time, lags and dead time: how long is looked at."""


@dataclass(frozen=True, slots=True)
class Answer:
    """Overshoot in % of a step of the set point, and integrals of |error| in units and s.

    The integrals are of a unit step of the set point, and of one that is added to the output; None: without an integral
    term the error stays.
    """

    overshoot: float
    iae_setpoint: float | None
    iae_disturbance: float | None


class _Plant:
    """A transfer function in steps of time; as many leads as lags at most."""

    def __init__(self, transfer: Transfer, dt: float) -> None:
        self.dt, self.gain = dt, abs(transfer.gain)
        leads = [*transfer.zeros, *[0.0] * len(transfer.poles)]
        self.lags = [(1 - exp(-dt / lag), lead / lag) for lag, lead in zip(transfer.poles, leads, strict=False)]
        self.leads = transfer.zeros[len(transfer.poles) :]
        self.states = [0.0] * len(self.lags)
        self.integral, self.integrates = 0.0, bool(transfer.integrators)
        self.delay = [0.0] * round(transfer.dead_time / dt)
        self.at = 0

    def step(self, output: float) -> float:
        """The PV after one step with this output."""
        if self.delay:
            self.delay[self.at], output = output, self.delay[self.at]
            self.at = (self.at + 1) % len(self.delay)
        value = output * self.gain
        if self.integrates:
            slope = value
            self.integral += value * self.dt
            value = self.integral + sum(self.leads) * slope
        for i, (share, lead) in enumerate(self.lags):
            self.states[i] += (value - self.states[i]) * share
            value = self.states[i] + lead * (value - self.states[i])
        return value


@dataclass(frozen=True, slots=True)
class Curves:
    """The PV after a unit step of the set point, and after one that is added to the output; times in s."""

    times: tuple[float, ...]
    setpoint: tuple[float, ...]
    disturbance: tuple[float, ...]


def curves(gains: Gains, transfer: Transfer) -> Curves:
    """How a stable loop answers, until it is at rest; nothing where its times are too far apart."""
    grid = _grid(gains, transfer)
    if grid is None:
        return Curves((0.0,), (0.0,), (0.0,))
    dt, duration = grid
    after_setpoint, _ = _run(gains, transfer, dt, duration, setpoint=1.0, load=0.0)
    after_load, _ = _run(gains, transfer, dt, duration, setpoint=0.0, load=1.0)
    moving = max(_moving(after_setpoint), _moving(after_load))
    end = min(len(after_setpoint), round(SHOWN * moving) + 2)
    every = max(1, end // MOST_SHOWN)
    times = (0.0, *((i + 1) * dt for i in range(0, end, every)))
    return Curves(times, (0.0, *after_setpoint[:end:every]), (0.0, *after_load[:end:every]))


def _moving(pvs: list[float]) -> int:
    """Steps until the PV stays within a small part of its way."""
    band = SETTLED * (max(pvs) - min(pvs))
    return next((i for i in range(len(pvs) - 1, -1, -1) if abs(pvs[i] - pvs[-1]) > band), 0)


def _grid(gains: Gains, transfer: Transfer) -> tuple[float, float] | None:
    """The step of the calculation and how long it goes on, in s; None: more steps than can be made."""
    loop = Loop(gains, transfer)
    fine, duration = min(loop.times) / FINEST, LONG * max(loop.times)
    if duration / fine <= MOST_STEPS:
        return fine, duration
    # A lag that is much slower than the loop ends with it; a time that is much faster makes no difference.
    fastest = 1 / loop.crossover
    slowest = max(time for time in (fastest, transfer.dead_time, gains.integral_time) if not isinf(time))
    duration = min(duration, LONG * slowest)
    step = max(fine, duration / MOST_STEPS)
    return (step, duration) if step <= fastest / FINEST * COARSEST else None


def answer(gains: Gains, transfer: Transfer) -> Answer | None:
    """The figures of a stable loop; None where its times are too far apart."""
    if (grid := _grid(gains, transfer)) is None:
        return None
    pvs, setpoint_error = _run(gains, transfer, *grid, setpoint=1.0, load=0.0)
    _, load_error = _run(gains, transfer, *grid, setpoint=0.0, load=1.0)
    rest = isinf(gains.integral_time)
    final = pvs[-1] if rest else 1.0
    overshoot = 100 * max(0.0, max(pvs) / final - 1) if final else 0.0
    return Answer(overshoot, None if rest else setpoint_error, None if rest else load_error)


def _run(
    gains: Gains, transfer: Transfer, dt: float, duration: float, *, setpoint: float, load: float
) -> tuple[list[float], float]:
    """The PV, and the integral of the absolute error."""
    plant, integral, pv, before, total = _Plant(transfer, dt), 0.0, 0.0, 0.0, 0.0
    rate = gains.derivative_time / dt
    share = 0.0 if isinf(gains.integral_time) else dt / gains.integral_time
    pvs = []
    for _ in range(round(duration / dt)):
        error = setpoint - pv
        integral += error * share
        output = gains.gain * (error + integral - rate * (pv - before))
        before, pv = pv, plant.step(output + load)
        pvs.append(pv)
        total += abs(error) * dt
    return pvs, total
