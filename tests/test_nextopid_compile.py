"""The kernels of the virtual NextoPID compiled: the same bits as in CPython, over random programs with every block."""

from __future__ import annotations

import random

import pytest

from compile_rig import advance
from nextopid_rig import plc_of, random_program
from pidcfg.sim.controllers.nextopid import plc as modes
from pidcfg.sim.controllers.nextopid import terms as slots
from pidcfg.sim.controllers.nextopid.scan import INLINED, scan
from pidcfg.sim.engine.compile import compile_functions

PROGRAMS, SEGMENTS, STEPS, TICKS = 120, 4, 60, 100_000


def move_plants(k, loops, configs, signals, noise):
    """A first-order plant at each loop (kernel)."""
    for i in range(loops):
        c = configs[i]
        if c.in_slot != c.pv_slot:
            target = noise[0] * signals[c.out_slot] + noise[1]
            signals[c.in_slot] += 0.05 * (target - signals[c.in_slot]) + noise[2 + (k * loops + i) % (len(noise) - 2)]


def drive(first, last, loops, configs, states, aux, signals, noise):  # noqa: PLR0917 - numba takes flat arrays
    """Cycles with plants and noise (kernel)."""
    for k in range(first, last):
        move_plants(k, loops, configs, signals, noise)
        scan(k * TICKS, configs, states, aux, signals)
    return last


def disturb(rng, plc, states, signals):
    """What an operator may do between two segments."""
    for i, loop in enumerate(plc.loops):
        s, kind = states[i], rng.randrange(6)
        tuning = plc.configs[i].kind in {slots.PIDA_TUNE_REAL, slots.PIDA_TUNE_INT}
        if kind == 0:
            s.command |= rng.choice([modes.MANUAL_ON, modes.MANUAL_OFF])
        elif kind == 1 and plc.configs[i].kind != slots.ON_OFF:
            s.command |= rng.choice([modes.CASC_ON, modes.CASC_OFF])
        elif kind in {2, 3} and tuning:
            s.command |= rng.choice([modes.TUNE_ON, modes.TUNE_ON, modes.TUNE_OFF, modes.ACCEPT])
        elif kind == 4:
            signals[plc.layout.numbers[f"{loop}.SP"]] = float(rng.randrange(10, 90))
    for name in ("A", "B"):
        signals[plc.layout.numbers[name]] = rng.uniform(-5, 60)
    for name in ("Sw1", "Sw2"):
        signals[plc.layout.numbers[name]] = float(rng.random() < 0.5)


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_programs_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(41)
    seen, tuned, faults = set(), set(), 0
    for _ in range(PROGRAMS):
        plc = plc_of(random_program(rng))
        configs, states, aux, signals = plc.configs, plc.states, plc.aux, plc.signal_values
        level = rng.choice([0.0, 0.0, 0.2])
        noise = [rng.choice([0.9, 0.9, -0.6]), rng.uniform(0, 60), *(rng.gauss(0.0, level) for _ in range(97))]
        for segment in range(SEGMENTS):
            disturb(rng, plc, states, signals)
            head = segment * STEPS, (segment + 1) * STEPS, len(plc.loops)
            advance(drive, fast, head, (configs, states, aux, signals), noise)
        seen |= {c.kind for c in configs}
        tuned |= {s.tune_outcome for s in states}
        faults += sum(s.fault != 0 for s in states)
    assert seen == set(slots.KINDS.values())
    assert tuned > {modes.RUNNING, modes.FAILED, modes.CANCELLED}
    assert faults
