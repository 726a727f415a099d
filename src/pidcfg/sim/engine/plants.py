"""The processes that controllers act on, advanced by the exact solution, and the noise of transmitters."""

from __future__ import annotations

import hashlib
import math
import random
import struct
from array import array
from collections.abc import Callable, MutableSequence, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from pidcfg.schemas.expressions import LARGEST_VALUE
from pidcfg.sim.engine.expressions import evaluate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pidcfg.schemas.scenario import Plant as PlantText

# ----------------------------------------------------------------------------------------------------------------------
# The processes that controllers act on; each advances by the exact solution of its equation over one step, a base step
# or an equal part of it. The input ``u`` is held over a step, so the step of a linear plant has a closed form whose
# coefficients are worked out beforehand: no error grows with the size of the step. A dead time of (n + f) steps,
# 0 < f < 1, makes two moves of each step: for f of it the input of n + 1 steps ago still acts, then that of n steps
# ago. All delay lines share one buffer. Noise belongs to the measurement alone and never enters a state.

FIRST_ORDER, SECOND_ORDER, INTEGRATOR, LEAD_LAG, DEAD_TIME, VALVE, PULSES = range(7)
MODELS = {
    "first_order": FIRST_ORDER,
    "second_order": SECOND_ORDER,
    "integrator": INTEGRATOR,
    "lead_lag": LEAD_LAG,
    "dead_time": DEAD_TIME,
    "valve": VALVE,
    "pulses": PULSES,
}
PERCENT = 100.0
"""What the input of pulses is a share in."""
TICKS_IN_A_PERIOD = 1000.0
"""By default, as the manual of the DL06 programs it: 1000 ticks of 10 ms."""
PERIOD_TOLERANCE = 1e-6
"""A share of a step by which the end of a period may be missed."""


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
    """Dead time in steps, rounded up."""
    head: int = 0
    late_share: float = 0.0
    """The share of a step for which the older input still acts; 0: a whole dead time, or none."""
    a: float = 0.0
    """First order: 1 − e^(−dt/T). Integrator, pulses: dt. Valve: largest move in a step. Second order: Φ11."""
    b: float = 0.0
    """Lead/lag: lead over lag. Valve: stiction band. Pulses: period. Second order: Φ12."""
    c: float = 0.0
    """Second order: Φ21. Pulses: resolution."""
    d: float = 0.0
    """Second order: Φ22."""
    late_a: float = 0.0
    """The same four over the part in which the older input acts; those above are of the rest."""
    late_b: float = 0.0
    late_c: float = 0.0
    late_d: float = 0.0
    y: float = 0.0
    """The value."""
    x: float = 0.0
    """Second order: dy/dt. Lead/lag: the lagged input. Valve: the position. Pulses: how old the period is."""
    moving: int = 0
    """Valve: whether it moves. Pulses: the time on of this period, in steps of their resolution."""
    held_input: float = 0.0
    """The last input that had a value."""
    fault: int = 0
    """Why an input had no value, the first time (`pidcfg.sim.engine.expressions.FAULTS`), and at which base step."""
    fault_at: int = 0


def step_plants(
    k: int,
    parts: int,
    plants: Sequence[Plant],
    delay: MutableSequence[float],
    signals: MutableSequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> None:
    """All plants through the parts of one base step, in the order in which they depend on each other (kernel)."""
    for _ in range(parts):
        for i in range(len(plants)):
            p = plants[i]
            u = signals[p.source] if p.source >= 0 else read_expression(k, p, signals, code, constants, stack)
            if p.length > 0:
                u = delayed_input(p, u, delay)
                if p.late_share > 0.0:
                    p.y = within_limits(p, next_value(p, u, p.late_a, p.late_b, p.late_c, p.late_d))
                    u = delay[p.delay + p.head]
            if p.model == FIRST_ORDER:
                y = p.y
                y += p.a * (p.gain * u + p.load - y)
            else:
                y = next_value(p, u, p.a, p.b, p.c, p.d)
            if y > p.high or y < p.low:
                y = within_limits(p, y)
            p.y = y
            signals[p.slot] = y


def within_limits(p: Plant, y: float) -> float:
    """A value that stops at the plant's limits; one of second order comes to rest there, D642 (kernel)."""
    if p.low <= y <= p.high:
        return y
    if p.model == SECOND_ORDER:
        p.x = 0.0
    return p.high if y > p.high else p.low


def read_expression(
    k: int,
    p: Plant,
    signals: Sequence[float],
    code: Sequence[int],
    constants: Sequence[float],
    stack: MutableSequence[float],
) -> float:
    """The value of a plant's input; the last one when it has none now (kernel)."""
    u = evaluate(code, constants, p.first, p.last, signals, stack)
    if stack[0] == 0.0:
        p.held_input = u
    elif p.fault == 0:
        p.fault = int(stack[0])
        p.fault_at = k
    return p.held_input


def delayed_input(p: Plant, u: float, delay: MutableSequence[float]) -> float:
    """What went into the plant's delay line as many steps ago as it is long; what comes next is newer (kernel)."""
    at = p.delay + p.head
    value = delay[at]
    delay[at] = u
    p.head += 1
    if p.head == p.length:
        p.head = 0
    return value


def next_value(p: Plant, u: float, a: float, b: float, c: float, d: float) -> float:
    """The value of a plant after a time with the input ``u``; the coefficients say how long it is (kernel)."""
    if p.model == INTEGRATOR:
        return p.y + a * (p.gain * u + p.load)
    if p.model == SECOND_ORDER:
        end = p.gain * u + p.load
        away = p.y - end
        value = end + a * away + b * p.x
        p.x = c * away + d * p.x
        return value
    if p.model == LEAD_LAG:
        p.x += a * (u - p.x)
        return p.gain * (p.x + b * (u - p.x)) + p.load
    if p.model == VALVE:
        return p.gain * move_valve(p, u, a, b) + p.load
    if p.model == PULSES:
        return p.gain * pulse_share(p, u, a, b, c) + p.load
    if p.model == FIRST_ORDER:
        return p.y + a * (p.gain * u + p.load - p.y)
    return p.gain * u + p.load


def move_valve(p: Plant, u: float, max_move: float, band: float) -> float:
    """The position of a valve: it sticks until it is off by its band, then moves at its rate (kernel)."""
    distance = u - p.x
    if p.moving == 0 and abs(distance) > band:
        p.moving = 1
    if p.moving == 1:
        if distance > max_move:
            p.x += max_move
        elif distance < -max_move:
            p.x -= max_move
        else:
            p.x = u
            p.moving = 0
    return p.x


def pulse_share(p: Plant, u: float, dt: float, period: float, resolution: float) -> float:
    """The share of a step for which the pulse is on; a period takes its time on at its beginning, D992 (kernel)."""
    if p.x >= period - PERIOD_TOLERANCE * dt:
        p.x = 0.0
        p.moving = time_on(u, period, resolution)
    end = p.x + dt
    on = min(max(p.moving * resolution - p.x, 0.0), dt, period - p.x)
    if end > period + PERIOD_TOLERANCE * dt:
        end -= period
        p.moving = time_on(u, period, resolution)
        on += min(p.moving * resolution, end)
    p.x = end
    return on / dt


def time_on(u: float, period: float, resolution: float) -> int:
    """The time on for an input in %, in steps of the resolution, to the nearest (kernel)."""
    return int(min(max(u, 0.0), PERCENT) / PERCENT * period / resolution + 0.5)


def add_noise(
    row: int, columns: int, plants: Sequence[Plant], noise: Sequence[float], signals: MutableSequence[float]
) -> None:
    """What transmitters with noise show; ``noise`` holds ``columns`` standard normal numbers a row (kernel)."""
    for i in range(len(plants)):
        p = plants[i]
        if p.column >= 0:
            signals[p.measured] = signals[p.slot] + p.sigma * noise[row * columns + p.column]


def lag_share(dt: float, time_constant: float) -> float:
    """The share of the way that a first-order lag goes in one step: 1 − e^(−dt/T)."""
    return -math.expm1(-dt / time_constant)


def second_order_matrix(dt: float, a2: float, a1: float) -> tuple[float, float, float, float]:
    """e^(A·dt) of ``a2``·y″ + ``a1``·y′ + y = 0, by rows; the three kinds of poles without cancellation.

    ``a2`` is T1·T2 or T², ``a1`` is T1 + T2 or 2ζT.
    """
    p = a1 / a2 / 2
    discriminant = p * p - 1 / a2
    if discriminant < 0:
        w = math.sqrt(-discriminant)
        decay = math.exp(-p * dt)
        c, s = decay * math.cos(w * dt), decay * math.sin(w * dt) / w
    else:
        w = math.sqrt(discriminant)
        slow, fast = math.exp(-dt / a2 / (p + w)), math.exp(-(p + w) * dt)
        c = (slow + fast) / 2
        apart = 2 * w * dt
        s = dt * fast if apart == 0 else dt * fast * math.expm1(apart) / apart if apart < 1 else (slow - fast) / 2 / w
    return c + p * s, s, -s / a2, c - p * s


def held_value(plant: Plant, u: float) -> float:
    """Where an input holds a plant; that of pulses is their mean."""
    if plant.model == PULSES:
        u = min(max(u, 0.0), PERCENT) / PERCENT
    return plant.gain * u + plant.load


def settle_at(plant: Plant, value: float | None, u: float, delay: MutableSequence[float]) -> None:
    """The plant at rest at ``value`` (None: where the input ``u`` holds it), its delay line full of that input.

    An integrator without ``value`` begins at 0; a plant without gain cannot be held and its line is full of 0.
    """
    end = held_value(plant, u)
    if value is None:
        value = 0.0 if plant.model == INTEGRATOR else end
    level = 0.0 if plant.model == INTEGRATOR else value
    held_input = (level - plant.load) / plant.gain if plant.gain else 0.0
    if not math.isfinite(held_input):
        held_input = 0.0
    if level == end:
        held_input = u
    plant.y = min(max(value, plant.low), plant.high)
    plant.x = held_input if plant.model in (LEAD_LAG, VALVE) else 0.0
    if plant.model == PULSES:
        plant.x, held_input = plant.b, u  # a period is over, so that the first step begins one
    plant.held_input = held_input
    plant.head = plant.moving = 0
    for at in range(plant.delay, plant.delay + plant.length):
        delay[at] = held_input


# ----------------------------------------------------------------------------------------------------------------------
# From the numbers of a plant, as the scenario gives them and events replace them, to the coefficients of its step.


def numbers_of(text: PlantText) -> dict[str, float]:
    """The numbers of a plant by key, as a ``disturb`` event may replace them."""
    fields = text.model_dump(exclude={"name", "model", "input", "time_constants", "limits", "dead_time", "initial"})
    numbers = {key: float(value) for key, value in fields.items() if value is not None}
    if text.time_constants is not None:
        numbers["first"], numbers["second"] = (float(t) for t in text.time_constants)
    if text.limits is not None:
        numbers["low"], numbers["high"] = (float(end) for end in text.limits)
    return numbers


def set_parameters(plant: Plant, numbers: Mapping[str, float], dt: float) -> None:
    """Writes a plant's numbers and works out the coefficients of its exact step of ``dt`` seconds."""
    plant.gain, plant.load, plant.sigma = numbers["gain"], numbers["load"], numbers["noise"]
    plant.low, plant.high = numbers.get("low", plant.low), numbers.get("high", plant.high)
    plant.late_a, plant.late_b, plant.late_c, plant.late_d = coefficients(plant.model, numbers, plant.late_share * dt)
    plant.a, plant.b, plant.c, plant.d = coefficients(plant.model, numbers, (1 - plant.late_share) * dt)


def coefficients(model: int, numbers: Mapping[str, float], dt: float) -> tuple[float, float, float, float]:
    """``a`` to ``d`` of a `Plant` over ``dt`` seconds."""
    if model == INTEGRATOR:
        return dt, 0.0, 0.0, 0.0
    if model == SECOND_ORDER:
        if "first" in numbers:
            a2, a1 = numbers["first"] * numbers["second"], numbers["first"] + numbers["second"]
        else:
            a2, a1 = numbers["time_constant"] ** 2, 2 * numbers["damping"] * numbers["time_constant"]
        return second_order_matrix(dt, a2, a1)
    if model == LEAD_LAG:
        return lag_share(dt, numbers["lag"]), numbers["lead"] / numbers["lag"], 0.0, 0.0
    if model == PULSES:
        period = numbers["period"]
        return dt, period, numbers.get("resolution", period / TICKS_IN_A_PERIOD), 0.0
    if model == VALVE:
        max_move = numbers["rate_limit"] * dt if "rate_limit" in numbers else math.inf
        return max_move, numbers["stiction"], 0.0, 0.0
    return (lag_share(dt, numbers["time_constant"]) if "time_constant" in numbers else 0.0), 0.0, 0.0, 0.0


# ----------------------------------------------------------------------------------------------------------------------
# Noise of transmitters: standard normal numbers, drawn by `random.gauss` or by kernels that give the same bits.
# `draw_normals` is Python's own generator, the Mersenne Twister with Box and Muller's transformation, as a kernel:
# compiled, it draws a number in a tenth of the time. The last bits of a logarithm or a sine depend on the mathematical
# library; where compiled code is not linked to Python's, `draws_as_python` tells, and Python draws.

Normals = Callable[
    [int, int, int, Sequence[int], MutableSequence[int], MutableSequence[float], MutableSequence[float]], int
]
"""The type of `draw_normals`."""

STATE_WORDS, MIXING_DISTANCE = 624, 397
"""Words of the generator's state, and how far apart those are that are mixed."""
UPPER_MASK, LOWER_MASK, TWIST_MATRIX = 0x80000000, 0x7FFFFFFF, 0x9908B0DF
FULL_TURN = 2.0 * math.pi
TRIED_NUMBERS = 4096
"""Numbers by which compiled code is held to Python's."""


UNSEEDED_WORDS = STATE_WORDS + 1
"""Words that are used up of a state that has none yet."""


def seed_words(key: Sequence[int], state: MutableSequence[int]) -> None:
    """The state that ``random.seed`` makes of a text, by the words that the generator has of it (kernel)."""
    state[0] = 19650218
    for i in range(1, STATE_WORDS):
        state[i] = (1812433253 * (state[i - 1] ^ (state[i - 1] >> 30)) + i) & 0xFFFFFFFF
    i, j = 1, 0
    for _ in range(max(STATE_WORDS, len(key))):
        state[i] = ((state[i] ^ ((state[i - 1] ^ (state[i - 1] >> 30)) * 1664525)) + key[j] + j) & 0xFFFFFFFF
        j = j + 1 if j + 1 < len(key) else 0
        i += 1
        if i == STATE_WORDS:
            state[0] = state[STATE_WORDS - 1]
            i = 1
    for _ in range(STATE_WORDS - 1):
        state[i] = ((state[i] ^ ((state[i - 1] ^ (state[i - 1] >> 30)) * 1566083941)) - i) & 0xFFFFFFFF
        i += 1
        if i == STATE_WORDS:
            state[0] = state[STATE_WORDS - 1]
            i = 1
    state[0] = 0x80000000
    state[STATE_WORDS] = STATE_WORDS


def renew_words(state: MutableSequence[int]) -> None:
    """The next 624 words of the Mersenne Twister (kernel)."""
    for i in range(STATE_WORDS):
        following = i + 1 if i + 1 < STATE_WORDS else 0
        mixed = i + MIXING_DISTANCE if i + MIXING_DISTANCE < STATE_WORDS else i + MIXING_DISTANCE - STATE_WORDS
        y = (state[i] & UPPER_MASK) | (state[following] & LOWER_MASK)
        state[i] = state[mixed] ^ (y >> 1) ^ (TWIST_MATRIX * (y & 1))
    state[STATE_WORDS] = 0


def draw_word(state: MutableSequence[int]) -> int:
    """32 random bits; the last number of the state counts the words that are used up (kernel)."""
    if state[STATE_WORDS] >= STATE_WORDS:
        renew_words(state)
    y = state[state[STATE_WORDS]]
    state[STATE_WORDS] += 1
    y ^= y >> 11
    y ^= (y << 7) & 0x9D2C5680
    y ^= (y << 15) & 0xEFC60000
    return y ^ (y >> 18)


def draw_uniform(state: MutableSequence[int]) -> float:
    """`random.random`: 53 random bits as a number from 0 up to 1 (kernel)."""
    high = draw_word(state) >> 5
    low = draw_word(state) >> 6
    return (high * 67108864.0 + low) * (1.0 / 9007199254740992.0)


def draw_normals(
    rows: int,
    column: int,
    columns: int,
    key: Sequence[int],
    state: MutableSequence[int],
    spare: MutableSequence[float],
    noise: MutableSequence[float],
) -> int:
    """Fills a column of ``rows`` with what ``random.gauss(0.0, 1.0)`` draws (kernel).

    The first ones are drawn from the seed that ``key`` stands for. Numbers come in pairs; ``spare`` holds the second
    one, and whether there is one.
    """
    if state[STATE_WORDS] == UNSEEDED_WORDS:
        seed_words(key, state)
    for row in range(rows):
        if spare[1] != 0.0:
            z = spare[0]
            spare[1] = 0.0
        else:
            angle = draw_uniform(state) * FULL_TURN
            radius = math.sqrt(-2.0 * math.log(1.0 - draw_uniform(state)))
            z = math.cos(angle) * radius
            spare[0] = math.sin(angle) * radius
            spare[1] = 1.0
        noise[row * columns + column] = 0.0 + z
    return rows


@dataclass(slots=True)
class Noise:
    """Noise by rows, of each row a number from each of the sources: what one draws depends on none of the others."""

    seeds: list[str]
    compiled: Normals | None = None
    """`draw_normals`, compiled; without it Python draws."""
    sources: Sequence[random.Random] = ()
    states: Sequence[tuple[array[int], array[int], array[float]]] = ()

    def __post_init__(self) -> None:
        if self.compiled is None:
            self.sources = [random.Random(seed) for seed in self.seeds]
        else:
            self.states = [unseeded_state(seed) for seed in self.seeds]

    def draw_rows(self, count: int) -> array[float]:
        """The next rows, one after the other."""
        columns = len(self.seeds)
        noise = array("d", bytes(8 * count * columns))
        for column, state in enumerate(self.states):
            if self.compiled is not None:
                self.compiled(count, column, columns, *state, noise)
        for column, source in enumerate(self.sources):
            noise[column::columns] = array("d", [source.gauss(0.0, 1.0) for _ in range(count)])
        return noise


def unseeded_state(seed: str) -> tuple[array[int], array[int], array[float]]:
    """What `draw_normals` draws from a seed with: the words that ``random.seed`` makes of it, and its state."""
    data = seed.encode()
    number = int.from_bytes(data + hashlib.sha512(data).digest(), "big")
    words = -(-number.bit_length() // 32)
    key = struct.unpack(f"<{words}I", number.to_bytes(4 * words, "little"))
    state = array("q", bytes(8 * (STATE_WORDS + 1)))
    state[STATE_WORDS] = UNSEEDED_WORDS
    return array("q", key), state, array("d", [0.0, 0.0])


def draws_as_python(compiled: Normals, count: int = TRIED_NUMBERS) -> bool:
    """Whether compiled code draws what Python does."""
    return Noise(["noise"], compiled).draw_rows(count).tobytes() == Noise(["noise"]).draw_rows(count).tobytes()
