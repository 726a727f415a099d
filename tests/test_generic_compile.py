"""The compiled ideal PID: the same source through numba gives the same bits, over random loops with every feature."""

from __future__ import annotations

import random

import pytest

from compile_rig import advance, check_types
from generic_rig import Rig
from pidcfg.sim.controllers.generic import equation as bits
from pidcfg.sim.controllers.generic.scan import INLINED, SIGNALS, scan
from pidcfg.sim.engine.compile import compile_functions

FILES = 160
SEGMENTS, STEPS = 4, 250
BASE = 50_000
WIDTH = len(SIGNALS)


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


def random_loop(rng, count):
    pick = rng.choice
    output = {"range": pick([[0, 100], [-50, 50], [4, 20]]), "bias": pick([0, 0, 12.3, 1e300])}
    if rng.random() < 0.4:
        output["max_rate"] = pick([0.5, 30])
    if rng.random() < 0.4:
        output["pulse"] = {"period": pick([0.37, 2, 5]), "min_on": pick([0, 0.3]), "min_off": pick([0, 0.4])}
    setpoint = {"value": round(rng.uniform(10, 60), 4)}
    if rng.random() < 0.5:
        setpoint["source"] = f"L{rng.randint(1, count)}"
    if rng.random() < 0.3:
        setpoint["limits"] = [15, 45]
    return {
        "mode": pick(["manual", "auto", "auto", "cascade"]),
        "output_raises_pv": rng.random() < 0.7,
        "sample_time": pick(["50 ms", "100 ms", "130 ms", "1 s"]),
        "deadband": pick([0, 0, 2.5]),
        "tuning": {
            "gain": pick([0.37, 3.1, 50, 1e300]),
            "integral_time": pick([0, 2.2, 21.3]),
            "derivative_time": pick([0, 0.9]),
            "proportional": rng.random() < 0.8,
            "derivative_on": pick(["pv", "error"]),
            "derivative_filter": pick([0, 0.3]),
        },
        "pv": {"range": pick([[0, 100], [-10, 80]]), "filter": pick([0, 0.7]), "square_root": rng.random() < 0.2},
        "setpoint": setpoint,
        "output": output,
        "anti_windup": rng.random() < 0.7,
        "alarms": {
            "pv": {"low_low": 5, "low": 10, "high": 60, "high_high": 70},
            "hysteresis": pick([0, 1.5]),
            "deviation": {"high": 5, "high_high": 20},
            "rate_of_change": pick([0.5, 30]),
        },
    }


def random_plc(rng):
    count = rng.randint(1, 3)
    plc = Rig(*(random_loop(rng, count) for _ in range(count))).plc
    signals = [*plc.signal_values, *(rng.uniform(0.0, 90.0) for _ in range(2 * count))]
    level = rng.choice([0.0, 0.0, 0.3])
    return plc, signals, [rng.choice([1.0, 0.03, -1.0]), *(rng.gauss(0.0, level) for _ in range(97))]


def random_event(rng, plc, i, signals):
    """What an operator may do between two segments."""
    if rng.random() < 0.6:
        plc.request(i, rng.choice(["manual", "auto", "auto", "cascade"]))
    key, value = rng.choice(
        [
            ("setpoint", rng.uniform(0, 90)),
            ("output", 33),
            ("sample_time", "150 ms"),
            ("tuning.integral_time", "off"),
            ("tuning.gain", 2),
            ("deadband", 4),
        ]
    )
    path = tuple(key.split("."))
    plc.set(i, path, plc.check_set(i, path, value), signals)


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_loops_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(7)
    seen, notices = 0, set()
    for _ in range(FILES):
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
                notices.add(plc.describe(s.notice))
                s.notice = 0
    assert seen == (bits.RATE << 1) - 1, "some mode, alarm or flag never came up"
    assert any(about for about, _ in notices)
    assert any(apart for _, apart in notices)


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
