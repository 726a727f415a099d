"""The compiled DPIDE: the same source through numba gives the same bits, over random PLCs with every feature."""

from __future__ import annotations

import random

import pytest

from compile_rig import advance, check_types
from dpide_rig import program_of
from pidcfg.sim.controllers.dpide import equation as bits
from pidcfg.sim.controllers.dpide.scan import INLINED, SIGNALS, load, scan
from pidcfg.sim.controllers.kernels import NEVER
from pidcfg.sim.engine.compile import compile_functions

PLCS = 220
SEGMENTS, STEPS = 5, 250
BASE = 50_000
WIDTH = len(SIGNALS)
ODD = (0.0, -1.0, 1e30, -1e30, 3.4e38, -3.4e38, 1e-40)


def drive(first, last, configs, states, aux, signals, noise):  # noqa: PLR0917 - numba takes flat arrays
    """Base steps of second-order plants with noise, and the controllers (kernel)."""
    n = len(configs)
    for k in range(first, last):
        for i in range(n):
            at = WIDTH * n + 2 * i
            signals[at] = signals[at] + 0.05 * (noise[0] * signals[configs[i].out_slot] + 5.0 - signals[at])
            signals[at + 1] = signals[at + 1] + 0.15 * (signals[at] - signals[at + 1])
            signals[configs[i].in_slot] = signals[at + 1] + noise[1 + (k * n + i) % (len(noise) - 1)]
        scan(k * BASE, configs, states, aux, signals)
    return last


def random_loop(rng):
    low, high = rng.choice([(0, 100), (0, 4000), (-50, 50), (80, -20), (10, 10), (5.5, 80.1)])
    given = {
        "PID_RUN": rng.random() < 0.9,
        "SV": round(rng.uniform(10, 60), 4),
        "PID_MODE": rng.choice([0, 0, 1, 2, 2]),
        "PID_MAN": rng.random() < 0.2,
        "MOUT_AUTO": rng.random() < 0.5,
        "CYCLE": rng.choice([50, 100, 130, 500]),
        "Kc_Kp": rng.choice([0, 0.37, 3.1, 50]),
        "Ti_Ki": rng.choice([0, 0.2, 0.7, 21.3]),
        "Td_Kd": rng.choice([0, 0, 0.9]),
        "Tf": rng.choice([0, 0.3]),
        "PID_EQ": rng.random() < 0.5,
        "PID_DE": rng.random() < 0.5,
        "PID_DIR": rng.random() < 0.7,
        "ERR_DBW": rng.choice([0, 0, 2.5, -1]),
        "MV_MAX": high,
        "MV_MIN": low,
        "MOUT": rng.choice([0, 42.5, 900]),
        "BIAS": rng.choice([0, 0, 12.3]),
    }
    if rng.random() < 0.1:
        given[rng.choice(["SV", "Kc_Kp", "Ti_Ki", "Td_Kd", "Tf", "MV_MAX", "MOUT", "BIAS"])] = rng.choice(ODD)
    return given


def random_plc(rng):
    count = rng.randint(1, 3)
    inputs = [{"MV": f"D{2 * i}", rng.choice(["SV", "BIAS", "MOUT"]): f"D{2 * rng.randrange(3)}"} for i in range(count)]
    for given in inputs:
        if rng.random() < 0.3:
            given["MOUT"] = given["MV"]
    devices = inputs if rng.random() < 0.3 else None
    plc = load(program_of(*(random_loop(rng) for _ in range(count)), devices=devices))
    signals = [*plc.signal_values, *(rng.uniform(0.0, 90.0) for _ in range(2 * len(plc.configs)))]
    level = rng.choice([0.0, 0.0, 0.3])
    return plc, signals, [rng.choice([1.0, 0.03, -1.0, 0.0]), *(rng.gauss(0.0, level) for _ in range(97))]


def random_event(rng, plc, i, signals):
    """What an operator may do between two segments."""
    kind = rng.randrange(9)
    if kind < 3:
        plc.request(i, rng.choice(["manual", "auto", "auto", "off"]))
    elif kind < 5:
        plc.set(i, ("PID_RUN",), True, signals)
        plc.autotune(i, "start")
    elif kind == 5:
        plc.autotune(i, "cancel")
    elif kind == 6:
        plc.program(signals)
        plc.run(plc.states[i].due // BASE * BASE if plc.states[i].due < NEVER else 0)
    else:
        key, value = rng.choice(
            [
                ("SV", rng.uniform(0, 90)),
                ("output", 33),
                ("MOUT_AUTO", True),
                ("I_MV", 7),
                ("CYCLE", 150),
                ("ERR_DBW", 4),
                ("PID_MODE", 2),
                ("Tf", 0.2),
            ]
        )
        plc.set(i, (key,), plc.check_set(i, (key,), value), signals)


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_plcs_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(41)
    seen, ends, reasons = 0, set(), set()
    for _ in range(PLCS):
        plc, signals, noise = random_plc(rng)
        configs, states, aux = plc.configs, plc.states, plc.aux
        for segment in range(SEGMENTS):
            for i in range(len(configs)):
                if segment:
                    random_event(rng, plc, i, signals)
            head = segment * STEPS, (segment + 1) * STEPS
            advance(drive, fast, head, (configs, states, aux, signals), noise)
            for s in states:
                seen |= s.status
                ends.add(s.tune_done)
                reasons.add(plc.describe(s.notice)[1].partition(":")[0])
                s.notice = 0
    every = bits.MODES | bits.LIMITED | bits.IN_DEAD_BAND | bits.TUNE_ERROR
    assert seen & every == every, "some mode or flag never came up"
    assert ends == {0, 1, 2, 3}, "some end of an autotune never came up"
    assert {"autotune stopped", "autotune ended without results", "MV jumps at the end of manual"} <= reasons


def test_fields_have_the_type_that_they_are_declared_with():
    """A float in a field of whole numbers would be cut off when it is compiled."""
    rng = random.Random(3)
    for _ in range(40):
        plc, signals, noise = random_plc(rng)
        for segment in range(3):
            for i in range(len(plc.configs)):
                random_event(rng, plc, i, signals)
            drive(segment * 200, segment * 200 + 200, plc.configs, plc.states, plc.aux, signals, noise)
        check_types([*plc.configs, *plc.states])
