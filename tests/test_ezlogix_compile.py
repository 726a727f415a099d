"""The kernels of the virtual EZLogix compiled: the same bits as in CPython, over random loops with every feature."""

from __future__ import annotations

import random

import pytest

from compile_rig import advance, check_types
from ezlogix_rig import COLUMNS, SIGNALS
from pidcfg.sim.controllers.autotune import POINTS
from pidcfg.sim.controllers.ezlogix import equation as bits
from pidcfg.sim.controllers.ezlogix.equation import Config, State, calculate_gains
from pidcfg.sim.controllers.ezlogix.scan import INLINED, scan
from pidcfg.sim.controllers.kernels import round_half_even
from pidcfg.sim.engine.compile import compile_functions

CONFIGURATIONS = 320
SEGMENTS, STEPS = 4, 120
BASE = 50_000


def drive(first, last, configs, states, aux, signals, noise):  # noqa: PLR0917 - numba takes flat arrays
    """Base steps of first-order plants with noise, and the controllers (kernel)."""
    n = len(configs)
    for k in range(first, last):
        for i in range(n):
            at = COLUMNS * n + i
            signals[at] = signals[at] + 0.03 * (noise[0] * signals[COLUMNS * i + 3] + noise[1] - signals[at])
            signals[COLUMNS * i] = signals[at] + noise[2 + (k * n + i) % (len(noise) - 2)]
        scan(k * BASE, configs, states, aux, signals)
    return last


def random_config(rng, i, n):
    low, high = rng.choice([(0.0, 4095.0), (819.0, 4095.0), (0.0, 65535.0)])
    c = Config(period=rng.choice([50_000, 50_000, 100_000, 130_000, 500_000]))
    for k, slot in enumerate(SIGNALS):
        setattr(c, slot, COLUMNS * i + k)
    c.pv_min, c.pv_max, c.pv_span, c.pv_low, c.pv_width = low, high, high - low, -20.0, 140.0
    c.out_low, c.out_width = rng.choice([(0.0, 4095.0), (-10.0, 73.0)])
    c.runs_when_stopped, c.fetches_pv, c.carries_output = (int(rng.random() < 0.5) for _ in range(3))
    c.inner_loop = rng.randrange(n) if n > 1 and rng.random() < 0.3 else -1
    c.inner_loop = -1 if c.inner_loop == i else c.inner_loop
    c.outer_loop = rng.choice([-1, -1, (i + 1) % n]) if n > 1 else -1
    c.direct, c.velocity, c.anti_windup, c.tune_pi = (int(rng.random() < 0.5) for _ in range(4))
    c.square_root = int(rng.random() < 0.25)
    c.scale = c.pv_span**0.5 if c.square_root else 1.0
    c.deadband = rng.choice([0.0, 0.0, 1.0, 30.0])
    if rng.random() < 0.5:
        c.sp_low, c.sp_high = low + 100.0, low + 2000.0
    else:
        c.sp_low, c.sp_high = 0.0, 65535.0
    c.cv_low_limit, c.cv_high_limit = rng.choice([(0.0, 4095.0), (0.0, 4095.0), (400.0, 3600.0), (3000.0, 1000.0)])
    c.offset = rng.choice([0.0, 0.0, 1234.0])
    if rng.random() < 0.6:
        c.cycle, c.min_on, c.min_off = rng.choice([120_000, 1_000_000, 3_000_000]), 100_000 * rng.randrange(3), 70_000
    c.timeout = rng.choice([3_000_000, 600_000_000])
    c.tune_buffer = i * POINTS
    return c


def random_state(rng, c):
    s = State(period=c.period, gain=rng.choice([0.0, 0.37, 3.1]), reset=rng.choice([0.0, 0.7, 21.3]))
    s.rate = rng.choice([0.0, 0.0, 0.9])
    s.sp = round_half_even(c.pv_min + (c.pv_span**0.5 if c.square_root else c.pv_span) * rng.random())
    s.out = round_half_even(4095.0 * rng.random())
    s.tune_countdown = c.timeout
    calculate_gains(s)
    return s


def random_event(rng, c, s):
    """What an operator may do between two segments."""
    kind = rng.randrange(6)
    if kind in {0, 1}:
        s.wanted_mode, s.pending = rng.choice([bits.MANUAL, bits.AUTO, bits.AUTO]), s.pending | bits.REQUEST
    elif kind in {2, 3}:
        s.tune_command, s.pending = rng.choice([1, 1, 1, 2]), s.pending | bits.TUNE
        s.out = min(s.out, 3000.0)
    elif kind == 4:
        s.pending ^= rng.choice([bits.PV_STALE, bits.OUTPUT_CUT, bits.STOPPED])
    else:
        s.sp = round_half_even(c.pv_min + c.pv_span * rng.random())


def random_plc(rng):
    n = rng.randint(1, 4)
    configs = [random_config(rng, i, n) for i in range(n)]
    states = [random_state(rng, c) for c in configs]
    signals = [rng.uniform(-10.0, 110.0) for _ in range((COLUMNS + 1) * n)]
    level = rng.choice([0.0, 0.0, 0.3])
    noise = [rng.choice([0.02, -0.02, 0.3, 0.0]), rng.uniform(0, 60), *(rng.gauss(0.0, level) for _ in range(97))]
    return configs, states, [0.0] * (n * POINTS), signals, noise


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_loops_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(21)
    seen, ends, pulses = 0, set(), set()
    for _ in range(CONFIGURATIONS):
        configs, states, aux, signals, noise = random_plc(rng)
        for segment in range(SEGMENTS):
            for c, s in zip(configs, states, strict=True):
                random_event(rng, c, s)
            head = segment * STEPS, (segment + 1) * STEPS
            advance(drive, fast, head, (configs, states, aux, signals), noise)
            for c, s in zip(configs, states, strict=True):
                seen |= s.status
                ends.add(s.last_tune_status)
                pulses.add((c.cycle > 0, signals[c.pulse_slot]))
    assert seen == bits.MODES | bits.SATURATED | bits.TUNING | bits.TUNE_ERROR, "some mode or flag never came up"
    assert {3, 4, 5, 6, 8, 9} <= ends, "some end of an autotune never came up"
    assert {(True, 0.0), (True, 1.0)} <= pulses


def test_fields_have_the_type_that_they_are_declared_with():
    """A float in a field of whole numbers would be cut off when it is compiled."""
    rng = random.Random(3)
    for _ in range(20):
        configs, states, aux, signals, noise = random_plc(rng)
        for c, s in zip(configs, states, strict=True):
            random_event(rng, c, s)
        drive(0, 60, configs, states, aux, signals, noise)
        check_types([*configs, *states])
