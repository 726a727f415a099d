"""The processes that controllers act on; each advances by the exact solution of its equation over one base step.

The input ``u`` is held over a step, so the step of a linear plant has a closed form whose coefficients are worked out
beforehand: no error grows with the size of the step. Dead time is a whole number of base steps; all delay lines share
one buffer. Noise belongs to the measurement alone and never enters a state.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.expressions import evaluate

if TYPE_CHECKING:
    from collections.abc import MutableSequence, Sequence

FIRST_ORDER, SECOND_ORDER, INTEGRATOR, LEAD_LAG, DEAD_TIME, VALVE = range(6)
MODELS = {
    "first_order": FIRST_ORDER,
    "second_order": SECOND_ORDER,
    "integrator": INTEGRATOR,
    "lead_lag": LEAD_LAG,
    "dead_time": DEAD_TIME,
    "valve": VALVE,
}


@dataclass(slots=True)
class Plant:
    """One plant as the kernel sees it: wiring, parameters, coefficients of the exact step, state.

    ``source`` is the signal it reads, or -1 when ``first`` and ``last`` bound the code of an expression. The value goes
    to the signal ``slot``, with noise to ``measured`` (the same one when there is no noise, then ``column`` is -1).
    """

    model: int
    slot: int
    measured: int
    source: int = -1
    first: int = 0
    last: int = 0
    gain: float = 1.0
    load: float = 0.0
    low: float = -LARGEST_VALUE
    """Where its value stops."""
    high: float = LARGEST_VALUE
    sigma: float = 0.0
    column: int = -1
    delay: int = 0
    """Where its delay line begins in the shared buffer."""
    length: int = 0
    """Dead time in base steps."""
    head: int = 0
    a: float = 0.0
    """First order: 1 − e^(−dt/T). Integrator: dt. Valve: largest move in a step. Second order: Φ11."""
    b: float = 0.0
    """Lead/lag: lead over lag. Valve: stiction band. Second order: Φ12."""
    c: float = 0.0
    """Second order: Φ21."""
    d: float = 0.0
    """Second order: Φ22."""
    y: float = 0.0
    """The value."""
    x: float = 0.0
    """Second order: dy/dt. Lead/lag: the lagged input. Valve: the position."""
    moving: int = 0
    held: float = 0.0
    """The last input that had a value."""
    fault: int = 0
    """Why an input had no value, the first time (`pidcfg.sim.expressions.FAULTS`), and at which base step."""
    fault_at: int = 0


def step_plants(
    k: int,
    plants: Sequence[Plant],
    delay: MutableSequence[float],
    sig: MutableSequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> None:
    """All plants through one base step, in the order in which they depend on each other (kernel)."""
    for i in range(len(plants)):
        p = plants[i]
        u = sig[p.source] if p.source >= 0 else read_expression(k, p, sig, code, constants, stack)
        if p.length > 0:
            u = delayed(p, u, delay)
        if p.model == FIRST_ORDER:
            y = p.y
            y += p.a * (p.gain * u + p.load - y)
        else:
            y = other_value(p, u)
        if y > p.high or y < p.low:
            y = p.high if y > p.high else p.low
            if p.model == SECOND_ORDER:  # it rests there (D642)
                p.x = 0.0
        p.y = y
        sig[p.slot] = y


def read_expression(
    k: int,
    p: Plant,
    sig: Sequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> float:
    """The value of a plant's input; the last one when it has none now (kernel)."""
    u = evaluate(code, constants, p.first, p.last, sig, stack)
    if stack[0] == 0.0:
        p.held = u
    elif p.fault == 0:
        p.fault = int(stack[0])
        p.fault_at = k
    return p.held


def delayed(p: Plant, u: float, delay: MutableSequence[float]) -> float:
    """What went into the plant's delay line one dead time ago (kernel)."""
    at = p.delay + p.head
    value = delay[at]
    delay[at] = u
    p.head += 1
    if p.head == p.length:
        p.head = 0
    return value


def other_value(p: Plant, u: float) -> float:
    """The value of a plant that is not of first order after one step with the input ``u`` (kernel)."""
    if p.model == INTEGRATOR:
        return p.y + p.a * (p.gain * u + p.load)
    if p.model == SECOND_ORDER:
        end = p.gain * u + p.load
        away = p.y - end
        value = end + p.a * away + p.b * p.x
        p.x = p.c * away + p.d * p.x
        return value
    if p.model == LEAD_LAG:
        p.x += p.a * (u - p.x)
        return p.gain * (p.x + p.b * (u - p.x)) + p.load
    if p.model == VALVE:
        return p.gain * move_valve(p, u) + p.load
    return p.gain * u + p.load


def move_valve(p: Plant, u: float) -> float:
    """The position of a valve: it sticks until it is off by its band, then moves at its rate (kernel)."""
    away = u - p.x
    if p.moving == 0 and abs(away) > p.b:
        p.moving = 1
    if p.moving == 1:
        if away > p.a:
            p.x += p.a
        elif away < -p.a:
            p.x -= p.a
        else:
            p.x = u
            p.moving = 0
    return p.x


def add_noise(
    row: int, columns: int, plants: Sequence[Plant], noise: Sequence[float], sig: MutableSequence[float]
) -> None:
    """What transmitters with noise show; ``noise`` holds ``columns`` standard normal numbers a row (kernel)."""
    for i in range(len(plants)):
        p = plants[i]
        if p.column >= 0:
            sig[p.measured] = sig[p.slot] + p.sigma * noise[row * columns + p.column]


def lag(dt: float, time_constant: float) -> float:
    """The share of the way that a first-order lag goes in one step: 1 − e^(−dt/T)."""
    return -math.expm1(-dt / time_constant)


def second_order(dt: float, squared: float, damped: float) -> tuple[float, float, float, float]:
    """e^(A·dt) of ``squared``·y″ + ``damped``·y′ + y = 0, by rows; the three kinds of poles without cancellation.

    ``squared`` is T1·T2 or T², ``damped`` is T1 + T2 or 2ζT.
    """
    p = damped / squared / 2
    discriminant = p * p - 1 / squared
    if discriminant < 0:
        w = math.sqrt(-discriminant)
        decay = math.exp(-p * dt)
        c, s = decay * math.cos(w * dt), decay * math.sin(w * dt) / w
    else:
        w = math.sqrt(discriminant)
        slow, fast = math.exp(-dt / squared / (p + w)), math.exp(-(p + w) * dt)
        c = (slow + fast) / 2
        apart = 2 * w * dt
        s = dt * fast if apart == 0 else dt * fast * math.expm1(apart) / apart if apart < 1 else (slow - fast) / 2 / w
    return c + p * s, s, -s / squared, c - p * s


def settle_at(plant: Plant, value: float | None, u: float, delay: MutableSequence[float]) -> None:
    """The plant at rest at ``value`` (None: where the input ``u`` holds it), its delay line full of that input.

    An integrator without ``value`` begins at 0; a plant without gain cannot be held and its line is full of 0.
    """
    reach = plant.gain * u + plant.load
    if value is None:
        value = 0.0 if plant.model == INTEGRATOR else reach
    wanted = 0.0 if plant.model == INTEGRATOR else value
    held = (wanted - plant.load) / plant.gain if plant.gain else 0.0
    if not math.isfinite(held):
        held = 0.0
    if wanted == reach:
        held = u
    plant.y = min(max(value, plant.low), plant.high)
    plant.x = held if plant.model in (LEAD_LAG, VALVE) else 0.0
    plant.held = held
    plant.head = plant.moving = 0
    for at in range(plant.delay, plant.delay + plant.length):
        delay[at] = held
