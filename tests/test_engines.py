"""Whole runs in CPython and compiled: the same report and the same bits of every signal, over random scenarios."""

from __future__ import annotations

import random
from dataclasses import asdict

import pytest

from benchmarks.production import SETPOINTS, STEP, VENDORS, configuration, limit_cycle, loaded, ours
from pidcfg.sim.engine import choice as engine
from pidcfg.sim.engine import run
from pidcfg.sim.engine.recording import Recording

SCENARIOS = 4
MODELS = (
    "model: first_order, time_constant: {t}",
    "model: first_order, time_constant: {t}, dead_time: {d}",
    "model: second_order, time_constants: [{t}, 3], dead_time: {d}",
    "model: integrator, load: -0.4",
    "model: lead_lag, lead: 2, lag: {t}",
    "model: second_order, time_constant: {t}, damping: 0.3, dead_time: {d}, limits: [0, 70]",
    "model: integrator, load: 0.2, input: 1 - 0.1 * sqrt(abs({own})), dead_time: {d}",
    "model: valve, rate_limit: 2, dead_time: {d}",
)


class Signals(Recording):
    """Every value of every signal, as it is."""

    def take(self, rows_of_values, rows):
        self.values.setdefault("all", []).append(rows_of_values[: rows * self._width].tobytes())

    def end(self):
        pass


def random_scenario(rng, vendor, loops, steps):
    text = f"pidcfg: 1\nscenario: random\nconfig: c.yaml\nduration: {steps * STEP:g}\nstep: {STEP}\n"
    text += f"seed: {rng.randrange(10**6)}\nplants:\n"
    for i in range(loops):
        plant = rng.choice(MODELS).format(t=rng.choice([2, 20]), d=rng.choice([0.5, 3.2, 0.1]), own=f"T{i + 1}.PV")
        gain = rng.choice([0.05, 0.5, 1])
        noise = rng.choice(["", f", noise: {rng.choice([0.1, 2])}"])
        text += f"  T{i + 1}: {{{plant}, gain: {gain}, initial: {rng.choice([3, 30])}{noise}}}\n"
    events = []
    for _ in range(rng.randint(2, 6)):
        at, loop = rng.randrange(steps) * STEP, f"T{rng.randint(1, loops)}"
        key = SETPOINTS.get(vendor, "setpoint.value")
        kinds = (
            f"loop: {loop}, set: {{{key}: {rng.choice([20, 55, 92])}}}",
            f"loop: {loop}, set: {{{key}: {rng.randint(5, 95)}}}",
            f"loop: {loop}, disturb: {{gain: {rng.choice([0.2, 2])}}}",
            f"loop: {loop}, disturb: {{noise: {rng.choice([0, 1])}}}",
            f"loop: {loop}, pv: {rng.choice([0, 99])}, for: 20",
        )
        events.append(f"  - {{at: {at:g}, {rng.choice(kinds)}}}\n")
    return text + "events:\n" + "".join(events)


def outcome(case, name):
    signals = Signals()
    report = asdict(ours(case, name, recording=signals))
    return report.pop("engine"), report, signals.levels, b"".join(signals.values["all"])


def check(case):
    """Holds one engine to the other; returns the report and the number of signals' bytes."""
    (plain, *ours_plain), (fast, *ours_fast) = (outcome(case, name) for name in ("python", "numba"))
    assert (plain, fast) == ("python", "numba")
    assert repr(ours_plain[:2]) == repr(ours_fast[:2])
    assert ours_plain[2] == ours_fast[2]
    return ours_plain[0], len(ours_plain[2])


@pytest.mark.parametrize("vendor", VENDORS)
def test_random_runs_leave_the_same_bits_compiled_and_not(vendor, monkeypatch):
    pytest.importorskip("numba")
    monkeypatch.setattr(engine, "LOG_ROWS", 1)  # a full log returns to Python again and again
    rng = random.Random(vendor)
    moved = 0
    for _ in range(SCENARIOS):
        loops, steps = rng.randint(1, 3), rng.randint(150, 500)
        case = loaded(configuration(vendor, loops), random_scenario(rng, vendor, loops, steps))
        report, size = check(case)
        moved += sum(loop["metrics"]["iae"] is not None for loop in report["loops"].values())
        assert size == 8 * (steps + 1) * len(report["signals"])
    assert moved, "no loop came into control"


def test_a_loop_whose_alarms_come_and_go_leaves_the_same_bits_and_the_same_log():
    pytest.importorskip("numba")
    report, _ = check(loaded(*limit_cycle(1500)))

    assert len(report["loops"]["T1"]["alarms"]) > 20


class ChosenError(Exception):
    """Which engine a run would have taken."""


@pytest.mark.parametrize("drawn", [False, True])
@pytest.mark.parametrize("steady", [False, True])
@pytest.mark.parametrize("vendor", VENDORS)
def test_auto_asks_for_the_compiled_kernels_that_a_run_calls_and_for_no_others(monkeypatch, vendor, steady, drawn):
    compiler = pytest.importorskip("pidcfg.sim.engine.compile", reason="the extra fast")

    def choose(*arguments):
        raise ChosenError(true(*arguments))

    def kept(wanted, *_):
        asked.update(f.__name__ for f in wanted)
        return missing not in {f.__name__ for f in wanted}

    true = run.choose
    monkeypatch.setattr(run, "choose", choose)
    monkeypatch.setattr(compiler, "is_kept", kept)
    monkeypatch.setattr(engine, "holds_entries", "kernels".__eq__)
    monkeypatch.setattr(engine, "LOADING", 0)
    monkeypatch.setattr(engine, "KEPT", {})
    text = f"pidcfg: 1\nscenario: s\nconfig: c.yaml\nduration: 9\nstep: {STEP}\n" + "initial: steady\n" * steady
    text += "plants: {T1: {model: first_order, gain: 0.5, time_constant: 2" + ", noise: 1" * drawn + "}}\n"
    case = loaded(configuration(vendor, 1), text)
    called = {"advance", *["settle"] * steady, *["normals"] * drawn}
    for missing in ("", *called):
        asked = set()
        engine._in_cache.cache_clear()
        with pytest.raises(ChosenError, match="python" if missing else "numba"):
            ours(case, "auto")
        assert asked == called or (missing and asked < called)
    asked = set()
    engine._in_cache.cache_clear()
    monkeypatch.setattr(engine, "holds_entries", lambda _: False)
    with pytest.raises(ChosenError, match="python"):
        ours(case, "auto")
    assert not asked, "where nothing is kept, no compiler is asked"
    engine._in_cache.cache_clear()
