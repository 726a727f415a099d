"""The compiled CLICK: the same source through numba gives the same bits, over random PLCs with every feature."""

from __future__ import annotations

import math
import random

import pytest

from click_rig import image_of, poked
from compile_rig import advance
from pidcfg.sim.controllers.click import equation as bits
from pidcfg.sim.controllers.click.scan import INLINED, SIGNALS, load, scan
from pidcfg.sim.engine.compile import compile_functions

PLCS = 200
SEGMENTS, STEPS = 4, 150
BASE = 50_000
WIDTH = len(SIGNALS)
ODD = (0.0, -1.0, 1e30, math.inf, -math.inf, math.nan, 3.4e38)


def drive(first, last, configs, states, aux, signals, noise):  # noqa: PLR0917 - numba takes flat arrays
    """Base steps of first-order plants with noise, and the controllers (kernel)."""
    n = len(configs)
    for k in range(first, last):
        for i in range(n):
            at = WIDTH * n + i
            signals[at] = signals[at] + 0.03 * (0.9 * signals[configs[i].out_slot] - signals[at])
            signals[configs[i].in_slot] = signals[at] + noise[(k * n + i) % len(noise)]
        scan(k * BASE, configs, states, aux, signals)
    return last


def random_loop(rng):
    limits = sorted(round(rng.uniform(0, 90), 3) for _ in range(4))
    return {
        "sample_rate": f"{rng.choice([100, 150, 333, 500])} ms",
        "action": rng.choice(["direct", "direct", "reverse"]),
        "bumpless": rng.choice([1, 2]),
        "freeze_bias": rng.random() < 0.5,
        "tuning": {
            "proportional_gain": rng.choice([0.3, 2.4, 50]),
            "reset_time": rng.choice([0.5, 10, 600]),
            "derivative_gain": rng.choice([0, 0.7, 4]),
        },
        "derivative_gain_limit": rng.choice([0, 8, 20, 100]),
        "derivative_gain_limit_enabled": rng.random() < 0.5,
        "pv": {"range": [0, 90], "filter": rng.choice([3, 50, 100]), "filter_enabled": rng.random() < 0.5},
        "setpoint": {
            "value": round(rng.uniform(0, 90), 4),
            "lower_limit": 10,
            "upper_limit": 80,
            "lower_limit_enabled": rng.random() < 0.5,
            "upper_limit_enabled": rng.random() < 0.5,
        },
        "output": {
            "limits": rng.choice([[0, 100], [5.5, 80.1]]),
            "pwm": rng.choice([None, {"bit": "Y001", "period": 1}]),
        },
        "error": {"curve": rng.choice(["linear", "squared"]), "deadband": 0.3, "deadband_enabled": rng.random() < 0.3},
        "alarms": {
            "pv": dict(zip(("low_low", "low", "high", "high_high"), limits, strict=True)),
            "deviation": {"high": 3, "high_high": 6},
            "rate_of_change": 0.2,
            "hysteresis": rng.choice([0, 1.5]),
        },
        "autotune": {"method": rng.choice(["open", "closed"]), "type": rng.choice(["PID", "PI"])},
    }


def random_plc(rng):
    """Loops of a PLC, one in five with a register that holds anything."""
    image = image_of(*(random_loop(rng) for _ in range(rng.randint(1, 3))))
    if rng.random() < 0.2:
        name = rng.choice(["setpoint", "bias", "output", "pv_high", "hysteresis", "output_upper", "rate_of_change"])
        image = poked(image, **{name: rng.choice(ODD)})
    return load(image)


def random_event(rng, plc, i):
    """What an operator may do between two segments."""
    kind = rng.randrange(8)
    if kind < 3:
        plc.request(i, rng.choice(["manual", "auto", "auto", "auto"]))
    elif kind < 5:
        plc.request(i, "auto")
        plc.autotune(i, "start")
    elif kind == 5:
        plc.set(i, ("setpoint",), plc.check_set(i, ("setpoint",), round(rng.uniform(0, 90), 3)), plc.signal_values)
    elif kind == 6:
        plc.set(i, ("bias",), plc.check_set(i, ("bias",), round(rng.uniform(0, 100), 3)), plc.signal_values)
    else:
        plc.autotune(i, "cancel")


@pytest.fixture(scope="module")
def fast():
    return compile_functions([drive], inlined_kernels=INLINED)[drive]


def test_random_plcs_run_to_the_same_bits_compiled_and_not(fast):
    rng = random.Random(31)
    seen, errors, tuned, pulses = 0, set(), set(), set()
    for _ in range(PLCS):
        plc = random_plc(rng)
        configs, states, aux = plc.configs, plc.states, plc.aux
        signals = [*plc.signal_values, *(rng.uniform(0.0, 90.0) for _ in configs)]
        level = rng.choice([0.0, 0.3])
        noise = [rng.gauss(0.0, level) for _ in range(97)]
        for segment in range(SEGMENTS):
            for i in range(len(configs)):
                random_event(rng, plc, i)
            head = segment * STEPS, (segment + 1) * STEPS
            advance(drive, fast, head, (configs, states, aux, signals), noise)
            for c, s in zip(configs, states, strict=True):
                seen |= s.status
                errors.add(s.error_row)
                tuned |= {c.tune_closed} if s.tune_done == 1 else set()
                pulses |= {signals[c.pwm_slot]} if c.pwm else set()
                s.notice = 0
    every = bits.MODES | bits.ALARMS | bits.PID_ERROR | bits.TUNE_ERROR
    assert seen & every == every, "some mode, alarm or error never came up"
    assert len(errors) >= 3
    assert tuned == {0, 1}, "no autotune came to its end"
    assert pulses == {0.0, 1.0}
